//! Adds splats to the pixels of a tile: their sections in a window of sheets, and their kernels on
//! the planes between these sheets. shaders/shared/kernels.wgsl does the same; docs/engine.md
//! explains the mathematics.

use super::{
    cells::CellTile,
    close::{OPAQUE, Packet},
    footprint::{Kind, Record},
    plan::Plan,
    rays::{HIGH, PACKETS, Rays, WIDE},
    sums::{ScalarSums, Sums, WINDOW},
    vector::{Lanes, apart, dot, each, exp, three},
};
use crate::{
    plan::{TILE, field::FieldKernel},
    scene::{Optics, Order},
    splat::TRAINED_OPACITIES,
};
use fearless_simd::{Simd, i32x8, mask32x8, prelude::*};

/// The integral of exp(−x²/2).
const SQRT_TAU: f32 = 2.506_628_3;
/// Maximum distance of a plane from a kernel, in standard deviations. Further planes count as this
/// far: nothing of the kernel is left there.
const FAR: f32 = 12.0;
/// Smaller optical depths are not added: even thousands of them are invisible.
const LEAST_ADDED: f32 = 1e-7;
/// Number of table entries along the kernel's radius, and of cells along each side of the table of
/// its sections (src/plan/tables.rs).
const RADII: usize = crate::plan::tables::RADII;
const SECTIONS: usize = crate::plan::tables::SECTIONS;

/// A tile while splats are added to it.
pub struct OpenTile<'a, S: Simd> {
    /// The first pixel, which may lie outside the picture.
    pub corner: [i32; 2],
    pub packets: [Packet<S>; PACKETS],
    /// The sums of the open sheets.
    pub sums: Sums<S>,
    pub fields: Vec<OpenField<'a, S>>,
}

/// A field in a tile while splats and tetrahedra are added to the tile.
pub struct OpenField<'a, S: Simd> {
    /// The sums of the open sheets, if the field is scattered.
    pub sums: Option<Box<ScalarSums<S>>>,
    /// The values on the planes in front of and behind a sheet, if gradients are differences of
    /// neighbouring pixels.
    pub values: Option<[[[f32; TILE]; TILE]; 2]>,
    pub cells: Option<CellTile<'a, S>>,
}

/// A splat's window of four sheets in a tile.
#[derive(Clone, Copy)]
pub struct Window {
    /// The first sheet.
    pub front: usize,
    /// Whether the window follows another window of the same splat.
    pub is_continued: bool,
}

/// The position of a kernel on the rays of a packet.
struct Along<S: Simd> {
    /// The squared distance of the closest approach, in whitened space, and the mask of the rays
    /// that meet the kernel.
    rho2: Lanes<S>,
    inside: mask32x8<S>,
    /// The planes, in whitened lengths from the closest approach; v = M·c × β, β = M·b, the inverse
    /// of |β| and its square, and L = β·M·(c − a) (docs/engine.md).
    t: [Lanes<S>; 3],
    v: [Lanes<S>; 3],
    beta: [Lanes<S>; 3],
    inverse: Lanes<S>,
    inverse2: Lanes<S>,
    l: Lanes<S>,
}

/// The value of a sample along the rays of a packet, which is linear in the whitened distance from
/// the closest approach.
struct Line<S: Simd> {
    /// The closest approach and the direction of the rays, in whitened space.
    nearest: [Lanes<S>; 3],
    unit: [Lanes<S>; 3],
    /// The value at the closest approach, and its change per whitened length.
    value: Lanes<S>,
    slope: Lanes<S>,
}

/// The change of a sample per pixel to the right or down, on a plane at distance 1.
struct Across<S: Simd> {
    /// The change of half the squared whitened radius, at the closest approach and per whitened
    /// length from there.
    nearest: Lanes<S>,
    unit: Lanes<S>,
    value: Lanes<S>,
}

/// A window of a splat, with the values that are the same for all pixels.
struct Projected<'a> {
    record: &'a Record,
    window: Window,
    /// Number of the window's planes that the splat reaches.
    count: usize,
    /// The part of a splat by its centre that belongs to the second sheet of the window.
    behind: Option<f32>,
    at: [f32; 2],
    whitened: [f32; 3],
    m: [[f32; 3]; 3],
    v: [[f32; 3]; 2],
}

impl<'a> Projected<'a> {
    #[inline(always)]
    fn new(plan: &Plan, record: &'a Record, window: Window) -> Self {
        let scale = plan.frame.scale;
        let [m00, m10, m20, m11, m21, m22] = record.whitening;
        let inverse = 1.0 / scale;
        let m = [
            [m00 * inverse, m10 * inverse, m20 * inverse],
            [0.0, m11 * inverse, m21 * inverse],
            [0.0, 0.0, m22],
        ];
        let [x, y, z] = record.center;
        let mut at = [plan.frame.center[0] + scale * x, plan.frame.center[1] + scale * y];
        let mut whitened = [0.0, 0.0, m22 * z];
        let mut v = [cross(m[2], m[0]), cross(m[2], m[1])];
        if plan.view.perspective {
            // A centre beside the eye projects to infinity, so it is moved by a thousandth of its
            // distance.
            let least2 = 1e-6 * (x * x + y * y + z * z);
            let z = if z * z < least2 { least2.sqrt().copysign(z) } else { z };
            let per_z = scale / z;
            at = [plan.frame.center[0] + x * per_z, plan.frame.center[1] + y * per_z];
            whitened = std::array::from_fn(|i| (m[0][i] * x + m[1][i] * y) * scale + m[2][i] * z);
            v = [cross(whitened, m[0]), cross(whitened, m[1])];
        }
        let count = planes_of(plan, record, window);
        let behind = plan.by_centers.then(|| {
            let [front, back] = [0, 1].map(|next| plan.middle(window.front + next));
            ((record.center[2] - front) / (back - front)).clamp(0.0, 1.0)
        });
        Self { record, window, count, behind, at, whitened, m, v }
    }

    /// Returns the kernel's position on the rays of a packet and relative to the window's planes,
    /// or `None` if it misses all rays.
    #[inline(always)]
    fn along<S: Simd>(&self, simd: S, plan: &Plan, rays: &Rays<S>) -> Option<Along<S>> {
        let [m0, m1, m2] = &self.m;
        let [v0, v1] = &self.v;
        let dx = rays.pixel[0] - self.at[0];
        let dy = rays.pixel[1] - self.at[1];
        let v = three!(I => dx * v0[I] + dy * v1[I]);
        let (beta, l);
        if plan.view.perspective {
            let x = rays.pixel[0] - plan.frame.center[0];
            let y = rays.pixel[1] - plan.frame.center[1];
            beta = [x * m0[0], x * m0[1] + y * m1[1], x * m0[2] + y * m1[2] + m2[2]];
            l = beta[0] * self.whitened[0]
                + beta[1] * self.whitened[1]
                + beta[2] * self.whitened[2];
        } else {
            let none = Lanes::splat(simd, 0.0);
            beta = [none, none, Lanes::splat(simd, m2[2])];
            l = (self.whitened[2] - dx * m0[2] - dy * m1[2]) * m2[2];
        }
        let size2 = dot(beta, beta).max(Lanes::splat(simd, 1e-37));
        let inverse2 = Lanes::splat(simd, 1.0) / size2;
        let rho2 = dot(v, v) * inverse2;
        let inside = rho2.simd_le(self.record.extent2);
        if !inside.any_true() {
            return None;
        }
        let far = Lanes::splat(simd, FAR);
        let (mut t, mut inverse) = ([far; 3], inverse2);
        // A splat by its centre has nothing to do with planes.
        if self.behind.is_none() {
            inverse = inverse2.sqrt();
            let planes = &plan.planes[self.window.front + 1..];
            for (t, plane) in t.iter_mut().zip(planes).take(self.count) {
                *t = ((size2 * (rays.cosine * *plane) - l) * inverse).max(-far).min(far);
            }
        }
        Some(Along { rho2, inside, t, v, beta, inverse, inverse2, l })
    }

    /// Returns the sections of the kernel between the window's planes. Everything behind the last
    /// plane belongs to the last sheet.
    #[inline(always)]
    fn sections<S: Simd>(
        &self,
        simd: S,
        plan: &Plan,
        along: &Along<S>,
        from_table: bool,
    ) -> [Lanes<S>; WINDOW] {
        let none = Lanes::splat(simd, 0.0);
        if let Some(behind) = self.behind {
            return [1.0 - behind, behind, 0.0, 0.0].map(|part| Lanes::splat(simd, part));
        }
        let before = |whole: Lanes<S>| if self.window.is_continued { whole } else { none };
        let mut sections = [none; WINDOW];
        if from_table {
            let half = kernel_integral(simd, plan, along.rho2.sqrt(), Lanes::splat(simd, 3e38));
            let mut last = before(half * 2.0) - half;
            for (section, t) in sections.iter_mut().zip(along.t).take(self.count) {
                let next = kernel_integral(simd, plan, along.rho2.sqrt(), t);
                *section = next - last;
                last = next;
            }
            sections[self.count] = half - last;
            return sections;
        }
        let one = Lanes::splat(simd, 1.0);
        let mut last = before(one);
        for (section, t) in sections.iter_mut().zip(along.t).take(self.count) {
            let next = if plan.has_field || plan.is_classified {
                normal_cdf(simd, t)
            } else {
                near_normal_cdf(simd, t)
            };
            *section = next - last;
            last = next;
        }
        sections[self.count] = one - last;
        sections
    }

    /// Adds the radiance of the splat to the sheets, or composites a splat that is drawn alone.
    #[inline(always)]
    fn add_radiance<S: Simd>(
        &self,
        simd: S,
        plan: &Plan,
        packet: &mut Packet<S>,
        sums: &mut Sums<S>,
    ) {
        let (record, rays) = (self.record, &packet.rays);
        let Some(along) = self.along(simd, plan, rays) else { return };
        let none = Lanes::splat(simd, 0.0);
        let from_table = plan.table_kernel && record.kind == Kind::Classified;
        let mut strength = Lanes::splat(simd, record.strength);
        if !from_table {
            strength *= exp(simd, along.rho2 * -0.5);
        }
        let is_trained = record.strength < 0.0;
        let order = plan.single();
        if is_trained && order.is_none() {
            strength = trained_depth(simd, trained_share(simd, -strength));
        }
        if record.kind == Kind::Classified {
            // Whitened length to world length along the ray.
            strength = strength * along.inverse / rays.cosine;
            if !from_table {
                strength *= SQRT_TAU;
            }
        }
        let mut counts = along.inside;
        if plan.has_clips() {
            counts &= is_kept(plan, rays, along.l * along.inverse2 / rays.cosine);
        }
        if (plan.is_whole() || plan.by_centers) && plan.view.perspective {
            // The kernel's middle must be in front of the eye.
            counts &= along.l.simd_gt(0.0);
        }
        let strength = counts.select(strength, none);
        let sections = self.sections(simd, plan, &along, from_table);
        if let Some(order) = order {
            let share = if is_trained {
                trained_share(simd, -strength)
            } else {
                Lanes::splat(simd, 1.0) - exp(simd, -(strength * sections[0]))
            };
            single(simd, plan, record, share, order, packet);
            return;
        }
        for (offset, section) in sections.iter().enumerate().take(self.count + 1) {
            let depth = strength * *section;
            let adds = depth.abs().simd_gt(LEAST_ADDED);
            if !adds.any_true() {
                continue;
            }
            let depth = adds.select(depth, none);
            let slot = (self.window.front + offset) % WINDOW;
            sums.has_radiance[slot] |= packet.bit();
            // The first part of the payload is 1.
            let sums = &mut sums.radiance[slot][packet.number];
            sums[0] += depth;
            let parts = if plan.has_normals { 1..8 } else { 2..5 };
            for (sum, part) in sums[parts.clone()].iter_mut().zip(&record.payload[parts]) {
                *sum = depth.mul_add(Lanes::splat(simd, *part), *sum);
            }
        }
    }

    /// Adds the value of the splat to the sheets, and to the planes between them.
    #[inline(always)]
    fn add_scalar<S: Simd>(
        &self,
        simd: S,
        plan: &Plan,
        packet: &Packet<S>,
        sums: &mut ScalarSums<S>,
    ) {
        let (front, rays) = (self.window.front, &packet.rays);
        let Some(along) = self.along(simd, plan, rays) else { return };
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let kernel = if plan.table_kernel { one } else { exp(simd, along.rho2 * -0.5) };
        let kernel = along.inside.select(kernel, none) * self.record.payload[0];
        let closest = if plan.table_kernel { one } else { Lanes::splat(simd, SQRT_TAU) };
        let length_of = along.inverse / rays.cosine;
        let sections = self.sections(simd, plan, &along, plan.table_kernel);
        let line = self.line(simd, plan, &along);
        let has_slopes = plan.has_gradients() && !plan.central;
        let across = has_slopes.then(
            #[inline(always)]
            || self.across(simd, plan, rays, &along, &line),
        );
        let section_kernel = kernel * closest * length_of;
        // The kernel on the planes in front of and behind a sheet: the slope's contribution to the
        // sheet.
        let mut before = none;
        for (offset, section) in sections.iter().enumerate().take(self.count + 1) {
            let slot = (front + offset) % WINDOW;
            sums.has_field[slot] |= packet.bit();
            let weight = section_kernel * *section;
            let field = &mut sums.field[slot][packet.number];
            field.weight += weight;
            field.value = weight.mul_add(line.value, field.value);
            if offset == self.count {
                if plan.has_slopes {
                    field.value += before * line.slope * length_of;
                }
                break;
            }
            let t = along.t[offset];
            let (on_plane, steep) = if plan.table_kernel {
                let [on_plane, steep] = kernel_at(simd, plan, (along.rho2 + t * t).sqrt());
                (on_plane * kernel, steep * kernel)
            } else {
                let on_plane = exp(simd, t * t * -0.5) * kernel;
                (on_plane, on_plane)
            };
            if plan.has_slopes {
                field.value += (before - on_plane) * line.slope * length_of;
            }
            before = on_plane;
            let here = t.mul_add(line.slope, line.value);
            let face = &mut sums.faces[(front + offset + 1) % WINDOW][packet.number];
            face.weight += on_plane;
            face.value = on_plane.mul_add(here, face.value);
            let Some(across) = &across else { continue };
            let plane = plan.planes[front + 1 + offset];
            let size = if plan.view.perspective { rays.cosine * plane } else { one };
            for (axis, change) in across.iter().enumerate() {
                let moved = size * (change.nearest + t * change.unit);
                face.weight_slope[axis] += steep * moved;
                face.value_slope[axis] = (steep * moved).mul_add(here, face.value_slope[axis]);
                if plan.has_slopes {
                    face.value_slope[axis] -= on_plane * size * change.value;
                }
            }
        }
        debug_assert!(plan.optics != Optics::Maximum || plan.has_field);
    }

    /// Returns the value of a sample along rays.
    #[inline(always)]
    fn line<S: Simd>(&self, simd: S, plan: &Plan, along: &Along<S>) -> Line<S> {
        let nearest = three!(I => {
            let (a, b) = ((I + 1) % 3, (I + 2) % 3);
            (along.v[a] * along.beta[b] - along.v[b] * along.beta[a])
                * (along.inverse * along.inverse)
        });
        let unit = three!(I => along.beta[I] * along.inverse);
        let mut value = Lanes::splat(simd, self.record.strength);
        let mut slope = Lanes::splat(simd, 0.0);
        if plan.has_slopes {
            let [_, x, y, z, ..] = self.record.payload;
            value += nearest[0] * x + nearest[1] * y + nearest[2] * z;
            slope = unit[0] * x + unit[1] * y + unit[2] * z;
        }
        Line { nearest, unit, value, slope }
    }

    /// Returns the changes of a sample per pixel to the right and down.
    #[inline(always)]
    fn across<S: Simd>(
        &self,
        simd: S,
        plan: &Plan,
        rays: &Rays<S>,
        along: &Along<S>,
        line: &Line<S>,
    ) -> [Across<S>; 2] {
        let [_, x, y, z, ..] = self.record.payload;
        each!([0, 1], AXIS => {
            let mut across = three!(I => Lanes::splat(simd, self.m[AXIS][I]));
            if plan.view.perspective {
                let k = rays.cosine * rays.cosine * rays.aside[AXIS] * (1.0 / plan.frame.scale);
                across = three!(I => across[I] - along.beta[I] * k);
            }
            Across {
                nearest: dot(line.nearest, across),
                unit: dot(line.unit, across),
                value: across[0] * x + across[1] * y + across[2] * z,
            }
        })
    }
}

/// Returns the shares of pixels that a trained Gaussian covers, by its opacity there.
#[inline(always)]
fn trained_share<S: Simd>(simd: S, opacity: Lanes<S>) -> Lanes<S> {
    let [least, most] = TRAINED_OPACITIES.map(|share| Lanes::splat(simd, share as f32));
    opacity.simd_ge(least).select(opacity.min(most), Lanes::splat(simd, 0.0))
}

/// Returns the optical depth that covers shares of pixels, of up to 0.99: −ln(1 − α).
#[inline(always)]
fn trained_depth<S: Simd>(simd: S, share: Lanes<S>) -> Lanes<S> {
    // 1 − α is 2 to the power e times m, with m from √½ to √2, so small shares have e = 0.
    const ROOT: i32 = 0x3f35_04f3;
    let bits = (1.0 - share).bitcast::<i32x8<S>>();
    let exponent = (bits - ROOT) >> 23;
    let m = (bits - (exponent << 23)).bitcast::<Lanes<S>>();
    // −ln m = 2·artanh((1 − m)/(1 + m)).
    let z = (1.0 - m) / (m + 1.0);
    let z2 = z * z;
    let mut series = Lanes::splat(simd, 2.0 / 7.0);
    for term in [2.0 / 5.0, 2.0 / 3.0, 2.0] {
        series = series.mul_add(z2, Lanes::splat(simd, term));
    }
    Lanes::float_from(exponent).mul_add(Lanes::splat(simd, -std::f32::consts::LN_2), series * z)
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The normal distribution function, within 2·10⁻⁷ (Abramowitz & Stegun 1964, 26.2.19). Its tails
/// must be right: their error is multiplied by the strength of an opaque splat, and lies in front
/// of the splat.
#[inline(always)]
pub fn normal_cdf<S: Simd>(simd: S, t: Lanes<S>) -> Lanes<S> {
    let x = t.abs().min(Lanes::splat(simd, 8.0));
    let one = Lanes::splat(simd, 1.0);
    let mut p = Lanes::splat(simd, 5.382_975e-6);
    for term in [4.889_063_6e-5, 3.800_357_5e-5, 3.277_626_3e-3, 2.114_100_6e-2, 4.986_735e-2, 1.0]
    {
        p = p.mul_add(x, Lanes::splat(simd, term));
    }
    p = p * p;
    p = p * p;
    p = p * p;
    p = p * p;
    let tail = Lanes::splat(simd, 0.5) / p;
    t.simd_ge(0.0).select(one - tail, tail)
}

/// The same within 2.3·10⁻⁴, without a division: an odd polynomial with slope 0 at 3.55. Only for
/// surfaces. There an error moves optical depth from one sheet to the next, both with the same
/// splat's colour, and removes none.
#[inline(always)]
fn near_normal_cdf<S: Simd>(simd: S, t: Lanes<S>) -> Lanes<S> {
    let x = t.max(Lanes::splat(simd, -3.55)).min(Lanes::splat(simd, 3.55));
    let y = x * x;
    let mut p = Lanes::splat(simd, -6.913_499e-7);
    for term in [3.451_519e-5, -7.243_617e-4, 8.523_512e-3, -6.442_942e-2, 3.980_850_5e-1] {
        p = p.mul_add(y, Lanes::splat(simd, term));
    }
    x.mul_add(p, Lanes::splat(simd, 0.5))
}

impl<S: Simd> OpenTile<'_, S> {
    /// Adds a splat's window to all packets that it meets. `plan` is that of the splat's field.
    #[inline(always)]
    pub fn add(&mut self, simd: S, plan: &Plan, record: &Record, window: Window) {
        let [first, last] = record.pixels;
        let from = each!([0, 1], AXIS => (first[AXIS] - self.corner[AXIS]).max(0) as usize);
        let to = each!([0, 1], AXIS => {
            (last[AXIS] - self.corner[AXIS]).min(TILE as i32 - 1) as usize
        });
        if matches!(record.kind, Kind::Facet | Kind::Rod) {
            let packets = packets_between(from, to);
            match record.kind {
                Kind::Rod => apart(
                    simd,
                    #[inline(always)]
                    || self.add_rod(simd, plan, record, window, packets),
                ),
                _ => apart(
                    simd,
                    #[inline(always)]
                    || self.add_facet(simd, plan, record, window, packets),
                ),
            }
            return;
        }
        apart(
            simd,
            #[inline(always)]
            || self.add_splat(simd, plan, record, window, [from, to]),
        );
    }

    /// Adds a splat's window to the packets between two pixels of the tile.
    #[inline(always)]
    fn add_splat(
        &mut self,
        simd: S,
        plan: &Plan,
        record: &Record,
        window: Window,
        [from, to]: [[usize; 2]; 2],
    ) {
        let splat = Projected::new(plan, record, window);
        let field = self.fields.get_mut(usize::from(record.field));
        let mut scalar = field.and_then(|field| field.sums.as_deref_mut());
        for row in from[1] / HIGH..=to[1] / HIGH {
            for column in from[0] / WIDE..=to[0] / WIDE {
                let packet = &mut self.packets[row * 2 + column];
                // Neighbouring pixels need a pixel's value, however opaque it is.
                if packet.is_done && !plan.central {
                    continue;
                }
                match (record.kind, &mut scalar) {
                    (Kind::Scalar, Some(sums)) => splat.add_scalar(simd, plan, packet, sums),
                    (Kind::Scalar, None) => {}
                    _ => splat.add_radiance(simd, plan, packet, &mut self.sums),
                }
            }
        }
    }
}

/// Returns the packets of a tile that a box of pixels meets, as bits.
#[inline(always)]
fn packets_between(from: [usize; 2], to: [usize; 2]) -> u8 {
    // Two packets stand in a row: a bit and the next one.
    let row = (u8::from(from[0] < WIDE)) | (u8::from(to[0] >= WIDE) << 1);
    let mut packets = 0;
    for number in from[1] / HIGH..=to[1] / HIGH {
        packets |= row << (2 * number);
    }
    packets
}

/// Returns the number of a window's planes that its splat reaches. That is one more than its last
/// sheet needs: near the rim of a footprint, sections reach further.
#[inline(always)]
fn planes_of(plan: &Plan, record: &Record, window: Window) -> usize {
    let ahead = (usize::from(record.sheets[1]) + 1).saturating_sub(window.front);
    match plan.by_centers {
        _ if plan.is_whole() => 0,
        true => ahead - 1,
        false => ahead.min(WINDOW - 1),
    }
}

/// Composites a splat alone, in front of or behind the pixels so far. `share` is what it absorbs of
/// their light.
#[inline(always)]
fn single<S: Simd>(
    simd: S,
    plan: &Plan,
    record: &Record,
    share: Lanes<S>,
    order: Order,
    packet: &mut Packet<S>,
) {
    let [_, _, red, green, blue, x, y, z] = record.payload;
    let normal = [x, y, z].map(|part| Lanes::splat(simd, part));
    let mut color = [red, green, blue].map(|part| Lanes::splat(simd, part));
    if plan.lit_surfaces && [x, y, z] != [0.0; 3] {
        // Other lights than that from the eye need sheets.
        let on = (&packet.rays, Lanes::splat(simd, 0.0));
        color = plan.lit_surface(simd, color, normal, on);
    }
    let pixels = &mut packet.pixels;
    let before = pixels.through;
    let left = 1.0 - share;
    let takes_half = match order {
        Order::BackToFront => {
            pixels.color = three!(I => share.mul_add(color[I], pixels.color[I] * left));
            left.simd_le(0.5)
        }
        Order::FrontToBack => {
            let share = before * share;
            pixels.color = three!(I => share.mul_add(color[I], pixels.color[I]));
            packet.is_done = !(before * left).simd_ge(OPAQUE).any_true();
            before.simd_gt(0.5) & (before * left).simd_le(0.5)
        }
    };
    pixels.through = before * left;
    let [x, y, z] = record.center;
    let distance = if plan.view.perspective { (x * x + y * y + z * z).sqrt() } else { z };
    pixels.hit = takes_half.select(Lanes::splat(simd, distance), pixels.hit);
}

/// Whether the clips keep a place on each ray.
#[inline(always)]
pub fn is_kept<S: Simd>(plan: &Plan, rays: &Rays<S>, distance: Lanes<S>) -> mask32x8<S> {
    let mut kept = distance.simd_ge(rays.kept[0]) & distance.simd_le(rays.kept[1]);
    for [from, to] in &rays.holes[..plan.holes] {
        kept &= !(distance.simd_gt(*from) & distance.simd_lt(*to));
    }
    kept
}

/// Returns the kernel and −h′(r)/r at radii in kernel space; 0 beyond its extent.
#[inline(always)]
fn kernel_at<S: Simd>(simd: S, plan: &Plan, radius: Lanes<S>) -> [Lanes<S>; 2] {
    let FieldKernel { extent: length, per_extent: per_length, .. } = plan.field.kernel;
    let last = (RADII - 1) as f32;
    let radii: [f32; 8] = radius.into();
    let mut values = [[0.0f32; 8]; 2];
    for (lane, radius) in radii.into_iter().enumerate() {
        if radius <= length {
            let at = (radius * per_length * last).min(last);
            let [a, b, c, d] = plan.tables.radii[at as usize];
            let part = at.fract();
            (values[0][lane], values[1][lane]) = (a + (c - a) * part, b + (d - b) * part);
        }
    }
    [values[0].simd_into(simd), values[1].simd_into(simd)]
}

/// Returns the kernel's integral along lines at distances `rho` from its centre, from the closest
/// approach to t.
#[inline(always)]
fn kernel_integral<S: Simd>(simd: S, plan: &Plan, rho: Lanes<S>, t: Lanes<S>) -> Lanes<S> {
    let per_length = plan.field.kernel.per_extent;
    let cells = SECTIONS as f32;
    let ([rhos, ts], mut integrals): ([[f32; 8]; 2], _) = ([rho.into(), t.into()], [0.0f32; 8]);
    for lane in 0..8 {
        let place = |value: f32| (value * per_length * cells).min(cells - 1e-3);
        let (x, y) = (place(rhos[lane]), place(ts[lane].abs()));
        let [a, b, c, d] = plan.tables.sections[x as usize * SECTIONS + y as usize];
        let (low, high) = (a + (b - a) * y.fract(), c + (d - c) * y.fract());
        integrals[lane] =
            (low + (high - low) * x.fract()).copysign(if ts[lane] >= 0.0 { 1.0 } else { -1.0 });
    }
    integrals.simd_into(simd)
}
