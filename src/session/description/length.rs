//! Lengths on paper.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A length on paper: a number with `mm`, `cm`, `in` or `pt`. In JSON a text such as `"85mm"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "String"))]
pub struct PaperLength {
    number: f64,
    /// The number of the unit in [`UNITS`].
    unit: usize,
}

/// The units, and how many of them an inch has.
const UNITS: [(&str, f64); 4] = [("mm", 25.4), ("cm", 2.54), ("in", 1.0), ("pt", 72.0)];

impl PaperLength {
    /// Returns the length in inches.
    pub fn inches(self) -> f64 {
        self.number / UNITS[self.unit].1
    }

    /// Returns the length in pixels at a resolution in pixels an inch.
    pub fn pixels(self, dpi: f64) -> f64 {
        self.inches() * dpi
    }
}

impl FromStr for PaperLength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || "the form is a number above 0 with mm, cm, in or pt, such as 85mm".to_owned();
        let ends = |(name, _): &(&str, f64)| text.ends_with(name);
        let unit = UNITS.iter().position(ends).ok_or_else(form)?;
        let digits = text.trim_end_matches(UNITS[unit].0).trim_end();
        let number = digits.parse().map_err(|_| form())?;
        let is_length = number > 0.0 && f64::is_finite(number);
        is_length.then_some(Self { number, unit }).ok_or_else(form)
    }
}

impl TryFrom<String> for PaperLength {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl fmt::Display for PaperLength {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.number, UNITS[self.unit].0)
    }
}

impl From<PaperLength> for String {
    fn from(length: PaperLength) -> Self {
        length.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_units() {
        for (text, pixels) in
            [("25.4mm", 300.0), ("5.08 cm", 600.0), ("1in", 300.0), ("36pt", 150.0)]
        {
            let length: PaperLength = text.parse().unwrap();
            assert!((length.pixels(300.0) - pixels).abs() < 1e-9, "{text}");
            assert_eq!(length.to_string().parse(), Ok(length));
        }
        for text in ["85", "mm", "-3mm", "0cm", "infin", "NaNmm", "85 px", "1e999pt", ""] {
            assert!(text.parse::<PaperLength>().is_err(), "{text}");
        }
    }
}
