// The field of a sheet, from the sums of the splats that were added to it.

fn shift_faces(sums: vec3<f32>) -> vec3<f32> {
    return vec3(sums.yz, 0.0);
}

// Returns the field on the plane behind a sheet, from the first of the three open planes, and
// shifts that plane out.
fn resolve_face(r: u32, f: u32, sheet: u32) -> Face {
    var face: Face;
    let weight = pixels[r].fields[f].face_weight.x;
    let inverse = 1.0 / max(weight, 1e-37);
    face.has_value = weight > frame.fields[f].isotropic.w;
    face.value = pixels[r].fields[f].face_value.x * inverse;
    if GRADIENTS && !CENTRAL {
        let sums = pixels[r].fields[f];
        let slope = face.value * vec2(sums.weight_x.x, sums.weight_y.x)
            - vec2(sums.value_x.x, sums.value_y.x);
        face.slope = slope_on_plane(r, f, slope * inverse, planes[sheet + 1u]);
        pixels[r].fields[f].weight_x = shift_faces(pixels[r].fields[f].weight_x);
        pixels[r].fields[f].weight_y = shift_faces(pixels[r].fields[f].weight_y);
        pixels[r].fields[f].value_x = shift_faces(pixels[r].fields[f].value_x);
        pixels[r].fields[f].value_y = shift_faces(pixels[r].fields[f].value_y);
    }
    pixels[r].fields[f].face_weight = shift_faces(pixels[r].fields[f].face_weight);
    pixels[r].fields[f].face_value = shift_faces(pixels[r].fields[f].face_value);
    return face;
}

fn resolve_field(r: u32, f: u32, sheet: u32, field: ptr<function, Sheet>) {
    let thickness = planes[sheet + 1u] - planes[sheet];
    let weight = pixels[r].fields[f].weight.x;
    (*field).has_value = weight > frame.fields[f].isotropic.w * thickness;
    (*field).value = pixels[r].fields[f].value.x / max(weight, 1e-37);
    // A lattice fills its box.
    let is_full = LATTICE && (!SAMPLES || frame.fields[f].low.w > 0.0);
    (*field).filling = select(min(weight / thickness, 1.0), 1.0, is_full);
    (*field).front = pixels[r].fields[f].front;
    (*field).back = resolve_face(r, f, sheet);
    pixels[r].fields[f].weight = shift(pixels[r].fields[f].weight);
    pixels[r].fields[f].value = shift(pixels[r].fields[f].value);
}

// No field is gathered.
fn begin_field(tile: u32) {
}

fn end_field(tile: u32) {
}

fn pass_field_before(end: u32) -> u32 {
    return 0u;
}

fn open_field(sheet: u32) -> u32 {
    return 0u;
}
