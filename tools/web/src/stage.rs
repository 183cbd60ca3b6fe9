//! A scene that a page shows: drawn coarsely while it moves, and exactly once it rests.
//!
//! A page has one thread for this, which also hears the hand. So nothing here takes long, apart
//! from opening the scene: fine frames are drawn in strips, and the hand is heard between them. A
//! GPU draws whole frames meanwhile. If it cannot, the processor draws.

mod bands;
mod painter;

use crate::{Files, Request};
use bands::Bands;
use glam::{DVec2, DVec3};
use painter::Painter;
use splatkit::{
    Device, Error, Result,
    interaction::{Effort, Orbit, Pace, Probe},
    math::{Camera, View},
    picture::Picture,
    scene::{Controls, Scene, Settings},
    session::{CameraEntry, ClipEntry, Description, Drawing, Loaded, Side},
    volume::TransferFunction,
};
use std::collections::BTreeMap;
use web_time::{Duration, Instant};

/// The wanted time of a moving frame, in milliseconds.
const MOVING: f64 = 30.0;

/// A view that changed less than this ago may still move: it is not refined yet.
const CALM: Duration = Duration::from_millis(70);

/// The strips of a fine frame. Each finds anew which splats it meets, and rounds positions in its
/// own way; so their number does not depend on how fast the machine is.
const STRIPS: u32 = 6;

/// Strips begin where blocks of tiles do.
const ROWS: u32 = 32;

/// While parts of files come, the picture is drawn again after these milliseconds at the earliest,
/// and after this multiple of the time that it takes.
const FRESH: f64 = 250.0;
const PATIENCE: f64 = 3.0;

/// What [`Stage::step`] has done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// There is nothing to do: the exact picture is shown.
    Rests,
    /// The view may still move. Call again after these milliseconds.
    Waits(f64),
    /// A strip was drawn. Call again.
    Works,
    /// There is a new frame. Call again.
    Shows,
    /// A GPU draws. Call again when [`Stage::more`] is ready.
    Draws,
    /// Parts of files have to come first ([`Stage::requests`]). Call again then.
    Lacks,
    /// Helpers draw the rest of the frame. Call again when one has ([`Stage::give_back`]).
    Lent,
}

/// A frame that was drawn.
#[derive(Debug)]
pub struct Frame {
    /// The finished picture. One that is not exact has fewer pixels.
    pub picture: Picture,
    /// The camera that it shows.
    pub camera: Camera,
    /// Whether this is the picture that `splatkit render` draws.
    pub is_exact: bool,
    /// The time that drawing took, in milliseconds.
    pub milliseconds: f64,
}

/// A frame that is being drawn.
struct Work {
    /// Its number among the frames.
    number: u64,
    effort: Effort,
    /// Whether the view moves. A frame of a moving view is finished, even if it has moved on.
    moves: bool,
    settings: Settings,
    drawing: Drawing,
    camera: Camera,
    view: View,
    start: Instant,
    picture: Picture,
    bands: Bands,
    /// What helpers must know, if some draw along.
    state: String,
    milliseconds: f64,
}

/// A scene, and how it is seen.
pub struct Stage {
    description: Description,
    files: Files,
    /// Whether parts were missed when the scene was read, and what of these has not come.
    is_rough: bool,
    rough: Vec<Request>,
    loaded: Loaded,
    painter: Painter,
    device: Device,
    /// Why a GPU that was given does not draw.
    refusal: Option<String>,
    drawing: Drawing,
    orbit: Orbit,
    size: [u32; 2],
    /// Whether the camera is the one that is fitted to the scene.
    is_fitted: bool,
    sheet: Option<f64>,
    pace: Pace,
    /// Whether something changed since the last frame was begun, and when.
    is_changed: bool,
    changed: Instant,
    work: Option<Work>,
    /// The frames that were begun.
    begun: u64,
    /// The helpers that draw along, and whether the next frame is drawn without them.
    helpers: u32,
    is_alone: bool,
    /// What another stage has set, if this one helps it.
    taken: String,
    frame: Option<Frame>,
    /// The effort of the last frame, if parts of files were missed, and when it was finished.
    again: Option<(Effort, Instant)>,
    /// Whether parts have come since the last frame began.
    is_fed: bool,
    /// The transfer functions that were set, by their fields.
    transfers: BTreeMap<usize, TransferFunction>,
    /// The depth of the point where a drag began.
    grabbed: Option<f64>,
}

impl Stage {
    /// Reads a scene file, and the inputs that it names. The picture has `size` pixels instead of
    /// what the scene file says. If a GPU refuses the scene, the processor draws.
    ///
    /// # Errors
    /// Those of [`Description::parse`], of [`Files::load`] and of preparing the scene. If one of
    /// the files lacks parts then, fetch those and try again.
    pub fn open(text: &str, files: Files, size: [u32; 2], device: &Device) -> Result<Self> {
        let mut description = Description::parse(text)?;
        // A page shows one view, in pixels.
        let picture = &mut description.picture;
        (picture.width, picture.height) = (None, None);
        picture.views.clear();
        (picture.columns, picture.panel_labels) = (None, None);
        picture.size = Some(size.map(|side| side.max(1)));
        let usual = picture.memory.unwrap_or(Controls::default().page_memory);
        picture.memory = Some(files.most_of_pages(usual));
        files.begin(&[]);
        let (loaded, drawing) = read(&description, &files)?;
        let framing = description.framing()?;
        let camera = framing.camera(&loaded.subject, drawing.free(0))?;
        let up = framing.orientation(&loaded.subject).0.up;
        let orbit = Orbit::new(camera, up, loaded.subject.bounds.diagonal());
        let (painter, refusal) = painter_on(device, &loaded.scene)?;
        let sheet = loaded.scene.finest_sheet();
        let (is_fitted, is_changed) = (description.camera.is_none(), true);
        let (is_rough, rough) = (files.lack(), files.requests());
        Ok(Self {
            size: drawing_size(&description),
            description,
            files,
            is_rough,
            rough,
            loaded,
            device: if painter.is_gpu() { device.clone() } else { Device::Cpu },
            painter,
            refusal,
            drawing,
            orbit,
            is_fitted,
            sheet,
            pace: Pace::new(MOVING),
            is_changed,
            changed: Instant::now(),
            work: None,
            begun: 0,
            helpers: 0,
            is_alone: false,
            taken: String::new(),
            frame: None,
            again: None,
            is_fed: false,
            transfers: BTreeMap::new(),
            grabbed: None,
        })
    }

    /// Reads the scene again, with the parts that have come since: the transfer function and the
    /// camera that is fitted then are as `splatkit render` has them.
    fn read_again(&mut self) -> Result<()> {
        self.files.begin(&[]);
        let read = read(&self.description, &self.files);
        let rough = self.files.requests();
        if read.is_err() && !rough.is_empty() {
            // Parts have left again.
            self.rough = rough;
            return Ok(());
        }
        (self.loaded, self.drawing) = read?;
        (self.is_rough, self.rough) = (self.files.lack(), rough);
        self.sheet = self.loaded.scene.finest_sheet();
        self.prepare()?;
        if self.is_fitted {
            self.fit(None)?;
        }
        self.touch();
        Ok(())
    }

    /// Prepares the scene on the device, with the transfer functions that were set.
    fn prepare(&mut self) -> Result<()> {
        let (painter, refusal) = painter_on(&self.device, &self.loaded.scene)?;
        if refusal.is_some() {
            (self.device, self.refusal) = (Device::Cpu, refusal);
        }
        self.painter = painter;
        for (field, transfer) in std::mem::take(&mut self.transfers) {
            self.set_transfer(field, &transfer)?;
        }
        Ok(())
    }

    /// Lets the processor draw from now on.
    fn fall_back(&mut self, error: &Error) -> Result<()> {
        (self.device, self.refusal) = (Device::Cpu, Some(error.to_string()));
        self.pace = Pace::new(MOVING);
        self.prepare()?;
        self.touch();
        Ok(())
    }

    /// Whether a GPU draws.
    pub fn is_gpu(&self) -> bool {
        self.painter.is_gpu()
    }

    /// Returns why the GPU that was given does not draw, if it does not.
    pub fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// Returns a future that is ready when the GPU has done something.
    pub fn more(&self) -> impl Future<Output = ()> + use<> {
        self.painter.more()
    }

    /// Hands in bytes of a file in parts.
    ///
    /// # Errors
    /// Those of [`Files::arrive`].
    pub fn arrive(&mut self, file: usize, start: u64, bytes: &[u8]) -> Result<()> {
        self.files.arrive(file, start, bytes)?;
        self.is_fed = true;
        let Self { files, rough, .. } = self;
        rough.retain(|request| !files.have(request));
        Ok(())
    }

    /// Returns what to fetch, the most important first.
    pub fn requests(&self) -> Vec<Request> {
        self.files.requests()
    }

    /// Returns whether the scene was read before all was there on which its transfer functions and
    /// the camera that is fitted depend.
    pub fn is_rough(&self) -> bool {
        self.is_rough
    }

    /// Returns whether the view needs more of a file than may be held in memory. It is shown
    /// coarser then.
    pub fn is_full(&self) -> bool {
        self.files.are_full() || self.painter.is_missing()
    }

    /// Returns what was said of the inputs while they were read.
    pub fn warnings(&self) -> &[String] {
        &self.loaded.warnings
    }

    /// Returns the names of the inputs, and what they hold, for people who do not see the picture.
    pub fn summary(&self) -> String {
        let names = self.loaded.inputs.iter().map(|input| {
            let name = input.file.file_name().unwrap_or(input.file.as_os_str());
            format!("{} ({:?})", name.to_string_lossy(), input.kind).to_lowercase()
        });
        names.collect::<Vec<_>>().join(", ")
    }

    /// Returns the camera.
    pub fn camera(&self) -> CameraEntry {
        CameraEntry::from(self.orbit.camera())
    }

    /// Returns the last frame.
    pub fn frame(&self) -> Option<&Frame> {
        self.frame.as_ref()
    }

    /// Returns the pixels of the last frame: red, green, blue and opacity, 8 bits each.
    pub fn pixels(&self) -> Vec<u8> {
        let background = self.description.picture.background();
        self.frame.as_ref().map_or(Vec::new(), |frame| frame.picture.to_rgba8(background))
    }

    /// Says that the picture has another number of pixels.
    ///
    /// # Errors
    /// Those of [`PictureEntry::settings`](splatkit::session::PictureEntry::settings) and of
    /// fitting the camera.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<()> {
        let size = size.map(|side| side.max(1));
        if size == self.size {
            return Ok(());
        }
        self.size = size;
        self.description.picture.size = Some(size);
        self.redraw()?;
        if self.is_fitted {
            self.fit(None)?;
        }
        Ok(())
    }

    /// Takes the settings from the description again.
    fn redraw(&mut self) -> Result<()> {
        self.drawing = self.loaded.drawing(&self.description.picture)?;
        self.touch();
        Ok(())
    }

    /// Replaces the clips.
    ///
    /// # Errors
    /// [`Error::Argument`] for shapes that cannot be; [`Error::NothingToDraw`] if they leave
    /// nothing.
    pub fn set_clips(&mut self, clips: Vec<ClipEntry>) -> Result<()> {
        let before = std::mem::replace(&mut self.description.picture.clips, clips);
        let checked = self.description.picture.validate().and_then(|()| self.redraw());
        checked.inspect_err(|_| self.description.picture.clips = before)
    }

    /// Replaces the transfer function of a field: the first, the second …
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such field, and those of
    /// [`Renderer::set_transfer`](splatkit::Renderer::set_transfer).
    pub fn set_transfer(&mut self, field: usize, transfer: &TransferFunction) -> Result<()> {
        let fields = self.loaded.scene.fields();
        let item = *fields.get(field).ok_or_else(|| {
            Error::Argument(format!("there is no field {field}: the scene has {}", fields.len()))
        })?;
        self.loaded.scene.with_transfer(item, transfer)?;
        if self.work.as_ref().is_some_and(|work| work.moves) && !self.painter.is_gpu() {
            // Its other bands would have other colours. Changes may come faster than frames.
            (self.work, self.is_alone) = (None, true);
        }
        self.painter.set_transfer(item, transfer)?;
        self.transfers.insert(field, transfer.clone());
        self.touch();
        Ok(())
    }

    /// Returns the transfer functions of the fields.
    pub fn transfers(&self) -> Vec<TransferFunction> {
        let own = self.loaded.scene.items.iter().filter_map(|item| item.transfer());
        let set = |(field, own)| self.transfers.get(&field).unwrap_or(own).clone();
        own.enumerate().map(set).collect()
    }

    /// Something changed: the last frame no longer shows it.
    fn touch(&mut self) {
        (self.is_changed, self.changed) = (true, Instant::now());
        self.files.renew();
    }

    fn moved(&mut self) {
        self.is_fitted = false;
        self.touch();
    }

    /// Sets the camera.
    ///
    /// # Errors
    /// [`Error::Argument`] for one that cannot be.
    pub fn set_camera(&mut self, camera: &CameraEntry) -> Result<()> {
        self.orbit.set_camera(camera.camera().map_err(Error::Argument)?);
        self.moved();
        Ok(())
    }

    /// Shows the whole scene, from a side or as at first.
    ///
    /// # Errors
    /// Those of [`Framing::camera`](splatkit::session::Framing::camera).
    pub fn fit(&mut self, side: Option<Side>) -> Result<()> {
        let mut framing = self.description.framing()?;
        if side.is_some() {
            (framing.camera, framing.camera_position, framing.view) = (None, None, side);
            (framing.azimuth, framing.elevation) = (None, None);
        }
        let camera = framing.camera(&self.loaded.subject, self.drawing.free(0))?;
        self.orbit.set_camera(camera);
        self.moved();
        self.is_fitted = side.is_none() && self.description.camera.is_none();
        Ok(())
    }

    /// Turns the scene by a drag in pixels.
    pub fn turn(&mut self, drag: DVec2) {
        self.orbit.turn(drag, self.size);
        self.moved();
    }

    /// Looks around by a drag in pixels.
    pub fn look_around(&mut self, drag: DVec2) {
        self.orbit.look_around(drag, self.size);
        self.moved();
    }

    /// A drag begins at a pixel.
    pub fn grab(&mut self, at: DVec2) {
        self.grabbed = self.depth_at(at);
    }

    /// Moves the scene by a drag in pixels.
    pub fn pan(&mut self, drag: DVec2) {
        // Without a picture there is nothing to move.
        if self.orbit.pan(drag, self.size, self.grabbed).is_ok() {
            self.moved();
        }
    }

    /// Comes closer by a factor to what is at a pixel.
    pub fn zoom(&mut self, factor: f64, at: DVec2) {
        let depth = self.depth_at(at);
        let is_factor = factor.is_finite() && factor > 0.0;
        if is_factor && self.orbit.zoom(factor, at, self.size, depth).is_ok() {
            self.moved();
        }
    }

    /// Turns about the point at a pixel from now on.
    pub fn center(&mut self, at: DVec2) {
        if let Some(point) = self.point_at(at) {
            self.orbit.center(point);
            self.moved();
        }
    }

    /// Flies to the right, up and forwards, by shares of the distance to the focal point.
    pub fn fly(&mut self, step: DVec3) {
        let camera = self.orbit.camera();
        let distance = camera.position.distance(camera.focal_point);
        self.orbit.fly(step * distance);
        self.moved();
    }

    /// Switches perspective on or off.
    pub fn switch_perspective(&mut self) {
        let is_flat = self.camera().height.is_some();
        self.orbit.set_orthographic(!is_flat);
        self.moved();
    }

    /// Returns the world point of the last frame at a pixel.
    pub fn point_at(&self, at: DVec2) -> Option<DVec3> {
        let frame = self.frame.as_ref()?;
        Probe::picked(&frame.picture, &frame.camera.view(self.size).ok()?, at)
    }

    fn depth_at(&self, at: DVec2) -> Option<f64> {
        let view = self.frame.as_ref()?.camera.view(self.size).ok()?;
        Some(view.to_view(self.point_at(at)?).z)
    }

    /// Does the next part of the work, which is short.
    ///
    /// # Errors
    /// Those of [`Renderer::render`](splatkit::Renderer::render) on the processor. Nothing more is
    /// drawn then, until something changes.
    pub fn step(&mut self) -> Result<Step> {
        let done = self.next();
        if done.is_err() {
            self.work = None;
        }
        done
    }

    fn next(&mut self) -> Result<Step> {
        if let Some(step) = self.hear_gpu()? {
            return Ok(step);
        }
        if self.is_rough && self.is_fed && self.rough.is_empty() && self.work.is_none() {
            self.read_again()?;
        }
        // A moving frame is finished first.
        let moves = self.work.as_ref().is_some_and(|work| work.moves);
        let is_new = !moves && std::mem::take(&mut self.is_changed);
        if is_new {
            self.work = None;
            self.again = None;
            self.pace.changed();
        }
        if self.work.is_none() {
            if let Some(step) = self.awaits() {
                return Ok(step);
            }
            let again = self.again.take().map(|(effort, _)| effort);
            let Some(effort) = again.or_else(|| self.pace.next()) else { return Ok(Step::Rests) };
            let calm = self.changed.elapsed();
            if !is_new && calm < CALM {
                return Ok(Step::Waits((CALM - calm).as_secs_f64() * 1e3));
            }
            self.begin(effort, is_new)?;
            if self.work.as_ref().is_some_and(|work| !work.state.is_empty()) {
                return Ok(Step::Works);
            }
        }
        self.draw_strip()
    }

    /// Returns what to wait for, if parts of files have to come before the next frame.
    fn awaits(&self) -> Option<Step> {
        let (_, finished) = self.again?;
        if !self.is_fed {
            return Some(Step::Lacks);
        }
        let took = self.frame.as_ref().map_or(0.0, |frame| frame.milliseconds);
        let wait = FRESH.max(PATIENCE * took) - finished.elapsed().as_secs_f64() * 1e3;
        (wait > 0.0 && !self.files.requests().is_empty()).then_some(Step::Waits(wait))
    }

    /// Begins a frame. One that moves is drawn at once.
    fn begin(&mut self, effort: Effort, moves: bool) -> Result<()> {
        self.files.begin(&self.rough);
        self.painter.renew();
        self.is_fed = false;
        let (exact, camera) = (&self.drawing.settings, self.orbit.camera().clone());
        let settings = effort.settings(exact, exact.sheet_thickness.or(self.sheet));
        let view = camera.view(settings.size)?;
        let picture = Picture::blank(settings.size);
        let height = settings.size[1];
        let is_alone = std::mem::take(&mut self.is_alone) || self.painter.is_gpu();
        let helpers = if is_alone { 0 } else { self.helpers };
        let bands = match moves {
            true => Bands::among(height, 1 + helpers),
            false => Bands::new(height, strip_rows(height)),
        };
        let is_shared = helpers > 0 && bands.are_several();
        self.begun += 1;
        self.work = Some(Work {
            number: self.begun,
            effort,
            moves,
            settings,
            drawing: self.drawing.clone(),
            camera,
            view,
            start: Instant::now(),
            picture,
            bands,
            state: if is_shared { self.state() } else { String::new() },
            milliseconds: 0.0,
        });
        Ok(())
    }

    /// Looks at the frame that a GPU draws. Returns `None` if another one may begin.
    fn hear_gpu(&mut self) -> Result<Option<Step>> {
        if !self.painter.is_drawing() {
            return Ok(None);
        }
        if self.is_changed && self.work.as_ref().is_some_and(|work| !work.moves) {
            self.work = None;
            self.painter.stop();
        }
        let Some(drawn) = self.painter.poll() else { return Ok(Some(Step::Draws)) };
        match (drawn, self.work.take()) {
            (Ok(picture), Some(work)) => {
                let milliseconds = work.start.elapsed().as_secs_f64() * 1e3;
                self.finish(Work { picture, milliseconds, ..work }).map(Some)
            }
            (Ok(_), None) | (Err(Error::Stopped), _) => Ok(None),
            (Err(error), _) => self.fall_back(&error).map(|()| None),
        }
    }

    fn draw_strip(&mut self) -> Result<Step> {
        if self.painter.is_gpu() {
            if let Some(work) = &self.work {
                self.painter.begin(work.view.clone(), work.settings.clone());
            }
            return Ok(self.hear_gpu()?.unwrap_or(Step::Works));
        }
        let Some(mut work) = self.work.take() else { return Ok(Step::Rests) };
        if let Some(band) = work.bands.next() {
            let (rows, start) = (work.bands.rows(band), Instant::now());
            let drawn = bands::drawn(&mut self.painter, &work.view, &work.settings, rows.clone())?;
            work.picture.paste(&drawn, [0, rows.start])?;
            work.bands.set_drawn(band);
            work.milliseconds += start.elapsed().as_secs_f64() * 1e3;
        }
        if work.bands.are_drawn() {
            if !work.state.is_empty() {
                work.milliseconds = work.start.elapsed().as_secs_f64() * 1e3;
            }
            return self.finish(work);
        }
        let step = if work.bands.next().is_some() { Step::Works } else { Step::Lent };
        self.work = Some(work);
        Ok(step)
    }

    /// Makes a drawn picture the frame that is shown.
    fn finish(&mut self, work: Work) -> Result<Step> {
        let Work { effort, drawing, camera, picture, milliseconds, .. } = work;
        self.pace.took(effort, milliseconds);
        let lacks = self.is_rough || self.files.lack();
        self.again = lacks.then(|| (effort, Instant::now()));
        let is_whole = !lacks && !self.painter.is_missing();
        let is_exact = effort == Effort::EXACT && is_whole && !self.is_changed;
        let picture = match effort == Effort::EXACT {
            true => drawing.reduced(picture, &self.loaded.items, &camera)?,
            false => picture,
        };
        self.frame = Some(Frame { picture, camera, is_exact, milliseconds });
        Ok(Step::Shows)
    }
}

/// Prepares a scene on a device, or on the processor if a GPU refuses. Returns what it says then.
fn painter_on(device: &Device, scene: &Scene) -> Result<(Painter, Option<String>)> {
    match Painter::new(device, scene) {
        Err(error) if !matches!(device, Device::Cpu) => {
            Ok((Painter::new(&Device::Cpu, scene)?, Some(error.to_string())))
        }
        done => Ok((done?, None)),
    }
}

/// Reads the inputs of a scene, and finds what is seen of it.
fn read(description: &Description, files: &Files) -> Result<(Loaded, Drawing)> {
    let mut loaded = files.load(description)?;
    let drawing = loaded.drawing(&description.picture)?;
    loaded.find_seen(&description.framing()?, &drawing.settings)?;
    Ok((loaded, drawing))
}

/// Returns the size that a description gives its picture.
fn drawing_size(description: &Description) -> [u32; 2] {
    description.picture.size()
}

/// Returns the rows of a strip: whole blocks of tiles.
fn strip_rows(height: u32) -> u32 {
    height.div_ceil(STRIPS).div_ceil(ROWS).saturating_mul(ROWS).min(height)
}

#[cfg(test)]
mod tests;
