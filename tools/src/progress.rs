//! The stage that the command is at, shown on stderr if it is a terminal.

use crate::{terminal::safe, threads};
use indicatif::{ProgressBar, ProgressStyle};
use std::{io::IsTerminal, sync::Mutex, time::Duration};

/// One line that names the current stage.
pub struct Progress(ProgressBar);

impl Progress {
    pub fn new(wanted: bool) -> Self {
        if !wanted || !std::io::stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let bar = ProgressBar::new_spinner();
        // The spinner turns on its own thread, and starting that panics if the system gives no
        // thread.
        if threads::is_available() {
            bar.enable_steady_tick(Duration::from_millis(100));
        }
        let progress = Self(bar);
        progress.spin();
        progress
    }

    fn spin(&self) {
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            self.0.set_style(style);
        }
    }

    /// Names the stage that begins now.
    pub fn stage(&self, name: impl Into<String>) {
        self.0.reset_elapsed();
        self.0.set_message(safe(&name.into()).into_owned());
    }

    /// Names the stage that begins now, and its total amount of work.
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

    /// Returns a handle for stages that name themselves as they begin.
    pub fn stages(&self) -> Stages<'_> {
        Stages { progress: self, now: Mutex::new(None) }
    }

    /// Removes the line.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}

/// A stage with a known end: a bar with its rate and the remaining time.
pub struct Bar<'a>(&'a Progress);

impl Bar<'_> {
    /// Sets how much is done.
    pub fn set(&self, done: u64) {
        self.0.0.set_position(done);
    }
}

impl Drop for Bar<'_> {
    fn drop(&mut self) {
        self.0.spin();
    }
}

/// Stages one after the other, each with a bar if its end is known.
pub struct Stages<'a> {
    progress: &'a Progress,
    /// The current stage, its end, and its bar.
    now: Mutex<Option<(&'static str, u64, Option<Bar<'a>>)>>,
}

impl Stages<'_> {
    /// Sets how much of a stage is done, and its total; 0 if the total is not known. Another name
    /// or another total begins another stage.
    pub fn set(&self, name: &'static str, done: u64, total: u64) {
        let Ok(mut now) = self.now.lock() else { return };
        if now.as_ref().is_none_or(|(at, end, _)| (*at, *end) != (name, total)) {
            // The last bar is dropped before the next one begins.
            *now = None;
            let bar = if total > 0 { Some(self.progress.bar(name, total)) } else { None };
            if bar.is_none() {
                self.progress.stage(name);
            }
            *now = Some((name, total, bar));
        }
        if let Some((_, _, Some(bar))) = &*now {
            bar.set(done);
        }
    }
}
