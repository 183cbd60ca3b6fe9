//! STL, binary and as text. Every triangle has three vertices of its own; vertices at the same
//! position are merged when surfels are made. The facets' normals add nothing to their corners, so
//! they are ignored. Colours are those of VisCAM and Materialise Magics in binary files, and of a
//! line `color` in text.

use super::shared::unplaced;
use crate::{
    Result,
    input::{Source, copy, growing::Growing, positions, text},
    surface::Mesh,
    warning,
};
use glam::DVec3;

/// Bytes before the count of a binary file, and bytes per facet.
const HEADER: usize = 80;
const FACET: usize = 50;

/// The colour of facets without one beside others that have one.
const NEUTRAL: [u8; 4] = [204, 204, 204, 255];

/// What a file contains: three corners a facet, and three colours a facet, or none.
#[derive(Default)]
struct Facets {
    corners: Vec<DVec3>,
    colors: Vec<[u8; 4]>,
}

/// Reads an STL file. It is binary if its size matches its count of facets, whatever its first word
/// is; otherwise text if it looks like text. Facets with a corner that is not at finite coordinates
/// are left out.
///
/// A binary file may count no facets, or have bytes after them; a text may have lines of other
/// programs, or end without its last words. All of these are warnings.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for fewer facets than counted, with the line for text that
/// does not follow the format, and for a file without triangles;
/// [`Error::Limit`](crate::Error::Limit) for more facets than the limits allow.
pub fn read(source: &Source) -> Result<Mesh> {
    text::refuse_utf16(source)?;
    let count = count(source)?;
    let Facets { mut corners, colors } = match count {
        Some(count) => {
            source.check_points("the count of facets", count as u64)?;
            source.room::<[(DVec3, [u8; 4]); 3]>("the corners", count)?;
            of_bytes(source.bytes(), count)
        }
        None => of_text(source)?,
    };
    if corners.is_empty() {
        return Err(source.error("file", "contains no facets"));
    }
    for facet in corners.chunks_exact_mut(3) {
        if !facet.iter().all(|corner| corner.is_finite()) {
            facet.fill(DVec3::NAN);
        }
    }
    let (origin, positions) =
        positions::settle_some(source, corners.len(), |corner| corners[corner])?;
    source.room::<u32>("the triangles", positions.len())?;
    let triangles = (0..positions.len() as u32 / 3)
        .map(|facet| [0, 1, 2].map(|corner| facet * 3 + corner))
        .collect();
    let mut mesh = Mesh { origin, positions, triangles, colors, ..Mesh::default() };
    unplaced::leave_out(source, &mut mesh)?;
    Ok(mesh)
}

/// Returns the number of facets of a binary file; `None` for text.
fn count(source: &Source) -> Result<Option<usize>> {
    let bytes = source.bytes();
    let claimed = bytes.get(HEADER..).and_then(|rest| rest.first_chunk());
    let claimed = claimed.map(|&count| u32::from_le_bytes(count) as usize);
    let present = bytes.len().saturating_sub(HEADER + 4) / FACET;
    let rest = bytes.len().saturating_sub(HEADER + 4) % FACET;
    let warn = |message: String| warning::give!("{}: {message}", source.path.display());
    match claimed {
        // Some writers append a few bytes of their own.
        Some(claimed) if claimed == present && (claimed > 0 || !is_text(bytes)) => {
            Ok(Some(claimed))
        }
        _ if is_text(bytes) => Ok(None),
        None => Err(source.error(
            "header",
            format!("ends after {} bytes, before its count of facets", bytes.len()),
        )),
        // Programs that write as they compute do not know the count when they write it.
        Some(claimed) if matches!(claimed as u32, 0 | u32::MAX) && present > 0 && rest == 0 => {
            warn(format!("counts {claimed} facets, but has {present}, which are read"));
            Ok(Some(present))
        }
        Some(claimed) if claimed > 0 && claimed < present => {
            let after = bytes.len() - HEADER - 4 - claimed * FACET;
            warn(format!("has {after} bytes after its {claimed} facets, which are not read"));
            Ok(Some(claimed))
        }
        Some(claimed) => {
            source.check_points("the count of facets", claimed as u64)?;
            let message = format!(
                "counts {claimed} facets, which need {} bytes, but the file has {}",
                HEADER + 4 + claimed * FACET,
                bytes.len()
            );
            let hint = "the file is cut off or in another format";
            Err(source.error("header", message).hint(hint))
        }
    }
}

/// Returns whether a file is text. It begins with `solid` in any case, perhaps after a byte order
/// mark, and has no zero bytes at first; a count and three numbers have several.
fn is_text(bytes: &[u8]) -> bool {
    let start = text::without_mark(bytes).trim_ascii_start();
    start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && !bytes.iter().take(HEADER + 4 + FACET).any(|&b| b == 0)
}

fn of_bytes(bytes: &[u8], count: usize) -> Facets {
    let facets = || bytes[HEADER + 4..].chunks_exact(FACET).take(count);
    let corners = facets().flat_map(|facet| {
        let number =
            |at: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|byte| facet[at + byte])));
        // After the normal.
        [12, 24, 36].map(|at| DVec3::new(number(at), number(at + 4), number(at + 8)))
    });
    let words = || facets().map(|facet| u16::from_le_bytes([facet[48], facet[49]]));
    let magics = magics(&bytes[..HEADER]);
    let mut colors = Vec::new();
    if magics.is_some() || words().any(|word| word & 0x8000 != 0) {
        colors = words().flat_map(|word| [color(word, magics); 3]).collect();
    }
    Facets { corners: corners.collect(), colors }
}

/// Returns the colour of the whole that the header of a file of Materialise Magics has.
fn magics(header: &[u8]) -> Option<[u8; 4]> {
    const MARK: &[u8] = b"COLOR=";
    let at = header.windows(MARK.len()).position(|window| window == MARK)?;
    let [red, green, blue] = *header.get(at + MARK.len()..)?.first_chunk()?;
    Some([red, green, blue, 255])
}

/// Returns the colour of a facet by the 16 bits after its corners. Magics puts red in the lowest
/// five, and sets the highest for facets in the colour of the whole. VisCAM and SolidView put blue
/// in the lowest, and set the highest for facets that have a colour.
fn color(word: u16, magics: Option<[u8; 4]>) -> [u8; 4] {
    let [low, middle, high] =
        [0, 5, 10].map(|shift| ((u32::from(word >> shift & 31) * 255 + 15) / 31) as u8);
    match (magics, word & 0x8000 != 0) {
        (Some(whole), true) => whole,
        (Some(_), false) => [low, middle, high, 255],
        (None, true) => [high, middle, low, 255],
        (None, false) => NEUTRAL,
    }
}

/// Returns what a text file contains. Only the words `facet`, `vertex`, `color` and the ends of
/// facets and solids matter. Any name may follow `solid`. Other lines are skipped, with a warning.
fn of_text(source: &Source) -> Result<Facets> {
    let mut corners = Growing::new(source, "the corners");
    let mut colors = Growing::new(source, "the colours");
    let (mut has_colors, mut color) = (false, NEUTRAL);
    let mut in_solid = false;
    let mut start = None;
    let mut last = 1;
    let mut skipped: Option<(usize, String)> = None;
    for (number, line) in (1..).zip(text::lines_of(text::without_mark(source.bytes()))) {
        let wrong = |message: String| source.error(format!("line {number}"), message);
        let text = copy::lossy(line);
        let mut words = text.split_ascii_whitespace();
        let Some(word) = words.next() else { continue };
        last = number;
        match (word.to_ascii_lowercase().as_str(), start) {
            ("solid", None) => (in_solid, color) = (true, NEUTRAL),
            ("endsolid", None) => in_solid = false,
            ("end", None) if words.next().is_some_and(|w| w.eq_ignore_ascii_case("solid")) => {
                in_solid = false;
            }
            ("facet", None) if in_solid => start = Some(corners.len()),
            ("outer" | "endloop", Some(_)) => {}
            ("vertex", Some(_)) => {
                let Some(corner) = three(&mut words) else {
                    return Err(wrong("a vertex needs three numbers".into()));
                };
                corners.push(DVec3::from_array(corner))?;
                colors.push(color)?;
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
            // Between facets for those that follow, within one before its corners.
            ("color" | "colour", _) if in_solid => {
                if let Some([red, green, blue]) = three(&mut words) {
                    let byte = |part: f64| (part.clamp(0.0, 1.0) * 255.0).round() as u8;
                    color = [byte(red), byte(green), byte(blue), 255];
                    has_colors = true;
                }
            }
            _ => {
                skipped.get_or_insert_with(|| (number, word.chars().take(40).collect()));
            }
        }
    }
    if start.is_some() {
        let message = "the file ends inside a facet: it is cut";
        return Err(source.error(format!("line {last}"), message));
    }
    warn_of_text(source, skipped, in_solid);
    let colors = if has_colors { colors.into_inner() } else { Vec::new() };
    Ok(Facets { corners: corners.into_inner(), colors })
}

/// Says which line is not of the format, and that the last solid has no end.
fn warn_of_text(source: &Source, skipped: Option<(usize, String)>, is_open: bool) {
    let file = source.path.display();
    if let Some((number, word)) = skipped {
        warning::give!(
            "{file}: line {number}: “{word}” is not a word of STL; such lines are skipped"
        );
    }
    if is_open {
        warning::give!("{file}: ends before “endsolid”; it may be cut");
    }
}

/// Returns the next three words as numbers.
fn three<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<[f64; 3]> {
    let mut next = || copy::float(words.next()?.as_bytes());
    Some([next()?, next()?, next()?])
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
        // Text that ends between facets is only suspicious.
        for end in 0..TEXT.len() {
            if let Ok(mesh) = load(&TEXT[..end]) {
                let facets = TEXT[..end].to_ascii_lowercase().matches("endfacet").count();
                assert_eq!(mesh.triangles.len(), facets, "cut at {end}");
            }
        }
        for (content, word) in [
            (binary(3, &FACETS), "counts 3 facets, which need 234 bytes, but the file has 184"),
            (binary(0, &[]), "no facets"),
            (binary(2, &[[f32::NAN; 9]; 2]), "none of the 6 points"),
            (binary(0, &FACETS)[..150].to_vec(), "counts 0 facets, which need 84 bytes"),
            (TEXT.replace("1e0", "one").into(), "line 12: a vertex needs three numbers"),
            (TEXT.replace("VERTEX 1 1 0\r\n", "").into(), "line 15: the facet has 2 corners"),
            (TEXT.replace("VERTEX 1 1 0", "edge 1 1 0").into(), "line 16: the facet has 2 corners"),
            (
                TEXT.encode_utf16().fold(vec![0xff, 0xfe], |all, unit| {
                    [all, unit.to_le_bytes().to_vec()].concat()
                }),
                "UTF-16",
            ),
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
        let all = binary(u32::MAX - 1, &FACETS);
        assert!(matches!(load(all), Err(Error::Limit { .. })));
    }

    #[test]
    fn what_other_programs_read_is_read() {
        for content in [
            TEXT.to_ascii_uppercase().into(),
            format!("\u{feff}{TEXT}").into(),
            format!("\r\n {TEXT}").into(),
            TEXT.replace("endsolid", "end solid two").into(),
            TEXT.replace("endsolid", "").into(),
            TEXT.replace(" facet normal", "  color 0.9 0.2 0.2\n facet normal").into(),
            TEXT.replace("endsolid", "endsolid\nsolid\nendsolid\n\n").into(),
            TEXT.replace("\nendloop", "\n(made by hand)\nendloop").into(),
            TEXT.replace("solid two of them", "solid").into(),
            binary(0, &FACETS),
            binary(u32::MAX, &FACETS),
            [binary(2, &FACETS), vec![7; 3000]].concat(),
        ] {
            let text = copy::lossy(&content);
            let mesh = load(content).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(mesh.triangles.len(), 2, "{text}");
        }
    }

    #[test]
    fn facets_without_a_place_are_left_out() {
        let mut bad = FACETS[1];
        bad[4] = f32::NAN;
        let mesh = load(binary(3, &[FACETS[0], bad, FACETS[1]])).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles), (6, vec![[0, 1, 2], [3, 4, 5]]));
        let mesh = load(TEXT.replace("VERTEX 1 1 0", "VERTEX 1 -nan(ind) 0")).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn facets_have_the_colours_of_both_conventions() {
        let colored = |header: &[u8], words: [u16; 2]| {
            let mut file = binary(2, &FACETS);
            file[..header.len()].copy_from_slice(header);
            for (facet, word) in words.into_iter().enumerate() {
                let at = HEADER + 4 + facet * FACET + 48;
                file[at..at + 2].copy_from_slice(&word.to_le_bytes());
            }
            load(file).unwrap().colors
        };
        // Red, and none.
        let viscam = colored(b"", [0x8000 | 31 << 10, 31]);
        assert_eq!((viscam[0], viscam[3]), ([255, 0, 0, 255], NEUTRAL));
        assert!(colored(b"", [31, 7]).is_empty(), "words that are no colours");
        // Red, and that of the whole.
        let magics = colored(b"COLOR=\x01\x02\x03\xff,MATERIAL=", [31, 0x8000]);
        assert_eq!((magics[2], magics[5]), ([255, 0, 0, 255], [1, 2, 3, 255]));
        let text = TEXT.replace("endfacet\n\n", "endfacet\ncolor 1 0 0.2\n");
        let text = load(text).unwrap().colors;
        assert_eq!((text[0], text[3]), (NEUTRAL, [255, 0, 51, 255]));
    }
}
