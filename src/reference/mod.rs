//! The reference: the definition of a splatkit picture, in plain double precision on the CPU.
//!
//! The engines must draw these pictures. They share no code with this module except the scene, the
//! view, the list of sheets, the values of the kernels and the transfer function. Everything here
//! is brute force: every pixel visits all kernels. That suits pictures of a few thousand pixels and
//! kernels. [`integrate`] draws the same field without sheets, as ground truth for the sheets.
//! [`trace`] draws triangles, as ground truth for surfels.
//!
//! # The picture
//! **Rays.** The ray of the pixel in column i and row j passes through (i + ½, j + ½). Its points
//! are x(s) = a + s·b̂ in view space (x right, y down, z forward), with |b̂| = 1. Sheet k is the
//! part of the ray with planes\[k\] ≤ s < planes\[k + 1\]. These planes are its faces.
//!
//! **Kernels** (Westover 1990). Each kernel is a radial function h(|x′|) of the kernel-space point
//! x′ = M·(x − c). Here c is the kernel's centre and M = B⁻¹.
//!
//! - A splat has the Gaussian h(r) = exp(−r²/2) and its own factor B, rotated into view space. Its
//!   covariance Σ = B·Bᵀ is widened by (0.35 pixel)² in every direction, so that the splat cannot
//!   fall between the pixels' rays. (The weight w of a scattered sample is divided by the factor by
//!   which this increases the sample's volume.) A pixel's size is |c|/f at the centre's distance in
//!   perspective. f is the focal length in pixels.
//!
//!   In orthographic views it is one over the number of pixels per world unit. Opaque surfaces must
//!   not grow through this widening. So a splat of radiance with a normal n steps back along n, to
//!   c − 2.4·(σ′ − σ)·n. Here σ and σ′ are the splat's standard deviations along n before and after
//!   widening.
//! - A trained Gaussian ([`Gaussians`](crate::gaussians::Gaussians)) is a splat without a normal,
//!   with the colour of its harmonics in the direction from the eye to its centre. It is widened by
//!   (√0.3 pixel)² across the view's axis and by a hundredth of that along it. Its pixel has the
//!   size z/f, with z the centre's distance along that axis.
//!
//!   It covers the share α = min(0.99, o·exp(−ρ²/2)) of a ray that passes it at ρ, with o its
//!   opacity. If α < 1/255 it covers nothing. Its optical depth on the ray is −ln(1 − α), spread
//!   like its line integral. Its colour may exceed 1. (Kerbl et al. 2023 draw whole Gaussians;
//!   [`trained`] draws by their formulas.)
//! - A sample of a lattice has the profile of its volume's kernel, and B = A·U·u. A holds the steps
//!   of the lattice, U is the sample's unit in steps, u the kernel's unit. Lattice samples are not
//!   widened. Their lattice is `drawn_lattice` and their values are `drawn_value`: the volume's
//!   own, or the coefficients that make it sharp.
//!
//! A ray passes the centre at distance ρ in kernel space; the closest point of the ray is at the
//! distance s*. If ρ exceeds the radius of the footprint, the ray misses the kernel. A Gaussian is
//! not cut along the ray; all other profiles are 0 beyond their extent.
//!
//! **Samples** carry the value f + g·(x − c) and have a weight w. On Cartesian and body-centred
//! lattices w = 1 and g = 0. On rectilinear lattices w = 1, and g is the gradient by finite
//! differences of the neighbouring samples. Along each axis, with the distances d± to the two
//! neighbours, it is ((f₊ − f)·d₋/d₊ + (f − f₋)·d₊/d₋)/(d₋ + d₊).
//!
//! It is one-sided at the border, and 0 along an axis with a single sample. Scattered samples have
//! their own w and slope. The slope is g in kernel space, as it is before splats are widened
//! (Franke & Nielson 1980: nodal functions blended by weights). For a flat sample the slope has no
//! meaning in space, so g = 0.
//!
//! **Tensor products** ([`Tensor`](crate::math::Tensor)). On Cartesian lattices the field may
//! instead be f(x) = Σ t(p₁ − i)·t(p₂ − j)·t(p₃ − k)·f_ijk. Here p is the place of x in steps of
//! the lattice, and t is a function of one variable: linear, the cubic of Catmull & Rom (1974), or
//! the cubic B-spline. The weights add up to 1. The samples are mirrored at the outermost ones,
//! endlessly. (On an axis with one sample, all of them equal that sample.) Such a field is
//! classified after interpolation.
//!
//! The gradient of a linear field jumps at every sample. In its place stands the difference of the
//! field one step before and one step behind along each axis, over two steps: t′(p) is (t(p + 1) −
//! t(p − 1))/2.
//!
//! **Label maps** ([`Volume::with_labels`](crate::volume::Volume::with_labels)). A sheet has the
//! label of the sample that is nearest to the middle of what the ray keeps of it. The label is
//! classified as it is. Light follows the gradient of the label's mask Σ w·m/Σ w, with w =
//! exp(−d²/2σ²), σ = 0.7 steps, over the four nearest samples along each axis.
//!
//! At a sample of the label, m is the share of its label around it. That is the same mean of 1 at
//! samples with that label and 0 at others, with σ = 1.2, over two samples to each side. At another
//! sample, m is 1 minus the share of its own label. Samples outside the lattice have no weight.
//!
//! # Sheets ([`Mode::Sheets`])
//! Kernels are cut at the faces, as in Mueller & Crawfis (1998). The field is classified after
//! interpolation (Mueller, Möller & Crawfis 1999), inside the sheets.
//!
//! **Means and faces.** Over a sheet W = Σ w·∫h ds and V = Σ w·∫(f + g·(x − c))·h ds. The sheet's
//! mean is f̄ = V/W. If W ≤ 10⁻⁴ of the sheet's thickness, the sheet has no mean and holds no
//! field. (For kernels of both signs the limit is 3/10 of their integral.) At a face P = Σ w·h and
//! Q = Σ w·(f + g·(x − c))·h. The value there is Q/P; there is none if P ≤ 10⁻⁴ (3/10 of the
//! integral likewise).
//!
//! A face without a value takes f̄. The gradient at a face is that of Q/P in space, (∇Q −
//! (Q/P)·∇P)/P. Its derivation ignores the rims of the footprints. With central differences, its
//! components across the picture are instead half the difference of the face's values in the
//! neighbouring pixels. They are one-sided if one neighbour has no value, and 0 if neither has one.
//! A face without a value has no gradient. For a tensor product f̄ = ∫f ds over the sheet's
//! thickness, and the faces have f and ∇f.
//!
//! **Values.** u runs from 0 at the front face to 1 at the back face. With
//! [`Classification::PreIntegrated`], f(u) is the parabola with the values of the faces and the
//! mean f̄. With [`Classification::Post`], f(u) = f̄. The gradient g(u) of a lattice's field is the
//! parabola through the gradients at the faces and in the middle of the sheet (at u = ½, defined as
//! at a face).
//!
//! There are four exceptions: fields without a lattice, central differences, sheets thicker than
//! 2.2 of the smallest sample spacings, and `Evaluate::Scatter`, because splats are added to sheets
//! and faces only. For these, and where one of the three gradients is missing, g(u) across the ray
//! is linear between the gradients of the faces. (If one face has none, g(u) is that of the other;
//! if neither has one, it is 0.) Along the ray, it is then the derivative of the values' parabola.
//!
//! **Cells.** A field of tetrahedra is linear inside each, between the values of its corners. Those
//! with a visible value count (all in a maximum intensity picture). A ray crosses a tetrahedron
//! where no barycentric coordinate is negative. In a sheet, L is the sum of the lengths of these
//! crossings and V the sum of their integrals; f̄ = V/L. If L ≤ 10⁻⁴ of the sheet's thickness, the
//! sheet holds no field.
//!
//! The faces of the sheet then are the first place where a crossing begins and the last where one
//! ends, with the values and gradients there. Extinction is multiplied by min(1, L/distance between
//! them). A gradient is linear between those of the corners, and is taken whole: not only across
//! the ray. If each tetrahedron has one value, it adds the optical depth κ·ℓ of its crossing,
//! unlit, to the sheet; optical depths add, colours mix in proportion.
//!
//! **Parts.** The field exists where the sheet lies inside the box of the samples and inside what
//! the clips leave. The box is that of the volume's lattice, not of the drawn one. An axis on which
//! all samples lie at one place extends half a kernel unit to either side; scattered samples have
//! no box. Each remaining piece is divided into three equal parts. (It stays one part if f(u) = f̄
//! and there are no isosurfaces.) Consider a part from f(u_a) = a to f(u_b) = b, of length ℓ.
//!
//! All values between a and b count alike in it (Engel et al. 2001): the extinction is κ̄ = ∫κ
//! df/(b − a) and the colour ∫κ·c df/∫κ df. If a = b, and in Post with f̄, extinction and colour
//! are those of the value. κ̄ is multiplied by the gradient factor of |g| in the part's middle
//! (Levoy 1988), and for scattered samples by min(1, W/thickness). Then α = 1 − exp(−κ̄·ℓ).
//!
//! **Isosurfaces.** A part crosses each surface of value v with (a < v) ≠ (b < v) at its share (v −
//! a)/(b − a). Surfaces are crossed nearest first, equal ones in the order of the list. (a and b
//! are the values of the parabola in Post too.) The part's optical depth is split at the surfaces.
//! The shares before, between and behind them count there, all with the part's colour. A surface
//! blocks the share of the light that its opacity gives.
//!
//! **In a sheet,** front to back from t = 1: a part adds t·α·(lit colour) to S, a surface adds
//! t·opacity·(lit colour); t is then multiplied by 1 − α or 1 − opacity. A part is lit by g in its
//! middle, a surface by g where the ray crosses it. The field's colour is S/(1 − t), its optical
//! depth −ln max(t, 10⁻⁹).
//!
//! **Radiance.** A splat adds the optical depth τ = strength · opacity · exp(−ρ²/2) · share. The
//! share is the sheet's share of the Gaussian along the ray (Zwicker et al. 2001 take the whole
//! kernel). If the opacity is below 1, τ is also multiplied by A/A′: the area of the splat, seen
//! from the eye along c, before and after it is widened. So it absorbs as much light in all. In a
//! sheet the optical depths add.
//!
//! Colours and normals are averaged, weighted by optical depth and by how much the splats face the
//! eye: 0.5 − 4·n·ĉ, clamped to 1/255 … 1. The average is lit once if some splat has a normal. In a
//! scene with trained Gaussians, which are not lit, the lit colour counts by min(1, 2·|n̄|), with
//! n̄ the average normal. Sheets with an optical depth below 10⁻⁵ have no radiance. Splats whose
//! closest approach s* is clipped away do not count.
//!
//! **Trained Gaussians alone.** If a scene has nothing else and is drawn as a whole, each counts at
//! the depth z of its centre along the view's axis, as its trainer sorts them. The sheets lie along
//! z instead of the rays. It is not cut: of its optical depth, the sheets whose middles enclose z
//! have linear shares, and the first or the last sheet all of it beyond their middles. Those with
//! the centre outside the sheets, or with s* behind the eye, are left out.
//!
//! **Facets** are triangles. A facet fills a share of a pixel: the area of the pixel's square
//! inside the triangle's perspective image. At a pixel it has the place, the normal and the colour
//! of its corners' mean. Their weights are the barycentric coordinates at which the pixel's ray
//! meets the facet's plane. Negative ones are set to 0, and the rest is scaled to add up to 1. The
//! facet's distance s is that of this place, z/b̂_z, and the facet belongs to the sheet that
//! contains s.
//!
//! In a sheet the shares of fronts add up, and those of backs; the larger sum counts, and 1 at
//! most. (If the set is [`Mixed`](crate::facet::Sides), all count as fronts. If it is closed, its
//! backs may be left out as those of hierarchies.) Each facet is lit by itself. The sheet's colour
//! is the mean weighted by shares, mixed with the mean weighted by share·exp(−min(60, 4·p)), in
//! which the nearest counts most. Here p is the distance from the sheet's front face in pixels; a
//! pixel's size is planes\[k\]/f (orthographic: as for splats).
//!
//! With S the sum of all shares, the second mean counts by x² with x = S − 1, clamped to 0 … 1. So
//! facets side by side mix by their shares, and a surface that fills a part x of the pixel in front
//! of another shows by x. A facet whose place is clipped away does not count. A share a adds x·c to
//! C, and x to A, with x = o·min(1 − A, a·(1 − A + A·o⁴)) and o the opacity, 1 without images.
//!
//! Facets divide what else is in their sheet, at the mean of their distances weighted by
//! share·exp(−min(60, 4·p)). The parts of fields before it count in front of them, and the others
//! behind. Radiance, and cells with one value each, are spread evenly over the sheet: a linear
//! share counts in front.
//!
//! So what fills the rest of a pixel in another sheet leaves no gap if it is opaque, and takes its
//! share of the light that is left if it is clear. A facet that shows an image has the mean colour
//! of the image over its part of the pixel, times its own, and the image's mean opacity there.
//! Where that is 0 it does not count. Colours are then weighted by share·opacity, and o is the sum
//! of share·opacity over a, 1 at most. Other modes and optics draw no facets.
//!
//! **Rods** ([`Rod`](crate::facet::Rod)) are facets of another shape: the points within a radius r
//! of a segment. Let t be the place of the segment nearest to a pixel's ray. The radius r is that
//! of the ends, interpolated, or the least radius in pixels where that is larger. The distance of
//! the ray from t is d, in pixels, as r is. A pixel's size is the depth of t over f.
//!
//! The rod fills the share (s(r − d) + s(r + d) − 1)·min(1, π/2·r + l) of the pixel. There, s(x) is
//! x + ½ clamped to 0 … 1, and l the segment's length across the ray. That is a straight edge at
//! the outline, and the area of what is smaller than a pixel.
//!
//! The ray is moved from d to the middle of d − ½ … d + ½ and −r … r. Where it then enters the rod
//! are the distance, the normal and the place between both colours. Flat rods have the distance of
//! t, and their own normal or none. Of the rods in a sheet, the largest share counts as that of
//! backs, because neighbours of a line overlap. S is at least the sum of all shares that are seen.
//!
//! At a joint of two rods, pixels that neither fills belong to one of them, whatever their sheets.
//! A rod with a next one does not count where the ray passes its end by more than a quarter of a
//! pixel. One with a rod before does not count where the ray passes in front of its start. Within a
//! quarter of a pixel of what lies beyond the end of that rod it counts nevertheless.
//!
//! **Several fields** ([`Scene::fields`]). Each field is classified and lit by itself, as above,
//! with its own samples, kernel and transfer function, and has its own box. It does not see the
//! others. Its isosurfaces are a part of its medium. All fields have the same sheets.
//!
//! **Compositing.** In a sheet the optical depths of the radiance and of all fields add, and their
//! colours mix in proportion to them. Front to back, with α = 1 − exp(−τ): C += (1 − A)·α·c,
//! A += (1 − A)·α. The depth is the view-space z at which the optical depth passes ln 2. Optical
//! depth grows evenly in a sheet with radiance, or with several fields that absorb light there. In
//! other sheets it grows evenly within each part, and jumps at an isosurface.
//!
//! **Light** is that of Blinn and Phong with the light at the eye, on both sides; colours are
//! clamped to 1. If the gradient is 0, the ambient and diffuse parts count in full. A field's
//! gradient g counts with the certainty c = (|g| − g₀)/(g₁ − g₀), clamped to 0 … 1 (`certain` of
//! [`Shade`], in value per world length).
//!
//! The diffuse part is multiplied by 1 − c·(1 − cos), the highlight by c. So what is flat, or as
//! noisy as a flat region, is drawn as if it faced the eye. Normals of radiance are certain.
//!
//! Radiance and facets have a part of that light from a lamp beside the eye (`aside` of
//! [`Lighting`](crate::scene::Lighting)), with the share s and the direction l. b̂ is the direction
//! from the eye, and a the optical axis. The cosine then is (1 − s)·|n·b̂| + s·t·max(n·l, 0),
//! divided by |s·l − (1 − s)·a|, at most 1: on a ball on the axis, the brightest place has 1.
//!
//! With t = min(10·|n·b̂|, 1), nothing jumps where a surface turns from one side to the other. The
//! highlight is that of the half vector s·l − (2 − s)·a, for all rays. Samples that are classified
//! first are lit from the eye alone.
//!
//! Behind a clip, c is multiplied by s/(2·h), 1 at most. Here s is the length of the ray from the
//! last clip before the sheet's end to its middle, and h the lattice's smallest spacing. So a cut
//! face shows values, and not the relief of their noise.
//!
//! **Other lights** ([`Lighting`](crate::scene::Lighting)). The diffuse light and the highlight are
//! divided into shares: `head` from the eye, `key` from a lamp, `sky` from all sides. n is the
//! normal of length 1 towards the eye, c its certainty, l the direction to the lamp, and cos' =
//! 1 − c·(1 − cos). The factor on a colour is e·(ambient + diffuse·(head·|n·b̂|' + sky)) +
//! S·key·diffuse·(n·l)'. The highlight is that of the eye times e·head, plus S·key times that of
//! the half vector of l and −b̂.
//!
//! e = v + 2c·w·n, at least 0, is the light from all sides: the cosine's integral over the sphere
//! to the first order in n. It is at most what comes to n in the open, 1 + 2c·w₀·n. v is the mean
//! of T·L over all directions d, and w the mean of T·L·d, which is w₀ in the open. T is the light
//! that comes in from d, and L the brightness there, 1 or 1 + d·up. S is what reaches the place of
//! the lamp's light.
//!
//! These are taken at a place before the surface: 2.5 times the step of their lattice along
//! c·n − (1 − c)·b̂. The surface is a facet at its own distance, or the radiance of a sheet in its
//! middle. A field has them at both faces of its sheet, and v, w and S are linear between these. A
//! field's normal is there the mean of its gradients at the front, in the middle and at the back,
//! each turned to the eye.
//!
//! T and S come from maps: pictures along the light, in a cube of as many planes as pixels around
//! the scene. In a map each sheet meets all of the light. Its optical depth, 16 at most, grows
//! evenly in it; the map has the sum up to each plane. S = exp(−depth).
//!
//! T is known at the nodes of a lattice around the scene. It follows from the depths there and at
//! the radius towards the light; each map serves both ends of its axis. All is linear between
//! nodes, pixels and planes. With a strength below 1, v and w are mixed with 1 and with up/3 (or
//! 0), those of the open.
//!
//! # Other ways
//! **Optics.** The above is emission and absorption (Max 1995). [`Optics::XRay`] uses the same
//! optical depths, without isosurfaces; all colours are white and unlit. [`Optics::Maximum`] shows
//! the colour and the opacity, unscaled by length, of the largest f(u) at the ends of all parts of
//! the ray. A ray without parts shows nothing. Several fields are drawn one by one: their colours
//! are added, to at most 1, and what they let through is multiplied. This picture has no depth.
//!
//! **Samples classified before interpolation** ([`Classification::Pre`], and always in the modes
//! below; of one field only) are radiance (Westover 1989). They have the colour c(f) and, over a
//! part of the ray, the optical depth κ(f)·w/o·∫h ds. Here o is the average sum of the kernels. On
//! a lattice, o is ∫h over kernel space (body-centred: times 2^(−3/2)/½, unit over cell). Scattered
//! sets store their own. Slopes do not count.
//!
//! If the field is lit, a sample has a normal, against the gradient g that is defined as on a
//! rectilinear lattice. (On body-centred lattices g uses the next samples of the same cubic
//! lattice; scattered samples have their own slope.) A sample with g = 0 has no normal. One shade
//! lights the whole picture: the field's. There is no box. Kernels with negative lobes can take
//! light back within a sheet; colours are clamped to 0 … 1.
//!
//! **[`Mode::AxisSheets`]** (Westover 1990). n is a unit vector perpendicular to two of the
//! lattice's axes (the world's axes without a lattice). Of the three such vectors it is the one
//! with the largest |n_z|, oriented so that n_z > 0. Sheets are counted along n·c (perspective:
//! |n·c|). A kernel's whole line integral counts in the sheet that contains its centre. A ray
//! crosses a face at the distance key/|n·b̂| (orthographic: (key − n·a)/(n·b̂)).
//!
//! **[`Mode::Splats`]** (Westover 1989). Whole kernels are composited one by one, each lit alone,
//! in the order of |c|, then of the scene. Orthographic views, and scenes with trained Gaussians as
//! their trainer draws them, take c_z instead of |c|. Kernels nearer than `near`, and kernels whose
//! optical depth is zero or negative, are left out. A kernel's depth is at its s*. In both modes,
//! perspective views leave out kernels with s* behind the eye.

mod cells;
mod classify;
mod clip;
mod composite;
mod face;
mod facets;
mod field;
mod fields;
mod gather;
mod images;
mod kernel;
mod labels;
mod lamps;
mod maps;
mod mesh;
mod product;
mod profile;
mod quadrature;
mod ray;
mod rods;
mod shade;
mod sheet;
mod trained;
mod truth;
mod whole;

#[cfg(test)]
mod tests;

pub use mesh::trace;
pub use trained::trained;
pub use truth::integrate;

use crate::{
    Result,
    gaussians::Eye,
    hierarchy::CutSplats,
    math::{Camera, View},
    parallel::prelude::*,
    picture::Picture,
    scene::{Aside, Classification, Clip, Gradient, Item, Mode, Optics, Scene, Settings},
    splat::TrainedSplats,
    volume::{Lattice, Shade},
};
use composite::{Composite, Medium};
use fields::Drawn;
use gather::Before;
use glam::{DVec2, DVec3};
use kernel::Kernel;
use lamps::Lamps;
use ray::Ray;
use sheet::Light;
use std::collections::BTreeMap;

/// Draws a scene by the definition above. Returns premultiplied colour, and depth. Rows are drawn
/// in parallel; the time is proportional to pixels times kernels.
///
/// # Errors
/// The errors of [`Scene::validate`], [`Scene::validate_settings`] and [`Camera::view`].
pub fn render(scene: &Scene, camera: &Camera, settings: &Settings) -> Result<Picture> {
    scene.validate()?;
    scene.validate_settings(settings)?;
    let fields = scene.fields();
    if settings.optics == Optics::Maximum && fields.len() > 1 {
        let mut pictures =
            fields.iter().map(|field| render(&scene.with_one_field(*field), camera, settings));
        let mut sum = pictures.next().expect("several fields")?;
        for picture in pictures {
            sum.add_light(&picture?);
        }
        return Ok(sum);
    }
    let view = camera.view(settings.size)?;
    view.validate_for(&scene.bounds())?;
    let scene = &without_bricks(scene)?;
    let (flat, trained) = with_cuts(scene, &view, settings)?;
    let mut frame = Frame::new(scene, &flat, &trained, view, settings);
    frame.lamps = Lamps::new(scene, &frame.view, settings)?;
    let rows = (0..settings.size[1]).into_par_iter().map(|row| frame.row(row.into())).collect();
    Ok(picture(&frame.view, rows))
}

/// Returns the scene with volumes in bricks replaced by whole volumes, at their finest level.
fn without_bricks(scene: &Scene) -> Result<Scene> {
    scene.map(|(_, item)| match item {
        Item::Bricks(bricks, kernel, transfer) => {
            Ok(Item::Volume(bricks.volume(0)?.into(), kernel.clone(), transfer.clone()))
        }
        other => Ok(other.clone()),
    })
}

/// The splats that are seen of trained Gaussians and of their hierarchies, by item.
type Trained = BTreeMap<usize, TrainedSplats>;

/// Returns the scene with hierarchies of surfels replaced by the splats of their cuts, and solids
/// by the facets that clips leave of them. Also returns what is seen of trained items, which stay.
fn with_cuts(scene: &Scene, view: &View, settings: &Settings) -> Result<(Scene, Trained)> {
    let mut trained = Trained::new();
    let scene = scene.map(|(number, item)| {
        let view = &*scene.view_of(number, view);
        Ok(match item {
            Item::Hierarchy(hierarchy) => {
                let header = hierarchy.header();
                let culls = settings.culls(header.closed, &header.bounds, view);
                let cut = hierarchy.read_tree()?.cut(view, settings.detail, Some(culls))?;
                match cut {
                    CutSplats::Surfels(set) => Item::Radiance(set.into()),
                    CutSplats::Trained(set) => {
                        trained.insert(number, set);
                        item.clone()
                    }
                }
            }
            Item::Gaussians(set) => {
                trained.insert(number, set.seen_from(Eye::of(view)));
                item.clone()
            }
            Item::Solid(solid) => {
                Item::Facets(solid.facets(&scene.view_pose(number).clips(&settings.clips)?))
            }
            other => other.clone(),
        })
    })?;
    Ok((scene, trained))
}

/// Builds the picture from the composites of all rays, row by row.
fn picture(view: &View, rows: Vec<Vec<Composite>>) -> Picture {
    let [width, height] = view.size;
    let mut picture = Picture { width, height, color: Vec::new(), depth: Vec::new() };
    for (row, composites) in rows.iter().enumerate() {
        for (column, composite) in composites.iter().enumerate() {
            picture.color.push(composite.color.extend(composite.opacity).as_vec4().to_array());
            // Along a ray parallel to the picture, an infinite distance would give NaN.
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

/// Returns the nearest visible distance. Only perspective views have one.
fn nearest(scene: &Scene, view: &View, settings: &Settings) -> f64 {
    let usual = || 1e-3 * scene.bounds().diagonal();
    if view.perspective { settings.near.unwrap_or_else(usual) } else { f64::NEG_INFINITY }
}

/// Sheets with an optical depth below this are left out. They cannot be seen, and 32-bit sums of
/// sections leave remainders of this size.
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
    /// The kernels of radiance.
    kernels: Vec<Kernel<'a>>,
    facets: Vec<facets::Facet<'a>>,
    /// The fields that are classified after interpolation.
    fields: Vec<Drawn<'a>>,
    /// The lattice of a volume's samples.
    lattice: Option<&'a Lattice>,
    /// The shading of radiance.
    shade: Option<Shade>,
    /// The light of radiance from beside the eye.
    aside: Option<Aside>,
    /// Lights, unless all light comes from the eye.
    lamps: Option<Lamps>,
    /// Whether the scene has trained Gaussians.
    has_trained: bool,
    /// Whether it has nothing else, and they are drawn at the depths of their centres.
    by_centers: bool,
    /// The largest channel of a colour of radiance.
    brightest: f64,
}

impl<'a> Frame<'a> {
    /// `flat` is the scene with its hierarchies and solids cut, and `trained` what is seen of
    /// trained items.
    fn new(
        scene: &'a Scene,
        flat: &'a Scene,
        trained: &Trained,
        view: View,
        settings: &Settings,
    ) -> Self {
        let sheets = scene.sheets(&view, settings);
        let is_dark = settings.optics == Optics::XRay;
        let before =
            settings.mode != Mode::Sheets || settings.classification == Classification::Pre;
        let has_field = flat.items.iter().any(|item| item.transfer().is_some());
        let shade = flat.items.iter().find_map(|item| item.light(settings)).filter(|_| !is_dark);
        // Bricks have become volumes by now.
        let drawn = |(number, item): (usize, &'a Item)| {
            Drawn::new(item, &flat.view_of(number, &view), settings, &sheets)
        };
        let items = flat.items.iter().enumerate();
        let fields = items.filter(|_| !before).filter_map(drawn).collect();
        let before_shade = before.then_some(Before { lit: shade.is_some() });
        Self {
            lamps: None,
            has_trained: scene.items.iter().any(Item::is_trained),
            by_centers: scene.is_by_centers(settings),
            brightest: scene.brightest().into(),
            mode: settings.mode,
            optics: settings.optics,
            gradient: settings.gradient,
            clips: settings.clips.clone(),
            planes: sheets.planes,
            near: nearest(scene, &view, settings),
            kernels: gather::radiance((flat, trained), &view, before_shade),
            facets: facets::gather(flat, &view, settings),
            fields,
            lattice: flat.items.iter().find_map(Item::lattice),
            // Normals are as certain as their splats.
            shade: if before && has_field { shade } else { settings.surface_shade }
                .map(|shade| Shade { certain: None, ..shade }),
            aside: settings.lighting.aside.filter(|_| !(before && has_field)),
            view,
        }
    }

    /// Returns the ray of a pixel, which may lie outside the picture.
    fn ray(&self, column: i64, row: i64) -> Ray {
        Ray::new(&self.view, DVec2::new(column as f64, row as f64) + 0.5)
    }

    /// Draws a row.
    fn row(&self, row: i64) -> Vec<Composite> {
        let columns = 0..i64::from(self.view.size[0]);
        match self.mode {
            Mode::Sheets if self.by_centers => {
                let kernels = self.kernels_of_row(&self.kernels, row);
                columns
                    .map(|column| self.pixel_by_centers(&self.ray(column, row), &kernels))
                    .collect()
            }
            Mode::Sheets => self.row_of_sheets(row),
            Mode::AxisSheets => {
                let kernels = self.kernels_of_row(&self.kernels, row);
                let axis = whole::sheet_axis(&self.view, self.lattice);
                columns
                    .map(|column| self.pixel_of_axis_sheets(&self.ray(column, row), &kernels, axis))
                    .collect()
            }
            Mode::Splats(order) => {
                let kernels = self.kernels_of_row(&self.kernels, row);
                columns
                    .map(|column| self.pixel_of_splats(&self.ray(column, row), &kernels, order))
                    .collect()
            }
        }
    }

    /// Returns those of some kernels that the rays of a row can meet. These rays lie in one plane.
    fn kernels_of_row<'k>(&self, kernels: &'k [Kernel<'k>], row: i64) -> Vec<&'k Kernel<'k>> {
        let [left, right] = [0, i64::from(self.view.size[0])].map(|column| self.ray(column, row));
        let normal =
            if self.view.perspective { left.direction.cross(right.direction) } else { DVec3::Y };
        let offset = left.origin.dot(normal);
        kernels.iter().filter(|kernel| kernel.meets_plane(normal, offset)).collect()
    }

    /// The number of sheets.
    fn count(&self) -> usize {
        self.planes.len() - 1
    }

    /// Returns the distances at which a sheet begins and ends.
    fn span(&self, sheet: usize) -> [f64; 2] {
        [self.planes[sheet], self.planes[sheet + 1]]
    }

    /// Returns the lit colour of a surface at a distance along a ray.
    fn lit_surface(&self, color: DVec3, normal: DVec3, at: (&Ray, f64), shade: &Shade) -> DVec3 {
        match &self.lamps {
            Some(lamps) => lamps.lit(color, normal, at, (shade, self.aside.as_ref())),
            None => shade::lit(color, normal, at.0.direction, shade, self.aside.as_ref()),
        }
    }

    /// Lights the radiance of a sheet, once, at a distance along a ray.
    fn lit(&self, light: &Light, at: (&Ray, f64)) -> Medium {
        if light.depth <= 0.0 || light.facing <= 0.0 {
            return Medium::default();
        }
        let color = match &self.shade {
            _ if self.optics == Optics::XRay => DVec3::ONE,
            Some(shade) if light.has_normal => {
                let color = light.color / light.facing;
                let lit = self.lit_surface(color, light.normal, at, shade);
                let share = light.normal.length() / light.facing;
                // Gaussians are not lit.
                if self.has_trained { color.lerp(lit, (2.0 * share).min(1.0)) } else { lit }
            }
            _ => light.color / light.facing,
        };
        Medium { depth: light.depth, color: color.clamp(DVec3::ZERO, DVec3::splat(self.brightest)) }
    }
}
