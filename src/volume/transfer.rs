//! Transfer functions: the colour and the opacity that a value is drawn with.

use super::Shade;
use crate::{
    Error, Result,
    input::{Limits, Source},
};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Colour and opacity as piecewise linear functions of the value, in the data's unit. Before the
/// first point and after the last one the function is constant. Two points at one value make a
/// step.
///
/// An opacity holds for a layer of that value that is `unit` of world length thick, so the picture
/// does not depend on the sampling. Colours are display colours: they are mixed and composited as
/// they are, without gamma conversion.
///
/// As JSON: `{"color": [[value, red, green, blue], …], "opacity": [[value, opacity], …], "unit":
/// 1.0, "shade": {"ambient": 0.2, "diffuse": 0.7, "specular": 0.3, "power": 10}}`. Without `unit`
/// it is 1; without `shade` the volume is not lit. Optional: `"gradient": [[magnitude, factor], …]`
/// and `"isosurfaces": [{"value": 80, "color": [1, 1, 1], "opacity": 1}, …]`.
///
/// Values below 200 are invisible here:
///
/// ```
/// use splatkit::volume::TransferFunction;
///
/// let bone = TransferFunction::from_json(
///     r#"{"color": [[0, 0.8, 0.5, 0.4], [1000, 1, 1, 0.9]],
///         "opacity": [[200, 0], [700, 0.5]], "unit": 2.0}"#,
/// )?;
/// assert_eq!(bone.opacity(450.0), 0.25);
/// assert_eq!(bone.opacity(3000.0), 0.5);
/// assert!(!bone.visible([-1000.0, 200.0]));
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Document", into = "Document")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "Document"))]
pub struct TransferFunction {
    /// Value, and red, green, blue in 0 … 1. Values ascend.
    pub color: Vec<(f64, [f64; 3])>,
    /// Value, and opacity in 0 … 1 per `unit`. Values ascend.
    pub opacity: Vec<(f64, f64)>,
    /// The world length that the opacities hold for.
    pub unit: f64,
    /// How gradients are lit; `None` leaves colours as they are.
    pub shade: Option<Shade>,
    /// Gradient magnitude (value per world length), and a factor of 0 … 1 on the extinction there
    /// (Levoy 1988). Magnitudes ascend. If empty, no factor applies.
    pub gradient: Vec<(f64, f64)>,
    /// Isosurfaces, drawn in addition to what the opacity shows.
    pub isosurfaces: Vec<Isosurface>,
}

/// A surface of one value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Isosurface {
    /// The value of the field on the surface.
    pub value: f64,
    /// Red, green, blue, 0 … 1.
    pub color: [f64; 3],
    /// The fraction of light that the surface absorbs, above 0 and at most 1.
    pub opacity: f64,
}

impl Default for TransferFunction {
    /// Shows nothing.
    fn default() -> Self {
        Self {
            color: vec![(0.0, [1.0; 3])],
            opacity: vec![(0.0, 0.0)],
            unit: 1.0,
            shade: None,
            gradient: Vec::new(),
            isosurfaces: Vec::new(),
        }
    }
}

/// The largest opacity that is used as it is. Opacity 1 would need an infinite extinction. The
/// missing 1/10,000 is far below the 1/255 steps of a displayed picture.
const OPAQUE: f64 = 0.9999;

/// Extinctions that can be drawn: their sums fit in 32 bits, and they still show over the longest
/// paths.
const EXTINCTIONS: std::ops::RangeInclusive<f64> = 1e-25..=1e30;

/// The size limit of a transfer function's file. A larger file is something else.
const MOST_BYTES: usize = 1 << 20;

/// The layout of the JSON.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Document {
    color: Vec<[f64; 4]>,
    opacity: Vec<[f64; 2]>,
    #[serde(default = "one")]
    unit: f64,
    #[serde(default)]
    shade: Option<Shade>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    gradient: Vec<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    isosurfaces: Vec<Isosurface>,
}

fn one() -> f64 {
    1.0
}

impl TransferFunction {
    /// Most isosurfaces in one picture.
    pub const MAX_ISOSURFACES: usize = 8;

    /// Reads the JSON form.
    ///
    /// # Errors
    /// [`Error::Transfer`] for invalid JSON (with line and column), and those of
    /// [`validate`](Self::validate).
    pub fn from_json(text: &str) -> Result<Self> {
        Self::parse(text).map_err(Error::Transfer)
    }

    /// Like [`from_json`](Self::from_json). The error is a message, to which the caller adds the
    /// place.
    fn parse(text: &str) -> Result<Self, String> {
        let document: Document = serde_json::from_str(text).map_err(|e| e.to_string())?;
        Self::try_from(document)
    }
}

impl TryFrom<Document> for TransferFunction {
    type Error = String;

    fn try_from(document: Document) -> Result<Self, String> {
        let transfer = Self {
            color: document.color.iter().map(|&[value, r, g, b]| (value, [r, g, b])).collect(),
            opacity: document.opacity.iter().map(|&[value, opacity]| (value, opacity)).collect(),
            unit: document.unit,
            shade: document.shade,
            gradient: document
                .gradient
                .iter()
                .map(|&[magnitude, factor]| (magnitude, factor))
                .collect(),
            isosurfaces: document.isosurfaces,
        };
        transfer.check()?;
        Ok(transfer)
    }
}

impl From<TransferFunction> for Document {
    fn from(transfer: TransferFunction) -> Self {
        let pair = |(value, share): (f64, f64)| [value, share];
        Self {
            color: transfer.color.iter().map(|&(value, [r, g, b])| [value, r, g, b]).collect(),
            opacity: transfer.opacity.into_iter().map(pair).collect(),
            unit: transfer.unit,
            shade: transfer.shade,
            gradient: transfer.gradient.into_iter().map(pair).collect(),
            isosurfaces: transfer.isosurfaces,
        }
    }
}

impl TransferFunction {
    /// Returns the JSON form, which [`from_json`](Self::from_json) reads back.
    pub fn to_json(&self) -> String {
        serde_json::json!(self).to_string()
    }

    /// Reads a JSON file.
    ///
    /// # Errors
    /// [`Error::File`] and [`Error::Limit`] as for every input; [`Error::Input`] if the file is not
    /// a transfer function.
    pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        let path = path.as_ref();
        let text = Source::open(path, limits)?.small_text("a transfer function", MOST_BYTES)?;
        Self::parse(&text).map_err(|message| {
            Error::input(path, "transfer function", message).hint(
                "the form is {\"color\": [[value, r, g, b], …], \
                     \"opacity\": [[value, opacity], …]}, all but values in 0 … 1",
            )
        })
    }

    /// Checks what the other functions rely on. Colour and opacity have at least one point each,
    /// and their values are finite and ascend. Colours and opacities lie in 0 … 1, and at least one
    /// opacity is over 0 unless there are isosurfaces. The unit is over 0. The coefficients of the
    /// shade are finite and not negative.
    ///
    /// # Errors
    /// [`Error::Transfer`], which names the first point that is wrong.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(Error::Transfer)
    }

    /// Like [`validate`](Self::validate). The error is a message, to which the caller adds the
    /// place.
    fn check(&self) -> Result<(), String> {
        self.validate_numbers()?;
        if self.opacity.iter().all(|p| p.1 == 0.0) && self.isosurfaces.is_empty() {
            return Err(
                "a transfer function without opacity shows nothing: every opacity is 0".into()
            );
        }
        Ok(())
    }

    /// Like [`validate`](Self::validate), but accepts a function that shows nothing.
    pub(crate) fn validate_numbers(&self) -> Result<(), String> {
        check_values("color", self.color.iter().map(|p| p.0))?;
        check_values("opacity", self.opacity.iter().map(|p| p.0))?;
        let inside = |v: &f64| (0.0..=1.0).contains(v);
        if let Some(i) = self.color.iter().position(|(_, rgb)| !rgb.iter().all(inside)) {
            return Err(format!(
                "color point {i} is {:?}, but channels lie in 0 … 1",
                self.color[i].1
            ));
        }
        if let Some(i) = self.opacity.iter().position(|(_, opacity)| !inside(opacity)) {
            return Err(format!(
                "opacity point {i} is {}, but opacities lie in 0 … 1",
                self.opacity[i].1
            ));
        }
        if !self.gradient.is_empty() {
            check_values("gradient", self.gradient.iter().map(|p| p.0))?;
        }
        if let Some(i) =
            self.gradient.iter().position(|(magnitude, factor)| *magnitude < 0.0 || !inside(factor))
        {
            let (magnitude, factor) = self.gradient[i];
            return Err(format!(
                "gradient point {i} is {factor} at {magnitude}, but magnitudes are 0 or more and \
                 factors lie in 0 … 1"
            ));
        }
        let most = Self::MAX_ISOSURFACES;
        if self.isosurfaces.len() > most {
            return Err(format!(
                "there are {} isosurfaces, more than {most}",
                self.isosurfaces.len()
            ));
        }
        for (i, Isosurface { value, color, opacity }) in self.isosurfaces.iter().enumerate() {
            if !(value.is_finite() && color.iter().all(inside) && *opacity > 0.0 && *opacity <= 1.0)
            {
                return Err(format!(
                    "isosurface {i} has value {value}, colour {color:?} and opacity {opacity}, but \
                     colours lie in 0 … 1 and opacities above 0 and up to 1"
                ));
            }
        }
        if !(self.unit.is_finite() && self.unit > 0.0) {
            return Err(format!("the unit is {}, but it must be a length over 0", self.unit));
        }
        let extinction = self.most_extinction();
        if extinction > 0.0 && !EXTINCTIONS.contains(&extinction) {
            return Err(format!(
                "the unit of {:?} leads to an extinction of {extinction}, beyond what can be drawn",
                self.unit
            ));
        }
        self.shade.as_ref().map_or(Ok(()), Shade::check)
    }

    /// Returns the same function stretched so that its points reach from one end of `range` to the
    /// other. If all points lie at one value, the function is only moved.
    #[must_use]
    pub fn spread_over(mut self, range: [f64; 2]) -> Self {
        let [low, high] = self.span();
        let turn = |value: f64| {
            let share = if high > low { share(low, high, value) } else { 0.0 };
            mix(range[0], range[1], share)
        };
        self.color.iter_mut().for_each(|p| p.0 = turn(p.0));
        self.opacity.iter_mut().for_each(|p| p.0 = turn(p.0));
        self.isosurfaces.iter_mut().for_each(|surface| surface.value = turn(surface.value));
        self
    }

    /// Returns the smallest interval that holds all values with opacity or an isosurface. An end is
    /// infinite if the function keeps its opacity beyond its points. `None` if the function shows
    /// nothing.
    pub fn visible_range(&self) -> Option<[f64; 2]> {
        let first = self.opacity.iter().position(|p| p.1 > 0.0);
        let last = self.opacity.iter().rposition(|p| p.1 > 0.0);
        let seen = first.zip(last).map(|(first, last)| {
            let low =
                first.checked_sub(1).map_or(f64::NEG_INFINITY, |before| self.opacity[before].0);
            let high = self.opacity.get(last + 1).map_or(f64::INFINITY, |after| after.0);
            [low, high]
        });
        let surfaces = self.isosurfaces.iter().map(|surface| [surface.value; 2]);
        seen.into_iter().chain(surfaces).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// Returns the smallest and the largest value of the points.
    pub(crate) fn span(&self) -> [f64; 2] {
        let values = self.color.iter().map(|p| p.0).chain(self.opacity.iter().map(|p| p.0));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    }

    /// Returns red, green, blue of a value, 0 … 1.
    pub fn color(&self, value: f64) -> [f64; 3] {
        let (below, above, t) = segment(&self.color, value);
        std::array::from_fn(|channel| mix(below[channel], above[channel], t))
    }

    /// Returns the fraction of light that `unit` of world length of this value absorbs, 0 … 1.
    pub fn opacity(&self, value: f64) -> f64 {
        let (below, above, t) = segment(&self.opacity, value);
        mix(below, above, t)
    }

    /// Returns the factor on the extinction at a gradient magnitude (value per world length).
    pub fn gradient_factor(&self, magnitude: f64) -> f64 {
        if self.gradient.is_empty() {
            return 1.0;
        }
        let (below, above, t) = segment(&self.gradient, magnitude);
        mix(below, above, t)
    }

    /// Returns the extinction per world length: −ln(1 − opacity) / unit. A length s of one value
    /// then transmits e^(−extinction·s). Opacities over 0.9999 count as 0.9999, because 1 has no
    /// finite extinction.
    pub fn extinction(&self, value: f64) -> f64 {
        -(1.0 - self.opacity(value).min(OPAQUE)).ln() / self.unit
    }

    /// Returns the largest extinction of any value.
    pub fn most_extinction(&self) -> f64 {
        self.opacity.iter().map(|&(value, _)| self.extinction(value)).fold(0.0, f64::max)
    }

    /// Returns red, green, blue and extinction per world length at `entries` values evenly spaced
    /// over `range`, both ends included. The table is meant for linear interpolation. Features
    /// narrower than the distance of two entries blur.
    pub fn table(&self, range: [f64; 2], entries: usize) -> Vec<[f32; 4]> {
        let last = entries.saturating_sub(1).max(1) as f64;
        let entry = |i: usize| {
            let value = mix(range[0], range[1], i as f64 / last);
            let [r, g, b] = self.color(value);
            [r, g, b, self.extinction(value)].map(|v| v as f32)
        };
        (0..entries).map(entry).collect()
    }

    /// Returns whether any value in the closed interval `range` has opacity or an isosurface. The
    /// result is exact, except that a step's value belongs to both of its sides.
    pub fn visible(&self, range: [f64; 2]) -> bool {
        // The function is linear between its points, so its maximum is at a point or at an end of
        // the interval.
        let [low, high] = range;
        self.isosurfaces.iter().any(|surface| low <= surface.value && surface.value <= high)
            || self.opacity(low) > 0.0
            || self.opacity(high) > 0.0
            || self
                .opacity
                .iter()
                .any(|&(value, opacity)| opacity > 0.0 && low <= value && value <= high)
    }
}

fn check_values(what: &str, values: impl Iterator<Item = f64>) -> Result<(), String> {
    let mut previous = None;
    for (i, value) in values.enumerate() {
        if !value.is_finite() {
            return Err(format!("the value of {what} point {i} is {value}"));
        }
        if let Some(previous) = previous.filter(|p| value < *p) {
            return Err(format!(
                "{what} point {i} is at {value}, before the previous one at {previous}"
            ));
        }
        previous = Some(value);
    }
    previous.map(|_| ()).ok_or_else(|| format!("there are no {what} points"))
}

/// Returns the entries at the points around a value, and where it lies between them (0 … 1). At a
/// step, the upper side is returned. Without points, defaults.
fn segment<T: Copy + Default>(points: &[(f64, T)], value: f64) -> (T, T, f64) {
    let above = points.partition_point(|p| p.0 <= value);
    match (above.checked_sub(1).map(|below| points[below]), points.get(above)) {
        (Some((v0, p0)), Some(&(v1, p1))) => (p0, p1, share(v0, v1, value)),
        (Some((_, only)), None) | (None, Some(&(_, only))) => (only, only, 0.0),
        (None, None) => (T::default(), T::default(), 0.0),
    }
}

/// Returns where `value` lies between `low` and `high`, 0 … 1. The distance of the two may exceed
/// the largest number.
fn share(low: f64, high: f64, value: f64) -> f64 {
    let width = high - low;
    if width.is_finite() {
        (value - low) / width
    } else {
        (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low)
    }
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = r#"{"color": [[0, 0, 0, 0], [60, 0.8, 0.4, 0.2], [255, 1, 1, 1]],
        "opacity": [[0, 0], [40, 0], [80, 0.05], [160, 0.4], [255, 0.8]], "unit": 2.0,
        "shade": {"ambient": 0.2, "diffuse": 0.7, "specular": 0.3, "power": 10}}"#;

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    }

    #[test]
    fn stretching_moves_the_points_and_nothing_else() {
        let transfer = TransferFunction {
            color: vec![(10.0, [0.0; 3]), (30.0, [1.0; 3])],
            opacity: vec![(20.0, 0.0), (30.0, 0.5)],
            unit: 2.0,
            ..TransferFunction::default()
        };
        assert_eq!(transfer.visible_range(), Some([20.0, f64::INFINITY]));
        let stretched = transfer.clone().spread_over([-1.0, 1.0]);
        assert_eq!(stretched.color, [(-1.0, [0.0; 3]), (1.0, [1.0; 3])]);
        assert_eq!(stretched.opacity, [(0.0, 0.0), (1.0, 0.5)]);
        assert_eq!((stretched.unit, stretched.opacity(0.5)), (2.0, 0.25));
        assert_eq!(transfer.spread_over([3.0, 3.0]).opacity(3.0), 0.5);
    }

    #[test]
    fn values_by_hand() {
        let t = TransferFunction::from_json(EXAMPLE).unwrap();
        assert_eq!(t.color(30.0), [0.4, 0.2, 0.1]);
        assert_eq!((t.color(-1.0), t.color(300.0)), ([0.0; 3], [1.0; 3]));
        close(t.opacity(60.0), 0.025);
        close(t.opacity(120.0), 0.225);
        close(t.opacity(1e9), 0.8);
        // −ln(1 − 0.8) / 2
        close(t.extinction(255.0), 0.804_718_956_217_050_1);
        assert_eq!(t.shade, Some(Shade::default()));
        assert_eq!(TransferFunction::from_json(&t.to_json()).unwrap(), t);
    }

    #[test]
    fn defaults_steps_and_the_cap() {
        let t = TransferFunction::from_json(
            r#"{"color": [[5, 1, 0, 0]], "opacity": [[1, 0], [2, 0], [2, 1]], "shade": null}"#,
        )
        .unwrap();
        assert_eq!((t.unit, t.shade, t.color(-3.0)), (1.0, None, [1.0, 0.0, 0.0]));
        assert_eq!((t.opacity(1.999), t.opacity(2.0)), (0.0, 1.0));
        close(t.extinction(2.0), -(1e-4f64.ln()));
    }

    #[test]
    fn tables_include_both_ends() {
        let t = TransferFunction::from_json(EXAMPLE).unwrap();
        let table = t.table([0.0, 255.0], 18);
        assert_eq!(table.len(), 18);
        for (i, entry) in table.iter().enumerate() {
            let value = i as f64 * 15.0;
            assert!((f64::from(entry[3]) - t.extinction(value)).abs() < 1e-6);
            assert!((f64::from(entry[1]) - t.color(value)[1]).abs() < 1e-6);
        }
        assert!(t.table([3.0, 3.0], 0).is_empty());
        assert_eq!(t.table([255.0, 255.0], 1)[0][0], 1.0);
    }

    #[test]
    fn visibility_agrees_with_sampling() {
        let json = r#"{"color": [[0, 0, 0, 0]], "opacity": [[10, 0], [20, 0], [30, 0.5], [40, 0],
            [60, 0], [60, 0.1], [61, 0]]}"#;
        let t = TransferFunction::from_json(json).unwrap();
        for low in 0..80 {
            for high in low..80 {
                let interval = [f64::from(low), f64::from(high)];
                let sampled = (low * 8..=high * 8).any(|v| t.opacity(f64::from(v) / 8.0) > 0.0);
                assert_eq!(t.visible(interval), sampled, "{interval:?}");
            }
        }
        assert!(!t.visible([0.0, 20.0]) && t.visible([0.0, 20.001]) && t.visible([29.0, 29.0]));
    }

    #[test]
    fn what_is_wrong_is_told() {
        let with = |color: &str, opacity: &str, rest: &str| {
            TransferFunction::from_json(&format!(
                "{{\"color\": {color}, \"opacity\": {opacity}{rest}}}"
            ))
            .unwrap_err()
        };
        let (color, opacity) = ("[[0,1,1,1]]", "[[0,1]]");
        for (message, word) in [
            (with("[]", opacity, ""), "no color points"),
            (with(color, "[]", ""), "no opacity points"),
            (with("[[1,0,0,0],[0,0,0,0]]", opacity, ""), "color point 1 is at 0, before"),
            (with("[[1,0,0,128]]", opacity, ""), "0 … 1"),
            (with(color, "[[0,0.5],[1,1.5]]", ""), "opacity point 1 is 1.5"),
            (with(color, "[[0,-0.5]]", ""), "opacity point 0"),
            (with(color, "[[0,0],[1,0]]", ""), "without opacity"),
            (with(color, "[[1e999,1]]", ""), "out of range"),
            (with(color, "[[NaN,1]]", ""), "line 1"),
            (with(color, opacity, ", \"unit\": 0"), "unit is 0"),
            (with(color, opacity, ", \"units\": 1"), "unknown field"),
            (
                with(
                    color,
                    opacity,
                    ", \"shade\": {\"ambient\": -1, \"diffuse\": 0, \"specular\": 0, \"power\": 1}",
                ),
                "coefficients of light",
            ),
        ] {
            assert!(message.to_string().contains(word), "{message}");
        }
        let mut t = TransferFunction::from_json(EXAMPLE).unwrap();
        t.opacity[2].0 = f64::NAN;
        assert!(t.validate().unwrap_err().to_string().contains("opacity point 2 is NaN"));
        t.color.clear();
        assert_eq!(t.color(1.0), [0.0; 3]);
    }
}
