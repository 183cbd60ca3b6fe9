//! Values of flags that are more than a word or a number.

use clap::builder::{PathBufValueParser, TypedValueParser};
use glam::DVec3;
use splatkit::{
    formats::{Endian, SampleType},
    input::address,
    surface::{PointStyle, SurfelOptions},
};
use std::{path::PathBuf, str::FromStr};

/// Parses exactly `N` numbers with a separator between them.
pub fn numbers<T: FromStr, const N: usize>(
    text: &str,
    separator: char,
    form: &str,
) -> Result<[T; N], String> {
    let parts: Option<Vec<T>> =
        text.split(separator).map(|part| part.trim().parse().ok()).collect();
    parts.and_then(|parts| parts.try_into().ok()).ok_or_else(|| format!("the form is {form}"))
}

/// A path, or an address without its secrets.
pub fn input() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(address)
}

/// `1280x720`.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let size = numbers(text, 'x', "WIDTHxHEIGHT, such as 1280x720")?;
    if size.contains(&0) {
        Err("a picture needs a width and a height above 0".into())
    } else {
        Ok(size)
    }
}

/// `256x256x128`, or with commas.
pub fn dims(text: &str) -> Result<[usize; 3], String> {
    numbers(&text.replace(',', "x"), 'x', "XxYxZ, such as 256x256x128")
}

/// `1,2.5,-3`.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let vector = DVec3::from_array(numbers(text, ',', "X,Y,Z, such as 1,2.5,-3")?);
    if vector.is_finite() { Ok(vector) } else { Err("the numbers must be finite".into()) }
}

/// A length above 0 for each axis, or one for all axes.
pub fn spacing(text: &str) -> Result<DVec3, String> {
    let spacing = match text.parse::<f64>() {
        Ok(all) => DVec3::splat(all),
        Err(_) => vector(text)?,
    };
    let fine = spacing.is_finite() && spacing.min_element() > 0.0;
    if fine { Ok(spacing) } else { Err("a spacing is a length above 0".into()) }
}

/// `LOW,HIGH`.
pub fn range(text: &str) -> Result<[f64; 2], String> {
    let [low, high]: [f64; 2] = numbers(text, ',', "LOW,HIGH, such as 0,255")?;
    if !(low.is_finite() && high.is_finite() && low <= high) {
        return Err("a range is LOW,HIGH with LOW not above HIGH".into());
    }
    // Positions in the range are shares of its width.
    if (high - low).is_finite() {
        Ok([low, high])
    } else {
        Err("LOW and HIGH are too far apart to subtract".into())
    }
}

/// A colour, as [`splatkit::color::parse`] reads it.
pub fn color(text: &str) -> Result<[f32; 3], String> {
    splatkit::color::parse(text)
}

/// `+X`, `-y`, `Z`, …
pub fn axis(text: &str) -> Result<DVec3, String> {
    let (sign, name) = match text.strip_prefix('-') {
        Some(name) => (-1.0, name),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let axis = match name {
        "x" | "X" => DVec3::X,
        "y" | "Y" => DVec3::Y,
        "z" | "Z" => DVec3::Z,
        _ => return Err("an axis is one of +X, -X, +Y, -Y, +Z, -Z".into()),
    };
    Ok(sign * axis)
}

/// An axis, or a direction as `X,Y,Z`.
pub fn direction(text: &str) -> Result<DVec3, String> {
    if !text.contains(',') {
        return axis(text).map_err(|message| message + ", and a direction is X,Y,Z");
    }
    vector(text)?.try_normalize().ok_or_else(|| "a direction needs a length above 0".into())
}

/// A number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|v: &f64| *v > 0.0 && v.is_finite())
        .ok_or_else(|| "a number above 0 is needed".into())
}

/// A factor for radii.
pub fn radius_scale(text: &str) -> Result<f32, String> {
    let scales = SurfelOptions::RADIUS_SCALES;
    let fits = text.parse().ok().filter(|scale| scales.contains(scale));
    fits.ok_or_else(|| {
        format!("a number from {:e} to {:e} is needed", scales.start(), scales.end())
    })
}

/// How points are drawn.
pub fn points(text: &str) -> Result<PointStyle, String> {
    text.parse()
}

/// Degrees from 0 to 180.
pub fn crease(text: &str) -> Result<f32, String> {
    let fits = text.parse().ok().filter(|angle: &f32| (0.0..=180.0).contains(angle));
    fits.ok_or_else(|| "an angle from 0 to 180 degrees is needed".into())
}

/// A number of neighbours of a sample.
pub fn neighbours(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|count| (4..=64).contains(count))
        .ok_or_else(|| "a number from 4 to 64 is needed".into())
}

/// A number of at least 0.
pub fn not_negative(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|v: &f64| *v >= 0.0 && v.is_finite())
        .ok_or_else(|| "a number of at least 0 is needed".into())
}

/// `1000000`, `512MiB`, `1.5GiB`, `20MB`, …
pub fn bytes(text: &str) -> Result<u64, String> {
    let (number, unit) =
        text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len()));
    let factor = match unit.to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kib" => 1024.0,
        "m" | "mib" => 1024.0 * 1024.0,
        "g" | "gib" => 1024.0 * 1024.0 * 1024.0,
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        _ => return Err("the units are KiB, MiB and GiB, and KB, MB and GB".into()),
    };
    let number = positive(number.trim())
        .map_err(|_| "a number of bytes, such as 512MiB, is needed".to_owned())?;
    Ok((number * factor) as u64)
}

/// A number.
pub fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| "a number is needed".into())
}

/// Frames per second.
pub fn rate(text: &str) -> Result<f64, String> {
    let fits = text.parse().ok().filter(|rate: &f64| (0.1..=1000.0).contains(rate));
    fits.ok_or_else(|| "a number from 0.1 to 1000 is needed".into())
}

/// Degrees between 0 and 180.
pub fn view_angle(text: &str) -> Result<f64, String> {
    positive(text)
        .ok()
        .filter(|angle| *angle < 180.0)
        .ok_or_else(|| "an angle between 0 and 180 degrees is needed".into())
}

/// `u8`, `i16`, `f32`, …
pub fn sample_type(text: &str) -> Result<SampleType, String> {
    SampleType::from_name(text)
        .ok_or_else(|| "use u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64".into())
}

/// `little` or `big`.
pub fn endian(text: &str) -> Result<Endian, String> {
    match text {
        "little" => Ok(Endian::Little),
        "big" => Ok(Endian::Big),
        _ => Err("use little or big".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_dims_and_vectors() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        assert_eq!(dims("64,64,93"), dims("64x64x93"));
        assert_eq!(vector("1, -2.5,3e2"), Ok(DVec3::new(1.0, -2.5, 300.0)));
        assert_eq!(spacing("0.5"), Ok(DVec3::splat(0.5)));
        for bad in ["", "12", "1x2x3", "0x4", "-1x4", "99999999999x1"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        for bad in ["1,2", "1,2,3,4", "1,2,nan", "a,b,c"] {
            assert!(vector(bad).is_err(), "{bad}");
        }
        assert!(spacing("0,1,1").is_err() && range("2,1").is_err() && range("1,1").is_ok());
        assert!(range("-1e308,1e308").unwrap_err().contains("too far apart"));
    }

    #[test]
    fn axes_are_read() {
        assert_eq!(
            (axis("+Z"), axis("-x"), axis("Y")),
            (Ok(DVec3::Z), Ok(DVec3::NEG_X), Ok(DVec3::Y))
        );
        assert!(axis("+W").is_err() && axis("").is_err());
    }
}
