//! Tables of figures, as Markdown and as JSON, and the block of a document that contains them.

use serde_json::{Map, Value, json};
use splatkit::{
    Error, disk,
    input::{Limits, Source},
};
use splatkit_tools::{failure::Failure, output};
use std::path::{Path, PathBuf};

pub struct Report {
    pub adapter: String,
    pub tables: Vec<Table>,
}

pub struct Table {
    pub title: &'static str,
    /// What was measured, in a sentence or two.
    pub note: String,
    /// The first column names the rows.
    pub columns: Vec<String>,
    pub rows: Vec<(String, Vec<Cell>)>,
}

/// A figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A number, and how many digits to show behind the point.
    Number(f64, usize),
    Text(String),
    /// Not measured.
    None,
}

impl Cell {
    fn text(&self) -> String {
        match self {
            Self::Number(value, digits) => format!("{value:.digits$}"),
            // A vertical bar would begin another cell.
            Self::Text(text) => text.replace('|', "/"),
            Self::None => "–".into(),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Number(value, _) => json!(value),
            Self::Text(text) => json!(text),
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

    pub fn markdown(&self) -> String {
        let line = |cells: &mut dyn Iterator<Item = String>| {
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let rule = |at: usize| if at == 0 { "---".to_owned() } else { "---:".to_owned() };
        let mut text = format!("**{}** {}\n\n", self.title, self.note);
        text += &line(&mut self.columns.iter().cloned());
        text += &line(&mut (0..self.columns.len()).map(rule));
        for (name, cells) in &self.rows {
            text += &line(
                &mut std::iter::once(name.clone()).chain(cells.iter().map(|cell| cell.text())),
            );
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

    /// Returns a page of tables in which these tables replace those of the same titles, or follow
    /// at the end. The other tables stay.
    pub fn among(&self, page: &str) -> String {
        let title = |text: &str| {
            text.strip_prefix("**").and_then(|text| Some(text.split_once("**")?.0.to_owned()))
        };
        let mut parts: Vec<(Option<String>, String)> = Vec::new();
        for line in page.lines() {
            match (title(line), parts.last_mut()) {
                (None, Some((_, part))) => *part += &format!("{line}\n"),
                (heading, _) => parts.push((heading, format!("{line}\n"))),
            }
        }
        for table in &self.tables {
            let text = table.markdown();
            match parts.iter_mut().find(|(heading, _)| heading.as_deref() == Some(table.title)) {
                Some((_, part)) => *part = text,
                None => parts.push((Some(table.title.to_owned()), text)),
            }
        }
        parts
            .iter()
            .map(|(_, part)| format!("{}\n", part.trim_end()))
            .collect::<Vec<_>>()
            .join("\n")
    }

    pub fn json(&self) -> Value {
        let tables: Vec<_> = self.tables.iter().map(Table::json).collect();
        json!({ "adapter": self.adapter, "tables": tables })
    }
}

/// Largest size of a document, in bytes.
const MOST_BYTES: usize = 64 << 20;

/// The part of a document between two marks, which name the task that writes it.
pub struct Block {
    path: PathBuf,
    name: &'static str,
    start: String,
    end: String,
}

impl Block {
    /// Finds the marks and checks that the file can be written, before anything is measured.
    pub fn open(path: &Path, name: &'static str) -> Result<Self, Failure> {
        let start = format!("<!-- {name}: written by `splatkit-measure {name} --write` -->");
        let end = format!("<!-- end of {name} -->");
        let block = Self { path: path.to_owned(), name, start, end };
        block.parts()?;
        output::try_writing(path, &[])?;
        Ok(block)
    }

    /// Returns the text between the marks.
    pub fn inside(&self) -> Result<String, Failure> {
        let [_, inside, _] = self.parts()?;
        Ok(inside)
    }

    /// Replaces the block's text by a function of it. The file is read again, so that other edits
    /// made in the meantime stay.
    pub fn replace(&self, text: impl FnOnce(&str) -> String) -> Result<(), Failure> {
        let Self { path, start, end, .. } = self;
        let [before, inside, after] = self.parts()?;
        let text = text(&inside);
        Ok(disk::write(path, format!("{before}{start}\n\n{text}\n{end}{after}").as_bytes())?)
    }

    /// Returns the text before, between and after the marks.
    fn parts(&self) -> Result<[String; 3], Failure> {
        let Self { path, name, start, end } = self;
        let text = Source::open(path, &Limits::default())?.small_text("a document", MOST_BYTES)?;
        let missing =
            || Error::input(path, *name, format!("the lines “{start}” and “{end}” are missing"));
        let (before, rest) = text.split_once(start).ok_or_else(missing)?;
        let (inside, after) = rest.split_once(end).ok_or_else(missing)?;
        Ok([before, inside.trim(), after].map(str::to_owned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_markdown_and_json() {
        let mut table = Table::new("A", "b.", &["case", "x", "y"]);
        table.row("one", vec![Cell::Number(1.25, 1), Cell::None]);
        assert_eq!(
            table.markdown(),
            "**A** b.\n\n| case | x | y |\n| --- | ---: | ---: |\n| one | 1.2 | – |\n"
        );
        assert_eq!(table.json()["rows"][0], json!({ "name": "one", "x": 1.25, "y": null }));
    }

    #[test]
    fn tables_that_are_not_measured_stay() {
        let table = |title, value| {
            let mut table = Table::new(title, "b.", &["case", "x"]);
            table.row("one", vec![Cell::Number(value, 0)]);
            table
        };
        let report = |tables| Report { adapter: String::new(), tables };
        let all = report(vec![table("A", 1.0), table("B", 2.0)]);
        let page = all.markdown();
        assert_eq!(all.among(&page), page);
        let some = report(vec![table("A", 3.0)]).among(page.trim());
        assert_eq!(some, report(vec![table("A", 3.0), table("B", 2.0)]).markdown());
        assert_eq!(
            report(vec![table("C", 4.0)]).among(&some),
            some + "\n" + &table("C", 4.0).markdown()
        );
        assert_eq!(all.among(""), page);
    }

    #[test]
    fn what_is_edited_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.md");
        let page = |before: &str, inside: &str| {
            format!(
                "{before}\n<!-- a: written by `splatkit-measure a --write` -->\n\n{inside}\n\
                 <!-- end of a -->\nafter\n"
            )
        };
        std::fs::write(&path, page("before", "old")).unwrap();
        let block = Block::open(&path, "a").unwrap();
        std::fs::write(&path, page("edited", "newer")).unwrap();
        block.replace(|inside| format!("{inside} and new")).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), page("edited", "newer and new"));
        // Without its marks there is no place for the tables.
        std::fs::write(&path, "other").unwrap();
        assert!(block.replace(str::to_owned).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "other");
    }
}
