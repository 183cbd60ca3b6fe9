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
    color::{ColorMap, ColorScale},
    glam::DVec3,
    session::{Coloring, SurfaceColor, check_log},
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
    #[arg(long, value_name = "[FILE=]NAME|COLOR", value_parser = surface)]
    color: Vec<Own<SurfaceColor>>,
    /// Set the colour of what has no value.
    #[arg(long, value_name = "COLOR", value_parser = parse::color)]
    nan_color: Option<[f32; 3]>,
    /// Spread the colour map over the logarithms of the values.
    #[arg(long)]
    log_colors: bool,
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

/// Parses what colours surfaces, of all inputs or of one.
fn surface(text: &str) -> Result<Own<SurfaceColor>, String> {
    Own::parse(text, |text| match text.trim() {
        "" => Err("name an attribute or a colour, such as intensity or orange".into()),
        text => Ok(SurfaceColor::of(text, parse::color(text).ok())),
    })
}

impl ColorFlags {
    /// Returns the flags of one input.
    pub fn of(&self, path: &Path) -> Self {
        let color = Own::of(&self.color, path).cloned().map(Own::of_all);
        Self { color: color.into_iter().collect(), ..self.clone() }
    }

    /// Returns how values become colours, and by what the surfaces are coloured that have no colour
    /// of their own here.
    pub fn coloring(&self, range: Option<[f64; 2]>) -> Coloring {
        self.coloring_by(self.surface(), range)
    }

    /// Returns how values become colours, with this colour of surfaces.
    pub fn coloring_by(&self, surface: Option<&SurfaceColor>, range: Option<[f64; 2]>) -> Coloring {
        Coloring {
            surface: surface.cloned(),
            map: self.colormap,
            range,
            is_log: self.log_colors,
            missing: self.nan_color,
        }
    }

    /// Returns the colours of inputs, to be found one after the other.
    pub fn by_input(&self) -> own::Values<SurfaceColor> {
        own::Values::new(self.color.iter().cloned())
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
        let mut scale = self.coloring(None).scale(ColorMap::VIRIDIS, Some(range));
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
}

/// Colours a mesh or point cloud that was read. `up` is the direction of heights, and `named` says
/// whether the user named the values.
pub fn paint(
    coloring: &Coloring,
    path: &Path,
    mesh: &mut Mesh,
    up: DVec3,
    named: bool,
) -> Result<Option<Bar>, Failure> {
    let paint = coloring.paint(mesh, up, named).map_err(|message| {
        let hint = "colours are written as orange or '#ff8800'; --color height and --color normal \
                    colour any surface; --color values needs --scalar";
        Failure::from(Error::input(path, "attributes", message).hint(hint))
    })?;
    let Some(paint) = paint else { return Ok(None) };
    mesh.paint(&paint).map_err(|error| {
        let hint = "--log-colors needs values above 0; --color height colours any surface";
        Failure::from(Error::input(path, "values", error.to_string()).hint(hint))
    })?;
    let Some(scale) = mesh.scale else { return Ok(None) };
    check_log(&scale).map_err(of_log)?;
    let title = match paint {
        Paint::Values { of: Values::Height(_), .. } => titled("height", &mesh.about.length),
        _ => titled(&mesh.about.name, &mesh.about.unit),
    };
    let color = |share: f64| scale.color(scale.value(share));
    let colors = (0..COLORS).map(|i| color(i as f64 / (COLORS - 1) as f64)).collect();
    Ok(Some(Bar { title, scale, colors, labels: Vec::new() }))
}

/// Returns the failure of colours over logarithms.
pub fn of_log(error: Error) -> Failure {
    match error {
        Error::Argument(message) => {
            Failure::Usage(format!("--log-colors: {message}; --range sets it"))
        }
        other => other.into(),
    }
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
            assert_eq!(surface(text), Ok(Own::of_all(wanted)));
        }
        assert!(surface(" ").is_err() && map("virids").is_err());
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
        flags.coloring(None).color_transfer(&mut transfer, [0.0, 255.0]).unwrap();
        assert_eq!(transfer.color, [(40.0, [0.0; 3]), (200.0, [1.0; 3])]);
        flags.coloring(Some([0.0, 100.0])).color_transfer(&mut transfer, [0.0, 255.0]).unwrap();
        assert_eq!(transfer.color(50.0), [0.5; 3]);
        let log = ColorFlags { log_colors: true, ..flags };
        assert!(
            log.coloring(Some([0.0, 100.0])).color_transfer(&mut transfer, [0.0, 255.0]).is_err()
        );
        log.coloring(Some([1.0, 100.0])).color_transfer(&mut transfer, [0.0, 255.0]).unwrap();
        let bar = log.bar(&transfer, [0.0, 255.0], titled("CT", "HU"));
        assert_eq!((bar.scale.range, bar.title.as_str()), ([1.0, 100.0], "CT (HU)"));
    }
}
