//! The files of a page: those of the inputs as they are, or what they are converted to.

use super::content::{Content, unread};
use crate::{failure::Failure, job::Loaded, progress::Progress};
use splatkit::{
    Device, Error,
    compare::compare_pictures,
    edit::Edit,
    formats::{self, Format, Kind},
    input::{Limits, Parts, is_remote},
    picture::Picture,
    scene::Item,
    session::{
        AppearanceEntry, Data, Description, InputEntry, KernelEntry, LoadedInput, ReadInput,
        ReadingEntry, Samples, TransferEntry, convert::Conversion,
    },
    volume::{TransferFunction, Volume},
};
use std::{
    collections::{BTreeMap, btree_map::Entry},
    fs::{self, File},
    io::{self, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    slice,
};

/// The features of the library that the viewer has (tools/web/Cargo.toml): its readers.
const READERS: [&str; 6] = ["ply", "obj", "gltf", "las", "e57", "vtk"];

/// A scene file, and the files that it names.
pub struct Published {
    pub scene: Description,
    pub files: BTreeMap<String, Content>,
}

/// Returns the scene of a page and its files. Inputs that the viewer reads stay as they are; the
/// others are converted.
pub fn published(
    scene: &Description,
    loaded: &mut Loaded,
    progress: &Progress,
) -> Result<Published, Failure> {
    let mut page = scene.clone();
    page.inputs.clear();
    (page.reading, page.appearance) = (ReadingEntry::default(), AppearanceEntry::default());
    page.picture.memory = None;
    let (mut files, mut is_converted) = (BTreeMap::new(), false);
    for (number, (input, read)) in scene.visible().zip(&loaded.inputs).enumerate() {
        let mut entry = input.clone();
        entry.reading = scene.reading_of(input);
        entry.reading.limits = Default::default();
        entry.appearance = without_files(scene.appearance_of(input))?;
        let folder = match files.contains_key(&name_of(&input.file)) {
            true => format!("{}/", number + 1),
            false => String::new(),
        };
        if is_read_by_viewer(read, &entry) {
            add_file(&mut entry, read, &folder, &mut files)?;
            page.inputs.push(entry);
        } else {
            progress.stage(format!("Converting {}", input.file.display()));
            is_converted = true;
            let entries = converted_entries((scene, loaded), input, (entry, &folder), &mut files)?;
            page.inputs.extend(entries);
        }
    }
    let published = Published { scene: page, files };
    progress.stage("Reading the page");
    published.try_reading(scene, loaded, is_converted)?;
    Ok(published)
}

/// Returns the last part of a path.
pub fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned()
}

/// Returns the text of a page's scene file.
pub fn text_of(scene: &Description) -> String {
    serde_json::to_string_pretty(scene).unwrap_or_default()
}

/// Returns whether the viewer reads an input as it is.
fn is_read_by_viewer(read: &LoadedInput, entry: &InputEntry) -> bool {
    let format = Format::of_path(&read.file);
    let has_reader = match format {
        Some(format) => format.feature.is_none_or(|feature| READERS.contains(&feature)),
        None => read.is_raw,
    };
    has_reader
        && entry.reading.labels.is_none()
        // Pages have no projections.
        && !entry.edits.iter().any(|entry| matches!(entry.edit(), Edit::Reproject(_)))
        && !read.files.iter().any(is_remote)
        // The viewer has no files beside an input.
        && read.files.iter().all(|file| *file == read.file)
        && read.file.is_file()
}

/// Adds the file of an input as it is.
fn add_file(
    entry: &mut InputEntry,
    read: &LoadedInput,
    folder: &str,
    files: &mut BTreeMap<String, Content>,
) -> Result<(), Failure> {
    let name = format!("{folder}{}", name_of(&read.file));
    entry.file = name.clone().into();
    if let Entry::Vacant(place) = files.entry(name) {
        place.insert(match read.kind {
            // They may be larger than memory.
            Kind::Hierarchy | Kind::Bricks => Content::Kept(read.file.clone()),
            _ => Content::Held(fs::read(&read.file).map_err(|source| unread(&read.file, &source))?),
        });
    }
    Ok(())
}

/// Adds the files that an input is converted to: one, or one for each channel. Returns their
/// entries.
fn converted_entries(
    (scene, loaded): (&Description, &Loaded),
    input: &InputEntry,
    (mut entry, folder): (InputEntry, &str),
    files: &mut BTreeMap<String, Content>,
) -> Result<Vec<InputEntry>, Failure> {
    let ReadInput { data, .. } = scene.read_input(input)?;
    // The converted file has one array, is as the input was moved and edited, and knows its own
    // layout.
    entry.reading = ReadingEntry::default();
    (entry.transform, entry.edits) = Default::default();
    let mut add =
        |mut entry: InputEntry, transfer: Option<TransferFunction>, name: &str, data: &Data| {
            let (name, bytes) = converted(scene, input, name, data)?;
            if let Some(transfer) = transfer {
                let drawn = &mut entry.appearance;
                drawn.transfer = Some(TransferEntry::Whole(transfer));
                (drawn.range, drawn.opacity_unit, drawn.isosurfaces) = (None, None, None);
                (drawn.gradient_opacity, drawn.colormap, drawn.channels) = (None, None, None);
            }
            if data.kind() == Kind::Mesh {
                // A hierarchy has the colours that the mesh was shown in.
                entry.appearance = AppearanceEntry::default();
            }
            entry.file = format!("{folder}{name}").into();
            files.insert(format!("{folder}{name}"), Content::Held(bytes));
            Ok(entry)
        };
    match data {
        Data::Volume(volume) if !volume.more_channels.is_empty() => {
            let drawn = volumes_of(loaded, input);
            let of_channel = |(channel, transfer): (&Volume, &TransferFunction)| {
                let volume = Volume { more_channels: Vec::new(), ..channel.clone() };
                let name = channel.about.name.clone();
                add(entry.clone(), Some(transfer.clone()), &name, &Data::Volume(volume))
            };
            drawn.into_iter().map(of_channel).collect()
        }
        data => Ok(vec![add(entry, transfer_of(loaded, input, &data), "", &data)?]),
    }
}

/// Returns the volumes that an input has become, and what shows them.
fn volumes_of<'a>(
    loaded: &'a Loaded,
    input: &InputEntry,
) -> Vec<(&'a Volume, &'a TransferFunction)> {
    let name = input.file.display().to_string();
    let items = loaded.scene.items.iter().zip(&loaded.items.contents);
    let of_input = items.filter(|(_, content)| content.name.text == name);
    let volume = |(item, _): (&'a Item, _)| match item {
        Item::Volume(volume, _, transfer) => Some((&**volume, transfer)),
        _ => None,
    };
    of_input.filter_map(volume).collect()
}

/// Returns the transfer function that shows an input, if it is a field without colours of its own.
fn transfer_of(loaded: &Loaded, input: &InputEntry, data: &Data) -> Option<TransferFunction> {
    if !matches!(data.kind(), Kind::Volume | Kind::Cells) {
        return None;
    }
    let name = input.file.display().to_string();
    let items = loaded.scene.items.iter().zip(&loaded.items.contents);
    let mut of_input = items.filter(|(_, content)| content.name.text == name);
    of_input.find_map(|(item, _)| item.transfer().cloned())
}

/// Returns the name and the bytes of the file that an input, or a channel of it, is converted to.
fn converted(
    scene: &Description,
    input: &InputEntry,
    channel: &str,
    data: &Data,
) -> Result<(String, Vec<u8>), Failure> {
    let mut stem = input.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if !channel.is_empty() {
        let letters = channel.chars().map(|c| if c.is_alphanumeric() { c } else { '-' });
        stem += &format!("-{}", letters.collect::<String>());
    }
    let extension = match data.kind() {
        Kind::Volume => "nrrd",
        Kind::Gaussians => "spz",
        Kind::Cells => "vtu",
        Kind::Mesh => "splk",
        kind @ (Kind::Samples | Kind::Hierarchy | Kind::Bricks) => {
            let what = format!("{kind:?}").to_lowercase();
            let message = format!("is read by this program, but not by pages: it holds {what}");
            let hint = "name a file on this machine; docs/browser.md lists what pages read";
            return Err(Error::input(&input.file, "file", message).hint(hint).into());
        }
    };
    let name = format!("{stem}.{extension}");
    let folder = tempfile::tempdir();
    let folder = folder.map_err(|error| Failure::output(&std::env::temp_dir(), error))?;
    let path = folder.path().join(&name);
    let written = match data {
        Data::Volume(volume) => formats::nrrd::write(volume, &path),
        Data::Gaussians(set) => formats::spz::write(set, &path),
        Data::Cells(cells) => formats::write_cells(cells, &path),
        _ => hierarchy(scene, input, &path),
    };
    let bytes = written.and_then(|()| fs::read(&path).map_err(|e| unread(&path, &e)));
    Ok((name, bytes?))
}

/// Writes the hierarchy of a mesh.
fn hierarchy(scene: &Description, input: &InputEntry, path: &Path) -> Result<(), Error> {
    let appearance = scene.appearance_of(input);
    let edits = input.edits.iter().map(|entry| entry.edit().clone());
    let conversion = Conversion {
        edits: input.transform.motion().map(Edit::Move).into_iter().chain(edits).collect(),
        reading: scene.reading_of(input).reading(),
        coloring: appearance.coloring(),
        radius_scale: appearance.radius_scale.unwrap_or(1.0),
        ..Conversion::default()
    };
    conversion.convert(slice::from_ref(&input.file), path, &()).map(drop)
}

/// Takes the files into an entry that it names.
fn without_files(mut entry: AppearanceEntry) -> Result<AppearanceEntry, Failure> {
    let limits = Limits::default();
    if let Some(file) = entry.transfer.as_ref().and_then(TransferEntry::file) {
        let transfer = TransferFunction::read(file, &limits)?;
        entry.transfer = Some(TransferEntry::Whole(transfer));
    }
    if let Some(file) = entry.kernel.as_ref().and_then(KernelEntry::file) {
        let message = "kernels from files are not published yet";
        let hint = "write its values into a scene file: \"kernel\": [1, 0.5, 0]";
        return Err(Error::input(file, "kernel", message).hint(hint).into());
    }
    Ok(entry)
}

/// The least likeness of the pictures of a scene and of what its inputs were converted to, in dB.
/// Splats in place of triangles stay above it.
const LEAST_ALIKE: f64 = 24.0;

impl Published {
    /// Reads the page's scene as the viewer does, so that a page which cannot be shown is an error
    /// here. If inputs were converted, small pictures of both are compared.
    fn try_reading(
        &self,
        scene: &Description,
        loaded: &mut Loaded,
        is_converted: bool,
    ) -> Result<(), Failure> {
        let sources = Sources::of(&self.files)?;
        let mut again = sources.load(&self.scene)?;
        if !is_converted {
            return Ok(());
        }
        let is_label_map =
            |items: &[Item]| items.iter().map(Item::is_label_map).collect::<Vec<_>>();
        let has_labels = is_label_map(&loaded.scene.items) == is_label_map(&again.scene.items);
        let mut is_alike = || -> Result<bool, Failure> {
            let (before, _) = loaded.draw(&small(scene), &Device::Cpu)?;
            let after = sources.draw(&mut again, &small(&self.scene))?;
            let likeness = compare_pictures(&before, &after)?.psnr;
            Ok(likeness.is_none_or(|likeness| likeness >= LEAST_ALIKE))
        };
        if has_labels && is_alike()? {
            return Ok(());
        }
        let names = scene.visible().map(|input| name_of(&input.file)).collect::<Vec<_>>();
        let message = "would look different in a page: its colours or labels would be lost when \
                       it is converted";
        let hint = "write it in a format that pages read: docs/browser.md lists them";
        Err(Error::input(Path::new(&names.join(", ")), "inputs", message).hint(hint).into())
    }
}

/// Most bytes of a file in parts in memory while it is read.
const MOST_HELD: u64 = 1 << 28;

/// The files of a page as the viewer reads them: whole, or in parts.
struct Sources {
    whole: BTreeMap<PathBuf, Vec<u8>>,
    in_parts: BTreeMap<PathBuf, Parts>,
    /// The files behind those in parts.
    files: Vec<(PathBuf, File, Parts)>,
}

impl Sources {
    fn of(contents: &BTreeMap<String, Content>) -> Result<Self, Failure> {
        let mut sources =
            Self { whole: BTreeMap::new(), in_parts: BTreeMap::new(), files: Vec::new() };
        for (name, content) in contents {
            match content {
                Content::Held(bytes) => {
                    sources.whole.insert(name.into(), bytes.clone());
                }
                Content::Kept(path) => {
                    let file = File::open(path).map_err(|source| unread(path, &source))?;
                    let parts = Parts::new(content.len()?, MOST_HELD);
                    sources.in_parts.insert(name.into(), parts.clone());
                    sources.files.push((path.clone(), file, parts));
                }
            }
        }
        Ok(sources)
    }

    /// Reads the scene.
    fn load(&self, scene: &Description) -> Result<splatkit::session::Loaded, Failure> {
        loop {
            self.begin();
            let loaded = scene.load_in_parts(&self.whole, &self.in_parts, &|_| {});
            if !self.come()? {
                return Ok(loaded?);
            }
        }
    }

    /// Draws the scene.
    fn draw(
        &self,
        loaded: &mut splatkit::session::Loaded,
        scene: &Description,
    ) -> Result<Picture, Failure> {
        loop {
            self.begin();
            let drawn = loaded.draw(scene, &Device::Cpu);
            if !self.come()? {
                return Ok(drawn?.0);
            }
        }
    }

    fn begin(&self) {
        self.files.iter().for_each(|(.., parts)| parts.begin());
    }

    /// Hands in the parts that were missed. Returns whether there were any.
    fn come(&self) -> Result<bool, Failure> {
        let mut any = false;
        for (path, file, parts) in &self.files {
            for range in parts.requests() {
                any = true;
                let mut bytes = vec![0; (range.end - range.start) as usize];
                let mut file = file;
                file.seek(SeekFrom::Start(range.start))
                    .and_then(|_| file.read_exact(&mut bytes))
                    .map_err(|source: io::Error| unread(path, &source))?;
                parts.arrive(range.start, &bytes)?;
            }
        }
        Ok(any)
    }
}

/// Returns a scene with a small picture.
fn small(scene: &Description) -> Description {
    let mut scene = scene.clone();
    let picture = &mut scene.picture;
    (picture.size, picture.width, picture.height) = (Some([160, 120]), None, None);
    picture.views.clear();
    (picture.columns, picture.panel_labels) = (None, None);
    picture.samples = Some(Samples::Factor(1));
    scene
}

#[cfg(test)]
mod tests {
    use super::READERS;

    /// The viewer's readers are those of its manifest.
    #[test]
    fn the_viewer_has_these_readers() {
        let manifest = include_str!("../../web/Cargo.toml");
        let (_, rest) = manifest.split_once("features = [").expect("the features");
        let (list, _) = rest.split_once(']').expect("their end");
        let names = list.split('"').skip(1).step_by(2);
        let mut names: Vec<&str> = names.filter(|name| *name != "webgpu").collect();
        let mut readers = READERS.to_vec();
        names.sort_unstable();
        readers.sort_unstable();
        assert_eq!(names, readers);
    }
}
