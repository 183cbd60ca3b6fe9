//! Arrays of three axes and more as volumes.

use super::Header;
use crate::{
    Result,
    formats::{
        Endian, ReadOptions,
        shared::{
            grid::{Component, Element, Grid, too_few},
            holes,
            plain::Plain,
        },
    },
    input::Source,
    volume::{Lattice, Volume},
};
use glam::DVec3;
use std::borrow::Cow;

/// The most components that a last axis may have to be no axis of space.
const MOST_COMPONENTS: u64 = 4;

/// An array whose axes are to be found: its numbers are in order, last axis fastest.
#[derive(Debug, Clone)]
pub struct Shaped {
    pub element: Element,
    pub endian: Endian,
    /// Sizes of the axes, the slowest first.
    pub sizes: Vec<u64>,
    /// The shape as the file's own tools write it, for messages.
    pub shown: String,
    /// The place in the file, for messages.
    pub place: String,
}

/// What the axes of an array are.
struct Axes {
    grid: Grid,
    /// Bytes before the chosen volume.
    skip: usize,
}

/// Reads a volume: an array\[z, y, x\] of numbers, of which the fastest in memory is x. In C order
/// this is the last axis, in Fortran order the first. A fourth axis behind them, of at most four
/// numbers, has the components of vectors or colours ([`ReadOptions::scalar`]). A fourth axis
/// before them has volumes at several times, if [`ReadOptions::time`] chooses one. Axes of one
/// number are skipped. Complex numbers become their magnitude.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not such an array or is cut off;
/// [`Error::Limit`](crate::Error::Limit) for an array over the limits.
pub fn read_volume(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let header = Header::of(source)?;
    let data = &source.bytes()[header.start..];
    volume_of(source, &shaped(&header, "header"), data.into(), options)
}

/// Returns where the samples of an array of three axes are in its file.
///
/// # Errors
/// As [`read_volume`], for the header.
pub(in crate::formats) fn plain(source: &Source) -> Result<Option<Plain>> {
    let header = Header::of(source)?;
    let Element::Real(sample_type) = header.element else { return Ok(None) };
    if header.shape.len() != 3 {
        return Ok(None);
    }
    let axes = shaped(&header, "header").axes(source, &ReadOptions::default())?;
    axes.grid.check(source)?;
    let lattice = Lattice::with_spacing(axes.grid.dims, DVec3::ONE);
    lattice.check().map_err(|message| source.error("header", message))?;
    let (endian, start) = (header.endian, header.start);
    Ok(Some(Plain { path: source.path.to_owned(), start, sample_type, endian, lattice }))
}

pub fn shaped(header: &Header, place: &str) -> Shaped {
    let mut sizes = header.shape.clone();
    if header.is_fortran {
        sizes.reverse();
    }
    Shaped {
        element: header.element,
        endian: header.endian,
        sizes,
        shown: header.shape_text(),
        place: place.into(),
    }
}

/// Makes a volume of the numbers of an array.
///
/// # Errors
/// As [`read_volume`].
pub fn volume_of(
    source: &Source,
    array: &Shaped,
    data: Cow<'_, [u8]>,
    options: &ReadOptions,
) -> Result<Volume> {
    let Axes { grid, skip } = array.axes(source, options)?;
    let size = grid.check(source)?;
    let whole = skip.saturating_add(size);
    if data.len() < whole {
        return Err(too_few(source, data.len(), whole));
    }
    let byte = Element::Real(crate::formats::SampleType::U8);
    let are_colors = grid.element == byte && grid.components >= 3;
    let component = Component::chosen(source, options, grid.components, are_colors)?;
    let part = match data {
        Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[skip..whole]),
        Cow::Owned(mut bytes) => {
            bytes.truncate(whole);
            drop(bytes.drain(..skip));
            Cow::Owned(bytes)
        }
    };
    let lattice = Lattice::with_spacing(grid.dims, DVec3::ONE);
    lattice.check().map_err(|message| source.error(&array.place, message))?;
    let samples = grid.samples(source, part, component)?;
    holes::volume(source, lattice, samples, options)
}

impl Shaped {
    /// Returns the sizes that count: without axes of one number, while there are more than three. A
    /// last axis of a few numbers, which are components, needs three others before it.
    fn counted(&self) -> Vec<u64> {
        let mut sizes = self.sizes.clone();
        let components = |last: u64| (2..=MOST_COMPONENTS).contains(&last);
        while sizes.len() > 3 + usize::from(sizes.last().copied().is_some_and(components)) {
            let Some(one) = sizes.iter().position(|&size| size == 1) else { break };
            sizes.remove(one);
        }
        sizes
    }

    /// Returns the bytes of all numbers; `None` if they exceed 64 bits.
    #[cfg(feature = "hdf5")]
    pub fn bytes(&self) -> Option<u64> {
        let number = self.element.bytes() as u64;
        self.sizes.iter().try_fold(number, |all, &size| all.checked_mul(size))
    }

    /// Returns whether it can be drawn as a volume without a choice.
    pub fn is_volume(&self) -> bool {
        match self.counted()[..] {
            [_, _, _] => true,
            [_, _, _, last] => last <= MOST_COMPONENTS,
            _ => false,
        }
    }

    fn axes(&self, source: &Source, options: &ReadOptions) -> Result<Axes> {
        let counted = self.counted();
        let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
        let grid = |x: u64, y: u64, z: u64, components: u64| {
            let dims = [x, y, z].map(size);
            Grid::interleaved(self.element, self.endian, dims, size(components))
        };
        match (&counted[..], options.time) {
            (&[z, y, x], _) => Ok(Axes { grid: grid(x, y, z, 1), skip: 0 }),
            (&[times, z, y, x], Some(time)) => self.at(source, grid(x, y, z, 1), times, time),
            (&[z, y, x, count @ 2..=MOST_COMPONENTS], _) => {
                Ok(Axes { grid: grid(x, y, z, count), skip: 0 })
            }
            (&[times, z, y, x, count @ 2..=MOST_COMPONENTS], time) => {
                self.at(source, grid(x, y, z, count), times, time.unwrap_or(0))
            }
            (&[times, _, _, _], None) => Err(self.wrong(source).hint(format!(
                "--time 0 takes the first of {times} volumes, if the first axis is time; a last \
                 axis of 2 to 4 numbers has the components of a vector"
            ))),
            _ => Err(self.wrong(source).hint("write one volume of three axes, array[z, y, x]")),
        }
    }

    /// Returns the axes of one of several volumes.
    fn at(&self, source: &Source, grid: Grid, times: u64, time: usize) -> Result<Axes> {
        if time as u64 >= times {
            let message = format!("has {times} volumes, numbered from 0, but {time} is asked for");
            return Err(source.error(&self.place, message).hint("choose another --time"));
        }
        let skip = grid.check(source)?.saturating_mul(time);
        Ok(Axes { grid, skip })
    }

    fn wrong(&self, source: &Source) -> crate::Error {
        let message =
            format!("has the shape {}, but (z, y, x) was expected for a volume", self.shown);
        source.error(&self.place, message)
    }
}
