//! The flags of a scene, and loading the scene that they describe.

use crate::{
    camera::Subject,
    failure::Failure,
    load::{Input, LoadFlags},
    progress::Progress,
    show::ShowFlags,
};
use clap::Args;
use glam::DVec3;
use splatkit::{
    Error,
    bricks::{Bricks, Level},
    hierarchy::file::UpAxis,
    math::Bounds,
    memory,
    scene::Scene,
    surface::SurfelOptions,
    volume::TransferFunction,
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// The inputs, and how their values and surfaces are shown.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Scene")]
pub struct SceneFlags {
    /// Meshes, point clouds, hierarchies, and at most one volume or set of scattered samples; all
    /// are drawn in one picture.
    #[arg(value_name = "SCENE", required = true)]
    pub inputs: Vec<PathBuf>,
    #[command(flatten)]
    load: LoadFlags,
    #[command(flatten)]
    show: ShowFlags,
}

/// A loaded scene.
pub struct Loaded {
    pub scene: Scene,
    pub subject: Subject,
    /// Number of splats and samples.
    pub count: u64,
    pub load_ms: f64,
    /// The files that were read: the inputs, the files that they refer to, and the files that flags
    /// name.
    pub read: Vec<PathBuf>,
}

impl SceneFlags {
    /// Reads the inputs and makes a scene of them.
    pub fn load(&self, progress: &Progress) -> Result<Loaded, Failure> {
        let start = Instant::now();
        let show = self.show.open(&self.load.limits())?;
        let mut loaded = Loaded {
            scene: Scene::new(),
            subject: Subject { bounds: Bounds::EMPTY, up: DVec3::Z },
            count: 0,
            load_ms: 0.0,
            read: self.show.files(),
        };
        let (mut is_scaled, mut unscaled) = (false, None);
        for path in &self.inputs {
            progress.stage(format!("Reading {}", path.display()));
            // One deadline covers reading the input and making its splats.
            let deadline = self.load.limits().deadline();
            match self.load.open_within(path, memory::most(), &mut loaded.read)? {
                Input::Mesh(mesh) => {
                    is_scaled = true;
                    progress.stage(format!("Making surfels of {}", path.display()));
                    let mut options = SurfelOptions { deadline, ..SurfelOptions::default() };
                    options.radius_scale *= self.show.radius_scale.unwrap_or(1.0);
                    let splats = mesh.surfels(&options).map_err(|e| in_file(path, e))?;
                    let bounds =
                        mesh.bounds().map_or(splats.bounds(), |[min, max]| Bounds { min, max });
                    loaded.add(bounds, splats.splats.len());
                    loaded.scene = loaded.scene.with_splats(splats);
                    if !mesh.z_is_up {
                        loaded.subject.up = DVec3::Y;
                    }
                }
                Input::Hierarchy(hierarchy) => {
                    unscaled = Some(path);
                    let header = hierarchy.header();
                    loaded.add(header.bounds, header.leaves as usize);
                    loaded.subject.up = match header.up {
                        Some(UpAxis::X) => DVec3::X,
                        Some(UpAxis::Z) => DVec3::Z,
                        Some(UpAxis::Y) | None => DVec3::Y,
                    };
                    loaded.scene = loaded.scene.with_hierarchy(hierarchy);
                }
                Input::Bricks(bricks) => {
                    if show.sharp {
                        let error =
                            Error::input(path, "content", "a volume in bricks cannot be sharpened");
                        return Err(error
                            .hint("leave out --sharp, or draw the original volume")
                            .into());
                    }
                    let overview = bricks.volume(overview(&bricks))?;
                    let range = bricks.header().range;
                    let transfer =
                        show.transfer(path, range, || TransferFunction::automatic(&overview))?;
                    loaded.add(bricks.bounds(), bricks.level(0).dims.iter().product());
                    loaded.scene = loaded.scene.with_bricks(bricks, show.kernel.clone(), transfer);
                }
                Input::Volume(volume) => {
                    let transfer =
                        show.transfer(path, volume.range, || TransferFunction::automatic(&volume))?;
                    let [min, max] = volume.bounds();
                    loaded.add(Bounds { min, max }, volume.len());
                    let volume = if show.sharp {
                        progress.stage(format!("Sharpening {}", path.display()));
                        volume.sharpened(&show.kernel)?
                    } else {
                        volume
                    };
                    loaded.scene = loaded.scene.with_volume(volume, show.kernel.clone(), transfer);
                }
                Input::Samples(points) => {
                    let automatic = || points.automatic_transfer();
                    let transfer = show.transfer(path, points.range(), automatic)?;
                    progress.stage(format!("Making splats of {}", path.display()));
                    let splats = points
                        .to_splats(&self.load.sample_options(deadline))
                        .map_err(|e| in_file(path, e))?;
                    let [min, max] = points.bounds();
                    loaded.add(Bounds { min, max }.union(splats.bounds()), points.len());
                    loaded.scene = loaded.scene.with_samples(splats, transfer);
                }
            }
        }
        if let (Some(_), Some(path), false) = (self.show.radius_scale, unscaled, is_scaled) {
            return Err(Failure::Usage(format!(
                "--radius-scale does not apply to {}: a hierarchy keeps the radii that it was \
                 converted with; convert it with --radius-scale",
                path.display()
            )));
        }
        // If an item cannot be drawn by itself, its file is at fault, or the flags that say how it
        // is shown.
        let at_fault = |error: Error| -> Failure {
            let items = self.inputs.iter().zip(&loaded.scene.items);
            let found =
                items.into_iter().find_map(|(path, item)| Some((path, item.validate().err()?)));
            match (found, self.show.transfer_text()) {
                (None, _) => error.into(),
                (Some((path, Error::Transfer(what))), Some(flags)) => {
                    if let Some(file) = self.show.own_transfer() {
                        let message = format!("{what}; the values are those of {}", path.display());
                        return Error::input(file, "content", message).into();
                    }
                    Failure::Usage(format!(
                        "{flags}: {what}; the values are those of {}",
                        path.display()
                    ))
                }
                (Some((path, own)), _) => in_file(path, own).into(),
            }
        };
        loaded.scene.validate().map_err(at_fault)?;
        // Points that all lie at one place have no extent, but their splats have one.
        if is_one_place(&loaded.subject.bounds) {
            loaded.subject.bounds = loaded.scene.bounds();
        }
        loaded.load_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(loaded)
    }

    /// Returns the inputs as a line of text.
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

/// Whether a box is no larger than the rounding error of its coordinates.
fn is_one_place(bounds: &Bounds) -> bool {
    bounds.diagonal() <= 1e-13 * bounds.center().abs().max_element()
}

/// Returns the finest level of a volume that can be read quickly as a whole, or the coarsest level.
fn overview(bricks: &Bricks) -> usize {
    const QUICK: usize = 1 << 24;
    let is_quick = |level: &Level| level.dims.iter().product::<usize>() <= QUICK;
    bricks.levels().iter().position(is_quick).unwrap_or(bricks.levels().len() - 1)
}

/// Adds the file's name to errors that lack it.
pub fn in_file(path: &Path, error: Error) -> Error {
    match error {
        Error::Argument(what) => Error::input(path, "content", what),
        other => other.in_file(path),
    }
}
