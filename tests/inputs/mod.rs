//! Small valid files of every format, and a summary in words of what reading each returns.

pub mod crafted;
pub mod medical;

use crate::testing::folder::Folder;
use glam::{Quat, Vec3};
use medical::{dicom, nifti};
use splatkit::{
    Error, Result, bricks,
    formats::{self, Endian, Kind, RawLayout, ReadOptions, SampleType},
    gaussians::Gaussians,
    hierarchy::{BuildOptions, Hierarchy, Tree, file},
    input::Limits,
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, Volume, phantoms::Phantom},
};
use std::{
    io::{Cursor, Write},
    path::Path,
};

impl Folder {
    /// Returns a summary of what reading the file returns, or the error without the path of the
    /// folder.
    pub fn outcome(&self, name: &str, limits: &Limits) -> String {
        match load(&self.path(name), limits) {
            Ok(summary) => summary,
            Err(error) => self.without_path(&error.to_string()),
        }
    }

    /// Returns a text without the path of the folder.
    pub fn without_path(&self, text: &str) -> String {
        text.replace(&format!("{}/", self.as_ref().display()), "")
    }
}

/// 4³ bytes without a header.
pub const RAW: RawLayout = RawLayout {
    dims: [4; 3],
    sample_type: SampleType::U8,
    spacing: glam::DVec3::ONE,
    endian: Endian::Little,
    header: 0,
};

fn of_volume(volume: &Volume) -> String {
    format!("volume {:?} {:?}", volume.lattice.dims, volume.range)
}

/// Reads a whole file by the reader that its name and content ask for.
pub fn load(path: &Path, limits: &Limits) -> Result<String> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    if extension == "json" {
        let transfer = TransferFunction::read(path, limits)?;
        return Ok(format!("transfer {} {}", transfer.color.len(), transfer.opacity.len()));
    }
    if extension == "png" {
        let comparison = splatkit::compare::compare_files(path, path, limits)?;
        return Ok(format!("compared, {} pixels differ", comparison.different_pixels));
    }
    let raw = ["raw", "gz"].contains(&extension).then_some(RAW);
    let kind =
        Kind::of(path, limits, &ReadOptions::default())?.or(raw.as_ref().map(|_| Kind::Volume));
    Ok(match kind {
        None => return Err(Error::input(path, "file", "is of no kind")),
        Some(Kind::Mesh) => {
            let mesh = formats::load_mesh(path, limits, &ReadOptions::default())?;
            let pictures =
                mesh.materials.iter().filter(|material| material.texture.is_some()).count();
            format!("mesh {} {} {pictures}", mesh.positions.len(), mesh.triangles.len())
        }
        Some(Kind::Volume) => {
            of_volume(&formats::load_volume(path, limits, &ReadOptions::raw(raw.as_ref()))?)
        }
        Some(Kind::Samples) => {
            format!(
                "samples {}",
                formats::load_samples(path, limits, &ReadOptions::default())?.len()
            )
        }
        Some(Kind::Cells) => {
            format!("cells {}", formats::load_cells(path, limits, &ReadOptions::default())?.len())
        }
        Some(Kind::Gaussians) => {
            let set = formats::load_gaussians(path, limits, &ReadOptions::default())?;
            format!("Gaussians {} of degree {}", set.len(), set.degree)
        }
        Some(Kind::Hierarchy) => {
            let tree = Hierarchy::open(path, limits)?.read_tree()?;
            format!("hierarchy {}", tree.leaf_count())
        }
        Some(Kind::Bricks) => of_volume(&bricks::Bricks::open(path, limits)?.volume(0)?),
    })
}

pub const FLOATS: &str = "property float x\nproperty float y\nproperty float z\n";

/// An ASCII PLY file with the given elements and rows.
pub fn ply(elements: &str, rows: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{elements}end_header\n{rows}").into_bytes()
}

/// A triangle as a binary PLY file.
fn binary_ply(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let header = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\n{FLOATS}element face 1\n\
         property list uchar int vertex_indices\nend_header\n"
    );
    let corners = [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let number = |n: f32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
    let index = |n: i32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
    let mut bytes = header.into_bytes();
    bytes.extend(corners.into_iter().flat_map(number));
    bytes.push(3);
    bytes.extend([0, 1, 2].into_iter().flat_map(index));
    bytes
}

pub fn png(width: u32, height: u32) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(width, height, image::Rgba([9, 99, 199, 255]))
        .write_to(&mut out, image::ImageFormat::Png)
        .expect("a picture");
    out.into_inner()
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(bytes).expect("bytes");
    packer.finish().expect("bytes")
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(bytes).expect("bytes");
    packer.finish().expect("bytes")
}

fn base64(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// A triangle as glTF with an embedded buffer.
pub fn gltf() -> String {
    gltf_with(
        &format!("data:application/octet-stream;base64,{}", base64(&triangle_bytes())),
        r#"{"mesh":0}"#,
    )
}

pub fn triangle_bytes() -> Vec<u8> {
    let corners = [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let indices = [0u16, 1, 2];
    corners
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .chain(indices.iter().flat_map(|v| v.to_le_bytes()))
        .collect()
}

/// The same with the buffer at `uri`, and with other nodes. Node 0 is the root of the scene.
pub fn gltf_with(uri: &str, nodes: &str) -> String {
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\
         \"nodes\":[{nodes}],\"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\
         \"indices\":1}}]}}],\"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":3,\
         \"type\":\"VEC3\"}},{{\"bufferView\":1,\"componentType\":5123,\"count\":3,\
         \"type\":\"SCALAR\"}}],\"bufferViews\":[{{\"buffer\":0,\"byteLength\":36}},{{\"buffer\":0,\
         \"byteOffset\":36,\"byteLength\":6}}],\"buffers\":[{{\"uri\":\"{uri}\",\
         \"byteLength\":42}}]}}"
    )
}

pub fn glb() -> Vec<u8> {
    let mut json = gltf().into_bytes();
    let uri = json.windows(7).position(|w| w == b"\"uri\":\"").expect("a URI");
    let end = uri + 7 + json[uri + 7..].iter().position(|&b| b == b'"').expect("its end");
    json.drain(uri..end + 2);
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = triangle_bytes();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |v: usize| (v as u32).to_le_bytes();
    let mut file = [b"glTF".as_slice(), &word(2), &word(28 + json.len() + binary.len())].concat();
    file.extend([word(json.len()).as_slice(), b"JSON", &json].concat());
    file.extend([word(binary.len()).as_slice(), b"BIN\0", &binary].concat());
    file
}

pub fn stl() -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(1u32.to_le_bytes());
    bytes.extend(
        [0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
            .iter()
            .flat_map(|v| v.to_le_bytes()),
    );
    bytes.extend([0, 0]);
    bytes
}

pub const OFF: &str = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

pub const STL_TEXT: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
     vertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

fn las_header(format: u8, start: usize, records: u32, points: u32) -> Vec<u8> {
    let mut header = vec![0; 227];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227u16.to_le_bytes());
    put(96, &(start as u32).to_le_bytes());
    put(100, &records.to_le_bytes());
    put(104, &[format]);
    put(105, &20u16.to_le_bytes());
    put(107, &points.to_le_bytes());
    (0..3).for_each(|axis| put(131 + 8 * axis, &0.01f64.to_le_bytes()));
    header
}

fn las_points() -> Vec<[u8; 20]> {
    let point = |i: i32| {
        let mut point = [0; 20];
        (0..3).for_each(|axis| {
            point[4 * axis..][..4].copy_from_slice(&(i * (axis as i32 + 1)).to_le_bytes());
        });
        point[14] = 0b1001;
        point
    };
    (0..5).map(point).collect()
}

pub fn las() -> Vec<u8> {
    [las_header(0, 227, 0, 5), las_points().concat()].concat()
}

pub fn laz() -> Vec<u8> {
    let items = laz::LazItemRecordBuilder::default_for_point_format_id(0, 0).expect("a format");
    let layout = laz::LazVlrBuilder::new(items).with_fixed_chunk_size(3).build();
    let mut described = Vec::new();
    layout.write_to(&mut described).expect("a record");
    let mut before = vec![0; 54];
    before[2..2 + laz::LazVlr::USER_ID.len()].copy_from_slice(laz::LazVlr::USER_ID.as_bytes());
    before[18..20].copy_from_slice(&laz::LazVlr::RECORD_ID.to_le_bytes());
    before[20..22].copy_from_slice(&(described.len() as u16).to_le_bytes());
    before.extend(described);
    let start = 227 + before.len();
    let mut file = Cursor::new([las_header(0x80, start, 1, 5), before].concat());
    file.set_position(start as u64);
    let mut packer = laz::LasZipCompressor::new(&mut file, layout).expect("a compressor");
    las_points().iter().for_each(|point| packer.compress_one(point).expect("a point"));
    packer.done().expect("an end");
    drop(packer);
    file.into_inner()
}

/// An E57 file of two points. `change` edits its XML.
pub fn e57(change: impl Fn(String) -> String) -> Vec<u8> {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file").expect("a writer");
    let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let double = RecordDataType::Double { min: None, max: None };
    let records = names.map(|name| Record { name, data_type: double.clone() });
    let mut scan = writer.add_pointcloud("scan", records.to_vec()).expect("a scan");
    for point in [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]] {
        scan.add_point(point.map(RecordValue::Double).to_vec()).expect("a point");
    }
    scan.finalize().expect("an end");
    writer.finalize_customized_xml(|xml| Ok(change(xml))).expect("an end");
    drop(writer);
    out.into_inner()
}

pub fn pcd(points: &str, data: &[u8]) -> Vec<u8> {
    [format!("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS {points}\n").as_bytes(), data].concat()
}

pub fn npy(shape: &str, values: &[f32]) -> Vec<u8> {
    let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut file = b"\x93NUMPY\x01\0".to_vec();
    file.extend((text.len() as u16).to_le_bytes());
    file.extend(text.bytes());
    file.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    file
}

pub fn nrrd(sizes: &str, fields: &str, data: &[u8]) -> Vec<u8> {
    [format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: {sizes}\n{fields}\n\n").as_bytes(), data]
        .concat()
}

/// A MetaImage file of bytes.
pub fn mha(sizes: &str, fields: &str, data: &[u8]) -> Vec<u8> {
    let header = format!(
        "NDims = 3\n{fields}DimSize = {sizes}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
    );
    [header.as_bytes(), data].concat()
}

/// An MRC map of signed bytes.
pub fn mrc(dims: [i32; 3], mode: i32, data: &[u8]) -> Vec<u8> {
    let mut map = vec![0; 1024];
    for (axis, size) in dims.into_iter().enumerate() {
        for (word, value) in [(axis, size), (7 + axis, size), (16 + axis, axis as i32 + 1)] {
            map[4 * word..][..4].copy_from_slice(&value.to_le_bytes());
        }
    }
    map[12..16].copy_from_slice(&mode.to_le_bytes());
    map[208..214].copy_from_slice(b"MAP \x44\x44");
    map.extend(data);
    map
}

/// An NPZ archive of two volumes.
pub fn npz() -> Vec<u8> {
    use zip::{ZipWriter, write::SimpleFileOptions};
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for name in ["a.npy", "b.npy"] {
        writer.start_file(name, SimpleFileOptions::default()).expect("a file");
        writer.write_all(&npy("(1, 2, 2)", &[1.0, 2.0, 3.0, 4.0])).expect("bytes");
    }
    writer.finish().expect("an archive").into_inner()
}

/// A TIFF file of this many pages of 2 × 1 pixels.
pub fn tiff(pages: u8) -> Vec<u8> {
    use tiff::encoder::{TiffEncoder, colortype::Gray8};
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).expect("a file");
    (0..pages).for_each(|page| encoder.write_image::<Gray8>(2, 1, &[page, 9]).expect("a page"));
    file.into_inner()
}

/// An HDF5 file of one data set.
pub fn hdf5(shape: &[u64]) -> Vec<u8> {
    let mut file = hdf5_pure::FileBuilder::new();
    let data: Vec<u8> = (0..shape.iter().product::<u64>() as u8).collect();
    file.create_dataset("v").with_u8_data(&data).with_shape(shape);
    file.finish().expect("a file")
}

/// An XML file of VTK: `kind` around `pieces`.
pub fn vtk_xml(kind: &str, attributes: &str, pieces: &str) -> String {
    format!(
        "<?xml version='1.0'?><VTKFile type='{kind}' byte_order='LittleEndian'{attributes}><{kind} \
         WholeExtent='0 1 0 1 0 0'>{pieces}</{kind}></VTKFile>"
    )
}

pub fn vti_piece(array: &str) -> String {
    format!("<Piece Extent='0 1 0 1 0 0'><PointData Scalars='v'>{array}</PointData></Piece>")
}

pub fn array(attributes: &str, content: &str) -> String {
    format!("<DataArray type='UInt8' Name='v' {attributes}>{content}</DataArray>")
}

/// Four bytes compressed by zlib as one block, preceded by its sizes.
fn packed_block() -> Vec<u8> {
    let packed = zlib(&[1, 2, 3, 4]);
    let mut bytes: Vec<u8> =
        [1, 4, 0, packed.len() as u32].iter().flat_map(|n| n.to_le_bytes()).collect();
    bytes.extend(packed);
    bytes
}

fn appended(xml: &str, encoding: &str, data: &[u8]) -> Vec<u8> {
    let (before, _) = xml.split_once("</VTKFile>").expect("an end");
    let open = format!("{before}<AppendedData encoding='{encoding}'>_");
    [open.as_bytes(), data, b"</AppendedData></VTKFile>"].concat()
}

pub fn vtk() -> String {
    "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 1\n\
     ORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 4\nSCALARS v unsigned_char 1\nLOOKUP_TABLE default\n\
     1 2 3 4\n"
        .into()
}

pub fn vtu(corners: &str) -> String {
    let numbers = |name: &str, kind: &str, text: &str, components: u32| {
        format!(
            "<DataArray type='{kind}' Name='{name}' NumberOfComponents='{components}' \
             format='ascii'>{text}</DataArray>"
        )
    };
    vtk_xml(
        "UnstructuredGrid",
        "",
        &format!(
            "<Piece NumberOfPoints='3' NumberOfCells='1'><CellData>{}</CellData><Points>{}</Points>\
             <Cells>{}{}{}</Cells></Piece>",
            numbers("v", "Float32", "7", 1),
            numbers("p", "Float32", "0 0 0 1 0 0 0 1 0", 3),
            numbers("connectivity", "Int32", corners, 1),
            numbers("offsets", "Int32", "3", 1),
            numbers("types", "UInt8", "5", 1)
        ),
    )
}

pub fn tree() -> Tree {
    let positions = (0..9).map(|i| Vec3::new((i % 3) as f32, (i / 3) as f32, 0.0)).collect();
    let mesh = Mesh { positions, ..Mesh::default() };
    let splats = mesh.surfels(&SurfelOptions::default()).expect("surfels");
    Tree::build(&splats, &BuildOptions::default(), None).expect("a tree")
}

pub fn splk(lossless: bool) -> Vec<u8> {
    let options =
        file::WriteOptions { lossless, unit: "m".into(), ..file::WriteOptions::default() };
    file::to_bytes(&tree(), &options).expect("bytes")
}

/// Bricks of several levels; some bricks hold a single value.
pub fn splv(folder: &Folder) -> Vec<u8> {
    let volume = Phantom::Specimen.sample_bytes([34, 5, 3]).expect("a volume");
    let path = folder.path("made.splv");
    let options = bricks::WriteOptions { unit: "mm".into(), ..bricks::WriteOptions::default() };
    bricks::write(&volume, &path, &options, None).expect("a file");
    let bytes = std::fs::read(&path).expect("bytes");
    std::fs::remove_file(&path).ok();
    bytes
}

/// Two trained Gaussians with colours of degree 1.
pub fn trained() -> Gaussians {
    Gaussians {
        centers: vec![Vec3::ZERO, Vec3::new(1.0, -2.0, 0.5)],
        scales: vec![Vec3::splat(0.1), Vec3::new(0.2, 0.1, 0.4)],
        rotations: vec![Quat::IDENTITY, Quat::from_rotation_x(1.0)],
        opacities: vec![0.9, 0.4],
        degree: 1,
        harmonics: (0..8).map(|term| [0.1, -0.2, 0.05 * term as f32]).collect(),
        ..Gaussians::default()
    }
}

/// Returns the bytes that `write` writes to a path.
pub fn written(write: impl Fn(&Path) -> Result<()>) -> Vec<u8> {
    let folder = Folder::new();
    let path = folder.path("written");
    write(&path).expect("a file");
    std::fs::read(&path).expect("bytes")
}

/// The `.ksplat` file of two Gaussians of degree 0, without compression.
pub fn ksplat() -> Vec<u8> {
    let mut bytes = vec![0; 4096 + 1024];
    bytes[1] = 1;
    for (at, count) in [(4, 1), (8, 1), (12, 2), (16, 2), (4096, 2), (4100, 2)] {
        bytes[at] = count;
    }
    for x in [0.0f32, 1.0] {
        let numbers = [x, 0.0, 0.0, 0.1, 0.1, 0.1, 1.0, 0.0, 0.0, 0.0].map(f32::to_le_bytes);
        bytes.extend(numbers.as_flattened());
        bytes.extend([255, 128, 0, 200]);
    }
    bytes
}

/// A SOG archive of two Gaussians.
pub fn sog() -> Vec<u8> {
    use image_webp::{ColorType, WebPEncoder};
    use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};
    let meta = r#"{"version": 2, "count": 2, "means": {"mins": [0, -1, 0], "maxs": [1, 0, 1],
        "files": ["l.webp", "u.webp"]}, "scales": {"codebook": [-2, -1, 0], "files": ["s.webp"]},
        "quats": {"files": ["q.webp"]}, "sh0": {"codebook": [-1, 0, 1], "files": ["c.webp"]}}"#;
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    writer.start_file("meta.json", stored).expect("a file");
    writer.write_all(meta.as_bytes()).expect("bytes");
    for (name, texels) in [
        ("l.webp", [[16, 239, 7, 255], [0, 255, 7, 255]]),
        ("u.webp", [[39, 216, 0, 255], [0, 255, 0, 255]]),
        ("s.webp", [[0, 1, 2, 255], [2, 2, 0, 255]]),
        ("q.webp", [[51, 204, 153, 252], [51, 204, 153, 254]]),
        ("c.webp", [[0, 1, 2, 51], [2, 0, 0, 255]]),
    ] {
        let mut plane = Vec::new();
        let encoder = WebPEncoder::new(&mut plane);
        encoder.encode(texels.as_flattened(), 2, 1, ColorType::Rgba8).expect("a picture");
        writer.start_file(name, stored).expect("a file");
        writer.write_all(&plane).expect("bytes");
    }
    writer.finish().expect("an archive").into_inner()
}

pub const TRANSFER: &str = r#"{"color": [[0, 1, 1, 1]], "opacity": [[0, 0], [9, 0.5]]}"#;
pub const OBJ: &str =
    "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
pub const MTL: &str = "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd a.png\n";

/// A file name, its bytes, and whether the file may load if it is cut before a given byte.
pub type Format = (&'static str, Vec<u8>, fn(&[u8], usize) -> bool);

fn never(_: &[u8], _: usize) -> bool {
    false
}

fn anywhere(_: &[u8], _: usize) -> bool {
    true
}

fn but_for_spaces(bytes: &[u8], at: usize) -> bool {
    bytes[at..].iter().all(u8::is_ascii_whitespace)
}

/// The last number may be cut to a shorter number.
fn last_number(bytes: &[u8], at: usize) -> bool {
    bytes[at..].trim_ascii_end().iter().all(|&b| b.is_ascii_digit() || b == b'.')
}

/// A file of every format: its name, its bytes, and whether it may load if it is cut before byte
/// `at`. Text without counts or an end mark reads as fewer values if it is cut. All other readers
/// must notice, unless only the last line break is lost.
pub fn every_format(folder: &Folder) -> Vec<Format> {
    folder.write("beside.bin", triangle_bytes());
    folder.write("beside.raw", [1, 2, 3, 4]);
    folder.write("a.mtl", MTL);
    folder.write("a.png", png(2, 2));
    let mut formats = formats_of_meshes();
    formats.extend(formats_of_gaussians());
    formats.extend(formats_of_points());
    formats.extend(formats_of_volumes());
    formats.extend(formats_of_vtk());
    formats.extend(formats_of_splatkit(folder));
    formats
}

/// Hierarchies, bricks and transfer functions.
fn formats_of_splatkit(folder: &Folder) -> Vec<Format> {
    let of_gaussians = written(|path| {
        let (build, write) = (BuildOptions::default(), file::WriteOptions::default());
        splatkit::hierarchy::build_gaussians(&trained(), path, &build, &write, None)
    });
    vec![
        ("trained.splk", of_gaussians, never),
        ("lossless.splk", splk(true), never),
        ("lossy.splk", splk(false), never),
        ("a.splv", splv(folder), never),
        ("a.json", TRANSFER.into(), never),
    ]
}

/// The corners of a triangle, as text.
const TRIANGLE: &str = "0 0 0\n1 0 0\n0 1 0\n";

fn formats_of_meshes() -> Vec<Format> {
    let face = format!(
        "element vertex 3\n{FLOATS}element face 1\nproperty list uchar int vertex_indices\n"
    );
    vec![
        ("ascii.ply", ply(&face, &format!("{TRIANGLE}3 0 1 2\n")), last_number),
        ("little.ply", binary_ply(false), never),
        ("big.ply", binary_ply(true), never),
        ("a.obj", OBJ.into(), |bytes, at| {
            bytes[..at].ends_with(b"\n") || bytes[..at].windows(2).any(|w| w == b"f ")
        }),
        ("binary.stl", stl(), never),
        // Behind its last facet, a file may lack its end. A warning says so.
        ("text.stl", STL_TEXT.into(), |bytes, at| bytes[..at].windows(8).any(|w| w == b"endfacet")),
        ("a.off", OFF.into(), |bytes, at| at >= bytes.len() - 1),
        ("a.gltf", gltf().into(), never),
        ("beside.gltf", gltf_with("beside.bin", r#"{"mesh":0}"#).into(), never),
        ("a.glb", glb(), never),
    ]
}

fn formats_of_gaussians() -> Vec<Format> {
    let set = trained();
    let packed = written(|path| formats::ply::write_compressed_gaussians(&set, path));
    vec![
        ("trained.ply", written(|path| formats::ply::write_gaussians(&set, path)), never),
        ("packed.ply", packed, never),
        ("trained.glb", written(|path| formats::gltf::write_gaussians(&set, path)), never),
        // A record has 32 bytes.
        ("a.splat", written(|path| formats::splat::write(&set, path)), |_, at| at == 32),
        ("a.ksplat", ksplat(), never),
        ("a.spz", written(|path| formats::spz::write(&set, path)), never),
        ("a.sog", sog(), never),
    ]
}

fn formats_of_points() -> Vec<Format> {
    let floats: Vec<u8> =
        [1f32, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    // LZF: 24 literal bytes. Fields are stored one after the other.
    let lzf = [&[23u8][..], &floats].concat();
    let packed = [&(lzf.len() as u32).to_le_bytes()[..], &24u32.to_le_bytes(), &lzf].concat();
    vec![
        ("a.las", las(), never),
        ("a.laz", laz(), never),
        ("a.e57", e57(|xml| xml), never),
        ("a.xyz", TRIANGLE.into(), anywhere),
        ("a.pts", format!("3\n{TRIANGLE}").into(), last_number),
        ("a.csv", "x,y,z,value\n1,2,3,4\n5,6,7,85\n".into(), anywhere),
        ("ascii.pcd", pcd("2", b"DATA ascii\n1 2 3\n4 5 6\n"), last_number),
        ("binary.pcd", pcd("2", &[b"DATA binary\n", &floats[..]].concat()), never),
        ("packed.pcd", pcd("2", &[b"DATA binary_compressed\n", &packed[..]].concat()), never),
        ("a.npy", npy("(1, 4)", &[1.0, 2.0, 3.0, 4.0]), never),
    ]
}

fn formats_of_volumes() -> Vec<Format> {
    let raw: Vec<u8> = (0..64).collect();
    vec![
        ("raw.nrrd", nrrd("4 4 4", "encoding: raw", &raw), never),
        ("a.mha", mha("2 1 2", "", &[1, 2, 3, 4]), never),
        ("a.mrc", mrc([2, 1, 2], 0, &[1, 2, 3, 4]), never),
        ("volume.npy", npy("(1, 1, 2)", &[1.0, 2.0]), never),
        ("a.npz", npz(), never),
        ("a.tif", tiff(2), never),
        ("a.h5", hdf5(&[1, 2, 2]), anywhere),
        ("gzip.nrrd", nrrd("4 4 4", "encoding: gzip", &gzip(&raw)), never),
        ("ascii.nrrd", nrrd("2 2 1", "encoding: ascii", b"1 2 3 44\n"), last_number),
        ("hex.nrrd", nrrd("2 2 1", "encoding: hex", b"01020304\n"), but_for_spaces),
        // The name of the data file may be cut to one that does not exist; the empty line is not
        // needed.
        (
            "detached.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: beside.raw", b""),
            but_for_spaces,
        ),
        ("a.nii", nifti(|_| {}), never),
        ("a.nii.gz", gzip(&nifti(|_| {})), never),
        ("a.dcm", dicom(".1", &[1, 2, 3, 4]), never),
        ("a.raw", raw.clone(), never),
        ("a.gz", gzip(&raw), never),
    ]
}

fn formats_of_vtk() -> Vec<Format> {
    let of_vti =
        |attributes: &str, array: &str| vtk_xml("ImageData", attributes, &vti_piece(array));
    let mut counted = 4u32.to_le_bytes().to_vec();
    counted.extend([1, 2, 3, 4]);
    let zlib_file = " compressor='vtkZLibDataCompressor'";
    let places = |axis: &str| {
        format!("<DataArray type='Float32' Name='x' format='ascii'>{axis}</DataArray>")
    };
    let vtr_piece = format!(
        "<Piece Extent='0 1 0 1 0 0'><PointData Scalars='v'>{}</PointData><Coordinates>\
         {}{}{}</Coordinates></Piece>",
        array("format='ascii'", "1 2 3 4"),
        places("0 1"),
        places("0 2"),
        places("0")
    );
    vec![
        ("ascii.vti", of_vti("", &array("format='ascii'", "1 2 3 4")).into(), never),
        ("binary.vti", of_vti("", &array("format='binary'", &base64(&counted))).into(), never),
        (
            "zlib.vti",
            of_vti(
                zlib_file,
                &array("format='binary'", &{
                    let block = packed_block();
                    format!("{}{}", base64(&block[..16]), base64(&block[16..]))
                }),
            )
            .into(),
            never,
        ),
        (
            "appended.vti",
            appended(&of_vti("", &array("format='appended' offset='0'", "")), "raw", &counted),
            never,
        ),
        (
            "packed.vti",
            appended(
                &of_vti(zlib_file, &array("format='appended' offset='0'", "")),
                "raw",
                &packed_block(),
            ),
            never,
        ),
        ("a.vtr", vtk_xml("RectilinearGrid", "", &vtr_piece).into(), never),
        ("a.vtu", vtu("0 1 2").into(), never),
        ("a.vtk", vtk().into(), last_number),
    ]
}
