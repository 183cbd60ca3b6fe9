use super::*;
use crate::{
    Error,
    input::{Limits, testing::*},
};
use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
use std::{io::Cursor, path::Path};

const SCALE: f64 = 0.001;
const OFFSET: [f64; 3] = [4_500_000.0, 5_400_000.0, 100.0];

/// A record of a format; every field that is read depends on its number.
fn record(format: u8, number: i32, largest: u16, withheld: bool) -> Vec<u8> {
    let mut record = vec![0; SIZES[usize::from(format)]];
    for (axis, at) in [0, 4, 8].into_iter().enumerate() {
        record[at..at + 4].copy_from_slice(&(number * 7 + axis as i32).to_le_bytes());
    }
    record[12..14].copy_from_slice(&(number as u16 * 3).to_le_bytes());
    // One return out of one.
    record[14] = if format < 6 { 0b1001 } else { 0x11 };
    record[15] = if !withheld { 0 } else { if format < 6 { 0x80 } else { 0x04 } };
    let color_at = [0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30][usize::from(format)];
    if color_at > 0 {
        for channel in 0..3 {
            let value = (number % 2) as u16 * largest / (channel + 1);
            record[color_at + 2 * usize::from(channel)..][..2]
                .copy_from_slice(&value.to_le_bytes());
        }
    }
    record
}

fn header(minor: u8, format: u8, start: usize, records: u32, points: u64) -> Vec<u8> {
    let size: usize = if minor == 4 { 375 } else { 227 };
    let mut header = vec![0; size];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, minor]);
    put(94, &(size as u16).to_le_bytes());
    put(96, &(start as u32).to_le_bytes());
    put(100, &records.to_le_bytes());
    put(104, &[format]);
    put(105, &(SIZES[usize::from(format & 0x3f)] as u16).to_le_bytes());
    if minor == 4 {
        put(247, &points.to_le_bytes());
    } else {
        put(107, &(points as u32).to_le_bytes());
    }
    for (axis, offset) in OFFSET.iter().enumerate() {
        put(131 + 8 * axis, &SCALE.to_le_bytes());
        put(155 + 8 * axis, &offset.to_le_bytes());
    }
    header
}

fn las(format: u8, records: &[Vec<u8>]) -> Vec<u8> {
    let minor = if format < 6 { 2 } else { 4 };
    let start = if minor == 4 { 375 } else { 227 };
    [header(minor, format, start, 0, records.len() as u64), records.concat()].concat()
}

fn laz(format: u8, records: &[Vec<u8>], points: u64) -> Vec<u8> {
    in_chunks_of(20, format, records, points)
}

fn in_chunks_of(size: u32, format: u8, records: &[Vec<u8>], points: u64) -> Vec<u8> {
    let items = LazItemRecordBuilder::default_for_point_format_id(format, 0).unwrap();
    let builder = LazVlrBuilder::new(items);
    // Chunks of varying sizes, as in COPC.
    let layout = if format < 6 {
        builder.with_fixed_chunk_size(size)
    } else {
        builder.with_variable_chunk_size()
    }
    .build();
    let mut described = Vec::new();
    layout.write_to(&mut described).unwrap();
    let mut before = vec![0; 54];
    before[2..2 + LazVlr::USER_ID.len()].copy_from_slice(LazVlr::USER_ID.as_bytes());
    before[18..20].copy_from_slice(&LazVlr::RECORD_ID.to_le_bytes());
    before[20..22].copy_from_slice(&(described.len() as u16).to_le_bytes());
    before.extend(described);
    let minor = if format < 6 { 2 } else { 4 };
    let start = if minor == 4 { 375 } else { 227 } + before.len();
    let mut file = Cursor::new([header(minor, format | 0x80, start, 1, points), before].concat());
    file.set_position(start as u64);
    let mut compressor = LasZipCompressor::new(&mut file, layout).unwrap();
    for (number, record) in records.iter().enumerate() {
        compressor.compress_one(record).unwrap();
        if format >= 6 && number % 20 == 19 {
            compressor.finish_current_chunk().unwrap();
        }
    }
    compressor.done().unwrap();
    drop(compressor);
    file.into_inner()
}

fn load(content: &[u8]) -> Result<Mesh> {
    let folder = Folder::new();
    read_with(&folder.write("a.laz", content), read)
}

#[test]
fn every_format_plain_and_packed() {
    for format in [0, 1, 2, 3, 6, 7, 8] {
        for largest in [255, 0xffff] {
            let records: Vec<Vec<u8>> =
                (0..50).map(|i| record(format, i, largest, i == 7)).collect();
            for content in [las(format, &records), laz(format, &records, 50)] {
                let mesh = load(&content).unwrap_or_else(|error| panic!("{format}: {error}"));
                assert_eq!(mesh.positions.len(), 49, "{format}");
                let expected = |i: i32| {
                    DVec3::from_array(
                        [0, 1, 2].map(|a| OFFSET[a] + SCALE * f64::from(i * 7 + a as i32)),
                    )
                };
                // Accurate to 0.01 mm, thousands of kilometres from the origin.
                assert!(
                    (mesh.origin + mesh.positions[6].as_dvec3()).distance(expected(6)) < 1e-5,
                    "{format}"
                );
                assert!(
                    (mesh.origin + mesh.positions[48].as_dvec3()).distance(expected(49)) < 1e-5,
                    "{format}"
                );
                if matches!(format, 2 | 3 | 7 | 8) {
                    assert_eq!(mesh.colors[5], [255, 127, 85, 255], "{format}: {largest}");
                } else {
                    assert_eq!(
                        (mesh.colors[0], mesh.colors[48]),
                        ([0, 0, 0, 255], [255; 4]),
                        "{format}"
                    );
                }
            }
        }
    }
}

/// Chunks are unpacked as a whole, so a file with huge chunks is not read in pieces.
#[test]
fn huge_chunks_are_no_pieces() {
    let most = 1 << 21;
    for (count, streams) in [(most, true), (most + 1, false)] {
        let records = vec![record(0, 5, 0, false); count];
        let bytes = in_chunks_of(1 << 22, 0, &records, count as u64);
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a.laz"), &bytes, &limits).unwrap();
        assert_eq!(crate::formats::Stream::of(source).unwrap().is_some(), streams);
        assert_eq!(load(&bytes).unwrap().positions.len(), count);
    }
}

#[test]
fn every_cut_is_an_error() {
    let folder = Folder::new();
    for format in [0, 3, 6, 7] {
        let records: Vec<Vec<u8>> = (0..30).map(|i| record(format, i, 255, false)).collect();
        every_cut(&folder, "a.las", &las(format, &records), read);
        // After the chunk table, reading needs only the end of its code.
        let whole = laz(format, &records, 30);
        for end in 0..whole.len() - 8 {
            match load(&whole[..end]) {
                Err(Error::Input { place, .. }) => assert!(!place.is_empty()),
                Err(other) => panic!("cut at {end}: {other}"),
                Ok(_) => panic!("format {format}, cut at {end} of {}: was read", whole.len()),
            }
        }
    }
}

#[test]
fn lies_are_errors() {
    let records: Vec<Vec<u8>> = (0..30).map(|i| record(7, i, 255, false)).collect();
    let plain = las(7, &records);
    let packed = laz(7, &records, 30);
    let change = |file: &[u8], at: usize, bytes: &[u8]| {
        let mut file = file.to_vec();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let start = u32::from_le_bytes(*packed[96..].first_chunk().unwrap()) as usize;
    let table = i64::from_le_bytes(*packed[start..].first_chunk().unwrap()) as usize;
    for (content, word) in [
        (change(&plain, 247, &31u64.to_le_bytes()), "counts 31 points of 36 bytes"),
        (change(&plain, 104, &[11]), "format 11"),
        (change(&plain, 105, &[35]), "35 bytes, but those of format 7 need 36"),
        (change(&plain, 96, &[255; 4]), "at byte 4294967295"),
        (change(&plain, 131, &f64::NAN.to_le_bytes()), "the scale"),
        (change(&plain, 24, &[2]), "version 2.4"),
        (change(&plain, 104, &[0x87]), "no LASzip record"),
        (laz(7, &records, 31), "has 30 points, but the header counts 31"),
        (change(&packed, start, &[255, 255, 255, 127]), "outside of the file"),
        (change(&packed, table + 4, &[255; 4]), "claims 4294967295 chunks"),
        // A layer of 4 GB.
        (change(&packed, start + 8 + 36 + 4, &[255; 4]), "bytes of layers"),
        (change(&packed, 105, &[40]), "packs points of 36 bytes"),
        (las(7, &[]), "no points"),
    ] {
        let message = load(&content).unwrap_err().to_string();
        assert!(message.contains(word), "{word}: {message}");
    }
    for points in [1 << 32, u64::MAX] {
        for file in [&plain, &packed] {
            assert!(matches!(
                load(&change(file, 247, &u64::to_le_bytes(points))),
                Err(Error::Limit { .. })
            ));
        }
    }
    let folder = Folder::new();
    let path = folder.write("a.las", plain);
    let limits = Limits { points: 29, ..Limits::default() };
    assert!(matches!(read(&Source::open(&path, &limits).unwrap()), Err(Error::Limit { .. })));
}

/// Whatever byte is changed, the file is either read or refused.
#[test]
fn no_changed_byte_does_harm() {
    for format in [3, 7] {
        let records: Vec<Vec<u8>> = (0..30).map(|i| record(format, i, 255, false)).collect();
        let whole = laz(format, &records, 30);
        for at in 0..whole.len() {
            for value in [0, 1, 127, 255] {
                let mut changed = whole.clone();
                changed[at] = value;
                if let Err(error) = load(&changed) {
                    assert!(
                        matches!(error, Error::Input { .. } | Error::Limit { .. }),
                        "{at}: {error}"
                    );
                }
            }
        }
    }
}

/// Sets what a user may colour by.
fn attributed(format: u8, number: i32) -> Vec<u8> {
    let mut record = record(format, number, 0xffff, false);
    let time = (1e9 + f64::from(number) * 0.5).to_le_bytes();
    if format < 6 {
        record[14] = 2 | 3 << 3;
        record[15] = number as u8 % 12;
        record[16] = -(number as i8) as u8;
        record[18..20].copy_from_slice(&77u16.to_le_bytes());
        if matches!(format, 1 | 3..=5) {
            record[20..28].copy_from_slice(&time);
        }
    } else {
        record[14] = 2 | 3 << 4;
        record[16] = number as u8 % 12;
        record[18..20].copy_from_slice(&(-1000 * number as i16).to_le_bytes());
        record[20..22].copy_from_slice(&77u16.to_le_bytes());
        record[22..30].copy_from_slice(&time);
    }
    record
}

#[test]
fn attributes_are_read_by_name() {
    let folder = Folder::new();
    for format in [0, 1, 2, 3, 6, 7] {
        let records: Vec<Vec<u8>> = (0..30).map(|i| attributed(format, i)).collect();
        for (name, content) in
            [("a.las", las(format, &records)), ("b.laz", laz(format, &records, 30))]
        {
            let path = folder.write(name, content);
            let value = |name: &str| {
                read_with(&path, |source| read_named(source, Some(name))).map(|mesh| mesh.values[7])
            };
            let angle = if format < 6 { -7.0 } else { -42.0 };
            for (name, wanted) in [
                ("intensity", 21.0),
                ("Classification", 7.0),
                ("return_number", 2.0),
                ("number_of_returns", 3.0),
                ("scan_angle", angle),
                ("point_source_id", 77.0),
            ] {
                assert_eq!(value(name).unwrap(), wanted, "{format}: {name}");
            }
            let timed = matches!(format, 1 | 3..) && path.ends_with("a.las");
            assert_eq!(value("gps_time").ok(), timed.then_some(3.5), "{format}");
            assert_eq!(value("green").is_ok(), matches!(format, 2 | 3 | 7), "{format}");
        }
    }
    let path = folder.write("a.las", las(0, &[attributed(0, 1)]));
    let error = read_with(&path, |source| read_named(source, Some("heat"))).unwrap_err();
    let Error::Input { hint: Some(hint), .. } = &error else { panic!("{error}") };
    assert!(error.to_string().contains("no attribute “heat”"), "{error}");
    assert!(hint.contains("intensity, return_number") && !hint.contains("gps_time"), "{hint}");
}

/// Records of format 1 with extra bytes: a height in whole millimetres, a pair, and a quality with
/// a value that stands for none.
#[test]
fn extra_bytes_are_attributes_by_name() {
    let description = |kind: u8, options: u8, name: &str| {
        let mut record = vec![0; 192];
        (record[2], record[3]) = (kind, options);
        record[4..4 + name.len()].copy_from_slice(name.as_bytes());
        record[40..48].copy_from_slice(&255u64.to_le_bytes());
        record[112..120].copy_from_slice(&0.001f64.to_le_bytes());
        record[136..144].copy_from_slice(&10.0f64.to_le_bytes());
        record
    };
    let vlr = |user: &str, id: u16, data: &[u8]| {
        let mut head = vec![0; 54];
        head[2..2 + user.len()].copy_from_slice(user.as_bytes());
        head[18..20].copy_from_slice(&id.to_le_bytes());
        head[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
        [head, data.to_vec()].concat()
    };
    let fields = [
        description(6, 0b11000, "height"),
        description(0, 3, ""),
        description(13, 0, "pair"),
        description(1, 1, "quality"),
    ];
    let keys: Vec<u8> =
        [1u16, 1, 0, 1, 3072, 0, 1, 25832].iter().flat_map(|word| word.to_le_bytes()).collect();
    let records =
        [vlr("LASF_Spec", 4, &fields.concat()), vlr("LASF_Projection", 34735, &keys)].concat();
    let points: Vec<Vec<u8>> = (0..10i32)
        .map(|number| {
            let mut point = record(1, number, 0, false);
            point.extend((number * 1000).to_le_bytes());
            point.extend([9; 3]);
            point.extend((number as u16).to_le_bytes());
            point.extend((2 * number as u16).to_le_bytes());
            point.push(if number == 7 { 255 } else { number as u8 });
            point
        })
        .collect();
    let mut head = header(2, 1, 227 + records.len(), 2, 10);
    head[105..107].copy_from_slice(&(points[0].len() as u16).to_le_bytes());
    let folder = Folder::new();
    let path = folder.write("a.las", [head, records, points.concat()].concat());
    let named = |name: &str| read_with(&path, |source| read_named(source, Some(name))).unwrap();
    assert_eq!(named("height").values[..3], [10.0, 11.0, 12.0]);
    assert_eq!((named("pair[0]").values[3], named("Pair[1]").values[3]), (3.0, 6.0));
    let quality = named("quality");
    assert!(quality.values[7].is_nan() && quality.values[6] == 6.0);
    let attributes = quality.about.attributes;
    assert!(attributes.ends_with(&["height", "pair[0]", "pair[1]", "quality"].map(String::from)));
    assert!(attributes.contains(&"gps_time".to_owned()), "{attributes:?}");
    assert_eq!(quality.about.crs, "EPSG:25832");
    assert_eq!(quality.about.layout, "LAS 1.2, point format 1");
}

/// The oldest packed files have neither chunks nor a table of them.
#[test]
fn packed_files_without_chunks_are_read() {
    let records: Vec<Vec<u8>> = (0..30).map(|number| record(1, number, 0, false)).collect();
    let whole = in_chunks_of(100, 1, &records, 30);
    let start = u32::from_le_bytes(*whole[96..].first_chunk().unwrap()) as usize;
    let table = i64::from_le_bytes(*whole[start..].first_chunk().unwrap()) as usize;
    let mut old = [&whole[..start], &whole[start + 8..table]].concat();
    // The first number of the record that describes the packing, after its head.
    old[227 + 54..227 + 56].copy_from_slice(&1u16.to_le_bytes());
    let folder = Folder::new();
    let mesh = read_with(&folder.write("a.laz", &old), read).unwrap();
    let known = read_with(&folder.write("b.laz", &whole), read).unwrap();
    assert_eq!((mesh.positions, mesh.origin), (known.positions, known.origin));
}
