//! Trained 3D Gaussians in PLY: the files of trainers (Kerbl et al. 2023), and the compressed files
//! of PlayCanvas.

mod compressed;
mod read;
#[cfg(test)]
mod tests;
mod write;

use super::{
    COLOR, ROLES,
    header::{self, Element, Header},
    rows::Rows,
};
use crate::{
    Result,
    gaussians::{Gaussians, harmonics},
    input::Source,
    warning,
};
pub use compressed::write_compressed_gaussians;
pub use write::write_gaussians;

/// Properties that the vertices of a trainer's file have.
const OWN: [&str; 3] = ["opacity", "scale_0", "rot_0"];

/// Returns whether a file's header declares trained 3D Gaussians.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed header.
pub fn holds_gaussians(source: &Source) -> Result<bool> {
    let header = header::read(source)?;
    Ok(compressed::are_compressed(&header) || named(&header, "vertex").is_some_and(are_gaussians))
}

/// Reads trained 3D Gaussians: the file of a trainer, with all numbers of each Gaussian as
/// properties of a vertex, or a compressed file of PlayCanvas, with the elements `chunk`, `vertex`
/// and `sh`.
///
/// In a trainer's file, `opacity` is a logit, `scale_…` are logarithms, and `rot_0` is the real
/// part. Without `scale_2` the Gaussians are flat. Scales and opacities are those after the filter
/// of Mip-Splatting, `filter_3D`, if the file has one. Without `f_dc_…`, colours like those of
/// meshes (`red`) are the same in all directions.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed header, for missing properties, for a
/// number of `f_rest_…` that no degree from 0 to 3 has, and for a file that ends early.
/// [`Error::Limit`](crate::Error::Limit) for more Gaussians than the limits allow.
pub fn read_gaussians(source: &Source) -> Result<Gaussians> {
    let header = header::read(source)?;
    if compressed::are_compressed(&header) {
        compressed::read(source, &header)
    } else {
        read::read(source, &header)
    }
}

/// Returns whether a vertex has the properties that trainers of 3D Gaussian scenes write.
pub(super) fn are_gaussians(vertex: &Element) -> bool {
    let has = |names: &[&str]| vertex.column(names).is_some();
    OWN.iter().all(|name| has(&[name])) && (has(&["f_dc_0"]) || has(ROLES[COLOR]))
}

/// Warns that 3D Gaussians are read as points, which do not look like the scene.
pub(super) fn warn(source: &Source) {
    warning::give!(
        "{}: read as a point cloud: the centres of trained Gaussians; their shapes and their own \
         colours are left out",
        source.path.display()
    );
}

/// Refuses compressed Gaussians, for readers of meshes.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if the header declares them.
pub(super) fn refuse_compressed(source: &Source, header: &Header) -> Result<()> {
    if !compressed::are_compressed(header) {
        return Ok(());
    }
    let wrong = source.error("header", "the file holds compressed Gaussians, not a mesh");
    Err(wrong.hint("read it as trained Gaussians"))
}

/// Returns the first element with a name.
fn named<'h>(header: &'h Header, name: &str) -> Option<&'h Element> {
    header.elements.iter().find(|element| element.name == name)
}

/// Returns the column of a scalar.
fn scalar(element: &Element, names: &[&str]) -> Option<usize> {
    element.column(names).filter(|&column| element.columns[column].width().is_some())
}

/// As [`scalar`], for a column without which the element cannot be read.
fn needed(source: &Source, element: &Element, name: &str) -> Result<usize> {
    scalar(element, &[name]).ok_or_else(|| {
        let message = format!("the element “{}” has no scalar property “{name}”", element.name);
        source.error("header", message)
    })
}

/// Returns the degree of the harmonics, and the columns of the coefficients above the constant, in
/// the order of their numbers.
fn rest(source: &Source, element: &Element) -> Result<(u32, Vec<usize>)> {
    let is_rest = |name: &str| name.starts_with("f_rest_");
    let count = element.columns.iter().filter(|column| is_rest(&column.name)).count();
    let degree = harmonics::degree_of(count / 3 + 1).filter(|_| count.is_multiple_of(3));
    let Some(degree) = degree else {
        let message = format!(
            "the element “{}” has {count} properties “f_rest_…”, but only 0, 9, 24 or 45 can be \
             read, for harmonics of degree 0 to 3",
            element.name
        );
        return Err(source.error("header", message));
    };
    let columns = (0..count).map(|number| needed(source, element, &format!("f_rest_{number}")));
    Ok((degree, columns.collect::<Result<_>>()?))
}

/// Returns the number of a coefficient above the constant: all of red, then green, then blue.
fn rest_number(terms: usize, term: usize, channel: usize) -> usize {
    channel * (terms - 1) + term - 1
}

/// Locates the rows of an element of the header.
fn rows_of<'a>(source: &'a Source, header: &Header, element: &Element) -> Result<Rows<'a>> {
    let mut at = header.payload;
    for before in &header.elements {
        let rows = Rows::find(source, before, header.encoding, &mut at)?;
        if std::ptr::eq(before, element) {
            return Ok(rows);
        }
    }
    Err(source.error("header", format!("has no element “{}”", element.name)))
}

/// Returns the logarithm of a deviation. That of a flat Gaussian stays finite.
fn log_of_scale(scale: f32) -> f32 {
    scale.max(1e-19).ln()
}
