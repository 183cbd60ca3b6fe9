//! The usual camera of a scene.

use super::{Framing, Subject};
use crate::{
    Result,
    about::Orientation,
    math::Camera,
    scene::{Item, Scene},
};

impl Camera {
    /// Returns the camera that shows the whole of a scene in a picture of `size` pixels (width,
    /// height). It looks from the front, a little from the right and from above, and what is seen
    /// fills the picture. This is the camera of `splatkit render` if the items say which way is up.
    /// A mesh that a program adds does not, and stands with +y up.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for a scene that no camera can hold. Errors of
    /// reading pages and bricks.
    pub fn fit(scene: &Scene, size: [u32; 2]) -> Result<Self> {
        let mut subject = Subject::default();
        subject.count_in(scene.bounds(), None);
        for item in &scene.items {
            let (stated, usual) = match item {
                Item::Volume(volume, ..) => (volume.about.orientation, Orientation::SURVEY),
                Item::Bricks(bricks, ..) => (bricks.header().orientation(), Orientation::SURVEY),
                Item::Gaussians(set) => (set.about.orientation, Orientation::Y_DOWN),
                Item::Hierarchy(hierarchy) => (hierarchy.header().orientation, Orientation::Y_UP),
                Item::Scalar(..) | Item::Cells(..) | Item::Solid(_) => (None, Orientation::SURVEY),
                Item::Radiance(_) | Item::Facets(_) => continue,
            };
            // A program has no names to warn of contradictions with.
            let _ = subject.orient_as_stated("", stated, usual);
        }
        subject.seen = scene.seen(&[])?;
        Framing::default().camera(&subject, size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::{Kernel, Pose},
        surface::{Mesh, SurfelOptions},
        volume::{TransferFunction, phantoms::Phantom},
    };
    use glam::{DQuat, DVec3};

    #[test]
    fn a_volume_stands_with_z_up_and_a_mesh_with_y() {
        let volume = Phantom::Ball.sample_bytes([12; 3]).unwrap();
        let transfer = TransferFunction::automatic(&volume);
        let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
        let is_up = |scene: &Scene, axis: DVec3| {
            Camera::fit(scene, [40, 30]).unwrap().view_up.dot(axis) > 0.9
        };
        assert!(is_up(&scene, DVec3::Z));
        let ball = Mesh::sphere(2).surfels(&SurfelOptions::default()).unwrap();
        assert!(is_up(&Scene::new().with_splats(ball), DVec3::Y));
    }

    #[test]
    fn an_item_is_fitted_where_it_is_moved_to() {
        let facets = Mesh::sphere(2).facets(&SurfelOptions::default()).unwrap();
        let mut scene = Scene::new().with_facets(facets.unwrap());
        let before = Camera::fit(&scene, [40, 30]).unwrap();
        let translation = DVec3::new(100.0, 0.0, -5.0);
        scene.set_pose(0, Pose { rotation: DQuat::IDENTITY, translation }).unwrap();
        let after = Camera::fit(&scene, [40, 30]).unwrap();
        assert!((after.position - before.position).abs_diff_eq(translation, 0.2), "{after:?}");
    }
}
