//! Arrays that are together a point cloud.

use super::Entry;
use crate::{
    Result,
    formats::{
        ReadOptions,
        npy::Numbers,
        shared::cloud::{Cloud, colors_of_numbers},
    },
    input::Source,
    surface::Mesh,
};
use glam::DVec3;

/// Names of positions, in lower case and without what joins words.
const POSITIONS: &[&str] = &[
    "points",
    "point",
    "pts",
    "xyz",
    "pos",
    "position",
    "positions",
    "coord",
    "coords",
    "coordinates",
    "vertices",
    "verts",
    "vertex",
    "locations",
    "cloud",
    "pointcloud",
    "pc",
    "pcd",
    "means",
];
const COLORS: &[&str] =
    &["colors", "color", "colours", "colour", "rgb", "rgba", "rgbs", "vertexcolors", "pointcolors"];
const NORMALS: &[&str] = &["normals", "normal", "norms", "nxyz", "vertexnormals", "pointnormals"];

/// The arrays of a cloud, as indices.
pub struct Columns {
    pub positions: usize,
    colors: Option<usize>,
    normals: Option<usize>,
}

impl Columns {
    /// Returns the arrays of a cloud, if there surely is one: the only array of three columns with
    /// the name of positions, or the only one of three columns of floats at all.
    pub fn of(entries: &[Entry]) -> Option<Self> {
        let is_triple = |&at: &usize| matches!(entries[at].header.shape[..], [_, 3]);
        let triples: Vec<usize> = (0..entries.len()).filter(is_triple).collect();
        let only = |arrays: Vec<usize>| <[usize; 1]>::try_from(arrays).ok().map(|[at]| at);
        let named = triples.iter().copied().filter(|&at| is_named(&entries[at].name, POSITIONS));
        // Three rows are rather a matrix.
        let unnamed = triples.iter().copied().filter(|&at| {
            let Entry { name, header, .. } = &entries[at];
            !header.element.is_byte()
                && header.shape[0] > 4
                && !is_named(name, COLORS)
                && !is_named(name, NORMALS)
        });
        let positions = only(named.collect()).or_else(|| only(unnamed.collect()))?;
        Some(Self::around(entries, positions))
    }

    /// Returns the arrays of a cloud with these positions.
    pub fn around(entries: &[Entry], positions: usize) -> Self {
        let rows = entries[positions].header.shape[0];
        let find = |fits: &dyn Fn(&Entry) -> bool| {
            (0..entries.len()).find(|&at| at != positions && fits(&entries[at]))
        };
        let has = |entry: &Entry, most: u64| {
            matches!(entry.header.shape[..], [count, width] if count == rows
                && (3..=most).contains(&width))
        };
        let colors = find(&|entry| is_named(&entry.name, COLORS) && has(entry, 4));
        // Three bytes a point are a colour, whatever the name.
        let bytes = || find(&|entry| entry.header.element.is_byte() && has(entry, 4));
        Self {
            positions,
            colors: colors.or_else(bytes),
            normals: find(&|entry| is_named(&entry.name, NORMALS) && has(entry, 3)),
        }
    }

    /// Returns the arrays that are read.
    pub fn all(&self, entries: &[Entry], options: &ReadOptions) -> Vec<usize> {
        let values = self.values(entries, options);
        [Some(self.positions), self.colors, self.normals, values].into_iter().flatten().collect()
    }

    /// Returns the array of values that the options name, if it has one for each point.
    fn values(&self, entries: &[Entry], options: &ReadOptions) -> Option<usize> {
        let name = options.scalar.as_deref()?;
        let rows = entries[self.positions].header.shape[0];
        entries.iter().position(|entry| {
            let is_one = matches!(entry.header.shape[..], [count] | [count, 1] if count == rows);
            is_one && entry.name == name
        })
    }
}

/// Whether an array has one of some names.
fn is_named(name: &str, names: &[&str]) -> bool {
    let plain: String =
        name.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_ascii_lowercase();
    names.contains(&plain.as_str())
}

/// Builds the cloud. `read` returns the numbers of an array.
pub fn read(
    source: &Source,
    entries: &[Entry],
    columns: &Columns,
    options: &ReadOptions,
    mut read: impl FnMut(&Entry) -> Result<Numbers>,
) -> Result<Mesh> {
    let positions = &entries[columns.positions];
    let rows = source.check_points("the number of points", positions.header.shape[0])?;
    let triples = |numbers: &Numbers| -> Vec<DVec3> {
        numbers.values.chunks_exact(numbers.width).map(DVec3::from_slice).collect()
    };
    source.room::<DVec3>("the positions", rows)?;
    let mut cloud = Cloud { positions: triples(&read(positions)?), ..Cloud::default() };
    if let Some(at) = columns.colors {
        let numbers = read(&entries[at])?;
        source.room::<[u8; 4]>("the colours", rows)?;
        cloud.colors = colors_of_numbers(&numbers.values, numbers.width);
    }
    if let Some(at) = columns.normals {
        let normals = triples(&read(&entries[at])?);
        cloud.normals = normals.into_iter().map(|normal| normal.as_vec3()).collect();
    }
    if let Some(name) = &options.scalar {
        let at = columns.values(entries, options).ok_or_else(|| {
            let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
            source
                .error("archive", format!("has no values “{name}” for {rows} points"))
                .hint(format!("its arrays are {}", names.join(", ")))
        })?;
        cloud.values = read(&entries[at])?.values.into_iter().map(|value| value as f32).collect();
        cloud.about.name.clone_from(name);
    }
    cloud.into_mesh(source)
}
