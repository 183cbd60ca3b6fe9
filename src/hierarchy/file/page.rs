//! Pages as bytes: which code each has, and how a block becomes pages.

use super::{
    lossless,
    pages::{Run, reach, round_up},
};
use crate::{hierarchy::Node, splat::decode_normal};
use rayon::prelude::*;

/// The first byte of a page.
const LOSSLESS: u8 = 0;

/// A block in pages, and its nodes as these will be read.
pub struct Coded {
    pub nodes: Vec<Node>,
    pub pages: Vec<Vec<u8>>,
}

/// Encodes a block whose nodes are in order.
pub fn encode(nodes: &[Node], runs: &[Run], _extent: f32, _is_lossless: bool) -> Coded {
    let page = |run: &Run| {
        let mut out = vec![LOSSLESS];
        out.extend(lossless::encode(&nodes[run.nodes.clone()]));
        out
    };
    Coded { nodes: nodes.to_vec(), pages: runs.par_iter().map(page).collect() }
}

/// The nodes of a page of `count`, the children of the first of which stand at `first_child`; or what is wrong with it.
pub fn decode(bytes: &[u8], count: usize, first_child: u32, _extent: f32) -> Result<Vec<Node>, String> {
    let (&code, rest) = bytes.split_first().ok_or("it is empty")?;
    let nodes = match code {
        LOSSLESS => lossless::decode(rest, count)?,
        other => return Err(format!("it has the unknown code {other}")),
    };
    let mut next = first_child;
    for (index, node) in nodes.iter().enumerate() {
        if !is_finite(node) {
            return Err(format!("its node {index} has a value that is not finite"));
        }
        let wanted = if node.is_leaf() { 0 } else { next };
        if node.first_child != wanted {
            return Err(format!("the children of its node {index} stand at {}, not at {wanted}", node.first_child));
        }
        next = next.checked_add(node.children).ok_or("it has more children than can be numbered")?;
    }
    Ok(nodes)
}

/// Whether all numbers of a node are.
pub fn is_finite(node: &Node) -> bool {
    let Node { splat, center, radius, size, cone, .. } = node;
    let numbers = splat.center.iter().chain(&splat.factor).chain(center).chain([&splat.strength, radius, size, cone]);
    numbers.copied().all(f32::is_finite)
}

/// Grows the nodes of a block, from below, until each bounds its children: sphere, size and cone.
pub fn enclose(nodes: &mut [Node]) {
    for index in (0..nodes.len()).rev() {
        if nodes[index].is_leaf() {
            continue;
        }
        let first = nodes[index].first_child as usize;
        let (above, below) = nodes.split_at_mut(first);
        let node = &mut above[index];
        let children = &below[..node.children as usize];
        let center = node.center().as_dvec3();
        node.radius = children.iter().map(|child| round_up(reach(center, child))).fold(node.radius, f32::max);
        node.size = children.iter().map(|child| child.size).fold(node.size, f32::max);
        let cone = children.iter().map(|child| cosine_below(joint_angle(node, child))).fold(node.cone, f32::min);
        node.cone = cone;
    }
}

/// The half-angle of the cone around the normal of a node that holds a child's; π where there is none.
pub fn joint_angle(node: &Node, child: &Node) -> f64 {
    let normals = (decode_normal(node.splat.normal), decode_normal(child.splat.normal));
    let (Some(own), Some(its)) = normals else { return std::f64::consts::PI };
    if child.cone <= -1.0 {
        return std::f64::consts::PI;
    }
    let (own, its) = (own.as_dvec3(), its.as_dvec3());
    let between = libm::atan2(own.cross(its).length(), own.dot(its));
    (between + libm::acos(f64::from(child.cone).min(1.0))).min(std::f64::consts::PI)
}

/// The cosine of a half-angle, never above it.
fn cosine_below(angle: f64) -> f32 {
    if angle >= std::f64::consts::PI {
        return -1.0;
    }
    let cosine = libm::cos(angle) - 1e-9;
    let near = cosine as f32;
    if f64::from(near) > cosine { near.next_down() } else { near }
}
