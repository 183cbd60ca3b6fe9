//! Asking for paths: the system's dialog, and the window's own where the system has none.

mod browser;
mod native;

use super::action::{Action, Purpose};
use browser::Browser;
use eframe::egui::{Context, Ui};
use native::Native;
use std::path::{Path, PathBuf};

/// The dialogs that ask for paths, of which one is open at a time.
pub struct Dialogs {
    /// Whether the system has dialogs.
    has_native: bool,
    native: Option<Native>,
    browser: Option<Browser>,
    /// The folder of the file that was chosen last.
    folder: Option<PathBuf>,
}

impl Dialogs {
    /// Dialogs of the system if it has any.
    pub fn of_system() -> Self {
        Self { has_native: native::is_there(), ..Self::plain() }
    }

    /// Dialogs of the window alone.
    pub fn plain() -> Self {
        Self { has_native: false, native: None, browser: None, folder: None }
    }

    /// Asks for a path, beginning in a folder unless another one was chosen before.
    pub fn ask(&mut self, purpose: Purpose, folder: Option<&Path>, context: &Context) {
        let folder = self.folder.clone().or(folder.map(Path::to_owned));
        let folder = folder.filter(|folder| folder.is_dir());
        let folder = folder.or_else(|| std::env::current_dir().ok()).unwrap_or_default();
        (self.native, self.browser) = (None, None);
        if self.has_native {
            self.native = Native::open(purpose, folder.clone(), context.clone());
        }
        if self.native.is_none() {
            self.browser = Some(Browser::new(purpose, folder));
        }
    }

    /// Shows the window's dialog, if it is open, and returns what was chosen in any dialog.
    pub fn show(&mut self, ui: &mut Ui) -> Vec<Action> {
        let mut chosen = None;
        if let Some(native) = &self.native
            && let Some(answer) = native.take()
        {
            let purpose = native.purpose;
            match answer {
                Some(files) => chosen = Some((purpose, files)),
                // The system promised a dialog that it could not open.
                None if native.has_failed() => {
                    self.has_native = false;
                    self.browser = Some(Browser::new(purpose, native.folder.clone()));
                }
                None => {}
            }
            self.native = None;
        }
        if let Some(browser) = &mut self.browser {
            let purpose = browser.purpose;
            match browser.show(ui) {
                browser::Answer::None => {}
                browser::Answer::Closed => self.browser = None,
                browser::Answer::Chosen(file) => {
                    chosen = Some((purpose, vec![file]));
                    self.browser = None;
                }
            }
        }
        let Some((purpose, files)) = chosen.filter(|(_, files)| !files.is_empty()) else {
            return Vec::new();
        };
        self.folder = files[0].parent().map(Path::to_owned);
        vec![Action::Chosen(purpose, files)]
    }
}
