//! Tables of numbers as text: their lines, column names and numbers.
//!
//! The first of these that occurs in the first line separates the columns: semicolons, commas,
//! tabs, otherwise any white space. (The csv crate takes single bytes only, not runs of spaces.)
//! Empty lines and lines that begin with `#` or `//` are skipped, except a first line that names
//! the columns. Numbers use a decimal point, not a comma.

use super::{Source, copy, growing::Growing};
use crate::{Error, Result, parallel::prelude::*};

/// Maximum number of columns.
const MOST_COLUMNS: usize = 4096;
/// Rows that are read between two checks of the time limit.
const ROWS: usize = 1 << 12;

/// What a column must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Want {
    /// Anything: it is not read.
    Nothing,
    /// Finite numbers.
    Numbers,
    /// Numbers, finite or not, or a word that stands for a missing value: coordinates too, because
    /// points without them are left out.
    Values,
}

/// Words that stand for a missing value, in lower case.
const MISSING: [&[u8]; 8] = [b"", b"na", b"n/a", b"null", b"none", b"-", b"--", b"missing"];

/// A table whose lines have been found but whose numbers have not been read yet.
pub(crate) struct Text<'a> {
    /// The column names, if the first line gives them.
    pub names: Option<Vec<String>>,
    /// Number of columns in the first line.
    pub width: usize,
    /// Line number of the first row in the file.
    pub first: usize,
    /// The rows, each with its line number.
    rows: Vec<(usize, &'a [u8])>,
    separator: Option<u8>,
}

impl<'a> Text<'a> {
    /// Finds the rows of a file. A line with a single whole number counts rows, as in `.pts` files,
    /// which begin each scan with its number of points.
    ///
    /// # Errors
    /// [`Error::Input`] for a file without rows, and for one that counts more or fewer rows.
    pub fn of(source: &'a Source) -> Result<Self> {
        refuse_utf16(source)?;
        let mut counts = Growing::new(source, "the counts");
        let mut lines: Growing<(usize, &[u8])> = Growing::new(source, "the list of lines");
        for (number, line) in (1..).zip(lines_of(without_mark(source.bytes()))) {
            let line = line.trim_ascii();
            if !is_row(line, lines.is_empty()) {
                continue;
            }
            match copy::number::<u64>(line) {
                Some(count) => counts.push((number, count))?,
                None => lines.push((number, line))?,
            }
        }
        source.check_points("the number of lines", lines.len() as u64)?;
        let Some(&(first, line)) = lines.first() else {
            return Err(source.error("file", "contains no rows of numbers"));
        };
        let mut lines = lines.into_inner();
        let (separator, words) = split(line);
        if words.len() > MOST_COLUMNS {
            return Err(source
                .error(format!("line {first}"), format!("has more than {MOST_COLUMNS} columns")));
        }
        let names = has_names(&words).then(|| words.clone());
        if names.is_some() && !line.iter().any(|b| b.is_ascii_alphabetic() || !b.is_ascii()) {
            return Err(source
                .error(
                    format!("line {first}"),
                    format!("{:?} contains neither numbers nor column names", copy::excerpt(line)),
                )
                .hint("write numbers with a decimal point, not a comma"));
        }
        if names.is_some() {
            lines.remove(0);
        }
        check_counts(source, &counts, lines.len())?;
        Ok(Self { names, width: words.len(), first, rows: lines, separator })
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Returns the place of a row, for an error.
    pub fn place(&self, row: usize) -> String {
        format!("line {}", self.rows[row].0)
    }

    /// Returns the numbers of all rows, row after row. `want` says what the columns must hold.
    /// Numbers of columns that are not wanted are zero; missing values are NaN.
    pub fn numbers(
        &self,
        source: &Source,
        want: impl Fn(usize) -> Want + Sync,
    ) -> Result<Vec<f64>> {
        let width = self.width;
        // Each number takes at least one byte. If the file is too small for all numbers, a line is
        // too short.
        let numbers = self.rows.len().saturating_mul(width);
        if numbers > source.bytes().len() {
            self.check_widths(source)?;
        }
        source.room::<f64>("the numbers", numbers)?;
        let mut table = vec![0.0f64; numbers];
        table.par_chunks_mut(width).zip(&self.rows).enumerate().try_for_each(
            |(index, (row, &(number, line)))| {
                if index.is_multiple_of(ROWS) {
                    source.check_time()?;
                }
                let place = || format!("line {number}");
                let mut count = 0;
                for word in words(line, self.separator) {
                    let want = want(count);
                    if let Some(slot) = row.get_mut(count).filter(|_| want != Want::Nothing) {
                        *slot = parsed(source, place, without_quotes(word), (count, want))?;
                    }
                    count += 1;
                }
                if count != width { Err(self.wrong_width(source, number, count)) } else { Ok(()) }
            },
        )?;
        Ok(table)
    }

    /// Returns whether the first rows have numbers in a column, and nothing but numbers and missing
    /// values.
    pub fn is_numeric(&self, column: usize) -> bool {
        /// Rows to look at.
        const FIRST: usize = 64;
        let mut has_number = false;
        for &(_, line) in self.rows.iter().take(FIRST) {
            let Some(word) = words(line, self.separator).nth(column) else { continue };
            let word = without_quotes(word);
            if copy::float(word).is_some() {
                has_number = true;
            } else if !MISSING.iter().any(|other| word.eq_ignore_ascii_case(other)) {
                return false;
            }
        }
        has_number
    }

    fn check_widths(&self, source: &Source) -> Result<()> {
        self.rows.iter().try_for_each(|&(number, line)| {
            let count = words(line, self.separator).count();
            if count != self.width { Err(self.wrong_width(source, number, count)) } else { Ok(()) }
        })
    }

    fn wrong_width(&self, source: &Source, line: usize, count: usize) -> Error {
        let message = format!("has {count} columns, but the first line has {}", self.width);
        source.error(format!("line {line}"), message)
    }
}

/// Returns an error if the file counts its rows, with the line of each count, and has another
/// number.
fn check_counts(source: &Source, counts: &[(usize, u64)], there: usize) -> Result<()> {
    let Some(&(line, _)) = counts.first() else { return Ok(()) };
    let counted = counts.iter().fold(0u64, |sum, &(_, count)| sum.saturating_add(count));
    if counted == there as u64 {
        return Ok(());
    }
    Err(source
        .error(format!("line {line}"), format!("counts {counted} points, but there are {there}"))
        .hint("the file is cut, or a line has a single number"))
}

/// Returns an error for a text in UTF-16, by its byte order mark.
pub(crate) fn refuse_utf16(source: &Source) -> Result<()> {
    if source.bytes().starts_with(b"\xff\xfe") || source.bytes().starts_with(b"\xfe\xff") {
        return Err(source
            .error("file", "is text in UTF-16, which is not read")
            .hint("save it as UTF-8, or convert it: iconv -f UTF-16 -t UTF-8"));
    }
    Ok(())
}

/// Returns the words of the first row, and whether they are names; `None` for a file without rows.
pub(crate) fn first_words(bytes: &[u8]) -> Option<(Vec<String>, bool)> {
    let line =
        lines_of(without_mark(bytes)).map(<[u8]>::trim_ascii).find(|line| is_row(line, true))?;
    let words = split(line).1;
    let named = has_names(&words);
    Some((words, named))
}

/// Returns the lines of a text. They may end as on any system: with a line feed, a carriage return,
/// or both.
pub(crate) fn lines_of(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|&b| b == b'\n')
        .flat_map(|line| line.strip_suffix(b"\r").unwrap_or(line).split(|&b| b == b'\r'))
}

/// Removes quotation marks around a word.
fn without_quotes(mut word: &[u8]) -> &[u8] {
    while let [b'"', rest @ ..] | [rest @ .., b'"'] = word {
        word = rest;
    }
    word
}

/// Removes the byte order mark that some writers of UTF-8 put first.
pub(crate) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Returns whether a line is a row of the table. A comment counts as one if it comes first and
/// names the columns.
fn is_row(line: &[u8], first: bool) -> bool {
    let comment = line.starts_with(b"#") || line.starts_with(b"//");
    !line.is_empty() && (!comment || first && names_columns(line))
}

/// Returns whether a comment names the columns.
fn names_columns(line: &[u8]) -> bool {
    let separators = |b: &u8| b.is_ascii_whitespace() || matches!(b, b',' | b';' | b'#' | b'/');
    let has = |name: &[u8]| line.split(separators).any(|word| word.eq_ignore_ascii_case(name));
    has(b"x") && has(b"y") && has(b"z")
}

fn has_names(words: &[String]) -> bool {
    !words.iter().all(|word| copy::float(word.as_bytes()).is_some())
}

/// Returns the separator that a first line uses, and its words without quotes.
fn split(line: &[u8]) -> (Option<u8>, Vec<String>) {
    let outside: Vec<&[u8]> = line.split(|&b| b == b'"').step_by(2).collect();
    let has = |separator: &u8| outside.iter().any(|part| part.contains(separator));
    let separator = [b';', b',', b'\t'].into_iter().find(has);
    let name = |word: &[u8]| copy::lossy(word).trim_matches('"').trim().to_owned();
    // One word over the maximum, so that the caller sees that there are too many.
    (separator, words(line, separator).take(MOST_COLUMNS + 1).map(name).collect())
}

/// Returns the words of a line. The sign of a comment is not part of a word, and text between
/// quotes is one word (RFC 4180).
fn words(line: &[u8], separator: Option<u8>) -> impl Iterator<Item = &[u8]> {
    let sign = line.iter().take_while(|&&b| matches!(b, b'#' | b'/')).count();
    let mut quoted = false;
    line[sign..]
        .trim_ascii()
        .split(move |&b| {
            quoted ^= b == b'"';
            !quoted && separator.map_or(b.is_ascii_whitespace(), |separator| b == separator)
        })
        .map(<[u8]>::trim_ascii)
        .filter(move |word| separator.is_some() || !word.is_empty())
}

/// Returns the number in a word of a column.
fn parsed(
    source: &Source,
    place: impl Fn() -> String,
    word: &[u8],
    (column, want): (usize, Want),
) -> Result<f64> {
    let may_lack = want == Want::Values;
    let number = match copy::float(word) {
        Some(number) => number,
        None if may_lack && MISSING.iter().any(|other| word.eq_ignore_ascii_case(other)) => {
            f64::NAN
        }
        None => {
            let excerpt = copy::excerpt(word);
            let error = source.error(place(), format!("“{excerpt}” is not a number"));
            let has_comma = excerpt.contains(',');
            let hint = "write numbers with a decimal point, not a comma";
            return Err(if has_comma { error.hint(hint) } else { error });
        }
    };
    if number.is_finite() || may_lack {
        return Ok(number);
    }
    let message = format!("number {} is {number}, but numbers must be finite", column + 1);
    Err(source.error(place(), message))
}
