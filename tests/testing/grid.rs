//! A hierarchy of many blocks: one splat at each point of a grid.

use glam::DVec3;
use splatkit::{
    hierarchy::{Block, Node, Tree},
    math::Bounds,
    splat::{NO_NORMAL, Splat},
};

/// End of footprints, in standard deviations.
const EXTENT: f32 = 3.0;

/// The number of nodes above a level.
fn above(level: u32) -> u32 {
    (8u32.pow(level) - 1) / 7
}

/// Half the distance of nodes of a level.
fn half(level: u32) -> f32 {
    0.5f32.powi(level as i32 + 1)
}

/// The radius of a node's sphere, in a tree of these levels.
fn radius(level: u32, levels: u32) -> f32 {
    match level == levels {
        true => EXTENT * half(level) * 1.001,
        false => (radius(level + 1, levels) + 0.5 * half(level) * 3f32.sqrt()) * 1.000_01,
    }
}

fn node(level: u32, number: u32, levels: u32) -> Node {
    let bits = |axis: u32| (0..level).map(|bit| (number >> (3 * bit + axis) & 1) << bit).sum();
    let center = [0, 1, 2].map(bits).map(|at: u32| (2 * at + 1) as f32 * half(level));
    let sigma = half(level);
    let splat = Splat {
        center,
        strength: 1.0,
        factor: [sigma, 0.0, sigma, 0.0, 0.0, sigma],
        color: u32::MAX,
        normal: NO_NORMAL,
    };
    let is_leaf = level == levels;
    Node {
        splat,
        center,
        radius: radius(level, levels),
        size: 2.36 * sigma,
        cone: -1.0,
        first_child: if is_leaf { 0 } else { above(level + 1) + 8 * number },
        children: if is_leaf { 0 } else { 8 },
    }
}

/// Returns a tree of 8 to the power of `levels` blocks.
pub fn grid(levels: u32) -> Tree {
    let count = 8u32.pow(levels);
    let top = (0..=levels).flat_map(|level| (0..8u32.pow(level)).map(move |at| (level, at)));
    let nodes = top.map(|(level, number)| node(level, number, levels)).collect();
    let below = (0..count).map(|number| Block {
        nodes: vec![node(levels, number, levels)],
        portal: Some(above(levels) + number),
        colors: None,
    });
    let reach = f64::from((EXTENT - 1.0) * half(levels));
    Tree {
        origin: DVec3::ZERO,
        extent: EXTENT,
        closed: false,
        bounds: Bounds { min: DVec3::splat(-reach), max: DVec3::splat(1.0 + reach) },
        source_points: u64::from(count),
        blocks: std::iter::once(Block { nodes, ..Block::default() }).chain(below).collect(),
    }
}
