//! A directory in pages: a tree whose lowest level lists the pages of a file, and each other level
//! the directory pages of the level below. docs/splk.md describes it.
//!
//! A file is opened with the root alone. The other directory pages are read when they are needed,
//! and those read last stay in memory. [`layout`] writes them.

mod cache;
mod layout;
mod shape;
mod tiles;

pub(crate) use layout::{Contents, Layout};
pub(crate) use shape::Shape;

use super::{Cursor, Put};
use crate::{Error, input::Bytes, parallel::prelude::*};
use cache::Cache;
use std::{
    ops::Range,
    sync::{Arc, Mutex, PoisonError},
};
use tiles::Tiles;

/// Records in a directory page.
pub(crate) const RECORDS: u32 = 512;

/// Directory pages that are read together.
const BATCH: usize = 32;

/// Position, length and checksum of a page's bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Place {
    pub offset: u64,
    pub bytes: u32,
    pub crc: u32,
}

impl Place {
    /// Bytes of a place in a record.
    pub const BYTES: usize = 16;

    /// The place of a page at an offset.
    pub fn of(offset: u64, page: &[u8]) -> Self {
        Self { offset, bytes: page.len() as u32, crc: crc32fast::hash(page) }
    }

    pub fn put(self, out: &mut Vec<u8>) {
        out.u64(self.offset);
        out.u32(self.bytes);
        out.u32(self.crc);
    }

    pub fn read(bytes: &mut Cursor) -> Option<Self> {
        Some(Self { offset: bytes.u64()?, bytes: bytes.u32()?, crc: bytes.u32()? })
    }

    /// The bytes of the file that the page takes.
    pub fn range(self) -> Range<u64> {
        self.offset..self.offset.saturating_add(u64::from(self.bytes))
    }
}

/// What a directory lists. Records begin with a [`Place`].
pub(crate) trait Kind: Send + Sync {
    /// A page.
    type Entry: Clone + Send + Sync;
    /// Bounds by which a reader decides whether it needs a page, or any page below a directory
    /// page.
    type Bounds: Copy + PartialEq + std::fmt::Debug + Send + Sync;

    /// Bytes of a page's record.
    const ENTRY: usize;
    /// Bytes of bounds.
    const BOUNDS: usize;

    /// Decodes the record of a page. An error is a message.
    fn entry(&self, page: u32, record: &[u8]) -> Result<Self::Entry, String>;

    /// Returns a message if a page cannot follow the page before.
    fn follows(before: &Self::Entry, entry: &Self::Entry) -> Result<(), String>;

    fn place(entry: &Self::Entry) -> Place;

    fn bounds(entry: &Self::Entry) -> Self::Bounds;

    fn read_bounds(bytes: &mut Cursor) -> Option<Self::Bounds>;

    fn put_bounds(bounds: &Self::Bounds, out: &mut Vec<u8>);

    /// Returns bounds around others.
    fn around(bounds: &[Self::Bounds]) -> Self::Bounds;
}

/// The records of a directory page.
enum Listed<K: Kind> {
    Entries(Arc<[K::Entry]>),
    Pages(Arc<[(Place, K::Bounds)]>),
}

impl<K: Kind> Clone for Listed<K> {
    fn clone(&self) -> Self {
        match self {
            Self::Entries(entries) => Self::Entries(entries.clone()),
            Self::Pages(pages) => Self::Pages(pages.clone()),
        }
    }
}

impl<K: Kind> Listed<K> {
    /// Where the first of its pages in the file begins.
    fn first_offset(&self) -> u64 {
        let first = match self {
            Self::Entries(entries) => entries.iter().map(|entry| K::place(entry).offset).min(),
            Self::Pages(pages) => pages.iter().map(|(place, _)| place.offset).min(),
        };
        first.unwrap_or_default()
    }

    fn bounds(&self) -> K::Bounds {
        match self {
            Self::Entries(entries) => K::around(&entries.iter().map(K::bounds).collect::<Vec<_>>()),
            Self::Pages(pages) => {
                K::around(&pages.iter().map(|(_, bounds)| *bounds).collect::<Vec<_>>())
            }
        }
    }
}

/// Why a directory page cannot be read.
#[derive(Debug)]
pub(crate) enum Fault {
    /// The file ends before it. Names the place.
    Incomplete(String),
    /// The place, and what is wrong with it.
    Damaged(String, String),
    /// The file cannot be read.
    Unread(Error),
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Unread(error)
    }
}

/// Entries of successive pages, with the number of the first.
pub(crate) type Run<K> = (u32, Arc<[<K as Kind>::Entry]>);

/// A directory. Any number of threads may use it.
pub(crate) struct Directory<K: Kind> {
    kind: K,
    shape: Shape,
    /// The bytes of the file behind the root.
    bytes: Range<u64>,
    pages: Pages<K>,
}

enum Pages<K: Kind> {
    /// All directory pages by their levels, the lowest first.
    Held(Vec<Vec<Listed<K>>>),
    Stored {
        root: Listed<K>,
        read: Mutex<Cache<Listed<K>>>,
    },
}

impl<K: Kind> Directory<K> {
    /// Makes a directory that is in memory as a whole.
    pub fn held(kind: K, entries: &[K::Entry]) -> Self {
        let entries_of = |part: &[K::Entry]| Listed::<K>::Entries(part.into());
        let mut levels = vec![entries.chunks(RECORDS as usize).map(entries_of).collect::<Vec<_>>()];
        while let Some(below) = levels.last().filter(|level| level.len() > 1) {
            let pages_of = |part: &[Listed<K>]| {
                Listed::Pages(part.iter().map(|page| (Place::default(), page.bounds())).collect())
            };
            let level = below.chunks(RECORDS as usize).map(pages_of).collect();
            levels.push(level);
        }
        let shape = Shape::of(entries.len() as u32);
        Self { kind, shape, bytes: 0..0, pages: Pages::Held(levels) }
    }

    /// Reads the root of the directory of `count` pages, which begins at byte `start`. The pages
    /// end at byte `end`. `head` are the first bytes of the file.
    pub fn open(
        kind: K,
        count: u32,
        (start, end): (usize, u64),
        head: &[u8],
    ) -> Result<Self, Fault> {
        let shape = Shape::of(count);
        let place = || "directory".to_owned();
        let behind = start + shape.root_length::<K>();
        let bytes = head.get(start..behind);
        let bytes = bytes.ok_or_else(|| Fault::Incomplete(place()))?;
        let (bytes, sum) = bytes.split_at(bytes.len() - 4);
        if Cursor::new(sum).u32() != Some(crc32fast::hash(bytes)) {
            return Err(Fault::Damaged(place(), "its checksum does not match".into()));
        }
        let root = listed(&kind, shape.root(), 0, bytes)
            .map_err(|message| Fault::Damaged(place(), message))?;
        let pages = Pages::Stored { root, read: Mutex::default() };
        Ok(Self { kind, shape, bytes: behind as u64..end, pages })
    }

    /// The number of pages.
    pub fn len(&self) -> u32 {
        self.shape.count
    }

    pub fn kind(&self) -> &K {
        &self.kind
    }

    /// Returns the entry of a page, which must be less than [`len`](Self::len).
    pub fn entry(&self, file: Option<&Bytes>, page: u32) -> Result<K::Entry, Fault> {
        let run = self.run(file, page)?;
        Ok(run.1[(page - run.0) as usize].clone())
    }

    /// Returns the page after the last one that is listed with a page.
    pub fn run_end(&self, page: u32) -> u32 {
        (page / RECORDS + 1).saturating_mul(RECORDS).min(self.shape.count)
    }

    /// Fetches the directory pages of a remote object that list some pages, which are read soon.
    pub fn prepare(
        &self,
        file: Option<&Bytes>,
        pages: impl Iterator<Item = u32>,
    ) -> Result<(), Fault> {
        if matches!(self.pages, Pages::Held(_)) {
            return Ok(());
        }
        let pages: Vec<u32> = pages.collect();
        for level in (0..self.shape.root()).rev() {
            let mut numbers: Vec<u32> = pages.iter().map(|page| self.above(*page, level)).collect();
            numbers.sort_unstable();
            numbers.dedup();
            let place = |number: u32| Ok((number, self.place(file, level, number)?));
            let places = numbers.into_iter().map(place).collect::<Result<Vec<_>, Fault>>()?;
            let within = places.into_iter().filter(|(_, place)| self.is_within(*place));
            self.fetch(file, level, within)?;
        }
        Ok(())
    }

    /// Returns the entries that are listed with that of a page.
    pub fn run(&self, file: Option<&Bytes>, page: u32) -> Result<Run<K>, Fault> {
        let number = page / RECORDS;
        match self.get(file, 0, number)? {
            Listed::Entries(entries) => Ok((number * RECORDS, entries)),
            Listed::Pages(_) => unreachable!("level 0 lists pages"),
        }
    }

    /// Calls `each` with batches of entries, in the order of pages: all those whose directory pages
    /// are present and have bounds that pass. Of a file in parts, those that have not come yet are
    /// left out. `each` tests the bounds of entries themselves, and returns whether to go on.
    /// `fail` makes an error of a fault.
    pub fn visit<E>(
        &self,
        file: Option<&Bytes>,
        wanted: &(impl Fn(&K::Bounds) -> bool + Sync),
        each: &mut impl FnMut(&[Run<K>]) -> Result<bool, E>,
        fail: &impl Fn(Fault) -> E,
    ) -> Result<(), E> {
        let root = self.shape.root();
        let mut rest = vec![(root, vec![0])];
        // The last item of `rest` comes next: depth first, a batch of directory pages at a time.
        while let Some((level, numbers)) = rest.pop() {
            if level == 0 {
                let run = |number: &u32| self.run(file, number * RECORDS);
                let runs: Vec<_> = numbers.par_iter().map(run).collect();
                let runs = runs.into_iter().filter(|run| !is_absent(run));
                let runs: Result<Vec<_>, Fault> = runs.collect();
                if !each(&runs.map_err(fail)?)? {
                    return Ok(());
                }
                continue;
            }
            for number in numbers.into_iter().rev() {
                let below = self.below(file, level, number, wanted);
                if is_absent(&below) {
                    continue;
                }
                let below = below.map_err(fail)?;
                let batches = below.chunks(BATCH).rev();
                rest.extend(batches.map(|batch| (level - 1, batch.to_vec())));
            }
        }
        Ok(())
    }

    /// Returns the directory pages of the level below a directory page that are present and have
    /// bounds that pass, and fetches the first of them.
    fn below(
        &self,
        file: Option<&Bytes>,
        level: usize,
        number: u32,
        wanted: &(impl Fn(&K::Bounds) -> bool + Sync),
    ) -> Result<Vec<u32>, Fault> {
        let Listed::Pages(records) = self.get(file, level, number)? else {
            unreachable!("higher levels list directory pages")
        };
        let numbered = (number * RECORDS..).zip(records.iter());
        let passes = |(_, (_, bounds)): &(u32, &(Place, _))| wanted(bounds);
        let below: Vec<(u32, Place)> =
            numbered.filter(passes).map(|(number, (place, _))| (number, *place)).collect();
        let within = below.iter().copied().filter(|(_, place)| self.is_within(*place));
        self.fetch(file, level - 1, within)?;
        Ok(below.into_iter().map(|(number, _)| number).collect())
    }

    /// Fetches directory pages of a remote object together, which are read next.
    fn fetch(
        &self,
        file: Option<&Bytes>,
        level: usize,
        pages: impl Iterator<Item = (u32, Place)>,
    ) -> Result<(), Fault> {
        let (Pages::Stored { read, .. }, Some(file)) = (&self.pages, file) else { return Ok(()) };
        let absent: Vec<Range<u64>> = {
            let read = read.lock().unwrap_or_else(PoisonError::into_inner);
            let absent = pages.filter(|(number, _)| !read.has((level, *number)));
            absent.map(|(_, place)| place.range()).collect()
        };
        Ok(file.fetch(absent.into_iter())?)
    }

    /// Returns whether a place is behind the root.
    fn is_within(&self, place: Place) -> bool {
        place.offset >= self.bytes.start && place.range().end <= self.bytes.end
    }

    /// The directory page of a level that lists a page, directly or below.
    fn above(&self, page: u32, level: usize) -> u32 {
        (0..=level).fold(page, |number, _| number / RECORDS)
    }

    /// Returns the place of a directory page other than the root.
    fn place(&self, file: Option<&Bytes>, level: usize, number: u32) -> Result<Place, Fault> {
        match self.get(file, level + 1, number / RECORDS)? {
            Listed::Pages(pages) => Ok(pages[(number % RECORDS) as usize].0),
            Listed::Entries(_) => unreachable!("higher levels list directory pages"),
        }
    }

    fn get(&self, file: Option<&Bytes>, level: usize, number: u32) -> Result<Listed<K>, Fault> {
        let (root, read) = match &self.pages {
            Pages::Held(levels) => return Ok(levels[level][number as usize].clone()),
            Pages::Stored { root, read } => (root, read),
        };
        if level == self.shape.root() {
            return Ok(root.clone());
        }
        let lock = || read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(page) = lock().get((level, number)) {
            return Ok(page);
        }
        let stored = self.place(file, level, number)?;
        let place = || name(level, number, stored);
        if !self.is_within(stored) {
            let Range { start, end } = self.bytes;
            let message = format!("it is not among the pages, from byte {start} to byte {end}");
            return Err(Fault::Damaged(place(), message));
        }
        let file = file.filter(|file| stored.range().end <= file.len());
        let file = file.ok_or_else(|| Fault::Incomplete(place()))?;
        if stored.bytes as usize != self.shape.length::<K>(level, number) {
            let message = format!("it has {} bytes, not those of its records", stored.bytes);
            return Err(Fault::Damaged(place(), message));
        }
        let decode = |bytes: &[u8]| {
            if crc32fast::hash(bytes) != stored.crc {
                return Err("its checksum does not match".to_owned());
            }
            listed(&self.kind, level, number, bytes)
        };
        let page = file.decoded(stored.range(), decode)?;
        let page = page.map_err(|message| Fault::Damaged(place(), message))?;
        lock().put((level, number), page.clone());
        Ok(page)
    }

    /// Returns whether the pages, and the directory pages other than the root, fill these bytes.
    pub fn fills(&self, file: &Bytes, bytes: Range<u64>) -> bool {
        let mut tiles = Tiles::default();
        self.places(Some(file), &mut |place| tiles.add(place));
        tiles.fill(bytes.start, bytes.end)
    }

    /// Calls `each` with the place of every page, and of every directory page other than the root.
    /// Leaves out those that a damaged directory page lists.
    fn places(&self, file: Option<&Bytes>, each: &mut impl FnMut(Place)) {
        for number in 0..self.shape.levels[0] {
            if let Ok((_, entries)) = self.run(file, number * RECORDS) {
                entries.iter().for_each(|entry| each(K::place(entry)));
            }
        }
        if matches!(self.pages, Pages::Held(_)) {
            return;
        }
        for level in 0..self.shape.root() {
            for number in 0..self.shape.levels[level] {
                self.place(file, level, number).into_iter().for_each(&mut *each);
            }
        }
    }

    /// Reads every directory page. Calls `wrong` for those that are damaged, whose bounds are not
    /// those in their record, or that come after a page that they list.
    pub fn check(&self, file: Option<&Bytes>, wrong: &mut impl FnMut(Fault)) {
        for level in (0..self.shape.root()).rev() {
            for number in 0..self.shape.levels[level] {
                // The fault of a directory page above was found before.
                let Ok(Listed::Pages(above)) = self.get(file, level + 1, number / RECORDS) else {
                    continue;
                };
                let (place, bounds) = above[(number % RECORDS) as usize];
                let damaged = |message: String| Fault::Damaged(name(level, number, place), message);
                match self.get(file, level, number) {
                    Err(fault) => wrong(fault),
                    Ok(page) if page.bounds() != bounds => wrong(damaged(format!(
                        "its records have the bounds {:?}, but {bounds:?} is stated",
                        page.bounds()
                    ))),
                    Ok(page) if page.first_offset() < place.offset => {
                        wrong(damaged("it comes after a page that it lists".into()));
                    }
                    Ok(_) => {}
                }
            }
        }
    }

    /// Directory pages that are in memory, besides the root of a file.
    #[cfg(test)]
    pub fn read_pages(&self) -> usize {
        match &self.pages {
            Pages::Held(levels) => levels.iter().map(Vec::len).sum(),
            Pages::Stored { read, .. } => read.lock().unwrap().len(),
        }
    }
}

/// Whether a directory page has not come yet, of a file in parts.
fn is_absent<T>(result: &Result<T, Fault>) -> bool {
    matches!(result, Err(Fault::Unread(Error::Absent { .. })))
}

fn name(level: usize, number: u32, place: Place) -> String {
    format!("directory page {number} of level {level} (byte {})", place.offset)
}

/// Decodes a directory page.
fn listed<K: Kind>(kind: &K, level: usize, number: u32, bytes: &[u8]) -> Result<Listed<K>, String> {
    if level == 0 {
        let mut entries: Vec<K::Entry> = Vec::with_capacity(bytes.len() / K::ENTRY);
        for (page, record) in (number * RECORDS..).zip(bytes.chunks_exact(K::ENTRY)) {
            let entry = kind.entry(page, record).and_then(|entry| {
                entries.last().map_or(Ok(()), |before| K::follows(before, &entry))?;
                Ok(entry)
            });
            entries.push(entry.map_err(|message| format!("page {page}: {message}"))?);
        }
        return Ok(Listed::Entries(entries.into()));
    }
    let record = |record: &[u8]| {
        let mut record = Cursor::new(record);
        Some((Place::read(&mut record)?, K::read_bounds(&mut record)?))
    };
    let records = bytes.chunks_exact(Place::BYTES + K::BOUNDS).map(record);
    let records: Option<Arc<[_]>> = records.collect();
    Ok(Listed::Pages(records.ok_or("its bounds are not valid")?))
}
