//! Writes a directory: finds the place of every page, in one pass over all of them, and puts pages
//! and directory pages in their order. In memory is one byte a page.

use super::{
    super::{Put, Spill, Spilled},
    Kind, Place, RECORDS, Shape,
};
use std::{io, marker::PhantomData};

/// The number of classes.
const CLASSES: usize = 256;

/// The pages of a file that is being written.
pub(crate) trait Contents<K: Kind> {
    /// Returns the length in bytes of a page, and its class. The highest class is written first.
    /// Called once for each page, in order.
    fn measure(&mut self, page: u32) -> io::Result<(u32, u8)>;

    /// Appends the record of a page that begins at byte `offset`. Returns its bounds. Called once
    /// for each page, in order.
    fn record(&mut self, page: u32, offset: u64, out: &mut Vec<u8>) -> io::Result<K::Bounds>;

    /// Where the bytes of a page wait.
    fn waiting(&mut self, page: u32) -> io::Result<Place>;
}

/// Where everything is, class by class.
pub(crate) struct Layout<K> {
    shape: Shape,
    /// The class of each page.
    classes: Vec<u8>,
    /// The classes of the directory pages of each level, without the root.
    above: Vec<Vec<u8>>,
    /// Where the next page of each class begins.
    pages: Vec<u64>,
    /// Where the next directory page of each class begins, for each level.
    directory: Vec<Vec<u64>>,
    /// Where all ends.
    pub end: u64,
    kind: PhantomData<K>,
}

impl<K: Kind> Layout<K> {
    /// Lays out `count` pages behind a root that begins at byte `start`.
    pub fn new(count: u32, start: u64, contents: &mut impl Contents<K>) -> io::Result<Self> {
        let shape = Shape::of(count);
        let mut classes = Vec::with_capacity(count as usize);
        let mut pages = vec![0u64; CLASSES];
        for page in 0..count {
            let (bytes, class) = contents.measure(page)?;
            pages[usize::from(class)] += u64::from(bytes);
            classes.push(class);
        }
        let mut above: Vec<Vec<u8>> = Vec::new();
        let mut directory = vec![vec![0u64; CLASSES]; shape.root()];
        for (level, sizes) in directory.iter_mut().enumerate() {
            let below = above.last().unwrap_or(&classes);
            let highest = below.chunks(RECORDS as usize).map(|part| part.iter().fold(0, highest));
            let maxima: Vec<u8> = highest.collect();
            for (number, class) in (0..).zip(&maxima) {
                sizes[usize::from(*class)] += shape.length::<K>(level, number) as u64;
            }
            above.push(maxima);
        }
        let mut at = start + shape.root_length::<K>() as u64;
        let mut place = |bytes: &mut u64| at += std::mem::replace(bytes, at);
        for class in (0..CLASSES).rev() {
            directory.iter_mut().rev().for_each(|level| place(&mut level[class]));
            place(&mut pages[class]);
        }
        Ok(Self { shape, classes, above, pages, directory, end: at, kind: PhantomData })
    }

    /// Encodes all directory pages. Those below the root wait in `spill`. Returns the bytes of the
    /// root, and where the others wait.
    pub fn encode(
        &mut self,
        contents: &mut impl Contents<K>,
        spill: &mut Spill,
    ) -> io::Result<(Vec<u8>, Waiting)> {
        let mut levels: Vec<Level<K>> = self.shape.levels.iter().map(|_| Level::new()).collect();
        let mut waiting = Waiting(vec![Vec::new(); self.shape.root()]);
        for page in 0..self.shape.count {
            let class = usize::from(self.classes[page as usize]);
            let mut record = Vec::with_capacity(K::ENTRY);
            let bounds = contents.record(page, self.pages[class], &mut record)?;
            let length = Place::read(&mut super::Cursor::new(&record)).unwrap_or_default().bytes;
            self.pages[class] += u64::from(length);
            levels[0].push(&record, bounds);
            for level in 0..self.shape.root() {
                let number = waiting.0[level].len() as u32;
                if levels[level].bounds.len() < self.shape.records(level, number) as usize {
                    break;
                }
                let (bytes, bounds) = levels[level].take();
                let class = usize::from(self.above[level][number as usize]);
                let place = Place::of(self.directory[level][class], &bytes);
                self.directory[level][class] += bytes.len() as u64;
                waiting.0[level].push(spill.push(&bytes)?);
                let mut record = Vec::with_capacity(Place::BYTES + K::BOUNDS);
                place.put(&mut record);
                K::put_bounds(&bounds, &mut record);
                levels[level + 1].push(&record, bounds);
            }
        }
        let (mut root, _) = levels[self.shape.root()].take();
        root.u32(crc32fast::hash(&root));
        Ok((root, waiting))
    }

    /// Puts everything behind the root.
    pub fn write(
        &self,
        contents: &mut impl Contents<K>,
        waiting: &Waiting,
        spilled: &mut Spilled,
        mut put: impl FnMut(&[u8]) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut has = [false; CLASSES];
        self.classes.iter().for_each(|class| has[usize::from(*class)] = true);
        let mut bytes = Vec::new();
        for class in (0..CLASSES as u32).rev().filter(|class| has[*class as usize]) {
            let class = class as u8;
            for (level, classes) in self.above.iter().enumerate().rev() {
                for (number, _) in classes.iter().enumerate().filter(|(_, other)| **other == class)
                {
                    bytes.resize(self.shape.length::<K>(level, number as u32), 0);
                    spilled.read(waiting.0[level][number], &mut bytes)?;
                    put(&bytes)?;
                }
            }
            for (page, _) in (0..).zip(&self.classes).filter(|(_, other)| **other == class) {
                let place = contents.waiting(page)?;
                bytes.resize(place.bytes as usize, 0);
                spilled.read(place.offset, &mut bytes)?;
                if crc32fast::hash(&bytes) != place.crc {
                    return Err(io::Error::new(io::ErrorKind::InvalidData, "a page is damaged"));
                }
                put(&bytes)?;
            }
        }
        Ok(())
    }
}

fn highest(class: u8, other: &u8) -> u8 {
    class.max(*other)
}

/// Where the directory pages of each level wait.
pub(crate) struct Waiting(Vec<Vec<u64>>);

/// The directory page of a level that is being filled.
struct Level<K: Kind> {
    bytes: Vec<u8>,
    bounds: Vec<K::Bounds>,
}

impl<K: Kind> Level<K> {
    fn new() -> Self {
        Self { bytes: Vec::new(), bounds: Vec::new() }
    }

    fn push(&mut self, record: &[u8], bounds: K::Bounds) {
        self.bytes.extend_from_slice(record);
        self.bounds.push(bounds);
    }

    fn take(&mut self) -> (Vec<u8>, K::Bounds) {
        let bounds = K::around(&std::mem::take(&mut self.bounds));
        (std::mem::take(&mut self.bytes), bounds)
    }
}
