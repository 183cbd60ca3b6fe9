//! Tables of figures, as Markdown and as JSON, and the block of a document that holds them.

use crate::{failure::Failure, output};
use serde_json::{Map, Value, json};
use splatkit::Error;
use std::path::{Path, PathBuf};

const START: &str = "<!-- figures: written by `splatkit figures --write` -->";
const END: &str = "<!-- end of figures -->";

pub struct Report {
    pub adapter: String,
    pub tables: Vec<Table>,
}

pub struct Table {
    pub title: &'static str,
    /// What was measured, in a sentence or two.
    pub note: String,
    /// The first names the rows.
    pub columns: Vec<String>,
    pub rows: Vec<(String, Vec<Cell>)>,
}

/// A figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// With so many digits behind the point.
    Number(f64, usize),
    /// Not measured.
    None,
}

impl Cell {
    fn text(self) -> String {
        match self {
            Self::Number(value, digits) => format!("{value:.digits$}"),
            Self::None => "–".into(),
        }
    }

    fn json(self) -> Value {
        match self {
            Self::Number(value, _) => json!(value),
            Self::None => Value::Null,
        }
    }
}

impl Table {
    pub fn new(title: &'static str, note: impl Into<String>, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|column| (*column).to_owned()).collect();
        Self { title, note: note.into(), columns, rows: Vec::new() }
    }

    pub fn row(&mut self, name: impl Into<String>, cells: Vec<Cell>) {
        self.rows.push((name.into(), cells));
    }

    fn markdown(&self) -> String {
        let line = |cells: &mut dyn Iterator<Item = String>| format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "));
        let rule = |at: usize| if at == 0 { "---".to_owned() } else { "---:".to_owned() };
        let mut text = format!("**{}** {}\n\n", self.title, self.note);
        text += &line(&mut self.columns.iter().cloned());
        text += &line(&mut (0..self.columns.len()).map(rule));
        for (name, cells) in &self.rows {
            text += &line(&mut std::iter::once(name.clone()).chain(cells.iter().map(|cell| cell.text())));
        }
        text
    }

    fn json(&self) -> Value {
        let rows = self.rows.iter().map(|(name, cells)| {
            let mut row = Map::new();
            row.insert("name".into(), json!(name));
            row.extend(self.columns[1..].iter().cloned().zip(cells.iter().map(|cell| cell.json())));
            Value::Object(row)
        });
        json!({ "title": self.title, "note": self.note, "rows": rows.collect::<Vec<_>>() })
    }
}

impl Report {
    pub fn markdown(&self) -> String {
        let tables: Vec<_> = self.tables.iter().map(Table::markdown).collect();
        tables.join("\n")
    }

    pub fn json(&self) -> Value {
        let tables: Vec<_> = self.tables.iter().map(Table::json).collect();
        json!({ "adapter": self.adapter, "tables": tables })
    }
}

/// The part of a document between the marks.
pub struct Block {
    path: PathBuf,
    before: String,
    after: String,
}

impl Block {
    /// Finds the marks, before anything is measured.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, "read", e))?;
        let missing = || Error::input(path, "figures", format!("there are no lines “{START}” and “{END}”"));
        let (before, rest) = text.split_once(START).ok_or_else(missing)?;
        let (_, after) = rest.split_once(END).ok_or_else(missing)?;
        Ok(Self { path: path.to_owned(), before: before.to_owned(), after: after.to_owned() })
    }

    pub fn replace(&self, text: &str) -> Result<(), Failure> {
        let Self { path, before, after } = self;
        output::write(path, format!("{before}{START}\n\n{text}\n{END}{after}").as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_markdown_and_json() {
        let mut table = Table::new("A", "b.", &["case", "x", "y"]);
        table.row("one", vec![Cell::Number(1.25, 1), Cell::None]);
        assert_eq!(table.markdown(), "**A** b.\n\n| case | x | y |\n| --- | ---: | ---: |\n| one | 1.2 | – |\n");
        assert_eq!(table.json()["rows"][0], json!({ "name": "one", "x": 1.25, "y": null }));
    }
}
