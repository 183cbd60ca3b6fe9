//! What the colours of a picture stand for.

use super::Coloring;
use crate::{
    about::Labels,
    color::{ColorMap, ColorScale},
    volume::TransferFunction,
};

/// The colours of the values of an input, to be shown beside a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Legend {
    /// The name and the unit of the values.
    pub title: String,
    /// The range of the values, and whether it is logarithmic.
    pub scale: ColorScale,
    /// The colours from the low end of the range to the high one: red, green and blue in 0 … 1.
    pub colors: Vec<[f32; 3]>,
    /// The colours and the names of labels. If there are any, they are listed instead of a bar.
    pub labels: Vec<([f32; 3], String)>,
}

/// Colours of a bar, enough for one a pixel.
const COLORS: usize = 1024;

impl Legend {
    /// Returns the legend of a transfer function that a [`Coloring`] has coloured: its colours from
    /// its first to its last point, within the `values` that there are. Labels that it shows are
    /// listed.
    pub fn of_transfer(
        coloring: &Coloring,
        transfer: &TransferFunction,
        values: [f64; 2],
        (title, labels): (String, Option<&Labels>),
    ) -> Self {
        let ends = transfer.color.first().zip(transfer.color.last());
        let range = match ends.map(|(first, last)| [first.0, last.0]) {
            // A map spans what the user or the function asks for; a function's own points may lie
            // far beyond the values.
            Some(span) if coloring.map.is_some() => span,
            Some([low, high]) if low < high => [low.max(values[0]), high.min(values[1])],
            _ => values,
        };
        let range = if range[0] < range[1] { range } else { values };
        let mut scale = coloring.scale(ColorMap::VIRIDIS, Some(range));
        scale.is_log &= coloring.map.is_some() && range[0] > 0.0;
        let color = |value: f64| transfer.color(value).map(|part| part as f32);
        let is_shown = |value: &&i32| transfer.opacity(f64::from(**value)) > 0.0;
        let listed = |labels: &Labels| {
            let entry = |&value: &i32| (color(f64::from(value)), labels.name(value));
            labels.present.iter().filter(is_shown).map(entry).collect()
        };
        let colors = shares().map(|share| color(scale.value(share))).collect();
        Self { title, scale, colors, labels: labels.map(listed).unwrap_or_default() }
    }

    /// Returns the legend of a surface that is coloured by values.
    pub fn of_scale(scale: ColorScale, title: String) -> Self {
        let colors = shares().map(|share| scale.color(scale.value(share))).collect();
        Self { title, scale, colors, labels: Vec::new() }
    }

    /// Returns “name (unit)”.
    pub fn title(name: &str, unit: &str) -> String {
        let name = if name.is_empty() { "value" } else { name };
        if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") }
    }

    /// Names values that have no name.
    pub(super) fn name(&mut self, name: &str) {
        let unnamed = Self::title("", "");
        if self.title == unnamed || self.title.starts_with(&format!("{unnamed} (")) {
            self.title = self.title.replacen(&unnamed, name, 1);
        }
    }
}

/// Returns even shares from 0 to 1.
fn shares() -> impl Iterator<Item = f64> {
    (0..COLORS).map(|i| i as f64 / (COLORS - 1) as f64)
}
