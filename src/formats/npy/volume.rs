//! Arrays of three axes and more as volumes.

use super::Header;
use crate::{
    Result,
    about::{Frame, Orientation},
    formats::{
        Endian, ReadOptions,
        shared::{
            choice,
            grid::{Component, Element, Grid, too_few},
            plain::Plain,
            several,
        },
    },
    input::Source,
    volume::{Lattice, Volume},
};
use glam::DVec3;
use std::borrow::Cow;

/// The most components that a last axis may have to be no axis of space.
const MOST_COMPONENTS: u64 = 4;

/// The least rows and columns of a picture.
const LEAST_PICTURE: u64 = 16;

/// An array whose axes are to be found: its numbers are in order, last axis fastest.
#[derive(Debug, Clone)]
pub struct Shaped {
    pub element: Element,
    pub endian: Endian,
    /// Sizes of the axes, the slowest first.
    pub sizes: Vec<u64>,
    /// The shape as the file's own tools write it, for messages.
    pub shape_text: String,
    /// The place in the file, for messages.
    pub place: String,
    /// What the volumes along an axis before the three of space are, as in “times”, if the file
    /// says that there is such an axis.
    pub outer: Option<String>,
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
/// number are skipped. Complex numbers become their magnitude. An array\[y, x\], or bytes\[y, x,
/// 3 or 4\], is a picture: a volume of one slice, whose rows run down.
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
    let shaped = shaped(&header, "header");
    if header.shape.len() != 3 || shaped.is_picture() {
        return Ok(None);
    }
    let axes = shaped.axes(source, &ReadOptions::default())?;
    axes.grid.check(source)?;
    let lattice = Lattice::with_spacing(axes.grid.dims, DVec3::ONE);
    lattice.check().map_err(|message| source.error("header", message))?;
    let (endian, start) = (header.endian, header.start);
    let path = source.path.to_owned();
    Ok(Some(Plain { path, start, sample_type, endian, lattice, frame: Frame::Own }))
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
        shape_text: header.shape_text(),
        place: place.into(),
        outer: None,
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
    let are_colors = grid.components >= 3 && (grid.element.is_byte() || array.is_color());
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
    let mut volume = grid.volume(source, lattice, part, component, options)?;
    if array.is_picture() {
        volume.about.orientation = Some(Orientation::Y_DOWN);
    }
    Ok(volume)
}

impl Shaped {
    /// Whether its name is that of colours.
    fn is_color(&self) -> bool {
        let name = self.place.rsplit(['“', '/']).next().unwrap_or_default();
        choice::names_colors(name.trim_end_matches('”'))
    }

    /// Returns the axes that count: without axes of one number, while there are more than three. A
    /// last axis of a few numbers, which are components, needs three others before it.
    pub fn counted_axes(&self) -> Vec<usize> {
        let mut axes: Vec<usize> = (0..self.sizes.len()).collect();
        let components = |last: u64| (2..=MOST_COMPONENTS).contains(&last);
        let last = self.sizes.last().copied().unwrap_or_default();
        let space = 3 + usize::from(components(last) && self.outer.is_none());
        while axes.len() > space {
            let Some(one) = axes.iter().position(|&axis| self.sizes[axis] == 1) else { break };
            axes.remove(one);
        }
        axes
    }

    /// Returns the axes of x, y and z; `None` if there are none. A picture has no z.
    #[cfg(feature = "hdf5")]
    pub fn space(&self) -> Option<[Option<usize>; 3]> {
        let axes = self.counted_axes();
        if let ([y, x] | [y, x, _], true) = (&axes[..], self.is_picture()) {
            return Some([Some(*x), Some(*y), None]);
        }
        let space = match axes[..] {
            [z, y, x] => Some([x, y, z]),
            [_, z, y, x] if self.outer.is_some() => Some([x, y, z]),
            [z, y, x, _] | [_, z, y, x, _] => Some([x, y, z]),
            _ => None,
        };
        space.map(|axes| axes.map(Some))
    }

    /// Whether it is a picture: two axes, or colours of bytes along a third. Arrays of fewer
    /// columns are tables or matrices.
    pub fn is_picture(&self) -> bool {
        match self.sizes[..] {
            [y, x] => y.min(x) >= LEAST_PICTURE,
            [y, x, 3 | 4] => self.element.is_byte() && y.min(x) >= LEAST_PICTURE,
            _ => false,
        }
    }

    fn counted(&self) -> Vec<u64> {
        self.counted_axes().into_iter().map(|axis| self.sizes[axis]).collect()
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
            [_, _, _, _] if self.outer.is_some() => true,
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
            (&[y, x], _) if self.is_picture() => Ok(Axes { grid: grid(x, y, 1, 1), skip: 0 }),
            (&[y, x, count], _) if self.is_picture() => {
                Ok(Axes { grid: grid(x, y, 1, count), skip: 0 })
            }
            (&[z, y, x], _) => Ok(Axes { grid: grid(x, y, z, 1), skip: 0 }),
            (&[times, z, y, x], time) if time.is_some() || self.outer.is_some() => {
                self.at(source, grid(x, y, z, 1), times, options)
            }
            (&[z, y, x, count @ 2..=MOST_COMPONENTS], _) => {
                Ok(Axes { grid: grid(x, y, z, count), skip: 0 })
            }
            (&[times, z, y, x, count @ 2..=MOST_COMPONENTS], _) => {
                self.at(source, grid(x, y, z, count), times, options)
            }
            (&[times, _, _, _], None) => Err(self.wrong(source).hint(format!(
                "--time 0 takes the first of {times} volumes, if the first axis is time; a last \
                 axis of 2 to 4 numbers has the components of a vector"
            ))),
            _ => Err(self.wrong(source).hint("write one volume of three axes, array[z, y, x]")),
        }
    }

    /// Returns the axes of one of several volumes.
    fn at(&self, source: &Source, grid: Grid, times: u64, options: &ReadOptions) -> Result<Axes> {
        let time = several::of_times(
            source,
            &self.place,
            times,
            options,
            self.outer.as_deref().unwrap_or("times"),
        )?;
        let skip = grid.check(source)?.saturating_mul(time);
        Ok(Axes { grid, skip })
    }

    fn wrong(&self, source: &Source) -> crate::Error {
        let message =
            format!("has the shape {}, but (z, y, x) was expected for a volume", self.shape_text);
        source.error(&self.place, message)
    }
}
