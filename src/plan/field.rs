//! The numbers of a field of a scene: its lattice and kernel in a view, how its values are looked
//! up in the tables, and its isosurfaces.

use super::{
    frame::Light,
    tables::{Factors, Tables, Values},
};
use crate::{
    bricks::Choice,
    math::{Kernel, Profile, Sheets, View},
    scene::{Item, Settings},
    volume::{Arrangement, Isosurface, Lattice, Shade, TransferFunction},
};
use glam::DVec3;

/// A field in a view, in 32 bits.
#[derive(Debug, Clone, Default)]
pub struct Field {
    /// View space to lattice steps: steps = origin + axes · position. The columns of `axes`, by
    /// axis of the lattice.
    pub axes: [[f32; 3]; 3],
    pub origin: [f32; 3],
    /// The corners of the box that samples fill, in steps.
    pub low: [f32; 3],
    pub high: [f32; 3],
    /// The samples lie on a lattice.
    pub is_on_lattice: bool,
    pub kernel: FieldKernel,
    /// The minimum sum of kernels for which a value exists.
    pub least_sum: f32,
    pub light: Light,
    /// The magnitude of the gradient up to which its direction does not count, in entries of the
    /// table per thickness of a sheet.
    pub certain_from: f32,
    /// One over the magnitudes from there to where the direction counts in full.
    pub per_certain: f32,
    /// One over the depth behind clips from which gradients count in full, in world units.
    pub per_depth: f32,
    pub values: Values<f32>,
    pub gradients: Gradients,
    /// Extinction times colour, and extinction, of values before the first table entry, and behind
    /// the last one.
    pub beyond: [[f32; 4]; 2],
    /// The length in which the transfer function's opacity is reached, in world units.
    pub unit: f32,
    /// Volumes in bricks: the shares of the finer and of the coarser level.
    pub levels: [f32; 2],
    /// By ascending value.
    pub isosurfaces: Vec<Surface>,
}

/// The kernel of a field's samples.
#[derive(Debug, Clone, Copy, Default)]
pub struct FieldKernel {
    /// The kernel has no closed form.
    pub is_tabled: bool,
    /// The standard deviation of an isotropic kernel, in world units, and its inverse.
    pub deviation: f32,
    pub per_deviation: f32,
    /// The squared radius in kernel space, in which the deviation is 1.
    pub radius2: f32,
    /// The extent in kernel space, and its inverse.
    pub extent: f32,
    pub per_extent: f32,
    /// One over the average sum of the kernels.
    pub per_overlap: f32,
}

/// How the magnitude of a gradient becomes a factor on the opacity.
#[derive(Debug, Clone, Copy, Default)]
pub struct Gradients {
    pub factors: Factors<f32>,
    /// The world length over which gradients count: the thickness of a sheet.
    pub length: f32,
    /// That length in pixels, as the view's scale.
    pub pixels: f32,
}

/// An isosurface of a field.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    /// The value, in entries of the table.
    pub value: f32,
    pub opacity: f32,
    pub depth: f32,
    pub color: [f32; 3],
}

/// Where the box of scattered samples ends, in all directions.
const NOWHERE: f32 = 1e15;
/// Behind clips, the gradients of fields without a lattice count at once.
const AT_ONCE: f32 = 1e30;

impl Field {
    /// Returns the field of an item, without its tables. `choice` is that of a volume in bricks.
    pub fn new(item: &Item, view: &View, settings: &Settings, choice: Option<&Choice>) -> Self {
        let mut field = Self {
            low: [-NOWHERE; 3],
            high: [NOWHERE; 3],
            levels: [1.0, 1.0],
            per_depth: AT_ONCE,
            ..Self::default()
        };
        match item {
            Item::Scalar(set, _) => {
                field.kernel.per_overlap = 1.0 / set.overlap;
                field.least_sum = Kernel::default().least_sum() as f32;
            }
            Item::Volume(volume, kernel, _) => {
                field.set_lattice(view, &volume.lattice);
                field.set_kernel(&volume.lattice, kernel);
            }
            Item::Bricks(bricks, kernel, _) => {
                let levels = choice.map_or(&[][..], |choice| &choice.levels);
                // The field fills the same box, whichever levels are drawn.
                field.set_lattice(view, &bricks.header().lattice);
                let level = levels.first().map_or(0, |(level, _)| *level);
                field.set_kernel(&bricks.lattice(level), kernel);
                for (share, &(_, weight)) in field.levels.iter_mut().zip(levels) {
                    *share = weight as f32;
                }
            }
            Item::Cells(..)
            | Item::Radiance(_)
            | Item::Facets(_)
            | Item::Solid(_)
            | Item::Gaussians(_)
            | Item::Hierarchy(_) => {}
        }
        if let Some(transfer) = item.transfer() {
            field.unit = transfer.unit as f32;
            field.light = Light::new(settings.shade_of(transfer));
        }
        field
    }

    /// Sets how values are looked up in the tables, and which gradients of a field with this light
    /// are certain. Gradients are per thickness of a sheet.
    pub fn set_tables(
        &mut self,
        tables: &Tables,
        transfer: &TransferFunction,
        light: Option<Shade>,
        view: &View,
        sheets: &Sheets,
    ) {
        let Values { zero, per_value, .. } = tables.values;
        self.values = tables.values.narrow();
        let (to_entries, length) = (per_value * sheets.step, sheets.step);
        // If the factors are constant or change in one step, their number per magnitude may exceed
        // 32 bits.
        let per_magnitude = (tables.lookup.per_magnitude / to_entries).min(1e30);
        let factors = Factors { first: tables.lookup.first * to_entries, per_magnitude };
        self.gradients = Gradients {
            factors: factors.narrow(),
            length: length as f32,
            pixels: (view.scale * length) as f32,
        };
        let [low, high] =
            light.and_then(|light| light.certain).unwrap_or_default().map(|end| end * to_entries);
        self.certain_from = low as f32;
        self.per_certain = (1.0 / (high - low)).min(1e30) as f32;
        self.beyond = tables.beyond;
        let mut surfaces = transfer.isosurfaces.clone();
        surfaces.sort_by(|a, b| a.value.total_cmp(&b.value));
        let surface = |Isosurface { value, color, opacity }: Isosurface| Surface {
            value: ((value - zero) * per_value) as f32,
            opacity: opacity as f32,
            depth: -(1.0 - opacity).max(1e-9).ln() as f32,
            color: color.map(|channel| channel as f32),
        };
        self.isosurfaces = surfaces.into_iter().map(surface).collect();
    }

    fn set_lattice(&mut self, view: &View, lattice: &Lattice) {
        let inverse = (view.rotation * lattice.axes).inverse();
        let narrow = |place: DVec3| place.as_vec3().to_array();
        let rows = inverse.transpose();
        self.axes = [rows.x_axis, rows.y_axis, rows.z_axis].map(narrow);
        // Relative to the first sample, for the precision of 32-bit numbers.
        let samples = lattice.step_range();
        self.origin = narrow(-(inverse * view.to_view(lattice.position(samples.min))));
        // An axis with a single sample still fills that sample's cell.
        let unit = lattice.unit([0; 3]);
        let margin = DVec3::select(samples.size().cmpgt(DVec3::ZERO), DVec3::ZERO, 0.5 * unit);
        self.low = narrow(-margin);
        self.high = narrow(samples.size() + margin);
        let depth = Shade::BEHIND_CLIPS * lattice.least_kernel_spacing();
        self.per_depth = ((1.0 / depth) as f32).min(AT_ONCE);
        self.is_on_lattice = true;
    }

    fn set_kernel(&mut self, lattice: &Lattice, kernel: &Kernel) {
        let unit = lattice.unit([0; 3]);
        let deviation = kernel.unit() * unit.x * lattice.axes.x_axis.length();
        let radius = kernel.radius();
        // A cell of the body-centred lattice holds two samples.
        let overlap = match lattice.arrangement {
            Arrangement::BodyCentred => kernel.integral() * (unit.x * unit.y * unit.z) / 0.5,
            _ => kernel.integral(),
        };
        let extent = kernel.extent / kernel.unit();
        self.least_sum = kernel.least_sum() as f32;
        self.kernel = FieldKernel {
            is_tabled: !matches!(kernel.profile, Profile::Gaussian(_)),
            deviation: deviation as f32,
            per_deviation: (1.0 / deviation) as f32,
            radius2: (radius * radius) as f32,
            extent: extent as f32,
            per_extent: (1.0 / extent) as f32,
            per_overlap: (1.0 / overlap) as f32,
        };
    }
}
