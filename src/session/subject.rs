//! A scene as its camera needs it: where it is, how it stands, and what of it is seen.

use crate::{
    about::{Frame, Frames, Orientation, direction_name},
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    math::Bounds,
    surface::Mesh,
};
use glam::DVec3;

/// Where a scene's orientation comes from, from the least certain on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// The default for shapes that rest no better one way than the other.
    Default,
    /// Guessed from the shape.
    Guess,
    /// The convention for volumes, samples and trained Gaussians.
    Convention,
    /// The file, or the convention of its format.
    File,
    /// The user.
    Flag,
}

impl Origin {
    /// Returns the name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Guess => "guess",
            Self::Convention => "convention",
            Self::File => "file",
            Self::Flag => "flag",
        }
    }
}

/// The scene as the camera needs it. Inputs are added in their order: the first statement of a file
/// decides how the scene stands, then the convention, then the first guess. Functions that take an
/// input's name return a warning that names it, if the input contradicts those before.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The box around samples and vertices, in world units; footprints reach further.
    pub bounds: Bounds,
    /// How the scene stands unless the user says how.
    pub orientation: Orientation,
    /// Where the orientation comes from.
    pub origin: Origin,
    /// Points that span what is seen; if there are none, the box is seen.
    pub seen: Vec<DVec3>,
    frames: Frames,
    faces: Faces,
}

/// Whether everything is flat.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Faces {
    /// There is nothing yet.
    #[default]
    Nothing,
    /// Slices in one plane, which is looked at like this.
    Flat(Orientation),
    Solid,
}

impl Default for Subject {
    fn default() -> Self {
        Self::new(Bounds::EMPTY, DVec3::Y)
    }
}

impl Subject {
    /// A subject whose box is seen, and which stands with this direction up.
    pub fn new(bounds: Bounds, up: DVec3) -> Self {
        let (orientation, seen) = (Orientation::with_up(up), Vec::new());
        let (frames, faces) = Default::default();
        Self { bounds, orientation, origin: Origin::Default, seen, frames, faces }
    }

    /// Adds the box of an input. `facing` says how it is looked at if it is flat.
    pub fn count_in(&mut self, bounds: Bounds, facing: Option<Orientation>) {
        self.bounds = self.bounds.union(bounds);
        self.faces = match (self.faces, facing) {
            (Faces::Nothing, Some(facing)) => Faces::Flat(facing),
            (Faces::Flat(before), Some(facing)) if before.front.dot(facing.front) > 0.999 => {
                Faces::Flat(before)
            }
            _ => Faces::Solid,
        };
    }

    /// Returns how the scene is looked at if it is flat: a slice, or a picture.
    pub fn facing(&self) -> Option<Orientation> {
        match self.faces {
            Faces::Flat(facing) => Some(facing),
            Faces::Nothing | Faces::Solid => None,
        }
    }

    /// Whether the box is no larger than the rounding error of its coordinates.
    pub fn is_one_place(&self) -> bool {
        self.bounds.diagonal() <= 1e-13 * self.bounds.center().abs().max_element()
    }

    /// Adds the frame of an input.
    pub fn frame(&mut self, name: &str, frame: Frame) -> Option<String> {
        self.frames.add(name, frame)
    }

    /// Whether an input is in the frame of a patient.
    pub fn is_patient(&self) -> bool {
        self.frames.have_patient()
    }

    /// Takes the orientation of an input that is not turned.
    pub fn stand(
        &mut self,
        name: &str,
        orientation: Orientation,
        origin: Origin,
    ) -> Option<String> {
        self.consider(orientation, origin).then(|| {
            let [up, scene] = [orientation.up, self.orientation.up].map(direction_name);
            format!(
                "{name} says that {up} is up, but the scene stands with {scene} up, as an input \
                 before says; --up sets another"
            )
        })
    }

    /// Takes what a file says of its orientation, or the convention for its kind.
    pub fn orient_as_stated(
        &mut self,
        name: &str,
        stated: Option<Orientation>,
        usual: Orientation,
    ) -> Option<String> {
        match stated {
            Some(orientation) => self.stand(name, orientation, Origin::File),
            None => self.stand(name, usual, Origin::Convention),
        }
    }

    /// Takes the orientation of a mesh, or guesses it. A mesh that stands otherwise than an input
    /// before is turned.
    pub fn stand_mesh(&mut self, name: &str, mesh: &mut Mesh) -> Option<String> {
        match mesh.about.orientation {
            Some(orientation) => self.turn(name, orientation, |wanted| mesh.stand(wanted)),
            // A guess would not count.
            None if self.origin >= Origin::Guess => None,
            None => {
                mesh.guess_orientation().and_then(|guess| self.stand(name, guess, Origin::Guess))
            }
        }
    }

    /// Takes the orientation of trained Gaussians, or the convention of trainers. Gaussians that
    /// stand otherwise than an input before are turned.
    pub fn stand_gaussians(&mut self, name: &str, set: &mut Gaussians) -> Option<String> {
        match set.about.orientation {
            Some(orientation) => self.turn(name, orientation, |wanted| set.stand(wanted)),
            None => self.stand(name, Orientation::Y_DOWN, Origin::Convention),
        }
    }

    /// Takes the orientation and the frame of a hierarchy.
    pub fn stand_hierarchy(&mut self, name: &str, hierarchy: &Hierarchy) -> Vec<String> {
        let header = hierarchy.header();
        let origin = if header.is_guessed { Origin::Guess } else { Origin::File };
        let orientation =
            header.orientation.and_then(|orientation| self.stand(name, orientation, origin));
        // No other frame has this orientation.
        let is_patient = header.orientation == Some(Orientation::RAS);
        let frame = self.frame(name, if is_patient { Frame::Patient } else { Frame::Own });
        orientation.into_iter().chain(frame).collect()
    }

    /// Takes an orientation that a file states. If the scene stands otherwise, `turn` turns the
    /// input.
    fn turn(
        &mut self,
        name: &str,
        orientation: Orientation,
        turn: impl FnOnce(Orientation),
    ) -> Option<String> {
        self.consider(orientation, Origin::File).then(|| {
            turn(self.orientation);
            let [up, scene] = [orientation.up, self.orientation.up].map(direction_name);
            format!(
                "{name} is turned: it stands with {up} up, and the input before with {scene} up"
            )
        })
    }

    /// Takes an orientation if it comes from a more certain origin than the one before. Returns
    /// whether it contradicts that one, although both come from files.
    fn consider(&mut self, orientation: Orientation, origin: Origin) -> bool {
        if origin > self.origin {
            (self.orientation, self.origin) = (orientation, origin);
        }
        origin == Origin::File && self.orientation.up.dot(orientation.up) < 0.999
    }
}
