//! Every way to write image data, and ways to write it wrong.

use super::*;
use crate::{Error, input::testing::*, volume::Samples};
use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::{Compression, write::ZlibEncoder};
use std::io::Write;

fn read(source: &Source) -> Result<Volume> {
    super::super::read_volume(source, &ReadOptions::default())
}

const VALUES: [i16; 12] = [0, 1, -2, 300, -4000, 5, 6, 7, 8, 9, 10, 32767];

/// How a test file is written.
#[derive(Debug, Clone, Copy)]
struct Style {
    format: &'static str,
    /// The encoding of the appended data.
    appended: &'static str,
    packed: bool,
    wide: bool,
    endian: Endian,
}

const PLAIN: Style = Style {
    format: "appended",
    appended: "raw",
    packed: false,
    wide: false,
    endian: Endian::Little,
};

impl Style {
    fn count(&self, n: usize) -> Vec<u8> {
        match (self.wide, self.endian) {
            (false, Endian::Little) => (n as u32).to_le_bytes().to_vec(),
            (false, Endian::Big) => (n as u32).to_be_bytes().to_vec(),
            (true, Endian::Little) => (n as u64).to_le_bytes().to_vec(),
            (true, Endian::Big) => (n as u64).to_be_bytes().to_vec(),
        }
    }

    /// The counts and the data of an array, in blocks of 10 bytes if it is compressed.
    fn array(&self, bytes: &[u8]) -> (Vec<u8>, Vec<u8>) {
        if !self.packed {
            return (self.count(bytes.len()), bytes.to_vec());
        }
        let blocks: Vec<Vec<u8>> = bytes
            .chunks(10)
            .map(|block| {
                let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
                encoder.write_all(block).unwrap();
                encoder.finish().unwrap()
            })
            .collect();
        let head =
            [blocks.len(), 10, bytes.len() % 10].into_iter().chain(blocks.iter().map(Vec::len));
        (head.flat_map(|n| self.count(n)).collect(), blocks.concat())
    }

    fn base64(&self, bytes: &[u8]) -> String {
        let (head, data) = self.array(bytes);
        // Counts of compressed data are encoded separately.
        if self.packed {
            STANDARD.encode(head) + &STANDARD.encode(data)
        } else {
            STANDARD.encode([head, data].concat())
        }
    }

    /// The bytes of a section with two appended arrays, and the offset of the second one.
    fn append(&self, arrays: [&[u8]; 2]) -> (Vec<u8>, usize) {
        let [first, second] = arrays.map(|bytes| match self.appended {
            "raw" => [self.array(bytes).0, self.array(bytes).1].concat(),
            _ => self.base64(bytes).into_bytes(),
        });
        let offset = first.len();
        ([first, second].concat(), offset)
    }

    fn bytes(&self, values: &[i16]) -> Vec<u8> {
        values
            .iter()
            .flat_map(
                |v| if self.endian == Endian::Little { v.to_le_bytes() } else { v.to_be_bytes() },
            )
            .collect()
    }

    fn head(&self) -> String {
        let order = if self.endian == Endian::Little { "LittleEndian" } else { "BigEndian" };
        let compressor = if self.packed { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
        let counts = if self.wide { "UInt64" } else { "UInt32" };
        format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" byte_order=\"{order}\" \
             header_type=\"{counts}\"{compressor}>"
        )
    }

    /// A file of 3 × 2 × 2 points, beginning at index (1, 0, 0), with the values in the array
    /// “wanted”.
    fn file(&self) -> Vec<u8> {
        let bytes = self.bytes(&VALUES);
        let (section, offset) = self.append([&[1, 2, 3, 4], &bytes]);
        let text = match self.format {
            "ascii" => VALUES.map(|v| v.to_string()).join(" "),
            "binary" => format!("\n   {}\n  ", self.base64(&bytes)),
            _ => String::new(),
        };
        let statistics = "<InformationKey name=\"RANGE\" location=\"here\"><Value \
                          index=\"0\">77</Value></InformationKey>";
        let format = self.format;
        let mut file = format!(
            "{}<ImageData WholeExtent=\"1 3 0 1 0 1\" Origin=\"10 20 30\" Spacing=\"0.5 1 2\" \
             Direction=\"0 -1 0 1 0 0 0 0 1\"><Piece Extent=\"1 3 0 1 0 1\"><CellData \
             Scalars=\"cell\"><DataArray type=\"UInt8\" Name=\"cell\" format=\"appended\" \
             offset=\"0\"/></CellData><PointData Scalars=\"wanted\"><DataArray type=\"Float32\" \
             Name=\"other\" format=\"ascii\">1 2</DataArray><DataArray type=\"Int16\" \
             Name=\"wanted\" format=\"{format}\" \
             offset=\"{offset}\">{text}{statistics}</DataArray></PointData></Piece></ImageData>",
            self.head(),
        )
        .into_bytes();
        if format == "appended" {
            file.extend(format!("\n<AppendedData encoding=\"{}\">\n  _", self.appended).bytes());
            file.extend(section);
            file.extend(b"\n</AppendedData>");
        }
        file.extend(b"</VTKFile>");
        file
    }
}

/// A file of two points with one array of three components.
fn of_three(kind: &str, name: &str, numbers: &str) -> Volume {
    let file = format!(
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 0 0 0\"><Piece Extent=\"0 1 0 \
         0 0 0\"><PointData><DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"3\" \
         format=\"ascii\">{numbers}</DataArray></PointData></Piece></ImageData></VTKFile>"
    );
    let folder = Folder::new();
    read_with(&folder.write("a.vti", file), read).unwrap()
}

#[test]
fn bytes_and_numbers_called_so_are_colours() {
    let expected = [[200, 40, 40, 255], [0, 0, 255, 255]];
    let bytes = of_three("UInt8", "scan", "200 40 40 0 0 255");
    assert_eq!(bytes.colors.as_deref().unwrap(), expected);
    assert_eq!((bytes.value(0), bytes.value(1)), (88.0, 29.0));
    let floats = of_three("Float32", "RGB", "0.7843 0.1569 0.1569 0 0 1");
    assert_eq!(floats.colors.as_deref().unwrap(), expected);
    let wide = of_three("UInt16", "rgb_16", "51400 10280 10280 0 0 65535");
    assert_eq!(wide.colors.as_deref().unwrap(), expected);
    let vectors = of_three("Float32", "velocity", "3 4 0 0 0 1");
    assert!(vectors.colors.is_none());
    assert_eq!(vectors.value(0), 5.0);
}

fn styles() -> Vec<Style> {
    let mut styles = Vec::new();
    for (format, appended) in
        [("ascii", "raw"), ("binary", "raw"), ("appended", "raw"), ("appended", "base64")]
    {
        for bits in 0..8 {
            let endian = if bits & 4 == 0 { Endian::Little } else { Endian::Big };
            styles.push(Style {
                format,
                appended,
                packed: bits & 1 != 0,
                wide: bits & 2 != 0,
                endian,
            });
        }
    }
    styles
}

#[test]
fn every_style() {
    let folder = Folder::new();
    for style in styles() {
        let volume = read_with(&folder.write("volume.vti", style.file()), read)
            .unwrap_or_else(|e| panic!("{style:?}: {e}"));
        assert_eq!(volume.samples, Samples::I16(VALUES.to_vec()), "{style:?}");
        assert_eq!(volume.lattice.dims, [3, 2, 2]);
        // The first axis points along y, the second one along −x; the first index along it is 1.
        assert_eq!(volume.lattice.position(DVec3::new(1.0, 1.0, 1.0)), DVec3::new(9.0, 21.0, 32.0));
    }
}

#[test]
fn every_cut_is_an_error() {
    let folder = Folder::new();
    for style in styles().into_iter().filter(|style| style.wide) {
        every_cut(&folder, "volume.vti", &style.file(), read);
    }
}

/// Truncated or changed data inside files whose end is intact.
#[test]
fn no_damage_panics_or_passes_for_long() {
    let folder = Folder::new();
    for style in
        [PLAIN, Style { packed: true, ..PLAIN }, Style { packed: true, format: "binary", ..PLAIN }]
    {
        let file = style.file();
        for at in 0..file.len() {
            for value in [0, b'<', file[at] ^ 1] {
                let mut damaged = file.clone();
                damaged[at] = value;
                // Whether it can still be read depends on the place of the change. The result must
                // be a volume or an error.
                if let Ok(volume) = read_with(&folder.write("volume.vti", &damaged), read) {
                    assert_eq!(volume.len(), volume.lattice.len());
                }
            }
            let shorter = [&file[..at], &file[at + 1..]].concat();
            read_with(&folder.write("volume.vti", &shorter), read).ok();
        }
    }
}

/// A file with one ascii piece, written by hand.
fn ascii(head: &str, image: &str, points: &str) -> Vec<u8> {
    format!(
        "<VTKFile {head}><ImageData {image}><Piece Extent=\"0 1 0 0 0 \
             1\">{points}</Piece></ImageData></VTKFile>"
    )
    .into_bytes()
}

#[test]
fn types_and_the_choice_of_the_array() {
    let folder = Folder::new();
    let load = |points: &str| {
        let content = ascii("type=\"ImageData\"", "WholeExtent=\"0 1 0 0 0 1\"", points);
        read_with(&folder.write("volume.vti", &content), read)
    };
    for (name, samples) in [
        ("Int8", Samples::I16(vec![1, 2, 3, 4])),
        ("UInt8", Samples::U8(vec![1, 2, 3, 4])),
        ("UInt16", Samples::U16(vec![1, 2, 3, 4])),
        ("Int32", Samples::I32(vec![1, 2, 3, 4])),
        ("UInt64", Samples::I32(vec![1, 2, 3, 4])),
        ("Float64", Samples::F32(vec![1.0, 2.0, 3.0, 4.0])),
    ] {
        let array = format!(
            "<PointData><DataArray type='{name}' format='ascii'>1 2 3 4</DataArray></PointData>"
        );
        assert_eq!(load(&array).unwrap().samples, samples);
    }
    let vector =
        "<DataArray type='UInt8' Name='v' NumberOfComponents='3' format='ascii'>0</DataArray>";
    let scalar = "<DataArray type='UInt8' Name='s' format='ascii'>1 2 3 4</DataArray>";
    let mixed = scalar.replace("1 2 3 4", "4 2 3 1");
    let volume = load(&format!("<PointData>{vector}{mixed}</PointData>")).unwrap();
    assert_eq!((volume.range, volume.lattice.dims), ([1.0, 4.0], [2, 1, 2]));
    for (points, word) in [
        (format!("<PointData Scalars='v'>{vector}</PointData>"), "1 numbers where 12"),
        (format!("<CellData>{scalar}</CellData>"), "more than the 1 numbers"),
        ("<PointData/>".into(), "no values that can be drawn"),
        (format!("<PointData>{}</PointData>", scalar.replace("UInt8", "String")), "only ident"),
        (format!("<PointData>{}</PointData>", scalar.replace("4<", "4 5<")), "more than the 4"),
        (format!("<PointData>{}</PointData>", scalar.replace("4<", "<")), "3 numbers"),
        (
            format!(
                "<PointData>{}</PointData>",
                scalar.replace("ascii", "binary").replace('4', "*")
            ),
            "base64",
        ),
        (
            format!("<PointData>{}</PointData>", scalar.replace("ascii", "appended' offset='0")),
            "no appended data",
        ),
        (
            format!(
                "<PointData>{}</PointData>",
                scalar.replace("UInt8", "Float32").replace("1 2 3 4", "nan nan nan inf")
            ),
            "none of the 4 samples",
        ),
        (format!("<PointData>{scalar}</CellData>"), "is not valid XML"),
    ] {
        let message = load(&points).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn wrong_heads_are_told() {
    let folder = Folder::new();
    let error = |head: &str, image: &str| {
        let points =
            "<PointData><DataArray type='UInt8' format='ascii'>1 2 3 4</DataArray></PointData>";
        read_with(&folder.write("volume.vti", ascii(head, image, points)), read).unwrap_err()
    };
    let (head, image) = ("type='ImageData'", "WholeExtent='0 1 0 0 0 1'");
    for (head, image, word) in [
        ("type='PolyData'", image, "PolyData"),
        ("type='Table'", image, "Table"),
        ("type='ImageData' compressor='vtkZstdDataCompressor'", image, "vtkZstdDataCompressor"),
        ("type='ImageData' byte_order='Middle'", image, "Middle"),
        ("type='ImageData' header_type='UInt16'", image, "UInt16"),
        (head, "", "WholeExtent"),
        (head, "WholeExtent='0 1 0 0 0'", "6 numbers"),
        (head, "WholeExtent='0 1 0 0 0 2'", "4 points"),
        (head, "WholeExtent='0 0 0 0 0 1'", "beyond the whole"),
        (head, "WholeExtent='0 1 0 -1 0 1'", "not a valid range"),
        (head, "WholeExtent='0 1 0 0 0 1' Spacing='1 0 1'", "spacing"),
        (head, "WholeExtent='0 1 0 0 0 1' Spacing='1 nan 1'", "finite"),
        (head, "WholeExtent='0 1 0 0 0 1' Direction='1 1 0 0 0 0 0 0 1'", "plane"),
    ] {
        let message = error(head, image).to_string();
        assert!(message.contains(word), "{message}");
    }
    assert!(matches!(error(head, "WholeExtent='0 1099511627776 0 0 0 1'"), Error::Limit { .. }));
    assert!(matches!(
        error(head, "WholeExtent='-9223372036854775808 9223372036854775807 0 0 0 1'"),
        Error::Input { .. }
    ));
    assert!(matches!(
        error(head, "WholeExtent='0 4294967295 0 4294967295 0 4294967295'"),
        Error::Limit { .. }
    ));
}

#[test]
fn lying_counts_allocate_nothing() {
    let folder = Folder::new();
    let error = |extent: &str, wide: bool, section: &[u8]| {
        let style = Style { packed: true, wide, ..PLAIN };
        let mut file = format!(
            "{}<ImageData WholeExtent='{extent}'><Piece Extent='{extent}'><PointData>\
             <DataArray type='UInt8' format='appended' offset='0'/></PointData></Piece></ImageData>\
             <AppendedData encoding='raw'>_",
            style.head()
        )
        .into_bytes();
        file.extend(section);
        file.extend(b"</AppendedData></VTKFile>");
        read_with(&folder.write("volume.vti", &file), read).unwrap_err().to_string()
    };
    let wide = |counts: &[u64]| counts.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    let narrow = |counts: &[u32]| counts.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    for (message, word) in [
        (error("0 7 0 0 0 0", true, &wide(&[1 << 32, 1 << 32, 0])), "claims 4294967296 blocks"),
        (
            error("0 7 0 0 0 0", true, &wide(&[u64::MAX, u64::MAX, u64::MAX])),
            "8 bytes were expected",
        ),
        (error("0 7 0 0 0 0", false, &narrow(&[8, 1, 0])), "sizes of its blocks"),
        (error("0 4294967295 0 0 0 0", false, &narrow(&[u32::MAX, 1, 1])), "expected"),
        (error("0 4294967294 0 0 0 0", false, &narrow(&[u32::MAX, 1, 0])), "sizes of its blocks"),
        (
            error("0 4294967294 0 0 0 0", false, &narrow(&[1, u32::MAX, 0, 4, 0])),
            "compressed bytes can hold",
        ),
        (error("0 7 0 0 0 0", true, &wide(&[1, 8, 0, u64::MAX])), "block 0 claims"),
        (error("0 7 0 0 0 0", true, &wide(&[1, 0, 8, 9])), "last of 8"),
        (error("0 7 0 0 0 0", true, &wide(&[1, 8, 0, 8, 0])), "cannot be unpacked"),
        (error("0 7 0 0 0 0", true, &wide(&[1])), "sizes of its blocks"),
    ] {
        assert!(message.contains(word), "{message}");
    }
    // A block that contains more than it claims.
    let style = Style { packed: true, wide: true, ..PLAIN };
    let (head, data) = style.array(&[5; 10]);
    let long = [wide(&[1, 8, 0]), head[24..].to_vec(), data].concat();
    assert!(error("0 7 0 0 0 0", true, &long).contains("more than its 8 bytes"));
}

#[test]
fn pieces_are_put_together() {
    let folder = Folder::new();
    let load = |pieces: &[(&str, &str)]| {
        let pieces: String = pieces
            .iter()
            .map(|(extent, values)| {
                format!(
                    "<Piece Extent='{extent}'><PointData Scalars='s'><DataArray type='Int32' \
                     Name='s' format='ascii'>{values}</DataArray></PointData></Piece>"
                )
            })
            .collect();
        let file = format!(
            "<VTKFile type='ImageData'><ImageData WholeExtent='0 2 -1 0 5 \
             6'>{pieces}</ImageData></VTKFile>"
        );
        read_with(&folder.write("volume.vti", file.as_bytes()), read)
    };
    let left = ("0 1 -1 0 5 6", "0 1 3 4 6 7 9 10");
    // The pieces share the points between them.
    let volume = load(&[left, ("1 2 -1 0 5 6", "1 2 4 5 7 8 10 11")]).unwrap();
    assert_eq!(volume.samples, Samples::I32((0..12).collect()));
    assert_eq!(volume.lattice.origin, DVec3::new(0.0, -1.0, 5.0));
    assert!(load(&[left]).unwrap_err().to_string().contains("8 points"));
    assert!(load(&[left, left]).unwrap_err().to_string().contains("no piece contains point 2"));
}
