//! Trained 3D Gaussians in glTF 2.0: the extension `KHR_gaussian_splatting`.
//!
//! Each vertex of a marked primitive is a Gaussian. Scales are standard deviations, opacities are
//! from 0 to 1, and the harmonics are those of the trainer.
//!
//! Drafts of the extension had other attributes, which are also read: names that begin with `_`,
//! colour and opacity in `COLOR_0` (the colour as a display value), and logarithms of the scales.
//! The file does not say which it has, but logarithms are mostly negative and scales never.

mod marks;
mod motion;
#[cfg(test)]
mod tests;
mod write;

pub(super) use marks::{Marks, NAME};
pub use write::write_gaussians;

use super::{
    Opened,
    buffers::{self, Buffers},
    displayed, nodes,
};
use crate::{
    Result,
    about::Orientation,
    formats::shared::trained::{Trained, settle},
    gaussians::{Gaussians, MOST_DEGREE, harmonics, turn::map_colors},
    input::Source,
    warning,
};
use ::gltf::json::{self, mesh::Mode, validation::Checked};
use glam::{Quat, Vec3};
use marks::{Attributes, Mark};
use motion::Motion;
use std::collections::HashMap;

/// Returns whether a file contains trained Gaussians: it names the extension, and a primitive has
/// it. Reads only the JSON.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a GLB without JSON and for malformed JSON;
/// [`Error::Limit`](crate::Error::Limit) for JSON over the limits.
pub fn holds_gaussians(source: &Source) -> Result<bool> {
    let (text, _) = buffers::split(source)?;
    if !text.windows(NAME.len()).any(|word| word == NAME.as_bytes()) {
        return Ok(false);
    }
    Ok(Marks::read_bytes(source, text)?.has_gaussians())
}

/// Reads the trained Gaussians of the default scene, in its world frame. The set has the highest
/// degree of all primitives. The transforms of the nodes also turn the colours.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a scene without Gaussians, missing attributes, kernels
/// other than the ellipse, compressed Gaussians, and as [`read`](super::read);
/// [`Error::Limit`](crate::Error::Limit) for counts over the limits.
pub fn read_gaussians(source: &Source) -> Result<Gaussians> {
    let Opened { root, text, binary } = super::open(source)?;
    let marks = Marks::read(source, &text)?;
    drop(text);
    let buffers = Buffers::open(source, &root, binary)?;
    let scene = Scene::build(source, &root, &marks, &buffers)?;
    let degree = scene.clouds.iter().map(Cloud::degree).max().unwrap_or_default();
    let mut set =
        settle(source, scene.count, degree, |index, colors| Ok(scene.one(index, colors)))?;
    set.about.orientation = Some(Orientation::Y_UP);
    Ok(set)
}

/// The Gaussians of the scene, before the nodes move them.
#[derive(Default)]
struct Scene {
    clouds: Vec<Cloud>,
    motions: Vec<Motion>,
    /// In ascending order of their start; none is empty.
    parts: Vec<Part>,
    count: usize,
}

/// A primitive at a node.
struct Part {
    /// The number of its first Gaussian.
    start: usize,
    cloud: usize,
    motion: usize,
}

impl Scene {
    fn build(source: &Source, root: &json::Root, marks: &Marks, buffers: &Buffers) -> Result<Self> {
        let mut scene = Self::default();
        // Index of the cloud, by mesh and primitive. Several nodes may have the same mesh.
        let mut known: HashMap<(usize, usize), usize> = HashMap::new();
        let mut is_empty = true;
        for (transform, mesh) in nodes::meshes(source, root, buffers)? {
            if root.meshes.get(mesh).is_none() {
                let message = format!("does not exist; there are {} meshes", root.meshes.len());
                return Err(source.error(format!("mesh {mesh}"), message));
            }
            let mut primitives = marks.of_mesh(mesh).peekable();
            if primitives.peek().is_none() {
                continue;
            }
            is_empty = false;
            source.room::<Motion>("the transforms", 1)?;
            scene.motions.push(Motion::new(transform).ok_or_else(|| {
                let message = "the transform of its node has numbers that are too large";
                source.error(format!("mesh {mesh}"), message)
            })?);
            for (number, mark, attributes) in primitives {
                source.check_time()?;
                let cloud = match known.get(&(mesh, number)) {
                    Some(&cloud) => cloud,
                    None => {
                        let place = format!("mesh {mesh}, primitive {number}");
                        check(source, root, (mesh, number), mark)?;
                        let primitive = Primitive { source, buffers, attributes, place: &place };
                        scene.clouds.push(primitive.cloud(mark)?);
                        known.insert((mesh, number), scene.clouds.len() - 1);
                        scene.clouds.len() - 1
                    }
                };
                scene.add(source, cloud)?;
            }
        }
        if is_empty {
            let message = format!("contains no primitives with the extension {NAME}");
            return Err(source.error("scene", message).hint("read the file as a mesh"));
        }
        Ok(scene)
    }

    /// Adds a cloud at the last motion.
    fn add(&mut self, source: &Source, cloud: usize) -> Result<()> {
        let (start, more) = (self.count, self.clouds[cloud].centers.len());
        let total = (start as u64).saturating_add(more as u64);
        self.count = source.check_points("the number of Gaussians", total)?;
        if more > 0 {
            self.parts.push(Part { start, cloud, motion: self.motions.len() - 1 });
        }
        Ok(())
    }

    /// Returns a Gaussian of the scene, and fills in its colour.
    fn one(&self, index: usize, colors: &mut [[f32; 3]]) -> Trained {
        let part = &self.parts[self.parts.partition_point(|part| part.start <= index) - 1];
        let (cloud, motion) = (&self.clouds[part.cloud], &self.motions[part.motion]);
        let index = index - part.start;
        let colors = &mut colors[..cloud.harmonics.len()];
        for (color, term) in colors.iter_mut().zip(&cloud.harmonics) {
            *color = term[index];
        }
        if cloud.is_linear {
            map_colors(colors, |[r, g, b]| {
                let [r, g, b, _] = displayed([r, g, b, 1.0]);
                [r, g, b]
            });
        }
        motion.turn.apply(colors);
        let scale = Vec3::from_array(cloud.scales[index]);
        motion.apply(Trained {
            center: Vec3::from_array(cloud.centers[index]).as_dvec3(),
            scale: if cloud.has_logarithms { scale.exp() } else { scale },
            rotation: Quat::from_array(cloud.rotations[index]),
            opacity: cloud.opacities[index],
        })
    }
}

/// Checks that a primitive is of a kind that is read.
fn check(
    source: &Source,
    root: &json::Root,
    (mesh, number): (usize, usize),
    mark: &Mark,
) -> Result<()> {
    let place = format!("mesh {mesh}, primitive {number}");
    let mut names = mark.extensions.iter().flat_map(|extensions| extensions.keys());
    if let Some(name) = names.find(|name| name.contains("compression")) {
        let message = format!("its Gaussians are compressed ({name}), which is not supported");
        return Err(source.error(place, message).hint("write the file again uncompressed"));
    }
    // “ellipsoid” is the name in a draft.
    let kernel = mark.kernel.as_deref().unwrap_or("ellipse");
    if !["ellipse", "ellipsoid"].contains(&kernel) {
        let message = format!("the kernel “{kernel}” is not supported, only “ellipse”");
        return Err(source.error(place, message));
    }
    let primitive = root.meshes.get(mesh).and_then(|mesh| mesh.primitives.get(number));
    if !primitive.is_some_and(|primitive| primitive.mode == Checked::Valid(Mode::Points)) {
        return Err(source.error(place, "Gaussians need the mode 0 (points)"));
    }
    if let Some(projection) = mark.projection.as_deref().filter(|name| *name != "perspective") {
        warning::give!(
            "{}: {place}: the projection “{projection}” is not known; “perspective” is used",
            source.path.display()
        );
    }
    Ok(())
}

/// The Gaussians of a primitive. All lists have one entry a Gaussian.
struct Cloud {
    centers: Vec<[f32; 3]>,
    scales: Vec<[f32; 3]>,
    /// The scales are logarithms.
    has_logarithms: bool,
    rotations: Vec<[f32; 4]>,
    opacities: Vec<f32>,
    /// A list for each term.
    harmonics: Vec<Vec<[f32; 3]>>,
    /// The colours are linear light.
    is_linear: bool,
}

impl Cloud {
    fn degree(&self) -> u32 {
        harmonics::degree_of(self.harmonics.len()).unwrap_or_default()
    }
}

/// The attributes of a primitive.
struct Primitive<'a> {
    source: &'a Source<'a>,
    buffers: &'a Buffers<'a>,
    attributes: &'a Attributes,
    /// Names the primitive in errors.
    place: &'a str,
}

impl Primitive<'_> {
    fn cloud(&self, mark: &Mark) -> Result<Cloud> {
        let count = self.buffers.claimed(self.needed("POSITION")?);
        self.source.check_points("the number of Gaussians", count)?;
        let degree = self.degree()?;
        let terms = harmonics::terms(degree);
        // Positions, scales, rotations, opacities and colours from `COLOR_0`.
        let each = 12 + 12 + 16 + 4 + 4 + 16 + 12 * terms as u64;
        self.source.spend("the size of the attributes in bytes", count.saturating_mul(each))?;
        let centers = self.floats("POSITION", count, false)?;
        let scales: Vec<[f32; 3]> = self.floats("SCALE", count, false)?;
        let rotations = self.floats("ROTATION", count, false)?;
        let (opacities, constants) = self.opacities_and_constants(count)?;
        let mut harmonics = vec![constants];
        for degree in 1..=degree {
            for coefficient in 0..=2 * degree {
                harmonics.push(self.floats(&term(degree, coefficient), count, false)?);
            }
        }
        let has_logarithms = are_logarithms(&scales);
        if has_logarithms {
            self.warn("most of its scales are negative; all are read as logarithms, as in drafts");
        }
        let is_linear = self.is_linear(mark);
        Ok(Cloud { centers, scales, has_logarithms, rotations, opacities, harmonics, is_linear })
    }

    /// Returns the opacities and the constant terms. Those of drafts are in `COLOR_0`.
    fn opacities_and_constants(&self, count: u64) -> Result<(Vec<f32>, Vec<[f32; 3]>)> {
        let constant = term(0, 0);
        let has = |name: &str| self.find(name).is_some();
        let colors = if (has("OPACITY") && has(&constant)) || !has("COLOR_0") {
            Vec::new()
        } else {
            let accessor = self.counted("COLOR_0", count)?;
            self.buffers.colors(accessor, self.place)?
        };
        let opacities = if has("OPACITY") || colors.is_empty() {
            self.floats::<1>("OPACITY", count, true)?.into_iter().map(|[opacity]| opacity).collect()
        } else {
            colors.iter().map(|color| color[3]).collect()
        };
        let constants = if has(&constant) || colors.is_empty() {
            self.floats(&constant, count, false)?
        } else {
            colors.iter().map(|&[r, g, b, _]| [r, g, b].map(harmonics::constant_of)).collect()
        };
        Ok((opacities, constants))
    }

    /// Returns the highest degree of the harmonics. Each degree needs all terms and all lower
    /// degrees.
    fn degree(&self) -> Result<u32> {
        let mut highest = 0;
        for degree in 1..=MOST_DEGREE {
            let has = |coefficient: &u32| self.find(&term(degree, *coefficient)).is_some();
            let present = (0..=2 * degree).filter(has).count() as u32;
            if present == 0 {
                continue;
            }
            if present != 2 * degree + 1 || highest + 1 != degree {
                let message = format!(
                    "has {present} of {} harmonics of degree {degree}, and all of the degrees up \
                     to {highest}; each degree needs all harmonics and all lower degrees",
                    2 * degree + 1
                );
                return Err(self.source.error(self.place, message));
            }
            highest = degree;
        }
        Ok(highest)
    }

    /// Returns whether the colours are linear light.
    fn is_linear(&self, mark: &Mark) -> bool {
        // The other names are those of drafts.
        match mark.color_space.as_deref() {
            None | Some("srgb_rec709_display" | "BT.709-sRGB" | "BT.709") => false,
            Some("lin_rec709_display" | "BT.709-linear" | "linear") => {
                self.warn("its colours are linear light; they are converted before blending");
                true
            }
            Some(name) => {
                let message = format!("the colour space “{name}” is not known; sRGB is used");
                self.warn(&message);
                false
            }
        }
    }

    /// Returns the accessor of an attribute. The name may have the prefix of the extension, or an
    /// underscore as in drafts.
    fn find(&self, name: &str) -> Option<usize> {
        let names = [format!("{NAME}:{name}"), format!("_{name}"), name.to_owned()];
        names.iter().find_map(|name| self.attributes.get(name)).map(|&index| index as usize)
    }

    fn needed(&self, name: &str) -> Result<usize> {
        self.find(name).ok_or_else(|| {
            let prefix = if name == "POSITION" { String::new() } else { format!("{NAME}:") };
            self.source.error(self.place, format!("has no attribute {prefix}{name}"))
        })
    }

    /// Returns the accessor of an attribute that has this number of elements.
    fn counted(&self, name: &str, count: u64) -> Result<usize> {
        let accessor = self.needed(name)?;
        let elements = self.buffers.claimed(accessor);
        if elements == count {
            return Ok(accessor);
        }
        let message = format!("has {count} positions, but {elements} values of {name}");
        Err(self.source.error(self.place, message))
    }

    fn floats<const N: usize>(
        &self,
        name: &str,
        count: u64,
        fractions: bool,
    ) -> Result<Vec<[f32; N]>> {
        self.buffers.floats(self.counted(name, count)?, self.place, fractions)
    }

    fn warn(&self, message: &str) {
        warning::give!("{}: {}: {message}", self.source.path.display(), self.place);
    }
}

/// Returns the name of the attribute with a term.
fn term(degree: u32, coefficient: u32) -> String {
    format!("SH_DEGREE_{degree}_COEF_{coefficient}")
}

/// Returns whether these scales can only be logarithms: most are negative.
fn are_logarithms(scales: &[[f32; 3]]) -> bool {
    let scales = scales.as_flattened();
    2 * scales.iter().filter(|scale| **scale < 0.0).count() > scales.len()
}
