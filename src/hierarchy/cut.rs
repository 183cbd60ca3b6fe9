//! Cuts: which nodes are drawn in a view, in place of all those below them.
//!
//! Every node decides for itself, by its own bounds and its parent's, so a cut needs no walk from
//! the root. A node is drawn if its parent is refined and the node itself is not. Its refinement is
//! a number from 0 to 1 that grows with its size in the picture. It never exceeds the parent's,
//! because a node is neither larger nor nearer than its parent.
//!
//! A node's share in the picture is its parent's refinement minus its own. Along every path from
//! the root to a leaf the shares add up to one. A node fades out while its children fade in, and
//! nothing pops.

use super::{
    Block, Node, Tree,
    file::{CutSphere, in_order},
};
use crate::{
    Error, Result,
    gaussians::Eye,
    math::{Bounds, View},
    parallel::prelude::*,
    splat::{Splat, Surfels, TrainedSplats, decode_normal},
};
use glam::{DMat3, DVec3, Vec3, Vec4};

/// The level of detail at which a hierarchy is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Detail {
    /// No splat except a leaf is wider than this many pixels (full width at half maximum of its
    /// footprint, see [`Node::size`]). 0 draws the leaves.
    Pixels(f64),
    /// As fine as about this many splats allow, counted over all hierarchies together.
    Splats(u64),
    /// Frames take about this many milliseconds while the camera moves. While it rests, each frame
    /// is finer than the last.
    Milliseconds(f64),
}

impl Detail {
    /// The default cut. Finer ones draw two to four times as many splats, and come at most 0.4 dB
    /// nearer to a picture of many rays a pixel (docs/hierarchy.md, section 5).
    pub const PIXELS: f64 = 2.0;
}

impl Default for Detail {
    fn default() -> Self {
        Self::Pixels(Self::PIXELS)
    }
}

/// Nodes between the cut's width and this many times that width are partly refined.
pub const BLEND_BAND: f32 = 1.5;

/// Shares are integers in units of one over this.
pub const SHARE_UNIT: u32 = 1023;

/// How far sheets of splats, and footprints that are widened, may reach beyond a node, in pixels.
const WIDENED: f32 = 32.0;

/// Margin for rounding in tests of bounds, as a fraction of the largest length in them.
const ROUNDING: f32 = 1e-5;

/// Bounds on sizes in pixels, so that their quotients are finite.
const LEAST_PIXELS: f64 = 1e-9;
pub(crate) const MOST_PIXELS: f32 = 1e9;

/// Normals vary within a splat, so a node counts as facing away only if its cone is turned away by
/// this additional angle.
const CONE_MARGIN_DEGREES: f64 = 25.0;

/// A cut of one hierarchy in one view. Everything is in 32 bits, as on the GPU, which computes the
/// same (shaders/passes/cut.wgsl).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Columns of the rotation from the hierarchy's frame to view space, and the view-space
    /// position of its origin.
    pub(crate) axes: [Vec3; 3],
    pub(crate) origin: Vec3,
    pub(crate) perspective: bool,
    /// Pixels per world unit, in perspective at distance 1.
    pub(crate) scale: f32,
    /// One over the allowed width of a splat in pixels. To draw the leaves, it is so large that
    /// nothing else is fine enough.
    pub(crate) fineness: f32,
    /// Whether nodes that face away are culled.
    pub(crate) culls: bool,
    /// The picture's four sides. A view-space sphere with centre c and radius r is outside if n·c +
    /// d < −r.
    pub(crate) sides: [Vec4; 4],
    /// The box around what is drawn, in the hierarchy's frame; `None` for everything.
    region: Option<[Vec3; 2]>,
}

impl Cut {
    /// Creates the cut of a hierarchy around `origin` at a width of `pixels`.
    pub fn new(view: &View, origin: DVec3, pixels: f64, culls: bool) -> Self {
        let DMat3 { x_axis, y_axis, z_axis } = view.rotation;
        // The margin of one pixel covers the widening of footprints.
        let sides = view.sides(1.0).map(|(normal, reach)| normal.extend(reach).as_vec4());
        Self {
            axes: [x_axis, y_axis, z_axis].map(|axis| axis.as_vec3()),
            origin: view.to_view(origin).as_vec3(),
            perspective: view.perspective,
            scale: view.scale as f32,
            fineness: (1.0 / pixels.max(LEAST_PIXELS)) as f32,
            culls,
            sides,
            region: None,
        }
    }

    /// Limits the pages that are needed to those of a region. Nodes beyond it may be selected.
    pub fn within(self, origin: DVec3, region: Option<Bounds>) -> Self {
        let local = |place: DVec3| (place - origin).as_vec3();
        let region = region.map(|bounds| [local(bounds.min), local(bounds.max)]);
        Self { region, ..self }
    }

    /// Whether a sphere in the hierarchy's frame lies outside the region.
    fn is_beyond(&self, center: [f32; 3], radius: f32) -> bool {
        self.region.is_some_and(|[min, max]| {
            let center = Vec3::from_array(center);
            // Sheets and footprints are widened by pixels, which are larger farther away.
            let away =
                if self.perspective { self.to_view(center.to_array()).length() } else { 1.0 };
            let reach = radius + WIDENED * away / self.scale;
            center.distance_squared(center.clamp(min, max)) > reach * reach
        })
    }

    fn to_view(self, place: [f32; 3]) -> Vec3 {
        self.axes[0] * place[0] + self.axes[1] * place[1] + self.axes[2] * place[2] + self.origin
    }

    /// Returns the width in pixels of a splat with the sphere's size, seen from the nearest point
    /// of the sphere.
    pub fn pixels(&self, sphere: &CutSphere) -> f32 {
        if self.perspective {
            let nearest = self.to_view(sphere.center).length() - sphere.radius;
            (sphere.size * self.scale / nearest.max(1e-30)).min(MOST_PIXELS)
        } else {
            (sphere.size * self.scale).min(MOST_PIXELS)
        }
    }

    /// Returns that width as a multiple of the cut's.
    pub(super) fn widths(&self, sphere: &CutSphere) -> f32 {
        self.pixels(sphere) * self.fineness
    }

    /// Returns the refinement of a node with these bounds, in units of 1/[`SHARE_UNIT`].
    pub fn refinement(&self, sphere: &CutSphere) -> u32 {
        let excess = (self.widths(sphere) - 1.0) / (BLEND_BAND - 1.0);
        (excess.clamp(0.0, 1.0) * SHARE_UNIT as f32 + 0.5) as u32
    }

    /// Returns the share of a node in the picture, in units of 1/[`SHARE_UNIT`]. `parent` is `None`
    /// for the root. `has_children` says whether children could be drawn instead.
    pub fn share(&self, node: &Node, parent: Option<&CutSphere>, has_children: bool) -> u32 {
        let above = parent.map_or(SHARE_UNIT, |parent| self.refinement(parent));
        if above == 0 {
            return 0;
        }
        let refinement = if has_children { self.refinement(&CutSphere::of(node)) } else { 0 };
        if above <= refinement || self.is_hidden(node) { 0 } else { above - refinement }
    }

    /// Returns whether nothing of a node's splat is visible: it is outside the picture, or faces
    /// away.
    pub(super) fn is_hidden(&self, node: &Node) -> bool {
        // A merged footprint may reach beyond the splats that it replaces.
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

    /// Returns whether a view-space sphere is outside the picture or behind the eye.
    pub fn is_outside(&self, center: Vec3, radius: f32) -> bool {
        self.sides.iter().any(|side| side.truncate().dot(center) + side.w < -radius)
            || (self.perspective && center.z < -radius)
    }

    /// Returns whether a node may be drawn if its parent lies within these bounds: a sphere around
    /// all the parents' spheres, and their largest size. May return true too often, but never false
    /// too often.
    pub fn may_refine(&self, parents: &CutSphere) -> bool {
        let reach = parents.radius + 1.3 * parents.size;
        self.refinement(parents) > 0
            && !self.is_outside(self.to_view(parents.center), reach)
            && !self.is_beyond(parents.center, reach)
    }

    /// As [`may_refine`](Self::may_refine), for bounds around the bounds of several pages: returns
    /// true wherever that would for one of these, also after rounding.
    pub fn may_refine_below(&self, around: &CutSphere) -> bool {
        let away = Vec3::from(around.center).length() + self.origin.length();
        let radius = around.radius + ROUNDING * (away + around.radius);
        let around = CutSphere { radius, size: around.size * (1.0 + ROUNDING), ..*around };
        let reach = radius + 1.3 * around.size;
        self.refinement(&around) > 0
            && !self.is_outside(self.to_view(around.center), reach)
            // The bounds of a page may be farther away than the middle of those around them.
            && !self.is_beyond(around.center, reach + WIDENED * radius / self.scale)
    }
}

/// Returns whether all normals of a cone face away. `along` is the cosine between the cone's axis
/// and the view direction. `cone` is the cosine of its half-angle. `near` is the sine of the
/// angular radius of the node's sphere.
fn faces_away(along: f32, cone: f32, near: f32) -> bool {
    let (sin_margin, cos_margin) = cone_margin();
    if along <= 0.0 || near >= 1.0 {
        return false;
    }
    let cos_near = (1.0 - near * near).sqrt();
    let sin_cone = (1.0 - cone * cone).max(0.0).sqrt();
    // Cosine and sine of cone + near, then of cone + near + margin.
    let (c, s) = (cone * cos_near - sin_cone * near, sin_cone * cos_near + cone * near);
    let (c, s) = (c * cos_margin - s * sin_margin, s * cos_margin + c * sin_margin);
    c > 0.0 && along >= s
}

/// Sine and cosine of the margin.
pub(crate) fn cone_margin() -> (f32, f32) {
    let angle = CONE_MARGIN_DEGREES.to_radians();
    (libm::sin(angle) as f32, libm::cos(angle) as f32)
}

/// The splats of a cut: of a tree of surfels, or of one of trained Gaussians.
#[derive(Debug, Clone)]
pub enum CutSplats {
    /// Splats that carry their own colour.
    Surfels(Surfels),
    /// Splats as the view's eye sees them.
    Trained(TrainedSplats),
}

impl CutSplats {
    /// Returns the splats.
    pub fn splats(&self) -> &[Splat] {
        match self {
            Self::Surfels(set) => &set.splats,
            Self::Trained(set) => &set.splats,
        }
    }
}

impl Tree {
    /// Returns the splats of a cut in the order of the nodes, each with its share of its optical
    /// depth. This visits the whole tree: it is the oracle for the engine's selection.
    ///
    /// A splat budget is kept the way the engine keeps it, by cuts an eighth of an octave apart.
    /// The time of a frame is not known here, so [`Detail::Milliseconds`] draws the default cut.
    ///
    /// # Errors
    /// [`Error::Argument`] if the nodes of the tree are not in the order that
    /// [`Block`](super::Block) requires.
    pub fn cut(
        &self,
        view: &View,
        detail: Detail,
        cull_backfaces: Option<bool>,
    ) -> Result<CutSplats> {
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
        Ok(match self.degree() {
            Some(_) => CutSplats::Trained(self.seen_at_cut(&cut, Eye::of(view))),
            None => CutSplats::Surfels(self.at_cut(&cut)),
        })
    }

    /// Returns the splats of a cut, as [`Self::cut`] does, of a tree whose nodes are in order.
    pub(super) fn at_cut(&self, cut: &Cut) -> Surfels {
        let splats =
            self.selected(cut).iter().map(|(node, share)| faded(&node.splat, *share)).collect();
        Surfels { origin: self.origin, splats, extent: self.extent }
    }

    /// Returns the nodes of a cut with their shares in units of 1/[`SHARE_UNIT`].
    ///
    /// # Panics
    /// If the nodes of a block are not in order. [`cut`](Self::cut) returns an error for such
    /// trees, and [`validate`](super::validate()) a finding.
    pub fn selected(&self, cut: &Cut) -> Vec<(&Node, u32)> {
        let blocks = self.blocks.par_iter().enumerate().map(|(index, block)| {
            let selected = self.selected_of(index, block, cut).into_iter();
            selected.map(|(node, share)| (&block.nodes[node as usize], share)).collect::<Vec<_>>()
        });
        blocks.collect::<Vec<_>>().concat()
    }

    /// The selected nodes of one block, by their numbers.
    pub(super) fn selected_of(&self, index: usize, block: &Block, cut: &Cut) -> Vec<(u32, u32)> {
        let above = block.portal.zip(self.blocks.first()).and_then(|(portal, top)| {
            let holds = |node: &&Node| {
                (node.first_child..node.first_child + node.children).contains(&portal)
            };
            top.nodes.iter().find(holds).map(CutSphere::of)
        });
        if above.is_some_and(|above| cut.refinement(&above) == 0) {
            // No node below is refined further than the parent of its root.
            return Vec::new();
        }
        let mut parents: Vec<Option<CutSphere>> = vec![None; block.nodes.len()];
        for node in &block.nodes {
            let children = node.first_child as usize..(node.first_child + node.children) as usize;
            parents[children].fill(Some(CutSphere::of(node)));
        }
        parents[0] = above;
        let mut selected = Vec::new();
        for (number, (node, parent)) in (0..).zip(block.nodes.iter().zip(&parents)) {
            // A portal is replaced by the root of its block.
            let is_portal = self.is_joined() && index == 0 && node.is_leaf();
            let share =
                if is_portal { 0 } else { cut.share(node, parent.as_ref(), !node.is_leaf()) };
            if share > 0 {
                selected.push((number, share));
            }
        }
        selected
    }
}

/// Returns a node's splat with its share of the optical depth.
pub(crate) fn faded(splat: &Splat, share: u32) -> Splat {
    Splat { strength: splat.strength * (share as f32 / SHARE_UNIT as f32), ..*splat }
}
