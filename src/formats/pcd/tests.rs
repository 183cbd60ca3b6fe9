use super::*;
use crate::{
    Error,
    input::{Limits, testing::*},
};

const HEADER: &str = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z _ rgb \
                      normal_x normal_y normal_z\nSIZE 4 4 8 1 4 4 4 4\nTYPE F F F U U F F F\n\
                      COUNT 1 1 1 3 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 1 2 9 1 0 0 0\nPOINTS 2\n\
                      ";

/// The two points, field by field.
fn columns() -> [Vec<Vec<u8>>; 8] {
    let floats = |values: [f32; 2]| values.map(|v| v.to_le_bytes().to_vec()).to_vec();
    [
        floats([1.0, 4.0]),
        floats([2.0, 5.0]),
        [3f64, 6.0].map(|v| v.to_le_bytes().to_vec()).to_vec(),
        vec![vec![7; 3]; 2],
        [0x00ff_8001u32, 0x0000_0033].map(|v| v.to_le_bytes().to_vec()).to_vec(),
        floats([0.0, 2.0]),
        floats([0.0, 0.0]),
        floats([1.0, 0.0]),
    ]
}

fn text() -> Vec<u8> {
    let lines = "1 2 3 7 7 7 16744449 0 0 1\r\n\n4.0 5 6 7 7 7 51 2 0 0\n";
    format!("{HEADER}DATA ascii\n{lines}").into()
}

fn binary() -> Vec<u8> {
    let rows = (0..2).flat_map(|row| columns().map(|column| column[row].clone()).concat());
    [format!("{HEADER}DATA binary\n").into_bytes(), rows.collect()].concat()
}

/// Everything as literal bytes, as a packer may write it.
fn packed() -> Vec<u8> {
    let bytes: Vec<u8> = columns().into_iter().flatten().flatten().collect();
    let runs: Vec<u8> =
        bytes.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let sizes = [runs.len(), bytes.len()].map(|size| (size as u32).to_le_bytes()).concat();
    [format!("{HEADER}DATA binary_compressed\n").into_bytes(), sizes, runs].concat()
}

fn load(content: impl AsRef<[u8]>) -> Result<Mesh> {
    let folder = Folder::new();
    read_with(&folder.write("a.pcd", content), read)
}

#[test]
fn all_three_encodings_say_the_same() {
    for content in [text(), binary(), packed()] {
        let mesh = load(content).unwrap();
        assert_eq!(mesh.positions, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
        assert_eq!(mesh.colors, [[255, 128, 1, 255], [0, 0, 51, 255]]);
        assert_eq!(mesh.normals, [Vec3::Z, Vec3::X]);
        assert_eq!(
            mesh.sensors,
            [crate::surface::Sensor { position: Vec3::new(1.0, 2.0, 9.0), points: 0..2 }]
        );
    }
}

#[test]
fn what_is_missing_and_what_is_unusual() {
    let plain = "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nWIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 \
                 1 0 0 0\nDATA ascii\n";
    let color = f32::from_bits(0x00ff_8001);
    let mesh =
        load(format!("{plain}nan nan nan 0\n1 2 3 {color:e}\n4 5 6 0\nnan 1 2 0\n")).unwrap();
    assert_eq!(mesh.positions, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
    assert_eq!(mesh.colors[0], [255, 128, 1, 255]);
    assert_eq!(mesh.sensors[0].points, 0..2, "a camera at the origin");
    let plain = plain.replace("WIDTH 2\nHEIGHT 2", "POINTS 1");
    assert!(load(format!("{plain}1 2 3 0")).unwrap().sensors.is_empty(), "nothing is known");
}

#[test]
fn cuts_and_lies_are_errors() {
    let folder = Folder::new();
    // A text may end without its last line break, or within its last number.
    every_cut(&folder, "a.pcd", &text()[..text().len() - 1], read);
    every_cut(&folder, "a.pcd", &binary(), read);
    every_cut(&folder, "a.pcd", &packed(), read);
    let header = |from: &str, to: &str| String::from_utf8(text()).unwrap().replace(from, to);
    for (content, word) in [
        (header("POINTS 2", "POINTS 3"), "claims 3 points, but “WIDTH” × “HEIGHT” is 2"),
        (
            header("WIDTH 2\nHEIGHT 1\nVIEWPOINT 1 2 9 1 0 0 0\nPOINTS 2", "POINTS 3"),
            "has 2 points, but the header claims 3",
        ),
        (header("FIELDS x", "FIELDS w"), "no fields “x”"),
        (header("SIZE 4", "SIZE 3"), "“SIZE 3 4 8 1 4 4 4 4” has a size"),
        (header("SIZE 4 4", "SIZE 4"), "does not fit the 8 fields"),
        (header("TYPE F F", "TYPE F G"), "other than F, U and I"),
        (header("COUNT 1 1 1 3", "COUNT 1 1 1 99999999999"), "an invalid count"),
        (
            header("COUNT 1 1 1 3", "COUNT 1 1 1 4"),
            "line 12: has 10 numbers where the fields need 11",
        ),
        (header("DATA ascii", "DATA zipped"), "is not ascii"),
        (header("VERSION", "VERSIONS"), "line 2: “VERSIONS” is not an entry"),
        (header("4.0 5", "4.0 five"), "line 14: “five” is not a number"),
        (header("1 2 3 7", "inf 2 3 7").replace("4.0", "nan"), "none of the 2 points"),
    ] {
        let message = load(content).unwrap_err().to_string();
        assert!(message.contains(word), "{word}: {message}");
    }
    for points in ["4294967296", "18446744073709551615"] {
        let content =
            header("WIDTH 2\nHEIGHT 1\n", "").replace("POINTS 2", &format!("POINTS {points}"));
        assert!(matches!(load(content), Err(Error::Limit { .. })), "{points}");
    }
    let path = folder.write("b.pcd", binary());
    let limits = Limits { points: 1, ..Limits::default() };
    assert!(matches!(read(&Source::open(&path, &limits).unwrap()), Err(Error::Limit { .. })));
}

#[test]
fn what_other_programs_write_is_read() {
    let plain = "\u{feff}# .PCD v.5\r\nCOLUMNS X Y Z Intensity\r\nSIZE 4 4 4 4\r\nTYPE F F F F\r\n\
                 WIDTH 2\r\nHEIGHT 1\r\nDATA ASCII\r\n1 2 3 4\r\n-nan(ind) 0 0 5\r\n";
    let mesh = load(plain).unwrap();
    let place = mesh.origin.as_vec3() + mesh.positions[0];
    assert_eq!((mesh.positions.len(), place), (1, Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!(mesh.about.attributes, ["Intensity"]);
}

#[test]
fn fields_are_values_by_name() {
    let folder = Folder::new();
    for content in [text(), binary(), packed()] {
        let path = folder.write("a.pcd", content);
        let read = |name| read_with(&path, |source| read_named(source, Some(name)));
        let mesh = read("Normal_X").unwrap();
        // As the file has it, not as the unit vector that it becomes.
        assert_eq!((mesh.values, mesh.about.name), (vec![0.0, 2.0], "normal_x".to_owned()));
        assert_eq!(read("z").unwrap().values, [3.0, 6.0]);
        let message = read("heat").unwrap_err().to_string();
        assert!(message.contains("no attribute “heat”"), "{message}");
    }
}
