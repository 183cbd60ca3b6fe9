//! The header: properties of the whole file.

use super::{MAGIC, VERSION, entry::Listing};
use crate::container::{Cursor, Put, directory::Kind};
use crate::{
    about::Orientation,
    gaussians::MOST_DEGREE,
    hierarchy::validate::{fault_of_box, fault_of_extent},
    input::copy,
    math::Bounds,
};
use glam::{DMat3, DQuat, DVec3};

/// The properties of the whole hierarchy. Lengths are in world units.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// World position of the origin of all positions.
    pub origin: DVec3,
    /// The box around all footprints, in world coordinates.
    pub bounds: Bounds,
    /// Footprints end this many standard deviations from the centre.
    pub extent: f32,
    /// Whether the source was solid ([`Tree::closed`](crate::hierarchy::Tree::closed)).
    pub closed: bool,
    /// Whether leaves differ in colour.
    pub has_color: bool,
    /// Whether any leaf has a normal.
    pub has_normals: bool,
    /// The degree of the colours of trained Gaussians; `None` for other splats.
    pub degree: Option<u32>,
    /// Whether every bit of the nodes is stored.
    pub lossless: bool,
    /// Points in the source: vertices or samples.
    pub source_points: u64,
    /// Splats at the finest level.
    pub leaves: u64,
    /// All nodes, including portals.
    pub nodes: u64,
    /// How the source stands; `None` if unknown.
    pub orientation: Option<Orientation>,
    /// Whether the orientation was guessed from the shape, not stated by the source.
    pub is_guessed: bool,
    /// The name of the world's unit (`"m"`); empty if unknown.
    pub unit: String,
    /// The name of the file that this one was made from; empty if there is none.
    pub source: String,
}

/// Bytes before the texts.
pub const FIXED: usize = 160;

/// Where the rotation to the orientation begins.
const TURN: usize = 144;

/// The header as stored, with what the reader needs to find the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    pub header: Header,
    /// Bytes of the whole file.
    pub file_bytes: u64,
    pub blocks: u32,
    pub pages: u32,
}

impl Stored {
    /// Returns the size in bytes of the header with its checksum.
    pub fn length(&self) -> usize {
        FIXED + self.header.unit.len() + self.header.source.len() + 4
    }

    pub fn encode(&self) -> Vec<u8> {
        let header = &self.header;
        let mut out = Vec::with_capacity(self.length());
        out.put(&MAGIC);
        let is_trained = header.degree.is_some();
        out.u32(VERSION);
        let flags =
            [header.closed, header.has_color, header.has_normals, header.lossless, is_trained];
        out.u32(flags.iter().enumerate().map(|(bit, &flag)| u32::from(flag) << bit).sum());
        out.u64(self.file_bytes);
        out.dvec3(header.origin);
        out.dvec3(header.bounds.min);
        out.dvec3(header.bounds.max);
        out.u64(header.source_points);
        out.u64(header.leaves);
        out.u64(header.nodes);
        out.f32s(&[header.extent]);
        out.u32(self.blocks);
        out.u32(self.pages);
        let axis = header.orientation.map_or(0, |orientation| nearest_axis(orientation.up));
        out.put(&[axis, u8::from(header.is_guessed), header.degree.unwrap_or(0) as u8, 0]);
        out.u32(header.unit.len() as u32);
        out.u32(header.source.len() as u32);
        out.f32s(&header.orientation.map_or([0.0; 4], turn_to));
        debug_assert_eq!(out.len(), FIXED);
        out.put(header.unit.as_bytes());
        out.put(header.source.as_bytes());
        out.u32(crc32fast::hash(&out));
        out
    }

    /// Reads the header at the beginning of a file.
    pub fn decode(bytes: &[u8]) -> Result<Self, Refusal> {
        if bytes.len() < MAGIC.len() {
            let begins = MAGIC.starts_with(bytes);
            return Err(if begins { Refusal::Incomplete } else { Refusal::Foreign });
        }
        let mut cursor = Cursor::new(bytes);
        if cursor.array() != Some(MAGIC) {
            return Err(Refusal::Foreign);
        }
        let version = cursor.u32().ok_or(Refusal::Incomplete)?;
        if version != VERSION {
            return Err(Refusal::Version(version));
        }
        // The lengths of the texts decide where the checksum is, and the checksum whether the
        // lengths can be trusted.
        let (unit, source) = texts(bytes).ok_or(Refusal::Incomplete)?;
        let end = FIXED + unit + source;
        let text = bytes.get(..end).ok_or(Refusal::Incomplete)?;
        let stated = Cursor::new(&bytes[end..]).u32().ok_or(Refusal::Incomplete)?;
        if stated != crc32fast::hash(text) {
            return Err(Refusal::Damaged("its checksum does not match"));
        }
        Self::fields(cursor, text, unit).ok_or(Refusal::Incomplete)?
    }

    /// Reads the fields from a cursor behind the version. `text` is the header without its
    /// checksum.
    fn fields(mut cursor: Cursor, text: &[u8], unit: usize) -> Option<Result<Self, Refusal>> {
        let (fixed, texts) = text.split_at_checked(FIXED)?;
        let flags = cursor.u32()?;
        let is_trained = flags >> 4 & 1 == 1;
        let file_bytes = cursor.u64()?;
        let origin = cursor.dvec3()?;
        let bounds = Bounds { min: cursor.dvec3()?, max: cursor.dvec3()? };
        let [source_points, leaves, nodes] = [cursor.u64()?, cursor.u64()?, cursor.u64()?];
        let extent = cursor.f32()?;
        let [blocks, pages] = [cursor.u32()?, cursor.u32()?];
        let axis = match cursor.u8()? {
            0 => None,
            axis @ 1..=3 => Some(Orientation::with_up(DVec3::AXES[usize::from(axis - 1)])),
            _ => return Some(Err(Refusal::Damaged("its up axis is unknown"))),
        };
        let is_guessed = cursor.u8()? != 0;
        let degree = is_trained.then_some(u32::from(cursor.u8()?));
        let mut turn = Cursor::new(fixed.get(TURN..FIXED)?);
        let orientation = match turned_by(turn.f32s()?) {
            // Older files state an axis alone.
            None => axis,
            Some(Ok(orientation)) => Some(orientation),
            Some(Err(message)) => return Some(Err(Refusal::Damaged(message))),
        };
        let (Ok(unit), Ok(source)) = (copy::text(&texts[..unit]), copy::text(&texts[unit..]))
        else {
            return Some(Err(Refusal::Damaged("its texts are not UTF-8")));
        };
        let sound = flags < 32
            && degree.is_none_or(|degree| degree <= MOST_DEGREE)
            && fault_of_box(origin, &bounds).is_none()
            && fault_of_extent(extent).is_none()
            && (1..=nodes).contains(&leaves)
            && (1..=pages).contains(&blocks)
            // Each page has a record, so that the time to read them is bounded by the file.
            && file_bytes / Listing::ENTRY as u64 >= u64::from(pages);
        if !sound {
            return Some(Err(Refusal::Damaged("its values contradict each other")));
        }
        let flag = |bit: u32| flags >> bit & 1 == 1;
        let header = Header {
            origin,
            bounds,
            extent,
            closed: flag(0),
            has_color: flag(1),
            has_normals: flag(2),
            degree,
            lossless: flag(3),
            source_points,
            leaves,
            nodes,
            orientation,
            is_guessed,
            unit,
            source,
        };
        Some(Ok(Self { header, file_bytes, blocks, pages }))
    }
}

/// Returns 1, 2 or 3 for the axis nearest to a direction, as older versions of the format state it.
fn nearest_axis(up: DVec3) -> u8 {
    let along = up.abs();
    1 + (along.max_position() as u8)
}

/// Returns the rotation that turns +Y to an orientation's up and +Z to its front, as a quaternion.
fn turn_to(Orientation { up, front }: Orientation) -> [f32; 4] {
    let turn = DQuat::from_mat3(&DMat3::from_cols(up.cross(front), up, front));
    turn.normalize().to_array().map(|part| part as f32)
}

/// Returns the orientation that a quaternion turns to; `None` for zeros, which stand for none.
fn turned_by(turn: [f32; 4]) -> Option<Result<Orientation, &'static str>> {
    if turn == [0.0; 4] {
        return None;
    }
    let turn = DQuat::from_array(turn.map(f64::from));
    // The length of a NaN lies in no range.
    if !(0.999..1.001).contains(&turn.length()) {
        return Some(Err("its rotation to the up axis does not have unit length"));
    }
    // Rounding to 32 bits moves the axes a little.
    let exact = |v: f64| if (v - v.round()).abs() < 1e-6 { v.round() + 0.0 } else { v };
    let axis = |axis: DVec3| {
        let turned = turn.normalize() * axis;
        DVec3::new(exact(turned.x), exact(turned.y), exact(turned.z))
    };
    Some(Ok(Orientation { up: axis(DVec3::Y), front: axis(DVec3::Z) }))
}

/// The lengths of the two texts.
fn texts(bytes: &[u8]) -> Option<(usize, usize)> {
    let mut cursor = Cursor::new(bytes.get(136..FIXED)?);
    Some((cursor.u32()? as usize, cursor.u32()? as usize))
}

/// Why a header is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The file ends inside the header.
    Incomplete,
    /// A different kind of file.
    Foreign,
    /// An unknown version.
    Version(u32),
    Damaged(&'static str),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stances_survive() {
        for orientation in [Orientation::SURVEY, Orientation::RAS, Orientation::Y_UP]
            .into_iter()
            .chain([DVec3::X, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z].map(Orientation::with_up))
        {
            assert_eq!(turned_by(turn_to(orientation)), Some(Ok(orientation)));
        }
        let orientation = Orientation::with_up(DVec3::new(0.2, -0.4, 0.9));
        let Some(Ok(read)) = turned_by(turn_to(orientation)) else { panic!("an orientation") };
        assert!(
            read.up.distance(orientation.up) < 1e-6
                && read.front.distance(orientation.front) < 1e-6
        );
        assert_eq!(nearest_axis(orientation.up), 3);
        assert_eq!(turned_by([0.0; 4]), None);
        assert!(turned_by([f32::NAN, 0.0, 0.0, 1.0]).is_some_and(|read| read.is_err()));
        assert!(turned_by([0.0, 0.0, 0.0, 2.0]).is_some_and(|read| read.is_err()));
    }
}
