//! What a window shows, as a scene file that changes, with its history.

use crate::{Command, Task, failure::Failure, given::Given, render::Render, scene_file};
use clap::{ArgAction, ArgMatches, CommandFactory, FromArgMatches};
use serde_json::{Map, Value};
use splatkit::{
    interaction::{CameraEntry, InputEntry, SceneFile},
    scene::Clip,
    volume::TransferFunction,
};
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

/// Options that change how a loaded scene is drawn. All others change what is loaded.
const LOOK: &[&str] = &[
    "background",
    "samples",
    "shade",
    "no-shade",
    "sheet-thickness",
    "cut",
    "budget",
    "optics",
    "axes",
    "scale-bar",
    "scalar-bar",
    "caption",
];
/// Options of the transfer function, which an edited one replaces.
const OF_TRANSFER: &[&str] = &["range", "opacity-unit", "iso", "gradient-opacity"];
/// Most steps that can be undone.
const MOST_STEPS: usize = 200;

/// What decides what is loaded: the inputs and the options.
pub type LoadedBy = (Vec<InputEntry>, Map<String, Value>);

/// A scene file that changes, with its history.
pub struct Document {
    now: SceneFile,
    undone: Vec<SceneFile>,
    done: Vec<SceneFile>,
    /// Clips in shares of the scene, until it is loaded.
    pending: Vec<OsString>,
    /// The file that the scene was read from or saved to.
    pub path: Option<PathBuf>,
    /// Whether scene files may name files outside their folders, and addresses.
    pub is_trusting: bool,
}

impl Document {
    pub fn new(now: SceneFile) -> Self {
        let (undone, done, pending) = (Vec::new(), Vec::new(), Vec::new());
        Self { now, undone, done, pending, path: None, is_trusting: false }
    }

    /// Takes the inputs and flags of a command line. `task` is its subcommand.
    pub fn of_command(matches: &ArgMatches, task: &str) -> Result<Self, Failure> {
        let inputs = matches.get_many::<PathBuf>("inputs").into_iter().flatten().cloned();
        let mut document = Self::new(SceneFile::new(inputs));
        let command = Command::command();
        let Some(own) = command.find_subcommand(task) else { return Ok(document) };
        let given =
            |id: &&str| matches.value_source(id) == Some(clap::parser::ValueSource::CommandLine);
        for id in matches.ids().map(clap::Id::as_str).filter(given) {
            let flag = own.get_arguments().find(|flag| flag.get_id() == id);
            let Some((flag, name)) = flag.and_then(|flag| Some((flag, flag.get_long()?))) else {
                continue;
            };
            let is_switch = matches!(flag.get_action(), ArgAction::SetTrue);
            let values: Vec<String> = matches
                .get_raw(id)
                .into_iter()
                .flatten()
                .map(|value| value.to_string_lossy().into_owned())
                .collect();
            document.take_flag(name, is_switch, values)?;
        }
        Ok(document)
    }

    fn take_flag(
        &mut self,
        name: &str,
        is_switch: bool,
        values: Vec<String>,
    ) -> Result<(), Failure> {
        let first = values.first().cloned().unwrap_or_default();
        match name {
            "size" => self.now.size = crate::parse::size(&first).ok(),
            "camera" => self.now.camera = serde_json::from_str(&first).ok(),
            "clip" | "cut-out" => {
                let flags = values.iter().map(|value| format!("--{name}={value}").into());
                self.pending.extend(flags);
            }
            "quiet" | "verbose" | "threads" | "cache" | "cache-size" | "allow-host" => {}
            "trust-scene" => self.is_trusting = true,
            "color" | "opacity" | "transfer" | "range" | "iso" => self.take_own(name, values),
            _ if scene_file::is_option(name) => {
                let value = match &values[..] {
                    _ if is_switch => Value::Bool(true),
                    [one] => Value::String(one.clone()),
                    many => many.iter().cloned().map(Value::String).collect(),
                };
                self.now.options.insert(name.to_owned(), value);
            }
            _ => {
                return Err(Failure::Usage(format!(
                    "--{name} is for `splatkit render`; the window saves pictures itself"
                )));
            }
        }
        Ok(())
    }

    /// Takes values of which each may be that of one input: `FILE=VALUE`.
    fn take_own(&mut self, name: &str, values: Vec<String>) {
        let mut rest = Vec::new();
        for value in values {
            let own = value.rsplit_once('=').and_then(|(file, own)| {
                let input = self.now.inputs.iter_mut().find(|i| i.file == Path::new(file))?;
                Some((input, own))
            });
            match own {
                Some((input, own)) => set_own(input, name, own),
                None if name == "transfer" => self.now.transfer = Some(transfer_entry(&value)),
                None => rest.push(Value::String(value)),
            }
        }
        match (name, rest.len()) {
            (_, 0) => {}
            // A single one is edited as a text.
            ("range" | "iso", 1) => {
                self.now.options.extend(rest.pop().map(|one| (name.to_owned(), one)));
            }
            _ => drop(self.now.options.insert(name.to_owned(), Value::Array(rest))),
        }
    }

    pub fn scene(&self) -> &SceneFile {
        &self.now
    }

    /// Changes the scene as one step that can be undone.
    pub fn change(&mut self, change: impl FnOnce(&mut SceneFile)) {
        let before = self.now.clone();
        change(&mut self.now);
        self.keep(before);
    }

    /// Changes the scene without a step: the camera, and what changes while the hand moves.
    pub fn adjust(&mut self, change: impl FnOnce(&mut SceneFile)) {
        change(&mut self.now);
    }

    /// Makes the changes since `before` one step.
    pub fn keep(&mut self, before: SceneFile) {
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
        if let Some(before) = self.done.pop() {
            let after = self.replace(before);
            self.undone.push(after);
        }
    }

    /// Takes the step again that was last taken back.
    pub fn redo(&mut self) {
        if let Some(after) = self.undone.pop() {
            let before = self.replace(after);
            self.done.push(before);
        }
    }

    fn replace(&mut self, mut other: SceneFile) -> SceneFile {
        (other.camera, other.size) = (self.now.camera, self.now.size);
        std::mem::replace(&mut self.now, other)
    }

    /// Sets the camera, which then replaces all flags of the camera.
    pub fn set_camera(&mut self, camera: CameraEntry) {
        self.now.camera = Some(camera);
        for flag in scene_file::CAMERA {
            self.now.options.remove(*flag);
        }
    }

    /// Returns the number of an input.
    fn input_of(&self, file: &Path) -> Option<usize> {
        self.now.inputs.iter().position(|input| input.visible && input.file == file)
    }

    /// Returns the transfer function of an input, if the document has it, rather than a name or a
    /// file, or nothing.
    pub fn transfer_of(&self, file: &Path) -> Option<TransferFunction> {
        self.now.transfer_of(self.input_of(file)?).ok().flatten()
    }

    /// Sets the transfer functions of all inputs that have a field. They then replace all flags
    /// that change one.
    pub fn set_transfers(&mut self, transfers: &[(&Path, TransferFunction)], has_surfaces: bool) {
        for (file, transfer) in transfers {
            let Some(number) = self.input_of(file) else { continue };
            let input = &mut self.now.inputs[number];
            (input.transfer, input.range, input.iso) = (None, None, None);
            match transfers.len() {
                1 => self.now.set_transfer(transfer),
                _ => self.now.set_transfer_of(number, transfer),
            }
        }
        for flag in OF_TRANSFER {
            self.now.options.remove(*flag);
        }
        // The map also colours surfaces.
        if !has_surfaces {
            self.now.options.remove("color");
        }
    }

    /// Takes the clips of the loaded scene, in world units.
    pub fn take_clips(&mut self, clips: &[Clip]) {
        self.pending.clear();
        self.now.clips = clips.iter().map(Into::into).collect();
    }

    /// Returns the options and inputs that decide what is loaded. Scenes for which they are equal
    /// need not be loaded again.
    pub fn loaded_by(&self) -> LoadedBy {
        let inputs = self.now.inputs.iter().filter(|input| input.visible).cloned();
        let inputs = inputs.map(|mut input| {
            // An edited transfer function needs no loading; a file or a name does.
            input.transfer.take_if(|transfer| !transfer.is_string());
            input
        });
        let mut options = self.now.options.clone();
        options.retain(|name, _| {
            !(LOOK.contains(&name.as_str()) || scene_file::CAMERA.contains(&name.as_str()))
        });
        if let Some(Value::String(name)) = &self.now.transfer {
            options.insert("transfer".into(), name.clone().into());
        }
        (inputs.collect(), options)
    }

    /// Returns the command that draws this scene.
    pub fn render(&self) -> Result<(Given, Render), Failure> {
        self.render_of(&self.now, &[])
    }

    /// Returns the command that draws a film of this scene, whose camera follows a path. Existing
    /// files are replaced.
    pub fn render_of_film(&self, size: [u32; 2]) -> Result<Render, Failure> {
        let mut scene = self.now.clone();
        (scene.camera, scene.size) = (None, Some(size));
        scene_file::CAMERA.iter().for_each(|flag| drop(scene.options.remove(*flag)));
        Ok(self.render_of(&scene, &["--overwrite"])?.1)
    }

    fn render_of(&self, scene: &SceneFile, more: &[&str]) -> Result<(Given, Render), Failure> {
        let command = Command::command();
        let path = self.path.clone().unwrap_or_default();
        let given = Given::default();
        let flags = scene_file::flags(scene, &path, &command, "render", &given)?;
        let words = ["splatkit".into(), "render".into()].into_iter();
        let more = more.iter().map(OsString::from);
        let words = words.chain(more).chain(self.pending.iter().cloned()).chain(flags);
        let matches = command.try_get_matches_from(words).map_err(usage)?;
        match Command::from_arg_matches(&matches).map_err(usage)?.task {
            Task::Render(render) => Ok((Given::of(&matches), *render)),
            _ => Err(Failure::Usage("this is not a scene".into())),
        }
    }

    /// Returns the command that draws this scene, for a shell.
    pub fn command_line(&self) -> Result<String, Failure> {
        scene_file::command_line(&self.now, &Command::command())
    }

    /// Saves the scene, and remembers the file.
    pub fn save(&mut self, path: &Path) -> splatkit::Result<()> {
        let mut scene = self.now.clone();
        // The next user decides what may be taken.
        scene.options.retain(|name, _| !scene_file::is_limit(name));
        scene.write(path)?;
        self.path = Some(path.to_owned());
        Ok(())
    }
}

/// Sets a value that an input has of its own.
fn set_own(input: &mut InputEntry, name: &str, value: &str) {
    match name {
        "color" => input.color = Some(value.to_owned()),
        "opacity" => input.opacity = value.parse().ok(),
        "transfer" => input.transfer = Some(transfer_entry(value)),
        "range" => input.range = crate::parse::range(value).ok(),
        _ => {
            // Several lists are one.
            let before = input.iso.take().map_or(String::new(), |before| format!("{before},"));
            input.iso = Some(before + value);
        }
    }
}

/// Returns a transfer function of a flag as scene files have it.
fn transfer_entry(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()))
}

/// Returns the first line of what clap says about arguments.
fn usage(error: clap::Error) -> Failure {
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default();
    Failure::Usage(line.strip_prefix("error: ").unwrap_or(line).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document(words: &str) -> Result<Document, Failure> {
        let words = words.split(' ').map(OsString::from);
        let matches = Command::command().try_get_matches_from(words).expect("arguments");
        let (task, own) = matches.subcommand().expect("a task");
        Document::of_command(own, task)
    }

    #[test]
    fn flags_become_a_scene_and_a_scene_a_command() {
        let document = document(
            "splatkit view a.nrrd b.ply --iso 1,2:red --no-shade --size 64x48 --clip x<50% \
             --azimuth 20",
        )
        .expect("a document");
        let scene = document.scene();
        assert_eq!((scene.size, scene.inputs.len()), (Some([64, 48]), 2));
        assert_eq!(scene.options["iso"], serde_json::json!("1,2:red"));
        assert!(document.render().is_ok());
        let line = document.command_line().expect("a command");
        assert!(line.starts_with("splatkit render ") && line.contains("--no-shade"), "{line}");
    }

    #[test]
    fn each_field_keeps_its_own_transfer_function() {
        let mut document = document(
            "splatkit view a.ply b.nrrd c.nrrd --transfer c.nrrd=mri --iso b.nrrd=1,2 \
             --iso b.nrrd=3 --range b.nrrd=0,9 --iso 7",
        )
        .expect("a document");
        let [_, b, c] = &document.scene().inputs[..] else { panic!("three inputs") };
        assert_eq!((b.iso.as_deref(), b.range), (Some("1,2,3"), Some([0.0, 9.0])));
        assert_eq!(c.transfer, Some(Value::String("mri".into())));
        assert!(document.render().is_ok());
        let transfer = |value: f64| TransferFunction {
            opacity: vec![(value, 0.5)],
            ..TransferFunction::default()
        };
        let [a, b, c] = ["a.ply", "b.nrrd", "c.nrrd"].map(Path::new);
        assert_eq!(document.transfer_of(c), None);
        document.set_transfers(&[(b, transfer(1.0)), (c, transfer(2.0))], true);
        let scene = document.scene();
        let found = [a, b, c].map(|file| document.transfer_of(file));
        assert_eq!(found, [None, Some(transfer(1.0)), Some(transfer(2.0))]);
        assert!(scene.inputs[1].iso.is_none() && !scene.options.contains_key("iso"));
        assert!(document.render().is_ok());
    }

    #[test]
    fn flags_of_files_are_refused() {
        assert!(document("splatkit view a.ply -o x.png").is_err());
    }

    #[test]
    fn steps_are_undone_and_redone() {
        let mut document = Document::new(SceneFile::new(["a.ply".into()]));
        document.change(|scene| scene.inputs[0].visible = false);
        document.change(|_| {});
        document.adjust(|scene| scene.size = Some([9, 9]));
        assert!(document.can_undo() && !document.can_redo());
        document.undo();
        assert!(document.scene().inputs[0].visible && !document.can_undo());
        assert_eq!(document.scene().size, Some([9, 9]), "the size stays");
        document.redo();
        assert!(!document.scene().inputs[0].visible);
    }

    #[test]
    fn only_what_is_read_is_loaded_again() {
        let mut document = Document::new(SceneFile::new(["a.nrrd".into()]));
        let before = document.loaded_by();
        document.change(|scene| {
            scene.options.insert("background".into(), "white".into());
        });
        document.set_transfers(&[(Path::new("a.nrrd"), TransferFunction::default())], false);
        assert_eq!(document.loaded_by(), before);
        document.change(|scene| {
            scene.options.insert("sharp".into(), true.into());
        });
        assert_ne!(document.loaded_by(), before);
    }
}
