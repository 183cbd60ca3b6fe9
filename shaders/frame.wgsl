// What every pass knows of the picture: the view, the sheets, the light. Mirrors engine/uniforms.rs.

struct Frame {
    // Picture in pixels, and in tiles.
    size: vec2<u32>,
    tiles: vec2<u32>,
    // Pixel coordinates of the optical axis; focal length in pixels (perspective) or pixels per world unit.
    center: vec2<f32>,
    scale: f32,
    perspective: u32,
    // Sheets are numbered from 1; sheet 0 is everything before the first plane and is never drawn.
    sheet_count: u32,
    geometric_sheets: u32,
    ratio_log2_inverse: f32,
    step_inverse: f32,
    // Smallest view-space z that any pixel sees (perspective).
    z_near: f32,
    // Spans count tiles in units of 2^tile_shift.
    tile_shift: u32,
    // Capacities of the records (in vec4) and entries of a pass.
    record_capacity: u32,
    entry_capacity: u32,
    // View space to lattice index: index = field_origin + field_axes * position; samples fill 0 … field_last.
    field_axis_x: vec4<f32>,
    field_axis_y: vec4<f32>,
    field_axis_z: vec4<f32>,
    field_origin: vec4<f32>,
    field_low: vec4<f32>,
    field_high: vec4<f32>,
    // Ambient, diffuse, specular, power.
    volume_shade: vec4<f32>,
    surface_shade: vec4<f32>,
    // Standard deviation of the isotropic lattice kernel (world units), its inverse, its squared extent in sigmas; what kernels
    // must add up to for a value.
    isotropic: vec4<f32>,
    // The value that is counted as 0, entries of the transfer function's table per value, the last entry; the place of that value
    // among them.
    transfer: vec4<f32>,
    // The magnitude of the first entry of the gradient's factor, entries per magnitude; the world length that gradients are
    // counted over, and that length in pixels, as `scale`.
    gradients: vec4<f32>,
    // Where the parts of `tables` start: integrals, factors of the gradient, kernel, sections.
    table_starts: vec4<u32>,
    // Extinction times colour, and extinction, of values before the first table entry, and behind the last one.
    before: vec4<f32>,
    behind: vec4<f32>,
    // The field's kernel: radius in kernel space, its inverse; one over what kernels add up to.
    kernel: vec4<f32>,
    // Volumes in bricks: the shares of the finer and of the coarser level.
    levels: vec4<f32>,
    // Axis-aligned sheets: their normal in view space.
    sheet_normal: vec4<f32>,
    // A gathered lattice: samples along x, y and z; one over the kernel's variance in squared steps,
    // its weights one and two steps from its centre; where the parts of `shown` start: what the transfer function shows, the tiles' sheets, the list of tiles, and the
    // words that a tile's sheets take.
    lattice: vec4<u32>,
    taps: vec4<f32>,
    shown: vec4<u32>,
    // Columns of the turn from view space to the world's axes.
    world_x: vec4<f32>,
    world_y: vec4<f32>,
    world_z: vec4<f32>,
    // What is kept, and boxes that are cut out; around the eye, along the world's axes.
    clips: array<Clip, 8>,
    holes: array<Clip, 8>,
    isosurfaces: array<Isosurface, 8>,
}

// A box from `low` to `high` if high.w is over 0, else the points x with low·x ≤ high.x.
struct Clip {
    low: vec4<f32>,
    high: vec4<f32>,
}

struct Isosurface {
    // Value, in entries of the table; opacity, optical depth.
    value: vec4<f32>,
    color: vec4<f32>,
}

// One depth pass: sheets and rows of tiles. Written by plan.wgsl. Its bins are tiles times groups of sheets.
struct Pass {
    // Sheets: first … end-1.
    first_sheet: u32,
    end_sheet: u32,
    // Rows of tiles: first … end-1.
    first_row: u32,
    end_row: u32,
    // Groups of 2^group_shift sheets per tile; 0 when there is no such pass.
    groups: u32,
    group_shift: u32,
    unused: vec2<u32>,
}

// One item's place in the view. Mirrors engine/uniforms.rs.
struct Source {
    // Columns of the matrix from the item's local frame (explicit splats) or lattice index to view space.
    axis_x: vec4<f32>,
    axis_y: vec4<f32>,
    axis_z: vec4<f32>,
    origin: vec4<f32>,
    // Lattices: the kernel's covariance in view space (xx, xy, xz, yy), (yz, zz), and the samples' size.
    covariance_a: vec4<f32>,
    covariance_b: vec4<f32>,
    // Samples along x, y and z, type of the samples (see sample_value).
    lattice: vec4<u32>,
    // First slice of this chunk; first and last slice that its data hold, which may be neighbours'. Candidates.
    slices: vec4<u32>,
    // Radius of the footprint in standard deviations.
    extent: f32,
    // Splats, room for nodes, or samples of the lattice.
    count: u32,
    // First run of this chunk in the frame's list of runs.
    first_run: u32,
    // RADIANCE, ISOTROPIC, ENDS, NODES, COARSE.
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

// Words of the record of a splat.
fn record_words(flags: u32) -> u32 {
    return select(4u, 1u, (flags & ISOTROPIC) != 0u);
}

// A pixel that lets less light through than this is finished.
const OPAQUE: f32 = 0.0005;

// A row of a dispatch takes MOST_WORKGROUPS (engine/stage.rs); more go on in further rows: the columns and rows for so many.
fn rows_of(workgroups: u32) -> vec2<u32> {
    let columns = min(workgroups, MOST_WORKGROUPS);
    return vec2(columns, (workgroups + columns - 1u) / max(columns, 1u));
}

// The number of a workgroup, and that of an invocation in workgroups of 64.
fn group_number(group: vec3<u32>) -> u32 {
    return group.x + group.y * MOST_WORKGROUPS;
}

fn number_of(id: vec3<u32>) -> u32 {
    return id.x + id.y * (64u * MOST_WORKGROUPS);
}

// Some drivers give each of their threads a row of a dispatch's workgroups (Mesa's software Vulkan). Where neighbours are
// much alike, so that a row may have all the work or none, numbers are dealt out like cards to this many hands.
const HANDS: u32 = 16u;

// A number behind the last card gets none, `count`.
fn dealt(number: u32, count: u32) -> u32 {
    let each = (count + HANDS - 1u) / HANDS;
    return select((number % each) * HANDS + number / each, count, number >= each * HANDS);
}

// Numbers to deal so that all of a count come up; some are beyond it.
fn dealt_count(count: u32) -> u32 {
    return (count + HANDS - 1u) / HANDS * HANDS;
}

// Candidates that one invocation handles in order, so that lists come out in the same order each time.
const RUN: u32 = 16u;
// One splat, in the upper half of what a run needs.
const ONE_SPLAT: u32 = 0x10000u;

// An entry: sheet within its group (7 bits), window after the splat's first (1), isotropic record (1), one of the coarser level
// (1), record (22).
const ENTRY_SHEET_SHIFT: u32 = 25u;
const ENTRY_CONTINUED: u32 = 0x1000000u;
const ENTRY_ISOTROPIC: u32 = 0x800000u;
const ENTRY_COARSE: u32 = 0x400000u;
const ENTRY_RECORD: u32 = 0x3fffffu;
