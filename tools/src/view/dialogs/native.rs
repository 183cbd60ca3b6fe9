//! The system's own dialogs.

use crate::view::action::Purpose;
use eframe::egui::Context;
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, TryRecvError, channel},
    time::{Duration, Instant},
};

/// A dialog that ends sooner than this was not closed by a hand: it could not be opened.
const SOON: Duration = Duration::from_millis(400);

/// A dialog of the system that is open.
pub struct Native {
    pub purpose: Purpose,
    pub folder: PathBuf,
    since: Instant,
    answer: Receiver<Option<Vec<PathBuf>>>,
}

impl Native {
    /// Opens a dialog in a thread, so that the window stays alive. Returns `None` without a thread.
    pub fn open(purpose: Purpose, folder: PathBuf, context: Context) -> Option<Self> {
        let (send, answer) = channel();
        let begin = folder.clone();
        let dialog = move || {
            let mut dialog = rfd::FileDialog::new().set_title(purpose.title()).set_directory(begin);
            if !purpose.endings().is_empty() {
                dialog = dialog.add_filter(purpose.endings().join(", "), purpose.endings());
            }
            let one = |file: Option<PathBuf>| file.map(|file| vec![file]);
            let files = match purpose.name() {
                None if purpose == Purpose::Open => dialog.pick_files(),
                None => one(dialog.pick_file()),
                Some(name) => one(dialog.set_file_name(name).save_file()),
            };
            send.send(files).ok();
            context.request_repaint();
        };
        std::thread::Builder::new().name("dialog".into()).spawn(dialog).ok()?;
        Some(Self { purpose, folder, since: Instant::now(), answer })
    }

    /// Takes the answer once there is one: the files, or nothing if the dialog was closed.
    pub fn take(&self) -> Option<Option<Vec<PathBuf>>> {
        match self.answer.try_recv() {
            Ok(answer) => Some(answer),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(None),
        }
    }

    /// Whether a dialog that ended now could not be opened at all.
    pub fn has_failed(&self) -> bool {
        self.since.elapsed() < SOON
    }
}

/// Returns whether the system has dialogs.
pub fn is_there() -> bool {
    cfg!(any(windows, target_os = "macos")) || has_desktop(|name| std::env::var_os(name))
}

/// Returns whether a desktop of Linux or the BSDs has dialogs, by the variables of its session:
/// those of a portal, which answers on the session's bus, or zenity.
fn has_desktop(variable: impl Fn(&str) -> Option<OsString>) -> bool {
    let folders = |name: &str, usual: &str| {
        let list = variable(name).filter(|list| !list.is_empty());
        std::env::split_paths(&list.unwrap_or_else(|| usual.into())).collect::<Vec<_>>()
    };
    let holds = |folders: Vec<PathBuf>, file: &str| {
        folders.iter().any(|folder| folder.join(file).is_file())
    };
    let service = "dbus-1/services/org.freedesktop.portal.Desktop.service";
    let has_portal = Path::new("/.flatpak-info").exists()
        || holds(folders("XDG_DATA_DIRS", "/usr/local/share:/usr/share"), service);
    let runtime = variable("XDG_RUNTIME_DIR").map(PathBuf::from);
    let has_bus = variable("DBUS_SESSION_BUS_ADDRESS").is_some()
        || runtime.is_some_and(|folder| folder.join("bus").exists());
    (has_portal && has_bus) || holds(folders("PATH", "/usr/bin"), "zenity")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_portal_needs_its_service_and_a_bus() {
        let folder = tempfile::tempdir().expect("a folder");
        let services = folder.path().join("dbus-1").join("services");
        std::fs::create_dir_all(&services).expect("a folder");
        let path = folder.path().as_os_str().to_owned();
        let session = |bus: bool| {
            let path = path.clone();
            move |name: &str| match name {
                "XDG_DATA_DIRS" | "PATH" => Some(path.clone()),
                "DBUS_SESSION_BUS_ADDRESS" if bus => Some("unix:path=/run/bus".into()),
                _ => None,
            }
        };
        assert!(!has_desktop(session(true)));
        let service = services.join("org.freedesktop.portal.Desktop.service");
        std::fs::write(service, "[D-BUS Service]").expect("written");
        assert!(has_desktop(session(true)) && !has_desktop(session(false)));
        std::fs::write(folder.path().join("zenity"), "").expect("written");
        assert!(has_desktop(session(false)));
    }
}
