//! Writes cells as an XML file of VTK (`.vtu`).

use crate::{
    Error, Result,
    cells::{Cells, Place},
    disk,
};
use std::{
    fmt::Write as _,
    io::{self, Write},
    path::Path,
};

/// An array of the file: its name, type, number of components and bytes.
struct Array<'a> {
    name: &'a str,
    kind: &'static str,
    components: usize,
    bytes: Vec<u8>,
}

/// Writes cells as a `.vtu` file, with its numbers as bytes. The values get the name of
/// [`About::name`](crate::about::About::name), or `value`. Coordinates are doubles.
///
/// # Errors
/// [`Error::Argument`] for cells that [`Cells::validate`] refuses, and for polyhedra, whose faces
/// such files list otherwise; [`Error::Output`] if the file cannot be written.
pub fn write_cells(cells: &Cells, path: impl AsRef<Path>) -> Result<()> {
    cells.validate()?;
    if cells.kinds.contains(&crate::cells::CellKind::Polyhedron) {
        return Err(Error::Argument("polyhedra are not written".into()));
    }
    let bytes = |numbers: &mut dyn Iterator<Item = i64>| -> Vec<u8> {
        numbers.flat_map(i64::to_le_bytes).collect()
    };
    let place = |at: &glam::Vec3| (cells.origin + at.as_dvec3()).to_array();
    let points = cells.points.iter().flat_map(place).flat_map(f64::to_le_bytes).collect();
    let name = if cells.about.name.is_empty() { "value" } else { &cells.about.name };
    let values = Array {
        name,
        kind: "Float32",
        components: 1,
        bytes: cells.values.iter().flat_map(|value| value.to_le_bytes()).collect(),
    };
    let list = |name, numbers: &mut dyn Iterator<Item = i64>| Array {
        name,
        kind: "Int64",
        components: 1,
        bytes: bytes(numbers),
    };
    let nodes = list("connectivity", &mut cells.nodes.iter().map(|node| i64::from(*node)));
    let ends = list("offsets", &mut cells.offsets[1..].iter().map(|end| *end as i64));
    let kinds = cells.kinds.iter().map(|kind| kind.vtk()).collect();
    let kinds = Array { name: "types", kind: "UInt8", components: 1, bytes: kinds };
    let points = Array { name: "Points", kind: "Float64", components: 3, bytes: points };
    let values_of = if cells.place == Place::Points { "PointData" } else { "CellData" };
    let sections =
        [(values_of, vec![values]), ("Points", vec![points]), ("Cells", vec![nodes, ends, kinds])];
    disk::write_with(path.as_ref(), |out| write(out, cells, &sections))
}

fn write(out: &mut dyn Write, cells: &Cells, sections: &[(&str, Vec<Array>)]) -> io::Result<()> {
    let mut head = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n",
    );
    let mut offset = 0;
    // Writing to a string does not fail.
    let _ = writeln!(
        head,
        "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">",
        cells.points.len(),
        cells.len()
    );
    for (section, arrays) in sections {
        let scalars = if section.ends_with("Data") {
            format!(" Scalars=\"{}\"", escaped(arrays[0].name))
        } else {
            String::new()
        };
        let _ = writeln!(head, "<{section}{scalars}>");
        for Array { name, kind, components, bytes } in arrays {
            let _ = writeln!(
                head,
                "<DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{components}\" \
                 format=\"appended\" offset=\"{offset}\"/>",
                escaped(name)
            );
            offset += 8 + bytes.len();
        }
        let _ = writeln!(head, "</{section}>");
    }
    head.push_str("</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
    out.write_all(head.as_bytes())?;
    for Array { bytes, .. } in sections.iter().flat_map(|(_, arrays)| arrays) {
        out.write_all(&(bytes.len() as u64).to_le_bytes())?;
        out.write_all(bytes)?;
    }
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

/// Returns a name as it stands in an attribute.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
