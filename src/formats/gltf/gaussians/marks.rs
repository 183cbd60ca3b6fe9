//! What the JSON says about Gaussians. The types of the gltf crate leave out the attributes and
//! extensions that it does not know.

use crate::{Result, input::Source};
use serde::{Deserialize, de::IgnoredAny};
use std::collections::BTreeMap;

/// The name of the extension, and the prefix of its attributes.
pub const NAME: &str = "KHR_gaussian_splatting";

/// The meshes of a file, with the marks of their primitives.
#[derive(Debug, Default, Deserialize)]
pub(in super::super) struct Marks {
    #[serde(default, rename = "extensionsUsed")]
    used: Vec<String>,
    #[serde(default)]
    meshes: Vec<MarkedMesh>,
}

#[derive(Debug, Deserialize)]
struct MarkedMesh {
    #[serde(default)]
    primitives: Vec<MarkedPrimitive>,
}

/// A primitive with all its attributes.
#[derive(Debug, Deserialize)]
struct MarkedPrimitive {
    #[serde(default)]
    attributes: Attributes,
    #[serde(default)]
    extensions: Option<Extensions>,
}

/// The indices of accessors, by attribute.
pub(super) type Attributes = BTreeMap<String, u32>;

#[derive(Debug, Deserialize)]
struct Extensions {
    #[serde(rename = "KHR_gaussian_splatting")]
    gaussians: Option<Mark>,
}

/// The extension of a primitive.
#[derive(Debug, Deserialize)]
pub(super) struct Mark {
    pub kernel: Option<String>,
    #[serde(rename = "colorSpace")]
    pub color_space: Option<String>,
    pub projection: Option<String>,
    #[serde(default)]
    pub extensions: Option<BTreeMap<String, IgnoredAny>>,
}

impl Marks {
    /// Reads the marks from the JSON.
    pub fn read(source: &Source, text: &str) -> Result<Self> {
        source.spend("the size of the attributes in bytes", tree_bytes(text.as_bytes()))?;
        serde_json::from_str(text).map_err(|error| source.error("JSON", error.to_string()))
    }

    /// As [`read`](Self::read), from bytes that are not known to be text.
    pub fn read_bytes(source: &Source, text: &[u8]) -> Result<Self> {
        source.spend("the size of the attributes in bytes", tree_bytes(text))?;
        serde_json::from_reader(text).map_err(|error| source.error("JSON", error.to_string()))
    }

    /// Returns the primitives of a mesh that are Gaussians: their number in the mesh, their mark
    /// and their attributes.
    pub(super) fn of_mesh(
        &self,
        mesh: usize,
    ) -> impl Iterator<Item = (usize, &Mark, &Attributes)> + '_ {
        let primitives = self.meshes.get(mesh).map_or(&[][..], |mesh| mesh.primitives.as_slice());
        primitives.iter().enumerate().filter_map(|(number, primitive)| {
            Some((number, primitive.mark()?, &primitive.attributes))
        })
    }

    /// Returns whether a primitive of a mesh is Gaussians.
    pub fn are_gaussians(&self, mesh: usize, primitive: usize) -> bool {
        let primitive = self.meshes.get(mesh).and_then(|mesh| mesh.primitives.get(primitive));
        primitive.is_some_and(|primitive| primitive.mark().is_some())
    }

    /// Returns whether the file names the extension, and uses it.
    pub(super) fn has_gaussians(&self) -> bool {
        self.used.iter().any(|name| name == NAME)
            && (0..self.meshes.len()).any(|mesh| self.of_mesh(mesh).next().is_some())
    }
}

impl MarkedPrimitive {
    fn mark(&self) -> Option<&Mark> {
        self.extensions.as_ref()?.gaussians.as_ref()
    }
}

/// Returns an upper bound on the bytes that the marks take. An object counts as a primitive, each
/// name and each item of a list as an entry of a map. The text of all names is added. All include
/// the spare capacity of lists.
fn tree_bytes(text: &[u8]) -> u64 {
    const ENTRY: u64 = 128;
    let count = |letter: u8| text.iter().filter(|&&b| b == letter).count() as u64;
    let (objects, entries) = (count(b'{'), count(b':') + count(b','));
    text.len() as u64 + 2 * size_of::<MarkedPrimitive>() as u64 * objects + ENTRY * entries
}
