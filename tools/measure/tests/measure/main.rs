//! Runs `splatkit-measure`: its tasks, their tables, and the blocks of documents that they replace.

#[path = "../../../tests/command/common/mod.rs"]
mod common;
mod figures;
mod suite;
mod sweep;

/// The command that is tested.
const COMMAND: &str = env!("CARGO_BIN_EXE_splatkit-measure");
