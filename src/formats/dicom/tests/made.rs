//! A writer of small files of DICOM.

use crate::formats::dicom::tags;
use flate2::{Compression, write::DeflateEncoder};
use std::{collections::BTreeMap, io::Write};

/// The elements of a file in the making.
#[derive(Clone)]
pub struct Made {
    /// The end of the transfer syntax's identifier.
    syntax: String,
    elements: BTreeMap<u32, (String, Vec<u8>)>,
}

impl Made {
    pub fn new(syntax: &str) -> Self {
        Self { syntax: syntax.into(), elements: BTreeMap::new() }
    }

    /// The elements of a slice, without pixels and place.
    pub fn slice(syntax: &str, columns: u16, rows: u16) -> Self {
        let mut made = Self::new(syntax);
        made.text(0x0008_0005, "ISO_IR 100").text(tags::MODALITY, "CT").text(tags::SERIES, "1.2.3");
        made.short(tags::COLUMNS, columns).short(tags::ROWS, rows).bits(16, 16, 0);
        made.text(tags::PHOTOMETRIC, "MONOCHROME2").short(tags::SAMPLES_PER_PIXEL, 1);
        made
    }

    fn is_big(&self) -> bool {
        self.syntax == ".2"
    }

    pub fn bytes(&mut self, tag: u32, kind: &str, bytes: &[u8]) -> &mut Self {
        self.elements.insert(tag, (kind.into(), bytes.into()));
        self
    }

    pub fn without(&mut self, tag: u32) -> &mut Self {
        self.elements.remove(&tag);
        self
    }

    pub fn text(&mut self, tag: u32, text: &str) -> &mut Self {
        let kind = match tag {
            tags::SERIES | tags::INSTANCE | tags::CLASS => "UI",
            tags::SERIES_DESCRIPTION => "LO",
            0x0008_0005 | tags::MODALITY | tags::PHOTOMETRIC | tags::IMAGE_TYPE => "CS",
            tags::FRAMES | tags::SERIES_NUMBER | tags::INSTANCE_NUMBER => "IS",
            _ => "DS",
        };
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(bytes.len().next_multiple_of(2), if kind == "UI" { 0 } else { b' ' });
        self.bytes(tag, kind, &bytes)
    }

    pub fn shorts(&mut self, tag: u32, kind: &str, numbers: &[u16]) -> &mut Self {
        let big = self.is_big();
        let of = |&n: &u16| if big { n.to_be_bytes() } else { n.to_le_bytes() };
        let bytes: Vec<u8> = numbers.iter().flat_map(of).collect();
        self.bytes(tag, kind, &bytes)
    }

    pub fn short(&mut self, tag: u32, number: u16) -> &mut Self {
        self.shorts(tag, "US", &[number])
    }

    pub fn long(&mut self, tag: u32, number: u32) -> &mut Self {
        let bytes = if self.is_big() { number.to_be_bytes() } else { number.to_le_bytes() };
        self.bytes(tag, "UL", &bytes)
    }

    pub fn bits(&mut self, allocated: u16, stored: u16, signed: u16) -> &mut Self {
        self.short(tags::BITS_ALLOCATED, allocated).short(tags::BITS_STORED, stored);
        self.short(tags::HIGH_BIT, stored - 1).short(tags::REPRESENTATION, signed)
    }

    /// Adds a sequence whose items are of given or of undefined length, by turns.
    pub fn sequence(&mut self, tag: u32, items: &[Self]) -> &mut Self {
        let mut bytes = Vec::new();
        for (item, is_open) in items.iter().zip([true, false].into_iter().cycle()) {
            let content = item.set();
            bytes.extend(self.tag(0xfffe_e000));
            if is_open {
                bytes.extend([255; 4]);
                bytes.extend(content);
                bytes.extend(self.tag(0xfffe_e00d));
                bytes.extend([0; 4]);
            } else {
                bytes.extend(self.number(content.len() as u32));
                bytes.extend(content);
            }
        }
        bytes.extend(self.tag(0xfffe_e0dd));
        bytes.extend([0; 4]);
        self.bytes(tag, "SQ…", &bytes)
    }

    /// Sets packed pixels: the table of offsets, then the fragments.
    pub fn fragments(&mut self, fragments: &[&[u8]]) -> &mut Self {
        let mut bytes = Vec::new();
        for fragment in fragments {
            bytes.extend(self.tag(0xfffe_e000));
            bytes.extend(self.number(fragment.len() as u32));
            bytes.extend(*fragment);
        }
        bytes.extend(self.tag(0xfffe_e0dd));
        bytes.extend([0; 4]);
        self.bytes(tags::PIXEL_DATA, "OB…", &bytes)
    }

    fn number(&self, number: u32) -> [u8; 4] {
        if self.is_big() { number.to_be_bytes() } else { number.to_le_bytes() }
    }

    /// Tags are two numbers of 16 bits.
    fn tag(&self, tag: u32) -> [u8; 4] {
        let [group, number] = [(tag >> 16) as u16, tag as u16];
        let of = |n: u16| if self.is_big() { n.to_be_bytes() } else { n.to_le_bytes() };
        let ([a, b], [c, d]) = (of(group), of(number));
        [a, b, c, d]
    }

    /// The data set, not deflated. Kinds with an ellipsis have undefined length.
    fn set(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for (&tag, (kind, bytes)) in &self.elements {
            let is_open = kind.ends_with('…');
            let kind = &kind[..2];
            let length = if is_open { u32::MAX } else { bytes.len() as u32 };
            out.extend(self.tag(tag));
            match (self.syntax.as_str(), kind) {
                ("", _) => out.extend(self.number(length)),
                (_, "OB" | "OW" | "OF" | "OD" | "SQ" | "UN") => {
                    out.extend(kind.bytes());
                    out.extend([0; 2]);
                    out.extend(self.number(length));
                }
                _ => {
                    out.extend(kind.bytes());
                    let half = self.number(length);
                    out.extend(if self.is_big() { &half[2..] } else { &half[..2] });
                }
            }
            out.extend(bytes);
        }
        out
    }

    /// The file without preamble and header.
    pub fn bare(&self) -> Vec<u8> {
        self.set()
    }

    /// The whole file.
    pub fn file(&self) -> Vec<u8> {
        let mut header = Self::new(".1");
        let mut identifier = format!("1.2.840.10008.1.2{}", self.syntax).into_bytes();
        identifier.resize(identifier.len().next_multiple_of(2), 0);
        if let Some((_, class)) = self.elements.get(&tags::MEDIA_CLASS) {
            header.bytes(tags::MEDIA_CLASS, "UI", class);
        }
        header.bytes(tags::TRANSFER_SYNTAX, "UI", &identifier);
        let mut data = self.clone();
        data.without(tags::MEDIA_CLASS);
        let mut set = data.set();
        if self.syntax == ".1.99" {
            let mut packer = DeflateEncoder::new(Vec::new(), Compression::default());
            packer.write_all(&set).unwrap();
            set = packer.finish().unwrap();
        }
        [&[0; 128], &b"DICM"[..], &header.set(), &set].concat()
    }
}
