//! The plane of a slice: its name, the sides that its edges lead to, and how it lies on the screen.

use splatkit::{
    about::Frame,
    glam::{DVec2, DVec3, Vec2Swizzles, dvec2},
    interaction::Slice,
    volume::{Lattice, Volume},
};

/// The names of planes across the axes of a patient, and across other axes.
const OF_PATIENT: [&str; 3] = ["Sagittal", "Coronal", "Axial"];
const OTHERS: [&str; 3] = ["x", "y", "z"];
/// What axes lead to: towards positive and towards negative coordinates.
const PATIENT_SIDES: [[&str; 2]; 3] = [["R", "L"], ["A", "P"], ["S", "I"]];
const OTHER_SIDES: [[&str; 2]; 3] = [["x+", "x-"], ["y+", "y-"], ["z+", "z-"]];

/// The order in which the six ways to give three axes to three others are tried.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]];

/// The plane across an axis of a lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The axis of the lattice that it lies across.
    pub axis: usize,
    /// `Axial`, `Coronal` or `Sagittal` in the frame of a patient, else `x`, `y` or `z`.
    pub name: &'static str,
    /// The axis of the world that is nearest to the direction across.
    world: usize,
    is_patient: bool,
}

impl Plane {
    /// Returns the planes of a volume, in the order in which they are shown.
    pub fn of(volume: &Volume) -> [Self; 3] {
        let is_patient = volume.about.frame == Frame::Patient;
        let worlds = nearest_axes(&volume.lattice);
        let names = if is_patient { OF_PATIENT } else { OTHERS };
        let plane = |axis: usize| {
            let world = worlds[axis];
            Self { axis, name: names[world], world, is_patient }
        };
        let mut planes = [0, 1, 2].map(plane);
        // Axial, coronal, sagittal: as viewers of scans show them.
        planes.sort_by_key(|plane| if is_patient { 2 - plane.world } else { plane.world });
        planes
    }

    /// Returns how a slice of this plane lies on the screen. Those of a patient lie as radiologists
    /// look at them: the patient's right side at the left, the front or the head above, and the
    /// front of sagittal slices at the left. Others lie as they are stored.
    pub fn turn(&self, slice: &Slice) -> Turn {
        if !self.is_patient {
            return Turn::default();
        }
        let [right, down] = match self.world {
            0 => [DVec3::NEG_Y, DVec3::NEG_Z],
            1 => [DVec3::NEG_X, DVec3::NEG_Z],
            _ => [DVec3::NEG_X, DVec3::NEG_Y],
        };
        let along = slice.steps.map(|step| step.normalize_or_zero().dot(right));
        let swaps = along[0].abs() < along[1].abs();
        let [first, second] = slice.steps;
        let [across, below] = if swaps { [second, first] } else { [first, second] };
        Turn { swaps, flips: [across.dot(right) < 0.0, below.dot(down) < 0.0] }
    }

    /// Returns what the edges of a slice lead to: left, right, above and below.
    pub fn sides(&self, slice: &Slice, turn: Turn) -> [&'static str; 4] {
        let at = |x: f64, y: f64| slice.position(turn.pixel(dvec2(x, y), slice.size));
        let sides = |way: DVec3| self.side_of(way);
        let [right, left] = sides(at(1.0, 0.5) - at(0.0, 0.5));
        let [below, above] = sides(at(0.5, 1.0) - at(0.5, 0.0));
        [left, right, above, below]
    }

    /// Returns the side that a direction leads to, and the opposite one.
    fn side_of(&self, way: DVec3) -> [&'static str; 2] {
        let larger = |most: usize, axis: usize| {
            if way[axis].abs() > way[most].abs() { axis } else { most }
        };
        let axis = (0..3).fold(0, larger);
        let sides = if self.is_patient { PATIENT_SIDES } else { OTHER_SIDES };
        let [towards, from] = sides[axis];
        if way[axis] < 0.0 { [from, towards] } else { [towards, from] }
    }
}

/// Returns the axis of the world that is nearest to each axis of a lattice, each one once.
fn nearest_axes(lattice: &Lattice) -> [usize; 3] {
    let axes = [0, 1, 2].map(|axis| lattice.axes.col(axis).normalize_or_zero());
    let fit =
        |order: &[usize; 3]| -> f64 { (0..3).map(|axis| axes[axis][order[axis]].abs()).sum() };
    let better = |best: [usize; 3], order: [usize; 3]| {
        if fit(&order) > fit(&best) + 1e-9 { order } else { best }
    };
    ORDERS.into_iter().fold(ORDERS[0], better)
}

/// How a slice lies on the screen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Turn {
    /// Whether its rows run down the screen.
    pub swaps: bool,
    /// Whether it is mirrored from left to right, and from top to bottom.
    flips: [bool; 2],
}

impl Turn {
    /// Returns the pixel of a slice at a place on the screen, as shares of its area from the upper
    /// left corner.
    pub fn pixel(self, place: DVec2, size: [usize; 2]) -> DVec2 {
        self.stored(place) * dvec2(size[0] as f64, size[1] as f64)
    }

    /// Returns the place of a pixel on the screen. The inverse of [`pixel`](Self::pixel).
    pub fn place(self, pixel: DVec2, size: [usize; 2]) -> DVec2 {
        let share = pixel / dvec2(size[0] as f64, size[1] as f64);
        self.flipped(if self.swaps { share.yx() } else { share })
    }

    /// Returns the shares of a slice's sides at a place on the screen.
    pub fn stored(self, place: DVec2) -> DVec2 {
        let share = self.flipped(place);
        if self.swaps { share.yx() } else { share }
    }

    fn flipped(self, share: DVec2) -> DVec2 {
        let flip = |share: f64, flips: bool| if flips { 1.0 - share } else { share };
        dvec2(flip(share.x, self.flips[0]), flip(share.y, self.flips[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatkit::{glam::DMat3, interaction::Shading, math::Kernel, volume::Samples};

    /// A volume whose axes lead into these directions, in a frame.
    fn volume(axes: [DVec3; 3], frame: Frame) -> Volume {
        let mut lattice = Lattice::with_spacing([4, 5, 6], DVec3::ONE);
        lattice.axes = DMat3::from_cols(axes[0], axes[1], axes[2]);
        let samples = Samples::U8((0..120).collect());
        let mut volume = Volume::new(lattice, samples).expect("a volume");
        volume.about.frame = frame;
        volume
    }

    fn sides(volume: &Volume) -> Vec<(&'static str, [&'static str; 4])> {
        let kernel = Kernel::default();
        let of = |plane: Plane| {
            let shading = Shading::Window([0.0, 255.0]);
            let slice = Slice::of_volume(volume, &kernel, plane.axis, 1, shading).expect("a slice");
            (plane.name, plane.sides(&slice, plane.turn(&slice)))
        };
        Plane::of(volume).into_iter().map(of).collect()
    }

    /// Whatever the order and the directions of the axes in the file are, slices of a patient lie
    /// in the same way.
    #[test]
    fn slices_of_a_patient_lie_as_radiologists_look_at_them() {
        let [x, y, z] = DVec3::AXES;
        for axes in [[x, y, z], [-x, -y, z], [y, -z, x], [-z, x, -y], [x, y + 0.3 * z, z - 0.3 * y]]
        {
            let expected = [
                ("Axial", ["R", "L", "A", "P"]),
                ("Coronal", ["R", "L", "S", "I"]),
                ("Sagittal", ["A", "P", "S", "I"]),
            ];
            assert_eq!(sides(&volume(axes, Frame::Patient)), expected, "{axes:?}");
        }
    }

    #[test]
    fn other_slices_are_named_by_their_axes() {
        let [x, y, z] = DVec3::AXES;
        let expected = [
            ("x", ["y-", "y+", "z+", "z-"]),
            ("y", ["x-", "x+", "z+", "z-"]),
            ("z", ["x-", "x+", "y-", "y+"]),
        ];
        assert_eq!(sides(&volume([x, y, z], Frame::Own)), expected);
        let names: Vec<_> = sides(&volume([z, x, y], Frame::Own)).iter().map(|s| s.0).collect();
        assert_eq!(names, ["x", "y", "z"]);
    }

    #[test]
    fn places_and_pixels_are_inverse() {
        for swaps in [false, true] {
            for flips in [[false, true], [true, false], [true, true]] {
                let turn = Turn { swaps, flips };
                let place = dvec2(0.25, 0.875);
                let again = turn.place(turn.pixel(place, [8, 4]), [8, 4]);
                assert!(place.distance(again) < 1e-12, "{turn:?}: {again}");
            }
        }
    }
}
