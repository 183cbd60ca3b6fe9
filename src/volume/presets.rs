//! Transfer functions by name.

use super::{Shade, TransferFunction};
use crate::{Error, Result};

/// The points of a preset: value, red, green, blue, opacity.
type Points = &'static [[f64; 5]];

/// Values in Hounsfield units, opacity per millimetre.
const CT_BONE: Points = &[
    [150.0, 0.55, 0.25, 0.15, 0.0],
    [250.0, 0.80, 0.55, 0.38, 0.06],
    [500.0, 0.93, 0.84, 0.68, 0.35],
    [1200.0, 1.0, 0.98, 0.93, 0.8],
];
const CT_SOFT_TISSUE: Points = &[
    [-250.0, 0.55, 0.35, 0.25, 0.0],
    [-90.0, 0.85, 0.65, 0.45, 0.02],
    [20.0, 0.78, 0.38, 0.30, 0.10],
    [120.0, 0.85, 0.45, 0.36, 0.25],
    [300.0, 0.95, 0.88, 0.75, 0.5],
    [1200.0, 1.0, 1.0, 0.96, 0.8],
];
const CT_LUNG: Points = &[
    [-950.0, 0.15, 0.25, 0.45, 0.0],
    [-850.0, 0.25, 0.45, 0.70, 0.01],
    [-600.0, 0.55, 0.70, 0.85, 0.05],
    [-450.0, 0.85, 0.70, 0.65, 0.02],
    [-300.0, 0.85, 0.60, 0.55, 0.0],
];
const CT_ANGIOGRAPHY: Points = &[
    [120.0, 0.45, 0.05, 0.05, 0.0],
    [200.0, 0.75, 0.12, 0.08, 0.15],
    [400.0, 0.95, 0.40, 0.20, 0.55],
    [600.0, 0.98, 0.85, 0.70, 0.4],
    [1200.0, 1.0, 0.98, 0.93, 0.7],
];
/// Values as fractions of the range. Opacity rises early and colours have one hue, so that a coil
/// that is more sensitive on one side changes the lightness alone.
const MRI: Points = &[
    [0.00, 0.46, 0.36, 0.33, 0.0],
    [0.10, 0.55, 0.43, 0.39, 0.1],
    [0.25, 0.68, 0.55, 0.48, 0.5],
    [0.60, 0.86, 0.76, 0.68, 0.7],
    [1.00, 1.00, 0.97, 0.92, 0.8],
];
/// Grey and white matter; fluid and fat are clear.
const MR_BRAIN: Points = &[
    [0.28, 0.62, 0.38, 0.35, 0.0],
    [0.42, 0.80, 0.58, 0.52, 0.35],
    [0.65, 0.93, 0.84, 0.76, 0.7],
    [0.85, 1.0, 0.97, 0.90, 0.7],
    [1.00, 1.0, 0.99, 0.96, 0.04],
];
/// Blood that flows into the slices is brighter than all else.
const MR_ANGIOGRAPHY: Points = &[
    [0.62, 0.45, 0.05, 0.05, 0.0],
    [0.75, 0.75, 0.14, 0.10, 0.12],
    [0.90, 0.95, 0.42, 0.24, 0.6],
    [1.00, 1.0, 0.88, 0.76, 0.8],
];
const GENERIC: Points = &[
    [0.10, 0.20, 0.05, 0.10, 0.0],
    [0.30, 0.70, 0.28, 0.15, 0.05],
    [0.60, 0.92, 0.68, 0.35, 0.25],
    [1.00, 1.00, 0.98, 0.92, 0.7],
];

/// The diagonal of a scan of a head, in millimetres.
const HEAD: f64 = 350.0;

impl TransferFunction {
    /// The names that [`named`](Self::named) accepts.
    pub const NAMES: [&'static str; 8] = [
        "ct-bone",
        "ct-soft-tissue",
        "ct-lung",
        "ct-angiography",
        "mri",
        "mr-brain",
        "mr-angiography",
        "generic",
    ];

    /// Whether a preset is for magnetic resonance, whose values have no unit: it is spread over the
    /// values that stand out of the background ([`Volume::foreground`](super::Volume::foreground)).
    pub fn is_of_foreground(name: &str) -> bool {
        matches!(name, "mri" | "mr-brain" | "mr-angiography")
    }

    /// Returns a preset. The CT presets expect Hounsfield units. The others spread over
    /// `range`. Opacities hold for a world length of 1, as for a scan of a body in millimetres;
    /// [`for_size`](Self::for_size) fits them to other data.
    ///
    /// # Errors
    /// [`Error::Argument`] if `name` is not one of [`NAMES`](Self::NAMES), or if `range` is not
    /// finite or descends.
    pub fn named(name: &str, range: [f64; 2]) -> Result<Self> {
        let [low, high] = range;
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(Error::Argument(format!(
                "{low} to {high} is not a range of values: both ends must be finite and ascend"
            )));
        }
        let (points, low, width) = match name {
            "ct-bone" => (CT_BONE, 0.0, 1.0),
            "ct-soft-tissue" => (CT_SOFT_TISSUE, 0.0, 1.0),
            "ct-lung" => (CT_LUNG, 0.0, 1.0),
            "ct-angiography" => (CT_ANGIOGRAPHY, 0.0, 1.0),
            "mri" => (MRI, low, high - low),
            "mr-brain" => (MR_BRAIN, low, high - low),
            "mr-angiography" => (MR_ANGIOGRAPHY, low, high - low),
            "generic" => (GENERIC, low, high - low),
            _ => {
                let names = Self::NAMES.join(", ");
                return Err(Error::Argument(format!(
                    "there is no transfer function “{name}”; there are {names}"
                )));
            }
        };
        Ok(Self {
            color: points.iter().map(|&[v, r, g, b, _]| (low + v * width, [r, g, b])).collect(),
            opacity: points.iter().map(|&[v, .., opacity]| (low + v * width, opacity)).collect(),
            unit: 1.0,
            shade: Some(Shade::default()),
            ..Self::default()
        })
    }

    /// Returns the same function with opacities for data of another size: `diagonal` is that of
    /// the box around them, in world units. For a [`named`](Self::named) one, opacities then hold
    /// for 1/350 of the diagonal, which is about a millimetre of a head. The picture is the same in
    /// any unit of length. A diagonal that is not above 0 changes nothing.
    #[must_use]
    pub fn for_size(mut self, diagonal: f64) -> Self {
        if diagonal > 0.0 && diagonal.is_finite() {
            self.unit *= diagonal / HEAD;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_valid() {
        for name in TransferFunction::NAMES {
            for range in [[-1024.0, 3071.0], [5.0, 5.0]] {
                let t = TransferFunction::named(name, range).unwrap();
                t.validate().unwrap();
            }
        }
        assert!(
            TransferFunction::named("bone", [0.0, 1.0])
                .unwrap_err()
                .to_string()
                .contains("ct-bone")
        );
        assert!(TransferFunction::named("mri", [f64::NAN, 1.0]).is_err());
        let t = TransferFunction::named("generic", [100.0, 200.0]).unwrap();
        assert_eq!((t.opacity(110.0), t.opacity(200.0)), (0.0, 0.7));
    }

    #[test]
    fn opacities_follow_the_size_of_the_data() {
        for name in TransferFunction::NAMES {
            let transfer = TransferFunction::named(name, [0.0, 1.0]).unwrap();
            for (diagonal, unit) in [(350.0, 1.0), (0.35, 1e-3), (3.5e8, 1e6)] {
                let fitted = transfer.clone().for_size(diagonal);
                assert!((fitted.unit / unit - 1.0).abs() < 1e-12);
                assert_eq!(TransferFunction { unit: 1.0, ..fitted }, transfer);
            }
            assert_eq!(transfer.clone().for_size(0.0), transfer);
        }
    }
}
