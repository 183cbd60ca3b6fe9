//! What JavaScript calls. Errors are texts for people.

use crate::{Request, Stage, Step};
use glam::{DVec2, DVec3};
use splatkit::{
    Device, Error,
    gpu::{AdapterChoice, Budget, Gpu},
    input::Parts,
    session::{CameraEntry, ClipEntry, Side},
    volume::TransferFunction,
};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::future_to_promise;

/// The files of a scene, by the names that the scene file gives them.
#[wasm_bindgen]
#[derive(Default)]
pub struct Files(crate::Files);

#[wasm_bindgen]
impl Files {
    /// No files.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// See [`crate::Files::set_machine`].
    pub fn set_machine(&mut self, gibibytes: f64) {
        self.0.set_machine(gibibytes);
    }

    /// Adds a file.
    pub fn add(&mut self, name: &str, bytes: Vec<u8>) {
        self.0.add(name, bytes);
    }

    /// Adds a file of `size` bytes that comes in parts. Returns its number.
    pub fn add_parts(&mut self, name: &str, size: f64) -> usize {
        let parts = Parts::new(size as u64, self.0.most_of_parts());
        self.0.add_parts(name, parts)
    }

    /// The names of the files that are there as wholes.
    pub fn names(&self) -> Vec<String> {
        self.0.whole().map(|(name, _)| name.to_string_lossy().into_owned()).collect()
    }

    /// The bytes of such a file.
    pub fn bytes(&self, name: &str) -> js_sys::Uint8Array {
        let mut named = self.0.whole().filter(|(known, _)| known.to_string_lossy() == name);
        js_sys::Uint8Array::from(named.next().map_or(&[][..], |(_, bytes)| bytes))
    }

    /// Hands in bytes of a file in parts.
    pub fn arrive(&self, file: usize, start: f64, bytes: &[u8]) -> Result<(), JsError> {
        self.0.arrive(file, start as u64, bytes).map_err(|error| told(&error))
    }

    /// See [`Viewer::requests`].
    pub fn requests(&self) -> Vec<f64> {
        flat(self.0.requests())
    }
}

/// What draws.
#[wasm_bindgen]
pub struct Engine(Device);

#[wasm_bindgen]
impl Engine {
    /// The CPU engine.
    pub fn cpu() -> Self {
        Self(Device::Cpu)
    }

    /// The GPU engine, on a device of WebGPU.
    pub async fn webgpu() -> Result<Self, JsError> {
        let gpu = Gpu::request(&AdapterChoice::Automatic).await.map_err(|error| told(&error))?;
        Ok(Self(Device::Gpu(gpu, Budget::default())))
    }

    /// Whether WebGPU runs on the processor.
    pub fn is_software(&self) -> bool {
        matches!(&self.0, Device::Gpu(gpu, _) if gpu.is_software())
    }
}

/// A scene that is shown.
#[wasm_bindgen]
pub struct Viewer(Stage);

#[wasm_bindgen]
impl Viewer {
    /// Opens a scene, for a picture of this many pixels.
    #[wasm_bindgen(constructor)]
    pub fn new(
        scene: &str,
        files: &Files,
        engine: &Engine,
        width: u32,
        height: u32,
    ) -> Result<Viewer, JsError> {
        let stage = Stage::open(scene, files.0.clone(), [width, height], &engine.0);
        stage.map(Self).map_err(|error| told(&error))
    }

    /// What was said of the inputs while they were read.
    pub fn warnings(&self) -> Vec<String> {
        self.0.warnings().to_vec()
    }

    /// The names of the inputs and what they hold.
    pub fn summary(&self) -> String {
        self.0.summary()
    }

    /// Does the next part of the work. Returns the milliseconds to wait before the next one.
    /// −1: nothing is left to do. −2: there is a new frame. −3: parts have to come first. −4: a GPU
    /// draws. −5: helpers draw.
    pub fn step(&mut self) -> Result<f64, JsError> {
        Ok(match self.0.step().map_err(|error| told(&error))? {
            Step::Rests => -1.0,
            Step::Shows => -2.0,
            Step::Lacks => -3.0,
            Step::Draws => -4.0,
            Step::Lent => -5.0,
            Step::Works => 0.0,
            Step::Waits(milliseconds) => milliseconds,
        })
    }

    /// A promise that is kept when the GPU has done something.
    pub fn more(&self) -> js_sys::Promise {
        let more = self.0.more();
        future_to_promise(async move {
            more.await;
            Ok(JsValue::UNDEFINED)
        })
    }

    /// See [`Stage::is_gpu`].
    pub fn is_gpu(&self) -> bool {
        self.0.is_gpu()
    }

    /// See [`Stage::refusal`].
    pub fn refusal(&self) -> Option<String> {
        self.0.refusal().map(str::to_owned)
    }

    /// What to fetch of files in parts, the most important first: for each range the number of the
    /// file, the first byte, and the byte behind the last one.
    pub fn requests(&self) -> Vec<f64> {
        flat(self.0.requests())
    }

    /// See [`Stage::arrive`].
    pub fn arrive(&mut self, file: usize, start: f64, bytes: &[u8]) -> Result<(), JsError> {
        self.0.arrive(file, start as u64, bytes).map_err(|error| told(&error))
    }

    /// See [`Stage::is_rough`].
    pub fn is_rough(&self) -> bool {
        self.0.is_rough()
    }

    /// See [`Stage::is_full`].
    pub fn is_full(&self) -> bool {
        self.0.is_full()
    }

    /// See [`Stage::set_helpers`].
    pub fn set_helpers(&mut self, count: u32) {
        self.0.set_helpers(count);
    }

    /// See [`Stage::lend`].
    pub fn lend(&mut self) -> Option<String> {
        self.0.lend()
    }

    /// See [`Stage::give_back`].
    pub fn give_back(&mut self, frame: f64, band: usize, numbers: &[f32]) -> Result<(), JsError> {
        self.0.give_back(frame as u64, band, numbers).map_err(|error| told(&error))
    }

    /// See [`Stage::take_back`].
    pub fn take_back(&mut self, frame: f64, band: usize) {
        self.0.take_back(frame as u64, band);
    }

    /// See [`Stage::help`].
    pub fn help(&mut self, job: &str) -> Result<Vec<f32>, JsError> {
        self.0.help(job).map_err(|error| told(&error))
    }

    /// The pixels of the last frame: red, green, blue and opacity.
    pub fn pixels(&self) -> Vec<u8> {
        self.0.pixels()
    }

    /// Of the last frame: its width, its height, whether it is exact, and its milliseconds.
    pub fn frame(&self) -> Vec<f64> {
        self.0.frame().map_or(Vec::new(), |frame| {
            let [width, height] = [frame.picture.width, frame.picture.height].map(f64::from);
            vec![width, height, f64::from(u8::from(frame.is_exact)), frame.milliseconds]
        })
    }

    /// See [`Stage::resize`].
    pub fn resize(&mut self, width: u32, height: u32) -> Result<(), JsError> {
        self.0.resize([width, height]).map_err(|error| told(&error))
    }

    /// See [`Stage::turn`].
    pub fn turn(&mut self, x: f64, y: f64) {
        self.0.turn(DVec2::new(x, y));
    }

    /// See [`Stage::look_around`].
    pub fn look(&mut self, x: f64, y: f64) {
        self.0.look_around(DVec2::new(x, y));
    }

    /// See [`Stage::grab`].
    pub fn grab(&mut self, x: f64, y: f64) {
        self.0.grab(DVec2::new(x, y));
    }

    /// See [`Stage::pan`].
    pub fn pan(&mut self, x: f64, y: f64) {
        self.0.pan(DVec2::new(x, y));
    }

    /// See [`Stage::zoom`].
    pub fn zoom(&mut self, factor: f64, x: f64, y: f64) {
        self.0.zoom(factor, DVec2::new(x, y));
    }

    /// See [`Stage::center`].
    pub fn center(&mut self, x: f64, y: f64) {
        self.0.center(DVec2::new(x, y));
    }

    /// See [`Stage::fly`].
    pub fn fly(&mut self, right: f64, up: f64, forward: f64) {
        self.0.fly(DVec3::new(right, up, forward));
    }

    /// See [`Stage::switch_perspective`].
    pub fn perspective(&mut self) {
        self.0.switch_perspective();
    }

    /// See [`Stage::fit`]. The side is a name, or empty.
    pub fn fit(&mut self, side: &str) -> Result<(), JsError> {
        let named = Side::ALL.into_iter().find(|known| known.name() == side);
        if named.is_none() && !side.is_empty() {
            let names = Side::ALL.map(Side::name).join(", ");
            return Err(JsError::new(&format!("there is no side “{side}”, only {names}")));
        }
        self.0.fit(named).map_err(|error| told(&error))
    }

    /// The camera as JSON, as in scene files.
    pub fn camera(&self) -> String {
        serde_json::to_string(&self.0.camera()).unwrap_or_default()
    }

    /// Sets the camera.
    pub fn set_camera(&mut self, json: &str) -> Result<(), JsError> {
        let camera: CameraEntry = parsed("camera", json)?;
        self.0.set_camera(&camera).map_err(|error| told(&error))
    }

    /// Sets the transfer function of a field.
    pub fn set_transfer(&mut self, field: usize, json: &str) -> Result<(), JsError> {
        let transfer = TransferFunction::from_json(json).map_err(|error| told(&error))?;
        self.0.set_transfer(field, &transfer).map_err(|error| told(&error))
    }

    /// The transfer functions of the fields, as JSON.
    pub fn transfers(&self) -> String {
        serde_json::to_string(&self.0.transfers()).unwrap_or_default()
    }

    /// Sets the clips.
    pub fn set_clips(&mut self, json: &str) -> Result<(), JsError> {
        let clips: Vec<ClipEntry> = parsed("clips", json)?;
        self.0.set_clips(clips).map_err(|error| told(&error))
    }

    /// The world point at a pixel; empty if there is none.
    pub fn point(&self, x: f64, y: f64) -> Vec<f64> {
        self.0.point_at(DVec2::new(x, y)).map_or(Vec::new(), |point| point.to_array().to_vec())
    }
}

fn parsed<T: serde::de::DeserializeOwned>(what: &str, json: &str) -> Result<T, JsError> {
    serde_json::from_str(json).map_err(|error| JsError::new(&format!("{what}: {error}")))
}

/// Returns requests as numbers.
fn flat(requests: Vec<Request>) -> Vec<f64> {
    let numbers = |(file, range): Request| [file as f64, range.start as f64, range.end as f64];
    requests.into_iter().flat_map(numbers).collect()
}

/// Returns an error as a text, with its hint.
fn told(error: &Error) -> JsError {
    let message = error.to_string();
    match error {
        Error::Input { hint: Some(hint), .. } => JsError::new(&format!("{message}\n{hint}")),
        _ => JsError::new(&message),
    }
}
