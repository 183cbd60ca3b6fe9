//! Files that are not read: which kind they are, and what to do with them.
//!
//! [`advice`] looks at the first bytes of a file, its name and its size. It is asked only after no
//! format of the table was found, or if the format's reader does not read this kind of content.

mod layout;

use crate::input::{Source, copy};
use flate2::read::MultiGzDecoder;
use std::{io::Read, path::Path, sync::LazyLock};

/// What is known of a file that is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advice {
    /// What the file is, after “is” (“a Blender scene”).
    pub what: String,
    /// What the user can do.
    pub hint: String,
}

/// How a kind of file is recognised, and what to do with it: a line of foreign/rows.txt.
struct Foreign {
    /// Extensions in lower case.
    extensions: Vec<&'static str>,
    /// The first bytes; none if the extension alone decides.
    magic: Vec<Vec<u8>>,
    what: &'static str,
    /// The packages of Python that read such files, as `python -m pysplatkit` uses them. Its module
    /// `_foreign` has the same files.
    python: Vec<&'static str>,
    /// What to do; if packages of Python read the file, what else.
    hint: &'static str,
}

/// Bytes of a file that are looked at.
const LOOKED_AT: usize = 1 << 12;

/// The kinds of files that are known.
static FOREIGN: LazyLock<Vec<Foreign>> = LazyLock::new(|| {
    let lines = include_str!("foreign/rows.txt").lines();
    lines.filter(|line| !line.starts_with('#')).map(Foreign::of).collect()
});

impl Foreign {
    /// Reads a line of the table.
    fn of(line: &'static str) -> Self {
        let mut parts = line.splitn(5, '|').map(str::trim);
        let mut next = || parts.next().unwrap_or_default();
        let (extensions, magic, what, python, hint) = (next(), next(), next(), next(), next());
        let magic = magic.split(", ").filter(|bytes| !bytes.is_empty()).map(unescaped).collect();
        let words = |text: &'static str| text.split_whitespace().collect();
        Self { extensions: words(extensions), magic, what, python: words(python), hint }
    }
}

/// Returns the bytes of a text, in which `\xNN` is a byte.
fn unescaped(text: &str) -> Vec<u8> {
    let mut parts = text.split("\\x");
    let mut bytes = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let (byte, rest) = part.split_at_checked(2).unwrap_or((part, ""));
        bytes.extend(u8::from_str_radix(byte, 16));
        bytes.extend(rest.as_bytes());
    }
    bytes
}

/// Says which kind a file is, and what to do; `None` for files of which nothing is known.
pub fn advice(source: &Source) -> Option<Advice> {
    if let Some(advice) = layout::advice(source) {
        return Some(advice);
    }
    let bytes = &source.bytes()[..source.bytes().len().min(LOOKED_AT)];
    // The name first: scenes and tables of some programs are archives.
    let foreign = by_extension(source.path).or_else(|| by_magic(bytes));
    let advice = foreign.map(|foreign| Advice::of(foreign, source.path));
    advice.or_else(|| gzip(source)).or_else(|| layout::raw(source))
}

/// Returns the error for a mesh of a solver, by the name of the file; `None` for other names. Its
/// content may be in a format that is read, as HDF5 is.
#[cfg(feature = "hdf5")]
pub(super) fn mesh_by_name(source: &Source) -> Option<crate::Error> {
    let mesh = by_extension(source.path).filter(|foreign| foreign.python.contains(&"meshio"))?;
    let advice = Advice::of(mesh, source.path);
    let message = format!("is {}, which is not read", advice.what);
    Some(source.error("file", message).hint(advice.hint))
}

impl Advice {
    fn of(foreign: &Foreign, path: &Path) -> Self {
        let is_drawn = foreign.hint.is_empty() || !foreign.python.is_empty();
        if !is_drawn {
            return Self { what: foreign.what.into(), hint: foreign.hint.into() };
        }
        // What needs no other package is read by the module itself.
        let packages: Vec<&str> = ["pysplatkit"].iter().chain(&foreign.python).copied().collect();
        let mut hint = format!(
            "python -m pysplatkit render {} -o out.png draws it (pip install {})",
            path.display(),
            packages.join(" ")
        );
        if !foreign.hint.is_empty() {
            hint = format!("{hint}; {}", foreign.hint);
        }
        Self { what: foreign.what.into(), hint }
    }
}

fn by_magic(bytes: &[u8]) -> Option<&'static Foreign> {
    let begins = |foreign: &&Foreign| foreign.magic.iter().any(|magic| bytes.starts_with(magic));
    // Two letters are too few: a bitmap also has zeros where they are reserved.
    let is_bitmap = || bytes.get(6..10) == Some(&[0; 4]);
    FOREIGN.iter().find(begins).filter(|_| !bytes.starts_with(b"BM") || is_bitmap())
}

fn by_extension(path: &Path) -> Option<&'static Foreign> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    FOREIGN.iter().find(|foreign| foreign.extensions.contains(&extension.as_str()))
}

/// Says what is inside a gzip stream.
fn gzip(source: &Source) -> Option<Advice> {
    let bytes = source.bytes();
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return None;
    }
    let mut head = Vec::new();
    let mut stream = MultiGzDecoder::new(bytes).take(LOOKED_AT as u64);
    // A stream that is cut off shows its beginning.
    stream.read_to_end(&mut head).ok();
    let name = source.path.file_stem().unwrap_or_default();
    let inside = Path::new(name);
    let known = super::Format::of_path(inside).map(|format| format.name);
    let foreign = by_extension(inside).or_else(|| by_magic(&head)).map(|row| row.what);
    let unpacked = inside.display();
    let what = match known.or(foreign) {
        Some(inner) => format!("packed by gzip, with a file of {inner} inside"),
        None => "packed by gzip".into(),
    };
    let hint = format!(
        "unpack it with gunzip -k {}, and name {unpacked}; raw samples may stay packed, with \
         --dims and --type",
        source.path.display()
    );
    Some(Advice { what, hint })
}

/// Returns the first bytes of a file as text.
fn head(source: &Source) -> String {
    let bytes = source.bytes();
    copy::lossy(&bytes[..bytes.len().min(LOOKED_AT)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use std::collections::HashSet;

    pub fn asked(name: &str, bytes: &[u8]) -> Option<Advice> {
        let limits = Limits::default();
        advice(&Source::from_bytes(Path::new(name), bytes, &limits).unwrap())
    }

    #[test]
    fn every_row_is_found_by_its_name_and_its_bytes() {
        let mut names = HashSet::new();
        assert_eq!(FOREIGN.len(), 53);
        for foreign in FOREIGN.iter() {
            assert!(!foreign.hint.ends_with('.'), "{}", foreign.what);
            for extension in &foreign.extensions {
                assert!(names.insert(extension), "{extension} stands in two rows");
                let advice = asked(&format!("a.{extension}"), b"?");
                let advice = advice.unwrap();
                assert_eq!(advice.what, foreign.what, "{extension}");
                assert!(!advice.hint.is_empty(), "{extension}");
            }
            for magic in &foreign.magic {
                let bytes = [magic, &[0u8; 32][..]].concat();
                let what = asked("a.unknown", &bytes).map(|advice| advice.what);
                assert_eq!(what.as_deref(), Some(foreign.what), "{magic:?}");
            }
        }
        assert_eq!(asked("a.unknown", b"BM is no bitmap"), None);
        assert_eq!(asked("a.unknown", b""), None);
    }

    #[test]
    fn what_python_reads_is_drawn_by_one_line() {
        let hint = |name: &str| asked(name, b"?").unwrap().hint;
        let line = "python -m pysplatkit render a.e -o out.png draws it (pip install pysplatkit \
                    pyvista meshio)";
        assert_eq!(hint("a.e"), line);
        assert!(hint("lh.pial").ends_with("(pip install pysplatkit nibabel)"));
        assert!(hint("a.mz3").ends_with("(pip install pysplatkit)"));
        assert!(hint("a.mgz").contains("; or convert it with mri_convert IN.mgz"));
        assert!(!hint("a.vdb").contains("python -m"));
    }

    #[test]
    fn no_row_is_of_a_format_that_is_read() {
        for foreign in FOREIGN.iter() {
            for extension in &foreign.extensions {
                let format = super::super::Format::of_path(format!("a.{extension}"));
                assert!(format.is_none(), "{extension}");
            }
        }
    }

    #[test]
    fn gzip_says_what_is_inside() {
        use flate2::{Compression, write::GzEncoder};
        use std::io::Write;
        let packed = |bytes: &[u8]| {
            let mut packer = GzEncoder::new(Vec::new(), Compression::default());
            packer.write_all(bytes).unwrap();
            packer.finish().unwrap()
        };
        for (name, bytes, what) in [
            ("a.ply.gz", &b"ply\n"[..], "packed by gzip, with a file of PLY inside"),
            ("a.gz", b"GRIB", "packed by gzip, with a file of a GRIB file of weather data inside"),
            ("a.gz", b"?", "packed by gzip"),
        ] {
            let advice = asked(name, &packed(bytes)).unwrap();
            assert_eq!(advice.what, what);
            assert!(advice.hint.contains("gunzip -k a."), "{}", advice.hint);
        }
    }
}
