//! Points whose coordinates are not finite numbers. Scanners and solvers write them where nothing
//! was measured or computed. Every reader of points and vertices leaves them out, with the faces
//! that use them, and says how many.

use crate::{Result, input::Source, parallel::prelude::*, surface::Mesh, warning};

/// Leaves out the vertices of a mesh whose position is not finite, and the triangles that use them.
/// Warns if there are any.
pub(crate) fn leave_out(source: &Source, mesh: &mut Mesh) -> Result<()> {
    let count = mesh.positions.len();
    let left_out = remove(source, mesh)?;
    if left_out > 0 {
        warn(source, left_out, count);
    }
    Ok(())
}

/// As [`leave_out`], without the warning. Returns the number of vertices that are left out.
pub(crate) fn remove(source: &Source, mesh: &mut Mesh) -> Result<usize> {
    let count = mesh.positions.len();
    if mesh.positions.par_iter().all(|position| position.is_finite()) {
        return Ok(0);
    }
    source.room::<u32>("the numbers of the points", count + 1)?;
    let had_triangles = !mesh.triangles.is_empty();
    let kept: Vec<bool> = mesh.positions.par_iter().map(|place| place.is_finite()).collect();
    mesh.keep(&kept);
    if had_triangles && mesh.triangles.is_empty() {
        return Err(source.error("faces", "each uses a point that is not at finite coordinates"));
    }
    Ok(count - mesh.positions.len())
}

/// Says how many of a file's points are left out.
pub(crate) fn warn(source: &Source, left_out: usize, all: usize) {
    let (file, which) = (source.path.display(), if left_out == 1 { "it" } else { "they" });
    let verb = if left_out == 1 { "is" } else { "are" };
    warning::give!(
        "{file}: {left_out} of {all} points {verb} not at finite coordinates: {which} {verb} left \
         out, with the faces that use them"
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        input::Limits,
        surface::{Material, Sensor},
    };
    use glam::{Vec2, Vec3};

    fn source(limits: &Limits) -> Source<'_> {
        Source::from_bytes("a.xyz".as_ref(), &[], limits).unwrap()
    }

    #[test]
    fn points_without_a_place_take_all_that_is_theirs_with_them() {
        let limits = Limits::default();
        let places = [Vec3::ZERO, Vec3::NAN, Vec3::X, Vec3::Y, Vec3::new(0.0, f32::INFINITY, 0.0)];
        let number = |at: usize| at as u8;
        let mut mesh = Mesh {
            positions: places.to_vec(),
            normals: vec![Vec3::Z; 5],
            colors: (0..5).map(|at| [number(at); 4]).collect(),
            uvs: (0..5).map(|at| Vec2::splat(at as f32)).collect(),
            values: (0..5).map(|at| at as f32).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [2, 3, 4]],
            triangle_materials: vec![0, 1, 0],
            materials: vec![Material::default(); 2],
            sensors: vec![Sensor { position: Vec3::ONE, points: 1..4 }],
            ..Mesh::default()
        };
        leave_out(&source(&limits), &mut mesh).unwrap();
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(mesh.colors, [[0; 4], [2; 4], [3; 4]]);
        assert_eq!((mesh.values, mesh.normals.len(), mesh.uvs.len()), (vec![0.0, 2.0, 3.0], 3, 3));
        assert_eq!((mesh.triangles, mesh.triangle_materials), (vec![[0, 1, 2]], vec![1]));
        assert_eq!(mesh.sensors[0].points, 1..3);
    }

    #[test]
    fn a_mesh_without_a_whole_face_is_refused() {
        let limits = Limits::default();
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::NAN],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        assert!(leave_out(&source(&limits), &mut mesh).is_err());
    }
}
