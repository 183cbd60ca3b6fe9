//! Pictures that can be computed by hand.

mod fields;
mod isosurfaces;
mod modes;
mod optics;
mod surfaces;
mod truth;

use super::*;
use crate::{
    compare::compare_pictures,
    math::{Kernel as Shape, Projection},
    scene,
    splat::{NO_NORMAL, SampleSplats, Splat, Surfels},
    volume::{Samples, TransferFunction, Volume},
};
use glam::{DMat3, Vec3};
use std::sync::Arc;

const PROJECTIONS: [Projection; 2] =
    [Projection::Perspective { view_angle: 40.0 }, Projection::Orthographic { height: 4.0 }];

/// A camera that looks at the world's origin at an oblique angle.
fn camera(projection: Projection) -> Camera {
    Camera {
        position: DVec3::new(4.0, -3.0, 2.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Z,
        projection,
    }
}

fn unshaded(size: [u32; 2]) -> Settings {
    Settings { surface_shade: None, volume_shade: Some(None), ..Settings::new(size) }
}

/// A transfer function with one colour and one extinction for all values.
fn uniform(color: [f64; 3], extinction: f64) -> TransferFunction {
    let opacity = -(-extinction).exp_m1();
    TransferFunction {
        color: vec![(0.0, color)],
        opacity: vec![(0.0, opacity)],
        unit: 1.0,
        ..TransferFunction::default()
    }
}

fn volume(lattice: Lattice, value: impl Fn(DVec3) -> f64) -> Arc<Volume> {
    let samples = (0..lattice.len()).map(|i| value(lattice.sample_position(i)) as f32).collect();
    Arc::new(Volume::new(lattice, Samples::F32(samples)).unwrap())
}

/// A lattice centred at the world's origin, with given steps between its samples.
fn centered(dims: [usize; 3], axes: DMat3) -> Lattice {
    let last = DVec3::from(dims.map(|n| n as f64 - 1.0));
    Lattice::cartesian(dims, -0.5 * (axes * last), axes)
}

fn skewed_axes() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.2, 0.05, 0.0),
        DVec3::new(-0.04, 0.25, 0.06),
        DVec3::new(0.05, 0.0, 0.3),
    )
}

fn round(center: Vec3, strength: f32, deviation: f32) -> Splat {
    let factor = [deviation, 0.0, deviation, 0.0, 0.0, deviation];
    Splat { center: center.to_array(), strength, factor, color: 0xff_40_80_c0, normal: NO_NORMAL }
}

fn surfels(splats: Vec<Splat>) -> Surfels {
    Surfels { origin: DVec3::ZERO, splats, extent: 8.0 }
}

fn sample_splats(splats: Vec<Splat>) -> SampleSplats {
    SampleSplats { origin: DVec3::ZERO, splats, extent: 8.0, overlap: 1.0 }
}

fn close(value: impl Into<f64>, expected: f64, tolerance: f64) {
    let value = value.into();
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected} ± {tolerance}");
}

/// A round scattered sample.
fn sample(center: Vec3, value: f32, deviation: f32) -> Splat {
    Splat::sample(center, value, [deviation, 0.0, deviation, 0.0, 0.0, deviation], 1.0, Vec3::ZERO)
}

/// A camera that looks down the world's z axis from a height, with parallel rays.
fn from_above(height: f64, window: f64) -> Camera {
    Camera {
        position: DVec3::new(0.0, 0.0, height),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: Projection::Orthographic { height: window },
    }
}

/// The PSNR of two pictures, in decibels.
fn decibels(a: &Picture, b: &Picture) -> f64 {
    compare_pictures(a, b).unwrap().psnr.unwrap_or(f64::INFINITY)
}

/// The composite of a pixel's ray.
fn pixel(frame: &Frame, column: i64, row: i64) -> Composite {
    frame.pixel_of_sheets(column, &frame.met_by_row(row))
}

/// Pseudo-random numbers in −1 … 1, the same in every run (Marsaglia's xorshift, 2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn point(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.next()))
    }
}
