//! The scene's flags, and the scene that they make of the inputs.

use crate::{
    camera::Subject,
    failure::Failure,
    load::{Input, LoadFlags},
    parse,
    progress::Progress,
};
use clap::Args;
use glam::DVec3;
use splatkit::{
    Error,
    math::{Bounds, Kernel},
    scene::Scene,
    surface::SurfelOptions,
    volume::TransferFunction,
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// What is drawn, and how its values and surfaces are shown.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Scene")]
pub struct SceneFlags {
    /// Meshes, clouds and at most one volume or set of scattered samples; all are drawn in one picture.
    #[arg(value_name = "SCENE", required = true)]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    load: LoadFlags,
    #[command(flatten)]
    show: ShowFlags,
}

/// How a scene's values and surfaces are shown.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Look")]
struct ShowFlags {
    /// How the values of a volume or of samples are shown: ct-bone, ct-soft-tissue, ct-lung, ct-angiography, mri, generic, or a JSON file. By
    /// default made from their histogram.
    #[arg(long, value_name = "NAME|FILE.json")]
    transfer: Option<String>,
    /// The values that the transfer function spreads over, instead of its own.
    #[arg(long, value_name = "LOW,HIGH", value_parser = parse::range, allow_hyphen_values = true)]
    range: Option<[f64; 2]>,
    /// The world length that the transfer function's opacities hold for.
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
    opacity_unit: Option<f64>,
    /// Standard deviation of a sample's kernel, in samples [default: 0.6]
    #[arg(long, value_name = "SAMPLES", value_parser = parse::positive)]
    sigma: Option<f64>,
    /// Radius of a sample's footprint, in samples [default: 2]
    #[arg(long, value_name = "SAMPLES", value_parser = parse::positive)]
    extent: Option<f64>,
    /// Factor on the radii of surfels.
    #[arg(long, value_name = "FACTOR", value_parser = parse::positive)]
    radius_scale: Option<f64>,
}

/// A scene that was read.
pub struct Loaded {
    pub scene: Scene,
    pub subject: Subject,
    /// Splats and samples.
    pub count: u64,
    pub load_ms: f64,
}

impl SceneFlags {
    /// Reads the inputs and makes a scene of them.
    pub fn load(&self, progress: &Progress) -> Result<Loaded, Failure> {
        let start = Instant::now();
        let mut loaded = Loaded {
            scene: Scene::new(),
            subject: Subject { bounds: Bounds::EMPTY, up: DVec3::Z },
            count: 0,
            load_ms: 0.0,
        };
        for path in &self.inputs {
            progress.stage(format!("Reading {}", path.display()));
            match self.load.open(path)? {
                Input::Mesh(mesh) => {
                    progress.stage(format!("Making surfels of {}", path.display()));
                    let mut options = SurfelOptions::default();
                    options.radius_scale *= self.show.radius_scale.unwrap_or(1.0) as f32;
                    let splats = mesh.surfels(&options).map_err(|e| in_file(path, e))?;
                    let bounds = mesh.bounds().map_or(splats.bounds(), |[min, max]| Bounds { min, max });
                    loaded.add(bounds, splats.splats.len());
                    loaded.scene = loaded.scene.with_splats(splats);
                    loaded.subject.up = DVec3::Y;
                }
                Input::Volume(volume) => {
                    let transfer = self.show.transfer(path, volume.range, || TransferFunction::automatic(&volume))?;
                    let kernel = self.show.kernel()?;
                    let [min, max] = volume.bounds();
                    loaded.add(Bounds { min, max }, volume.len());
                    loaded.scene = loaded.scene.with_volume(volume, kernel, transfer);
                }
                Input::Samples(points) => {
                    let automatic = || TransferFunction::automatic_for_points(&points);
                    let transfer = self.show.transfer(path, points.range(), automatic)?;
                    progress.stage(format!("Making splats of {}", path.display()));
                    let splats = points.to_splats(&self.load.sample_options()).map_err(|e| in_file(path, e))?;
                    let [min, max] = points.bounds();
                    loaded.add(Bounds { min, max }.union(splats.bounds()), points.len());
                    loaded.scene = loaded.scene.with_samples(splats, transfer);
                }
            }
        }
        loaded.scene.validate()?;
        loaded.load_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(loaded)
    }

    /// The inputs as a line of text.
    pub fn name(&self) -> String {
        self.inputs.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
    }
}

impl Loaded {
    fn add(&mut self, bounds: Bounds, count: usize) {
        self.subject.bounds = self.subject.bounds.union(bounds);
        self.count += count as u64;
    }
}

impl ShowFlags {
    fn kernel(&self) -> splatkit::Result<Kernel> {
        let default = Kernel::default();
        let sigma = self.sigma.unwrap_or(default.unit());
        // A wider kernel keeps its shape unless the user cuts it.
        let extent = self.extent.unwrap_or(default.extent.max(default.radius() * sigma));
        Kernel::gaussian(sigma, extent)
    }

    /// The transfer function that shows values of a range; one that shows nothing of them is an error.
    fn transfer(
        &self,
        path: &Path,
        values: [f64; 2],
        automatic: impl FnOnce() -> TransferFunction,
    ) -> Result<TransferFunction, Failure> {
        let transfer = match &self.transfer {
            None => automatic(),
            Some(name) if TransferFunction::NAMES.contains(&name.as_str()) => TransferFunction::named(name, values)?,
            Some(file) if Path::new(file).extension().is_some() || Path::new(file).exists() => {
                TransferFunction::read(Path::new(file))?
            }
            // Neither: the error lists the names.
            Some(name) => TransferFunction::named(name, values)?,
        };
        let mut transfer = match self.range {
            Some(range) => transfer.spread_over(range),
            None => transfer,
        };
        if let Some(unit) = self.opacity_unit {
            transfer.unit = unit;
        }
        if !transfer.visible(values) {
            let [low, high] = values;
            let shown = match transfer.shown_range() {
                Some([from, to]) => format!("shows values between {from} and {to}"),
                None => "shows no value".to_owned(),
            };
            return Err(Error::NothingToDraw(format!(
                "the transfer function {shown}, but those of {} lie between {low} and {high}",
                path.display()
            ))
            .into());
        }
        Ok(transfer)
    }
}

/// Names the file in errors that do not know it.
fn in_file(path: &Path, error: Error) -> Error {
    match error {
        Error::NothingToDraw(what) => Error::NothingToDraw(format!("{}: {what}", path.display())),
        Error::Argument(what) => Error::input(path, "content", what),
        other => other,
    }
}
