//! How many pixels are drawn for each pixel of the picture.

use std::str::FromStr;

/// Pixels drawn for each pixel of the picture and averaged to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Samples {
    /// More for smaller pictures.
    Auto,
    /// This many along each side.
    Factor(u32),
}

impl Samples {
    /// Most pixels drawn if the picture's size decides.
    const MOST_PIXELS: u64 = 1 << 18;

    /// Returns how many pixels are drawn along each side of a pixel. Explicit splats have edges and
    /// are widened, which takes more pixels than a volume does.
    pub fn factor(self, [width, height]: [u32; 2], has_splats: bool) -> u32 {
        let drawn = |factor: u32| u64::from(factor * factor) * u64::from(width) * u64::from(height);
        let most = if has_splats { 8 } else { 4 };
        match self {
            Self::Auto => {
                (2..=most).rev().find(|factor| drawn(*factor) <= Self::MOST_PIXELS).unwrap_or(1)
            }
            Self::Factor(factor) => factor,
        }
    }
}

impl FromStr for Samples {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "1" => Ok(Self::Factor(1)),
            "4" => Ok(Self::Factor(2)),
            "9" => Ok(Self::Factor(3)),
            "16" => Ok(Self::Factor(4)),
            "64" => Ok(Self::Factor(8)),
            _ => Err("use auto, 1, 4, 9, 16 or 64".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pictures_take_more_pixels() {
        let factor =
            |text: &str, size| Samples::from_str(text).map(|samples| samples.factor(size, true));
        assert_eq!(factor("auto", [1, 1]), Ok(8));
        assert_eq!(factor("auto", [64, 64]), Ok(8));
        assert_eq!(factor("auto", [128, 128]), Ok(4));
        assert_eq!(Samples::Auto.factor([64, 64], false), 4);
        assert_eq!(factor("auto", [160, 160]), Ok(3));
        assert_eq!(factor("auto", [256, 256]), Ok(2));
        assert_eq!(factor("auto", [257, 256]), Ok(1));
        assert_eq!(factor("auto", [u32::MAX, u32::MAX]), Ok(1));
        assert_eq!(factor("9", [2000, 2000]), Ok(3));
        assert!(factor("2", [1, 1]).is_err());
    }
}
