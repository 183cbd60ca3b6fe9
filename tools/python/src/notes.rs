//! Warnings of the library, such as of elements that were left out, as warnings of Python.

use pyo3::{intern, prelude::*};
use std::{
    fmt::Write,
    sync::{Mutex, Once, PoisonError},
};
use tracing::{
    Event, Level, Metadata, Subscriber,
    field::{Field, Visit},
    span,
};

/// Most warnings that wait to be passed on.
const MOST: usize = 100;

static WAITING: Mutex<Vec<String>> = Mutex::new(Vec::new());
static SET: Once = Once::new();

/// Begins to collect warnings.
pub fn collect() {
    // If the program has another subscriber, that one hears of the warnings.
    SET.call_once(|| drop(tracing::subscriber::set_global_default(Collector)));
}

/// Adds a warning.
pub fn add(message: String) {
    let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
    if waiting.len() < MOST {
        waiting.push(message);
    }
}

/// Passes the warnings on to Python, which may make an exception of them.
pub fn warn(py: Python<'_>) -> PyResult<()> {
    let messages = {
        let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *waiting)
    };
    if messages.is_empty() {
        return Ok(());
    }
    let warn = py.import(intern!(py, "pysplatkit._errors"))?.getattr(intern!(py, "warn"))?;
    messages.into_iter().try_for_each(|message| warn.call1((message,)).map(drop))
}

struct Collector;

impl Subscriber for Collector {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_event()
            && *metadata.level() <= Level::WARN
            && metadata.target().starts_with("splatkit")
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}

    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut text = Text(String::new());
        event.record(&mut text);
        add(text.0);
    }

    fn enter(&self, _: &span::Id) {}

    fn exit(&self, _: &span::Id) {}
}

/// The message of an event.
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        if field.name() == "message" {
            // Writing to a string does not fail.
            write!(self.0, "{value:?}").ok();
        }
    }
}
