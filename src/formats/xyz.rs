//! Point clouds as text tables (`.xyz`, `.pts`, `.asc`, `.csv`, `.txt`): one point a line, with or
//! without a line of column names. `.pts` files begin each scan with its number of points on a line
//! of its own.

use super::shared::{
    attribute,
    cloud::{Cloud, greys},
};
use crate::{
    Result,
    about::Stance,
    input::{
        Source, copy,
        growing::Growing,
        text::{Text, Want, first_words},
    },
    surface::Mesh,
};
use glam::DVec3;

/// Bytes per point if it has every attribute.
const POINT: u64 = 24 + 12 + 8;

/// Column names of each attribute; case is ignored.
const POSITION: [&[&str]; 3] = [&["x"], &["y"], &["z"]];
const COLOR: [&[&str]; 3] = [&["r", "red"], &["g", "green"], &["b", "blue"]];
const NORMAL: [&[&str]; 3] = [
    &["nx", "normal_x", "normalx"],
    &["ny", "normal_y", "normaly"],
    &["nz", "normal_z", "normalz"],
];
const INTENSITY: &[&str] = &["intensity", "i", "grey", "gray", "reflectance"];

/// Reads a point cloud. With column names, the table has `x`, `y`, `z` and optionally `r`, `g`, `b`
/// (or `red`, …), `nx`, `ny`, `nz` (or `normal_x`, …) and `intensity`. Other columns are ignored.
///
/// Without names, the first three columns are a position. One of these may follow:
/// - nothing;
/// - an intensity;
/// - a colour or a normal, or both in either order;
/// - an intensity and a colour, or these and a normal.
///
/// Three columns are a normal if all numbers lie between −1 and 1 and either one is negative or all
/// lengths are 1. Without colours, intensities are drawn as greys. Colours are fractions if none is
/// above 1, 16-bit numbers if one is above 255, and bytes otherwise.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with the line, for other columns, lines with another
/// number of columns, words that are not numbers, numbers that are not finite, and fewer points
/// than the file counts; [`Error::Limit`](crate::Error::Limit) for more lines than the limits allow
/// points.
pub fn read(source: &Source) -> Result<Mesh> {
    read_named(source, None)
}

/// As [`read`], with the values of the column that `scalar` names. Without names of columns, an
/// intensity is called `intensity`.
///
/// # Errors
/// Those of [`read`]; [`Error::Input`](crate::Error::Input) if no column has the name.
pub fn read_named(source: &Source, scalar: Option<&str>) -> Result<Mesh> {
    let mut counts = Growing::new(source, "the counts");
    let text = Text::of(source, |number, line| match copy::number::<u64>(line) {
        Some(count) => counts.push((number, count)).map(|()| true),
        None => Ok(false),
    })?;
    check_counts(source, &counts, text.len())?;
    let mut layout = match &text.names {
        Some(names) => Layout::named(source, text.first, names)?,
        None => Layout::plain(source, text.first, text.width)?,
    };
    let value = scalar.map(|name| layout.column(source, &text, name)).transpose()?;
    let numbers = text.numbers(source, |column| match value {
        _ if layout.uses(column) => Want::Numbers,
        Some(own) if own == column => Want::Values,
        _ => Want::Nothing,
    })?;
    let table = Table { numbers, width: text.width, rows: text.len() };
    for columns in std::mem::take(&mut layout.untold) {
        let slot = if table.is_normal(columns) { &mut layout.normal } else { &mut layout.color };
        if slot.replace(columns).is_some() {
            return Err(source
                .error(
                    format!("line {}", text.first),
                    "has two colours or two normals after the position",
                )
                .hint("name the columns in the first line"));
        }
    }
    source.spend("the size of the points in bytes", POINT * text.len() as u64)?;
    let positions = table.triples(layout.position).collect();
    let mut cloud = Cloud { positions, ..Cloud::default() };
    cloud.about.stance = Some(Stance::SURVEY);
    if let Some(columns) = layout.normal {
        cloud.normals = table.triples(columns).map(|normal| normal.as_vec3()).collect();
    }
    if let Some(columns) = layout.color {
        cloud.colors = table.colors(columns);
    } else if let Some(column) = layout.intensity {
        let intensities = (0..table.rows).map(|row| table.value(row, column) as f32);
        cloud.colors = greys(&intensities.collect::<Vec<f32>>());
    }
    if let (Some(column), Some(name)) = (value, scalar) {
        cloud.values = (0..table.rows).map(|row| table.value(row, column) as f32).collect();
        cloud.about.name = name.into();
    }
    cloud.into_mesh(source, |row| text.place(row))
}

/// Returns an error if the file counts its points, with the line of each count, and has another
/// number.
fn check_counts(source: &Source, counts: &[(usize, u64)], there: usize) -> Result<()> {
    let Some(&(line, _)) = counts.first() else { return Ok(()) };
    let counted = counts.iter().fold(0u64, |sum, &(_, count)| sum.saturating_add(count));
    if counted == there as u64 {
        return Ok(());
    }
    Err(source
        .error(format!("line {line}"), format!("counts {counted} points, but there are {there}"))
        .hint("the file is cut, or a line has a single number"))
}

/// The numbers of the file, row by row.
struct Table {
    numbers: Vec<f64>,
    width: usize,
    rows: usize,
}

impl Table {
    fn value(&self, row: usize, column: usize) -> f64 {
        self.numbers[row * self.width + column]
    }

    /// Returns the numbers of three columns in each row.
    fn triples(&self, columns: [usize; 3]) -> impl Iterator<Item = DVec3> {
        (0..self.rows)
            .map(move |row| DVec3::from_array(columns.map(|column| self.value(row, column))))
    }

    /// Returns whether columns without a name are a normal, which their values decide.
    fn is_normal(&self, columns: [usize; 3]) -> bool {
        let unit = self.triples(columns).all(|v| (v.length() - 1.0).abs() < 0.02);
        let signed = self.triples(columns).any(|v| v.min_element() < 0.0);
        self.triples(columns).all(|v| v.abs().max_element() <= 1.0) && (unit || signed)
    }

    /// Returns the colours in three columns. The largest number decides their scale.
    fn colors(&self, columns: [usize; 3]) -> Vec<[u8; 4]> {
        let largest = self.triples(columns).map(|color| color.max_element()).fold(0.0, f64::max);
        let scale = if largest > 255.0 {
            255.0 / 65535.0
        } else if largest > 1.0 {
            1.0
        } else {
            255.0
        };
        let bytes = |color: DVec3| (color * scale).to_array().map(|part| part.round() as u8);
        self.triples(columns).map(bytes).map(|[r, g, b]| [r, g, b, 255]).collect()
    }
}

/// Returns whether a table is a point cloud rather than samples. It is one if its first line names
/// colours or normals but no `value` or `scalar`, or names only a position. Without names, it is
/// one if the number of columns is that of a cloud and not of samples.
pub(super) fn is_cloud(source: &Source) -> bool {
    let Some((words, named)) = first_words(source.bytes()) else { return false };
    if !named {
        return matches!(words.len(), 1 | 3 | 6 | 7 | 9);
    }
    let has = |names: &[&str]| find(&words, names).is_some();
    let is_sample = has(&["value", "scalar"]);
    !is_sample
        && (triple(&words, COLOR).is_some() || triple(&words, NORMAL).is_some() || words.len() == 3)
}

/// The meaning of the columns.
#[derive(Default)]
struct Layout {
    position: [usize; 3],
    color: Option<[usize; 3]>,
    normal: Option<[usize; 3]>,
    intensity: Option<usize>,
    /// Columns that are a colour or a normal; their values decide which.
    untold: Vec<[usize; 3]>,
}

impl Layout {
    fn named(source: &Source, line: usize, names: &[String]) -> Result<Self> {
        let Some(position) = triple(names, POSITION) else {
            let missing =
                POSITION.iter().find(|name| find(names, name).is_none()).map_or("", |name| name[0]);
            return Err(source.error(format!("line {line}"), format!("has no column “{missing}”")));
        };
        Ok(Self {
            position,
            color: triple(names, COLOR),
            normal: triple(names, NORMAL),
            intensity: find(names, INTENSITY),
            untold: Vec::new(),
        })
    }

    fn plain(source: &Source, line: usize, width: usize) -> Result<Self> {
        let plain = Self { position: [0, 1, 2], ..Self::default() };
        match width {
            3 => Ok(plain),
            4 => Ok(Self { intensity: Some(3), ..plain }),
            6 => Ok(Self { untold: vec![[3, 4, 5]], ..plain }),
            7 => Ok(Self { intensity: Some(3), color: Some([4, 5, 6]), ..plain }),
            9 => Ok(Self { untold: vec![[3, 4, 5], [6, 7, 8]], ..plain }),
            10 => Ok(Self {
                intensity: Some(3),
                color: Some([4, 5, 6]),
                normal: Some([7, 8, 9]),
                ..plain
            }),
            _ => Err(source
                .error(
                    format!("line {line}"),
                    format!(
                        "has {width} columns without \
                                                                   names"
                    ),
                )
                .hint(
                    "a point is x, y, z and then a colour, a normal, both, or an intensity and a \
                 colour; or name the columns in the first line",
                )),
        }
    }

    /// Returns the column of an attribute.
    fn column(&self, source: &Source, text: &Text, name: &str) -> Result<usize> {
        let place = format!("line {}", text.first);
        match (&text.names, self.intensity) {
            (Some(names), _) => attribute::named(source, &place, name, names),
            (None, Some(column)) => {
                attribute::named(source, &place, name, &["intensity"]).map(|_| column)
            }
            (None, None) => attribute::named(source, &place, name, &[""; 0]).map(|_| 0),
        }
    }

    fn uses(&self, column: usize) -> bool {
        let triples = [Some(self.position), self.color, self.normal];
        self.intensity == Some(column)
            || triples.iter().flatten().chain(&self.untold).any(|columns| columns.contains(&column))
    }
}

fn find(names: &[String], wanted: &[&str]) -> Option<usize> {
    names.iter().position(|name| wanted.iter().any(|wanted| name.eq_ignore_ascii_case(wanted)))
}

fn triple(names: &[String], wanted: [&[&str]; 3]) -> Option<[usize; 3]> {
    let [a, b, c] = wanted.map(|wanted| find(names, wanted));
    Some([a?, b?, c?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Error,
        formats::{Kind, ReadOptions, load_mesh},
        input::{Limits, testing::*},
    };
    use glam::Vec3;

    fn load(text: &str) -> Result<Mesh> {
        let folder = Folder::new();
        read_with(&folder.write("a.xyz", text), read)
    }

    #[test]
    fn every_set_of_columns() {
        let colors = [[255, 128, 0, 255], [0, 0, 51, 255]];
        for (text, colored, normal) in [
            ("1 2 3\n4 5 6\n", false, false),
            ("1,2,3,255,128,0\r\n4,5,6,0,0,51", true, false),
            ("1,2,3,255,128,0\r4,5,6,0,0,51\r", true, false),
            ("1 2 3 65535 32896 0\n4 5 6 0 0 13107", true, false),
            ("1 2 3 1.0 0.502 0\n4 5 6 0 0 0.2", true, false),
            ("1 2 3 0 0.6 0.8\n4 5 6 -1 0 0", false, true),
            ("1 2 3 0 0.6 0.8 255 128 0\n4 5 6 1 0 0 0 0 51", true, true),
            ("1 2 3 255 128 0 0 0.6 0.8\n4 5 6 0 0 51 1 0 0", true, true),
            ("2\n1 2 3 -1200 255 128 0\n4 5 6 7 0 0 51", true, false),
            ("1\n1 2 3 -1200 255 128 0\n1\n4 5 6 7 0 0 51\n", true, false),
            ("# made by hand\n1 2 3 9 255 128 0 0 0.6 0.8\n4 5 6 8 0 0 51 1 0 0", true, true),
            ("//X Y Z R G B Nx Ny Nz\n1 2 3 255 128 0 0 0.6 0.8\n4 5 6 0 0 51 1 0 0", true, true),
            ("name;blue;green;red;z;y;x\nfirst;0;128;255;3;2;1\n;51;0;0;6;5;4", true, false),
        ] {
            let mesh = load(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(
                mesh.positions,
                [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)],
                "{text}"
            );
            assert_eq!(mesh.colors, if colored { &colors[..] } else { &[] }, "{text}");
            assert_eq!(mesh.normals.len(), if normal { 2 } else { 0 }, "{text}");
            assert!(!normal || mesh.normals[0].distance(Vec3::new(0.0, 0.6, 0.8)) < 1e-6, "{text}");
        }
        for text in ["1 2 3 100\n4 5 6 300", "x y z intensity\n1 2 3 -1\n4 5 6 0"] {
            assert_eq!(load(text).unwrap().colors, [[0, 0, 0, 255], [255; 4]], "{text}");
        }
    }

    #[test]
    fn columns_are_values_by_name() {
        let folder = Folder::new();
        for (text, name, wanted) in [
            ("x y z heat r g b\n1 2 3 7 255 0 0\n4 5 6 8 0 0 0", "Heat", Some([7.0, 8.0])),
            ("1 2 3 40\n4 5 6 50", "intensity", Some([40.0, 50.0])),
            ("1 2 3 40 255 0 0\n4 5 6 50 0 0 0", "intensity", Some([40.0, 50.0])),
            ("x y z heat\n1 2 3 4\n4 5 6 5", "cold", None),
            ("1 2 3\n4 5 6", "intensity", None),
        ] {
            let path = folder.write("a.xyz", text);
            let found = read_with(&path, |source| read_named(source, Some(name)));
            match (found, wanted) {
                (Ok(mesh), Some(wanted)) => assert_eq!(mesh.values, wanted, "{text}"),
                (Err(error), None) => {
                    let message = error.to_string();
                    assert!(message.contains("line 1: has no attribute"), "{message}");
                }
                (found, _) => panic!("{text}: {:?}", found.map(|mesh| mesh.values)),
            }
        }
    }

    #[test]
    fn positions_on_the_globe_keep_millimetres() {
        let mesh = load("4500000.001 5400000.002 100.003\n4500000.004 5400000.009 100\n").unwrap();
        let world = |i: usize| mesh.origin + mesh.positions[i].as_dvec3();
        assert!(world(0).distance(DVec3::new(4500000.001, 5400000.002, 100.003)) < 1e-5);
        assert!(world(1).distance(DVec3::new(4500000.004, 5400000.009, 100.0)) < 1e-5);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, word) in [
            ("", "no rows"),
            ("hello", "no column “x”"),
            ("x y\n1 2", "no column “z”"),
            ("1 2\n", "line 1: has 2 columns without names"),
            ("1 2 3 4 5", "5 columns without names"),
            ("x y z\n", "no points"),
            ("1 2 3\n4 5", "line 2: has 2 columns, but the first line has 3"),
            ("1 2 3\n4 nan 6", "line 2: number 2 is NaN"),
            ("1 2 3\r\n4 nan 6\r\n", "line 2: number 2 is NaN"),
            ("1 2 3\r4 nan 6\r", "line 2: number 2 is NaN"),
            ("1 2 3\n4 five 6", "line 2: “five” is not a number"),
            ("3\n1 2 3\n4 5 6\n", "line 1: counts 3 points, but there are 2"),
            (
                "18446744073709551615\n1 2 3\n18446744073709551615\n4 5 6\n",
                "line 1: counts 18446744073709551615",
            ),
            ("0\n1 2 3\n", "counts 0 points"),
            ("1 2 3 1 0 0 0 1 0", "two colours or two normals"),
        ] {
            let message = load(text).unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
        let folder = Folder::new();
        let path = folder.write("a.xyz", "1 2 3\n4 5 6\n");
        let limits = Limits { points: 1, ..Limits::default() };
        assert!(matches!(read(&Source::open(&path, &limits).unwrap()), Err(Error::Limit { .. })));
    }

    /// In a file that counts its points, every truncation is an error, except within the last
    /// number.
    #[test]
    fn every_cut_is_an_error_or_less() {
        let whole = "2\n1 2 3 9 255 128 0\n4 5 6 8 0 0 51";
        for end in 0..whole.len() - 1 {
            assert!(matches!(load(&whole[..end]), Err(Error::Input { .. })), "{end}");
        }
        let named = "x,y,z,r,g,b\n1,2,3,4,5,6\n";
        for end in 0..named.len() {
            match load(&named[..end]) {
                Ok(mesh) => assert_eq!(mesh.positions.len(), 1),
                Err(error) => assert!(matches!(error, Error::Input { .. }), "{error}"),
            }
        }
    }

    #[test]
    fn tables_are_clouds_or_samples() {
        let folder = Folder::new();
        for (name, text, cloud) in [
            ("a.xyz", "1 2 3 4\n", true),
            ("a.pts", "1\n1 2 3\n", true),
            ("a.ASC", "1 2 3\n", true),
            ("a.xyzv", "1 2 3 4\n", false),
            ("a.csv", "1,2,3\n", true),
            ("a.csv", "1,2,3,4\n", false),
            ("a.csv", "1,2,3,4,5\n", false),
            ("a.txt", "1 2 3 4 5 6\n", true),
            ("a.txt", "1 2 3 4 5 6 7 8 9 10\n", false),
            ("a.csv", "x,y,z\n1,2,3\n", true),
            ("a.csv", "x,y,z,p\n1,2,3,4\n", false),
            ("a.csv", "x,y,z,red,green,blue\n1,2,3,4,5,6\n", true),
            ("a.csv", "x,y,z,nx,ny,nz,curvature\n1,2,3,1,0,0,9\n", true),
            ("a.csv", "x,y,z,r,g,b,value\n1,2,3,4,5,6,7\n", false),
        ] {
            let path = folder.write(name, text);
            let kind = |scalar: Option<&str>| {
                Kind::of(&path, &Limits::default(), &ReadOptions::scalar(scalar)).unwrap()
            };
            assert_eq!(
                kind(None),
                Some(if cloud { Kind::Mesh } else { Kind::Samples }),
                "{name}: {text}"
            );
            assert_eq!(kind(Some("v")), Some(Kind::Samples), "{name}: {text}");
            assert!(
                !cloud || load_mesh(&path, &Limits::default(), &ReadOptions::default()).is_ok(),
                "{name}: {text}"
            );
        }
    }
}
