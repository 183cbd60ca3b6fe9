//! Sharp volumes: kernels carry coefficients instead of the samples, chosen so that their
//! normalised sum passes through every sample. The coefficients are the samples divided, in
//! frequency space, by the response of the sampled kernel.
//!
//! Sources: Unser, "Splines: a perfect fit for signal and image processing", 1999; Thévenaz, Blu
//! and Unser, "Interpolation revisited", 2000. For body-centred lattices: Condat and Van De Ville,
//! "Three-directional box-splines", 2006, and others after Theußl, Möller and Gröller, "Optimal
//! regular volume sampling", 2001.

use super::{
    Arrangement, Coefficients, Lattice, Samples, Volume,
    grid::{Grid, Response},
    overshoot::Overshoot,
    prefilter,
    reach::neighbourhood_ranges,
};
use crate::{
    Error, Result,
    about::About,
    math::{Kernel, Profile, Tensor},
    memory,
    parallel::prelude::*,
};
use glam::DVec3;
use std::sync::Arc;

/// The smallest response that a kernel may have. Coefficients are up to 1 / response times as large
/// as the samples, and rounded to 24 bits. This bound keeps the sum within 1e-4 of the range of the
/// samples.
const LEAST_RESPONSE: f64 = 6e-4;

impl Volume {
    /// Makes the volume sharp for a kernel: sets [`coefficients`](Self::coefficients). Their
    /// normalised kernel sum passes through every sample (within 1e-4 of the range). The kernel is
    /// radial in index space.
    ///
    /// The field continues mirrored at the outermost samples. The coefficients continue with it as
    /// far as the kernel reaches, so that sums are complete at the border too.
    ///
    /// A tensor product that interpolates needs no coefficients and gets none. For the cubic
    /// B-spline they come from an exact recursive filter, far faster than for radial kernels. They
    /// lie on the volume's own lattice and are mirrored with it.
    ///
    /// Memory beside the volume and the result: about 16 bytes per sample, on a body-centred
    /// lattice 40.
    ///
    /// # Errors
    /// [`Error::Argument`] in these cases:
    ///
    /// - The kernel removes a wave of the samples (the sigma of a Gaussian is too large).
    /// - Values are close to the largest 32-bit float.
    /// - The lattice is rectilinear, or body-centred with one layer, or the kernel is a tensor
    ///   product and the lattice is not Cartesian.
    /// - The volume or the kernel was built by hand and is inconsistent.
    /// - Memory cannot hold the result.
    pub fn sharpened(self, kernel: &Kernel) -> Result<Self> {
        // Coefficients of another kernel are replaced without being checked.
        let volume = Self { coefficients: None, ..self };
        volume.validate().map_err(Error::Argument)?;
        kernel.validate()?;
        if let Some(tensor) = kernel.as_tensor() {
            return volume.prefiltered(tensor);
        }
        let grid = Grid::of(&volume.lattice)?;
        let (lattice, margin) = continued(&volume.lattice, kernel);
        let (points, drawn) = (grid.len() as u64, lattice.len() as u64);
        memory::check(
            "a sharp volume",
            points.saturating_mul(8).saturating_add(drawn.saturating_mul(14)),
        )
        .map_err(Error::Argument)?;
        let response = Response::new(grid, kernel);
        let least = response.least();
        // If the kernel's values at the samples sum to zero, it has no response, which appears as
        // infinity.
        if !(LEAST_RESPONSE..f64::INFINITY).contains(&least) {
            let remedy = match kernel.profile {
                Profile::Gaussian(_) => "take a smaller sigma",
                _ => "take a narrower kernel",
            };
            return Err(Error::Argument(format!(
                "the kernel is too wide to be made sharp: it leaves {least:.1e} of the finest \
                 detail where {LEAST_RESPONSE} are needed; {remedy}"
            )));
        }
        let largest = volume.range[0].abs().max(volume.range[1].abs());
        if largest / least > f64::from(f32::MAX) {
            return Err(Error::Argument(format!(
                "values as large as {largest:.1e} cannot be made sharp: take another unit"
            )));
        }
        let mut points = grid.fill(&volume.samples);
        response.divide(&mut points);
        let overshoot = Overshoot::new(grid, kernel);
        let reach = |(further, _): &(f64, f64)| volume.lattice.reach(kernel.extent + further);
        let boxes: Vec<_> =
            overshoot.tails.iter().map(|tail| neighbourhood_ranges(&volume, reach(tail))).collect();

        let [nx, ny, _] = volume.lattice.dims;
        let [width, height, _] = lattice.dims;
        let mut values = vec![0f32; lattice.len()];
        let mut ranges = vec![[0u8; 2]; lattice.len()];
        let rows = values.par_chunks_mut(width).zip(ranges.par_chunks_mut(width)).enumerate();
        rows.for_each(|(row, (values, ranges))| {
            for (column, (value, range)) in values.iter_mut().zip(ranges).enumerate() {
                let index = [column, row % height, row / height];
                let index =
                    std::array::from_fn(|axis| index[axis] as isize - margin[axis] as isize);
                // A mirror image has the range of the sample that it mirrors.
                let point = grid.point(index);
                let [i, j, k] = grid.index(point);
                *value = points[grid.offset(point)] as f32;
                let sample = (k * ny + j) * nx + i;
                *range = overshoot.widen(boxes.iter().map(|ranges| ranges[sample]));
            }
        });
        let coefficients = Coefficients { lattice, values, ranges, kernel: kernel.clone() };
        Ok(Self { coefficients: Some(Arc::new(coefficients)), ..volume })
    }

    /// Returns the volume made sharp for a tensor product.
    fn prefiltered(self, tensor: Tensor) -> Result<Self> {
        if self.lattice.arrangement != Arrangement::Cartesian {
            let name = tensor.name();
            return Err(Error::Argument(format!(
                "the kernel {name} is a product along the axes of a Cartesian lattice"
            )));
        }
        if tensor.interpolates() {
            return Ok(self);
        }
        memory::check("a sharp volume", (self.len() as u64).saturating_mul(6))
            .map_err(Error::Argument)?;
        let largest = self.range[0].abs().max(self.range[1].abs());
        // The filter leaves a third of the finest detail along each axis.
        if largest * 27.0 > f64::from(f32::MAX) {
            return Err(Error::Argument(format!(
                "values as large as {largest:.1e} cannot be made sharp: take another unit"
            )));
        }
        let kernel = Kernel::tensor(tensor);
        // The spline lies within the coefficients in reach. Their range is quantised in steps of
        // the samples' range.
        let drawn = Self {
            colors: None,
            more_channels: Vec::new(),
            opacities: None,
            samples: Samples::F32(prefilter::cubic(&self.samples, self.lattice.dims)),
            range: self.range,
            lattice: self.lattice.clone(),
            coefficients: None,
            about: About::default(),
        };
        let ranges = neighbourhood_ranges(&drawn, self.lattice.reach(kernel.extent));
        let Samples::F32(values) = drawn.samples else { return Ok(self) };
        let coefficients = Coefficients { lattice: drawn.lattice, values, ranges, kernel };
        Ok(Self { coefficients: Some(Arc::new(coefficients)), ..self })
    }
}

impl Coefficients {
    /// Checks that these are what [`Volume::sharpened`] makes for a volume on `lattice`. The error
    /// is a message.
    pub(super) fn validate(&self, lattice: &Lattice) -> Result<(), String> {
        const REMEDY: &str = "make the volume sharp again";
        Grid::of(lattice).map_err(|error| error.to_string())?;
        self.kernel
            .validate()
            .map_err(|error| format!("the kernel of the coefficients: {error}"))?;
        let (wanted, _) = continued(lattice, &self.kernel);
        // If both lattices were moved or turned by the same amount, they may differ by rounding.
        let step = lattice.edges().max_element();
        let fits = self.lattice.dims == wanted.dims
            && self.lattice.arrangement == wanted.arrangement
            && self.lattice.axes.abs_diff_eq(wanted.axes, 1e-6 * step)
            && self.lattice.origin.abs_diff_eq(wanted.origin, 1e-3 * step);
        if !fits {
            return Err(format!(
                "the lattice of the coefficients is not the volume's, continued as far as their \
                 kernel reaches; {REMEDY}"
            ));
        }
        let (count, values, ranges) = (wanted.len(), self.values.len(), self.ranges.len());
        if [values, ranges] != [count; 2] {
            return Err(format!(
                "{values} coefficients with {ranges} ranges do not fill their lattice of {count}; \
                 {REMEDY}"
            ));
        }
        match self.values.par_iter().position_first(|value| !value.is_finite()) {
            Some(at) => Err(format!("coefficient {at} is {}; {REMEDY}", self.values[at])),
            None => Ok(()),
        }
    }
}

/// Returns a lattice extended on all sides as far as a kernel reaches, and the number of samples
/// added per side. Tensor products mirror by themselves.
fn continued(lattice: &Lattice, kernel: &Kernel) -> (Lattice, [usize; 3]) {
    if kernel.as_tensor().is_some() {
        return (lattice.clone(), [0; 3]);
    }
    let mut margin = lattice.reach(kernel.extent);
    let mut before = DVec3::from_array(margin.map(|n| n as f64));
    if lattice.arrangement == Arrangement::BodyCentred {
        // Add whole cells, so that the first layer is again one without displacement.
        margin[2] = margin[2].next_multiple_of(2);
        before.z = 0.5 * margin[2] as f64;
    }
    let dims = std::array::from_fn(|axis| lattice.dims[axis] + 2 * margin[axis]);
    (Lattice { dims, origin: lattice.position(-before), ..lattice.clone() }, margin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn volume(lattice: Lattice) -> Volume {
        let values = (0..lattice.len()).map(|i| ((i * i) as f32).sin()).collect();
        Volume::new(lattice, Samples::F32(values)).unwrap()
    }

    #[test]
    fn coefficients_go_on_mirrored() {
        let axes = DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0));
        let kernel = Kernel::default();
        for (lattice, margin) in [
            (Lattice::cartesian([5, 6, 7], DVec3::ONE, axes), [2; 3]),
            (Lattice::body_centred([5, 6, 7], DVec3::ONE, axes), [2, 2, 4]),
        ] {
            let sharp = volume(lattice.clone()).sharpened(&kernel).unwrap();
            let drawn = sharp.drawn_lattice();
            let at = |index: [usize; 3]| {
                (index[2] * drawn.dims[1] + index[1]) * drawn.dims[0] + index[0]
            };
            // The volume's first sample lies where it did, and sees the same values on both sides.
            assert!(drawn.sample_position(at(margin)).distance(lattice.origin) < 1e-12);
            let [x, y, z] = margin;
            let opposite = |a, b| {
                assert_eq!(sharp.drawn_value(at(a)), sharp.drawn_value(at(b)), "{a:?} {b:?}");
                assert_eq!(sharp.drawn_ranges(&kernel)[at(a)], sharp.drawn_ranges(&kernel)[at(b)]);
            };
            opposite([x + 1, y + 2, z - 2], [x + 1, y + 2, z + 2]);
            opposite([x - 1, y + 2, z], [x + 1, y + 2, z]);
            assert_eq!(sharp.coefficients.as_ref().unwrap().values.len(), drawn.len());
        }
    }

    #[test]
    fn what_cannot_be_made_sharp_is_told() {
        let cartesian = || Lattice::with_spacing([9; 3], DVec3::ONE);
        let message = |lattice: Lattice, kernel: Result<Kernel>| {
            volume(lattice).sharpened(&kernel.unwrap()).unwrap_err().to_string()
        };
        volume(cartesian()).sharpened(&Kernel::gaussian(0.79, 4.0).unwrap()).unwrap();
        assert!(message(cartesian(), Kernel::gaussian(0.9, 4.0)).contains("smaller sigma"));
        assert!(message(cartesian(), Kernel::b_spline(4.0)).contains("narrower"));
        assert!(
            message(cartesian(), Kernel::table(vec![1.0, 0.0, -1.0, 8.0, 0.0], 3.0))
                .contains("narrower")
        );
        let single = Lattice::body_centred([3, 3, 1], DVec3::ZERO, DMat3::IDENTITY);
        assert!(message(single, Ok(Kernel::default())).contains("two layers"));
        let places = Arc::new([vec![0.0, 1.0], vec![0.0, 1.0], vec![0.0, 2.0]]);
        let uneven = Lattice {
            arrangement: Arrangement::Rectilinear(places),
            ..Lattice::with_spacing([2; 3], DVec3::ONE)
        };
        assert!(message(uneven, Ok(Kernel::default())).contains("rectilinear"));
        let large = Volume::new(cartesian(), Samples::F32(vec![1e38; 729])).unwrap();
        assert!(large.sharpened(&Kernel::default()).unwrap_err().to_string().contains("1.0e38"));
    }
}
