//! How time grows: with the samples of a volume of the same content, and with the part of the
//! picture that a model fills.

use super::{
    Effort,
    case::{self, Case, Plan, Series},
    surfaces,
};
use glam::DVec3;
use splatkit::session::Subject;
use splatkit::{
    Result,
    bricks::Bricks,
    math::Kernel,
    scene::{Scene, Settings},
    volume::{TransferFunction, phantoms::Phantom},
};
use std::sync::Arc;

/// Samples along each side of the volumes.
const SIDES: [usize; 3] = [64, 128, 256];
/// Samples along each side of the volumes that take minutes and gigabytes.
const MANY_SIDES: [usize; 2] = [512, 1024];
const VOLUME_SIZE: u32 = 512;
/// Points of the model, and how many times wider than the model the picture is.
const POINTS: u32 = 650_000;
const PARTS: [u32; 3] = [1, 4, 16];
const MODEL_SIZE: u32 = 1024;

pub fn plans(effort: Effort) -> Vec<Plan> {
    let many = if effort == Effort::Full { &MANY_SIDES[..] } else { &[] };
    let volume = |&side: &usize| {
        let side = effort.side(side);
        Plan::new(format!("specimen, {side}³"), move || volume(side, effort.pixels(VOLUME_SIZE)))
    };
    let part = |part: u32| {
        let name = if part == 1 {
            "knot, whole width".into()
        } else {
            format!("knot, 1/{part} of the width")
        };
        Plan::new(name, move || {
            let mut case = surfaces::model(effort.points(POINTS), effort.pixels(MODEL_SIZE))?;
            case.distance = f64::from(part);
            let series = Series {
                name: "frame time of a model",
                of: "the part of the width",
                value: 1.0 / f64::from(part),
            };
            case.series = Some(series);
            Ok(case)
        })
    };
    SIDES.iter().chain(many).map(volume).chain(PARTS.map(part)).collect()
}

fn volume(side: usize, size: u32) -> Result<Case> {
    let volume = Phantom::Specimen.sample_bytes([side; 3])?;
    let bounds = volume.bounds();
    // One transfer function for all sizes: the range of values is the same, and opacity holds for a
    // length.
    let small = Phantom::Specimen.sample_bytes([64; 3])?;
    let (kernel, transfer) = (Kernel::default(), TransferFunction::automatic(&small));
    let effective = case::effective(&volume, &kernel, &transfer);
    let samples = volume.len() as f64;
    let scene = Scene::new().with_bricks(Bricks::from_volume(Arc::new(volume))?, kernel, transfer);
    let subject = Subject::new(bounds, DVec3::Z);
    let mut case = Case::new(
        "generated: specimen, in bricks",
        scene,
        subject,
        Settings::new([size; 2]),
        effective,
    );
    case.series = Some(Series { name: "frame time of a volume", of: "samples", value: samples });
    Ok(case)
}
