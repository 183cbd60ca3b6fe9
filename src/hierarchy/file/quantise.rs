//! Splats as integers: the resolution of each quantity, encoding and decoding.
//!
//! Decoding uses only operations that every machine rounds alike (+ − × ÷ √ in 64 bits), and tables
//! computed with `libm`. So a file gives the same nodes everywhere.

use super::direction::{self, Directions};
use crate::{
    hierarchy::validate::is_drawable,
    splat::{NO_NORMAL, Splat},
};
use glam::{DMat3, DQuat, DVec3};
use std::{f64::consts::PI, sync::LazyLock};

/// Full width at half maximum of a Gaussian, in standard deviations: 2·√(2·ln 2).
pub const FULL_WIDTH: f64 = 2.354_820_045_030_949_3;

/// Powers of two are stored in units of 1/96 octave.
pub const PARTS: i32 = 96;

/// The resolution at which the splats of leaves, or of inner nodes, are stored.
struct Fineness {
    /// Steps in units of 1/[`PARTS`] octave: of the largest standard deviation, of the ratios to
    /// the second and the third, and of the strength.
    sigma: i32,
    ratio: i32,
    thickness: i32,
    strength: i32,
    directions: Directions,
    /// Position steps in the width of a splat.
    position: f64,
    /// For each ratio of an ellipse's axes, the cosines and sines of the possible directions of its
    /// first axis, spread over half a turn. The rounder the ellipse, the fewer directions are
    /// needed.
    angles: Vec<Vec<[f64; 2]>>,
}

/// Inner nodes are coarser, because they are drawn when they are only a pixel or two wide.
static FINENESS: LazyLock<[Fineness; 2]> = LazyLock::new(|| {
    let inner = Fineness {
        sigma: PARTS / 4,
        ratio: PARTS / 3,
        thickness: PARTS,
        strength: PARTS / 6,
        directions: Directions(17),
        position: 5.0,
        angles: angles(PARTS / 3, 2.5),
    };
    let leaf = Fineness {
        sigma: PARTS / 8,
        ratio: PARTS / 6,
        thickness: PARTS / 4,
        strength: PARTS / 24,
        directions: Directions(34),
        position: 90.0,
        angles: angles(PARTS / 6, 4.0),
    };
    [inner, leaf]
});

/// How far ahead the next node is predicted, in widths of its splat, in the direction of the last
/// step.
const AHEAD: f64 = 0.25;

/// Steps of a quaternion's components, in each direction.
const TURN_STEPS: i32 = 511;

/// The code of a strength of 0.
const NO_STRENGTH: i32 = i16::MIN as i32;

/// Upper bounds on codes, in units of 1/[`PARTS`] octave. Codes beyond them are not valid splats.
const MOST_SIGMA: i32 = 160 * PARTS;
const MOST_RATIO: i32 = 16 * PARTS;
const MOST_THICKNESS: i32 = 20 * PARTS;
const MOST_STRENGTH: i32 = 300 * PARTS;
const MOST_STEPS: f64 = (1 << 28) as f64;

/// 2^(k/96).
pub fn power(k: i32) -> f64 {
    static TABLE: LazyLock<[f64; PARTS as usize]> =
        LazyLock::new(|| std::array::from_fn(|part| libm::exp2(part as f64 / f64::from(PARTS))));
    let exponent = k.div_euclid(PARTS).clamp(-1022, 1023);
    TABLE[k.rem_euclid(PARTS) as usize] * f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// The base-2 logarithm of a positive normal number, from the series of the inverse hyperbolic
/// tangent. The error is at most 10⁻⁸.
pub fn logarithm(value: f64) -> f64 {
    const SQRT_2: f64 = std::f64::consts::SQRT_2;
    let bits = value.to_bits();
    let exponent = f64::from((bits >> 52) as i32 - 1023);
    let part = f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52);
    let t = (part - SQRT_2) / (part + SQRT_2);
    let square = t * t;
    let sum = 1.0
        + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0 + square * (1.0 / 9.0))));
    exponent + 0.5 + t * sum * (2.0 / std::f64::consts::LN_2)
}

/// Returns the code of the largest standard deviation of an inner node.
pub fn inner_sigma(sigma: f64) -> i32 {
    nearest(logarithm(sigma.max(f64::MIN_POSITIVE)) * f64::from(PARTS / FINENESS[0].sigma))
}

/// Returns the standard deviation for the code of an inner node.
pub fn sigma_of_inner(code: i32) -> f64 {
    power(code.saturating_mul(FINENESS[0].sigma))
}

/// Rounds to the nearest integer, halves away from 0.
fn nearest(value: f64) -> i32 {
    (value + 0.5f64.copysign(value)) as i32
}

/// How the axes of a splat are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// Two axes lie across its normal, and the third along it.
    Normal = 0,
    /// Its own axes; the splat has a normal.
    Own = 1,
    /// Its own axes; the splat has no normal.
    Bare = 2,
}

impl Axes {
    pub fn of(code: i32) -> Option<Self> {
        [Self::Normal, Self::Own, Self::Bare].into_iter().find(|&axes| axes as i32 == code)
    }
}

/// A splat as integers.
#[derive(Debug, Clone, Copy)]
pub struct Code {
    pub axes: Axes,
    /// The larger standard deviation along the first two axes.
    pub sigma: i32,
    /// How much smaller the second standard deviation is than the first, and the third than the
    /// second.
    pub ratio: i32,
    pub thickness: i32,
    /// The direction of the first axis in the plane perpendicular to the normal.
    pub angle: i32,
    /// The axes as a quaternion: the index of its largest component, then the other components.
    pub turn: [i32; 4],
    /// Steps from the previous normal.
    pub normal: [i32; 2],
    /// Steps from the predicted position: ahead, to the left and along the normal; or along the
    /// splat's own axes.
    pub position: [i32; 3],
    /// Luma and two chromas, as differences from the previous node; then opacity.
    pub color: [i32; 4],
    pub strength: i32,
}

/// The values, from the page's start and the previous node, relative to which the next node is
/// stored.
#[derive(Debug, Clone, Copy)]
pub struct Before {
    /// The base of all strengths.
    strength: f32,
    center: [f32; 3],
    color: [i32; 3],
    /// The last normal, and two directions perpendicular to it.
    normal: DVec3,
    across: [DVec3; 2],
    /// The step to the last node.
    way: DVec3,
}

impl Before {
    /// The state at the beginning of a page.
    pub fn new(strength: f32, center: [f32; 3]) -> Self {
        let across = direction::across(DVec3::Z);
        Self { strength, center, color: [0; 3], normal: DVec3::Z, across, way: DVec3::ZERO }
    }

    fn center(&self) -> DVec3 {
        DVec3::from(self.center.map(f64::from))
    }
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

    /// Returns the lower Cholesky factor of the covariance. It uses the adjugate, so that nothing
    /// is subtracted unnecessarily.
    fn factor(&self) -> [f32; 6] {
        let [first, second, third] = self.sigma;
        let [a, b, c] = [self.axes[0] * first, self.axes[1] * second, self.axes[2] * third];
        let [d, e, f] = [
            self.axes[0] * (second * third),
            self.axes[1] * (first * third),
            self.axes[2] * (first * second),
        ];
        let b00 = (a.x * a.x + b.x * b.x + c.x * c.x).sqrt();
        let minor = (d.z * d.z + e.z * e.z + f.z * f.z).sqrt();
        let (one, two) = (1.0 / b00, 1.0 / minor);
        let b10 = (a.x * a.y + b.x * b.y + c.x * c.y) * one;
        let b20 = (a.x * a.z + b.x * b.z + c.x * c.z) * one;
        let b21 = -(d.y * d.z + e.y * e.z + f.y * f.z) * one * two;
        [b00, b10, minor * one, b20, b21, first * second * third * two].map(|value| value as f32)
    }

    /// Returns the step of positions.
    fn step(&self, fineness: &Fineness) -> f64 {
        let [first, second, _] = self.sigma;
        // Along a long ellipse, the step is no coarser than across it.
        first.min(2.0 * second) * FULL_WIDTH / fineness.position
    }
}

/// Returns the possible directions of the first axis, for each ratio of the axes of an ellipse.
fn angles(step: i32, density: f64) -> Vec<Vec<[f64; 2]>> {
    let of = |ratio: i32| {
        let wide = libm::exp2(f64::from(ratio * step) / f64::from(PARTS));
        let count = (density * (wide - 1.0 / wide)).ceil().clamp(1.0, 64.0);
        let direction = |k: usize| PI * k as f64 / count;
        (0..count as usize).map(|k| [libm::cos(direction(k)), libm::sin(direction(k))]).collect()
    };
    (0..=MOST_RATIO / step).map(of).collect()
}

/// Returns the axes of a quaternion whose largest component is left out.
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

/// Returns the quaternion of three right-handed unit axes.
fn turn([x, y, z]: [DVec3; 3]) -> [i32; 4] {
    let parts = DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize().to_array();
    let largest =
        (0..4).max_by(|&a, &b| parts[a].abs().total_cmp(&parts[b].abs())).expect("there are four");
    let scale = f64::from(TURN_STEPS) * std::f64::consts::SQRT_2 * parts[largest].signum();
    let mut out = [largest as i32; 4];
    let rest =
        (0..4).filter(|&part| part != largest).map(|part| (parts[part] * scale).round() as i32);
    out[1..]
        .iter_mut()
        .zip(rest)
        .for_each(|(out, part)| *out = part.clamp(-TURN_STEPS, TURN_STEPS));
    out
}

/// The frame in which a node's position is stored, and its zero. For axes by the normal, the frame
/// is ahead in the direction of the last step, to the left of it, and along the normal.
struct Course {
    axes: [DVec3; 3],
    start: f64,
    /// The slope of the surface along the first two axes, if it is smooth. The chord of a parabola
    /// is perpendicular to the mean of the normals at its ends.
    fall: [f64; 2],
}

impl Course {
    fn new(kind: Axes, shape: &Shape, before: &Before, last: DVec3, fineness: &Fineness) -> Self {
        let normal = shape.axes[2];
        if kind != Axes::Normal {
            return Self { axes: shape.axes, start: 0.0, fall: [0.0; 2] };
        }
        let along = before.way - normal * before.way.dot(normal);
        let length = along.length_squared().sqrt();
        let (ahead, start) = if length > 1e-100 {
            (along / length, AHEAD * fineness.position)
        } else {
            (before.across[0], 0.0)
        };
        let left = normal.cross(ahead);
        let both = 1.0 + last.dot(normal);
        let fall =
            if both > 0.5 { [ahead, left].map(|side| side.dot(last) / both) } else { [0.0; 2] };
        Self { axes: [ahead, left, normal], start, fall }
    }

    /// Returns the displacement for a number of steps.
    fn place(&self, [x, y, z]: [i32; 3], step: f64) -> DVec3 {
        let (x, y) = (step * (f64::from(x) + self.start), step * f64::from(y));
        let z = step * f64::from(z) - (x * self.fall[0] + y * self.fall[1]);
        self.axes[0] * x + self.axes[1] * y + self.axes[2] * z
    }

    /// Returns the steps to a displacement.
    fn steps(&self, place: DVec3, step: f64) -> Option<[i32; 3]> {
        let whole = |steps: f64| (steps.abs() < MOST_STEPS).then_some(nearest(steps));
        let x = whole(place.dot(self.axes[0]) / step - self.start)?;
        let y = whole(place.dot(self.axes[1]) / step)?;
        let fall = (f64::from(x) + self.start) * self.fall[0] + f64::from(y) * self.fall[1];
        Some([x, y, whole(place.dot(self.axes[2]) / step + fall)?])
    }
}

/// Converts red, green and blue to luma and chromas, reversibly (YCoCg-R, Malvar & Sullivan 2003).
fn luma(color: u32) -> [i32; 3] {
    let [r, g, b] = [0, 8, 16].map(|shift| (color >> shift & 255) as i32);
    let orange = r - b;
    let half = b + (orange >> 1);
    let green = g - half;
    [half + (green >> 1), orange, green]
}

/// Returns red, green and blue; `None` if one does not fit in 8 bits.
fn color([luma, orange, green]: [i32; 3]) -> Option<u32> {
    let half = luma.wrapping_sub(green >> 1);
    let g = green.wrapping_add(half);
    let b = half.wrapping_sub(orange >> 1);
    let r = b.wrapping_add(orange);
    let fits = [r, g, b].iter().all(|part| (0..256).contains(part));
    fits.then_some(r as u32 | (g as u32) << 8 | (b as u32) << 16)
}

impl Code {
    /// Decodes a splat and its shape; `None` if the code is not valid. Updates `before` for the
    /// next node.
    pub fn decode(&self, is_leaf: bool, before: &mut Before) -> Option<(Splat, Shape)> {
        let fineness = &FINENESS[usize::from(is_leaf)];
        let last = before.normal;
        let shape = self.shape(fineness, before)?;
        let course = Course::new(self.axes, &shape, before, last, fineness);
        Some((self.splat(fineness, &shape, &course, before)?, shape))
    }

    /// Decodes the ellipsoid, and sets the normal in `before`.
    fn shape(&self, fineness: &Fineness, before: &mut Before) -> Option<Shape> {
        let sigma = self.sigma.checked_mul(fineness.sigma)?;
        let ratio = self.ratio.checked_mul(fineness.ratio)?;
        let thickness = self.thickness.checked_mul(fineness.thickness)?;
        let is_shape = (-MOST_SIGMA..MOST_SIGMA).contains(&sigma)
            && (0..=MOST_RATIO).contains(&ratio)
            && (-MOST_THICKNESS..=MOST_THICKNESS).contains(&thickness);
        if !is_shape {
            return None;
        }
        if self.axes != Axes::Bare {
            before.normal =
                fineness.directions.decode(before.normal, before.across, self.normal)?;
            before.across = direction::across(before.normal);
        }
        let axes = match self.axes {
            Axes::Normal => {
                let angles = &fineness.angles[self.ratio as usize];
                let [cosine, sine] = *angles.get(usize::try_from(self.angle).ok()?)?;
                let [u, v] = before.across;
                [u * cosine + v * sine, v * cosine - u * sine, before.normal]
            }
            Axes::Own | Axes::Bare => axes_of_turn(self.turn)?,
        };
        Some(Shape { axes, sigma: [sigma, sigma - ratio, sigma - ratio - thickness].map(power) })
    }

    /// Decodes the rest of the splat, given its shape.
    fn splat(
        &self,
        fineness: &Fineness,
        shape: &Shape,
        course: &Course,
        before: &mut Before,
    ) -> Option<Splat> {
        let normal =
            if self.axes == Axes::Bare { NO_NORMAL } else { direction::packed(before.normal) };
        let way = course.place(self.position, shape.step(fineness));
        before.center = (before.center() + way).to_array().map(|value| value as f32);
        before.way = way;
        for (before, more) in before.color.iter_mut().zip(self.color) {
            *before = before.wrapping_add(more);
        }
        let alpha = u32::try_from(self.color[3]).ok().filter(|&alpha| alpha < 256)?;
        let strength = match self.strength {
            NO_STRENGTH => 0.0,
            0 => before.strength,
            steps => {
                let parts =
                    steps.saturating_mul(fineness.strength).clamp(-MOST_STRENGTH, MOST_STRENGTH);
                (f64::from(before.strength) * power(parts)) as f32
            }
        };
        let color = color(before.color)? | alpha << 24;
        let splat =
            Splat { center: before.center, strength, factor: shape.factor(), color, normal };
        is_drawable(&splat).then_some(splat)
    }

    /// Encodes a splat, and returns its decoded value and shape as well. `None` if no code can
    /// represent it: it has no width, a negative strength, or is too far from the previous node.
    pub fn encode(
        splat: &Splat,
        is_leaf: bool,
        before: &mut Before,
    ) -> Option<(Self, Splat, Shape)> {
        let fineness = &FINENESS[usize::from(is_leaf)];
        let normal = direction::unpacked(splat.normal);
        let (axes, ellipsoid) = ellipsoid(splat, normal, is_leaf)?;
        let [first, second, third] = ellipsoid.sigma.map(logarithm);
        let round = |value: f64, step: i32| nearest(value * f64::from(PARTS) / f64::from(step));
        let sigma = round(first, fineness.sigma);
        let first = f64::from(sigma * fineness.sigma) / f64::from(PARTS);
        let ratio = round(first - second, fineness.ratio).clamp(0, MOST_RATIO / fineness.ratio);
        let most = MOST_THICKNESS / fineness.thickness;
        let luma = luma(splat.color);
        let strength = match splat.strength {
            strength if strength < 0.0 => return None,
            0.0 => NO_STRENGTH,
            strength if strength == before.strength => 0,
            strength => round(
                logarithm(f64::from(strength) / f64::from(before.strength)),
                fineness.strength,
            ),
        };
        let mut code = Self {
            axes,
            sigma,
            ratio,
            thickness: round(second - third, fineness.thickness).clamp(-most, most),
            angle: 0,
            turn: if axes == Axes::Normal { [0; 4] } else { turn(ellipsoid.axes) },
            normal: normal
                .map_or([0; 2], |it| fineness.directions.encode(before.normal, before.across, it)),
            position: [0; 3],
            color: [
                luma[0] - before.color[0],
                luma[1] - before.color[1],
                luma[2] - before.color[2],
                (splat.color >> 24) as i32,
            ],
            strength,
        };
        let last = before.normal;
        // The angle refers to the decoded normal, and the position to the decoded frame and step.
        let mut shape = code.shape(fineness, before)?;
        if axes == Axes::Normal {
            let angles = &fineness.angles[ratio as usize];
            let [u, v] = before.across.map(|side| side.dot(ellipsoid.axes[0]));
            let mut most = 0.0;
            for (angle, [cosine, sine]) in (0..).zip(angles) {
                let along = (u * cosine + v * sine).abs();
                if along > most {
                    (code.angle, most) = (angle, along);
                }
            }
            let ([cosine, sine], [u, v]) = (angles[code.angle as usize], before.across);
            shape.axes = [u * cosine + v * sine, v * cosine - u * sine, before.normal];
        }
        let course = Course::new(axes, &shape, before, last, fineness);
        let away = DVec3::from(splat.center.map(f64::from)) - before.center();
        code.position = course.steps(away, shape.step(fineness))?;
        let splat = code.splat(fineness, &shape, &course, before)?;
        Some((code, splat, shape))
    }
}

/// Returns the standard deviations and axes of a splat. The axes are those by its normal if they
/// are near enough.
fn ellipsoid(splat: &Splat, normal: Option<DVec3>, is_leaf: bool) -> Option<(Axes, Shape)> {
    let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
    let columns = [DVec3::new(b00, b10, b20), DVec3::new(0.0, b11, b21), DVec3::new(0.0, 0.0, b22)];
    if let Some(normal) = normal {
        let [u, v] = direction::across(normal);
        let seen = |t: DVec3| DVec3::from(columns.map(|column| column.dot(t)));
        let (x, y, z) = (seen(u), seen(v), seen(normal));
        let (xx, xy, yy, zz) =
            (x.length_squared(), x.dot(y), y.length_squared(), z.length_squared());
        let (mean, half) = ((xx + yy) * 0.5, (xx - yy) * 0.5);
        let root = (half * half + xy * xy).sqrt();
        let (large, small) = (mean + root, mean - root);
        // The tilt is the part of the covariance neither along the normal nor across it. For
        // leaves, the normal and the ellipsoid's axis may differ by at most 1°. Inner nodes may
        // tilt more, because they are drawn where a tilt is not visible.
        let tilt = DVec3::new(x.dot(z), y.dot(z), 0.0).length();
        let most =
            if is_leaf { 0.0175 * (small - zz).max(0.0) + 1e-6 * large } else { 0.25 * large };
        if large > 0.0 && tilt <= most {
            let (a, b) = if half >= 0.0 { (half + root, xy) } else { (xy, root - half) };
            let length = (a * a + b * b).sqrt();
            let first = if length > 0.0 { (u * a + v * b) / length } else { u };
            let sigma = sound([large, small, zz].map(|square| square.max(0.0).sqrt()))?;
            return Some((
                Axes::Normal,
                Shape { axes: [first, normal.cross(first), normal], sigma },
            ));
        }
    }
    let b = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let (squares, axes) = crate::math::eigen(b * b.transpose());
    let sigma = sound(squares.map(f64::sqrt))?;
    let axes = [axes[0], axes[1], axes[0].cross(axes[1])];
    Some((if normal.is_some() { Axes::Own } else { Axes::Bare }, Shape { axes, sigma }))
}

/// Limits standard deviations to what codes can represent. None is infinitely flat.
fn sound([first, second, third]: [f64; 3]) -> Option<[f64; 3]> {
    let second = second.max(first * 2f64.powi(-15));
    (first > 0.0 && first.is_finite()).then_some([
        first,
        second,
        third.max(second * 2f64.powi(-19)),
    ])
}
