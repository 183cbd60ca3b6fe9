//! Remote inputs: objects behind addresses (`https`, `http`, `s3`, `gs`, `az`), of which only the
//! ranges that are needed are fetched.
//!
//! An object is kept in blocks of 64 KiB, in memory and in a [`Cache`] on disk. Missing blocks are
//! fetched with few requests: near ones together, and several requests at once (`fetch.rs`). The
//! first 256 KiB come with the request that opens an object, and stay in memory.

mod blocks;
mod cache;
mod fetch;
mod held;
#[cfg(test)]
#[allow(clippy::single_range_in_vec_init, reason = "lists of ranges may have one")]
mod tests;

pub use cache::Cache;
pub use fetch::{Traffic, traffic};

use crate::{Error, Result, input::address};
use blocks::{BLOCK, bytes_of, joined, touched};
use bytes::Bytes;
use cache::Entry;
use fetch::{Link, Patience, Stamp};
use held::held;
use std::{
    collections::{BTreeSet, HashMap},
    fs::File,
    io::Write,
    ops::Range,
    path::Path,
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    time::{Duration, Instant},
};

/// Bytes of the request that opens an object.
pub const FIRST: u64 = 256 << 10;

/// For this long, an object that was opened is opened again without asking the server.
const FRESH: Duration = Duration::from_secs(30);

/// Objects that are remembered for that.
const RECENT: usize = 16;

/// Most blocks that are fetched before they are given away: half of those held in memory.
const GROUP: usize = held::MOST / 2 / BLOCK as usize;

static CACHE: Mutex<Option<Cache>> = Mutex::new(None);
static OPENED: Mutex<Vec<(Instant, Arc<Object>)>> = Mutex::new(Vec::new());

/// Sets where this process keeps what it fetches, for inputs that are opened from now on. Without
/// it, that is [`Cache::default`].
pub fn set_cache(cache: Cache) {
    *CACHE.lock().unwrap_or_else(PoisonError::into_inner) = Some(cache);
    OPENED.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// An opened object. Any number of threads may read from it.
#[derive(Clone)]
pub(crate) struct Remote(Arc<Object>);

struct Object {
    number: u64,
    address: String,
    link: Link,
    stamp: Stamp,
    /// The first bytes, unless they were found to be wrong.
    head: Mutex<Option<Bytes>>,
    cache: Cache,
    entry: OnceLock<Option<Entry>>,
    /// A file with all bytes, once it was verified.
    whole: Mutex<Option<File>>,
}

impl Remote {
    /// Opens an object: fetches its first bytes, and with them its size and its stamp.
    ///
    /// # Errors
    /// [`Error::Input`] for an address that cannot be used, and for what the server or the network
    /// does wrong.
    pub fn open(path: &Path) -> Result<Self> {
        let whole =
            address::whole(path).map_err(|message| Error::input(path, "address", message))?;
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        opened.retain(|(when, _)| when.elapsed() < FRESH);
        if let Some((_, object)) = opened.iter().find(|(_, object)| object.address == whole) {
            return Ok(Self(object.clone()));
        }
        drop(opened);
        let cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let own = Self::open_in(path, cache.unwrap_or_default(), Patience::default())?;
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        opened.truncate(RECENT - 1);
        opened.insert(0, (Instant::now(), own.0.clone()));
        Ok(own)
    }

    fn open_in(path: &Path, cache: Cache, patience: Patience) -> Result<Self> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let link = Link::new(path, patience)?;
        let first = 0..FIRST;
        let (stamp, parts) = link.parts(std::slice::from_ref(&first), None)?;
        let address = address::whole(path).unwrap_or_default();
        let object = Object {
            number: NEXT.fetch_add(1, Relaxed),
            address,
            link,
            stamp,
            head: Mutex::new(parts.into_iter().next()),
            cache,
            entry: OnceLock::new(),
            whole: Mutex::default(),
        };
        Ok(Self(Arc::new(object)))
    }

    /// The object's name in messages.
    pub fn name(&self) -> &Path {
        self.0.link.name()
    }

    /// The object's size in bytes.
    pub fn len(&self) -> u64 {
        self.0.stamp.size
    }

    /// Returns what else than the size shows that the object has changed, as text; `None` if the
    /// server does not say.
    pub fn stamp(&self) -> Option<String> {
        let stamp = &self.0.stamp;
        stamp.shows_changes().then(|| format!("{stamp:?}"))
    }

    /// Returns the first bytes, at least [`FIRST`] or all.
    pub fn head(&self) -> Result<Bytes> {
        let head = self.0.head.lock().unwrap_or_else(PoisonError::into_inner).clone();
        match head {
            Some(head) => Ok(head),
            None => self.read(0..FIRST.min(self.len())),
        }
    }

    /// Returns a range of bytes, which must lie within the object.
    ///
    /// # Errors
    /// Those of [`open`](Self::open), and [`Error::Input`] if the object has changed since it was
    /// opened.
    pub fn read(&self, range: Range<u64>) -> Result<Bytes> {
        if range.is_empty() {
            return Ok(Bytes::new());
        }
        let head = self.0.head.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(head) = head.filter(|head| range.end <= head.len() as u64) {
            return Ok(head.slice(range.start as usize..range.end as usize));
        }
        let numbers = touched(std::slice::from_ref(&range));
        let found = self.0.obtain(&numbers)?;
        let mut all = Vec::with_capacity((range.end - range.start) as usize);
        for number in numbers {
            let (start, block) = (number * BLOCK, &found[&number]);
            let from = range.start.saturating_sub(start) as usize;
            let to = (range.end - start).min(block.len() as u64) as usize;
            all.extend_from_slice(&block[from..to]);
        }
        Ok(all.into())
    }

    /// Fetches what is missing of several ranges, so that reading them soon is quick.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub fn fetch(&self, ranges: &[Range<u64>]) -> Result<()> {
        let head = self.0.head.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let known = head.map_or(0, |head| head.len() as u64);
        let ranges: Vec<Range<u64>> =
            ranges.iter().filter(|range| range.end > known).cloned().collect();
        let numbers: Vec<u64> = touched(&ranges).into_iter().collect();
        for group in numbers.chunks(GROUP) {
            self.0.obtain(&group.iter().copied().collect())?;
        }
        Ok(())
    }

    /// Forgets a range whose bytes are wrong, so that it is fetched again.
    pub fn forget(&self, range: Range<u64>) {
        if range.start < FIRST {
            *self.0.head.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
        for number in touched(&[range]) {
            held().remove((self.0.number, number));
            if let Some(entry) = self.0.entry() {
                entry.remove_block(number);
            }
        }
    }

    /// Returns a file with all bytes, which is kept in the cache.
    ///
    /// # Errors
    /// Those of [`read`](Self::read); [`Error::Input`] for an object larger than the cache, and
    /// [`Error::Output`] if the file cannot be written.
    pub fn whole(&self) -> Result<File> {
        let mut whole = self.0.whole.lock().unwrap_or_else(PoisonError::into_inner);
        let file = match whole.take() {
            Some(file) => file,
            None => self.whole_file()?,
        };
        let file = whole.insert(file);
        file.try_clone().map_err(|error| Error::output(&self.0.cache.folder, error))
    }

    fn whole_file(&self) -> Result<File> {
        let (object, size) = (&self.0, self.len());
        if let Some(file) = object.entry().and_then(|entry| entry.whole(size)) {
            return Ok(file);
        }
        if size > object.cache.bytes {
            let message = format!(
                "has {size} bytes and is read as a whole, but the cache keeps at most {} bytes",
                object.cache.bytes
            );
            return Err(object
                .link
                .error("object", message)
                .hint("raise --cache-size, or download the file and give its path"));
        }
        let failed = |error: std::io::Error| Error::output(&object.cache.folder, error);
        let mut file = match object.entry() {
            Some(entry) => entry.begin_whole().map_err(failed)?,
            None => tempfile::NamedTempFile::new().map_err(failed)?,
        };
        let hash = object.copy_to(file.as_file_mut(), failed)?;
        match object.entry() {
            Some(entry) => entry.keep_whole(file, &hash).map_err(failed),
            None => file.reopen().map_err(failed),
        }
    }
}

impl Object {
    fn entry(&self) -> Option<&Entry> {
        let find = || Entry::of(&self.cache, &self.address, &self.stamp);
        self.entry.get_or_init(find).as_ref()
    }

    /// Returns blocks: from memory, from the disk, or from the server.
    fn obtain(&self, numbers: &BTreeSet<u64>) -> Result<HashMap<u64, Bytes>> {
        let size_of = |number: u64| {
            let bytes = bytes_of(&(number..number + 1), self.stamp.size);
            bytes.end.saturating_sub(bytes.start) as usize
        };
        let mut found = HashMap::new();
        let mut missing = Vec::new();
        for &number in numbers {
            let key = (self.number, number);
            let block = held().get(key);
            let block = block.or_else(|| {
                let block = self.entry()?.block(number, size_of(number))?;
                held().put(key, block.clone());
                Some(block)
            });
            match block {
                Some(block) => drop(found.insert(number, block)),
                None => missing.push(number),
            }
        }
        if missing.is_empty() {
            return Ok(found);
        }
        let spans = joined(missing);
        let ranges: Vec<_> = spans.iter().map(|span| bytes_of(span, self.stamp.size)).collect();
        let (_, parts) = self.link.parts(&ranges, Some(&self.stamp)).inspect_err(|_| self.age())?;
        for (span, part) in spans.into_iter().zip(parts) {
            for (place, number) in span.enumerate() {
                let start = place * BLOCK as usize;
                // A copy, so that one block does not keep a whole part in memory.
                let block = Bytes::copy_from_slice(&part[start..start + size_of(number)]);
                held().put((self.number, number), block.clone());
                if let Some(entry) = self.entry() {
                    entry.keep_block(number, &block);
                }
                found.insert(number, block);
            }
        }
        Ok(found)
    }

    /// Asks the server when the object is opened again.
    fn age(&self) {
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        opened.retain(|(_, object)| object.number != self.number);
    }

    /// Writes all bytes to a file, and returns their hash.
    fn copy_to(
        &self,
        file: &mut File,
        failed: impl Fn(std::io::Error) -> Error,
    ) -> Result<blake3::Hash> {
        let mut hash = blake3::Hasher::new();
        let spans = joined(0..self.stamp.size.div_ceil(BLOCK));
        for group in spans.chunks(8) {
            let ranges: Vec<_> = group.iter().map(|span| bytes_of(span, self.stamp.size)).collect();
            let (_, parts) = self.link.parts(&ranges, Some(&self.stamp))?;
            for part in parts {
                hash.update(&part);
                file.write_all(&part).map_err(&failed)?;
            }
        }
        file.sync_data().map_err(failed)?;
        Ok(hash.finalize())
    }
}
