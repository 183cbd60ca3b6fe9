//! `splatkit view` in a build without the feature `window`: an error that says how to get one.

use crate::{failure::Failure, given::Given, progress::Progress};
use clap::Args;
use std::ffi::OsString;

/// Takes whatever a window would take.
#[derive(Args, Debug)]
pub struct View {
    #[arg(hide = true, num_args = 0.., trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

impl View {
    pub fn run(self, _: &Given, _: &Progress) -> Result<(), Failure> {
        tracing::debug!(arguments = ?self.arguments, "no window");
        Err(Failure::Usage(
            "this program was built without “window”; with it: cargo build --release -p \
             splatkit-tools"
                .into(),
        ))
    }
}
