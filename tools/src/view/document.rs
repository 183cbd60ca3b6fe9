//! What a window shows, as a description that changes, with its history.

use crate::{
    engine::DeviceFlags,
    failure::Failure,
    given::Given,
    job::Job,
    view::words::{quoted, words_of},
};
use splatkit::{
    scene::Clip,
    session::{
        CameraEntry, ChannelEntry, ChannelName, Description, Framing, InputEntry, OverlayEntry,
        PictureEntry, TransferEntry,
    },
    volume::TransferFunction,
};
use std::path::{Path, PathBuf};

/// Most steps that can be undone.
const MOST_STEPS: usize = 200;

/// What decides what is loaded: a description without all else, and whether its pictures can show
/// facets.
pub type LoadedBy = (Description, bool);

/// A description that changes, with its history.
pub struct Document {
    now: Description,
    undone: Vec<Description>,
    done: Vec<Description>,
    /// The scene before the step that the hand is making.
    begun: Option<Description>,
    /// What draws, apart from the engine, which the description names.
    device: DeviceFlags,
    /// The file that the scene was read from or saved to.
    pub path: Option<PathBuf>,
    /// Whether scene files may name files outside their folders, and addresses.
    pub is_trusting: bool,
    /// The page of the scene that was opened, if that is a figure of several views.
    figure: Option<PictureEntry>,
}

/// A field of the scene: that of an input, or of one of its channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field<'a> {
    pub file: &'a Path,
    /// The number and the name of the channel, if the input's channels are shown.
    pub channel: Option<(usize, &'a str)>,
}

/// Returns whether an entry is of the channel of this number and name.
fn is_of(entry: &ChannelEntry, (number, name): (usize, &str)) -> bool {
    match &entry.channel {
        ChannelName::Number(other) => *other == number,
        ChannelName::Name(other) => other.eq_ignore_ascii_case(name),
    }
}

impl Document {
    /// A window shows one view, whose size is its own. Several views and lengths on paper are kept
    /// for the [figure](Self::job_of_figure) alone.
    pub fn new(mut now: Description, device: DeviceFlags) -> Self {
        let picture = &mut now.picture;
        let figure = (!picture.views.is_empty()).then(|| picture.clone());
        if picture.width.is_some() || picture.height.is_some() {
            (picture.size, picture.width, picture.height) = (Some(picture.size()), None, None);
        }
        picture.views.clear();
        (picture.columns, picture.panel_labels) = (None, None);
        let (undone, done) = (Vec::new(), Vec::new());
        let (begun, path, is_trusting) = (None, None, false);
        Self { now, undone, done, begun, device, path, is_trusting, figure }
    }

    /// Shows another scene, without a history.
    pub fn open(&mut self, now: Description, path: PathBuf) {
        let is_trusting = self.is_trusting;
        *self = Self { is_trusting, path: Some(path), ..Self::new(now, self.device.clone()) };
    }

    pub fn scene(&self) -> &Description {
        &self.now
    }

    /// Returns the title of a window that shows the scene: the name of the scene file or of the
    /// first input, and the program's.
    pub fn title(&self) -> String {
        let inputs = &self.now.inputs;
        let others = if self.path.is_some() { 0 } else { inputs.len().saturating_sub(1) };
        let file = self.path.as_ref().or(inputs.first().map(|input| &input.file));
        let Some(file) = file else { return "splatkit".into() };
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
        match others {
            0 => format!("{name} — splatkit"),
            others => format!("{name} + {others} — splatkit"),
        }
    }

    /// Changes the scene as one step that can be undone.
    pub fn change(&mut self, change: impl FnOnce(&mut Description)) {
        self.end_step();
        let before = self.now.clone();
        change(&mut self.now);
        self.keep(before);
    }

    /// Changes the scene without a step: the camera, and what changes while the hand moves.
    pub fn adjust(&mut self, change: impl FnOnce(&mut Description)) {
        change(&mut self.now);
    }

    /// Changes the scene as a part of the step that the hand is making.
    pub fn drag(&mut self, change: impl FnOnce(&mut Description)) {
        self.begun.get_or_insert_with(|| self.now.clone());
        change(&mut self.now);
    }

    /// Ends the step that the hand is making. Moving the camera is no step.
    pub fn end_step(&mut self) {
        if let Some(mut before) = self.begun.take() {
            before.camera = self.now.camera;
            before.framing.clone_from(&self.now.framing);
            self.keep(before);
        }
    }

    /// Makes the changes since `before` one step.
    fn keep(&mut self, before: Description) {
        if before != self.now {
            self.done.push(before);
            self.undone.clear();
            let surplus = self.done.len().saturating_sub(MOST_STEPS);
            self.done.drain(..surplus);
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.undone.is_empty()
    }

    /// Takes the last step back. The camera and the size stay.
    pub fn undo(&mut self) {
        self.end_step();
        if let Some(before) = self.done.pop() {
            let after = self.replace(before);
            self.undone.push(after);
        }
    }

    /// Takes the step again that was last taken back.
    pub fn redo(&mut self) {
        self.end_step();
        if let Some(after) = self.undone.pop() {
            let before = self.replace(after);
            self.done.push(before);
        }
    }

    fn replace(&mut self, mut other: Description) -> Description {
        (other.camera, other.picture.size) = (self.now.camera, self.now.picture.size);
        std::mem::replace(&mut self.now, other)
    }

    /// Sets the camera, which then replaces what fits one to the scene.
    pub fn set_camera(&mut self, camera: CameraEntry) {
        self.now.camera = Some(camera);
        self.now.framing = unplaced(&self.now.framing);
    }

    /// Returns the number of an input.
    fn input_of(&self, file: &Path) -> Option<usize> {
        self.now.inputs.iter().position(|input| input.visible && input.file == file)
    }

    /// Returns whether the channels of a file that has several are shown in their colours.
    pub fn shows_channels(&self, file: &Path) -> bool {
        self.input_of(file).map(|number| &self.now.inputs[number]).is_some_and(|input| {
            let is_named = self.now.reading_of(input).scalar.is_some();
            !is_named && self.now.appearance_of(input).channels_read().is_some()
        })
    }

    /// Returns the transfer function of a field, if the document has it, rather than a name or a
    /// file, or nothing.
    pub fn transfer_of(&self, field: &Field) -> Option<TransferFunction> {
        let appearance = self.now.appearance_of(&self.now.inputs[self.input_of(field.file)?]);
        if let Some(channel) = field.channel {
            let mut channels = appearance.channels?.into_iter();
            return channels.find(|entry| is_of(entry, channel))?.transfer;
        }
        match appearance.transfer? {
            TransferEntry::Whole(transfer) => Some(transfer),
            TransferEntry::Name(_) => None,
        }
    }

    /// Sets the transfer functions of all fields. They then replace all else that changes one.
    pub fn set_transfers(&mut self, transfers: &[(Field, TransferFunction)], has_surfaces: bool) {
        for (field, transfer) in transfers {
            let Some(number) = self.input_of(field.file) else { continue };
            let mut channels = self.now.appearance_of(&self.now.inputs[number]).channels;
            let appearance = &mut self.now.inputs[number].appearance;
            (appearance.transfer, appearance.range, appearance.isosurfaces) = (None, None, None);
            (appearance.opacity_unit, appearance.gradient_opacity) = (None, None);
            if let Some(channel) = field.channel {
                let entries = channels.get_or_insert_default();
                let at = entries.iter().position(|entry| is_of(entry, channel));
                let at = at.unwrap_or_else(|| {
                    entries.push(ChannelEntry::new(&channel.0.to_string()));
                    entries.len() - 1
                });
                let named = ChannelEntry::new(&entries[at].name());
                entries[at] = ChannelEntry { transfer: Some(transfer.clone()), ..named };
                appearance.channels = channels;
                continue;
            }
            let whole = Some(TransferEntry::Whole(transfer.clone()));
            match transfers.len() {
                1 => self.now.appearance.transfer = whole,
                _ => appearance.transfer = whole,
            }
        }
        let shared = &mut self.now.appearance;
        (shared.range, shared.isosurfaces) = (None, None);
        (shared.opacity_unit, shared.gradient_opacity) = (None, None);
        // The function has the colours of the map by now. The map also colours surfaces, which keep
        // one of their own.
        let (map, log) = (shared.colormap.take(), std::mem::take(&mut shared.log_colors));
        if has_surfaces && map.is_some() {
            let is_field =
                |input: &InputEntry| transfers.iter().any(|one| one.0.file == input.file);
            for input in self.now.inputs.iter_mut().filter(|input| !is_field(input)) {
                input.appearance.colormap = input.appearance.colormap.or(map);
                input.appearance.log_colors |= log;
            }
        }
    }

    /// Takes the clips of the loaded scene, in world units.
    pub fn take_clips(&mut self, clips: &[Clip]) {
        self.now.picture.clips = clips.iter().map(Into::into).collect();
    }

    /// Returns what decides what is loaded. Scenes for which it is equal need not be loaded again.
    pub fn loaded_by(&self) -> LoadedBy {
        let mut scene = self.now.clone();
        let facets = scene.picture.draws_facets();
        scene.inputs.retain(|input| input.visible);
        // An edited transfer function needs no loading; a file or a name does.
        let of_inputs = scene.inputs.iter_mut().map(|input| &mut input.appearance);
        for appearance in of_inputs.chain([&mut scene.appearance]) {
            appearance.transfer.take_if(|transfer| matches!(transfer, TransferEntry::Whole(_)));
            for entry in appearance.channels.iter_mut().flatten() {
                entry.transfer = None;
            }
            // An edit lists the channels, which are drawn without a list too.
            appearance.channels.take_if(|channels| {
                let mut numbered = channels.iter().enumerate();
                numbered.all(|(at, entry)| *entry == ChannelEntry::new(&at.to_string()))
            });
        }
        // The way up turns what is added.
        let framing = Framing { up: scene.framing.up, ..Framing::default() };
        // What becomes of a ray decides which functions are made, and how cells are drawn.
        let picture = PictureEntry { optics: scene.picture.optics, ..PictureEntry::default() };
        let overlay = OverlayEntry::default();
        (Description { framing, camera: None, picture, overlay, ..scene }, facets)
    }

    /// Returns the job of drawing this scene with this size.
    pub fn job(&self, size: [u32; 2]) -> Result<Job, Failure> {
        let mut scene = self.now.clone();
        scene.picture.size = Some(size.map(|side| side.max(1)));
        self.job_of(scene)
    }

    /// Returns the job of drawing a film of this scene, whose camera follows a path.
    pub fn job_of_film(&self, size: [u32; 2]) -> Result<Job, Failure> {
        let mut scene = self.now.clone();
        (scene.camera, scene.picture.size) = (None, Some(size));
        scene.framing = unplaced(&scene.framing);
        self.job_of(scene)
    }

    /// Returns the number of views of the figure that was opened; 0 if the scene is of one view.
    pub fn views(&self) -> usize {
        self.figure.as_ref().map_or(0, |figure| figure.views.len())
    }

    /// Returns the job of drawing the figure that was opened, with all its views and its size, of
    /// the scene as it is now.
    pub fn job_of_figure(&self) -> Result<Job, Failure> {
        let mut scene = self.now.clone();
        scene.camera = None;
        scene.framing = unplaced(&scene.framing);
        if let Some(figure) = self.figure.clone() {
            let picture = &mut scene.picture;
            (picture.views, picture.columns) = (figure.views, figure.columns);
            (picture.panel_labels, picture.size) = (figure.panel_labels, figure.size);
            (picture.width, picture.height) = (figure.width, figure.height);
        }
        self.job_of(scene)
    }

    fn job_of(&self, scene: Description) -> Result<Job, Failure> {
        let device = self.device.of_scene(&scene);
        Job::new(scene, device, &Given::default(), None)
    }

    /// Returns the command that draws this scene, for a shell.
    pub fn command_line(&self) -> Result<String, String> {
        let words = words_of(&self.now)?;
        let words = words.iter().map(|word| quoted(word));
        let command = ["splatkit".to_owned(), "render".to_owned()].into_iter();
        Ok(command.chain(words).collect::<Vec<_>>().join(" "))
    }

    /// Saves the scene, and remembers the file.
    pub fn save(&mut self, path: &Path) -> splatkit::Result<()> {
        self.now.write(path)?;
        self.path = Some(path.to_owned());
        Ok(())
    }
}

/// Returns how a camera is fitted, without what places one.
pub fn unplaced(framing: &Framing) -> Framing {
    Framing { up: framing.up, zoom: framing.zoom, ..Framing::default() }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::{Command, Task};
    use clap::{CommandFactory, FromArgMatches};

    /// A window that saves its scene must not save a camera beside several views.
    #[test]
    fn figures_become_one_view() {
        let flags = "splatkit render a.ply --views front,left --width 2in --dpi 100 --columns 1";
        let mut document = document(flags);
        document.set_camera(CameraEntry {
            position: [0.0, 0.0, 9.0],
            focal_point: [0.0; 3],
            view_up: [0.0, 1.0, 0.0],
            view_angle: Some(30.0),
            height: None,
        });
        assert_eq!(document.scene().check(), Ok(()));
        assert_eq!(document.scene().picture.size(), [200, 400]);
        assert!(document.job([64, 48]).is_ok());
    }

    /// Returns the document of a window with these words of the command.
    pub fn document(words: &str) -> Document {
        let matches = Command::command().try_get_matches_from(words.split(' ')).expect("flags");
        let Task::Render(render) = Command::from_arg_matches(&matches).expect("a command").task
        else {
            panic!("another task");
        };
        let job = render.job(&Given::of(&matches)).expect("a job");
        Document::new(job.scene, job.device)
    }

    fn plain(inputs: &[&str]) -> Document {
        document(&format!("splatkit render {}", inputs.join(" ")))
    }

    fn of(file: &Path) -> Field<'_> {
        Field { file, channel: None }
    }

    #[test]
    fn each_channel_keeps_its_own_transfer_function() {
        let mut document = plain(&["a.tif"]);
        let file = Path::new("a.tif");
        let [first, second] =
            [(0, "DAPI"), (1, "GFP")].map(|channel| Field { file, channel: Some(channel) });
        let before = document.loaded_by();
        let transfer = TransferFunction::default();
        let all = [(first, TransferFunction { unit: 2.0, ..transfer.clone() }), (second, transfer)];
        document.set_transfers(&all, false);
        assert_eq!(
            all.map(|(field, _)| document.transfer_of(&field).expect("one").unit),
            [2.0, 1.0]
        );
        assert!(document.shows_channels(file) && document.loaded_by() == before);
        let channels = document.scene().inputs[0].appearance.channels.clone().expect("channels");
        assert_eq!(channels.iter().map(ChannelEntry::name).collect::<Vec<_>>(), ["0", "1"]);
    }

    #[test]
    fn flags_become_a_scene_and_a_scene_flags() {
        let words = "splatkit render a.nrrd b.ply --iso 1,2:red --no-shade --size 64x48 \
                     --clip x<50% --azimuth 20 --colormap viridis_r --cut 3.5 --caption hello";
        let parsed = document(words);
        let scene = parsed.scene();
        assert_eq!((scene.picture.size, scene.inputs.len()), (Some([64, 48]), 2));
        assert_eq!(scene.appearance.isosurfaces.as_ref().map(Vec::len), Some(2));
        assert!(parsed.job([9, 9]).is_ok());
        let line = parsed.command_line().expect("a command");
        assert!(line.starts_with("splatkit render ") && line.contains("--no-shade"), "{line}");
        assert_eq!(document(&line.replace('\'', "")).scene(), scene, "{line}");
    }

    #[test]
    fn each_field_keeps_its_own_transfer_function() {
        let mut document = document(
            "splatkit render a.ply b.nrrd c.nrrd --transfer c.nrrd=mri --iso b.nrrd=1,2 \
             --iso b.nrrd=3 --range b.nrrd=0,9 --iso 7",
        );
        let [_, b, c] = &document.scene().inputs[..] else { panic!("three inputs") };
        let (b, c) = (&b.appearance, &c.appearance);
        assert_eq!(b.isosurfaces.as_ref().map(Vec::len), Some(3));
        assert_eq!(b.range, Some([0.0, 9.0]));
        assert_eq!(c.transfer, Some(TransferEntry::Name("mri".into())));
        let transfer = |value: f64| TransferFunction {
            opacity: vec![(value, 0.5)],
            ..TransferFunction::default()
        };
        let [a, b, c] = ["a.ply", "b.nrrd", "c.nrrd"].map(Path::new);
        assert_eq!(document.transfer_of(&of(c)), None);
        document.set_transfers(&[(of(b), transfer(1.0)), (of(c), transfer(2.0))], true);
        let scene = document.scene();
        let transfers = [a, b, c].map(|file| document.transfer_of(&of(file)));
        assert_eq!(transfers, [None, Some(transfer(1.0)), Some(transfer(2.0))]);
        let surfaces =
            scene.inputs.iter().map(|input| &input.appearance).chain([&scene.appearance]);
        assert!(surfaces.into_iter().all(|appearance| appearance.isosurfaces.is_none()));
        assert!(document.job([9, 9]).is_ok());
    }

    /// An edited function has its own colours: a map that stayed would replace them when the saved
    /// scene is drawn.
    #[test]
    fn edited_colours_replace_the_map_of_a_field() {
        let transfer = TransferFunction::default();
        let mut alone = document("splatkit render a.nrrd --colormap hot");
        alone.set_transfers(&[(of(Path::new("a.nrrd")), transfer.clone())], false);
        assert_eq!(alone.scene().appearance.colormap, None);
        let mut both = document("splatkit render a.nrrd b.ply --colormap hot");
        both.set_transfers(&[(of(Path::new("a.nrrd")), transfer)], true);
        let scene = both.scene();
        let maps = [0, 1].map(|number| scene.appearance_of(&scene.inputs[number]).colormap);
        assert_eq!(maps.map(|map| map.map(|map| map.to_string())), [None, Some("hot".into())]);
    }

    /// What the hand changes while it moves is one step, and moving the camera is none.
    #[test]
    fn a_drag_is_one_step() {
        let mut document = plain(&["a.ply"]);
        for cut in [1.0, 2.0, 3.0] {
            document.drag(|scene| scene.picture.cut = Some(cut));
        }
        document.end_step();
        document.drag(|_| {});
        document.end_step();
        document.undo();
        assert_eq!((document.scene().picture.cut, document.can_undo()), (None, false));
    }

    #[test]
    fn titles_name_the_scene_or_its_inputs() {
        let titled = |document: &Document| document.title();
        assert_eq!(titled(&plain(&["scans/a.ply"])), "a.ply — splatkit");
        let mut document = plain(&["a.ply", "b.ply", "c.ply"]);
        assert_eq!(titled(&document), "a.ply + 2 — splatkit");
        document.path = Some("scenes/knee.json".into());
        assert_eq!(titled(&document), "knee.json — splatkit");
    }

    #[test]
    fn steps_are_undone_and_redone() {
        let mut document = plain(&["a.ply"]);
        document.change(|scene| scene.inputs[0].visible = false);
        document.change(|_| {});
        document.adjust(|scene| scene.picture.size = Some([9, 9]));
        assert!(document.can_undo() && !document.can_redo());
        document.undo();
        assert!(document.scene().inputs[0].visible && !document.can_undo());
        assert_eq!(document.scene().picture.size, Some([9, 9]), "the size stays");
        document.redo();
        assert!(!document.scene().inputs[0].visible);
    }

    #[test]
    fn only_what_is_read_is_loaded_again() {
        let mut document = plain(&["a.nrrd"]);
        let before = document.loaded_by();
        document.change(|scene| scene.picture.background = "white".parse().ok());
        document.set_transfers(&[(of(Path::new("a.nrrd")), TransferFunction::default())], false);
        assert_eq!(document.loaded_by(), before);
        document.change(|scene| scene.appearance.sharp = true);
        assert_ne!(document.loaded_by(), before);
    }
}
