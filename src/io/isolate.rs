//! A wall around decoders that are not ours.

use super::Source;
use crate::Result;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs a decoder that may panic on bytes that it did not expect, and makes an input error of that. What it worked on is
/// dropped, so nothing half changed is seen afterwards.
pub(super) fn isolated<T>(source: &Source, place: &str, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("the decoder gave up");
        Err(source.error(place, format!("holds what cannot be decoded: {text}")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::*;

    #[test]
    fn a_panic_is_an_error_with_its_place() {
        let folder = Folder::new();
        let path = folder.write("a", "bytes");
        let decode = |source: &Source| isolated(source, "chunk 3", || -> Result<()> { panic!("index {} of 2", 5) });
        let message = read_with(&path, decode).unwrap_err().to_string();
        assert!(message.contains("chunk 3: holds what cannot be decoded: index 5 of 2"), "{message}");
    }
}
