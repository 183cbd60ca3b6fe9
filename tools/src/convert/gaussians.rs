//! Trained scenes: converted to hierarchies; and all surfaces: to 3D Gaussians for other viewers.

use super::{Convert, surface::Frame};
use crate::{
    failure::{Failure, in_file},
    output,
    progress::Progress,
    timing::milliseconds,
};
use serde_json::json;
use splatkit::{
    Error,
    about::Stance,
    formats,
    formats::Kind,
    gaussians::{Gaussians, harmonics},
    hierarchy::{self, BuildOptions, Hierarchy, file::WriteOptions},
    memory,
    session::Data,
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

/// What was written.
struct Written<'a> {
    set: &'a Gaussians,
    points: u64,
    bytes: u64,
    read_ms: f64,
    write_ms: f64,
}

/// Number of Gaussians that a dry run tries.
const SAMPLE: usize = 1 << 17;

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
        let target = Target::of(self.output());
        let is_trained = self.are_gaussians()?;
        let Gathered { mut set, points, read_ms } = self.gather_gaussians(progress)?;
        if let Some(degree) = self.surface.degree {
            set.set_degree(degree.min(set.degree));
        }
        if is_trained && target != Target::Glb {
            // Viewers expect the frame of trainers in these files.
            set.stand(Stance::Y_DOWN);
        }
        if self.dry_run {
            let bytes = set.len() as u64 * target.bytes(set.degree);
            progress.clear();
            return self.say_expected(&set, points, bytes, "at most", read_ms);
        }
        progress.stage(format!("Writing {}", self.output().display()));
        let start = Instant::now();
        target.write(&set, self.output()).map_err(|error| self.at_fault(error))?;
        progress.clear();
        let write_ms = milliseconds(start);
        let bytes =
            self.output().metadata().map_err(|e| Error::file(self.output(), "read", e))?.len();
        self.say(&Written { set: &set, points, bytes, read_ms, write_ms })
    }

    /// Prints what would be written.
    fn say_expected(
        &self,
        set: &Gaussians,
        points: u64,
        bytes: u64,
        how: &str,
        read_ms: f64,
    ) -> Result<(), Failure> {
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
        output::line(format_args!("bytes           {how} {bytes}"))
    }

    /// Prints what was written.
    fn say(&self, written: &Written) -> Result<(), Failure> {
        let &Written { set, points, bytes, read_ms, write_ms } = written;
        let per_splat = bytes as f64 / set.len().max(1) as f64;
        if self.json {
            return output::line(json!({
                "file": self.output().to_string_lossy(),
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

    /// Returns whether all inputs hold trained Gaussians, also in hierarchies.
    pub(super) fn are_gaussians(&self) -> Result<bool, Failure> {
        for path in &self.files {
            let is_one = match self.load.kind(path)? {
                Kind::Gaussians => true,
                Kind::Hierarchy => {
                    Hierarchy::open(path, &self.load.limits())?.header().degree.is_some()
                }
                _ => false,
            };
            if !is_one {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Builds a hierarchy of the Gaussians of all inputs.
    pub(super) fn gaussian_hierarchy(self, progress: &Progress) -> Result<(), Failure> {
        let Gathered { mut set, points, read_ms } = self.gather_gaussians(progress)?;
        if let Some(degree) = self.surface.degree {
            set.set_degree(degree.min(set.degree));
        }
        let start = Instant::now();
        let bar = progress.bar("Building the hierarchy", set.len() as u64);
        let watch = |done: u64, _: u64| bar.set(done);
        let frame =
            Frame { stance: set.about.stance, is_guessed: false, unit: set.about.length.clone() };
        let build = self.surface.build_options_of(false, points, self.load.limits().deadline());
        let write = self.surface.write_options(&self.files, &frame);
        if self.dry_run {
            return self.expect_gaussians(&set, points, &build, &write, read_ms);
        }
        let built = hierarchy::build_gaussians(&set, self.output(), &build, &write, Some(&watch));
        built.map_err(|error| self.at_fault(error))?;
        progress.clear();
        let bytes =
            self.output().metadata().map_err(|e| Error::file(self.output(), "read", e))?.len();
        self.say(&Written { set: &set, points, bytes, read_ms, write_ms: milliseconds(start) })
    }

    /// Prints what a hierarchy of Gaussians would take, extrapolated from a part of them.
    fn expect_gaussians(
        &self,
        set: &Gaussians,
        points: u64,
        build: &BuildOptions,
        write: &WriteOptions,
        read_ms: f64,
    ) -> Result<(), Failure> {
        let part = set.part(0..set.len().min(SAMPLE));
        let tree = hierarchy::Tree::of_gaussians(&part, build, None);
        let tree = tree.map_err(|error| self.at_fault(error))?;
        let share = set.len() as f64 / part.len() as f64;
        let bytes = hierarchy::file::to_bytes(&tree, write)?.len() as f64 * share;
        self.say_expected(set, points, bytes as u64, "about", read_ms)
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
        if self.load.kind(path)? == Kind::Hierarchy
            && let Some(mut set) = Hierarchy::open(path, &self.load.limits())?.gaussians()?
        {
            self.check_unneeded(std::slice::from_ref(path))?;
            let scale = self.surface.radius_scale();
            set.scales.iter_mut().for_each(|own| *own *= scale);
            let points = set.len() as u64;
            return Ok(Gathered { set, points, read_ms: milliseconds(start) });
        }
        if self.load.kind(path)? != Kind::Gaussians {
            let (set, points, stance) = self.surfels_of(path, progress)?;
            let mut set = Gaussians::from_splats(&set).map_err(|error| in_file(path, error))?;
            set.about.stance = stance;
            return Ok(Gathered { set, points, read_ms: milliseconds(start) });
        }
        progress.stage(format!("Reading {}", path.display()));
        self.color.check_effect(false, false)?;
        let most = self.surface.memory.or_else(memory::most);
        let Data::Gaussians(mut set) = self.data(path, most)? else {
            return Err(Error::input(path, "file", "holds no Gaussians").into());
        };
        // Files of trainers do not say what is up: it is −y.
        set.about.stance = set.about.stance.or(Some(Stance::Y_DOWN));
        let scale = self.surface.radius_scale();
        set.scales.iter_mut().for_each(|own| *own *= scale);
        let points = set.len() as u64;
        Ok(Gathered { set, points, read_ms: milliseconds(start) })
    }
}
