//! What the command is doing, on a terminal's stderr; nothing anywhere else.

use crate::{terminal::safe, threads};
use indicatif::{ProgressBar, ProgressStyle};
use std::{io::IsTerminal, sync::Mutex, time::Duration};

/// One line that names the stage at work.
pub struct Progress(ProgressBar);

impl Progress {
    pub fn new(wanted: bool) -> Self {
        if !wanted || !std::io::stderr().is_terminal() {
            return Self(ProgressBar::hidden());
        }
        let bar = ProgressBar::new_spinner();
        // The line turns on a thread of its own, which cannot be asked for without a panic.
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

    /// Names what begins now.
    pub fn stage(&self, name: impl Into<String>) {
        self.0.reset_elapsed();
        self.0.set_message(safe(&name.into()).into_owned());
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

    /// Stages that name themselves as they come.
    pub fn stages(&self) -> Stages<'_> {
        Stages { progress: self, now: Mutex::new(None) }
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

/// Stages one after the other, each with its bar where its end is known.
pub struct Stages<'a> {
    progress: &'a Progress,
    /// The stage at work and its end.
    now: Mutex<Option<(&'static str, u64, Option<Bar<'a>>)>>,
}

impl Stages<'_> {
    /// Tells how much of a stage is done, of how much; 0 where that is not known. What comes under another name, or with
    /// another end, is another stage.
    pub fn set(&self, name: &'static str, done: u64, total: u64) {
        let Ok(mut now) = self.now.lock() else { return };
        if now.as_ref().is_none_or(|(at, end, _)| (*at, *end) != (name, total)) {
            // The last bar goes before the next comes.
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
