//! Which nodes become siblings: pairs found by obvhs, joined to groups of up to eight.

use super::{
    Block, MOST_CHILDREN, Node, Preset,
    merge::{Mass, WIDTH, covariance, merge},
};
use crate::splat::Splat;
use glam::Vec3;
use obvhs::{
    aabb::Aabb,
    bvh2::Bvh2,
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

/// The block above leaves that have these boxes: every node but for its sphere. `leaf` makes the leaf of a box. There is at
/// least one; the root is one only where it is the only one. Also tells which box is behind each leaf.
pub(super) fn cluster(boxes: &[Aabb], leaf: impl Fn(u32) -> Node, preset: Preset) -> (Block, Vec<u32>) {
    if boxes.len() == 1 {
        return (Block { nodes: vec![leaf(0)], portal: None }, vec![0]);
    }
    let pairs = pairs(boxes, preset);
    let groups = groups(&pairs);
    let room = boxes.len() + boxes.len() / 4;
    let mut nodes: Vec<Node> = Vec::with_capacity(room);
    // The pair behind each node, breadth first.
    let mut order = Vec::with_capacity(room);
    order.push(0u32);
    let blank = leaf(0);
    nodes.push(blank);
    let mut sources = vec![0];
    let mut next = 0;
    let mut items = Vec::with_capacity(MOST_CHILDREN);
    while next < order.len() {
        let at = order[next] as usize;
        if !pairs.nodes[at].is_leaf() {
            items.clear();
            gather(&pairs, &groups, at, &mut items);
            nodes[next].first_child = order.len() as u32;
            nodes[next].children = items.len() as u32;
            for &item in &items {
                let pair = &pairs.nodes[item as usize];
                if pair.is_leaf() {
                    let source = pairs.primitive_indices[pair.first_index as usize];
                    nodes.push(leaf(source));
                    sources.push(source);
                } else {
                    // Its place is taken by what is made below.
                    nodes.push(blank);
                    sources.push(0);
                }
                order.push(item);
            }
        }
        next += 1;
    }
    let mut masses = vec![Mass::of(&blank.splat); nodes.len()];
    for index in (0..nodes.len()).rev() {
        let Node { first_child, children, .. } = nodes[index];
        if children == 0 {
            masses[index] = Mass::of(&nodes[index].splat);
            continue;
        }
        let range = first_child as usize..(first_child + children) as usize;
        let (node, mass) = merge(&nodes[range.clone()], &masses[range]);
        nodes[index] = Node { first_child, ..node };
        masses[index] = mass;
    }
    (Block { nodes, portal: None }, sources)
}

/// The box by which a splat finds its neighbours: its place counts, and its size where sizes differ; whole footprints
/// overlap too much to tell neighbours.
pub(super) fn box_of(splat: &Splat) -> Aabb {
    let [xx, _, _, yy, _, zz] = covariance(&splat.factor);
    let (center, reach) = (Vec3::from(splat.center), 0.5 * WIDTH * (0.5 * (xx + yy + zz)).sqrt());
    Aabb::new((center - reach).into(), (center + reach).into())
}

/// A binary hierarchy over the leaves' boxes.
fn pairs(boxes: &[Aabb], preset: Preset) -> Bvh2 {
    let (distance, threshold) = match preset {
        Preset::Fastest => (PlocSearchDistance::Minimum, 0),
        Preset::Fast => (PlocSearchDistance::VeryLow, 2),
        Preset::Balanced => (PlocSearchDistance::Low, 2),
        Preset::Slow => (PlocSearchDistance::Medium, 1),
        Preset::Best => (PlocSearchDistance::VeryHigh, 0),
    };
    let indices = (0..boxes.len() as u32).collect();
    PlocBuilder::new().build(distance, boxes, indices, SortPrecision::U64, threshold)
}

/// Which inner nodes of the binary hierarchy stay nodes: bottom-up, two pairs join while they hold at most eight items
/// together; else both are closed, and count as one item each from then on. (Closing small ones would waste nodes, so a pair
/// of one or two items stays open.)
fn groups(pairs: &Bvh2) -> Vec<bool> {
    let mut items = vec![1u8; pairs.nodes.len()];
    let mut closed = vec![false; pairs.nodes.len()];
    for index in post_order(pairs) {
        let node = &pairs.nodes[index as usize];
        let first = node.first_index as usize;
        let halves = [first, first + 1];
        let mut counts = halves.map(|half| items[half]);
        if usize::from(counts[0] + counts[1]) > MOST_CHILDREN {
            let larger = usize::from(counts[1] > counts[0]);
            for side in [larger, 1 - larger] {
                let is_small = counts[side] <= 2 && usize::from(counts[0] + counts[1]) <= MOST_CHILDREN;
                if counts[side] > 1 && !is_small {
                    closed[halves[side]] = true;
                    counts[side] = 1;
                }
            }
        }
        items[index as usize] = counts[0] + counts[1];
    }
    closed[0] = true;
    closed
}

/// The inner nodes, children before their parents.
fn post_order(pairs: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(pairs.nodes.len() / 2);
    let mut open = vec![0u32];
    while let Some(index) = open.pop() {
        let node = &pairs.nodes[index as usize];
        if !node.is_leaf() {
            order.push(index);
            open.extend([node.first_index, node.first_index + 1]);
        }
    }
    order.reverse();
    order
}

/// The items of a closed pair, in order.
fn gather(pairs: &Bvh2, closed: &[bool], at: usize, items: &mut Vec<u32>) {
    let first = pairs.nodes[at].first_index;
    for half in [first, first + 1] {
        if closed[half as usize] || pairs.nodes[half as usize].is_leaf() {
            items.push(half);
        } else {
            gather(pairs, closed, half as usize, items);
        }
    }
}
