//! Normals of points and vertices.

use super::{Mesh, SurfelOptions, cloud};
use crate::Result;
use glam::Vec3;

impl Mesh {
    /// Estimates normals in place of those that there are. Points get those of the planes of their
    /// neighbours, turned to one side; vertices the mean of their triangles, weighted by area. A
    /// normal is zero where there is none.
    ///
    /// # Errors
    /// [`Error::Timeout`](crate::Error::Timeout) and [`Error::Memory`](crate::Error::Memory).
    pub fn estimate_normals(&mut self, options: &SurfelOptions) -> Result<()> {
        self.normals.clear();
        self.normals = match self.triangles.is_empty() {
            true => cloud::normals(self, options)?,
            false => of_triangles(self),
        };
        Ok(())
    }
}

fn of_triangles(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
        let area = (b - a).cross(c - a);
        triangle.iter().for_each(|corner| normals[*corner as usize] += area);
    }
    normals.into_iter().map(Vec3::normalize_or_zero).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_of_a_ball_point_outward() {
        for is_cloud in [false, true] {
            let mut ball = Mesh::sphere(4);
            if is_cloud {
                ball.triangles.clear();
            }
            ball.normals = vec![Vec3::NEG_X; ball.positions.len()];
            ball.estimate_normals(&SurfelOptions::default()).unwrap();
            for (normal, place) in ball.normals.iter().zip(&ball.positions) {
                assert!(normal.dot(place.normalize()) > 0.99, "{is_cloud}: {normal} at {place}");
            }
        }
    }
}
