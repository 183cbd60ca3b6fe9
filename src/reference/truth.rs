//! A field without sheets: rays that are looked at in many points, as truth for them.

use super::{
    classify::Classifier,
    clip,
    composite::{Composite, Medium},
    nearest, picture,
    product::Product,
    profile::Profile,
    ray::Ray,
    shade,
};
use crate::{
    Error, Result,
    math::{Camera, Kernel, View},
    picture::Picture,
    scene::{Item, Optics, Scene, Settings},
    volume::{Arrangement, Lattice, Shade, TransferFunction, Volume, reach::first_visible},
};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// Draws a volume without sheets. The field is Q/P of the [definition](self::super), point by point in the middles of steps of
/// `step` (world units; at most, so that each piece of a ray holds a whole number of them), each classified and lit alone.
/// Isosurfaces are met between two points. Emission and absorption, in the box of the samples and the clips.
///
/// As far as the definition goes this is the picture that sheets tend to when they become thin. It does without the sums over
/// sheets, looks up only the samples around each ray, leaves out where no value shows, and stops where a ray is opaque.
///
/// # Errors
/// As [`render`](super::render); [`Error::Argument`] for a scene that is not one volume on a Cartesian or body-centred
/// lattice, for other optics, and for a step that is no length, or of which a ray would hold more than 2²⁰.
pub fn integrate(
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    step: f64,
) -> Result<Picture> {
    scene.validate()?;
    scene.validate_settings(settings)?;
    let [Item::Volume(volume, kernel, transfer)] = &scene.items[..] else {
        return Err(Error::Argument("rays are integrated through one volume alone".into()));
    };
    if matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_)) {
        return Err(Error::Argument(
            "rays are integrated on lattices of equal cells, not on rectilinear ones".into(),
        ));
    }
    if settings.optics != Optics::EmissionAbsorption {
        return Err(Error::Argument(
            "rays are integrated for emission and absorption alone".into(),
        ));
    }
    if !(step > 0.0 && step.is_finite()) {
        return Err(Error::Argument(format!(
            "rays are integrated in steps of a length, found {step}"
        )));
    }
    let points = scene.bounds().diagonal() / step;
    if points > MOST_POINTS {
        return Err(Error::Argument(format!(
            "rays through the volume take up to {points:.1e} steps of {step:e}; {MOST_POINTS} are the most: take longer ones"
        )));
    }
    let view = camera.view(settings.size)?;
    view.validate_for(&scene.bounds())?;
    let field = Pointwise::new(volume, kernel, transfer, &view, settings.shade_of(transfer));
    let near = nearest(scene, &view, settings);
    let [width, height] = settings.size;
    let row = |row: u32| {
        let mut points = Points::default();
        let pixel = |column: u32| {
            let ray = Ray::new(&view, DVec2::new(column.into(), row.into()) + 0.5);
            let allowed = clip::allowed(&ray, &view, &settings.clips);
            let held = clip::intersection(&allowed, clip::sample_box(&ray, &view, &volume.lattice));
            field.pixel(
                &ray,
                &clip::intersection(&held, Some([near, f64::INFINITY])),
                step,
                &mut points,
            )
        };
        (0..width).map(pixel).collect()
    };
    Ok(picture(&view, (0..height).into_par_iter().map(row).collect()))
}

/// Steps of a ray at most: finer ones would change no picture, and take hours.
const MOST_POINTS: f64 = 1_048_576.0;

/// Light of less than this is not followed further.
const LEAST_LIGHT: f64 = 1e-6;

/// Where a Gaussian is cut along the ray, in standard deviations: 10⁻⁸ of its height is left there.
const TAIL: f64 = 6.0;

/// A field that can be asked for its value anywhere.
struct Pointwise<'a> {
    volume: &'a Volume,
    lattice: &'a Lattice,
    profile: Profile<'a>,
    /// The field where kernels are tensor products; kernel space then counts in steps.
    product: Option<Product<'a>>,
    /// Radius of the footprint in kernel space.
    radius: f64,
    /// How far kernels reach along a ray at most, in kernel space.
    tail: f64,
    /// Kernel space in steps of the lattice.
    unit: f64,
    /// Kernel space from view space, and the first sample's place in view space.
    whitening: DMat3,
    /// What kernels must add up to for a value.
    least_sum: f64,
    origin: DVec3,
    classifier: Classifier<'a>,
    shade: Option<Shade>,
    /// The cells between the samples in which some value shows.
    visible: Cells,
}

/// Unit cells of a lattice's steps.
struct Cells {
    dims: [usize; 3],
    marked: Vec<bool>,
}

/// The field at evenly spaced points of a ray.
#[derive(Default)]
struct Points {
    /// P and Q
    sums: Vec<[f64; 2]>,
    /// Σ h′/r·x′ and Σ f·h′/r·x′
    slopes: Vec<[DVec3; 2]>,
    shown: Vec<bool>,
}

impl<'a> Pointwise<'a> {
    fn new(
        volume: &'a Volume,
        kernel: &'a Kernel,
        transfer: &'a TransferFunction,
        view: &View,
        shade: Option<Shade>,
    ) -> Self {
        let lattice = volume.drawn_lattice();
        // The unit is the same along all axes.
        let unit = lattice.unit([0; 3]).x * kernel.unit();
        let profile = Profile::of(kernel);
        Self {
            volume,
            lattice,
            profile,
            product: Product::new(volume, kernel, view),
            radius: kernel.radius(),
            tail: if matches!(profile, Profile::Gaussian) { TAIL } else { kernel.radius() },
            unit,
            whitening: (view.rotation * lattice.axes * unit).inverse(),
            least_sum: kernel.least_sum(),
            origin: view.to_view(lattice.origin),
            classifier: Classifier::new(transfer),
            shade,
            visible: Cells::visible(volume, kernel, transfer),
        }
    }

    fn needs_gradients(&self) -> bool {
        self.shade.is_some() || !self.classifier.transfer.gradient.is_empty()
    }

    /// Follows a ray through pieces of it.
    fn pixel(&self, ray: &Ray, pieces: &[[f64; 2]], step: f64, points: &mut Points) -> Composite {
        let mut composite = Composite::EMPTY;
        let origin = self.whitening * (ray.origin - self.origin);
        let direction = self.whitening * ray.direction;
        let tail = self.tail / direction.length();
        for &[from, to] in pieces {
            let count = ((to - from) / step).ceil().max(1.0);
            let step = (to - from) / count;
            let count = count as usize;
            let place = |i: usize| from + (i as f64 + 0.5) * step;
            // Blocks of points share the samples around them, which reach over their ends.
            let block = (4.0 * tail / step).ceil().max(1.0) as usize;
            let mut last = None;
            for first in (0..count).step_by(block) {
                let (block, at) = (block.min(count - first), place(first));
                let shown =
                    |i: f64| self.visible.at((origin + (at + i * step) * direction) * self.unit);
                points.reset(block, shown);
                let Some([start, end]) = points.ends() else {
                    last = None;
                    continue;
                };
                last = last.filter(|_| start == 0);
                self.sum(origin, direction, [at, step], [start, end], points);
                for i in start..=end {
                    let here = self.at(points, i).filter(|_| points.shown[i]);
                    let s = place(first + i);
                    if let Some((value, gradient)) = here {
                        if let Some((before, _)) = last {
                            self.meet_surfaces(
                                &mut composite,
                                [before, value],
                                gradient,
                                ray,
                                [s - step, s],
                            );
                        }
                        let (extinction, color) = self.classifier.at(value);
                        let extinction = extinction
                            * self.classifier.transfer.gradient_factor(gradient.length());
                        if extinction > 0.0 {
                            let color = self.lit(color, gradient, ray);
                            composite.pass(
                                Medium { depth: extinction * step, color },
                                [s - 0.5 * step, s + 0.5 * step],
                            );
                        }
                    }
                    last = here;
                    if composite.opacity > 1.0 - LEAST_LIGHT {
                        return composite;
                    }
                }
                if end + 1 < block {
                    last = None;
                }
            }
        }
        composite
    }

    /// Passes the surfaces between two points' values.
    fn meet_surfaces(
        &self,
        composite: &mut Composite,
        [a, b]: [f64; 2],
        gradient: DVec3,
        ray: &Ray,
        [from, to]: [f64; 2],
    ) {
        let surfaces = &self.classifier.transfer.isosurfaces;
        let mut met: Vec<_> =
            surfaces.iter().filter(|surface| (a < surface.value) != (b < surface.value)).collect();
        met.sort_by(|x, y| (x.value - a).abs().total_cmp(&(y.value - a).abs()));
        for surface in met {
            let color = self.lit(DVec3::from(surface.color), gradient, ray);
            let s = from + (surface.value - a) / (b - a) * (to - from);
            composite.pass(Medium { depth: -(1.0 - surface.opacity).ln(), color }, [s, s]);
        }
    }

    fn lit(&self, color: DVec3, gradient: DVec3, ray: &Ray) -> DVec3 {
        self.shade.as_ref().map_or(color, |shade| shade::lit(color, gradient, ray.direction, shade))
    }

    /// The value and the view-space gradient at a point; none where next to no kernel reaches.
    fn at(&self, points: &Points, i: usize) -> Option<(f64, DVec3)> {
        let [weight, sum] = points.sums[i];
        let value = (weight > self.least_sum).then(|| sum / weight)?;
        let [slope, value_slope] = points.slopes[i];
        Some((value, self.whitening.transpose() * (value_slope - value * slope) / weight))
    }

    /// Adds all samples around the points from `start` to `end`. Point i is at the distance `at` + i·`step`; the ray, in
    /// kernel space, is `origin` + s·`direction`.
    fn sum(
        &self,
        origin: DVec3,
        direction: DVec3,
        [at, step]: [f64; 2],
        [start, end]: [usize; 2],
        points: &mut Points,
    ) {
        if let Some(product) = &self.product {
            for i in start..=end {
                let (value, slopes) = product.at_steps(origin + (at + i as f64 * step) * direction);
                (points.sums[i], points.slopes[i]) = ([1.0, value], [DVec3::ZERO, slopes]);
            }
            return;
        }
        let density = direction.length();
        let along = direction / density;
        // Counted in kernel space from the ray's origin.
        let (first, stride) = ((at + start as f64 * step) * density, step * density);
        let last = first + (end - start) as f64 * stride;
        let gradients = self.needs_gradients();
        self.each_sample_around(
            origin,
            along,
            [first - self.tail, last + self.tail],
            |sample, offset, closest| {
                let rho = offset.length();
                let reach = self.tail.min(self.profile.reach(rho));
                let begin = ((closest - reach - first) / stride).ceil().max(0.0) as usize;
                let past = ((closest + reach - first) / stride).floor() + 1.0;
                let past = (past.max(0.0) as usize).min(end - start + 1);
                if begin >= past {
                    return;
                }
                let value = self.volume.drawn_value(sample);
                let mut t = first + begin as f64 * stride - closest;
                // A Gaussian's next value is its last one times a factor, which itself changes by a factor.
                let mut bell = (-0.5 * (rho * rho + t * t)).exp();
                let mut factor = (-stride * (t + 0.5 * stride)).exp();
                let change = (-stride * stride).exp();
                for i in start + begin..start + past {
                    let (h, slope) = match self.profile {
                        Profile::Gaussian => (bell, -bell),
                        Profile::Compact(_) => {
                            let r = rho.hypot(t);
                            (
                                self.profile.value(r),
                                if gradients { self.profile.slope(r) } else { 0.0 },
                            )
                        }
                    };
                    let [weight, sum] = &mut points.sums[i];
                    *weight += h;
                    *sum += value * h;
                    if gradients {
                        let turned = slope * (offset - t * along);
                        let [slopes, value_slopes] = &mut points.slopes[i];
                        *slopes -= turned;
                        *value_slopes -= value * turned;
                    }
                    t += stride;
                    bell *= factor;
                    factor *= change;
                }
            },
        );
    }

    /// Calls `add` with every sample whose footprint a ray meets, closest between two distances in kernel space: its index,
    /// its place as seen from the ray's closest point, and the distance of that.
    fn each_sample_around(
        &self,
        origin: DVec3,
        along: DVec3,
        [from, to]: [f64; 2],
        mut add: impl FnMut(usize, DVec3, f64),
    ) {
        // The slices of samples that the ray crosses most steeply; in each, an ellipse around the crossing.
        let steep = if along.abs().max_element() == along.abs().x {
            0
        } else {
            1 + usize::from(along.y.abs() < along.z.abs())
        };
        let [b, c] = [(steep + 1) % 3, (steep + 2) % 3];
        let half_width = |other: usize| {
            self.radius * (1.0 - along[other] * along[other]).max(0.0).sqrt() / along[steep].abs()
        };
        let (half_b, half_c) = (half_width(c), half_width(b));
        let lean = self.radius * (1.0 - along[steep] * along[steep]).max(0.0).sqrt();
        let [nx, ny, nz] = self.lattice.dims;
        // A body-centred lattice is two cubic ones.
        let kinds = if self.lattice.arrangement == Arrangement::BodyCentred { 2 } else { 1 };
        for kind in 0..kinds {
            let shift = 0.5 * kind as f64;
            let dims = [nx, ny, (nz + kinds - 1 - kind) / kinds];
            // The indices along an axis whose places are around a coordinate of kernel space.
            let indices = |axis: usize, low: f64, high: f64| {
                let first = (low * self.unit - shift).ceil().max(0.0) as usize;
                let past = (high * self.unit - shift).floor() + 1.0;
                first..(past.max(0.0) as usize).min(dims[axis])
            };
            let [s0, s1] = [from, to].map(|s| origin[steep] + s * along[steep]);
            for slice in indices(steep, s0.min(s1) - lean, s0.max(s1) + lean) {
                let mut place = DVec3::ZERO;
                place[steep] = (slice as f64 + shift) / self.unit;
                let crossing = origin + (place[steep] - origin[steep]) / along[steep] * along;
                for j in indices(c, crossing[c] - half_c, crossing[c] + half_c) {
                    place[c] = (j as f64 + shift) / self.unit;
                    for i in indices(b, crossing[b] - half_b, crossing[b] + half_b) {
                        place[b] = (i as f64 + shift) / self.unit;
                        let seen = place - origin;
                        let closest = seen.dot(along);
                        let offset = seen - closest * along;
                        let near = offset.length_squared() <= self.radius * self.radius;
                        if near && from <= closest && closest <= to {
                            let mut index = [0; 3];
                            (index[steep], index[b], index[c]) = (slice, i, j);
                            index[2] = index[2] * kinds + kind;
                            add(index[0] + nx * (index[1] + ny * index[2]), offset, closest);
                        }
                    }
                }
            }
        }
    }
}

impl Points {
    /// Makes room for points; also those beside what shows count, because surfaces lie between two points.
    fn reset(&mut self, count: usize, shown: impl Fn(f64) -> bool) {
        self.shown.clear();
        let (mut before, mut here) = (shown(-1.0), shown(0.0));
        self.shown.extend((0..count).map(|i| {
            let after = shown(i as f64 + 1.0);
            let any = before || here || after;
            (before, here) = (here, after);
            any
        }));
        self.sums.clear();
        self.sums.resize(count, [0.0; 2]);
        self.slopes.clear();
        self.slopes.resize(count, [DVec3::ZERO; 2]);
    }

    /// The first and the last point that show something.
    fn ends(&self) -> Option<[usize; 2]> {
        Some([
            self.shown.iter().position(|shown| *shown)?,
            self.shown.iter().rposition(|shown| *shown)?,
        ])
    }
}

impl Cells {
    /// The cells with a sample at their corners or middle whose neighbourhood shows something. Kernels reach as far as these
    /// neighbourhoods, but for the tails of Gaussians along the ray, of which less than 10⁻⁵ is left there.
    fn visible(volume: &Volume, kernel: &Kernel, transfer: &TransferFunction) -> Self {
        let lattice = volume.drawn_lattice();
        let ranges = volume.drawn_ranges(kernel);
        let first = first_visible(transfer, volume.range);
        let [_, last] = lattice.step_range();
        let dims = last.to_array().map(|last| last.ceil() as usize + 1);
        let mut marked = vec![false; dims.iter().product()];
        for (at, [low, high]) in ranges.iter().enumerate() {
            if u16::from(*high) < first[usize::from(*low)] {
                continue;
            }
            let place = lattice.steps(lattice.index(at)).to_array();
            let [x, y, z] = [0, 1, 2].map(|axis| {
                let before = (place[axis].ceil() as usize).saturating_sub(1);
                before..=(place[axis].floor() as usize).min(dims[axis] - 1)
            });
            for k in z {
                for j in y.clone() {
                    x.clone().for_each(|i| marked[i + dims[0] * (j + dims[1] * k)] = true);
                }
            }
        }
        Self { dims, marked }
    }

    /// Whether the cell at some steps is marked; those outside count as the nearest ones.
    fn at(&self, steps: DVec3) -> bool {
        // Casts cut to 0.
        let [x, y, z] = [0, 1, 2].map(|axis| (steps[axis] as usize).min(self.dims[axis] - 1));
        self.marked[x + self.dims[0] * (y + self.dims[1] * z)]
    }
}
