//! Asking for paths: a field, and the system's own dialog.

use crate::view::window::Window;
use eframe::egui::{self, Ui};
use std::{
    path::PathBuf,
    sync::mpsc::{Receiver, channel},
};

/// What a path is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ask {
    Open,
    SaveScene,
    SavePicture,
    OpenTransfer,
    SaveTransfer,
    OpenPath,
    SavePath,
    Export,
}

impl Ask {
    /// Returns the title, and the name of what is done.
    fn title(self) -> (&'static str, &'static str) {
        match self {
            Self::Open => ("Open a file", "Open"),
            Self::SaveScene => ("Save the scene", "Save"),
            Self::SavePicture => ("Save the picture", "Save"),
            Self::OpenTransfer => ("Load a transfer function", "Load"),
            Self::SaveTransfer => ("Save the transfer function", "Save"),
            Self::OpenPath => ("Open a path of the camera", "Open"),
            Self::SavePath => ("Save the path of the camera", "Save"),
            Self::Export => {
                ("Export a film (.gif, .webp, .apng, .mp4, .webm, .mov, .png)", "Export")
            }
        }
    }

    /// Returns the name to begin with.
    fn name(self) -> &'static str {
        match self {
            Self::Open | Self::OpenTransfer | Self::OpenPath => "",
            Self::SaveScene => "scene.json",
            Self::SavePicture => "picture.png",
            Self::SaveTransfer => "transfer.json",
            Self::SavePath => "path.json",
            Self::Export => "film.webp",
        }
    }
}

/// A path that is asked for.
pub struct Asked {
    ask: Ask,
    text: String,
    /// Whether the field has not been shown yet: it is then where the keys go.
    is_new: bool,
    /// The files that were chosen in the system's own dialog.
    chosen: Option<Receiver<Vec<PathBuf>>>,
}

impl Asked {
    pub fn new(ask: Ask) -> Self {
        Self { ask, text: ask.name().to_owned(), is_new: true, chosen: None }
    }
}

/// Asks for a path.
pub fn show(window: &mut Window, ui: &mut Ui) {
    let Some(mut asked) = window.panels.asked.take() else { return };
    let (title, action) = asked.ask.title();
    let mut chosen = asked.chosen.as_ref().and_then(|chosen| chosen.try_recv().ok());
    let (mut stays, mut is_done) = (true, false);
    egui::Window::new(title).collapsible(false).open(&mut stays).show(ui.ctx(), |ui| {
        let field = ui.add(
            egui::TextEdit::singleline(&mut asked.text).hint_text("a path").desired_width(360.0),
        );
        if std::mem::take(&mut asked.is_new) {
            field.request_focus();
        }
        let enters = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        ui.horizontal(|ui| {
            is_done = ui.button(action).clicked() || enters;
            if ui.button("Browse…").clicked() {
                asked.chosen = Some(browse(asked.ask, asked.text.clone(), ui.ctx().clone()));
            }
        });
    });
    if is_done && !asked.text.trim().is_empty() {
        chosen = Some(vec![PathBuf::from(asked.text.trim())]);
    }
    let Some(files) = chosen.filter(|files| !files.is_empty()) else {
        window.panels.asked = stays.then_some(asked);
        return;
    };
    match (asked.ask, files.first()) {
        (Ask::Open, _) => window.open(files),
        (Ask::SaveScene, Some(path)) => window.save_scene(path),
        (Ask::SavePicture, Some(path)) => window.save_picture(path.clone()),
        (Ask::OpenTransfer, Some(path)) => window.load_transfer(path),
        (Ask::SaveTransfer, Some(path)) => window.save_transfer(path),
        (Ask::OpenPath, Some(path)) => window.load_path(path),
        (Ask::SavePath, Some(path)) => window.save_path(path),
        (Ask::Export, Some(path)) => window.export(path.clone()),
        (_, None) => {}
    }
}

/// Opens the system's own dialog in a thread, so that the window stays alive.
fn browse(ask: Ask, name: String, context: egui::Context) -> Receiver<Vec<PathBuf>> {
    let (send, receive) = channel();
    let dialog = move || {
        let dialog = rfd::FileDialog::new();
        let files = match ask {
            Ask::Open => dialog.pick_files(),
            Ask::OpenTransfer | Ask::OpenPath => dialog.pick_file().map(|file| vec![file]),
            _ => dialog.set_file_name(name).save_file().map(|file| vec![file]),
        };
        send.send(files.unwrap_or_default()).ok();
        context.request_repaint();
    };
    // Without a thread there is no dialog; the field stays.
    std::thread::Builder::new().name("dialog".into()).spawn(dialog).ok();
    receive
}
