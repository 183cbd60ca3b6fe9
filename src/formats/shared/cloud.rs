//! Builds a mesh without triangles from the points of a file.

use super::{brightness::Brightness, unplaced};
use crate::{
    Result,
    about::About,
    input::{Source, positions},
    parallel::prelude::*,
    surface::{Mesh, Sensor},
};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Points as a reader finds them. All but the positions may be empty.
#[derive(Debug, Default)]
pub(crate) struct Cloud {
    pub positions: Vec<DVec3>,
    /// Normals of any length; zero if unusable.
    pub normals: Vec<Vec3>,
    pub colors: Vec<[u8; 4]>,
    /// The positions of scanners, in world coordinates, and the points that each has seen.
    pub sensors: Vec<(DVec3, Range<usize>)>,
    /// One value of each point; NaN where there is none.
    pub values: Vec<f32>,
    pub about: About,
}

impl Cloud {
    /// Chooses the origin and makes the mesh. Points that are not at finite coordinates are left
    /// out.
    pub fn into_mesh(self, source: &Source) -> Result<Mesh> {
        if self.positions.is_empty() {
            return Err(source.error("file", "contains no points"));
        }
        source.room::<Vec3>("the normals", self.normals.len())?;
        let (origin, positions) =
            positions::settle_some(source, self.positions.len(), |point| self.positions[point])?;
        let sensors = self
            .sensors
            .into_iter()
            .map(|(position, points)| Sensor { position: (position - origin).as_vec3(), points });
        let mut mesh = Mesh {
            origin,
            positions,
            normals: self.normals.into_par_iter().map(positions::unit).collect(),
            colors: self.colors,
            values: self.values,
            about: self.about,
            sensors: sensors.filter(|sensor| sensor.position.is_finite()).collect(),
            ..Mesh::default()
        };
        unplaced::leave_out(source, &mut mesh)?;
        Ok(mesh)
    }
}

/// Converts intensities to greys. The first percentile becomes black, the last white. Empty if all
/// intensities are the same or none is finite.
pub(crate) fn greys(intensities: &[f32]) -> Vec<[u8; 4]> {
    let mut sorted: Vec<f32> =
        intensities.par_iter().copied().filter(|value| value.is_finite()).collect();
    if sorted.is_empty() {
        return Vec::new();
    }
    let last = sorted.len() - 1;
    let mut at = |index: usize| *sorted.select_nth_unstable_by(index, f32::total_cmp).1;
    let (low, high) = (at(last / 100), at(last - last / 100));
    if low >= high {
        return Vec::new();
    }
    intensities.par_iter().map(|&value| grey(value, low, high)).collect()
}

/// Returns the grey of an intensity: black at `low`, white at `high`.
pub(crate) fn grey(value: f32, low: f32, high: f32) -> [u8; 4] {
    let grey = ((value - low) / (high - low) * 255.0).round() as u8;
    [grey, grey, grey, 255]
}

/// Converts 16-bit colours to bytes. Some writers store bytes in the 16 bits; then hardly any value
/// exceeds 255 ([`Brightness`]). Empty if all are black, as in files without colours.
pub(crate) fn colors_of_16_bits(colors: &[[u16; 3]]) -> Vec<[u8; 4]> {
    let of_chunk = |colors: &[[u16; 3]]| {
        let mut seen = Brightness::default();
        colors.iter().for_each(|color| seen.add(f64::from(color[0].max(color[1]).max(color[2]))));
        seen
    };
    let seen = colors.par_chunks(1 << 14).map(of_chunk);
    let largest = seen.reduce(Brightness::default, Brightness::with).largest() as u16;
    if largest == 0 {
        return Vec::new();
    }
    colors.par_iter().map(|&color| color_of_16_bits(color, largest)).collect()
}

/// Converts one 16-bit colour, given the largest value of nearly all colours. Some programs shift
/// bytes to 16 bits: 65280 is white then.
pub(crate) fn color_of_16_bits(color: [u16; 3], largest: u16) -> [u8; 4] {
    let is_shifted = color.iter().all(|value| value & 255 == 0);
    let byte = |value: u16| {
        if largest > 255 && is_shifted {
            (value >> 8) as u8
        } else if largest > 255 {
            ((u32::from(value) * 255 + 32767) / 65535) as u8
        } else {
            value.min(255) as u8
        }
    };
    let [r, g, b] = color.map(byte);
    [r, g, b, 255]
}

/// Converts rows of colours: three numbers, and a fourth one for the opacity if there are more.
/// Colours are fractions if none is above 1, 16-bit numbers if one is above 255, and bytes
/// otherwise.
pub(crate) fn colors_of_numbers(numbers: &[f64], width: usize) -> Vec<[u8; 4]> {
    let largest = numbers.iter().copied().fold(0.0, f64::max);
    let scale = match largest {
        _ if largest > 255.0 => 255.0 / 65535.0,
        _ if largest > 1.0 => 1.0,
        _ => 255.0,
    };
    let byte = |number: f64| (number * scale).round() as u8;
    let color = |row: &[f64]| {
        [byte(row[0]), byte(row[1]), byte(row[2]), row.get(3).map_or(255, |&alpha| byte(alpha))]
    };
    numbers.chunks_exact(width).map(color).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greys_span_the_usual_intensities() {
        let mut values: Vec<f32> = (0..=1000).map(|i| 100.0 + i as f32).collect();
        values.extend([1e9, f32::NAN]);
        let greys = greys(&values);
        assert_eq!((greys[0], greys[1000], greys[1001]), ([0, 0, 0, 255], [255; 4], [255; 4]));
        assert!((126..=129).contains(&greys[500][0]));
        assert!(super::greys(&[7.0; 9]).is_empty() && super::greys(&[]).is_empty());
    }

    #[test]
    fn colors_of_16_bits_may_be_bytes() {
        assert_eq!(colors_of_16_bits(&[[0, 128, 255]]), [[0, 128, 255, 255]]);
        assert_eq!(
            colors_of_16_bits(&[[0, 0x8080, 0xffff], [255, 256, 0]]),
            [[0, 128, 255, 255], [1, 1, 0, 255]]
        );
        // Bytes times 257 and bytes times 256 are exact.
        for factor in [257, 256] {
            let bytes = [[0, 128, 255], [254, 200, 129]];
            let wide = bytes.map(|color| color.map(|byte| factor * byte));
            assert_eq!(
                colors_of_16_bits(&wide),
                bytes.map(|[r, g, b]| [r as u8, g as u8, b as u8, 255])
            );
        }
        assert!(colors_of_16_bits(&[[0; 3]; 4]).is_empty());
        let mut colors = vec![[0, 128, 255]; 500];
        colors.push([9, 9, 40_000]);
        let converted = colors_of_16_bits(&colors);
        assert_eq!((converted[0], converted[500]), ([0, 128, 255, 255], [9, 9, 255, 255]));
    }
}
