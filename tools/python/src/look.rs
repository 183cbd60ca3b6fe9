//! How an item looks: its transfer function, kernel and colours, with the command's defaults.

use crate::errors::wrong;
use serde::Deserialize;
use serde_json::Value;
use splatkit::{
    Error,
    color::ColorMap,
    facet::Size,
    math::Kernel,
    session::{
        self, Appearance, Coloring, Showing, SurfaceColor, SurfaceValue, Transfer, shown_of,
    },
    surface::PointStyle,
    volume::TransferFunction,
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
    points: Option<String>,
    point_size: Option<SizeChoice>,
    pub point_radius: Option<String>,
    line_width: Option<SizeChoice>,
}

/// A size in world units, or in pixels as `3px`.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
enum SizeChoice {
    World(f32),
    Text(String),
}

impl SizeChoice {
    fn size(&self) -> Result<Size, Error> {
        let size = match self {
            Self::World(size) => Size::World(*size),
            Self::Text(text) => text.parse().map_err(|message: String| wrong(message))?,
        };
        size.validate("a size")?;
        Ok(size)
    }
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
        self.showing()?.validate()
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

    /// Returns how an input is shown.
    pub fn showing(&self) -> Result<Showing, Error> {
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
        let appearance = Appearance {
            transfer,
            opacity_unit: self.opacity_unit,
            isosurfaces: self.isosurfaces.iter().map(surface).collect(),
            gradient: self.gradient_opacity.clone(),
            coloring: self.coloring()?,
        };
        Ok(Showing {
            appearance,
            kernel: self.kernel()?,
            is_sharp: self.sharp,
            radius_scale: self.radius_scale,
            crease: self.crease,
            points: match &self.points {
                Some(text) => text.parse().map_err(|message: String| wrong(message))?,
                None => PointStyle::Auto,
            },
            point_size: self.point_size.as_ref().map(SizeChoice::size).transpose()?,
            point_radius: self.point_radius.clone(),
            line_width: self.line_width.as_ref().map(SizeChoice::size).transpose()?,
            opacity: self.opacity,
            values_by: self.shows_values().map(str::to_owned),
            ..Showing::default()
        })
    }

    /// Returns how values become colours, and by what surfaces are coloured.
    pub fn coloring(&self) -> Result<Coloring, Error> {
        Ok(Coloring {
            surface: self.surface(),
            map: self.map()?,
            range: self.range,
            is_log: self.log_colors,
            missing: self.nan_color,
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
