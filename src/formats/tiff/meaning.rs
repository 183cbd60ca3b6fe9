//! What the pages of a file mean: slices, channels and times, and the distances between samples, by
//! the descriptions that ImageJ, OME's programs and tifffile leave in the first page.

use crate::{
    Result,
    formats::{
        ReadOptions,
        shared::{grid::Component, length::meters, several},
    },
    input::Source,
};

/// The order of pages and the distances between samples.
#[derive(Debug, Clone)]
pub struct Meaning {
    /// Slices, if the description says how many there are.
    slices: Option<usize>,
    /// Channels that have pages of their own.
    pub channels: usize,
    /// The order of the pages, the fastest first: `z`, `c`, `t`.
    order: [char; 3],
    /// Pages that one directory describes; ImageJ writes more than 4 GB in this way.
    pub in_one: Option<usize>,
    pub spacing: [f64; 3],
    /// The unit of the distances; empty if there is none.
    pub unit: String,
    pub is_microscopy: bool,
}

impl Meaning {
    /// Reads a description, with the pixels per unit along x and y that the tags of the page give.
    pub fn of(description: &str, resolution: Option<[f64; 2]>) -> Self {
        let plain = Self {
            slices: None,
            channels: 1,
            order: ['z', 'c', 't'],
            in_one: None,
            spacing: [1.0; 3],
            unit: String::new(),
            is_microscopy: false,
        };
        let text = description.trim_start_matches('\u{feff}').trim_start();
        if text.starts_with("ImageJ=") {
            return plain.of_imagej(text, resolution);
        }
        if let Some(meaning) = plain.clone().of_ome(text) {
            return meaning;
        }
        plain.of_shape(text).of_ratio(resolution)
    }

    /// The lines `name=value` of ImageJ. Its tags give pixels per unit.
    fn of_imagej(mut self, text: &str, resolution: Option<[f64; 2]>) -> Self {
        let field = |name: &str| {
            let value = |line: &str| {
                line.strip_prefix(name).and_then(|rest| rest.strip_prefix('=')).map(str::to_owned)
            };
            text.lines().find_map(|line| value(line.trim()))
        };
        let count = |name: &str| field(name).and_then(|text| text.trim().parse::<usize>().ok());
        self.channels = count("channels").unwrap_or(1).max(1);
        self.order = ['c', 'z', 't'];
        self.in_one = count("images").filter(|&images| images > 1);
        let frames = count("frames").unwrap_or(1).max(1);
        let of_images = self.in_one.map(|images| images / self.channels / frames);
        self.slices = count("slices").or(of_images);
        if let Some([x, y]) = resolution.filter(|all| all.iter().all(|&v| is_length(v))) {
            self.spacing = [1.0 / x, 1.0 / y, 1.0 / x];
        }
        let spacing = field("spacing").and_then(|text| text.trim().parse::<f64>().ok());
        if let Some(spacing) = spacing.map(f64::abs).filter(|&spacing| is_length(spacing)) {
            self.spacing[2] = spacing;
        }
        self.unit = unit(field("unit").unwrap_or_default().trim());
        self
    }

    /// The attributes of OME's element `Pixels`; `None` for other descriptions.
    fn of_ome(mut self, text: &str) -> Option<Self> {
        let is_ome = text.starts_with('<') && text.contains("OME");
        let pixels = text.split("<Pixels").nth(1).filter(|_| is_ome)?;
        let pixels = pixels.split('>').next()?;
        let attribute = |name: &str| {
            let (_, rest) = pixels.split_once(&format!(" {name}="))?;
            let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            rest[1..].split_once(quote).map(|(value, _)| value.to_owned())
        };
        let size = |name: &str| attribute(name).and_then(|text| text.parse::<usize>().ok());
        self.slices = size("SizeZ");
        // Pixels of several samples have all of their channels in one page.
        let (_, channel) = text.split_once("SamplesPerPixel=").unwrap_or_default();
        let digits: String = channel.chars().skip(1).take_while(char::is_ascii_digit).collect();
        let samples = digits.parse::<usize>().unwrap_or(1).max(1);
        self.channels = (size("SizeC").unwrap_or(1) / samples).max(1);
        let order = attribute("DimensionOrder").unwrap_or_default().to_ascii_lowercase();
        let letters: Vec<char> = order.chars().filter(|c| "zct".contains(*c)).collect();
        self.order = letters.try_into().unwrap_or(self.order);
        let lengths = ["X", "Y", "Z"].map(|axis| {
            let value = attribute(&format!("PhysicalSize{axis}"))?.parse::<f64>().ok()?;
            let unit = attribute(&format!("PhysicalSize{axis}Unit")).map(|text| unit(&text));
            Some((value, unit.unwrap_or_else(|| "µm".into()))).filter(|(v, _)| is_length(*v))
        });
        if let [Some((x, x_unit)), ..] = &lengths {
            let of = |length: &Option<(f64, String)>| match length {
                Some((value, unit)) => match (meters(unit), meters(x_unit)) {
                    (Some(unit), Some(x_unit)) => value * unit / x_unit,
                    _ => *value,
                },
                None => *x,
            };
            self.spacing = [*x, of(&lengths[1]), of(&lengths[2])];
            self.unit.clone_from(x_unit);
        }
        self.is_microscopy = true;
        Some(self)
    }

    /// The shape that tifffile writes: `{"shape": [2, 30, 64, 64]}`.
    fn of_shape(mut self, text: &str) -> Self {
        let list = text.strip_prefix('{').and_then(|rest| rest.split_once("\"shape\":"));
        let list = list.and_then(|(_, rest)| rest.split_once('[')?.1.split_once(']'));
        let Some((list, _)) = list else { return self };
        let sizes: Option<Vec<usize>> = list.split(',').map(|n| n.trim().parse().ok()).collect();
        if let Some([outer @ .., slices, _, _]) = sizes.as_deref() {
            self.slices = Some(*slices);
            let times = outer.iter().try_fold(*slices, |all, &n| all.checked_mul(n));
            self.in_one = times.filter(|&count| count > 1);
        }
        self
    }

    /// Takes only the shape of the pixels from the tags: their unit is seldom meant.
    fn of_ratio(mut self, resolution: Option<[f64; 2]>) -> Self {
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

    /// Returns the pages to read, in the order of the slices.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for a time or a channel that the file does not have.
    pub fn planes(
        &self,
        source: &Source,
        pages: usize,
        options: &ReadOptions,
    ) -> Result<Vec<usize>> {
        let [slices, channels, times] = self.sizes(pages);
        let time = several::time(source, "pages", times as u64, options)?;
        let is_named = channels > 1 && options.scalar.is_some();
        let channel = match Component::chosen(source, options, channels, false) {
            Ok(Component::One(channel)) if is_named => channel,
            Err(error) if is_named => return Err(error),
            _ => 0,
        };
        if channels > 1 && !is_named {
            several::warn_of_channels(source, channels);
        }
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

fn is_length(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

/// Returns a unit of length by its usual sign; empty for pixels, which are none.
fn unit(name: &str) -> String {
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
    use crate::input::Limits;
    use std::path::Path;

    fn planes(meaning: &Meaning, pages: usize, options: &ReadOptions) -> Result<Vec<usize>> {
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a.tif"), &[], &limits)?;
        meaning.planes(&source, pages, options)
    }

    #[test]
    fn imagej_gives_order_and_spacing() {
        let text = "ImageJ=1.53t\nimages=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\n\
                    unit=micron\nspacing=0.5\nloop=false\n";
        let meaning = Meaning::of(text, Some([4.0, 5.0]));
        assert_eq!(meaning.spacing, [0.25, 0.2, 0.5]);
        assert_eq!((&meaning.unit[..], meaning.in_one), ("µm", Some(12)));
        let default = ReadOptions::default();
        assert_eq!(planes(&meaning, 12, &default).unwrap(), [0, 2, 4]);
        let second = ReadOptions { scalar: Some("channel:1".into()), time: Some(1), ..default };
        assert_eq!(planes(&meaning, 12, &second).unwrap(), [7, 9, 11]);
        let third = ReadOptions::scalar(Some("channel:2"));
        assert!(planes(&meaning, 12, &third).is_err());
        let late = ReadOptions { time: Some(2), ..ReadOptions::default() };
        assert!(planes(&meaning, 12, &late).unwrap_err().to_string().contains("2 times"));
        // Pages that are not as many as the description says.
        assert_eq!(planes(&meaning, 5, &ReadOptions::default()).unwrap(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn ome_gives_order_and_spacing() {
        let text = "<?xml version='1.0'?><OME xmlns='http'><Image ID='Image:0'><Pixels \
                    DimensionOrder=\"XYZCT\" SizeC=\"2\" SizeT='2' SizeX='4' SizeY='4' SizeZ='3' \
                    PhysicalSizeX='200' PhysicalSizeXUnit='nm' PhysicalSizeY='200' \
                    PhysicalSizeYUnit='nm' PhysicalSizeZ='0.6' Type='uint8'><Channel \
                    SamplesPerPixel='1'/></Pixels></Image></OME>";
        let meaning = Meaning::of(text, None);
        assert_eq!(meaning.unit, "nm");
        assert!((meaning.spacing[2] - 600.0).abs() < 1e-9 && meaning.spacing[1] == 200.0);
        let options =
            |scalar: &str| ReadOptions { time: Some(1), ..ReadOptions::scalar(Some(scalar)) };
        assert_eq!(planes(&meaning, 12, &options("c:1")).unwrap(), [9, 10, 11]);
        assert_eq!(planes(&meaning, 12, &ReadOptions::default()).unwrap(), [0, 1, 2]);
        let colors = text
            .replace("SizeC=\"2\"", "SizeC='3'")
            .replace("SamplesPerPixel='1'", "SamplesPerPixel='3'");
        assert_eq!(Meaning::of(&colors, None).channels, 1);
    }

    #[test]
    fn shapes_and_ratios_are_read() {
        let meaning = Meaning::of("{\"shape\": [2, 3, 8, 8]}", Some([72.0, 36.0]));
        assert_eq!((meaning.in_one, meaning.spacing), (Some(6), [1.0, 2.0, 1.0]));
        let second = ReadOptions { time: Some(1), ..ReadOptions::default() };
        assert_eq!(planes(&meaning, 6, &second).unwrap(), [3, 4, 5]);
        for text in ["", "{\"shape\": [8, 8]}", "<svg/>", "a scan"] {
            assert_eq!(
                planes(&Meaning::of(text, None), 3, &ReadOptions::default()).unwrap(),
                [0, 1, 2]
            );
        }
    }

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        let mut names = ["s10.tif", "s9.tif", "s010b.tif", "s1.tif", "a2/s3.tif", "a10/s1.tif"];
        names.sort_by_cached_key(|name| natural(name));
        assert_eq!(names, ["a2/s3.tif", "a10/s1.tif", "s1.tif", "s9.tif", "s10.tif", "s010b.tif"]);
    }
}
