//! What the attributes of a group say by the rules of OME-Zarr (versions 0.1 to 0.5): the axes and
//! levels of an image, its channels and labels, plates and wells.

use crate::about::{Channel, Label};
use serde_json::Value;

/// An image in levels, the finest first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Multiscale {
    /// Empty if the metadata does not name them.
    pub axes: Vec<Axis>,
    pub levels: Vec<Level>,
}

/// An axis of an image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    pub name: String,
    /// `space`, `channel`, `time`; empty if the metadata does not say.
    pub kind: String,
    /// The unit by its sign; empty if the metadata does not say.
    pub unit: String,
}

/// A level of an image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Level {
    /// The path of its array, from the group of the image on.
    pub path: String,
    /// The distances between elements along each axis, and the place of the first one; empty if
    /// the metadata does not say.
    pub steps: Vec<f64>,
    pub origin: Vec<f64>,
}

/// How the channels of an image are shown.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shown {
    pub channels: Vec<Channel>,
    /// Whether each channel is shown at first.
    pub active: Vec<bool>,
}

/// Returns what a group says of itself: its attributes, those of OME in Zarr 3 inside.
pub fn attributes(metadata: &Value) -> &Value {
    let attributes = metadata.get("attributes").unwrap_or(metadata);
    attributes.get("ome").unwrap_or(attributes)
}

/// Reads the first image in levels; `None` if a group is none. The error is a message.
pub fn multiscale(attributes: &Value) -> Result<Option<Multiscale>, String> {
    let Some(list) = attributes.get("multiscales") else { return Ok(None) };
    let first = list.get(0).ok_or("has no image in the list “multiscales”")?;
    let axes: Vec<Axis> = first["axes"].as_array().into_iter().flatten().map(axis_of).collect();
    let outer = &first["coordinateTransformations"];
    let datasets = first["datasets"].as_array().filter(|list| !list.is_empty());
    let datasets = datasets.ok_or("has no level in the list “datasets”")?;
    let level = |dataset: &Value| {
        let path = dataset["path"].as_str().ok_or("has a level without a “path”")?;
        let mut level = Level { path: path.to_owned(), ..Level::default() };
        level.take(&dataset["coordinateTransformations"])?;
        level.take(outer)?;
        Ok(level)
    };
    let levels = datasets.iter().take(64).map(level).collect::<Result<Vec<_>, String>>()?;
    Ok(Some(Multiscale { axes, levels }))
}

impl Level {
    /// Takes transformations, in their order: factors, and then distances.
    fn take(&mut self, transformations: &Value) -> Result<(), String> {
        for one in transformations.as_array().into_iter().flatten() {
            let numbers = |name: &str| -> Result<Vec<f64>, String> {
                let list = one[name].as_array().ok_or_else(|| {
                    format!("has a transformation “{name}” without its list of numbers")
                })?;
                let number = |n: &Value| {
                    let n = n.as_f64().filter(|n| n.is_finite());
                    n.ok_or_else(|| format!("has a transformation “{name}” of other than numbers"))
                };
                list.iter().map(number).collect()
            };
            match one["type"].as_str() {
                Some("identity") => {}
                Some("scale") => {
                    let factors = numbers("scale")?;
                    let all = factors.len().max(self.steps.len());
                    self.steps.resize(all, 1.0);
                    self.origin.resize(all, 0.0);
                    for (axis, factor) in factors.into_iter().enumerate() {
                        self.steps[axis] *= factor;
                        self.origin[axis] *= factor;
                    }
                }
                Some("translation") => {
                    let distances = numbers("translation")?;
                    let all = distances.len().max(self.steps.len());
                    self.steps.resize(all, 1.0);
                    self.origin.resize(all, 0.0);
                    let sums = self.origin.iter_mut().zip(distances);
                    sums.for_each(|(place, distance)| *place += distance);
                }
                other => {
                    let name: String = other.unwrap_or("").chars().take(40).collect();
                    return Err(format!(
                        "has a transformation “{name}”, but “scale” and “translation” are read"
                    ));
                }
            }
        }
        Ok(())
    }
}

pub fn axis_of(value: &Value) -> Axis {
    let text = |name: &str| value[name].as_str().unwrap_or_default();
    // Version 0.3 has names only.
    let name = value.as_str().unwrap_or_else(|| text("name")).to_ascii_lowercase();
    let kind = match (text("type"), name.as_str()) {
        ("", "x" | "y" | "z") => "space",
        ("", "c") => "channel",
        ("", "t") => "time",
        (kind, _) => kind,
    };
    Axis { kind: kind.into(), unit: unit(text("unit")), name }
}

/// Returns the sign of a unit of UDUNITS-2 by its name.
fn unit(name: &str) -> String {
    match name {
        "angstrom" => "Å",
        "picometer" => "pm",
        "nanometer" => "nm",
        "micrometer" | "micron" | "um" | "\u{3bc}m" => "µm",
        "millimeter" => "mm",
        "centimeter" => "cm",
        "meter" => "m",
        "kilometer" => "km",
        "inch" => "in",
        "foot" => "ft",
        "pixel" => "",
        other => other,
    }
    .chars()
    .take(16)
    .collect()
}

/// Reads how channels are shown.
pub fn shown(attributes: &Value) -> Shown {
    let list = attributes["omero"]["channels"].as_array();
    let list = list.map_or(&[][..], |list| &list[..list.len().min(1 << 12)]);
    let channel = |value: &Value| {
        let number = |name: &str| value["window"][name].as_f64().filter(|n| n.is_finite());
        let window = number("start").zip(number("end")).filter(|(low, high)| low < high);
        Channel {
            name: value["label"].as_str().unwrap_or_default().trim().chars().take(64).collect(),
            color: value["color"].as_str().and_then(color),
            window: window.map(|(low, high)| [low, high]),
        }
    };
    let mut channels: Vec<Channel> = list.iter().map(channel).collect();
    // Programs write white for all if nobody chose a colour.
    if channels.len() > 1 && channels.iter().all(|channel| channel.color == Some([1.0; 3])) {
        channels.iter_mut().for_each(|channel| channel.color = None);
    }
    let is_active = |value: &Value| value["active"].as_bool().unwrap_or(true);
    Shown { active: list.iter().map(is_active).collect(), channels }
}

/// Reads a colour of six or eight hexadecimal digits: red, green, blue and opacity.
fn color(text: &str) -> Option<[f64; 3]> {
    let digits = text.trim().trim_start_matches('#');
    let bits = u32::from_str_radix(digits.get(..6)?, 16).ok()?;
    let [_, red, green, blue] = bits.to_be_bytes();
    let color = [red, green, blue].map(|part| f64::from(part) / 255.0);
    color.iter().any(|part| *part > 0.0).then_some(color)
}

/// Reads the colours and names of labels; `None` if an image is none of labels.
pub fn labels(attributes: &Value) -> Option<Vec<Label>> {
    let image = attributes.get("image-label")?;
    let mut table: Vec<Label> = Vec::new();
    let entries = |name: &str| image[name].as_array().cloned().unwrap_or_default();
    let value = |entry: &Value| i32::try_from(entry["label-value"].as_i64()?).ok();
    for entry in entries("colors") {
        let (Some(value), Some(rgba)) = (value(&entry), entry["rgba"].as_array()) else { continue };
        let part = |at: usize| Some(rgba.get(at)?.as_f64()?.clamp(0.0, 255.0) / 255.0);
        let color = part(0).zip(part(1)).zip(part(2)).map(|((r, g), b)| [r, g, b]);
        table.push(Label { value, color, opacity: part(3), ..Label::default() });
    }
    for entry in entries("properties") {
        let name = ["name", "label", "class"].into_iter().find_map(|key| entry[key].as_str());
        let (Some(value), Some(name)) = (value(&entry), name) else { continue };
        let name: String = name.chars().take(64).collect();
        match table.iter_mut().find(|label| label.value == value) {
            Some(label) => label.name = name,
            None => table.push(Label { value, name, ..Label::default() }),
        }
    }
    Some(table)
}

/// Returns the paths of the wells of a plate; `None` if a group is none.
pub fn wells(attributes: &Value) -> Option<Vec<String>> {
    Some(paths(attributes.get("plate")?.get("wells")))
}

/// Returns the paths of the images of a well; `None` if a group is none.
pub fn images(attributes: &Value) -> Option<Vec<String>> {
    Some(paths(attributes.get("well")?.get("images")))
}

fn paths(list: Option<&Value>) -> Vec<String> {
    let list = list.and_then(Value::as_array).into_iter().flatten();
    list.filter_map(|one| Some(one["path"].as_str()?.to_owned())).collect()
}

/// Returns a list of names.
pub fn names(list: &Value) -> Vec<String> {
    let list = list.as_array().into_iter().flatten();
    list.filter_map(|name| Some(name.as_str()?.to_owned())).take(1 << 12).collect()
}
