//! What a file or a collection holds: the kinds of its cells, and its arrays.

use super::{
    super::{
        Array, Place, ReadOptions,
        shared::{
            choice::{self, Candidate, Chosen, Part},
            holes::is_hole,
            several,
        },
    },
    data::{Block, Kind, ListKind, Numbers},
    files::visit,
};
use crate::{Result, input::Source, warning};
use std::collections::BTreeSet;

/// Counts of what there is to draw, and the arrays that all data sets together have.
#[derive(Debug, Default)]
pub struct Survey {
    /// The numbers of the data sets that are lattices.
    pub lattices: BTreeSet<usize>,
    /// Cells that fill space.
    pub solids: u64,
    /// Cells that are surfaces.
    pub faces: u64,
    pub lines: u64,
    pub points: u64,
    /// Cells of unknown types.
    pub unknown: u64,
    /// The arrays of all data sets.
    candidates: Vec<Candidate>,
    /// Those of lattices, and of lattices and cells that fill space.
    of_lattices: Vec<Candidate>,
    of_solids: Vec<Candidate>,
    /// The number of times of a collection; 0 if there is none with times.
    times: u64,
}

/// What is drawn of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawn {
    Volume,
    /// Cells with a field inside.
    Cells,
    /// Cells without values; as a mesh, their boundary.
    Boundary,
    /// Faces and lines.
    Surface,
    Cloud,
    Samples,
}

/// The array that is drawn.
#[derive(Debug, Clone)]
pub struct Wanted {
    pub array: Candidate,
    pub part: Part,
    /// Whether its values are colours.
    pub is_color: bool,
}

impl Survey {
    pub fn of(source: &Source, options: &ReadOptions) -> Result<Self> {
        let mut survey = Self::default();
        visit(source, options, &mut |set| {
            for block in &set.blocks {
                survey.add(set.source, block, set.whole)?;
            }
            survey.times = survey.times.max(set.times);
            Ok(true)
        })?;
        Ok(survey)
    }

    fn add(&mut self, source: &Source, block: &Block, whole: usize) -> Result<()> {
        self.points = self.points.saturating_add(block.point_count as u64);
        let solids = self.solids;
        match block.kind {
            Kind::Image | Kind::Rectilinear => drop(self.lattices.insert(whole)),
            Kind::Structured => {
                let axes = block.extent.iter().filter(|[first, last]| last > first).count();
                self.count(axes as u8, block.cell_count as u64);
            }
            Kind::Unstructured | Kind::Poly => {
                for list in &block.lists {
                    match &list.cells {
                        ListKind::Of(kind) => self.count_type(*kind, list.count as u64),
                        ListKind::Types { types, .. } => {
                            let part = types.part()?;
                            let types = part.doubles(source)?;
                            types.iter().for_each(|&kind| self.count_type(kind as u8, 1));
                        }
                    }
                }
            }
        }
        let is_solid = self.solids > solids;
        for field in &block.fields {
            let lists = [
                (true, &mut self.candidates),
                (block.is_lattice(), &mut self.of_lattices),
                (block.is_lattice() || is_solid, &mut self.of_solids),
            ];
            for (_, list) in lists.into_iter().filter(|(is_of_it, _)| *is_of_it) {
                add_candidate(source, list, &field.about)?;
            }
        }
        Ok(())
    }

    fn count_type(&mut self, kind: u8, count: u64) {
        match dimension(kind) {
            Some(axes) => self.count(axes, count),
            None if kind == 0 => {}
            None => self.unknown += count,
        }
    }

    fn count(&mut self, axes: u8, count: u64) {
        match axes {
            3 => self.solids += count,
            2 => self.faces += count,
            1 => self.lines += count,
            _ => {}
        }
    }

    /// Returns what is drawn, and the array that gives it values.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for an unknown array, for a lattice without values,
    /// and if there are no points.
    pub fn drawn(&self, source: &Source, options: &ReadOptions) -> Result<(Drawn, Option<Wanted>)> {
        let is_volume = self.lattices.len() == 1 && self.solids == 0;
        let is_solid = self.solids > 0 || self.lattices.len() > 1;
        // Only arrays that the drawn data sets have.
        let candidates = match (is_volume, is_solid) {
            (true, _) => &self.of_lattices,
            (_, true) => &self.of_solids,
            _ => &self.candidates,
        };
        let counts = |array: usize| counts(source, options, &candidates[array]);
        let chosen = match options.scalar.as_deref() {
            Some(name) => Some(choice::named(source, candidates, name)?),
            None if is_volume => Some(choice::needed(source, candidates, counts)?),
            None => choice::automatic(candidates, counts)?,
        };
        let mut wanted = chosen.map(|Chosen { array, part }| Wanted {
            array: candidates[array].clone(),
            part,
            is_color: false,
        });
        let drawn = if is_volume {
            Drawn::Volume
        } else if is_solid {
            if wanted.is_some() { Drawn::Cells } else { Drawn::Boundary }
        } else if self.faces > 0 || self.lines > 0 {
            Drawn::Surface
        } else if self.points == 0 {
            return Err(source.error("file", "contains no points"));
        } else if options.scalar.is_some() {
            Drawn::Samples
        } else {
            Drawn::Cloud
        };
        let is_length = options.scalar.as_deref().is_some_and(|name| name.ends_with(":magnitude"));
        if let (Drawn::Volume, Some(wanted)) = (drawn, &mut wanted) {
            wanted.is_color =
                wanted.array.is_color() && wanted.part == Part::Magnitude && !is_length;
        }
        if let (Drawn::Surface | Drawn::Cloud, Some(wanted)) = (drawn, &mut wanted) {
            let Candidate { kind, components, .. } = &wanted.array;
            let is_tuple = kind == "u8" && matches!(components, 3 | 4);
            wanted.is_color = is_tuple && wanted.part == Part::Magnitude && !is_length;
        }
        Ok((drawn, wanted))
    }

    /// Returns the arrays with their ranges. The one that is drawn is marked.
    pub fn arrays(&self, source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
        let wanted = self.drawn(source, options)?.1.map(|wanted| wanted.array);
        let mut arrays: Vec<Array> = self.candidates.iter().map(Candidate::listed).collect();
        visit(source, options, &mut |set| {
            for (array, about) in arrays.iter_mut().zip(&self.candidates) {
                for block in &set.blocks {
                    let field = block.field(about.place, &about.name);
                    let field = field.filter(|field| field.about.components == about.components);
                    if let Some(numbers) = field.and_then(|field| field.numbers.as_ref()) {
                        widen(array, numbers, options.missing)?;
                        set.source.check_time()?;
                    }
                }
            }
            Ok(true)
        })?;
        for (array, about) in arrays.iter_mut().zip(&self.candidates) {
            array.is_drawn = wanted.as_ref() == Some(about);
        }
        Ok(arrays)
    }

    /// Warns of what is in the file but not drawn.
    pub fn warn(&self, source: &Source, options: &ReadOptions, drawn: Drawn) {
        several::warn_of_times(source, self.times, options, "times");
        let is_solid = matches!(drawn, Drawn::Volume | Drawn::Cells | Drawn::Boundary);
        let mut left = Vec::new();
        let mut add = |count: u64, one: &str, many: &str| {
            if count > 0 {
                left.push(format!("{count} {}", if count == 1 { one } else { many }));
            }
        };
        add(self.faces * u64::from(drawn == Drawn::Volume), "face", "faces");
        add(self.lines * u64::from(is_solid), "line", "lines");
        add(self.unknown, "cell of an unknown type", "cells of unknown types");
        let grids = self.lattices.len() as u64;
        add(grids * u64::from(!is_solid), "grid", "grids");
        if !left.is_empty() {
            let left = left.join(", ");
            warning::give!("{}: left out of the picture: {left}", source.path.display());
        }
    }
}

/// Returns whether the integers of an array only count up.
fn counts(source: &Source, options: &ReadOptions, array: &Candidate) -> Result<bool> {
    let Candidate { name, place, kind, .. } = array;
    let mut counts = false;
    visit(source, options, &mut |set| {
        for block in &set.blocks {
            let most = if *place == Place::Cells { block.cell_count } else { block.point_count };
            let Some(numbers) = block.field(*place, name).and_then(|field| field.numbers.as_ref())
            else {
                continue;
            };
            if most > 2 {
                counts =
                    may_count(kind, most) && choice::is_ramp(&first_numbers(set.source, numbers)?);
                return Ok(false);
            }
        }
        Ok(true)
    })?;
    Ok(counts)
}

/// Adds an array to a list, unless the list has one of its name, place and components.
fn add_candidate(source: &Source, list: &mut Vec<Candidate>, about: &Candidate) -> Result<()> {
    let key = |candidate: &Candidate| (candidate.place, candidate.components);
    let is_known =
        |candidate: &Candidate| candidate.name == about.name && key(candidate) == key(about);
    if !list.iter().any(is_known) {
        source.spend("the size of the names in bytes", 256)?;
        list.push(about.clone());
    }
    Ok(())
}

/// Returns whether as many integers of a type can all be different.
fn may_count(kind: &str, count: usize) -> bool {
    match kind {
        "u8" | "i8" => count <= 1 << 8,
        "u16" | "i16" => count <= 1 << 16,
        _ => true,
    }
}

/// Returns the first numbers of an array.
fn first_numbers(source: &Source, numbers: &Numbers) -> Result<Vec<f64>> {
    /// Enough to see that they do not count up by chance.
    const FIRST: usize = 1 << 12;
    let mut part = numbers.part()?;
    let size = part.bytes.len().min(FIRST * part.kind.bytes());
    part.bytes = part.bytes[..size].to_vec().into();
    part.doubles(source)
}

/// Widens the range of an array by numbers, which are decoded a few at a time.
fn widen(array: &mut Array, numbers: &Numbers, missing: Option<f64>) -> Result<()> {
    /// Tuples that are decoded together.
    const TUPLES: usize = 1 << 14;
    let components = array.components.max(1);
    let part = if components == 1 { Part::Whole } else { Part::Magnitude };
    let raw = numbers.part()?;
    for bytes in raw.bytes.chunks(TUPLES * components * raw.kind.bytes()) {
        let values = part.values(raw.kind.doubles(bytes, raw.endian), components);
        for value in values.into_iter().filter(|&value| !is_hole(value, missing)) {
            let [low, high] = array.range.unwrap_or([value, value]);
            array.range = Some([low.min(value), high.max(value)]);
        }
    }
    Ok(())
}

/// Returns the number of axes along which a cell of one of VTK's types extends; `None` for types
/// that are not known.
pub fn dimension(kind: u8) -> Option<u8> {
    Some(match kind {
        1 | 2 => 0,
        3 | 4 | 21 | 35 | 68 | 75 => 1,
        5..=9 | 22 | 23 | 28 | 30 | 34 | 36 | 69 | 70 | 76 | 77 => 2,
        10..=16 | 24..=27 | 29 | 31..=33 | 37 | 42 | 71..=73 | 78..=80 => 3,
        _ => return None,
    })
}
