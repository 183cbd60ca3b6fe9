//! Guarded access to input files. Every format reads its bytes through a [`Source`]. It maps the
//! file, holds the limits and creates errors that name the file.

use super::{Limits, address::is_remote, budget::Budget, copy, mapping::Mapping, remote::Remote};
use crate::{Error, Result, error::LimitKind, memory};
use std::{
    any::Any,
    borrow::Cow,
    fs::File,
    io::Read,
    ops::Range,
    path::{Path, PathBuf},
    sync::{Arc, OnceLock},
    time::Duration,
};

/// Bytes that are unpacked between two checks of the time limit.
const PORTION: u64 = 16 << 20;

/// Below this number of bytes, the system is not asked for available memory.
const SMALL: u64 = 64 << 10;

/// Where the bytes of an input are.
enum Content<'a> {
    Mapped(Mapping),
    /// Bytes from the caller, instead of a file.
    Held(&'a [u8]),
    /// An object that is fetched in ranges.
    Remote(Remote),
    /// The files of a folder.
    Listed(Vec<PathBuf>),
}

/// An opened input: its path, its bytes (mapped) and the limits that apply to it.
pub struct Source<'a> {
    /// The path of the file; for bytes in memory, the name that errors give.
    pub path: &'a Path,
    /// What reading this input may take.
    pub limits: &'a Limits,
    content: Content<'a>,
    /// Text of the file that a reader borrows from, as a copy.
    text: OnceLock<String>,
    /// What a reader has parsed, for readers that look at the same part later.
    parsed: OnceLock<Arc<dyn Any + Send + Sync>>,
    /// Shared by all files of a model.
    budget: Arc<Budget>,
}

impl<'a> Source<'a> {
    /// Opens and maps a regular file. A remote object ([`address`](super::address())) is fetched as
    /// a whole first, within the limits; files that it refers to are not read.
    ///
    /// # Errors
    /// [`Error::File`] for a missing file or one that cannot be opened, [`Error::Input`] for
    /// directories and devices, and [`Error::Limit`] for a file over the byte limit.
    pub fn open(path: &'a Path, limits: &'a Limits) -> Result<Self> {
        Self::open_within(path, limits, Arc::new(Budget::new()))
    }

    /// As [`open`](Self::open), but does not fetch a remote object: for readers that take all bytes
    /// from [`part`](Self::part).
    pub(crate) fn open_in_parts(path: &'a Path, limits: &'a Limits) -> Result<Self> {
        if !is_remote(path) {
            return Self::open(path, limits);
        }
        let (mut remote, budget) = (Remote::open(path, limits)?, Arc::new(Budget::new()));
        budget.spend(limits, path, "the object's size in bytes", remote.len())?;
        budget.opened(path);
        // A file in pieces has the time limit for each batch of them.
        remote.ready();
        let content = Content::Remote(remote);
        Ok(Self::of(path, limits, content, budget))
    }

    fn of(path: &'a Path, limits: &'a Limits, content: Content<'a>, budget: Arc<Budget>) -> Self {
        Self { path, limits, content, text: OnceLock::new(), parsed: OnceLock::new(), budget }
    }

    /// Returns whether this is a store of Zarr, of which only the objects that are needed are read.
    pub(crate) fn is_store(&self) -> bool {
        self.folder().is_some_and(<[PathBuf]>::is_empty) && super::is_store(self.path)
    }

    /// Opens a file that belongs to this one: it refers to it, by a path from
    /// [`neighbour`](Self::neighbour), or both are read together. Both share one budget.
    pub(crate) fn open_beside<'b>(&self, path: &'b Path) -> Result<Source<'b>>
    where
        'a: 'b,
    {
        Source::open_within(path, self.limits, self.budget.clone())
    }

    fn open_within(path: &'a Path, limits: &'a Limits, budget: Arc<Budget>) -> Result<Self> {
        let content = Content::Mapped(map_within(path, limits, &budget)?);
        Ok(Self::of(path, limits, content, budget))
    }

    /// Creates the source of a folder with these files.
    pub(super) fn of_folder(path: &'a Path, limits: &'a Limits, files: Vec<PathBuf>) -> Self {
        Self::of(path, limits, Content::Listed(files), Arc::new(Budget::new()))
    }

    /// Creates the source of another file that is mapped already. Both share one budget.
    pub(super) fn beside<'b>(&self, path: &'b Path, mapping: Mapping) -> Source<'b>
    where
        'a: 'b,
    {
        Source::of(path, self.limits, Content::Mapped(mapping), self.budget.clone())
    }

    /// Returns the files of a folder, ordered by their paths; `None` for a file or bytes in memory.
    pub fn folder(&self) -> Option<&[PathBuf]> {
        match &self.content {
            Content::Listed(files) => Some(files),
            Content::Mapped(_) | Content::Held(_) | Content::Remote(_) => None,
        }
    }

    /// Maps a file as [`open`](Self::open) does, for callers that read from it later.
    pub(crate) fn map(path: &Path, limits: &Limits) -> Result<Mapping> {
        map_within(path, limits, &Budget::new())
    }

    /// Returns what `parse` makes of the file. It is parsed once: whoever asks for the same type
    /// later gets the same.
    pub(crate) fn parsed<T: Any + Send + Sync>(
        &self,
        parse: impl FnOnce(&Self) -> Result<T>,
    ) -> Result<Arc<T>> {
        let before = self.parsed.get().and_then(|parsed| parsed.clone().downcast().ok());
        if let Some(parsed) = before {
            return Ok(parsed);
        }
        let made = Arc::new(parse(self)?);
        // Of several types, the first is kept.
        self.parsed.set(made.clone()).ok();
        Ok(made)
    }

    /// Returns the files opened so far: this one, and those it refers to that a reader has opened.
    pub fn files(&self) -> Vec<PathBuf> {
        self.budget.files()
    }

    /// Records the number of times that the file holds, and the one that is read.
    pub(crate) fn choose_time(&self, count: u64, time: usize) {
        self.budget.choose_time(count, time);
    }

    /// Returns the number of times that the input holds, and the one that is read; `None` if no
    /// reader has come across times.
    pub(crate) fn times(&self) -> Option<(u64, usize)> {
        self.budget.times()
    }

    /// Uses bytes instead of a file, for programs that get their data from elsewhere. `name` stands
    /// for the path in errors; its extension gives the format where readers look at extensions.
    /// There is no folder, so files that the bytes refer to are not read. Missing materials and
    /// pictures are left out with a warning; missing data are an error.
    ///
    /// # Errors
    /// [`Error::Limit`] for more bytes than the limits allow.
    pub fn from_bytes(name: &'a Path, bytes: &'a [u8], limits: &'a Limits) -> Result<Self> {
        let budget = Arc::new(Budget::new());
        budget.spend(limits, name, "the file's size in bytes", bytes.len() as u64)?;
        Ok(Self::of(name, limits, Content::Held(bytes), budget))
    }

    /// Returns the bytes of the caller, if they stand for a file.
    pub(crate) fn held(&self) -> Option<&[u8]> {
        match self.content {
            Content::Held(bytes) => Some(bytes),
            _ => None,
        }
    }

    /// Returns whether this source holds bytes from the caller or from a server, which have no
    /// neighbouring files.
    pub(crate) fn is_alone(&self) -> bool {
        matches!(self.content, Content::Held(_)) || is_remote(self.path)
    }

    /// Returns all bytes of the file; none for a folder and for an object that is read in parts.
    pub fn bytes(&self) -> &[u8] {
        match &self.content {
            Content::Mapped(mapping) => mapping,
            Content::Held(bytes) => bytes,
            Content::Remote(_) | Content::Listed(_) => &[],
        }
    }

    /// Returns the number of all bytes.
    pub(crate) fn len(&self) -> usize {
        match &self.content {
            Content::Remote(remote) => usize::try_from(remote.len()).unwrap_or(usize::MAX),
            _ => self.bytes().len(),
        }
    }

    /// Returns a range of bytes, which must lie within the file.
    ///
    /// # Errors
    /// Those of fetching it, and [`Error::Memory`] if it is too large to hold.
    pub(crate) fn part(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>> {
        match &self.content {
            Content::Remote(remote) => {
                let bytes = range.len() as u64;
                if bytes >= SMALL {
                    let room = memory::room("reading a part of an object", 2 * bytes);
                    room.map_err(|error| error.in_file(self.path))?;
                }
                let range = range.start as u64..range.end as u64;
                Ok(Cow::Owned(remote.read(range)?.into()))
            }
            _ => Ok(Cow::Borrowed(&self.bytes()[range])),
        }
    }

    /// Says that these ranges are read soon, so that those of a remote object are fetched together.
    pub(crate) fn fetch(&self, ranges: impl Iterator<Item = Range<usize>>) -> Result<()> {
        let Content::Remote(remote) = &self.content else { return Ok(()) };
        let ranges = ranges.map(|range| range.start as u64..range.end as u64);
        remote.fetch(&ranges.collect::<Vec<_>>())
    }

    /// Checks that the file has not changed since it was opened. If it has, what was read may match
    /// neither the old nor the new content. Readers of whole files call this when they have
    /// finished.
    ///
    /// # Errors
    /// [`Error::Input`] that says how the file has changed.
    pub fn intact(&self) -> Result<()> {
        match &self.content {
            Content::Mapped(mapping) => intact(mapping, self.path),
            // The server says if an object has changed, whenever a part is fetched.
            Content::Held(_) | Content::Remote(_) | Content::Listed(_) => Ok(()),
        }
    }

    /// Returns the text of a file that people write, as a copy: text that was checked stays as it
    /// is. `what` names it in errors (“a transfer function”).
    ///
    /// # Errors
    /// [`Error::Input`] for more than `most` bytes, for text that is not UTF-8, and for a file that
    /// changed.
    pub fn small_text(&self, what: &str, most: usize) -> Result<String> {
        let size = self.bytes().len();
        if size > most {
            return Err(
                self.error("file", format!("has {size} bytes, but {what} may have at most {most}"))
            );
        }
        let text = copy::text(self.bytes());
        self.intact()?;
        text.map_err(|at| self.error(format!("byte {at}"), "is not UTF-8 text"))
    }

    /// Returns a part of the file as text, copied and kept as long as this source. Only one part
    /// can be kept: a second call returns the first text. `what` names it in errors.
    pub(crate) fn keep_text(&self, bytes: &[u8], what: &str) -> Result<&str> {
        self.room::<u8>("the text", bytes.len())?;
        let text = copy::text(bytes)
            .map_err(|at| self.error(format!("byte {at}"), format!("{what} is not UTF-8 text")))?;
        Ok(self.text.get_or_init(|| text))
    }

    /// Returns `result`, which reading gave, unless the file has changed meanwhile. Then it
    /// returns only the error that says so.
    pub(crate) fn unless_changed<T>(&self, result: Result<T>) -> Result<T> {
        self.intact().and(result)
    }

    /// See [`Mapping::release`].
    pub(crate) fn release(&self) {
        if let Content::Mapped(mapping) = &self.content {
            mapping.release();
        }
    }

    /// Returns the mapping, for callers that read from it later; `None` for bytes from the caller
    /// and for folders.
    pub(crate) fn into_mapping(self) -> Option<Mapping> {
        match self.content {
            Content::Mapped(mapping) => Some(mapping),
            Content::Held(_) | Content::Remote(_) | Content::Listed(_) => None,
        }
    }

    /// Creates an input error at a place in this file (`"line 12"`, `"byte 407"`, `"header"`).
    pub fn error(&self, place: impl Into<String>, message: impl Into<String>) -> Error {
        Error::input(self.path, place, message)
    }

    /// Checks a claimed count against [`Limits::points`].
    pub fn check_points(&self, what: &str, count: u64) -> Result<usize> {
        self.check(LimitKind::Points, what, count)
    }

    /// Checks a claimed number of bytes against [`Limits::bytes`], without adding them to the
    /// budget.
    pub fn check_bytes(&self, what: &str, bytes: u64) -> Result<usize> {
        self.check(LimitKind::Bytes, what, bytes)
    }

    /// Checks a nesting depth against [`Limits::depth`].
    pub(crate) fn check_depth(&self, place: &str, depth: usize) -> Result<()> {
        self.limits.check(
            LimitKind::Depth,
            self.path,
            format!("{place}: the nesting depth"),
            depth as u64,
        )
    }

    /// Checks that reading is within its time limit ([`Limits::seconds`]).
    pub(crate) fn check_time(&self) -> Result<()> {
        self.budget.check_time(self.limits, self.path)
    }

    /// Returns the time that is left for reading.
    pub(crate) fn time_left(&self) -> Duration {
        self.budget.left(self.limits)
    }

    /// Returns the time limit, for a decoder that outlives this borrow.
    #[cfg(feature = "hdf5")]
    pub(crate) fn watch(&self) -> Watch {
        Watch { budget: self.budget.clone(), limits: self.limits.clone() }
    }

    /// Restarts the clock of the time limit, for the next pieces of a file that is read in pieces.
    pub(crate) fn restart_time(&self) {
        self.budget.restart();
    }

    /// Adds bytes to what this input occupies ([`Limits::bytes`]), and asks the system whether that
    /// much memory is available.
    pub(crate) fn spend(&self, what: &str, bytes: u64) -> Result<()> {
        self.budget.spend(self.limits, self.path, what, bytes)?;
        // Readers add small amounts for each item.
        if bytes < SMALL {
            return Ok(());
        }
        let what = what
            .strip_prefix("the size of ")
            .and_then(|what| what.strip_suffix(" in bytes"))
            .unwrap_or(what);
        memory::room(&format!("reading {what}"), bytes).map_err(|error| error.in_file(self.path))
    }

    /// Checks memory that a decoder takes and gives back. It must fit beside what this input
    /// occupies, but does not add to it.
    pub(crate) fn lend(&self, what: &str, bytes: u64) -> Result<()> {
        self.budget.lend(self.limits, self.path, what, bytes)?;
        if bytes < SMALL {
            return Ok(());
        }
        memory::room(what, bytes).map_err(|error| error.in_file(self.path))
    }

    /// As [`spend`](Self::spend), for an array of `count` items. `what` names its contents.
    pub(crate) fn room<T>(&self, what: &str, count: usize) -> Result<()> {
        self.spend(
            &format!("the size of {what} in bytes"),
            (count as u64).saturating_mul(size_of::<T>() as u64),
        )
    }

    fn check(&self, kind: LimitKind, what: &str, value: u64) -> Result<usize> {
        self.limits.check(kind, self.path, what, value)?;
        // A 32-bit `usize` may be smaller than a limit.
        usize::try_from(value)
            .map_err(|_| self.error(what, format!("is {value}, more than this machine can count")))
    }

    /// Unpacks a stream whose unpacked size is known. A stream that ends early or holds more than
    /// `expected` bytes is an error. Memory grows with the bytes actually unpacked, so a false size
    /// allocates nothing.
    pub fn unpack(&self, place: &str, mut stream: impl Read, expected: usize) -> Result<Vec<u8>> {
        // `spend` would also ask the system for the memory. That is not needed here: the list grows
        // with the unpacked bytes, and `read_to_end` returns an error if memory runs out.
        self.budget.spend(self.limits, self.path, "the unpacked size in bytes", expected as u64)?;
        let mut out = Vec::new();
        loop {
            self.check_time()?;
            let before = out.len();
            let most = PORTION.min(expected as u64 + 1 - before as u64);
            let read = stream.by_ref().take(most).read_to_end(&mut out);
            read.map_err(|e| {
                self.error(place, format!("cannot be unpacked after {} bytes: {e}", out.len()))
            })?;
            if out.len() == before || out.len() > expected {
                break;
            }
        }
        if out.len() != expected {
            let length =
                if out.len() > expected { "too many".to_owned() } else { out.len().to_string() };
            return Err(self.error(
                place,
                format!("unpacks to {length} bytes where {expected} were expected"),
            ));
        }
        Ok(out)
    }
}

/// The time limit of an input.
#[cfg(feature = "hdf5")]
pub(crate) struct Watch {
    budget: Arc<Budget>,
    limits: Limits,
}

#[cfg(feature = "hdf5")]
impl Watch {
    /// Returns whether the time is over.
    pub fn is_over(&self) -> bool {
        self.budget.left(&self.limits).is_zero()
    }
}

fn map_within(path: &Path, limits: &Limits, budget: &Budget) -> Result<Mapping> {
    if is_remote(path) {
        let remote = Remote::open(path, limits)?;
        budget.spend(limits, path, "the object's size in bytes", remote.len())?;
        budget.opened(path);
        let file = remote.whole()?;
        return Mapping::new(file).map_err(|e| Error::file(path, "map", e));
    }
    // Opening a pipe would wait for its other end, and opening a device may start it. So check the
    // type before opening.
    let metadata = std::fs::metadata(path).map_err(|e| Error::file(path, "open", e))?;
    let regular = |meta: &std::fs::Metadata| {
        if meta.is_file() {
            Ok(())
        } else {
            Err(Error::input(path, "path", "is not a regular file"))
        }
    };
    regular(&metadata)?;
    let file = File::open(path).map_err(|e| Error::file(path, "open", e))?;
    let meta = file.metadata().map_err(|e| Error::file(path, "read", e))?;
    regular(&meta)?;
    budget.spend(limits, path, "the file's size in bytes", meta.len())?;
    budget.opened(path);
    Mapping::new(file).map_err(|e| Error::file(path, "map", e))
}

/// Returns an error if a file has changed since it was mapped.
pub(crate) fn intact(mapping: &Mapping, path: &Path) -> Result<()> {
    let Some(change) = mapping.change() else { return Ok(()) };
    Err(Error::input(path, "file", format!("changed while it was read: {change}")).hint(
        "try again when no program writes to it; programs that write a new file and rename it \
             do no harm",
    ))
}
