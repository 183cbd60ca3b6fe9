//! Cones of normals: the cone around a node's normal that contains a child's cone.

use crate::{hierarchy::Node, splat::decode_normal};

/// Returns the cosine of [`joint_angle`].
pub fn joint_cosine(node: &Node, child: &Node) -> f64 {
    let normals = (decode_normal(node.splat.normal), decode_normal(child.splat.normal));
    let (Some(axis), Some(child_axis)) = normals else { return -1.0 };
    if child.cone <= -1.0 {
        return -1.0;
    }
    let (axis, child_axis) = (axis.as_dvec3(), child_axis.as_dvec3());
    let (dot, cross) = (axis.dot(child_axis), axis.cross(child_axis).length());
    let length = (dot * dot + cross * cross).sqrt();
    let (cosine, sine) = (dot / length, cross / length);
    let cone = f64::from(child.cone).min(1.0);
    let side = (1.0 - cone * cone).sqrt();
    if sine * cone + cosine * side < 0.0 { -1.0 } else { cosine * cone - sine * side }
}

/// Returns the half-angle of the cone around a node's normal that contains a child's cone; π if
/// there is none.
pub fn joint_angle(node: &Node, child: &Node) -> f64 {
    let normals = (decode_normal(node.splat.normal), decode_normal(child.splat.normal));
    let (Some(axis), Some(child_axis)) = normals else { return std::f64::consts::PI };
    if child.cone <= -1.0 {
        return std::f64::consts::PI;
    }
    let (axis, child_axis) = (axis.as_dvec3(), child_axis.as_dvec3());
    let cone = if child.cone < 1.0 { libm::acos(f64::from(child.cone)) } else { 0.0 };
    let between = libm::atan2(axis.cross(child_axis).length(), axis.dot(child_axis));
    (between + cone).min(std::f64::consts::PI)
}

/// Returns the cosine of a half-angle, rounded down.
pub fn cosine_below(angle: f64) -> f32 {
    if angle >= std::f64::consts::PI {
        return -1.0;
    }
    let cosine = libm::cos(angle) - 1e-9;
    let near = cosine as f32;
    if f64::from(near) > cosine { near.next_down() } else { near }
}
