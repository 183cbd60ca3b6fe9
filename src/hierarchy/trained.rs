//! Hierarchies of trained Gaussians. Their nodes are splats of optical depth, −ln(1 − o) for an
//! opacity o, which merge as those of surfaces do. Each node has the harmonics of its colour: a
//! merged one the mean, weighted as its position is, by optical depth times area.

use super::{
    Block, Cut, Hierarchy, Node, SHARE_UNIT, Tree,
    build::{BuildOptions, build_colored, tree_colored},
    colors::LeafColors,
    file::{Page, WriteOptions},
};
use crate::{
    Error, Result,
    gaussians::{Colors, Eye, Gaussians, harmonics::terms},
    parallel::prelude::*,
    progress::Watch,
    splat::{NO_NORMAL, Splat, Surfels, TRAINED_OPACITIES, TrainedSplats, encode_trained_color},
};
use glam::Vec3;
use std::path::Path;

/// Returns the splats that a tree is built of, and the number of the Gaussian of each. Gaussians
/// that cover less than 1/255 of any pixel are left out.
fn splats_of(set: &Gaussians) -> Result<(Surfels, Vec<u32>)> {
    set.validate().map_err(Error::Argument)?;
    let [least, most] = TRAINED_OPACITIES;
    let shows = |index: &u32| f64::from(set.opacities[*index as usize]) >= least;
    let numbers: Vec<u32> = (0..set.len() as u32).filter(shows).collect();
    let seen = set.seen_from(Eye::Along(glam::DVec3::Z));
    let leaf = |index: &u32| {
        let splat = seen.splats[*index as usize];
        let opacity = f64::from(set.opacities[*index as usize]).min(most);
        let strength = -(-opacity).ln_1p() as f32;
        Splat { strength, color: u32::MAX, normal: NO_NORMAL, ..splat }
    };
    let splats = numbers.par_iter().map(leaf).collect();
    Ok((Surfels { origin: seen.origin, splats, extent: seen.extent }, numbers))
}

/// Returns a node's splat as it is drawn, with its share and its colour: a leaf by its trainer's
/// rule, a merged one by its optical depth.
pub(crate) fn drawn(splat: &Splat, is_leaf: bool, share: f32, color: [f32; 3]) -> Splat {
    let depth = splat.strength * share;
    let strength = if is_leaf { (-depth).exp_m1() } else { depth };
    let [color, normal] = encode_trained_color(color);
    Splat { strength, color, normal, ..*splat }
}

impl Tree {
    /// Builds the tree of a trained scene, as [`Tree::build`] builds that of splats. Gaussians that
    /// cover less than 1/255 of any pixel are left out.
    ///
    /// # Errors
    /// Those of [`Tree::build`]; [`Error::Argument`] for a set that is not valid.
    pub fn of_gaussians(set: &Gaussians, options: &BuildOptions, watch: Watch<'_>) -> Result<Self> {
        let (splats, numbers) = splats_of(set)?;
        let colors = LeafColors::new(set, numbers, true);
        tree_colored(&splats, options, watch, Some(&colors))
    }

    /// Returns the degree of the colours of a trained scene; `None` for other splats.
    pub fn degree(&self) -> Option<u32> {
        self.blocks.first().and_then(|block| block.colors.as_ref()).map(Colors::degree)
    }

    /// Returns the splats of a cut as an eye sees them.
    pub(super) fn seen_at_cut(&self, cut: &Cut, eye: Eye) -> TrainedSplats {
        let of_block = |(index, block): (usize, &Block)| {
            let Some(colors) = &block.colors else { return Vec::new() };
            let seen = |(node, share): (u32, u32)| {
                let Node { splat, children, .. } = block.nodes[node as usize];
                let place = self.origin + Vec3::from(splat.center).as_dvec3();
                let color = colors.seen(node as usize, eye.toward(place));
                drawn(&splat, children == 0, share as f32 / SHARE_UNIT as f32, color)
            };
            self.selected_of(index, block, cut).into_iter().map(seen).collect()
        };
        let parts: Vec<Vec<Splat>> = self.blocks.par_iter().enumerate().map(of_block).collect();
        TrainedSplats { origin: self.origin, splats: parts.concat(), extent: self.extent }
    }
}

/// Builds the tree of a trained scene and writes it, as [`build_file`](super::build_file) does for
/// splats. The colours are quantised ([`Colors::coded`]) unless the options keep every bit.
///
/// # Errors
/// Those of [`build_file`](super::build_file); [`Error::Argument`] for a set that is not valid.
pub fn build_gaussians(
    set: &Gaussians,
    path: impl AsRef<Path>,
    build: &BuildOptions,
    write: &WriteOptions,
    watch: Watch<'_>,
) -> Result<()> {
    let (splats, numbers) = splats_of(set)?;
    let colors = LeafColors::new(set, numbers, write.lossless);
    build_colored(&splats, path.as_ref(), build, write, watch, Some(&colors))
}

impl Hierarchy {
    /// Returns the Gaussians of the finest level of a trained scene, page by page; `None` for a
    /// hierarchy of other splats.
    ///
    /// # Errors
    /// Those of [`leaves`](Self::leaves).
    pub fn gaussians(&self) -> Result<Option<Gaussians>> {
        let Some(degree) = self.header().degree else { return Ok(None) };
        let count = terms(degree);
        let of_page = |page: &Page| {
            let (Some(colors), false) = (&page.colors, page.has_portals) else {
                return Vec::new();
            };
            let leaves = (0..page.nodes.len()).filter(|node| page.nodes[*node].is_leaf());
            leaves.flat_map(|leaf| colors.harmonics(leaf).into_iter().take(count)).collect()
        };
        let pages: Vec<Vec<[f32; 3]>> = self.each_page(of_page)?;
        let set = Gaussians::from_splats(&self.leaves()?)?;
        let header = self.header();
        let mut about = set.about.clone();
        (about.orientation, about.length) = (header.orientation, header.unit.clone());
        Ok(Some(Gaussians { degree, harmonics: pages.concat(), about, ..set }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        gaussians::harmonics::constant_of,
        hierarchy::{CutSplats, Detail, file::to_bytes, validate},
        input::Limits,
        math::{Camera, Projection},
    };
    use glam::{DVec3, Quat};

    /// A ball of small Gaussians of degree 1, red at the top and green below.
    fn ball(count: usize) -> Gaussians {
        let mut set =
            Gaussians { origin: DVec3::new(50.0, 0.0, -7.0), degree: 1, ..Gaussians::default() };
        for index in 0..count {
            let z = 1.0 - (2 * index + 1) as f32 / count as f32;
            let turn = index as f32 * 2.399_963_2;
            let r = (1.0 - z * z).sqrt();
            set.centers.push(Vec3::new(r * turn.cos(), r * turn.sin(), z));
            set.scales.push(Vec3::new(0.03, 0.02, 0.005));
            set.rotations.push(Quat::from_rotation_arc(Vec3::Z, set.centers[index]));
            set.opacities.push(if index % 10 == 0 { 0.001 } else { 0.7 });
            let [red, green] = if z > 0.0 { [0.9, 0.1] } else { [0.1, 0.9] };
            let constant = [red, green, 0.2].map(constant_of);
            set.harmonics.extend([constant, [0.0; 3], [0.3, 0.0, 0.0], [0.0; 3]]);
        }
        set
    }

    fn view(distance: f64) -> crate::math::View {
        let focal_point = DVec3::new(50.0, 0.0, -7.0);
        let camera = Camera {
            position: focal_point + DVec3::new(0.0, -distance, 0.0),
            focal_point,
            view_up: DVec3::Z,
            projection: Projection::Perspective { view_angle: 30.0 },
        };
        camera.view([64, 64]).unwrap()
    }

    #[test]
    fn the_finest_level_is_the_scene() {
        let set = ball(500);
        let options = BuildOptions { block_splats: 128, ..BuildOptions::default() };
        let tree = Tree::of_gaussians(&set, &options, None).unwrap();
        assert_eq!((validate(&tree), tree.degree(), tree.leaf_count()), (vec![], Some(1), 450));
        let view = view(6.0);
        let cut = tree.cut(&view, Detail::Pixels(0.0), None).unwrap();
        let mut wanted = set.seen_from(Eye::of(&view)).splats;
        wanted.retain(|splat| splat.strength < -0.01);
        let key = |splat: &Splat| splat.center.map(f32::to_bits);
        let CutSplats::Trained(TrainedSplats { splats: mut drawn, .. }) = cut else {
            panic!("{cut:?}")
        };
        wanted.sort_by_key(key);
        drawn.sort_by_key(key);
        assert_eq!(drawn.len(), wanted.len());
        for (drawn, wanted) in drawn.iter().zip(&wanted) {
            assert_eq!((drawn.color, drawn.normal), (wanted.color, wanted.normal));
            assert!((drawn.strength - wanted.strength).abs() < 1e-5);
        }
    }

    #[test]
    fn coarse_levels_keep_the_colours_of_their_places() {
        let set = ball(2000);
        let tree = Tree::of_gaussians(&set, &BuildOptions::default(), None).unwrap();
        let cut = tree.cut(&view(40.0), Detail::Pixels(4.0), None).unwrap();
        assert!(cut.splats().len() < 200 && matches!(cut, CutSplats::Trained(_)));
        for splat in cut.splats() {
            let [red, green, _] = crate::splat::decode_trained_color(splat);
            if splat.center[2].abs() > 0.3 {
                assert_eq!(splat.center[2] > 0.0, red > green, "{splat:?}");
            }
        }
    }

    #[test]
    fn files_keep_colours() {
        let set = ball(700);
        let options = BuildOptions { block_splats: 128, ..BuildOptions::default() };
        let tree = Tree::of_gaussians(&set, &options, None).unwrap();
        for lossless in [true, false] {
            let write = WriteOptions { lossless, ..WriteOptions::default() };
            let bytes = to_bytes(&tree, &write).unwrap();
            let name = Path::new("a.splk");
            let read = Hierarchy::from_bytes(bytes.clone(), name, &Limits::default()).unwrap();
            assert_eq!(read.header().degree, Some(1));
            assert_eq!(read.check().findings, vec![]);
            let again = read.gaussians().unwrap().unwrap();
            assert_eq!((again.len(), again.degree, again.validate()), (630, 1, Ok(())));
            for index in 0..again.len() {
                let [red, green, _] = again.harmonics_of(index)[0];
                let top = again.centers[index].z;
                if top.abs() > 0.01 {
                    assert_eq!(top > 0.0, red > green);
                }
                assert!((again.opacities[index] - 0.7).abs() < 0.02);
                assert!((again.harmonics_of(index)[2][0] - 0.3).abs() < 0.01);
            }
            // A truncated file is an error, wherever it ends.
            for end in (0..bytes.len()).step_by(997) {
                let cut = bytes[..end].to_vec();
                assert!(Hierarchy::from_bytes(cut, name, &Limits::default()).is_err());
            }
        }
    }
}
