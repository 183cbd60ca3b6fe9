//! Making a scene of a description.

use super::{Description, InputEntry, PictureEntry, TransferEntry};
use crate::{
    Error, Result,
    about::About,
    edit::Edit,
    formats::{Kind, Times},
    input::Parts,
    math::Camera,
    memory,
    scene::{Item, Scene, Settings},
    session::{
        Captions, CellStyle, Data, Drawing, EditedInput, Facts, Framing, Items, Name, Opened,
        Showing, Subject, Surfaces,
    },
    warning,
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

/// Files in memory, by name.
#[derive(Clone, Copy)]
struct Held<'a> {
    whole: &'a BTreeMap<PathBuf, Vec<u8>>,
    in_parts: &'a BTreeMap<PathBuf, Parts>,
}

/// A scene that was read, and what is known of it.
pub struct Loaded {
    /// What is drawn.
    pub scene: Scene,
    /// Where the scene is, and how it stands.
    pub subject: Subject,
    /// The items of the scene, with their names.
    pub items: Items,
    /// What the inputs say for texts over a picture.
    pub captions: Captions,
    /// What each input is, in the order of the visible ones.
    pub inputs: Vec<LoadedInput>,
    /// What was said of the inputs while they were read, such as of parts left out. Subscribers of
    /// `tracing` hear the same.
    pub warnings: Vec<String>,
    /// The files that were read: the inputs, those that they refer to, and those that the
    /// description names beside them.
    pub files: Vec<PathBuf>,
}

/// What an input turned out to be.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedInput {
    /// Its path, or the address of a remote object.
    pub file: PathBuf,
    /// What it holds.
    pub kind: Kind,
    /// Whether it is a point cloud: of the kind of meshes, without triangles.
    pub is_cloud: bool,
    /// Whether it has lines, alone or beside triangles.
    pub has_lines: bool,
    /// Whether it is of cells that are drawn as a solid.
    pub is_solid: bool,
    /// Whether the description gave its layout, because the file has no format of its own.
    pub is_raw: bool,
    /// The names of the values that may colour it, if it is a mesh or a point cloud.
    pub attributes: Vec<String>,
    /// Its times, if it holds several.
    pub times: Option<Times>,
    /// The numbers of its items in the scene.
    pub items: std::ops::Range<usize>,
    /// What is known of its content, as `splatkit info --json` prints it. Series and arrays beside
    /// those that were read are left out ([`Opened::facts`](crate::session::Opened::facts) has
    /// them).
    pub facts: Facts,
    /// The files that were read: its own, and those that it refers to.
    pub files: Vec<PathBuf>,
}

/// An input that was read, with all that its description says of it.
pub struct ReadInput {
    /// What it holds, where it is moved to.
    pub data: Data,
    /// How it is shown.
    pub showing: Showing,
    /// Whether the description gave its layout.
    pub is_raw: bool,
    /// The files that were read.
    pub files: Vec<PathBuf>,
    times: Option<Times>,
    facts: Facts,
}

impl LoadedInput {
    fn new(file: PathBuf, read: &ReadInput) -> Result<Self> {
        let ReadInput { data, showing, is_raw, files, times, facts } = read;
        let has_lines = matches!(data, Data::Mesh(mesh) if !mesh.lines.is_empty());
        let is_cloud = !has_lines && matches!(data, Data::Mesh(mesh) if mesh.triangles.is_empty());
        let is_solid = matches!(data, Data::Cells(_)) && showing.cell_style()? == CellStyle::Solid;
        let attributes = match data {
            Data::Mesh(mesh) => mesh.about.attributes.clone(),
            _ => Vec::new(),
        };
        let kind = data.kind();
        let (is_raw, times, facts, files) = (*is_raw, *times, facts.clone(), files.clone());
        // It has none yet.
        let items = 0..0;
        Ok(Self {
            file,
            kind,
            is_cloud,
            has_lines,
            is_solid,
            is_raw,
            attributes,
            times,
            items,
            facts,
            files,
        })
    }
}

impl Description {
    /// Reads the inputs and makes a scene of them. Meshes become facets where the picture can show
    /// them, else surfels. `does` hears what is done, for a display of progress.
    ///
    /// # Errors
    /// Those of [`check`](Self::check) as [`Error::Argument`], of reading the inputs
    /// ([`Reading`](crate::session::Reading)) and of adding them ([`Items::add`]).
    pub fn load(&self, does: &dyn Fn(String)) -> Result<Loaded> {
        let (loaded, warnings) = warning::gathered(|| self.load_all(None, does));
        Ok(Loaded { warnings, ..loaded? })
    }

    /// As [`load`](Self::load), from files in memory, which have the names that the description
    /// gives its inputs: for programs without a file system, such as browsers.
    ///
    /// ```
    /// use splatkit::session::Description;
    /// use std::collections::BTreeMap;
    ///
    /// let scene = Description::parse(
    ///     r#"{"splatkit_scene": 2, "inputs": [{"file": "a.xyz"}]}"#,
    /// )?;
    /// let files = BTreeMap::from([("a.xyz".into(), b"0 0 0\n1 0 0\n0 1 0\n".to_vec())]);
    /// assert!(scene.load_held(&files, &|_| {})?.inputs[0].is_cloud);
    /// # Ok::<(), splatkit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`load`](Self::load); [`Error::Input`] for an input that is not among the files.
    pub fn load_held(
        &self,
        files: &BTreeMap<PathBuf, Vec<u8>>,
        does: &dyn Fn(String),
    ) -> Result<Loaded> {
        self.load_in_parts(files, &BTreeMap::new(), does)
    }

    /// As [`load_held`](Self::load_held), with hierarchies (`.splk`) and volumes in bricks
    /// (`.splv`) that come in parts. The scene may be rough as long as one of them
    /// [`lacks`](Parts::lacks) parts: coarse levels then decide the transfer function and what is
    /// seen. Load it again once they have come.
    ///
    /// # Errors
    /// Those of [`load_held`](Self::load_held); [`Error::Absent`] until the beginnings of the files
    /// in parts have come.
    pub fn load_in_parts(
        &self,
        whole: &BTreeMap<PathBuf, Vec<u8>>,
        in_parts: &BTreeMap<PathBuf, Parts>,
        does: &dyn Fn(String),
    ) -> Result<Loaded> {
        let held = Held { whole, in_parts };
        let (loaded, warnings) = warning::gathered(|| self.load_all(Some(held), does));
        Ok(Loaded { warnings, ..loaded? })
    }

    fn load_all(&self, held: Option<Held>, does: &dyn Fn(String)) -> Result<Loaded> {
        let checked = self.check();
        checked.map_err(|(place, message)| Error::Argument(format!("{place} {message}")))?;
        // One deadline covers reading all inputs and making their splats.
        let mut begun = self.clone();
        begun.reading = self.reading.begun();
        let facets = self.picture.draws_facets();
        let surfaces = if facets { Surfaces::Facets } else { Surfaces::Surfels };
        let mut items = Items::new(surfaces);
        let (mut inputs, mut files) = (Vec::new(), self.files());
        for input in begun.visible() {
            let (data, read) = begun.add(input, held, &mut items, does)?;
            inputs.push(data);
            files.extend(read);
        }
        let fault = |scene: &Scene, error| self.at_fault(&items, scene, error);
        let (scene, subject) = items.assembled(facets, fault)?;
        let (captions, warnings) = (items.captions(), Vec::new());
        Ok(Loaded { scene, subject, items, captions, inputs, warnings, files })
    }

    /// Returns the error for a scene that cannot be drawn. If an item cannot be drawn by itself,
    /// its file is at fault, or what says how it is shown.
    fn at_fault(&self, items: &Items, scene: &Scene, error: Error) -> Error {
        let Some((number, Error::Transfer(what))) = Items::unfit(scene) else {
            return items.at_fault(scene, error);
        };
        // An input may have become several items.
        let name = &items.contents[number].name.text;
        let is_own = |input: &&InputEntry| input.file.display().to_string() == *name;
        let Some(input) = self.visible().find(is_own) else { return error };
        let appearance = self.appearance_of(input);
        let is_changed = appearance.range.is_some() || appearance.opacity_unit.is_some();
        let message = format!("{what}; the values are those of {}", input.file.display());
        match appearance.transfer.as_ref().and_then(TransferEntry::file) {
            Some(file) if !is_changed => Error::input(file, "content", message),
            _ if appearance.transfer.is_some() || is_changed => Error::Transfer(message),
            _ => items.at_fault(scene, error),
        }
    }

    /// Reads an input and adds it. Returns what it is, and the files that were read.
    fn add(
        &self,
        input: &InputEntry,
        held: Option<Held>,
        items: &mut Items,
        does: &dyn Fn(String),
    ) -> Result<(LoadedInput, Vec<PathBuf>)> {
        let path = &input.file;
        does(format!("Reading {}", path.display()));
        let read = self.read_from(input, held)?;
        let mut loaded = LoadedInput::new(path.clone(), &read)?;
        let first = items.len();
        items.add(&Name::of_file(path), read.data, &read.showing, does)?;
        loaded.items = first..items.len();
        Ok((loaded, read.files))
    }

    /// Reads the data of an input, with all that is said of it: the values that colour it, radii of
    /// points, and where it is moved to.
    ///
    /// # Errors
    /// Those of [`showing`](Self::showing) and of [`Reading`](crate::session::Reading);
    /// [`Error::Input`] for a file that cannot be moved.
    pub fn read_input(&self, input: &InputEntry) -> Result<ReadInput> {
        self.read_from(input, None)
    }

    fn read_from(&self, input: &InputEntry, held: Option<Held>) -> Result<ReadInput> {
        let (path, showing) = (&input.file, self.showing(input)?);
        let mut reading = self.reading_of(input).reading_within(memory::most());
        reading.options.channels = self.appearance_of(input).channels_read();
        let attribute = showing.coloring().attribute();
        let opened = match held {
            None => reading.open_colored(path, attribute)?,
            Some(files) => match files.in_parts.get(path) {
                Some(parts) => reading.open_parts(path, parts)?,
                None => reading.open_held(path, files.bytes_of(path)?, attribute)?,
            },
        };
        let mut data = opened.read()?;
        if let Some(glyphs) = &showing.glyphs {
            let scale = showing.glyph_scale.unwrap_or(1.0);
            data = Data::Mesh(opened.glyphs(&data, glyphs, scale)?);
        }
        opened.give_radii(&mut data, showing.point_radius.as_deref())?;
        input.transform.apply(path, &mut data)?;
        if !input.edits.is_empty() {
            data = self.edited(input, (&opened, data), &[])?.into_data();
        }
        let (is_raw, files, facts) = (opened.is_raw(), opened.files(), opened.cheap_facts(&data)?);
        let times = opened.times();
        Ok(ReadInput { data, showing, is_raw, files, times, facts })
    }
}

impl Description {
    /// Reads a mesh, a point cloud or trained Gaussians with the values of these names, where the
    /// description moves them to and as it edits them: to see what edits would change.
    ///
    /// # Errors
    /// Those of [`read_input`](Self::read_input); [`Error::Input`] for an input of another kind.
    pub fn read_editable(&self, input: &InputEntry, names: &[&str]) -> Result<EditedInput> {
        let showing = self.showing(input)?;
        let reading = self.reading_of(input).reading_within(memory::most());
        let attribute = showing.coloring().attribute();
        let opened = reading.open_colored(&input.file, attribute)?;
        let mut data = opened.read()?;
        input.transform.apply(&input.file, &mut data)?;
        self.edited(input, (&opened, data), names)
    }

    /// Edits what was read of an input. What is left has the values of these names.
    fn edited(
        &self,
        input: &InputEntry,
        (opened, data): (&Opened, Data),
        names: &[&str],
    ) -> Result<EditedInput> {
        let edits: Vec<Edit> = input.edits.iter().map(|entry| entry.edit().clone()).collect();
        let of_edits = edits.iter().filter_map(Edit::names).flatten();
        let names: Vec<&str> = of_edits.chain(names.iter().copied()).collect();
        let mut edited = EditedInput::new(opened, data, &names, self.framing.up)?;
        edited.apply(&edits)?;
        Ok(edited)
    }
}

impl<'a> Held<'a> {
    fn bytes_of(self, path: &Path) -> Result<&'a [u8]> {
        self.whole.get(path).map(Vec::as_slice).ok_or_else(|| {
            let names = self.whole.keys().chain(self.in_parts.keys()).take(9);
            let names: Vec<_> = names.map(|name| name.display().to_string()).collect();
            Error::input(path, "file", "is not among the files in memory")
                .hint(format!("these are: {}", names.join(", ")))
        })
    }
}

impl Loaded {
    /// Returns the number of splats, facets, samples and cells.
    pub fn count(&self) -> u64 {
        self.items.count()
    }

    /// Returns each channel that is drawn, by its name, with the scene as it is without the other
    /// channels of its file; none if no input is drawn in several channels.
    pub fn channels(&self) -> Vec<(String, Scene)> {
        let is_of_channels = |input: &&LoadedInput| {
            self.channel(input.items.start).is_some() && input.items.len() > 1
        };
        let inputs = self.inputs.iter().filter(is_of_channels);
        let alone = |of: &LoadedInput, channel: usize| {
            self.scene.filtered(|item| item == channel || !of.items.contains(&item))
        };
        let named = |of: &LoadedInput, channel: usize| {
            let name = self.channel(channel).map_or("", |about| about.name.as_str());
            let name = if name.is_empty() { format!("channel {channel}") } else { name.to_owned() };
            (name, alone(of, channel))
        };
        inputs.flat_map(|input| input.items.clone().map(move |at| named(input, at))).collect()
    }

    /// Returns what is known of an item that is a channel.
    fn channel(&self, item: usize) -> Option<&About> {
        let about = match self.scene.items.get(item)? {
            Item::Volume(volume, ..) => &volume.about,
            Item::Bricks(bricks, ..) => bricks.about(),
            _ => return None,
        };
        (!about.channels.is_empty()).then_some(about)
    }

    /// Finds the points that span what is seen with these settings, if the camera is fitted to
    /// them.
    ///
    /// # Errors
    /// Those of [`Scene::seen`].
    pub fn find_seen(&mut self, framing: &Framing, settings: &Settings) -> Result<()> {
        if !framing.is_placed() {
            self.subject.seen = self.scene.seen(&settings.clips)?;
        }
        Ok(())
    }

    /// Returns how a picture of the scene is drawn and finished.
    ///
    /// # Errors
    /// Those of [`PictureEntry::settings`].
    pub fn drawing(&self, picture: &PictureEntry) -> Result<Drawing> {
        picture.drawing(&self.scene, &self.subject)
    }

    /// Returns the error for a picture that an engine did not draw ([`Items::undrawn`]).
    pub fn undrawn(&self, error: Error, camera: &Camera, size: [u32; 2]) -> (Error, bool) {
        self.items.undrawn((&self.scene, &self.subject), error, camera, size)
    }
}
