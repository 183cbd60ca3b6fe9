//! Directions on the lattice of an octahedron (Meyer et al. 2010): whole numbers throughout, so that every machine gives
//! the same.

use crate::splat::{NO_NORMAL, decode_normal};
use glam::DVec3;

/// The octahedron's points are those of whole coordinates with |x| + |y| + |z| = `HALF`. On average a direction is 0.65°
/// from the next point, at most 1.9°.
pub const HALF: i32 = 65;

/// A point of the octahedron.
type Point = [i32; 3];

/// Which axis the middle of the unfolded octahedron lies on: 0 to 5 for +x, −x, +y, −y, +z, −z. Directions around it have
/// neighbours on the lattice, without folds between.
pub fn facing(mean: DVec3) -> u8 {
    let axis = mean.abs().max_position();
    (2 * axis) as u8 + u8::from(mean[axis] < 0.0)
}

fn sign(value: i32) -> i32 {
    if value < 0 { -1 } else { 1 }
}

/// The point at a place of the unfolded octahedron.
fn point([u, v]: [i32; 2]) -> Point {
    let height = HALF - u.abs() - v.abs();
    if height >= 0 { [u, v, height] } else { [(HALF - v.abs()) * sign(u), (HALF - u.abs()) * sign(v), height] }
}

/// The place of a point.
fn unfolded([x, y, z]: Point) -> [i32; 2] {
    if z >= 0 { [x, y] } else { [(HALF - y.abs()) * sign(x), (HALF - x.abs()) * sign(y)] }
}

/// The point in the frame of the world, of one in that of the axis that is faced.
fn turned(facing: u8, [x, y, z]: Point) -> Point {
    let axis = usize::from(facing / 2);
    let mut out = [0; 3];
    out[axis] = if facing % 2 == 1 { -z } else { z };
    out[(axis + 1) % 3] = x;
    out[(axis + 2) % 3] = y;
    out
}

/// The nearest place of the unfolded octahedron to a unit direction.
pub fn nearest(facing: u8, direction: DVec3) -> [i32; 2] {
    let axis = usize::from(facing / 2);
    let height = if facing % 2 == 1 { -direction[axis] } else { direction[axis] };
    let (x, y) = (direction[(axis + 1) % 3], direction[(axis + 2) % 3]);
    let scale = f64::from(HALF) / (x.abs() + y.abs() + height.abs());
    let (mut u, mut v) = (x * scale, y * scale);
    if height < 0.0 {
        let side = |value: f64| if value < 0.0 { -1.0 } else { 1.0 };
        (u, v) = ((f64::from(HALF) - v.abs()) * side(u), (f64::from(HALF) - u.abs()) * side(v));
    }
    let (u, v) = (u.floor() as i32, v.floor() as i32);
    let candidates = [[u, v], [u + 1, v], [u, v + 1], [u + 1, v + 1]].map(|place| place.map(|p| p.clamp(-HALF, HALF)));
    // Squares of cosines, as all of them are positive, take no root.
    let nearness = |&place: &[i32; 2]| {
        let [x, y, z] = turned(facing, point(place)).map(f64::from);
        let along = x * direction.x + y * direction.y + z * direction.z;
        along * along / (x * x + y * y + z * z)
    };
    let [mut best, others @ ..] = candidates;
    let mut most = nearness(&best);
    for other in others {
        let found = nearness(&other);
        if found > most {
            (best, most) = (other, found);
        }
    }
    best
}

/// The unit direction of a place.
pub fn direction(facing: u8, place: [i32; 2]) -> DVec3 {
    let [x, y, z] = turned(facing, point(place)).map(f64::from);
    DVec3::new(x, y, z) / (x * x + y * y + z * z).sqrt()
}

/// The direction of a place, packed as that of a [`Splat`](crate::splat::Splat).
pub fn packed(facing: u8, place: [i32; 2]) -> u32 {
    let pack = |value: i32| {
        // To the nearest, halves away from 0.
        let rounded = (2 * value.abs() * 32767 + HALF) / (2 * HALF) * sign(value);
        u32::from(rounded as i16 as u16)
    };
    let [u, v] = unfolded(turned(facing, point(place)));
    pack(u) | pack(v) << 16
}

/// The unit direction of a splat's normal.
pub fn unpacked(normal: u32) -> Option<DVec3> {
    if normal == NO_NORMAL { None } else { decode_normal(normal)?.as_dvec3().try_normalize() }
}

/// Whether a place is on the unfolded octahedron.
pub fn contains(place: [i32; 2]) -> bool {
    place.iter().all(|p| (-HALF..=HALF).contains(p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::testing::Random;

    #[test]
    fn directions_are_near_and_come_back() {
        let mut random = Random(7);
        let (mut sum, mut most) = (0.0, 0.0f64);
        for step in 0..60_000 {
            let facing = (step % 6) as u8;
            let direction = random.direction();
            let place = nearest(facing, direction);
            let found = self::direction(facing, place);
            let angle = libm::acos(found.dot(direction).min(1.0)).to_degrees();
            (sum, most) = (sum + angle, most.max(angle));
            let again = unpacked(packed(facing, place)).unwrap();
            assert!(again.distance(found) < 1e-4);
            assert_eq!(self::direction(facing, nearest(facing, again)), found);
        }
        assert!(sum / 60_000.0 < 0.66 && most < 1.9, "{} {most}", sum / 60_000.0);
    }

    #[test]
    fn faced_directions_lie_in_the_middle() {
        for (index, axis) in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z].into_iter().enumerate() {
            assert_eq!(facing(axis), index as u8);
            assert_eq!(nearest(index as u8, axis), [0, 0]);
            assert_eq!(direction(index as u8, [0, 0]), axis);
        }
    }
}
