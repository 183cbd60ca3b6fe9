//! Directions encoded relative to the previous one: steps on an equal-area map of the sphere
//! (Lambert 1772) centred on it. All machines round every operation used here alike.

use crate::splat::{NO_NORMAL, decode_normal};
use glam::DVec3;

/// The resolution of directions: one step on the map is the sphere's radius divided by this.
#[derive(Debug, Clone, Copy)]
pub struct Directions(pub i32);

impl Directions {
    /// Returns the steps from one unit direction to another, on axes given by the two vectors
    /// `across`. The hemisphere behind has its own map, offset from the one in front.
    pub fn encode(self, from: DVec3, across: [DVec3; 2], to: DVec3) -> [i32; 2] {
        let height = to.dot(from);
        let scale = f64::from(self.0) / ((1.0 + height.abs()) * 0.5).sqrt();
        let [u, v] = across.map(|side| {
            let steps = side.dot(to) * scale;
            (steps + 0.5f64.copysign(steps)) as i32
        });
        if height >= 0.0 { [u, v] } else { [u + if u < 0 { -4 * self.0 } else { 4 * self.0 }, v] }
    }

    /// Returns the unit direction at the steps; `None` if they are outside the map.
    pub fn decode(self, from: DVec3, across: [DVec3; 2], [u, v]: [i32; 2]) -> Option<DVec3> {
        let is_behind = u.unsigned_abs() >= 2 * self.0 as u32;
        let u = if is_behind {
            u.wrapping_add(if u < 0 { 4 * self.0 } else { -4 * self.0 })
        } else {
            u
        };
        let (x, y) = (f64::from(u) / f64::from(self.0), f64::from(v) / f64::from(self.0));
        let square = x * x + y * y;
        if square > 2.2 {
            return None;
        }
        let (wide, height) = ((1.0 - square * 0.25).sqrt(), 1.0 - square * 0.5);
        let height = if is_behind { -height } else { height };
        Some(across[0] * (x * wide) + across[1] * (y * wide) + from * height)
    }
}

/// Returns two unit vectors that form a right-handed frame with a unit vector (Duff et al. 2017).
pub fn across(n: DVec3) -> [DVec3; 2] {
    let sign = if n.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// Packs a unit direction like the normal of a [`Splat`](crate::splat::Splat), octahedrally.
pub fn packed(n: DVec3) -> u32 {
    let scale = 32767.0 / (n.x.abs() + n.y.abs() + n.z.abs());
    let (mut x, mut y) = (n.x * scale, n.y * scale);
    if n.z < 0.0 {
        (x, y) = ((32767.0 - y.abs()).copysign(x), (32767.0 - x.abs()).copysign(y));
    }
    let pack = |value: f64| u32::from((value + 0.5f64.copysign(value)) as i16 as u16);
    pack(x) | pack(y) << 16
}

/// Returns the unit direction of a splat's normal.
pub fn unpacked(normal: u32) -> Option<DVec3> {
    if normal == NO_NORMAL { None } else { decode_normal(normal)?.as_dvec3().try_normalize() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::testing::Random;

    #[test]
    fn directions_are_near() {
        let mut random = Random(7);
        let mut before = DVec3::Z;
        let (mut sum, mut most) = (0.0, 0.0f64);
        for _ in 0..60_000 {
            let direction = random.direction();
            let map = Directions(34);
            let sides = across(before);
            let decoded = map.decode(before, sides, map.encode(before, sides, direction)).unwrap();
            let angle = libm::acos(decoded.dot(direction).min(1.0)).to_degrees();
            (sum, most) = (sum + angle, most.max(angle));
            assert!((decoded.length() - 1.0).abs() < 1e-9);
            assert!(unpacked(packed(decoded)).unwrap().distance(decoded) < 1e-4);
            before = decoded;
        }
        assert!(sum / 60_000.0 < 0.67 && most < 1.9, "{} {most}", sum / 60_000.0);
        for axis in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z] {
            let sides = across(axis);
            assert_eq!(Directions(34).encode(axis, sides, axis), [0, 0]);
            assert!(unpacked(packed(-axis)).unwrap().distance(-axis) < 1e-6);
        }
    }

    #[test]
    fn steps_beyond_the_map_are_none() {
        for steps in [[34, 60], [1000, 0], [i32::MIN, 0], [i32::MAX, i32::MIN]] {
            assert_eq!(Directions(34).decode(DVec3::Z, across(DVec3::Z), steps), None);
        }
    }
}
