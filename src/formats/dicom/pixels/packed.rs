//! Frames that are packed: by run lengths (PS3.5, annex G), JPEG, JPEG-LS or JPEG 2000.

use super::{Colors, Decoder, Packing, Plain, jpeg_ls};
use crate::{
    Error, Result,
    formats::{Endian, dicom::tags},
    input::isolate::{FEW_PIXELS, isolated_in_time},
};
use jpeg_decoder::{ColorTransform, PixelFormat};
use std::borrow::Cow;

/// Returns the bytes of one frame. Fragments do not cross the borders of frames, but a frame may
/// have several; the tables of offsets tell where frames begin, or else the marks of their method.
pub fn parts<'b>(decoder: &Decoder, fragments: &[&'b [u8]], number: u32) -> Result<Cow<'b, [u8]>> {
    // The first fragment is the table of offsets, which may be empty.
    let Some((table, fragments)) = fragments.split_first() else {
        return Err(decoder.file.source.error("pixel data", "has no fragments"));
    };
    let number = number as usize;
    let frames = frames_of(decoder);
    if let Some(&fragment) = fragments.get(number).filter(|_| fragments.len() == frames) {
        return Ok(fragment.into());
    }
    let starts = starts(decoder, table, fragments, frames);
    let joined = |from: usize, to: usize| match &fragments[from..to] {
        [one] => Cow::Borrowed(*one),
        several => Cow::Owned(several.concat()),
    };
    let from = starts.get(number).copied();
    let to = starts.get(number + 1).copied().unwrap_or(fragments.len());
    from.filter(|&from| from < to).map(|from| joined(from, to)).ok_or_else(|| {
        let message = format!(
            "frame {number} is missing: there are {} fragments for {frames} frames",
            fragments.len()
        );
        decoder.file.source.error("pixel data", message)
    })
}

fn frames_of(decoder: &Decoder) -> usize {
    decoder.set.decimal(tags::FRAMES).map_or(1, |count| count.max(1.0) as usize)
}

/// Returns the fragment that each frame begins with.
fn starts(decoder: &Decoder, table: &[u8], fragments: &[&[u8]], frames: usize) -> Vec<usize> {
    if frames == 1 {
        return vec![0];
    }
    let wide = decoder.set.bytes(tags::EXTENDED_OFFSETS).unwrap_or_default();
    let offsets: Vec<u64> = if wide.is_empty() {
        table.as_chunks().0.iter().map(|&offset| u32::from_le_bytes(offset).into()).collect()
    } else {
        wide.as_chunks().0.iter().map(|&offset| u64::from_le_bytes(offset)).collect()
    };
    if offsets.len() < frames {
        let begins =
            |part: &&[u8]| part.starts_with(&[0xff, 0xd8]) || part.starts_with(&[0xff, 0x4f]);
        return (0..fragments.len()).filter(|&i| begins(&fragments[i])).collect();
    }
    // Each fragment has 8 bytes before it.
    let mut places = Vec::with_capacity(fragments.len());
    let mut at = 0;
    for fragment in fragments {
        places.push(at);
        at += fragment.len() as u64 + 8;
    }
    offsets.iter().map(|offset| places.partition_point(|place| place < offset)).collect()
}

/// Unpacks a frame.
pub fn unpack<'a>(
    decoder: &Decoder,
    bytes: &[u8],
    packing: Packing,
    place: &str,
) -> Result<Plain<'a>> {
    let source = decoder.file.source;
    let width = decoder.layout.sample_type().bytes();
    let size = decoder.layout.frame_numbers().saturating_mul(width);
    source.spend("the size of an unpacked frame in bytes", size as u64)?;
    let plain = match packing {
        Packing::Rle => rle(decoder, bytes, place)?,
        Packing::JpegLs => unpacked_ls(decoder, bytes, place)?,
        Packing::Jpeg => jpeg(decoder, bytes, place)?,
        _ => jpeg_2000(decoder, bytes, place)?,
    };
    if plain.bytes.len() == size {
        return Ok(plain);
    }
    let message = format!("unpacks to {} bytes where {size} were expected", plain.bytes.len());
    Err(source.error(place, message))
}

fn refuse(decoder: &Decoder, place: &str, message: impl std::fmt::Display) -> Error {
    decoder.file.source.error(place, format!("cannot be unpacked: {message}"))
}

/// Unpacks run lengths: a segment for each byte of each channel, the highest byte first.
fn rle<'a>(decoder: &Decoder, bytes: &[u8], place: &str) -> Result<Plain<'a>> {
    const HEADER: usize = 64;
    let layout = &decoder.layout;
    let width = layout.sample_type().bytes();
    let (count, channels) = (layout.columns * layout.rows, layout.channels);
    let number = |at: usize| {
        let bytes = bytes.get(4 * at..).and_then(|rest| rest.first_chunk());
        bytes.map_or(0, |&bytes| u32::from_le_bytes(bytes) as usize)
    };
    let segments = number(0);
    if bytes.len() < HEADER || segments != width * channels || segments > 15 {
        let message = format!("{segments} segments where {} were expected", width * channels);
        return Err(refuse(decoder, place, message));
    }
    let mut out = vec![0; count * width * channels];
    for segment in 0..segments {
        let start = number(segment + 1);
        let end = if segment + 1 < segments { number(segment + 2) } else { bytes.len() };
        let packed = bytes.get(start..end).filter(|_| start >= HEADER);
        let packed = packed.ok_or_else(|| {
            refuse(decoder, place, format!("segment {segment} lies outside the frame"))
        })?;
        let (channel, byte) = (segment / width, width - 1 - segment % width);
        let plane = &mut out[channel * count * width..][..count * width];
        let written = runs(packed, plane.iter_mut().skip(byte).step_by(width));
        if written < count {
            let message = format!("segment {segment} holds {written} of {count} bytes");
            return Err(refuse(decoder, place, message));
        }
    }
    Ok(Plain {
        bytes: out.into(),
        endian: Endian::Little,
        is_planar: true,
        colors: colors(decoder),
    })
}

/// Writes the bytes of run lengths. Returns how many there were, at most as many as fit.
fn runs<'a>(packed: &[u8], mut out: impl Iterator<Item = &'a mut u8>) -> usize {
    let (mut at, mut written) = (0, 0);
    while let Some(&code) = packed.get(at) {
        let (from, count, step) = match code {
            0..128 => (at + 1, usize::from(code) + 1, 1),
            128 => {
                at += 1;
                continue;
            }
            129.. => (at + 1, 257 - usize::from(code), 0),
        };
        for i in 0..count {
            let Some(&byte) = packed.get(from + i * step) else { return written };
            let Some(place) = out.next() else { return written };
            *place = byte;
            written += 1;
        }
        at = from + if step == 1 { count } else { 1 };
    }
    written
}

/// Colours of unpacked frames: two pixels do not share colours any more.
fn colors(decoder: &Decoder) -> Colors {
    match decoder.layout.colors {
        Colors::Halved => Colors::Luminance,
        other => other,
    }
}

/// Unpacks JPEG: baseline, extended or lossless.
fn jpeg<'a>(decoder: &Decoder, bytes: &[u8], place: &str) -> Result<Plain<'a>> {
    let layout = &decoder.layout;
    check_size(decoder, jpeg_size(bytes), place)?;
    let numbers = layout.frame_numbers();
    lend(decoder, numbers.saturating_mul(JPEG))?;
    let (is_rgb, copy) = (layout.colors == Colors::Rgb, bytes.to_vec());
    let (unpacked, format) = in_time(decoder, place, move || {
        let mut reader = jpeg_decoder::Decoder::new(&copy[..]);
        reader.set_max_decoding_buffer_size(2 * numbers);
        if is_rgb {
            reader.set_color_transform(ColorTransform::RGB);
        }
        let unpacked = reader.decode().map_err(|error| error.to_string())?;
        Ok((unpacked, reader.info().map(|info| info.pixel_format)))
    })?;
    let width = layout.sample_type().bytes();
    let bytes = match (format, layout.channels, width) {
        (Some(PixelFormat::L8), 1, 1) | (Some(PixelFormat::RGB24), 3, 1) => unpacked,
        (Some(PixelFormat::L8), 1, 2) => unpacked.into_iter().flat_map(|low| [low, 0]).collect(),
        (Some(PixelFormat::L16), 1, 2) => {
            let native = unpacked.as_chunks().0.iter().map(|&word| u16::from_ne_bytes(word));
            native.flat_map(u16::to_le_bytes).collect()
        }
        (format, channels, width) => {
            let actual = format.map_or("nothing".into(), |format| format!("{format:?}"));
            let message = format!("{actual} where {channels} × {} bits were expected", 8 * width);
            return Err(refuse(decoder, place, message));
        }
    };
    let colors = if layout.channels == 3 { Colors::Rgb } else { layout.colors };
    Ok(Plain { bytes: bytes.into(), endian: Endian::Little, is_planar: false, colors })
}

/// Unpacks JPEG-LS.
fn unpacked_ls<'a>(decoder: &Decoder, bytes: &[u8], place: &str) -> Result<Plain<'a>> {
    let layout = &decoder.layout;
    let source = decoder.file.source;
    let is_over = || source.time_left().is_zero();
    let size = [layout.columns, layout.rows];
    let picture = jpeg_ls::decode(bytes, size, layout.channels, &is_over).map_err(|message| {
        source.check_time().err().unwrap_or_else(|| refuse(decoder, place, message))
    })?;
    let width = layout.sample_type().bytes();
    if usize::from(picture.bits) > 8 * width || width > 2 {
        let message = format!("{} bits where {} were expected", picture.bits, 8 * width);
        return Err(refuse(decoder, place, message));
    }
    let low = |number: u16| number.to_le_bytes().into_iter().take(width);
    let bytes = picture.numbers.into_iter().flat_map(low).collect();
    let colors = colors(decoder);
    Ok(Plain { bytes: Cow::Owned(bytes), endian: Endian::Little, is_planar: true, colors })
}

/// Returns the columns and rows that a JPEG stream begins with.
fn jpeg_size(bytes: &[u8]) -> Option<[usize; 2]> {
    let mut at = 2;
    loop {
        let &[mark, code, high, low] = bytes.get(at..)?.first_chunk()?;
        if mark != 0xff {
            return None;
        }
        match code {
            0xff => at += 1,
            // The start of a frame, of any method.
            0xc0..=0xcf if ![0xc4, 0xc8, 0xcc].contains(&code) => {
                let &[a, b, c, d] = bytes.get(at + 5..)?.first_chunk()?;
                return Some([
                    u16::from_be_bytes([c, d]).into(),
                    u16::from_be_bytes([a, b]).into(),
                ]);
            }
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
    }
}

/// Refuses a stream of another size before it is unpacked: its size decides what memory that takes.
fn check_size(decoder: &Decoder, size: Option<[usize; 2]>, place: &str) -> Result<()> {
    let (columns, rows) = (decoder.layout.columns, decoder.layout.rows);
    match size {
        Some(size) if size == [columns, rows] => Ok(()),
        Some([x, y]) => {
            let message = format!("a picture of {x} × {y} pixels, not of {columns} × {rows}");
            Err(refuse(decoder, place, message))
        }
        None => Err(refuse(decoder, place, "its header is damaged")),
    }
}

/// Unpacks JPEG 2000.
fn jpeg_2000<'a>(decoder: &Decoder, bytes: &[u8], place: &str) -> Result<Plain<'a>> {
    let layout = &decoder.layout;
    let head = Head::of(bytes);
    check_size(decoder, head.as_ref().map(|head| head.size), place)?;
    let tiles = head.map_or(0, |head| head.tiles);
    let numbers = layout.frame_numbers();
    lend(decoder, numbers.saturating_mul(JPEG_2000).saturating_add(tiles.saturating_mul(TILE)))?;
    let (count, channels) = (layout.columns * layout.rows, layout.channels);
    let width = layout.sample_type().bytes();
    let (size, copy) = ([layout.columns, layout.rows], bytes.to_vec());
    let out = in_time(decoder, place, move || {
        let image = jpeg2k::Image::from_bytes(&copy).map_err(|error| error.to_string())?;
        let components = image.components();
        let fits = |part: &jpeg2k::ImageComponent| {
            // The crate makes a slice of data that it has not checked to be there.
            [part.width() as usize, part.height() as usize] == size
                && !format!("{part:?}").contains("data: 0x0,")
        };
        if components.len() < channels || !components[..channels].iter().all(fits) {
            return Err(format!("{} channels of another size or of none", components.len()));
        }
        let mut out = vec![0; count * width * channels];
        for (plane, part) in out.chunks_exact_mut(count * width).zip(components) {
            for (number, value) in plane.chunks_exact_mut(width).zip(part.data()) {
                number.copy_from_slice(&value.to_le_bytes()[..width]);
            }
        }
        Ok(out)
    })?;
    let colors = colors(decoder);
    Ok(Plain { bytes: out.into(), endian: Endian::Little, is_planar: true, colors })
}

/// Bytes that a decoder takes for each number: of JPEG, coefficients, lines and the result; of JPEG
/// 2000, two copies in 32 bits and the result.
const JPEG: usize = 8;
const JPEG_2000: usize = 12;

/// Bytes that the decoder of JPEG 2000 takes for each tile that a header claims.
const TILE: usize = 8 << 10;

/// Checks the memory that a decoder takes for a frame, and gives back.
fn lend(decoder: &Decoder, bytes: usize) -> Result<()> {
    decoder.file.source.lend("the memory to unpack a frame in bytes", bytes as u64)
}

/// Runs a decoder of one frame within the time limit.
fn in_time<T: Send + 'static>(
    decoder: &Decoder,
    place: &str,
    decode: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T> {
    let long = decoder.layout.frame_numbers() as u64 > FEW_PIXELS;
    isolated_in_time(decoder.file.source, place, long, || {
        decode().map_err(|error| format!("cannot be unpacked: {error}"))
    })
}

/// What a stream of JPEG 2000 begins with.
struct Head {
    /// Columns and rows.
    size: [usize; 2],
    tiles: usize,
}

impl Head {
    /// Returns `None` for a damaged stream, and for one of many channels.
    fn of(bytes: &[u8]) -> Option<Self> {
        let stream = bytes.get(codestream(bytes)?..)?;
        let stream = stream.strip_prefix(&[0xff, 0x4f, 0xff, 0x51])?;
        let number = |i: usize| {
            let number = stream.get(4 + 4 * i..).and_then(|rest| rest.first_chunk());
            number.map(|&number| u32::from_be_bytes(number) as usize)
        };
        let channels = u16::from_be_bytes(*stream.get(36..)?.first_chunk()?);
        let side = |axis: usize| number(axis)?.checked_sub(number(2 + axis)?);
        let tiles = |axis: usize| {
            let covered = number(axis)?.checked_sub(number(6 + axis)?)?;
            Some(covered.div_ceil(number(4 + axis).filter(|&size| size > 0)?))
        };
        let (size, tiles) = ([side(0)?, side(1)?], tiles(0)?.checked_mul(tiles(1)?)?);
        (1..=4).contains(&channels).then_some(Self { size, tiles })
    }
}

/// Returns where a stream of JPEG 2000 begins: at once, or in a box of a file.
fn codestream(bytes: &[u8]) -> Option<usize> {
    let mut at = 0;
    while !bytes.get(at..)?.starts_with(&[0xff, 0x4f]) {
        let head = bytes.get(at..)?;
        let (&length, kind) = (head.first_chunk()?, head.get(4..8)?);
        // Of long boxes, the length follows the kind. The last box may have none.
        let (length, start) = match u32::from_be_bytes(length) {
            0 => (head.len(), 8),
            1 => (usize::try_from(u64::from_be_bytes(*head.get(8..)?.first_chunk()?)).ok()?, 16),
            length => (length as usize, 8),
        };
        if kind == b"jp2c" {
            return Some(at + start);
        }
        at = at.checked_add(length.max(start))?;
    }
    Some(at)
}
