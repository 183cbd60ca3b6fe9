//! Which image of a store is shown: that of the store itself, or the first of a plate, of a well,
//! or of several series.

use super::{
    array::{Layout, MOST_AXES},
    ome::{self, Axis, Multiscale},
    store::{Store, joined},
};
use crate::{
    Error, Result,
    input::{Source, neighbour},
};
use serde_json::Value;

/// Most groups inside one another.
const DEPTH: usize = 8;

/// Most series of a store that are counted.
const MOST_SERIES: usize = 1 << 10;

/// A node of a store.
pub enum Node {
    Array(Layout),
    /// The attributes of a group.
    Group(Value),
}

/// An image in a store.
#[derive(Default)]
pub struct Found {
    /// What else there is, as warnings.
    pub notes: Vec<String>,
    /// The path of its group.
    pub group: String,
    pub multiscale: Multiscale,
    pub attributes: Value,
}

impl Node {
    /// Reads the metadata of a node; `None` if there is none.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for metadata that is damaged or not read.
    pub fn of(store: &Store, path: &str) -> Result<Option<Self>> {
        use super::chunks::Objects;
        let wrong = |key: &str, message: String| {
            crate::Error::input(&store.place(&joined(path, key)), "metadata", message)
        };
        if let Some(metadata) = store.json(&joined(path, "zarr.json"))? {
            if metadata["node_type"].as_str() != Some("array") {
                return Ok(Some(Self::Group(ome::attributes(&metadata).clone())));
            }
            let layout = Layout::of(&metadata).map_err(|message| wrong("zarr.json", message))?;
            return Ok(Some(Self::Array(layout)));
        }
        let attributes = || Ok(store.json(&joined(path, ".zattrs"))?.unwrap_or(Value::Null));
        if let Some(metadata) = store.json(&joined(path, ".zarray"))? {
            let mut layout = Layout::of(&metadata).map_err(|message| wrong(".zarray", message))?;
            let attributes: Value = (attributes() as Result<Value>)?;
            // The names that xarray writes.
            layout.names = ome::names(&attributes["_ARRAY_DIMENSIONS"]);
            return Ok(Some(Self::Array(layout)));
        }
        let attributes: Value = (attributes() as Result<Value>)?;
        let is_group = attributes.is_object() || store.json(&joined(path, ".zgroup"))?.is_some();
        Ok(is_group.then_some(Self::Group(attributes)))
    }
}

/// Finds the image of a store: the one that a caller names by its path in the store, or by the
/// path of one of its levels; else the first.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a name of nothing, and for a store without images.
pub fn find(source: &Source, store: &Store, dataset: Option<&str>) -> Result<Found> {
    let Some(name) = dataset else { return first(source, store, "", 0) };
    let name = name.trim_matches('/');
    if !neighbour::is_inside(name) {
        return Err(nothing(
            source,
            format!("has no “{name}”: a path inside the store is expected"),
        ));
    }
    // A level of the image that the store itself is.
    let shown = first(source, store, "", 0).ok().filter(|found| found.group.is_empty());
    if let Some(found) = shown.and_then(|found| level(found, name)) {
        return Ok(found);
    }
    match Node::of(store, name)? {
        Some(Node::Group(_)) => first(source, store, name, 0),
        Some(Node::Array(layout)) => {
            // A level of an image further up.
            for (at, _) in name.rmatch_indices('/') {
                if let Some(Node::Group(attributes)) = Node::of(store, &name[..at])?
                    && let Some(found) = image(source, &name[..at], attributes)?
                    && let Some(found) = level(found, &name[at + 1..])
                {
                    return Ok(found);
                }
            }
            Ok(array(name.to_owned(), &layout))
        }
        None => Err(nothing(source, format!("has no array or group “{name}”"))),
    }
}

/// Returns an image with only the level of a path; `None` if it has no such level.
fn level(mut found: Found, path: &str) -> Option<Found> {
    found.multiscale.levels.retain(|level| level.path == path);
    (!found.multiscale.levels.is_empty()).then_some(found)
}

/// Returns the image that the attributes of a group describe.
fn image(source: &Source, group: &str, attributes: Value) -> Result<Option<Found>> {
    let wrong = |message| {
        let place = if group.is_empty() { "attributes".into() } else { format!("“{group}”") };
        source.error(place, message)
    };
    let Some(multiscale) = ome::multiscale(&attributes).map_err(wrong)? else { return Ok(None) };
    for level in &multiscale.levels {
        if !neighbour::is_inside(&level.path) {
            let path: String = level.path.chars().take(80).collect();
            let message = format!("names the level “{path}”, which is no path inside the store");
            return Err(source.error("attributes", message));
        }
    }
    Ok(Some(Found { group: group.to_owned(), multiscale, attributes, ..Found::default() }))
}

/// Returns the image that an array is by itself.
fn array(path: String, layout: &Layout) -> Found {
    Found { group: path, multiscale: plain(&layout.names), ..Found::default() }
}

/// Returns the first image in a group.
fn first(source: &Source, store: &Store, group: &str, depth: usize) -> Result<Found> {
    if depth > DEPTH {
        return Err(nothing(source, "has groups in groups, but no image"));
    }
    let attributes = match Node::of(store, group)? {
        Some(Node::Group(attributes)) => attributes,
        Some(Node::Array(layout)) => {
            return Ok(array(group.to_owned(), &layout));
        }
        None if group.is_empty() => {
            return Err(nothing(source, "has no zarr.json, .zarray, .zgroup or .zattrs"));
        }
        None => {
            let message = format!("has no group “{group}”, which its metadata names");
            return Err(nothing(source, message));
        }
    };
    let inside = |list: &[String], what: &str| {
        let Some(path) = list.first() else {
            return Err(nothing(source, format!("has no {what}")));
        };
        if !neighbour::is_inside(path) {
            let path: String = path.chars().take(80).collect();
            let message = format!("names “{path}”, which is no path inside the store");
            return Err(source.error("attributes", message));
        }
        let mut found = first(source, store, &joined(group, path), depth + 1)?;
        if let [_, second, ..] = list {
            let (shown, other) = (joined(group, path), joined(group, second));
            found.notes.push(format!(
                "shows “{shown}”, the first of {} {what}; --dataset {other} shows the second",
                list.len()
            ));
        }
        Ok(found)
    };
    if let Some(wells) = ome::wells(&attributes) {
        return inside(&wells, "wells of a plate");
    }
    if let Some(images) = ome::images(&attributes) {
        return inside(&images, "fields of a well");
    }
    if !attributes["bioformats2raw.layout"].is_null() {
        return inside(&series(store, group)?, "series");
    }
    let labels = ome::names(&attributes["labels"]);
    if let Some(found) = image(source, group, attributes)? {
        return Ok(found);
    }
    if !labels.is_empty() {
        return inside(&labels, "images of labels");
    }
    largest(source, store, group, depth)
}

/// Returns the paths of the images of labels beside an image.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for metadata that is damaged.
pub fn labels(store: &Store, group: &str) -> Result<Vec<String>> {
    let path = joined(group, "labels");
    let Some(Node::Group(attributes)) = Node::of(store, &path)? else { return Ok(Vec::new()) };
    let names = ome::names(&attributes["labels"]).into_iter();
    Ok(names.filter(|name| neighbour::is_inside(name)).map(|name| joined(&path, &name)).collect())
}

/// Returns the names of the series of a store that bioformats2raw wrote.
fn series(store: &Store, group: &str) -> Result<Vec<String>> {
    let listed = match Node::of(store, &joined(group, "OME"))? {
        Some(Node::Group(attributes)) => ome::names(&attributes["series"]),
        _ => Vec::new(),
    };
    if !listed.is_empty() {
        return Ok(listed);
    }
    let mut names = Vec::new();
    for number in 0..MOST_SERIES {
        let name = number.to_string();
        if Node::of(store, &joined(group, &name))?.is_none() {
            break;
        }
        names.push(name);
    }
    Ok(names)
}

/// Returns the largest array of a group, or the first image of a group inside.
fn largest(source: &Source, store: &Store, group: &str, depth: usize) -> Result<Found> {
    let (mut arrays, mut groups) = (Vec::new(), Vec::new());
    for name in store.nodes(group) {
        source.check_time()?;
        let path = joined(group, &name);
        match Node::of(store, &path) {
            Ok(Some(Node::Array(layout))) if layout.shape.len() > 1 => {
                arrays.push((layout.len().unwrap_or(u64::MAX), path, layout));
            }
            Ok(Some(Node::Group(_))) => groups.push(path),
            _ => {}
        }
    }
    let count = arrays.len();
    // Of several of one size, the first.
    let largest = arrays.into_iter().rev().max_by_key(|(size, ..)| *size);
    if let Some((_, path, layout)) = largest {
        let note =
            format!("shows “{path}”, the largest of {count} arrays; --dataset names another");
        let notes = if count > 1 { vec![note] } else { Vec::new() };
        return Ok(Found { notes, ..array(path, &layout) });
    }
    let first = groups.iter().find_map(|path| first(source, store, path, depth + 1).ok());
    first.ok_or_else(|| nothing(source, "has neither images of OME-Zarr nor arrays of two axes"))
}

/// An image of one array without metadata of OME.
fn plain(names: &[String]) -> Multiscale {
    let named = |name: &String| ome::axis_of(&Value::from(name.as_str()));
    let axes: Vec<Axis> = names.iter().take(MOST_AXES).map(named).collect();
    let is_known = !axes.is_empty() && axes.iter().all(|axis| !axis.kind.is_empty());
    let axes = if is_known { axes } else { Vec::new() };
    Multiscale { axes, levels: vec![ome::Level::default()] }
}

/// Returns the error for a store without data that can be drawn.
fn nothing(source: &Source, message: impl Into<String>) -> Error {
    source.error("metadata", message).hint(
        "name a store of OME-Zarr, or with --dataset one of its arrays; `splatkit info` lists them",
    )
}
