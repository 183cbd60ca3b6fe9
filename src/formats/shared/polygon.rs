//! Cuts polygons into triangles.
//!
//! A polygon is projected along the axis nearest to its normal, which is the sum of its fan's
//! normals (Newell's; Sutherland, Sproull and Schumacker, 1974). If a fan from the first corner
//! covers the polygon, the fan is the result; this holds for all convex polygons. Otherwise ears
//! are cut off (Meisters, 1975). Corners on straight sides are kept, because other faces may end
//! there. A slit that leads to a hole visits its corners twice, which does no harm.

use crate::Result;
use glam::{DVec2, DVec3};
use std::{collections::VecDeque, iter::successors};

/// Squared sine of an angle. Triangles of a fan that are flipped by less than this angle count as
/// rounding errors.
const ROUNDING: f64 = 1e-12;

/// Maximum number of steps for one polygon, about a second. What is left after them becomes a fan.
/// Polygons that cross themselves reach this with a few thousand corners, others with more than a
/// hundred thousand, if ever.
const STEPS: usize = 1 << 27;

/// Passes the triangles of a polygon to `add`, with the polygon's winding. There are two fewer than
/// corners, or fewer if corners repeat. A polygon without area becomes a fan. One with a corner
/// that is not at finite coordinates has none.
///
/// # Errors
/// Those of `add`.
pub(crate) fn triangles(
    corners: &[u32],
    position: impl Fn(u32) -> DVec3,
    mut add: impl FnMut([u32; 3]) -> Result<()>,
) -> Result<()> {
    // Readers leave out the corner, and with it a triangle.
    if corners.len() > 3 && !corners.iter().all(|&corner| position(corner).is_finite()) {
        return Ok(());
    }
    if corners.len() > 3
        && let Some(flat) = projection(corners, &position)
        && !fan_covers(corners, &flat)
    {
        let points = corners.iter().map(|&corner| flat(corner)).collect();
        return clip(points, |ear| add(ear.map(|at| corners[at])));
    }
    fan(corners, add)
}

/// Projects the polygon to a plane, where it winds counter-clockwise: drops the coordinate along
/// the axis nearest to its normal, relative to the first corner. Coordinates are not rotated into
/// the polygon's plane, so rounding bends no side that is straight along an axis.
fn projection(corners: &[u32], position: impl Fn(u32) -> DVec3) -> Option<impl Fn(u32) -> DVec2> {
    let first = position(*corners.first()?);
    let spoke = move |corner| position(corner) - first;
    let normal: DVec3 =
        corners[1..].windows(2).map(|side| spoke(side[0]).cross(spoke(side[1]))).sum();
    if !normal.is_finite() || normal == DVec3::ZERO {
        return None;
    }
    let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()))?;
    let [u, v] = if normal[axis] > 0.0 { [axis + 1, axis + 2] } else { [axis + 2, axis + 1] };
    Some(move |corner| {
        let spoke = spoke(corner);
        DVec2::new(spoke[u % 3], spoke[v % 3])
    })
}

/// Returns whether no triangle of the fan is flipped. The triangles' signed areas add up to the
/// polygon's, so without flips they cover nothing else.
fn fan_covers(corners: &[u32], flat: impl Fn(u32) -> DVec2) -> bool {
    corners[1..].windows(2).all(|side| {
        let [a, b] = [flat(side[0]), flat(side[1])];
        let area = a.perp_dot(b);
        area >= 0.0 || area * area <= ROUNDING * a.length_squared() * b.length_squared()
    })
}

fn fan<T: Copy>(corners: &[T], add: impl FnMut([T; 3]) -> Result<()>) -> Result<()> {
    let Some((&first, rest)) = corners.split_first() else { return Ok(()) };
    rest.windows(2).map(|side| [first, side[0], side[1]]).try_for_each(add)
}

/// What prevents cutting off a corner: a concave corner in the triangle or on its border; only one
/// inside it; nothing. A polygon that touches itself may need the second, one that crosses itself
/// the third.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ban {
    Touching,
    Inside,
    Nothing,
}

/// Cuts off the ears of a polygon that winds counter-clockwise.
fn clip(points: Vec<DVec2>, mut add: impl FnMut([usize; 3]) -> Result<()>) -> Result<()> {
    let mut left = points.len();
    let mut queue: VecDeque<usize> = (0..left).collect();
    // A corner whose neighbour was removed is checked again, but after all others. Otherwise one
    // corner would produce many slivers.
    let mut waiting = vec![1u32; left];
    let mut ring = Ring::new(points);
    let mut ban = Ban::Touching;
    while left > 3 && ring.steps < STEPS {
        ring.steps += 1;
        let Some(at) = queue.pop_front() else {
            ban = match ban {
                Ban::Touching => Ban::Inside,
                Ban::Inside => Ban::Nothing,
                Ban::Nothing => break,
            };
            queue.extend(ring.corners());
            queue.iter().for_each(|&at| waiting[at] = 1);
            continue;
        };
        waiting[at] -= 1;
        if waiting[at] > 0 || ring.is_gone(at) {
            continue;
        }
        let (before, after) = (ring.before[at], ring.after[at]);
        if !ring.is_needless(at) {
            if !ring.is_ear(at, ban) {
                continue;
            }
            add([before, at, after])?;
        }
        ring.remove(at);
        left -= 1;
        let again = queue.len();
        if ban == Ban::Touching {
            queue.extend([before, after]);
        } else {
            ban = Ban::Touching;
            queue.extend(ring.corners());
        }
        queue.range(again..).for_each(|&at| waiting[at] += 1);
    }
    fan(&ring.corners().collect::<Vec<_>>(), add)
}

/// The remaining part of a polygon.
struct Ring {
    points: Vec<DVec2>,
    /// The corners before and after each corner; a removed corner refers to itself.
    before: Vec<usize>,
    after: Vec<usize>,
    /// A remaining corner.
    start: usize,
    /// Whether a corner remains and does not turn left. If a triangle contains any corner, it also
    /// contains a concave one.
    concave: Vec<bool>,
    /// The concave corners by grid square. Some are no longer concave.
    squares: Vec<Vec<usize>>,
    /// Squares per row, the lower corner of the grid, and squares per unit of length.
    side: usize,
    low: DVec2,
    scale: DVec2,
    steps: usize,
}

impl Ring {
    fn new(points: Vec<DVec2>) -> Self {
        let count = points.len();
        let (low, high) = points
            .iter()
            .fold((DVec2::MAX, DVec2::MIN), |(low, high), &p| (low.min(p), high.max(p)));
        let side = (count as f64 / 8.0).sqrt().clamp(1.0, 1024.0) as usize;
        let mut ring = Self {
            before: (0..count).map(|at| (at + count - 1) % count).collect(),
            after: (0..count).map(|at| (at + 1) % count).collect(),
            start: 0,
            concave: vec![false; count],
            squares: vec![Vec::new(); side * side],
            side,
            low,
            scale: side as f64 / (high - low),
            steps: 0,
            points,
        };
        (0..count).for_each(|at| ring.update(at));
        ring
    }

    fn corners(&self) -> impl Iterator<Item = usize> {
        successors(Some(self.start), |&at| Some(self.after[at]).filter(|&next| next != self.start))
    }

    fn is_gone(&self, at: usize) -> bool {
        self.after[at] == at
    }

    fn triangle(&self, at: usize) -> [DVec2; 3] {
        [self.before[at], at, self.after[at]].map(|at| self.points[at])
    }

    /// Returns twice the area that is lost with a corner; positive for a left turn.
    fn turn(&self, at: usize) -> f64 {
        let [a, b, c] = self.triangle(at);
        (b - a).perp_dot(c - b)
    }

    /// Returns whether the corner repeats a neighbour or is the end of a line that returns on
    /// itself.
    fn is_needless(&self, at: usize) -> bool {
        let [a, b, c] = self.triangle(at);
        self.turn(at) == 0.0 && (b - a).dot(c - b) <= 0.0
    }

    fn is_ear(&mut self, at: usize, ban: Ban) -> bool {
        self.turn(at) > 0.0
            && (ban == Ban::Nothing || !self.is_entered(self.triangle(at), ban == Ban::Touching))
    }

    /// Returns whether a concave corner is in a triangle, or on its border if `touching` is set.
    fn is_entered(&mut self, triangle: [DVec2; 3], touching: bool) -> bool {
        let [a, b, c] = triangle;
        let enters = |p: DVec2| {
            let inside = |from: DVec2, to: DVec2| {
                let turn = (to - from).perp_dot(p - from);
                turn > 0.0 || (touching && turn == 0.0)
            };
            inside(a, b) && inside(b, c) && inside(c, a) && !triangle.contains(&p)
        };
        let ([left, bottom], [right, top]) =
            (self.square(a.min(b).min(c)), self.square(a.max(b).max(c)));
        for row in bottom..=top {
            for square in &mut self.squares[row * self.side..][left..=right] {
                self.steps += 1;
                let mut next = 0;
                while let Some(&at) = square.get(next) {
                    self.steps += 1;
                    if !self.concave[at] {
                        square.swap_remove(next);
                    } else if enters(self.points[at]) {
                        return true;
                    } else {
                        next += 1;
                    }
                }
            }
        }
        false
    }

    fn square(&self, point: DVec2) -> [usize; 2] {
        ((point - self.low) * self.scale)
            .to_array()
            .map(|along| (along as usize).min(self.side - 1))
    }

    fn remove(&mut self, at: usize) {
        let (before, after) = (self.before[at], self.after[at]);
        (self.after[before], self.before[after], self.start) = (after, before, after);
        (self.before[at], self.after[at], self.concave[at]) = (at, at, false);
        self.update(before);
        self.update(after);
    }

    /// Updates whether a corner is concave.
    fn update(&mut self, at: usize) {
        let concave = self.turn(at) <= 0.0;
        if concave && !self.concave[at] {
            let [column, row] = self.square(self.points[at]);
            self.squares[row * self.side + column].push(at);
        }
        self.concave[at] = concave;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut_list(corners: &[u32], points: &[DVec3]) -> Vec<[u32; 3]> {
        let mut cuts = Vec::new();
        let position = |corner: u32| points[corner as usize];
        triangles(corners, position, |cut| {
            cuts.push(cut);
            Ok(())
        })
        .expect("nothing refuses triangles");
        assert!(cuts.len() <= corners.len().saturating_sub(2));
        cuts
    }

    fn cut(points: &[DVec3]) -> Vec<[u32; 3]> {
        cut_list(&(0..points.len() as u32).collect::<Vec<_>>(), points)
    }

    fn flat(points: &[(f64, f64)]) -> Vec<DVec3> {
        points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect()
    }

    fn fan_of(count: u32) -> Vec<[u32; 3]> {
        (2..count).map(|at| [0, at - 1, at]).collect()
    }

    /// Compares areas as vectors: those of the triangles must point the same way as the polygon's,
    /// and their lengths must add up to its length.
    fn check_areas(corners: &[u32], points: &[DVec3], cuts: &[[u32; 3]]) {
        let at = |corner: u32| points[corner as usize];
        let area = |[a, b, c]: [u32; 3]| (at(b) - at(a)).cross(at(c) - at(a));
        let mut whole = DVec3::ZERO;
        fan(corners, |triangle| {
            whole += area(triangle);
            Ok(())
        })
        .expect("nothing refuses triangles");
        let along: f64 = cuts.iter().map(|&cut| area(cut).dot(whole.normalize())).sum();
        let sizes: f64 = cuts.iter().map(|&cut| area(cut).length()).sum();
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b;
        assert!(
            close(along, whole.length()) && close(sizes, whole.length()),
            "{along} {sizes} {whole}"
        );
    }

    /// Cuts a polygon as it is, reversed, from each of its first corners, and in other planes.
    /// Checks the areas, and that every corner is used.
    fn check(outline: &[(f64, f64)]) {
        for turn in [DVec3::Z, DVec3::new(1.0, 2.0, -3.0), DVec3::new(-1.0, 0.2, 0.1), DVec3::NEG_Y]
        {
            let (u, v) = turn.normalize().any_orthonormal_pair();
            let mut points: Vec<DVec3> =
                outline.iter().map(|&(x, y)| DVec3::new(4e5, 5e6, 100.0) + u * x + v * y).collect();
            for round in 0..2 * outline.len().min(8) {
                if round % 2 == 0 {
                    points.rotate_left(1);
                }
                points.reverse();
                let cuts = cut(&points);
                assert_eq!(cuts.len(), points.len() - 2);
                assert!(
                    (0..points.len() as u32)
                        .all(|corner| cuts.iter().flatten().any(|&met| met == corner))
                );
                // Coordinates of this size are rounded to about 1e-9, and so are areas.
                let near: Vec<DVec3> = points.iter().map(|&p| p - points[0]).collect();
                check_areas(&(0..points.len() as u32).collect::<Vec<_>>(), &near, &cuts);
            }
        }
    }

    const L: [(f64, f64); 6] =
        [(2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0), (0.0, 0.0)];

    #[test]
    fn convex_polygons_are_fans() {
        let round = |count: u32, tilt: f64| -> Vec<DVec3> {
            let angle = |at| f64::from(at) / f64::from(count) * std::f64::consts::TAU;
            (0..count)
                .map(|at| DVec3::new(angle(at).cos(), angle(at).sin(), tilt * angle(at).sin()))
                .collect()
        };
        for count in [3, 4, 5, 17, 1000] {
            for tilt in [0.0, 0.7, 300.0] {
                let mut points = round(count, tilt);
                assert_eq!(cut(&points), fan_of(count));
                points.reverse();
                assert_eq!(cut(&points), fan_of(count));
            }
        }
        // With corners on a side; not quite planar; concave, from the one corner that sees the
        // whole polygon.
        let square = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 2.0), (0.0, 2.0)];
        assert_eq!(cut(&flat(&square)), fan_of(6));
        let saddle = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.5), DVec3::Y];
        assert_eq!(cut(&saddle), fan_of(4));
        let dart = [(0.5, 1.0), (0.0, 0.0), (2.0, 1.0), (0.0, 2.0)];
        assert_eq!(cut(&flat(&dart)), fan_of(4));
    }

    #[test]
    fn concave_polygons_are_covered_and_nothing_else() {
        check(&[(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.5, 1.0)]);
        check(&L);
        check(&[
            (0.0, 0.0),
            (3.0, 0.0),
            (3.0, 3.0),
            (2.0, 3.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (0.0, 3.0),
        ]);
    }

    #[test]
    fn straight_corners_stay() {
        let halves: Vec<(f64, f64)> = (0..L.len())
            .flat_map(|at| {
                let (a, b) = (L[at], L[(at + 1) % L.len()]);
                [a, (a.0 * 0.5 + b.0 * 0.5, a.1 * 0.5 + b.1 * 0.5)]
            })
            .collect();
        let points = flat(&halves);
        let cuts = cut(&points);
        assert_eq!(cuts.len(), points.len() - 2);
        check_areas(&(0..points.len() as u32).collect::<Vec<_>>(), &points, &cuts);
        assert!(
            (0..points.len() as u32).all(|corner| cuts.iter().flatten().any(|&met| met == corner))
        );
    }

    #[test]
    fn repeated_corners_lines_there_and_back_and_slits_to_holes() {
        let points = flat(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (0.0, 4.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (3.0, 3.0),
            (3.0, 1.0),
            (2.0, 0.5),
            (9.0, 9.0),
        ]);
        for corners in [
            // A square with a square hole, and one with a notch: with the same corner twice, with
            // it three times, with a line inwards, with a line outwards.
            vec![0, 1, 2, 3, 0, 4, 5, 6, 7, 4],
            vec![0, 1, 7, 2, 2, 3],
            vec![0, 0, 0, 1, 7, 7, 2, 3, 3, 0],
            vec![1, 7, 4, 7, 2, 3, 0],
            vec![1, 7, 2, 9, 2, 3, 0],
        ] {
            for from in 0..corners.len() {
                let mut corners = corners.clone();
                corners.rotate_left(from);
                check_areas(&corners, &points, &cut_list(&corners, &points));
                corners.reverse();
                check_areas(&corners, &points, &cut_list(&corners, &points));
            }
        }
    }

    #[test]
    fn what_is_no_polygon_is_a_fan_or_ends() {
        for bad in [f64::NAN, f64::INFINITY, f64::MAX] {
            for at in 0..L.len() {
                let mut points = flat(&L);
                points[at].y = bad;
                assert!(cut(&points).len() <= if bad.is_finite() { 4 } else { 0 });
                points[at] = DVec3::splat(bad);
                assert!(cut(&points).len() <= if bad.is_finite() { 4 } else { 0 });
            }
        }
        assert_eq!(cut(&[DVec3::ONE; 5]), fan_of(5));
        assert_eq!(cut(&flat(&[(0.0, 0.0), (1.0, 0.0), (5.0, 0.0), (2.0, 0.0)])), fan_of(4));
        assert!(
            cut(&[]).is_empty()
                && cut(&[DVec3::X]).is_empty()
                && cut(&[DVec3::X, DVec3::Y]).is_empty()
        );
        // A bow tie, and random corners.
        cut(&flat(&[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 1.0)]));
        for count in [5, 20, 300] {
            let mut state = count as u64;
            let mut random = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 40) as f64 / 16_777_216.0
            };
            let strewn: Vec<DVec3> =
                (0..count).map(|_| DVec3::new(random(), random(), random())).collect();
            cut(&strewn);
            // On a coarse grid, with many corners in the same place and on the same line.
            cut(&strewn.iter().map(|point| (point * 4.0).floor()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn large_polygons_are_cut_in_time() {
        let teeth = 4000;
        let mut comb = vec![(f64::from(teeth), -1.0), (0.0, -1.0)];
        comb.extend(
            (0..teeth).flat_map(|tooth| [(f64::from(tooth), 0.0), (f64::from(tooth) + 0.5, 500.0)]),
        );
        comb.reverse();
        // A ragged coastline.
        let shore: Vec<(f64, f64)> = (0..10_000)
            .map(|at| {
                let angle = f64::from(at) / 10_000.0 * std::f64::consts::TAU;
                let radius = 2.0 + (9.0 * angle).sin() + 0.1 * f64::from(at * 7919 % 101) / 101.0;
                (radius * angle.cos(), radius * angle.sin())
            })
            .collect();
        for points in [flat(&comb), flat(&shore)] {
            let cuts = cut(&points);
            assert_eq!(cuts.len(), points.len() - 2);
            check_areas(&(0..points.len() as u32).collect::<Vec<_>>(), &points, &cuts);
        }
    }
}
