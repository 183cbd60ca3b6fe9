// The nodes of a hierarchy, and whether they are drawn. Every node of the pages in memory decides
// for itself, from its own bounds and its parent's. hierarchy/cut.rs explains why that is enough,
// and does the same on the CPU. Used by cut and tally.

@group(0) @binding(0) var<uniform> source: Source;
@group(0) @binding(1) var<uniform> cut: Cut;
@group(0) @binding(2) var<storage, read> nodes: array<Node>;
// The nodes' splats.
@group(0) @binding(3) var<storage, read> splats: array<Splat>;
// The slots that take part, and the numbers of their nodes.
@group(0) @binding(4) var<storage, read> slots: array<vec2<u32>>;
// A bit for each page of the hierarchy: whether it is in memory.
@group(0) @binding(5) var<storage, read> resident: array<u32>;

// Mirrors src/gpu/scene/nodes.rs.
struct Node {
    center: vec3<f32>,
    radius: f32,
    size: f32,
    cone: f32,
    // The page of the node's children; NO_PAGE for a leaf.
    child_page: u32,
    // Negative for the root, which has no parent.
    parent_size: f32,
    parent_center: vec3<f32>,
    parent_radius: f32,
}

struct Cut {
    // View-space sides of the picture: a sphere is outside if n·c + d < −radius.
    sides: array<vec4<f32>, 4>,
    scale: f32,
    fineness: f32,
    perspective: u32,
    culls: u32,
    sin_margin: f32,
    cos_margin: f32,
    unused: vec2<f32>,
}

const NO_PAGE: u32 = 0xffffffffu;
const BLEND_BAND: f32 = 1.5;
const SHARE_UNIT: u32 = 1023u;
const MOST_PIXELS: f32 = 1e9;
const SLOT_NODES: u32 = 512u;
const SELECT_RUN: u32 = 64u;
const SLOT_RUNS: u32 = SLOT_NODES / SELECT_RUN;
// Number of invocations that share a batch. Each visits every eighth node: if no parent is refined,
// all of them end at once.
const SHARERS: u32 = 8u;

fn to_view(place: vec3<f32>) -> vec3<f32> {
    return source.axis_x.xyz * place.x + source.axis_y.xyz * place.y + source.axis_z.xyz * place.z
        + source.origin.xyz;
}

fn pixels(center: vec3<f32>, radius: f32, size: f32) -> f32 {
    var wide = size * cut.scale;
    if cut.perspective != 0u {
        wide = wide / max(length(to_view(center)) - radius, 1e-30);
    }
    return min(wide, MOST_PIXELS);
}

fn refinement(wide: f32) -> u32 {
    let excess = (wide * cut.fineness - 1.0) / (BLEND_BAND - 1.0);
    return u32(clamp(excess, 0.0, 1.0) * f32(SHARE_UNIT) + 0.5);
}

fn has_children(node: Node) -> bool {
    return node.child_page != NO_PAGE
        && ((resident[node.child_page / 32u] >> (node.child_page % 32u)) & 1u) != 0u;
}

fn is_hidden(index: u32, node: Node) -> bool {
    let splat = to_view(splats[index].center);
    let reach = node.radius + 1.3 * node.size;
    for (var i = 0; i < 4; i++) {
        if dot(cut.sides[i].xyz, splat) + cut.sides[i].w < -reach {
            return true;
        }
    }
    if cut.perspective != 0u && splat.z < -reach {
        return true;
    }
    if cut.culls == 0u || node.cone <= 0.0 {
        return false;
    }
    let packed = splats[index].normal;
    if packed == NO_NORMAL {
        return false;
    }
    let axis = to_view(decode_normal(packed)) - source.origin.xyz;
    var toward = vec3(0.0, 0.0, 1.0);
    var near = 0.0;
    if cut.perspective != 0u {
        let center = to_view(node.center);
        let distance = length(center);
        toward = center / distance;
        near = node.radius / distance;
    }
    let along = dot(axis, toward);
    if along <= 0.0 || near >= 1.0 {
        return false;
    }
    let cos_near = sqrt(1.0 - near * near);
    let sin_cone = sqrt(max(1.0 - node.cone * node.cone, 0.0));
    let c = node.cone * cos_near - sin_cone * near;
    let s = sin_cone * cos_near + node.cone * near;
    return c * cut.cos_margin - s * cut.sin_margin > 0.0
        && along >= s * cut.cos_margin + c * cut.sin_margin;
}

// Returns the share of a node in the picture.
fn share(index: u32) -> u32 {
    let node = nodes[index];
    var above = SHARE_UNIT;
    if node.parent_size >= 0.0 {
        above = refinement(pixels(node.parent_center, node.parent_radius, node.parent_size));
    }
    if above == 0u {
        return 0u;
    }
    var refined = 0u;
    if has_children(node) {
        refined = refinement(pixels(node.center, node.radius, node.size));
    }
    if above <= refined || is_hidden(index, node) {
        return 0u;
    }
    return above - refined;
}

// Returns the nodes of a batch of the participating slots: the first, and the one behind the last.
fn run_of(run: u32) -> vec2<u32> {
    let slot = slots[run / SLOT_RUNS];
    let first = slot.x * SLOT_NODES;
    let start = first + run % SLOT_RUNS * SELECT_RUN;
    return vec2(start, min(start + SELECT_RUN, first + slot.y));
}
