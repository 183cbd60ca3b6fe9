//! Kernels that are not cut: axis-aligned sheets, single splats, and trained Gaussians alone
//! ([`Mode::AxisSheets`](crate::scene::Mode::AxisSheets),
//! [`Mode::Splats`](crate::scene::Mode::Splats)).

use super::{
    Frame, clip,
    composite::{Composite, Medium},
    kernel::{Kernel, Load},
    ray::Ray,
    sheet::Light,
};
use crate::{math::View, scene::Order, volume::Lattice};
use glam::{DMat3, DVec3};

/// Returns the direction along which axis-aligned sheets are counted, in view space. It is
/// perpendicular to two axes of the data, chosen so that it points into the picture most. Without a
/// lattice the world's axes are used.
pub(super) fn sheet_axis(view: &View, lattice: Option<&Lattice>) -> DVec3 {
    let axes = lattice.map_or(DMat3::IDENTITY, |lattice| lattice.axes);
    let normals = axes
        .inverse()
        .transpose()
        .to_cols_array_2d()
        .map(|normal| view.rotation * DVec3::from(normal).normalize());
    let best = normals
        .into_iter()
        .fold(DVec3::ZERO, |best, n| if n.z.abs() > best.z.abs() { n } else { best });
    best * best.z.signum()
}

impl Frame<'_> {
    /// Returns the radiance of a whole kernel on a ray, and the distance of the closest approach.
    /// Returns `None` if the ray misses the kernel, or the kernel is clipped or behind the eye.
    fn whole(&self, kernel: &Kernel, ray: &Ray, allowed: &[[f64; 2]]) -> Option<(Light, f64)> {
        let Load::Radiance(radiance) = &kernel.load else { return None };
        let crossing = kernel.cross(ray)?;
        let seen = !self.view.perspective || crossing.closest > 0.0;
        if !(seen && clip::contains(allowed, crossing.closest)) {
            return None;
        }
        let mut light = Light::default();
        light.add(
            radiance,
            crossing.optical_depth(radiance.amount, [f64::NEG_INFINITY, f64::INFINITY]),
        );
        Some((light, crossing.closest))
    }

    /// Draws a pixel in axis-aligned sheets.
    pub(super) fn pixel_of_axis_sheets(
        &self,
        ray: &Ray,
        kernels: &[&Kernel],
        axis: DVec3,
    ) -> Composite {
        let allowed = clip::allowed(ray, &self.view, &self.clips);
        let mut sheets = vec![Light::default(); self.count()];
        for kernel in kernels {
            let key = axis.dot(kernel.center);
            let key = if self.view.perspective { key.abs() } else { key };
            let Some(k) = self
                .planes
                .partition_point(|&plane| plane <= key)
                .checked_sub(1)
                .filter(|k| *k < self.count())
            else {
                continue;
            };
            if let Some((light, _)) = self.whole(kernel, ray, &allowed) {
                sheets[k].join(&light);
            }
        }
        let slope = axis.dot(ray.direction);
        let distance = |key: f64| {
            if self.view.perspective {
                key / slope.abs()
            } else {
                (key - axis.dot(ray.origin)) / slope
            }
        };
        let mut composite = Composite::EMPTY;
        for (k, sheet) in sheets.iter().enumerate() {
            composite.pass(self.surface(sheet, (ray, 0.0)), self.span(k).map(distance));
        }
        composite
    }

    /// Draws a pixel of trained Gaussians alone, each divided between two sheets by the depth of
    /// its centre.
    pub(super) fn pixel_by_centers(&self, ray: &Ray, kernels: &[&Kernel]) -> Composite {
        let allowed = clip::allowed(ray, &self.view, &self.clips);
        let mut sheets = vec![Light::default(); self.count()];
        let last = self.count() - 1;
        let middle = |sheet: usize| self.span(sheet).iter().sum::<f64>() / 2.0;
        for kernel in kernels {
            let depth = kernel.center.z;
            if !(self.planes[0]..self.planes[last + 1]).contains(&depth) {
                continue;
            }
            let (Some((light, _)), Load::Radiance(radiance)) =
                (self.whole(kernel, ray, &allowed), &kernel.load)
            else {
                continue;
            };
            let next = (0..=last).find(|sheet| middle(*sheet) > depth).unwrap_or(last);
            let first = next.max(1).min(last) - usize::from(last > 0);
            let second = (first + 1).min(last);
            let behind = match second > first {
                true => (depth - middle(first)) / (middle(second) - middle(first)),
                false => 0.0,
            };
            let behind = behind.clamp(0.0, 1.0);
            sheets[first].add(radiance, light.depth * (1.0 - behind));
            sheets[second].add(radiance, light.depth * behind);
        }
        let distance = |depth: f64| (depth - ray.origin.z) / ray.direction.z;
        let mut composite = Composite::EMPTY;
        for (k, sheet) in sheets.iter().enumerate() {
            composite.pass(self.surface(sheet, (ray, 0.0)), self.span(k).map(distance));
        }
        composite
    }

    /// Draws a pixel of single splats.
    pub(super) fn pixel_of_splats(
        &self,
        ray: &Ray,
        kernels: &[&Kernel],
        order: Order,
    ) -> Composite {
        let allowed = clip::allowed(ray, &self.view, &self.clips);
        let distance = |kernel: &Kernel| {
            if self.view.perspective { kernel.center.length() } else { kernel.center.z }
        };
        let key = |kernel: &Kernel| {
            if self.has_trained { kernel.center.z } else { distance(kernel) }
        };
        let mut splats: Vec<(f64, f64, Medium)> = kernels
            .iter()
            .filter(|kernel| distance(kernel) >= self.near)
            .filter_map(|kernel| {
                let (light, place) = self.whole(kernel, ray, &allowed)?;
                Some((key(kernel), place, self.lit(&light, (ray, 0.0))))
            })
            .collect();
        // The sort is stable: equal keys stay in the order of the scene.
        splats.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
        let mut composite = Composite::EMPTY;
        for (_, place, medium) in &splats {
            composite.pass(*medium, [*place; 2]);
        }
        if order == Order::BackToFront {
            (composite.color, composite.opacity) = (DVec3::ZERO, 0.0);
            for (.., medium) in splats.iter().rev() {
                let alpha = -(-medium.depth).exp_m1();
                composite.color = alpha * medium.color + (1.0 - alpha) * composite.color;
                composite.opacity = alpha + (1.0 - alpha) * composite.opacity;
            }
        }
        composite
    }
}
