//! Reads the PLY that trainers of 3D Gaussian scenes write.

use super::{
    super::{
        ALPHA, Brightest, COLOR, ColorKind, ROLES, color_kind, color_scale,
        header::{Element, Header},
        table::Table,
    },
    are_gaussians, named, needed, rest, rest_number, rows_of, scalar,
};
use crate::{
    Result,
    formats::shared::trained::{Trained, opacity_of_logit, settle},
    gaussians::{
        Gaussians,
        harmonics::{constant_of, terms},
    },
    input::Source,
};
use glam::{DVec3, Quat, Vec3};

/// Properties that every file has.
const NEEDED: [&str; 10] =
    ["x", "y", "z", "opacity", "rot_0", "rot_1", "rot_2", "rot_3", "scale_0", "scale_1"];
/// Places in the list of columns.
const OPACITY: usize = 3;
const TURN: usize = 4;
const SCALE: usize = 8;
const FILTER: usize = 11;
const CONSTANT: usize = 12;
const REST: usize = 15;

/// The constant terms of the colours.
const CONSTANTS: [&str; 3] = ["f_dc_0", "f_dc_1", "f_dc_2"];

/// The columns of a Gaussian.
struct Layout {
    columns: Vec<Option<usize>>,
    degree: u32,
    /// The constant terms are colours like those of meshes.
    is_painted: bool,
}

pub(super) fn read(source: &Source, header: &Header) -> Result<Gaussians> {
    let vertex =
        named(header, "vertex").ok_or_else(|| source.error("header", "has no element “vertex”"))?;
    let layout = Layout::find(source, vertex)?;
    let count = source.check_points("the number of Gaussians", vertex.count as u64)?;
    let rows = rows_of(source, header, vertex)?;
    let table = Table::read(source, vertex, &rows, &layout.columns)?;
    let scale = layout.is_painted.then(|| painted_scale(vertex, &table));
    let is_flat = layout.columns[SCALE + 2].is_none();
    let has_filter = layout.columns[FILTER].is_some();
    let terms = terms(layout.degree);
    settle(source, count, layout.degree, |row, colors| {
        let value = |column: usize| table.value(row, column);
        let constant = |channel: usize| match &scale {
            Some(scale) => constant_of((value(CONSTANT + channel) * scale[channel]) as f32),
            None => value(CONSTANT + channel) as f32,
        };
        for (term, color) in colors.iter_mut().enumerate() {
            *color = [0, 1, 2].map(|channel| match term {
                0 => constant(channel),
                _ => value(REST + rest_number(terms, term, channel)) as f32,
            });
        }
        let mut scale = Vec3::from([0, 1, 2].map(|axis| value(SCALE + axis).exp() as f32));
        if is_flat {
            scale.z = 0.0;
        }
        let mut share = 1.0;
        if has_filter {
            (scale, share) = filtered(scale, value(FILTER) as f32);
        }
        let [w, x, y, z] = [0, 1, 2, 3].map(|part| value(TURN + part) as f32);
        Ok(Trained {
            center: DVec3::new(value(0), value(1), value(2)),
            scale,
            rotation: Quat::from_xyzw(x, y, z, w),
            opacity: opacity_of_logit(value(OPACITY) as f32) * share,
        })
    })
}

/// Returns the scales of a Gaussian that a filter widens, and the factor on its opacity that keeps
/// what it absorbs. The filter is the low-pass that Mip-Splatting trains with and stores beside the
/// scales (Yu et al. 2024, equation 9). Axes without an extent count for neither.
fn filtered(scale: Vec3, filter: f32) -> (Vec3, f32) {
    let wide = (scale * scale + Vec3::splat(filter * filter)).map(f32::sqrt);
    let share = |axis: usize| if scale[axis] > 0.0 { scale[axis] / wide[axis] } else { 1.0 };
    (wide, share(0) * share(1) * share(2))
}

impl Layout {
    /// Finds the columns by their names.
    fn find(source: &Source, vertex: &Element) -> Result<Self> {
        let is_painted = vertex.column(&CONSTANTS[..1]).is_none()
            && (0..3).all(|channel| scalar(vertex, ROLES[COLOR + channel]).is_some());
        let wanted = |name: &&str| {
            needed(source, vertex, name).map(Some).map_err(|error| {
                if are_gaussians(vertex) {
                    return error;
                }
                error.hint("the vertices are no trained Gaussians; read the file as a mesh")
            })
        };
        let mut columns = NEEDED.iter().map(wanted).collect::<Result<Vec<_>>>()?;
        columns.push(scalar(vertex, &["scale_2"]));
        columns.push(scalar(vertex, &["filter_3D"]));
        if is_painted {
            columns.extend((0..3).map(|channel| scalar(vertex, ROLES[COLOR + channel])));
        } else {
            columns.extend(CONSTANTS.iter().map(wanted).collect::<Result<Vec<_>>>()?);
        }
        let (degree, rest) = rest(source, vertex)?;
        columns.extend(rest.into_iter().map(Some));
        Ok(Self { columns, degree, is_painted })
    }
}

/// Returns the factors from the colours of the file to fractions of 1.
fn painted_scale(vertex: &Element, table: &Table) -> [f64; 3] {
    let mut roles = ROLES.map(|names| scalar(vertex, names));
    roles[ALPHA] = None;
    let kinds = color_kind(vertex, &roles);
    let mut brightest = Brightest::default();
    if kinds.iter().flatten().any(ColorKind::is_wide) {
        let of_row = |row: usize| {
            let [red, green, blue] = [0, 1, 2].map(|channel| table.value(row, CONSTANT + channel));
            [red, green, blue, 0.0]
        };
        brightest = Brightest::of(vertex.count, of_row);
    }
    let scale = color_scale(&kinds, &brightest);
    [0, 1, 2].map(|channel| scale[channel].unwrap_or(1.0) / 255.0)
}
