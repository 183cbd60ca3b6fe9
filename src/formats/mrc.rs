//! Density maps of electron microscopy and crystallography (`.mrc`, `.map`, `.ccp4`, `.rec`,
//! `.st`). Follows the definition of MRC2014 (Cheng et al., Journal of Structural Biology 192,
//! 2015).

use super::{
    Endian, ReadOptions, SampleType,
    shared::{
        grid::{Component, Element, Grid, too_few},
        plain::Plain,
        several,
    },
};
use crate::{
    Result,
    about::Frame,
    input::Source,
    volume::{Lattice, Volume},
};
use glam::{DMat3, DVec3};
use std::borrow::Cow;

/// Bytes of the header, without the extended header.
const HEADER: usize = 1024;

/// The offset of the word “MAP ”.
const MARK: usize = 208;

/// The mode of samples that are packed, two in a byte.
const PACKED: i32 = 101;

/// Reads a map. The world's axes are those of the cell's frame: x along a, and y in the plane of a
/// and b (as the Protein Data Bank has it). Lengths are in ångström; without a cell, samples are
/// one unit apart. Columns, rows and sections may be any of the axes (`MAPC`, `MAPR`, `MAPS`). The
/// position of the first sample is `ORIGIN`, or the number of its column, row and section if that
/// is zero.
///
/// Samples are of mode 0 (signed bytes; unsigned ones if IMOD wrote the file and says so), 1, 2, 3,
/// 4 (complex ones become their magnitude), 6, 12, 16 (colours) and 101. A stack of volumes (space
/// group 401 to 630) is read at [`ReadOptions::time`].
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with the field that is wrong, and for data that are cut
/// off; [`Error::Limit`](crate::Error::Limit) for sizes over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let header = Header::of(source)?;
    Component::chosen(source, options, 1, false)?;
    let (dims, skipped) = header.chosen(source, options)?;
    let lattice = header.lattice(source, dims)?;
    let packed = header.mode == PACKED;
    let grid = header.grid(dims);
    let size = grid.check(source)?;
    let stored = if packed { packed_row(dims[0]) * dims[1] * dims[2] } else { size };
    let start = header.start.saturating_add(stored.saturating_mul(skipped));
    let there = source.bytes().get(start..).unwrap_or_default();
    if there.len() < stored {
        return Err(too_few(source, there.len(), stored)
            .hint("the file is cut off, or “nx”, “ny”, “nz” or “mode” in its header is wrong"));
    }
    let data = if packed {
        source.room::<u8>("the unpacked samples", size)?;
        Cow::Owned(unpacked(&there[..stored], dims[0]))
    } else {
        Cow::Borrowed(&there[..stored])
    };
    let component = Component::chosen(source, options, grid.components, grid.components == 3)?;
    let mut volume = grid.volume(source, lattice, data, component, options)?;
    if header.cell().is_some() {
        volume.about.length = "Å".into();
    }
    Ok(volume)
}

/// Returns where the samples are in a file of real numbers, which holds one volume.
///
/// # Errors
/// As [`read`], for the header.
pub(super) fn plain(source: &Source) -> Result<Option<Plain>> {
    let header = Header::of(source)?;
    let Element::Real(sample_type) = header.element else { return Ok(None) };
    if header.mode == PACKED || header.components != 1 || header.volumes() > 1 {
        return Ok(None);
    }
    let dims = header.dims;
    let lattice = header.lattice(source, dims)?;
    header.grid(dims).check(source)?;
    let Header { endian, start, .. } = header;
    Ok(Some(Plain {
        path: source.path.to_owned(),
        start,
        sample_type,
        endian,
        lattice,
        frame: Frame::Own,
    }))
}

/// Returns whether the first bytes are of a map: the word “MAP” stands behind the cell.
pub fn is_map(bytes: &[u8]) -> bool {
    bytes.get(MARK..MARK + 3) == Some(b"MAP")
}

/// Bytes of a row of samples of four bits.
fn packed_row(samples: usize) -> usize {
    samples.div_ceil(2)
}

/// Unpacks rows of samples of four bits, the lower half of each byte first.
fn unpacked(bytes: &[u8], row: usize) -> Vec<u8> {
    let rows = bytes.chunks(packed_row(row).max(1));
    rows.flat_map(|bytes| bytes.iter().flat_map(|&b| [b & 15, b >> 4]).take(row)).collect()
}

/// The fields of a header that are read.
struct Header {
    dims: [usize; 3],
    mode: i32,
    element: Element,
    components: usize,
    endian: Endian,
    /// The numbers of the first column, row and section.
    first: [i32; 3],
    /// Intervals along the edges of the cell.
    intervals: [i32; 3],
    /// Lengths of the cell's edges in ångström, and its angles in degrees.
    edges: [f32; 3],
    angles: [f32; 3],
    /// Which of the cell's edges columns, rows and sections follow: 0, 1 or 2.
    order: [usize; 3],
    space_group: i32,
    origin: [f32; 3],
    /// The offset of the first sample in bytes.
    start: usize,
}

/// Reads words of a header.
struct Words<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl Words<'_> {
    fn bytes(&self, at: usize) -> [u8; 4] {
        let mut word = *self.bytes[4 * at..].first_chunk().expect("a word of the header");
        if self.endian == Endian::Big {
            word.reverse();
        }
        word
    }

    fn int(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.bytes(at))
    }

    fn ints(&self, at: usize) -> [i32; 3] {
        [self.int(at), self.int(at + 1), self.int(at + 2)]
    }

    fn floats(&self, at: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis| f32::from_le_bytes(self.bytes(at + axis)))
    }
}

/// Returns the byte order of a header: by its stamp of the machine, or else the order in which the
/// mode is a small number.
fn endian(bytes: &[u8]) -> Endian {
    match bytes[212..214] {
        [0x11, 0x11] => Endian::Big,
        [0x44, 0x44 | 0x41] => Endian::Little,
        _ => {
            let mode = Words { bytes, endian: Endian::Little }.int(3);
            if (0..=PACKED).contains(&mode) { Endian::Little } else { Endian::Big }
        }
    }
}

impl Header {
    fn of(source: &Source) -> Result<Self> {
        let Some(bytes) = source.bytes().get(..HEADER) else {
            let message = format!("has {} bytes, fewer than {HEADER}", source.bytes().len());
            return Err(source.error("header", message));
        };
        let wrong =
            |field: &str, message: String| source.error(format!("header, {field}"), message);
        let endian = endian(bytes);
        let words = Words { bytes, endian };
        let sizes = words.ints(0);
        if sizes.iter().any(|&size| size < 1) {
            let message = format!("are {sizes:?}, but at least 1 was expected of each");
            return Err(
                wrong("nx, ny and nz", message).hint("is this a file of the MRC or CCP4 format?")
            );
        }
        let mode = words.int(3);
        let (element, components) =
            number_type(mode, imod_is_unsigned(&words)).ok_or_else(|| {
                let message =
                    format!("is {mode}, but 0, 1, 2, 3, 4, 6, 12, 16 or 101 was expected");
                wrong("mode", message).hint("is this a file of the MRC or CCP4 format?")
            })?;
        // Old writers left these words empty.
        let order = match words.ints(16) {
            [0, 0, 0] => [0, 1, 2],
            order => order.map(|axis| axis.wrapping_sub(1) as usize),
        };
        let mut sorted = order;
        sorted.sort_unstable();
        if sorted != [0, 1, 2] {
            let message = format!("are {:?}, but 1, 2 and 3 in any order", words.ints(16));
            return Err(wrong("mapc, mapr and maps", message + " were expected"));
        }
        let extended = words.int(23);
        let start = usize::try_from(extended).ok().and_then(|size| size.checked_add(HEADER));
        let start = start.ok_or_else(|| {
            wrong("nsymbt", format!("is {extended}, but a number of bytes was expected"))
        })?;
        Ok(Self {
            dims: sizes.map(|size| size as usize),
            mode,
            element,
            components,
            endian,
            first: words.ints(4),
            intervals: words.ints(7),
            edges: words.floats(10),
            angles: words.floats(13),
            order,
            space_group: words.int(22),
            origin: words.floats(49),
            start,
        })
    }

    fn grid(&self, dims: [usize; 3]) -> Grid {
        Grid::interleaved(self.element, self.endian, dims, self.components)
    }

    /// Returns the number of volumes of a stack; 1 for other files.
    fn volumes(&self) -> usize {
        let nz = self.dims[2];
        let sections = usize::try_from(self.intervals[2]).unwrap_or(0);
        let is_stack = (401..=630).contains(&self.space_group);
        if is_stack && sections > 0 && nz.is_multiple_of(sections) { nz / sections } else { 1 }
    }

    /// Returns the size of a volume, and the number of volumes before the one to read.
    fn chosen(&self, source: &Source, options: &ReadOptions) -> Result<([usize; 3], usize)> {
        let [nx, ny, nz] = self.dims;
        let count = self.volumes();
        let time = several::time(source, "header", count as u64, options)?;
        Ok(([nx, ny, nz / count], time))
    }

    /// Returns the steps along the edges of the cell, in ångström; `None` if there is no cell.
    fn cell(&self) -> Option<[DVec3; 3]> {
        let is_length = |&edge: &f32| edge.is_finite() && edge > 0.0;
        if !self.edges.iter().all(is_length) || self.intervals.iter().any(|&n| n < 1) {
            return None;
        }
        // Writers of rectangular cells often leave the angles empty.
        let angle = |angle: f32| {
            let is_angle = angle.is_finite() && angle > 0.0 && angle < 180.0;
            f64::from(if is_angle { angle } else { 90.0 }).to_radians()
        };
        let [alpha, beta, gamma] = self.angles.map(angle);
        // Exactly 0 for right angles.
        let cosine = |angle: f64| {
            let cosine = angle.cos();
            if cosine.abs() < 1e-12 { 0.0 } else { cosine }
        };
        let (cos_a, cos_b, cos_g, sin_g) =
            (cosine(alpha), cosine(beta), cosine(gamma), gamma.sin());
        let y = (cos_a - cos_b * cos_g) / sin_g;
        let z = (1.0 - cos_b * cos_b - y * y).max(0.0).sqrt();
        let directions = [DVec3::X, DVec3::new(cos_g, sin_g, 0.0), DVec3::new(cos_b, y, z)];
        let step = |axis: usize| {
            directions[axis] * f64::from(self.edges[axis]) / f64::from(self.intervals[axis])
        };
        Some([step(0), step(1), step(2)]).filter(|_| z > 1e-6)
    }

    fn lattice(&self, source: &Source, dims: [usize; 3]) -> Result<Lattice> {
        let steps = self.cell().unwrap_or([DVec3::X, DVec3::Y, DVec3::Z]);
        let axes = self.order.map(|axis| steps[axis]);
        let origin = DVec3::from(self.origin.map(f64::from));
        let origin = if origin.is_finite() && origin != DVec3::ZERO {
            origin
        } else {
            (0..3).map(|axis| f64::from(self.first[axis]) * axes[axis]).sum()
        };
        let lattice = Lattice::cartesian(dims, origin, DMat3::from_cols(axes[0], axes[1], axes[2]));
        lattice.check().map_err(|message| source.error("header", message))?;
        Ok(lattice)
    }
}

/// Returns whether IMOD wrote the file and says that its bytes are unsigned.
fn imod_is_unsigned(words: &Words) -> bool {
    const STAMP: i32 = 1_146_047_817;
    words.int(38) == STAMP && words.int(39) & 1 == 0
}

/// Returns the type of the numbers of a mode, and how many each sample has.
fn number_type(mode: i32, is_unsigned: bool) -> Option<(Element, usize)> {
    Some(match mode {
        0 if is_unsigned => (Element::Real(SampleType::U8), 1),
        0 => (Element::Real(SampleType::I8), 1),
        1 => (Element::Real(SampleType::I16), 1),
        2 => (Element::Real(SampleType::F32), 1),
        3 => (Element::Complex(SampleType::I16), 1),
        4 => (Element::Complex(SampleType::F32), 1),
        6 => (Element::Real(SampleType::U16), 1),
        12 => (Element::Half, 1),
        16 => (Element::Real(SampleType::U8), 3),
        PACKED => (Element::Real(SampleType::U8), 1),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::*;

    /// The words of a header, by their numbers from 1 as the definition has them.
    struct Map(Vec<u8>, bool);

    impl Map {
        fn new(dims: [i32; 3], mode: i32, big: bool) -> Self {
            let mut map = Self(vec![0; HEADER], big);
            for (axis, size) in dims.into_iter().enumerate() {
                map = map.int(1 + axis, size).int(8 + axis, size);
                map = map.int(17 + axis, axis as i32 + 1).float(14 + axis, 90.0);
                map = map.float(11 + axis, size as f32 * 2.0);
            }
            map = map.int(4, mode);
            map.0[MARK..MARK + 4].copy_from_slice(b"MAP ");
            let stamp = if big { [0x11, 0x11] } else { [0x44, 0x44] };
            map.0[212..214].copy_from_slice(&stamp);
            map
        }

        fn put(mut self, word: usize, mut bytes: [u8; 4]) -> Self {
            if self.1 {
                bytes.reverse();
            }
            self.0[4 * (word - 1)..][..4].copy_from_slice(&bytes);
            self
        }

        fn int(self, word: usize, value: i32) -> Self {
            self.put(word, value.to_le_bytes())
        }

        fn float(self, word: usize, value: f32) -> Self {
            self.put(word, value.to_le_bytes())
        }

        fn with(self, data: &[u8]) -> Vec<u8> {
            [self.0, data.to_vec()].concat()
        }
    }

    fn load(bytes: &[u8], options: &ReadOptions) -> Result<Volume> {
        let folder = Folder::new();
        read_with(&folder.write("a.mrc", bytes), |source| read(source, options))
    }

    fn values(volume: &Volume) -> Vec<f64> {
        (0..volume.len()).map(|index| volume.value(index)).collect()
    }

    #[test]
    fn every_mode_and_order_is_read() {
        let default = ReadOptions::default();
        for big in [false, true] {
            let order = |bytes: Vec<u8>, size: usize| -> Vec<u8> {
                bytes
                    .chunks(size)
                    .flat_map(|number| {
                        let mut number = number.to_vec();
                        if big {
                            number.reverse();
                        }
                        number
                    })
                    .collect()
            };
            let words =
                |numbers: &[i16]| order(numbers.iter().flat_map(|v| v.to_le_bytes()).collect(), 2);
            let floats =
                |numbers: &[f32]| order(numbers.iter().flat_map(|v| v.to_le_bytes()).collect(), 4);
            for (mode, data, expected) in [
                (0, vec![1, 255, 3], [1.0, -1.0, 3.0]),
                (1, words(&[1, -2, 3]), [1.0, -2.0, 3.0]),
                (2, floats(&[1.5, -2.0, 3.0]), [1.5, -2.0, 3.0]),
                (3, words(&[3, 4, 0, 0, 0, -1]), [5.0, 0.0, 1.0]),
                (4, floats(&[3.0, 4.0, 0.0, 0.0, 0.0, -1.0]), [5.0, 0.0, 1.0]),
                (6, words(&[1, -1, 3]), [1.0, 65535.0, 3.0]),
                (12, words(&[0x3c00, 0x4000, 0x3800]), [1.0, 2.0, 0.5]),
                (16, vec![9, 9, 9, 0, 0, 0, 255, 255, 255], [9.0, 0.0, 255.0]),
                (101, vec![0x21, 0x03], [1.0, 2.0, 3.0]),
            ] {
                let volume = load(&Map::new([3, 1, 1], mode, big).with(&data), &default).unwrap();
                assert_eq!(values(&volume), expected, "mode {mode}, big {big}");
                assert_eq!(volume.lattice.spacing(), DVec3::splat(2.0));
                assert_eq!(volume.about.length, "Å");
            }
        }
        // IMOD's unsigned bytes, and a file that does not say its byte order.
        let imod = Map::new([1, 1, 1], 0, false).int(39, 1_146_047_817).with(&[255]);
        assert_eq!(values(&load(&imod, &default).unwrap()), [255.0]);
        let mut silent = Map::new([1, 1, 1], 1, true).with(&[1, 0]);
        silent[208..216].fill(0);
        assert_eq!(values(&load(&silent, &default).unwrap()), [256.0]);
    }

    #[test]
    fn the_cell_places_the_samples() {
        let default = ReadOptions::default();
        let lattice = |map: Map| load(&map.with(&[0; 6]), &default).map(|volume| volume.lattice);
        let map = || Map::new([1, 2, 3], 0, false);
        // Columns along z, rows along x, sections along y; 2, 4 and 6 Å in 1, 2 and 3 intervals.
        let turned = lattice(map().int(17, 3).int(18, 1).int(19, 2).int(5, 1).int(7, -2)).unwrap();
        let columns = [turned.axes.x_axis, turned.axes.y_axis, turned.axes.z_axis];
        assert_eq!(columns, [2.0 * DVec3::Z, 2.0 * DVec3::X, 2.0 * DVec3::Y]);
        assert_eq!(turned.origin, DVec3::new(0.0, -4.0, 2.0));
        assert_eq!(lattice(map().float(51, 7.0)).unwrap().origin, DVec3::new(0.0, 7.0, 0.0));
        // A hexagonal cell.
        let hexagonal = lattice(map().float(16, 120.0)).unwrap();
        assert!((hexagonal.axes.y_axis - DVec3::new(-1.0, 3f64.sqrt(), 0.0)).length() < 1e-6);
        let none = load(&map().float(11, 0.0).with(&[0; 6]), &default).unwrap();
        assert_eq!((none.lattice.spacing(), &none.about.length[..]), (DVec3::ONE, ""));
        // An extended header.
        let extended = map().int(24, 8).with(&[9, 9, 9, 9, 9, 9, 9, 9, 1, 2, 3, 4, 5, 6]);
        assert_eq!(values(&load(&extended, &default).unwrap()), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn a_stack_has_several_volumes() {
        let map = || Map::new([1, 1, 4], 0, false).int(10, 2).int(23, 401).with(&[1, 2, 3, 4]);
        let at = |time| load(&map(), &ReadOptions { time, ..ReadOptions::default() });
        assert_eq!(values(&at(None).unwrap()), [1.0, 2.0]);
        assert_eq!(values(&at(Some(1)).unwrap()), [3.0, 4.0]);
        assert!(at(Some(2)).unwrap_err().to_string().contains("has 2"));
    }

    #[test]
    fn cuts_and_lies_are_errors() {
        let folder = Folder::new();
        let default = ReadOptions::default();
        let whole = Map::new([2, 1, 1], 1, false).with(&[1, 2, 3, 4]);
        every_cut(&folder, "a.mrc", &whole, |source| read(source, &default));
        let map = || Map::new([1, 1, 1], 0, false);
        for (map, word) in [
            (map().int(2, 0), "nx, ny and nz: are [1, 0, 1]"),
            (map().int(4, 7), "mode: is 7"),
            (map().int(18, 1), "mapc, mapr and maps: are [1, 1, 3]"),
            (map().int(24, -1), "nsymbt: is -1"),
            (map().int(24, i32::MAX), "there are 0 bytes where 1"),
        ] {
            let error = load(&map.with(&[0]), &default).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        let lie = map().int(1, i32::MAX).int(2, i32::MAX).int(3, i32::MAX).with(&[0]);
        assert!(matches!(
            load(&lie, &default),
            Err(crate::Error::Limit { .. } | crate::Error::Input { .. })
        ));
    }
}
