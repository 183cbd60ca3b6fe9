//! Conversion of files. What the inputs hold and the name of the output decide what is made.
//!
//! Meshes, point clouds, hierarchies and trained Gaussians become a hierarchy or Gaussians for
//! other viewers, and volumes become bricks or NRRD.
//!
//! | module | purpose |
//! |---|---|
//! | `splats` | the splats of inputs, and the hierarchy of them |
//! | `points` | points with attributes, and edits of points larger than memory |
//! | `merged` | inputs of several formats as one cloud |
//! | `regions` | scans larger than memory, region by region or in parts |
//! | `gaussians` | trained Gaussians, and splats written as such |
//! | `volume` | volumes as bricks and as NRRD |
//! | `memory` | how much memory a conversion needs |

mod gaussians;
mod memory;
mod merged;
mod points;
mod regions;
mod splats;
mod volume;

use super::{Coloring, Data, Reading};
use crate::{
    Deadline, Error, Result,
    edit::{Change, Edit},
    hierarchy::{BuildOptions, Preset, external, external::Plan, file::WriteOptions},
    surface::{PointStyle, SurfelOptions},
    volume::{Lattice, Scalar},
};
use glam::DVec3;
use splats::Frame;
use std::path::{Path, PathBuf};
use web_time::Instant;

/// How files are converted.
#[derive(Debug, Clone)]
pub struct Conversion {
    /// How inputs are read.
    pub reading: Reading,
    /// Whether an input that is read as a whole must fit in [`memory`](Self::memory).
    pub fits_memory: bool,
    /// By what meshes and point clouds are coloured.
    pub coloring: Coloring,
    /// What is changed on the way, in this order.
    pub edits: Vec<Edit>,
    /// How much time to spend on the quality of a hierarchy.
    pub preset: Preset,
    /// Whether a hierarchy keeps every bit of its splats.
    pub lossless: bool,
    /// The factor on all radii.
    pub radius_scale: f32,
    /// The direction to record as up; by default that of the first input, or a guess.
    pub up: Option<DVec3>,
    /// The unit of lengths to record; by default that of the input.
    pub unit: Option<String>,
    /// The maximum degree of the colours of Gaussians.
    pub degree: Option<u32>,
    /// The version of SPZ that is written, 3 or 4.
    pub spz_version: u32,
    /// The lattice of a volume that is written as NRRD; by default that of the input.
    pub lattice: Option<Resampled>,
    /// The bytes of memory that a conversion may use; by default three quarters of the machine's
    /// ([`memory::most`](crate::memory::most)).
    pub memory: Option<u64>,
    /// Whether hierarchies are built region by region, however much memory there is.
    pub in_regions: bool,
    /// The number of parts of a hierarchy that is built region by region ([`Conversion::plan`]); by
    /// default one for each region.
    pub parts: Option<u32>,
}

impl Default for Conversion {
    fn default() -> Self {
        Self {
            reading: Reading::default(),
            fits_memory: true,
            coloring: Coloring::default(),
            edits: Vec::new(),
            preset: Preset::default(),
            lossless: false,
            radius_scale: 1.0,
            up: None,
            unit: None,
            degree: None,
            spz_version: 3,
            lattice: None,
            memory: None,
            in_regions: false,
            parts: None,
        }
    }
}

/// The lattice that a volume is written on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resampled {
    /// The Cartesian lattice, on which the volume must be.
    Cartesian,
    /// The body-centred cubic lattice.
    BodyCentred,
}

/// What is made of the inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A hierarchy of splats, `.splk`.
    Hierarchy,
    /// Gaussians as PLY.
    Ply,
    /// Gaussians as packed PLY, `.compressed.ply`.
    CompressedPly,
    /// Gaussians as `.splat`.
    Splat,
    /// Gaussians as SPZ.
    Spz,
    /// Gaussians as SOG, in one file or as `meta.json` with its planes.
    Sog,
    /// Gaussians in levels of detail as streamed SOG, `lod-meta.json` with its folders.
    StreamedSog,
    /// Gaussians as glTF, `.glb`.
    Glb,
    /// Points with their attributes: LAS, LAZ, E57, or PLY as `.points.ply`.
    Points,
    /// A volume as NRRD.
    Nrrd,
    /// A volume in levels of bricks, `.splv`.
    Bricks,
}

impl Target {
    /// Returns the target that the name of a file asks for.
    ///
    /// # Errors
    /// [`Error::Argument`] for other names.
    pub fn of(path: &Path) -> Result<Self> {
        let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase());
        let name = name.unwrap_or_default();
        let all = [
            (".compressed.ply", Self::CompressedPly),
            (".points.ply", Self::Points),
            (".las", Self::Points),
            (".laz", Self::Points),
            (".e57", Self::Points),
            (".splk", Self::Hierarchy),
            (".ply", Self::Ply),
            (".splat", Self::Splat),
            (".spz", Self::Spz),
            (".sog", Self::Sog),
            (".glb", Self::Glb),
            (".nrrd", Self::Nrrd),
            (".splv", Self::Bricks),
        ];
        // A name that is an extension alone has none.
        let has_stem = path.extension().is_some();
        let entry = all.into_iter().find(|(end, _)| has_stem && name.ends_with(end));
        let entry = entry.map(|(_, target)| target);
        let index = (name == "lod-meta.json").then_some(Self::StreamedSog);
        entry.or((name == "meta.json").then_some(Self::Sog)).or(index).ok_or_else(|| {
            Error::Argument(format!(
                "{}: only .splk, .ply, .splat, .spz, .sog, .glb, .las, .laz, .e57, .nrrd and .splv \
                 files, and the meta.json or lod-meta.json of SOG, can be written",
                path.display()
            ))
        })
    }
}

/// What a caller hears while files are converted.
pub trait Watch: Sync {
    /// The error that ends a conversion.
    type Error: From<Error>;

    /// Names the stage that begins.
    fn stage(&self, _name: &str) {}

    /// Says how much of a stage is done; `all` is 0 if it is not known.
    fn progress(&self, _stage: &'static str, _done: u64, _all: u64) {}

    /// Lists files that were read: an input, and those it refers to.
    ///
    /// # Errors
    /// The caller's: then nothing is written.
    fn has_read(&self, _files: &[PathBuf]) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Says whether an input is a mesh or point cloud, and whether values colour it.
    ///
    /// # Errors
    /// The caller's: then nothing is written.
    fn has_colored(&self, _is_mesh: bool, _has_values: bool) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Says what edits have done: of all inputs together, or of one after the other.
    fn has_edited(&self, _changes: &[Change]) {}
}

/// Nobody hears of the conversion.
impl Watch for () {
    type Error = Error;
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub enum Converted {
    /// A hierarchy of the inputs' splats.
    Hierarchy(Built),
    /// A hierarchy that was built region by region.
    Regions(external::Converted),
    /// Gaussians, or a hierarchy of them.
    Gaussians {
        /// The points of the inputs.
        points: u64,
        /// The number of Gaussians.
        splats: usize,
        /// The degree of their colours.
        degree: u32,
        /// Milliseconds of reading.
        read_ms: f64,
        /// Milliseconds of writing, and of building a hierarchy.
        write_ms: f64,
    },
    /// Points with their attributes.
    Points {
        /// The points of the inputs.
        points: u64,
        /// The number of points that were written.
        written: u64,
        /// The names of the attributes.
        attributes: Vec<String>,
    },
    /// A volume as NRRD.
    Volume {
        /// The lattice that was written.
        lattice: Lattice,
        /// The type of its samples.
        sample_type: &'static str,
        /// The number of samples of the input.
        samples_read: usize,
    },
    /// A volume in bricks.
    Bricks {
        /// The lattice of the finest level.
        lattice: Lattice,
        /// The type of its samples.
        scalar: Scalar,
        /// Whether the input was read slice by slice.
        slice_by_slice: bool,
    },
}

/// A hierarchy of the inputs' splats.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// The points of the inputs.
    pub points: u64,
    /// The number of splats at the finest level.
    pub splats: usize,
    /// Whether all inputs are closed surfaces.
    pub closed: bool,
    /// Milliseconds of reading.
    pub read_ms: f64,
    /// Milliseconds of making splats.
    pub splats_ms: f64,
    /// Milliseconds of building and writing.
    pub build_ms: f64,
}

/// What a conversion would take.
#[derive(Debug, Clone, PartialEq)]
pub enum Expected {
    /// A hierarchy of the inputs' splats; its times are extrapolated from a part of them.
    Hierarchy {
        /// What would be built.
        built: Built,
        /// Bytes of the file.
        bytes: u64,
        /// Bytes of memory.
        memory: u64,
    },
    /// A hierarchy that is built region by region.
    Regions {
        /// Bytes of memory to convert the inputs as a whole.
        as_a_whole: u64,
        /// Bytes of memory region by region.
        memory: u64,
    },
    /// Gaussians, or a hierarchy of them.
    Gaussians {
        /// The points of the inputs.
        points: u64,
        /// The number of Gaussians.
        splats: usize,
        /// Bytes of the file.
        bytes: u64,
        /// Whether the file has no more bytes than these; otherwise it has about as many.
        is_most: bool,
        /// Milliseconds of reading.
        read_ms: f64,
    },
    /// A volume in bricks.
    Bricks {
        /// The lattice of the finest level.
        lattice: Lattice,
        /// The type of its samples.
        scalar: Scalar,
        /// Whether the input would be read slice by slice.
        slice_by_slice: bool,
        /// Bytes of all levels before compression.
        unpacked: u64,
        /// Bytes of memory.
        memory: u64,
    },
}

impl Conversion {
    /// Converts files to one. All of them are merged, but for volumes, of which there is one.
    /// `watch` hears of it, or nobody (`&()`).
    ///
    /// # Errors
    /// Those of reading the inputs and of writing the output; [`Error::Argument`] for inputs that
    /// do not become the output, or need more memory than they may.
    pub fn convert<W: Watch>(
        &self,
        files: &[PathBuf],
        output: &Path,
        watch: &W,
    ) -> Result<Converted, W::Error> {
        let work = Work { conversion: self, files, output, watch };
        match Target::of(output)? {
            Target::Hierarchy => work.hierarchy(),
            Target::Points => work.points(),
            Target::Nrrd => work.nrrd(),
            Target::Bricks => work.bricks(),
            target => work.gaussians(target),
        }
    }

    /// Finds what a conversion would take, by trying a part. Writes nothing.
    ///
    /// # Errors
    /// Those of [`convert`](Self::convert); [`Error::Argument`] for NRRD.
    pub fn expect<W: Watch>(
        &self,
        files: &[PathBuf],
        output: &Path,
        watch: &W,
    ) -> Result<Expected, W::Error> {
        let work = Work { conversion: self, files, output, watch };
        match Target::of(output)? {
            Target::Hierarchy => work.expect_hierarchy(),
            Target::Points => Err(wrong("--dry-run is not for files of points").into()),
            Target::Nrrd => work.expect_nrrd(),
            Target::Bricks => work.expect_bricks(),
            target => work.expect_gaussians(target),
        }
    }

    /// Plans a conversion in parts, which any number of machines make, and writes the plan to a
    /// folder. `may_write` is asked before.
    ///
    /// # Errors
    /// Those of [`Plan::make`]; [`Error::Argument`] for inputs that are not converted in parts.
    pub fn plan<W: Watch>(
        &self,
        files: &[PathBuf],
        folder: &Path,
        watch: &W,
        may_write: impl FnOnce() -> Result<(), W::Error>,
    ) -> Result<Plan, W::Error> {
        if let Some(edit) = self.edits.first() {
            let message = format!(
                "--{} is not made in parts; write the edited points as .laz first, and plan their \
                 conversion",
                edit.name()
            );
            return Err(wrong(message).into());
        }
        let work = Work { conversion: self, files, output: folder, watch };
        let (options, write) = work.region_options(work.need(), true)?;
        may_write()?;
        let watch = |stage, done, all| work.region_stage(stage, done, all);
        let limits = self.reading.limits();
        Ok(Plan::make(files, folder, limits, &options, &write, Some(&watch))?)
    }

    /// Returns the bytes of memory that a conversion may use.
    fn most_memory(&self) -> u64 {
        self.memory.or_else(crate::memory::most).unwrap_or(u64::MAX)
    }

    /// Returns the way to read inputs, which may take `memory` bytes as a whole.
    fn reading(&self, memory: Option<u64>) -> Reading {
        self.reading.clone().within_memory(memory.filter(|_| self.fits_memory))
    }

    /// Returns the attribute of meshes and point clouds to read, if the caller names one.
    fn attribute(&self) -> Option<&str> {
        self.coloring.attribute().or(self.reading.options.scalar.as_deref())
    }

    /// Returns how points and triangles become splats.
    ///
    /// The options are valid if [`SurfelOptions::validate`] says so.
    pub fn surfel_options(&self, deadline: Deadline) -> SurfelOptions {
        SurfelOptions {
            radius_scale: self.radius_scale,
            color_by_normal: self.coloring.by_normal(),
            points: PointStyle::Auto,
            deadline,
            ..SurfelOptions::default()
        }
    }

    fn build_options(&self, closed: bool, points: u64) -> BuildOptions {
        BuildOptions {
            preset: self.preset,
            closed,
            source_points: Some(points),
            deadline: self.reading.limits().deadline(),
            ..BuildOptions::default()
        }
    }

    /// Returns the options for writing a hierarchy. The `frame` counts unless the caller overrides
    /// it.
    fn write_options(&self, files: &[PathBuf], frame: &Frame) -> WriteOptions {
        let up = self.up.map(crate::about::Orientation::with_up);
        WriteOptions {
            lossless: self.lossless,
            orientation: up.or(frame.orientation),
            is_guessed: up.is_none() && frame.is_guessed,
            unit: self.unit.clone().unwrap_or_else(|| frame.unit.clone()),
            source: files.iter().filter_map(|path| name_of(path)).collect::<Vec<_>>().join(", "),
        }
    }
}

/// A conversion with its inputs and its output.
struct Work<'a, W> {
    conversion: &'a Conversion,
    files: &'a [PathBuf],
    output: &'a Path,
    watch: &'a W,
}

impl<W: Watch> Work<'_, W> {
    /// Reads an input, which may take `memory` bytes.
    fn data(&self, path: &Path, memory: Option<u64>) -> Result<Data, W::Error> {
        let reading = self.conversion.reading(memory);
        let opened = reading.open(path)?;
        let data = opened.read()?;
        self.watch.has_read(&opened.files())?;
        Ok(data)
    }

    /// Returns an error that the values of the inputs cause.
    fn at_fault(&self, error: Error) -> Error {
        let names = self.files.iter().map(|file| file.to_string_lossy());
        error.stated_in(Path::new(&names.collect::<Vec<_>>().join(", ")), "content")
    }
}

fn name_of(path: &Path) -> Option<String> {
    path.file_name().map(|name| name.to_string_lossy().into_owned())
}

fn wrong(message: impl Into<String>) -> Error {
    Error::Argument(message.into())
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::Target;
    use std::path::Path;

    #[test]
    fn names_ask_for_targets() {
        let of = |name: &str| Target::of(Path::new(name)).ok();
        assert_eq!(of("a/b.SPLK"), Some(Target::Hierarchy));
        assert_eq!(of("b.compressed.ply"), Some(Target::CompressedPly));
        assert_eq!(of("b.v2.ply"), Some(Target::Ply));
        assert_eq!([of("a.sog"), of("a/meta.json")], [Some(Target::Sog); 2]);
        assert_eq!(of("a/lod-meta.json"), Some(Target::StreamedSog));
        assert_eq!([of("b.obj"), of("splk"), of(".splk"), of("a.meta.json")], [None; 4]);
    }
}
