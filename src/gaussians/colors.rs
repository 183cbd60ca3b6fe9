//! The colours of Gaussians, compact: as hierarchies keep them in memory and in files.

use super::harmonics::{self, MOST_TERMS, terms};
use glam::Vec3;
use std::ops::Range;

/// The step of the constant terms. 16 bits hold colours from −4 to 5 and more.
const CONSTANT_STEP: f32 = 1.0 / 2048.0;

/// The largest step of the other terms. It keeps a few large terms from making all others coarse.
const MOST_STEP: f32 = 1.0 / 64.0;

/// The largest number of steps of the other terms.
const MOST_STEPS: f32 = 127.0;

/// Spherical harmonics of several Gaussians.
#[derive(Debug, Clone, PartialEq)]
pub struct Colors {
    degree: u32,
    values: Values,
}

#[derive(Debug, Clone, PartialEq)]
enum Values {
    /// Every bit, [`terms`] a Gaussian.
    Exact(Vec<[f32; 3]>),
    /// As numbers of steps.
    Coded {
        /// The step of the terms of each degree from 1 on.
        steps: [f32; 3],
        constants: Vec<[i16; 3]>,
        /// The other terms, those of a Gaussian together.
        others: Vec<[i8; 3]>,
    },
}

impl Colors {
    /// Keeps every bit of harmonics: for each Gaussian its [`terms`].
    pub fn exact(degree: u32, harmonics: Vec<[f32; 3]>) -> Self {
        Self { degree, values: Values::Exact(harmonics) }
    }

    /// Keeps constant terms in steps of 1/2048, and the others in 8 bits. Their step is 1/127 of
    /// the largest one of their degree, but at most 1/64, so that they end at ±1.98.
    pub fn coded(degree: u32, harmonics: &[[f32; 3]]) -> Self {
        let count = terms(degree);
        let mut most = [0f32; 3];
        for coefficients in harmonics.chunks_exact(count) {
            for (term, parts) in coefficients.iter().enumerate().skip(1) {
                let most = &mut most[degree_of_term(term) - 1];
                *most = parts.iter().fold(*most, |most, part| most.max(part.abs()));
            }
        }
        let steps = most.map(|most| (most / MOST_STEPS).min(MOST_STEP));
        let constant = |part: f32| (part / CONSTANT_STEP).round().clamp(-32767.0, 32767.0) as i16;
        let other = |term: usize, part: f32| {
            let step = steps[degree_of_term(term) - 1].max(f32::MIN_POSITIVE);
            (part / step).round().clamp(-MOST_STEPS, MOST_STEPS) as i8
        };
        let each = || harmonics.chunks_exact(count);
        let constants = each().map(|terms| terms[0].map(constant)).collect();
        let others = each().flat_map(|terms| {
            terms.iter().enumerate().skip(1).map(|(term, parts)| parts.map(|v| other(term, v)))
        });
        let others = others.collect();
        Self { degree, values: Values::Coded { steps, constants, others } }
    }

    /// Returns the degree of the harmonics.
    pub fn degree(&self) -> u32 {
        self.degree
    }

    /// Returns the number of Gaussians.
    pub fn len(&self) -> usize {
        match &self.values {
            Values::Exact(harmonics) => harmonics.len() / terms(self.degree),
            Values::Coded { constants, .. } => constants.len(),
        }
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the bytes of memory of the colours of a number of Gaussians.
    pub fn bytes_of(degree: u32, count: usize) -> u64 {
        (count * (6 + 3 * (terms(degree) - 1))) as u64
    }

    /// Returns the harmonics of one Gaussian; the terms above the degree are 0.
    pub fn harmonics(&self, index: usize) -> [[f32; 3]; MOST_TERMS] {
        let (count, mut values) = (terms(self.degree), [[0.0; 3]; MOST_TERMS]);
        match &self.values {
            Values::Exact(harmonics) => {
                values[..count].copy_from_slice(&harmonics[index * count..][..count]);
            }
            Values::Coded { steps, constants, others } => {
                values[0] = constants[index].map(|part| f32::from(part) * CONSTANT_STEP);
                let coded = &others[index * (count - 1)..][..count - 1];
                for (term, (value, parts)) in (1..).zip(values[1..].iter_mut().zip(coded)) {
                    *value = parts.map(|part| f32::from(part) * steps[degree_of_term(term) - 1]);
                }
            }
        }
        values
    }

    /// Returns the colour of one Gaussian that is seen along a direction of unit length.
    pub fn seen(&self, index: usize, direction: Vec3) -> [f32; 3] {
        harmonics::color(self.degree, &self.harmonics(index)[..terms(self.degree)], direction)
    }

    /// Returns the colours of some of the Gaussians, in this order.
    pub fn chosen(&self, order: impl Iterator<Item = usize> + Clone) -> Self {
        let count = terms(self.degree);
        fn pick<T: Copy>(all: &[T], each: usize, order: impl Iterator<Item = usize>) -> Vec<T> {
            order.flat_map(|index| all[index * each..][..each].iter().copied()).collect()
        }
        let values = match &self.values {
            Values::Exact(harmonics) => Values::Exact(pick(harmonics, count, order)),
            Values::Coded { steps, constants, others } => Values::Coded {
                steps: *steps,
                constants: pick(constants, 1, order.clone()),
                others: pick(others, count - 1, order),
            },
        };
        Self { degree: self.degree, values }
    }

    /// Returns the colours of all parts, one after another. Those of different steps keep the bits
    /// of their values. All have one degree.
    pub(crate) fn joined(parts: &[Self]) -> Self {
        let degree = parts.first().map_or(0, |part| part.degree);
        let steps_of = |part: &Self| match &part.values {
            Values::Coded { steps, .. } => Some(*steps),
            Values::Exact(_) => None,
        };
        let common = parts.first().and_then(steps_of);
        let is_common = common.is_some() && parts.iter().all(|part| steps_of(part) == common);
        if let (Some(steps), true) = (common, is_common) {
            let (mut all_constants, mut all_others) = (Vec::new(), Vec::new());
            for part in parts {
                if let Values::Coded { constants, others, .. } = &part.values {
                    all_constants.extend_from_slice(constants);
                    all_others.extend_from_slice(others);
                }
            }
            let (constants, others) = (all_constants, all_others);
            return Self { degree, values: Values::Coded { steps, constants, others } };
        }
        let count = terms(degree);
        let of_part = |part: &Self| -> Vec<[f32; 3]> {
            (0..part.len())
                .flat_map(|index| part.harmonics(index).into_iter().take(count))
                .collect()
        };
        Self::exact(degree, parts.iter().flat_map(of_part).collect())
    }

    /// Returns the colours of a range of the Gaussians as bytes: the values one after another, each
    /// for all Gaussians, byte by byte, from the lowest byte on.
    pub fn to_bytes(&self, range: Range<usize>) -> Vec<u8> {
        let count = terms(self.degree);
        let mut out = vec![u8::from(matches!(self.values, Values::Coded { .. }))];
        match &self.values {
            Values::Exact(harmonics) => {
                let part = &harmonics[range.start * count..range.end * count];
                planes(part.as_flattened(), 3 * count, f32::to_le_bytes, &mut out);
            }
            Values::Coded { steps, constants, others } => {
                out.extend(steps.map(f32::to_le_bytes).as_flattened());
                let part = constants[range.clone()].as_flattened();
                planes(part, 3, i16::to_le_bytes, &mut out);
                let part = &others[range.start * (count - 1)..range.end * (count - 1)];
                planes(part.as_flattened(), 3 * (count - 1), i8::to_le_bytes, &mut out);
            }
        }
        out
    }

    /// Returns the most bytes that [`to_bytes`](Self::to_bytes) makes of a number of Gaussians.
    pub fn most_bytes(degree: u32, count: usize) -> usize {
        1 + 12 + 12 * terms(degree) * count
    }

    /// Reads what [`to_bytes`](Self::to_bytes) has written of `count` Gaussians.
    ///
    /// # Errors
    /// A message that says what is wrong with the bytes.
    pub fn from_bytes(bytes: &[u8], degree: u32, count: usize) -> Result<Self, String> {
        let (&kind, rest) = bytes.split_first().ok_or("the colours are empty")?;
        let each = terms(degree);
        let wanted = match kind {
            0 => 12 * each * count,
            1 => 12 + 3 * (each + 1) * count,
            other => return Err(format!("the colours have the unknown code {other}")),
        };
        if rest.len() != wanted {
            return Err(format!("the colours have {} bytes, not {wanted}", rest.len()));
        }
        if kind == 0 {
            let values = joined(rest, 3 * each, count, f32::from_le_bytes);
            if !values.iter().all(|value| value.is_finite()) {
                return Err("a colour is not finite".into());
            }
            return Ok(Self::exact(degree, values.as_chunks().0.to_vec()));
        }
        let (head, rest) = rest.split_at(12);
        let steps = [0, 1, 2].map(|at| {
            let bytes = [head[4 * at], head[4 * at + 1], head[4 * at + 2], head[4 * at + 3]];
            f32::from_le_bytes(bytes)
        });
        if !steps.iter().all(|step| (0.0..=MOST_STEP).contains(step)) {
            return Err(format!("the steps of colours are {steps:?}"));
        }
        let (constants, others) = rest.split_at(6 * count);
        let constants = joined(constants, 3, count, i16::from_le_bytes);
        let others = joined(others, 3 * (each - 1), count, i8::from_le_bytes);
        let values = Values::Coded {
            steps,
            constants: constants.as_chunks().0.to_vec(),
            others: others.as_chunks().0.to_vec(),
        };
        Ok(Self { degree, values })
    }
}

/// Returns the degree that a term belongs to.
fn degree_of_term(term: usize) -> usize {
    match term {
        0 => 0,
        1..4 => 1,
        4..9 => 2,
        _ => 3,
    }
}

/// Appends numbers, `each` of them a Gaussian, plane by plane: byte 0 of the first number of all
/// Gaussians, then its byte 1, and so on.
fn planes<T: Copy, const N: usize>(
    values: &[T],
    each: usize,
    bytes: impl Fn(T) -> [u8; N],
    out: &mut Vec<u8>,
) {
    for number in 0..each {
        for byte in 0..N {
            out.extend(values.iter().skip(number).step_by(each).map(|value| bytes(*value)[byte]));
        }
    }
}

/// The inverse of [`planes`].
fn joined<T, const N: usize>(
    bytes: &[u8],
    each: usize,
    count: usize,
    value: impl Fn([u8; N]) -> T,
) -> Vec<T> {
    let one = |at: usize| {
        let (index, number) = (at / each, at % each);
        value(std::array::from_fn(|byte| bytes[(number * N + byte) * count + index]))
    };
    (0..each * count).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(degree: u32, count: usize) -> Vec<[f32; 3]> {
        (0..count * terms(degree))
            .map(|i| [0, 1, 2].map(|c| ((i * 37 + c * 11) % 101) as f32 * 0.015 - 0.75))
            .collect()
    }

    #[test]
    fn colours_keep_their_precision_and_survive_bytes() {
        for degree in 0..=3 {
            let (count, given) = (terms(degree), some(degree, 9));
            for colors in [Colors::exact(degree, given.clone()), Colors::coded(degree, &given)] {
                assert_eq!((colors.len(), colors.degree()), (9, degree));
                for (index, given) in given.chunks_exact(count).enumerate() {
                    let harmonics = colors.harmonics(index);
                    for (term, given) in harmonics[..count].iter().zip(given) {
                        for (actual, given) in term.iter().zip(given) {
                            assert!((actual - given).abs() < 0.004, "{actual} {given}");
                        }
                    }
                    assert!(harmonics[count..].as_flattened().iter().all(|v| *v == 0.0));
                }
                let part = colors.chosen((3..8).rev());
                assert_eq!(part.harmonics(0), colors.harmonics(7));
                let bytes = colors.to_bytes(2..7);
                assert!(bytes.len() <= Colors::most_bytes(degree, 5));
                let again = Colors::from_bytes(&bytes, degree, 5).unwrap();
                assert_eq!(again, colors.chosen(2..7));
                for end in 0..bytes.len() {
                    assert!(Colors::from_bytes(&bytes[..end], degree, 5).is_err());
                }
            }
        }
    }

    #[test]
    fn a_few_large_terms_do_not_make_others_coarse() {
        let mut given = some(1, 50);
        given[1] = [40.0, 0.0, 0.0];
        let colors = Colors::coded(1, &given);
        assert!((colors.harmonics(0)[1][0] - 127.0 / 64.0).abs() < 1e-6);
        assert!((colors.harmonics(1)[1][0] - given[5][0]).abs() <= 0.5 / 64.0);
    }

    #[test]
    fn wrong_bytes_are_told() {
        assert!(Colors::from_bytes(&[2], 0, 0).unwrap_err().contains("unknown code 2"));
        let mut bytes = Colors::coded(0, &[[0.0; 3]]).to_bytes(0..1);
        bytes[1..5].copy_from_slice(&1f32.to_le_bytes());
        assert!(Colors::from_bytes(&bytes, 0, 1).unwrap_err().contains("steps"));
        let mut bytes = Colors::exact(0, vec![[0.0; 3]]).to_bytes(0..1);
        bytes[1..].fill(255);
        assert!(Colors::from_bytes(&bytes, 0, 1).unwrap_err().contains("not finite"));
    }
}
