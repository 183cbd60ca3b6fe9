//! The flags that say how hierarchies and Gaussians are made.

use crate::{failure::Failure, parse};
use clap::{Args, ValueEnum};
use glam::DVec3;
use splatkit::{hierarchy, session::convert::Conversion};

/// The extensions of files that hold surfaces.
const SURFACES: [&str; 7] = ["splk", "ply", "splat", "spz", "sog", "json", "glb"];

/// How hierarchies are built.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Hierarchy")]
pub struct SurfaceFlags {
    /// Trade the time of building for the quality of the tree [default: balanced]
    #[arg(long, value_enum, value_name = "NAME")]
    preset: Option<Preset>,
    /// Keep every bit of the splats, at about eight times the size.
    #[arg(long)]
    lossless: bool,
    /// Scale all radii by this factor. Below 1, surfaces may show holes [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = parse::radius_scale)]
    radius_scale: Option<f32>,
    /// Record the direction that points up: x, y, z, -x, -y, -z or X,Y,Z [default: as the first
    /// input says that does; otherwise guessed from the shape of the first]
    #[arg(
        long,
        value_name = "AXIS",
        value_parser = parse::direction,
        allow_hyphen_values = true
    )]
    up: Option<DVec3>,
    /// Record the unit of lengths, such as m or mm, for viewers of the result [default: that of a
    /// converted hierarchy]
    #[arg(long, value_name = "NAME")]
    unit: Option<String>,
    /// Keep the colours of trained Gaussians up to this degree of spherical harmonics, 0 to 3
    /// [default: that of the file]
    #[arg(long, value_name = "DEGREE", value_parser = clap::value_parser!(u32).range(0..=3))]
    degree: Option<u32>,
    /// Write this version of SPZ, 3 or 4. Version 4 is smaller and is read faster, but not by
    /// programs of before 2026 [default: 3]
    #[arg(long, value_name = "VERSION", value_parser = clap::value_parser!(u32).range(3..=4))]
    spz_version: Option<u32>,
    /// Limit the memory of the conversion, such as 8GiB. Binary PLY of points or triangles, LAS and
    /// LAZ that need more are converted region by region, with temporary files of about their size
    /// beside the output. Raw volumes and NRRD files of raw encoding become .splv slice by slice.
    /// Region by region takes at least 200 MiB [default: three quarters of the machine's memory]
    #[arg(long, value_name = "BYTES", value_parser = parse::bytes)]
    memory: Option<u64>,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq)]
enum Preset {
    Fastest,
    Fast,
    Balanced,
    Slow,
    Best,
}

impl SurfaceFlags {
    /// Refuses flags that have no effect on files of this extension.
    pub(super) fn check(&self, extension: &str) -> Result<(), Failure> {
        let flags = [
            ("--preset", self.preset.is_some(), &["splk"][..]),
            ("--lossless", self.lossless, &["splk"]),
            ("--up", self.up.is_some(), &["splk"]),
            ("--unit", self.unit.is_some(), &["splk", "splv"]),
            ("--radius-scale", self.radius_scale.is_some(), &SURFACES),
            ("--degree", self.degree.is_some(), &SURFACES),
            ("--spz-version", self.spz_version.is_some(), &["spz"]),
        ];
        match flags.into_iter().find(|(_, is_given, of)| *is_given && !of.contains(&extension)) {
            Some((flag, _, of)) => {
                let mut of: Vec<String> =
                    of.iter().map(|extension| format!(".{extension}")).collect();
                let last = of.pop().unwrap_or_default();
                let of = if of.is_empty() { last } else { format!("{} and {last}", of.join(", ")) };
                Err(Failure::Usage(format!(
                    "{flag} is for {of} files; it has no effect on .{extension} files"
                )))
            }
            None => Ok(()),
        }
    }

    fn preset(&self) -> hierarchy::Preset {
        match self.preset.unwrap_or(Preset::Balanced) {
            Preset::Fastest => hierarchy::Preset::Fastest,
            Preset::Fast => hierarchy::Preset::Fast,
            Preset::Balanced => hierarchy::Preset::Balanced,
            Preset::Slow => hierarchy::Preset::Slow,
            Preset::Best => hierarchy::Preset::Best,
        }
    }

    /// Returns how files are converted, as far as these flags say.
    pub(super) fn conversion(&self) -> Conversion {
        Conversion {
            preset: self.preset(),
            lossless: self.lossless,
            radius_scale: self.radius_scale.unwrap_or(1.0),
            up: self.up,
            unit: self.unit.clone(),
            degree: self.degree,
            spz_version: self.spz_version.unwrap_or(3),
            memory: self.memory,
            ..Conversion::default()
        }
    }
}
