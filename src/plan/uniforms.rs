//! The numbers of a frame and of its chunks, as structures that shaders read: field by field as in
//! shaders/shared/frame.wgsl. The CPU engine uses the same frame.

use crate::{
    bricks::Choice,
    facet::{FacetSet, Sides},
    hierarchy::file::Header,
    math::{Bounds, Kernel, Profile, Sheets, View},
    plan::tables::Tables,
    scene::{Clip, ClipShape, Item, Mode, Scene, Settings},
    splat::{FOOTPRINT_BLUR, Payload, SplatSet, TRAINED_BLUR, TRAINED_BLUR_ALONG},
    volume::{Arrangement, Isosurface, Lattice, Shade, TransferFunction},
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
    pub tile_shift: u32,
    pub record_capacity: u32,
    pub entry_capacity: u32,
    pub surface_shade: [f32; 4],
    pub sheet_normal: [f32; 4],
    /// Set on the GPU, before march.
    pub record_starts: [u32; Scene::MAX_FIELDS],
    pub world_x: [f32; 4],
    pub world_y: [f32; 4],
    pub world_z: [f32; 4],
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
    pub shown: [u32; 4],
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
pub const RADIANCE: u32 = 1;

pub const ISOTROPIC: u32 = 2;

pub const ENDS: u32 = 4;

pub const NODES: u32 = 8;

pub const COARSE: u32 = 16;

pub const FACETS: u32 = 32;

pub const CULLED: u32 = 64;

pub const MIXED: u32 = 128;

pub const TRAINED: u32 = 256;

pub const CUT: u32 = 2048;

pub const BODY_CENTRED: u32 = 512;

pub const RECTILINEAR: u32 = 1024;

/// The number of the field lies in the upper half of `Source::flags`.
pub const FIELD_SHIFT: u32 = 16;

fn wide(v: DVec3, w: f32) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w]
}

fn columns(m: DMat3) -> [[f32; 4]; 3] {
    [wide(m.x_axis, 0.0), wide(m.y_axis, 0.0), wide(m.z_axis, 0.0)]
}

fn shade(s: Option<Shade>) -> [f32; 4] {
    s.map_or([1.0, 0.0, 0.0, 1.0], |s| {
        [s.ambient, s.diffuse, s.specular, s.power].map(|v| v as f32)
    })
}

impl Source {
    pub fn axes(&self) -> [[f32; 4]; 3] {
        [self.axis_x, self.axis_y, self.axis_z]
    }

    /// Returns the standard deviations, in pixels, by which splats are widened: across the view's
    /// axis and along it.
    pub fn blur(&self) -> [f32; 2] {
        let blur = match self.flags & TRAINED {
            0 => [FOOTPRINT_BLUR; 2],
            _ => [TRAINED_BLUR, TRAINED_BLUR * TRAINED_BLUR_ALONG],
        };
        blur.map(|blur| blur as f32)
    }

    pub fn covariance(&self) -> [[f32; 4]; 2] {
        [self.covariance_a, self.covariance_b]
    }

    /// Returns the same source for samples of the scene's field with this number.
    pub fn of_field(self, number: usize) -> Self {
        Self { flags: self.flags | (number as u32) << FIELD_SHIFT, ..self }
    }

    /// Returns the source of a chunk of explicit splats.
    pub fn of_splats(view: &View, set: &SplatSet) -> Self {
        let flags = match set.payload {
            Payload::Scalar => 0,
            Payload::Radiance => RADIANCE,
            Payload::Trained => RADIANCE | TRAINED,
        };
        Self { flags, ..Self::of_radiance(view, set.origin, set.extent) }
    }

    /// Returns the source of a chunk of facets. `is_culled` says whether backs are left out.
    pub fn of_facets(view: &View, set: &FacetSet, is_culled: bool) -> Self {
        let culled = if is_culled { CULLED } else { 0 };
        let mixed = if set.sides == Sides::Mixed { MIXED } else { 0 };
        let cut = if set.whole.is_some() { CUT } else { 0 };
        Self { flags: FACETS | culled | mixed | cut, ..Self::of_radiance(view, set.origin, 1.0) }
    }

    /// Returns the source of nodes of a hierarchy.
    pub fn of_nodes(view: &View, header: &Header) -> Self {
        let trained = if header.degree.is_some() { TRAINED } else { 0 };
        Self { flags: RADIANCE | trained, ..Self::of_radiance(view, header.origin, header.extent) }
    }

    /// Returns the source of a chunk of radiance splats around an origin in the world.
    pub fn of_radiance(view: &View, origin: DVec3, extent: f32) -> Self {
        let [axis_x, axis_y, axis_z] = columns(view.rotation);
        Self {
            axis_x,
            axis_y,
            axis_z,
            origin: wide(view.to_view(origin), 0.0),
            extent,
            flags: RADIANCE,
            ..Self::default()
        }
    }

    /// Returns the source of a chunk of a lattice whose samples have this kernel. Rectilinear
    /// coordinates are relative to the first sample.
    pub fn of_lattice(view: &View, lattice: &Lattice, kernel: &Kernel, isotropic: bool) -> Self {
        let axes = view.rotation * lattice.axes;
        let own = axes * DMat3::from_diagonal(lattice.unit([0; 3]) * kernel.unit());
        let c = own * own.transpose();
        let is_gaussian = matches!(kernel.profile, Profile::Gaussian(_));
        let [axis_x, axis_y, axis_z] = columns(axes);
        let arrangement = match lattice.arrangement {
            Arrangement::Cartesian => 0,
            Arrangement::BodyCentred => BODY_CENTRED,
            Arrangement::Rectilinear(_) => RECTILINEAR,
        };
        let round = if isotropic { ISOTROPIC } else { 0 };
        Self {
            axis_x,
            axis_y,
            axis_z,
            origin: wide(view.to_view(lattice.position(lattice.step_range()[0])), 0.0),
            covariance_a: [c.x_axis.x, c.x_axis.y, c.x_axis.z, c.y_axis.y].map(|v| v as f32),
            covariance_b: [c.y_axis.z, c.z_axis.z, 0.0, kernel.unit()].map(|v| v as f32),
            extent: kernel.radius() as f32,
            flags: round | arrangement | if is_gaussian { 0 } else { ENDS },
            ..Self::default()
        }
    }
}

/// Returns the smallest cosine between a ray of the picture and the optical axis.
fn smallest_cosine(view: &View) -> f64 {
    let size = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1]));
    [DVec2::ZERO, DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y), size]
        .map(|corner| view.ray(corner).1.z)
        .into_iter()
        .fold(1.0, f64::min)
}

impl Frame {
    /// Returns the only field of a scene, or the first one.
    pub fn field(&self) -> &FrameField {
        &self.fields[0]
    }

    /// Fills everything except the tiles, the capacities and the tables.
    pub fn new(
        scene: &Scene,
        view: &View,
        sheets: &Sheets,
        settings: &Settings,
        choice: Option<&Choice>,
    ) -> Self {
        let mut frame = Self {
            size: view.size,
            center: [view.center.x as f32, view.center.y as f32],
            scale: view.scale as f32,
            perspective: view.perspective.into(),
            sheet_count: sheets.count() as u32,
            geometric_sheets: sheets.turn as u32,
            ratio_log2_inverse: if sheets.turn > 0 {
                (1.0 / sheets.ratio.log2()) as f32
            } else {
                0.0
            },
            step_inverse: (1.0 / sheets.step) as f32,
            // Axis-aligned sheets may begin behind an eye that lies among them.
            z_near: (sheets.planes[0] * smallest_cosine(view)).max(1e-6 * sheets.step) as f32,
            surface_shade: shade(settings.surface_shade),
            ..Self::default()
        };
        if settings.mode == Mode::AxisSheets {
            frame.sheet_normal = wide(scene.sheet_normal(view), 0.0);
        }
        for (field, number) in frame.fields.iter_mut().zip(scene.fields()) {
            *field = FrameField::new(&scene.items[number], view, settings, choice);
            if settings.classifies_samples() {
                frame.surface_shade = field.shade;
            }
        }
        frame.set_clips(view, settings);
        frame
    }

    /// Sets the clips, relative to the eye and along the world's axes: half-spaces and boxes that
    /// are kept, and boxes that are cut out.
    fn set_clips(&mut self, view: &View, settings: &Settings) {
        [self.world_x, self.world_y, self.world_z] = columns(view.rotation.transpose());
        let (mut clips, mut holes) = (self.clips.iter_mut(), self.holes.iter_mut());
        for clip in &settings.clips {
            let (slot, [low, high]) = match clip.shape {
                ClipShape::HalfSpace { normal, offset } => {
                    // The complement of a half-space is a half-space.
                    let size = if clip.inside { normal.length() } else { -normal.length() };
                    let offset = (offset - normal.dot(view.position)) / size;
                    (clips.next(), [wide(normal / size, 0.0), [offset as f32, 0.0, 0.0, 0.0]])
                }
                ClipShape::Box(Bounds { min, max }) => {
                    let slot = if clip.inside { clips.next() } else { holes.next() };
                    (slot, [wide(min - view.position, 0.0), wide(max - view.position, 1.0)])
                }
            };
            if let Some(slot) = slot {
                *slot = FrameClip { low, high };
            }
        }
    }
}

/// Where the box of scattered samples ends, in all directions.
const NOWHERE: f32 = 1e15;

impl FrameField {
    /// Returns the field of an item, without its tables. `choice` is that of a volume in bricks.
    fn new(item: &Item, view: &View, settings: &Settings, choice: Option<&Choice>) -> Self {
        let mut field = Self {
            low: [-NOWHERE, -NOWHERE, -NOWHERE, 0.0],
            high: [NOWHERE, NOWHERE, NOWHERE, 0.0],
            levels: [1.0, 1.0, 0.0, 0.0],
            ..Self::default()
        };
        match item {
            Item::Scalar(set, _) => {
                field.kernel[2] = 1.0 / set.overlap;
                field.isotropic[3] = Kernel::default().least_sum() as f32;
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
                for (own, &(_, weight)) in field.levels.iter_mut().zip(levels) {
                    *own = weight as f32;
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
            field.kernel[3] = transfer.unit as f32;
            field.shade = shade(settings.shade_of(transfer));
        }
        field
    }

    pub fn axes(&self) -> [[f32; 4]; 3] {
        [self.axis_x, self.axis_y, self.axis_z]
    }

    pub fn beyond(&self) -> [[f32; 4]; 2] {
        [self.before, self.behind]
    }

    /// Sets how values are looked up in the tables, which begin at entry `start`, and which
    /// gradients of a field with this light are certain. Gradients are per thickness of a sheet.
    pub fn set_tables(
        &mut self,
        (tables, start): (&Tables, u32),
        transfer: &TransferFunction,
        light: Option<Shade>,
        view: &View,
        sheets: &Sheets,
    ) {
        let [zero, per_value, ..] = tables.values;
        self.transfer = tables.values.map(|v| v as f32);
        let [first, per_magnitude] = tables.gradients;
        let (to_own, length) = (per_value * sheets.step, sheets.step);
        // If the factors are constant or change in one step, their number per magnitude may exceed
        // 32 bits.
        let per_own = (per_magnitude / to_own).min(1e30);
        self.gradients = [first * to_own, per_own, length, view.scale * length].map(|v| v as f32);
        let [low, high] =
            light.and_then(|light| light.certain).unwrap_or_default().map(|end| end * to_own);
        self.certain = [low, (1.0 / (high - low)).min(1e30), 0.0, 0.0].map(|v| v as f32);
        let [integrals, factors, kernel, _] = tables.starts;
        self.table_starts = [0, integrals, factors, kernel].map(|own| start + own);
        [self.before, self.behind] = tables.beyond;
        let mut surfaces = transfer.isosurfaces.clone();
        surfaces.sort_by(|a, b| a.value.total_cmp(&b.value));
        // Unused isosurfaces have a value that no ray reaches.
        self.isosurfaces
            .fill(FrameIsosurface { value: [f32::MAX, 0.0, 0.0, 0.0], color: [0.0; 4] });
        for (own, surface) in self.isosurfaces.iter_mut().zip(surfaces) {
            let Isosurface { value, color: [red, green, blue], opacity } = surface;
            let (entry, depth) = ((value - zero) * per_value, -(1.0 - opacity).max(1e-9).ln());
            *own = FrameIsosurface {
                value: [entry, opacity, depth, 0.0].map(|v| v as f32),
                color: [red, green, blue, 0.0].map(|v| v as f32),
            };
        }
    }

    fn set_lattice(&mut self, view: &View, lattice: &Lattice) {
        let inverse = (view.rotation * lattice.axes).inverse();
        let rows = inverse.transpose();
        [self.axis_x, self.axis_y, self.axis_z] = columns(rows);
        // Relative to the first sample, for the precision of 32-bit numbers.
        let [low, high] = lattice.step_range();
        self.origin = wide(-(inverse * view.to_view(lattice.position(low))), 0.0);
        // An axis with a single sample still fills that sample's cell.
        let unit = lattice.unit([0; 3]);
        let margin = DVec3::select((high - low).cmpgt(DVec3::ZERO), DVec3::ZERO, 0.5 * unit);
        self.low = wide(-margin, 1.0);
        self.high = wide(high - low + margin, 0.0);
    }

    fn set_kernel(&mut self, lattice: &Lattice, kernel: &Kernel) {
        let unit = lattice.unit([0; 3]);
        let sigma = kernel.unit() * unit.x * lattice.axes.x_axis.length();
        let radius = kernel.radius();
        self.isotropic =
            [sigma, 1.0 / sigma, radius * radius, kernel.least_sum()].map(|v| v as f32);
        // A cell of the body-centred lattice holds two samples.
        let overlap = match lattice.arrangement {
            Arrangement::BodyCentred => kernel.integral() * (unit.x * unit.y * unit.z) / 0.5,
            _ => kernel.integral(),
        };
        let length = kernel.extent / kernel.unit();
        self.kernel = [length, 1.0 / length, 1.0 / overlap, 0.0].map(|v| v as f32);
        self.high[3] = f32::from(!matches!(kernel.profile, Profile::Gaussian(_)));
    }
}

/// Returns how many convex parts the clips keep, and how many boxes they cut out.
pub fn clip_counts(settings: &Settings) -> [u32; 2] {
    let is_hole = |clip: &&Clip| !clip.inside && matches!(clip.shape, ClipShape::Box(_));
    let holes = settings.clips.iter().filter(is_hole).count();
    [(settings.clips.len() - holes) as u32, holes as u32]
}
