//! Code that several formats share: the choice among arrays, holes, point clouds, columns of
//! samples, polygons, textures, sample types.

pub(super) mod anatomy;
pub mod attribute;
pub(super) mod brightness;
pub(super) mod choice;
pub(super) mod cloud;
pub(super) mod colors;
#[cfg(any(feature = "ply", feature = "sog"))]
pub(super) mod curve;
pub(super) mod gather;
pub(super) mod grid;
pub(super) mod holes;
#[cfg(any(feature = "hdf5", feature = "tiff", feature = "zarr"))]
pub(super) mod length;
pub(super) mod luminance;
pub(super) mod plain;
pub(super) mod polygon;
pub(super) mod raw_point;
pub(super) mod rescale;
pub(super) mod sample_type;
pub(super) mod several;
pub(super) mod stand_in;
pub(super) mod texture;
pub(super) mod trained;
pub(super) mod unplaced;
pub(super) mod visible;

/// Names that a message lists at most.
const MOST_LISTED: usize = 20;

/// Returns names as a list for messages: the first of them, and the number of the others.
pub(super) fn listing(names: impl ExactSizeIterator<Item = String>) -> String {
    let count = names.len();
    let listed: Vec<String> = names.take(MOST_LISTED).collect();
    match count {
        0 => "nothing that can be read".into(),
        _ if count > MOST_LISTED => {
            format!("{} and {} more", listed.join("; "), count - MOST_LISTED)
        }
        _ => listed.join("; "),
    }
}
