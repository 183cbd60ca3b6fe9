//! Selecting, deleting what is selected, and saving what is left.

use super::Window;
use crate::view::{
    action::Select,
    outline,
    panels::selection,
    saving::Saving,
    selection::{Selected, inverted},
};
use eframe::egui::Ui;
use splatkit::{
    edit::{Edit, Sight},
    formats::Kind,
    glam::DVec2,
    scene::Settings,
    session::{Description, EditEntry, convert::Conversion},
};
use std::path::{Path, PathBuf};

/// How much deeper than what is seen an outline selects, as a share of the scene's diagonal.
const DEEPER: f64 = 0.02;
/// The same in sheets of a picture of surfaces.
const SHEETS: f64 = 2.0;

impl Window {
    /// Does what a user asks for of the selection.
    pub(super) fn select(&mut self, select: Select) {
        match select {
            Select::Tool(tool) => {
                self.selection.tool = tool;
                self.measures = false;
            }
            Select::Mode(mode) => self.selection.mode = mode,
            Select::Near(is_near) => self.selection.is_near = is_near,
            Select::Outline(corners) => self.select_outline(&corners),
            Select::Condition(condition) => self.join(&condition),
            Select::Invert => {
                let condition = inverted(self.selection.condition.as_deref());
                self.set_selection(condition);
            }
            Select::Clear => {
                self.selection.clear();
                self.selection.tool = None;
            }
            Select::Delete => self.keep_selected(false),
            Select::Keep => self.keep_selected(true),
        }
    }

    /// Selects what an outline on the picture holds.
    fn select_outline(&mut self, corners: &[DVec2]) {
        let Some(scene_view) = &self.scene_view else { return };
        let Ok(view) = scene_view.orbit.camera().view(self.size) else { return };
        let mut depths = match view.perspective {
            true => [0.0, f64::INFINITY],
            // What is behind the point where parallel rays begin is drawn, too.
            false => [-1e3 * scene_view.stage.loaded.subject.bounds.diagonal(), f64::INFINITY],
        };
        if self.selection.is_near {
            let frame = self.frame.as_ref();
            let shown = frame.and_then(|frame| outline::depths(frame, &view, corners));
            let Some([_, far]) = shown else {
                return self.say("nothing is seen in the outline", true);
            };
            // What a picture shows may lie sheets before the points that it is of.
            let pixel = if view.perspective { far } else { 1.0 } / view.scale;
            let sheets = SHEETS * Settings::new(self.size).sheet_pixels * pixel;
            let diagonal = scene_view.stage.loaded.subject.bounds.diagonal();
            depths[1] = rounded(far + sheets.max(DEEPER * diagonal));
        }
        let mut sight = Sight::of(&view, corners, depths.map(rounded));
        for corner in &mut sight.corners {
            *corner = DVec2::new(rounded(corner.x), rounded(corner.y));
        }
        self.join(&format!("inside(\"{sight}\")"));
    }

    /// Joins a condition to the selection.
    fn join(&mut self, condition: &str) {
        let before = self.selection.condition.as_deref();
        let joined = self.selection.mode.join(before, condition);
        self.set_selection(joined);
    }

    fn set_selection(&mut self, condition: String) {
        if self.has_turned_input() {
            let message = "the inputs stand differently and one was turned, so that nothing can be \
                           selected of it: hide the others first";
            return self.say(message, true);
        }
        let before = self.selection.condition.replace(condition);
        if let Err(message) = self.find_selected() {
            self.selection.condition = before;
            self.say(message, true);
        }
    }

    /// Whether an input does not lie where its file and the description say.
    fn has_turned_input(&self) -> bool {
        let warnings = self.scene_view.as_ref().map(|view| &view.stage.loaded.warnings);
        warnings.is_some_and(|all| all.iter().any(|warning| warning.contains(" is turned: ")))
    }

    /// Starts to find what the selection holds of the scene that is shown.
    pub(super) fn find_selected(&mut self) -> Result<(), String> {
        let Some(scene) = self.selectable() else {
            let message = "points, meshes and trained Gaussians in files of their own can be \
                           selected of; splatkit convert edits hierarchies";
            return Err(message.into());
        };
        let repaint = self.context.clone();
        let loaded_by = self.document.loaded_by();
        self.selection.find((scene, loaded_by), move || repaint.request_repaint())
    }

    /// Returns the scene of the inputs that can be selected of.
    fn selectable(&self) -> Option<Description> {
        let loaded = &self.scene_view.as_ref()?.stage.loaded.inputs;
        let mut scene = self.document.scene().clone();
        scene.inputs.retain(|input| {
            let kind = loaded.iter().find(|other| other.file == input.file).map(|one| one.kind);
            input.visible && matches!(kind, Some(Kind::Mesh | Kind::Gaussians))
        });
        (!scene.inputs.is_empty()).then_some(scene)
    }

    /// Takes what was found of the selection.
    pub(super) fn take_selected(&mut self) {
        match self.selection.take() {
            Some(Err(message)) => {
                self.selection.clear();
                self.say(message, true);
            }
            Some(Ok(())) => {
                let [some, all] = self.selection.selected.as_ref().map_or([0, 0], Selected::counts);
                self.say(format!("{some} of {all} are selected"), false);
            }
            None => {}
        }
        if let Some(saving) = &self.saving
            && let Some(result) = saving.take()
        {
            let name = saving.output.display().to_string();
            self.saving = None;
            match result {
                Ok(()) => self.say(format!("{name}: saved"), false),
                Err(message) => self.say(message, true),
            }
        }
    }

    /// Keeps what is selected, or deletes it. Inputs of which nothing is left are hidden.
    fn keep_selected(&mut self, keeps: bool) {
        let (Some(condition), Some(selected)) =
            (self.selection.condition.clone(), self.selection.selected.take())
        else {
            if self.selection.finding.is_some() {
                self.say("the selection is still being made", false);
            }
            return;
        };
        let kept = if keeps { condition } else { inverted(Some(&condition)) };
        let entry = match EditEntry::parse(&format!("where:{kept}")) {
            Ok(entry) => entry,
            Err(message) => return self.say(message, true),
        };
        let left = |some: u64, all: u64| if keeps { some } else { all - some };
        let changed = |file: &PathBuf| selected.inputs.iter().find(|input| input.0 == *file);
        let is_left = |input: &splatkit::session::InputEntry| {
            input.visible && changed(&input.file).is_none_or(|(_, some, all)| left(*some, *all) > 0)
        };
        if !self.document.scene().inputs.iter().any(is_left) {
            self.selection.selected = Some(selected);
            return self.say("nothing would be left of the scene", true);
        }
        self.document.change(|scene| {
            for input in scene.inputs.iter_mut().filter(|input| input.visible) {
                let Some((_, some, all)) = changed(&input.file) else { continue };
                match left(*some, *all) {
                    0 => input.visible = false,
                    left if left < *all => input.edits.push(entry.clone()),
                    _ => {}
                }
            }
        });
        self.selection.clear();
    }

    /// Starts to write an input as it is edited and moved.
    pub fn save_edited(&mut self, number: usize, output: &Path) {
        let scene = self.document.scene();
        let Some(input) = scene.inputs.get(number) else { return };
        let motion = input.transform.motion().map(Edit::Move);
        let edits = input.edits.iter().map(|entry| entry.edit().clone());
        let conversion = Conversion {
            reading: scene.reading_of(input).reading(),
            up: scene
                .framing
                .up
                .or(motion.as_ref().and(self.scene_view.as_ref()).map(|scene_view| scene_view.up)),
            edits: motion.into_iter().chain(edits).collect(),
            ..Conversion::default()
        };
        let (file, repaint) = (input.file.clone(), self.context.clone());
        match Saving::start(conversion, file, output, move || repaint.request_repaint()) {
            Ok(saving) => self.saving = Some(saving),
            Err(message) => self.say(message, true),
        }
    }

    /// Shows the panel of the selection.
    pub(super) fn selection(&mut self, ui: &mut Ui) -> Vec<crate::view::action::Action> {
        let Some(scene_view) = &self.scene_view else { return Vec::new() };
        let loaded = &scene_view.stage.loaded;
        let mut names: Vec<String> = ["x", "y", "z", "height"].map(str::to_owned).to_vec();
        for input in &loaded.inputs {
            let more: Vec<String> = match input.kind {
                Kind::Gaussians => {
                    ["opacity", "scale", "red", "green", "blue"].map(str::to_owned).to_vec()
                }
                _ => input.attributes.clone(),
            };
            names.extend(more);
        }
        let model = selection::Selection {
            scene: self.document.scene(),
            tool: self.selection.tool,
            mode: self.selection.mode,
            is_near: self.selection.is_near,
            condition: self.selection.condition.as_deref(),
            counts: self.selection.selected.as_ref().map(Selected::counts),
            names,
            bounds: loaded.subject.bounds,
        };
        selection::show(ui, &model, &mut self.selection.form)
    }
}

/// Returns a number with as many digits as a pixel needs.
fn rounded(number: f64) -> f64 {
    format!("{}", number as f32).parse().unwrap_or(number)
}
