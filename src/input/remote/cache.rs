//! Blocks and whole objects on disk. Each is a file of its own that appears whole (written beside
//! and renamed), so that several processes share a folder without locks: what another process has
//! removed is fetched again.
//!
//! ```text
//! DIR/objects/<key>/used        its time is when the object was opened last
//! DIR/objects/<key>/<number>    a block and its hash
//! DIR/objects/<key>/whole-<hash>
//! DIR/objects/<key>/part-…      one of these that is being written
//! ```
//!
//! The key is a hash of the address and of the object's stamp, 32 hexadecimal digits. So the bytes
//! of an object that has changed are never mixed with those from before. The hashes depend on the
//! key, and all bytes are checked against them before they are used.
//!
//! Files and folders of other names are not the cache's: they are neither counted nor removed. No
//! symbolic link below DIR is followed.

use super::Stamp;
use bytes::Bytes;
use std::{
    fs::{self, File},
    io::{self, Read, Seek, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed},
    time::{Duration, SystemTime},
};

/// Bytes of a hash.
const HASH: usize = 32;

/// Hexadecimal digits in the name of an object's folder.
const DIGITS: usize = 32;

const USED: &str = "used";
const WHOLE: &str = "whole-";
const PART: &str = "part-";

/// An unfinished file that was not written to for so long was left behind by a process that ended.
const LEFT_BEHIND: Duration = Duration::from_secs(3600);

/// Where fetched bytes are kept on disk, and how many.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cache {
    /// The folder. It is made when something is kept, for the user alone. With an empty path,
    /// nothing is kept on disk.
    pub folder: PathBuf,
    /// Most bytes of all files in it. With 0, nothing is kept on disk.
    pub bytes: u64,
}

impl Default for Cache {
    /// `splatkit` in the user's folder for caches; 1 GiB. A user without such a folder has none:
    /// in the folder for temporary files, everyone could guess its name.
    fn default() -> Self {
        use etcetera::BaseStrategy;
        let folder =
            etcetera::choose_base_strategy().map(|strategy| strategy.cache_dir().join("splatkit"));
        Self { folder: folder.unwrap_or_default(), bytes: 1 << 30 }
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
        if cache.bytes == 0 || cache.folder.as_os_str().is_empty() || !stamp.shows_changes() {
            return None;
        }
        let key = *blake3::hash(format!("{address}\n{stamp:?}").as_bytes()).as_bytes();
        let name = blake3::Hash::from_bytes(key).to_hex();
        let folder = cache.folder.join("objects").join(&name[..DIGITS]);
        let entry = Self {
            cache: cache.clone(),
            folder,
            key,
            written: AtomicU64::new(0),
            has_failed: AtomicBool::new(false),
        };
        entry.trim();
        entry.keep(USED, &[&[]]);
        Some(entry)
    }

    /// Returns a block of this many bytes. A damaged one is removed.
    pub fn block(&self, number: u64, size: usize) -> Option<Bytes> {
        let path = self.folder.join(number.to_string());
        let mut kept = Vec::with_capacity(size + HASH);
        self.open(&path)?.take((size + HASH + 1) as u64).read_to_end(&mut kept).ok()?;
        let is_sound = kept.len() == size + HASH
            && kept[size..] == *self.hash(number, &kept[..size]).as_bytes();
        if !is_sound {
            remove_damaged(&path);
            return None;
        }
        kept.truncate(size);
        Some(kept.into())
    }

    pub fn keep_block(&self, number: u64, block: &[u8]) {
        self.keep(&number.to_string(), &[block, self.hash(number, block).as_bytes()]);
    }

    pub fn remove_block(&self, number: u64) {
        let path = self.folder.join(number.to_string());
        if self.open(&path).is_some() {
            fs::remove_file(path).ok();
        }
    }

    /// A hash that differs between objects and blocks too, so that a file in the place of another
    /// is damaged.
    fn hash(&self, number: u64, block: &[u8]) -> blake3::Hash {
        let mut hash = blake3::Hasher::new_keyed(&self.key);
        hash.update(&number.to_le_bytes()).update(block).finalize()
    }

    /// The hash of a whole object, before its bytes.
    pub fn hash_of_whole(&self) -> blake3::Hasher {
        blake3::Hasher::new_keyed(&self.key)
    }

    /// Returns the whole object, if it is kept. A damaged one is removed.
    pub fn whole(&self, size: u64) -> Option<File> {
        for file in self.is_own().then(|| fs::read_dir(&self.folder).ok())??.flatten() {
            let name = file.file_name();
            let Some(stated) = name.to_str().and_then(|name| name.strip_prefix(WHOLE)) else {
                continue;
            };
            let path = file.path();
            let Some(mut open) = self.open(&path) else { continue };
            let mut hash = self.hash_of_whole();
            let is_sound = open.metadata().is_ok_and(|metadata| metadata.len() == size)
                && io::copy(&mut open, &mut hash).is_ok()
                && *stated == *hash.finalize().to_hex();
            // The file that was checked, not another one that may have its name by now.
            if is_sound && open.rewind().is_ok() {
                return Some(open);
            }
            remove_damaged(&path);
        }
        None
    }

    /// Makes a file for the whole object, which [`keep_whole`](Self::keep_whole) names.
    pub fn begin_whole(&self) -> io::Result<tempfile::NamedTempFile> {
        self.begin()
    }

    pub fn keep_whole(
        &self,
        file: tempfile::NamedTempFile,
        hash: &blake3::Hash,
    ) -> io::Result<File> {
        // Opened before it has its name: trimming, here or in another process, may remove it at
        // once. The first handle may write.
        let kept = File::open(file.path())?;
        file.persist(self.folder.join(format!("{WHOLE}{}", hash.to_hex())))?;
        self.trim();
        Ok(kept)
    }

    /// Reports, once, that nothing can be kept.
    pub fn warn(&self, error: &io::Error) {
        if !self.has_failed.swap(true, Relaxed) {
            let folder = self.cache.folder.display();
            tracing::warn!(
                "the cache {folder} cannot be written: {error}; nothing is kept for the next time"
            );
        }
    }

    /// Whether the object's folder exists, and is no symbolic link out of the cache.
    fn is_own(&self) -> bool {
        self.folder.parent().is_some_and(is_folder) && is_folder(&self.folder)
    }

    /// Opens a file of this object. Others, such as links and pipes, are not opened.
    fn open(&self, path: &Path) -> Option<File> {
        let is_file = || path.symlink_metadata().is_ok_and(|metadata| metadata.is_file());
        (self.is_own() && is_file()).then(|| File::open(path).ok())?
    }

    /// Begins a file of this object, and makes its folder.
    fn begin(&self) -> io::Result<tempfile::NamedTempFile> {
        let mut builder = fs::DirBuilder::new();
        builder.recursive(true);
        #[cfg(unix)]
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
        builder.create(&self.folder)?;
        if !self.is_own() {
            let message = format!("{} lies behind a symbolic link", self.folder.display());
            return Err(io::Error::other(message));
        }
        tempfile::Builder::new().prefix(PART).tempfile_in(&self.folder)
    }

    /// Writes a file. A failure costs only time, so it is reported once and the work goes on.
    fn keep(&self, name: &str, parts: &[&[u8]]) {
        let written = (|| {
            let mut file = self.begin()?;
            parts.iter().try_for_each(|part| file.write_all(part))?;
            file.persist(self.folder.join(name))?;
            Ok::<(), io::Error>(())
        })();
        if let Err(error) = written {
            self.warn(&error);
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
        // The time of an object's last use goes after its blocks.
        files.sort_by_cached_key(|file| {
            (file.used, file.path.parent().map(Path::to_owned), file.is_mark(), file.written)
        });
        let mut last = None;
        for file in &files {
            let folder = file.path.parent();
            let is_rest = file.is_mark() && folder == last;
            if bytes <= most && !is_rest {
                break;
            }
            if fs::remove_file(&file.path).is_ok() {
                bytes -= file.bytes;
            }
            // Only an empty folder can be removed.
            folder.map(fs::remove_dir);
            last = folder;
        }
    }
}

/// A folder itself, not a symbolic link to one.
fn is_folder(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|metadata| metadata.is_dir())
}

fn remove_damaged(path: &Path) {
    tracing::info!(file = %path.display(), "a damaged file of the cache is left out");
    fs::remove_file(path).ok();
}

/// A file that the cache has made.
struct Kept {
    path: PathBuf,
    bytes: u64,
    written: SystemTime,
    /// When its object was opened last.
    used: SystemTime,
}

impl Kept {
    /// Whether its time, rather than its bytes, is what is kept.
    fn is_mark(&self) -> bool {
        self.path.ends_with(USED)
    }
}

/// Returns the files that the cache has made.
fn files(objects: &Path) -> Vec<Kept> {
    let mut all = Vec::new();
    let folders = is_folder(objects).then(|| fs::read_dir(objects).ok()).flatten();
    for folder in folders.into_iter().flatten().flatten() {
        let name = folder.file_name();
        let folder = folder.path();
        if !(name.to_str().is_some_and(|name| is_hexadecimal(name, DIGITS)) && is_folder(&folder)) {
            continue;
        }
        let used = folder.join(USED).symlink_metadata().and_then(|file| file.modified());
        let used = used.unwrap_or(SystemTime::UNIX_EPOCH);
        for file in fs::read_dir(folder).into_iter().flatten().flatten() {
            // The file itself, also where it is a symbolic link.
            let Ok(metadata) = file.metadata() else { continue };
            let written = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let name = file.file_name();
            let is_own = name.to_str().is_some_and(|name| is_own_name(name, written));
            if metadata.is_file() && is_own {
                all.push(Kept { path: file.path(), bytes: metadata.len(), written, used });
            }
        }
    }
    all
}

/// Whether the cache gives its files such a name. That of an unfinished file counts once its
/// process must have ended.
fn is_own_name(name: &str, written: SystemTime) -> bool {
    let is_left = || written.elapsed().is_ok_and(|age| age > LEFT_BEHIND);
    let is_number = || name.parse::<u64>().is_ok_and(|number| number.to_string() == name);
    let is_whole = |hash| is_hexadecimal(hash, 2 * HASH);
    name == USED
        || is_number()
        || name.strip_prefix(WHOLE).is_some_and(is_whole)
        || (name.starts_with(PART) && is_left())
}

fn is_hexadecimal(name: &str, digits: usize) -> bool {
    name.len() == digits && name.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'))
}
