//! What files hold, and whether they are sound.

use crate::{
    errors::raise,
    load::{Input, Load},
    worker::run,
};
use pyo3::prelude::*;
use serde_json::{Map, Value, json};
use splatkit::{
    Deadline, Error, Stop,
    about::{About, Frame, Modality, Stance},
    bricks::{self, Bricks},
    cells::{CellKind, Cells, Place},
    container::{Finding, Severity},
    formats::{self, Array, FORMATS, Kind, Series},
    gaussians::Gaussians,
    glam::DVec3,
    hierarchy::{Hierarchy, file},
    input::Source,
    math::Bounds,
    scattered::Points,
    surface::{Mesh, SurfelOptions},
    volume::Volume,
};
use std::path::{Path, PathBuf};

type Facts = Map<String, Value>;

/// Returns the facts of a file as JSON: those of the command's `info --json`.
#[pyfunction]
pub fn info(py: Python<'_>, path: PathBuf, load: &str) -> PyResult<String> {
    let load = Load::parse(load).map_err(|error| raise(py, &error))?;
    run(py, &Stop::default(), move || Ok(Value::Object(facts(&path, &load)?).to_string()))
}

/// Returns the findings in a file as JSON: those of the command's `check --json`.
#[pyfunction]
pub fn check(py: Python<'_>, path: PathBuf, load: &str) -> PyResult<String> {
    let load = Load::parse(load).map_err(|error| raise(py, &error))?;
    run(py, &Stop::default(), move || {
        let findings = findings(&path, &load)?;
        let ok = findings.iter().all(|finding| finding.severity != Severity::Error);
        let findings: Vec<_> = findings.iter().map(of_finding).collect();
        Ok(json!({ "ok": ok, "findings": findings }).to_string())
    })
}

/// Returns the formats that are read: name, extensions, and the extension that is written.
#[pyfunction]
pub fn known_formats() -> Vec<(&'static str, Vec<&'static str>, Option<&'static str>)> {
    let of = |format: &formats::Format| (format.name, format.extensions.to_vec(), format.written);
    FORMATS.iter().map(of).collect()
}

fn facts(path: &Path, load: &Load) -> Result<Facts, Error> {
    let limits = load.limits();
    let source = Source::open_any(path, &limits)?;
    let series = formats::series(&source, &load.read_options())?;
    let mut read = Vec::new();
    let input = load.open(path, None, &mut read)?;
    let bytes = size(path, &read)?;
    let (count, holes, mut facts) = match &input {
        Input::Mesh(mesh) => (mesh.positions.len(), mesh.about.holes, of_mesh(mesh)),
        Input::Volume(volume) => (volume.len(), volume.about.holes, of_volume(volume)),
        Input::Samples(points) => (points.len(), points.about.holes, of_samples(points)),
        Input::Cells(cells) => (cells.len(), cells.about.holes, of_cells(cells)),
        Input::Gaussians(set) => (set.len(), 0, of_gaussians(set)),
        Input::Hierarchy(own) => (own.header().source_points as usize, 0, of_hierarchy(own)),
        Input::Bricks(bricks) => (bricks.header().lattice.len(), 0, of_bricks(bricks)),
    };
    facts.insert("file".into(), json!(path.to_string_lossy()));
    if !series.is_empty() {
        facts.insert("series".into(), series.iter().map(of_series).collect());
    }
    facts.insert("count".into(), json!(count));
    facts.insert("bytes".into(), json!(bytes));
    facts.insert("bytes_per_point".into(), json!(bytes as f64 / count.max(1) as f64));
    if holes > 0 {
        facts.insert("missing".into(), json!(holes));
    }
    let is_whole = !matches!(input, Input::Gaussians(_) | Input::Hierarchy(_) | Input::Bricks(_));
    let arrays = match is_whole {
        true => formats::arrays(&source, &load.read_options())?,
        false => Vec::new(),
    };
    if !arrays.is_empty() {
        facts.insert("arrays".into(), arrays.iter().map(of_array).collect());
    }
    // The leaves of a hierarchy lie at different depths.
    if !matches!(input, Input::Hierarchy(_)) {
        facts.entry("levels").or_insert(json!(1));
    }
    Ok(facts)
}

/// Returns the bytes of a file, or of the files of a folder that were read.
fn size(path: &Path, read: &[PathBuf]) -> Result<u64, Error> {
    let of = |path: &Path| path.metadata().map_err(|e| Error::file(path, "read", e));
    if !path.is_dir() {
        return Ok(of(path)?.len());
    }
    let sizes: Result<Vec<u64>, Error> = read.iter().map(|path| Ok(of(path)?.len())).collect();
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

fn of_mesh(mesh: &Mesh) -> Facts {
    let mut facts = Facts::new();
    facts.insert("kind".into(), json!(if mesh.triangles.is_empty() { "cloud" } else { "mesh" }));
    facts.insert("triangles".into(), json!(mesh.triangles.len()));
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
    stand(&mut facts, mesh.about.stance);
    facts.insert("bounds".into(), bounds(mesh.bounds()));
    facts
}

fn of_volume(volume: &Volume) -> Facts {
    let mut facts = Facts::new();
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
fn say(facts: &mut Facts, about: &About) {
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
    texts(facts, [("value_unit", &about.unit), ("unit", &about.length)]);
}

/// Adds the texts that are not empty.
fn texts<const N: usize>(facts: &mut Facts, texts: [(&str, &String); N]) {
    for (name, text) in texts {
        if !text.is_empty() {
            facts.insert(name.into(), json!(text));
        }
    }
}

fn of_bricks(bricks: &Bricks) -> Facts {
    let header = bricks.header();
    let mut facts = Facts::new();
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
    facts.insert("bounds".into(), bounds_of(bricks.bounds()));
    facts
}

fn of_hierarchy(hierarchy: &Hierarchy) -> Facts {
    let header = hierarchy.header();
    let mut facts = Facts::new();
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
    texts(&mut facts, [("unit", &header.unit), ("source", &header.source)]);
    let attributes =
        present([("position", true), ("normal", header.has_normals), ("color", header.has_color)]);
    facts.insert("attributes".into(), attributes);
    facts.insert("bounds".into(), bounds_of(header.bounds));
    facts
}

fn of_samples(points: &Points) -> Facts {
    let mut facts = Facts::new();
    facts.insert("kind".into(), json!("samples"));
    facts.insert("range".into(), json!(points.range()));
    let attributes = present([
        ("position", true),
        ("value", true),
        ("radius", !points.radii.is_empty()),
        ("covariance", !points.covariances.is_empty()),
    ]);
    facts.insert("attributes".into(), attributes);
    stand(&mut facts, points.about.stance);
    facts.insert("bounds".into(), bounds(Some(points.bounds())));
    facts
}

fn of_cells(cells: &Cells) -> Facts {
    let count = |kind: CellKind| cells.kinds.iter().filter(|own| **own == kind).count();
    let kinds = CellKind::ALL.into_iter().map(|kind| (kind, count(kind)));
    let kinds = kinds.filter(|(_, count)| *count > 0);
    let kinds = kinds.map(|(kind, count)| (kind.name().to_owned(), json!(count)));
    let place = if cells.place == Place::Points { "points" } else { "cells" };
    let mut facts = Facts::new();
    facts.insert("kind".into(), json!("cells"));
    facts.insert("points".into(), json!(cells.points.len()));
    facts.insert("cells".into(), Value::Object(kinds.collect()));
    facts.insert("range".into(), json!(cells.range()));
    facts.insert("attributes".into(), json!(["position", format!("value of {place}")]));
    stand(&mut facts, cells.about.stance);
    facts.insert("bounds".into(), bounds(Some(cells.bounds())));
    facts
}

fn of_gaussians(set: &Gaussians) -> Facts {
    let survey = set.survey();
    let mut facts = Facts::new();
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
fn stand(facts: &mut Facts, stance: Option<Stance>) {
    if let Some(stance) = stance {
        facts.insert("up".into(), up(&stance));
    }
}

/// Returns the direction that is up: X, Y, Z, -X, …
fn up(stance: &Stance) -> Value {
    for (axis, name) in DVec3::AXES.into_iter().zip(["X", "Y", "Z"]) {
        for (sign, prefix) in [(1.0, ""), (-1.0, "-")] {
            if stance.up == sign * axis {
                return json!(format!("{prefix}{name}"));
            }
        }
    }
    let [x, y, z] = stance.up.to_array();
    json!(format!("{x:.3},{y:.3},{z:.3}"))
}

fn bounds(bounds: Option<[DVec3; 2]>) -> Value {
    bounds.map_or(Value::Null, |[min, max]| json!({ "min": min.to_array(), "max": max.to_array() }))
}

fn bounds_of(own: Bounds) -> Value {
    bounds(Some([own.min, own.max]))
}

fn findings(path: &Path, load: &Load) -> Result<Vec<Finding>, Error> {
    let limits = load.limits();
    let deadline = limits.deadline();
    Ok(match load.kind(path)? {
        Kind::Hierarchy => file::check(path, &limits).findings,
        Kind::Bricks => bricks::check(path, &limits, None).findings,
        _ => match load.open(path, None, &mut Vec::new())? {
            Input::Mesh(mesh) => in_mesh(&mesh, deadline).map_err(|error| error.in_file(path))?,
            Input::Gaussians(set) => in_gaussians(&set),
            // Errors in other inputs are reported when they are read.
            _ => Vec::new(),
        },
    })
}

fn of_finding(finding: &Finding) -> Value {
    let severity = if finding.severity == Severity::Error { "error" } else { "warning" };
    json!({
        "code": finding.code,
        "severity": severity,
        "where": finding.place,
        "message": finding.message,
    })
}

/// Returns a warning if something was found.
fn warning(code: &'static str, place: &str, found: Option<String>) -> Option<Finding> {
    let (severity, place) = (Severity::Warning, place.to_owned());
    found.map(|message| Finding { code, severity, place, message })
}

/// Returns the oddities of trained Gaussians.
fn in_gaussians(set: &Gaussians) -> Vec<Finding> {
    let (survey, all) = (set.survey(), set.len() as u64 + set.broken.all());
    let of = |count: u64, what: &str| (count > 0).then(|| format!("{count} of {all} {what}"));
    let found = [
        ("not-finite", of(set.broken.not_finite, "have numbers that are not finite; left out")),
        ("no-rotation", of(set.broken.without_rotation, "have a zero quaternion; left out")),
        ("invisible", of(survey.invisible, "cover less than 1/255 of any pixel")),
        ("needles", of(survey.needles, "are at least 25 times as long as they are wide")),
    ];
    found.into_iter().filter_map(|(code, found)| warning(code, "Gaussians", found)).collect()
}

/// Returns findings on a mesh or point cloud: parts that draw nothing, or that are drawn
/// differently than meant.
fn in_mesh(mesh: &Mesh, deadline: Deadline) -> Result<Vec<Finding>, Error> {
    let survey = mesh.survey();
    let (points, triangles) = (mesh.positions.len(), mesh.triangles.len());
    let of = |count: usize, all: usize, what: &str| {
        (count > 0).then(|| format!("{count} of {all} {what}"))
    };
    let open = "the surface has borders; its back is visible through them";
    let open = (triangles > 0 && !mesh.is_closed()).then(|| open.to_owned());
    let found = [
        ("not-finite", "positions", of(survey.not_finite, points, "are not finite")),
        (
            "duplicates",
            "positions",
            of(survey.duplicates, points, "lie at the position of another"),
        ),
        ("no-area", "triangles", of(survey.without_area, triangles, "have no area")),
        ("unused", "positions", of(survey.unused, points, "belong to no triangle")),
        ("open", "triangles", open),
    ];
    let found = found.into_iter().filter_map(|(code, place, found)| warning(code, place, found));
    let mut findings: Vec<Finding> = found.collect();
    match mesh.surfels(&SurfelOptions { deadline, ..SurfelOptions::default() }) {
        // These errors say nothing about the file.
        Err(error @ (Error::Timeout { .. } | Error::Memory { .. })) => return Err(error),
        Err(error) => findings.push(Finding::error("nothing", "content", error.to_string())),
        Ok(_) => {}
    }
    Ok(findings)
}
