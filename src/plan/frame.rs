//! The numbers of a frame that every part of a picture needs: the view, the sheets, the light of
//! surfaces, and what the clips keep.

use crate::{
    math::{Bounds, Sheets, View},
    scene::{Aside, Clip, ClipShape, Mode, Scene, Settings},
    volume::Shade,
};
use glam::{DVec3, Mat3, Vec3};

/// A view with its sheets, its light and its clips, in 32 bits.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Pixel coordinates of the optical axis.
    pub center: [f32; 2],
    /// Focal length in pixels (perspective), or pixels per world unit.
    pub scale: f32,
    pub is_perspective: bool,
    pub sheet_count: u32,
    /// The number of sheets at the front whose thickness grows with the distance.
    pub geometric_sheets: u32,
    /// One over the binary logarithm of the ratio of successive planes of geometric sheets.
    pub per_ratio_log2: f32,
    /// One over the thickness of the other sheets.
    pub per_step: f32,
    /// Smallest z in view space that any pixel sees (perspective).
    pub z_near: f32,
    pub surface_light: Light,
    pub surface_sides: Sides,
    /// The normal of axis-aligned sheets in view space.
    pub sheet_normal: Vec3,
    /// The rotation from view space to the world's axes.
    pub to_world: Mat3,
    /// The convex regions that the clips keep.
    pub clips: Vec<Convex>,
    /// The corners of the boxes that the clips cut out.
    pub holes: Vec<[Vec3; 2]>,
}

/// A convex region, relative to the eye and along the world's axes.
#[derive(Debug, Clone, Copy)]
pub enum Convex {
    /// The points x with `normal`·x ≤ `offset`.
    HalfSpace { normal: Vec3, offset: f32 },
    /// The points between two corners.
    Box([Vec3; 2]),
}

/// Blinn's light at the eye, in 32 bits.
#[derive(Debug, Clone, Copy, Default)]
pub struct Light {
    pub ambient: f32,
    pub diffuse: f32,
    pub specular: f32,
    pub power: f32,
}

/// How the eye's light is divided between the eye and a lamp beside it, in 32 bits.
#[derive(Debug, Clone, Copy)]
pub struct Sides {
    /// The factor on the cosine of the normal to the eye.
    pub eye: f32,
    /// The direction to the lamp in view space. Its length is the factor on the normal's cosine.
    pub lamp: Vec3,
    /// The direction in which a surface shows the highlight; zero if that is the eye's.
    pub half: Vec3,
}

impl Default for Sides {
    /// All light comes from the eye.
    fn default() -> Self {
        Self { eye: 1.0, lamp: Vec3::ZERO, half: Vec3::ZERO }
    }
}

impl Sides {
    /// Returns the division at which the brightest part of a ball is as bright as if all light came
    /// from the eye.
    fn new(Aside { direction, share }: Aside) -> Self {
        let (lamp, eye) = (share * direction.normalize(), 1.0 - share);
        let brightest = (lamp - eye * DVec3::Z).length();
        // The half vector of a lamp between both, in the middle of the picture.
        let half = (lamp - (1.0 + eye) * DVec3::Z).normalize();
        Self {
            eye: (eye / brightest) as f32,
            lamp: (lamp / brightest).as_vec3(),
            half: half.as_vec3(),
        }
    }
}

impl Light {
    /// Returns a light of these shares. Without them, colours stay as they are: the power is
    /// negative, which tells the shaders that no light dims them.
    pub fn new(shade: Option<Shade>) -> Self {
        let unlit = Self { ambient: 1.0, diffuse: 0.0, specular: 0.0, power: -1.0 };
        shade.map_or(unlit, |shade| Self {
            ambient: shade.ambient as f32,
            diffuse: shade.diffuse as f32,
            specular: shade.specular as f32,
            power: shade.power as f32,
        })
    }
}

impl Frame {
    /// Returns the frame of a view of a scene.
    pub fn new(scene: &Scene, view: &View, sheets: &Sheets, settings: &Settings) -> Self {
        let sheet_normal = match settings.mode {
            Mode::AxisSheets => scene.sheet_normal(view).as_vec3(),
            Mode::Sheets | Mode::Splats(_) => Vec3::ZERO,
        };
        // Samples that are classified first are lit as surfaces are. They have the only field.
        let classified = scene.items.iter().find_map(|item| item.transfer());
        let classified = classified.filter(|_| settings.classifies_samples());
        let shade =
            classified.map_or(settings.surface_shade, |transfer| settings.shade_of(transfer));
        let aside = settings.lighting.aside.filter(|_| classified.is_none());
        let mut frame = Self {
            size: view.size,
            center: [view.center.x as f32, view.center.y as f32],
            scale: view.scale as f32,
            is_perspective: view.perspective,
            sheet_count: sheets.count() as u32,
            geometric_sheets: sheets.turn as u32,
            per_ratio_log2: if sheets.turn > 0 { (1.0 / sheets.ratio.log2()) as f32 } else { 0.0 },
            per_step: (1.0 / sheets.step) as f32,
            // Axis-aligned sheets may begin behind an eye that lies among them.
            z_near: (sheets.planes[0] * view.smallest_cosine()).max(1e-6 * sheets.step) as f32,
            surface_light: Light::new(shade),
            surface_sides: aside.map(Sides::new).unwrap_or_default(),
            sheet_normal,
            to_world: view.rotation.transpose().as_mat3(),
            clips: Vec::new(),
            holes: Vec::new(),
        };
        settings.clips.iter().for_each(|clip| frame.add_clip(view, clip));
        frame
    }

    fn add_clip(&mut self, view: &View, clip: &Clip) {
        match clip.shape {
            ClipShape::HalfSpace { normal, offset } => {
                // The complement of a half-space is a half-space.
                let size = if clip.inside { normal.length() } else { -normal.length() };
                let offset = (offset - normal.dot(view.position)) / size;
                let normal = (normal / size).as_vec3();
                self.clips.push(Convex::HalfSpace { normal, offset: offset as f32 });
            }
            ClipShape::Box(Bounds { min, max }) => {
                let corners = from_eye(view, [min, max]);
                if clip.inside {
                    self.clips.push(Convex::Box(corners));
                } else {
                    self.holes.push(corners);
                }
            }
        }
    }
}

/// Returns places relative to the eye.
pub fn from_eye(view: &View, places: [DVec3; 2]) -> [Vec3; 2] {
    places.map(|place| (place - view.position).as_vec3())
}

/// Returns how many convex regions the clips keep, and how many boxes they cut out.
pub fn clip_counts(settings: &Settings) -> [u32; 2] {
    let is_hole = |clip: &&Clip| !clip.inside && matches!(clip.shape, ClipShape::Box(_));
    let holes = settings.clips.iter().filter(is_hole).count();
    [(settings.clips.len() - holes) as u32, holes as u32]
}
