//! What a row of the table of formats says, and how the row of a file is found.

use super::{Kind, RawLayout, stream::Form, volume_stream::Plain};
use crate::{Result, input::Source, scattered::Points, surface::Mesh, volume::Volume};
use std::{fmt, path::Path};

/// A file format: a row of [`FORMATS`](super::FORMATS).
#[derive(Debug, Clone, Copy)]
pub struct Format {
    pub name: &'static str,
    /// In lower case, without the dot. Empty if any file may be in this format.
    pub extensions: &'static [&'static str],
    /// What its files hold.
    pub holds: &'static [Holding],
    /// The extension of the files that splatkit writes in this format.
    pub written: Option<&'static str>,
    /// Whether a file may refer to other files with a part of its data.
    pub refers: bool,
    /// The cargo feature that the format belongs to.
    pub feature: &'static str,
    pub(super) magic: Magic,
    pub(super) kind: Which,
    pub(super) mesh: Option<fn(&Source) -> Result<Mesh>>,
    pub(super) volume: Option<VolumeReader>,
    /// The second argument names the values to read if a file has several.
    pub(super) samples: Option<fn(&Source, Option<&str>) -> Result<Points>>,
    pub(super) pieces: InPieces,
}

/// What a file may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    Mesh,
    PointCloud,
    Volume,
    Samples,
    Hierarchy,
    Bricks,
}

/// What files of a format hold, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Holding {
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
    /// A function of the file, and of whether the caller asks for a scalar.
    Rule(fn(&Source, bool) -> Result<Kind>),
}

#[derive(Debug, Clone, Copy)]
pub(super) enum VolumeReader {
    Plain(fn(&Source) -> Result<Volume>),
    /// For files that do not describe themselves: the caller gives the layout.
    Described(fn(&Source, &RawLayout) -> Result<Volume>),
}

/// How a format is read in pieces. `of` says which of its files are (“binary files”); it is empty
/// if all are.
#[derive(Debug, Clone, Copy)]
pub(super) enum InPieces {
    No,
    /// By [`Stream`](super::Stream).
    Points {
        of: &'static str,
        find: fn(&Source) -> Result<Option<Form>>,
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
        feature: "",
        magic: Magic::None,
        kind: Which::Always(Kind::Mesh),
        mesh: None,
        volume: None,
        samples: None,
        pieces: InPieces::No,
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

    fn is_for(&self, path: &Path) -> bool {
        let named = path.extension();
        named.is_some_and(|named| self.extensions.iter().any(|own| named.eq_ignore_ascii_case(own)))
    }
}

impl Content {
    /// Every content, in the order of messages.
    pub const ALL: [Self; 6] =
        [Self::Hierarchy, Self::Bricks, Self::Mesh, Self::PointCloud, Self::Volume, Self::Samples];

    /// Returns its name for one file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::PointCloud => "point cloud",
            Self::Volume => "volume",
            Self::Samples => "scattered samples",
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
    pub fn of(self, source: &Source, with_scalar: bool) -> Result<Kind> {
        match self {
            Self::Always(kind) => Ok(kind),
            Self::Rule(decide) => decide(source, with_scalar),
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
fn by_magic<'a>(
    table: &'a [Format],
    bytes: &[u8],
    may: impl Fn(&Format) -> bool,
) -> Option<&'a Format> {
    let mut allowed = table.iter().filter(|format| may(format));
    let has_prefix = |format: &&Format| matches!(format.magic, Magic::Prefix(prefix) if bytes.starts_with(prefix));
    let follows_rule = |format: &&Format| matches!(format.magic, Magic::Rule(rule) if rule(bytes));
    allowed.clone().find(has_prefix).or_else(|| allowed.find(follows_rule))
}

/// Returns the format of a file, among those that `may` be read: by its extension, else by its
/// first bytes.
pub(super) fn find<'a>(
    table: &'a [Format],
    source: &Source,
    may: impl Fn(&Format) -> bool,
) -> Option<&'a Format> {
    by_extension(table, source.path, &may).or_else(|| by_magic(table, source.bytes(), &may))
}

/// As [`find`], for a volume. If the extension names none and the caller gives a layout, the file
/// is in the format that needs one.
pub(super) fn find_volume<'a>(
    table: &'a [Format],
    source: &Source,
    is_described: bool,
) -> Option<&'a Format> {
    let may = |format: &Format| format.volume.is_some();
    let needs_layout = |format: &&Format| matches!(format.volume, Some(VolumeReader::Described(_)));
    by_extension(table, source.path, may)
        .or_else(|| table.iter().find(needs_layout).filter(|_| is_described))
        .or_else(|| by_magic(table, source.bytes(), may))
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
