//! Extensions: records of a kind and a length, four bytes each, and a content. Only the one that
//! names the coordinate system is known.

use super::number;
use crate::{about::Orientation, input::Source, warning};
use glam::DVec3;

/// The kind of `SPZ_ADOBE_coordinate_system`.
const COORDINATES: u32 = 0xadbe_0003;

/// Returns the number of the coordinate system that the records name.
pub(super) fn system(mut records: &[u8]) -> Option<u32> {
    while let (Some(kind), Some(length)) = (number(records, 0), number(records, 4)) {
        let content = records.get(8..)?;
        if kind == COORDINATES && length == 4 {
            return number(content, 0);
        }
        records = content.get(length as usize..)?;
    }
    None
}

/// Returns which direction is up in a coordinate system. There are 16, from 1. Their names say
/// where x, y and z point: from LDB (left, down, back) to RUF, then with z up or down from LFD to
/// RBU.
pub(super) fn orientation(source: &Source, system: u32) -> Option<Orientation> {
    let system = system.checked_sub(1).filter(|&system| system < 16)?;
    // Bit 0 is “right”, bit 1 “up”, bit 2 the sign of the third; bit 3 exchanges y and z.
    if (system & 7).count_ones() % 2 == 1 {
        warning::give!(
            "{}: says that its axes are left-handed; the scene is drawn mirrored",
            source.path.display()
        );
    }
    let axis = if system & 8 == 0 { DVec3::Y } else { DVec3::Z };
    Some(Orientation::with_up(if system & 2 == 0 { -axis } else { axis }))
}
