//! Reading parts of an array: which chunks they lie in, and where the chunks are in the store.

use super::{array::Layout, array::Shards, codecs::crc32c};
use crate::{Error, Result, formats::Endian, parallel::prelude::*};
use std::{
    collections::HashMap,
    ops::Range,
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
};

/// Where the objects of a store are read.
pub trait Objects: Send + Sync {
    /// Returns bytes of an object, fewer if it ends before; `None` if there is no such object.
    fn get(&self, key: &str, part: Part) -> Result<Option<Vec<u8>>>;

    /// Returns the path of an object, for errors.
    fn place(&self, key: &str) -> PathBuf;

    /// Returns how many objects are best read at the same time.
    fn at_once(&self) -> usize {
        crate::parallel::current_num_threads()
    }
}

/// A part of an object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Part {
    Whole,
    Range(Range<u64>),
    /// This many bytes at the end.
    Last(u64),
}

/// An array in a store.
#[derive(Clone)]
pub struct Array {
    pub layout: Layout,
    /// The path of its node in the store; empty for the store itself.
    node: String,
    store: Arc<dyn Objects>,
    /// The chunks of each shard that was looked at: start and length.
    indices: Arc<Mutex<HashMap<Vec<usize>, Arc<Index>>>>,
}

/// Where the chunks of a shard are; `None` for a shard that was never written.
type Index = Option<Vec<[u64; 2]>>;

/// The elements of a chunk; `None` if it was never written.
pub type Chunk = Option<Arc<Vec<u8>>>;

/// Most entries of the indices of shards that are kept.
const MOST_ENTRIES: usize = 1 << 21;

/// What is asked for between two chunks: whether there is time left.
pub type Check<'a> = &'a (dyn Fn() -> Result<()> + Sync);

impl Array {
    pub fn new(store: Arc<dyn Objects>, node: &str, layout: Layout) -> Self {
        Self { layout, node: node.to_owned(), store, indices: Arc::default() }
    }

    /// Returns the bytes of a box of elements, last axis fastest, in the order of bytes that the
    /// layout has. Each chunk is read by `read`.
    pub fn window(
        &self,
        [from, count]: [&[usize]; 2],
        read: &(dyn Fn(&[usize]) -> Result<Chunk> + Sync),
        check: Check,
    ) -> Result<Vec<u8>> {
        let element = self.layout.element.bytes();
        let mut out = vec![0; count.iter().product::<usize>() * element];
        if out.is_empty() {
            return Ok(out);
        }
        if self.layout.fill.iter().any(|byte| *byte != 0) {
            out.chunks_exact_mut(element).for_each(|to| to.copy_from_slice(&self.layout.fill));
        }
        let places = self.places([from, count]);
        for batch in places.chunks(2 * self.store.at_once()) {
            check()?;
            let chunks = self.read_all(batch, read);
            for (place, chunk) in batch.iter().zip(chunks) {
                if let Some(chunk) = chunk? {
                    self.copy(place, &chunk, [from, count], &mut out);
                }
            }
        }
        Ok(out)
    }

    /// Reads chunks, as many at the same time as the store likes.
    pub fn read_all(
        &self,
        places: &[Vec<usize>],
        read: &(dyn Fn(&[usize]) -> Result<Chunk> + Sync),
    ) -> Vec<Result<Chunk>> {
        let threads = self.store.at_once().min(places.len());
        if threads <= crate::parallel::current_num_threads() {
            return places.par_iter().map(|place| read(place)).collect();
        }
        // They wait for a server most of the time, so they are more than the processors.
        let mut chunks: Vec<Option<Result<Chunk>>> = places.iter().map(|_| None).collect();
        let next = Mutex::new(places.iter().zip(&mut chunks));
        let work = || {
            let take = || next.lock().unwrap_or_else(PoisonError::into_inner).next();
            while let Some((place, chunk)) = take() {
                *chunk = Some(read(place));
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(work);
            }
        });
        chunks.into_iter().flatten().collect()
    }

    /// Returns the places of the chunks that a box meets.
    pub fn places(&self, [from, count]: [&[usize]; 2]) -> Vec<Vec<usize>> {
        let chunk = &self.layout.chunk;
        let first: Vec<usize> = from.iter().zip(chunk).map(|(at, n)| at / n).collect();
        let last: Vec<usize> =
            (0..from.len()).map(|axis| (from[axis] + count[axis] - 1) / chunk[axis]).collect();
        let mut places = Vec::new();
        let mut at = first.clone();
        loop {
            places.push(at.clone());
            let Some(axis) = (0..at.len()).rev().find(|&axis| at[axis] < last[axis]) else {
                return places;
            };
            at[axis] += 1;
            at[axis + 1..].copy_from_slice(&first[axis + 1..]);
        }
    }

    /// Copies what a chunk has of a box.
    fn copy(&self, place: &[usize], chunk: &[u8], [from, count]: [&[usize]; 2], out: &mut [u8]) {
        let (size, element) = (&self.layout.chunk, self.layout.element.bytes());
        let axes = from.len();
        let origin: Vec<usize> = place.iter().zip(size).map(|(at, n)| at * n).collect();
        let low: Vec<usize> = (0..axes).map(|axis| origin[axis].max(from[axis])).collect();
        let high: Vec<usize> = (0..axes)
            .map(|axis| (origin[axis] + size[axis]).min(from[axis] + count[axis]))
            .collect();
        let row = high.last().map_or(1, |end| end - low[axes - 1]) * element;
        let offset = |at: &[usize], start: &[usize], all: &[usize]| {
            let number = (0..axes).fold(0, |sum, axis| sum * all[axis] + at[axis] - start[axis]);
            number * element
        };
        let mut at = low.clone();
        loop {
            let (to, source) = (offset(&at, from, count), offset(&at, &origin, size));
            out[to..to + row].copy_from_slice(&chunk[source..source + row]);
            let outer = axes.saturating_sub(1);
            let Some(axis) = (0..outer).rev().find(|&axis| at[axis] + 1 < high[axis]) else {
                return;
            };
            at[axis] += 1;
            at[axis + 1..].copy_from_slice(&low[axis + 1..]);
        }
    }

    /// Reads a chunk, by its place among all chunks.
    ///
    /// # Errors
    /// [`Error::Input`] for a chunk that is cut off, or packed otherwise than the metadata says.
    pub fn chunk(&self, place: &[usize]) -> Result<Chunk> {
        let each = self.layout.chunks_of_object();
        let object: Vec<usize> = place.iter().zip(&each).map(|(at, n)| at / n).collect();
        let key = self.key(&object);
        let part = match self.layout.shards {
            None => Part::Whole,
            Some(shards) => {
                let number = (0..each.len())
                    .fold(0, |sum, axis| sum * each[axis] + place[axis] % each[axis]);
                let index = self.index(&object, &key, shards)?;
                let entry = index.as_ref().as_ref().and_then(|index| index.get(number));
                match entry {
                    None | Some([u64::MAX, u64::MAX]) => return Ok(None),
                    Some(&[start, length]) => Part::Range(start..start.saturating_add(length)),
                }
            }
        };
        let expected = match &part {
            Part::Range(range) => Some(range.end - range.start),
            _ => None,
        };
        let Some(bytes) = self.store.get(&key, part)? else {
            return match self.layout.shards {
                None => Ok(None),
                Some(_) => Err(self.damaged(&key, place, "is gone: another program removed it")),
            };
        };
        if let Some(expected) = expected.filter(|expected| *expected != bytes.len() as u64) {
            let message = format!("has {} bytes where {expected} were expected", bytes.len());
            return Err(self.damaged(&key, place, &message));
        }
        let decoded =
            self.layout.chain.decode(bytes, &self.layout.chunk, self.layout.element.bytes());
        let decoded = decoded.map_err(|message| self.damaged(&key, place, &message))?;
        Ok(Some(Arc::new(decoded)))
    }

    /// Returns the name of an object.
    fn key(&self, object: &[usize]) -> String {
        let name = self.layout.keys.name(object);
        if self.node.is_empty() { name } else { format!("{}/{name}", self.node) }
    }

    fn damaged(&self, key: &str, place: &[usize], message: &str) -> Error {
        let place: Vec<String> = place.iter().map(usize::to_string).collect();
        let place = format!("chunk ({})", place.join(", "));
        Error::input(&self.store.place(key), place, message)
            .hint("the file is damaged, or written by other codecs: copy or write it again")
    }

    /// Returns where the chunks of a shard are.
    fn index(&self, object: &[usize], key: &str, shards: Shards) -> Result<Arc<Index>> {
        let known = || self.indices.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(index) = known().get(object) {
            return Ok(index.clone());
        }
        let index = Arc::new(self.read_index(key, shards)?);
        let mut known = known();
        let entries: usize = known.values().map(|index| index.as_ref().iter().len()).sum();
        if entries > MOST_ENTRIES {
            known.clear();
        }
        known.insert(object.to_vec(), index.clone());
        Ok(index)
    }

    fn read_index(&self, key: &str, shards: Shards) -> Result<Index> {
        let wrong = |message: &str| {
            Error::input(&self.store.place(key), "the list of chunks", message)
                .hint("the shard is damaged: copy or write it again")
        };
        let count: usize = self.layout.chunks_of_object().iter().product();
        let size = 16 * count as u64 + if shards.is_checked { 4 } else { 0 };
        let part = if shards.at_start { Part::Range(0..size) } else { Part::Last(size) };
        let Some(bytes) = self.store.get(key, part)? else { return Ok(None) };
        if bytes.len() as u64 != size {
            return Err(wrong(&format!("has {} bytes where {size} were expected", bytes.len())));
        }
        let (list, sum) = bytes.split_at(16 * count);
        if shards.is_checked && crc32c(list).to_le_bytes() != sum {
            return Err(wrong("does not have the checksum that it was written with"));
        }
        let numbers: Vec<u64> = list
            .as_chunks()
            .0
            .iter()
            .map(|bytes| match shards.endian {
                Endian::Little => u64::from_le_bytes(*bytes),
                Endian::Big => u64::from_be_bytes(*bytes),
            })
            .collect();
        Ok(Some(numbers.as_chunks().0.to_vec()))
    }
}

/// Chunks that were unpacked, up to a number of bytes; the least recently used go first. Several
/// threads that need the same chunk unpack it once.
pub struct Cache {
    most: usize,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    chunks: HashMap<Key, Slot>,
    bytes: usize,
    clock: u64,
}

/// An array's number and a chunk's place.
type Key = (usize, Vec<usize>);

/// A chunk that may be read already.
#[derive(Default)]
struct Slot {
    used: u64,
    bytes: usize,
    chunk: Arc<Mutex<Option<Chunk>>>,
}

impl Cache {
    pub fn new(most: usize) -> Self {
        Self { most, state: Mutex::default() }
    }

    /// Returns a chunk, which `read` reads if it is not there. It takes `bytes` once it is read.
    pub fn get(
        &self,
        key: Key,
        bytes: usize,
        read: impl FnOnce() -> Result<Chunk>,
    ) -> Result<Chunk> {
        let slot =
            self.state.lock().unwrap_or_else(PoisonError::into_inner).slot(key, bytes, self.most);
        let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(chunk) = &*slot {
            return Ok(chunk.clone());
        }
        // A chunk that cannot be read leaves the slot empty: whoever needs it next tries again.
        let chunk = read()?;
        Ok(slot.insert(chunk).clone())
    }
}

impl State {
    fn slot(&mut self, key: Key, bytes: usize, most: usize) -> Arc<Mutex<Option<Chunk>>> {
        self.clock += 1;
        if !self.chunks.contains_key(&key) {
            self.bytes += bytes;
            self.make_room(most);
        }
        let slot = self.chunks.entry(key).or_default();
        (slot.used, slot.bytes) = (self.clock, bytes);
        slot.chunk.clone()
    }

    /// Drops the chunks that were not used for longest, so that another one fits.
    fn make_room(&mut self, most: usize) {
        if self.bytes <= most {
            return;
        }
        let mut ages: Vec<(u64, Key)> =
            self.chunks.iter().map(|(key, slot)| (slot.used, key.clone())).collect();
        ages.sort();
        for (_, key) in ages {
            // An eighth more, so that this is not done for each chunk.
            if self.bytes <= most - most / 8 {
                break;
            }
            let bytes = self.chunks.remove(&key).map_or(0, |slot| slot.bytes);
            self.bytes = self.bytes.saturating_sub(bytes);
        }
    }
}
