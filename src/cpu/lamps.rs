//! The light that reaches eight places, and what a surface there reflects. `src/reference/shade.rs`
//! has the definition; shaders/shared/lamps.wgsl does the same.

use super::{
    layer::Layer,
    plan::Plan,
    rays::Rays,
    vector::{self, Lanes, columns, dot, dot_with, each, four, three},
};
use crate::plan::{
    frame::{Light, Sides},
    lamps::{Affine, Lamps, Openness, ShadowMap},
};
use fearless_simd::{Simd, f32x4, prelude::*};
use glam::Vec3;

/// A shorter gradient has no direction.
const LEAST_GRADIENT: f32 = 1e-20;

/// The light that reaches eight places.
#[derive(Clone, Copy)]
pub struct Reaching<S: Simd> {
    /// The mean direction of the light from all sides, in view space, and its amount.
    open: [Lanes<S>; 4],
    /// The share of the key lamp's light.
    key: Lanes<S>,
}

/// The light that reaches eight places at the front of a sheet, and at its back.
#[derive(Clone, Copy)]
pub struct ReachingSheet<S: Simd>([Reaching<S>; 2]);

impl<S: Simd> ReachingSheet<S> {
    /// Returns the light at places in the sheet, from 0 at its front to 1 at its back.
    #[inline(always)]
    pub fn at(&self, place: Lanes<S>) -> Reaching<S> {
        let [front, back] = &self.0;
        let mixed = |front: Lanes<S>, back: Lanes<S>| (back - front).mul_add(place, front);
        Reaching {
            open: four!(I => mixed(front.open[I], back.open[I])),
            key: mixed(front.key, back.key),
        }
    }
}

impl<S: Simd> Reaching<S> {
    /// Nothing keeps light away.
    #[inline(always)]
    pub fn all(simd: S) -> Self {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        Self { open: [none, none, none, one], key: one }
    }

    /// Returns the light at distances along rays, a little before a surface with a normal.
    #[inline(always)]
    fn at(
        simd: S,
        plan: &Plan,
        rays: &Rays<S>,
        distance: Lanes<S>,
        Turned { normal, certainty, .. }: &Turned<S>,
    ) -> Self {
        let mut reaching = Self::all(simd);
        let Some(lamps) = &plan.lamps else { return reaching };
        let place = if plan.view.perspective {
            three!(I => rays.direction[I] * distance)
        } else {
            [rays.aside[0], rays.aside[1], distance]
        };
        let out = three!(I => {
            (normal[I] + rays.direction[I]).mul_add(*certainty, -rays.direction[I])
        });
        let before = |step: f32| three!(I => out[I].mul_add(step, place[I]));
        if let Some(open) = &lamps.shadows.open {
            let place = moved(&lamps.to_open, before(lamps.open_step));
            let [x, y, z, amount] = open_at(simd, open, place);
            let side = three!(I => dot_with(lamps.rotation[I], [x, y, z]));
            reaching.open = [side[0], side[1], side[2], amount];
        }
        if let Some(map) = &lamps.shadows.key {
            reaching.key = key_at(simd, map, moved(&lamps.to_key, before(lamps.key_step)));
        }
        reaching
    }
}

#[inline(always)]
fn moved<S: Simd>(to: &Affine, place: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    three!(I => {
        let [x, y, z, start] = to[I];
        dot_with([x, y, z], place) + start
    })
}

/// Returns the first node, its number and the places between it and the next ones.
#[inline(always)]
fn between<S: Simd>(
    simd: S,
    place: [Lanes<S>; 3],
    most: [f32; 3],
) -> ([[f32; 8]; 3], [[f32; 8]; 3]) {
    let none = Lanes::splat(simd, 0.0);
    let place = three!(I => place[I].max(none).min(Lanes::splat(simd, most[I])));
    let whole = three!(I => place[I].floor().min(Lanes::splat(simd, most[I] - 1.0)));
    let part = three!(I => (place[I] - whole[I]).into());
    (three!(I => whole[I].into()), part)
}

/// Returns the light from all sides at places, linear between nodes.
#[inline(always)]
fn open_at<S: Simd>(simd: S, open: &Openness, place: [Lanes<S>; 3]) -> [Lanes<S>; 4] {
    let [width, height, depth] = open.place.size;
    let most = [width, height, depth].map(|side| (side - 1) as f32);
    let (whole, part) = between(simd, place, most);
    let load = |at: usize| -> f32x4<S> { open.nodes[at].simd_into(simd) };
    columns(
        simd,
        each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
            let [i, j, k] = three!(I => whole[I][L] as usize);
            let [u, v, w] = three!(I => part[I][L]);
            let first = (k * height + j) * width + i;
            let row = |at: usize| {
                let left = load(at);
                (load(at + 1) - left).mul_add(f32x4::splat(simd, u), left)
            };
            let slice = |at: usize| {
                let above = row(at);
                (row(at + width) - above).mul_add(f32x4::splat(simd, v), above)
            };
            let near = slice(first);
            (slice(first + width * height) - near).mul_add(f32x4::splat(simd, w), near)
        }),
    )
}

/// Returns the share of the key lamp's light at places, linear between pixels and planes.
#[inline(always)]
fn key_at<S: Simd>(simd: S, map: &ShadowMap, place: [Lanes<S>; 3]) -> Lanes<S> {
    let size = map.view.size as usize;
    let (whole, part) = between(simd, place, [(size - 1) as f32, (size - 1) as f32, size as f32]);
    let share: [f32; 8] = each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
        let [i, j, k] = three!(I => whole[I][L] as usize);
        let [u, v, w] = three!(I => part[I][L]);
        let along = |pixel: usize| {
            let at = pixel * (size + 1) + k;
            let (near, far) = (f32::from(map.light[at]), f32::from(map.light[at + 1]));
            (far - near).mul_add(w, near)
        };
        let row = |pixel: usize| {
            let left = along(pixel);
            (along(pixel + 1) - left).mul_add(u, left)
        };
        let above = row(j * size + i);
        (row((j + 1) * size + i) - above).mul_add(v, above)
    });
    let share: Lanes<S> = share.simd_into(simd);
    share * (1.0 / 255.0)
}

/// How a normal lies to the light.
struct Turned<S: Simd> {
    /// The normal, of length 1, towards the eye.
    normal: [Lanes<S>; 3],
    /// The magnitude of the cosine to the ray.
    facing: Lanes<S>,
    /// How far the direction counts.
    certainty: Lanes<S>,
}

impl<S: Simd> Turned<S> {
    /// `low` is a magnitude up to which the normal does not count, and `per_magnitude` is one over
    /// the magnitudes over which it comes to count in full. `share` is a factor on that.
    #[inline(always)]
    fn new(
        simd: S,
        normal: [Lanes<S>; 3],
        direction: [Lanes<S>; 3],
        [low, per_magnitude]: [f32; 2],
        share: Option<Lanes<S>>,
    ) -> Self {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let size = dot(normal, normal).sqrt();
        let certainty = ((size - low) * per_magnitude).max(none).min(one);
        let certainty = share.map_or(certainty, |share| certainty * share);
        let certainty = size.simd_gt(LEAST_GRADIENT).select(certainty, none);
        let inverse = one / size.max(Lanes::splat(simd, LEAST_GRADIENT));
        let cosine = dot(normal, direction) * inverse;
        let towards = cosine.simd_gt(0.0).select(-inverse, inverse);
        let facing = cosine.abs().min(one);
        Self { normal: three!(I => normal[I] * towards), facing, certainty }
    }

    /// Returns the share of the light from the eye and from beside it that a surface gets, and the
    /// cosine of its highlight.
    #[inline(always)]
    fn lit_by_sides(&self, simd: S, Sides { eye, lamp, half }: Sides) -> [Lanes<S>; 2] {
        if half == Vec3::ZERO {
            return [self.facing; 2];
        }
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let towards = dot_with(lamp.to_array(), self.normal).max(none);
        // A surface that is seen from its edge may be turned to the eye by either side.
        let counts = (self.facing * 10.0).min(one);
        let light = self.facing.mul_add(eye, towards * counts).min(one);
        [light, dot_with(half.to_array(), self.normal).min(one)]
    }

    /// Returns the factor on a colour, and the highlight that is added to it (Blinn 1977). `eye`
    /// has the share of the light from the eye, and the cosine of its highlight to the power.
    #[inline(always)]
    fn light(
        &self,
        simd: S,
        (Light { ambient, diffuse, specular, power }, eye): (Light, [Lanes<S>; 2]),
        lamps: Option<&Lamps>,
        (direction, reaching): (&[Lanes<S>; 3], &Reaching<S>),
    ) -> [Lanes<S>; 2] {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let certain = self.certainty;
        let least = Lanes::splat(simd, 1e-6);
        let shown = |cosine: Lanes<S>| one - certain * (one - cosine);
        let highlight = eye[1] * certain * specular;
        let Some(lamps) = lamps else {
            return [shown(eye[0]) * diffuse + ambient, highlight];
        };
        let [x, y, z, amount] = reaching.open;
        let open = amount + certain * dot([x, y, z], self.normal) * 2.0;
        // In the open there is no more.
        let most = certain.mul_add(dot_with(lamps.sky_side, self.normal) * 2.0, one);
        let open = open.min(most).max(none);
        let mut factor = open * ((shown(eye[0]) * lamps.head + lamps.sky) * diffuse + ambient);
        let mut highlight = highlight * open * lamps.head;
        if lamps.key > 0.0 {
            let towards = lamps.key_direction;
            let cosine = dot_with(towards, self.normal).max(none).min(one);
            let half = three!(I => towards[I] - direction[I]);
            let inverse = one / dot(half, half).sqrt().max(least);
            let middle = (dot(half, self.normal) * inverse).max(least).min(one);
            let share = reaching.key * lamps.key;
            factor += share * shown(cosine) * diffuse;
            let gloss = vector::power(simd, middle, power) * certain * specular;
            highlight += cosine.simd_gt(0.0).select(share * gloss, none);
        }
        [factor, highlight]
    }
}

impl Plan<'_> {
    /// Returns a lit colour of a surface at distances along rays. A normal may have any length.
    #[inline(always)]
    pub fn lit_surface<S: Simd>(
        &self,
        simd: S,
        color: [Lanes<S>; 3],
        normal: [Lanes<S>; 3],
        (rays, distance): (&Rays<S>, Lanes<S>),
    ) -> [Lanes<S>; 3] {
        // From the smallest length on.
        let turned = Turned::new(simd, normal, rays.direction, [0.0, 1e30], None);
        let reaching = Reaching::at(simd, self, rays, distance, &turned);
        let on = (&rays.direction, &reaching);
        let [share, cosine] = turned.lit_by_sides(simd, self.frame.surface_sides);
        let light = self.frame.surface_light;
        let light = (light, [share, gloss(simd, [cosine], light.power)[0]]);
        let [share, highlight] = turned.light(simd, light, self.lamps.as_ref(), on);
        with_light(simd, color, share, highlight)
    }

    /// Returns the light that reaches a sheet of the field.
    #[inline(always)]
    pub fn reaching<S: Simd>(&self, simd: S, layer: &Layer<S>, rays: &Rays<S>) -> ReachingSheet<S> {
        if self.lamps.is_none() || !self.is_lit {
            return ReachingSheet([Reaching::all(simd); 2]);
        }
        let gradient = self.towards_eye(simd, layer);
        let turned = Turned::new(simd, gradient, layer.direction, self.certain(), layer.share);
        let at = |distance| Reaching::at(simd, self, rays, distance, &turned);
        ReachingSheet([at(layer.start), at(layer.start + layer.thickness)])
    }

    /// Returns the mean of the gradients at the front, in the middle and at the back of a sheet,
    /// each turned towards the eye. Where a thin shell begins and ends in the sheet, the gradient
    /// in the middle is short and may point anywhere.
    #[inline(always)]
    fn towards_eye<S: Simd>(&self, simd: S, layer: &Layer<S>) -> [Lanes<S>; 3] {
        let none = Lanes::splat(simd, 0.0);
        let mut sum = [none; 3];
        for place in [0.0, 0.5, 1.0] {
            let gradient = self.gradient(layer, Lanes::splat(simd, place));
            let is_away = dot(gradient, layer.direction).simd_gt(none);
            sum = three!(I => sum[I] + is_away.select(-gradient[I], gradient[I]));
        }
        three!(I => sum[I] * (1.0 / 3.0))
    }

    /// Returns the magnitude up to which gradients do not count, and one over the magnitudes over
    /// which they come to count in full.
    fn certain(&self) -> [f32; 2] {
        [self.field.certain_from, self.field.per_certain]
    }

    /// Returns a lit colour of the field. The gradient counts from the magnitudes on that are
    /// certain, in entries per thickness of a sheet; others are lit the less the shorter they are.
    /// With it comes how far it counts behind a clip.
    #[inline(always)]
    pub fn lit_field<S: Simd>(
        &self,
        simd: S,
        color: [Lanes<S>; 3],
        gradient: ([Lanes<S>; 3], Option<Lanes<S>>),
        on: ([Lanes<S>; 3], &Reaching<S>),
    ) -> [Lanes<S>; 3] {
        let (gradient, counts) = gradient;
        let turned = Turned::new(simd, gradient, on.0, self.certain(), counts);
        let light = self.field.light;
        let eye = [turned.facing, gloss(simd, [turned.facing], light.power)[0]];
        let on = (&on.0, on.1);
        let [share, highlight] = turned.light(simd, (light, eye), self.lamps.as_ref(), on);
        with_light(simd, color, share, highlight)
    }

    /// Returns a colour of the field in the mean of the lights at four places.
    #[inline(always)]
    pub fn lit_by_four<S: Simd>(
        &self,
        simd: S,
        color: [Lanes<S>; 3],
        (gradients, counts): ([[Lanes<S>; 3]; 4], Option<Lanes<S>>),
        (direction, reaching): ([Lanes<S>; 3], [Reaching<S>; 4]),
    ) -> [Lanes<S>; 3] {
        let light = self.field.light;
        let turned = four!(N => Turned::new(simd, gradients[N], direction, self.certain(), counts));
        let glosses = gloss(simd, four!(N => turned[N].facing), light.power);
        let lights = four!(N => {
            let eye = (light, [turned[N].facing, glosses[N]]);
            turned[N].light(simd, eye, self.lamps.as_ref(), (&direction, &reaching[N]))
        });
        let [share, highlight] = each!([0, 1], I => {
            ((lights[0][I] + lights[1][I]) + (lights[2][I] + lights[3][I])) * 0.25
        });
        with_light(simd, color, share, highlight)
    }
}

/// Returns the cosines of highlights to the light's power.
#[inline(always)]
fn gloss<S: Simd, const N: usize>(
    simd: S,
    mut cosines: [Lanes<S>; N],
    power: f32,
) -> [Lanes<S>; N] {
    for cosine in &mut cosines {
        *cosine = cosine.max(Lanes::splat(simd, 1e-6));
    }
    vector::powers(simd, cosines, power)
}

/// Returns a colour times a share of light, and a highlight.
#[inline(always)]
fn with_light<S: Simd>(
    simd: S,
    color: [Lanes<S>; 3],
    share: Lanes<S>,
    highlight: Lanes<S>,
) -> [Lanes<S>; 3] {
    three!(I => color[I].mul_add(share, highlight).min(Lanes::splat(simd, 1.0)))
}
