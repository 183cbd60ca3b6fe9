//! Writes the seed inputs of every fuzz target to the given folder. They are small files of each
//! format, made by the library's own writers, by the writers of the formats' crates, or as text.
//! With them a fuzzer need not guess headers.

#[path = "../../../tests/regressions/flat.rs"]
mod flat;
#[path = "../../../tests/testing/grid.rs"]
mod grid;
#[path = "../../../tests/inputs/medical.rs"]
mod inputs;

use flate2::{Compression, write::GzEncoder};
use glam::{DVec3, Quat, Vec2, Vec3};
use image_webp::{ColorType, WebPEncoder};
use splatkit::{
    bricks, formats,
    gaussians::{Gaussians, harmonics::terms},
    hierarchy::{
        BuildOptions, Tree,
        file::{WriteOptions, to_bytes},
    },
    surface::Mesh,
    volume::{Lattice, Samples, Volume},
};
use std::{
    error::Error,
    fs,
    io::{Cursor, Write},
    path::{Path, PathBuf},
};
use tiff::{
    encoder::{Compression as Compress, TiffEncoder, colortype},
    tags::Tag,
};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err("name the folder to write the inputs to".into());
    };
    let mut seeds = Seeds { folder, count: 0 };
    ply(&mut seeds)?;
    gaussians(&mut seeds)?;
    spz(&mut seeds)?;
    ksplat(&mut seeds)?;
    sog(&mut seeds)?;
    sog_streamed(&mut seeds)?;
    obj(&mut seeds)?;
    stl(&mut seeds)?;
    off(&mut seeds)?;
    gltf(&mut seeds)?;
    las(&mut seeds)?;
    e57(&mut seeds)?;
    tables(&mut seeds)?;
    pcd(&mut seeds)?;
    npy(&mut seeds)?;
    volumes(&mut seeds)?;
    medical(&mut seeds)?;
    of_laboratories(&mut seeds)?;
    vti(&mut seeds)?;
    vtr_vtu(&mut seeds)?;
    vtk(&mut seeds)?;
    hierarchies(&mut seeds)?;
    in_bricks(&mut seeds)?;
    transfer(&mut seeds)?;
    models(&mut seeds)?;
    println!("{} inputs in {}", seeds.count, seeds.folder.display());
    Ok(())
}

/// The output folder, with a subfolder for each target.
struct Seeds {
    folder: PathBuf,
    count: usize,
}

impl Seeds {
    fn put(&mut self, target: &str, bytes: impl AsRef<[u8]>) -> Result<()> {
        let folder = self.folder.join(target);
        fs::create_dir_all(&folder)?;
        self.count += 1;
        fs::write(folder.join(format!("seed-{}", self.count)), bytes)?;
        Ok(())
    }

    /// Like [`put`](Self::put), and also adds the input to `any`, the target of files without a
    /// name. PLY and LAS files go to `regions` as well.
    fn known(&mut self, target: &str, bytes: impl AsRef<[u8]>) -> Result<()> {
        self.put("any", &bytes)?;
        if matches!(target, "ply" | "las") {
            self.put("regions", &bytes)?;
        }
        self.put(target, bytes)
    }

    /// Returns the bytes that `write` writes to a temporary path.
    fn written<E: Error + 'static>(
        &self,
        write: impl FnOnce(&Path) -> std::result::Result<(), E>,
    ) -> Result<Vec<u8>> {
        fs::create_dir_all(&self.folder)?;
        let path = self.folder.join("written.nrrd.ply.splv");
        write(&path)?;
        let bytes = fs::read(&path)?;
        fs::remove_file(&path)?;
        Ok(bytes)
    }
}

/// A tetrahedron with every attribute that a mesh can have.
fn tetrahedron() -> Mesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    Mesh {
        normals: vec![-Vec3::ONE.normalize(), Vec3::X, Vec3::Y, Vec3::Z],
        colors: vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [9, 9, 9, 128]],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        positions,
        ..Mesh::default()
    }
}

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

fn ply(seeds: &mut Seeds) -> Result<()> {
    let plain = seeds.written(|path| formats::ply::write(&tetrahedron(), path))?;
    seeds.known("ply", plain)?;
    let cloud = Mesh { triangles: Vec::new(), uvs: Vec::new(), ..tetrahedron() };
    let cloud = seeds.written(|path| formats::ply::write(&cloud, path))?;
    seeds.known("ply", cloud)?;
    let set = tetrahedron().surfels(&Default::default())?;
    let few = splatkit::splat::Surfels { splats: set.splats[..3].to_vec(), ..set };
    let few = Gaussians::from_splats(&few)?;
    let gaussians = seeds.written(|path| formats::ply::write_gaussians(&few, path))?;
    seeds.known("ply", gaussians)?;
    seeds.known(
        "ply",
        "ply\nformat ascii 1.0\ncomment text\nelement vertex 4\nproperty float x\n\
         property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty float value\nelement face 2\nproperty list uchar int \
         vertex_indices\nend_header\n0 0 0 1 2 3 0.5\n1 0 0 1 2 3 1.5\n1 1 0 1 2 3 2\n\
         0 1 0 1 2 3 4\n4 0 1 2 3\n3 0 1 2\n",
    )?;
    seeds.known(
        "ply",
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n\
         property double z\nproperty float scalar\nproperty float radius\nend_header\n0 0 0 1 0.5\n\
         1 2 3 4 0.25\n",
    )?;
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\n\
         property short y\nproperty short z\nelement face 1\nproperty list uint8 uint32 \
         vertex_indices\nproperty list uchar float texcoord\nend_header\n";
    let mut turned = header.as_bytes().to_vec();
    [0i16, 0, 0, 5, 0, 0, 0, 5, 0].iter().for_each(|v| turned.extend(v.to_be_bytes()));
    turned.push(3);
    [0u32, 1, 2].iter().for_each(|v| turned.extend(v.to_be_bytes()));
    turned.push(6);
    (0..6).for_each(|_| turned.extend(0.5f32.to_be_bytes()));
    seeds.known("ply", turned)
}

/// Three trained Gaussians with colours of a degree.
fn trained(degree: u32) -> Gaussians {
    Gaussians {
        centers: vec![Vec3::ZERO, Vec3::X, Vec3::new(-1.0, 2.0, 0.5)],
        scales: vec![Vec3::splat(0.1), Vec3::new(0.5, 0.1, 0.02), Vec3::new(0.2, 0.3, 0.0)],
        rotations: vec![Quat::IDENTITY, Quat::from_rotation_x(1.0), Quat::from_rotation_z(-2.0)],
        opacities: vec![0.9, 0.5, 0.1],
        degree,
        harmonics: (0..3 * terms(degree)).map(|at| [at as f32 / 100.0, 0.5, -0.25]).collect(),
        ..Gaussians::default()
    }
}

/// The files of trained Gaussians that the library writes.
fn gaussians(seeds: &mut Seeds) -> Result<()> {
    for degree in [0, 1, 3] {
        let set = trained(degree);
        let plain = seeds.written(|path| formats::ply::write_gaussians(&set, path))?;
        seeds.known("ply", plain)?;
        let packed = seeds.written(|path| formats::ply::write_compressed_gaussians(&set, path))?;
        seeds.known("ply", packed)?;
        let scene = seeds.written(|path| formats::gltf::write_gaussians(&set, path))?;
        seeds.known("gltf", scene)?;
        let packed = seeds.written(|path| formats::spz::write(&set, path))?;
        seeds.known("spz", packed)?;
    }
    for degree in [0, 2] {
        let packed = seeds.written(|path| formats::sog::write(&trained(degree), path))?;
        seeds.known("sog", packed)?;
    }
    let records = seeds.written(|path| formats::splat::write(&trained(0), path))?;
    seeds.put("splat", records)
}

/// SPZ of every version, without gzip and its checksum.
fn spz(seeds: &mut Seeds) -> Result<()> {
    const COUNT: u8 = 2;
    const EXTENDED: u8 = 2;
    let mut extensions = [0x1234_0001u32, 3].map(u32::to_le_bytes).concat();
    extensions.extend(b"abc");
    extensions.extend([0xadbe_0003u32, 4, 6].map(u32::to_le_bytes).as_flattened());
    for (version, degree) in [(1, 0), (1, 1), (2, 0), (2, 2), (3, 0), (3, 1), (4, 0), (4, 1)] {
        let position = if version == 1 { 6 } else { 9 };
        let rotation = if version < 3 { 3 } else { 4 };
        let harmonics = 3 * (terms(degree) - 1);
        let sizes = [position, 1, 3, 3, rotation, harmonics];
        let bytes = |size: usize| (0..size * usize::from(COUNT)).map(|at| (at * 29 + 60) as u8);
        let attributes = sizes.map(|size| bytes(size).collect::<Vec<u8>>());
        let mut file = b"NGSP".to_vec();
        file.extend([version, 0, 0, 0, COUNT, 0, 0, 0, degree as u8, 12, EXTENDED, 0]);
        if version < 4 {
            seeds.known("spz", [file, attributes.concat(), extensions.clone()].concat())?;
            continue;
        }
        let streams = attributes.iter().filter(|attribute| !attribute.is_empty());
        let frames: Vec<Vec<u8>> = streams.clone().map(|content| zstd(content)).collect();
        file[15] = frames.len() as u8;
        file.extend((32 + extensions.len() as u32).to_le_bytes());
        file.extend([0; 12]);
        file.extend(&extensions);
        for (frame, content) in frames.iter().zip(streams) {
            let sizes = [frame.len(), content.len()].map(|size| (size as u64).to_le_bytes());
            file.extend(sizes.as_flattened());
        }
        file.extend(frames.concat());
        seeds.known("spz", file)?;
    }
    Ok(())
}

/// `.ksplat` of every level and degree: a section with a full bucket, and one with a partial one.
fn ksplat(seeds: &mut Seeds) -> Result<()> {
    for (level, degree) in (0u8..3).flat_map(|level| (0u8..3).map(move |degree| (level, degree))) {
        let mut head = vec![0; 4096];
        for (at, byte) in [(1, 1), (4, 2), (8, 2), (12, 3), (16, 3), (20, level)] {
            head[at] = byte;
        }
        let (mut heads, mut data) = (Vec::new(), Vec::new());
        for (count, full, partial) in [(2u8, 1, 0), (1, 0, 1)] {
            let mut section = vec![0; 1024];
            let fields = [(0, count), (4, count), (40, degree)];
            let buckets = [(8, 2), (12, 1), (20, 12), (24, 255), (32, full), (36, partial)];
            let of_level = if level == 0 { &[][..] } else { &buckets };
            for &(at, byte) in fields.iter().chain(of_level) {
                section[at] = byte;
            }
            if level > 0 {
                section[16..20].copy_from_slice(&5f32.to_le_bytes());
                let length: &[u8] = if partial > 0 { &[1, 0, 0, 0] } else { &[] };
                data.extend([length, &[0; 12]].concat());
            }
            heads.extend(section);
            let terms = 3 * (terms(u32::from(degree)) - 1);
            let bytes = match level {
                0 => 44 + 4 * terms,
                1 => 24 + 2 * terms,
                _ => 24 + terms,
            };
            // Half of each number, so that they are small and positive.
            data.extend((0..bytes * usize::from(count)).map(|at| [0, 0x38][at % 2]));
        }
        seeds.put("ksplat", [head, heads, data].concat())?;
    }
    Ok(())
}

/// Streamed SOG with two chunks and a scene around them.
fn sog_streamed(seeds: &mut Seeds) -> Result<()> {
    for degree in [0, 1] {
        let chunk = seeds.written(|path| formats::sog::write(&trained(degree), path))?;
        let leaf = |file: u8, count: u8| {
            format!("{{'lods':{{'0':{{'file':{file},'offset':0,'count':{count}}}}}}}")
        };
        let text = format!(
            "{{'version':1,'lodLevels':1,'environment':'2.sog','filenames':['0.sog','1.sog'],\
             'tree':{{'children':[{},{}]}}}}",
            leaf(0, 3),
            leaf(1, 2)
        );
        let mut all = text.replace('\'', "\"").into_bytes();
        for _ in 0..3 {
            all.extend([&b"\n#sog\n"[..], &chunk].concat());
        }
        seeds.put("sog_streamed", all)?;
    }
    Ok(())
}

/// Returns a frame of zstd with its content as it is, of less than 256 bytes.
fn zstd(content: &[u8]) -> Vec<u8> {
    let size = content.len() as u32;
    let [a, b, c, _] = (size << 3 | 1).to_le_bytes();
    [&[0x28, 0xb5, 0x2f, 0xfd, 0x20, size as u8, a, b, c][..], content].concat()
}

fn webp(width: usize, texels: &[[u8; 4]]) -> Result<Vec<u8>> {
    let (width, height) = (width as u32, (texels.len() / width) as u32);
    let mut out = Vec::new();
    let encoder = WebPEncoder::new(&mut out);
    encoder.encode(texels.as_flattened(), width, height, ColorType::Rgba8)?;
    Ok(out)
}

/// SOG of both versions, with planes beside the text, and in an archive.
fn sog(seeds: &mut Seeds) -> Result<()> {
    for (is_second, degree) in [(true, 0), (true, 1), (true, 3), (false, 0), (false, 2)] {
        let mut planes = vec![
            webp(2, &[[0x10, 0xef, 7, 255], [0, 0xff, 7, 255]])?,
            webp(2, &[[0x27, 0xd8, 0, 255], [0, 0xff, 0, 255]])?,
            webp(2, &[[51, 204, 153, 252], [51, 204, 153, 254]])?,
            webp(2, &[[0, 1, 2, 255], [2, 2, 0, 255]])?,
            webp(2, &[[0, 1, 2, 51], [2, 0, 0, 255]])?,
        ];
        if degree > 0 {
            let width = 64 * (terms(degree) - 1);
            planes.push(webp(width, &vec![[0, 1, 2, 255]; width])?);
            planes.push(webp(2, &[[5, 0, 0, 255], [63, 0, 0, 255]])?);
        }
        let meta = sog_meta(is_second, degree).into_bytes();
        let beside = |all: Vec<u8>, plane: &Vec<u8>| [&all[..], b"\n#webp\n", plane].concat();
        seeds.put("sog", planes.iter().fold(meta.clone(), beside))?;
        let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let method = zip::CompressionMethod::Stored;
        let options = zip::write::SimpleFileOptions::default().compression_method(method);
        for (number, plane) in planes.iter().enumerate() {
            let name = format!("{number}.webp");
            archive.start_file(name.as_str(), options)?;
            archive.write_all(plane)?;
        }
        archive.start_file("meta.json", options)?;
        archive.write_all(&meta)?;
        seeds.known("sog", archive.finish()?.into_inner())?;
    }
    Ok(())
}

/// Returns the `meta.json` of two Gaussians: codebooks in version 2, ranges in version 1.
fn sog_meta(is_second: bool, degree: u32) -> String {
    let (head, shape, codes) = if is_second {
        ("'version':2,'count':2,", "", ["'codebook':[-1,0,0.5]"; 3])
    } else {
        let codes = [
            "'mins':[-1,-2,0],'maxs':[0,0,2.5]",
            "'mins':[-1,-1,0,-2],'maxs':[1.5,0,2.5,2]",
            "'mins':0,'maxs':2.5",
        ];
        ("", "'shape':[2,3],", codes)
    };
    let [scales, constants, others] = codes;
    let rest = if degree == 0 {
        String::new()
    } else {
        format!(",'shN':{{'count':64,'bands':{degree},{others},'files':['5.webp','6.webp']}}")
    };
    let text = format!(
        "{{{head}'means':{{{shape}'mins':[0,-6.5,0.5],'maxs':[6.5,0,0.5],'files':['0.webp',\
         '1.webp']}},'quats':{{'files':['2.webp']}},'scales':{{{scales},'files':['3.webp']}},\
         'sh0':{{{constants},'files':['4.webp']}}{rest}}}"
    );
    text.replace('\'', "\"")
}

fn picture(format: image::ImageFormat) -> Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    let picture =
        image::RgbImage::from_fn(5, 4, |x, y| image::Rgb([x as u8 * 50, y as u8 * 60, 7]));
    picture.write_to(&mut out, format)?;
    Ok(out.into_inner())
}

fn obj(seeds: &mut Seeds) -> Result<()> {
    let square = "mtllib input.mtl\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\n\
         vt 1 1\nvn 0 0 1\no a\nusemtl red\nf 1/1/1 2/2/1 3/3/1\ng b\ns off\nusemtl plain\n\
         f 1 3 4\nf -4//-1 -3//-1 -2//-1 -1//-1\nl 1 2\np 1\n";
    seeds.put("obj", square)?;
    seeds.put("obj", "v 1e3 -2 .5\r\nv 1 2 3 \\\r\n 4\r\nv 0 0 0\r\n# text\r\nf 1 2 3\r\n")?;
    let materials = "newmtl red\nKd 1 0 0\nd 0.5\nmap_Kd -s 1 1 1 input.png\nnewmtl plain\nKd 0.5\n\
         Tr 0.25\nillum 2\n";
    for format in [image::ImageFormat::Png, image::ImageFormat::Jpeg] {
        let parts =
            [square.as_bytes(), b"\n#mtl\n", materials.as_bytes(), b"\n#png\n", &picture(format)?]
                .concat();
        seeds.put("obj", parts)?;
    }
    Ok(())
}

fn stl(seeds: &mut Seeds) -> Result<()> {
    seeds.known(
        "stl",
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
         endloop\nendfacet\nendsolid a\n",
    )?;
    let mut binary = vec![b' '; 80];
    binary.extend(2u32.to_le_bytes());
    for z in [0.0, 1.0] {
        binary.extend(floats([0.0, 0.0, 1.0, 0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z]));
        binary.extend([0x1f, 0x80]);
    }
    seeds.put("stl", binary)
}

fn off(seeds: &mut Seeds) -> Result<()> {
    seeds.known("off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n")?;
    seeds.known("off", "CNOFF\n1 0 0\n0 0 0 0 0 1 0.5 0.5 0.5 1\n")?;
    let mut binary = b"OFF BINARY\n".to_vec();
    [3i32, 1, 0].iter().for_each(|v| binary.extend(v.to_be_bytes()));
    for v in [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        binary.extend(v.to_be_bytes());
    }
    [3i32, 0, 1, 2, 0].iter().for_each(|v| binary.extend(v.to_be_bytes()));
    seeds.put("off", binary)
}

fn gltf(seeds: &mut Seeds) -> Result<()> {
    // The positions, indices, normals and texture coordinates of one triangle.
    let mut data = floats([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    [0u16, 1, 2, 0].iter().for_each(|v| data.extend(v.to_le_bytes()));
    data.extend(floats([0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]));
    [0u16, 65535, 0, 0, 65535, 0].iter().for_each(|v| data.extend(v.to_le_bytes()));
    let picture = picture(image::ImageFormat::Png)?;
    let place = data.len();
    data.extend(&picture);
    data.resize(data.len().next_multiple_of(4), 0);
    let length = data.len();
    let size = picture.len();
    let document = |buffer: &str| {
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\n\
             \"nodes\":[{{\"children\":[1],\"translation\":[1,2,3],\"rotation\":[0,0,0,1],\
             \"scale\":[1,2,1]}},{{\"mesh\":0,\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}}],\n\
             \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0,\"NORMAL\":2,\
             \"TEXCOORD_0\":3}},\"indices\":1,\"material\":0,\"mode\":4}}]}}],\n\
             \"materials\":[{{\"pbrMetallicRoughness\":{{\"baseColorFactor\":[1,0.5,0,1],\
             \"baseColorTexture\":{{\"index\":0,\"extensions\":{{\"KHR_texture_transform\":{{\"\
             offset\":[0.5,0],\"scale\":[2,2],\"rotation\":1}}}}}}}}}}],\n\
             \"textures\":[{{\"source\":0}}],\"images\":[{{\"bufferView\":4,\"mimeType\":\"image\
             /png\"}}],\n\"buffers\":[{{\"byteLength\":{length}{buffer}}}],\n\
             \"bufferViews\":[{{\"buffer\":0,\"byteLength\":36}},{{\"buffer\":0,\"byteOffset\":36,\
             \"byteLength\":6}},{{\"buffer\":0,\"byteOffset\":44,\"byteLength\":36}},\
             {{\"buffer\":0,\"byteOffset\":80,\"byteLength\":12,\"byteStride\":4}},{{\"buffer\":0,\
             \"byteOffset\":{place},\"byteLength\":{size}}}],\n\"accessors\":[{{\"bufferView\":0,\
             \"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,1,\
             0]}},{{\"bufferView\":1,\"componentType\":5123,\"count\":3,\"type\":\"SCALAR\"}},\
             {{\"bufferView\":2,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}},\n\
             {{\"bufferView\":3,\"componentType\":5123,\"normalized\":true,\"count\":3,\
             \"type\":\"VEC2\",\"sparse\":{{\"count\":1,\"indices\":{{\"bufferView\":1,\
             \"componentType\":5123}},\"values\":{{\"bufferView\":3}}}}}}]}}"
        )
    };
    let mut text = document("").into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = b"glTF\x02\0\0\0".to_vec();
    binary.extend(((28 + text.len() + data.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &data)] {
        binary.extend((chunk.len() as u32).to_le_bytes());
        binary.extend(kind);
        binary.extend(chunk);
    }
    seeds.known("gltf", binary)?;
    seeds.known(
        "gltf",
        document(&format!(",\"uri\":\"data:application/octet-stream;base64,{}\"", base64(&data))),
    )?;
    let beside = document(",\"uri\":\"input.bin\"")
        .replace("\"bufferView\":4,\"mimeType\":\"image/png\"", "\"uri\":\"input.png\"");
    seeds.put("gltf", [beside.as_bytes(), b"\n#bin\n", &data, b"\n#png\n", &picture].concat())?;
    seeds.known(
        "gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"children\":[\
         1]},{\"children\":[0],\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"\
         POSITION\":0}}]}],\"accessors\":[{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}]}",
    )
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |part: &[u8]| {
        let bits = (0..3)
            .fold(0usize, |bits, at| bits << 8 | usize::from(part.get(at).copied().unwrap_or(0)));
        let letter = |at: usize| {
            if at > part.len() { '=' } else { char::from(LETTERS[bits >> (18 - 6 * at) & 63]) }
        };
        (0..4).map(letter).collect::<String>()
    };
    bytes.chunks(3).map(group).collect()
}

/// Size of a point record in each LAS point format, in bytes.
const RECORD: [usize; 9] = [20, 28, 26, 34, 57, 63, 30, 36, 38];

fn las_header(format: u8, start: usize, records: u32, points: u32) -> Vec<u8> {
    let (minor, size) = if format & 63 < 6 { (2, 227) } else { (4, 375) };
    let mut header = vec![0; size];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, minor]);
    put(94, &(size as u16).to_le_bytes());
    put(96, &(start as u32).to_le_bytes());
    put(100, &records.to_le_bytes());
    put(104, &[format]);
    put(105, &(RECORD[usize::from(format & 63)] as u16).to_le_bytes());
    if minor == 4 {
        put(247, &u64::from(points).to_le_bytes());
    } else {
        put(107, &points.to_le_bytes());
    }
    for axis in 0..3 {
        put(131 + 8 * axis, &0.01f64.to_le_bytes());
        put(155 + 8 * axis, &1e5f64.to_le_bytes());
    }
    header
}

fn las(seeds: &mut Seeds) -> Result<()> {
    const POINTS: u32 = 6;
    for format in [0, 1, 3, 6, 7] {
        let record = |number: u32| {
            let mut record = vec![0; RECORD[usize::from(format)]];
            for (axis, at) in [0, 4, 8].into_iter().enumerate() {
                record[at..at + 4].copy_from_slice(&(number * 7 + axis as u32).to_le_bytes());
            }
            record[12] = number as u8;
            record[14] = if format < 6 { 0b1001 } else { 0x11 };
            if let Some(last) = record.last_mut().filter(|_| format > 1) {
                *last = number as u8;
            }
            record
        };
        let start = las_header(format, 0, 0, 0).len();
        let points: Vec<u8> = (0..POINTS).flat_map(record).collect();
        seeds.known("las", [las_header(format, start, 0, POINTS), points].concat())?;

        let items = laz::LazItemRecordBuilder::default_for_point_format_id(format, 0)?;
        let builder = laz::LazVlrBuilder::new(items);
        let layout = if format < 6 {
            builder.with_fixed_chunk_size(4)
        } else {
            builder.with_variable_chunk_size()
        }
        .build();
        let mut described = Vec::new();
        layout.write_to(&mut described)?;
        let mut before = vec![0; 54];
        before[2..2 + laz::LazVlr::USER_ID.len()].copy_from_slice(laz::LazVlr::USER_ID.as_bytes());
        before[18..20].copy_from_slice(&laz::LazVlr::RECORD_ID.to_le_bytes());
        before[20..22].copy_from_slice(&(described.len() as u16).to_le_bytes());
        before.extend(described);
        let start = start + before.len();
        let mut file = Cursor::new([las_header(format | 0x80, start, 1, POINTS), before].concat());
        file.set_position(start as u64);
        let mut packer = laz::LasZipCompressor::new(&mut file, layout)?;
        for number in 0..POINTS {
            packer.compress_one(&record(number))?;
            if format >= 6 && number == 3 {
                packer.finish_current_chunk()?;
            }
        }
        packer.done()?;
        drop(packer);
        seeds.known("las", file.into_inner())?;
    }
    Ok(())
}

fn e57(seeds: &mut Seeds) -> Result<()> {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    const DOUBLE: RecordDataType = RecordDataType::Double { min: None, max: None };
    let color = RecordDataType::Integer { min: 0, max: 255 };
    let scaled = RecordDataType::ScaledInteger { min: -4000, max: 4000, scale: 0.01, offset: 0.0 };
    let kinds = [
        vec![
            (RecordName::CartesianX, DOUBLE),
            (RecordName::CartesianY, DOUBLE),
            (RecordName::CartesianZ, DOUBLE),
            (RecordName::ColorRed, color.clone()),
            (RecordName::ColorGreen, color.clone()),
            (RecordName::ColorBlue, color),
        ],
        vec![
            (RecordName::SphericalRange, DOUBLE),
            (RecordName::SphericalAzimuth, DOUBLE),
            (RecordName::SphericalElevation, DOUBLE),
            (RecordName::Intensity, RecordDataType::Single { min: None, max: None }),
        ],
        vec![
            (RecordName::CartesianX, scaled.clone()),
            (RecordName::CartesianY, scaled.clone()),
            (RecordName::CartesianZ, scaled),
        ],
    ];
    for kind in kinds {
        let mut out = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut out, "file")?;
        let records = kind
            .iter()
            .map(|(name, data_type)| Record { name: name.clone(), data_type: data_type.clone() });
        let mut scan = writer.add_pointcloud("scan", records.collect())?;
        for point in 0..3 {
            let value = |(_, data_type): &(RecordName, RecordDataType)| match data_type {
                RecordDataType::Double { .. } => RecordValue::Double(f64::from(point)),
                RecordDataType::Single { .. } => RecordValue::Single(point as f32),
                RecordDataType::Integer { .. } => RecordValue::Integer(point.into()),
                RecordDataType::ScaledInteger { .. } => RecordValue::ScaledInteger(point.into()),
            };
            scan.add_point(kind.iter().map(value).collect())?;
        }
        scan.finalize()?;
        writer.finalize()?;
        drop(writer);
        let bytes = out.into_inner();
        seeds.put("e57", &bytes)?;
        seeds.known("e57_summed", bytes)?;
    }
    Ok(())
}

fn tables(seeds: &mut Seeds) -> Result<()> {
    for text in [
        "0 0 0\n1 0 0\n0 1 0\n",
        "3\n0 0 0 -5 255 0 0\n1 0 0 17 0 255 0\n0 1 0 99 0 0 255\n",
        "// X Y Z R G B Nx Ny Nz\n1.5;2;3;1;2;3;0;0;1\n",
        "x,y,z\r\n1,2,3\r\n-1e3,2.5,+3\r\n",
        "\"x\",\"y\",\"z\",\"red\",\"green\",\"blue\"\n1,2,3,4,5,6\n",
    ] {
        seeds.put("xyz", text)?;
    }
    for text in [
        "x,y,z,value\n0,0,0,1\n1,0,0,2\n",
        "0 0 0 1 0.5\n1 0 0 2 0.5\n",
        "x;y;z;value;xx;xy;xz;yy;yz;zz\n0;0;0;1;1;0;0;1;0;1\n",
        "0 0 0 1 1 0 0 1 0 1\n# text\n\n2 2 2 3 1 0.1 0 1 0 1\n",
        "\u{feff}name\tz\ty\tx\tscalar\tradius\na\t1\t2\t3\t4\t5\n",
    ] {
        seeds.put("csv", text)?;
    }
    Ok(())
}

fn pcd(seeds: &mut Seeds) -> Result<()> {
    let header = |data: &str| {
        format!(
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb normal_x \
             normal_y normal_z\nSIZE 4 4 4 4 4 4 4\nTYPE F F F U F F F\nCOUNT 1 1 1 1 1 1 1\n\
             WIDTH 2\nHEIGHT 1\nVIEWPOINT 1 2 9 1 0 0 0\nPOINTS 2\nDATA {data}\n"
        )
        .into_bytes()
    };
    seeds.known("pcd", [header("ascii"), b"1 2 3 255 0 0 1\n4 5 6 7 0 1 0\n".to_vec()].concat())?;
    let rows = floats((0..14).map(|v| v as f32));
    seeds.known("pcd", [header("binary"), rows.clone()].concat())?;
    let runs: Vec<u8> =
        rows.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let sizes = [runs.len(), rows.len()].map(|size| (size as u32).to_le_bytes()).concat();
    seeds.known("pcd", [header("binary_compressed"), sizes, runs].concat())?;
    // A copy of earlier output that overlaps itself.
    let packed = [&[0, 0, 0xe0, 45, 0][..], &[0, 1]].concat();
    let sizes = [packed.len() as u32, 56].map(u32::to_le_bytes).concat();
    seeds.known("pcd", [header("binary_compressed"), sizes, packed].concat())
}

fn npy(seeds: &mut Seeds) -> Result<()> {
    for (version, kind, shape, count) in
        [(1, "<f4", "(2, 4)", 8), (2, "<f4", "(1, 5)", 5), (1, "<f8", "(1, 4)", 4)]
    {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        bytes.extend(&(header.len() as u32).to_le_bytes()[..if version == 1 { 2 } else { 4 }]);
        bytes.extend(header.bytes());
        for value in 1..=count {
            match kind {
                "<f8" => bytes.extend(f64::from(value).to_le_bytes()),
                _ => bytes.extend((value as f32).to_le_bytes()),
            }
        }
        seeds.known("npy", bytes)?;
    }
    Ok(())
}

/// MetaImage, MRC, NPZ, TIFF and HDF5 files of a few samples.
fn of_laboratories(seeds: &mut Seeds) -> Result<()> {
    let header = |fields: &str, data: &str| {
        format!(
            "ObjectType = Image\nNDims = 3\n{fields}DimSize = 2 2 2\nElementType = MET_UCHAR\n\
             ElementDataFile = {data}\n"
        )
    };
    seeds.known("mhd", header("", "LOCAL") + "01234567")?;
    seeds.known(
        "mhd",
        header("BinaryData = False\nHeaderSize = -1\n", "LOCAL") + "1 2 3 4 5 6 7 8",
    )?;
    let channels = "ElementNumberOfChannels = 3\nBinaryDataByteOrderMSB = True\nTransformMatrix = \
                    0 1 0 1 0 0 0 0 1\nOffset = 1 2 3\nElementSpacing = 1 2 3\n";
    seeds.known("mhd", header(channels, "LOCAL") + "0123456789abcdef01234567")?;
    seeds.put("mhd", header("", "0.raw") + "\n#data\n01234567")?;
    seeds.put("mhd", header("", "LIST\n0.raw\n0.raw") + "\n#data\n0123")?;
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), Compression::default());
    packed.write_all(b"01234567")?;
    let text = header("CompressedData = True\n", "LOCAL").into_bytes();
    seeds.known("mhd", [text, packed.finish()?].concat())?;
    for (mode, big) in
        [(0i32, false), (1, true), (2, false), (4, true), (12, false), (16, false), (101, false)]
    {
        let mut map = vec![0; 1024];
        let mut put = |word: usize, value: i32| {
            let bytes = if big { value.to_be_bytes() } else { value.to_le_bytes() };
            map[4 * (word - 1)..][..4].copy_from_slice(&bytes);
        };
        for axis in 1..=3 {
            put(axis, 2);
            put(7 + axis, 2);
            put(10 + axis, 2f32.to_bits() as i32);
            put(13 + axis, 90f32.to_bits() as i32);
            put(16 + axis, axis as i32);
        }
        put(4, mode);
        map[208..212].copy_from_slice(b"MAP ");
        map[212..214].copy_from_slice(if big { &[0x11, 0x11] } else { &[0x44, 0x44] });
        map.extend([1; 64]);
        seeds.known("mrc", map)?;
    }
    arrays_and_pages(seeds)
}

fn arrays_and_pages(seeds: &mut Seeds) -> Result<()> {
    let text = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 2), }\n";
    let mut array = b"\x93NUMPY\x01\0".to_vec();
    array.extend((text.len() as u16).to_le_bytes());
    array.extend([text.as_bytes(), b"01234567"].concat());
    seeds.known("npy", &array)?;
    for method in [zip::CompressionMethod::Stored, zip::CompressionMethod::Deflated] {
        let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for name in ["a.npy", "b.npy"] {
            let options = zip::write::SimpleFileOptions::default().compression_method(method);
            writer.start_file(name, options)?;
            writer.write_all(&array)?;
        }
        seeds.known("npz", writer.finish()?.into_inner())?;
    }
    for (packed, text) in [
        (Compress::Uncompressed, "ImageJ=1.53t\nimages=4\nchannels=2\nslices=2\nunit=um\n"),
        (Compress::Lzw, "<OME><Pixels SizeZ='2' SizeC='1' SizeT='2' DimensionOrder='XYZCT'></OME>"),
        (Compress::Packbits, "{\"shape\": [2, 2, 2, 3]}"),
    ] {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file)?.with_compression(packed);
        for page in 0..4 {
            let mut image = encoder.new_image::<colortype::Gray8>(3, 2)?;
            if page == 0 {
                image.encoder().write_tag(Tag::ImageDescription, text)?;
            }
            image.write_data(&[page, 1, 2, 3, 4, 5])?;
        }
        seeds.known("tiff", file.into_inner())?;
    }
    let mut file = hdf5_pure::FileBuilder::new();
    file.create_dataset("small").with_u8_data(&[1, 2]).with_shape(&[1, 1, 2]);
    let data: Vec<i16> = (0..60).collect();
    let set = file.create_dataset("chunks").with_i16_data(&data).with_shape(&[3, 4, 5]);
    set.with_chunks(&[2, 2, 2]).with_shuffle().with_deflate(6);
    seeds.known("hdf5", file.finish()?)?;
    Ok(())
}

fn volumes(seeds: &mut Seeds) -> Result<()> {
    let lattice = Lattice::with_spacing([3, 2, 2], DVec3::new(1.0, 2.0, 0.5));
    let samples = Samples::U8((0..12).collect());
    let volume = Volume::new(lattice, samples)?;
    let written = seeds.written(|path| formats::nrrd::write(&volume, path))?;
    seeds.known("nrrd", written)?;
    let head = "NRRD0005\n# text\ntype: short\ndimension: 3\nspace: left-posterior-superior\n\
         sizes: 2 2 2\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n\
         endian: big\n";
    seeds.known("nrrd", [head.as_bytes(), b"encoding: raw\n\n0123456789abcdef"].concat())?;
    seeds.known("nrrd", format!("{head}encoding: hex\n\n00010203040506070809 0a0b0c0d0e0f"))?;
    seeds.known("nrrd", format!("{head}lattice:=bcc\nencoding: ascii\n\n1 2 3 4 5 6 7 -8"))?;
    let places = "axis positions 0:=0 1\naxis positions 1:=0 2\naxis positions 2:=0 5\n";
    seeds.known("nrrd", format!("{head}{places}encoding: text\n\n1 2 3 4 5 6 7 8"))?;
    let detached = |field: &str, data: &[&str]| {
        let data: String = data.iter().map(|data| format!("\n#data\n{data}")).collect();
        format!("{head}encoding: raw\ndata file: {field}\n{data}")
    };
    seeds.put("nrrd", format!("{head}encoding: raw\n\n0123456789abcdef\n#data\n"))?;
    seeds.put("nrrd", detached("0.raw", &["0123456789abcdef"]))?;
    seeds.put("nrrd", detached("0.raw\nbyte skip: -1", &["text 0123456789abcdef"]))?;
    seeds.put("nrrd", detached("%d.raw 0 1 1", &["01234567", "89abcdef"]))?;
    seeds.put("nrrd", detached("%01u.raw 3 0 -1 1", &["0123", "4567", "89ab", "cdef"]))?;
    seeds.put("nrrd", detached("LIST\n1.raw\n0.raw", &["89abcdef", "01234567"]))?;
    seeds.put("nrrd", detached("LIST 3\n0.raw\n1.raw", &["01234567", "89abcdef"]))?;
    let mut packer = GzEncoder::new(Vec::new(), Compression::default());
    packer.write_all(b"0123456789abcdef")?;
    seeds.known("nrrd", [head.as_bytes(), b"encoding: gzip\n\n", &packer.finish()?].concat())?;
    seeds.put("raw", [&[2, 2, 2, 0, 16, 0][..], b"01234567"].concat())?;
    seeds.put("raw", [&[1, 2, 1, 9, 8, 3][..], b"abc\0\0\x80?\0\0\0@"].concat())?;
    let mut packer = GzEncoder::new(Vec::new(), Compression::default());
    packer.write_all(b"01234567")?;
    seeds.put("raw", [&[2, 2, 2, 0, 16, 0][..], &packer.finish()?].concat())
}

/// Files of NIfTI and DICOM.
fn medical(seeds: &mut Seeds) -> Result<()> {
    let file = inputs::nifti(|_| {});
    seeds.known("nifti", &file)?;
    seeds.known("nifti", inputs::nifti(|header| header[254] = 1))?;
    seeds.known("nifti", inputs::nifti(|header| header[252] = 1))?;
    seeds.known("nifti", inputs::nifti(|header| header[70] = 128))?;
    let pair = inputs::nifti(|header| header[345] = b'i');
    seeds.put("nifti", [&pair[..348], b"\n#img\n", &pair[352..]].concat())?;
    let mut packer = GzEncoder::new(Vec::new(), Compression::default());
    packer.write_all(&file)?;
    seeds.known("nifti", packer.finish()?)?;
    let slice = |z: &str| {
        let file = inputs::dicom(".1", &[1, 2, 3, 4]);
        let place = inputs::element(0x20, 0x32, "DS", z.as_bytes());
        let at = file.windows(4).position(|tag| tag == [0x28, 0, 2, 0]).expect("the tag");
        [&file[..at], &place, &file[at..]].concat()
    };
    for syntax in [".1", "", ".2", ".5", ".1.99", ".4.70", ".4.90"] {
        seeds.known("dicom", inputs::dicom(syntax, &[1, 2, 3, 4]))?;
    }
    seeds.put("dicom", slice("0\\0\\1 "))?;
    let several = [slice("0\\0\\1 "), slice("0\\0\\2 "), slice("0\\0\\4 ")];
    seeds.put("dicom_folder", several.join(&b"\n#file\n"[..]))
}

fn vti(seeds: &mut Seeds) -> Result<()> {
    let image = "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"><ImageData \
         WholeExtent=\"0 2 0 1 0 0\" Origin=\"0 0 0\" Spacing=\"1 1 2\"><Piece Extent=\"0 2 0 1 0 \
         0\"><PointData Scalars=\"s\">";
    let end = "</PointData></Piece></ImageData></VTKFile>";
    seeds.known(
        "vti",
        format!(
            "{image}<DataArray type=\"UInt8\" Name=\"s\" format=\"ascii\">0 1 2 3 4 \
             5</DataArray>{end}"
        ),
    )?;
    let inline = base64(&[&6u32.to_le_bytes()[..], &[0, 1, 2, 3, 4, 5]].concat());
    seeds.known(
        "vti",
        format!(
            "{image}<DataArray type=\"UInt8\" Name=\"s\" format=\"binary\">{inline}</DataArray>\
             {end}"
        ),
    )?;
    let appended = format!(
        "{image}<DataArray type=\"UInt8\" Name=\"s\" format=\"appended\" offset=\"0\"/></PointData>\
         </Piece></ImageData><AppendedData encoding=\"raw\">_"
    );
    let data =
        [&6u32.to_le_bytes()[..], &[0, 1, 2, 3, 4, 5], b"</AppendedData></VTKFile>"].concat();
    seeds.known("vti", [appended.as_bytes(), &data].concat())?;
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), Compression::default());
    packer.write_all(&[0, 1, 2, 3, 4, 5])?;
    let packed = packer.finish()?;
    let sizes = [1, 6, 0, packed.len() as u32].map(u32::to_le_bytes).concat();
    let packed_image =
        image.replace("byte_order", "compressor=\"vtkZLibDataCompressor\" byte_order");
    seeds.known(
        "vti",
        format!(
            "{packed_image}<DataArray type=\"UInt8\" Name=\"s\" format=\"binary\">{}{}</DataArray>\
             {end}",
            base64(&sizes),
            base64(&packed)
        ),
    )
}

fn vtr_vtu(seeds: &mut Seeds) -> Result<()> {
    let array = |kind: &str, name: &str, parts: u32, text: &str| {
        format!(
            "<DataArray type='{kind}' Name='{name}' NumberOfComponents='{parts}' format='ascii'>\
             {text}</DataArray>"
        )
    };
    let places = ["0 1 5", "-1 1", "7"].map(|text| array("Float64", "p", 1, text)).concat();
    seeds.known(
        "vtr",
        format!(
            "<VTKFile type='RectilinearGrid'><RectilinearGrid WholeExtent='0 2 0 1 0 0'><Piece \
             Extent='0 2 0 1 0 0'><PointData Scalars='s'>{}</PointData><Coordinates>\
             {places}</Coordinates></Piece></RectilinearGrid></VTKFile>",
            array("UInt8", "s", 1, "0 1 2 3 4 5")
        ),
    )?;
    let points = array("Float32", "points", 3, "0 0 0 2 0 0 0 2 0 0 0 2");
    let cells =
        [("Int64", "connectivity", "0 1 2 3"), ("Int64", "offsets", "4"), ("UInt8", "types", "10")]
            .map(|(kind, name, text)| array(kind, name, 1, text))
            .concat();
    for (point_data, cell_data) in [
        (array("Float32", "value", 1, "1 2 3 4"), String::new()),
        (String::new(), array("Int32", "c", 1, "5")),
    ] {
        seeds.known(
            "vtu",
            format!(
                "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='4' \
                 NumberOfCells='1'><PointData>{point_data}</PointData><CellData>\
                 {cell_data}</CellData><Points>{points}</Points><Cells>{cells}</Cells></Piece>\
                 </UnstructuredGrid></VTKFile>"
            ),
        )?;
    }
    seeds.known(
        "vtu",
        format!(
            "<VTKFile type='PolyData'><PolyData><Piece NumberOfPoints='4' NumberOfVerts='0' \
             NumberOfPolys='1'><PointData>{}</PointData><Points>{points}</Points><Polys>\
             {cells}</Polys></Piece></PolyData></VTKFile>",
            array("Float32", "value", 1, "1 2 3 4")
        ),
    )?;
    let values = array("Float32", "value", 1, "1 2 3 4 5 6 7 nan")
        + &array("UInt8", "vtkGhostType", 1, "0 0 0 0 0 0 0 1");
    let corners = "0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1";
    seeds.known(
        "vtu",
        format!(
            "<VTKFile type='StructuredGrid'><StructuredGrid WholeExtent='0 1 0 1 0 1'><Piece \
             Extent='0 1 0 1 0 1'><PointData>{values}</PointData><Points>{}</Points></Piece>\
             </StructuredGrid></VTKFile>",
            array("Float32", "points", 3, corners)
        ),
    )?;
    let polyhedron = [
        ("connectivity", "0 1 2 3"),
        ("offsets", "4"),
        ("types", "42"),
        ("faces", "4 3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3"),
        ("faceoffsets", "17"),
    ]
    .map(|(name, text)| array("Int64", name, 1, text))
    .concat();
    seeds.known(
        "vtu",
        format!(
            "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='4' \
             NumberOfCells='1'><CellData>{}</CellData><Points>{points}</Points><Cells>{polyhedron}\
             </Cells></Piece></UnstructuredGrid></VTKFile>",
            array("Float32", "value", 3, "1 2 3")
        ),
    )
}

fn vtk(seeds: &mut Seeds) -> Result<()> {
    let head = |encoding: &str| format!("# vtk DataFile Version 3.0\ntitle\n{encoding}\n");
    let image = "DATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 1\nORIGIN 10 20 30\nSPACING 0.5 1 2\n\
         POINT_DATA 6\nSCALARS density unsigned_char 1\nLOOKUP_TABLE default\n";
    seeds.known("vtk", format!("{}{image}0 1 2 30 4 255\n", head("ASCII")))?;
    seeds.known(
        "vtk",
        [head("BINARY").as_bytes(), image.as_bytes(), &[0, 1, 2, 3, 4, 5]].concat(),
    )?;
    for rest in [
        "DATASET RECTILINEAR_GRID\nDIMENSIONS 3 2 1\nX_COORDINATES 3 double\n0 1 5\n\
         Y_COORDINATES 2 float\n-1 1\nZ_COORDINATES 1 float\n7\nPOINT_DATA 6\nFIELD FieldData 1\n\
         f 1 6 float\n0 1 2 3 4 5.5\n",
        "DATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 2 0 0 0 2 0 0 0 2\nCELLS 1 5\n4 0 1 2 3\n\
         CELL_TYPES 1\n10\nCELL_DATA 1\nSCALARS c int 1\nLOOKUP_TABLE default\n5\n",
        "DATASET POLYDATA\nPOINTS 3 float\n0 0 0 2 0 0 0 2 0\nPOLYGONS 1 4\n3 0 1 2\nPOINT_DATA 3\n\
         SCALARS value float\nLOOKUP_TABLE default\n1 2 3\n",
        "DATASET STRUCTURED_GRID\nDIMENSIONS 2 2 1\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n\
         POINT_DATA 4\nSCALARS b bit\nLOOKUP_TABLE default\n0 1 0 1\nFIELD f 2\ns 1 4 string\na\n\
         b\nc\nd\nv 3 4 float\n1 2 3 4 5 6 7 8 9 10 11 12\n",
    ] {
        seeds.known("vtk", format!("{}{rest}", head("ASCII")))?;
    }
    Ok(())
}

fn hierarchies(seeds: &mut Seeds) -> Result<()> {
    let whole = tetrahedron().surfels(&splatkit::surface::SurfelOptions {
        largest_spacing: 0.2,
        ..Default::default()
    })?;
    for (count, block_splats) in [(1, 64), (7, 64), (150, 64)] {
        let splats: Vec<_> = whole.splats.iter().copied().take(count).collect();
        let set = splatkit::splat::Surfels { splats, ..whole.clone() };
        let tree =
            Tree::build(&set, &BuildOptions { block_splats, ..BuildOptions::default() }, None)?;
        for lossless in [false, true] {
            let options = WriteOptions {
                lossless,
                unit: "m".into(),
                source: "a.ply".into(),
                ..WriteOptions::default()
            };
            let bytes = to_bytes(&tree, &options)?;
            for bytes in [flat::flat(&bytes), bytes] {
                seeds.put("splk", &bytes)?;
                seeds.known("splk_summed", bytes)?;
            }
        }
    }
    // More pages than one directory page lists.
    let bytes = to_bytes(&grid::grid(3), &WriteOptions::default())?;
    seeds.put("splk", &bytes)?;
    seeds.known("splk_summed", bytes)?;
    Ok(())
}

fn in_bricks(seeds: &mut Seeds) -> Result<()> {
    let samples = |count: usize| -> [Samples; 4] {
        [
            Samples::U8((0..count).map(|i| (i % 7) as u8).collect()),
            Samples::I16((0..count).map(|i| (i % 5) as i16 - 2).collect()),
            Samples::U16(vec![9; count]),
            Samples::F32((0..count).map(|i| (i % 3) as f32).collect()),
        ]
    };
    for dims in [[2, 3, 4], [33, 2, 1]] {
        for samples in samples(dims.iter().product()) {
            let volume = Volume::new(Lattice::with_spacing(dims, DVec3::ONE), samples)?;
            let options = bricks::WriteOptions { unit: "mm".into(), source: "a".into() };
            let bytes = seeds.written(|path| bricks::write(&volume, path, &options, None))?;
            for bytes in [flat::flat_bricks(&bytes), bytes] {
                seeds.put("splv", &bytes)?;
                seeds.known("splv_summed", bytes)?;
            }
        }
    }
    Ok(())
}

fn transfer(seeds: &mut Seeds) -> Result<()> {
    for text in [
        r#"{"color": [[0, 1, 0.5, 0], [1, 0, 0, 1]], "opacity": [[0, 0], [1, 0.5], [1, 1]]}"#,
        "{\"color\": [[-1e3, 1, 1, 1]], \"opacity\": [[5, 0.1]], \"unit\": 2.5, \"shade\": \
         {\"ambient\": 0.2, \"diffuse\": 0.7, \"specular\": 0.3, \"power\": 10}, \"gradient\": \
         [[0, 0], [3, 1]], \"isosurfaces\": [{\"value\": 80, \"color\": [1, 1, 1], \"opacity\": \
         1}]}",
    ] {
        seeds.put("transfer", text)?;
    }
    Ok(())
}

/// Random bytes, which the target decodes as a model. The fuzzer finds the rest.
fn models(seeds: &mut Seeds) -> Result<()> {
    let mut state = 1u32;
    for length in [40, 200, 600] {
        let next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let bytes: Vec<u8> = std::iter::repeat_with(next).take(length).collect();
        seeds.put("convert_render", bytes)?;
    }
    Ok(())
}
