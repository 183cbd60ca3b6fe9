//! What a file says about its values and about the thing they were measured from.

use glam::DVec3;
use serde::{Deserialize, Serialize};

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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

    /// The frame of surveyors, and of most tools for construction: z up, seen along +y.
    pub const SURVEY: Self = Self { up: DVec3::Z, front: DVec3::NEG_Y };

    /// The frame of glTF and of most tools for animation: y up, z to the front.
    pub const Y_UP: Self = Self { up: DVec3::Y, front: DVec3::Z };

    /// The frame of a camera, which trainers of Gaussian scenes keep: y down, seen along +z.
    pub const Y_DOWN: Self = Self { up: DVec3::NEG_Y, front: DVec3::NEG_Z };

    /// Returns the stance with this direction up, and the front that is usual for it: −Y if Z or −Z
    /// is nearest to the direction, otherwise +Z; made perpendicular to it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_direction_has_a_front() {
        assert_eq!(Stance::with_up(2.0 * DVec3::Z), Stance::SURVEY);
        assert_eq!(Stance::with_up(DVec3::Y), Stance::Y_UP);
        assert_eq!(Stance::with_up(DVec3::X).front, DVec3::Z);
        assert_eq!(Stance::with_up(DVec3::NEG_Z).front, DVec3::NEG_Y);
        for up in [DVec3::ONE, DVec3::new(-0.2, 0.9, 0.8), DVec3::new(0.1, 0.7, 0.7)] {
            let stance = Stance::with_up(up);
            assert!(stance.front.dot(stance.up).abs() < 1e-12, "{stance:?}");
            assert!((stance.front.length() - 1.0).abs() < 1e-12, "{stance:?}");
        }
    }
}
