//! The regions that crops keep.

use glam::{DVec2, DVec3};
use std::str::FromStr;

/// A part of the world.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// A box along the world's axes, by its lower and its upper corner. Its faces belong to it.
    Box([DVec3; 2]),
    /// A ball, by its centre and its radius.
    Sphere(DVec3, f64),
    /// All above and below a polygon in a plane of two axes, by its corners in order.
    Polygon {
        /// The axes of the plane: 0 for x, 1 for y and 2 for z.
        axes: [usize; 2],
        /// The corners. The last one is joined to the first.
        corners: Vec<DVec2>,
    },
}

impl Region {
    /// Returns whether a point lies in the region.
    pub fn contains(&self, place: DVec3) -> bool {
        match self {
            Self::Box([low, high]) => place.cmpge(*low).all() && place.cmple(*high).all(),
            Self::Sphere(center, radius) => place.distance_squared(*center) <= radius * radius,
            Self::Polygon { axes: [u, v], corners } => {
                is_inside(corners, DVec2::new(place[*u], place[*v]))
            }
        }
    }
}

/// Returns whether a ray from a point crosses the polygon an odd number of times.
fn is_inside(corners: &[DVec2], at: DVec2) -> bool {
    let next = corners.iter().cycle().skip(1);
    let crosses = |(a, b): &(&DVec2, &DVec2)| {
        (a.y > at.y) != (b.y > at.y) && at.x < (b.x - a.x) * (at.y - a.y) / (b.y - a.y) + a.x
    };
    corners.iter().zip(next).filter(crosses).count() % 2 == 1
}

/// The planes of polygons.
const PLANES: [(&str, [usize; 2]); 3] = [("xy:", [0, 1]), ("xz:", [0, 2]), ("yz:", [1, 2])];

impl FromStr for Region {
    type Err = String;

    /// Reads a box `X,Y,Z,X,Y,Z` by two opposite corners, a ball `sphere:X,Y,Z,RADIUS`, or a
    /// polygon as seen along an axis, `xy:X,Y,X,Y,X,Y,…`, `xz:…` or `yz:…`.
    fn from_str(text: &str) -> Result<Self, String> {
        const FORM: &str = "the form is X,Y,Z,X,Y,Z for a box, sphere:X,Y,Z,RADIUS, or \
                            xy:X,Y,X,Y,X,Y,… for a polygon seen along z";
        let numbers = |text: &str| -> Result<Vec<f64>, String> {
            let number = |part: &str| {
                let number = part.trim().parse().ok().filter(|number: &f64| number.is_finite());
                number.ok_or_else(|| format!("“{}” is not a number; {FORM}", part.trim()))
            };
            text.split(',').map(number).collect()
        };
        let plane = PLANES.iter().find_map(|(name, axes)| Some((text.strip_prefix(name)?, *axes)));
        if let Some((text, axes)) = plane {
            let numbers = numbers(text)?;
            let (pairs, []) = numbers.as_chunks::<2>() else {
                return Err("each corner of a polygon has two coordinates".into());
            };
            let corners: Vec<DVec2> = pairs.iter().copied().map(DVec2::from_array).collect();
            if corners.len() < 3 {
                return Err(format!("a polygon has at least 3 corners, not {}", corners.len()));
            }
            return Ok(Self::Polygon { axes, corners });
        }
        if let Some(text) = text.strip_prefix("sphere:") {
            let [x, y, z, radius] = numbers(text)?.try_into().map_err(|_| FORM)?;
            if radius <= 0.0 {
                return Err("the radius of a sphere is a number above 0".into());
            }
            return Ok(Self::Sphere(DVec3::new(x, y, z), radius));
        }
        let [a, b, c, d, e, f] = numbers(text)?.try_into().map_err(|_| FORM)?;
        let (one, other) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
        Ok(Self::Box([one.min(other), one.max(other)]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_in_regions() {
        let contains = |text: &str, [x, y, z]: [f64; 3]| {
            text.parse::<Region>().unwrap().contains(DVec3::new(x, y, z))
        };
        assert!(contains("1,1,1,0,0,0", [1.0, 0.0, 0.5]));
        assert!(!contains("0,0,0,1,1,1", [1.0, 0.0, 1.01]));
        assert!(contains("sphere:1,2,3,0.5", [1.0, 2.5, 3.0]));
        assert!(!contains("sphere:1,2,3,0.5", [1.0, 2.51, 3.0]));
        // An L, whose notch is outside.
        let l = "0,0, 2,0, 2,1, 1,1, 1,2, 0,2";
        assert!(contains(&format!("xy:{l}"), [1.5, 0.5, 99.0]));
        assert!(!contains(&format!("xy:{l}"), [1.5, 1.5, 0.0]));
        assert!(contains(&format!("xz:{l}"), [0.5, -7.0, 1.5]));
        assert!(contains(&format!("yz:{l}"), [-7.0, 0.5, 1.5]));
    }

    #[test]
    fn wrong_regions_are_named() {
        for (text, word) in [
            ("", "is not a number"),
            ("1,2,3", "the form is"),
            ("sphere:1,2,3,0", "above 0"),
            ("sphere:1,2,3", "the form is"),
            ("xy:0,0,1,1", "at least 3"),
            ("xy:0,0,1,1,2", "two coordinates"),
            ("1,2,3,4,5,inf", "“inf”"),
            ("cube:1,2,3", "“cube:1”"),
        ] {
            let message = text.parse::<Region>().unwrap_err();
            assert!(message.contains(word), "{text}: {message}");
        }
    }
}
