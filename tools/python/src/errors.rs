//! Errors of the library as exceptions of Python. The classes are in `pysplatkit/_errors.py`.

use pyo3::{intern, prelude::*, types::PyTuple};
use serde::de::DeserializeOwned;
use splatkit::{Error, error::LimitKind};
use splatkit_media::Failure;
use std::io;

/// Returns the exception for an error.
pub fn raise(py: Python<'_>, error: &Error) -> PyErr {
    made(py, error).unwrap_or_else(|failure| failure)
}

/// Returns the exception for an argument that is wrong.
pub fn wrong(message: impl Into<String>) -> Error {
    Error::Argument(message.into())
}

/// Returns the library's error for a failure of a film or a text.
pub fn of_media(failure: Failure) -> Error {
    match failure {
        Failure::Library(error) => error,
        Failure::Usage(message) => wrong(message),
        Failure::Output { file, message, hint } => {
            let message = message.strip_prefix("cannot be written: ").unwrap_or(&message);
            let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
            Error::output(&file, io::Error::other(format!("{message}{hint}")))
        }
    }
}

/// Reads options that Python has written as JSON. An error names the option.
pub fn options<T: DeserializeOwned>(text: &str) -> Result<T, Error> {
    let mut reader = serde_json::Deserializer::from_str(text);
    serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let path = error.path().to_string();
        let place = if path == "." { String::new() } else { format!("{path}: ") };
        // The place in the JSON says nothing to people who never saw it.
        let message = error.into_inner().to_string();
        wrong(place + message.split(" at line ").next().unwrap_or_default())
    })
}

fn made(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let text = error.to_string();
    match error {
        Error::Input { file, place, message, hint } => {
            new(py, "InputError", (file, place, message, hint.as_deref()))
        }
        Error::Limit { file, what, kind, found: amount, limit } => {
            new(py, "LimitError", (file, what, name(*kind), *amount, *limit))
        }
        Error::File { file, action, source } => {
            let class = match source.kind() {
                io::ErrorKind::NotFound => "MissingFileError",
                io::ErrorKind::PermissionDenied => "DeniedFileError",
                _ => "FileError",
            };
            new(py, class, (file, format!("cannot {action}"), source.raw_os_error(), plain(source)))
        }
        Error::Output { file, source } => {
            let arguments = (file, "cannot be written", source.raw_os_error(), plain(source));
            new(py, "OutputError", arguments)
        }
        Error::Argument(_) => new(py, "ArgumentError", (text,)),
        Error::Transfer(_) => new(py, "TransferError", (text,)),
        Error::Timeout { what, limit } => new(py, "TimeLimitError", (what, *limit, text)),
        Error::Memory { what, bytes } => new(py, "OutOfMemoryError", (what, *bytes, text)),
        Error::NothingToDraw(_) => new(py, "NothingToDrawError", (text,)),
        _ => new(py, "Error", (text,)),
    }
}

/// Returns the system's message without its number.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().to_owned()
}

/// What an exception is made from.
trait Arguments<'py>:
    IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error = PyErr>
{
}

impl<'py, T> Arguments<'py> for T where
    T: IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error = PyErr>
{
}

fn new<'py>(py: Python<'py>, class: &str, arguments: impl Arguments<'py>) -> PyResult<PyErr> {
    let module = py.import(intern!(py, "pysplatkit._errors"))?;
    let class = PyTuple::new(py, [class])?;
    let arguments = class.add(arguments.into_pyobject(py)?)?.cast_into::<PyTuple>()?;
    // Its texts name options as Python does.
    Ok(PyErr::from_value(module.getattr(intern!(py, "made"))?.call1(arguments)?))
}

/// Returns the name of a limit, as `limits` takes it.
fn name(kind: LimitKind) -> &'static str {
    match kind {
        LimitKind::Points => "points",
        LimitKind::Bytes => "bytes",
        LimitKind::Depth => "depth",
        LimitKind::Texels => "texels",
        LimitKind::Seconds => "seconds",
    }
}
