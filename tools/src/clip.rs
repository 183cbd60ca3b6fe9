//! The flags that clip a scene with planes and boxes.

use crate::{failure::Failure, parse};
use clap::Args;
use glam::DVec3;
use splatkit::{
    Error,
    math::Bounds,
    scene::{Clip, ClipShape, Scene, Settings},
};

/// Which part of space is drawn. Up to eight flags work together.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Clipping")]
pub struct ClipFlags {
    /// Keep only what is inside this shape: plane:NX,NY,NZ,OFFSET (NX·x + NY·y + NZ·z at most
    /// OFFSET), box:X0,Y0,Z0:X1,Y1,Z1, or 'x<AT' or 'x>AT' (also y, z). Coordinates are in world
    /// units, or, except for planes, shares of the scene's box such as 50%.
    #[arg(long, value_name = "SHAPE", value_parser = Shape::parse)]
    clip: Vec<Shape>,
    /// Remove what is inside this shape. The shapes are those of --clip.
    #[arg(long, value_name = "SHAPE", value_parser = Shape::parse)]
    cut_out: Vec<Shape>,
}

/// A shape and its text as given.
#[derive(Debug, Clone, PartialEq)]
struct Shape {
    text: String,
    form: Form,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    Plane { normal: DVec3, offset: f64 },
    Side { axis: usize, below: bool, at: Place },
    Box([[Place; 3]; 2]),
}

/// A coordinate in world units, or as a share of the scene's box.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    World(f64),
    Share(f64),
}

impl ClipFlags {
    /// Checks what does not depend on the scene.
    pub fn check(&self) -> Result<(), Failure> {
        let (count, most) = (self.clip.len() + self.cut_out.len(), Settings::MAX_CLIPS);
        if count > most {
            return Err(Failure::Usage(format!(
                "--clip and --cut-out give {count} shapes; at most {most} are allowed"
            )));
        }
        Ok(())
    }

    /// Returns the clips of a scene whose samples and vertices lie in `bounds`. A clip that leaves
    /// nothing of the scene is an error.
    pub fn clips(&self, scene: &Scene, bounds: &Bounds) -> Result<Vec<Clip>, Error> {
        // Footprints reach beyond the samples, so something may be left out there.
        let whole = scene.bounds();
        let mut clips = Vec::new();
        for (flag, inside, shape) in self.shapes() {
            let clip = Clip { shape: shape.form.in_world(bounds), inside };
            if leaves_nothing(&clip, &whole) {
                let Bounds { min, max } = bounds;
                return Err(Error::NothingToDraw(format!(
                    "{flag} '{}' leaves nothing of the scene, which lies between {min} and {max}",
                    shape.text
                )));
            }
            clips.push(clip);
        }
        Ok(clips)
    }

    /// Returns the flags as given, for messages; `None` if there are none.
    pub fn text(&self) -> Option<String> {
        let texts: Vec<_> =
            self.shapes().map(|(flag, _, shape)| format!("{flag} '{}'", shape.text)).collect();
        (!texts.is_empty()).then(|| texts.join(" "))
    }

    fn shapes(&self) -> impl Iterator<Item = (&'static str, bool, &Shape)> {
        let kept = self.clip.iter().map(|shape| ("--clip", true, shape));
        kept.chain(self.cut_out.iter().map(|shape| ("--cut-out", false, shape)))
    }
}

impl Shape {
    fn parse(text: &str) -> Result<Self, String> {
        let form = match text.split_once(':') {
            Some(("plane", numbers)) => plane(numbers)?,
            Some(("box", corners)) => cuboid(corners)?,
            _ => side(text)?,
        };
        Ok(Self { text: text.to_owned(), form })
    }
}

/// `NX,NY,NZ,OFFSET`.
fn plane(text: &str) -> Result<Form, String> {
    let [x, y, z, offset] =
        parse::numbers(text, ',', "plane:NX,NY,NZ,OFFSET, such as plane:1,0,0,12.5")?;
    let normal = DVec3::new(x, y, z);
    if !(normal.is_finite() && f64::is_finite(offset)) {
        return Err("the numbers must be finite".into());
    }
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
    Ok(Form::Plane { normal, offset })
}

/// `X0,Y0,Z0:X1,Y1,Z1`.
fn cuboid(text: &str) -> Result<Form, String> {
    let form = "the form is box:X0,Y0,Z0:X1,Y1,Z1, such as box:0,0,0:50%,100%,100%";
    let corner = |text: &str| -> Result<[Place; 3], String> {
        let places: Vec<_> = text.split(',').map(Place::parse).collect::<Result<_, _>>()?;
        places.try_into().map_err(|_| form.to_owned())
    };
    let (low, high) = text.split_once(':').ok_or(form)?;
    let corners @ [low, high] = [corner(low)?, corner(high)?];
    for (low, high) in low.iter().zip(high) {
        match (*low, high) {
            (Place::World(low), Place::World(high)) | (Place::Share(low), Place::Share(high))
                if low >= high =>
            {
                return Err(
                    "the first corner of a box must lie below the second on every axis".into()
                );
            }
            _ => {}
        }
    }
    Ok(Form::Box(corners))
}

/// `x<AT` or `x>AT`.
fn side(text: &str) -> Result<Form, String> {
    let form = "the forms are plane:NX,NY,NZ,OFFSET, box:X0,Y0,Z0:X1,Y1,Z1 and 'x<AT' or 'x>AT'";
    let at = text.find(['<', '>']).ok_or(form)?;
    let axis = match text[..at].trim() {
        "x" | "X" => 0,
        "y" | "Y" => 1,
        "z" | "Z" => 2,
        _ => return Err(form.into()),
    };
    Ok(Form::Side { axis, below: text[at..].starts_with('<'), at: Place::parse(&text[at + 1..])? })
}

impl Place {
    /// `12.5` or `50%`.
    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        match text.strip_suffix('%') {
            Some(share) => parse::finite(share).map(|share| Self::Share(share / 100.0)),
            None => parse::finite(text).map(Self::World),
        }
        .map_err(|_| format!("“{text}” is not a coordinate, such as 12.5 or 50%"))
    }

    fn in_world(self, axis: usize, bounds: &Bounds) -> f64 {
        match self {
            Self::World(at) => at,
            Self::Share(share) => bounds.min[axis] + share * (bounds.max[axis] - bounds.min[axis]),
        }
    }
}

impl Form {
    fn in_world(self, bounds: &Bounds) -> ClipShape {
        match self {
            Self::Plane { normal, offset } => ClipShape::HalfSpace { normal, offset },
            Self::Side { axis, below, at } => {
                let sign = if below { 1.0 } else { -1.0 };
                let mut normal = DVec3::ZERO;
                normal[axis] = sign;
                ClipShape::HalfSpace { normal, offset: sign * at.in_world(axis, bounds) }
            }
            Self::Box(corners) => {
                let [min, max] = corners.map(|places| {
                    DVec3::from_array([0, 1, 2].map(|axis| places[axis].in_world(axis, bounds)))
                });
                ClipShape::Box(Bounds { min, max })
            }
        }
    }
}

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
        Shape::parse(text).unwrap().form.in_world(&SCENE)
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
    }

    #[test]
    fn wrong_shapes_are_told() {
        let message = |text: &str| Shape::parse(text).unwrap_err();
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
