//! What clips leave of flat polygons, and where planes cut tetrahedra.

use crate::math::{Bounds, Clip, ClipShape};
use glam::DVec3;

/// A half-space: the places of which [`beyond`](Self::beyond) is not above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Half {
    /// The unit vector out of it.
    pub normal: DVec3,
    pub offset: f64,
}

impl Half {
    /// Returns how far a place lies outside.
    pub fn beyond(&self, place: DVec3) -> f64 {
        self.normal.dot(place) - self.offset
    }

    /// Returns the rest of space.
    fn turned(self) -> Self {
        Self { normal: -self.normal, offset: -self.offset }
    }

    /// Returns the half-spaces around a box.
    fn around(Bounds { min, max }: Bounds) -> Vec<Self> {
        let half = |axis: usize, sign: f64, end: f64| Self {
            normal: sign * DVec3::AXES[axis],
            offset: sign * end,
        };
        let both = |axis| [half(axis, 1.0, max[axis]), half(axis, -1.0, min[axis])];
        [0, 1, 2].into_iter().flat_map(both).collect()
    }

    /// Returns how far the places of a box lie outside, at least and at most.
    pub fn reach(&self, bounds: &Bounds) -> [f64; 2] {
        let middle = self.beyond(bounds.center());
        let half = self.normal.abs().dot(0.5 * bounds.size());
        [middle - half, middle + half]
    }
}

/// The part of space that clips leave: a convex part without some boxes.
#[derive(Debug, Clone, Default)]
pub(super) struct Kept {
    pub halves: Vec<Half>,
    pub holes: Vec<Vec<Half>>,
}

/// A plane in which clips cut, seen from outside, and the part of it where they do.
pub(super) struct Section {
    /// What lies on the inside of the plane is kept.
    pub plane: Half,
    pub within: Kept,
}

/// A corner of a polygon, with numbers that are linear between the corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corner<const N: usize> {
    pub place: DVec3,
    pub numbers: [f64; N],
}

impl<const N: usize> Corner<N> {
    pub fn mix(&self, other: &Self, part: f64) -> Self {
        Self {
            place: self.place + part * (other.place - self.place),
            numbers: std::array::from_fn(|at| {
                self.numbers[at] + part * (other.numbers[at] - self.numbers[at])
            }),
        }
    }
}

/// A flat convex polygon.
pub(super) type Polygon<const N: usize> = Vec<Corner<N>>;

impl Kept {
    /// Returns what clips leave, relative to an origin.
    pub fn new(clips: &[Clip], origin: DVec3) -> Self {
        let mut kept = Self::default();
        for clip in clips {
            match clip.shape {
                ClipShape::HalfSpace { normal, offset } => {
                    let length = normal.length();
                    let (normal, offset) = (normal / length, offset / length);
                    let half = Half { normal, offset: offset - normal.dot(origin) };
                    kept.halves.push(if clip.inside { half } else { half.turned() });
                }
                ClipShape::Box(Bounds { min, max }) => {
                    let bounds = Bounds { min: min - origin, max: max - origin };
                    match clip.inside {
                        true => kept.halves.extend(Half::around(bounds)),
                        false => kept.holes.push(Half::around(bounds)),
                    }
                }
            }
        }
        let all = std::mem::take(&mut kept.halves);
        for half in all {
            // The same clip twice would show its cut twice.
            if !kept.halves.contains(&half) {
                kept.halves.push(half);
            }
        }
        kept
    }

    /// Returns the planes in which what is kept ends.
    pub fn sections(&self) -> Vec<Section> {
        let others = |halves: &[Half], skipped: usize| -> Vec<Half> {
            let rest = halves.iter().enumerate().filter(|(at, _)| *at != skipped);
            rest.map(|(_, half)| *half).collect()
        };
        let mut sections: Vec<Section> = (0..self.halves.len())
            .map(|at| {
                let halves = others(&self.halves, at);
                let within = Self { halves, holes: self.holes.clone() };
                Section { plane: self.halves[at], within }
            })
            .collect();
        for (number, hole) in self.holes.iter().enumerate() {
            let mut holes = self.holes.clone();
            holes.remove(number);
            for at in 0..hole.len() {
                let halves = [self.halves.clone(), others(hole, at)].concat();
                let within = Self { halves, holes: holes.clone() };
                sections.push(Section { plane: hole[at].turned(), within });
            }
        }
        sections
    }

    /// Returns whether places in a box are all kept (`Some(true)`), all removed (`Some(false)`), or
    /// maybe both.
    pub fn of_box(&self, bounds: &Bounds) -> Option<bool> {
        let mut is_whole = true;
        for half in &self.halves {
            let [low, high] = half.reach(bounds);
            if low > 0.0 {
                return Some(false);
            }
            is_whole &= high <= 0.0;
        }
        for hole in &self.holes {
            is_whole &= hole.iter().any(|half| half.reach(bounds)[0] >= 0.0);
        }
        is_whole.then_some(true)
    }

    /// Returns the parts of a line that are kept.
    pub fn lines(&self, ends: [DVec3; 2]) -> Vec<[DVec3; 2]> {
        let Some(whole) = shares(&self.halves, ends) else { return Vec::new() };
        let mut parts = vec![whole];
        for hole in &self.holes {
            // A line on a face of the box is kept.
            let is_beside = |half: &Half| ends.iter().all(|end| half.beyond(*end) >= 0.0);
            let Some([low, high]) = shares(hole, ends).filter(|_| !hole.iter().any(is_beside))
            else {
                continue;
            };
            let without = |[from, to]: [f64; 2]| [[from, to.min(low)], [from.max(high), to]];
            parts = parts.into_iter().flat_map(without).filter(|[from, to]| from < to).collect();
        }
        parts.into_iter().map(|part| part.map(|share| ends[0].lerp(ends[1], share))).collect()
    }

    /// Returns the parts of a polygon that are kept.
    pub fn cut<const N: usize>(&self, polygon: Polygon<N>) -> Vec<Polygon<N>> {
        let mut rest = polygon;
        for half in &self.halves {
            rest = split(rest, half)[0].take().unwrap_or_default();
            if rest.is_empty() {
                return Vec::new();
            }
        }
        self.holes.iter().fold(vec![rest], |parts, hole| {
            parts.into_iter().flat_map(|part| without(part, hole)).collect()
        })
    }
}

/// Returns the part of a line inside half-spaces, by shares of its length.
fn shares(halves: &[Half], ends: [DVec3; 2]) -> Option<[f64; 2]> {
    halves.iter().try_fold([0.0f64, 1.0], |[from, to], half| {
        let [a, b] = ends.map(|end| half.beyond(end));
        let at = a / (a - b);
        let part = match (a <= 0.0, b <= 0.0) {
            (true, true) => [from, to],
            (true, false) => [from, to.min(at)],
            (false, true) => [from.max(at), to],
            (false, false) => return None,
        };
        (part[0] < part[1]).then_some(part)
    })
}

/// Returns the parts of a polygon outside a box.
fn without<const N: usize>(polygon: Polygon<N>, hole: &[Half]) -> Vec<Polygon<N>> {
    let is_beside = |half: &Half| polygon.iter().all(|corner| half.beyond(corner.place) >= 0.0);
    if hole.iter().any(is_beside) {
        return vec![polygon];
    }
    let (mut parts, mut rest) = (Vec::new(), polygon.clone());
    for half in hole {
        let [inside, outside] = split(rest, half);
        parts.extend(outside);
        match inside {
            Some(inside) => rest = inside,
            // Nothing of it lies in the box: it need not be cut.
            None => return vec![polygon],
        }
    }
    parts
}

/// Returns the parts of a polygon inside and outside a half-space. What only touches it from
/// outside is not inside.
pub(super) fn split<const N: usize>(polygon: Polygon<N>, half: &Half) -> [Option<Polygon<N>>; 2] {
    let beyond: Vec<f64> = polygon.iter().map(|corner| half.beyond(corner.place)).collect();
    if beyond.iter().all(|beyond| *beyond <= 0.0) {
        return [Some(polygon), None];
    }
    if beyond.iter().all(|beyond| *beyond >= 0.0) {
        return [None, Some(polygon)];
    }
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for (at, corner) in polygon.iter().enumerate() {
        let next = (at + 1) % polygon.len();
        if beyond[at] <= 0.0 {
            inside.push(*corner);
        }
        if beyond[at] >= 0.0 {
            outside.push(*corner);
        }
        if beyond[at] * beyond[next] < 0.0 {
            let crossing = crossing([corner, &polygon[next]], [beyond[at], beyond[next]]);
            inside.push(crossing);
            outside.push(crossing);
        }
    }
    [Some(inside), Some(outside)]
}

/// Returns where an edge crosses a plane: the same place, whichever end comes first.
pub(super) fn crossing<const N: usize>(ends: [&Corner<N>; 2], beyond: [f64; 2]) -> Corner<N> {
    let ([a, b], [from, to]) = match beyond[0] <= beyond[1] {
        true => (ends, beyond),
        false => ([ends[1], ends[0]], [beyond[1], beyond[0]]),
    };
    let part = from / (from - to);
    a.mix(b, if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 })
}

/// Returns the polygon in which a plane cuts a tetrahedron, counter-clockwise from outside; `None`
/// if nothing of the tetrahedron lies beyond the plane, or all.
pub(super) fn section<const N: usize>(corners: [Corner<N>; 4], plane: &Half) -> Option<Polygon<N>> {
    let beyond = corners.map(|corner| plane.beyond(corner.place));
    let crossing =
        |a: usize, b: usize| crossing([&corners[a], &corners[b]], [beyond[a], beyond[b]]);
    let is_in = |at: &usize| beyond[*at] <= 0.0;
    let (inside, outside): (Vec<usize>, Vec<usize>) = (0..4).partition(is_in);
    let mut polygon = match (&inside[..], &outside[..]) {
        ([a], [b, c, d]) | ([b, c, d], [a]) => {
            vec![crossing(*a, *b), crossing(*a, *c), crossing(*a, *d)]
        }
        ([a, b], [c, d]) => {
            vec![crossing(*a, *c), crossing(*a, *d), crossing(*b, *d), crossing(*b, *c)]
        }
        _ => return None,
    };
    let first = polygon[0].place;
    let out: f64 = polygon[1..]
        .windows(2)
        .map(|pair| (pair[0].place - first).cross(pair[1].place - first).dot(plane.normal))
        .sum();
    if out < 0.0 {
        polygon.reverse();
    }
    Some(polygon)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f64, y: f64, z: f64) -> Corner<1> {
        Corner { place: DVec3::new(x, y, z), numbers: [x + 2.0 * y + 4.0 * z] }
    }

    fn area<const N: usize>(polygons: &[Polygon<N>]) -> f64 {
        let one = |polygon: &Polygon<N>| {
            let first = polygon[0].place;
            let twice: DVec3 = polygon[1..]
                .windows(2)
                .map(|pair| (pair[0].place - first).cross(pair[1].place - first))
                .sum();
            0.5 * twice.length()
        };
        polygons.iter().map(one).sum()
    }

    fn square() -> Polygon<1> {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| corner(x, y, 0.0)).to_vec()
    }

    fn cube(min: f64, max: f64, inside: bool) -> Clip {
        let bounds = Bounds { min: DVec3::splat(min), max: DVec3::splat(max) };
        Clip { shape: ClipShape::Box(bounds), inside }
    }

    #[test]
    fn polygons_lose_what_clips_remove() {
        let kept = |clips: &[Clip]| Kept::new(clips, DVec3::ZERO).cut(square());
        let side = ClipShape::HalfSpace { normal: DVec3::new(2.0, 0.0, 0.0), offset: 0.5 };
        let inside = kept(&[Clip { shape: side, inside: true }]);
        let outside = kept(&[Clip { shape: side, inside: false }]);
        assert!((area(&inside) - 0.25).abs() < 1e-12 && (area(&outside) - 0.75).abs() < 1e-12);
        assert!((area(&kept(&[cube(-0.5, 0.5, true)])) - 0.25).abs() < 1e-12);
        assert!((area(&kept(&[cube(-0.5, 0.5, false)])) - 0.75).abs() < 1e-12);
        // A box within the polygon, one that only touches it, and one around it.
        let hole = kept(&[cube(-0.5, 0.5, false), cube(0.6, 0.7, false)]);
        assert_eq!(area(&hole), area(&kept(&[cube(-0.5, 0.5, false)])));
        assert_eq!(kept(&[cube(0.0, 2.0, false)]), [square()]);
        assert!(kept(&[cube(-1.0, 2.0, false)]).is_empty());
        for corner in hole.iter().flatten() {
            let [x, y, _] = corner.place.to_array();
            assert!((corner.numbers[0] - x - 2.0 * y).abs() < 1e-12);
        }
    }

    #[test]
    fn sections_of_a_tetrahedron_are_where_its_field_is_zero() {
        let corners = [
            corner(0.0, 0.0, 0.0),
            corner(1.0, 0.0, 0.0),
            corner(0.0, 1.0, 0.0),
            corner(0.0, 0.0, 1.0),
        ];
        for (normal, offset, count) in [
            (DVec3::X, 0.5, Some(3)),
            (DVec3::new(1.0, 1.0, 0.0).normalize(), 0.3, Some(4)),
            (DVec3::Z, 0.0, Some(3)),
            (DVec3::NEG_Z, 0.0, None),
            (DVec3::X, 2.0, None),
            (DVec3::X, -1.0, None),
        ] {
            let plane = Half { normal, offset };
            let polygon = section(corners, &plane);
            assert_eq!(polygon.as_ref().map(Vec::len), count, "{normal} {offset}");
            let Some(polygon) = polygon else { continue };
            for corner in &polygon {
                assert!(plane.beyond(corner.place).abs() < 1e-12);
                let [x, y, z] = corner.place.to_array();
                assert!((corner.numbers[0] - x - 2.0 * y - 4.0 * z).abs() < 1e-12);
            }
            let [a, b, c] = [0, 1, 2].map(|at| polygon[at].place);
            assert!((b - a).cross(c - a).dot(normal) > 0.0);
        }
    }

    #[test]
    fn the_planes_of_boxes_are_seen_from_where_nothing_is_left() {
        let sections = |clip: Clip| Kept::new(&[clip], DVec3::ZERO).sections();
        let outward = |section: &Section| section.plane.normal * section.plane.offset;
        assert!(sections(cube(-1.0, 1.0, true)).iter().all(|s| outward(s).length() == 1.0));
        for section in sections(cube(-1.0, 1.0, false)) {
            // The kept side is that away from the box.
            assert!(section.plane.beyond(DVec3::ZERO) > 0.0);
            assert_eq!(section.within.halves.len(), 5);
        }
        assert_eq!(Kept::new(&[cube(0.0, 1.0, true); 2], DVec3::ZERO).halves.len(), 6);
    }
}
