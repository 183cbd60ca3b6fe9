//! An open HDF5 file, read by the crate `hdf5-pure` from the mapped bytes, behind the limits.

use crate::{
    Error, Result,
    input::{Mapping, Source, isolate::isolated},
};
use hdf5_pure::{AttrValue, Dataset, Datatype, FormatError, Group};
use std::collections::HashMap;

/// Most groups and data sets of a file that are looked at. Links may form circles.
const MOST_OBJECTS: usize = 1 << 14;

/// An open file.
pub struct File<'a> {
    source: &'a Source<'a>,
    file: hdf5_pure::File,
}

/// A data set of a file.
pub struct Found {
    /// Its path, without the first slash.
    pub path: String,
    pub shape: Vec<u64>,
    pub datatype: Datatype,
    pub attributes: HashMap<String, AttrValue>,
    /// Whether it names scales of its dimensions.
    pub has_scales: bool,
    data_set: Dataset,
}

/// The bytes of a file, which the crate asks for piece by piece.
struct Bytes<T>(T);

impl<T: std::ops::Deref<Target = [u8]>> hdf5_pure::Source for Bytes<T> {
    fn len(&self) -> u64 {
        self.0.len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), FormatError> {
        let end_of_file = FormatError::UnexpectedEof {
            expected: usize::try_from(offset).unwrap_or(usize::MAX).saturating_add(buffer.len()),
            available: self.0.len(),
        };
        let start = usize::try_from(offset).ok();
        let found = start.and_then(|start| self.0.get(start..)?.get(..buffer.len()));
        buffer.copy_from_slice(found.ok_or(end_of_file)?);
        Ok(())
    }
}

impl<'a> File<'a> {
    /// Opens the bytes of a source.
    pub fn open(source: &'a Source<'a>) -> Result<Self> {
        let file = isolated(source, "file", || {
            let opened = if source.is_alone() {
                source.room::<u8>("the file", source.bytes().len())?;
                hdf5_pure::File::from_bytes(source.bytes().to_vec())
            } else {
                let mapping: Mapping = Source::map(source.path, source.limits)?;
                hdf5_pure::File::from_source(Bytes(mapping))
            };
            opened.map_err(|error| told(source, "file", &error))
        })?;
        Ok(Self { source, file })
    }

    /// Returns the group at the root.
    pub fn root(&self) -> Group {
        self.file.root()
    }

    /// Returns the data sets of all groups.
    pub fn data_sets(&self) -> Result<Vec<Found>> {
        self.data_sets_of(self.root(), "")
    }

    /// Returns the data sets of a group and of those in it, with their paths below `path`.
    pub fn data_sets_of(&self, group: Group, path: &str) -> Result<Vec<Found>> {
        let mut found = Vec::new();
        let mut open = vec![(group, path.to_owned(), 0)];
        let mut count = 0;
        while let Some((group, path, depth)) = open.pop() {
            self.source.check_time()?;
            let place = format!("group “{path}”");
            let below =
                |name: &str| if path.is_empty() { name.into() } else { format!("{path}/{name}") };
            let (sets, groups) = isolated(self.source, &place, || {
                let told = |error| told(self.source, &place, &error);
                let sets: Vec<_> = group.iter_datasets().map_err(told)?.collect();
                let groups: Vec<_> = group.iter_groups().map_err(told)?.collect();
                Ok((sets, groups))
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
                match self.looked_at(&path, data_set) {
                    Ok(set) => found.push(set),
                    Err(error) => tracing::warn!("{error}; the data set is left out"),
                }
            }
            // Circles of links end at this depth.
            if depth < self.source.limits.depth {
                let inner = groups.into_iter().rev();
                open.extend(inner.map(|(name, group)| (group, below(&name), depth + 1)));
            }
        }
        Ok(found)
    }

    fn looked_at(&self, path: &str, data_set: Dataset) -> Result<Found> {
        let place = format!("data set “{path}”");
        let (shape, datatype, attributes, has_scales) = isolated(self.source, &place, || {
            let told = |error| told(self.source, &place, &error);
            let datatype = data_set.datatype().map_err(told)?;
            // Attributes are a convenience: what cannot be read of them is left out.
            let attributes = data_set.attrs().unwrap_or_default();
            let kinds = data_set.attr_datatypes().unwrap_or_default();
            let has_scales = kinds.contains_key("DIMENSION_LIST");
            Ok((data_set.shape().map_err(told)?, datatype, attributes, has_scales))
        })?;
        Ok(Found { path: path.into(), shape, datatype, attributes, has_scales, data_set })
    }

    /// Returns a group; `None` if there is none of this path.
    pub fn group(&self, path: &str) -> Result<Option<Group>> {
        // Looked up name by name: errors are not told apart from groups that are missing.
        let mut group = self.root();
        for name in path.split('/') {
            let inner = isolated(self.source, "groups", || {
                let told = |error| told(self.source, "groups", &error);
                let found = group.iter_groups().map_err(told)?.find(|(own, _)| own == name);
                Ok(found)
            })?;
            match inner {
                Some((_, inner)) => group = inner,
                None => return Ok(None),
            }
        }
        Ok(Some(group))
    }

    /// Returns the attributes of a group.
    pub fn attributes(&self, group: &Group) -> Result<HashMap<String, AttrValue>> {
        isolated(self.source, "attributes", || {
            group.attrs().map_err(|error| told(self.source, "attributes", &error))
        })
    }

    /// Reads the `size` bytes of a data set, as they are stored.
    pub fn bytes(&self, found: &Found, size: Option<u64>) -> Result<Vec<u8>> {
        let place = format!("data set “{}”", found.path);
        let claim = size.unwrap_or(u64::MAX);
        let size = self.source.check_bytes("the size of a data set in bytes", claim)?;
        let there = self.source.bytes().len() as u64;
        if claim > there.saturating_mul(super::MOST_UNPACKED) {
            let message = format!("needs {claim} bytes, but the file has only {there}");
            return Err(self.source.error(place, message));
        }
        self.source.spend("the size of a data set in bytes", size as u64)?;
        let bytes = isolated(self.source, &place, || {
            found.data_set.read_raw().map_err(|error| told(self.source, &place, &error))
        })?;
        if bytes.len() != size {
            let message = format!("has {} bytes where {size} were expected", bytes.len());
            return Err(self.source.error(place, message));
        }
        Ok(bytes)
    }
}

/// Returns the error of the crate with its place.
fn told(source: &Source, place: &str, error: &hdf5_pure::Error) -> Error {
    let found = source.error(place, format!("cannot be read: {error}"));
    match error {
        hdf5_pure::Error::Format(FormatError::UnsupportedFilter(_)) => found.hint(
            "the data are packed by a filter that is not read here; pack them anew with \
             h5repack -f GZIP=4 IN.h5 OUT.h5",
        ),
        hdf5_pure::Error::Format(
            FormatError::UnsupportedExternalStorage | FormatError::UnsupportedVirtualLayout,
        ) => found.hint("the data are in other files; copy them into one: h5copy or h5repack"),
        hdf5_pure::Error::Format(FormatError::SignatureNotFound) => found,
        hdf5_pure::Error::Format(_) => found.hint(
            "if other programs read the file, write it again in an older form: h5py.File(OUT, \
             'w', libver='earliest')",
        ),
        _ => found,
    }
}
