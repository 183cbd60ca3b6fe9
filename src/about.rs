//! What a file says about its values and about the thing they were measured from.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// What a file says about a volume or samples beyond their values. It changes only defaults: the
/// first transfer function, the first camera, and the texts around a picture.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct About {
    /// How the subject stands in the world; `None` if the file does not say.
    pub orientation: Option<Orientation>,
    /// What the axes of the world mean.
    pub frame: Frame,
    /// What measured the values.
    pub modality: Option<Modality>,
    /// The lowest and the highest value that the file suggests to show, from its window.
    pub window: Option<[f64; 2]>,
    /// The name of the values (“Temperature”); empty if there is none.
    pub name: String,
    /// The unit of the values (“HU”, “Pa”); empty if the file does not say.
    pub unit: String,
    /// The unit of world lengths (“mm”); empty if the file does not say.
    pub length: String,
    /// The number of samples without a value, which were read as the lowest value.
    pub holes: u64,
    /// The labels, if the values are labels: names of things, not quantities.
    pub labels: Option<Labels>,
    /// The channels of the file, if it has several of the same place, as files of microscopes do;
    /// or its only one, if that has a colour.
    pub channels: Vec<Channel>,
    /// The number of the channel that the values are of, from 0.
    pub channel: usize,
    /// The names of the values that may colour a mesh or a point cloud, as its reader takes them
    /// ([`ReadOptions::scalar`](crate::formats::ReadOptions::scalar)).
    pub attributes: Vec<String>,
    /// The coordinate reference system of the positions, as in “EPSG:25832”; empty if the file does
    /// not say.
    pub crs: String,
    /// How the file stores its points, as in “LAS 1.4, point format 6”; empty if its format has
    /// only one way.
    pub layout: String,
}

/// One channel of a file: what one dye, or one colour of light, shows of the same place.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Channel {
    /// Its name (“DAPI”); empty if the file gives none.
    pub name: String,
    /// Red, green, blue in 0 … 1 in which the file shows its highest values; `None` if it does not
    /// say.
    pub color: Option<[f64; 3]>,
    /// The lowest and the highest value that the file suggests to show.
    pub window: Option<[f64; 2]>,
}

impl Channel {
    /// Most channels in one picture.
    pub const MOST: usize = 8;

    /// Returns whether the channels of a file are shown in their colours: if there are several, or
    /// if the file gives its only one a colour. Programs write white if nobody chose one.
    pub(crate) fn have_colors(channels: &[Self]) -> bool {
        match channels {
            [one] => one.color.is_some_and(|color| color != [1.0; 3]),
            more => !more.is_empty(),
        }
    }

    /// Returns the name of the channel of this number among all, or “channel 2”.
    pub fn name_of(all: &[Self], number: usize) -> String {
        match all.get(number).map(|channel| channel.name.as_str()) {
            None | Some("") => format!("channel {number}"),
            Some(name) => name.to_owned(),
        }
    }
}

/// The labels of a label map: whole numbers that name things, such as organs or grains. They are
/// not quantities, so nothing lies between two of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels {
    /// The labels that occur among the samples, ascending.
    pub present: Vec<i32>,
    /// What the file, or a table beside it, says about labels; also about some that do not occur.
    pub table: Vec<Label>,
    /// The label of what surrounds the things, which is not drawn.
    pub background: Option<i32>,
}

/// What is known about a label.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Label {
    /// The value of its samples.
    pub value: i32,
    /// Its name; empty if there is none.
    pub name: String,
    /// Red, green, blue in 0 … 1; `None` if no colour is given.
    pub color: Option<[f64; 3]>,
    /// Its opacity, 0 … 1; `None` if none is given. 0 hides the label.
    pub opacity: Option<f64>,
}

impl Labels {
    /// Returns what is known about a label.
    pub fn get(&self, value: i32) -> Option<&Label> {
        self.table.iter().find(|label| label.value == value)
    }

    /// Returns the labels that are drawn, each with its name if it has one (“3 left ear”).
    pub fn listed(&self) -> Vec<String> {
        let text = |&value: &i32| match self.name(value) {
            name if name == value.to_string() => name,
            name => format!("{value} {name}"),
        };
        self.present.iter().filter(|value| self.background != Some(**value)).map(text).collect()
    }

    /// Returns the name of a label, or its number.
    pub fn name(&self, value: i32) -> String {
        match self.get(value) {
            Some(label) if !label.name.is_empty() => label.name.clone(),
            _ => value.to_string(),
        }
    }
}

/// What the axes of an input's coordinates mean.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Frame {
    /// The file's own axes, of which it says no more.
    #[default]
    Own,
    /// A patient's: x to the right, y to the front (anterior), z to the head (superior), called
    /// RAS. Readers turn the other frames of medical files into this one.
    Patient,
}

/// The frames of the inputs of a scene, to find out whether they belong together.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Frames {
    /// The first input in the frame of a patient, and the first other one.
    first: [Option<String>; 2],
}

impl Frames {
    /// Adds an input. Returns a warning if inputs in the frame of a patient and others have met:
    /// the coordinates of the others may mean other places.
    pub fn add(&mut self, name: &str, frame: Frame) -> Option<String> {
        let (had_patient, had_other) = (self.first[0].is_some(), self.first[1].is_some());
        let slot = usize::from(frame != Frame::Patient);
        self.first[slot].get_or_insert_with(|| name.to_owned());
        let [Some(patient), Some(other)] = &self.first else { return None };
        (!(had_patient && had_other)).then(|| {
            format!(
                "{other} does not say how its axes lie in the patient, as {patient} does: it is \
                 drawn by its own coordinates, and may lie elsewhere"
            )
        })
    }

    /// Returns whether an input is in the frame of a patient.
    pub fn have_patient(&self) -> bool {
        self.first[0].is_some()
    }
}

/// How a subject stands in the world. Both directions have unit length and are perpendicular.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Orientation {
    /// The direction that is up.
    pub up: DVec3,
    /// The direction that the subject faces. The first camera looks against it.
    pub front: DVec3,
}

/// What measured a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Modality {
    /// Computed tomography in Hounsfield units: air −1000, water 0.
    Ct,
    /// Magnetic resonance, in arbitrary units.
    Mr,
    /// Emission tomography: PET and SPECT.
    Emission,
    /// Ultrasound.
    Ultrasound,
    /// Light or electron microscopy.
    Microscopy,
}

impl Modality {
    /// All modalities.
    pub const ALL: [Self; 5] =
        [Self::Ct, Self::Mr, Self::Emission, Self::Ultrasound, Self::Microscopy];

    /// Returns its name: ct, mr, emission, ultrasound or microscopy.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ct => "ct",
            Self::Mr => "mr",
            Self::Emission => "emission",
            Self::Ultrasound => "ultrasound",
            Self::Microscopy => "microscopy",
        }
    }

    /// Returns the modality of a name, or of the codes of DICOM and the suffixes of BIDS.
    pub fn named(name: &str) -> Option<Self> {
        let name = name.trim().to_ascii_lowercase();
        let is_of = |names: &[&str]| names.contains(&name.as_str());
        if is_of(&["mr", "t1w", "t2w", "flair", "pdw", "t2starw", "bold", "dwi", "sbref", "swi"]) {
            return Some(Self::Mr);
        }
        if is_of(&["pt", "pet", "nm", "spect"]) {
            return Some(Self::Emission);
        }
        if is_of(&["us", "ivus"]) {
            return Some(Self::Ultrasound);
        }
        Self::ALL.into_iter().find(|modality| modality.name() == name)
    }
}

impl Orientation {
    /// The frame of a patient (RAS): x to the right, y to the front, z to the head.
    pub const RAS: Self = Self { up: DVec3::Z, front: DVec3::Y };

    /// The frame of surveyors, and of most tools for construction: z up, seen along +y.
    pub const SURVEY: Self = Self { up: DVec3::Z, front: DVec3::NEG_Y };

    /// The frame of glTF and of most tools for animation: y up, z to the front.
    pub const Y_UP: Self = Self { up: DVec3::Y, front: DVec3::Z };

    /// The frame of a camera, which trainers of Gaussian scenes keep: y down, seen along +z.
    pub const Y_DOWN: Self = Self { up: DVec3::NEG_Y, front: DVec3::NEG_Z };

    /// Returns the rotation that turns a subject of this orientation to another one.
    pub(crate) fn turn_to(self, wanted: Self) -> DMat3 {
        let axes = |orientation: Self| {
            DMat3::from_cols(
                orientation.up.cross(orientation.front),
                orientation.up,
                orientation.front,
            )
        };
        axes(wanted) * axes(self).transpose()
    }

    /// Returns the orientation with this direction up, and the front that is usual for it: −Y if Z
    /// or −Z is nearest to the direction, otherwise +Z; made perpendicular to it.
    ///
    /// # Panics
    /// If the direction has no length, or is not finite.
    pub fn with_up(up: DVec3) -> Self {
        let up = up.try_normalize().expect("a direction");
        let is_z = up.z.abs() > up.x.abs().max(up.y.abs());
        let usual = if is_z { DVec3::NEG_Y } else { DVec3::Z };
        Self { up, front: (usual - up * up.dot(usual)).normalize() + DVec3::ZERO }
    }
}

/// Returns the name of a direction: of an axis if it is one (`+X`, `-Z`), else its coordinates.
pub fn direction_name(direction: DVec3) -> String {
    for (axis, name) in DVec3::AXES.into_iter().zip(["X", "Y", "Z"]) {
        for (sign, prefix) in [(1.0, '+'), (-1.0, '-')] {
            if direction == sign * axis {
                return format!("{prefix}{name}");
            }
        }
    }
    let [x, y, z] = direction.to_array();
    format!("{x:.3},{y:.3},{z:.3}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patient_and_something_else_are_reported_once() {
        let mut frames = Frames::default();
        assert_eq!(frames.add("ct.nii", Frame::Patient), None);
        assert_eq!(frames.add("mask.dcm", Frame::Patient), None);
        let warning = frames.add("mesh.stl", Frame::Own).unwrap();
        assert!(warning.contains("mesh.stl") && warning.contains("ct.nii"), "{warning}");
        assert_eq!(frames.add("more.stl", Frame::Own), None);
        assert!(frames.have_patient());
    }

    #[test]
    fn turns_lead_from_one_stance_to_another() {
        let turn = Orientation::Y_UP.turn_to(Orientation::SURVEY);
        assert_eq!(turn * DVec3::Y, DVec3::Z);
        assert_eq!(turn * DVec3::Z, DVec3::NEG_Y);
        assert_eq!(turn * DVec3::X, DVec3::X);
    }

    #[test]
    fn every_direction_has_a_front() {
        assert_eq!(Orientation::with_up(2.0 * DVec3::Z), Orientation::SURVEY);
        assert_eq!(Orientation::with_up(DVec3::Y), Orientation::Y_UP);
        assert_eq!(Orientation::with_up(DVec3::X).front, DVec3::Z);
        assert_eq!(Orientation::with_up(DVec3::NEG_Z).front, DVec3::NEG_Y);
        for up in [DVec3::ONE, DVec3::new(-0.2, 0.9, 0.8), DVec3::new(0.1, 0.7, 0.7)] {
            let orientation = Orientation::with_up(up);
            assert!(orientation.front.dot(orientation.up).abs() < 1e-12, "{orientation:?}");
            assert!((orientation.front.length() - 1.0).abs() < 1e-12, "{orientation:?}");
        }
    }
}
