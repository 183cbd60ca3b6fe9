//! Scattered samples in PLY: vertices with a scalar property.

use super::{
    super::{
        Array, Place, ReadOptions,
        shared::{
            choice::{self, Candidate, Chosen, Role},
            gather::{Columns, gather},
        },
    },
    ALPHA, COLOR, NORMAL, POSITION, ROLES, Table, UV,
    header::{self, Element},
    rows::Rows,
};
use crate::{Result, input::Source, scattered::Points};
use glam::DVec3;
use ply_rs::ply::{PropertyType, ScalarType};

/// Properties that shape a kernel.
const RADIUS: &str = "radius";
const COVARIANCE: [&str; 6] = ["cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz"];

/// Returns whether a PLY file's header declares faces.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed header.
pub fn has_faces(source: &Source) -> Result<bool> {
    let header = header::read(source)?;
    Ok(header
        .elements
        .iter()
        .any(|element| matches!(element.name.as_str(), "face" | "tristrips") && element.count > 0))
}

/// Reads the vertices as scattered samples. The value is the property that
/// [`ReadOptions::scalar`] names. Without it, it is the first property of no other meaning: not a
/// position, normal, colour, texture coordinate, identifier or part of a kernel. Kernels come from
/// a property `radius`, or from `cov_xx`, `cov_xy`, `cov_xz`, `cov_yy`, `cov_yz` and `cov_zz`.
/// Vertices without a value are left out.
///
/// # Errors
/// As [`read`](super::read). Also [`Error::Input`](crate::Error::Input) if no property has that
/// name, with the names that there are.
pub fn read_samples(source: &Source, options: &ReadOptions) -> Result<Points> {
    with_vertices(source, |element, rows| of_vertices(source, element, rows, options))
}

/// Returns the scalar properties of the vertices.
///
/// # Errors
/// Those of [`read_samples`].
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    let shows_values = options.scalar.is_some() || !has_faces(source)?;
    with_vertices(source, |element, rows| {
        let (candidates, columns) = candidates(element);
        let drawn = options.scalar.as_deref().filter(|_| shows_values);
        let drawn = drawn.and_then(|name| choice::named(source, &candidates, name).ok());
        let mut arrays = Vec::new();
        for (index, candidate) in candidates.iter().enumerate() {
            let values = values_of(source, element, rows, columns[index])?;
            arrays.push(Array {
                range: choice::range(values.into_iter(), options.missing),
                is_drawn: drawn.is_some_and(|chosen| chosen.array == index),
                ..candidate.listed()
            });
        }
        Ok(arrays)
    })
}

/// Returns the names of the vertices' properties that may colour them: those without another
/// meaning.
pub(super) fn attributes(element: &Element) -> Vec<String> {
    let (candidates, _) = candidates(element);
    let attributes = candidates.into_iter().filter(|candidate| candidate.role != Role::Geometry);
    attributes.map(|candidate| candidate.name).collect()
}

/// Returns the property of the vertices that a caller names, and its values.
pub(super) fn named_values(
    source: &Source,
    element: &Element,
    rows: &Rows,
    name: &str,
) -> Result<(String, Vec<f64>)> {
    let (name, column) = named_column(source, element, name)?;
    Ok((name, values_of(source, element, rows, column)?))
}

/// Returns the name of the property that a caller names, and its column.
pub(super) fn named_column(
    source: &Source,
    element: &Element,
    name: &str,
) -> Result<(String, usize)> {
    let (candidates, columns) = candidates(element);
    let chosen = choice::named(source, &candidates, name)?;
    Ok((candidates[chosen.array].name.clone(), columns[chosen.array]))
}

/// Passes the vertices of a file, located but not decoded, to `read`.
fn with_vertices<T>(source: &Source, read: impl FnOnce(&Element, &Rows) -> Result<T>) -> Result<T> {
    let header = header::read(source)?;
    let mut at = header.payload;
    for element in &header.elements {
        let rows = Rows::find(source, element, header.encoding, &mut at)?;
        if element.name == "vertex" {
            source.check_points("the count of element “vertex”", element.count as u64)?;
            return read(element, &rows);
        }
    }
    Err(source.error("header", "has no element “vertex”"))
}

fn values_of(source: &Source, element: &Element, rows: &Rows, column: usize) -> Result<Vec<f64>> {
    let table = Table::read(source, element, rows, &[Some(column)])?;
    source.room::<f64>("the values", element.count)?;
    Ok((0..element.count).map(|row| table.value(row, 0)).collect())
}

/// Returns the scalar properties of an element as arrays to choose from, and their columns.
/// Properties with another meaning are not chosen unless they are named.
fn candidates(element: &Element) -> (Vec<Candidate>, Vec<usize>) {
    // A name belongs to a group only if the group is complete: a lone “t” or “v” is not a texture
    // coordinate.
    let groups = [POSITION..NORMAL, NORMAL..COLOR, COLOR..UV, UV..ROLES.len()];
    let known = |name: &str| {
        let of_group = groups.iter().cloned().any(|group| {
            let has = |role: usize| role == ALPHA || element.column(ROLES[role]).is_some();
            group.clone().all(has)
                && ROLES[group]
                    .iter()
                    .flat_map(|names| *names)
                    .any(|alias| alias.eq_ignore_ascii_case(name))
        });
        of_group || name == RADIUS || COVARIANCE.contains(&name)
    };
    let scalars = element.columns.iter().enumerate().filter_map(|(index, column)| {
        let PropertyType::Scalar(kind) = &column.kind else { return None };
        let candidate = Candidate {
            name: column.name.clone(),
            place: Place::Points,
            kind: kind_name(kind).into(),
            is_numeric: true,
            components: 1,
            role: if known(&column.name) { Role::Geometry } else { Role::None },
        };
        Some((candidate, index))
    });
    scalars.unzip()
}

fn kind_name(kind: &ScalarType) -> &'static str {
    match kind {
        ScalarType::Char => "i8",
        ScalarType::UChar => "u8",
        ScalarType::Short => "i16",
        ScalarType::UShort => "u16",
        ScalarType::Int => "i32",
        ScalarType::UInt => "u32",
        ScalarType::Float => "f32",
        ScalarType::Double => "f64",
    }
}

fn of_vertices(
    source: &Source,
    element: &Element,
    rows: &Rows,
    options: &ReadOptions,
) -> Result<Points> {
    let place = "element “vertex”";
    let column = |names: &[&str]| {
        element.column(names).filter(|&column| element.columns[column].width().is_some())
    };
    let mut position = [0; 3];
    for (at, names) in position.iter_mut().zip(ROLES) {
        *at = column(names)
            .ok_or_else(|| source.error(place, format!("has no scalar property “{}”", names[0])))?;
    }
    let (candidates, columns) = candidates(element);
    let counts =
        |index: usize| Ok(choice::is_ramp(&values_of(source, element, rows, columns[index])?));
    let Chosen { array, .. } = match options.scalar.as_deref() {
        Some(name) => choice::named(source, &candidates, name)?,
        None => choice::needed(source, &candidates, counts)?,
    };
    let value = Some(columns[array]);
    let radius = column(&[RADIUS]);
    let covariance = COVARIANCE.map(|name| column(&[name]));
    let has_covariance = covariance.iter().all(Option::is_some);
    let [x, y, z] = position.map(Some);
    let columns: Vec<Option<usize>> =
        [x, y, z, value, radius].into_iter().chain(covariance).collect();
    let table = Table::read(source, element, rows, &columns)?;
    let count = element.count;
    source.spend("the size of the samples in bytes", Columns::ROW * count as u64)?;
    let term = |row: usize, term: usize| table.value(row, 5 + term) as f32;
    let columns = Columns {
        values: (0..count).map(|row| table.value(row, 3)).collect(),
        radii: radius
            .map_or(Vec::new(), |_| (0..count).map(|row| table.value(row, 4) as f32).collect()),
        covariances: if has_covariance {
            (0..count).map(|row| std::array::from_fn(|of| term(row, of))).collect()
        } else {
            Vec::new()
        },
    };
    let position = |row| DVec3::new(table.value(row, 0), table.value(row, 1), table.value(row, 2));
    let place = |row| rows.place(source, element, row);
    let mut points = gather(source, count, position, place, columns, options)?;
    points.about.name.clone_from(&candidates[array].name);
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::*;
    use glam::Vec3;

    fn file(format: &str, properties: &str, rows: &[&[f64]]) -> Vec<u8> {
        let mut file = format!("ply\nformat {format} 1.0\nelement vertex {}\n", rows.len());
        properties.split_whitespace().for_each(|name| file += &format!("property double {name}\n"));
        file += "end_header\n";
        let mut file = file.into_bytes();
        for row in rows {
            match format {
                "ascii" => {
                    file.extend(row.iter().flat_map(|v| format!("{v} ").into_bytes()));
                    file.push(b'\n');
                }
                "binary_big_endian" => file.extend(row.iter().flat_map(|v| v.to_be_bytes())),
                _ => file.extend(row.iter().flat_map(|v| v.to_le_bytes())),
            }
        }
        file
    }

    fn load(content: &[u8], scalar: Option<&str>) -> Result<Points> {
        let folder = Folder::new();
        read_with(&folder.write("a.ply", content), |source| {
            read_samples(source, &ReadOptions::scalar(scalar))
        })
    }

    #[test]
    fn scalars_by_name_and_alone_in_every_encoding() {
        let folder = Folder::new();
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let one = file(
                format,
                "x temperature y z nx ny nz",
                &[&[1., 7., 2., 3., 0., 0., 1.], &[4., 8., 5., 6., 0., 0., 1.]],
            );
            let points = load(&one, None).unwrap();
            assert_eq!(points.positions, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
            assert_eq!((points.values, points.radii), (vec![7.0, 8.0], vec![]));
            assert_eq!(load(&one, Some("nz")).unwrap().values, [1.0, 1.0]);
            assert_eq!(load(&one, Some("x")).unwrap().values, [1.0, 4.0]);
            let painted = "x y z red green blue v alpha";
            let painted = file(format, painted, &[&[1., 2., 3., 4., 5., 6., 7., 8.]]);
            assert_eq!(load(&painted, None).unwrap().values, [7.0]);
            let two = file(format, "x y z p radius", &[&[1., 2., 3., 4., 0.5]]);
            assert_eq!(load(&two, None).unwrap().radii, [0.5]);
            let terms = "x y z p cov_zz cov_xx cov_xy cov_xz cov_yy cov_yz";
            let slanted = file(format, terms, &[&[1., 2., 3., 4., 6., 1., 0., 0.5, 4., 0.]]);
            assert_eq!(load(&slanted, None).unwrap().covariances, [[1.0, 0.0, 0.5, 4.0, 0.0, 6.0]]);
            let short = file(format, "x y z p", &[&[1., 2., 3., 4.]]);
            for end in 0..short.len() {
                // A text that ends within its last number is read with the shorter number.
                let cut = read_with(&folder.write("a.ply", &short[..end]), |source| {
                    read_samples(source, &ReadOptions::default())
                });
                assert!(
                    cut.is_err() || format == "ascii" && end + 3 > short.len(),
                    "{format} cut at {end}"
                );
            }
        }
    }

    #[test]
    fn what_is_wrong_is_told() {
        for (properties, row, scalar, word) in [
            ("x y z", &[1.0, 2.0, 3.0][..], None, "no values that can be drawn"),
            ("x y z id", &[1.0; 4], None, "only identifiers"),
            ("x y z a b", &[1.0; 5], Some("c"), "no array “c”"),
            ("x y a", &[1.0; 3], None, "no scalar property “z”"),
            ("x y z a", &[1.0, 2.0, 3.0, f64::NAN], None, "none of the 1 samples"),
            ("x y z a", &[1.0, f64::NAN, 3.0, 4.0], None, "none is at finite coordinates"),
            ("x y z a radius", &[1.0, 2.0, 3.0, 4.0, -1.0], None, "radius of sample 0"),
        ] {
            let message = load(&file("ascii", properties, &[row]), scalar).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        assert!(
            load(&file("ascii", "x y z a", &[]), None)
                .unwrap_err()
                .to_string()
                .contains("no samples")
        );
        let hint = match load(&file("ascii", "x y z a b", &[&[1.0; 5]]), Some("c")) {
            Err(crate::Error::Input { hint, .. }) => hint,
            other => panic!("{other:?}"),
        };
        assert!(hint.is_some_and(|hint| hint.contains("a (f64, points), b (f64, points)")));
    }
}
