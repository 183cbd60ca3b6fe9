//! How much memory there is.

use std::path::{Path, PathBuf};

/// The bytes that a process should take at most: three quarters of the machine's memory, or of what its control group may have;
/// `None` where the system does not tell: it is asked on Linux alone.
pub fn most() -> Option<u64> {
    let machine = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| total(&text));
    let limits = groups().into_iter().filter_map(|path| std::fs::read_to_string(path).ok()?.trim().parse::<u64>().ok());
    limits.chain(machine).min().map(|bytes| bytes / 4 * 3)
}

/// The total of `/proc/meminfo`.
fn total(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib << 10)
}

/// The files that may tell the limit of the process's control group, or of one that it is in: of version 2, and of version 1.
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
        let own = Path::new(root).join(group.trim_start_matches('/'));
        files.extend(own.ancestors().take_while(|path| path.starts_with(root)).map(|path| path.join(name)));
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_tells_its_memory() {
        assert_eq!(total("MemTotal:       24641232 kB\nMemFree: 1 kB\n"), Some(24_641_232 << 10));
        assert_eq!(total("MemFree: 1 kB\n"), None);
    }
}
