//! An open HDF5 file, read by the crate `hdf5-pure` from the mapped bytes, behind the limits.

use super::span::Span;
use crate::{
    Error, Result,
    input::{Source, Watch, isolate::isolated},
    warning,
};
use hdf5_pure::{
    AttrValue, Dataset, Datatype, FileAccessProperties, FormatError, Group, Layout,
    MetadataCacheConfig,
};
use std::{
    collections::HashMap,
    ops::Deref,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
};

/// A list of the file's structure is read in one call. A call that reads the file's bytes more
/// often than this goes in circles.
const MOST_READ: u64 = 64;

/// Bytes of memory that a chunk takes in a list.
const CHUNK: u64 = 128;

/// Bytes that a call may read of a small file.
const LEAST_READ: u64 = 4 << 20;

/// Most groups and data sets of a file that are looked at. Links may form circles.
const MOST_OBJECTS: usize = 1 << 14;

/// An open file.
pub struct File<'a> {
    source: &'a Source<'a>,
    file: hdf5_pure::File,
    /// Bytes of the file's structure that the current call has read.
    read: Arc<AtomicU64>,
}

/// A data set of a file.
pub struct StoredSet {
    /// Its path, without the first slash.
    pub path: String,
    pub shape: Vec<u64>,
    pub datatype: Datatype,
    pub attributes: HashMap<String, AttrValue>,
    /// Whether it names scales of its dimensions.
    pub has_scales: bool,
    data_set: Dataset,
}

/// The bytes of a file, which the crate asks for piece by piece. Everything that it makes of the
/// file's structure comes through here, so here it is stopped.
struct Bytes<T> {
    bytes: T,
    watch: Watch,
    /// Bytes of the file's structure that the current call has read.
    read: Arc<AtomicU64>,
    /// Most of them.
    most: u64,
}

impl<T: Deref<Target = [u8]>> Bytes<T> {
    fn new(bytes: T, source: &Source, read: &Arc<AtomicU64>) -> Self {
        let most = (bytes.len() as u64).saturating_mul(MOST_READ).saturating_add(LEAST_READ);
        // A list takes a few times the bytes that it is read from.
        let most = most.min(source.limits.bytes / 4);
        Self { bytes, watch: source.watch(), read: read.clone(), most }
    }
}

impl<T: Deref<Target = [u8]>> hdf5_pure::Source for Bytes<T> {
    fn len(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), FormatError> {
        if self.watch.is_over() {
            return Err(FormatError::Source("the time for reading is over".into()));
        }
        let end_of_file = FormatError::UnexpectedEof {
            expected: usize::try_from(offset).unwrap_or(usize::MAX).saturating_add(buffer.len()),
            available: self.bytes.len(),
        };
        let start = usize::try_from(offset).ok();
        let bytes = start.and_then(|start| self.bytes.get(start..)?.get(..buffer.len()));
        buffer.copy_from_slice(bytes.ok_or(end_of_file)?);
        Ok(())
    }

    fn read_metadata_at(&self, offset: u64, length: usize) -> Result<Vec<u8>, FormatError> {
        let read = self.read.fetch_add(length as u64, Relaxed).saturating_add(length as u64);
        if read > self.most {
            let message = "its lists refer to the same bytes again and again";
            return Err(FormatError::Source(message.into()));
        }
        self.read_exact_at(offset, length)
    }
}

impl<'a> File<'a> {
    /// Opens the bytes of a source.
    pub fn open(source: &'a Source<'a>) -> Result<Self> {
        Span::of(source.bytes()).check(source)?;
        let read = Arc::new(AtomicU64::new(0));
        // Repeated reads are cheap here, and must be counted.
        let properties = FileAccessProperties::new();
        let properties = properties.with_metadata_cache(MetadataCacheConfig::disabled());
        let file = asked(source, &read, "file", || {
            if source.is_alone() {
                source.room::<u8>("the file", source.bytes().len())?;
                let bytes = Bytes::new(source.bytes().to_vec(), source, &read);
                Ok(hdf5_pure::File::from_source_with_options(bytes, properties))
            } else {
                let mapping = Source::map(source.path, source.limits)?;
                let bytes = Bytes::new(mapping, source, &read);
                Ok(hdf5_pure::File::from_source_with_options(bytes, properties))
            }
        })?;
        Ok(Self { source, file, read })
    }

    /// Asks the crate for something, behind the guard against panics.
    fn ask<T>(&self, place: &str, work: impl FnOnce() -> Result<T, hdf5_pure::Error>) -> Result<T> {
        asked(self.source, &self.read, place, || Ok(work()))
    }

    /// Returns the group at the root.
    pub fn root(&self) -> Group {
        self.file.root()
    }

    /// Returns the data sets of all groups.
    pub fn data_sets(&self) -> Result<Vec<StoredSet>> {
        self.data_sets_of(self.root(), "")
    }

    /// Returns the data sets of a group and of those in it, with their paths below `path`.
    pub fn data_sets_of(&self, group: Group, path: &str) -> Result<Vec<StoredSet>> {
        let mut list = Vec::new();
        let mut open = vec![(group, path.to_owned(), 0)];
        let mut count = 0;
        while let Some((group, path, depth)) = open.pop() {
            self.source.check_time()?;
            let place = format!("group “{path}”");
            let below =
                |name: &str| if path.is_empty() { name.into() } else { format!("{path}/{name}") };
            let (sets, groups) = self.ask(&place, || {
                let sets: Vec<_> = group.iter_datasets()?.collect();
                Ok((sets, group.iter_groups()?.collect::<Vec<_>>()))
            })?;
            count += sets.len() + groups.len();
            if count > MOST_OBJECTS {
                let message = format!("has more than {MOST_OBJECTS} groups and data sets");
                return Err(self
                    .source
                    .error("file", message)
                    .hint("write one data set to a file"));
            }
            for (name, data_set) in sets {
                let path = below(&name);
                self.source.spend("the size of the list of data sets in bytes", 1024)?;
                match self.inspect(&path, data_set) {
                    Ok(set) => list.push(set),
                    Err(error) => warning::give!("{error}; the data set is left out"),
                }
            }
            // Circles of links end at this depth.
            if depth < self.source.limits.depth {
                let inner = groups.into_iter().rev();
                open.extend(inner.map(|(name, group)| (group, below(&name), depth + 1)));
            }
        }
        Ok(list)
    }

    fn inspect(&self, path: &str, data_set: Dataset) -> Result<StoredSet> {
        let place = format!("data set “{path}”");
        let (shape, datatype, attributes, has_scales) = self.ask(&place, || {
            let datatype = data_set.datatype()?;
            // Attributes are a convenience: what cannot be read of them is left out.
            let attributes = data_set.attrs().unwrap_or_default();
            let kinds = data_set.attr_datatypes().unwrap_or_default();
            let has_scales = kinds.contains_key("DIMENSION_LIST");
            Ok((data_set.shape()?, datatype, attributes, has_scales))
        })?;
        Ok(StoredSet { path: path.into(), shape, datatype, attributes, has_scales, data_set })
    }

    /// Returns a group; `None` if there is none of this path.
    pub fn group(&self, path: &str) -> Result<Option<Group>> {
        // Looked up name by name: errors are not told apart from groups that are missing.
        let mut group = self.root();
        for name in path.split('/') {
            let inner =
                self.ask("groups", || Ok(group.iter_groups()?.find(|(member, _)| member == name)))?;
            match inner {
                Some((_, inner)) => group = inner,
                None => return Ok(None),
            }
        }
        Ok(Some(group))
    }

    /// Returns the attributes of a group.
    pub fn attributes(&self, group: &Group) -> Result<HashMap<String, AttrValue>> {
        self.ask("attributes", || group.attrs())
    }

    /// Reads the `size` bytes of a data set, as they are stored.
    pub fn bytes(&self, set: &StoredSet, size: Option<u64>) -> Result<Vec<u8>> {
        let place = format!("data set “{}”", set.path);
        let claim = size.unwrap_or(u64::MAX);
        let size = self.source.check_bytes("the size of a data set in bytes", claim)?;
        let there = self.source.bytes().len() as u64;
        if claim > there.saturating_mul(super::MOST_UNPACKED) {
            let message = format!("needs {claim} bytes, but the file has only {there}");
            return Err(self.source.error(place, message));
        }
        self.source.spend("the size of a data set in bytes", size as u64)?;
        self.check_chunks(set, &place)?;
        let bytes = self.ask(&place, || set.data_set.read_raw())?;
        if bytes.len() != size {
            let message = format!("has {} bytes where {size} were expected", bytes.len());
            return Err(self.source.error(place, message));
        }
        Ok(bytes)
    }

    /// Checks the chunks of a data set before the crate takes memory for them: their size, their
    /// number, and that each lies within the file.
    fn check_chunks(&self, set: &StoredSet, place: &str) -> Result<()> {
        let source = self.source;
        let layout = self.ask(place, || set.data_set.layout())?;
        let Layout::Chunked { chunk_shape, .. } = layout else { return Ok(()) };
        let element = self.ask(place, || set.data_set.element_size())?;
        let product = |sizes: &[u64]| sizes.iter().fold(1, |all: u64, &n| all.saturating_mul(n));
        // The filters of a chunk take turns with two copies of it.
        let bytes = product(&chunk_shape).saturating_mul(element).saturating_mul(2);
        source.lend("the size of a chunk in bytes", bytes)?;
        let along = |(&size, &chunk): (&u64, &u64)| size.div_ceil(chunk.max(1));
        let counts: Vec<u64> = set.shape.iter().zip(&chunk_shape).map(along).collect();
        let most = product(&counts);
        source.lend("the size of the list of chunks in bytes", most.saturating_mul(CHUNK))?;
        let chunks = self.ask(place, || set.data_set.chunks())?;
        if chunks.len() as u64 > most {
            let message = format!("lists {} chunks, but has only {most}", chunks.len());
            return Err(source.error(place, message));
        }
        let places = chunks.iter().map(|chunk| (chunk.address, chunk.storage_size));
        let there = source.bytes().len() as u64;
        let Some(at) = beyond(places, there) else { return Ok(()) };
        let chunk = &chunks[at];
        let index = chunk.offset.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
        let (size, address) = (chunk.storage_size, chunk.address);
        let message = format!(
            "the chunk at ({index}) claims {size} bytes from byte {address}, but the file has only \
             {there}"
        );
        Err(source.error(place, message))
    }
}

/// Returns the first of these places and sizes that does not lie within a file.
fn beyond(mut places: impl Iterator<Item = (u64, u64)>, there: u64) -> Option<usize> {
    places.position(|(place, size)| place.checked_add(size).is_none_or(|end| end > there))
}

/// Calls the crate behind the guard against panics. Its error has a place, unless the time is over.
fn asked<T>(
    source: &Source,
    read: &AtomicU64,
    place: &str,
    work: impl FnOnce() -> Result<Result<T, hdf5_pure::Error>>,
) -> Result<T> {
    source.check_time()?;
    read.store(0, Relaxed);
    isolated(source, place, || {
        work()?
            .map_err(|error| source.check_time().err().unwrap_or(reported(source, place, &error)))
    })
}

/// Returns the error of the crate with its place.
fn reported(source: &Source, place: &str, error: &hdf5_pure::Error) -> Error {
    let wrapped = source.error(place, format!("cannot be read: {error}"));
    match error {
        hdf5_pure::Error::Format(FormatError::UnsupportedFilter(_)) => wrapped.hint(
            "the data are packed by a filter that is not read here; pack them anew with \
             h5repack -f GZIP=4 IN.h5 OUT.h5",
        ),
        hdf5_pure::Error::Format(
            FormatError::UnsupportedExternalStorage | FormatError::UnsupportedVirtualLayout,
        ) => wrapped.hint("the data are in other files; copy them into one: h5copy or h5repack"),
        hdf5_pure::Error::Format(FormatError::SignatureNotFound) => wrapped,
        hdf5_pure::Error::Format(_) => wrapped.hint(
            "if other programs read the file, write it again in an older form: h5py.File(OUT, \
             'w', libver='earliest')",
        ),
        _ => wrapped,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use hdf5_pure::{FileBuilder, Source as _};
    use std::path::Path;

    #[test]
    fn chunks_lie_within_the_file() {
        assert_eq!(beyond([(0, 10), (4, 6), (10, 0)].into_iter(), 10), None);
        for bad in [(4, 7), (11, 0), (0, u64::MAX), (u64::MAX, 1), (u64::MAX, u64::MAX)] {
            assert_eq!(beyond([(0, 10), bad].into_iter(), 10), Some(1), "{bad:?}");
        }
    }

    #[test]
    fn reading_in_circles_ends() {
        let limits = Limits { bytes: 1 << 20, ..Limits::default() };
        let source = Source::from_bytes(Path::new("a.h5"), &[7; 1000], &limits).unwrap();
        let read = Arc::new(AtomicU64::new(0));
        let bytes = Bytes::new(source.bytes(), &source, &read);
        let reads = |_: &usize| bytes.read_metadata_at(0, 1000).is_ok();
        // A quarter of the bytes that may be taken.
        assert_eq!((0..10_000).take_while(reads).count(), (1 << 18) / 1000);
        read.store(0, Relaxed);
        assert!(bytes.read_metadata_at(0, 1000).is_ok());
        assert!(bytes.read_metadata_at(1, 1000).is_err());
    }

    #[test]
    fn reading_ends_with_the_time() {
        let limits = Limits { seconds: 0, ..Limits::default() };
        let source = Source::from_bytes(Path::new("a.h5"), &[7; 1000], &limits).unwrap();
        let bytes = Bytes::new(source.bytes(), &source, &Arc::new(AtomicU64::new(0)));
        assert!(bytes.read_at(0, &mut [0; 10]).is_err());
    }

    #[test]
    fn the_memory_of_chunks_is_within_the_limits() {
        let mut file = FileBuilder::new();
        let set = file.create_dataset("v").with_u8_data(&[0; 1 << 20]).with_shape(&[64, 128, 128]);
        set.with_chunks(&[64, 128, 128]).with_deflate(9);
        let bytes = file.finish().unwrap();
        // The data set fits, but not two copies of its chunk beside it.
        for (most, is_read) in [(4 << 20, true), (5 << 19, false)] {
            let limits = Limits { bytes: most, ..Limits::default() };
            let source = Source::from_bytes(Path::new("a.h5"), &bytes, &limits).unwrap();
            let file = File::open(&source).unwrap();
            let sets = file.data_sets().unwrap();
            let read = file.bytes(&sets[0], Some(1 << 20));
            assert_eq!(read.is_ok(), is_read, "{most}");
            if let Err(error) = read {
                assert!(error.to_string().contains("the size of a chunk"), "{error}");
            }
        }
    }

    #[test]
    fn a_file_that_is_cut_off_is_refused() {
        let mut file = FileBuilder::new();
        file.create_dataset("v").with_u8_data(&[1, 2]).with_shape(&[1, 1, 2]);
        let mut bytes = file.finish().unwrap();
        let limits = Limits::default();
        let open = |bytes: &[u8]| {
            let source = Source::from_bytes(Path::new("a.h5"), bytes, &limits).unwrap();
            File::open(&source).map(drop)
        };
        open(&bytes).unwrap();
        bytes.pop();
        let error = open(&bytes).unwrap_err().to_string();
        let (end, there) = (bytes.len() + 1, bytes.len());
        let message =
            format!("is cut off: its header says that it has {end} bytes, but it has {there}");
        assert!(error.contains(&message), "{error}");
    }
}
