//! Clips of a description: planes and boxes, in world units or in shares of the scene.

use crate::{
    Error, Result,
    math::Bounds,
    scene::{Clip, ClipShape},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A clip: a shape in world coordinates, and what is kept. It has one shape.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ClipEntry {
    /// The half-space of the points x with normal·x ≤ offset: normal, then offset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<[f64; 4]>,
    /// What lies on one side of a plane across an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<ClipSide>,
    /// A box along the world's axes: the lower and the upper corner.
    #[serde(default, skip_serializing_if = "Option::is_none", rename = "box")]
    pub cuboid: Option<[[Place; 3]; 2]>,
    /// Whether what is inside the shape is kept, or what is outside.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub inside: bool,
}

/// The points below or above a place on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ClipSide {
    /// The axis.
    pub axis: Axis,
    /// Whether the points below the place are inside, or those above it.
    pub below: bool,
    /// The place.
    pub at: Place,
}

/// An axis of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

/// A coordinate: a number in world units, or a text such as `50%`, a share of the scene's box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "PlaceText", into = "PlaceText")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "PlaceText"))]
pub enum Place {
    /// In world units.
    World(f64),
    /// A share of the scene's box in percent, 0 … 100 inside.
    Percent(f64),
}

/// [`Place`] in JSON.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
enum PlaceText {
    World(f64),
    Share(String),
}

impl TryFrom<PlaceText> for Place {
    type Error = String;

    fn try_from(text: PlaceText) -> std::result::Result<Self, String> {
        match text {
            PlaceText::World(at) => Ok(Self::World(at)),
            PlaceText::Share(text) => Self::parse(&text),
        }
    }
}

impl From<Place> for PlaceText {
    fn from(place: Place) -> Self {
        match place {
            Place::World(at) => Self::World(at),
            Place::Percent(_) => Self::Share(place.to_string()),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::World(at) => write!(f, "{at}"),
            Self::Percent(share) => write!(f, "{share}%"),
        }
    }
}

impl Place {
    /// Reads `12.5` or `50%`.
    ///
    /// # Errors
    /// What a coordinate is.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let text = text.trim();
        let number = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
        let place = match text.strip_suffix('%') {
            Some(share) => number(share).map(Self::Percent),
            None => number(text).map(Self::World),
        };
        place.ok_or_else(|| format!("“{text}” is not a coordinate, such as 12.5 or 50%"))
    }

    fn in_world(self, axis: usize, bounds: &Bounds) -> f64 {
        match self {
            Self::World(at) => at,
            Self::Percent(share) => {
                bounds.min[axis] + share / 100.0 * (bounds.max[axis] - bounds.min[axis])
            }
        }
    }
}

fn yes() -> bool {
    true
}

fn is_yes(value: &bool) -> bool {
    *value
}

impl ClipEntry {
    const NONE: Self = Self { plane: None, side: None, cuboid: None, inside: true };

    /// Reads `plane:NX,NY,NZ,OFFSET`, `box:X0,Y0,Z0:X1,Y1,Z1`, `x<AT` or `x>AT`.
    ///
    /// # Errors
    /// What is wrong with the shape.
    pub fn parse(text: &str, inside: bool) -> std::result::Result<Self, String> {
        let clip = match text.split_once(':') {
            Some(("plane", numbers)) => Self::of_plane(plane(numbers)?),
            Some(("box", corners)) => Self { cuboid: Some(cuboid(corners)?), ..Self::NONE },
            _ => Self { side: Some(side(text)?), ..Self::NONE },
        };
        clip.check()?;
        Ok(Self { inside, ..clip })
    }

    /// A clip that keeps the points x with normal·x ≤ offset: normal, then offset.
    pub fn of_plane(plane: [f64; 4]) -> Self {
        Self { plane: Some(plane), ..Self::NONE }
    }

    /// A clip that keeps a box: its lower and its upper corner in world units.
    pub fn of_box(corners: [[f64; 3]; 2]) -> Self {
        Self { cuboid: Some(corners.map(|corner| corner.map(Place::World))), ..Self::NONE }
    }

    /// Returns the corners of a box whose places are all in world units.
    pub fn corners(&self) -> Option<[[f64; 3]; 2]> {
        let mut corners = [[0.0; 3]; 2];
        for (places, corner) in self.cuboid?.iter().zip(&mut corners) {
            for (place, at) in places.iter().zip(corner) {
                let Place::World(world) = place else { return None };
                *at = *world;
            }
        }
        Some(corners)
    }

    /// Checks what does not depend on the scene.
    ///
    /// # Errors
    /// If there is no shape, or more than one, or if it is none.
    pub fn check(&self) -> std::result::Result<(), String> {
        match (self.plane, self.side, self.cuboid) {
            (Some(numbers), None, None) => check_plane(numbers),
            (None, Some(_), None) => Ok(()),
            (None, None, Some(corners)) => check_cuboid(corners),
            _ => Err("a clip has either a plane, a side or a box".into()),
        }
    }

    /// Returns the clip of a scene whose samples and vertices lie in `bounds`.
    ///
    /// # Errors
    /// Those of [`check`](Self::check).
    pub fn clip(&self, bounds: &Bounds) -> std::result::Result<Clip, String> {
        self.check()?;
        let shape = match (self.plane, self.side, self.cuboid) {
            (Some([x, y, z, offset]), ..) => {
                ClipShape::HalfSpace { normal: DVec3::new(x, y, z), offset }
            }
            (_, Some(ClipSide { axis, below, at }), _) => {
                let sign = if below { 1.0 } else { -1.0 };
                let mut normal = DVec3::ZERO;
                normal[axis as usize] = sign;
                let offset = sign * at.in_world(axis as usize, bounds);
                ClipShape::HalfSpace { normal, offset }
            }
            (.., corners) => {
                let corner = |places: [Place; 3]| {
                    DVec3::from_array([0, 1, 2].map(|axis| places[axis].in_world(axis, bounds)))
                };
                let places = corners.unwrap_or([[Place::World(0.0); 3]; 2]);
                let [mut min, mut max] = places.map(corner);
                if !self.inside {
                    // A side of the scene that is cut off does not stay as a skin.
                    let beyond = BEYOND * bounds.diagonal();
                    for axis in 0..3 {
                        let is_end = |place: Place, end: f64| place == Place::Percent(end);
                        min[axis] -= if is_end(places[0][axis], 0.0) { beyond } else { 0.0 };
                        max[axis] += if is_end(places[1][axis], 100.0) { beyond } else { 0.0 };
                    }
                }
                ClipShape::Box(Bounds { min, max })
            }
        };
        Ok(Clip { shape, inside: self.inside })
    }

    /// Returns the clips of a scene. `bounds` is the box of its samples and vertices, `whole` that
    /// of its splats.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`] for a clip that leaves nothing of the scene.
    pub(super) fn all(entries: &[Self], bounds: &Bounds, whole: &Bounds) -> Result<Vec<Clip>> {
        let clip = |entry: &Self| {
            let clip = entry.clip(bounds).map_err(Error::Argument)?;
            if leaves_nothing(&clip, whole) {
                let Bounds { min, max } = bounds;
                return Err(Error::NothingToDraw(format!(
                    "{entry} leaves nothing of the scene, which lies between {min} and {max}"
                )));
            }
            Ok(clip)
        };
        entries.iter().map(clip).collect()
    }

    /// Returns the text that [`parse`](Self::parse) reads.
    pub fn text(&self) -> String {
        let list = |places: [Place; 3]| places.map(|place| place.to_string()).join(",");
        match (self.plane, self.side, self.cuboid) {
            (Some([x, y, z, offset]), ..) => format!("plane:{x},{y},{z},{offset}"),
            (_, Some(ClipSide { axis, below, at }), _) => {
                let axis = ["x", "y", "z"][axis as usize];
                format!("{axis}{}{at}", if below { '<' } else { '>' })
            }
            (_, _, Some([low, high])) => format!("box:{}:{}", list(low), list(high)),
            _ => String::new(),
        }
    }
}

/// The flag of the command that is this clip.
impl fmt::Display for ClipEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let flag = if self.inside { "--clip" } else { "--cut-out" };
        write!(f, "{flag} '{}'", self.text())
    }
}

impl From<&Clip> for ClipEntry {
    fn from(clip: &Clip) -> Self {
        let shape = match clip.shape {
            ClipShape::HalfSpace { normal: DVec3 { x, y, z }, offset } => {
                Self::of_plane([x, y, z, offset])
            }
            ClipShape::Box(Bounds { min, max }) => Self::of_box([min.to_array(), max.to_array()]),
        };
        Self { inside: clip.inside, ..shape }
    }
}

/// `NX,NY,NZ,OFFSET`.
fn plane(text: &str) -> std::result::Result<[f64; 4], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    let count = text.split(',').count();
    let numbers: Option<[f64; 4]> = numbers.try_into().ok().filter(|_| count == 4);
    numbers.ok_or_else(|| "the form is plane:NX,NY,NZ,OFFSET, such as plane:1,0,0,12.5".into())
}

fn check_plane(numbers: [f64; 4]) -> std::result::Result<(), String> {
    let [x, y, z, _] = numbers;
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err("the numbers must be finite".into());
    }
    let normal = DVec3::new(x, y, z);
    if normal == DVec3::ZERO {
        return Err("a plane needs a direction that is not 0,0,0".into());
    }
    // The square of any other length is 0 or ∞.
    if !(1e-150..=1e150).contains(&normal.length()) {
        return Err(
            "a plane's direction needs a length from 1e-150 to 1e150, but only its direction counts"
                .into(),
        );
    }
    Ok(())
}

/// `X0,Y0,Z0:X1,Y1,Z1`.
fn cuboid(text: &str) -> std::result::Result<[[Place; 3]; 2], String> {
    let form = "the form is box:X0,Y0,Z0:X1,Y1,Z1, such as box:0,0,0:50%,100%,100%";
    let corner = |text: &str| -> std::result::Result<[Place; 3], String> {
        let places: Vec<_> =
            text.split(',').map(Place::parse).collect::<std::result::Result<_, _>>()?;
        places.try_into().map_err(|_| form.to_owned())
    };
    let (low, high) = text.split_once(':').ok_or(form)?;
    Ok([corner(low)?, corner(high)?])
}

fn check_cuboid([low, high]: [[Place; 3]; 2]) -> std::result::Result<(), String> {
    for (low, high) in low.into_iter().zip(high) {
        match (low, high) {
            (Place::World(low), Place::World(high))
            | (Place::Percent(low), Place::Percent(high))
                if low >= high =>
            {
                return Err(
                    "the first corner of a box must lie below the second on every axis".into()
                );
            }
            _ => {}
        }
    }
    Ok(())
}

/// `x<AT` or `x>AT`.
fn side(text: &str) -> std::result::Result<ClipSide, String> {
    let form = "the forms are plane:NX,NY,NZ,OFFSET, box:X0,Y0,Z0:X1,Y1,Z1 and 'x<AT' or 'x>AT'";
    let at = text.find(['<', '>']).ok_or(form)?;
    let axis = match text[..at].trim() {
        "x" | "X" => Axis::X,
        "y" | "Y" => Axis::Y,
        "z" | "Z" => Axis::Z,
        _ => return Err(form.into()),
    };
    let below = text[at..].starts_with('<');
    Ok(ClipSide { axis, below, at: Place::parse(&text[at + 1..])? })
}

/// How far a box that is cut out reaches beyond the ends of the scene, as a share of its diagonal.
const BEYOND: f64 = 1e-5;

/// Whether one clip alone removes all of a box.
fn leaves_nothing(clip: &Clip, whole: &Bounds) -> bool {
    match clip.shape {
        ClipShape::HalfSpace { normal, offset } => {
            let heights = whole.corners().map(|corner| normal.dot(corner));
            match clip.inside {
                true => heights.iter().all(|height| *height > offset),
                false => heights.iter().all(|height| *height <= offset),
            }
        }
        ClipShape::Box(Bounds { min, max }) => match clip.inside {
            true => (max.cmplt(whole.min) | min.cmpgt(whole.max)).any(),
            false => (min.cmple(whole.min) & max.cmpge(whole.max)).all(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: Bounds = Bounds { min: DVec3::ZERO, max: DVec3::new(10.0, 20.0, 40.0) };

    fn world(text: &str) -> ClipShape {
        let entry = ClipEntry::parse(text, true).unwrap();
        assert_eq!(ClipEntry::parse(&entry.text(), true), Ok(entry), "{text}");
        let json = serde_json::to_string(&entry).unwrap();
        assert_eq!(serde_json::from_str::<ClipEntry>(&json).unwrap(), entry, "{json}");
        entry.clip(&SCENE).unwrap().shape
    }

    #[test]
    fn shapes_are_read() {
        assert_eq!(
            world("plane:0,0,2,5"),
            ClipShape::HalfSpace { normal: 2.0 * DVec3::Z, offset: 5.0 }
        );
        assert_eq!(world("x<50%"), ClipShape::HalfSpace { normal: DVec3::X, offset: 5.0 });
        assert_eq!(world("Z > -4"), ClipShape::HalfSpace { normal: DVec3::NEG_Z, offset: 4.0 });
        let half = Bounds { min: DVec3::new(1.0, 0.0, 0.0), max: DVec3::new(5.0, 20.0, 20.0) };
        assert_eq!(world("box:1,0,0%:50%,20,50%"), ClipShape::Box(half));
        let cut = ClipEntry::parse("box:1,0,0%:50%,20,50%", false).unwrap();
        let ClipShape::Box(cut) = cut.clip(&SCENE).unwrap().shape else { panic!("a box") };
        assert!(cut.min.z < half.min.z && cut.min.z > half.min.z - 0.01);
        assert_eq!((cut.min.x, cut.min.y, cut.max), (half.min.x, half.min.y, half.max));
    }

    #[test]
    fn wrong_shapes_are_told() {
        let message = |text: &str| ClipEntry::parse(text, true).unwrap_err();
        assert!(message("plane:0,0,0,1").contains("direction"));
        assert!(
            message("plane:1e200,0,0,1").contains("length")
                && message("plane:0,1e-200,0,1").contains("length")
        );
        assert!(message("plane:1,0,0").contains("plane:NX,NY,NZ,OFFSET"));
        assert!(message("plane:1,0,0,inf").contains("finite"));
        assert!(message("box:0,0,0").contains("box:X0"));
        assert!(message("box:0,0,0:1,1").contains("box:X0"));
        assert!(message("box:0,2,0:1,1,1").contains("below"));
        assert!(message("box:0,0,0:1,1,one").contains("“one”"));
        for text in ["", "w<3", "x=3", "<3", "sphere:1"] {
            assert!(message(text).contains("the forms are"), "{text}");
        }
        assert!(message("x<").contains("not a coordinate"));
        let none = serde_json::from_str::<ClipEntry>("{}").unwrap();
        assert!(none.check().unwrap_err().contains("either"));
        assert!(serde_json::from_str::<ClipEntry>(r#"{"plan": [1, 0, 0, 0]}"#).is_err());
    }

    #[test]
    fn what_leaves_nothing_is_known() {
        let nothing =
            |text: &str, inside| leaves_nothing(&Clip { shape: world(text), inside }, &SCENE);
        assert!(
            nothing("x<-1", true) && nothing("x>-1", false) && nothing("box:-9,0,0:-1,9,9", true)
        );
        assert!(nothing("box:0,0,0:100%,100%,100%", false));
        assert!(
            !nothing("x<0", true) && !nothing("x<1", false) && !nothing("box:1,1,1:2,2,2", true)
        );
        assert!(!nothing("box:0,0,0:100%,100%,99%", false));
    }
}
