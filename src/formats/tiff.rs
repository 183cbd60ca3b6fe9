//! TIFF stacks: the pages of a file are the slices of a volume, as ImageJ, Bio-Formats (OME-TIFF),
//! tifffile and microscopes write them. Follows TIFF 6.0, and the OME data model (2016) and
//! ImageJ's own notes for the meaning of the pages.

mod description;
mod imagej;
mod meaning;
mod ome;
mod pages;

use super::{
    ReadOptions,
    shared::{
        grid::{Component, Grid},
        several,
    },
};
use crate::{
    Result,
    about::{About, Channel, Modality, Orientation},
    input::Source,
    volume::{Lattice, Volume},
};
use glam::DVec3;
use meaning::Meaning;
use pages::{Layout, Pages, Read};
use std::{borrow::Cow, path::PathBuf};

/// Reads the pages of a file as the slices of a volume, in their order. Of a folder, the slices are
/// its TIFF files of one page each, in the order of the numbers in their names (`s9.tif` before
/// `s10.tif`). Rows run along x, columns along y and pages along z. Pages are strips or tiles of 1
/// to 64 bits, uncompressed or compressed by LZW, deflate, PackBits or JPEG. BigTIFF files are read
/// too, and ImageJ's files of one directory for all slices. Previews of lower resolution are
/// skipped.
///
/// ImageJ's and OME's descriptions give the order of slices, channels and times, the distance
/// between samples and its unit, and the names, colours and windows of channels.
/// [`ReadOptions::scalar`] chooses a channel (`channel:1`), [`ReadOptions::channels`] several, and
/// [`ReadOptions::time`] a time; the first is the default. Pages in colours make a volume in
/// colours.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed file, and for pages of different sizes,
/// with the page; [`Error::Limit`](crate::Error::Limit) for sizes over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    if let Some(files) = source.folder() {
        return read_folder(source, files, options);
    }
    let mut pages = Pages::open(source)?;
    let meaning = pages.meaning();
    let stack = pages.stack(&meaning)?;
    let count = stack.count();
    let time = meaning.time(source, count, options)?;
    let channels = Channels::of(&stack, &meaning);
    let chosen = several::channels(source, options, &channels.all)?;
    let mut volumes = chosen.iter().map(|&channel| {
        let (page, component) = channels.place(channel);
        let planes = meaning.planes(source, count, [page, time])?;
        tracing::debug!("{} of {count} pages, channel {channel}", planes.len());
        let is_stored = stack.contiguous.is_some();
        let layout = if is_stored { stack.layout } else { stack.layout.decoded() };
        let grid = layout.grid(planes.len());
        let component = match component {
            Some(component) => component,
            None => Component::chosen(source, options, layout.components, layout.are_colors)?,
        };
        let size = grid.check(source)?;
        let data = match stack.contiguous {
            Some(start) => joined(source, &grid, start, &planes)?,
            None => {
                source.spend("the size of the pages in bytes", size as u64)?;
                pages.read(&stack, &planes)?.into()
            }
        };
        let lattice = lattice(source, &grid, &meaning)?;
        let mut volume = grid.volume(source, lattice, data, component, options)?;
        volume.about.length.clone_from(&meaning.unit);
        volume.about.modality = meaning.is_microscopy.then_some(Modality::Microscopy);
        // One page is a picture, whose rows run down.
        volume.about.orientation = (planes.len() == 1).then_some(Orientation::Y_DOWN);
        channels.name(&mut volume.about, channel);
        Ok(volume)
    });
    joined_channels(&mut volumes)
}

/// Returns the first of some channels, with the others beside it.
fn joined_channels(volumes: &mut dyn Iterator<Item = Result<Volume>>) -> Result<Volume> {
    let first = volumes.next().expect("at least one channel is chosen")?;
    Ok(Volume { more_channels: volumes.collect::<Result<_>>()?, ..first })
}

/// The channels of a file: pages of their own, or several numbers at each pixel that are no colour.
struct Channels {
    all: Vec<Channel>,
    are_pages: bool,
}

impl Channels {
    fn of(stack: &pages::Stack, meaning: &Meaning) -> Self {
        let (paged, layout) = (meaning.paged_channels(stack.count()), &stack.layout);
        if paged < 2 && !layout.are_colors {
            return Self::of_pixels(layout);
        }
        let mut all = meaning.shown.clone();
        all.resize(paged, Channel::default());
        Self { all, are_pages: true }
    }

    /// The channels of one page.
    fn of_pixels(layout: &Layout) -> Self {
        let count = if layout.are_colors { 1 } else { layout.components };
        Self { all: vec![Channel::default(); count], are_pages: layout.are_colors }
    }

    /// Returns the number of a channel among the pages, and which component of the pixels it is:
    /// `None` if the pages are the channels, whose pixels may be colours.
    fn place(&self, channel: usize) -> (usize, Option<Component>) {
        match self.are_pages {
            false => (0, Some(Component::One(channel))),
            true if self.all.len() > 1 => (channel, Some(Component::One(0))),
            true => (0, None),
        }
    }

    /// Says which channel the values are of, if there are several or if it has a colour.
    fn name(&self, about: &mut About, channel: usize) {
        if Channel::have_colors(&self.all) {
            about.name = Channel::name_of(&self.all, channel);
            about.window = self.all[channel].window;
            // Nothing else takes a volume several times over.
            about.modality.get_or_insert(Modality::Microscopy);
            (about.channels, about.channel) = (self.all.clone(), channel);
        }
    }
}

fn lattice(source: &Source, grid: &Grid, meaning: &Meaning) -> Result<Lattice> {
    let lattice = Lattice::with_spacing(grid.dims, DVec3::from(meaning.spacing));
    lattice.check().map_err(|message| source.error("pages", message))?;
    Ok(lattice)
}

/// Returns the bytes of planes that follow one another in the file without compression.
fn joined<'a>(
    source: &'a Source,
    grid: &Grid,
    start: usize,
    planes: &[usize],
) -> Result<Cow<'a, [u8]>> {
    let size = grid.check(source)?;
    let plane = size / planes.len().max(1);
    let bytes = |index: usize| {
        let at = index.checked_mul(plane)?.checked_add(start)?;
        source.bytes().get(at..)?.get(..plane)
    };
    let cut = |index: usize| {
        let message = format!("slice {index} is cut off: {plane} bytes were expected");
        source.error("pages", message)
    };
    let is_run = planes.windows(2).all(|pair| pair[1] == pair[0] + 1);
    if let (true, [first, .., last]) = (is_run, planes) {
        bytes(*last).ok_or_else(|| cut(*last))?;
        let start = start + first * plane;
        return Ok(Cow::Borrowed(&source.bytes()[start..start + size]));
    }
    source.spend("the size of the pages in bytes", size as u64)?;
    let mut all = Vec::with_capacity(size.min(source.bytes().len()));
    for &index in planes {
        all.extend_from_slice(bytes(index).ok_or_else(|| cut(index))?);
    }
    Ok(all.into())
}

/// Returns whether the first bytes are of a TIFF or BigTIFF file, in either byte order.
pub(super) fn is_tiff(bytes: &[u8]) -> bool {
    matches!(bytes.first_chunk(), Some(b"II\x2a\0" | b"MM\0\x2a" | b"II\x2b\0" | b"MM\0\x2b"))
}

/// Returns the TIFF files among those of a folder, by their names.
fn pages_of(files: &[PathBuf]) -> Vec<PathBuf> {
    let is_page = |file: &&PathBuf| {
        let extension = file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        matches!(extension.as_deref(), Some("tif" | "tiff"))
    };
    files.iter().filter(is_page).cloned().collect()
}

/// Returns whether a folder has several TIFF files, which are the slices of a volume.
///
/// # Errors
/// None: the files are not opened.
pub(super) fn is_folder(source: &Source) -> Result<bool> {
    Ok(source.folder().is_some_and(|files| pages_of(files).len() > 1))
}

/// Reads the files of a folder as the slices of a volume, in the order of the numbers in their
/// names (`s9.tif` before `s10.tif`). Each has one page, and all have the same size.
///
/// # Errors
/// As [`read`], with the file.
fn read_folder(source: &Source, files: &[PathBuf], options: &ReadOptions) -> Result<Volume> {
    let mut files = pages_of(files);
    files.sort_by_cached_key(|file| meaning::natural(&file.to_string_lossy()));
    let mut all = Vec::new();
    let mut first: Option<(Layout, Meaning)> = None;
    for path in &files {
        source.check_time()?;
        let file = source.open_beside(path)?;
        let Read { layout, data, meaning } = pages::one(&file)?;
        let (expected, _) = first.get_or_insert((layout, meaning));
        if *expected != layout {
            return Err(file.error("page", layout.differs(expected)));
        }
        source.spend("the size of the pages in bytes", data.len() as u64)?;
        all.extend_from_slice(&data);
        file.intact()?;
    }
    let Some((layout, meaning)) = first else {
        return Err(source.error("path", "holds no TIFF files"));
    };
    let grid = layout.grid(files.len());
    let lattice = lattice(source, &grid, &meaning)?;
    let channels = Channels::of_pixels(&layout);
    let chosen = several::channels(source, options, &channels.all)?;
    let mut volumes = chosen.iter().map(|&channel| {
        let component = match channels.place(channel) {
            (_, Some(component)) => component,
            _ => Component::chosen(source, options, layout.components, layout.are_colors)?,
        };
        let data = Cow::Borrowed(&all[..]);
        let mut volume = grid.volume(source, lattice.clone(), data, component, options)?;
        volume.about.length.clone_from(&meaning.unit);
        channels.name(&mut volume.about, channel);
        Ok(volume)
    });
    joined_channels(&mut volumes)
}

#[cfg(test)]
mod tests;
