//! Shared code of the fuzz targets. Each target runs one entry point of the oracle, which the
//! regression tests of the library use too.

#[path = "../../tests/regressions/oracle.rs"]
pub mod oracle;
#[path = "../../tests/testing/mod.rs"]
mod testing;

pub use libfuzzer_sys;

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Mutex, PoisonError},
};

/// Defines a fuzz target from the name of an entry point of the oracle.
#[macro_export]
macro_rules! target {
    ($name:ident) => {
        use $crate::libfuzzer_sys;

        libfuzzer_sys::fuzz_target!(init: $crate::prepare(), |bytes: &[u8]| {
            $crate::run($crate::oracle::$name, bytes);
        });
    };
}

/// Message and location of the last panic.
static LAST: Mutex<String> = Mutex::new(String::new());

/// Lets panics reach `catch_unwind`, and runs all work on this thread.
///
/// libFuzzer's own hook ends the process at every panic, including the panics of decoders that the
/// library catches on purpose.
pub fn prepare() {
    std::panic::set_hook(Box::new(|panic| {
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = panic.to_string();
    }));
    // With one thread runs are repeatable, and small inputs fast.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().ok();
}

/// Runs a target. A panic that the target does not catch aborts the process, so that libFuzzer
/// keeps the input.
pub fn run(target: oracle::Target, bytes: &[u8]) {
    if catch_unwind(AssertUnwindSafe(|| target(bytes))).is_err() {
        eprintln!("{}", LAST.lock().unwrap_or_else(PoisonError::into_inner));
        std::process::abort();
    }
}
