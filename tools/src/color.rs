//! The flags that colour values and surfaces.

use crate::{
    failure::Failure,
    input_values::{InputValue, Shared},
    parse,
};
use clap::Args;
use splatkit::{
    color::ColorMap,
    session::{ColorEntry, Coloring, Description, SurfaceColor},
};
use std::path::{Path, PathBuf};

/// How values become colours, and by what surfaces are coloured.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Appearance")]
pub struct ColorFlags {
    /// Colour values by this map: viridis, inferno, magma, plasma, cividis, turbo, coolwarm, gray,
    /// hot, jet, twilight, blues or classes, or a list of colours such as black,#ff8800,white.
    /// NAME_r is reversed. Of volumes and samples, the opacity stays that of the transfer function
    /// [default: viridis for surfaces, the transfer function's colours for volumes]
    #[arg(long, value_name = "NAME|COLORS", value_parser = map)]
    colormap: Option<ColorMap>,
    /// Colour meshes and point clouds by an attribute of the file (intensity, classification,
    /// confidence, …), by values (those of --scalar), height or normal, or in one colour. file
    /// keeps the file's own colours. FILE=COLOR is for one input, and the flag can be given
    /// several times [default: by the values if --scalar names them or if there are no colours,
    /// else file]
    #[arg(long, value_name = "[FILE=]NAME|COLOR", value_parser = surface)]
    color: Vec<InputValue<SurfaceColor>>,
    /// Set the colour of what has no value.
    #[arg(long, value_name = "COLOR", value_parser = parse::color)]
    nan_color: Option<[f32; 3]>,
    /// Spread the colour map over the logarithms of the values.
    #[arg(long)]
    log_colors: bool,
}

/// Parses what colours surfaces, of all inputs or of one.
fn surface(text: &str) -> Result<InputValue<SurfaceColor>, String> {
    InputValue::parse(text, str::parse)
}

impl ColorFlags {
    /// Returns the flags of one input.
    pub fn of(&self, path: &Path) -> Self {
        let color = InputValue::of(&self.color, path).cloned().map(InputValue::of_all);
        Self { color: color.into_iter().collect(), ..self.clone() }
    }

    /// Returns how values become colours, and by what the surfaces are coloured that have no colour
    /// of their own here.
    pub fn coloring(&self, range: Option<[f64; 2]>) -> Coloring {
        Coloring {
            surface: self.surface().cloned(),
            map: self.colormap,
            range,
            is_log: self.log_colors,
            missing: self.nan_color,
        }
    }

    /// Refuses flags without effect on a scene, which may have a mesh or point cloud, and values.
    pub fn check_effect(&self, has_mesh: bool, has_values: bool) -> Result<(), Failure> {
        check_given(!self.color.is_empty(), self.of_values(), has_mesh, has_values)
    }

    /// Changes how the inputs of a scene are shown: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) {
        Shared::set(scene, |appearance| &mut appearance.colormap, self.colormap);
        let missing = self.nan_color.map(ColorEntry);
        Shared::set(scene, |appearance| &mut appearance.nan_color, missing);
        Shared::set_each(scene, |appearance| &mut appearance.color, &self.color, |_, _| {});
        scene.appearance.log_colors |= self.log_colors;
    }

    /// Checks the names of inputs.
    pub fn check(&self, inputs: &[PathBuf]) -> Result<(), Failure> {
        InputValue::check(&self.color, "color", inputs)
    }

    /// Returns what colours the surfaces that have no colour of their own here.
    fn surface(&self) -> Option<&SurfaceColor> {
        InputValue::shared(&self.color)
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
}

/// Refuses colours without effect on a scene, which may have a mesh or point cloud, and values.
pub fn check_effect(scene: &Description, has_mesh: bool, has_values: bool) -> Result<(), Failure> {
    let all = || scene.visible().map(|input| &input.appearance).chain([&scene.appearance]);
    let of_values = [
        ("--colormap", all().any(|appearance| appearance.colormap.is_some())),
        ("--nan-color", all().any(|appearance| appearance.nan_color.is_some())),
        ("--log-colors", all().any(|appearance| appearance.log_colors)),
    ];
    let has_color = all().any(|appearance| appearance.color.is_some());
    check_given(has_color, of_values, has_mesh, has_values)
}

/// Refuses `--color`, or the flags that colour values, if they are given without effect.
fn check_given(
    has_color: bool,
    of_values: [(&'static str, bool); 3],
    has_mesh: bool,
    has_values: bool,
) -> Result<(), Failure> {
    if has_color && !has_mesh {
        return Err(Failure::Usage(
            "--color colours meshes, point clouds and the boundary of cells, but there are none; \
             volumes and samples take --colormap, and hierarchies keep the colours that they were \
             converted with"
                .into(),
        ));
    }
    match of_values.into_iter().find(|(_, is_given)| *is_given && !has_values) {
        None => Ok(()),
        Some((flag, _)) => Err(Failure::Usage(format!(
            "{flag} has no effect, because nothing here is coloured by values; --color height \
             or --color with an attribute of the file gives surfaces values"
        ))),
    }
}

/// Parses the name of a colour map.
fn map(text: &str) -> Result<ColorMap, String> {
    ColorMap::named(text).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatkit::{session::Legend, volume::TransferFunction};

    #[test]
    fn colours_are_told_from_attributes() {
        for (text, wanted) in [
            ("Height", SurfaceColor::Height),
            ("orange", SurfaceColor::Plain([1.0, 165.0 / 255.0, 0.0])),
            ("#fff", SurfaceColor::Plain([1.0; 3])),
            ("Intensity", SurfaceColor::Attribute("Intensity".into())),
        ] {
            assert_eq!(surface(text), Ok(InputValue::of_all(wanted)));
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
        let title = Legend::title("CT", "HU");
        let coloring = log.coloring(None);
        let legend = Legend::of_transfer(&coloring, &transfer, [0.0, 255.0], (title, None));
        assert_eq!((legend.scale.range, legend.title.as_str()), ([1.0, 100.0], "CT (HU)"));
    }
}
