//! How exactly a hierarchy's file keeps its splats, and in how many bytes.

use crate::report::{Cell, Table};
use glam::{DVec3, Vec3};
use splatkit::{
    hierarchy::{
        Node, Tree,
        file::{Hierarchy, WriteOptions, to_bytes},
    },
    input::Limits,
    splat::decode_normal,
};
use std::path::Path;

/// Number of leaves that are compared.
const SAMPLE: usize = 1000;
/// Number of neighbours whose mean distance is the spacing.
const NEIGHBOURS: usize = 6;

pub fn table() -> Table {
    Table::new(
        "Files.",
        format!(
            "Bytes of the file per point of the source and per splat; nodes per leaf; the error of \
             a leaf's position as a share of the spacing (the mean distance of {NEIGHBOURS} \
             neighbours), of its normal in degrees, and the factor on its radius, each for \
             {SAMPLE} leaves: the mean, the largest, and the bound that 99 of 100 positions keep; \
             the radius of the root over that of the smallest sphere."
        ),
        &[
            "model",
            "points",
            "splats",
            "bytes a point",
            "a splat",
            "nodes a leaf",
            "place, mean",
            "99 %",
            "largest",
            "normal, mean",
            "largest",
            "radius, mean",
            "largest",
            "root",
        ],
    )
}

/// Writes a tree, reads it back, and compares.
pub fn row(tree: &Tree) -> splatkit::Result<(Hierarchy, Vec<Cell>)> {
    let bytes = to_bytes(tree, &WriteOptions::default())?;
    let length = bytes.len() as f64;
    let hierarchy = Hierarchy::from_bytes(bytes, Path::new("memory"), &Limits::default())?;
    let read = hierarchy.read_tree()?;
    let leaves: Vec<&Node> = tree.nodes().filter(|node| node.is_leaf()).collect();
    let kept: Vec<&Node> = read.nodes().filter(|node| node.is_leaf()).collect();
    let count = leaves.len() as f64;
    let places: Vec<Vec3> = leaves.iter().map(|leaf| Vec3::from(leaf.splat.center)).collect();
    let sample: Vec<usize> = (0..leaves.len()).step_by((leaves.len() / SAMPLE).max(1)).collect();
    let pairs: Vec<(&Node, &Node)> =
        sample.iter().map(|&index| (leaves[index], nearest(leaves[index], &kept))).collect();
    let error = |(&index, (_, read)): (&usize, &(&Node, &Node))| {
        f64::from(Vec3::from(read.splat.center).distance(places[index])) / spacing(&places, index)
    };
    let mut errors: Vec<f64> = sample.iter().zip(&pairs).map(error).collect();
    errors.sort_by(f64::total_cmp);
    let angle = |(a, b): &(&Node, &Node)| match (
        decode_normal(a.splat.normal),
        decode_normal(b.splat.normal),
    ) {
        (Some(a), Some(b)) => 2.0 * f64::from(a.distance(b) * 0.5).asin().to_degrees(),
        _ => 0.0,
    };
    let radius = |(a, b): &(&Node, &Node)| f64::from(b.radius / a.radius);
    let mean = |of: &dyn Fn(&(&Node, &Node)) -> f64| {
        pairs.iter().map(of).sum::<f64>() / pairs.len() as f64
    };
    let largest = |of: &dyn Fn(&(&Node, &Node)) -> f64| pairs.iter().map(of).fold(0.0, f64::max);
    let root = f64::from(read.blocks[0].nodes[0].radius) / smallest_sphere(&leaves);
    let cells = vec![
        Cell::Number(tree.source_points as f64, 0),
        Cell::Number(count, 0),
        Cell::Number(length / tree.source_points as f64, 2),
        Cell::Number(length / count, 2),
        Cell::Number(read.nodes().count() as f64 / count, 3),
        Cell::Number(errors.iter().sum::<f64>() / errors.len() as f64, 4),
        Cell::Number(errors[errors.len() * 99 / 100], 4),
        Cell::Number(errors[errors.len() - 1], 4),
        Cell::Number(mean(&angle), 3),
        Cell::Number(largest(&angle), 3),
        Cell::Number(mean(&radius), 4),
        Cell::Number(largest(&radius), 4),
        Cell::Number(root, 4),
    ];
    Ok((hierarchy, cells))
}

/// Returns the leaf that was read for `leaf`. Writing changes the order of siblings, so the nearest
/// leaf is the one. Splats of one vertex share their position and differ in direction and size.
fn nearest<'a>(leaf: &Node, kept: &[&'a Node]) -> &'a Node {
    let (place, normal) = (Vec3::from(leaf.splat.center), decode_normal(leaf.splat.normal));
    let mut best = (f32::INFINITY, kept[0]);
    for other in kept {
        let apart = place.distance(other.splat.center.into());
        if apart < best.0 {
            let turned =
                normal.zip(decode_normal(other.splat.normal)).map_or(0.0, |(a, b)| a.distance(b));
            let distance = apart + 0.2 * (leaf.size * turned + (leaf.size - other.size).abs());
            if distance < best.0 {
                best = (distance, other);
            }
        }
    }
    best.1
}

/// Returns the mean distance of the nearest neighbours that are not at the same position.
fn spacing(places: &[Vec3], index: usize) -> f64 {
    let mut nearest = [f32::INFINITY; NEIGHBOURS];
    for place in places {
        let distance = place.distance_squared(places[index]);
        if distance > 0.0 && distance < nearest[NEIGHBOURS - 1] {
            let at = nearest.partition_point(|&other| other < distance);
            nearest[at..].rotate_right(1);
            nearest[at] = distance;
        }
    }
    nearest.iter().filter(|d| d.is_finite()).map(|d| f64::from(d.sqrt())).sum::<f64>()
        / NEIGHBOURS as f64
}

/// Approximates, by many small steps, the radius of the smallest sphere around the leaves' original
/// spheres.
fn smallest_sphere(leaves: &[&Node]) -> f64 {
    let spheres: Vec<(DVec3, f64)> = leaves
        .iter()
        .map(|leaf| (Vec3::from(leaf.center).as_dvec3(), f64::from(leaf.radius)))
        .collect();
    let mut center = spheres.iter().map(|sphere| sphere.0).sum::<DVec3>() / spheres.len() as f64;
    let mut best = f64::INFINITY;
    for round in 0..1000 {
        let reach = |sphere: &&(DVec3, f64)| sphere.0.distance(center) + sphere.1;
        let Some(far) = spheres.iter().max_by(|a, b| reach(a).total_cmp(&reach(b))) else { break };
        best = best.min(reach(&far));
        center += (far.0 - center) / f64::from(round + 2);
    }
    best
}
