//! Which of a file's arrays is drawn: the one that the caller names, else the first that a person
//! would want to see.

use super::{
    super::{Array, Place},
    holes::is_hole,
};
use crate::{Error, Result, input::Source};

/// An array to choose from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Candidate {
    pub name: String,
    pub place: Place,
    /// The type of its numbers, as in `u8`; or the file's own word if they cannot be read.
    pub kind: String,
    /// Whether its values are numbers that can be read.
    pub is_numeric: bool,
    pub components: usize,
    pub role: Role,
}

/// What the file says that an array is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Role {
    #[default]
    None,
    /// The file's own choice: its active scalars.
    Scalars,
    /// Its active vectors or tensors.
    Vectors,
    /// Normals, texture coordinates and other parts of the geometry.
    Geometry,
    /// Numbers that name points or cells.
    Identifiers,
}

/// What is taken of an array's tuples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// The only component.
    Whole,
    /// The square root of the sum of the components' squares.
    Magnitude,
    /// One component.
    Component(usize),
}

/// The array to draw: its index among the candidates, and the part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Chosen {
    pub array: usize,
    pub part: Part,
}

/// How the names of the components of vectors end.
const AXES: [&str; 4] = ["x", "y", "z", "w"];

impl Candidate {
    /// Returns the array as a list of arrays shows it, not yet chosen and without its range.
    pub fn listed(&self) -> Array {
        Array {
            name: self.name.clone(),
            place: self.place,
            kind: self.kind.clone(),
            components: self.components,
            range: None,
            is_drawn: false,
        }
    }

    fn described(&self) -> String {
        let Self { name, kind, components, place, .. } = self;
        let prefix = if *place == Place::Cells { "cell:" } else { "" };
        match components {
            1 => format!("{prefix}{name} ({kind}, {})", place.name()),
            _ => format!("{prefix}{name} ({kind} × {components}, {})", place.name()),
        }
    }

    /// Returns whether its values are names of points or cells, or marks of the program that wrote
    /// them.
    pub fn is_identifier(&self) -> bool {
        self.role == Role::Identifiers || is_identifier(&self.name)
    }

    /// Returns whether its values are normals, by its name.
    pub fn is_normals(&self) -> bool {
        self.components == 3 && self.name.to_ascii_lowercase().contains("normal")
    }

    /// Returns whether its values are colours: three or four bytes, or numbers of that name.
    pub fn is_color(&self) -> bool {
        matches!(self.components, 3 | 4) && (self.kind == "u8" || names_colors(&self.name))
    }

    fn is_geometry(&self) -> bool {
        let name = self.name.to_ascii_lowercase();
        let is_tuple = |most: usize| (2..=most).contains(&self.components);
        self.role == Role::Geometry
            || (is_tuple(3) && matches!(name.as_str(), "normals" | "normal" | "pointnormals"))
            || (is_tuple(3) && (name.contains("tcoord") || name.starts_with("texture coord")))
            || (is_tuple(3) && name == "uv")
    }

    /// Returns whether its values can be drawn and are worth it.
    fn is_usable(&self) -> bool {
        let is_data = self.is_numeric && self.components > 0;
        is_data && self.place != Place::File && !self.is_identifier()
    }

    fn whole(&self) -> Part {
        if self.components == 1 { Part::Whole } else { Part::Magnitude }
    }
}

impl Part {
    /// Returns the name of what is shown, for captions: “velocity magnitude”.
    pub fn caption(self, name: &str, components: usize) -> String {
        match self {
            Self::Whole => name.to_owned(),
            Self::Magnitude => format!("{name} magnitude"),
            Self::Component(at) if components <= 4 => format!("{name} {}", AXES[at.min(3)]),
            Self::Component(at) => format!("{name} {at}"),
        }
    }

    /// Returns the value of one tuple.
    pub fn value(self, tuple: &[f64]) -> f64 {
        match self {
            Self::Whole => tuple[0],
            Self::Magnitude => magnitude(tuple),
            Self::Component(at) => tuple[at],
        }
    }

    /// Returns the values of all tuples.
    pub fn values(self, numbers: Vec<f64>, components: usize) -> Vec<f64> {
        if components == 1 {
            return numbers;
        }
        numbers.chunks_exact(components).map(|tuple| self.value(tuple)).collect()
    }
}

/// Returns the length of a vector; of a tensor, its Frobenius norm.
pub(crate) fn magnitude(tuple: &[f64]) -> f64 {
    tuple.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// Returns whether a name is one of identifiers (`GlobalNodeId`, `PointIds`, `element_id`) or of
/// VTK's own marks (`vtkGhostType`, `vtkOriginalCellIds`, `vtkValidPointMask`).
pub(crate) fn is_identifier(name: &str) -> bool {
    let ends = ["Id", "Ids", "ID", "IDs", "_id", "_ids", "-id", " id", " ids"];
    let is_vtk = name.strip_prefix("vtk").is_some_and(|rest| rest.starts_with(char::is_uppercase));
    let lower = name.to_ascii_lowercase();
    is_vtk
        || ends.iter().any(|end| name.ends_with(end))
        || matches!(lower.as_str(), "id" | "ids" | "index" | "indices" | "avtghostzones")
        || lower.starts_with("avtoriginal")
}

/// Returns whether a name is that of colours: a word of it is `rgb`, `rgba` or `color`, with any
/// end.
pub(crate) fn names_colors(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    let words = lower.split(|c: char| !c.is_ascii_alphabetic());
    words.into_iter().any(|word| {
        matches!(word, "rgb" | "rgba" | "rgbs" | "color" | "colors" | "colour" | "colours")
    })
}

/// Returns whether integers count up by one from any start, as identifiers do.
pub(crate) fn is_ramp(values: &[f64]) -> bool {
    values.len() > 2 && values.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

/// Returns the lowest and the highest value that is no hole.
pub(crate) fn range(values: impl Iterator<Item = f64>, missing: Option<f64>) -> Option<[f64; 2]> {
    values.filter(|&value| !is_hole(value, missing)).fold(None, |range, value| {
        let [low, high] = range.unwrap_or([value, value]);
        Some([value.min(low), value.max(high)])
    })
}

/// Returns the array that a caller names: `NAME`, `NAME:magnitude`, `NAME:x`, `NAME:1`, and with
/// `cell:` or `point:` before it. A name that is found as a whole comes before its parts. Case
/// counts, unless only one name differs by it.
///
/// # Errors
/// [`Error::Input`] for a name that no array has, with all names, and for a component that the
/// array lacks.
pub(crate) fn named(source: &Source, candidates: &[Candidate], wanted: &str) -> Result<Chosen> {
    let (place, name) = match wanted.split_once(':') {
        Some(("cell" | "cells", name)) => (Some(Place::Cells), name),
        Some(("point" | "points", name)) => (Some(Place::Points), name),
        _ => (None, wanted),
    };
    let whole = |array: usize| Chosen { array, part: candidates[array].whole() };
    let array = find(candidates, None, wanted).or_else(|| find(candidates, place, name));
    let chosen = match (array, name.rsplit_once(':')) {
        (Some(array), _) => whole(array),
        (None, Some((name, part))) => {
            let array =
                find(candidates, place, name).ok_or_else(|| unknown(source, candidates, wanted))?;
            let part = part_of(&candidates[array], part).ok_or_else(|| {
                let components = candidates[array].components;
                let message = format!("has {components} components, and none is “{part}”");
                source.error(format!("array “{name}”"), message).hint(
                    "name a component by its number from 0, by x, y, z or w, or take “magnitude”",
                )
            })?;
            Chosen { array, part }
        }
        (None, None) => return Err(unknown(source, candidates, wanted)),
    };
    let candidate = &candidates[chosen.array];
    if candidate.is_numeric && candidate.components > 0 {
        return Ok(chosen);
    }
    let place = format!("array “{}”", candidate.name);
    let message = format!("holds values of the type {}, which are not numbers", candidate.kind);
    Err(source.error(place, message).hint(options(candidates)))
}

/// Returns the array to draw if none is named; `None` if no array is worth drawing. The file's own
/// choice comes first, then scalars, then vectors; points come before cells. Identifiers are never
/// chosen. `counts` returns whether the values of an array of integers only count up
/// ([`is_ramp`]).
///
/// # Errors
/// Those of `counts`.
pub(crate) fn automatic(
    candidates: &[Candidate],
    mut counts: impl FnMut(usize) -> Result<bool>,
) -> Result<Option<Chosen>> {
    let rank = |candidate: &Candidate| {
        let of_cells = usize::from(candidate.place == Place::Cells);
        let kind = match candidate.role {
            Role::Scalars => 0,
            _ if candidate.is_geometry() => 4,
            Role::Vectors => 1,
            _ if candidate.components == 1 => 2,
            _ => 3,
        };
        2 * kind + of_cells
    };
    let mut order: Vec<usize> =
        (0..candidates.len()).filter(|&array| candidates[array].is_usable()).collect();
    order.sort_by_key(|&array| rank(&candidates[array]));
    for array in order {
        let candidate = &candidates[array];
        let is_integer = candidate.components == 1 && !candidate.kind.starts_with('f');
        if !(candidate.is_geometry() || is_integer && counts(array)?) {
            return Ok(Some(Chosen { array, part: candidate.whole() }));
        }
    }
    Ok(None)
}

/// As [`automatic`], for data that cannot be drawn without values. If every array only counts or
/// is a part of the geometry, the first of them is taken.
///
/// # Errors
/// Those of `counts`, and [`Error::Input`] if there are only identifiers or no numbers at all.
pub(crate) fn needed(
    source: &Source,
    candidates: &[Candidate],
    counts: impl FnMut(usize) -> Result<bool>,
) -> Result<Chosen> {
    if let Some(chosen) = automatic(candidates, counts)? {
        return Ok(chosen);
    }
    let is_data = |candidate: &Candidate| candidate.role != Role::Geometry;
    let usable = |candidate: &Candidate| is_data(candidate) && candidate.is_usable();
    match candidates.iter().position(usable) {
        Some(array) => Ok(Chosen { array, part: candidates[array].whole() }),
        None if !candidates.iter().any(is_data) => {
            Err(source.error("file", "contains no values that can be drawn"))
        }
        None => Err(source
            .error("file", "contains only identifiers and values that are not numbers")
            .hint(options(candidates))),
    }
}

fn find(candidates: &[Candidate], place: Option<Place>, name: &str) -> Option<usize> {
    let here = |candidate: &&Candidate| place.is_none_or(|place| candidate.place == place);
    let exact = candidates.iter().position(|candidate| here(&candidate) && candidate.name == name);
    exact.or_else(|| {
        // CloudCompare writes names with a word before them.
        let like = |candidate: &Candidate| {
            let plain = candidate.name.strip_prefix("scalar_").unwrap_or(&candidate.name);
            here(&candidate)
                && (candidate.name.eq_ignore_ascii_case(name) || plain.eq_ignore_ascii_case(name))
        };
        let first = candidates.iter().position(like)?;
        let others = candidates[first + 1..]
            .iter()
            .any(|candidate| like(candidate) && candidate.name != candidates[first].name);
        (!others).then_some(first)
    })
}

fn part_of(candidate: &Candidate, part: &str) -> Option<Part> {
    let lower = part.to_ascii_lowercase();
    if lower == "magnitude" {
        return Some(candidate.whole());
    }
    let axis = AXES.iter().position(|axis| *axis == lower);
    let at = axis.or_else(|| lower.parse().ok()).filter(|&at| at < candidate.components)?;
    Some(if candidate.components == 1 { Part::Whole } else { Part::Component(at) })
}

fn unknown(source: &Source, candidates: &[Candidate], wanted: &str) -> Error {
    let error = source.error("arrays", format!("has no array “{wanted}”"));
    if candidates.is_empty() { error } else { error.hint(options(candidates)) }
}

/// Returns the hint that lists the arrays.
fn options(candidates: &[Candidate]) -> String {
    /// The most names that a message lists.
    const MOST: usize = 24;
    let names: Vec<String> = candidates.iter().take(MOST).map(Candidate::described).collect();
    let more = match candidates.len().saturating_sub(MOST) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    format!("name one of them: {}{more}", names.join(", "))
}
