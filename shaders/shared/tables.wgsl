// Functions of one value, as tables of each field: the transfer function and its integral, the
// gradient factor, the kernel's sections. Mirrors src/plan/tables.rs, which defines their places
// among the field's tables.

// Colour and extinction per value; their integrals (extinction times colour, extinction) from the
// first value on, in entries; the factor on the extinction by gradient magnitude; the kernel and
// its sections.
@group(0) @binding(6) var<storage, read> tables: array<vec4<f32>>;

// Returns the place of a value among the entries; it may lie in front of or behind them.
fn place_of(field: u32, value: f32) -> f32 {
    return value + frame.fields[field].transfer.w;
}

// Returns colour and extinction of one value.
fn classify(field: u32, value: f32) -> vec4<f32> {
    let at = clamp(place_of(field, value), 0.0, frame.fields[field].transfer.z);
    let low = u32(at);
    let first = frame.fields[field].table_starts.x + low;
    return mix(tables[first], tables[first + 1u], at - f32(low));
}

// Values closer together than this, in entries, are taken as this far apart, because the difference
// of their integrals is lost in rounding. The same holds, far from the tables, for values closer
// together than 32 bits can resolve.
const NARROW: f32 = 8.0;
const NARROW_AFAR: f32 = 1e-6;

// Returns averages over the values between two values: extinction times colour, and extinction.
// This is pre-integration (Engel, Kraus & Ertl 2001) without the attenuation inside, which is
// negligible because the parts of a sheet are thin.
fn classify_between(field: u32, a: f32, b: f32) -> vec4<f32> {
    if BEYOND {
        return classify_beyond(field, place_of(field, a), place_of(field, b));
    }
    let end = frame.fields[field].transfer.z;
    let integrals = frame.fields[field].table_starts.y;
    let at = clamp(vec2(place_of(field, a), place_of(field, b)), vec2(0.0), vec2(end));
    let middle = 0.5 * (at.x + at.y);
    let reach = 0.5 * max(abs(at.x - at.y), NARROW);
    // Rounds outwards to whole entries, which saves half of the look-ups; the mean moves by at most
    // half an entry.
    let low = max(floor(middle - reach), 0.0);
    let high = min(ceil(middle + reach), end);
    return (tables[integrals + u32(high)] - tables[integrals + u32(low)]) / (high - low);
}

// The same for places that may lie in front of or behind the tables, where the function keeps its
// value.
fn classify_beyond(field: u32, a: f32, b: f32) -> vec4<f32> {
    let end = frame.fields[field].transfer.z;
    let integrals = frame.fields[field].table_starts.y;
    let middle = 0.5 * (a + b);
    let reach = max(0.5 * max(abs(a - b), NARROW), NARROW_AFAR * abs(middle));
    let low = floor(middle - reach);
    let high = ceil(middle + reach);
    let within = tables[integrals + u32(clamp(high, 0.0, end))]
        - tables[integrals + u32(clamp(low, 0.0, end))];
    // Ratios first: places far outside may be as large as floats get.
    let inverse = 1.0 / (high - low);
    let before = (min(high, 0.0) - min(low, 0.0)) * inverse;
    let behind = (max(high, end) - max(low, end)) * inverse;
    return within * inverse + before * frame.fields[field].before
        + behind * frame.fields[field].behind;
}

// Returns the factor on the extinction for a gradient's magnitude.
fn gradient_factor(field: u32, magnitude: f32) -> f32 {
    let gradients = frame.fields[field].gradients;
    let at = clamp(
        (magnitude - gradients.x) * gradients.y,
        0.0,
        f32(GRADIENT_ENTRIES - 1u),
    );
    let low = u32(at);
    let first = frame.fields[field].table_starts.z + low;
    return mix(tables[first].x, tables[first + 1u].x, at - f32(low));
}

// Returns the kernel and −h′(r)/r at a radius in kernel space; 0 beyond its extent, even if it ends
// with a step.
fn kernel_at(field: u32, radius: f32) -> vec2<f32> {
    let kernel = frame.fields[field].kernel;
    let at = min(radius * kernel.y * f32(RADIAL_ENTRIES - 1u), f32(RADIAL_ENTRIES - 1u));
    let low = u32(at);
    let entry = tables[frame.fields[field].table_starts.w + low];
    return select(mix(entry.xy, entry.zw, at - f32(low)), vec2(0.0), radius > kernel.x);
}

// Returns the kernel's integral along a line at distance `rho` from its centre, from the closest
// approach to t. An entry holds the four corners of its cell.
fn kernel_integral(field: u32, rho: f32, t: f32) -> f32 {
    let last = f32(SECTION_CELLS);
    let at = min(vec2(rho, abs(t)) * frame.fields[field].kernel.y * last, vec2(last - 1e-3));
    let low = vec2<u32>(at);
    let part = at - vec2<f32>(low);
    let sections = frame.fields[field].table_starts.w + RADIAL_ENTRIES;
    let cell = tables[sections + low.x * SECTION_CELLS + low.y];
    let value = mix(mix(cell.x, cell.y, part.y), mix(cell.z, cell.w, part.y), part.x);
    return select(-value, value, t >= 0.0);
}
