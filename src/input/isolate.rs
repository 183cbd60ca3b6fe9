//! Isolation of third-party decoders: their panics become errors.

use super::Source;
use crate::Result;
use std::{
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Once,
};

thread_local! {
    /// Number of nested [`isolated`] calls on this thread.
    static BEHIND: Cell<u32> = const { Cell::new(0) };
}

/// Runs a decoder that may panic on bytes that it did not expect, and turns the panic into an input
/// error. The decoder's state is dropped, so nobody sees it half changed. The panic is not printed.
/// Panics of other threads still are, so isolate a decoder on the thread that it runs on.
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
        Err(source.error(place, format!("cannot be decoded: {text}")))
    })
}

/// Installs a panic hook in front of the existing one, once. It silences panics that [`isolated`]
/// returns as errors.
fn hush() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            // A thread that is ending no longer has this thread-local.
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
        assert!(message.contains("chunk 3: cannot be decoded: index 5 of 2"), "{message}");
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
