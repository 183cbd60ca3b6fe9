//! Tetrahedra with linear fields, integrated exactly along the rays.
//!
//! A ray crosses a tetrahedron between its entry and its exit; the field along it is linear. Each
//! tetrahedron adds its length and its integral to the sheets that it meets, and its values and
//! gradients at the ends to those sheets that begin or end with it. Nothing is sorted along a ray.

use super::{
    bins::BLOCK,
    close::{OPAQUE, Packet},
    layer::{Face, Layer},
    plan::Plan,
    rays::{HIGH, PACKETS, WIDE},
    vector::{Lanes, dot_with, each, three},
    visible::Visible,
};
use crate::{
    cells::{Place, Tetrahedra},
    math::View,
    parallel::prelude::*,
    plan::TILE,
    scene::Optics,
};
use fearless_simd::{Simd, mask32x8, prelude::*};
use glam::{Mat3, Vec3};

/// Sheets that are open at once.
const OPEN: usize = 8;
/// Tetrahedra that are looked at in one go.
const BATCH: usize = 16384;
/// A shorter part of a sheet holds no field, as a share of its thickness.
const LEAST_PART: f32 = 1e-4;
/// The same, as a share of the distance from the eye: rounding takes the rest.
const LEAST_LENGTH: f32 = 1e-6;
/// A ray whose distance from a face changes less runs along the face.
const PARALLEL: f32 = 1e-30;
/// A place behind all others.
const BEHIND: f32 = 3e38;
/// Pixels by which boxes are wider than the projected corners, for rounding.
const WIDER: f32 = 1e-2;

/// The tetrahedra that a view shows.
pub struct CellField<'a> {
    tetrahedra: &'a Tetrahedra,
    /// In view space, each with its value in entries of the table.
    points: Vec<[f32; 4]>,
    /// In view space, in entries of the table per unit of gradients; empty without light.
    gradients: Vec<[f32; 3]>,
    /// The visible ones, by their first sheet.
    shots: Vec<Shot>,
    /// Where the list of each block of tiles begins, and its shots.
    starts: Vec<u32>,
    listed: Vec<u32>,
    blocks: usize,
}

/// A tetrahedron as a view shows it.
#[derive(Clone, Copy)]
struct Shot {
    number: u32,
    /// The first and the last sheet.
    sheets: [u16; 2],
    /// The first and the last pixel, to the right and down.
    pixels: [[i32; 2]; 2],
}

/// The linear functions of a tetrahedron, each as three factors and a constant.
struct Linear {
    /// Functions that are 0 on the faces and positive inside. Those of two tetrahedra at a face
    /// differ in their sign only, to the last bit, so that no ray passes between the two.
    faces: [[f32; 4]; 4],
    /// Which of the two tetrahedra at a face this is: it has the rays that run in the face.
    has_face: [bool; 4],
    value: [f32; 4],
    /// The smallest and the largest value.
    range: [f32; 2],
    /// The smallest and the largest z.
    depths: [f32; 2],
    gradient: [[f32; 4]; 3],
}

impl<'a> CellField<'a> {
    /// `view` is the plan's as it is from the tetrahedra.
    pub fn new(plan: &Plan, view: &View, tetrahedra: &'a Tetrahedra, visible: &Visible) -> Self {
        let [zero, per_value] =
            [plan.field.values.zero, plan.field.values.per_value].map(f64::from);
        let entry = |value: f32| ((f64::from(value) - zero) * per_value) as f32;
        let of_points = tetrahedra.place() == Place::Points;
        let point = |(number, at): (usize, &Vec3)| {
            let [x, y, z] = view.to_view(tetrahedra.origin + at.as_dvec3()).as_vec3().to_array();
            [x, y, z, if of_points { entry(tetrahedra.values[number]) } else { 0.0 }]
        };
        let points: Vec<[f32; 4]> = tetrahedra.points.par_iter().enumerate().map(point).collect();
        let turn = view.rotation * (per_value * f64::from(plan.field.gradients.length));
        let turn: Mat3 = turn.as_mat3();
        let needs = plan.has_gradients() && of_points;
        let gradients = if needs { &tetrahedra.gradients[..] } else { &[] };
        let gradients =
            gradients.par_iter().map(|gradient| (turn * *gradient).to_array()).collect();
        let mut field = Self {
            tetrahedra,
            points,
            gradients,
            shots: Vec::new(),
            starts: Vec::new(),
            listed: Vec::new(),
            blocks: 0,
        };
        let batch = |batch: usize| -> Vec<Shot> {
            let numbers = batch * BATCH..((batch + 1) * BATCH).min(tetrahedra.len());
            let shows = |number: &usize| {
                let [low, high] = if of_points {
                    field.range(*number)
                } else {
                    [entry(tetrahedra.values[*number]); 2]
                };
                plan.optics == Optics::Maximum || visible.may_show_between(plan, low, high)
            };
            numbers.filter(shows).filter_map(|number| field.shot(plan, number)).collect()
        };
        let batches: Vec<Vec<Shot>> =
            (0..tetrahedra.len().div_ceil(BATCH)).into_par_iter().map(batch).collect();
        field.order(plan, &batches);
        field.list(plan);
        field
    }

    /// The number of tetrahedra in the picture.
    pub fn count(&self) -> u64 {
        self.shots.len() as u64
    }

    fn corners(&self, number: usize) -> [[f32; 4]; 4] {
        self.tetrahedra.corners[number].map(|corner| self.points[corner as usize])
    }

    fn range(&self, number: usize) -> [f32; 2] {
        let values = self.corners(number).map(|corner| corner[3]);
        [values.into_iter().fold(BEHIND, f32::min), values.into_iter().fold(-BEHIND, f32::max)]
    }

    /// Returns where a tetrahedron lies in the picture; `None` if it meets no ray.
    fn shot(&self, plan: &Plan, number: usize) -> Option<Shot> {
        let corners = self.corners(number);
        let depths = corners.map(|corner| corner[2]);
        let least = depths.into_iter().fold(BEHIND, f32::min);
        let (mut near, mut far) = (least, depths.into_iter().fold(-BEHIND, f32::max));
        let [width, height] = plan.view.size.map(|side| side as i32 - 1);
        let mut pixels = [[0, width], [0, height]];
        let is_ahead = !plan.view.perspective || least > 1e-6 * far.abs();
        if is_ahead {
            for (axis, pixels) in pixels.iter_mut().enumerate() {
                let place = |corner: &[f32; 4]| {
                    let aside = corner[axis];
                    let aside = if plan.view.perspective { aside / corner[2] } else { aside };
                    aside.mul_add(plan.frame.scale, plan.frame.center[axis])
                };
                let places = corners.each_ref().map(place);
                let low = places.into_iter().fold(BEHIND, f32::min) - WIDER;
                let high = places.into_iter().fold(-BEHIND, f32::max) + WIDER;
                // Casts saturate.
                pixels[0] = pixels[0].max((low - 0.5).ceil() as i32);
                pixels[1] = pixels[1].min((high - 0.5).floor() as i32);
            }
        }
        if pixels.iter().any(|[first, last]| first > last) {
            return None;
        }
        if plan.view.perspective {
            let place = |corner: &[f32; 4]| Vec3::new(corner[0], corner[1], corner[2]);
            let places = corners.each_ref().map(place);
            let middle = 0.25 * (places[0] + places[1] + places[2] + places[3]);
            let reach = places.map(|place| place.distance(middle)).into_iter().fold(0.0, f32::max);
            near = near.max((middle.length() - reach) * (1.0 - 1e-5));
            far = places.map(Vec3::length).into_iter().fold(0.0, f32::max) * (1.0 + 1e-6);
        }
        let [first, last] = [near, far].map(|distance| plan.sheet_of(distance));
        let sheets = [first.max(1) as u16, last as u16];
        (last > 0).then_some(Shot { number: number as u32, sheets, pixels })
    }

    /// Sorts the shots by first sheet; those of one sheet keep their order.
    fn order(&mut self, plan: &Plan, batches: &[Vec<Shot>]) {
        let mut places = vec![0; plan.sheets + 2];
        for shot in batches.iter().flatten() {
            places[usize::from(shot.sheets[0]) + 1] += 1;
        }
        for sheet in 1..places.len() {
            places[sheet] += places[sheet - 1];
        }
        let none = Shot { number: 0, sheets: [0; 2], pixels: [[0; 2]; 2] };
        self.shots = vec![none; places[plan.sheets + 1]];
        for shot in batches.iter().flatten() {
            let place = &mut places[usize::from(shot.sheets[0])];
            self.shots[*place] = *shot;
            *place += 1;
        }
    }

    /// Lists the shots that each block of tiles meets, by first sheet.
    fn list(&mut self, plan: &Plan) {
        const SIDE: i32 = (BLOCK * TILE) as i32;
        let [columns, rows] = plan.tiles().map(|tiles| tiles.div_ceil(BLOCK));
        self.blocks = columns;
        let met = |shot: &Shot| {
            let [across, down] = shot.pixels.map(|[first, last]| first / SIDE..=last / SIDE);
            down.flat_map(move |row| {
                across.clone().map(move |column| row as usize * columns + column as usize)
            })
        };
        let mut starts = vec![0; columns * rows + 1];
        self.shots.iter().flat_map(met).for_each(|block| starts[block + 1] += 1);
        for block in 1..starts.len() {
            starts[block] += starts[block - 1];
        }
        let mut places = starts.clone();
        self.listed = vec![0; starts[columns * rows] as usize];
        for (number, shot) in self.shots.iter().enumerate() {
            for block in met(shot) {
                self.listed[places[block] as usize] = number as u32;
                places[block] += 1;
            }
        }
        self.starts = starts;
    }

    /// Returns the shots that meet the tile with a first pixel, by first sheet.
    fn of_tile(&self, corner: [i32; 2]) -> Vec<u32> {
        const SIDE: i32 = (BLOCK * TILE) as i32;
        let [column, row] = corner.map(|first| (first / SIDE) as usize);
        let block = row * self.blocks + column;
        let range = self.starts[block] as usize..self.starts[block + 1] as usize;
        let meets = |number: &u32| {
            let pixels = self.shots[*number as usize].pixels;
            [0, 1].into_iter().all(|axis| {
                let [first, last] = pixels[axis];
                first < corner[axis] + TILE as i32 && last >= corner[axis]
            })
        };
        self.listed[range].iter().copied().filter(meets).collect()
    }

    /// Returns the linear functions of a tetrahedron; `None` if it is flat in 32 bits.
    #[inline(always)]
    fn linear(&self, number: u32) -> Option<Linear> {
        let corners = self.tetrahedra.corners[number as usize];
        let points = corners.map(|corner| self.points[corner as usize]);
        let places = points.map(|[x, y, z, _]| Vec3::new(x, y, z));
        let [a, b, c] = [places[1] - places[0], places[2] - places[0], places[3] - places[0]];
        let across = [b.cross(c), c.cross(a), a.cross(b)];
        let volume = a.dot(across[0]);
        let inverse = 1.0 / volume;
        if !inverse.is_finite() {
            return None;
        }
        let [one, two, three] = across.map(|normal| normal * inverse);
        let factors = [-(one + two + three), one, two, three];
        // From the middle, the constants lose the fewest digits.
        let middle = 0.25 * (places[0] + places[1] + places[2] + places[3]);
        let faces = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]].map(|face| {
            let [a, b, c] = face.map(|corner| places[corner]);
            let normal = (b - a).cross(c - a);
            normal.extend(-normal.dot((a + b + c) / 3.0))
        });
        let has_face = [false, true, false, true].map(|is_odd| is_odd == (volume > 0.0));
        let faces =
            [0, 1, 2, 3].map(|at| (if has_face[at] { faces[at] } else { -faces[at] }).into());
        let mean = 0.25 * (points[0][3] + points[1][3] + points[2][3] + points[3][3]);
        let slope = [0, 1, 2, 3].into_iter().map(|at| (points[at][3] - mean) * factors[at]);
        let slope: Vec3 = slope.sum();
        let values = points.map(|point| point[3]);
        let depths = points.map(|point| point[2]);
        let ends = |of: [f32; 4]| {
            [of.into_iter().fold(BEHIND, f32::min), of.into_iter().fold(-BEHIND, f32::max)]
        };
        let mut gradient = [[0.0; 4]; 3];
        if !self.gradients.is_empty() {
            let coordinates = factors.map(|factor| {
                let [x, y, z] = factor.to_array();
                [x, y, z, 0.25 - factor.dot(middle)]
            });
            let corner_gradients = corners.map(|corner| self.gradients[corner as usize]);
            for (axis, gradient) in gradient.iter_mut().enumerate() {
                for (corner_gradient, factors) in corner_gradients.iter().zip(&coordinates) {
                    for (sum, factor) in gradient.iter_mut().zip(factors) {
                        *sum += corner_gradient[axis] * factor;
                    }
                }
            }
        }
        Some(Linear {
            faces,
            has_face,
            value: [slope.x, slope.y, slope.z, mean - slope.dot(middle)],
            range: ends(values),
            depths: ends(depths),
            gradient,
        })
    }
}

/// The sums of tetrahedra in a sheet at eight pixels. Of values of tetrahedra, `integral` is the
/// optical depth, and `front` has the colours, weighted by it.
#[derive(Clone, Copy)]
struct Sum<S: Simd> {
    /// The length of the rays inside.
    covered: Lanes<S>,
    integral: Lanes<S>,
    begin: Lanes<S>,
    end: Lanes<S>,
    front: Face<S>,
    back: Face<S>,
}

impl<S: Simd> Sum<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let none = Lanes::splat(simd, 0.0);
        let face = Face { value: none, across: [none; 3] };
        Self {
            covered: none,
            integral: none,
            begin: Lanes::splat(simd, BEHIND),
            end: Lanes::splat(simd, -BEHIND),
            front: face,
            back: face,
        }
    }
}

/// A tetrahedron that is added to sheets.
struct Crossed<S: Simd> {
    linear: Linear,
    /// Its extinction times colour, and its extinction, if its value is the same everywhere.
    light: Option<[Lanes<S>; 4]>,
    /// The first and the last of the sheets.
    sheets: [usize; 2],
}

/// The tetrahedra of a tile that is being drawn.
pub struct CellTile<'a, S: Simd> {
    field: &'a CellField<'a>,
    corner: [i32; 2],
    /// The shots that have not begun, by first sheet.
    ahead: std::vec::IntoIter<u32>,
    /// The shots that reach further than the open sheets, each with the first sheet that it still
    /// is to be added to.
    continued: Vec<(u32, usize)>,
    sums: Box<[[Sum<S>; PACKETS]; OPEN]>,
    /// The packets with sums, by sheet.
    has_sums: [u8; OPEN],
    /// Where the last sheet of each packet ended, and the value there.
    last: [[Lanes<S>; 2]; PACKETS],
}

impl<'a, S: Simd> CellTile<'a, S> {
    /// Returns the tetrahedra of the tile with a first pixel; `None` if it has none.
    pub fn new(simd: S, field: &'a CellField<'a>, corner: [i32; 2]) -> Option<Self> {
        let shots = field.of_tile(corner);
        if shots.is_empty() {
            return None;
        }
        Some(Self {
            field,
            corner,
            ahead: shots.into_iter(),
            continued: Vec::new(),
            sums: Box::new([[Sum::new(simd); PACKETS]; OPEN]),
            has_sums: [0; OPEN],
            last: [[Lanes::splat(simd, -BEHIND); 2]; PACKETS],
        })
    }

    fn first(&self, shot: u32) -> usize {
        usize::from(self.field.shots[shot as usize].sheets[0])
    }

    /// Returns the next sheet, from `sheet` on, that something is to be added to, or that has sums;
    /// `usize::MAX` if there is none.
    pub fn next(&self, sheet: usize) -> usize {
        let begun = (sheet..sheet + OPEN).find(|sheet| self.has_sums[sheet % OPEN] != 0);
        let ahead = self.ahead.as_slice().first().map(|shot| self.first(*shot).max(sheet));
        let continued = self.continued.iter().map(|(_, next)| *next).min();
        [begun, ahead, continued].into_iter().flatten().min().unwrap_or(usize::MAX)
    }

    /// Adds the tetrahedra that begin at a sheet, and those that are continued there. Returns their
    /// number.
    #[inline(always)]
    pub fn add(
        &mut self,
        simd: S,
        plan: &Plan,
        sheet: usize,
        packets: &[Packet<S>; PACKETS],
    ) -> u64 {
        let mut added = 0;
        for at in 0..self.continued.len() {
            let (shot, next) = self.continued[at];
            if next == sheet {
                self.add_shot(simd, plan, shot, sheet, packets);
                self.continued[at].1 = sheet + OPEN;
                added += 1;
            }
        }
        let shots = &self.field.shots;
        self.continued.retain(|(shot, next)| usize::from(shots[*shot as usize].sheets[1]) >= *next);
        while let Some(shot) = self.ahead.as_slice().first().copied() {
            let sheets = self.field.shots[shot as usize].sheets;
            if usize::from(sheets[0]) > sheet {
                break;
            }
            self.ahead.next();
            self.add_shot(simd, plan, shot, sheet, packets);
            added += 1;
            if usize::from(sheets[1]) >= sheet + OPEN {
                self.continued.push((shot, sheet + OPEN));
            }
        }
        added
    }

    /// Adds a tetrahedron to the open sheets, of which `sheet` is the first.
    fn add_shot(
        &mut self,
        simd: S,
        plan: &Plan,
        shot: u32,
        sheet: usize,
        packets: &[Packet<S>; PACKETS],
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let shot = &self.field.shots[shot as usize];
                let Some(linear) = self.field.linear(shot.number) else { return };
                let light = match self.field.tetrahedra.place() {
                    Place::Points => None,
                    Place::Cells => Some(self.field.light(simd, plan, shot.number)),
                };
                let last = usize::from(shot.sheets[1]).min(sheet + OPEN - 1);
                let crossed = Crossed { linear, light, sheets: [sheet, last] };
                let [columns, rows] = each!([0, 1], AXIS => {
                    let [first, last] = shot.pixels[AXIS];
                    let side = [WIDE, HIGH][AXIS] as i32;
                    let place = |pixel: i32| ((pixel - self.corner[AXIS]) / side) as usize;
                    let end = self.corner[AXIS] + TILE as i32 - 1;
                    place(first.max(self.corner[AXIS]))..=place(last.min(end))
                });
                for row in rows {
                    for column in columns.clone() {
                        let packet = &packets[row * (TILE / WIDE) + column];
                        if !packet.is_done {
                            self.add_to(simd, plan, packet, &crossed);
                        }
                    }
                }
            },
        );
    }

    /// Adds a tetrahedron to the sheets of a packet.
    #[inline(always)]
    fn add_to(&mut self, simd: S, plan: &Plan, packet: &Packet<S>, crossed: &Crossed<S>) {
        let Crossed { linear, light, sheets: [first, last] } = crossed;
        let rays = &packet.rays;
        let [enter, leave] = linear.part(simd, plan, packet);
        let is_in = enter.simd_lt(leave) & packet.pixels.through.simd_ge(OPAQUE);
        if !is_in.any_true() {
            return;
        }
        let along = |of: [f32; 4]| {
            let base = rays.aside[0] * of[0] + rays.aside[1] * of[1] + of[3];
            let base = if plan.view.perspective { Lanes::splat(simd, of[3]) } else { base };
            [base, dot_with(of, rays.direction)]
        };
        let value = along(linear.value);
        let has_gradients = !self.field.gradients.is_empty();
        let gradient =
            if has_gradients { three!(I => along(linear.gradient[I])) } else { [value; 3] };
        let [low, high] = linear.range;
        for sheet in *first..=*last {
            let begin = enter.max(Lanes::splat(simd, plan.planes[sheet]));
            let end = leave.min(Lanes::splat(simd, plan.planes[sheet + 1]));
            let mask = is_in & begin.simd_lt(end);
            if !mask.any_true() {
                continue;
            }
            let sum = &mut self.sums[sheet % OPEN][packet.number];
            self.has_sums[sheet % OPEN] |= packet.bit();
            if let Some(light) = light {
                let end = mask.select(end, begin);
                sum.add_light(simd, plan, packet, [begin, end], *light);
                continue;
            }
            let none = Lanes::splat(simd, 0.0);
            let at = |[base, rate]: [Lanes<S>; 2], place: Lanes<S>| rate.mul_add(place, base);
            let within =
                |value: Lanes<S>| value.max(Lanes::splat(simd, low)).min(Lanes::splat(simd, high));
            let values = [within(at(value, begin)), within(at(value, end))];
            let length = mask.select(end - begin, none);
            sum.covered += length;
            sum.integral = length.mul_add((values[0] + values[1]) * 0.5, sum.integral);
            let is_first = mask & begin.simd_lt(sum.begin);
            let is_last = mask & end.simd_gt(sum.end);
            sum.begin = is_first.select(begin, sum.begin);
            sum.end = is_last.select(end, sum.end);
            sum.front.value = is_first.select(values[0], sum.front.value);
            sum.back.value = is_last.select(values[1], sum.back.value);
            if has_gradients {
                sum.front.across =
                    three!(I => is_first.select(at(gradient[I], begin), sum.front.across[I]));
                sum.back.across =
                    three!(I => is_last.select(at(gradient[I], end), sum.back.across[I]));
            }
        }
    }

    /// Returns the field of a sheet at a packet, and the rays that have one.
    #[inline(always)]
    pub fn layer(
        &mut self,
        simd: S,
        plan: &Plan,
        packet: &Packet<S>,
        sheet: usize,
    ) -> Option<(Layer<S>, mask32x8<S>)> {
        if self.field.tetrahedra.place() == Place::Cells
            || self.has_sums[sheet % OPEN] & packet.bit() == 0
        {
            return None;
        }
        let sum = &self.sums[sheet % OPEN][packet.number];
        let rays = packet.rays_in(plan);
        let [start, stop] = [plan.planes[sheet], plan.planes[sheet + 1]];
        let least = ((stop - start) * LEAST_PART).max(stop.abs() * LEAST_LENGTH);
        let has_value = sum.covered.simd_gt(least);
        let one = Lanes::splat(simd, 1.0);
        let thickness = has_value.select(sum.end - sum.begin, one);
        let mut front = sum.front;
        // The value behind the last sheet again, so that no crossing of an isosurface is lost.
        let [end, value] = self.last[packet.number];
        front.value = sum.begin.simd_eq(end).select(value, front.value);
        let mean = sum.integral / sum.covered.max(Lanes::splat(simd, least));
        self.last[packet.number] = [sum.end, sum.back.value];
        // The gradients of the faces are whole, not only across the ray.
        let middle = three!(I => (front.across[I] + sum.back.across[I]) * 0.5);
        let layer = Layer {
            front,
            back: sum.back,
            middle: mean * 1.5 - (front.value + sum.back.value) * 0.25,
            start: sum.begin,
            thickness,
            begin: sum.begin.max(rays.inside[0]),
            end: sum.end.min(rays.inside[1]),
            filling: (sum.covered / thickness).min(one),
            weight: one,
            direction: rays.direction,
            sections: Some([front.across, middle, sum.back.across]),
            share: None,
        };
        Some((layer, has_value))
    }

    /// Returns the radiance of a sheet at a packet: colours times optical depth, and optical depth.
    /// In a maximum intensity picture, the largest value counts at once.
    #[inline(always)]
    pub fn radiance(
        &self,
        simd: S,
        plan: &Plan,
        packet: &mut Packet<S>,
        sheet: usize,
    ) -> Option<[Lanes<S>; 4]> {
        if self.field.tetrahedra.place() == Place::Points
            || self.has_sums[sheet % OPEN] & packet.bit() == 0
        {
            return None;
        }
        let sum = &self.sums[sheet % OPEN][packet.number];
        if plan.optics == Optics::Maximum {
            packet.pixels.hit = packet.pixels.hit.max(sum.end);
            return None;
        }
        let [red, green, blue] = sum.front.across;
        let counts = sum.integral.simd_gt(0.0);
        counts.any_true().then(|| {
            let none = Lanes::splat(simd, 0.0);
            [red, green, blue, sum.integral].map(
                #[inline(always)]
                |part| counts.select(part, none),
            )
        })
    }

    /// Clears the sums of a sheet, for the one that is open next.
    #[inline(always)]
    pub fn clear(&mut self, simd: S, sheet: usize) {
        let has_sums = std::mem::take(&mut self.has_sums[sheet % OPEN]);
        for (number, sum) in self.sums[sheet % OPEN].iter_mut().enumerate() {
            if has_sums & (1 << number) != 0 {
                *sum = Sum::new(simd);
            }
        }
    }
}

impl Linear {
    /// Returns the distances at which rays enter and leave the tetrahedron; the first is the larger
    /// if they miss it.
    #[inline(always)]
    fn part<S: Simd>(&self, simd: S, plan: &Plan, packet: &Packet<S>) -> [Lanes<S>; 2] {
        let rays = &packet.rays;
        // Rounding may open a thin tetrahedron, but no ray leaves the range of its corners.
        let per_depth = Lanes::splat(simd, 1.0) / rays.cosine;
        let mut enter = (per_depth * self.depths[0]).max(Lanes::splat(simd, plan.planes[1]));
        let mut leave = per_depth * self.depths[1];
        for (of, has_face) in self.faces.iter().zip(self.has_face) {
            let mut base = Lanes::splat(simd, of[3]);
            if !plan.view.perspective {
                base += rays.aside[0] * of[0] + rays.aside[1] * of[1];
            }
            let rate = dot_with(*of, rays.direction);
            let is_parallel = rate.abs().simd_lt(PARALLEL);
            let least = if has_face { PARALLEL } else { -PARALLEL };
            let rate = is_parallel.select(Lanes::splat(simd, least), rate);
            let place = -base / rate;
            let enters = rate.simd_gt(0.0);
            enter = enters.select(enter.max(place), enter);
            leave = enters.select(leave, leave.min(place));
        }
        [enter, leave]
    }
}

impl CellField<'_> {
    /// Returns the extinction times colour, and the extinction, of a tetrahedron's only value; in a
    /// maximum intensity picture, the value.
    #[inline(always)]
    fn light<S: Simd>(&self, simd: S, plan: &Plan, number: u32) -> [Lanes<S>; 4] {
        let [zero, per_value] =
            [plan.field.values.zero, plan.field.values.per_value].map(f64::from);
        let value = f64::from(self.tetrahedra.values[number as usize]);
        let value = Lanes::splat(simd, ((value - zero) * per_value) as f32);
        if plan.optics == Optics::Maximum { [value; 4] } else { plan.of_value(simd, value) }
    }
}

impl<S: Simd> Sum<S> {
    /// Adds the part of rays between two distances in a medium of one colour.
    #[inline(always)]
    fn add_light(
        &mut self,
        simd: S,
        plan: &Plan,
        packet: &Packet<S>,
        [begin, end]: [Lanes<S>; 2],
        light: [Lanes<S>; 4],
    ) {
        let length = plan.kept(simd, packet.rays_in(plan), [begin, end]);
        if plan.optics == Optics::Maximum {
            let value = length.simd_gt(0.0).select(light[3], Lanes::splat(simd, -BEHIND));
            self.end = self.end.max(value);
            return;
        }
        self.integral = length.mul_add(light[3], self.integral);
        self.front.across = three!(I => length.mul_add(light[I], self.front.across[I]));
    }
}
