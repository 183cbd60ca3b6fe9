use super::*;
use crate::{
    formats::{e57, points::write_points},
    input::testing::*,
};
use glam::Vec3;

fn attribute(name: &str, kind: NumberType) -> Attribute {
    Attribute { name: name.into(), kind }
}

/// Points with a colour, an intensity, of which one is missing, and a class.
fn records() -> Records {
    Records {
        positions: vec![DVec3::ZERO, DVec3::new(1.25, -2.0, 3.5), DVec3::new(0.5, 0.0, -1.0)],
        normals: vec![Vec3::Z; 3],
        colors: vec![[255, 0, 51, 255], [1, 2, 3, 255], [9, 8, 7, 255]],
        attributes: vec![
            attribute("class", NumberType::U8),
            attribute("intensity", NumberType::F32),
            attribute("red", NumberType::U16),
        ],
        columns: vec![vec![1.0, 2.0, 3.0], vec![7.0, f64::NAN, 60_000.5], vec![65535.0; 3]],
    }
}

fn layout(records: &Records) -> PointLayout {
    PointLayout {
        attributes: records.attributes.clone(),
        has_normals: true,
        has_colors: true,
        bounds: [DVec3::new(0.0, -2.0, -1.0), DVec3::new(1.25, 0.0, 3.5)],
        ..PointLayout::default()
    }
}

/// Writes points in two pieces, and returns the warnings.
fn written(path: &Path, layout: PointLayout, records: &Records) -> Vec<String> {
    let (result, warnings) = warnings_of(|| {
        let mut writer = write_points(path, layout)?;
        writer.put(records)?;
        writer.put(records)?;
        writer.finish()
    });
    assert_eq!(result.unwrap(), 2 * records.positions.len() as u64);
    warnings
}

fn places(mesh: &crate::surface::Mesh) -> Vec<DVec3> {
    mesh.positions.iter().map(|place| mesh.origin + place.as_dvec3()).collect()
}

#[test]
fn written_points_are_read_again() {
    let (folder, records) = (Folder::new(), records());
    let path = folder.path("a.e57");
    let warnings = written(&path, layout(&records), &records);
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0].contains("no place for normals, class, which are left out"),
        "{warnings:?}"
    );
    let mesh = read_with(&path, e57::read).unwrap();
    assert_eq!(places(&mesh), [&records.positions[..]; 2].concat());
    assert_eq!(mesh.colors[..3], records.colors);
    let valued = read_with(&path, |source| e57::read_named(source, Some("intensity"))).unwrap();
    assert_eq!(
        valued.values[..3].iter().map(|v| v.is_nan()).collect::<Vec<_>>(),
        [false, true, false]
    );
    assert_eq!([valued.values[0], valued.values[5]], [7.0, 60_000.5]);
}

#[test]
fn steps_and_far_points_keep_their_places() {
    let (folder, mut records) = (Folder::new(), records());
    let shift = DVec3::new(4e6, 5e6, 100.0);
    let step = DVec3::splat(0.25);
    records.positions.iter_mut().for_each(|place| *place += shift);
    let bounds = layout(&records).bounds.map(|corner| corner + shift);
    for grid in [None, Some([step, shift])] {
        let path = folder.path("a.e57");
        written(&path, PointLayout { bounds, grid, ..layout(&records) }, &records);
        assert_eq!(places(&read_with(&path, e57::read).unwrap())[..3], records.positions);
    }
    // One point takes bits, too.
    records = Records { positions: vec![shift], ..Records::default() };
    let alone =
        PointLayout { bounds: [shift; 2], grid: Some([step, shift]), ..PointLayout::default() };
    let path = folder.path("b.e57");
    assert!(written(&path, alone, &records).is_empty());
    assert_eq!(places(&read_with(&path, e57::read).unwrap()), [shift; 2]);
}

#[test]
fn whole_numbers_keep_to_their_type() {
    let (folder, mut records) = (Folder::new(), records());
    records.attributes[1].kind = NumberType::U16;
    records.columns[1] = vec![7.0, f64::NAN, 70_000.0];
    let path = folder.path("a.e57");
    // Without colours, the attribute that they come from has no place either.
    let layout = PointLayout { has_normals: false, has_colors: false, ..layout(&records) };
    let warnings = written(&path, layout, &records);
    assert!(warnings[0].contains("no place for class, red, which"), "{warnings:?}");
    let mesh = read_with(&path, |source| e57::read_named(source, Some("intensity"))).unwrap();
    assert_eq!(mesh.values[..3], [7.0, 0.0, 65535.0]);
}

#[test]
fn an_unfinished_file_leaves_nothing() {
    let (folder, records) = (Folder::new(), records());
    let path = folder.path("a.e57");
    let mut writer = write_points(&path, layout(&records)).unwrap();
    writer.put(&records).unwrap();
    drop(writer);
    assert_eq!(std::fs::read_dir(folder.as_ref()).unwrap().count(), 0);
}
