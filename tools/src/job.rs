//! A picture to be drawn: the scene that flags and scene files describe, and the device.

use crate::{
    color,
    engine::{self, DeviceFlags},
    failure::Failure,
    given::{self, Given, Kinds},
    progress::Progress,
    scene_file::Stated,
};
use splatkit::{
    Device, Error,
    formats::Kind,
    math::Camera,
    picture::Picture,
    scene::{Scene, Settings},
    session::{
        self, Description, Drawing, Framing, LoadedInput, PanelLabels, Subject, TransferEntry,
    },
};
#[cfg(feature = "window")]
use splatkit::{
    session::{Captions, Coloring},
    volume::TransferFunction,
};
use splatkit_media::{
    figure::Figure,
    overlay::{Overlay, Page},
};
use std::{
    ops::{Deref, DerefMut},
    path::{Path, PathBuf},
    time::Instant,
};

/// A picture to be drawn.
#[derive(Debug, Clone)]
pub struct Job {
    pub scene: Description,
    pub device: DeviceFlags,
    /// Where the scene is stated, if a scene file states it.
    stated: Option<Stated>,
    /// The flags that are given, and those that the scene stands for.
    given: Given,
}

/// A loaded scene, and how long that took.
pub struct Loaded {
    session: session::Loaded,
    pub load_ms: f64,
}

impl Deref for Loaded {
    type Target = session::Loaded;

    fn deref(&self) -> &session::Loaded {
        &self.session
    }
}

impl DerefMut for Loaded {
    fn deref_mut(&mut self) -> &mut session::Loaded {
        &mut self.session
    }
}

impl Loaded {
    /// Returns what each input is.
    pub fn kinds(&self) -> Vec<Kinds> {
        self.inputs.iter().map(given::kinds_of_input).collect()
    }
}

/// How a drawn picture becomes the final one.
pub struct Finish {
    pub drawing: Drawing,
    #[cfg_attr(not(feature = "window"), expect(dead_code, reason = "for the window"))]
    pub background: Option<[f32; 3]>,
    overlay: Option<Overlay>,
    /// Pixels an inch.
    pub dpi: Option<f64>,
}

impl Finish {
    /// Averages a picture down and draws edges over it.
    pub fn reduced(
        &self,
        picture: Picture,
        camera: &Camera,
        loaded: &Loaded,
    ) -> splatkit::Result<Picture> {
        self.drawing.reduced(picture, &loaded.items, camera)
    }

    /// Draws the texts over a picture, and returns what they say.
    pub fn overlaid(&self, picture: &mut Picture, camera: &Camera) -> serde_json::Value {
        let overlay = self.overlay.as_ref();
        overlay.map_or(serde_json::Value::Null, |overlay| overlay.draw(picture, camera))
    }

    /// Returns the texts over pictures.
    pub fn overlay(&self) -> Option<&Overlay> {
        self.overlay.as_ref()
    }

    /// Returns the colours of the scalar bars.
    #[cfg(all(test, feature = "window"))]
    pub fn bar_colors(&self) -> Vec<[f32; 3]> {
        self.overlay.as_ref().map_or(Vec::new(), Overlay::bar_colors)
    }

    /// Returns the final picture of a drawn one.
    #[cfg(feature = "window")]
    pub fn finished(
        &self,
        picture: Picture,
        camera: &Camera,
        loaded: &Loaded,
    ) -> splatkit::Result<Picture> {
        let mut picture = self.reduced(picture, camera, loaded)?;
        self.overlaid(&mut picture, camera);
        Ok(picture)
    }
}

impl Job {
    /// Returns the job of drawing a scene with these flags. Checks what does not depend on its
    /// inputs.
    pub fn new(
        scene: Description,
        device: DeviceFlags,
        given: &Given,
        stated: Option<Stated>,
    ) -> Result<Self, Failure> {
        let given = given.with(&scene);
        let job = Self { scene, device, stated, given };
        job.device.check()?;
        // A window may open without anything.
        if job.scene.inputs.is_empty() {
            return Ok(job);
        }
        job.scene.check().map_err(|(place, message)| match &job.stated {
            Some(stated) => stated.wrong(place, message),
            None => {
                let flag = crate::flag_names::flag_of(&place);
                Failure::Usage(format!("--{flag}: {message}"))
            }
        })?;
        Ok(job)
    }

    /// Makes a failure the scene file's, if that states what is wrong. `written` are the files that
    /// the user wants written.
    pub fn blamed(&self, failure: Failure, written: &[&Path]) -> Failure {
        match &self.stated {
            Some(stated) => stated.blamed(failure, written),
            None => failure,
        }
    }

    /// Returns the paths of the inputs that are drawn.
    pub fn inputs(&self) -> Vec<PathBuf> {
        self.scene.visible().map(|input| input.file.clone()).collect()
    }

    /// Returns the inputs as a line of text.
    pub fn name(&self) -> String {
        let names = self.scene.visible().map(|input| input.file.display().to_string());
        names.collect::<Vec<_>>().join(", ")
    }

    /// Returns the size of the picture in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.scene.picture.size()
    }

    /// Reads the inputs and makes a scene of them.
    pub fn load(&self, progress: &Progress) -> Result<Loaded, Failure> {
        let start = Instant::now();
        let session = self.scene.load(&|step| progress.stage(step));
        let session = session.map_err(|error| self.with_flags(error))?;
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        let loaded = Loaded { session, load_ms };
        self.check_effect(&loaded, progress)?;
        Ok(loaded)
    }

    /// Reads the inputs of a loaded scene again, at another time ([`Description::at_time`]).
    pub fn at_time(&self, loaded: &Loaded, time: usize) -> Result<(Self, Loaded), Failure> {
        let mut job = self.clone();
        job.scene = self.scene.at_time(loaded, time);
        let start = Instant::now();
        let session = job.scene.load(&|_| ()).map_err(|error| self.with_flags(error))?;
        Ok((job, Loaded { session, load_ms: start.elapsed().as_secs_f64() * 1e3 }))
    }

    /// Names the flags that change a transfer function in an error about it.
    fn with_flags(&self, error: Error) -> Failure {
        match error {
            Error::Transfer(what) => {
                let appearances = self.scene.visible().map(|input| self.scene.appearance_of(input));
                let flags = appearances.map(|appearance| {
                    let transfer = appearance.transfer.map(|transfer| match transfer {
                        TransferEntry::Name(name) => format!("--transfer {name}"),
                        TransferEntry::Whole(_) => "--transfer".to_owned(),
                    });
                    let range = appearance
                        .range
                        .map(|[low, high]| format!("--range {},{}", plain(low), plain(high)));
                    let unit = appearance
                        .opacity_unit
                        .map(|unit| format!("--opacity-unit {}", plain(unit)));
                    [transfer, range, unit].into_iter().flatten().collect::<Vec<_>>().join(" ")
                });
                match flags.into_iter().find(|flags| !flags.is_empty()) {
                    Some(flags) => Failure::Usage(format!("{flags}: {what}")),
                    None => Error::Transfer(what).into(),
                }
            }
            other => other.into(),
        }
    }

    /// Refuses what has no effect on the loaded inputs, or warns of it.
    fn check_effect(&self, loaded: &Loaded, progress: &Progress) -> Result<(), Failure> {
        let inputs = &loaded.inputs;
        let is_surface = |input: &&LoadedInput| input.kind == Kind::Mesh || input.is_solid;
        let is_scaled = inputs.iter().find(is_surface).is_some();
        let unscaled = inputs.iter().rfind(|input| input.kind == Kind::Hierarchy);
        let has_legends = !loaded.captions.legends.is_empty();
        color::check_effect(&self.scene, is_scaled, has_legends)?;
        let has_scale = self.given.has("radius-scale");
        if let (true, Some(input), false) = (has_scale, unscaled, is_scaled) {
            return Err(Failure::Usage(format!(
                "--radius-scale does not apply to {}: a hierarchy keeps the radii that it was \
                 converted with; convert it with --radius-scale",
                input.file.display()
            )));
        }
        let paths = inputs.iter().map(|input| input.file.as_path());
        self.given.warn(&paths.zip(loaded.kinds()).collect::<Vec<_>>(), progress);
        if self.given.has("range") && !has_legends {
            progress.warn("--range has no effect: nothing here is coloured or shown by values");
        }
        Ok(())
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
        match (loaded.undrawn(error, camera, size), path) {
            ((error, true), Some((file, place))) => error.stated_in(file, place).into(),
            ((error, _), _) => error.into(),
        }
    }

    /// Returns the settings of a picture before it is averaged down.
    pub fn settings(&self, loaded: &Loaded) -> splatkit::Result<Settings> {
        Ok(loaded.drawing(&self.scene.picture)?.settings)
    }

    /// Returns a warning if light or optics that the picture asks for change nothing.
    pub fn idle(&self, scene: &Scene) -> Option<&'static str> {
        engine::idle(&self.scene.picture, scene)
    }

    /// Returns how the camera looks at the scene.
    pub fn framing(&self) -> splatkit::Result<Framing> {
        self.scene.framing()
    }

    /// Opens the device that draws a scene.
    pub fn open_device(&self, scene: &Scene) -> splatkit::Result<Device> {
        self.device.open(scene)
    }

    /// Returns how pictures of a scene are finished.
    pub fn finish(&self, loaded: &Loaded) -> Result<Finish, Failure> {
        let picture = &self.scene.picture;
        let (drawing, background) = (loaded.drawing(picture)?, picture.background());
        let overlay = Overlay::open(&self.scene.overlay, &loaded.captions, self.page())?;
        Ok(Finish { drawing, background, overlay, dpi: picture.dpi })
    }

    /// Returns the page that texts are written on.
    fn page(&self) -> Page {
        let picture = &self.scene.picture;
        let labels = picture.panel_labels.unwrap_or_default();
        let has_labels = !picture.views.is_empty() && labels != PanelLabels::None;
        Page { background: picture.background(), dpi: picture.dpi, has_labels }
    }

    /// Returns the panels of a picture of several views; `None` for a picture of one view.
    pub fn figure(&self, subject: &Subject, finish: &Finish) -> splatkit::Result<Option<Figure>> {
        let overlay = finish.overlay.as_ref();
        Figure::new(&self.scene.picture, overlay, (&self.framing()?, subject))
    }

    /// Returns the panels of a picture that shows several times or channels by one camera: their
    /// names, the number in a row and what their corners say.
    pub fn figure_of(
        &self,
        subject: &Subject,
        finish: &Finish,
        panels: (Vec<String>, Option<u32>, PanelLabels),
    ) -> splatkit::Result<Figure> {
        let overlay = finish.overlay.as_ref();
        Figure::of_panels(&self.scene.picture, overlay, (&self.framing()?, subject), panels)
    }

    /// Returns how a picture with several panels is finished, if each has such a label.
    pub fn finish_with_labels(
        &self,
        finish: Finish,
        loaded: &Loaded,
        labels: PanelLabels,
    ) -> Result<Finish, Failure> {
        let page = Page { has_labels: labels != PanelLabels::None, ..self.page() };
        let overlay = Overlay::open(&self.scene.overlay, &loaded.captions, page)?;
        Ok(Finish { overlay, ..finish })
    }

    /// Returns the size of the part of a drawn picture that the camera is fitted to: the middle,
    /// beside the bars.
    pub fn free(&self, finish: &Finish) -> [u32; 2] {
        let room = finish.overlay.as_ref().map_or(0, |overlay| overlay.room(self.size()));
        finish.drawing.free(room)
    }

    /// Returns an error if a picture shows nothing.
    pub fn require_content(&self, picture: &Picture) -> Result<(), Failure> {
        Ok(self.scene.picture.require_content(picture)?)
    }
}

/// What a window asks.
#[cfg(feature = "window")]
impl Job {
    /// Checks that the inputs are files of known kinds, without reading more than their heads.
    /// Addresses are not asked.
    pub fn check_files(&self) -> Result<(), Failure> {
        let is_here = |path: &&std::path::PathBuf| !splatkit::input::is_remote(path);
        let files = self.scene.visible().filter(|input| is_here(&&input.file));
        files.into_iter().try_for_each(|input| {
            self.scene.reading_of(input).reading().kind(&input.file).map(drop)
        })?;
        Ok(())
    }

    /// Returns the camera of a single picture.
    pub fn camera(&self, loaded: &Loaded, finish: &Finish) -> splatkit::Result<Camera> {
        self.framing()?.camera(&loaded.subject, self.free(finish))
    }

    /// Returns how pictures are finished if other transfer functions show the fields of these
    /// items.
    pub fn finish_with(
        &self,
        loaded: &Loaded,
        transfers: &[(usize, TransferFunction)],
    ) -> Result<Finish, Failure> {
        let captions = self.captions_with(loaded, transfers);
        let overlay = Overlay::open(&self.scene.overlay, &captions, self.page())?;
        Ok(Finish { overlay, ..self.finish(loaded)? })
    }

    /// Returns what a loaded scene says for texts if other transfer functions show the fields of
    /// these items.
    fn captions_with(&self, loaded: &Loaded, transfers: &[(usize, TransferFunction)]) -> Captions {
        let mut captions = loaded.captions.clone();
        // The colours are the function's own by now, also those of a map.
        let coloring = Coloring { range: None, ..self.scene.appearance.coloring() };
        let transfers = transfers.iter().map(|(item, transfer)| (*item, transfer));
        captions.take_transfers(&loaded.scene, transfers, &coloring);
        captions
    }

    /// Returns the scene's way up.
    pub fn up(&self, loaded: &Loaded) -> splatkit::Result<glam::DVec3> {
        Ok(self.framing()?.orientation(&loaded.subject).0.up)
    }
}

/// Formats a number as people type it.
fn plain(value: f64) -> String {
    if value == 0.0 || (1e-4..1e16).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}
