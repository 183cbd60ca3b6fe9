//! The cost of a cut and how steady it is: the splats and the time of a picture from near and far,
//! and how much the picture changes while the camera moves away.

use super::{Stage, popping::change, surfaces::Source};
use crate::report::{Cell, Table};
use splatkit::{
    Error,
    gpu::PreparedScene,
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree},
    math::Camera,
    scene::{Scene, Settings},
    session::{Data, Framing, Subject},
    surface::SurfelOptions,
};
use splatkit_tools::{failure::Failure, progress::Progress, timing::milliseconds};
use std::{path::Path, sync::Arc, time::Instant};

/// Pixels along each side of the pictures that are timed, and of those of the sweep.
const PIXELS: u32 = 1024;
const SWEEP_PIXELS: u32 = 256;
/// Pictures of the sweep, and how many times farther away the camera is at its end.
const SWEEP: u32 = 200;
const FARTHEST: f64 = 16.0;
/// Number of frames, of which the median time counts.
const FRAMES: usize = 5;
/// The cut, in pixels.
const CUT: f64 = Detail::PIXELS;

/// The error for a file of another kind.
pub const OTHER: &str = "is not a mesh, point cloud or hierarchy";

/// Returns the hierarchy in a file, or builds it from a mesh or point cloud.
fn hierarchy(source: &Source, input: Data) -> Result<Arc<Hierarchy>, Failure> {
    match input {
        Data::Hierarchy(hierarchy) => Ok(hierarchy),
        Data::Mesh(mesh) => {
            let options = BuildOptions { closed: mesh.is_solid(), ..BuildOptions::default() };
            let tree = Tree::build(&mesh.surfels(&SurfelOptions::default())?, &options, None)?;
            Ok(Arc::new(Hierarchy::from_tree(tree)?))
        }
        _ => Err(Error::input(&source.path, "file", OTHER).into()),
    }
}

/// Returns a camera that sees the whole model, from `farther` times the distance.
fn camera(
    hierarchy: &Hierarchy,
    source: &Source,
    size: [u32; 2],
    farther: f64,
) -> splatkit::Result<Camera> {
    let subject = Subject::new(hierarchy.bounds(), source.up);
    let mut camera = Framing::default().camera(&subject, size)?;
    camera.position = camera.focal_point + (camera.position - camera.focal_point) * farther;
    Ok(camera)
}

pub fn tables(
    stage: &mut Stage,
    sources: &[Source],
    open: impl Fn(&Path) -> Result<Data, Failure>,
    progress: &Progress,
) -> Result<[Table; 2], Failure> {
    let mut cost = Table::new(
        "Cost of a cut.",
        format!(
            "Pictures of {PIXELS}² pixels with the whole model in view, and from 4 and 16 times as \
             far; a cut of {CUT} pixels. The median of {FRAMES} frames, after one that loaded the \
             pages."
        ),
        &[
            "model",
            "splats",
            "drawn",
            "ms",
            "drawn, ¼ as wide",
            "ms",
            "drawn, 1/16",
            "ms",
            "GPU MiB",
        ],
    );
    let mut sweep = Table::new(
        "Zoom sweep.",
        format!(
            "{SWEEP} pictures of {SWEEP_PIXELS}² pixels while the camera moves {FARTHEST} times as \
             far away: the largest root mean square change from one picture to the next, in steps \
             of 1/255, for a cut of {CUT} pixels and for the leaves."
        ),
        &["model", "cut", "leaves", "ratio"],
    );
    for source in sources {
        progress.stage(format!("Reading {}", source.path.display()));
        let hierarchy = hierarchy(source, open(&source.path)?)?;
        let scene = stage.prepare(&Scene::new().with_hierarchy(hierarchy.clone()))?;
        let mut model = Model { source, hierarchy, scene };
        cost.row(source.name(), model.costs(stage, progress)?);
        let [cut, leaves] = [
            model.largest_change(stage, CUT, progress)?,
            model.largest_change(stage, 0.0, progress)?,
        ];
        sweep.row(
            source.name(),
            [cut, leaves, cut / leaves].map(|value| Cell::Number(value, 3)).into(),
        );
    }
    Ok([cost, sweep])
}

/// A hierarchy with its prepared scene.
struct Model<'a> {
    source: &'a Source,
    hierarchy: Arc<Hierarchy>,
    scene: PreparedScene,
}

impl Model<'_> {
    /// Returns a row of the costs: the number of leaves, the splats and times from near and far,
    /// and the memory.
    fn costs(&mut self, stage: &mut Stage, progress: &Progress) -> Result<Vec<Cell>, Failure> {
        let mut cells = vec![Cell::Number(self.hierarchy.header().leaves as f64, 0)];
        let mut settings = Settings::new([PIXELS; 2]);
        settings.detail = Detail::Pixels(CUT);
        let mut memory = 0;
        for farther in [1.0, 4.0, 16.0] {
            progress.stage(format!("Timing {}, {farther} times as far", self.source.name()));
            let camera = camera(&self.hierarchy, self.source, settings.size, farther)?;
            stage.renderer.draw(&mut self.scene, &camera, &settings)?;
            let mut times = Vec::new();
            let mut splats = 0;
            for _ in 0..FRAMES {
                let start = Instant::now();
                let stats = stage.renderer.draw(&mut self.scene, &camera, &settings)?;
                times.push(milliseconds(start));
                (splats, memory) = (stats.splats, stats.gpu_bytes);
            }
            times.sort_by(f64::total_cmp);
            cells.extend([Cell::Number(splats as f64, 0), Cell::Number(times[FRAMES / 2], 1)]);
        }
        cells.push(Cell::Number((memory >> 20) as f64, 0));
        Ok(cells)
    }

    /// Returns the largest change from one picture of the sweep to the next, for a cut of this many
    /// pixels.
    fn largest_change(
        &mut self,
        stage: &mut Stage,
        pixels: f64,
        progress: &Progress,
    ) -> Result<f64, Failure> {
        let mut settings = Settings::new([SWEEP_PIXELS; 2]);
        settings.detail = Detail::Pixels(pixels);
        let name = self.source.name();
        let mut last = None;
        let mut largest: f64 = 0.0;
        for frame in 0..SWEEP {
            progress.stage(format!("Zooming {name}, picture {frame} of {SWEEP}"));
            let farther = FARTHEST.powf(f64::from(frame) / f64::from(SWEEP - 1));
            let camera = camera(&self.hierarchy, self.source, settings.size, farther)?;
            let picture = stage.draw(&mut self.scene, &camera, &settings)?;
            if let Some(last) = &last {
                largest = largest.max(255.0 * change(last, &picture)[1]);
            }
            last = Some(picture);
        }
        Ok(largest)
    }
}
