//! Parses the lines and arrays of legacy VTK files.

use super::super::{
    super::{Endian, SampleType},
    xml::Part,
};
use crate::{
    Error, Result,
    input::{Source, copy},
};

/// Bytes per field array besides its name and its numbers.
const FIELD: u64 = 256;

/// Maximum length of a line in bytes. Lines of real files are far shorter; arrays do not count as
/// lines.
const LONGEST: usize = 1 << 20;

/// A position in a file.
pub(super) struct Parser<'a> {
    source: &'a Source<'a>,
    at: usize,
    binary: bool,
}

impl<'a> Parser<'a> {
    /// Reads the header. Also returns the kind of the data set, by its index among the `known`
    /// ones.
    pub fn open(source: &'a Source, known: &[&str]) -> Result<(Self, usize)> {
        let mut parser = Self { source, at: 0, binary: false };
        let cut = |parser: &Self| source.error(parser.place(), "the file ends inside its header");
        if !source.bytes().starts_with(b"# vtk DataFile Version") {
            return Err(source.error("line 1", "does not begin with “# vtk DataFile Version”"));
        }
        // The title may be empty, and in any encoding.
        for _ in 0..2 {
            parser.raw_line()?.ok_or_else(|| cut(&parser))?;
        }
        let (place, encoding) = parser.line()?.ok_or_else(|| cut(&parser))?;
        parser.binary = match encoding.to_ascii_uppercase().as_str() {
            "ASCII" => false,
            "BINARY" => true,
            _ => {
                return Err(
                    source.error(place, format!("“{encoding}” is neither ASCII nor BINARY"))
                );
            }
        };
        loop {
            let (place, line) = parser.statement()?.ok_or_else(|| cut(&parser))?;
            let words: Vec<&str> = line.split_ascii_whitespace().take(4).collect();
            match words[..] {
                [keyword, kind] if keyword.eq_ignore_ascii_case("DATASET") => {
                    let kind = kind.to_ascii_uppercase();
                    let index = known.iter().position(|known| *known == kind);
                    let message = format!("the data set {kind} is not supported");
                    return Ok((parser, index.ok_or_else(|| source.error(place, message))?));
                }
                // Data of the whole file may come first.
                [keyword, _, count] if keyword.eq_ignore_ascii_case("FIELD") => {
                    for _ in 0..parser.count(&place, count)? {
                        parser.field()?;
                    }
                }
                [keyword, ..] if keyword.eq_ignore_ascii_case("METADATA") => {
                    parser.skip_to_blank()?;
                }
                _ => {
                    return Err(source.error(place, "the line “DATASET …” was expected here"));
                }
            }
        }
    }

    fn place(&self) -> String {
        format!("byte {}", self.at)
    }

    fn rest(&self) -> &'a [u8] {
        let source: &'a Source = self.source;
        &source.bytes()[self.at..]
    }

    /// Returns the next line unchanged; `None` at the end of the file.
    fn raw_line(&mut self) -> Result<Option<&'a [u8]>> {
        let rest = self.rest();
        let window = &rest[..rest.len().min(LONGEST)];
        let Some(line) = window.split_inclusive(|&b| b == b'\n').next() else { return Ok(None) };
        if line.len() == LONGEST && line.len() < rest.len() && !line.ends_with(b"\n") {
            return Err(self
                .source
                .error(self.place(), format!("the line is longer than {LONGEST} bytes")));
        }
        self.at += line.len();
        Ok(Some(line.trim_ascii()))
    }

    /// Returns the next line that is not empty, and its place.
    pub fn line(&mut self) -> Result<Option<(String, String)>> {
        loop {
            let place = self.place();
            let Some(line) = self.raw_line()? else { return Ok(None) };
            let text = copy::text(line).map_err(|_| self.source.error(&place, "is not text"))?;
            // Check the copy: the mapped line may have become blank since it was found.
            if text.split_ascii_whitespace().next().is_some() {
                return Ok(Some((place, text)));
            }
        }
    }

    /// Returns the next keyword with its words, joined by spaces, and its place; `None` at the end
    /// of the file. Line breaks do not matter: a text is a stream of words. After a keyword that is
    /// not known, and after those with words that may be missing, the rest of the line is returned.
    pub fn statement(&mut self) -> Result<Option<(String, String)>> {
        let first = self.rest().trim_ascii_start();
        let keyword = first.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        match arguments(keyword) {
            Some(count) => self.words(1 + count),
            None => self.line(),
        }
    }

    /// Returns the next `count` words, joined by spaces, and the place of the first. In binary
    /// files the bytes of an array follow on the next line, so the rest of the line is skipped.
    fn words(&mut self, count: usize) -> Result<Option<(String, String)>> {
        let rest = self.rest();
        let start = rest.len() - rest.trim_ascii_start().len();
        if start == rest.len() {
            return Ok(None);
        }
        let place = format!("byte {}", self.at + start);
        let mut words: Vec<String> = Vec::new();
        let mut end = start;
        while words.len() < count {
            let blank = rest[end..].iter().take_while(|b| b.is_ascii_whitespace()).count();
            let window = &rest[end + blank..rest.len().min(end + blank + LONGEST)];
            let word = window.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            if word.is_empty() {
                break;
            }
            if word.len() == LONGEST {
                let message = format!("the word is longer than {LONGEST} bytes");
                return Err(self.source.error(place, message));
            }
            words.push(copy::text(word).map_err(|_| self.source.error(&place, "is not text"))?);
            end += blank + word.len();
        }
        self.at += end;
        if self.binary {
            self.raw_line()?;
        }
        Ok(Some((place, words.join(" "))))
    }

    /// Skips the next keyword with its word if it is this one. In binary files it must be.
    pub fn skip_line_of(&mut self, word: &str) -> Result<()> {
        let rest = self.rest().trim_ascii_start();
        match rest
            .get(..word.len())
            .is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes()))
        {
            true => self.words(2).map(drop),
            false if self.binary => Err(self
                .source
                .error(self.place(), format!("there is no line “{word}” where it was expected"))),
            false => Ok(()),
        }
    }

    /// Skips lines up to an empty one.
    pub fn skip_to_blank(&mut self) -> Result<()> {
        while self.raw_line()?.is_some_and(|line| !line.is_empty()) {}
        Ok(())
    }

    /// Returns a count from a keyword's line, checked against the limit of points.
    pub fn count(&self, place: &str, word: &str) -> Result<usize> {
        let count = word
            .parse()
            .map_err(|_| self.source.error(place, format!("“{word}” is not a count")))?;
        self.source.check_points("a count of points or cells", count)
    }

    /// Returns the numbers of a keyword's line.
    pub fn numbers<const N: usize, T: std::str::FromStr>(
        &self,
        place: &str,
        words: &[&str],
    ) -> Result<[T; N]> {
        let numbers: Option<Vec<T>> = words.iter().map(|word| word.parse().ok()).collect();
        let wrong = |_| self.source.error(place, format!("needs {N} numbers"));
        numbers.unwrap_or_default().try_into().map_err(wrong)
    }

    /// Reads the values of an attribute. Returns `None` for bits and strings, which are skipped. In
    /// text files, values of any other type are skipped too.
    pub fn values(&mut self, place: &str, count: usize, kind: &str) -> Result<Option<Part<'a>>> {
        match kind.to_ascii_lowercase().as_str() {
            "bit" if self.binary => self.skip(place, count.div_ceil(8))?,
            "string" | "utf8_string" if self.binary => {
                for _ in 0..count {
                    self.skip_string(place)?;
                }
            }
            "string" | "utf8_string" => {
                self.end_line();
                for _ in 0..count {
                    self.raw_line()?;
                }
            }
            other if self.binary || sample_type(other).is_some() => {
                return self.array(place, count, kind).map(Some);
            }
            _ => {
                let length = self.length_of(place, count)?;
                self.at += length;
            }
        }
        Ok(None)
    }

    /// Goes to the next line if nothing but white space is left of this one.
    fn end_line(&mut self) {
        let line = self.rest().split_inclusive(|&b| b == b'\n').next().unwrap_or_default();
        if line.trim_ascii().is_empty() {
            self.at += line.len();
        }
    }

    /// Skips bytes that must be there.
    fn skip(&mut self, place: &str, size: usize) -> Result<()> {
        let left = self.rest().len();
        if left < size {
            let message = format!("there are {left} bytes where {size} were expected");
            return Err(self.source.error(place, format!("{message}: the file ends")));
        }
        self.at += size;
        Ok(())
    }

    /// Skips a string of a binary file. The upper two bits of its first byte tell how many bytes
    /// its length has: 3 for one, 2 for two, 1 for four, 0 for eight.
    fn skip_string(&mut self, place: &str) -> Result<()> {
        let Some(&first) = self.rest().first() else { return self.skip(place, 1) };
        let bytes = 8 >> (first >> 6);
        let Some(head) = self.rest().get(..bytes) else { return self.skip(place, bytes) };
        let start = usize::from(first & 0x3f);
        let length = head[1..].iter().try_fold(start, |length, &byte| {
            length.checked_mul(256).map(|length| length + usize::from(byte))
        });
        self.skip(place, length.unwrap_or(usize::MAX).saturating_add(bytes))
    }

    /// Reads the array that begins here.
    pub fn array(&mut self, place: &str, count: usize, kind: &str) -> Result<Part<'a>> {
        let wrong = |message: String| -> Error { self.source.error(place, message) };
        let lower = kind.to_ascii_lowercase();
        let kind = sample_type(&lower)
            .ok_or_else(|| wrong(format!("has the type {lower}, which is not supported")))?;
        let rest = self.rest();
        let (bytes, endian, length) = if self.binary {
            let size = count.saturating_mul(kind.bytes());
            let bytes = rest.get(..size).ok_or_else(|| {
                wrong(format!(
                    "there are {} bytes where {size} were expected: the file ends",
                    rest.len()
                ))
            })?;
            (bytes.into(), Endian::Big, size)
        } else {
            let length = self.length_of(place, count)?;
            self.source.room::<u8>("the text", length)?;
            let text = copy::text(&rest[..length])
                .map_err(|_| wrong("is followed by bytes that are not text".into()))?;
            self.source.spend("the size of the numbers in bytes", (count * kind.bytes()) as u64)?;
            (kind.parse(&text, count).map_err(wrong)?.into(), Endian::Little, length)
        };
        self.at += length;
        Ok(Part { kind, endian, bytes })
    }

    /// Returns the corners of `count` cells, and where each cell's corners end. Before version 5.1,
    /// the file has `size` numbers: for each cell the number of its corners, then the corners. From
    /// 5.1 on, it has `count` offsets, beginning with 0, and `size` corners.
    pub fn cells(
        &mut self,
        place: &str,
        count: usize,
        size: usize,
    ) -> Result<(Vec<f64>, Vec<f64>)> {
        let before = self.at;
        if let Ok(Some((place, line))) = self.words(2)
            && let Some(kind) = line.strip_prefix("OFFSETS")
        {
            let mut ends = self.array(&place, count, kind.trim())?.doubles(self.source)?;
            let next = self.words(2)?;
            let next = next
                .as_ref()
                .and_then(|(place, line)| Some((place, line.strip_prefix("CONNECTIVITY")?.trim())));
            let (place, kind) =
                next.ok_or_else(|| self.source.error(place, "has OFFSETS without CONNECTIVITY"))?;
            let corners = self.array(place, size, kind)?.doubles(self.source)?;
            if ends.first().is_some_and(|&first| first != 0.0) {
                return Err(self
                    .source
                    .error(place, format!("the first offset is {}, not 0", ends[0])));
            }
            ends.drain(..ends.len().min(1));
            return Ok((corners, ends));
        }
        self.at = before;
        let numbers = self.array(place, size, "int")?.doubles(self.source)?;
        self.source.room::<[f64; 2]>("the corners of the cells", numbers.len())?;
        let (mut corners, mut ends) = (Vec::new(), Vec::new());
        let mut rest = &numbers[..];
        for cell in 0..count {
            // Casts saturate: a negative number of corners becomes 0.
            let split = rest.split_first().and_then(|(&n, rest)| rest.split_at_checked(n as usize));
            let Some((listed, after)) = split else {
                return Err(self
                    .source
                    .error(place, format!("cell {cell} has more corners than are listed")));
            };
            corners.extend_from_slice(listed);
            ends.push(corners.len() as f64);
            rest = after;
        }
        Ok((corners, ends))
    }

    /// Returns the bytes of the next `count` words of a text file.
    fn length_of(&self, place: &str, count: usize) -> Result<usize> {
        length_of_words(self.rest(), count).map_err(|numbers| {
            let message =
                format!("there are {numbers} numbers where {count} were expected: the file ends");
            self.source.error(place, message)
        })
    }

    /// Reads an array of a field.
    pub fn field(&mut self) -> Result<FieldArray<'a>> {
        if self.rest().trim_ascii_start().starts_with(b"METADATA") {
            self.line()?;
            self.skip_to_blank()?;
        }
        let Some((place, line)) = self.words(4)? else {
            return Err(self.source.error(self.place(), "the file ends inside a FIELD"));
        };
        let words: Vec<&str> = line.split_ascii_whitespace().take(5).collect();
        let [name, components, tuples, kind] = words[..] else {
            return Err(self.source.error(place, "needs a name, components, tuples and a type"));
        };
        self.source.spend("the size of the names in bytes", FIELD + 2 * name.len() as u64)?;
        let (components, tuples) = (self.count(&place, components)?, self.count(&place, tuples)?);
        let part = self.values(&place, components.saturating_mul(tuples), kind)?;
        let kind = kind.to_ascii_lowercase();
        Ok(FieldArray { name: unescaped(name), components, tuples, kind, part })
    }

    /// Reads colours as bytes, which they are in binary files. In text files they are fractions.
    pub fn colors(&mut self, place: &str, count: usize, components: usize) -> Result<Part<'a>> {
        let count = count.saturating_mul(components);
        if self.binary {
            return self.array(place, count, "unsigned_char");
        }
        let fractions = self.array(place, count, "float")?.doubles(self.source)?;
        let bytes: Vec<u8> = fractions.iter().map(|part| (part * 255.0).round() as u8).collect();
        Ok(Part { kind: SampleType::U8, endian: Endian::Little, bytes: bytes.into() })
    }
}

/// Returns the number of words that follow a keyword; `None` for other words, and for keywords that
/// end with their line.
fn arguments(keyword: &[u8]) -> Option<usize> {
    const COUNTS: [(&str, usize); 24] = [
        ("DATASET", 1),
        ("POINT_DATA", 1),
        ("CELL_DATA", 1),
        ("CELL_TYPES", 1),
        ("POINTS", 2),
        ("CELLS", 2),
        ("VERTICES", 2),
        ("LINES", 2),
        ("POLYGONS", 2),
        ("TRIANGLE_STRIPS", 2),
        ("X_COORDINATES", 2),
        ("Y_COORDINATES", 2),
        ("Z_COORDINATES", 2),
        ("FIELD", 2),
        ("LOOKUP_TABLE", 2),
        ("VECTORS", 2),
        ("NORMALS", 2),
        ("TENSORS", 2),
        ("COLOR_SCALARS", 2),
        ("DIMENSIONS", 3),
        ("ORIGIN", 3),
        ("SPACING", 3),
        ("TEXTURE_COORDINATES", 3),
        ("EXTENT", 6),
    ];
    let entry = COUNTS.iter().find(|(name, _)| keyword.eq_ignore_ascii_case(name.as_bytes()));
    entry.map(|(_, count)| *count)
}

/// An array of a field: `part` is `None` if its values are not numbers that can be read.
pub(super) struct FieldArray<'a> {
    pub name: String,
    pub components: usize,
    pub tuples: usize,
    pub kind: String,
    pub part: Option<Part<'a>>,
}

/// Returns the type with a name in lower case. On the machines that write these files, long has 8
/// bytes. Indices are written as int.
fn sample_type(name: &str) -> Option<SampleType> {
    Some(match name {
        "unsigned_char" | "vtktypeuint8" => SampleType::U8,
        "char" | "signed_char" | "vtktypeint8" => SampleType::I8,
        "unsigned_short" | "vtktypeuint16" => SampleType::U16,
        "short" | "vtktypeint16" => SampleType::I16,
        "unsigned_int" | "vtktypeuint32" => SampleType::U32,
        "int" | "vtkidtype" | "vtktypeint32" => SampleType::I32,
        "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => SampleType::U64,
        "long" | "long_long" | "vtktypeint64" => SampleType::I64,
        "float" => SampleType::F32,
        "double" => SampleType::F64,
        _ => return None,
    })
}

/// Returns the bytes up to the end of the `count`-th word. If there are fewer words, the error is
/// their number.
fn length_of_words(bytes: &[u8], count: usize) -> Result<usize, usize> {
    let (mut words, mut at) = (0, 0);
    while words < count {
        at += bytes[at..].iter().position(|b| !b.is_ascii_whitespace()).ok_or(words)?;
        at += bytes[at..].iter().position(u8::is_ascii_whitespace).unwrap_or(bytes.len() - at);
        words += 1;
    }
    Ok(at)
}

/// Decodes a name in which characters are written as % and two hexadecimal digits.
pub(super) fn unescaped(name: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = name.as_bytes();
    while let [first, after @ ..] = rest {
        let digit = |at: usize| after.get(at).and_then(|&digit| char::from(digit).to_digit(16));
        let code = digit(0)
            .zip(digit(1))
            .filter(|_| *first == b'%')
            .map(|(high, low)| (16 * high + low) as u8);
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    copy::lossy(&bytes)
}
