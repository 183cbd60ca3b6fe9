//! `splatkit generate`: phantoms and large scans as files, to try the other commands on.

use crate::{failure::Failure, output, parse, progress::Progress, scan};
use clap::{Args, ValueEnum};
use glam::{DMat3, DVec3};
use splatkit::{
    Error,
    cells::{CellKind, Cells},
    disk, formats, gaussians,
    input::Limits,
    memory,
    session::{Data, Reading},
    volume::{Arrangement, Lattice, Volume, phantoms::Phantom},
};
use std::{io::Write, path::PathBuf};

#[derive(Args, Debug)]
pub struct Generate {
    /// Choose the content: the phantom marschner-lobb, ball, specimen, slabs or head (in Hounsfield
    /// units; a length of 1 stands for 100 mm), scan for a mesh, gaussians for a trained scene, or
    /// a tube of tetrahedra, hexahedra, wedges, pyramids, quadratic-tetrahedra or
    /// quadratic-hexahedra.
    #[arg(value_parser = what)]
    what: What,
    /// Write to this file: a volume as .nrrd, or as .vtr on a rectilinear lattice that is densest
    /// in the middle; scattered samples as .csv; a scan or Gaussians as .ply; a tube as .vtu.
    #[arg(short, long, value_name = "FILE", value_parser = target)]
    output: PathBuf,
    /// Set the number of samples along each axis of the cube from −1 to 1.
    #[arg(long, value_name = "XxYxZ", value_parser = parse::dims, default_value = "64x64x64")]
    dims: [usize; 3],
    /// Choose the lattice of a .nrrd. bcc has 29.3 % fewer samples than a Cartesian cube with as
    /// many along each axis as --dims has along x.
    #[arg(long, value_enum, default_value_t = Places::Cartesian)]
    lattice: Places,
    /// Choose the type of the samples of a .nrrd. u8 maps the values 0 to 1 to 0 to 255 and is
    /// written uncompressed, slice by slice, so that the volume may be larger than memory.
    #[arg(long = "type", value_enum, default_value_t = Type::F32)]
    sample_type: Type,
    /// Set the number of cubes through the wall of a tube. There are 18 times as many as the cube
    /// of this number, each of 1 to 6 cells.
    #[arg(
        long,
        value_name = "COUNT",
        default_value_t = 8,
        value_parser = clap::value_parser!(u32).range(1..=64)
    )]
    parts: u32,
    /// Make a scan from this mesh: subdivide its triangles into four again and again, and displace
    /// its surface by waves.
    #[arg(long, value_name = "MESH", required_if_eq("what", "scan"))]
    from: Option<PathBuf>,
    /// Set the number of scattered samples in a .csv or of Gaussians, or the largest number of
    /// vertices of a scan.
    #[arg(
        long,
        value_name = "COUNT",
        default_value_t = 20_000,
        value_parser = clap::value_parser!(u32).range(1..=50_000_000)
    )]
    points: u32,
    /// Replace an existing file.
    #[arg(long)]
    overwrite: bool,
}

/// [`Arrangement`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Places {
    /// Even steps along each axis.
    Cartesian,
    /// Body-centred cubic.
    Bcc,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Type {
    F32,
    U8,
}

#[derive(Debug, Clone, Copy)]
enum What {
    Phantom(Phantom),
    Scan,
    Gaussians,
    Tube(CellKind),
}

/// The kinds of cells of a tube.
const TUBES: [CellKind; 6] = [
    CellKind::Tetrahedron,
    CellKind::Hexahedron,
    CellKind::Wedge,
    CellKind::Pyramid,
    CellKind::QuadraticTetrahedron,
    CellKind::QuadraticHexahedron,
];

/// The names of the tubes, in the same order.
const TUBE_NAMES: [&str; 6] = [
    "tetrahedra",
    "hexahedra",
    "wedges",
    "pyramids",
    "quadratic-tetrahedra",
    "quadratic-hexahedra",
];

fn what(name: &str) -> Result<What, String> {
    if name == "scan" {
        return Ok(What::Scan);
    }
    if name == "gaussians" {
        return Ok(What::Gaussians);
    }
    let tube = TUBE_NAMES.iter().position(|known| *known == name);
    if let Some(tube) = tube {
        return Ok(What::Tube(TUBES[tube]));
    }
    let names = || [&Phantom::NAMES[..], &TUBE_NAMES].concat().join(", ");
    Phantom::named(name)
        .map(What::Phantom)
        .ok_or_else(|| format!("use {}, gaussians or scan", names()))
}

fn target(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("nrrd" | "vtr" | "csv" | "ply" | "vtu") => Ok(path),
        _ => Err("the file's name must end in .nrrd, .vtr, .csv, .ply or .vtu".into()),
    }
}

fn usage(message: &str) -> Failure {
    Failure::Usage(message.into())
}

impl Generate {
    pub fn run(self, progress: &Progress) -> Result<(), Failure> {
        output::check(&self.output, self.overwrite)?;
        output::try_writing(&self.output, self.from.as_slice())?;
        progress.stage(format!("Making {}", self.output.display()));
        let extension =
            self.output.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        match (self.what, &self.from, extension) {
            (What::Scan, Some(from), "ply") => {
                let reading = Reading::default().within_memory(memory::most());
                let opened = reading.open(from)?;
                let data = opened.read()?;
                output::check_unneeded(&self.output, &opened.files())?;
                let Data::Mesh(mesh) = data else {
                    return Err(Error::input(from, "file", "holds no mesh").into());
                };
                if mesh.triangles.is_empty() {
                    let message = format!("{} has no triangles to subdivide", from.display());
                    return Err(Error::Argument(message).into());
                }
                disk::write(&self.output, &scan::ply(&scan::scan(&mesh, self.points as usize)))?;
            }
            (What::Scan, ..) => {
                return Err(usage("a scan is made from a mesh (--from) and written as .ply"));
            }
            (What::Gaussians, _, "ply") => {
                let set = gaussians::phantom(self.points as usize);
                formats::ply::write_gaussians(&set, &self.output)?;
            }
            (What::Gaussians, ..) => return Err(usage("trained Gaussians are made as .ply")),
            (What::Tube(kind), _, "vtu") => {
                formats::write_cells(&Cells::tube(kind, self.parts)?, &self.output)?;
            }
            (What::Tube(_), ..) | (_, _, "vtu") => {
                return Err(usage("a tube of cells is written as .vtu, and nothing else is"));
            }
            (_, _, "ply") => {
                return Err(usage("phantoms are written as .nrrd, .vtr or .csv"));
            }
            (What::Phantom(phantom), _, "csv") => {
                disk::write_with(&self.output, |out| scattered(phantom, self.points, out))?;
            }
            (What::Phantom(phantom), _, "vtr") => {
                check_dims(self.dims, AS_TEXT)?;
                disk::write_with(&self.output, |out| rectilinear(phantom, self.dims, out))?;
            }
            (What::Phantom(phantom), ..) if self.sample_type == Type::U8 => {
                self.bytes(phantom, progress)?;
            }
            (What::Phantom(phantom), ..) => {
                let [x, ..] = self.dims;
                check_dims(
                    if matches!(self.lattice, Places::Bcc) { [x; 3] } else { self.dims },
                    AS_NUMBERS,
                )?;
                let volume = self.volume(phantom)?;
                formats::nrrd::write(&volume, &self.output)?;
            }
        }
        Ok(())
    }

    /// Writes 8-bit samples slice by slice.
    fn bytes(&self, phantom: Phantom, progress: &Progress) -> Result<(), Failure> {
        if matches!(self.lattice, Places::Bcc) || phantom == Phantom::Head {
            let message = "--type u8 needs a Cartesian lattice and a phantom with values from 0 \
                 to 1; bcc and head need f32";
            return Err(Failure::Usage(message.into()));
        }
        // Only one slice is in memory at a time.
        let [x, y, z] = self.dims;
        check_dims([x, y, z.min(1)], AS_BYTES)?;
        let slices = phantom.byte_slices(self.dims)?;
        let bar = progress.bar("Making slices", self.dims[2] as u64);
        formats::nrrd::write_bytes(slices.lattice(), &self.output, |k| {
            bar.set(k as u64);
            slices.slice(k)
        })?;
        Ok(())
    }

    fn volume(&self, phantom: Phantom) -> splatkit::Result<Volume> {
        match self.lattice {
            Places::Cartesian => phantom.sample(self.dims),
            Places::Bcc => phantom.sample_on(body_centred(self.dims[0])),
        }
    }
}

/// Bytes of memory for each sample that is made: in slices; as numbers and compressed; and as text,
/// which is written while it is made but read as a whole.
const AS_BYTES: u64 = 2;
const AS_NUMBERS: u64 = 16;
const AS_TEXT: u64 = 64;

/// Refuses dimensions without samples, or with more than memory may hold.
fn check_dims(dims: [usize; 3], bytes: u64) -> Result<(), Failure> {
    if dims.contains(&0) {
        let [x, y, z] = dims;
        return Err(Failure::Usage(format!(
            "--dims: a volume of {x} × {y} × {z} samples holds none"
        )));
    }
    let samples = dims.iter().try_fold(1u64, |all, &n| all.checked_mul(n as u64));
    let most = memory::most().unwrap_or(u64::MAX).min(Limits::default().bytes) / bytes;
    match samples.filter(|&samples| samples <= most) {
        Some(_) => Ok(()),
        None => {
            Err(Failure::Usage(format!("--dims: from 1 to {most} samples can be made at once")))
        }
    }
}

/// Returns a body-centred lattice over the cube from −1 to 1 that corresponds to a Cartesian one of
/// `side`³ samples: the copies of their spectra are the same distance apart.
pub fn body_centred(side: usize) -> Lattice {
    let edge = 2.0 * std::f64::consts::SQRT_2 / side.saturating_sub(1).max(1) as f64;
    let cells = (2.0 / edge).ceil();
    let layers = cells as usize + 1;
    Lattice {
        dims: [layers, layers, 2 * layers - 1],
        origin: DVec3::splat(-0.5 * cells * edge),
        axes: DMat3::from_diagonal(DVec3::splat(edge)),
        arrangement: Arrangement::BodyCentred,
    }
}

/// Writes a grid as VTK does, with coordinates along each axis that are four times as dense in the
/// middle as at the ends.
fn rectilinear(phantom: Phantom, dims: [usize; 3], out: &mut impl Write) -> std::io::Result<()> {
    let place = |i: usize, count: usize| {
        let t = 2.0 * i as f64 / count.saturating_sub(1).max(1) as f64 - 1.0;
        t - 0.6 * (std::f64::consts::PI * t).sin() / std::f64::consts::PI
    };
    let places = dims.map(|count| (0..count).map(|i| place(i, count)).collect::<Vec<_>>());
    let extent = dims.map(|count| format!("0 {}", count.saturating_sub(1))).join(" ");
    writeln!(
        out,
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"RectilinearGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         <RectilinearGrid WholeExtent=\"{extent}\">\n<Piece Extent=\"{extent}\">\n\
         <PointData Scalars=\"value\">"
    )?;
    let [x, y, z] = &places;
    let points = z
        .iter()
        .flat_map(|z| y.iter().flat_map(move |y| x.iter().map(move |x| DVec3::new(*x, *y, *z))));
    array("Float32", "value", points.map(|p| phantom.value(p)), out)?;
    writeln!(out, "</PointData>\n<Coordinates>")?;
    for (name, places) in ["x", "y", "z"].iter().zip(&places) {
        array("Float64", name, places.iter().copied(), out)?;
    }
    writeln!(out, "</Coordinates>\n</Piece>\n</RectilinearGrid>\n</VTKFile>")
}

fn array(
    kind: &str,
    name: &str,
    values: impl Iterator<Item = f64>,
    out: &mut impl Write,
) -> std::io::Result<()> {
    write!(out, "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">")?;
    for (number, value) in values.enumerate() {
        write!(out, "{}{value:.7}", if number > 0 { " " } else { "" })?;
    }
    writeln!(out, "</DataArray>")
}

/// Writes a table of samples at random places in the cube, which are the same every time.
fn scattered(phantom: Phantom, count: u32, out: &mut impl Write) -> std::io::Result<()> {
    let mut state = 0u64;
    // SplitMix64 (Steele, Lea & Flood 2014).
    let mut random = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        2.0 * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 1.0
    };
    writeln!(out, "x,y,z,value")?;
    for _ in 0..count {
        let p = DVec3::new(random(), random(), random());
        writeln!(out, "{:.6},{:.6},{:.6},{:.6}", p.x, p.y, p.z, phantom.value(p))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattices_fill_the_cube() {
        let lattice = body_centred(41);
        lattice.validate().unwrap();
        let cartesian = 41f64.powi(3);
        // Whole cells reach a little beyond the cube.
        assert!((0.6..0.85).contains(&(lattice.len() as f64 / cartesian)), "{}", lattice.len());
        let bounds = lattice.bounds();
        assert!(bounds.min.max_element() <= -1.0 && bounds.max.min_element() >= 1.0);
    }

    fn text(write: impl FnOnce(&mut Vec<u8>) -> std::io::Result<()>) -> String {
        let mut out = Vec::new();
        write(&mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn rectilinear_grids_have_their_coordinates() {
        let grid = text(|out| rectilinear(Phantom::Ball, [2, 3, 1], out));
        assert!(grid.contains("WholeExtent=\"0 1 0 2 0 0\""), "{grid}");
        assert!(grid.contains(">-1.0000000 0.0000000 1.0000000<"), "{grid}");
    }

    #[test]
    fn scattered_samples_are_a_table() {
        let table = text(|out| scattered(Phantom::Ball, 3, out));
        assert_eq!((table.lines().count(), table.lines().next()), (4, Some("x,y,z,value")));
        assert!(
            table
                .lines()
                .skip(1)
                .all(|line| line.split(',').all(|part| part.parse::<f64>().is_ok()))
        );
    }
}
