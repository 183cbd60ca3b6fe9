//! How an item looks: its transfer function, kernel and colours, with the command's defaults.

use crate::errors::wrong;
use serde::Deserialize;
use serde_json::Value;
use splatkit::{
    Error,
    bricks::Bricks,
    cells::Cells,
    color::ColorMap,
    glam::DVec3,
    math::Kernel,
    scattered::Points,
    session::{
        self, Appearance, Coloring, SurfaceColor, SurfaceValue, Transfer, check_log, shown_of,
    },
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, Volume},
};

/// The looks of one item.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Look {
    /// The name of a transfer function, or one as an object of JSON.
    transfer: Option<Value>,
    pub range: Option<[f64; 2]>,
    opacity_unit: Option<f64>,
    isosurfaces: Vec<Surface>,
    gradient_opacity: Vec<(f64, f64)>,
    colormap: Option<String>,
    log_colors: bool,
    nan_color: Option<[f32; 3]>,
    kernel: Option<KernelChoice>,
    sigma: Option<f64>,
    extent: Option<f64>,
    pub sharp: bool,
    color: Option<String>,
    opacity: Option<f32>,
    radius_scale: Option<f32>,
    crease: Option<f32>,
}

/// An isosurface. Without a colour, it has the transfer function's.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Surface {
    value: f64,
    color: Option<[f64; 3]>,
    opacity: f64,
}

/// A kernel's name, or its values at even distances from 0 to the extent.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
enum KernelChoice {
    Name(String),
    Table(Vec<f64>),
}

/// Parses a colour as in CSS: a name, `#rgb`, `#rrggbb` or `rgb(…)`, without opacity.
pub fn color(text: &str) -> Result<[f32; 3], Error> {
    // An empty text would be black.
    let parsed = Some(text.trim()).filter(|text| !text.is_empty());
    let parsed = parsed.and_then(|text| csscolorparser::parse(text).ok()).filter(|c| c.a >= 1.0);
    let color = parsed.ok_or_else(|| {
        wrong(format!("“{text}” is no colour: a colour is a name, '#rgb' or '#rrggbb'"))
    })?;
    Ok([color.r, color.g, color.b].map(|channel| channel.clamp(0.0, 1.0)))
}

impl Look {
    /// Checks what does not depend on an item.
    pub fn check(&self) -> Result<(), Error> {
        if let Some([low, high]) = self.range
            && !(low <= high && (high - low).is_finite())
        {
            return Err(wrong(format!("the range {low} to {high} does not ascend")));
        }
        if self.opacity_unit.is_some_and(|unit| !(unit > 0.0 && unit.is_finite())) {
            return Err(wrong("opacity_unit is a length above 0"));
        }
        if self.opacity.is_some_and(|opacity| !(opacity > 0.0 && opacity <= 1.0)) {
            return Err(wrong("the opacity of a surface lies above 0, up to 1"));
        }
        if self.crease.is_some_and(|angle| !(0.0..=180.0).contains(&angle)) {
            return Err(wrong("crease is an angle from 0 to 180 degrees"));
        }
        self.map()?;
        self.surfel_options().validate()
    }

    /// Returns the attribute of a surface to read, if the look names one.
    pub fn attribute(&self) -> Option<String> {
        match self.surface() {
            Some(SurfaceColor::Attribute(name)) => Some(name),
            _ => None,
        }
    }

    /// Whether something else than its own colours colours a surface.
    pub fn is_painted(&self) -> bool {
        !matches!(self.surface(), None | Some(SurfaceColor::File | SurfaceColor::Normal))
    }

    fn surface(&self) -> Option<SurfaceColor> {
        self.color.as_deref().map(|text| SurfaceColor::of(text, color(text).ok()))
    }

    fn map(&self) -> Result<Option<ColorMap>, Error> {
        self.colormap.as_deref().map(ColorMap::named).transpose()
    }

    /// Returns how values become colours, and by what surfaces are coloured.
    fn coloring(&self) -> Result<Coloring, Error> {
        Ok(Coloring {
            surface: self.surface(),
            map: self.map()?,
            range: self.range,
            is_log: self.log_colors,
            missing: self.nan_color,
        })
    }

    /// Returns how values are shown.
    fn appearance(&self) -> Result<Appearance, Error> {
        let transfer = match &self.transfer {
            None => None,
            Some(Value::String(preset)) => Some(Transfer::Named(preset.clone())),
            Some(whole) => Some(Transfer::Whole(TransferFunction::from_json(&whole.to_string())?)),
        };
        let surface = |own: &Surface| session::Surface {
            value: SurfaceValue::Own(own.value),
            color: own.color,
            opacity: own.opacity,
        };
        Ok(Appearance {
            transfer,
            opacity_unit: self.opacity_unit,
            isosurfaces: self.isosurfaces.iter().map(surface).collect(),
            gradient: self.gradient_opacity.clone(),
            coloring: self.coloring()?,
        })
    }

    /// Returns the kernel of a volume's samples.
    pub fn kernel(&self) -> Result<Kernel, Error> {
        let name = match &self.kernel {
            Some(KernelChoice::Table(values)) => {
                let extent = self.extent.ok_or_else(|| wrong("a table of values needs extent"))?;
                return Kernel::table(values.clone(), extent);
            }
            Some(KernelChoice::Name(name)) => name.as_str(),
            None => "gaussian",
        };
        Kernel::named(name, self.sigma, self.extent)
    }

    /// Returns an option that shows values, if one is given. It counts more than the colours that a
    /// volume may have.
    pub fn shows_values(&self) -> Option<&'static str> {
        let given = [
            ("transfer", self.transfer.is_some()),
            ("isosurfaces", !self.isosurfaces.is_empty()),
            ("range", self.range.is_some()),
            ("sharp", self.sharp),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(option, _)| option)
    }

    /// Returns the transfer function of a volume.
    pub fn of_volume(&self, name: &str, volume: &Volume) -> Result<TransferFunction, Error> {
        validated(self.appearance()?.of_volume(name, volume))
    }

    /// Returns the transfer function of scattered samples.
    pub fn of_samples(&self, name: &str, points: &Points) -> Result<TransferFunction, Error> {
        validated(self.appearance()?.of_samples(name, points))
    }

    /// Returns the transfer function of cells.
    pub fn of_cells(&self, name: &str, cells: &Cells) -> Result<TransferFunction, Error> {
        validated(self.appearance()?.of_cells(name, cells))
    }

    /// Returns the transfer function of a volume in bricks.
    pub fn of_bricks(&self, name: &str, bricks: &Bricks) -> Result<TransferFunction, Error> {
        validated(self.appearance()?.of_bricks(name, bricks))
    }

    /// Colours a mesh or point cloud. `up` is the direction of heights, and `named` says whether
    /// the user named the values.
    pub fn paint(&self, name: &str, mesh: &mut Mesh, up: DVec3, named: bool) -> Result<(), Error> {
        let paint = self.coloring()?.paint(mesh, up, named);
        let Some(paint) = paint.map_err(|message| wrong(format!("{name}: {message}")))? else {
            return Ok(());
        };
        mesh.paint(&paint)?;
        mesh.scale.as_ref().map_or(Ok(()), check_log)
    }

    /// Returns how a mesh or point cloud becomes surfels or facets.
    pub fn surfel_options(&self) -> SurfelOptions {
        let mut options = SurfelOptions::default();
        options.radius_scale *= self.radius_scale.unwrap_or(1.0);
        options.color_by_normal = matches!(self.surface(), Some(SurfaceColor::Normal));
        // Triangles of one plane still join.
        let crease = self.crease.map(|crease| crease.max(0.01));
        options.crease_angle_degrees = crease.unwrap_or(options.crease_angle_degrees);
        let opacity = self.opacity.filter(|opacity| *opacity < 1.0);
        if let Some(opacity) = opacity {
            options.optical_depth = -(1.0 - opacity).ln();
        }
        // Radii are for surfels, and facets are opaque.
        if self.radius_scale.is_some() || opacity.is_some() {
            options.most_facets = 0;
        }
        options
    }
}

/// Returns a transfer function with the colours of a map, spread over the values that it shows.
pub fn recolored(
    mut transfer: TransferFunction,
    map: &ColorMap,
    values: [f64; 2],
) -> Result<TransferFunction, Error> {
    let [low, high] = shown_of(&transfer, values);
    let point = |(share, color)| (low + (high - low) * share, color);
    transfer.color = map.points().into_iter().map(point).collect();
    transfer.validate()?;
    Ok(transfer)
}

/// Checks a transfer function that looks have changed.
fn validated(made: Result<TransferFunction, Error>) -> Result<TransferFunction, Error> {
    let transfer = made?;
    transfer.validate()?;
    Ok(transfer)
}
