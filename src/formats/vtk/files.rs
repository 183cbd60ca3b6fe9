//! The data sets of a file: its own, or those of the files that it refers to. Parallel files
//! (`.pvtu`, …) join pieces to one data set, collections (`.vtm`, `.pvd`, …) list several.

use super::{
    super::{ReadOptions, shared::several},
    data::Block,
    legacy, pieces,
    xml::{Attributes, Document, number},
};
use crate::{Result, input::Source};

/// Maximum number of files that a file may refer to, with those that they refer to.
const MOST_FILES: usize = 1 << 16;

/// Maximum depth of references. A collection may list collections, whose members may be parallel.
const MOST_DEPTH: usize = 4;

/// A data set, or a piece of one.
pub struct DataSet<'a> {
    pub source: &'a Source<'a>,
    pub blocks: Vec<Block<'a>>,
    /// The number of the whole data set. Files that a parallel file joins have the same.
    pub whole: usize,
    /// Whether a parallel file joins it to others.
    pub is_piece: bool,
    /// The number of times of the collection that it belongs to; 0 if there is none with times.
    pub times: u64,
}

/// A function that receives each data set. It returns whether to go on.
type Visitor<'l> = dyn FnMut(&DataSet<'_>) -> Result<bool> + 'l;

/// Passes the data sets of a file to `visitor`, until it returns false. Files that are referred to
/// are open only meanwhile.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file in another format, one that is cut off, and
/// references that lead out of the folder; those of `visitor`.
pub fn visit(source: &Source, options: &ReadOptions, visitor: &mut Visitor<'_>) -> Result<()> {
    let mut walk = Walk { options, visitor, wholes: 0, files: 0, times: 0 };
    walk.file(source, 0, None).map(drop)
}

struct Walk<'l, 'f> {
    options: &'l ReadOptions,
    visitor: &'l mut Visitor<'f>,
    /// Number of whole data sets so far.
    wholes: usize,
    /// Number of files so far.
    files: usize,
    /// The most times of a collection so far.
    times: u64,
}

impl Walk<'_, '_> {
    /// Shows the data sets of a file, which may be a piece of a whole. Returns whether to go on.
    fn file(&mut self, source: &Source, depth: usize, whole: Option<usize>) -> Result<bool> {
        let is_named = source.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vtk"));
        let is_xml = source.bytes().trim_ascii_start().starts_with(b"<");
        if legacy::is_legacy(source.bytes()) || (is_named && !is_xml) {
            return self.show(source, vec![legacy::block(source)?], whole);
        }
        let document = Document::read(source)?;
        let is_collection = match document.kind.as_str() {
            "vtkMultiBlockDataSet"
            | "vtkPartitionedDataSetCollection"
            | "vtkPartitionedDataSet" => true,
            "Collection" => true,
            "PImageData" | "PRectilinearGrid" | "PStructuredGrid" | "PUnstructuredGrid"
            | "PPolyData" => false,
            _ => return self.show(source, pieces::blocks(&document)?, whole),
        };
        if depth >= MOST_DEPTH {
            let message = format!("is referred to over more than {MOST_DEPTH} files");
            return Err(source.error("file", message));
        }
        let (references, whole) = if is_collection {
            let name = |mut attributes: Attributes| attributes.remove("file");
            (self.of_time(source, &document)?.into_iter().filter_map(name).collect(), None)
        } else {
            let name = |piece: &super::xml::Piece| piece.attributes.get("Source").cloned();
            let names: Option<Vec<String>> = document.pieces.iter().map(name).collect();
            let names = names.ok_or_else(|| source.error("Piece", "has no Source"))?;
            (names, Some(self.next(whole)))
        };
        let references: Vec<String> = references;
        if references.is_empty() {
            return Err(source.error("XML", "refers to no files with data"));
        }
        for reference in references {
            if !self.reference(source, &reference, depth, whole)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn reference(
        &mut self,
        source: &Source,
        reference: &str,
        depth: usize,
        whole: Option<usize>,
    ) -> Result<bool> {
        self.files += 1;
        source.check_time()?;
        if self.files > MOST_FILES {
            let message = format!("refers to more than {MOST_FILES} files");
            return Err(source.error("file", message));
        }
        let path = source.neighbour("reference", reference)?;
        let file = source.open_beside(&path)?;
        let result = self.file(&file, depth + 1, whole);
        file.unless_changed(result)
    }

    fn show(&mut self, source: &Source, blocks: Vec<Block>, whole: Option<usize>) -> Result<bool> {
        let is_piece = whole.is_some();
        let whole = self.next(whole);
        (self.visitor)(&DataSet { source, blocks, whole, is_piece, times: self.times })
    }

    /// Returns the number of a data set: that of the whole it is a piece of, or the next one.
    fn next(&mut self, whole: Option<usize>) -> usize {
        whole.unwrap_or_else(|| {
            self.wholes += 1;
            self.wholes - 1
        })
    }

    /// Returns the references of a collection; if they have times, those of one of the times.
    fn of_time(&mut self, source: &Source, document: &Document) -> Result<Vec<Attributes>> {
        let time = |reference: &Attributes| -> Result<Option<f64>> {
            let text = reference.get("timestep").filter(|text| !text.trim().is_empty());
            text.map(|text| number(source, "timestep", text)).transpose()
        };
        let times: Vec<Option<f64>> =
            document.references.iter().map(time).collect::<Result<_>>()?;
        let mut all: Vec<f64> = times.iter().copied().flatten().collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        if all.is_empty() {
            return Ok(document.references.clone());
        }
        let count = all.len() as u64;
        self.times = self.times.max(count);
        // A file is visited more than once. Its survey says that there are several times.
        let first = ReadOptions { time: self.options.time.or(Some(0)), ..ReadOptions::default() };
        let at = all[several::time(source, "Collection", count, &first)?];
        let is_wanted = |time: &Option<f64>| time.is_none_or(|time| time == at);
        let pairs = document.references.iter().zip(&times);
        Ok(pairs
            .filter(|(_, time)| is_wanted(time))
            .map(|(reference, _)| reference.clone())
            .collect())
    }
}
