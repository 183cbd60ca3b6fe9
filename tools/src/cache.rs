//! The flags of the cache of remote inputs.

use crate::parse;
use clap::Args;
use splatkit::input::remote::{Cache, allow_redirects, set_cache};
use std::path::PathBuf;

/// Where the parts of remote inputs are kept, and which servers are asked.
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
    /// Follow redirects to this server too, data.example.org or data.example.org:8443; may be given
    /// several times. Without it, redirects are followed within the server of an address
    #[arg(long, global = true, value_name = "HOST", hide_short_help = true)]
    allow_host: Vec<String>,
}

/// `8GiB`, or 0.
fn size(text: &str) -> Result<u64, String> {
    if text.trim() == "0" { Ok(0) } else { parse::bytes(text) }
}

impl CacheFlags {
    /// Sets the cache of this process, and the servers that redirects may lead to.
    pub fn apply(&self) {
        allow_redirects(self.allow_host.iter().cloned());
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
