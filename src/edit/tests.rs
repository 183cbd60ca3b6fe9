//! Edits of all kinds of scenes, in memory and in pieces.

use super::*;
use crate::{
    formats::{Attribute, NumberType, PointLayout, Records, Stream, write_points},
    gaussians::{Gaussians, harmonics},
    hierarchy::{BuildOptions, Tree},
    input::{Limits, testing::Folder},
    splat::Surfels,
    surface::Mesh,
};
use std::path::Path;

fn edits(all: &[(&str, &str)]) -> Vec<Edit> {
    all.iter().map(|(name, value)| Edit::parse(name, value).expect("an edit")).collect()
}

fn phantom(count: usize, degree: u32) -> Gaussians {
    let mut set = crate::gaussians::phantom(count);
    set.set_degree(degree);
    set
}

/// Points of a bumpy sheet, far from the origin, with two attributes.
fn sheet(side: usize) -> Records {
    let mut records = Records {
        attributes: vec![
            Attribute { name: "classification".into(), kind: NumberType::U8 },
            Attribute { name: "odd one".into(), kind: NumberType::F64 },
        ],
        columns: vec![Vec::new(); 2],
        ..Records::default()
    };
    for index in 0..side * side {
        let (u, v) = ((index % side) as f64 / 64.0, (index / side) as f64 / 64.0);
        records.positions.push(DVec3::new(4e5 + u, 5e6 + v, (4.0 * u).sin() * 0.25));
        records.colors.push([(index % 251) as u8, 7, 9, 255]);
        records.columns[0].push((index % 7) as f64);
        records.columns[1].push(index as f64 / 3.0);
    }
    records
}

fn layout(records: &Records) -> PointLayout {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let around = |[low, high]: [DVec3; 2], at: &DVec3| [low.min(*at), high.max(*at)];
    PointLayout {
        attributes: records.attributes.clone(),
        has_normals: !records.normals.is_empty(),
        has_colors: !records.colors.is_empty(),
        bounds: records.positions.iter().fold(none, around),
        ..PointLayout::default()
    }
}

fn write(path: &Path, records: &Records) {
    let mut writer = write_points(path, layout(records)).unwrap();
    writer.put(records).unwrap();
    assert_eq!(writer.finish().unwrap(), records.count() as u64);
}

/// Returns what is left of the points of files, and what the edits did.
fn pass(paths: &[&Path], edits: &[Edit], memory: u64) -> Result<(Records, Vec<Change>)> {
    let limits = Limits::default();
    let streams = paths.iter().map(|path| Stream::open(*path, &limits).unwrap().unwrap()).collect();
    let context = Context { memory, ..Context::default() };
    let pass = Pass::new(streams, edits, context, None, None)?;
    let mut all = Records::default();
    let changes = pass.run(|records| {
        all.join(records);
        Ok(())
    })?;
    Ok((all, changes))
}

#[test]
fn pieces_give_what_the_whole_gives() {
    let folder = Folder::new();
    let whole = sheet(400);
    for name in ["a.las", "a.laz", "a.points.ply"] {
        let path = folder.path(name);
        write(&path, &whole);
        let (read, _) = pass(&[&path], &[], u64::MAX).unwrap();
        let farthest = |at: usize| (read.positions[at] - whole.positions[at]).length();
        assert_eq!(read.count(), whole.count(), "{name}");
        let classes = read.column("classification").expect("classes");
        assert!(classes == whole.columns[0], "{name}: other classes");
        assert!((0..whole.count()).all(|at| farthest(at) < 1e-6), "{name}");
        assert_eq!(read.column("odd one").or(read.column("odd_one")).unwrap(), whole.columns[1]);
        for all in [
            &[("crop", "400001,5000001,-9,400004,5000003,9"), ("where", "classification != 3")][..],
            &[("thin", "0.1"), ("translate", "1,2,3"), ("where", "x < 400005")],
            &[("where", "red > 100"), ("thin", "5000pts"), ("crop", "sphere:400003,5000003,0,2")],
            &[("rotate", "z:90"), ("scale", "2"), ("thin", "20%")],
            &[("thin", "0.2"), ("remove-floaters", ""), ("keep-cluster", "1"), ("normals", "")],
        ] {
            let edits = edits(all);
            let mut in_memory = read.clone();
            let changes = apply(&mut in_memory, &edits, &Context::default()).unwrap();
            let (in_pieces, same) = pass(&[&path], &edits, u64::MAX).unwrap();
            // Places around other origins are rounded otherwise, and discs follow.
            let is_near = |a: u64, b: u64| a.abs_diff(b) <= a / 100;
            for (one, other) in changes.iter().zip(&same) {
                assert_eq!((one.edit, changes.len()), (other.edit, same.len()));
                assert!(is_near(one.after, other.after), "{name} {all:?}: {one:?} {other:?}");
            }
            assert_eq!(in_pieces.count() as u64, same.last().unwrap().after);
            assert!(in_pieces.count() > 0 && in_pieces.count() < whole.count());
            assert_eq!(in_pieces.normals.len(), if all.len() == 4 { in_pieces.count() } else { 0 });
        }
    }
}

/// LAS has colours of 16 bits, which are attributes, and PLY has a place for colours.
#[test]
fn colours_are_written_once() {
    let folder = Folder::new();
    let (from, to) = (folder.path("a.laz"), folder.path("a.points.ply"));
    write(&from, &sheet(20));
    let (read, _) = pass(&[&from], &[], u64::MAX).unwrap();
    write(&to, &read);
    let bytes = std::fs::read(&to).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let (header, _) = text.split_once("end_header").unwrap();
    let properties = header.lines().filter_map(|line| line.strip_prefix("property "));
    let mut names: Vec<&str> = properties.filter_map(|line| line.split(' ').nth(1)).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert!(names.contains(&"red") && names.len() == count, "{header}");
    let (again, _) = pass(&[&to], &[], u64::MAX).unwrap();
    assert_eq!(again.colors, read.colors);
}

#[test]
fn files_are_merged_and_counts_hold_for_all() {
    let folder = Folder::new();
    let (a, b) = (folder.path("a.laz"), folder.path("b.points.ply"));
    write(&a, &sheet(100));
    let mut moved = sheet(100);
    moved.move_by(&Motion::translation(DVec3::X * 100.0));
    moved.attributes[1].name = "other".into();
    write(&b, &moved);
    let (read, changes) = pass(&[&a, &b], &edits(&[("thin", "999pts")]), u64::MAX).unwrap();
    assert_eq!((read.count(), changes[0].before, changes[0].after), (999, 20_000, 999));
    let far = read.positions.iter().filter(|place| place.x > 4e5 + 50.0).count();
    assert!((450..550).contains(&far), "{far}");
}

#[test]
fn what_does_not_fit_and_what_is_empty_are_named() {
    let folder = Folder::new();
    let path = folder.path("a.las");
    write(&path, &sheet(100));
    let failure = |all: &[(&str, &str)], memory: u64| {
        let error = pass(&[&path], &edits(all), memory).unwrap_err();
        match error {
            Error::Input { place, message, hint, .. } => format!("{place}: {message} {hint:?}"),
            error => error.to_string(),
        }
    };
    for (all, memory, words) in [
        (&[("thin", "10%")][..], 1000, ["--thin", "--memory"]),
        (&[("remove-floaters", "")], 400_000, ["--remove-floaters", "--thin before"]),
        (&[("where", "x < 0")], u64::MAX, ["--where", "none of 10000"]),
        (&[("where", "x < 0"), ("thin", "10%")], u64::MAX, ["--thin", "nothing"]),
        (&[("where", "z < 9 && colour > 1")], u64::MAX, ["column 10", "classification"]),
    ] {
        let message = failure(all, memory);
        assert!(words.iter().all(|word| message.contains(word)), "{all:?}: {message}");
    }
    // A distance needs only what it keeps.
    assert!(pass(&[&path], &edits(&[("thin", "0.5")]), 1000).is_ok());
}

#[test]
fn gaussians_turn_with_their_colours() {
    let before = phantom(2000, 3);
    let mut after = before.clone();
    let motion = Motion::matrix([
        0.0, -2.0, 0.0, 1.0, //
        2.0, 0.0, 0.0, 2.0, //
        0.0, 0.0, 2.0, 3.0, //
        0.0, 0.0, 0.0, 1.0,
    ])
    .unwrap();
    let turn = motion.turn();
    apply(&mut after, &[Edit::Move(motion)], &Context::default()).unwrap();
    assert_eq!((after.validate(), after.about.orientation), (Ok(()), before.about.orientation));
    for index in [0, 700, 1999] {
        assert!((after.place(index) - motion.place(before.place(index))).length() < 1e-5);
        let wanted = motion.linear() * before.axes(index).as_dmat3();
        let miss = |set: &Gaussians| {
            let axes = set.axes(index).as_dmat3();
            axes * axes.transpose() - wanted * wanted.transpose()
        };
        assert!(miss(&after).to_cols_array().iter().all(|part| part.abs() < 1e-5));
        for direction in [DVec3::X, DVec3::new(0.6, 0.0, 0.8)] {
            let seen = |set: &Gaussians, from: DVec3| {
                harmonics::color(set.degree, set.harmonics_of(index), from.as_vec3())
            };
            let [old, new] = [seen(&before, direction), seen(&after, turn * direction)];
            assert!(old.iter().zip(new).all(|(a, b)| (a - b).abs() < 1e-4), "{old:?} {new:?}");
        }
    }
    // A shear has no turn of its own; what it makes is still valid.
    let rows = [1.0, 0.7, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let sheared = Motion::matrix(rows).unwrap();
    let axes = sheared.linear() * before.axes(5).as_dmat3();
    let mut after = before;
    apply(&mut after, &[Edit::Move(sheared)], &Context::default()).unwrap();
    assert_eq!(after.validate(), Ok(()));
    let made = after.axes(5).as_dmat3();
    let miss = made * made.transpose() - axes * axes.transpose();
    assert!(miss.to_cols_array().iter().all(|part| part.abs() < 1e-5));
}

/// Two interleaved lattices of two colours, far from another two.
fn two_colors() -> Gaussians {
    let count = 2000;
    let place = |i: usize| {
        let at = Vec3::new((i % 20) as f32, (i / 20 % 50) as f32, 0.0)
            + Vec3::X * 1e4 * (i / 1000) as f32;
        at * 0.5
    };
    let color = |i: usize| {
        if (i / 2 + i / 20).is_multiple_of(2) { [1.5, -1.5, 0.0] } else { [-1.5, 0.0, 1.5] }
    };
    Gaussians {
        centers: (0..count).map(place).collect(),
        scales: vec![Vec3::new(0.3, 0.3, 0.05); count],
        rotations: vec![glam::Quat::IDENTITY; count],
        opacities: vec![0.8; count],
        degree: 0,
        harmonics: (0..count).map(color).collect(),
        ..Gaussians::default()
    }
}

#[test]
fn what_looks_alike_is_merged_first() {
    let mut half = two_colors();
    apply(&mut half, &edits(&[("thin", "50%")]), &Context::default()).unwrap();
    assert_eq!(half.len(), 1000);
    // All squares of two by one still have their colour, and are as wide as those two.
    assert!(half.harmonics.iter().all(|color| (color[0].abs() - 1.5).abs() < 1e-3));
    assert!(half.scales.iter().all(|scales| scales.max_element() < 0.5));
    // Both parts are merged to the end, and at last with each other.
    for count in [2, 1] {
        let mut few = two_colors();
        apply(&mut few, &edits(&[("thin", &format!("{count}pts"))]), &Context::default()).unwrap();
        assert_eq!((few.len(), few.validate()), (count, Ok(())));
        let is_far = few.scales.iter().any(|scales| scales.max_element() > 1e3);
        assert_eq!(is_far, count == 1, "{:?}", few.scales);
    }
    // A distance bounds the widths of what is merged.
    let mut narrow = two_colors();
    apply(&mut narrow, &edits(&[("thin", "2")]), &Context::default()).unwrap();
    let widest = narrow.scales.iter().map(|scales| scales.max_element()).fold(0.0, f32::max);
    assert!((0.4..0.85).contains(&widest) && narrow.len() < 1000, "{widest} {}", narrow.len());
}

#[test]
fn gaussians_are_merged_to_a_count() {
    let set = phantom(5000, 1);
    for (thin, count) in [("10%", 500), ("2500pts", 2500), ("1e-9", 5000), ("6000pts", 5000)] {
        let mut fewer = set.clone();
        apply(&mut fewer, &edits(&[("thin", thin)]), &Context::default()).unwrap();
        assert_eq!((fewer.len(), fewer.validate(), fewer.degree), (count, Ok(()), 1), "{thin}");
        // They still fill the same space.
        let [one, other] = [set.bounds(), fewer.bounds()].map(|bounds| bounds.max - bounds.min);
        assert!(((one - other).abs() / one).max_element() < 0.25, "{thin}: {one} {other}");
    }
    let mut few = set.clone();
    apply(&mut few, &edits(&[("where", "opacity > 0.5 && scale < 1")]), &Context::default())
        .unwrap();
    assert!(few.opacities.iter().all(|opacity| *opacity > 0.5) && few.len() < set.len());
    assert_eq!(few.harmonics.len(), 4 * few.len());
}

#[test]
fn splats_of_hierarchies_are_edited() {
    let set = Mesh::sphere(4).surfels(&Default::default()).unwrap();
    let all = edits(&[("where", "z > 0 && nz > -0.1"), ("rotate", "x:90"), ("scale", "3")]);
    let mut half: Surfels = set.clone();
    apply(&mut half, &all, &Context::default()).unwrap();
    assert!(half.splats.len() < set.splats.len() * 6 / 10);
    assert!((0..half.count()).all(|index| half.place(index).y < 1e-3));
    let widths = |set: &Surfels| set.column("scale").unwrap().iter().copied().fold(0.0, f64::max);
    assert!((widths(&half) / widths(&set) - 3.0).abs() < 0.5);
    let mut fewer = set.clone();
    apply(&mut fewer, &edits(&[("thin", "25%")]), &Context::default()).unwrap();
    let left = fewer.splats.len() as f64 / set.splats.len() as f64;
    // A quarter of an odd number is rounded.
    assert!((0.2..=0.2501).contains(&left), "{left} of {}", set.splats.len());
    assert!(Tree::build(&fewer, &BuildOptions::default(), None).is_ok());
    assert!(apply(&mut fewer, &[Edit::Normals], &Context::default()).is_err());
}

#[test]
fn meshes_keep_whole_triangles() {
    let mut ball = Surface::from(Mesh::sphere(3));
    let edits = edits(&[("where", "x > 0"), ("matrix", "-1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1")]);
    apply(&mut ball, &edits, &Context::default()).unwrap();
    let mesh = &ball.mesh;
    assert!(!mesh.triangles.is_empty() && mesh.positions.iter().all(|place| place.x < 0.0));
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        // Mirrored triangles still show their outside.
        assert!((b - a).cross(c - a).dot(a) > 0.0);
    }
    ball.mesh.lines.push([0, 1]);
    let message = apply(&mut ball, &[Edit::Thin(Thin::Share(0.5))], &Context::default());
    assert!(message.unwrap_err().to_string().contains("lines are not thinned"));
}

#[test]
fn edits_are_read_by_name() {
    assert_eq!(Edit::parse("keep_cluster", " 2 "), Ok(Edit::KeepCluster(2)));
    assert_eq!(Edit::parse("scale", "2"), Ok(Edit::Move(Motion::scale(2.0))));
    for (name, value, word) in [
        ("cut", "", "only crop, where"),
        ("normals", "yes", "takes no value"),
        ("keep-cluster", "0", "above 0"),
        ("scale", "-1", "above 0"),
        ("translate", "1,2", "X,Y,Z"),
        ("rotate", "w:3", "AXIS:DEGREES"),
        ("matrix", "1,2", "16 numbers"),
        ("where", "x", "column 1"),
    ] {
        let message = Edit::parse(name, value).unwrap_err();
        assert!(message.contains(word), "{name} {value}: {message}");
    }
}

#[test]
fn scenes_do_not_move_where_64_bits_lose_them() {
    let folder = Folder::new();
    let (scan, path) = (sheet(20), folder.path("a.points.ply"));
    write(&path, &scan);
    for (by, is_kept) in [("1e6,0,0", true), ("1e20,0,0", false), ("1e39,0,0", false)] {
        let edits = edits(&[("translate", by)]);
        let message = |result: Result<Vec<Change>>| result.err().map(|error| error.to_string());
        let whole = message(apply(&mut scan.clone(), &edits, &Context::default()));
        let set = message(apply(&mut phantom(40, 0), &edits, &Context::default()));
        let pieces = message(pass(&[&path], &edits, u64::MAX).map(|(_, changes)| changes));
        for error in [whole, set, pieces] {
            let is_said = error.as_ref().is_some_and(|text| text.contains("is moved to"));
            assert_eq!((error.is_none(), is_said), (is_kept, !is_kept), "{by}: {error:?}");
        }
    }
}

#[test]
fn a_quarter_of_a_trained_scene_looks_like_the_whole() {
    use crate::{
        Device, Renderer,
        compare::compare_pictures,
        math::{Bounds, Camera},
        scene::{Scene, Settings},
    };
    let set = phantom(8000, 3);
    let bounds = Bounds::around(set.centers.iter().map(|center| center.as_dvec3()));
    let drawn = |set: &Gaussians, turn: f64| {
        let direction = DVec3::new(0.6, 0.5, 1.0);
        let mut camera = Camera::framing(&bounds, direction, DVec3::NEG_Y, 4.0 / 3.0);
        camera.azimuth(turn);
        let scene = Scene::new().with_gaussians(set.clone());
        let mut renderer = Renderer::new(&Device::Cpu, &scene).expect("a renderer");
        renderer.render(&camera, &Settings::new([160, 120])).expect("a picture").0
    };
    let mut thinned = set.clone();
    apply(&mut thinned, &edits(&[("thin", "25%")]), &Context::default()).unwrap();
    assert_eq!(thinned.len(), 2000);
    for turn in [0.0, 120.0, 240.0] {
        let compared = compare_pictures(&drawn(&set, turn), &drawn(&thinned, turn)).unwrap();
        let psnr = compared.psnr.expect("a difference");
        println!("{turn}°: {psnr:.1} dB");
        assert!(psnr >= 25.0, "{turn}°: {psnr:.1} dB");
    }
}

#[test]
fn formats_refuse_what_they_would_ruin() {
    use crate::formats::{gltf, ply, sog, splat, spz};
    type Write = fn(&Gaussians, &Path) -> Result<()>;
    let folder = Folder::new();
    let writers: [(&str, Write, bool); 7] = [
        ("a.ply", |set, path| ply::write_gaussians(set, path), false),
        ("a.compressed.ply", |set, path| ply::write_compressed_gaussians(set, path), false),
        ("a.splat", |set, path| splat::write(set, path), false),
        ("a.spz", |set, path| spz::write(set, path), false),
        ("a.sog", |set, path| sog::write(set, path), false),
        ("lod-meta.json", |set, path| sog::write_streamed(std::slice::from_ref(set), path), false),
        // Its nodes hold an origin.
        ("a.glb", |set, path| gltf::write_gaussians(set, path), true),
    ];
    let far = Gaussians { origin: DVec3::X * 1e6, ..phantom(40, 0) };
    for (name, write, holds_far) in writers {
        let path = folder.path(name);
        let error = write(&far, &path).err().map(|error| error.to_string());
        let is_said = error.as_ref().is_some_and(|text| text.contains("would round the position"));
        assert_eq!((is_said, path.exists()), (!holds_far, holds_far), "{name}: {error:?}");
        write(&phantom(40, 0), &path).unwrap();
    }
    // Steps that are far coarser than the points.
    let grid = Some([DVec3::ONE, DVec3::ZERO]);
    let positions = vec![DVec3::ZERO, DVec3::splat(9.5)];
    let records = Records { positions, ..Records::default() };
    for name in ["a.las", "a.laz", "a.e57"] {
        let layout = PointLayout { grid, ..layout(&records) };
        let mut writer = write_points(&folder.path(name), layout).unwrap();
        let error = writer.put(&records).unwrap_err().to_string();
        assert!(error.contains("would round the position"), "{name}: {error}");
    }
}
