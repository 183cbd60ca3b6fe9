//! What files hold, and whether they are sound.

use crate::{errors::raise, parts::reading, worker::run};
use pyo3::prelude::*;
use serde_json::{Map, Value, json};
use splatkit::{
    Error, Finding, Severity, Stop,
    formats::{self, FORMATS},
    session::ReadingEntry,
};
use std::path::{Path, PathBuf};

/// Returns the facts of a file as JSON: those of the command's `info --json`.
#[pyfunction]
pub fn info(py: Python<'_>, path: PathBuf, load: &str) -> PyResult<String> {
    let load = reading(load).map_err(|error| raise(py, &error))?;
    run(py, &Stop::default(), move || Ok(Value::Object(facts(&path, &load)?).to_string()))
}

/// Returns the findings in a file as JSON: those of the command's `check --json`.
#[pyfunction]
pub fn check(py: Python<'_>, path: PathBuf, load: &str) -> PyResult<String> {
    let load = reading(load).map_err(|error| raise(py, &error))?;
    run(py, &Stop::default(), move || {
        let findings = load.reading().open(&path)?.findings(None)?;
        let ok = findings.iter().all(|finding| finding.severity != Severity::Error);
        let findings: Vec<_> = findings.iter().map(Finding::to_json).collect();
        Ok(json!({ "ok": ok, "findings": findings }).to_string())
    })
}

/// Returns the formats that are read: name, extensions, and the extension that is written.
#[pyfunction]
pub fn known_formats() -> Vec<(&'static str, Vec<&'static str>, Option<&'static str>)> {
    let of = |format: &formats::Format| (format.name, format.extensions.to_vec(), format.written);
    FORMATS.iter().map(of).collect()
}

fn facts(path: &Path, load: &ReadingEntry) -> Result<Map<String, Value>, Error> {
    let reading = load.reading();
    let opened = reading.open(path)?;
    Ok(opened.facts(&opened.read()?)?.to_json())
}
