//! Runs the command: what it draws, converts, prints and refuses.

mod bad_input;
mod bricks;
mod channels;
mod colors;
mod common;
mod convert;
mod convert_memory;
mod edits;
mod figures;
mod files;
#[cfg(unix)]
mod gaussian_oracle;
mod gaussians;
mod glyphs;
mod help;
#[cfg(unix)]
mod hostile;
mod idle_flags;
#[cfg(unix)]
mod interrupted;
mod licences;
mod medical;
mod pages;
mod parts;
mod pictures;
#[cfg(unix)]
mod release;
#[cfg(feature = "remote")]
mod remote;
mod scene_files;
mod transfer;
mod video;
mod views;
mod whose_fault;
mod wrong_uses;

/// The command that is tested.
const COMMAND: &str = env!("CARGO_BIN_EXE_splatkit");
