//! Measurements as Markdown and as JSON.

use super::{
    measure::{Measured, Outcome},
    series,
};
use crate::report::{Cell, Table};
use serde_json::{Value, json};
use splatkit_tools::timing;

/// A part of the suite and its cases.
pub struct Chapter {
    pub name: &'static str,
    pub title: &'static str,
    pub note: &'static str,
    pub outcomes: Vec<Outcome>,
}

/// The columns of all cases. Further columns are the classic table's numbers, and whether repeated
/// runs agreed.
const COLUMNS: [&str; 13] = [
    "case",
    "drawn",
    "picture",
    "effective splats",
    "splats in view",
    "hidden",
    "entries",
    "depth passes",
    "frame ms: median",
    "min–max",
    "fps",
    "M splats/s",
    "M entries/s",
];
const MEMORY: [&str; 2] = ["engine MiB", "process peak MiB"];
const GATHERED: [&str; 2] = ["gathered: median ms", "gathered: engine MiB"];

impl Chapter {
    pub fn markdown(&self) -> String {
        let tables = [self.cases(), self.passes()].map(|table| table.markdown());
        let mut text = tables.join("\n");
        for slope in series::slopes(self.measured()) {
            text += &format!("\n{slope}\n");
        }
        for Outcome { name, result } in &self.outcomes {
            if let Err(error) = result {
                text += &format!("\n{name}: not drawn: {error}\n");
            }
        }
        text
    }

    pub fn json(&self) -> Value {
        let cases: Value = self.outcomes.iter().map(case_json).collect();
        let slopes: Value = series::slopes(self.measured()).map(|slope| slope.json()).collect();
        json!({ "name": self.name, "cases": cases, "slopes": slopes })
    }

    fn measured(&self) -> impl Iterator<Item = &Measured> {
        self.outcomes.iter().filter_map(|outcome| outcome.result.as_ref().ok())
    }

    fn cases(&self) -> Table {
        let seeded = self.measured().any(|measured| measured.seed.is_some());
        let repeated = self.measured().any(|measured| measured.same_bytes.is_some());
        let gathered = self.measured().any(|measured| measured.gathered.is_some());
        let mut columns = COLUMNS.to_vec();
        columns.extend(MEMORY);
        if gathered {
            columns.extend(GATHERED);
        }
        if seeded {
            columns.extend(["seed's splats", "seed's fps"]);
        }
        if repeated {
            columns.push("same bytes");
        }
        let mut table = Table::new(self.title, self.note, &columns);
        for Outcome { name, result } in &self.outcomes {
            let Ok(measured) = result else { continue };
            let mut cells = cells(measured);
            if gathered {
                cells.extend(gathered_cells(measured));
            }
            if let Some(seed) = measured.seed {
                cells.extend([Cell::Number(seed.splats as f64, 0), Cell::Number(seed.fps, 2)]);
            }
            if let Some(same) = measured.same_bytes {
                cells.push(Cell::Text(if same { "yes" } else { "NO" }.into()));
            }
            table.row(name, cells);
        }
        table
    }

    fn passes(&self) -> Table {
        let mut names: Vec<&str> = Vec::new();
        let steps = |measured: &'_ Measured| {
            let gathered = measured.gathered.iter().flat_map(|gathered| &gathered.steps);
            measured.steps.iter().chain(gathered).map(|step| step.0).collect::<Vec<_>>()
        };
        for name in self.measured().flat_map(steps) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let columns: Vec<_> = std::iter::once("case").chain(names.iter().copied()).collect();
        let mut table = Table::new("Passes.", "Milliseconds of each in a frame.", &columns);
        for Outcome { name, result } in &self.outcomes {
            let Ok(measured) = result else { continue };
            table.row(name, step_cells(&names, &measured.steps));
            if let Some(gathered) = &measured.gathered {
                table.row(format!("{name}, gathered"), step_cells(&names, &gathered.steps));
            }
        }
        table
    }
}

/// The time of each named step in milliseconds.
fn step_cells(names: &[&str], steps: &[(&'static str, f64)]) -> Vec<Cell> {
    let cell = |name: &&str| {
        let step = steps.iter().find(|step| step.0 == *name);
        step.map_or(Cell::None, |step| Cell::Number(step.1, 1))
    };
    names.iter().map(cell).collect()
}

fn gathered_cells(measured: &Measured) -> [Cell; 2] {
    let Some(gathered) = &measured.gathered else { return [Cell::None, Cell::None] };
    [Cell::Number(gathered.times.median, 1), Cell::Number((gathered.bytes >> 20) as f64, 0)]
}

fn cells(measured: &Measured) -> Vec<Cell> {
    let Measured { drawn, size: [width, height], times, stats, .. } = measured;
    let count = |count: u64| Cell::Number(count as f64, 0);
    let mebibytes = |bytes: u64| count(bytes >> 20);
    vec![
        Cell::Text(drawn.clone()),
        Cell::Text(format!("{width}×{height}")),
        count(measured.effective),
        count(stats.splats),
        count(stats.hidden),
        count(stats.entries),
        count(u64::from(stats.passes)),
        Cell::Number(times.median, 1),
        Cell::Text(format!("{:.1}–{:.1}", times.min, times.max)),
        Cell::Number(measured.fps(), 2),
        Cell::Number(measured.per_second(stats.splats) / 1e6, 2),
        Cell::Number(measured.per_second(stats.entries) / 1e6, 2),
        mebibytes(stats.gpu_bytes),
        measured.cpu_peak.map_or(Cell::None, mebibytes),
    ]
}

fn case_json(Outcome { name, result }: &Outcome) -> Value {
    let measured = match result {
        Ok(measured) => measured,
        Err(error) => return json!({ "name": name, "error": error.to_string() }),
    };
    let Measured {
        drawn,
        size: [width, height],
        effective,
        times,
        stats,
        cpu_peak,
        steps,
        gathered,
        same_bytes,
        ..
    } = measured;
    json!({
        "name": name,
        "drawn": drawn,
        "width": width,
        "height": height,
        "effective_splats": effective,
        "splats": stats.splats,
        "hidden": stats.hidden,
        "entries": stats.entries,
        "gathered": stats.gathered,
        "depth_passes": stats.passes,
        "frame_ms": times.json(),
        "fps": measured.fps(),
        "splats_per_second": measured.per_second(stats.splats),
        "entries_per_second": measured.per_second(stats.entries),
        "gpu_bytes": stats.gpu_bytes,
        "cpu_peak_bytes": cpu_peak,
        "passes": timing::steps(steps),
        "gathered_case": gathered.as_ref().map(|gathered| json!({
            "frame_ms": gathered.times.json(),
            "gpu_bytes": gathered.bytes,
            "passes": timing::steps(&gathered.steps),
        })),
        "same_bytes": same_bytes,
        "seed": measured.seed.map(|seed| json!({ "splats": seed.splats, "fps": seed.fps })),
    })
}
