//! What the fuzz targets share: each runs one entry point of the oracle that the regression tests of the library use too.

#[path = "../../tests/regressions/oracle.rs"]
pub mod oracle;

pub use libfuzzer_sys;

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Mutex, PoisonError},
};

/// A target: an entry point of the oracle by its name.
#[macro_export]
macro_rules! target {
    ($name:ident) => {
        use $crate::libfuzzer_sys;

        libfuzzer_sys::fuzz_target!(init: $crate::prepare(), |bytes: &[u8]| {
            $crate::run($crate::oracle::$name, bytes);
        });
    };
}

/// What the last panic said, and where.
static LAST: Mutex<String> = Mutex::new(String::new());

/// Makes panics reach those who catch them, and everything run on this thread.
///
/// libFuzzer's own hook ends the process at every panic, those of decoders among them that the library catches on purpose.
pub fn prepare() {
    std::panic::set_hook(Box::new(|panic| {
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = panic.to_string();
    }));
    // One thread makes runs repeatable, and small inputs fast.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().ok();
}

/// Runs a target; what it does not catch ends the process, so that libFuzzer keeps the input.
pub fn run(look: oracle::Look, bytes: &[u8]) {
    if catch_unwind(AssertUnwindSafe(|| look(bytes))).is_err() {
        eprintln!("{}", LAST.lock().unwrap_or_else(PoisonError::into_inner));
        std::process::abort();
    }
}
