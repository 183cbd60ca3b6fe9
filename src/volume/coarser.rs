//! Fewer samples: each is the mean of its cell, over which the fine samples are interpolated
//! linearly.

use super::{Arrangement, Lattice, Samples, Scalar, Volume, each_type};
use crate::{Error, Result, parallel::prelude::*};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// How often the spacing of the coarser lattice is halved in.
const STEPS: usize = 60;

/// The samples along an axis that make one coarser sample, and their weights, whose sum is 1.
struct Cell {
    first: usize,
    weights: Vec<f64>,
}

/// What a sample is made of.
struct Coarsening {
    dims: [usize; 3],
    /// The cells along each axis.
    cells: [Vec<Cell>; 3],
    /// Whether a sample is the one in the middle of its cell: labels have no means.
    takes_one: bool,
}

impl Volume {
    /// Returns the volume with about this share of its samples, above 0. Finely sampled axes lose
    /// samples first. A sample is the mean of its cell, or of labels the one in the middle.
    /// Colours are weighted by their opacities. Body-centred lattices stay as they are.
    ///
    /// # Errors
    /// [`Error::Argument`] for another share, and for a volume that was built by hand and
    /// contradicts itself.
    pub fn coarser(&self, share: f64) -> Result<Self> {
        self.validate().map_err(Error::Argument)?;
        if !(share > 0.0 && share.is_finite()) {
            return Err(Error::Argument(format!("{share} is no share above 0 of a volume")));
        }
        let lattice = &self.lattice;
        let dims = fewer(lattice, share);
        if lattice.arrangement == Arrangement::BodyCentred || dims == lattice.dims {
            return Ok(self.clone());
        }
        let coarsening = Coarsening {
            dims: lattice.dims,
            cells: [0, 1, 2].map(|axis| cells(lattice.dims[axis], dims[axis])),
            takes_one: self.is_label_map(),
        };
        self.coarsened(&coarsening, &coarsening.lattice(lattice))
    }

    fn coarsened(&self, by: &Coarsening, lattice: &Lattice) -> Result<Self> {
        let mut coarse = Self::new(lattice.clone(), by.samples(&self.samples))?;
        coarse.colors = self.colors.as_ref().map(|colors| by.colors(colors).into());
        coarse.more_channels = self
            .more_channels
            .iter()
            .map(|channel| channel.coarsened(by, lattice))
            .collect::<Result<_>>()?;
        let opacities = self.opacities.as_ref().map(|volume| volume.coarsened(by, lattice));
        coarse.opacities = opacities.transpose()?.map(Arc::new);
        coarse.about = self.about.clone();
        Ok(coarse)
    }
}

/// Returns the numbers of samples along the axes of a lattice of about this share: one spacing for
/// all axes, but no finer than each is.
fn fewer(lattice: &Lattice, share: f64) -> [usize; 3] {
    let steps = lattice.spacing().to_array();
    let dims_of = |spacing: f64| {
        [0, 1, 2].map(|axis| {
            let all = lattice.dims[axis];
            let count = (all as f64 * steps[axis] / spacing).round();
            (count.max(1.0) as usize).min(all)
        })
    };
    let count = |dims: [usize; 3]| dims.iter().product::<usize>() as f64;
    let wanted = share * lattice.len() as f64;
    let longest = (0..3).map(|axis| lattice.dims[axis] as f64 * steps[axis]).fold(0.0, f64::max);
    let (mut fine, mut wide) = (steps.iter().copied().fold(f64::INFINITY, f64::min), longest);
    for _ in 0..STEPS {
        let middle = (fine * wide).sqrt();
        match count(dims_of(middle)) > wanted {
            true => fine = middle,
            false => wide = middle,
        }
    }
    if share >= 1.0 { lattice.dims } else { dims_of(wide) }
}

/// Divides the samples along an axis into cells of equal width.
fn cells(all: usize, count: usize) -> Vec<Cell> {
    let width = all as f64 / count as f64;
    let cell = |number: usize| {
        let (start, end) = (number as f64 * width, (number + 1) as f64 * width);
        // Sample `at` is in the middle of its unit.
        let (first, last) = ((start - 0.5).max(0.0) as usize, (end + 0.5).ceil() as usize);
        let part = |at: usize| {
            let middle = at as f64 + 0.5;
            until(end - middle) - until(start - middle)
        };
        let weights: Vec<f64> = (first..last.min(all)).map(part).collect();
        let sum: f64 = weights.iter().sum();
        Cell { first, weights: weights.into_iter().map(|weight| weight / sum).collect() }
    };
    (0..count).map(cell).collect()
}

/// Returns the part of a tent of width 2 around 0 that lies before a place.
fn until(place: f64) -> f64 {
    let side = 1.0 - place.abs().min(1.0);
    let before = 0.5 * side * side;
    if place < 0.0 { before } else { 1.0 - before }
}

impl Cell {
    /// Returns the samples with their weights.
    fn parts(&self) -> impl Iterator<Item = (usize, f64)> {
        (self.first..).zip(self.weights.iter().copied())
    }

    /// Returns the sample in the middle.
    fn middle(&self) -> usize {
        self.first + self.weights.len() / 2
    }

    /// Returns the mean of what is at the samples.
    fn mean(&self, at: impl Fn(usize) -> f64) -> f64 {
        self.parts().map(|(sample, weight)| weight * at(sample)).sum()
    }
}

impl Coarsening {
    fn lattice(&self, fine: &Lattice) -> Lattice {
        let mut lattice = fine.clone();
        lattice.dims = [0, 1, 2].map(|axis| self.cells[axis].len());
        if let Arrangement::Rectilinear(coordinates) = &fine.arrangement {
            let axis = |axis: usize| {
                let means =
                    self.cells[axis].iter().map(|cell| cell.mean(|at| coordinates[axis][at]));
                means.collect::<Vec<f64>>()
            };
            lattice.arrangement = Arrangement::Rectilinear(Arc::new([axis(0), axis(1), axis(2)]));
            return lattice;
        }
        let widths: [f64; 3] =
            [0, 1, 2].map(|axis| fine.dims[axis] as f64 / lattice.dims[axis] as f64);
        let widths = DVec3::from_array(widths);
        lattice.origin = fine.position(0.5 * (widths - 1.0));
        lattice.axes = fine.axes * DMat3::from_diagonal(widths);
        lattice
    }

    fn samples(&self, fine: &Samples) -> Samples {
        let of = |round| each_type!(fine, fine => self.values(|at| f64::from(fine[at]), round));
        match fine.scalar() {
            Scalar::U8 => Samples::U8(of(true).into_iter().map(|value| value as u8).collect()),
            Scalar::U16 => Samples::U16(of(true).into_iter().map(|value| value as u16).collect()),
            Scalar::I16 => Samples::I16(of(true).into_iter().map(|value| value as i16).collect()),
            Scalar::I32 => Samples::I32(of(true).into_iter().map(|value| value as i32).collect()),
            Scalar::F32 => Samples::F32(of(false).into_iter().map(|value| value as f32).collect()),
        }
    }

    /// Returns the coarse values, slice by slice. `at` returns those of samples.
    fn values(&self, at: impl Fn(usize) -> f64 + Sync, round: bool) -> Vec<f64> {
        let [nx, ny, _] = self.dims;
        let [across, down, along] = &self.cells;
        let slice = |cell: &Cell| -> Vec<f64> {
            if self.takes_one {
                let start = cell.middle() * nx * ny;
                let places = down.iter().flat_map(|row| {
                    let row = start + row.middle() * nx;
                    across.iter().map(move |cell| row + cell.middle())
                });
                return places.map(&at).collect();
            }
            let mut sums = vec![0.0; nx * ny];
            for (k, weight) in cell.parts() {
                let start = k * nx * ny;
                sums.iter_mut().zip(start..).for_each(|(sum, place)| *sum += weight * at(place));
            }
            let mut means = Vec::with_capacity(across.len() * down.len());
            for row in down {
                let mean = |i: usize| row.mean(|j| sums[j * nx + i]);
                let row: Vec<f64> = (0..nx).map(mean).collect();
                means.extend(across.iter().map(|cell| cell.mean(|i| row[i])));
            }
            match round {
                true => means.into_iter().map(f64::round).collect(),
                false => means,
            }
        };
        along.par_iter().flat_map_iter(slice).collect()
    }

    fn colors(&self, fine: &[[u8; 4]]) -> Vec<[u8; 4]> {
        let opacity = |at: usize| f64::from(fine[at][3]);
        let opacities = self.values(opacity, false);
        let part = |part: usize| self.values(|at| f64::from(fine[at][part]) * opacity(at), false);
        let parts = [part(0), part(1), part(2)];
        let color = |(at, opacity): (usize, &f64)| {
            let part = |part: usize| (parts[part][at] / opacity.max(1e-9)).round() as u8;
            [part(0), part(1), part(2), opacity.round() as u8]
        };
        opacities.iter().enumerate().map(color).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::about::Label;

    /// Values that grow evenly along the axes.
    fn ramp(dims: [usize; 3], spacing: DVec3) -> Volume {
        let lattice = Lattice::cartesian(dims, DVec3::ONE, DMat3::from_diagonal(spacing));
        let value = |at| lattice.sample_position(at).dot(DVec3::new(1.0, 2.0, 4.0)) as f32;
        let samples = (0..lattice.len()).map(value).collect();
        Volume::new(lattice, Samples::F32(samples)).expect("a volume")
    }

    #[test]
    fn samples_are_the_means_of_where_they_lie() {
        let fine = ramp([12, 9, 7], DVec3::new(1.0, 1.5, 2.0));
        let coarse = fine.coarser(0.2).expect("a volume");
        assert_eq!(coarse.lattice.dims, [5, 5, 6], "the axis of the widest steps loses the least");
        let is_inside = |at: &usize| {
            let place = coarse.lattice.index(*at);
            (0..3).all(|axis| (1..coarse.lattice.dims[axis] - 1).contains(&place[axis]))
        };
        for at in (0..coarse.len()).filter(is_inside) {
            let wanted = coarse.lattice.sample_position(at).dot(DVec3::new(1.0, 2.0, 4.0));
            assert!((coarse.value(at) - wanted).abs() < 1e-4, "{at}");
        }
        assert_eq!(fine.coarser(1.0).expect("a volume").lattice, fine.lattice);
        assert_eq!(fine.coarser(1e-9).expect("a volume").lattice.dims, [1, 1, 1]);
        assert!(fine.coarser(0.0).is_err() && fine.coarser(f64::NAN).is_err());
    }

    #[test]
    fn whole_numbers_are_rounded() {
        let lattice = Lattice::with_spacing([2, 1, 1], DVec3::ONE);
        let volume = Volume::new(lattice, Samples::I16(vec![-3, 4])).expect("a volume");
        assert_eq!(volume.coarser(0.5).expect("a volume").samples, Samples::I16(vec![1]));
    }

    #[test]
    fn coordinates_become_those_of_the_cells() {
        let mut fine = ramp([4, 2, 2], DVec3::ONE);
        let wide = vec![0.0, 50.0];
        let coordinates = [vec![0.0, 1.0, 4.0, 8.0], wide.clone(), wide];
        fine.lattice.arrangement = Arrangement::Rectilinear(Arc::new(coordinates));
        let coarse = fine.coarser(0.5).expect("a volume");
        let Arrangement::Rectilinear(coordinates) = &coarse.lattice.arrangement else {
            panic!("the arrangement changed");
        };
        assert_eq!(coarse.len(), 8);
        // Of both cells, neighbours count a little: they are interpolated.
        let wanted = [1.375 / 1.875, 10.625 / 1.875];
        assert!(coordinates[0].iter().zip(wanted).all(|(at, wanted)| (at - wanted).abs() < 1e-9));
    }

    #[test]
    fn labels_are_not_mixed_and_colours_count_by_their_opacity() {
        let lattice = Lattice::with_spacing([2, 2, 2], DVec3::ONE);
        let labels = Samples::U8(vec![0, 0, 0, 0, 0, 0, 0, 5]);
        let labels = Volume::new(lattice.clone(), labels).expect("a volume");
        let labels = labels.with_labels(Vec::<Label>::new());
        assert_eq!(labels.coarser(0.1).expect("a volume").samples, Samples::U8(vec![5]));

        let mut colored = Volume::new(lattice, Samples::U8(vec![9; 8])).expect("a volume");
        let mut colors = vec![[255, 0, 0, 0]; 8];
        colors[3] = [0, 80, 0, 240];
        colored.colors = Some(colors.into());
        let coarse = colored.coarser(0.1).expect("a volume");
        assert_eq!(coarse.colors.as_deref(), Some(&[[0, 80, 0, 30]][..]));
    }
}
