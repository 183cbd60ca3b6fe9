//! Measures of all leaves, eight splats at once. All sums and products are those of
//! [`merge`](super::merge), in the same order, so both give the same measures to the last bit.

use super::{
    Node,
    merge::{ALIKE, Mass, THIRD, WIDTH, covariance},
};
use crate::splat::{NO_NORMAL, Splat};
use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};
use glam::Vec3;
use obvhs::aabb::Aabb;

type Lanes<S> = f32x8<S>;

/// The measures of a splat from which its node is made.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Measures {
    /// The largest standard deviation.
    sigma: f32,
    /// As in [`Mass`].
    area: f32,
    /// How far the splat's box extends from its centre. Boxes are used to find neighbours.
    reach: f32,
    /// As in [`Node`].
    cone: f32,
}

impl Measures {
    /// Measures the splats with the indices `numbers`.
    pub fn of(splats: &[Splat], numbers: &[u32]) -> Vec<Self> {
        let mut out = vec![Self::default(); numbers.len()];
        dispatch!(Level::new(), simd => all(simd, splats, numbers, &mut out));
        out
    }

    /// The same as [`merge::leaf`](super::merge::leaf).
    pub fn leaf(&self, splat: &Splat, extent: f32) -> Node {
        Node {
            splat: *splat,
            center: splat.center,
            radius: extent * self.sigma * (1.0 + 1e-5),
            size: WIDTH * self.sigma,
            cone: self.cone,
            first_child: 0,
            children: 0,
        }
    }

    /// The same as [`Mass::of`].
    pub fn mass(&self, splat: &Splat) -> Mass {
        Mass::with(splat, self.area, covariance(&splat.factor))
    }

    /// The same as [`cluster::box_of`](super::cluster::box_of).
    pub fn box_of(&self, splat: &Splat) -> Aabb {
        let center = Vec3::from(splat.center);
        Aabb::new((center - self.reach).into(), (center + self.reach).into())
    }
}

#[inline(always)]
fn all<S: Simd>(simd: S, splats: &[Splat], numbers: &[u32], out: &mut [Measures]) {
    let mut factor = [[0.0f32; 8]; 6];
    let mut normal = [[0.0f32; 8]; 2];
    for (numbers, out) in numbers.chunks(8).zip(out.chunks_mut(8)) {
        for (lane, &number) in numbers.iter().enumerate() {
            let splat = &splats[number as usize];
            for (entries, entry) in factor.iter_mut().zip(splat.factor) {
                entries[lane] = entry;
            }
            normal[0][lane] = f32::from(splat.normal as u16 as i16);
            normal[1][lane] = f32::from((splat.normal >> 16) as u16 as i16);
        }
        let [sigma, area, reach, cone] = measures(simd, &factor, &normal);
        for (lane, (out, &number)) in out.iter_mut().zip(numbers).enumerate() {
            let cone = if splats[number as usize].normal == NO_NORMAL { -1.0 } else { cone[lane] };
            *out = Measures { sigma: sigma[lane], area: area[lane], reach: reach[lane], cone };
        }
    }
}

/// Returns standard deviation, area, reach and cone.
#[inline(always)]
fn measures<S: Simd>(simd: S, factor: &[[f32; 8]; 6], normal: &[[f32; 8]; 2]) -> [[f32; 8]; 4] {
    let number = |value: f32| Lanes::splat(simd, value);
    let (none, one) = (number(0.0), number(1.0));
    let b: [Lanes<S>; 6] = [
        factor[0].simd_into(simd),
        factor[1].simd_into(simd),
        factor[2].simd_into(simd),
        factor[3].simd_into(simd),
        factor[4].simd_into(simd),
        factor[5].simd_into(simd),
    ];
    let [b00, b10, b11, b20, b21, b22] = b;
    let (xx, xy, xz) = (b00 * b00, b00 * b10, b00 * b20);
    let (yy, yz) = (b10 * b10 + b11 * b11, b10 * b20 + b11 * b21);
    let zz = b20 * b20 + b21 * b21 + b22 * b22;
    let all = xx + yy + zz;
    let reach = (all * 0.5).sqrt() * (0.5 * WIDTH);
    let mean = (all / 3.0).max(none);
    let per_mean = mean.simd_gt(0.0).select(one / mean, none);
    let (xx, xy, xz) = (xx * per_mean, xy * per_mean, xz * per_mean);
    let (yy, yz, zz) = (yy * per_mean, yz * per_mean, zz * per_mean);
    let minors = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz;
    let area = mean * minors.max(none).sqrt();
    // The largest eigenvalue.
    let (x, y, z) = (xx - 1.0, yy - 1.0, zz - 1.0);
    let p = ((x * x + y * y + z * z + (xy * xy + xz * xz + yz * yz) * 2.0) / 6.0).sqrt();
    let (x, y, z, xy, xz, yz) = (x / p, y / p, z / p, xy / p, xz / p, yz / p);
    let half = (x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz)) * 0.5;
    let root = (half.max(-one).min(one) + 1.0).sqrt();
    let mut series = number(THIRD[5]);
    for term in [THIRD[4], THIRD[3], THIRD[2], THIRD[1], THIRD[0]] {
        series = series * root + term;
    }
    let is_round = p.simd_le(1e-6);
    let largest = is_round.select(mean + mean * p, mean + mean * 2.0 * p * series);
    let sigma = largest.max(none).sqrt();
    let normal = unpacked(simd, normal);
    let thin = thin_axis(simd, b, normal);
    let cosine = (normal[0] * thin[0] + normal[1] * thin[1] + normal[2] * thin[2]).abs();
    let cone = cosine.simd_lt(ALIKE).select((cosine - 2e-6).max(none), one);
    [sigma.into(), area.into(), reach.into(), cone.into()]
}

/// The same as [`decode_normal`](crate::splat::decode_normal), for the components of packed
/// normals.
#[inline(always)]
fn unpacked<S: Simd>(simd: S, normal: &[[f32; 8]; 2]) -> [Lanes<S>; 3] {
    let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let [x, y]: [Lanes<S>; 2] = [normal[0].simd_into(simd), normal[1].simd_into(simd)];
    let (x, y) = (x / 32767.0, y / 32767.0);
    let z = one - x.abs() - y.abs();
    let fold = (-z).max(none);
    let (x, y) = (x - fold * one.copysign(x), y - fold * one.copysign(y));
    let recip = one / (x * x + y * y + z * z).sqrt();
    [x * recip, y * recip, z * recip]
}

/// The same as in [`merge`](super::merge).
#[inline(always)]
fn thin_axis<S: Simd>(simd: S, factor: [Lanes<S>; 6], from: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    let one = Lanes::splat(simd, 1.0);
    let mut most = Lanes::splat(simd, f32::MIN_POSITIVE);
    for entry in factor {
        most = most.max(entry.abs());
    }
    let scale = one / most;
    let [b00, b10, b11, b20, b21, b22] = factor;
    let (b00, b10, b11) = (b00 * scale, b10 * scale, b11 * scale);
    let (b20, b21, b22) = (b20 * scale, b21 * scale, b22 * scale);
    let least = Lanes::splat(simd, 1e-6);
    let c00 = one / b00.abs().max(least).copysign(b00);
    let c11 = one / b11.abs().max(least).copysign(b11);
    let c22 = one / b22.abs().max(least).copysign(b22);
    let mut axis = from;
    for _ in 0..2 {
        let x = axis[0] * c00;
        let y = (axis[1] - b10 * x) * c11;
        let z = (axis[2] - b20 * x - b21 * y) * c22 * c22;
        let y = (y - b21 * z) * c11;
        let x = (x - b10 * y - b20 * z) * c00;
        let recip = one / (x * x + y * y + z * z).sqrt();
        let is_axis = recip.simd_gt(0.0) & recip.simd_lt(f32::INFINITY);
        axis = [
            is_axis.select(x * recip, from[0]),
            is_axis.select(y * recip, from[1]),
            is_axis.select(z * recip, from[2]),
        ];
    }
    axis
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::{cluster::box_of, merge::leaf, testing::surface};

    #[test]
    fn eight_at_once_are_as_one_by_one() {
        let mut splats = surface(1003, 5);
        splats[3].normal = NO_NORMAL;
        splats[4].factor = [1.0, 0.0, 1.0, 0.0, 0.0, 1.0];
        splats[5].factor = [1e-20, 0.0, 1e-20, 0.0, 0.0, 1e-22];
        splats[6].factor = [1e8, 0.0, 1.0, 0.0, 0.0, 1e-3];
        let numbers: Vec<u32> = (0..splats.len() as u32).rev().collect();
        for (measures, number) in Measures::of(&splats, &numbers).iter().zip(numbers) {
            let splat = &splats[number as usize];
            assert_eq!(measures.leaf(splat, 3.0), leaf(splat, 3.0));
            assert_eq!(measures.area, Mass::of(splat).area);
            assert_eq!(Vec3::from(measures.box_of(splat).max), Vec3::from(box_of(splat).max));
        }
    }
}
