//! Doing what a user asks for.

use super::Window;
use crate::view::{
    action::{Action, Motion, Part, Purpose},
    curve::window_level,
    document::unplaced,
};
use eframe::egui::{Vec2, ViewportCommand};
use splatkit::{
    glam::DVec3,
    session::{CameraEntry, Description, Framing, InputEntry, PictureEntry, Side},
};
use std::path::{Path, PathBuf};

impl Window {
    /// Does what a user asks for.
    pub fn apply(&mut self, action: Action) {
        match action {
            Action::Ask(purpose) => self.ask(purpose),
            Action::Chosen(purpose, files) => self.use_files(purpose, files),
            Action::OpenRecent(file) => self.open_alone(file),
            Action::ForgetRecent => {
                if let Err(message) = self.surroundings.recent.forget() {
                    self.say(message, true);
                }
            }
            Action::Change(change) => self.document.change(change),
            Action::Drag(change) => self.document.drag(change),
            Action::Undo => self.document.undo(),
            Action::Redo => self.document.redo(),
            Action::ChooseField(item) => {
                if let Some(scene_view) = &mut self.scene_view {
                    scene_view.field = item;
                }
            }
            Action::Transfer(transfer) => self.set_transfer(&transfer),
            Action::Level(drag) => self.level(drag),
            Action::Move(motion) => self.move_camera(motion),
            Action::View(side) => self.look_from(side),
            Action::Select(select) => self.select(select),
            Action::Measure => {
                self.measures = !self.measures;
                self.selection.tool = None;
                self.measured.clear();
            }
            Action::Pick(point) => self.pick(point),
            Action::Center(point) => self.center(point),
            Action::Keyframes(keyframes) => self.keyframes = keyframes,
            Action::CancelFilm => {
                if let Some(exporting) = self.exporting.take() {
                    self.say(format!("the {} was cancelled", exporting.what.name()), false);
                }
            }
            Action::CancelLoading => self.cancel(),
            Action::CopyCommand => self.copy_command(),
            Action::Say(message) => self.say(message, false),
            Action::Toggle(part) => self.toggle(part),
            Action::Theme(theme) => self.context.set_theme(theme),
            Action::FullScreen => {
                let is_full = self.context.input(|input| input.viewport().fullscreen);
                let wanted = !is_full.unwrap_or(false);
                self.context.send_viewport_cmd(ViewportCommand::Fullscreen(wanted));
            }
            Action::Quit => self.context.send_viewport_cmd(ViewportCommand::Close),
        }
    }

    fn toggle(&mut self, part: Part) {
        let is_shown = match part {
            Part::Side => &mut self.parts.side,
            Part::Slices => &mut self.parts.slices,
            Part::Help => &mut self.parts.help,
            Part::Handles => &mut self.parts.handles,
        };
        *is_shown = !*is_shown;
    }

    /// Asks for a path, beginning in the folder of the scene or of its first input.
    fn ask(&mut self, purpose: Purpose) {
        let inputs = &self.document.scene().inputs;
        let file = self.document.path.as_deref().or(inputs.first().map(|input| &*input.file));
        let folder = file.and_then(Path::parent).filter(|folder| folder.is_absolute());
        self.surroundings.dialogs.ask(purpose, folder, &self.context);
    }

    fn use_files(&mut self, purpose: Purpose, files: Vec<PathBuf>) {
        let Some(first) = files.first().cloned() else { return };
        match purpose {
            Purpose::Open => self.open(files),
            Purpose::SaveScene => self.save_scene(&first),
            Purpose::SavePicture => self.save_picture(first),
            Purpose::OpenTransfer => self.load_transfer(&first),
            Purpose::SaveTransfer => self.save_transfer(&first),
            Purpose::OpenPath => self.load_path(&first),
            Purpose::SavePath => self.save_path(&first),
            Purpose::Export => self.export_film(first),
            Purpose::SaveFigure => self.export_figure(first),
            Purpose::SaveEdited(number) => self.save_edited(number, &first),
        }
    }

    /// Shows a file in place of the scene, as one step. The window stays as it is: its engine, its
    /// background and the texts over the picture.
    fn open_alone(&mut self, file: PathBuf) {
        if crate::scene_file::is_scene(&file) {
            return self.open(vec![file]);
        }
        self.document.path = None;
        self.document.change(|scene| {
            *scene = Description {
                inputs: vec![InputEntry::new(file)],
                engine: scene.engine,
                overlay: scene.overlay.clone(),
                picture: PictureEntry {
                    background: scene.picture.background,
                    size: scene.picture.size,
                    ..PictureEntry::default()
                },
                ..Description::new([])
            };
        });
    }

    /// Looks at the whole scene from a side, or as usual.
    fn look_from(&mut self, side: Option<Side>) {
        self.document.adjust(|scene| {
            scene.camera = None;
            scene.framing = Framing { view: side, ..unplaced(&scene.framing) };
        });
        self.set_for = None;
    }

    fn move_camera(&mut self, motion: Motion) {
        let Some(scene_view) = &mut self.scene_view else { return };
        motion.apply(&mut scene_view.orbit, self.size);
        let camera = CameraEntry::from(scene_view.orbit.camera());
        self.document.set_camera(camera);
    }

    /// Turns about a point from now on. The slices cross there too.
    fn center(&mut self, point: DVec3) {
        self.slices.set_place(point);
        if let Some(scene_view) = &mut self.scene_view {
            scene_view.orbit.center(point);
            let camera = CameraEntry::from(scene_view.orbit.camera());
            self.document.set_camera(camera);
        }
    }

    /// Moves and widens the transfer function as a hand drags.
    fn level(&mut self, drag: Vec2) {
        let (Some(mut transfer), Some(scene_view)) = (self.transfer(), &self.scene_view) else {
            return;
        };
        window_level(&mut transfer, drag, scene_view.stage.values(scene_view.field));
        self.set_transfer(&transfer);
    }

    fn pick(&mut self, point: DVec3) {
        if self.measured.len() >= 2 {
            self.measured.clear();
        }
        self.measured.push(point);
    }
}
