//! `splatkit info`.

use crate::{
    arrays,
    failure::Failure,
    given::{Given, kinds_of},
    load::LoadFlags,
    output, parse,
    progress::Progress,
    scene_file,
    terminal::safe,
};
use clap::Args;
use serde_json::Value;
use splatkit::{formats::Series, memory, session::Facts};
use std::path::PathBuf;

/// The facts in the order in which they are printed. Any others follow.
const ORDER: &[&str] = &[
    "file",
    "kind",
    "count",
    "triangles",
    "lines",
    "points",
    "cells",
    "faces",
    "dims",
    "spacing",
    "times",
    "time",
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
        let reading = self.load.reading(memory::most());
        let opened = reading.open(&self.file)?;
        let input = opened.read()?;
        progress.clear();
        let kinds = kinds_of(&input, opened.is_raw());
        given.warn_of_file(&self.file, kinds, progress);
        let facts = opened.facts(&input)?;
        if self.json {
            return output::json(&Value::Object(facts.to_json()));
        }
        let Facts { named, series, arrays } = facts;
        series.iter().try_for_each(|one| output::line(line_of_series(one)))?;
        let is_other = |name: &&str| !ORDER.contains(name);
        let others = named.keys().map(String::as_str).filter(is_other);
        for name in ORDER.iter().copied().chain(others) {
            if let Some(value) = named.get(name) {
                output::line(format_args!("{:<16}{}", name.replace('_', " "), plain(value)))?;
            }
        }
        arrays::print(&arrays)
    }
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
