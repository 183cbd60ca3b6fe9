//! What a file says about its values and about the thing they were measured from.

use glam::DVec3;

/// What a file says about a volume or samples beyond their values. It changes only defaults: the
/// first transfer function, the first camera, and the texts around a picture.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct About {
    /// How the subject stands in the world; `None` if the file does not say.
    pub stance: Option<Stance>,
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
}

/// How a subject stands in the world. Both directions have unit length and are perpendicular.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// The direction that is up.
    pub up: DVec3,
    /// The direction that the subject faces. The first camera looks against it.
    pub front: DVec3,
}

/// What measured a volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

impl Stance {
    /// The frame of DICOM (LPS): x to the patient's left, y to the back, z to the head.
    pub const LPS: Self = Self { up: DVec3::Z, front: DVec3::NEG_Y };

    /// The frame of NIfTI (RAS): x to the patient's right, y to the front, z to the head.
    pub const RAS: Self = Self { up: DVec3::Z, front: DVec3::Y };
}
