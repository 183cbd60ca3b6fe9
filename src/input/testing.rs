//! Helpers that the tests of the readers share: temporary folders, and truncation at every byte.

use super::{Limits, Source};
use crate::{Error, Result};
use std::{cell::RefCell, fmt, path::Path, sync::Once};
use tracing::{Event, Level, Metadata, Subscriber, field, span};

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

thread_local! {
    /// The texts of the warnings that a thread asked for.
    static HEARD: RefCell<Option<Vec<String>>> = const { RefCell::new(None) };
}

/// Keeps the texts of warnings for the threads that ask for them. The whole process has one, since
/// places in the code that threads reach at once may miss one that comes and goes.
struct Warnings;

impl Subscriber for Warnings {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() == Level::WARN
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}

    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}

    fn event(&self, event: &Event<'_>) {
        HEARD.with_borrow_mut(|heard| {
            if let Some(heard) = heard {
                event.record(&mut Message(heard));
            }
        });
    }

    fn enter(&self, _: &span::Id) {}

    fn exit(&self, _: &span::Id) {}
}

/// Takes the text of an event.
struct Message<'a>(&'a mut Vec<String>);

impl field::Visit for Message<'_> {
    fn record_debug(&mut self, field: &field::Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0.push(format!("{value:?}"));
        }
    }
}

/// Returns the result of `act` and the warnings that this thread gives meanwhile.
pub fn warnings_of<T>(act: impl FnOnce() -> T) -> (T, Vec<String>) {
    static SET: Once = Once::new();
    SET.call_once(|| tracing::subscriber::set_global_default(Warnings).expect("the only one"));
    HEARD.set(Some(Vec::new()));
    let result = act();
    (result, HEARD.take().unwrap_or_default())
}
