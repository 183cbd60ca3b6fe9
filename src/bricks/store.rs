//! Reading bricks: from a volume in memory, or from a file of which only the header and parts of
//! the directory are in memory.

#[cfg(feature = "zarr")]
use super::levels::Leveled;
use super::{
    Brick, EMPTY, Level,
    cut::Slices,
    file::{Entry, HASH, Listing, Numbers, Refusal, Stored, VERSION, decode, too_short},
    halve::halve,
    level,
};
use crate::{
    Error, Result,
    about::{About, Frame, Orientation},
    container::directory::{Directory, Fault, Kind, Shape},
    error::LimitKind,
    input::{self, Bytes, Limits},
    math::Bounds,
    parallel::prelude::*,
    volume::{Lattice, Samples, Scalar, Volume, steps::Steps},
};
#[cfg(feature = "zarr")]
use crate::{
    formats::{ReadOptions, zarr},
    input::Source,
};
use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

/// The properties of a bricked volume as a whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The lattice of level 0, which is Cartesian.
    pub lattice: Lattice,
    /// The type of the samples of level 0.
    pub scalar: Scalar,
    /// The smallest and the largest value of level 0. Coarser levels lie within.
    pub range: [f64; 2],
    /// What the axes of the world mean.
    pub frame: Frame,
    /// The name of the world's unit (`"mm"`); empty if unknown.
    pub unit: String,
    /// The name of the file that this volume was made from; empty if there is none.
    pub source: String,
}

impl Header {
    /// A header to fill in.
    #[cfg(feature = "zarr")]
    pub(super) fn empty() -> Self {
        let lattice = Lattice::with_spacing([1; 3], glam::DVec3::ONE);
        let (unit, source) = (String::new(), String::new());
        Self { lattice, scalar: Scalar::U8, range: [0.0; 2], frame: Frame::Own, unit, source }
    }

    /// Returns how the subject stands, if that is known.
    pub fn orientation(&self) -> Option<Orientation> {
        (self.frame == Frame::Patient).then_some(Orientation::RAS)
    }

    /// Checks that a volume with this header can be cut into bricks, in memory or in a file. The
    /// error is a message.
    pub(super) fn validate(&self) -> Result<(), String> {
        self.lattice.check()?;
        level::refusal(&self.lattice)?;
        let [low, high] = self.range;
        if !(low <= high && (high - low).is_finite()) {
            return Err(format!(
                "its range of values is {low} … {high}, but both ends must be finite and ascend"
            ));
        }
        Ok(())
    }
}

/// A volume in levels and bricks. Any number of threads may read from it.
///
/// A volume of 48³ samples has two levels:
///
/// ```
/// use splatkit::{bricks::Bricks, volume::phantoms::Phantom};
/// use std::sync::Arc;
///
/// let volume = Phantom::Ball.sample_bytes([48; 3])?;
/// let bricks = Bricks::from_volume(Arc::new(volume))?;
/// let dims: Vec<_> = bricks.levels().iter().map(|level| level.dims).collect();
/// assert_eq!(dims, [[48; 3], [24; 3]]);
/// // The first of the 2 × 2 × 2 bricks of the finest level, one byte for each of its 32³ samples.
/// assert_eq!(bricks.read(0, 0)?.samples.len(), 32 * 32 * 32);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Bricks {
    path: PathBuf,
    header: Header,
    directory: Directory<Listing>,
    origin: Origin,
    limits: Limits,
    about: About,
    more_channels: Vec<Arc<Self>>,
}

enum Origin {
    Memory {
        volume: Arc<Volume>,
        /// The bytes of the samples of level 1 and up.
        coarse: Vec<Vec<u8>>,
        steps: Steps,
    },
    File(Bytes),
    /// An image in levels of its own.
    #[cfg(feature = "zarr")]
    Leveled(Box<Leveled>),
}

impl std::fmt::Debug for Bricks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bricks")
            .field("path", &self.path)
            .field("header", &self.header)
            .finish_non_exhaustive()
    }
}

impl Bricks {
    /// Takes a volume in memory. Computes the coarser levels, and the ranges of all bricks (in
    /// parallel). Bricks are cut when they are read. Coefficients ([`Volume::sharpened`]) are
    /// ignored.
    ///
    /// # Errors
    /// [`Error::Argument`] for a lattice that is not Cartesian or has more bricks than 32 bits can
    /// count, and for a volume that was built by hand and is inconsistent.
    pub fn from_volume(volume: Arc<Volume>) -> Result<Self> {
        volume.validate().map_err(Error::Argument)?;
        let scalar = volume.samples.scalar();
        let header = Header {
            lattice: volume.lattice.clone(),
            scalar,
            range: volume.range,
            frame: volume.about.frame,
            unit: String::new(),
            source: String::new(),
        };
        header.validate().map_err(Error::Argument)?;
        let levels = level::levels(volume.lattice.dims);
        let mut coarse: Vec<Vec<u8>> = Vec::with_capacity(levels.len());
        for level in &levels[..levels.len() - 1] {
            let fine = coarse.last().map_or(volume.samples.bytes(), Vec::as_slice);
            coarse.push(halve(scalar, fine, level.dims));
        }
        let steps = Steps::new(scalar, volume.range);
        let numbers = Numbers::new(levels);
        let entry = |number| {
            let (index, brick) = numbers.brick(number);
            let level = numbers.levels[index];
            let slices = in_memory(&volume, &coarse, index, level);
            Entry::in_memory(slices.range(level.place(brick), &steps))
        };
        let entries: Vec<Entry> = (0..numbers.count).into_par_iter().map(entry).collect();
        let directory = Directory::held(Listing { numbers, scalar, start: 0, end: 0 }, &entries);
        let path = PathBuf::from("memory");
        let origin = Origin::Memory { volume, coarse, steps };
        Ok(Self::of(path, header, directory, (origin, Limits::none())))
    }

    /// Opens a file: reads and checks the header and the root of the directory, and maps the rest.
    /// Bricks of a remote object ([`address`](crate::input::address())) are fetched when they are
    /// read.
    ///
    /// # Errors
    /// [`Error::Input`] for other files, other versions, damaged headers and directories, and files
    /// that are truncated or have data after their end. [`Error::Limit`] and [`Error::File`] as for
    /// every input.
    pub fn open(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        let path = &input::address(path.as_ref());
        Self::new(path, Bytes::open(path, limits)?, limits)
    }

    /// Takes the bytes of a file. Errors call it `name`.
    ///
    /// # Errors
    /// [`Error::Input`] as for [`open`](Self::open).
    pub fn from_bytes(bytes: Vec<u8>, name: impl AsRef<Path>) -> Result<Self> {
        Self::new(name.as_ref(), Bytes::Held(bytes), &Limits::default())
    }

    fn of(
        path: PathBuf,
        header: Header,
        directory: Directory<Listing>,
        (origin, limits): (Origin, Limits),
    ) -> Self {
        let (about, more_channels) = (About::default(), Vec::new());
        Self { path, header, directory, origin, limits, about, more_channels }
    }

    /// Opens the channels of an image that is stored in levels of its own (OME-Zarr): those that
    /// the options name. Chunks are read when bricks are.
    ///
    /// # Errors
    /// [`Error::Input`] for metadata and chunks that are damaged, and for an image that cannot be
    /// cut into bricks; [`Error::Limit`] and [`Error::File`] as for every input.
    #[cfg(feature = "zarr")]
    pub(crate) fn open_store(source: &Source, options: &ReadOptions) -> Result<Self> {
        let mut channels = zarr::fields(source, options)?.into_iter().map(|(field, about)| {
            let (leveled, header) = Leveled::open(source, field, options)?;
            let numbers = Numbers::new(leveled.levels().to_vec());
            let listing = Listing { numbers, scalar: header.scalar, start: 0, end: 0 };
            // Nothing is known of the bricks before they are read.
            let directory = Directory::held(listing, &[]);
            let origin = (Origin::Leveled(Box::new(leveled)), source.limits.clone());
            let bricks = Self::of(source.path.to_owned(), header, directory, origin);
            Ok(Self { about, ..bricks })
        });
        let first = channels.next().expect("at least one channel is chosen")?;
        let others = channels.map(|channel| channel.map(Arc::new));
        Ok(Self { more_channels: others.collect::<Result<_>>()?, ..first })
    }

    /// What the file says about the values, beyond the header.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// The other channels of the file that were opened, at the same place.
    pub fn more_channels(&self) -> &[Arc<Self>] {
        &self.more_channels
    }

    pub(super) fn new(path: &Path, bytes: Bytes, limits: &Limits) -> Result<Self> {
        let begun = bytes.begun(|bytes| begin(path, bytes, limits));
        let (header, directory) = begun.map_err(|error| bytes.why(path, error))?;
        let (path, limits) = (path.to_owned(), limits.clone());
        Ok(Self::of(path, header, directory, (Origin::File(bytes.ready()), limits)))
    }

    /// The properties of the volume as a whole.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The path that errors name: the volume's file, or `memory`.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The levels, finest first; the last one is one brick.
    pub fn levels(&self) -> &[Level] {
        &self.directory.kind().numbers.levels
    }

    /// Returns one of the levels.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn level(&self, level: usize) -> &Level {
        &self.levels()[level]
    }

    /// Returns where the samples of a level lie. Level l has 2^l steps of level 0 between samples.
    /// Its first sample is in the middle of the samples that it is the mean of, at (2^l − 1)/2
    /// steps along each axis. An axis of one sample is not halved and stays as it is.
    pub fn lattice(&self, level: usize) -> Lattice {
        level::lattice(&self.header.lattice, level)
    }

    /// Returns the smallest and largest world coordinates of the samples of level 0.
    pub fn bounds(&self) -> Bounds {
        self.header.lattice.bounds()
    }

    /// Returns, for each brick of a level, the range of all its blocks ([`Brick::blocks`]). A brick
    /// may be skipped if `high < first_visible[low]`
    /// ([`first_visible`](crate::volume::reach::first_visible)).
    ///
    /// If a part of the directory cannot be read, the ranges there are 0 to 255, so that these
    /// bricks are read, and that returns the error. So are those of images in levels of their own,
    /// of which nothing is known before.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn ranges(&self, level: usize) -> Vec<[u8; 2]> {
        let mut ranges = vec![[0, 255]; self.level(level).bricks()];
        for (brick, range) in self.ranges_within(level, |_| true) {
            ranges[brick as usize] = range;
        }
        ranges
    }

    /// Returns the bricks of some groups of a level, in any order, with their ranges as
    /// [`ranges`](Self::ranges) does. `wanted` decides by the first and the last brick of a group
    /// along each axis.
    pub(super) fn ranges_within(
        &self,
        level: usize,
        wanted: impl Fn([[usize; 3]; 2]) -> bool + Sync,
    ) -> Vec<(u32, [u8; 2])> {
        let size = *self.level(level);
        let numbers = &self.directory.kind().numbers;
        let groups = size.groups().into_par_iter().filter(|group| wanted(*group));
        let groups: Vec<[[usize; 3]; 2]> = groups.collect();
        let at = |[x, y, z]: [usize; 3]| {
            let [nx, ny, _] = size.brick_dims;
            ((z * ny + y) * nx + x) as u32
        };
        let ends = |group: &[[usize; 3]; 2]| group.map(|end| numbers.number(level, at(end)));
        #[cfg(feature = "zarr")]
        if let Origin::Leveled(_) = &self.origin {
            let of_group = |[first, last]: &[[usize; 3]; 2]| {
                let [z, y, x] = [2, 1, 0].map(|axis| first[axis]..=last[axis]);
                let rows = z.flat_map(move |z| y.clone().map(move |y| (y, z)));
                let places = rows.flat_map(move |(y, z)| x.clone().map(move |x| [x, y, z]));
                places.map(|place| (at(place), [0, 255])).collect::<Vec<_>>()
            };
            return groups.par_iter().flat_map_iter(of_group).collect();
        }
        // What cannot be fetched together is read one by one, which returns the error.
        self.directory.prepare(self.bytes(), groups.iter().flat_map(ends)).ok();
        let of_group = |group: &[[usize; 3]; 2]| {
            let [first, last] = ends(group);
            let mut ranges = Vec::with_capacity((last - first) as usize + 1);
            let mut number = first;
            while number <= last {
                let run = self.directory.run(self.bytes(), number).ok();
                let end = self.directory.run_end(number).min(last + 1);
                for number in number..end {
                    let range = run.as_ref().map_or([0, 255], |(first, entries)| {
                        entries[(number - first) as usize].range
                    });
                    ranges.push((numbers.brick(number).1, range));
                }
                number = end;
            }
            ranges
        };
        groups.par_iter().flat_map_iter(of_group).collect()
    }

    /// Bytes of the samples of a brick.
    pub fn brick_bytes(&self) -> usize {
        super::SIDE.pow(3) * self.header.scalar.bytes()
    }

    /// Reads a brick and checks its checksum. Any thread may call this.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such brick, [`Error::Input`] if it is damaged.
    pub fn read(&self, level: usize, brick: u32) -> Result<Brick> {
        let size = self.levels().get(level).filter(|size| (brick as usize) < size.bricks());
        let size = *size.ok_or_else(|| {
            Error::Argument(format!(
                "{}: there is no brick {brick} of level {level}",
                self.path.display()
            ))
        })?;
        match &self.origin {
            Origin::Memory { volume, coarse, steps } => {
                Ok(in_memory(volume, coarse, level, size).brick(size.place(brick), steps))
            }
            #[cfg(feature = "zarr")]
            Origin::Leveled(leveled) => leveled.read(level, brick),
            Origin::File(bytes) => {
                let entry = self.entry(level, brick)?;
                let range = entry.place.range();
                let decode = |stored: &[u8]| decode(&entry, stored, self.header.scalar);
                bytes.decoded(range.clone(), decode)?.map_err(|message| {
                    let place = format!("level {level}, brick {brick} (byte {})", range.start);
                    bytes.why(&self.path, damaged(&self.path, place, message))
                })
            }
        }
    }

    /// Returns the bytes of the file that a brick takes.
    pub(super) fn place(&self, level: usize, brick: u32) -> Result<Range<u64>> {
        Ok(self.entry(level, brick)?.place.range())
    }

    fn entry(&self, level: usize, brick: u32) -> Result<Entry> {
        let number = self.directory.kind().numbers.number(level, brick);
        self.directory.entry(self.bytes(), number).map_err(|fault| self.fault(fault))
    }

    /// Returns the error for a fault of the directory.
    pub(super) fn fault(&self, fault: Fault) -> Error {
        let error = error_of(&self.path, fault);
        match self.bytes() {
            Some(file) => file.why(&self.path, error),
            None => error,
        }
    }

    pub(super) fn directory(&self) -> &Directory<Listing> {
        &self.directory
    }

    /// Reads bricks in parallel, as [`read`](Self::read) does: their levels and numbers are given.
    /// Those of a remote object are fetched together.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub fn read_all(&self, bricks: &[(usize, u32)]) -> Result<Vec<Brick>> {
        self.fetch(bricks.iter().copied())?;
        bricks.par_iter().map(|&(level, brick)| self.read(level, brick)).collect()
    }

    /// Fetches bricks of a remote object together, which are read soon. Leaves out those that do
    /// not exist.
    pub(super) fn fetch(&self, bricks: impl Iterator<Item = (usize, u32)>) -> Result<()> {
        #[cfg(feature = "zarr")]
        if let Origin::Leveled(leveled) = &self.origin {
            leveled.fetch(bricks);
            return Ok(());
        }
        let Origin::File(bytes) = &self.origin else { return Ok(()) };
        let exists = |&(level, brick): &(usize, u32)| {
            self.levels().get(level).is_some_and(|size| (brick as usize) < size.bricks())
        };
        let numbers = &self.directory.kind().numbers;
        let wanted: Vec<(usize, u32)> = bricks.filter(exists).collect();
        let all = wanted.iter().map(|&(level, brick)| numbers.number(level, brick));
        self.directory.prepare(Some(bytes), all).map_err(|fault| self.fault(fault))?;
        let entries = wanted.iter().map(|&(level, brick)| self.entry(level, brick));
        let places = entries.map(|entry| Ok(Listing::place(&entry?).range()));
        bytes.fetch(places.collect::<Result<Vec<_>>>()?.into_iter())
    }

    /// Returns the samples of a whole level, in memory. Its range is that of level 0.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such level, [`Error::Input`] for damaged bricks, and
    /// [`Error::Limit`] for a level larger than the limits allow.
    pub fn volume(&self, level: usize) -> Result<Volume> {
        let missing =
            || Error::Argument(format!("{}: there is no level {level}", self.path.display()));
        let size = *self.levels().get(level).ok_or_else(missing)?;
        let scalar = self.header.scalar;
        let [nx, ny, _] = size.dims;
        let [bx, by, _] = size.brick_dims;
        let row = nx * scalar.bytes();
        // Twice: as bytes and as samples. Bricks of one value take no bytes in the file, so its
        // size is no bound.
        self.check_memory(&format!("the size of level {level} in bytes"), size.dims[2], size, 2)?;
        let mut bytes = vec![0; size.slice() * size.dims[2] * scalar.bytes()];
        // Each layer of bricks is its own chunk.
        self.fetch((0..size.bricks() as u32).map(|brick| (level, brick)))?;
        bytes.par_chunks_mut(super::SIDE * ny * row).enumerate().try_for_each(
            |(layer, slices)| {
                for number in layer * bx * by..(layer + 1) * bx * by {
                    let brick = self.read(level, number as u32)?;
                    let [x, y, _] = size.place(number as u32).map(|at| at * super::SIDE);
                    let width = super::SIDE.min(nx - x) * scalar.bytes();
                    let rows = brick.samples.chunks(super::SIDE * scalar.bytes()).enumerate();
                    for (at, samples) in rows {
                        let (j, k) = (y + at % super::SIDE, at / super::SIDE);
                        let start = (k * ny + j) * row + x * scalar.bytes();
                        if j < ny
                            && let Some(place) = slices.get_mut(start..start + width)
                        {
                            place.copy_from_slice(&samples[..width]);
                        }
                    }
                }
                Ok::<(), Error>(())
            },
        )?;
        let samples = Samples::from_bytes(scalar, &bytes);
        let mut volume = Volume::checked(self.lattice(level), samples)
            .map_err(|message| damaged(&self.path, "samples", message))?;
        volume.range = self.header.range;
        volume.about.clone_from(&self.about);
        Ok(volume)
    }

    /// Refuses slices of a level whose samples, times `times`, exceed the limits.
    pub(super) fn check_memory(
        &self,
        what: &str,
        slices: usize,
        level: Level,
        times: u64,
    ) -> Result<()> {
        let slice = (level.dims[0] as u64).saturating_mul(level.dims[1] as u64);
        let bytes =
            slice.saturating_mul(slices as u64).saturating_mul(self.header.scalar.bytes() as u64);
        self.limits.check(LimitKind::Bytes, &self.path, what, bytes.saturating_mul(times))
    }

    /// Returns the bytes of a file; `None` for other volumes.
    pub(super) fn bytes(&self) -> Option<&Bytes> {
        match &self.origin {
            Origin::File(bytes) => Some(bytes),
            _ => None,
        }
    }
}

impl Slices<'_> {
    fn range(&self, place: [usize; 3], steps: &Steps) -> [u8; 2] {
        self.blocks(place, steps).iter().fold(EMPTY, |all, &block| super::joined(all, block))
    }
}

/// Reads and checks the beginning of a file: the header and the root of the directory.
fn begin(path: &Path, file: &Bytes, limits: &Limits) -> Result<(Header, Directory<Listing>)> {
    let stored = Stored::decode(&file.beginning(0)?).map_err(|refusal| refused(path, refusal))?;
    let present = file.len();
    let end = stored.file_bytes;
    if present < end {
        return Err(incomplete(path, format!("byte {present} of {end}")));
    }
    if present > end {
        return Err(damaged(
            path,
            format!("byte {end}"),
            format!("{} bytes follow the end", present - end),
        ));
    }
    let fail = |message| damaged(path, "directory", message);
    let numbers = Numbers::new(level::levels(stored.header.lattice.dims));
    let count = numbers.count;
    // Each brick has a record, so that the time to read them is bounded by the file.
    if end / (Listing::ENTRY as u64) < u64::from(count) {
        return Err(fail(too_short(count)));
    }
    let start = (stored.length() + Shape::of(count).root_length::<Listing>()) as u64;
    let kind = Listing {
        numbers,
        scalar: stored.header.scalar,
        start,
        end: end.saturating_sub(HASH as u64),
    };
    let (head, place) = (file.beginning(start)?, (stored.length(), kind.end));
    let directory =
        Directory::open(kind, count, place, &head).map_err(|fault| error_of(path, fault))?;
    limits.check(LimitKind::Bytes, path, "the size of the file in bytes", present)?;
    Ok((stored.header, directory))
}

/// The error for a fault of the directory.
fn error_of(path: &Path, fault: Fault) -> Error {
    match fault {
        Fault::Incomplete(place) => incomplete(path, place),
        Fault::Damaged(place, message) => damaged(path, place, message),
        Fault::Unread(error) => error,
    }
}

fn in_memory<'a>(
    volume: &'a Volume,
    coarse: &'a [Vec<u8>],
    number: usize,
    level: Level,
) -> Slices<'a> {
    let samples = number.checked_sub(1).map_or(volume.samples.bytes(), |above| &coarse[above]);
    Slices::whole(level, volume.samples.scalar(), 0, samples)
}

fn refused(path: &Path, refusal: Refusal) -> Error {
    match refusal {
        Refusal::Incomplete => incomplete(path, "header"),
        Refusal::Foreign => Error::input(path, "header", "is not a volume in bricks")
            .hint("give a .splv file, or convert the source to one"),
        Refusal::Version(version) => Error::input(
            path,
            "header",
            format!("has version {version}; version {VERSION} can be read"),
        )
        .hint("convert the source again, or use the release that wrote the file"),
        Refusal::Damaged(message) => damaged(path, "header", message),
    }
}

fn incomplete(path: &Path, place: impl Into<String>) -> Error {
    Error::input(path, place, "the file is incomplete: it ends before its last brick")
        .hint("copy or convert it again")
}

fn damaged(path: &Path, place: impl Into<String>, message: impl Into<String>) -> Error {
    Error::input(path, place, message).hint("the file is damaged: copy or convert it again")
}
