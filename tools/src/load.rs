//! Opening an input of any kind: by its extension, then by its first bytes.

use crate::{failure::Failure, parse};
use clap::Args;
use glam::DVec3;
use splatkit::{
    io::{self, Endian, Limits, RawLayout, SampleType, Source},
    surface::Mesh,
    volume::Volume,
};
use std::path::Path;

/// What an input holds.
pub enum Input {
    Mesh(Mesh),
    Volume(Volume),
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
    /// Vertices, points or faces that a file may claim.
    #[arg(long, value_name = "COUNT")]
    limit_points: Option<u64>,
    /// Bytes that a file may take up, packed and unpacked.
    #[arg(long, value_name = "BYTES")]
    limit_bytes: Option<u64>,
}

/// The readers there are.
#[derive(Clone, Copy)]
enum Kind {
    Mesh,
    Volume,
}

impl LoadFlags {
    pub fn limits(&self) -> Limits {
        let limits = Limits::default();
        Limits {
            points: self.limit_points.unwrap_or(limits.points),
            bytes: self.limit_bytes.unwrap_or(limits.bytes),
            ..limits
        }
    }

    /// Reads a file.
    pub fn open(&self, path: &Path) -> Result<Input, Failure> {
        let limits = self.limits();
        let layout = self.dims.zip(self.sample_type).map(|(dims, sample_type)| RawLayout {
            dims,
            sample_type,
            spacing: self.spacing.unwrap_or(DVec3::ONE),
            endian: self.endian.unwrap_or_default(),
            header: self.header.unwrap_or(0),
        });
        let kind = match by_extension(path) {
            Some(kind) => kind,
            None => by_content(path, &limits, layout.is_some())?,
        };
        Ok(match kind {
            Kind::Mesh => Input::Mesh(io::load_mesh(path, &limits)?),
            Kind::Volume => Input::Volume(io::load_volume(path, &limits, layout.as_ref())?),
        })
    }
}

fn by_extension(path: &Path) -> Option<Kind> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "ply" | "obj" | "gltf" | "glb" => Some(Kind::Mesh),
        "vti" | "nrrd" | "nhdr" => Some(Kind::Volume),
        _ => None,
    }
}

fn by_content(path: &Path, limits: &Limits, raw: bool) -> Result<Kind, Failure> {
    let source = Source::open(path, limits)?;
    let start = &source.bytes()[..source.bytes().len().min(1024)];
    let text = start.trim_ascii_start();
    if start.starts_with(b"NRRD") || start.windows(8).any(|w| w == b"<VTKFile") || raw {
        return Ok(Kind::Volume);
    }
    if text.starts_with(b"ply") || text.starts_with(b"glTF") || text.starts_with(b"{") {
        return Ok(Kind::Mesh);
    }
    let error = source.error("file", "is of no kind that can be read");
    Err(error
        .hint(
            "meshes and clouds: .ply, .obj, .gltf, .glb; volumes: .vti, .nrrd, .nhdr, and raw samples (also packed by \
             gzip) with --dims and --type",
        )
        .into())
}
