//! How values become colours, and by what surfaces are coloured.

use super::{Legend, Name};
use crate::{
    Error, Result,
    color::{ColorMap, ColorScale, Spread},
    surface::{Mesh, Paint, Values},
    volume::TransferFunction,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What colours a surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum SurfaceColor {
    /// The file's own colours.
    File,
    /// The values that were read.
    Values,
    /// The height along the scene's up axis.
    Height,
    /// The direction of the normal.
    Normal,
    /// One colour: red, green and blue in 0 … 1.
    Plain([f32; 3]),
    /// An attribute of the file.
    Attribute(String),
}

/// How values become colours. What is not given follows from the data.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coloring {
    /// What colours surfaces; by default values that were asked for or that are the only colours,
    /// else the file's colours.
    pub surface: Option<SurfaceColor>,
    /// The colour map; by default viridis for surfaces, and the transfer function's own colours.
    pub map: Option<ColorMap>,
    /// The values that the map is spread over.
    pub range: Option<[f64; 2]>,
    /// Whether the map is spread over the logarithms of the values.
    pub is_log: bool,
    /// The colour of what has no value.
    pub missing: Option<[f32; 3]>,
}

impl SurfaceColor {
    /// Returns what a text stands for: `file`, `values`, `height` or `normal`, a colour if the
    /// caller has found one in it, else an attribute.
    pub fn of(text: &str, color: Option<[f32; 3]>) -> Self {
        match text.trim().to_ascii_lowercase().as_str() {
            "file" => Self::File,
            "values" => Self::Values,
            "height" => Self::Height,
            "normal" => Self::Normal,
            _ => color.map_or_else(|| Self::Attribute(text.trim().to_owned()), Self::Plain),
        }
    }
}

impl Coloring {
    /// Returns the attribute of a surface to read, if one is named.
    pub fn attribute(&self) -> Option<&str> {
        match &self.surface {
            Some(SurfaceColor::Attribute(name)) => Some(name),
            _ => None,
        }
    }

    /// Whether surfaces are coloured by their normals.
    pub fn by_normal(&self) -> bool {
        self.surface == Some(SurfaceColor::Normal)
    }

    /// Returns the scale of values that get the map, or else the usual one.
    pub fn scale(&self, usual: ColorMap, range: Option<[f64; 2]>) -> ColorScale {
        let mut scale = ColorScale::new(self.map.unwrap_or(usual));
        scale.range = range.unwrap_or(scale.range);
        scale.is_log = self.is_log;
        scale.missing = self.missing.unwrap_or(scale.missing);
        scale
    }

    /// Returns what colours a surface instead of the file's colours. `up` is the direction of
    /// heights. `named` says whether the user named its values, `plain` whether it has values and
    /// no colours of its own, and `is_cloud` whether it has no triangles.
    pub fn surface_paint(&self, up: DVec3, [named, plain, is_cloud]: [bool; 3]) -> Option<Paint> {
        let of = match &self.surface {
            Some(SurfaceColor::File | SurfaceColor::Normal) => return None,
            Some(SurfaceColor::Plain(color)) => return Some(Paint::Plain(*color)),
            Some(SurfaceColor::Height) => Values::Height(up),
            Some(SurfaceColor::Values | SurfaceColor::Attribute(_)) => Values::Own,
            None if named || plain => Values::Own,
            None => return None,
        };
        let is_classes = self.attribute().is_some_and(is_classification);
        let usual = if is_classes { ColorMap::CLASSES } else { ColorMap::VIRIDIS };
        let scale = self.scale(usual, self.range);
        let spread = if is_cloud && !scale.map.is_categorical() {
            Spread::Percentiles
        } else {
            Spread::Full
        };
        let spread = Some(spread).filter(|_| self.range.is_none());
        Some(Paint::Values { of, scale, spread })
    }

    /// Takes the colours of classes for values of that name, unless a map is given.
    pub fn with_classes(&self, mut paint: Paint, name: &str) -> Paint {
        if let Paint::Values { of: Values::Own, scale, .. } = &mut paint
            && self.map.is_none()
            && is_classification(name)
        {
            scale.map = ColorMap::CLASSES;
        }
        paint
    }

    /// Colours a mesh or point cloud that was read. Returns the legend if values colour it. `up` is
    /// the direction of heights, and `named` says whether the user named the values.
    ///
    /// # Errors
    /// [`Error::Input`] for values that a file does not have, [`Error::Argument`] for those that
    /// a caller's arrays do not have, and for logarithms of values that have none.
    pub fn paint(
        &self,
        name: &Name,
        mesh: &mut Mesh,
        up: DVec3,
        named: bool,
    ) -> Result<Option<Legend>> {
        let paint = self.paint_of(mesh, up, named).map_err(|message| {
            let hint = "colours are written as orange or '#ff8800'; the colours height and normal \
                        suit any surface; values needs --scalar";
            name.unfit("attributes", &message, hint)
        })?;
        let Some(paint) = paint else { return Ok(None) };
        mesh.paint(&paint).map_err(|error| {
            let hint = "logarithms need values above 0; the colour height suits any surface";
            name.unfit("values", &error.to_string(), hint)
        })?;
        let Some(scale) = mesh.scale else { return Ok(None) };
        check_log(&scale)?;
        let title = match paint {
            Paint::Values { of: Values::Height(_), .. } => {
                Legend::title("height", &mesh.about.length)
            }
            _ => Legend::title(&mesh.about.name, &mesh.about.unit),
        };
        Ok(Some(Legend::of_scale(scale, title)))
    }

    /// Returns what colours a mesh or point cloud that was read; `None` for the file's colours. The
    /// error is a message for values that it does not have.
    fn paint_of(
        &self,
        mesh: &Mesh,
        up: DVec3,
        named: bool,
    ) -> std::result::Result<Option<Paint>, String> {
        let has_colors = !mesh.colors.is_empty() || !mesh.materials.is_empty();
        let has_values = !mesh.values.is_empty();
        let is = [named && has_values, !has_colors && has_values, mesh.triangles.is_empty()];
        let Some(paint) = self.surface_paint(up, is) else { return Ok(None) };
        if matches!(paint, Paint::Values { of: Values::Own, .. }) && !has_values {
            return Err(match &self.surface {
                Some(SurfaceColor::Attribute(name)) => {
                    format!("“{name}” is neither a colour nor an attribute of this surface")
                }
                _ => "this surface has no values to colour by".to_owned(),
            });
        }
        Ok(Some(self.with_classes(paint, &mesh.about.name)))
    }

    /// Gives a transfer function the colours of the map, if there is one. They are spread over the
    /// range, or over the values that the function shows out of `values`.
    ///
    /// # Errors
    /// Those of [`check_log`].
    pub fn color_transfer(&self, transfer: &mut TransferFunction, values: [f64; 2]) -> Result<()> {
        let Some(map) = self.map else { return Ok(()) };
        let range = self.range.unwrap_or_else(|| visible_range_of(transfer, values));
        let scale = self.scale(map, Some(range));
        check_log(&scale)?;
        // Logarithms are not linear between the points of a map.
        let steps = |count: usize| (0..=count).map(move |i| i as f64 / count as f64);
        let shares: Vec<f64> = match scale.is_log {
            true => steps(64).collect(),
            false => map.points().into_iter().map(|point| point.0).collect(),
        };
        let color = |share| (scale.value(share), map.color(share));
        transfer.color = shares.into_iter().map(color).collect();
        Ok(())
    }
}

/// Returns the values that a transfer function distinguishes: those that it shows, up to the last
/// value at which it changes.
pub fn visible_range_of(transfer: &TransferFunction, [low, high]: [f64; 2]) -> [f64; 2] {
    let [from, to] = transfer.visible_range().unwrap_or([low, high]);
    let last = transfer.opacity.iter().map(|point| point.0).fold(f64::NEG_INFINITY, f64::max);
    let last_color = transfer.color.iter().map(|point| point.0).fold(last, f64::max);
    let first = transfer.opacity.first().map_or(low, |point| point.0);
    let from = if from.is_finite() { from } else { first.min(high) };
    let to = if to.is_finite() { to } else { last_color };
    let clipped = [from.max(low), to.min(high)];
    if clipped[0] < clipped[1] { clipped } else { [low, high] }
}

/// Refuses a logarithmic scale over values that have no logarithm.
///
/// # Errors
/// [`Error::Argument`].
pub fn check_log(scale: &ColorScale) -> Result<()> {
    let [low, high] = scale.range;
    if !scale.is_log || low > 0.0 {
        return Ok(());
    }
    Err(Error::Argument(format!(
        "colours over logarithms (--log-colors) need a range above 0, such as {},{high}, but the \
         values shown are {low} to {high}; --range sets it",
        if high > 0.0 { high / 1000.0 } else { 1.0 }
    )))
}

fn is_classification(name: &str) -> bool {
    name.eq_ignore_ascii_case("classification")
}
