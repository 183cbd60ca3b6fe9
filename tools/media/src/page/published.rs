//! The files of a page: those of the inputs as they are, or what they are converted to.

use super::{
    content::{Content, unread},
    convert::{Converter, Wanted},
};
use crate::Failure;
use splatkit::{
    Error,
    edit::Edit,
    formats::{Format, Kind},
    input::{Limits, is_remote},
    session::{
        AppearanceEntry, Description, InputEntry, KernelEntry, Loaded, LoadedInput, ReadingEntry,
        TransferEntry,
    },
    volume::TransferFunction,
};
use std::{
    collections::{BTreeMap, btree_map::Entry},
    fs,
    path::Path,
};

/// The features of the library that the viewer has (tools/web/Cargo.toml): its readers.
const READERS: [&str; 6] = ["ply", "obj", "gltf", "las", "e57", "vtk"];

/// A scene file, and the files that it names.
pub struct Published {
    pub scene: Description,
    pub files: BTreeMap<String, Content>,
    /// Whether inputs were converted.
    pub is_converted: bool,
}

/// Returns the scene of a page and its files. Inputs that the viewer reads stay as they are; the
/// others are converted, and those of which less is wanted. `tell` hears what is done.
pub fn published(
    scene: &Description,
    loaded: &Loaded,
    wanted: Wanted,
    tell: &dyn Fn(&str),
) -> Result<Published, Failure> {
    let mut page = scene.clone();
    page.inputs.clear();
    (page.reading, page.appearance) = (ReadingEntry::default(), AppearanceEntry::default());
    page.picture.memory = None;
    let mut published = Published { scene: page, files: BTreeMap::new(), is_converted: false };
    let converter = Converter { scene, loaded, wanted };
    for (number, (input, read)) in scene.visible().zip(&loaded.inputs).enumerate() {
        let mut entry = input.clone();
        entry.reading = scene.reading_of(input);
        entry.reading.limits = Default::default();
        entry.appearance = without_files(scene.appearance_of(input))?;
        let stays =
            is_read_by_viewer(read, &entry) && !converter.thins(read) && !converter.divides(read);
        if stays {
            published.add_file(entry, read, number)?;
            continue;
        }
        tell(&format!("Converting {}", input.file.display()));
        published.is_converted = true;
        for (mut entry, content) in converter.entries((input, read), entry)? {
            let name = published.free_name(&entry.file, number);
            entry.file = name.clone().into();
            published.files.insert(name, content);
            published.scene.inputs.push(entry);
        }
    }
    Ok(published)
}

impl Published {
    /// Returns the name of a file in the page: in a folder of its own if another has its name.
    fn free_name(&self, file: &Path, number: usize) -> String {
        let name = name_of(file);
        match self.files.contains_key(&name) {
            true => format!("{}/{name}", number + 1),
            false => name,
        }
    }

    /// Adds an input as it is.
    fn add_file(
        &mut self,
        mut entry: InputEntry,
        read: &LoadedInput,
        number: usize,
    ) -> Result<(), Failure> {
        let name = self.free_name(&read.file, number);
        entry.file = name.clone().into();
        if let Entry::Vacant(place) = self.files.entry(name) {
            place.insert(match read.kind {
                // They may be larger than memory.
                Kind::Hierarchy | Kind::Bricks => Content::Kept(read.file.clone()),
                _ => {
                    let bytes = fs::read(&read.file);
                    Content::Held(bytes.map_err(|source| unread(&read.file, &source))?)
                }
            });
        }
        self.scene.inputs.push(entry);
        Ok(())
    }
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

#[cfg(test)]
mod tests {
    use super::READERS;

    /// The viewer's readers are those of its manifest.
    #[test]
    fn the_viewer_has_these_readers() {
        let manifest = include_str!("../../../web/Cargo.toml");
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
