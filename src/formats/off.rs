//! OFF, the Object File Format of Geomview: as text and binary, with normals and colours (COFF,
//! NOFF, …). Follows the description of Geomview 1.9.

use super::shared::{cloud::colors_of_numbers, polygon};
use crate::{
    Result,
    input::{Source, copy, growing::Growing, positions, text::lines_of},
    surface::Mesh,
};
use glam::{DVec3, Vec3};

/// The largest number of corners of a face.
const MOST_CORNERS: usize = 1 << 20;

/// What the first word says of the vertices.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Header {
    has_normals: bool,
    has_colors: bool,
    has_uvs: bool,
    /// Vertices have a fourth coordinate, or as many as a further number says.
    is_of_more_axes: bool,
    is_binary: bool,
}

/// Reads a mesh, or points if there are no faces. Colours are those of the vertices, else those of
/// the faces. The first word may be missing.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with the line for text that does not follow the format,
/// and for fewer vertices or faces than are counted. Also for corners that do not exist, positions
/// that are not finite and space of other than three axes. [`Error::Limit`](crate::Error::Limit)
/// for more vertices or faces than the limits allow.
pub fn read(source: &Source) -> Result<Mesh> {
    let (header, start) = header(source.bytes()).unwrap_or_default();
    if header.is_of_more_axes {
        let message = "vertices have four coordinates or more, and three are read";
        return Err(source.error("line 1", message));
    }
    let parts = Parts::new(source);
    match header.is_binary {
        true => Binary { source, rest: &source.bytes()[start..] }.read(header, parts),
        false => Text::new(source, start).read(header, parts),
    }?
    .mesh(source)
}

/// Returns whether the first bytes are of a file with its first word.
pub(super) fn is_off(bytes: &[u8]) -> bool {
    let skipped = bytes.len() - bytes.trim_ascii_start().len();
    // A word of three letters is short for a sign: counts or an end of the line follow it.
    header(&bytes[skipped..]).is_some_and(|(header, end)| {
        let next = bytes[skipped + end..].iter().find(|byte| !matches!(byte, b' ' | b'\t' | b'\r'));
        header.is_binary
            || next.is_none_or(|byte| byte.is_ascii_digit() || matches!(byte, b'\n' | b'#'))
    })
}

/// Returns what the first word says, and where it ends; `None` if there is none.
fn header(bytes: &[u8]) -> Option<(Header, usize)> {
    let mut header = Header::default();
    let mut rest = bytes.trim_ascii_start();
    while rest.starts_with(b"#") {
        let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        rest = rest[end..].trim_ascii_start();
    }
    let mut take = |word: &[u8]| {
        let tail = rest.strip_prefix(word);
        rest = tail.unwrap_or(rest);
        tail.is_some()
    };
    header.has_uvs = take(b"ST");
    header.has_colors = take(b"C");
    header.has_normals = take(b"N");
    header.is_of_more_axes = take(b"4");
    header.is_of_more_axes |= take(b"n");
    if !take(b"OFF") {
        return None;
    }
    header.is_binary = take(b" BINARY\n") || take(b" BINARY\r\n");
    Some((header, bytes.len() - rest.len()))
}

/// What is read of a file.
struct Parts<'a> {
    positions: Growing<'a, DVec3>,
    normals: Growing<'a, Vec3>,
    /// Three or four numbers of each vertex.
    colors: Growing<'a, f64>,
    width: usize,
    triangles: Growing<'a, [u32; 3]>,
    /// The colour of each triangle; not a number if its face has none.
    of_triangles: Growing<'a, [f64; 4]>,
    has_face_colors: bool,
}

impl<'a> Parts<'a> {
    fn new(source: &'a Source) -> Self {
        Self {
            positions: Growing::new(source, "the vertices"),
            normals: Growing::new(source, "the normals"),
            colors: Growing::new(source, "the colours"),
            width: 0,
            triangles: Growing::new(source, "the triangles"),
            of_triangles: Growing::new(source, "the colours of the faces"),
            has_face_colors: false,
        }
    }

    /// Adds a vertex, of whose numbers the first three are its position. `wrong` makes the error of
    /// a message.
    fn vertex(
        &mut self,
        header: Header,
        numbers: &[f64],
        wrong: impl Fn(String) -> crate::Error,
    ) -> Result<()> {
        let [x, y, z, rest @ ..] = numbers else {
            let message = format!("a vertex needs three numbers, but has {}", numbers.len());
            return Err(wrong(message));
        };
        self.positions.push(DVec3::new(*x, *y, *z))?;
        let mut rest = rest;
        if header.has_normals {
            let Some(([x, y, z], behind)) = rest.split_first_chunk() else {
                return Err(wrong("a vertex lacks its normal".into()));
            };
            self.normals.push(DVec3::new(*x, *y, *z).as_vec3())?;
            rest = behind;
        }
        if header.has_uvs {
            rest = &rest[..rest.len().saturating_sub(2)];
        }
        // Some writers add colours without the letter.
        if self.positions.len() == 1 {
            self.width = if matches!(rest.len(), 3 | 4) { rest.len() } else { 0 };
            if header.has_colors && self.width == 0 {
                return Err(wrong("a vertex lacks its colour of three or four numbers".into()));
            }
        }
        if rest.len() < self.width {
            let message = format!("the colour has {} numbers, not {}", rest.len(), self.width);
            return Err(wrong(message));
        }
        rest[..self.width].iter().try_for_each(|&part| self.colors.push(part))
    }

    /// Adds a face with its colour: three or four numbers, or none.
    fn face(&mut self, corners: &[u32], color: &[f64]) -> Result<()> {
        let color = match *color {
            [red, green, blue] => [red, green, blue, f64::INFINITY],
            [red, green, blue, alpha] => [red, green, blue, alpha],
            _ => [f64::NAN; 4],
        };
        self.has_face_colors |= !color[0].is_nan();
        let Self { positions, triangles, of_triangles, .. } = self;
        let position = |corner: u32| positions[corner as usize];
        polygon::triangles(corners, position, |triangle| {
            triangles.push(triangle)?;
            of_triangles.push(color)
        })
    }

    fn mesh(self, source: &Source) -> Result<Mesh> {
        if self.positions.is_empty() {
            return Err(source.error("file", "contains no vertices"));
        }
        let mut colors = match self.width {
            0 => Vec::new(),
            width => colors_of_numbers(&self.colors, width),
        };
        let (mut places, mut normals) = (self.positions.into_inner(), self.normals.into_inner());
        let mut triangles = self.triangles.into_inner();
        if self.has_face_colors && colors.is_empty() {
            // Each corner has a vertex of its own, with the colour of its face.
            source.room::<(DVec3, Vec3, [u8; 4])>("the corners", 3 * triangles.len())?;
            let face_colors = colors_of_faces(&self.of_triangles);
            let corners = || triangles.iter().flatten().map(|&corner| corner as usize);
            if !normals.is_empty() {
                normals = corners().map(|corner| normals[corner]).collect();
            }
            places = corners().map(|corner| places[corner]).collect();
            colors = face_colors.into_iter().flat_map(|color| [color; 3]).collect();
            let next = |triangle: u32| [0, 1, 2].map(|corner| 3 * triangle + corner);
            triangles = (0..triangles.len() as u32).map(next).collect();
        }
        let place = |vertex: usize| format!("vertex {vertex}");
        let (origin, positions) =
            positions::settle(source, places.len(), |vertex| places[vertex], place)?;
        let normals = normals.into_iter().map(positions::unit).collect();
        Ok(Mesh { origin, positions, normals, colors, triangles, ..Mesh::default() })
    }
}

/// Returns the colours of triangles. Those without one are white.
fn colors_of_faces(colors: &[[f64; 4]]) -> Vec<[u8; 4]> {
    let is_finite = |part: &&f64| part.is_finite();
    let largest = colors.iter().flatten().filter(is_finite).copied().fold(0.0, f64::max);
    let whole = if largest > 1.0 { 255.0 } else { 1.0 };
    let full = |part: f64| if part.is_finite() { part } else { whole };
    let parts: Vec<f64> = colors.iter().flatten().map(|&part| full(part)).collect();
    colors_of_numbers(&parts, 4)
}

/// Checks the corners of a face.
fn corners(numbers: &[f64], vertices: usize, out: &mut Vec<u32>) -> Result<(), String> {
    out.clear();
    for &number in numbers {
        if number.fract() != 0.0 || !(0.0..vertices as f64).contains(&number) {
            return Err(format!(
                "refers to vertex {number}, but there are {vertices}, which count from 0"
            ));
        }
        out.push(number as u32);
    }
    Ok(())
}

/// A text, line by line.
struct Text<'a> {
    source: &'a Source<'a>,
    lines: Box<dyn Iterator<Item = (usize, &'a [u8])> + 'a>,
    /// The number of the last line.
    last: usize,
    numbers: Vec<f64>,
}

impl<'a> Text<'a> {
    fn new(source: &'a Source<'a>, start: usize) -> Self {
        let before = source.bytes()[..start].iter().filter(|&&byte| byte == b'\n').count();
        let lines = (1 + before..).zip(lines_of(&source.bytes()[start..]));
        Self { source, lines: Box::new(lines), last: 1, numbers: Vec::new() }
    }

    /// Reads the numbers of the next line that has some. Returns whether there is one.
    fn line(&mut self) -> Result<bool> {
        self.numbers.clear();
        while self.numbers.is_empty() {
            let Some((number, line)) = self.lines.next() else { return Ok(false) };
            self.last = number;
            let line = line.split(|&byte| byte == b'#').next().unwrap_or_default();
            for word in line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()) {
                let Some(value) = copy::number::<f64>(word) else {
                    let message = format!("{:?} is not a number", copy::excerpt(word));
                    return Err(self.wrong(message));
                };
                self.numbers.push(value);
                if self.numbers.len() > MOST_CORNERS {
                    return Err(self.wrong(format!("has more than {MOST_CORNERS} numbers")));
                }
            }
        }
        Ok(true)
    }

    fn wrong(&self, message: impl Into<String>) -> crate::Error {
        self.source.error(format!("line {}", self.last), message)
    }

    /// Reads the next line, which must be there.
    fn need(&mut self, what: &str, at: u64, count: u64) -> Result<()> {
        if self.line()? {
            return Ok(());
        }
        Err(self.wrong(format!("the file ends before {what} {at} of {count}")))
    }

    fn read(mut self, header: Header, mut parts: Parts<'a>) -> Result<Parts<'a>> {
        if !self.line()? {
            return Err(self.wrong("the counts of vertices and faces are missing"));
        }
        let count = |at: usize| {
            let number = self.numbers.get(at).copied();
            number.filter(|number| *number >= 0.0 && number.fract() == 0.0)
        };
        let (Some(vertices), Some(faces)) = (count(0), count(1)) else {
            return Err(self.wrong("the numbers of vertices and of faces were expected"));
        };
        let (vertices, faces) = (vertices as u64, faces as u64);
        self.source.check_points("the number of vertices", vertices)?;
        self.source.check_points("the number of faces", faces)?;
        for vertex in 0..vertices {
            self.need("vertex", vertex, vertices)?;
            parts.vertex(header, &self.numbers, |message| self.wrong(message))?;
        }
        let mut indices = Vec::new();
        for face in 0..faces {
            self.need("face", face, faces)?;
            let [count, rest @ ..] = &self.numbers[..] else { continue };
            let size = Some(*count).filter(|count| count.fract() == 0.0 && *count >= 1.0);
            let Some((list, color)) = size.and_then(|size| rest.split_at_checked(size as usize))
            else {
                let message = format!("a face of {count} corners has {} numbers", rest.len());
                return Err(self.wrong(message));
            };
            let vertices = parts.positions.len();
            corners(list, vertices, &mut indices).map_err(|message| self.wrong(message))?;
            parts.face(&indices, color)?;
        }
        Ok(parts)
    }
}

/// What is left of a binary file: numbers of 32 bits, the highest byte first.
struct Binary<'a> {
    source: &'a Source<'a>,
    rest: &'a [u8],
}

impl<'a> Binary<'a> {
    fn word(&mut self) -> Result<[u8; 4]> {
        let Some((&word, rest)) = self.rest.split_first_chunk() else {
            let message = "ends before all of its vertices and faces";
            return Err(self.source.error("file", message));
        };
        self.rest = rest;
        Ok(word)
    }

    fn count(&mut self, what: &str) -> Result<u64> {
        let count = i32::from_be_bytes(self.word()?);
        u64::try_from(count).map_err(|_| self.source.error("file", format!("has {count} {what}")))
    }

    fn floats(&mut self, count: usize, out: &mut Vec<f64>) -> Result<()> {
        out.clear();
        for _ in 0..count {
            out.push(f32::from_be_bytes(self.word()?).into());
        }
        Ok(())
    }

    fn read(mut self, header: Header, mut parts: Parts<'a>) -> Result<Parts<'a>> {
        let vertices = self.count("vertices")?;
        let faces = self.count("faces")?;
        self.count("edges")?;
        self.source.check_points("the number of vertices", vertices)?;
        self.source.check_points("the number of faces", faces)?;
        let width = 3
            + 3 * usize::from(header.has_normals)
            + 4 * usize::from(header.has_colors)
            + 2 * usize::from(header.has_uvs);
        let (mut numbers, mut indices) = (Vec::new(), Vec::new());
        for vertex in 0..vertices {
            self.floats(width, &mut numbers)?;
            let wrong = |message| self.source.error(format!("vertex {vertex}"), message);
            parts.vertex(header, &numbers, wrong)?;
        }
        for face in 0..faces {
            let source = self.source;
            let wrong = |message: String| source.error(format!("face {face}"), message);
            let size = self.count("corners")? as usize;
            if size > MOST_CORNERS {
                return Err(wrong(format!("has more than {MOST_CORNERS} corners")));
            }
            numbers.clear();
            for _ in 0..size {
                numbers.push(i32::from_be_bytes(self.word()?).into());
            }
            corners(&numbers, parts.positions.len(), &mut indices).map_err(wrong)?;
            let size = self.count("numbers of a colour")?.min(4) as usize;
            self.floats(size, &mut numbers)?;
            parts.face(&indices, &numbers)?;
        }
        Ok(parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::*;

    fn load(content: impl AsRef<[u8]>) -> Result<Mesh> {
        let folder = Folder::new();
        read_with(&folder.write("a.off", content), read)
    }

    const SQUARE: &str = "0 0 0\n1 0 0 # a corner\n\n1 1 0\n0 1 0\n";

    #[test]
    fn every_first_word_and_none() {
        for first in ["OFF\n4 1 4\n", "OFF 4 1 0\n", "OFF4 1\n", "4 1 4\n", "# a\nOFF\r\n4 1 0\r\n"]
        {
            let text = format!("{first}{SQUARE}4 0 1 2 3\n");
            let mesh = load(text).unwrap();
            assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2), "{first}");
            assert!(mesh.colors.is_empty());
        }
    }

    #[test]
    fn colours_and_normals_of_vertices() {
        let whole =
            "COFF\n3 1 0\n0 0 0 200 40 40 255\n1 0 0 0 255 0 128\n0 1 0 0 0 255 255\n3 0 1 2";
        let mesh = load(whole).unwrap();
        assert_eq!(mesh.colors, [[200, 40, 40, 255], [0, 255, 0, 128], [0, 0, 255, 255]]);
        let shares =
            "CNOFF\n3 1 0\n0 0 0 0 0 2 1 0.2 0\n1 0 0 0 0 1 0 1 0\n0 1 0 0 0 1 0 0 1\n3 0 1 2";
        let mesh = load(shares).unwrap();
        assert_eq!((mesh.colors[0], mesh.normals[0]), ([255, 51, 0, 255], Vec3::Z));
        // Without the letter, and with texture coordinates.
        let plain = "STOFF\n1 0 0\n0 0 0 9 8 7 0.5 0.5\n";
        assert_eq!(load(plain).unwrap().colors, [[9, 8, 7, 255]]);
    }

    #[test]
    fn faces_with_colours_have_corners_of_their_own() {
        let text = format!("OFF\n4 2 0\n{SQUARE}3 0 1 2 200 40 40\n3 0 2 3 0 0 255 128\n");
        let mesh = load(text).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (6, 2));
        assert_eq!([mesh.colors[2], mesh.colors[3]], [[200, 40, 40, 255], [0, 0, 255, 128]]);
        let text = format!("OFF\n4 2 0\n{SQUARE}3 0 1 2 1.0 0.2 0.0\n3 0 2 3\n");
        assert_eq!(load(text).unwrap().colors[3], [255; 4]);
    }

    #[test]
    fn binary_files() {
        let mut bytes = b"OFF BINARY\n".to_vec();
        let ints = |bytes: &mut Vec<u8>, all: &[i32]| {
            all.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
        };
        ints(&mut bytes, &[3, 1, 0]);
        for number in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            bytes.extend(number.to_be_bytes());
        }
        ints(&mut bytes, &[3, 0, 1, 2, 3]);
        for number in [1.0f32, 0.2, 0.2] {
            bytes.extend(number.to_be_bytes());
        }
        let mesh = load(&bytes).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.colors[0]), (1, [255, 51, 51, 255]));
        let folder = Folder::new();
        for end in 11..bytes.len() {
            let path = folder.write("a.off", &bytes[..end]);
            assert!(read_with(&path, read).is_err(), "cut at {end}");
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, word) in [
            ("OFF\n3 1 0\n0 0 0\n1 0 0\n", "line 5: the file ends before vertex 2 of 3"),
            ("OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "line 4: refers to vertex 1, but there are 1"),
            ("OFF\n1 1 0\n0 0 0\n3 0 0\n", "line 4: a face of 3 corners has 2 numbers"),
            ("OFF\n1 0 0\n0 0\n", "line 3: a vertex needs three numbers"),
            ("OFF\n1 0 0\n0 0 x\n", "line 3: \"x\" is not a number"),
            ("OFF\nmany\n", "line 2: \"many\" is not a number"),
            ("OFF\n0 0 0\n", "contains no vertices"),
            ("4OFF\n1 0 0\n0 0 0 1\n", "four coordinates"),
            ("OFF\n1 0 0\n0 0 nan\n", "is not finite"),
            ("", "counts of vertices and faces are missing"),
        ] {
            let message = load(text).unwrap_err().to_string();
            assert!(message.contains(word), "{message} / {word}");
        }
    }

    #[test]
    fn first_bytes_show_the_format() {
        for bytes in ["OFF\n1 0 0", "OFF8 6 12", " COFF 3 1 0", "NOFF\r\n", "OFF BINARY\n\0\0"] {
            assert!(is_off(bytes.as_bytes()), "{bytes}");
        }
        for bytes in ["OFFICE", "OF", "", "OFF the record", "CNST"] {
            assert!(!is_off(bytes.as_bytes()), "{bytes}");
        }
    }
}
