//! The flags that set how values and surfaces are shown.

use crate::{
    color::ColorFlags,
    failure::Failure,
    input_values::{InputValue, Shared},
    kernel::KernelFlags,
    parse,
};
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use splatkit::{
    facet::Size,
    session::{CellStyle, ChannelEntry, Description, Glyphs, IsosurfaceEntry, TransferEntry},
    surface::PointStyle,
    volume::TransferFunction,
};
use std::path::PathBuf;

/// How a scene's values and surfaces are shown.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Appearance")]
pub struct ShowFlags {
    /// Choose how the values of a volume or of samples are shown: ct-bone, ct-soft-tissue, ct-lung,
    /// ct-angiography, mri, mr-brain, mr-angiography, generic, a JSON file, or its text. FILE=NAME
    /// is for one input, and the flag can be given several times [default: made for the values, as
    /// `splatkit transfer` writes it]
    #[arg(long, value_name = "[FILE=]NAME|FILE.json", value_parser = transfer)]
    transfer: Vec<InputValue<String>>,
    /// Spread the transfer function over these values instead of its own, and the colour map of
    /// meshes and point clouds. FILE=LOW,HIGH is for one input, and the flag can be given several
    /// times [default of the map: all values of a mesh, the 1st to the 99th percentile of a point
    /// cloud]
    #[arg(
        long,
        value_name = "[FILE=]LOW,HIGH",
        value_parser = range,
        allow_hyphen_values = true
    )]
    range: Vec<InputValue<[f64; 2]>>,
    /// Draw these channels of a volume: each as its name or its number from 0, then as wished
    /// :COLOR, :LOW..HIGH (the values from which on it is seen, and at which it is brightest) and
    /// :OPACITY, as in DAPI:blue,1:#0f0:100..4000:0.5. FILE=CHANNEL,… is for one input, and the
    /// flag can be given several times [default: all, up to 8, in the file's colours]
    #[arg(long, value_name = "[FILE=]CHANNEL,…", value_parser = channels)]
    channels: Vec<InputValue<Vec<ChannelEntry>>>,
    /// Set the length that the transfer function's opacities hold for, in world units [default:
    /// that of the JSON file, else a part of the data's diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
    opacity_unit: Option<f64>,
    /// Draw isosurfaces of these values, each as VALUE, VALUE:COLOR, VALUE:OPACITY or
    /// VALUE:COLOR:OPACITY. 50% is the middle of the range of values. A colour is a name, #rgb or
    /// #rrggbb. Without --transfer, nothing else of the volume is drawn. FILE=VALUE,… is for one
    /// input, and the flag can be given several times [default: opaque, in the transfer function's
    /// colour of the value]
    #[arg(
        long,
        value_name = "[FILE=]VALUE,…",
        value_parser = surfaces,
        allow_hyphen_values = true
    )]
    iso: Vec<InputValue<Vec<IsosurfaceEntry>>>,
    /// Multiply the opacity by factors of 0 to 1, given by the gradient's magnitude (value per
    /// world length) and linear in between.
    #[arg(long, value_name = "MAGNITUDE,FACTOR:…", value_parser = Factors::parse)]
    gradient_opacity: Option<Factors>,
    /// Scale the radii of the surfels of meshes and point clouds. Hierarchies keep the radii that
    /// they were converted with.
    #[arg(long, value_name = "FACTOR", value_parser = parse::radius_scale)]
    radius_scale: Option<f32>,
    /// Draw points as surfels, spheres or dots. auto draws points on surfaces as surfels, which
    /// overlap to a closed surface, and others as spheres [default: auto]
    #[arg(long, value_name = "STYLE", value_parser = parse::points)]
    points: Option<PointStyle>,
    /// Draw points as spheres or dots of this diameter: in pixels, as 3px, or in world units, as
    /// 0.02 [default: by the distances between points, at least 2px]
    #[arg(long, value_name = "SIZE")]
    point_size: Option<Size>,
    /// Draw points as spheres or dots with the radii that this array or column holds, in world
    /// units.
    #[arg(long, value_name = "ARRAY")]
    point_radius: Option<String>,
    /// Draw lines as tubes of this width: in pixels, as 3px, or in world units, as 0.1 [default:
    /// 3px]
    #[arg(long, value_name = "WIDTH")]
    line_width: Option<Size>,
    /// Draw an arrow for each vector, or an ellipsoid for each tensor, of an array of points,
    /// instead of the input: arrows or ellipsoids, with :ARRAY, or with :VX,VY,VZ for three arrays
    /// of numbers [default: the first array with as many components]
    #[arg(long, value_name = "SHAPE[:ARRAY]")]
    glyphs: Option<Glyphs>,
    /// Scale glyphs. At 1, the longest arrow is half as long again as glyphs are apart.
    #[arg(long, value_name = "FACTOR", value_parser = parse::positive)]
    glyph_scale: Option<f64>,
    /// Meshes: split the normals where two triangles meet at more than this angle, so that the
    /// crease looks sharp. 0 draws flat facets; from 60 on, creases are split at 60 degrees
    /// [default: 60, or 38 for parts as construction programs make them]
    #[arg(long, value_name = "DEGREES", value_parser = parse::crease)]
    crease: Option<f32>,
    /// Draw the edges of the triangles of meshes, or of cells, as thin dark lines.
    #[arg(long)]
    edges: bool,
    /// Draw cells as an opaque body that shows the field inside where clips cut it (solid), or as
    /// a field, by a transfer function (volume) [default: solid; volume with --transfer, --iso,
    /// --mip and --x-ray]
    #[arg(long, value_name = "STYLE", value_parser = cells())]
    cells: Option<CellStyle>,
    /// Meshes and point clouds: let this share of the light be absorbed where a ray meets a
    /// surface once, above 0 to 1. FILE=OPACITY is for one input, and the flag can be given
    /// several times [default: 1]
    #[arg(long, value_name = "[FILE=]OPACITY", value_parser = opacity)]
    opacity: Vec<InputValue<f32>>,
    #[command(flatten)]
    pub color: ColorFlags,
    #[command(flatten)]
    kernel: KernelFlags,
}

/// [`TransferFunction::gradient`].
#[derive(Debug, Clone, PartialEq)]
struct Factors(Vec<(f64, f64)>);

impl ShowFlags {
    /// Returns a flag that was given and does not change how values are shown.
    pub fn unused_by_values(&self) -> Option<&'static str> {
        let opacity = (!self.opacity.is_empty()).then_some("--opacity");
        self.radius_scale.map(|_| "--radius-scale").or(opacity).or_else(|| self.kernel.first())
    }

    /// Changes how the inputs of a scene are shown: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) -> Result<(), Failure> {
        let inputs: Vec<PathBuf> = scene.visible().map(|input| input.file.clone()).collect();
        self.color.check(&inputs)?;
        InputValue::check(&self.transfer, "transfer", &inputs)?;
        InputValue::check(&self.range, "range", &inputs)?;
        InputValue::check_files(&self.channels, "channels", &inputs)?;
        InputValue::check_files(&self.iso, "iso", &inputs)?;
        InputValue::check(&self.opacity, "opacity", &inputs)?;
        let transfers: Vec<InputValue<TransferEntry>> = self
            .transfer
            .iter()
            .map(|value| value.try_map(|text| TransferEntry::parse(text)))
            .collect::<Result<_, _>>()?;
        let keep = |_: &mut _, _| {};
        Shared::set_each(scene, |appearance| &mut appearance.transfer, &transfers, keep);
        Shared::set_each(scene, |appearance| &mut appearance.range, &self.range, |_, _| {});
        Shared::set_each(scene, |appearance| &mut appearance.opacity, &self.opacity, |_, _| {});
        let join = |before: &mut Vec<IsosurfaceEntry>, more: Vec<_>| before.extend(more);
        Shared::set_each(scene, |appearance| &mut appearance.isosurfaces, &self.iso, join);
        let join = |before: &mut Vec<ChannelEntry>, more: Vec<_>| before.extend(more);
        Shared::set_each(scene, |appearance| &mut appearance.channels, &self.channels, join);
        Shared::set(scene, |appearance| &mut appearance.opacity_unit, self.opacity_unit);
        let factors = self.gradient_opacity.clone().map(|Factors(factors)| factors);
        Shared::set(scene, |appearance| &mut appearance.gradient_opacity, factors);
        Shared::set(scene, |appearance| &mut appearance.radius_scale, self.radius_scale);
        Shared::set(scene, |appearance| &mut appearance.points, self.points);
        Shared::set(scene, |appearance| &mut appearance.point_size, self.point_size);
        Shared::set(scene, |appearance| &mut appearance.point_radius, self.point_radius.clone());
        Shared::set(scene, |appearance| &mut appearance.line_width, self.line_width);
        Shared::set(scene, |appearance| &mut appearance.glyphs, self.glyphs.clone());
        Shared::set(scene, |appearance| &mut appearance.glyph_scale, self.glyph_scale);
        Shared::set(scene, |appearance| &mut appearance.crease, self.crease);
        Shared::set(scene, |appearance| &mut appearance.cells, self.cells);
        scene.appearance.edges |= self.edges;
        self.color.apply(scene);
        self.kernel.apply(scene);
        Ok(())
    }
}

/// Parses how values are shown. A text of JSON has no `=`.
fn transfer(text: &str) -> Result<InputValue<String>, String> {
    match text.trim_start().starts_with('{') {
        true => Ok(InputValue::of_all(text.to_owned())),
        false => InputValue::parse(text, |text| Ok(text.to_owned())),
    }
}

/// Parses how cells are drawn.
fn cells() -> impl TypedValueParser<Value = CellStyle> {
    PossibleValuesParser::new(CellStyle::NAMES)
        .map(|name| CellStyle::named(&name).expect("a name of the list"))
}

/// Parses a range of values.
fn range(text: &str) -> Result<InputValue<[f64; 2]>, String> {
    InputValue::parse(text, parse::range)
}

/// Parses isosurfaces.
fn surfaces(text: &str) -> Result<InputValue<Vec<IsosurfaceEntry>>, String> {
    InputValue::parse(text, |text| text.split(',').map(surface).collect())
}

/// Parses channels.
fn channels(text: &str) -> Result<InputValue<Vec<ChannelEntry>>, String> {
    InputValue::parse(text, |text| text.split(',').map(channel).collect())
}

/// Parses a channel: `DAPI`, `1:lime`, `DAPI:100..4000` or `1:#00ff00:100..4000:0.5`.
pub fn channel(text: &str) -> Result<ChannelEntry, String> {
    let form = "the form is CHANNEL with :COLOR, :LOW..HIGH and :OPACITY as wished, such as \
                DAPI:blue:100..4000:0.5";
    let mut parts = text.split(':');
    let name = parts.next().unwrap_or_default();
    if name.trim().is_empty() {
        return Err(form.into());
    }
    let mut entry = ChannelEntry::new(name);
    let number = |text: &str| parse::finite(text).map_err(|_| form);
    for part in parts {
        if let Some((low, high)) = part.split_once("..") {
            entry.range = Some([number(low)?, number(high)?]);
        } else if let Ok(opacity) = parse::finite(part) {
            // A number is an opacity, although its digits may look like a colour.
            entry.opacity = Some(opacity);
        } else {
            entry.color = Some(part.parse()?);
        }
    }
    entry.check()?;
    Ok(entry)
}

/// Parses an opacity.
fn opacity(text: &str) -> Result<InputValue<f32>, String> {
    InputValue::parse(text, |text| match parse::finite(text)? {
        opacity if opacity > 0.0 && opacity <= 1.0 => Ok(opacity as f32),
        _ => Err("an opacity lies above 0, up to 1".into()),
    })
}

/// Parses an isosurface: `80`, `50%`, `80:orange`, `80:0.5` or `80:#ff8800:0.5`.
pub fn surface(text: &str) -> Result<IsosurfaceEntry, String> {
    let form = "the form is VALUE, VALUE:COLOR, VALUE:OPACITY or VALUE:COLOR:OPACITY, such \
                as 400:orange:0.5";
    let mut parts = text.split(':').peekable();
    let text = parts.next().unwrap_or_default().trim();
    let number = |text: &str| parse::finite(text).map_err(|_| form);
    let (value, percent) = match text.strip_suffix('%') {
        None => (Some(number(text)?), None),
        Some(share) => (None, Some(number(share)?)),
    };
    // A number is an opacity, although its digits may look like a colour.
    let is_color = |part: &&str| !part.is_empty() && parse::finite(part).is_err();
    let color = parts.next_if(is_color).map(str::parse).transpose()?;
    let opacity = match parts.next() {
        Some(text) => parse::finite(text).map_err(|_| form)?,
        None => 1.0,
    };
    if parts.next().is_some() {
        return Err(form.into());
    }
    let surface = IsosurfaceEntry { value, percent, color, opacity };
    surface.check()?;
    Ok(surface)
}

impl Factors {
    /// `0,0:50,0.2:200,1`.
    fn parse(text: &str) -> Result<Self, String> {
        let form = "MAGNITUDE,FACTOR:MAGNITUDE,FACTOR…, such as 0,0:200,1";
        let points = text
            .split(':')
            .map(|point| parse::numbers(point, ',', form).map(|[m, factor]| (m, factor)));
        let gradient = points.collect::<Result<Vec<(f64, f64)>, String>>()?;
        // The library checks the points.
        let whole =
            TransferFunction { opacity: vec![(0.0, 1.0)], gradient, ..TransferFunction::default() };
        whole.validate().map_err(|error| error.to_string())?;
        Ok(Self(whole.gradient))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(value: f64, color: Option<&str>, opacity: f64) -> IsosurfaceEntry {
        let color = color.map(|text| text.parse().unwrap());
        IsosurfaceEntry { value: Some(value), percent: None, color, opacity }
    }

    #[test]
    fn surfaces_are_read() {
        assert_eq!(surface("-500"), Ok(of(-500.0, None, 1.0)));
        assert_eq!(surface("0.5:0.25"), Ok(of(0.5, None, 0.25)));
        assert_eq!(surface("80:#ff0000"), Ok(of(80.0, Some("red"), 1.0)));
        for text in ["80:#00ff00:0.5", "80:lime:0.5", "80:0f0:0.5"] {
            assert_eq!(surface(text), Ok(of(80.0, Some("lime"), 0.5)), "{text}");
        }
        let half = surface("50%:0.5").unwrap();
        assert_eq!((half.value, half.percent), (None, Some(50.0)));
        assert!(surface("150%").unwrap_err().contains("between 0% and 100%"));
        for bad in [
            "",
            "x",
            "80:",
            "80:#ff",
            "80:0",
            "80:2",
            "80:0.5:#ffffff",
            "80:#ffffff:1:1",
            "nan",
            "80:oranje",
        ] {
            assert!(surface(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn surfaces_of_one_input_are_read() {
        let parsed = ["-5,50%:red", "a=b.nrrd=7:0.5", "a=b.nrrd=9"];
        let flags = parsed.map(|text| surfaces(text).unwrap());
        let mut scene = Description::new(["a=b.nrrd".into(), "c.nrrd".into()]);
        let join = |before: &mut Vec<IsosurfaceEntry>, more: Vec<_>| before.extend(more);
        Shared::set_each(&mut scene, |appearance| &mut appearance.isosurfaces, &flags, join);
        let isosurfaces =
            [0, 1].map(|number| scene.appearance_of(&scene.inputs[number]).isosurfaces);
        assert_eq!(isosurfaces[0], Some(vec![of(7.0, None, 0.5), of(9.0, None, 1.0)]));
        assert_eq!(isosurfaces[1].as_ref().map(Vec::len), Some(2));
        assert!(surfaces("a.nrrd=x").is_err() && surfaces("1,").is_err());
        let whole = r#"{"color": [], "opacity": []}"#;
        assert_eq!(transfer(whole), Ok(InputValue::of_all(whole.to_owned())));
        assert!(transfer(&format!("a=b.nrrd={whole}")).is_ok());
    }

    #[test]
    fn channels_are_read() {
        assert_eq!(channel("DAPI"), Ok(ChannelEntry::new("DAPI")));
        let whole = ChannelEntry {
            color: Some("lime".parse().unwrap()),
            range: Some([-10.0, 4000.0]),
            opacity: Some(0.5),
            ..ChannelEntry::new("1")
        };
        assert_eq!(whole.channel, splatkit::session::ChannelName::Number(1));
        assert_eq!(channel("1:#0f0:-10..4000:0.5"), Ok(whole));
        let both = channels("a.tif=DAPI,2:red").unwrap();
        assert_eq!(both.single().map(|(_, all)| all.len()), Some(2));
        for bad in ["", ":red", "DAPI:oranje", "DAPI:5..1", "DAPI:1..", "DAPI:2", "DAPI:0"] {
            assert!(channel(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn factors_are_read() {
        assert_eq!(
            Factors::parse("0,0:50,0.2:200,1"),
            Ok(Factors(vec![(0.0, 0.0), (50.0, 0.2), (200.0, 1.0)]))
        );
        for (bad, word) in
            [("1", "the form is"), ("2,0:1,1", "before"), ("0,2", "0 … 1"), ("-1,0", "0 or more")]
        {
            assert!(Factors::parse(bad).unwrap_err().contains(word), "{bad}");
        }
    }
}
