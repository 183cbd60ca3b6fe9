//! What must hold for every input, whatever its bytes: the reader returns an error or a valid
//! result, in little time and memory. The fuzz targets (`fuzz/`) and the regression tests
//! (`tests/files/regressions.rs`) share these entry points. There is one per format, with the name
//! of its fuzz target and of its folder of regressions.
//!
//! A function here panics if the library breaks a promise, and returns otherwise.

mod checksums;

use crate::testing::folder::Folder;
use arbitrary::{Arbitrary, Unstructured};
use checksums::{sum_bricks, sum_hierarchy};
use glam::{DVec3, Vec3};
use splatkit::{
    Error, Result,
    bricks::Bricks,
    cells::Cells,
    formats::{self, Endian, Kind, RawLayout, ReadOptions, SampleType, Stream, VolumeStream},
    gaussians::{Eye, Gaussians},
    hierarchy::{
        BuildOptions, Hierarchy, Preset, Tree,
        external::{self, ExternalOptions},
        file::{WriteOptions, to_bytes},
        validate,
    },
    input::{Limits, Source},
    math::{Camera, Projection},
    reference,
    scattered::Points,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, Volume},
};
use std::path::Path;

/// Reads bytes as a file of one format and checks the result.
pub type Target = fn(&[u8]);

/// All entry points, by name.
pub const FORMATS: &[(&str, Target)] = &[
    ("ply", ply),
    ("splat", splat),
    ("ksplat", ksplat),
    ("spz", spz),
    ("sog", sog),
    ("sog_streamed", sog_streamed),
    ("obj", obj),
    ("stl", stl),
    ("off", off),
    ("gltf", gltf),
    ("las", las),
    ("e57", e57),
    ("e57_summed", e57_summed),
    ("xyz", xyz),
    ("pcd", pcd),
    ("csv", csv),
    ("npy", npy),
    ("npz", npz),
    ("nrrd", nrrd),
    ("nifti", nifti),
    ("dicom", dicom),
    ("dicom_folder", dicom_folder),
    ("mhd", mhd),
    ("mrc", mrc),
    ("tiff", tiff),
    ("hdf5", hdf5),
    ("vti", vti),
    ("vtr", vtr),
    ("vtu", vtu),
    ("vtk", vtk),
    ("raw", raw),
    ("any", any),
    ("regions", regions),
    ("splk", splk),
    ("splk_summed", splk_summed),
    ("splv", splv),
    ("splv_summed", splv_summed),
    ("transfer", transfer),
    ("convert_render", convert_render),
];

/// Limits so low that any input that is slow or large within them shows a bug.
pub fn limits() -> Limits {
    Limits { points: 1 << 16, bytes: 64 << 20, texels: 1 << 16, ..Limits::default() }
}

/// The most samples of a bricked volume that is checked.
const MOST_SAMPLES: usize = 1 << 20;

/// Reads bytes in memory under a file name.
fn read<T>(name: &str, bytes: &[u8], read: impl Fn(&Source) -> Result<T>) -> Option<T> {
    let limits = limits();
    let source = Source::from_bytes(Path::new(name), bytes, &limits).expect("small enough");
    accepted(read(&source))
}

/// Returns what was read, or asserts that the error has a message.
fn accepted<T>(result: Result<T>) -> Option<T> {
    match result {
        Ok(read) => Some(read),
        Err(Error::Input { place, message, .. }) => {
            assert!(!place.is_empty() && !message.is_empty(), "an error without a message");
            None
        }
        Err(error) => {
            assert!(!error.to_string().is_empty(), "an error without a message");
            None
        }
    }
}

fn sound_mesh(mesh: &Mesh) {
    let count = mesh.positions.len();
    let fits = |length: usize, wanted: usize| length == 0 || length == wanted;
    assert!(count as u64 <= limits().points, "{count} points");
    assert!(mesh.origin.is_finite(), "origin {}", mesh.origin);
    assert!(mesh.positions.iter().all(|p| p.is_finite()), "a position is not finite");
    assert!(mesh.normals.iter().all(|n| n.is_finite()), "a normal is not finite");
    assert!(
        fits(mesh.normals.len(), count)
            && fits(mesh.colors.len(), count)
            && fits(mesh.uvs.len(), count)
    );
    assert!(fits(mesh.values.len(), count));
    assert!(fits(mesh.triangle_materials.len(), mesh.triangles.len()));
    assert!(
        mesh.triangles.iter().flatten().all(|&index| (index as usize) < count),
        "an index is out of range"
    );
    assert!(
        mesh.lines.iter().flatten().all(|&index| (index as usize) < count),
        "an end of a line is out of range"
    );
    assert!(mesh.triangle_materials.iter().all(|&index| (index as usize) < mesh.materials.len()));
    assert!(
        mesh.sensors.iter().all(|sensor| sensor.position.is_finite() && sensor.points.end <= count)
    );
    for material in &mesh.materials {
        assert!(
            material.color.iter().all(|v| (0.0..=1.0).contains(v)),
            "the colour {:?}",
            material.color
        );
        let whole =
            |t: &splatkit::surface::Texture| t.texels.len() == t.width as usize * t.height as usize;
        assert!(
            material.texture.as_deref().is_none_or(whole),
            "a texture whose size does not match its texels"
        );
    }
}

fn sound_samples(points: &Points) {
    points.validate().expect("what was read is sound");
    assert!(points.bounds().is_finite() && points.range().iter().all(|v| v.is_finite()));
}

fn sound_volume(volume: &Volume) {
    volume.lattice.validate().expect("what was read is sound");
    assert_eq!(volume.len(), volume.lattice.len());
    assert!(volume.bounds().is_finite(), "bounds {:?}", volume.bounds());
    let [low, high] = volume.range;
    assert!(low.is_finite() && high.is_finite() && low <= high, "range {low} … {high}");
    for index in (0..volume.len()).step_by(volume.len().div_ceil(64)) {
        assert!(
            (low..=high).contains(&volume.value(index)),
            "sample {index} lies beyond the range"
        );
    }
}

fn mesh(name: &str, bytes: &[u8], reader: fn(&Source) -> Result<Mesh>) -> Option<Mesh> {
    read(name, bytes, reader).inspect(sound_mesh)
}

/// Cells are valid, and so are the facts that `info` prints of them.
fn sound_cells(cells: &Cells) {
    cells.validate().expect("valid cells");
    let bounds = cells.bounds();
    assert!(bounds.is_finite() && !bounds.is_empty(), "bounds {bounds:?}");
    assert!(cells.range().iter().all(|end| !end.is_nan()));
}

/// Trained Gaussians are valid, and so are the facts that `info` prints of them and the splats that
/// an eye sees.
fn sound_gaussians(set: &Gaussians) {
    set.validate().expect("what was read is sound");
    assert!(!set.is_empty() && set.len() as u64 <= limits().points, "{} Gaussians", set.len());
    let bounds = set.bounds();
    assert!(bounds.is_finite(), "bounds {bounds:?}");
    let survey = set.survey();
    assert!(survey.scales.iter().chain(&survey.opacities).all(|v| v.is_finite()), "{survey:?}");
    let seen = set.seen_from(Eye::At(bounds.center()));
    assert_eq!(seen.splats.len(), set.len());
    for splat in &seen.splats {
        let numbers = splat.center.iter().chain(&splat.factor).chain([&splat.strength]);
        assert!(numbers.copied().all(f32::is_finite), "{splat:?} is not finite");
    }
}

fn gaussians(name: &str, bytes: &[u8], reader: fn(&Source) -> Result<Gaussians>) {
    read(name, bytes, reader).iter().for_each(sound_gaussians);
}

/// What a caller may ask for: nothing, an array by name, an array of the cells, a missing value.
fn options() -> [ReadOptions; 4] {
    let missing = ReadOptions { missing: Some(1.0), ..ReadOptions::default() };
    let named = |name| ReadOptions::scalar(Some(name));
    [ReadOptions::default(), named("value"), named("cell:v:x"), missing]
}

fn samples(name: &str, bytes: &[u8], reader: fn(&Source, &ReadOptions) -> Result<Points>) {
    for options in options() {
        read(name, bytes, |source| reader(source, &options)).iter().for_each(sound_samples);
    }
}

fn volume(name: &str, bytes: &[u8], reader: fn(&Source, &ReadOptions) -> Result<Volume>) {
    for options in options() {
        read(name, bytes, |source| reader(source, &options)).iter().for_each(sound_volume);
    }
}

/// A stream counts at least as many points and triangles as a whole read returns.
fn stream(name: &str, bytes: &[u8], whole: Option<&Mesh>) {
    let limits = limits();
    let source = Source::from_bytes(Path::new(name), bytes, &limits).expect("small enough");
    let stream = accepted(Stream::of(source)).flatten();
    if let (Some(stream), Some(whole)) = (stream, whole) {
        assert!(whole.positions.len() as u64 <= stream.counts().points, "{:?}", stream.counts());
        assert!(
            whole.triangles.len() as u64 <= stream.counts().triangles
                || stream.counts().triangles == 0
        );
    }
}

pub fn ply(bytes: &[u8]) {
    let whole =
        mesh("input.ply", bytes, |source| formats::ply::read(source, &ReadOptions::default()));
    stream("input.ply", bytes, whole.as_ref());
    samples("input.ply", bytes, formats::read_samples);
    read("input.ply", bytes, formats::ply::holds_gaussians);
    gaussians("input.ply", bytes, formats::ply::read_gaussians);
}

pub fn splat(bytes: &[u8]) {
    gaussians("input.splat", bytes, formats::splat::read);
}

pub fn ksplat(bytes: &[u8]) {
    gaussians("input.ksplat", bytes, formats::ksplat::read);
}

pub fn spz(bytes: &[u8]) {
    formats::spz::is_spz(bytes);
    gaussians("input.spz", bytes, formats::spz::read);
}

/// A SOG archive or a `meta.json`. Lines `#webp` may separate the planes that it refers to:
/// `0.webp`, `1.webp` and so on. An archive has checksums; these planes have none.
pub fn sog(bytes: &[u8]) {
    const PLANE: &[u8] = b"\n#webp\n";
    let Some((meta, mut rest)) = cut(bytes, PLANE) else {
        assert!(!(formats::sog::is_sog(bytes) && formats::sog::is_meta(bytes)));
        gaussians("input.sog", bytes, formats::sog::read);
        return;
    };
    let folder = Folder::new();
    for number in 0.. {
        let (plane, behind) = cut(rest, PLANE).unwrap_or((rest, &[]));
        folder.write(&format!("{number}.webp"), plane);
        rest = behind;
        if rest.is_empty() {
            break;
        }
    }
    let path = folder.write("meta.json", meta);
    let limits = limits();
    accepted(Source::open(&path, &limits).and_then(|source| formats::sog::read(&source)))
        .iter()
        .for_each(sound_gaussians);
}

/// The index of a streamed scene. Lines `#sog` may separate the archives that it refers to:
/// `0.sog`, `1.sog` and so on.
pub fn sog_streamed(bytes: &[u8]) {
    const CHUNK: &[u8] = b"\n#sog\n";
    let (index, mut rest) = cut(bytes, CHUNK).unwrap_or((bytes, &[]));
    let folder = Folder::new();
    for number in 0..9 {
        let (chunk, behind) = cut(rest, CHUNK).unwrap_or((rest, &[]));
        folder.write(&format!("{number}.sog"), chunk);
        rest = behind;
        if rest.is_empty() {
            break;
        }
    }
    let path = folder.write("lod-meta.json", index);
    let limits = limits();
    accepted(Source::open(&path, &limits).and_then(|source| formats::sog::read(&source)))
        .iter()
        .for_each(sound_gaussians);
}

/// An OBJ file. A line `#mtl` may separate its materials, `input.mtl`, and a line `#png` after them
/// their picture, `input.png`.
pub fn obj(bytes: &[u8]) {
    let Some((model, rest)) = cut(bytes, b"\n#mtl\n") else {
        mesh("input.obj", bytes, formats::obj::read);
        return;
    };
    let (materials, picture) = cut(rest, b"\n#png\n").unwrap_or((rest, &[]));
    let others = [("input.mtl", materials), ("input.png", picture)];
    beside(("input.obj", model), &others, formats::obj::read).iter().for_each(sound_mesh);
}

/// Reads a file that refers to other files beside it.
fn beside<T>(
    (name, bytes): (&str, &[u8]),
    others: &[(&str, &[u8])],
    reader: fn(&Source) -> Result<T>,
) -> Option<T> {
    let folder = Folder::new();
    others.iter().for_each(|(name, bytes)| drop(folder.write(name, bytes)));
    let path = folder.write(name, bytes);
    let limits = limits();
    accepted(Source::open(&path, &limits).and_then(|source| reader(&source)))
}

fn cut<'a>(bytes: &'a [u8], mark: &[u8]) -> Option<(&'a [u8], &'a [u8])> {
    let at = bytes.windows(mark.len()).position(|window| window == mark)?;
    Some((&bytes[..at + 1], &bytes[at + mark.len()..]))
}

pub fn off(bytes: &[u8]) {
    mesh("input.off", bytes, formats::off::read);
}

pub fn stl(bytes: &[u8]) {
    mesh("input.stl", bytes, formats::stl::read);
}

/// A glTF file. A line `#bin` may separate its buffer, `input.bin`, and a line `#png` after it its
/// picture, `input.png`.
pub fn gltf(bytes: &[u8]) {
    let Some((model, rest)) = cut(bytes, b"\n#bin\n") else {
        mesh("input.glb", bytes, formats::gltf::read);
        read("input.glb", bytes, formats::gltf::holds_gaussians);
        gaussians("input.glb", bytes, formats::gltf::read_gaussians);
        return;
    };
    let (buffer, picture) = cut(rest, b"\n#png\n").unwrap_or((rest, &[]));
    let others = [("input.bin", buffer), ("input.png", picture)];
    let gltf = ("input.gltf", model);
    beside(gltf, &others, formats::gltf::read).iter().for_each(sound_mesh);
    beside(gltf, &others, formats::gltf::read_gaussians).iter().for_each(sound_gaussians);
}

pub fn las(bytes: &[u8]) {
    let whole = mesh("input.laz", bytes, formats::las::read);
    stream("input.laz", bytes, whole.as_ref());
}

pub fn e57(bytes: &[u8]) {
    mesh("input.e57", bytes, formats::e57::read);
}

/// An E57 file whose page checksums are corrected first.
pub fn e57_summed(bytes: &[u8]) {
    const PAGE: usize = 1024;
    let mut bytes = bytes.to_vec();
    for page in bytes.chunks_exact_mut(PAGE) {
        let sum = crc32c(&page[..PAGE - 4]);
        page[PAGE - 4..].copy_from_slice(&sum.to_be_bytes());
    }
    e57(&bytes);
}

/// The checksum of E57 pages: CRC-32 with Castagnoli's polynomial.
fn crc32c(bytes: &[u8]) -> u32 {
    let turn = |sum: u32| if sum & 1 == 1 { sum >> 1 ^ 0x82f6_3b78 } else { sum >> 1 };
    !bytes.iter().fold(!0, |sum, &byte| (0..8).fold(sum ^ u32::from(byte), |sum, _| turn(sum)))
}

pub fn xyz(bytes: &[u8]) {
    mesh("input.xyz", bytes, formats::xyz::read);
}

pub fn pcd(bytes: &[u8]) {
    mesh("input.pcd", bytes, formats::pcd::read);
}

pub fn csv(bytes: &[u8]) {
    samples("input.csv", bytes, formats::csv::read);
}

pub fn npy(bytes: &[u8]) {
    samples("input.npy", bytes, formats::npy::read);
    read("input.npy", bytes, formats::npy::read_cloud).iter().for_each(sound_mesh);
    volumes("input.npy", bytes, formats::npy::read_volume);
}

/// Reads a volume with several choices of its component and time.
fn volumes(name: &str, bytes: &[u8], reader: fn(&Source, &ReadOptions) -> Result<Volume>) {
    let second = ReadOptions { time: Some(1), ..ReadOptions::scalar(Some("value:1")) };
    for options in [ReadOptions::default(), second] {
        read(name, bytes, |source| reader(source, &options)).iter().for_each(sound_volume);
    }
}

/// Lists the arrays of a file, and reads the first three of them.
fn arrays(name: &str, bytes: &[u8]) {
    let list = read(name, bytes, |source| formats::arrays(source, &ReadOptions::default()));
    for array in list.unwrap_or_default().into_iter().take(3) {
        let options = ReadOptions { dataset: Some(array.name), ..ReadOptions::default() };
        let volume = read(name, bytes, |source| formats::read_volume(source, &options));
        volume.iter().for_each(sound_volume);
    }
}

pub fn npz(bytes: &[u8]) {
    volumes("input.npz", bytes, formats::npz::read);
    let cloud = |source: &Source| formats::npz::read_cloud(source, &ReadOptions::default());
    read("input.npz", bytes, cloud).iter().for_each(sound_mesh);
    arrays("input.npz", bytes);
}

/// A MetaImage file. A line `#data` may separate a file that it refers to, `0.raw`. It is also read
/// slice by slice.
pub fn mhd(bytes: &[u8]) {
    let Some((header, data)) = cut(bytes, b"\n#data\n") else {
        volumes("input.mha", bytes, formats::mhd::read);
        return;
    };
    let folder = Folder::new();
    folder.write("0.raw", data);
    slices(&folder.write("input.mhd", header));
}

pub fn mrc(bytes: &[u8]) {
    volumes("input.mrc", bytes, formats::mrc::read);
}

pub fn tiff(bytes: &[u8]) {
    volumes("input.tif", bytes, formats::tiff::read);
}

pub fn hdf5(bytes: &[u8]) {
    volumes("input.h5", bytes, formats::hdf5::read);
    arrays("input.h5", bytes);
    let options = ReadOptions::default();
    let cells = read("input.h5", bytes, |source| formats::hdf5::read_cells(source, &options));
    cells.iter().for_each(sound_cells);
    mesh("input.h5", bytes, |source| formats::hdf5::read_mesh(source, &ReadOptions::default()));
}

/// Reads a volume as a whole and slice by slice: both have the same samples.
fn slices(path: &Path) {
    let limits = limits();
    let whole = accepted(formats::load_volume(path, &limits, &ReadOptions::default()));
    whole.iter().for_each(sound_volume);
    let stream = accepted(VolumeStream::open(path, &limits, None)).flatten();
    if let (Some(whole), Some(stream)) = (whole, stream) {
        assert_eq!((stream.lattice(), stream.scalar()), (&whole.lattice, whole.samples.scalar()));
        let samples = stream.slices(0..whole.lattice.dims[2]).expect("what was read as a whole");
        // Holes are filled in what is read as a whole.
        assert!(
            whole.about.holes > 0 || samples.bytes() == whole.samples.bytes(),
            "the slices have other samples"
        );
    }
}

/// An NRRD file. Lines `#data` may separate the files that it refers to: `0.raw`, `1.raw` and so
/// on. With such files it is also read slice by slice.
pub fn nrrd(bytes: &[u8]) {
    let Some((header, mut rest)) = cut(bytes, DATA) else {
        volume("input.nrrd", bytes, formats::nrrd::read);
        return;
    };
    const DATA: &[u8] = b"\n#data\n";
    let mut others = Vec::new();
    while let Some((data, behind)) = cut(rest, DATA) {
        others.push(data);
        rest = behind;
    }
    others.push(rest);
    let folder = Folder::new();
    others
        .iter()
        .enumerate()
        .for_each(|(number, data)| drop(folder.write(&format!("{number}.raw"), data)));
    slices(&folder.write("input.nhdr", header));
}

/// A NIfTI file, or a pair: a line `#img` separates the header from the samples.
pub fn nifti(bytes: &[u8]) {
    let at = |time| ReadOptions { time, scalar: time.map(|_| ":1".into()), ..Default::default() };
    let Some((header, image)) = cut(bytes, b"\n#img\n") else {
        for options in [at(None), at(Some(1))] {
            let volume = read("input.nii", bytes, |source| formats::nifti::read(source, &options));
            volume.iter().for_each(sound_volume);
        }
        return;
    };
    let folder = Folder::new();
    folder.write("input.img", image);
    let path = folder.write("input.hdr", header);
    let volume = accepted(formats::load_volume(&path, &limits(), &ReadOptions::default()));
    volume.iter().for_each(sound_volume);
}

/// A DICOM file.
pub fn dicom(bytes: &[u8]) {
    for time in [None, Some(1)] {
        let options = ReadOptions { time, ..ReadOptions::default() };
        let volume = read("input.dcm", bytes, |source| formats::dicom::read(source, &options));
        volume.iter().for_each(sound_volume);
    }
}

/// A folder of DICOM files, which lines `#file` separate. The first may be a DICOMDIR.
pub fn dicom_folder(bytes: &[u8]) {
    let (folder, limits) = (Folder::new(), limits());
    let (mut rest, mut number) = (bytes, 0);
    while let Some((file, behind)) = cut(rest, b"\n#file\n").filter(|_| number < 16) {
        folder.write(&number.to_string(), file);
        (rest, number) = (behind, number + 1);
    }
    folder.write(&number.to_string(), rest);
    let first = folder.path("0");
    for path in [folder.as_ref(), &first] {
        let Some(source) = accepted(Source::open_any(path, &limits)) else { continue };
        accepted(formats::series(&source, &ReadOptions::default()));
        let volume = accepted(formats::read_volume(&source, &ReadOptions::default()));
        volume.iter().for_each(sound_volume);
    }
}

pub fn vti(bytes: &[u8]) {
    of_vtk("input.vti", bytes);
}

pub fn vtr(bytes: &[u8]) {
    of_vtk("input.vtr", bytes);
}

pub fn vtu(bytes: &[u8]) {
    of_vtk("input.vtu", bytes);
}

pub fn vtk(bytes: &[u8]) {
    of_vtk("input.vtk", bytes);
}

/// A file of VTK, read as every kind of data.
fn of_vtk(name: &str, bytes: &[u8]) {
    volume(name, bytes, formats::vtk::read_volume);
    samples(name, bytes, formats::vtk::read_samples);
    for options in options() {
        let mesh = read(name, bytes, |source| formats::vtk::read_mesh(source, &options));
        mesh.iter().for_each(sound_mesh);
        let cells = read(name, bytes, |source| formats::vtk::read_cells(source, &options));
        cells.iter().for_each(sound_cells);
        let list = read(name, bytes, |source| formats::vtk::arrays(source, &options));
        assert!(list.is_none_or(|list| list.iter().filter(|array| array.is_drawn).count() <= 1));
    }
}

/// A raw volume. Six bytes describe it (three sizes, type, spacing, bytes to skip); its samples
/// follow.
pub fn raw(bytes: &[u8]) {
    const TYPES: [SampleType; 6] = [
        SampleType::U8,
        SampleType::I16,
        SampleType::U16,
        SampleType::I32,
        SampleType::F32,
        SampleType::F64,
    ];
    let Some((&[nx, ny, nz, kind, spacing, header], bytes)) = bytes.split_first_chunk() else {
        return;
    };
    // The largest value stands for a size beyond all memory.
    let size = |n: u8| if n == 255 { usize::MAX >> 3 } else { usize::from(n) };
    let layout = RawLayout {
        dims: [nx, ny, nz].map(size),
        sample_type: TYPES[usize::from(kind >> 1) % TYPES.len()],
        spacing: DVec3::splat(f64::from(spacing as i8) / 16.0),
        endian: if kind & 1 == 1 { Endian::Big } else { Endian::Little },
        header: header.into(),
    };
    read("input.raw", bytes, |source| formats::raw::read(source, &layout, &ReadOptions::default()))
        .iter()
        .for_each(sound_volume);
}

/// A file whose name does not reveal its format.
pub fn any(bytes: &[u8]) {
    let kind = |scalar| {
        read("input", bytes, |source| Kind::of_source(source, &ReadOptions::scalar(scalar)))
            .flatten()
    };
    for kind in [kind(None), kind(Some("value"))] {
        match kind {
            Some(Kind::Mesh) => {
                read("input", bytes, |source| formats::read_mesh(source, &ReadOptions::default()))
                    .iter()
                    .for_each(sound_mesh);
            }
            Some(Kind::Volume) => volume("input", bytes, formats::read_volume),
            Some(Kind::Samples) => samples("input", bytes, formats::read_samples),
            Some(Kind::Cells) => {
                read("input", bytes, |source| formats::read_cells(source, &ReadOptions::default()))
                    .iter()
                    .for_each(sound_cells);
            }
            Some(Kind::Gaussians) => gaussians("input", bytes, |source| {
                formats::read_gaussians(source, &ReadOptions::default())
            }),
            Some(Kind::Hierarchy) => splk(bytes),
            Some(Kind::Bricks) => splv(bytes),
            None => drop(read("input", bytes, |source| Ok(formats::advice(source)))),
        }
    }
}

/// A PLY file, or otherwise a LAS or LAZ file, converted in regions. The conversion has as many
/// points as a whole read.
pub fn regions(bytes: &[u8]) {
    let folder = Folder::new();
    let path =
        folder.write(if bytes.starts_with(b"ply") { "input.ply" } else { "input.laz" }, bytes);
    let made = folder.path("made.splk");
    let limits = limits();
    let options = ExternalOptions {
        memory: 1,
        preset: Preset::default(),
        block_splats: 64,
        surfels: surfel_options(),
        paint: None,
        scalar: None,
        parts: None,
    };
    let whole = accepted(formats::load_mesh(&path, &limits, &ReadOptions::default()));
    let converted = accepted(external::convert(
        &[path],
        &limits,
        &made,
        &options,
        &WriteOptions::default(),
        None,
    ));
    let Some(converted) = converted else {
        return assert!(!made.exists(), "the conversion failed, but left a file");
    };
    if let Some(whole) = whole {
        assert_eq!(
            converted.points,
            whole.positions.len() as u64,
            "points in regions and as a whole"
        );
    }
    let hierarchy = Hierarchy::open(&made, &limits).expect("what was written");
    let report = hierarchy.check();
    assert!(report.is_sound(), "the file that was written: {:?}", report.findings);
    assert_eq!(hierarchy.leaves().expect("what was written").splats.len() as u64, converted.splats);
}

/// The bytes of a hierarchy as they are. Whatever opens can be read or yields an error, and
/// whatever `check` finds sound can be read.
pub fn splk(bytes: &[u8]) {
    let Some(hierarchy) =
        accepted(Hierarchy::from_bytes(bytes.to_vec(), Path::new("input.splk"), &limits()))
    else {
        return;
    };
    let is_sound = hierarchy.check().is_sound();
    let tree = accepted(hierarchy.read_tree());
    assert!(tree.is_some() >= is_sound, "a sound file cannot be read as a whole");
    for page in 0..hierarchy.page_count() {
        let nodes = accepted(hierarchy.read_page(page));
        assert!(nodes.is_some() >= is_sound, "page {page} of a sound file cannot be read");
        for node in nodes.iter().flat_map(|page| &page.nodes) {
            assert!(node.splat.center.iter().chain(&node.splat.factor).all(|v| v.is_finite()));
        }
    }
    if let Some(tree) = tree {
        let view = framing(hierarchy.bounds(), true).view([8, 8]);
        accepted(view.and_then(|view| tree.cut(&view, Default::default(), None)));
        if is_sound {
            let findings = validate(&tree);
            assert!(findings.is_empty(), "a sound file has a tree with {findings:?}");
        }
    }
}

/// Like [`splk`], with all checksums, the hash and the page offsets corrected first.
pub fn splk_summed(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    sum_hierarchy(&mut bytes);
    splk(&bytes);
}

/// The bytes of a bricked volume as they are.
pub fn splv(bytes: &[u8]) {
    let Some(bricks) = accepted(Bricks::from_bytes(bytes.to_vec(), Path::new("input.splv"))) else {
        return;
    };
    // A few bytes may describe many bricks of one value; reading more than these takes long.
    if bricks.levels().iter().map(|level| level.bricks()).sum::<usize>() > MOST_SAMPLES >> 15 {
        return;
    }
    let is_sound = bricks.check(None).is_sound();
    for (number, level) in bricks.levels().iter().enumerate() {
        for brick in 0..level.bricks() as u32 {
            let read = accepted(bricks.read(number, brick));
            assert!(read.is_some() >= is_sound, "a brick of a sound file cannot be read");
        }
        let volume = accepted(bricks.volume(number));
        assert!(volume.is_some() >= is_sound, "a level of a sound file cannot be read");
        if is_sound {
            volume.iter().for_each(sound_volume);
        }
    }
}

/// Like [`splv`], with all checksums, the hash and the lengths corrected first.
pub fn splv_summed(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    sum_bricks(&mut bytes);
    splv(&bytes);
}

/// A transfer function as JSON. It survives writing and reading, and returns valid numbers for all
/// values.
pub fn transfer(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let transfer = match TransferFunction::from_json(text) {
        Ok(transfer) => transfer,
        Err(message) => {
            return assert!(!message.to_string().is_empty(), "an error without a message");
        }
    };
    let again =
        TransferFunction::from_json(&transfer.to_json()).expect("what was written can be read");
    assert_eq!(again, transfer);
    let inside = |v: f64| (0.0..=1.0).contains(&v);
    let points = transfer.color.iter().map(|p| p.0).chain(transfer.opacity.iter().map(|p| p.0));
    for value in points.chain([0.0, 0.5, -1e30, 1e30, f64::MIN, f64::MAX]) {
        assert!(
            transfer.color(value).into_iter().all(inside),
            "colour {:?} at {value}",
            transfer.color(value)
        );
        assert!(inside(transfer.opacity(value)), "opacity {} at {value}", transfer.opacity(value));
        assert!(inside(transfer.gradient_factor(value.abs())), "factor at {value}");
        assert!(
            transfer.extinction(value) >= 0.0,
            "extinction {} at {value}",
            transfer.extinction(value)
        );
    }
    for range in [[-1.0, 1.0], [0.0, 1e30], [7.0, 7.0]] {
        let finite = |entry: &[f32; 4]| entry.iter().all(|v| !v.is_nan());
        assert!(transfer.table(range, 16).iter().all(finite), "a table over {range:?} holds NaN");
        transfer.visible(range);
        let spread = transfer.clone().spread_over(range);
        assert!(spread.validate().is_ok(), "spread over {range:?}: {:?}", spread.validate());
    }
}

/// A number as usual, or of a kind that programs get wrong: small, fine, of any magnitude, or any
/// bits.
#[derive(Debug, Arbitrary)]
enum Number {
    Small(i8),
    Fine(i16),
    Power(bool, u8),
    Bits(f32),
}

impl Number {
    fn value(&self) -> f32 {
        match *self {
            Self::Small(n) => f32::from(n),
            Self::Fine(n) => f32::from(n) / 256.0,
            Self::Power(negative, exponent) => {
                let size = 2f32.powi(i32::from(exponent) - 127);
                if negative { -size } else { size }
            }
            Self::Bits(value) => value,
        }
    }
}

/// A tiny model, and how it is drawn.
#[derive(Debug, Arbitrary)]
struct Model {
    points: Vec<[Number; 3]>,
    triangles: Vec<[u8; 3]>,
    has_normals: bool,
    colors: Option<[u8; 4]>,
    radius_scale: Option<Number>,
    is_lossless: bool,
    is_perspective: bool,
}

/// Options that make few surfels of a tiny model.
fn surfel_options() -> SurfelOptions {
    SurfelOptions { largest_spacing: 0.5, most_triangles: 256, ..SurfelOptions::default() }
}

/// Converts a tiny model to surfels and a hierarchy, writes and reads the file, and draws it on the
/// CPU.
pub fn convert_render(bytes: &[u8]) {
    const MOST: usize = 48;
    let Ok(model) = Model::arbitrary(&mut Unstructured::new(bytes)) else { return };
    let vector = |p: &[Number; 3]| Vec3::from_array(p.each_ref().map(Number::value));
    let positions: Vec<Vec3> = model.points.iter().take(MOST).map(vector).collect();
    let count = positions.len();
    if count == 0 {
        return;
    }
    let corner = |index: &u8| u32::from(*index) % count as u32;
    let mesh = Mesh {
        triangles: model.triangles.iter().take(MOST).map(|t| t.each_ref().map(corner)).collect(),
        normals: if model.has_normals { vec![Vec3::Z; count] } else { Vec::new() },
        colors: model.colors.map_or(Vec::new(), |color| vec![color; count]),
        positions,
        ..Mesh::default()
    };
    let usual = surfel_options();
    let radius_scale = model.radius_scale.map_or(usual.radius_scale, |scale| scale.value());
    let Some(set) = accepted(mesh.surfels(&SurfelOptions { radius_scale, ..usual })) else {
        return;
    };
    for splat in &set.splats {
        let numbers = splat.center.iter().chain(&splat.factor).chain([&splat.strength]);
        assert!(numbers.copied().all(f32::is_finite), "{splat:?} is not finite");
    }
    let options = BuildOptions { block_splats: 64, ..BuildOptions::default() };
    let Some(tree) = accepted(Tree::build(&set, &options, None)) else { return };
    let findings = validate(&tree);
    assert!(findings.is_empty(), "the tree that was built: {findings:?}");
    let options = WriteOptions { lossless: model.is_lossless, ..WriteOptions::default() };
    let Some(written) = accepted(to_bytes(&tree, &options)) else { return };
    let hierarchy = Hierarchy::from_bytes(written, Path::new("model.splk"), &limits())
        .expect("what was written");
    let report = hierarchy.check();
    assert!(report.is_sound(), "the file that was written: {:?}", report.findings);
    let camera = framing(hierarchy.bounds(), model.is_perspective);
    let scene = Scene::new().with_hierarchy(hierarchy);
    let settings = Settings::new([8, 8]);
    let Some(picture) = accepted(reference::render(&scene, &camera, &settings)) else { return };
    for (color, depth) in picture.color.iter().zip(&picture.depth) {
        assert!(color.iter().all(|v| (-1e-4..=1.0001).contains(v)), "the colour {color:?}");
        assert!(!depth.is_nan(), "a depth is not a number");
    }
}

/// A camera that frames a whole box.
fn framing(bounds: splatkit::math::Bounds, is_perspective: bool) -> Camera {
    let mut camera = Camera::framing(&bounds, DVec3::new(0.3, 0.2, -1.0), DVec3::Y, 1.0);
    if !is_perspective {
        camera.projection =
            Projection::Orthographic { height: bounds.diagonal().max(f64::MIN_POSITIVE) };
    }
    camera
}
