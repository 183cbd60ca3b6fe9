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
use serde_json::{Value, json};
use splatkit::{edit::Statistics, formats::Series, memory, session::Facts};
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
    /// Also print the range, the mean, the standard deviation and a histogram of every value: of
    /// coordinates, attributes, colours, opacities and scales.
    #[arg(long)]
    stats: bool,
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
        let statistics = match self.stats {
            true => {
                progress.stage("Measuring values");
                Some(opened.statistics(input)?)
            }
            false => None,
        };
        progress.clear();
        if self.json {
            let mut facts = facts.to_json();
            if let Some(statistics) = &statistics {
                facts.insert("stats".into(), statistics.iter().map(of_statistics).collect());
            }
            return output::json(&Value::Object(facts));
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
        arrays::print(&arrays)?;
        statistics.map_or(Ok(()), |statistics| print_statistics(&statistics))
    }
}

fn of_statistics(of: &Statistics) -> Value {
    json!({
        "name": of.name,
        "count": of.count,
        "missing": of.missing,
        "range": of.range,
        "mean": of.mean,
        "deviation": of.deviation,
        "histogram": of.histogram,
    })
}

/// Prints a table with a row for each name.
fn print_statistics(all: &[Statistics]) -> Result<(), Failure> {
    output::line(format_args!(
        "{:<20}{:>14}{:>14}{:>14}{:>14}  histogram",
        "values", "least", "greatest", "mean", "deviation"
    ))?;
    for of in all {
        let name = safe(&of.name);
        let Some([low, high]) = of.range else {
            output::line(format_args!("{name:<20}all {} are missing", of.missing))?;
            continue;
        };
        let numbers =
            [low, high, of.mean, of.deviation].map(|number| format!("{:>14}", short(number)));
        let missing = match of.missing {
            0 => String::new(),
            missing => format!("  {missing} missing"),
        };
        let (numbers, bars) = (numbers.concat(), bars(&of.histogram));
        output::line(format_args!("{name:<20}{numbers}  {bars}{missing}"))?;
    }
    Ok(())
}

/// Returns a number with about seven digits.
fn short(number: f64) -> String {
    let digits = number.abs().max(1e-300).log10().floor();
    match digits {
        _ if number == 0.0 => "0".into(),
        -4.0..9.0 => {
            let places = (6.0 - digits).clamp(0.0, 9.0) as usize;
            let text = format!("{number:.places$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => text,
            }
        }
        _ => format!("{number:.5e}"),
    }
}

/// Returns bars as high as the square roots of counts, so that small ones show.
fn bars(histogram: &[u64]) -> String {
    const BARS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let most = histogram.iter().copied().max().unwrap_or(0).max(1) as f64;
    let bar = |count: &u64| BARS[(8.0 * (*count as f64 / most).sqrt()).ceil() as usize];
    histogram.iter().map(bar).collect()
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
