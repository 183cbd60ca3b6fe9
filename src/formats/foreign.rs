//! Files that are not read: which kind they are, and what to do with them.
//!
//! [`advice`] looks at the first bytes of a file, its name and its size. It is asked only after no
//! format of the table was found, or if the format's reader does not read this kind of content.

mod layout;

use crate::input::{Source, copy};
use flate2::read::MultiGzDecoder;
use std::{io::Read, path::Path};

/// What is known of a file that is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advice {
    /// What the file is, after “is” (“a Blender scene”).
    pub what: String,
    /// What the user can do.
    pub hint: String,
}

/// How a kind of file is recognised, and what to do with it.
struct Foreign {
    /// Extensions in lower case.
    extensions: &'static [&'static str],
    /// The first bytes; none if the extension alone decides.
    magic: &'static [&'static [u8]],
    what: &'static str,
    /// What to do; if packages of Python read the file, what else.
    hint: &'static str,
    /// The packages of Python that read such files, as `python -m pysplatkit` uses them. Its module
    /// `_foreign` has the same files.
    python: &'static [&'static str],
}

impl Foreign {
    const ROW: Self = Self { extensions: &[], magic: &[], what: "", hint: "", python: &[] };
}

/// Bytes of a file that are looked at.
const LOOKED_AT: usize = 1 << 12;

const FOREIGN: &[Foreign] = &[
    Foreign {
        extensions: &["vdb"],
        magic: &[b" BDV"],
        what: "an OpenVDB grid",
        hint: "write it as a dense volume in Python: grid.copyToArray of pyopenvdb, then \
               numpy.save('volume.npy', array)",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["nvdb"],
        magic: &[b"NanoVDB"],
        what: "a NanoVDB grid",
        hint: "turn it into OpenVDB with nanovdb_convert, then write it in Python with pyopenvdb \
               and numpy.save",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["zarr", "zgroup", "zarray"],
        what: "a part of a Zarr store",
        hint: "write one level in Python: numpy.save('volume.npy', zarr.open('FOLDER')['0'][:])",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["step", "stp"],
        magic: &[b"ISO-10303-21"],
        what: "a STEP model of a CAD program",
        hint: "or convert it with gmsh MODEL.step -2 -format stl -o model.stl",
        python: &["trimesh", "cascadio"],
    },
    Foreign {
        extensions: &["iges", "igs"],
        what: "an IGES model of a CAD program",
        hint: "convert with gmsh MODEL.igs -2 -format stl -o model.stl, or export STL or OBJ from \
               FreeCAD",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["brep", "brp"],
        magic: &[b"DBRep_DrawableShape", b"CASCADE Topology"],
        what: "a model of Open CASCADE",
        hint: "convert with gmsh MODEL.brep -2 -format stl -o model.stl",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["x_t", "x_b", "sldprt", "sldasm", "ipt", "iam", "catpart", "3dm", "prt"],
        magic: &[b"3D Geometry File Format"],
        what: "a model of a CAD program",
        hint: "export it from that program as STL, OBJ or glTF",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["dwg", "dxf"],
        magic: &[b"AC10"],
        what: "an AutoCAD drawing",
        hint: "export its surfaces as STL from the CAD program, or convert it in FreeCAD",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["fbx"],
        magic: &[b"Kaydara FBX Binary"],
        what: "an FBX scene",
        hint: "convert with assimp export SCENE.fbx scene.glb, or export glTF from Blender",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["blend"],
        magic: &[b"BLENDER"],
        what: "a Blender scene",
        hint: "open it in Blender and export glTF or PLY",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["3mf"],
        what: "a 3MF model for printers",
        python: &["trimesh", "networkx", "lxml"],
        hint: "or convert it with assimp export MODEL.3mf model.stl",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["amf"],
        what: "an AMF model for printers",
        hint: "convert with assimp export MODEL.amf model.stl",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["usd", "usda", "usdc", "usdz"],
        magic: &[b"PXR-USDC", b"#usda"],
        what: "a USD scene",
        hint: "open it in Blender and export glTF or PLY",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["drc"],
        magic: &[b"DRACO"],
        what: "a mesh compressed by Draco",
        hint: "convert with draco_decoder -i MESH.drc -o mesh.ply",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["dae", "zae"],
        what: "a Collada scene",
        python: &["trimesh", "pycollada"],
        hint: "or convert it with assimp export SCENE.dae scene.glb",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["x3d", "x3dv", "wrl", "vrml"],
        magic: &[b"#VRML", b"#X3D"],
        what: "a VRML or X3D scene",
        hint: "convert with meshlabserver -i SCENE.wrl -o scene.ply, or assimp export",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["3ds", "lwo", "ac", "max", "ma", "mb", "c4d"],
        what: "a scene of a modelling program",
        hint: "export glTF, OBJ or PLY from that program, or open it in Blender and export glTF",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &[
            "msh", "mesh", "meshb", "med", "inp", "avs", "bdf", "fem", "nas", "su2", "f3grid",
            "mdpa",
        ],
        magic: &[b"$MeshFormat", b"MeshVersionFormatted"],
        what: "a mesh of a solver",
        python: &["meshio"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["unv", "mphtxt"],
        what: "a mesh of a solver",
        hint: "save it from that program as VTU, or as MSH of Gmsh",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["cgns"],
        what: "a CGNS mesh",
        python: &["pyvista", "meshio"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["e", "exo", "ex2", "g", "gen"],
        what: "an Exodus mesh",
        python: &["pyvista", "meshio"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["ksplat", "lcc"],
        what: "a packed scene of trained 3D Gaussians",
        hint: "convert with npx @playcanvas/splat-transform SCENE.ksplat scene.ply",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["rcp", "rcs", "ptx", "fls", "zfs"],
        what: "a point cloud of a scanner's own program",
        hint: "export it as E57 or LAS, from that program or from CloudCompare",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &[],
        magic: &[b"CCB2"],
        what: "a project of CloudCompare",
        hint: "open it in CloudCompare and save it as PLY, LAS or E57",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["nc", "cdf", "nc3"],
        magic: &[b"CDF\x01", b"CDF\x02", b"CDF\x05"],
        what: "a NetCDF 3 file",
        python: &["xarray", "scipy"],
        hint: "or convert it with nccopy -k nc4 IN.nc OUT.nc",
    },
    Foreign {
        extensions: &["mat"],
        magic: &[b"MATLAB 5.0 MAT-file", b"MATLAB 4.0"],
        what: "a MATLAB file of version 4 to 7",
        hint: "save it in MATLAB with save(FILE, '-v7.3'), and name the array with --dataset; or \
               use scipy.io.loadmat and numpy.save in Python",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["grib", "grb", "grib2", "grb2"],
        magic: &[b"GRIB"],
        what: "a GRIB file of weather data",
        hint: "convert with cdo -f nc4 copy IN.grib OUT.nc",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["fits", "fit", "fts"],
        magic: &[b"SIMPLE  ="],
        what: "a FITS file of astronomy",
        hint: "write it in Python: numpy.save('cube.npy', astropy.io.fits.getdata('CUBE.fits'))",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["am", "amiramesh"],
        magic: &[b"# AmiraMesh", b"# Avizo"],
        what: "an Amira or Avizo file",
        hint: "save it from Amira as NRRD or as a TIFF stack, or convert it with Fiji (AmiraMesh \
               reader)",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["czi"],
        magic: &[b"ZISRAWFILE"],
        what: "a Zeiss microscope's file",
        hint: "convert with bfconvert IN.czi OUT.ome.tif (Bio-Formats)",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["lif", "lof", "xlef"],
        what: "a Leica microscope's file",
        hint: "convert with bfconvert -series 0 IN.lif OUT.ome.tif (Bio-Formats)",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["nd2"],
        magic: &[b"\xda\xce\xbe\x0a"],
        what: "a Nikon microscope's file",
        hint: "convert with bfconvert IN.nd2 OUT.ome.tif (Bio-Formats)",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["oib", "oif", "oir", "vsi", "lsm", "dv", "stk", "svs", "ndpi", "scn", "klb"],
        what: "a microscope's file",
        hint: "convert with bfconvert IN OUT.ome.tif (Bio-Formats)",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["txm", "txrm", "vgl", "vgi", "rek", "isq", "aim", "bkr"],
        what: "a file of a CT scanner's own program",
        hint: "export a TIFF stack or a raw volume from that program; raw volumes are read with \
               --dims and --type",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["pvm"],
        magic: &[b"PVM", b"DDS v3"],
        what: "a volume of the V³ library",
        hint: "convert with pvm2raw of the V³ tools, then give --dims and --type",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["mgh", "mgz"],
        what: "a FreeSurfer volume",
        python: &["nibabel"],
        hint: "or convert it with mri_convert IN.mgz OUT.nii.gz",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["pial", "white", "inflated", "sphere", "smoothwm"],
        magic: &[b"\xff\xff\xfe"],
        what: "a FreeSurfer surface",
        python: &["nibabel"],
        ..Foreign::ROW
    },
    Foreign { extensions: &["gii"], what: "a GIFTI surface", python: &["nibabel"], ..Foreign::ROW },
    Foreign { extensions: &["mz3"], what: "a surface of Surfice", python: &[], ..Foreign::ROW },
    Foreign { extensions: &["pdb", "ent"], what: "a molecule", python: &[], ..Foreign::ROW },
    Foreign {
        extensions: &["tec"],
        magic: &[b"TITLE", b"VARIABLES", b"#!TDV"],
        what: "data of Tecplot",
        python: &["pyvista", "meshio"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["slc"],
        what: "a volume of VolVis",
        python: &["pyvista"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["mnc"],
        what: "a MINC volume",
        python: &["nibabel"],
        hint: "or convert it with mnc2nii IN.mnc OUT.nii",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["png", "jpg", "jpeg", "bmp", "gif", "webp", "tga", "exr", "jp2"],
        magic: &[b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"GIF8", b"BM", b"v/1\x01", b"#?RADIANCE"],
        what: "a picture",
        hint: "pictures are not drawn; slices of a volume are read from one TIFF file of several \
               pages, or from a folder of TIFF files (ImageMagick: convert *.png stack.tif)",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["pdf"],
        magic: &[b"%PDF"],
        what: "a document",
        hint: "documents are not drawn",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["mp4", "avi", "mov", "mkv", "webm"],
        magic: &[b"\x1aE\xdf\xa3"],
        what: "a film",
        hint: "films are not drawn; ffmpeg -i IN.mp4 f%04d.tif writes its pictures as slices",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["7z", "rar", "tar", "tgz", "xz", "bz2", "zst", "lz4"],
        magic: &[
            b"7z\xbc\xaf\x27\x1c",
            b"Rar!",
            b"\xfd7zXZ\0",
            b"BZh",
            b"\x28\xb5\x2f\xfd",
            b"\x04\x22\x4d\x18",
        ],
        what: "a compressed archive",
        hint: "unpack it, and name the file inside",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["zip"],
        magic: &[b"PK\x03\x04"],
        what: "a ZIP archive",
        hint: "unpack it, and name the file inside",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["xlsx", "xls", "ods", "parquet", "feather", "pkl", "pickle", "rds"],
        magic: &[b"PAR1"],
        what: "a table of another program",
        hint: "export it as CSV with the columns x, y, z and value",
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["case", "encas"],
        magic: &[b"FORMAT\ntype:"],
        what: "an EnSight case",
        python: &["pyvista"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["foam"],
        what: "an OpenFOAM case",
        python: &["pyvista"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["xdmf", "xmf"],
        what: "an XDMF file",
        python: &["pyvista", "meshio"],
        ..Foreign::ROW
    },
    Foreign {
        extensions: &["pvsm"],
        what: "a state of ParaView",
        hint: "name one of the files that it shows, or save the data from ParaView as VTU",
        ..Foreign::ROW
    },
];

/// Says which kind a file is, and what to do; `None` for files of which nothing is known.
pub fn advice(source: &Source) -> Option<Advice> {
    if let Some(advice) = layout::advice(source) {
        return Some(advice);
    }
    let bytes = &source.bytes()[..source.bytes().len().min(LOOKED_AT)];
    // The name first: scenes and tables of some programs are archives.
    let found = by_extension(source.path).or_else(|| by_magic(bytes));
    let found = found.map(|foreign| Advice::of(foreign, source.path));
    found.or_else(|| gzip(source)).or_else(|| layout::raw(source))
}

/// Returns the error for a mesh of a solver, by the name of the file; `None` for other names. Its
/// content may be in a format that is read, as HDF5 is.
#[cfg(feature = "hdf5")]
pub(super) fn mesh_by_name(source: &Source) -> Option<crate::Error> {
    let mesh = by_extension(source.path).filter(|foreign| foreign.python.contains(&"meshio"))?;
    let advice = Advice::of(mesh, source.path);
    let message = format!("is {}, which is not read", advice.what);
    Some(source.error("file", message).hint(advice.hint))
}

/// Says which kind a folder is, and what to do; `None` for folders of which nothing is known.
pub fn folder_advice(folder: &Path) -> Option<Advice> {
    let has = |name: &str| folder.join(name).exists();
    let is_zarr = [".zgroup", ".zarray", ".zattrs", "zarr.json"].iter().any(|name| has(name));
    is_zarr.then(|| Advice {
        what: "a Zarr store".into(),
        hint: "write one level in Python: numpy.save('volume.npy', zarr.open('FOLDER')['0'][:])"
            .into(),
    })
}

impl Advice {
    fn of(foreign: &Foreign, path: &Path) -> Self {
        let is_drawn = foreign.hint.is_empty() || !foreign.python.is_empty();
        if !is_drawn {
            return Self { what: foreign.what.into(), hint: foreign.hint.into() };
        }
        // What needs no other package is read by the module itself.
        let packages: Vec<&str> = ["pysplatkit"].iter().chain(foreign.python).copied().collect();
        let mut hint = format!(
            "python -m pysplatkit render {} -o out.png draws it (pip install {})",
            path.display(),
            packages.join(" ")
        );
        if !foreign.hint.is_empty() {
            hint = format!("{hint}; {}", foreign.hint);
        }
        Self { what: foreign.what.into(), hint }
    }
}

fn by_magic(bytes: &[u8]) -> Option<&'static Foreign> {
    let begins = |foreign: &&Foreign| foreign.magic.iter().any(|magic| bytes.starts_with(magic));
    // Two letters are too few: a bitmap also has zeros where they are reserved.
    let is_bitmap = || bytes.get(6..10) == Some(&[0; 4]);
    FOREIGN.iter().find(begins).filter(|_| !bytes.starts_with(b"BM") || is_bitmap())
}

fn by_extension(path: &Path) -> Option<&'static Foreign> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    FOREIGN.iter().find(|foreign| foreign.extensions.contains(&extension.as_str()))
}

/// Says what is inside a gzip stream.
fn gzip(source: &Source) -> Option<Advice> {
    let bytes = source.bytes();
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return None;
    }
    let mut head = Vec::new();
    let mut stream = MultiGzDecoder::new(bytes).take(LOOKED_AT as u64);
    // A stream that is cut off shows its beginning.
    stream.read_to_end(&mut head).ok();
    let name = source.path.file_stem().unwrap_or_default();
    let inside = Path::new(name);
    let known = super::Format::of_path(inside).map(|format| format.name);
    let foreign = by_extension(inside).or_else(|| by_magic(&head)).map(|found| found.what);
    let shown = inside.display();
    let what = match known.or(foreign) {
        Some(inner) => format!("packed by gzip, with a file of {inner} inside"),
        None => "packed by gzip".into(),
    };
    let hint = format!(
        "unpack it with gunzip -k {}, and name {shown}; raw samples may stay packed, with --dims \
         and --type",
        source.path.display()
    );
    Some(Advice { what, hint })
}

/// Returns the first bytes of a file as text.
fn head(source: &Source) -> String {
    let bytes = source.bytes();
    copy::lossy(&bytes[..bytes.len().min(LOOKED_AT)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use std::collections::HashSet;

    pub fn asked(name: &str, bytes: &[u8]) -> Option<Advice> {
        let limits = Limits::default();
        advice(&Source::from_bytes(Path::new(name), bytes, &limits).unwrap())
    }

    #[test]
    fn every_row_is_found_by_its_name_and_its_bytes() {
        let mut names = HashSet::new();
        for foreign in FOREIGN {
            assert!(!foreign.hint.ends_with('.'), "{}", foreign.what);
            for extension in foreign.extensions {
                assert!(names.insert(extension), "{extension} stands in two rows");
                let found = asked(&format!("a.{extension}"), b"?");
                let found = found.unwrap();
                assert_eq!(found.what, foreign.what, "{extension}");
                assert!(!found.hint.is_empty(), "{extension}");
            }
            for magic in foreign.magic {
                let bytes = [magic, &[0u8; 32][..]].concat();
                let found = asked("a.unknown", &bytes).map(|advice| advice.what);
                assert_eq!(found.as_deref(), Some(foreign.what), "{magic:?}");
            }
        }
        assert_eq!(asked("a.unknown", b"BM is no bitmap"), None);
        assert_eq!(asked("a.unknown", b""), None);
    }

    #[test]
    fn what_python_reads_is_drawn_by_one_line() {
        let hint = |name: &str| asked(name, b"?").unwrap().hint;
        let line = "python -m pysplatkit render a.e -o out.png draws it (pip install pysplatkit \
                    pyvista meshio)";
        assert_eq!(hint("a.e"), line);
        assert!(hint("lh.pial").ends_with("(pip install pysplatkit nibabel)"));
        assert!(hint("a.mz3").ends_with("(pip install pysplatkit)"));
        assert!(hint("a.mgz").contains("; or convert it with mri_convert IN.mgz"));
        assert!(!hint("a.vdb").contains("python -m"));
    }

    #[test]
    fn no_row_is_of_a_format_that_is_read() {
        for foreign in FOREIGN {
            for extension in foreign.extensions {
                let format = super::super::Format::of_path(format!("a.{extension}"));
                assert!(format.is_none(), "{extension}");
            }
        }
    }

    #[test]
    fn folders_of_zarr_are_known() {
        let folder = crate::input::testing::Folder::new();
        assert_eq!(folder_advice(folder.as_ref()), None);
        folder.write("zarr.json", "{}");
        assert_eq!(folder_advice(folder.as_ref()).unwrap().what, "a Zarr store");
    }

    #[test]
    fn gzip_says_what_is_inside() {
        use flate2::{Compression, write::GzEncoder};
        use std::io::Write;
        let packed = |bytes: &[u8]| {
            let mut packer = GzEncoder::new(Vec::new(), Compression::default());
            packer.write_all(bytes).unwrap();
            packer.finish().unwrap()
        };
        for (name, bytes, what) in [
            ("a.ply.gz", &b"ply\n"[..], "packed by gzip, with a file of PLY inside"),
            ("a.gz", b"GRIB", "packed by gzip, with a file of a GRIB file of weather data inside"),
            ("a.gz", b"?", "packed by gzip"),
        ] {
            let advice = asked(name, &packed(bytes)).unwrap();
            assert_eq!(advice.what, what);
            assert!(advice.hint.contains("gunzip -k a."), "{}", advice.hint);
        }
    }
}
