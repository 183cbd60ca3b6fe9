//! A field without sheets: rays sampled at many points, as ground truth for sheets.

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
    parallel::prelude::*,
    picture::Picture,
    scene::{Item, Optics, Scene, Settings},
    volume::{Arrangement, Lattice, Shade, TransferFunction, Volume, reach::first_visible},
};
use glam::{DMat3, DVec2, DVec3};

/// Draws a volume without sheets. The field is Q/P of the [definition](self::super), evaluated at
/// the middles of steps along each ray. Each point is classified and lit alone. `step` is the
/// largest length of a step, in world units: each piece of a ray has a whole number of equal steps.
/// An isosurface is crossed between two points. The optical model is emission and absorption, in
/// the box of the samples and the clips.
///
/// By the definition, this is the picture to which sheets converge as they become thin. This
/// function needs no sums over sheets and visits only the samples around each ray. It skips regions
/// where no value is visible, and stops once a ray is opaque.
///
/// # Errors
/// Those of [`render`](super::render). [`Error::Argument`] for a scene that is not a single volume
/// on a Cartesian or body-centred lattice, and for other optics. Also for a step that is not a
/// positive length, or so short that a ray would take more than 2²⁰ of them.
pub fn integrate(
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    step: f64,
) -> Result<Picture> {
    scene.validate()?;
    scene.validate_settings(settings)?;
    let [Item::Volume(volume, kernel, transfer)] = &scene.items[..] else {
        return Err(Error::Argument(
            "integration along rays takes a scene with a single volume and nothing else".into(),
        ));
    };
    if matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_)) {
        return Err(Error::Argument(
            "integration along rays takes Cartesian and body-centred lattices, not rectilinear ones"
                .into(),
        ));
    }
    if settings.optics != Optics::EmissionAbsorption {
        return Err(Error::Argument(
            "integration along rays takes the optics emission and absorption only".into(),
        ));
    }
    if !(step > 0.0 && step.is_finite()) {
        return Err(Error::Argument(format!(
            "the step must be a positive, finite length in world units, found {step}"
        )));
    }
    let points = scene.bounds().diagonal() / step;
    if points > MOST_POINTS {
        return Err(Error::Argument(format!(
            "a step of {step:e} divides a ray into up to {points:.1e} steps, more than \
             {MOST_POINTS}: take a longer step"
        )));
    }
    let view = camera.view(settings.size)?;
    view.validate_for(&scene.bounds())?;
    let light = scene.items.iter().find_map(|item| item.light(settings));
    let field = Pointwise::new(volume, kernel, transfer, &view, light);
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

/// Maximum number of steps of a ray: more would change no picture, and take hours.
const MOST_POINTS: f64 = 1_048_576.0;

/// A ray with less light than this is not followed further.
const LEAST_LIGHT: f64 = 1e-6;

/// Where a Gaussian is cut along the ray, in standard deviations: 10⁻⁸ of its height remains there.
const TAIL: f64 = 6.0;

/// A field that can be evaluated anywhere.
struct Pointwise<'a> {
    volume: &'a Volume,
    lattice: &'a Lattice,
    profile: Profile<'a>,
    /// The field of a volume whose kernels are tensor products. Kernel space then is in steps.
    product: Option<Product<'a>>,
    /// Radius of the footprint in kernel space.
    radius: f64,
    /// The maximum reach of kernels along a ray, in kernel space.
    tail: f64,
    /// The unit of kernel space, in steps of the lattice.
    unit: f64,
    /// The map from view space to kernel space. `origin` is the first sample's place in view space.
    whitening: DMat3,
    /// The minimum sum of kernels for which a value exists.
    least_sum: f64,
    origin: DVec3,
    classifier: Classifier<'a>,
    shade: Option<Shade>,
    /// The cells between the samples in which some value is visible.
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
    /// P and Q.
    sums: Vec<[f64; 2]>,
    /// Σ h′/r·x′ and Σ f·h′/r·x′.
    slopes: Vec<[DVec3; 2]>,
    visible: Vec<bool>,
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

    /// Composites a ray over its pieces.
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
            // Points are handled in blocks, which share the samples around them. These samples
            // reach beyond the block's ends.
            let block = (4.0 * tail / step).ceil().max(1.0) as usize;
            let mut last = None;
            for first in (0..count).step_by(block) {
                let (block, at) = (block.min(count - first), place(first));
                let is_visible =
                    |i: f64| self.visible.at((origin + (at + i * step) * direction) * self.unit);
                points.reset(block, is_visible);
                let Some([start, end]) = points.ends() else {
                    last = None;
                    continue;
                };
                last = last.filter(|_| start == 0);
                self.sum(origin, direction, [at, step], [start, end], points);
                for i in start..=end {
                    let here = self.at(points, i).filter(|_| points.visible[i]);
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

    /// Composites the surfaces between the values of two points.
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
        let lit = |shade| shade::lit(color, gradient, ray.direction, shade, None);
        self.shade.as_ref().map_or(color, lit)
    }

    /// Returns the value and the view-space gradient at a point, or `None` where next to no kernel
    /// reaches.
    fn at(&self, points: &Points, i: usize) -> Option<(f64, DVec3)> {
        let [weight, sum] = points.sums[i];
        let value = (weight > self.least_sum).then(|| sum / weight)?;
        let [slope, value_slope] = points.slopes[i];
        Some((value, self.whitening.transpose() * (value_slope - value * slope) / weight))
    }

    /// Adds all samples around the points from `start` to `end`. Point i is at the distance `at` +
    /// i·`step`. In kernel space the ray is `origin` + s·`direction`.
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
        // Distances in kernel space from the ray's origin.
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
                // A Gaussian's next value is its last value times a factor, which itself changes by
                // a constant factor.
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

    /// Calls `add` for every sample whose footprint the ray meets and whose closest point lies
    /// between two distances in kernel space. It passes the sample's index, its offset from the
    /// ray's closest point, and that point's distance.
    fn each_sample_around(
        &self,
        origin: DVec3,
        along: DVec3,
        [from, to]: [f64; 2],
        mut add: impl FnMut(usize, DVec3, f64),
    ) {
        // Visit the slices of samples that the ray crosses most steeply. In each slice, visit the
        // ellipse around the crossing.
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
        // A body-centred lattice consists of two cubic ones.
        let kinds = if self.lattice.arrangement == Arrangement::BodyCentred { 2 } else { 1 };
        for kind in 0..kinds {
            let shift = 0.5 * kind as f64;
            let dims = [nx, ny, (nz + kinds - 1 - kind) / kinds];
            // The indices along an axis whose places lie between two coordinates of kernel space.
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
    /// Prepares the buffers for `count` points. The neighbours of visible points count as visible
    /// too, because isosurfaces lie between two points.
    fn reset(&mut self, count: usize, is_visible: impl Fn(f64) -> bool) {
        self.visible.clear();
        let (mut before, mut here) = (is_visible(-1.0), is_visible(0.0));
        self.visible.extend((0..count).map(|i| {
            let after = is_visible(i as f64 + 1.0);
            let any = before || here || after;
            (before, here) = (here, after);
            any
        }));
        self.sums.clear();
        self.sums.resize(count, [0.0; 2]);
        self.slopes.clear();
        self.slopes.resize(count, [DVec3::ZERO; 2]);
    }

    /// Returns the first and the last visible point.
    fn ends(&self) -> Option<[usize; 2]> {
        Some([
            self.visible.iter().position(|visible| *visible)?,
            self.visible.iter().rposition(|visible| *visible)?,
        ])
    }
}

impl Cells {
    /// Marks the cells around samples whose neighbourhoods have visible values: the cells with such
    /// a sample at a corner or in the middle. Kernels reach as far as these neighbourhoods. Only
    /// the tails of Gaussians along the ray reach further, where less than 10⁻⁵ of them is left.
    fn visible(volume: &Volume, kernel: &Kernel, transfer: &TransferFunction) -> Self {
        let lattice = volume.drawn_lattice();
        let ranges = volume.drawn_ranges(kernel);
        let first = first_visible(transfer, volume.range);
        let last = lattice.step_range().max;
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

    /// Whether the cell at a place in steps is marked. Places outside use the nearest cell.
    fn at(&self, steps: DVec3) -> bool {
        // Casts saturate at 0.
        let [x, y, z] = [0, 1, 2].map(|axis| (steps[axis] as usize).min(self.dims[axis] - 1));
        self.marked[x + self.dims[0] * (y + self.dims[1] * z)]
    }
}
