//! Writes Gaussians as a GLB: one primitive of points. All attributes are 32-bit floats, one after
//! the other.

use super::NAME;
use crate::{
    Error, Result,
    about::Orientation,
    disk,
    gaussians::{
        Gaussians,
        harmonics::{CONSTANT, terms},
    },
};
use glam::{DMat3, DQuat, DVec3, Vec3};
use serde_json::{Map, Value, json};
use std::{
    io::{self, Write},
    path::Path,
};

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;

/// Writes Gaussians as a GLB with the extension `KHR_gaussian_splatting`. Positions are relative to
/// the origin, which is the translation of the node. A scene with an orientation stands upright in
/// viewers: a node turns it, without which −y would be up in scenes of trainers. Programs without
/// the extension show points with the constant part of the colours.
///
/// # Errors
/// [`Error::Argument`] for a set that is empty or not valid, or that does not fit the 4 GiB of a
/// GLB; [`Error::Output`] if the file cannot be written.
pub fn write_gaussians(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    set.validate().map_err(Error::Argument)?;
    if set.is_empty() {
        return Err(Error::Argument("a glTF file needs at least one Gaussian".into()));
    }
    let nodes = nodes(set.origin, set.about.orientation.unwrap_or(Orientation::Y_UP))?;
    let columns = columns(set.degree);
    let (json, binary) = scene(set, &columns, &nodes);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() as u64 + 8 + binary;
    let (Ok(length), Ok(binary)) = (u32::try_from(length), u32::try_from(binary)) else {
        let message =
            format!("{} Gaussians take {length} bytes, but a GLB at most 4 GiB", set.len());
        return Err(Error::Argument(message));
    };
    disk::write_with(path.as_ref(), |out| {
        out.write_all(b"glTF")?;
        for word in [2, length, text.len() as u32] {
            out.write_all(&word.to_le_bytes())?;
        }
        out.write_all(b"JSON")?;
        out.write_all(&text)?;
        out.write_all(&binary.to_le_bytes())?;
        out.write_all(b"BIN\0")?;
        columns.iter().try_for_each(|column| column.write(set, out))
    })
}

/// What an attribute contains.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Values {
    Center,
    Rotation,
    Scale,
    Opacity,
    /// The harmonics of this number.
    Term(usize),
    /// Linear colour and opacity, for programs without the extension.
    Color,
}

/// An attribute.
struct Column {
    name: String,
    values: Values,
}

impl Column {
    /// Returns the kind of the elements, the type of their components, and their size in bytes.
    fn kind(&self) -> (&'static str, u32, u64) {
        match self.values {
            Values::Center | Values::Scale | Values::Term(_) => ("VEC3", FLOAT, 12),
            Values::Rotation => ("VEC4", FLOAT, 16),
            Values::Opacity => ("SCALAR", FLOAT, 4),
            Values::Color => ("VEC4", UNSIGNED_SHORT, 8),
        }
    }

    fn write(&self, set: &Gaussians, out: &mut impl Write) -> io::Result<()> {
        let terms = terms(set.degree);
        match self.values {
            Values::Center => set.centers.iter().try_for_each(|v| floats(out, v.to_array())),
            Values::Scale => set.scales.iter().try_for_each(|v| floats(out, v.to_array())),
            Values::Opacity => set.opacities.iter().try_for_each(|&v| floats(out, [v])),
            Values::Rotation => {
                set.rotations.iter().try_for_each(|v| floats(out, v.normalize().to_array()))
            }
            Values::Term(term) => {
                set.harmonics.iter().skip(term).step_by(terms).try_for_each(|&v| floats(out, v))
            }
            Values::Color => {
                let constants = set.harmonics.iter().step_by(terms);
                constants.zip(&set.opacities).try_for_each(|(&constant, &opacity)| {
                    let [r, g, b] = constant.map(|v| linear(0.5 + CONSTANT * v));
                    let color = [r, g, b, opacity].map(|v| (v * 65535.0).round() as u16);
                    out.write_all(color.map(u16::to_le_bytes).as_flattened())
                })
            }
        }
    }
}

fn floats<const N: usize>(out: &mut impl Write, values: [f32; N]) -> io::Result<()> {
    out.write_all(values.map(f32::to_le_bytes).as_flattened())
}

/// Returns a display value (sRGB) as linear light, from 0 to 1.
fn linear(value: f32) -> f32 {
    let value = value.clamp(0.0, 1.0);
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// Returns the attributes in their order in the file.
fn columns(degree: u32) -> Vec<Column> {
    let column = |name: &str, values| Column { name: format!("{NAME}:{name}"), values };
    let mut columns = vec![
        Column { name: "POSITION".into(), values: Values::Center },
        column("ROTATION", Values::Rotation),
        column("SCALE", Values::Scale),
        column("OPACITY", Values::Opacity),
    ];
    for l in 0..=degree {
        let first = l as usize * l as usize;
        columns.extend((0..=2 * l as usize).map(|coefficient| {
            column(&format!("SH_DEGREE_{l}_COEF_{coefficient}"), Values::Term(first + coefficient))
        }));
    }
    columns.push(Column { name: "COLOR_0".into(), values: Values::Color });
    columns
}

/// Returns the nodes. Their translations are read in 32 bits, so a second node adds what one of
/// them does not hold. A scene that does not stand as glTF's do is turned by a node above them.
fn nodes(origin: DVec3, Orientation { up, front }: Orientation) -> Result<Value> {
    let shift = origin.as_vec3();
    if !shift.is_finite() {
        return Err(Error::Argument(format!("the origin {origin} is too far for a glTF file")));
    }
    let rest = (origin - shift.as_dvec3()).as_vec3();
    let mut nodes = Vec::new();
    if (up, front) != (DVec3::Y, DVec3::Z) {
        // The inverse turns the scene's up to y, and its front to z.
        let turn = DQuat::from_mat3(&DMat3::from_cols(up.cross(front), up, front)).inverse();
        let turn = turn.normalize().to_array().map(|part| part as f32);
        nodes.push(json!({"rotation": turn, "children": [1]}));
    }
    if rest != Vec3::ZERO {
        let below = nodes.len() + 1;
        nodes.push(json!({"translation": shift.to_array(), "children": [below]}));
        nodes.push(json!({"translation": rest.to_array(), "mesh": 0}));
    } else if shift != Vec3::ZERO {
        nodes.push(json!({"translation": shift.to_array(), "mesh": 0}));
    } else {
        nodes.push(json!({"mesh": 0}));
    }
    Ok(Value::Array(nodes))
}

/// Returns the JSON, and the number of bytes of all attributes.
fn scene(set: &Gaussians, columns: &[Column], nodes: &Value) -> (Value, u64) {
    let count = set.len() as u64;
    let (mut accessors, mut views, mut attributes) = (Vec::new(), Vec::new(), Map::new());
    let mut start = 0;
    for (index, column) in columns.iter().enumerate() {
        let (kind, component, size) = column.kind();
        let mut accessor = json!({
            "bufferView": index, "componentType": component, "count": count, "type": kind});
        match column.values {
            Values::Center => {
                let low = set.centers.iter().copied().fold(Vec3::INFINITY, Vec3::min);
                let high = set.centers.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
                accessor["min"] = json!(low.to_array());
                accessor["max"] = json!(high.to_array());
            }
            Values::Color => accessor["normalized"] = json!(true),
            _ => {}
        }
        accessors.push(accessor);
        views.push(json!({
            "buffer": 0, "byteOffset": start, "byteLength": count * size,
            "target": ARRAY_BUFFER}));
        attributes.insert(column.name.clone(), json!(index));
        start += count * size;
    }
    let extension = json!({
        "kernel": "ellipse", "colorSpace": "srgb_rec709_display",
        "projection": "perspective", "sortingMethod": "cameraDistance"});
    let json = json!({
        "asset": {"version": "2.0", "generator": "splatkit"},
        "extensionsUsed": [NAME],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{
            "mode": 0, "attributes": attributes, "extensions": {NAME: extension}}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": start}]
    });
    (json, start)
}
