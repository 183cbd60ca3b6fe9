//! The field of lattices and kernels for which four weights an axis of a Cartesian lattice do not hold all: sums of weights and of
//! weighted values over the samples in reach, and their quotient. So the field is what splats add up to: samples outside the
//! lattice have no weight, and where next to no kernel reaches there is no field.

use super::{
    bells,
    field::{LEAST_DEVIATION, LEAST_WEIGHT, Weighting, weighting},
    radial::Radial,
    rectilinear::Axes,
    vector::{Lanes, each, three},
    window::{Sample, Window},
};
use crate::{
    math::{Kernel, Profile},
    volume::{Arrangement, Lattice, Volume, overshoot::Overshoot, reach::neighbourhood_ranges},
};
use fearless_simd::{Simd, i32x8, prelude::*};
use glam::{DMat3, DVec3};

/// The most samples along an axis that a place looks at.
pub const MOST_TAPS: usize = 12;
/// The same of kernels that are no products, of which each sample takes a weight of its own.
const MOST_RADIAL_TAPS: usize = 8;
/// The least extent of a kernel, in samples: fields of narrower ones change like steps.
const LEAST_EXTENT: f64 = 1.2;
/// So far away no kernel reaches: where samples would be that the lattice lacks.
const FAR: f32 = 16.0;
/// Places beyond the lattice by more steps than that have no sample in reach.
const BEYOND: f32 = 32.0;

/// How a volume is gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// By four weights an axis.
    Plain(Weighting),
    /// By sums over so many samples along each axis of each Cartesian lattice.
    Blend(usize),
}

impl Way {
    /// # Errors
    /// What can't be gathered, in words.
    pub fn of(volume: &Volume, kernel: &Kernel) -> Result<Self, &'static str> {
        let arrangement = &volume.lattice.arrangement;
        let plain = weighting(kernel).filter(|_| *arrangement == Arrangement::Cartesian);
        match (&kernel.profile, plain) {
            (Profile::Tensor(_), Some(plain)) => return Ok(Self::Plain(plain)),
            (Profile::Tensor(_), None) => return Err("tensor products on other lattices than Cartesian ones"),
            (Profile::Gaussian(sigma), _) if *sigma < LEAST_DEVIATION => {
                return Err("kernels much narrower than a sample");
            }
            (Profile::Gaussian(_), Some(plain)) => return Ok(Self::Plain(plain)),
            (Profile::Gaussian(_), None) => {}
            _ if kernel.extent < LEAST_EXTENT => return Err("kernels much narrower than a sample"),
            _ => {}
        }
        if let Arrangement::Rectilinear(places) = arrangement {
            if !is_whole(kernel) {
                return Err("kernels that end where they still have weight, on a rectilinear lattice");
            }
            return match Axes::taps(places, kernel) {
                Some(taps) => Ok(Self::Blend(taps)),
                None => Err("a rectilinear lattice whose kernels reach far more samples in some places than in others"),
            };
        }
        let taps = 2 * (reach(kernel) * volume.lattice.unit([0; 3]).x).ceil() as usize;
        let most = if is_whole(kernel) { MOST_TAPS } else { MOST_RADIAL_TAPS };
        if taps > most { Err("kernels that reach too many samples") } else { Ok(Self::Blend(taps)) }
    }
}

/// How far a kernel reaches, in samples: a Gaussian, which does not end along the rays, as far as it has weight.
pub fn reach(kernel: &Kernel) -> f64 {
    match kernel.profile {
        Profile::Gaussian(sigma) => sigma * (-2.0 * LEAST_WEIGHT.ln()).sqrt(),
        _ => kernel.extent,
    }
}

/// Whether a kernel is a Gaussian that ends where it has no weight: a product along the axes.
fn is_whole(kernel: &Kernel) -> bool {
    matches!(kernel.profile, Profile::Gaussian(_)) && reach(kernel) <= kernel.extent
}

/// What is summed of the kernels at a place: their weights and weighted values, and how both change a step along the axes.
#[derive(Clone, Copy)]
pub struct Sums<S: Simd> {
    pub weight: Lanes<S>,
    pub value: Lanes<S>,
    pub weight_slopes: [Lanes<S>; 3],
    pub value_slopes: [Lanes<S>; 3],
}

/// The field at a place: its value and its change a step along each axis. Weights count from what kernels must add up to; where
/// they are not above 0 there is no field.
#[derive(Clone, Copy)]
pub struct Point<S: Simd> {
    pub value: Lanes<S>,
    pub slopes: [Lanes<S>; 3],
    pub weight: Lanes<S>,
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        Self {
            weight: self.weight + other.weight,
            value: self.value + other.value,
            weight_slopes: three!(I => self.weight_slopes[I] + other.weight_slopes[I]),
            value_slopes: three!(I => self.value_slopes[I] + other.value_slopes[I]),
        }
    }

    /// The field, whose slopes are so many times as large as those of the sums.
    #[inline(always)]
    fn quotient(&self, simd: S, scale: f32) -> Point<S> {
        // Where kernels of both signs all but cancel, and far outside, any number will do.
        let inverse = Lanes::splat(simd, 1.0) / self.weight.max(Lanes::splat(simd, 1e-20));
        let value = self.value * inverse;
        let inverse = inverse * scale;
        let slopes = three!(I => (self.value_slopes[I] - value * self.weight_slopes[I]) * inverse);
        Point { value, slopes, weight: self.weight }
    }
}

/// A Cartesian lattice among those that a lattice consists of.
#[derive(Debug)]
struct Part {
    /// Its first sample, and the samples from one row to the next and from one slice to the next.
    first: usize,
    row: usize,
    slice: usize,
    dims: [usize; 3],
    /// Where its first sample is and how far from that the last one is, in steps.
    shift: [f32; 3],
    size: [f32; 3],
}

/// The weights of samples.
#[derive(Debug)]
enum Form {
    Radial(Radial),
    /// Gaussians, by log₂ of the weight of a sample 1 away; cut at a distance from the ray, or not.
    Bells {
        log: f32,
        radius: Option<f32>,
    },
    Rectilinear(Axes),
}

/// A lattice and its kernel.
#[derive(Debug)]
pub struct Blend {
    parts: Vec<Part>,
    form: Form,
    /// Samples along each axis of each part that a place looks at.
    taps: usize,
    /// Samples' spacings to the step.
    per_step: f32,
    extent: f32,
    /// What kernels must add up to.
    least: f32,
    /// The cells that are looked up for what they may show.
    cells: Lattice,
}

impl Blend {
    /// What takes so many samples along each axis.
    pub fn new(volume: &Volume, kernel: &Kernel, taps: usize) -> Self {
        let lattice = volume.drawn_lattice();
        let [nx, ny, nz] = lattice.dims;
        let whole = |size| Part { first: 0, row: nx, slice: nx * ny, dims: lattice.dims, shift: [0.0; 3], size };
        let steps = |dims: [usize; 3]| dims.map(|count| count as f32 - 1.0);
        let cartesian = |dims| Lattice::cartesian(dims, lattice.origin, lattice.axes);
        let bells = |sigma: f64| Form::Bells {
            log: (-0.5 * std::f64::consts::LOG2_E / (sigma * sigma)) as f32,
            radius: (!is_whole(kernel)).then_some(kernel.extent as f32),
        };
        let mut form = match kernel.profile {
            Profile::Gaussian(sigma) => bells(sigma),
            _ => Form::Radial(Radial::new(kernel)),
        };
        let (parts, cells) = match &lattice.arrangement {
            Arrangement::Cartesian => (vec![whole(steps(lattice.dims))], cartesian(lattice.dims)),
            Arrangement::BodyCentred => {
                // Every second layer, from the first one and from the second one on.
                let dims = |layer: usize| [nx, ny, (nz + 1 - layer) / 2];
                let part = |layer: usize| {
                    let shift = [0.5 * layer as f32; 3];
                    let (dims, size) = (dims(layer), steps(dims(layer)));
                    Part { first: layer * nx * ny, row: nx, slice: 2 * nx * ny, dims, shift, size }
                };
                let parts = [0, 1].map(part).into_iter().filter(|part| part.dims[2] > 0).collect();
                (parts, cartesian(dims(0)))
            }
            Arrangement::Rectilinear(places) => {
                let axes = Axes::new(places, kernel, taps);
                let (dims, widths) = axes.cells();
                let widths = DVec3::from_array(widths);
                let first = DVec3::new(places[0][0], places[1][0], places[2][0]);
                let origin = lattice.position(first + 0.5 * widths);
                form = Form::Rectilinear(axes);
                let size = [0, 1, 2].map(|axis| (places[axis][lattice.dims[axis] - 1] - first[axis]) as f32);
                (vec![whole(size)], Lattice::cartesian(dims, origin, lattice.axes * DMat3::from_diagonal(widths)))
            }
        };
        Self {
            parts,
            form,
            taps,
            per_step: if lattice.arrangement == Arrangement::BodyCentred { std::f32::consts::SQRT_2 } else { 1.0 },
            extent: kernel.extent as f32,
            least: kernel.least_sum() as f32,
            cells,
        }
    }

    /// A Cartesian lattice of cells, for each of which [`ranges`](Self::ranges) tells what the field may be.
    pub fn cells(&self) -> &Lattice {
        &self.cells
    }

    /// Cells to the step along each axis, and where the lattice's first sample is among them; `drawn_from` is where the
    /// volume's first sample is on the lattice drawn, in steps.
    pub fn to_cells(&self, drawn_from: [f32; 3]) -> [[f32; 3]; 2] {
        match &self.form {
            Form::Rectilinear(axes) => [axes.cells().1.map(|width| (1.0 / width) as f32), [-0.5; 3]],
            _ => [[1.0; 3], drawn_from],
        }
    }

    /// For each cell the range of the field in it and half a cell around it, in steps of 1/255 of the volume's range.
    pub fn ranges(&self, volume: &Volume, kernel: &Kernel) -> Vec<[u8; 2]> {
        if let Form::Rectilinear(axes) = &self.form {
            return axes.ranges(volume);
        }
        let lattice = volume.drawn_lattice();
        let mut ranges = match &volume.coefficients {
            Some(coefficients) => coefficients.ranges.clone(),
            None => {
                let mut radius = lattice.reach(reach(kernel));
                if lattice.arrangement == Arrangement::BodyCentred {
                    // A place may be nearer to a layer that is not looked up.
                    radius[2] += 1;
                }
                let mut ranges = neighbourhood_ranges(volume, radius);
                self.widen(&mut ranges, lattice, kernel);
                ranges
            }
        };
        if lattice.arrangement == Arrangement::BodyCentred {
            let slice = lattice.dims[0] * lattice.dims[1];
            ranges = ranges.chunks(slice).step_by(2).flatten().copied().collect();
        }
        ranges
    }

    /// Makes room for the overshoot of kernels that have values of both signs: the sum of the weights' magnitudes where they add
    /// up to 1. At the border they add up to the least sum at worst.
    fn widen(&self, ranges: &mut [[u8; 2]], lattice: &Lattice, kernel: &Kernel) {
        if !kernel.is_signed() {
            return;
        }
        let (mut inside, mut largest) = (1.0f64, 0.0f64);
        let half = self.taps as i32 / 2;
        for place in 0..9usize.pow(3) {
            let place = [place % 9, place / 9 % 9, place / 81].map(|at| at as f64 / 8.0);
            let (mut sum, mut size) = (0.0, 0.0);
            for part in &self.parts {
                for tap in 0..(2 * half + 2).pow(3) {
                    let side = 2 * half + 2;
                    let at = [tap % side, tap / side % side, tap / side / side].map(|at| f64::from(at - half));
                    let away = [0, 1, 2].map(|axis| place[axis] - at[axis] - f64::from(part.shift[axis]));
                    let weight = kernel.value(DVec3::from_array(away).length() * f64::from(self.per_step));
                    sum += weight;
                    size += weight.abs();
                }
            }
            inside = inside.max(size / sum);
            largest = largest.max(size);
        }
        let [inside, outside] = [inside, largest / f64::from(self.least)]
            .map(|lebesgue| Overshoot { lebesgue: lebesgue * 1.01, tails: Vec::new() });
        let reach = lattice.reach(kernel.extent + 1.0);
        for (at, range) in ranges.iter_mut().enumerate() {
            let index = lattice.index(at);
            let is_inside = (0..3).all(|axis| index[axis] >= reach[axis] && index[axis] + reach[axis] < lattice.dims[axis]);
            *range = if is_inside { &inside } else { &outside }.widen([*range].into_iter());
        }
    }

    /// The field at places in steps, on rays along which a world unit is so many steps.
    #[inline(always)]
    pub fn at<S: Simd, T: Sample>(
        &self,
        simd: S,
        samples: &[T],
        zero: f32,
        place: [Lanes<S>; 3],
        way: [Lanes<S>; 3],
    ) -> Point<S> {
        // A function of its own for each number of samples.
        let sums = match self.taps {
            0..=2 => self.sums::<S, T, 2, 4, 8>(simd, samples, zero, place, way),
            3..=4 => self.sums::<S, T, 4, 16, 64>(simd, samples, zero, place, way),
            5..=6 => self.sums::<S, T, 6, 36, 216>(simd, samples, zero, place, way),
            7..=8 => self.sums::<S, T, 8, 64, 512>(simd, samples, zero, place, way),
            _ => self.sums::<S, T, MOST_TAPS, { MOST_TAPS * MOST_TAPS }, { MOST_TAPS * MOST_TAPS * MOST_TAPS }>(
                simd, samples, zero, place, way,
            ),
        };
        let mut point = sums.quotient(simd, self.per_step);
        point.weight -= self.least;
        point
    }

    /// Sums over `N` samples along each axis.
    fn sums<S: Simd, T: Sample, const N: usize, const ROWS: usize, const ALL: usize>(
        &self,
        simd: S,
        samples: &[T],
        zero: f32,
        place: [Lanes<S>; 3],
        way: [Lanes<S>; 3],
    ) -> Sums<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let none = Lanes::splat(simd, 0.0);
                let mut all: Option<Sums<S>> = None;
                let mut values = [none; ALL];
                for part in &self.parts {
                    let samples = &samples[part.first..];
                    let place = three!(I => {
                        let beyond = part.size[I].mul_add(2.0, BEYOND);
                        (place[I] - part.shift[I]).max(Lanes::splat(simd, -beyond)).min(Lanes::splat(simd, beyond))
                    });
                    let own = match &self.form {
                        Form::Rectilinear(axes) => {
                            let taps = three!(I => axes.along::<S, N>(simd, I, place[I]));
                            part.load::<S, T, N, ROWS, ALL>(simd, samples, zero, three!(I => taps[I].start), &mut values);
                            Axes::sums(simd, &taps, &values)
                        }
                        form => {
                            let starts = three!(I => {
                                let last = part.dims[I] as f32 - N as f32;
                                let start = place[I].floor() - (N as f32 * 0.5 - 1.0);
                                start.min(Lanes::splat(simd, last)).max(none)
                            });
                            let away = three!(I => {
                                let mut away = [Lanes::splat(simd, FAR); N];
                                for tap in 0..N.min(part.dims[I]) {
                                    away[tap] = (place[I] - starts[I] - tap as f32) * self.per_step;
                                }
                                away
                            });
                            part.load::<S, T, N, ROWS, ALL>(simd, samples, zero, starts, &mut values);
                            let away = [&away[0][..], &away[1][..], &away[2][..]];
                            match form {
                                Form::Radial(radial) => radial.sums(simd, away, &values, self.extent),
                                Form::Bells { log, radius } => bells::sums(simd, *log, *radius, way, away, &values),
                                Form::Rectilinear(_) => continue,
                            }
                        }
                    };
                    all = Some(all.map_or(own, #[inline(always)] |all| all.plus(&own)));
                }
                all.unwrap_or(Sums { weight: none, value: none, weight_slopes: [none; 3], value_slopes: [none; 3] })
            },
        )
    }
}

impl Part {
    /// The values of samples, counted from zero, `N` along each axis; of those that the lattice lacks, any.
    #[inline(always)]
    fn load<S: Simd, T: Sample, const N: usize, const ROWS: usize, const ALL: usize>(
        &self,
        simd: S,
        samples: &[T],
        zero: f32,
        starts: [Lanes<S>; 3],
        values: &mut [Lanes<S>; ALL],
    ) {
        let first: [[i32; 8]; 3] = three!(I => i32x8::<S>::truncate_from(starts[I]).into());
        let Self { row, slice, dims, .. } = *self;
        let mut places = [0; 8];
        for lane in 0..8 {
            places[lane] = first[2][lane] as usize * slice + first[1][lane] as usize * row + first[0][lane] as usize;
        }
        if dims.iter().any(|&count| count < N) {
            // Sample by sample.
            for (at, value) in values.iter_mut().enumerate() {
                let tap = [at % N, at / N % N, at / ROWS];
                let own = each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
                    let [x, y, z] = three!(I => (first[I][L] as usize + tap[I]).min(dims[I] - 1));
                    samples[z * slice + y * row + x].value() - zero
                });
                *value = own.simd_into(simd);
            }
            return;
        }
        let window = Window::<T, N>::new(samples, places, row, slice);
        for k in 0..N {
            for j in 0..N {
                let own = &mut values[k * ROWS + j * N..][..N];
                let mut at = 0;
                while at + 4 <= N {
                    own[at..at + 4].copy_from_slice(&T::four(simd, &window, [at, j, k]));
                    at += 4;
                }
                if at < N {
                    own[at..].copy_from_slice(&T::two(simd, &window, [at, j, k]));
                }
                if zero != 0.0 {
                    for value in own {
                        *value -= zero;
                    }
                }
            }
        }
    }
}
