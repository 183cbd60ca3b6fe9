//! The surfels of eight vertices at once, for vertices with a single surfel: a fan of nearly flat
//! triangles, without given normals. All sums and products are those of [`fan`](super::fan), in the
//! same order. A vertex gets the same surfel either way, to the last bit.

use super::fan_rules::{
    ALIKE, CENTROID, CORNER, LEAST_RATIO_SQUARED, LEAST_SQUARE, MIDDLE, SAG, SPREAD, STEEP,
    THICKNESS, mixed,
};
use crate::splat::STEP_BACK;
use fearless_simd::{Simd, f32x8, mask32x8, prelude::*};
use glam::Vec3;

/// Vertices with more triangles are left to the scalar code.
pub(super) const MOST_CORNERS: usize = 16;

type Lanes<S> = f32x8<S>;
type Triple<S> = [Lanes<S>; 3];
type Eight = [f32; 8];

/// A triangle at each of eight vertices. A missing triangle has its corners at the vertex.
#[derive(Clone, Copy, Default)]
struct Corner {
    next: [Eight; 3],
    last: [Eight; 3],
    normal: [Eight; 3],
    area: Eight,
    angle: Eight,
    /// Both edges in the plane of the surfel.
    laid: [Eight; 4],
}

/// Eight vertices with the triangles around them.
#[derive(Default)]
pub(super) struct Fans {
    here: [Eight; 3],
    corners: [Corner; MOST_CORNERS],
    /// The number of triangles of each vertex, and the largest of these numbers.
    counts: Eight,
    most: usize,
    rims: [u64; 8],
}

/// Values that all vertices share.
pub(super) struct Common {
    pub unit: f32,
    pub outward: f32,
    pub radius_scale: f32,
    /// Cosine of the angle to the first normal within which triangles count as flat together.
    pub flat: f32,
}

/// The results for eight vertices.
#[derive(Default)]
pub(super) struct Results {
    /// Whether the vertex has exactly the surfel given here.
    pub is_made: [bool; 8],
    pub center: [Eight; 3],
    pub factor: [Eight; 6],
    /// The components of the packed normal.
    pub normal: [Eight; 2],
    /// The square of the longest edge, in units; the area of all triangles; and the sum of their
    /// normals times their areas.
    pub longest: Eight,
    pub area: Eight,
    pub cross: [Eight; 3],
}

/// Sums over the triangles of eight vertices.
struct Sums<S: Simd> {
    /// Whether all triangles have an area and are nearly parallel to the first.
    is_made: mask32x8<S>,
    /// The square of the longest edge, in units.
    longest: Lanes<S>,
    area: Lanes<S>,
    /// The sum of the normals times the areas, and times the angles at the vertex.
    cross: Triple<S>,
    normal_sum: Triple<S>,
}

impl Fans {
    /// Forgets the previous vertices.
    pub fn clear(&mut self) {
        self.most = 0;
        self.counts = [0.0; 8];
        self.rims = [0; 8];
    }

    /// Puts a vertex in a free lane and announces its number of triangles.
    pub fn begin(&mut self, lane: usize, here: Vec3, count: usize) {
        for axis in 0..3 {
            self.here[axis][lane] = here[axis];
        }
        self.counts[lane] = count as f32;
        self.most = self.most.max(count);
    }

    /// Adds a triangle of a vertex: the positions of the next corner and the last one, and the
    /// numbers of these positions.
    pub fn put(&mut self, lane: usize, at: usize, [next, last]: [Vec3; 2], numbers: [u32; 2]) {
        let corner = &mut self.corners[at];
        for axis in 0..3 {
            corner.next[axis][lane] = next[axis];
            corner.last[axis][lane] = last[axis];
        }
        self.rims[lane] ^= mixed(numbers[0]) ^ mixed(numbers[1]);
    }

    /// Makes the surfels.
    #[inline(always)]
    pub fn surfels<S: Simd>(&mut self, simd: S, common: &Common, results: &mut Results) {
        let number = |value: f32| Lanes::splat(simd, value);
        let none = number(0.0);
        let here = load(simd, &self.here);
        let counts: Lanes<S> = self.counts.simd_into(simd);
        let per_unit = number(1.0 / common.unit);
        let Sums { mut is_made, longest, area, cross, normal_sum } =
            self.measure(simd, counts, per_unit, common.flat);
        let recip = number(1.0) / dot(normal_sum, normal_sum).sqrt();
        is_made &= recip.simd_gt(0.0) & recip.simd_lt(f32::INFINITY);
        let normal = scaled(normal_sum, recip);
        is_made &= dot(normal, normal).abs().simd_ge(ALIKE);
        let (x, y) = across(simd, normal);
        let height = self.lay(simd, [x, y, normal], per_unit);
        let is_open = self.is_open(simd);
        let (mut ellipse, moment_area) = self.ellipse(simd, is_open);
        self.widen(simd, &mut ellipse, is_open, counts);
        let scale = number(common.radius_scale);
        let determinant = ellipse.determinant();
        let mean = (ellipse.xx + ellipse.yy) * 0.5;
        let narrowest =
            (determinant / (mean + (mean * mean - determinant).max(none).sqrt())).sqrt();
        let thickness = narrowest * THICKNESS * scale;
        let outward = scaled(normal, number(common.outward));
        let sag = is_open.select(number(1.0), number(SAG)) * height / (moment_area * 3.0);
        let aside = sum(scaled(x, ellipse.center[0]), scaled(y, ellipse.center[1]));
        let back = scaled(outward, thickness * STEP_BACK as f32);
        let offset = difference(sum(aside, scaled(normal, sag)), back);
        let unit = number(common.unit);
        store(sum(here, scaled(offset, unit)), &mut results.center);
        let factor = ellipse.factor([x, y, normal], scale * unit, thickness * unit);
        for (entry, place) in factor.iter().zip(&mut results.factor) {
            is_made &= entry.abs().simd_lt(f32::INFINITY);
            *place = (*entry).into();
        }
        let [u, v] = octahedral(simd, outward);
        results.normal = [u.into(), v.into()];
        (results.longest, results.area) = (longest.into(), area.into());
        store(cross, &mut results.cross);
        let made: Eight = is_made.select(number(1.0), none).into();
        results.is_made = made.map(|made| made > 0.0);
    }

    /// Sets the normals, areas and angles of all triangles, and returns their sums. Edges are
    /// measured in units.
    #[inline(always)]
    fn measure<S: Simd>(
        &mut self,
        simd: S,
        counts: Lanes<S>,
        per_unit: Lanes<S>,
        flat: f32,
    ) -> Sums<S> {
        let number = |value: f32| Lanes::splat(simd, value);
        let none = number(0.0);
        let here = load(simd, &self.here);
        let mut is_made = counts.simd_gt(0.0);
        let (mut longest, mut area, mut cross, mut normal_sum) = (none, none, [none; 3], [none; 3]);
        let mut first = [none; 3];
        for at in 0..self.most {
            let corner = &mut self.corners[at];
            let has = counts.simd_gt(at as f32);
            let a = scaled(difference(load(simd, &corner.next), here), per_unit);
            let b = scaled(difference(load(simd, &corner.last), here), per_unit);
            let across = product(a, b);
            let (square, longer) = (dot(across, across), dot(a, a).max(dot(b, b)));
            let is_line =
                square.simd_le((longer * longer * LEAST_RATIO_SQUARED).max(number(LEAST_SQUARE)));
            let is_triangle = !is_line & square.simd_lt(f32::INFINITY);
            is_made &= is_triangle | !has;
            let has = has & is_triangle;
            longest = has.select(longest.max(longer), longest);
            let twice_area = square.sqrt();
            let per_area = number(1.0) / twice_area;
            let normal = chosen(has, scaled(across, per_area), [none; 3]);
            let own_area = has.select(twice_area * 0.5, none);
            let own_angle = has.select(angle(simd, twice_area, dot(a, b)), none);
            if at == 0 {
                first = normal;
            } else {
                is_made &= dot(first, normal).simd_ge(flat) | !has;
            }
            area += own_area;
            cross = sum(cross, scaled(normal, own_area));
            normal_sum = sum(normal_sum, scaled(normal, own_angle));
            store(normal, &mut corner.normal);
            corner.area = own_area.into();
            corner.angle = own_angle.into();
        }
        Sums { is_made, longest, area, cross, normal_sum }
    }

    /// Projects the edges onto the plane of the first two axes. Returns the sum of the heights over
    /// it, weighted by area.
    #[inline(always)]
    fn lay<S: Simd>(
        &mut self,
        simd: S,
        [x, y, normal]: [Triple<S>; 3],
        per_unit: Lanes<S>,
    ) -> Lanes<S> {
        let here = load(simd, &self.here);
        let mut height = Lanes::splat(simd, 0.0);
        for corner in &mut self.corners[..self.most] {
            let a = scaled(difference(load(simd, &corner.next), here), per_unit);
            let b = scaled(difference(load(simd, &corner.last), here), per_unit);
            let corner_normal = load(simd, &corner.normal);
            let area: Lanes<S> = corner.area.simd_into(simd);
            let mut laid = [dot(a, x), dot(a, y), dot(b, x), dot(b, y)];
            let slope = dot(normal, corner_normal);
            let is_steep = slope.abs().simd_lt(STEEP) & area.simd_gt(0.0);
            if is_steep.any_true() {
                let one = Lanes::splat(simd, 1.0);
                let steepness = one.copysign(slope) * slope.abs().max(one * 0.5);
                let (down_x, down_y) =
                    (dot(corner_normal, x) / steepness, dot(corner_normal, y) / steepness);
                let (up_a, up_b) = (dot(normal, a), dot(normal, b));
                laid[0] = is_steep.select(laid[0] - down_x * up_a, laid[0]);
                laid[1] = is_steep.select(laid[1] - down_y * up_a, laid[1]);
                laid[2] = is_steep.select(laid[2] - down_x * up_b, laid[2]);
                laid[3] = is_steep.select(laid[3] - down_y * up_b, laid[3]);
            }
            height += area * dot(normal, sum(a, b));
            corner.laid = [laid[0].into(), laid[1].into(), laid[2].into(), laid[3].into()];
        }
        height
    }

    /// Returns which fans are open: in an open fan, some neighbour occurs only once.
    #[inline(always)]
    fn is_open<S: Simd>(&self, simd: S) -> mask32x8<S> {
        let mut open = [0.0f32; 8];
        for (open, rim) in open.iter_mut().zip(self.rims) {
            *open = if rim == 0 { 0.0 } else { 1.0 };
        }
        let open: Lanes<S> = open.simd_into(simd);
        open.simd_gt(0.0)
    }

    /// Returns the ellipse of the triangles' moments, and their area.
    #[inline(always)]
    fn ellipse<S: Simd>(&self, simd: S, is_open: mask32x8<S>) -> (Ellipse<S>, Lanes<S>) {
        let none = Lanes::splat(simd, 0.0);
        let (mut total, mut place, mut xx, mut xy, mut yy) = (none, [none; 2], none, none, none);
        for corner in &self.corners[..self.most] {
            let area: Lanes<S> = corner.area.simd_into(simd);
            let [ax, ay, bx, by] = corner.laid(simd);
            let (cx, cy) = (ax + bx, ay + by);
            total += area;
            let third = area / 3.0;
            place = [place[0] + third * cx, place[1] + third * cy];
            let twelfth = area / 12.0;
            xx += twelfth * (ax * ax + bx * bx + cx * cx);
            xy += twelfth * (ax * ay + bx * by + cx * cy);
            yy += twelfth * (ay * ay + by * by + cy * cy);
        }
        let spread = Lanes::splat(simd, SPREAD);
        let share = spread / total;
        let [x, y] = [place[0] / total, place[1] / total];
        let (x, y) = (is_open.select(x, none), is_open.select(y, none));
        let (xx, yy) = (xx * share - spread * x * x, yy * share - spread * y * y);
        let least = (xx + yy).max(none) * 1e-5 + f32::MIN_POSITIVE;
        let xy = xy * share - spread * x * y;
        (Ellipse { center: [x, y], xx: xx + least, xy, yy: yy + least }, total)
    }

    /// Widens the ellipse as far as the triangles require.
    #[inline(always)]
    fn widen<S: Simd>(
        &self,
        simd: S,
        ellipse: &mut Ellipse<S>,
        is_open: mask32x8<S>,
        counts: Lanes<S>,
    ) {
        let none = Lanes::splat(simd, 0.0);
        ellipse.reach(simd, [none; 2], CORNER, is_open);
        for (at, corner) in self.corners[..self.most].iter().enumerate() {
            let has = counts.simd_gt(at as f32);
            let [ax, ay, bx, by] = corner.laid(simd);
            ellipse.reach(simd, [ax * 0.5, ay * 0.5], MIDDLE, has);
            if is_open.any_true() {
                ellipse.reach(simd, [bx * 0.5, by * 0.5], MIDDLE, has & is_open);
            }
            ellipse.reach(simd, [(ax + bx) * (1.0 / 3.0), (ay + by) * (1.0 / 3.0)], CENTROID, has);
        }
    }
}

impl Corner {
    #[inline(always)]
    fn laid<S: Simd>(&self, simd: S) -> [Lanes<S>; 4] {
        let [a, b, c, d] = self.laid;
        [a.simd_into(simd), b.simd_into(simd), c.simd_into(simd), d.simd_into(simd)]
    }
}

/// Eight ellipses, as in [`disc`](super::disc).
struct Ellipse<S: Simd> {
    center: [Lanes<S>; 2],
    xx: Lanes<S>,
    xy: Lanes<S>,
    yy: Lanes<S>,
}

impl<S: Simd> Ellipse<S> {
    #[inline(always)]
    fn determinant(&self) -> Lanes<S> {
        (self.xx * self.yy - self.xy * self.xy).max(self.xx * self.yy * 1e-6)
    }

    #[inline(always)]
    fn reach(&mut self, simd: S, [x, y]: [Lanes<S>; 2], most: f32, is_asked: mask32x8<S>) {
        let (x, y) = (x - self.center[0], y - self.center[1]);
        let square = self.yy * x * x - self.xy * 2.0 * x * y + self.xx * y * y;
        let determinant = self.determinant();
        let is_far = square.simd_gt(determinant * most) & is_asked;
        if is_far.any_true() {
            let more = Lanes::splat(simd, 1.0 / most) - determinant / square;
            self.xx = is_far.select(self.xx + more * x * x, self.xx);
            self.xy = is_far.select(self.xy + more * x * y, self.xy);
            self.yy = is_far.select(self.yy + more * y * y, self.yy);
        }
    }

    #[inline(always)]
    fn factor(
        &self,
        [x, y, normal]: [Triple<S>; 3],
        scale: Lanes<S>,
        thickness: Lanes<S>,
    ) -> [Lanes<S>; 6] {
        let determinant = self.determinant();
        let l00 = self.xx.sqrt() * scale;
        let l10 = self.xy / self.xx * l00;
        let l11 = (determinant / self.xx).sqrt() * scale;
        let (u, v, w) =
            (sum(scaled(x, l00), scaled(y, l10)), scaled(y, l11), scaled(normal, thickness));
        let (r0, r1, r2) = ([u[0], v[0], w[0]], [u[1], v[1], w[1]], [u[2], v[2], w[2]]);
        let b00 = dot(r0, r0).sqrt();
        let q0 = [r0[0] / b00, r0[1] / b00, r0[2] / b00];
        let b10 = dot(r1, q0);
        let rest = difference(r1, scaled(q0, b10));
        let b11 = dot(rest, rest).sqrt();
        let q1 = [rest[0] / b11, rest[1] / b11, rest[2] / b11];
        [b00, b10, b11, dot(r2, q0), dot(r2, q1), l00 * l11 * thickness / (b00 * b11)]
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, from: &[Eight; 3]) -> Triple<S> {
    [from[0].simd_into(simd), from[1].simd_into(simd), from[2].simd_into(simd)]
}

#[inline(always)]
fn store<S: Simd>(from: Triple<S>, into: &mut [Eight; 3]) {
    *into = [from[0].into(), from[1].into(), from[2].into()];
}

#[inline(always)]
fn sum<S: Simd>(a: Triple<S>, b: Triple<S>) -> Triple<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn difference<S: Simd>(a: Triple<S>, b: Triple<S>) -> Triple<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn scaled<S: Simd>(a: Triple<S>, factor: Lanes<S>) -> Triple<S> {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

#[inline(always)]
fn chosen<S: Simd>(mask: mask32x8<S>, a: Triple<S>, b: Triple<S>) -> Triple<S> {
    [mask.select(a[0], b[0]), mask.select(a[1], b[1]), mask.select(a[2], b[2])]
}

#[inline(always)]
fn dot<S: Simd>(a: Triple<S>, b: Triple<S>) -> Lanes<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn product<S: Simd>(a: Triple<S>, b: Triple<S>) -> Triple<S> {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

/// Returns two unit vectors perpendicular to a unit vector, like glam's `any_orthonormal_pair`.
#[inline(always)]
fn across<S: Simd>(simd: S, [x, y, z]: Triple<S>) -> (Triple<S>, Triple<S>) {
    let sign = Lanes::splat(simd, 1.0).copysign(z);
    let a = Lanes::splat(simd, -1.0) / (sign + z);
    let b = x * y * a;
    ([sign * x * x * a + 1.0, sign * b, -sign * x], [b, sign + y * y * a, -y])
}

/// Like [`fan::angle`](super::fan).
#[inline(always)]
fn angle<S: Simd>(simd: S, sine: Lanes<S>, cosine: Lanes<S>) -> Lanes<S> {
    use std::f32::consts::{FRAC_PI_2, PI};
    let number = |value: f32| Lanes::splat(simd, value);
    let steep = cosine.abs();
    let t = sine.min(steep) / sine.max(steep);
    let s = t * t;
    let series = s * 0.020_835_1 + -0.085_133;
    let series = s * series + 0.180_141;
    let series = s * series + -0.330_299_5;
    let sharp = t * (s * series + 0.999_866);
    let acute = sine.simd_gt(steep).select(number(FRAC_PI_2) - sharp, sharp);
    cosine.simd_lt(0.0).select(number(PI) - acute, acute)
}

/// Returns the components of a packed normal, like [`encode_normal`](crate::splat::encode_normal).
#[inline(always)]
fn octahedral<S: Simd>(simd: S, [x, y, z]: Triple<S>) -> [Lanes<S>; 2] {
    let one = Lanes::splat(simd, 1.0);
    let sum = x.abs() + y.abs() + z.abs();
    let (x, y) = (x / sum, y / sum);
    let is_below = z.simd_lt(0.0);
    let folded = [(one - y.abs()) * one.copysign(x), (one - x.abs()) * one.copysign(y)];
    [whole(simd, is_below.select(folded[0], x)), whole(simd, is_below.select(folded[1], y))]
}

/// Rounds the components of a normal to the nearest step, halves away from 0.
#[inline(always)]
fn whole<S: Simd>(simd: S, part: Lanes<S>) -> Lanes<S> {
    let one = Lanes::splat(simd, 1.0);
    let steps = part.max(-one).min(one) * 32767.0;
    let below = steps.trunc();
    let is_nearer = (steps - below).abs().simd_ge(0.5);
    is_nearer.select(below + one.copysign(steps), below)
}
