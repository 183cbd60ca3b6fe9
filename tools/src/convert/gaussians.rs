//! Surfaces, hierarchies and trained scenes: converted to 3D Gaussians for other viewers.

use super::Convert;
use crate::{
    failure::{Failure, in_file},
    load::Input,
    output,
    progress::Progress,
    render::milliseconds,
};
use serde_json::json;
use splatkit::{
    Error, formats,
    formats::Kind,
    gaussians::{Gaussians, harmonics},
    memory,
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// The Gaussians of all inputs.
struct Gathered {
    set: Gaussians,
    /// The points of the inputs.
    points: u64,
    read_ms: f64,
}

/// A way to write Gaussians.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    Ply,
    CompressedPly,
    Splat,
    Spz,
    Glb,
}

impl Target {
    /// Returns the target that the name of a file asks for.
    fn of(path: &Path) -> Self {
        let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase());
        let name = name.unwrap_or_default();
        let ends = |end: &str| name.ends_with(end);
        match () {
            () if ends(".compressed.ply") => Self::CompressedPly,
            () if ends(".splat") => Self::Splat,
            () if ends(".spz") => Self::Spz,
            () if ends(".glb") => Self::Glb,
            () => Self::Ply,
        }
    }

    fn write(self, set: &Gaussians, path: &Path) -> splatkit::Result<()> {
        match self {
            Self::Ply => formats::ply::write_gaussians(set, path),
            Self::CompressedPly => formats::ply::write_compressed_gaussians(set, path),
            Self::Splat => formats::splat::write(set, path),
            Self::Spz => formats::spz::write(set, path),
            Self::Glb => formats::gltf::write_gaussians(set, path),
        }
    }

    /// Returns the most bytes of a Gaussian with colours of a degree.
    fn bytes(self, degree: u32) -> u64 {
        let more = 3 * (harmonics::terms(degree) as u64 - 1);
        match self {
            Self::Ply => 4 * (17 + more),
            Self::CompressedPly => 17 + more,
            Self::Splat => 32,
            Self::Spz => 20 + more,
            Self::Glb => 4 * (18 + more),
        }
    }
}

impl Convert {
    /// Writes the Gaussians of all inputs, in the format that the output's name asks for.
    pub(super) fn gaussians(self, progress: &Progress) -> Result<(), Failure> {
        let target = Target::of(&self.output);
        let Gathered { mut set, points, read_ms } = self.gather_gaussians(progress)?;
        if let Some(degree) = self.surface.degree {
            set.set_degree(degree.min(set.degree));
        }
        if self.dry_run {
            let bytes = set.len() as u64 * target.bytes(set.degree);
            progress.clear();
            if self.json {
                return output::line(json!({
                    "points": points,
                    "splats": set.len(),
                    "expected_bytes": bytes,
                    "read_ms": read_ms,
                }));
            }
            output::line(format_args!("points          {points}"))?;
            output::line(format_args!("splats          {}", set.len()))?;
            return output::line(format_args!("bytes           at most {bytes}"));
        }
        progress.stage(format!("Writing {}", self.output.display()));
        let start = Instant::now();
        target.write(&set, &self.output)?;
        progress.clear();
        let write_ms = milliseconds(start);
        let bytes = self.output.metadata().map_err(|e| Error::file(&self.output, "read", e))?.len();
        let per_splat = bytes as f64 / set.len().max(1) as f64;
        if self.json {
            return output::line(json!({
                "file": self.output.to_string_lossy(),
                "points": points,
                "splats": set.len(),
                "degree": set.degree,
                "bytes": bytes,
                "bytes_per_splat": per_splat,
                "read_ms": read_ms,
                "write_ms": write_ms,
            }));
        }
        output::line(format_args!("points          {points}"))?;
        output::line(format_args!("splats          {}", set.len()))?;
        output::line(format_args!("degree          {}", set.degree))?;
        output::line(format_args!("bytes           {bytes} ({per_splat:.2} a splat)"))?;
        let [read, write] = [read_ms, write_ms].map(|ms| ms / 1e3);
        output::line(format_args!("time            {read:.2} s reading, {write:.2} s writing"))
    }

    /// Reads all inputs as Gaussians.
    fn gather_gaussians(&self, progress: &Progress) -> Result<Gathered, Failure> {
        let mut gathered: Option<Gathered> = None;
        for path in &self.files {
            let own = self.gaussians_of(path, progress)?;
            match &mut gathered {
                None => gathered = Some(own),
                Some(all) => {
                    all.set.join(own.set).map_err(|error| in_file(path, error))?;
                    all.points += own.points;
                    all.read_ms += own.read_ms;
                }
            }
        }
        gathered.ok_or_else(|| Failure::Usage("there is nothing to convert".into()))
    }

    /// Returns the Gaussians of an input: its own, or those of its splats.
    fn gaussians_of(&self, path: &PathBuf, progress: &Progress) -> Result<Gathered, Failure> {
        let start = Instant::now();
        if self.load.kind(path)? != Kind::Gaussians {
            let (set, points) = self.surfels_of(path, progress)?;
            let set = Gaussians::from_splats(&set).map_err(|error| in_file(path, error))?;
            return Ok(Gathered { set, points, read_ms: milliseconds(start) });
        }
        progress.stage(format!("Reading {}", path.display()));
        self.color.check_effect(false, false)?;
        let (most, mut read) = (self.surface.memory.or_else(memory::most), Vec::new());
        let input = self.load.open_within(path, most, &mut read)?;
        self.check_unneeded(&read)?;
        let Input::Gaussians(mut set) = input else {
            return Err(Error::input(path, "file", "holds no Gaussians").into());
        };
        let scale = self.surface.radius_scale();
        set.scales.iter_mut().for_each(|own| *own *= scale);
        let points = set.len() as u64;
        Ok(Gathered { set, points, read_ms: milliseconds(start) })
    }
}
