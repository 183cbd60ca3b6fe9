//! What a splat's neighbourhood can show: the range of the samples around each sample. A kernel
//! mixes the samples that it reaches. If the transfer function is clear over their whole range, the
//! splats between them cannot be seen, and the engine skips them.

use super::{TransferFunction, Volume, steps::Steps};
use crate::parallel::{self, prelude::*};

/// Returns, for each sample in memory order, the smallest and the largest value in a box around it.
/// The box reaches ±`radius` samples along each axis and ends at the volume's border. Both are in
/// steps of 1/255 of the volume's range, the smallest rounded down and the largest rounded up.
/// [`first_visible`] decides which ranges show something.
///
/// The extremes of a box are computed one axis after the other. The smallest values and 255 minus
/// the largest are adjacent, so that one minimum of bytes serves both. Rounding preserves the order
/// and can therefore come first. Memory beside the result: 2·`radius[2]` + 3 slices per thread.
///
/// # Panics
/// If the samples do not fill the lattice.
pub fn neighbourhood_ranges(volume: &Volume, radius: [usize; 3]) -> Vec<[u8; 2]> {
    ranges_of_steps(volume, Joined::Smallest(radius), turn_all)
}

fn turn_all(_: usize, ranges: &mut [[u8; 2]]) {
    ranges.iter_mut().for_each(|range| *range = turned(*range));
}

/// Returns for each sample what `combine` makes of two such ranges: those of the samples next to
/// it, and of the samples up to two steps away. The second follow from the first. `combine` takes
/// the first, and replaces the second by the result. In all of them, the second number is 255 minus
/// the largest value.
///
/// # Panics
/// If the samples do not fill the lattice.
pub fn near_and_far_ranges(
    volume: &Volume,
    combine: impl Fn(&[[u8; 2]], &mut [[u8; 2]]) + Sync,
) -> Vec<[u8; 2]> {
    let dims = volume.lattice.dims;
    let near = ranges_of_steps(volume, Joined::Smallest([1; 3]), |_, _| ());
    let fill = |row: usize, out: &mut [[u8; 2]]| {
        out.copy_from_slice(&near[row * dims[0]..][..dims[0]]);
    };
    let finish = |first: usize, out: &mut [[u8; 2]]| {
        combine(&near[first..][..out.len()], out);
        out.iter_mut().for_each(|range| *range = turned(*range));
    };
    boxes(dims, Joined::Smallest([1; 3]), fill, finish)
}

/// Parts of the weight of samples along an axis, in 256ths.
#[derive(Debug, Clone, Copy)]
pub struct Shares {
    /// The most that the samples next to a sample weigh.
    pub near: u8,
    /// The most that those two steps away weigh.
    pub far: u8,
    /// The least that both weigh together.
    pub others: u8,
}

/// Returns for each sample the range of the field around it. The field is a mean of the samples up
/// to two steps away along each axis, weighted by products of the axes' weights. The result is in
/// steps of the volume's range, as that of [`neighbourhood_ranges`] is.
///
/// # Panics
/// If the samples do not fill the lattice, or if the shares exceed 1 together.
pub fn weighted_ranges(volume: &Volume, shares: Shares) -> Vec<[u8; 2]> {
    let most = u16::from(shares.near) + u16::from(shares.far);
    assert!(most <= 256, "the shares {shares:?} exceed 1");
    ranges_of_steps(volume, Joined::Weighted(shares), turn_all)
}

/// How a sample and its neighbours along an axis become one pair of a range's smallest number and
/// 255 minus the largest one.
#[derive(Clone, Copy)]
enum Joined {
    /// The smallest numbers of samples up to so many steps away.
    Smallest([usize; 3]),
    /// The smallest weighted mean of samples up to two steps away.
    Weighted(Shares),
}

impl Joined {
    /// Returns how far the neighbours are along an axis of `count` samples.
    fn reach(self, axis: usize, count: usize) -> usize {
        match self {
            Self::Smallest(radius) => radius[axis].min(count.saturating_sub(1)),
            Self::Weighted(_) => 2,
        }
    }

    /// Sets `out` to what becomes of a line of samples. `line` returns that line and its neighbours
    /// across, from `reach` before it to `reach` behind it.
    fn join<'a>(self, out: &mut [[u8; 2]], reach: usize, line: impl Fn(usize) -> &'a [[u8; 2]]) {
        let shares = match self {
            Self::Weighted(shares) => shares,
            Self::Smallest(_) => {
                out.copy_from_slice(line(reach));
                (0..=2 * reach).for_each(|number| smaller(out, line(number)));
                return;
            }
        };
        let [near_share, far_share, others_share] =
            [shares.near, shares.far, shares.others].map(u16::from);
        let [before, near_before, own, near_behind, behind] =
            [0, 1, 2, 3, 4].map(|number| line(number).as_flattened());
        let near = near_before.iter().zip(near_behind);
        let far = before.iter().zip(behind);
        let out = out.as_flattened_mut().iter_mut();
        for (((out, own), near), far) in out.zip(own).zip(near).zip(far) {
            let (near, far) = (*near.0.min(near.1), *far.0.min(far.1));
            let below = |other: u8| u16::from(own.saturating_sub(other));
            // At most all that it lies above them, as the shares are at most 1.
            let down = (below(near) * near_share + below(far) * far_share + 255) >> 8;
            // Others raise the mean of a sample that lies below all of them. One at the border is
            // its own neighbour, so nothing raises it: samples outside weigh nothing.
            let up = (u16::from(near.min(far).saturating_sub(*own)) * others_share) >> 8;
            *out = own - down as u8 + up as u8;
        }
    }
}

/// Returns the ranges around the samples of a volume after `finish`: see [`boxes`].
fn ranges_of_steps(
    volume: &Volume,
    joined: Joined,
    finish: impl Fn(usize, &mut [[u8; 2]]) + Sync,
) -> Vec<[u8; 2]> {
    let steps = Steps::new(volume.samples.scalar(), volume.range);
    let (samples, count) = (volume.samples.bytes(), volume.lattice.dims[0]);
    let fill = |row: usize, out: &mut [[u8; 2]]| steps.write(steps.from(samples, row * count), out);
    boxes(volume.lattice.dims, joined, fill, finish)
}

/// Returns a range with 255 minus its second number in place of that number.
pub fn turned([low, high]: [u8; 2]) -> [u8; 2] {
    [low, 255 - high]
}

/// Returns what becomes of samples and the boxes around them, one axis after the other. `fill`
/// writes the pairs of a row. `finish` changes a slice of the result; the number of its first
/// sample comes with it. Beyond the borders, the outermost samples repeat.
fn boxes(
    dims: [usize; 3],
    joined: Joined,
    fill: impl Fn(usize, &mut [[u8; 2]]) + Sync,
    finish: impl Fn(usize, &mut [[u8; 2]]) + Sync,
) -> Vec<[u8; 2]> {
    let [nx, ny, nz] = dims;
    let slice = nx * ny;
    let [rx, ry, rz] = [0, 1, 2].map(|axis| joined.reach(axis, dims[axis]));
    // Every slab recomputes the slices that reach into it, so slabs are thick compared with the
    // radius.
    let slab = nz.div_ceil(4 * parallel::current_num_threads()).max(8 * rz).max(1);
    let mut ranges = vec![[0u8; 2]; slice * nz];
    ranges.par_chunks_mut((slab * slice).max(1)).enumerate().for_each(|(index, slab_ranges)| {
        let mut scratch = vec![[0u8; 2]; slice];
        let mut row = vec![[0u8; 2]; nx + 2 * rx];
        // Slices that are finished along x and y: slice k is in entry k modulo the length.
        let mut ring = vec![vec![[0u8; 2]; slice]; 2 * rz + 1];
        let first = index * slab;
        let mut next = first.saturating_sub(rz);
        for (k, out) in (first..).zip(slab_ranges.chunks_mut(slice)) {
            while next < (k + rz + 1).min(nz) {
                for (j, out) in scratch.chunks_mut(nx).enumerate() {
                    fill(next * ny + j, &mut row[rx..rx + nx]);
                    let ends = [row[rx], row[rx + nx - 1]];
                    row[..rx].fill(ends[0]);
                    row[rx + nx..].fill(ends[1]);
                    joined.join(out, rx, |number| &row[number..number + nx]);
                }
                let place = next % ring.len();
                for (j, out) in ring[place].chunks_mut(nx).enumerate() {
                    joined.join(out, ry, |number| {
                        let other = (j + number).saturating_sub(ry).min(ny - 1);
                        &scratch[other * nx..(other + 1) * nx]
                    });
                }
                next += 1;
            }
            joined.join(out, rz, |number| {
                &ring[(k + number).saturating_sub(rz).min(nz - 1) % ring.len()]
            });
            finish(k * slice, out);
        }
    });
    ranges
}

/// What [`first_visible`] would return if everything showed. Pictures that mix samples farther
/// apart than the ranges cover use it.
pub const EVERYTHING: [u16; 256] = [0; 256];

/// Returns, for each smallest step, the lowest largest step at which the range shows something, or
/// 256 if none does. A sample of the neighbourhood `[low, high]` may be skipped if `high <
/// first_visible[low]`.
pub fn first_visible(transfer: &TransferFunction, range: [f64; 2]) -> [u16; 256] {
    let step = (range[1] - range[0]) / 255.0;
    let value = |steps: u16| range[0] + f64::from(steps) * step;
    // A step's value may miss the sample's by a rounding error. That matters where opacity jumps,
    // not where it rises.
    let slack = step * 1e-7;
    let jumps = |value: f64| transfer.opacity(value) > 1e-5;
    let shows = |low: u16, high: u16| {
        let [from, to] = [low, high].map(value);
        transfer.visible([from, to]) || jumps(from - slack) || jumps(to + slack)
    };
    let mut first = [256; 256];
    for low in (0..256).rev() {
        first[usize::from(low)] = match low {
            _ if shows(low, low) => low,
            255 => 256,
            _ if shows(low, low + 1) => low + 1,
            // Otherwise what shows from the next step on.
            _ => first[usize::from(low) + 1],
        };
    }
    first
}

fn smaller(into: &mut [[u8; 2]], other: &[[u8; 2]]) {
    for (a, b) in into.as_flattened_mut().iter_mut().zip(other.as_flattened()) {
        *a = (*a).min(*b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};
    use glam::DVec3;

    /// A small generator of random bits (Marsaglia's xorshift, 2003).
    struct Random(u64);

    impl Random {
        fn next(&mut self, below: u64) -> u64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) % below
        }
    }

    fn random_volume(random: &mut Random) -> Volume {
        let dims = [0; 3].map(|_| 1 + random.next(9) as usize);
        let count = dims.iter().product::<usize>();
        // Mostly one value, so that boxes differ.
        let mut bits = || if random.next(10) == 0 { random.next(1 << 32) } else { 1 << 30 };
        let bits: Vec<u64> = (0..count).map(|_| bits()).collect();
        let samples = match random.next(5) {
            0 => Samples::U8(bits.iter().map(|&b| b as u8 / 3).collect()),
            1 => Samples::U16(bits.iter().map(|&b| b as u16).collect()),
            2 => Samples::I16(bits.iter().map(|&b| b as i16).collect()),
            3 => Samples::I32(bits.iter().map(|&b| b as i32).collect()),
            _ => Samples::F32(bits.iter().map(|&b| (b as f32).sin()).collect()),
        };
        Volume::new(Lattice::with_spacing(dims, DVec3::ONE), samples).unwrap()
    }

    #[test]
    fn agrees_with_brute_force() {
        let mut random = Random(7);
        for _ in 0..300 {
            let volume = random_volume(&mut random);
            let radius: [usize; 3] = std::array::from_fn(|_| random.next(5) as usize);
            let [nx, ny, _] = volume.lattice.dims;
            let [lowest, highest] = volume.range;
            let scale = if highest > lowest { 255.0 / (highest - lowest) } else { 0.0 };
            let around = |i: usize, axis: usize| {
                let (radius, n) = (radius[axis], volume.lattice.dims[axis]);
                i.saturating_sub(radius)..(i + radius + 1).min(n)
            };
            let ranges = neighbourhood_ranges(&volume, radius);
            assert_eq!(ranges.len(), volume.len());
            for (index, range) in ranges.into_iter().enumerate() {
                let (i, j, k) = (index % nx, index / nx % ny, index / nx / ny);
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for c in around(k, 2) {
                    for b in around(j, 1) {
                        for a in around(i, 0) {
                            let value = volume.value((c * ny + b) * nx + a);
                            (low, high) = (low.min(value), high.max(value));
                        }
                    }
                }
                let expected =
                    [((low - lowest) * scale).floor(), ((high - lowest) * scale).ceil().min(255.0)];
                assert_eq!(
                    range.map(f64::from),
                    expected,
                    "sample {index} of {:?}, radius {radius:?}",
                    volume.lattice.dims
                );
            }
        }
    }

    #[test]
    fn far_ranges_follow_from_near_ones() {
        let mut random = Random(11);
        for _ in 0..100 {
            let volume = random_volume(&mut random);
            let [near, far] = [1, 2].map(|radius| neighbourhood_ranges(&volume, [radius; 3]));
            assert_eq!(near_and_far_ranges(&volume, |near, out| out.copy_from_slice(near)), near);
            assert_eq!(near_and_far_ranges(&volume, |_, _| ()), far);
        }
    }

    #[test]
    fn weighted_means_stay_in_their_ranges() {
        let mut random = Random(13);
        let shares = Shares { near: 150, far: 40, others: 60 };
        for _ in 0..100 {
            let volume = random_volume(&mut random);
            let dims = volume.lattice.dims;
            let [lowest, highest] = volume.range;
            let scale = if highest > lowest { 255.0 / (highest - lowest) } else { 0.0 };
            let ranges = weighted_ranges(&volume, shares);
            for (index, range) in ranges.iter().enumerate() {
                let at = [index % dims[0], index / dims[0] % dims[1], index / dims[0] / dims[1]];
                // Weights of a sample, of the next one and the one behind it, on either side.
                let weights = [0; 3].map(|_| {
                    let mut parts = [shares.near, shares.far]
                        .map(|most| random.next(u64::from(most) + 1) as f64 / 256.0);
                    let least = f64::from(shares.others) / 256.0;
                    if parts[0] + parts[1] < least {
                        parts[0] = least - parts[1];
                    }
                    [1.0 - parts[0] - parts[1], parts[0], parts[1]]
                });
                let sides = [0; 3].map(|_| random.next(2) as isize * 2 - 1);
                let mut mean = 0.0;
                for tap in 0..27 {
                    let steps = [tap % 3, tap / 3 % 3, tap / 9];
                    let [i, j, k] = [0, 1, 2].map(|axis| {
                        let place = at[axis] as isize + sides[axis] * steps[axis] as isize;
                        place.clamp(0, dims[axis] as isize - 1) as usize
                    });
                    let weight: f64 = (0..3).map(|axis| weights[axis][steps[axis]]).product();
                    mean += weight * volume.value((k * dims[1] + j) * dims[0] + i);
                }
                let mean = (mean - lowest) * scale;
                let [low, high] = range.map(f64::from);
                assert!(low - 1e-6 <= mean && mean <= high + 1e-6, "{index} {low} {mean} {high}");
            }
        }
    }

    #[test]
    fn visible_steps_keep_what_shows() {
        let json = r#"{"color": [[0, 1, 1, 1]],
            "opacity": [[30, 0], [40, 0.5], [50, 0], [200, 0], [210, 1]]}"#;
        let transfer = TransferFunction::from_json(json).unwrap();
        let first = first_visible(&transfer, [0.0, 255.0]);
        // From 0 on, the first value that shows is 31; from 50 on it is 201; above 200 every value
        // shows.
        assert_eq!((first[0], first[30], first[35], first[50], first[200]), (31, 31, 35, 201, 201));
        // A step at a label, at values that 255 steps of the range miss by rounding.
        let label = TransferFunction::from_json(
            r#"{"color": [[0, 1, 1, 1]], "opacity": [[2, 0], [2, 1]]}"#,
        )
        .unwrap();
        for range in [[-3.6, 13.2], [0.0, 3.0]] {
            let volume = Volume::new(
                Lattice::with_spacing([3, 1, 1], DVec3::ONE),
                Samples::F32(vec![range[0] as f32, 2.0, range[1] as f32]),
            );
            let volume = volume.unwrap();
            let [low, high] = neighbourhood_ranges(&volume, [0; 3])[1];
            assert!(
                u16::from(high) >= first_visible(&label, volume.range)[usize::from(low)],
                "{range:?}"
            );
        }
        assert_eq!(first_visible(&transfer, [0.0, 20.0]), [256; 256]);
        assert_eq!(first_visible(&transfer, [40.0, 40.0])[0], 0);
    }
}
