//! Inputs as a plan keeps them: their paths, fingerprints and tables.

use super::{
    ExternalOptions,
    field::{check, within},
    guide::Side,
    regions::{CELLS, Ranges, Reach},
    survey::{Facts, PieceBox, Surveyed, Tables},
};
use crate::{
    Error, Result,
    container::{Cursor, Put, pack},
    formats::Counts,
    input::{Limits, fingerprint, is_remote},
    memory,
};
use bytemuck::Pod;
use serde::{Deserialize, Serialize};
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    ops::Range,
    path::{Path, PathBuf},
};

/// How hard tables are packed.
const LEVEL: i32 = 3;

/// An input of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedInput {
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// See [`fingerprint`].
    fingerprint: String,
    facts: Facts,
    regions: Ranges,
    tables: Place,
}

/// Where the tables of an input are among those of all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Place {
    at: u64,
    bytes: u64,
    /// Their size once unpacked.
    unpacked: u64,
    hash: String,
}

impl PlannedInput {
    /// Describes an input, and appends its tables to those of others.
    pub fn new(
        path: &Path,
        input: &Surveyed,
        limits: &Limits,
        all_tables: &mut Vec<u8>,
    ) -> Result<Self> {
        let absolute = match is_remote(path) {
            true => path.to_owned(),
            false => std::path::absolute(path).map_err(|e| Error::file(path, "find", e))?,
        };
        let (bytes, fingerprint) = fingerprint(path, limits)?;
        // What has changed since it was surveyed must not get a fingerprint.
        input.stream.intact()?;
        let unpacked = input.tables().to_bytes();
        let tables = pack::compress(&unpacked, LEVEL)
            .map_err(|e| Error::file(path, "pack the tables of", e))?;
        let place = Place {
            at: all_tables.len() as u64,
            bytes: tables.len() as u64,
            unpacked: unpacked.len() as u64,
            hash: blake3::hash(&tables).to_hex().to_string(),
        };
        all_tables.extend(tables);
        Ok(Self {
            path: absolute,
            bytes,
            fingerprint,
            facts: input.facts.clone(),
            regions: input.regions.ranges().clone(),
            tables: place,
        })
    }

    /// Checks its numbers.
    pub fn check(&self) -> std::result::Result<(), String> {
        within("facts", self.facts.check())?;
        let settled = &self.facts.settled;
        within("regions", self.regions.check(settled.points, settled.bounds))?;
        let Place { at, bytes, .. } = &self.tables;
        let end = at.checked_add(*bytes).filter(|end| i64::try_from(*end).is_ok());
        check(end.is_some(), "tables.bytes", bytes, "it ends nowhere")
    }

    /// Returns its points, its regions that own some, and whether it is a solid mesh.
    pub fn outline(&self) -> (u64, usize, Option<bool>) {
        let mesh = self.facts.mesh.as_ref();
        (self.facts.settled.points, self.regions.starts.len(), mesh.map(|mesh| mesh.is_solid))
    }

    /// Returns the points of some regions, which exist, or are the one that owns none.
    pub fn points_of(&self, regions: Range<u32>) -> u64 {
        let points = &self.regions.points;
        regions.map(|region| points.get(region as usize).copied().unwrap_or(0)).sum()
    }

    /// Opens the input, with its tables out of the file that holds all.
    ///
    /// # Errors
    /// Those of opening it; [`Error::Input`] if the input or the tables are not those of the plan.
    pub fn open<'a>(
        &'a self,
        tables: &Path,
        options: &ExternalOptions,
        limits: &'a Limits,
    ) -> Result<Surveyed<'a>> {
        let changed = |message: String| {
            Error::input(&self.path, "file", message)
                .hint("make the plan again, with --overwrite, and its parts")
        };
        let (bytes, fingerprint) = fingerprint(&self.path, limits)?;
        if bytes != self.bytes {
            let planned = self.bytes;
            return Err(changed(format!(
                "has {bytes} bytes, but had {planned} when the plan was made"
            )));
        }
        if fingerprint != self.fingerprint {
            return Err(changed("has changed since the plan was made".into()));
        }
        let stream = options.open(&self.path, limits)?;
        let stream = stream.ok_or_else(|| changed("can no longer be read in pieces".into()))?;
        let (points, counts) = (self.facts.settled.points, stream.counts());
        if points > counts.points || self.facts.mesh.is_some() != (counts.triangles > 0) {
            return Err(changed(format!(
                "has not the {points} points of the plan, or no such mesh"
            )));
        }
        let loaded = self.read_tables(tables, counts)?;
        let surveyed = Surveyed::resume(stream, self.facts.clone(), self.regions.clone(), loaded);
        surveyed.map_err(|message| {
            let message = format!("those of {}: {message}", self.path.display());
            Error::input(tables, "tables", message).hint("make the plan again, with --overwrite")
        })
    }

    /// Reads the tables of an input with these counts.
    fn read_tables(&self, path: &Path, counts: Counts) -> Result<Tables> {
        let read = || -> io::Result<Vec<u8>> {
            let mut file = File::open(path)?;
            file.seek(SeekFrom::Start(self.tables.at))?;
            let mut bytes = Vec::new();
            file.take(self.tables.bytes).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let packed = read().map_err(|e| Error::file(path, "read", e))?;
        let damaged = || {
            Error::input(path, "tables", "are not those of the plan, or damaged")
                .hint("make the plan again, with --overwrite; finished parts are kept")
        };
        let unpacked = self.tables.unpacked;
        if unpacked > Tables::most_bytes(counts) {
            return Err(damaged());
        }
        if blake3::hash(&packed).to_hex().as_str() != self.tables.hash {
            return Err(damaged());
        }
        memory::room("the tables of a plan", unpacked)?;
        let bytes = pack::decompress(&packed, unpacked as usize);
        bytes.ok().and_then(|bytes| Tables::from_bytes(&bytes)).ok_or_else(damaged)
    }
}

impl Tables {
    /// Returns the most bytes of the tables of an input with these counts.
    fn most_bytes(Counts { points, triangles }: Counts) -> u64 {
        // Beside the cells of a grid, there is at most one cell, box and side a point.
        let of_point = (size_of::<Reach>() + size_of::<PieceBox>() + size_of::<Side>()) as u64;
        let grid = size_of::<Reach>() as u64 * (CELLS + 1);
        let long = 3 * size_of::<[u32; 3]>() as u64;
        [points.saturating_mul(of_point), triangles.saturating_mul(long)]
            .into_iter()
            .fold(grid + 1024, u64::saturating_add)
    }

    fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        put(&mut out, &self.reaches);
        put(&mut out, &self.pieces);
        put(&mut out, &self.guide);
        put(&mut out, &self.long);
        out
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut bytes = Cursor::new(bytes);
        let tables = Self {
            reaches: take(&mut bytes)?,
            pieces: take(&mut bytes)?,
            guide: take(&mut bytes)?,
            long: take(&mut bytes)?,
        };
        (bytes.remaining() == 0).then_some(tables)
    }
}

fn put<T: Pod>(out: &mut Vec<u8>, items: &[T]) {
    out.u64(items.len() as u64);
    out.put(bytemuck::cast_slice(items));
}

fn take<T: Pod>(bytes: &mut Cursor) -> Option<Vec<T>> {
    let count = usize::try_from(bytes.u64()?).ok()?;
    let bytes = bytes.take(count.checked_mul(size_of::<T>())?)?;
    Some(bytemuck::pod_collect_to_vec(bytes))
}
