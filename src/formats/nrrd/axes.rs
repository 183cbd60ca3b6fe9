//! Which axes of a file are those of space, and what a fourth one is.

use super::Header;
use crate::{
    Result,
    formats::{
        Endian, ReadOptions, SampleType,
        shared::{
            grid::{Component, Element, Grid},
            several,
        },
    },
};

/// What an axis that is not one of space has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Colors,
    /// Components of vectors, tensors or complex numbers.
    Components,
    /// Whole volumes: times, or directions of diffusion and other lists.
    Times,
    List,
    /// The file does not say.
    Unknown,
}

/// The axes of a file.
pub(super) struct Axes {
    sizes: Vec<usize>,
    /// The axis that is not one of space.
    other: Option<(usize, Role)>,
}

impl Axes {
    pub fn of(header: &Header) -> Result<Self> {
        let [dimension]: [usize; 1] = header.numbers("dimension", header.need("dimension")?)?;
        let sizes = header.need("sizes")?;
        let sizes = match dimension {
            3 => header.numbers::<3, _>("sizes", sizes)?.to_vec(),
            4 => header.numbers::<4, _>("sizes", sizes)?.to_vec(),
            _ => {
                let message = format!(
                    "is {dimension}, but a volume has 2 or 3 axes of space, and one more of \
                     colours, components or times"
                );
                return Err(header.source.error("dimension", message));
            }
        };
        let kinds: Vec<String> = header
            .get(&["kinds"])
            .unwrap_or_default()
            .split_ascii_whitespace()
            .map(str::to_ascii_lowercase)
            .collect();
        if dimension == 3 {
            return Ok(Self { sizes, other: None });
        }
        let is_space = |kind: &str| matches!(kind, "domain" | "space");
        // A kind that is known comes first, then an axis without a direction.
        let by_kind = kinds.iter().position(|kind| !is_space(kind) && !kind.contains('?'));
        let none = header.get(&["space directions"]).and_then(|text| {
            let vectors = text.replace("none", "|").replace(')', "|");
            vectors.split('|').take(4).position(|part| !part.contains('('))
        });
        let by_size = || {
            let few = |&at: &usize| sizes[at] <= 4;
            [0, 3].into_iter().find(few).unwrap_or(3)
        };
        let at = by_kind.or(none).unwrap_or_else(by_size);
        let role = match kinds.get(at).map(String::as_str) {
            Some("rgb-color" | "rgba-color" | "3-color" | "4-color") => Role::Colors,
            Some("time") => Role::Times,
            Some("list" | "stub" | "scalar") => Role::List,
            Some(kind) if is_several(kind) => Role::Components,
            _ => Role::Unknown,
        };
        Ok(Self { sizes, other: Some((at, role)) })
    }

    /// Returns the sizes of the axes of space.
    pub fn dims(&self) -> [usize; 3] {
        let mut space = (0..self.sizes.len()).filter(|&axis| self.is_space(axis));
        std::array::from_fn(|_| space.next().map_or(1, |axis| self.sizes[axis]))
    }

    /// Whether an axis is one of space.
    pub fn is_space(&self, axis: usize) -> bool {
        self.other.is_none_or(|(other, _)| other != axis)
    }

    /// Whether there is an axis that is not one of space.
    pub fn has_other(&self) -> bool {
        self.other.is_some()
    }

    /// Returns the numbers of all axes together; `None` if they are too many.
    pub fn count(&self) -> Option<u64> {
        self.sizes.iter().try_fold(1u64, |all, &size| all.checked_mul(size as u64))
    }

    /// Returns the layout of the samples, and what of them to read.
    pub fn grid(
        &self,
        header: &Header,
        kind: SampleType,
        endian: Endian,
        options: &ReadOptions,
    ) -> Result<(Grid, Component)> {
        let stride = |axis: usize| self.sizes[..axis].iter().product::<usize>();
        let mut space = (0..self.sizes.len()).filter(|&axis| self.is_space(axis));
        let strides = std::array::from_fn(|_| space.next().map_or(1, stride));
        let dims = self.dims();
        let grid = |components: usize, step: usize| Grid {
            element: Element::Real(kind),
            endian,
            dims,
            strides,
            components,
            step,
        };
        let Some((other, role)) = self.other else {
            return Ok((grid(1, 1), Component::chosen(header.source, options, 1, false)?));
        };
        let (count, step) = (self.sizes[other], stride(other));
        let source = header.source;
        if count == 0 {
            return Err(source.error("sizes", format!("axis {other} has no numbers")));
        }
        let role = match role {
            Role::Unknown if count == 1 => Role::List,
            Role::Unknown if options.time.is_some() => Role::Times,
            Role::Unknown if options.scalar.is_some() => Role::Components,
            Role::Unknown => {
                let is_few = matches!(count, 3 | 4);
                let of =
                    if is_few { "colours, components or times" } else { "times or components" };
                let message = format!(
                    "the file has 4 axes, and does not say what the {count} numbers along axis \
                     {other} are: {of}"
                );
                let rgb = if is_few { "--scalar rgb draws colours, " } else { "" };
                return Err(source.error("kinds", message).hint(format!(
                    "{rgb}--scalar :0 draws the first component, and --time 0 the first time"
                )));
            }
            known => known,
        };
        match role {
            Role::Times | Role::List => {
                let names = if role == Role::Times { "times" } else { "volumes" };
                let time = several::of_times(source, "sizes", count as u64, options, names)?;
                Ok((grid(count, step), Component::One(time)))
            }
            _ => {
                let are_colors = role == Role::Colors && matches!(count, 3 | 4);
                let component = Component::chosen(source, options, count, are_colors)?;
                Ok((grid(count, step), component))
            }
        }
    }
}

/// Returns whether an axis of a kind has several numbers of one sample.
pub(super) fn is_several(kind: &str) -> bool {
    ["color", "vector", "normal", "gradient", "matrix", "quaternion", "complex", "point"]
        .iter()
        .any(|name| kind.contains(name))
}
