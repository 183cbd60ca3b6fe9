//! VTK's XML rectilinear grids (`.vtr`): a volume whose samples have their own coordinates along
//! each axis.

use super::{
    ReadOptions,
    shared::holes,
    vti,
    vtk_xml::{Document, Extent, dims, extent},
};
use crate::{
    Result,
    input::Source,
    volume::{Arrangement, Lattice, Volume},
};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Reads the active scalars of the points, as [`vti::read`] does, on a rectilinear lattice along x,
/// y and z.
///
/// # Errors
/// Those of [`vti::read`]; also for coordinates that are missing or do not ascend.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let document = Document::read(source, "RectilinearGrid")?;
    let whole = vti::whole_extent(source, &document, "RectilinearGrid")?;
    let part = vti::samples(source, &document, whole)?;
    // The samples were present, so the extent is true and the coordinates along its axes are small
    // beside them.
    let places = coordinates(source, &document, whole)?;
    source.spend("the size of the samples in bytes", part.kind.decoded_bytes(part.bytes.len()))?;
    let samples = part.kind.decode(part.bytes, part.endian);
    holes::volume(source, lattice(places), samples, options)
}

/// Returns the lattice of samples at these coordinates along x, y and z.
pub(super) fn lattice(places: [Vec<f64>; 3]) -> Lattice {
    let dims = places.each_ref().map(Vec::len);
    let arrangement = Arrangement::Rectilinear(Arc::new(places));
    Lattice { dims, origin: DVec3::ZERO, axes: DMat3::IDENTITY, arrangement }
}

/// Returns the coordinates along each axis, joined from all pieces.
fn coordinates(source: &Source, document: &Document, whole: Extent) -> Result<[Vec<f64>; 3]> {
    let counts = dims(source, &whole)?;
    source.room::<f64>("the coordinates", counts.iter().sum())?;
    let mut places = counts.map(|count| vec![f64::NAN; count]);
    for piece in &document.pieces {
        let extent = match piece.attributes.get("Extent") {
            Some(text) => extent(source, "Piece", text)?,
            None => whole,
        };
        let counts = dims(source, &extent)?;
        let arrays = &piece.section("Coordinates").arrays;
        if arrays.len() != 3 {
            let message = format!(
                "contains {} arrays, but one for each of 3 axes was \
                         expected",
                arrays.len()
            );
            return Err(source.error("Coordinates", message));
        }
        for (axis, (array, count)) in arrays.iter().zip(counts).enumerate() {
            let part = document.part(array, count as u64)?;
            // Pieces lie inside the whole: their samples were joined before.
            let first = (extent[axis][0] - whole[axis][0]) as usize;
            places[axis][first..first + count].copy_from_slice(&part.doubles(source)?);
        }
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::*;

    fn read(source: &Source) -> Result<Volume> {
        super::read(source, &ReadOptions::default())
    }

    fn grid(whole: &str, pieces: &[(&str, [&str; 3], &str)]) -> String {
        let pieces: String = pieces
            .iter()
            .map(|(extent, places, values)| {
                let places = places
                    .map(|p| format!("<DataArray type='Float64' format='ascii'>{p}</DataArray>"))
                    .concat();
                format!(
                    "<Piece Extent='{extent}'><PointData Scalars='s'><DataArray type='UInt8' \
                     Name='s' format='ascii'>{values}</DataArray></PointData>\
                     <Coordinates>{places}</Coordinates></Piece>"
                )
            })
            .collect();
        format!(
            "<VTKFile type='RectilinearGrid'><RectilinearGrid \
             WholeExtent='{whole}'>{pieces}</RectilinearGrid></VTKFile>"
        )
    }

    fn load(text: &str) -> Result<Volume> {
        let folder = Folder::new();
        read_with(&folder.write("a.vtr", text), read)
    }

    #[test]
    fn whole_and_in_pieces() {
        let whole = grid("0 2 0 1 0 0", &[("0 2 0 1 0 0", ["0 1 5", "-1 1", "7"], "0 1 2 3 4 5")]);
        let pieces = grid(
            "0 2 0 1 0 0",
            &[
                ("0 1 0 1 0 0", ["0 1", "-1 1", "7"], "0 1 3 4"),
                ("1 2 0 1 0 0", ["1 5", "-1 1", "7"], "1 2 4 5"),
            ],
        );
        for text in [&whole, &pieces] {
            let volume = load(text).unwrap();
            assert_eq!((volume.lattice.dims, volume.range), ([3, 2, 1], [0.0, 5.0]));
            assert_eq!(volume.lattice.sample_position(5), DVec3::new(5.0, 1.0, 7.0));
            assert_eq!(volume.bounds(), [DVec3::new(0.0, -1.0, 7.0), DVec3::new(5.0, 1.0, 7.0)]);
        }
        every_cut(&Folder::new(), "a.vtr", whole.as_bytes(), read);
    }

    #[test]
    fn wrong_coordinates_are_told() {
        let with = |x: &str| {
            load(&grid("0 2 0 0 0 0", &[("0 2 0 0 0 0", [x, "0", "0"], "0 1 2")]))
                .unwrap_err()
                .to_string()
        };
        assert!(with("0 2 2").contains("must ascend"));
        assert!(with("0 2").contains("2 numbers where 3"));
        assert!(with("0 2 nan").contains("ascend"));
        let none = grid("0 0 0 0 0 0", &[("0 0 0 0 0 0", ["0", "0", "0"], "0")])
            .replace("Coordinates", "Places");
        assert!(load(&none).unwrap_err().to_string().contains("0 arrays"));
    }
}
