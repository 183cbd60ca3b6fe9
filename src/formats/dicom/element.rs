//! Data sets of DICOM: elements, sequences of items, and fragments (PS3.5, sections 7 and 10).
//!
//! Elements refer to the bytes that are there, so a false length allocates nothing. Sequences are
//! read when they are asked for. Their ends are found without recursion.

use super::tags;
use crate::{
    Result,
    formats::Endian,
    input::{Source, growing::Growing},
};

/// The length of values whose end is marked by an element of its own.
const UNDEFINED: u32 = u32::MAX;

const ITEM: u32 = 0xfffe_e000;
const END_OF_ITEM: u32 = 0xfffe_e00d;
const END_OF_SEQUENCE: u32 = 0xfffe_e0dd;

/// The type of values whose header does not give one.
const NO_TYPE: [u8; 2] = [0; 2];

/// How the elements of a data set are encoded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coding {
    /// Whether elements give the types of their values.
    pub is_explicit: bool,
    pub endian: Endian,
}

impl Coding {
    pub const PLAIN: Self = Self { is_explicit: true, endian: Endian::Little };
    pub const IMPLICIT: Self = Self { is_explicit: false, endian: Endian::Little };
}

/// Elements in the order of their file.
pub struct Set<'a> {
    source: &'a Source<'a>,
    elements: Vec<Element<'a>>,
    coding: Coding,
    /// How many sequences this set lies in.
    depth: usize,
}

pub struct Element<'a> {
    pub tag: u32,
    pub kind: [u8; 2],
    pub value: Value<'a>,
}

pub enum Value<'a> {
    Bytes(&'a [u8]),
    /// The file ends before the value does: the bytes that are there, and the length claimed.
    Cut(&'a [u8], u32),
    /// The items of a sequence.
    Items(&'a [u8], Coding),
    /// Fragments of encoded pixels, and the table of offsets before them.
    Fragments(Vec<&'a [u8]>),
}

/// What stands before a value.
struct Head {
    tag: u32,
    kind: [u8; 2],
    length: u32,
    /// The offset of the value.
    at: usize,
}

/// Bytes of elements.
#[derive(Clone, Copy)]
struct Bytes<'a> {
    source: &'a Source<'a>,
    bytes: &'a [u8],
    coding: Coding,
}

impl<'a> Bytes<'a> {
    fn cut(&self, at: usize) -> crate::Error {
        let message = format!("an element is cut off at the end, byte {}", self.bytes.len());
        self.source.error(format!("data set, byte {at}"), message)
    }

    fn get<const N: usize>(&self, at: usize) -> Result<[u8; N]> {
        let bytes = self.bytes.get(at..).and_then(|rest| rest.first_chunk());
        bytes.copied().ok_or_else(|| self.cut(at))
    }

    fn short(&self, at: usize) -> Result<u16> {
        let bytes = self.get(at)?;
        Ok(match self.coding.endian {
            Endian::Little => u16::from_le_bytes(bytes),
            Endian::Big => u16::from_be_bytes(bytes),
        })
    }

    fn long(&self, at: usize) -> Result<u32> {
        let bytes = self.get(at)?;
        Ok(match self.coding.endian {
            Endian::Little => u32::from_le_bytes(bytes),
            Endian::Big => u32::from_be_bytes(bytes),
        })
    }

    /// Reads what stands before a value.
    fn head(&self, at: usize) -> Result<Head> {
        let tag = u32::from(self.short(at)?) << 16 | u32::from(self.short(at + 2)?);
        // Items and their ends never have a type.
        if !self.coding.is_explicit || tag >> 16 == 0xfffe {
            return Ok(Head { tag, kind: NO_TYPE, length: self.long(at + 4)?, at: at + 8 });
        }
        let kind: [u8; 2] = self.get(at + 4)?;
        if !kind.iter().all(u8::is_ascii_uppercase) {
            let [group, number] = [tag >> 16, tag & 0xffff];
            let message = format!("the element ({group:04x},{number:04x}) has no type of values");
            return Err(self.source.error(format!("data set, byte {at}"), message).hint(
                "the file is damaged, or encoded in another way than its transfer syntax says",
            ));
        }
        let is_long = [b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR"]
            .contains(&&kind)
            || kind == *b"UT"
            || kind == *b"UV";
        match is_long {
            true => Ok(Head { tag, kind, length: self.long(at + 8)?, at: at + 12 }),
            false => Ok(Head { tag, kind, length: self.short(at + 6)?.into(), at: at + 8 }),
        }
    }

    /// Returns the bytes of a value, or those that are there.
    fn value(&self, head: &Head) -> Result<&'a [u8], &'a [u8]> {
        let rest = self.bytes.get(head.at..).unwrap_or_default();
        rest.get(..head.length as usize).ok_or(rest)
    }

    /// Returns where a sequence's or item's content ends that begins at `at` and whose end is
    /// marked, and where its end mark ends.
    fn end(&self, at: usize, is_item: bool, depth: usize) -> Result<[usize; 2]> {
        let mut open = vec![(is_item, self.coding)];
        let mut at = at;
        while let Some(&(is_item, coding)) = open.last() {
            self.source.check_depth("data set", depth + open.len() / 2)?;
            let head = Self { coding, ..*self }.head(at)?;
            let mark = if is_item { END_OF_ITEM } else { END_OF_SEQUENCE };
            if head.tag == mark {
                open.pop();
                if open.is_empty() {
                    return Ok([at, head.at]);
                }
                at = head.at;
                continue;
            }
            if !is_item && head.tag != ITEM {
                let message = format!("an item was expected, but ({:08x}) was found", head.tag);
                return Err(self.source.error(format!("sequence, byte {at}"), message));
            }
            at = head.at;
            match (head.length, head.kind) {
                // Sequences of unknown type have elements without types.
                (UNDEFINED, [b'U', b'N']) => open.push((!is_item, Coding::IMPLICIT)),
                (UNDEFINED, _) => open.push((!is_item, coding)),
                _ => at = at.checked_add(head.length as usize).ok_or_else(|| self.cut(at))?,
            }
        }
        Err(self.cut(at))
    }

    /// Reads the element at `at`. Also returns where the next one begins.
    fn element(&self, at: usize, depth: usize) -> Result<(Element<'a>, usize)> {
        let head = self.head(at)?;
        let is_sequence = head.kind == *b"SQ"
            || head.length == UNDEFINED && matches!(head.kind, NO_TYPE | [b'U', b'N']);
        let is_pixels = head.tag == tags::PIXEL_DATA;
        let inner = if head.kind == *b"UN" { Coding::IMPLICIT } else { self.coding };
        let Head { tag, kind, .. } = head;
        if head.length == UNDEFINED {
            let inside = Self { coding: inner, ..*self };
            let [end, next] = inside.end(head.at, false, depth)?;
            let content = &self.bytes[head.at..end];
            let value = match is_pixels {
                true => Value::Fragments(inside.fragments(head.at, end)?),
                false => Value::Items(content, inner),
            };
            return Ok((Element { tag, kind, value }, next));
        }
        let value = match self.value(&head) {
            Ok(bytes) if is_sequence => Value::Items(bytes, inner),
            Ok(bytes) => Value::Bytes(bytes),
            // Which series it belongs to is still known.
            Err(there) if is_pixels => Value::Cut(there, head.length),
            Err(there) => {
                let [group, number] = [tag >> 16, tag & 0xffff];
                let message = format!(
                    "the element ({group:04x},{number:04x}) has {} bytes, but the file ends after \
                     {}",
                    head.length,
                    there.len()
                );
                return Err(self.source.error(format!("data set, byte {at}"), message));
            }
        };
        let next = head.at.saturating_add(head.length as usize).min(self.bytes.len());
        Ok((Element { tag, kind, value }, next))
    }

    /// Returns the fragments between two offsets.
    fn fragments(&self, from: usize, to: usize) -> Result<Vec<&'a [u8]>> {
        let mut fragments = Growing::new(self.source, "the size of the fragments in bytes");
        let mut at = from;
        while at < to {
            let head = self.head(at)?;
            let bytes = self.value(&head).map_err(|_| self.cut(at))?;
            fragments.push(bytes)?;
            at = head.at + bytes.len();
        }
        Ok(fragments.into_inner())
    }
}

impl<'a> Set<'a> {
    /// Reads the elements of a data set, up to its end or to the first that `is_last`.
    pub fn read(
        source: &'a Source<'a>,
        bytes: &'a [u8],
        coding: Coding,
        is_last: impl Fn(u32) -> bool,
    ) -> Result<Self> {
        Self::nested(source, bytes, coding, 0, is_last)
    }

    fn nested(
        source: &'a Source<'a>,
        bytes: &'a [u8],
        coding: Coding,
        depth: usize,
        is_last: impl Fn(u32) -> bool,
    ) -> Result<Self> {
        source.check_depth("data set", depth)?;
        let bytes = Bytes { source, bytes, coding };
        let mut elements = Growing::new(source, "the size of the list of elements in bytes");
        let mut at = 0;
        // Some files are filled up with zeros.
        while bytes.bytes[at..].iter().take(8).any(|&byte| byte != 0) {
            let (element, next) = bytes.element(at, depth)?;
            let is_end = is_last(element.tag);
            elements.push(element)?;
            if is_end {
                break;
            }
            at = next;
        }
        Ok(Self { source, elements: elements.into_inner(), coding, depth })
    }

    pub fn get(&self, tag: u32) -> Option<&Element<'a>> {
        self.elements.iter().find(|element| element.tag == tag)
    }

    /// Returns the bytes of a value; `None` if there is none, or an empty one.
    pub fn bytes(&self, tag: u32) -> Option<&'a [u8]> {
        match self.get(tag)?.value {
            Value::Bytes(bytes) if !bytes.is_empty() => Some(bytes),
            _ => None,
        }
    }

    /// Returns the items of a sequence; none if there is no such sequence.
    pub fn items(&self, tag: u32) -> Result<Vec<Self>> {
        // Without types, a sequence of given length is known by its tag alone.
        let (content, coding) = match self.get(tag).map(|element| &element.value) {
            Some(&Value::Items(content, coding)) => (content, coding),
            Some(&Value::Bytes(content)) if !self.coding.is_explicit => (content, self.coding),
            _ => return Ok(Vec::new()),
        };
        let bytes = Bytes { source: self.source, bytes: content, coding };
        let mut items = Growing::new(self.source, "the size of a sequence in bytes");
        let mut at = 0;
        while at < content.len() {
            let head = bytes.head(at)?;
            if head.tag == END_OF_SEQUENCE {
                break;
            }
            if head.tag != ITEM {
                let message = format!("an item was expected, but ({:08x}) was found", head.tag);
                return Err(self.source.error(format!("sequence, byte {at}"), message));
            }
            let (inside, next) = if head.length == UNDEFINED {
                let [end, next] = bytes.end(head.at, true, self.depth)?;
                (&content[head.at..end], next)
            } else {
                let inside = bytes.value(&head).map_err(|_| bytes.cut(at))?;
                (inside, head.at + inside.len())
            };
            items.push(Self::nested(self.source, inside, coding, self.depth + 1, |_| false)?)?;
            at = next;
        }
        Ok(items.into_inner())
    }

    /// Returns the first item of a sequence.
    pub fn item(&self, tag: u32) -> Result<Option<Self>> {
        Ok(self.items(tag)?.into_iter().next())
    }

    /// Returns a text without the spaces and zeros around it. Bytes that are not UTF-8 are Latin-1.
    pub fn text(&self, tag: u32) -> Option<String> {
        let bytes = self.bytes(tag)?;
        let text = crate::input::copy::text(bytes)
            .unwrap_or_else(|_| bytes.iter().map(|&byte| char::from(byte)).collect());
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
        (!text.is_empty()).then(|| text.to_owned())
    }

    /// Returns the parts of a text, which backslashes separate.
    pub fn words(&self, tag: u32) -> Vec<String> {
        let text = self.text(tag).unwrap_or_default();
        text.split('\\').map(|word| word.trim().to_owned()).collect()
    }

    /// Returns the numbers of a text, or binary numbers of 64 or 32 bits; none if one of them is
    /// not a finite number.
    pub fn decimals(&self, tag: u32) -> Vec<f64> {
        let kind = self.get(tag).map_or(NO_TYPE, |element| element.kind);
        let bytes = self.bytes(tag).unwrap_or_default();
        let numbers: Option<Vec<f64>> = match &kind {
            b"FD" | b"OD" => Some(self.numbers(bytes, f64::from_le_bytes)),
            b"FL" | b"OF" => {
                Some(self.numbers(bytes, f32::from_le_bytes).into_iter().map(f64::from).collect())
            }
            _ => self.words(tag).iter().map(|word| word.parse().ok()).collect(),
        };
        numbers.filter(|all| all.iter().all(|number| number.is_finite())).unwrap_or_default()
    }

    /// As [`decimals`](Self::decimals), for an element whose numbers are binary in sets without
    /// types too.
    pub fn doubles(&self, tag: u32) -> Vec<f64> {
        let has_type = self.get(tag).is_some_and(|element| element.kind != NO_TYPE);
        if has_type {
            return self.decimals(tag);
        }
        let numbers = self.numbers(self.bytes(tag).unwrap_or_default(), f64::from_le_bytes);
        if numbers.iter().all(|number: &f64| number.is_finite()) { numbers } else { Vec::new() }
    }

    pub fn decimal(&self, tag: u32) -> Option<f64> {
        self.decimals(tag).first().copied()
    }

    /// Returns exactly `N` numbers of a text.
    pub fn vector<const N: usize>(&self, tag: u32) -> Option<[f64; N]> {
        self.decimals(tag).first_chunk().copied()
    }

    /// Returns binary whole numbers of 16 bits.
    pub fn shorts(&self, tag: u32) -> Vec<u16> {
        self.numbers(self.bytes(tag).unwrap_or_default(), u16::from_le_bytes)
    }

    pub fn short(&self, tag: u32) -> Option<u16> {
        self.shorts(tag).first().copied()
    }

    /// Returns binary whole numbers of 32 bits.
    pub fn longs(&self, tag: u32) -> Vec<u32> {
        self.numbers(self.bytes(tag).unwrap_or_default(), u32::from_le_bytes)
    }

    /// Returns the binary numbers in bytes, in the order of the set's bytes.
    fn numbers<const N: usize, T>(&self, bytes: &[u8], of: impl Fn([u8; N]) -> T) -> Vec<T> {
        let one = |number: &[u8; N]| {
            let mut number = *number;
            if self.coding.endian == Endian::Big {
                number.reverse();
            }
            of(number)
        };
        bytes.as_chunks().0.iter().map(one).collect()
    }
}
