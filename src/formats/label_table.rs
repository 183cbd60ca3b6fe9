//! Tables of labels: their numbers, names and colours, as segmentation programs keep them in a text
//! file beside the volume.

use crate::{
    Result,
    about::Label,
    input::{Limits, Source},
};
use std::path::Path;

/// Most bytes of a table. A larger file is something else.
const MOST_BYTES: usize = 16 << 20;

/// Reads a table of labels. These are known:
///
/// - ITK-SNAP: `1 255 0 0 1 1 1 "Label 1"`: number, red, green, blue (0 … 255), opacity (0 … 1),
///   two switches of visibility, and the name in quotation marks.
/// - FreeSurfer and 3D Slicer: `2 Left-Cerebral-White-Matter 245 245 245 0`: number, name, red,
///   green, blue and a fourth number, which is not read: programs disagree on its meaning.
/// - Columns with a header, by tabs, commas or semicolons (BIDS): `index` or `label` or `value`;
///   `name` or `region` or `structure`; and `color` as `#rrggbb`, or `r`, `g`, `b`.
///
/// Lines that begin with # are comments.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a line that is in none of these forms;
/// [`Error::File`](crate::Error::File) and [`Error::Limit`](crate::Error::Limit) as for every
/// input.
pub fn read_labels(path: impl AsRef<Path>, limits: &Limits) -> Result<Vec<Label>> {
    let source = Source::open(path.as_ref(), limits)?;
    let text = source.small_text("a table of labels", MOST_BYTES)?;
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .zip(1..)
        .map(|(line, number): (&str, usize)| (line.trim(), number))
        .filter(|(line, _)| !line.is_empty() && !line.starts_with('#'))
        .peekable();
    let columns = lines.peek().and_then(|(line, _)| Columns::of(line));
    if columns.is_some() {
        lines.next();
    }
    let mut table = Vec::new();
    for (line, number) in lines {
        let label = match &columns {
            Some(columns) => columns.label(line),
            None => of_snap(line).or_else(|| of_surfer(line)),
        };
        table.push(label.ok_or_else(|| {
            let text: String = line.chars().take(60).collect();
            source.error(format!("line {number}"), format!("“{text}” is not a label")).hint(
                "a line holds a number, a name, and red, green and blue in 0 … 255, as \
                     FreeSurfer and ITK-SNAP write it, or columns below a header with index, name \
                     and color",
            )
        })?);
    }
    Ok(table)
}

/// Returns a colour of numbers in 0 … 255.
fn color(channels: [&str; 3]) -> Option<[f64; 3]> {
    let mut color = [0.0; 3];
    for (channel, text) in color.iter_mut().zip(channels) {
        *channel = f64::from(text.trim().parse::<u8>().ok()?) / 255.0;
    }
    Some(color)
}

/// A line of ITK-SNAP.
fn of_snap(line: &str) -> Option<Label> {
    let (numbers, rest) = line.split_once('"')?;
    let words: Vec<&str> = numbers.split_ascii_whitespace().collect();
    let [value, red, green, blue, opacity, ..] = words[..] else { return None };
    let opacity: f64 = opacity.parse().ok()?;
    let is_visible = words.get(5).is_none_or(|word| *word != "0");
    Some(Label {
        value: value.parse().ok()?,
        name: rest.split('"').next().unwrap_or_default().to_owned(),
        color: Some(color([red, green, blue])?),
        opacity: Some(if is_visible { opacity.clamp(0.0, 1.0) } else { 0.0 }),
    })
}

/// A line of FreeSurfer or 3D Slicer. A name may have spaces.
fn of_surfer(line: &str) -> Option<Label> {
    let (value, rest) = line.split_once(|c: char| c.is_ascii_whitespace())?;
    let words: Vec<&str> = rest.split_ascii_whitespace().collect();
    let count = words.len();
    let numbers = words.iter().rev().take_while(|word| word.parse::<f64>().is_ok()).count();
    // Without a fourth number, all three are colours.
    let first = count.checked_sub(numbers.min(4)).filter(|first| *first > 0 && numbers >= 3)?;
    Some(Label {
        value: value.parse().ok()?,
        name: words[..first].join(" ").trim_matches('"').to_owned(),
        color: Some(color([words[first], words[first + 1], words[first + 2]])?),
        opacity: None,
    })
}

/// The columns of a table with a header.
struct Columns {
    separator: char,
    value: usize,
    name: Option<usize>,
    color: Option<usize>,
    channels: Option<[usize; 3]>,
}

impl Columns {
    /// Returns the columns of a header; `None` for a line of numbers.
    fn of(line: &str) -> Option<Self> {
        let separator = ['\t', ',', ';'].into_iter().find(|c| line.contains(*c))?;
        let names: Vec<String> = line
            .split(separator)
            .map(|name| name.trim().trim_matches('"').to_ascii_lowercase())
            .collect();
        let find = |known: &[&str]| names.iter().position(|name| known.contains(&name.as_str()));
        let channels = [&["r", "red"], &["g", "green"], &["b", "blue"]].map(|names| find(names));
        Some(Self {
            separator,
            value: find(&["index", "label", "value", "id", "labelvalue"])?,
            name: find(&["name", "region", "structure", "label_name", "abbreviation"]),
            color: find(&["color", "colour", "hex"]),
            channels: channels
                .iter()
                .all(Option::is_some)
                .then(|| channels.map(Option::unwrap_or_default)),
        })
    }

    fn label(&self, line: &str) -> Option<Label> {
        let cells: Vec<&str> =
            line.split(self.separator).map(|cell| cell.trim().trim_matches('"')).collect();
        let cell = |at: usize| cells.get(at).copied();
        let hex = |text: &str| {
            let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6)?;
            let number = u32::from_str_radix(digits, 16).ok()?;
            Some([16, 8, 0].map(|shift| f64::from(number >> shift & 0xff) / 255.0))
        };
        let of_channels = |channels: [usize; 3]| {
            let [red, green, blue] = channels.map(|at| cell(at).unwrap_or_default());
            color([red, green, blue])
        };
        Some(Label {
            value: cell(self.value)?.parse().ok()?,
            name: self.name.and_then(cell).unwrap_or_default().to_owned(),
            color: self
                .color
                .and_then(cell)
                .and_then(hex)
                .or_else(|| self.channels.and_then(of_channels)),
            opacity: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::Folder;

    fn read(text: &str) -> Result<Vec<Label>> {
        let folder = Folder::new();
        read_labels(folder.write("table.txt", text), &Limits::default())
    }

    fn label(value: i32, name: &str, color: [u8; 3], opacity: Option<f64>) -> Label {
        let color = Some(color.map(|channel| f64::from(channel) / 255.0));
        Label { value, name: name.into(), color, opacity }
    }

    #[test]
    fn tables_of_three_programs_are_read() {
        let snap = "# comment\n 0 0 0 0 0 0 0 \"Clear Label\"\n 7 255 128 0 0.5 1 1 \"Left ear\"\n \
                    8 1 2 3 1 0 1 \"hidden\"";
        assert_eq!(
            read(snap).unwrap(),
            [
                label(0, "Clear Label", [0; 3], Some(0.0)),
                label(7, "Left ear", [255, 128, 0], Some(0.5)),
                label(8, "hidden", [1, 2, 3], Some(0.0)),
            ]
        );
        let surfer = "#$Id\n\n0   Unknown   0 0 0 0\n1003 ctx lh caudal  25 5 25 0\r\n9 X 1 2 3";
        assert_eq!(
            read(surfer).unwrap(),
            [
                label(0, "Unknown", [0; 3], None),
                label(1003, "ctx lh caudal", [25, 5, 25], None),
                label(9, "X", [1, 2, 3], None),
            ]
        );
        let columns = "\u{feff}index\tname\tcolor\n4\tVentricle\t#0a0B0c\n5\tNone\tn/a\n";
        let labels = read(columns).unwrap();
        assert_eq!(labels[0], label(4, "Ventricle", [10, 11, 12], None));
        assert_eq!(labels[1].color, None);
        assert_eq!(read("label;r;g;b\n-2;1;2;3").unwrap(), [label(-2, "", [1, 2, 3], None)]);
        let error = read("1 skin 200 100 50 0\nbone 1 2 3").unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("bone"), "{error}");
    }
}
