//! Zarr stores, as OME-Zarr (0.1 to 0.5) uses them for images: folders, ZIP archives and servers.
//! Follows the specifications of Zarr 2 and 3, ZEP 2 (shards), and OME-NGFF.
//!
//! The reader is this project's own (docs/volumes.md says why). `store` gets objects, `array` reads
//! the metadata of arrays, `codecs` and `blosc` unpack, and `chunks` puts parts of arrays together.
//! `ome` knows the attributes of OME, `nodes` finds the image that is meant, and `image` and
//! `field` read samples of it.

mod array;
mod blosc;
mod chunks;
mod codecs;
mod field;
mod image;
mod nodes;
mod ome;
mod store;
#[cfg(test)]
mod tests;
mod unpack;

use super::{
    Kind, ReadOptions,
    array::{Array, Place},
    shared::{
        grid::{Component, Grid},
        several,
    },
};
use crate::{
    Result,
    about::{About, Channel, Modality, Orientation},
    input::{Source, is_remote},
    volume::Volume,
    warning,
};
pub(crate) use field::Field;
use image::{Image, Level};
use std::sync::Arc;
use store::Store;

/// Most samples of a channel that is read as a whole, if the store has coarser levels: of files,
/// and of objects on a server.
const MOST_WHOLE: u64 = 1 << 27;
const MOST_FETCHED: u64 = 1 << 24;

/// An image whose metadata is read.
struct Opened {
    /// How the caller named it.
    dataset: Option<String>,
    image: Arc<Image>,
    /// What else the store has, as warnings.
    notes: Vec<String>,
    /// The paths of images of labels.
    labels: Vec<String>,
}

/// Opens the image of a store that the options name.
fn open(source: &Source, options: &ReadOptions) -> Result<Arc<Opened>> {
    let dataset = options.dataset.as_deref();
    let read = |source: &Source| {
        let store = Arc::new(Store::open(source)?);
        let found = nodes::find(source, &store, dataset)?;
        let labels = nodes::labels(&store, &found.group)?;
        let notes = found.notes.clone();
        let image = Arc::new(Image::open(source, &store, found)?);
        Ok(Opened { dataset: dataset.map(str::to_owned), image, notes, labels })
    };
    let opened = source.parsed(read)?;
    if opened.dataset.as_deref() == dataset { Ok(opened) } else { read(source).map(Arc::new) }
}

impl Opened {
    /// Warns of what is not shown.
    fn warn(&self, source: &Source) {
        for note in &self.notes {
            warning::give!("{}: {note}", source.path.display());
        }
    }
}

/// Returns the kind of data: bricks if the finest level is too large to be read as a whole and
/// there are coarser ones, else a volume.
///
/// # Errors
/// As [`read`].
pub fn kind(source: &Source, options: &ReadOptions) -> Result<Kind> {
    let image = &open(source, options)?.image;
    let most = if is_remote(source.path) { MOST_FETCHED } else { MOST_WHOLE };
    let [first, .., last] = &image.levels[..] else { return Ok(Kind::Volume) };
    let is_large = samples(first.dims) > most || !fits(source, image, 0, options);
    let are_bricks = image.labels.is_none() && is_large && samples(last.dims) <= MOST_WHOLE;
    Ok(if are_bricks { Kind::Bricks } else { Kind::Volume })
}

/// Returns the number of samples.
fn samples(dims: [usize; 3]) -> u64 {
    dims.iter().fold(1, |all, &n| all.saturating_mul(n as u64))
}

/// Returns whether the channels of a level can be read within the limits.
fn fits(source: &Source, image: &Image, level: usize, options: &ReadOptions) -> bool {
    let count = match (&options.scalar, &options.channels) {
        (Some(_), _) | (_, None) => 1,
        (_, Some(names)) if names.is_empty() => image.channels.len().min(Channel::MOST),
        (_, Some(names)) => names.len(),
    };
    let level = &image.levels[level];
    // The bytes of the store, and the samples that they become.
    let each = 2 * level.array.layout.element.bytes().max(4) as u64;
    let bytes = samples(level.dims).saturating_mul(each).saturating_mul(count as u64);
    bytes <= source.limits.bytes
}

/// Reads an image: the finest level that fits the limits. [`ReadOptions::dataset`] names another
/// level or another image by its path in the store, [`ReadOptions::channels`] and
/// [`ReadOptions::scalar`] channels, and [`ReadOptions::time`] a time.
///
/// The metadata of OME gives the distances between samples, their unit, and the names, colours and
/// windows of channels. A plate shows the first image of its first well, a group of series the
/// first. An array without this metadata is a volume too.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for metadata that is damaged or asks for codecs that are
/// not read, and for chunks that are damaged, with the file. [`Error::Limit`](crate::Error::Limit)
/// if no level fits the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let opened = open(source, options)?;
    opened.warn(source);
    let image = &*opened.image;
    let level = (0..image.levels.len()).find(|&level| fits(source, image, level, options));
    let level = level.unwrap_or(image.levels.len() - 1);
    if level > 0 {
        let [nx, ny, nz] = image.levels[level].dims;
        let finest = &image.levels[0].path;
        warning::give!(
            "{}: shows level {level} of {} ({nx} × {ny} × {nz} samples), the finest that fits the \
             limit of bytes; --dataset {finest} reads the finest",
            source.path.display(),
            image.levels.len()
        );
    }
    let time = several::time(source, "axes", image.times as u64, options)?;
    let chosen = channels(source, image, options)?;
    let mut volumes =
        chosen.iter().map(|&channel| volume(source, image, (level, [channel, time]), options));
    let first = volumes.next().expect("at least one channel is chosen")?;
    Ok(Volume { more_channels: volumes.collect::<Result<_>>()?, ..first })
}

/// Returns the channels to read. Those that the metadata turns off are left out, unless they are
/// named.
fn channels(source: &Source, image: &Image, options: &ReadOptions) -> Result<Vec<usize>> {
    let all = options.scalar.is_none() && options.channels.as_ref().is_some_and(Vec::is_empty);
    let is_on = |&number: &usize| image.active[number];
    let on: Vec<usize> = (0..image.channels.len()).filter(is_on).collect();
    if !all || on.is_empty() || on.len() == image.channels.len() {
        return several::channels(source, options, &image.channels);
    }
    let name = |number| Channel::name_of(&image.channels, number);
    let off = (0..image.channels.len()).filter(|number| !is_on(number));
    let off: Vec<String> = off.take(8).map(name).collect();
    warning::give!(
        "{}: leaves out what its metadata turns off ({}); --channels shows what it names",
        source.path.display(),
        off.join(", ")
    );
    Ok(on.into_iter().take(Channel::MOST).collect())
}

/// Reads a channel of a level at a time.
fn volume(
    source: &Source,
    image: &Image,
    (level, [channel, time]): (usize, [usize; 2]),
    options: &ReadOptions,
) -> Result<Volume> {
    let which = (level, [channel, time]);
    let Level { array, dims, lattice, .. } = &image.levels[level];
    let (element, endian) = (array.layout.element, array.layout.endian);
    let grid = Grid { element, endian, dims: *dims, strides: [1; 3], components: 1, step: 1 };
    let size = grid.check(source)?;
    source.spend("the size of the samples in bytes", size as u64)?;
    let check = || source.check_time();
    let (elements, strides) = image.elements(which, [[0; 3], *dims], false, &check)?;
    let grid = Grid { strides, ..grid };
    let component = Component::One(0);
    let mut volume = grid.volume(source, lattice.clone(), elements.into(), component, options)?;
    name(&mut volume.about, image, channel);
    // A slice is a picture, whose rows run down.
    volume.about.orientation = (dims[2] == 1).then_some(Orientation::Y_DOWN);
    Ok(match &image.labels {
        Some(table) => volume.with_labels(table.clone()),
        None => volume,
    })
}

/// Says what the values are of.
fn name(about: &mut About, image: &Image, channel: usize) {
    about.length.clone_from(&image.unit);
    about.modality = image.is_ome.then_some(Modality::Microscopy);
    about.window = image.channels[channel].window;
    if image.labels.is_none() && Channel::have_colors(&image.channels) {
        about.name = Channel::name_of(&image.channels, channel);
        (about.channels, about.channel) = (image.channels.clone(), channel);
    }
}

/// Opens the channels of an image to be read in parts, and says what each is.
///
/// # Errors
/// As [`read`].
pub(crate) fn fields(source: &Source, options: &ReadOptions) -> Result<Vec<(Field, About)>> {
    let opened = open(source, options)?;
    opened.warn(source);
    let image = &opened.image;
    let time = several::time(source, "axes", image.times as u64, options)?;
    let chosen = channels(source, image, options)?;
    let field = |channel: usize| {
        let mut about = About::default();
        name(&mut about, image, channel);
        (Field { image: image.clone(), channel, time }, about)
    };
    Ok(chosen.into_iter().map(field).collect())
}

/// Lists the levels of the image that is shown, and the images of labels.
///
/// # Errors
/// As [`read`].
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    let opened = open(source, options)?;
    let image = &*opened.image;
    // The store is one array.
    if image.levels.iter().all(|level| level.path.is_empty()) {
        return Ok(Vec::new());
    }
    let drawn = (0..image.levels.len()).find(|&level| fits(source, image, level, options));
    let level = |(number, level): (usize, &Level)| {
        let shape: Vec<String> = level.array.layout.shape.iter().map(ToString::to_string).collect();
        Array {
            name: level.path.clone(),
            place: Place::Points,
            kind: format!("{} ({})", level.array.layout.element.name(), shape.join(", ")),
            components: 1,
            range: None,
            is_drawn: drawn == Some(number),
        }
    };
    let of_labels = |name: String| Array {
        name,
        place: Place::Points,
        kind: "labels".into(),
        components: 1,
        range: None,
        is_drawn: false,
    };
    let levels = image.levels.iter().enumerate().map(level);
    Ok(levels.chain(opened.labels.iter().cloned().map(of_labels)).collect())
}
