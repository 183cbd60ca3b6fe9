//! Glyphs: an arrow for each vector, or an ellipsoid for each tensor, of an array of points.
//!
//! They are a mesh, whose values are the lengths of the vectors or the largest eigenvalues.

use super::{Data, Name, Opened};
use crate::{
    Error, Result,
    about::About,
    formats::{self, Array, Place, ReadOptions},
    math::{Bounds, eigen},
    surface::Mesh,
    warning,
};
use glam::{DMat3, DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::{f64::consts::TAU, str::FromStr};

/// Which glyphs are drawn: `arrows` or `ellipsoids`, with the array's name after a colon.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Glyphs {
    /// Their shape.
    pub shape: GlyphShape,
    /// The array; by default the first one of vectors or of tensors. Several names with commas
    /// between them are the components.
    pub array: Option<String>,
}

/// The shape of glyphs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GlyphShape {
    /// Arrows that begin at the points, for vectors.
    Arrows,
    /// Ellipsoids around the points, for symmetric tensors.
    Ellipsoids,
}

impl FromStr for Glyphs {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (shape, array) = text.split_once(':').map_or((text, None), |(a, b)| (a, Some(b)));
        let shape = match shape.trim() {
            "arrows" => GlyphShape::Arrows,
            "ellipsoids" => GlyphShape::Ellipsoids,
            _ => return Err("use arrows or ellipsoids, with :ARRAY as wished".into()),
        };
        let array = array.map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned);
        Ok(Self { shape, array })
    }
}

impl TryFrom<String> for Glyphs {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        text.parse()
    }
}

impl From<Glyphs> for String {
    fn from(glyphs: Glyphs) -> Self {
        let shape = match glyphs.shape {
            GlyphShape::Arrows => "arrows",
            GlyphShape::Ellipsoids => "ellipsoids",
        };
        glyphs.array.map_or_else(|| shape.into(), |array| format!("{shape}:{array}"))
    }
}

/// Most glyphs in a picture. Of more points, some are chosen evenly.
const MOST: usize = 4096;
/// The length of the longest arrow, and the longest radius of an ellipsoid, in distances of glyphs.
const LONGEST: [f64; 2] = [1.5, 0.5];
/// Share of the glyphs that may be longer than the longest usual one.
const OUTLIERS: f64 = 0.02;
/// How much longer they may be.
const MOST_OUT: f64 = 1.5;
/// The shortest axis of an ellipsoid, as a share of its longest one.
const THINNEST: f64 = 0.04;
/// The radii of an arrow's shaft and head, and the length of its head, as shares of its length.
const SHAFT: f64 = 0.035;
const HEAD: f64 = 0.1;
const HEAD_LENGTH: f64 = 0.32;
/// Sides of an arrow.
const SIDES: u32 = 12;

/// The points of an input, and the numbers of an array at each.
struct Field {
    places: Vec<DVec3>,
    /// One list for each component.
    components: Vec<Vec<f32>>,
    about: About,
}

impl Opened<'_> {
    /// Returns the glyphs of an array of this input, of which `data` was read. `scale` is a factor
    /// on their size.
    ///
    /// # Errors
    /// Those of reading; [`Error::Input`] for an array that the input does not have, or that has
    /// other components than the glyphs need.
    pub fn glyphs(&self, data: &Data, glyphs: &Glyphs, scale: f64) -> Result<Mesh> {
        let field = self.field(data, glyphs)?;
        let mut mesh = match glyphs.shape {
            GlyphShape::Arrows => field.arrows(scale),
            GlyphShape::Ellipsoids => field.ellipsoids(scale),
        };
        if mesh.triangles.is_empty() {
            let message = "all values of the array are zero, or none is finite";
            return Err(self.wrong_array(message.into()));
        }
        mesh.about = field.about;
        Ok(mesh)
    }

    fn field(&self, data: &Data, glyphs: &Glyphs) -> Result<Field> {
        let (places, about) = match data {
            Data::Mesh(mesh) => (around(mesh.origin, &mesh.positions), &mesh.about),
            Data::Cells(cells) => (around(cells.origin, &cells.points), &cells.about),
            Data::Samples(points) => (around(points.origin, &points.positions), &points.about),
            Data::Volume(volume) => {
                let place = |at: usize| volume.lattice.sample_position(at);
                ((0..volume.len()).map(place).collect(), &volume.about)
            }
            Data::Gaussians(_) | Data::Hierarchy(_) | Data::Bricks(_) => {
                return Err(self.wrong_array("inputs of this kind have no arrays".into()));
            }
        };
        let names = self.names_of(glyphs)?;
        let array = match &names[..] {
            [first, ..] if !first.contains(':') => names.join(", "),
            names => names[0].rsplit_once(':').map_or("", |(name, _)| name).to_owned(),
        };
        let components = names.iter().map(|name| self.component(data, name));
        let components: Vec<Vec<f32>> = components.collect::<Result<_>>()?;
        if components.iter().any(|values| values.len() != places.len()) {
            return Err(self.wrong_array(format!("“{array}” is no array of points")));
        }
        let mut about = About { name: array, unit: String::new(), ..about.clone() };
        (about.labels, about.window) = (None, None);
        Ok(Field { places, components, about })
    }

    /// Returns the names of the components of the array that glyphs show.
    fn names_of(&self, glyphs: &Glyphs) -> Result<Vec<String>> {
        let needed: &[usize] = match glyphs.shape {
            GlyphShape::Arrows => &[3],
            GlyphShape::Ellipsoids => &[6, 9],
        };
        let list = self.arrays()?;
        let fits =
            |array: &&Array| needed.contains(&array.components) && array.place == Place::Points;
        let of = |array: &Array| {
            (0..array.components).map(|part| format!("{}:{part}", array.name)).collect()
        };
        let wanted = needed.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or ");
        let Some(name) = &glyphs.array else {
            return list.iter().find(fits).map(of).ok_or_else(|| {
                self.wrong_array(format!("no array of points has {wanted} components"))
            });
        };
        let parts: Vec<String> = name.split(',').map(|part| part.trim().to_owned()).collect();
        if needed.contains(&parts.len()) {
            return Ok(parts);
        }
        match list.iter().find(|array| array.name == *name) {
            Some(array) if fits(&array) => Ok(of(array)),
            Some(array) => Err(self.wrong_array(format!(
                "“{name}” has {} components, of {}, but {wanted} of points are needed",
                array.components,
                array.place.name()
            ))),
            None => Err(self.wrong_array(format!("there is no array “{name}”"))),
        }
    }

    /// Returns the values of an array, or of one component.
    fn component(&self, data: &Data, name: &str) -> Result<Vec<f32>> {
        let Some(source) = self.source() else { return Ok(Vec::new()) };
        let options = ReadOptions { scalar: Some(name.into()), ..self.options().clone() };
        Ok(match data {
            Data::Mesh(_) => formats::read_mesh(source, &options)?.values,
            Data::Cells(_) => formats::read_cells(source, &options)?.values,
            Data::Volume(_) => {
                let volume = formats::read_volume(source, &options)?;
                (0..volume.len()).map(|at| volume.value(at) as f32).collect()
            }
            _ => formats::read_samples(source, &options)?.values,
        })
    }

    fn wrong_array(&self, message: String) -> Error {
        let hint = "`splatkit info` lists the arrays; --glyphs arrows:NAME names one, and \
                    --glyphs arrows:vx,vy,vz its components";
        Name::of_file(self.path()).unfit("glyphs", &message, hint)
    }
}

fn around(origin: DVec3, positions: &[Vec3]) -> Vec<DVec3> {
    positions.iter().map(|place| origin + place.as_dvec3()).collect()
}

impl Field {
    /// Returns the numbers at a point; `None` if one is not finite.
    fn at<const N: usize>(&self, point: usize) -> Option<[f64; N]> {
        let numbers: [f64; N] = std::array::from_fn(|part| f64::from(self.components[part][point]));
        numbers.iter().all(|number| number.is_finite()).then_some(numbers)
    }

    /// Returns the points that get a glyph: evenly chosen, without order, if there are too many.
    fn chosen(&self) -> Vec<usize> {
        let count = self.places.len();
        if count <= MOST {
            return (0..count).collect();
        }
        warning::give!("{}: shows about {MOST} of {count} glyphs", self.about.name);
        let share = MOST as f64 / count as f64;
        // Multiplication by the golden ratio spreads successive numbers evenly.
        let place = |at: &usize| (*at as f64 * 0.618_033_988_749_895).fract();
        let mut chosen: Vec<usize> = (0..count).filter(|at| place(at) < share).collect();
        chosen.truncate(MOST);
        chosen
    }

    /// Returns the usual distance of glyphs at these points.
    fn distance(&self, chosen: &[usize]) -> f64 {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let grow = |(low, high): (DVec3, DVec3), at: &usize| {
            (low.min(self.places[*at]), high.max(self.places[*at]))
        };
        let (min, max) = chosen.iter().fold(none, grow);
        let extent = Bounds { min, max }.size();
        // Points in a plane or on a line have no extent along the other axes.
        let wide = |side: &f64| *side > 1e-3 * extent.max_element();
        let sides: Vec<f64> = extent.to_array().into_iter().filter(wide).collect();
        match sides.len() {
            0 => 1.0,
            axes => (sides.iter().product::<f64>() / chosen.len() as f64).powf(1.0 / axes as f64),
        }
    }

    /// Returns the factor from a size of the array to that of glyphs.
    fn factor(sizes: &[f64], longest: f64) -> f64 {
        let mut sorted: Vec<f64> = sizes.iter().copied().filter(|size| *size > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        let last = ((1.0 - OUTLIERS) * sorted.len() as f64) as usize;
        sorted.get(last.min(sorted.len().saturating_sub(1))).map_or(0.0, |usual| longest / usual)
    }

    fn arrows(&self, scale: f64) -> Mesh {
        let chosen = self.chosen();
        let vector = |at: &usize| self.at::<3>(*at).map_or(DVec3::ZERO, DVec3::from_array);
        let lengths: Vec<f64> = chosen.iter().map(|at| vector(at).length()).collect();
        let longest = LONGEST[0] * scale * self.distance(&chosen);
        let factor = Self::factor(&lengths, longest);
        let (shape, triangles) = arrow();
        let mut mesh = self.empty(&chosen);
        for (at, length) in chosen.iter().zip(&lengths) {
            let Some(along) = vector(at).try_normalize() else { continue };
            let size = (length * factor).min(MOST_OUT * longest);
            let side = along.any_orthonormal_vector();
            let turn = DMat3::from_cols(side, along.cross(side), along) * size;
            let points = shape.iter().map(|point| self.places[*at] + turn * *point);
            add(&mut mesh, points, &triangles, *length);
        }
        mesh
    }

    fn ellipsoids(&self, scale: f64) -> Mesh {
        let chosen = self.chosen();
        let axes: Vec<([f64; 3], [DVec3; 3])> = chosen.iter().map(|at| self.axes(*at)).collect();
        let sizes: Vec<f64> = axes.iter().map(|(lengths, _)| lengths[0]).collect();
        let longest = LONGEST[1] * scale * self.distance(&chosen);
        let factor = Self::factor(&sizes, longest);
        // Fewer ellipsoids are larger in the picture.
        let shape = Mesh::sphere(match chosen.len() {
            ..=400 => 3,
            401..=2000 => 2,
            _ => 1,
        });
        let mut mesh = self.empty(&chosen);
        for (at, (lengths, directions)) in chosen.iter().zip(axes) {
            if lengths[0] <= 0.0 {
                continue;
            }
            let grow = factor.min(MOST_OUT * longest / lengths[0]);
            let radii = lengths.map(|length| grow * length.max(THINNEST * lengths[0]));
            let axis = |number: usize| directions[number] * radii[number];
            let shear = DMat3::from_cols(axis(0), axis(1), axis(2));
            let upright = shear.inverse().transpose();
            let unit = |point: &Vec3| point.as_dvec3();
            let points = shape.positions.iter().map(|point| self.places[*at] + shear * unit(point));
            let normals = shape.positions.iter().map(|point| (upright * unit(point)).normalize());
            mesh.normals.extend(normals.map(|normal| normal.as_vec3()));
            // Eigenvectors may be left-handed.
            let mirrors = shear.determinant() < 0.0;
            let turned = |&[a, b, c]: &[u32; 3]| if mirrors { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<[u32; 3]> = shape.triangles.iter().map(turned).collect();
            add(&mut mesh, points, &triangles, lengths[0]);
        }
        mesh
    }

    /// Returns the magnitudes of the eigenvalues of a tensor, the largest first, and the
    /// eigenvectors. VTK writes the six numbers of a symmetric one as xx, yy, zz, xy, yz, xz.
    fn axes(&self, point: usize) -> ([f64; 3], [DVec3; 3]) {
        let matrix = match self.components.len() {
            6 => self.at::<6>(point).map(|[xx, yy, zz, xy, yz, xz]| {
                DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
            }),
            _ => self.at::<9>(point).map(|numbers| {
                let matrix = DMat3::from_cols_array(&numbers);
                (matrix + matrix.transpose()) * 0.5
            }),
        };
        let matrix = matrix.unwrap_or(DMat3::ZERO);
        let (squares, directions) = eigen(matrix * matrix);
        (squares.map(f64::sqrt), directions)
    }

    /// Returns a mesh without triangles around these points.
    fn empty(&self, chosen: &[usize]) -> Mesh {
        let origin = chosen.first().map_or(DVec3::ZERO, |at| self.places[*at]);
        Mesh { origin, ..Mesh::default() }
    }
}

/// Adds a shape of this value to a mesh.
fn add(mesh: &mut Mesh, points: impl Iterator<Item = DVec3>, triangles: &[[u32; 3]], value: f64) {
    let first = mesh.positions.len() as u32;
    let origin = mesh.origin;
    mesh.positions.extend(points.map(|point| (point - origin).as_vec3()));
    mesh.values.resize(mesh.positions.len(), value as f32);
    mesh.triangles.extend(triangles.iter().map(|corners| corners.map(|corner| first + corner)));
}

/// Returns an arrow from the origin to z = 1.
fn arrow() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let neck = 1.0 - HEAD_LENGTH;
    let rings = [(SHAFT, 0.0), (SHAFT, neck), (HEAD, neck)];
    let mut points = vec![DVec3::ZERO, DVec3::Z];
    for (radius, z) in rings {
        points.extend((0..SIDES).map(|side| {
            let (sine, cosine) = (TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
            DVec3::new(radius * cosine, radius * sine, z)
        }));
    }
    let at = |ring: u32, side: u32| 2 + ring * SIDES + side % SIDES;
    let mut triangles = Vec::new();
    for side in 0..SIDES {
        let next = side + 1;
        triangles.push([0, at(0, next), at(0, side)]);
        for ring in 0..2 {
            let [a, b] = [at(ring, side), at(ring, next)];
            let [c, d] = [at(ring + 1, side), at(ring + 1, next)];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
        triangles.push([at(2, side), at(2, next), 1]);
    }
    (points, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(components: &[&[f32]]) -> Field {
        let count = components[0].len();
        Field {
            places: (0..count).map(|at| DVec3::X * at as f64).collect(),
            components: components.iter().map(|part| part.to_vec()).collect(),
            about: About::default(),
        }
    }

    /// Returns the box of one glyph among several of the same shape.
    fn bounds(mesh: &Mesh, number: usize, count: usize) -> (DVec3, DVec3) {
        let each = mesh.positions.len() / count;
        let places = mesh.positions[number * each..(number + 1) * each].iter();
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        places
            .map(|place| mesh.origin + place.as_dvec3())
            .fold(none, |(low, high), place| (low.min(place), high.max(place)))
    }

    #[test]
    fn arrows_point_along_vectors_and_are_as_long() {
        let field = field(&[&[0.0, 0.0, 0.0, 0.0], &[0.0; 4], &[4.0, -2.0, 0.0, f32::NAN]]);
        let mesh = field.arrows(1.0);
        // Neither zero nor what has no value has an arrow.
        let (low, high) = bounds(&mesh, 0, 2);
        let length = high.z - low.z;
        assert!(low.z.abs() < 1e-6 && (length / (1.5 * 0.75) - 1.0).abs() < 1e-3, "{low} {high}");
        assert!((high.x - HEAD * length).abs() < 1e-6);
        let (low, high) = bounds(&mesh, 1, 2);
        assert!((low.z + 0.5 * length).abs() < 1e-6 && high.z.abs() < 1e-6, "{low} {high}");
        assert_eq!((mesh.values[0], mesh.values[mesh.values.len() - 1]), (4.0, 2.0));
        assert!(mesh.is_solid());
    }

    #[test]
    fn ellipsoids_have_the_axes_of_tensors() {
        // 2 along (1, 1, 0), −1 along (1, −1, 0), and 0.5 along z.
        let numbers = [[0.5f32], [0.5], [0.5], [1.5], [0.0], [0.0]];
        let parts: Vec<&[f32]> = numbers.iter().map(|part| &part[..]).collect();
        let mesh = field(&parts).ellipsoids(1.0);
        let along = |axis: DVec3| {
            let places = mesh.positions.iter().map(|place| place.as_dvec3().dot(axis.normalize()));
            places.fold(0.0, f64::max)
        };
        let [long, middle, short] =
            [DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::Z].map(along);
        assert!((long - 0.5).abs() < 0.01, "{long}");
        assert!((middle / long - 0.5).abs() < 0.02 && (short / long - 0.25).abs() < 0.02);
        assert!(mesh.is_solid() && mesh.normals.len() == mesh.positions.len());
    }

    #[test]
    fn texts_name_shapes_and_arrays() {
        for text in ["arrows", "ellipsoids:stress", "arrows:vx,vy,vz"] {
            let glyphs: Glyphs = text.parse().unwrap();
            assert_eq!(String::from(glyphs), text);
        }
        assert!("cones".parse::<Glyphs>().unwrap_err().contains("arrows or ellipsoids"));
    }
}
