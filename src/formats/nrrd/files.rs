//! The data files of a detached header: one, a list, or a pattern with a number.

use super::excerpt;
use crate::{
    Error, Result,
    input::{Source, copy},
};

/// Returns whether a field says that file names follow on the lines below.
pub fn is_list(field: &str) -> bool {
    field.split_ascii_whitespace().next() == Some("LIST")
}

/// Returns whether a field names several files.
pub fn are_several(field: &str) -> bool {
    is_list(field) || Pattern::of(field).is_some()
}

/// Returns the file names of a field; `rest` is the text after the header. The files contain equal
/// parts of the samples, in order along the last axis. The caller has checked that this number of
/// samples fits into memory.
pub fn names(source: &Source, field: &str, rest: &[u8], dims: [usize; 3]) -> Result<Vec<String>> {
    let (names, axes) = if is_list(field) {
        listed(source, field, rest)?
    } else if let Some(pattern) = Pattern::of(field) {
        numbered(source, field, &pattern, dims)?
    } else {
        return Ok(vec![field.to_owned()]);
    };
    let axes = match axes.map(str::parse::<usize>) {
        None => 2,
        Some(Ok(axes @ 1..=3)) => axes,
        Some(_) => {
            let message = "must end with 1, 2 or 3, the number of axes in a file";
            return Err(wrong(source, format!("“{}” {message}", excerpt(field))));
        }
    };
    let wanted: usize = dims[axes..].iter().product();
    let fits = if axes == 3 {
        !names.is_empty() && dims[2].is_multiple_of(names.len())
    } else {
        names.len() == wanted
    };
    if !fits {
        let wanted = if axes == 3 { format!("divide {}", dims[2]) } else { format!("be {wanted}") };
        return Err(wrong(
            source,
            format!("there are {} files, but their number must {wanted}", names.len()),
        ));
    }
    Ok(names)
}

fn wrong(source: &Source, message: String) -> Error {
    source.error("data file", message)
}

/// Returns the names in a list, and the field's word for the number of axes in a file.
fn listed<'a>(
    source: &Source,
    field: &'a str,
    rest: &[u8],
) -> Result<(Vec<String>, Option<&'a str>)> {
    let mut words = field.split_ascii_whitespace().skip(1);
    let (axes, None) = (words.next(), words.next()) else {
        let message = "is not “LIST” followed by the number of axes in a file";
        return Err(wrong(source, format!("“{}” {message}", excerpt(field))));
    };
    if rest.len() > super::LONGEST {
        let message = format!("the list of files is longer than {} bytes", super::LONGEST);
        return Err(wrong(source, message));
    }
    source.spend("the size of the file names in bytes", 5 * rest.len() as u64)?;
    let text = copy::text(rest)
        .map_err(|at| wrong(source, format!("byte {at} of the list of files is not text")))?;
    let names = text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned);
    Ok((names.collect(), axes))
}

/// Returns the names that a pattern makes, and the field's word for the number of axes in a file.
fn numbered<'a>(
    source: &Source,
    field: &str,
    pattern: &Pattern<'a>,
    dims: [usize; 3],
) -> Result<(Vec<String>, Option<&'a str>)> {
    let count = pattern.count().ok_or_else(|| {
        let message = "names no files: its step does not lead from the first number to the last";
        wrong(source, format!("“{}” {message}", excerpt(field)))
    })?;
    // Each file contains at least one sample.
    if count > dims.iter().product::<usize>() as u64 {
        return Err(wrong(
            source,
            format!("“{}” counts {count} files, more than there are samples", excerpt(field)),
        ));
    }
    source.spend(
        "the size of the file names in bytes",
        count.saturating_mul(256 + field.len() as u64),
    )?;
    Ok(((0..count).map(|index| pattern.name(index)).collect(), pattern.axes))
}

/// A pattern of file names with a number, as printf formats it: `slice%03d.raw`, then the first
/// number, the last number, the step, and optionally the number of axes in a file.
struct Pattern<'a> {
    before: &'a str,
    behind: &'a str,
    width: usize,
    zeros: bool,
    first: i64,
    last: i64,
    step: i64,
    /// The word for the number of axes in a file.
    axes: Option<&'a str>,
}

impl<'a> Pattern<'a> {
    /// Returns `None` for the name of a single file.
    fn of(field: &'a str) -> Option<Self> {
        let mut words = field.split_ascii_whitespace();
        let (before, number) = words.next()?.split_once('%')?;
        let [first, last, step] =
            [words.next()?, words.next()?, words.next()?].map(|word| word.parse().ok());
        let axes = words.next();
        if words.next().is_some() {
            return None;
        }
        let digits = number.bytes().take_while(u8::is_ascii_digit).count();
        let (width, behind) = number.split_at(digits);
        // Wider numbers would make names longer than file systems allow.
        let wide = if width.is_empty() {
            Some(0)
        } else {
            width.parse().ok().filter(|&wide: &usize| wide < 256)
        };
        Some(Self {
            before,
            behind: behind.strip_prefix(['d', 'i', 'u']).filter(|rest| !rest.contains('%'))?,
            width: wide?,
            zeros: width.starts_with('0'),
            first: first?,
            last: last?,
            step: step?,
            axes,
        })
    }

    /// Returns the number of files; `None` if the step does not lead from the first number to the
    /// last.
    fn count(&self) -> Option<u64> {
        let way = i128::from(self.last) - i128::from(self.first);
        let steps = way.checked_div(self.step.into())?;
        let leads_there = way == 0 || (way > 0) == (self.step > 0);
        u64::try_from(steps + 1).ok().filter(|_| leads_there)
    }

    fn name(&self, index: u64) -> String {
        let number = i128::from(self.first) + i128::from(self.step) * i128::from(index);
        let Self { before, behind, width, .. } = *self;
        if self.zeros {
            format!("{before}{number:0width$}{behind}")
        } else {
            format!("{before}{number:width$}{behind}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        formats::{ReadOptions, nrrd},
        input::testing::*,
        volume::Volume,
    };

    /// Reads a header of 2×1×4 bytes next to files of two and of four samples.
    fn volume(folder: &Folder, data_file: &str) -> Result<Volume> {
        for (index, name) in
            ["slice01.raw", "slice02.raw", "slice03.raw", "slice04.raw"].iter().enumerate()
        {
            folder.write(name, [2 * index as u8, 2 * index as u8 + 1]);
        }
        folder.write("slab 0.raw", [0, 1, 2, 3]);
        folder.write("slab 1.raw", [4, 5, 6, 7]);
        let text = format!(
            "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 1 4\nencoding: raw\ndata file: \
             {data_file}\n"
        );
        read_with(&folder.write("volume.nhdr", text), |source| {
            nrrd::read(source, &ReadOptions::default())
        })
    }

    #[test]
    fn several_files_are_joined() {
        let folder = Folder::new();
        let names = "slice01.raw\nslice02.raw\r\n\nslice03.raw\nslice04.raw";
        for data_file in [
            "slice%02d.raw 1 4 1",
            "slice%02i.raw 1 4 1 2",
            "slice0%u.raw 1 4 1 1",
            "slab%2d.raw 0 1 1 3",
            &format!("LIST\n{names}"),
            &format!("LIST 2\n{names}"),
            "LIST 3\nslab 0.raw\nslab 1.raw\n",
        ] {
            let read = volume(&folder, data_file).unwrap();
            assert_eq!(
                (0..8).map(|i| read.value(i)).collect::<Vec<_>>(),
                [0., 1., 2., 3., 4., 5., 6., 7.],
                "{data_file}"
            );
        }
        let read = volume(&folder, "slice%02d.raw 4 1 -1").unwrap();
        assert_eq!(
            (0..8).map(|i| read.value(i)).collect::<Vec<_>>(),
            [6., 7., 4., 5., 2., 3., 0., 1.]
        );
    }

    #[test]
    fn files_that_do_not_fit_are_told() {
        let folder = Folder::new();
        for (data_file, message) in [
            ("slice%02d.raw 1 3 1", "there are 3 files, but their number must be 4"),
            ("slab%2d.raw 0 2 1 3", "there are 3 files, but their number must divide 4"),
            ("slice%02d.raw 1 4 0", "names no files"),
            ("slice%02d.raw 1 4 -1", "names no files"),
            ("slice%02d.raw 1 4 9", "there are 1 files"),
            ("slice%02d.raw 0 9223372036854775807 1", "more than there are samples"),
            ("slice%02d.raw -9223372036854775808 9223372036854775807 1", "names no files"),
            ("slice%02d.raw 1 4 1 4", "must end with 1, 2 or 3"),
            ("LIST 2 2\n", "is not “LIST” followed by the number of axes"),
            ("LIST", "there are 0 files"),
            ("LIST 3", "there are 0 files"),
            ("LIST\nslice01.raw", "there are 1 files"),
            ("slice%02d.raw 2 5 1", "refers to “slice05.raw”"),
            ("../slice%02d.raw 1 4 1", "leads out of the file's own folder"),
            ("LIST 3\n/etc/hostname\nslab 1.raw", "an absolute path"),
            ("LIST 3\nslab 0.raw\nslice01.raw", "there are 2 bytes where 4 were expected"),
            // Names of one file.
            ("slice%02x.raw 1 4 1", "refers to “slice%02x.raw 1 4 1”"),
            ("slice%999999999d.raw 1 4 1", "refers to"),
            ("slice%d%d.raw 1 4 1", "refers to"),
            ("100%.raw", "refers to “100%.raw”"),
        ] {
            let error = volume(&folder, data_file).map(|_| ()).unwrap_err().to_string();
            assert!(error.contains(message), "{data_file}: {error}");
        }
    }
}
