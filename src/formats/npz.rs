//! NPZ archives: several NumPy arrays in a ZIP file, as `numpy.savez` and `numpy.savez_compressed`
//! write them.

mod cloud;

use super::{
    Kind, ReadOptions,
    array::{Array, Place},
    npy::{self, Header, Shaped},
    shared::listing,
};
use crate::{
    Result,
    input::{Source, isolate::isolated},
    surface::Mesh,
    volume::Volume,
    warning,
};
use cloud::Columns;
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

/// What is drawn of an archive: indices among its arrays.
enum Drawn {
    Volume(usize),
    Cloud(Columns),
}

/// Returns the kind of data: a point cloud if the array that [`ReadOptions::dataset`] names has
/// three columns, or if the names and the shapes of the arrays say so; else a volume.
///
/// # Errors
/// As [`read`].
pub fn kind(source: &Source, options: &ReadOptions) -> Result<Kind> {
    let mut archive = open(source)?;
    let entries = entries(source, &mut archive)?;
    Ok(match drawn(source, &entries, options)? {
        Drawn::Volume(_) => Kind::Volume,
        Drawn::Cloud(_) => Kind::Mesh,
    })
}

/// Reads the array that [`ReadOptions::dataset`] names, as a volume; otherwise the largest that is
/// one. Which of its axes is x is the same as for NPY files ([`npy::read_volume`]).
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not an archive of arrays, and for an
/// array that is no volume. Also for an unknown name, with those that the file contains, and if it
/// is not clear which array is meant. [`Error::Limit`](crate::Error::Limit) for an array over the
/// limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let mut archive = open(source)?;
    let entries = entries(source, &mut archive)?;
    let Drawn::Volume(chosen) = drawn(source, &entries, options)? else {
        return Err(source.error("archive", "holds a point cloud, not a volume"));
    };
    let volumes = entries.iter().filter(|entry| entry.is_volume()).count();
    let chosen = &entries[chosen];
    if volumes > 1 && options.dataset.is_none() {
        let (path, name) = (source.path.display(), &chosen.name);
        warning::give!(
            "{path}: shows “{name}”, the largest of {volumes} volumes; --dataset names another"
        );
    }
    let bytes = unpacked(source, &mut archive, chosen)?;
    npy::volume_of(source, &chosen.shaped, bytes[chosen.header.start..].into(), options)
}

/// Reads a point cloud: an array of three columns with the positions, and with as many rows the
/// arrays of colours, normals, and of the values that [`ReadOptions::scalar`] names, if there are
/// any. They are known by their names (`points`, `xyz`, `colors`, `rgb`, `normals`, …); of a single
/// array of three columns, and of one that [`ReadOptions::dataset`] names, the name may be any.
///
/// # Errors
/// As [`read`], and for positions that are not finite, with the row.
pub fn read_cloud(source: &Source, options: &ReadOptions) -> Result<Mesh> {
    let mut archive = open(source)?;
    let entries = entries(source, &mut archive)?;
    let Drawn::Cloud(columns) = drawn(source, &entries, options)? else {
        return Err(source.error("archive", "holds a volume, not a point cloud"));
    };
    let read = |entry: &Entry| {
        let bytes = unpacked(source, &mut archive, entry)?;
        let data = &bytes[entry.header.start..];
        npy::numbers(source, &entry.header, data)
    };
    cloud::read(source, &entries, &columns, options, read)
}

/// Unpacks an array, with its header.
fn unpacked(
    source: &Source,
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    entry: &Entry,
) -> Result<Vec<u8>> {
    let size = source.check_bytes("the size of an array in bytes", entry.size)?;
    isolated(source, &entry.shaped.place, || {
        let file = archive.by_index(entry.index).map_err(|error| archive_error(source, &error))?;
        source.unpack(&entry.shaped.place, file, size)
    })
}

/// Lists the arrays.
///
/// # Errors
/// As [`read`], for the archive.
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    let mut archive = open(source)?;
    let entries = entries(source, &mut archive)?;
    let drawn = match drawn(source, &entries, options) {
        Ok(Drawn::Volume(at)) => vec![at],
        Ok(Drawn::Cloud(columns)) => columns.all(&entries, options),
        Err(_) => Vec::new(),
    };
    let array = |(at, entry): (usize, Entry)| Array {
        kind: format!("{} {}", entry.header.element.name(), entry.shaped.shape_text),
        name: entry.name,
        place: Place::Points,
        components: 1,
        range: None,
        is_drawn: drawn.contains(&at),
    };
    Ok(entries.into_iter().enumerate().map(array).collect())
}

fn archive_error(source: &Source, error: &zip::result::ZipError) -> crate::Error {
    source.error("archive", format!("is not a ZIP archive that can be read: {error}"))
}

fn open<'a>(source: &'a Source) -> Result<ZipArchive<Cursor<&'a [u8]>>> {
    isolated(source, "archive", || {
        ZipArchive::new(Cursor::new(source.bytes())).map_err(|error| archive_error(source, &error))
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
            let file = archive.by_index(index).map_err(|error| archive_error(source, &error))?;
            let name = file.name().map_err(|error| archive_error(source, &error))?.into_owned();
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
            Err(error) => warning::give!("{error}; the array is left out"),
        }
    }
    Ok(entries)
}

impl Entry {
    /// Whether it is surely a volume. A last axis of three or four numbers behind two longer ones
    /// is rather a picture in colours, or lists of points.
    fn is_volume(&self) -> bool {
        let [first, second, third @ 3..=4] = self.header.shape[..] else {
            return self.shaped.is_volume();
        };
        first.min(second) <= 2 * third
    }
}

/// Returns what to draw.
fn drawn(source: &Source, entries: &[Entry], options: &ReadOptions) -> Result<Drawn> {
    let list = || {
        let entry = |entry: &Entry| {
            format!("“{}”, {} {}", entry.name, entry.header.element.name(), entry.shaped.shape_text)
        };
        listing(entries.iter().map(entry))
    };
    let ask =
        |message: String| source.error("archive", message).hint("name one of these with --dataset");
    if let Some(name) = &options.dataset {
        let name = name.strip_suffix(".npy").unwrap_or(name);
        let Some(at) = entries.iter().position(|entry| entry.name == name) else {
            return Err(ask(format!("has no array “{name}”; it has {}", list())));
        };
        let is_cloud = matches!(entries[at].header.shape[..], [_, 3]);
        return Ok(match is_cloud {
            true => Drawn::Cloud(Columns::around(entries, at)),
            false => Drawn::Volume(at),
        });
    }
    let volumes = (0..entries.len()).filter(|&at| entries[at].is_volume());
    let largest = volumes.max_by_key(|&at| (entries[at].size, std::cmp::Reverse(at)));
    match (largest, Columns::of(entries)) {
        (Some(at), None) => Ok(Drawn::Volume(at)),
        (None, Some(columns)) => Ok(Drawn::Cloud(columns)),
        (Some(volume), Some(cloud)) => {
            let [volume, points] = [volume, cloud.positions].map(|at| &entries[at].name);
            Err(ask(format!(
                "holds the volume “{volume}” and the points “{points}”; it has {}",
                list()
            )))
        }
        (None, None) => {
            let message =
                format!("has no array that is surely a volume or a point cloud; it has {}", list());
            let hint = "choose an array with --dataset, and its time with --time; positions are an \
                        array of three columns, named points or xyz";
            Err(source.error("archive", message).hint(hint))
        }
    }
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

    fn floats(values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    /// Two points, with what belongs to them and what does not.
    fn points() -> Vec<(&'static str, Vec<u8>)> {
        vec![
            ("intrinsics.npy", npy("<f4", "(3, 3)", &floats(&[0.0; 9]))),
            ("xyz.npy", npy("<f4", "(2, 3)", &floats(&[1.0, 2.0, 3.0, 1.0, 2.0, 5.0]))),
            ("rgb.npy", npy("|u1", "(2, 3)", &[200, 40, 40, 0, 0, 255])),
            ("Normals.npy", npy("<f4", "(2, 3)", &floats(&[0.0, 0.0, 2.0, 1.0, 0.0, 0.0]))),
            ("label.npy", npy("|u1", "(2,)", &[7, 9])),
        ]
    }

    #[test]
    fn points_with_colors_are_a_cloud() {
        let folder = Folder::new();
        let path = folder.write("a.npz", archive(&points(), CompressionMethod::Deflated));
        let read = |options: &ReadOptions| read_with(&path, |source| read_cloud(source, options));
        let default = ReadOptions::default();
        assert_eq!(read_with(&path, |source| kind(source, &default)).unwrap(), Kind::Mesh);
        let mesh = read(&default).unwrap();
        assert_eq!(mesh.origin + mesh.positions[1].as_dvec3(), glam::DVec3::new(1.0, 2.0, 5.0));
        assert_eq!(mesh.colors, [[200, 40, 40, 255], [0, 0, 255, 255]]);
        assert_eq!(mesh.normals[0], glam::Vec3::Z);
        assert_eq!(read(&ReadOptions::scalar(Some("label"))).unwrap().values, [7.0, 9.0]);
        let error = read(&ReadOptions::scalar(Some("age"))).unwrap_err().to_string();
        assert!(error.contains("no values “age” for 2 points"), "{error}");
        let list = read_with(&path, |source| arrays(source, &default)).unwrap();
        let drawn: Vec<_> = list.iter().filter(|a| a.is_drawn).map(|a| &a.name[..]).collect();
        assert_eq!(drawn, ["xyz", "rgb", "Normals"]);
    }

    #[test]
    fn colors_of_floats_are_fractions() {
        let mut files = points();
        files[2] = ("colors.npy", npy("<f4", "(2, 3)", &floats(&[1.0, 0.2, 0.2, 0.0, 0.0, 0.5])));
        let folder = Folder::new();
        let path = folder.write("a.npz", archive(&files, CompressionMethod::Stored));
        let mesh = read_with(&path, |source| read_cloud(source, &ReadOptions::default())).unwrap();
        assert_eq!(mesh.colors, [[255, 51, 51, 255], [0, 0, 128, 255]]);
    }

    #[test]
    fn arrays_of_unclear_meaning_are_asked_for() {
        let folder = Folder::new();
        let error = |files: &[(&str, Vec<u8>)]| {
            let path = folder.write("a.npz", archive(files, CompressionMethod::Stored));
            let error = read_with(&path, |source| kind(source, &ReadOptions::default()));
            error.unwrap_err().to_string()
        };
        // A picture in colours is no volume of three samples along x.
        let picture = vec![("image.npy", npy("|u1", "(9, 9, 3)", &[0; 243]))];
        assert!(error(&picture).contains("“image”, u8 (9, 9, 3)"), "{}", error(&picture));
        let path = folder.write("b.npz", archive(&picture, CompressionMethod::Stored));
        let named = read_with(&path, |source| read(source, &named(Some("image")))).unwrap();
        assert_eq!(named.lattice.dims, [3, 9, 9]);
        let both = [points(), two()].concat();
        let message = error(&both);
        assert!(message.contains("the volume “ct” and the points “xyz”"), "{message}");
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
