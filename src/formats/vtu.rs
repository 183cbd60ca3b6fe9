//! VTK's XML unstructured grids (`.vtu`) and polygons (`.vtp`), read as scattered samples: values
//! of points, or values of cells at their centres.

use super::{
    ReadOptions,
    vtk_cells::Cells,
    vtk_xml::{Document, Piece, Section},
};
use crate::{Result, input::Source, scattered::Points};
use glam::DVec3;

/// The sections of a piece that contain cells, each with the attribute that counts its cells. They
/// are in the order in which cell data count them.
const UNSTRUCTURED: &[[&str; 2]] = &[["Cells", "NumberOfCells"]];
const POLYGONS: &[[&str; 2]] = &[
    ["Verts", "NumberOfVerts"],
    ["Lines", "NumberOfLines"],
    ["Polys", "NumberOfPolys"],
    ["Strips", "NumberOfStrips"],
];

/// Reads an unstructured grid or polygons. The values are the array that `scalar` names, among
/// those of the points, then of the cells. Without `scalar`, they are the active scalars of the
/// points (those that `Scalars` names, or the first with one component), else of the cells.
///
/// Values of cells become samples at the means of their corners, with radii from the cells' sizes.
/// Pieces are joined; copies of a point that several pieces share have the weight of one sample
/// together.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not such a grid, is cut off, has no
/// such array, has cells that refer to missing points, or has numbers that are not finite;
/// [`Error::Limit`](crate::Error::Limit) for counts over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Points> {
    let start = &source.bytes()[..source.bytes().len().min(1024)];
    let polygons = start.windows(8).any(|w| w == b"PolyData");
    let (kind, sections) =
        if polygons { ("PolyData", POLYGONS) } else { ("UnstructuredGrid", UNSTRUCTURED) };
    let document = Document::read(source, kind)?;
    let (of_cells, name) = choose(source, &document.pieces, options.scalar.as_deref())?;
    let mut cells = Cells::default();
    let mut values = Vec::new();
    for piece in &document.pieces {
        let first_point = cells.points.len();
        let count = piece.count(source, "NumberOfPoints")?;
        source.check_points("the number of points", count.saturating_add(first_point as u64))?;
        add_points(source, &document, piece, count, &mut cells)?;
        let mut cell_count = 0u64;
        for [section, attribute] in sections {
            let count = piece.count(source, attribute)?;
            cell_count = cell_count.saturating_add(count);
            source.check_points(
                "the number of cells",
                cell_count.saturating_add(cells.ends.len() as u64),
            )?;
            if of_cells && count > 0 {
                add_cells(
                    source,
                    &document,
                    piece.section(section),
                    count,
                    first_point,
                    &mut cells,
                )?;
            }
        }
        let (section, count) =
            if of_cells { ("CellData", cell_count) } else { ("PointData", count) };
        let array = piece.section(section).array(&name);
        if count > 0 {
            let array = array.ok_or_else(|| {
                source.error(section, format!("lacks the array “{name}” in a piece"))
            })?;
            values.extend(document.part(array, count)?.doubles(source)?);
        }
    }
    if of_cells {
        cells.samples_at_centres(source, values, options)
    } else {
        cells.samples_at_points(source, values, options)
    }
}

/// Returns the array to read: whether it belongs to cells, and its name. All pieces have the same
/// arrays.
fn choose(source: &Source, pieces: &[Piece], scalar: Option<&str>) -> Result<(bool, String)> {
    let mut names = Vec::new();
    for (of_cells, section) in [(false, "PointData"), (true, "CellData")] {
        let section = pieces[0].section(section);
        let array = scalar.map_or_else(|| section.scalars(), |name| section.array(name));
        if let Some(array) = array {
            if array.components() != "1" {
                let message = format!(
                    "has {} components, but samples are made of scalars",
                    array.components()
                );
                return Err(source.error(array.place(), message));
            }
            return Ok((of_cells, array.get("Name").unwrap_or_default().to_owned()));
        }
        names.extend(
            section
                .arrays
                .iter()
                .filter(|array| array.components() == "1")
                .filter_map(|array| array.get("Name")),
        );
    }
    let message = scalar.map_or("has no scalar".into(), |name| format!("has no scalar “{name}”"));
    let error = source.error("PointData and CellData", message);
    Err(error.hint(format!("name one of them: {}", names.join(", "))))
}

fn add_points(
    source: &Source,
    document: &Document,
    piece: &Piece,
    count: u64,
    cells: &mut Cells,
) -> Result<()> {
    if count == 0 {
        return Ok(());
    }
    let Some(array) = piece.section("Points").arrays.first() else {
        return Err(source.error("Points", "contains no array of positions"));
    };
    if array.components() != "3" {
        let message = format!("has {} components, but positions have 3", array.components());
        return Err(source.error(array.place(), message));
    }
    let numbers = document.part(array, count.saturating_mul(3))?.doubles(source)?;
    source.room::<[DVec3; 2]>("the points", count as usize)?;
    cells.points.extend(numbers.chunks_exact(3).map(DVec3::from_slice));
    Ok(())
}

fn add_cells(
    source: &Source,
    document: &Document,
    section: &Section,
    count: u64,
    first_point: usize,
    cells: &mut Cells,
) -> Result<()> {
    let need = |name: &str| {
        section.array(name).ok_or_else(|| source.error("Cells", format!("have no array “{name}”")))
    };
    let ends = document.part(need("offsets")?, count)?.doubles(source)?;
    // The last offset is the number of corners; the cast saturates.
    let corners = document
        .part(need("connectivity")?, ends.last().map_or(0, |&end| end as u64))?
        .doubles(source)?;
    cells.room(source, corners.len(), ends.len())?;
    cells.add(&corners, &ends, first_point).map_err(|message| source.error("Cells", message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, input::testing::*};
    use glam::Vec3;

    fn array(attributes: &str, text: &str) -> String {
        format!("<DataArray format='ascii' {attributes}>{text}</DataArray>")
    }

    /// A tetrahedron with edge 2 and a square beside it.
    fn grid(point_data: &str, cell_data: &str) -> String {
        let points = array(
            "type='Float32' NumberOfComponents='3'",
            "0 0 0 2 0 0 0 2 0 0 0 2  5 0 0 7 0 0 7 2 0 5 2 0",
        );
        let corners = array("type='Int64' Name='connectivity'", "0 1 2 3 4 5 6 7");
        let ends = array("type='Int64' Name='offsets'", "4 8");
        let kinds = array("type='UInt8' Name='types'", "10 9");
        format!(
            "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='8' \
             NumberOfCells='2'><PointData>{point_data}</PointData><CellData>{cell_data}</CellData>\
             <Points>{points}</Points><Cells>{corners}{ends}{kinds}</Cells></Piece>\
             </UnstructuredGrid></VTKFile>"
        )
    }

    fn load(text: &str, scalar: Option<&str>) -> Result<Points> {
        let folder = Folder::new();
        read_with(&folder.write("a.vtu", text), |source| read(source, &ReadOptions::scalar(scalar)))
    }

    #[test]
    fn values_of_points_and_of_cells() {
        let of_points = array("type='Float64' Name='p'", "1 2 3 4 5 6 7 8");
        let vector = array("type='Float32' Name='v' NumberOfComponents='3'", "0");
        let of_cells = array("type='Int32' Name='c'", "10 -20");
        let both = grid(&format!("{vector}{of_points}"), &of_cells);
        let points = load(&both, None).unwrap();
        assert_eq!(
            (points.len(), points.positions[6], points.values[6]),
            (8, Vec3::new(7.0, 2.0, 0.0), 7.0)
        );
        assert!(points.radii.is_empty());
        for points in [load(&both, Some("c")).unwrap(), load(&grid("", &of_cells), None).unwrap()] {
            assert_eq!(points.positions, [Vec3::splat(0.5), Vec3::new(6.0, 1.0, 0.0)]);
            assert_eq!(points.values, [10.0, -20.0]);
            // Mean squares of the distances: (0.75 + 3 · 2.75) / 4 = 2.25, and 2.
            assert_eq!(points.radii, [1.4 * 1.5, 1.4 * 2f32.sqrt()]);
        }
        let whole = grid("", &of_cells);
        every_cut(&Folder::new(), "a.vtu", whole.as_bytes(), |source| {
            read(source, &ReadOptions::default())
        });
        for (text, scalar, word) in [
            (&both, Some("none"), "no scalar “none”"),
            (&both, Some("v"), "3 components"),
            (&grid(&vector, ""), None, "has no scalar"),
            (&whole.replace("4 8", "4 9"), None, "8 numbers where 9"),
            (&whole.replace("4 8", "9 8"), None, "ends at corner 9"),
            (&whole.replace("4 8", "-4 8"), None, "ends at corner -4"),
            (&whole.replace("4 8", "0 8"), None, "cell 0: has no corners"),
            (&whole.replace("6 7<", "6 8<"), None, "point 8, but there are 8 points"),
            (&whole.replace("10 -20", "10"), None, "1 numbers where 2"),
            (&whole.replace("5 2 0<", "5 2 nan<"), None, "not finite"),
            (&whole.replace("Name='offsets'", ""), None, "no array “offsets”"),
            (&whole.replace("NumberOfComponents='3'", ""), None, "positions have 3"),
            (&both.replace("UnstructuredGrid", "StructuredGrid"), None, "StructuredGrid"),
        ] {
            let message = load(text, scalar).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        let lie = load(&whole.replace("NumberOfPoints='8'", "NumberOfPoints='99999999999'"), None)
            .unwrap_err();
        assert!(matches!(lie, Error::Limit { .. }));
    }

    #[test]
    fn polygons_in_pieces() {
        let piece = |x: f64, values: &str| {
            let points = array(
                "type='Float32' NumberOfComponents='3'",
                &format!("{x} 0 0 {x} 3 0 {x} 0 3 {x} 3 3"),
            );
            let cells = |corners: &str, ends: &str| {
                array("type='Int32' Name='connectivity'", corners)
                    + &array("type='Int32' Name='offsets'", ends)
            };
            format!(
                "<Piece NumberOfPoints='4' NumberOfVerts='1' NumberOfLines='0' NumberOfPolys='2'>\
                 <CellData Scalars='c'>{}</CellData><Points>{points}</Points><Verts>{}</Verts>\
                 <Lines>{}</Lines><Polys>{}</Polys></Piece>",
                array("type='Float32' Name='c'", values),
                cells("3", "1"),
                cells("", ""),
                cells("0 1 2 1 3 2", "3 6")
            )
        };
        let file = |first: &str| {
            format!(
                "<VTKFile type='PolyData'><PolyData>{}{}</PolyData></VTKFile>",
                piece(0.0, first),
                piece(9.0, "4 5 6")
            )
        };
        let points = load(&file("1 2 3"), None).unwrap();
        assert_eq!(points.values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(points.positions[3], Vec3::new(9.0, 3.0, 3.0));
        assert_eq!(points.positions[5], Vec3::new(9.0, 2.0, 2.0));
        assert!(points.radii.is_empty(), "a vertex has no size");
    }
}
