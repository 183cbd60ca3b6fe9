//! How much of what an opaque slab hides shows through it.

use super::{
    Stage,
    report::{Cell, Table},
};
use crate::{failure::Failure, progress::Progress};
use glam::DVec3;
use splatkit::{
    math::{Camera, Kernel, Projection},
    picture::Picture,
    scene::{Mode, Order, Scene, Settings},
    volume::{TransferFunction, phantoms::Phantom},
};

/// Samples along each axis: the front slab of [`Phantom::Slabs`] holds three, the back one six.
const SIDE: usize = 41;
const SPACING: f64 = 2.0 / (SIDE - 1) as f64;
/// The front slab fills a picture of this height from all directions below.
const HEIGHT: f64 = 0.2;
const PIXELS: u32 = 64;
/// Directions of the view, in degrees from the slabs' normal.
const DIRECTIONS: [f64; 8] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0];

pub const MODES: [(&str, Mode); 3] = [
    ("single splats", Mode::Splats(Order::FrontToBack)),
    ("axis-aligned sheets", Mode::AxisSheets),
    ("image-aligned sheets", Mode::Sheets),
];

pub fn table(stage: &mut Stage, progress: &Progress) -> Result<Table, Failure> {
    let mut table = Table::new(
        "Colour bleeding.",
        "A blue slab of three samples, 90 % opaque over each, right before a red one. Percent of red in the picture, where \
         light would let 0.1 through: the mean and the largest of the pixels in the worst of eight directions up to 70° from \
         the normal.",
        &["mode", "mean", "largest", "direction of the worst"],
    );
    for (name, mode) in MODES {
        progress.stage(format!("Bleeding, {name}"));
        let mut scene = stage.prepare(&scene()?)?;
        let mut worst = ([0.0; 2], 0.0);
        for direction in DIRECTIONS {
            let mut settings = Settings::new([PIXELS; 2]);
            settings.mode = mode;
            let found = red(&stage.draw(&mut scene, &camera(direction), &settings)?);
            if found[0] >= worst.0[0] {
                worst = (found, direction);
            }
        }
        let ([mean, largest], direction) = worst;
        let percent = |share: f64| Cell::Number(100.0 * share, 2);
        table.row(name, vec![percent(mean), percent(largest), Cell::Number(direction, 0)]);
    }
    Ok(table)
}

fn scene() -> Result<Scene, Failure> {
    let (blue, red) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let transfer = TransferFunction {
        color: vec![(0.7, blue), (0.8, red)],
        opacity: vec![(0.1, 0.0), (0.4, 0.9)],
        unit: SPACING,
        ..TransferFunction::default()
    };
    let slabs = Phantom::Slabs.sample([SIDE; 3]).map_err(splatkit::Error::Argument)?;
    Ok(Scene::new().with_volume(slabs, Kernel::default(), transfer))
}

fn camera(degrees: f64) -> Camera {
    let focal_point = DVec3::new(0.0, 0.0, 0.15);
    let mut camera = Camera {
        position: focal_point + 4.0 * DVec3::Z,
        focal_point,
        view_up: DVec3::Y,
        projection: Projection::Orthographic { height: HEIGHT },
    };
    camera.azimuth(degrees);
    camera
}

/// The mean and the largest share of red.
fn red(picture: &Picture) -> [f64; 2] {
    let shares = picture.color.iter().map(|[red, _, blue, _]| f64::from(red / (red + blue).max(1e-6)));
    let [sum, largest] = shares.fold([0.0, 0.0], |[sum, largest]: [f64; 2], share| [sum + share, largest.max(share)]);
    [sum / picture.color.len() as f64, largest]
}
