//! The invariants of every hierarchy, and their validation.

use super::{
    Node, Tree,
    file::{in_order, joint_angle, reach},
    merge::{WIDTH, deviation},
};
use crate::{
    container::{Finding, Findings},
    math::Bounds,
    splat::Splat,
};
use glam::{DVec3, Vec3};

/// Checks every invariant of [`Node`], [`Block`](super::Block) and [`Tree`]; a sound tree has no
/// findings. The invariants are:
///
/// - A child's sphere lies in its parent's, and its cone in its parent's.
/// - A node's size is at least a child's, and at least that of its own splat.
/// - The footprint of a leaf lies in its sphere.
/// - Children come after their parents, in order.
/// - Blocks replace portals, which bound their roots.
/// - The box is the one around all footprints.
/// - All values can be drawn.
///
/// Bounds may be off by the rounding of 32-bit numbers: 10⁻⁶ of a radius or a cosine, 10⁻³ of a
/// footprint.
pub fn validate(tree: &Tree) -> Vec<Finding> {
    let mut findings = Findings::default();
    if let Some(fault) = fault_of_box(tree.origin, &tree.bounds) {
        findings.push(Finding::error("bounds", "tree", fault));
    }
    if let Some(fault) = fault_of_extent(tree.extent) {
        findings.push(Finding::error("extent", "tree", fault));
    }
    if tree.blocks.is_empty() {
        findings.push(Finding::error("blocks", "tree", "it has no blocks"));
    }
    let mut footprints = Footprints::new(tree.extent);
    for (number, block) in tree.blocks.iter().enumerate() {
        let has_portals = number == 0 && tree.is_joined();
        check_block(number, &block.nodes, (!has_portals).then_some(&mut footprints), &mut findings);
    }
    footprints.check_box(tree.origin, &tree.bounds, "tree", &mut findings);
    if let Some((top, below)) = tree.blocks.split_first() {
        let roots = below.iter().map(|block| (block.portal, block.nodes.first()));
        check_portals(&top.nodes, top.portal, &roots.collect::<Vec<_>>(), &mut findings);
    }
    findings.finish()
}

/// The extent of the footprints of all leaves.
pub struct Footprints {
    /// End of footprints, in standard deviations.
    extent: f32,
    low: Vec3,
    high: Vec3,
    /// The largest distance from a footprint's centre to its end.
    widest: f32,
}

/// Tolerance for footprints. In 32 bits, the covariance of a disc determines its width to about
/// 10⁻⁴.
const ROUNDING: f32 = 1e-3;
/// Tolerance for the box, as fractions of its diagonal and of the widest footprint. Splats move and
/// widen when they are written with few bits.
const BOX: f64 = 0.01;
const BOX_OF_WIDEST: f64 = 0.5;

impl Footprints {
    pub fn new(extent: f32) -> Self {
        Self { extent, low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, widest: 0.0 }
    }

    /// Adds a leaf. Returns a message if its sphere is too small.
    fn add(&mut self, leaf: &Node) -> Option<String> {
        let (center, reach) =
            (Vec3::from(leaf.splat.center), self.extent * leaf.splat.deviations());
        (self.low, self.high) = (self.low.min(center - reach), self.high.max(center + reach));
        self.widest = self.widest.max(reach.max_element());
        let reach = self.extent * deviation(&leaf.splat);
        let needed = leaf.center().distance(center) + reach;
        (needed * (1.0 - ROUNDING) > leaf.radius).then(|| {
            format!(
                "its footprint reaches {needed} from its centre, but its sphere has radius {}",
                leaf.radius
            )
        })
    }

    /// Checks the stated box. Does nothing if there were no leaves.
    pub fn check_box(&self, origin: DVec3, stated: &Bounds, place: &str, findings: &mut Findings) {
        if !self.low.cmple(self.high).all() {
            return;
        }
        let actual = Bounds::between(origin, [self.low, self.high]);
        let most =
            BOX * actual.diagonal().max(stated.diagonal()) + BOX_OF_WIDEST * f64::from(self.widest);
        let off =
            (actual.min - stated.min).abs().max((actual.max - stated.max).abs()).max_element();
        if off > most {
            let [low, high, stated_low, stated_high] =
                [actual.min, actual.max, stated.min, stated.max];
            let message = format!(
                "footprints lie between {low} and {high}, but the box stated is from {stated_low} \
                 to {stated_high}"
            );
            findings.push(Finding::error("bounds", place, message));
        }
    }
}

/// Checks the nodes of a block and adds its leaves to `footprints`, which is `None` for a block of
/// portals.
pub fn check_block(
    number: usize,
    nodes: &[Node],
    mut footprints: Option<&mut Footprints>,
    findings: &mut Findings,
) {
    let place = |node: usize| format!("block {number}, node {node}");
    if let Err(message) = in_order(nodes) {
        findings.push(Finding::error("order", format!("block {number}"), message));
        return;
    }
    for (index, node) in nodes.iter().enumerate() {
        if let Some(fault) = fault(node) {
            findings.push(Finding::error("values", place(index), format!("it has {fault}")));
            continue;
        }
        let width = WIDTH * deviation(&node.splat);
        if width * (1.0 - ROUNDING) > node.size {
            let message = format!("its size is {}, but its splat is {width} wide", node.size);
            findings.push(Finding::error("size", place(index), message));
        }
        if let (true, Some(footprints)) = (node.is_leaf(), &mut footprints)
            && let Some(message) = footprints.add(node)
        {
            findings.push(Finding::error("sphere", place(index), message));
        }
        let first = node.first_child as usize;
        for (child, below) in nodes[first..first + node.children as usize].iter().enumerate() {
            bounds(node, below, || format!("block {number}, node {}", first + child), findings);
        }
    }
}

/// Checks that each portal has one block, and bounds its root.
pub fn check_portals(
    top: &[Node],
    own_portal: Option<u32>,
    roots: &[(Option<u32>, Option<&Node>)],
    findings: &mut Findings,
) {
    let mut portal = |message: String| findings.push(Finding::error("portal", "block 0", message));
    if let Some(number) = own_portal {
        portal(format!("it has the portal {number}; the block that joins others must have none"));
    }
    if roots.is_empty() {
        return;
    }
    let mut taken = vec![false; top.len()];
    for (number, (portal_of, _)) in roots.iter().enumerate() {
        let at =
            portal_of.map(|at| at as usize).filter(|&at| top.get(at).is_some_and(Node::is_leaf));
        match at {
            Some(at) if !taken[at] => taken[at] = true,
            Some(at) => portal(format!("two blocks have the portal {at}")),
            None => {
                portal(format!("block {} has the portal {portal_of:?}, not a leaf", number + 1));
            }
        }
    }
    for (index, _) in
        top.iter().enumerate().filter(|&(index, node)| node.is_leaf() && !taken[index])
    {
        portal(format!("no block has the portal {index}"));
    }
    for (number, (portal_of, root)) in roots.iter().enumerate() {
        if let (Some(node), Some(root)) = (portal_of.and_then(|at| top.get(at as usize)), root) {
            bounds(node, root, || format!("block {}, node 0", number + 1), findings);
        }
    }
}

/// The largest coordinate of a centre and element of a factor that can be drawn: their squares fit
/// in 32 bits.
const LARGEST: f32 = 1e18;

fn fits(values: &[f32]) -> bool {
    values.iter().all(|value| value.abs() <= LARGEST)
}

/// Returns whether the values of a splat can be drawn.
pub fn is_drawable(splat: &Splat) -> bool {
    fits(&splat.center)
        && fits(&splat.factor)
        && (0.0..=Splat::MOST_OPTICAL_DEPTH).contains(&splat.strength)
}

/// Returns a message if a node's own values cannot be drawn.
pub fn fault(node: &Node) -> Option<String> {
    let Node { splat, center, radius, size, cone, .. } = node;
    let is_length = |value: f32| value >= 0.0 && value.is_finite();
    if is_drawable(splat)
        && fits(center)
        && is_length(*radius)
        && is_length(*size)
        && (-1.0..=1.0).contains(cone)
    {
        return None;
    }
    let numbers = splat.center.iter().chain(&splat.factor).chain(center).chain([
        &splat.strength,
        radius,
        size,
        cone,
    ]);
    let most = Splat::MOST_OPTICAL_DEPTH;
    Some(if !numbers.copied().all(f32::is_finite) {
        "a value that is not finite".into()
    } else if !(0.0..=most).contains(&splat.strength) {
        format!("an optical depth of {}, but those from 0 to {most:e} can be drawn", splat.strength)
    } else if *radius < 0.0 || *size < 0.0 {
        format!("a radius of {radius} and a size of {size}")
    } else if !(-1.0..=1.0).contains(cone) {
        format!("a cone of cosine {cone}")
    } else {
        format!("a coordinate or an element of its factor beyond {LARGEST:e}")
    })
}

/// Returns a message if the origin or the bounds of a hierarchy are not valid.
pub fn fault_of_box(origin: DVec3, bounds: &Bounds) -> Option<&'static str> {
    let is_sound = origin.is_finite()
        && bounds.min.is_finite()
        && bounds.max.is_finite()
        && !bounds.is_empty();
    (!is_sound).then_some("its origin or its bounds are not valid")
}

/// Returns a message if the extent of footprints, in standard deviations, is not valid.
pub fn fault_of_extent(extent: f32) -> Option<String> {
    let most = Splat::MAX_EXTENT;
    let is_sound = extent > 0.0 && extent <= most;
    (!is_sound).then(|| format!("its extent is {extent}; it must lie in 0 … {most}"))
}

/// Checks that a node bounds a node below it.
fn bounds(node: &Node, below: &Node, place: impl Fn() -> String, findings: &mut Findings) {
    let center: DVec3 = node.center().as_dvec3();
    let (reach, radius) = (reach(center, below), f64::from(node.radius));
    if reach > radius * (1.0 + 1e-6) {
        let message = format!(
            "its sphere reaches {reach} from its parent's centre, but the parent's sphere has \
             radius {radius}"
        );
        findings.push(Finding::error("sphere", place(), message));
    }
    if below.size > node.size {
        let message = format!("its size is {}, but its parent's is {}", below.size, node.size);
        findings.push(Finding::error("size", place(), message));
    }
    if node.cone > -1.0 {
        // Leaves are checked by their normal alone. The first builds did not store the additional
        // width that a leaf's disc needs, and their files are sound.
        let cone = if below.is_leaf() && below.cone > -1.0 { 1.0 } else { below.cone };
        let wanted = libm::cos(joint_angle(node, &Node { cone, ..*below }));
        if f64::from(node.cone) > wanted + 1e-6 {
            let message = format!(
                "its cone needs a cosine of at most {wanted} around its parent's normal, but the \
                 parent's is {}",
                node.cone
            );
            findings.push(Finding::error("cone", place(), message));
        }
    }
}
