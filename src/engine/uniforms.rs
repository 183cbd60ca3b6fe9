//! The structures that Rust writes and shaders read, field by field as in shaders/frame.wgsl.

use crate::{
    math::{Sheets, View},
    scene::{Item, Scene, Settings},
    splat::SplatSet,
    volume::{Lattice, Shade},
};
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec2, DVec3};

/// `Frame` in frame.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct Frame {
    pub size: [u32; 2],
    pub tiles: [u32; 2],
    pub center: [f32; 2],
    pub scale: f32,
    pub perspective: u32,
    pub sheet_count: u32,
    pub geometric_sheets: u32,
    pub ratio_log2_inverse: f32,
    pub step_inverse: f32,
    pub z_near: f32,
    pub group_shift: u32,
    pub record_capacity: u32,
    pub entry_capacity: u32,
    pub field_axes: [[f32; 4]; 3],
    pub field_origin: [f32; 4],
    pub field_low: [f32; 4],
    pub field_high: [f32; 4],
    pub volume_shade: [f32; 4],
    pub surface_shade: [f32; 4],
    pub isotropic: [f32; 4],
    pub transfer: [f32; 4],
}
const _: () = assert!(size_of::<Frame>() == 64 + 10 * 16);

/// `Source` in frame.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct Source {
    pub axes: [[f32; 4]; 3],
    pub origin: [f32; 4],
    pub covariance: [[f32; 4]; 2],
    pub lattice: [u32; 4],
    pub extent: f32,
    pub count: u32,
    pub first_run: u32,
    pub flags: u32,
}
const _: () = assert!(size_of::<Source>() == 8 * 16);

/// Bytes between the passes that plan.wgsl writes: the alignment of uniform bindings.
pub const PASS_STRIDE: u64 = 256;
/// Bytes of `Pass` in frame.wgsl.
pub const PASS_BYTES: u64 = 64;

/// `Report` in plan.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct Report {
    pub passes: u32,
    pub overflow: u32,
    pub entries: u32,
    pub splats: u32,
}

/// `Source::flags`.
pub const RADIANCE: u32 = 1;
pub const ISOTROPIC: u32 = 2;

fn wide(v: DVec3, w: f32) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w]
}

fn columns(m: DMat3) -> [[f32; 4]; 3] {
    [wide(m.x_axis, 0.0), wide(m.y_axis, 0.0), wide(m.z_axis, 0.0)]
}

fn shade(s: Option<Shade>) -> [f32; 4] {
    s.map_or([1.0, 0.0, 0.0, 1.0], |s| [s.ambient, s.diffuse, s.specular, s.power].map(|v| v as f32))
}

impl Source {
    /// A chunk of explicit splats.
    pub fn of_splats(view: &View, set: &SplatSet, radiance: bool) -> Self {
        Self {
            axes: columns(view.rotation),
            origin: wide(view.to_view(set.origin), 0.0),
            extent: set.extent,
            flags: if radiance { RADIANCE } else { 0 },
            ..Self::default()
        }
    }

    /// A chunk of a lattice; `sigma` and `extent` of the kernel in sample spacings.
    pub fn of_lattice(view: &View, lattice: &Lattice, sigma: f64, extent: f64, isotropic: bool) -> Self {
        let axes = view.rotation * lattice.axes;
        let c = sigma * sigma * (axes * axes.transpose());
        let covariance = [
            [c.x_axis.x, c.x_axis.y, c.x_axis.z, c.y_axis.y].map(|v| v as f32),
            [c.y_axis.z, c.z_axis.z, 0.0, 0.0].map(|v| v as f32),
        ];
        Self {
            axes: columns(axes),
            origin: wide(view.to_view(lattice.origin), 0.0),
            covariance,
            extent: (extent / sigma) as f32,
            flags: if isotropic { ISOTROPIC } else { 0 },
            ..Self::default()
        }
    }
}

/// Smallest cosine between a ray of the picture and the optical axis.
fn smallest_cosine(view: &View) -> f64 {
    let size = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1]));
    [DVec2::ZERO, DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y), size]
        .map(|corner| view.ray(corner).1.z)
        .into_iter()
        .fold(1.0, f64::min)
}

impl Frame {
    /// Everything but the tiles, the capacities and the transfer table.
    pub fn new(scene: &Scene, view: &View, sheets: &Sheets, settings: &Settings) -> Self {
        let mut frame = Self {
            size: view.size,
            center: [view.center.x as f32, view.center.y as f32],
            scale: view.scale as f32,
            perspective: view.perspective.into(),
            sheet_count: sheets.count() as u32,
            geometric_sheets: sheets.turn as u32,
            ratio_log2_inverse: if sheets.turn > 0 { (1.0 / sheets.ratio.log2()) as f32 } else { 0.0 },
            step_inverse: (1.0 / sheets.step) as f32,
            z_near: (sheets.planes[0] * smallest_cosine(view)) as f32,
            surface_shade: shade(settings.surface_shade),
            ..Self::default()
        };
        for item in &scene.items {
            match item {
                Item::Radiance(_) => {}
                Item::Scalar(_, transfer) => frame.volume_shade = shade(settings.shade_of(transfer)),
                Item::Volume(volume, kernel, transfer) => {
                    frame.volume_shade = shade(settings.shade_of(transfer));
                    frame.set_field(view, &volume.lattice);
                    let sigma = kernel.unit() * volume.lattice.axes.x_axis.length();
                    let extent = kernel.radius();
                    frame.isotropic = [sigma as f32, (1.0 / sigma) as f32, (extent * extent) as f32, 0.0];
                }
            }
        }
        frame
    }

    fn set_field(&mut self, view: &View, lattice: &Lattice) {
        let inverse = (view.rotation * lattice.axes).inverse();
        let rows = inverse.transpose();
        self.field_axes = columns(rows);
        self.field_origin = wide(-(inverse * view.to_view(lattice.origin)), 0.0);
        // A lattice of one sample across still fills its cell.
        let last = lattice.dims.map(|n| n as f64 - 1.0);
        let flat = |n: f64| if n > 0.0 { 0.0 } else { 0.5 };
        let margin = DVec3::from(last.map(flat));
        self.field_low = wide(-margin, 0.0);
        self.field_high = wide(DVec3::from(last) + margin, 0.0);
    }
}
