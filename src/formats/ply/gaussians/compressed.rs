//! The compressed PLY of PlayCanvas. The numbers of a Gaussian are a few bits each: steps in the
//! ranges of its chunk, which has 256 Gaussians.
//!
//! The element `chunk` has the ranges, `vertex` has four words for each Gaussian, and `sh` has one
//! byte for each coefficient of the harmonics above the constant.

use super::{
    super::{
        header::{Element, Header},
        table::Table,
    },
    log_of_scale, named, needed, rest, rest_number, rows_of,
};
use crate::{
    Error, Result, disk,
    formats::shared::{
        curve::order,
        trained::{Trained, check_places, settle},
    },
    gaussians::{
        Gaussians,
        harmonics::{CONSTANT, constant_of, terms},
    },
    input::Source,
    math::keep::single,
    memory,
};
use glam::{DVec3, Quat, Vec3};
use ply_rs::ply::{PropertyType, ScalarType};
use std::{
    array::from_fn,
    f64::consts::{FRAC_1_SQRT_2, SQRT_2},
    io::Write,
    path::Path,
};

/// Gaussians of a chunk; the last may have fewer.
const CHUNK: usize = 256;

/// The properties of a chunk, in the order of [`Ranges`]. Old files have no ranges of colours; they
/// are from 0 to 1.
const RANGES: [&str; 18] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
    "min_r",
    "min_g",
    "min_b",
    "max_r",
    "max_g",
    "max_b",
];
/// Properties of a chunk without colours.
const WITHOUT_COLORS: usize = 12;

/// The properties of a Gaussian.
const WORDS: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

/// The smallest and the largest of positions, logarithms of deviations and colours.
type Ranges<T> = [[[T; 3]; 2]; 3];
const POSITION: usize = 0;
const SCALE: usize = 1;
const COLOR: usize = 2;

/// The place and the number of the bits of each part of a word, for positions and deviations.
const THREE: [[u32; 2]; 3] = [[21, 11], [11, 10], [0, 11]];
/// The same for colours. The lowest bits are the opacity.
const PAINT: [[u32; 2]; 3] = [[24, 8], [16, 8], [8, 8]];

/// Most of a logarithm of a deviation that is written.
const MOST_LOG: f32 = 20.0;

/// Returns whether the elements are those of compressed Gaussians.
pub(super) fn are_compressed(header: &Header) -> bool {
    let has = |element: &str, property: &str| {
        named(header, element).is_some_and(|element| element.column(&[property]).is_some())
    };
    has("chunk", RANGES[0]) && has("vertex", WORDS[0])
}

pub(super) fn read(source: &Source, header: &Header) -> Result<Gaussians> {
    let element = |name: &str| {
        let missing = || source.error("header", format!("has no element “{name}”"));
        named(header, name).ok_or_else(missing)
    };
    let (chunk, vertex) = (element("chunk")?, element("vertex")?);
    let count = source.check_points("the number of Gaussians", vertex.count as u64)?;
    if chunk.count != count.div_ceil(CHUNK) {
        let message = format!(
            "the element “chunk” has {} rows, but {count} Gaussians need {}",
            chunk.count,
            count.div_ceil(CHUNK)
        );
        return Err(source.error("header", message));
    }
    let ranges = ranges(source, header, chunk)?;
    let columns = WORDS.iter().map(|name| word_column(source, vertex, name).map(Some));
    let columns = columns.collect::<Result<Vec<_>>>()?;
    let rows = rows_of(source, header, vertex)?;
    let words = Table::read(source, vertex, &rows, &columns)?;
    let (degree, rest) = harmonics(source, header, count)?;
    let terms = terms(degree);
    settle(source, count, degree, |row, colors| {
        let [position, turn, scale, paint] =
            [0, 1, 2, 3].map(|word| words.value(row, word) as i64 as u32);
        let ranges = &ranges[row / CHUNK];
        let hue = within(&ranges[COLOR], PAINT.map(|bits| part(paint, bits)));
        for (term, color) in colors.iter_mut().enumerate() {
            *color = [0, 1, 2].map(|channel| match (&rest, term) {
                (Some(table), 1..) => {
                    coefficient(table.value(row, rest_number(terms, term, channel)) as u8)
                }
                _ => constant_of(hue[channel] as f32),
            });
        }
        let scale = within(&ranges[SCALE], THREE.map(|bits| part(scale, bits)));
        Ok(Trained {
            center: DVec3::from(within(&ranges[POSITION], THREE.map(|bits| part(position, bits)))),
            scale: Vec3::from(scale.map(|log| log.exp() as f32)),
            rotation: rotation(turn),
            opacity: part(paint, [0, 8]) as f32,
        })
    })
}

/// Returns the ranges of all chunks. Their number was checked.
fn ranges(source: &Source, header: &Header, chunk: &Element) -> Result<Vec<Ranges<f64>>> {
    let has_colors = RANGES[WITHOUT_COLORS..].iter().any(|name| chunk.column(&[name]).is_some());
    let names = if has_colors { &RANGES[..] } else { &RANGES[..WITHOUT_COLORS] };
    let columns = names.iter().map(|name| needed(source, chunk, name).map(Some));
    let columns = columns.collect::<Result<Vec<_>>>()?;
    let rows = rows_of(source, header, chunk)?;
    let table = Table::read(source, chunk, &rows, &columns)?;
    source.room::<Ranges<f64>>("the ranges of the chunks", chunk.count)?;
    let value = |row: usize, group: usize, end: usize, axis: usize| {
        let column = 6 * group + 3 * end + axis;
        if column < columns.len() { table.value(row, column) } else { end as f64 }
    };
    let of_row = |row: usize| -> Ranges<f64> {
        from_fn(|group| from_fn(|end| from_fn(|axis| value(row, group, end, axis))))
    };
    Ok((0..chunk.count).map(of_row).collect())
}

/// Returns the column of a word of 32 bits.
fn word_column(source: &Source, vertex: &Element, name: &str) -> Result<usize> {
    let column = needed(source, vertex, name)?;
    match vertex.columns[column].kind {
        PropertyType::Scalar(ScalarType::UInt | ScalarType::Int) => Ok(column),
        _ => Err(source.error("header", format!("the property “{name}” is not of the type uint"))),
    }
}

/// Returns the degree of the harmonics, and the table of their bytes above the constant.
fn harmonics<'a>(
    source: &'a Source,
    header: &'a Header,
    count: usize,
) -> Result<(u32, Option<Table<'a>>)> {
    let Some(element) = named(header, "sh") else { return Ok((0, None)) };
    let (degree, columns) = rest(source, element)?;
    if degree == 0 {
        return Ok((0, None));
    }
    if element.count != count {
        let message = format!("the element “sh” has {} rows for {count} Gaussians", element.count);
        return Err(source.error("header", message));
    }
    let is_byte = |&column: &usize| {
        matches!(element.columns[column].kind, PropertyType::Scalar(ScalarType::UChar))
    };
    if !columns.iter().all(is_byte) {
        let message = "a property “f_rest_…” of the element “sh” is not of the type uchar";
        return Err(source.error("header", message));
    }
    let rows = rows_of(source, header, element)?;
    let columns: Vec<Option<usize>> = columns.into_iter().map(Some).collect();
    Ok((degree, Some(Table::read(source, element, &rows, &columns)?)))
}

/// Returns the values at these parts of a range.
fn within([low, high]: &[[f64; 3]; 2], parts: [f64; 3]) -> [f64; 3] {
    from_fn(|axis| low[axis] * (1.0 - parts[axis]) + high[axis] * parts[axis])
}

/// Returns bits of a word as a number from 0 to 1.
fn part(word: u32, [shift, bits]: [u32; 2]) -> f64 {
    let most = (1 << bits) - 1;
    f64::from(word >> shift & most) / f64::from(most)
}

/// Returns the bits of a word for a number from 0 to 1. NaN, the place in a range without length,
/// is 0.
fn bits_of(part: f64, [shift, bits]: [u32; 2]) -> u32 {
    let most = f64::from((1u32 << bits) - 1);
    ((part * most).round().clamp(0.0, most) as u32) << shift
}

/// Returns the coefficient of a byte. Coefficients are from −4 to 4, in 256 steps whose middles
/// count, but the ends are those of the range.
fn coefficient(byte: u8) -> f32 {
    let part = match byte {
        0 => 0.0,
        255 => 1.0,
        _ => (f32::from(byte) + 0.5) / 256.0,
    };
    8.0 * part - 4.0
}

/// Returns the byte of a coefficient.
fn byte_of(coefficient: f32) -> u8 {
    ((coefficient / 8.0 + 0.5) * 256.0) as u8
}

/// Returns a rotation. The two highest bits say which part is the largest, of w, x, y and z; the
/// others follow, from −√½ to √½.
fn rotation(word: u32) -> Quat {
    let [a, b, c] = [20, 10, 0].map(|shift| (part(word, [shift, 10]) - 0.5) * SQRT_2);
    let most = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    let parts = match word >> 30 {
        0 => [most, a, b, c],
        1 => [a, most, b, c],
        2 => [a, b, most, c],
        _ => [a, b, c, most],
    };
    let [w, x, y, z] = parts.map(|part| part as f32);
    Quat::from_xyzw(x, y, z, w)
}

/// Returns the word of a rotation.
fn word_of_rotation(rotation: Quat) -> u32 {
    let [x, y, z, w] = rotation.to_array();
    let parts = [w, x, y, z].map(f64::from);
    let larger = |most: usize, i: usize| if parts[i].abs() > parts[most].abs() { i } else { most };
    let most = (1..4).fold(0, larger);
    let sign = parts[most].signum();
    let others = (0..4).filter(|&i| i != most);
    let step = |i: usize| bits_of(sign * parts[i] * FRAC_1_SQRT_2 + 0.5, [0, 10]);
    others.fold(most as u32, |word, i| word << 10 | step(i))
}

/// Writes trained Gaussians as the compressed PLY of PlayCanvas: 16 bytes for each Gaussian, and
/// one for each coefficient of the harmonics. They are reordered, so that the Gaussians of a chunk
/// are neighbours. Coefficients are cut to −4 … 4.
///
/// # Errors
/// [`Error::Argument`] if the set is not valid ([`Gaussians::validate`]); [`Error::Memory`] if the
/// order does not fit in memory; [`Error::Output`] if the file cannot be written.
pub fn write_compressed_gaussians(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    set.validate().map_err(Error::Argument)?;
    check_places("compressed PLY", set, single)?;
    memory::room("sorting Gaussians", (size_of::<(u64, usize)>() * set.len()) as u64)?;
    let order = order(set);
    disk::write_with(path.as_ref(), |out| {
        write_header(set, out)?;
        let chunks = || order.chunks(CHUNK);
        let ranges: Vec<Ranges<f32>> = chunks().map(|chunk| ranges_of(set, chunk)).collect();
        for value in ranges.as_flattened().as_flattened().as_flattened() {
            out.write_all(&value.to_le_bytes())?;
        }
        for (chunk, ranges) in chunks().zip(&ranges) {
            for &(_, index) in chunk {
                let words = words(set, index, ranges).map(u32::to_le_bytes);
                out.write_all(words.as_flattened())?;
            }
        }
        let mut row = Vec::new();
        for &(_, index) in &order {
            row.clear();
            for channel in 0..3 {
                let rest = set.harmonics_of(index)[1..].iter();
                row.extend(rest.map(|color| byte_of(color[channel])));
            }
            out.write_all(&row)?;
        }
        Ok(())
    })
}

fn write_header(set: &Gaussians, out: &mut impl Write) -> std::io::Result<()> {
    let count = set.len();
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement chunk {}", count.div_ceil(CHUNK))?;
    RANGES.iter().try_for_each(|name| writeln!(out, "property float {name}"))?;
    writeln!(out, "element vertex {count}")?;
    WORDS.iter().try_for_each(|name| writeln!(out, "property uint {name}"))?;
    if set.degree > 0 {
        writeln!(out, "element sh {count}")?;
        let count = 3 * (terms(set.degree) - 1);
        (0..count).try_for_each(|number| writeln!(out, "property uchar f_rest_{number}"))?;
    }
    writeln!(out, "end_header")
}

/// Returns the numbers of a Gaussian that have ranges: position, deviations and colour.
fn numbers(set: &Gaussians, index: usize) -> [[f32; 3]; 3] {
    let center = set.origin + set.centers[index].as_dvec3();
    let log = |scale: f32| log_of_scale(scale).clamp(-MOST_LOG, MOST_LOG);
    [
        center.as_vec3().to_array(),
        set.scales[index].to_array().map(log),
        set.harmonics_of(index)[0].map(|constant| constant * CONSTANT + 0.5),
    ]
}

/// Returns the ranges of the Gaussians of a chunk.
fn ranges_of(set: &Gaussians, chunk: &[(u64, usize)]) -> Ranges<f32> {
    let mut ranges = [[[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]]; 3];
    for &(_, index) in chunk {
        for ([low, high], values) in ranges.iter_mut().zip(numbers(set, index)) {
            *low = from_fn(|axis| low[axis].min(values[axis]));
            *high = from_fn(|axis| high[axis].max(values[axis]));
        }
    }
    ranges
}

/// Returns the words of a Gaussian, in the order of [`WORDS`].
fn words(set: &Gaussians, index: usize, ranges: &Ranges<f32>) -> [u32; 4] {
    let numbers = numbers(set, index);
    let word = |group: usize, layout: [[u32; 2]; 3]| {
        let bits = |axis: usize| {
            let [low, high] = ranges[group].map(|end| f64::from(end[axis]));
            let part = (f64::from(numbers[group][axis]) - low) / (high - low);
            bits_of(part, layout[axis])
        };
        bits(0) | bits(1) | bits(2)
    };
    let opacity = bits_of(f64::from(set.opacities[index]), [0, 8]);
    [
        word(POSITION, THREE),
        word_of_rotation(set.rotations[index]),
        word(SCALE, THREE),
        word(COLOR, PAINT) | opacity,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_return() {
        for byte in 0..=255 {
            assert_eq!(byte_of(coefficient(byte)), byte);
        }
        assert_eq!([-9.0, 9.0, 0.0].map(byte_of), [0, 255, 128]);
        for word in [0x12ca_f200, 0x52ca_f200, 0x92ca_f200, 0xd2ca_f200] {
            assert_eq!(word_of_rotation(rotation(word)), word);
            assert_eq!(word_of_rotation(-rotation(word)), word);
        }
    }
}
