//! The `.ksplat` files of mkkellogg's viewer (GaussianSplats3D): trained Gaussians in sections, at
//! one of three levels of compression. All numbers are little-endian.
//!
//! | part | bytes |
//! |---|---|
//! | header | 4096 |
//! | headers of the sections | 1024 each |
//! | a section: the lengths of its partial buckets | 4 each |
//! | a section: the centres of its buckets | 12 each |
//! | a section: the records of its Gaussians | 24 to 140 each |
//!
//! A record has the centre, the standard deviations, the quaternion with w first, red, green, blue
//! and the opacity, and the harmonics above the constant term. Level 0 has 32-bit floats. Levels 1
//! and 2 have 16-bit floats, and 16-bit steps from the centre of a bucket as positions. Level 2 has
//! bytes as harmonics. The harmonics are band by band, and by colours in each.
//!
//! The frame is that of the trainer's PLY. The files have no first bytes by which they are known.

mod layout;
#[cfg(test)]
mod tests;

use super::shared::trained::{Trained, settle};
use crate::{
    Result,
    gaussians::{
        Gaussians,
        harmonics::{constant_of, terms},
    },
    input::Source,
};
use glam::{DVec3, Quat, Vec3};
use half::f16;
use layout::{Header, Level, Section};

/// Reads the Gaussians of all sections, in their order. Those of sections with fewer harmonics get
/// zeros.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is cut off, for a version, level or degree
/// that the viewer does not write, and for counts and buckets that contradict each other.
/// [`Error::Limit`](crate::Error::Limit) for more Gaussians than the limits allow.
pub fn read(source: &Source) -> Result<Gaussians> {
    let header = Header::read(source)?;
    let sections = layout::sections(source, &header)?;
    let count = source.check_points("the number of Gaussians", header.count)?;
    let degree = sections.iter().map(|section| section.degree).max().unwrap_or_default();
    settle(source, count, degree, |index, colors| {
        // Sections without Gaussians start where the next one does.
        let at = sections.partition_point(|section| section.first <= index) - 1;
        Ok(gaussian(source, &header, &sections[at], index, colors))
    })
}

/// Returns a Gaussian of a section, and fills in the coefficients of its colour.
fn gaussian(
    source: &Source,
    header: &Header,
    section: &Section,
    index: usize,
    colors: &mut [[f32; 3]],
) -> Trained {
    let index = index - section.first;
    let record = section.record(source.bytes(), header.level, index);
    let (wide, rest) = record.split_at(10 * header.level.number());
    let number = |at: usize| header.level.float(wide, at);
    let center = match header.level {
        Level::Floats => DVec3::from_array([0, 1, 2].map(|at| number(at).into())),
        Level::Halves | Level::Bytes => {
            let steps = [0, 1, 2].map(|at| u16_at(wide, at).into());
            section.center(source.bytes(), index, DVec3::from_array(steps))
        }
    };
    let (color, rest) = rest.split_at(4);
    let channel = |at: usize| f32::from(color[at]) / 255.0;
    colors.fill([0.0; 3]);
    colors[0] = [0, 1, 2].map(|at| constant_of(channel(at)));
    fill_harmonics(header, section.degree, rest, &mut colors[1..]);
    Trained {
        center,
        scale: Vec3::new(number(3), number(4), number(5)),
        rotation: Quat::from_xyzw(number(7), number(8), number(9), number(6)),
        opacity: channel(3),
    }
}

/// Fills in the terms above the constant one. Each band has the terms of red, then those of green,
/// then those of blue.
fn fill_harmonics(header: &Header, degree: u32, record: &[u8], terms_out: &mut [[f32; 3]]) {
    let mut first = 0;
    for band in 1..=degree {
        let width = terms(band) - terms(band - 1);
        for (at, term) in terms_out[first..first + width].iter_mut().enumerate() {
            *term =
                [0, 1, 2].map(|channel| header.harmonic(record, 3 * first + channel * width + at));
        }
        first += width;
    }
}

/// Returns a number of 16 bits; 0 behind the end.
fn u16_at(bytes: &[u8], at: usize) -> u16 {
    bytes.as_chunks::<2>().0.get(at).copied().map_or(0, u16::from_le_bytes)
}

/// Returns a 16-bit float.
fn half_at(bytes: &[u8], at: usize) -> f32 {
    f16::from_bits(u16_at(bytes, at)).to_f32()
}

/// Returns a 32-bit float; 0 behind the end.
fn float_at(bytes: &[u8], at: usize) -> f32 {
    bytes.as_chunks::<4>().0.get(at).copied().map_or(0.0, f32::from_le_bytes)
}
