//! Point clouds as text tables (`.xyz`, `.pts`, `.asc`, `.csv`, `.txt`): one point a line, with or
//! without a line of column names. `.pts` files begin each scan with its number of points on a line
//! of its own.

use super::shared::{
    attribute,
    brightness::Brightness,
    cloud::{Cloud, greys},
};
use crate::{
    Result,
    about::Orientation,
    input::{
        Source,
        text::{Text, Want, first_words},
    },
    surface::Mesh,
    warning,
};
use glam::DVec3;

/// Bytes per point if it has every attribute.
const POINT: u64 = 24 + 12 + 8;

/// Column names of each attribute; case is ignored.
const POSITION: [&[&str]; 3] = [&["x"], &["y"], &["z"]];
const COLOR: [&[&str]; 3] = [&["r", "red", "rf"], &["g", "green", "gf"], &["b", "blue", "bf"]];
const NORMAL: [&[&str]; 3] = [
    &["nx", "normal_x", "normalx"],
    &["ny", "normal_y", "normaly"],
    &["nz", "normal_z", "normalz"],
];
const INTENSITY: &[&str] = &["intensity", "i", "grey", "gray", "reflectance"];

/// Reads a point cloud. With column names, the table has `x`, `y`, `z` and optionally `r`, `g`, `b`
/// (or `red`, …), `nx`, `ny`, `nz` (or `normal_x`, …) and `intensity`. Other columns are ignored.
///
/// Without names, the first three columns are a position. What follows is found by its values, in
/// any order: three columns of unit length are a normal, three of whole numbers up to 255 the
/// colour. If there are none, the colour may be fractions or numbers of 16 bits, where it usually
/// is: after the position, the normal or an intensity. Other columns are attributes. The one after
/// the position is called `intensity`, the others by their number: `column 7`.
///
/// Without colours, intensities are drawn as greys. Colours are fractions if none is above 1,
/// 16-bit numbers if one is above 255, and bytes otherwise. Points that are not at finite
/// coordinates are left out.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with the line, for fewer than three columns, lines with
/// another number of columns, words that are not numbers, and fewer points than the file counts.
/// [`Error::Limit`](crate::Error::Limit) for more lines than the limits allow points.
pub fn read(source: &Source) -> Result<Mesh> {
    read_named(source, None)
}

/// As [`read`], with the values of the column that `scalar` names.
///
/// # Errors
/// Those of [`read`]; [`Error::Input`](crate::Error::Input) if no column has the name.
pub fn read_named(source: &Source, scalar: Option<&str>) -> Result<Mesh> {
    let text = Text::of(source)?;
    let named = text.names.as_ref().map(|names| Layout::named(source, text.first, names));
    let named = named.transpose()?;
    if text.width < 3 {
        let message = format!("has {} columns without names", text.width);
        return Err(source
            .error(format!("line {}", text.first), message)
            .hint("a point is x, y, z and its attributes; or name the columns in the first line"));
    }
    let chosen = match (&named, scalar) {
        (Some(layout), Some(name)) => Some(layout.column(source, &text, name)?),
        _ => None,
    };
    let is_wanted = |column: usize| match &named {
        Some(layout) => layout.uses(column) || chosen == Some(column),
        None => true,
    };
    let numbers = text
        .numbers(source, |column| if is_wanted(column) { Want::Values } else { Want::Nothing })?;
    let table = Table { numbers, width: text.width, rows: text.len() };
    let layout = named.unwrap_or_else(|| Layout::guess(source, &table));
    let value = match (chosen, scalar) {
        (None, Some(name)) => Some(layout.column(source, &text, name)?),
        (chosen, _) => chosen,
    };
    source.spend("the size of the points in bytes", POINT * text.len() as u64)?;
    let positions = table.triples(layout.position).collect();
    let mut cloud = Cloud { positions, ..Cloud::default() };
    cloud.about.orientation = Some(Orientation::SURVEY);
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
    cloud.about.attributes = layout.attributes(&text);
    cloud.into_mesh(source)
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

    /// Returns whether three columns may be a normal: no number is beyond ±1, and one is negative
    /// or all lengths are 1.
    fn is_normal(&self, columns: [usize; 3]) -> bool {
        let signed = self.triples(columns).any(|v| v.min_element() < 0.0);
        self.triples(columns).all(|v| v.abs().max_element() <= 1.0)
            && (signed || self.is_unit(columns))
    }

    /// Returns whether all lengths are 1.
    fn is_unit(&self, columns: [usize; 3]) -> bool {
        self.triples(columns).all(|v| (v.length() - 1.0).abs() < 0.02)
    }

    /// Returns whether three columns are certainly a normal: colours are neither negative, nor have
    /// fractions of unit length only.
    fn is_surely_normal(&self, columns: [usize; 3]) -> bool {
        self.is_unit(columns)
            && self.triples(columns).any(|v| v.min_element() < 0.0 || v.fract() != DVec3::ZERO)
    }

    /// Returns whether three columns are colours in bytes: whole numbers up to 255.
    fn are_bytes(&self, columns: [usize; 3]) -> bool {
        columns.iter().all(|&column| self.largest(column).is_some_and(|most| most <= 255.0))
            && columns.iter().any(|&column| self.largest(column) > Some(1.0))
    }

    /// Returns the largest number of a column of natural numbers; `None` for other columns.
    fn largest(&self, column: usize) -> Option<f64> {
        let mut numbers = (0..self.rows).map(|row| self.value(row, column));
        numbers.try_fold(0.0, |most: f64, number| match number {
            _ if number.is_nan() => Some(most),
            _ => (number >= 0.0 && number.fract() == 0.0).then_some(most.max(number)),
        })
    }

    /// Returns whether three columns may be colours: natural numbers of up to 16 bits, or
    /// fractions.
    fn may_be_colors(&self, columns: [usize; 3]) -> bool {
        columns.iter().all(|&column| self.largest(column).is_some_and(|most| most <= 65535.0))
            || self.triples(columns).all(|c| c.min_element() >= 0.0 && c.max_element() <= 1.0)
    }

    /// Returns the mean difference between two columns.
    fn difference(&self, a: usize, b: usize) -> f64 {
        let one = |row: usize| (self.value(row, a) - self.value(row, b)).abs();
        (0..self.rows).map(one).filter(|difference| difference.is_finite()).sum::<f64>()
    }

    /// Returns the colours in three columns. The largest number of nearly all decides their scale.
    fn colors(&self, columns: [usize; 3]) -> Vec<[u8; 4]> {
        let mut seen = Brightness::default();
        self.triples(columns).for_each(|color| seen.add(color.max_element()));
        let largest = seen.largest();
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
        return matches!(words.len(), 1 | 3 | 6..=9 | 11..);
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
}

/// Labels and classes rarely exceed this; a channel of colours rarely stays below.
const DIM: f64 = 63.0;

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
        })
    }

    /// Guesses the meaning of columns without names from their values. After the position, three
    /// columns of unit length are a normal, and three of bytes the colour. If there are none, other
    /// columns at the usual places may be: fractions, and numbers of 16 bits.
    fn guess(source: &Source, table: &Table) -> Self {
        let width = table.width;
        let triple = |first: usize| [first, first + 1, first + 2];
        let all = || (3..).map(triple).take_while(|columns| columns[2] < width);
        let mut layout = Self { position: [0, 1, 2], ..Self::default() };
        layout.normal = all().find(|columns| table.is_surely_normal(*columns));
        let is_free = |taken: Option<[usize; 3]>, columns: &[usize; 3]| {
            taken.is_none_or(|taken| !columns.iter().any(|column| taken.contains(column)))
        };
        let bytes: Vec<[usize; 3]> = all()
            .filter(|columns| is_free(layout.normal, columns) && table.are_bytes(*columns))
            .collect();
        layout.color = brightest(source, table, &bytes);
        let usual: &[usize] = match width {
            6 | 8 => &[3],
            7 => &[4],
            9 => &[3, 6],
            10 => &[4, 7],
            _ => &[],
        };
        for columns in usual.iter().map(|&first| triple(first)) {
            if !is_free(layout.normal, &columns) || !is_free(layout.color, &columns) {
                continue;
            }
            if layout.normal.is_none() && table.is_normal(columns) {
                layout.normal = Some(columns);
            } else if layout.color.is_none() && table.may_be_colors(columns) {
                layout.color = Some(columns);
            }
        }
        layout.intensity = (width > 3 && !layout.uses(3)).then_some(3);
        layout
    }

    /// Returns the name of a column: its own, or a number from 1.
    fn name(&self, text: &Text, column: usize) -> String {
        match &text.names {
            Some(names) => names[column].clone(),
            None if self.intensity == Some(column) => "intensity".into(),
            None => format!("column {}", column + 1),
        }
    }

    /// Returns the names of the columns that are neither the position, nor the colour or the
    /// normal.
    fn attributes(&self, text: &Text) -> Vec<String> {
        (0..text.width)
            .filter(|&column| self.intensity == Some(column) || !self.uses(column))
            .filter(|&column| text.is_numeric(column))
            .map(|column| self.name(text, column))
            .collect()
    }

    /// Returns the column of an attribute.
    fn column(&self, source: &Source, text: &Text, name: &str) -> Result<usize> {
        let place = format!("line {}", text.first);
        let names: Vec<String> = match &text.names {
            Some(names) => names.clone(),
            None => self.attributes(text),
        };
        let at = attribute::named(source, &place, name, &names)?;
        Ok((0..text.width).find(|&column| self.name(text, column) == names[at]).unwrap_or(at))
    }

    fn uses(&self, column: usize) -> bool {
        let triples = [Some(self.position), self.color, self.normal];
        self.intensity == Some(column)
            || triples.iter().flatten().any(|columns| columns.contains(&column))
    }
}

/// Chooses the colour among triples of bytes. Beside it may be an intensity or a label in bytes,
/// which make triples with two of its channels. Labels are dim. An intensity comes first, unless
/// the channels differ less from each other without the last column.
fn brightest(source: &Source, table: &Table, triples: &[[usize; 3]]) -> Option<[usize; 3]> {
    let dim = |columns: &[usize; 3]| {
        columns.iter().filter(|&&column| table.largest(column) <= Some(DIM)).count()
    };
    let least = triples.iter().map(dim).min()?;
    let mut best = triples.iter().filter(|columns| dim(columns) == least);
    let first = *best.next()?;
    let Some(&second) = best.next().filter(|columns| columns[0] == first[0] + 1) else {
        return Some(first);
    };
    let [before, after] =
        [[first[0], first[1]], [second[1], second[2]]].map(|[a, b]| table.difference(a, b));
    let chosen = if 2.0 * before < after { first } else { second };
    warning::give!(
        "{}: columns {} to {} are read as the colour; name the columns in the first line if they \
         are not",
        source.path.display(),
        chosen[0] + 1,
        chosen[2] + 1
    );
    Some(chosen)
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

    /// Rows of `columns`: x y z position, r g b colour in bytes, u v w normal, i intensity in
    /// bytes, f intensity in fractions, l label.
    fn rows(columns: &str) -> String {
        let normals = ["0 0.6 0.8", "-1 0 0", "0.8 0 -0.6"];
        let numbers = |row: usize| {
            let of = |letter: char| match letter {
                'x' | 'y' | 'z' => format!("{row}.25"),
                'r' => ["200", "40", "90"][row].into(),
                'g' => ["190", "50", "80"][row].into(),
                'b' => ["180", "60", "85"][row].into(),
                'i' => ["3", "250", "20"][row].into(),
                'f' => ["0.5", "0.125", "1"][row].into(),
                'l' => ["2", "0", "11"][row].into(),
                _ => {
                    let at = "uvw".find(letter).expect("a letter of the list");
                    normals[row].split(' ').nth(at).expect("three numbers").to_owned()
                }
            };
            columns.chars().map(of).collect::<Vec<String>>().join(" ")
        };
        (0..3).map(|row| numbers(row) + "\n").collect()
    }

    #[test]
    fn columns_without_names_are_found_in_any_order() {
        for (columns, attributes) in [
            ("rgb", ""),
            ("rgbl", "column 7"),
            ("rgbi", "column 7"),
            ("irgb", "intensity"),
            ("frgb", "intensity"),
            ("rgbf", "column 7"),
            ("rgbuvw", ""),
            ("uvwrgb", ""),
            ("rgbluvw", "column 7"),
            ("frgbuvwl", "intensity column 11"),
            ("frgbl", "intensity column 8"),
            ("uvwfrgb", "column 7"),
            ("rgbll", "column 7 column 8"),
            ("uvwl", "column 7"),
            ("fl", "intensity column 5"),
        ] {
            let mesh = load(&rows(&format!("xyz{columns}"))).unwrap();
            let colored = columns.contains('r').then_some([200, 190, 180, 255]);
            let grey = matches!(columns, "fl");
            assert!(
                grey || mesh.colors.first().copied() == colored,
                "{columns}: {:?}",
                mesh.colors
            );
            assert_eq!(!mesh.normals.is_empty(), columns.contains('u'), "{columns}");
            assert_eq!(mesh.about.attributes.join(" "), attributes, "{columns}");
        }
        let folder = Folder::new();
        let path = folder.write("a.xyz", rows("xyzrgbl"));
        let labels = read_with(&path, |source| read_named(source, Some("Column 7"))).unwrap();
        assert_eq!(labels.values, [2.0, 0.0, 11.0]);
    }

    #[test]
    fn headers_of_cloudcompare_name_colours() {
        let text = "//X;Y;Z;Rf;Gf;Bf;Intensity;Nx;Ny;Nz\n2\n1;2;3;1;0.502;0;7;0;0.6;0.8\n\
                    4;5;6;0;0;0.2;8;1;0;0\n";
        let mesh = load(text).unwrap();
        assert_eq!(mesh.colors, [[255, 128, 0, 255], [0, 0, 51, 255]]);
        assert_eq!((mesh.normals.len(), mesh.about.attributes), (2, vec!["Intensity".to_owned()]));
        let folder = Folder::new();
        let path = folder.write("a.pts", text);
        let limits = Limits::default();
        let source = Source::open(&path, &limits).unwrap();
        assert_eq!(crate::formats::arrays(&source, &ReadOptions::default()).unwrap().len(), 10);
    }

    #[test]
    fn points_that_are_not_at_finite_coordinates_are_left_out() {
        for bad in ["nan nan nan", "1 -nan(ind) 2", "1.#QNAN 0 0", "inf 0 0", "0 NA 0"] {
            let mesh = load(&format!("1 2 3 255 0 9\n{bad} 1 2 3\n4 5 6 0 0 51\n")).unwrap();
            assert_eq!((mesh.positions.len(), mesh.colors[1]), (2, [0, 0, 51, 255]), "{bad}");
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
            let result = read_with(&path, |source| read_named(source, Some(name)));
            match (result, wanted) {
                (Ok(mesh), Some(wanted)) => assert_eq!(mesh.values, wanted, "{text}"),
                (Err(error), None) => {
                    let message = error.to_string();
                    assert!(message.contains("line 1: has no attribute"), "{message}");
                }
                (result, _) => panic!("{text}: {:?}", result.map(|mesh| mesh.values)),
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
            ("x y z\n", "no points"),
            ("1 2 3\n4 5", "line 2: has 2 columns, but the first line has 3"),
            ("nan 2 3\n4 - 6", "none of the 2 points"),
            ("1 2 3\r\n4 five 6\r\n", "line 2: “five” is not a number"),
            ("1 2 3\r4 five 6\r", "line 2: “five” is not a number"),
            ("\u{feff}1,5 2,5 3,5\n", "neither numbers nor column names"),
            ("1 2 3\n4 five 6", "line 2: “five” is not a number"),
            ("3\n1 2 3\n4 5 6\n", "line 1: counts 3 points, but there are 2"),
            (
                "18446744073709551615\n1 2 3\n18446744073709551615\n4 5 6\n",
                "line 1: counts 18446744073709551615",
            ),
            ("0\n1 2 3\n", "counts 0 points"),
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
