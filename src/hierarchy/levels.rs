//! Levels of detail for splats without a hierarchy, such as those of raw meshes and point clouds.
//! If most of them are far smaller than a picture can show, fewer are drawn. Splats with colour are
//! drawn as a cut of a tree, built once in memory; scattered samples are merged, one for each cell
//! of a grid.

use super::{
    BuildOptions, Cut, Node, Preset, Tree, check_splats, file::CutSphere, merge::leaf,
    sphere::enclosing,
};
use crate::{
    Result, memory, scattered,
    splat::{SampleSplats, Splats, Surfels},
};
use glam::DVec3;
use std::sync::Arc;

/// Fewer splats than this are drawn as fast as their tree is built.
const FEWEST: usize = 1 << 17;
/// Splats of a set that are measured to decide whether a cut is worthwhile.
const PROBES: usize = 1 << 12;
/// A splat is fine if it is narrower than this fraction of the cut's width. On a surface, one node
/// of the cut then stands for sixteen splats or more.
const FINE: f32 = 0.25;
/// The edge of a cell of samples as a fraction of the cut's width. As with bricks, a sample counts
/// as two steps wide.
const CELL: f64 = 0.5;

/// A set of splats, and the smaller sets derived from it.
#[derive(Debug)]
pub struct Levels {
    set: Splats,
    probes: Vec<Node>,
    /// The number of splats in the set for each probe.
    each: usize,
    fewer: Fewer,
}

/// What is drawn in place of the set if it is too fine.
#[derive(Debug)]
enum Fewer {
    Nothing,
    Tree(Tree),
    /// Samples merged in cells whose edge is 2 to this power.
    Cells(i32, Arc<SampleSplats>),
}

impl Levels {
    /// Returns `None` for sets that are drawn as they are. They are small, or no tree can be built
    /// of them, or a tree would take half of the available memory.
    pub fn new(set: &Splats) -> Option<Self> {
        let count = set.splats().len();
        let bytes = 2 * (count * size_of::<Node>()) as u64;
        let is_refused = match set {
            Splats::Samples(_) => false,
            Splats::Surfels(set) => check_splats(set).is_err(),
        };
        if count < FEWEST || is_refused || memory::most().is_some_and(|most| bytes > most / 2) {
            return None;
        }
        let each = count.div_ceil(PROBES);
        // Samples have no normals, but only the positions and widths of probes are used.
        let extent = set.common().extent;
        let probes = set.splats().iter().step_by(each).map(|splat| leaf(splat, extent)).collect();
        Some(Self { set: set.clone(), probes, each, fewer: Fewer::Nothing })
    }

    /// The origin of the set's positions.
    pub fn origin(&self) -> DVec3 {
        self.set.common().origin
    }

    /// Returns the set to draw for a cut: the whole set, or a smaller one in its place.
    ///
    /// # Errors
    /// Those of [`Tree::build`].
    pub fn drawn(&mut self, cut: &Cut) -> Result<Splats> {
        if !self.pays(cut) {
            return Ok(self.set.clone());
        }
        Ok(match self.set.clone() {
            Splats::Surfels(set) => Splats::Surfels(self.nodes(set, cut)?),
            Splats::Samples(set) => Splats::Samples(self.cells(&set, cut)),
        })
    }

    fn nodes(&mut self, set: Arc<Surfels>, cut: &Cut) -> Result<Arc<Surfels>> {
        if !matches!(self.fewer, Fewer::Tree(_)) {
            let options = BuildOptions { preset: Preset::Fastest, ..BuildOptions::default() };
            self.fewer = Fewer::Tree(Tree::build(&set, &options, None)?);
        }
        let Fewer::Tree(tree) = &self.fewer else { return Ok(set) };
        Ok(Arc::new(tree.at_cut(cut)))
    }

    fn cells(&mut self, all: &SampleSplats, cut: &Cut) -> Arc<SampleSplats> {
        let around = enclosing(&all.splats, all.extent);
        let unit = CutSphere {
            center: around.center.as_vec3().to_array(),
            radius: around.radius as f32,
            size: 1.0,
        };
        let edge = CELL / f64::from(cut.widths(&unit)).max(f64::from(f32::MIN_POSITIVE));
        let power = edge.log2().floor().clamp(-100.0, 100.0) as i32;
        if let Fewer::Cells(kept_power, set) = &self.fewer
            && *kept_power == power
        {
            return set.clone();
        }
        let set = Arc::new(scattered::merged(all, f64::from(power).exp2()));
        self.fewer = Fewer::Cells(power, set.clone());
        set
    }

    /// Returns whether most of the splats in view are fine, and there are many of them.
    fn pays(&self, cut: &Cut) -> bool {
        let (mut seen, mut fine) = (0, 0);
        for probe in self.probes.iter().filter(|probe| !cut.is_hidden(probe)) {
            seen += 1;
            fine += usize::from(cut.widths(&CutSphere::of(probe)) < FINE);
        }
        2 * fine >= seen && fine * self.each >= FEWEST
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::{Bounds, Camera, View},
        splat::Splat,
    };

    /// A square grid of `side`² splats.
    fn grid(side: u32) -> Splats {
        let step = 1.0 / side as f32;
        let splat = |i: u32| {
            let center = [(i % side) as f32 * step, (i / side) as f32 * step, 0.0];
            let factor = [step, 0.0, step, 0.0, 0.0, 0.1 * step];
            Splat { center, strength: 1.0, factor, color: u32::MAX, normal: 0 }
        };
        let splats = (0..side * side).map(splat).collect();
        Splats::Surfels(Arc::new(Surfels { origin: DVec3::ZERO, splats, extent: 3.0 }))
    }

    fn view(size: [u32; 2]) -> View {
        let bounds = Bounds { min: DVec3::ZERO, max: DVec3::new(1.0, 1.0, 0.0) };
        Camera::framing(&bounds, DVec3::Z, DVec3::Y, 1.0).view(size).expect("a view")
    }

    #[test]
    fn small_pictures_take_a_cut_and_large_ones_the_set() {
        let set = grid(400);
        let mut levels = Levels::new(&set).expect("levels");
        let count = |levels: &mut Levels, side, pixels| {
            let cut = Cut::new(&view([side; 2]), set.common().origin, pixels, false);
            levels.drawn(&cut).expect("a set").splats().len()
        };
        assert_eq!(count(&mut levels, 1000, 2.0), set.splats().len());
        assert!(matches!(levels.fewer, Fewer::Nothing));
        let few = count(&mut levels, 40, 2.0);
        assert!(few < 4000, "{few}");
        assert!(count(&mut levels, 1, 2.0) < 40);
        // A cut of 0 draws the leaves.
        assert_eq!(count(&mut levels, 40, 0.0), set.splats().len());
        assert!(Levels::new(&grid(300)).is_none());
    }
}
