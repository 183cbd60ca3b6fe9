//! Isolation of third-party decoders: their panics become errors.

use super::Source;
use crate::Result;
use std::{
    any::Any,
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, Once, PoisonError,
        mpsc::{self, RecvTimeoutError},
    },
    thread,
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
    caught(decode).unwrap_or_else(|panic| Err(source.error(place, text_of(&*panic))))
}

/// Runs what may panic. The panic is not printed.
fn caught<T>(work: impl FnOnce() -> T) -> thread::Result<T> {
    hush();
    BEHIND.set(BEHIND.get() + 1);
    let done = catch_unwind(AssertUnwindSafe(work));
    BEHIND.set(BEHIND.get() - 1);
    done
}

/// Runs a call of a driver that may panic, as drivers without memory do, and returns the text of
/// the panic.
#[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
pub(crate) fn unless_panics<T>(call: impl FnOnce() -> T) -> std::result::Result<T, String> {
    caught(call).map_err(|panic| said(&*panic).unwrap_or("no reason").to_owned())
}

/// Pixels that any decoder of pictures unpacks at once, in a fraction of a second.
pub(crate) const FEW_PIXELS: u64 = 1 << 22;

/// Runs a decoder that cannot be stopped. One that may take `long` runs on a thread of its own. If
/// the time for reading is over before it returns, it is left behind: it ends once it has unpacked
/// what it holds, which the limits on sizes bound. So it must own its bytes. Its error is a
/// message.
pub(crate) fn isolated_in_time<T: Send + 'static>(
    source: &Source,
    place: &str,
    long: bool,
    decode: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T> {
    source.check_time()?;
    let located = |decoded: Result<T, String>| decoded.map_err(|text| source.error(place, text));
    if !long {
        return isolated(source, place, || located(decode()));
    }
    hush();
    let (sender, receiver) = mpsc::channel();
    // If no thread starts, the decoder is still here.
    let decode = Arc::new(Mutex::new(Some(decode)));
    let take = |decode: &Mutex<Option<_>>| {
        decode.lock().unwrap_or_else(PoisonError::into_inner).take().expect("it is taken once")
    };
    let shared = decode.clone();
    let started = thread::Builder::new().name("decoder".into()).spawn(move || {
        let decode = take(&shared);
        BEHIND.set(1);
        let decoded = catch_unwind(AssertUnwindSafe(decode));
        // Nobody receives it if the time was over.
        sender.send(decoded.unwrap_or_else(|panic| Err(text_of(&*panic)))).ok();
    });
    if started.is_err() {
        return isolated(source, place, || located(take(&decode)()));
    }
    loop {
        match receiver.recv_timeout(source.time_left()) {
            Ok(decoded) => return located(decoded),
            Err(RecvTimeoutError::Timeout) => source.check_time()?,
            Err(RecvTimeoutError::Disconnected) => return located(Err(text_of(&()))),
        }
    }
}

/// Returns the message for a panic.
fn text_of(panic: &(dyn Any + Send)) -> String {
    format!("cannot be decoded: {}", said(panic).unwrap_or("the decoder gave up"))
}

/// Returns the text of a panic.
fn said(panic: &(dyn Any + Send)) -> Option<&str> {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied())
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
    use crate::{
        Error,
        error::LimitKind,
        input::{Limits, testing::*},
    };

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
    fn a_decoder_that_does_not_end_is_left_behind() {
        let folder = Folder::new();
        let path = folder.write("a", "bytes");
        let limits = Limits { seconds: 1, ..Limits::default() };
        let source = Source::open(&path, &limits).unwrap();
        let (end, wait) = mpsc::channel::<()>();
        let (gone, left) = mpsc::channel::<()>();
        let decode = move || {
            let _gone = gone;
            wait.recv().ok();
            Ok(7)
        };
        let error = isolated_in_time(&source, "frame 3", true, decode).unwrap_err();
        let is_time = matches!(error, Error::Limit { kind: LimitKind::Seconds, limit: 1, .. });
        assert!(is_time, "{error}");
        drop(end);
        assert!(left.recv().is_err(), "the decoder has ended");
        // No other is started.
        assert!(isolated_in_time(&source, "frame 4", false, || Ok(1)).is_err());
    }

    #[test]
    fn decoders_on_threads_return_what_others_do() {
        let folder = Folder::new();
        let path = folder.write("a", "bytes");
        for long in [false, true] {
            let run = |decode: fn() -> Result<u8, String>| {
                read_with(&path, |source| isolated_in_time(source, "here", long, decode))
            };
            assert_eq!(run(|| Ok(7)).unwrap(), 7);
            let error = run(|| Err("is wrong".into())).unwrap_err().to_string();
            assert!(error.contains("here: is wrong"), "{error}");
            let error = run(|| panic!("at {}", 3)).unwrap_err().to_string();
            assert!(error.contains("here: cannot be decoded: at 3"), "{error}");
        }
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
