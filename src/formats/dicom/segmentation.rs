//! What segmentations say of their segments (PS3.3, A.51 and C.8.20).

use super::{element::Set, tags};
use crate::{Result, about::Label, color::lab::of_lab};

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
        let color = <[u16; 3]>::try_from(item.shorts(tags::SEGMENT_COLOR)).ok().map(color);
        Some(Label { value, name, color, opacity: None })
    };
    let table = set.items(tags::SEGMENTS)?.iter().filter_map(label).collect();
    Ok(Some(Segmentation { kind, table }))
}

/// Converts a CIE L*a*b* colour in 16 bits (PS3.3, C.10.7.1.1) to red, green and blue in 0 … 1.
fn color(encoded: [u16; 3]) -> [f64; 3] {
    let [l, a, b] = encoded.map(|part| f64::from(part) / 65535.0);
    of_lab([100.0 * l, 255.0 * a - 128.0, 255.0 * b - 128.0])
}
