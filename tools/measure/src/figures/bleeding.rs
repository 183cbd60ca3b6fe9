//! How much of the light behind an opaque slab shows through it.

use super::Stage;
use crate::report::{Cell, Table};
use glam::DVec3;
use splatkit::{
    math::{Camera, Kernel, Projection},
    picture::Picture,
    scene::{Mode, Order, Scene, Settings},
    volume::{TransferFunction, phantoms::Phantom},
};
use splatkit_tools::{failure::Failure, progress::Progress};

/// Samples along each axis: three in the front slab of [`Phantom::Slabs`], six in the back one.
const SIDE: usize = 41;
const SPACING: f64 = 2.0 / (SIDE - 1) as f64;
/// The front slab fills a picture of this height from all directions below.
const HEIGHT: f64 = 0.2;
const PIXELS: u32 = 64;
/// Directions of the view, in degrees from the slabs' normal. The axis nearest to the view changes
/// at 45°.
const DIRECTIONS: [f64; 5] = [0.0, 30.0, 44.0, 50.0, 70.0];
/// The front slab: samples, and the opacity over each.
const LAYERS: f64 = 3.0;
const OPACITY: f64 = 0.9;

pub const MODES: [(&str, Mode); 3] = [
    ("single splats", Mode::Splats(Order::FrontToBack)),
    ("axis-aligned sheets", Mode::AxisSheets),
    ("image-aligned sheets", Mode::Sheets),
];

pub fn table(stage: &mut Stage, progress: &Progress) -> Result<Table, Failure> {
    let mut table = Table::new(
        "Colour bleeding.",
        "A blue slab of three samples, 90 % opaque over each, directly in front of a red one: \
         percent of red in the picture, by the angle between the view and the slabs' normal. The \
         first row is what a slab with hard edges lets through.",
        &["mode", "0°", "30°", "44°", "50°", "70°"],
    );
    let percent = |share: f64| Cell::Number(100.0 * share, 3);
    let through = |direction: f64| (1.0 - OPACITY).powf(LAYERS / direction.to_radians().cos());
    table.row("(light itself)", DIRECTIONS.map(through).map(percent).into());
    for (name, mode) in MODES {
        progress.stage(format!("Bleeding, {name}"));
        let mut scene = stage.prepare(&scene()?)?;
        let mut cells = Vec::new();
        for direction in DIRECTIONS {
            let mut settings = Settings::new([PIXELS; 2]);
            settings.mode = mode;
            cells.push(percent(red(&stage.draw(&mut scene, &camera(direction), &settings)?)));
        }
        table.row(name, cells);
    }
    Ok(table)
}

fn scene() -> Result<Scene, Failure> {
    let (blue, red) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let transfer = TransferFunction {
        color: vec![(0.45, red), (0.55, blue)],
        opacity: vec![(0.25, OPACITY), (0.45, 0.0), (0.55, 0.0), (0.75, OPACITY)],
        unit: SPACING,
        ..TransferFunction::default()
    };
    let slabs = Phantom::Slabs.sample([SIDE; 3])?;
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

/// Returns the mean share of red.
fn red(picture: &Picture) -> f64 {
    let shares =
        picture.color.iter().map(|[red, _, blue, _]| f64::from(red / (red + blue).max(1e-6)));
    shares.sum::<f64>() / picture.color.len() as f64
}
