//! `splatkit info`.

use crate::{
    arrays,
    camera::direction_name,
    failure::Failure,
    given::{Given, kinds_of},
    load::{Input, LoadFlags},
    output, parse,
    progress::Progress,
    scene_file,
    terminal::safe,
};
use clap::Args;
use serde_json::{Map, Value, json};
use splatkit::{
    Error,
    about::{About, Frame, Modality, Stance},
    bricks::Bricks,
    cells::{CellKind, Cells, Place},
    formats::{self, Series},
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    input::{self, Source},
    math::Bounds,
    memory,
    scattered::Points,
    surface::Mesh,
    volume::Volume,
};
use std::path::{Path, PathBuf};

/// The facts in the order in which they are printed. Any others follow.
const ORDER: &[&str] = &[
    "file",
    "kind",
    "count",
    "triangles",
    "points",
    "cells",
    "dims",
    "spacing",
    "type",
    "range",
    "degree",
    "scales",
    "opacities",
    "invisible",
    "broken",
    "missing",
    "modality",
    "window",
    "value_unit",
    "bounds",
    "attributes",
    "labels",
    "color_by",
    "layout",
    "crs",
    "materials",
    "textures",
    "splats",
    "nodes",
    "levels",
    "bricks",
    "blocks",
    "pages",
    "closed",
    "lossless",
    "up",
    "up_from",
    "frame",
    "unit",
    "source",
    "bytes",
    "bytes_per_point",
];

#[derive(Args, Debug)]
pub struct Info {
    /// A mesh, point cloud, hierarchy, volume, volume in bricks, cells, trained Gaussians, or a set
    /// of scattered samples; or a folder of DICOM files. Or an address (docs/remote.md).
    #[arg(value_parser = parse::input())]
    file: PathBuf,
    /// Print the facts as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    load: LoadFlags,
}

impl Info {
    pub fn run(mut self, given: &Given, progress: &Progress) -> Result<(), Failure> {
        scene_file::refuse(&self.file)?;
        self.load = self.load.begun();
        progress.stage(format!("Reading {}", self.file.display()));
        let series = self.series()?;
        let mut read = Vec::new();
        let input = self.load.open_within(&self.file, memory::most(), &mut read)?;
        progress.clear();
        let kinds = kinds_of(&input, self.load.is_raw(&self.file)?);
        given.warn_of_file(&self.file, kinds, progress);
        let bytes = size(&self.file, &read)?;
        let (count, mut facts) = match &input {
            Input::Mesh(mesh) => (mesh.positions.len(), of_mesh(mesh)),
            Input::Volume(volume) => (volume.len(), of_volume(volume)),
            Input::Samples(points) => (points.len(), of_samples(points)),
            Input::Cells(cells) => (cells.len(), of_cells(cells)),
            Input::Gaussians(set) => (set.len(), of_gaussians(set)),
            Input::Hierarchy(hierarchy) => {
                (hierarchy.header().source_points as usize, of_hierarchy(hierarchy))
            }
            Input::Bricks(bricks) => (bricks.header().lattice.len(), of_bricks(bricks)),
        };
        facts.insert("file".into(), json!(self.file.to_string_lossy()));
        if !series.is_empty() {
            facts.insert("series".into(), series.iter().map(of_series).collect());
        }
        facts.insert("count".into(), json!(count));
        facts.insert("bytes".into(), json!(bytes));
        facts.insert("bytes_per_point".into(), json!(bytes as f64 / count.max(1) as f64));
        if holes(&input) > 0 {
            facts.insert("missing".into(), json!(holes(&input)));
        }
        let arrays = match &input {
            Input::Gaussians(_) | Input::Hierarchy(_) | Input::Bricks(_) => Vec::new(),
            _ => self.load.arrays(&self.file)?,
        };
        // Bricks state their own levels. The leaves of a hierarchy lie at different depths.
        if !matches!(input, Input::Hierarchy(_)) {
            facts.entry("levels").or_insert(json!(1));
        }
        if self.json {
            if !arrays.is_empty() {
                facts.insert("arrays".into(), arrays::facts(&arrays));
            }
            return output::json(&Value::Object(facts));
        }
        series.iter().try_for_each(|one| output::line(line_of_series(one)))?;
        // The series are printed already.
        let is_other = |name: &&str| !ORDER.contains(name) && *name != "series";
        let others = facts.keys().map(String::as_str).filter(is_other);
        for name in ORDER.iter().copied().chain(others) {
            if let Some(value) = facts.get(name) {
                output::line(format_args!("{:<16}{}", name.replace('_', " "), plain(value)))?;
            }
        }
        arrays::print(&arrays)
    }
}

impl Info {
    /// Returns the series of a folder of pictures; none for other inputs.
    fn series(&self) -> Result<Vec<Series>, Failure> {
        if input::is_remote(&self.file) {
            return Ok(Vec::new());
        }
        let limits = self.load.limits();
        let source = Source::open_any(&self.file, &limits)?;
        Ok(formats::series(&source, &self.load.options())?)
    }
}

/// Returns the bytes of a file, or of the files of a folder that were read.
fn size(path: &Path, read: &[PathBuf]) -> Result<u64, Failure> {
    if !path.is_dir() {
        return Ok(input::size(path)?);
    }
    let sizes: Result<Vec<u64>, Error> = read.iter().map(input::size).collect();
    Ok(sizes?.into_iter().sum())
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

/// Returns a line on a series: its number, what it is, its pictures, and its identifier.
fn line_of_series(series: &Series) -> String {
    let number = series.number.map_or("–".into(), |number| number.to_string());
    let [columns, rows] = series.size;
    let drawn = if series.is_drawn { ", drawn" } else { "" };
    let obstacle = series.obstacle.as_ref().map_or(String::new(), |why| format!(", {}", safe(why)));
    format!(
        "series {number:<9}{} “{}”, {} of {columns} × {rows}, {}{drawn}{obstacle}",
        safe(&series.modality),
        safe(&series.description),
        series.pictures,
        safe(&series.identifier)
    )
}

/// Returns the number of values that are missing.
fn holes(input: &Input) -> u64 {
    match input {
        Input::Mesh(mesh) => mesh.about.holes,
        Input::Volume(volume) => volume.about.holes,
        Input::Samples(points) => points.about.holes,
        Input::Cells(cells) => cells.about.holes,
        Input::Gaussians(_) | Input::Hierarchy(_) | Input::Bricks(_) => 0,
    }
}

fn of_mesh(mesh: &Mesh) -> Map<String, Value> {
    let attributes: Vec<&str> = [
        ("position", true),
        ("normal", !mesh.normals.is_empty()),
        ("color", !mesh.colors.is_empty()),
        ("uv", !mesh.uvs.is_empty()),
    ]
    .into_iter()
    .filter_map(|(name, present)| present.then_some(name))
    .collect();
    let mut facts = Map::new();
    facts.insert("kind".into(), json!(if mesh.triangles.is_empty() { "cloud" } else { "mesh" }));
    facts.insert("triangles".into(), json!(mesh.triangles.len()));
    facts.insert("attributes".into(), json!(attributes));
    facts.insert("materials".into(), json!(mesh.materials.len()));
    facts.insert(
        "textures".into(),
        json!(mesh.materials.iter().filter(|m| m.texture.is_some()).count()),
    );
    let about = &mesh.about;
    if !about.attributes.is_empty() {
        facts.insert("color_by".into(), json!(about.attributes));
    }
    for (name, text) in [("layout", &about.layout), ("crs", &about.crs)] {
        if !text.is_empty() {
            facts.insert(name.into(), json!(text));
        }
    }
    stand(&mut facts, mesh.about.stance);
    facts.insert("bounds".into(), bounds(mesh.bounds()));
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
    stand(&mut facts, volume.about.stance);
    say(&mut facts, &volume.about);
    if let Some(labels) = &volume.about.labels {
        facts.insert("labels".into(), json!(labels.listed()));
    }
    facts.insert("bounds".into(), bounds(Some(volume.bounds())));
    facts
}

/// Adds what the file says of its values and lengths.
fn say(facts: &mut Map<String, Value>, about: &About) {
    let modality = about.modality.and_then(|modality| match modality {
        Modality::Ct => Some("CT"),
        Modality::Mr => Some("MR"),
        Modality::Emission => Some("emission tomography"),
        Modality::Ultrasound => Some("ultrasound"),
        Modality::Microscopy => Some("microscopy"),
        _ => None,
    });
    if let Some(modality) = modality {
        facts.insert("modality".into(), json!(modality));
    }
    if about.frame == Frame::Patient {
        facts.insert("frame".into(), json!("RAS"));
    }
    if let Some(window) = about.window {
        facts.insert("window".into(), json!(window));
    }
    for (name, text) in [("value_unit", &about.unit), ("unit", &about.length)] {
        if !text.is_empty() {
            facts.insert(name.into(), json!(text));
        }
    }
}

fn of_bricks(bricks: &Bricks) -> Map<String, Value> {
    let header = bricks.header();
    let bounds_of = bricks.bounds();
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("volume in bricks"));
    facts.insert("dims".into(), json!(header.lattice.dims));
    facts.insert("spacing".into(), json!(header.lattice.spacing().to_array()));
    facts.insert("type".into(), json!(header.scalar.name()));
    facts.insert("range".into(), json!(header.range));
    facts.insert("levels".into(), json!(bricks.levels().len()));
    facts.insert(
        "bricks".into(),
        json!(bricks.levels().iter().map(|level| level.bricks()).sum::<usize>()),
    );
    for (name, text) in [("unit", &header.unit), ("source", &header.source)] {
        if !text.is_empty() {
            facts.insert(name.into(), json!(text));
        }
    }
    facts.insert("attributes".into(), json!(["value"]));
    facts.insert("bounds".into(), bounds(Some([bounds_of.min, bounds_of.max])));
    facts
}

fn of_hierarchy(hierarchy: &Hierarchy) -> Map<String, Value> {
    let header = hierarchy.header();
    let attributes: Vec<&str> =
        [("position", true), ("normal", header.has_normals), ("color", header.has_color)]
            .into_iter()
            .filter_map(|(name, present)| present.then_some(name))
            .collect();
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
    facts.insert("up".into(), header.stance.map_or(Value::Null, |stance| up(&stance)));
    if header.is_guessed {
        facts.insert("up_from".into(), json!("guess"));
    }
    for (name, text) in [("unit", &header.unit), ("source", &header.source)] {
        if !text.is_empty() {
            facts.insert(name.into(), json!(text));
        }
    }
    facts.insert("attributes".into(), json!(attributes));
    facts.insert("bounds".into(), bounds(Some([header.bounds.min, header.bounds.max])));
    facts
}

fn of_samples(points: &Points) -> Map<String, Value> {
    let attributes: Vec<&str> = [
        ("position", true),
        ("value", true),
        ("radius", !points.radii.is_empty()),
        ("covariance", !points.covariances.is_empty()),
    ]
    .into_iter()
    .filter_map(|(name, present)| present.then_some(name))
    .collect();
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("samples"));
    facts.insert("range".into(), json!(points.range()));
    facts.insert("attributes".into(), json!(attributes));
    stand(&mut facts, points.about.stance);
    facts.insert("bounds".into(), bounds(Some(points.bounds())));
    facts
}

fn of_cells(cells: &Cells) -> Map<String, Value> {
    let count = |kind: CellKind| cells.kinds.iter().filter(|own| **own == kind).count();
    let kinds = CellKind::ALL.into_iter().map(|kind| (kind, count(kind)));
    let kinds = kinds.filter(|(_, count)| *count > 0);
    let kinds = kinds.map(|(kind, count)| (kind.name().to_owned(), json!(count)));
    let place = if cells.place == Place::Points { "points" } else { "cells" };
    let mut facts = Map::new();
    facts.insert("kind".into(), json!("cells"));
    facts.insert("points".into(), json!(cells.points.len()));
    facts.insert("cells".into(), Value::Object(kinds.collect()));
    facts.insert("range".into(), json!(cells.range()));
    facts.insert("attributes".into(), json!(["position", format!("value of {place}")]));
    stand(&mut facts, cells.about.stance);
    facts.insert("bounds".into(), bounds(Some(cells.bounds())));
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
    stand(&mut facts, set.about.stance);
    facts.insert("bounds".into(), bounds_of(set.bounds()));
    facts
}

/// Adds the direction that is up, if the file says so.
fn stand(facts: &mut Map<String, Value>, stance: Option<Stance>) {
    if let Some(stance) = stance {
        facts.insert("up".into(), up(&stance));
    }
}

/// Returns the direction that is up: X, Y, Z, -X, …
fn up(stance: &Stance) -> Value {
    json!(direction_name(stance.up).trim_start_matches('+'))
}

fn bounds(bounds: Option<[glam::DVec3; 2]>) -> Value {
    bounds.map_or(Value::Null, |[min, max]| json!({ "min": min.to_array(), "max": max.to_array() }))
}

fn bounds_of(own: Bounds) -> Value {
    bounds(Some([own.min, own.max]))
}

/// Returns a value as readable text.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => safe(text).into_owned(),
        Value::Array(values) => values.iter().map(plain).collect::<Vec<_>>().join(", "),
        Value::Object(map) => map
            .iter()
            .map(|(name, value)| format!("{name} {}", plain(value)))
            .collect::<Vec<_>>()
            .join("; "),
        Value::Number(number) => match number.as_f64().filter(|_| number.is_f64()) {
            Some(float) => format!("{}", (float * 1e6).round() / 1e6),
            None => number.to_string(),
        },
        other => other.to_string(),
    }
}
