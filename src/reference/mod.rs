//! The reference: what a splatkit picture is, in plain double precision on the CPU.
//!
//! The engine must draw these pictures; it shares no code with this module beyond the scene, the view, the list of sheets,
//! the kernels' values and the transfer function. Everything is brute force, pixel by pixel over all kernels, for pictures
//! of some thousand pixels and kernels. [`integrate`] is the same field without sheets, as truth for them; [`trace`] draws
//! triangles, as truth for surfels.
//!
//! # The picture
//! **Rays.** The ray of the pixel in column i and row j passes through (i + ½, j + ½): the points x(s) = a + s·b̂ in view
//! space (x right, y down, z forward), with |b̂| = 1. Sheet k is the part with planes\[k\] ≤ s < planes\[k + 1\]; the planes
//! are its faces.
//!
//! **Kernels** (Westover 1990). Each is a radial function h(|x′|) over kernel space x′ = M·(x − c), c its centre, and M = B⁻¹.
//!
//! - A splat has the Gaussian h(r) = exp(−r²/2) and its own factor B, turned into view space; Σ = B·Bᵀ is widened by
//!   (0.35 pixel)² in every direction, so that the splat cannot fall between the pixels' rays (a scattered sample's weight w
//!   is divided by how much that widens its volume). A pixel is |c|/f at the
//!   centre's distance (perspective, f the focal length in pixels) or one over the pixels per world unit (orthographic).
//!   Opaque things must not grow by that: radiance with a normal n steps back along it, c − 2.4·(σ′ − σ)·n, with σ and σ′ the
//!   splat's standard deviations along n before and after.
//! - A sample of a lattice has the profile of its volume's kernel and B = A·U·u: A the steps of the lattice, U the sample's
//!   unit in steps, u the kernel's. It is not widened. Samples are those of `drawn_lattice` with the values `drawn_value`:
//!   the volume's own, or the coefficients that make it sharp.
//!
//! A ray passes the centre at ρ in kernel space, closest at the distance s*. Where ρ is over the radius of the footprint, the
//! ray misses the kernel. A Gaussian is not cut along the ray; all other profiles are 0 beyond their extent.
//!
//! **Samples** carry f + g·(x − c) and count w times. On Cartesian and body-centred lattices w = 1 and g = 0. On
//! rectilinear ones w = 1, and g is the gradient by differences of the neighbouring samples: along each axis, with the
//! distances d± to them, ((f₊ − f)·d₋/d₊ + (f − f₋)·d₊/d₋)/(d₋ + d₊), one-sided at the border and 0 along an axis of one
//! sample. Scattered samples have their own w and slope, which is g in kernel space as it is before splats are widened
//! (Franke & Nielson 1980: nodal functions blended by weights). A flat one, whose slope has no meaning in space, has g = 0.
//!
//! **Tensor products** ([`Tensor`](crate::math::Tensor)). On Cartesian lattices the field may instead be
//! f(x) = Σ t(p₁ − i)·t(p₂ − j)·t(p₃ − k)·f_ijk, p the place of x in steps of the lattice and t a function of one number: linear, that of
//! Catmull & Rom (1974), or the cubic B-spline. Weights add up to 1. The samples go on mirrored at the outermost ones, without end
//! (those of an axis of one sample all are that one). Such a field is classified after interpolation.
//!
//! # Sheets ([`Mode::Sheets`])
//! Kernels are cut at the faces, as by Mueller & Crawfis (1998), and the field is classified after interpolation (Mueller,
//! Möller & Crawfis 1999), inside the sheets.
//!
//! **Means and faces.** Over a sheet W = Σ w·∫h ds and V = Σ w·∫(f + g·(x − c))·h ds. Its mean is f̄ = V/W; it has none, and
//! holds no field, where W ≤ 10⁻⁴ of its thickness (kernels of both signs: 3/10 of their integral). At a face P = Σ w·h and Q = Σ w·(f + g·(x − c))·h, the value is
//! Q/P; none where P ≤ 10⁻⁴ (likewise). A face without a value takes f̄. The gradient at a face is that of Q/P in space,
//! (∇Q − (Q/P)·∇P)/P, derived without regard to the footprints' rims. With central differences its parts across the picture
//! are instead half the difference of the face's values in the neighbouring pixels: one-sided where a neighbour has none, 0
//! where neither has one. A face without a value has no gradient. A tensor product has f̄ = ∫f ds over the sheet's thickness, and at
//! faces f and ∇f.
//!
//! **Values.** u counts from 0 at the front face to 1 at the back. [`Classification::PreIntegrated`]: f(u) is the parabola with
//! the faces' values and the mean f̄. [`Classification::Post`]: f̄. The gradient g(u) across the ray is linear between the
//! faces' (that of one where the other has none, 0 where both have none); along the ray it is the parabola's derivative.
//!
//! **Parts.** Field is in that part of the sheet which lies in the box of the samples (of the volume's lattice, not of the drawn
//! one; an axis on which all lie at one place counts half a kernel unit to either side; scattered samples have no box) and in what
//! the clips leave. Each piece of it is divided in three equal parts. (In one where f(u) = f̄ and no isosurfaces are to be met.)
//! In a part from f(u_a) = a to f(u_b) = b, of length ℓ, all values between count alike (Engel et al. 2001):
//! extinction κ̄ = ∫κ df/(b − a) and colour ∫κ·c df/∫κ df; for a = b, and in Post with f̄, those of the value. κ̄ is multiplied by the
//! gradient factor of |g| in the part's middle (Levoy 1988), and for scattered samples by min(1, W/thickness). Then
//! α = 1 − exp(−κ̄·ℓ).
//!
//! **Isosurfaces.** A part meets each surface of value v with (a < v) ≠ (b < v) at its share (v − a)/(b − a), the nearest
//! first, equal ones in the order of the list. (a and b are the parabola's in Post too.) The shares of the part's optical depth
//! before, between and behind surfaces count there, all with the part's colour. A surface holds back its opacity.
//!
//! **In a sheet,** front to back from t = 1: parts add t·α·(lit colour) to S, surfaces t·opacity·(lit colour); t is multiplied by
//! 1 − α or 1 − opacity. A part is lit by g in its middle, a surface by g where it is met. The field's colour is S/(1 − t), its
//! optical depth −ln max(t, 10⁻⁹).
//!
//! **Radiance.** A splat adds the optical depth τ = strength · opacity · exp(−ρ²/2) · share, the share being that of a sheet in the
//! Gaussian along the ray (Zwicker et al. 2001 take the whole kernel). In a sheet the optical depths add. Colours and normals
//! are averaged by them and by how much splats face the eye, 0.5 − 4·n·ĉ kept in 1/255 … 1, and the average is lit once where some
//! splat has a normal. Sheets of less than 10⁻⁵ have none. Splats whose closest approach s* is clipped away do not count.
//!
//! **Compositing.** The optical depths of surface and field add, and their colours mix by them. Front to back, with
//! α = 1 − exp(−τ): C += (1 − A)·α·c, A += (1 − A)·α. The depth, a view-space z, is where the optical depth passes ln 2. It
//! grows evenly in a sheet with radiance; in others evenly in each part, and at once at an isosurface.
//!
//! **Light** is that of Blinn and Phong with the light at the eye, on both sides; colours clamped to 1. What is lit by a gradient
//! of 0 has its ambient and diffuse parts whole.
//!
//! # Other ways
//! **Optics.** The above is emission and absorption (Max 1995). [`Optics::XRay`]: the same optical depths, without isosurfaces; all
//! colours are white and unlit. [`Optics::Maximum`]: the colour and the opacity, as it stands, of the largest f(u) at the ends of all
//! parts of the ray; nothing without any. It has no depth.
//!
//! **Samples classified before** ([`Classification::Pre`], and always in the modes that follow) are radiance (Westover 1989):
//! colour c(f) and, over a part of the ray, the optical depth κ(f)·w/o·∫h ds, with o what the kernels sum to on average.
//! On a lattice that is ∫h over kernel space (body-centred: · 2^(−3/2)/½, unit over cell); scattered sets know theirs. Slopes do not
//! count. Where the field is lit a sample has a normal: against the gradient g as on a rectilinear lattice (body-centred: to the next
//! samples of the same cubic lattice; scattered: its own), none where that is 0. One shade lights the whole picture, the
//! field's. There is no box. Kernels with negative lobes can take light back within a sheet; colours are kept in 0 … 1.
//!
//! **[`Mode::AxisSheets`]** (Westover 1990). n is a unit vector across two of the lattice's axes (of the world's without a
//! lattice): of the three the one with the largest |n_z|, turned so that n_z > 0. Sheets are counted along n·c (perspective:
//! |n·c|). A kernel's whole line adds to the sheet that its centre lies in. A face is met at the distance key/|n·b̂|
//! (orthographic: (key − n·a)/(n·b̂)).
//!
//! **[`Mode::Splats`]** (Westover 1989). Whole kernels are composited one by one, each lit alone, in the order of |c|
//! (orthographic: of c_z), then of the scene. Nearer ones than `near` are left out, and such of no or negative optical depth. The
//! depth is at the s* of a kernel. In both modes, perspective views leave out what has its s* behind the eye.

mod classify;
mod clip;
mod composite;
mod face;
mod field;
mod gather;
mod images;
mod kernel;
mod mesh;
mod product;
mod profile;
mod quadrature;
mod ray;
mod shade;
mod sheet;
mod truth;
mod whole;

#[cfg(test)]
mod tests;

pub use mesh::trace;
pub use truth::integrate;

use crate::{
    Result,
    math::{Camera, View},
    picture::Picture,
    scene::{Classification, Clip, Gradient, Item, Mode, Optics, Scene, Settings},
    volume::{Lattice, Shade},
};
use classify::Classifier;
use composite::{Composite, Medium};
use field::Field;
use gather::Before;
use glam::{DVec2, DVec3};
use kernel::Kernel;
use product::Product;
use ray::Ray;
use rayon::prelude::*;
use sheet::Light;

/// Draws a scene by the definition above: premultiplied colour, and depth. Rows are drawn in parallel; time is
/// proportional to pixels times kernels.
///
/// # Errors
/// What [`Scene::validate`], [`Scene::validate_settings`] and [`Camera::view`] find.
pub fn render(scene: &Scene, camera: &Camera, settings: &Settings) -> Result<Picture> {
    scene.validate()?;
    scene.validate_settings(settings)?;
    let view = camera.view(settings.size)?;
    view.validate_for(&scene.bounds())?;
    let scene = &without_bricks(scene)?;
    let flat = with_cuts(scene, &view, settings)?;
    let frame = Frame::new(scene, &flat, view, settings);
    let rows = (0..settings.size[1]).into_par_iter().map(|row| frame.row(row.into())).collect();
    Ok(picture(&frame.view, rows))
}

/// The scene with volumes in bricks as a whole, at their finest level.
fn without_bricks(scene: &Scene) -> Result<Scene> {
    let whole = |item: &Item| match item {
        Item::Bricks(bricks, kernel, transfer) => {
            Ok(Item::Volume(bricks.volume(0)?.into(), kernel.clone(), transfer.clone()))
        }
        other => Ok(other.clone()),
    };
    Ok(Scene { items: scene.items.iter().map(whole).collect::<Result<_>>()? })
}

/// The scene with the splats of hierarchies' cuts in their place.
fn with_cuts(scene: &Scene, view: &View, settings: &Settings) -> Result<Scene> {
    let flat = |item: &Item| match item {
        Item::Hierarchy(hierarchy) => {
            let header = hierarchy.header();
            let culls = settings.culls(header.closed, &header.bounds, view);
            let cut = hierarchy.read_tree()?.cut(view, settings.detail, Some(culls))?;
            Ok(Item::Radiance(cut.into()))
        }
        other => Ok(other.clone()),
    };
    Ok(Scene { items: scene.items.iter().map(flat).collect::<Result<_>>()? })
}

/// The picture of what the rays of all rows have passed.
fn picture(view: &View, rows: Vec<Vec<Composite>>) -> Picture {
    let [width, height] = view.size;
    let mut picture = Picture { width, height, color: Vec::new(), depth: Vec::new() };
    for (row, composites) in rows.iter().enumerate() {
        for (column, composite) in composites.iter().enumerate() {
            picture.color.push(composite.color.extend(composite.opacity).as_vec4().to_array());
            // An infinite distance along a ray parallel to the picture would give no number.
            let ray = Ray::new(view, DVec2::new(column as f64, row as f64) + 0.5);
            let half = composite.half;
            picture.depth.push(if half.is_finite() {
                ray.point(half).z as f32
            } else {
                f32::INFINITY
            });
        }
    }
    picture
}

/// The nearest distance that is shown: perspective views have one.
fn nearest(scene: &Scene, view: &View, settings: &Settings) -> f64 {
    let usual = || 1e-3 * scene.bounds().diagonal();
    if view.perspective { settings.near.unwrap_or_else(usual) } else { f64::NEG_INFINITY }
}

/// Sheets of less optical depth than this are left out: they cannot be seen, and 32-bit sums of sections leave such
/// remainders.
const LEAST_DEPTH: f64 = 1e-5;

/// A picture being drawn.
struct Frame<'a> {
    view: View,
    mode: Mode,
    optics: Optics,
    gradient: Gradient,
    clips: Vec<Clip>,
    planes: Vec<f64>,
    near: f64,
    kernels: Vec<Kernel<'a>>,
    /// A field that is classified after interpolation.
    field: Option<Field<'a>>,
    /// The same where its kernels are tensor products.
    product: Option<Product<'a>>,
    /// Where the samples of a volume lie.
    lattice: Option<&'a Lattice>,
    /// The light on radiance.
    shade: Option<Shade>,
    /// What kernels must add up to for a value.
    least_sum: f64,
}

impl<'a> Frame<'a> {
    /// `flat` is the scene with its hierarchies cut.
    fn new(scene: &Scene, flat: &'a Scene, view: View, settings: &Settings) -> Self {
        let samples = flat.items.iter().find_map(|item| match item {
            // Bricks are a volume by now.
            Item::Radiance(_) | Item::Hierarchy(_) | Item::Bricks(..) => None,
            Item::Scalar(_, transfer) => Some((transfer, None)),
            Item::Volume(volume, _, transfer) => Some((transfer, Some(&volume.lattice))),
        });
        let dark = settings.optics == Optics::XRay;
        let before =
            settings.mode != Mode::Sheets || settings.classification == Classification::Pre;
        let shade = samples.and_then(|(transfer, _)| settings.shade_of(transfer)).filter(|_| !dark);
        let field = samples.filter(|_| !before).map(|(transfer, lattice)| Field {
            classifier: Classifier::new(transfer),
            lattice,
            shade,
            surfaces: if dark { &[] } else { &transfer.isosurfaces },
            inside: settings.classification == Classification::PreIntegrated,
        });
        let kernel = scene.items.iter().find_map(|item| match item {
            Item::Volume(_, kernel, _) => Some(kernel.clone()),
            _ => None,
        });
        Self {
            least_sum: kernel.unwrap_or_default().least_sum(),
            mode: settings.mode,
            optics: settings.optics,
            gradient: settings.gradient,
            clips: settings.clips.clone(),
            planes: scene.sheets(&view, settings).planes,
            near: nearest(scene, &view, settings),
            kernels: gather::gather(flat, &view, before.then_some(Before { lit: shade.is_some() })),
            field,
            product: Product::of(flat, &view),
            lattice: samples.and_then(|(_, lattice)| lattice),
            shade: if before && samples.is_some() { shade } else { settings.surface_shade },
            view,
        }
    }

    /// The ray of a pixel, which may lie outside the picture.
    fn ray(&self, column: i64, row: i64) -> Ray {
        Ray::new(&self.view, DVec2::new(column as f64, row as f64) + 0.5)
    }

    /// Draws a row.
    fn row(&self, row: i64) -> Vec<Composite> {
        let columns = 0..i64::from(self.view.size[0]);
        match self.mode {
            Mode::Sheets => self.row_of_sheets(row),
            Mode::AxisSheets => {
                let kernels = self.kernels_of_row(row);
                let axis = whole::sheet_axis(&self.view, self.lattice);
                columns
                    .map(|column| self.pixel_of_axis_sheets(&self.ray(column, row), &kernels, axis))
                    .collect()
            }
            Mode::Splats(order) => {
                let kernels = self.kernels_of_row(row);
                columns
                    .map(|column| self.pixel_of_splats(&self.ray(column, row), &kernels, order))
                    .collect()
            }
        }
    }

    /// The kernels that the rays of a row can meet: the rays of a row lie in one plane.
    fn kernels_of_row(&self, row: i64) -> Vec<&Kernel<'a>> {
        let [left, right] = [0, i64::from(self.view.size[0])].map(|column| self.ray(column, row));
        let normal =
            if self.view.perspective { left.direction.cross(right.direction) } else { DVec3::Y };
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

    /// Radiance, lit once.
    fn lit(&self, light: &Light, ray: &Ray) -> Medium {
        if light.depth <= 0.0 || light.facing <= 0.0 {
            return Medium::default();
        }
        let color = match &self.shade {
            _ if self.optics == Optics::XRay => DVec3::ONE,
            Some(shade) if light.has_normal => {
                shade::lit(light.color / light.facing, light.normal, ray.direction, shade)
            }
            _ => light.color / light.facing,
        };
        Medium { depth: light.depth, color: color.clamp(DVec3::ZERO, DVec3::ONE) }
    }
}
