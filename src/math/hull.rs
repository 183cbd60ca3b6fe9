//! Points that lie farthest out, and the convex hull of points of a plane.

use crate::parallel::prelude::*;
use glam::{DVec2, DVec3, Vec3};

/// The number of directions in which the farthest points are found. Of a ball, the points found
/// span all but 0.3 % of the radius.
const DIRECTIONS: usize = 1000;

/// Cells along each side of the grid that sorts points by their places.
const CELLS: usize = 32;

/// The share of points on each side that may lie far away from all others.
const STRAY: f64 = 0.001;

/// Points of one cell, and the box around them.
struct Cell {
    center: Vec3,
    half: Vec3,
    /// Where the cell's points begin and end in the sorted list.
    points: std::ops::Range<usize>,
}

/// Returns the indices of the points that lie farthest out in directions spread evenly over the
/// sphere, in ascending order. What contains these points contains nearly all. Points that are not
/// finite are left out.
///
/// The time is linear in the number of points: for each direction, only the few cells of a grid
/// are visited whose boxes reach beyond the farthest point found so far.
pub(crate) fn outermost(points: &[Vec3]) -> Vec<u32> {
    let finite = |point: &&Vec3| point.is_finite();
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = points
        .iter()
        .filter(finite)
        .fold(none, |(low, high), point| (low.min(*point), high.max(*point)));
    let scale = (high - low).to_array().map(|side| {
        let scale = CELLS as f32 / side;
        if scale.is_finite() { scale } else { 0.0 }
    });
    let cell_of = |point: Vec3| {
        let at = ((point - low) * Vec3::from(scale)).to_array();
        let [x, y, z] = at.map(|at| (at as usize).min(CELLS - 1));
        (z * CELLS + y) * CELLS + x
    };
    let mut starts = vec![0usize; CELLS * CELLS * CELLS + 1];
    points.iter().filter(finite).for_each(|point| starts[cell_of(*point) + 1] += 1);
    for cell in 1..starts.len() {
        starts[cell] += starts[cell - 1];
    }
    let mut order = vec![0u32; starts[starts.len() - 1]];
    let mut next = starts.clone();
    for (index, point) in points.iter().enumerate().filter(|(_, point)| point.is_finite()) {
        let place = &mut next[cell_of(*point)];
        order[*place] = index as u32;
        *place += 1;
    }
    let cells: Vec<Cell> = starts
        .windows(2)
        .filter(|ends| ends[0] < ends[1])
        .map(|ends| Cell::of(points, &order, ends[0]..ends[1]))
        .collect();
    let mut indices: Vec<u32> = (0..DIRECTIONS)
        .into_par_iter()
        .filter_map(|number| farthest(points, &order, &cells, direction(number)))
        .collect();
    indices.sort_unstable();
    indices.dedup();
    indices
}

impl Cell {
    fn of(points: &[Vec3], order: &[u32], range: std::ops::Range<usize>) -> Self {
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let members = order[range.clone()].iter().map(|&index| points[index as usize]);
        let (low, high) =
            members.fold(none, |(low, high), point| (low.min(point), high.max(point)));
        Self { center: 0.5 * (low + high), half: 0.5 * (high - low), points: range }
    }
}

/// Returns the index of the point that lies farthest in a direction, the first of equals.
fn farthest(points: &[Vec3], order: &[u32], cells: &[Cell], direction: Vec3) -> Option<u32> {
    let reach = |cell: &Cell| cell.center.dot(direction) + cell.half.dot(direction.abs());
    let reaches: Vec<f32> = cells.iter().map(reach).collect();
    let first = (0..cells.len()).max_by(|&a, &b| reaches[a].total_cmp(&reaches[b]))?;
    let mut best = (f32::NEG_INFINITY, u32::MAX);
    let visit = |cell: &Cell, best: &mut (f32, u32)| {
        for &index in &order[cell.points.clone()] {
            let along = points[index as usize].dot(direction);
            if along > best.0 || (along == best.0 && index < best.1) {
                *best = (along, index);
            }
        }
    };
    visit(&cells[first], &mut best);
    for (cell, reach) in cells.iter().zip(&reaches) {
        if *reach >= best.0 {
            visit(cell, &mut best);
        }
    }
    Some(best.1)
}

/// Returns one of the directions, spread over the sphere along a spiral (González 2010).
fn direction(number: usize) -> Vec3 {
    let z = 1.0 - (2 * number + 1) as f64 / DIRECTIONS as f64;
    let turn = number as f64 * std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let radius = (1.0 - z * z).sqrt();
    Vec3::new((radius * turn.cos()) as f32, (radius * turn.sin()) as f32, z as f32)
}

/// What a set of points is, which decides how much of it may lie far away without counting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Points that were measured. Some may be wrong.
    Measured,
    /// Corners of a modelled surface, where few of them may be a whole part.
    Modelled,
    /// A trained scene: an object, and a background all around.
    Trained,
}

impl Kind {
    /// Returns shares of points on each side, and how far away they have to lie to be left out, in
    /// diagonals of the box around the others.
    fn strays(self) -> &'static [[f64; 2]] {
        match self {
            Self::Modelled => &[[0.01, 20.0]],
            Self::Measured | Self::Trained => &[[0.01, 4.0], [0.05, 20.0]],
        }
    }
}

/// The share of a trained scene on each side that may be background, and how far away it lies at
/// least, in diagonals of the box around the rest.
const BACKGROUND: [f64; 2] = [0.2, 1.5];

/// A background makes the whole this many times as large as the rest, or more.
const WIDENED: f32 = 10.0;

/// Points that percentiles are taken of. Of fewer than the least, none is a stray by its share.
const SAMPLED: usize = 1 << 16;
const FEWEST: usize = 100;

/// Returns the corners of a box that contains nearly all points. Left out are up to a thousandth on
/// each side that lies farther out than half of the side of the box around the others. More are
/// left out only if they lie much farther away ([`Kind::strays`], [`BACKGROUND`]).
pub(crate) fn without_strays(points: &[Vec3], kind: Kind) -> Option<[Vec3; 2]> {
    if points.is_empty() {
        return None;
    }
    let [low, high] = percentiles(points, STRAY);
    let slack = 0.5 * (high - low);
    let mut kept = [low - slack, high + slack];
    if points.len() < FEWEST {
        return Some(kept);
    }
    let step = points.len().div_ceil(SAMPLED);
    let sampled: Vec<Vec3> = points.iter().step_by(step).copied().collect();
    let mut keep = |[low, high]: [Vec3; 2], diagonals: f32| {
        let slack = diagonals * low.distance(high);
        if slack > 0.0 {
            kept = [kept[0].max(low - slack), kept[1].min(high + slack)];
        }
    };
    for &[share, diagonals] in kind.strays() {
        keep(percentiles(&sampled, share), diagonals as f32);
    }
    let [share, diagonals] = BACKGROUND;
    if kind == Kind::Trained {
        let core = percentiles(&sampled, share);
        if is_surrounded(&sampled, core, diagonals as f32) {
            keep(core, diagonals as f32);
        }
    }
    Some(kept)
}

/// Returns whether the points outside of a box, and of some diagonals around it, lie far away on
/// several sides, as a background does. Another object lies on one side.
fn is_surrounded(points: &[Vec3], [low, high]: [Vec3; 2], diagonals: f32) -> bool {
    let diagonal = low.distance(high);
    let slack = Vec3::splat(diagonals * diagonal);
    let is_near = |p: &Vec3| p.cmpge(low - slack).all() && p.cmple(high + slack).all();
    let outside: Vec<DVec3> = points.iter().filter(|p| !is_near(p)).map(|p| p.as_dvec3()).collect();
    if outside.is_empty() {
        return false;
    }
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (first, last) = points.iter().fold(none, |(a, b), p| (a.min(*p), b.max(*p)));
    let mean = outside.iter().sum::<DVec3>() / outside.len() as f64;
    let spread = outside.iter().map(|p| p.distance_squared(mean)).sum::<f64>();
    let spread = (spread / outside.len() as f64).sqrt();
    let aside = mean.distance((0.5 * (low + high)).as_dvec3());
    diagonal > 0.0 && first.distance(last) >= WIDENED * diagonal && aside < spread
}

/// Returns the corners of the box without this share of the points on each side, rounded up.
pub(crate) fn percentiles(points: &[Vec3], share: f64) -> [Vec3; 2] {
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    let beyond = ((points.len() as f64 * share).ceil() as usize).min((points.len() - 1) / 2);
    for axis in 0..3 {
        let mut along: Vec<f32> = points.iter().map(|point| point[axis]).collect();
        let mut at = |index: usize| *along.select_nth_unstable_by(index, f32::total_cmp).1;
        (low[axis], high[axis]) = (at(beyond), at(points.len() - 1 - beyond));
    }
    [low, high]
}

/// Returns the corners of the convex hull of points of a plane, counter-clockwise (Andrew 1979).
/// Fewer than three if the points lie on a line.
pub(crate) fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for &point in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(point - b) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut corners = half(&mut points.iter());
    corners.extend(half(&mut points.iter().rev()));
    corners
}

/// Returns the area of a convex polygon with its corners counter-clockwise.
pub(crate) fn area(corners: &[DVec2]) -> f64 {
    let Some((&first, rest)) = corners.split_first() else { return 0.0 };
    0.5 * rest.windows(2).map(|pair| (pair[0] - first).perp_dot(pair[1] - first)).sum::<f64>()
}

/// Returns how far inside a convex polygon a point is: the distance to the nearest side, negative
/// outside.
pub(crate) fn depth_inside(corners: &[DVec2], point: DVec2) -> f64 {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let inside = |(a, b): (&DVec2, &DVec2)| {
        (*b - *a).try_normalize().map(|along| along.perp_dot(point - *a))
    };
    sides.filter_map(inside).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_has_four_corners() {
        let at = |i: i32| DVec2::new(f64::from(i % 5), f64::from(i / 5));
        let corners = hull((0..25).map(at).collect());
        assert_eq!(corners.len(), 4, "{corners:?}");
        assert_eq!(area(&corners), 16.0);
        assert_eq!(depth_inside(&corners, DVec2::new(1.0, 2.0)), 1.0);
        assert_eq!(depth_inside(&corners, DVec2::new(2.0, 6.0)), -2.0);
        assert!(area(&hull(vec![DVec2::ZERO, DVec2::X, 2.0 * DVec2::X])) == 0.0);
    }

    fn ball(count: usize) -> Vec<Vec3> {
        // Steps that fill space evenly (Roberts 2018).
        let unit = |i: usize, step: f64| ((i as f64 * step).fract() * 2.0 - 1.0) as f32;
        let place = |i| Vec3::new(unit(i, 0.819_172_5), unit(i, 0.671_043_6), unit(i, 0.549_700_5));
        (0..).map(place).filter(|p| p.length() < 1.0).take(count).collect()
    }

    fn kept(points: &[Vec3], kind: Kind) -> usize {
        let [low, high] = without_strays(points, kind).unwrap();
        points.iter().filter(|p| p.cmpge(low).all() && p.cmple(high).all()).count()
    }

    #[test]
    fn few_points_far_away_are_left_out() {
        let around = ball(2000);
        let with = |count: usize, factor: f32, aside: Vec3| {
            let more = ball(count).into_iter().map(|p| factor * p + aside);
            around.iter().copied().chain(more).collect::<Vec<Vec3>>()
        };
        let far = with(14, 1.0, Vec3::new(3000.0, 5000.0, 8000.0));
        assert_eq!(kept(&far, Kind::Measured), 2000);
        assert_eq!(kept(&far, Kind::Modelled), 2000);
        // A small part beside the rest, and substantial parts, stay.
        for other in [
            with(14, 0.1, Vec3::X * 8.0),
            with(120, 1.0, Vec3::X * 50.0),
            with(300, 1.0, Vec3::X * 5000.0),
            with(2000, 1.0, Vec3::X * 5000.0),
        ] {
            assert_eq!(kept(&other, Kind::Measured), other.len());
            assert_eq!(kept(&other, Kind::Trained), other.len());
        }
        // So do long thin objects, sparse at one end.
        let rod: Vec<Vec3> =
            ball(2000).into_iter().map(|p| Vec3::new((3.0 * p.x).exp() * 50.0, p.y, p.z)).collect();
        assert_eq!(kept(&rod, Kind::Measured), 2000);
    }

    #[test]
    fn a_background_all_around_is_left_out_of_trained_scenes() {
        let around = ball(2000);
        let shell = ball(280).into_iter().map(|p| p.normalize() * 120.0);
        let scene: Vec<Vec3> = around.iter().copied().chain(shell).collect();
        assert_eq!(kept(&scene, Kind::Trained), 2000);
        assert_eq!(kept(&scene, Kind::Measured), 2280);
        // The ground around an object belongs to it.
        let ground = ball(600).into_iter().map(|p| Vec3::new(4.0 * p.x, -1.0, 4.0 * p.z));
        let scene: Vec<Vec3> = around.into_iter().chain(ground).collect();
        assert_eq!(kept(&scene, Kind::Trained), 2600);
    }

    /// The points that a plain search finds, in any order of the points.
    #[test]
    fn the_farthest_points_are_found() {
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) as f32 / (1u32 << 24) as f32
        };
        let mut points: Vec<Vec3> =
            (0..5000).map(|_| Vec3::new(random(), 3.0 * random(), 0.2 * random())).collect();
        points.push(Vec3::NAN);
        let indices = outermost(&points);
        assert!(indices.len() > 20 && indices.len() < DIRECTIONS, "{}", indices.len());
        for number in 0..DIRECTIONS {
            let along = |point: &Vec3| point.dot(direction(number));
            let most = |most: f32, along: f32| if along > most { along } else { most };
            let expected = points.iter().map(along).fold(f32::NEG_INFINITY, most);
            let distances = indices.iter().map(|&index| along(&points[index as usize]));
            assert_eq!(distances.fold(f32::NEG_INFINITY, most), expected);
        }
        assert!(outermost(&[]).is_empty());
        assert_eq!(outermost(&[Vec3::ONE; 3]), [0]);
    }
}
