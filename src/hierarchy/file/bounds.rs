//! Bounds of inner nodes as whole numbers, made from below, so that they hold for what is read.

use super::{
    page::{cosine_below, joint_angle},
    pages::reach,
    quantise::{FULL_WIDTH, PARTS, Shape, power},
};
use crate::{hierarchy::Node, splat::NO_NORMAL};
use glam::DVec3;
use std::{f64::consts::PI, sync::LazyLock};

/// Steps of a sphere's centre in the reach of the splat's own footprint.
const CENTER_STEPS: f64 = 24.0;
/// Steps of the radius and of the size in a doubling.
const RADIUS_STEPS: i32 = 24;
const SIZE_STEPS: i32 = 16;
/// Half-angles of cones are this far apart.
const CONE_STEP: f64 = PI / 60.0;
/// The cone of half a turn, beyond which there is none worth telling.
const NO_CONE: i32 = 31;
/// The farthest that a centre may be: beyond, no number of 32 bits tells it.
const MOST_STEPS: f64 = (1 << 20) as f64;
const MOST_POWER: i32 = RADIUS_STEPS * 64;

/// The bounds of an inner node.
#[derive(Debug, Clone, Copy)]
pub struct Code {
    /// From the splat's centre along its axes.
    pub center: [i32; 3],
    /// How much wider than the splat's own footprint.
    pub radius: i32,
    pub cone: i32,
    /// How much larger than the splat's own width.
    pub size: i32,
}

/// What is known of a node's bounds before its children are: those of a leaf.
pub fn leaf(node: &mut Node, shape: &Shape, extent: f32) {
    let largest = shape.largest();
    node.center = node.splat.center;
    // What rounding takes from 32 bits is less than what this adds.
    node.radius = (f64::from(extent) * largest * 1.000_001) as f32;
    node.size = (FULL_WIDTH * largest) as f32;
    node.cone = if node.splat.normal == NO_NORMAL { -1.0 } else { 1.0 };
}

fn cones() -> &'static [f32; NO_CONE as usize + 1] {
    static CONES: LazyLock<[f32; NO_CONE as usize + 1]> = LazyLock::new(|| {
        std::array::from_fn(|k| match k as i32 {
            NO_CONE => -1.0,
            0 => 1.0,
            k => cosine_below(f64::from(k) * CONE_STEP),
        })
    });
    &CONES
}

impl Code {
    /// Gives a node the bounds; `None` for codes of none.
    pub fn decode(&self, node: &mut Node, shape: &Shape, extent: f32) -> Option<()> {
        let largest = shape.largest();
        let own = f64::from(extent) * largest;
        let fits = (0..=MOST_POWER).contains(&self.size) && (-MOST_POWER..=MOST_POWER).contains(&self.radius);
        node.cone = *cones().get(usize::try_from(self.cone).ok()?).filter(|_| fits)?;
        let mut center = DVec3::from(node.splat.center.map(f64::from));
        for (axis, steps) in shape.axes.iter().zip(self.center) {
            center += *axis * (f64::from(steps) * own / CENTER_STEPS);
        }
        node.center = center.to_array().map(|value| value as f32);
        node.radius = (own * power(self.radius * (PARTS / RADIUS_STEPS))) as f32;
        node.size = (FULL_WIDTH * largest * power(self.size * (PARTS / SIZE_STEPS))) as f32;
        (node.center.iter().chain([&node.radius, &node.size]).copied().all(f32::is_finite)).then_some(())
    }

    /// The tightest bounds around the children that the centre of the node, nearly, can have. `None` where no code tells
    /// them.
    pub fn encode(node: &mut Node, children: &[Node], shape: &Shape, extent: f32) -> Option<Self> {
        let largest = shape.largest();
        let own = f64::from(extent) * largest;
        let away = node.center().as_dvec3() - DVec3::from(node.splat.center.map(f64::from));
        let mut code = Self { center: [0; 3], radius: 0, cone: 0, size: 0 };
        for (steps, axis) in code.center.iter_mut().zip(shape.axes) {
            let exact = (away.dot(axis) * CENTER_STEPS / own).round();
            *steps = if exact.abs() < MOST_STEPS { exact as i32 } else { return None };
        }
        let angle = children.iter().map(|child| joint_angle(node, child)).fold(0.0, f64::max);
        code.cone = ((angle / CONE_STEP - 1e-9).ceil() as i32).min(NO_CONE);
        code.decode(node, shape, extent)?;
        // Estimates, then up to what really holds.
        let center = node.center().as_dvec3();
        let radius = children.iter().map(|child| reach(center, child)).fold(0.0, f64::max) * (1.0 + 1e-12);
        let size = children.iter().map(|child| child.size).fold(0.0, f32::max);
        code.radius = (f64::from(RADIUS_STEPS) * libm::log2(radius / own)).ceil().clamp(-4096.0, 4096.0) as i32 - 1;
        code.size = ((f64::from(SIZE_STEPS) * libm::log2(f64::from(size) / (FULL_WIDTH * largest)))
            .ceil()
            .clamp(0.0, 4096.0) as i32
            - 1)
        .max(0);
        let cosine = libm::cos(angle);
        loop {
            code.decode(node, shape, extent)?;
            match () {
                () if f64::from(node.radius) < radius => code.radius += 1,
                () if node.size < size => code.size += 1,
                () if node.cone > -1.0 && f64::from(node.cone) > cosine => code.cone += 1,
                () => return Some(code),
            }
        }
    }
}
