//! The window's own dialog for files: a folder, its entries, and the path that is chosen.

use crate::view::action::Purpose;
use eframe::egui::{self, Align2, Key, ScrollArea, TextEdit, Ui};
use std::path::{Path, PathBuf};

/// Most entries of a folder that are listed.
const MOST: usize = 2000;

/// The dialog.
pub struct Browser {
    pub purpose: Purpose,
    folder: PathBuf,
    /// The name or the path of the file.
    text: String,
    listed: Listed,
    /// Whether the field has not been shown yet: it is then where the keys go.
    is_new: bool,
}

/// The entries of a folder: the names of folders and of files, in order.
struct Listed {
    folders: Vec<String>,
    files: Vec<String>,
    /// Why the folder cannot be listed, or that it has more entries.
    note: Option<String>,
}

/// What a hand did in the dialog.
pub enum Answer {
    None,
    Closed,
    Chosen(PathBuf),
}

impl Listed {
    /// Lists the entries of a folder that are not hidden; of files those with the endings that are
    /// meant, if only a few are.
    fn of(folder: &Path, endings: &[&str]) -> Self {
        let mut listed = Self { folders: Vec::new(), files: Vec::new(), note: None };
        let entries = match std::fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) => {
                listed.note = Some(format!("the folder cannot be listed: {error}"));
                return listed;
            }
        };
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with('.') {
                continue;
            }
            let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
            let is_meant = |ending: &String| endings.contains(&ending.as_str());
            if entry.path().is_dir() {
                listed.folders.push(name);
            } else if endings.is_empty() || ending.as_ref().is_some_and(is_meant) {
                listed.files.push(name);
            }
        }
        for names in [&mut listed.folders, &mut listed.files] {
            names.sort_by_key(|name| name.to_lowercase());
            if names.len() > MOST {
                listed.note = Some(format!("only the first {MOST} of {} are listed", names.len()));
                names.truncate(MOST);
            }
        }
        listed
    }
}

impl Browser {
    pub fn new(purpose: Purpose, folder: PathBuf) -> Self {
        let listed = Listed::of(&folder, purpose.endings());
        let text = purpose.name().unwrap_or_default().to_owned();
        Self { purpose, folder, text, listed, is_new: true }
    }

    fn enter(&mut self, folder: PathBuf) {
        self.listed = Listed::of(&folder, self.purpose.endings());
        self.folder = folder;
        if self.purpose.name().is_none() {
            self.text.clear();
        }
    }

    pub fn show(&mut self, ui: &Ui) -> Answer {
        let mut stays = true;
        let mut answer = Answer::None;
        let window = egui::Window::new(self.purpose.title()).collapsible(false).open(&mut stays);
        let middle = ui.ctx().content_rect().center();
        let window = window.default_width(420.0).pivot(Align2::CENTER_CENTER).default_pos(middle);
        window.show(ui.ctx(), |ui| {
            let chosen = self.entries(ui);
            answer = match chosen {
                Some(file) => Answer::Chosen(file),
                None => self.confirm(ui),
            };
        });
        if !stays || ui.input(|input| input.key_pressed(Key::Escape)) {
            return Answer::Closed;
        }
        answer
    }

    /// Shows the folder and its entries. Returns a file that was double-clicked.
    fn entries(&mut self, ui: &mut Ui) -> Option<PathBuf> {
        let (mut entered, mut chosen) = (None, None);
        ui.horizontal(|ui| {
            let parent = self.folder.parent().map(Path::to_owned);
            let up = ui.add_enabled(parent.is_some(), egui::Button::new("Up"));
            if up.on_hover_text("The folder above").clicked() {
                entered = parent;
            }
            ui.label(self.folder.display().to_string());
        });
        ScrollArea::vertical().max_height(260.0).auto_shrink([false, true]).show(ui, |ui| {
            for name in &self.listed.folders {
                if ui.selectable_label(false, format!("{name}/")).clicked() {
                    entered = Some(self.folder.join(name));
                }
            }
            for name in &self.listed.files {
                let entry = ui.selectable_label(self.text == *name, name);
                if entry.clicked() {
                    self.text.clone_from(name);
                }
                if entry.double_clicked() {
                    chosen = Some(self.folder.join(name));
                }
            }
        });
        if let Some(note) = &self.listed.note {
            ui.weak(note);
        }
        if let Some(folder) = entered {
            self.enter(folder);
        }
        // A name that is clicked twice is not yet one to write over.
        chosen.filter(|_| self.purpose.name().is_none())
    }

    /// Shows the field of the path and the buttons.
    fn confirm(&mut self, ui: &mut Ui) -> Answer {
        let field = TextEdit::singleline(&mut self.text).hint_text("a name, a path or an address");
        let field = ui.add(field.desired_width(f32::INFINITY));
        if std::mem::take(&mut self.is_new) {
            field.request_focus();
        }
        let enters = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let text = self.text.trim();
        let is_address = splatkit::input::is_remote(Path::new(text));
        let path = if is_address { PathBuf::from(text) } else { self.folder.join(text) };
        let exists = !text.is_empty() && path.is_file();
        let action = match (self.purpose.name().is_some(), exists) {
            (true, true) => "Replace",
            (true, false) => "Save",
            (false, _) => "Open",
        };
        let mut answer = Answer::None;
        ui.horizontal(|ui| {
            let confirms = ui.add_enabled(!text.is_empty(), egui::Button::new(action)).clicked();
            if (confirms || enters) && !text.is_empty() {
                answer = Answer::Chosen(path.clone());
            }
            if self.purpose == Purpose::Open
                && ui.button("Open this folder").on_hover_text("A folder of pictures").clicked()
            {
                answer = Answer::Chosen(self.folder.clone());
            }
            if ui.button("Cancel").clicked() {
                answer = Answer::Closed;
            }
        });
        // A folder is entered rather than read, unless its button says so.
        match answer {
            Answer::Chosen(folder) if folder.is_dir() && folder != self.folder => {
                self.enter(folder);
                self.is_new = true;
                Answer::None
            }
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::{Harness, kittest::Queryable};

    struct State {
        browser: Browser,
        chosen: Option<PathBuf>,
    }

    fn harness(purpose: Purpose, folder: &Path) -> Harness<'static, State> {
        let browser = Browser::new(purpose, folder.to_owned());
        let show = |ui: &mut Ui, state: &mut State| {
            if let Answer::Chosen(file) = state.browser.show(ui) {
                state.chosen = Some(file);
            }
        };
        let state = State { browser, chosen: None };
        Harness::builder().with_size(egui::vec2(600.0, 500.0)).build_ui_state(show, state)
    }

    #[test]
    fn files_are_chosen_by_clicks_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let inner = folder.path().join("scans");
        std::fs::create_dir(&inner).expect("a folder");
        std::fs::write(inner.join("head.nrrd"), "x").expect("written");
        std::fs::write(inner.join(".hidden"), "x").expect("written");
        let mut harness = harness(Purpose::Open, folder.path());
        harness.run();
        harness.get_by_label("scans/").click();
        harness.run();
        assert!(harness.query_by_label(".hidden").is_none());
        harness.get_by_label("head.nrrd").click();
        harness.run();
        harness.get_by_label("Open").click();
        harness.run();
        assert_eq!(harness.state().chosen, Some(inner.join("head.nrrd")));
    }

    #[test]
    fn a_file_that_exists_is_replaced_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("scene.json"), "{}").expect("written");
        std::fs::write(folder.path().join("head.nrrd"), "x").expect("written");
        let mut harness = harness(Purpose::SaveScene, folder.path());
        harness.run();
        assert!(harness.query_by_label("head.nrrd").is_none(), "scenes have another ending");
        harness.get_by_label("Replace").click();
        harness.run();
        assert_eq!(harness.state().chosen, Some(folder.path().join("scene.json")));
    }
}
