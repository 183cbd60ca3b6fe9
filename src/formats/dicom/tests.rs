//! Files are written by `Made`, a writer of its own; tests/files/medical.rs reads those of pydicom.

mod made;
mod segmentations;
mod series_of_files;

use super::*;
use crate::{
    about::{Modality, Orientation},
    error::LimitKind,
    input::{
        Limits,
        testing::{Folder, every_cut, read_with},
    },
    volume::{Arrangement, Samples},
};
use glam::DVec3;
use made::Made;

fn read_made(made: &Made) -> Volume {
    read_bytes(&made.file()).unwrap()
}

fn read_bytes(bytes: &[u8]) -> Result<Volume> {
    let folder = Folder::new();
    read_with(&folder.write("a.dcm", bytes), |source| read(source, &ReadOptions::default()))
}

fn error_of(bytes: &[u8]) -> String {
    read_bytes(bytes).unwrap_err().to_string()
}

fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.len()).map(|i| volume.value(i)).collect()
}

const SYNTAXES: [&str; 4] = ["", ".1", ".2", ".1.99"];

#[test]
fn a_slice_in_every_coding() {
    for syntax in SYNTAXES {
        let mut made = Made::slice(syntax, 3, 2);
        made.shorts(tags::PIXEL_DATA, "OW", &[0, 1, 2, 1000, 2000, 4095]);
        made.text(tags::INTERCEPT, "-1024").text(tags::SLOPE, "1");
        made.text(tags::PIXEL_SPACING, "0.5\\0.25").text(tags::SLICE_THICKNESS, "2");
        made.text(tags::POSITION, "-10\\20\\30.5").text(tags::ORIENTATION, "1\\0\\0\\0\\1\\0");
        made.text(tags::WINDOW_CENTER, "40\\300").text(tags::WINDOW_WIDTH, "400\\1500");
        let volume = read_made(&made);
        let expected = vec![-1024, -1023, -1022, -24, 976, 3071];
        assert_eq!(volume.samples, Samples::I16(expected), "“{syntax}”");
        assert_eq!(volume.lattice.dims, [3, 2, 1]);
        // DICOM's x leads to the left and y to the back.
        assert_eq!(volume.lattice.origin, DVec3::new(10.0, -20.0, 30.5));
        let axes = [[-0.25, 0.0, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, 2.0]];
        assert_eq!(volume.lattice.axes.to_cols_array_2d(), axes);
        let about = &volume.about;
        assert_eq!((about.modality, about.window), (Some(Modality::Ct), Some([-160.0, 240.0])));
        assert_eq!((&*about.unit, &*about.length), ("HU", "mm"));
        // One slice is seen as on film.
        let orientation = Orientation { up: DVec3::Y, front: DVec3::NEG_Z };
        assert_eq!(about.orientation, Some(orientation));
        assert!(is_dicom(&made.file()), "“{syntax}”");
        // Without the preamble, and without the header.
        assert_eq!(values(&read_bytes(&made.file()[128 + 4..]).unwrap()), values(&volume));
        if syntax != ".1.99" {
            assert!(is_dicom(&made.bare()), "“{syntax}”");
            assert_eq!(values(&read_bytes(&made.bare()).unwrap()), values(&volume));
        }
    }
}

#[test]
fn a_data_set_without_types_is_read_whatever_its_syntax_says() {
    let mut made = Made::slice("", 2, 1);
    made.shorts(tags::PIXEL_DATA, "OW", &[7, 8]);
    let header = Made::slice(".1", 2, 1).file();
    let start = header.windows(4).position(|tag| tag == [8, 0, 5, 0]).unwrap();
    let volume = read_bytes(&[&header[..start], &made.bare()].concat()).unwrap();
    assert_eq!(values(&volume), [7.0, 8.0]);
}

#[test]
fn every_kind_of_number() {
    for (allocated, stored, signed, words, expected) in [
        // Bits that are not stored hold an overlay.
        (16, 12, 0, [0xf123u16, 0x0fff], [0x123, 0xfff]),
        (16, 12, 1, [0xf123, 0x0fff], [0x123, -1]),
        (16, 16, 1, [0x8000, 0x7fff], [-32768, 32767]),
        (16, 16, 0, [0x8000, 0xffff], [32768, 65535]),
    ] {
        for syntax in SYNTAXES {
            let mut made = Made::slice(syntax, 2, 1);
            made.bits(allocated, stored, signed).shorts(tags::PIXEL_DATA, "OW", &words);
            assert_eq!(values(&read_made(&made)), expected.map(f64::from));
        }
    }
    for (bits, signed, bytes, expected) in [
        (8, 0, vec![200u8, 7], vec![200.0, 7.0]),
        (8, 1, vec![200, 7], vec![-56.0, 7.0]),
        (32, 0, vec![0, 0, 0, 0x80, 1, 0, 0, 0], vec![2_147_483_648.0, 1.0]),
        (32, 1, vec![255, 255, 255, 255, 1, 0, 0, 0], vec![-1.0, 1.0]),
        (1, 0, vec![0b10, 0], vec![0.0, 1.0]),
    ] {
        let mut made = Made::slice(".1", 2, 1);
        made.bits(bits, bits, signed).bytes(tags::PIXEL_DATA, "OB", &bytes);
        assert_eq!(values(&read_made(&made)), expected);
    }
    let mut made = Made::slice(".1", 2, 1);
    made.bytes(tags::FLOAT_PIXELS, "OF", &[0, 0, 128, 63, 0, 0, 0, 64]).without(tags::PIXEL_DATA);
    assert_eq!(values(&read_made(&made)), [1.0, 2.0]);
    let doubles = [1.5f64, f64::NAN].map(f64::to_le_bytes).concat();
    made.bytes(tags::DOUBLE_PIXELS, "OD", &doubles).without(tags::FLOAT_PIXELS);
    let volume = read_made(&made);
    assert_eq!((values(&volume), volume.about.holes), (vec![1.5, 1.5], 1));
    // In words whose high byte comes first, the second byte is the first pixel.
    let mut made = Made::slice(".2", 2, 1);
    made.bits(8, 8, 0).shorts(tags::PIXEL_DATA, "OW", &[0x0201]);
    assert_eq!(values(&read_made(&made)), [1.0, 2.0]);
}

#[test]
fn colours_are_luminances_and_inverted_values_turned() {
    let with = |name: &str, planar: u16, pixels: &[u8]| {
        let mut made = Made::slice(".1", 2, 1);
        made.bits(8, 8, 0).short(tags::SAMPLES_PER_PIXEL, 3).text(tags::PHOTOMETRIC, name);
        made.short(tags::PLANAR, planar).bytes(tags::PIXEL_DATA, "OB", pixels);
        values(&read_made(&made))
    };
    assert_eq!(with("RGB", 0, &[255, 0, 0, 9, 9, 9]), [76.0, 9.0]);
    assert_eq!(with("RGB", 1, &[255, 9, 0, 9, 0, 9]), [76.0, 9.0]);
    assert_eq!(with("YBR_FULL", 0, &[50, 1, 1, 60, 1, 1]), [50.0, 60.0]);
    assert_eq!(with("YBR_FULL", 1, &[50, 60, 1, 1, 1, 1]), [50.0, 60.0]);
    assert_eq!(with("YBR_FULL_422", 0, &[50, 60, 1, 1]), [50.0, 60.0]);
    let mut made = Made::slice(".1", 4, 1);
    made.bits(8, 8, 0).text(tags::PHOTOMETRIC, "PALETTE COLOR");
    made.bytes(tags::PIXEL_DATA, "OB", &[4, 5, 6, 200]);
    for at in 0..3 {
        made.shorts(tags::PALETTE_RED_SHAPE + at, "US", &[3, 5, 16]);
        made.shorts(tags::PALETTE_RED + at, "OW", &[0x1000, 0x2000, 0xff00]);
    }
    assert_eq!(values(&read_made(&made)), [16.0, 16.0, 32.0, 255.0]);
    let colors = |made: &mut Made| read_made(made).colors.map(|colors| colors.to_vec());
    assert_eq!(colors(&mut made), None, "greys are values");
    made.shorts(tags::PALETTE_RED, "OW", &[0xc800, 0, 0xff00]);
    let [red, cyan] = [[200, 16, 16, 255], [0, 32, 32, 255]];
    assert_eq!(colors(&mut made).unwrap(), [red, red, cyan, [255; 4]]);
    let mut pixels = Made::slice(".1", 2, 1);
    pixels.bits(8, 8, 0).short(tags::SAMPLES_PER_PIXEL, 3).text(tags::PHOTOMETRIC, "RGB");
    pixels.short(tags::PLANAR, 1).bytes(tags::PIXEL_DATA, "OB", &[200, 9, 40, 9, 40, 200]);
    assert_eq!(colors(&mut pixels).unwrap(), [[200, 40, 40, 255], [9, 9, 200, 255]]);
    // Red in the terms of YBR, rounded (ITU-R BT.601).
    pixels.short(tags::PLANAR, 0).text(tags::PHOTOMETRIC, "YBR_FULL");
    pixels.bytes(tags::PIXEL_DATA, "OB", &[76, 85, 255, 76, 85, 255]);
    assert_eq!(colors(&mut pixels).unwrap()[0], [254, 0, 0, 255]);
    pixels.text(tags::PHOTOMETRIC, "YBR_FULL_422");
    pixels.bytes(tags::PIXEL_DATA, "OB", &[76, 76, 85, 255]);
    assert_eq!(colors(&mut pixels).unwrap()[1], [254, 0, 0, 255]);
    made.without(tags::PALETTE_RED + 1);
    assert!(error_of(&made.file()).contains("palette: has fewer colours than its shape says"));
    for (bits, pixels) in [(8, vec![10u8, 30]), (16, vec![10, 0, 30, 0])] {
        let mut made = Made::slice(".1", 2, 1);
        made.bits(bits, bits, 0).text(tags::PHOTOMETRIC, "MONOCHROME1");
        made.text(tags::WINDOW_CENTER, "15").text(tags::WINDOW_WIDTH, "10");
        made.bytes(tags::PIXEL_DATA, "OB", &pixels);
        let volume = read_made(&made);
        assert_eq!((values(&volume), volume.range), (vec![30.0, 10.0], [10.0, 30.0]));
        assert_eq!(volume.about.window, Some([20.0, 30.0]));
    }
}

#[test]
fn padding_is_a_hole() {
    let mut made = Made::slice(".1", 4, 1);
    made.bits(16, 16, 1).shorts(tags::PIXEL_DATA, "OW", &[0xf830, 24, 1024, 0xf830]);
    made.text(tags::SLOPE, "1").text(tags::INTERCEPT, "-24").shorts(tags::PADDING, "SS", &[0xf830]);
    let volume = read_made(&made);
    assert_eq!(volume.samples, Samples::I16(vec![0, 0, 1000, 0]));
    assert_eq!(volume.about.holes, 2);
    made.shorts(tags::PADDING_LIMIT, "SS", &[24]);
    assert_eq!(read_made(&made).range, [1000.0, 1000.0]);
    // If everything is padding, the mark is wrong.
    made.shorts(tags::PADDING_LIMIT, "SS", &[2000]);
    assert_eq!(read_made(&made).about.holes, 0);
}

#[test]
fn run_lengths() {
    // Literal bytes and runs; the high bytes come first.
    let segments: [&[u8]; 2] = [&[253, 1], &[1, 5, 6, 255, 7]];
    let mut frame = Vec::new();
    [2u32, 64, 66].iter().for_each(|n| frame.extend(n.to_le_bytes()));
    frame.resize(64, 0);
    segments.iter().for_each(|part| frame.extend(*part));
    frame.resize(frame.len().next_multiple_of(2), 0);
    let mut made = Made::slice(".5", 4, 1);
    made.fragments(&[&[], &frame]);
    assert_eq!(values(&read_made(&made)), [261.0, 262.0, 263.0, 263.0]);
    let mut change = |at: usize, byte: u8, message: &str| {
        let mut frame = frame.clone();
        frame[at] = byte;
        made.fragments(&[&[], &frame]);
        assert!(error_of(&made.file()).contains(message), "{}", error_of(&made.file()));
    };
    change(0, 3, "pixel data, frame 0: cannot be unpacked: 3 segments where 2 were expected");
    change(64, 254, "segment 0 holds 3 of 4 bytes");
    change(8, 250, "segment 0 lies outside the frame");
    change(4, 3, "segment 0 lies outside the frame");
}

/// The example of ITU-T T.87, annex H.3: 4 × 4 numbers.
#[test]
fn jpeg_ls() {
    let stream = [
        0xff, 0xd8, 0xff, 0xf7, 0, 11, 8, 0, 4, 0, 4, 1, 1, 0x11, 0, 0xff, 0xda, 0, 8, 1, 1, 0, 0,
        0, 0, 0xc0, 0, 0, 0x6c, 0x80, 0x20, 0x8e, 0x01, 0xc0, 0, 0, 0x57, 0x40, 0, 0, 0x6e, 0xe6,
        0, 0, 0x01, 0xbc, 0x18, 0, 0, 0x05, 0xd8, 0, 0, 0x91, 0x60, 0xff, 0xd9,
    ];
    let mut made = Made::slice(".4.80", 4, 4);
    made.bits(8, 8, 0).fragments(&[&[], &stream]);
    let expected =
        [0, 0, 90, 74, 68, 50, 43, 205, 64, 145, 145, 145, 100, 145, 145, 145].map(f64::from);
    assert_eq!(values(&read_made(&made)), expected);
    for end in 0..stream.len() - 2 {
        made.fragments(&[&[], &stream[..end]]);
        assert!(error_of(&made.file()).contains("frame 0"), "{end}");
    }
}

#[test]
fn frames_are_found_in_fragments() {
    // Uncompressed frames in fragments show which fragments a frame has.
    let two = |fragments: &[&[u8]]| {
        let mut made = Made::slice(".1.98", 2, 1);
        made.bits(8, 8, 0).text(tags::FRAMES, "2").text(tags::SPACING_BETWEEN_SLICES, "3");
        made.fragments(fragments);
        read_bytes(&made.file()).map(|volume| values(&volume))
    };
    assert_eq!(two(&[&[], &[1, 2], &[3, 4]]).unwrap(), [1.0, 2.0, 3.0, 4.0]);
    let table = [0u32, 20].map(u32::to_le_bytes).concat();
    let parts: [&[u8]; 4] = [&table, &[1, 2], &[0, 0], &[3, 4]];
    assert_eq!(two(&parts).unwrap(), [1.0, 2.0, 3.0, 4.0]);
    let error = two(&[&[], &[1, 2], &[3, 4], &[5, 6]]).unwrap_err().to_string();
    assert!(error.contains("is missing: there are 3 fragments for 2 frames"), "{error}");
}

/// A grey picture of JPEG 2000 with a byte a pixel: five levels, all of them empty.
fn grey_2000(side: u32) -> Vec<u8> {
    let mut stream = vec![0xff, 0x4f, 0xff, 0x51, 0, 41, 0, 0];
    for number in [side, side, 0, 0, side, side, 0, 0] {
        stream.extend(number.to_be_bytes());
    }
    stream.extend([0, 1, 7, 1, 1]);
    stream.extend([0xff, 0x52, 0, 12, 0, 0, 0, 1, 0, 5, 4, 4, 0, 1]);
    stream.extend([0xff, 0x5c, 0, 19, 0x40]);
    stream.extend([0x48; 16]);
    stream.extend([0xff, 0x90, 0, 10, 0, 0, 0, 0, 0, 20, 0, 1, 0xff, 0x93]);
    stream.extend([0; 6]);
    stream.extend([0xff, 0xd9]);
    stream
}

#[test]
fn frames_of_one_file_share_the_time_limit() {
    let file = |side: u16, frames: usize| {
        let mut made = Made::slice(".4.90", side, side);
        made.bits(8, 8, 0).text(tags::FRAMES, &frames.to_string());
        made.text(tags::SPACING_BETWEEN_SLICES, "3");
        let frame = grey_2000(side.into());
        let mut fragments: Vec<&[u8]> = vec![&[]];
        fragments.extend(std::iter::repeat_n(&frame[..], frames));
        made.fragments(&fragments);
        made.file()
    };
    let volume = read_bytes(&file(16, 2)).unwrap();
    assert_eq!(values(&volume), [128.0; 512]);
    // Minutes of work for each thread.
    let folder = Folder::new();
    let path = folder.write("a.dcm", file(1024, 4096));
    let limits = Limits { seconds: 1, ..Limits::default() };
    let source = Source::open(&path, &limits).unwrap();
    let error = read(&source, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Limit { kind: LimitKind::Seconds, .. }), "{error}");
}

#[test]
fn tiles_take_memory() {
    let mut made = Made::slice(".4.90", 1024, 1024);
    let mut frame = grey_2000(1024);
    // Tiles of 4 × 4 pixels: 65,536 of them.
    frame[24..32].copy_from_slice(&[0, 0, 0, 4, 0, 0, 0, 4]);
    made.bits(8, 8, 0).fragments(&[&[], &frame]);
    let folder = Folder::new();
    let path = folder.write("a.dcm", made.file());
    let limits = Limits { bytes: 64 << 20, ..Limits::default() };
    let error = read(&Source::open(&path, &limits).unwrap(), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Limit { kind: LimitKind::Bytes, .. }), "{error}");
    // Also in a file of boxes, of which one only looks like a stream.
    let mut boxed = vec![0, 0, 0, 12, b'j', b'P', b' ', b' ', 13, 10, 0x87, 10];
    let decoy = grey_2000(1024);
    boxed.extend((8 + decoy.len() as u32).to_be_bytes());
    boxed.extend(b"uuid");
    boxed.extend(decoy);
    boxed.extend([0, 0, 0, 0, b'j', b'p', b'2', b'c']);
    boxed.extend(frame);
    made.fragments(&[&[], &boxed]);
    let path = folder.write("b.dcm", made.file());
    let error = read(&Source::open(&path, &limits).unwrap(), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Limit { kind: LimitKind::Bytes, .. }), "{error}");
}

#[test]
fn what_is_not_read_is_told() {
    let mut made = Made::slice(".4.110", 2, 1);
    made.fragments(&[&[], &[1, 2]]);
    let message = error_of(&made.file());
    assert!(
        message.contains("packed by JPEG XL (transfer syntax 1.2.840.10008.1.2.4.110)"),
        "{message}"
    );
    let mut made = Made::slice(".4.70", 2, 1);
    made.fragments(&[&[], &[0xff, 0xd8, 0xff, 0xc3, 0, 11, 8, 0, 9, 0, 9, 1, 1, 1, 1]]);
    assert!(error_of(&made.file()).contains("a picture of 9 × 9 pixels, not of 2 × 1"));
    made.fragments(&[&[], &[0xff, 0xd8, 0xff, 0xc3, 0, 11, 8, 0, 1, 0, 2, 1, 1, 1, 1]]);
    assert!(error_of(&made.file()).contains("frame 0: cannot be"), "{}", error_of(&made.file()));
    let mut made = Made::slice(".4.90", 2, 1);
    made.fragments(&[&[], &[0xff, 0x4f, 1, 2]]);
    assert!(error_of(&made.file()).contains("its header is damaged"));
    assert!(error_of(b"no DICOM at all, but a file").contains("header: is not DICOM"));
}

/// The error of a file of two pixels, changed.
fn error_of_change(change: impl FnOnce(&mut Made)) -> String {
    let mut made = Made::slice(".1", 2, 1);
    made.shorts(tags::PIXEL_DATA, "OW", &[1, 2]);
    change(&mut made);
    error_of(&made.file())
}

#[test]
fn pixels_that_do_not_fit_are_told() {
    for (error, message) in [
        (
            error_of_change(|made| {
                made.without(tags::ROWS);
            }),
            "Rows: is missing, but a number of pixels",
        ),
        (
            error_of_change(|made| {
                made.short(tags::COLUMNS, 0);
            }),
            "Columns: is 0, but a number",
        ),
        (
            error_of_change(|made| {
                made.bits(12, 12, 0);
            }),
            "Bits Allocated: is 12, but 1, 8, 16 or 32",
        ),
        (
            error_of_change(|made| {
                made.bits(16, 17, 0);
            }),
            "17 bits up to bit 16 do not lie in the 16",
        ),
        (
            error_of_change(|made| {
                made.short(tags::ROWS, 2);
            }),
            "2 × 2 pixels needs 8 bytes, but the",
        ),
    ] {
        assert!(error.contains(message), "{error} / {message}");
    }
}

#[test]
fn files_without_usable_pixels_are_told() {
    for (error, message) in [
        (
            error_of_change(|made| {
                made.text(tags::FRAMES, "9");
            }),
            "Number of Frames: is 9, but",
        ),
        (
            error_of_change(|made| {
                made.text(tags::FRAMES, "0");
            }),
            "Number of Frames: is 0, but",
        ),
        (
            error_of_change(|made| {
                made.text(tags::PHOTOMETRIC, "ARGB").short(tags::SAMPLES_PER_PIXEL, 4);
            }),
            "“ARGB” of 4 numbers a pixel is not read",
        ),
        (
            error_of_change(|made| {
                made.without(tags::PIXEL_DATA);
            }),
            "holds other data",
        ),
        (
            error_of_change(|made| {
                made.without(tags::PIXEL_DATA).text(tags::CLASS, "1.2.840.10008.5.1.4.1.1.481.3");
            }),
            "holds outlines of radiotherapy",
        ),
        (
            error_of_change(|made| {
                made.text(tags::CLASS, "1.2.840.10008.5.1.4.1.1.77.1.6");
            }),
            "SOP class: holds tiles of a whole slide, not slices of a volume",
        ),
        (
            error_of_change(|made| {
                made.without(tags::PIXEL_DATA).text(tags::CLASS, "1.2.840.10008.5.1.4.1.1.88.33");
            }),
            "holds a report",
        ),
    ] {
        assert!(error.contains(message), "{error} / {message}");
    }
}

#[test]
fn damaged_files_are_told() {
    let folder = Folder::new();
    let read = |source: &Source| read(source, &ReadOptions::default());
    for syntax in ["", ".1", ".2"] {
        let mut made = Made::slice(syntax, 3, 1);
        made.text(tags::POSITION, "1\\2\\3").shorts(tags::PIXEL_DATA, "OW", &[1, 2, 3]);
        made.sequence(tags::ULTRASOUND_REGIONS, &[Made::new(syntax)]);
        every_cut(&folder, "a.dcm", &made.file(), read);
    }
    let mut made = Made::slice(".5", 1, 1);
    made.fragments(&[&[], &[1, 2]]);
    let bytes = made.file();
    for end in 0..bytes.len() {
        assert!(read_bytes(&bytes[..end]).is_err());
    }
    // Lengths and nesting are claims.
    let mut made = Made::slice(".1", 1, 1);
    made.bytes(tags::PIXEL_DATA, "OW", &[1, 2]);
    let mut bytes = made.file();
    let end = bytes.len();
    bytes[end - 6..end - 2].copy_from_slice(&0xffff_fffe_u32.to_le_bytes());
    assert!(error_of(&bytes).contains("4294967294 bytes were expected, but the file ends after 2"));
    let mut bytes = Made::new(".1").file();
    let deep = [0x08, 0, 0x15, 0x11, b'S', b'Q', 0, 0, 255, 255, 255, 255];
    let item = [0xfe, 0xff, 0, 0xe0, 255, 255, 255, 255];
    for _ in 0..100_000 {
        bytes.extend(deep);
        bytes.extend(item);
    }
    let error = read_bytes(&bytes).unwrap_err();
    assert!(matches!(error, Error::Limit { .. }), "{error}");
    let mut bytes = made.file();
    let at = bytes.len() - 14;
    bytes[at + 4] = 7;
    assert!(error_of(&bytes).contains("has no type of values"), "{}", error_of(&bytes));
    // A small stream that unpacks to much.
    let mut bomb = Made::slice(".1.99", 1, 1);
    bomb.bytes(tags::PIXEL_DATA, "OB", &vec![0; 8 << 20]);
    let limits = Limits { bytes: 1 << 20, ..Limits::default() };
    let path = folder.write("bomb.dcm", bomb.file());
    let source = Source::open(&path, &limits).unwrap();
    assert!(matches!(read(&source), Err(Error::Limit { .. })));
}

#[test]
fn one_file_of_many_frames() {
    let pixels = [1, 2, 3, 4, 5, 6];
    let film = |change: &dyn Fn(&mut Made)| {
        let mut made = Made::slice(".1", 2, 1);
        made.text(tags::FRAMES, "3").shorts(tags::PIXEL_DATA, "OW", &pixels);
        change(&mut made);
        made
    };
    // With a step, the frames are slices.
    let made = film(&|made: &mut Made| {
        made.text(tags::SPACING_BETWEEN_SLICES, "1.5").text(tags::POSITION, "0\\0\\9");
        made.text(tags::ORIENTATION, "0\\1\\0\\0\\0\\-1");
    });
    let volume = read_made(&made);
    assert_eq!((volume.lattice.dims, values(&volume)), ([2, 1, 3], pixels.map(f64::from).into()));
    assert_eq!(volume.lattice.axes.z_axis, DVec3::new(1.5, 0.0, 0.0));
    // Those of ultrasound without one are times.
    let made = film(&|made: &mut Made| {
        made.text(tags::MODALITY, "US").text(tags::FRAME_TIME, "33");
    });
    let folder = Folder::new();
    let path = folder.write("a.dcm", made.file());
    for time in 0..3 {
        let options = ReadOptions { time: Some(time), ..ReadOptions::default() };
        let volume = read_with(&path, |source| read(source, &options)).unwrap();
        assert_eq!(volume.lattice.dims, [2, 1, 1]);
        assert_eq!(volume.value(0), f64::from(pixels[2 * time]));
        assert_eq!(volume.about.modality, Some(Modality::Ultrasound));
    }
    let options = ReadOptions { time: Some(3), ..ReadOptions::default() };
    let error = read_with(&path, |source| read(source, &options)).unwrap_err().to_string();
    assert!(error.contains("has 3 times, but number 3 was asked for"), "{error}");
    // Doses lie at offsets of their own, and have a scale.
    let made = film(&|made: &mut Made| {
        made.text(tags::GRID_OFFSETS, "0\\2\\7").text(tags::DOSE_SCALE, "0.5");
        made.text(tags::POSITION, "0\\0\\100").text(tags::DOSE_UNITS, "GY");
        made.text(tags::MODALITY, "RTDOSE");
    });
    let volume = read_made(&made);
    assert_eq!((volume.range, &*volume.about.unit), ([0.5, 3.0], "Gy"));
    let Arrangement::Rectilinear(places) = &volume.lattice.arrangement else { panic!() };
    assert_eq!(places[2], [0.0, 2.0, 7.0]);
}

#[test]
fn groups_of_functions_place_frames() {
    for syntax in SYNTAXES {
        let item = |change: &dyn Fn(&mut Made)| {
            let mut made = Made::new(syntax);
            change(&mut made);
            made
        };
        let shared = item(&|made: &mut Made| {
            let measures = item(&|made: &mut Made| {
                made.text(tags::PIXEL_SPACING, "2\\3");
            });
            let planes = item(&|made: &mut Made| {
                made.text(tags::ORIENTATION, "1\\0\\0\\0\\1\\0");
            });
            made.sequence(tags::PIXEL_MEASURES, &[measures]);
            made.sequence(tags::PLANE_ORIENTATIONS, &[planes]);
        });
        // Frames in another order than their positions, of two times, with their own slopes.
        let frame = |z: &str, time: u32, slope: &str| {
            item(&|made: &mut Made| {
                let place = item(&|made: &mut Made| {
                    made.text(tags::POSITION, &format!("0\\0\\{z}"));
                });
                let content = item(&|made: &mut Made| {
                    made.long(tags::TEMPORAL_INDEX, time);
                });
                let scale = item(&|made: &mut Made| {
                    made.text(tags::SLOPE, slope);
                });
                made.sequence(tags::PLANE_POSITIONS, &[place]);
                made.sequence(tags::FRAME_CONTENTS, &[content]);
                made.sequence(tags::VALUE_TRANSFORMATIONS, &[scale]);
            })
        };
        let groups =
            [frame("5", 2, "1"), frame("5", 1, "2"), frame("0", 1, "0.5"), frame("0", 2, "1")];
        let mut made = Made::slice(syntax, 1, 1);
        made.text(tags::FRAMES, "4").shorts(tags::PIXEL_DATA, "OW", &[10, 20, 30, 40]);
        made.sequence(tags::SHARED_GROUPS, &[shared]).sequence(tags::FRAME_GROUPS, &groups);
        let folder = Folder::new();
        let path = folder.write("a.dcm", made.file());
        for (time, expected) in [[15.0, 40.0], [40.0, 10.0]].into_iter().enumerate() {
            let options = ReadOptions { time: Some(time), ..ReadOptions::default() };
            let volume = read_with(&path, |source| read(source, &options)).unwrap();
            assert_eq!(values(&volume), expected, "“{syntax}”");
            assert_eq!(volume.lattice.spacing(), DVec3::new(3.0, 2.0, 5.0));
            assert_eq!(volume.about.orientation, Some(Orientation::RAS));
        }
    }
}
