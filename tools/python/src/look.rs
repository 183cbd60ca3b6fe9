//! How an item looks: its transfer function, kernel and colours, with the command's defaults.

use crate::errors::wrong;
use serde::Deserialize;
use serde_json::Value;
use splatkit::{
    Error,
    bricks::{Bricks, Level},
    cells::Cells,
    color::{ColorMap, ColorScale, Spread},
    glam::DVec3,
    math::{Kernel, Tensor},
    scattered::Points,
    surface::{Mesh, Paint, SurfelOptions, Values},
    volume::{Isosurface, Shade, TransferFunction, Volume},
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

/// What colours a surface.
enum SurfaceColor {
    File,
    Values,
    Height,
    Normal,
    Plain([f32; 3]),
    Attribute(String),
}

/// Values that a transfer function shows.
struct Shown<'a> {
    name: &'a str,
    range: [f64; 2],
    /// The diagonal of the box around them, in world units.
    diagonal: f64,
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
        let text = self.color.as_deref()?.trim();
        Some(match text.to_ascii_lowercase().as_str() {
            "file" => SurfaceColor::File,
            "values" => SurfaceColor::Values,
            "height" => SurfaceColor::Height,
            "normal" => SurfaceColor::Normal,
            _ => color(text)
                .map_or_else(|_| SurfaceColor::Attribute(text.to_owned()), SurfaceColor::Plain),
        })
    }

    fn map(&self) -> Result<Option<ColorMap>, Error> {
        self.colormap.as_deref().map(ColorMap::named).transpose()
    }

    fn scale(&self, usual: ColorMap, range: Option<[f64; 2]>) -> Result<ColorScale, Error> {
        let mut scale = ColorScale::new(self.map()?.unwrap_or(usual));
        scale.range = range.unwrap_or(scale.range);
        scale.is_log = self.log_colors;
        scale.missing = self.nan_color.unwrap_or(scale.missing);
        Ok(scale)
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
        if self.sigma.is_some() && name != "gaussian" {
            return Err(wrong(format!("sigma is for the kernel gaussian, not for {name}")));
        }
        if let Some(tensor) = Tensor::ALL.into_iter().find(|tensor| tensor.name() == name) {
            return match self.extent {
                Some(_) => Err(wrong(format!("the kernel {name} has a fixed extent"))),
                None => Ok(Kernel::tensor(tensor)),
            };
        }
        match name {
            "gaussian" => {
                let default = Kernel::default();
                let sigma = self.sigma.unwrap_or(default.unit());
                // A wider kernel keeps its shape unless the user sets the extent.
                let least = default.extent.max(default.radius() * sigma);
                Kernel::gaussian(sigma, self.extent.unwrap_or(least))
            }
            "b-spline" => Kernel::b_spline(self.extent.unwrap_or(2.0)),
            "hann" => Kernel::hann(self.extent.unwrap_or(3.0)),
            _ => Err(wrong(format!(
                "there is no kernel “{name}”; the kernels are gaussian, b-spline, hann, linear, \
                 catmull-rom and cubic-b-spline"
            ))),
        }
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
        let shown = shown(name, volume.range, volume.bounds());
        self.transfer(&shown, || TransferFunction::automatic(volume))
    }

    /// Returns the transfer function of scattered samples.
    pub fn of_samples(&self, name: &str, points: &Points) -> Result<TransferFunction, Error> {
        let shown = shown(name, points.range(), points.bounds());
        self.transfer(&shown, || points.automatic_transfer())
    }

    /// Returns the transfer function of cells.
    pub fn of_cells(&self, name: &str, cells: &Cells) -> Result<TransferFunction, Error> {
        let shown = shown(name, cells.range(), cells.bounds());
        self.transfer(&shown, || cells.automatic_transfer())
    }

    /// Returns the transfer function of a volume in bricks. The automatic one is that of a level
    /// which can be read quickly.
    pub fn of_bricks(&self, name: &str, bricks: &Bricks) -> Result<TransferFunction, Error> {
        const QUICK: usize = 1 << 24;
        let is_quick = |level: &Level| level.dims.iter().product::<usize>() <= QUICK;
        let level = bricks.levels().iter().position(is_quick);
        let overview = bricks.volume(level.unwrap_or(bricks.levels().len() - 1))?;
        let shown = shown(name, bricks.header().range, bricks.header().lattice.bounds());
        self.transfer(&shown, || TransferFunction::automatic(&overview))
    }

    /// Returns the transfer function for values. If it shows none of them, that is an error. So is
    /// an automatic one for values that are all the same.
    fn transfer(
        &self,
        &Shown { name, range: values, diagonal }: &Shown<'_>,
        automatic: impl Fn() -> TransferFunction,
    ) -> Result<TransferFunction, Error> {
        let transfer = match &self.transfer {
            None if values[0] >= values[1] && self.isosurfaces.is_empty() => {
                return Err(Error::NothingToDraw(format!(
                    "all values of {name} are {}, so that nothing can be told apart; a transfer \
                     function gives them a colour and an opacity",
                    values[0]
                )));
            }
            None => automatic(),
            Some(Value::String(preset)) => {
                let mut named = TransferFunction::named(preset, values)?.for_size(diagonal);
                // Light fades where the gradient is noise, whatever the colours are.
                let certain = automatic().shade.and_then(|shade| shade.certain);
                named.shade = named.shade.map(|shade| Shade { certain, ..shade });
                named
            }
            Some(whole) => TransferFunction::from_json(&whole.to_string())?,
        };
        let mut transfer = match self.range {
            Some(range) => transfer.spread_over(range),
            None => transfer,
        };
        self.color_transfer(&mut transfer, values)?;
        transfer.unit = self.opacity_unit.unwrap_or(transfer.unit);
        if !self.gradient_opacity.is_empty() {
            transfer.gradient.clone_from(&self.gradient_opacity);
        }
        self.add_surfaces(&mut transfer);
        transfer.validate()?;
        if transfer.visible(values) {
            return Ok(transfer);
        }
        let shown = match transfer.shown_range() {
            Some([from, to]) if from == to => format!("shows only the value {from}"),
            Some([from, to]) => format!("shows values between {from} and {to}"),
            None => "shows no value".to_owned(),
        };
        let [low, high] = values;
        Err(Error::NothingToDraw(format!(
            "the transfer function {shown}, but the values of {name} lie between {low} and {high}"
        )))
    }

    fn add_surfaces(&self, transfer: &mut TransferFunction) {
        for &Surface { value, color, opacity } in &self.isosurfaces {
            let color = color.unwrap_or_else(|| transfer.color(value));
            transfer.isosurfaces.push(Isosurface { value, color, opacity });
        }
        if self.transfer.is_none() && !self.isosurfaces.is_empty() {
            transfer.opacity = vec![(0.0, 0.0)];
        }
    }

    /// Gives a transfer function the colours of the map, if there is one.
    fn color_transfer(
        &self,
        transfer: &mut TransferFunction,
        values: [f64; 2],
    ) -> Result<(), Error> {
        let Some(map) = self.map()? else { return Ok(()) };
        let range = self.range.unwrap_or_else(|| shown_of(transfer, values));
        let scale = self.scale(map, Some(range))?;
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

    /// Colours a mesh or point cloud. `up` is the direction of heights, and `named` says whether
    /// the user named the values.
    pub fn paint(&self, name: &str, mesh: &mut Mesh, up: DVec3, named: bool) -> Result<(), Error> {
        let has_colors = !mesh.colors.is_empty() || !mesh.materials.is_empty();
        let has_values = !mesh.values.is_empty();
        let of = match self.surface() {
            Some(SurfaceColor::File | SurfaceColor::Normal) => return Ok(()),
            Some(SurfaceColor::Plain(color)) => return mesh.paint(&Paint::Plain(color)),
            Some(SurfaceColor::Height) => Values::Height(up),
            Some(SurfaceColor::Values | SurfaceColor::Attribute(_)) => Values::Own,
            None if has_values && (named || !has_colors) => Values::Own,
            None => return Ok(()),
        };
        if of == Values::Own && !has_values {
            return Err(wrong(match self.surface() {
                Some(SurfaceColor::Attribute(text)) => {
                    format!("“{text}” is neither a colour nor an attribute of {name}")
                }
                _ => format!("{name} has no values to colour by"),
            }));
        }
        let is_classes = |text: &str| text.eq_ignore_ascii_case("classification");
        let own_name = of == Values::Own && is_classes(&mesh.about.name);
        let is_classes = self.attribute().is_some_and(|text| is_classes(&text)) || own_name;
        let usual = if is_classes { ColorMap::CLASSES } else { ColorMap::VIRIDIS };
        let scale = self.scale(usual, self.range)?;
        let is_cloud = mesh.triangles.is_empty();
        let spread = if is_cloud && !scale.map.is_categorical() {
            Spread::Percentiles
        } else {
            Spread::Full
        };
        let spread = Some(spread).filter(|_| self.range.is_none());
        mesh.paint(&Paint::Values { of, scale, spread })?;
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

fn shown<'a>(name: &'a str, range: [f64; 2], [first, last]: [DVec3; 2]) -> Shown<'a> {
    Shown { name, range, diagonal: (last - first).length() }
}

/// Returns the values that a transfer function distinguishes: those that it shows, up to the last
/// value at which it changes.
fn shown_of(transfer: &TransferFunction, [low, high]: [f64; 2]) -> [f64; 2] {
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
fn check_log(scale: &ColorScale) -> Result<(), Error> {
    let [low, high] = scale.range;
    if !scale.is_log || low > 0.0 {
        return Ok(());
    }
    Err(wrong(format!(
        "log_colors needs a range above 0, but the values shown are {low} to {high}; give range"
    )))
}
