//! How much a picture jumps while the camera turns past the direction at which axis-aligned sheets
//! change their axis.

use super::{Stage, bleeding::MODES};
use crate::report::{Cell, Table};
use glam::DVec3;
use splatkit::{
    math::{Bounds, Camera, Kernel},
    picture::Picture,
    scene::{Scene, Settings},
    volume::{TransferFunction, phantoms::Phantom},
};
use splatkit_tools::{failure::Failure, progress::Progress};

const SIDE: usize = 64;
const PIXELS: [u32; 2] = [256, 256];
/// Degrees between pictures.
const STEP: f64 = 0.5;
/// Steps to either side of 45°.
const STEPS: i32 = 10;

pub fn table(stage: &mut Stage, progress: &Progress) -> Result<Table, Failure> {
    let mut table = Table::new(
        "Popping.",
        format!(
            "The specimen of {SIDE}³ samples, unlit, from 40° to 50° in steps of {STEP}°: the \
             largest change of a pixel, and the root mean square change of all pixels, in steps of \
             1/255. A steady method changes as much in every step."
        ),
        &[
            "mode",
            "pixel, worst step",
            "median step",
            "ratio",
            "all pixels, worst step",
            "median step",
            "ratio",
        ],
    );
    let specimen = Phantom::Specimen.sample_bytes([SIDE; 3])?;
    let bounds = specimen.bounds();
    let transfer = TransferFunction::automatic(&specimen);
    let mut scene =
        stage.prepare(&Scene::new().with_volume(specimen, Kernel::default(), transfer))?;
    for (name, mode) in MODES {
        let mut settings = Settings::new(PIXELS);
        settings.mode = mode;
        settings.volume_shade = Some(None);
        let mut pictures = Vec::new();
        for step in -STEPS..=STEPS {
            progress.stage(format!("Popping, {name}, {step:+}"));
            let camera = camera(&bounds, 45.0 + STEP * f64::from(step));
            pictures.push(stage.draw(&mut scene, &camera, &settings)?);
        }
        let changes: Vec<[f64; 2]> =
            pictures.windows(2).map(|pair| change(&pair[0], &pair[1])).collect();
        let cells = [0, 1].map(|measure| {
            let mut sizes: Vec<f64> =
                changes.iter().map(|change| 255.0 * change[measure]).collect();
            sizes.sort_by(f64::total_cmp);
            let (worst, median) = (sizes[sizes.len() - 1], sizes[sizes.len() / 2]);
            [Cell::Number(worst, 2), Cell::Number(median, 2), Cell::Number(worst / median, 2)]
        });
        table.row(name, cells.concat());
    }
    Ok(table)
}

fn camera(bounds: &Bounds, degrees: f64) -> Camera {
    let mut camera = Camera::framing(bounds, DVec3::Y, DVec3::Z, 1.0);
    camera.azimuth(degrees);
    camera.elevation(20.0);
    camera.zoom(1.6);
    camera
}

/// Returns the largest change of a channel, and the root mean square change of all channels.
pub fn change(a: &Picture, b: &Picture) -> [f64; 2] {
    let channels = a.color.iter().flatten().zip(b.color.iter().flatten());
    let changes = channels.map(|(a, b)| f64::from((a - b).abs()));
    let [largest, squares] =
        changes.fold([0.0, 0.0], |[most, sum]: [f64; 2], c| [most.max(c), sum + c * c]);
    [largest, (squares / (4 * a.color.len()) as f64).sqrt()]
}
