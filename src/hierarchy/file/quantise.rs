//! Splats as whole numbers: how fine each quantity is kept, and the way back.
//!
//! Everything that decoding computes is made of operations that every machine rounds alike (+ − × ÷ √ on 64 bits) and of
//! tables from `libm`, so that a file gives the same nodes everywhere.

use super::octahedron;
use crate::splat::{NO_NORMAL, Splat};
use glam::{DMat3, DQuat, DVec3};
use std::{f64::consts::PI, sync::LazyLock};

/// The width at half height of a Gaussian, in standard deviations: 2·√(2·ln 2).
pub const FULL_WIDTH: f64 = 2.354_820_045_030_949_3;

/// Steps of the largest standard deviation in a doubling.
const SIGMA_STEPS: i32 = 12;
/// Steps of the ratio of the two standard deviations in the ellipse's plane in a doubling.
const RATIO_STEPS: i32 = 6;
/// Steps of the ratio across the plane in a doubling.
const THICKNESS_STEPS: i32 = 4;
/// Steps of the strength in a doubling.
const STRENGTH_STEPS: i32 = 24;

/// Steps of a leaf's position in the width of its splat, along each axis: no more than 1/64 of it is lost in all.
const LEAF_STEPS: f64 = 56.0;
/// The same of other nodes, which are drawn where this is less than a tenth of a pixel.
const INNER_STEPS: f64 = 8.0;

/// Steps of a quaternion's parts, each way.
const TURN_STEPS: i32 = 511;

/// The code of a strength of 0.
const NO_STRENGTH: i32 = i16::MIN as i32;

/// The codes that may be: what is beyond makes no splat.
const MOST_RATIO: i32 = 16 * RATIO_STEPS;
const MOST_STRENGTH: i32 = 300 * STRENGTH_STEPS;
const MOST_THICKNESS: i32 = 20 * THICKNESS_STEPS;
const MOST_STEPS: f64 = (1 << 28) as f64;

/// Parts of a doubling that powers are told in.
pub const PARTS: i32 = 48;

/// 2^(k/48).
pub fn power(k: i32) -> f64 {
    static TABLE: LazyLock<[f64; PARTS as usize]> =
        LazyLock::new(|| std::array::from_fn(|part| libm::exp2(part as f64 / f64::from(PARTS))));
    let exponent = k.div_euclid(PARTS).clamp(-1022, 1023);
    TABLE[k.rem_euclid(PARTS) as usize] * f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// What the axes of a splat are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// Two lie across its normal, the third along it.
    Normal = 0,
    /// Its own; and it has a normal.
    Own = 1,
    /// Its own; and it has no normal.
    Bare = 2,
}

impl Axes {
    pub fn of(code: i32) -> Option<Self> {
        [Self::Normal, Self::Own, Self::Bare].into_iter().find(|&axes| axes as i32 == code)
    }
}

/// A splat as whole numbers.
#[derive(Debug, Clone, Copy)]
pub struct Code {
    pub axes: Axes,
    /// The larger standard deviation in the plane of the first two axes.
    pub sigma: i32,
    /// How much smaller the second is than the first, and the third than the second.
    pub ratio: i32,
    pub thickness: i32,
    /// The direction of the first axis in the plane across the normal.
    pub angle: i32,
    /// The axes as a quaternion: which part is the largest, and the others.
    pub turn: [i32; 4],
    /// On the octahedron, less that of the node before.
    pub normal: [i32; 2],
    /// Steps along the axes from the node before.
    pub position: [i32; 3],
    /// Luma and two chromas, less those of the node before; opacity.
    pub color: [i32; 4],
    pub strength: i32,
}

/// What a page says at its beginning, and the node before, from which the next one is told.
#[derive(Debug, Clone, Copy)]
pub struct Before {
    /// Which way most normals of the page face ([`octahedron::facing`]).
    pub facing: u8,
    /// The strength that others are told from.
    pub strength: f32,
    pub center: [f32; 3],
    pub normal: [i32; 2],
    pub color: [i32; 3],
    /// Its normal, where its axes are those of it.
    pub direction: Option<DVec3>,
}

/// The ellipsoid of a splat.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Unit axes.
    pub axes: [DVec3; 3],
    /// Standard deviations along them.
    pub sigma: [f64; 3],
}

impl Shape {
    pub fn largest(&self) -> f64 {
        self.sigma[0].max(self.sigma[2])
    }

    /// The lower triangular factor of its covariance (Cholesky).
    fn factor(&self) -> [f32; 6] {
        let [a, b, c] = [0, 1, 2].map(|i| self.axes[i] * self.sigma[i]);
        let sum = |i: usize, j: usize| a[i] * a[j] + b[i] * b[j] + c[i] * c[j];
        let b00 = sum(0, 0).sqrt();
        let (b10, b20) = (sum(1, 0) / b00, sum(2, 0) / b00);
        let b11 = (sum(1, 1) - b10 * b10).max(sum(1, 1) * 1e-14).sqrt();
        let b21 = (sum(2, 1) - b20 * b10) / b11;
        let b22 = (sum(2, 2) - b20 * b20 - b21 * b21).max(sum(2, 2) * 1e-14).sqrt();
        [b00, b10, b11, b20, b21, b22].map(|value| value as f32)
    }

    /// The steps of positions along the axes.
    fn step(&self, is_leaf: bool) -> f64 {
        let steps = if is_leaf { LEAF_STEPS } else { INNER_STEPS };
        let [first, second, _] = self.sigma;
        // Along a long ellipse no coarser than across it.
        first.min(2.0 * second) * FULL_WIDTH / steps
    }
}

/// How many directions the first axis of an ellipse of some ratio may have: the rounder it is, the fewer tell.
pub fn angles(ratio: i32) -> usize {
    table(ratio).len()
}

/// Cosines and sines of the directions.
fn table(ratio: i32) -> &'static [[f64; 2]] {
    static TABLES: LazyLock<Vec<Vec<[f64; 2]>>> = LazyLock::new(|| {
        let tables = (0..=MOST_RATIO).map(|ratio| {
            let wide = libm::exp2(f64::from(ratio) / f64::from(RATIO_STEPS));
            let count = (8.0 * (wide - 1.0 / wide)).ceil().clamp(1.0, 256.0);
            let direction = |k: usize| PI * k as f64 / count;
            (0..count as usize).map(|k| [libm::cos(direction(k)), libm::sin(direction(k))]).collect()
        });
        tables.collect()
    });
    &TABLES[ratio as usize]
}

/// Two unit vectors that make a right-handed frame with a unit vector (Duff et al. 2017).
fn across(n: DVec3) -> [DVec3; 2] {
    let sign = if n.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y)]
}

/// The axes of a normal's frame whose first points in the `angle`-th direction.
fn axes_of_normal(normal: DVec3, ratio: i32, angle: i32) -> [DVec3; 3] {
    let [u, v] = across(normal);
    let [cosine, sine] = table(ratio)[angle as usize];
    [u * cosine + v * sine, v * cosine - u * sine, normal]
}

/// The axes of a quaternion of which the largest part is left out.
fn axes_of_turn([largest, parts @ ..]: [i32; 4]) -> Option<[DVec3; 3]> {
    let part = |value: i32| f64::from(value) / (f64::from(TURN_STEPS) * std::f64::consts::SQRT_2);
    let [a, b, c] = parts.map(part);
    let rest = 1.0 - (a * a + b * b + c * c);
    let fits = parts.iter().all(|part| part.abs() <= TURN_STEPS) && rest > 0.0;
    let d = if fits { rest.sqrt() } else { return None };
    let [x, y, z, w] = match largest {
        0 => [d, a, b, c],
        1 => [a, d, b, c],
        2 => [a, b, d, c],
        3 => [a, b, c, d],
        _ => return None,
    };
    Some([
        DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    ])
}

/// The quaternion of three unit axes, right-handed.
fn turn([x, y, z]: [DVec3; 3]) -> [i32; 4] {
    let parts = DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize().to_array();
    let largest = (0..4).max_by(|&a, &b| parts[a].abs().total_cmp(&parts[b].abs())).expect("there are four");
    let scale = f64::from(TURN_STEPS) * std::f64::consts::SQRT_2 * parts[largest].signum();
    let mut out = [largest as i32; 4];
    let rest = (0..4).filter(|&part| part != largest).map(|part| (parts[part] * scale).round() as i32);
    out[1..].iter_mut().zip(rest).for_each(|(out, part)| *out = part.clamp(-TURN_STEPS, TURN_STEPS));
    out
}

/// How far a smooth surface rises along the normal of a node on the way `across` it from the one before: a chord of a
/// parabola lies across the mean of the normals at its ends.
fn rise(before: Option<DVec3>, normal: Option<DVec3>, across: DVec3) -> f64 {
    let (Some(before), Some(normal)) = (before, normal) else { return 0.0 };
    let both = 1.0 + before.dot(normal);
    if both > 0.5 { -across.dot(before) / both } else { 0.0 }
}

/// Luma and chromas of red, green and blue, reversibly (YCoCg-R, Malvar & Sullivan 2003).
fn luma(color: u32) -> [i32; 3] {
    let [r, g, b] = [0, 8, 16].map(|shift| (color >> shift & 255) as i32);
    let orange = r - b;
    let half = b + (orange >> 1);
    let green = g - half;
    [half + (green >> 1), orange, green]
}

/// Red, green and blue; `None` where one is none of 8 bits.
fn color([luma, orange, green]: [i32; 3]) -> Option<u32> {
    let half = luma.wrapping_sub(green >> 1);
    let g = green.wrapping_add(half);
    let b = half.wrapping_sub(orange >> 1);
    let r = b.wrapping_add(orange);
    let fits = [r, g, b].iter().all(|part| (0..256).contains(part));
    fits.then_some(r as u32 | (g as u32) << 8 | (b as u32) << 16)
}

impl Code {
    /// The splat behind a code, and its shape; `None` for codes of no splat. `before` becomes what this node leaves.
    pub fn decode(&self, is_leaf: bool, before: &mut Before) -> Option<(Splat, Shape)> {
        let shape = self.shape(before)?;
        Some((self.splat(&shape, is_leaf, before)?, shape))
    }

    /// The ellipsoid, and the normal as the new one before.
    fn shape(&self, before: &mut Before) -> Option<Shape> {
        let is_shape = (0..=MOST_RATIO).contains(&self.ratio)
            && (-MOST_THICKNESS..=MOST_THICKNESS).contains(&self.thickness)
            && (-160 * SIGMA_STEPS..160 * SIGMA_STEPS).contains(&self.sigma);
        if !is_shape {
            return None;
        }
        let first = self.sigma * (PARTS / SIGMA_STEPS);
        let second = first - self.ratio * (PARTS / RATIO_STEPS);
        let third = second - self.thickness * (PARTS / THICKNESS_STEPS);
        let sigma = [power(first), power(second), power(third)];
        if self.axes != Axes::Bare {
            before.normal = [0, 1].map(|i| before.normal[i].wrapping_add(self.normal[i]));
            if !octahedron::contains(before.normal) {
                return None;
            }
        }
        let axes = match self.axes {
            Axes::Normal if (0..angles(self.ratio) as i32).contains(&self.angle) => {
                axes_of_normal(octahedron::direction(before.facing, before.normal), self.ratio, self.angle)
            }
            Axes::Normal => return None,
            Axes::Own | Axes::Bare => axes_of_turn(self.turn)?,
        };
        Some(Shape { axes, sigma })
    }

    /// All that is left once the shape is known.
    fn splat(&self, shape: &Shape, is_leaf: bool, before: &mut Before) -> Option<Splat> {
        let axes = &shape.axes;
        let normal = if self.axes == Axes::Bare { NO_NORMAL } else { octahedron::packed(before.facing, before.normal) };
        let step = shape.step(is_leaf);
        let [x, y, z] = self.position.map(|count| step * f64::from(count));
        let across = axes[0] * x + axes[1] * y;
        let direction = if self.axes == Axes::Normal { Some(axes[2]) } else { None };
        let center = DVec3::from(before.center.map(f64::from))
            + across
            + axes[2] * (rise(before.direction, direction, across) + z);
        before.center = center.to_array().map(|value| value as f32);
        before.direction = direction;
        for (before, more) in before.color.iter_mut().zip(self.color) {
            *before = before.wrapping_add(more);
        }
        let alpha = u32::try_from(self.color[3]).ok().filter(|&alpha| alpha < 256)?;
        let strength = match self.strength {
            NO_STRENGTH => 0.0,
            steps => {
                (f64::from(before.strength)
                    * power(steps.clamp(-MOST_STRENGTH, MOST_STRENGTH) * (PARTS / STRENGTH_STEPS)))
                    as f32
            }
        };
        let color = color(before.color)? | alpha << 24;
        let splat = Splat { center: before.center, strength, factor: shape.factor(), color, normal };
        let numbers = splat.center.iter().chain(&splat.factor).chain([&splat.strength]);
        numbers.copied().all(f32::is_finite).then_some(splat)
    }

    /// The code of a splat, and what comes back of it. `None` for splats beyond what codes can tell: without width, of
    /// negative strength, too far from the node before.
    pub fn encode(splat: &Splat, is_leaf: bool, before: &mut Before) -> Option<(Self, Splat, Shape)> {
        let normal = octahedron::unpacked(splat.normal);
        let (axes, ellipsoid) = ellipsoid(splat, normal, is_leaf)?;
        let [first, second, third] = ellipsoid.sigma.map(libm::log2);
        let round = |value: f64, steps: i32| (value * f64::from(steps)).round() as i32;
        let sigma = round(first, SIGMA_STEPS);
        let first = f64::from(sigma) / f64::from(SIGMA_STEPS);
        let ratio = round(first - second, RATIO_STEPS).clamp(0, MOST_RATIO);
        let thickness = round(second - third, THICKNESS_STEPS).clamp(-MOST_THICKNESS, MOST_THICKNESS);
        let place = normal.map_or(before.normal, |normal| octahedron::nearest(before.facing, normal));
        let mut angle = 0;
        if axes == Axes::Normal {
            let [u, v] = across(octahedron::direction(before.facing, place));
            let count = angles(ratio) as f64;
            let direction = libm::atan2(ellipsoid.axes[0].dot(v), ellipsoid.axes[0].dot(u)) / PI;
            angle = (direction * count).round().rem_euclid(count) as i32;
        }
        let turn = if axes == Axes::Normal { [0; 4] } else { turn(ellipsoid.axes) };
        let luma = luma(splat.color);
        let strength = match splat.strength {
            strength if strength < 0.0 => return None,
            0.0 => NO_STRENGTH,
            strength => round(libm::log2(f64::from(strength) / f64::from(before.strength)), STRENGTH_STEPS),
        };
        let mut code = Self {
            axes,
            sigma,
            ratio,
            thickness,
            angle,
            turn,
            normal: [0, 1].map(|i| place[i] - before.normal[i]),
            position: [0; 3],
            color: [
                luma[0] - before.color[0],
                luma[1] - before.color[1],
                luma[2] - before.color[2],
                (splat.color >> 24) as i32,
            ],
            strength,
        };
        // Once all else is known, the steps of the position are.
        let shape = code.shape(before)?;
        let away = DVec3::from(splat.center.map(f64::from)) - DVec3::from(before.center.map(f64::from));
        let step = shape.step(is_leaf);
        let whole = |length: f64| {
            let steps = (length / step).round();
            (steps.abs() < MOST_STEPS).then_some(steps as i32)
        };
        let [x, y, z] = shape.axes;
        let (first, second) = (whole(away.dot(x))?, whole(away.dot(y))?);
        let across = x * (step * f64::from(first)) + y * (step * f64::from(second));
        let direction = if axes == Axes::Normal { Some(z) } else { None };
        code.position = [first, second, whole(away.dot(z) - rise(before.direction, direction, across))?];
        let splat = code.splat(&shape, is_leaf, before)?;
        Some((code, splat, shape))
    }
}

/// Standard deviations and axes of a splat, those of its normal where they are near enough.
fn ellipsoid(splat: &Splat, normal: Option<DVec3>, is_leaf: bool) -> Option<(Axes, Shape)> {
    let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
    let columns = [DVec3::new(b00, b10, b20), DVec3::new(0.0, b11, b21), DVec3::new(0.0, 0.0, b22)];
    if let Some(normal) = normal {
        let [u, v] = across(normal);
        let seen = |t: DVec3| DVec3::from(columns.map(|column| column.dot(t)));
        let (x, y, z) = (seen(u), seen(v), seen(normal));
        let (xx, xy, yy, zz) = (x.length_squared(), x.dot(y), y.length_squared(), z.length_squared());
        let (mean, half) = ((xx + yy) * 0.5, (xx - yy) * 0.5);
        let root = (half * half + xy * xy).sqrt();
        let (large, small) = (mean + root, mean - root);
        // What is neither along the normal nor across: by the angle between the normal and the ellipsoid's own axis for
        // leaves, 1° at most; other nodes are drawn where their tilt cannot be seen.
        let tilt = DVec3::new(x.dot(z), y.dot(z), 0.0).length();
        let most = if is_leaf { 0.0175 * (small - zz).max(0.0) + 1e-6 * large } else { 0.25 * large };
        if large > 0.0 && tilt <= most {
            let (a, b) = if half >= 0.0 { (half + root, xy) } else { (xy, root - half) };
            let length = (a * a + b * b).sqrt();
            let first = if length > 0.0 { (u * a + v * b) / length } else { u };
            let sigma = sound([large, small, zz].map(|square| square.max(0.0).sqrt()))?;
            return Some((Axes::Normal, Shape { axes: [first, normal.cross(first), normal], sigma }));
        }
    }
    let b = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let (squares, axes) = crate::math::eigen(b * b.transpose());
    let sigma = sound(squares.map(f64::sqrt))?;
    let axes = [axes[0], axes[1], axes[0].cross(axes[1])];
    Some((if normal.is_some() { Axes::Own } else { Axes::Bare }, Shape { axes, sigma }))
}

/// Widths that codes can tell; none is flat without end.
fn sound([first, second, third]: [f64; 3]) -> Option<[f64; 3]> {
    let second = second.max(first * 2f64.powi(-15));
    (first > 0.0 && first.is_finite()).then_some([first, second, third.max(second * 2f64.powi(-19))])
}
