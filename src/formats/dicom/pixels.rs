//! The pixels of a frame: unpacked, and as one number a pixel.

mod jpeg_ls;
mod packed;

use super::{
    element::{Set, Value},
    file::File,
    head::{Colors, Layout, Numbers, pixels},
    syntax::Packing,
    tags,
};
use crate::{
    Result,
    formats::{Endian, SampleType, shared::colors::brightness},
    volume::{Samples, Scalar},
};
use std::borrow::Cow;

/// The numbers of a frame, not packed any more.
struct Plain<'a> {
    bytes: Cow<'a, [u8]>,
    endian: Endian,
    /// Whether the channels come one after the other.
    is_planar: bool,
    colors: Colors,
}

/// The colours of a palette.
struct Palette {
    /// The stored number of the first colour.
    first: i32,
    colors: Vec<[u8; 4]>,
}

/// A decoded frame.
pub struct Decoded {
    /// The numbers of grey pixels, or the luminance of colours.
    pub samples: Samples,
    pub colors: Option<Vec<[u8; 4]>>,
}

/// An opened file whose frames are decoded one by one.
pub struct Decoder<'a> {
    file: &'a File<'a>,
    set: Set<'a>,
    layout: Layout,
    palette: Option<Palette>,
}

impl Layout {
    /// Returns the type of the samples that its frames are decoded to.
    pub fn scalar(&self) -> Scalar {
        if self.channels > 1 || self.colors == Colors::Palette {
            return Scalar::U8;
        }
        match self.numbers {
            Numbers::Whole { allocated: 1, .. } => Scalar::U8,
            Numbers::Whole { allocated: 8, is_signed: false, .. } => Scalar::U8,
            Numbers::Whole { allocated: 16, is_signed: false, .. } => Scalar::U16,
            Numbers::Whole { allocated: 8 | 16, .. } => Scalar::I16,
            Numbers::Whole { is_signed: true, .. } => Scalar::I32,
            Numbers::Whole { stored, .. } if stored < 32 => Scalar::I32,
            _ => Scalar::F32,
        }
    }

    fn sample_type(&self) -> SampleType {
        match self.numbers {
            Numbers::F32 => SampleType::F32,
            Numbers::F64 => SampleType::F64,
            Numbers::Whole { allocated: 32, is_signed: true, .. } => SampleType::I32,
            Numbers::Whole { allocated: 32, .. } => SampleType::U32,
            Numbers::Whole { allocated: 16, is_signed: true, .. } => SampleType::I16,
            Numbers::Whole { allocated: 16, .. } => SampleType::U16,
            Numbers::Whole { is_signed: true, .. } => SampleType::I8,
            Numbers::Whole { .. } => SampleType::U8,
        }
    }
}

impl<'a> Decoder<'a> {
    /// Prepares to decode frames of a file.
    pub fn new(file: &'a File<'a>, layout: Layout) -> Result<Self> {
        file.packing()?;
        let set = file.set()?;
        let palette = match layout.colors {
            Colors::Palette => Some(palette(file, &set)?),
            _ => None,
        };
        Ok(Self { file, set, layout, palette })
    }

    /// Returns the stored numbers of a frame, or its colours: rows from the top, columns from the
    /// left.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for pixels that are cut off or cannot be unpacked.
    pub fn frame(&self, number: u32) -> Result<Decoded> {
        let plain = self.shallow(self.plain(number)?);
        let count = self.layout.columns * self.layout.rows;
        let (bytes, channels) = (&plain.bytes[..], self.layout.channels);
        let planar = |i: usize| [bytes[i], bytes[i + count], bytes[i + 2 * count]];
        let pixels = || bytes.chunks_exact(channels).map(|pixel| [pixel[0], pixel[1], pixel[2]]);
        let colors: Vec<[u8; 4]> = match plain.colors {
            Colors::Rgb if plain.is_planar => (0..count).map(planar).map(opaque).collect(),
            Colors::Rgb => pixels().map(opaque).collect(),
            Colors::Luminance if plain.is_planar => (0..count).map(planar).map(of_ybr).collect(),
            Colors::Luminance => pixels().map(of_ybr).collect(),
            // Two luminances, then the colours that both pixels have.
            Colors::Halved => {
                let pair = |four: &[u8]| [0, 1].map(|at| of_ybr([four[at], four[2], four[3]]));
                bytes.chunks_exact(4).flat_map(pair).collect()
            }
            Colors::Palette => self.shaded(&self.whole(&plain)),
            Colors::Grey | Colors::Inverted => {
                return Ok(Decoded { samples: self.whole(&plain), colors: None });
            }
        };
        let samples = match plain.colors {
            Colors::Luminance if plain.is_planar => Samples::U8(bytes[..count].to_vec()),
            Colors::Luminance => Samples::U8(bytes.iter().step_by(channels).copied().collect()),
            Colors::Halved => {
                Samples::U8(bytes.chunks_exact(4).flat_map(|four| [four[0], four[1]]).collect())
            }
            _ => brightness(&colors),
        };
        Ok(Decoded { samples, colors: Some(colors) })
    }

    /// Returns colours with 8 bits a channel, the highest of those stored.
    fn shallow<'b>(&self, plain: Plain<'b>) -> Plain<'b> {
        let width = self.layout.sample_type().bytes();
        let Numbers::Whole { high, .. } = self.layout.numbers else { return plain };
        if self.layout.channels == 1 || width == 1 {
            return plain;
        }
        let of = |number: &[u8]| {
            let mut bytes = [0; 8];
            bytes[..width].copy_from_slice(number);
            if plain.endian == Endian::Big {
                bytes[..width].reverse();
            }
            (u64::from_le_bytes(bytes) >> high.saturating_sub(7)) as u8
        };
        let bytes = plain.bytes.chunks_exact(width).map(of).collect();
        Plain { bytes: Cow::Owned(bytes), ..plain }
    }

    /// Returns the colours of a palette that stored numbers stand for.
    fn shaded(&self, numbers: &Samples) -> Vec<[u8; 4]> {
        let Some(Palette { first, colors }) = &self.palette else {
            return vec![[0; 4]; numbers.len()];
        };
        let last = colors.len() - 1;
        let of = |i: usize| {
            let index = (numbers.value(i) as i32).saturating_sub(*first).max(0) as usize;
            colors[index.min(last)]
        };
        (0..numbers.len()).map(of).collect()
    }

    /// Returns the numbers of grey pixels.
    fn whole(&self, plain: &Plain) -> Samples {
        let layout = &self.layout;
        let Numbers::Whole { allocated, stored, high, is_signed } = layout.numbers else {
            return layout.sample_type().decode(plain.bytes.as_ref().into(), plain.endian);
        };
        let is_full = stored == allocated && allocated < 32;
        if allocated == 1 || is_full {
            return layout.sample_type().decode(plain.bytes.as_ref().into(), plain.endian);
        }
        // Bits beyond those stored hold something else, or nothing.
        let (down, up) = (high + 1 - stored, 64 - stored);
        let bits = |raw: u64| (raw >> down) << up;
        let value = |raw: u64| {
            if is_signed { (bits(raw) as i64) >> up } else { (bits(raw) >> up) as i64 }
        };
        let width = usize::from(allocated / 8);
        let raw = |number: &[u8]| {
            let mut bytes = [0; 8];
            bytes[..width].copy_from_slice(number);
            if plain.endian == Endian::Big {
                bytes[..width].reverse();
            }
            u64::from_le_bytes(bytes)
        };
        let values = plain.bytes.chunks_exact(width).map(|number| value(raw(number)));
        match layout.scalar() {
            Scalar::U8 => Samples::U8(values.map(|value| value as u8).collect()),
            Scalar::U16 => Samples::U16(values.map(|value| value as u16).collect()),
            Scalar::I16 => Samples::I16(values.map(|value| value as i16).collect()),
            Scalar::I32 => Samples::I32(values.map(|value| value as i32).collect()),
            _ => Samples::F32(values.map(|value| value as f32).collect()),
        }
    }

    /// Unpacks a frame.
    fn plain(&self, number: u32) -> Result<Plain<'_>> {
        let source = self.file.source;
        let place = || format!("pixel data, frame {number}");
        let layout = &self.layout;
        let endian = self.file.syntax.coding.endian;
        match (pixels(&self.set), layout.packing) {
            (Some(Value::Bytes(bytes)), _) => {
                let bytes = self.native(bytes, number)?;
                Ok(Plain { bytes, endian, is_planar: layout.is_planar, colors: layout.colors })
            }
            (Some(Value::Cut(there, claimed)), _) => {
                let message = format!(
                    "{claimed} bytes were expected, but the file ends after {}",
                    there.len()
                );
                Err(source.error("pixel data", message))
            }
            (Some(Value::Fragments(fragments)), Packing::Native) => {
                let parts = packed::parts(self, fragments, number)?;
                let bytes = Cow::Owned(self.native(&parts, 0)?.into_owned());
                Ok(Plain { bytes, endian, is_planar: layout.is_planar, colors: layout.colors })
            }
            (Some(Value::Fragments(fragments)), packing) => {
                let parts = packed::parts(self, fragments, number)?;
                packed::unpack(self, &parts, packing, &place())
            }
            (Some(Value::Items(..)) | None, _) => {
                Err(source.error("pixel data", "holds no pixels"))
            }
        }
    }

    /// Returns the bytes of a frame that is not packed.
    fn native<'b>(&self, bytes: &'b [u8], number: u32) -> Result<Cow<'b, [u8]>> {
        let (layout, number) = (&self.layout, number as usize);
        let count = layout.frame_numbers();
        let size = match layout.numbers {
            // A frame may begin inside a byte.
            Numbers::Whole { allocated: 1, .. } => {
                let first = count.saturating_mul(number);
                let bit = |at: usize| Some(bytes.get(at / 8)? >> (at % 8) & 1);
                let bits: Option<Vec<u8>> = if first.saturating_add(count) / 8 <= bytes.len() {
                    (first..first + count).map(bit).collect()
                } else {
                    None
                };
                return bits.map(Cow::Owned).ok_or_else(|| self.short(bytes, count.div_ceil(8)));
            }
            _ if layout.colors == Colors::Halved => count / layout.channels * 2,
            _ => count.saturating_mul(layout.sample_type().bytes()),
        };
        let start = size.saturating_mul(number);
        let part = bytes.get(start..).and_then(|rest| rest.get(..size));
        let part = part.ok_or_else(|| self.short(bytes, size))?;
        let is_swapped = self.file.syntax.coding.endian == Endian::Big
            && layout.sample_type().bytes() == 1
            && self.set.get(tags::PIXEL_DATA).is_some_and(|element| element.kind == *b"OW");
        if is_swapped {
            // Bytes are stored in words, whose order of bytes is that of the file.
            let swapped = part.chunks(2).flat_map(|pair| pair.iter().rev().copied());
            return Ok(Cow::Owned(swapped.collect()));
        }
        Ok(part.into())
    }

    /// Returns the error for pixels that are too few for their frames.
    fn short(&self, bytes: &[u8], size: usize) -> crate::Error {
        let Layout { columns, rows, .. } = self.layout;
        let message = format!(
            "a frame of {columns} × {rows} pixels needs {size} bytes, but the pixels of all frames \
             have {}",
            bytes.len()
        );
        self.file.source.error("pixel data", message)
    }
}

fn opaque([red, green, blue]: [u8; 3]) -> [u8; 4] {
    [red, green, blue, 255]
}

/// Returns the colour of a luminance and two differences of colour (ITU-R BT.601, all of the 256
/// values).
fn of_ybr(pixel: [u8; 3]) -> [u8; 4] {
    let [light, blue, red] = pixel.map(f32::from);
    let (blue, red) = (blue - 128.0, red - 128.0);
    let channels =
        [light + 1.402 * red, light - 0.344_136 * blue - 0.714_136 * red, light + 1.772 * blue];
    opaque(channels.map(|channel| channel.round() as u8))
}

/// Reads a palette.
fn palette(file: &File, set: &Set) -> Result<Palette> {
    let shape = set.shorts(tags::PALETTE_RED_SHAPE);
    let error = |message: &str| file.source.error("palette", message);
    let &[count, first, bits, ..] = &shape[..] else {
        return Err(error("is missing or segmented; a plain palette was expected"));
    };
    let count = if count == 0 { 1 << 16 } else { usize::from(count) };
    let channel = |offset: u32| {
        let bytes = set.bytes(tags::PALETTE_RED + offset).unwrap_or_default();
        // Of 16 bits, the higher eight; some files store 8 bits in words, others in bytes.
        match bytes.len() {
            length if length >= 2 * count => {
                let words = set.shorts(tags::PALETTE_RED + offset).into_iter();
                let shift = if bits > 8 { 8 } else { 0 };
                Some(words.take(count).map(|word| (word >> shift) as u8).collect::<Vec<u8>>())
            }
            length if length >= count => Some(bytes[..count].to_vec()),
            _ => None,
        }
    };
    let (Some(red), Some(green), Some(blue)) = (channel(0), channel(1), channel(2)) else {
        return Err(error("has fewer colours than its shape says, or is segmented"));
    };
    let colors = (0..count).map(|i| [red[i], green[i], blue[i], 255]).collect();
    let is_signed = set.short(tags::REPRESENTATION) == Some(1);
    let first = if is_signed { i32::from(first as i16) } else { first.into() };
    Ok(Palette { first, colors })
}
