// The entries of a tile that its 64 invocations load together, into the memory of their workgroup:
// each loads one, and finds what all pixels share of it.

// Entries that are loaded together.
const STAGED_ENTRIES: u32 = 64u;
// Vectors of a loaded entry.
const STAGED_VECTORS: u32 = select(4u, 9u, GENERAL_RECORDS);

// The entries that were loaded last, their bins, the ends of these, and what was loaded, vector by
// vector.
var<workgroup> staged_entries: array<u32, STAGED_ENTRIES>;
var<workgroup> staged_bins: array<u32, STAGED_ENTRIES>;
var<workgroup> staged_ends: array<u32, STAGED_ENTRIES>;
var<workgroup> staged: array<vec4<f32>, STAGED_ENTRIES * STAGED_VECTORS>;
// Whether light passes any pixel of the tile: of this load and of the next, in turn.
var<workgroup> is_light: array<atomic<u32>, 2>;
var<workgroup> any_light: u32;
// The place of the first of these entries.
var<private> staged_first: u32;

fn entry_at(at: u32) -> u32 {
    return staged_entries[at - staged_first];
}

fn staged_bin(at: u32) -> u32 {
    return staged_bins[at - staged_first];
}

fn staged_end(at: u32) -> u32 {
    return staged_ends[at - staged_first];
}

// One lane calls it, and a barrier follows before the first load.
fn begin_loads() {
    atomicStore(&is_light[0], 0u);
}

// Loads the tile's next entries, each lane one of them. `light` is whether light passes the lane's
// pixel. Returns whether it passes any.
fn load_entries(
    first: u32,
    end: u32,
    tile_bins: u32,
    lane: u32,
    light: bool,
    turn: u32,
) -> bool {
    if light {
        atomicStore(&is_light[turn], 1u);
    }
    // Nobody reads the entries before any more.
    workgroupBarrier();
    if lane == 0u {
        any_light = atomicLoad(&is_light[turn]);
        atomicStore(&is_light[1u - turn], 0u);
    }
    staged_first = first;
    let at = first + lane;
    if at < end {
        let entry = entries[at];
        let bin = bin_of(at, tile_bins);
        staged_entries[lane] = entry;
        staged_bins[lane] = bin;
        staged_ends[lane] = bin_end(bin);
        let near = inner_planes(sheet_of(entry, bin - tile_bins));
        if ISOTROPIC_RECORDS && (!GENERAL_RECORDS || (entry & ENTRY_ISOTROPIC) != 0u) {
            stage_round(lane, round_of(field_of(entry), entry, near));
        } else if GENERAL_RECORDS && !(HAS_FACETS && (entry & ENTRY_COARSE) != 0u) {
            stage_general(lane, general_of(entry, near));
        }
    }
    // Alike in all lanes, as browsers demand where barriers follow.
    return workgroupUniformLoad(&any_light) != 0u;
}

// Returns the bin of an entry: the first of the tile's that ends behind it.
fn bin_of(at: u32, tile_bins: u32) -> u32 {
    var low = tile_bins;
    var high = tile_bins + stage.groups - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if bin_end(middle) > at {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

fn stage_vector(lane: u32, vector: u32, value: vec4<f32>) {
    staged[vector * STAGED_ENTRIES + lane] = value;
}

fn staged_vector(place: u32, vector: u32) -> vec4<f32> {
    return staged[vector * STAGED_ENTRIES + place - staged_first];
}

fn stage_round(lane: u32, sample: Round) {
    stage_vector(lane, 0u, vec4(sample.at, sample.value, sample.extent2));
    stage_vector(lane, 1u, vec4(sample.form, 0.0));
    stage_vector(lane, 2u, sample.along);
    stage_vector(lane, 3u, vec4(sample.on_plane, 0.0));
}

fn staged_round(place: u32) -> Round {
    let first = staged_vector(place, 0u);
    var sample: Round;
    sample.at = first.xy;
    sample.value = first.z;
    sample.extent2 = first.w;
    sample.form = staged_vector(place, 1u).xyz;
    sample.along = staged_vector(place, 2u);
    sample.on_plane = staged_vector(place, 3u).xyz;
    return sample;
}

fn stage_general(lane: u32, splat: Loaded) {
    stage_vector(lane, 0u, vec4(splat.at, splat.extent2, select(-1.0, 1.0, splat.is_radiance)));
    stage_vector(lane, 1u, vec4(splat.v0, splat.m0.x));
    stage_vector(lane, 2u, vec4(splat.v1, splat.m0.y));
    stage_vector(lane, 3u, vec4(splat.m0.z, splat.m1.yz, splat.m2.z));
    stage_vector(lane, 4u, vec4(splat.whitened, splat.base));
    stage_vector(lane, 5u, vec4(splat.near, splat.distance));
    stage_vector(lane, 6u, vec4(splat.color, splat.strength));
    stage_vector(lane, 7u, vec4(splat.normal, splat.facing));
    stage_vector(lane, 8u, vec4(splat.slope, splat.weight));
}

fn staged_general(place: u32) -> Loaded {
    let at = staged_vector(place, 0u);
    let right = staged_vector(place, 1u);
    let down = staged_vector(place, 2u);
    let ray = staged_vector(place, 3u);
    let middle = staged_vector(place, 4u);
    let near = staged_vector(place, 5u);
    let color = staged_vector(place, 6u);
    let normal = staged_vector(place, 7u);
    let slope = staged_vector(place, 8u);
    var splat: Loaded;
    splat.at = at.xy;
    splat.extent2 = at.z;
    splat.is_radiance = RADIANCE_PAYLOAD && (!(SUMS || CLASSIFIED) || at.w > 0.0);
    splat.v0 = right.xyz;
    splat.v1 = down.xyz;
    splat.m0 = vec3(right.w, down.w, ray.x);
    splat.m1 = vec3(0.0, ray.yz);
    splat.m2 = vec3(0.0, 0.0, ray.w);
    splat.whitened = middle.xyz;
    splat.base = middle.w;
    splat.near = near.xyz;
    splat.distance = near.w;
    splat.color = color.xyz;
    splat.strength = color.w;
    splat.normal = normal.xyz;
    splat.facing = normal.w;
    splat.slope = slope.xyz;
    splat.weight = slope.w;
    return splat;
}
