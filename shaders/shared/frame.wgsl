// The data of the picture for every pass: the view, the sheets, the light. Mirrors
// src/gpu/uniforms.rs.

struct Frame {
    // Size of the picture in pixels, and in tiles.
    size: vec2<u32>,
    tiles: vec2<u32>,
    // Pixel coordinates of the optical axis; focal length in pixels (perspective) or pixels per
    // world unit.
    center: vec2<f32>,
    scale: f32,
    perspective: u32,
    // Sheets are numbered from 1; sheet 0 is everything in front of the first plane and is never
    // drawn.
    sheet_count: u32,
    geometric_sheets: u32,
    ratio_log2_inverse: f32,
    step_inverse: f32,
    // Smallest view-space z that any pixel sees (perspective).
    z_near: f32,
    // Spans count tiles in units of 2^tile_shift.
    tile_shift: u32,
    // Capacities of a pass, in records (in vec4) and entries.
    record_capacity: u32,
    entry_capacity: u32,
    // Ambient, diffuse, specular, power.
    surface_shade: vec4<f32>,
    // The lamp of surfaces beside the eye: the direction to it, as long as the factor on the
    // normal's cosine. Last, the factor on the cosine to the eye.
    surface_sides: vec4<f32>,
    // The direction in which a surface shows the highlight; zero if that is the eye's.
    surface_half: vec4<f32>,
    // Axis-aligned sheets: their normal in view space.
    sheet_normal: vec4<f32>,
    // The first record word of each field in the pass. The fields' records lie behind those of
    // radiance, in the order of the fields.
    record_starts: array<vec4<u32>, 2>,
    // Columns of the rotation from view space to the world's axes.
    world_x: vec4<f32>,
    world_y: vec4<f32>,
    world_z: vec4<f32>,
    // Lights that are not from the eye. The shares of the light from the eye, from the key lamp and
    // from the sky. How far before a surface light from all sides and that of the lamp are taken.
    // The direction to the lamp. The mean direction of the sky's light in the open. From view space
    // to the nodes and maps of lamps.wgsl: factors on a place's coordinates, and a constant.
    lamp_shares: vec4<f32>,
    lamp_steps: vec4<f32>,
    key_direction: vec4<f32>,
    sky_side: vec4<f32>,
    open_x: vec4<f32>,
    open_y: vec4<f32>,
    open_z: vec4<f32>,
    key_x: vec4<f32>,
    key_y: vec4<f32>,
    key_z: vec4<f32>,
    // The regions that are kept, and the boxes that are cut out; relative to the eye, along the
    // world's axes.
    clips: array<Clip, 8>,
    holes: array<Clip, 8>,
    // The first FIELDS are used.
    fields: array<Field, 8>,
}

// A field of the scene.
struct Field {
    // View space to lattice steps: steps = origin + axes * position. Samples fill low … high. low.w
    // is 1 if the samples lie on a lattice, high.w is 1 if the kernel is in tables; otherwise they
    // are 0.
    axis_x: vec4<f32>,
    axis_y: vec4<f32>,
    axis_z: vec4<f32>,
    origin: vec4<f32>,
    low: vec4<f32>,
    high: vec4<f32>,
    // Ambient, diffuse, specular, power.
    shade: vec4<f32>,
    // The magnitude of a field's gradient up to which its direction does not count. One over the
    // magnitudes from there to where it counts in full. Both in entries of the table per thickness.
    // One over the depth behind clips from which gradients count in full.
    certain: vec4<f32>,
    // Standard deviation of the isotropic lattice kernel (world units), its inverse, its squared
    // extent in standard deviations; the minimum sum of kernels for which a value exists.
    isotropic: vec4<f32>,
    // The value that counts as 0, table entries per value, the last entry of the transfer
    // function's table; the place of that value among the entries.
    transfer: vec4<f32>,
    // The magnitude of the first entry of the gradient factor, entries per magnitude; the world
    // length over which gradients count, and that length in pixels, as `scale`.
    gradients: vec4<f32>,
    // The starts of the parts of `tables`: transfer function, its integrals, gradient factors,
    // kernel and its sections.
    table_starts: vec4<u32>,
    // Extinction times colour, and extinction, of values before the first table entry, and behind
    // the last one.
    before: vec4<f32>,
    behind: vec4<f32>,
    // The field's kernel: radius in kernel space, its inverse; one over the average sum of the
    // kernels.
    kernel: vec4<f32>,
    // Volumes in bricks: the shares of the finer and of the coarser level.
    levels: vec4<f32>,
    // A gathered lattice: samples along x, y and z; one over the kernel's variance in squared
    // steps, its weights one and two steps from its centre. The starts of the parts of the
    // buffer `visibility`: the transfer function's entries, the tiles' sheets; and the number of
    // words of a tile's sheets.
    lattice: vec4<u32>,
    taps: vec4<f32>,
    visibility: vec4<u32>,
    // By ascending value.
    isosurfaces: array<Isosurface, 8>,
}

// A box from `low` to `high` if high.w is positive, otherwise the points x with low·x ≤ high.x.
struct Clip {
    low: vec4<f32>,
    high: vec4<f32>,
}

struct Isosurface {
    // Value, in entries of the table; opacity, optical depth.
    value: vec4<f32>,
    color: vec4<f32>,
}

// One depth pass: a range of sheets and of rows of tiles. Written by plan.wgsl. Its bins are tiles
// times groups of sheets.
struct Pass {
    // Sheets: first … end-1.
    first_sheet: u32,
    end_sheet: u32,
    // Rows of tiles: first … end-1.
    first_row: u32,
    end_row: u32,
    // Groups of 2^group_shift sheets per tile; 0 if there is no such pass.
    groups: u32,
    group_shift: u32,
    unused: vec2<u32>,
}

// The placement of one item in the view. Mirrors src/gpu/uniforms.rs.
struct Source {
    // Columns of the matrix to view space, from the item's local frame (explicit splats) or from
    // lattice steps.
    axis_x: vec4<f32>,
    axis_y: vec4<f32>,
    axis_z: vec4<f32>,
    origin: vec4<f32>,
    // Lattices: the kernel's covariance in view space (xx, xy, xz, yy), (yz, zz), and the kernel's
    // unit.
    covariance_a: vec4<f32>,
    covariance_b: vec4<f32>,
    // Samples along x, y and z, and the type of the samples (see sample_value).
    lattice: vec4<u32>,
    // First slice of this chunk; first and last slice in its data, which may include neighbouring
    // chunks' slices. Number of candidates.
    slices: vec4<u32>,
    // Radius of the footprint in standard deviations.
    extent: f32,
    // Number of splats, capacity for nodes, or number of samples of the lattice.
    count: u32,
    // First batch of this chunk in the frame's list of batches.
    first_run: u32,
    // RADIANCE, ISOTROPIC, ENDS, NODES, COARSE, FACETS, CULLED, MIXED, TRAINED_FLAG,
    // BODY_CENTRED_FLAG, RECTILINEAR_FLAG, CUT; the number of the field from bit FIELD_SHIFT on.
    flags: u32,
}

const RADIANCE: u32 = 1u;
const ISOTROPIC: u32 = 2u;
// The kernel ends at its extent along the ray too.
const ENDS: u32 = 4u;
// Candidates are nodes of a hierarchy.
const NODES: u32 = 8u;
// Samples are those of the coarser of two levels.
const COARSE: u32 = 16u;
// Candidates are facets. Their backs are left out; all of them count as fronts.
const FACETS: u32 = 32u;
const CULLED: u32 = 64u;
const MIXED: u32 = 128u;
const TRAINED_FLAG: u32 = 256u;
const BODY_CENTRED_FLAG: u32 = 512u;
const RECTILINEAR_FLAG: u32 = 1024u;
// Facets end at the clips already.
const CUT: u32 = 2048u;
const FIELD_SHIFT: u32 = 16u;

// Returns the number of words of a splat's record.
fn record_words(flags: u32) -> u32 {
    return select(4u, 1u, (flags & ISOTROPIC) != 0u);
}

// A pixel that transmits less light than this is finished.
const OPAQUE: f32 = 0.0005;

// Returns the columns and rows of a dispatch. A row has at most MOST_WORKGROUPS workgroups
// (src/gpu/pipeline/stage.rs); more go into further rows.
fn rows_of(workgroups: u32) -> vec2<u32> {
    let columns = min(workgroups, MOST_WORKGROUPS);
    return vec2(columns, (workgroups + columns - 1u) / max(columns, 1u));
}

// Returns the number of a workgroup.
fn group_number(group: vec3<u32>) -> u32 {
    return group.x + group.y * MOST_WORKGROUPS;
}

fn number_of(id: vec3<u32>) -> u32 {
    return id.x + id.y * (64u * MOST_WORKGROUPS);
}

// Some drivers (Mesa's software Vulkan) give each of their threads one row of a dispatch's
// workgroups. If neighbouring workgroups have similar amounts of work, one row may have all of it.
// So numbers are dealt out like cards, to this many lanes.
const LANES: u32 = 16u;

// Returns the dealt number, or `count` for a number behind the last card.
fn dealt(number: u32, count: u32) -> u32 {
    let each = (count + LANES - 1u) / LANES;
    return select((number % each) * LANES + number / each, count, number >= each * LANES);
}

// Returns how many numbers must be dealt so that all numbers below `count` come up; some results
// lie beyond it.
fn dealt_count(count: u32) -> u32 {
    return (count + LANES - 1u) / LANES * LANES;
}

// The batch size: candidates that one invocation handles in order, so that lists have the same
// order every time.
const RUN: u32 = 16u;
// One splat, in the upper half of a batch's needs.
const ONE_SPLAT: u32 = 0x10000u;

// An entry: sheet within its group (7 bits), window after the splat's first (1), isotropic record
// (1). Then isotropic record of the coarser level, or general record of a facet (1), and place of
// the record in units of RECORD_UNIT words (22).
const ENTRY_SHEET_SHIFT: u32 = 25u;
const ENTRY_CONTINUED: u32 = 0x1000000u;
const ENTRY_ISOTROPIC: u32 = 0x800000u;
const ENTRY_COARSE: u32 = 0x400000u;
const ENTRY_RECORD: u32 = 0x3fffffu;
