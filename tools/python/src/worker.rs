//! Work on a thread of its own, while the calling thread waits without the interpreter's lock and
//! answers signals.

use crate::{errors::raise, notes};
use pyo3::prelude::*;
use splatkit::{Error, Stop};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    process,
    sync::{
        atomic::{AtomicU32, Ordering::Relaxed},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

/// How often signals are looked at.
const POLL: Duration = Duration::from_millis(50);

/// How long interrupted work may go on before it is left alone. It then ends on its own, and
/// nobody sees its result.
const PATIENCE: Duration = Duration::from_millis(500);

/// The process that has started threads; 0 before.
static PROCESS: AtomicU32 = AtomicU32::new(0);

/// Runs `work` without the interpreter's lock. A signal whose handler raises an exception, such as
/// Ctrl-C, ends the wait: `stop` is requested, and the exception is returned.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce() -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    check_process(py)?;
    let (sender, mut receiver) = mpsc::sync_channel(1);
    let thread = thread::Builder::new().name("splatkit".into());
    // A panic must not end the process. Its message is on stderr.
    let guarded = move || catch_unwind(AssertUnwindSafe(work));
    let spawned = thread.spawn(move || drop(sender.send(guarded())));
    spawned.map_err(|error| {
        let what = format!("the system cannot start a thread: {error}");
        raise(py, &Error::Memory { what, bytes: 0 })
    })?;
    let mut interrupted: Option<(PyErr, Instant)> = None;
    loop {
        let (back, outcome) = py.detach(move || {
            let outcome = receiver.recv_timeout(POLL);
            (receiver, outcome)
        });
        receiver = back;
        let outcome = match outcome {
            Ok(outcome) => Some(outcome),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return Err(bug(py)),
        };
        match (outcome, interrupted.take()) {
            (Some(_), Some((error, _))) => return Err(error),
            (Some(outcome), None) => {
                notes::warn(py)?;
                return outcome.map_err(|_| bug(py))?.map_err(|error| raise(py, &error));
            }
            (None, Some((error, since))) if since.elapsed() > PATIENCE => return Err(error),
            (None, Some(pending)) => interrupted = Some(pending),
            (None, None) => {
                if let Err(error) = py.check_signals() {
                    stop.request();
                    interrupted = Some((error, Instant::now()));
                }
            }
        }
    }
}

/// Runs short work, or that of a thread which no signal reaches, without the interpreter's lock and
/// without a thread of its own.
pub fn run_here<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    check_process(py)?;
    let outcome = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    notes::warn(py)?;
    outcome.map_err(|_| bug(py))?.map_err(|error| raise(py, &error))
}

/// Refuses to work in a copy of a process that has threads: they are missing in the copy, and work
/// would wait for them for ever.
fn check_process(py: Python<'_>) -> PyResult<()> {
    let current = process::id();
    match PROCESS.compare_exchange(0, current, Relaxed, Relaxed) {
        Err(other) if other != current => Err(raise(
            py,
            &Error::Argument(
                "this process is a fork of one that has used splatkit, and lacks its threads; \
                 start processes with multiprocessing's method “spawn” or “forkserver”"
                    .into(),
            ),
        )),
        _ => Ok(()),
    }
}

fn bug(py: Python<'_>) -> PyErr {
    let class = py.import("pysplatkit._errors").and_then(|module| module.getattr("Error"));
    let message = "an internal error of splatkit; please report the message on stderr";
    match class.and_then(|class| class.call1((message,))) {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}
