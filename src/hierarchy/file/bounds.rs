//! Bounds of inner nodes as integers. They are made from the bottom up, so that they hold for the
//! decoded values.

use super::{
    cones::{cosine_below, joint_cosine},
    direction::unpacked,
    pages::reach,
    quantise::{FULL_WIDTH, PARTS, Shape, inner_sigma, logarithm, power, sigma_of_inner},
};
use crate::hierarchy::{Node, merge::leaf_cone, sphere::Sphere};
use glam::DVec3;
use std::{f64::consts::PI, sync::LazyLock};

/// Steps of radii and of sizes, in units of 1/[`PARTS`] octave.
const RADIUS: i32 = PARTS / 12;
const SIZE: i32 = PARTS / 16;
/// Step between the half-angles of cones.
const CONE_STEP: f64 = PI / 30.0;
/// The code for no cone (a half-angle of π). Half-angles above 90° are not stored.
const NO_CONE: i32 = 16;
/// Upper bound on a centre's distance in steps. 32-bit numbers cannot represent larger ones.
const MOST_STEPS: f64 = (1 << 20) as f64;
const MOST_POWER: i32 = PARTS * 64;

/// Nodes of at least this fraction of the root's size have fine spheres, because the losses of
/// large nodes add up on the way to the root. The others have spheres around the splat's centre.
const FINE_PART: f64 = 1.0 / 48.0;
/// The number of steps in the reach of the smallest node with a fine sphere. All fine centres and
/// radii use this step, however large the node.
const FINE_STEPS: f64 = 6.0;

/// Returns the smallest code of the largest standard deviation for which nodes below a root have
/// fine spheres.
pub fn fine_from(root: &Node) -> i32 {
    inner_sigma(f64::from(root.size) / FULL_WIDTH * FINE_PART)
}

/// Returns the step of a node's sphere if it is fine.
pub fn fine_step(sigma: i32, fine: i32, extent: f32) -> Option<f64> {
    (sigma >= fine).then(|| f64::from(extent) * sigma_of_inner(fine) / FINE_STEPS)
}

/// The bounds of an inner node.
#[derive(Debug, Clone, Copy, Default)]
pub struct Code {
    /// Steps from the splat's centre along its axes; 0 for coarse spheres.
    pub center: [i32; 3],
    /// Code of the radius: relative to the splat's own footprint, or in fine steps.
    pub radius: i32,
    pub cone: i32,
    /// Code of the size, relative to the splat's own width.
    pub size: i32,
}

/// Sets the bounds of a node before its children are known, which are those of a leaf.
pub fn leaf(node: &mut Node, shape: &Shape, extent: f32) {
    let largest = shape.largest();
    node.center = node.splat.center;
    // The factor covers the rounding to 32 bits.
    node.radius = (f64::from(extent) * largest * 1.000_001) as f32;
    node.size = (FULL_WIDTH * largest) as f32;
    node.cone = unpacked(node.splat.normal).map_or(-1.0, |normal| {
        // If the third axis is the thinnest, the approximation of the thinnest axis lies between it
        // and the normal.
        let [first, second, third] = shape.sigma;
        if third <= first && third <= second && shape.axes[2].dot(normal) > 0.999 {
            return 1.0;
        }
        // The same as `merge::leaf`, computed from the axes.
        let along = |i: usize| {
            let (thinner, axis) = (shape.sigma[2] / shape.sigma[i], shape.axes[i]);
            axis * (axis.dot(normal) * thinner * thinner * thinner * thinner)
        };
        let thin = along(0) + along(1) + along(2);
        leaf_cone((thin.dot(normal) / thin.length_squared().sqrt()) as f32)
    });
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
    /// Sets the decoded bounds of a node; `None` if the code is not valid.
    pub fn decode(
        &self,
        node: &mut Node,
        shape: &Shape,
        extent: f32,
        fine: Option<f64>,
    ) -> Option<()> {
        let largest = shape.largest();
        let footprint = f64::from(extent) * largest;
        let fits = (0..=MOST_POWER / SIZE).contains(&self.size)
            && (-MOST_POWER / RADIUS..=MOST_POWER / RADIUS).contains(&self.radius);
        node.cone = *cones().get(usize::try_from(self.cone).ok()?).filter(|_| fits)?;
        node.center = node.splat.center;
        node.radius = match fine {
            None => (footprint * power(self.radius * RADIUS)) as f32,
            Some(step) => {
                let mut center = DVec3::from(node.splat.center.map(f64::from));
                for (axis, steps) in shape.axes.iter().zip(self.center) {
                    center += *axis * (f64::from(steps) * step);
                }
                node.center = center.to_array().map(|value| value as f32);
                (f64::from(self.radius) * step) as f32
            }
        };
        node.size = (FULL_WIDTH * largest * power(self.size * SIZE)) as f32;
        (node.center.iter().chain([&node.radius, &node.size]).copied().all(f32::is_finite))
            .then_some(())
    }

    /// Encodes the tightest bounds around the children with about the node's centre. `None` if no
    /// code can represent them.
    pub fn encode(
        node: &mut Node,
        children: &[Node],
        shape: &Shape,
        extent: f32,
        fine: Option<f64>,
    ) -> Option<Self> {
        let largest = shape.largest();
        let footprint = f64::from(extent) * largest;
        let around = |node: &Node| {
            let center = node.center().as_dvec3();
            children.iter().map(|child| reach(center, child)).fold(0.0, f64::max) * (1.0 + 1e-12)
        };
        let mut code = Self::default();
        if let Some(step) = fine {
            code.center = nearest_center(node, children, shape, step).unwrap_or_default();
        }
        code.decode(node, shape, extent, fine)?;
        let mut radius = around(node);
        if fine.is_some_and(|step| radius > step * f64::from(MOST_POWER / RADIUS - 1)) {
            // A sphere that lies in its parent's may be far wider than necessary. Around the
            // splat's centre it is not.
            code.center = [0; 3];
            code.decode(node, shape, extent, fine)?;
            radius = around(node);
        }
        let size = children.iter().map(|child| child.size).fold(0.0, f32::max);
        let cosine =
            children.iter().map(|child| joint_cosine(node, child)).fold(1.0, f64::min) - 1e-12;
        let narrow = |cone: &f32| *cone == -1.0 || f64::from(*cone) <= cosine;
        code.cone = cones().iter().position(narrow)? as i32;
        // Estimates first, then increased until the bounds hold.
        let steps = |ratio: f64, step: i32| {
            let steps = (logarithm(ratio) * f64::from(PARTS / step)).ceil();
            steps.clamp(-4096.0, 4096.0) as i32 - 1
        };
        code.radius = match fine {
            None => steps(radius / footprint, RADIUS),
            Some(step) => (radius / step).min(MOST_STEPS) as i32,
        };
        code.size = steps(f64::from(size) / (FULL_WIDTH * largest), SIZE).max(0);
        loop {
            code.decode(node, shape, extent, fine)?;
            match () {
                () if f64::from(node.radius) < radius => code.radius += 1,
                () if node.size < size => code.size += 1,
                () => return Some(code),
            }
        }
    }
}

/// Returns the steps from a node's splat to the grid point next to its centre from which its
/// children reach least far. The losses of rounding add up on the way to the root.
fn nearest_center(node: &Node, children: &[Node], shape: &Shape, step: f64) -> Option<[i32; 3]> {
    let spheres: Vec<Sphere> = children.iter().map(Sphere::of).collect();
    let splat = DVec3::from(node.splat.center.map(f64::from));
    let away = node.center().as_dvec3() - splat;
    let below = shape.axes.map(|axis| (away.dot(axis) / step).floor());
    if below.iter().any(|steps| steps.abs() >= MOST_STEPS) {
        return None;
    }
    let near = (0..8).map(|corner| std::array::from_fn(|i| below[i] + f64::from(corner >> i & 1)));
    let radius = |steps: &[f64; 3]| {
        let center = shape
            .axes
            .iter()
            .zip(steps)
            .fold(splat, |sum, (axis, steps)| sum + *axis * (steps * step));
        Sphere::reach(center, &spheres)
    };
    let best = near.min_by(|a, b| radius(a).total_cmp(&radius(b)))?;
    Some(best.map(|steps| steps as i32))
}
