//! What lies under the cursor.

use super::field::Field;
use crate::{
    math::{Bounds, View},
    picture::Picture,
    scene::{Clip, Item, Scene},
};
use glam::{DVec2, DVec3};

/// Most places of a ray that are looked at.
const MOST_STEPS: f64 = 65_536.0;

/// Looks up values and places in a scene.
///
/// ```
/// use splatkit::{
///     glam::{DVec2, DVec3},
///     interaction::Probe,
///     math::{Camera, Kernel},
///     scene::Scene,
///     volume::{TransferFunction, phantoms::Phantom},
/// };
///
/// // A ball that is brightest in its middle.
/// let volume = Phantom::Ball.sample([33; 3])?;
/// let transfer = TransferFunction::automatic(&volume);
/// let scene = Scene::new().with_volume(volume, Kernel::default(), transfer);
/// let probe = Probe::new(&scene);
/// assert!(probe.value_at(DVec3::ZERO).unwrap() > 0.9);
/// let camera = Camera::framing(&scene.bounds(), DVec3::NEG_Z, DVec3::Y, 1.0);
/// let middle = probe.maximum_along(&camera.view([64, 64])?, DVec2::splat(32.0), &[]);
/// assert!(middle.unwrap().1.length() < 0.05);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Probe<'a> {
    fields: Vec<Lit<'a>>,
}

/// A field and the box that contains it.
#[derive(Debug, Clone)]
struct Lit<'a> {
    field: Field<'a>,
    bounds: Bounds,
    /// The smallest distance between samples, in world units.
    spacing: f64,
}

impl<'a> Probe<'a> {
    /// Prepares the volumes of a scene. That is quick, because no samples are looked at.
    ///
    /// Volumes in memory have values. Bricks, cells and scattered samples have none, nor have
    /// volumes that [`Reconstruction::new`](crate::volume::Reconstruction::new) refuses for their
    /// kernel.
    pub fn new(scene: &'a Scene) -> Self {
        let field = |item: &'a Item| match item {
            Item::Volume(volume, kernel, _) => Some(Lit {
                field: Field::new(volume, kernel).ok()?,
                bounds: item.bounds(),
                spacing: volume.lattice.least_kernel_spacing(),
            }),
            _ => None,
        };
        Self { fields: scene.items.iter().filter_map(field).collect() }
    }

    /// Returns the value at a world position: that of the first volume whose kernels reach it,
    /// reconstructed by its kernel. On rectilinear lattices, values are linear between samples.
    /// `None` where there is no volume.
    pub fn value_at(&self, world: DVec3) -> Option<f64> {
        self.fields.iter().find_map(|lit| lit.field.value_at(world))
    }

    /// Returns the largest value along the ray of a point of the picture, in pixels from its upper
    /// left corner, and the place of that value in the world. Of equal values, the nearest counts.
    /// Only places that all `clips` keep count.
    ///
    /// The ray is followed in steps of half the distance between samples; in longer ones, if there
    /// would be more than 65,536. `None` if the ray meets no volume.
    pub fn maximum_along(&self, view: &View, pixel: DVec2, clips: &[Clip]) -> Option<(f64, DVec3)> {
        let (origin, direction) = view.ray(pixel);
        let to_world = view.rotation.transpose();
        let (origin, direction) = (view.position + to_world * origin, to_world * direction);
        // Nothing is seen behind the eye.
        let nearest = if view.perspective { 0.0 } else { f64::NEG_INFINITY };
        let mut best: Option<(f64, f64)> = None;
        for Lit { field, bounds, spacing } in &self.fields {
            let Some([enter, leave]) = crossing(bounds, origin, direction) else { continue };
            let enter = enter.max(nearest);
            let length = leave - enter;
            if !(length >= 0.0 && length.is_finite()) {
                continue;
            }
            let steps = (length / (0.5 * spacing)).ceil().clamp(1.0, MOST_STEPS);
            for step in 0..=steps as usize {
                let along = enter + length * (step as f64 / steps);
                let place = origin + along * direction;
                if !clips.iter().all(|clip| clip.keeps(place)) {
                    continue;
                }
                let Some(value) = field.value_at(place) else { continue };
                if best.is_none_or(|(most, at)| value > most || (value == most && along < at)) {
                    best = Some((value, along));
                }
            }
        }
        best.map(|(value, along)| (value, origin + along * direction))
    }

    /// Returns the world point that a picture shows at a point of its view, in pixels of the view
    /// from its upper left corner. `None` where the picture has no depth, and outside it.
    ///
    /// The picture may have fewer pixels than the view, as a coarse one that is shown meanwhile.
    pub fn picked(picture: &Picture, view: &View, pixel: DVec2) -> Option<DVec3> {
        let size = DVec2::from_array(view.size.map(f64::from));
        let dims = [picture.width, picture.height];
        let place = pixel / size * DVec2::from_array(dims.map(f64::from));
        let inside = |axis: usize| place[axis] >= 0.0 && place[axis] < f64::from(dims[axis]);
        if !(inside(0) && inside(1)) {
            return None;
        }
        let at = place.y as usize * picture.width as usize + place.x as usize;
        let depth = f64::from(*picture.depth.get(at)?);
        if !depth.is_finite() {
            return None;
        }
        let across = (pixel - view.center) / view.scale;
        let across = if view.perspective { across * depth } else { across };
        Some(view.position + view.rotation.transpose() * across.extend(depth))
    }
}

/// Returns how far along a ray it enters and leaves a box; `None` if it misses the box.
fn crossing(bounds: &Bounds, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        if direction[axis] == 0.0 {
            if !(low..=high).contains(&origin[axis]) {
                return None;
            }
            continue;
        }
        let ends = [low, high].map(|end| (end - origin[axis]) / direction[axis]);
        enter = enter.max(ends[0].min(ends[1]));
        leave = leave.min(ends[0].max(ends[1]));
    }
    (enter <= leave).then_some([enter, leave])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Device, Renderer,
        math::{Camera, Kernel},
        scene::{ClipShape, Settings},
        volume::{
            Arrangement, Lattice, Reconstruction, TransferFunction, Volume, phantoms::Phantom,
        },
    };
    use glam::DMat3;
    use std::sync::Arc;

    fn opaque() -> TransferFunction {
        TransferFunction { opacity: vec![(0.0, 0.0), (0.5, 1.0)], unit: 0.01, ..Default::default() }
    }

    fn scene(volume: Volume) -> Scene {
        Scene::new().with_volume(volume, Kernel::default(), opaque())
    }

    fn cameras(scene: &Scene) -> [Camera; 2] {
        let camera =
            Camera::framing(&scene.bounds(), DVec3::new(0.3, 0.2, -1.0), DVec3::Y, 4.0 / 3.0);
        let mut parallel = camera.clone();
        parallel.make_orthographic();
        [camera, parallel]
    }

    #[test]
    fn values_are_those_of_the_kernel() {
        let volume = Phantom::MarschnerLobb.sample([21; 3]).unwrap();
        let scene = scene(volume.clone());
        let (probe, kernel) = (Probe::new(&scene), Kernel::default());
        let reconstruction = Reconstruction::new(&volume, &kernel).unwrap();
        for place in [DVec3::ZERO, DVec3::new(0.31, -0.77, 0.12), DVec3::splat(0.999)] {
            let value = probe.value_at(place);
            assert!(value.is_some() && value == reconstruction.value_at(place), "{place}");
        }
        assert_eq!(probe.value_at(DVec3::splat(5.0)), None);
        assert_eq!(Probe::new(&Scene::new()).value_at(DVec3::ZERO), None);
    }

    #[test]
    fn volumes_that_contradict_themselves_have_no_values() {
        let mut volume = Phantom::Ball.sample([5; 3]).unwrap();
        volume.lattice.dims = [6; 3];
        let scene = scene(volume);
        assert_eq!(Probe::new(&scene).value_at(DVec3::ZERO), None);
    }

    #[test]
    fn rectilinear_fields_are_linear_between_samples() {
        let places = [vec![-1.0, 0.0, 3.0], vec![0.0, 0.5, 2.0], vec![1.0]];
        let lattice = Lattice {
            dims: [3, 3, 1],
            origin: DVec3::new(10.0, 0.0, 0.0),
            axes: DMat3::IDENTITY * 2.0,
            arrangement: Arrangement::Rectilinear(Arc::new(places)),
        };
        let value = |p: DVec3| 2.0 * p.x - p.y;
        let samples = (0..9).map(|at| value(lattice.sample_position(at)) as f32).collect();
        let volume = Volume::new(lattice, crate::volume::Samples::F32(samples)).unwrap();
        let scene = scene(volume);
        let probe = Probe::new(&scene);
        for place in [DVec3::new(8.0, 0.0, 2.0), DVec3::new(13.5, 3.25, 2.0)] {
            assert!((probe.value_at(place).unwrap() - value(place)).abs() < 1e-9, "{place}");
        }
        assert_eq!(probe.value_at(DVec3::new(16.5, 1.0, 2.0)), None);
        assert_eq!(probe.value_at(DVec3::new(12.0, 1.0, 4.0)), None);
    }

    #[test]
    fn the_maximum_of_a_ball_is_nearest_to_its_centre() {
        let scene = scene(Phantom::Ball.sample([33; 3]).unwrap());
        let probe = Probe::new(&scene);
        for camera in cameras(&scene) {
            let view = camera.view([80, 60]).unwrap();
            let (value, place) = probe.maximum_along(&view, view.center, &[]).unwrap();
            assert!(value > 0.95 && place.length() < 0.05, "{value} {place}");
            // Off the middle, the place is where the ray is perpendicular to its radius.
            let pixel = DVec2::new(50.0, 25.0);
            let (_, place) = probe.maximum_along(&view, pixel, &[]).unwrap();
            let ray = view.rotation.transpose() * view.ray(pixel).1;
            assert!(ray.dot(place).abs() < 0.06 && place.length() > 0.1, "{place}");
            assert_eq!(probe.maximum_along(&view, DVec2::new(-500.0, 0.0), &[]), None);
        }
    }

    #[test]
    fn clipped_places_do_not_count() {
        let scene = scene(Phantom::Ball.sample([33; 3]).unwrap());
        let probe = Probe::new(&scene);
        let [camera, _] = cameras(&scene);
        let view = camera.view([80, 60]).unwrap();
        let shape = ClipShape::HalfSpace { normal: DVec3::Z, offset: -0.3 };
        let (value, place) =
            probe.maximum_along(&view, view.center, &[Clip { shape, inside: true }]).unwrap();
        assert!(place.z <= -0.3 && place.z > -0.4 && value < 0.9, "{value} {place}");
        let nothing = Clip { shape: ClipShape::Box(scene.bounds()), inside: false };
        assert_eq!(probe.maximum_along(&view, view.center, &[nothing]), None);
    }

    #[test]
    fn picked_points_lie_on_what_is_drawn() {
        let scene = scene(Phantom::Ball.sample_bytes([32; 3]).unwrap());
        let steep = TransferFunction {
            opacity: vec![(100.0, 0.0), (102.0, 1.0)],
            unit: 0.001,
            ..Default::default()
        };
        let Item::Volume(volume, kernel, _) = scene.items[0].clone() else { unreachable!() };
        let scene = Scene::new().with_volume(volume, kernel, steep);
        let probe = Probe::new(&scene);
        for camera in cameras(&scene) {
            // The picture is half as fine as the view.
            let mut renderer = Renderer::new(&Device::Cpu, &scene).unwrap();
            let (picture, _) = renderer.render(&camera, &Settings::new([80, 60])).unwrap();
            let view = camera.view([160, 120]).unwrap();
            for pixel in [DVec2::new(80.5, 60.5), DVec2::new(88.5, 55.5)] {
                let place = Probe::picked(&picture, &view, pixel).unwrap();
                let value = probe.value_at(place).unwrap();
                // The field is opaque from 102 on. A depth is exact to about a sheet, which is as
                // thick as a sample's distance: 30 in value.
                assert!((value - 101.0).abs() < 45.0, "{value} at {place}");
                let back = view.to_view(place);
                let depth = if view.perspective { back.z } else { 1.0 };
                let seen = view.center + view.scale * back.truncate() / depth;
                assert!(seen.distance(pixel) < 1e-6, "{seen} {pixel}");
            }
            assert_eq!(Probe::picked(&picture, &view, DVec2::new(0.5, 0.5)), None);
            assert_eq!(Probe::picked(&picture, &view, DVec2::new(160.5, 0.5)), None);
            assert_eq!(Probe::picked(&picture, &view, DVec2::new(-0.5, 60.0)), None);
        }
    }
}
