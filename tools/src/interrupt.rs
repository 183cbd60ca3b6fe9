//! Ctrl-C, and the signals that end a process or ask it to end.

use crate::threads;
use splatkit::disk;
use std::io::Write;

/// The exit code that shells report for a command ended by Ctrl-C.
const INTERRUPTED: i32 = 130;

/// Installs the handlers: from now on, these signals leave no incomplete file. The handler runs on
/// a thread of its own. It removes unfinished files and ends the process, whatever the other
/// threads do.
pub fn answer() {
    // Without a thread to run on, a handler would only keep the signal from ending the process.
    if !threads::is_available() {
        tracing::warn!(
            "the system cannot start a thread that handles Ctrl-C: it may leave incomplete files"
        );
        return survive_large_files();
    }
    let set = ctrlc::set_handler(|| {
        let _abandoned = disk::abandon();
        // The reader of stderr may be gone already.
        writeln!(std::io::stderr(), "interrupted: unfinished files were removed").ok();
        // At once: the ordinary exit unloads libraries while another thread may be loading or using
        // them, such as a driver's compiler, which then may run for ever.
        signal_hook::low_level::exit(INTERRUPTED)
    });
    if let Err(error) = set {
        tracing::warn!("Ctrl-C may leave incomplete files: {error}");
    }
    survive_large_files();
}

/// Makes a file that grows over the user's size limit an error of the write, as on a full disk,
/// instead of the end of the process.
#[cfg(unix)]
fn survive_large_files() {
    use signal_hook::{consts::signal::SIGXFSZ, flag};
    use std::sync::{Arc, atomic::AtomicBool};
    // Nobody reads the flag: that a handler exists is enough.
    if let Err(error) = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))) {
        tracing::warn!("a limit on the size of files may leave an incomplete file: {error}");
    }
}

#[cfg(not(unix))]
fn survive_large_files() {}
