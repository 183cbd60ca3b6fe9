// The field of a sheet, from the sums of the splats that were added to it.

fn shift_faces(sums: vec3<f32>) -> vec3<f32> {
    return vec3(sums.yz, 0.0);
}

// Returns the field on the plane behind a sheet, from the first of the three open planes, and
// shifts that plane out.
fn resolve_face(r: u32, sheet: u32) -> Face {
    var face: Face;
    let weight = pixels[r].face_weight.x;
    let inverse = 1.0 / max(weight, 1e-37);
    face.has_value = weight > frame.isotropic.w;
    face.value = pixels[r].face_value.x * inverse;
    if GRADIENTS && !CENTRAL {
        let slope = face.value * vec2(pixels[r].weight_x.x, pixels[r].weight_y.x)
            - vec2(pixels[r].value_x.x, pixels[r].value_y.x);
        face.slope = slope_on_plane(r, slope * inverse, planes[sheet + 1u]);
        pixels[r].weight_x = shift_faces(pixels[r].weight_x);
        pixels[r].weight_y = shift_faces(pixels[r].weight_y);
        pixels[r].value_x = shift_faces(pixels[r].value_x);
        pixels[r].value_y = shift_faces(pixels[r].value_y);
    }
    pixels[r].face_weight = shift_faces(pixels[r].face_weight);
    pixels[r].face_value = shift_faces(pixels[r].face_value);
    return face;
}

fn resolve_field(r: u32, sheet: u32, own: ptr<function, Sheet>) {
    let thickness = planes[sheet + 1u] - planes[sheet];
    let weight = pixels[r].weight.x;
    (*own).has_value = weight > frame.isotropic.w * thickness;
    (*own).value = pixels[r].value.x / max(weight, 1e-37);
    (*own).filling = min(weight / thickness, 1.0);
    (*own).front = pixels[r].front;
    (*own).back = resolve_face(r, sheet);
    pixels[r].weight = shift(pixels[r].weight);
    pixels[r].value = shift(pixels[r].value);
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
