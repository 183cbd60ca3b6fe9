//! Points that lie farthest out, and the convex hull of points of a plane.

use crate::parallel::prelude::*;
use glam::{DVec2, Vec3};

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
    let mut found: Vec<u32> = (0..DIRECTIONS)
        .into_par_iter()
        .filter_map(|number| farthest(points, &order, &cells, direction(number)))
        .collect();
    found.sort_unstable();
    found.dedup();
    found
}

impl Cell {
    fn of(points: &[Vec3], order: &[u32], range: std::ops::Range<usize>) -> Self {
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let own = order[range.clone()].iter().map(|&index| points[index as usize]);
        let (low, high) = own.fold(none, |(low, high), point| (low.min(point), high.max(point)));
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

/// Returns the corners of a box that contains points, with half of its side to spare on each side,
/// without a few that lie far away from all others: up to a thousandth on each side.
pub(crate) fn without_strays(points: &[Vec3]) -> Option<[Vec3; 2]> {
    if points.is_empty() {
        return None;
    }
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    let beyond = ((points.len() as f64 * STRAY).ceil() as usize).min((points.len() - 1) / 2);
    for axis in 0..3 {
        let mut along: Vec<f32> = points.iter().map(|point| point[axis]).collect();
        let mut at = |index: usize| *along.select_nth_unstable_by(index, f32::total_cmp).1;
        (low[axis], high[axis]) = (at(beyond), at(points.len() - 1 - beyond));
    }
    let slack = 0.5 * (high - low);
    Some([low - slack, high + slack])
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
        let found = outermost(&points);
        assert!(found.len() > 20 && found.len() < DIRECTIONS, "{}", found.len());
        for number in 0..DIRECTIONS {
            let along = |point: &Vec3| point.dot(direction(number));
            let most = |most: f32, along: f32| if along > most { along } else { most };
            let expected = points.iter().map(along).fold(f32::NEG_INFINITY, most);
            let own = found.iter().map(|&index| along(&points[index as usize]));
            assert_eq!(own.fold(f32::NEG_INFINITY, most), expected);
        }
        assert!(outermost(&[]).is_empty());
        assert_eq!(outermost(&[Vec3::ONE; 3]), [0]);
    }
}
