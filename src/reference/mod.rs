//! The reference: what a splatkit picture is, in plain double precision on the CPU.
//!
//! The engine must draw these pictures; it shares no code with this module beyond the scene, the view, the list of sheets
//! and the transfer function. Everything is brute force, pixel by pixel over all kernels, for pictures of some
//! thousand pixels and kernels.
//!
//! # The picture
//! **Rays.** The ray of the pixel in column i and row j passes through (i + ½, j + ½): the points a + s·b̂ in view space
//! (x right, y down, z forward), with |b̂| = 1. Sheet k is the part with planes\[k\] ≤ s < planes\[k + 1\].
//!
//! **Kernels.** Each is a Gaussian exp(−xᵀΣ⁻¹x/2) around its centre c. A splat has Σ = B·Bᵀ, turned into view space and
//! widened by (0.35 pixel)² in every direction, so that it cannot fall between the pixels' rays; a pixel is |c|/f at the
//! centre's distance (perspective, f the focal length in pixels) or one over the pixels per world unit (orthographic). A
//! lattice sample has Σ = σ²·A·Aᵀ, A the steps between the samples, and is not widened.
//!
//! **Sections** (Zwicker et al. 2001 integrate the whole kernel; here it is cut by the sheets, as in Mueller and Crawfis
//! 1998). With M such that Σ⁻¹ = MᵀM, α = M(a − c) and β = M·b̂, the ray passes the centre at ρ = |α × β|/|β| standard
//! deviations. Where ρ is over the kernel's extent, the ray misses the footprint. Otherwise the kernel along the ray is
//! exp(−ρ²/2) times a Gaussian of standard deviation 1/|β| about s* = −α·β/|β|², of which sheet k holds the share
//! Φ(|β|(planes\[k + 1\] − s*)) − Φ(|β|(planes\[k\] − s*)). It is not cut along the ray.
//!
//! **Radiance.** A splat adds the optical depth τ = strength · opacity · exp(−ρ²/2) · share. In a sheet the optical depths
//! add, colours and normals are averaged by them, and the average is lit once where some splat has a normal.
//!
//! **Fields.** A sample adds the section s = √(2π)·exp(−ρ²/2)·share/|β|, a length. A sheet's value is f̄ = Σ f·s / Σ s;
//! it has none where Σ s is under a ten-thousandth of its thickness. The value is classified after this interpolation:
//! optical depth = extinction(f̄) · ℓ, with ℓ the length of the ray inside both the sheet and the box of the samples
//! (for a lattice; an axis of one sample counts ± ½ of its step), or Σ s but at most the sheet's thickness (for scattered
//! samples).
//!
//! **Gradients.** Along the ray, the difference of the neighbouring sheets' values over the distance of their middles.
//! Across it, in pixels, either the derivative of f̄ with the shares held fixed, where ∂ exp(−ρ²/2) = −exp(−ρ²/2)·½∂(ρ²)
//! and ½∂(ρ²) = (α + s*β) · M(∂a + s*·∂b̂), or the difference of f̄ between neighbouring pixels. Differences are one-sided
//! where a neighbour has no value, 0 where both have none. The gradient g is what has these derivatives at the middle s of
//! the sheet: g·∂(a + s·b̂) across, g·b̂ along.
//!
//! **Light.** Blinn and Phong's model with the light at the eye, on both sides; colours clamped to 1.
//!
//! **Compositing.** In a sheet the optical depths of surface and field add and their colours mix by them. Front to back,
//! with α = 1 − exp(−τ): C += (1 − A)·α·c, A += (1 − A)·α. The depth is where the optical depth passes ln 2, which grows
//! evenly inside a sheet, as view-space z.

mod composite;
mod kernel;
mod ray;
mod section;
mod shade;
mod sheet;

#[cfg(test)]
mod tests;

use crate::{
    Result,
    math::{Camera, View},
    picture::Picture,
    scene::{Gradient, Item, Scene, Settings},
    volume::{Lattice, Shade, TransferFunction},
};
use composite::{Composite, Medium};
use glam::{DVec2, DVec3};
use kernel::Kernel;
use ray::Ray;
use rayon::prelude::*;
use sheet::{Sheet, slope};

/// Draws a scene by the definition above: premultiplied colour, and depth. Rows are drawn in parallel; time is
/// proportional to pixels times kernels.
///
/// # Errors
/// What [`Scene::validate`] and [`Camera::view`] find.
pub fn render(scene: &Scene, camera: &Camera, settings: &Settings) -> Result<Picture> {
    scene.validate()?;
    let view = camera.view(settings.size)?;
    let frame = Frame::new(scene, view, settings);
    let [width, height] = settings.size;
    let rows: Vec<Vec<Composite>> = (0..height).into_par_iter().map(|row| frame.row(row)).collect();
    let mut picture = Picture { width, height, color: Vec::new(), depth: Vec::new() };
    for (row, composites) in rows.iter().enumerate() {
        for (column, composite) in composites.iter().enumerate() {
            picture.color.push(composite.color.extend(composite.opacity).as_vec4().to_array());
            let ray = frame.ray(column as i64, row as i64);
            // An infinite distance along a ray parallel to the picture would give no number.
            let half = composite.half;
            picture.depth.push(if half.is_finite() { ray.point(half).z as f32 } else { f32::INFINITY });
        }
    }
    Ok(picture)
}

/// The scalar field of a scene.
struct Field<'a> {
    transfer: &'a TransferFunction,
    /// Where the samples lie; none for scattered ones.
    lattice: Option<&'a Lattice>,
    shade: Option<Shade>,
}

impl Field<'_> {
    /// A length of one value as the transfer function shows it.
    fn classify(&self, value: f64, length: f64, ray: &Ray, gradient: impl FnOnce() -> DVec3) -> Medium {
        let color = DVec3::from(self.transfer.color(value));
        let color = match &self.shade {
            Some(shade) => shade::lit(color, gradient(), ray.direction, shade),
            None => color,
        };
        Medium { depth: self.transfer.extinction(value) * length, color }
    }
}

/// Optical depths below this are left out: they cannot be seen, and 32-bit sums of sections leave such remainders.
const LEAST_DEPTH: f64 = 1e-5;

/// A picture being drawn.
struct Frame<'a> {
    view: View,
    planes: Vec<f64>,
    kernels: Vec<Kernel>,
    field: Option<Field<'a>>,
    surface_shade: Option<Shade>,
    gradient: Gradient,
}

impl<'a> Frame<'a> {
    fn new(scene: &'a Scene, view: View, settings: &Settings) -> Self {
        let field = scene.items.iter().find_map(|item| {
            let (transfer, lattice) = match item {
                Item::Radiance(_) => return None,
                Item::Scalar(_, transfer) => (transfer, None),
                Item::Volume(volume, _, transfer) => (transfer, Some(&volume.lattice)),
            };
            Some(Field { transfer, lattice, shade: settings.volume_shade.unwrap_or(transfer.shade) })
        });
        Self {
            planes: scene.sheets(&view, settings).planes,
            kernels: Kernel::gather(scene, &view),
            view,
            field,
            surface_shade: settings.surface_shade,
            gradient: settings.gradient,
        }
    }

    /// The ray of a pixel, which may lie outside the picture.
    fn ray(&self, column: i64, row: i64) -> Ray {
        Ray::new(&self.view, DVec2::new(column as f64, row as f64) + 0.5)
    }

    /// Draws a row.
    fn row(&self, row: u32) -> Vec<Composite> {
        let row = i64::from(row);
        let kernels = self.kernels_of_row(row);
        let central = self.gradient == Gradient::Central && self.field.as_ref().is_some_and(|f| f.shade.is_some());
        let beside = central.then(|| [row - 1, row + 1].map(|row| self.kernels_of_row(row)));
        let pixel = |column: i64| {
            let ray = self.ray(column, row);
            let sheets = self.sheets(&ray, &kernels);
            let neighbours = beside.as_ref().map(|[above, below]| {
                [
                    (column - 1, row, &kernels),
                    (column + 1, row, &kernels),
                    (column, row - 1, above),
                    (column, row + 1, below),
                ]
                .map(|(column, row, kernels)| self.values(&self.sheets(&self.ray(column, row), kernels)))
            });
            self.composite(&ray, &sheets, neighbours)
        };
        (0..i64::from(self.view.size[0])).map(pixel).collect()
    }

    /// The kernels that the rays of a row can meet: the rays of a row lie in one plane.
    fn kernels_of_row(&self, row: i64) -> Vec<&Kernel> {
        let [left, right] = [0, i64::from(self.view.size[0])].map(|column| self.ray(column, row));
        let normal = if self.view.perspective { left.direction.cross(right.direction) } else { DVec3::Y };
        let offset = left.origin.dot(normal);
        self.kernels.iter().filter(|kernel| kernel.meets_plane(normal, offset)).collect()
    }

    /// Number of sheets.
    fn count(&self) -> usize {
        self.planes.len() - 1
    }

    /// The distances at which a sheet begins and ends.
    fn span(&self, sheet: usize) -> [f64; 2] {
        [self.planes[sheet], self.planes[sheet + 1]]
    }

    fn thickness(&self, sheet: usize) -> f64 {
        self.planes[sheet + 1] - self.planes[sheet]
    }

    fn middle(&self, sheet: usize) -> f64 {
        0.5 * (self.planes[sheet] + self.planes[sheet + 1])
    }

    /// Sums the kernels over the sheets of a ray.
    fn sheets(&self, ray: &Ray, kernels: &[&Kernel]) -> Vec<Sheet> {
        let mut sheets = vec![Sheet::default(); self.count()];
        for kernel in kernels {
            let Some(crossing) = kernel.cross(ray) else { continue };
            let reach = section::TAIL / crossing.density;
            let first = self.planes[1..].partition_point(|&plane| plane < crossing.closest - reach);
            let past = self.planes.partition_point(|&plane| plane < crossing.closest + reach).min(self.count());
            for (k, sheet) in sheets.iter_mut().enumerate().take(past).skip(first) {
                sheet.add(&kernel.load, &crossing, self.span(k));
            }
        }
        sheets
    }

    /// The field's value in every sheet.
    fn values(&self, sheets: &[Sheet]) -> Vec<Option<f64>> {
        (0..self.count()).map(|k| sheets[k].value(self.thickness(k))).collect()
    }

    /// Colours a pixel's sheets and composites them. `neighbours`: the field's values in the pixels to the left, right,
    /// above and below, where gradients are central differences.
    fn composite(&self, ray: &Ray, sheets: &[Sheet], neighbours: Option<[Vec<Option<f64>>; 4]>) -> Composite {
        let values = self.values(sheets);
        let mut composite = Composite::EMPTY;
        for (k, sheet) in sheets.iter().enumerate() {
            let mut medium = self.surface(sheet, ray);
            if let (Some(field), Some(value)) = (&self.field, values[k]) {
                let gradient = || {
                    let around = neighbours.as_ref().map(|pixels| pixels.each_ref().map(|values| values[k]));
                    let across = sheet.across(value, around);
                    self.gradient(ray, &values, k, across)
                };
                medium = medium.with(field.classify(value, self.length(field, ray, sheet, k), ray, gradient));
            }
            composite.pass(medium, self.span(k));
        }
        composite
    }

    /// The radiance splats of a sheet.
    fn surface(&self, sheet: &Sheet, ray: &Ray) -> Medium {
        if sheet.depth < LEAST_DEPTH {
            return Medium::default();
        }
        let color = sheet.color / sheet.facing;
        match &self.surface_shade {
            Some(shade) if sheet.has_normal => {
                Medium { depth: sheet.depth, color: shade::lit(color, sheet.normal, ray.direction, shade) }
            }
            _ => Medium { depth: sheet.depth, color },
        }
    }

    /// The length ℓ of a ray on which a sheet holds field.
    fn length(&self, field: &Field, ray: &Ray, sheet: &Sheet, k: usize) -> f64 {
        let [from, to] = self.span(k);
        match field.lattice {
            Some(lattice) => {
                ray.within(&self.view, lattice).map_or(0.0, |[enter, leave]| (to.min(leave) - from.max(enter)).max(0.0))
            }
            None => sheet.length.min(to - from),
        }
    }

    /// How far, per pixel to the right and per pixel downward, the derivative with sections held fixed is taken along the
    /// ray instead of across it. A section stays fixed on the line on which the kernel's closest approach moves, which is
    /// across the ray in the lattice's own steps, and so in space only where those are equal and at right angles.
    /// Scattered samples have no common shape, and are left as they are.
    fn lean(&self, ray: &Ray, distance: f64) -> DVec2 {
        let lattice = self.field.as_ref().and_then(|field| field.lattice);
        let Some(lattice) = lattice.filter(|_| self.gradient == Gradient::Analytic) else { return DVec2::ZERO };
        let in_steps = (self.view.rotation * lattice.axes).inverse();
        let direction = in_steps * ray.direction;
        let [right, down] = ray.across(distance).map(|step| (in_steps * step).dot(direction));
        DVec2::new(right, down) / direction.length_squared()
    }

    /// The field's view-space gradient in a sheet that has a value, given its derivatives across the picture; zero where
    /// it cannot be told.
    fn gradient(&self, ray: &Ray, values: &[Option<f64>], k: usize, across: DVec2) -> DVec3 {
        // One step along the ray: outside the list there is no sheet, hence no value there.
        let before = k.checked_sub(1).map(|before| (self.middle(before), values[before]));
        let after = (k + 1 < self.count()).then(|| (self.middle(k + 1), values[k + 1]));
        let [(first, before), (last, after)] = [before, after].map(|neighbour| neighbour.unwrap_or_default());
        let middle = self.middle(k);
        let along = slope([first, middle, last], [before, values[k], after]);
        let across = across + along * self.lean(ray, middle);
        ray.gradient(middle, across, along).unwrap_or(DVec3::ZERO)
    }
}
