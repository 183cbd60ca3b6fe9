//! The names of flags, and of the fields of a scene that they set.

/// Fields of a scene whose flags have other names.
const FLAGS: &[(&str, &[&str])] = &[
    ("isosurfaces", &["iso"]),
    ("edits", &["edit"]),
    ("camera", &["camera", "view-of"]),
    ("clips", &["clip", "cut-out"]),
    ("shade", &["shade", "no-shade", "flat"]),
    ("optics", &["optics", "mip", "x-ray"]),
    ("slopes", &["no-slopes"]),
    ("occlusion", &["no-occlusion"]),
];

/// Returns the name of the field that a flag sets.
pub fn field_of(flag: &str) -> String {
    let other = FLAGS.iter().find(|(_, flags)| flags.contains(&flag));
    other.map_or_else(|| flag.replace('-', "_"), |(field, _)| (*field).to_owned())
}

/// Returns the name of the flag that sets a field at a place such as `picture.size`.
pub fn flag_of(place: &str) -> String {
    let field = place.rsplit('.').next().unwrap_or(place);
    if place.contains(".limits.") {
        return format!("limit-{field}");
    }
    let other = FLAGS.iter().find(|(name, _)| *name == field);
    other.map_or_else(|| field.replace('_', "-"), |(_, flags)| flags[0].to_owned())
}
