//! The transfer function that is made for a field from what the field is like.
//!
//! Values of a field are those of materials, where their surroundings are even, or of boundaries
//! between two materials, where the gradient is large. See Kindlmann & Durkin 1998, "Semi-automatic
//! generation of transfer functions for direct volume rendering". [`survey`] measures both, and the
//! noise (Immerkær 1996). [`materials`] finds the background, along the edges of the box, and the
//! materials before it. [`recipe`] shows them. If the file says what measured the values,
//! [`modality`] has a recipe of its own.

mod colours;
mod hidden;
mod materials;
mod modality;
mod recipe;
mod survey;
#[cfg(test)]
mod tests;

use super::{Shade, TransferFunction, Volume};
use crate::about::{About, Modality};
use materials::Materials;
use recipe::{Points, Side};
use survey::Survey;

/// Values beyond the background count if there are so many, as a share of all samples; unless they
/// are so far away that no noise reaches them, in spreads of the background.
const LEAST_BEYOND: f64 = 3e-4;
const FAR: f64 = 7.0;
/// A side of the background is shown if it has this share of the samples of the other one.
const LEAST_SIDE: f64 = 0.1;
/// Gradients are certain from the first magnitude on, and count in full from the second one, in
/// standard deviations of the noise per distance of samples. A field of the usual kernels has
/// gradients of 0.6 there, from noise alone.
const CERTAIN: [f64; 2] = [0.7, 2.5];
/// Distance of points from the first to the last, as a share of the range of the values. A smaller
/// one cannot be drawn.
const LEAST_SPAN: f64 = 1e-5;

/// How much of what lies beyond the second value is hidden by what lies between the two.
type Hidden<'a> = dyn Fn(f64, f64) -> f64 + 'a;

impl TransferFunction {
    /// Makes a transfer function for a volume, from its values, their gradients, its noise and what
    /// its file says of it ([`About`]).
    ///
    /// - The background is what lies along the edges of the volume's box. It is clear.
    /// - Materials are values that many samples of even surroundings have. The innermost one, by
    ///   value, is solid. The others are shells at their boundaries, which let the more light
    ///   through the more they hide. Colours differ between materials, and get lighter inwards.
    /// - Without materials, a field with borders is shown as a solid whose colours follow the
    ///   values, and a field without borders as a cloud. Values on both sides of the background get
    ///   blue and red colours.
    /// - Labels get one colour each, that of the file if it has one. Volumes of two whole values
    ///   are masks.
    /// - Hounsfield units, of a file that says so or as the values look, show skin and bone. Other
    ///   modalities have colours and light of their own. The file's window limits the values.
    /// - Light fades where the gradient may be noise ([`Shade::certain`]).
    /// - A single slice is a picture: opaque, and grey from the lowest value of the file's window
    ///   to the highest, or of the values.
    ///
    /// Opacities hold for a hundredth of the volume's diagonal, so the picture depends neither on
    /// the unit of length nor on the sampling. A constant volume is shown as a faint haze. So is a
    /// volume that was built by hand and is inconsistent: whatever draws that volume returns the
    /// error.
    pub fn automatic(volume: &Volume) -> Self {
        if volume.validate().is_err() {
            return haze(0.0, 1.0);
        }
        if let Some(slice) = slice(volume) {
            return slice;
        }
        if let Some(labels) = volume.about.labels.as_ref().filter(|_| volume.is_label_map()) {
            return Self::of_labels(volume, labels);
        }
        let survey = Survey::of_volume(volume, window(&volume.about, volume.range));
        let (dims, spacing) = (volume.lattice.dims, volume.lattice.spacing());
        let thin = [0, 1, 2].map(|axis| match dims[axis] {
            1 => survey.spacing,
            count => (count - 1) as f64 * spacing[axis],
        });
        let thin = thin.into_iter().fold(f64::INFINITY, f64::min);
        let unit = (survey.diagonal / 100.0).min(0.5 * thin);
        let unit = if unit > 0.0 { unit } else { survey.spacing };
        make(&survey, &volume.about, unit, &|outer, inner| hidden::share(volume, outer, inner))
    }

    /// Makes a transfer function for values whose places are not known, as
    /// [`automatic`](Self::automatic) does for a volume: scattered samples, or cells. `diagonal` is
    /// that of the box around them, in world units. Values that are not finite do not count.
    pub fn of_values(values: &[f32], diagonal: f64, about: &About) -> Self {
        let finite = values.iter().copied().filter(|value| value.is_finite()).map(f64::from);
        let range = finite
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        let unit = if diagonal > 0.0 && diagonal.is_finite() { diagonal / 100.0 } else { 1.0 };
        if range[0] >= range[1] {
            return haze(if range[0].is_finite() { range[0] } else { 0.0 }, unit);
        }
        let survey = Survey::of_values(values, range, window(about, range), unit * 100.0);
        make(&survey, about, unit, &|_, _| 0.5)
    }
}

impl Volume {
    /// Returns the values that stand out of the background, without outliers: from its end to the
    /// value that one in two hundred of the samples above it exceed. A background that varies, and
    /// a few bright samples, change it little. The whole range if nothing is above the background.
    pub fn foreground(&self) -> [f64; 2] {
        if self.validate().is_err() || self.range[0] >= self.range[1] {
            return self.range;
        }
        let survey = Survey::of_volume(self, window(&self.about, self.range));
        let side = Side::new(&survey, &Materials::of(&survey), true);
        let [low, high] = [side.start(), side.quantile(0.995)];
        if side.mass() > 0.0 && low < high { [low, high] } else { self.range }
    }
}

/// Returns the part of a range that a file's window shows; `None` without a window, or if it has
/// next to nothing of the range. Hounsfield units mean the same in every window.
fn window(about: &About, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    if about.modality == Some(Modality::Ct) {
        return None;
    }
    let [from, to] = about.window?;
    let window = [from.max(low), to.min(high)];
    (window[1] - window[0] > 0.01 * (high - low).min(to - from)).then_some(window)
}

/// Returns the colour of a label, by its number.
pub(super) fn label_color(number: usize) -> [f64; 3] {
    colours::of_label(number)
}

/// Returns the function of a volume of one slice; `None` for other volumes.
fn slice(volume: &Volume) -> Option<TransferFunction> {
    let (dims, [low, high]) = (volume.lattice.dims, volume.range);
    let axis = dims.iter().position(|&count| count == 1)?;
    let is_slice = dims.iter().filter(|&&count| count > 1).count() == 2;
    let [from, to] = volume.about.window.unwrap_or([low, high]);
    // A window beside the values would show nothing of them.
    let window = [from.max(low), to.min(high)];
    let window = if window[0] < window[1] { [from, to] } else { [low, high] };
    (is_slice && low < high).then(|| TransferFunction {
        color: vec![(window[0], [0.0; 3]), (window[1], [1.0; 3])],
        opacity: vec![(low, 1.0), (high, 1.0)],
        // Far less than the slice's thickness, so that it hides what is behind it.
        unit: 0.1 * volume.lattice.spacing()[axis],
        shade: None,
        ..TransferFunction::default()
    })
}

/// A function that shows a single value.
fn haze(value: f64, unit: f64) -> TransferFunction {
    TransferFunction {
        color: vec![(value, [0.9, 0.8, 0.7])],
        opacity: vec![(value, 0.05)],
        unit,
        shade: Some(Shade::default()),
        ..TransferFunction::default()
    }
}

/// Makes the function of what was found.
fn make(survey: &Survey, about: &About, unit: f64, hidden: &Hidden) -> TransferFunction {
    let [low, high] = survey.range;
    if low >= high {
        return haze(low, unit);
    }
    let materials = Materials::of(survey);
    let (points, is_lit) = modality::points(survey, &materials, about, hidden)
        .unwrap_or_else(|| (general(survey, &materials, hidden), true));
    let transfer = finished(points, survey, unit, is_lit);
    let shows = |transfer: &TransferFunction| transfer.visible(survey.range);
    match transfer.validate() {
        Ok(()) if shows(&transfer) => transfer,
        _ => generic(survey, unit),
    }
}

/// The preset for any values, for what no finding fits.
fn generic(survey: &Survey, unit: f64) -> TransferFunction {
    let generic = TransferFunction::named("generic", survey.range);
    generic.map_or_else(
        |_| haze(survey.range[0], unit),
        |generic| TransferFunction { unit, ..generic },
    )
}

/// Shows a field of which only the values are known.
fn general(survey: &Survey, materials: &Materials, hidden: &Hidden) -> Points {
    if !survey.labels.is_empty() {
        return recipe::of_labels(survey);
    }
    let [below, above] = sides(survey, materials);
    match (below, above) {
        (Some(below), Some(above)) => {
            let of = |side: &Side, ramp: &[[f64; 3]]| {
                let points =
                    if side.has_borders() { side.of_solids(ramp) } else { side.of_field(ramp) };
                side.with_sign(points)
            };
            of(&below, &colours::BELOW).with(of(&above, &colours::ABOVE))
        }
        (Some(side), None) | (None, Some(side)) => {
            let points = if side.has_materials() {
                side.of_materials(hidden)
            } else if side.has_borders() {
                side.of_solids(&colours::SOLID)
            } else {
                side.of_field(&colours::FIELD)
            };
            side.with_sign(points)
        }
        // The values fill the box, as noise and turbulence do: a haze that lets half of the light
        // through, and in which the rarest values are densest.
        (None, None) => {
            let all = Materials { background: [materials.mode; 2], ..materials.clone() };
            let of = |above: bool, ramp: &[[f64; 3]]| {
                let side = Side::new(survey, &all, above);
                side.with_sign(side.of_haze(ramp))
            };
            of(false, &colours::BELOW).with(of(true, &colours::ABOVE))
        }
    }
}

/// Returns the sides of the background that have something to show.
fn sides<'a>(survey: &'a Survey, materials: &Materials) -> [Option<Side<'a>>; 2] {
    let all: f64 = survey.counts.iter().sum();
    let sides = [false, true].map(|above| Side::new(survey, materials, above));
    let [below, above] = [&sides[0], &sides[1]].map(Side::mass);
    let counts = |side: &Side, other: f64| {
        let is_far = side.reach() > FAR * side.spread();
        side.mass() > 0.0
            && (side.mass() > LEAST_BEYOND * all || is_far)
            && side.mass() > LEAST_SIDE * other
    };
    let [first, second] = sides;
    let (is_first, is_second) = (counts(&first, above), counts(&second, below));
    [is_first.then_some(first), is_second.then_some(second)]
}

/// Returns points as a transfer function.
fn finished(mut points: Points, survey: &Survey, unit: f64, is_lit: bool) -> TransferFunction {
    ascend(points.color.iter_mut().map(|point| &mut point.0));
    ascend(points.depth.iter_mut().map(|point| &mut point.0));
    let opacity = |&(value, depth): &(f64, f64)| (value, recipe::opacity(depth, unit));
    let mut transfer = TransferFunction {
        color: points.color,
        opacity: points.depth.iter().map(opacity).collect(),
        unit,
        ..TransferFunction::default()
    };
    let [low, high] = survey.range;
    let [first, last] = transfer.span();
    // Outliers may be so far away that the function would be too narrow to be drawn beside them.
    if last - first < LEAST_SPAN * (high - low)
        && let (Some(&(_, a)), Some(&(_, b))) = (transfer.color.first(), transfer.color.last())
    {
        transfer.color.insert(0, (low.min(first), a));
        transfer.color.push((high.max(last), b));
    }
    if is_lit {
        let shade = Shade::default();
        let faint = shade.certain_in(&transfer, survey.range, survey.diagonal);
        let noise = CERTAIN.map(|part| part * survey.noise / survey.spacing);
        let certain = [faint[0].max(noise[0]), faint[1].max(noise[1])];
        transfer.shade = Some(Shade { certain: Some(certain), ..shade });
    }
    transfer
}

/// Raises values that are below the one before them.
fn ascend<'a>(values: impl Iterator<Item = &'a mut f64>) {
    let mut before = f64::NEG_INFINITY;
    for value in values {
        *value = value.max(before);
        before = *value;
    }
}
