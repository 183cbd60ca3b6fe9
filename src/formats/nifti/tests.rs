use super::*;
use crate::{
    Error,
    input::testing::{Folder, every_cut, read_with},
    volume::Lattice,
};
use flate2::{Compression, write::GzEncoder};
use glam::{DMat3, DVec3};
use std::io::Write;

/// A file in the making: one of version 1 or 2, in either byte order.
#[derive(Clone)]
struct Made {
    second: bool,
    big: bool,
    bytes: Vec<u8>,
}

impl Made {
    /// Bytes of a type and of counts along the axes, without a place in the world.
    fn new(second: bool, big: bool, datatype: i16, dims: &[i64]) -> Self {
        let mut made = Self { second, big, bytes: vec![0; if second { 544 } else { 352 }] };
        let (size, magic, at) = if second { (540, b"n+2\0", 4) } else { (348, b"n+1\0", 344) };
        made.int(0, size);
        made.bytes[at..at + 4].copy_from_slice(magic);
        made.count(0, dims.len() as i64);
        dims.iter().enumerate().for_each(|(axis, &n)| made.count(axis + 1, n));
        made.short(if second { 12 } else { 70 }, datatype);
        (0..8).for_each(|axis| made.step(axis, 1.0));
        made.number([108, 168], if second { f64::from_bits(544) } else { 352.0 });
        made
    }

    fn put<const N: usize>(&mut self, at: usize, mut bytes: [u8; N]) {
        if self.big {
            bytes.reverse();
        }
        self.bytes[at..at + N].copy_from_slice(&bytes);
    }

    fn short(&mut self, at: usize, value: i16) {
        self.put(at, value.to_le_bytes());
    }

    fn int(&mut self, at: usize, value: i32) {
        self.put(at, value.to_le_bytes());
    }

    fn count(&mut self, axis: usize, value: i64) {
        if self.second {
            self.put(16 + 8 * axis, value.to_le_bytes());
        } else {
            self.put(40 + 2 * axis, (value as i16).to_le_bytes());
        }
    }

    /// Sets a number, which is at one of two places and has 4 or 8 bytes.
    fn number(&mut self, at: [usize; 2], value: f64) {
        if self.second {
            self.put(at[1], value.to_le_bytes());
        } else {
            self.put(at[0], (value as f32).to_le_bytes());
        }
    }

    fn step(&mut self, axis: usize, value: f64) {
        self.number([76 + 4 * axis, 104 + 8 * axis], value);
    }

    fn scale(&mut self, slope: f64, intercept: f64) {
        self.number([112, 176], slope);
        self.number([116, 184], intercept);
    }

    /// Sets a unit of length.
    fn unit(&mut self, code: u8) {
        match self.second {
            true => self.int(500, code.into()),
            false => self.bytes[123] = code,
        }
    }

    fn rotation(&mut self, quaternion: [f64; 3], offset: [f64; 3]) {
        match self.second {
            true => self.int(344, 1),
            false => self.short(252, 1),
        }
        for axis in 0..3 {
            self.number([256 + 4 * axis, 352 + 8 * axis], quaternion[axis]);
            self.number([268 + 4 * axis, 376 + 8 * axis], offset[axis]);
        }
    }

    fn matrix(&mut self, rows: [[f64; 4]; 3]) {
        match self.second {
            true => self.int(348, 2),
            false => self.short(254, 2),
        }
        for (i, value) in rows.into_iter().flatten().enumerate() {
            self.number([280 + 4 * i, 400 + 8 * i], value);
        }
    }

    /// Adds numbers of a type, in the file's byte order.
    fn values(&mut self, kind: SampleType, text: &str) -> Vec<u8> {
        let count = text.split_ascii_whitespace().count();
        let bytes = kind.parse(text, count).unwrap();
        for number in bytes.chunks(kind.bytes()) {
            match self.big {
                true => self.bytes.extend(number.iter().rev()),
                false => self.bytes.extend(number),
            }
        }
        self.bytes.clone()
    }
}

const EVERY: [(bool, bool); 4] = [(false, false), (false, true), (true, false), (true, true)];

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::default());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

fn read_bytes(name: &str, bytes: &[u8], options: &ReadOptions) -> Result<Volume> {
    read_with(&Folder::new().write(name, bytes), |source| read(source, options))
}

fn of(bytes: &[u8]) -> Volume {
    read_bytes("a.nii", bytes, &ReadOptions::default()).unwrap()
}

fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.len()).map(|i| volume.value(i)).collect()
}

fn message(bytes: &[u8], options: &ReadOptions) -> String {
    let error = read_bytes("a.nii", bytes, options).unwrap_err();
    let hint = match &error {
        Error::Input { hint, .. } => hint.clone().unwrap_or_default(),
        _ => String::new(),
    };
    format!("{error}; {hint}")
}

#[test]
fn every_type_in_both_versions_and_orders() {
    let types = [(2, "u8"), (4, "i16"), (8, "i32"), (16, "f32"), (64, "f64"), (256, "i8")];
    let wide = [(512, "u16"), (768, "u32"), (1024, "i64"), (1280, "u64")];
    for (second, big) in EVERY {
        for (code, name) in types.into_iter().chain(wide) {
            let mut made = Made::new(second, big, code, &[3, 1, 2]);
            let bytes = made.values(SampleType::from_name(name).unwrap(), "1 2 3 4 5 100");
            let volume = of(&bytes);
            assert_eq!(volume.lattice.dims, [3, 1, 2]);
            assert_eq!(values(&volume), [1.0, 2.0, 3.0, 4.0, 5.0, 100.0], "{name}");
            assert!(volume.about.orientation.is_none() && volume.about.length.is_empty());
            assert!(is_nifti(&bytes) && is_nifti(&gzip(&bytes)));
        }
        let mut made = Made::new(second, big, 32, &[2, 1, 1]);
        assert_eq!(values(&of(&made.values(SampleType::F32, "3 -4 0 2"))), [5.0, 2.0]);
        let mut made = Made::new(second, big, 1792, &[1, 1, 1]);
        assert_eq!(values(&of(&made.values(SampleType::F64, "6 8"))), [10.0]);
        let mut made = Made::new(second, big, 128, &[2, 1, 1]);
        let volume = of(&made.values(SampleType::U8, "9 9 9 255 0 0"));
        assert_eq!(values(&volume), [9.0, 76.0]);
        assert_eq!(volume.colors.as_deref().unwrap()[1], [255, 0, 0, 255]);
        let mut made = Made::new(second, big, 2304, &[1, 2, 1]);
        let colors = made.values(SampleType::U8, "0 255 0 1 7 7 7 255");
        assert_eq!(values(&of(&colors)), [150.0, 7.0]);
    }
}

#[test]
fn the_matrix_places_samples_then_the_rotation_then_the_steps() {
    for (second, big) in EVERY {
        let mut made = Made::new(second, big, 2, &[2, 2, 2]);
        (1..=3).for_each(|axis| made.step(axis, [0.5, 2.0, 4.0][axis - 1]));
        let lattice = |made: &Made| {
            let volume = of(&made.clone().values(SampleType::U8, "1 2 3 4 5 6 7 8"));
            (volume.lattice.clone(), volume.about.orientation.is_some())
        };
        let steps = DMat3::from_diagonal(DVec3::new(0.5, 2.0, 4.0));
        let expected = Lattice::cartesian([2; 3], DVec3::ZERO, steps);
        assert_eq!(lattice(&made), (expected, false));
        // Half a turn about z leaves no first number of the quaternion; slices are mirrored.
        made.rotation([0.0, 0.0, 1.0], [10.0, -20.0, 30.0]);
        made.step(0, -1.0);
        let (placed, is_stated) = lattice(&made);
        let axes = DMat3::from_diagonal(DVec3::new(-0.5, -2.0, -4.0));
        assert!(placed.axes.abs_diff_eq(axes, 1e-15) && is_stated);
        assert_eq!(placed.origin, DVec3::new(10.0, -20.0, 30.0));
        // A turn by 2·acos(a) about (1, 2, 2) / 3.
        made.rotation([0.2, 0.4, 0.4], [0.0; 3]);
        made.step(0, 1.0);
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 2.0 * 0.8f64.acos());
        assert!(lattice(&made).0.axes.abs_diff_eq(turn * steps, 1e-6));
        // The matrix comes first, and may be sheared.
        made.matrix([[0.0, -1.0, 0.5, 7.0], [2.0, 0.0, 0.25, 8.0], [0.0, 0.0, 3.0, 9.0]]);
        let (placed, _) = lattice(&made);
        let [x, y, z] = [[0.0, 2.0, 0.0], [-1.0, 0.0, 0.0], [0.5, 0.25, 3.0]];
        assert_eq!(placed.axes, DMat3::from_cols_array_2d(&[x, y, z]));
        assert_eq!(placed.origin, DVec3::new(7.0, 8.0, 9.0));
        // Unless it spans nothing.
        made.matrix([[0.0; 4]; 3]);
        assert!(lattice(&made).0.axes.abs_diff_eq(turn * steps, 1e-6));
        for (code, scale) in [(1, 1000.0), (2, 1.0), (3, 0.001)] {
            made.unit(code);
            let volume = of(&made.clone().values(SampleType::U8, "1 2 3 4 5 6 7 8"));
            assert!(volume.lattice.axes.abs_diff_eq(turn * steps * scale, 1e-6 * scale));
            assert_eq!(volume.about.length, "mm");
        }
    }
}

#[test]
fn values_are_scaled_and_windows_kept() {
    for (second, big) in EVERY {
        let mut made = Made::new(second, big, 4, &[2, 1, 1]);
        made.scale(0.5, -10.0);
        made.number([128, 200], -5.0);
        made.number([124, 192], 45.0);
        let volume = of(&made.values(SampleType::I16, "4 -6"));
        assert_eq!(volume.samples, Samples::F32(vec![-8.0, -13.0]));
        assert_eq!(volume.about.window, Some([-5.0, 45.0]));
        let mut made = Made::new(second, big, 512, &[2, 1, 1]);
        made.scale(1.0, -1024.0);
        let volume = of(&made.values(SampleType::U16, "0 1064"));
        assert_eq!(volume.samples, Samples::I16(vec![-1024, 40]));
        for slope in [0.0, f64::NAN] {
            made.scale(slope, 3.0);
            assert_eq!(of(&made.bytes).samples, Samples::U16(vec![0, 1064]));
        }
        let mut made = Made::new(second, big, 16, &[3, 1, 1]);
        let volume = of(&made.values(SampleType::F32, "nan 4 2"));
        assert_eq!((values(&volume), volume.about.holes), (vec![2.0, 4.0, 2.0], 1));
    }
}

#[test]
fn times_components_and_slices() {
    let at = |time| ReadOptions { time: Some(time), ..ReadOptions::default() };
    for (second, big) in EVERY {
        let mut made = Made::new(second, big, 2, &[1, 2, 1, 3]);
        let bytes = made.values(SampleType::U8, "1 2 3 4 5 6");
        for (name, bytes) in [("a.nii", bytes.clone()), ("a.nii.gz", gzip(&bytes))] {
            let read = |options: &ReadOptions| read_bytes(name, &bytes, options);
            assert_eq!(values(&read(&ReadOptions::default()).unwrap()), [1.0, 2.0]);
            assert_eq!(values(&read(&at(2)).unwrap()), [5.0, 6.0]);
        }
        let text = message(&bytes, &at(3));
        assert!(
            text.contains("has 3 times, but number 3 was asked for; choose a time from 0 to 2")
        );
        let mut made = Made::new(second, big, 2, &[2, 1, 1, 1, 3]);
        let bytes = made.values(SampleType::U8, "1 2 2 3 2 6");
        let component = |name| {
            let options = ReadOptions::scalar(Some(name));
            read_bytes("a.nii", &bytes, &options).map(|volume| values(&volume))
        };
        assert_eq!(values(&of(&bytes)), [1.0, 2.0]);
        assert_eq!(component("field:y").unwrap(), [2.0, 3.0]);
        assert_eq!(component(":2").unwrap(), [2.0, 6.0]);
        assert_eq!(component("magnitude").unwrap(), [3.0, 7.0]);
        assert!(component("field:3").unwrap_err().to_string().contains("but no “field:3”"));
        match second {
            true => made.int(504, 1007),
            false => made.short(68, 1007),
        }
        assert_eq!(values(&of(&made.bytes)), [3.0, 7.0]);
        // A slice, whose matrix says nothing of the third axis.
        let mut made = Made::new(second, big, 2, &[2, 2]);
        made.matrix([[0.0, 2.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [0.0; 4]]);
        made.step(3, 5.0);
        let volume = of(&made.values(SampleType::U8, "1 2 3 4"));
        assert_eq!(volume.lattice.dims, [2, 2, 1]);
        assert_eq!(volume.lattice.axes.z_axis, DVec3::new(0.0, 0.0, -5.0));
    }
}

#[test]
fn pairs_are_found_from_either_file() {
    let folder = Folder::new();
    for (second, big) in EVERY {
        let mut made = Made::new(second, big, 4, &[2, 1, 1]);
        let magic = if second { 4 } else { 344 };
        made.bytes[magic + 1] = b'i';
        made.number([108, 168], if second { f64::from_bits(2) } else { 2.0 });
        let size = if second { 540 } else { 348 };
        let header = made.bytes[..size].to_vec();
        made.bytes = vec![0; 2];
        let image = made.values(SampleType::I16, "5 6");
        let read = |name: &str| {
            read_with(&folder.path(name), |source| read(source, &ReadOptions::default()))
        };
        folder.write("a.hdr", &header);
        folder.write("a.img", &image);
        folder.write("b.HDR", &header);
        folder.write("b.img.gz", gzip(&image));
        for name in ["a.hdr", "a.img", "b.HDR", "b.img.gz"] {
            assert_eq!(values(&read(name).unwrap()), [5.0, 6.0], "{name}");
        }
    }
    let missing = folder.write("c.img", [1, 2, 3, 4]);
    let text = |error: Error| error.to_string();
    let error = read_with(&missing, |source| read(source, &ReadOptions::default())).unwrap_err();
    assert!(text(error).contains("c.img: pair: refers to “c.hdr”"));
    let layout = crate::formats::RawLayout {
        dims: [2, 2, 1],
        sample_type: SampleType::U8,
        spacing: DVec3::ONE,
        endian: Endian::Little,
        header: 0,
    };
    let raw = ReadOptions::raw(Some(&layout));
    assert_eq!(values(&read_with(&missing, |source| read(source, &raw)).unwrap()).len(), 4);
    // Analyze has the same counts and steps, and no mark.
    let mut made = Made::new(false, true, 4, &[2, 1, 1]);
    made.bytes[344..348].fill(0);
    made.number([108, 0], 0.0);
    made.short(252, 1);
    made.step(3, 7.0);
    folder.write("d.hdr", &made.bytes[..348]);
    folder.write("d.img", [0, 1, 0, 2]);
    let volume =
        read_with(&folder.path("d.hdr"), |source| read(source, &ReadOptions::default())).unwrap();
    assert_eq!((values(&volume), volume.lattice.axes.z_axis.z), (vec![1.0, 2.0], 7.0));
    assert!(volume.about.orientation.is_none());
}

#[test]
fn broken_files_are_told() {
    let none = ReadOptions::default();
    let folder = Folder::new();
    for (second, big) in EVERY {
        let mut made = Made::new(second, big, 2, &[3, 2, 1]);
        made.rotation([0.1, 0.2, 0.3], [1.0; 3]);
        let bytes = made.values(SampleType::U8, "1 2 3 4 5 6");
        for (name, bytes) in [("a.nii", bytes.clone()), ("a.nii.gz", gzip(&bytes))] {
            every_cut(&folder, name, &bytes, |source| read(source, &none));
        }
        let with = |change: &dyn Fn(&mut Made)| {
            let mut made = made.clone();
            change(&mut made);
            message(&made.bytes, &none)
        };
        let datatype = if second { 12 } else { 70 };
        for (error, part) in [
            (with(&|made| made.count(0, 9)), "dim[0]: the number of axes is 9"),
            (with(&|made| made.count(0, -1)), "the number of axes is -1, but 1 to 7"),
            (with(&|made| made.count(2, 0)), "dim[2]: counts 0 samples"),
            (with(&|made| made.count(1, -3)), "dim[1]: counts -3 samples"),
            (with(&|made| made.count(1, 30_000)), "there are 6 bytes where 60000 were"),
            (with(&|made| made.short(datatype, 1536)), "1536 (128-bit floats) is not a type"),
            (with(&|made| made.short(datatype, 77)), "77 is not a type that can be read"),
        ] {
            assert!(error.contains(part), "{error}");
        }
    }
    let mut made = Made::new(true, false, 2, &[1 << 40, 1 << 40, 1]);
    assert!(made.values(SampleType::U8, "1").len() == 545);
    assert!(message(&made.bytes, &none).contains("more than memory can hold"));
    made.count(2, 1);
    assert!(matches!(read_bytes("a.nii", &made.bytes, &none), Err(Error::Limit { .. })));
    let mut made = Made::new(false, false, 2, &[1, 1, 1]);
    made.number([108, 0], 352.5);
    assert!(message(&made.bytes, &none).contains("vox_offset: is 352.5"));
    made.number([108, 0], 1e17);
    assert!(message(&made.bytes, &none).contains("there are 0 bytes where 1 were expected"));
    assert!(message(&[b'x'; 400], &none).contains("348 or 540, was expected"));
    let text = [b"ENVI\nsamples = 3\n", &[b' '; 400][..]].concat();
    assert!(message(&text, &none).contains("is a header of ENVI"));
    let mut damaged = gzip(&Made::new(false, false, 2, &[1]).values(SampleType::U8, "7"));
    let crc = damaged.len() - 8;
    damaged[crc] ^= 1;
    let error = read_bytes("a.nii.gz", &damaged, &none).unwrap_err().to_string();
    assert!(error.contains("gzip stream"), "{error}");
}
