//! Scans an OBJ file before tobj reads it.

use super::super::shared::unplaced;
use crate::{
    Result,
    input::{Source, copy},
    warning,
};
use std::{
    borrow::Cow,
    io::{BufRead, Read},
};

/// Lines between two checks of the time limit.
const LINES: usize = 1 << 16;

/// Bytes per statement in all lists, tobj's and ours: for a vertex, for a texture coordinate or
/// normal, for a face, and for a corner of a face. A corner may become a triangle and a vertex of
/// its own, and is also held while its face is cut.
const VERTEX: u64 = 160;
const OTHER: u64 = 48;
const FACE: u64 = 168;
const CORNER: u64 = 384;

/// Properties of the whole file. tobj mistakes lines (`l`) for faces, shifts colours and normals if
/// only some vertices have them, and does unchecked arithmetic on indices. The survey detects these
/// cases.
#[derive(Debug, Default)]
pub(super) struct Survey {
    vertices: u64,
    pub faces: u64,
    /// Statements of lines (`l`), and the words after them.
    pub lines: u64,
    ends: u64,
    /// Number of corners of all faces.
    corners: u64,
    /// Number of texture coordinates and normals.
    others: u64,
    /// All vertices have a colour.
    pub colors: bool,
    /// All corners of all faces have a normal.
    normals: bool,
    /// A face comes before something that it refers to.
    ahead: bool,
    /// The number of texture coordinates, if a face refers to one that does not exist.
    stray: Option<i64>,
    /// Vertices that are not at finite coordinates.
    unplaced: u64,
    /// A coordinate is written as only C libraries write it (`nan(ind)`).
    odd: bool,
}

impl Survey {
    pub fn of(source: &Source, text: &str) -> Result<Self> {
        let mut scan = Scan {
            survey: Self { colors: true, normals: true, ..Self::default() },
            ..Scan::default()
        };
        for (line, number) in text.lines().zip(1usize..) {
            if number.is_multiple_of(LINES) {
                source.check_time()?;
            }
            let mut words = words(line);
            match words.next() {
                Some("v") => scan.vertex(source, number, words)?,
                Some("vt") => scan.counts[1] += 1,
                Some("vn") => scan.counts[2] += 1,
                Some("f") => scan
                    .face(number, words)
                    .map_err(|message| source.error(format!("line {number}"), message))?,
                Some("l") => {
                    scan.survey.lines += 1;
                    scan.survey.ends += words.count() as u64;
                }
                _ => {}
            }
        }
        scan.check(source)?;
        let Scan { mut survey, counts, ahead, strays, .. } = scan;
        for (kind, stray) in strays.iter().enumerate() {
            if let Some((line, index)) = stray {
                warning::give!(
                    "{}: line {line}: {}; such corners have none",
                    source.path.display(),
                    wrong(*index, kind, counts[kind])
                );
            }
        }
        survey.stray = strays[1].map(|_| counts[1]);
        survey.normals &= strays[2].is_none();
        survey.ahead = ahead.iter().any(Option::is_some);
        survey.vertices = counts[0] as u64;
        survey.others = (counts[1] + counts[2]) as u64;
        survey.colors &= counts[0] > 0;
        source.check_points("the number of vertices", survey.vertices)?;
        source.check_points("the number of faces", survey.faces)?;
        let bytes = VERTEX * survey.vertices
            + OTHER * survey.others
            + FACE * survey.faces
            + CORNER * survey.corners
            + OTHER * survey.ends;
        source.spend("the size of the mesh in bytes", bytes)?;
        Ok(survey)
    }

    /// Says how many vertices are left out because they are not at finite coordinates.
    pub fn warn_of_unplaced(&self, source: &Source) {
        if self.unplaced > 0 {
            unplaced::warn(source, self.unplaced as usize, self.vertices as usize);
        }
    }

    /// Returns whether vertices are not at finite coordinates.
    pub fn has_unplaced(&self) -> bool {
        self.unplaced > 0
    }

    /// Returns the file's lines for tobj. They end with an error when `is_over` says so.
    pub fn feed<'a>(&self, text: &'a str, is_over: &'a dyn Fn() -> bool) -> Feed<'a> {
        // tobj ends a part of the mesh at each `usemtl`, with the statements it has read so far.
        let (rest, again) = (text, self.ahead.then_some(text));
        let kinds = if self.ahead { Kinds::Values } else { Kinds::All };
        Feed {
            rest,
            again,
            kinds,
            line: 0,
            current: "".into(),
            at: 0,
            colors: self.colors,
            normals: self.normals,
            stray: self.stray,
            odd: self.odd,
            passed: 0,
            is_over,
        }
    }
}

/// The survey of the lines so far. Arrays have an entry each for positions, texture coordinates and
/// normals.
#[derive(Default)]
struct Scan {
    survey: Survey,
    counts: [i64; 3],
    /// The largest index used, and its line.
    largest: [(i64, usize); 3],
    /// The first reference of each kind to a later statement: its line and its index.
    ahead: [Option<(usize, i64)>; 3],
    /// A line with a negative index, which counts back from its own place.
    back: Option<usize>,
    /// The first reference of each kind to a statement that does not exist: its line and index.
    strays: [Option<(usize, i64)>; 3],
}

impl Scan {
    /// Adds a vertex. Its coordinates must be numbers.
    fn vertex<'a>(
        &mut self,
        source: &Source,
        line: usize,
        words: impl Iterator<Item = &'a str>,
    ) -> Result<()> {
        self.counts[0] += 1;
        let (mut values, mut is_placed) = (0, true);
        for word in words {
            values += 1;
            let plain = |b: u8| b.is_ascii_digit() || matches!(b, b'.' | b'+' | b'-' | b'e' | b'E');
            if values > 3 || word.bytes().all(plain) {
                continue;
            }
            let place = format!("line {line}");
            if let Some(number) = copy::float(word.as_bytes()) {
                self.survey.odd = true;
                is_placed &= number.is_finite();
                continue;
            }
            let text: String = word.chars().take(40).collect();
            return Err(source
                .error(place, format!("“{text}” is not a number"))
                .hint("write numbers with a decimal point, not a comma"));
        }
        self.survey.unplaced += u64::from(!is_placed);
        self.survey.colors &= values >= 6;
        Ok(())
    }

    /// Adds a face. Each of its words is a corner.
    fn face<'a>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'a str>,
    ) -> Result<(), String> {
        self.survey.faces += 1;
        let corners = self.survey.corners;
        for word in words {
            self.survey.corners += 1;
            let not_a_corner = || format!("“{word}” is not a face corner");
            let mut has_normal = false;
            for (kind, part) in word.split('/').enumerate() {
                if kind > 2 || (part.is_empty() && kind == 0) {
                    return Err(not_a_corner());
                }
                if part.is_empty() {
                    continue;
                }
                has_normal |= kind == 2;
                let index: i32 = part.parse().map_err(|_| not_a_corner())?;
                self.reference(line, index.into(), kind)?;
            }
            self.survey.normals &= has_normal;
        }
        if self.survey.corners == corners { Err("a face has no corners".into()) } else { Ok(()) }
    }

    /// Adds an index of a corner.
    fn reference(&mut self, line: usize, index: i64, kind: usize) -> Result<(), String> {
        let count = self.counts[kind];
        if index == 0 || -index > count {
            if kind == 0 {
                return Err(wrong(index, kind, count));
            }
            self.strays[kind].get_or_insert((line, index));
            return Ok(());
        }
        if index > count {
            self.ahead[kind].get_or_insert((line, index));
        } else if index < 0 {
            self.back = Some(line);
        }
        if index > self.largest[kind].0 {
            self.largest[kind] = (index, line);
        }
        Ok(())
    }

    /// Returns an error if an index of a vertex has no statement in the whole file, or if the file
    /// has both references to later statements and negative indices.
    fn check(&mut self, source: &Source) -> Result<()> {
        for kind in 0..3 {
            let (index, line) = self.largest[kind];
            if index > self.counts[kind] && kind > 0 {
                self.strays[kind].get_or_insert((line, index));
                // What does not exist comes not later either.
                self.ahead[kind] = self.ahead[kind].filter(|(_, at)| *at <= self.counts[kind]);
            } else if index > self.counts[kind] {
                let message = wrong(index, kind, self.counts[kind]);
                return Err(source.error(format!("line {line}"), message));
            }
        }
        let ahead = (0..3).find_map(|kind| Some((self.ahead[kind]?, kind)));
        let (Some(((line, index), kind)), Some(back)) = (ahead, self.back) else {
            return Ok(());
        };
        let message = format!(
            "a face refers to {} {index}, which comes after it, but a face in line {back} uses \
             negative indices; one file cannot have both",
            WHAT[kind]
        );
        Err(source
            .error(format!("line {line}"), message)
            .hint("move the faces after everything that they refer to"))
    }
}

/// Returns the place of the first texture coordinates that are not finite in 32 bits.
pub(super) fn place_of_wide_uv(text: &str) -> String {
    let is_wide = |word: &str| word.parse::<f64>().is_ok_and(|value| !(value as f32).is_finite());
    let has_wide = |line: &str| {
        let mut words = line.split_whitespace();
        words.next() == Some("vt") && words.take(2).any(is_wide)
    };
    let line = text.lines().position(has_wide);
    line.map_or_else(|| "texture coordinates".into(), |line| format!("line {}", line + 1))
}

/// Returns the words of a statement, up to a comment.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace().take_while(|word| !word.starts_with('#'))
}

const WHAT: [&str; 3] = ["vertex", "texture coordinate", "normal"];

fn wrong(index: i64, kind: usize, count: i64) -> String {
    let what = WHAT[kind];
    if count == 0 {
        return format!("a face refers to {what} {index}, but there are none");
    }
    format!(
        "a face refers to {what} {index}, but there are {count} (1 … {count}, or −1 … −{count})"
    )
}

/// The statements that a feed passes on: values (positions, texture coordinates and normals),
/// statements that refer to them, or all.
#[derive(PartialEq)]
enum Kinds {
    All,
    Values,
    References,
}

/// Passes the relevant statements to tobj, one at a time, and counts lines. If faces come before
/// what they refer to, it passes all values first.
pub(super) struct Feed<'a> {
    rest: &'a str,
    /// The text, if it is passed twice.
    again: Option<&'a str>,
    kinds: Kinds,
    line: usize,
    /// The statement that is passed on, and the bytes of it that are passed already.
    current: Cow<'a, str>,
    at: usize,
    colors: bool,
    normals: bool,
    stray: Option<i64>,
    odd: bool,
    /// Texture coordinates that were passed on.
    passed: i64,
    /// Whether to give up.
    is_over: &'a dyn Fn() -> bool,
}

impl<'a> Feed<'a> {
    /// Returns the number of the last line passed on, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Returns the part of a line that tobj gets: without values that not all vertices have. Groups
    /// (`g`, `o`) are left out because tobj would split vertices between them.
    fn useful(&mut self, line: &'a str) -> Cow<'a, str> {
        let keep = |words: usize| first_words(line, words + 1);
        let word = line.split_whitespace().next();
        let is_value = matches!(word, Some("v" | "vt" | "vn"));
        if self.kinds == if is_value { Kinds::References } else { Kinds::Values } {
            return "".into();
        }
        match word {
            Some("v") => {
                let kept = if self.colors {
                    keep(6)
                } else if words(line).count() == 5 {
                    keep(4)
                } else {
                    keep(3)
                };
                if self.odd { plain(kept).into() } else { kept.into() }
            }
            Some("vt") => {
                self.passed += 1;
                line.into()
            }
            Some("f") if self.stray.is_some() => self.known(line).into(),
            // A comment ends a face.
            Some("f") => line.split(" #").next().unwrap_or_default().trim_end().into(),
            // Faces after `usemtl` without a name have no material.
            Some("usemtl") => match line["usemtl".len()..].trim() {
                "" => "usemtl \u{0}".into(),
                name => format!("usemtl {name}").into(),
            },
            Some("mtllib") if line.trim() != "mtllib" => line.into(),
            Some("vn") if self.normals => line.into(),
            _ => "".into(),
        }
    }

    /// Returns a face without texture coordinates that do not exist.
    fn known(&self, line: &str) -> String {
        let corner = |word: &str| {
            let mut parts: Vec<&str> = word.split('/').collect();
            let exists = |part: &&str| {
                let index = part.parse::<i64>().unwrap_or(0);
                (1..=self.stray.unwrap_or(0)).contains(&index)
                    || (-self.passed..=-1).contains(&index)
            };
            if let Some(part) = parts.get_mut(1).filter(|part| !exists(part)) {
                *part = "";
            }
            parts.join("/")
        };
        let corners = words(line).skip(1).map(corner);
        std::iter::once("f".to_owned()).chain(corners).collect::<Vec<String>>().join(" ")
    }
}

/// Returns a statement with numbers as tobj reads them.
fn plain(line: &str) -> String {
    let word = |word: &str| match copy::float(word.as_bytes()) {
        Some(number) if !number.is_finite() => "nan".to_owned(),
        _ => word.to_owned(),
    };
    line.split_whitespace().map(word).collect::<Vec<String>>().join(" ")
}

/// Returns the start of a line, up to the end of its `count`-th word.
fn first_words(line: &str, count: usize) -> &str {
    let mut inside = false;
    let mut seen = 0;
    for (at, letter) in line.char_indices() {
        match (inside, letter.is_whitespace()) {
            (false, false) => {
                inside = true;
                seen += 1;
            }
            (true, true) => {
                inside = false;
                if seen == count {
                    return &line[..at];
                }
            }
            _ => {}
        }
    }
    line
}

impl BufRead for Feed<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        while self.at >= self.current.len() {
            if self.rest.is_empty() {
                let Some(text) = self.again.take() else { return Ok(&[]) };
                (self.rest, self.line, self.kinds) = (text, 0, Kinds::References);
                self.passed = 0;
            }
            let end = self.rest.find('\n').map_or(self.rest.len(), |end| end + 1);
            let (line, rest) = self.rest.split_at(end);
            if self.line.is_multiple_of(LINES) && (self.is_over)() {
                return Err(std::io::Error::other("the time for reading is over"));
            }
            (self.rest, self.line) = (rest, self.line + 1);
            (self.current, self.at) = (self.useful(line.trim()), 0);
        }
        Ok(&self.current.as_bytes()[self.at..])
    }

    fn consume(&mut self, amount: usize) {
        self.at = self.current.len().min(self.at + amount);
    }

    // The lines passed on have no line ends, so each is one whole line here.
    #[expect(clippy::disallowed_methods, reason = "the text is a copy of the file's")]
    fn read_line(&mut self, out: &mut String) -> std::io::Result<usize> {
        let line = std::str::from_utf8(self.fill_buf()?).unwrap_or("");
        let length = line.len();
        out.push_str(line);
        self.consume(length);
        Ok(length)
    }
}

impl Read for Feed<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let mut available = self.fill_buf()?;
        let length = available.read(out)?;
        self.consume(length);
        Ok(length)
    }
}
