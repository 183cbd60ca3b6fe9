//! Opening an input of any kind, which its extension decides, then its first bytes.

use crate::{failure::Failure, limits::LimitFlags, parse};
use clap::Args;
use glam::DVec3;
use splatkit::{
    Deadline, Error,
    bricks::Bricks,
    cells::Cells,
    formats::{
        self, Content, Endian, FORMATS, Format, Kind, RawLayout, ReadOptions, SampleType,
        VolumeStream,
    },
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    input::{Limits, Source},
    memory,
    scattered::{Points, SampleOptions},
    surface::Mesh,
    volume::Volume,
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// The content of an input.
pub enum Input {
    Mesh(Mesh),
    Volume(Volume),
    Samples(Points),
    Cells(Cells),
    Gaussians(Gaussians),
    Hierarchy(Arc<Hierarchy>),
    Bricks(Arc<Bricks>),
}

/// How raw files and scattered samples are read, and the limits for any file.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Input")]
pub struct LoadFlags {
    /// Raw volumes: set the number of samples along each axis, the fastest axis first. Needs
    /// --type.
    #[arg(long, value_name = "XxYxZ", value_parser = parse::dims, requires = "sample_type")]
    dims: Option<[usize; 3]>,
    /// Raw volumes: set the type of a sample: u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64.
    #[arg(
        long = "type",
        id = "sample_type",
        value_name = "TYPE",
        value_parser = parse::sample_type,
        requires = "dims"
    )]
    sample_type: Option<SampleType>,
    /// Volumes: set the distance between samples along each axis, in world units [default: that of
    /// the file, or 1]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::spacing)]
    spacing: Option<DVec3>,
    /// Raw volumes: set the byte order, little or big [default: little]
    #[arg(long, value_name = "ORDER", value_parser = parse::endian, requires = "dims")]
    endian: Option<Endian>,
    /// Raw volumes: skip this many bytes before the first sample [default: 0]
    #[arg(long, value_name = "BYTES", requires = "dims")]
    header: Option<u64>,
    /// Read the values from this array, property or column. NAME:x takes one component of a
    /// vector, NAME:magnitude its length, cell:NAME an array of the cells. With it, a PLY file
    /// without faces and a table of points are read as samples; without it, as point clouds.
    #[arg(long, value_name = "NAME")]
    scalar: Option<String>,
    /// Volumes at several times: read this one, counted from 0 [default: 0]
    #[arg(long, value_name = "NUMBER")]
    time: Option<usize>,
    /// DICOM: read this series of the folder: its number, its UID or a part of its description
    /// [default: the one with the most slices]
    #[arg(long, value_name = "SERIES")]
    series: Option<String>,
    /// HDF5 and NPZ: read this data set [default: the largest of three dimensions]
    #[arg(long, value_name = "PATH")]
    dataset: Option<String>,
    /// Take samples of this value as holes, as samples that are not numbers are.
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    missing: Option<f64>,
    /// Label maps: take names and colours of labels from this table, of ITK-SNAP, FreeSurfer, 3D
    /// Slicer or with columns index, name, color.
    #[arg(long, value_name = "FILE", value_parser = parse::input())]
    labels: Option<PathBuf>,
    /// Scattered samples: use one radius for all samples, in world units. A radius is two standard
    /// deviations [default: the file's radii, or estimated from the neighbours]
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
    radius: Option<f64>,
    /// Scattered samples: estimate kernels and slopes from this many nearest neighbours, 4 to 64
    /// [default: 16]
    #[arg(long, value_name = "COUNT", value_parser = parse::neighbours)]
    neighbours: Option<usize>,
    /// Scattered samples: use mean values only, without slopes fitted to the neighbours.
    #[arg(long)]
    no_slopes: bool,
    #[command(flatten)]
    limits: LimitFlags,
}

impl LoadFlags {
    pub fn limits(&self) -> Limits {
        self.limits.limits()
    }

    /// Returns the flags for several inputs that share one time limit, which begins now.
    pub fn begun(&self) -> Self {
        Self { limits: self.limits.begun(), ..self.clone() }
    }

    /// Reads a file.
    pub fn open(&self, path: &Path) -> Result<Input, Failure> {
        self.open_within(path, memory::most(), &mut Vec::new())
    }

    /// Reads a file and adds its path, and those of the files it refers to, to `read`. An input
    /// that is read as a whole may take `memory` bytes, unless a flag allows more.
    pub fn open_within(
        &self,
        path: &Path,
        memory: Option<u64>,
        read: &mut Vec<PathBuf>,
    ) -> Result<Input, Failure> {
        self.open_colored(path, None, memory, read)
    }

    /// As [`open_within`](Self::open_within). A mesh or point cloud has the values of this
    /// attribute, if one is named.
    pub fn open_colored(
        &self,
        path: &Path,
        attribute: Option<&str>,
        memory: Option<u64>,
        read: &mut Vec<PathBuf>,
    ) -> Result<Input, Failure> {
        let (limits, whole) = (self.limits(), self.limits.whole(memory));
        // An attribute colours points. It does not make samples of them, as --scalar does.
        let kind = match attribute {
            Some(_) => self.colored_kind(path)?,
            None => self.kind(path)?,
        };
        let (input, files) = match kind {
            // Bricks and hierarchies refer to no other files.
            Kind::Bricks => {
                (Input::Bricks(Arc::new(Bricks::open(path, &limits)?)), vec![path.to_owned()])
            }
            Kind::Hierarchy => {
                (Input::Hierarchy(Arc::new(Hierarchy::open(path, &limits)?)), vec![path.to_owned()])
            }
            Kind::Mesh => {
                let source = Source::open_any(path, &whole)?;
                let mut options = self.options();
                options.scalar = attribute.map(str::to_owned).or(options.scalar);
                (Input::Mesh(formats::read_mesh(&source, &options)?), source.files())
            }
            Kind::Volume => {
                let source = Source::open_any(path, &whole)?;
                let mut options = self.options();
                if let Some(table) = &self.labels {
                    options.labels = formats::read_labels(table, &limits)?;
                    read.push(table.clone());
                }
                (Input::Volume(formats::read_volume(&source, &options)?), source.files())
            }
            Kind::Samples => {
                let source = Source::open_any(path, &whole)?;
                (Input::Samples(formats::read_samples(&source, &self.options())?), source.files())
            }
            Kind::Cells => {
                let source = Source::open_any(path, &whole)?;
                (Input::Cells(formats::read_cells(&source, &self.options())?), source.files())
            }
            Kind::Gaussians => {
                let source = Source::open_any(path, &whole)?;
                (Input::Gaussians(formats::read_gaussians(&source)?), source.files())
            }
        };
        read.extend(files);
        warn_of_holes(path, &input);
        Ok(input)
    }

    /// Returns the arrays of a file that holds several.
    pub fn arrays(&self, path: &Path) -> Result<Vec<formats::Array>, Failure> {
        let whole = self.limits.whole(memory::most());
        Ok(formats::arrays(&Source::open_any(path, &whole)?, &self.options())?)
    }

    /// Returns the kind of a file, even if the file is damaged.
    pub fn kind(&self, path: &Path) -> Result<Kind, Failure> {
        self.kind_with(path, &self.options())
    }

    /// Returns the kind of a file of which an attribute is named to colour it: a point cloud, if it
    /// can be read as one.
    fn colored_kind(&self, path: &Path) -> Result<Kind, Failure> {
        let kind = self.kind_with(path, &ReadOptions { scalar: None, ..self.options() })?;
        let holds_cloud = |format: &Format| {
            format.holds.iter().any(|holding| holding.content == Content::PointCloud)
        };
        let may_be_cloud = Format::of_path(path).is_some_and(holds_cloud);
        Ok(if kind == Kind::Samples && may_be_cloud { Kind::Mesh } else { kind })
    }

    fn kind_with(&self, path: &Path, options: &ReadOptions) -> Result<Kind, Failure> {
        let raw = self.layout().map(|_| Kind::Volume);
        let kind = Kind::of(path, &self.limits(), options)?.or(raw);
        Ok(kind.ok_or_else(|| self.foreign(path).unwrap_or_else(|| unknown(path)))?)
    }

    /// Returns the error for a file of a kind that is known, but not read.
    fn foreign(&self, path: &Path) -> Option<Error> {
        let limits = self.limits();
        let advice = if path.is_dir() {
            formats::folder_advice(path)?
        } else {
            formats::advice(&Source::open(path, &limits).ok()?)?
        };
        let message = format!("is {}, which is not read", advice.what);
        Some(Error::input(path, "file", message).hint(advice.hint))
    }

    /// Returns whether the flags give the layout of a file, because it has no format of its own.
    pub fn is_raw(&self, path: &Path) -> Result<bool, Failure> {
        let options = ReadOptions { raw: None, ..self.options() };
        let is_plain = || Ok(Kind::of(path, &self.limits(), &options)?.is_none());
        if self.layout().is_some() { is_plain() } else { Ok(false) }
    }

    /// Opens a volume that can be read slice by slice. Returns `None` for volumes that are read as
    /// a whole.
    pub fn stream(&self, path: &Path) -> Result<Option<VolumeStream>, Failure> {
        let stream = VolumeStream::open(path, &self.limits(), self.layout().as_ref())?;
        let stream = stream.map(|stream| stream.with_missing(self.missing));
        Ok(match (stream, self.spacing) {
            (Some(stream), Some(spacing)) => Some(stream.with_spacing(spacing)?),
            (stream, _) => stream,
        })
    }

    /// Returns the name of the values to read, if the user named them.
    pub fn scalar(&self) -> Option<&str> {
        self.scalar.as_deref()
    }

    /// Returns what to read of a file.
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            scalar: self.scalar.clone(),
            raw: self.layout(),
            time: self.time,
            series: self.series.clone(),
            dataset: self.dataset.clone(),
            spacing: self.spacing,
            missing: self.missing,
            labels: Vec::new(),
        }
    }

    fn layout(&self) -> Option<RawLayout> {
        self.dims.zip(self.sample_type).map(|(dims, sample_type)| RawLayout {
            dims,
            sample_type,
            spacing: self.spacing.unwrap_or(DVec3::ONE),
            endian: self.endian.unwrap_or_default(),
            header: self.header.unwrap_or(0),
        })
    }

    /// Returns how scattered samples become splats.
    pub fn sample_options(&self, deadline: Deadline) -> SampleOptions {
        let default = SampleOptions::default();
        SampleOptions {
            neighbours: self.neighbours.unwrap_or(default.neighbours),
            radius: self.radius,
            slopes: !self.no_slopes,
            deadline,
            ..default
        }
    }
}

/// Says how many values of an input are missing, and what was done about it.
fn warn_of_holes(path: &Path, input: &Input) {
    let (holes, all, done) = match input {
        Input::Volume(volume) => {
            (volume.about.holes, volume.len() as u64, "read as the lowest value")
        }
        Input::Samples(points) => {
            let holes = points.about.holes;
            (holes, points.len() as u64 + holes, "left out")
        }
        Input::Cells(cells) => {
            let done = "nothing is drawn in the cells around them";
            (cells.about.holes, cells.values.len() as u64, done)
        }
        Input::Mesh(mesh) => (mesh.about.holes, mesh.values.len() as u64, "drawn without a colour"),
        // Their reader has said how many are left out.
        Input::Gaussians(_) | Input::Hierarchy(_) | Input::Bricks(_) => return,
    };
    if holes > 0 {
        let (holes, all) = (grouped(holes), grouped(all));
        tracing::warn!("{}: {holes} of {all} values missing: {done}", path.display());
    }
}

/// Formats a count in groups of three digits: 1,234,567.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let groups: Vec<&[u8]> = digits.as_bytes().rchunks(3).rev().collect();
    groups.into_iter().map(String::from_utf8_lossy).collect::<Vec<_>>().join(",")
}

/// Returns the error for a file in no known format, with a hint that lists the known ones.
fn unknown(path: &Path) -> Error {
    let lists = Content::ALL.map(|content| {
        let holds =
            |format: &&Format| format.holds.iter().any(|holding| holding.content == content);
        let extensions: Vec<String> = FORMATS
            .iter()
            .filter(holds)
            .flat_map(|format| format.extensions)
            .map(|extension| format!(".{extension}"))
            .collect();
        let raw = match content {
            Content::Volume => ", and raw samples (also packed by gzip) with --dims and --type",
            _ => "",
        };
        format!("{}: {}{raw}", content.plural(), extensions.join(", "))
    });
    let lists = lists.join("; ");
    if path.is_dir() {
        let message =
            "is not a regular file but a folder, in which no series of pictures was found";
        let hint = "name one of its files, or a folder with slices as DICOM or TIFF files";
        return Error::input(path, "path", message).hint(hint);
    }
    Error::input(path, "file", "is in no format that can be read")
        .hint(format!("{lists}; `splatkit formats` says which file holds what"))
}
