//! The objects of a store: files of a folder, entries of a ZIP archive, or objects on a server.

use super::chunks::{Objects, Part};
use crate::{
    Error, Result,
    error::LimitKind,
    input::{Bytes, Limits, Source, below, copy, is_remote, isolate::isolated, neighbour},
};
use flate2::read::DeflateDecoder;
use serde_json::Value;
use std::{
    collections::{BTreeSet, HashMap},
    fs,
    io::{Cursor, Read},
    ops::Range,
    path::PathBuf,
    sync::Arc,
};
use zip::{CompressionMethod, ZipArchive};

/// Objects of a server that are read at the same time.
const AT_ONCE: usize = 16;

/// Most bytes of a file of metadata, and of an object that is unpacked.
const MOST_TEXT: u64 = 32 << 20;
const MOST_OBJECT: u64 = 4 << 30;

/// Most entries of an archive.
const MOST_ENTRIES: usize = 1 << 22;

/// Most nodes of a group that are listed.
const MOST_NODES: usize = 1 << 12;

/// The names of the files of metadata: of Zarr 3, and of the arrays and groups of Zarr 2.
pub const METADATA: [&str; 3] = ["zarr.json", ".zarray", ".zgroup"];

/// An opened store.
pub struct Store {
    path: PathBuf,
    limits: Limits,
    place: Place,
}

enum Place {
    /// A folder; its path without links.
    Folder(PathBuf),
    /// An archive: its bytes, and where each entry is. Names begin with this.
    Zip(Bytes, HashMap<String, Entry>, String),
    Server,
}

/// Where an entry of an archive is.
struct Entry {
    bytes: Range<u64>,
    unpacked: u64,
    is_packed: bool,
}

impl Store {
    /// Opens the store that a source is.
    ///
    /// # Errors
    /// [`Error::File`] for a folder that cannot be opened; [`Error::Input`] for an archive that is
    /// damaged.
    pub fn open(source: &Source) -> Result<Self> {
        let path = source.path;
        let place = if source.folder().is_none() {
            let entries = isolated(source, "archive", || entries(source))?;
            let root = root(&entries);
            let bytes = match source.held() {
                Some(bytes) => Bytes::Held(bytes.to_vec()),
                None => Bytes::open(path, source.limits)?,
            };
            Place::Zip(bytes, entries, root)
        } else if is_remote(path) {
            Place::Server
        } else {
            let home = path.canonicalize().map_err(|error| Error::file(path, "open", error))?;
            Place::Folder(home)
        };
        Ok(Self { path: path.to_owned(), limits: source.limits.clone(), place })
    }

    /// Reads a file of metadata; `None` if there is none.
    ///
    /// # Errors
    /// [`Error::Input`] for text that is no JSON.
    pub fn json(&self, key: &str) -> Result<Option<Value>> {
        let Some(bytes) = self.get(key, Part::Range(0..MOST_TEXT))? else { return Ok(None) };
        let wrong = |place: String, message: String| {
            Error::input(&self.place(key), place, message)
                .hint("the metadata is damaged: copy or write it again")
        };
        if bytes.len() as u64 == MOST_TEXT {
            let message = format!("has more than {MOST_TEXT} bytes, too many for metadata");
            return Err(wrong("file".into(), message));
        }
        let text = copy::text(&bytes)
            .map_err(|at| wrong(format!("byte {at}"), "is not UTF-8 text".into()))?;
        // Python writes what is no JSON for numbers that are not finite.
        let parsed = serde_json::from_str(&text)
            .or_else(|error| serde_json::from_str(&without_nan(&text)).map_err(|_| error));
        parsed.map(Some).map_err(|error| {
            wrong(format!("line {}", error.line()), format!("is no valid JSON: {error}"))
        })
    }

    /// Returns the names of the nodes in a group, of a store that can list them.
    pub fn nodes(&self, group: &str) -> Vec<String> {
        let mut names = BTreeSet::new();
        match &self.place {
            Place::Folder(_) => {
                let folder =
                    if group.is_empty() { self.path.clone() } else { self.path.join(group) };
                let entries = fs::read_dir(folder).into_iter().flatten().flatten();
                for entry in entries.take(MOST_NODES) {
                    if METADATA.iter().any(|name| entry.path().join(name).is_file()) {
                        names.insert(entry.file_name().to_string_lossy().into_owned());
                    }
                }
            }
            Place::Zip(_, entries, root) => {
                let start = joined(root, group);
                for name in entries.keys() {
                    let rest = name.strip_prefix(&start).filter(|_| !start.is_empty());
                    let rest = rest
                        .map_or(Some(name.as_str()).filter(|_| start.is_empty()), |rest| {
                            rest.strip_prefix('/')
                        });
                    let node = rest.and_then(|rest| rest.split_once('/'));
                    if let Some((node, _)) = node.filter(|(_, file)| METADATA.contains(file)) {
                        names.insert(node.to_owned());
                    }
                }
            }
            Place::Server => {}
        }
        names.into_iter().take(MOST_NODES).collect()
    }

    /// Opens the bytes of an object of a folder or a server; `None` if there is none.
    fn object(&self, key: &str) -> Result<Option<Bytes>> {
        let path = self.place(key);
        let Place::Folder(home) = &self.place else {
            return Bytes::open_if_there(&path, &self.limits);
        };
        if let Some(reason) = neighbour::leaves(&self.path, home, key) {
            let message = format!("refers to “{key}”, {reason}");
            return Err(Error::input(&self.path, "metadata", message));
        }
        // A folder of this name is an array or a group, not a chunk.
        if path.is_file() { Bytes::open(&path, &self.limits).map(Some) } else { Ok(None) }
    }

    fn part_of(&self, key: &str, bytes: &Bytes, part: Part, all: Range<u64>) -> Result<Vec<u8>> {
        let length = all.end - all.start;
        let range = match part {
            Part::Whole => 0..length,
            Part::Range(range) => range.start.min(length)..range.end.min(length),
            Part::Last(count) => length.saturating_sub(count)..length,
        };
        let size = range.end.saturating_sub(range.start);
        let path = self.place(key);
        self.limits.check(LimitKind::Bytes, &path, "the size of a chunk in bytes", size)?;
        if size == 0 {
            return Ok(Vec::new());
        }
        let range = all.start + range.start..all.start + range.end;
        let copied = bytes.decoded(range, |bytes| Ok(bytes.to_vec()))?;
        copied.map_err(|message| Error::input(&path, "file", message))
    }
}

impl Objects for Store {
    fn get(&self, key: &str, part: Part) -> Result<Option<Vec<u8>>> {
        let Place::Zip(bytes, entries, root) = &self.place else {
            let Some(bytes) = self.object(key)? else { return Ok(None) };
            let all = 0..bytes.len();
            return self.part_of(key, &bytes, part, all).map(Some);
        };
        let Some(entry) = entries.get(&joined(root, key)) else { return Ok(None) };
        if !entry.is_packed {
            return self.part_of(key, bytes, part, entry.bytes.clone()).map(Some);
        }
        let path = self.place(key);
        let most = entry.unpacked.min(MOST_OBJECT);
        self.limits.check(LimitKind::Bytes, &path, "the unpacked size in bytes", most)?;
        let packed = self.part_of(key, bytes, Part::Whole, entry.bytes.clone())?;
        let mut unpacked = Vec::new();
        let read = DeflateDecoder::new(&packed[..]).take(most).read_to_end(&mut unpacked);
        read.map_err(|error| {
            let message = format!("cannot be unpacked: {error}");
            Error::input(&path, "archive", message).hint("the archive is damaged: copy it again")
        })?;
        let all = unpacked.len() as u64;
        self.part_of(key, &Bytes::Held(unpacked), part, 0..all).map(Some)
    }

    fn at_once(&self) -> usize {
        match self.place {
            Place::Server => AT_ONCE,
            _ => crate::parallel::current_num_threads(),
        }
    }

    fn place(&self, key: &str) -> PathBuf {
        match &self.place {
            _ if key.is_empty() => self.path.clone(),
            Place::Server => below(&self.path, key),
            Place::Folder(_) | Place::Zip(..) => self.path.join(key),
        }
    }
}

/// Returns a store that several arrays share.
pub fn shared(store: &Arc<Store>) -> Arc<dyn Objects> {
    store.clone()
}

/// Returns a name below a group; the group may be the store itself.
pub fn joined(group: &str, name: &str) -> String {
    match (group.is_empty(), name.is_empty()) {
        (true, _) => name.to_owned(),
        (_, true) => group.to_owned(),
        _ => format!("{group}/{name}"),
    }
}

/// Replaces the words that Python writes for numbers that are not finite by `null`.
fn without_nan(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut in_text = false;
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let word = ["NaN", "-Infinity", "Infinity"].into_iter().find(|word| rest.starts_with(word));
        let taken = match word.filter(|_| !in_text) {
            Some(word) => {
                out.push_str("null");
                word.len()
            }
            None if letter == '\\' => {
                let length = 1 + rest[1..].chars().next().map_or(0, char::len_utf8);
                out.push_str(&rest[..length]);
                length
            }
            None => {
                in_text ^= letter == '"';
                out.push(letter);
                letter.len_utf8()
            }
        };
        rest = &rest[taken..];
    }
    out
}

/// Lists the entries of an archive.
fn entries(source: &Source) -> Result<HashMap<String, Entry>> {
    let wrong = |message: String| {
        source.error("archive", message).hint("the archive is damaged: copy or write it again")
    };
    let mut archive = ZipArchive::new(Cursor::new(source.bytes()))
        .map_err(|error| wrong(format!("is no ZIP archive that can be read: {error}")))?;
    if archive.len() > MOST_ENTRIES {
        return Err(source.error("archive", format!("holds more than {MOST_ENTRIES} files")));
    }
    source.room::<(String, Entry)>("the list of the archive", archive.len())?;
    let mut entries = HashMap::with_capacity(archive.len());
    for number in 0..archive.len() {
        if number % (1 << 12) == 0 {
            source.check_time()?;
        }
        let file = archive
            .by_index_raw(number)
            .map_err(|error| wrong(format!("has an entry {number} that is damaged: {error}")))?;
        let is_packed = match file.compression() {
            _ if file.is_dir() => continue,
            CompressionMethod::Stored => false,
            CompressionMethod::Deflated => true,
            other => {
                let message = format!("packs its files by {other}, which is not read");
                return Err(source.error("archive", message).hint("pack it without compression"));
            }
        };
        let start = file.data_start().unwrap_or(u64::MAX);
        let end = start.checked_add(file.compressed_size());
        let Some(end) = end.filter(|end| *end <= source.bytes().len() as u64) else {
            return Err(wrong(format!("is cut off in its entry {number}")));
        };
        let Ok(name) = file.name() else { continue };
        let name = name.trim_start_matches("./").to_owned();
        entries.insert(name, Entry { bytes: start..end, unpacked: file.size(), is_packed });
    }
    Ok(entries)
}

/// Returns the folder of an archive that is the store: the outermost with metadata.
fn root(entries: &HashMap<String, Entry>) -> String {
    let folder = |name: &String| {
        let (folder, file) = name.rsplit_once('/').unwrap_or(("", name));
        METADATA.contains(&file).then(|| folder.to_owned())
    };
    let folders = entries.keys().filter_map(folder);
    let depth =
        |folder: &String| if folder.is_empty() { 0 } else { 1 + folder.matches('/').count() };
    folders.min_by_key(|folder| (depth(folder), folder.clone())).unwrap_or_default()
}
