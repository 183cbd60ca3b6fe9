//! The stage that the command is at, shown on stderr if it is a terminal.

use crate::{
    terminal::{safe, safe_lines},
    threads,
};
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    io::{IsTerminal, Write},
    sync::Mutex,
    time::Duration,
};

/// One line that names the current stage.
pub struct Progress {
    bar: ProgressBar,
    /// Whether notes are printed.
    talks: bool,
    /// The notes, if they are kept for a window instead.
    #[cfg(feature = "window")]
    kept: Option<Mutex<Vec<String>>>,
}

impl Progress {
    pub fn new(wanted: bool) -> Self {
        if !wanted || !std::io::stderr().is_terminal() {
            return Self::with(ProgressBar::hidden(), wanted);
        }
        let bar = ProgressBar::new_spinner();
        // The spinner turns on its own thread, and starting that panics if the system gives no
        // thread.
        if threads::is_available() {
            bar.enable_steady_tick(Duration::from_millis(100));
        }
        let progress = Self::with(bar, true);
        progress.spin();
        progress
    }

    fn with(bar: ProgressBar, talks: bool) -> Self {
        Self {
            bar,
            talks,
            #[cfg(feature = "window")]
            kept: None,
        }
    }

    /// Keeps notes and stages for a window, and prints nothing.
    #[cfg(feature = "window")]
    pub fn kept() -> Self {
        Self { kept: Some(Mutex::default()), ..Self::with(ProgressBar::hidden(), false) }
    }

    /// Takes the notes that were kept.
    #[cfg(feature = "window")]
    pub fn take_notes(&self) -> Vec<String> {
        let kept = self.kept.as_ref().and_then(|kept| kept.lock().ok());
        kept.map_or_else(Vec::new, |mut kept| std::mem::take(&mut *kept))
    }

    /// Returns the name of the current stage, and how much of it is done: 0 to 1, if that is known.
    #[cfg(feature = "window")]
    pub fn current(&self) -> (String, Option<f32>) {
        let share = self.bar.length().filter(|length| *length > 0);
        let share = share.map(|length| self.bar.position() as f32 / length as f32);
        (self.bar.message(), share)
    }

    fn spin(&self) {
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            self.bar.set_style(style);
        }
    }

    /// Prints a line to stderr, unless only errors are printed.
    pub fn note(&self, text: impl std::fmt::Display) {
        #[cfg(feature = "window")]
        if let Some(mut kept) = self.kept.as_ref().and_then(|kept| kept.lock().ok()) {
            kept.push(text.to_string());
            return;
        }
        if self.talks {
            let line = safe_lines(&text.to_string()).into_owned();
            // If stderr is closed, nobody reads notes.
            self.bar.suspend(|| writeln!(std::io::stderr(), "{line}").ok());
        }
    }

    /// Prints a warning, unless only errors are printed.
    pub fn warn(&self, text: impl std::fmt::Display) {
        self.note(format_args!("warning: {text}"));
    }

    /// Names the stage that begins now.
    pub fn stage(&self, name: impl Into<String>) {
        self.bar.reset_elapsed();
        self.bar.set_message(safe(&name.into()).into_owned());
    }

    /// Names the stage that begins now, and its total amount of work.
    pub fn bar(&self, name: impl Into<String>, total: u64) -> Bar<'_> {
        self.stage(name);
        self.bar.set_length(total);
        self.bar.set_position(0);
        let form = "{spinner} {msg} {wide_bar} {human_pos}/{human_len} ({per_sec}, {eta} left)";
        if let Ok(style) = ProgressStyle::with_template(form) {
            self.bar.set_style(style);
        }
        Bar(self)
    }

    /// Returns a handle for stages that name themselves as they begin.
    pub fn stages(&self) -> Stages<'_> {
        Stages { progress: self, now: Mutex::new(None) }
    }

    /// Removes the line.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// A stage with a known end: a bar with its rate and the remaining time.
pub struct Bar<'a>(&'a Progress);

impl Bar<'_> {
    /// Sets how much is done.
    pub fn set(&self, done: u64) {
        self.0.bar.set_position(done);
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
    /// Names the stage that begins now.
    pub fn begin(&self, name: &str) {
        if let Ok(mut now) = self.now.lock() {
            *now = None;
            self.progress.stage(name);
        }
    }

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
