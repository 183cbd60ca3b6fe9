//! The flags that set how values and surfaces are shown.

use crate::{
    color::ColorFlags,
    failure::Failure,
    kernel::KernelFlags,
    own::{self, Own},
    parse,
};
use clap::Args;
use splatkit::{
    facet::Size,
    input::Limits,
    math::Kernel,
    session::{Appearance, Coloring, Showing, Surface, SurfaceColor, SurfaceValue, Transfer},
    surface::PointStyle,
    volume::TransferFunction,
};
use std::path::{Path, PathBuf};

/// How a scene's values and surfaces are shown.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Appearance")]
pub struct ShowFlags {
    /// Choose how the values of a volume or of samples are shown: ct-bone, ct-soft-tissue, ct-lung,
    /// ct-angiography, mri, generic, a JSON file, or its text. FILE=NAME is for one input, and the
    /// flag can be given several times [default: made for the values, as `splatkit transfer` writes
    /// it]
    #[arg(long, value_name = "[FILE=]NAME|FILE.json", value_parser = transfer)]
    transfer: Vec<Own<String>>,
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
    range: Vec<Own<[f64; 2]>>,
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
    iso: Vec<Own<Vec<Surface>>>,
    /// Multiply the opacity by factors of 0 to 1, given by the gradient's magnitude (value per
    /// world length) and linear in between.
    #[arg(long, value_name = "MAGNITUDE,FACTOR:…", value_parser = Factors::parse)]
    gradient_opacity: Option<Factors>,
    /// Scale the radii of the surfels of meshes and point clouds. Hierarchies keep the radii that
    /// they were converted with.
    #[arg(long, value_name = "FACTOR", value_parser = parse::radius_scale)]
    pub radius_scale: Option<f32>,
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
    /// Meshes: split the normals where two triangles meet at more than this angle, so that the
    /// crease looks sharp. 0 draws flat facets; from 60 on, creases are split at 60 degrees
    /// [default: 60]
    #[arg(long, value_name = "DEGREES", value_parser = parse::crease)]
    crease: Option<f32>,
    /// Meshes: draw the edges of the triangles as thin dark lines.
    #[arg(long)]
    edges: bool,
    /// Meshes and point clouds: let this share of the light be absorbed where a ray meets a
    /// surface once, above 0 to 1. FILE=OPACITY is for one input, and the flag can be given
    /// several times [default: 1]
    #[arg(long, value_name = "[FILE=]OPACITY", value_parser = opacity)]
    opacity: Vec<Own<f32>>,
    #[command(flatten)]
    pub color: ColorFlags,
    #[command(flatten)]
    kernel: KernelFlags,
}

/// [`TransferFunction::gradient`].
#[derive(Debug, Clone, PartialEq)]
struct Factors(Vec<(f64, f64)>);

/// [`ShowFlags`] with their files read, so that errors that do not depend on the scene show before
/// its files are read.
pub struct Show<'a> {
    flags: &'a ShowFlags,
    kernel: Kernel,
    sharp: bool,
    /// What inputs have of their own.
    transfers: own::Values<Transfer>,
    ranges: own::Values<[f64; 2]>,
    surfaces: own::Values<&'a [Surface]>,
    opacities: own::Values<f32>,
    colors: own::Values<SurfaceColor>,
}

impl ShowFlags {
    /// Returns the flags that change the transfer function of an input as given, for messages;
    /// `None` if there are none.
    pub fn transfer_text(&self, path: &Path) -> Option<String> {
        let transfer = Own::of(&self.transfer, path);
        let transfer = transfer.map(|transfer| format!("--transfer {transfer}"));
        let unit = self.opacity_unit.map(|unit| format!("--opacity-unit {}", plain(unit)));
        let texts: Vec<_> = [transfer, self.range_text(path), unit].into_iter().flatten().collect();
        (!texts.is_empty()).then(|| texts.join(" "))
    }

    fn range_text(&self, path: &Path) -> Option<String> {
        let range = self.range_of(path);
        range.map(|[low, high]| format!("--range {},{}", plain(low), plain(high)))
    }

    fn range_of(&self, path: &Path) -> Option<[f64; 2]> {
        Own::of(&self.range, path).copied()
    }

    /// Whether the range of some input is given.
    pub fn has_range(&self) -> bool {
        !self.range.is_empty()
    }

    /// Returns the file of an input's transfer function if no other flag changes its content.
    pub fn own_transfer(&self, path: &Path) -> Option<&Path> {
        let is_changed = self.range_of(path).is_some() || self.opacity_unit.is_some();
        let named =
            |name: &&String| !TransferFunction::NAMES.contains(&name.as_str()) && is_file(name);
        Own::of(&self.transfer, path).filter(named).filter(|_| !is_changed).map(Path::new)
    }

    /// Returns a flag that was given and does not change how values are shown.
    pub fn unused_by_values(&self) -> Option<&'static str> {
        let opacity = (!self.opacity.is_empty()).then_some("--opacity");
        self.radius_scale.map(|_| "--radius-scale").or(opacity).or_else(|| self.kernel.first())
    }

    /// Checks the names of inputs in flags.
    pub fn check_inputs(&self, inputs: &[PathBuf]) -> Result<(), Failure> {
        self.color.check(inputs)?;
        Own::check(&self.transfer, "transfer", inputs)?;
        Own::check(&self.range, "range", inputs)?;
        Own::check_files(&self.iso, "iso", inputs)?;
        Own::check(&self.opacity, "opacity", inputs)
    }

    /// Returns the files that flags name.
    pub fn files(&self) -> Vec<PathBuf> {
        let transfers = Own::values(&self.transfer).filter(|transfer| is_file(transfer));
        transfers.map(PathBuf::from).chain(self.kernel.file()).collect()
    }

    pub fn open(&self, limits: &Limits) -> Result<Show<'_>, Failure> {
        let own = self.transfer.iter();
        let own = own.map(|own| own.try_map(|text| open(text, limits)));
        let transfers = own.collect::<Result<Vec<_>, _>>()?;
        let surfaces = self.iso.iter().map(|own| own.try_map(|surfaces| Ok(&surfaces[..])));
        let show = Show {
            flags: self,
            kernel: self.kernel.kernel(limits)?,
            sharp: self.kernel.is_sharp(),
            transfers: own::Values::new(transfers),
            ranges: own::Values::new(self.range.iter().cloned()),
            surfaces: own::Values::new(surfaces.collect::<Result<Vec<_>, _>>()?),
            opacities: own::Values::new(self.opacity.iter().cloned()),
            colors: self.color.by_input(),
        };
        show.check_surfaces()?;
        Ok(show)
    }
}

/// Reads the transfer function that a name, a file or a text of JSON stands for.
fn open(text: &str, limits: &Limits) -> Result<Transfer, Failure> {
    if is_json(text) {
        return Ok(Transfer::Whole(TransferFunction::from_json(text)?));
    }
    if !TransferFunction::NAMES.contains(&text) && is_file(text) {
        return Ok(Transfer::Whole(TransferFunction::read(Path::new(text), limits)?));
    }
    // An unknown name fails here. The range comes later, with the volume.
    TransferFunction::named(text, [0.0, 1.0])?;
    Ok(Transfer::Named(text.to_owned()))
}

/// Parses how values are shown. A text of JSON has no `=`.
fn transfer(text: &str) -> Result<Own<String>, String> {
    match is_json(text) {
        true => Ok(Own::of_all(text.to_owned())),
        false => Own::parse(text, |text| Ok(text.to_owned())),
    }
}

/// Parses a range of values.
fn range(text: &str) -> Result<Own<[f64; 2]>, String> {
    Own::parse(text, parse::range)
}

/// Parses isosurfaces.
fn surfaces(text: &str) -> Result<Own<Vec<Surface>>, String> {
    Own::parse(text, |text| text.split(',').map(surface).collect())
}

/// Parses an opacity.
fn opacity(text: &str) -> Result<Own<f32>, String> {
    Own::parse(text, |text| match parse::finite(text)? {
        opacity if opacity > 0.0 && opacity <= 1.0 => Ok(opacity as f32),
        _ => Err("an opacity lies above 0, up to 1".into()),
    })
}

/// Formats a number as people type it.
fn plain(value: f64) -> String {
    if value == 0.0 || (1e-4..1e16).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

/// Whether a text is a transfer function itself, rather than the name of one.
fn is_json(text: &str) -> bool {
    text.trim_start().starts_with('{')
}

fn is_file(text: &str) -> bool {
    !is_json(text) && (Path::new(text).extension().is_some() || Path::new(text).exists())
}

impl Show<'_> {
    /// Refuses more isosurfaces of an input than a transfer function can have.
    fn check_surfaces(&self) -> Result<(), Failure> {
        // No input has an empty path: that stands for the inputs without values of their own.
        let files = self.surfaces.files().chain(self.transfers.files()).chain([Path::new("")]);
        for file in files {
            let more = match self.transfers.of(file) {
                Some(Transfer::Whole(transfer)) => transfer.isosurfaces.len(),
                _ => 0,
            };
            let count = self.surfaces_of(file).len() + more;
            let most = TransferFunction::MAX_ISOSURFACES;
            if count > most {
                return Err(Failure::Usage(format!(
                    "{count} isosurfaces are given; at most {most} are allowed"
                )));
            }
        }
        Ok(())
    }

    /// Returns how an input is coloured.
    pub fn coloring_of(&self, path: &Path) -> Coloring {
        self.flags.color.coloring_by(self.colors.of(path), self.ranges.of(path).copied())
    }

    /// Returns the isosurfaces of an input.
    fn surfaces_of(&self, path: &Path) -> Vec<Surface> {
        self.surfaces.all_of(path).concat()
    }

    /// Returns a flag that shows values, if one is given for an input, which may have colours of
    /// its own.
    fn shows_values(&self, path: &Path) -> Option<&'static str> {
        let has_transfer = self.transfers.of(path).is_some();
        let given = [
            ("--transfer", has_transfer),
            ("--iso", !self.surfaces_of(path).is_empty()),
            ("--range", self.ranges.of(path).is_some()),
            ("--sharp", self.sharp),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(flag, _)| flag)
    }

    /// Returns how the values and the surfaces of an input are shown.
    pub fn appearance(&self, path: &Path) -> Appearance {
        let factors = self.flags.gradient_opacity.clone();
        Appearance {
            transfer: self.transfers.of(path).cloned(),
            opacity_unit: self.flags.opacity_unit,
            isosurfaces: self.surfaces_of(path),
            gradient: factors.map(|Factors(factors)| factors).unwrap_or_default(),
            coloring: self.coloring_of(path),
        }
    }

    /// Returns how an input is shown.
    pub fn showing(&self, path: &Path) -> Showing {
        Showing {
            appearance: self.appearance(path),
            kernel: self.kernel.clone(),
            is_sharp: self.sharp,
            radius_scale: self.flags.radius_scale,
            crease: self.flags.crease,
            points: self.flags.points.unwrap_or(PointStyle::Auto),
            point_size: self.flags.point_size,
            point_radius: self.flags.point_radius.clone(),
            line_width: self.flags.line_width,
            opacity: self.opacities.of(path).copied(),
            draws_edges: self.flags.edges,
            values_by: self.shows_values(path).map(str::to_owned),
            ..Showing::default()
        }
    }
}

/// Parses an isosurface: `80`, `50%`, `80:orange`, `80:0.5` or `80:#ff8800:0.5`.
fn surface(text: &str) -> Result<Surface, String> {
    let form = "the form is VALUE, VALUE:COLOR, VALUE:OPACITY or VALUE:COLOR:OPACITY, such \
                as 400:orange:0.5";
    let mut parts = text.split(':').peekable();
    let text = parts.next().unwrap_or_default().trim();
    let number = |text: &str| parse::finite(text).map_err(|_| form);
    let value = match text.strip_suffix('%') {
        None => SurfaceValue::Own(number(text)?),
        Some(share) => SurfaceValue::Share(number(share)? / 100.0),
    };
    if matches!(value, SurfaceValue::Share(share) if !(0.0..=1.0).contains(&share)) {
        return Err("a share of the range of values lies between 0% and 100%".into());
    }
    // A number is an opacity, although its digits may look like a colour.
    let is_color = |part: &&str| !part.is_empty() && parse::finite(part).is_err();
    let color = match parts.next_if(is_color) {
        Some(text) => Some(parse::color(text)?.map(f64::from)),
        None => None,
    };
    let opacity = match parts.next() {
        Some(text) => parse::finite(text).map_err(|_| form)?,
        None => 1.0,
    };
    if !(opacity > 0.0 && opacity <= 1.0) {
        return Err("the opacity of a surface must be above 0 and at most 1".into());
    }
    if parts.next().is_some() { Err(form.into()) } else { Ok(Surface { value, color, opacity }) }
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

    #[test]
    fn surfaces_are_read() {
        assert_eq!(
            surface("-500"),
            Ok(Surface { value: SurfaceValue::Own(-500.0), color: None, opacity: 1.0 })
        );
        assert_eq!(
            surface("0.5:0.25"),
            Ok(Surface { value: SurfaceValue::Own(0.5), color: None, opacity: 0.25 })
        );
        assert_eq!(
            surface("80:#ff0000"),
            Ok(Surface {
                value: SurfaceValue::Own(80.0),
                color: Some([1.0, 0.0, 0.0]),
                opacity: 1.0
            })
        );
        assert_eq!(
            surface("80:#00ff00:0.5"),
            Ok(Surface {
                value: SurfaceValue::Own(80.0),
                color: Some([0.0, 1.0, 0.0]),
                opacity: 0.5
            })
        );
        for text in ["80:lime:0.5", "80:0f0:0.5"] {
            assert_eq!(surface(text), surface("80:#00ff00:0.5"), "{text}");
        }
        assert_eq!(surface("50%:0.5").map(|surface| surface.value), Ok(SurfaceValue::Share(0.5)));
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
        let [own, other] = ["a=b.nrrd", "c.nrrd"].map(Path::new);
        let all = ["-5,50%:red", "a=b.nrrd=7:0.5"].map(|text| surfaces(text).unwrap());
        let all = own::Values::new(all);
        let of = |path| -> Vec<SurfaceValue> {
            all.all_of(path).iter().flatten().map(|surface| surface.value).collect()
        };
        assert_eq!(of(own), [SurfaceValue::Own(7.0)]);
        assert_eq!(of(other), [SurfaceValue::Own(-5.0), SurfaceValue::Share(0.5)]);
        assert!(surfaces("a.nrrd=x").is_err() && surfaces("1,").is_err());
        let whole = r#"{"color": [], "opacity": []}"#;
        assert_eq!(transfer(whole), Ok(Own::of_all(whole.to_owned())));
        let text = transfer(&format!("a=b.nrrd={whole}")).unwrap();
        assert_eq!(Own::of(std::slice::from_ref(&text), own).map(String::as_str), Some(whole));
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
