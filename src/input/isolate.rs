//! A wall around decoders that are not ours.

use super::Source;
use crate::Result;
use std::{
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Once,
};

thread_local! {
    /// How many walls this thread is behind.
    static BEHIND: Cell<u32> = const { Cell::new(0) };
}

/// Runs a decoder that may panic on bytes that it did not expect, and makes an input error of that. What it worked on is
/// dropped, so nothing half changed is seen afterwards. The panic is not printed; those of other threads are, so a decoder
/// is to be isolated on the thread that it runs on.
pub(crate) fn isolated<T>(
    source: &Source,
    place: &str,
    decode: impl FnOnce() -> Result<T>,
) -> Result<T> {
    hush();
    BEHIND.set(BEHIND.get() + 1);
    let decoded = catch_unwind(AssertUnwindSafe(decode));
    BEHIND.set(BEHIND.get() - 1);
    decoded.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text =
            text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("the decoder gave up");
        Err(source.error(place, format!("holds what cannot be decoded: {text}")))
    })
}

/// Puts a hook before the one that there is, once: it keeps quiet about panics that are told as errors.
fn hush() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            // A thread that ends has no such count any more.
            if BEHIND.try_with(Cell::get).unwrap_or(0) == 0 {
                before(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::*;

    #[test]
    fn a_panic_is_an_error_with_its_place() {
        let folder = Folder::new();
        let path = folder.write("a", "bytes");
        let decode = |source: &Source| {
            isolated(source, "chunk 3", || -> Result<()> { panic!("index {} of 2", 5) })
        };
        let message = read_with(&path, decode).unwrap_err().to_string();
        assert!(
            message.contains("chunk 3: holds what cannot be decoded: index 5 of 2"),
            "{message}"
        );
    }

    #[test]
    fn only_the_isolated_thread_is_quiet() {
        let folder = Folder::new();
        let path = folder.write("a", "bytes");
        let decode = |source: &Source| {
            isolated(source, "outer", || {
                let inner = isolated(source, "inner", || -> Result<()> { panic!("first") });
                assert!(inner.is_err() && BEHIND.get() == 1);
                let other = std::thread::spawn(|| BEHIND.get());
                assert_eq!(other.join().unwrap(), 0);
                Ok(())
            })
        };
        read_with(&path, decode).unwrap();
        assert_eq!(BEHIND.get(), 0);
    }
}
