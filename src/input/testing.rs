//! Helpers that the tests of the readers share: temporary folders, and truncation at every byte.

use super::{Limits, Source};
use crate::{Error, Result};
use std::path::Path;

#[path = "../../tests/testing/folder.rs"]
mod folder;

pub use folder::Folder;

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
