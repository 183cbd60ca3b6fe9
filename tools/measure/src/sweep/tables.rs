//! Measurements as Markdown and as JSON.

use super::{
    measure::{Measured, Outcome, compared},
    ratio::Ratio,
};
use crate::report::{Cell, Table};
use serde_json::{Value, json};

/// An axis and its steps.
pub struct Chapter {
    pub name: String,
    pub title: &'static str,
    pub note: &'static str,
    pub outcomes: Vec<Outcome>,
}

const COLUMNS: [&str; 15] = [
    "step",
    "beside",
    "picture",
    "pixels",
    "M on rays",
    "k in view",
    "gathered",
    "splats",
    "entries",
    "frame ms: least",
    "median",
    "time ×",
    "asked ×",
    "beyond ×",
    "",
];

/// The mark of a step that costs more than is explained.
const CLIFF: &str = "cliff";

impl Chapter {
    pub fn markdown(&self) -> String {
        let mut table = Table::new(self.title, self.note, &COLUMNS);
        for outcome in &self.outcomes {
            if let Ok(measured) = &outcome.result {
                table.row(&outcome.name, cells(measured, compared(&self.outcomes, outcome)));
            }
        }
        let mut text = table.markdown();
        for Outcome { name, result, .. } in &self.outcomes {
            if let Err(error) = result {
                text += &format!("\n{name}: not drawn: {error}\n");
            }
        }
        text
    }

    pub fn json(&self) -> Value {
        let steps: Value = self.outcomes.iter().map(|outcome| self.step(outcome)).collect();
        json!({ "name": self.name, "steps": steps })
    }

    /// Returns the cliffs, each with its excess cost.
    pub fn cliffs(&self) -> impl Iterator<Item = (f64, String)> {
        self.outcomes.iter().filter_map(|outcome| {
            let (beside, ratio) = compared(&self.outcomes, outcome)?;
            let times = ratio.time.max(1.0 / ratio.time);
            // The more expensive one first.
            let [dear, cheap] = if ratio.time > 1.0 {
                [&outcome.name, &beside.name]
            } else {
                [&beside.name, &outcome.name]
            };
            let (name, asked, beyond) = (&self.name, ratio.asked, ratio.beyond());
            ratio.is_cliff().then(|| {
                let text = format!(
                    "{name}: “{dear}” costs {times:.1} times as much as “{cheap}” and asks for \
                     {asked:.1} times as much: {beyond:.1} times what is explained."
                );
                (beyond, text)
            })
        })
    }

    fn step(&self, outcome: &Outcome) -> Value {
        let Outcome { name, result, .. } = outcome;
        let Measured { size: [width, height], asked, times, stats } = match result {
            Ok(measured) => measured,
            Err(error) => return json!({ "name": name, "error": error.to_string() }),
        };
        let compared = compared(&self.outcomes, outcome);
        let ratio = compared.as_ref().map(|(_, ratio)| ratio);
        json!({
            "name": name,
            "beside": compared.as_ref().map(|(beside, _)| &beside.name),
            "width": width,
            "height": height,
            "pixels": asked.pixels,
            "on_rays": asked.on_rays,
            "in_view": asked.in_view,
            "gathered": stats.gathered,
            "splats": stats.splats,
            "entries": stats.entries,
            "frame_ms": times.json(),
            "time_ratio": ratio.map(|ratio| ratio.time),
            "asked_ratio": ratio.map(|ratio| ratio.asked),
            "beyond": ratio.map(|ratio| ratio.beyond()),
            "cliff": ratio.is_some_and(|ratio| ratio.is_cliff()),
        })
    }
}

fn cells(measured: &Measured, compared: Option<(&Outcome, Ratio)>) -> Vec<Cell> {
    let Measured { size: [width, height], asked, times, stats } = measured;
    let part = |part: f64, digits| if part > 0.0 { Cell::Number(part, digits) } else { Cell::None };
    let count = |count| part(count, 0);
    let mut cells = vec![
        compared.as_ref().map_or(Cell::None, |(beside, _)| Cell::Text(beside.name.clone())),
        Cell::Text(format!("{width}×{height}")),
        count(asked.pixels),
        part(asked.on_rays / 1e6, 3),
        part(asked.in_view / 1e3, 1),
        count(stats.gathered as f64),
        count(stats.splats as f64),
        count(stats.entries as f64),
        Cell::Number(times.min, 1),
        Cell::Number(times.median, 1),
    ];
    let Some((_, ratio)) = compared else {
        cells.extend([Cell::None, Cell::None, Cell::None, Cell::Text(String::new())]);
        return cells;
    };
    cells.extend([ratio.time, ratio.asked, ratio.beyond()].map(|number| Cell::Number(number, 2)));
    cells.push(Cell::Text(if ratio.is_cliff() { format!("**{CLIFF}**") } else { String::new() }));
    cells
}

/// Returns a list of all cliffs, the worst first.
pub fn cliffs(chapters: &[Chapter]) -> String {
    let mut cliffs: Vec<_> = chapters.iter().flat_map(Chapter::cliffs).collect();
    cliffs.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let lines: String = cliffs.iter().map(|(_, text)| format!("- {text}\n")).collect();
    if lines.is_empty() {
        return "**Cliffs.** None.\n".into();
    }
    format!("**Cliffs.** The worst first.\n\n{lines}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::asked::Asked;
    use splatkit::FrameStats;
    use splatkit_tools::timing::Times;

    fn outcome(name: &str, against: Option<usize>, ms: f64) -> Outcome {
        let asked = Asked { pixels: 100.0, on_rays: 1000.0, in_view: 10.0 };
        let measured = Measured {
            size: [9, 9],
            asked,
            times: Times::of(vec![ms]),
            stats: FrameStats::default(),
        };
        Outcome { name: name.into(), against, result: Ok(measured) }
    }

    #[test]
    fn cliffs_are_marked_and_listed() {
        let outcomes = vec![
            outcome("a", None, 10.0),
            outcome("b", Some(0), 30.0),
            outcome("c", Some(1), 5.0),
            outcome("d", Some(2), 6.0),
        ];
        let chapter = Chapter { name: "size".into(), title: "Size.", note: "", outcomes };
        let text = chapter.markdown();
        assert!(text.contains("| 30.0 | 30.0 | 3.00 | 1.00 | 3.00 | **cliff** |"), "{text}");
        assert!(
            text.contains(
                "| d | c | 9×9 | 100 | 0.001 | 0.0 | – | – | – | 6.0 | 6.0 | 1.20 | 1.00 | 1.20 \
                 |  |"
            ),
            "{text}"
        );
        assert_eq!(chapter.json()["steps"][2]["cliff"], true);
        let text = cliffs(&[chapter]);
        let at = |words: &str| text.find(words).unwrap();
        assert!(
            at("“b” costs 6.0 times as much as “c”") < at("“b” costs 3.0 times as much as “a”"),
            "{text}"
        );
        assert_eq!(cliffs(&[]), "**Cliffs.** None.\n");
    }

    #[test]
    fn steps_beside_one_that_is_not_drawn_are_not_compared() {
        let lost = Outcome {
            result: Err(splatkit::Error::Argument("no".into())),
            ..outcome("a", None, 1.0)
        };
        assert!(!lost.has_failed());
        let chapter = Chapter {
            name: "a".into(),
            title: "A.",
            note: "",
            outcomes: vec![lost, outcome("b", Some(0), 9.0)],
        };
        assert!(
            chapter.cliffs().next().is_none() && chapter.markdown().contains("a: not drawn: no")
        );
    }
}
