//! The window: what it shows, and what a hand does in it.

use super::{
    canvas::Canvas,
    document::{Document, LoadedBy, unplaced},
    handles::{self, Moved},
    loader::{Loading, text_of},
    painter::{Frame, Order, Painter, Stage},
    panels,
    screen::Screen,
};
use crate::{job::Finish, scene_file};
use eframe::{
    egui::{
        self, Align2, CentralPanel, Color32, Context, CursorIcon, FontId, Key, Modifiers, Panel,
        PointerButton, Pos2, Rect, Sense, Ui, Vec2,
    },
    egui_wgpu::RenderState,
};
use glam::{DVec2, DVec3};
use splatkit::{
    interaction::{Orbit, Probe},
    scene::Settings,
    session::{CameraEntry, ClipEntry, Description, Framing, InputEntry, Side},
    volume::TransferFunction,
};
use std::{path::PathBuf, sync::Arc};

/// The largest picture that is drawn for a window, in pixels along a side.
const MOST_SIDE: u32 = 8192;

/// The scene that is shown, and how.
pub struct SceneView {
    pub stage: Arc<Stage>,
    pub orbit: Orbit,
    settings: Settings,
    pub finish: Arc<Finish>,
    /// The inputs that were loaded: those of the items.
    inputs: Vec<PathBuf>,
    /// The transfer functions that the scene was loaded with, with the numbers of their items.
    loaded_transfers: Vec<(usize, TransferFunction)>,
    /// The item whose field is edited.
    pub field: usize,
}

impl SceneView {
    /// Returns the items that have a field, with their names.
    pub fn fields(&self) -> Vec<(usize, String)> {
        let name = |item: usize| {
            let name = self.inputs.get(item).and_then(|file| file.file_name());
            name.map_or(String::new(), |name| name.to_string_lossy().into_owned())
        };
        self.loaded_transfers.iter().map(|(item, _)| (*item, name(*item))).collect()
    }
}

/// What the window is used for when a point is clicked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tool {
    Navigate,
    Measure,
}

/// What the settings of a picture follow from.
#[derive(PartialEq)]
struct SetFor {
    /// The scene without its camera and its transfer function.
    scene: Description,
    size: [u32; 2],
    /// Whether the camera is fitted to the scene.
    is_fitted: bool,
    /// The edited transfer functions, if bars show their colours.
    bars: Vec<(usize, TransferFunction)>,
}

/// The window's state.
pub struct Window {
    pub document: Document,
    pub scene_view: Option<SceneView>,
    pub tool: Tool,
    /// Points that were picked to be measured, in world units.
    pub measured: Vec<DVec3>,
    /// The last frame.
    pub frame: Option<Frame>,
    canvas: Canvas,
    /// How long after its order the last frame was here, in milliseconds.
    pub delay: f64,
    /// Messages, the newest last, and whether each is an error.
    pub messages: Vec<(String, bool)>,
    pub panels: panels::State,
    painter: Painter,
    loading: Option<Loading>,
    /// What the shown scene, or the one that is being loaded, was loaded by.
    loaded_by: Option<LoadedBy>,
    /// What the settings were made for, and what was ordered last.
    set_for: Option<SetFor>,
    ordered: Option<Description>,
    last_order: u64,
    /// The size of the picture in pixels.
    pub size: [u32; 2],
    /// The picture is saved here as soon as it is exact.
    pub save_to: Option<PathBuf>,
    pub context: Context,
}

impl Window {
    /// `state`: the window's device, if it has one.
    pub fn new(
        document: Document,
        context: &Context,
        state: Option<&RenderState>,
    ) -> std::io::Result<Self> {
        let repaint = context.clone();
        Ok(Self {
            document,
            scene_view: None,
            tool: Tool::Navigate,
            measured: Vec::new(),
            frame: None,
            canvas: Canvas::new(state),
            delay: 0.0,
            messages: Vec::new(),
            panels: panels::State::default(),
            painter: Painter::start(move || repaint.request_repaint())?,
            loading: None,
            loaded_by: None,
            set_for: None,
            ordered: None,
            last_order: 0,
            size: [0; 2],
            save_to: None,
            context: context.clone(),
        })
    }

    /// Shows the whole window.
    pub fn ui(&mut self, ui: &mut Ui) {
        // Before the picture is painted, so that a frame is seen at once.
        self.take_frame();
        self.take_dropped(ui);
        self.take_keys(ui);
        Panel::top("menu").show(ui, |ui| panels::menu(self, ui));
        Panel::bottom("status").show(ui, |ui| panels::status(self, ui));
        if self.panels.shows_side {
            Panel::right("side").default_size(330.0).show(ui, |ui| {
                let area = egui::ScrollArea::vertical().auto_shrink([false, true]);
                area.show(ui, |ui| panels::side(self, ui));
            });
        }
        if self.panels.shows_slices {
            Panel::left("slices").default_size(280.0).show(ui, |ui| {
                let area = egui::ScrollArea::vertical().auto_shrink([false, true]);
                area.show(ui, |ui| panels::slices(self, ui));
            });
        }
        CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
        panels::windows(self, ui);
        self.refresh();
    }

    /// Whether the exact picture of the current scene is shown.
    pub fn rests(&self) -> bool {
        let is_exact = self
            .frame
            .as_ref()
            .is_some_and(|frame| frame.is_exact() && frame.number == self.last_order);
        self.loading.is_none() && (self.scene_view.is_none() || is_exact)
    }

    /// Returns the step that loading is at, and how much of it is done.
    pub fn loading_step(&self) -> Option<(String, Option<f32>, f32)> {
        let loading = self.loading.as_ref()?;
        let (name, share) = loading.step();
        Some((name, share, loading.since.elapsed().as_secs_f32()))
    }

    pub fn say(&mut self, text: impl Into<String>, is_error: bool) {
        const MOST: usize = 100;
        self.messages.push((text.into(), is_error));
        let surplus = self.messages.len().saturating_sub(MOST);
        self.messages.drain(..surplus);
    }

    /// Adds files to the scene, or opens a scene file in place of it.
    pub fn open(&mut self, files: Vec<PathBuf>) {
        if let Some(path) = files.iter().find(|path| scene_file::is_scene(path)) {
            let is_trusting = self.document.is_trusting;
            match scene_file::read(path, is_trusting) {
                Ok(scene) => {
                    self.document.open(scene, path.clone());
                    self.loaded_by = None;
                }
                Err(error) => self.say(text_of(&error.into()), true),
            }
            return;
        }
        let entries = files.into_iter().map(InputEntry::new);
        self.document.change(|scene| scene.inputs.extend(entries));
    }

    /// Gives up the scene that is being loaded.
    pub fn cancel(&mut self) {
        self.give_up();
        self.say("loading was cancelled", false);
    }

    /// Goes back to the scene that is shown, which can be redone.
    fn give_up(&mut self) {
        self.loading = None;
        if self.scene_view.is_some() && self.document.can_undo() {
            self.document.undo();
            self.loaded_by = Some(self.document.loaded_by());
        }
    }

    /// Looks at the whole scene from a side, or as usual.
    pub fn look_from(&mut self, side: Option<Side>) {
        self.document.adjust(|scene| {
            scene.camera = None;
            scene.framing = Framing { view: side, ..unplaced(&scene.framing) };
        });
        self.set_for = None;
    }

    /// Moves the camera.
    pub fn move_camera(&mut self, change: impl FnOnce(&mut Orbit)) {
        let Some(scene_view) = &mut self.scene_view else { return };
        change(&mut scene_view.orbit);
        let camera = CameraEntry::from(scene_view.orbit.camera());
        self.document.set_camera(camera);
    }

    /// Returns the transfer functions that show the fields, with the numbers of their items.
    pub fn transfers(&self) -> Vec<(usize, TransferFunction)> {
        let Some(scene_view) = &self.scene_view else { return Vec::new() };
        let mut all = scene_view.loaded_transfers.clone();
        for (item, transfer) in self.edited_transfers() {
            all.iter_mut()
                .filter(|entry| entry.0 == item)
                .for_each(|entry| entry.1.clone_from(&transfer));
        }
        all
    }

    /// Returns the transfer function that shows an item's field.
    pub fn transfer_of(&self, item: usize) -> Option<TransferFunction> {
        self.transfers()
            .into_iter()
            .find(|(number, _)| *number == item)
            .map(|(_, transfer)| transfer)
    }

    /// Returns the transfer function that is edited, if the scene has a field.
    pub fn transfer(&self) -> Option<TransferFunction> {
        self.transfer_of(self.scene_view.as_ref()?.field)
    }

    /// Returns the transfer functions that may be others than those that the scene was loaded with.
    fn edited_transfers(&self) -> Vec<(usize, TransferFunction)> {
        let Some(scene_view) = &self.scene_view else { return Vec::new() };
        let edited = |(item, _): &(usize, TransferFunction)| {
            let file = scene_view.inputs.get(*item)?;
            Some((*item, self.document.transfer_of(file)?))
        };
        scene_view.loaded_transfers.iter().filter_map(edited).collect()
    }

    /// Sets the transfer function that is edited, without a step that can be undone.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) {
        let mut transfers = self.transfers();
        let Some(scene_view) = &self.scene_view else { return };
        let edited = transfers.iter_mut().filter(|entry| entry.0 == scene_view.field);
        edited.for_each(|entry| entry.1.clone_from(transfer));
        let of_file = |(item, transfer): (usize, TransferFunction)| {
            Some((scene_view.inputs.get(item)?.as_path(), transfer))
        };
        let transfers: Vec<_> = transfers.into_iter().filter_map(of_file).collect();
        let has_surfaces =
            scene_view.stage.loaded.scene.items.iter().any(|item| item.transfer().is_none());
        self.document.set_transfers(&transfers, has_surfaces);
        // What was loaded stays loaded.
        if self.loading.is_none() && self.scene_view.is_some() {
            self.loaded_by = Some(self.document.loaded_by());
        }
    }

    /// Takes files that were dropped onto the window.
    fn take_dropped(&mut self, ui: &Ui) {
        let dropped = ui.input(|input| input.raw.dropped_files.clone());
        let files: Vec<PathBuf> = dropped.into_iter().map(|file| file.path().to_owned()).collect();
        if !files.is_empty() {
            self.open(files);
        }
    }

    fn take_keys(&mut self, ui: &Ui) {
        if ui.ctx().text_edit_focused() {
            return;
        }
        let pressed = |modifiers, key| ui.input_mut(|input| input.consume_key(modifiers, key));
        if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::C) {
            self.copy_command();
        }
        if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z)
            || pressed(Modifiers::COMMAND, Key::Y)
        {
            self.document.redo();
        }
        if pressed(Modifiers::COMMAND, Key::Z) {
            self.document.undo();
        }
        if pressed(Modifiers::COMMAND, Key::O) {
            self.panels.ask(panels::Ask::Open);
        }
        if pressed(Modifiers::COMMAND, Key::S) {
            self.panels.ask(panels::Ask::SaveScene);
        }
        if pressed(Modifiers::COMMAND, Key::P) {
            self.panels.ask(panels::Ask::SavePicture);
        }
        self.take_sides(ui);
        if pressed(Modifiers::NONE, Key::M) {
            self.tool = if self.tool == Tool::Measure { Tool::Navigate } else { Tool::Measure };
            self.measured.clear();
        }
        if pressed(Modifiers::NONE, Key::F1) || pressed(Modifiers::NONE, Key::H) {
            self.panels.shows_help = !self.panels.shows_help;
        }
        if pressed(Modifiers::NONE, Key::Tab) {
            self.panels.shows_side = !self.panels.shows_side;
        }
        self.fly(ui);
    }

    /// Takes the keys that set the view.
    fn take_sides(&mut self, ui: &Ui) {
        let pressed = |modifiers, key| ui.input_mut(|input| input.consume_key(modifiers, key));
        let sides = [
            (Key::Num1, Side::Front, Side::Back),
            (Key::Num3, Side::Right, Side::Left),
            (Key::Num7, Side::Top, Side::Bottom),
        ];
        for (key, side, other) in sides {
            if pressed(Modifiers::COMMAND, key) {
                self.look_from(Some(other));
            } else if pressed(Modifiers::NONE, key) {
                self.look_from(Some(side));
            }
        }
        if pressed(Modifiers::NONE, Key::Num0) {
            self.look_from(Some(Side::Iso));
        }
        if pressed(Modifiers::NONE, Key::Home) {
            self.look_from(None);
        }
        if pressed(Modifiers::NONE, Key::O) {
            self.move_camera(|orbit| {
                let is_perspective = matches!(
                    orbit.camera().projection,
                    splatkit::math::Projection::Perspective { .. }
                );
                orbit.set_orthographic(is_perspective);
            });
        }
    }

    /// Flies while keys are held.
    fn fly(&mut self, ui: &Ui) {
        let (held, time) = ui.input(|input| {
            let held = |key, back| {
                f64::from(u8::from(input.key_down(key))) - f64::from(u8::from(input.key_down(back)))
            };
            let is_plain = !input.modifiers.any();
            let step = DVec3::new(held(Key::D, Key::A), held(Key::E, Key::Q), held(Key::W, Key::S));
            (if is_plain { step } else { DVec3::ZERO }, f64::from(input.stable_dt.min(0.1)))
        });
        if held != DVec3::ZERO
            && let Some(scene_view) = &self.scene_view
        {
            // Across the distance of the focal point in two seconds.
            let camera = scene_view.orbit.camera();
            let speed = 0.5 * (camera.focal_point - camera.position).length();
            self.move_camera(|orbit| orbit.fly(held * speed * time));
            ui.ctx().request_repaint();
        }
    }

    /// Shows the picture and answers the hand.
    fn picture(&mut self, ui: &mut Ui) {
        let (area, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let scale = ui.ctx().pixels_per_point();
        self.size = [area.width(), area.height()]
            .map(|side| ((side * scale).round() as u32).clamp(1, MOST_SIDE));
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "The picture"));
        self.canvas.paint(ui, area);
        if self.scene_view.is_some() {
            self.answer(ui, &response, area, scale);
            self.draw_over(ui, area, scale);
        } else if self.loading.is_none() {
            let hint = "Drop a scan, a volume or a scene here, or open one (Ctrl+O)";
            let color = ui.visuals().weak_text_color();
            let font = FontId::proportional(16.0);
            ui.painter().text(area.center(), Align2::CENTER_CENTER, hint, font, color);
        }
    }

    /// Moves the camera as the hand moves.
    fn answer(&mut self, ui: &Ui, response: &egui::Response, area: Rect, scale: f32) {
        let size = self.size;
        let pixel = |at: Pos2| {
            let at = (at - area.min) * scale;
            DVec2::new(f64::from(at.x), f64::from(at.y))
        };
        let drag = response.drag_delta() * scale;
        let moved = DVec2::new(f64::from(drag.x), f64::from(drag.y));
        let modifiers = ui.input(|input| input.modifiers);
        let by = |button| response.dragged_by(button);
        let pans = by(PointerButton::Middle)
            || by(PointerButton::Secondary)
            || (by(PointerButton::Primary) && modifiers.shift);
        if response.drag_started() {
            let start = response.interact_pointer_pos().map(pixel);
            self.panels.grabbed = start.and_then(|at| self.depth_at(at));
            self.panels.before_drag = Some(self.document.scene().clone());
        }
        if pans && moved != DVec2::ZERO {
            let depth = self.panels.grabbed;
            self.move_camera(|orbit| {
                orbit.pan(moved, size, depth).ok();
            });
        } else if by(PointerButton::Primary) && modifiers.command && moved != DVec2::ZERO {
            panels::window_level(self, Vec2::new(drag.x, drag.y));
        } else if by(PointerButton::Primary) && modifiers.alt {
            self.move_camera(|orbit| orbit.look_around(moved, size));
        } else if by(PointerButton::Primary) && moved != DVec2::ZERO {
            self.move_camera(|orbit| orbit.turn(moved, size));
        }
        if response.drag_stopped()
            && let Some(mut before) = self.panels.before_drag.take()
        {
            // Moving the camera is no step.
            before.camera = self.document.scene().camera;
            before.framing.clone_from(&self.document.scene().framing);
            self.document.keep(before);
        }
        if let Some(at) = response.hover_pos() {
            self.point_at(ui, response, pixel(at));
        }
    }

    /// Answers the wheel and clicks at a pixel.
    fn point_at(&mut self, ui: &Ui, response: &egui::Response, cursor: DVec2) {
        let size = self.size;
        let scroll = ui.input(|input| f64::from(input.smooth_scroll_delta().y));
        let pinch = ui.input(|input| f64::from(input.zoom_delta()));
        let factor = (scroll / 400.0).exp() * if scroll == 0.0 { pinch } else { 1.0 };
        if factor != 1.0 {
            let depth = self.depth_at(cursor);
            self.move_camera(|orbit| {
                orbit.zoom(factor, cursor, size, depth).ok();
            });
        }
        self.panels.under_cursor = self.point_under(cursor);
        if response.double_clicked() {
            if let Some(point) = self.panels.under_cursor {
                self.move_camera(|orbit| orbit.center(point));
                self.panels.set_place(point);
            }
        } else if response.clicked()
            && self.tool == Tool::Measure
            && let Some(point) = self.panels.under_cursor
        {
            if self.measured.len() >= 2 {
                self.measured.clear();
            }
            self.measured.push(point);
        }
        if self.tool == Tool::Measure {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
    }

    /// Returns the view-space depth of the picture at a pixel of the window.
    fn depth_at(&self, cursor: DVec2) -> Option<f64> {
        let frame = self.frame.as_ref()?;
        let view = frame.camera.view(self.size).ok()?;
        Some(view.to_view(self.point_under(cursor)?).z)
    }

    /// Returns the world point under the cursor.
    fn point_under(&self, cursor: DVec2) -> Option<DVec3> {
        let frame = self.frame.as_ref()?;
        let view = frame.camera.view(self.size).ok()?;
        Probe::picked(&frame.picture, &view, cursor)
    }

    /// Draws clips, and the points that were picked, over the picture.
    fn draw_over(&mut self, ui: &Ui, area: Rect, scale: f32) {
        let Some(scene_view) = &self.scene_view else { return };
        let Ok(view) = scene_view.orbit.camera().view(self.size) else { return };
        let screen = Screen { view, area, scale };
        self.draw_measured(ui, &screen);
        let mut clips = self.document.scene().picture.clips.clone();
        let (true, Some(bounds), false) =
            (self.panels.shows_handles, self.panels.bounds, clips.is_empty())
        else {
            return;
        };
        let moved = handles::show(ui, &screen, &bounds, &mut clips);
        if moved == Moved::Begun {
            self.panels.before_drag = Some(self.document.scene().clone());
        }
        self.document.adjust(|scene| scene.picture.clips = clips);
        if moved == Moved::Ended
            && let Some(before) = self.panels.before_drag.take()
        {
            self.document.keep(before);
        }
    }

    /// Draws the points that were picked, and the distance between them.
    fn draw_measured(&self, ui: &Ui, screen: &Screen) {
        let (Some(scene_view), false) = (&self.scene_view, self.measured.is_empty()) else {
            return;
        };
        let points: Vec<Pos2> =
            self.measured.iter().filter_map(|point| screen.place(*point)).collect();
        let ink = Color32::from_rgb(255, 210, 60);
        for point in &points {
            ui.painter().circle_stroke(*point, 4.0, egui::Stroke::new(1.5, ink));
        }
        if let ([a, b], [first, second]) = (&points[..], &self.measured[..]) {
            ui.painter().line_segment([*a, *b], egui::Stroke::new(1.5, ink));
            let unit = &scene_view.stage.loaded.captions.length;
            let text = format!("{:.4} {unit}", (*second - *first).length());
            let at = a.lerp(*b, 0.5);
            let font = FontId::proportional(14.0);
            let back = ui.painter().text(at, Align2::CENTER_BOTTOM, &text, font.clone(), ink);
            ui.painter().rect_filled(back.expand(3.0), 3.0, Color32::from_black_alpha(170));
            ui.painter().text(at, Align2::CENTER_BOTTOM, text, font, ink);
        }
    }

    /// Loads, draws and saves what has changed.
    fn refresh(&mut self) {
        self.take_loaded();
        self.start_loading();
        if let Some(error) = self.painter.take_error() {
            self.save_to = None;
            self.say(error, true);
        }
        if let Err(message) = self.order() {
            self.say(message, true);
        }
        self.take_film();
        self.save_if_exact();
    }

    fn start_loading(&mut self) {
        let wanted = self.document.loaded_by();
        if self.loaded_by.as_ref() == Some(&wanted) {
            return;
        }
        self.loading = None;
        self.loaded_by = Some(wanted.clone());
        if wanted.0.inputs.is_empty() {
            self.clear();
            return;
        }
        let repaint = self.context.clone();
        let job = self.document.job(self.size).map_err(|failure| text_of(&failure));
        let started = job.and_then(|job| {
            Loading::start(job, move || repaint.request_repaint()).map_err(|e| e.to_string())
        });
        match started {
            Ok(loading) => self.loading = Some(loading),
            Err(message) => {
                self.give_up();
                self.say(message, true);
            }
        }
    }

    /// Shows nothing.
    fn clear(&mut self) {
        (self.scene_view, self.frame, self.set_for, self.ordered) = (None, None, None, None);
        self.canvas.clear();
        self.painter.clear();
    }

    fn take_loaded(&mut self) {
        let Some(loading) = &self.loading else { return };
        let Some(result) = loading.take() else {
            // The bar moves.
            self.context.request_repaint_after(std::time::Duration::from_millis(100));
            return;
        };
        let notes = loading.take_notes();
        let seconds = loading.since.elapsed().as_secs_f64();
        self.loading = None;
        notes.into_iter().for_each(|note| self.say(note, false));
        match result {
            Ok(stage) => {
                self.say(format!("loaded in {seconds:.1} s"), false);
                self.show(stage);
            }
            Err(message) => {
                self.give_up();
                self.say(message, true);
            }
        }
    }

    /// Shows a loaded scene.
    fn show(&mut self, stage: Stage) {
        let made = self.document.job(self.size).and_then(|job| {
            let settings = job.settings(&stage.loaded)?;
            let finish = job.finish(&stage.loaded)?;
            let camera = job.camera(&stage.loaded, &settings, &finish)?;
            let up = job.up(&stage.loaded)?;
            Ok((settings, finish, camera, up))
        });
        let made = made.map_err(|failure| text_of(&failure));
        let (settings, finish, camera, up) = match made {
            Ok(made) => made,
            Err(message) => return self.say(message, true),
        };
        self.document.take_clips(&settings.clips);
        self.loaded_by = Some(self.document.loaded_by());
        let size = stage.loaded.subject.bounds.diagonal();
        let loaded_transfers = stage.transfers();
        // An input may have become several items.
        let names = stage.loaded.items.contents.iter().map(|content| &content.name.text);
        let inputs = names.map(PathBuf::from).collect();
        let field = loaded_transfers.first().map_or(0, |(item, _)| *item);
        self.panels.scene_changed(&stage);
        self.scene_view = Some(SceneView {
            stage: Arc::new(stage),
            orbit: Orbit::new(camera, up, size),
            settings,
            finish: Arc::new(finish),
            inputs,
            loaded_transfers,
            field,
        });
        (self.set_for, self.ordered) = (None, None);
        self.measured.clear();
    }

    /// Makes the settings anew if they changed, and orders a picture if anything did.
    fn order(&mut self) -> Result<(), String> {
        if self.scene_view.is_none() || self.size.contains(&0) {
            return Ok(());
        }
        let mut scene = self.document.scene().clone();
        let is_fitted = scene.camera.is_none();
        (scene.camera, scene.appearance.transfer) = (None, None);
        scene.inputs.iter_mut().for_each(|input| input.appearance.transfer = None);
        let shows_bars = scene.overlay.scalar_bar;
        let bars = if shows_bars { self.edited_transfers() } else { Vec::new() };
        let Some(scene_view) = &mut self.scene_view else { return Ok(()) };
        // A fitted camera follows from the settings.
        let wanted = SetFor { scene, size: self.size, is_fitted, bars: bars.clone() };
        let is_set = self.set_for.as_ref() == Some(&wanted);
        if !is_set {
            self.set_for = Some(wanted);
            let job = self.document.job(self.size).map_err(|failure| text_of(&failure))?;
            let loaded = &scene_view.stage.loaded;
            scene_view.settings = job.settings(loaded).map_err(|error| error.to_string())?;
            let finish = match &bars[..] {
                [] => job.finish(loaded),
                bars => job.finish_with(loaded, bars),
            };
            scene_view.finish = Arc::new(finish.map_err(|failure| text_of(&failure))?);
            let camera = job.camera(loaded, &scene_view.settings, &scene_view.finish);
            scene_view.orbit.set_camera(camera.map_err(|error| error.to_string())?);
        } else if let Some(camera) = &self.document.scene().camera {
            scene_view.orbit.set_camera(camera.camera()?);
        }
        if is_set && self.ordered.as_ref() == Some(self.document.scene()) {
            return Ok(());
        }
        self.ordered = Some(self.document.scene().clone());
        let transfers = self.transfers();
        let Some(scene_view) = &self.scene_view else { return Ok(()) };
        self.last_order = self.painter.order(Order {
            stage: Arc::clone(&scene_view.stage),
            camera: scene_view.orbit.camera().clone(),
            settings: scene_view.settings.clone(),
            finish: Arc::clone(&scene_view.finish),
            transfers,
        });
        Ok(())
    }

    fn take_frame(&mut self) {
        let (Some(frame), Some(scene_view)) = (self.painter.take_frame(), &self.scene_view) else {
            return;
        };
        // Where the picture is transparent, the window is black.
        let background = scene_view.finish.background.unwrap_or_default();
        let size = [frame.picture.width, frame.picture.height];
        let bytes = frame.picture.to_rgba8(Some(background));
        self.canvas.set(&self.context, size, &bytes, frame.is_exact());
        self.delay = frame.ordered.elapsed().as_secs_f64() * 1e3;
        // tools/window reads this line.
        tracing::debug!(
            number = frame.number,
            pixel = frame.effort.pixel,
            drawn_in = frame.milliseconds,
            delay = self.delay,
            exact = frame.is_exact(),
            "frame"
        );
        self.frame = Some(frame);
    }

    /// Adds a clip through the middle of the scene, or removes one.
    pub fn change_clips(&mut self, change: impl FnOnce(&mut Vec<ClipEntry>)) {
        self.document.change(|scene| change(&mut scene.picture.clips));
    }
}
