//! Cuts: which nodes stand for the rest in a view.
//!
//! Every node decides for itself, by its own bounds and its parent's, so that a cut needs no walk from the root: a node is
//! drawn where its parent is refined and it is not. How far a node is refined is a number from 0 to 1 that grows with its
//! size in the picture; it never is larger than its parent's, because neither its size nor its nearness is. A node's share in
//! the picture is its parent's number less its own. Along every way from the root to a leaf the shares add up to one: a node
//! fades out while its children fade in, and nothing pops.

use super::{
    Block, Node, Tree,
    file::{CutSphere, in_order},
};
use crate::{
    Error, Result,
    math::View,
    splat::{Payload, Splat, SplatSet, decode_normal},
};
use glam::{DMat3, DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// How fine a hierarchy is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Detail {
    /// No splat is wider than this many pixels (at half the height of its footprint, see [`Node::size`]), but leaves; 0 draws
    /// the leaves.
    Pixels(f64),
    /// About as many splats as this, of all hierarchies together; as fine as they suffice for.
    Splats(u64),
    /// Frames take about as many milliseconds as this while the camera moves; when it rests, each is finer than the last.
    Milliseconds(f64),
}

impl Detail {
    /// The cut where none is told: finer ones draw two to four times as many splats, and come at most 0.4 dB nearer to what
    /// many rays a pixel show (docs/hierarchy.md, section 5).
    pub const PIXELS: f64 = 2.0;
}

impl Default for Detail {
    fn default() -> Self {
        Self::Pixels(Self::PIXELS)
    }
}

/// Nodes between the cut's size and this many times it are refined in part.
pub const BLEND_BAND: f32 = 1.5;

/// Shares are counted in parts of this.
pub const SHARE_UNIT: u32 = 1023;

/// Sizes in pixels are kept between these, so that their quotients are finite.
const LEAST_PIXELS: f64 = 1e-9;
pub(crate) const MOST_PIXELS: f32 = 1e9;

/// Normals within a splat turn: a node counts as facing away only where its cone is turned away by this angle more.
const CONE_MARGIN_DEGREES: f64 = 25.0;

/// A cut of one hierarchy in one view. All in 32 bits, as on the GPU, which does the same (shaders/cut.wgsl).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Columns of the turn from the hierarchy's frame to view space, and the view-space place of its origin.
    pub(crate) axes: [Vec3; 3],
    pub(crate) origin: Vec3,
    pub(crate) perspective: bool,
    /// Pixels per world unit, at distance 1 in perspective.
    pub(crate) scale: f32,
    /// One over the pixels that a splat may be wide; so large for leaves that nothing else is fine enough.
    pub(crate) fineness: f32,
    /// Whether what faces away is left out.
    pub(crate) culls: bool,
    /// The picture's four sides: a view-space sphere at c of radius r is outside where n·c + d < −r.
    pub(crate) sides: [Vec4; 4],
}

impl Cut {
    /// The cut of a hierarchy around `origin` at so many `pixels`.
    pub fn new(view: &View, origin: DVec3, pixels: f64, culls: bool) -> Self {
        let DMat3 { x_axis, y_axis, z_axis } = view.rotation;
        // A pixel on every side for footprints' widening.
        let sides = view.sides(1.0).map(|(normal, reach)| normal.extend(reach).as_vec4());
        Self {
            axes: [x_axis, y_axis, z_axis].map(|axis| axis.as_vec3()),
            origin: view.to_view(origin).as_vec3(),
            perspective: view.perspective,
            scale: view.scale as f32,
            fineness: (1.0 / pixels.max(LEAST_PIXELS)) as f32,
            culls,
            sides,
        }
    }

    fn to_view(self, place: [f32; 3]) -> Vec3 {
        self.axes[0] * place[0] + self.axes[1] * place[1] + self.axes[2] * place[2] + self.origin
    }

    /// How wide a splat of this size looks, in pixels, from the nearest point of a sphere.
    pub fn pixels(&self, sphere: &CutSphere) -> f32 {
        if self.perspective {
            let nearest = self.to_view(sphere.center).length() - sphere.radius;
            (sphere.size * self.scale / nearest.max(1e-30)).min(MOST_PIXELS)
        } else {
            (sphere.size * self.scale).min(MOST_PIXELS)
        }
    }

    /// The same as a multiple of what the cut allows.
    pub(super) fn widths(&self, sphere: &CutSphere) -> f32 {
        self.pixels(sphere) * self.fineness
    }

    /// How far what has this sphere is refined, in parts of [`SHARE_UNIT`].
    pub fn refinement(&self, sphere: &CutSphere) -> u32 {
        let excess = (self.widths(sphere) - 1.0) / (BLEND_BAND - 1.0);
        (excess.clamp(0.0, 1.0) * SHARE_UNIT as f32 + 0.5) as u32
    }

    /// The share of a node in the picture, in parts of [`SHARE_UNIT`]; `parent` is `None` for the root. `has_children`: they
    /// could be drawn instead.
    pub fn share(&self, node: &Node, parent: Option<&CutSphere>, has_children: bool) -> u32 {
        let above = parent.map_or(SHARE_UNIT, |parent| self.refinement(parent));
        if above == 0 {
            return 0;
        }
        let own = if has_children { self.refinement(&CutSphere::of(node)) } else { 0 };
        if above <= own || self.is_hidden(node) { 0 } else { above - own }
    }

    /// Whether nothing of a node's splat can be seen: it is beside the picture, or faces away.
    pub(super) fn is_hidden(&self, node: &Node) -> bool {
        // A merged footprint may reach beyond what it stands for.
        let reach = node.radius + 1.3 * node.size;
        let center = self.to_view(node.splat.center);
        if self.is_outside(center, reach) {
            return true;
        }
        if !self.culls || node.cone <= 0.0 {
            return false;
        }
        let Some(normal) = decode_normal(node.splat.normal) else { return false };
        let axis = self.to_view(normal.to_array()) - self.origin;
        let center = self.to_view(node.center);
        let (toward, near) = if self.perspective {
            let distance = center.length();
            (center / distance, node.radius / distance)
        } else {
            (Vec3::Z, 0.0)
        };
        faces_away(axis.dot(toward), node.cone, near)
    }

    /// Whether a sphere is beside the picture or behind the eye.
    pub fn is_outside(&self, center: Vec3, radius: f32) -> bool {
        self.sides.iter().any(|side| side.truncate().dot(center) + side.w < -radius)
            || (self.perspective && center.z < -radius)
    }

    /// Whether something with a parent in these bounds may be drawn: a sphere that holds all the parents' spheres, and the
    /// largest of their sizes. May say yes too often, never no too often.
    pub fn may_refine(&self, parents: &CutSphere) -> bool {
        let reach = parents.radius + 1.3 * parents.size;
        self.refinement(parents) > 0 && !self.is_outside(self.to_view(parents.center), reach)
    }
}

/// Whether all normals of a cone (cosine `cone` of its half-angle) around an axis face away: `along` is the cosine between
/// axis and view, `near` the sine of the angle that the sphere takes up.
fn faces_away(along: f32, cone: f32, near: f32) -> bool {
    let (sin_margin, cos_margin) = cone_margin();
    if along <= 0.0 || near >= 1.0 {
        return false;
    }
    let cos_near = (1.0 - near * near).sqrt();
    let sin_cone = (1.0 - cone * cone).max(0.0).sqrt();
    // Cosine and sine of cone + near + margin.
    let (c, s) = (cone * cos_near - sin_cone * near, sin_cone * cos_near + cone * near);
    let (c, s) = (c * cos_margin - s * sin_margin, s * cos_margin + c * sin_margin);
    c > 0.0 && along >= s
}

/// Sine and cosine of the margin.
pub(crate) fn cone_margin() -> (f32, f32) {
    let angle = CONE_MARGIN_DEGREES.to_radians();
    (libm::sin(angle) as f32, libm::cos(angle) as f32)
}

impl Tree {
    /// The splats of a cut, each with its share of its optical depth, in the order of the nodes. The whole tree is looked
    /// through: this is the oracle of what the engine selects.
    ///
    /// A number of splats is kept to as by the engine, by cuts an eighth of an octave apart; a frame time is not known here,
    /// and taken for the usual cut.
    ///
    /// # Errors
    /// [`Error::Argument`] for a tree whose nodes are not in order, as [`Block`](super::Block) tells.
    pub fn cut(
        &self,
        view: &View,
        detail: Detail,
        cull_backfaces: Option<bool>,
    ) -> Result<SplatSet> {
        for (number, block) in self.blocks.iter().enumerate() {
            in_order(&block.nodes)
                .map_err(|message| Error::Argument(format!("block {number}: {message}")))?;
        }
        let culls = cull_backfaces.unwrap_or(self.closed);
        let at = |pixels: f64| Cut::new(view, self.origin, pixels, culls);
        let cut = match detail {
            Detail::Pixels(pixels) => at(pixels),
            Detail::Milliseconds(_) => at(Detail::PIXELS),
            Detail::Splats(most) => {
                let step = |step: i32| at(f64::from(step).mul_add(0.125, -8.0).exp2());
                let (mut fine, mut coarse) = (-1, 255);
                while coarse - fine > 1 {
                    let middle = (fine + coarse) / 2;
                    let fits = self.selected(&step(middle)).len() as u64 <= most;
                    *(if fits { &mut coarse } else { &mut fine }) = middle;
                }
                step(coarse)
            }
        };
        Ok(self.at_cut(&cut))
    }

    /// The splats of a cut, as those of [`Self::cut`], of a tree whose nodes are in order.
    pub(super) fn at_cut(&self, cut: &Cut) -> SplatSet {
        let splats =
            self.selected(cut).iter().map(|(node, share)| faded(&node.splat, *share)).collect();
        SplatSet {
            origin: self.origin,
            payload: Payload::Radiance,
            splats,
            extent: self.extent,
            overlap: 1.0,
        }
    }

    /// The nodes of a cut, with their shares in parts of [`SHARE_UNIT`].
    ///
    /// # Panics
    /// Where the nodes of a block are not in order, as [`cut`](Self::cut) finds out and [`validate`](super::validate()) tells.
    pub fn selected(&self, cut: &Cut) -> Vec<(&Node, u32)> {
        let own = self
            .blocks
            .par_iter()
            .enumerate()
            .map(|(index, block)| self.selected_of(index, block, cut));
        own.collect::<Vec<_>>().concat()
    }

    /// Those of one block.
    fn selected_of<'a>(
        &'a self,
        index: usize,
        block: &'a Block,
        cut: &Cut,
    ) -> Vec<(&'a Node, u32)> {
        let above = block.portal.zip(self.blocks.first()).and_then(|(portal, top)| {
            let holds = |node: &&Node| {
                (node.first_child..node.first_child + node.children).contains(&portal)
            };
            top.nodes.iter().find(holds).map(CutSphere::of)
        });
        if above.is_some_and(|above| cut.refinement(&above) == 0) {
            // Nothing below is refined further than what is above.
            return Vec::new();
        }
        let mut parents: Vec<Option<CutSphere>> = vec![None; block.nodes.len()];
        for node in &block.nodes {
            let children = node.first_child as usize..(node.first_child + node.children) as usize;
            parents[children].fill(Some(CutSphere::of(node)));
        }
        parents[0] = above;
        let mut selected = Vec::new();
        for (node, parent) in block.nodes.iter().zip(&parents) {
            // The root of its block stands in a portal's place.
            let is_portal = self.is_joined() && index == 0 && node.is_leaf();
            let share =
                if is_portal { 0 } else { cut.share(node, parent.as_ref(), !node.is_leaf()) };
            if share > 0 {
                selected.push((node, share));
            }
        }
        selected
    }
}

/// A node's splat with only a share of its optical depth.
pub(crate) fn faded(splat: &Splat, share: u32) -> Splat {
    Splat { strength: splat.strength * (share as f32 / SHARE_UNIT as f32), ..*splat }
}
