//! What segmentations say of their segments (PS3.3, A.51 and C.8.20).

use super::{element::Set, tags};
use crate::{Result, about::Label};
use glam::DVec3;

/// The classes of segmentations, and of label maps.
const CLASSES: [&str; 2] = ["1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"];

/// What the frames of a segmentation hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Segmentation {
    pub kind: Kind,
    pub table: Vec<Label>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Each frame belongs to one segment, and has at least this value where the segment lies.
    Mask(f64),
    /// The values are the numbers of segments.
    Labels,
}

/// Reads what a file says of its segments; `None` for pictures.
pub fn of(set: &Set) -> Result<Option<Segmentation>> {
    let class = set.text(tags::CLASS).unwrap_or_default();
    if !CLASSES.contains(&class.as_str()) {
        return Ok(None);
    }
    let kind = match set.text(tags::SEGMENTATION_TYPE).as_deref() {
        Some("LABELMAP") => Kind::Labels,
        // A segment lies where at least half of a pixel belongs to it.
        Some("FRACTIONAL") => {
            Kind::Mask((f64::from(set.short(tags::MOST_FRACTION).unwrap_or(255)) / 2.0).max(1.0))
        }
        _ => Kind::Mask(1.0),
    };
    let label = |item: &Set| {
        let value = i32::from(item.short(tags::SEGMENT_OF_TABLE)?);
        let name = item.text(tags::SEGMENT_LABEL).unwrap_or_default();
        let color = <[u16; 3]>::try_from(item.shorts(tags::SEGMENT_COLOR)).ok().map(of_lab);
        Some(Label { value, name, color, opacity: None })
    };
    let table = set.items(tags::SEGMENTS)?.iter().filter_map(label).collect();
    Ok(Some(Segmentation { kind, table }))
}

/// Converts a CIE L*a*b* colour in 16 bits (PS3.3, C.10.7.1.1) to red, green and blue in 0 … 1.
fn of_lab(encoded: [u16; 3]) -> [f64; 3] {
    let [l, a, b] = encoded.map(|part| f64::from(part) / 65535.0);
    let y = (100.0 * l + 16.0) / 116.0;
    let [x, z] = [y + (255.0 * a - 128.0) / 500.0, y - (255.0 * b - 128.0) / 200.0];
    let part = |t: f64| {
        let cube = t * t * t;
        if cube > 0.008_856 { cube } else { (t - 16.0 / 116.0) / 7.787 }
    };
    // The white of sRGB (D65).
    let white = DVec3::new(0.950_47, 1.0, 1.088_83);
    let xyz = white * DVec3::new(part(x), part(y), part(z));
    let to_linear = [
        DVec3::new(3.240_45, -1.537_14, -0.498_53),
        DVec3::new(-0.969_27, 1.876_01, 0.041_56),
        DVec3::new(0.055_64, -0.204_03, 1.057_23),
    ];
    to_linear.map(|row| {
        let linear = row.dot(xyz).clamp(0.0, 1.0);
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
    })
}
