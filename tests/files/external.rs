//! Hierarchies converted in regions have the same leaves as hierarchies built as a whole.

use crate::testing::folder::Folder;
use glam::Vec3;
use splatkit::{
    Result,
    color::{ColorMap, ColorScale, Spread},
    formats,
    hierarchy::{
        self, BuildOptions, Hierarchy,
        external::{Converted, ExternalOptions, Plan, convert},
        file::{WriteOptions, check},
    },
    input::Limits,
    splat::{Splat, decode_normal},
    surface::{Mesh, Paint, SurfelOptions, Values},
};
use std::path::{Path, PathBuf};

/// Options with so little memory that regions are as small as possible.
fn options() -> ExternalOptions {
    ExternalOptions {
        memory: 1,
        preset: hierarchy::Preset::Fastest,
        block_splats: 1 << 9,
        surfels: SurfelOptions::default(),
        paint: None,
        scalar: None,
        parts: None,
    }
}

fn lossless() -> WriteOptions {
    WriteOptions { lossless: true, ..WriteOptions::default() }
}

fn in_regions(files: &[PathBuf], out: &Path) -> Result<Converted> {
    convert(files, &Limits::default(), out, &options(), &lossless(), None)
}

/// Checks a file and returns the splats of its finest level, sorted.
fn leaves(path: &Path) -> Vec<Splat> {
    let report = check(path, &Limits::default());
    assert!(report.findings.is_empty(), "{:?}", report.findings);
    let mut leaves = Hierarchy::open(path, &Limits::default()).unwrap().leaves().unwrap().splats;
    sort(&mut leaves);
    leaves
}

fn sort(splats: &mut [Splat]) {
    let key = |s: &Splat| (s.center.map(f32::to_bits), s.normal, s.factor.map(f32::to_bits));
    splats.sort_by_key(key);
}

/// Converts a mesh or point cloud as a whole and in regions, and returns the leaves of both.
fn both_ways(folder: &Folder, name: &str) -> (Vec<Splat>, Vec<Splat>, Converted) {
    let path = folder.path(name);
    let mesh =
        formats::load_mesh(&path, &Limits::default(), &formats::ReadOptions::default()).unwrap();
    let set = mesh.surfels(&SurfelOptions::default()).unwrap();
    let whole = folder.path("whole.splk");
    let build = BuildOptions { preset: hierarchy::Preset::Fastest, ..BuildOptions::default() };
    hierarchy::build_file(&set, &whole, &build, &lossless(), None).unwrap();
    let parts = folder.path("parts.splk");
    let converted = in_regions(&[path], &parts).unwrap();
    assert_eq!(converted.closed, mesh.is_solid(), "{name}");
    assert_eq!(converted.points, mesh.positions.len() as u64, "{name}");
    let header = |path: &Path| Hierarchy::open(path, &Limits::default()).unwrap().header().clone();
    let (one, other) = (header(&whole), header(&parts));
    assert_eq!((one.origin, one.has_color), (other.origin, other.has_color), "{name}");
    assert!((one.bounds.min - other.bounds.min).length() < 0.03 * one.bounds.diagonal(), "{name}");
    (leaves(&whole), leaves(&parts), converted)
}

/// A binary PLY file of floats or doubles, in either byte order.
fn ply(mesh: &Mesh, big: bool, double: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let kind = if double { "double" } else { "float" };
    let mut out =
        format!("ply\nformat binary_{order}_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    for axis in ["x", "y", "z"] {
        out += &format!("property {kind} {axis}\n");
    }
    if !mesh.colors.is_empty() {
        out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    }
    if !mesh.triangles.is_empty() {
        out += &format!(
            "element face {}\nproperty list uchar int vertex_indices\n",
            mesh.triangles.len()
        );
    }
    let mut out = (out + "end_header\n").into_bytes();
    let ordered = |mut bytes: Vec<u8>| {
        if big {
            bytes.reverse();
        }
        bytes
    };
    for (index, position) in mesh.positions.iter().enumerate() {
        for value in (mesh.origin + position.as_dvec3()).to_array() {
            let bytes = if double {
                value.to_le_bytes().to_vec()
            } else {
                (value as f32).to_le_bytes().to_vec()
            };
            out.extend(ordered(bytes));
        }
        out.extend(mesh.colors.get(index).map(|color| color[..3].to_vec()).unwrap_or_default());
    }
    for triangle in &mesh.triangles {
        out.push(3);
        triangle.iter().for_each(|index| out.extend(ordered(index.to_le_bytes().to_vec())));
    }
    out
}

/// A knotted tube over a grid of vertices, with colours and without normals. Small displacements
/// make it bumpy.
fn torus(along: u32, around: u32) -> Mesh {
    let mut mesh = Mesh::knot(along, around);
    mesh.normals.clear();
    for (index, position) in mesh.positions.iter_mut().enumerate() {
        *position += Vec3::splat(0.002) * ((index * 7919 % 101) as f32 / 101.0);
    }
    mesh
}

fn nearly_the_same(a: &Splat, b: &Splat) -> bool {
    let size = a.factor.iter().fold(0.0f32, |most, entry| most.max(entry.abs()));
    let normals = decode_normal(a.normal).zip(decode_normal(b.normal));
    let near =
        |a: &[f32], b: &[f32], most: f32| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most);
    near(&a.center, &b.center, 1e-3 * size)
        && near(&a.factor, &b.factor, 1e-2 * size)
        && a.color == b.color
        && normals.is_some_and(|(a, b)| a.distance(b) < 1e-3)
}

#[test]
fn meshes_have_the_same_leaves() {
    let folder = Folder::new();
    // Fine enough that no edge is subdivided.
    let shared = torus(1000, 50);
    // Long edges: a lid, and a needle.
    let mut long = shared.clone();
    let last = long.positions.len() as u32;
    long.positions.extend([
        Vec3::new(5.0, 0.0, 0.0),
        Vec3::new(5.0, 3.0, 0.2),
        Vec3::new(5.0, 0.0, 3.0),
    ]);
    long.colors.extend([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]]);
    long.triangles.extend([[last, last + 1, last + 2], [last, 100, last + 1], [0, 1, last]]);
    // Every triangle has its own vertices.
    let corners: Vec<u32> = shared.triangles.iter().flatten().copied().collect();
    let split = Mesh {
        positions: corners.iter().map(|&corner| shared.positions[corner as usize]).collect(),
        triangles: (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        ..Mesh::default()
    };
    // A vertex that no triangle uses does not count for the size of the mesh. A part that is inside
    // out is detected.
    let mut stray = shared.clone();
    stray.positions.push(Vec3::splat(2000.0));
    stray.colors.push([1, 2, 3, 255]);
    let mut turned = shared.clone();
    let second = shared.positions.len() as u32;
    turned.positions.extend(shared.positions.iter().map(|place| *place + Vec3::X * 9.0));
    turned.colors.extend(&shared.colors);
    turned
        .triangles
        .extend(shared.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|vertex| vertex + second)));
    let mut turned_split = split.clone();
    turned_split.positions.extend(split.positions.iter().map(|place| *place + Vec3::X * 9.0));
    let second = split.positions.len() as u32;
    turned_split
        .triangles
        .extend(split.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|vertex| vertex + second)));
    let mut far = shared.clone();
    far.origin = glam::DVec3::new(4_500_000.25, 5_300_000.5, 417.125);
    for (name, mesh, big, double) in [
        ("stray.ply", stray, false, false),
        ("turned.ply", turned, false, false),
        ("turned_split.ply", turned_split, false, false),
        ("shared.ply", shared, false, false),
        ("long.ply", long, true, false),
        ("split.ply", split, false, false),
        ("far.ply", far, true, true),
    ] {
        folder.write(name, ply(&mesh, big, double));
        let (whole, parts, converted) = both_ways(&folder, name);
        assert!(converted.regions > 10, "{name}: {}", converted.regions);
        assert_eq!(
            converted.closed,
            ["stray", "shared", "split", "far"].contains(&&name[..name.len() - 4]),
            "{name}"
        );
        assert_eq!(whole.len(), parts.len(), "{name}");
        if name == "long.ply" {
            // Normals on subdivided triangles are interpolated; the weights of the corners are
            // rounded.
            assert!(whole.iter().zip(&parts).all(|(a, b)| nearly_the_same(a, b)), "{name}");
        } else {
            assert!(whole == parts, "{name}");
        }
    }
    assert!(folder.names().iter().all(|name| !name.starts_with('.')), "{:?}", folder.names());
}

#[test]
fn clouds_have_nearly_the_same_leaves() {
    let folder = Folder::new();
    let mut cloud = torus(600, 60);
    cloud.triangles.clear();
    // Add points at one place, and points far from all others.
    cloud.positions.extend([Vec3::new(9.0, 9.0, 9.0), Vec3::new(-9.0, 4.0, 0.0)]);
    cloud.positions.extend([cloud.positions[77]; 3]);
    cloud.colors.resize(cloud.positions.len(), [9, 8, 7, 255]);
    folder.write("cloud.ply", ply(&cloud, false, true));
    let (whole, parts, converted) = both_ways(&folder, "cloud.ply");
    assert!(converted.regions > 20, "{}", converted.regions);
    assert_eq!(whole.len(), parts.len());
    let (mut other_shapes, mut other_sides) = (0, 0);
    for (a, b) in whole.iter().zip(&parts) {
        assert_eq!((a.center, a.color, a.strength), (b.center, b.color, b.strength));
        let size = a.factor.iter().fold(0.0, |size: f32, part| size.max(part.abs()));
        let is_near = a.factor.iter().zip(b.factor).all(|(a, b)| (a - b).abs() < 1e-3 * size);
        other_shapes += u32::from(!is_near);
        let (Some(a), Some(b)) = (decode_normal(a.normal), decode_normal(b.normal)) else {
            continue;
        };
        other_sides += u32::from(a.dot(b) < 0.0);
    }
    let most = whole.len() as u32 / 100;
    assert!(
        other_shapes <= most && other_sides <= most,
        "{other_shapes} shapes and {other_sides} sides differ; {most} may"
    );
}

/// The width of points in sparse parts is limited to a multiple of the median width. Regions know
/// the median of the whole, so their points are as wide.
#[test]
fn uneven_clouds_are_as_wide() {
    let folder = Folder::new();
    let shifted = |i: u32, edge: u32, step: f32| {
        let jitter = |salt: u32| (i.wrapping_mul(salt) >> 16 & 255) as f32 / 255.0 - 0.5;
        let [x, y] =
            [(i % edge) as f32 + jitter(2_654_435_761), (i / edge) as f32 + jitter(2_246_822_519)];
        Vec3::new(x, y, 0.3 * jitter(3_266_489_917)) * step
    };
    let mut cloud =
        Mesh { positions: (0..40_000).map(|i| shifted(i, 200, 0.01)).collect(), ..Mesh::default() };
    cloud.positions.extend((0..400).map(|i| shifted(i, 20, 1.0) + Vec3::new(5.0, 5.0, 0.0)));
    folder.write("cloud.ply", ply(&cloud, false, false));
    let (whole, parts, converted) = both_ways(&folder, "cloud.ply");
    assert!(converted.regions > 10 && whole.len() == parts.len());
    let coarse = |splats: &[Splat]| {
        let is_coarse = |splat: &&Splat| splat.center[0] > 4.0;
        let widths = splats.iter().filter(is_coarse).map(|splat| f64::from(splat.factor[0]));
        widths.sum::<f64>()
    };
    let ratio = coarse(&parts) / coarse(&whole);
    assert!((0.9..1.1).contains(&ratio), "{ratio} times as wide if converted in regions");
}

#[test]
fn crowded_clouds_are_cut_too() {
    let folder = Folder::new();
    let mut cloud = Mesh { positions: vec![Vec3::ONE; 20_000], ..Mesh::default() };
    cloud
        .positions
        .extend((0..5000).map(|i| Vec3::new((i % 50) as f32, (i / 50) as f32, 0.0) * 1e-5));
    cloud.positions.push(Vec3::splat(100.0));
    folder.write("cloud.ply", ply(&cloud, false, false));
    let (whole, parts, converted) = both_ways(&folder, "cloud.ply");
    assert!(converted.regions > 5);
    assert_eq!(whole.len(), parts.len());
    assert!(whole.iter().zip(&parts).all(|(a, b)| a.center == b.center));
}

/// If the bounds are so large that the points cannot be separated, the error names the file and the
/// cause.
#[test]
fn points_far_off_are_told() {
    let folder = Folder::new();
    let positions = (0..20_000).map(|i| Vec3::new((i % 200) as f32, (i / 200) as f32, 0.0) * 1e-7);
    let far = [Vec3::splat(100.0), Vec3::splat(-100.0)];
    let cloud = Mesh { positions: positions.chain(far).collect(), ..Mesh::default() };
    folder.write("cloud.ply", ply(&cloud, false, false));
    let out = folder.path("out.splk");
    let error = in_regions(&[folder.path("cloud.ply")], &out).unwrap_err().to_string();
    assert!(error.contains("cloud.ply: points: more than 8192 points lie within"), "{error}");
    assert!(!out.exists());
}

#[test]
fn several_files_become_one() {
    let folder = Folder::new();
    let near = torus(100, 30);
    let mut far = near.clone();
    far.origin = glam::DVec3::new(10.0, 20.0, 30.0);
    folder.write("a.ply", ply(&near, false, true));
    folder.write("b.ply", ply(&far, false, true));
    let out = folder.path("out.splk");
    let converted = in_regions(&[folder.path("a.ply"), folder.path("b.ply")], &out).unwrap();
    assert_eq!((converted.points, converted.closed), (6000, near.is_solid()));
    assert_eq!(leaves(&out).len() as u64, converted.splats);
    let bounds = Hierarchy::open(&out, &Limits::default()).unwrap().header().bounds;
    assert!(bounds.max.z > 29.0 && bounds.min.z < 0.0, "{bounds:?}");
}

/// Conversion in regions finds whether all parts face outward, like conversion as a whole. That
/// includes parts that share only a vertex. If memory does not suffice to separate the parts, the
/// mesh counts as not solid.
#[test]
fn solid_parts_are_those_of_the_whole() {
    let folder = Folder::new();
    let tetrahedra = |count: u32, turned: u32| {
        let mut mesh = Mesh::default();
        for i in 0..count {
            // In rows: the first corner of each tetrahedron is the last corner of the one before.
            let place = Vec3::new((i % 400) as f32, (i / 400) as f32 * 2.0, 0.0);
            let first = mesh.positions.len() as u32;
            let [a, b, c, d] = if i % 400 == 0 {
                mesh.positions.push(place);
                [first, first + 1, first + 2, first + 3]
            } else {
                [first - 1, first, first + 1, first + 2]
            };
            mesh.positions.extend([Vec3::Y, Vec3::Z, Vec3::X].map(|side| place + side));
            mesh.triangles.extend([[a, b, c], [a, c, d], [b, d, c], [a, d, b]].map(|[p, q, r]| {
                match i == turned {
                    true => [p, q, r],
                    false => [q, p, r],
                }
            }));
        }
        mesh
    };
    for (mesh, is_solid) in [(tetrahedra(1000, u32::MAX), true), (tetrahedra(1000, 500), false)] {
        folder.write("a.ply", ply(&mesh, false, false));
        let (whole, parts, converted) = both_ways(&folder, "a.ply");
        assert!(converted.regions > 1 && whole.len() == parts.len());
        assert_eq!((mesh.is_closed(), converted.closed), (true, is_solid));
    }
}

#[test]
fn what_is_damaged_leaves_nothing() {
    let folder = Folder::new();
    let mesh = torus(200, 40);
    let whole = ply(&mesh, false, false);
    let at = |from: usize, bytes: &[u8]| {
        let mut damaged = whole.clone();
        damaged[from..from + bytes.len()].copy_from_slice(bytes);
        damaged
    };
    let last_face = whole.len() - 13;
    let first_vertex = whole.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    // A face that is not checked in advance.
    let polygon = at(last_face - 5 * 13, &[4]);
    let lost = at(last_face + 1, &u32::MAX.to_le_bytes());
    let endless = at(first_vertex + 15 * 4000, &f32::NAN.to_le_bytes());
    for (bytes, message) in [
        (whole[..last_face - 5].to_vec(), "the file ends"),
        (whole[..first_vertex + 1000].to_vec(), "the file ends"),
        (polygon, "has 4 corners"),
        (lost, "refers to vertex 4294967295"),
    ] {
        folder.write("a.ply", bytes);
        let error =
            in_regions(&[folder.path("a.ply")], &folder.path("out.splk")).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
        assert_eq!(folder.names(), ["a.ply"]);
    }
    // A vertex that is not at finite coordinates is left out, with its faces.
    folder.write("a.ply", endless);
    in_regions(&[folder.path("a.ply")], &folder.path("out.splk")).unwrap();
}

/// A LAS file of 3000 points, one of which is withheld.
fn las(colored: bool) -> Vec<u8> {
    let count = 3000u32;
    let record = |i: u32| {
        let mut record = vec![0; 26];
        let place = [i % 60 * 1001, i / 60 * 1003, i % 7];
        for (axis, value) in place.iter().enumerate() {
            record[4 * axis..4 * axis + 4].copy_from_slice(&value.to_le_bytes());
        }
        record[12..14].copy_from_slice(&(i as u16).to_le_bytes());
        record[15] = if i == 1234 { 0x80 } else { 0 };
        record[20..22].copy_from_slice(&((i * 20) as u16).to_le_bytes());
        record
    };
    let mut las = vec![0; 227];
    las[..4].copy_from_slice(b"LASF");
    las[24..26].copy_from_slice(&[1, 2]);
    las[94..96].copy_from_slice(&227u16.to_le_bytes());
    las[96..100].copy_from_slice(&227u32.to_le_bytes());
    las[104] = if colored { 2 } else { 0 };
    las[105..107].copy_from_slice(&26u16.to_le_bytes());
    las[107..111].copy_from_slice(&count.to_le_bytes());
    for (at, value) in
        [(131, 0.001), (139, 0.001), (147, 0.001), (155, 4.5e6), (163, 5.3e6), (171, 400.0)]
    {
        las[at..at + 8].copy_from_slice(&f64::to_le_bytes(value));
    }
    las.extend((0..count).flat_map(record));
    las
}

#[test]
fn points_of_surveys_keep_their_millimetres_and_colours() {
    let folder = Folder::new();
    for colored in [true, false] {
        folder.write("a.las", las(colored));
        let (whole, parts, converted) = both_ways(&folder, "a.las");
        assert!(converted.regions > 2 && converted.points == 2999);
        let same = |(a, b): (&Splat, &Splat)| (a.center, a.color) == (b.center, b.color);
        assert!(whole.len() == parts.len() && whole.iter().zip(&parts).all(same));
    }
}

/// Converts a file as a whole and in regions, painted, and compares the leaves.
fn painted_both_ways(folder: &Folder, name: &str, paint: &Paint, scalar: &str) -> Vec<Splat> {
    let path = folder.path(name);
    let options =
        ExternalOptions { paint: Some(paint.clone()), scalar: Some(scalar.into()), ..options() };
    let read = formats::ReadOptions::scalar(Some(scalar));
    let mut mesh = formats::load_mesh(&path, &Limits::default(), &read).unwrap();
    mesh.paint(paint).unwrap();
    let set = mesh.surfels(&options.surfels).unwrap();
    let whole = folder.path("whole.splk");
    let build = BuildOptions { preset: hierarchy::Preset::Fastest, ..BuildOptions::default() };
    hierarchy::build_file(&set, &whole, &build, &lossless(), None).unwrap();
    let parts = folder.path("parts.splk");
    let converted =
        convert(&[path], &Limits::default(), &parts, &options, &lossless(), None).unwrap();
    assert!(converted.regions > 1 && converted.closed == mesh.is_solid(), "{name}");
    let (whole, parts) = (leaves(&whole), leaves(&parts));
    assert_eq!(whole.len(), parts.len(), "{name}");
    let mut wrong = whole.iter().zip(&parts).filter(|(a, b)| a.color != b.color);
    assert!(wrong.next().is_none(), "{name}: {paint:?}");
    whole
}

#[test]
fn paints_are_the_same_in_regions() {
    let folder = Folder::new();
    let mesh = torus(300, 30);
    folder.write("mesh.ply", ply(&mesh, true, false));
    folder.write("cloud.ply", ply(&Mesh { triangles: Vec::new(), ..mesh }, false, true));
    let scale = ColorScale::new(ColorMap::named("turbo").unwrap());
    let values = |of, spread| Paint::Values { of, scale, spread };
    let height = Values::Height(glam::DVec3::Y);
    let fixed = ColorScale { range: [0.0, 255.0], ..scale };
    let fixed = Paint::Values { of: Values::Own, scale: fixed, spread: None };
    for (name, paint) in [
        ("mesh.ply", values(Values::Own, Some(Spread::Full))),
        ("cloud.ply", values(Values::Own, Some(Spread::Percentiles))),
        ("cloud.ply", values(height, Some(Spread::Percentiles))),
        ("mesh.ply", fixed),
        ("mesh.ply", Paint::Plain([1.0, 0.5, 0.0])),
    ] {
        let splats = painted_both_ways(&folder, name, &paint, "red");
        let colors: std::collections::HashSet<u32> = splats.iter().map(|s| s.color).collect();
        assert_eq!(colors.len() == 1, matches!(paint, Paint::Plain(_)), "{name}");
        assert!(colors.iter().all(|color| color >> 24 == 255), "{name}");
    }
    // A property that is not there is named, with those that are.
    let paint = values(Values::Own, Some(Spread::Full));
    let options = ExternalOptions { paint: Some(paint), scalar: Some("heat".into()), ..options() };
    let (files, out) = ([folder.path("mesh.ply")], folder.path("none.splk"));
    let error = convert(&files, &Limits::default(), &out, &options, &lossless(), None);
    let message = error.unwrap_err().to_string();
    assert!(message.contains("no array “heat”"), "{message}");
}

/// Plans a conversion in parts, and makes those in `order`.
fn in_parts(folder: &Folder, files: &[PathBuf], options: &ExternalOptions, order: &[u32]) -> Plan {
    let parts = folder.path("parts");
    let plan = Plan::make(files, &parts, &Limits::default(), options, &lossless(), None).unwrap();
    for &index in order {
        plan.part(index, &Limits::default(), None).unwrap();
    }
    plan
}

/// The join of parts, made in any order, is the file of the conversion by one program. So it is for
/// clouds and meshes, with long triangles too, for several files, and for all sources of colours.
#[test]
fn parts_become_the_same_file() {
    let folder = Folder::new();
    let mut cloud = torus(350, 30);
    cloud.triangles.clear();
    let mut mesh = torus(200, 30);
    let last = mesh.positions.len() as u32;
    mesh.positions.extend([Vec3::X * 5.0, Vec3::new(5.0, 3.0, 0.2), Vec3::new(5.0, 0.0, 3.0)]);
    mesh.colors.resize(mesh.positions.len(), [9, 8, 7, 255]);
    mesh.triangles.push([last, last + 1, last + 2]);
    folder.write("cloud.ply", ply(&cloud, false, true));
    folder.write("mesh.ply", ply(&mesh, true, false));
    folder.write("colors.las", las(true));
    folder.write("greys.las", las(false));
    let [cloud, mesh, colors, greys] =
        ["cloud.ply", "mesh.ply", "colors.las", "greys.las"].map(|name| folder.path(name));
    for (files, parts) in [
        (vec![cloud.clone()], Some(3)),
        (vec![cloud.clone()], None),
        (vec![mesh.clone()], Some(4)),
        (vec![mesh, cloud], Some(5)),
        (vec![colors, greys], Some(3)),
    ] {
        let options = ExternalOptions { parts, ..options() };
        let one = folder.path("one.splk");
        let converted =
            convert(&files, &Limits::default(), &one, &options, &lossless(), None).unwrap();
        assert!(converted.regions >= parts.unwrap_or(10) as usize, "{converted:?}");
        leaves(&one);
        let plan = in_parts(&folder, &files, &options, &[]);
        assert_eq!(plan.parts(), parts.unwrap_or(converted.regions as u32));
        let text = std::fs::read(plan.path()).unwrap();
        let made = |index: u32| {
            plan.part(index, &Limits::default(), None).unwrap();
            std::fs::read(plan.part_path(index)).unwrap()
        };
        let order: Vec<u32> = (0..plan.parts()).rev().collect();
        let all: Vec<Vec<u8>> = order.iter().map(|&index| made(index)).collect();
        let joined = folder.path("joined.splk");
        assert_eq!(plan.join(&joined, None).unwrap(), converted);
        assert!(std::fs::read(&one).unwrap() == std::fs::read(&joined).unwrap(), "{parts:?}");
        // Again, in another order, by another program: the plan and the parts have the same bytes.
        for &index in &order {
            assert!(plan.part(index, &Limits::default(), None).unwrap().was_finished);
            std::fs::remove_file(plan.part_path(index)).unwrap();
        }
        let again = in_parts(&folder, &files, &options, &[]);
        assert!(text == std::fs::read(again.path()).unwrap());
        for (&index, before) in order.iter().zip(&all).rev() {
            let done = again.part(index, &Limits::default(), None).unwrap();
            assert!(!done.was_finished && done.bytes == before.len() as u64);
            assert!(std::fs::read(again.part_path(index)).unwrap() == *before, "part {index}");
        }
        std::fs::remove_dir_all(folder.path("parts")).unwrap();
    }
}

/// The range of a colour map is found once, for all parts.
#[test]
fn painted_parts_become_the_same_file() {
    let folder = Folder::new();
    let cloud = Mesh { triangles: Vec::new(), ..torus(300, 30) };
    let files = [folder.write("cloud.ply", ply(&cloud, false, true))];
    let scale = ColorScale::new(ColorMap::named("turbo_r").unwrap());
    let spread = Some(Spread::Percentiles);
    for (of, scale) in [
        (Values::Own, scale),
        (Values::Height(glam::DVec3::Y), ColorScale { map: ColorMap::CLASSES, ..scale }),
    ] {
        let paint = Some(Paint::Values { of, scale, spread });
        let scalar = Some("red".into());
        let options = ExternalOptions { paint, scalar, parts: Some(3), ..options() };
        let [one, joined] = ["one.splk", "joined.splk"].map(|name| folder.path(name));
        convert(&files, &Limits::default(), &one, &options, &lossless(), None).unwrap();
        in_parts(&folder, &files, &options, &[1, 0, 2]).join(&joined, None).unwrap();
        assert!(std::fs::read(&one).unwrap() == std::fs::read(&joined).unwrap(), "{of:?}");
    }
}

/// Every bit of a part is checked: in its header, its pages and its description.
#[test]
fn parts_that_are_missing_or_damaged_are_named() {
    let folder = Folder::new();
    let mut cloud = torus(300, 30);
    cloud.triangles.clear();
    folder.write("cloud.ply", ply(&cloud, false, true));
    let options = ExternalOptions { parts: Some(3), ..options() };
    let plan = in_parts(&folder, &[folder.path("cloud.ply")], &options, &[0, 1, 2]);
    let out = folder.path("out.splk");
    let refused = |index: u32, message: &str| {
        let error = plan.join(&out, None).unwrap_err();
        let splatkit::Error::Input { hint: Some(hint), .. } = &error else { panic!("{error}") };
        let text = error.to_string();
        assert!(text.contains(&format!("part {index} of 3: {message}")), "{text}");
        assert!(hint.contains(&plan.part_command(index)), "{hint}");
        assert!(!out.exists());
    };
    let path = plan.part_path(1);
    let whole = std::fs::read(&path).unwrap();
    for at in (0..whole.len()).step_by(whole.len() / 50) {
        let mut damaged = whole.clone();
        damaged[at] ^= 4;
        std::fs::write(&path, &damaged).unwrap();
        refused(1, "");
        if at % 7 == 0 {
            assert!(!plan.part(1, &Limits::default(), None).unwrap().was_finished);
            assert!(std::fs::read(&path).unwrap() == whole, "byte {at}");
        }
    }
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    refused(1, "is cut or damaged");
    // The part of another number is not taken for this one.
    std::fs::copy(plan.part_path(0), &path).unwrap();
    refused(1, "belongs to another plan or part");
    std::fs::remove_file(&path).unwrap();
    refused(1, "is missing");
    std::fs::remove_file(plan.part_path(2)).unwrap();
    refused(1, "is missing, and 1 more parts are missing or damaged");
    plan.part(2, &Limits::default(), None).unwrap();
    plan.part(1, &Limits::default(), None).unwrap();
    plan.join(&out, None).unwrap();
    leaves(&out);
}

#[test]
fn plans_and_inputs_that_changed_are_refused() {
    let folder = Folder::new();
    let mut cloud = torus(200, 30);
    cloud.triangles.clear();
    let bytes = ply(&cloud, false, true);
    let input = folder.write("cloud.ply", &bytes);
    let options = ExternalOptions { parts: Some(2), ..options() };
    let plan = in_parts(&folder, std::slice::from_ref(&input), &options, &[]);
    let fails = |plan: &Plan, message: &str| {
        let error = plan.part(0, &Limits::default(), None).unwrap_err();
        let splatkit::Error::Input { hint: Some(hint), .. } = &error else { panic!("{error}") };
        assert!(error.to_string().contains(message), "{error}");
        assert!(hint.contains("make the plan again"), "{hint}");
        assert!(!plan.part_path(0).exists());
    };
    let mut changed = bytes.clone();
    *changed.last_mut().unwrap() ^= 1;
    std::fs::write(&input, &changed).unwrap();
    fails(&plan, "cloud.ply: file: has changed since the plan was made");
    std::fs::write(&input, &bytes[..bytes.len() - 1]).unwrap();
    fails(&plan, "when the plan was made");
    std::fs::write(&input, &bytes).unwrap();
    let error = plan.part(2, &Limits::default(), None).unwrap_err().to_string();
    assert!(error.contains("there is no part 2; the 2 parts are numbered from 0"), "{error}");
    let tables = folder.path("parts").join("plan.tables");
    let whole = std::fs::read(&tables).unwrap();
    std::fs::write(&tables, &whole[1..]).unwrap();
    fails(&plan, "not those of the plan, or damaged");
    std::fs::write(&tables, &whole).unwrap();
    let text = std::fs::read_to_string(plan.path()).unwrap();
    for (from, to, message) in [
        ("\"preset\": \"Fastest\"", "\"preset\": \"Best\"", "does not match its hash"),
        ("\"program\": \"splatkit", "\"program\": \"splatkit 7", "was made by splatkit 7"),
        ("{", "[", "plan:"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(plan.path(), text.replacen(from, to, 1)).unwrap();
        let error = Plan::open(plan.path()).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
    std::fs::write(plan.path(), &text).unwrap();
    Plan::open(plan.path()).unwrap().part(0, &Limits::default(), None).unwrap();
}
