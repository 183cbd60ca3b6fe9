//! A case of the suite: a scene and its view.

use splatkit::session::{Framing, Subject};
use splatkit::{
    math::{Camera, Kernel},
    scene::{Evaluate, Scene, Settings},
    volume::{TransferFunction, Volume, reach::first_visible},
};
use std::sync::Arc;

/// A case before its scene is made, so that only one scene is in memory at a time.
pub struct Plan {
    pub name: String,
    /// Makes the case, or returns the reason why it cannot.
    pub make: Box<dyn FnOnce() -> splatkit::Result<Case>>,
}

impl Plan {
    pub fn new(
        name: impl Into<String>,
        make: impl FnOnce() -> splatkit::Result<Case> + 'static,
    ) -> Self {
        Self { name: name.into(), make: Box::new(make) }
    }
}

pub struct Case {
    /// The file, or the generated content.
    pub drawn: String,
    pub scene: Scene,
    pub subject: Subject,
    pub settings: Settings,
    /// Distance of the camera, in multiples of the distance at which the scene fills the picture.
    pub distance: f64,
    /// Splats that could be visible: all surfels, or the samples that the transfer function does
    /// not leave out.
    pub effective: u64,
    pub seed: Option<Seed>,
    pub series: Option<Series>,
}

/// The case's entry in the classic table (`seed`).
#[derive(Debug, Clone, Copy)]
pub struct Seed {
    pub splats: u64,
    pub fps: f64,
}

/// Cases that differ in one number only, and that number.
#[derive(Debug, Clone)]
pub struct Series {
    pub name: &'static str,
    /// What the number counts.
    pub of: &'static str,
    pub value: f64,
}

impl Case {
    pub fn new(
        drawn: impl Into<String>,
        scene: Scene,
        subject: Subject,
        settings: Settings,
        effective: u64,
    ) -> Self {
        // The tables count splats, which gathering does not draw.
        let settings = Settings { evaluate: Evaluate::Scatter, ..settings };
        Self {
            drawn: drawn.into(),
            scene,
            subject,
            settings,
            distance: 1.0,
            effective,
            seed: None,
            series: None,
        }
    }

    /// Returns the camera of `bench`, turned by `turn` degrees about the up axis.
    pub fn camera(&self, turn: f64) -> Camera {
        let mut camera = Framing::default().turned(&self.subject, self.settings.size, turn);
        camera.position =
            camera.focal_point + self.distance * (camera.position - camera.focal_point);
        camera
    }
}

/// Returns how many samples of a volume the engine keeps under a transfer function.
pub fn effective(volume: &Volume, kernel: &Kernel, transfer: &TransferFunction) -> u64 {
    let first = first_visible(transfer, volume.range);
    let ranges = volume.drawn_ranges(kernel);
    ranges.iter().filter(|[low, high]| u16::from(*high) >= first[usize::from(*low)]).count() as u64
}

/// Returns a scene of a volume under a transfer function, and how many of its samples are visible.
pub fn volume(volume: Arc<Volume>, transfer: TransferFunction) -> (Scene, u64) {
    let kernel = Kernel::default();
    let visible = effective(&volume, &kernel, &transfer);
    (Scene::new().with_volume(volume, kernel, transfer), visible)
}
