//! Traverses the nodes of the default scene.

use super::buffers::Buffers;
use crate::{Result, input::Source};
use ::gltf::json;
use glam::{DMat4, DQuat, DVec3};

/// A node to visit: its index, the transform of its parent, and its depth.
type Step = (usize, DMat4, usize);

/// Returns the meshes of the default scene, each with the transform from its own frame to the
/// world. A mesh with instances is listed once for each. Without a default scene it takes the first
/// one; without scenes, all nodes. A node that is reached twice (a cycle, or two parents) is an
/// error, as is nesting over the limit.
pub(super) fn meshes(
    source: &Source,
    root: &json::Root,
    buffers: &Buffers,
) -> Result<Vec<(DMat4, usize)>> {
    let count = root.nodes.len();
    source.room::<[Step; 2]>("the nodes", count)?;
    let mut stack = roots(source, root)?;
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
            match instances(source, buffers, node, &place)? {
                None => meshes.push((transform, mesh.value())),
                Some(instances) => {
                    let placed = instances.into_iter().map(|instance| transform * instance);
                    meshes.extend(placed.map(|transform| (transform, mesh.value())));
                }
            }
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

/// Returns the nodes to begin with, the first one last.
fn roots(source: &Source, root: &json::Root) -> Result<Vec<Step>> {
    let count = root.nodes.len();
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
    Ok(stack)
}

/// Returns the transforms of a node's instances (EXT_mesh_gpu_instancing); `None` if it has none of
/// its own.
fn instances(
    source: &Source,
    buffers: &Buffers,
    node: &json::Node,
    place: &str,
) -> Result<Option<Vec<DMat4>>> {
    const NAME: &str = "EXT_mesh_gpu_instancing";
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
    let Some(extension) = extension else { return Ok(None) };
    let place = format!("{place}, {NAME}");
    let accessor = |name: &str| {
        let index =
            extension.get("attributes").and_then(|attributes| attributes.get(name))?.as_u64()?;
        usize::try_from(index).ok()
    };
    let three = |name: &str| -> Result<Option<Vec<[f32; 3]>>> {
        accessor(name).map(|index| buffers.floats(index, &place, true)).transpose()
    };
    let shifts = three("TRANSLATION")?;
    let scales = three("SCALE")?;
    let turns: Option<Vec<[f32; 4]>> =
        accessor("ROTATION").map(|index| buffers.floats(index, &place, true)).transpose()?;
    let counts = [
        shifts.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
        turns.as_ref().map(Vec::len),
    ];
    let Some(count) = counts.iter().flatten().max().copied() else { return Ok(None) };
    if counts.iter().flatten().any(|other| *other != count) {
        return Err(source.error(place, "has attributes of different counts"));
    }
    source.room::<(DMat4, usize)>("the instances", count)?;
    let one = |index: usize| {
        let of = |list: &Option<Vec<[f32; 3]>>, default: f32| {
            list.as_ref().map_or([default; 3], |list| list[index])
        };
        let turn = turns.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |turns| turns[index]);
        placed(of(&scales, 1.0), turn, of(&shifts, 0.0))
    };
    Ok(Some((0..count).map(one).collect()))
}

/// Returns the transform from a node's frame to its parent's.
fn local(node: &json::Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    placed(
        node.scale.unwrap_or([1.0; 3]),
        node.rotation.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |turn| turn.0),
        node.translation.unwrap_or_default(),
    )
}

/// Returns the transform that scales, turns by a quaternion of any length, and shifts.
fn placed(scale: [f32; 3], turn: [f32; 4], shift: [f32; 3]) -> DMat4 {
    let [scale, shift] = [scale, shift].map(|part| part.map(f64::from));
    let turn = DQuat::from_array(turn.map(f64::from));
    let turn = if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY };
    DMat4::from_scale_rotation_translation(DVec3::from_array(scale), turn, DVec3::from_array(shift))
}
