//! The flags of the cache of remote inputs.

use crate::parse;
use clap::Args;
use splatkit::input::remote::{Cache, set_cache};
use std::path::PathBuf;

/// Where the parts of remote inputs are kept.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Remote inputs")]
pub struct CacheFlags {
    /// Keep what is fetched from addresses in this folder, for the next time [default: splatkit in
    /// the user's folder for caches]
    #[arg(long, global = true, value_name = "DIR", hide_short_help = true)]
    cache: Option<PathBuf>,
    /// Keep at most so many bytes there, such as 8GiB; 0 keeps nothing [default: 1GiB]
    #[arg(
        long,
        global = true,
        value_name = "BYTES",
        value_parser = size,
        hide_short_help = true
    )]
    cache_size: Option<u64>,
}

/// `8GiB`, or 0.
fn size(text: &str) -> Result<u64, String> {
    if text.trim() == "0" { Ok(0) } else { parse::bytes(text) }
}

impl CacheFlags {
    /// Sets the cache of this process.
    pub fn apply(&self) {
        let default = Cache::default();
        set_cache(Cache {
            folder: self.cache.clone().unwrap_or(default.folder),
            bytes: self.cache_size.unwrap_or(default.bytes),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_states_the_default() {
        assert_eq!(parse::bytes("1GiB"), Ok(Cache::default().bytes));
        assert_eq!([size("0"), size("2MiB")], [Ok(0), Ok(2 << 20)]);
        assert!(size("-1").is_err());
    }
}
