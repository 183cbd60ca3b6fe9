//! The table of formats. `Kind`, the loading functions, the streams and the messages that list
//! extensions all follow from it.
//!
//! A new format is a module with its reader, and a row here (docs/files.md). If its reader needs
//! much code or a crate of its own, it belongs to a cargo feature. Without the feature the row has
//! no readers. It is still found, so that the error can name the feature.

#[cfg(feature = "dicom")]
use super::dicom;
#[cfg(feature = "e57")]
use super::e57;
#[cfg(feature = "gltf")]
use super::gltf;
#[cfg(feature = "hdf5")]
use super::hdf5;
#[cfg(feature = "las")]
use super::las;
#[cfg(feature = "npz")]
use super::npz;
#[cfg(feature = "obj")]
use super::obj;
#[cfg(feature = "ply")]
use super::ply;
#[cfg(feature = "sog")]
use super::sog;
#[cfg(feature = "tiff")]
use super::tiff;
#[cfg(feature = "vtk")]
use super::vtk;
#[cfg(feature = "zarr")]
use super::zarr;
use super::{
    Kind, csv,
    format::{Content, Format, Holding, InPieces, Magic, VolumeReader, Which},
    ksplat, mhd, mrc, nifti, npy, nrrd, off, pcd, picture, raw, splat, spz, stl, xyz,
};

/// Every format, in the order of messages: surfaces, volumes, scattered samples.
pub static FORMATS: &[Format] = &[
    Format {
        name: "splatkit hierarchy",
        extensions: &["splk"],
        holds: &[all(Content::Hierarchy)],
        written: Some("splk"),
        magic: Magic::Prefix(b"SPLK"),
        kind: Which::Always(Kind::Hierarchy),
        pieces: InPieces::Opened,
        ..Format::ROW
    },
    Format {
        name: "PLY",
        extensions: &["ply"],
        holds: &[
            some(Content::Mesh, "with faces"),
            some(Content::PointCloud, "without faces"),
            some(Content::Samples, "without faces, if a scalar is named"),
            some(Content::Gaussians, "as trainers write them, also compressed"),
        ],
        written: Some("ply"),
        feature: Some("ply"),
        magic: Magic::Rule(|bytes| bytes.trim_ascii_start().starts_with(b"ply")),
        #[cfg(feature = "ply")]
        kind: Which::Rule(|source, options| {
            let named = options.scalar.is_some();
            Ok(match named {
                false if ply::holds_gaussians(source)? => Kind::Gaussians,
                true if !ply::has_faces(source)? => Kind::Samples,
                _ => Kind::Mesh,
            })
        }),
        #[cfg(feature = "ply")]
        mesh: Some(ply::read),
        #[cfg(feature = "ply")]
        arrays: Some(ply::arrays),
        #[cfg(feature = "ply")]
        samples: Some(ply::read_samples),
        #[cfg(feature = "ply")]
        gaussians: Some(|source, _| ply::read_gaussians(source)),
        #[cfg(feature = "ply")]
        pieces: InPieces::Points {
            of: "binary files",
            find: |source| Ok(ply::Pieces::find(source)?.map(|pieces| Box::new(pieces) as _)),
            in_parts: false,
        },
        ..Format::ROW
    },
    Format {
        name: "SPLAT",
        extensions: &["splat"],
        holds: &[all(Content::Gaussians)],
        written: Some("splat"),
        kind: Which::Always(Kind::Gaussians),
        gaussians: Some(|source, _| splat::read(source)),
        ..Format::ROW
    },
    Format {
        name: "KSPLAT",
        extensions: &["ksplat"],
        holds: &[all(Content::Gaussians)],
        kind: Which::Always(Kind::Gaussians),
        gaussians: Some(|source, _| ksplat::read(source)),
        ..Format::ROW
    },
    Format {
        name: "SPZ",
        extensions: &["spz"],
        holds: &[all(Content::Gaussians)],
        written: Some("spz"),
        magic: Magic::Rule(spz::is_spz),
        kind: Which::Always(Kind::Gaussians),
        gaussians: Some(|source, _| spz::read(source)),
        ..Format::ROW
    },
    Format {
        name: "SOG",
        extensions: &["sog"],
        holds: &[all(Content::Gaussians)],
        written: Some("sog"),
        refers: true,
        feature: Some("sog"),
        #[cfg(feature = "sog")]
        magic: Magic::Rule(|bytes| sog::is_sog(bytes) || sog::is_meta(bytes)),
        kind: Which::Always(Kind::Gaussians),
        #[cfg(feature = "sog")]
        gaussians: Some(|source, _| sog::read(source)),
        ..Format::ROW
    },
    Format {
        name: "OBJ",
        extensions: &["obj"],
        holds: &WITH_OR_WITHOUT_FACES,
        refers: true,
        feature: Some("obj"),
        kind: Which::Always(Kind::Mesh),
        #[cfg(feature = "obj")]
        mesh: Some(|source, _| obj::read(source)),
        ..Format::ROW
    },
    Format {
        name: "glTF",
        extensions: &["gltf", "glb"],
        holds: &[
            some(Content::Mesh, "with faces"),
            some(Content::PointCloud, "without faces"),
            some(Content::Gaussians, "with KHR_gaussian_splatting"),
        ],
        written: Some("glb"),
        refers: true,
        feature: Some("gltf"),
        magic: Magic::Rule(|bytes| {
            let text = bytes.trim_ascii_start();
            text.starts_with(b"glTF") || text.starts_with(b"{")
        }),
        #[cfg(feature = "gltf")]
        kind: Which::Rule(|source, _| {
            Ok(if gltf::holds_gaussians(source)? { Kind::Gaussians } else { Kind::Mesh })
        }),
        #[cfg(feature = "gltf")]
        mesh: Some(|source, _| gltf::read(source)),
        #[cfg(feature = "gltf")]
        gaussians: Some(|source, _| gltf::read_gaussians(source)),
        ..Format::ROW
    },
    Format {
        name: "STL",
        extensions: &["stl"],
        holds: &[all(Content::Mesh)],
        // Binary files begin with any 80 bytes.
        magic: Magic::Prefix(b"solid "),
        kind: Which::Always(Kind::Mesh),
        mesh: Some(|source, _| stl::read(source)),
        ..Format::ROW
    },
    Format {
        name: "OFF",
        extensions: &["off", "coff", "noff"],
        holds: &WITH_OR_WITHOUT_FACES,
        magic: Magic::Rule(off::is_off),
        kind: Which::Always(Kind::Mesh),
        mesh: Some(|source, _| off::read(source)),
        ..Format::ROW
    },
    Format {
        name: "LAS",
        extensions: &["las", "laz"],
        holds: &[all(Content::PointCloud)],
        written: Some("las"),
        feature: Some("las"),
        magic: Magic::Prefix(b"LASF"),
        kind: Which::Always(Kind::Mesh),
        #[cfg(feature = "las")]
        mesh: Some(|source, options| las::read_named(source, options.scalar.as_deref())),
        #[cfg(feature = "las")]
        pieces: InPieces::Points {
            of: "",
            find: |source| Ok(las::Pieces::find(source)?.map(|pieces| Box::new(pieces) as _)),
            in_parts: true,
        },
        ..Format::ROW
    },
    Format {
        name: "E57",
        extensions: &["e57"],
        holds: &[all(Content::PointCloud)],
        written: Some("e57"),
        feature: Some("e57"),
        magic: Magic::Prefix(b"ASTM-E57"),
        kind: Which::Always(Kind::Mesh),
        #[cfg(feature = "e57")]
        mesh: Some(|source, options| e57::read_named(source, options.scalar.as_deref())),
        ..Format::ROW
    },
    Format {
        name: "PCD",
        extensions: &["pcd"],
        holds: &[all(Content::PointCloud)],
        magic: Magic::Prefix(b"# .PCD"),
        kind: Which::Always(Kind::Mesh),
        mesh: Some(|source, options| pcd::read_named(source, options.scalar.as_deref())),
        ..Format::ROW
    },
    Format {
        name: "table of points",
        extensions: &["xyz", "pts", "asc"],
        holds: &[all(Content::PointCloud), some(Content::Samples, "if a scalar is named")],
        kind: Which::Rule(|_, options| {
            Ok(if options.scalar.is_some() { Kind::Samples } else { Kind::Mesh })
        }),
        mesh: Some(|source, options| xyz::read_named(source, options.scalar.as_deref())),
        samples: Some(csv::read),
        arrays: Some(csv::arrays),
        ..Format::ROW
    },
    Format {
        name: "VTP",
        extensions: &["vtp"],
        holds: &[
            some(Content::Mesh, "with faces"),
            some(Content::PointCloud, "without faces"),
            some(Content::Samples, "without faces, if a scalar is named"),
        ],
        magic: Magic::Rule(|bytes| is_vtk_xml(bytes) && has_word(bytes, b"PolyData")),
        cells: None,
        volume: None,
        ..VTK
    },
    Format {
        name: "VTU",
        extensions: &["vtu"],
        holds: &VTK_CELLS,
        magic: Magic::Rule(|bytes| is_vtk_xml(bytes) && has_word(bytes, b"UnstructuredGrid")),
        volume: None,
        ..VTK
    },
    Format {
        name: "VTS",
        extensions: &["vts"],
        holds: &VTK_CELLS,
        magic: Magic::Rule(|bytes| is_vtk_xml(bytes) && has_word(bytes, b"StructuredGrid")),
        volume: None,
        ..VTK
    },
    Format {
        name: "VTR",
        extensions: &["vtr"],
        holds: &[all(Content::Volume)],
        magic: Magic::Rule(|bytes| is_vtk_xml(bytes) && has_word(bytes, b"RectilinearGrid")),
        kind: Which::Always(Kind::Volume),
        mesh: None,
        cells: None,
        samples: None,
        ..VTK
    },
    Format {
        name: "VTI",
        extensions: &["vti"],
        holds: &[all(Content::Volume)],
        magic: Magic::Rule(|bytes| is_vtk_xml(bytes) && has_word(bytes, b"ImageData")),
        kind: Which::Always(Kind::Volume),
        mesh: None,
        cells: None,
        samples: None,
        ..VTK
    },
    Format {
        name: "VTK",
        extensions: &["vtk"],
        holds: &VTK_ANY,
        magic: Magic::Prefix(b"# vtk DataFile"),
        ..VTK
    },
    Format {
        name: "VTK in several files",
        extensions: &["pvti", "pvtr", "pvts", "pvtu", "pvtp", "vtm", "vtpc", "vtpd", "pvd"],
        holds: &VTK_ANY,
        refers: true,
        // Comes after the rows of single data sets, because these begin like that too.
        magic: Magic::Rule(is_vtk_xml),
        ..VTK
    },
    Format {
        name: "PNG, JPEG",
        extensions: &["png", "jpg", "jpeg"],
        holds: &[some(Content::Volume, "of one slice")],
        magic: Magic::Rule(picture::is_picture),
        kind: Which::Always(Kind::Volume),
        volume: Some(VolumeReader::Plain(picture::read)),
        ..Format::ROW
    },
    Format {
        name: "NRRD",
        extensions: &["nrrd", "nhdr"],
        holds: &[all(Content::Volume)],
        written: Some("nrrd"),
        refers: true,
        magic: Magic::Prefix(b"NRRD"),
        kind: Which::Always(Kind::Volume),
        volume: Some(VolumeReader::Plain(nrrd::read)),
        pieces: InPieces::Volume { of: "files of raw encoding", find: nrrd::plain },
        ..Format::ROW
    },
    Format {
        name: "NIfTI",
        extensions: &["nii", "nii.gz", "hdr", "hdr.gz", "img", "img.gz"],
        holds: &[all(Content::Volume)],
        refers: true,
        magic: Magic::Rule(nifti::is_nifti),
        kind: Which::Always(Kind::Volume),
        volume: Some(VolumeReader::Plain(nifti::read)),
        ..Format::ROW
    },
    Format {
        name: "DICOM",
        extensions: &["dcm", "dicom", "ima"],
        holds: &[all(Content::Volume)],
        refers: true,
        feature: Some("dicom"),
        #[cfg(feature = "dicom")]
        magic: Magic::Rule(dicom::is_dicom),
        #[cfg(not(feature = "dicom"))]
        magic: Magic::Rule(|bytes| bytes.get(128..132) == Some(b"DICM")),
        #[cfg(feature = "dicom")]
        folder: Some(dicom::is_folder),
        kind: Which::Always(Kind::Volume),
        #[cfg(feature = "dicom")]
        volume: Some(VolumeReader::Plain(dicom::read)),
        #[cfg(feature = "dicom")]
        series: Some(dicom::series),
        ..Format::ROW
    },
    Format {
        name: "MetaImage",
        extensions: &["mha", "mhd"],
        holds: &[all(Content::Volume)],
        refers: true,
        magic: Magic::Rule(mhd::is_header),
        kind: Which::Always(Kind::Volume),
        volume: Some(VolumeReader::Plain(mhd::read)),
        pieces: InPieces::Volume { of: "one file, not compressed", find: mhd::plain },
        ..Format::ROW
    },
    Format {
        name: "MRC, CCP4",
        extensions: &["mrc", "map", "ccp4", "rec", "st", "mrcs"],
        holds: &[all(Content::Volume)],
        magic: Magic::Rule(mrc::is_map),
        kind: Which::Always(Kind::Volume),
        volume: Some(VolumeReader::Plain(mrc::read)),
        pieces: InPieces::Volume { of: "files of real numbers", find: mrc::plain },
        ..Format::ROW
    },
    Format {
        name: "TIFF",
        extensions: &["tif", "tiff", "btf", "tf8"],
        holds: &[some(Content::Volume, "pages as slices")],
        feature: Some("tiff"),
        magic: Magic::Rule(|bytes| {
            matches!(
                bytes.first_chunk(),
                Some(b"II\x2a\0" | b"MM\0\x2a" | b"II\x2b\0" | b"MM\0\x2b")
            )
        }),
        kind: Which::Always(Kind::Volume),
        #[cfg(feature = "tiff")]
        folder: Some(tiff::is_folder),
        #[cfg(feature = "tiff")]
        volume: Some(VolumeReader::Plain(tiff::read)),
        ..Format::ROW
    },
    Format {
        name: "HDF5, NetCDF-4, VTKHDF",
        extensions: &["h5", "hdf5", "hdf", "he5", "nc4", "ims", "vtkhdf"],
        holds: &[
            some(
                Content::Volume,
                "data sets of three dimensions, or pictures of two, image data of VTKHDF",
            ),
            some(Content::Cells, "unstructured grids of VTKHDF"),
            some(Content::Mesh, "surfaces of VTKHDF"),
        ],
        feature: Some("hdf5"),
        // A block of the user's may stand before the signature, as in MATLAB's files.
        magic: Magic::Rule(|bytes| {
            [0, 512, 1024, 2048]
                .iter()
                .any(|&at| bytes.get(at..at + 8) == Some(b"\x89HDF\r\n\x1a\n"))
        }),
        #[cfg(feature = "hdf5")]
        kind: Which::Rule(|source, _| hdf5::kind(source)),
        #[cfg(feature = "hdf5")]
        mesh: Some(hdf5::read_mesh),
        #[cfg(feature = "hdf5")]
        cells: Some(hdf5::read_cells),
        #[cfg(feature = "hdf5")]
        volume: Some(VolumeReader::Plain(hdf5::read)),
        #[cfg(feature = "hdf5")]
        arrays: Some(hdf5::arrays),
        ..Format::ROW
    },
    Format {
        name: "OME-Zarr",
        extensions: &["zarr", "zarr.zip", "ozx"],
        holds: &[
            some(Content::Volume, "images and arrays of two axes or three"),
            some(Content::Bricks, "large images in levels"),
        ],
        refers: true,
        feature: Some("zarr"),
        folder: Some(|source| Ok(source.is_store())),
        #[cfg(feature = "zarr")]
        kind: Which::Rule(zarr::kind),
        #[cfg(feature = "zarr")]
        volume: Some(VolumeReader::Plain(zarr::read)),
        pieces: InPieces::Opened,
        #[cfg(feature = "zarr")]
        arrays: Some(zarr::arrays),
        ..Format::ROW
    },
    Format {
        name: "raw",
        holds: &[some(Content::Volume, "if its layout is given")],
        kind: Which::Always(Kind::Volume),
        volume: Some(VolumeReader::Described(raw::read)),
        pieces: InPieces::Described { of: "files without gzip", find: raw::plain },
        ..Format::ROW
    },
    Format {
        name: "splatkit bricks",
        extensions: &["splv"],
        holds: &[all(Content::Bricks)],
        written: Some("splv"),
        magic: Magic::Prefix(b"SPLV"),
        kind: Which::Always(Kind::Bricks),
        pieces: InPieces::Opened,
        ..Format::ROW
    },
    Format {
        name: "NPY",
        extensions: &["npy"],
        holds: &[
            some(Content::Volume, "of three axes, or a picture of two"),
            some(Content::PointCloud, "of three columns"),
            some(Content::Samples, "of 4, 5 or 10 columns"),
        ],
        magic: Magic::Prefix(b"\x93NUMPY"),
        kind: Which::Rule(|source, _| npy::kind(source)),
        mesh: Some(|source, _| npy::read_cloud(source)),
        volume: Some(VolumeReader::Plain(npy::read_volume)),
        samples: Some(npy::read),
        pieces: InPieces::Volume { of: "volumes", find: npy::plain },
        ..Format::ROW
    },
    Format {
        name: "NPZ",
        extensions: &["npz"],
        holds: &[
            some(Content::Volume, "with an array of three axes"),
            some(Content::PointCloud, "with an array of positions"),
        ],
        feature: Some("npz"),
        #[cfg(feature = "npz")]
        kind: Which::Rule(npz::kind),
        #[cfg(feature = "npz")]
        mesh: Some(npz::read_cloud),
        #[cfg(feature = "npz")]
        volume: Some(VolumeReader::Plain(npz::read)),
        #[cfg(feature = "npz")]
        arrays: Some(npz::arrays),
        ..Format::ROW
    },
    Format {
        name: "table",
        extensions: &["csv", "txt"],
        holds: &[
            some(Content::PointCloud, "with the columns of a point cloud"),
            some(Content::Samples, "with other columns, or if a scalar is named"),
        ],
        kind: Which::Rule(|source, options| {
            let is_cloud = options.scalar.is_none() && xyz::is_cloud(source);
            Ok(if is_cloud { Kind::Mesh } else { Kind::Samples })
        }),
        mesh: Some(|source, options| xyz::read_named(source, options.scalar.as_deref())),
        samples: Some(csv::read),
        arrays: Some(csv::arrays),
        ..Format::ROW
    },
    Format {
        name: "table of samples",
        extensions: &["xyzv"],
        holds: &[all(Content::Samples)],
        kind: Which::Always(Kind::Samples),
        samples: Some(csv::read),
        arrays: Some(csv::arrays),
        ..Format::ROW
    },
];

const WITH_OR_WITHOUT_FACES: [Holding; 2] =
    [some(Content::Mesh, "with faces"), some(Content::PointCloud, "without faces")];

const fn all(content: Content) -> Holding {
    Holding { content, when: "" }
}

const fn some(content: Content, when: &'static str) -> Holding {
    Holding { content, when }
}

/// What all rows of VTK's files have in common.
const VTK: Format = Format {
    feature: Some("vtk"),
    #[cfg(feature = "vtk")]
    kind: Which::Rule(vtk::kind),
    #[cfg(feature = "vtk")]
    mesh: Some(vtk::read_mesh),
    #[cfg(feature = "vtk")]
    volume: Some(VolumeReader::Plain(vtk::read_volume)),
    #[cfg(feature = "vtk")]
    cells: Some(vtk::read_cells),
    #[cfg(feature = "vtk")]
    samples: Some(vtk::read_samples),
    #[cfg(feature = "vtk")]
    arrays: Some(vtk::arrays),
    ..Format::ROW
};

const VTK_CELLS: [Holding; 4] = [
    some(Content::Cells, "that fill space"),
    some(Content::Mesh, "cells that are surfaces or lines"),
    some(Content::PointCloud, "without cells"),
    some(Content::Samples, "without cells, if a scalar is named"),
];

const VTK_ANY: [Holding; 5] = [
    some(Content::Volume, "image data, rectilinear grids"),
    some(Content::Cells, "that fill space"),
    some(Content::Mesh, "polygons and lines"),
    some(Content::PointCloud, "without cells"),
    some(Content::Samples, "without cells, if a scalar is named"),
];

fn is_vtk_xml(bytes: &[u8]) -> bool {
    has_word(bytes, b"<VTKFile")
}

/// Returns whether a word is among the first 1024 bytes.
fn has_word(bytes: &[u8], word: &[u8]) -> bool {
    bytes[..bytes.len().min(1024)].windows(word.len()).any(|part| part == word)
}
