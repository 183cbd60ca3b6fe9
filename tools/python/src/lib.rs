//! The compiled half of the Python package `pysplatkit`. The other half, in `python/pysplatkit`,
//! has the signatures and documentation that users see; options come from there as JSON.

mod arrays;
mod camera;
mod cells;
mod convert;
mod draw;
mod errors;
mod files;
mod film;
mod hierarchy;
mod notes;
mod page;
mod parts;
mod picture;
mod scene;
mod show;
mod transform;
mod weights;
mod worker;

use errors::raise;
use pyo3::prelude::*;
use splatkit::{color::ColorMap, volume::TransferFunction};
use std::path::PathBuf;

/// Returns red, green and blue of a colour as in CSS.
#[pyfunction]
fn color(py: Python<'_>, text: &str) -> PyResult<[f32; 3]> {
    let wrong = |message| errors::wrong(format!("“{text}” is no colour: {message}"));
    splatkit::color::parse(text).map_err(|message| raise(py, &wrong(message)))
}

/// Returns a transfer function by name, as JSON.
#[pyfunction]
fn named_transfer(
    py: Python<'_>,
    name: &str,
    range: [f64; 2],
    diagonal: Option<f64>,
) -> PyResult<String> {
    let named = TransferFunction::named(name, range).map_err(|error| raise(py, &error))?;
    Ok(diagonal.map_or(named.clone(), |diagonal| named.for_size(diagonal)).to_json())
}

/// Checks a transfer function and returns it in the usual form.
#[pyfunction]
fn checked_transfer(py: Python<'_>, text: &str) -> PyResult<String> {
    let read = TransferFunction::from_json(text).map_err(|error| raise(py, &error))?;
    Ok(read.to_json())
}

/// Reads the file of a transfer function and returns its JSON.
#[pyfunction]
fn read_transfer(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    let limits = splatkit::input::Limits::default();
    let read = TransferFunction::read(path, &limits).map_err(|error| raise(py, &error))?;
    Ok(read.to_json())
}

/// Turns and enlarges a camera: degrees about the up axis, degrees upwards, and a factor.
#[pyfunction]
fn moved_camera(
    py: Python<'_>,
    text: &str,
    azimuth: f64,
    elevation: f64,
    zoom: f64,
) -> PyResult<String> {
    let mut camera = camera::camera(text).map_err(|error| raise(py, &error))?;
    camera.azimuth(azimuth);
    camera.elevation(elevation);
    camera.zoom(zoom);
    camera.view([1, 1]).map_err(|error| raise(py, &error))?;
    Ok(camera::to_json(&camera))
}

/// Returns the same view without perspective.
#[pyfunction]
fn orthographic_camera(py: Python<'_>, text: &str) -> PyResult<String> {
    let mut camera = camera::camera(text).map_err(|error| raise(py, &error))?;
    camera.make_orthographic();
    Ok(camera::to_json(&camera))
}

/// Removes the unfinished files of conversions that go on although they were interrupted. To be
/// called once, as the process ends.
#[pyfunction]
fn abandon() {
    // Dropping what it returns would let other threads create files again.
    std::mem::forget(splatkit::disk::abandon());
}

// Nothing here needs the interpreter's lock: classes are frozen, or pyo3 guards them.
#[pymodule(gil_used = false)]
fn _pysplatkit(module: &Bound<'_, PyModule>) -> PyResult<()> {
    notes::collect();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("TRANSFER_FUNCTIONS", TransferFunction::NAMES.to_vec())?;
    module.add("COLOR_MAPS", ColorMap::NAMES.to_vec())?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<picture::Picture>()?;
    module.add_class::<picture::Layers>()?;
    module.add_class::<film::Film>()?;
    module.add_class::<hierarchy::Hierarchy>()?;
    module.add_function(wrap_pyfunction!(color, module)?)?;
    module.add_function(wrap_pyfunction!(named_transfer, module)?)?;
    module.add_function(wrap_pyfunction!(checked_transfer, module)?)?;
    module.add_function(wrap_pyfunction!(read_transfer, module)?)?;
    module.add_function(wrap_pyfunction!(moved_camera, module)?)?;
    module.add_function(wrap_pyfunction!(orthographic_camera, module)?)?;
    module.add_function(wrap_pyfunction!(files::info, module)?)?;
    module.add_function(wrap_pyfunction!(files::check, module)?)?;
    module.add_function(wrap_pyfunction!(files::known_formats, module)?)?;
    module.add_function(wrap_pyfunction!(convert::convert, module)?)?;
    module.add_function(wrap_pyfunction!(convert::plan_parts, module)?)?;
    module.add_function(wrap_pyfunction!(convert::make_part, module)?)?;
    module.add_function(wrap_pyfunction!(convert::join_parts, module)?)?;
    module.add_function(wrap_pyfunction!(film::path_cameras, module)?)?;
    module.add_function(wrap_pyfunction!(scene::read_scene, module)?)?;
    module.add_function(wrap_pyfunction!(scene::write_scene, module)?)?;
    module.add_function(wrap_pyfunction!(transform::moved, module)?)?;
    module.add_function(wrap_pyfunction!(abandon, module)?)?;
    show::register(module)
}
