//! NRRD volumes (Teem's format, versions 1 to 5), attached and detached. Follows the definition at
//! <https://teem.sourceforge.net/nrrd/format.html>.

mod axes;
pub(super) mod files;
mod segments;
mod slice;
mod write;

use super::{
    Endian, ReadOptions, SampleType,
    shared::{
        anatomy::{self, Anatomy},
        plain::Plain,
    },
};
use crate::{
    Error, Result,
    about::Modality,
    input::{Source, copy},
    volume::{Arrangement, Lattice, Volume},
};
use axes::Axes;
use flate2::read::MultiGzDecoder;
use glam::{DMat3, DVec3};
use std::{borrow::Cow, collections::HashMap, path::Path, sync::Arc};
pub use write::{write, write_bytes};

/// Reads a volume of three axes of space. A fourth axis may have colours, the components of vectors
/// ([`ReadOptions::scalar`]), or times and other lists ([`ReadOptions::time`]); `kinds` says so, or
/// the options do. A file of two axes of space is a volume of one slice. Positions are in the
/// file's own space. If that is a patient's (`space:
/// left-posterior-superior`, LPS, RAS or LAS), the volume is turned into the frame of
/// [`Frame::Patient`](crate::about::Frame). Without `space directions`, the axes are x, y and z
/// with the steps in `spacings`, or 1 where those are missing or NaN.
///
/// The key `lattice:=bcc`, splatkit's own, marks a body-centred cubic lattice. `sizes` then counts
/// its layers along the third axis; the layers of its two Cartesian lattices alternate. The first
/// two directions are the edges of the cubic cell. The third is the step from layer to layer, half
/// an edge. Odd layers are displaced by half an edge along the first two. Readers that do not know
/// the key see a stack of slices in which every second slice is shifted by half a pixel. All other
/// keys are skipped.
///
/// A rectilinear lattice has the keys `axis positions 0`, `axis positions 1` and `axis positions
/// 2`, also splatkit's own convention (`axis positions 0:=0 1 2.5`). They give the ascending
/// positions of the samples along each axis, from the space origin, in lengths of its space
/// direction.
///
/// Encodings: raw, gzip, ascii and hex. `data file` may name one file inside the header's folder,
/// or several: as a list, or by a pattern with a number (`slice%03d.raw 1 90 1`).
///
/// Samples that are not finite, or equal [`ReadOptions::missing`], are holes.
///
/// # Errors
/// [`Error::Input`] with the field that is missing or wrong, for data that are cut off, and if no
/// sample has a value; [`Error::Limit`] for sizes over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let (header, body) = Header::read(source)?;
    let mut volume = volume(source, (&header, body), options)?;
    if let Some(anatomy) = header.anatomy() {
        anatomy.place(&mut volume);
    }
    if let Some(unit) = header.length_unit() {
        volume.about.length = unit;
    }
    // 3D Slicer copies the element of DICOM.
    let stated = ["modality", "DICOM_0008_0060_Modality"].map(|key| header.keys.get(key));
    volume.about.modality = stated.into_iter().flatten().find_map(|name| Modality::named(name));
    Ok(match segments::table(&header.keys) {
        Some(table) => volume.with_labels(table),
        None => volume,
    })
}

/// Reads the volume in the file's own space.
fn volume(
    source: &Source,
    (header, body): (&Header, usize),
    options: &ReadOptions,
) -> Result<Volume> {
    let axes = header.axes()?;
    let dims = axes.dims();
    let lattice = header.lattice(dims)?;
    let kind = header.sample_type()?;
    let rest = &source.bytes()[body..];
    let claimed = axes.count().and_then(|count| count.checked_mul(kind.bytes() as u64));
    let claimed = claimed.unwrap_or(u64::MAX);
    // Raising a limit would not help if raw samples are missing, so check that first.
    if header.data_file().is_none()
        && !header.has_skips()
        && header.is_raw()?
        && (rest.len() as u64) < claimed
    {
        return Err(source.error(
            "data",
            format!("there are {} bytes where {claimed} were expected", rest.len()),
        ));
    }
    let size = source.check_bytes("the size of the samples in bytes", claimed)?;
    let volume = |file: &Source, bytes: Cow<'_, [u8]>, endian: Endian| {
        let (grid, component) = axes.grid(header, kind, endian, options)?;
        grid.volume(file, lattice.clone(), bytes, component, options)
    };
    let Some(field) = header.data_file() else {
        let (bytes, endian) = header.bytes(source, rest, kind, size)?;
        return volume(source, bytes, endian);
    };
    let names = files::names(source, field, rest, dims)?;
    let part = size / names.len();
    if let [name] = &names[..] {
        let path = source.neighbour("data file", name)?;
        let data = source.open_beside(&path)?;
        let read = header.bytes(&data, data.bytes(), kind, size);
        return data.unless_changed(read.and_then(|(bytes, endian)| volume(&data, bytes, endian)));
    }
    source.spend("the size of the joined samples in bytes", size as u64)?;
    let (mut all, mut order) = (Vec::new(), Endian::Little);
    for name in &names {
        source.check_time()?;
        let path = source.neighbour("data file", name)?;
        let data = source.open_beside(&path)?;
        let (bytes, endian) = header.bytes(&data, data.bytes(), kind, part)?;
        all.extend_from_slice(&bytes);
        order = endian;
        data.intact()?;
    }
    volume(source, all.into(), order)
}

/// Returns where the samples are in a file with raw encoding; `None` for other encodings, and if
/// bytes or lines are to be skipped or the header names several files.
pub(super) fn plain(source: &Source) -> Result<Option<Plain>> {
    let (header, body) = Header::read(source)?;
    let axes = header.axes()?;
    let lattice = header.lattice(axes.dims())?;
    let sample_type = header.sample_type()?;
    let is_segmentation = segments::table(&header.keys).is_some();
    if axes.has_other() || header.has_skips() || !header.is_raw()? || is_segmentation {
        return Ok(None);
    }
    let endian = header.endian(sample_type)?;
    let (path, start) = match header.data_file() {
        None => (source.path.to_owned(), body),
        Some(field) if files::are_several(field) => return Ok(None),
        Some(name) => {
            let path = source.neighbour("data file", name)?;
            let size = sample_type.bytes_of(lattice.dims).unwrap_or(u64::MAX);
            // Too few bytes are an error when they are read.
            if let Ok(metadata) = path.metadata() {
                refuse_more(&path, metadata.len(), size)?;
            }
            (path, 0)
        }
    };
    let (lattice, frame) = anatomy::placed(header.anatomy(), lattice);
    Ok(Some(Plain { path, start, sample_type, endian, lattice, frame }))
}

/// Returns an error if a separate file of raw samples has more bytes than the samples need.
fn refuse_more(path: &Path, there: u64, expected: u64) -> Result<()> {
    if there <= expected {
        return Ok(());
    }
    Err(Error::input(
        path,
        "data",
        format!("there are {there} bytes where {expected} were expected"),
    )
    .hint(
        "“sizes” or “type” in the header is wrong, or “byte skip” is missing (-1 takes the \
               last bytes)",
    ))
}

/// Maximum size of a header in bytes; headers of real files are far smaller.
const LONGEST: usize = 64 << 20;

/// Bytes of memory for a line of the header, besides its text.
const ENTRY: u64 = 256;

/// The fields of a header, with names in lower case, and its keys with their values.
struct Header<'a> {
    source: &'a Source<'a>,
    fields: HashMap<String, String>,
    keys: HashMap<String, String>,
}

impl<'a> Header<'a> {
    /// Reads up to the empty line or the end of the file. Also returns the offset of the data.
    fn read(source: &'a Source<'a>) -> Result<(Self, usize)> {
        let bytes = source.bytes();
        if !(bytes.starts_with(b"NRRD000") && matches!(bytes.get(7), Some(b'1'..=b'5'))) {
            return Err(source.error("line 1", "does not begin with NRRD0001 … NRRD0005"));
        }
        let mut header = Self { source, fields: HashMap::new(), keys: HashMap::new() };
        // The line number of each field, by its name without spaces.
        let mut lines = HashMap::new();
        let mut at = 0;
        // One byte over the maximum shows that the header is too long.
        let window = &bytes[..bytes.len().min(LONGEST + 1)];
        for (line, number) in window.split_inclusive(|&b| b == b'\n').zip(1..) {
            at += line.len();
            if at > LONGEST {
                return Err(source
                    .error(
                        format!("line {number}"),
                        format!("the header is longer than {LONGEST} bytes"),
                    )
                    .hint("an empty line must stand between the header and the data"));
            }
            // Comments may be in any encoding.
            let text = copy::lossy(line);
            let text = text.trim_end_matches(['\n', '\r']);
            if text.is_empty() {
                break;
            }
            source.spend("the size of the header in bytes", ENTRY + 2 * line.len() as u64)?;
            match text.split_once(':') {
                _ if number == 1 || text.starts_with('#') => {}
                // “key:=value”
                Some((key, value)) if value.starts_with('=') => {
                    header.add_key(key.trim(), value[1..].trim(), number)?;
                }
                Some((name, value)) => {
                    // File names follow a list, up to the end.
                    if header.add_field(name.trim(), value.trim(), number, &mut lines)? {
                        break;
                    }
                }
                None => {
                    let message = "is neither a field, a key and value, a comment, nor the empty \
                                   line before the data";
                    return Err(source.error(format!("line {number}"), message));
                }
            }
        }
        header.deepen();
        Ok((header, at))
    }

    /// Adds a key with its value. Only keys that are read must be unique.
    fn add_key(&mut self, key: &str, value: &str, line: usize) -> Result<()> {
        let is_read = key == "lattice" || key.starts_with("axis positions ");
        if self.keys.insert(key.to_owned(), value.to_owned()).is_some() && is_read {
            let message = format!("the key “{}” is given twice; give it once", excerpt(key));
            return Err(self.source.error(format!("line {line}"), message));
        }
        Ok(())
    }

    /// Adds a field, unless one of `lines` has it already. Returns whether it announces a list of
    /// file names.
    fn add_field(
        &mut self,
        name: &str,
        value: &str,
        line: usize,
        lines: &mut HashMap<String, usize>,
    ) -> Result<bool> {
        let name = name.to_ascii_lowercase();
        let spelling = match name.replace(' ', "").as_str() {
            "centerings" => "centers".to_owned(),
            other => other.to_owned(),
        };
        let is_list = spelling == "datafile" && files::is_list(value);
        if let Some(before) = lines.insert(spelling, line) {
            let message = format!(
                "the field “{}” is given twice, in line {before} too; give it once",
                excerpt(&name)
            );
            return Err(self.source.error(format!("line {line}"), message));
        }
        self.fields.insert(name, value.to_owned());
        Ok(is_list)
    }

    /// Returns a field by any of its spellings.
    fn get(&self, names: &[&str]) -> Option<&str> {
        names.iter().find_map(|&name| self.fields.get(name)).map(String::as_str)
    }

    /// Returns the field that names the files with the samples; `None` if the samples are in this
    /// file.
    fn data_file(&self) -> Option<&str> {
        self.get(&["data file", "datafile"])
    }

    fn need(&self, name: &str) -> Result<&str> {
        self.get(&[name])
            .ok_or_else(|| self.source.error("header", format!("has no field “{name}”")))
    }

    /// Returns whether the samples have raw encoding.
    fn is_raw(&self) -> Result<bool> {
        Ok(self.need("encoding")?.eq_ignore_ascii_case("raw"))
    }

    /// Returns whether lines or bytes before the samples are to be skipped.
    fn has_skips(&self) -> bool {
        self.get(&["line skip", "lineskip", "byte skip", "byteskip"]).is_some()
    }

    /// Returns the numbers of a field, exactly `N`.
    fn numbers<const N: usize, T: std::str::FromStr>(
        &self,
        name: &str,
        text: &str,
    ) -> Result<[T; N]> {
        let words = text.split_ascii_whitespace().take(N + 1);
        let numbers: Option<Vec<T>> = words.map(|word| word.parse().ok()).collect();
        let wrong = |_| {
            self.source.error(name, format!("“{}” is not a list of {N} numbers", excerpt(text)))
        };
        numbers.unwrap_or_default().try_into().map_err(wrong)
    }

    fn axes(&self) -> Result<Axes> {
        Axes::of(self)
    }

    /// Returns the words of a field with one for each axis, without that of an axis that is not one
    /// of space.
    fn of_space(&self, text: &str) -> Result<String> {
        let axes = self.axes()?;
        let words = text.split_ascii_whitespace().enumerate();
        let kept: Vec<&str> =
            words.filter(|(axis, _)| axes.is_space(*axis)).map(|(_, word)| word).collect();
        Ok(kept.join(" "))
    }

    /// Returns how the file's space lies in the patient, if it says so.
    fn anatomy(&self) -> Option<Anatomy> {
        self.get(&["space"]).and_then(Anatomy::towards)
    }

    /// Returns the unit of lengths, if the axes of space have one in common.
    fn length_unit(&self) -> Option<String> {
        let texts = self.get(&["space units"]).or_else(|| self.get(&["units"]))?;
        let mut units = texts.split('"').skip(1).step_by(2).filter(|unit| !unit.is_empty());
        let first = units.next()?.trim();
        let is_one = units.all(|unit| unit.trim() == first) && first.chars().count() <= 16;
        is_one.then(|| first.replace("um", "µm").replace("micron", "µm"))
    }

    fn lattice(&self, dims: [usize; 3]) -> Result<Lattice> {
        let along = match self.get(&["space directions"]) {
            Some(_) => [[0.0, 1.0]; 3],
            None => self.along_axes(dims)?,
        };
        let axes = match self.get(&["space directions"]) {
            Some(text) => {
                let text =
                    if self.axes()?.has_other() { &text.replacen("none", "", 1) } else { text };
                let [x, y, z] = self.vectors("space directions", text)?;
                DMat3::from_cols(x, y, z)
            }
            None => DMat3::from_diagonal(along.map(|axis| axis[1]).into()),
        };
        let origin = match self.get(&["space origin"]) {
            Some(text) => self.vectors::<1>("space origin", text)?[0],
            None => DVec3::from(along.map(|axis| axis[0])),
        };
        let lattice = match self.keys.get("lattice").map(String::as_str) {
            None => Lattice { dims, origin, axes, arrangement: self.arrangement()? },
            // Two layers span an edge.
            Some("bcc") => Lattice::body_centred(
                dims,
                origin,
                DMat3::from_cols(axes.x_axis, axes.y_axis, 2.0 * axes.z_axis),
            ),
            Some(other) => {
                let error =
                    self.source.error("lattice", format!("“{other}” is not a known lattice"));
                return Err(error.hint(
                    "lattice:=bcc marks body-centred cubic lattices; Cartesian ones \
                                have no such key",
                ));
            }
        };
        lattice.check().map_err(|message| self.source.error("header", message))?;
        Ok(lattice)
    }

    /// Returns the position of the first sample and the step along each axis, from the per-axis
    /// fields.
    fn along_axes(&self, dims: [usize; 3]) -> Result<[[f64; 2]; 3]> {
        // NaN marks an unknown value of an axis.
        let numbers = |names: &[&str]| match self.get(names) {
            Some(text) => self.numbers::<3, f64>(names[0], &self.of_space(text)?),
            None => Ok([f64::NAN; 3]),
        };
        let spacings = numbers(&["spacings"])?;
        let (mins, maxs) =
            (numbers(&["axis mins", "axismins"])?, numbers(&["axis maxs", "axismaxs"])?);
        // Samples are at the centres of cells unless the header says that they are nodes.
        let centers = self.get(&["centers", "centerings"]).unwrap_or_default();
        let centers = self.of_space(centers)?;
        let is_node: Vec<bool> = centers
            .split_ascii_whitespace()
            .map(|word| word.eq_ignore_ascii_case("node"))
            .collect();
        Ok(std::array::from_fn(|axis| {
            let is_node = is_node.get(axis).copied().unwrap_or(false);
            let steps = dims[axis].saturating_sub(usize::from(is_node)).max(1) as f64;
            let known = |spacing: &f64| !spacing.is_nan();
            let of_ends = Some((maxs[axis] - mins[axis]) / steps).filter(known);
            let spacing = Some(spacings[axis]).filter(known).or(of_ends).unwrap_or(1.0);
            let first = Some(mins[axis] + if is_node { 0.0 } else { 0.5 * spacing }).filter(known);
            [first.unwrap_or(0.0), spacing]
        }))
    }

    fn arrangement(&self) -> Result<Arrangement> {
        let keys = [0, 1, 2].map(|axis| format!("axis positions {axis}"));
        if !keys.iter().any(|key| self.keys.contains_key(key)) {
            return Ok(Arrangement::Cartesian);
        }
        let mut places = [const { Vec::new() }; 3];
        for (places, key) in places.iter_mut().zip(&keys) {
            let text = self
                .keys
                .get(key)
                .ok_or_else(|| self.source.error("header", format!("has no key “{key}”")))?;
            let wrong = || self.source.error(key, "is not a list of numbers");
            self.source.room::<[f64; 2]>("the positions along an axis", text.len() / 2)?;
            *places = text
                .split_ascii_whitespace()
                .map(|word| word.parse().map_err(|_| wrong()))
                .collect::<Result<_>>()?;
        }
        Ok(Arrangement::Rectilinear(Arc::new(places)))
    }

    /// Returns vectors written as (x,y,z), exactly `N`.
    fn vectors<const N: usize>(&self, name: &str, text: &str) -> Result<[DVec3; N]> {
        let wrong = || self.source.error(name, format!("“{}” is not {N} × (x,y,z)", excerpt(text)));
        let vector = |part: &str| {
            let numbers: Option<Vec<f64>> = part
                .trim()
                .strip_prefix('(')?
                .split(',')
                .take(4)
                .map(|word| word.trim().parse().ok())
                .collect();
            <[f64; 3]>::try_from(numbers?).ok().map(DVec3::from_array)
        };
        let (inside, rest) = text.rsplit_once(')').ok_or_else(wrong)?;
        let vectors: Option<Vec<DVec3>> = inside.split(')').take(N + 1).map(vector).collect();
        let vectors = vectors.filter(|_| rest.trim().is_empty()).ok_or_else(wrong)?;
        vectors.try_into().map_err(|_| wrong())
    }

    fn sample_type(&self) -> Result<SampleType> {
        let name = self.need("type")?.to_ascii_lowercase();
        Ok(match name.as_str() {
            "signed char" | "int8" | "int8_t" => SampleType::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => SampleType::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
                SampleType::I16
            }
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
                SampleType::U16
            }
            "int" | "signed int" | "int32" | "int32_t" => SampleType::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => SampleType::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => SampleType::I64,
            "ulonglong"
            | "unsigned long long"
            | "unsigned long long int"
            | "uint64"
            | "uint64_t" => SampleType::U64,
            "float" => SampleType::F32,
            "double" => SampleType::F64,
            _ => {
                return Err(self
                    .source
                    .error("type", format!("“{}” is not a scalar type", excerpt(&name))));
            }
        })
    }

    fn endian(&self, kind: SampleType) -> Result<Endian> {
        match self.get(&["endian"]).map(str::to_ascii_lowercase).as_deref() {
            Some("little") => Ok(Endian::Little),
            Some("big") => Ok(Endian::Big),
            None if kind.bytes() == 1 => Ok(Endian::Little),
            None => Err(self
                .source
                .error("header", "has no field “endian”, which samples of several bytes need")),
            Some(other) => {
                Err(self.source.error("endian", format!("“{other}” is neither little nor big")))
            }
        }
    }

    /// Decodes `size` bytes of samples from the data, which may be in a separate file. Also returns
    /// their byte order.
    fn bytes<'d>(
        &self,
        file: &Source,
        data: &'d [u8],
        kind: SampleType,
        size: usize,
    ) -> Result<(Cow<'d, [u8]>, Endian)> {
        let place = "data";
        let (data, skip) = self.skip_lines(data)?;
        let encoding = self.need("encoding")?.to_ascii_lowercase();
        let from_end = skip == -1;
        if from_end && encoding != "raw" {
            return Err(self
                .source
                .error("byte skip", "-1 counts from the end, which works only for raw data"));
        }
        let skip = skip.max(0) as usize;
        let after_skip = || {
            data.get(skip..).ok_or_else(|| {
                file.error(place, format!("have fewer than the {skip} bytes to skip"))
            })
        };
        let text = || {
            let bytes = after_skip()?;
            file.room::<u8>("the text", bytes.len())?;
            copy::text(bytes).map_err(|at| file.error(place, format!("byte {at} is not text")))
        };
        Ok(match encoding.as_str() {
            "raw" => {
                let skip = (!from_end).then_some(skip);
                (self.raw(file, data, skip, size)?.into(), self.endian(kind)?)
            }
            // Skipped lines precede the compressed stream; skipped bytes are inside it.
            "gzip" | "gz" => {
                let mut unpacked =
                    file.unpack(place, MultiGzDecoder::new(data), skip.saturating_add(size))?;
                unpacked.drain(..skip);
                (unpacked.into(), self.endian(kind)?)
            }
            "ascii" | "txt" | "text" => {
                file.spend("the size of the numbers in bytes", size as u64)?;
                let bytes = kind
                    .parse(&text()?, size / kind.bytes())
                    .map_err(|message| file.error(place, message))?;
                (bytes.into(), Endian::Little)
            }
            "hex" => {
                file.spend("the size of the digits in bytes", data.len() as u64)?;
                let bytes =
                    from_hex(&text()?, size).map_err(|message| file.error(place, message))?;
                (bytes.into(), self.endian(kind)?)
            }
            _ => {
                return Err(self
                    .source
                    .error("encoding", format!("“{encoding}” is not supported"))
                    .hint("write the file with raw or gzip encoding"));
            }
        })
    }

    /// Skips the lines before the data. Also returns the number of bytes to skip; −1 takes the last
    /// bytes.
    fn skip_lines<'d>(&self, data: &'d [u8]) -> Result<(&'d [u8], i64)> {
        let skip = |names: &[&str]| match self.get(names) {
            Some(text) => self.numbers::<1, i64>(names[0], text).map(|[n]| n),
            None => Ok(0),
        };
        let lines = skip(&["line skip", "lineskip"])?;
        let skipped: usize = data
            .split_inclusive(|&b| b == b'\n')
            .take(lines.max(0) as usize)
            .map(<[u8]>::len)
            .sum();
        let bytes = skip(&["byte skip", "byteskip"])?;
        if lines < 0 || bytes < -1 {
            return Err(self.source.error("header", "skips a negative number of lines or bytes"));
        }
        Ok((&data[skipped..], bytes))
    }

    /// Returns the `size` bytes of raw samples after `skip` bytes; without `skip`, the last ones.
    fn raw<'d>(
        &self,
        file: &Source,
        data: &'d [u8],
        skip: Option<usize>,
        size: usize,
    ) -> Result<&'d [u8]> {
        let there = data.len().saturating_sub(skip.unwrap_or(0));
        if skip.is_some() && self.data_file().is_some() {
            refuse_more(file.path, there as u64, size as u64)?;
        }
        let start = skip.or_else(|| data.len().checked_sub(size));
        let samples = start.and_then(|start| data.get(start..)).and_then(|rest| rest.get(..size));
        samples.ok_or_else(|| {
            file.error("data", format!("there are {there} bytes where {size} were expected"))
        })
    }
}

/// Returns the first 80 characters of a text, for an error.
fn excerpt(text: &str) -> String {
    if text.chars().nth(80).is_none() {
        text.to_owned()
    } else {
        text.chars().take(80).chain(['…']).collect()
    }
}

/// Decodes bytes of two hexadecimal digits each; white space is ignored.
fn from_hex(text: &str, size: usize) -> Result<Vec<u8>, String> {
    let mut digits = Vec::new();
    for c in text.chars().filter(|c| !c.is_ascii_whitespace()) {
        digits.push(c.to_digit(16).ok_or_else(|| {
            format!(
                "“{c}” is not a hexadecimal \
                                                          digit"
            )
        })? as u8);
    }
    if digits.len() % 2 != 0 || digits.len() / 2 != size {
        return Err(format!(
            "there are {} hexadecimal digits where {} were expected",
            digits.len(),
            2 * size as u64
        ));
    }
    Ok(digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, input::testing::*, volume::Samples};
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    const VALUES: [i16; 12] = [0, 1, -2, 300, -4000, 5, 6, 7, 8, 9, 10, 32767];

    fn read(source: &Source) -> Result<Volume> {
        super::read(source, &ReadOptions::default())
    }

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn file(fields: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = format!("NRRD0005\n# a comment\ndimension: 3\n{fields}\n\n").into_bytes();
        bytes.extend_from_slice(data);
        bytes
    }

    fn bytes_of(endian: Endian) -> Vec<u8> {
        VALUES
            .iter()
            .flat_map(|v| if endian == Endian::Little { v.to_le_bytes() } else { v.to_be_bytes() })
            .collect()
    }

    #[test]
    fn every_encoding_in_both_orders() {
        let folder = Folder::new();
        let ascii = VALUES.map(|v| v.to_string()).join("\n");
        for (endian, name) in [(Endian::Little, "little"), (Endian::Big, "big")] {
            let raw = bytes_of(endian);
            let hex: String = raw.iter().map(|b| format!("{b:02x} ")).collect();
            for (encoding, data) in [
                ("raw", raw.clone()),
                ("gzip", gzip(&raw)),
                ("gz", gzip(&raw)),
                ("ascii", ascii.clone().into_bytes()),
                ("txt", ascii.clone().into_bytes()),
                ("hex", hex.into_bytes()),
            ] {
                for (header, line_end) in [(0, "\n"), (1, "\r\n")] {
                    let fields =
                        format!("type: short\nsizes: 3 2 2\nencoding: {encoding}\nendian: {name}");
                    let text =
                        format!("NRRD000{}\nkey:=value\ndimension: 3\n{fields}\n\n", header + 4);
                    let mut content = text.replace('\n', line_end).into_bytes();
                    content.extend_from_slice(&data);
                    let volume = read_with(&folder.write("volume.nrrd", &content), read).unwrap();
                    assert_eq!(volume.samples, Samples::I16(VALUES.to_vec()), "{encoding} {name}");
                    assert_eq!(volume.lattice, Lattice::with_spacing([3, 2, 2], DVec3::ONE));
                }
            }
        }
    }

    /// Reads the lattice of two samples from a header with these fields.
    fn lattice(fields: &str) -> Result<Lattice> {
        let folder = Folder::new();
        let content = file(&format!("type: uint8\nsizes: 2 1 1\nencoding: raw\n{fields}"), &[1, 2]);
        read_with(&folder.write("volume.nrrd", &content), read).map(|volume| volume.lattice)
    }

    #[test]
    fn units_of_lengths_are_read() {
        let folder = Folder::new();
        let unit = |fields: &str| {
            let content =
                file(&format!("type: uint8\nsizes: 2 1 1\nencoding: raw\n{fields}"), &[1, 2]);
            read_with(&folder.write("a.nrrd", &content), read).unwrap().about.length
        };
        assert_eq!(unit("space units: \"mm\" \"mm\" \"mm\""), "mm");
        assert_eq!(unit("units: \"um\" \"um\" \"um\""), "µm");
        assert_eq!(unit("units: \"mm\" \"mm\" \"s\""), "");
        assert_eq!(unit(""), "");
    }

    #[test]
    fn lattices() {
        let turned = lattice(
            "space: RAS\nspace directions: (0, 0.5,0) (-2,0,0)(0,0,3)\nspace origin: (10,20,-30.5)",
        )
        .unwrap();
        assert_eq!(turned.origin, DVec3::new(10.0, 20.0, -30.5));
        assert_eq!(turned.position(DVec3::new(1.0, 1.0, 1.0)), DVec3::new(8.0, 20.5, -27.5));
        assert_eq!(lattice("spacings: 1 2.5 NaN").unwrap().spacing(), DVec3::new(1.0, 2.5, 1.0));
        for (fields, origin, spacing) in [
            (
                "axis mins: 0 1 2\naxis maxs: 4 4 20\ncenters: node node cell",
                [0.0, 1.0, 11.0],
                [4.0, 3.0, 18.0],
            ),
            ("axis mins: 0 NaN 2\naxis maxs: 4 4 nan", [1.0, 0.0, 2.5], [2.0, 1.0, 1.0]),
            (
                "axismins: 10 0 0\nspacings: 2 3 4\ncenterings: node node node",
                [10.0, 0.0, 0.0],
                [2.0, 3.0, 4.0],
            ),
            (
                "kinds: domain space time\nspace origin: (1,2,3)\naxis mins: 9 9 9",
                [1.0, 2.0, 3.0],
                [1.0; 3],
            ),
        ] {
            let placed = lattice(fields).unwrap();
            assert_eq!(
                (placed.origin, placed.spacing()),
                (origin.into(), spacing.into()),
                "{fields}"
            );
        }
        let body_centred = lattice("lattice:=bcc\nspacings: 2 2 1").unwrap();
        assert_eq!(
            body_centred,
            Lattice::body_centred([2, 1, 1], DVec3::ZERO, DMat3::from_diagonal(DVec3::splat(2.0)))
        );
        assert_eq!(
            lattice("units:=mm:=lattice:=bcc\ncontent: lattice:=bcc").unwrap(),
            Lattice::with_spacing([2, 1, 1], DVec3::ONE)
        );
    }

    /// Reads a file of 2 × 1 × 1 samples with a fourth axis of three numbers.
    fn with_fourth_axis(fields: &str, options: &ReadOptions) -> (Result<Volume>, Vec<String>) {
        let folder = Folder::new();
        let text = format!("NRRD0004\ntype: uint8\ndimension: 4\nencoding: raw\n{fields}\n\n");
        let mut content = text.into_bytes();
        content.extend([200, 40, 40, 0, 0, 255]);
        let path = folder.write("volume.nrrd", &content);
        warnings_of(|| read_with(&path, |source| super::read(source, options)))
    }

    #[test]
    fn a_fourth_axis_has_colours_components_or_times() {
        let default = ReadOptions::default();
        let first = "sizes: 3 2 1 1\nspace directions: none (0,0,2) (0,1,0) (1,0,0)\nkinds";
        let (volume, words) =
            with_fourth_axis(&format!("{first}: RGB-color domain domain domain"), &default);
        let volume = volume.unwrap();
        assert_eq!(volume.colors.as_deref().unwrap(), [[200, 40, 40, 255], [0, 0, 255, 255]]);
        assert_eq!((volume.lattice.axes.x_axis, words.len()), (2.0 * DVec3::Z, 0));
        let values = |fields: &str, options: &ReadOptions| {
            let volume = with_fourth_axis(fields, options).0.unwrap();
            assert!(volume.colors.is_none());
            [0, 1].map(|index| volume.value(index))
        };
        let vector = format!("{first}: vector space space space");
        assert_eq!(values(&vector, &ReadOptions::scalar(Some(":2"))), [40.0, 255.0]);
        assert_eq!(values(&vector, &default)[1], 255.0);
        // The same numbers as three times, each with its samples one after the other.
        let last = "sizes: 2 1 1 3\nspacings: 3 1 1 nan\nkinds: domain domain domain time";
        let (volume, words) = with_fourth_axis(last, &default);
        let volume = volume.unwrap();
        assert_eq!((volume.range, volume.lattice.spacing().x), ([40.0, 200.0], 3.0));
        assert!(words[0].ends_with("shows the first of 3 times; --time 1 shows the second"));
        let third = ReadOptions { time: Some(2), ..ReadOptions::default() };
        assert_eq!(values(last, &third), [0.0, 255.0]);
    }

    #[test]
    fn a_fourth_axis_without_a_kind_is_asked_for() {
        let (error, _) = with_fourth_axis("sizes: 3 2 1 1", &ReadOptions::default());
        let Error::Input { message, hint, .. } = error.unwrap_err() else { panic!("no input") };
        assert!(message.contains("does not say what the 3 numbers along axis 0 are"), "{message}");
        assert!(hint.unwrap().contains("--scalar rgb draws colours"));
        let rgb = ReadOptions::scalar(Some("rgb"));
        assert!(with_fourth_axis("sizes: 3 2 1 1", &rgb).0.unwrap().colors.is_some());
        let (error, _) = with_fourth_axis("sizes: 0 2 1 1\nkinds: list domain domain domain", &rgb);
        assert!(error.unwrap_err().to_string().contains("axis 0 has no numbers"));
    }

    #[test]
    fn lattices_that_cannot_be_read() {
        for (fields, word) in [
            ("space directions: none (1,0,0) (0,1,0)", "space directions"),
            ("space directions: (1,0) (0,1)", "space directions"),
            ("space directions: (1,0,0) (0,1,0) (1,1,0)", "one plane"),
            ("space origin: (1,0,0", "space origin"),
            ("axis mins: 0 0", "axis mins"),
            ("spacings: 1 0 1", "spacing"),
            ("spacings: 1 1", "spacings"),
            ("spacings: 1 1 inf", "finite"),
            ("lattice:=fcc", "fcc"),
            ("lattice:=", "lattice"),
        ] {
            let message = lattice(fields).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn skips_and_detached_files() {
        let folder = Folder::new();
        folder.write("plain.raw", [9, 9, 1, 2, 3, 4]);
        folder.write("lines.raw", b"one\ntwo\n\x05\x01\x02\x03\x04");
        folder.write("packed.raw.gz", [b"line\n".to_vec(), gzip(&[7, 1, 2, 3, 4])].concat());
        let detached = |fields: &str| {
            let text = format!("NRRD0001\ntype: uchar\ndimension: 3\nsizes: 2 2 1\n{fields}\n");
            read_with(&folder.write("volume.nhdr", text.as_bytes()), read)
        };
        for fields in [
            "encoding: raw\nbyte skip: 2\ndata file: plain.raw",
            "encoding: raw\nbyte skip: -1\ndatafile: ./plain.raw",
            "encoding: raw\nline skip: 2\nbyte skip: 1\ndata file: lines.raw",
            "encoding: gzip\nlineskip: 1\nbyteskip: 1\ndata file: packed.raw.gz",
        ] {
            assert_eq!(
                detached(fields).unwrap().samples,
                Samples::U8(vec![1, 2, 3, 4]),
                "{fields}"
            );
        }
        for (fields, word) in [
            ("encoding: raw\ndata file: missing.raw", "missing.raw"),
            ("encoding: raw\ndata file: ../plain.raw", "own folder"),
            ("encoding: raw\ndata file: LIST", "0 files"),
            ("encoding: raw\ndata file: slice%03d.raw 1 9 1", "9 files"),
            ("encoding: raw\nbyte skip: 99\ndata file: plain.raw", "0 bytes where 4"),
            ("encoding: raw\nbyte skip: -2\ndata file: plain.raw", "negative"),
            (
                "encoding: raw\nbyte skip: 9223372036854775807\ndata file: plain.raw",
                "0 bytes where 4",
            ),
            ("encoding: gzip\nbyte skip: 9223372036854775807\ndata file: packed.raw.gz", "limit"),
            ("encoding: gzip\nbyte skip: -1\ndata file: packed.raw.gz", "-1"),
            ("encoding: bzip2\ndata file: plain.raw", "bzip2"),
            ("encoding: hex\ndata file: plain.raw", "hexadecimal"),
            ("data file: plain.raw", "encoding"),
        ] {
            let message = detached(fields).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn every_type() {
        let folder = Folder::new();
        for (name, samples) in [
            ("signed char", Samples::I16(vec![1, 2])),
            ("unsigned char", Samples::U8(vec![1, 2])),
            ("short int", Samples::I16(vec![1, 2])),
            ("unsigned short int", Samples::U16(vec![1, 2])),
            ("int", Samples::I32(vec![1, 2])),
            ("uint32_t", Samples::I32(vec![1, 2])),
            ("long long int", Samples::I32(vec![1, 2])),
            ("unsigned long long", Samples::I32(vec![1, 2])),
            ("float", Samples::F32(vec![1.0, 2.0])),
            ("double", Samples::F32(vec![1.0, 2.0])),
        ] {
            let content = file(&format!("type: {name}\nsizes: 1 1 2\nencoding: ascii"), b"1 2");
            let volume = read_with(&folder.write("volume.nrrd", &content), read).unwrap();
            assert_eq!(volume.samples, samples, "{name}");
        }
    }

    #[test]
    fn positions_along_the_axes() {
        let folder = Folder::new();
        let load = |keys: &str| {
            let fields = "space directions: (0,2,0) (1,0,0) (0,0,1)\nspace origin: (10,20,30)";
            let content = file(
                &format!("type: uint8\nsizes: 3 2 1\nencoding: raw\n{fields}\n{keys}"),
                &[0, 1, 2, 3, 4, 5],
            );
            read_with(&folder.write("volume.nrrd", &content), read)
        };
        let keys = "axis positions 0:=0 1 2.5\naxis positions 1:=-1 3\naxis positions 2:=7";
        let volume = load(keys).unwrap();
        assert_eq!(volume.lattice.sample_position(5), DVec3::new(13.0, 25.0, 37.0));
        for (from, to, word) in [
            ("axis positions 1:=-1 3\n", "", "no key “axis positions 1”"),
            ("2.5", "two", "axis positions 0: is not a list of numbers"),
            ("2.5", "0.5", "must ascend"),
            (" 2.5", "", "2 coordinates along x for 3 samples"),
        ] {
            let message = load(&keys.replace(from, to)).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn cuts_and_lies_are_errors() {
        let folder = Folder::new();
        let fields = "type: short\nsizes: 3 2 2\nencoding";
        for (encoding, data) in
            [("raw", bytes_of(Endian::Little)), ("gzip", gzip(&bytes_of(Endian::Little)))]
        {
            let content = file(&format!("{fields}: {encoding}\nendian: little"), &data);
            every_cut(&folder, "volume.nrrd", &content, read);
        }
        let error = |fields: &str, data: &[u8]| {
            read_with(&folder.write("volume.nrrd", file(fields, data)), read).unwrap_err()
        };
        let sizes = |sizes: &str| {
            error(&format!("type: uint8\nsizes: {sizes}\nencoding: gzip"), &gzip(&vec![0; 1 << 20]))
        };
        assert!(matches!(sizes("1099511627776 1 1"), Error::Limit { .. }));
        assert!(
            matches!(sizes("4294967296 4294967296 2"), Error::Input { .. }),
            "more than memory indexes"
        );
        assert!(sizes("99999999999999999999 1 1").to_string().contains("sizes"));
        assert!(sizes("2147483648 4 1").to_string().contains("unpacks to 1048576 bytes"));
        assert!(sizes("2 2 2").to_string().contains("too many bytes"));
        assert!(sizes("0 2 2").to_string().contains("holds none"));
        assert!(sizes("2 2").to_string().contains("3 numbers"));
        for (fields, data, word) in [
            ("type: block\nsizes: 1 1 1\nencoding: raw", &[0][..], "block"),
            ("type: short\nsizes: 1 1 1\nencoding: raw", &[0; 2], "endian"),
            ("type: short\nsizes: 1 1 1\nencoding: raw\nendian: middle", &[0; 2], "middle"),
            ("type: uchar\nsizes: 1 1 1\nencoding: ascii", b"256", "256"),
            ("type: uchar\nsizes: 1 1 1\nencoding: ascii", b"\xff", "not text"),
            ("type: float\nsizes: 1 1 2\nencoding: ascii", b"inf nan", "none of the 2 samples"),
            ("nonsense\ntype: float", b"", "line 4"),
        ] {
            let message = error(fields, data).to_string();
            assert!(message.contains(word), "{message}");
        }
        let flat = "NRRD0004\ntype: uint8\ndimension: 1\nsizes: 4\nencoding: raw\n\n1234";
        let message = read_with(&folder.write("volume.nrrd", flat), read).unwrap_err().to_string();
        assert!(message.contains("3 axes"), "{message}");
    }

    #[test]
    fn fields_stand_once() {
        let folder = Folder::new();
        let start = "type: uint8\nsizes: 2 1 1\nencoding: raw";
        let load = |fields: &str| {
            let content = file(&format!("{start}\n{fields}"), &[1, 2]);
            read_with(&folder.write("volume.nrrd", &content), read)
        };
        assert!(load("content: a\nkey:=1\nkey:=2").is_ok());
        for (fields, word) in [
            ("sizes: 2 1 1", "“sizes” is given twice"),
            ("Sizes: 1 2 1", "“sizes” is given twice"),
            ("spacings: 1 1 1\nspacings: 1 1 2", "“spacings” is given twice"),
            ("axis mins: 0 0 0\naxismins: 0 0 0", "“axismins” is given twice"),
            ("centers: node node node\ncenterings: cell cell cell", "“centerings” is given twice"),
            ("lattice:=bcc\nlattice:=bcc", "the key “lattice” is given twice"),
        ] {
            let message = load(fields).unwrap_err().to_string();
            assert!(message.contains("line ") && message.contains(word), "{fields}: {message}");
        }
    }

    #[test]
    fn files_of_data_have_no_more_than_the_samples() {
        let folder = Folder::new();
        folder.write("a.raw", [9, 1, 2]);
        let detached = |fields: &str| {
            let text = format!(
                "NRRD0001\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n{fields}\n"
            );
            let path = folder.write("volume.nhdr", text);
            (read_with(&path, read), read_with(&path, plain).map(|plain| plain.is_some()))
        };
        let (whole, plain) = detached("data file: a.raw");
        for error in [whole.err(), plain.err()] {
            let message = error.unwrap().to_string();
            assert!(
                message.ends_with("a.raw: data: there are 3 bytes where 2 were expected"),
                "{message}"
            );
        }
        for skip in ["byte skip: 1", "byte skip: -1"] {
            let (whole, plain) = detached(&format!("{skip}\ndata file: a.raw"));
            assert_eq!((whole.unwrap().samples, plain.unwrap()), (Samples::U8(vec![1, 2]), false));
        }
    }
}
