//! Dimension scales: where the samples of a data set lie along its dimensions, as NetCDF-4 and h5py
//! write them.
//!
//! The crate does not follow the references by which a data set names its scales. A scale is
//! therefore found by its length. Scales of one length are told apart by their roles (`axis`,
//! `units`, `standard_name` and usual names), which come in the order t, z, y, x.

use super::{
    attributes::Attributes,
    file::{File, StoredSet},
    number_type,
};
use crate::{
    Result,
    formats::{ReadOptions, shared::length::meters},
    input::Source,
    volume::{Arrangement, Lattice, Volume},
    warning,
};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// A step that differs from the mean by less than this part of it is even.
const EVEN: f64 = 1e-3;

/// What a dimension is, in the usual order of dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    T,
    Z,
    Y,
    X,
}

/// The scale of one dimension.
#[derive(Clone)]
struct Scale<'a> {
    name: &'a str,
    set: &'a StoredSet,
    role: Option<Role>,
    unit: String,
    /// Whether its values grow downwards.
    is_down: bool,
}

/// The scales of the dimensions of a data set, slowest first.
pub struct Coordinates<'a> {
    scales: Vec<Option<Scale<'a>>>,
}

/// Where the samples along one axis lie.
struct Places {
    values: Vec<f64>,
    unit: String,
}

impl<'a> Scale<'a> {
    /// Returns a data set as a scale; `None` if it is none.
    fn of(set: &'a StoredSet) -> Option<Self> {
        let text = |name: &str| {
            let value = set.attributes.get(name).and_then(|value| value.as_str());
            value.unwrap_or_default().trim().to_owned()
        };
        if text("CLASS") != "DIMENSION_SCALE" || set.shape.len() != 1 {
            return None;
        }
        let name = set.path.rsplit('/').next().unwrap_or_default();
        let unit = text("units");
        let positive = text("positive").to_ascii_lowercase();
        let role = role(&text("axis"), &unit, &positive, &text("standard_name"), name);
        let is_pressure = matches!(plain_unit(&unit).as_str(), "Pa" | "hPa" | "mbar" | "dbar");
        let is_down = positive == "down" || is_pressure && positive != "up";
        Some(Self { name, set, role, unit, is_down })
    }

    /// Whether it only gives a dimension a name.
    fn is_empty(&self) -> bool {
        let name = self.set.attributes.get("NAME").and_then(|value| value.as_str());
        name.is_some_and(|name| name.starts_with("This is a netCDF dimension but not"))
    }

    /// Reads its values; `None` if they do not place samples.
    fn places(&self, source: &Source, file: &File) -> Result<Option<Places>> {
        let Some((element, endian, inner)) = number_type(&self.set.datatype) else {
            return Ok(None);
        };
        if self.is_empty() || !inner.is_empty() {
            return Ok(None);
        }
        let size = self.set.shape[0].checked_mul(element.bytes() as u64);
        let bytes = file.bytes(self.set, size)?;
        source.room::<[f64; 3]>("the coordinates of a dimension", bytes.len() / element.bytes())?;
        let [scale, offset] = Attributes::of(&self.set.attributes).scale;
        let sign = if self.is_down { -1.0 } else { 1.0 };
        let values = element.doubles(&bytes, endian);
        let values: Vec<f64> = values.iter().map(|v| sign * (v * scale + offset)).collect();
        let ascends = values.windows(2).all(|pair| pair[0] < pair[1]);
        let descends = values.windows(2).all(|pair| pair[0] > pair[1]);
        let is_sound = values.iter().all(|v| v.is_finite()) && (ascends || descends);
        if !is_sound {
            let (path, name) = (source.path.display(), self.name);
            warning::give!("{path}: the coordinates “{name}” neither ascend nor descend");
            return Ok(None);
        }
        Ok(Some(Places { values, unit: plain_unit(&self.unit) }))
    }
}

/// Returns what a scale is for.
fn role(axis: &str, unit: &str, positive: &str, standard: &str, name: &str) -> Option<Role> {
    match axis {
        "X" | "x" => return Some(Role::X),
        "Y" | "y" => return Some(Role::Y),
        "Z" | "z" => return Some(Role::Z),
        "T" | "t" => return Some(Role::T),
        _ => {}
    }
    if unit.contains(" since ") {
        return Some(Role::T);
    }
    if !positive.is_empty() {
        return Some(Role::Z);
    }
    if unit.starts_with("degree") {
        let end = unit.trim_start_matches("degrees").trim_start_matches("degree");
        match end {
            "_north" | "_N" | "N" | "_n" => return Some(Role::Y),
            "_east" | "_E" | "E" | "_e" => return Some(Role::X),
            _ => {}
        }
    }
    let known = |name: &str| {
        let lower = name.to_ascii_lowercase();
        let word = lower.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
        Some(match word {
            "x" | "xc" | "lon" | "longitude" | "easting" | "projection_x_coordinate" => Role::X,
            "y" | "yc" | "lat" | "latitude" | "northing" | "projection_y_coordinate" => Role::Y,
            "z" | "zc" | "lev" | "level" | "levels" | "plev" | "depth" | "height" | "alt"
            | "altitude" | "elevation" | "pressure" | "air_pressure" => Role::Z,
            "t" | "time" | "times" => Role::T,
            _ => return None,
        })
    };
    known(standard).or_else(|| known(name))
}

/// Returns the sign of a unit; one sign for all degrees of the globe.
fn plain_unit(unit: &str) -> String {
    match unit {
        _ if unit.starts_with("degree") => "°",
        "metre" | "meter" | "meters" | "metres" => "m",
        "kilometre" | "kilometer" | "kilometers" | "kilometres" => "km",
        "millimetre" | "millimeter" | "millimeters" | "millimetres" => "mm",
        "um" | "micron" | "microns" | "micrometer" | "micrometers" => "µm",
        "millibar" | "millibars" | "mb" => "mbar",
        "1" => "",
        other => other,
    }
    .chars()
    .take(16)
    .collect()
}

impl<'a> Coordinates<'a> {
    /// Finds the scales of a data set among all data sets of its file: those of its group and of
    /// the groups around it.
    pub fn of(source: &Source, all: &'a [StoredSet], set: &StoredSet) -> Self {
        let mut scales: Vec<Option<Scale>> = vec![None; set.shape.len()];
        if !set.has_scales {
            return Self { scales };
        }
        let group = |path: &str| path.rsplit_once('/').map_or("", |(group, _)| group).to_owned();
        let parent = group(&set.path);
        let is_around = |scale: &Scale| {
            let around = group(&scale.set.path);
            around.is_empty() || parent == around || parent.starts_with(&format!("{around}/"))
        };
        let known: Vec<Scale> = all.iter().filter_map(Scale::of).filter(is_around).collect();
        let mut unclear = Vec::new();
        for dimension in 0..scales.len() {
            let size = set.shape[dimension];
            let is_alike = |&at: &usize| set.shape[at] == size;
            let alike: Vec<usize> = (0..scales.len()).filter(is_alike).collect();
            if alike[0] != dimension {
                continue;
            }
            let fits: Vec<&Scale> =
                known.iter().filter(|scale| scale.set.shape[0] == size).collect();
            match ordered(fits, alike.len()) {
                Ok(matches) => alike.iter().zip(matches).for_each(|(&at, scale)| {
                    scales[at] = Some(scale.clone());
                }),
                Err(names) if size > 1 => unclear.extend(names),
                Err(_) => {}
            }
        }
        if !unclear.is_empty() {
            let path = source.path.display();
            let names = unclear.join(", ");
            warning::give!(
                "{path}: which dimension of “{}” has which coordinates ({names}) is not clear; \
                 samples are one unit apart there, and --spacing sets other distances",
                set.path
            );
        }
        Self { scales }
    }

    /// Returns what the numbers along a dimension are called: “times”.
    pub fn names(&self, dimension: usize) -> String {
        match self.scales.get(dimension) {
            Some(Some(scale)) if scale.role != Some(Role::T) => {
                format!("volumes along “{}”", scale.name)
            }
            _ => "times".into(),
        }
    }

    /// Places the samples of a volume, whose axes x, y and z are these dimensions of the data set.
    /// Returns whether the file has coordinates.
    ///
    /// Axes whose unit differs from that of x have the mean step of x: degrees and metres have no
    /// common scale.
    pub fn apply(
        &self,
        source: &Source,
        file: &File,
        volume: &mut Volume,
        dimensions: [Option<usize>; 3],
        options: &ReadOptions,
    ) -> Result<bool> {
        let mut places = [const { None }; 3];
        for (places, dimension) in places.iter_mut().zip(dimensions) {
            if let Some(scale) = dimension.and_then(|at| self.scales[at].as_ref()) {
                *places = scale.places(source, file)?;
            }
        }
        if places.iter().all(Option::is_none) {
            return Ok(false);
        }
        let units = places.each_ref().map(|axis| axis.as_ref().map_or("", |axis| &axis.unit));
        let factors = factors(&places);
        if factors.iter().any(Option::is_none) && options.spacing.is_none() {
            let path = source.path.display();
            let [x, y, z] = units.map(|unit| if unit.is_empty() { "none" } else { unit });
            warning::give!(
                "{path}: the coordinates along x, y and z have different units ({x}, {y}, {z}); \
                 the mean step along x is drawn for others; --spacing sets distances"
            );
        }
        let lattice = lattice(volume.lattice.dims, &places, factors, options.spacing.is_some());
        lattice.check().map_err(|message| source.error("coordinates", message))?;
        volume.lattice = lattice;
        if factors == [Some(1.0); 3] || meters(units[0]).is_some() {
            volume.about.length = units[0].into();
        }
        Ok(true)
    }
}

/// Returns the scales of `count` dimensions of one length in their order, if they can be told
/// apart; else the names of those that fit.
fn ordered<'s, 'a>(
    mut fits: Vec<&'s Scale<'a>>,
    count: usize,
) -> Result<Vec<&'s Scale<'a>>, Vec<String>> {
    if fits.len() > count {
        fits.retain(|scale| scale.role.is_some());
    }
    let names = || fits.iter().map(|scale| scale.name.to_owned()).collect();
    if fits.len() != count {
        return Err(names());
    }
    if count == 1 {
        return Ok(fits);
    }
    let mut sorted = fits.clone();
    sorted.sort_by_key(|scale| scale.role);
    let is_known = sorted.iter().all(|scale| scale.role.is_some());
    let is_apart = sorted.windows(2).all(|pair| pair[0].role != pair[1].role);
    if is_known && is_apart { Ok(sorted) } else { Err(names()) }
}

/// Returns the factors that turn the coordinates of each axis into the unit of x; `None` for axes
/// whose unit has no such factor.
fn factors(places: &[Option<Places>; 3]) -> [Option<f64>; 3] {
    let first = places.iter().flatten().next().map_or("", |axis| axis.unit.as_str());
    places.each_ref().map(|axis| match axis {
        Some(axis) if axis.unit != first => Some(meters(&axis.unit)? / meters(first)?),
        _ => Some(1.0),
    })
}

/// Returns the lattice of samples at these places. Axes without places have steps of one.
fn lattice(
    dims: [usize; 3],
    places: &[Option<Places>; 3],
    factors: [Option<f64>; 3],
    are_equal: bool,
) -> Lattice {
    let mean = |values: &[f64]| {
        let steps = values.len().saturating_sub(1).max(1) as f64;
        let length = values[values.len() - 1] - values[0];
        if length == 0.0 { 1.0 } else { length / steps }
    };
    let first = places.iter().flatten().next();
    let common = first.map_or(1.0, |first| mean(&first.values).abs());
    let (mut origin, mut steps, mut signs) = (DVec3::ZERO, DVec3::ONE, DVec3::ONE);
    let mut all = [const { Vec::new() }; 3];
    let mut are_even = true;
    for axis in 0..3 {
        let count = dims[axis];
        let Some(coordinates) = &places[axis] else {
            all[axis] = (0..count).map(|at| at as f64).collect();
            continue;
        };
        let step = mean(&coordinates.values);
        let factor = factors[axis].unwrap_or(common / step.abs());
        origin[axis] = factors[axis].map_or(0.0, |factor| factor * coordinates.values[0]);
        steps[axis] = factor * step;
        signs[axis] = step.signum();
        let away = |(at, value): (usize, &f64)| {
            (value - coordinates.values[0] - at as f64 * step).abs()
                > EVEN * step.abs() + 4.0 * f64::from(f32::EPSILON) * value.abs()
        };
        let is_even = !coordinates.values.iter().enumerate().any(away);
        are_even &= is_even;
        let place = |at: usize| match is_even {
            true => at as f64 * (factor * step).abs(),
            false => factor * (coordinates.values[at] - coordinates.values[0]).abs(),
        };
        all[axis] = (0..count).map(place).collect();
    }
    if are_equal {
        return Lattice::cartesian(dims, origin, DMat3::from_diagonal(signs));
    }
    if are_even {
        return Lattice::cartesian(dims, origin, DMat3::from_diagonal(steps));
    }
    let arrangement = Arrangement::Rectilinear(Arc::new(all));
    Lattice { dims, origin, axes: DMat3::from_diagonal(signs), arrangement }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(values: &[f64], unit: &str) -> Option<Places> {
        Some(Places { values: values.to_vec(), unit: unit.into() })
    }

    #[test]
    fn roles_are_known_by_attributes_and_names() {
        for (axis, unit, positive, standard, name, expected) in [
            ("T", "", "", "", "x", Some(Role::T)),
            ("", "days since 1950-01-01", "", "", "n", Some(Role::T)),
            ("", "degrees_north", "", "", "a", Some(Role::Y)),
            ("", "degree_east", "", "", "a", Some(Role::X)),
            ("", "hPa", "down", "", "isobaric", Some(Role::Z)),
            ("", "", "", "projection_x_coordinate", "a", Some(Role::X)),
            ("", "", "", "", "lat_2", Some(Role::Y)),
            ("", "", "", "", "Depth", Some(Role::Z)),
            ("", "", "", "", "station", None),
        ] {
            assert_eq!(role(axis, unit, positive, standard, name), expected, "{name} {unit}");
        }
    }

    #[test]
    fn descending_coordinates_turn_the_axis() {
        let places = [at(&[10.0, 10.5, 11.0], ""), None, at(&[9.0, 6.0], "")];
        let lattice = lattice([3, 2, 2], &places, factors(&places), false);
        assert_eq!(lattice.position(DVec3::ZERO), DVec3::new(10.0, 0.0, 9.0));
        assert_eq!(lattice.position(DVec3::new(2.0, 1.0, 1.0)), DVec3::new(11.0, 1.0, 6.0));
    }

    #[test]
    fn uneven_steps_make_a_rectilinear_lattice() {
        let places = [at(&[0.0, 1.0], "m"), at(&[5.0, 4.0], "m"), at(&[-1.0, -2.0, -5.0], "m")];
        let lattice = lattice([2, 2, 3], &places, factors(&places), false);
        assert!(lattice.check().is_ok());
        for (sample, expected) in [(0, [0.0, 5.0, -1.0]), (11, [1.0, 4.0, -5.0])] {
            assert_eq!(lattice.sample_position(sample), DVec3::from(expected));
        }
    }

    #[test]
    fn units_of_length_are_converted_and_others_have_the_step_of_x() {
        let places = [at(&[0.0, 2.0], "km"), at(&[0.0, 500.0], "m"), at(&[0.0, 800.0], "hPa")];
        assert_eq!(factors(&places), [Some(1.0), Some(1e-3), None]);
        let lattice = lattice([2; 3], &places, factors(&places), false);
        assert_eq!(lattice.position(DVec3::ONE), DVec3::new(2.0, 0.5, 2.0));
    }
}
