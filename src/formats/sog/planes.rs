//! The planes: lossless WebP pictures beside `meta.json`, or in an archive with it.

use super::{
    meta::{INDEX, META},
    not_unpacked,
};
use crate::{
    Result,
    error::LimitKind,
    input::{
        Source, copy,
        isolate::{FEW_PIXELS, isolated, isolated_in_time},
    },
};
use image_webp::{DecodingError, WebPDecoder};
use std::io::Cursor;
use zip::{ZipArchive, result::ZipError};

/// Most bytes of a `meta.json`. Those with codebooks have about 16 KiB.
const MOST_META: usize = 1 << 20;

/// Bytes per texel during decoding: the decoder's own copy, its picture, and the plane.
const TEXEL: u64 = 4 + 4 + 4;

/// Where the planes are.
pub enum Files<'a> {
    /// Beside the file that is read.
    Folder,
    Archive(ZipArchive<Cursor<&'a [u8]>>),
}

/// How much of a plane is needed.
#[derive(Debug, Clone, Copy)]
pub enum Need {
    /// The first texels. There must be as many.
    Texels(usize),
    /// The first rows, as far as there are any.
    Rows(usize),
}

impl Need {
    /// Returns the most texels that a plane of this width may have. Writers leave the last rows
    /// empty, so planes have more than is needed, but not many times more: a few bytes may stand
    /// for 268 million of them.
    fn most(self, width: u32) -> u64 {
        const FEW: u64 = 1 << 20;
        let needed = match self {
            Self::Texels(count) => count as u64,
            Self::Rows(rows) => (rows as u64).saturating_mul(width.into()),
        };
        needed.saturating_mul(16).max(FEW)
    }
}

/// A decoded plane.
#[derive(Debug)]
pub struct Plane {
    /// The number of texels in a row.
    pub width: usize,
    pub texels: Vec<[u8; 4]>,
}

/// Returns the text of `meta.json`, and where the planes are.
pub fn open<'a>(source: &'a Source) -> Result<(String, Files<'a>)> {
    if !source.bytes().starts_with(b"PK") {
        if !source.bytes().trim_ascii_start().starts_with(b"{") {
            let message = format!("is neither a ZIP archive with a {META} nor a {META}");
            return Err(source.error("file", message));
        }
        return Ok((source.small_text("a meta.json", MOST_META)?, Files::Folder));
    }
    let mut archive = isolated(source, "archive", || {
        ZipArchive::new(Cursor::new(source.bytes())).map_err(|error| zip_error(source, &error))
    })?;
    if archive.index_for_name(META).is_none() {
        if archive.index_for_name(INDEX).is_some() {
            return Err(not_unpacked(source));
        }
        let message = format!("contains no {META}, which each SOG scene has");
        return Err(source.error("archive", message));
    }
    let bytes = entry(source, &mut archive, META, META, MOST_META)?;
    let text = copy::text(&bytes)
        .map_err(|at| source.error(META, format!("byte {at} is not UTF-8 text")))?;
    Ok((text, Files::Archive(archive)))
}

fn zip_error(source: &Source, error: &ZipError) -> crate::Error {
    source.error("archive", format!("is not a ZIP archive that can be read: {error}"))
}

/// Unpacks an entry of an archive.
fn entry(
    source: &Source,
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    place: &str,
    name: &str,
    most: usize,
) -> Result<Vec<u8>> {
    isolated(source, place, || {
        let Some(index) = archive.index_for_name(name) else {
            let message = format!("refers to “{}”, which is not in the archive", excerpt(name));
            return Err(source.error(place, message));
        };
        let file = archive.by_index(index).map_err(|error| zip_error(source, &error))?;
        let size = source.check_bytes("the size of a file in bytes", file.size())?;
        if size > most {
            let message = format!("has {size} bytes, but may have at most {most}");
            return Err(source.error(place, message));
        }
        source.unpack(place, file, size)
    })
}

/// Returns the first characters of a name, for an error.
fn excerpt(name: &str) -> String {
    name.chars().take(80).collect()
}

impl Files<'_> {
    /// Decodes a plane as far as it is needed. `place` names what refers to it.
    pub fn plane(&mut self, source: &Source, place: &str, name: &str, need: Need) -> Result<Plane> {
        source.check_time()?;
        match self {
            Self::Folder => {
                let path = source.neighbour(place, name)?;
                let file = source.open_beside(&path)?;
                file.unless_changed(decode(&file, place, file.bytes(), need))
            }
            Self::Archive(archive) => {
                let bytes = entry(source, archive, place, name, usize::MAX)?;
                decode(source, place, &bytes, need)
            }
        }
    }
}

impl Plane {
    /// Returns the texel of a Gaussian.
    pub fn texel(&self, index: usize) -> [u8; 4] {
        self.texels.get(index).copied().unwrap_or_default()
    }
}

/// Decodes a lossless WebP picture as far as it is needed.
fn decode(source: &Source, place: &str, bytes: &[u8], need: Need) -> Result<Plane> {
    let again = "write the scene again with a tool that writes lossless WebP planes";
    if !bytes.starts_with(b"RIFF") || bytes.get(8..12) != Some(b"WEBP") {
        return Err(source.error(place, "the plane is not a WebP picture").hint(again));
    }
    let (width, height, is_plain) = isolated(source, place, || {
        let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(|error| {
            source.error(place, format!("the plane cannot be decoded: {error}"))
        })?;
        let (width, height) = decoder.dimensions();
        Ok((width, height, !(decoder.is_lossy() || decoder.is_animated())))
    })?;
    let count = u64::from(width) * u64::from(height);
    let what = format!("{place}: the number of texels");
    source.limits.check(LimitKind::Texels, source.path, what, count)?;
    if !is_plain {
        let message = "the plane is lossy or animated, so its bytes are not those that were meant";
        return Err(source.error(place, message).hint(again));
    }
    if let Need::Texels(least) = need
        && count < least as u64
    {
        let message =
            format!("the plane has {width} × {height} pixels, fewer than the {least} needed");
        return Err(source.error(place, message));
    }
    let most = need.most(width);
    if count > most {
        let message = format!(
            "the plane has {width} × {height} pixels, many times more than the scene needs; at \
             most {most} are read"
        );
        return Err(source.error(place, message).hint(again));
    }
    Ok(Plane { width: width as usize, texels: whole(source, place, bytes, count)? })
}

/// Decodes a picture of this number of texels.
fn whole(source: &Source, place: &str, bytes: &[u8], count: u64) -> Result<Vec<[u8; 4]>> {
    source.spend("the size of a plane in bytes", count * TEXEL)?;
    let copy = bytes.to_vec();
    isolated_in_time(source, place, count > FEW_PIXELS, move || {
        let broken = |error: DecodingError| format!("the plane cannot be decoded: {error}");
        let mut decoder = WebPDecoder::new(Cursor::new(&copy[..])).map_err(broken)?;
        let size = decoder.output_buffer_size().ok_or("the plane is too large")?;
        let mut channels = vec![0u8; size];
        decoder.read_image(&mut channels).map_err(broken)?;
        Ok(if decoder.has_alpha() {
            channels.as_chunks::<4>().0.to_vec()
        } else {
            channels.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, u8::MAX]).collect()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use image_webp::{ColorType, WebPEncoder};
    use std::path::Path;

    #[test]
    fn planes_are_about_as_large_as_is_needed() {
        let (width, height) = (64, 512);
        let texels: Vec<[u8; 4]> =
            (0..width * height).map(|at: u32| [at as u8, (at / width) as u8, 0, 9]).collect();
        let mut file = Vec::new();
        let encoder = WebPEncoder::new(&mut file);
        encoder.encode(texels.as_flattened(), width, height, ColorType::Rgba8).unwrap();
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a.sog"), &[], &limits).unwrap();
        for need in [Need::Texels(10), Need::Texels(64 * 512), Need::Rows(9999)] {
            assert_eq!(decode(&source, "here", &file, need).unwrap().texels, texels);
        }
        let few = decode(&source, "here", &file, Need::Texels(64 * 512 + 1)).unwrap_err();
        assert!(few.to_string().contains("64 × 512 pixels, fewer than"), "{few}");
        assert_eq!(Need::Texels(10).most(64), 1 << 20);
        assert_eq!(Need::Texels(1 << 20).most(64), 16 << 20);
        assert_eq!(Need::Rows(1024).most(2880), 16 * 1024 * 2880);
    }
}
