//! Moves of items: similarities, one after the other.

use crate::errors::{options, raise, wrong};
use pyo3::prelude::*;
use serde::Deserialize;
use splatkit::{
    Error,
    glam::{DMat3, DQuat, DVec3},
    session::{Rotation, TransformEntry},
};

/// How far the axes of a matrix may be from those of a similarity, as a part of their length.
const TOLERANCE: f64 = 1e-6;

/// A move, as Python says it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Move {
    scale: Option<f64>,
    rotate: Option<Rotation>,
    translate: Option<[f64; 3]>,
    /// The rows of a matrix of 4 × 4.
    matrix: Option<[[f64; 4]; 4]>,
}

/// A similarity: scale, then turn, then move.
struct Similarity {
    scale: f64,
    turn: DMat3,
    shift: DVec3,
}

/// Returns where an item is moved to by a further move, both as JSON.
#[pyfunction]
pub fn moved(py: Python<'_>, before: &str, further: &str) -> PyResult<String> {
    let text = || -> Result<String, Error> {
        let (before, further): (TransformEntry, Move) = (options(before)?, options(further)?);
        let Move { scale, rotate, translate, matrix } = further;
        let step = TransformEntry { scale, rotate, translate };
        step.validate()?;
        // A first move keeps its numbers.
        let after = match matrix {
            None if before == TransformEntry::default() => step,
            None => Similarity::of(&step).after(&Similarity::of(&before)).entry(),
            Some(rows) => {
                let whole = Similarity::of(&step).after(&Similarity::of_matrix(rows)?);
                whole.after(&Similarity::of(&before)).entry()
            }
        };
        after.validate()?;
        Ok(serde_json::json!(after).to_string())
    };
    text().map_err(|error| raise(py, &error))
}

impl Similarity {
    fn of(entry: &TransformEntry) -> Self {
        let turn = entry.rotate.map_or(DMat3::IDENTITY, |Rotation { axis, degrees }| {
            let axis = DVec3::from_array(axis).normalize_or(DVec3::Z);
            DMat3::from_axis_angle(axis, degrees.to_radians())
        });
        let shift = entry.translate.map_or(DVec3::ZERO, DVec3::from_array);
        Self { scale: entry.scale.unwrap_or(1.0), turn, shift }
    }

    /// Returns the similarity of a matrix. A matrix that skews or mirrors is none.
    fn of_matrix([x, y, z, last]: [[f64; 4]; 4]) -> Result<Self, Error> {
        let linear =
            DMat3::from_cols_array_2d(&[x, y, z].map(|[a, b, c, _]| [a, b, c])).transpose();
        let shift = DVec3::new(x[3], y[3], z[3]);
        let scale = linear.determinant().cbrt();
        let turn = linear * scale.recip();
        let is_turn = (turn.transpose() * turn).abs_diff_eq(DMat3::IDENTITY, TOLERANCE);
        if last != [0.0, 0.0, 0.0, 1.0] || !shift.is_finite() || !(scale > 0.0 && is_turn) {
            return Err(wrong(
                "matrix: a move scales all axes alike, turns and shifts; this matrix skews, \
                 mirrors or flattens, or its last row is not 0, 0, 0, 1",
            ));
        }
        Ok(Self { scale, turn, shift })
    }

    /// Returns this move after another one.
    fn after(&self, before: &Self) -> Self {
        Self {
            scale: self.scale * before.scale,
            turn: self.turn * before.turn,
            shift: self.turn * before.shift * self.scale + self.shift,
        }
    }

    fn entry(&self) -> TransformEntry {
        let (axis, angle) = DQuat::from_mat3(&self.turn).normalize().to_axis_angle();
        let rotate = Rotation { axis: axis.to_array(), degrees: angle.to_degrees() };
        TransformEntry {
            scale: Some(self.scale),
            rotate: Some(rotate),
            translate: Some(self.shift.to_array()),
        }
    }
}
