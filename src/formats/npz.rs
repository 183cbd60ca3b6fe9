//! NPZ archives: several NumPy arrays in a ZIP file, as `numpy.savez` and `numpy.savez_compressed`
//! write them.

use super::{
    ReadOptions,
    array::{Array, Place},
    npy::{self, Header, Shaped},
    shared::listing,
};
use crate::{
    Result,
    input::{Source, isolate::isolated},
    volume::Volume,
};
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Bytes of an array's header that are read to list it. Real headers are far shorter.
const LONGEST: u64 = 1 << 16;

/// Most files of an archive that are looked at.
const MOST_FILES: usize = 1 << 14;

/// An array of an archive.
struct Entry {
    /// Its number in the archive.
    index: usize,
    /// Its name, without `.npy`.
    name: String,
    /// The unpacked size in bytes.
    size: u64,
    header: Header,
    shaped: Shaped,
}

/// Reads the array that [`ReadOptions::dataset`] names, as a volume; otherwise the largest that is
/// one. Which of its axes is x is the same as for NPY files ([`npy::read_volume`]).
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not an archive of arrays, for a name
/// that it does not contain, with those that it does, and for an array that is no volume;
/// [`Error::Limit`](crate::Error::Limit) for an array over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let mut archive = open(source)?;
    let entries = entries(source, &mut archive)?;
    let chosen = chosen(source, &entries, options)?;
    let size = source.check_bytes("the size of an array in bytes", chosen.size)?;
    let bytes = isolated(source, &chosen.shaped.place, || {
        let file = archive.by_index(chosen.index).map_err(|error| told(source, &error))?;
        source.unpack(&chosen.shaped.place, file, size)
    })?;
    npy::volume_of(source, &chosen.shaped, bytes[chosen.header.start..].into(), options)
}

/// Lists the arrays.
///
/// # Errors
/// As [`read`], for the archive.
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    let mut archive = open(source)?;
    let entries = entries(source, &mut archive)?;
    let drawn = chosen(source, &entries, options).ok().map(|entry| entry.index);
    let array = |entry: Entry| Array {
        kind: format!("{} {}", entry.header.element.name(), entry.shaped.shown),
        name: entry.name,
        place: Place::Points,
        components: 1,
        range: None,
        is_drawn: drawn == Some(entry.index),
    };
    Ok(entries.into_iter().map(array).collect())
}

fn told(source: &Source, error: &zip::result::ZipError) -> crate::Error {
    source.error("archive", format!("is not a ZIP archive that can be read: {error}"))
}

fn open<'a>(source: &'a Source) -> Result<ZipArchive<Cursor<&'a [u8]>>> {
    isolated(source, "archive", || {
        ZipArchive::new(Cursor::new(source.bytes())).map_err(|error| told(source, &error))
    })
}

/// Returns the arrays of numbers; others are left out with a warning.
fn entries(source: &Source, archive: &mut ZipArchive<Cursor<&[u8]>>) -> Result<Vec<Entry>> {
    let mut entries = Vec::new();
    if archive.len() > MOST_FILES {
        let message = format!("has {} files, more than the {MOST_FILES} allowed", archive.len());
        return Err(source.error("archive", message));
    }
    for index in 0..archive.len() {
        source.check_time()?;
        let (name, size, head) = isolated(source, &format!("file {index}"), || {
            let file = archive.by_index(index).map_err(|error| told(source, &error))?;
            let name = file.name().map_err(|error| told(source, &error))?.into_owned();
            let (size, mut head) = (file.size(), Vec::new());
            file.take(LONGEST).read_to_end(&mut head).map_err(|error| {
                source.error(format!("array “{name}”"), format!("cannot be unpacked: {error}"))
            })?;
            Ok((name, size, head))
        })?;
        source.spend("the size of the list of arrays in bytes", 256 + name.len() as u64)?;
        let Some(name) = name.strip_suffix(".npy") else { continue };
        let place = format!("array “{name}”");
        match Header::within(source, &head, &place) {
            Ok(header) => entries.push(Entry {
                index,
                name: name.into(),
                size,
                shaped: npy::shaped(&header, &place),
                header,
            }),
            Err(error) => tracing::warn!("{error}; the array is left out"),
        }
    }
    Ok(entries)
}

/// Returns the array to draw.
fn chosen<'a>(source: &Source, entries: &'a [Entry], options: &ReadOptions) -> Result<&'a Entry> {
    let list = || {
        let entry = |entry: &Entry| {
            format!("“{}”, {} {}", entry.name, entry.header.element.name(), entry.shaped.shown)
        };
        listing(entries.iter().map(entry))
    };
    if let Some(name) = &options.dataset {
        let name = name.strip_suffix(".npy").unwrap_or(name);
        return entries.iter().find(|entry| entry.name == name).ok_or_else(|| {
            source
                .error("archive", format!("has no array “{name}”; it has {}", list()))
                .hint("name one of these with --dataset")
        });
    }
    let volumes = entries.iter().filter(|entry| entry.shaped.is_volume());
    volumes.max_by_key(|entry| (entry.size, std::cmp::Reverse(entry.index))).ok_or_else(|| {
        source
            .error("archive", format!("has no array of three axes; it has {}", list()))
            .hint("choose an array with --dataset, and its time with --time")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::*;
    use std::io::Write;
    use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

    fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut file = b"\x93NUMPY\x01\0".to_vec();
        file.extend((text.len() as u16).to_le_bytes());
        file.extend(text.bytes());
        file.extend(data);
        file
    }

    fn archive(files: &[(&str, Vec<u8>)], method: CompressionMethod) -> Vec<u8> {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in files {
            let options = SimpleFileOptions::default().compression_method(method);
            writer.start_file(*name, options).unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn two() -> Vec<(&'static str, Vec<u8>)> {
        vec![
            ("mask.npy", npy("|b1", "(1, 1, 2)", &[0, 1])),
            ("names.npy", npy("<U4", "(2,)", &[0; 32])),
            ("ct.npy", npy("<i2", "(1, 2, 2)", &[1, 0, 2, 0, 3, 0, 255, 255])),
            ("affine.npy", npy("<f8", "(4, 4)", &[0; 128])),
        ]
    }

    fn named(name: Option<&str>) -> ReadOptions {
        ReadOptions { dataset: name.map(Into::into), ..ReadOptions::default() }
    }

    #[test]
    fn the_largest_volume_or_the_named_one_is_read() {
        let folder = Folder::new();
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let path = folder.write("a.npz", archive(&two(), method));
            let load = |name| read_with(&path, |source| read(source, &named(name)));
            let volume = load(None).unwrap();
            assert_eq!((volume.lattice.dims, volume.range), ([2, 2, 1], [-1.0, 3.0]));
            for name in ["mask", "mask.npy"] {
                assert_eq!(load(Some(name)).unwrap().lattice.dims, [2, 1, 1]);
            }
            let error = load(Some("pet")).unwrap_err().to_string();
            assert!(error.contains("“ct”, i16 (1, 2, 2)"), "{error}");
            let error = load(Some("affine")).unwrap_err().to_string();
            assert!(error.contains("array “affine”: has the shape (4, 4)"), "{error}");
            let list = read_with(&path, |source| arrays(source, &named(None))).unwrap();
            let list: Vec<_> =
                list.iter().map(|a| (&a.name[..], &a.kind[..], a.is_drawn)).collect();
            assert_eq!(
                list,
                [
                    ("mask", "bool (1, 1, 2)", false),
                    ("ct", "i16 (1, 2, 2)", true),
                    ("affine", "f64 (4, 4)", false)
                ]
            );
        }
    }

    #[test]
    fn cuts_and_other_archives_are_errors() {
        let folder = Folder::new();
        let bytes = archive(&two()[2..3], CompressionMethod::Deflated);
        every_cut(&folder, "a.npz", &bytes, |source| read(source, &named(None)));
        let empty = folder.write("b.npz", archive(&[], CompressionMethod::Stored));
        let error = read_with(&empty, |source| read(source, &named(None))).unwrap_err();
        assert!(error.to_string().contains("it has nothing"), "{error}");
    }
}
