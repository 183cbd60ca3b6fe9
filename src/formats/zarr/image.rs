//! The image of a store: what its axes mean, its levels, and where they lie.

use super::{
    array::Layout,
    chunks::{Array, Cache, Check, Chunk},
    nodes::{Found, Node},
    ome::{self, Axis, Shown},
    store::{Store, joined, shared},
};
use crate::{
    Error, Result,
    about::{Channel, Label},
    formats::shared::length::meters,
    input::Source,
    volume::Lattice,
};
use glam::{DMat3, DVec3};
use std::{borrow::Cow, sync::Arc};

/// An image of several levels, channels and times.
pub struct Image {
    /// The finest first.
    pub levels: Vec<Level>,
    /// How the channels are shown; at least one.
    pub channels: Vec<Channel>,
    /// Whether each channel is shown at first.
    pub active: Vec<bool>,
    pub times: usize,
    /// The unit of lengths; empty if the metadata does not say.
    pub unit: String,
    /// Whether the metadata is that of OME.
    pub is_ome: bool,
    /// What is known of the labels, of an image of labels.
    pub labels: Option<Vec<Label>>,
    axes: Axes,
    cache: Cache,
}

/// A level of an image.
pub struct Level {
    /// The path of its array in the store.
    pub path: String,
    pub array: Array,
    /// Samples along x, y and z.
    pub dims: [usize; 3],
    pub lattice: Lattice,
}

/// The numbers of the axes of an array that are x, y and z, the channels and the times.
#[derive(Debug, Clone, Default, PartialEq)]
struct Axes {
    space: [Option<usize>; 3],
    channel: Option<usize>,
    time: Option<usize>,
}

/// Bytes of unpacked chunks that are kept, of images that are read in parts.
const CACHED: usize = 256 << 20;

/// Most channels of an image.
const MOST_CHANNELS: usize = 1 << 12;

/// Most bytes of a chunk.
const MOST_CHUNK: u64 = 1 << 30;

impl Axes {
    /// Finds the axes by their kinds and names, or by their number if they have none.
    fn of(axes: &[Axis], count: usize) -> Result<Self, String> {
        let mut sorted = Self::default();
        if axes.iter().all(|axis| axis.kind.is_empty()) {
            // From the last one on: x, y, z, the channels and the times.
            let at = |back: usize| count.checked_sub(back);
            sorted.space = [at(1), at(2), at(3)];
            (sorted.channel, sorted.time) = (at(4), at(5));
            return if count <= 5 { Ok(sorted) } else { Err(format!("has {count} axes")) };
        }
        let mut spaces = Vec::new();
        for (number, axis) in axes.iter().enumerate() {
            match axis.kind.as_str() {
                "space" => spaces.push(number),
                "channel" => sorted.channel = Some(number),
                "time" => sorted.time = Some(number),
                _ => {}
            }
        }
        if spaces.len() > 3 {
            return Err(format!("has {} axes of space, but at most 3 are read", spaces.len()));
        }
        let named = |name: &str| spaces.iter().copied().find(|&at| axes[at].name == name);
        sorted.space = match [named("x"), named("y"), named("z")] {
            space @ [Some(_), Some(_), _] if space.iter().flatten().count() == spaces.len() => {
                space
            }
            _ => {
                let mut last = spaces.iter().rev().copied();
                [last.next(), last.next(), last.next()]
            }
        };
        Ok(sorted)
    }

    /// Returns an element of the shape for each axis of space; 1 for those that are not there.
    fn sizes(&self, shape: &[usize]) -> [usize; 3] {
        self.space.map(|axis| axis.map_or(1, |axis| shape[axis]))
    }
}

impl Image {
    /// Opens the image that was found in a store.
    ///
    /// # Errors
    /// [`Error::Input`] for metadata that is missing or contradicts itself.
    pub fn open(source: &Source, store: &Arc<Store>, found: Found) -> Result<Self> {
        let arrays = arrays(source, store, &found)?;
        let Found { group, multiscale, attributes, .. } = found;
        let Some((path, first)) = arrays.first() else {
            return Err(wrong(source, &group, "has no levels"));
        };
        let axes = sorted_axes(source, path, first, &multiscale.axes)?;
        let size = |axis: Option<usize>| axis.map_or(1, |axis| first.shape[axis]);
        let (times, of_channel) = (size(axes.time), size(axes.channel));
        if of_channel > MOST_CHANNELS {
            let message =
                format!("has {of_channel} channels, but at most {MOST_CHANNELS} are read");
            return Err(wrong(source, path, message));
        }
        let Shown { mut channels, mut active } = ome::shown(&attributes);
        channels.resize(of_channel, Channel::default());
        active.resize(of_channel, true);
        let unit = axes.space[0].and_then(|axis| multiscale.axes.get(axis));
        let unit = unit.map(|axis| axis.unit.clone()).unwrap_or_default();
        let store = shared(store);
        let mut levels: Vec<Level> = Vec::new();
        for ((path, layout), level) in arrays.into_iter().zip(&multiscale.levels) {
            let dims = axes.sizes(&layout.shape);
            let finest = levels.first().map_or(dims, |first| first.dims);
            let lattice = lattice(&axes, &multiscale.axes, level, [dims, finest]);
            lattice.check().map_err(|message| wrong(source, &path, message))?;
            let array = Array::new(store.clone(), &path, layout);
            levels.push(Level { path, array, dims, lattice });
        }
        let (labels, is_ome) = (ome::labels(&attributes), !attributes.is_null());
        let cache = Cache::new(CACHED);
        Ok(Self { levels, channels, active, times, unit, is_ome, labels, axes, cache })
    }

    /// Returns the first element of a box of samples of a level, of a channel at a time, and the
    /// numbers of elements, along the axes of the array.
    fn of_axes(
        &self,
        (level, [channel, time]): (usize, [usize; 2]),
        [from, count]: [[usize; 3]; 2],
    ) -> [Vec<usize>; 2] {
        let axes = self.levels[level].array.layout.shape.len();
        let (mut first, mut size) = (vec![0; axes], vec![1; axes]);
        for (at, axis) in self.axes.space.into_iter().enumerate() {
            if let Some(axis) = axis {
                (first[axis], size[axis]) = (from[at], count[at]);
            }
        }
        for (axis, at) in [(self.axes.channel, channel), (self.axes.time, time)] {
            if let Some(axis) = axis {
                first[axis] = at;
            }
        }
        [first, size]
    }

    /// Returns a chunk, and keeps it for a while.
    fn kept(&self, level: usize, place: &[usize]) -> Result<Chunk> {
        let array = &self.levels[level].array;
        let bytes = array.layout.chunk_bytes().unwrap_or(usize::MAX);
        self.cache.get((level, place.to_vec()), bytes, || array.chunk(place))
    }

    /// Reads the chunks of some boxes of samples that are read soon, all at once, as many as are
    /// kept. Those that cannot be read are tried again then.
    pub fn fetch(&self, which: (usize, [usize; 2]), parts: &[[[usize; 3]; 2]]) {
        let (level, _) = which;
        let array = &self.levels[level].array;
        let mut places: Vec<Vec<usize>> = Vec::new();
        for part in parts {
            let [first, size] = self.of_axes(which, *part);
            places.extend(array.places([&first, &size]));
        }
        places.sort_unstable();
        places.dedup();
        let bytes = array.layout.chunk_bytes().unwrap_or(usize::MAX);
        places.truncate(CACHED / 2 / bytes.max(1));
        array.read_all(&places, &|place| self.kept(level, place));
    }

    /// Returns the elements of a box of samples of a level, and the steps between them along x, y
    /// and z. Kept chunks are used if `is_part`, and chunks are kept.
    ///
    /// # Errors
    /// Those of reading chunks, and of `check`.
    pub fn elements(
        &self,
        which: (usize, [usize; 2]),
        part: [[usize; 3]; 2],
        is_part: bool,
        check: Check,
    ) -> Result<(Vec<u8>, [usize; 3])> {
        let (level, _) = which;
        let array = &self.levels[level].array;
        let [first, size] = self.of_axes(which, part);
        let read = |place: &[usize]| match is_part {
            true => self.kept(level, place),
            false => array.chunk(place),
        };
        let elements = array.window([&first, &size], &read, check)?;
        let stride = |axis: usize| size[axis + 1..].iter().product();
        Ok((elements, self.axes.space.map(|axis| axis.map_or(1, stride))))
    }
}

/// Returns the error for a node of a store.
fn wrong(source: &Source, node: &str, message: impl Into<String>) -> Error {
    let place = if node.is_empty() { "metadata".into() } else { format!("“{node}”") };
    source.error(place, message)
}

/// Reads the metadata of the arrays of all levels.
fn arrays(source: &Source, store: &Store, found: &Found) -> Result<Vec<(String, Layout)>> {
    let mut arrays: Vec<(String, Layout)> = Vec::new();
    for level in &found.multiscale.levels {
        let path = joined(&found.group, &level.path);
        let layout = match Node::of(store, &path)? {
            Some(Node::Array(layout)) => layout,
            Some(Node::Group(_)) => {
                let message = "is a group where the array of a level is expected";
                return Err(wrong(source, &path, message));
            }
            None => {
                let message = "is the array of a level, but there is no such array";
                return Err(wrong(source, &path, message).hint("copy the whole store"));
            }
        };
        check(source, &path, &layout)?;
        if let Some((_, first)) = arrays.first() {
            if first.shape.len() != layout.shape.len() {
                return Err(wrong(source, &path, "has other axes than the first level"));
            }
            if first.element != layout.element {
                return Err(wrong(source, &path, "has another type than the first level"));
            }
        }
        arrays.push((path, layout));
    }
    Ok(arrays)
}

/// Finds out what the axes of an array are.
fn sorted_axes(source: &Source, path: &str, layout: &Layout, named: &[Axis]) -> Result<Axes> {
    let count = layout.shape.len();
    if !(named.is_empty() || named.len() == count) {
        let message = format!("has {count} axes, but the metadata names {}", named.len());
        return Err(wrong(source, path, message));
    }
    let axes = Axes::of(named, count).map_err(|message| wrong(source, path, message))?;
    if axes.space[1].is_none() {
        let message = "has one axis of space; a volume has three, and a picture two";
        return Err(wrong(source, path, message));
    }
    for (axis, size) in layout.shape.iter().enumerate() {
        let mut known = [axes.channel, axes.time].into_iter().chain(axes.space).flatten();
        if *size > 1 && !known.any(|number| number == axis) {
            let message = format!("has {size} elements along axis {axis}, whose kind is unknown");
            return Err(wrong(source, path, message));
        }
    }
    Ok(axes)
}

/// Checks an array against the limits.
fn check(source: &Source, path: &str, layout: &Layout) -> Result<()> {
    let name = if path.is_empty() { "the array" } else { path };
    if layout.shape.contains(&0) || layout.shape.len() < 2 {
        let shape: Vec<String> = layout.shape.iter().map(usize::to_string).collect();
        let message = format!(
            "has the shape ({}), but a volume has three axes, and a picture two, with elements",
            shape.join(", ")
        );
        return Err(source.error(format!("“{name}”"), message));
    }
    let bytes = layout.chunk_bytes().map_or(u64::MAX, |bytes| bytes as u64);
    if bytes > MOST_CHUNK {
        let message =
            format!("has chunks of {bytes} bytes, but at most {MOST_CHUNK} bytes are read at once");
        return Err(source.error(format!("“{name}”"), message).hint("write it in smaller chunks"));
    }
    // Packed and unpacked.
    source.lend(&format!("unpacking a chunk of {name}"), 2 * bytes)?;
    let index =
        layout.chunks_of_object().iter().try_fold(16u64, |all, n| all.checked_mul(*n as u64));
    let index = index.unwrap_or(u64::MAX);
    source.check_bytes(&format!("the size of a list of chunks of {name} in bytes"), index)?;
    Ok(())
}

/// Returns where the samples of a level lie. Without transformations, they lie amid those of the
/// finest level.
fn lattice(
    axes: &Axes,
    described: &[Axis],
    level: &ome::Level,
    [dims, finest]: [[usize; 3]; 2],
) -> Lattice {
    let ratio = |at: usize| finest[at] as f64 / dims[at].max(1) as f64;
    let is_placed = !level.steps.is_empty();
    let unit = |axis: usize| described.get(axis).and_then(|axis| meters(&axis.unit));
    let first = axes.space[0].and_then(unit);
    let along = |at: usize| {
        let Some(axis) = axes.space[at] else { return (0.0, 1.0) };
        if !is_placed {
            return (0.5 * (ratio(at) - 1.0), ratio(at));
        }
        let factor = unit(axis).zip(first).map_or(1.0, |(unit, first)| unit / first);
        let step = level.steps.get(axis).copied().filter(|step| *step > 0.0).unwrap_or(1.0);
        (factor * level.origin.get(axis).copied().unwrap_or(0.0), factor * step)
    };
    let all = [along(0), along(1), along(2)];
    let (origin, mut steps) = (all.map(|(origin, _)| origin), all.map(|(_, step)| step));
    // A slice is as thick as its samples are wide.
    if axes.space[2].is_none() {
        steps[2] = steps[0];
    }
    Lattice::cartesian(dims, origin.into(), DMat3::from_diagonal(DVec3::from(steps)))
}

/// Returns elements with x fastest, then y and z, of those with other steps between them.
pub fn x_first<'a>(
    elements: &'a [u8],
    [nx, ny, nz]: [usize; 3],
    [x, y, z]: [usize; 3],
    size: usize,
) -> Cow<'a, [u8]> {
    if [x, y, z] == [1, nx, nx * ny] || (nx, ny, nz) == (1, 1, 1) {
        return Cow::Borrowed(elements);
    }
    let mut out = Vec::with_capacity(elements.len());
    for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
        let start = j * y + k * z;
        for i in 0..nx {
            out.extend_from_slice(&elements[(start + i * x) * size..][..size]);
        }
    }
    Cow::Owned(out)
}
