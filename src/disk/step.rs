//! The steps of writing, each of which tests can make fail.

use std::{
    fs::File,
    io::{self, Write},
};

/// A step that is about to be done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    Create,
    Write,
    Flush,
    Read,
    Sync,
    Rename,
    SyncFolder,
    Remove,
}

/// Returns an error if the step is to fail.
#[cfg(not(test))]
pub(super) fn step(_: Step) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
pub(super) use faults::step;

/// The error of the steps that a killed process would not have reached.
const AFTER: io::ErrorKind = io::ErrorKind::NotConnected;

/// Writes bytes. If the step is to fail, half of them are written first.
pub(super) fn write_step(mut file: &File, bytes: &[u8]) -> io::Result<usize> {
    if let Err(error) = step(Step::Write) {
        if error.kind() != AFTER {
            file.write_all(&bytes[..bytes.len() / 2])?;
        }
        return Err(error);
    }
    file.write(bytes)
}

/// Simulated disk faults. They affect only the thread that requests them.
#[cfg(test)]
pub(crate) mod faults {
    use super::Step;
    use std::{cell::RefCell, io, path::Path};

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(crate) enum Fault {
        /// One step fails as on a full disk; the steps after it work.
        Full,
        /// The process is killed: neither this step nor any after it is done.
        Killed,
    }

    /// An action of another process at a moment when it can do harm.
    type Race = Box<dyn FnMut(&str, &Path)>;

    #[derive(Default)]
    struct Plan {
        /// The number of the step that fails, counted from 0.
        at: Option<(usize, Fault)>,
        done: Vec<Step>,
    }

    thread_local! {
        static PLAN: RefCell<Plan> = RefCell::default();
        static RACE: RefCell<Option<Race>> = const { RefCell::new(None) };
    }

    /// Lets another process act after a file was “created”, or “locked” because it looks stale.
    pub(in crate::disk) fn race(moment: &str, path: &Path) {
        RACE.with_borrow_mut(|race| race.iter_mut().for_each(|race| race(moment, path)));
    }

    /// Calls `run` while another process acts at those moments.
    pub(crate) fn against<T>(
        other: impl FnMut(&str, &Path) + 'static,
        run: impl FnOnce() -> T,
    ) -> T {
        RACE.set(Some(Box::new(other)));
        let result = run();
        RACE.set(None);
        result
    }

    pub(in crate::disk) fn step(step: Step) -> io::Result<()> {
        PLAN.with_borrow_mut(|plan| {
            let number = plan.done.len();
            plan.done.push(step);
            match plan.at {
                // The tests check the cleaning up, so removal fails only if the process is gone.
                Some((at, Fault::Full)) if at == number && step != Step::Remove => {
                    Err(io::Error::from(io::ErrorKind::StorageFull))
                }
                Some((at, Fault::Killed)) if at == number => Err(io::Error::other("killed")),
                Some((at, Fault::Killed)) if at < number => Err(super::AFTER.into()),
                _ => Ok(()),
            }
        })
    }

    /// Calls `run` with a fault, and also returns the steps that it reached.
    pub(crate) fn with<T>(at: Option<(usize, Fault)>, run: impl FnOnce() -> T) -> (T, Vec<Step>) {
        PLAN.set(Plan { at, done: Vec::new() });
        let result = run();
        (result, PLAN.take().done)
    }
}
