// The light that reaches a place, from nodes and maps. src/cpu/lamps.rs does the same.

// The mean direction of the light from all sides in the world, and its amount, as 32-bit floats.
@group(0) @binding(13) var open_nodes: texture_3d<u32>;
// The share of the key lamp's light, in 255ths: planes, columns, rows.
@group(0) @binding(14) var key_map: texture_3d<u32>;

// Returns the light from all sides at a place, linear between nodes.
fn open_at(place: vec3<f32>) -> vec4<f32> {
    let most = vec3<f32>(textureDimensions(open_nodes)) - 1.0;
    let at = clamp(place, vec3(0.0), most);
    let whole = min(floor(at), most - 1.0);
    let part = at - whole;
    let first = vec3<i32>(whole);
    var slices: array<vec4<f32>, 2>;
    for (var k = 0; k < 2; k++) {
        let row = first + vec3(0, 0, k);
        let above = mix(open_node(row), open_node(row + vec3(1, 0, 0)), part.x);
        let below = mix(open_node(row + vec3(0, 1, 0)), open_node(row + vec3(1, 1, 0)), part.x);
        slices[k] = mix(above, below, part.y);
    }
    return mix(slices[0], slices[1], part.z);
}

fn open_node(at: vec3<i32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(textureLoad(open_nodes, at, 0));
}

// Returns the share of the key lamp's light at a place, linear between pixels and planes.
fn key_at(place: vec3<f32>) -> f32 {
    let most = vec3<f32>(textureDimensions(key_map)) - 1.0;
    let at = clamp(place.zxy, vec3(0.0), most);
    let whole = min(floor(at), most - 1.0);
    let part = at - whole;
    let first = vec3<i32>(whole);
    var rows: array<f32, 2>;
    for (var j = 0; j < 2; j++) {
        let row = first + vec3(0, 0, j);
        let left = mix(key_node(row), key_node(row + vec3(1, 0, 0)), part.x);
        let right = mix(key_node(row + vec3(0, 1, 0)), key_node(row + vec3(1, 1, 0)), part.x);
        rows[j] = mix(left, right, part.y);
    }
    return mix(rows[0], rows[1], part.z) / 255.0;
}

fn key_node(at: vec3<i32>) -> f32 {
    return f32(textureLoad(key_map, at, 0).x);
}

// Returns the light at a distance along a pixel's ray, before a surface. `normal` points towards
// the eye and is as long as it is certain.
fn reaching_at(r: u32, distance: f32, normal: vec3<f32>) -> Reaching {
    let direction = direction_of(r);
    let out = normal - (1.0 - min(length(normal), 1.0)) * direction;
    let place = origin_of(r) + distance * direction;
    let open_place = vec4(place + frame.lamp_steps.x * out, 1.0);
    let key_place = vec4(place + frame.lamp_steps.y * out, 1.0);
    let open = open_at(vec3(
        dot(frame.open_x, open_place),
        dot(frame.open_y, open_place),
        dot(frame.open_z, open_place),
    ));
    let side = vec3(
        dot(frame.world_x.xyz, open.xyz),
        dot(frame.world_y.xyz, open.xyz),
        dot(frame.world_z.xyz, open.xyz),
    );
    let key = key_at(vec3(
        dot(frame.key_x, key_place),
        dot(frame.key_y, key_place),
        dot(frame.key_z, key_place),
    ));
    return Reaching(side, open.w, key);
}
