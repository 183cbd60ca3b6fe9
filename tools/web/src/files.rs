//! The files of a scene: whole, and in parts that come while the scene is shown.

use splatkit::{
    Result,
    input::Parts,
    session::{Description, Loaded},
};
use std::{
    collections::BTreeMap,
    ops::Range,
    path::{Path, PathBuf},
    rc::Rc,
};

/// Most bytes of a file in parts that are held in memory.
pub const MOST: u64 = 256 << 20;

/// Bytes of a file in parts, and of what is made of files for drawing, for each GiB of a small
/// machine.
const PARTS_OF_GIB: f64 = (64 << 20) as f64;
const PAGES_OF_GIB: f64 = (160 << 20) as f64;

/// The files of a scene, by the names that the scene file gives them. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct Files {
    whole: Rc<BTreeMap<PathBuf, Vec<u8>>>,
    in_parts: Vec<(PathBuf, Parts)>,
    /// The GiB of the machine, if it has told.
    machine: Option<f64>,
}

/// A range of bytes of a file in parts, which has this number.
pub type Request = (usize, Range<u64>);

impl Files {
    /// Says how many GiB of memory the machine has.
    pub fn set_machine(&mut self, gibibytes: f64) {
        self.machine = Some(gibibytes).filter(|size| *size > 0.0);
    }

    /// Returns the most bytes of a file in parts that are held.
    pub fn most_of_parts(&self) -> u64 {
        self.machine.map_or(MOST, |size| MOST.min((size * PARTS_OF_GIB) as u64))
    }

    /// Returns the most bytes of the pages and bricks for drawing, if `usual` are usual.
    pub fn most_of_pages(&self, usual: u64) -> u64 {
        self.machine.map_or(usual, |size| usual.min((size * PAGES_OF_GIB) as u64))
    }

    /// Adds a file as a whole.
    pub fn add(&mut self, name: impl Into<PathBuf>, bytes: Vec<u8>) {
        Rc::make_mut(&mut self.whole).insert(name.into(), bytes);
    }

    /// Adds a file in parts. Returns its number.
    pub fn add_parts(&mut self, name: impl Into<PathBuf>, parts: Parts) -> usize {
        self.in_parts.push((name.into(), parts));
        self.in_parts.len() - 1
    }

    /// Returns the files that are there as wholes, by their names.
    pub fn whole(&self) -> impl Iterator<Item = (&Path, &[u8])> {
        self.whole.iter().map(|(name, bytes)| (name.as_path(), bytes.as_slice()))
    }

    /// Reads the inputs of a scene.
    ///
    /// # Errors
    /// Those of [`Description::load_in_parts`].
    pub fn load(&self, description: &Description) -> Result<Loaded> {
        description.load_in_parts(&self.whole, &self.in_parts.iter().cloned().collect(), &|_| {})
    }

    /// Hands in bytes of a file in parts.
    ///
    /// # Errors
    /// Those of [`Parts::arrive`].
    pub fn arrive(&self, file: usize, start: u64, bytes: &[u8]) -> Result<()> {
        self.in_parts.get(file).map_or(Ok(()), |(_, parts)| parts.arrive(start, bytes))
    }

    /// Returns whether a range is there.
    pub fn have(&self, (file, range): &Request) -> bool {
        self.in_parts.get(*file).is_some_and(|(_, parts)| parts.has(range))
    }

    /// A picture begins. These ranges are needed before what it misses.
    pub fn begin(&self, first: &[Request]) {
        self.parts().for_each(Parts::begin);
        for (file, range) in first {
            self.in_parts.get(*file).into_iter().for_each(|(_, parts)| parts.want(range));
        }
    }

    /// The view has changed.
    pub fn renew(&self) {
        self.parts().for_each(Parts::renew);
    }

    /// Returns whether bytes were missed since the picture began.
    pub fn lack(&self) -> bool {
        self.parts().any(Parts::lacks)
    }

    /// Returns whether the view needs more bytes than may be held.
    pub fn are_full(&self) -> bool {
        self.parts().any(Parts::is_full)
    }

    /// Returns what to fetch, the most important of each file first.
    pub fn requests(&self) -> Vec<Request> {
        let of_file = |(file, parts): (usize, &Parts)| {
            parts.requests().into_iter().map(|range| (file, range)).collect::<Vec<_>>()
        };
        self.parts().enumerate().flat_map(of_file).collect()
    }

    fn parts(&self) -> impl Iterator<Item = &Parts> {
        self.in_parts.iter().map(|(_, parts)| parts)
    }
}
