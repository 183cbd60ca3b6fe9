//! MetaImage volumes (`.mha`, and `.mhd` with their data in other files), as ITK, VTK and elastix
//! write them. Follows the definition at
//! <https://docs.itk.org/en/latest/learn/metaio.html>, and ITK where that is silent.

use super::{
    Endian, ReadOptions, SampleType,
    nrrd::files,
    shared::{
        anatomy::{self, Anatomy},
        grid::{Component, Element, Grid, too_few},
        plain::Plain,
        several,
    },
};
use crate::{
    Result,
    about::{About, Modality},
    input::{Source, copy},
    volume::{Lattice, Volume},
};
use flate2::read::ZlibDecoder;
use glam::{DMat3, DVec3};
use std::{borrow::Cow, collections::HashMap, io::Read};

/// Maximum size of a header in bytes; headers of real files are far smaller.
const LONGEST: usize = 1 << 20;

/// The names of the field with the directions of the axes.
const DIRECTIONS: [&str; 3] = ["TransformMatrix", "Rotation", "Orientation"];

/// The field that ends the header, or names the files with the samples.
const DATA: &str = "ElementDataFile";

/// Reads an image of two to four axes; the fourth is time ([`ReadOptions::time`]). World positions
/// are those of ITK: the rows of `TransformMatrix` are the directions of the axes, `Offset` is the
/// position of the first sample, and `CenterOfRotation` has no effect. If the file gives an
/// anatomical orientation, the volume is turned from DICOM's frame, which ITK uses, into the
/// patient's ([`Frame::Patient`](crate::about::Frame)).
///
/// Samples may have several channels ([`ReadOptions::scalar`]). Without a choice, three or four of
/// unsigned bytes are a colour, of which the brightness is read. Others are a vector, of which the
/// length is read. `ElementDataFile` is `LOCAL`, one file, a list of files or a pattern of names
/// (`slice%03d.raw 1 90 1`), in the header's folder or below. One file may be compressed by zlib.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with the field that is missing or wrong, and for data that
/// are cut off; [`Error::Limit`](crate::Error::Limit) for sizes over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let header = Header::of(source)?;
    let (grid, skip) = header.grid(options)?;
    let lattice = header.lattice(grid.dims)?;
    let size = grid.check(source)?;
    let component = header.component(options, &grid)?;
    let skipped = size.saturating_mul(skip);
    let mut volume = header.with_data(size, skipped, grid.dims, |file, data| {
        grid.volume(file, lattice.clone(), data, component, options)
    })?;
    volume.about = About { holes: volume.about.holes, ..header.about() };
    if let Some(anatomy) = header.anatomy() {
        anatomy.place(&mut volume);
    }
    Ok(volume)
}

/// Returns where the samples are, if they are of one time and in one file, neither compressed nor
/// text.
///
/// # Errors
/// As [`read`], for the header.
pub(super) fn plain(source: &Source) -> Result<Option<Plain>> {
    let header = Header::of(source)?;
    if header.sizes()?[3] > 1 {
        return Ok(None);
    }
    let (grid, _) = header.grid(&ReadOptions::default())?;
    let field = header.need(DATA)?;
    let Element::Real(sample_type) = grid.element else { return Ok(None) };
    let is_plain = grid.components == 1 && header.is("BinaryData", true) && !header.is_packed();
    if !is_plain || header.header_size()? != Some(0) || files::are_several(field) {
        return Ok(None);
    }
    let lattice = header.lattice(grid.dims)?;
    grid.check(source)?;
    let (path, start) = match header.body {
        Some(body) => (source.path.to_owned(), body),
        None => (source.neighbour(DATA, field)?, 0),
    };
    let (lattice, frame) = anatomy::placed(header.anatomy(), lattice);
    Ok(Some(Plain { path, start, sample_type, endian: grid.endian, lattice, frame }))
}

/// Returns whether the first bytes are of a header.
pub fn is_header(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(256)];
    let has = |word: &[u8]| start.windows(word.len()).any(|window| window == word);
    let is_first = |word: &[u8]| start.trim_ascii_start().starts_with(word);
    (is_first(b"ObjectType") || is_first(b"NDims") || is_first(b"Comment")) && has(b"NDims")
}

/// The fields of a header, by their names.
struct Header<'a> {
    source: &'a Source<'a>,
    fields: HashMap<String, String>,
    /// The offset of the samples in this file; `None` if they are in another.
    body: Option<usize>,
    /// The offset of the names of a list.
    list: usize,
}

impl<'a> Header<'a> {
    fn of(source: &'a Source<'a>) -> Result<Self> {
        let bytes = source.bytes();
        let mut header = Self { source, fields: HashMap::new(), body: None, list: bytes.len() };
        let mut at = 0;
        for (line, number) in bytes.split_inclusive(|&b| b == b'\n').zip(1..) {
            let place = || format!("line {number}");
            at += line.len();
            if at > LONGEST {
                let message = format!("the header is longer than {LONGEST} bytes");
                return Err(source
                    .error(place(), message)
                    .hint(format!("“{DATA} = LOCAL” must stand before samples in this file")));
            }
            let text = copy::lossy(line);
            let text = text.trim();
            if text.is_empty() {
                continue;
            }
            source.spend("the size of the header in bytes", 256 + 2 * line.len() as u64)?;
            let Some((name, value)) = text.split_once('=').or_else(|| text.split_once(':')) else {
                let message = "is not a field, as in “NDims = 3”";
                return Err(source.error(place(), message));
            };
            let (name, value) = (name.trim().to_owned(), value.trim().to_owned());
            let is_data = name == DATA;
            let (is_local, is_list) = (is_word(&value, "local"), files::is_list(&value));
            if header.fields.insert(name.clone(), value).is_some() && name != "Comment" {
                let message = format!("the field “{name}” is given twice; give it once");
                return Err(source.error(place(), message));
            }
            if is_data && is_local {
                // The last line must be whole: the samples begin behind it.
                header.body = Some(at).filter(|_| line.ends_with(b"\n"));
                header.body.ok_or_else(|| source.error("data", "there are no samples"))?;
                break;
            }
            if is_data && is_list {
                header.list = at;
                break;
            }
        }
        Ok(header)
    }

    fn get(&self, names: &[&str]) -> Option<&str> {
        names.iter().find_map(|&name| self.fields.get(name)).map(String::as_str)
    }

    fn need(&self, name: &str) -> Result<&str> {
        self.get(&[name])
            .ok_or_else(|| self.source.error("header", format!("has no field “{name}”")))
    }

    /// Returns a field of `True` or `False`, or a default.
    fn is(&self, name: &str, default: bool) -> bool {
        self.get(&[name]).map_or(default, |value| is_word(value, "true") || value == "1")
    }

    fn is_packed(&self) -> bool {
        self.is("CompressedData", false)
    }

    /// Returns the numbers of a field, `count` of them; `None` if the file does not have it.
    fn numbers<T: std::str::FromStr>(
        &self,
        names: &[&str],
        count: usize,
    ) -> Result<Option<Vec<T>>> {
        let Some(text) = self.get(names) else { return Ok(None) };
        let words = text.split_ascii_whitespace().take(count + 1);
        let numbers: Option<Vec<T>> = words.map(|word| word.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == count);
        numbers.map(Some).ok_or_else(|| {
            let excerpt: String = text.chars().take(80).collect();
            self.source.error(names[0], format!("“{excerpt}” is not a list of {count} numbers"))
        })
    }

    /// Returns the number of axes.
    fn axes(&self) -> Result<usize> {
        self.need("NDims")?;
        let axes = self.numbers::<usize>(&["NDims"], 1)?.unwrap_or_default();
        match axes[..] {
            [axes @ 2..=4] => Ok(axes),
            _ => {
                Err(self.source.error("NDims", format!("is {axes:?}, but 2, 3 or 4 was expected")))
            }
        }
    }

    /// Returns the samples along x, y and z, and the number of times.
    fn sizes(&self) -> Result<Vec<usize>> {
        let axes = self.axes()?;
        self.need("DimSize")?;
        let mut sizes = self.numbers::<usize>(&["DimSize"], axes)?.unwrap_or_default();
        sizes.resize(4, 1);
        Ok(sizes)
    }

    /// Returns the layout of the samples, and the number of volumes before the one to read.
    fn grid(&self, options: &ReadOptions) -> Result<(Grid, usize)> {
        let sizes = self.sizes()?;
        let time = several::time(self.source, "DimSize", sizes[3] as u64, options)?;
        let channels = self.numbers::<usize>(&["ElementNumberOfChannels"], 1)?;
        let channels = channels.map_or(1, |channels| channels[0]);
        if channels == 0 {
            let message = "is 0, but each sample has at least one channel";
            return Err(self.source.error("ElementNumberOfChannels", message));
        }
        let is_big = self.is("BinaryDataByteOrderMSB", self.is("ElementByteOrderMSB", false));
        let endian = if is_big { Endian::Big } else { Endian::Little };
        let dims = [sizes[0], sizes[1], sizes[2]];
        let element = Element::Real(self.sample_type()?);
        Ok((Grid::interleaved(element, endian, dims, channels), time))
    }

    fn component(&self, options: &ReadOptions, grid: &Grid) -> Result<Component> {
        let are_colors = grid.element.is_byte() && matches!(grid.components, 3 | 4);
        Component::chosen(self.source, options, grid.components, are_colors)
    }

    fn sample_type(&self) -> Result<SampleType> {
        let name = self.need("ElementType")?;
        Ok(match name.trim_end_matches("_ARRAY") {
            "MET_UCHAR" => SampleType::U8,
            "MET_CHAR" | "MET_ASCII_CHAR" => SampleType::I8,
            "MET_USHORT" => SampleType::U16,
            "MET_SHORT" => SampleType::I16,
            // Four bytes in files, whatever the machine.
            "MET_UINT" | "MET_ULONG" => SampleType::U32,
            "MET_INT" | "MET_LONG" => SampleType::I32,
            "MET_ULONG_LONG" => SampleType::U64,
            "MET_LONG_LONG" => SampleType::I64,
            "MET_FLOAT" => SampleType::F32,
            "MET_DOUBLE" => SampleType::F64,
            _ => {
                let excerpt: String = name.chars().take(80).collect();
                let message = format!("“{excerpt}” is not a type of numbers, such as MET_SHORT");
                return Err(self.source.error("ElementType", message));
            }
        })
    }

    fn lattice(&self, dims: [usize; 3]) -> Result<Lattice> {
        let axes = self.axes()?;
        let spacing = self.numbers::<f64>(&["ElementSpacing"], axes)?;
        let spacing = spacing
            .map_or_else(|| self.numbers(&["ElementSize"], axes), |spacing| Ok(Some(spacing)));
        let spacing = spacing?.unwrap_or_else(|| vec![1.0; axes]);
        let directions = self.numbers::<f64>(&DIRECTIONS, axes * axes)?;
        let offset = self.numbers::<f64>(&["Offset", "Position", "Origin"], axes)?;
        let spatial = axes.min(3);
        let mut steps = DMat3::IDENTITY;
        let mut origin = DVec3::ZERO;
        for axis in 0..spatial {
            for row in 0..spatial {
                let unit = f64::from(u8::from(row == axis));
                let along = directions.as_ref().map_or(unit, |all| all[axis * axes + row]);
                steps.col_mut(axis)[row] = along * spacing[axis];
            }
            origin[axis] = offset.as_ref().map_or(0.0, |offset| offset[axis]);
        }
        let lattice = Lattice::cartesian(dims, origin, steps);
        lattice.check().map_err(|message| self.source.error("header", message))?;
        Ok(lattice)
    }

    /// Returns how the world lies in the patient, if the header gives an anatomical orientation:
    /// the letters of the sides that the image's axes come from. Directions and positions are
    /// those of DICOM. Without directions, the letters give them.
    fn anatomy(&self) -> Option<Anatomy> {
        let of_axes = Anatomy::from_sides(self.get(&["AnatomicalOrientation"])?)?;
        Some(if self.get(&DIRECTIONS).is_some() { Anatomy::LPS } else { of_axes })
    }

    fn about(&self) -> About {
        let modality = match self.get(&["Modality"]).unwrap_or_default() {
            "MET_MOD_CT" => Some(Modality::Ct),
            "MET_MOD_MR" => Some(Modality::Mr),
            "MET_MOD_NM" => Some(Modality::Emission),
            "MET_MOD_US" => Some(Modality::Ultrasound),
            _ => None,
        };
        let length = self.get(&["DistanceUnits"]).unwrap_or_default().into();
        About { modality, length, ..About::default() }
    }

    /// Returns the bytes before the samples in each file; `None` if the samples are the last bytes.
    fn header_size(&self) -> Result<Option<usize>> {
        match self.numbers::<i64>(&["HeaderSize"], 1)?.map(|size| size[0]) {
            None => Ok(Some(0)),
            Some(-1) => Ok(None),
            Some(size) => usize::try_from(size).map(Some).map_err(|_| {
                let message = format!("is {size}, but a number of bytes was expected, or -1");
                self.source.error("HeaderSize", message)
            }),
        }
    }

    /// Calls `take` with the file of the samples and `size` bytes of them, after `skip` bytes.
    fn with_data<T>(
        &self,
        size: usize,
        skip: usize,
        dims: [usize; 3],
        take: impl FnOnce(&Source, Cow<'_, [u8]>) -> Result<T>,
    ) -> Result<T> {
        let field = self.need(DATA)?;
        if let Some(body) = self.body {
            let data = &self.source.bytes()[body..];
            return take(self.source, self.unpacked(self.source, data, size, skip)?);
        }
        let names = self.names(field, dims)?;
        if let [name] = &names[..] {
            let path = self.source.neighbour(DATA, name)?;
            let file = self.source.open_beside(&path)?;
            let data = self.unpacked(&file, file.bytes(), size, skip);
            return file.unless_changed(data.and_then(|data| take(&file, data)));
        }
        if skip > 0 || !size.is_multiple_of(names.len()) {
            let message = "several files must hold equal parts of one volume";
            return Err(self.source.error(DATA, message));
        }
        self.source.spend("the size of the joined samples in bytes", size as u64)?;
        let mut all = Vec::new();
        for name in &names {
            self.source.check_time()?;
            let path = self.source.neighbour(DATA, name)?;
            let file = self.source.open_beside(&path)?;
            all.extend_from_slice(&self.unpacked(&file, file.bytes(), size / names.len(), 0)?);
            file.intact()?;
        }
        take(self.source, all.into())
    }

    /// Returns the names of the files with the samples.
    fn names(&self, field: &str, dims: [usize; 3]) -> Result<Vec<String>> {
        // “LIST 2D” is a list of files of two axes.
        let field =
            field.strip_suffix(['D', 'd']).filter(|_| files::is_list(field)).unwrap_or(field);
        let rest = &self.source.bytes()[self.list..];
        files::names(self.source, field, rest, dims)
    }

    /// Returns `size` bytes of samples from the data of a file, after `skip` bytes of other ones.
    fn unpacked<'d>(
        &self,
        file: &Source,
        data: &'d [u8],
        size: usize,
        skip: usize,
    ) -> Result<Cow<'d, [u8]>> {
        if !self.is("BinaryData", true) {
            return self.parsed(file, data, size, skip).map(Cow::Owned);
        }
        let whole = size.saturating_add(skip);
        if self.is_packed() {
            // Only as much as is needed: other volumes may follow.
            let mut stream = ZlibDecoder::new(data);
            let part = stream.by_ref().take(whole as u64);
            let mut bytes = file.unpack("data", part, whole)?;
            drop(bytes.drain(..skip));
            return Ok(bytes.into());
        }
        let start = match self.header_size()? {
            Some(header) => header.saturating_add(skip),
            // The samples of all volumes are the last bytes.
            None => {
                let (grid, _) = self.grid(&ReadOptions::default())?;
                let times = self.numbers::<usize>(&["DimSize"], self.axes()?)?;
                let times = times.and_then(|sizes| sizes.get(3).copied()).unwrap_or(1);
                let all = grid.check(self.source)?.saturating_mul(times);
                let all = if grid.bytes() == Some(size as u64) { all } else { size };
                data.len().saturating_sub(all).saturating_add(skip)
            }
        };
        let there = data.get(start..).unwrap_or_default();
        there.get(..size).map(Cow::Borrowed).ok_or_else(|| {
            too_few(file, there.len(), size)
                .hint("the file is cut off, or “DimSize” or “ElementType” is wrong")
        })
    }

    /// Returns the bytes of samples that are written as text.
    fn parsed(&self, file: &Source, data: &[u8], size: usize, skip: usize) -> Result<Vec<u8>> {
        let kind = self.sample_type()?;
        file.room::<u8>("the text", data.len())?;
        let text =
            copy::text(data).map_err(|at| file.error("data", format!("byte {at} is not text")))?;
        file.spend("the size of the numbers in bytes", size as u64)?;
        let (grid, _) = self.grid(&ReadOptions::default())?;
        let text = text.split_ascii_whitespace().skip(skip / kind.bytes());
        let text: Vec<&str> = text.take(size / kind.bytes()).collect();
        let mut bytes = kind
            .parse(&text.join(" "), size / kind.bytes())
            .map_err(|message| file.error("data", message))?;
        if grid.endian == Endian::Big {
            bytes.chunks_exact_mut(kind.bytes()).for_each(<[u8]>::reverse);
        }
        Ok(bytes)
    }
}

/// Returns whether a value is a word, in any case.
fn is_word(value: &str, word: &str) -> bool {
    value.eq_ignore_ascii_case(word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::about::Orientation;
    use crate::input::testing::*;
    use flate2::{Compression, write::ZlibEncoder};
    use std::io::Write;

    /// A header with these fields besides those that every one needs.
    fn header(fields: &str, sizes: &str, kind: &str, data: &str) -> String {
        let axes = sizes.split(' ').count();
        format!(
            "ObjectType = Image\nNDims = {axes}\n{fields}DimSize = {sizes}\nElementType = {kind}\n\
             ElementDataFile = {data}\n"
        )
    }

    fn mha(fields: &str, sizes: &str, kind: &str, data: &[u8]) -> Vec<u8> {
        [header(fields, sizes, kind, "LOCAL").as_bytes(), data].concat()
    }

    fn zlib(bytes: &[u8]) -> Vec<u8> {
        let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
        packer.write_all(bytes).unwrap();
        packer.finish().unwrap()
    }

    fn load(bytes: &[u8], options: &ReadOptions) -> Result<Volume> {
        let folder = Folder::new();
        read_with(&folder.write("a.mha", bytes), |source| read(source, options))
    }

    fn values(volume: &Volume) -> Vec<f64> {
        (0..volume.len()).map(|index| volume.value(index)).collect()
    }

    const BIG: &str = "BinaryDataByteOrderMSB = True\n";

    #[test]
    fn types_orders_and_encodings_are_read() {
        let packed = zlib(&[1, 2, 3, 4]);
        for (fields, sizes, kind, data, expected) in [
            ("", "2 1 1", "MET_UCHAR", &[1, 255][..], vec![1.0, 255.0]),
            ("", "2 1 1", "MET_CHAR", &[1, 255], vec![1.0, -1.0]),
            ("", "2 1 1", "MET_SHORT", &[1, 0, 255, 255], vec![1.0, -1.0]),
            (BIG, "2 1 1", "MET_USHORT", &[0, 1, 255, 255], vec![1.0, 65535.0]),
            ("ElementByteOrderMSB = True\n", "1 1 1", "MET_INT", &[0, 0, 1, 0], vec![256.0]),
            ("", "1 1 1", "MET_LONG", &[0, 1, 0, 0], vec![256.0]),
            ("", "1 1 1", "MET_LONG_LONG", &[0, 1, 0, 0, 0, 0, 0, 0], vec![256.0]),
            ("", "1 1 1", "MET_FLOAT", &[0, 0, 128, 63], vec![1.0]),
            (BIG, "1 1 1", "MET_DOUBLE", &[63, 240, 0, 0, 0, 0, 0, 0], vec![1.0]),
            ("CompressedData = True\n", "2 2", "MET_UCHAR", &packed, vec![1.0, 2.0, 3.0, 4.0]),
            ("BinaryData = False\n", "2 1 1", "MET_SHORT", b"-7 300 ", vec![-7.0, 300.0]),
            (
                "BinaryData = False\nBinaryDataByteOrderMSB = True\n",
                "2 1 1",
                "MET_SHORT",
                b"-7\n300",
                vec![-7.0, 300.0],
            ),
            ("HeaderSize = 1\n", "2 1 1", "MET_UCHAR", &[9, 1, 2], vec![1.0, 2.0]),
            ("HeaderSize = -1\n", "2 1 1", "MET_UCHAR", &[9, 9, 1, 2], vec![1.0, 2.0]),
            ("ElementNumberOfChannels = 2\n", "1 1 2", "MET_UCHAR", &[3, 4, 0, 1], vec![5.0, 1.0]),
            ("ElementNumberOfChannels = 3\n", "1 1 1", "MET_UCHAR", &[255, 0, 0], vec![76.0]),
        ] {
            let bytes = mha(fields, sizes, kind, data);
            let volume = load(&bytes, &ReadOptions::default());
            assert_eq!(values(&volume.unwrap()), expected, "{fields}{kind}");
        }
        let channels = mha("ElementNumberOfChannels = 2\n", "1 1 2", "MET_UCHAR", &[3, 4, 0, 1]);
        let second = load(&channels, &ReadOptions::scalar(Some("velocity:1"))).unwrap();
        assert_eq!(values(&second), [4.0, 1.0]);
    }

    #[test]
    fn a_fourth_axis_is_time() {
        for (fields, data) in [
            ("", vec![1, 2, 3, 4]),
            ("HeaderSize = -1\n", vec![9, 1, 2, 3, 4]),
            ("CompressedData = True\n", zlib(&[1, 2, 3, 4])),
            ("BinaryData = False\n", b"1 2 3 4".to_vec()),
        ] {
            let bytes = mha(fields, "2 1 1 2", "MET_UCHAR", &data);
            let at = |time| load(&bytes, &ReadOptions { time, ..ReadOptions::default() });
            assert_eq!(values(&at(None).unwrap()), [1.0, 2.0], "{fields}");
            assert_eq!(values(&at(Some(1)).unwrap()), [3.0, 4.0], "{fields}");
            let error = at(Some(2)).unwrap_err().to_string();
            assert!(error.contains("has 2 times"), "{error}");
        }
    }

    #[test]
    fn the_header_places_the_samples() {
        let fields = "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 1 2 3\nCenterOfRotation = 9 9 \
                      9\nAnatomicalOrientation = RAI\nElementSpacing = 2 3 4\nModality = \
                      MET_MOD_CT\n";
        let volume =
            load(&mha(fields, "1 1 1", "MET_UCHAR", &[1]), &ReadOptions::default()).unwrap();
        let axes = volume.lattice.axes;
        // ITK's x leads to the left and y to the back.
        assert_eq!(axes.x_axis, DVec3::new(0.0, -2.0, 0.0));
        assert_eq!(axes.y_axis, DVec3::new(3.0, 0.0, 0.0));
        assert_eq!(axes.z_axis, DVec3::new(0.0, 0.0, 4.0));
        assert_eq!(volume.lattice.origin, DVec3::new(-1.0, -2.0, 3.0));
        assert_eq!(volume.about.orientation, Some(Orientation::RAS));
        assert_eq!(volume.about.modality, Some(Modality::Ct));
        // Without directions, the letters are those of the sides that the axes come from.
        let turned = mha("AnatomicalOrientation = PIR\n", "1 1 1", "MET_UCHAR", &[1]);
        let turned = load(&turned, &ReadOptions::default()).unwrap();
        assert_eq!(turned.lattice.axes.x_axis, DVec3::Y);
        assert_eq!(turned.lattice.axes.y_axis, DVec3::Z);
        assert_eq!(turned.lattice.axes.z_axis, DVec3::NEG_X);
        let plain = mha("AnatomicalOrientation = ???\n", "1 1 1", "MET_UCHAR", &[1]);
        let plain = load(&plain, &ReadOptions::default()).unwrap();
        assert_eq!((plain.lattice.spacing(), plain.about.orientation), (DVec3::ONE, None));
    }

    #[test]
    fn data_in_other_files_are_joined() {
        let folder = Folder::new();
        for slice in 1..=3u8 {
            folder.write(&format!("s{slice:02}.raw"), [slice, 10 * slice]);
        }
        folder.write("all.raw", [1, 10, 2, 20, 3, 30]);
        folder.write("all.zraw", zlib(&[1, 10, 2, 20, 3, 30]));
        for (fields, data) in [
            ("", "all.raw"),
            ("CompressedData = True\n", "all.zraw"),
            ("", "LIST\ns01.raw\ns02.raw\ns03.raw"),
            ("", "LIST 2D\ns01.raw\ns02.raw\ns03.raw"),
            ("", "s%02d.raw 1 3 1"),
        ] {
            let text = header(fields, "2 1 3", "MET_UCHAR", data);
            let path = folder.write("a.mhd", text);
            let volume = read_with(&path, |source| read(source, &ReadOptions::default())).unwrap();
            assert_eq!(values(&volume), [1.0, 10.0, 2.0, 20.0, 3.0, 30.0], "{data}");
        }
        for (data, word) in [
            ("/etc/hostname", "an absolute path"),
            ("../all.raw", "leads out"),
            ("none.raw", "refers to “none.raw”"),
            ("LIST\ns01.raw", "there are 1 files"),
            ("s01.raw", "there are 2 bytes where 6 were expected"),
        ] {
            let path = folder.write("a.mhd", header("", "2 1 3", "MET_UCHAR", data));
            let error = read_with(&path, |source| read(source, &ReadOptions::default()));
            let error = error.unwrap_err().to_string();
            assert!(error.contains(word), "{data}: {error}");
        }
    }

    #[test]
    fn cuts_and_lies_are_errors() {
        let folder = Folder::new();
        let whole = mha("", "2 1 1", "MET_SHORT", &[1, 2, 3, 4]);
        every_cut(&folder, "a.mha", &whole, |source| read(source, &ReadOptions::default()));
        for (fields, sizes, kind, word) in [
            ("", "2", "MET_UCHAR", "NDims: is [1], but 2, 3 or 4"),
            ("", "0 1 1", "MET_UCHAR", "holds none"),
            ("", "2 x 1", "MET_UCHAR", "DimSize: “2 x 1” is not a list of 3 numbers"),
            ("", "1 1 1", "MET_STRING", "“MET_STRING” is not a type of numbers"),
            ("nonsense\n", "1 1 1", "MET_UCHAR", "line 3: is not a field"),
            ("NDims = 3\n", "1 1 1", "MET_UCHAR", "“NDims” is given twice"),
            ("ElementNumberOfChannels = 0\n", "1 1 1", "MET_UCHAR", "at least one channel"),
            ("HeaderSize = -2\n", "1 1 1", "MET_UCHAR", "HeaderSize: is -2"),
            ("ElementSpacing = 0 1 1\n", "1 1 1", "MET_UCHAR", "every step needs a length"),
            ("CompressedData = True\n", "1 1 1", "MET_UCHAR", "cannot be unpacked"),
        ] {
            let error = load(&mha(fields, sizes, kind, &[1, 2, 3]), &ReadOptions::default());
            let error = error.unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
