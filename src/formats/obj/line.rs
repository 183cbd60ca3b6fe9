//! Lines (`l`) of an OBJ file, which tobj mistakes for faces.

use super::survey::Survey;
use crate::{
    Result,
    input::{Source, copy},
};
use glam::DVec3;
use std::collections::HashMap;

/// Lines between two checks of the time limit.
const LINES: usize = 1 << 16;

/// The lines of a file.
#[derive(Debug, Default)]
pub(super) struct Lines {
    /// The vertices that lines use, as indices of the file from 0.
    pub vertices: Vec<u32>,
    pub places: Vec<DVec3>,
    /// Colours of the vertices; empty if not all of the file have one.
    pub colors: Vec<[f64; 3]>,
    /// The ends of all segments, as indices of `vertices`.
    pub ends: Vec<[u32; 2]>,
}

impl Lines {
    /// Reads the lines of a text.
    pub fn read(source: &Source, text: &str, survey: &Survey) -> Result<Self> {
        let mut lines = Self::default();
        if survey.lines == 0 {
            return Ok(lines);
        }
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        let mut before = 0i64;
        for (line, number) in text.lines().zip(1usize..) {
            if number.is_multiple_of(LINES) {
                source.check_time()?;
            }
            let mut words = line.split_whitespace().take_while(|word| !word.starts_with('#'));
            match words.next() {
                Some("v") => before += 1,
                Some("l") => {
                    let mut last = None;
                    for word in words {
                        let vertex = vertex(word, before)
                            .map_err(|message| source.error(format!("line {number}"), message))?;
                        let next = lines.vertices.len() as u32;
                        let index = *numbers.entry(vertex).or_insert(next);
                        if index == next {
                            lines.vertices.push(vertex);
                        }
                        lines.ends.extend(last.map(|last| [last, index]));
                        last = Some(index);
                    }
                }
                _ => {}
            }
        }
        source.check_points("the number of lines", lines.ends.len() as u64)?;
        lines.find_places(source, text, survey)?;
        Ok(lines)
    }

    /// Reads the places and colours of the vertices.
    fn find_places(&mut self, source: &Source, text: &str, survey: &Survey) -> Result<()> {
        let mut order: Vec<(u32, usize)> = self.vertices.iter().copied().zip(0..).collect();
        order.sort_unstable();
        self.places = vec![DVec3::NAN; order.len()];
        self.colors = if survey.colors { vec![[1.0; 3]; order.len()] } else { Vec::new() };
        let mut wanted = order.into_iter().peekable();
        let rows = text.lines().filter(|line| line.split_whitespace().next() == Some("v"));
        for (row, line) in (0u32..).zip(rows) {
            let Some((_, at)) = wanted.next_if(|(vertex, _)| *vertex == row) else { continue };
            let parsed = |word: &str| copy::float(word.as_bytes());
            let values: Vec<f64> =
                line.split_whitespace().skip(1).take(6).map_while(parsed).collect();
            if values.len() >= 3 {
                self.places[at] = DVec3::from_slice(&values);
            }
            if let (Some(color), [_, _, _, red, green, blue]) =
                (self.colors.get_mut(at), &values[..])
            {
                *color = [*red, *green, *blue];
            }
        }
        match wanted.next() {
            None => Ok(()),
            Some((vertex, _)) => {
                let message =
                    format!("a line refers to vertex {}, which does not exist", vertex + 1);
                Err(source.error("file", message))
            }
        }
    }
}

/// Returns the index from 0 of the vertex of a word such as `3`, `3/1` or `-1`, of which as many
/// vertices come before as `before` says.
fn vertex(word: &str, before: i64) -> Result<u32, String> {
    let index = word.split('/').next().and_then(|word| word.parse::<i64>().ok());
    let vertex = match index {
        Some(index) if index > 0 => Some(index - 1),
        Some(index) if index < 0 => Some(before + index).filter(|vertex| *vertex >= 0),
        _ => None,
    };
    let vertex = vertex.and_then(|vertex| u32::try_from(vertex).ok());
    vertex.ok_or_else(|| format!("“{word}” is no vertex of a line"))
}
