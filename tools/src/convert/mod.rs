//! `splatkit convert`: what is written decides what is made of the inputs.

mod bricks;
mod external;
mod memory;
mod source;
mod surface;
mod volume;

use crate::{failure::Failure, load::LoadFlags, output, progress::Progress};
use clap::Args;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct Convert {
    /// Meshes, clouds and hierarchies, which become one; or a volume.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// The file to write. Of meshes, clouds and hierarchies: .splk, a hierarchy of splats, or .ply, the splats of the finest
    /// level as 3D Gaussians for other viewers. Of volumes: .nrrd, or .splv, levels of bricks that are read one by one.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    surface: surface::SurfaceFlags,
    /// Resamples a Cartesian volume: bcc is the body-centred cubic lattice, 29.3 % fewer samples for the same detail in all
    /// directions [default: the file's lattice]
    #[arg(long, value_name = "NAME")]
    lattice: Option<volume::Wanted>,
    /// Replaces a file that is there already.
    #[arg(long)]
    overwrite: bool,
    /// Tells how large the result would be and what making it would take, by trying a part; writes nothing.
    #[arg(long)]
    dry_run: bool,
    /// Writes JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    load: LoadFlags,
}

impl Convert {
    pub fn run(self, progress: &Progress) -> Result<(), Failure> {
        let extension = self
            .output
            .extension()
            .map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let extension = extension.unwrap_or_default();
        if !["splk", "ply", "nrrd", "splv"].contains(&extension.as_str()) {
            let file = self.output.display();
            return Err(Failure::Usage(format!(
                "{file}: only .splk, .ply, .nrrd and .splv files can be written"
            )));
        }
        self.surface.check(&extension)?;
        if !self.dry_run {
            output::check(&self.output, self.overwrite)?;
            output::try_writing(&self.output, &self.files)?;
        }
        match extension.as_str() {
            "nrrd" => self.volume(progress),
            "splv" => self.bricks(progress),
            _ => self.surface(&extension, progress),
        }
    }

    /// Refuses to replace a file that was read.
    fn check_unneeded(&self, read: &[PathBuf]) -> Result<(), Failure> {
        if self.dry_run { Ok(()) } else { output::check_unneeded(&self.output, read) }
    }

    /// The bytes of memory that a conversion may take.
    fn most_memory(&self) -> u64 {
        self.surface.memory.or_else(splatkit::memory::most).unwrap_or(u64::MAX)
    }
}
