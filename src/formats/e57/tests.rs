use super::*;
use crate::{
    Error,
    input::{Limits, testing::*},
    surface::Sensor,
};
use ::e57::{E57Writer, Quaternion, Record, RecordValue, Transform, Translation};
use glam::Vec3;

const FLOAT: RecordDataType = RecordDataType::Single { min: None, max: None };
const DOUBLE: RecordDataType = RecordDataType::Double { min: None, max: None };

fn integer(max: i64) -> RecordDataType {
    RecordDataType::Integer { min: 0, max }
}

/// A scan: its records, its points and its pose.
type Scan = (Vec<(RecordName, RecordDataType)>, Vec<Vec<RecordValue>>, Option<Transform>);

/// A file of scans, with a change to its XML description.
fn file(scans: &[Scan], change: impl Fn(String) -> String) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file").unwrap();
    for (records, points, pose) in scans {
        let records = records
            .iter()
            .map(|(name, data_type)| Record { name: name.clone(), data_type: data_type.clone() });
        let mut scan = writer.add_pointcloud("scan", records.collect()).unwrap();
        scan.set_transform(pose.clone());
        points.iter().for_each(|point| scan.add_point(point.clone()).unwrap());
        scan.finalize().unwrap();
    }
    writer.finalize_customized_xml(|xml| Ok(change(xml))).unwrap();
    drop(writer);
    out.into_inner()
}

fn cartesian() -> Vec<(RecordName, RecordDataType)> {
    [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ]
        .map(|name| (name, DOUBLE))
        .to_vec()
}

fn doubles(values: [f64; 3]) -> Vec<RecordValue> {
    values.map(RecordValue::Double).to_vec()
}

/// Rotated by 90° around z and translated far away.
fn pose() -> Option<Transform> {
    let half = 0.5f64.sqrt();
    Some(Transform {
        rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
        translation: Translation { x: 4_500_000.0, y: 5_400_000.0, z: 100.0 },
    })
}

/// Two coloured points and an invalid one in Cartesian coordinates, and a scan in spherical
/// coordinates with intensities.
fn scans() -> [Scan; 2] {
    let colored = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue]
        .map(|name| (name, integer(255)));
    let invalid = (RecordName::CartesianInvalidState, integer(2));
    let point = |position, color: [i64; 3], state| {
        [
            doubles(position),
            color.map(RecordValue::Integer).to_vec(),
            vec![RecordValue::Integer(state)],
        ]
        .concat()
    };
    let points = vec![
        point([1.0, 0.0, 0.0], [255, 128, 0], 0),
        point([9.0, 9.0, 9.0], [1, 2, 3], 2),
        point([0.0, 0.002, 1.0], [0, 0, 51], 0),
    ];
    let spherical =
        [RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation];
    let spherical =
        [spherical.map(|name| (name, DOUBLE)).to_vec(), vec![(RecordName::Intensity, FLOAT)]]
            .concat();
    let measured =
        |position, intensity| [doubles(position), vec![RecordValue::Single(intensity)]].concat();
    let quarter = std::f64::consts::FRAC_PI_2;
    [
        ([cartesian(), colored.to_vec(), vec![invalid]].concat(), points, pose()),
        (
            spherical,
            vec![measured([2.0, quarter, 0.0], -300.0), measured([3.0, 0.0, quarter], 900.0)],
            None,
        ),
    ]
}

fn load(content: &[u8]) -> Result<Mesh> {
    let folder = Folder::new();
    read_with(&folder.write("a.e57", content), read)
}

#[test]
fn scans_with_poses_and_colors() {
    let mesh = load(&file(&scans()[..1], |xml| xml)).unwrap();
    let world = |i: usize| mesh.origin + mesh.positions[i].as_dvec3();
    assert!(world(0).distance(DVec3::new(4_500_000.0, 5_400_001.0, 100.0)) < 1e-5, "{}", world(0));
    assert!(
        world(1).distance(DVec3::new(4_499_999.998, 5_400_000.0, 101.0)) < 1e-5,
        "{}",
        world(1)
    );
    assert_eq!(mesh.colors, [[255, 128, 0, 255], [0, 0, 51, 255]]);
    assert_eq!(mesh.sensors.len(), 1);
    assert_eq!(mesh.sensors[0].points, 0..2);
    assert!(
        (mesh.origin + mesh.sensors[0].position.as_dvec3()).distance(DVec3::new(
            4_500_000.0,
            5_400_000.0,
            100.0
        )) < 1e-5
    );
}

#[test]
fn spherical_coordinates_and_intensities() {
    let mesh = load(&file(&scans()[1..], |xml| xml)).unwrap();
    assert!(
        mesh.positions[0].distance(Vec3::Y * 2.0) < 1e-6
            && mesh.positions[1].distance(Vec3::Z * 3.0) < 1e-6
    );
    assert_eq!(mesh.colors, [[0, 0, 0, 255], [255; 4]]);
    assert_eq!(mesh.sensors, [Sensor { position: Vec3::ZERO, points: 0..2 }]);
    let folder = Folder::new();
    let path = folder.write("a.e57", file(&scans(), |xml| xml));
    let read = |name| read_with(&path, |source| read_named(source, Some(name)));
    let mesh = read("intensity").unwrap();
    assert!(mesh.values[..2].iter().all(|value| value.is_nan()) && mesh.values[2] < mesh.values[3]);
    assert!(read("heat").unwrap_err().to_string().contains("no attribute “heat”"));
}

#[test]
fn all_scans_are_one_cloud() {
    let mesh = load(&file(&scans(), |xml| xml)).unwrap();
    assert_eq!((mesh.positions.len(), mesh.colors.len()), (4, 4));
    assert_eq!(mesh.colors[2], [255; 4], "no colour beside colours");
    assert_eq!(
        mesh.sensors.iter().map(|sensor| sensor.points.clone()).collect::<Vec<_>>(),
        [0..2, 2..4]
    );
    // Points in world coordinates do not show where a scanner stood.
    let merged =
        load(&file(&[(cartesian(), vec![doubles([1.0, 2.0, 3.0])], None)], |xml| xml)).unwrap();
    assert!(merged.sensors.is_empty() && merged.colors.is_empty());
}

#[test]
fn cuts_and_lies_are_errors() {
    let folder = Folder::new();
    every_cut(&folder, "a.e57", &file(&scans(), |xml| xml), read);
    let replaced = |from: &'static str, to: &'static str| {
        file(&scans(), move |xml| {
            assert!(xml.contains(from), "{xml}");
            xml.replace(from, to)
        })
    };
    for (content, word) in [
        (replaced("recordCount=\"2\"", "recordCount=\"3\""), "scan 1: ends after 2 points"),
        (replaced("fileOffset=\"48\"", "fileOffset=\"99999999\""), "scan 0"),
        (replaced("<e57Root", "<root"), "cannot be read as E57"),
        (file(&[], |xml| xml), "no points"),
        (file(&[(cartesian(), vec![doubles([f64::NAN; 3])], None)], |xml| xml), "none of the 1"),
    ] {
        let message = load(&content).unwrap_err().to_string();
        assert!(message.contains(word), "{word}: {message}");
    }
    let limited = load(&replaced("recordCount=\"2\"", "recordCount=\"18446744073709551615\""));
    assert!(matches!(limited, Err(Error::Limit { .. })));
    let path = folder.write("b.e57", file(&scans(), |xml| xml));
    let limits = Limits { points: 4, ..Limits::default() };
    assert!(matches!(read(&Source::open(&path, &limits).unwrap()), Err(Error::Limit { .. })));
}

/// Values of zero bits could be repeated forever.
#[test]
fn scans_of_no_bits_are_refused() {
    let records = cartesian().into_iter().map(|(name, _)| {
        (name, RecordDataType::ScaledInteger { min: 3, max: 4, scale: 1.0, offset: 0.0 })
    });
    let scan = (records.collect(), vec![vec![RecordValue::ScaledInteger(3); 3]; 2], None);
    let content = file(&[scan], |xml| xml.replace("maximum=\"4\"", "maximum=\"3\""));
    let message = load(&content).unwrap_err().to_string();
    assert!(message.contains("scan 0: has points that take zero bits"), "{message}");
}

/// Whatever byte of the description is changed, the file is either read or refused.
#[test]
fn no_changed_description_does_harm() {
    let length = std::cell::Cell::new(0);
    file(&scans(), |xml| {
        length.set(xml.len());
        xml
    });
    for at in (0..length.get()).step_by(3) {
        for byte in [b'9', b'-', b'<'] {
            let content = file(&scans(), |xml| {
                let mut bytes = xml.into_bytes();
                bytes[at] = byte;
                crate::input::copy::lossy(&bytes)
            });
            if let Err(error) = load(&content) {
                assert!(
                    matches!(error, Error::Input { .. } | Error::Limit { .. }),
                    "{at}: {error}"
                );
            }
        }
    }
}

/// XML on which a parser would compare forever is refused before the parser sees it.
#[test]
fn descriptions_of_many_names_are_refused() {
    let many = |what: fn(usize) -> String| {
        let names: String = (0..2000).map(what).collect();
        load(&file(&scans(), |xml| xml.replacen("<e57Root", &format!("<e57Root{names}"), 1)))
            .unwrap_err()
            .to_string()
    };
    let message = many(|i| format!(" xmlns:p{i}='u'"));
    assert!(message.contains("more than 256"), "{message}");
    let message = many(|i| format!(" a{i}='<>='"));
    assert!(message.contains("an element has more than 256 attributes"), "{message}");
    let nested = file(&scans(), |xml| {
        let elements: String = (0..300).map(|i| format!("<a xmlns:q{i}='u'/>")).collect();
        xml.replacen("</e57Root>", &format!("{elements}</e57Root>"), 1)
    });
    let message = load(&nested).unwrap_err().to_string();
    assert!(message.contains("more than 256 namespaces"), "{message}");
}

/// The reader buffers values of streams that are ahead of the others. The packets' headers give
/// their number.
#[test]
fn values_that_wait_for_others_are_counted() {
    let records = [
        cartesian(),
        vec![(RecordName::RowIndex, integer(1)), (RecordName::ColumnIndex, integer(0))],
    ]
    .concat();
    let point =
        [doubles([1.0, 2.0, 3.0]), vec![RecordValue::Integer(1), RecordValue::Integer(0)]].concat();
    let content = file(&[(records, vec![point; 5000], None)], |xml| xml);
    let folder = Folder::new();
    let path = folder.write("a.e57", &content);
    let limits = Limits::default();
    let source = Source::open(&path, &limits).unwrap();
    let scans = E57Reader::new(Cursor::new(source.bytes())).unwrap().pointclouds();
    let check =
        |most: u64| streams::check(&source, &scans[0], 0, most).map_err(|error| error.to_string());
    check(streams::MOST_WAITING).unwrap();
    // A packet has about 2,500 points. Each takes 24 bytes and one bit, and has a record of zero
    // bits.
    let message = check(1000).unwrap_err();
    let words: Vec<&str> = message.split(' ').collect();
    let at = words.iter().position(|word| *word == "values").unwrap();
    let waiting: u64 = words[at - 1].parse().unwrap();
    assert!((5 * 1000..=5 * 2731 + 8).contains(&waiting), "{message}");
    check(5 * 2731 + 8).unwrap();
    assert_eq!(read(&source).unwrap().positions.len(), 5000);
}
