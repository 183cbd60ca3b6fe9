//! The flags that colour values and surfaces.

use crate::{
    failure::Failure,
    own::{self, Own},
    parse,
};
use clap::Args;
use splatkit::{
    Error,
    about::Labels,
    color::{ColorMap, ColorScale, Spread},
    glam::DVec3,
    surface::{Mesh, Paint, Values},
    volume::TransferFunction,
};
use std::path::{Path, PathBuf};

/// How values become colours, and by what surfaces are coloured.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Appearance")]
pub struct ColorFlags {
    /// Colour values by this map: viridis, inferno, magma, plasma, cividis, turbo, coolwarm, gray,
    /// hot, jet, twilight, blues or classes. NAME_r is reversed. Of volumes and samples, the
    /// opacity stays that of the transfer function [default: viridis for surfaces, the transfer
    /// function's colours for volumes]
    #[arg(long, value_name = "NAME", value_parser = map)]
    colormap: Option<ColorMap>,
    /// Colour meshes and point clouds by an attribute of the file (intensity, classification,
    /// confidence, …), by values (those of --scalar), height or normal, or in one colour. file
    /// keeps the file's own colours. FILE=COLOR is for one input, and the flag can be given
    /// several times [default: by the values if --scalar names them or if there are no colours,
    /// else file]
    #[arg(long, value_name = "[FILE=]NAME|COLOR", value_parser = SurfaceColor::own)]
    color: Vec<Own<SurfaceColor>>,
    /// Set the colour of what has no value.
    #[arg(long, value_name = "COLOR", value_parser = parse::color)]
    nan_color: Option<[f32; 3]>,
    /// Spread the colour map over the logarithms of the values.
    #[arg(long)]
    log_colors: bool,
}

/// What colours a surface.
#[derive(Debug, Clone, PartialEq)]
enum SurfaceColor {
    File,
    Values,
    Height,
    Normal,
    Plain([f32; 3]),
    Attribute(String),
}

/// [`ColorFlags`] of many inputs.
pub struct ColorsByInput<'a> {
    flags: &'a ColorFlags,
    colors: own::Values<SurfaceColor>,
}

impl ColorsByInput<'_> {
    /// Returns the flags of one input.
    pub fn of(&self, path: &Path) -> ColorFlags {
        self.flags.with(self.colors.of(path))
    }
}

/// The colours of values in a picture, for the bar beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// The name and the unit of the values.
    pub title: String,
    pub scale: ColorScale,
    /// The colours from the low end of the range to the high one.
    pub colors: Vec<[f32; 3]>,
    /// The colours and the names of labels. If there are any, they are listed instead of a bar.
    pub labels: Vec<([f32; 3], String)>,
}

/// Colours of a bar, enough for one a pixel.
const COLORS: usize = 1024;

impl SurfaceColor {
    fn own(text: &str) -> Result<Own<Self>, String> {
        Own::parse(text, Self::parse)
    }

    fn parse(text: &str) -> Result<Self, String> {
        match text.trim().to_ascii_lowercase().as_str() {
            "" => Err("name an attribute or a colour, such as intensity or orange".into()),
            "file" => Ok(Self::File),
            "values" => Ok(Self::Values),
            "height" => Ok(Self::Height),
            "normal" => Ok(Self::Normal),
            _ => Ok(parse::color(text)
                .map_or_else(|_| Self::Attribute(text.trim().into()), Self::Plain)),
        }
    }
}

impl ColorFlags {
    /// Returns the flags of one input.
    pub fn of(&self, path: &Path) -> Self {
        self.with(Own::of(&self.color, path))
    }

    /// Returns the colours of inputs, to be found one after the other.
    pub fn by_input(&self) -> ColorsByInput<'_> {
        ColorsByInput { flags: self, colors: own::Values::new(self.color.iter().cloned()) }
    }

    /// Returns the flags with this colour of surfaces.
    fn with(&self, color: Option<&SurfaceColor>) -> Self {
        let Self { colormap, color: _, nan_color, log_colors } = *self;
        let color = color.cloned().map(Own::of_all).into_iter().collect();
        Self { colormap, color, nan_color, log_colors }
    }

    /// Checks the names of inputs.
    pub fn check(&self, inputs: &[PathBuf]) -> Result<(), Failure> {
        Own::check(&self.color, "color", inputs)
    }

    /// Returns what colours the surfaces that have no colour of their own here.
    fn surface(&self) -> Option<&SurfaceColor> {
        Own::shared(&self.color)
    }

    /// Returns the attribute of a surface to read, if the flags name one.
    pub fn attribute(&self) -> Option<&str> {
        match self.surface() {
            Some(SurfaceColor::Attribute(name)) => Some(name),
            _ => None,
        }
    }

    /// Returns the flags that colour values, and whether they are given.
    fn of_values(&self) -> [(&'static str, bool); 3] {
        [
            ("--colormap", self.colormap.is_some()),
            ("--nan-color", self.nan_color.is_some()),
            ("--log-colors", self.log_colors),
        ]
    }

    /// Returns the first of the flags that is given.
    pub fn given(&self) -> Option<&'static str> {
        let color = [("--color", !self.color.is_empty())];
        let all = color.into_iter().chain(self.of_values());
        all.into_iter().find_map(|(name, is_given)| is_given.then_some(name))
    }

    /// Refuses flags without effect on a scene, which may have a mesh or point cloud, and values.
    pub fn check_effect(&self, has_mesh: bool, has_values: bool) -> Result<(), Failure> {
        if !self.color.is_empty() && !has_mesh {
            return Err(Failure::Usage(
                "--color colours meshes and point clouds, but there are none; volumes and samples \
                 take --colormap, and hierarchies keep the colours that they were converted with"
                    .into(),
            ));
        }
        match self.of_values().into_iter().find(|(_, is_given)| *is_given && !has_values) {
            None => Ok(()),
            Some((flag, _)) => Err(Failure::Usage(format!(
                "{flag} has no effect, because nothing here is coloured by values; --color height \
                 or --color with an attribute of the file gives surfaces values"
            ))),
        }
    }

    /// Returns whether surfaces are coloured by their normals.
    pub fn by_normal(&self) -> bool {
        self.surface() == Some(&SurfaceColor::Normal)
    }

    /// Returns what colours a surface instead of the file's colours. `named` says whether the user
    /// named its values, `plain` whether it has no colours of its own and values, and `is_cloud`
    /// whether it has no triangles.
    pub fn surface_paint(
        &self,
        range: Option<[f64; 2]>,
        up: DVec3,
        [named, plain, is_cloud]: [bool; 3],
    ) -> Option<Paint> {
        let of = match self.surface() {
            Some(SurfaceColor::File | SurfaceColor::Normal) => return None,
            Some(SurfaceColor::Plain(color)) => return Some(Paint::Plain(*color)),
            Some(SurfaceColor::Height) => Values::Height(up),
            Some(SurfaceColor::Values | SurfaceColor::Attribute(_)) => Values::Own,
            None if named || plain => Values::Own,
            None => return None,
        };
        let is_classes = self.attribute().is_some_and(is_classification);
        let usual = if is_classes { ColorMap::CLASSES } else { ColorMap::VIRIDIS };
        let scale = self.scale(usual, range);
        let spread = if is_cloud && !scale.map.is_categorical() {
            Spread::Percentiles
        } else {
            Spread::Full
        };
        let spread = Some(spread).filter(|_| range.is_none());
        Some(Paint::Values { of, scale, spread })
    }

    /// Colours a mesh or point cloud that was read. `up` is the direction of heights, and `named`
    /// says whether the user named the values.
    pub fn paint(
        &self,
        path: &Path,
        mesh: &mut Mesh,
        range: Option<[f64; 2]>,
        up: DVec3,
        named: bool,
    ) -> Result<Option<Bar>, Failure> {
        let has_colors = !mesh.colors.is_empty() || !mesh.materials.is_empty();
        let plain = !has_colors && !mesh.values.is_empty();
        let is = [named && !mesh.values.is_empty(), plain, mesh.triangles.is_empty()];
        let Some(paint) = self.surface_paint(range, up, is) else { return Ok(None) };
        let is_own = matches!(paint, Paint::Values { of: Values::Own, .. });
        if is_own && mesh.values.is_empty() {
            return Err(self.no_values(path));
        }
        let paint = self.with_classes(paint, &mesh.about.name);
        mesh.paint(&paint).map_err(|error| {
            Failure::from(
                Error::input(path, "values", error.to_string())
                    .hint("--log-colors needs values above 0; --color height colours any surface"),
            )
        })?;
        let Some(scale) = mesh.scale else { return Ok(None) };
        check_log(&scale)?;
        let title = match is_own {
            true => titled(&mesh.about.name, &mesh.about.unit),
            false => titled("height", &mesh.about.length),
        };
        let color = |share: f64| scale.color(scale.value(share));
        let colors = (0..COLORS).map(|i| color(i as f64 / (COLORS - 1) as f64)).collect();
        Ok(Some(Bar { title, scale, colors, labels: Vec::new() }))
    }

    /// Takes the colours of classes for values of that name, unless the user chose a map.
    pub fn with_classes(&self, mut paint: Paint, name: &str) -> Paint {
        if let Paint::Values { of: Values::Own, scale, .. } = &mut paint
            && self.colormap.is_none()
            && is_classification(name)
        {
            scale.map = ColorMap::CLASSES;
        }
        paint
    }

    fn no_values(&self, path: &Path) -> Failure {
        let message = match self.surface() {
            Some(SurfaceColor::Attribute(name)) => {
                format!("“{name}” is neither a colour nor an attribute of this file")
            }
            _ => "this file has no values to colour by".to_owned(),
        };
        let hint = "colours are written as orange or '#ff8800'; --color height and --color normal \
                    colour any surface; --color values needs --scalar";
        Error::input(path, "attributes", message).hint(hint).into()
    }

    /// Gives a transfer function the colours of the map, if there is one. They are spread over
    /// `range`, or over the values that the function shows out of `values`.
    pub fn color_transfer(
        &self,
        transfer: &mut TransferFunction,
        range: Option<[f64; 2]>,
        values: [f64; 2],
    ) -> Result<(), Failure> {
        let Some(map) = self.colormap else { return Ok(()) };
        let range = range.unwrap_or_else(|| shown_of(transfer, values));
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

    /// Returns the colours of a transfer function from its first to its last point, within the
    /// `values` that there are.
    pub fn bar(&self, transfer: &TransferFunction, values: [f64; 2], title: String) -> Bar {
        let ends = transfer.color.first().zip(transfer.color.last());
        let range = match ends.map(|(first, last)| [first.0, last.0]) {
            // A map spans what the user or the function asks for; a function's own points may lie
            // far beyond the values.
            Some(span) if self.colormap.is_some() => span,
            Some([low, high]) if low < high => [low.max(values[0]), high.min(values[1])],
            _ => values,
        };
        let range = if range[0] < range[1] { range } else { values };
        let mut scale = self.scale(ColorMap::VIRIDIS, Some(range));
        scale.is_log &= self.colormap.is_some() && range[0] > 0.0;
        let color = |i: usize| {
            let value = scale.value(i as f64 / (COLORS - 1) as f64);
            transfer.color(value).map(|part| part as f32)
        };
        let colors = (0..COLORS).map(color).collect();
        Bar { title, scale, colors, labels: Vec::new() }
    }

    /// Returns the colours and the names of the labels that a transfer function shows.
    pub fn legend(transfer: &TransferFunction, labels: &Labels) -> Vec<([f32; 3], String)> {
        let is_shown = |value: &&i32| transfer.opacity(f64::from(**value)) > 0.0;
        let entry = |&value: &i32| {
            (transfer.color(f64::from(value)).map(|part| part as f32), labels.name(value))
        };
        labels.present.iter().filter(is_shown).map(entry).collect()
    }

    fn scale(&self, usual: ColorMap, range: Option<[f64; 2]>) -> ColorScale {
        let mut scale = ColorScale::new(self.colormap.unwrap_or(usual));
        scale.range = range.unwrap_or(scale.range);
        scale.is_log = self.log_colors;
        scale.missing = self.nan_color.unwrap_or(scale.missing);
        scale
    }
}

/// Returns the values that a transfer function distinguishes: those that it shows, up to the last
/// value at which it changes.
pub fn shown_of(transfer: &TransferFunction, [low, high]: [f64; 2]) -> [f64; 2] {
    let [from, to] = transfer.shown_range().unwrap_or([low, high]);
    let last = transfer.opacity.iter().map(|point| point.0).fold(f64::NEG_INFINITY, f64::max);
    let last_color = transfer.color.iter().map(|point| point.0).fold(last, f64::max);
    let first = transfer.opacity.first().map_or(low, |point| point.0);
    let from = if from.is_finite() { from } else { first.min(high) };
    let to = if to.is_finite() { to } else { last_color };
    let shown = [from.max(low), to.min(high)];
    if shown[0] < shown[1] { shown } else { [low, high] }
}

/// Refuses a logarithmic scale over values that have no logarithm.
fn check_log(scale: &ColorScale) -> Result<(), Failure> {
    let [low, high] = scale.range;
    if !scale.is_log || low > 0.0 {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "--log-colors needs a range above 0, but the values shown are {low} to {high}; give \
         --range, such as --range {},{high}",
        if high > 0.0 { high / 1000.0 } else { 1.0 }
    )))
}

fn is_classification(name: &str) -> bool {
    name.eq_ignore_ascii_case("classification")
}

/// Returns “name (unit)”.
pub fn titled(name: &str, unit: &str) -> String {
    let name = if name.is_empty() { "value" } else { name };
    if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") }
}

/// Parses the name of a colour map.
fn map(text: &str) -> Result<ColorMap, String> {
    ColorMap::named(text).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_told_from_attributes() {
        for (text, wanted) in [
            ("Height", SurfaceColor::Height),
            ("orange", SurfaceColor::Plain([1.0, 165.0 / 255.0, 0.0])),
            ("#fff", SurfaceColor::Plain([1.0; 3])),
            ("Intensity", SurfaceColor::Attribute("Intensity".into())),
        ] {
            assert_eq!(SurfaceColor::parse(text), Ok(wanted));
        }
        assert!(SurfaceColor::parse(" ").is_err() && map("virids").is_err());
    }

    #[test]
    fn maps_span_what_is_shown() {
        let json = r#"{"color": [[0, 0, 0, 0]], "opacity": [[40, 0], [80, 0.5], [200, 0.5]]}"#;
        let flags = ColorFlags {
            colormap: Some(ColorMap::GRAY),
            color: Vec::new(),
            nan_color: None,
            log_colors: false,
        };
        let mut transfer = TransferFunction::from_json(json).unwrap();
        flags.color_transfer(&mut transfer, None, [0.0, 255.0]).unwrap();
        assert_eq!(transfer.color, [(40.0, [0.0; 3]), (200.0, [1.0; 3])]);
        flags.color_transfer(&mut transfer, Some([0.0, 100.0]), [0.0, 255.0]).unwrap();
        assert_eq!(transfer.color(50.0), [0.5; 3]);
        let log = ColorFlags { log_colors: true, ..flags };
        assert!(log.color_transfer(&mut transfer, Some([0.0, 100.0]), [0.0, 255.0]).is_err());
        log.color_transfer(&mut transfer, Some([1.0, 100.0]), [0.0, 255.0]).unwrap();
        let bar = log.bar(&transfer, [0.0, 255.0], titled("CT", "HU"));
        assert_eq!((bar.scale.range, bar.title.as_str()), ([1.0, 100.0], "CT (HU)"));
    }
}
