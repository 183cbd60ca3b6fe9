//! How inputs are shown, as a description says it.

use super::{ColorEntry, kernel_file};
use crate::{
    Error, Result,
    about::Channel,
    color::ColorMap,
    facet::Size,
    input::Limits,
    math::Kernel,
    scene::Optics,
    session::{
        Appearance, CellStyle, ChannelStyle, Coloring, Glyphs, Showing, Surface, SurfaceColor,
        SurfaceValue, Transfer as Chosen,
    },
    surface::{PointStyle, SurfelOptions},
    volume::TransferFunction,
};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How inputs are shown. What is not given follows from the data.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct AppearanceEntry {
    /// The transfer function of fields: a name, a file, or one as an object. By default it is made
    /// for the values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transfer: Option<TransferEntry>,
    /// The values that the transfer function and the colour map are spread over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// The channels of volumes that are drawn, and how; by default all, in the file's colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channels: Option<Vec<ChannelEntry>>,
    /// The length that the opacities of the transfer function hold for, in world units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub opacity_unit: Option<f64>,
    /// Isosurfaces of fields. Without a transfer function, nothing else of a field is drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub isosurfaces: Option<Vec<IsosurfaceEntry>>,
    /// Magnitudes of the gradient (value per world length), and factors of 0 … 1 on the opacity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gradient_opacity: Option<Vec<(f64, f64)>>,
    /// The colour map of values: one of [`ColorMap::NAMES`], reversed with `_r` at its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Option<String>"))]
    pub colormap: Option<ColorMap>,
    /// Whether the colour map is spread over the logarithms of the values.
    #[serde(skip_serializing_if = "is_false")]
    pub log_colors: bool,
    /// The colour of what has no value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nan_color: Option<ColorEntry>,
    /// The kernel of the samples of volumes: one of [`Kernel::NAMES`], a file of values, or the
    /// values at even distances from 0 to `extent`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kernel: Option<KernelEntry>,
    /// The standard deviation of the Gaussian kernel, in samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// The radius of a footprint, in samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extent: Option<f64>,
    /// Whether volumes pass through their samples instead of smoothing them.
    #[serde(skip_serializing_if = "is_false")]
    pub sharp: bool,
    /// What colours surfaces: `file`, `values`, `height`, `normal`, a colour or an attribute.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Option<String>"))]
    pub color: Option<SurfaceColor>,
    /// The share of the light that a surface absorbs, above 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub opacity: Option<f32>,
    /// A factor on the radii of surfels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_scale: Option<f32>,
    /// How points are drawn; by default points on surfaces are surfels, and others spheres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<PointStyle>,
    /// The diameter of spheres and dots: a number in world units, or a text such as `3px`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_size: Option<Size>,
    /// The array that holds the radii of points, in world units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_radius: Option<String>,
    /// The width of lines: a number in world units, or a text such as `3px`, which is the default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line_width: Option<Size>,
    /// Glyphs of an array of points instead of the input: `arrows` of vectors or `ellipsoids` of
    /// tensors, with the array's name after a colon.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Option<String>"))]
    pub glyphs: Option<Glyphs>,
    /// A factor on the size of glyphs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub glyph_scale: Option<f64>,
    /// The angle between triangles, in degrees, from which on a crease looks sharp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crease: Option<f32>,
    /// Whether the edges of triangles and of cells are drawn.
    #[serde(skip_serializing_if = "is_false")]
    pub edges: bool,
    /// How cells are drawn; by default as a solid, unless something else here shows the field
    /// inside.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<CellStyle>,
}

/// A channel of a volume that has several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChannelEntry {
    /// Its name, or its number from 0.
    pub channel: ChannelName,
    /// Its colour; by default that of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<ColorEntry>,
    /// The values from which on it is seen, and at which it is brightest; by default those of the
    /// file's window, or what stands out of the background.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// A factor on its opacities, above 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<f64>,
    /// Its transfer function, which counts more than all else here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<TransferFunction>,
}

/// The name of a channel, or its number.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum ChannelName {
    /// Its number, from 0.
    Number(usize),
    /// Its name; letters may be small or capital.
    Name(String),
}

/// A transfer function.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum TransferEntry {
    /// One of [`TransferFunction::NAMES`], spread over the values; or the path of a file.
    Name(String),
    /// One of the scene's own.
    Whole(TransferFunction),
}

/// A kernel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum KernelEntry {
    /// One of [`Kernel::NAMES`], or the path of a file of values.
    Name(String),
    /// Its values at even distances.
    Values(Vec<f64>),
}

/// An isosurface of a field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct IsosurfaceEntry {
    /// The value at which it lies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Instead of a value, a share of the range of values in percent: 50 is its middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub percent: Option<f64>,
    /// Its colour; by default that of the transfer function.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<ColorEntry>,
    /// Its opacity, above 0 to 1.
    #[serde(default = "opaque", skip_serializing_if = "is_opaque")]
    pub opacity: f64,
}

impl ChannelEntry {
    /// A channel as the file shows it.
    pub fn new(name: &str) -> Self {
        let channel = match name.trim().parse() {
            Ok(number) => ChannelName::Number(number),
            Err(_) => ChannelName::Name(name.trim().to_owned()),
        };
        Self { channel, color: None, range: None, opacity: None, transfer: None }
    }

    /// Returns the name or the number as a text.
    pub fn name(&self) -> String {
        match &self.channel {
            ChannelName::Number(number) => number.to_string(),
            ChannelName::Name(name) => name.clone(),
        }
    }

    /// Checks what does not depend on the inputs.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self) -> std::result::Result<(), String> {
        let name = self.name();
        if let Some([low, high]) = self.range
            && !(low < high && (high - low).is_finite())
        {
            return Err(format!("channel {name}: the range {low} to {high} does not ascend"));
        }
        if self.opacity.is_some_and(|opacity| !(opacity > 0.0 && opacity <= 1.0)) {
            return Err(format!("channel {name}: the opacity must be above 0 and at most 1"));
        }
        Ok(())
    }

    fn style(&self) -> ChannelStyle {
        ChannelStyle {
            color: self.color.map(|ColorEntry(color)| color.map(f64::from)),
            range: self.range,
            opacity: self.opacity,
            transfer: self.transfer.clone(),
        }
    }
}

fn opaque() -> f64 {
    1.0
}

fn is_opaque(opacity: &f64) -> bool {
    *opacity == 1.0
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// What is wrong with a field: its name, and a message.
pub(super) type Wrong = (&'static str, String);

impl AppearanceEntry {
    /// Returns how an input is shown that has this entry of its own: what it does not say is as
    /// these say it that all inputs share.
    pub(super) fn beside(&self, shared: &Self) -> Self {
        macro_rules! own_or_shared {
            ($($field:ident),*; $($flag:ident),*) => {
                Self {
                    $($field: self.$field.clone().or_else(|| shared.$field.clone()),)*
                    $($flag: self.$flag || shared.$flag,)*
                }
            };
        }
        own_or_shared!(
            transfer, range, channels, opacity_unit, isosurfaces, gradient_opacity, colormap,
            nan_color, kernel, sigma, extent, color, opacity, radius_scale, points, point_size,
            point_radius, line_width, glyphs, glyph_scale, crease, cells;
            log_colors, sharp, edges
        )
    }

    /// Checks what does not depend on the inputs.
    ///
    /// # Errors
    /// [`Error::Argument`] with the name of the field that is wrong.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(|(field, message)| Error::Argument(format!("{field}: {message}")))
    }

    pub(super) fn check(&self) -> std::result::Result<(), Wrong> {
        if let Some([low, high]) = self.range
            && !(low <= high && (high - low).is_finite())
        {
            return Err(("range", format!("{low} to {high} does not ascend")));
        }
        if self.opacity_unit.is_some_and(|unit| !(unit > 0.0 && unit.is_finite())) {
            return Err(("opacity_unit", "must be a length above 0".into()));
        }
        let is_length = |length: &f64| *length > 0.0 && length.is_finite();
        if !self.sigma.iter().all(is_length) {
            return Err(("sigma", "must be a standard deviation above 0".into()));
        }
        if !self.extent.iter().all(is_length) {
            return Err(("extent", "must be a length above 0".into()));
        }
        if !self.glyph_scale.iter().all(is_length) {
            return Err(("glyph_scale", "must be a number above 0".into()));
        }
        if self.opacity.is_some_and(|opacity| !(opacity > 0.0 && opacity <= 1.0)) {
            return Err(("opacity", "must be above 0 and at most 1".into()));
        }
        if self.crease.is_some_and(|angle| !(0.0..=180.0).contains(&angle)) {
            return Err(("crease", "must be an angle from 0 to 180 degrees".into()));
        }
        self.check_channels().map_err(|message| ("channels", message))?;
        let surfaces = self.isosurfaces.iter().flatten();
        surfaces
            .map(IsosurfaceEntry::check)
            .try_for_each(|checked| checked.map_err(|message| ("isosurfaces", message)))?;
        let whole = match &self.transfer {
            Some(TransferEntry::Whole(transfer)) => transfer.isosurfaces.len(),
            _ => 0,
        };
        let count = self.isosurfaces.as_ref().map_or(0, Vec::len) + whole;
        let most = TransferFunction::MAX_ISOSURFACES;
        if count > most {
            let message = format!("{count} isosurfaces are given; at most {most} are allowed");
            return Err(("isosurfaces", message));
        }
        let gradient = self.gradient_opacity.clone().unwrap_or_default();
        let whole =
            TransferFunction { opacity: vec![(0.0, 1.0)], gradient, ..TransferFunction::default() };
        whole.validate().map_err(|error| ("gradient_opacity", error.to_string()))?;
        let scales = SurfelOptions::RADIUS_SCALES;
        if self.radius_scale.is_some_and(|scale| !scales.contains(&scale)) {
            let message = format!("must be from {:e} to {:e}", scales.start(), scales.end());
            return Err(("radius_scale", message));
        }
        Ok(())
    }

    fn check_channels(&self) -> std::result::Result<(), String> {
        let Some(channels) = &self.channels else { return Ok(()) };
        let (count, most) = (channels.len(), Channel::MOST);
        if !(1..=most).contains(&count) {
            return Err(format!("{count} channels are given, but a picture shows 1 to {most}"));
        }
        if self.transfer.is_some() || self.colormap.is_some() {
            return Err("channels have colours of their own: leave out the transfer function and \
                        the colour map, or show one channel by its values (--scalar channel:1)"
                .into());
        }
        channels.iter().try_for_each(ChannelEntry::check)
    }

    /// Returns which channels of a volume are read: those that are named, or all, unless something
    /// else colours its values. `None` stands for a single one.
    pub fn channels_read(&self) -> Option<Vec<String>> {
        match &self.channels {
            Some(channels) => Some(channels.iter().map(ChannelEntry::name).collect()),
            None if self.transfer.is_some() || self.colormap.is_some() => None,
            None => Some(Vec::new()),
        }
    }

    /// Returns the files that it names.
    pub fn files(&self) -> Vec<PathBuf> {
        let transfer = self.transfer.as_ref().and_then(TransferEntry::file);
        let kernel = self.kernel.as_ref().and_then(KernelEntry::file);
        [transfer, kernel].into_iter().flatten().map(Path::to_owned).collect()
    }

    /// Returns how values become colours, and by what surfaces are coloured.
    pub fn coloring(&self) -> Coloring {
        Coloring {
            surface: self.color.clone(),
            map: self.colormap,
            range: self.range,
            is_log: self.log_colors,
            missing: self.nan_color.map(|ColorEntry(color)| color),
        }
    }

    /// Returns how an input is shown. Reads the files that the entry names.
    ///
    /// # Errors
    /// Those of reading transfer functions and kernels, and of what cannot be one.
    pub fn showing(&self, limits: &Limits) -> Result<Showing> {
        let transfer = self.transfer.as_ref().map(|entry| entry.open(limits)).transpose()?;
        let surfaces = self.isosurfaces.iter().flatten().map(|entry| entry.surface());
        let appearance = Appearance {
            transfer,
            opacity_unit: self.opacity_unit,
            isosurfaces: surfaces.collect(),
            gradient: self.gradient_opacity.clone().unwrap_or_default(),
            coloring: self.coloring(),
            channels: self.channels.iter().flatten().map(ChannelEntry::style).collect(),
            optics: Optics::default(),
        };
        Ok(Showing {
            appearance,
            kernel: self.kernel(limits)?,
            is_sharp: self.sharp,
            radius_scale: self.radius_scale,
            crease: self.crease,
            opacity: self.opacity,
            points: self.points.unwrap_or(PointStyle::Auto),
            point_size: self.point_size,
            point_radius: self.point_radius.clone(),
            line_width: self.line_width,
            glyphs: self.glyphs.clone(),
            glyph_scale: self.glyph_scale,
            draws_edges: self.edges,
            cells: self.cells,
            values_by: self.shows_values().map(str::to_owned),
            ..Showing::default()
        })
    }

    /// Returns a field that shows values, if one is given: it counts more than the colours that a
    /// volume may have.
    fn shows_values(&self) -> Option<&'static str> {
        let given = [
            ("transfer", self.transfer.is_some()),
            ("isosurfaces", self.isosurfaces.is_some()),
            ("range", self.range.is_some()),
            ("sharp", self.sharp),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(field, _)| field)
    }

    /// Returns the kernel of a volume's samples.
    ///
    /// # Errors
    /// Those of [`Kernel::named`], of [`Kernel::table`] and of reading its file.
    pub fn kernel(&self, limits: &Limits) -> Result<Kernel> {
        let needs_extent = |what: &str| {
            let message =
                format!("{what} needs an extent (--extent), the distance of its last value");
            Error::Argument(message)
        };
        match &self.kernel {
            Some(KernelEntry::Values(values)) => {
                let extent = self.extent.ok_or_else(|| needs_extent("a table of values"))?;
                Kernel::table(values.clone(), extent)
            }
            Some(entry @ KernelEntry::Name(name)) => match entry.file() {
                None => Kernel::named(name, self.sigma, self.extent).map_err(|error| match error {
                    Error::Argument(message) if !Kernel::NAMES.contains(&name.as_str()) => {
                        Error::Argument(format!("{message}, or a file"))
                    }
                    other => other,
                }),
                Some(_) if self.sigma.is_some() => Err(Error::Argument(format!(
                    "sigma applies to the gaussian kernel only, not to {name}"
                ))),
                Some(file) => {
                    let what = format!("{name}: a kernel from a file");
                    let extent = self.extent.ok_or_else(|| needs_extent(&what))?;
                    // A wrong extent is not the file's fault.
                    Kernel::table(vec![1.0, 0.0], extent)?;
                    kernel_file::read(file, extent, limits)
                }
            },
            None => Kernel::named("gaussian", self.sigma, self.extent),
        }
    }
}

impl TransferEntry {
    /// Returns the file that it names.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Name(name) if TransferFunction::NAMES.contains(&name.as_str()) => None,
            Self::Name(name) => is_file(name).then(|| Path::new(name)),
            Self::Whole(_) => None,
        }
    }

    /// Reads the transfer function of a text: JSON, a name or a path.
    ///
    /// # Errors
    /// [`Error::Transfer`] for JSON that is none.
    pub fn parse(text: &str) -> Result<Self> {
        match text.trim_start().starts_with('{') {
            true => TransferFunction::from_json(text).map(Self::Whole),
            false => Ok(Self::Name(text.to_owned())),
        }
    }

    fn open(&self, limits: &Limits) -> Result<Chosen> {
        match (self, self.file()) {
            (Self::Whole(transfer), _) => Ok(Chosen::Whole(transfer.clone())),
            (_, Some(file)) => Ok(Chosen::Whole(TransferFunction::read(file, limits)?)),
            (Self::Name(name), None) => {
                // An unknown name fails here. The range comes later, with the volume.
                TransferFunction::named(name, [0.0, 1.0])?;
                Ok(Chosen::Named(name.clone()))
            }
        }
    }
}

impl KernelEntry {
    /// Returns the file that it names.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Name(name) if Kernel::NAMES.contains(&name.as_str()) => None,
            Self::Name(name) => is_file(name).then(|| Path::new(name)),
            Self::Values(_) => None,
        }
    }
}

fn is_file(name: &str) -> bool {
    let path = Path::new(name);
    path.extension().is_some() || path.exists()
}

impl IsosurfaceEntry {
    /// Checks what does not depend on the field.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self) -> std::result::Result<(), String> {
        let fault = match (self.value, self.percent) {
            (Some(value), None) if !value.is_finite() => "a value must be finite",
            (None, Some(share)) if !(0.0..=100.0).contains(&share) => {
                "a share of the range of values lies between 0% and 100%"
            }
            (Some(_), Some(_)) | (None, None) => "an isosurface has either a value or a percent",
            _ if !(self.opacity > 0.0 && self.opacity <= 1.0) => {
                "the opacity of a surface must be above 0 and at most 1"
            }
            _ => return Ok(()),
        };
        Err(fault.into())
    }

    fn surface(&self) -> Surface {
        let value = match (self.value, self.percent) {
            (Some(value), _) => SurfaceValue::Own(value),
            (None, share) => SurfaceValue::Share(share.unwrap_or(50.0) / 100.0),
        };
        let color = self.color.map(|ColorEntry(color)| color.map(f64::from));
        Surface { value, color, opacity: self.opacity }
    }
}
