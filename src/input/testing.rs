//! Helpers that the tests of the readers share: temporary folders, and truncation at every byte.

use super::{Limits, Source};
use crate::{Error, Result};
use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicU32, Ordering},
};

/// A folder for one test, removed at its end.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path =
            std::env::temp_dir().join(format!("splatkit-test-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Writes a file and returns its path.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        // Some file systems wait for the disk when a file is truncated and rewritten, but not for a
        // new one.
        std::fs::remove_file(&path).ok();
        std::fs::write(&path, bytes).unwrap();
        path
    }

    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

/// Opens a file with the default limits and reads it.
pub fn read_with<T>(path: &Path, read: impl Fn(&Source) -> Result<T>) -> Result<T> {
    let limits = Limits::default();
    read(&Source::open(path, &limits)?)
}

/// Reads the file truncated at every length. Each truncation must be an input error that names file
/// and place.
pub fn every_cut<T>(
    folder: &Folder,
    name: &str,
    bytes: &[u8],
    read: impl Fn(&Source) -> Result<T>,
) {
    for end in 0..bytes.len() {
        let path = folder.write(name, &bytes[..end]);
        match read_with(&path, &read) {
            Err(Error::Input { file, place, message, .. }) => {
                assert_eq!(file, path, "cut at {end}");
                assert!(!place.is_empty() && !message.is_empty(), "cut at {end}");
            }
            Err(other) => panic!("cut at {end}: {other}"),
            Ok(_) => panic!("cut at {end}: was read"),
        }
    }
    let path = folder.write(name, bytes);
    read_with(&path, &read).unwrap_or_else(|e| panic!("the whole file: {e}"));
}

/// Encodes these texels as a PNG.
pub fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_raw(width, height, texels.concat())
        .expect("one texel per pixel of the size");
    picture.write_to(&mut out, image::ImageFormat::Png).expect("encodes");
    out.into_inner()
}
