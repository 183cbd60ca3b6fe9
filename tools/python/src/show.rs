//! What a widget needs beyond finished pictures: cameras that a hand moves, the effort of each
//! frame, pictures that can be stopped, and the transfer functions of fields.

use crate::{
    camera::{camera, to_json},
    draw::{Draw, Viewpoint},
    errors::{options, raise},
    picture::Picture,
    scene::Scene,
    worker::{run, run_here},
};
use pyo3::prelude::*;
use serde::Deserialize;
use splatkit::{
    Error,
    color::ColorMap,
    glam::{DVec2, DVec3},
    interaction::{Effort, Orbit, Probe},
    math::Camera,
    session::Coloring,
    volume::TransferFunction,
};

/// A request to stop drawing, which another thread may make.
#[pyclass(frozen, module = "pysplatkit._pysplatkit")]
#[derive(Default)]
pub struct Stop(splatkit::Stop);

#[pymethods]
impl Stop {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Asks for the end.
    fn request(&self) {
        self.0.request();
    }
}

/// Chooses the effort of each frame: the width of its pixels, and a factor on the width of splats
/// and the thickness of sheets. `(1, 1)` is the exact picture.
#[pyclass(module = "pysplatkit._pysplatkit")]
pub struct Pace(splatkit::interaction::Pace);

#[pymethods]
impl Pace {
    /// `wanted` is the time of a moving frame in milliseconds.
    #[new]
    fn new(wanted: f64) -> Self {
        Self(splatkit::interaction::Pace::new(wanted))
    }

    /// Something changed: what is shown is no longer the current view.
    fn changed(&mut self) {
        self.0.changed();
    }

    /// Returns the effort of the next frame; `None` if the exact picture is shown.
    fn next(&self) -> Option<(f64, f64)> {
        self.0.next().map(|effort| (effort.pixel, effort.coarseness))
    }

    /// Records a frame of the current view, and the time it took in milliseconds.
    fn took(&mut self, effort: (f64, f64), milliseconds: f64) {
        self.0.took(effort_of(effort), milliseconds);
    }
}

fn effort_of((pixel, coarseness): (f64, f64)) -> Effort {
    Effort { pixel, coarseness }
}

/// What a hand does. Drags and cursors are in pixels of the picture, from its upper left corner;
/// `point` is the world point under the cursor.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Gesture {
    Turn { drag: [f64; 2] },
    LookAround { drag: [f64; 2] },
    Pan { drag: [f64; 2], point: Option<[f64; 3]> },
    Zoom { factor: f64, cursor: [f64; 2], point: Option<[f64; 3]> },
    Center { point: [f64; 3] },
    Orthographic(bool),
}

/// Returns the camera that a gesture moves it to, as JSON.
#[pyfunction]
pub fn moved_by_hand(
    py: Python<'_>,
    scene: &Scene,
    camera: &str,
    size: [u32; 2],
    gesture: &str,
) -> PyResult<String> {
    moved(scene, camera, size, gesture).map_err(|error| raise(py, &error))
}

fn moved(scene: &Scene, text: &str, size: [u32; 2], gesture: &str) -> Result<String, Error> {
    let camera = camera(text)?;
    let view = camera.view(size)?;
    let depth = |point: Option<[f64; 3]>| {
        let depth = point.map(|point| view.to_view(DVec3::from_array(point)).z);
        depth.filter(|depth| *depth > 0.0)
    };
    let (up, diagonal) = scene.stage().orientation();
    let up = axis_of(&camera, up);
    let mut orbit = Orbit::new(camera, up, diagonal);
    match options(gesture)? {
        Gesture::Turn { drag } => orbit.turn(DVec2::from_array(drag), size),
        Gesture::LookAround { drag } => orbit.look_around(DVec2::from_array(drag), size),
        Gesture::Pan { drag, point } => {
            orbit.pan(DVec2::from_array(drag), size, depth(point))?;
        }
        Gesture::Zoom { factor, cursor, point } => {
            orbit.zoom(factor, DVec2::from_array(cursor), size, depth(point))?;
        }
        Gesture::Center { point } => orbit.center(DVec3::from_array(point)),
        Gesture::Orthographic(wanted) => orbit.set_orthographic(wanted),
    }
    // A camera that cannot be used is refused here, not when it draws.
    orbit.camera().view(size)?;
    Ok(to_json(orbit.camera()))
}

/// Returns the direction about which a hand turns a camera: the scene's way up if it points up in
/// the picture, and otherwise that of the camera, which somebody has chosen.
fn axis_of(camera: &Camera, scene: DVec3) -> DVec3 {
    let forward = (camera.focal_point - camera.position).normalize_or_zero();
    // Near a pole, the picture says nothing of the way up.
    let in_picture = |up: DVec3| {
        let up = up.normalize_or_zero();
        let part = up - forward * up.dot(forward);
        (part.length() > 0.02).then(|| part.normalize())
    };
    match (in_picture(camera.view_up), in_picture(scene)) {
        (Some(current), Some(usual)) if current.dot(usual) < 0.999 => camera.view_up,
        _ => scene,
    }
}

/// Returns the world point that a picture shows at a place of the view, in pixels of a picture of
/// this size. `None` where less than half of the light is absorbed.
#[pyfunction]
pub fn picked(
    py: Python<'_>,
    picture: &Picture,
    size: [u32; 2],
    cursor: [f64; 2],
) -> PyResult<Option<[f64; 3]>> {
    let view = camera(picture.camera()).and_then(|camera| camera.view(size));
    let view = view.map_err(|error| raise(py, &error))?;
    let hit = Probe::picked(picture.pixels(), &view, DVec2::from_array(cursor));
    Ok(hit.map(|point| point.to_array()))
}

/// Draws a picture with less effort than the exact one has, unless `stop` is requested. The thread
/// that calls draws.
#[pyfunction]
pub fn render_frame(
    py: Python<'_>,
    scene: &Scene,
    camera: &str,
    draw: &str,
    effort: (f64, f64),
    stop: &Stop,
) -> PyResult<Picture> {
    let draw = Draw::parse(draw).map_err(|error| raise(py, &error))?;
    let (stage, effort) = (scene.stage(), effort_of(effort));
    let viewpoint = Viewpoint::Camera(camera);
    Ok(run_here(py, || stage.draw(viewpoint, &draw, effort, &stop.0))?.into())
}

/// Returns the fields of a scene as JSON: the number and the name of the item, the range of its
/// values, the diagonal of its box in world units, and its transfer function.
#[pyfunction]
pub fn fields(scene: &Scene) -> String {
    let fields = scene.stage().fields().into_iter().map(|field| {
        let transfer: serde_json::Value =
            serde_json::from_str(&field.transfer.to_json()).unwrap_or_default();
        serde_json::json!({
            "item": field.item,
            "name": field.name,
            "range": field.range,
            "diagonal": field.diagonal,
            "transfer": transfer,
        })
    });
    serde_json::Value::from_iter(fields).to_string()
}

/// Returns how often the values of an item's field are, in 256 equal parts of their range; nothing
/// if it has no field.
#[pyfunction]
pub fn histogram(py: Python<'_>, scene: &Scene, item: usize) -> PyResult<Vec<u64>> {
    let stage = scene.stage().clone();
    run(py, &splatkit::Stop::default(), move || Ok(stage.histogram(item)))
}

/// Sets the transfer function of an item's field, for all pictures that are drawn from now on.
#[pyfunction]
pub fn set_transfer(py: Python<'_>, scene: &Scene, item: usize, transfer: &str) -> PyResult<()> {
    let set = TransferFunction::from_json(transfer)
        .and_then(|transfer| scene.stage().set_transfer(item, transfer));
    set.map_err(|error| raise(py, &error))
}

/// Returns a transfer function with the colours of a map, spread over the values that it shows.
#[pyfunction]
pub fn recolored(py: Python<'_>, transfer: &str, map: &str, values: [f64; 2]) -> PyResult<String> {
    let read = || {
        let mut transfer = TransferFunction::from_json(transfer)?;
        let coloring = Coloring { map: Some(ColorMap::named(map)?), ..Coloring::default() };
        coloring.color_transfer(&mut transfer, values)?;
        transfer.validate()?;
        Ok(transfer.to_json())
    };
    read().map_err(|error: Error| raise(py, &error))
}

/// Adds these functions and classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Stop>()?;
    module.add_class::<Pace>()?;
    module.add_function(wrap_pyfunction!(moved_by_hand, module)?)?;
    module.add_function(wrap_pyfunction!(picked, module)?)?;
    module.add_function(wrap_pyfunction!(render_frame, module)?)?;
    module.add_function(wrap_pyfunction!(fields, module)?)?;
    module.add_function(wrap_pyfunction!(histogram, module)?)?;
    module.add_function(wrap_pyfunction!(set_transfer, module)?)?;
    module.add_function(wrap_pyfunction!(recolored, module)?)?;
    Ok(())
}
