//! What culling saves: pictures with invisible parts left out, and drawn.

use super::{
    Effort,
    case::{self, Case, Plan},
    surfaces,
};
use glam::DVec3;
use splatkit::session::Subject;
use splatkit::{
    Result,
    scene::{Scene, Settings},
    surface::Mesh,
    volume::{Shade, TransferFunction, phantoms::Phantom},
};
use std::sync::Arc;

/// Samples along each side of the volume.
const SIDE: usize = 256;
const VOLUME_SIZE: u32 = 512;
/// Points of the model.
const POINTS: u32 = 650_000;
const MODEL_SIZE: u32 = 1024;

/// The parts that are left out of a picture.
#[derive(Debug, Clone, Copy)]
enum Culling {
    /// Hidden parts, and the back faces of closed surfaces.
    All,
    NoOcclusion,
    NoBackfaces,
}

impl Culling {
    fn name(self) -> &'static str {
        match self {
            Self::All => "all culling",
            Self::NoOcclusion => "occlusion off",
            Self::NoBackfaces => "back faces drawn",
        }
    }

    fn set(self, settings: &mut Settings) {
        match self {
            Self::All => {}
            Self::NoOcclusion => settings.occlusion = false,
            Self::NoBackfaces => settings.cull_backfaces = Some(false),
        }
    }
}

pub fn plans(effort: Effort) -> Vec<Plan> {
    let plan = |name: &str, culling: Culling, make: fn(Effort) -> Result<Case>| {
        Plan::new(format!("{name}, {}", culling.name()), move || {
            let mut case = make(effort)?;
            culling.set(&mut case.settings);
            Ok(case)
        })
    };
    vec![
        plan("opaque volume", Culling::All, opaque_volume),
        plan("opaque volume", Culling::NoOcclusion, opaque_volume),
        plan("semitransparent volume", Culling::All, clear_volume),
        plan("semitransparent volume", Culling::NoOcclusion, clear_volume),
        plan("knot in a sphere", Culling::All, hidden_model),
        plan("knot in a sphere", Culling::NoOcclusion, hidden_model),
        plan("knot in a sphere", Culling::NoBackfaces, hidden_model),
    ]
}

/// Makes a volume that is opaque from its rind on.
fn opaque_volume(effort: Effort) -> Result<Case> {
    volume(effort, 0.95)
}

/// Makes the same volume so thin that nothing is hidden, though a line through all of it may become
/// opaque.
fn clear_volume(effort: Effort) -> Result<Case> {
    volume(effort, 0.02)
}

fn volume(effort: Effort, opacity: f64) -> Result<Case> {
    let volume = Phantom::Specimen.sample_bytes([effort.side(SIDE); 3])?;
    let bounds = volume.bounds();
    let transfer = TransferFunction {
        color: vec![(20.0, [0.7, 0.3, 0.2]), (255.0, [1.0, 0.9, 0.7])],
        opacity: vec![(20.0, 0.0), (60.0, opacity)],
        unit: volume.lattice.kernel_spacing(),
        shade: Some(Shade::default()),
        ..TransferFunction::default()
    };
    let (scene, effective) = case::volume(Arc::new(volume), transfer);
    let subject = Subject::new(bounds, DVec3::Z);
    Ok(Case::new(
        "generated: specimen",
        scene,
        subject,
        Settings::new([effort.pixels(VOLUME_SIZE); 2]),
        effective,
    ))
}

/// Makes a knot inside a sphere of about as many points, which hides the knot.
fn hidden_model(effort: Effort) -> Result<Case> {
    let mut case = surfaces::model(effort.points(POINTS), effort.pixels(MODEL_SIZE))?;
    let reach = case.subject.bounds.diagonal() * 0.5;
    // A sphere has 10·4ⁿ + 2 points.
    let cuts = (f64::from(effort.points(POINTS)) / 10.0).log(4.0).round() as u32;
    let mut sphere = Mesh::sphere(cuts);
    sphere.positions.iter_mut().for_each(|place| *place *= reach as f32);
    let (sphere, bounds) = surfaces::hierarchy(&sphere)?;
    case.effective += sphere.header().leaves;
    case.scene = std::mem::replace(&mut case.scene, Scene::new()).with_hierarchy(sphere);
    case.subject.bounds = bounds;
    case.drawn = "generated: knot, sphere".into();
    Ok(case)
}
