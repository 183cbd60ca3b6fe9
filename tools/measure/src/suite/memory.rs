//! The peak memory of the process, if the operating system reports it (Linux).

use std::fs;

/// Resets the peak. If that is not allowed, peaks include what came before.
pub fn reset_peak() {
    // 5 resets only the peak (man 5 proc).
    fs::write("/proc/self/clear_refs", "5").ok();
}

/// Returns the peak in bytes.
pub fn peak() -> Option<u64> {
    peak_of(&fs::read_to_string("/proc/self/status").ok()?)
}

fn peak_of(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read() {
        assert_eq!(peak_of("Name:\tsplatkit\nVmHWM:\t    2048 kB\nVmRSS:\t 1 kB\n"), Some(2 << 20));
        assert_eq!(peak_of("Name:\tsplatkit\n"), None);
    }
}
