//! Colours and what colours surfaces, as texts of a description.

use crate::{
    color::{hex, parse},
    session::SurfaceColor,
};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A colour: red, green and blue in 0 … 1. In JSON also a name or `#rrggbb`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ColorText", into = "ColorText")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "ColorText"))]
pub struct ColorEntry(pub [f32; 3]);

/// [`ColorEntry`] in JSON.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
enum ColorText {
    Name(String),
    Parts([f32; 3]),
}

impl TryFrom<ColorText> for ColorEntry {
    type Error = String;

    fn try_from(text: ColorText) -> Result<Self, String> {
        match text {
            ColorText::Name(name) => name.parse(),
            ColorText::Parts(parts) if parts.iter().all(|part| (0.0..=1.0).contains(part)) => {
                Ok(Self(parts))
            }
            ColorText::Parts(_) => Err("the parts of a colour lie in 0 … 1".into()),
        }
    }
}

impl From<ColorEntry> for ColorText {
    fn from(ColorEntry(color): ColorEntry) -> Self {
        hex(color).map_or(Self::Parts(color), Self::Name)
    }
}

impl FromStr for ColorEntry {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        parse(text).map(Self)
    }
}

/// The colour behind a picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ColorText", into = "ColorText")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "ColorText"))]
pub enum Background {
    /// None: pixels keep their opacity. In JSON `none`.
    Transparent,
    /// A colour.
    Color(ColorEntry),
}

impl Background {
    /// Returns the colour: red, green and blue in 0 … 1; `None` for transparency.
    pub fn color(self) -> Option<[f32; 3]> {
        match self {
            Self::Transparent => None,
            Self::Color(ColorEntry(color)) => Some(color),
        }
    }
}

impl FromStr for Background {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.trim().eq_ignore_ascii_case("none") {
            return Ok(Self::Transparent);
        }
        text.parse().map(Self::Color).map_err(|message: String| message + ", or none")
    }
}

impl TryFrom<ColorText> for Background {
    type Error = String;

    fn try_from(text: ColorText) -> Result<Self, String> {
        match text {
            ColorText::Name(name) => name.parse(),
            parts @ ColorText::Parts(_) => ColorEntry::try_from(parts).map(Self::Color),
        }
    }
}

impl From<Background> for ColorText {
    fn from(background: Background) -> Self {
        match background {
            Background::Transparent => Self::Name("none".into()),
            Background::Color(color) => color.into(),
        }
    }
}

impl FromStr for SurfaceColor {
    type Err = String;

    /// `file`, `values`, `height`, `normal`, a colour, or else the name of an attribute.
    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "" => Err("name an attribute or a colour, such as intensity or orange".into()),
            text => Ok(Self::of(text, parse(text).ok())),
        }
    }
}

impl fmt::Display for SurfaceColor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::File => "file",
            Self::Values => "values",
            Self::Height => "height",
            Self::Normal => "normal",
            Self::Attribute(name) => name,
            Self::Plain(color) => {
                let [r, g, b] = color.map(|part| (part * 255.0).round() as u8);
                return write!(f, "#{r:02x}{g:02x}{b:02x}");
            }
        })
    }
}

impl TryFrom<String> for SurfaceColor {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<SurfaceColor> for String {
    fn from(color: SurfaceColor) -> Self {
        color.to_string()
    }
}
