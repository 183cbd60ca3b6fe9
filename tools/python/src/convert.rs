//! Conversions: surfaces to hierarchies and Gaussians, volumes to bricks and NRRD.

use crate::{
    errors::{options, raise, wrong},
    load::Load,
    look::Look,
    notes,
    worker::run,
};
use pyo3::prelude::*;
use serde::Deserialize;
use splatkit::{
    Deadline, Error, Stop,
    about::Stance,
    bricks, disk,
    formats::{self, Kind, Stream},
    gaussians::Gaussians,
    glam::DVec3,
    hierarchy::{
        self, BuildOptions, Hierarchy, Preset,
        external::{self, ExternalOptions, memory_of_stream},
        file::WriteOptions,
    },
    memory,
    session::{Data, Name, warn_of_holes},
    splat::SplatSet,
    surface::{PointStyle, SurfelOptions},
    volume,
};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

/// How files are converted.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Conversion {
    overwrite: bool,
    preset: Option<String>,
    lossless: bool,
    up: Option<[f64; 3]>,
    unit: Option<String>,
    degree: Option<u32>,
    radius_scale: Option<f32>,
    lattice: Option<String>,
    memory: Option<u64>,
}

/// A conversion with everything that it reads.
struct Work {
    files: Vec<PathBuf>,
    output: PathBuf,
    own: Conversion,
    load: Load,
    look: Look,
}

/// The splats of all inputs, and facts about their source.
struct Gathered {
    set: SplatSet,
    closed: bool,
    frame: Frame,
    points: u64,
}

/// How an input stands.
#[derive(Default)]
struct Frame {
    stance: Option<Stance>,
    is_guessed: bool,
    unit: String,
}

/// Converts files. The extension of the output decides what they become.
#[pyfunction]
pub fn convert(
    py: Python<'_>,
    files: Vec<PathBuf>,
    output: PathBuf,
    conversion: &str,
    load: &str,
    look: &str,
) -> PyResult<()> {
    let made = || -> Result<Work, Error> {
        let (own, look): (Conversion, Look) = (options(conversion)?, options(look)?);
        look.check()?;
        own.preset()?;
        let load = Load::parse(load)?;
        let work = Work { files, output, own, load, look };
        // From here on, numbers that are wrong are those of files.
        work.surfel_options(Deadline::NEVER).validate()?;
        Ok(work)
    };
    let work = made().map_err(|error| raise(py, &error))?;
    let stop = Stop::default();
    let own = stop.clone();
    run(py, &stop, move || work.run(&own))
}

impl Conversion {
    fn preset(&self) -> Result<Preset, Error> {
        Ok(match self.preset.as_deref() {
            None | Some("balanced") => Preset::Balanced,
            Some("fastest") => Preset::Fastest,
            Some("fast") => Preset::Fast,
            Some("slow") => Preset::Slow,
            Some("best") => Preset::Best,
            Some(other) => {
                return Err(wrong(format!(
                    "the preset “{other}” is none of fastest, fast, balanced, slow and best"
                )));
            }
        })
    }

    fn radius_scale(&self) -> f32 {
        self.radius_scale.unwrap_or(1.0)
    }
}

impl Work {
    /// Converts to a file beside the output, which takes its place at the end. So an interrupted
    /// conversion leaves no file, although nothing stops its thread.
    fn run(&self, stop: &Stop) -> Result<(), Error> {
        self.check_output()?;
        let part = self.part();
        let done = self.write(&part).and_then(|()| {
            if stop.is_requested() {
                return Err(Error::Stopped);
            }
            let renamed = disk::rename(&part, &self.output, self.own.overwrite);
            renamed.map_err(|error| Error::output(&self.output, error))
        });
        if done.is_err() {
            // It may not be there.
            fs::remove_file(&part).ok();
        }
        done.map_err(|error| match error {
            Error::Output { source, .. } => Error::output(&self.output, source),
            other => other,
        })
    }

    /// Returns the name of the unfinished file. It ends as the output does.
    fn part(&self) -> PathBuf {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let name = self.output.file_name().unwrap_or_default().to_string_lossy();
        let (process, count) = (std::process::id(), COUNT.fetch_add(1, Relaxed));
        self.output.with_file_name(format!(".splatkit-{process}-{count}-{name}"))
    }

    fn check_output(&self) -> Result<(), Error> {
        let refuse = |message: &str| {
            let source = std::io::Error::other(message.to_owned());
            Err(Error::output(&self.output, source))
        };
        if self.output.is_dir() {
            return refuse("it is a folder");
        }
        if !self.own.overwrite && self.output.symlink_metadata().is_ok() {
            let source = std::io::Error::from(std::io::ErrorKind::AlreadyExists);
            return Err(Error::output(&self.output, source));
        }
        let real = self.output.canonicalize().ok();
        let is_same = |file: &PathBuf| real.is_some() && file.canonicalize().ok() == real;
        if self.files.iter().any(is_same) { refuse("it is an input too") } else { Ok(()) }
    }

    fn write(&self, part: &Path) -> Result<(), Error> {
        if self.files.is_empty() {
            return Err(wrong("there is nothing to convert"));
        }
        let extension = self.output.extension().unwrap_or_default().to_string_lossy();
        match extension.to_ascii_lowercase().as_str() {
            "splv" => self.bricks(part),
            "nrrd" => self.nrrd(part),
            "splk" if self.are_gaussians()? => self.gaussian_hierarchy(part),
            "splk" => self.hierarchy(part),
            "ply" | "splat" | "spz" | "glb" => self.gaussians(part),
            _ => Err(wrong(format!(
                "{}: only .splk, .ply, .splat, .spz, .glb, .nrrd and .splv files can be written",
                self.output.display()
            ))),
        }
    }

    /// Returns the single file of a volume.
    fn single(&self) -> Result<&Path, Error> {
        let [file] = &self.files[..] else {
            return Err(wrong("volumes are converted one by one; give a single file"));
        };
        match self.load.reading().kind(file)? {
            Kind::Volume => Ok(file),
            _ => Err(wrong(format!("{} holds no volume to convert", file.display()))),
        }
    }

    fn bricks(&self, part: &Path) -> Result<(), Error> {
        let file = self.single()?;
        let options = bricks::WriteOptions {
            unit: self.own.unit.clone().unwrap_or_default(),
            source: file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        };
        if let Some(stream) = self.load.reading().stream(file)? {
            let range = stream.range(None)?;
            let (name, all) = (file.display().to_string(), stream.lattice().len() as u64);
            warn_of_holes(&name, stream.holes(), all, "read as the lowest value");
            return bricks::convert(&stream, range, part, &options, None);
        }
        bricks::write(&self.volume(file)?, part, &options, None)
    }

    fn nrrd(&self, part: &Path) -> Result<(), Error> {
        let volume = self.volume(self.single()?)?;
        let volume = match self.own.lattice.as_deref() {
            None | Some("cartesian") => volume,
            Some("bcc") => volume::body_centred(&volume)?,
            Some(other) => return Err(wrong(format!("the lattice “{other}” is not bcc"))),
        };
        formats::nrrd::write(&volume, part)
    }

    fn volume(&self, file: &Path) -> Result<volume::Volume, Error> {
        match self.load.reading().open(file)?.read()? {
            Data::Volume(volume) => {
                if volume.colors.is_some() {
                    let name = file.display();
                    notes::add(format!(
                        "{name}: the brightness is written, and the colours are not"
                    ));
                }
                Ok(volume)
            }
            _ => Err(wrong(format!("{} holds no volume to convert", file.display()))),
        }
    }

    fn surfel_options(&self, deadline: Deadline) -> SurfelOptions {
        let radius_scale = self.own.radius_scale();
        let color_by_normal = self.look.coloring().is_ok_and(|own| own.by_normal());
        SurfelOptions {
            radius_scale,
            color_by_normal,
            points: PointStyle::Auto,
            deadline,
            ..SurfelOptions::default()
        }
    }

    fn build_options(&self, closed: bool, points: u64) -> Result<BuildOptions, Error> {
        let (preset, deadline) = (self.own.preset()?, self.load.limits().deadline());
        let source_points = Some(points);
        Ok(BuildOptions { preset, closed, source_points, deadline, ..BuildOptions::default() })
    }

    fn write_options(&self, frame: &Frame) -> Result<WriteOptions, Error> {
        let name = |path: &PathBuf| Some(path.file_name()?.to_string_lossy().into_owned());
        let up = self.own.up.map(|up| DVec3::from_array(up).try_normalize());
        let up = match up {
            Some(None) => return Err(wrong("up is a direction with a length above 0")),
            given => given.flatten(),
        };
        Ok(WriteOptions {
            lossless: self.own.lossless,
            stance: up.map(Stance::with_up).or(frame.stance),
            is_guessed: up.is_none() && frame.is_guessed,
            unit: self.own.unit.clone().unwrap_or_else(|| frame.unit.clone()),
            source: self.files.iter().filter_map(name).collect::<Vec<_>>().join(", "),
        })
    }

    fn hierarchy(&self, part: &Path) -> Result<(), Error> {
        if self.is_too_large()? {
            return self.in_regions(part);
        }
        let mut gathered: Option<Gathered> = None;
        for path in &self.files {
            let own = self.splats_of(path)?;
            hierarchy::check_splats(&own.set).map_err(|error| error.stated_in(path, "content"))?;
            match &mut gathered {
                None => gathered = Some(own),
                Some(all) => all.join(own, path)?,
            }
        }
        let all = gathered.ok_or_else(|| wrong("there is nothing to convert"))?;
        let build = self.build_options(all.closed, all.points)?;
        let write = self.write_options(&all.frame)?;
        hierarchy::build_file(&all.set, part, &build, &write, None)
            .map_err(|error| error.stated_in(&self.files[0], "content"))
    }

    /// Whether the files can be read in pieces, and need more memory than may be used as a whole.
    fn is_too_large(&self) -> Result<bool, Error> {
        let most = self.own.memory.or_else(memory::most).unwrap_or(u64::MAX);
        let (limits, mut sum) = (self.load.limits(), 0u64);
        for file in &self.files {
            let Ok(Some(mut stream)) = Stream::open(file, &limits) else { return Ok(false) };
            let options = self.surfel_options(limits.deadline());
            let bytes = file.metadata().map_or(0, |own| own.len());
            let need = memory_of_stream(&mut stream, &options, most)?;
            sum = sum.saturating_add(need).saturating_add(bytes);
        }
        Ok(sum.saturating_add(external::BLOCKS) > most)
    }

    /// Converts scans that are larger than memory, region by region.
    fn in_regions(&self, part: &Path) -> Result<(), Error> {
        if self.look.is_painted() {
            return Err(wrong("scans larger than the memory keep their own colours"));
        }
        let limits = self.load.limits();
        let first = Stream::open(&self.files[0], &limits)?;
        let frame = match &first {
            Some(first) => Frame::of(first.stance(), || first.guess_stance())?,
            None => Frame::default(),
        };
        drop(first);
        let options = ExternalOptions {
            memory: self.own.memory.or_else(memory::most).unwrap_or(u64::MAX),
            preset: self.own.preset()?,
            block_splats: BuildOptions::default().block_splats,
            // Each region has its own deadline.
            surfels: self.surfel_options(Deadline::NEVER),
            paint: None,
            scalar: None,
            parts: None,
        };
        let write = self.write_options(&frame)?;
        external::convert(&self.files, &limits, part, &options, &write, None).map(drop)
    }

    /// Returns the splats of an input that is no trained scene.
    fn splats_of(&self, path: &Path) -> Result<Gathered, Error> {
        let deadline = self.load.limits().deadline();
        let coloring = self.look.coloring()?;
        let attribute = coloring.attribute().or(self.load.scalar());
        match self.load.reading().open_colored(path, attribute)?.read()? {
            Data::Mesh(mut mesh) => {
                let frame = Frame::of(mesh.about.stance, || Ok(mesh.guess_stance()))?;
                let up = self.own.up.map(DVec3::from_array).and_then(DVec3::try_normalize);
                let up = up.unwrap_or(frame.stance.map_or(DVec3::Y, |stance| stance.up));
                let named = self.load.scalar().is_some();
                coloring.paint(&Name::of_file(path), &mut mesh, up, named)?;
                let set = mesh.surfels(&self.surfel_options(deadline));
                let set = set.map_err(|error| error.stated_in(path, "content"))?;
                let points = mesh.positions.len() as u64;
                Ok(Gathered { set, closed: mesh.is_solid(), frame, points })
            }
            Data::Hierarchy(own) => {
                let (header, mut set) = (own.header(), own.leaves()?);
                let scale = self.own.radius_scale();
                let larger = |factor: [f32; 6]| factor.map(|entry| entry * scale);
                set.splats.iter_mut().for_each(|splat| splat.factor = larger(splat.factor));
                let unit = header.unit.clone();
                let frame = Frame { stance: header.stance, is_guessed: header.is_guessed, unit };
                Ok(Gathered { set, closed: header.closed, frame, points: header.source_points })
            }
            Data::Gaussians(_) => Err(wrong(format!(
                "{} holds trained Gaussians, and another input does not",
                path.display()
            ))),
            _ => Err(wrong(format!(
                "{} holds a volume, cells or samples; meshes, point clouds, hierarchies and \
                 trained Gaussians become such a file",
                path.display()
            ))),
        }
    }

    /// Whether all inputs hold trained Gaussians, also in hierarchies.
    fn are_gaussians(&self) -> Result<bool, Error> {
        for path in &self.files {
            let is_one = match self.load.reading().kind(path)? {
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

    /// Reads all inputs as Gaussians, and returns them with the number of points.
    fn gather_gaussians(&self) -> Result<(Gaussians, u64), Error> {
        let mut gathered: Option<(Gaussians, u64)> = None;
        for path in &self.files {
            let (own, points) = self.gaussians_of(path)?;
            match &mut gathered {
                None => gathered = Some((own, points)),
                Some((all, count)) => {
                    all.join(own).map_err(|error| error.stated_in(path, "content"))?;
                    *count += points;
                }
            }
        }
        let (mut set, points) = gathered.ok_or_else(|| wrong("there is nothing to convert"))?;
        if let Some(degree) = self.own.degree {
            set.set_degree(degree.min(set.degree));
        }
        Ok((set, points))
    }

    /// Returns the Gaussians of an input: its own, or those of its splats.
    fn gaussians_of(&self, path: &Path) -> Result<(Gaussians, u64), Error> {
        let kind = self.load.reading().kind(path)?;
        let own = match kind {
            Kind::Hierarchy => Hierarchy::open(path, &self.load.limits())?.gaussians()?,
            Kind::Gaussians => match self.load.reading().open(path)?.read()? {
                Data::Gaussians(mut set) => {
                    // Files of trainers do not say what is up: it is −y.
                    set.about.stance = set.about.stance.or(Some(Stance::Y_DOWN));
                    Some(set)
                }
                _ => None,
            },
            _ => None,
        };
        if let Some(mut set) = own {
            let scale = self.own.radius_scale();
            set.scales.iter_mut().for_each(|own| *own *= scale);
            let points = set.len() as u64;
            return Ok((set, points));
        }
        let Gathered { set, points, frame, .. } = self.splats_of(path)?;
        hierarchy::check_splats(&set).map_err(|error| error.stated_in(path, "content"))?;
        let mut set =
            Gaussians::from_splats(&set).map_err(|error| error.stated_in(path, "content"))?;
        set.about.stance = frame.stance;
        Ok((set, points))
    }

    fn gaussian_hierarchy(&self, part: &Path) -> Result<(), Error> {
        let (set, points) = self.gather_gaussians()?;
        let frame =
            Frame { stance: set.about.stance, is_guessed: false, unit: set.about.length.clone() };
        let (build, write) = (self.build_options(false, points)?, self.write_options(&frame)?);
        hierarchy::build_gaussians(&set, part, &build, &write, None)
            .map_err(|error| error.stated_in(&self.files[0], "content"))
    }

    fn gaussians(&self, part: &Path) -> Result<(), Error> {
        let name = self.output.file_name().unwrap_or_default().to_string_lossy();
        let name = name.to_ascii_lowercase();
        let is_trained = self.are_gaussians()?;
        let (mut set, _) = self.gather_gaussians()?;
        if is_trained && !name.ends_with(".glb") {
            // Viewers expect the frame of trainers in these files.
            set.stand(Stance::Y_DOWN);
        }
        match () {
            () if name.ends_with(".compressed.ply") => {
                formats::ply::write_compressed_gaussians(&set, part)
            }
            () if name.ends_with(".splat") => formats::splat::write(&set, part),
            () if name.ends_with(".spz") => formats::spz::write(&set, part),
            () if name.ends_with(".glb") => formats::gltf::write_gaussians(&set, part),
            () => formats::ply::write_gaussians(&set, part),
        }
    }
}

impl Gathered {
    /// Adds the splats of another input.
    fn join(&mut self, other: Self, path: &Path) -> Result<(), Error> {
        if other.set.extent != self.set.extent {
            let message = "their footprints have another extent than those of the first input";
            return Err(Error::input(path, "splats", message));
        }
        let mut set = other.set;
        set.move_origin(self.set.origin).map_err(|error| error.stated_in(path, "content"))?;
        self.set.splats.append(&mut set.splats);
        // A statement counts more than a guess before it.
        let frame = other.frame;
        let states = frame.stance.is_some() && !frame.is_guessed;
        if self.frame.stance.is_none() || (self.frame.is_guessed && states) {
            (self.frame.stance, self.frame.is_guessed) = (frame.stance, frame.is_guessed);
        }
        self.closed &= other.closed;
        self.points += other.points;
        Ok(())
    }
}

impl Frame {
    /// Takes what a file says of its stance, or a guess.
    fn of(
        told: Option<Stance>,
        guess: impl FnOnce() -> Result<Option<Stance>, Error>,
    ) -> Result<Self, Error> {
        let stance = match told {
            Some(stance) => Some(stance),
            None => guess()?,
        };
        Ok(Self { stance, is_guessed: told.is_none() && stance.is_some(), unit: String::new() })
    }
}
