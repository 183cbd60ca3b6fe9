//! Where the viewer is: in this program, if it was there when it was built, or in a folder.

use crate::failure::Failure;
use splatkit::Error;
use std::path::{Path, PathBuf};

/// The files of the viewer, as `tools/web/build` writes them.
const WORKER: &str = "splatkit-worker.js";
const ELEMENT: &str = "splatkit-viewer.js";
const ENGINE: &str = "splatkit.wasm";

/// The viewer.
pub struct Viewer {
    /// The worker, which draws.
    pub worker: Vec<u8>,
    /// The element of pages.
    pub element: Vec<u8>,
    /// The engine.
    pub engine: Vec<u8>,
}

/// The viewer that this program contains.
#[cfg(splatkit_viewer)]
fn contained() -> Option<Viewer> {
    Some(Viewer {
        worker: include_bytes!(concat!(env!("OUT_DIR"), "/splatkit-worker.js")).to_vec(),
        element: include_bytes!(concat!(env!("OUT_DIR"), "/splatkit-viewer.js")).to_vec(),
        engine: include_bytes!(concat!(env!("OUT_DIR"), "/splatkit.wasm")).to_vec(),
    })
}

#[cfg(not(splatkit_viewer))]
fn contained() -> Option<Viewer> {
    None
}

impl Viewer {
    /// Returns the viewer of a folder, or the one that this program contains, or the one beside it.
    pub fn find(folder: Option<&Path>) -> Result<Self, Failure> {
        if let Some(folder) = folder {
            return Self::read(folder);
        }
        if let Some(viewer) = contained() {
            return Ok(viewer);
        }
        match Self::places().into_iter().find(|folder| folder.join(ENGINE).is_file()) {
            Some(folder) => Self::read(&folder),
            None => Err(Failure::Usage(
                "this program was built without the viewer for pages: run tools/web/build in \
                 splatkit's sources, and give its folder, target/web/viewer, as --viewer"
                    .into(),
            )),
        }
    }

    /// Returns the folders in which a viewer may be: beside the program, and where
    /// `tools/web/build` puts it when the program lies in `target/release`.
    fn places() -> Vec<PathBuf> {
        let program = std::env::current_exe().unwrap_or_default();
        let home = program.parent().unwrap_or(Path::new(""));
        vec![home.join("viewer"), home.join("../web/viewer")]
    }

    fn read(folder: &Path) -> Result<Self, Failure> {
        let read = |name: &str| {
            let path = folder.join(name);
            std::fs::read(&path).map_err(|source| {
                Error::input(&path, "viewer", format!("cannot be read: {source}"))
                    .hint("run tools/web/build, which makes target/web/viewer")
            })
        };
        Ok(Self { worker: read(WORKER)?, element: read(ELEMENT)?, engine: read(ENGINE)? })
    }

    /// Returns the version, as pages name it.
    pub fn version(&self) -> &'static str {
        env!("CARGO_PKG_VERSION")
    }

    /// Returns the names and the bytes of the files.
    pub fn files(&self) -> [(&'static str, &[u8]); 3] {
        [(WORKER, &self.worker), (ELEMENT, &self.element), (ENGINE, &self.engine)]
    }
}
