//! The facts of an input: what it holds, in names and values. `splatkit info --json` prints them.

use super::{Data, Opened};
use crate::{
    Result,
    about::{About, Channel, Frame, Modality, Orientation, direction_name},
    bricks::Bricks,
    cells::{CellKind, Cells, Place},
    formats::{Array, Series, Times},
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    input,
    math::Bounds,
    scattered::Points,
    surface::Mesh,
    volume::Volume,
};
use serde_json::{Map, Value, json};

/// What is known of an input.
#[derive(Debug, Clone, PartialEq)]
pub struct Facts {
    /// Names and values: kind, count, bytes, bounds in world units, attributes and what the kind
    /// has of its own.
    pub named: Map<String, Value>,
    /// The series of a folder of pictures.
    pub series: Vec<Series>,
    /// The arrays of a file that holds several.
    pub arrays: Vec<Array>,
}

impl Facts {
    /// Returns all facts as one object of JSON.
    pub fn to_json(&self) -> Map<String, Value> {
        let mut facts = self.named.clone();
        if !self.series.is_empty() {
            facts.insert("series".into(), self.series.iter().map(of_series).collect());
        }
        if !self.arrays.is_empty() {
            facts.insert("arrays".into(), self.arrays.iter().map(of_array).collect());
        }
        facts
    }
}

impl Opened<'_> {
    /// Returns what is known of this input and of the data that it holds.
    ///
    /// # Errors
    /// Those of [`series`](Self::series), of [`arrays`](Self::arrays) and of asking for sizes.
    pub fn facts(&self, data: &Data) -> Result<Facts> {
        Ok(Facts { series: self.series()?, arrays: self.arrays()?, ..self.cheap_facts(data)? })
    }

    /// Returns the facts without series and arrays, for which files are read once more.
    pub(super) fn cheap_facts(&self, data: &Data) -> Result<Facts> {
        let mut named = match data {
            Data::Mesh(mesh) => of_mesh(mesh),
            Data::Volume(volume) => of_volume(volume),
            Data::Samples(points) => of_samples(points),
            Data::Cells(cells) => of_cells(cells),
            Data::Gaussians(set) => of_gaussians(set),
            Data::Hierarchy(hierarchy) => of_hierarchy(hierarchy),
            Data::Bricks(bricks) => of_bricks(bricks),
        };
        let (count, bytes) = (data.count(), self.bytes()?);
        named.insert("file".into(), json!(self.path().to_string_lossy()));
        named.insert("count".into(), json!(count));
        named.insert("bytes".into(), json!(bytes));
        named.insert("bytes_per_point".into(), json!(bytes as f64 / count.max(1) as f64));
        if let Some(Times { count, read }) = self.times() {
            named.insert("times".into(), json!(count));
            named.insert("time".into(), json!(read));
        }
        if data.holes() > 0 {
            named.insert("missing".into(), json!(data.holes()));
        }
        // Bricks state their own levels. The leaves of a hierarchy lie at different depths.
        if !matches!(data, Data::Hierarchy(_)) {
            named.entry("levels").or_insert(json!(1));
        }
        Ok(Facts { named, series: Vec::new(), arrays: Vec::new() })
    }

    /// Returns the bytes of a file, or of the files of a folder that were read.
    fn bytes(&self) -> Result<u64> {
        if let Some(bytes) = self.held() {
            return Ok(bytes.len() as u64);
        }
        if let Some(parts) = self.parts() {
            return Ok(parts.len());
        }
        // The objects of a store are not counted: there may be millions.
        if input::is_store(self.path()) {
            return Ok(0);
        }
        if !self.path().is_dir() {
            return input::size(self.path());
        }
        let sizes: Result<Vec<u64>> = self.files().iter().map(input::size).collect();
        Ok(sizes?.into_iter().sum())
    }
}

fn of_series(series: &Series) -> Value {
    json!({
        "number": series.number,
        "uid": series.identifier,
        "description": series.description,
        "modality": series.modality,
        "size": series.size,
        "pictures": series.pictures,
        "obstacle": series.obstacle,
        "drawn": series.is_drawn,
    })
}

fn of_array(array: &Array) -> Value {
    json!({
        "name": array.name,
        "place": array.place.name(),
        "type": array.kind,
        "components": array.components,
        "range": array.range,
        "drawn": array.is_drawn,
    })
}

/// Returns the names of attributes that are there.
fn present<const N: usize>(attributes: [(&str, bool); N]) -> Value {
    attributes.iter().filter_map(|(name, is_there)| is_there.then_some(*name)).collect()
}

fn of_mesh(mesh: &Mesh) -> Map<String, Value> {
    let mut facts = Map::new();
    let is_cloud = mesh.triangles.is_empty() && mesh.lines.is_empty();
    facts.insert("kind".into(), json!(if is_cloud { "cloud" } else { "mesh" }));
    facts.insert("triangles".into(), json!(mesh.triangles.len()));
    if !mesh.lines.is_empty() {
        facts.insert("lines".into(), json!(mesh.lines.len()));
    }
    let attributes = present([
        ("position", true),
        ("normal", !mesh.normals.is_empty()),
        ("color", !mesh.colors.is_empty()),
        ("uv", !mesh.uvs.is_empty()),
    ]);
    facts.insert("attributes".into(), attributes);
    facts.insert("materials".into(), json!(mesh.materials.len()));
    let textures = mesh.materials.iter().filter(|material| material.texture.is_some());
    facts.insert("textures".into(), json!(textures.count()));
    let about = &mesh.about;
    if !about.attributes.is_empty() {
        facts.insert("color_by".into(), json!(about.attributes));
    }
    for (name, text) in [("layout", &about.layout), ("crs", &about.crs)] {
        if !text.is_empty() {
            facts.insert(name.into(), json!(text));
        }
    }
    stand(&mut facts, mesh.about.orientation);
    facts.insert("bounds".into(), json!(mesh.bounds().map(bounds)));
    facts
}

fn of_volume(volume: &Volume) -> Map<String, Value> {
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("volume"));
    facts.insert("dims".into(), json!(volume.lattice.dims));
    facts.insert("spacing".into(), json!(volume.lattice.spacing().to_array()));
    facts.insert("type".into(), json!(volume.samples.type_name()));
    facts.insert("range".into(), json!(volume.range));
    let attributes =
        if volume.colors.is_some() { json!(["value", "color"]) } else { json!(["value"]) };
    facts.insert("attributes".into(), attributes);
    stand(&mut facts, volume.about.orientation);
    say(&mut facts, &volume.about);
    name_channels(&mut facts, &volume.about.channels);
    if let Some(labels) = &volume.about.labels {
        facts.insert("labels".into(), json!(labels.listed()));
    }
    facts.insert("bounds".into(), bounds(volume.bounds()));
    facts
}

fn name_channels(facts: &mut Map<String, Value>, channels: &[Channel]) {
    if !channels.is_empty() {
        let names = (0..channels.len()).map(|number| Channel::name_of(channels, number));
        facts.insert("channels".into(), json!(names.collect::<Vec<_>>()));
    }
}

/// Adds what the file says of its values and lengths.
fn say(facts: &mut Map<String, Value>, about: &About) {
    if let Some(modality) = about.modality {
        let name = match modality {
            Modality::Ct => "CT",
            Modality::Mr => "MR",
            Modality::Emission => "emission tomography",
            Modality::Ultrasound => "ultrasound",
            Modality::Microscopy => "microscopy",
        };
        facts.insert("modality".into(), json!(name));
    }
    if about.frame == Frame::Patient {
        facts.insert("frame".into(), json!("RAS"));
    }
    if let Some(window) = about.window {
        facts.insert("window".into(), json!(window));
    }
    texts(facts, [("value_unit", &about.unit), ("unit", &about.length)]);
}

/// Adds the texts that are not empty.
fn texts<const N: usize>(facts: &mut Map<String, Value>, texts: [(&str, &String); N]) {
    for (name, text) in texts {
        if !text.is_empty() {
            facts.insert(name.into(), json!(text));
        }
    }
}

fn of_bricks(bricks: &Bricks) -> Map<String, Value> {
    let header = bricks.header();
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("volume in bricks"));
    facts.insert("dims".into(), json!(header.lattice.dims));
    facts.insert("spacing".into(), json!(header.lattice.spacing().to_array()));
    facts.insert("type".into(), json!(header.scalar.name()));
    facts.insert("range".into(), json!(header.range));
    facts.insert("levels".into(), json!(bricks.levels().len()));
    let count: usize = bricks.levels().iter().map(|level| level.bricks()).sum();
    facts.insert("bricks".into(), json!(count));
    texts(&mut facts, [("unit", &header.unit), ("source", &header.source)]);
    facts.insert("attributes".into(), json!(["value"]));
    name_channels(&mut facts, &bricks.about().channels);
    facts.insert("bounds".into(), bounds(bricks.bounds()));
    facts
}

fn of_hierarchy(hierarchy: &Hierarchy) -> Map<String, Value> {
    let header = hierarchy.header();
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("hierarchy"));
    facts.insert("splats".into(), json!(header.leaves));
    facts.insert("nodes".into(), json!(header.nodes));
    facts.insert("pages".into(), json!(hierarchy.page_count()));
    facts.insert("closed".into(), json!(header.closed));
    facts.insert("lossless".into(), json!(header.lossless));
    if let Some(degree) = header.degree {
        facts.insert("degree".into(), json!(degree));
    }
    facts.insert(
        "up".into(),
        header.orientation.map_or(Value::Null, |orientation| up(&orientation)),
    );
    if header.is_guessed {
        facts.insert("up_from".into(), json!("guess"));
    }
    texts(&mut facts, [("unit", &header.unit), ("source", &header.source)]);
    let attributes =
        present([("position", true), ("normal", header.has_normals), ("color", header.has_color)]);
    facts.insert("attributes".into(), attributes);
    facts.insert("bounds".into(), bounds(header.bounds));
    facts
}

fn of_samples(points: &Points) -> Map<String, Value> {
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("samples"));
    facts.insert("range".into(), json!(points.range()));
    let attributes = present([
        ("position", true),
        ("value", true),
        ("radius", !points.radii.is_empty()),
        ("covariance", !points.covariances.is_empty()),
    ]);
    facts.insert("attributes".into(), attributes);
    stand(&mut facts, points.about.orientation);
    facts.insert("bounds".into(), bounds(points.bounds()));
    facts
}

fn of_cells(cells: &Cells) -> Map<String, Value> {
    let count = |kind: CellKind| cells.kinds.iter().filter(|other| **other == kind).count();
    let kinds = CellKind::ALL.into_iter().map(|kind| (kind, count(kind)));
    let kinds = kinds.filter(|(_, count)| *count > 0);
    let kinds = kinds.map(|(kind, count)| (kind.name().to_owned(), json!(count)));
    let place = if cells.place == Place::Points { "points" } else { "cells" };
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("cells"));
    facts.insert("points".into(), json!(cells.points.len()));
    facts.insert("cells".into(), Value::Object(kinds.collect()));
    if !cells.faces.is_empty() {
        facts.insert("faces".into(), json!(cells.faces.len()));
    }
    let mut attributes = vec!["position".to_owned()];
    if !cells.values.is_empty() {
        facts.insert("range".into(), json!(cells.range()));
        attributes.push(format!("value of {place}"));
    }
    facts.insert("attributes".into(), json!(attributes));
    stand(&mut facts, cells.about.orientation);
    facts.insert("bounds".into(), bounds(cells.bounds()));
    facts
}

fn of_gaussians(set: &Gaussians) -> Map<String, Value> {
    let survey = set.survey();
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("trained Gaussians"));
    facts.insert("degree".into(), json!(set.degree));
    facts.insert("scales".into(), json!(survey.scales));
    facts.insert("opacities".into(), json!(survey.opacities));
    facts.insert("invisible".into(), json!(survey.invisible));
    facts.insert("broken".into(), json!(set.broken.all()));
    facts.insert("attributes".into(), json!(["position", "covariance", "opacity", "color"]));
    stand(&mut facts, set.about.orientation);
    facts.insert("bounds".into(), bounds(set.bounds()));
    facts
}

/// Adds the direction that is up, if the file says so.
fn stand(facts: &mut Map<String, Value>, orientation: Option<Orientation>) {
    if let Some(orientation) = orientation {
        facts.insert("up".into(), up(&orientation));
    }
}

/// Returns the direction that is up: X, Y, Z, -X, …
fn up(orientation: &Orientation) -> Value {
    json!(direction_name(orientation.up).trim_start_matches('+'))
}

fn bounds(Bounds { min, max }: Bounds) -> Value {
    json!({ "min": min.to_array(), "max": max.to_array() })
}
