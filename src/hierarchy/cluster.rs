//! Which nodes become siblings: pairs found by obvhs, joined into groups of up to eight.

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

/// Builds the block above leaves with these boxes, of which there is at least one. All nodes are
/// complete except for their spheres. The root is a leaf only if there is a single box.
///
/// `leaf` and `mass` return the leaf and the mass for a box. The second result is the index of the
/// box for each leaf.
pub(super) fn cluster(
    boxes: &[Aabb],
    leaf: impl Fn(u32) -> Node,
    mass: impl Fn(u32) -> Mass,
    preset: Preset,
) -> (Block, Vec<u32>) {
    if boxes.len() == 1 {
        return (Block { nodes: vec![leaf(0)], ..Block::default() }, vec![0]);
    }
    let pairs = pairs(&apart(boxes), preset);
    let groups = groups(&pairs);
    let room = boxes.len() + boxes.len() / 4;
    let mut nodes: Vec<Node> = Vec::with_capacity(room);
    // The pair for each node, breadth first.
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
                    // A placeholder until the node is merged below.
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
    (Block { nodes, ..Block::default() }, sources)
}

/// The box by which a splat finds its neighbours. Its position counts, and its size where sizes
/// differ. Whole footprints overlap too much to distinguish neighbours.
pub(super) fn box_of(splat: &Splat) -> Aabb {
    let [xx, _, _, yy, _, zz] = covariance(&splat.factor);
    let (center, reach) = (Vec3::from(splat.center), 0.5 * WIDTH * (0.5 * (xx + yy + zz)).sqrt());
    Aabb::new((center - reach).into(), (center + reach).into())
}

/// Separates boxes with the same position and size if there are many of them. A nearest-neighbour
/// search cannot distinguish them; it would join one pair in each round, and the hierarchy would
/// become a chain.
///
/// They are placed in a row, spaced so that the members of each half, quarter and so on are nearer
/// to each other than to the rest.
fn apart(boxes: &[Aabb]) -> Cow<'_, [Aabb]> {
    let mut keys: Vec<u64> = boxes.iter().map(|aabb| mixed(key(aabb))).collect();
    // If few keys share their first bits, even fewer are equal.
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
    let mut copies: HashMap<[u32; 6], u64> = HashMap::new();
    let set_apart = |aabb: &Aabb| {
        let before = copies.entry(key(aabb)).or_default();
        let place: u64 =
            (0..u64::BITS - before.leading_zeros()).map(|level| (*before >> level) << level).sum();
        *before += 1;
        let width = (aabb.max.x - aabb.min.x) / 1024.0;
        // Far from the origin, the spacing of 32-bit numbers is wider than that.
        let step = width.max(aabb.max.x.abs().max(aabb.min.x.abs()) * 2f32.powi(-22));
        let shift = Vec3::X * (step * place as f32);
        Aabb::new((Vec3::from(aabb.min) + shift).into(), (Vec3::from(aabb.max) + shift).into())
    };
    Cow::Owned(boxes.iter().map(set_apart).collect())
}

/// The maximum number of equal boxes that does no harm.
const MOST_ALIKE: usize = 32;
/// Bits of a key that choose its bucket, in which keys are counted.
const BUCKET_BITS: u32 = 15;

/// All bits of a box.
fn key(aabb: &Aabb) -> [u32; 6] {
    [aabb.min.x, aabb.min.y, aabb.min.z, aabb.max.x, aabb.max.y, aabb.max.z]
        .map(|value| (value + 0.0).to_bits())
}

/// Hashes the bits into one number (Knuth 1973: by the golden ratio).
fn mixed(key: [u32; 6]) -> u64 {
    key.iter().fold(0, |sum: u64, &part| {
        (sum.rotate_left(21) ^ u64::from(part)).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    })
}

/// Builds a binary hierarchy over the boxes of leaves.
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

/// Decides which inner nodes of the binary hierarchy remain nodes. Each pair has a grade, by the
/// number of leaves below it ([`grade`]). Bottom-up, two pairs join while they have one grade and
/// contain at most eight items together. Otherwise they are closed, and count as one item each from
/// then on.
///
/// So the nodes of a level have similar sizes, and a view that needs one node of a page needs most
/// of the others. Closing small pairs would waste nodes, so a pair of one or two items stays open
/// where it can.
fn groups(pairs: &Bvh2) -> Vec<bool> {
    let mut items = vec![1u8; pairs.nodes.len()];
    let mut leaves = vec![1u32; pairs.nodes.len()];
    let mut closed = vec![false; pairs.nodes.len()];
    let sum = |counts: [u8; 2]| usize::from(counts[0] + counts[1]);
    for index in post_order(pairs) {
        let first = pairs.nodes[index as usize].first_index as usize;
        let halves = [first, first + 1];
        let mut counts = halves.map(|half| items[half]);
        leaves[index as usize] = leaves[first] + leaves[first + 1];
        let pair_grade = grade(leaves[index as usize]);
        let mut close = |side: usize, counts: &mut [u8; 2]| {
            closed[halves[side]] = true;
            counts[side] = 1;
        };
        for side in [0, 1] {
            if counts[side] > 2 && grade(leaves[halves[side]]) < pair_grade {
                close(side, &mut counts);
            }
        }
        if sum(counts) > MOST_CHILDREN {
            let larger = usize::from(counts[1] > counts[0]);
            for side in [larger, 1 - larger] {
                let is_small = counts[side] <= 2 && sum(counts) <= MOST_CHILDREN;
                if counts[side] > 1 && !is_small {
                    close(side, &mut counts);
                }
            }
        }
        items[index as usize] = sum(counts) as u8;
    }
    closed[0] = true;
    closed
}

/// Returns the grade of a pair of so many leaves: 0 up to 8 leaves, 1 up to 48, and so on by
/// factors of six.
fn grade(leaves: u32) -> u32 {
    let mut most = MOST_CHILDREN as u64;
    let mut grade = 0;
    while u64::from(leaves) > most {
        most *= 6;
        grade += 1;
    }
    grade
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

/// Collects the items of a closed pair, in order.
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

    /// The number of levels below the root.
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
