//! The stamp of a file that shows whether it has changed: its length and modification time.

use std::{
    fs::File,
    io,
    time::{Duration, SystemTime},
};

/// The length of a file in bytes, and its modification time if the file system reports one.
pub struct Stamp {
    pub length: u64,
    written: Option<SystemTime>,
}

impl Stamp {
    pub fn of(file: &File) -> io::Result<Self> {
        let metadata = file.metadata()?;
        Ok(Self { length: metadata.len(), written: metadata.modified().ok() })
    }

    /// Describes in words what has changed, or returns `None`.
    pub fn change(&self, now: &Self) -> Option<String> {
        if now.length != self.length {
            return Some(format!("it has {} bytes now and had {} before", now.length, self.length));
        }
        let [before, after] = [self.written?, now.written?];
        (!is_same(before, after)).then(|| "it was written to".into())
    }
}

/// Returns whether two times may be the same. File systems store times in seconds or fractions of a
/// second. Some report the exact time until they read it back from disk. Then one of the two is the
/// other, rounded.
fn is_same(a: SystemTime, b: SystemTime) -> bool {
    const STEPS: [u128; 5] = [1_000_000_000, 1_000_000, 1_000, 100, 1];
    let [a, b] = [a, b].map(|time| {
        time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or(Duration::ZERO).as_nanos()
    });
    let step = STEPS.into_iter().find(|step| a % step == 0 || b % step == 0).unwrap_or(1);
    a.abs_diff(b) < step
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_no_change() {
        let at = |nanoseconds| SystemTime::UNIX_EPOCH + Duration::from_nanos(nanoseconds);
        let exact = 1_700_000_000_123_456_789;
        for step in [1_000_000_000, 1_000_000, 1_000, 100] {
            let rounded = exact / step * step;
            assert!(
                is_same(at(exact), at(rounded)) && is_same(at(rounded + step), at(exact)),
                "{step}"
            );
            assert!(!is_same(at(exact), at(rounded - step)), "{step}");
        }
        assert!(is_same(at(exact), at(exact)) && !is_same(at(exact), at(exact + 1)));
    }
}
