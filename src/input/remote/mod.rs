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
mod transport;

pub use cache::Cache;
pub use fetch::{Traffic, traffic};
pub use transport::allow_redirects;

use crate::{
    Deadline, Error, Result,
    input::{Limits, address},
};
use blocks::{BLOCK, bytes_of, joined, touched};
use bytes::Bytes;
use cache::Entry;
use fetch::{Link, Patience, Stamp};
use held::held;
use std::{
    collections::{BTreeSet, HashMap},
    fs::File,
    io::{Seek, Write},
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
    forget_opened();
}

/// Asks the servers when objects are opened again.
fn forget_opened() {
    OPENED.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// An opened object. Any number of threads may read from it. Each call waits for the server no
/// longer than the limit of seconds; those before [`ready`](Self::ready), together no longer.
#[derive(Clone)]
pub(crate) struct Remote {
    object: Arc<Object>,
    /// For each call.
    seconds: u64,
    /// For all calls until the object is ready.
    opening: Option<Deadline>,
}

/// Fetches ranges of an object, as [`Link::parts`] does.
trait Fetch: Fn(&Link, &[Range<u64>], Option<&Stamp>, Deadline) -> Result<(Stamp, Vec<Bytes>)> {}

impl<F: Fn(&Link, &[Range<u64>], Option<&Stamp>, Deadline) -> Result<(Stamp, Vec<Bytes>)>> Fetch
    for F
{
}

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
    pub fn open(path: &Path, limits: &Limits) -> Result<Self> {
        Self::opened(path, limits, Link::parts)
    }

    /// As [`open`](Self::open); `None` if the server says that there is no such object, or refuses
    /// access to it: public buckets of S3 do that for objects that they do not have.
    #[cfg(feature = "zarr")]
    pub fn open_if_there(path: &Path, limits: &Limits) -> Result<Option<Self>> {
        let is_absent = std::cell::Cell::new(false);
        let parts = |link: &Link, ranges: &[Range<u64>], stamp: Option<&Stamp>, deadline| {
            link.parts_if_there(ranges, stamp, deadline, &is_absent)
        };
        match Self::opened(path, limits, parts) {
            Err(_) if is_absent.get() => Ok(None),
            opened => opened.map(Some),
        }
    }

    fn opened(path: &Path, limits: &Limits, parts: impl Fetch) -> Result<Self> {
        let whole =
            address::whole(path).map_err(|message| Error::input(path, "address", message))?;
        let (seconds, opening) = (limits.seconds, Some(limits.deadline()));
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |object: &Object| object.address == whole;
        opened.retain(|(when, object)| when.elapsed() < FRESH || !same(object));
        if let Some((_, object)) = opened.iter().find(|(_, object)| same(object)) {
            return Ok(Self { object: object.clone(), seconds, opening });
        }
        drop(opened);
        let cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let how = (cache.unwrap_or_default(), Patience::default());
        let remote = Self::open_in(path, how, limits, parts)?;
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        opened.truncate(RECENT - 1);
        opened.insert(0, (Instant::now(), remote.object.clone()));
        Ok(remote)
    }

    fn open_in(
        path: &Path,
        (cache, patience): (Cache, Patience),
        limits: &Limits,
        parts: impl Fetch,
    ) -> Result<Self> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let deadline = limits.deadline();
        let link = Link::new(path, patience)?;
        let first = 0..FIRST;
        let (stamp, parts) = parts(&link, std::slice::from_ref(&first), None, deadline)?;
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
        let (object, opening) = (Arc::new(object), Some(deadline));
        Ok(Self { object, seconds: limits.seconds, opening })
    }

    /// Returns the size of an object. That of one which this process has opened is known, and the
    /// server is not asked again.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn size(path: &Path) -> Result<u64> {
        let whole = address::whole(path).unwrap_or_default();
        let opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        let known = opened.iter().find(|(_, object)| object.address == whole);
        if let Some((_, object)) = known {
            return Ok(object.stamp.size);
        }
        drop(opened);
        Ok(Self::open(path, &Limits::default())?.len())
    }

    /// Says that the beginning was read: from now on, each call has the limit of seconds for
    /// itself.
    pub fn ready(&mut self) {
        self.opening = None;
    }

    fn deadline(&self) -> Deadline {
        self.opening.unwrap_or_else(|| Deadline::after(self.seconds))
    }

    /// The object's name in messages.
    pub fn name(&self) -> &Path {
        self.object.link.name()
    }

    /// The object's size in bytes.
    pub fn len(&self) -> u64 {
        self.object.stamp.size
    }

    /// Returns what else than the size shows that the object has changed, as text; `None` if the
    /// server does not say.
    pub fn stamp(&self) -> Option<String> {
        let stamp = &self.object.stamp;
        stamp.shows_changes().then(|| format!("{stamp:?}"))
    }

    /// Returns the first bytes, at least [`FIRST`] or all.
    pub fn head(&self) -> Result<Bytes> {
        let head = self.object.head.lock().unwrap_or_else(PoisonError::into_inner).clone();
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
        let head = self.object.head.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(head) = head.filter(|head| range.end <= head.len() as u64) {
            return Ok(head.slice(range.start as usize..range.end as usize));
        }
        let numbers = touched(std::slice::from_ref(&range));
        let blocks = self.object.obtain(&numbers, self.deadline())?;
        let mut all = Vec::with_capacity((range.end - range.start) as usize);
        for number in numbers {
            let (start, block) = (number * BLOCK, &blocks[&number]);
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
        let head = self.object.head.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let known = head.map_or(0, |head| head.len() as u64);
        let ranges: Vec<Range<u64>> =
            ranges.iter().filter(|range| range.end > known).cloned().collect();
        let numbers: Vec<u64> = touched(&ranges).into_iter().collect();
        let deadline = self.deadline();
        for group in numbers.chunks(GROUP) {
            self.object.obtain(&group.iter().copied().collect(), deadline)?;
        }
        Ok(())
    }

    /// Forgets a range whose bytes are wrong, so that it is fetched again.
    pub fn forget(&self, range: Range<u64>) {
        if range.start < FIRST {
            *self.object.head.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
        for number in touched(&[range]) {
            held().remove((self.object.number, number));
            if let Some(entry) = self.object.entry() {
                entry.remove_block(number);
            }
        }
    }

    /// Returns a file with all bytes. It is kept in the cache, or else has no name and goes with
    /// this process.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), and [`Error::Output`] if not even a temporary file can be
    /// written.
    pub fn whole(&self) -> Result<File> {
        let mut whole = self.object.whole.lock().unwrap_or_else(PoisonError::into_inner);
        let file = match whole.take() {
            Some(file) => file,
            None => self.whole_file()?,
        };
        let file = whole.insert(file);
        file.try_clone().map_err(|error| Error::output(self.name(), error))
    }

    fn whole_file(&self) -> Result<File> {
        let (size, most) = (self.len(), self.object.cache.bytes);
        if let Some(entry) = self.object.entry() {
            if let Some(file) = entry.whole(size) {
                return Ok(file);
            }
            if size > most {
                tracing::warn!(
                    "{}: has {size} bytes, but the cache keeps at most {most} bytes \
                     (--cache-size): it is read through a temporary file, and is fetched again \
                     the next time",
                    self.name().display()
                );
            } else {
                match self.kept(entry) {
                    // It may be that disk that is full.
                    Err(Error::Output { source, .. }) => entry.warn(&source),
                    kept => return kept,
                }
            }
        }
        let failed = |error: std::io::Error| Error::output(&std::env::temp_dir(), error);
        let mut file = tempfile::tempfile().map_err(failed)?;
        self.object.copy_to(&mut file, &mut blake3::Hasher::new(), self.deadline(), failed)?;
        file.rewind().map_err(failed)?;
        Ok(file)
    }

    /// Fetches all bytes into a file of the cache.
    fn kept(&self, entry: &Entry) -> Result<File> {
        let failed = |error: std::io::Error| Error::output(&self.object.cache.folder, error);
        let mut hash = entry.hash_of_whole();
        let mut file = entry.begin_whole().map_err(failed)?;
        self.object.copy_to(file.as_file_mut(), &mut hash, self.deadline(), failed)?;
        entry.keep_whole(file, &hash.finalize()).map_err(failed)
    }
}

impl Object {
    fn entry(&self) -> Option<&Entry> {
        let find = || Entry::of(&self.cache, &self.address, &self.stamp);
        self.entry.get_or_init(find).as_ref()
    }

    /// Returns blocks: from memory, from the disk, or from the server.
    fn obtain(&self, numbers: &BTreeSet<u64>, deadline: Deadline) -> Result<HashMap<u64, Bytes>> {
        let size_of = |number: u64| {
            let bytes = bytes_of(&(number..number + 1), self.stamp.size);
            bytes.end.saturating_sub(bytes.start) as usize
        };
        let mut blocks = HashMap::new();
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
                Some(block) => drop(blocks.insert(number, block)),
                None => missing.push(number),
            }
        }
        if missing.is_empty() {
            return Ok(blocks);
        }
        let spans = joined(missing);
        let ranges: Vec<_> = spans.iter().map(|span| bytes_of(span, self.stamp.size)).collect();
        let parts = self.link.parts(&ranges, Some(&self.stamp), deadline);
        let (_, parts) = parts.inspect_err(|_| self.age())?;
        for (span, part) in spans.into_iter().zip(parts) {
            for (place, number) in span.enumerate() {
                let start = place * BLOCK as usize;
                // A copy, so that one block does not keep a whole part in memory.
                let block = Bytes::copy_from_slice(&part[start..start + size_of(number)]);
                held().put((self.number, number), block.clone());
                if let Some(entry) = self.entry() {
                    entry.keep_block(number, &block);
                }
                blocks.insert(number, block);
            }
        }
        Ok(blocks)
    }

    /// Asks the server when the object is opened again.
    fn age(&self) {
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        opened.retain(|(_, object)| object.number != self.number);
    }

    /// Writes all bytes to a file, and adds them to a hash.
    fn copy_to(
        &self,
        file: &mut File,
        hash: &mut blake3::Hasher,
        deadline: Deadline,
        failed: impl Fn(std::io::Error) -> Error,
    ) -> Result<()> {
        let (mut start, end) = (0, self.stamp.size.div_ceil(BLOCK));
        while start < end {
            let group = joined(start..end.min(start + GROUP as u64));
            start += GROUP as u64;
            let ranges: Vec<_> = group.iter().map(|span| bytes_of(span, self.stamp.size)).collect();
            let (_, parts) = self.link.parts(&ranges, Some(&self.stamp), deadline)?;
            for part in parts {
                hash.update(&part);
                file.write_all(&part).map_err(&failed)?;
            }
        }
        file.sync_data().map_err(failed)
    }
}
