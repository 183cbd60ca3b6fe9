//! How close the field that the engine draws is to the field that was sampled: the test signal of
//! Marschner and Lobb.
//!
//! A cut through the field is drawn as a picture. Clips leave a slice far thinner than a sample. A
//! transfer function that is opaque within the first hundredth of the slice shows its value as a
//! grey. The picture is read as 32-bit floats.

use super::Stage;
use crate::report::{Cell, Table};
use glam::DVec3;
use splatkit::{
    math::{Camera, Kernel, Projection},
    picture::Picture,
    scene::{Clip, ClipShape, Scene, Settings},
    volume::{TransferFunction, Volume, phantoms::Phantom},
};
use splatkit_tools::{failure::Failure, generate, progress::Progress};

const SIGNAL: Phantom = Phantom::MarschnerLobb;

/// Half the width of the cube that is measured: far enough from the border that no method depends
/// on how it treats the border.
const HALF: f64 = 0.72;
/// Pixels along each side of a cut; a number whose pattern does not repeat with the samples.
const PIXELS: u32 = 89;
/// Cuts through the cube.
const CUTS: u32 = 5;
/// Half the thickness of a cut, in samples.
const SLICE: f64 = 2e-3;
/// The values that black and white stand for: sharp kernels leave 0 … 1.
const GREYS: [f64; 2] = [-0.25, 1.25];

pub fn table(stage: &mut Stage, progress: &Progress) -> Result<Table, Failure> {
    let mut table = Table::new(
        "Marschner–Lobb.",
        format!(
            "Root mean square error × 100 at {CUTS} × {PIXELS}² positions in the middle {HALF} of \
             the cube. The fields of kernels are the engine's; trilinear and Catmull–Rom \
             interpolation of the same samples are listed for comparison."
        ),
        &["reconstruction", "40³", "64³"],
    );
    let sides = [40, 64];
    let mut cartesian = Vec::new();
    for side in sides {
        cartesian.push(SIGNAL.sample([side; 3])?);
    }
    for (name, interpolation) in
        [("trilinear", linear_weights as fn(f64) -> [f64; 4]), ("Catmull–Rom", cubic_weights)]
    {
        let cells =
            cartesian.iter().map(|volume| error(|p| interpolated(volume, p, interpolation)));
        table.row(name, cells.collect());
    }
    let smooth = Kernel::gaussian(0.6, 2.0)?;
    let narrow = Kernel::gaussian(0.7, 3.0)?;
    for (name, body_centred, shape, sharp) in [
        ("smooth: σ 0.6, extent 2", false, &smooth, false),
        ("sharp: σ 0.6, extent 2", false, &smooth, true),
        ("sharp: σ 0.7, extent 3", false, &narrow, true),
        ("body-centred, smooth: σ 0.6, extent 2", true, &smooth, false),
        ("body-centred, sharp: σ 0.7, extent 3", true, &narrow, true),
    ] {
        let mut cells = Vec::new();
        for (side, volume) in sides.into_iter().zip(&cartesian) {
            progress.stage(format!("Marschner–Lobb, {name}, {side}³"));
            let volume = match body_centred {
                true => SIGNAL.sample_on(generate::body_centred(side))?,
                false => volume.clone(),
            };
            let volume = if sharp { volume.sharpened(shape)? } else { volume };
            cells.push(drawn_error(stage, volume, shape.clone())?);
        }
        table.row(name, cells);
    }
    Ok(table)
}

/// Measures the error of the field that the engine draws.
fn drawn_error(stage: &mut Stage, volume: Volume, kernel: Kernel) -> Result<Cell, Failure> {
    let spacing = volume.lattice.kernel_spacing();
    let slice = SLICE * spacing;
    let [low, high] = GREYS;
    let transfer = TransferFunction {
        color: vec![(low, [0.0; 3]), (high, [1.0; 3])],
        opacity: vec![(low, 1.0)],
        // Opaque many times over within the slice.
        unit: 0.1 * slice,
        ..TransferFunction::default()
    };
    let mut scene = stage.prepare(&Scene::new().with_volume(volume, kernel, transfer))?;
    let camera = Camera {
        position: 4.0 * DVec3::Z,
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: Projection::Orthographic { height: 2.0 * HALF },
    };
    let mut squares = 0.0;
    for cut in 0..CUTS {
        let z = depth(cut);
        let mut settings = Settings::new([PIXELS; 2]);
        settings.volume_shade = Some(None);
        settings.sheet_thickness = Some(0.15 * spacing);
        settings.clips = [DVec3::Z, DVec3::NEG_Z]
            .map(|normal| {
                let offset = normal.z * z + slice;
                Clip { shape: ClipShape::HalfSpace { normal, offset }, inside: true }
            })
            .into();
        let picture = stage.draw(&mut scene, &camera, &settings)?;
        squares += squared_error(&picture, z);
    }
    Ok(root_mean(squares))
}

/// Returns the sum of squared errors of a cut; infinite if a pixel shows no value.
fn squared_error(picture: &Picture, z: f64) -> f64 {
    let [low, high] = GREYS;
    let error = |(at, pixel): (usize, &[f32; 4])| {
        let value = low + (high - low) * f64::from(pixel[1]) / f64::from(pixel[3]);
        let squared = (value - SIGNAL.value(place(at, z))).powi(2);
        if squared.is_finite() && pixel[3] > 0.99 { squared } else { f64::INFINITY }
    };
    picture.color.iter().enumerate().map(error).sum()
}

/// Measures the error of a field given as a function.
fn error(field: impl Fn(DVec3) -> f64) -> Cell {
    let mut squares = 0.0;
    for cut in 0..CUTS {
        let places = (0..(PIXELS * PIXELS) as usize).map(|at| place(at, depth(cut)));
        squares += places.map(|p| (field(p) - SIGNAL.value(p)).powi(2)).sum::<f64>();
    }
    root_mean(squares)
}

fn root_mean(squares: f64) -> Cell {
    let mean = squares / f64::from(CUTS * PIXELS * PIXELS);
    Cell::Number(100.0 * mean.sqrt(), 3)
}

/// Returns the height of a cut. The golden ratio spreads the cuts, so that no two lie alike between
/// the samples.
fn depth(cut: u32) -> f64 {
    HALF * (2.0 * (f64::from(cut) * 0.618_033_988_749_895 + 0.5).fract() - 1.0)
}

/// Returns the position of a pixel of a cut. Pixels are in rows from the top.
fn place(at: usize, z: f64) -> DVec3 {
    let side = PIXELS as usize;
    let along = |i: usize| HALF * (2.0 * (i as f64 + 0.5) / side as f64 - 1.0);
    DVec3::new(along(at % side), -along(at / side), z)
}

/// Interpolates a Cartesian volume, with weights for the four nearest samples along each axis.
fn interpolated(volume: &Volume, p: DVec3, weights: fn(f64) -> [f64; 4]) -> f64 {
    let dims = volume.lattice.dims;
    let steps = volume.lattice.axes.inverse() * (p - volume.lattice.origin);
    let cell = steps.floor();
    let [wx, wy, wz] = (steps - cell).to_array().map(weights);
    let index = |axis: usize, i: usize| {
        let at = cell[axis] as isize + i as isize - 1;
        at.clamp(0, dims[axis] as isize - 1) as usize
    };
    let mut sum = 0.0;
    for (k, wz) in wz.into_iter().enumerate() {
        for (j, wy) in wy.into_iter().enumerate() {
            for (i, wx) in wx.into_iter().enumerate() {
                let at = index(0, i) + dims[0] * (index(1, j) + dims[1] * index(2, k));
                sum += wx * wy * wz * volume.value(at);
            }
        }
    }
    sum
}

fn linear_weights(t: f64) -> [f64; 4] {
    [0.0, 1.0 - t, t, 0.0]
}

/// Catmull and Rom 1974.
fn cubic_weights(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        -0.5 * t + t2 - 0.5 * t3,
        1.0 - 2.5 * t2 + 1.5 * t3,
        0.5 * t + 2.0 * t2 - 1.5 * t3,
        -0.5 * t2 + 0.5 * t3,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_has_its_known_errors() {
        let volume = SIGNAL.sample([40; 3]).unwrap();
        for (weights, expected) in
            [(linear_weights as fn(f64) -> [f64; 4], 2.92), (cubic_weights, 1.93)]
        {
            let Cell::Number(error, _) = error(|p| interpolated(&volume, p, weights)) else {
                panic!()
            };
            assert!((error - expected).abs() < 0.1, "{error} is not {expected}");
        }
    }
}
