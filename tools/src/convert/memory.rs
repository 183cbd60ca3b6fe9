//! How much memory a conversion may take, and would take.

use splatkit::{
    hierarchy::external::memory_of_whole,
    io::{Limits, Stream},
};
use std::path::{Path, PathBuf};

/// What converting files as a whole takes.
#[derive(Debug)]
pub struct Need {
    /// Bytes, about; of a file whose header tells no counts by its size.
    pub bytes: u64,
    /// Whether all files can be read in pieces, or what is wrong with one.
    pub in_pieces: splatkit::Result<bool>,
}

/// Of a file that tells no counts: what is made of it for each of its bytes, and with them.
const OF_BYTE: u64 = 4;
/// The same of a hierarchy, whose splats are packed.
const OF_PACKED_BYTE: u64 = 24;

/// About what converting files takes where all of them are in memory.
pub fn need(files: &[PathBuf], limits: &Limits) -> Need {
    let mut need = Need { bytes: 0, in_pieces: Ok(true) };
    for file in files {
        let is_packed = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("splk"));
        let guess = file_bytes(file) * if is_packed { OF_PACKED_BYTE } else { OF_BYTE };
        match Stream::open(file, limits) {
            Ok(Some(stream)) => need.bytes += memory_of_whole(stream.counts()) + file_bytes(file),
            Ok(None) => {
                need.bytes += guess;
                need.in_pieces = need.in_pieces.map(|_| false);
            }
            // Where the file fits, its reader tells what is wrong with it.
            Err(error) => {
                need.bytes += guess;
                need.in_pieces = need.in_pieces.and(Err(error));
            }
        }
    }
    need
}

fn file_bytes(file: &Path) -> u64 {
    file.metadata().map_or(0, |meta| meta.len())
}

/// Three quarters of the machine's memory, or of what the control group of the process may have, where the system tells.
pub fn usual() -> Option<u64> {
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
