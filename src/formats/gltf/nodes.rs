//! Traverses the nodes of the default scene.

use crate::{Result, input::Source};
use ::gltf::json;
use glam::{DMat4, DQuat, DVec3};

/// A node to visit: its index, the transform of its parent, and its depth.
type Step = (usize, DMat4, usize);

/// Returns the meshes of the default scene, each with the transform from its own frame to the
/// world. Without a default scene it takes the first one; without scenes, all nodes. A node that is
/// reached twice (a cycle, or two parents) is an error, as is nesting over the limit.
pub(super) fn meshes(source: &Source, root: &json::Root) -> Result<Vec<(DMat4, usize)>> {
    let count = root.nodes.len();
    source.room::<[Step; 2]>("the nodes", count)?;
    let mut stack: Vec<Step> = Vec::new();
    let scene = root.scene.map_or(0, |scene| scene.value());
    match root.scenes.get(scene) {
        // A list may name the same node many times, so it may be longer than the number of nodes.
        Some(scene) => {
            source.room::<[Step; 2]>("the nodes of the scene", scene.nodes.len())?;
            stack.extend(scene.nodes.iter().rev().map(|node| (node.value(), DMat4::IDENTITY, 1)));
        }
        None if root.scene.is_some() => {
            return Err(source.error(
                "scene",
                format!("is {scene}, but there are {} scenes", root.scenes.len()),
            ));
        }
        None => {
            let mut is_child = vec![false; count];
            for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
                if let Some(flag) = is_child.get_mut(child.value()) {
                    *flag = true;
                }
            }
            stack.extend(
                (0..count)
                    .rev()
                    .filter(|&node| !is_child[node])
                    .map(|node| (node, DMat4::IDENTITY, 1)),
            );
        }
    }
    let mut met = vec![false; count];
    let mut meshes = Vec::new();
    while let Some((index, parent, depth)) = stack.pop() {
        source.check_time()?;
        let place = format!("node {index}");
        let Some(node) = root.nodes.get(index) else {
            return Err(source.error(place, format!("does not exist; there are {count} nodes")));
        };
        if std::mem::replace(&mut met[index], true) {
            return Err(source.error(place, "is its own ancestor, or has two parents"));
        }
        source.check_depth(&place, depth)?;
        let transform = parent * local(node);
        if let Some(mesh) = node.mesh {
            meshes.push((transform, mesh.value()));
        }
        source.room::<[Step; 2]>(
            "the nodes below a node",
            node.children.as_ref().map_or(0, Vec::len),
        )?;
        let children = node.children.iter().flatten().rev();
        stack.extend(children.map(|child| (child.value(), transform, depth + 1)));
    }
    Ok(meshes)
}

/// Returns the transform from a node's frame to its parent's.
fn local(node: &json::Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let scale = node.scale.unwrap_or([1.0; 3]).map(f64::from);
    let turn = node.rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |turn| turn.0).map(f64::from);
    let turn = DQuat::from_array(turn);
    let turn = if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY };
    let shift = node.translation.unwrap_or_default().map(f64::from);
    DMat4::from_scale_rotation_translation(DVec3::from_array(scale), turn, DVec3::from_array(shift))
}
