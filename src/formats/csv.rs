//! Scattered samples as text tables (`.csv`, `.txt`, `.xyzv`): one sample a line, with or without a
//! line of column names.

use super::{
    Array, Place, ReadOptions,
    shared::{
        choice::{self, Candidate, Part, Role},
        gather::{Columns, gather},
    },
};
use crate::{
    Result,
    input::{
        Source,
        text::{Text, Want},
    },
    scattered::Points,
};
use glam::DVec3;

/// Column names of a covariance.
const COVARIANCE: [&str; 6] = ["xx", "xy", "xz", "yy", "yz", "zz"];

/// Reads samples. With column names, the table has:
/// - `x`, `y` and `z`;
/// - a value: the column that [`ReadOptions::scalar`] names, else `value` or `scalar`, else the
///   first other column of numbers that are not identifiers;
/// - optionally `radius`, and `xx`, `xy`, `xz`, `yy`, `yz`, `zz` (or `cov_xx`, …).
///
/// Without names, the columns are x, y, z and value, then nothing, a radius, or the six terms of a
/// covariance in that order.
///
/// Samples without a value are left out: those whose value is empty, `nan`, `NA`, `null`, `none`,
/// `-`, not finite in 32 bits, or [`ReadOptions::missing`]. So are those that are not at finite
/// coordinates.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with the line, for other columns, lines with another
/// number of columns, and words that are not numbers;
/// [`Error::Limit`](crate::Error::Limit) for more lines than the limits allow points.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Points> {
    let text = Text::of(source)?;
    let layout = match &text.names {
        Some(names) => Layout::named(source, &text, names, options.scalar.as_deref())?,
        None => Layout::plain(source, text.width)?,
    };
    let table = text.numbers(source, |column| layout.want(column))?;
    let (count, width) = (text.len(), text.width);
    let value = |row: usize, column: usize| table[row * width + column];
    let column = |column: usize| (0..count).map(move |row| value(row, column));
    source.spend("the size of the samples in bytes", Columns::ROW * count as u64)?;
    let columns = Columns {
        values: column(layout.value).collect(),
        radii: layout
            .radius
            .map_or(Vec::new(), |radius| column(radius).map(|radius| radius as f32).collect()),
        covariances: layout.covariance.map_or(Vec::new(), |terms| {
            (0..count).map(|row| terms.map(|term| value(row, term) as f32)).collect()
        }),
    };
    let [x, y, z] = layout.position;
    let position = |row| DVec3::new(value(row, x), value(row, y), value(row, z));
    let mut points = gather(source, count, position, |row| text.place(row), columns, options)?;
    points.about.name = text.names.map_or(String::new(), |names| names[layout.value].clone());
    Ok(points)
}

/// Returns the columns of a table with column names; nothing for a table without.
///
/// # Errors
/// Those of [`read`].
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    let text = Text::of(source)?;
    let Some(names) = &text.names else { return Ok(Vec::new()) };
    let candidates = candidates(&text, names);
    let drawn = Layout::named(source, &text, names, options.scalar.as_deref()).ok();
    let mut arrays = Vec::new();
    for (column, candidate) in candidates.iter().enumerate() {
        let values = if candidate.is_numeric { of_column(source, &text, column)? } else { vec![] };
        arrays.push(Array {
            range: choice::range(values.into_iter(), options.missing),
            is_drawn: drawn.as_ref().is_some_and(|layout| layout.value == column),
            ..candidate.listed()
        });
    }
    Ok(arrays)
}

/// Returns the columns of a table as arrays to choose from, in their order.
fn candidates(text: &Text, names: &[String]) -> Vec<Candidate> {
    let is_known = |name: &str| {
        let name = name.to_ascii_lowercase();
        let term = name.strip_prefix("cov_").unwrap_or(&name);
        matches!(name.as_str(), "x" | "y" | "z" | "radius") || COVARIANCE.contains(&term)
    };
    let role = |name: &str| match name.to_ascii_lowercase().as_str() {
        "value" | "scalar" => Role::Scalars,
        _ if is_known(name) => Role::Geometry,
        _ => Role::None,
    };
    let of = |(column, name): (usize, &String)| {
        let is_numeric = text.is_numeric(column);
        Candidate {
            name: name.clone(),
            place: Place::Points,
            kind: if is_numeric { "number" } else { "string" }.into(),
            is_numeric,
            components: 1,
            role: role(name),
        }
    };
    names.iter().enumerate().map(of).collect()
}

/// Returns the numbers of one column.
fn of_column(source: &Source, text: &Text, column: usize) -> Result<Vec<f64>> {
    let want = |other: usize| if other == column { Want::Values } else { Want::Nothing };
    let table = text.numbers(source, want)?;
    Ok(table.chunks_exact(text.width).map(|row| row[column]).collect())
}

/// The meaning of the columns.
struct Layout {
    position: [usize; 3],
    value: usize,
    radius: Option<usize>,
    covariance: Option<[usize; 6]>,
}

impl Layout {
    fn plain(source: &Source, count: usize) -> Result<Self> {
        let plain = Self { position: [0, 1, 2], value: 3, radius: None, covariance: None };
        match count {
            4 => Ok(plain),
            5 => Ok(Self { radius: Some(4), ..plain }),
            10 => Ok(Self { covariance: Some([4, 5, 6, 7, 8, 9]), ..plain }),
            _ => Err(source.error("line 1", format!("has {count} columns without names")).hint(
                "write x, y, z, value and then nothing, a radius, or xx, xy, xz, yy, yz, zz; \
                       or name the columns in the first line",
            )),
        }
    }

    fn named(source: &Source, text: &Text, names: &[String], scalar: Option<&str>) -> Result<Self> {
        let place = format!("line {}", text.first);
        let at = |name: &str| names.iter().position(|other| other.eq_ignore_ascii_case(name));
        let need = |name: &str| {
            at(name).ok_or_else(|| source.error(&place, format!("has no column “{name}”")))
        };
        let position = [need("x")?, need("y")?, need("z")?];
        if text.len() == 0 {
            return Err(source.error("file", "contains no samples"));
        }
        // Decimal commas, for example, are told by their line.
        for column in position {
            if !text.is_numeric(column) {
                of_column(source, text, column)?;
            }
        }
        let radius = at("radius");
        let terms = COVARIANCE.map(|term| at(term).or_else(|| at(&format!("cov_{term}"))));
        let covariance =
            terms.iter().all(Option::is_some).then(|| terms.map(Option::unwrap_or_default));
        let candidates = candidates(text, names);
        let chosen = match scalar {
            Some(name) => choice::named(source, &candidates, name)?,
            None => choice::needed(source, &candidates, |column| {
                Ok(choice::is_ramp(&of_column(source, text, column)?))
            })?,
        };
        debug_assert_eq!(chosen.part, Part::Whole);
        Ok(Self { position, value: chosen.array, radius, covariance })
    }

    fn want(&self, column: usize) -> Want {
        let is_kernel = self.radius == Some(column)
            || self.covariance.is_some_and(|terms| terms.contains(&column));
        if is_kernel {
            Want::Numbers
        } else if self.value == column || self.position.contains(&column) {
            Want::Values
        } else {
            Want::Nothing
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Error,
        about::About,
        input::{Limits, testing::*},
    };
    use glam::Vec3;

    fn load(text: &str, scalar: Option<&str>) -> Result<Points> {
        let folder = Folder::new();
        read_with(&folder.write("a.csv", text), |source| {
            let mut points = read(source, &ReadOptions::scalar(scalar))?;
            points.about = About::default();
            Ok(points)
        })
    }

    #[test]
    fn every_separator_and_every_set_of_columns() {
        let plain = Points {
            positions: vec![Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)],
            values: vec![-0.5, 70.0],
            ..Points::default()
        };
        for text in [
            "1,2,3,-0.5\n4,5,6,7e1\n",
            "x,y,z,p\r\n1,2,3,-0.5\r\n4,5,6,70",
            "\u{feff}\"X\";\"Y\";\"Z\";\"pressure of air\"\n1;2;3;-0.5\n\n4;5;6;70\n",
            "1\t2\t3\t-0.5\n4\t5\t6\t70",
            "# made by hand\n  1   2 3 -0.5\n// more\n4 5  6 70 ",
            "# x y z v\n1 2 3 -0.5\n4 5 6 70",
            "value z y x\n-0.5 3 2 1\n70 6 5 4",
            "x,y,z,value,name\n1,2,3,-0.5,first\n4,5,6,70,second",
            "x,y,z,value,name\n1,2,3,-0.5,\"first, of two\"\n\"4\",5,6,\"70\",second",
            "\"x\"\t\"y\"\t\"z\"\t\"pressure, of air\"\n1\t2\t3\t-0.5\n4\t5\t6\t70",
        ] {
            assert_eq!(load(text, None).unwrap(), plain, "{text}");
        }
        assert_eq!(load("x,y,z,a,b\n1,2,3,9,-0.5\n4,5,6,9,70", Some("b")).unwrap(), plain);
        let round = Points { radii: vec![0.5, 2.0], ..plain.clone() };
        assert_eq!(load("1 2 3 -0.5 0.5\n4 5 6 70 2", None).unwrap(), round);
        assert_eq!(load("radius x y z v\n0.5 1 2 3 -0.5\n2 4 5 6 70", None).unwrap(), round);
        let slanted = Points { covariances: vec![[4.0, 1.0, 0.0, 2.0, 0.0, 1.0]; 2], ..plain };
        assert_eq!(load("1 2 3 -0.5 4 1 0 2 0 1\n4 5 6 70 4 1 0 2 0 1", None).unwrap(), slanted);
        let names = "cov_xx cov_xy cov_xz cov_yy cov_yz cov_zz x y z v";
        assert_eq!(
            load(&format!("{names}\n4 1 0 2 0 1 1 2 3 -0.5\n4 1 0 2 0 1 4 5 6 70"), None).unwrap(),
            slanted
        );
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, scalar, word) in [
            ("", None, "no rows"),
            ("# nothing\n", None, "no rows"),
            ("hello", None, "no column “x”"),
            ("1 2 3", None, "3 columns without names"),
            ("x,y,z\n1,2,3", None, "no values that can be drawn"),
            ("x,y,z,id\n1,2,3,4", None, "only identifiers"),
            ("x,y,z,a,b\n1,2,3,4,5", Some("c"), "no array “c”"),
            ("x,y,z,name\n1,2,3,four", Some("name"), "not numbers"),
            ("x,y,z,v\n", None, "no samples"),
            ("1 2 3 nan\n\n5 6 7 inf", None, "none of the 2 samples has a value"),
            ("1 inf 3 4\n5 inf 7 8", None, "none is at finite coordinates"),
            ("1 2 3 4\n5 6 7", None, "line 2: has 3 columns, but the first line has 4"),
            ("1 2 3 4\n5 6 7 8 9", None, "line 2: has 5 columns"),
            ("1 2 3 4\n5 6 seven 8", None, "line 2: “seven” is not a number"),
            ("1;2;3;4\n5;6;7;8,5", None, "“8,5” is not a number"),
            ("\"1,5\",\"2,5\",\"3,5\",\"4\"\n", None, "neither numbers nor column names"),
            ("1,2,3,4\n\"1,5\",\"2,5\",\"3,5\",\"4\"\n", None, "“1,5” is not a number"),
            ("1 2 3 4 0", None, "radius of sample 0 is 0"),
        ] {
            let message = load(text, scalar).unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
        let folder = Folder::new();
        let path = folder.write("a.csv", "1 2 3 4\n5 6 7 8\n");
        let limits = Limits { points: 1, ..Limits::default() };
        assert!(matches!(
            read(&Source::open(&path, &limits).unwrap(), &ReadOptions::default()),
            Err(Error::Limit { .. })
        ));
    }

    /// A truncated text is an error, has fewer lines, or has one number that is shorter.
    #[test]
    fn every_cut_is_an_error_or_less() {
        let whole = "x,y,z,v\n1,2,3,4\n5,6,7,85\n";
        for end in 0..whole.len() {
            match load(&whole[..end], None) {
                Ok(points) => assert!(points.len() <= 2 && points.validate().is_ok()),
                Err(error) => assert!(matches!(error, Error::Input { .. }), "{error}"),
            }
        }
    }

    /// Samples without a value are holes; identifiers and words are not chosen.
    #[test]
    fn values_may_be_missing() {
        let text = "station,id,x,y,z,t,u\nA,7,1,2,3,-0.5,1\nB,9,0,0,0,,2\nC,9,0,0,0,NA,-99\n\
                    D,3,4,5,6,70,4\n";
        let folder = Folder::new();
        let path = folder.write("a.csv", text);
        let load = |scalar: Option<&str>, missing| {
            let options = ReadOptions { missing, ..ReadOptions::scalar(scalar) };
            read_with(&path, |source| Ok((read(source, &options)?, arrays(source, &options)?)))
        };
        let (points, arrays) = load(None, None).unwrap();
        assert_eq!((points.values, points.about.holes), (vec![-0.5, 70.0], 2));
        assert_eq!(points.positions[1], Vec3::new(4.0, 5.0, 6.0));
        assert_eq!(points.about.name, "t");
        let drawn: Vec<&str> =
            arrays.iter().filter(|array| array.is_drawn).map(|array| array.name.as_str()).collect();
        assert_eq!((arrays.len(), drawn), (7, vec!["t"]));
        assert_eq!((arrays[0].range, arrays[5].range), (None, Some([-0.5, 70.0])));
        let (points, _) = load(Some("u"), Some(-99.0)).unwrap();
        assert_eq!((points.values, points.about.holes), (vec![1.0, 2.0, 4.0], 1));
    }
}
