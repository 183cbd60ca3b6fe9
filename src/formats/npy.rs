//! NumPy arrays (`.npy`, versions 1 to 3): volumes, points, and samples at any positions. Follows
//! the format's description in NumPy Enhancement Proposal 1.

mod header;
mod volume;

pub(super) use header::Header;
pub use volume::read_volume;
pub(super) use volume::{Shaped, plain, shaped, volume_of};

use super::{
    Kind, ReadOptions,
    shared::{
        cloud::Cloud,
        gather::{Columns, gather},
        grid::too_few,
    },
};
use crate::{Result, input::Source, scattered::Points, surface::Mesh};
use glam::DVec3;

/// Returns the kind of data in an array: a point cloud (n × 3), samples (n × 4, n × 5 or n × 10),
/// or a volume (three axes and more, or a picture of two).
///
/// # Errors
/// As [`read`], for the header; [`Error::Input`](crate::Error::Input) for any other shape.
pub fn kind(source: &Source) -> Result<Kind> {
    let header = Header::of(source)?;
    match header.shape[..] {
        [_, 3] => Ok(Kind::Mesh),
        [_, 4 | 5 | 10] => Ok(Kind::Samples),
        [_, _, _, ..] => Ok(Kind::Volume),
        [_, _] if shaped(&header, "header").is_picture() => Ok(Kind::Volume),
        _ => Err(header.wrong_shape(source)),
    }
}

/// Reads rows of x, y, z and value, followed by nothing, a radius, or the six terms xx, xy, xz, yy,
/// yz, zz of a covariance.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not such an array, for another size
/// than the header claims, and for numbers that are not finite, with the row.
/// [`Error::Limit`](crate::Error::Limit) for more rows than the limits allow points.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Points> {
    let header = Header::of(source)?;
    let [_, 4 | 5 | 10] = header.shape[..] else { return Err(header.wrong_shape(source)) };
    let (numbers, rows, width) = rows(source, &header)?;
    source.spend("the size of the samples in bytes", Columns::ROW * rows as u64)?;
    let row = |row: usize| &numbers[row * width..][..width];
    let columns = Columns {
        values: (0..rows).map(|index| row(index)[3]).collect(),
        radii: if width == 5 {
            (0..rows).map(|index| row(index)[4] as f32).collect()
        } else {
            Vec::new()
        },
        covariances: if width == 10 {
            (0..rows).map(|index| std::array::from_fn(|term| row(index)[4 + term] as f32)).collect()
        } else {
            Vec::new()
        },
    };
    gather(
        source,
        rows,
        |index| DVec3::from_slice(row(index)),
        |index| format!("row {index}"),
        columns,
        options,
    )
}

/// Reads rows of x, y and z as a point cloud.
///
/// # Errors
/// As [`read`].
pub fn read_cloud(source: &Source) -> Result<Mesh> {
    let header = Header::of(source)?;
    let [_, 3] = header.shape[..] else { return Err(header.wrong_shape(source)) };
    let (numbers, rows, _) = rows(source, &header)?;
    if rows == 0 {
        return Err(source.error("header", "contains no points"));
    }
    let places = numbers.as_chunks().0;
    let positions = places.iter().copied().map(DVec3::from_array).collect();
    Cloud { positions, ..Cloud::default() }.into_mesh(source)
}

/// The numbers of an array of one or two axes, rows one after the other.
pub(super) struct Numbers {
    pub values: Vec<f64>,
    /// Numbers of a row.
    pub width: usize,
}

/// Returns the numbers of a file of two axes, with their rows and columns.
fn rows(source: &Source, header: &Header) -> Result<(Vec<f64>, usize, usize)> {
    let rows = source.check_points("the number of rows", header.shape[0])?;
    let Numbers { values, width } = numbers(source, header, &source.bytes()[header.start..])?;
    Ok((values, rows, width))
}

/// Returns the numbers of an array of one or two axes, of which `data` are the bytes.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for another size than the header claims.
pub(super) fn numbers(source: &Source, header: &Header, data: &[u8]) -> Result<Numbers> {
    let size = |n: &u64| usize::try_from(*n).unwrap_or(usize::MAX);
    let rows = header.shape.first().map_or(1, size);
    let width = header.shape.get(1).map_or(1, size);
    let numbers = rows.saturating_mul(width);
    let size = (numbers as u64).saturating_mul(header.element.bytes() as u64);
    if data.len() as u64 != size {
        return Err(too_few(source, data.len(), size as usize));
    }
    source.room::<f64>("the numbers", numbers)?;
    let mut values = header.element.doubles(data, header.endian);
    if header.is_fortran {
        source.room::<f64>("the numbers", numbers)?;
        let index = |at: usize| at / width + at % width * rows;
        values = (0..numbers).map(|at| values[index(at)]).collect();
    }
    Ok(Numbers { values, width })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, input::testing::*, volume::Volume};
    use glam::Vec3;

    fn read(source: &Source) -> Result<Points> {
        super::read(source, &ReadOptions::default())
    }

    fn file(version: u8, descr: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let text =
            format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}    \n");
        let mut file = b"\x93NUMPY".to_vec();
        file.extend([version, 0]);
        match version {
            1 => file.extend((text.len() as u16).to_le_bytes()),
            _ => file.extend((text.len() as u32).to_le_bytes()),
        }
        file.extend(text.bytes());
        file.extend(data);
        file
    }

    fn load(content: &[u8]) -> Result<Points> {
        let folder = Folder::new();
        read_with(&folder.write("a.npy", content), read)
    }

    #[test]
    fn types_versions_and_shapes() {
        for (width, version) in [(4, 1), (5, 2), (10, 3)] {
            let rows: [[f64; 10]; 2] = [
                [1., 2., 3., -0.5, 4., 1., 0., 2., 0., 1.],
                [5., 6., 7., 8., 2., 0., 0., 2., 0., 2.],
            ];
            let numbers: Vec<f64> = rows.iter().flat_map(|row| row[..width].to_vec()).collect();
            let wide =
                |to: fn(f64) -> [u8; 8]| numbers.iter().flat_map(|&v| to(v)).collect::<Vec<u8>>();
            let narrow = |to: fn(f32) -> [u8; 4]| {
                numbers.iter().flat_map(|&v| to(v as f32)).collect::<Vec<u8>>()
            };
            for (descr, data) in [
                ("'<f8'", wide(f64::to_le_bytes)),
                ("'>f8'", wide(f64::to_be_bytes)),
                ("'<f4'", narrow(f32::to_le_bytes)),
                ("'>f4'", narrow(f32::to_be_bytes)),
            ] {
                let points =
                    load(&file(version, descr, "False", &format!("(2, {width})"), &data)).unwrap();
                assert_eq!(points.positions, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(5.0, 6.0, 7.0)]);
                assert_eq!(points.values, [-0.5, 8.0]);
                assert_eq!(points.radii, if width == 5 { vec![4.0, 2.0] } else { vec![] });
                let terms = vec![[4.0, 1.0, 0.0, 2.0, 0.0, 1.0], [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]];
                assert_eq!(points.covariances, if width == 10 { terms } else { vec![] });
            }
        }
    }

    fn volume(content: &[u8], options: &ReadOptions) -> Result<Volume> {
        let folder = Folder::new();
        let path = folder.write("a.npy", content);
        assert_eq!(read_with(&path, kind)?, Kind::Volume);
        read_with(&path, |source| read_volume(source, options))
    }

    fn values(volume: &Volume) -> Vec<f64> {
        (0..volume.len()).map(|index| volume.value(index)).collect()
    }

    #[test]
    fn arrays_of_three_axes_are_volumes() {
        let data: Vec<u8> = (0..6).collect();
        // Whatever the order, the fastest axis is x.
        for (order, shape) in [("False", "(1, 2, 3)"), ("True", "(3, 2, 1)")] {
            let file = file(1, "'|u1'", order, shape, &data);
            let read = volume(&file, &ReadOptions::default()).unwrap();
            assert_eq!(read.lattice.dims, [3, 2, 1], "{order}");
            assert_eq!(values(&read), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        }
        let half: Vec<u8> =
            [1.0, -0.5].iter().flat_map(|&v| half::f16::from_f32(v).to_be_bytes()).collect();
        let complex: Vec<u8> =
            [3.0, 4.0, 0.0, 1.0f64].iter().flat_map(|v| v.to_le_bytes()).collect();
        for (descr, data, expected) in [
            ("'|b1'", vec![0, 1], [0.0, 1.0]),
            ("'>f2'", half, [1.0, -0.5]),
            ("'<c16'", complex, [5.0, 1.0]),
            ("'>i2'", vec![1, 0, 255, 255], [256.0, -1.0]),
            ("'=u8'", [3u64, 4].iter().flat_map(|v| v.to_le_bytes()).collect(), [3.0, 4.0]),
        ] {
            let file = file(2, descr, "False", "(1, 1, 2)", &data);
            assert_eq!(
                values(&volume(&file, &ReadOptions::default()).unwrap()),
                expected,
                "{descr}"
            );
        }
    }

    #[test]
    fn a_fourth_axis_has_components_or_times() {
        let data: Vec<u8> = vec![3, 4, 0, 1];
        let default = ReadOptions::default();
        let vectors = file(1, "'|u1'", "False", "(1, 1, 2, 2)", &data);
        assert_eq!(values(&volume(&vectors, &default).unwrap()), [5.0, 1.0]);
        let second = ReadOptions::scalar(Some("v:1"));
        assert_eq!(values(&volume(&vectors, &second).unwrap()), [4.0, 1.0]);
        let at = |time| ReadOptions { time: Some(time), ..ReadOptions::default() };
        let times = file(1, "'|u1'", "False", "(2, 1, 1, 2)", &data);
        assert_eq!(values(&volume(&times, &at(1)).unwrap()), [0.0, 1.0]);
        assert!(volume(&times, &at(2)).unwrap_err().to_string().contains("has 2 times"));
        let squeezed = file(1, "'|u1'", "False", "(1, 2, 2, 1, 1)", &data);
        assert_eq!(volume(&squeezed, &default).unwrap().lattice.dims, [1, 2, 2]);
        let unclear = file(1, "'|u1'", "False", "(1, 2, 2, 9)", &[0; 36]);
        assert_eq!(volume(&unclear, &default).unwrap().lattice.dims, [9, 2, 2]);
        let unclear = file(1, "'|u1'", "False", "(2, 2, 2, 9)", &[0; 72]);
        let error = volume(&unclear, &default).unwrap_err();
        assert!(error.to_string().contains("the shape (2, 2, 2, 9), but (z, y, x)"), "{error}");
    }

    #[test]
    fn arrays_of_three_columns_are_points() {
        let data: Vec<u8> =
            [1.0, 2.0, 3.0, 5.0, 2.0, 3.0f64].iter().flat_map(|v| v.to_le_bytes()).collect();
        let folder = Folder::new();
        let path = folder.write("a.npy", file(1, "'<f8'", "False", "(2, 3)", &data));
        assert_eq!(read_with(&path, kind).unwrap(), Kind::Mesh);
        let cloud = read_with(&path, read_cloud).unwrap();
        assert_eq!(cloud.positions, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(5.0, 2.0, 3.0)]);
        let order = folder.write("b.npy", file(1, "'<f8'", "True", "(2, 3)", &data));
        let cloud = read_with(&order, read_cloud).unwrap();
        assert_eq!(cloud.origin + cloud.positions[1].as_dvec3(), DVec3::new(2.0, 5.0, 3.0));
        let empty = folder.write("c.npy", file(1, "'<f8'", "True", "(0, 3)", &[]));
        assert!(read_with(&empty, read_cloud).is_err());
    }

    #[test]
    fn cuts_lies_and_other_arrays_are_errors() {
        let data: Vec<u8> = [1f32, 2.0, 3.0, 4.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let folder = Folder::new();
        every_cut(&folder, "a.npy", &file(1, "'<f4'", "False", "(1, 4)", &data), read);
        for (content, word) in [
            (file(1, "'<M8[s]'", "False", "(1, 4)", &data), "'<M8[s]'"),
            (file(1, "[('x', '<f4'), ('y', '<f4')]", "False", "(1,)", &data), "('y', '<f4')"),
            (file(1, "'<f4'", "maybe", "(1, 4)", &data), "the order “maybe”"),
            (file(1, "'<f4'", "False", "(4,)", &data), "shape (4,)"),
            (file(1, "'<f4'", "False", "(1, 6)", &data), "shape (1, 6)"),
            (file(1, "'<f4'", "False", "(-1, 4)", &data), "the shape (-1, 4), but a tuple"),
            (file(1, "'<f4'", "False", "(2, 4)", &data), "16 bytes where 32"),
            (file(1, "'<f4'", "False", "(0, 4)", &[]), "no samples"),
            (file(4, "'<f4'", "False", "(1, 4)", &data), "not a NumPy header"),
            (
                file(1, "'<f4'", "False", "(1, 4)", &[0, 0, 192, 127].repeat(4)),
                "none is at finite coordinates",
            ),
        ] {
            let message = load(&content).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        let lie = load(&file(1, "'<f4'", "False", "(1099511627776, 4)", &data)).unwrap_err();
        assert!(matches!(lie, Error::Limit { .. }));
    }
}
