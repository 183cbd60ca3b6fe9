//! Lossless pages: the bytes of the nodes, sorted by their position in a node, then compressed.

use crate::{
    container::{Cursor, pack},
    hierarchy::Node,
    splat::Splat,
};

/// Bytes of a stored node: splat, centre, radius, size, cone, first child, and number of children.
const NODE_BYTES: usize = 80;

/// The zstd level. Higher levels take much longer, and save only a few parts in a thousand.
const LEVEL: i32 = 3;

/// Encodes nodes. Fails only without the feature `files`.
pub fn encode(nodes: &[Node]) -> std::io::Result<Vec<u8>> {
    let mut planes = vec![0; nodes.len() * NODE_BYTES];
    for (index, node) in nodes.iter().enumerate() {
        for (plane, byte) in to_bytes(node).into_iter().enumerate() {
            planes[plane * nodes.len() + index] = byte;
        }
    }
    pack::compress(&planes, LEVEL)
}

/// Decodes a page of `count` nodes. An error says what is wrong with the page.
pub fn decode(bytes: &[u8], count: usize) -> Result<Vec<Node>, String> {
    let length = count * NODE_BYTES;
    let planes =
        pack::decompress(bytes, length).map_err(|e| format!("it cannot be unpacked: {e}"))?;
    if planes.len() != length {
        return Err(format!("it unpacks to {} bytes where {length} were expected", planes.len()));
    }
    let mut node = [0; NODE_BYTES];
    let nodes = (0..count).map(|index| {
        for (plane, byte) in node.iter_mut().enumerate() {
            *byte = planes[plane * count + index];
        }
        from_bytes(&node)
    });
    nodes.collect::<Option<_>>().ok_or_else(|| "a node is incomplete".into())
}

fn to_bytes(node: &Node) -> [u8; NODE_BYTES] {
    let mut out = [0; NODE_BYTES];
    out.chunks_exact_mut(4)
        .zip(words(node))
        .for_each(|(out, word)| out.copy_from_slice(&word.to_le_bytes()));
    out
}

/// Returns the bits of all fields.
pub fn words(node: &Node) -> [u32; NODE_BYTES / 4] {
    let Node { splat, center, radius, size, cone, first_child, children } = *node;
    let [b0, b1, b2, b3, b4, b5] = splat.factor.map(f32::to_bits);
    let [x, y, z] = splat.center.map(f32::to_bits);
    let [cx, cy, cz] = center.map(f32::to_bits);
    let [strength, radius, size, cone] = [splat.strength, radius, size, cone].map(f32::to_bits);
    let Splat { color, normal, .. } = splat;
    [
        x,
        y,
        z,
        strength,
        b0,
        b1,
        b2,
        b3,
        b4,
        b5,
        color,
        normal,
        cx,
        cy,
        cz,
        radius,
        size,
        cone,
        first_child,
        children,
    ]
}

fn from_bytes(bytes: &[u8; NODE_BYTES]) -> Option<Node> {
    let mut cursor = Cursor::new(bytes);
    let splat = Splat {
        center: cursor.f32s()?,
        strength: cursor.f32()?,
        factor: cursor.f32s()?,
        color: cursor.u32()?,
        normal: cursor.u32()?,
    };
    Some(Node {
        splat,
        center: cursor.f32s()?,
        radius: cursor.f32()?,
        size: cursor.f32()?,
        cone: cursor.f32()?,
        first_child: cursor.u32()?,
        children: cursor.u32()?,
    })
}
