//! Where inputs are moved to.

use super::Axis;
use crate::{
    Error, Result,
    about::{About, Orientation},
    edit::Motion,
    parallel::prelude::*,
    session::Data,
};
use glam::{DMat3, DVec3, Vec3};
use serde::{Deserialize, Deserializer, Serialize};
use std::path::Path;

/// Where an input is moved to: it is scaled about the world's origin, then turned, then moved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct TransformEntry {
    /// The factor on lengths, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// The turn about an axis through the world's origin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotate: Option<Rotation>,
    /// The move, in world units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub translate: Option<[f64; 3]>,
}

/// A turn about an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Rotation {
    /// The direction of the axis, of any length above 0. In JSON also the name of an axis of the
    /// world: `"x"`, `"y"` or `"z"`.
    #[serde(deserialize_with = "axis")]
    #[cfg_attr(test, schemars(with = "AxisText"))]
    pub axis: [f64; 3],
    /// The angle, counter-clockwise for an eye that looks against the axis.
    pub degrees: f64,
}

/// [`Rotation::axis`] in JSON.
#[derive(Deserialize)]
#[serde(untagged, expecting = "an axis is x, y or z, or three numbers")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
enum AxisText {
    Named(Axis),
    Direction([f64; 3]),
}

fn axis<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<[f64; 3], D::Error> {
    Ok(match AxisText::deserialize(deserializer)? {
        AxisText::Named(Axis::X) => [1.0, 0.0, 0.0],
        AxisText::Named(Axis::Y) => [0.0, 1.0, 0.0],
        AxisText::Named(Axis::Z) => [0.0, 0.0, 1.0],
        AxisText::Direction(direction) => direction,
    })
}

/// A transform as numbers.
struct Similarity {
    scale: f64,
    rotation: DMat3,
    translation: DVec3,
}

impl TransformEntry {
    /// Checks the numbers.
    pub(super) fn check(&self) -> std::result::Result<(), super::appearance::Wrong> {
        if self.scale.is_some_and(|scale| !(scale > 0.0 && scale.is_finite())) {
            return Err(("scale", "must be a factor above 0".into()));
        }
        if self.translate.is_some_and(|by| !by.iter().all(|part| part.is_finite())) {
            return Err(("translate", "must be three finite numbers".into()));
        }
        let turn = self
            .rotate
            .map(|rotation| (DVec3::from_array(rotation.axis).try_normalize(), rotation.degrees));
        if turn.is_some_and(|(axis, angle)| axis.is_none() || !angle.is_finite()) {
            return Err(("rotate", "must be an axis with a length above 0, and an angle".into()));
        }
        Ok(())
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::Argument`] with the name of the field that is wrong.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(|(field, message)| Error::Argument(format!("{field}: {message}")))
    }

    /// Returns the motion; `None` if nothing is moved.
    pub fn motion(&self) -> Option<Motion> {
        let by = (*self != Self::default()).then(|| self.similarity())?;
        let rows = (by.rotation * by.scale).transpose();
        let row = |axis: DVec3, shift: f64| [axis.x, axis.y, axis.z, shift];
        let rows = [
            row(rows.x_axis, by.translation.x),
            row(rows.y_axis, by.translation.y),
            row(rows.z_axis, by.translation.z),
            [0.0, 0.0, 0.0, 1.0],
        ];
        Motion::matrix(rows.as_flattened().try_into().ok()?).ok()
    }

    fn similarity(&self) -> Similarity {
        let rotation = self.rotate.map_or(DMat3::IDENTITY, |Rotation { axis, degrees }| {
            let axis = DVec3::from_array(axis).normalize_or(DVec3::Z);
            DMat3::from_axis_angle(axis, degrees.to_radians())
        });
        let translation = self.translate.map_or(DVec3::ZERO, DVec3::from_array);
        Similarity { scale: self.scale.unwrap_or(1.0), rotation, translation }
    }

    /// Moves the data of a file.
    ///
    /// # Errors
    /// [`Error::Input`] for hierarchies and volumes in bricks, which are read page by page where
    /// they are.
    pub fn apply(&self, path: &Path, data: &mut Data) -> Result<()> {
        if *self == Self::default() {
            return Ok(());
        }
        let by = self.similarity();
        match data {
            Data::Mesh(mesh) => {
                mesh.turn(by.rotation);
                by.shift(&mut mesh.origin, &mut mesh.positions);
                mesh.radii.par_iter_mut().for_each(|radius| *radius *= by.scale as f32);
                let scale = by.scale as f32;
                mesh.sensors.iter_mut().for_each(|sensor| sensor.position *= scale);
                by.stand(&mut mesh.about);
            }
            Data::Volume(volume) => {
                let lattice = &mut volume.lattice;
                lattice.origin = by.place(lattice.origin);
                lattice.axes = by.rotation * lattice.axes * by.scale;
                by.stand(&mut volume.about);
            }
            Data::Samples(points) => {
                by.turn(&mut points.origin, &mut points.positions);
                points.radii.par_iter_mut().for_each(|radius| *radius *= by.scale as f32);
                points
                    .covariances
                    .par_iter_mut()
                    .for_each(|covariance| *covariance = by.covariance(*covariance));
                by.stand(&mut points.about);
            }
            Data::Cells(cells) => {
                by.turn(&mut cells.origin, &mut cells.points);
                by.stand(&mut cells.about);
            }
            Data::Gaussians(set) => {
                set.turn(by.rotation);
                by.shift(&mut set.origin, &mut set.centers);
                set.scales.par_iter_mut().for_each(|scale| *scale *= by.scale as f32);
                by.stand(&mut set.about);
            }
            Data::Hierarchy(_) | Data::Bricks(_) => {
                let message = "a file that is read page by page cannot be moved";
                let error = Error::input(path, "transform", message);
                return Err(error.hint("move the file that it was converted from"));
            }
        }
        Ok(())
    }
}

impl Similarity {
    fn place(&self, point: DVec3) -> DVec3 {
        self.rotation * point * self.scale + self.translation
    }

    /// Scales and moves what is turned already.
    fn shift(&self, origin: &mut DVec3, positions: &mut [Vec3]) {
        *origin = *origin * self.scale + self.translation;
        positions.par_iter_mut().for_each(|position| *position *= self.scale as f32);
    }

    fn turn(&self, origin: &mut DVec3, positions: &mut [Vec3]) {
        *origin = self.place(*origin);
        let linear = (self.rotation * self.scale).as_mat3();
        positions.par_iter_mut().for_each(|position| *position = linear * *position);
    }

    fn covariance(&self, [xx, xy, xz, yy, yz, zz]: [f32; 6]) -> [f32; 6] {
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]].map(|row| row.map(f64::from));
        let linear = self.rotation * self.scale;
        let turned = linear * DMat3::from_cols_array_2d(&rows) * linear.transpose();
        let [x, y, z] = turned.to_cols_array_2d();
        [x[0], x[1], x[2], y[1], y[2], z[2]].map(|part| part as f32)
    }

    fn stand(&self, about: &mut About) {
        let turned = |Orientation { up, front }| Orientation {
            up: self.rotation * up,
            front: self.rotation * front,
        };
        about.orientation = about.orientation.map(turned);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{gaussians::Gaussians, surface::Mesh, volume::phantoms::Phantom};

    fn entry() -> TransformEntry {
        let rotate = Some(Rotation { axis: [0.0, 0.0, 2.0], degrees: 90.0 });
        TransformEntry { scale: Some(2.0), rotate, translate: Some([1.0, 0.0, 0.0]) }
    }

    /// x becomes 2y + 1 along x, y becomes −2x, z becomes 2z.
    fn place(point: DVec3) -> DVec3 {
        DVec3::new(1.0 - 2.0 * point.y, 2.0 * point.x, 2.0 * point.z)
    }

    #[test]
    fn an_axis_has_a_name_or_numbers() {
        let axis = |axis: serde_json::Value| {
            let text = serde_json::json!({"axis": axis, "degrees": 90}).to_string();
            let rotation: std::result::Result<Rotation, _> = serde_json::from_str(&text);
            rotation.map(|rotation| rotation.axis).map_err(|error| error.to_string())
        };
        assert_eq!(axis("y".into()), Ok([0.0, 1.0, 0.0]));
        assert_eq!(axis(vec![0.0, 2.0, 1.0].into()), Ok([0.0, 2.0, 1.0]));
        let error = axis("w".into()).expect_err("an error");
        assert!(error.starts_with("an axis is x, y or z, or three numbers"), "{error}");
    }

    #[test]
    fn each_kind_of_data_is_moved() {
        let path = Path::new("a");
        let mesh = Mesh { origin: DVec3::new(3.0, 0.0, 5.0), ..Mesh::sphere(1) };
        let mut moved = Data::Mesh(mesh.clone());
        entry().apply(path, &mut moved).unwrap();
        let Data::Mesh(moved) = moved else { panic!("a mesh") };
        for (before, after) in mesh.positions.iter().zip(&moved.positions) {
            let wanted = place(mesh.origin + before.as_dvec3());
            assert!((moved.origin + after.as_dvec3()).abs_diff_eq(wanted, 1e-5));
        }
        let volume = Phantom::Ball.sample([5; 3]).unwrap();
        let places = [DVec3::ZERO, DVec3::new(4.0, 0.0, 2.0)];
        let corners = places.map(|at| volume.lattice.position(at));
        let mut moved = Data::Volume(volume);
        entry().apply(path, &mut moved).unwrap();
        let Data::Volume(moved) = moved else { panic!("a volume") };
        for (at, before) in places.into_iter().zip(corners) {
            assert!(moved.lattice.position(at).abs_diff_eq(place(before), 1e-12));
        }
        let set: Gaussians = crate::gaussians::phantom(20);
        let mut moved = Data::Gaussians(set.clone());
        entry().apply(path, &mut moved).unwrap();
        let Data::Gaussians(moved) = moved else { panic!("Gaussians") };
        assert!(moved.scales[3].abs_diff_eq(2.0 * set.scales[3], 1e-6));
        let wanted = place(set.origin + set.centers[3].as_dvec3());
        assert!((moved.origin + moved.centers[3].as_dvec3()).abs_diff_eq(wanted, 1e-4));
        let turned = entry().similarity().covariance([4.0, 0.0, 0.0, 1.0, 0.0, 9.0]);
        assert!(
            turned.iter().zip([4.0, 0.0, 0.0, 16.0, 0.0, 36.0]).all(|(a, b)| (a - b).abs() < 1e-4)
        );
    }

    #[test]
    fn what_cannot_be_is_named() {
        let wrong = |entry: TransformEntry| entry.check().unwrap_err().0;
        assert_eq!(wrong(TransformEntry { scale: Some(0.0), ..entry() }), "scale");
        assert_eq!(
            wrong(TransformEntry { translate: Some([f64::NAN; 3]), ..entry() }),
            "translate"
        );
        let rotate = Some(Rotation { axis: [0.0; 3], degrees: 1.0 });
        assert_eq!(wrong(TransformEntry { rotate, ..entry() }), "rotate");
        assert!(entry().check().is_ok());
    }
}
