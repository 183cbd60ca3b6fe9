//! Blocks of numbers as laboratories store them: types that [`SampleType`] does not have, any order
//! of the axes, and several components at each sample.

use super::{
    colors, holes,
    sample_type::{Endian, SampleType},
};
use crate::{
    Error, Result,
    formats::ReadOptions,
    input::Source,
    parallel::prelude::*,
    volume::{Lattice, Samples, Volume},
};
use half::f16;
use std::borrow::Cow;

/// The type of one number of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    /// A type that raw files have too.
    Real(SampleType),
    /// One byte, 0 or not.
    Bool,
    /// 16 bits, floating point.
    Half,
    /// A real and an imaginary part, of this type each. Its value is its magnitude.
    Complex(SampleType),
}

/// Which of the components of a sample to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    One(usize),
    /// The length of the vector of all components.
    Magnitude,
    /// The brightness of a colour: 0.299 red + 0.587 green + 0.114 blue (ITU-R BT.601).
    Luminance,
    /// The colour: samples are its brightness, and the volume has the colours as well.
    Color,
}

/// The layout of a block. Numbers that follow one another in memory are one stride apart.
#[derive(Debug, Clone)]
pub struct Grid {
    pub element: Element,
    pub endian: Endian,
    /// Samples along x, y and z.
    pub dims: [usize; 3],
    /// Numbers from one sample to the next along x, y and z.
    pub strides: [usize; 3],
    /// Numbers at each sample.
    pub components: usize,
    /// Numbers from one component to the next.
    pub step: usize,
}

impl Element {
    /// Returns the name, as messages and lists spell it.
    pub fn name(self) -> String {
        match self {
            Self::Real(kind) => kind.name().into(),
            Self::Bool => "bool".into(),
            Self::Half => "f16".into(),
            Self::Complex(part) => format!("complex {}", part.name()),
        }
    }

    /// Returns whether it is an unsigned number of 8 bits, as colours mostly are.
    pub fn is_byte(self) -> bool {
        self == Self::Real(SampleType::U8)
    }

    /// Returns the bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::Real(kind) => kind.bytes(),
            Self::Bool => 1,
            Self::Half => 2,
            Self::Complex(part) => 2 * part.bytes(),
        }
    }

    /// Returns the most bytes that `size` bytes of numbers take once they are decoded.
    fn decoded_bytes(self, size: usize) -> u64 {
        match self {
            Self::Real(kind) => kind.decoded_bytes(size),
            Self::Bool => size as u64,
            Self::Half => 2 * size as u64,
            Self::Complex(_) => 4 * (size / self.bytes()) as u64,
        }
    }

    /// Decodes numbers from their bytes; bytes after the last whole number are ignored.
    pub fn decode(self, bytes: Cow<'_, [u8]>, endian: Endian) -> Samples {
        match self {
            Self::Real(kind) => kind.decode(bytes, endian),
            Self::Bool => Samples::U8(bytes.par_iter().map(|&v| u8::from(v != 0)).collect()),
            Self::Half => Samples::F32(
                bytes.as_chunks().0.par_iter().map(|&pair| half(pair, endian).to_f32()).collect(),
            ),
            Self::Complex(part) => {
                let size = self.bytes();
                let magnitude = |pair: &[u8]| {
                    let parts = part.doubles(pair, endian);
                    parts[0].hypot(parts[1]) as f32
                };
                Samples::F32(bytes.par_chunks_exact(size).map(magnitude).collect())
            }
        }
    }

    /// Decodes numbers as doubles.
    pub fn doubles(self, bytes: &[u8], endian: Endian) -> Vec<f64> {
        match self {
            Self::Real(kind) => kind.doubles(bytes, endian),
            _ => {
                let samples = self.decode(bytes.into(), endian);
                (0..samples.len()).map(|index| samples.value(index)).collect()
            }
        }
    }
}

fn half(mut pair: [u8; 2], endian: Endian) -> f16 {
    if endian == Endian::Big {
        pair.reverse();
    }
    f16::from_le_bytes(pair)
}

impl Grid {
    /// A block whose components follow one another, then the samples, x fastest.
    pub fn interleaved(
        element: Element,
        endian: Endian,
        dims: [usize; 3],
        components: usize,
    ) -> Self {
        let [nx, ny, _] = dims;
        let row = components.saturating_mul(nx);
        let strides = [components, row, row.saturating_mul(ny)];
        Self { element, endian, dims, strides, components, step: 1 }
    }

    /// Returns the bytes of all numbers; `None` if they exceed 64 bits.
    pub fn bytes(&self) -> Option<u64> {
        let numbers = [self.dims[0], self.dims[1], self.dims[2], self.components];
        numbers
            .iter()
            .try_fold(self.element.bytes() as u64, |all, &count| all.checked_mul(count as u64))
    }

    /// Checks the size of the block against the limits, and that the lattice is sound. Returns the
    /// bytes of the block.
    ///
    /// # Errors
    /// [`Error::Limit`] for more bytes than the limits allow.
    pub fn check(&self, source: &Source) -> Result<usize> {
        source.check_bytes("the size of the samples in bytes", self.bytes().unwrap_or(u64::MAX))
    }

    /// Reads a component of the samples from the bytes of the block.
    ///
    /// # Errors
    /// [`Error::Input`] if there are fewer bytes than the block has; [`Error::Limit`] if the
    /// samples take more than the limits allow.
    pub fn samples(
        &self,
        source: &Source,
        data: Cow<'_, [u8]>,
        component: Component,
    ) -> Result<Samples> {
        let size = self.check(source)?;
        if data.len() < size {
            return Err(too_few(source, data.len(), size));
        }
        let samples = self.dims.iter().product::<usize>();
        let decoded = self.element.decoded_bytes(samples * self.element.bytes());
        source.spend("the size of the samples in bytes", decoded)?;
        let [nx, ny, _] = self.dims;
        match component {
            Component::One(0) if self.components == 1 && self.strides == [1, nx, nx * ny] => {
                let mut data = data;
                match &mut data {
                    Cow::Borrowed(bytes) => *bytes = &bytes[..size],
                    Cow::Owned(bytes) => bytes.truncate(size),
                }
                Ok(self.element.decode(data, self.endian))
            }
            Component::One(which) => {
                source.spend("the size of the samples in bytes", decoded)?;
                Ok(self.element.decode(self.picked(&data, which).into(), self.endian))
            }
            Component::Magnitude => {
                source.room::<f32>("the samples", samples)?;
                let all: Vec<_> = (0..self.components).map(|which| (which, 1.0)).collect();
                Ok(Samples::F32(self.combined(&data, &all, |v| v * v, f64::sqrt)))
            }
            Component::Luminance | Component::Color => {
                source.room::<f32>("the samples", samples)?;
                let light = self.combined(&data, &LUMINANCE, |v| v, |sum| sum);
                Ok(match self.element {
                    Element::Real(SampleType::U8) => Samples::U8(rounded(light, |v| v as u8)),
                    Element::Real(SampleType::U16) => Samples::U16(rounded(light, |v| v as u16)),
                    _ => Samples::F32(light),
                })
            }
        }
    }

    /// Reads a volume from the bytes of the block: a component of the samples, with the colours if
    /// that is [`Component::Color`].
    ///
    /// # Errors
    /// As [`samples`](Self::samples), and [`Error::Input`] if no sample has a value.
    pub fn volume(
        &self,
        source: &Source,
        lattice: Lattice,
        data: Cow<'_, [u8]>,
        component: Component,
        options: &ReadOptions,
    ) -> Result<Volume> {
        if component != Component::Color {
            let samples = self.samples(source, data, component)?;
            return holes::volume(source, lattice, samples, options);
        }
        let samples = self.samples(source, Cow::Borrowed(&data), component)?;
        let channel = |which| self.samples(source, Cow::Borrowed(&data), Component::One(which));
        let channels: Vec<Samples> =
            (0..self.components.min(4)).map(channel).collect::<Result<_>>()?;
        let mut volume = holes::volume(source, lattice, samples, options)?;
        colors::attach(&mut volume, colors::of_channels(source, &channels)?);
        Ok(volume)
    }

    /// Returns the offset in bytes of the first sample of a row, for a component.
    fn row(&self, row: usize, component: usize) -> usize {
        let (y, z) = (row % self.dims[1], row / self.dims[1]);
        let number = y * self.strides[1] + z * self.strides[2] + component * self.step;
        number * self.element.bytes()
    }

    /// Copies one component of a row to `out`.
    fn copy_row(&self, data: &[u8], row: usize, component: usize, out: &mut [u8]) {
        let size = self.element.bytes();
        let (start, stride) = (self.row(row, component), self.strides[0] * size);
        if stride == size {
            out.copy_from_slice(&data[start..][..out.len()]);
            return;
        }
        for (x, number) in out.chunks_exact_mut(size).enumerate() {
            number.copy_from_slice(&data[start + x * stride..][..size]);
        }
    }

    /// Returns the bytes of one component, x fastest.
    fn picked(&self, data: &[u8], component: usize) -> Vec<u8> {
        let row = self.dims[0] * self.element.bytes();
        let mut out = vec![0; row * self.dims[1] * self.dims[2]];
        out.par_chunks_mut(row.max(1))
            .enumerate()
            .for_each(|(index, out)| self.copy_row(data, index, component, out));
        out
    }

    /// Returns `root` of the sum of `term` of the components, each times its weight.
    fn combined(
        &self,
        data: &[u8],
        weights: &[(usize, f64)],
        term: fn(f64) -> f64,
        root: fn(f64) -> f64,
    ) -> Vec<f32> {
        let nx = self.dims[0];
        let mut out = vec![0.0; nx * self.dims[1] * self.dims[2]];
        out.par_chunks_mut(nx.max(1)).enumerate().for_each(|(index, out)| {
            let mut bytes = vec![0; nx * self.element.bytes()];
            let mut sums = vec![0.0; nx];
            for &(component, weight) in weights {
                self.copy_row(data, index, component, &mut bytes);
                let values = self.element.doubles(&bytes, self.endian);
                sums.iter_mut().zip(values).for_each(|(sum, v)| *sum += weight * term(v));
            }
            out.iter_mut().zip(sums).for_each(|(out, sum)| *out = root(sum) as f32);
        });
        out
    }
}

/// The parts of red, green and blue in the brightness of a colour.
const LUMINANCE: [(usize, f64); 3] = [(0, 0.299), (1, 0.587), (2, 0.114)];

fn rounded<T: Send>(values: Vec<f32>, turn: impl Fn(f32) -> T + Sync) -> Vec<T> {
    values.into_par_iter().map(|v| turn(v.round())).collect()
}

/// Returns the error for a block that is cut off.
pub fn too_few(source: &Source, bytes: usize, expected: usize) -> Error {
    source.error("data", format!("there are {bytes} bytes where {expected} were expected"))
}

impl Component {
    /// Returns the component that the options choose (`name:x`, `name:1`, `name:magnitude`, or one
    /// of these words alone) of files whose values are all of one array.
    ///
    /// Without a choice it is the only component, the colour (`rgb`), or the magnitude.
    ///
    /// # Errors
    /// [`Error::Input`] for a name that is not of a component of the file, with those that are.
    pub fn chosen(
        source: &Source,
        options: &ReadOptions,
        components: usize,
        are_colors: bool,
    ) -> Result<Self> {
        let default = match components {
            0 | 1 => Self::One(0),
            _ if are_colors => Self::Color,
            _ => Self::Magnitude,
        };
        let Some(name) = options.scalar.as_deref() else { return Ok(default) };
        let word = name.rsplit(':').next().unwrap_or(name).trim().to_ascii_lowercase();
        let index = match word.as_str() {
            "value" | "values" | "scalar" | "" => return Ok(default),
            "magnitude" if components > 1 => return Ok(Self::Magnitude),
            "luminance" if matches!(components, 3 | 4) => return Ok(Self::Luminance),
            "rgb" | "rgba" if matches!(components, 3 | 4) => return Ok(Self::Color),
            "x" | "r" | "red" => 0,
            "y" | "g" | "green" => 1,
            "z" | "b" | "blue" => 2,
            "w" | "a" | "alpha" => 3,
            number => number.parse().unwrap_or(usize::MAX),
        };
        if index < components.max(1) {
            return Ok(Self::One(index));
        }
        let message = format!(
            "nothing has the name “{name}”; each sample has {}",
            match components {
                0 | 1 => "one value, “value”".into(),
                count => format!("{count} components, “value:0” to “value:{}”", count - 1),
            }
        );
        Err(source.error("values", message).hint("leave out --scalar, or name one of these"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use std::path::Path;

    fn with<T>(read: impl Fn(&Source) -> T) -> T {
        let limits = Limits::default();
        read(&Source::from_bytes(Path::new("a"), &[], &limits).unwrap())
    }

    fn read(grid: &Grid, data: &[u8], component: Component) -> Vec<f64> {
        let samples = with(|source| grid.samples(source, data.into(), component)).unwrap();
        (0..samples.len()).map(|index| samples.value(index)).collect()
    }

    #[test]
    fn every_element_is_decoded() {
        let dims = [2, 1, 1];
        let f16 = [f16::from_f32(0.5).to_le_bytes(), f16::from_f32(-2.0).to_le_bytes()].concat();
        let turned: Vec<u8> = f16.chunks(2).flat_map(|pair| [pair[1], pair[0]]).collect();
        let complex: Vec<u8> =
            [3f32, 4.0, 0.0, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let short: Vec<u8> = [3i16, 4, 0, -2].iter().flat_map(|v| v.to_be_bytes()).collect();
        for (element, endian, data, values) in [
            (Element::Bool, Endian::Little, vec![0, 7], [0.0, 1.0]),
            (Element::Half, Endian::Little, f16, [0.5, -2.0]),
            (Element::Half, Endian::Big, turned, [0.5, -2.0]),
            (Element::Complex(SampleType::F32), Endian::Little, complex, [5.0, 2.0]),
            (Element::Complex(SampleType::I16), Endian::Big, short, [5.0, 2.0]),
            (Element::Real(SampleType::I8), Endian::Big, vec![255, 3], [-1.0, 3.0]),
        ] {
            assert_eq!(element.doubles(&data, endian), values, "{element:?}");
            let grid = Grid::interleaved(element, endian, dims, 1);
            assert_eq!(read(&grid, &data, Component::One(0)), values, "{element:?}");
            let short = with(|s| grid.samples(s, data[1..].into(), Component::One(0)));
            assert!(short.unwrap_err().to_string().contains("bytes where"), "{element:?}");
        }
    }

    #[test]
    fn components_and_strides_are_followed() {
        let byte = Element::Real(SampleType::U8);
        // Interleaved: samples (1, 2, 2) and (255, 255, 255).
        let grid = Grid::interleaved(byte, Endian::Little, [2, 1, 1], 3);
        let data = [1, 2, 2, 255, 255, 255];
        assert_eq!(read(&grid, &data, Component::One(1)), [2.0, 255.0]);
        assert_eq!(read(&grid, &data, Component::Magnitude)[0], 3.0);
        assert_eq!(read(&grid, &data, Component::Luminance), [2.0, 255.0]);
        // The same in planes, and with z fastest.
        let grid = Grid { strides: [1, 2, 2], step: 2, ..grid };
        let data = [1, 255, 2, 255, 2, 255];
        assert_eq!(read(&grid, &data, Component::One(2)), [2.0, 255.0]);
        assert_eq!(read(&grid, &data, Component::Luminance), [2.0, 255.0]);
        let turned = Grid {
            dims: [2, 1, 3],
            strides: [3, 3, 1],
            ..Grid::interleaved(byte, Endian::Little, [1; 3], 1)
        };
        assert_eq!(
            read(&turned, &[0, 1, 2, 10, 11, 12], Component::One(0)),
            [0.0, 10.0, 1.0, 11.0, 2.0, 12.0]
        );
    }

    #[test]
    fn colors_of_any_type_become_bytes() {
        let lattice = || Lattice::with_spacing([2, 1, 1], glam::DVec3::ONE);
        let colors = |kind: SampleType, data: &[u8]| {
            let grid = Grid::interleaved(Element::Real(kind), Endian::Little, [2, 1, 1], 3);
            let options = ReadOptions::default();
            let read = |source: &Source| {
                grid.volume(source, lattice(), data.into(), Component::Color, &options)
            };
            with(read).unwrap().colors.unwrap().to_vec()
        };
        let expected = [[255, 51, 0, 255], [0, 0, 128, 255]];
        assert_eq!(colors(SampleType::U8, &[255, 51, 0, 0, 0, 128]), expected);
        let wide = |all: [u16; 6]| all.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        assert_eq!(colors(SampleType::U16, &wide([65535, 13107, 0, 0, 0, 32896])), expected);
        assert_eq!(colors(SampleType::U16, &wide([255, 51, 0, 0, 0, 128])), expected);
        let floats: Vec<u8> =
            [1.0f32, 0.2, 0.0, 0.0, 0.0, 0.5].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(colors(SampleType::F32, &floats), expected);
        // Small bytes are dark, not fractions.
        assert_eq!(colors(SampleType::U8, &[30, 0, 0, 0, 0, 30])[0], [30, 0, 0, 255]);
    }

    #[test]
    fn names_choose_components() {
        let choose = |name: Option<&str>, count, colors| {
            with(|source| Component::chosen(source, &ReadOptions::scalar(name), count, colors))
        };
        for (name, count, colors, expected) in [
            (None, 1, false, Component::One(0)),
            (None, 3, false, Component::Magnitude),
            (None, 3, true, Component::Color),
            (Some("rgb"), 3, false, Component::Color),
            (Some("luminance"), 3, true, Component::Luminance),
            (Some("value"), 3, false, Component::Magnitude),
            (Some("velocity:y"), 3, false, Component::One(1)),
            (Some("velocity:magnitude"), 2, true, Component::Magnitude),
            (Some("2"), 3, true, Component::One(2)),
            (Some("blue"), 3, true, Component::One(2)),
        ] {
            assert_eq!(choose(name, count, colors).unwrap(), expected, "{name:?}");
        }
        let error = choose(Some("pressure"), 3, false).unwrap_err().to_string();
        assert!(error.contains("“pressure”; each sample has 3 components"), "{error}");
        assert!(choose(Some("value:1"), 1, false).unwrap_err().to_string().contains("one value"));
    }
}
