//! Inputs of all kinds through one door.

use super::*;
use crate::{
    Deadline, Error,
    formats::{Kind, RawLayout, ReadOptions, SampleType},
    input::{
        Limits,
        testing::{Folder, warnings_of},
    },
};
use crate::{
    about::{Channel, Frame, Orientation},
    cells::{CellKind, Cells},
    math::{Bounds, Camera},
    scene::{Clip, ClipShape, Item},
    surface::{Mesh, PointStyle},
    volume::{Lattice, Samples, Volume},
};
use glam::{DMat3, DVec3, Vec3};
use std::sync::Arc;

const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const TABLE: &str = "x,y,z,value\n0,0,0,1\n1,0,0,2\n0,1,0,3\n0,0,1,nan\n";

fn raw(spacing: f64) -> ReadOptions {
    ReadOptions::raw(Some(&RawLayout {
        dims: [2, 2, 2],
        sample_type: SampleType::U8,
        spacing: DVec3::splat(spacing),
        endian: Default::default(),
        header: 0,
    }))
}

#[test]
fn each_kind_is_found_and_read() {
    let folder = Folder::new();
    let files = [
        (folder.write("a.obj", MESH.as_bytes()), Kind::Mesh, 3),
        (folder.write("b.csv", TABLE.as_bytes()), Kind::Samples, 3),
        (folder.write("c.bin", [0, 1, 2, 3, 4, 5, 6, 7]), Kind::Volume, 8),
    ];
    for (path, kind, count) in files {
        let reading = Reading::new(raw(1.0), Limits::default());
        assert_eq!(reading.kind(&path).unwrap(), kind);
        let opened = reading.open(&path).unwrap();
        assert_eq!((opened.kind(), opened.is_raw()), (kind, path.ends_with("c.bin")));
        let data = opened.read().unwrap();
        assert_eq!((data.kind(), data.count()), (kind, count), "{path:?}");
        assert_eq!(opened.files(), std::slice::from_ref(&path));
        let facts = opened.facts(&data).unwrap().to_json();
        assert_eq!(facts["bytes"], std::fs::metadata(&path).unwrap().len());
        assert_eq!(facts["count"], count);
    }
}

/// An attribute colours points, and a scalar makes samples of them.
#[test]
fn an_attribute_makes_no_samples() {
    let folder = Folder::new();
    let path = folder.write("a.csv", TABLE.as_bytes());
    let reading = Reading::default();
    assert_eq!(reading.open_colored(&path, Some("value")).unwrap().kind(), Kind::Mesh);
    let reading = Reading::new(ReadOptions::scalar(Some("value")), Limits::default());
    assert_eq!(reading.open(&path).unwrap().kind(), Kind::Samples);
}

#[test]
fn missing_values_are_told() {
    let folder = Folder::new();
    let path = folder.write("a.csv", TABLE.as_bytes());
    let (data, warnings) = warnings_of(|| Reading::default().open(&path).unwrap().read().unwrap());
    assert_eq!(data.holes(), 1);
    assert!(
        warnings.iter().any(|line| line.ends_with("1 of 4 values missing: left out")),
        "{warnings:?}"
    );
}

#[test]
fn what_is_read_whole_fits_in_memory() {
    let folder = Folder::new();
    let path = folder.write("a.obj", MESH.as_bytes());
    let reading = Reading::default().within_memory(Some(4));
    // Its kind is known all the same: a volume of any size is converted slice by slice.
    assert_eq!(reading.kind(&path).unwrap(), Kind::Mesh);
    let error = reading.open(&path).and_then(|opened| opened.read()).err().unwrap();
    assert!(matches!(error, Error::Limit { limit: 8, .. }), "{error}");
}

#[test]
fn files_of_no_kind_name_what_is_read() {
    let folder = Folder::new();
    let path = folder.write("a.doc", b"words");
    let Err(Error::Input { file, message, hint, .. }) = Reading::default().open(&path) else {
        panic!("is opened");
    };
    assert_eq!((file, message.as_str()), (path, "is in no format that can be read"));
    let hint = hint.unwrap();
    assert!(hint.contains(".nrrd") && hint.contains("--dims and --type"), "{hint}");
    assert!(Reading::default().open(&folder.path("")).is_err());
}

#[test]
fn oddities_are_found() {
    let folder = Folder::new();
    let path = folder.write("a.obj", MESH.as_bytes());
    let codes = |options, path| -> Vec<_> {
        let data = Reading::new(options, Limits::default()).open(path).unwrap().read().unwrap();
        data.oddities(Deadline::NEVER).unwrap().iter().map(|finding| finding.code).collect()
    };
    assert_eq!(codes(ReadOptions::default(), &path), ["open"]);
    let path = folder.write("c.bin", [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(codes(raw(1.0), &path), [""; 0]);
    assert_eq!(codes(raw(1e30), &path), ["out-of-sight"]);
}

/// Pictures of several views have one scale, so that one scale bar holds for all.
#[test]
fn views_have_one_scale_and_show_everything() {
    let bounds = Bounds { min: DVec3::new(-4.0, -1.0, -2.0), max: DVec3::new(4.0, 1.0, 2.0) };
    let subject = Subject::new(bounds, DVec3::Z);
    let sides = [Side::Front, Side::Left, Side::Top];
    for orthographic in [false, true] {
        let framing = Framing { orthographic, ..Framing::default() };
        let cameras = framing.views(&subject, [320, 240], &sides).unwrap();
        let pixels = |camera: &Camera| {
            let view = camera.view([320, 240]).unwrap();
            let far = view.to_view(camera.focal_point).z;
            view.scale / if view.perspective { far } else { 1.0 }
        };
        for (camera, side) in cameras.iter().zip(sides) {
            assert!((pixels(camera) / pixels(&cameras[0]) - 1.0).abs() < 1e-9, "{side:?}");
            let view = camera.view([320, 240]).unwrap();
            for corner in bounds.corners() {
                let place = view.to_view(corner);
                let share = if view.perspective { place.z } else { 1.0 };
                let at = view.center + view.scale * place.truncate() / share;
                let is_inside = at.x > 0.0 && at.x < 320.0 && at.y > 0.0 && at.y < 240.0;
                assert!(is_inside, "{side:?}: {at}");
            }
        }
        let [front, left] = [0, 1].map(|at| cameras[at].position - cameras[at].focal_point);
        assert!(front.normalize().dot(left.normalize()).abs() < 1e-6);
    }
}

/// The first statement of a file decides how a scene stands, then the convention.
#[test]
fn the_first_statement_decides() {
    let mut subject = Subject::default();
    assert_eq!(subject.orient_as_stated("a.raw", None, Orientation::SURVEY), None);
    assert_eq!((subject.orientation, subject.origin), (Orientation::SURVEY, Origin::Convention));
    assert_eq!(
        subject.orient_as_stated("b.glb", Some(Orientation::Y_UP), Orientation::SURVEY),
        None
    );
    assert_eq!((subject.orientation, subject.origin), (Orientation::Y_UP, Origin::File));
    let warning =
        subject.orient_as_stated("c.las", Some(Orientation::SURVEY), Orientation::SURVEY).unwrap();
    assert!(
        warning.starts_with("c.las says that +Z is up, but the scene stands with +Y up"),
        "{warning}"
    );
    assert_eq!(subject.orientation, Orientation::Y_UP);
    let mut mesh = crate::surface::Mesh::default();
    mesh.positions.push(glam::Vec3::Z);
    mesh.about.orientation = Some(Orientation::SURVEY);
    let warning = subject.stand_mesh("d.ply", &mut mesh).unwrap();
    assert!(warning.starts_with("d.ply is turned: it stands with +Z up"), "{warning}");
    assert!(mesh.positions[0].distance(glam::Vec3::Y) < 1e-6);
    assert_eq!(subject.frame("d.ply", Frame::Own), None);
    assert!(subject.frame("e.nii", Frame::Patient).is_some() && subject.is_patient());
}

#[test]
fn a_camera_looks_from_the_side_that_is_asked_for() {
    let cube = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };
    let subject = Subject::new(cube, DVec3::Z);
    let toward = |framing: Framing| {
        let camera = framing.camera(&subject, [64, 48]).unwrap();
        (camera.position - camera.focal_point).normalize()
    };
    let side = |view| Framing { view: Some(view), ..Framing::default() };
    let usual = [(Side::Front, DVec3::NEG_Y), (Side::Right, DVec3::X), (Side::Top, DVec3::Z)];
    for (view, direction) in usual {
        assert!(toward(side(view)).distance(direction) < 1e-9, "{view:?}");
    }
    assert!(toward(side(Side::Iso)).distance(DVec3::new(1.0, -1.0, 1.0).normalize()) < 1e-9);
    let usual = toward(Framing::default());
    assert!(usual.x > 0.4 && usual.y < -0.8 && usual.z > 0.3, "{usual}");
    // The up axis brings the front that is usual for it.
    let turned = toward(Framing { up: Some(DVec3::Y), ..side(Side::Front) });
    assert!(turned.distance(DVec3::Z) < 1e-9, "{turned}");
    let names: Vec<_> = Side::ALL.map(Side::name).to_vec();
    let written = serde_json::to_value(Side::ALL).unwrap();
    assert_eq!(written, serde_json::json!(names));
}

#[test]
fn numbers_of_a_camera_are_checked() {
    let wrong = [
        Framing { distance: Some(0.0), ..Framing::default() },
        Framing { azimuth: Some(f64::NAN), ..Framing::default() },
        Framing { view_angle: Some(180.0), ..Framing::default() },
        Framing { up: Some(DVec3::ZERO), ..Framing::default() },
    ];
    for framing in wrong {
        assert!(framing.validate().is_err(), "{framing:?}");
    }
    assert_eq!(Framing::default().validate(), Ok(()));
}

#[test]
fn values_are_shown_as_asked() {
    let volume = crate::volume::phantoms::Phantom::Specimen.sample_bytes([16; 3]).unwrap();
    let surface = Surface { value: SurfaceValue::Share(0.5), color: None, opacity: 1.0 };
    let alone = Appearance { isosurfaces: vec![surface], ..Appearance::default() };
    let transfer = alone.of_volume("a.nrrd", &volume).unwrap();
    let [low, high] = volume.range;
    assert_eq!(transfer.isosurfaces[0].value, 0.5 * (low + high));
    assert_eq!(transfer.opacity, [(0.0, 0.0)], "nothing else is shown");
    let preset = Appearance { transfer: Some(Transfer::Named("generic".into())), ..alone };
    let transfer = preset.of_volume("a.nrrd", &volume).unwrap();
    assert!(transfer.opacity.len() > 1 && transfer.isosurfaces.len() == 1);
    let coloring = Coloring { range: Some([-20.0, -10.0]), ..Coloring::default() };
    let surface = Surface { value: SurfaceValue::Own(300.0), ..surface };
    let beyond = Appearance { isosurfaces: vec![surface], coloring, ..Appearance::default() };
    let error = beyond.of_volume("a.nrrd", &volume).unwrap_err().to_string();
    assert!(error.contains("spread over the range -20, -10, the transfer function"), "{error}");
}

#[test]
fn a_surface_needs_the_values_that_colour_it() {
    let orange = SurfaceColor::Plain([1.0, 0.5, 0.0]);
    assert_eq!(SurfaceColor::of("orange", Some([1.0, 0.5, 0.0])), orange);
    assert_eq!(SurfaceColor::of("Height", None), SurfaceColor::Height);
    let heat = Coloring { surface: Some(SurfaceColor::of(" heat", None)), ..Coloring::default() };
    assert_eq!(heat.attribute(), Some("heat"));
    let mut mesh = triangle();
    let [file, caller] = [true, false].map(|is_file| Name { text: "a.ply".into(), is_file });
    let error = heat.paint(&file, &mut mesh, DVec3::Z, true).unwrap_err();
    assert!(
        matches!(&error, Error::Input { message, .. } if message.contains("“heat” is neither"))
    );
    let error = heat.paint(&caller, &mut mesh, DVec3::Z, true).unwrap_err();
    assert!(matches!(&error, Error::Argument(message) if message.contains("a.ply: “heat”")));
    assert_eq!(Coloring::default().paint(&file, &mut mesh, DVec3::Z, true).unwrap(), None);
    mesh.values = vec![1.0, 2.0, 4.0];
    let legend = heat.paint(&file, &mut mesh, DVec3::Z, true).unwrap().unwrap();
    assert_eq!(legend.scale.range, [1.0, 4.0]);
}

fn triangle() -> Mesh {
    Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    }
}

fn cube(first: f64) -> Volume {
    let lattice = Lattice::cartesian([3; 3], DVec3::splat(first), DMat3::IDENTITY);
    Volume::new(lattice, Samples::F32((0..27).map(|i| i as f32).collect())).unwrap()
}

/// Two fields without names are called as their files are, and a surface keeps its own legend.
#[test]
fn each_input_becomes_an_item_with_its_legend() {
    let mut items = Items::new(Surfaces::Both);
    let height = Coloring { surface: Some(SurfaceColor::Height), ..Coloring::default() };
    let appearance = Appearance { coloring: height, ..Appearance::default() };
    let showing = Showing { appearance, ..Showing::default() };
    let inputs = [
        ("in/a.nrrd", Data::Volume(cube(0.0))),
        ("b.ply", Data::Mesh(triangle())),
        ("c.nrrd", Data::Volume(cube(5.0))),
    ];
    for (name, data) in inputs {
        items.add(&Name::of_file(name.as_ref()), data, &showing, &|_| ()).unwrap();
    }
    let titles: Vec<(usize, String)> =
        items.captions().legends.into_iter().map(|(item, legend)| (item, legend.title)).collect();
    let wanted = [(0, "a"), (1, "height"), (2, "c")].map(|(item, name)| (item, name.to_owned()));
    assert_eq!(titles, wanted);
    let kinds: Vec<&str> = items.contents.iter().map(|content| content.kind).collect();
    assert_eq!(kinds, ["volume", "mesh", "volume"]);
    assert_eq!(items.count(), 27 + items.contents[1].count + 27);
    assert_eq!(items.subject.bounds.max, DVec3::splat(7.0));
    let [facets, surfels] = [true, false].map(|facets| items.scene(facets).unwrap());
    assert!(matches!(facets.items[1], Item::Facets(_)));
    assert!(matches!(surfels.items[1], Item::Radiance(_)));
}

/// Cells are a solid, and a field where an option shows one.
#[test]
fn cells_are_drawn_as_a_solid_or_as_a_field() {
    let mut cells = Cells::tube(CellKind::Hexahedron, 1).unwrap();
    let items_of = |cells: &Cells, showing: &Showing, surfaces: Surfaces| {
        let mut items = Items::new(surfaces);
        let name = Name::of_file("a.vtu".as_ref());
        items.add(&name, Data::Cells(cells.clone()), showing, &|_| ()).map(|()| items)
    };
    let showing = Showing { draws_edges: true, ..Showing::default() };
    let items = items_of(&cells, &showing, Surfaces::Both).unwrap();
    let [usual, other] = [true, false].map(|facets| items.scene(facets).unwrap());
    assert!(matches!(usual.items[0], Item::Solid(_)) && usual.fields().is_empty());
    assert!(matches!(other.items[0], Item::Cells(..)));
    assert_eq!(items.captions().legends[0].1.title, "density");
    let clip = ClipShape::HalfSpace { normal: DVec3::Z, offset: 0.1 };
    let clips = [Clip { shape: clip, inside: true }];
    let [all, left] = [&[][..], &clips].map(|clips| items.edges(clips)[0].len());
    assert!(left > 0 && left < all, "{left} {all}");
    assert!(Arc::ptr_eq(&items.edges(&clips)[0], &items.edges(&clips)[0]));
    // Surfels, for pictures without facets.
    let items = items_of(&cells, &showing, Surfaces::Surfels).unwrap();
    assert!(matches!(items.scene(false).unwrap().items[0], Item::Radiance(_)));
    // What shows a field asks for one.
    let surface = Surface { value: SurfaceValue::Share(0.5), color: None, opacity: 1.0 };
    let by_surface = Appearance { isosurfaces: vec![surface], ..Appearance::default() };
    let by_function =
        Appearance { transfer: Some(Transfer::Named("generic".into())), ..Appearance::default() };
    for (appearance, style) in [
        (by_surface.clone(), None),
        (by_function, None),
        (Appearance::default(), Some(CellStyle::Volume)),
    ] {
        let showing = Showing { appearance, cells: style, ..Showing::default() };
        let items = items_of(&cells, &showing, Surfaces::Facets).unwrap();
        assert!(matches!(items.scene(true).unwrap().items[0], Item::Cells(..)));
    }
    let both =
        Showing { appearance: by_surface, cells: Some(CellStyle::Solid), ..Showing::default() };
    assert!(both.validate().is_err() && CellStyle::named("haze").is_err());
    // Cells of one value, and without any.
    for values in [vec![3.0; cells.points.len()], Vec::new()] {
        cells.values = values;
        let items = items_of(&cells, &Showing::default(), Surfaces::Facets).unwrap();
        assert!(matches!(items.scene(true).unwrap().items[0], Item::Solid(_)));
        let field = Showing { cells: Some(CellStyle::Volume), ..Showing::default() };
        assert!(items_of(&cells, &field, Surfaces::Facets).is_err());
    }
}

#[test]
fn an_input_that_cannot_be_shown_changes_nothing() {
    let mut items = Items::new(Surfaces::Facets);
    let heat = Coloring { surface: Some(SurfaceColor::of("heat", None)), ..Coloring::default() };
    let appearance = Appearance { coloring: heat, ..Appearance::default() };
    let showing = Showing { appearance, draws_edges: true, ..Showing::default() };
    let name = Name::of_file("a.ply".as_ref());
    let mut turned = triangle();
    turned.about.orientation = Some(Orientation::RAS);
    turned.about.frame = Frame::Patient;
    assert!(items.add(&name, Data::Mesh(turned), &showing, &|_| ()).is_err());
    assert_eq!(items.captions(), Captions::default());
    assert_eq!((items.count(), items.edges(&[]).len(), items.contents.len()), (0, 0, 0));
    assert_eq!(items.subject.origin, Origin::Default);
    // Later, it is as if it had never been tried.
    let plain = Showing { draws_edges: true, ..Showing::default() };
    items.add(&name, Data::Mesh(triangle()), &plain, &|_| ()).unwrap();
    let count = items.count();
    assert_eq!((count > 0, items.edges(&[]).len()), (true, 1));
    let mark = items.mark();
    items.add(&name, Data::Volume(cube(0.0)), &plain, &|_| ()).unwrap();
    items.restore(mark);
    assert_eq!((items.count(), items.captions().legends.len()), (count, 0));
    assert!(items.set_transfer(0, Default::default()).is_err());
}

/// Points in a ball, in an order without a pattern.
fn ball(count: usize) -> Vec<Vec3> {
    let part = |i: usize, factor: f64| ((i as f64 * factor).fract() * 2.0 - 1.0) as f32;
    let place = |i: usize| {
        Vec3::new(part(i, 0.819_172_513), part(i, 0.671_043_607), part(i, 0.549_700_478))
    };
    (0..).map(place).filter(|place| place.length() < 1.0).take(count).collect()
}

/// Points that fill space are balls, those on a surface surfels, and a file with both has both;
/// lines are tubes beside the triangles.
#[test]
fn points_and_lines_have_items_of_their_own() {
    let sphere = Mesh::sphere(4).positions;
    let apart: Vec<Vec3> = ball(2000).iter().map(|p| *p * 0.7 + Vec3::X * 3.0).collect();
    let cloud = |positions: Vec<Vec3>| Mesh { positions, ..Mesh::default() };
    let edges = Mesh { lines: vec![[0, 1], [1, 2]], ..triangle() };
    let only = Mesh { triangles: Vec::new(), ..edges.clone() };
    let cases = [
        ("a surface", cloud(sphere.clone()), PointStyle::Auto, &["points"][..], &[false][..]),
        ("a ball", cloud(ball(2000)), PointStyle::Auto, &["points"], &[true]),
        ("both", cloud([sphere.clone(), apart].concat()), PointStyle::Auto, &["points"], &[false]),
        ("surfels", cloud(ball(2000)), PointStyle::Surfels, &["points"], &[false]),
        ("spheres", cloud(sphere), PointStyle::Spheres, &["points"], &[true]),
        ("few", cloud(ball(5)), PointStyle::Auto, &["points"], &[false]),
        ("edges", edges, PointStyle::Auto, &["lines", "mesh"], &[true, true]),
        ("lines", only, PointStyle::Auto, &["lines"], &[true]),
    ];
    for (name, mesh, points, kinds, facets) in cases {
        let mut items = Items::new(Surfaces::Both);
        let showing = Showing { points, ..Showing::default() };
        items.add(&Name::of_file("a.ply".as_ref()), Data::Mesh(mesh), &showing, &|_| ()).unwrap();
        let item_kinds: Vec<&str> = items.contents.iter().map(|content| content.kind).collect();
        assert_eq!(item_kinds, kinds, "{name}");
        let [with, without] = [true, false].map(|facets| items.scene(facets).unwrap());
        let is_facets = |item: &Item| matches!(item, Item::Facets(_));
        assert_eq!(with.items.iter().map(is_facets).collect::<Vec<_>>(), facets, "{name}");
        assert!(without.items.iter().all(|item| matches!(item, Item::Radiance(_))), "{name}");
        with.validate().unwrap();
        without.validate().unwrap();
    }
}

/// A host without a subscriber of `tracing` also hears what is wrong with an input.
#[test]
fn a_loaded_scene_has_its_warnings_and_facts() {
    let folder = Folder::new();
    let [table, mesh] =
        [("b.csv", TABLE), ("a.obj", MESH)].map(|(name, text)| folder.write(name, text.as_bytes()));
    let loaded = Description::new([mesh, table]).load(&|_| {}).unwrap();
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.contains("b.csv: 1 of 4 values missing"), "{warning}");
    let facts = |number: usize| loaded.inputs[number].facts.to_json();
    assert_eq!((&facts(0)["triangles"], &facts(0)["count"]), (&1.into(), &3.into()));
    assert_eq!((&facts(1)["kind"], &facts(1)["missing"]), (&"samples".into(), &1.into()));
}

#[test]
fn bytes_in_memory_are_opened_by_their_name() {
    let reading = Reading::default();
    let open = |name: &'static str, bytes| reading.open_bytes(name.as_ref(), bytes);
    let opened = open("b.csv", TABLE.as_bytes()).unwrap();
    let data = opened.read().unwrap();
    assert_eq!((opened.kind(), data.count()), (Kind::Samples, 3));
    assert_eq!(opened.facts(&data).unwrap().to_json()["bytes"], TABLE.len());
    let error = open("b.txyz", b"hello").err().expect("an error").to_string();
    assert!(error.contains("b.txyz") && error.contains("no format that can be read"), "{error}");
    // What is read page by page from a file is also read from memory.
    let surfels = Mesh::sphere(2).surfels(&Default::default()).unwrap();
    let folder = Folder::new();
    let path = folder.write("a.splk", b"");
    let build = crate::hierarchy::BuildOptions::default();
    crate::hierarchy::build_file(&surfels, &path, &build, &Default::default(), None).unwrap();
    let bytes = std::fs::read(path).unwrap();
    let opened = open("c.splk", &bytes).unwrap();
    assert_eq!((opened.kind(), opened.read().unwrap().kind()), (Kind::Hierarchy, Kind::Hierarchy));
    assert!(opened.findings(None).unwrap().is_empty());
    let damaged = open("c.splk", &bytes[..bytes.len() - 9]).unwrap();
    assert!(damaged.findings(None).map_or(true, |findings| !findings.is_empty()));
}

/// Two channels of 6³ samples; a block of the one lies beside a block of the other.
fn two_channels() -> Volume {
    let volume = |channel: usize| {
        let inside = |at: usize| {
            let [x, y, z] = [at % 6, at / 6 % 6, at / 36];
            x / 3 == channel && (2..4).contains(&y) && (2..4).contains(&z)
        };
        let samples = (0..216).map(|at| if inside(at) { 200 } else { 10 }).collect();
        let lattice = Lattice::with_spacing([6; 3], DVec3::ONE);
        let mut volume = Volume::new(lattice, Samples::U8(samples)).unwrap();
        volume.about.channels = vec![Channel::default(); 2];
        volume.about.channels[1].color = Some([1.0, 0.0, 0.0]);
        (volume.about.channel, volume.about.name) = (channel, format!("channel {channel}"));
        volume
    };
    let [mut first, second] = [0, 1].map(volume);
    first.more_channels.push(second);
    first
}

#[test]
fn channels_are_fields_of_their_own_colours() {
    let added = |volume: Volume, showing: &Showing| {
        let mut items = Items::new(Surfaces::Facets);
        items
            .add(&Name::of_file("v".as_ref()), Data::Volume(volume), showing, &|_| {})
            .map(|()| items)
    };
    let colors = |items: &Items| -> Vec<[f64; 3]> {
        items.fields().map(|(_, item)| item.transfer().unwrap().color(200.0)).collect()
    };
    let items = added(two_channels(), &Showing::default()).unwrap();
    let [first, second] = colors(&items)[..] else { panic!("two fields") };
    assert!(second[0] == 1.0 && second[1] < 0.5, "the colour of the file: {second:?}");
    assert!(first[1] > 0.8 && first[0] < 0.6, "another one: {first:?}");
    let titles: Vec<String> =
        items.captions().legends.into_iter().map(|(_, legend)| legend.title).collect();
    assert_eq!(titles, ["channel 0", "channel 1"]);
    // Styles are in the order in which the channels were read.
    let mut showing = Showing::default();
    let blue = ChannelStyle { color: Some([0.0, 0.0, 1.0]), ..ChannelStyle::default() };
    let thin = ChannelStyle { opacity: Some(0.25), ..ChannelStyle::default() };
    showing.appearance.channels = vec![blue, thin];
    let styled = added(two_channels(), &showing).unwrap();
    assert_eq!(colors(&styled)[0][2], 1.0);
    let opacity = |items: &Items| {
        items.fields().nth(1).map(|(_, item)| item.transfer().unwrap().opacity(200.0)).unwrap()
    };
    assert!((opacity(&styled) - 0.25 * opacity(&items)).abs() < 1e-9);
    // A channel of one value is left out; a file without any other shows nothing.
    let mut dark = two_channels();
    dark.more_channels[0].samples = Samples::U8(vec![3; 216]);
    dark.more_channels[0].range = [3.0; 2];
    let (items, words) = warnings_of(|| added(dark.clone(), &Showing::default()).unwrap());
    assert_eq!((colors(&items).len(), words.len()), (1, 1), "{words:?}");
    (dark.samples, dark.range) = (Samples::U8(vec![3; 216]), [3.0; 2]);
    assert!(matches!(added(dark, &Showing::default()), Err(Error::NothingToDraw(_))));
    // A name of values shows these alone.
    let named = Showing { is_named: true, ..Showing::default() };
    assert_eq!(colors(&added(two_channels(), &named).unwrap()).len(), 1);
}

#[test]
fn slices_are_looked_at_head_on_unless_something_stands_beside_them() {
    let slice = |axis: usize| {
        let mut dims = [4; 3];
        dims[axis] = 1;
        let lattice = Lattice::with_spacing(dims, DVec3::ONE);
        Data::Volume(Volume::new(lattice, Samples::U8((0..16).collect())).unwrap())
    };
    let direction = |inputs: Vec<Data>| {
        let mut items = Items::new(Surfaces::Facets);
        for data in inputs {
            items.add(&Name::of_file("v".as_ref()), data, &Showing::default(), &|_| {}).unwrap();
        }
        let camera = Framing::default().camera(&items.subject, [64, 64]).unwrap();
        (camera.focal_point - camera.position).normalize()
    };
    let is_along = |direction: DVec3, wanted: DVec3| direction.dot(wanted) > 0.999_999;
    assert!(is_along(direction(vec![slice(2)]), DVec3::NEG_Z));
    assert!(is_along(direction(vec![slice(1), slice(1)]), DVec3::Y));
    assert!(!is_along(direction(vec![slice(2), slice(1)]), DVec3::NEG_Z));
    // Channels of a slice are one picture.
    let mut flat = two_channels();
    for volume in std::iter::once(&mut flat.more_channels).flatten() {
        volume.lattice = Lattice::with_spacing([36, 6, 1], DVec3::ONE);
    }
    flat.lattice = Lattice::with_spacing([36, 6, 1], DVec3::ONE);
    let mut items = Items::new(Surfaces::Facets);
    items
        .add(&Name::of_file("v".as_ref()), Data::Volume(flat), &Showing::default(), &|_| {})
        .unwrap();
    let scene = items.scene(true).unwrap();
    let [Item::Facets(sheet)] = &scene.items[..] else { panic!("a sheet") };
    assert_eq!((sheet.facets.is_empty(), sheet.images.len()), (false, 1));
}
