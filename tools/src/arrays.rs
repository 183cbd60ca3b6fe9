//! The arrays of a file, as `info` lists them.

use crate::{failure::Failure, output, terminal::safe};
use splatkit::formats::Array;

/// Prints a table of the arrays, with a star before the one that is drawn.
pub fn print(arrays: &[Array]) -> Result<(), Failure> {
    if arrays.is_empty() {
        return Ok(());
    }
    let rows: Vec<[String; 4]> = arrays
        .iter()
        .map(|array| {
            let kind = match array.components {
                1 => array.kind.clone(),
                components => format!("{} × {components}", array.kind),
            };
            let [low, high] = array.range.unwrap_or([f64::NAN; 2]).map(|end| short(end, 6));
            let length = if array.components == 1 { "" } else { "length " };
            let range = match array.range {
                Some(_) => format!("{length}{low} … {high}"),
                None => String::new(),
            };
            [safe(&array.name).into_owned(), array.place.name().into(), kind, range]
        })
        .collect();
    let widths: [usize; 4] = std::array::from_fn(|column| {
        rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)
    });
    output::line(format_args!("arrays (* is drawn)"))?;
    for (array, row) in arrays.iter().zip(&rows) {
        let star = if array.is_drawn { '*' } else { ' ' };
        let cells: Vec<String> =
            row.iter().zip(widths).map(|(text, width)| format!("{text:<width$}")).collect();
        output::line(format_args!("  {star} {}", cells.join("  ").trim_end()))?;
    }
    Ok(())
}

/// Formats a number with so many digits, without zeros behind the point.
fn short(value: f64, digits: usize) -> String {
    if value == 0.0 || (1e-4..1e9).contains(&value.abs()) {
        let whole = value.abs().log10().floor().max(0.0) as usize + 1;
        let text = format!("{value:.*}", digits.saturating_sub(whole.min(digits)));
        if text.contains('.') {
            return text.trim_end_matches('0').trim_end_matches('.').to_owned();
        }
        return text;
    }
    format!("{value:.*e}", digits - 1)
}
