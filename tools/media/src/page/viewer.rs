//! Where the viewer is: in this program, if it was there when it was built, or in a folder.

use super::content::unread;
use crate::Failure;
use lzma_rust2::LzipReader;
use splatkit::Error;
use std::{
    io::Read,
    path::{Path, PathBuf},
};

/// The files of the viewer, as `tools/web/build` writes them.
const WORKER: &str = "splatkit-worker.js";
const ELEMENT: &str = "splatkit-viewer.js";
const ENGINE: &str = "splatkit.wasm.lz";
const UNPACKER: &str = "splatkit-unpack.wasm";

/// The viewer.
pub struct Viewer {
    /// The worker, which draws.
    pub worker: Vec<u8>,
    /// The element of pages.
    pub element: Vec<u8>,
    /// The engine, packed by lzip.
    pub engine: Vec<u8>,
    /// What takes the others out of a page in one file.
    pub unpacker: Vec<u8>,
}

/// The viewer that this program contains.
#[cfg(splatkit_viewer)]
fn contained() -> Option<Viewer> {
    Some(Viewer {
        worker: include_bytes!(concat!(env!("OUT_DIR"), "/splatkit-worker.js")).to_vec(),
        element: include_bytes!(concat!(env!("OUT_DIR"), "/splatkit-viewer.js")).to_vec(),
        engine: include_bytes!(concat!(env!("OUT_DIR"), "/splatkit.wasm.lz")).to_vec(),
        unpacker: include_bytes!(concat!(env!("OUT_DIR"), "/splatkit-unpack.wasm")).to_vec(),
    })
}

#[cfg(not(splatkit_viewer))]
fn contained() -> Option<Viewer> {
    None
}

impl Viewer {
    /// Returns the viewer of a folder, or the one that this program contains, or the one beside it.
    ///
    /// # Errors
    /// [`Failure::Usage`] if there is none; for files that cannot be read.
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
                 splatkit's sources, and give its folder, target/web/viewer, as --viewer, or as \
                 SPLATKIT_VIEWER in the environment"
                    .into(),
            )),
        }
    }

    /// Returns the folders in which a viewer may be: the one that `SPLATKIT_VIEWER` names, beside
    /// the program, and where `tools/web/build` puts it when the program lies in `target/release`.
    fn places() -> Vec<PathBuf> {
        let program = std::env::current_exe().unwrap_or_default();
        let home = program.parent().unwrap_or(Path::new(""));
        let named = std::env::var_os("SPLATKIT_VIEWER").map(PathBuf::from);
        let beside = [home.join("viewer"), home.join("../web/viewer")];
        named.into_iter().chain(beside).collect()
    }

    fn read(folder: &Path) -> Result<Self, Failure> {
        let read = |name: &str| {
            let path = folder.join(name);
            std::fs::read(&path).map_err(|source| {
                Error::input(&path, "viewer", format!("cannot be read: {source}"))
                    .hint("run tools/web/build, which makes target/web/viewer")
            })
        };
        let (worker, element) = (read(WORKER)?, read(ELEMENT)?);
        let viewer = Self { worker, element, engine: read(ENGINE)?, unpacker: read(UNPACKER)? };
        // A damaged engine is an error here, and not of the page.
        viewer.engine().map_err(|source| unread(&folder.join(ENGINE), &source))?;
        Ok(viewer)
    }

    /// Unpacks the engine.
    fn engine(&self) -> std::io::Result<Vec<u8>> {
        let mut engine = Vec::new();
        LzipReader::new(&self.engine[..]).read_to_end(&mut engine)?;
        Ok(engine)
    }

    /// Returns the names and the bytes of the files that a folder needs.
    ///
    /// # Errors
    /// For a damaged engine.
    pub fn files(&self) -> Result<[(&'static str, Vec<u8>); 3], Failure> {
        let engine = self.engine().map_err(|source| unread(Path::new(ENGINE), &source))?;
        Ok([
            (WORKER, self.worker.clone()),
            (ELEMENT, self.element.clone()),
            ("splatkit.wasm", engine),
        ])
    }
}
