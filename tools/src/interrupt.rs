//! Ctrl-C, and the signals by which a system asks a process to end or ends it.

use crate::threads;
use splatkit::disk;
use std::io::Write;

/// What shells give for a command that was ended by Ctrl-C.
const INTERRUPTED: i32 = 130;

/// From now on these leave no file that is not whole: the handler, which runs on a thread of its own, removes what is on its
/// way and ends the process, whatever that is at.
pub fn answer() {
    // Without a thread to run on, a handler would only keep the signal from ending the process.
    if !threads::is_available() {
        tracing::warn!(
            "the system gives no thread to answer Ctrl-C on: it may leave files that are not whole"
        );
        return survive_large_files();
    }
    let set = ctrlc::set_handler(|| {
        let _abandoned = disk::abandon();
        // Who reads stderr may be gone already.
        writeln!(std::io::stderr(), "interrupted: what was not finished is removed").ok();
        // At once: the ordinary way out takes libraries apart while another thread may be loading or using them, as a driver's
        // compiler, which then may run for ever.
        signal_hook::low_level::exit(INTERRUPTED)
    });
    if let Err(error) = set {
        tracing::warn!("Ctrl-C may leave files that are not whole: {error}");
    }
    survive_large_files();
}

/// A file over the size that the user may write is an error of the write, as a full disk is, and not the process's end.
#[cfg(unix)]
fn survive_large_files() {
    use signal_hook::{consts::signal::SIGXFSZ, flag};
    use std::sync::{Arc, atomic::AtomicBool};
    // Nobody asks the flag: that there is a handler is enough.
    if let Err(error) = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))) {
        tracing::warn!("a limit on the size of files may leave one that is not whole: {error}");
    }
}

#[cfg(not(unix))]
fn survive_large_files() {}
