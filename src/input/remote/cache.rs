//! Blocks and whole objects on disk. Each is a file of its own that appears whole (written beside
//! and renamed), so that several processes share a folder without locks: what another process has
//! removed is fetched again.
//!
//! ```text
//! DIR/objects/<key>/used        its time is when the object was opened last
//! DIR/objects/<key>/<number>    a block and its hash
//! DIR/objects/<key>/whole-<hash>
//! ```
//!
//! The key is a hash of the address and of the object's stamp. So the bytes of an object that has
//! changed are never mixed with those from before.

use super::Stamp;
use bytes::Bytes;
use std::{
    fs::{self, File},
    io::{self, Read, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed},
    time::SystemTime,
};

/// Bytes of a hash.
const HASH: usize = 32;

/// Where fetched bytes are kept on disk, and how many.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cache {
    /// The folder. It is made when something is kept.
    pub folder: PathBuf,
    /// Most bytes of all files in it. With 0, nothing is kept on disk.
    pub bytes: u64,
}

impl Default for Cache {
    /// `splatkit` in the user's folder for caches, or in that for temporary files; 1 GiB.
    fn default() -> Self {
        use etcetera::BaseStrategy;
        let folder = etcetera::choose_base_strategy().map(|strategy| strategy.cache_dir());
        let folder = folder.unwrap_or_else(|_| std::env::temp_dir());
        Self { folder: folder.join("splatkit"), bytes: 1 << 30 }
    }
}

/// The files of one object.
pub(super) struct Entry {
    cache: Cache,
    folder: PathBuf,
    key: [u8; HASH],
    /// Bytes written since the folder was last trimmed.
    written: AtomicU64,
    /// Whether a file could not be written, which is reported once.
    has_failed: AtomicBool,
}

impl Entry {
    /// Returns the files of an object; `None` if nothing is kept: the cache is off, or the server
    /// gives neither a tag nor a time by which a change would show.
    pub fn of(cache: &Cache, address: &str, stamp: &Stamp) -> Option<Self> {
        if cache.bytes == 0 || !stamp.shows_changes() {
            return None;
        }
        let key = *blake3::hash(format!("{address}\n{stamp:?}").as_bytes()).as_bytes();
        let name = blake3::Hash::from_bytes(key).to_hex();
        let folder = cache.folder.join("objects").join(&name[..32]);
        let own = Self {
            cache: cache.clone(),
            folder,
            key,
            written: AtomicU64::new(0),
            has_failed: AtomicBool::new(false),
        };
        own.trim();
        own.keep("used", &[&[]]);
        Some(own)
    }

    /// Returns a block of this many bytes. A damaged one is removed.
    pub fn block(&self, number: u64, size: usize) -> Option<Bytes> {
        let path = self.folder.join(number.to_string());
        let mut kept = Vec::with_capacity(size + HASH);
        File::open(&path).ok()?.take((size + HASH + 1) as u64).read_to_end(&mut kept).ok()?;
        let is_sound = kept.len() == size + HASH
            && kept[size..] == *self.hash(number, &kept[..size]).as_bytes();
        if !is_sound {
            tracing::info!(file = %path.display(), "a damaged file of the cache is left out");
            fs::remove_file(&path).ok();
            return None;
        }
        kept.truncate(size);
        Some(kept.into())
    }

    pub fn keep_block(&self, number: u64, block: &[u8]) {
        self.keep(&number.to_string(), &[block, self.hash(number, block).as_bytes()]);
    }

    pub fn remove_block(&self, number: u64) {
        fs::remove_file(self.folder.join(number.to_string())).ok();
    }

    /// A hash that differs between objects and blocks too, so that a file in the place of another
    /// is damaged.
    fn hash(&self, number: u64, block: &[u8]) -> blake3::Hash {
        let mut hash = blake3::Hasher::new_keyed(&self.key);
        hash.update(&number.to_le_bytes()).update(block).finalize()
    }

    /// Returns the whole object, if it is kept. A damaged one is removed.
    pub fn whole(&self, size: u64) -> Option<File> {
        for file in fs::read_dir(&self.folder).ok()?.flatten() {
            let name = file.file_name();
            let Some(stated) = name.to_str().and_then(|name| name.strip_prefix("whole-")) else {
                continue;
            };
            let path = file.path();
            let mut hash = blake3::Hasher::new();
            let is_sound = file.metadata().is_ok_and(|found| found.len() == size)
                && File::open(&path).is_ok_and(|mut open| io::copy(&mut open, &mut hash).is_ok())
                && *stated == *hash.finalize().to_hex();
            if is_sound {
                return File::open(path).ok();
            }
            tracing::info!(file = %path.display(), "a damaged file of the cache is left out");
            fs::remove_file(path).ok();
        }
        None
    }

    /// Makes a file for the whole object, which [`keep_whole`](Self::keep_whole) names.
    pub fn begin_whole(&self) -> io::Result<tempfile::NamedTempFile> {
        fs::create_dir_all(&self.folder)?;
        tempfile::NamedTempFile::new_in(&self.folder)
    }

    pub fn keep_whole(
        &self,
        file: tempfile::NamedTempFile,
        hash: &blake3::Hash,
    ) -> io::Result<File> {
        // Opened before it has its name: trimming, here or in another process, may remove it at
        // once. The first handle may write.
        let kept = File::open(file.path())?;
        file.persist(self.folder.join(format!("whole-{}", hash.to_hex())))?;
        self.trim();
        Ok(kept)
    }

    /// Writes a file. A failure costs only time, so it is reported once and the work goes on.
    fn keep(&self, name: &str, parts: &[&[u8]]) {
        let written = (|| {
            fs::create_dir_all(&self.folder)?;
            let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
            parts.iter().try_for_each(|part| file.write_all(part))?;
            file.persist(self.folder.join(name))?;
            Ok::<(), io::Error>(())
        })();
        if let Err(error) = written {
            if !self.has_failed.swap(true, Relaxed) {
                let folder = self.cache.folder.display();
                tracing::warn!("the cache {folder} cannot be written: {error}");
            }
            return;
        }
        let more: u64 = parts.iter().map(|part| part.len() as u64).sum();
        if self.written.fetch_add(more, Relaxed) + more > self.cache.bytes / 8 {
            self.trim();
        }
    }

    /// Removes files until an eighth of the cache is free: of the objects that were opened longest
    /// ago first, and of each object the oldest first.
    fn trim(&self) {
        self.written.store(0, Relaxed);
        let mut files = files(&self.cache.folder.join("objects"));
        let mut bytes: u64 = files.iter().map(|file| file.bytes).sum();
        let most = self.cache.bytes - self.cache.bytes / 8;
        files.sort_by_key(|file| (file.used, file.written));
        for file in &files {
            if bytes <= most {
                break;
            }
            if fs::remove_file(&file.path).is_ok() {
                bytes -= file.bytes;
            }
            // Only an empty folder can be removed.
            file.path.parent().map(fs::remove_dir);
        }
    }
}

struct Kept {
    path: PathBuf,
    bytes: u64,
    written: SystemTime,
    /// When its object was opened last.
    used: SystemTime,
}

fn files(objects: &Path) -> Vec<Kept> {
    let mut all = Vec::new();
    let folders = fs::read_dir(objects).into_iter().flatten().flatten();
    for folder in folders.map(|folder| folder.path()) {
        let used = fs::metadata(folder.join("used")).and_then(|file| file.modified());
        let used = used.unwrap_or(SystemTime::UNIX_EPOCH);
        for file in fs::read_dir(folder).into_iter().flatten().flatten() {
            let Ok(found) = file.metadata() else { continue };
            let written = found.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            all.push(Kept { path: file.path(), bytes: found.len(), written, used });
        }
    }
    all
}
