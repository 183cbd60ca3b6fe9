//! What the command is doing, on a terminal's stderr; nothing anywhere else.

use indicatif::{ProgressBar, ProgressStyle};
use std::{io::IsTerminal, time::Duration};

/// One line that names the stage at work.
pub struct Progress(ProgressBar);

impl Progress {
    pub fn new(wanted: bool) -> Self {
        if !wanted || !std::io::stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let bar = ProgressBar::new_spinner();
        bar.enable_steady_tick(Duration::from_millis(100));
        let progress = Self(bar);
        progress.spin();
        progress
    }

    fn spin(&self) {
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            self.0.set_style(style);
        }
    }

    /// Names what begins now.
    pub fn stage(&self, name: impl Into<String>) {
        self.0.reset_elapsed();
        self.0.set_message(name.into());
    }

    /// Names what begins now, of which there is so much.
    pub fn bar(&self, name: impl Into<String>, total: u64) -> Bar<'_> {
        self.stage(name);
        self.0.set_length(total);
        self.0.set_position(0);
        let form = "{spinner} {msg} {wide_bar} {human_pos}/{human_len} ({per_sec}, {eta} left)";
        if let Ok(style) = ProgressStyle::with_template(form) {
            self.0.set_style(style);
        }
        Bar(self)
    }

    /// Takes the line away.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}

/// A stage whose end is known: a bar with its rate and the time that is left.
pub struct Bar<'a>(&'a Progress);

impl Bar<'_> {
    /// Tells how much is done.
    pub fn set(&self, done: u64) {
        self.0.0.set_position(done);
    }
}

impl Drop for Bar<'_> {
    fn drop(&mut self) {
        self.0.spin();
    }
}
