//! What the window reads and writes besides inputs: pictures, scenes, transfer functions, paths of
//! the camera, and films.

use super::{
    export::{Exporting, Film},
    loader::text_of,
    window::Window,
};
use crate::{motion::read_path, scene_file};
use splatkit::{
    input::Limits, picture::PictureFormat, session::CameraEntry, volume::TransferFunction,
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

impl Window {
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
        if is_saved && scene_file::read(path, false).is_err() {
            let name = path.display();
            self.say(format!("{name} names files elsewhere: open it with --trust-scene"), false);
        }
    }

    /// Copies the command that draws what is shown.
    pub fn copy_command(&mut self) {
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
                let before = self.document.scene().clone();
                self.set_transfer(&transfer);
                self.document.keep(before);
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
            Ok(path) => self.panels.flight.keyframes = path.keyframes().to_vec(),
            Err(error) => self.say(error.to_string(), true),
        }
    }

    pub fn save_path(&mut self, path: &Path) {
        let text = self.panels.flight.path().map(|path| path.to_json());
        let done = text.and_then(|text| splatkit::disk::write(path, text.as_bytes()));
        self.say_saved(path, done);
    }

    /// Starts to write a film along the path of the camera.
    pub fn export(&mut self, output: PathBuf) {
        let Some(scene_view) = &self.scene_view else { return };
        let stage = Arc::clone(&scene_view.stage);
        let repaint = self.context.clone();
        let started = self
            .document
            .job_of_film(self.size)
            .and_then(|job| Ok((job, self.panels.flight.path()?)))
            .map_err(|failure| text_of(&failure))
            .and_then(|(job, path)| {
                let (transfers, rate) = (self.transfers(), self.panels.flight.rate);
                let film = Film { job, stage, transfers, path, rate, output };
                Exporting::start(film, move || repaint.request_repaint())
                    .map_err(|error| error.to_string())
            });
        match started {
            Ok(exporting) => self.panels.flight.exporting = Some(exporting),
            Err(message) => self.say(message, true),
        }
    }

    /// Says how a film ended.
    pub fn take_film(&mut self) {
        let Some(exporting) = &self.panels.flight.exporting else { return };
        let Some((result, notes)) = exporting.take() else {
            // The time runs.
            self.context.request_repaint_after(std::time::Duration::from_millis(200));
            return;
        };
        self.panels.flight.exporting = None;
        notes.into_iter().for_each(|note| self.say(note, false));
        if let Err(message) = result {
            self.say(message, true);
        }
    }

    /// Saves the picture if it is wanted and exact.
    pub fn save_if_exact(&mut self) {
        if self.save_to.is_none() || !self.rests() {
            return;
        }
        let (Some(path), Some(frame), Some(scene_view)) =
            (self.save_to.take(), &self.frame, &self.scene_view)
        else {
            return;
        };
        let written = PictureFormat::of(&path)
            .and_then(|format| frame.picture.encode(format, scene_view.finish.background))
            .and_then(|bytes| splatkit::disk::write(&path, &bytes));
        self.say_saved(&path, written);
    }
}
