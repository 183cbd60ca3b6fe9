//! The numbers of the plan, packed as shaders read them: field by field as in
//! shaders/shared/frame.wgsl.

use crate::{
    facet::{FacetSet, Sides},
    hierarchy::file::Header,
    math::{Kernel, View},
    plan::{
        field::{self, Field, FieldKernel, Gradients},
        frame::{self, Convex, Light},
        source,
        tables::{Factors, Values},
    },
    scene::{Scene, Settings},
    splat::Common,
    volume::{Arrangement, Lattice, TransferFunction},
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

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
    pub tile_shift: u32,
    pub record_capacity: u32,
    pub entry_capacity: u32,
    pub surface_shade: [f32; 4],
    pub surface_sides: [f32; 4],
    pub surface_half: [f32; 4],
    pub sheet_normal: [f32; 4],
    /// Set on the GPU, before march.
    pub record_starts: [[u32; 4]; Scene::MAX_FIELDS / 4],
    pub world_x: [f32; 4],
    pub world_y: [f32; 4],
    pub world_z: [f32; 4],
    pub lamp_shares: [f32; 4],
    pub lamp_steps: [f32; 4],
    pub key_direction: [f32; 4],
    pub sky_side: [f32; 4],
    pub open_x: [f32; 4],
    pub open_y: [f32; 4],
    pub open_z: [f32; 4],
    pub key_x: [f32; 4],
    pub key_y: [f32; 4],
    pub key_z: [f32; 4],
    pub clips: [FrameClip; Settings::MAX_CLIPS],
    pub holes: [FrameClip; Settings::MAX_CLIPS],
    /// The fields of the scene, in its order.
    pub fields: [FrameField; Scene::MAX_FIELDS],
}

/// `Field` in frame.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct FrameField {
    pub axis_x: [f32; 4],
    pub axis_y: [f32; 4],
    pub axis_z: [f32; 4],
    pub origin: [f32; 4],
    pub low: [f32; 4],
    pub high: [f32; 4],
    pub shade: [f32; 4],
    pub certain: [f32; 4],
    pub isotropic: [f32; 4],
    pub transfer: [f32; 4],
    pub gradients: [f32; 4],
    pub table_starts: [u32; 4],
    pub before: [f32; 4],
    pub behind: [f32; 4],
    pub kernel: [f32; 4],
    pub levels: [f32; 4],
    pub lattice: [u32; 4],
    pub taps: [f32; 4],
    pub visibility: [u32; 4],
    pub isosurfaces: [FrameIsosurface; TransferFunction::MAX_ISOSURFACES],
}

/// `Clip` in frame.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct FrameClip {
    pub low: [f32; 4],
    pub high: [f32; 4],
}

/// `Isosurface` in frame.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct FrameIsosurface {
    pub value: [f32; 4],
    pub color: [f32; 4],
}

/// `Source` in frame.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct Source {
    pub axis_x: [f32; 4],
    pub axis_y: [f32; 4],
    pub axis_z: [f32; 4],
    pub origin: [f32; 4],
    pub covariance_a: [f32; 4],
    pub covariance_b: [f32; 4],
    pub lattice: [u32; 4],
    pub slices: [u32; 4],
    pub extent: f32,
    pub count: u32,
    pub first_run: u32,
    pub flags: u32,
}

/// `Source::flags`.
const RADIANCE: u32 = 1;
const ISOTROPIC: u32 = 2;
const ENDS: u32 = 4;
pub const NODES: u32 = 8;
pub const COARSE: u32 = 16;
const FACETS: u32 = 32;
const CULLED: u32 = 64;
const MIXED: u32 = 128;
const TRAINED: u32 = 256;
const BODY_CENTRED: u32 = 512;
const CUT: u32 = 2048;
const RECTILINEAR: u32 = 1024;

/// The number of the field lies in the upper half of `Source::flags`.
const FIELD_SHIFT: u32 = 16;

fn wide(v: Vec3) -> [f32; 4] {
    wide_with(v.to_array(), 0.0)
}

fn wide_with([x, y, z]: [f32; 3], w: f32) -> [f32; 4] {
    [x, y, z, w]
}

fn shade(Light { ambient, diffuse, specular, power }: Light) -> [f32; 4] {
    [ambient, diffuse, specular, power]
}

fn in_box([low, high]: [Vec3; 2]) -> FrameClip {
    FrameClip { low: wide(low), high: wide_with(high.to_array(), 1.0) }
}

fn clip(convex: &Convex) -> FrameClip {
    match *convex {
        Convex::HalfSpace { normal, offset } => {
            FrameClip { low: wide(normal), high: [offset, 0.0, 0.0, 0.0] }
        }
        Convex::Box(corners) => in_box(corners),
    }
}

impl Frame {
    /// Packs a frame. The capacities, the tiles and the fields are set later.
    pub fn new(frame: &frame::Frame) -> Self {
        let mut packed = Self {
            size: frame.size,
            center: frame.center,
            scale: frame.scale,
            perspective: frame.is_perspective.into(),
            sheet_count: frame.sheet_count,
            geometric_sheets: frame.geometric_sheets,
            ratio_log2_inverse: frame.per_ratio_log2,
            step_inverse: frame.per_step,
            z_near: frame.z_near,
            surface_shade: shade(frame.surface_light),
            surface_sides: wide_with(frame.surface_sides.lamp.to_array(), frame.surface_sides.eye),
            surface_half: wide(frame.surface_sides.half),
            sheet_normal: wide(frame.sheet_normal),
            world_x: wide(frame.to_world.x_axis),
            world_y: wide(frame.to_world.y_axis),
            world_z: wide(frame.to_world.z_axis),
            ..Self::default()
        };
        packed.clips.iter_mut().zip(&frame.clips).for_each(|(slot, convex)| *slot = clip(convex));
        packed.holes.iter_mut().zip(&frame.holes).for_each(|(slot, hole)| *slot = in_box(*hole));
        packed
    }
}

impl FrameField {
    /// Packs a field, whose tables begin at these entries: the transfer function, its integrals,
    /// the gradient's factors, and the kernel.
    pub fn new(field: &Field, table_starts: [u32; 4]) -> Self {
        let [axis_x, axis_y, axis_z] = field.axes.map(|axis| wide_with(axis, 0.0));
        let kernel = field.kernel;
        let Values { zero, per_value, last, place } = field.values;
        let Gradients { factors: Factors { first, per_magnitude }, length, pixels } =
            field.gradients;
        let [finer, coarser] = field.levels;
        let FieldKernel { deviation, per_deviation, radius2, .. } = kernel;
        // Unused isosurfaces have a value that no ray reaches.
        let unused = FrameIsosurface { value: [f32::MAX, 0.0, 0.0, 0.0], color: [0.0; 4] };
        let mut isosurfaces = [unused; TransferFunction::MAX_ISOSURFACES];
        for (slot, surface) in isosurfaces.iter_mut().zip(&field.isosurfaces) {
            let &field::Surface { value, opacity, depth, color } = surface;
            *slot = FrameIsosurface {
                value: [value, opacity, depth, 0.0],
                color: wide_with(color, 0.0),
            };
        }
        Self {
            axis_x,
            axis_y,
            axis_z,
            origin: wide_with(field.origin, 0.0),
            low: wide_with(field.low, f32::from(field.is_on_lattice)),
            high: wide_with(field.high, f32::from(kernel.is_tabled)),
            shade: shade(field.light),
            certain: [field.certain_from, field.per_certain, field.per_depth, 0.0],
            isotropic: [deviation, per_deviation, radius2, field.least_sum],
            transfer: [zero, per_value, last, place],
            gradients: [first, per_magnitude, length, pixels],
            table_starts,
            before: field.beyond[0],
            behind: field.beyond[1],
            kernel: [kernel.extent, kernel.per_extent, kernel.per_overlap, field.unit],
            levels: [finer, coarser, 0.0, 0.0],
            isosurfaces,
            ..Self::default()
        }
    }
}

impl Source {
    /// Packs a source.
    fn new(source: &source::Source) -> Self {
        let covariance = source.covariance;
        let [xx, xy, xz] = covariance.x_axis.to_array();
        let [_, yy, yz] = covariance.y_axis.to_array();
        let flags =
            [(source.has_radiance, RADIANCE), (source.is_trained, TRAINED), (source.ends, ENDS)];
        Self {
            axis_x: wide(source.to_view.x_axis),
            axis_y: wide(source.to_view.y_axis),
            axis_z: wide(source.to_view.z_axis),
            origin: wide(source.origin),
            covariance_a: [xx, xy, xz, yy],
            covariance_b: [yz, covariance.z_axis.z, 0.0, source.unit],
            extent: source.extent,
            flags: flags.iter().map(|(is_set, flag)| u32::from(*is_set) * flag).sum(),
            ..Self::default()
        }
    }

    /// Returns the same source for samples of the scene's field with this number.
    pub fn of_field(self, number: usize) -> Self {
        Self { flags: self.flags | (number as u32) << FIELD_SHIFT, ..self }
    }

    /// Returns the source of a chunk of explicit splats.
    pub fn of_splats(view: &View, set: &Common) -> Self {
        Self::new(&source::Source::of_splats(view, set))
    }

    /// Returns the source of a chunk of facets. `is_culled` says whether backs are left out.
    pub fn of_facets(view: &View, set: &FacetSet, is_culled: bool) -> Self {
        let culled = if is_culled { CULLED } else { 0 };
        let mixed = if set.sides == Sides::Mixed { MIXED } else { 0 };
        let cut = if set.whole.is_some() { CUT } else { 0 };
        let source = Self::new(&source::Source::of_radiance(view, set.origin, 1.0));
        Self { flags: FACETS | culled | mixed | cut, ..source }
    }

    /// Returns the source of nodes of a hierarchy.
    pub fn of_nodes(view: &View, header: &Header) -> Self {
        Self::new(&source::Source::of_nodes(view, header))
    }

    /// Returns the source of a chunk of a lattice whose samples have this kernel. If `isotropic`,
    /// their sections do not depend on the pixel.
    pub fn of_lattice(view: &View, lattice: &Lattice, kernel: &Kernel, isotropic: bool) -> Self {
        let arrangement = match lattice.arrangement {
            Arrangement::Cartesian => 0,
            Arrangement::BodyCentred => BODY_CENTRED,
            Arrangement::Rectilinear(_) => RECTILINEAR,
        };
        let round = if isotropic { ISOTROPIC } else { 0 };
        let source = Self::new(&source::Source::of_lattice(view, lattice, kernel));
        Self { flags: source.flags | round | arrangement, ..source }
    }
}
