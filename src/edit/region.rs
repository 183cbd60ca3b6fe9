//! The regions that crops keep.

use crate::math::View;
use glam::{DMat3, DVec2, DVec3};
use std::{fmt, str::FromStr};

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
    /// What an eye sees in a polygon that is drawn on its picture.
    Seen(Sight),
}

/// A polygon on a picture, and the eye that sees the picture.
///
/// Its text is `seen:EX,EY,EZ:FX,FY,FZ:UX,UY,UZ:NEAR,FAR:X,Y,X,Y,X,Y,…`: the eye, the directions
/// forwards and up, the nearest and the farthest depth along the first, and the corners. Those are
/// distances to the right and up at the depth 1. For an eye with parallel rays, the text begins
/// with `parallel:`, and the distances are the same at every depth. `inf` is no farthest depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// Where the rays begin, or a point of the plane where parallel ones do.
    pub eye: DVec3,
    /// The direction in which the eye looks.
    pub forward: DVec3,
    /// The direction that points up in the picture.
    pub up: DVec3,
    /// Whether rays begin at the eye; otherwise they are parallel.
    pub is_perspective: bool,
    /// The nearest and the farthest depth, in world units.
    pub depths: [f64; 2],
    /// The corners of the polygon in order. The last one is joined to the first.
    pub corners: Vec<DVec2>,
}

impl Sight {
    /// Returns what lies in a polygon of a picture, by its corners in pixels from the upper left
    /// corner of the picture.
    pub fn of(view: &View, pixels: &[DVec2], depths: [f64; 2]) -> Self {
        let rows = view.rotation.transpose();
        let corner = |pixel: &DVec2| (*pixel - view.center) / view.scale * DVec2::new(1.0, -1.0);
        Self {
            eye: view.position,
            forward: rows.z_axis,
            up: -rows.y_axis,
            is_perspective: view.perspective,
            depths,
            corners: pixels.iter().map(corner).collect(),
        }
    }

    /// Returns the frame of the eye: to the right, up and forwards as rows.
    fn frame(&self) -> DMat3 {
        let forward = self.forward.normalize_or(DVec3::NEG_Z);
        let right = forward.cross(self.up).try_normalize();
        let right = right.unwrap_or_else(|| forward.any_orthonormal_vector());
        DMat3::from_cols(right, right.cross(forward), forward).transpose()
    }

    fn contains(&self, place: DVec3) -> bool {
        let at = self.frame() * (place - self.eye);
        let [near, far] = self.depths;
        let is_before = !self.is_perspective || at.z > 0.0;
        let depth = if self.is_perspective { at.z } else { 1.0 };
        is_before && at.z >= near && at.z <= far && is_inside(&self.corners, at.truncate() / depth)
    }
}

impl fmt::Display for Sight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { eye, forward, up, depths: [near, far], .. } = self;
        f.write_str(if self.is_perspective { SEEN } else { PARALLEL })?;
        for DVec3 { x, y, z } in [eye, forward, up] {
            write!(f, "{x},{y},{z}:")?;
        }
        write!(f, "{near},{far}:")?;
        let corners: Vec<String> =
            self.corners.iter().map(|DVec2 { x, y }| format!("{x},{y}")).collect();
        f.write_str(&corners.join(","))
    }
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
            Self::Seen(sight) => sight.contains(place),
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

/// How texts of sights begin, of eyes with and without perspective.
const SEEN: &str = "seen:";
const PARALLEL: &str = "parallel:";

/// What a region is written as.
const FORM: &str = "the form is X,Y,Z,X,Y,Z for a box, sphere:X,Y,Z,RADIUS, \
                    xy:X,Y,X,Y,X,Y,… for a polygon seen along z, or seen:… and parallel:… for one \
                    on a picture (docs/editing.md)";

impl FromStr for Region {
    type Err = String;

    /// Reads a box `X,Y,Z,X,Y,Z` by two opposite corners, a ball `sphere:X,Y,Z,RADIUS`, a polygon
    /// as seen along an axis, `xy:X,Y,X,Y,X,Y,…`, `xz:…` or `yz:…`, or a [`Sight`].
    fn from_str(text: &str) -> Result<Self, String> {
        let plane = PLANES.iter().find_map(|(name, axes)| Some((text.strip_prefix(name)?, *axes)));
        if let Some((text, axes)) = plane {
            return Ok(Self::Polygon { axes, corners: polygon(text)? });
        }
        for (name, is_perspective) in [(SEEN, true), (PARALLEL, false)] {
            if let Some(text) = text.strip_prefix(name) {
                return sight(text, is_perspective).map(Self::Seen);
            }
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

/// Reads finite numbers with commas between them.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let number = |part: &str| {
        let number = part.trim().parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| format!("“{}” is not a number; {FORM}", part.trim()))
    };
    text.split(',').map(number).collect()
}

/// Reads the corners of a polygon.
fn polygon(text: &str) -> Result<Vec<DVec2>, String> {
    let numbers = numbers(text)?;
    let (pairs, []) = numbers.as_chunks::<2>() else {
        return Err("each corner of a polygon has two coordinates".into());
    };
    let corners: Vec<DVec2> = pairs.iter().copied().map(DVec2::from_array).collect();
    match corners.len() {
        0..3 => Err(format!("a polygon has at least 3 corners, not {}", corners.len())),
        _ => Ok(corners),
    }
}

/// Reads what an eye sees in a polygon.
fn sight(text: &str, is_perspective: bool) -> Result<Sight, String> {
    const PARTS: &str = "what an eye sees has five parts with colons between them: the eye X,Y,Z, \
                         the directions forwards and up, the depths NEAR,FAR, and a polygon";
    let parts: Vec<&str> = text.split(':').collect();
    let [eye, forward, up, depths, corners] = parts[..] else { return Err(PARTS.into()) };
    let vector = |text: &str| -> Result<DVec3, String> {
        numbers(text)?.try_into().map(DVec3::from_array).map_err(|_| PARTS.into())
    };
    let limits = match depths.trim().strip_suffix(",inf") {
        Some(near) => [numbers(near)?, vec![f64::INFINITY]].concat(),
        None => numbers(depths)?,
    };
    let [near, far] = limits[..] else { return Err(PARTS.into()) };
    let (eye, forward, up) = (vector(eye)?, vector(forward)?, vector(up)?);
    if forward.cross(up).try_normalize().is_none() {
        return Err("the directions forwards and up need a length, and must differ".into());
    }
    if near >= far {
        return Err(format!("the nearest depth, {near}, must be below the farthest, {far}"));
    }
    Ok(Sight { eye, forward, up, is_perspective, depths: [near, far], corners: polygon(corners)? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Camera, Projection};

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

    /// A triangle on a picture holds what is drawn in it: nothing beside it, behind the eye, or
    /// deeper than wanted.
    #[test]
    fn what_a_polygon_on_a_picture_shows_is_inside() {
        let projections = [
            Projection::Perspective { view_angle: 40.0 },
            Projection::Orthographic { height: 5.0 },
        ];
        for projection in projections {
            let camera = Camera {
                position: DVec3::new(3.0, -4.0, 5.0),
                focal_point: DVec3::new(0.0, 0.0, 1.0),
                view_up: DVec3::Z,
                projection,
            };
            let view = camera.view([200, 100]).unwrap();
            let pixels = [[60.0, 20.0], [140.0, 30.0], [90.0, 80.0]].map(DVec2::from_array);
            let sight = Sight::of(&view, &pixels, [2.0, 9.0]);
            let text = sight.to_string();
            let region: Region = text.parse().unwrap();
            assert_eq!(region, Region::Seen(sight), "{text}");
            let at = |x: f64, y: f64, depth: f64| {
                let depth_or_one = if view.perspective { depth } else { 1.0 };
                let flat = (DVec2::new(x, y) - view.center) / view.scale * depth_or_one;
                let place = view.rotation.transpose() * flat.extend(depth) + view.position;
                region.contains(place)
            };
            assert!(at(90.0, 40.0, 3.0) && at(90.0, 40.0, 8.9) && at(91.0, 75.0, 5.0), "{text}");
            assert!(!at(90.0, 40.0, 1.9) && !at(90.0, 40.0, 9.1), "{text}");
            assert!(!at(50.0, 40.0, 5.0) && !at(90.0, 85.0, 5.0), "{text}");
            // Behind an eye, rays cross: the mirrored point is not seen.
            assert!(!at(90.0, 40.0, -3.0), "{text}");
        }
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
            ("seen:0,0,0:0,0,-1:0,1,0:0,1", "five parts"),
            ("seen:0,0,0:0,0,0:0,1,0:0,1:0,0,1,0,1,1", "forwards and up"),
            ("seen:0,0,0:0,0,1:0,0,2:0,1:0,0,1,0,1,1", "must differ"),
            ("parallel:0,0,0:0,0,1:0,1,0:2,1:0,0,1,0,1,1", "below the farthest"),
            ("parallel:0,0,0:0,0,1:0,1,0:0,inf:0,0,1,0", "at least 3"),
        ] {
            let message = text.parse::<Region>().unwrap_err();
            assert!(message.contains(word), "{text}: {message}");
        }
    }
}
