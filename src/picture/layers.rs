//! What is known of the pixels of a picture beside their colours and depths.

use super::Picture;
use crate::{Error, Result};

/// Layers of a picture, each with a value for every pixel, with rows from the top. They are stored
/// in OpenEXR files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layers {
    /// The unit normals of what is seen, in the world and towards the eye; zero where nothing is
    /// seen that light falls on.
    pub normals: Option<Vec<[f32; 3]>>,
    /// The colours without light, as those of a [`Picture`]: multiplied by opacity, as displayed.
    pub albedo: Option<Vec<[f32; 4]>>,
    /// The numbers of the inputs that are seen, from 1 on; 0 where nothing is.
    pub identifiers: Option<Vec<u32>>,
}

impl Layers {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Returns an error if a layer does not have one value for each pixel.
    pub(super) fn check(&self, picture: &Picture) -> Result<()> {
        let lengths = [
            self.normals.as_ref().map(Vec::len),
            self.albedo.as_ref().map(Vec::len),
            self.identifiers.as_ref().map(Vec::len),
        ];
        let count = picture.color.len();
        match lengths.into_iter().flatten().find(|length| *length != count) {
            None => Ok(()),
            Some(length) => Err(Error::Argument(format!(
                "layers: a picture of {count} pixels cannot have {length} values of a layer"
            ))),
        }
    }
}
