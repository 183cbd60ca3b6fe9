//! STL, binary and as text. Every triangle has three vertices of its own; vertices at the same
//! position are merged when surfels are made. The facets' normals add nothing to their corners, so
//! they are ignored.

use crate::{
    Result,
    input::{Source, copy, growing::Growing, positions, text::lines_of},
    surface::Mesh,
};
use glam::DVec3;

/// Bytes before the count of a binary file, and bytes per facet.
const HEADER: usize = 80;
const FACET: usize = 50;

/// Reads an STL file. It is binary if its size matches its count of facets, whatever its first word
/// is.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a size that does not match the count, with the line
/// for text that does not follow the format, for positions that are not finite, and for a file
/// without triangles; [`Error::Limit`](crate::Error::Limit) for more facets than the limits allow.
pub fn read(source: &Source) -> Result<Mesh> {
    let bytes = source.bytes();
    let count = bytes
        .get(HEADER..)
        .and_then(|rest| rest.first_chunk())
        .map(|&count| u32::from_le_bytes(count));
    let size = count.map(|count| HEADER as u64 + 4 + u64::from(count) * FACET as u64);
    // Some writers append a few bytes of their own.
    let fits = size.is_some_and(|size| (size..size + FACET as u64).contains(&(bytes.len() as u64)));
    // Text has no zero bytes; a count and three numbers have several.
    let is_text = bytes.trim_ascii_start().starts_with(b"solid")
        && !bytes.iter().take(HEADER + 4 + FACET).any(|&b| b == 0);
    let (corners, lines) = if !fits && is_text {
        of_text(source)?
    } else {
        let (Some(count), Some(size)) = (count, size) else {
            return Err(source.error(
                "header",
                format!("ends after {} bytes, before its count of facets", bytes.len()),
            ));
        };
        source.check_points("the count of facets", u64::from(count))?;
        if !fits {
            let message = format!(
                "counts {count} facets, which need {size} bytes, but the file has {}",
                bytes.len()
            );
            return Err(source.error("header", message).hint(
                "the file is cut off or in another \
                                                             format",
            ));
        }
        source.room::<[DVec3; 3]>("the corners", count as usize)?;
        (of_bytes(&bytes[HEADER + 4..], count as usize), Vec::new())
    };
    if corners.is_empty() {
        return Err(source.error("file", "contains no facets"));
    }
    let place = |corner: usize| match lines.get(corner) {
        Some(line) => format!("line {line}"),
        None => format!("facet {}", corner / 3),
    };
    let (origin, positions) =
        positions::settle(source, corners.len(), |corner| corners[corner], place)?;
    source.room::<u32>("the triangles", positions.len())?;
    let triangles = (0..positions.len() as u32 / 3)
        .map(|facet| [0, 1, 2].map(|corner| facet * 3 + corner))
        .collect();
    Ok(Mesh { origin, positions, triangles, ..Mesh::default() })
}

fn of_bytes(facets: &[u8], count: usize) -> Vec<DVec3> {
    let corners = facets.chunks_exact(FACET).take(count).flat_map(|facet| {
        let number =
            |at: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|byte| facet[at + byte])));
        // After the normal.
        [12, 24, 36].map(|at| DVec3::new(number(at), number(at + 4), number(at + 8)))
    });
    corners.collect()
}

/// Returns the corners of a text file, and the line of each. Only the words `facet`, `vertex` and
/// the ends of facets and solids matter. Any name may follow `solid`.
fn of_text(source: &Source) -> Result<(Vec<DVec3>, Vec<usize>)> {
    let mut corners = Growing::new(source, "the corners");
    let mut lines = Growing::new(source, "the line numbers of the corners");
    let mut in_solid = false;
    let mut start = None;
    let mut last = 1;
    for (number, line) in (1..).zip(lines_of(source.bytes())) {
        let wrong = |message: String| source.error(format!("line {number}"), message);
        let text = copy::lossy(line);
        let mut words = text.split_ascii_whitespace();
        let Some(word) = words.next() else { continue };
        last = number;
        match (word.to_ascii_lowercase().as_str(), start) {
            ("solid", None) => in_solid = true,
            ("endsolid", None) => in_solid = false,
            ("facet", None) if in_solid => start = Some(corners.len()),
            ("outer" | "endloop", Some(_)) => {}
            ("vertex", Some(_)) => {
                let mut next = || words.next().and_then(|word| word.parse::<f64>().ok());
                let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
                    return Err(wrong("a vertex needs three numbers".into()));
                };
                corners.push(DVec3::new(x, y, z))?;
                lines.push(number)?;
                source.check_points("the number of corners", corners.len() as u64 / 3)?;
            }
            ("endfacet", Some(first)) => {
                if corners.len() - first != 3 {
                    return Err(wrong(format!(
                        "the facet has {} corners, not 3",
                        corners.len() - first
                    )));
                }
                start = None;
            }
            _ => {
                let shown: String = word.chars().take(40).collect();
                return Err(wrong(format!("“{shown}” does not belong here")));
            }
        }
    }
    if in_solid || start.is_some() {
        return Err(
            source.error(format!("line {last}"), "the file ends before “endsolid”: it is cut")
        );
    }
    Ok((corners.into_inner(), lines.into_inner()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Error,
        input::{Limits, testing::*},
        surface::SurfelOptions,
    };
    use glam::Vec3;

    fn binary(count: u32, facets: &[[f32; 9]]) -> Vec<u8> {
        // The first word of many binary files.
        let mut file = b"solid made by a program ".to_vec();
        file.resize(HEADER, b' ');
        file.extend(count.to_le_bytes());
        for facet in facets {
            file.extend([0; 12]);
            facet.iter().for_each(|number| file.extend(number.to_le_bytes()));
            file.extend([0; 2]);
        }
        file
    }

    const FACETS: [[f32; 9]; 2] =
        [[0., 0., 0., 1., 0., 0., 0., 1., 0.], [1., 0., 0., 1., 1., 0., 0., 1., 0.]];
    const TEXT: &str = "solid two of them\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n \
                        vertex 1 0 0\n vertex 0 1 0\nendloop\n endfacet\n\nFACET NORMAL 0 0 1\r\n\
                        OUTER LOOP\r\nVERTEX 1e0 0 0\r\nVERTEX 1 1 0\r\nVERTEX 0 1 -0\r\n\
                        ENDLOOP\r\nENDFACET\r\nendsolid";

    fn load(content: impl AsRef<[u8]>) -> Result<Mesh> {
        let folder = Folder::new();
        read_with(&folder.write("a.stl", content), read)
    }

    #[test]
    fn binary_and_text_say_the_same() {
        for content in [binary(2, &FACETS), [binary(2, &FACETS), vec![0; 7]].concat(), TEXT.into()]
        {
            let mesh = load(content).unwrap();
            assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
            assert_eq!(mesh.positions[1..5], [Vec3::X, Vec3::Y, Vec3::X, Vec3::new(1.0, 1.0, 0.0)]);
            // Shared corners are merged.
            let whole = SurfelOptions { largest_spacing: 9.0, ..SurfelOptions::default() };
            assert_eq!(mesh.surfels(&whole).unwrap().splats.len(), 4);
        }
    }

    #[test]
    fn cuts_and_lies_are_errors() {
        let folder = Folder::new();
        every_cut(&folder, "a.stl", &binary(2, &FACETS), read);
        every_cut(&folder, "a.stl", TEXT.as_bytes(), read);
        for (content, word) in [
            (binary(3, &FACETS), "counts 3 facets, which need 234 bytes, but the file has 184"),
            (binary(1, &FACETS), "counts 1 facets"),
            (binary(0, &[]), "no facets"),
            (binary(2, &[FACETS[0], [f32::NAN; 9]]), "facet 1: the position"),
            (TEXT.replace("1e0", "one").into(), "line 12: a vertex needs three numbers"),
            (TEXT.replace("VERTEX 1 1 0\r\n", "").into(), "line 15: the facet has 2 corners"),
            (
                TEXT.replace("VERTEX 1 1 0", "edge 1 1 0").into(),
                "line 13: “edge” does not belong here",
            ),
            (TEXT.replace("VERTEX 1 1 0", "VERTEX 1 inf 0").into(), "line 13: the position"),
            (b"solid empty\nendsolid".to_vec(), "no facets"),
        ] {
            let message = load(content).unwrap_err().to_string();
            assert!(message.contains(word), "{word}: {message}");
        }
        let limits = Limits { points: 1, ..Limits::default() };
        for content in [binary(2, &FACETS), TEXT.into()] {
            let path = folder.write("b.stl", content);
            assert!(matches!(
                read(&Source::open(&path, &limits).unwrap()),
                Err(Error::Limit { .. })
            ));
        }
        let all = binary(u32::MAX, &FACETS);
        assert!(matches!(load(all), Err(Error::Limit { .. })));
    }
}
