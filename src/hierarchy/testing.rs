//! Sound trees for tests, built in the simplest way.

use super::{Block, Node, Tree, file};
use crate::{
    math::{Bounds, eigen},
    splat::{NO_NORMAL, Splat, Surfels, decode_normal, encode_normal},
};
use glam::{DMat3, DVec3, Vec3};

/// A reproducible pseudo-random sequence.
pub struct Random(pub u64);

impl Random {
    /// Returns a number in 0..1.
    pub fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn below(&mut self, end: usize) -> usize {
        (self.next() * end as f64) as usize
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let place = DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0;
            if (0.01..1.0).contains(&place.length_squared()) {
                return place.normalize();
            }
        }
    }
}

pub const EXTENT: f32 = 3.0;

/// Returns the lower triangular factor of axes · diag(σ²) · axesᵀ.
pub fn factor(axes: [DVec3; 3], sigma: [f64; 3]) -> [f32; 6] {
    let columns = [axes[0] * sigma[0], axes[1] * sigma[1], axes[2] * sigma[2]];
    let sum = |i: usize, j: usize| columns.iter().map(|c| c[i] * c[j]).sum::<f64>();
    let b00 = sum(0, 0).sqrt();
    let (b10, b20) = (sum(1, 0) / b00, sum(2, 0) / b00);
    let b11 = (sum(1, 1) - b10 * b10).sqrt();
    let b21 = (sum(2, 1) - b20 * b10) / b11;
    [b00, b10, b11, b20, b21, (sum(2, 2) - b20 * b20 - b21 * b21).sqrt()].map(|value| value as f32)
}

/// Returns B·Bᵀ.
pub fn covariance(splat: &Splat) -> DMat3 {
    let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
    let b = DMat3::from_cols(
        DVec3::new(b00, b10, b20),
        DVec3::new(0.0, b11, b21),
        DVec3::new(0.0, 0.0, b22),
    );
    b * b.transpose()
}

/// Returns the standard deviations, descending, and the axes.
pub fn ellipsoid(splat: &Splat) -> ([f64; 3], [DVec3; 3]) {
    let (squares, axes) = eigen(covariance(splat));
    (squares.map(f64::sqrt), axes)
}

/// Returns `count` surfels of a smooth closed surface with waves, evenly spread.
pub fn surface(count: usize, seed: u64) -> Vec<Splat> {
    let mut random = Random(seed);
    let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let height =
        |d: DVec3| 1.0 + 0.1 * (5.0 * d.x).sin() * (4.0 * d.y).cos() + 0.03 * (11.0 * d.z).sin();
    let spacing = (4.0 * std::f64::consts::PI / count as f64).sqrt();
    let splat = |index: usize| {
        let z = 1.0 - (2 * index + 1) as f64 / count as f64;
        let (sine, cosine) = (turn * index as f64).sin_cos();
        let round = (1.0 - z * z).sqrt();
        let jitter = random.direction() * (0.25 * spacing);
        let direction = (DVec3::new(round * cosine, round * sine, z) + jitter).normalize();
        let place = |d: DVec3| d * height(d);
        let (x, y) = direction.any_orthonormal_pair();
        let step = 1e-4;
        let [along_x, along_y] =
            [x, y].map(|t| place((direction + t * step).normalize()) - place(direction));
        let normal = along_x.cross(along_y).normalize();
        let normal = decode_normal(encode_normal(normal.as_vec3())).unwrap().as_dvec3();
        let (u, v) = normal.any_orthonormal_pair();
        let (sine, cosine) = (random.next() * std::f64::consts::PI).sin_cos();
        let axes = [u * cosine + v * sine, v * cosine - u * sine, normal];
        let large = spacing * (0.42 + 0.1 * random.next());
        let small = large * (0.6 + 0.4 * random.next());
        let shade = |value: f64| (127.0 + 100.0 * value) as u32;
        let tint =
            [(3.0 * direction.x).sin(), (4.0 * direction.y).sin(), (5.0 * direction.z).sin()]
                .map(shade);
        Splat {
            center: place(direction).as_vec3().to_array(),
            strength: 8.0,
            factor: factor(axes, [large, small, 0.12 * small]),
            color: tint[0] | tint[1] << 8 | tint[2] << 16 | 255 << 24,
            normal: encode_normal(normal.as_vec3()),
        }
    };
    (0..count).map(splat).collect()
}

/// Returns ellipsoids of all shapes in a ball, some without normals.
pub fn cloud(count: usize, seed: u64) -> Vec<Splat> {
    let mut random = Random(seed);
    let splat = |_| {
        let first = random.direction();
        let second = first.cross(random.direction()).normalize();
        let size = 0.01 * (random.next() * 3.0).exp();
        let sigma =
            [size, size * (0.05 + 0.95 * random.next()), size * (0.05 + 0.95 * random.next())];
        let normal = if random.next() < 0.2 {
            NO_NORMAL
        } else {
            encode_normal(random.direction().as_vec3())
        };
        Splat {
            center: (random.direction() * random.next()).as_vec3().to_array(),
            strength: (0.01 + 5.0 * random.next()) as f32,
            factor: factor([first, second, first.cross(second)], sigma),
            color: random.below(1 << 32) as u32,
            normal,
        }
    };
    (0..count).map(splat).collect()
}

/// Returns a leaf, as builders make it.
pub fn leaf(splat: Splat) -> Node {
    let largest = ellipsoid(&splat).0[0];
    Node {
        splat,
        center: splat.center,
        radius: (f64::from(EXTENT) * largest * 1.000_001) as f32,
        size: (2.355 * largest) as f32,
        cone: if splat.normal == NO_NORMAL { -1.0 } else { 1.0 },
        first_child: 0,
        children: 0,
    }
}

enum Branch {
    Leaf(Node),
    Inner(Node, Vec<Branch>),
}

impl Branch {
    fn node(&self) -> &Node {
        match self {
            Self::Leaf(node) | Self::Inner(node, _) => node,
        }
    }
}

/// Builds a block over leaves. Groups are halved along their longest side until there are up to
/// eight, then each is treated the same way.
pub fn grow(mut leaves: Vec<Node>) -> Vec<Node> {
    let root = branch(&mut leaves);
    let mut nodes = vec![*root.node()];
    let mut queue = std::collections::VecDeque::from([(0, root)]);
    while let Some((index, branch)) = queue.pop_front() {
        if let Branch::Inner(_, children) = branch {
            nodes[index].first_child = nodes.len() as u32;
            nodes[index].children = children.len() as u32;
            for child in children {
                queue.push_back((nodes.len(), child));
                let node = queue.back().expect("was pushed").1.node();
                nodes.push(Node { first_child: 0, children: 0, ..*node });
            }
        }
    }
    file::enclose(&mut nodes);
    nodes
}

fn branch(leaves: &mut [Node]) -> Branch {
    if let [leaf] = leaves {
        return Branch::Leaf(*leaf);
    }
    let node = merge(leaves);
    let count = leaves.len();
    let mut groups = vec![leaves];
    // Not every node has the maximum number of children.
    let most = if count <= 8 { 8 } else { 4 + (node.splat.center[0].to_bits() % 5) as usize };
    while groups.len() < most {
        let Some(largest) =
            (0..groups.len()).filter(|&g| groups[g].len() > 1).max_by_key(|&g| groups[g].len())
        else {
            break;
        };
        let group = groups.swap_remove(largest);
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) =
            group.iter().fold(none, |(low, high), n| (low.min(n.center()), high.max(n.center())));
        let axis = (high - low).max_position();
        group.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        let (left, right) = group.split_at_mut(group.len() / 2);
        groups.extend([left, right]);
    }
    Branch::Inner(node, groups.into_iter().map(branch).collect())
}

/// Merges the moments of leaves into one splat. Bounds are added later.
fn merge(leaves: &[Node]) -> Node {
    let count = leaves.len() as f64;
    let place = |node: &Node| Vec3::from(node.splat.center).as_dvec3();
    let center = leaves.iter().map(place).sum::<DVec3>() / count;
    let mut sum = DMat3::ZERO;
    for leaf in leaves {
        let away = place(leaf) - center;
        sum +=
            covariance(&leaf.splat) + DMat3::from_cols(away * away.x, away * away.y, away * away.z);
    }
    let (squares, axes) = eigen(sum * (1.0 / count));
    let sigma = squares.map(f64::sqrt);
    let normals: Option<Vec<Vec3>> =
        leaves.iter().map(|leaf| decode_normal(leaf.splat.normal)).collect();
    let normal = normals.map_or(NO_NORMAL, |normals| {
        encode_normal(normals.iter().sum::<Vec3>().normalize_or_zero())
    });
    let mean = |shift: u32| {
        let sum: u64 = leaves.iter().map(|leaf| u64::from(leaf.splat.color >> shift & 255)).sum();
        ((sum / leaves.len() as u64) as u32) << shift
    };
    let splat = Splat {
        center: center.as_vec3().to_array(),
        strength: leaves.iter().map(|leaf| leaf.splat.strength).sum::<f32>() / count as f32,
        factor: factor(axes, sigma),
        color: mean(0) | mean(8) | mean(16) | mean(24),
        normal,
    };
    let cone = if normal == NO_NORMAL { -1.0 } else { 1.0 };
    Node { size: (2.355 * sigma[0]) as f32, cone, radius: 0.0, ..leaf(splat) }
}

/// Builds a tree of one block.
pub fn tree(splats: &[Splat]) -> Tree {
    let nodes = grow(splats.iter().copied().map(leaf).collect());
    whole(vec![Block { nodes, ..Block::default() }], splats.len())
}

/// Builds a tree of `count` blocks below one that joins them.
pub fn joined(splats: &[Splat], count: usize) -> Tree {
    let mut leaves: Vec<Node> = splats.iter().copied().map(leaf).collect();
    leaves.sort_by(|a, b| a.center[0].total_cmp(&b.center[0]));
    let below: Vec<Vec<Node>> =
        leaves.chunks(leaves.len().div_ceil(count)).map(|part| grow(part.to_vec())).collect();
    let portal = |nodes: &Vec<Node>| Node { first_child: 0, children: 0, ..nodes[0] };
    let top = grow(below.iter().map(portal).collect());
    let portal_of = |nodes: &Vec<Node>| {
        let place = top.iter().position(|node| node.is_leaf() && node.splat == nodes[0].splat);
        place.map(|place| place as u32)
    };
    let portals: Vec<Option<u32>> = below.iter().map(portal_of).collect();
    let below =
        below.into_iter().zip(portals).map(|(nodes, portal)| Block { nodes, portal, colors: None });
    whole(
        std::iter::once(Block { nodes: top.clone(), ..Block::default() }).chain(below).collect(),
        splats.len(),
    )
}

fn whole(blocks: Vec<Block>, points: usize) -> Tree {
    let origin = DVec3::new(4e5, -2e6, 30.0);
    let bounds = Bounds { min: origin, max: origin };
    let mut tree =
        Tree { origin, extent: EXTENT, closed: true, bounds, source_points: points as u64, blocks };
    let splats = tree.nodes().filter(|node| node.is_leaf()).map(|node| node.splat).collect();
    tree.bounds = Surfels { origin, splats, extent: EXTENT }.bounds();
    tree
}
