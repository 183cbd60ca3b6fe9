//! Looking for damage.

use super::{HASH, Listing};
use crate::{
    Error, Result,
    bricks::{Brick, Bricks, Level, SIDE, pyramid::Pyramid},
    container::{Finding, Findings, Report},
    input::{Bytes, Limits},
    parallel::prelude::*,
    progress::{Watch, tell},
    volume::steps::Steps,
};
use std::path::Path;

/// Checks a file: header, directory, the checksum of every brick, and the hash. If all of these
/// hold, computes all ranges and all coarser levels again from level 0 and compares. One layer of
/// bricks of each level is in memory at a time. `watch` is called with the number of bricks done
/// and the number in all.
///
/// Never returns an error: a file that cannot be opened is a finding.
pub fn check(path: impl AsRef<Path>, limits: &Limits, watch: Watch<'_>) -> Report {
    let mut findings = Findings::default();
    match Bricks::open(path, limits) {
        Ok(bricks) => return bricks.check(watch),
        Err(error) => findings.push(finding("open", &error)),
    }
    Report { findings: findings.finish() }
}

impl Bricks {
    /// Like [`check`](check()), for a file that is already open, or for its bytes. A volume in
    /// memory has nothing to check.
    pub fn check(&self, watch: Watch<'_>) -> Report {
        let mut findings = Findings::default();
        if let Some(bytes) = self.bytes()
            && sums(self, bytes, watch, &mut findings)
            && let Err(error) = contents(self, watch, &mut findings)
        {
            findings.push(finding("brick", &error));
        }
        Report { findings: findings.finish() }
    }
}

fn count(bricks: &Bricks) -> u64 {
    bricks.levels().iter().map(|level| level.bricks() as u64).sum()
}

/// Returns whether every brick can be read and the hash matches.
fn sums(bricks: &Bricks, bytes: &Bytes, watch: Watch<'_>, findings: &mut Findings) -> bool {
    let start = bytes.len() - HASH as u64;
    let mut is_sound = false;
    match bytes.is_hashed(start) {
        Ok(true) => is_sound = true,
        Ok(false) => {
            let message = "the hash of the whole file does not match";
            findings.push(Finding::error("hash", format!("byte {start}"), message));
        }
        Err(error) => findings.push(finding("hash", &error)),
    }
    let mut wrong = |fault| findings.push(finding("directory", &bricks.fault(fault)));
    let mut faults = Vec::new();
    bricks.directory().check(Some(bytes), &mut |fault| faults.push(fault));
    is_sound &= faults.is_empty();
    faults.into_iter().for_each(&mut wrong);
    let Listing { start, end, .. } = *bricks.directory().kind();
    if is_sound && !bricks.directory().fills(bytes, start..end) {
        is_sound = false;
        let message = "bricks overlap, or leave gaps between them";
        findings.push(Finding::error("directory", "file", message));
    }
    let mut done = 0;
    for (number, level) in bricks.levels().iter().enumerate() {
        let layer = level.brick_dims[0] * level.brick_dims[1];
        for first in (0..level.bricks()).step_by(layer) {
            let layer = first as u32..(first + layer) as u32;
            if let Err(error) = bricks.fetch(layer.clone().map(|brick| (number, brick))) {
                findings.push(finding("brick", &error));
                return false;
            }
            let read = layer.clone().into_par_iter().filter_map(|b| bricks.read(number, b).err());
            let errors: Vec<Error> = read.collect();
            is_sound &= errors.is_empty();
            errors.iter().for_each(|error| findings.push(finding("brick", error)));
            done += layer.len() as u64;
            tell(watch, done, 2 * count(bricks));
        }
    }
    is_sound
}

/// Checks that the file is what its level 0 would be converted to.
fn contents(bricks: &Bricks, watch: Watch<'_>, findings: &mut Findings) -> Result<()> {
    let header = bricks.header();
    let steps = Steps::new(header.scalar, header.range);
    let mut pyramid = Pyramid::new(header.scalar, header.lattice.dims);
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    let mut done = count(bricks);
    let finest = *bricks.level(0);
    // The layer, those of the coarser levels, and the rest of the layer before.
    bricks.check_memory("the size of a layer of bricks in bytes", 3 * SIDE, finest, 2)?;
    for layer in 0..finest.brick_dims[2] {
        let slices = slices(bricks, &finest, layer)?;
        let values =
            slices.chunks_exact(header.scalar.bytes()).map(|sample| header.scalar.value(sample));
        range = values.fold(range, |[low, high], value| [low.min(value), high.max(value)]);
        pyramid.push(&slices, |number, layer, slices| {
            let [nx, ny, _] = slices.level.brick_dims;
            let odd = |at: usize| {
                let brick = (layer * nx * ny + at) as u32;
                let wanted = slices.brick([at % nx, at / nx, layer], &steps);
                let finding = |what| {
                    Finding::error(what, format!("level {number}, brick {brick}"), meaning(what))
                };
                bricks.read(number, brick).map(|stored| difference(&stored, &wanted).map(finding))
            };
            let odd: Vec<Option<Finding>> =
                (0..nx * ny).into_par_iter().map(odd).collect::<Result<_>>()?;
            odd.into_iter().flatten().for_each(|finding| findings.push(finding));
            done += (nx * ny) as u64;
            tell(watch, done, 2 * count(bricks));
            Ok(())
        })?;
    }
    if range != header.range {
        let message =
            format!("the header says values are in {:?}, but they are in {range:?}", header.range);
        findings.push(Finding::error("range", "header", message));
    }
    Ok(())
}

fn difference(stored: &Brick, wanted: &Brick) -> Option<&'static str> {
    if stored.samples != wanted.samples {
        return Some("samples");
    }
    (stored.blocks != wanted.blocks).then_some("blocks")
}

fn meaning(code: &str) -> &'static str {
    match code {
        "samples" => {
            "its samples are not the means of those below, or not continued behind the border"
        }
        _ => "the ranges of its blocks are not those of the samples around them",
    }
}

/// Returns the slices of a layer of bricks of level 0.
fn slices(bricks: &Bricks, level: &Level, layer: usize) -> Result<Vec<u8>> {
    let size = bricks.header().scalar.bytes();
    let ([nx, ny, nz], [across, down, _]) = (level.dims, level.brick_dims);
    let mut out = vec![0; nx * ny * SIDE.min(nz - layer * SIDE) * size];
    for j in 0..down {
        let row = (0..across).map(|i| (0, ((layer * down + j) * across + i) as u32));
        let row: Vec<Brick> = bricks.read_all(&row.collect::<Vec<_>>())?;
        out.par_chunks_mut(nx * ny * size).enumerate().for_each(|(z, slice)| {
            let lines = slice.chunks_mut(nx * size).skip(j * SIDE).take(SIDE);
            for (y, line) in lines.enumerate() {
                for (part, brick) in line.chunks_mut(SIDE * size).zip(&row) {
                    let start = (z * SIDE + y) * SIDE * size;
                    part.copy_from_slice(&brick.samples[start..start + part.len()]);
                }
            }
        });
    }
    Ok(out)
}

fn finding(code: &'static str, error: &Error) -> Finding {
    match error {
        Error::Input { place, message, .. } => Finding::error(code, place.clone(), message.clone()),
        other => Finding::error(code, "file", other.to_string()),
    }
}
