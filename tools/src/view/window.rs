//! The window: the state of what is shown. Panels and the hand return actions, which change it.

mod apply;
mod drawing;
mod files;
mod select;
mod side;

use super::{
    action::{Action, Purpose},
    canvas::Canvas,
    choices::Choices,
    curve::CurveEditor,
    dialogs::Dialogs,
    document::{Document, LoadedBy},
    export::Exporting,
    hand::{self, Hand, Picture},
    keys,
    loader::Loading,
    painter::{Frame, Painter},
    panels::{flight::Player, menu},
    recent::Recent,
    saving::Saving,
    scene_view::SceneView,
    selection::Selection,
    slices::SlicePanes,
};
use eframe::{
    egui::{CentralPanel, Context, Panel, ScrollArea, Ui, ViewportCommand},
    egui_wgpu::RenderState,
};
use glam::DVec3;
use splatkit::{
    interaction::Probe, math::Keyframe, session::Description, volume::TransferFunction,
};
use std::path::PathBuf;

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

/// What the window has from the system: the list of recent files, and dialogs.
pub struct Surroundings {
    pub recent: Recent,
    pub dialogs: Dialogs,
}

/// Which parts of the window are shown.
pub struct Parts {
    pub side: bool,
    pub slices: bool,
    pub help: bool,
    /// Whether clips have handles in the picture.
    pub handles: bool,
}

/// The window's state.
pub struct Window {
    pub document: Document,
    pub scene_view: Option<SceneView>,
    /// Whether clicks measure, and the points that were picked, in world units.
    pub measures: bool,
    pub measured: Vec<DVec3>,
    pub selection: Selection,
    /// The edited input that is being written.
    pub saving: Option<Saving>,
    /// The last frame.
    pub frame: Option<Frame>,
    canvas: Canvas,
    /// How long after its order the last frame was here, in milliseconds.
    delay: f64,
    /// Messages, the newest last, and whether each is an error.
    pub messages: Vec<(String, bool)>,
    pub parts: Parts,
    hand: Hand,
    curve: CurveEditor,
    pub slices: SlicePanes,
    /// The keyframes of the camera's path.
    pub keyframes: Vec<Keyframe>,
    pub player: Player,
    /// The film or the figure that is being written.
    pub exporting: Option<Exporting>,
    pub choices: Choices,
    pub surroundings: Surroundings,
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
    save_to: Option<PathBuf>,
    title: String,
    context: Context,
}

impl Window {
    /// `state`: the window's device, if it has one.
    pub fn new(
        document: Document,
        surroundings: Surroundings,
        context: &Context,
        state: Option<&RenderState>,
    ) -> std::io::Result<Self> {
        let repaint = context.clone();
        let mut window = Self {
            document,
            scene_view: None,
            measures: false,
            measured: Vec::new(),
            selection: Selection::default(),
            saving: None,
            frame: None,
            canvas: Canvas::new(state),
            delay: 0.0,
            messages: Vec::new(),
            parts: Parts { side: true, slices: false, help: false, handles: true },
            hand: Hand::default(),
            curve: CurveEditor::new(1.0),
            slices: SlicePanes::default(),
            keyframes: Vec::new(),
            player: Player::default(),
            exporting: None,
            choices: Choices::default(),
            surroundings,
            painter: Painter::start(move || repaint.request_repaint())?,
            loading: None,
            loaded_by: None,
            set_for: None,
            ordered: None,
            last_order: 0,
            size: [0; 2],
            save_to: None,
            title: String::new(),
            context: context.clone(),
        };
        window.say_views();
        Ok(window)
    }

    /// Shows the whole window, and does what the user asks for.
    pub fn ui(&mut self, ui: &mut Ui) {
        // Before the picture is painted, so that a frame is seen at once.
        self.take_frame();
        self.choices.take();
        let mut actions = dropped(ui);
        actions.extend(keys::take(ui));
        let top = Panel::top("menu").show(ui, |ui| menu::menu(ui, &self.menu()));
        actions.extend(top.inner);
        Panel::bottom("status").show(ui, |ui| menu::status(ui, &self.status()));
        if self.parts.side {
            Panel::right("side").default_size(330.0).show(ui, |ui| {
                let area = ScrollArea::vertical().auto_shrink([false, true]);
                area.show(ui, |ui| self.side(ui, &mut actions));
            });
        }
        if self.parts.slices {
            Panel::left("slices").default_size(280.0).show(ui, |ui| self.slices(ui));
        }
        CentralPanel::no_frame().show(ui, |ui| {
            let (picture, hand) = self.picture();
            let (size, asked) = hand::show(ui, &picture, hand);
            self.size = size;
            actions.extend(asked);
        });
        actions.extend(self.surroundings.dialogs.show(ui));
        actions.extend(menu::help(ui, self.parts.help));
        if !actions.is_empty() {
            // What the actions change is shown in the next frame.
            self.context.request_repaint();
        }
        actions.into_iter().for_each(|action| self.apply(action));
        // A step of the hand ends when it lets go.
        if !ui.input(|input| input.pointer.any_down()) {
            self.document.end_step();
        }
        self.refresh();
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
        self.take_selected();
        self.save_if_exact();
        let title = self.document.title();
        if title != self.title {
            self.context.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    /// Whether the exact picture of the current scene is shown.
    pub fn rests(&self) -> bool {
        let is_exact = self
            .frame
            .as_ref()
            .is_some_and(|frame| frame.is_exact() && frame.number == self.last_order);
        let is_busy = self.loading.is_some() || self.selection.finding.is_some();
        !is_busy && (self.scene_view.is_none() || is_exact)
    }

    pub fn say(&mut self, text: impl Into<String>, is_error: bool) {
        const MOST: usize = 100;
        self.messages.push((text.into(), is_error));
        let surplus = self.messages.len().saturating_sub(MOST);
        self.messages.drain(..surplus);
    }

    /// Returns the transfer function that is edited, if the scene has a field.
    pub fn transfer(&self) -> Option<TransferFunction> {
        let scene_view = self.scene_view.as_ref()?;
        scene_view.transfer_of(&self.document, scene_view.field)
    }

    /// Sets the transfer function that is edited, as a part of a step.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) {
        let Some(scene_view) = &mut self.scene_view else { return };
        self.document.drag(|_| {});
        scene_view.set_transfer(&mut self.document, transfer);
        // What was loaded stays loaded.
        if self.loading.is_none() {
            scene_view.loaded_by = self.document.loaded_by();
            self.loaded_by = Some(scene_view.loaded_by.clone());
        }
    }

    fn menu(&self) -> menu::Menu<'_> {
        let step = |loading: &Loading| {
            let (name, share) = loading.step();
            (name, share, loading.since.elapsed().as_secs_f32())
        };
        menu::Menu {
            recent: self.surroundings.recent.files(),
            views: self.document.views(),
            can_undo: self.document.can_undo(),
            can_redo: self.document.can_redo(),
            measures: self.measures,
            shows_side: self.parts.side,
            shows_slices: self.parts.slices,
            loading: self.loading.as_ref().map(step),
        }
    }

    fn status(&self) -> menu::Status<'_> {
        let value = |point: DVec3| {
            let scene_view = self.scene_view.as_ref()?;
            Probe::new(&scene_view.stage.loaded.scene).value_at(point)
        };
        menu::Status {
            under_cursor: self.hand.under_cursor.map(|point| (point, value(point))),
            frame: self.frame.as_ref().map(|frame| (self.rests(), frame.milliseconds)),
            message: self.messages.last(),
        }
    }

    /// Returns what the picture shows, and the hand in it.
    fn picture(&mut self) -> (Picture<'_>, &mut Hand) {
        let picture = Picture {
            canvas: &self.canvas,
            scene_view: self.scene_view.as_ref(),
            frame: self.frame.as_ref(),
            measures: self.measures,
            measured: &self.measured,
            tool: self.selection.tool,
            selected: self.selection.selected.as_ref(),
            clips: &self.document.scene().picture.clips,
            has_handles: self.parts.handles,
            is_loading: self.loading.is_some(),
        };
        (picture, &mut self.hand)
    }
}

/// Returns the files that were dropped onto the window, to be opened.
fn dropped(ui: &Ui) -> Vec<Action> {
    let dropped = ui.input(|input| input.raw.dropped_files.clone());
    let files: Vec<PathBuf> = dropped.into_iter().map(|file| file.path().to_owned()).collect();
    if files.is_empty() { Vec::new() } else { vec![Action::Chosen(Purpose::Open, files)] }
}
