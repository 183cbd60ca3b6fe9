//! DICOM: the pictures of a scan, in files of one slice each or in one file of many frames.
//!
//! The elements are read by this module, because lengths that files claim must not allocate memory
//! and nested sequences must not exhaust the stack. Crates decode JPEG and JPEG 2000.

mod element;
mod file;
mod frames;
mod head;
mod label_map;
mod pixels;
mod segmentation;
mod stack;
mod syntax;
mod tags;
#[cfg(test)]
mod tests;
mod volume;

use super::{ReadOptions, Series};
use crate::{Error, Result, input::Source, volume::Volume, warning};
use file::File;
pub(super) use file::is_dicom;
use head::Head;
use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

/// Files of a folder that are looked at to find one of DICOM.
const LOOKED_AT: usize = 256;

/// Reads one series of pictures as a volume: of a file, of the files in a folder, or of those that
/// a DICOMDIR lists. Positions are in the world of the patient (LPS: x to the left, y to the back,
/// z to the head), in millimetres.
///
/// [`ReadOptions::series`] names the series by its number, its identifier or a part of its
/// description; without it, the one with the most pictures is read. If a series shows several
/// times, echoes or other repetitions, [`ReadOptions::time`] chooses one of them.
///
/// Slices are ordered by their positions. Those of a tilted gantry lie on a sheared lattice, and
/// those at uneven distances on a rectilinear one, so nothing is resampled. Values are scaled by
/// slope and intercept (for CT to Hounsfield units). Segmentations are label maps. Colours are
/// kept, with their luminance as samples. Values that the files mark as padding are holes.
///
/// # Errors
/// [`Error::Input`] with the file and the place of what is wrong or not read;
/// [`Error::Limit`] for sizes over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let Some(paths) = listed(source)? else {
        let head = Head::read(source)?;
        return volume::read(source, vec![head], options);
    };
    let list = SeriesList::scan(source, &paths)?;
    let chosen = list.choose(source, options)?;
    list.tell(source, options, chosen);
    let series = list.series.into_iter().nth(chosen).map(|series| series.heads);
    volume::read(source, series.unwrap_or_default(), options)
}

/// Returns the series of a folder or of a DICOMDIR; none for a file of pictures.
///
/// # Errors
/// Those of [`read`], but for those of pixels.
pub(super) fn series(source: &Source, options: &ReadOptions) -> Result<Vec<Series>> {
    let Some(paths) = listed(source)? else { return Ok(Vec::new()) };
    let list = SeriesList::scan(source, &paths)?;
    let chosen = list.choose(source, options).ok();
    let described = list.series.iter().enumerate();
    Ok(described.map(|(at, series)| series.describe(chosen == Some(at))).collect())
}

/// Returns whether a folder has a file of DICOM among its first files.
pub(super) fn is_folder(source: &Source) -> Result<bool> {
    for path in source.folder().unwrap_or_default().iter().take(LOOKED_AT) {
        if file::is_dicom(source.peek_beside(path)?.bytes()) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Returns a text of the file for a message: at most 60 characters.
fn excerpt(text: &str) -> String {
    text.chars().take(60).collect()
}

/// Returns the files of a folder or of a DICOMDIR; `None` for a file of pictures.
fn listed(source: &Source) -> Result<Option<Vec<PathBuf>>> {
    if let Some(files) = source.folder() {
        return Ok(Some(files.to_vec()));
    }
    let file = File::open(source)?;
    if !file.is_directory {
        return Ok(None);
    }
    let set = file.set()?;
    let (mut paths, mut missing) = (Vec::new(), 0);
    for record in set.items(tags::DIRECTORY_RECORDS)? {
        source.check_time()?;
        let words = record.words(tags::REFERENCED_FILE);
        let parts: Vec<&str> =
            words.iter().map(String::as_str).filter(|word| !word.is_empty()).collect();
        if parts.is_empty() {
            continue;
        }
        match referenced(source, &parts) {
            Ok(path) => paths.push(path),
            Err(_) => missing += 1,
        }
    }
    if missing > 0 {
        let path = source.path.display();
        warning::give!("{path}: {missing} of the files that it lists are not beside it");
    }
    if paths.is_empty() {
        let message = "lists no files that are beside it";
        let hint = "copy the folders of the pictures too, or name their folder";
        return Err(source.error("directory", message).hint(hint));
    }
    Ok(Some(paths))
}

/// Returns the path of a file that a DICOMDIR lists. Copies of discs often have other cases.
fn referenced(source: &Source, parts: &[&str]) -> Result<PathBuf> {
    let place = "directory";
    let path = parts.join("/");
    source
        .neighbour(place, &path)
        .or_else(|_| source.neighbour(place, &path.to_lowercase()))
        .or_else(|_| source.neighbour(place, &path.to_uppercase()))
}

/// The series that were found in files.
struct SeriesList {
    series: Vec<Group>,
    /// What was passed over, as sentences.
    words: Vec<String>,
}

/// The files of one series.
struct Group {
    heads: Vec<Head>,
    /// Why the pixels are not read.
    obstacle: Option<String>,
}

impl SeriesList {
    /// Looks at files. Those that are not DICOM, or hold no pictures, are passed over. Copies of a
    /// file are left out.
    fn scan(source: &Source, paths: &[PathBuf]) -> Result<Self> {
        let (mut series, mut seen): (Vec<Group>, _) = (Vec::new(), HashSet::new());
        let (mut first, mut damaged, mut copies) = (None, 0, 0);
        for path in paths {
            let file = source.peek_beside(path)?;
            if !file::is_dicom(file.bytes()) {
                continue;
            }
            let head = match file.unless_changed(Head::read(&file)) {
                Ok(head) => head,
                Err(error @ Error::Input { .. }) => {
                    damaged += 1;
                    first.get_or_insert(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            source.room::<u8>("what the files say", room_of(&head))?;
            if !head.instance.is_empty() && !seen.insert(head.instance.clone()) {
                copies += 1;
                continue;
            }
            let same =
                |group: &&mut Group| group.heads[0].series.identifier == head.series.identifier;
            match series.iter_mut().find(same) {
                Some(group) => group.heads.push(head),
                None => {
                    let obstacle = obstacle(&file);
                    series.push(Group { heads: vec![head], obstacle });
                }
            }
        }
        series.sort_by_key(|group| group.heads[0].series.number);
        let mut words = Vec::new();
        match (series.is_empty(), first) {
            (true, Some(error)) => return Err(error),
            (true, None) => return Err(source.error("folder", "has no pictures of DICOM")),
            (false, Some(error)) => {
                words.push(format!("{damaged} of its files are passed over; the first: {error}"));
            }
            (false, None) => {}
        }
        if copies > 0 {
            words.push(format!("{copies} of its files are copies of others, and are left out"));
        }
        Ok(Self { series, words })
    }

    /// Says what was passed over, and which series was chosen if nobody named it.
    fn tell(&self, source: &Source, options: &ReadOptions, chosen: usize) {
        let path = source.path.display();
        self.words.iter().for_each(|word| warning::give!("{path}: {word}"));
        let count = self.series.len();
        if count > 1 && options.series.is_none() {
            let name = self.series[chosen].heads[0].series.title();
            let reason = "has the most pictures and is read; see --series";
            warning::give!("{path}: of {count} series, {name} {reason}");
        }
    }

    /// Returns the index of the series to read.
    fn choose(&self, source: &Source, options: &ReadOptions) -> Result<usize> {
        let Some(wanted) = options.series.as_deref().map(str::trim) else {
            return Ok(self.largest());
        };
        let names = || self.series.iter().map(|group| &group.heads[0].series).enumerate();
        let by = |fits: &dyn Fn(&head::SeriesName) -> bool| -> Vec<usize> {
            names().filter(|(_, name)| fits(name)).map(|(at, _)| at).collect()
        };
        let lower = wanted.to_lowercase();
        let by_number = by(&|name| name.number.is_some_and(|number| Ok(number) == wanted.parse()));
        let by_identifier = by(&|name| name.identifier == wanted);
        let by_words = by(&|name| name.description.to_lowercase().contains(&lower));
        let matches = [by_number, by_identifier, by_words].into_iter().find(|all| !all.is_empty());
        let list = names().map(|(_, name)| name.title()).collect::<Vec<_>>().join("; ");
        match matches.as_deref() {
            Some(&[one]) => Ok(one),
            Some(several) => {
                let wanted = excerpt(wanted);
                let message = format!("{} series fit “{wanted}”", several.len());
                let several: Vec<&str> = several
                    .iter()
                    .map(|&at| self.series[at].heads[0].series.identifier.as_str())
                    .collect();
                let hint = format!("name one by its identifier: {}", several.join(", "));
                Err(source.error("series", message).hint(hint))
            }
            None => {
                let message = format!("no series fits “{}”", excerpt(wanted));
                Err(source.error("series", message).hint(format!("there are: {list}")))
            }
        }
    }

    /// Returns the index of the series with the most pictures of those that can be drawn.
    fn largest(&self) -> usize {
        let weight = |group: &Group| {
            let is_localizer = group.heads[0].nature.is_localizer;
            (group.obstacle.is_none(), !is_localizer, group.pictures())
        };
        let indices = 0..self.series.len();
        indices.rev().max_by_key(|&at| weight(&self.series[at])).unwrap_or(0)
    }
}

impl Group {
    fn pictures(&self) -> usize {
        self.heads.iter().map(|head| head.frames.len()).sum()
    }

    fn describe(&self, is_drawn: bool) -> Series {
        let head = &self.heads[0];
        Series {
            number: head.series.number,
            identifier: head.series.identifier.clone(),
            description: head.series.description.clone(),
            modality: head.series.modality.clone(),
            size: [head.layout.columns, head.layout.rows],
            pictures: self.pictures(),
            obstacle: self.obstacle.clone(),
            is_drawn,
        }
    }
}

impl head::SeriesName {
    /// Returns a text that names the series.
    fn title(&self) -> String {
        let number = self.number.map_or("no number".into(), |number| format!("number {number}"));
        match self.description.as_str() {
            "" => number,
            description => format!("{number} “{}”", excerpt(description)),
        }
    }
}

/// Returns why the pixels of a file are not read.
fn obstacle(file: &Source) -> Option<String> {
    let error = File::open(file).and_then(|file| file.packing().map(|_| ())).err()?;
    match error {
        Error::Input { message, .. } => Some(message),
        other => Some(other.to_string()),
    }
}

/// Returns the bytes of memory of what a file says.
fn room_of(head: &Head) -> usize {
    size_of::<Head>() + head.frames.len() * 2 * size_of::<frames::Frame>() + 256
}

/// Returns the name of a file without its folders.
fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
