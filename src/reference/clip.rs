//! The visible parts of a ray: ascending intervals of distances, cut by boxes and planes.

use super::ray::Ray;
use crate::{
    math::{Bounds, View},
    scene::{Clip, ClipShape},
    volume::Lattice,
};
use glam::DVec3;

/// Returns the parts of a ray that all clips leave.
pub(super) fn allowed(ray: &Ray, view: &View, clips: &[Clip]) -> Vec<[f64; 2]> {
    let (origin, direction) = in_world(ray, view);
    clips.iter().fold(vec![[f64::NEG_INFINITY, f64::INFINITY]], |parts, clip| {
        let inside = match clip.shape {
            ClipShape::HalfSpace { normal, offset } => {
                half_space(offset - normal.dot(origin), normal.dot(direction))
            }
            ClipShape::Box(bounds) => within(origin, direction, &bounds),
        };
        if clip.inside { intersection(&parts, inside) } else { difference(&parts, inside) }
    })
}

/// Returns the part of a ray inside the box of a lattice's samples. An axis on which all samples
/// lie at one place extends half a kernel unit to either side.
pub(super) fn sample_box(ray: &Ray, view: &View, lattice: &Lattice) -> Option<[f64; 2]> {
    let (origin, direction) = in_world(ray, view);
    let to_steps = lattice.axes.inverse();
    let mut samples = lattice.step_range();
    let unit = lattice.unit([0; 3]);
    for axis in 0..3 {
        if samples.min[axis] == samples.max[axis] {
            samples.min[axis] -= 0.5 * unit[axis];
            samples.max[axis] += 0.5 * unit[axis];
        }
    }
    within(to_steps * (origin - lattice.origin), to_steps * direction, &samples)
}

/// Intersects the parts of a ray with an interval.
pub(super) fn intersection(parts: &[[f64; 2]], interval: Option<[f64; 2]>) -> Vec<[f64; 2]> {
    let Some([low, high]) = interval else { return Vec::new() };
    let cut = parts.iter().map(|[from, to]| [from.max(low), to.min(high)]);
    cut.filter(|[from, to]| from < to).collect()
}

/// Whether a place on a ray lies in one of its parts.
pub(super) fn contains(parts: &[[f64; 2]], place: f64) -> bool {
    parts.iter().any(|[from, to]| (*from..=*to).contains(&place))
}

/// Returns the parts of a ray without an interval.
fn difference(parts: &[[f64; 2]], interval: Option<[f64; 2]>) -> Vec<[f64; 2]> {
    let Some([low, high]) = interval else { return parts.to_vec() };
    let rest = parts.iter().flat_map(|&[from, to]| [[from, to.min(low)], [from.max(high), to]]);
    rest.filter(|[from, to]| from < to).collect()
}

fn in_world(ray: &Ray, view: &View) -> (DVec3, DVec3) {
    let to_world = view.rotation.transpose();
    (to_world * ray.origin + view.position, to_world * ray.direction)
}

/// Returns the s with s·slope ≤ rest.
fn half_space(rest: f64, slope: f64) -> Option<[f64; 2]> {
    if slope == 0.0 {
        return (rest >= 0.0).then_some([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let bound = rest / slope;
    Some(if slope > 0.0 { [f64::NEG_INFINITY, bound] } else { [bound, f64::INFINITY] })
}

/// Returns the part of a line inside an axis-aligned box.
fn within(origin: DVec3, direction: DVec3, bounds: &Bounds) -> Option<[f64; 2]> {
    let mut interval = Some([f64::NEG_INFINITY, f64::INFINITY]);
    for axis in 0..3 {
        for side in [
            half_space(bounds.max[axis] - origin[axis], direction[axis]),
            half_space(origin[axis] - bounds.min[axis], -direction[axis]),
        ] {
            interval =
                interval.and_then(|interval| intersection(&[interval], side).first().copied());
        }
    }
    interval
}

#[cfg(test)]
mod tests {
    use super::{super::ray::tests::views, *};
    use glam::{DMat3, DVec2};

    #[test]
    fn a_ray_crosses_a_skewed_box_where_its_faces_are() {
        let axes = DMat3::from_cols(
            DVec3::new(0.3, 0.1, 0.0),
            DVec3::new(0.0, 0.2, 0.1),
            DVec3::new(0.05, 0.0, 0.4),
        );
        let lattice = Lattice::cartesian([5, 4, 1], DVec3::new(0.1, 0.2, 0.3), axes);
        for view in views() {
            let center = view.to_view(lattice.position(DVec3::new(2.0, 1.5, 0.0)));
            let flat =
                if view.perspective { center.truncate() / center.z } else { center.truncate() };
            let ray = Ray::new(&view, view.center + view.scale * flat);
            let interval = sample_box(&ray, &view, &lattice).unwrap();
            for s in interval {
                let world = view.rotation.transpose() * ray.point(s) + view.position;
                let index = lattice.axes.inverse() * (world - lattice.origin);
                let faces =
                    [index.x, index.x - 4.0, index.y, index.y - 3.0, index.z - 0.5, index.z + 0.5];
                assert!(faces.iter().any(|f| f.abs() < 1e-9), "{index}");
            }
            let middle = ray.point(0.5 * (interval[0] + interval[1]));
            let along = (center - middle).length();
            assert!(along < interval[1] - interval[0]);
            assert!(
                sample_box(&Ray::new(&view, DVec2::new(-900.0, 900.0)), &view, &lattice).is_none()
            );
        }
    }

    #[test]
    fn allowed_parts_are_those_whose_points_are_allowed() {
        let clips = [
            Clip {
                shape: ClipShape::HalfSpace { normal: DVec3::new(1.0, 2.0, -0.5), offset: 1.0 },
                inside: true,
            },
            Clip {
                shape: ClipShape::Box(Bounds {
                    min: DVec3::splat(0.2),
                    max: DVec3::new(0.9, 0.7, 0.8),
                }),
                inside: false,
            },
            Clip {
                shape: ClipShape::Box(Bounds { min: DVec3::splat(-2.0), max: DVec3::splat(2.5) }),
                inside: true,
            },
        ];
        let mut most = 0;
        for view in views() {
            for column in 0..40 {
                let ray = Ray::new(&view, DVec2::new(f64::from(column) + 0.5, 15.5));
                let parts = allowed(&ray, &view, &clips);
                most = most.max(parts.len());
                for step in 0..1000 {
                    let s = 0.01 * f64::from(step) + 0.003_141;
                    let p = view.rotation.transpose() * ray.point(s) + view.position;
                    let inside = |min: DVec3, max: DVec3| Bounds { min, max }.contains(p);
                    let expected = p.dot(DVec3::new(1.0, 2.0, -0.5)) <= 1.0
                        && !inside(DVec3::splat(0.2), DVec3::new(0.9, 0.7, 0.8))
                        && inside(DVec3::splat(-2.0), DVec3::splat(2.5));
                    assert_eq!(contains(&parts, s), expected, "{p}");
                }
            }
        }
        assert_eq!(most, 2, "no box was cut out of the middle of a ray");
    }
}
