//! Where the samples of a NIfTI file lie in the world.

use super::header::Header;
use crate::volume::Lattice;
use glam::{DMat3, DQuat, DVec3};

/// Returns the lattice of the samples: by the matrix (“sform”), else by the rotation (“qform”),
/// else by the steps alone. Also returns whether the header says how the subject lies.
///
/// Follows the definition in `nifti1.h` (Cox et al. 2004). Lengths are in millimetres if the header
/// gives their unit.
pub fn lattice(header: &Header, dims: [usize; 3]) -> (Lattice, bool) {
    let steps = DVec3::from_array(std::array::from_fn(|axis| {
        let step = header.steps[axis + 1].abs();
        if step > 0.0 && step.is_finite() { step } else { 1.0 }
    }));
    let placement = matrix(header, dims).or_else(|| rotation(header, steps));
    let is_stated = placement.is_some();
    let (axes, origin) = placement.unwrap_or((DMat3::from_diagonal(steps), DVec3::ZERO));
    let scale = millimetres(header).unwrap_or(1.0);
    (Lattice::cartesian(dims, origin * scale, axes * scale), is_stated)
}

/// Returns the millimetres in a unit of the header's lengths; `None` if it is not known.
pub fn millimetres(header: &Header) -> Option<f64> {
    match header.units & 7 {
        1 => Some(1e3),
        2 => Some(1.0),
        3 => Some(1e-3),
        _ => None,
    }
}

/// Returns the axes and the origin of the header's matrix, if it has one that spans space. The step
/// along an axis of one sample may be missing.
fn matrix(header: &Header, dims: [usize; 3]) -> Option<(DMat3, DVec3)> {
    let [x, y, z] = header.matrix;
    let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
    let mut axes: [DVec3; 3] = std::array::from_fn(column);
    if !header.has_matrix {
        return None;
    }
    for axis in 0..3 {
        let [a, b] = [axes[(axis + 1) % 3], axes[(axis + 2) % 3]];
        if dims[axis] == 1 && axes[axis] == DVec3::ZERO {
            let step = header.steps[axis + 1].abs();
            let length = if step > 0.0 && step.is_finite() { step } else { 1.0 };
            axes[axis] = a.cross(b).normalize_or_zero() * length;
        }
    }
    let directions = DMat3::from_cols_array_2d(&axes.map(|axis| axis.normalize_or_zero().into()));
    let spans = directions.determinant().abs() > 1e-6 && column(3).is_finite();
    spans.then(|| (DMat3::from_cols_array_2d(&axes.map(Into::into)), column(3)))
}

/// Returns the axes and the origin of the header's rotation, if it has one.
fn rotation(header: &Header, steps: DVec3) -> Option<(DMat3, DVec3)> {
    let origin = DVec3::from_array(header.offset);
    let vector = DVec3::from_array(header.quaternion);
    if !header.has_rotation || !vector.is_finite() || !origin.is_finite() {
        return None;
    }
    // The first number of the unit quaternion is not stored. Rounding may leave nothing for it.
    let rest = 1.0 - vector.length_squared();
    let turn = if rest < 1e-7 {
        let vector = vector.normalize_or_zero();
        DQuat::from_xyzw(vector.x, vector.y, vector.z, 0.0)
    } else {
        DQuat::from_xyzw(vector.x, vector.y, vector.z, rest.sqrt())
    };
    let mirrored = if header.steps[0] < 0.0 { -1.0 } else { 1.0 };
    let steps = DVec3::new(steps.x, steps.y, steps.z * mirrored);
    Some((DMat3::from_quat(turn) * DMat3::from_diagonal(steps), origin))
}
