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
use std::{borrow::Cow, collections::HashMap};

/// The block above leaves that have these boxes: every node but for its sphere. `leaf` makes the leaf of a box. There is at
/// least one; the root is one only where it is the only one. `mass` tells the mass of a leaf. Also tells which box is behind each
/// leaf.
pub(super) fn cluster(
    boxes: &[Aabb],
    leaf: impl Fn(u32) -> Node,
    mass: impl Fn(u32) -> Mass,
    preset: Preset,
) -> (Block, Vec<u32>) {
    if boxes.len() == 1 {
        return (Block { nodes: vec![leaf(0)], portal: None }, vec![0]);
    }
    let pairs = pairs(&apart(boxes), preset);
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
    let mut masses = vec![mass(0); nodes.len()];
    for index in (0..nodes.len()).rev() {
        let Node { first_child, children, .. } = nodes[index];
        if children == 0 {
            masses[index] = mass(sources[index]);
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

/// Boxes of one place and size are set apart where there are many of them: a search for the nearest finds all the same there,
/// and would join one pair in a round, so that the hierarchy became a chain. In the row that they make, halves of halves are
/// ever nearer to each other.
fn apart(boxes: &[Aabb]) -> Cow<'_, [Aabb]> {
    let mut keys: Vec<u64> = boxes.iter().map(|own| mixed(key(own))).collect();
    // Where few have the same first bits, fewer have all of them.
    let mut counts = vec![0u8; 1 << BUCKET_BITS];
    let most = keys.iter().fold(0, |most: u8, key| {
        let count = &mut counts[(key >> (u64::BITS - BUCKET_BITS)) as usize];
        *count = count.saturating_add(1);
        most.max(*count)
    });
    if usize::from(most) <= MOST_ALIKE {
        return Cow::Borrowed(boxes);
    }
    keys.sort_unstable();
    if keys.len() <= MOST_ALIKE
        || !keys.windows(MOST_ALIKE + 1).any(|run| run[0] == run[MOST_ALIKE])
    {
        return Cow::Borrowed(boxes);
    }
    let mut found: HashMap<[u32; 6], u64> = HashMap::new();
    let set_apart = |own: &Aabb| {
        let before = found.entry(key(own)).or_default();
        let place: u64 =
            (0..u64::BITS - before.leading_zeros()).map(|level| (*before >> level) << level).sum();
        *before += 1;
        let width = (own.max.x - own.min.x) / 1024.0;
        // Far from the origin numbers of 32 bits are wider than that.
        let step = width.max(own.max.x.abs().max(own.min.x.abs()) * 2f32.powi(-22));
        let shift = Vec3::X * (step * place as f32);
        Aabb::new((Vec3::from(own.min) + shift).into(), (Vec3::from(own.max) + shift).into())
    };
    Cow::Owned(boxes.iter().map(set_apart).collect())
}

/// So many equal boxes do no harm.
const MOST_ALIKE: usize = 32;
/// Buckets in which boxes are counted.
const BUCKET_BITS: u32 = 15;

/// All bits of a box.
fn key(own: &Aabb) -> [u32; 6] {
    [own.min.x, own.min.y, own.min.z, own.max.x, own.max.y, own.max.z]
        .map(|value| (value + 0.0).to_bits())
}

/// The bits in one number (Knuth 1973: by the golden ratio).
fn mixed(key: [u32; 6]) -> u64 {
    key.iter().fold(0, |sum: u64, &part| {
        (sum.rotate_left(21) ^ u64::from(part)).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    })
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
                let is_small =
                    counts[side] <= 2 && usize::from(counts[0] + counts[1]) <= MOST_CHILDREN;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splat::NO_NORMAL;

    /// Levels below the root.
    fn depth(nodes: &[Node]) -> u32 {
        let mut heights = vec![0; nodes.len()];
        for (index, node) in nodes.iter().enumerate().rev().filter(|(_, node)| !node.is_leaf()) {
            let first = node.first_child as usize;
            heights[index] =
                1 + heights[first..first + node.children as usize].iter().max().unwrap_or(&0);
        }
        heights[0]
    }

    #[test]
    fn equal_splats_make_no_chain() {
        for at in [0.0, 1e6, 1e30] {
            let splat = Splat {
                center: [at, 0.0, 0.0],
                strength: 1.0,
                factor: [1.0, 0.0, 1.0, 0.0, 0.0, 1.0],
                color: u32::MAX,
                normal: NO_NORMAL,
            };
            let leaf = |_| Node {
                splat,
                center: splat.center,
                radius: 1.0,
                size: 1.0,
                cone: -1.0,
                first_child: 0,
                children: 0,
            };
            let (block, sources) =
                cluster(&vec![box_of(&splat); 8000], leaf, |_| Mass::of(&splat), Preset::Balanced);
            assert!(depth(&block.nodes) <= 16, "{} levels of 8000 at {at}", depth(&block.nodes));
            assert_eq!(sources.len(), block.nodes.len());
        }
    }
}
