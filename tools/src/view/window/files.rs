//! What the window reads and writes besides inputs: pictures, scenes, transfer functions, paths of
//! the camera, and films.

use super::Window;
use crate::{
    failure::Failure,
    frames::Storing,
    job::{Finish, Job},
    motion::read_path,
    scene_file,
    view::{
        export::{Exporting, Order, What},
        loader::text_of,
    },
};
use splatkit::{
    input::Limits,
    math::CameraPath,
    picture::{Encoding, PictureFormat},
    session::{CameraEntry, InputEntry},
    volume::TransferFunction,
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

impl Window {
    /// Adds files to the scene, or opens a scene file in place of it.
    pub fn open(&mut self, files: Vec<PathBuf>) {
        if let Some(path) = files.iter().find(|path| scene_file::is_scene(path)) {
            let is_trusting = self.document.is_trusting;
            match scene_file::read(path, is_trusting) {
                Ok(scene) => {
                    self.document.open(scene, path.clone());
                    self.loaded_by = None;
                    self.say_views();
                }
                Err(error) => self.say(text_of(&error.into()), true),
            }
            return;
        }
        let entries = files.into_iter().map(InputEntry::new);
        self.document.change(|scene| scene.inputs.extend(entries));
    }

    /// Says that the window shows one view, if a figure of several was opened.
    pub fn say_views(&mut self) {
        let views = self.document.views();
        if views > 0 {
            let text = format!(
                "a figure of {views} views: the window shows one of them; File, Save figure saves \
                 all"
            );
            self.say(text, false);
        }
    }

    /// Puts what is shown at the top of the recent files: the scene file, or else the inputs.
    pub(super) fn keep_recent(&mut self) {
        let inputs = || self.document.scene().visible().map(|input| input.file.clone()).collect();
        let files: Vec<PathBuf> = self.document.path.clone().map_or_else(inputs, |path| vec![path]);
        if let Err(message) = self.surroundings.recent.add(&files) {
            self.say(message, false);
        }
    }

    /// Saves the exact picture as soon as it is drawn.
    pub fn save_picture(&mut self, path: PathBuf) {
        match PictureFormat::of(&path) {
            Ok(_) => self.save_to = Some(path),
            Err(error) => self.say(error.to_string(), true),
        }
    }

    /// Saves the scene as it is shown, with its camera and its size.
    pub fn save_scene(&mut self, path: &Path) {
        self.fix_view();
        let done = self.document.save(path);
        let is_saved = done.is_ok();
        self.say_saved(path, done);
        let views = self.document.views();
        if is_saved && views > 0 {
            self.say(format!("the scene has the view that is shown, not the {views} views"), false);
        }
        if is_saved && scene_file::read(path, false).is_err() {
            let name = path.display();
            self.say(format!("{name} names files elsewhere: open it with --trust-scene"), false);
        }
    }

    /// Copies the command that draws what is shown.
    pub(super) fn copy_command(&mut self) {
        self.fix_view();
        match self.document.command_line() {
            Ok(line) => {
                self.context.copy_text(line);
                self.say("the command is in the clipboard", false);
            }
            Err(message) => self.say(message, true),
        }
    }

    /// Writes the camera and the size that are shown into the scene.
    fn fix_view(&mut self) {
        let Some(scene_view) = &self.scene_view else { return };
        let (camera, size) = (CameraEntry::from(scene_view.orbit.camera()), self.size);
        self.document.set_camera(camera);
        self.document.adjust(|scene| scene.picture.size = Some(size));
    }

    /// Says that a file was written, or why not.
    fn say_saved(&mut self, path: &Path, done: splatkit::Result<()>) {
        match done {
            Ok(()) => self.say(format!("{}: saved", path.display()), false),
            Err(error) => self.say(error.to_string(), true),
        }
    }

    /// Takes the transfer function of a file.
    pub fn load_transfer(&mut self, path: &Path) {
        match TransferFunction::read(path, &Limits::default()) {
            Ok(transfer) => {
                self.set_transfer(&transfer);
                self.document.end_step();
            }
            Err(error) => self.say(error.to_string(), true),
        }
    }

    pub fn save_transfer(&mut self, path: &Path) {
        let Some(transfer) = self.transfer() else { return };
        let text = crate::transfer::text(&transfer);
        self.say_saved(path, splatkit::disk::write(path, text.as_bytes()));
    }

    /// Takes the keyframes of a file.
    pub fn load_path(&mut self, path: &Path) {
        match read_path(path, &Limits::default()) {
            Ok(path) => self.keyframes = path.keyframes().to_vec(),
            Err(error) => self.say(error.to_string(), true),
        }
    }

    pub fn save_path(&mut self, path: &Path) {
        let text = CameraPath::new(self.keyframes.clone()).map(|path| path.to_json());
        let done = text.and_then(|text| splatkit::disk::write(path, text.as_bytes()));
        self.say_saved(path, done);
    }

    /// Starts to write a film along the path of the camera.
    pub fn export_film(&mut self, output: PathBuf) {
        let path = CameraPath::new(self.keyframes.clone()).map_err(Failure::from);
        let what = path.map(|path| What::Film(path, self.player.rate));
        let job = self.document.job_of_film(self.size);
        self.export(what.and_then(|what| Ok((what, job?))), output);
    }

    /// Starts to write the figure that was opened, as `render` draws it.
    pub fn export_figure(&mut self, output: PathBuf) {
        let job = self.document.job_of_figure();
        self.export(job.map(|job| (What::Figure, job)), output);
    }

    fn export(&mut self, wanted: Result<(What, Job), Failure>, output: PathBuf) {
        let Some(scene_view) = &self.scene_view else { return };
        let stage = Arc::clone(&scene_view.stage);
        let transfers = scene_view.edited_transfers(&self.document);
        let repaint = self.context.clone();
        let started = wanted.map_err(|failure| text_of(&failure)).and_then(|(what, job)| {
            let order = Order { job, stage, transfers, what, output };
            Exporting::start(order, move || repaint.request_repaint())
                .map_err(|error| error.to_string())
        });
        match started {
            Ok(exporting) => self.exporting = Some(exporting),
            Err(message) => self.say(message, true),
        }
    }

    /// Says how a film or a figure ended.
    pub(super) fn take_film(&mut self) {
        let Some(exporting) = &self.exporting else { return };
        let Some((result, notes)) = exporting.take() else {
            // The time runs.
            self.context.request_repaint_after(std::time::Duration::from_millis(200));
            return;
        };
        self.exporting = None;
        notes.into_iter().for_each(|note| self.say(note, false));
        if let Err(message) = result {
            self.say(message, true);
        }
    }

    /// Saves the picture if it is wanted and exact.
    pub(super) fn save_if_exact(&mut self) {
        if self.save_to.is_none() || !self.rests() {
            return;
        }
        let (Some(path), Some(frame), Some(scene_view)) =
            (self.save_to.take(), &self.frame, &self.scene_view)
        else {
            return;
        };
        let written = PictureFormat::of(&path)
            .and_then(|format| frame.picture.encode(&encoding_of(format, &scene_view.finish)))
            .and_then(|bytes| splatkit::disk::write(&path, &bytes));
        self.say_saved(&path, written);
    }
}

/// Returns how a finished picture becomes a file of a format.
fn encoding_of(format: PictureFormat, finish: &Finish) -> Encoding {
    Storing { bits: None, dpi: finish.dpi }.of(format, finish.background)
}
