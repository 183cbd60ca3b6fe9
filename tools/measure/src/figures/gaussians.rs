//! Trained Gaussians: whole splats and sheets against the formulas of their trainer, the times of
//! frames, and how much pictures jump while the camera turns.

use super::{Stage, popping::change};
use crate::report::{Cell, Table};
use glam::DVec3;
use splatkit::{
    Device, Renderer,
    compare::compare_pictures,
    gaussians::{Gaussians, phantom},
    math::{Bounds, Camera, Projection},
    picture::Picture,
    reference,
    scene::{Mode, Order, Scene, Settings},
};
use splatkit_tools::{failure::Failure, progress::Progress, timing::milliseconds};
use std::{path::Path, time::Instant};

/// Gaussians of the made scene.
const COUNT: usize = 40_000;
/// The size of pictures that the reference draws.
const SMALL: [u32; 2] = [240, 180];
/// The size of pictures that are timed.
const LARGE: [u32; 2] = [800, 600];
/// Pictures of which the fastest time counts.
const FRAMES: usize = 5;
/// Degrees between pictures.
const STEP: f64 = 0.5;
const STEPS: i32 = 20;
/// The angle of the wide view, in degrees.
const WIDE: f64 = 120.0;

/// What is said of files that hold no Gaussians.
pub const OTHER: &str = "holds no trained Gaussians";

/// A scene to measure.
pub struct Case {
    pub name: String,
    pub set: Gaussians,
}

impl Case {
    pub fn made() -> Self {
        Self { name: "made scene".into(), set: phantom(COUNT) }
    }

    fn scene(&self) -> Scene {
        Scene::new().with_gaussians(self.set.clone())
    }

    /// A camera beside the scene, turned by some degrees.
    fn camera(&self, degrees: f64) -> Camera {
        let Bounds { min, max } = self.set.bounds();
        let mut camera = Camera::framing(&Bounds { min, max }, DVec3::Z, DVec3::NEG_Y, 4.0 / 3.0);
        camera.azimuth(degrees);
        camera.elevation(20.0);
        camera.zoom(1.5);
        camera
    }

    /// A camera with a wide view, near the middle of the scene.
    fn wide_camera(&self) -> Camera {
        let camera = self.camera(20.0);
        let toward = camera.focal_point - camera.position;
        Camera {
            position: camera.focal_point - 0.22 * toward,
            projection: Projection::Perspective { view_angle: WIDE },
            ..camera
        }
    }
}

/// Both ways of drawing, with their names.
const MODES: [(&str, Mode); 2] =
    [("whole splats", Mode::Splats(Order::FrontToBack)), ("sheets", Mode::Sheets)];

fn settings(size: [u32; 2], mode: Mode) -> Settings {
    Settings { mode, ..Settings::new(size) }
}

/// Returns the tables of all scenes. The pictures of the wide view are written to a folder, if one
/// is given.
pub fn tables(
    stage: &mut Stage,
    cases: &[Case],
    pictures: Option<&Path>,
    progress: &Progress,
) -> Result<Vec<Table>, Failure> {
    let mut likeness = likeness_table();
    let mut popping = popping_table();
    for case in cases {
        let mut cpu = Renderer::new(&Device::Cpu, &case.scene())?;
        let mut cells =
            vec![Cell::Number(case.set.len() as f64, 0), Cell::Number(case.set.degree.into(), 0)];
        for (name, camera) in [("", case.camera(20.0)), (", wide", case.wide_camera())] {
            progress.stage(format!("Gaussians{name}, the trainer's formulas"));
            let small = Settings::new(SMALL);
            let truth = reference::trained(&case.set, &camera, &small)?;
            for (_, mode) in MODES {
                let (picture, _) = cpu.render(&camera, &settings(SMALL, mode))?;
                cells.push(Cell::Number(psnr(&picture, &truth)?, 1));
                save(case, pictures, &camera, mode, &picture)?;
            }
            save_truth(case, pictures, &camera, &truth)?;
        }
        for (_, mode) in MODES {
            progress.stage("Gaussians, times of frames");
            cells.push(Cell::Number(time_cpu(case, &mut cpu, mode)?, 1));
            cells.push(Cell::Number(time_gpu(case, stage, mode)?, 1));
        }
        likeness.row(&case.name, cells);
        for (name, mode) in MODES {
            progress.stage(format!("Gaussians, popping of {name}"));
            popping.row(format!("{}, {name}", case.name), jumps(case, &mut cpu, mode)?);
        }
    }
    Ok(vec![likeness, popping])
}

fn likeness_table() -> Table {
    let [width, height] = LARGE;
    Table::new(
        "Trained Gaussians.",
        format!(
            "PSNR of pictures of {} × {} to the trainer's formulas in 64 bits, from outside \
             and from within under {WIDE}°, where exact footprints differ from those of the \
             projection's linear part; and the fastest of {FRAMES} frames of {width} × {height}, \
             each from another side, in ms.",
            SMALL[0], SMALL[1]
        ),
        &[
            "scene",
            "splats",
            "degree",
            "whole, dB",
            "sheets, dB",
            "whole, wide, dB",
            "sheets, wide, dB",
            "whole, CPU",
            "whole, GPU",
            "sheets, CPU",
            "sheets, GPU",
        ],
    )
}

fn popping_table() -> Table {
    Table::new(
        "Popping of Gaussians.",
        format!(
            "{} steps of {STEP}°: the largest change of a pixel, and the root mean square change \
             of all pixels, in steps of 1/255. A steady method changes as much in every step.",
            2 * STEPS
        ),
        &[
            "scene and mode",
            "pixel, worst step",
            "median step",
            "ratio",
            "all pixels, worst step",
            "median step",
            "ratio",
        ],
    )
}

fn psnr(a: &Picture, b: &Picture) -> splatkit::Result<f64> {
    Ok(compare_pictures(a, b)?.psnr.unwrap_or(f64::INFINITY))
}

/// Writes a picture of the wide view.
fn save(
    case: &Case,
    folder: Option<&Path>,
    camera: &Camera,
    mode: Mode,
    picture: &Picture,
) -> Result<(), Failure> {
    let is_wide = *camera == case.wide_camera();
    let name = if mode == Mode::Sheets { "sheets" } else { "exact" };
    let Some(folder) = folder.filter(|_| is_wide) else { return Ok(()) };
    picture.save(folder.join(format!("{}-{name}.png", file_name(case))), None)?;
    Ok(())
}

fn save_truth(
    case: &Case,
    folder: Option<&Path>,
    camera: &Camera,
    picture: &Picture,
) -> Result<(), Failure> {
    let is_wide = *camera == case.wide_camera();
    let Some(folder) = folder.filter(|_| is_wide) else { return Ok(()) };
    picture.save(folder.join(format!("{}-affine.png", file_name(case))), None)?;
    Ok(())
}

fn file_name(case: &Case) -> String {
    case.name.replace(|letter: char| !letter.is_alphanumeric(), "-")
}

fn time_cpu(case: &Case, renderer: &mut Renderer, mode: Mode) -> Result<f64, Failure> {
    let mut best = f64::INFINITY;
    for frame in 0..FRAMES {
        let camera = case.camera(20.0 + frame as f64);
        let start = Instant::now();
        renderer.render(&camera, &settings(LARGE, mode))?;
        best = best.min(milliseconds(start));
    }
    Ok(best)
}

fn time_gpu(case: &Case, stage: &mut Stage, mode: Mode) -> Result<f64, Failure> {
    let mut scene = stage.prepare(&case.scene())?;
    let mut best = f64::INFINITY;
    for frame in 0..=FRAMES {
        let camera = case.camera(19.0 + frame as f64);
        let start = Instant::now();
        stage.draw(&mut scene, &camera, &settings(LARGE, mode))?;
        // The first picture compiles and uploads.
        best = if frame == 0 { best } else { best.min(milliseconds(start)) };
    }
    Ok(best)
}

/// Returns the changes of pictures while the camera turns.
fn jumps(case: &Case, renderer: &mut Renderer, mode: Mode) -> Result<Vec<Cell>, Failure> {
    let mut pictures = Vec::new();
    for step in -STEPS..=STEPS {
        let camera = case.camera(STEP * f64::from(step));
        pictures.push(renderer.render(&camera, &settings(SMALL, mode))?.0);
    }
    let changes: Vec<[f64; 2]> =
        pictures.windows(2).map(|pair| change(&pair[0], &pair[1])).collect();
    let cells = [0, 1].map(|measure| {
        let mut sizes: Vec<f64> = changes.iter().map(|change| 255.0 * change[measure]).collect();
        sizes.sort_by(f64::total_cmp);
        let (worst, median) = (sizes[sizes.len() - 1], sizes[sizes.len() / 2]);
        [Cell::Number(worst, 2), Cell::Number(median, 2), Cell::Number(worst / median, 2)]
    });
    Ok(cells.concat())
}
