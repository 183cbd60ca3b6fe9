//! The field of a lattice in a sheet, gathered: each ray asks which kernels reach the planes of the sheet.

use super::{
    close::{Face, Layer, Visible},
    field::{self, Typed, Weighting},
    plan::Plan,
    rays::Rays,
    skip::Shown,
    vector::{Lanes, dot, three},
};
use crate::{
    math::{Kernel, Sheets},
    scene::{Gradient, Item, MOST_GATHERED, Mode, Optics, Scene, Settings},
    volume::{Arrangement, Volume},
};
use fearless_simd::{Simd, mask32x8, prelude::*};

/// Where slopes at the ends of a sheet differ by fewer entries of the table a sheet, a cubic between them is as good as one more
/// sample.
const STRAIGHT: f32 = 64.0;

/// The least standard deviation of a kernel, in steps, whose weights 32 bits hold.
const LEAST_DEVIATION: f64 = 0.3;

/// Why the field of a scene can't be gathered; none where it can: samples on a Cartesian lattice, kernels of which four weights
/// an axis hold all, sheets thin enough for a parabola.
pub fn obstacle(scene: &Scene, settings: &Settings, sheets: &Sheets) -> Option<&'static str> {
    let fields = scene.items.iter().filter(|item| !matches!(item, Item::Radiance(_) | Item::Hierarchy(_)));
    let [Item::Volume(volume, kernel, _)] = fields.collect::<Vec<_>>()[..] else {
        return Some("a scene without a volume on a lattice in memory");
    };
    if let Some(what) = unsuited(volume, kernel) {
        return Some(what);
    }
    if settings.mode != Mode::Sheets || settings.classifies_samples() {
        return Some("samples that are classified before interpolation");
    }
    if settings.gradient == Gradient::Central {
        return Some("gradients from neighbouring pixels");
    }
    let most = MOST_GATHERED * volume.lattice.least_kernel_spacing();
    // With room for rounding: default sheets may be as thick as that.
    (sheets.step > most * (1.0 + 1e-9)).then_some("sheets thicker than two samples")
}

/// Why a volume can't be gathered, whatever the settings.
pub fn unsuited(volume: &Volume, kernel: &Kernel) -> Option<&'static str> {
    if volume.lattice.arrangement != Arrangement::Cartesian {
        return Some("body-centred and rectilinear lattices");
    }
    if volume.coefficients.is_some() && kernel.as_tensor().is_none() {
        return Some("sharp volumes of radial kernels");
    }
    match field::weighting(kernel) {
        None => Some("kernels other than tensor products and Gaussians that reach two samples"),
        Some(Weighting::Gaussian(sigma)) if sigma < LEAST_DEVIATION => Some("kernels much narrower than a sample"),
        Some(_) => None,
    }
}

/// A lattice whose field is gathered.
pub struct Gather<'a> {
    pub field: Typed<'a>,
    pub shown: &'a Shown,
    /// Sheets are no thicker than the lattice's steps: all of one lies within half a step of its middle.
    pub is_thin: bool,
    pub visible: &'a Visible,
}

/// The last plane that a packet asked for.
#[derive(Clone, Copy)]
pub struct Last<S: Simd> {
    plane: usize,
    face: Face<S>,
    along: Lanes<S>,
    /// The last plane at which it was asked what may show, and the rays on which something may.
    shown_on: usize,
    shows: u64,
}

impl<S: Simd> Last<S> {
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        let none = Lanes::splat(simd, 0.0);
        let face = Face { value: none, across: [none; 3] };
        Self { plane: usize::MAX, face, along: none, shown_on: usize::MAX, shows: 0 }
    }
}

impl Gather<'_> {
    /// The field of a sheet and the rays on which it counts; nothing where it cannot be seen.
    #[inline(always)]
    pub fn layer<S: Simd>(
        &self,
        simd: S,
        plan: &Plan,
        rays: &Rays<S>,
        sheet: usize,
        last: &mut Last<S>,
    ) -> Option<(Layer<S>, mask32x8<S>)> {
        let (start, stop) = (plan.planes[sheet], plan.planes[sheet + 1]);
        let begin = rays.inside[0].max(Lanes::splat(simd, start));
        let end = rays.inside[1].min(Lanes::splat(simd, stop));
        let mask = begin.simd_lt(end);
        if !mask.any_true() {
            return None;
        }
        let mut shows = self.shown.at(simd, rays.place(0.5 * (start + stop)));
        if !self.is_thin {
            // Thicker sheets are looked up on both planes too.
            if last.shown_on != sheet {
                last.shows = self.shown.at(simd, rays.place(start));
            }
            shows |= last.shows;
            (last.shown_on, last.shows) = (sheet + 1, self.shown.at(simd, rays.place(stop)));
            shows |= last.shows;
        }
        let mask = mask & mask32x8::from_bitmask(simd, shows);
        if !mask.any_true() {
            return None;
        }
        if last.plane != sheet {
            self.face(simd, plan, rays, sheet, last);
        }
        let (front, front_along) = (last.face, last.along);
        self.face(simd, plan, rays, sheet + 1, last);
        let (back, back_along) = (last.face, last.along);
        let thickness = stop - start;
        let sum = front.value + back.value;
        // Hermite: the mean of the ends and an eighth of how much the slopes there differ.
        let bend = (front_along - back_along) * thickness;
        let middle = sum * 0.5 + bend * 0.125;
        let filling = Lanes::splat(simd, 1.0);
        let direction = rays.direction;
        let mut layer = Layer { front, back, middle, start, thickness, begin, end, filling, direction };
        if plan.optics != Optics::Maximum && !self.visible.may_show(simd, plan, &layer) {
            return None;
        }
        if !bend.abs().simd_gt(STRAIGHT).any_true() {
            return Some((layer, mask));
        }
        // The mean of the sheet is exact for fields of the fifth degree (Simpson's rule with slopes).
        let inside = self.at(simd, rays.place(0.5 * (start + stop))).0 * plan.frame.transfer[1];
        let mean = (sum * 7.0 + inside * 16.0) * (1.0 / 30.0) + bend * (1.0 / 60.0);
        layer.middle = mean * 1.5 - sum * 0.25;
        Some((layer, mask))
    }

    /// The field at places in steps of the lattice, and its change a step along each axis.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        // A function of its own for each type of samples, else each would be compiled wherever this one is called.
        simd.vectorize(
            #[inline(always)]
            || match &self.field {
                Typed::U8(field) => field.at(simd, place),
                Typed::U16(field) => field.at(simd, place),
                Typed::I16(field) => field.at(simd, place),
                Typed::I32(field) => field.at(simd, place),
                Typed::F32(field) => field.at(simd, place),
            },
        )
    }

    /// Finds the field on a plane, and its change along the rays a world unit.
    #[inline(always)]
    fn face<S: Simd>(&self, simd: S, plan: &Plan, rays: &Rays<S>, plane: usize, last: &mut Last<S>) {
        let frame = &plan.frame;
        let per_value = frame.transfer[1];
        let (value, slopes) = self.at(simd, rays.place(plan.planes[plane]));
        // From steps of the lattice to view space.
        let axes = &frame.field_axes;
        let gradient = three!(I => {
            (slopes[0] * axes[0][I] + slopes[1] * axes[1][I] + slopes[2] * axes[2][I]) * per_value
        });
        let along = dot(gradient, rays.direction);
        let length = frame.gradients[2];
        let across = three!(I => (gradient[I] - along * rays.direction[I]) * length);
        (last.plane, last.along) = (plane, along);
        last.face = Face { value: value * per_value, across };
    }
}
