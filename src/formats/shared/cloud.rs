//! Builds a mesh without triangles from the points of a file.

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
    /// Chooses the origin and makes the mesh. `place` names a point in an error.
    pub fn into_mesh(self, source: &Source, place: impl Fn(usize) -> String) -> Result<Mesh> {
        if self.positions.is_empty() {
            return Err(source.error("file", "contains no points"));
        }
        source.room::<Vec3>("the normals", self.normals.len())?;
        let (origin, positions) =
            positions::settle(source, self.positions.len(), |point| self.positions[point], place)?;
        let sensors = self
            .sensors
            .into_iter()
            .map(|(position, points)| Sensor { position: (position - origin).as_vec3(), points });
        Ok(Mesh {
            origin,
            positions,
            normals: self.normals.into_par_iter().map(positions::unit).collect(),
            colors: self.colors,
            values: self.values,
            about: self.about,
            sensors: sensors.filter(|sensor| sensor.position.is_finite()).collect(),
            ..Mesh::default()
        })
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

/// Converts 16-bit colours to bytes. Some writers store bytes in the 16 bits; then no value exceeds
/// 255. Empty if all are black, as in files without colours.
pub(crate) fn colors_of_16_bits(colors: &[[u16; 3]]) -> Vec<[u8; 4]> {
    let largest =
        colors.par_iter().map(|color| color.iter().copied().max().unwrap_or(0)).max().unwrap_or(0);
    if largest == 0 {
        return Vec::new();
    }
    colors.par_iter().map(|&color| color_of_16_bits(color, largest)).collect()
}

/// Converts one 16-bit colour, given the largest value of all colours.
pub(crate) fn color_of_16_bits(color: [u16; 3], largest: u16) -> [u8; 4] {
    let byte = |value: u16| {
        if largest > 255 { ((u32::from(value) * 255 + 32767) / 65535) as u8 } else { value as u8 }
    };
    let [r, g, b] = color.map(byte);
    [r, g, b, 255]
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
        assert!(colors_of_16_bits(&[[0; 3]; 4]).is_empty());
    }
}
