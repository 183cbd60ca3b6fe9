//! The planes: lossless WebP pictures beside `meta.json`, or in an archive with it.

use super::{meta::META, streamed};
use crate::{
    Result,
    error::LimitKind,
    input::{Source, copy, isolate::isolated},
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

/// A decoded plane.
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
        ZipArchive::new(Cursor::new(source.bytes())).map_err(|error| told(source, &error))
    })?;
    if archive.index_for_name(META).is_none() {
        if archive.index_for_name("lod-meta.json").is_some() {
            return Err(streamed(source));
        }
        let message = format!("contains no {META}, which each SOG scene has");
        return Err(source.error("archive", message));
    }
    let bytes = entry(source, &mut archive, META, META, MOST_META)?;
    let text = copy::text(&bytes)
        .map_err(|at| source.error(META, format!("byte {at} is not UTF-8 text")))?;
    Ok((text, Files::Archive(archive)))
}

fn told(source: &Source, error: &ZipError) -> crate::Error {
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
            let message = format!("refers to “{}”, which is not in the archive", shown(name));
            return Err(source.error(place, message));
        };
        let file = archive.by_index(index).map_err(|error| told(source, &error))?;
        let size = source.check_bytes("the size of a file in bytes", file.size())?;
        if size > most {
            let message = format!("has {size} bytes, but may have at most {most}");
            return Err(source.error(place, message));
        }
        source.unpack(place, file, size)
    })
}

/// Returns the first characters of a name, for an error.
fn shown(name: &str) -> String {
    name.chars().take(80).collect()
}

impl Files<'_> {
    /// Decodes a plane, which must have at least this number of texels. `place` names what refers
    /// to it.
    pub fn plane(
        &mut self,
        source: &Source,
        place: &str,
        name: &str,
        least: usize,
    ) -> Result<Plane> {
        source.check_time()?;
        match self {
            Self::Folder => {
                let path = source.neighbour(place, name)?;
                let file = source.open_beside(&path)?;
                file.unless_changed(decode(&file, place, file.bytes(), least))
            }
            Self::Archive(archive) => {
                let bytes = entry(source, archive, place, name, usize::MAX)?;
                decode(source, place, &bytes, least)
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

/// Decodes a lossless WebP picture with at least this number of texels.
fn decode(source: &Source, place: &str, bytes: &[u8], least: usize) -> Result<Plane> {
    isolated(source, place, || decode_here(source, place, bytes, least))
}

fn decode_here(source: &Source, place: &str, bytes: &[u8], least: usize) -> Result<Plane> {
    let again = "write the scene again with a tool that writes lossless WebP planes";
    if !bytes.starts_with(b"RIFF") || bytes.get(8..12) != Some(b"WEBP") {
        return Err(source.error(place, "the plane is not a WebP picture").hint(again));
    }
    let broken =
        |error: DecodingError| source.error(place, format!("the plane cannot be decoded: {error}"));
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let count = u64::from(width) * u64::from(height);
    let what = format!("{place}: the number of texels");
    source.limits.check(LimitKind::Texels, source.path, what, count)?;
    if decoder.is_lossy() || decoder.is_animated() {
        let message = "the plane is lossy or animated, so its bytes are not those that were meant";
        return Err(source.error(place, message).hint(again));
    }
    if count < least as u64 {
        let message =
            format!("the plane has {width} × {height} pixels, fewer than the {least} needed");
        return Err(source.error(place, message));
    }
    source.spend("the size of a plane in bytes", count * TEXEL)?;
    let size = decoder.output_buffer_size();
    let size = size.ok_or_else(|| source.error(place, "the plane is too large"))?;
    let mut channels = vec![0u8; size];
    decoder.read_image(&mut channels).map_err(broken)?;
    let texels = if decoder.has_alpha() {
        channels.as_chunks::<4>().0.to_vec()
    } else {
        channels.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, u8::MAX]).collect()
    };
    Ok(Plane { width: width as usize, texels })
}
