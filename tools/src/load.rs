//! The flags that say how inputs are read.

use crate::{failure::Failure, limits::LimitFlags, parse};
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use glam::DVec3;
use splatkit::{
    Deadline,
    about::Modality,
    formats::{Endian, Kind, SampleType},
    input::Limits,
    session::{Data, Description, LimitsEntry, Reading, ReadingEntry},
};
use std::path::{Path, PathBuf};

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
    /// Volumes: say what measured the values, for the first colours: ct, mr, emission, ultrasound
    /// or microscopy [default: as the file says]
    #[arg(long, value_name = "NAME", value_parser = modalities())]
    modality: Option<Modality>,
    /// Volumes: take the opacity from this array of the file, and the colours from the values
    /// (--scalar, --colormap).
    #[arg(long, value_name = "NAME")]
    opacity_from: Option<String>,
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
    /// When everything that is read must be done.
    #[arg(skip)]
    until: Deadline,
}

/// Parses what measured the values of a volume.
fn modalities() -> impl TypedValueParser<Value = Modality> {
    PossibleValuesParser::new(Modality::ALL.map(Modality::name))
        .map(|name| Modality::named(&name).expect("a name of the list"))
}

impl LoadFlags {
    pub fn limits(&self) -> Limits {
        self.entry().limits()
    }

    /// Returns the flags for several inputs that share one time limit, which begins now.
    pub fn begun(&self) -> Self {
        Self { until: self.limits().deadline(), ..self.clone() }
    }

    /// Returns the way to read files. An input that is read as a whole may take `memory` bytes,
    /// unless a flag allows more.
    pub fn reading(&self, memory: Option<u64>) -> Reading {
        self.entry().reading_within(memory)
    }

    /// Whether a flag limits the bytes of inputs.
    pub fn has_bytes(&self) -> bool {
        self.entry().limits.bytes.is_some()
    }

    /// Reads a file.
    pub fn open(&self, path: &Path) -> Result<Data, Failure> {
        Ok(self.entry().reading().open(path)?.read()?)
    }

    /// Returns the kind of a file, even if the file is damaged.
    pub fn kind(&self, path: &Path) -> Result<Kind, Failure> {
        Ok(self.entry().reading().kind(path)?)
    }

    /// Returns the name of the values to read, if the user named them.
    pub fn scalar(&self) -> Option<&str> {
        self.scalar.as_deref()
    }

    /// Returns how inputs are read.
    pub fn entry(&self) -> ReadingEntry {
        ReadingEntry {
            scalar: self.scalar.clone(),
            dims: self.dims,
            r#type: self.sample_type,
            endian: self.endian,
            header: self.header,
            time: self.time,
            series: self.series.clone(),
            dataset: self.dataset.clone(),
            spacing: self.spacing.map(|spacing| spacing.to_array()),
            missing: self.missing,
            modality: self.modality,
            opacity_from: self.opacity_from.clone(),
            labels: self.labels.clone(),
            radius: self.radius,
            neighbours: self.neighbours,
            slopes: self.no_slopes.then_some(false),
            limits: self.limits.entry(),
            until: self.until,
        }
    }

    /// Changes how the inputs of a scene are read: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) {
        let entry = self.entry();
        macro_rules! share {
            ($($field:ident),*) => {$(
                if entry.$field.is_some() {
                    scene.inputs.iter_mut().for_each(|input| input.reading.$field = None);
                    scene.reading.$field = entry.$field;
                }
            )*};
        }
        share!(
            scalar,
            dims,
            r#type,
            endian,
            header,
            time,
            series,
            dataset,
            spacing,
            missing,
            modality,
            opacity_from,
            labels,
            radius,
            neighbours,
            slopes
        );
        let LimitsEntry { points, bytes, depth, texels, seconds } = entry.limits;
        let limits = &mut scene.reading.limits;
        limits.points = points.or(limits.points);
        limits.bytes = bytes.or(limits.bytes);
        limits.depth = depth.or(limits.depth);
        limits.texels = texels.or(limits.texels);
        limits.seconds = seconds.or(limits.seconds);
    }
}
