//! Values quantised to steps of 1/255 of a volume's range: a pair of bytes that bounds them.

use super::Scalar;
use bytemuck::AnyBitPattern;

/// Turns a sample into two bytes: the steps that fit below it, and 255 minus the steps that cover
/// it. One minimum of bytes then gives both the smallest and the largest of many samples. Types of
/// 8 and 16 bits use a look-up table.
pub struct Steps {
    scalar: Scalar,
    low: f64,
    /// Steps per unit of value.
    scale: f64,
    /// The result for every value of a type of 8 or 16 bits, indexed by its bits.
    table: Vec<[u8; 2]>,
}

impl Steps {
    /// Steps for a range (smallest and largest value).
    pub fn new(scalar: Scalar, [low, high]: [f64; 2]) -> Self {
        let scale = if high > low { 255.0 / (high - low) } else { 0.0 };
        let mut steps = Self { scalar, low, scale, table: Vec::new() };
        steps.table = match scalar {
            Scalar::U8 => (0..=u8::MAX).map(|bits| steps.step(bits.into())).collect(),
            Scalar::U16 => (0..=u16::MAX).map(|bits| steps.step(bits.into())).collect(),
            Scalar::I16 => (0..=u16::MAX).map(|bits| steps.step((bits as i16).into())).collect(),
            Scalar::I32 | Scalar::F32 => Vec::new(),
        };
        steps
    }

    fn step(&self, value: f64) -> [u8; 2] {
        let step = (value - self.low) * self.scale;
        // Casts clamp to 0 … 255.
        let below = step as u8;
        let above = below.saturating_add(u8::from(f64::from(below) < step));
        [below, 255 - above]
    }

    /// Returns the bytes of `samples` from sample number `first` on.
    pub fn from<'a>(&self, samples: &'a [u8], first: usize) -> &'a [u8] {
        &samples[first * self.scalar.bytes()..]
    }

    /// Writes the steps of samples, given by their bytes, until `out` is full.
    pub fn write(&self, samples: &[u8], out: &mut [[u8; 2]]) {
        fn each<T: AnyBitPattern>(
            samples: &[u8],
            out: &mut [[u8; 2]],
            step: impl Fn(T) -> [u8; 2],
        ) {
            let samples = samples.chunks_exact(size_of::<T>());
            out.iter_mut()
                .zip(samples)
                .for_each(|(out, bytes)| *out = step(bytemuck::pod_read_unaligned(bytes)));
        }
        let table = &self.table;
        match self.scalar {
            Scalar::U8 => each(samples, out, |v: u8| table[usize::from(v)]),
            Scalar::U16 | Scalar::I16 => each(samples, out, |bits: u16| table[usize::from(bits)]),
            Scalar::I32 => each(samples, out, |v: i32| self.step(v.into())),
            Scalar::F32 => each(samples, out, |v: f32| self.step(v.into())),
        }
    }
}
