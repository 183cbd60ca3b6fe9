//! The surfels of one vertex: one for each nearly flat group of the triangles around it.

use super::{
    Mesh, SurfelOptions,
    adjacency::Connected,
    disc::{Ellipse, Moments},
    eight::{Common, Fans, MOST_CORNERS, Results},
    fan_rules::{
        ALIKE, CENTROID, CORNER, LEAST_RATIO_SQUARED, LEAST_SQUARE, MIDDLE, SAG, SPREAD, STEEP,
        THICKNESS, mixed,
    },
    opacity::{Absorbed, OPAQUE, share_of},
    paint::{NEUTRAL, corner_color, of_normal, pack},
    refine::Origin,
    smooth::Groups,
};
use crate::{
    deadline::Clock,
    facet::Mean,
    splat::{NO_NORMAL, STEP_BACK, Splat, encode_normal},
};
use fearless_simd::{Level, Simd, dispatch};
use glam::{DVec3, Vec2, Vec3};

/// A surfel stands for triangles whose normals differ from the first one's by at most this angle
/// (degrees).
const FLAT: f32 = 30.0;
/// Vertices whose triangles are read together. They may lie anywhere in memory, and reading them
/// one by one would wait for each.
const TOGETHER: usize = 64;

/// A triangle as seen from one of its vertices. Lengths are in the maker's unit.
struct Around {
    at: u32,
    /// Unit normal.
    normal: Vec3,
    area: f32,
    /// At this vertex, in radians.
    angle: f32,
    /// Edges to the next corner and to the last one, and the vertices there by position.
    edges: [Vec3; 2],
    places: [u32; 2],
    /// The edges in the plane of the surfel.
    laid: [Vec2; 2],
    flat: usize,
    smooth: usize,
}

/// Makes the surfels of a mesh's vertices.
pub(super) struct Maker<'a> {
    pub mesh: &'a Mesh,
    pub connected: &'a Connected<'a>,
    pub options: &'a SurfelOptions,
    /// If the triangles of the mesh were cut, what they were cut from.
    pub origin: Option<&'a Origin<'a>>,
    /// The length that edges are measured in. Products of lengths then fit in 32 bits, whatever the
    /// mesh's size.
    pub unit: f32,
    /// −1 if the mesh is inside out.
    pub outward: f32,
    /// Whether all corners at a vertex have its colour.
    pub plain: bool,
}

/// Surfels of some vertices, and statistics of the triangles around them.
pub(super) struct Made {
    pub splats: Vec<Splat>,
    /// The square of the longest edge, in units.
    pub longest: f32,
    pub sums: Sums,
    rows: Vec<[u32; 3]>,
    around: Vec<Around>,
    flat: Groups,
    smooth: Groups,
    /// Normals of the smooth groups.
    normals: Vec<Vec3>,
    /// Eight vertices, and their results.
    fans: Box<(Fans, Results)>,
}

impl Made {
    /// Empty, with capacity for `capacity` surfels.
    pub fn new(options: &SurfelOptions, capacity: usize) -> Self {
        let crease = options.crease_angle_degrees;
        Self {
            splats: Vec::with_capacity(capacity),
            longest: 0.0,
            sums: Sums::default(),
            rows: Vec::new(),
            around: Vec::new(),
            flat: Groups::new(crease.min(FLAT)),
            smooth: Groups::new(crease),
            normals: Vec::new(),
            fans: Box::default(),
        }
    }
}

impl Maker<'_> {
    /// Adds the surfels of some vertices, unless time is up.
    pub fn vertices(&self, vertices: &[usize], made: &mut Made, clock: &Clock) {
        let by_eight = self.origin.is_none()
            && self.mesh.normals.is_empty()
            && self.plain
            && self.options.optical_depth >= OPAQUE;
        for few in vertices.chunks(TOGETHER) {
            if clock.is_over(0) {
                return;
            }
            let mut rows = std::mem::take(&mut made.rows);
            rows.clear();
            for &vertex in few {
                let corners = self.connected.adjacency.corners(vertex);
                rows.extend(corners.iter().map(|&at| self.mesh.triangles[at as usize / 3]));
            }
            if by_eight {
                dispatch!(Level::new(), simd => self.by_eight(simd, few, &rows, made));
            } else {
                let mut rest = &rows[..];
                for &vertex in few {
                    let (triangles, after) =
                        rest.split_at(self.connected.adjacency.corners(vertex).len());
                    self.vertex(vertex, triangles, made);
                    rest = after;
                }
            }
            made.rows = rows;
        }
    }

    /// Adds the surfels of vertices, eight at once. `rows` are the triangles of their corners.
    #[inline(always)]
    fn by_eight<S: Simd>(&self, simd: S, vertices: &[usize], rows: &[[u32; 3]], made: &mut Made) {
        let common = Common {
            unit: self.unit,
            outward: self.outward,
            radius_scale: self.options.radius_scale,
            flat: made.flat.crease(),
        };
        let mut fans = std::mem::take(&mut made.fans);
        let mut rest = rows;
        for eight in vertices.chunks(8) {
            let (fan, results) = &mut *fans;
            let all = rest;
            fan.clear();
            for (lane, &vertex) in eight.iter().enumerate() {
                let corners = self.connected.adjacency.corners(vertex);
                let (triangles, after) = rest.split_at(corners.len());
                rest = after;
                self.gather(fan, lane, vertex, corners, triangles);
            }
            fan.surfels(simd, &common, results);
            let mut rest = all;
            for (lane, &vertex) in eight.iter().enumerate() {
                let (triangles, after) =
                    rest.split_at(self.connected.adjacency.corners(vertex).len());
                rest = after;
                if results.is_made[lane] && self.is_opaque(vertex) {
                    self.take(results, lane, vertex, made);
                } else {
                    self.vertex(vertex, triangles, made);
                }
            }
        }
        made.fans = fans;
    }

    /// Returns whether the colour of a vertex is opaque.
    fn is_opaque(&self, vertex: usize) -> bool {
        self.mesh.colors.get(vertex).is_none_or(|color| color[3] == 255)
    }

    /// Puts a vertex in a lane, with the triangles of its corners. A vertex with too many gets
    /// none.
    #[inline(always)]
    fn gather(
        &self,
        fan: &mut Fans,
        lane: usize,
        vertex: usize,
        corners: &[u32],
        rows: &[[u32; 3]],
    ) {
        let here = self.mesh.positions[vertex];
        let count = if corners.len() <= MOST_CORNERS { corners.len() } else { 0 };
        fan.begin(lane, here, count);
        for (at, (&corner, &row)) in corners.iter().zip(rows).enumerate().take(count) {
            let [_, next, last] = turned(row, corner);
            let [_, next_number, last_number] =
                turned(self.connected.places[corner as usize / 3], corner);
            let places = [self.mesh.positions[next as usize], self.mesh.positions[last as usize]];
            fan.put(lane, at, places, [next_number, last_number]);
        }
    }

    /// Adds the result for the vertex in a lane.
    #[inline(always)]
    fn take(&self, results: &Results, lane: usize, vertex: usize, made: &mut Made) {
        let half = |part: f32| u32::from(part as i16 as u16);
        made.longest = made.longest.max(results.longest[lane]);
        let cross =
            Vec3::new(results.cross[0][lane], results.cross[1][lane], results.cross[2][lane]);
        made.sums.add(self.mesh.positions[vertex], results.area[lane], cross);
        let [f0, f1, f2, f3, f4, f5] = &results.factor;
        let normal = half(results.normal[0][lane]) | half(results.normal[1][lane]) << 16;
        made.splats.push(Splat {
            center: [results.center[0][lane], results.center[1][lane], results.center[2][lane]],
            strength: self.options.optical_depth,
            factor: [f0[lane], f1[lane], f2[lane], f3[lane], f4[lane], f5[lane]],
            color: match self.options.color_by_normal {
                true => pack(of_normal(normal)),
                // Packed as in memory, red lowest.
                false => {
                    let color = self.mesh.vertex_color(vertex);
                    color.map_or_else(|| pack(NEUTRAL), u32::from_le_bytes)
                }
            },
            normal,
        });
    }

    /// Adds the surfels of a vertex; `rows` are the triangles of its corners.
    fn vertex(&self, vertex: usize, rows: &[[u32; 3]], made: &mut Made) {
        let Made { splats, longest, sums, around, flat, smooth, normals, .. } = made;
        around.clear();
        flat.clear();
        let (mut area, mut cross) = (0.0, Vec3::ZERO);
        let per_unit = 1.0 / self.unit;
        for (&at, &row) in self.connected.adjacency.corners(vertex).iter().zip(rows) {
            if let Some(mut triangle) = self.around(at, row, per_unit, longest) {
                triangle.flat = flat.place(triangle.normal);
                area += triangle.area;
                cross += triangle.normal * triangle.area;
                around.push(triangle);
            }
        }
        sums.add(self.mesh.positions[vertex], area, cross);
        if flat.len() == 1 && self.origin.is_none() {
            splats.extend(self.surfel(vertex, around, None));
            return;
        }
        self.shade(around, smooth, normals);
        around.sort_by_key(|t| t.flat);
        for group in around.chunk_by_mut(|a, b| a.flat == b.flat) {
            let shading = group.iter().map(|t| normals[t.smooth] * t.angle).sum();
            splats.extend(self.surfel(vertex, group, Some(shading)));
        }
    }

    /// Returns a corner's triangle as seen from its vertex. `longest` grows to the square of the
    /// longest edge there.
    fn around(&self, at: u32, row: [u32; 3], per_unit: f32, longest: &mut f32) -> Option<Around> {
        let [here, next, last] = turned(row, at).map(|v| self.mesh.positions[v as usize]);
        let (a, b) = ((next - here) * per_unit, (last - here) * per_unit);
        let cross = a.cross(b);
        let (square, longer) = (cross.length_squared(), a.length_squared().max(b.length_squared()));
        *longest = longest.max(longer);
        // No more than a line, or no more than a point beside the whole.
        if square <= (longer * longer * LEAST_RATIO_SQUARED).max(LEAST_SQUARE) {
            return None;
        }
        let twice_area = square.sqrt();
        let [_, next, last] = turned(self.connected.places[at as usize / 3], at);
        Some(Around {
            at,
            normal: cross * (1.0 / twice_area),
            area: twice_area * 0.5,
            angle: angle(twice_area, a.dot(b)),
            edges: [a, b],
            places: [next, last],
            laid: [Vec2::ZERO; 2],
            flat: 0,
            smooth: 0,
        })
    }

    /// Computes the shading normals of the triangles' corners, and gives each triangle the index of
    /// its own.
    fn shade(&self, around: &mut [Around], smooth: &mut Groups, normals: &mut Vec<Vec3>) {
        normals.clear();
        if let Some(origin) = self.origin {
            for (index, triangle) in around.iter_mut().enumerate() {
                triangle.smooth = index;
                normals.push(origin.normal(self.mesh, triangle.at));
            }
            return;
        }
        smooth.clear();
        for triangle in around.iter_mut() {
            triangle.smooth = smooth.place(triangle.normal);
        }
        normals.resize(smooth.len(), Vec3::ZERO);
        for triangle in around.iter() {
            normals[triangle.smooth] += triangle.normal * triangle.angle;
        }
        normals.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
    }

    /// Returns the surfel of a group of triangles. `shading` is their normal, of any length, if it
    /// differs from their mean.
    fn surfel(&self, vertex: usize, group: &mut [Around], shading: Option<Vec3>) -> Option<Splat> {
        let first = group.first()?.normal;
        let mean =
            group.iter().map(|t| t.normal * t.angle).sum::<Vec3>().try_normalize().unwrap_or(first);
        let given = self.mesh.given_normal(vertex);
        let shading = given.or_else(|| shading.and_then(Vec3::try_normalize)).unwrap_or(mean);
        let normal = if shading.dot(mean).abs() >= ALIKE { shading } else { mean };
        let (x, y) = normal.any_orthonormal_pair();
        let mut moments = Moments::default();
        let mut height = 0.0;
        // Around a closed fan every neighbour occurs twice, so the bits of their numbers cancel.
        let mut rim = 0;
        for t in group.iter_mut() {
            t.laid = t.edges.map(|edge| Vec2::new(edge.dot(x), edge.dot(y)));
            let slope = normal.dot(t.normal);
            // Seen along a steep triangle's normal, the surfel must be wide enough. The triangle's
            // edges are therefore projected onto the surfel's plane in that direction.
            if slope.abs() < STEEP {
                let down = Vec2::new(t.normal.dot(x), t.normal.dot(y))
                    / (slope.signum() * slope.abs().max(0.5));
                t.laid = [0, 1].map(|i| t.laid[i] - down * normal.dot(t.edges[i]));
            }
            moments.add(t.area, t.laid[0], t.laid[1]);
            height += t.area * normal.dot(t.edges[0] + t.edges[1]);
            rim ^= mixed(t.places[0]) ^ mixed(t.places[1]);
        }
        let is_open = rim != 0;
        let area = moments.area();
        let mut ellipse: Ellipse = moments.ellipse(is_open, SPREAD);
        if is_open {
            ellipse.reach(Vec2::ZERO, CORNER);
        }
        for t in group.iter() {
            let [a, b] = t.laid;
            ellipse.reach(a * 0.5, MIDDLE);
            if is_open {
                // Otherwise this is the first edge of the next triangle.
                ellipse.reach(b * 0.5, MIDDLE);
            }
            ellipse.reach((a + b) * (1.0 / 3.0), CENTROID);
        }
        let scale = self.options.radius_scale;
        let thickness = THICKNESS * ellipse.narrowest() * scale;
        let outward = if given.is_some() { shading } else { shading * self.outward };
        // At the mean height of the surface, set back by as much as the surfel reaches outward.
        let sag = if is_open { 1.0 } else { SAG } * height / (3.0 * area);
        let aside = x * ellipse.center.x + y * ellipse.center.y;
        let offset = aside + normal * sag - outward * (STEP_BACK as f32 * thickness);
        let mut color = self.color(vertex, group, area, encode_normal(outward));
        // Each triangle is shared by its three vertices. Surfels made narrower show as dots of the
        // surface's opacity.
        let share = || share_of(area / 3.0, ellipse.sigmas() * scale.max(1.0).powi(2));
        let Absorbed { strength, alpha } = self.options.absorbed(color[3], share);
        color[3] = alpha;
        Some(Splat {
            center: (self.mesh.positions[vertex] + offset * self.unit).to_array(),
            strength,
            factor: ellipse.factor([x, y, normal], scale * self.unit, thickness * self.unit),
            color: pack(color),
            // Splats without a normal are not lit.
            normal: if group.iter().all(|t| self.mesh.is_unlit(t.at as usize / 3)) {
                NO_NORMAL
            } else {
                encode_normal(outward)
            },
        })
    }

    /// Returns the mean colour of the triangles at their corners, or that of the packed normal.
    fn color(&self, vertex: usize, group: &[Around], area: f32, normal: u32) -> [f32; 4] {
        if self.options.color_by_normal {
            return of_normal(normal);
        }
        if self.plain {
            let color = self.mesh.vertex_color(vertex);
            return color.map_or(NEUTRAL, |color| color.map(|part| f32::from(part) / 255.0));
        }
        let mut mean = Mean::default();
        for t in group {
            let color = corner_color(self.mesh, t.at as usize / 3, t.at as usize % 3);
            mean.add(color, t.area / area);
        }
        mean.color()
    }
}

/// Returns the corners of a triangle, starting with the given one.
#[inline(always)]
fn turned([a, b, c]: [u32; 3], corner: u32) -> [u32; 3] {
    match corner % 3 {
        0 => [a, b, c],
        1 => [b, c, a],
        _ => [c, a, b],
    }
}

/// Sums over the corners of a mesh's triangles that decide whether it is inside out.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Sums {
    area: f64,
    /// Position times area.
    place: DVec3,
    /// Normal times area, and its dot product with the position: nine times the volume of the
    /// tetrahedra to the origin.
    cross: DVec3,
    volume: f64,
}

impl Sums {
    fn add(&mut self, place: Vec3, area: f32, cross: Vec3) {
        let (place, area, cross) = (place.as_dvec3(), f64::from(area), cross.as_dvec3());
        self.area += area;
        self.place += place * area;
        self.cross += cross;
        self.volume += place.dot(cross);
    }

    /// Adds the corners of a triangle. Returns its normal times its area.
    pub fn add_triangle(&mut self, corners: [Vec3; 3]) -> DVec3 {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let cross = (b - a).cross(c - a) * 0.5;
        let (places, area) = (a + b + c, cross.length());
        self.area += 3.0 * area;
        self.place += places * area;
        self.cross += 3.0 * cross;
        self.volume += places.dot(cross);
        cross
    }

    /// The area of all corners, three times that of the triangles.
    pub fn area(&self) -> f64 {
        self.area
    }

    pub fn with(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            place: self.place + other.place,
            cross: self.cross + other.cross,
            volume: self.volume + other.volume,
        }
    }

    /// Returns 1 for a positive volume, and −1 for a negative one: then the surface is inside out.
    /// The volume is relative to the centre of the area, so an open surface has one only as far as
    /// it is curved. Areas are in squares of `unit`.
    pub fn side(&self, unit: f32) -> i8 {
        self.side_beyond(1e-3, unit)
    }

    /// Like [`side`](Self::side), for a closed surface, which may be as thin as rounding allows:
    /// the smallest volume counts.
    pub fn side_of_closed(&self) -> i8 {
        self.side_beyond(1e-9, 1.0)
    }

    fn side_beyond(&self, part: f64, unit: f32) -> i8 {
        let volume =
            (self.volume - self.cross.dot(self.place) / self.area) / (9.0 * f64::from(unit));
        let least = part * (self.area / 3.0).powf(1.5);
        i8::from(volume > least) - i8::from(volume < -least)
    }
}

/// Returns the angle of a sine ≥ 0 and a cosine of any common length, within 1e-5 (Abramowitz &
/// Stegun 1964, 4.4.47).
fn angle(sine: f32, cosine: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, PI};
    let steep = cosine.abs();
    let t = sine.min(steep) / sine.max(steep);
    let s = t * t;
    let sharp =
        t * (0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1))));
    let acute = if sine > steep { FRAC_PI_2 - sharp } else { sharp };
    if cosine < 0.0 { PI - acute } else { acute }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_near_enough() {
        for step in 0..=255 {
            let expected = f32::from(step as u8) * std::f32::consts::PI / 255.0;
            assert!(
                (angle(expected.sin().max(0.0) * 7.0, expected.cos() * 7.0) - expected).abs()
                    < 2e-5
            );
        }
    }
}
