//! Loading the scene, and ordering pictures of it.

use super::{SetFor, Window};
use crate::view::{
    curve::CurveEditor,
    document::LoadedBy,
    hand::Hand,
    loader::{Loading, text_of},
    painter::{Order, Stage},
    scene_view::SceneView,
    slices::SlicePanes,
};
use splatkit::session::{Description, Engine};
use std::sync::Arc;

impl Window {
    /// Gives up the scene that is being loaded.
    pub(super) fn cancel(&mut self) {
        self.give_up();
        self.say("loading was cancelled", false);
    }

    /// Goes back to the scene that is shown, which can be redone.
    fn give_up(&mut self) {
        self.loading = None;
        if self.scene_view.is_some() && self.document.can_undo() {
            self.document.undo();
            self.loaded_by = Some(self.document.loaded_by());
        }
    }

    /// Returns the stage that is shown, if only its engine is to be another one.
    fn kept_stage(&self, wanted: &LoadedBy) -> Option<Arc<Stage>> {
        let scene_view = self.scene_view.as_ref()?;
        let with_engine = |(scene, facets): &LoadedBy| {
            (Description { engine: Engine::Auto, ..scene.clone() }, *facets)
        };
        let is_same = with_engine(&scene_view.loaded_by) == with_engine(wanted);
        is_same.then(|| Arc::clone(&scene_view.stage))
    }

    pub(super) fn start_loading(&mut self) {
        let wanted = self.document.loaded_by();
        if self.loaded_by.as_ref() == Some(&wanted) {
            return;
        }
        self.loading = None;
        self.loaded_by = Some(wanted.clone());
        if wanted.0.inputs.is_empty() {
            self.clear();
            return;
        }
        let (repaint, kept) = (self.context.clone(), self.kept_stage(&wanted));
        let job = self.document.job(self.size).map_err(|failure| text_of(&failure));
        let started = job.and_then(|job| {
            Loading::start(job, kept, move || repaint.request_repaint()).map_err(|e| e.to_string())
        });
        match started {
            Ok(loading) => self.loading = Some(loading),
            Err(message) => {
                self.give_up();
                self.say(message, true);
            }
        }
    }

    /// Shows nothing.
    fn clear(&mut self) {
        (self.scene_view, self.frame, self.set_for, self.ordered) = (None, None, None, None);
        self.canvas.clear();
        self.painter.clear();
    }

    pub(super) fn take_loaded(&mut self) {
        let Some(loading) = &self.loading else { return };
        let Some(result) = loading.take() else {
            // The bar moves.
            self.context.request_repaint_after(std::time::Duration::from_millis(100));
            return;
        };
        let notes = loading.take_notes();
        let seconds = loading.since.elapsed().as_secs_f64();
        self.loading = None;
        notes.into_iter().for_each(|note| self.say(note, false));
        match result {
            Ok(stage) => {
                self.say(format!("loaded in {seconds:.1} s"), false);
                self.show(stage);
            }
            Err(message) => {
                self.give_up();
                self.say(message, true);
            }
        }
    }

    /// Shows a loaded scene.
    fn show(&mut self, stage: Stage) {
        // Another device draws the same scene: all else stays.
        if let Some(scene_view) = &mut self.scene_view
            && Arc::ptr_eq(&scene_view.stage.loaded, &stage.loaded)
        {
            scene_view.stage = Arc::new(stage);
            scene_view.loaded_by = self.document.loaded_by();
            (self.set_for, self.ordered) = (None, None);
            return;
        }
        let bounds = stage.loaded.subject.bounds;
        let mut scene_view = match SceneView::new(&self.document, stage, self.size) {
            Ok(scene_view) => scene_view,
            Err(failure) => return self.say(text_of(&failure), true),
        };
        self.document.take_clips(&scene_view.settings.clips);
        scene_view.loaded_by = self.document.loaded_by();
        self.loaded_by = Some(scene_view.loaded_by.clone());
        self.scene_view = Some(scene_view);
        (self.curve, self.slices) = (CurveEditor::new(bounds.diagonal()), SlicePanes::default());
        self.hand = Hand::default();
        let repaint = self.context.clone();
        self.choices.read(self.document.scene(), move || repaint.request_repaint());
        self.keep_recent();
        (self.set_for, self.ordered) = (None, None);
        self.measured.clear();
        // What is selected may have become more or less.
        if self.selection.condition.is_some() && self.find_selected().is_err() {
            self.selection.clear();
        }
    }

    /// Makes the settings anew if they changed, and orders a picture if anything did.
    pub(super) fn order(&mut self) -> Result<(), String> {
        if self.scene_view.is_none() || self.size.contains(&0) {
            return Ok(());
        }
        let mut scene = self.document.scene().clone();
        let is_fitted = scene.camera.is_none();
        (scene.camera, scene.appearance.transfer) = (None, None);
        scene.inputs.iter_mut().for_each(|input| input.appearance.transfer = None);
        let shows_bars = scene.overlay.scalar_bar;
        let Some(scene_view) = &mut self.scene_view else { return Ok(()) };
        let edited = || scene_view.edited_transfers(&self.document);
        let bars = if shows_bars { edited() } else { Vec::new() };
        // A fitted camera follows from the settings.
        let wanted = SetFor { scene, size: self.size, is_fitted, bars: bars.clone() };
        let is_set = self.set_for.as_ref() == Some(&wanted);
        if !is_set {
            self.set_for = Some(wanted);
            let job = self.document.job(self.size).map_err(|failure| text_of(&failure))?;
            let loaded = &scene_view.stage.loaded;
            let finish = match &bars[..] {
                [] => job.finish(loaded),
                bars => job.finish_with(loaded, bars),
            };
            scene_view.finish = Arc::new(finish.map_err(|failure| text_of(&failure))?);
            scene_view.settings = scene_view.finish.drawing.settings.clone();
            let camera = job.camera(loaded, &scene_view.finish);
            scene_view.orbit.set_camera(camera.map_err(|error| error.to_string())?);
        } else if let Some(camera) = &self.document.scene().camera {
            scene_view.orbit.set_camera(camera.camera()?);
        }
        if is_set && self.ordered.as_ref() == Some(self.document.scene()) {
            return Ok(());
        }
        self.ordered = Some(self.document.scene().clone());
        let transfers = scene_view.transfers(&self.document);
        self.last_order = self.painter.order(Order {
            stage: Arc::clone(&scene_view.stage),
            camera: scene_view.orbit.camera().clone(),
            settings: scene_view.settings.clone(),
            finish: Arc::clone(&scene_view.finish),
            transfers,
        });
        Ok(())
    }

    pub(super) fn take_frame(&mut self) {
        let (Some(frame), Some(scene_view)) = (self.painter.take_frame(), &self.scene_view) else {
            return;
        };
        // Where the picture is transparent, the window is black.
        let background = scene_view.finish.background.unwrap_or_default();
        let size = [frame.picture.width, frame.picture.height];
        let bytes = frame.picture.to_rgba8(Some(background));
        self.canvas.set(&self.context, size, &bytes, frame.is_exact());
        self.delay = frame.ordered.elapsed().as_secs_f64() * 1e3;
        // tools/window reads this line.
        tracing::debug!(
            number = frame.number,
            pixel = frame.effort.pixel,
            drawn_in = frame.milliseconds,
            delay = self.delay,
            exact = frame.is_exact(),
            "frame"
        );
        self.frame = Some(frame);
    }
}
