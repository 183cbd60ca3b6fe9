//! The field of lattices and kernels for which four weights an axis of a Cartesian lattice do not
//! suffice. It is the quotient of two sums over the samples in reach: weighted values and weights.
//! So the field equals that of splats: samples outside the lattice have no weight, and where next
//! to no kernel reaches there is no field.

use super::{
    bells,
    kernel_sums::{MOST_TAPS, Point, Sums, reach},
    radial::Radial,
    rectilinear::Axes,
    vector::{Lanes, each, three},
    window::{Sample, Window},
};
use crate::{
    math::{Kernel, Profile},
    plan::weighting::{LEAST_DEVIATION, Weighting, weighting},
    volume::{
        Arrangement, Lattice, SampleSlice, Volume, overshoot::Overshoot,
        reach::neighbourhood_ranges,
    },
};
use fearless_simd::{Simd, i32x8, prelude::*};
use glam::{DMat3, DVec3};
/// The same for kernels that are no products, whose samples need a weight each.
const MOST_RADIAL_TAPS: usize = 8;
/// Minimum extent of a kernel, in samples: the fields of narrower kernels change in steps.
const LEAST_EXTENT: f64 = 1.2;
/// A distance that no kernel reaches, for samples that the lattice lacks.
const FAR: f32 = 16.0;
/// Places further outside the lattice than this, in steps, have no sample in reach.
const BEYOND: f32 = 32.0;

/// How a volume is gathered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// With four weights an axis.
    Plain(Weighting),
    /// By sums over this many samples along each axis of each Cartesian lattice.
    Blend(usize),
}

impl Way {
    /// Chooses how to gather a volume.
    ///
    /// # Errors
    /// The reason why the volume can't be gathered, in words.
    pub fn of(volume: &Volume, kernel: &Kernel) -> Result<Self, &'static str> {
        if volume.is_label_map() {
            return Ok(Self::Plain(Weighting::Labels));
        }
        let arrangement = &volume.lattice.arrangement;
        let plain = weighting(kernel).filter(|_| *arrangement == Arrangement::Cartesian);
        match (&kernel.profile, plain) {
            (Profile::Tensor(_), Some(plain)) => return Ok(Self::Plain(plain)),
            (Profile::Tensor(_), None) => {
                return Err("tensor products on other lattices than Cartesian ones");
            }
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
                return Err(
                    "kernels that end where they still have weight, on a rectilinear lattice",
                );
            }
            return match Axes::taps(places, kernel) {
                Some(taps) => Ok(Self::Blend(rounded(taps))),
                None => Err("a rectilinear lattice whose kernels reach far more samples \
                             in some places than in others"),
            };
        }
        // Centred on the cell before a place, or on the nearest sample if that takes fewer samples.
        let reach = reach(kernel) * volume.lattice.unit([0; 3]).x;
        let taps = (2 * reach.ceil() as usize).min(2 * (reach + 0.5).floor() as usize + 1);
        let most = if is_whole(kernel) { MOST_TAPS } else { MOST_RADIAL_TAPS };
        if taps > most {
            Err("kernels that reach too many samples")
        } else {
            Ok(Self::Blend(rounded(taps)))
        }
    }
}

/// Rounds a number of samples along an axis up to one for which a specialised function exists.
fn rounded(taps: usize) -> usize {
    match taps {
        0..=3 => 3,
        4..=6 => taps,
        7..=8 => 8,
        _ => MOST_TAPS,
    }
}

/// Whether a kernel is a Gaussian that has no weight left where it ends: a product along the axes.
fn is_whole(kernel: &Kernel) -> bool {
    matches!(kernel.profile, Profile::Gaussian(_)) && reach(kernel) <= kernel.extent
}

/// The values of a volume's samples.
#[derive(Clone, Copy)]
enum Source<'a> {
    Samples(SampleSlice<'a>),
    /// The coefficients of a sharp volume.
    Coefficients(&'a [f32]),
}

/// A volume that is gathered by sums.
pub struct Blended<'a> {
    blend: &'a Blend,
    samples: Source<'a>,
    /// The value that values are relative to.
    zero: f32,
}

impl<'a> Blended<'a> {
    pub fn new(volume: &'a Volume, blend: &'a Blend, zero: f64) -> Self {
        let samples = match &volume.coefficients {
            Some(coefficients) => Source::Coefficients(&coefficients.values),
            None => Source::Samples(volume.samples.as_slice()),
        };
        Self { blend, samples, zero: zero as f32 }
    }

    /// Returns the field at places in steps. `way` is the direction of the rays, in steps per world
    /// unit.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, place: [Lanes<S>; 3], way: [Lanes<S>; 3]) -> Point<S> {
        // A separate function for each number of samples.
        let sums = match self.blend.taps {
            ..=3 => self.sums::<S, 3, 4, 27>(simd, place, way),
            4 => self.sums::<S, 4, 4, 64>(simd, place, way),
            5 => self.sums::<S, 5, 6, 125>(simd, place, way),
            6 => self.sums::<S, 6, 6, 216>(simd, place, way),
            8 => self.sums::<S, 8, 8, 512>(simd, place, way),
            _ => self.sums::<S, MOST_TAPS, MOST_TAPS, { MOST_TAPS * MOST_TAPS * MOST_TAPS }>(
                simd, place, way,
            ),
        };
        let mut point = sums.quotient(simd, self.blend.per_step);
        point.weight -= self.blend.least;
        point
    }

    /// Sums over `N` samples along each axis, `ALL` in total. Rows are loaded `WIDE` samples at a
    /// time.
    fn sums<S: Simd, const N: usize, const WIDE: usize, const ALL: usize>(
        &self,
        simd: S,
        place: [Lanes<S>; 3],
        way: [Lanes<S>; 3],
    ) -> Sums<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let none = Lanes::splat(simd, 0.0);
                let mut all: Option<Sums<S>> = None;
                let mut values = [none; ALL];
                for part in &self.blend.parts {
                    let place = three!(I => {
                        let beyond = part.size[I].mul_add(2.0, BEYOND);
                        (place[I] - part.shift[I])
                            .max(Lanes::splat(simd, -beyond))
                            .min(Lanes::splat(simd, beyond))
                    });
                    let sums = match &self.blend.form {
                        Form::Rectilinear(axes) => {
                            let taps = three!(I => axes.along::<S, N>(simd, I, place[I]));
                            let around = Around {
                                starts: three!(I => taps[I].start),
                                rows: taps[1].counted,
                                slices: taps[2].counted,
                            };
                            self.load::<S, N, WIDE, ALL>(simd, part, &around, &mut values);
                            Axes::sums(simd, &taps, &values)
                        }
                        Form::Radial(radial) => {
                            let away =
                                self.load_even::<S, N, WIDE, ALL>(simd, part, place, &mut values);
                            let away = [&away[0][..], &away[1][..], &away[2][..]];
                            radial.sums(simd, away, &values, self.blend.extent)
                        }
                        Form::Bells { log, radius } => {
                            let away =
                                self.load_even::<S, N, WIDE, ALL>(simd, part, place, &mut values);
                            let away = [&away[0][..], &away[1][..], &away[2][..]];
                            bells::sums(simd, *log, *radius, way, away, &values)
                        }
                    };
                    all = Some(all.map_or(
                        sums,
                        #[inline(always)]
                        |all| all.plus(&sums),
                    ));
                }
                all.unwrap_or(Sums {
                    weight: none,
                    value: none,
                    weight_slopes: [none; 3],
                    value_slopes: [none; 3],
                })
            },
        )
    }

    /// Loads the values of the samples around places on a part with even steps. Returns how far the
    /// places are from these samples along each axis, in sample spacings.
    #[inline(always)]
    fn load_even<S: Simd, const N: usize, const WIDE: usize, const ALL: usize>(
        &self,
        simd: S,
        part: &Part,
        place: [Lanes<S>; 3],
        values: &mut [Lanes<S>; ALL],
    ) -> [[Lanes<S>; N]; 3] {
        let starts = three!(I => {
            let last = part.dims[I] as f32 - N as f32;
            // The first sample of an even number around the cell, or of an odd number around the
            // nearest sample.
            let start = (place[I] - (N as f32 * 0.5 - 1.0)).floor();
            start.min(Lanes::splat(simd, last)).max(Lanes::splat(simd, 0.0))
        });
        let away = three!(I => {
            let mut away = [Lanes::splat(simd, FAR); N];
            for (tap, distance) in away.iter_mut().enumerate().take(part.dims[I]) {
                *distance = (place[I] - starts[I] - tap as f32) * self.blend.per_step;
            }
            away
        });
        let around = Around { starts, rows: u32::MAX, slices: u32::MAX };
        self.load::<S, N, WIDE, ALL>(simd, part, &around, values);
        away
    }

    /// Loads the values of samples of a part, `N` along each axis. Samples that the lattice lacks
    /// get arbitrary values.
    #[inline(always)]
    fn load<S: Simd, const N: usize, const WIDE: usize, const ALL: usize>(
        &self,
        simd: S,
        part: &Part,
        around: &Around<S>,
        values: &mut [Lanes<S>; ALL],
    ) {
        let zero = self.zero;
        // A separate function for each type of samples; the code that sums is the same for all.
        simd.vectorize(
            #[inline(always)]
            || match self.samples {
                Source::Coefficients(coefficients) => {
                    part.load::<S, f32, N, WIDE, ALL>(simd, coefficients, zero, around, values);
                }
                Source::Samples(SampleSlice::F32(samples)) => {
                    part.load::<S, f32, N, WIDE, ALL>(simd, samples, zero, around, values);
                }
                Source::Samples(SampleSlice::U8(samples)) => {
                    part.load::<S, u8, N, WIDE, ALL>(simd, samples, zero, around, values);
                }
                Source::Samples(SampleSlice::U16(samples)) => {
                    part.load::<S, u16, N, WIDE, ALL>(simd, samples, zero, around, values);
                }
                Source::Samples(SampleSlice::I16(samples)) => {
                    part.load::<S, i16, N, WIDE, ALL>(simd, samples, zero, around, values);
                }
                Source::Samples(SampleSlice::I32(samples)) => {
                    part.load::<S, i32, N, WIDE, ALL>(simd, samples, zero, around, values);
                }
            },
        );
    }
}

/// The samples around eight places.
struct Around<S: Simd> {
    /// The first sample along each axis.
    starts: [Lanes<S>; 3],
    /// The rows of slices and the slices that are needed, a bit for each.
    rows: u32,
    slices: u32,
}

/// One of the Cartesian lattices that make up a lattice.
#[derive(Debug)]
struct Part {
    /// Index of the first sample, and the samples from one row to the next and from one slice to
    /// the next.
    first: usize,
    row: usize,
    slice: usize,
    dims: [usize; 3],
    /// The place of the first sample, and the offset from there to the last one, in steps.
    shift: [f32; 3],
    size: [f32; 3],
}

/// The weights of samples.
#[derive(Debug)]
enum Form {
    Radial(Radial),
    /// Gaussians: log₂ of the weight of a sample at distance 1, and the distance from the ray at
    /// which they are cut, if any.
    Bells {
        log: f32,
        radius: Option<f32>,
    },
    Rectilinear(Box<Axes>),
}

/// A lattice and its kernel.
#[derive(Debug)]
pub struct Blend {
    parts: Vec<Part>,
    form: Form,
    /// Number of samples along each axis of each part that a place reads.
    taps: usize,
    /// The number of sample spacings per step.
    per_step: f32,
    extent: f32,
    /// The minimum sum of kernels.
    least: f32,
    /// The cells for which visibility is looked up.
    cells: Lattice,
}

impl Blend {
    /// Prepares sums over `taps` samples along each axis.
    pub fn new(volume: &Volume, kernel: &Kernel, taps: usize) -> Self {
        let lattice = volume.drawn_lattice();
        let [nx, ny, nz] = lattice.dims;
        let whole = |size| Part {
            first: 0,
            row: nx,
            slice: nx * ny,
            dims: lattice.dims,
            shift: [0.0; 3],
            size,
        };
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
                // Every second layer, starting with the first and with the second one.
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
                form = Form::Rectilinear(Box::new(axes));
                let size = [0, 1, 2]
                    .map(|axis| (places[axis][lattice.dims[axis] - 1] - first[axis]) as f32);
                (
                    vec![whole(size)],
                    Lattice::cartesian(dims, origin, lattice.axes * DMat3::from_diagonal(widths)),
                )
            }
        };
        Self {
            parts,
            form,
            taps,
            per_step: if lattice.arrangement == Arrangement::BodyCentred {
                std::f32::consts::SQRT_2
            } else {
                1.0
            },
            extent: kernel.extent as f32,
            least: kernel.least_sum() as f32,
            cells,
        }
    }

    /// Returns the Cartesian lattice of cells for which [`ranges`](Self::ranges) bounds the field.
    pub fn cells(&self) -> &Lattice {
        &self.cells
    }

    /// Returns the number of cells per step along each axis, and the position of the lattice's
    /// first sample in cells. `drawn_from` is the place of the volume's first sample on the drawn
    /// lattice, in steps.
    pub fn to_cells(&self, drawn_from: [f32; 3]) -> [[f32; 3]; 2] {
        match &self.form {
            Form::Rectilinear(axes) => {
                [axes.cells().1.map(|width| (1.0 / width) as f32), [-0.5; 3]]
            }
            _ => [[1.0; 3], drawn_from],
        }
    }

    /// Returns the range of the field in each cell and half a cell around it, in steps of 1/255 of
    /// the volume's range.
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
                    // A place may be nearer to a layer whose ranges are not looked up.
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

    /// Widens the ranges by the overshoot of kernels with values of both signs. The overshoot
    /// follows from the sum of the weights' magnitudes relative to the sum of the weights. At the
    /// border, the weights add up to the minimum sum in the worst case.
    fn widen(&self, ranges: &mut [[u8; 2]], lattice: &Lattice, kernel: &Kernel) {
        if !kernel.is_signed() {
            return;
        }
        let (mut inside, mut largest) = (1.0f64, 0.0f64);
        let half = self.taps as i32 / 2 + 1;
        for place in 0..9usize.pow(3) {
            let place = [place % 9, place / 9 % 9, place / 81].map(|at| at as f64 / 8.0);
            let (mut sum, mut size) = (0.0, 0.0);
            for part in &self.parts {
                for tap in 0..(2 * half + 2).pow(3) {
                    let side = 2 * half + 2;
                    let at = [tap % side, tap / side % side, tap / side / side]
                        .map(|at| f64::from(at - half));
                    let away =
                        [0, 1, 2].map(|axis| place[axis] - at[axis] - f64::from(part.shift[axis]));
                    let weight =
                        kernel.value(DVec3::from_array(away).length() * f64::from(self.per_step));
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
            let is_inside = (0..3).all(|axis| {
                index[axis] >= reach[axis] && index[axis] + reach[axis] < lattice.dims[axis]
            });
            *range = if is_inside { &inside } else { &outside }.widen([*range].into_iter());
        }
    }
}

impl Part {
    /// Loads the values of the needed samples, relative to `zero`.
    #[inline(always)]
    fn load<S: Simd, T: Sample, const N: usize, const WIDE: usize, const ALL: usize>(
        &self,
        simd: S,
        samples: &[T],
        zero: f32,
        &Around { starts, rows, slices }: &Around<S>,
        values: &mut [Lanes<S>; ALL],
    ) {
        let samples = &samples[self.first..];
        let mut first: [[i32; 8]; 3] = three!(I => i32x8::<S>::truncate_from(starts[I]).into());
        let Self { row, slice, dims, .. } = *self;
        if dims.iter().any(|&count| count < WIDE) {
            // Sample by sample.
            for (at, value) in values.iter_mut().enumerate() {
                let tap = [at % N, at / N % N, at / (N * N)];
                let lanes = each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
                    let [x, y, z] = three!(I => (first[I][L] as usize + tap[I]).min(dims[I] - 1));
                    samples[z * slice + y * row + x].value() - zero
                });
                *value = lanes.simd_into(simd);
            }
            return;
        }
        let mut places = [0; 8];
        // Rows that would extend beyond the lattice's last sample begin one sample earlier.
        let mut is_moved = [0.0; 8];
        for lane in 0..8 {
            let last = (dims[0] - WIDE) as i32;
            is_moved[lane] = (first[0][lane] - last).max(0) as f32;
            first[0][lane] = first[0][lane].min(last);
            places[lane] = first[2][lane] as usize * slice
                + first[1][lane] as usize * row
                + first[0][lane] as usize;
        }
        let is_moved = SimdInto::<Lanes<S>, S>::simd_into(is_moved, simd).simd_gt(0.5);
        let any_moved = N < WIDE && is_moved.any_true();
        let window = Window::<T, WIDE, N>::new(samples, places, row, slice);
        let mut loaded = [Lanes::splat(simd, 0.0); WIDE];
        for k in 0..N {
            for j in 0..N {
                if (rows >> j) & (slices >> k) & 1 == 0 {
                    continue;
                }
                let mut at = 0;
                while at + 4 <= WIDE {
                    loaded[at..at + 4].copy_from_slice(&T::four(simd, &window, [at, j, k]));
                    at += 4;
                }
                if at < WIDE {
                    loaded[at..].copy_from_slice(&T::two(simd, &window, [at, j, k]));
                }
                let row_values = &mut values[(k * N + j) * N..][..N];
                for tap in 0..N {
                    row_values[tap] = loaded[tap] - zero;
                    if any_moved {
                        row_values[tap] =
                            is_moved.select(loaded[(tap + 1) % WIDE] - zero, row_values[tap]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::vector::lanes;
    use crate::{cpu::field::Typed, volume::Samples};
    use fearless_simd::Level;
    use std::sync::Arc;

    /// Random bytes, the same in every run, as samples of any type.
    fn volume(lattice: Lattice, kind: usize) -> Volume {
        let mut random = 3u64;
        let mut byte = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 56) as u8
        };
        let bytes: Vec<u8> = (0..lattice.len()).map(|_| byte()).collect();
        let samples = match kind % 5 {
            0 => Samples::U8(bytes),
            1 => Samples::U16(bytes.into_iter().map(u16::from).collect()),
            2 => Samples::I16(bytes.into_iter().map(i16::from).collect()),
            3 => Samples::I32(bytes.into_iter().map(i32::from).collect()),
            _ => Samples::F32(bytes.into_iter().map(f32::from).collect()),
        };
        Volume::new(lattice, samples).unwrap()
    }

    fn cartesian(dims: [usize; 3]) -> Lattice {
        Lattice::with_spacing(dims, DVec3::ONE)
    }

    fn body_centred(dims: [usize; 3]) -> Lattice {
        Lattice::body_centred(dims, DVec3::ZERO, DMat3::IDENTITY)
    }

    fn rectilinear(dims: [usize; 3], steps: &[f64]) -> Lattice {
        let axis = |count: usize| {
            let mut at = 2.0;
            let step = |i: usize| {
                at += steps[i % steps.len()];
                at
            };
            (0..count).map(step).collect::<Vec<f64>>()
        };
        let arrangement = Arrangement::Rectilinear(Arc::new(dims.map(axis)));
        Lattice { arrangement, ..cartesian(dims) }
    }

    /// All combinations that are gathered by sums.
    fn kinds() -> Vec<(Volume, Kernel)> {
        let gaussian = |sigma, extent| Kernel::gaussian(sigma, extent).unwrap();
        let table =
            Kernel::table((0..=64).map(|at| (1.0 - f64::from(at) / 64.0).powi(2)).collect(), 1.8)
                .unwrap();
        let mut cases = Vec::new();
        for (kind, kernel) in [
            Kernel::b_spline(2.0).unwrap(),
            Kernel::b_spline(1.3).unwrap(),
            Kernel::hann(3.0).unwrap(),
            Kernel::hann(4.0).unwrap(),
            table.clone(),
            gaussian(0.6, 1.5),
            gaussian(0.9, 1.2),
            gaussian(0.9, 3.0),
            gaussian(1.5, 6.0),
        ]
        .into_iter()
        .enumerate()
        {
            cases.push((volume(cartesian([13, 12, 14]), kind), kernel.clone()));
            cases.push((volume(cartesian([14, 1, 5]), kind + 1), kernel));
        }
        for (kind, kernel) in [
            gaussian(0.6, 2.0),
            gaussian(0.6, 1.3),
            Kernel::b_spline(2.0).unwrap(),
            Kernel::hann(3.0).unwrap(),
            table,
        ]
        .into_iter()
        .enumerate()
        {
            cases.push((volume(body_centred([9, 8, 17]), kind), kernel.clone()));
            cases.push((volume(body_centred([3, 9, 6]), kind + 1), kernel.clone()));
            cases.push((volume(body_centred([7, 2, 1]), kind + 2), kernel));
        }
        for (kind, steps) in
            [&[1.0][..], &[0.5, 0.7, 1.0, 1.4, 2.0, 1.2], &[1.0, 3.0], &[0.3, 0.3, 0.3, 0.9]]
                .into_iter()
                .enumerate()
        {
            cases.push((volume(rectilinear([12, 13, 11], steps), kind), gaussian(0.6, 2.0)));
            cases.push((volume(rectilinear([1, 3, 12], steps), kind + 1), gaussian(0.6, 2.0)));
        }
        let kernel = gaussian(0.7, 3.0);
        let sharp = |lattice: Lattice| volume(lattice, 4).sharpened(&kernel).unwrap();
        cases.push((sharp(cartesian([8, 9, 7])), kernel.clone()));
        cases.push((sharp(body_centred([6, 5, 9])), kernel.clone()));
        cases
    }

    /// Returns h and h′(r)/r.
    fn weight_of(kernel: &Kernel, r: f64) -> [f64; 2] {
        if let Profile::Gaussian(sigma) = kernel.profile {
            let h = (-0.5 * (r / sigma).powi(2)).exp();
            return [h, -h / (sigma * sigma)];
        }
        let r = r.max(1e-6);
        [kernel.value(r), (kernel.value(r + 1e-6) - kernel.value(r - 1e-6)) / 2e-6 / r]
    }

    /// Returns the gradient at a sample of a rectilinear lattice, from its neighbours.
    fn slope_at(volume: &Volume, at: usize) -> DVec3 {
        let lattice = &volume.lattice;
        let index = lattice.index(at);
        let stride = [1, lattice.dims[0], lattice.dims[0] * lattice.dims[1]];
        DVec3::from_array([0, 1, 2].map(|axis| {
            let here = lattice.steps(index)[axis];
            let beside = |other: usize| {
                let mut neighbour = index;
                neighbour[axis] = other;
                let sample = at + other * stride[axis] - index[axis] * stride[axis];
                (volume.value(sample) - volume.value(at), lattice.steps(neighbour)[axis] - here)
            };
            let before =
                index[axis].checked_sub(1).map(beside).map(|(rise, away)| (rise / away, -away));
            let after = (index[axis] + 1 < lattice.dims[axis]).then(|| beside(index[axis] + 1));
            match (before, after.map(|(rise, away)| (rise / away, away))) {
                (Some((a, d)), Some((b, e))) => (a * e + b * d) / (d + e),
                (Some((slope, _)), None) | (None, Some((slope, _))) => slope,
                (None, None) => 0.0,
            }
        }))
    }

    /// Returns the sum of the weights, the value and its changes per step, over all samples in
    /// double precision.
    fn truth(volume: &Volume, kernel: &Kernel, place: DVec3, way: DVec3) -> [f64; 5] {
        let lattice = volume.drawn_lattice();
        let (mut weight, mut value) = (0.0, 0.0);
        let (mut weight_slopes, mut value_slopes) = (DVec3::ZERO, DVec3::ZERO);
        let is_sloped = matches!(lattice.arrangement, Arrangement::Rectilinear(_));
        for at in 0..lattice.len() {
            let index = lattice.index(at);
            let steps = lattice.steps(index) - lattice.step_range().min;
            let unit = lattice.unit(index);
            let away = place - steps;
            let [h, s] = weight_of(kernel, (away / unit).length());
            let beside = (away / unit - way * (away / unit).dot(way)).length();
            // Beyond the extent there is no kernel. On rectilinear lattices, Gaussians are not cut.
            if beside > kernel.extent && !is_sloped {
                continue;
            }
            let slope = if is_sloped { slope_at(volume, at) } else { DVec3::ZERO };
            let sample = volume.drawn_value(at) + slope.dot(away);
            let h_slope = s * away / (unit * unit);
            weight += h;
            value += h * sample;
            weight_slopes += h_slope;
            value_slopes += h_slope * sample + h * slope;
        }
        let value = value / weight;
        let slopes = (value_slopes - value * weight_slopes) / weight;
        [weight, value, slopes.x, slopes.y, slopes.z]
    }

    fn evaluate(typed: &Typed, places: [[f32; 8]; 3], way: [f32; 3]) -> [[f32; 8]; 5] {
        #[inline(always)]
        fn at<S: Simd>(
            simd: S,
            blended: &Blended,
            places: [[f32; 8]; 3],
            way: [f32; 3],
        ) -> [[f32; 8]; 5] {
            let way = three!(I => Lanes::splat(simd, way[I]));
            let Point { value, slopes: [x, y, z], weight } =
                blended.at(simd, three!(I => places[I].simd_into(simd)), way);
            [weight, value, x, y, z].map(Into::into)
        }
        let Typed::Blend(blended) = typed else { panic!("no sums") };
        lanes!(Level::new(), simd => at(simd, blended, places, way))
    }

    /// Returns places in the box of a lattice, or up to `beyond` steps outside it, in steps from
    /// its first sample.
    fn places(lattice: &Lattice, round: usize, beyond: f64) -> [[f32; 8]; 3] {
        let size = lattice.step_range().size();
        [0, 1, 2].map(|axis| {
            std::array::from_fn(|lane| {
                let part = ((round * 8 + lane) as f64 * [0.618, 0.7549, 0.5698][axis]).fract();
                (part * (size[axis] + 2.0 * beyond) - beyond) as f32
            })
        })
    }

    #[test]
    fn fields_are_quotients_of_sums_over_all_samples() {
        for (volume, kernel) in kinds() {
            let Ok(Way::Blend(taps)) = Way::of(&volume, &kernel) else { panic!("{kernel:?}") };
            let blend = Blend::new(&volume, &kernel, taps);
            let way = DVec3::new(1.0, 2.0, -0.5).normalize();
            let lattice = volume.drawn_lattice();
            let name =
                format!("{:?} on {:?} of {:?}", kernel.profile, lattice.arrangement, lattice.dims);
            // For Gaussians, weights below a two-hundredth may be left out, or counted beyond the
            // extent.
            let is_cut = matches!(kernel.profile, Profile::Gaussian(_));
            let (mut compared, mut error, mut slope_error) = (0, 0.0f64, 0.0f64);
            for zero in [0.0, 100.0] {
                let typed = Typed::blended(&volume, &blend, zero);
                for round in 0..20 {
                    let places = places(lattice, round, if round < 15 { 0.0 } else { 0.7 });
                    let results =
                        evaluate(&typed, places, way.as_vec3().to_array().map(|along| 3.0 * along));
                    for lane in 0..8 {
                        let place = DVec3::from_array(places.map(|lanes| f64::from(lanes[lane])));
                        let expected = truth(&volume, &kernel, place, way);
                        let [weight, actual @ ..] = results.map(|lanes| f64::from(lanes[lane]));
                        let least = kernel.least_sum();
                        let near = if is_cut { 0.01 + 0.05 * expected[0] } else { 1e-4 };
                        assert!(
                            (weight + least - expected[0]).abs() < near,
                            "{name}: {weight} {least} {expected:?} at {place}"
                        );
                        if expected[0] < least + if is_cut { 0.3 } else { 0.02 } {
                            continue;
                        }
                        compared += 1;
                        error += (actual[0] + zero - expected[1]).powi(2);
                        slope_error +=
                            (1..4).map(|i| (actual[i] - expected[i + 1]).powi(2)).sum::<f64>();
                    }
                }
            }
            assert!(compared > 20, "{name}: {compared}");
            let [error, slope_error] =
                [error, slope_error].map(|sum| (sum / f64::from(compared)).sqrt());
            // Errors of values in bytes.
            let most = if is_cut { [1.5, 8.0] } else { [2e-3, 0.1] };
            assert!(
                error < most[0] && slope_error < most[1],
                "{name}: off by {error}, slopes by {slope_error}"
            );
        }
    }

    /// A step from 100 to 150 on the same lattice, in a range of 0 to 255. Fields overshoot beside
    /// the step.
    fn stepped(volume: &Volume) -> Volume {
        let last = volume.lattice.len() - 1;
        let value = |at: usize| match at {
            0 => 0,
            at if at == last => 255,
            at => 100 + 50 * u8::from(at > last / 2),
        };
        Volume::new(volume.lattice.clone(), Samples::U8((0..=last).map(value).collect())).unwrap()
    }

    #[test]
    fn fields_lie_in_the_ranges_of_their_cells() {
        let steps = kinds().into_iter().filter(|(volume, _)| volume.coefficients.is_none());
        let steps = steps.map(|(volume, kernel)| (stepped(&volume), kernel));
        for (volume, kernel) in kinds().into_iter().chain(steps) {
            let Ok(Way::Blend(taps)) = Way::of(&volume, &kernel) else { panic!("{kernel:?}") };
            let blend = Blend::new(&volume, &kernel, taps);
            let ranges = blend.ranges(&volume, &kernel);
            let dims = blend.cells().dims;
            assert_eq!(ranges.len(), dims.iter().product::<usize>());
            let before = volume.lattice.origin - volume.drawn_lattice().origin;
            let [scale, shift] = blend.to_cells(before.as_vec3().to_array());
            let typed = Typed::blended(&volume, &blend, 0.0);
            for round in 0..40 {
                let places = places(&volume.lattice, round, 0.0);
                let drawn =
                    [0, 1, 2].map(|axis| places[axis].map(|place| place + before[axis] as f32));
                let [weight, value, ..] = evaluate(&typed, drawn, [1.0, 2.0, -0.5]);
                for lane in (0..8).filter(|lane| weight[*lane] > 0.0) {
                    let cell = [0, 1, 2].map(|axis| {
                        let at = places[axis][lane] * scale[axis] + shift[axis];
                        at.round().clamp(0.0, dims[axis] as f32 - 1.0) as usize
                    });
                    let [low, high] = ranges[(cell[2] * dims[1] + cell[1]) * dims[0] + cell[0]];
                    let [first, last] = volume.range;
                    let step = (f64::from(value[lane]) - first) * 255.0 / (last - first);
                    // Ranges are clamped to that of the samples.
                    let step = step.clamp(0.0, 255.0);
                    assert!(
                        step >= f64::from(low) - 0.5 && step <= f64::from(high) + 0.5,
                        "{:?} on {:?}: {step} at {cell:?} of {dims:?} is not in {low} … {high}",
                        kernel.profile,
                        volume.lattice.arrangement
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_not_gathered_is_refused() {
        let check = |lattice: Lattice, kernel: Kernel, what: &str| {
            let message = Way::of(&volume(lattice, 0), &kernel).unwrap_err();
            assert!(message.contains(what), "{message}");
        };
        check(cartesian([4; 3]), Kernel::hann(4.2).unwrap(), "too many");
        check(cartesian([4; 3]), Kernel::gaussian(2.0, 9.0).unwrap(), "too many");
        check(cartesian([4; 3]), Kernel::b_spline(1.1).unwrap(), "narrower");
        check(body_centred([4; 3]), Kernel::gaussian(0.29, 2.0).unwrap(), "narrower");
        check(
            rectilinear([4; 3], &[1.0]),
            Kernel::gaussian(0.6, 1.5).unwrap(),
            "still have weight",
        );
        check(
            rectilinear([40; 3], &[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 20.0]),
            Kernel::default(),
            "far more samples",
        );
        assert!(
            Way::of(&volume(cartesian([4; 3]), 0), &Kernel::default())
                == Ok(Way::Plain(Weighting::Gaussian(0.6)))
        );
    }
}
