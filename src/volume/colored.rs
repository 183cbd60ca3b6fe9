//! Volumes in colours: each sample that is seen becomes a splat of its own colour.
//!
//! Colours are not interpolated before they are classified, so every voxel keeps its hue. A file
//! says how opaque its samples are (alpha), or the distance from the colour of the background does.

use super::{Samples, TransferFunction, Volume};
use crate::{
    Result, memory,
    parallel::prelude::*,
    splat::{NO_NORMAL, Splat, Surfels, encode_normal},
};
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// Standard deviation of the splats, in steps of the lattice: that of the default kernel.
const DEVIATION: f64 = 0.6;

/// Footprints end this many standard deviations from the centre.
const EXTENT: f32 = 3.0;

/// Samples that cover less than this are not drawn.
const LEAST_OPACITY: f64 = 0.002;

/// The opacity of an opaque sample. Behind it nothing is seen.
const MOST_OPACITY: f64 = 0.999;

/// The opacity must rise by this much over a step, or the sample has no normal. What is flat is not
/// lit, and shows its colour as it is.
const EDGE: f64 = 0.1;

/// Colours whose channels differ by no more than this are alike.
const ALIKE: u8 = 24;

/// How opaque a sample of each density is over one step of the lattice.
type Opacities = [f64; 256];

impl Volume {
    /// Returns splats that show a volume in its own colours ([`Volume::colors`]); `None` if it has
    /// none.
    ///
    /// Opacities are those of the colours if one is below 255. Otherwise the density of a sample is
    /// the largest difference of its channels from the background: the colour that most of the
    /// samples on the volume's faces are like, or black. The density becomes opacity as the values
    /// of a volume do ([`TransferFunction::automatic`]).
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) if there is too little for the splats.
    pub fn colored_splats(&self) -> Result<Option<Surfels>> {
        let Some(colors) = self.colors.as_deref().filter(|all| all.len() == self.len()) else {
            return Ok(None);
        };
        memory::room("making splats of colours", colors.len() as u64)?;
        let step = self.lattice.kernel_spacing();
        let (densities, opacities) = if colors.par_iter().any(|color| color[3] < 255) {
            let opacity = |alpha: usize| alpha as f64 / 255.0;
            (colors.par_iter().map(|color| color[3]).collect(), std::array::from_fn(opacity))
        } else {
            self.apart(colors, step)
        };
        let is_seen = |&index: &usize| opacities[usize::from(densities[index])] > LEAST_OPACITY;
        let count = (0..colors.len()).into_par_iter().filter(is_seen).count();
        memory::room("making splats of colours", (count * size_of::<Splat>()) as u64)?;
        let origin = self.bounds().center();
        let splat = |index: usize| {
            let opacity = opacities[usize::from(densities[index])].min(MOST_OPACITY);
            // Kernels of neighbours overlap, and together are as deep as the sample's step.
            let depth = -(1.0 - opacity).ln() / (TAU * DEVIATION * DEVIATION);
            let at = self.lattice.index(index);
            let shape = self.lattice.axes * DMat3::from_diagonal(self.lattice.unit(at) * DEVIATION);
            let [red, green, blue, _] = colors[index];
            Splat {
                center: (self.lattice.sample_position(index) - origin).as_vec3().to_array(),
                strength: depth as f32,
                factor: lower(shape).map(|term| term as f32),
                color: u32::from_le_bytes([red, green, blue, 255]),
                normal: self.outward(at, &densities, &opacities),
            }
        };
        let seen = (0..colors.len()).into_par_iter().filter(is_seen);
        let splats = seen.map(splat).collect();
        Ok(Some(Surfels { origin, splats, extent: EXTENT }))
    }

    /// Returns how far each colour is from the background, and how opaque that is.
    fn apart(&self, colors: &[[u8; 4]], step: f64) -> (Vec<u8>, Opacities) {
        let background = self.background(colors);
        let apart = |color: &[u8; 4]| distance(color, &background);
        let densities: Vec<u8> = colors.par_iter().map(apart).collect();
        let field = Self::new(self.lattice.clone(), Samples::U8(densities.clone()));
        let opacities = match field {
            Ok(field) if field.range[0] < field.range[1] => {
                let transfer = TransferFunction::automatic(&field);
                std::array::from_fn(|density| {
                    1.0 - (-transfer.extinction(density as f64) * step).exp()
                })
            }
            // One colour everywhere, or one that is as bright.
            _ => [1.0; 256],
        };
        (densities, opacities)
    }

    /// Returns the colour that most of the samples on the faces are like; black if there is none.
    fn background(&self, colors: &[[u8; 4]]) -> [u8; 4] {
        let dims = self.lattice.dims;
        let is_outside = |&index: &usize| {
            let at = self.lattice.index(index);
            (0..3).any(|axis| dims[axis] > 2 && (at[axis] == 0 || at[axis] + 1 == dims[axis]))
        };
        let outside: Vec<usize> = (0..colors.len()).into_par_iter().filter(is_outside).collect();
        if outside.is_empty() {
            return [0, 0, 0, 255];
        }
        let median = |channel: usize| {
            let mut counts = [0usize; 256];
            outside.iter().for_each(|&index| counts[usize::from(colors[index][channel])] += 1);
            let mut below = 0;
            let at = counts.iter().position(|count| {
                below += count;
                2 * below >= outside.len()
            });
            at.unwrap_or(0) as u8
        };
        let color = [median(0), median(1), median(2), 255];
        let alike = outside.iter().filter(|&&index| distance(&colors[index], &color) <= ALIKE);
        if 2 * alike.count() > outside.len() { color } else { [0, 0, 0, 255] }
    }

    /// Returns the packed normal of a sample: the direction in which the opacity falls.
    fn outward(&self, at: [usize; 3], densities: &[u8], opacities: &Opacities) -> u32 {
        let [nx, ny, nz] = self.lattice.dims.map(|n| n as isize);
        let opacity = |offset: [isize; 3]| {
            let [x, y, z] = std::array::from_fn(|axis| at[axis] as isize + offset[axis]);
            let is_inside = (0..nx).contains(&x) && (0..ny).contains(&y) && (0..nz).contains(&z);
            if !is_inside {
                return 0.0;
            }
            opacities[usize::from(densities[((z * ny + y) * nx + x) as usize])]
        };
        // Differences across each axis, the mean of nine lines.
        let mut rise = DVec3::ZERO;
        for axis in 0..3 {
            for (a, b) in (-1isize..=1).flat_map(|a| (-1isize..=1).map(move |b| (a, b))) {
                let weight = ((2 - a.abs()) * (2 - b.abs())) as f64 / 16.0;
                let mut offset = [0; 3];
                (offset[(axis + 1) % 3], offset[(axis + 2) % 3]) = (a, b);
                offset[axis] = 1;
                rise[axis] += weight * opacity(offset);
                offset[axis] = -1;
                rise[axis] -= weight * opacity(offset);
            }
        }
        if 0.5 * rise.length() < EDGE {
            return NO_NORMAL;
        }
        let axes = self.lattice.axes * DMat3::from_diagonal(self.lattice.unit(at));
        let outward = -(axes.inverse().transpose() * rise);
        outward.try_normalize().map_or(NO_NORMAL, |normal| encode_normal(normal.as_vec3()))
    }
}

/// Returns the largest difference of two colours' channels.
fn distance(a: &[u8; 4], b: &[u8; 4]) -> u8 {
    (0..3).map(|channel| a[channel].abs_diff(b[channel])).max().unwrap_or(0)
}

/// Returns the lower triangular B with B·Bᵀ = A·Aᵀ, row by row.
fn lower(a: DMat3) -> [f64; 6] {
    let [first, second, third] = [a.row(0), a.row(1), a.row(2)];
    let x = first.normalize_or_zero();
    let y = (second - second.dot(x) * x).normalize_or_zero();
    let z = third - third.dot(x) * x - third.dot(y) * y;
    [first.dot(x), second.dot(x), second.dot(y), third.dot(x), third.dot(y), z.length()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{splat::decode_normal, volume::Lattice};

    /// A cube of a colour in the middle of another.
    fn cube(inside: [u8; 4], outside: [u8; 4]) -> Volume {
        let lattice = Lattice::with_spacing([9; 3], DVec3::new(1.0, 1.0, 2.0));
        let is_inside = |index: usize| lattice.index(index).iter().all(|at| (3..6).contains(at));
        let colors: Vec<[u8; 4]> =
            (0..729).map(|index| if is_inside(index) { inside } else { outside }).collect();
        let samples = Samples::U8(colors.iter().map(|color| color[0]).collect());
        Volume { colors: Some(colors.into()), ..Volume::new(lattice, samples).unwrap() }
    }

    #[test]
    fn samples_keep_their_colours_and_the_background_vanishes() {
        for (inside, outside) in [
            ([200, 40, 40, 255], [0, 0, 0, 255]),
            ([0, 0, 90, 255], [0, 0, 0, 255]),
            ([120, 60, 120, 255], [245, 245, 240, 255]),
            ([30, 200, 30, 255], [10, 20, 255, 0]),
        ] {
            let set = cube(inside, outside).colored_splats().unwrap().unwrap();
            assert_eq!(set.splats.len(), 27, "{inside:?} on {outside:?}");
            let [red, green, blue, _] = inside;
            let color = u32::from_le_bytes([red, green, blue, 255]);
            assert!(set.splats.iter().all(|splat| splat.color == color));
            // The cube's corners point outward, and its middle nowhere.
            let corner = decode_normal(set.splats[0].normal).unwrap();
            assert!(corner.max_element() < 0.0, "{corner}");
            assert_eq!(set.splats[13].normal, NO_NORMAL);
        }
    }

    #[test]
    fn alpha_is_what_a_step_covers() {
        let volume = cube([9, 9, 9, 128], [9, 9, 9, 0]);
        let set = volume.colored_splats().unwrap().unwrap();
        // Neighbours one step apart in a plane across the ray.
        let kernel = |x: f64, y: f64| (-(x * x + y * y) / (2.0 * DEVIATION * DEVIATION)).exp();
        let near = (-3..=3).flat_map(|x| (-3..=3).map(move |y| kernel(x.into(), y.into())));
        let depth = f64::from(set.splats[0].strength) * near.sum::<f64>();
        assert!((1.0 - (-depth).exp() - 128.0 / 255.0).abs() < 0.01, "{depth}");
    }

    #[test]
    fn volumes_of_one_colour_are_opaque() {
        let set = cube([7, 7, 7, 255], [7, 7, 7, 255]).colored_splats().unwrap().unwrap();
        assert_eq!(set.splats.len(), 729);
        let plain = Volume { colors: None, ..cube([7; 4], [7; 4]) };
        assert!(plain.colored_splats().unwrap().is_none());
    }

    #[test]
    fn factors_span_the_cell() {
        let a = DMat3::from_cols(
            DVec3::new(1.0, 0.2, 0.0),
            DVec3::new(-0.5, 2.0, 0.1),
            DVec3::new(0.0, 0.3, 3.0),
        );
        let [b00, b10, b11, b20, b21, b22] = lower(a);
        let b = DMat3::from_cols(
            DVec3::new(b00, b10, b20),
            DVec3::new(0.0, b11, b21),
            DVec3::new(0.0, 0.0, b22),
        );
        assert!((b * b.transpose()).abs_diff_eq(a * a.transpose(), 1e-12));
    }
}
