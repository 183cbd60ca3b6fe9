//! Reading files of any kind, as the command reads them.

use crate::{
    errors::{options, wrong},
    notes,
};
use serde::Deserialize;
use splatkit::{
    Deadline, Error,
    bricks::Bricks,
    cells::Cells,
    formats::{
        self, Content, Endian, Format, Kind, RawLayout, ReadOptions, SampleType, VolumeStream,
    },
    gaussians::Gaussians,
    glam::DVec3,
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

/// The content of a file.
pub enum Input {
    Mesh(Mesh),
    Volume(Volume),
    Samples(Points),
    Cells(Cells),
    Gaussians(Gaussians),
    Hierarchy(Arc<Hierarchy>),
    Bricks(Arc<Bricks>),
}

/// How files are read.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Load {
    scalar: Option<String>,
    dims: Option<[usize; 3]>,
    r#type: Option<String>,
    endian: Option<String>,
    header: Option<u64>,
    time: Option<usize>,
    series: Option<String>,
    dataset: Option<String>,
    spacing: Option<[f64; 3]>,
    missing: Option<f64>,
    labels: Option<PathBuf>,
    radius: Option<f64>,
    neighbours: Option<usize>,
    slopes: Option<bool>,
    limits: LimitOptions,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct LimitOptions {
    points: Option<u64>,
    bytes: Option<u64>,
    depth: Option<usize>,
    texels: Option<u64>,
    seconds: Option<u64>,
}

impl Load {
    /// Reads the options.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let own: Self = options(text)?;
        own.layout()?;
        if own.spacing.is_some_and(|spacing| !spacing.iter().all(|s| *s > 0.0 && s.is_finite())) {
            return Err(wrong("a spacing has a length above 0 for each axis"));
        }
        if own.neighbours.is_some_and(|count| !(4..=64).contains(&count)) {
            return Err(wrong("neighbours is a number from 4 to 64"));
        }
        Ok(own)
    }

    pub fn limits(&self) -> Limits {
        let default = Limits::default();
        Limits {
            points: self.limits.points.unwrap_or(default.points),
            bytes: self.limits.bytes.unwrap_or(default.bytes),
            depth: self.limits.depth.unwrap_or(default.depth),
            texels: self.limits.texels.unwrap_or(default.texels),
            seconds: self.limits.seconds.unwrap_or(default.seconds),
            until: default.until,
        }
    }

    /// Returns the limits of a file that is read as a whole into `memory` bytes.
    fn whole(&self, memory: Option<u64>) -> Limits {
        let limits = self.limits();
        let memory = memory.filter(|_| self.limits.bytes.is_none()).unwrap_or(u64::MAX);
        // The limit also counts data that is dropped on the way.
        Limits { bytes: limits.bytes.min(memory.saturating_mul(2)), ..limits }
    }

    /// Returns the name of the values to read, if the caller named them.
    pub fn scalar(&self) -> Option<&str> {
        self.scalar.as_deref()
    }

    /// Returns what to read of a file.
    pub fn read_options(&self) -> ReadOptions {
        ReadOptions {
            scalar: self.scalar.clone(),
            raw: self.layout().ok().flatten(),
            time: self.time,
            series: self.series.clone(),
            dataset: self.dataset.clone(),
            spacing: self.spacing.map(DVec3::from_array),
            missing: self.missing,
            labels: Vec::new(),
        }
    }

    /// Returns how scattered samples become splats.
    pub fn sample_options(&self, deadline: Deadline) -> SampleOptions {
        let default = SampleOptions::default();
        SampleOptions {
            neighbours: self.neighbours.unwrap_or(default.neighbours),
            radius: self.radius,
            slopes: self.slopes.unwrap_or(default.slopes),
            deadline,
            ..default
        }
    }

    fn layout(&self) -> Result<Option<RawLayout>, Error> {
        let (dims, name) = match (self.dims, &self.r#type) {
            (Some(dims), Some(name)) => (dims, name),
            (None, None) => return Ok(None),
            _ => return Err(wrong("a raw volume needs both dims and type")),
        };
        let types = "u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64";
        let sample_type = SampleType::from_name(name)
            .ok_or_else(|| wrong(format!("the type “{name}” is none of {types}")))?;
        let endian = match self.endian.as_deref() {
            None | Some("little") => Endian::Little,
            Some("big") => Endian::Big,
            Some(other) => {
                return Err(wrong(format!("the byte order “{other}” is neither little nor big")));
            }
        };
        let spacing = self.spacing.map_or(DVec3::ONE, DVec3::from_array);
        let header = self.header.unwrap_or(0);
        Ok(Some(RawLayout { dims, sample_type, spacing, endian, header }))
    }

    /// Reads a file, and adds its path, and those of the files it refers to, to `read`. A mesh or
    /// point cloud has the values of this attribute, if one is named.
    pub fn open(
        &self,
        path: &Path,
        attribute: Option<&str>,
        read: &mut Vec<PathBuf>,
    ) -> Result<Input, Error> {
        let (limits, whole) = (self.limits(), self.whole(memory::most()));
        let kind = match attribute {
            Some(_) => self.colored_kind(path)?,
            None => self.kind(path)?,
        };
        let mut options = self.read_options();
        let source = match kind {
            Kind::Bricks => {
                read.push(path.to_owned());
                return Ok(Input::Bricks(Arc::new(Bricks::open(path, &limits)?)));
            }
            Kind::Hierarchy => {
                read.push(path.to_owned());
                return Ok(Input::Hierarchy(Arc::new(Hierarchy::open(path, &limits)?)));
            }
            _ => Source::open_any(path, &whole)?,
        };
        let input = match kind {
            Kind::Mesh => {
                options.scalar = attribute.map(str::to_owned).or(options.scalar);
                Input::Mesh(formats::read_mesh(&source, &options)?)
            }
            Kind::Samples => Input::Samples(formats::read_samples(&source, &options)?),
            Kind::Cells => Input::Cells(formats::read_cells(&source, &options)?),
            Kind::Gaussians => Input::Gaussians(formats::read_gaussians(&source)?),
            _ => {
                if let Some(table) = &self.labels {
                    options.labels = formats::read_labels(table, &limits)?;
                    read.push(table.clone());
                }
                Input::Volume(formats::read_volume(&source, &options)?)
            }
        };
        read.extend(source.files());
        warn_of_holes(&path.display().to_string(), &input);
        Ok(input)
    }

    /// Returns the kind of a file, even if the file is damaged.
    pub fn kind(&self, path: &Path) -> Result<Kind, Error> {
        self.kind_with(path, &self.read_options())
    }

    /// Returns the kind of a file of which an attribute is named to colour it: a point cloud, if it
    /// can be read as one.
    fn colored_kind(&self, path: &Path) -> Result<Kind, Error> {
        let kind = self.kind_with(path, &ReadOptions { scalar: None, ..self.read_options() })?;
        let holds_cloud = |format: &Format| {
            format.holds.iter().any(|holding| holding.content == Content::PointCloud)
        };
        let may_be_cloud = Format::of_path(path).is_some_and(holds_cloud);
        Ok(if kind == Kind::Samples && may_be_cloud { Kind::Mesh } else { kind })
    }

    fn kind_with(&self, path: &Path, options: &ReadOptions) -> Result<Kind, Error> {
        let raw = options.raw.as_ref().map(|_| Kind::Volume);
        let kind = Kind::of(path, &self.limits(), options)?.or(raw);
        kind.ok_or_else(|| self.foreign(path).unwrap_or_else(|| unknown(path)))
    }

    /// Returns the error for a file of a kind that is known, but not read.
    fn foreign(&self, path: &Path) -> Option<Error> {
        let advice = if path.is_dir() {
            formats::folder_advice(path)?
        } else {
            formats::advice(&Source::open(path, &self.limits()).ok()?)?
        };
        let message = format!("is {}, which is not read", advice.what);
        Some(Error::input(path, "file", message).hint(advice.hint))
    }

    /// Opens a volume that can be read slice by slice; `None` for volumes that are read as a whole.
    pub fn stream(&self, path: &Path) -> Result<Option<VolumeStream>, Error> {
        let stream = VolumeStream::open(path, &self.limits(), self.layout()?.as_ref())?;
        let stream = stream.map(|stream| stream.with_missing(self.missing));
        Ok(match (stream, self.spacing) {
            (Some(stream), Some(spacing)) => Some(stream.with_spacing(DVec3::from_array(spacing))?),
            (stream, _) => stream,
        })
    }
}

/// Says how many values of an input are missing, and what was done about it.
pub fn warn_of_holes(name: &str, input: &Input) {
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
        Input::Gaussians(_) | Input::Hierarchy(_) | Input::Bricks(_) => return,
    };
    if holes > 0 {
        notes::add(format!("{name}: {holes} of {all} values missing: {done}"));
    }
}

fn unknown(path: &Path) -> Error {
    if path.is_dir() {
        let message =
            "is not a regular file but a folder, in which no series of pictures was found";
        let hint = "name one of its files, or a folder with slices as DICOM or TIFF files";
        return Error::input(path, "path", message).hint(hint);
    }
    Error::input(path, "file", "is in no format that can be read")
        .hint("raw samples are read if dims and type are given")
}
