//! What the pages of a file mean: slices, channels and times, and the distances between samples.

use crate::{
    Result,
    about::Channel,
    formats::{ReadOptions, shared::several},
    input::Source,
};

/// The order of pages and the distances between samples.
#[derive(Debug, Clone)]
pub struct Meaning {
    /// Slices, if the description says how many there are.
    pub slices: Option<usize>,
    /// Channels that have pages of their own.
    pub channels: usize,
    /// How the channels are shown, if the description says it.
    pub shown: Vec<Channel>,
    /// The order of the pages, the fastest first: `z`, `c`, `t`.
    pub order: [char; 3],
    /// Pages that one directory describes; ImageJ writes more than 4 GB in this way.
    pub in_one: Option<usize>,
    pub spacing: [f64; 3],
    /// The unit of the distances; empty if there is none.
    pub unit: String,
    pub is_microscopy: bool,
}

impl Meaning {
    /// The meaning of pages without a description: a stack.
    pub fn plain() -> Self {
        Self {
            slices: None,
            channels: 1,
            shown: Vec::new(),
            order: ['z', 'c', 't'],
            in_one: None,
            spacing: [1.0; 3],
            unit: String::new(),
            is_microscopy: false,
        }
    }

    /// The shape that tifffile writes, and what its axes are: `{"shape": [2, 30, 64, 64], "axes":
    /// "CZYX"}`. A page of `size` pixels may have several numbers at each, along a last axis.
    pub fn of_shape(mut self, text: &str, [width, height]: [usize; 2]) -> Self {
        #[derive(serde::Deserialize)]
        struct Shape {
            shape: Vec<usize>,
            #[serde(default)]
            axes: String,
        }
        let Ok(Shape { shape, axes }) = serde_json::from_str(text) else { return self };
        let outer = match &shape[..] {
            [outer @ .., y, x] | [outer @ .., y, x, _] if [*y, *x] == [height, width] => outer,
            _ => return self,
        };
        let pages = |sizes: &[usize]| sizes.iter().try_fold(1usize, |all, &n| all.checked_mul(n));
        self.in_one = pages(outer).filter(|&count| count > 1);
        let axes = axes.to_ascii_lowercase();
        let names = axes.get(..outer.len()).filter(|_| axes.len() == shape.len());
        if let Some(names) = names.filter(|names| names.chars().all(|axis| "zct".contains(axis))) {
            let size = |axis: char| names.find(axis).map(|at| outer[at]);
            (self.slices, self.channels) = (size('z').or(Some(1)), size('c').unwrap_or(1).max(1));
            // The last axis is the fastest. Those of one page may stand anywhere.
            let order = names.chars().rev().chain("zct".chars().filter(|c| !names.contains(*c)));
            self.order = order.collect::<Vec<_>>().try_into().unwrap_or(self.order);
        } else if let [.., slices] = outer {
            self.slices = Some(*slices);
        }
        self
    }

    /// Takes only the shape of the pixels from the tags: their unit is seldom meant.
    pub fn of_ratio(mut self, resolution: Option<[f64; 2]>) -> Self {
        if let Some([x, y]) = resolution.filter(|all| all.iter().all(|&v| is_length(v))) {
            self.spacing[1] = x / y;
        }
        self
    }

    /// Returns the sizes along z, c and t of this many pages; one stack if they do not fit.
    fn sizes(&self, pages: usize) -> [usize; 3] {
        let channels = self.channels;
        match self.slices {
            Some(slices) if slices > 0 && pages.is_multiple_of(slices * channels) => {
                [slices, channels, pages / slices / channels]
            }
            None if pages.is_multiple_of(channels) => [pages / channels, channels, 1],
            _ => [pages, 1, 1],
        }
    }

    /// Returns how many times there are.
    pub fn times(&self, pages: usize) -> usize {
        self.sizes(pages)[2]
    }

    /// Returns how many channels have pages of their own.
    pub fn paged_channels(&self, pages: usize) -> usize {
        self.sizes(pages)[1]
    }

    /// Returns the number of the time to read.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for a time that the file does not have.
    pub fn time(&self, source: &Source, pages: usize, options: &ReadOptions) -> Result<usize> {
        several::time(source, "pages", self.times(pages) as u64, options)
    }

    /// Returns the pages of a channel at a time, in the order of the slices.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) for too many pages.
    pub fn planes(
        &self,
        source: &Source,
        pages: usize,
        [channel, time]: [usize; 2],
    ) -> Result<Vec<usize>> {
        let [slices, channels, times] = self.sizes(pages);
        let page = |slice: usize| {
            let mut stride = 1;
            let mut page = 0;
            for axis in self.order {
                let (at, size) = match axis {
                    'z' => (slice, slices),
                    'c' => (channel, channels),
                    _ => (time, times),
                };
                page += at * stride;
                stride *= size;
            }
            page
        };
        source.room::<usize>("the list of pages", slices)?;
        Ok((0..slices).map(page).collect())
    }
}

pub fn is_length(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

/// Returns a unit of length by its usual sign; empty for pixels, which are none.
pub fn unit(name: &str) -> String {
    match name {
        "um" | "micron" | "microns" | "micrometer" | "\\u00B5m" | "\u{b5}m" | "\u{3bc}m" => "µm",
        "pixel" | "pixels" | "reference frame" => "",
        "millimeter" | "millimeters" => "mm",
        "angstrom" | "\u{212b}" => "Å",
        other => other,
    }
    .chars()
    .take(16)
    .collect()
}

/// Returns a key that orders names by the numbers in them: “s9” before “s10”.
pub fn natural(name: &str) -> Vec<(String, u128, usize)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let letters = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (word, behind) = rest.split_at(letters);
        let digits = behind.find(|c: char| !c.is_ascii_digit()).unwrap_or(behind.len());
        let (number, behind) = behind.split_at(digits);
        parts.push((word.to_owned(), number.parse().unwrap_or(u128::MAX), digits));
        rest = behind;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        let mut names = ["s10.tif", "s9.tif", "s010b.tif", "s1.tif", "a2/s3.tif", "a10/s1.tif"];
        names.sort_by_cached_key(|name| natural(name));
        assert_eq!(names, ["a2/s3.tif", "a10/s1.tif", "s1.tif", "s9.tif", "s10.tif", "s010b.tif"]);
    }
}
