//! Colour maps: colours of numbers, by name.

mod diverging;
pub(crate) mod lab;
mod name;
mod tables;

pub use name::{hex, parse};

use crate::{Error, Result, parallel::prelude::*};
use serde::{Deserialize, Deserializer, Serialize, de};
use std::{
    fmt,
    sync::{LazyLock, Mutex, PoisonError},
};

/// A colour map: the colour of each number from 0 to 1.
///
/// ```
/// use splatkit::color::ColorMap;
///
/// let map = ColorMap::named("viridis")?;
/// assert_eq!(map.color(0.0).map(|part| (part * 255.0).round()), [68.0, 1.0, 84.0]);
/// assert_eq!(ColorMap::named("viridis_r")?.color(1.0), map.color(0.0));
/// # Ok::<(), splatkit::Error>(())
/// ```
///
/// A map may also be a list of colours at even distances:
/// `ColorMap::named("black, #ff8800, white")`.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(into = "String")]
pub struct ColorMap {
    /// The name, or the colours of a list.
    name: &'static str,
    is_reversed: bool,
    /// The points of a list of colours.
    listed: Option<&'static Points>,
}

impl PartialEq for ColorMap {
    fn eq(&self, other: &Self) -> bool {
        (self.name, self.is_reversed) == (other.name, other.is_reversed)
    }
}

impl Eq for ColorMap {}

/// How values become colours.
///
/// ```
/// use splatkit::color::{ColorMap, ColorScale};
///
/// let scale = ColorScale { range: [0.0, 50.0], ..ColorScale::new(ColorMap::named("gray")?) };
/// assert_eq!(scale.color(25.0), [0.5; 3]);
/// assert_eq!(scale.color(80.0), [1.0; 3]);
/// assert_eq!(scale.color(f64::NAN), scale.missing);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ColorScale {
    /// The colours.
    pub map: ColorMap,
    /// The values with the first and the last colour. Values outside have the nearer one.
    pub range: [f64; 2],
    /// Whether the colours are spread over the logarithms of the values. The range must be above 0
    /// then.
    pub is_log: bool,
    /// The colour of values that are not numbers: red, green, blue in 0 … 1.
    pub missing: [f32; 3],
}

/// Which of a set of values a scale spans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Spread {
    /// From the lowest to the highest value.
    Full,
    /// From the first to the last percentile, for values with outliers.
    Percentiles,
}

/// The points of each map, between which colours are linear.
type Points = Vec<(f64, [f64; 3])>;

static MAPS: LazyLock<[(&str, Points); 13]> = LazyLock::new(|| {
    [
        ("viridis", even(&tables::VIRIDIS)),
        ("inferno", even(&tables::INFERNO)),
        ("magma", even(&tables::MAGMA)),
        ("plasma", even(&tables::PLASMA)),
        ("cividis", even(&tables::CIVIDIS)),
        ("turbo", even(&tables::TURBO)),
        ("coolwarm", diverging::points([0x3b4cc0, 0xb40426].map(rgb))),
        ("gray", even(&[0x000000, 0xffffff])),
        ("hot", at(&[(0.0, 0x0b0000), (0.365, 0xff0000), (0.746, 0xffff00), (1.0, 0xffffff)])),
        (
            "jet",
            at(&[
                (0.0, 0x00007f),
                (0.125, 0x0000ff),
                (0.375, 0x00ffff),
                (0.625, 0xffff00),
                (0.875, 0xff0000),
                (1.0, 0x7f0000),
            ]),
        ),
        ("twilight", even(&tables::TWILIGHT)),
        ("blues", even(&[0xf7fbff, 0xc6dbef, 0x6baed6, 0x2171b5, 0x08306b])),
        ("classes", even(&tables::CLASSES)),
    ]
});

/// The lists of colours that have become maps. They are kept as long as the process lives, so that
/// maps can be copied like names.
static LISTED: Mutex<Vec<ColorMap>> = Mutex::new(Vec::new());

/// Values of which percentiles are taken: of more, every second, third, … one.
const MOST_SAMPLED: usize = 1 << 20;

impl ColorMap {
    /// The names that [`named`](Self::named) accepts. Each may end with `_r`, which reverses it.
    pub const NAMES: [&str; 13] = [
        "viridis", "inferno", "magma", "plasma", "cividis", "turbo", "coolwarm", "gray", "hot",
        "jet", "twilight", "blues", "classes",
    ];

    /// The map that suits most values: even steps of it look even, also to colour-blind people and
    /// in grey.
    pub const VIRIDIS: Self = Self::builtin("viridis", false);

    /// From black to white.
    pub const GRAY: Self = Self::builtin("gray", false);

    /// The classes of airborne scans (LAS): one colour for each whole number, without mixing.
    pub const CLASSES: Self = Self::builtin("classes", false);

    /// Most colours of a list.
    pub const MOST_COLORS: usize = 256;

    const fn builtin(name: &'static str, is_reversed: bool) -> Self {
        Self { name, is_reversed, listed: None }
    }

    /// Returns the map of a name, or that of a list of colours, separated by commas. Case does not
    /// matter; `grey` is `gray`.
    ///
    /// # Errors
    /// [`Error::Argument`] for another name, with the names that there are, and for a list of fewer
    /// than 2 or more than [`MOST_COLORS`](Self::MOST_COLORS) colours.
    pub fn named(name: &str) -> Result<Self> {
        if name.contains(',') {
            return Self::of_list(name);
        }
        let lower = name.trim().to_ascii_lowercase().replace("grey", "gray");
        let (plain, is_reversed) = match lower.strip_suffix("_r") {
            Some(plain) => (plain, true),
            None => (lower.as_str(), false),
        };
        let matching = Self::NAMES.into_iter().find(|known| *known == plain);
        matching.map(|name| Self::builtin(name, is_reversed)).ok_or_else(|| {
            Error::Argument(format!(
                "there is no colour map “{name}”; there are {}, and each reversed, such as \
                 viridis_r; a list of colours, such as black,orange,white, is a map, too",
                Self::NAMES.join(", ")
            ))
        })
    }

    /// Returns the map of a list of colours, which may end with `_r`.
    fn of_list(text: &str) -> Result<Self> {
        let (list, is_reversed) = match text.trim().strip_suffix("_r") {
            Some(list) => (list, true),
            None => (text, false),
        };
        let wrong =
            |message: String| Error::Argument(format!("a colour map of colours: {message}"));
        let part = |(number, part): (usize, &str)| {
            let place = || format!("colour {} is “{}”, but ", number + 1, part.trim());
            parse(part).map_err(|message| wrong(place() + &message))
        };
        let colors: Vec<[f32; 3]> = list.split(',').enumerate().map(part).collect::<Result<_>>()?;
        if !(2..=Self::MOST_COLORS).contains(&colors.len()) {
            let most = Self::MOST_COLORS;
            return Err(wrong(format!("it has {} colours, not 2 to {most}", colors.len())));
        }
        let packed: Vec<u32> = colors
            .into_iter()
            .map(|color| color.map(|part| (part * 255.0).round() as u8))
            .map(|[r, g, b]| u32::from_be_bytes([0, r, g, b]))
            .collect();
        let name: Vec<String> = packed.iter().map(|color| format!("#{color:06x}")).collect();
        let name = name.join(",");
        let mut listed = LISTED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = listed.iter().find(|map| map.name == name) {
            return Ok(Self { is_reversed, ..*known });
        }
        let points = Some(&*Box::leak(Box::new(even(&packed))));
        let map = Self { name: name.leak(), is_reversed: false, listed: points };
        listed.push(map);
        Ok(Self { is_reversed, ..map })
    }

    /// Returns whether each whole number has a colour of its own.
    pub fn is_categorical(self) -> bool {
        self.name == Self::CLASSES.name
    }

    /// Returns red, green and blue of a number, each 0 … 1. Numbers outside 0 … 1 have the nearer
    /// end's colour.
    pub fn color(self, share: f64) -> [f64; 3] {
        let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
        let share = if self.is_reversed { 1.0 - share } else { share };
        let points = self.table();
        let above = points.partition_point(|point| point.0 <= share).min(points.len() - 1);
        let ((from, a), (to, b)) = (points[above.saturating_sub(1)], points[above]);
        let t = if to > from { (share - from) / (to - from) } else { 0.0 };
        std::array::from_fn(|channel| a[channel] + (b[channel] - a[channel]) * t)
    }

    /// Returns the points between which the colours are linear: a number from 0 to 1 and its red,
    /// green and blue. The first is 0 and the last 1.
    pub fn points(self) -> Vec<(f64, [f64; 3])> {
        let mut points = self.table().clone();
        if self.is_reversed {
            points.reverse();
            points.iter_mut().for_each(|point| point.0 = 1.0 - point.0);
        }
        points
    }

    fn table(self) -> &'static Points {
        if let Some(points) = self.listed {
            return points;
        }
        let entry = MAPS.iter().find(|(name, _)| *name == self.name);
        &entry.unwrap_or(&MAPS[0]).1
    }
}

impl fmt::Display for ColorMap {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(self.name)?;
        if self.is_reversed { out.write_str("_r") } else { Ok(()) }
    }
}

impl From<ColorMap> for String {
    fn from(map: ColorMap) -> Self {
        map.to_string()
    }
}

impl<'de> Deserialize<'de> for ColorMap {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        let (plain, is_reversed) =
            name.strip_suffix("_r").map_or((name.as_str(), false), |plain| (plain, true));
        // `named` does not know the map of classes, which nobody chooses by its name.
        if plain == Self::CLASSES.name {
            return Ok(Self { is_reversed, ..Self::CLASSES });
        }
        Self::named(&name).map_err(de::Error::custom)
    }
}

impl ColorScale {
    /// The colour of what has no value, unless another is set.
    pub const MISSING: [f32; 3] = [0.75, 0.7, 0.75];

    /// Returns a scale from 0 to 1.
    pub fn new(map: ColorMap) -> Self {
        Self { map, range: [0.0, 1.0], is_log: false, missing: Self::MISSING }
    }

    /// Returns the colour of a value: red, green and blue, each 0 … 1.
    pub fn color(&self, value: f64) -> [f32; 3] {
        if value.is_nan() {
            return self.missing;
        }
        if self.map.is_categorical() {
            let points = self.map.table();
            let class = (value.round().max(0.0) as usize).min(1 << 20) % points.len();
            return points[class].1.map(|part| part as f32);
        }
        self.map.color(self.share(value)).map(|part| part as f32)
    }

    /// Returns where a value lies in the range: 0 at its low end, 1 at its high end.
    pub fn share(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        if self.is_log && low > 0.0 {
            let place = value.max(f64::MIN_POSITIVE);
            return middle((place / low).ln() / (high / low).ln());
        }
        // Halves, because the width of the range may exceed the largest number.
        middle((0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low))
    }

    /// Returns the value at a share of the range, the inverse of [`share`](Self::share).
    pub fn value(&self, share: f64) -> f64 {
        let [low, high] = self.range;
        if self.is_log && low > 0.0 {
            return low * (high / low).powf(share);
        }
        low * (1.0 - share) + high * share
    }
}

impl Spread {
    /// Returns the range of the values that are numbers; `None` if there are none. With
    /// `is_positive`, only values above 0 count.
    ///
    /// Percentiles of more than a million values are those of every second, third, … value.
    pub fn range(self, values: &[f32], is_positive: bool) -> Option<[f64; 2]> {
        let counts = |value: &f32| value.is_finite() && (*value > 0.0 || !is_positive);
        let step = match self {
            Self::Full => 1,
            Self::Percentiles => values.len().div_ceil(MOST_SAMPLED).max(1),
        };
        let each = values.par_iter().step_by(step).copied().filter(counts);
        let [low, high] = match self {
            Self::Full => {
                let none = || [f32::INFINITY, f32::NEG_INFINITY];
                let both = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
                each.fold(none, |all, value| both(all, [value; 2])).reduce(none, both)
            }
            Self::Percentiles => {
                let mut sampled: Vec<f32> = each.collect();
                let last = sampled.len().checked_sub(1)?;
                let mut at = |rank| *sampled.select_nth_unstable_by(rank, f32::total_cmp).1;
                [at(last / 100), at(last - last / 100)]
            }
        };
        (low <= high).then_some([f64::from(low), f64::from(high)])
    }
}

/// The share of the only value of a range without width is the middle.
fn middle(share: f64) -> f64 {
    if share.is_nan() { 0.5 } else { share }
}

/// Returns red, green and blue of a colour that is packed as on the web.
fn rgb(packed: u32) -> [f64; 3] {
    let [_, parts @ ..] = packed.to_be_bytes();
    parts.map(|part| f64::from(part) / 255.0)
}

/// Returns colours at equal distances.
fn even(colors: &[u32]) -> Points {
    let last = (colors.len() - 1) as f64;
    colors.iter().enumerate().map(|(i, &color)| (i as f64 / last, rgb(color))).collect()
}

fn at(points: &[(f64, u32)]) -> Points {
    points.iter().map(|&(at, color)| (at, rgb(color))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(map: &str, share: f64) -> [f64; 3] {
        ColorMap::named(map).unwrap().color(share).map(|part| (part * 255.0).round())
    }

    #[test]
    fn maps_have_the_published_colours() {
        assert_eq!(bytes("viridis", 0.0), [68.0, 1.0, 84.0]);
        assert_eq!(bytes("viridis", 1.0), [253.0, 231.0, 37.0]);
        assert_eq!(bytes("inferno", 0.0), [0.0, 0.0, 4.0]);
        assert_eq!(bytes("turbo", 0.0), [48.0, 18.0, 59.0]);
        assert_eq!(bytes("turbo", 1.0), [122.0, 4.0, 3.0]);
        assert_eq!(bytes("jet", 0.5), [128.0, 255.0, 128.0]);
        // The middle of Moreland's map is the grey 0.865 of his paper.
        assert_eq!(bytes("coolwarm", 0.5), [221.0; 3]);
        assert_eq!(bytes("coolwarm", 0.0), [59.0, 76.0, 192.0]);
        assert_eq!(bytes("coolwarm", 1.0), [180.0, 4.0, 38.0]);
        // A quarter of it, as his table of 33 colours has it.
        assert_eq!(bytes("coolwarm", 0.25), [141.0, 176.0, 254.0]);
    }

    #[test]
    fn names_reverse_and_unknown_ones_list_all() {
        for name in ColorMap::NAMES {
            let map = ColorMap::named(name).unwrap();
            assert_eq!(MAPS.iter().filter(|(known, _)| *known == name).count(), 1, "{name}");
            let turned = ColorMap::named(&format!("{name}_r")).unwrap();
            assert_eq!(turned.to_string(), format!("{name}_r"));
            for (share, color) in turned.points() {
                let other = map.color(1.0 - share);
                let apart = |c: usize| (other[c] - color[c]).abs();
                assert!((0..3).all(|c| apart(c) < 1e-9), "{name} at {share}");
            }
        }
        assert_eq!(ColorMap::named("Grey").unwrap(), ColorMap::GRAY);
        let message = ColorMap::named("virids").unwrap_err().to_string();
        assert!(message.contains("viridis, inferno") && message.contains("_r"), "{message}");
    }

    #[test]
    fn lists_of_colours_are_maps() {
        let map = ColorMap::named("black, #ff8800,WHITE").unwrap();
        assert_eq!(map.to_string(), "#000000,#ff8800,#ffffff");
        assert_eq!(map.color(0.25).map(|part| (part * 255.0).round()), [128.0, 68.0, 0.0]);
        let again = ColorMap::named(&map.to_string()).unwrap();
        assert!(again == map && std::ptr::eq(again.table(), map.table()), "leaked twice");
        let turned = ColorMap::named(&format!("{map}_r")).unwrap();
        assert_eq!(turned.color(0.1), map.color(0.9));
        assert_eq!(turned.to_string(), "#000000,#ff8800,#ffffff_r");
        let text = serde_json::to_string(&turned).unwrap();
        assert_eq!(serde_json::from_str::<ColorMap>(&text).unwrap(), turned);
        for (bad, place) in [
            ("red,", "colour 2 is “”, but a colour is"),
            ("red, rde ,blue_r", "colour 2 is “rde”, but a colour is"),
            ("red,blue,#ff880080", "colour 3 is “#ff880080”, but a colour has no opacity"),
            (&["red"; 257].join(","), "257 colours, not 2 to 256"),
        ] {
            let message = ColorMap::named(bad).unwrap_err().to_string();
            assert!(message.contains(place), "{bad}: {message}");
        }
    }

    #[test]
    fn scales_are_linear_logarithmic_or_of_classes() {
        let gray = ColorScale::new(ColorMap::GRAY);
        let log = ColorScale { range: [1.0, 10_000.0], is_log: true, ..gray };
        assert_eq!((log.color(100.0), log.color(-5.0)), ([0.5; 3], [0.0; 3]));
        assert!((log.value(0.75) - 1000.0).abs() < 1e-9 && (log.share(10.0) - 0.25).abs() < 1e-12);
        let flat = ColorScale { range: [3.0, 3.0], ..gray };
        assert_eq!(flat.color(3.0), [0.5; 3]);
        let wide = ColorScale { range: [-1.5e308, 1.5e308], ..gray };
        assert_eq!(wide.color(0.0), [0.5; 3]);
        let classes = ColorScale::new(ColorMap::CLASSES);
        let water = classes.color(9.0);
        assert!(water[2] > water[0] && water == classes.color(9.2) && water != classes.color(8.0));
    }

    #[test]
    fn ranges_leave_out_what_is_no_number() {
        let mut values: Vec<f32> = (0..=1000).map(|i| i as f32).collect();
        values.extend([f32::NAN, f32::INFINITY, -1e9]);
        assert_eq!(Spread::Full.range(&values, false), Some([-1e9, 1000.0]));
        assert_eq!(Spread::Full.range(&values, true), Some([1.0, 1000.0]));
        assert_eq!(Spread::Percentiles.range(&values, false), Some([9.0, 990.0]));
        assert_eq!(Spread::Full.range(&[f32::NAN], false), None);
        assert_eq!(Spread::Percentiles.range(&[], false), None);
    }
}
