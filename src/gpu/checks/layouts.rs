//! Structures that Rust and the shaders share have the same fields on both sides.

use super::{recipes, variants::usual};
use crate::{
    facet::Facet,
    gpu::{
        passes::present::Present,
        pipeline::state::{
            AGAIN_ARGUMENTS, ARGUMENT_BYTES, MARCH_ARGUMENTS, ORDER_ARGUMENTS, PASS_BYTES,
            SCAN_ARGUMENTS, State, TILE_ARGUMENTS,
        },
        scene::{
            harmonics::GpuEye,
            nodes::{GpuBounds, GpuCut, GpuNode},
        },
        uniforms::{Frame, FrameClip, FrameField, FrameIsosurface, Source},
    },
    splat::Splat,
};
use bytemuck::Zeroable;
use naga::{AddressSpace, ArraySize, Handle, Module, ScalarKind, Type, TypeInner, VectorSize};
use std::{
    collections::{BTreeMap, BTreeSet},
    mem::offset_of,
};

/// A field: its name, its byte offset and its type in WGSL.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Field(String, usize, String);

/// The fields and the size in bytes of a structure.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Layout {
    fields: Vec<Field>,
    size: usize,
}

/// A Rust type that has a counterpart in WGSL. Two to four numbers are a vector.
trait Shader {
    const IS_NUMBER: bool = false;

    fn name() -> String;

    fn name_of(_: &Self) -> String {
        Self::name()
    }
}

impl Shader for f32 {
    const IS_NUMBER: bool = true;

    fn name() -> String {
        "f32".into()
    }
}

impl Shader for u32 {
    const IS_NUMBER: bool = true;

    fn name() -> String {
        "u32".into()
    }
}

impl Shader for FrameClip {
    fn name() -> String {
        "Clip".into()
    }
}

impl Shader for FrameField {
    fn name() -> String {
        "Field".into()
    }
}

impl Shader for FrameIsosurface {
    fn name() -> String {
        "Isosurface".into()
    }
}

impl<T: Shader, const N: usize> Shader for [T; N] {
    fn name() -> String {
        let part = T::name();
        if T::IS_NUMBER && (2..=4).contains(&N) {
            format!("vec{N}<{part}>")
        } else {
            format!("array<{part}, {N}>")
        }
    }
}

/// The layout of a Rust structure. It has to list all fields: a missing one does not compile.
macro_rules! layout {
    ($structure:ident: $($field:ident),* $(,)?) => {{
        let $structure { $($field),* } = $structure::zeroed();
        let fields = vec![$(Field(
            stringify!($field).into(),
            offset_of!($structure, $field),
            Shader::name_of(&$field),
        )),*];
        Layout { fields, size: size_of::<$structure>() }
    }};
}

impl Layout {
    /// Splits a Rust field into several of WGSL.
    fn split(mut self, name: &str, parts: &[(&str, usize, &str)]) -> Self {
        let at = self.fields.iter().position(|field| field.0 == name).expect("a field to split");
        let start = self.fields[at].1;
        let parts = parts
            .iter()
            .map(|(name, offset, kind)| Field((*name).into(), start + offset, (*kind).into()));
        self.fields.splice(at..=at, parts);
        self
    }

    /// Leaves out the last field.
    fn without_padding(mut self, name: &str) -> Self {
        let last = self.fields.pop().expect("a field");
        assert_eq!(last.0, name);
        self
    }
}

/// The Rust side of every structure that the CPU writes or reads.
fn mirrors() -> BTreeMap<&'static str, Layout> {
    let frame = layout!(Frame:
        size, tiles, center, scale, perspective, sheet_count, geometric_sheets, ratio_log2_inverse,
        step_inverse, z_near, tile_shift, record_capacity, entry_capacity, surface_shade,
        surface_sides, surface_half, sheet_normal, record_starts, world_x, world_y, world_z,
        lamp_shares, lamp_steps, key_direction, sky_side, open_x, open_y, open_z, key_x, key_y,
        key_z, clips, holes, fields,
    );
    let field = layout!(FrameField:
        axis_x, axis_y, axis_z, origin, low, high, shade, certain, isotropic, transfer, gradients,
        table_starts, before, behind, kernel, levels, lattice, taps, visibility, isosurfaces,
    );
    let source = layout!(Source:
        axis_x, axis_y, axis_z, origin, covariance_a, covariance_b, lattice, slices, extent, count,
        first_run, flags,
    );
    let splat = layout!(Splat: center, strength, factor, color, normal);
    let facet = layout!(Facet: corners, normals, colors)
        .split("corners", &[("corners", 0, "array<f32, 9>")])
        .split("normals", &[("normals", 0, "array<u32, 3>")])
        .split("colors", &[("colors", 0, "array<u32, 3>")]);
    let node = layout!(GpuNode:
        center, radius, size, cone, child_page, parent_size, parent_center, parent_radius,
    );
    let cut = layout!(GpuCut:
        sides, scale, fineness, perspective, culls, sin_margin, cos_margin, unused,
    );
    let present = layout!(Present:
        size, first_row, is_srgb, center, scale, perspective, word, wanted, stalled, far, has_depth,
        are_distances, depth_shift, depth_factor,
    );
    let eye = layout!(GpuEye: place, count, terms, unused);
    [
        ("Eye", eye),
        ("Frame", frame),
        ("Field", field),
        ("Clip", layout!(FrameClip: low, high)),
        ("Isosurface", layout!(FrameIsosurface: value, color)),
        ("Source", source),
        // WGSL reads the six numbers of the factor as vectors, which takes fewer loads.
        (
            "Splat",
            splat.split("factor", &[("factor_a", 0, "vec4<f32>"), ("factor_b", 16, "vec2<f32>")]),
        ),
        // WGSL would align three numbers to 16 bytes.
        ("Facet", facet),
        ("Node", node),
        // WGSL pads the end of a structure by itself, and has no three numbers without alignment.
        ("Bounds", layout!(GpuBounds: center, radius, size, unused).without_padding("unused")),
        ("Cut", cut),
        ("Present", present),
    ]
    .into()
}

/// Structures in buffers that only shaders write and read.
const SHADERS_ALONE: [&str; 2] = ["Pass", "Box"];

/// Returns a type as WGSL writes it.
fn name_of(module: &Module, kind: Handle<Type>) -> String {
    let number = |scalar: naga::Scalar| match scalar.kind {
        ScalarKind::Float => format!("f{}", 8 * scalar.width),
        ScalarKind::Uint => format!("u{}", 8 * scalar.width),
        ScalarKind::Sint => format!("i{}", 8 * scalar.width),
        other => panic!("{other:?} in a buffer"),
    };
    match &module.types[kind].inner {
        TypeInner::Scalar(scalar) => number(*scalar),
        TypeInner::Atomic(scalar) => format!("atomic<{}>", number(*scalar)),
        TypeInner::Vector { size, scalar } => {
            let size = match size {
                VectorSize::Bi => 2,
                VectorSize::Tri => 3,
                VectorSize::Quad => 4,
            };
            format!("vec{size}<{}>", number(*scalar))
        }
        TypeInner::Array { base, size: ArraySize::Constant(size), .. } => {
            format!("array<{}, {size}>", name_of(module, *base))
        }
        TypeInner::Array { base, .. } => format!("array<{}>", name_of(module, *base)),
        TypeInner::Struct { .. } => module.types[kind].name.clone().expect("structures have names"),
        other => panic!("{other:?} in a buffer"),
    }
}

/// Adds the structures that a type consists of.
fn add_structures(module: &Module, kind: Handle<Type>, layouts: &mut BTreeMap<String, Layout>) {
    match &module.types[kind].inner {
        TypeInner::Array { base, .. } => add_structures(module, *base, layouts),
        TypeInner::Struct { members, span } => {
            let field = |member: &naga::StructMember| {
                let name = member.name.clone().expect("fields have names");
                Field(name, member.offset as usize, name_of(module, member.ty))
            };
            let layout =
                Layout { fields: members.iter().map(field).collect(), size: *span as usize };
            let name = name_of(module, kind);
            let before = layouts.insert(name.clone(), layout.clone());
            assert!(before.is_none_or(|before| before == layout), "two structures named {name}");
            for member in members {
                add_structures(module, member.ty, layouts);
            }
        }
        _ => {}
    }
}

/// Returns the structures in the buffers of all pipelines.
fn structures() -> BTreeMap<String, Layout> {
    let mut layouts = BTreeMap::new();
    for recipe in
        recipes::shared().iter().chain(&usual().iter().flat_map(recipes::of).collect::<Vec<_>>())
    {
        let module =
            recipes::parse(recipe).unwrap_or_else(|error| panic!("{}: {error}", recipe.label));
        for (_, global) in module.global_variables.iter() {
            if matches!(global.space, AddressSpace::Uniform | AddressSpace::Storage { .. }) {
                add_structures(&module, global.ty, &mut layouts);
            }
        }
    }
    layouts
}

#[test]
fn shared_structures_are_the_same_field_by_field() {
    let (mut shaders, rust) = (structures(), mirrors());
    for (name, expected) in &rust {
        let layout = shaders.remove(*name).unwrap_or_else(|| panic!("no shader binds {name}"));
        assert_eq!(&layout, expected, "{name}: WGSL on the left, Rust on the right");
    }
    let pass = shaders["Pass"].size as u64;
    assert_eq!(pass, PASS_BYTES, "Pass");
    let others: BTreeSet<&str> = shaders.keys().map(String::as_str).collect();
    assert_eq!(others, BTreeSet::from(SHADERS_ALONE), "structures without a Rust mirror");
}

/// The state is an array of words, whose places are constants named like the fields in Rust.
#[test]
fn the_words_of_the_state_are_its_fields() {
    let layout = layout!(State:
        entries, words, splats, passes, next_sheet, next_band, target, done, stalled, overflow,
        hidden, binned, tiles, touched, advanced, held, unused,
    )
    .without_padding("unused");
    let mut expected: BTreeMap<String, u32> = layout
        .fields
        .iter()
        .map(|Field(name, offset, _)| (name.to_uppercase(), *offset as u32 / 4))
        .collect();
    expected.insert("STATE_WORDS".into(), layout.size as u32 / 4);
    for (name, bytes) in [
        ("SCAN_ARGUMENTS", SCAN_ARGUMENTS),
        ("ORDER_ARGUMENTS", ORDER_ARGUMENTS),
        ("MARCH_ARGUMENTS", MARCH_ARGUMENTS),
        ("AGAIN_ARGUMENTS", AGAIN_ARGUMENTS),
        ("TILE_ARGUMENTS", TILE_ARGUMENTS),
    ] {
        assert!(bytes + 12 <= ARGUMENT_BYTES, "{name}");
        expected.insert(name.into(), bytes as u32 / 4);
    }
    let module = naga::front::wgsl::parse_str(crate::gpu::pipeline::shaders::STATE).expect("WGSL");
    let constants: BTreeMap<String, u32> =
        recipes::integers(&module).map(|(name, value)| (name.to_owned(), value)).collect();
    assert_eq!(constants, expected, "WGSL on the left, Rust on the right");
}
