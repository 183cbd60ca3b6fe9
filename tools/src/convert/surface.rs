//! Meshes, point clouds and hierarchies: converted to a hierarchy.

use super::{Convert, SURFACES, memory};
use crate::{
    failure::{Failure, in_file},
    output, parse,
    progress::Progress,
    timing::milliseconds,
};
use clap::{Args, ValueEnum};
use glam::DVec3;
use serde_json::json;
use splatkit::{
    Deadline, Error,
    about::Stance,
    hierarchy::{
        self, BuildOptions,
        external::{memory_of_mesh, memory_of_splats},
        file::WriteOptions,
    },
    session::{Data, Name},
    splat::SplatSet,
    surface::{PointStyle, SurfelOptions},
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

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
    pub(super) up: Option<DVec3>,
    /// Record the unit of lengths, such as m or mm, for viewers of the result [default: that of a
    /// converted hierarchy]
    #[arg(long, value_name = "NAME")]
    pub(super) unit: Option<String>,
    /// Keep the colours of trained Gaussians up to this degree of spherical harmonics, 0 to 3
    /// [default: that of the file]
    #[arg(long, value_name = "DEGREE", value_parser = clap::value_parser!(u32).range(0..=3))]
    pub(super) degree: Option<u32>,
    /// Limit the memory of the conversion, such as 8GiB. Binary PLY of points or triangles, LAS and
    /// LAZ that need more are converted region by region, with temporary files of about their size
    /// beside the output. Raw volumes and NRRD files of raw encoding become .splv slice by slice.
    /// Region by region takes at least 200 MiB [default: three quarters of the machine's memory]
    #[arg(long, value_name = "BYTES", value_parser = parse::bytes)]
    pub(super) memory: Option<u64>,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq)]
enum Preset {
    Fastest,
    Fast,
    Balanced,
    Slow,
    Best,
}

/// The splats of all inputs, and facts about their source.
struct Gathered {
    set: SplatSet,
    closed: bool,
    /// The frame of the first input.
    frame: Frame,
    points: u64,
    read_ms: f64,
    splats_ms: f64,
}

/// Facts about an input's coordinates, for viewers.
#[derive(Default)]
pub(super) struct Frame {
    pub stance: Option<Stance>,
    /// Whether the stance was guessed from the shape.
    pub is_guessed: bool,
    pub unit: String,
}

impl Frame {
    /// Takes what a file says of its stance, or a guess.
    pub fn of(
        told: Option<Stance>,
        guess: impl FnOnce() -> splatkit::Result<Option<Stance>>,
    ) -> splatkit::Result<Self> {
        let stance = match told {
            Some(stance) => Some(stance),
            None => guess()?,
        };
        Ok(Self { stance, is_guessed: told.is_none() && stance.is_some(), unit: String::new() })
    }
}

/// Number of splats that a dry run tries.
const SAMPLE: usize = 1 << 17;

impl Convert {
    /// Writes a hierarchy (`splk`) or 3D Gaussians.
    pub(super) fn surface(self, extension: &str, progress: &Progress) -> Result<(), Failure> {
        if self.lattice.is_some() {
            return Err(Failure::Usage("--lattice is for volumes written as .nrrd".into()));
        }
        if extension != "splk" {
            return self.gaussians(progress);
        }
        if self.are_gaussians()? {
            return self.gaussian_hierarchy(progress);
        }
        let most = self.most_memory();
        let limits = self.load.limits();
        let need = memory::need(
            &self.files,
            &limits,
            &self.surface.surfel_options(limits.deadline()),
            most,
        );
        if need.bytes > most || self.parts.divide() {
            return self.in_regions(need, most, progress);
        }
        let gathered = self.gather(progress)?;
        if self.dry_run {
            return self.expect(&gathered, need.bytes, progress);
        }
        let start = Instant::now();
        let bar = progress.bar("Building the hierarchy", gathered.set.splats.len() as u64);
        let watch = |done: u64, _: u64| bar.set(done);
        let (build, write) = (
            self.surface.build_options(&gathered, limits.deadline()),
            self.surface.write_options(&self.files, &gathered.frame),
        );
        let built =
            hierarchy::build_file(&gathered.set, self.output(), &build, &write, Some(&watch));
        built.map_err(|error| self.at_fault(error))?;
        progress.clear();
        let build_ms = milliseconds(start);
        let bytes =
            self.output().metadata().map_err(|e| Error::file(self.output(), "read", e))?.len();
        let per_point = bytes as f64 / gathered.points as f64;
        if self.json {
            return output::line(json!({
                "file": self.output().to_string_lossy(),
                "points": gathered.points,
                "splats": gathered.set.splats.len(),
                "closed": gathered.closed,
                "bytes": bytes,
                "bytes_per_point": per_point,
                "read_ms": gathered.read_ms,
                "splats_ms": gathered.splats_ms,
                "build_ms": build_ms,
            }));
        }
        output::line(format_args!("points          {}", gathered.points))?;
        output::line(format_args!("splats          {}", gathered.set.splats.len()))?;
        output::line(format_args!("bytes           {bytes} ({per_point:.2} a point)"))?;
        let [read, splats, build] =
            [gathered.read_ms, gathered.splats_ms, build_ms].map(|ms| ms / 1e3);
        output::line(format_args!(
            "time            {read:.2} s reading, {splats:.2} s splats, {build:.2} s tree and file"
        ))
    }

    /// Returns the splats of an input that is no trained scene, the number of its points, and how
    /// it stands.
    pub(super) fn surfels_of(
        &self,
        path: &Path,
        progress: &Progress,
    ) -> Result<(SplatSet, u64, Option<Stance>), Failure> {
        let own = self.splats_of(path, 0, progress)?;
        hierarchy::check_splats(&own.set).map_err(|error| in_file(path, error))?;
        Ok((own.set, own.points, own.frame.stance))
    }

    /// Reads all inputs and makes splats of them, relative to the first input's origin.
    fn gather(&self, progress: &Progress) -> Result<Gathered, Failure> {
        let mut gathered: Option<Gathered> = None;
        for path in &self.files {
            let taken = gathered.as_ref().map_or(0, |all| memory_of_splats(all.set.splats.len()));
            let own = self.splats_of(path, taken, progress)?;
            hierarchy::check_splats(&own.set).map_err(|error| in_file(path, error))?;
            match &mut gathered {
                None => gathered = Some(own),
                Some(all) => all.join(own, path)?,
            }
        }
        gathered.ok_or_else(|| Failure::Usage("there is nothing to convert".into()))
    }

    /// Returns the attribute of meshes and point clouds to read, if the user names one.
    pub(super) fn attribute(&self) -> Option<&str> {
        self.color.attribute().or(self.load.scalar())
    }

    /// Returns the splats of an input. The splats of earlier inputs have `taken` this many bytes.
    fn splats_of(&self, path: &Path, taken: u64, progress: &Progress) -> Result<Gathered, Failure> {
        progress.stage(format!("Reading {}", path.display()));
        let start = Instant::now();
        // One deadline covers reading the input and making its splats.
        let deadline = self.load.limits().deadline();
        let most = self.most_memory();
        let reading = self.load.reading(Some(most));
        let opened = reading.open_colored(path, self.attribute())?;
        let input = opened.read()?;
        self.check_unneeded(&opened.files())?;
        let read_ms = milliseconds(start);
        let start = Instant::now();
        let (set, closed, frame, points) = match input {
            Data::Mesh(mut mesh) => {
                let frame = Frame::of(mesh.about.stance, || Ok(mesh.guess_stance()))?;
                let up = self.surface.up_of(&frame);
                let named = self.load.scalar().is_some();
                let coloring = self.color.coloring(self.range);
                let legend = coloring.paint(&Name::of_file(path), &mut mesh, up, named)?;
                self.color.check_effect(true, legend.is_some())?;
                progress.stage(format!("Making splats of {} points", mesh.positions.len()));
                let mut options = self.surface.surfel_options(deadline);
                options.color_by_normal = coloring.by_normal();
                let need = memory_of_mesh(&mesh, &options, most.saturating_sub(taken));
                memory::check(path, need.map_err(|e| in_file(path, e))?, taken, most)?;
                let closed = mesh.is_solid();
                let set = mesh.surfels(&options).map_err(|e| in_file(path, e))?;
                (set, closed, frame, mesh.positions.len() as u64)
            }
            Data::Hierarchy(hierarchy) => {
                self.color.check_effect(false, false)?;
                progress.stage("Reading the splats of the finest level");
                let header = hierarchy.header();
                memory::check(path, memory_of_splats(header.leaves as usize), taken, most)?;
                let mut set = hierarchy.leaves()?;
                let scale = self.surface.radius_scale();
                set.splats
                    .iter_mut()
                    .for_each(|splat| splat.factor = splat.factor.map(|entry| entry * scale));
                let unit = header.unit.clone();
                let frame = Frame { stance: header.stance, is_guessed: header.is_guessed, unit };
                (set, header.closed, frame, header.source_points)
            }
            Data::Gaussians(_) => {
                let file = path.display();
                return Err(Failure::Usage(format!(
                    "{file} holds trained Gaussians, and another input does not; a hierarchy is \
                     built of either"
                )));
            }
            Data::Volume(_) | Data::Samples(_) | Data::Bricks(_) | Data::Cells(_) => {
                let file = path.display();
                return Err(Failure::Usage(format!(
                    "{file} holds a volume, cells or samples; hierarchies are built from meshes \
                     and point clouds"
                )));
            }
        };
        Ok(Gathered { set, closed, frame, points, read_ms, splats_ms: milliseconds(start) })
    }

    /// Prints what a conversion would take, extrapolated from a contiguous part of the splats.
    fn expect(&self, gathered: &Gathered, need: u64, progress: &Progress) -> Result<(), Failure> {
        progress.stage("Trying a part");
        let splats = &gathered.set.splats;
        // Subdivided triangles give many more splats; the data that splats are made from takes
        // about as much again.
        let memory = need.max(2 * memory_of_splats(splats.len()));
        let count = splats.len().min(SAMPLE);
        let first = (splats.len() - count) / 2;
        let SplatSet { origin, payload, extent, overlap, .. } = gathered.set;
        let part = SplatSet {
            origin,
            payload,
            splats: splats[first..first + count].to_vec(),
            extent,
            overlap,
        };
        let deadline = self.load.limits().deadline();
        let (build, write) = (
            self.surface.build_options(gathered, deadline),
            self.surface.write_options(&self.files, &gathered.frame),
        );
        let start = Instant::now();
        let built = hierarchy::Tree::build(&part, &build, None);
        let tree = built.map_err(|error| self.at_fault(error))?;
        let bytes = hierarchy::file::to_bytes(&tree, &write)?.len() as f64;
        let share = splats.len() as f64 / count as f64;
        let build_ms = milliseconds(start) * share;
        let bytes = (bytes * share) as u64;
        progress.clear();
        if self.json {
            return output::line(json!({
                "points": gathered.points,
                "splats": splats.len(),
                "expected_bytes": bytes,
                "expected_memory": memory,
                "expected_build_ms": build_ms,
                "read_ms": gathered.read_ms,
                "splats_ms": gathered.splats_ms,
            }));
        }
        output::line(format_args!("points          {}", gathered.points))?;
        output::line(format_args!("splats          {}", splats.len()))?;
        output::line(format_args!("bytes           about {bytes}"))?;
        output::line(format_args!("memory          about {} MiB", memory >> 20))?;
        let [read, made] = [gathered.read_ms, gathered.splats_ms].map(|ms| ms / 1e3);
        let build = build_ms / 1e3;
        output::line(format_args!(
            "time            {read:.2} s reading, {made:.2} s splats, about {build:.1} s tree and \
             file"
        ))
    }
}

impl Gathered {
    /// Adds the splats of another input.
    fn join(&mut self, other: Self, path: &Path) -> Result<(), Failure> {
        if other.set.extent != self.set.extent {
            return Err(Error::input(
                path,
                "splats",
                "their footprints have another extent than those of the first input",
            )
            .into());
        }
        let mut set = other.set;
        set.move_origin(self.set.origin).map_err(|error| in_file(path, error))?;
        self.set.splats.append(&mut set.splats);
        // A statement counts more than a guess before it.
        let frame = other.frame;
        let states = frame.stance.is_some() && !frame.is_guessed;
        if self.frame.stance.is_none() || (self.frame.is_guessed && states) {
            (self.frame.stance, self.frame.is_guessed) = (frame.stance, frame.is_guessed);
        }
        self.closed &= other.closed;
        self.points += other.points;
        self.read_ms += other.read_ms;
        self.splats_ms += other.splats_ms;
        Ok(())
    }
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

    pub(super) fn preset(&self) -> hierarchy::Preset {
        match self.preset.unwrap_or(Preset::Balanced) {
            Preset::Fastest => hierarchy::Preset::Fastest,
            Preset::Fast => hierarchy::Preset::Fast,
            Preset::Balanced => hierarchy::Preset::Balanced,
            Preset::Slow => hierarchy::Preset::Slow,
            Preset::Best => hierarchy::Preset::Best,
        }
    }

    /// Returns the direction in which heights are measured: that of --up, or of the input.
    pub(super) fn up_of(&self, frame: &Frame) -> DVec3 {
        let own = frame.stance.map_or(DVec3::Y, |stance| stance.up);
        self.up.unwrap_or(own)
    }

    pub(super) fn radius_scale(&self) -> f32 {
        self.radius_scale.unwrap_or(1.0)
    }

    pub(super) fn surfel_options(&self, deadline: Deadline) -> SurfelOptions {
        SurfelOptions {
            radius_scale: self.radius_scale(),
            points: PointStyle::Auto,
            deadline,
            ..SurfelOptions::default()
        }
    }

    fn build_options(&self, gathered: &Gathered, deadline: Deadline) -> BuildOptions {
        self.build_options_of(gathered.closed, gathered.points, deadline)
    }

    pub(super) fn build_options_of(
        &self,
        closed: bool,
        points: u64,
        deadline: Deadline,
    ) -> BuildOptions {
        let preset = self.preset();
        let source_points = Some(points);
        BuildOptions { preset, closed, source_points, deadline, ..BuildOptions::default() }
    }

    /// Returns the options for writing. The `frame` counts unless a flag overrides it.
    pub(super) fn write_options(&self, files: &[PathBuf], frame: &Frame) -> WriteOptions {
        let name =
            |path: &PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
        WriteOptions {
            lossless: self.lossless,
            stance: self.up.map(Stance::with_up).or(frame.stance),
            is_guessed: self.up.is_none() && frame.is_guessed,
            unit: self.unit.clone().unwrap_or_else(|| frame.unit.clone()),
            source: files.iter().filter_map(name).collect::<Vec<_>>().join(", "),
        }
    }
}
