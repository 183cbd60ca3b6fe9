//! The flags of a scene, and loading the scene that they describe.

use crate::{
    failure::Failure,
    given::{Given, Kinds, kinds_of},
    load::LoadFlags,
    parse,
    progress::Progress,
    show::ShowFlags,
};
use clap::Args;
use splatkit::{
    Error,
    input::Limits,
    math::Camera,
    memory,
    scene::{Scene, Settings},
    session::{Captions, Data, Framing, Items, Name, Subject, Surfaces},
};
#[cfg(feature = "window")]
use splatkit::{scene::Item, session::Legend, volume::TransferFunction};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// The inputs, and how their values and surfaces are shown.
#[derive(Args, Debug, Clone)]
pub struct SceneFlags {
    /// Meshes, point clouds, hierarchies, and up to four volumes, sets of cells or sets of
    /// scattered samples; all are drawn in one picture. Addresses are inputs too: https://…,
    /// s3://…, gs://…, az://… (docs/remote.md).
    #[arg(value_name = "SCENE", required = true, value_parser = parse::input())]
    pub inputs: Vec<PathBuf>,
    /// Let a scene file name files outside its folder, and addresses. Give it only for scenes that
    /// you have made, or whose maker you trust.
    #[arg(long)]
    trust_scene: bool,
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
    /// What the inputs say for the texts over a picture.
    pub captions: Captions,
    /// The items of the scene, and the edges to be drawn over the picture.
    pub items: Items,
    /// What each input is.
    pub kinds: Vec<Kinds>,
    /// The files that were read: the inputs, the files that they refer to, and the files that flags
    /// name.
    pub read: Vec<PathBuf>,
}

impl SceneFlags {
    /// Returns the limits of every file that is read.
    pub fn limits(&self) -> Limits {
        self.load.limits()
    }

    /// Checks that the inputs are files of known kinds. Addresses are not asked.
    #[cfg(feature = "window")]
    pub fn check_files(&self) -> Result<(), Failure> {
        let files = self.inputs.iter().filter(|path| !splatkit::input::is_remote(path));
        files.into_iter().try_for_each(|path| self.load.kind(path).map(drop))
    }

    /// Reads the inputs and makes a scene of them. Meshes become surfels; with `facets`, those
    /// whose triangles can be larger than pixels become facets.
    pub fn load(
        &self,
        facets: bool,
        given: &Given,
        progress: &Progress,
    ) -> Result<Loaded, Failure> {
        let start = Instant::now();
        self.show.check_inputs(&self.inputs)?;
        // One deadline covers reading all inputs and making their splats.
        let load = self.load.begun();
        let deadline = load.limits().deadline();
        let show = self.show.open(&load.limits())?;
        // Of values alone: colours have no largest one.
        let optics = ["mip", "x-ray", "optics"].into_iter().find(|flag| given.has(flag));
        let surfaces = if facets { Surfaces::Facets } else { Surfaces::Surfels };
        let mut items = Items::new(surfaces);
        let (mut kinds, mut read) = (Vec::new(), self.show.files());
        let (mut is_scaled, mut unscaled) = (false, None);
        let reading = load.reading(memory::most());
        for path in &self.inputs {
            progress.stage(format!("Reading {}", path.display()));
            let mut showing = show.showing(path);
            let opened = reading.open_colored(path, showing.coloring().attribute())?;
            let mut input = opened.read()?;
            reading.give_radii(path, &mut input, showing.point_radius.as_deref())?;
            read.extend(opened.files());
            match &input {
                Data::Mesh(_) => is_scaled = true,
                Data::Hierarchy(_) => unscaled = Some(path),
                _ => {}
            }
            kinds.push(kinds_of(&input, opened.is_raw()));
            showing.samples = self.load.sample_options(deadline);
            showing.deadline = deadline;
            showing.is_named = self.load.scalar().is_some();
            showing.values_by =
                showing.values_by.or_else(|| optics.map(|flag| format!("--{flag}")));
            items.add(&Name::of_file(path), input, &showing, &|stage| progress.stage(stage))?;
        }
        let captions = items.captions();
        self.show.color.check_effect(is_scaled, !captions.legends.is_empty())?;
        if let (Some(_), Some(path), false) = (self.show.radius_scale, unscaled, is_scaled) {
            return Err(Failure::Usage(format!(
                "--radius-scale does not apply to {}: a hierarchy keeps the radii that it was \
                 converted with; convert it with --radius-scale",
                path.display()
            )));
        }
        let scene = items.scene(facets)?;
        scene.validate().map_err(|error| self.at_fault(&items, &scene, error))?;
        let mut subject = items.subject.clone();
        // Points that all lie at one place have no extent, but their splats have one.
        if subject.is_one_place() {
            subject.bounds = scene.bounds();
        }
        let paths = self.inputs.iter().map(PathBuf::as_path);
        given.warn(&paths.zip(kinds.iter().copied()).collect::<Vec<_>>(), progress);
        if self.show.has_range() && captions.legends.is_empty() {
            progress.warn("--range has no effect: nothing here is coloured or shown by values");
        }
        let (count, load_ms) = (items.count(), start.elapsed().as_secs_f64() * 1e3);
        Ok(Loaded { scene, subject, count, load_ms, captions, items, kinds, read })
    }

    /// Returns the error for a scene that cannot be drawn. If an item cannot be drawn by itself,
    /// its file is at fault, or the flags that say how it is shown.
    fn at_fault(&self, items: &Items, scene: &Scene, error: Error) -> Failure {
        let transfer = Items::unfit(scene).and_then(|(item, error)| match error {
            Error::Transfer(what) => Some((&self.inputs[item], what)),
            _ => None,
        });
        let flags =
            transfer.and_then(|(path, what)| Some((path, what, self.show.transfer_text(path)?)));
        match flags {
            None => items.at_fault(scene, error).into(),
            Some((path, what, flags)) => match self.show.own_transfer(path) {
                Some(file) => {
                    let message = format!("{what}; the values are those of {}", path.display());
                    Error::input(file, "content", message).into()
                }
                None => Failure::Usage(format!(
                    "{flags}: {what}; the values are those of {}",
                    path.display()
                )),
            },
        }
    }

    /// Returns the failure of a picture that an engine did not draw. If the usual camera cannot see
    /// the scene either, the input that reaches farthest is at fault. If only this camera cannot,
    /// it is the file of a path, which is named with the place of the camera, or else a flag.
    pub fn undrawn(
        &self,
        error: Error,
        loaded: &Loaded,
        (camera, size): (&Camera, [u32; 2]),
        path: Option<(&Path, String)>,
    ) -> Failure {
        let bounds = loaded.scene.bounds();
        let is_seen = || camera.view(size)?.validate_for(&bounds);
        if !matches!(error, Error::Argument(_)) || is_seen().is_ok() {
            return error.into();
        }
        match (Framing::usual_fault(&loaded.subject, &bounds, size), path) {
            (Some(fault), _) => loaded.items.out_of_sight(&loaded.scene, fault).into(),
            (None, Some((file, place))) => error.stated_in(file, place).into(),
            (None, None) => error.into(),
        }
    }

    /// Returns what a loaded scene says for texts if other transfer functions show the fields of
    /// these items.
    #[cfg(feature = "window")]
    pub fn captions_with(
        &self,
        loaded: &Loaded,
        transfers: &[(usize, TransferFunction)],
    ) -> Captions {
        let mut captions = loaded.captions.clone();
        for (item, legend) in &mut captions.legends {
            let own = transfers.iter().find(|(own, _)| own == item);
            let values = loaded.scene.items[*item].value_range();
            let (Some((_, transfer)), Some(values)) = (own, values) else { continue };
            let labels = match &loaded.scene.items[*item] {
                Item::Volume(volume, ..) => volume.about.labels.as_ref(),
                _ => None,
            };
            // The colours are the function's own by now, also those of a map.
            let named = (std::mem::take(&mut legend.title), labels);
            let coloring = self.show.color.coloring(None);
            *legend = Legend::of_transfer(&coloring, transfer, values, named);
        }
        captions
    }

    /// Returns the inputs as a line of text.
    pub fn name(&self) -> String {
        self.inputs.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
    }
}

impl Loaded {
    /// Finds the points that span what is seen, if the camera is fitted to them.
    pub fn find_seen(&mut self, camera: &Framing, settings: &Settings) -> splatkit::Result<()> {
        if !camera.is_placed() {
            self.subject.seen = self.scene.seen(&settings.clips)?;
        }
        Ok(())
    }
}
