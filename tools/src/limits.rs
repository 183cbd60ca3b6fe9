//! The flags that limit what reading an input may take.

use clap::Args;
use splatkit::{
    error::LimitKind,
    formats::Format,
    input::{self, Limits},
    session::{LimitsEntry, ReadingEntry},
};
use std::path::Path;

/// Limits for what a file claims, and for the memory and time that reading it takes.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Limits")]
pub struct LimitFlags {
    /// Limit the vertices, points or faces that a file may claim [default: 2147483648]
    #[arg(long, value_name = "COUNT")]
    limit_points: Option<u64>,
    /// Limit the bytes of an input, such as 512MiB: its files, and everything made from them until
    /// it is read. If unset, inputs that are read whole must also fit in memory [default:
    /// 34359738368]
    #[arg(long, value_name = "BYTES", value_parser = crate::parse::bytes)]
    limit_bytes: Option<u64>,
    /// Limit the nesting of nodes and elements [default: 64]
    #[arg(long, value_name = "COUNT")]
    limit_depth: Option<usize>,
    /// Limit the pixels of an image that is read [default: 268435456]
    #[arg(long, value_name = "COUNT")]
    limit_texels: Option<u64>,
    /// Limit the seconds for reading all inputs of a picture and making their splats. A conversion
    /// applies the limit to each input, and one in regions to each region; building a hierarchy may
    /// take as long again [default: 600]
    #[arg(long, value_name = "SECONDS")]
    limit_seconds: Option<u64>,
}

impl LimitFlags {
    pub fn limits(&self) -> Limits {
        ReadingEntry { limits: self.entry(), ..ReadingEntry::default() }.limits()
    }

    pub fn entry(&self) -> LimitsEntry {
        LimitsEntry {
            points: self.limit_points,
            bytes: self.limit_bytes,
            depth: self.limit_depth,
            texels: self.limit_texels,
            seconds: self.limit_seconds,
        }
    }
}

/// Returns what the user can do about an exceeded limit. No limit helps a file that claims more
/// than its bytes can hold.
pub fn hint(file: &Path, kind: LimitKind, amount: u64) -> String {
    let flag = match kind {
        LimitKind::Points | LimitKind::Bytes => {
            if let Some(bytes) = too_few_bytes(file, kind, amount) {
                return format!(
                    "the file has {bytes} bytes, which cannot hold that: it is cut or damaged; \
                     make it again"
                );
            }
            if amount == u64::MAX {
                return "no machine holds that much: the file is damaged; make it again".into();
            }
            if kind == LimitKind::Points { "points" } else { "bytes" }
        }
        LimitKind::Depth => "depth",
        LimitKind::Texels => "texels",
        LimitKind::Seconds => return "raise --limit-seconds if the file can be trusted".into(),
    };
    if kind == LimitKind::Bytes {
        return format!(
            "raise --limit-bytes to more than {amount} if the file can be trusted and memory \
             suffices; for a conversion, also raise --memory"
        );
    }
    format!("raise --limit-{flag} to {amount} or more if the file can be trusted")
}

/// Returns the file's size if that is far too small for what the file claims.
fn too_few_bytes(file: &Path, kind: LimitKind, amount: u64) -> Option<u64> {
    // The data may be in other files.
    let refers = Format::of_path(file).is_some_and(|format| format.refers);
    // A packed point takes a fraction of a byte or more. A byte unpacks to at most a thousand
    // bytes, each of which may take several hundred bytes of memory.
    let most = if kind == LimitKind::Points { 64 } else { 1 << 20 };
    let bytes = input::size(file).ok()?;
    (!refers && bytes.saturating_mul(most) < amount).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, FromArgMatches};

    /// The help contains the library's defaults, and the hints name existing flags.
    #[test]
    fn flags_are_those_of_the_library() {
        let command = LimitFlags::augment_args(clap::Command::new("test"));
        let default = Limits::default();
        for (kind, name) in [
            (LimitKind::Points, "limit-points"),
            (LimitKind::Bytes, "limit-bytes"),
            (LimitKind::Depth, "limit-depth"),
            (LimitKind::Texels, "limit-texels"),
            (LimitKind::Seconds, "limit-seconds"),
        ] {
            let flag =
                command.get_arguments().find(|flag| flag.get_long() == Some(name)).expect(name);
            let help = flag.get_help().expect("a text").to_string();
            assert!(help.ends_with(&format!("[default: {}]", default.of(kind))), "{help}");
            let text = hint(Path::new("none"), kind, 7);
            assert!(text.contains(&format!("--{name} ")), "{text}");
            let matches = command.clone().get_matches_from(["test", &format!("--{name}=7")]);
            let limits = LimitFlags::from_arg_matches(&matches).expect("flags").limits();
            assert_eq!(limits.of(kind), 7);
        }
    }
}
