//! How much memory there is, and checks before large allocations.

use crate::{Error, Result};
use std::path::{Path, PathBuf};
#[cfg(feature = "files")]
use sysinfo::{MemoryRefreshKind, RefreshKind, System};

/// Returns the most bytes that a process should use: three quarters of the machine's memory or of
/// its control group's limit, whichever is smaller. `None` if the system reports neither.
pub fn most() -> Option<u64> {
    let limits = groups()
        .into_iter()
        .filter_map(|path| std::fs::read_to_string(path).ok()?.trim().parse::<u64>().ok());
    limits.chain(machine()).min().map(|bytes| bytes / 4 * 3)
}

/// Returns the machine's memory; `None` if the system does not report it.
#[cfg(feature = "files")]
fn machine() -> Option<u64> {
    let asked = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    let system = System::new_with_specifics(asked).ok()?;
    Some(system.total_memory()).filter(|bytes| *bytes > 0)
}

/// Asking the system is part of the feature `files`.
#[cfg(not(feature = "files"))]
fn machine() -> Option<u64> {
    None
}

/// Returns an error message if `what` needs more bytes than a process should use. Call it before
/// allocating, because a failed allocation ends the process.
pub(crate) fn check(what: &str, bytes: u64) -> std::result::Result<(), String> {
    // No single allocation can be larger than this.
    let most = most().unwrap_or(u64::MAX).min(isize::MAX as u64);
    if bytes > most {
        return Err(format!(
            "{what} takes {bytes} bytes of memory, more than the {most} that a process may use"
        ));
    }
    Ok(())
}

/// Requests memory that `what` is about to use from the system, and frees it at once.
///
/// A failed allocation ends the process. A step that first requests all its memory here returns an
/// error instead.
///
/// # Errors
/// [`Error::Memory`].
pub(crate) fn room(what: &str, bytes: u64) -> Result<()> {
    let ask = |bytes: usize| {
        let mut probe: Vec<u8> = Vec::new();
        let is_there = probe.try_reserve_exact(bytes).is_ok();
        // Keeps the compiler from removing the unused allocation.
        std::hint::black_box(&mut probe);
        is_there.then_some(probe)
    };
    let probe = usize::try_from(bytes).ok().and_then(ask);
    let reserve: Option<Vec<Vec<u8>>> = (0..RESERVE.0).map(|_| ask(RESERVE.1)).collect();
    if probe.is_some() && reserve.is_some() {
        Ok(())
    } else {
        Err(Error::Memory { what: what.into(), bytes })
    }
}

/// Number and size, in bytes, of the blocks that must remain free for the small lists of all
/// threads. They are few, because scenes of thousands of inputs ask several times for each.
const RESERVE: (usize, usize) = (4, 1 << 20);

/// Reserves capacity for `more` items in a list.
///
/// # Errors
/// [`Error::Memory`].
pub(crate) fn reserve<T>(list: &mut Vec<T>, more: usize, what: &str) -> Result<()> {
    let bytes = (more as u64).saturating_mul(size_of::<T>() as u64);
    list.try_reserve(more).map_err(|_| Error::Memory { what: what.into(), bytes })
}

/// The files that may contain the memory limit of the process's control group and of the groups
/// around it, for control groups version 2 and version 1. Empty except on Linux.
fn groups() -> Vec<PathBuf> {
    let text = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let mut files = Vec::new();
    for line in text.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(group)) = (parts.next(), parts.next()) else { continue };
        let (root, name) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            names if names.split(',').any(|name| name == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
            }
            _ => continue,
        };
        let directory = Path::new(root).join(group.trim_start_matches('/'));
        files.extend(
            directory
                .ancestors()
                .take_while(|path| path.starts_with(root))
                .map(|path| path.join(name)),
        );
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_tells_its_memory() {
        // No machine that builds this has less memory than the lower bound, or more than the upper
        // one.
        let bytes = most().expect("an amount");
        assert!((1 << 28..1 << 50).contains(&bytes), "{bytes}");
        assert!(check("that", 1 << 20).is_ok());
        let message = check("this", u64::MAX).unwrap_err();
        assert!(
            message.starts_with("this takes 18446744073709551615 bytes of memory, more than"),
            "{message}"
        );
        let groups = groups();
        assert!(groups.iter().all(|path| path.starts_with("/sys/fs/cgroup")), "{groups:?}");
    }
}
