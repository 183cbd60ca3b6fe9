//! The frames of medical files, turned into one: x to the patient's right, y to the front and z to
//! the head (RAS, as NIfTI has it).

use crate::{
    about::{About, Frame, Orientation},
    input::copy,
    surface::Mesh,
    volume::{Lattice, Volume},
};
use glam::{DMat3, DVec3};

/// The directions of a file's axes in a patient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anatomy {
    /// Turns a file's coordinates into the patient's frame.
    turn: DMat3,
}

impl Anatomy {
    /// x to the right, y to the front, z to the head: NIfTI.
    pub const RAS: Self = Self { turn: DMat3::IDENTITY };
    /// x to the left, y to the back, z to the head: DICOM and ITK.
    pub const LPS: Self =
        Self { turn: DMat3 { x_axis: DVec3::NEG_X, y_axis: DVec3::NEG_Y, z_axis: DVec3::Z } };

    /// Returns the axes that lead towards three sides, one of left and right, one of front
    /// (anterior) and back (posterior), one of head (superior) and feet (inferior), in any order:
    /// `LPS`, or `left-posterior-superior`. `None` for other texts.
    pub fn towards(text: &str) -> Option<Self> {
        let words: Vec<&str> = match text.contains('-') {
            true => text.split('-').filter(|word| !word.eq_ignore_ascii_case("time")).collect(),
            false => text.split_inclusive(|_: char| true).collect(),
        };
        let directions = words.iter().map(|word| {
            let is = |name: &str| {
                word.eq_ignore_ascii_case(name) || word.eq_ignore_ascii_case(&name[..1])
            };
            Some(match () {
                () if is("right") => DVec3::X,
                () if is("left") => DVec3::NEG_X,
                () if is("anterior") => DVec3::Y,
                () if is("posterior") => DVec3::NEG_Y,
                () if is("superior") => DVec3::Z,
                () if is("inferior") => DVec3::NEG_Z,
                () => return None,
            })
        });
        let [x, y, z] = <[DVec3; 3]>::try_from(directions.collect::<Option<Vec<_>>>()?).ok()?;
        let turn = DMat3::from_cols(x, y, z);
        (turn.determinant().abs() > 0.5).then_some(Self { turn })
    }

    /// Returns the axes that come from the three sides that [`towards`](Self::towards) reads.
    pub fn from_sides(text: &str) -> Option<Self> {
        Self::towards(text).map(|axes| Self { turn: -axes.turn })
    }

    /// Turns a lattice into the patient's frame.
    pub fn turned(&self, lattice: &Lattice) -> Lattice {
        lattice.turned(self.turn)
    }

    /// Turns a volume into the patient's frame.
    pub fn place(&self, volume: &mut Volume) {
        volume.lattice = self.turned(&volume.lattice);
        self.describe(&mut volume.about);
    }

    /// Turns a mesh or point cloud into the patient's frame.
    pub fn place_mesh(&self, mesh: &mut Mesh) {
        mesh.turn(self.turn);
        self.describe(&mut mesh.about);
    }

    /// Turns the orientation that a reader has found, or sets that of a patient.
    fn describe(&self, about: &mut About) {
        about.frame = Frame::Patient;
        about.orientation = Some(about.orientation.map_or(Orientation::RAS, |orientation| {
            Orientation { up: self.turn * orientation.up, front: self.turn * orientation.front }
        }));
    }
}

/// Returns a lattice in the patient's frame if it is known, and the frame.
pub fn placed(anatomy: Option<Anatomy>, lattice: Lattice) -> (Lattice, Frame) {
    match anatomy {
        Some(anatomy) => (anatomy.turned(&lattice), Frame::Patient),
        None => (lattice, Frame::Own),
    }
}

/// Bytes of a file in which a statement may stand.
const HEAD: usize = 512;

/// Returns the axes that the first lines of a file state in a comment, as 3D Slicer writes it into
/// STL, PLY, OBJ and VTK: `SPACE=LPS` or `SPACE=RAS`.
pub fn stated(bytes: &[u8]) -> Option<Anatomy> {
    const WORD: &[u8] = b"SPACE=";
    let head = &bytes[..bytes.len().min(HEAD)];
    let at = head.windows(WORD.len()).position(|word| word == WORD)? + WORD.len();
    Anatomy::towards(&copy::lossy(head.get(at..at + 3)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn axes_lead_towards_the_sides_of_their_names() {
        let of = |text: &str| Anatomy::towards(text).map(|axes| axes.turn * DVec3::ONE);
        assert_eq!(of("RAS"), Some(DVec3::ONE));
        assert_eq!(of("left-posterior-superior"), Some(DVec3::new(-1.0, -1.0, 1.0)));
        assert_eq!(of("Right-Anterior-Superior-Time"), Some(DVec3::ONE));
        assert_eq!(Anatomy::towards("lps"), Some(Anatomy::LPS));
        assert_eq!(Anatomy::from_sides("RAI"), Some(Anatomy::LPS));
        // The first axis of this frame leads to the head.
        let turned = Anatomy::towards("SAL").unwrap();
        assert_eq!(turned.turn * DVec3::X, DVec3::Z);
        assert_eq!(turned.turn * DVec3::Z, DVec3::NEG_X);
        for text in ["", "RA", "RLS", "RASI", "scanner-xyz", "3D-right-handed", "???"] {
            assert_eq!(Anatomy::towards(text), None, "{text}");
        }
        assert_eq!(stated(b"3D Slicer output. SPACE=LPS\nBINARY"), Some(Anatomy::LPS));
        assert_eq!(stated(b"SPACE=R"), None);
    }

    #[test]
    fn mirrored_meshes_keep_their_outsides() {
        let mut mesh = Mesh::sphere(0);
        let before = mesh.clone();
        Anatomy::towards("LAS").unwrap().place_mesh(&mut mesh);
        let normal = |mesh: &Mesh| {
            let [a, b, c] = mesh.triangles[0].map(|at| mesh.positions[at as usize]);
            (b - a).cross(c - a).dot(a + b + c)
        };
        assert!(normal(&before) > 0.0 && normal(&mesh) > 0.0);
        assert_eq!(mesh.positions[0], before.positions[0] * Vec3::new(-1.0, 1.0, 1.0));
        assert_eq!(mesh.about.frame, Frame::Patient);
    }
}
