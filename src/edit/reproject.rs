//! Points in another coordinate reference system.
//!
//! Systems are known by their EPSG codes or as PROJ strings. The crates `crs-definitions` and
//! `proj4rs` know the projections; heights stay as they are. Shifts between datums are those of
//! PROJ strings: three or seven numbers, without grids.

use crate::{Error, Result};
use glam::{DMat3, DVec2, DVec3};
use std::{fmt, str::FromStr};

use super::Context;

/// A coordinate reference system.
#[derive(Debug, Clone, PartialEq)]
pub struct Crs {
    /// `EPSG:25832`, or a PROJ string.
    text: String,
    code: Option<u16>,
    /// The PROJ string.
    definition: String,
}

/// A change of the coordinate reference system.
#[derive(Debug, Clone, PartialEq)]
pub struct Reprojection {
    /// The system of the points; by default what the file says.
    pub from: Option<Crs>,
    /// The wanted system.
    pub to: Crs,
}

impl Crs {
    /// Returns the EPSG code, if the system is known by one.
    pub fn code(&self) -> Option<u16> {
        self.code
    }

    /// Returns whether coordinates are longitudes and latitudes in degrees.
    pub fn is_geographic(&self) -> bool {
        self.definition.contains("+proj=longlat") || self.definition.contains("+proj=latlong")
    }

    /// Returns the system that a file states; `None` if it names none with an EPSG code.
    fn stated(text: &str) -> Option<Result<Self, String>> {
        let at = text.rfind("EPSG:")?;
        let code: String = text[at + 5..].chars().take_while(char::is_ascii_digit).collect();
        Some(format!("EPSG:{code}").parse())
    }
}

impl fmt::Display for Crs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// What errors about unknown systems advise.
const ADVICE: &str = "filters.reprojection of PDAL knows all systems";

impl FromStr for Crs {
    type Err = String;

    /// Reads an EPSG code, `EPSG:25832`, or a PROJ string, `+proj=utm +zone=32 +ellps=GRS80`.
    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (code, definition) = if text.starts_with("+proj=") {
            (None, text.to_owned())
        } else {
            let number = text.get(..5).filter(|name| name.eq_ignore_ascii_case("epsg:"));
            let code = number.and_then(|_| text[5..].trim().parse::<u32>().ok());
            let Some(code) = code else {
                return Err(format!(
                    "“{text}” is no coordinate reference system; the forms are EPSG:25832 and \
                     '+proj=utm +zone=32 +ellps=GRS80'"
                ));
            };
            let unknown = || format!("EPSG:{code} is not known here; {ADVICE}");
            let short = u16::try_from(code).map_err(|_| unknown())?;
            (Some(short), known::definition(short).ok_or_else(unknown)?.to_owned())
        };
        known::check(&definition).map_err(|wrong| format!("{text}: {wrong}; {ADVICE}"))?;
        let text = code.map_or_else(|| text.to_owned(), |code| format!("EPSG:{code}"));
        Ok(Self { text, code, definition })
    }
}

impl FromStr for Reprojection {
    type Err = String;

    /// Reads the wanted system, `EPSG:4326`, or the system before it, too:
    /// `EPSG:25832 to EPSG:4326`.
    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text.split_once(" to ") {
            Some((from, to)) => Self { from: Some(from.parse()?), to: to.parse()? },
            None => Self { from: None, to: text.parse()? },
        })
    }
}

impl Reprojection {
    /// Returns how places are mapped, for a scene whose file says `context.crs`.
    ///
    /// # Errors
    /// [`Error::Input`] for a file that does not say its system.
    pub(super) fn mapping(&self, context: &Context) -> Result<Mapping> {
        const PLACE: &str = "--reproject";
        let wrong = |message: String| {
            let hint = "--from-crs EPSG:… names the system of the points";
            Error::input(&context.file, PLACE, message).hint(hint)
        };
        let from = match (&self.from, Crs::stated(&context.crs)) {
            (Some(from), _) => from.clone(),
            (None, Some(stated)) => stated.map_err(wrong)?,
            (None, None) if context.crs.is_empty() => {
                return Err(wrong("the file does not say its coordinate reference system".into()));
            }
            (None, None) => {
                return Err(wrong(format!(
                    "the coordinate reference system of the file, “{}”, has no EPSG code",
                    context.crs
                )));
            }
        };
        let systems = known::Systems::new(&from.definition, &self.to.definition);
        let systems =
            systems.map_err(|message| wrong(format!("{from} to {}: {message}", self.to)))?;
        // A step in which a projection is straight: of metres, feet or degrees.
        let step = if from.is_geographic() { 1e-5 } else { 1.0 };
        let pair = format!("from {from} to {}", self.to);
        Ok(Mapping { systems, step, pair, context: context.clone() })
    }
}

/// How places are mapped from one system to another.
pub struct Mapping {
    systems: known::Systems,
    step: f64,
    pair: String,
    context: Context,
}

impl Mapping {
    /// Returns where a place is in the wanted system. Heights stay.
    ///
    /// # Errors
    /// [`Error::Input`] for a place that has none there.
    pub fn place(&self, place: DVec3) -> Result<DVec3> {
        self.flat(place).map(|at| at.extend(place.z)).ok_or_else(|| {
            let message = format!("{place} has no place {}", self.pair);
            Error::input(&self.context.file, "--reproject", message)
                .hint("--from-crs EPSG:… names the system of the points")
        })
    }

    fn flat(&self, place: DVec3) -> Option<DVec2> {
        let at = DVec2::from(self.systems.map([place.x, place.y])?);
        at.is_finite().then_some(at)
    }

    /// Returns the linear map around a place.
    pub fn linear(&self, place: DVec3) -> DMat3 {
        let axis = |axis: DVec3| {
            let ends = [-0.5, 0.5].map(|half| self.flat(place + half * self.step * axis));
            let [Some(low), Some(high)] = ends else { return axis };
            ((high - low) / self.step).extend(0.0)
        };
        DMat3::from_cols(axis(DVec3::X), axis(DVec3::Y), DVec3::Z)
    }
}

#[cfg(feature = "reproject")]
mod known {
    use proj4rs::Proj;

    /// Returns the PROJ string of an EPSG code.
    pub fn definition(code: u16) -> Option<&'static str> {
        crs_definitions::from_code(code).map(|found| found.proj4).filter(|text| !text.is_empty())
    }

    pub fn check(definition: &str) -> Result<(), String> {
        let system = Proj::from_proj_string(definition).map_err(|error| error.to_string())?;
        match system.is_geocent() {
            true => Err("a geocentric system has no heights that could stay".into()),
            false => Ok(()),
        }
    }

    /// The system of the points, and the wanted one.
    pub struct Systems([Proj; 2]);

    impl Systems {
        pub fn new(from: &str, to: &str) -> Result<Self, String> {
            let system = |text| Proj::from_proj_string(text).map_err(|error| error.to_string());
            let systems = Self([system(from)?, system(to)?]);
            match systems.0[0].has_inverse() {
                true => Ok(systems),
                false => Err("the projection of the points has no inverse".into()),
            }
        }

        pub fn map(&self, place: [f64; 2]) -> Option<[f64; 2]> {
            let Self([from, to]) = self;
            let [x, y] = if from.is_latlong() { place.map(f64::to_radians) } else { place };
            let mut at = (x, y, 0.0);
            proj4rs::transform::transform(from, to, &mut at).ok()?;
            let at = [at.0, at.1];
            Some(if to.is_latlong() { at.map(f64::to_degrees) } else { at })
        }
    }
}

#[cfg(not(feature = "reproject"))]
mod known {
    const ABSENT: &str = "this build has no projections: it lacks the feature “reproject”";

    pub fn definition(_: u16) -> Option<&'static str> {
        Some("+proj=longlat")
    }

    pub fn check(_: &str) -> Result<(), String> {
        Err(ABSENT.into())
    }

    pub struct Systems;

    impl Systems {
        pub fn new(_: &str, _: &str) -> Result<Self, String> {
            Err(ABSENT.into())
        }

        pub fn map(&self, _: [f64; 2]) -> Option<[f64; 2]> {
            None
        }
    }
}

#[cfg(all(test, feature = "reproject"))]
mod tests {
    use super::*;

    fn mapping(text: &str, crs: &str) -> Result<Mapping> {
        let context = Context { crs: crs.into(), ..Context::default() };
        text.parse::<Reprojection>().expect("systems").mapping(&context)
    }

    /// The places are those of PROJ 9.5 (pyproj 3.7).
    #[test]
    fn places_are_those_of_proj() {
        for (text, from, to) in [
            ("EPSG:25832 to EPSG:4326", [565000.0, 5934000.0], [9.981100311, 53.550862883]),
            ("EPSG:32633 to EPSG:3857", [400000.0, 5800000.0], [1506388.90819, 6862050.9857]),
            ("EPSG:25832 to EPSG:3035", [565000.0, 5934000.0], [4319747.18446, 3382575.50884]),
            ("EPSG:4326 to EPSG:2227", [-122.3, 37.8], [6041635.26279, 2118761.24088]),
            ("EPSG:2263 to EPSG:3857", [980000.0, 200000.0], [-8239348.95952, 4970487.12978]),
            ("EPSG:2154 to EPSG:4326", [650000.0, 6860000.0], [2.318790597, 48.838110123]),
            ("EPSG:2056 to EPSG:4326", [2600000.0, 1200000.0], [7.438632421, 46.951082772]),
            ("EPSG:5070 to EPSG:26912", [-1200000.0, 1900000.0], [577646.16434, 4352718.93971]),
            ("EPSG:3413 to EPSG:4326", [500000.0, -500000.0], [0.0, 83.479260988]),
            ("EPSG:2193 to EPSG:4326", [1750000.0, 5900000.0], [174.686535548, -37.034234427]),
        ] {
            let at = mapping(text, "").unwrap().place(DVec3::new(from[0], from[1], 12.5)).unwrap();
            let degrees = text.ends_with("4326");
            let unit = if degrees { 111_320.0 } else { 1.0 };
            let miss = unit * at.truncate().distance(DVec2::from(to));
            assert!(miss < 0.001 && at.z == 12.5, "{text}: {at} is {miss} m off");
            let (one, other) = text.split_once(" to ").unwrap();
            let back = mapping(&format!("{other} to {one}"), "").unwrap().place(at).unwrap();
            let unit = if one.ends_with("4326") { 111_320.0 } else { 1.0 };
            assert!(unit * back.truncate().distance(DVec2::from(from)) < 0.002, "{text}: {back}");
        }
    }

    #[test]
    fn the_system_of_the_file_counts_unless_another_is_named() {
        let place = DVec3::new(565_000.0, 5_934_000.0, 3.0);
        let stated = mapping("EPSG:4326", "ETRS89 / UTM zone 32N (EPSG:25832)").unwrap();
        let named = mapping("EPSG:25832 to EPSG:4326", "EPSG:32633").unwrap();
        assert_eq!(stated.place(place).unwrap(), named.place(place).unwrap());
        let local = stated.linear(place);
        assert!((111_320.0 * local.y_axis.y - 1.0).abs() < 0.01, "{local}");
        for (text, crs, word) in [
            ("EPSG:4326", "", "does not say its coordinate"),
            ("EPSG:4326", "a local grid", "“a local grid”, has no EPSG code"),
            ("EPSG:4326", "EPSG:64999", "EPSG:64999 is not known here"),
        ] {
            let error = mapping(text, crs).err().expect("an error").to_string();
            assert!(error.contains(word) && error.contains("--reproject"), "{text}: {error}");
        }
        let far = mapping("EPSG:4326 to EPSG:3857", "").unwrap().place(DVec3::new(0.0, 91.0, 0.0));
        assert!(far.unwrap_err().to_string().contains("has no place from EPSG:4326 to EPSG:3857"));
    }

    #[test]
    fn unknown_systems_are_named() {
        for (text, word) in [
            ("", "“” is no coordinate"),
            ("UTM32", "“UTM32” is no coordinate"),
            ("EPSG:64999", "PDAL"),
            ("EPSG:99999999", "EPSG:99999999 is not known here"),
            ("EPSG:4978", "geocentric"),
            ("+proj=nonsense", "PDAL"),
            ("EPSG:4326 to ", "“” is no coordinate"),
        ] {
            let message = text.parse::<Reprojection>().unwrap_err();
            assert!(message.contains(word), "{text}: {message}");
        }
    }
}
