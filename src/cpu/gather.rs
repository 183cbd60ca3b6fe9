//! The field of a lattice in a sheet, gathered: each ray evaluates the kernels on the sheet's
//! planes.

use super::{
    blend::Way,
    brick_cache::Grid,
    close::{OPAQUE, Packet},
    field::{BEYOND, Typed},
    kernel_sums::{MOST_TAPS, Point},
    layer::{Face, Layer, Sections},
    plan::Plan,
    rays::Rays,
    scatter::normal_cdf,
    skip::is_marked,
    vector::{Lanes, apart, dot, each, three},
    visible::Visible,
};
use crate::{math::Kernel, plan::visible::VisibleBlocks, scene::Optics, volume::Volume};
use fearless_simd::{Simd, mask32x8, prelude::*};

/// The most that the slopes at a sheet's ends may differ, in entries of the table per sheet times
/// the share of the light that the sheet takes. Up to that, a cubic is as good as one more sample.
const STRAIGHT: f32 = 1.0;
/// If they differ by more entries, a sheet takes one more sample however little light it takes.
const BENT: f32 = 1024.0;

/// The gradient in the middle stands for a sheet of a linear field that takes a smaller share of
/// the light than this.
const FAINT: f32 = 0.05;

/// Returns why a volume can't be gathered, whatever the settings.
pub fn unsuited(volume: &Volume, kernel: &Kernel) -> Option<&'static str> {
    Way::of(volume, kernel).err()
}

/// A lattice whose field is gathered.
pub struct Gather<'a> {
    pub plan: &'a Plan<'a>,
    /// One level, or up to two for volumes in bricks, the finer first.
    pub levels: Vec<Level<'a>>,
    /// Parts of a sheet: one, except in sheets thicker than two samples.
    pub parts: usize,
    /// One over the kernel's standard deviation, in steps, if the field ends with the lattice.
    /// Tensor products do not end.
    pub ends: Option<f32>,
    /// Number of parts of a sheet at whose ends visibility is looked up. It is 0 if sheets are
    /// thin: then a whole sheet lies near enough to its middle.
    pub lookups: usize,
    /// There may be places without a field, and places where the kernels' sum is larger than
    /// elsewhere.
    pub is_blended: bool,
    /// The values are labels.
    pub is_label_map: bool,
    /// The gradient takes more samples than the value, so it is evaluated only where it counts: the
    /// kernel is linear.
    pub has_far_gradient: bool,
    pub visible: &'a Visible,
    /// The value that values are relative to.
    pub zero: f32,
}

/// A level of a lattice.
pub struct Level<'a> {
    pub field: Typed<'a>,
    pub dims: [usize; 3],
    /// The slots of its bricks; `None` for a volume in memory.
    pub grid: Option<&'a Grid>,
    pub visible_samples: &'a VisibleBlocks,
    /// The level's share in the picture.
    pub share: f32,
    /// Steps of the level per step of the lattice along each axis, and the place of the lattice's
    /// first sample in the level.
    pub scale: [f32; 3],
    pub shift: [f32; 3],
    /// The same for the cells in which visibility is looked up.
    pub cells: [[f32; 3]; 2],
}

impl Level<'_> {
    /// Converts a place to steps of the level.
    #[inline(always)]
    fn place<S: Simd>(&self, place: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
        three!(I => place[I] * self.scale[I] + self.shift[I])
    }

    /// Converts a place to cells for the visibility lookup.
    #[inline(always)]
    fn cell<S: Simd>(&self, place: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
        let [scale, shift] = &self.cells;
        three!(I => place[I] * scale[I] + shift[I])
    }

    /// Sets a point to the field at places in steps of the level, and its change per step along
    /// each axis.
    #[inline(always)]
    fn at<S: Simd>(
        &self,
        simd: S,
        place: [Lanes<S>; 3],
        way: &[Lanes<S>; 3],
        point: &mut Point<S>,
    ) {
        // A separate function for each type of samples; otherwise each would be compiled wherever
        // this one is called. It writes the vectors of the point one by one. Returned, they would
        // be copied two at a time, and each copy would wait until both were written.
        simd.vectorize(
            #[inline(always)]
            || match &self.field {
                Typed::U8(field) => field.at(simd, &place, point),
                Typed::U16(field) => field.at(simd, &place, point),
                Typed::I16(field) => field.at(simd, &place, point),
                Typed::I32(field) => field.at(simd, &place, point),
                Typed::F32(field) => field.at(simd, &place, point),
                Typed::Blend(blended) => *point = blended.at(simd, place, *way),
            },
        );
    }

    /// Returns the slopes of a linear field at places in steps of the level.
    #[inline(always)]
    fn slopes<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
        simd.vectorize(
            #[inline(always)]
            || match &self.field {
                Typed::U8(field) => field.slopes(simd, place),
                Typed::U16(field) => field.slopes(simd, place),
                Typed::I16(field) => field.slopes(simd, place),
                Typed::I32(field) => field.slopes(simd, place),
                Typed::F32(field) => field.slopes(simd, place),
                Typed::Blend(_) => unreachable!("linear fields are not blended"),
            },
        )
    }
}

/// Two places in a part of a sheet whose average is the part's mean: exact for fields of the third
/// degree (Gauss).
const GAUSS: [f32; 2] = [0.211_324_87, 0.788_675_1];
/// Distance from a sample, in standard deviations, beyond which a Gaussian is too small for a
/// value: 10⁻⁴ of its peak.
const LAST_VALUE: f32 = 4.29;

/// After so many successive sheets that show something, the next one is taken to do so too, and not
/// looked up.
const SURE: u8 = 4;
/// Number of sheets looked up at once.
const LOOKED_UP: usize = 8;

/// What a packet keeps from one sheet to the next: the last plane that it evaluated, and the
/// visibility of the sheets ahead.
#[derive(Clone, Copy)]
pub struct Last<S: Simd> {
    plane: usize,
    on: OnPlane<S>,
    /// The gradient of a linear field, and the plane where it was evaluated.
    far_gradient: [Lanes<S>; 3],
    far_plane: usize,
    /// The first of the looked-up sheets, and for each sheet a bit for each ray on which something
    /// may be visible.
    first: usize,
    shows: [u8; LOOKED_UP],
    /// The number of successive sheets that showed something until the last one.
    shown: u8,
}

/// The field on a plane.
#[derive(Clone, Copy)]
struct OnPlane<S: Simd> {
    face: Face<S>,
    /// The gradient in view space, in entries per thickness of a sheet.
    gradient: [Lanes<S>; 3],
    /// The change along the rays per world unit.
    along: Lanes<S>,
    weight: Lanes<S>,
}

impl<S: Simd> OnPlane<S> {
    /// Copies another one vector by vector. At once, the copy would wait until all are written.
    #[inline(always)]
    fn set(&mut self, other: &Self) {
        self.face.set(&other.face);
        self.gradient[0] = other.gradient[0];
        self.gradient[1] = other.gradient[1];
        self.gradient[2] = other.gradient[2];
        self.along = other.along;
        self.weight = other.weight;
    }
}

impl<S: Simd> Last<S> {
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        let none = Lanes::splat(simd, 0.0);
        let face = Face { value: none, across: [none; 3] };
        Self {
            plane: usize::MAX,
            on: OnPlane { face, gradient: [none; 3], along: none, weight: none },
            far_gradient: [none; 3],
            far_plane: usize::MAX,
            first: usize::MAX - LOOKED_UP,
            shows: [0; LOOKED_UP],
            shown: 0,
        }
    }
}

/// Returns the squared distance of places from the box of the samples, in steps.
#[inline(always)]
fn outside2<S: Simd>(simd: S, plan: &Plan, place: [Lanes<S>; 3]) -> Lanes<S> {
    let none = Lanes::splat(simd, 0.0);
    let outside = three!(I => {
        (plan.field.low[I] - place[I]).max(place[I] - plan.field.high[I]).max(none)
    });
    dot(outside, outside)
}

impl<S: Simd> Face<S> {
    /// Returns this face if it has a value. Otherwise returns the mean of the sheet, with the
    /// gradient of the other face if that one has a value.
    #[inline(always)]
    fn or(
        self,
        simd: S,
        has_own: mask32x8<S>,
        mean: Lanes<S>,
        other: &Self,
        has_other: mask32x8<S>,
    ) -> Self {
        let none = Lanes::splat(simd, 0.0);
        let across =
            three!(I => has_own.select(self.across[I], has_other.select(other.across[I], none)));
        Self { value: has_own.select(self.value, mean), across }
    }
}

impl Gather<'_> {
    /// Returns the field of a sheet and the rays on which it counts, or `None` if it is invisible.
    #[inline(always)]
    pub fn layer<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        sheet: usize,
        marks: &[u64],
        last: &mut Last<S>,
    ) -> Option<(Layer<S>, mask32x8<S>)> {
        let (plan, rays, pixels) = (self.plan, packet.rays_in(self.plan), &packet.pixels);
        let (start, stop) = (plan.planes[sheet], plan.planes[sheet + 1]);
        let begin = rays.inside[0].max(Lanes::splat(simd, start));
        let end = rays.inside[1].min(Lanes::splat(simd, stop));
        let mut mask = begin.simd_lt(end) & pixels.through.simd_ge(OPAQUE);
        if !mask.any_true() {
            return None;
        }
        let shown = std::mem::take(&mut last.shown);
        if shown < SURE {
            mask &= self.showing(simd, rays, sheet, marks, last);
            if !mask.any_true() {
                return None;
            }
        }
        if self.is_label_map {
            let layer = self.label_layer(simd, rays, [start, stop], [begin, end]);
            return self.may_show(simd, &layer).then_some((layer, mask));
        }
        let found = self.sheet(simd, packet, sheet, ([begin, end], mask), last)?;
        if !self.is_blended && plan.optics != Optics::Maximum {
            last.shown = shown.saturating_add(1);
        }
        Some(found)
    }

    /// Returns the field of a sheet between two distances, at the rays of a mask, and the rays on
    /// which it counts; `None` if it is invisible.
    #[inline(always)]
    fn sheet<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        sheet: usize,
        ([begin, end], mask): ([Lanes<S>; 2], mask32x8<S>),
        last: &mut Last<S>,
    ) -> Option<(Layer<S>, mask32x8<S>)> {
        let (plan, rays, pixels) = (self.plan, packet.rays_in(self.plan), &packet.pixels);
        let (start, stop) = (plan.planes[sheet], plan.planes[sheet + 1]);
        let front = if last.plane == sheet { last.on } else { self.on_plane(simd, rays, sheet) };
        let back = self.on_plane(simd, rays, sheet + 1);
        last.plane = sheet + 1;
        last.on.set(&back);
        let weights = [front.weight, back.weight];
        let (thickness, none) = (stop - start, Lanes::splat(simd, 0.0));
        let sum = front.face.value + back.face.value;
        // Hermite interpolation: the mean of the ends, plus an eighth of the difference of the
        // slopes there.
        let bend = (front.along - back.along) * thickness;
        let middle = sum * 0.5 + bend * 0.125;
        let of_sheet = [Lanes::splat(simd, start), Lanes::splat(simd, thickness)];
        let faces = [front.face, back.face];
        let mut layer = Layer::new(simd, rays.direction, faces, middle, of_sheet, [begin, end]);
        if self.parts > 1 {
            let mask = mask & self.fill_thick(simd, rays, weights, &mut layer);
            return (self.may_show(simd, &layer) && mask.any_true()).then_some((layer, mask));
        }
        let has_gaps =
            self.is_blended && (mask & weights[0].min(weights[1]).simd_le(0.0)).any_true();
        layer.weight = mask.select(self.weight(simd, &layer) * pixels.through, none);
        if !has_gaps && !layer.weight.simd_gt(0.0).any_true() {
            return None;
        }
        let is_bent = self.is_bent([&front, &back], bend, &layer, mask);
        if self.has_far_gradient {
            self.refine_linear(simd, rays, (sheet, is_bent), last, &mut layer);
            return Some((layer, mask));
        }
        if !has_gaps && !is_bent {
            return Some((layer, mask));
        }
        let mut inside = Point::none(simd);
        self.at(simd, rays, 0.5 * (start + stop), &mut inside);
        let sections = [front.gradient, self.gradient(&inside.slopes), back.gradient];
        if self.is_blended {
            let mask = mask & layer.blend(simd, plan, bend, weights, &inside);
            layer.set_sections(simd, plan, sections, [weights[0], inside.weight, weights[1]]);
            layer.weight = mask.select(self.weight(simd, &layer) * pixels.through, none);
            return layer.weight.simd_gt(0.0).any_true().then_some((layer, mask));
        }
        layer.sections = plan.has_gradients().then_some(sections);
        // The mean of the sheet is exact for fields of the fifth degree (Simpson's rule with
        // slopes).
        let inside = inside.value * plan.field.values.per_value;
        let mean = (sum * 7.0 + inside * 16.0) * (1.0 / 30.0) + bend * (1.0 / 60.0);
        layer.middle = mean * 1.5 - sum * 0.25;
        Some((layer, mask))
    }

    /// Sets the mean of a sheet of a linear field if it is bent, and the gradients in as much
    /// detail as the light of the sheet counts.
    #[inline(always)]
    fn refine_linear<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        (sheet, is_bent): (usize, bool),
        last: &mut Last<S>,
        layer: &mut Layer<S>,
    ) {
        let (start, stop) = (self.plan.planes[sheet], self.plan.planes[sheet + 1]);
        if is_bent || !self.plan.is_integrated {
            // Kinks may lie anywhere: Simpson's rule in both halves.
            let mut inside = Lanes::splat(simd, 0.0);
            let mut point = Point::none(simd);
            for (place, weight) in [(0.25, 4.0), (0.5, 2.0), (0.75, 4.0)] {
                self.at(simd, rays, (stop - start).mul_add(place, start), &mut point);
                inside = point.value.mul_add(Lanes::splat(simd, weight), inside);
            }
            let sum = layer.front.value + layer.back.value;
            let mean = (sum + inside * self.plan.field.values.per_value) * (1.0 / 12.0);
            layer.middle = mean * 1.5 - sum * 0.25;
        }
        if !self.plan.has_gradients() {
            return;
        }
        let middle = self.far_gradient(simd, rays, 0.5 * (start + stop));
        if !layer.weight.simd_gt(FAINT).any_true() {
            layer.sections = Some([middle; 3]);
            return;
        }
        let front = if last.far_plane == sheet {
            last.far_gradient
        } else {
            self.far_gradient(simd, rays, start)
        };
        let back = self.far_gradient(simd, rays, stop);
        (last.far_gradient, last.far_plane) = (back, sheet + 1);
        layer.sections = Some([front, middle, back]);
    }

    /// Returns the gradient of a linear field at a distance along rays.
    #[inline(always)]
    fn far_gradient<S: Simd>(&self, simd: S, rays: &Rays<S>, distance: f32) -> [Lanes<S>; 3] {
        let level = &self.levels[0];
        self.gradient(&level.slopes(simd, level.place(rays.place(distance))))
    }

    /// Returns the rays on which something may be visible in a sheet.
    #[inline(always)]
    fn showing<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        sheet: usize,
        marks: &[u64],
        last: &mut Last<S>,
    ) -> mask32x8<S> {
        if !(last.first..last.first + LOOKED_UP).contains(&sheet) {
            self.look_up(simd, rays, sheet, marks, last);
        }
        mask32x8::from_bitmask(simd, last.shows[sheet - last.first].into())
    }

    /// Returns the sheet of a label map: the label in the middle of the part of the rays that
    /// counts, with the gradient of its mask.
    #[inline(always)]
    fn label_layer<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        [start, stop]: [f32; 2],
        [begin, end]: [Lanes<S>; 2],
    ) -> Layer<S> {
        let none = Lanes::splat(simd, 0.0);
        let place = rays.places((begin + end) * 0.5);
        let mut point = Point::none(simd);
        self.at_place(simd, rays, place, &mut point);
        let value = point.value * self.plan.field.values.per_value;
        let face = Face { value, across: [none; 3] };
        let of_sheet = [start, stop - start].map(
            #[inline(always)]
            |distance| Lanes::splat(simd, distance),
        );
        let mut layer = Layer::new(simd, rays.direction, [face; 2], value, of_sheet, [begin, end]);
        if self.plan.has_gradients() {
            layer.sections = Some([self.gradient(&point.slopes); 3]);
        }
        layer
    }

    /// Whether the field in a sheet differs from what its faces show, by so much that it counts for
    /// the share of the light that the sheet takes. `bend` is the difference of the slopes at the
    /// faces, in entries of the table per sheet.
    #[inline(always)]
    fn is_bent<S: Simd>(
        &self,
        [front, back]: [&OnPlane<S>; 2],
        bend: Lanes<S>,
        layer: &Layer<S>,
        mask: mask32x8<S>,
    ) -> bool {
        let mut most = bend.abs();
        if self.plan.has_gradients() {
            // A step in the middle of the sheet has equal slopes at both faces.
            let chord = back.face.value - front.face.value;
            most = most.max((chord - (front.along + back.along) * layer.thickness * 0.5).abs());
        }
        if self.plan.has_gradients() && !self.has_far_gradient {
            // Gradients are per thickness of a sheet.
            let turn = three!(I => (back.gradient[I] - front.gradient[I]).abs());
            most = most.max(turn[0].max(turn[1]).max(turn[2]));
        }
        ((most * layer.weight).simd_gt(STRAIGHT) | (most.simd_gt(BENT) & mask)).any_true()
    }

    /// Returns about the share of the light that a sheet takes of the light that reaches it: 0 only
    /// if no value that it may have is visible. It is 1 where more than the light counts.
    #[inline(always)]
    fn weight<S: Simd>(&self, simd: S, layer: &Layer<S>) -> Lanes<S> {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let plan = self.plan;
        if plan.optics == Optics::Maximum {
            return one;
        }
        let depth = self.visible.depth(simd, plan, layer);
        if plan.isosurfaces > 0 || plan.has_gradient_opacity {
            return depth.simd_gt(none).select(one, none);
        }
        depth.min(one)
    }

    /// Whether any value that a sheet may have counts in the picture.
    #[inline(always)]
    fn may_show<S: Simd>(&self, simd: S, layer: &Layer<S>) -> bool {
        self.plan.optics == Optics::Maximum || self.visible.may_show(simd, self.plan, layer)
    }

    /// Sets the mean of a sheet with several parts, and returns where it has one. A place is
    /// weighted by the sum of the kernels there; an end without a value takes the mean. `weights`
    /// are those at the ends.
    #[inline(always)]
    fn fill_thick<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        weights: [Lanes<S>; 2],
        layer: &mut Layer<S>,
    ) -> mask32x8<S> {
        // Hardly any picture has such sheets.
        apart(
            simd,
            #[inline(always)]
            || self.fill_parts(simd, rays, weights, layer),
        )
    }

    /// The code of [`fill_thick`](Self::fill_thick).
    #[inline(always)]
    fn fill_parts<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        weights: [Lanes<S>; 2],
        layer: &mut Layer<S>,
    ) -> mask32x8<S> {
        let plan = self.plan;
        let none = Lanes::splat(simd, 0.0);
        let start = layer.start;
        let stop = start + layer.thickness;
        let (mut from, mut to) = (start, stop);
        if self.is_blended || self.ends.is_some() {
            let reach = if self.is_blended { MOST_TAPS as f32 } else { BEYOND };
            let [enter, leave] = rays.in_lattice(simd, plan, reach);
            (from, to) = (enter.max(start).min(stop), leave.min(stop).max(start));
        }
        let least = plan.field.least_sum;
        let step = (to - from) * (1.0 / self.parts as f32);
        let (mut sum, mut all) = (none, none);
        let mut point = Point::none(simd);
        for part in 0..self.parts {
            for place in GAUSS {
                let place = rays.places(step.mul_add(place + part as f32, from));
                self.at_place(simd, rays, place, &mut point);
                let weight = if self.is_blended {
                    point.weight.simd_gt(0.0).select(point.weight + least, none)
                } else {
                    self.kernels_at(simd, place)
                };
                sum = weight.mul_add(point.value, sum);
                all += weight;
            }
        }
        let mean =
            sum / all.max(Lanes::splat(simd, f32::MIN_POSITIVE)) * plan.field.values.per_value;
        let (front, back) = (layer.front, layer.back);
        let has_value = if self.is_blended {
            each!([0, 1], I => weights[I].simd_gt(0.0))
        } else if let Some(per_deviation) = self.ends {
            let most = (LAST_VALUE / per_deviation).powi(2);
            let ends = [layer.start, layer.start + layer.thickness];
            each!([0, 1], I => outside2(simd, plan, rays.places(ends[I])).simd_le(most))
        } else {
            [mask32x8::splat(simd, true); 2]
        };
        layer.front = front.or(simd, has_value[0], mean, &back, has_value[1]);
        layer.back = back.or(simd, has_value[1], mean, &front, has_value[0]);
        layer.middle = mean * 1.5 - (layer.front.value + layer.back.value) * 0.25;
        let per_thickness = step * 0.5 / layer.thickness;
        if self.is_blended {
            (all * per_thickness).simd_gt(least)
        } else {
            mask32x8::splat(simd, true)
        }
    }

    /// Returns the sum of a lattice's kernels at a place, relative to their sum far from the
    /// borders.
    #[inline(always)]
    fn kernels_at<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> Lanes<S> {
        let mut all = Lanes::splat(simd, 1.0);
        let Some(per_deviation) = self.ends else { return all };
        let field = &self.plan.field;
        let ends = field.low.iter().zip(field.high);
        for (place, (low, high)) in place.into_iter().zip(ends) {
            let after = place - *low;
            let before = high - place;
            let near = after.min(before);
            if near.simd_lt(BEYOND).any_true() {
                // Treats the sum of kernels as an integral that ends half a step beyond the last
                // sample.
                all *= normal_cdf(simd, (after + 0.5) * per_deviation)
                    * normal_cdf(simd, (before + 0.5) * per_deviation);
            }
        }
        all
    }

    /// Looks up the visibility of a sheet and of those behind it. Many are looked up at once,
    /// because a lookup takes longer than adding one more.
    #[inline(always)]
    fn look_up<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        first: usize,
        marks: &[u64],
        last: &mut Last<S>,
    ) {
        let plan = self.plan;
        last.first = first;
        last.shows = [0; LOOKED_UP];
        // The result for the plane behind the previous sheet.
        let mut behind = None;
        for (sheet, shows) in (first..=plan.sheets).zip(&mut last.shows) {
            if !is_marked(marks, sheet) {
                behind = None;
                continue;
            }
            let (start, stop) = (plan.planes[sheet], plan.planes[sheet + 1]);
            let bits;
            if self.lookups == 0 {
                bits = self.shows(simd, rays.place(0.5 * (start + stop)));
            } else {
                let mut some = behind.unwrap_or_else(
                    #[inline(always)]
                    || self.shows(simd, rays.place(start)),
                );
                for number in 1..self.lookups {
                    let part = number as f32 / self.lookups as f32;
                    some |= self.shows(simd, rays.place(start + (stop - start) * part));
                }
                let next = self.shows(simd, rays.place(stop));
                behind = Some(next);
                bits = some | next;
            }
            *shows = bits as u8;
        }
    }

    /// Returns where something may be visible around places in steps of the lattice, a bit for each
    /// lane.
    #[inline(always)]
    fn shows<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> u64 {
        let mut shows = 0;
        for level in &self.levels {
            shows |= level.visible_samples.at(simd, level.cell(place));
        }
        shows
    }

    /// Sets a point to the field at a distance along rays, and its change per step of the lattice
    /// along each axis.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, rays: &Rays<S>, distance: f32, point: &mut Point<S>) {
        self.at_place(simd, rays, rays.place(distance), point);
    }

    /// Does the same at places on rays, in steps of the lattice.
    #[inline(always)]
    fn at_place<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        place: [Lanes<S>; 3],
        point: &mut Point<S>,
    ) {
        point.weight = Lanes::splat(simd, 1.0);
        match &self.levels[..] {
            [level] if level.grid.is_none() => {
                level.at(simd, level.place(place), &rays.way, point);
            }
            levels => simd.vectorize(
                #[inline(always)]
                || point.set(self.mean(simd, levels, place, &rays.way)),
            ),
        }
    }

    /// Returns the average of the levels of a volume in bricks, weighted by their shares. A level
    /// without a brick at a place has no share there. If no level has a brick, nothing is visible.
    #[inline(always)]
    fn mean<S: Simd>(
        &self,
        simd: S,
        levels: &[Level],
        place: [Lanes<S>; 3],
        way: &[Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let mut point = Point::none(simd);
        let (mut all, mut value, mut slopes, mut hidden) = (none, none, [none; 3], none);
        for level in levels {
            let Some(grid) = level.grid else { continue };
            let place = level.place(place);
            let (is_held, outside) = grid.held(simd, level.dims, place);
            hidden = outside - self.zero;
            if !is_held.any_true() {
                continue;
            }
            let share = is_held.select(Lanes::splat(simd, level.share), none);
            level.at(simd, place, way, &mut point);
            all += share;
            value = share.mul_add(point.value, value);
            slopes = three!(I => (share * level.scale[I]).mul_add(point.slopes[I], slopes[I]));
        }
        let inverse = Lanes::splat(simd, 1.0) / all.max(Lanes::splat(simd, f32::MIN_POSITIVE));
        let value = all.simd_gt(0.0).select(value * inverse, hidden);
        (value, three!(I => slopes[I] * inverse))
    }

    /// Evaluates the field on a plane.
    #[inline(always)]
    fn on_plane<S: Simd>(&self, simd: S, rays: &Rays<S>, plane: usize) -> OnPlane<S> {
        let field = &self.plan.field;
        let distance = self.plan.planes[plane];
        let mut point = Point::none(simd);
        self.at(simd, rays, distance, &mut point);
        let gradient = self.gradient(&point.slopes);
        let along = dot(gradient, rays.direction);
        let mut across = (gradient, along);
        if self.has_far_gradient && self.parts > 1 && self.plan.has_gradients() {
            let far = self.far_gradient(simd, rays, distance);
            across = (far, dot(far, rays.direction));
        }
        let across = three!(I => across.0[I] - across.1 * rays.direction[I]);
        let face = Face { value: point.value * field.values.per_value, across };
        let along = along * (1.0 / field.gradients.length);
        OnPlane { face, gradient, along, weight: point.weight }
    }

    /// Converts the field's change per step of the lattice to a gradient in view space, in entries
    /// per thickness of a sheet.
    #[inline(always)]
    fn gradient<S: Simd>(&self, slopes: &[Lanes<S>; 3]) -> [Lanes<S>; 3] {
        let field = &self.plan.field;
        let (axes, scale) = (field.axes, field.values.per_value * field.gradients.length);
        three!(I => {
            (slopes[0] * axes[0][I] + slopes[1] * axes[1][I] + slopes[2] * axes[2][I]) * scale
        })
    }
}

impl<S: Simd> Layer<S> {
    /// Sets the gradients at the front, in the middle and at the back. Pixels without a value at
    /// one of these places keep those of the faces.
    #[inline(always)]
    fn set_sections(
        &mut self,
        simd: S,
        plan: &Plan,
        sections: Sections<S>,
        weights: [Lanes<S>; 3],
    ) {
        if !plan.has_gradients() {
            return;
        }
        let [front, middle, back] = weights;
        let has_all = front.min(middle).min(back).simd_gt(0.0);
        let of_faces = three!(I => {
            plan.gradient_of_faces(self, Lanes::splat(simd, [0.0, 0.5, 1.0][I]))
        });
        let exact = sections;
        self.sections = Some(three!(P => {
            three!(I => has_all.select(exact[P][I], of_faces[P][I]))
        }));
    }

    /// Sets the mean of the sheet, weighting the field by the sum of the kernels. Missing values
    /// are replaced by the others. Returns where there is a field. `weights` are those at the
    /// faces, `inside` is the field in the middle, `bend` the difference of the slopes at the
    /// faces.
    #[inline(always)]
    fn blend(
        &mut self,
        simd: S,
        plan: &Plan,
        bend: Lanes<S>,
        [front, back]: [Lanes<S>; 2],
        inside: &Point<S>,
    ) -> mask32x8<S> {
        let none = Lanes::splat(simd, 0.0);
        let least = plan.field.least_sum;
        let [has_front, has_inside, has_back] = [front, inside.weight, back].map(
            #[inline(always)]
            |weight| weight.simd_gt(0.0),
        );
        let values =
            [self.front.value, inside.value * plan.field.values.per_value, self.back.value];
        // Simpson's rule for the sums of weights and of values. A place without a value does not
        // count.
        let shares = [
            has_front.select(front + least, none) * (1.0 / 6.0),
            has_inside.select(inside.weight + least, none) * (4.0 / 6.0),
            has_back.select(back + least, none) * (1.0 / 6.0),
        ];
        let weight = shares[0] + shares[1] + shares[2];
        let value = shares[0] * values[0] + shares[1] * values[1] + shares[2] * values[2];
        let weighted = value / weight.max(Lanes::splat(simd, 1e-20));
        // Where there are all values, the rule with slopes is better.
        let sum = values[0] + values[2];
        let plain = (sum + values[1] * 4.0) * (1.0 / 6.0);
        let smooth = (sum * 7.0 + values[1] * 16.0) * (1.0 / 30.0) + bend * (1.0 / 60.0);
        let has_all = has_front & has_inside & has_back;
        let mean = has_all.select(weighted + (smooth - plain), weighted);
        let (front, back) = (self.front, self.back);
        self.front = front.or(simd, has_front, mean, &back, has_back);
        self.back = back.or(simd, has_back, mean, &front, has_front);
        self.middle = mean * 1.5 - (self.front.value + self.back.value) * 0.25;
        weight.simd_gt(least)
    }
}
