//! The binary data of a glTF file: GLB chunks, data URIs and files beside it.

use crate::{Result, input::Source};
use ::gltf::json;
use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use std::borrow::Cow;

/// Base64 with or without its padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Splits a file into its JSON and, for GLB, its binary chunk.
pub(super) fn split<'a>(source: &'a Source) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let bytes = source.bytes();
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word = |at: usize| -> Option<usize> {
        let bytes = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize)
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(
            source.error(format!("byte {}", bytes.len()), "the file ends within the GLB header")
        );
    };
    if version != 2 {
        return Err(
            source.error("byte 4", format!("the GLB version is {version}; only version 2 is read"))
        );
    }
    if length > bytes.len() || length < 12 {
        let message = format!(
            "the GLB header claims {length} bytes, but the file has \
                               {}",
            bytes.len()
        );
        return Err(source.error("byte 8", message).hint("the file is cut"));
    }
    let mut at = 12;
    let (mut text, mut binary) = (None, None);
    while at < length {
        let place = format!("byte {at}");
        let size =
            word(at).filter(|size| size.checked_add(at + 8).is_some_and(|end| end <= length));
        let Some(size) = size else {
            return Err(source.error(place, "a GLB chunk reaches beyond the end"));
        };
        let data = &bytes[at + 8..at + 8 + size];
        match &bytes[at + 4..at + 8] {
            b"JSON" => text = text.or(Some(data)),
            b"BIN\0" => binary = binary.or(Some(data)),
            _ => {}
        }
        at += 8 + size;
    }
    Ok((text.ok_or_else(|| source.error("byte 12", "the GLB has no JSON chunk"))?, binary))
}

/// The buffers of a file, each checked to hold at least the bytes it claims.
pub(super) struct Buffers<'a> {
    pub source: &'a Source<'a>,
    pub root: &'a json::Root,
    bytes: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    pub fn open(
        source: &'a Source<'a>,
        root: &'a json::Root,
        binary: Option<&'a [u8]>,
    ) -> Result<Self> {
        let mut bytes: Vec<Cow<[u8]>> = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            let place = format!("buffer {index}");
            let data = match (&buffer.uri, binary) {
                (Some(uri), _) => Cow::Owned(resolve(source, &place, uri)?),
                (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
                // A buffer without bytes may stand for a compressed one; it is an error where it is
                // used.
                (None, _) => Cow::Borrowed(&[][..]),
            };
            let claimed = buffer.byte_length.0;
            if (data.len() as u64) < claimed && !(data.is_empty() && buffer.uri.is_none()) {
                return Err(
                    source.error(place, format!("claims {claimed} bytes but holds {}", data.len()))
                );
            }
            bytes.push(data);
        }
        Ok(Self { source, root, bytes })
    }

    /// Returns the bytes of a buffer view, and its stride if it has one.
    pub fn view(&self, index: usize, place: &str) -> Result<(&[u8], Option<usize>)> {
        let Some(view) = self.root.buffer_views.get(index) else {
            let count = self.root.buffer_views.len();
            return Err(self
                .source
                .error(place, format!("refers to buffer view {index}, but there are {count}")));
        };
        let place = format!("buffer view {index}");
        let Some(bytes) = self.bytes.get(view.buffer.value()) else {
            let message =
                format!("refers to buffer {}, but there are {}", view.buffer, self.bytes.len());
            return Err(self.source.error(place, message));
        };
        let start = view.byte_offset.map_or(0, |offset| offset.0);
        let end = start.checked_add(view.byte_length.0).filter(|&end| end <= bytes.len() as u64);
        let Some(end) = end else {
            let message = format!(
                "{} bytes from byte {start} reach beyond the buffer's {}",
                view.byte_length.0,
                bytes.len()
            );
            return Err(self
                .source
                .error(place, message)
                .hint("compressed (meshopt, Draco) buffers are not read"));
        };
        Ok((&bytes[start as usize..end as usize], view.byte_stride.as_ref().map(|stride| stride.0)))
    }

    /// Returns the number of bytes of the file and all its buffers, including the JSON.
    pub fn total(&self) -> u64 {
        self.source.bytes().len() as u64
            + self.bytes.iter().map(|bytes| bytes.len() as u64).sum::<u64>()
    }
}

/// Returns the bytes that a URI refers to: data inside the URI, or a file beside this one.
pub(super) fn resolve(source: &Source, place: &str, uri: &str) -> Result<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        source.room::<u8>("a data URI", data.len())?;
        let Some((kind, data)) = data.split_once(',') else {
            return Err(source.error(place, "has a data URI without a comma"));
        };
        if kind.ends_with(";base64") {
            return BASE64
                .decode(data.trim())
                .map_err(|e| source.error(place, format!("is not valid base64: {e}")));
        }
        return percent_decode(data)
            .ok_or_else(|| source.error(place, "has a malformed percent code in its data URI"));
    }
    let path = percent_decode(uri)
        .and_then(|bytes| String::from_utf8(bytes).ok())
        .filter(|path| !path.contains('\0'));
    let Some(path) = path else {
        let uri: String = uri.chars().take(80).collect();
        return Err(source.error(
            place,
            format!(
                "refers to “{uri}”, whose percent codes do not decode to \
                                         UTF-8 text"
            ),
        ));
    };
    let path = source.neighbour(place, &path)?;
    let file = source.open_beside(&path)?;
    source.room::<u8>("a buffer", file.bytes().len())?;
    file.unless_changed(Ok(file.bytes().to_vec()))
}

/// Decodes percent codes; `None` if a % is not followed by two hexadecimal digits.
fn percent_decode(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(byte) = bytes.next() {
        if byte != b'%' {
            out.push(byte);
            continue;
        }
        let mut digit = || char::from(bytes.next()?).to_digit(16);
        out.push((digit()? * 16 + digit()?) as u8);
    }
    Some(out)
}
