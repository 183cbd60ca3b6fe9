//! What a row of the table of formats says, and how the row of a file is found.

use super::{
    Array, Kind, RawLayout, ReadOptions, Series,
    form::Form,
    shared::{plain::Plain, stand_in},
};
use crate::{
    Result, cells::Cells, gaussians::Gaussians, input::Source, scattered::Points, surface::Mesh,
    volume::Volume,
};
use std::{fmt, path::Path};

/// A file format: a row of [`FORMATS`](super::FORMATS).
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// The name by which users know it.
    pub name: &'static str,
    /// In lower case, without the dot. Empty if any file may be in this format.
    pub extensions: &'static [&'static str],
    /// What its files hold.
    pub holds: &'static [Holding],
    /// The extension of the files that splatkit writes in this format.
    pub written: Option<&'static str>,
    /// Whether a file may refer to other files with a part of its data.
    pub refers: bool,
    /// The cargo feature that brings the reader; `None` if every build has it.
    pub feature: Option<&'static str>,
    pub(super) magic: Magic,
    /// Whether the files of a folder are together one input of this format. `None` if they never
    /// are.
    pub(super) folder: Option<fn(&Source) -> Result<bool>>,
    pub(super) kind: Which,
    pub(super) mesh: Option<fn(&Source, &ReadOptions) -> Result<Mesh>>,
    pub(super) volume: Option<VolumeReader>,
    pub(super) samples: Option<SamplesReader>,
    pub(super) cells: Option<fn(&Source, &ReadOptions) -> Result<Cells>>,
    pub(super) gaussians: Option<fn(&Source, &ReadOptions) -> Result<Gaussians>>,
    pub(super) pieces: InPieces,
    pub(super) arrays: Option<ListArrays>,
    pub(super) series: Option<ListSeries>,
}

/// Reads scattered samples.
pub(super) type SamplesReader = fn(&Source, &ReadOptions) -> Result<Points>;

/// Lists the arrays of a file.
pub(super) type ListArrays = fn(&Source, &ReadOptions) -> Result<Vec<Array>>;

/// Lists the series of a folder.
pub(super) type ListSeries = fn(&Source, &ReadOptions) -> Result<Vec<Series>>;

/// Locates the points of a file; `None` if it can only be read as a whole.
pub(super) type FindPieces = fn(&Source) -> Result<Option<Box<dyn Form>>>;

/// What a file may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Content {
    /// Triangles.
    Mesh,
    /// Points without triangles, which become surfels.
    PointCloud,
    /// Samples on a lattice.
    Volume,
    /// Samples at any positions.
    Samples,
    /// Cells with a field inside.
    Cells,
    /// Trained 3D Gaussians.
    Gaussians,
    /// A hierarchy of splats.
    Hierarchy,
    /// A volume in bricks.
    Bricks,
}

/// What files of a format hold, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Holding {
    /// The kind of data.
    pub content: Content,
    /// Which of the files hold it (“without faces”); empty for all of them.
    pub when: &'static str,
}

/// How the first bytes of a file show its format.
#[derive(Debug, Clone, Copy)]
pub(super) enum Magic {
    /// They do not.
    None,
    Prefix(&'static [u8]),
    /// A function of the file's bytes, which looks at the first of them only.
    Rule(fn(&[u8]) -> bool),
}

/// Which kind of data a file of a format contains.
#[derive(Debug, Clone, Copy)]
pub(super) enum Which {
    Always(Kind),
    /// A function of the file and of what the caller asks for.
    Rule(fn(&Source, &ReadOptions) -> Result<Kind>),
}

#[derive(Debug, Clone, Copy)]
pub(super) enum VolumeReader {
    Plain(fn(&Source, &ReadOptions) -> Result<Volume>),
    /// For files that do not describe themselves: the caller gives the layout.
    Described(fn(&Source, &RawLayout, &ReadOptions) -> Result<Volume>),
}

/// How a format is read in pieces. `of` says which of its files are (“binary files”); it is empty
/// if all are.
#[derive(Debug, Clone, Copy)]
pub(super) enum InPieces {
    No,
    /// By [`Stream`](super::Stream).
    Points {
        of: &'static str,
        find: FindPieces,
        /// Whether remote objects are fetched piece by piece, and not as a whole.
        in_parts: bool,
    },
    /// By [`VolumeStream`](super::VolumeStream).
    Volume {
        of: &'static str,
        find: fn(&Source) -> Result<Option<Plain>>,
    },
    /// As `Volume`, for files that do not describe themselves.
    Described {
        of: &'static str,
        find: fn(&Source, &RawLayout) -> Result<Option<Plain>>,
    },
    /// By the type that opens these files.
    Opened,
}

impl Format {
    /// A row to fill in: no files, no readers.
    pub(super) const ROW: Self = Self {
        name: "",
        extensions: &[],
        holds: &[],
        written: None,
        refers: false,
        feature: None,
        magic: Magic::None,
        folder: None,
        kind: Which::Always(Kind::Mesh),
        mesh: None,
        volume: None,
        samples: None,
        cells: None,
        gaussians: None,
        pieces: InPieces::No,
        arrays: None,
        series: None,
    };

    /// Returns the format that the extension of a path names.
    pub fn of_path(path: impl AsRef<Path>) -> Option<&'static Self> {
        by_extension(super::FORMATS, path.as_ref(), |_| true)
    }

    /// Returns which of the files are read in pieces (“binary files”). The text is empty if all
    /// are. Returns `None` if all are read as a whole.
    pub fn in_pieces(&self) -> Option<&'static str> {
        match self.pieces {
            InPieces::No => None,
            InPieces::Opened => Some(""),
            InPieces::Points { of, .. }
            | InPieces::Volume { of, .. }
            | InPieces::Described { of, .. } => Some(of),
        }
    }

    /// Returns whether files of the format may hold several arrays or series, which
    /// [`arrays`](super::arrays) and [`series`](super::series) list.
    pub fn has_choices(&self) -> bool {
        self.arrays.is_some() || self.series.is_some()
    }

    /// Returns whether this build has no reader of the format, because its feature is off.
    pub fn is_left_out(&self) -> bool {
        let is_read = self.mesh.is_some()
            || self.volume.is_some()
            || self.samples.is_some()
            || self.cells.is_some()
            || self.gaussians.is_some();
        self.feature.is_some() && !is_read
    }

    /// Returns whether a path ends with one of the extensions, which may have two parts
    /// (`nii.gz`). A name that is nothing but an extension has none.
    fn is_for(&self, path: &Path) -> bool {
        let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase());
        let ends = |name: &str, extension: &str| {
            name.strip_suffix(extension)
                .and_then(|rest| rest.strip_suffix('.'))
                .is_some_and(|rest| !rest.is_empty())
        };
        name.is_some_and(|name| self.extensions.iter().any(|extension| ends(&name, extension)))
    }
}

impl Content {
    /// Every content, in the order of messages.
    pub const ALL: [Self; 8] = [
        Self::Hierarchy,
        Self::Bricks,
        Self::Mesh,
        Self::PointCloud,
        Self::Gaussians,
        Self::Volume,
        Self::Cells,
        Self::Samples,
    ];

    /// Returns its name for one file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::PointCloud => "point cloud",
            Self::Volume => "volume",
            Self::Samples => "scattered samples",
            Self::Cells => "cells",
            Self::Gaussians => "trained Gaussians",
            Self::Hierarchy => "hierarchy",
            Self::Bricks => "volume in bricks",
        }
    }

    /// Returns its name for several files.
    pub fn plural(self) -> &'static str {
        match self {
            Self::Mesh => "meshes",
            Self::PointCloud => "point clouds",
            Self::Volume => "volumes",
            Self::Samples => "scattered samples",
            Self::Cells => "cells",
            Self::Gaussians => "trained Gaussians",
            Self::Hierarchy => "hierarchies",
            Self::Bricks => "volumes in bricks",
        }
    }

    /// Returns the kind of files that hold it.
    pub fn kind(self) -> Kind {
        match self {
            Self::Mesh | Self::PointCloud => Kind::Mesh,
            Self::Volume => Kind::Volume,
            Self::Samples => Kind::Samples,
            Self::Cells => Kind::Cells,
            Self::Gaussians => Kind::Gaussians,
            Self::Hierarchy => Kind::Hierarchy,
            Self::Bricks => Kind::Bricks,
        }
    }
}

impl fmt::Display for Holding {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(self.content.name())?;
        if self.when.is_empty() { Ok(()) } else { write!(out, " ({})", self.when) }
    }
}

impl Which {
    pub fn of(self, source: &Source, options: &ReadOptions) -> Result<Kind> {
        match self {
            Self::Always(kind) => Ok(kind),
            Self::Rule(decide) => decide(source, options),
        }
    }
}

/// Returns the format that a file's extension names, among those that `may` be read.
pub(super) fn by_extension<'a>(
    table: &'a [Format],
    path: &Path,
    may: impl Fn(&Format) -> bool,
) -> Option<&'a Format> {
    table.iter().find(|format| may(format) && format.is_for(path))
}

/// Returns the format that a file's first bytes show, among those that `may` be read. Prefixes come
/// before rules, because a rule may look for a word that files of other formats contain too.
pub(super) fn by_magic<'a>(
    table: &'a [Format],
    bytes: &[u8],
    may: impl Fn(&Format) -> bool,
) -> Option<&'a Format> {
    let allowed = || table.iter().filter(|format| may(format));
    let has_prefix = |format: &&Format| match format.magic {
        Magic::Prefix(prefix) => bytes.starts_with(prefix),
        _ => false,
    };
    let follows_rule = |format: &&Format| match format.magic {
        Magic::Rule(rule) => rule(bytes),
        _ => false,
    };
    allowed().find(has_prefix).or_else(|| allowed().find(follows_rule))
}

/// Returns the format of a file, among those that `may` be read: by its extension, else by its
/// first bytes.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a format that this build leaves out.
pub(super) fn find<'a>(
    table: &'a [Format],
    source: &Source,
    may: impl Fn(&Format) -> bool,
) -> Result<Option<&'a Format>> {
    stand_in::check(source)?;
    let may = |format: &Format| format.is_left_out() || may(format);
    if source.folder().is_some() {
        return by_folder(table, source, may);
    }
    let format = by_extension(table, source.path, may);
    unless_left_out(format.or_else(|| by_magic(table, source.bytes(), may)), source)
}

/// As [`find`], for a volume. If the extension names none and the caller gives a layout, the file
/// is in the format that needs one.
///
/// # Errors
/// Those of [`find`].
pub(super) fn find_volume<'a>(
    table: &'a [Format],
    source: &Source,
    is_described: bool,
) -> Result<Option<&'a Format>> {
    stand_in::check(source)?;
    let may = |format: &Format| format.is_left_out() || format.volume.is_some();
    if source.folder().is_some() {
        return by_folder(table, source, may);
    }
    let needs_layout = |format: &&Format| matches!(format.volume, Some(VolumeReader::Described(_)));
    let format = by_extension(table, source.path, may)
        .or_else(|| table.iter().find(needs_layout).filter(|_| is_described))
        .or_else(|| by_magic(table, source.bytes(), may));
    unless_left_out(format, source)
}

/// Returns the format that the files of a folder have together, among those that `may` be read.
fn by_folder<'a>(
    table: &'a [Format],
    source: &Source,
    may: impl Fn(&Format) -> bool,
) -> Result<Option<&'a Format>> {
    for format in table.iter().filter(|format| may(format)) {
        if format.folder.map_or(Ok(false), |holds| holds(source))? {
            return unless_left_out(Some(format), source);
        }
    }
    Ok(None)
}

/// Returns the chosen format, unless this build leaves it out.
fn unless_left_out<'a>(choice: Option<&'a Format>, source: &Source) -> Result<Option<&'a Format>> {
    let Some(format) = choice.filter(|format| format.is_left_out()) else { return Ok(choice) };
    let (name, feature) = (format.name, format.feature.unwrap_or_default());
    let message = format!("is a file of {name}, but this program was built without “{feature}”");
    let hint = format!("build it with the feature “{feature}” of the crate splatkit");
    Err(source.error("file", message).hint(hint))
}

/// Returns the extensions of the formats that `may` be read, as a list for messages.
pub(super) fn extensions(table: &[Format], may: impl Fn(&Format) -> bool) -> String {
    let extensions = table.iter().filter(|format| may(format)).flat_map(|format| format.extensions);
    listed(extensions.map(|extension| format!(".{extension}")).collect(), "and")
}

/// Returns “a, b and c”.
pub(super) fn listed(mut words: Vec<String>, and: &str) -> String {
    match (words.pop(), words.join(", ")) {
        (None, _) => String::new(),
        (Some(last), rest) if rest.is_empty() => last,
        (Some(last), rest) => format!("{rest} {and} {last}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Error,
        formats::{
            FORMATS,
            load::{mesh_of, samples_of, volume_of},
        },
        input::Limits,
    };
    use std::collections::HashSet;

    /// The reader of a format that only this test knows: a word, then the coordinates of points.
    fn read_toy(source: &Source, _: &ReadOptions) -> Result<Mesh> {
        let text = source.small_text("a toy", 1 << 10)?;
        let numbers: Vec<f32> = text.split(' ').skip(1).filter_map(|w| w.parse().ok()).collect();
        let positions = numbers.as_chunks().0.iter().map(|&point| point.into()).collect();
        Ok(Mesh { positions, ..Mesh::default() })
    }

    const TOY: Format = Format {
        name: "toy",
        extensions: &["toy"],
        holds: &[Holding { content: Content::PointCloud, when: "" }],
        magic: Magic::Prefix(b"toys"),
        kind: Which::Always(Kind::Mesh),
        mesh: Some(read_toy),
        ..Format::ROW
    };

    fn with<T>(name: &str, bytes: &[u8], read: impl Fn(&Source) -> T) -> T {
        let limits = Limits::default();
        read(&Source::from_bytes(Path::new(name), bytes, &limits).expect("a source"))
    }

    #[test]
    fn a_new_format_is_one_row() {
        let table = [FORMATS, &[TOY]].concat();
        for (name, bytes) in
            [("a.toy", "1 2 3 4 5 6"), ("a.TOY", "toys 2 3 4"), ("a", "toys 2 3 4")]
        {
            let kind = |table: &[Format]| {
                with(name, bytes.as_bytes(), |source| {
                    Kind::find(table, source, &ReadOptions::default())
                })
                .unwrap()
            };
            assert_eq!((kind(&table), kind(FORMATS)), (Some(Kind::Mesh), None), "{name}");
            let mesh = with(name, bytes.as_bytes(), |source| {
                mesh_of(&table, source, &ReadOptions::default())
            })
            .unwrap();
            assert_eq!(mesh.positions[0].to_array(), [2.0, 3.0, 4.0], "{name}");
            assert!(
                with(name, bytes.as_bytes(), |source| mesh_of(
                    FORMATS,
                    source,
                    &ReadOptions::default()
                ))
                .is_err()
            );
        }
        // Messages name it, where it can be read.
        let hint = |error: Error| match error {
            Error::Input { hint: Some(hint), .. } => hint,
            error => panic!("no hint: {error}"),
        };
        let none =
            |source: &Source| hint(mesh_of(&table, source, &ReadOptions::default()).unwrap_err());
        assert!(with("a.none", b"none", none).ends_with(".csv, .txt and .toy"));
        let none = |source: &Source| {
            hint(samples_of(&table, source, &ReadOptions::default()).unwrap_err())
        };
        assert!(with("a.none", b"none", none).ends_with(".csv, .txt and .xyzv"));
    }

    #[test]
    fn what_a_build_leaves_out_is_told() {
        let row = Format { mesh: None, feature: Some("toys"), ..TOY };
        let table = [FORMATS, &[row]].concat();
        assert!(row.is_left_out() && !TOY.is_left_out());
        for (name, bytes) in [("a.toy", "1 2 3"), ("a.dat", "toys")] {
            let check = |error: Error| {
                let message = error.to_string();
                assert!(message.contains("a file of toy, but"), "{message}");
                assert!(message.contains("without “toys”"), "{message}");
            };
            with(name, bytes.as_bytes(), |source| {
                check(mesh_of(&table, source, &ReadOptions::default()).unwrap_err());
                check(volume_of(&table, source, &ReadOptions::default()).unwrap_err());
                check(samples_of(&table, source, &ReadOptions::default()).unwrap_err());
                check(Kind::find(&table, source, &ReadOptions::default()).unwrap_err());
            });
        }
    }

    #[test]
    fn rows_say_what_their_readers_read() {
        let mut names = HashSet::new();
        for format in FORMATS {
            let name = format.name;
            assert!(names.insert(name), "{name}");
            if format.is_left_out() {
                continue;
            }
            for extension in format.extensions {
                assert!(names.insert(extension), "{extension} is the extension of two formats");
                assert_eq!(extension.to_ascii_lowercase(), *extension);
            }
            assert!(
                format.written.is_none_or(|written| format.extensions.contains(&written)),
                "{name}"
            );
            let holds = |kind| format.holds.iter().any(|holding| holding.content.kind() == kind);
            assert_eq!(format.mesh.is_some(), holds(Kind::Mesh), "{name}");
            assert_eq!(format.volume.is_some(), holds(Kind::Volume), "{name}");
            assert_eq!(format.samples.is_some(), holds(Kind::Samples), "{name}");
            assert_eq!(format.cells.is_some(), holds(Kind::Cells), "{name}");
            assert_eq!(format.gaussians.is_some(), holds(Kind::Gaussians), "{name}");
            let is_opened = matches!(format.pieces, InPieces::Opened);
            assert_eq!(is_opened, holds(Kind::Hierarchy) || holds(Kind::Bricks), "{name}");
            match format.kind {
                Which::Always(kind) => assert!(holds(kind), "{name}"),
                Which::Rule(_) => assert!(format.holds.len() > 1, "{name}"),
            }
        }
    }

    #[test]
    fn first_bytes_show_the_format() {
        for (bytes, name) in [
            ("SPLK", "splatkit hierarchy"),
            ("SPLV", "splatkit bricks"),
            ("\n ply\n", "PLY"),
            ("glTF", "glTF"),
            (" {\"asset\": 1}", "glTF"),
            ("NGSP", "SPZ"),
            ("solid of one", "STL"),
            ("LASF", "LAS"),
            ("ASTM-E57", "E57"),
            ("# .PCD v0.7", "PCD"),
            ("# vtk DataFile Version 3.0", "VTK"),
            ("<?xml?><VTKFile type='ImageData'>", "VTI"),
            ("<VTKFile type='RectilinearGrid'>", "VTR"),
            ("<VTKFile type='UnstructuredGrid'>", "VTU"),
            ("<VTKFile type='StructuredGrid'>", "VTS"),
            ("<VTKFile type='vtkMultiBlockDataSet'>", "VTK in several files"),
            ("<VTKFile type='PolyData'>", "VTP"),
            ("NRRD0004", "NRRD"),
            // A comment of a header is no sign of another format.
            ("NRRD0004\n# from <VTKFile type='PolyData'>", "NRRD"),
        ] {
            let format = by_magic(FORMATS, bytes.as_bytes(), |_| true);
            assert_eq!(format.map(|format| format.name), Some(name), "{bytes}");
        }
        let format = by_magic(FORMATS, b"\x93NUMPY\x01\0", |_| true);
        assert_eq!(format.map(|format| format.name), Some("NPY"));
        for bytes in ["", "hello", "solid", "<?xml?><svg>", "RectilinearGrid"] {
            assert!(by_magic(FORMATS, bytes.as_bytes(), |_| true).is_none(), "{bytes}");
        }
        // Beyond the first 1024 bytes, words are no sign.
        let late = [&[b' '; 1020][..], b"<VTKFile type='ImageData'>"].concat();
        assert!(by_magic(FORMATS, &late, |_| true).is_none());
    }

    #[test]
    fn what_no_reader_reads_is_told() {
        let text = |error: Error| error.to_string();
        let message = with("a.vti", b"", |source| {
            text(mesh_of(FORMATS, source, &ReadOptions::default()).unwrap_err())
        });
        assert!(message.contains("“.vti” is not a mesh format that can be read"), "{message}");
        let message = with("a.OBJ", b"", |source| {
            text(samples_of(FORMATS, source, &ReadOptions::default()).unwrap_err())
        });
        assert!(message.contains("“.obj” is not a format of scattered samples"), "{message}");
        let message = with("a.raw", b"", |source| {
            text(volume_of(FORMATS, source, &ReadOptions::default()).unwrap_err())
        });
        assert!(message.contains("VTI, "), "{message}");
        assert!(message.contains(" NRRD, "), "{message}");
    }
}
