//! The steps of writing, each of which can be made to fail in tests.

use std::{
    fs::File,
    io::{self, Write},
};

/// What is about to be done.
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

/// Asks whether a step may be done.
#[cfg(not(test))]
pub(super) fn step(_: Step) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
pub(super) use faults::step;

/// By this the steps fail that a process would have done had it lived.
const AFTER: io::ErrorKind = io::ErrorKind::NotConnected;

/// Writes; where that is to fail, half of it gets there.
pub(super) fn write_step(mut file: &File, bytes: &[u8]) -> io::Result<usize> {
    if let Err(error) = step(Step::Write) {
        if error.kind() != AFTER {
            file.write_all(&bytes[..bytes.len() / 2])?;
        }
        return Err(error);
    }
    file.write(bytes)
}

/// Faults of the disk, made on purpose. They are those of the thread that asks for them.
#[cfg(test)]
pub(crate) mod faults {
    use super::Step;
    use std::{cell::RefCell, io, path::Path};

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(crate) enum Fault {
        /// One step fails, as on a full disk; those after it work.
        Full,
        /// The process is killed: neither that step nor any after it is done.
        Killed,
    }

    /// What another process does at a moment when it can do harm.
    type Race = Box<dyn FnMut(&str, &Path)>;

    #[derive(Default)]
    struct Plan {
        /// At which step, counted from 0.
        at: Option<(usize, Fault)>,
        done: Vec<Step>,
    }

    thread_local! {
        static PLAN: RefCell<Plan> = RefCell::default();
        static RACE: RefCell<Option<Race>> = const { RefCell::new(None) };
    }

    /// Lets another process act: after a file was “created”, or “locked” because it looks stale.
    pub(in crate::disk) fn race(moment: &str, path: &Path) {
        RACE.with_borrow_mut(|race| race.iter_mut().for_each(|race| race(moment, path)));
    }

    /// Runs something while another process acts at those moments.
    pub(crate) fn against<T>(
        other: impl FnMut(&str, &Path) + 'static,
        run: impl FnOnce() -> T,
    ) -> T {
        RACE.set(Some(Box::new(other)));
        let found = run();
        RACE.set(None);
        found
    }

    pub(in crate::disk) fn step(step: Step) -> io::Result<()> {
        PLAN.with_borrow_mut(|plan| {
            let number = plan.done.len();
            plan.done.push(step);
            match plan.at {
                // Cleaning up is what is looked at; it does not fail but where there is no process any more.
                Some((at, Fault::Full)) if at == number && step != Step::Remove => {
                    Err(io::Error::from(io::ErrorKind::StorageFull))
                }
                Some((at, Fault::Killed)) if at == number => Err(io::Error::other("killed")),
                Some((at, Fault::Killed)) if at < number => Err(super::AFTER.into()),
                _ => Ok(()),
            }
        })
    }

    /// Runs something with a fault; gives the steps that it came to too.
    pub(crate) fn with<T>(at: Option<(usize, Fault)>, run: impl FnOnce() -> T) -> (T, Vec<Step>) {
        PLAN.set(Plan { at, done: Vec::new() });
        let found = run();
        (found, PLAN.take().done)
    }
}
