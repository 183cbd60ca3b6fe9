//! NumPy arrays (`.npy`, versions 1 to 3) of samples: n rows of 4, 5 or 10 floats in C order.
//! Follows the format's description in NumPy Enhancement Proposal 1.

use super::{
    Endian, ReadOptions, SampleType,
    shared::gather::{Columns, gather},
};
use crate::{
    Result,
    input::{Source, copy},
    scattered::Points,
};
use glam::DVec3;

/// Reads rows of x, y, z and value, followed by nothing, a radius, or the six terms xx, xy, xz, yy,
/// yz, zz of a covariance.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not such an array, for another size
/// than the header claims, and for numbers that are not finite, with the row;
/// [`Error::Limit`](crate::Error::Limit) for more rows than the limits allow points.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Points> {
    let bytes = source.bytes();
    let (header, start) = header(bytes).ok_or_else(|| {
        source.error("header", "is cut off, is longer than 1 MiB, or is not a NumPy header")
    })?;
    let Array { kind, endian, rows, width } = Array::of(source, &header)?;
    let size = kind.bytes_of([rows, width, 1]).unwrap_or(u64::MAX);
    let data = &bytes[start..];
    if data.len() as u64 != size {
        return Err(source
            .error("data", format!("there are {} bytes where {size} were expected", data.len())));
    }
    source.room::<f64>("the numbers", rows.saturating_mul(width))?;
    source.spend("the size of the samples in bytes", Columns::ROW * rows as u64)?;
    let numbers = kind.doubles(data, endian);
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

/// The type and shape of the array, from the header.
struct Array {
    kind: SampleType,
    endian: Endian,
    rows: usize,
    /// Numbers per row: 4, 5 or 10.
    width: usize,
}

impl Array {
    fn of(source: &Source, header: &str) -> Result<Self> {
        let wrong = |message: String| source.error("header", message);
        let field =
            |name: &str| field(header, name).ok_or_else(|| wrong(format!("has no “{name}”")));
        let (kind, endian) = match field("descr")? {
            "'<f4'" => (SampleType::F32, Endian::Little),
            "'>f4'" => (SampleType::F32, Endian::Big),
            "'<f8'" => (SampleType::F64, Endian::Little),
            "'>f8'" => (SampleType::F64, Endian::Big),
            other => {
                return Err(wrong(format!(
                    "has the type {other}, but samples are floats, f4 or f8"
                )));
            }
        };
        if field("fortran_order")? != "False" {
            return Err(wrong("is in Fortran order".into()).hint("write the array in C order"));
        }
        let shape = field("shape")?;
        let Some(&[rows, width @ (4 | 5 | 10)]) = sizes(shape).as_deref() else {
            return Err(wrong(format!(
                "has the shape {shape}, but (n, 4), (n, 5) or (n, 10) was expected"
            ))
            .hint(
                "a sample is a row of x, y, z, value and then nothing, a radius, or xx, xy, xz, \
                 yy, yz, zz",
            ));
        };
        let rows = source.check_points("the number of rows", rows)?;
        Ok(Self { kind, endian, rows, width: width as usize })
    }
}

/// Returns the numbers of a Python tuple.
fn sizes(shape: &str) -> Option<Vec<u64>> {
    let inside = shape.strip_prefix('(')?.strip_suffix(')')?.trim_end_matches([',', ' ']);
    inside.split(',').map(|size| size.trim().parse().ok()).collect()
}

/// Returns the header's text, and the offset of the data.
fn header(bytes: &[u8]) -> Option<(String, usize)> {
    let version = bytes.strip_prefix(b"\x93NUMPY")?.first()?;
    let (length, start) = match version {
        1 => (usize::from(u16::from_le_bytes(*bytes.get(8..)?.first_chunk()?)), 10),
        2 | 3 => (u32::from_le_bytes(*bytes.get(8..)?.first_chunk()?) as usize, 12),
        _ => return None,
    };
    // Headers of real files are far shorter than this.
    let text = bytes.get(start..)?.get(..length).filter(|text| text.len() <= 1 << 20)?;
    Some((copy::lossy(text), start + length))
}

/// Returns the value of a name in the header, a Python dictionary: the text up to the next comma
/// outside brackets.
fn field<'a>(header: &'a str, name: &str) -> Option<&'a str> {
    let rest = header
        .split_once(&format!("'{name}':"))
        .or_else(|| header.split_once(&format!("\"{name}\":")))?
        .1;
    let mut depth = 0;
    let end = rest.find(|c| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        depth == 0 && matches!(c, ',' | '}')
    })?;
    Some(rest[..end].trim())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, input::testing::*};
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

    #[test]
    fn cuts_lies_and_other_arrays_are_errors() {
        let data: Vec<u8> = [1f32, 2.0, 3.0, 4.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let folder = Folder::new();
        every_cut(&folder, "a.npy", &file(1, "'<f4'", "False", "(1, 4)", &data), read);
        for (content, word) in [
            (file(1, "'<i4'", "False", "(1, 4)", &data), "'<i4'"),
            (file(1, "[('x', '<f4'), ('y', '<f4')]", "False", "(1,)", &data), "('y', '<f4')"),
            (file(1, "'<f4'", "True", "(1, 4)", &data), "Fortran"),
            (file(1, "'<f4'", "False", "(4,)", &data), "shape (4,)"),
            (file(1, "'<f4'", "False", "(1, 6)", &data), "shape (1, 6)"),
            (file(1, "'<f4'", "False", "(-1, 4)", &data), "shape"),
            (file(1, "'<f4'", "False", "(2, 4)", &data), "16 bytes where 32"),
            (file(1, "'<f4'", "False", "(0, 4)", &[]), "no samples"),
            (file(4, "'<f4'", "False", "(1, 4)", &data), "not a NumPy header"),
            (
                file(1, "'<f4'", "False", "(1, 4)", &[0, 0, 192, 127].repeat(4)),
                "none of the 1 samples has a value",
            ),
        ] {
            let message = load(&content).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        let lie = load(&file(1, "'<f4'", "False", "(1099511627776, 4)", &data)).unwrap_err();
        assert!(matches!(lie, Error::Limit { .. }));
    }
}
