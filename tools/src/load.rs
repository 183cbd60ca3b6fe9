//! Opening an input of any kind: by its extension, then by its first bytes.

use crate::{failure::Failure, limits::LimitFlags, parse};
use clap::Args;
use glam::DVec3;
use splatkit::{
    Deadline, Error,
    formats::{self, Endian, Kind, RawLayout, SampleType, VolumeStream},
    hierarchy::Hierarchy,
    input::{Limits, Source},
    memory,
    scattered::{Points, SampleOptions},
    surface::Mesh,
    volume::{Volume, bricks::Bricks},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// What an input holds.
pub enum Input {
    Mesh(Mesh),
    Volume(Volume),
    Samples(Points),
    Hierarchy(Arc<Hierarchy>),
    Bricks(Arc<Bricks>),
}

/// How raw files are read, and how much any file may claim.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Input")]
pub struct LoadFlags {
    /// Raw volumes: samples along each axis, the fastest first. Needs --type.
    #[arg(long, value_name = "XxYxZ", value_parser = parse::dims, requires = "sample_type")]
    dims: Option<[usize; 3]>,
    /// Raw volumes: the type of a sample: u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64.
    #[arg(long = "type", id = "sample_type", value_name = "TYPE", value_parser = parse::sample_type, requires = "dims")]
    sample_type: Option<SampleType>,
    /// Raw volumes: world units between samples [default: 1]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::spacing, requires = "dims")]
    spacing: Option<DVec3>,
    /// Raw volumes: the order of bytes, little or big.
    #[arg(long, value_name = "ORDER", value_parser = parse::endian, requires = "dims")]
    endian: Option<Endian>,
    /// Raw volumes: bytes before the first sample.
    #[arg(long, value_name = "BYTES", requires = "dims")]
    header: Option<u64>,
    /// Scattered samples: the property, column or array that holds the values. A PLY file without faces
    /// and a table of points are read as samples with it, as clouds without.
    #[arg(long, value_name = "NAME")]
    scalar: Option<String>,
    /// Scattered samples: one radius for all, in world units, of two standard deviations [default: the file's, or from the
    /// neighbours]
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
    radius: Option<f64>,
    /// Scattered samples: the nearest neighbours, 4 to 64, that kernels and slopes are made from [default: 16]
    #[arg(long, value_name = "COUNT", value_parser = parse::neighbours)]
    neighbours: Option<usize>,
    /// Scattered samples: mean values alone, without slopes fitted to the neighbours.
    #[arg(long)]
    no_slopes: bool,
    #[command(flatten)]
    limits: LimitFlags,
}

impl LoadFlags {
    pub fn limits(&self) -> Limits {
        self.limits.limits()
    }

    /// Reads a file.
    pub fn open(&self, path: &Path) -> Result<Input, Failure> {
        self.open_within(path, memory::most(), &mut Vec::new())
    }

    /// Reads a file; where it is read as a whole it may take so many bytes of memory, unless a flag allows more. Adds the file
    /// and those that it refers to to those that were `read`.
    pub fn open_within(
        &self,
        path: &Path,
        memory: Option<u64>,
        read: &mut Vec<PathBuf>,
    ) -> Result<Input, Failure> {
        let (limits, whole) = (self.limits(), self.limits.whole(memory));
        let (input, files) = match self.kind(path)? {
            // These refer to no others.
            Kind::Bricks => {
                (Input::Bricks(Arc::new(Bricks::open(path, &limits)?)), vec![path.to_owned()])
            }
            Kind::Hierarchy => {
                (Input::Hierarchy(Arc::new(Hierarchy::open(path, &limits)?)), vec![path.to_owned()])
            }
            Kind::Mesh => {
                let source = Source::open(path, &whole)?;
                (Input::Mesh(formats::read_mesh(&source)?), source.files())
            }
            Kind::Volume => {
                let source = Source::open(path, &whole)?;
                (
                    Input::Volume(formats::read_volume(&source, self.layout().as_ref())?),
                    source.files(),
                )
            }
            Kind::Samples => {
                let source = Source::open(path, &whole)?;
                (
                    Input::Samples(formats::read_samples(&source, self.scalar.as_deref())?),
                    source.files(),
                )
            }
        };
        read.extend(files);
        Ok(input)
    }

    /// What a file holds, sound or not.
    pub fn kind(&self, path: &Path) -> Result<Kind, Failure> {
        let raw = self.layout().map(|_| Kind::Volume);
        Ok(Kind::of(path, &self.limits(), self.scalar.is_some())?
            .or(raw)
            .ok_or_else(|| unknown(path))?)
    }

    /// Opens a volume that can be read slice by slice; none where it is read as a whole.
    pub fn stream(&self, path: &Path) -> Result<Option<VolumeStream>, Failure> {
        Ok(VolumeStream::open(path, &self.limits(), self.layout().as_ref())?)
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

    /// How scattered samples become splats.
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

fn unknown(path: &Path) -> Error {
    Error::input(path, "file", "is of no kind that can be read").hint(
        "hierarchies: .splk; volumes in bricks: .splv; meshes: .ply, .obj, .gltf, .glb, .stl; clouds: .ply, .las, .laz, .e57, .pcd, .xyz, .pts, .asc, and .csv and .txt whose \
         columns are a position, a colour or a normal; volumes: .vti, .vtr, .vtk, .nrrd, .nhdr, and raw samples (also packed \
         by gzip) with --dims and --type; scattered samples: .vtu, .vtp, .vtk, .npy, .csv, .txt, .xyzv, and .ply and tables of \
         points with --scalar",
    )
}
