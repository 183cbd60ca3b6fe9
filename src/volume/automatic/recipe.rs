//! How findings become colours and opacities.

use super::{
    colours,
    materials::{Materials, Peak},
    survey::Survey,
};

/// Half of a boundary's part of the distance between two materials' values: values nearer to a
/// material than the rest belong to it.
const HALF: f64 = 0.25;
/// Materials are clear up to this many standard deviations from their most frequent value.
const CLEAR: f64 = 2.5;
/// Layers are apart by this share of the distance from the background to the innermost one.
const APART: f64 = 0.15;
/// Share of the samples before the background that lie far beyond the last material, if they are a
/// layer.
const LEAST_BEYOND: f64 = 0.004;
/// Most layers in one picture. More of them hide each other.
const MOST_LAYERS: usize = 3;
/// Most of the light that a unit length of any value absorbs.
const SOLID: f64 = 0.97;

/// Colours and opacities of values on one side of the background, from the background outwards.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// Value, and red, green, blue.
    pub color: Vec<(f64, [f64; 3])>,
    /// Value, and optical depth per world length.
    pub depth: Vec<(f64, f64)>,
}

impl Points {
    /// Adds a colour and an optical depth at a value.
    fn add(&mut self, value: f64, color: [f64; 3], depth: f64) {
        self.color.push((value, color));
        self.depth.push((value, depth));
    }

    /// Returns the points with values turned around, so that they ascend again.
    fn turned(mut self) -> Self {
        self.color.iter_mut().for_each(|point| point.0 = -point.0);
        self.depth.iter_mut().for_each(|point| point.0 = -point.0);
        self.color.reverse();
        self.depth.reverse();
        self
    }

    /// Returns these points and those of higher values.
    pub fn with(mut self, other: Self) -> Self {
        self.color.extend(other.color);
        self.depth.extend(other.depth);
        self
    }
}

/// One side of the background, with values that ascend away from it: those below the background
/// change their sign.
#[derive(Debug, Clone)]
pub struct Side<'a> {
    survey: &'a Survey,
    /// −1 for values below the background, else 1.
    sign: f64,
    /// The most frequent value of the background.
    mode: f64,
    /// The value at which the background ends.
    start: f64,
    /// The last value of the window.
    top: f64,
    materials: Vec<(f64, f64)>,
    /// Samples from the start on: their values and numbers.
    counts: Vec<(f64, f64)>,
}

impl<'a> Side<'a> {
    /// The side above the background if `above`, else the one below it.
    pub fn new(survey: &'a Survey, materials: &Materials, above: bool) -> Self {
        let sign = if above { 1.0 } else { -1.0 };
        let start = materials.background[usize::from(above)] * sign;
        let peaks: &[Peak] = if above { &materials.above } else { &materials.below };
        let mut counts: Vec<(f64, f64)> = (0..survey.counts.len())
            .map(|bin| (survey.value(bin as f64) * sign, survey.counts[bin]))
            .filter(|(value, _)| *value > start)
            .collect();
        if !above {
            counts.reverse();
        }
        Self {
            survey,
            sign,
            mode: materials.mode * sign,
            start,
            top: survey.window[usize::from(above)] * sign,
            materials: peaks.iter().map(|peak| (peak.value * sign, peak.spread)).collect(),
            counts,
        }
    }

    /// Number of samples beyond the background.
    pub fn mass(&self) -> f64 {
        self.counts.iter().map(|(_, count)| count).sum()
    }

    /// Returns the value at which the background ends.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Distance of the last value from the background's most frequent one.
    pub fn reach(&self) -> f64 {
        let last = self.counts.iter().rev().find(|(_, count)| *count > 0.0);
        last.map_or(0.0, |(value, _)| value - self.mode)
    }

    /// The background's spread on this side.
    pub fn spread(&self) -> f64 {
        0.25 * (self.start - self.mode)
    }

    /// Whether materials were found.
    pub fn has_materials(&self) -> bool {
        !self.materials.is_empty()
    }

    /// Returns the value below which a share of the samples of this side lies.
    pub fn quantile(&self, share: f64) -> f64 {
        let wanted = share * self.mass();
        let mut seen = 0.0;
        let entry = self.counts.iter().find(|(_, count)| {
            seen += count;
            seen >= wanted
        });
        entry.map_or(self.top, |(value, _)| *value)
    }

    /// Returns the mean gradient at a value, in value per world length; 0 if unknown.
    fn slope(&self, value: f64) -> f64 {
        self.survey.slopes[self.survey.bin(value * self.sign)]
    }

    /// Returns the usual length of a ray through what lies above a value: that of a cube with as
    /// many samples.
    fn thickness(&self, value: f64) -> f64 {
        let above: f64 =
            self.counts.iter().filter(|(v, _)| *v >= value).map(|(_, count)| count).sum();
        let all: f64 = self.survey.counts.iter().sum();
        let side = self.survey.diagonal / 3f64.sqrt();
        ((above / all.max(1.0)).cbrt() * side).max(self.survey.spacing)
    }

    /// Whether the field rises from the background to the values of this side within a few samples,
    /// as it does at the border of a solid.
    pub fn has_borders(&self) -> bool {
        let (low, high) = (self.quantile(0.05), self.quantile(0.9));
        let rise = high - self.mode;
        let near =
            self.counts.iter().filter(|(value, _)| (low..=0.5 * (low + high)).contains(value));
        let (mut sum, mut count) = (0.0, 0.0);
        for &(value, number) in near {
            sum += number * self.slope(value);
            count += number;
        }
        count > 0.0 && sum / count * self.survey.spacing > 0.06 * rise
    }

    /// Returns the most frequent values of the layers to be shown, with their spreads: of the
    /// outermost and the innermost material, and of the largest one between them. Values far beyond
    /// the last material are a layer too, if they are many and hidden in it.
    fn layers(&self, hidden: &dyn Fn(f64, f64) -> f64) -> Vec<(f64, f64)> {
        let mut layers = self.materials.clone();
        let (last, spread) = layers[layers.len() - 1];
        let far = last + (4.0 * spread).max(APART * (self.quantile(0.999) - self.mode));
        let beyond: f64 =
            self.counts.iter().filter(|(value, _)| *value > far).map(|(_, count)| count).sum();
        let share = beyond / self.mass();
        if share > LEAST_BEYOND {
            let value = self.quantile(1.0 - 0.4 * share);
            let middle = 0.5 * (last + value);
            if share < 0.5
                && hidden(self.sign * 0.5 * (self.mode + last), self.sign * middle) > 0.25
            {
                layers.push((value, (value - last) / 8.0));
            }
        }
        // The nearest neighbours look alike: the outer one stands for both.
        let apart = 0.5 * APART * (layers[layers.len() - 1].0 - self.mode);
        let mut kept: Vec<(f64, f64)> = Vec::new();
        for layer in layers {
            if kept.last().is_none_or(|before| layer.0 - before.0 > apart) {
                kept.push(layer);
            }
        }
        while kept.len() > MOST_LAYERS {
            kept.remove(kept.len() - 2);
        }
        kept
    }

    /// Returns the values of the boundaries between layers: the background and the first one, the
    /// first and the second one, and so on. Each is with half of its width.
    fn boundaries(&self, layers: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let mut before = self.mode;
        let mut boundaries = Vec::new();
        for &(value, spread) in layers {
            let half = HALF * (value - before);
            // The first boundary keeps away from the background's noise.
            let clear = if boundaries.is_empty() { self.start } else { before };
            let most = (value - CLEAR * spread).max(0.5 * (before + value));
            // Thin things do not reach the values that thick ones have.
            let share = if boundaries.is_empty() { 0.4 } else { 0.5 };
            let middle = before + share * (value - before);
            let middle = middle.max((clear + half).min(most));
            boundaries.push((middle, half.min(middle - clear).max(0.25 * half)));
            before = value;
        }
        boundaries
    }

    /// Shows materials: translucent shells at all boundaries but the last, beyond which everything
    /// is solid. `hidden` returns the share of what lies beyond the second value that the first
    /// one's material hides.
    pub fn of_materials(&self, hidden: &dyn Fn(f64, f64) -> f64) -> Points {
        let boundaries = self.boundaries(&self.layers(hidden));
        let count = boundaries.len();
        let mut points = Points::default();
        for (number, &(middle, half)) in boundaries.iter().enumerate() {
            let color = colours::at(&colours::MATERIALS, number as f64 / count as f64);
            if number + 1 == count {
                let solid = self.solid();
                let far = self.quantile(0.995).max(middle + 1.5 * half);
                points.add(middle - half, color, 0.0);
                points.add(middle + half, color, solid);
                points.add(
                    0.5 * (middle + half + far),
                    colours::at(&colours::MATERIALS, 0.7),
                    solid,
                );
                points.add(far, colours::at(&colours::MATERIALS, 1.0), solid);
                continue;
            }
            let (next, next_half) = boundaries[number + 1];
            let share = hidden(middle * self.sign, next * self.sign);
            // The more a shell hides, the more light it lets through.
            let opacity = 0.85 - 0.65 * (2.0 * share).min(1.0);
            let end = (middle + half).min(next - next_half);
            let slope = self.slope(middle);
            let length = if slope > 0.0 { half / slope } else { self.survey.spacing };
            let depth = -(1.0 - opacity).ln() / length.max(0.5 * self.survey.spacing);
            points.add(middle - half, color, 0.0);
            points.add(middle, color, depth);
            // What is inside a shell that hides little stays solid.
            let rest = (1.0 - 2.0 * share).max(0.0) * 0.5 * self.solid();
            points.add(end, color, rest);
            points.add(next - next_half, color, rest);
        }
        points
    }

    /// The optical depth per world length of solid values: nine tenths of the light are absorbed
    /// over two samples.
    fn solid(&self) -> f64 {
        1.15 / self.survey.spacing
    }

    /// Shows solids of many values: clear background, a border, and everything inside solid, with
    /// colours that follow the values.
    pub fn of_solids(&self, ramp: &[[f64; 3]]) -> Points {
        let (half, high) = (self.quantile(0.5), self.quantile(0.97));
        let mut points = Points::default();
        let border = self.start + 0.3 * (half - self.start);
        points.add(self.start, ramp[0], 0.0);
        points.add(border, colours::at(ramp, 0.2), 0.5 * self.solid());
        points.add(half.max(border), colours::at(ramp, 0.55), self.solid());
        points.add(high.max(half), colours::at(ramp, 1.0), self.solid());
        points
    }

    /// Shows a field without borders as a cloud: half of the light passes what lies above the
    /// median, and the more is absorbed the farther values are from the background.
    pub fn of_field(&self, ramp: &[[f64; 3]]) -> Points {
        let mut points = Points::default();
        points.add(self.start, ramp[0], 0.0);
        for (share, light, place) in [(0.5, 0.75, 0.3), (0.8, 0.5, 0.6), (0.98, 0.15, 1.0)] {
            let value = self.quantile(share);
            if value > points.depth[points.depth.len() - 1].0 {
                let depth = -f64::ln(light) / self.thickness(value);
                points.add(value, colours::at(ramp, place), depth);
            }
        }
        points
    }

    /// Shows values that fill the whole box.
    pub fn of_haze(&self, ramp: &[[f64; 3]]) -> Points {
        let length = self.survey.diagonal / 3f64.sqrt();
        let mut points = Points::default();
        points.add(self.mode, ramp[0], 0.6 / length);
        points.add(self.quantile(0.7), colours::at(ramp, 0.3), 1.2 / length);
        points.add(self.quantile(0.995), colours::at(ramp, 1.0), 20.0 / length);
        points
    }

    /// Returns points of this side with the values of the field. On the side below the background,
    /// these have the other sign.
    pub fn with_sign(&self, points: Points) -> Points {
        if self.sign < 0.0 { points.turned() } else { points }
    }
}

/// Shows labels: each in a colour of its own, all solid but the background.
pub fn of_labels(survey: &Survey) -> Points {
    let labels = &survey.labels;
    let edge = |label: f64| survey.edges[survey.bin(label)];
    let ground =
        labels.iter().copied().fold(labels[0], |a, b| if edge(b) > edge(a) { b } else { a });
    let solid = 2.0 / survey.spacing;
    if let [low, high] = labels[..] {
        let at = |share: f64| low + (high - low) * share;
        let color = colours::at(&colours::MATERIALS, 0.75);
        let mut points = Points::default();
        let is_low = ground == low;
        for (share, depth) in [(0.3, 0.0), (0.6, 1.0)] {
            let share = if is_low { share } else { 1.0 - share };
            points.add(at(share), color, depth * solid);
        }
        if !is_low {
            points.color.reverse();
            points.depth.reverse();
        }
        return points;
    }
    let mut points = Points::default();
    let mut number = 0;
    for (place, &label) in labels.iter().enumerate() {
        let gap = |other: Option<&f64>| other.map_or(1.0, |other| (other - label).abs());
        let before = place.checked_sub(1).and_then(|at| labels.get(at));
        let half = [before, labels.get(place + 1)].map(|other| (0.25 * gap(other)).min(0.08));
        let (color, depth) = if label == ground {
            ([0.5; 3], 0.0)
        } else {
            number += 1;
            (colours::of_label(number - 1), solid)
        };
        let [low, high] = [label - half[0], label + half[1]];
        points.color.extend([(low, color), (high, color)]);
        // Between labels the field has no meaning: it only passes there from one to another.
        points.depth.extend([(low, 0.0), (low, depth), (high, depth), (high, 0.0)]);
    }
    points
}

/// The optical depth that is an opacity over a length.
pub fn opacity(depth: f64, length: f64) -> f64 {
    (-(-depth * length).exp_m1()).min(SOLID)
}
