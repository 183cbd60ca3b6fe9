//! The tables in which values are looked up: the transfer function, its integral, the gradient's
//! factor, the kernel and its sections. On the GPU all lie in one buffer
//! (shaders/shared/tables.wgsl).

use crate::{
    math::{Kernel, Profile},
    scene::Item,
    volume::TransferFunction,
};

/// Minimum number of entries of the transfer function, over the values between which it changes.
const VALUES: usize = 4096;

/// Maximum number of entries of the transfer function. Integrals of more are sums in which 32 bits
/// lose single entries.
const MOST_VALUES: usize = 4 * VALUES;

/// Entries of the shortest part in which the function changes, as far as the maximum allows.
const PART: f64 = 256.0;

/// Entries before the first value at which the function changes, and behind the last one.
const BESIDE: f64 = 2.0;

/// Share of the samples' range by which the values of a field may leave it. They do if kernels have
/// negative parts.
const OVERSHOOT: f64 = 0.25;

/// Smallest share of the samples' range in which a step is looked up. Smaller ones are lost in the
/// sums of a sheet.
const LEAST_PART: f64 = 1.0 / 1048576.0;

/// Entries of the gradient's factor.
const GRADIENTS: usize = 1024;

/// Entries of the kernel along its radius.
pub const RADII: usize = 1024;

/// Cells along each side of the table of sections.
pub const SECTIONS: usize = 128;

/// Returns the constants by which tables.wgsl reads the tables.
pub fn constants() -> String {
    format!(
        "const GRADIENT_ENTRIES: u32 = {GRADIENTS}u;\nconst RADIAL_ENTRIES: u32 = {RADII}u;\n\
         const SECTION_CELLS: u32 = {SECTIONS}u;\n"
    )
}

/// The tables of a picture, and the numbers by which values are looked up in them.
#[derive(Debug, Default)]
pub struct Tables {
    /// The transfer function: colour and extinction of an entry, and the last entry again.
    pub colors: Vec<[f32; 4]>,
    /// The running integrals of extinction times colour, and of extinction, in entries.
    pub integrals: Vec<[f32; 4]>,
    /// The gradient's factors.
    pub factors: Vec<f32>,
    /// Value and −h′(r)/r of the kernel at each radius, beside those at the next. Empty, as the
    /// sections are, for kernels with a closed form.
    pub radii: Vec<[f32; 4]>,
    /// The kernel's sections: the four corners of each cell.
    pub sections: Vec<[f32; 4]>,
    pub values: Values<f64>,
    /// Magnitudes are values per world length.
    pub lookup: Factors<f64>,
    /// Extinction times colour, and extinction, of all values before the first entry and of all
    /// behind the last one.
    pub beyond: [[f32; 4]; 2],
}

/// How a value becomes a place among the entries of the transfer function.
#[derive(Debug, Clone, Copy, Default)]
pub struct Values<T> {
    /// The value that counts as 0, which 32 bits represent exactly.
    pub zero: T,
    /// Entries per value.
    pub per_value: T,
    /// The number of the last entry.
    pub last: T,
    /// The place among the entries of the value that counts as 0.
    pub place: T,
}

impl Values<f64> {
    pub fn narrow(self) -> Values<f32> {
        let [zero, per_value, last, place] =
            [self.zero, self.per_value, self.last, self.place].map(|number| number as f32);
        Values { zero, per_value, last, place }
    }
}

/// How a gradient's magnitude becomes a place among the factors.
#[derive(Debug, Clone, Copy, Default)]
pub struct Factors<T> {
    /// The magnitude at the first factor.
    pub first: T,
    /// Factors per magnitude.
    pub per_magnitude: T,
}

impl Factors<f64> {
    pub fn narrow(self) -> Factors<f32> {
        let Self { first, per_magnitude } = self;
        Factors { first: first as f32, per_magnitude: per_magnitude as f32 }
    }
}

impl Tables {
    /// Makes the tables of the field of an item with values in `range`.
    pub fn of(item: &Item, transfer: &TransferFunction, range: [f64; 2]) -> Self {
        let [low, high] = range;
        if item.is_label_map() {
            // Labels are whole numbers, and each has an entry.
            let window = Window { ends: range, entries: (high - low) as usize + 1 };
            let one = Window { ends: [low, low + 1.0], entries: 2 };
            return Self::within(if high > low { window } else { one }, transfer, range, None);
        }
        Self::new(transfer, range, item.kernel())
    }

    /// Makes the tables of a transfer function for samples in `range`, and those of the kernel if
    /// it has no closed form.
    pub fn new(transfer: &TransferFunction, range: [f64; 2], kernel: Option<&Kernel>) -> Self {
        Self::within(window(transfer, range), transfer, range, kernel)
    }

    fn within(
        Window { ends: [low, high], entries: count }: Window,
        transfer: &TransferFunction,
        range: [f64; 2],
        kernel: Option<&Kernel>,
    ) -> Self {
        let last = (count - 1) as f64;
        let mut colors = transfer.table([low, high], count);
        // The last entry again, for interpolation at the upper end.
        colors.push(colors[count - 1]);
        let (factors, lookup) = factors(transfer);
        let is_radial_table =
            |kernel: &&Kernel| !matches!(kernel.profile, Profile::Gaussian(_) | Profile::Tensor(_));
        let kernel = kernel.filter(is_radial_table);
        let (zero, per_value) = (zero(range), last / (high - low));
        Self {
            colors,
            integrals: integrals(transfer, [low, high], count),
            factors,
            radii: kernel.map_or_else(Vec::new, radial),
            sections: kernel.map_or_else(Vec::new, sections),
            values: Values { zero, per_value, last, place: (zero - low) * per_value },
            lookup,
            beyond: [low, high].map(|value| emission(transfer, value).map(|v| v as f32)),
        }
    }
}

/// Returns extinction times colour, and extinction.
fn emission(transfer: &TransferFunction, value: f64) -> [f64; 4] {
    let extinction = transfer.extinction(value);
    let [red, green, blue] = transfer.color(value);
    [red, green, blue, 1.0].map(|part| part * extinction)
}

/// The values that get entries, and the number of entries.
#[derive(Debug, Clone, Copy)]
struct Window {
    ends: [f64; 2],
    entries: usize,
}

/// Returns the values between which the function changes, as far as a field with samples in `range`
/// has them. So a function of a few values has its corners in the right places, however wide the
/// data's range is and wherever the function's other points are.
fn window(transfer: &TransferFunction, [low, high]: [f64; 2]) -> Window {
    // Without samples there is no range.
    let [low, high] = if low <= high { [low, high] } else { [0.0; 2] };
    let reach = OVERSHOOT * (high - low);
    let within =
        |[first, last]: [f64; 2]| [first, last].map(|value| value.clamp(low - reach, high + reach));
    let changes: Vec<_> = changes(transfer).into_iter().map(within).collect();
    let [mut first, mut last] = within(transfer.span());
    let changing = changes
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], part| [a.min(part[0]), b.max(part[1])]);
    // Looking up values without entries costs a little more.
    if changing[1] - changing[0] < 0.25 * (last - first) {
        [first, last] = if changing[0] <= changing[1] { changing } else { [first; 2] };
    }
    // For a single step, or a function that does not change here, the window is at least as wide as
    // the distance between values of 32 bits.
    let least = (first.abs() * 2f64.powi(-22))
        .max(LEAST_PART * (high - low))
        .max(f64::from(f32::MIN_POSITIVE) * VALUES as f64);
    let lack = (least - (last - first)).max(0.0);
    let shortest = changes
        .iter()
        .map(|[a, b]| b - a)
        .filter(|width| *width > 0.0)
        .fold(f64::INFINITY, f64::min);
    let wanted = PART * (last - first).max(least) / shortest;
    let entries = (wanted.min(MOST_VALUES as f64) as usize).next_power_of_two().max(VALUES);
    // If the function begins or ends with a step, both sides of the step get entries.
    let beside = (last - first).max(least) * BESIDE / (entries - 1) as f64;
    Window { ends: [first - lack / 2.0 - beside, last + lack / 2.0 + beside], entries }
}

/// Returns the value that counts as 0: the value nearest to it in the samples' range. If all
/// samples around have that value, as beside a scanned object, their sums are exact, and there is
/// no false slope to be lit.
fn zero([low, high]: [f64; 2]) -> f64 {
    // Without samples there is no range.
    if low <= high { f64::from(0.0f64.clamp(low, high) as f32) } else { 0.0 }
}

/// Returns the parts between two points of the function in which what it shows changes.
fn changes(transfer: &TransferFunction) -> Vec<[f64; 2]> {
    let opacity = transfer
        .opacity
        .windows(2)
        .filter(|pair| pair[0].1 != pair[1].1)
        .map(|pair| [pair[0].0, pair[1].0]);
    // Colours count only where there is opacity.
    let visible = transfer.opacity.windows(2).filter(|pair| pair[0].1 > 0.0 || pair[1].1 > 0.0);
    let ends = |points: &[(f64, f64)]| {
        [(points[0], f64::NEG_INFINITY), (points[points.len() - 1], f64::INFINITY)]
    };
    let beyond = ends(&transfer.opacity).into_iter().filter(|(point, _)| point.1 > 0.0);
    let visible: Vec<[f64; 2]> = visible
        .map(|pair| [pair[0].0, pair[1].0])
        .chain(beyond.map(|((value, _), end)| [value.min(end), value.max(end)]))
        .collect();
    let color = transfer.color.windows(2).filter(|pair| pair[0].1 != pair[1].1).flat_map(|pair| {
        let span = [pair[0].0, pair[1].0];
        visible.iter().map(move |part| [span[0].max(part[0]), span[1].min(part[1])])
    });
    opacity.chain(color.filter(|part| part[0] <= part[1])).collect()
}

/// Returns the running integrals of extinction times colour, and of extinction, in entries. Each
/// step is a mean over points inside it, so that a jump of the function between two entries counts
/// at its place.
fn integrals(transfer: &TransferFunction, [low, high]: [f64; 2], count: usize) -> Vec<[f32; 4]> {
    const INSIDE: usize = 4;
    let last = (count - 1) as f64;
    let mut sum = [0.0f64; 4];
    let mut all = vec![[0.0f32; 4]];
    for i in 0..count {
        for j in 0..INSIDE {
            let at = (i as f64 + (j as f64 + 0.5) / INSIDE as f64).min(last);
            let value = low + (high - low) * at / last;
            for (sum, part) in sum.iter_mut().zip(emission(transfer, value)) {
                *sum += part / INSIDE as f64;
            }
        }
        all.push(sum.map(|v| v as f32));
    }
    all
}

/// Returns the gradient's factors at the magnitudes between which they change, and how they are
/// looked up.
fn factors(transfer: &TransferFunction) -> (Vec<f32>, Factors<f64>) {
    let changing = transfer.gradient.windows(2).filter(|pair| pair[0].1 != pair[1].1);
    let [first, last] = changing.fold([f64::INFINITY, 0.0], |[low, high], pair| {
        [f64::min(low, pair[0].0), f64::max(high, pair[1].0)]
    });
    let first = if first <= last { first } else { 0.0 };
    // Both sides of a step lie within two entries.
    let width = (last - first)
        .max(first * 2f64.powi(-12))
        .max(f64::from(f32::MIN_POSITIVE) * GRADIENTS as f64);
    let step = width / (GRADIENTS - 2) as f64;
    let start = first - 0.5 * step;
    let factor = |i: usize| transfer.gradient_factor(start + step * i.min(GRADIENTS - 1) as f64);
    let factors = (0..=GRADIENTS).map(|i| factor(i) as f32).collect();
    (factors, Factors { first: start, per_magnitude: 1.0 / step })
}

/// Returns value and −h′(r)/r at each radius, beside those at the next.
fn radial(kernel: &Kernel) -> Vec<[f32; 4]> {
    let step = kernel.extent / (RADII - 1) as f64;
    let at = |i: usize| {
        // h′ by central differences. At the centre h′/r has a limit, and a small radius nearly
        // reaches it.
        let r = (i as f64 * step).max(0.5 * step);
        let d = 0.25 * step;
        let slope = (kernel.value((r + d).min(kernel.extent)) - kernel.value(r - d))
            / ((r + d).min(kernel.extent) - r + d);
        [kernel.value(i as f64 * step) as f32, (-slope / r) as f32]
    };
    let entries: Vec<_> = (0..RADII).map(at).collect();
    (0..RADII)
        .map(|i| {
            let ([a, b], [c, d]) = (entries[i], entries[(i + 1).min(RADII - 1)]);
            [a, b, c, d]
        })
        .collect()
}

/// Returns integrals along lines at distance ρ from the centre, from the closest approach to t, for
/// cells of ρ and t (Westover's footprint table of 1990 with one more axis). A cell has its four
/// corners: (ρ, t), (ρ, t+), (ρ+, t), (ρ+, t+).
fn sections(kernel: &Kernel) -> Vec<[f32; 4]> {
    // Integration steps in a cell.
    const INSIDE: usize = 8;
    let cell = kernel.extent / SECTIONS as f64;
    let row = |i: usize| {
        let rho = i as f64 * cell;
        let value = |t: f64| kernel.value((rho * rho + t * t).sqrt());
        let step = cell / INSIDE as f64;
        let mut sum = 0.0;
        let mut row = vec![0.0f32];
        for j in 0..SECTIONS * INSIDE {
            let t = j as f64 * step;
            sum += step / 6.0 * (value(t) + 4.0 * value(t + 0.5 * step) + value(t + step));
            if (j + 1) % INSIDE == 0 {
                row.push(sum as f32);
            }
        }
        row
    };
    let rows: Vec<_> = (0..=SECTIONS).map(row).collect();
    let corners =
        |i: usize, j: usize| [rows[i][j], rows[i][j + 1], rows[i + 1][j], rows[i + 1][j + 1]];
    (0..SECTIONS)
        .flat_map(|i| (0..SECTIONS).map(move |j| (i, j)))
        .map(|(i, j)| corners(i, j))
        .collect()
}

/// Whether samples in a range have values without entries.
pub fn leaves_out(transfer: &TransferFunction, range: [f64; 2]) -> bool {
    let [low, high] = window(transfer, range).ends;
    range[0] < low || high < range[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_have_the_entries_that_are_looked_up() {
        let transfer = TransferFunction {
            gradient: vec![(0.0, 0.0), (2.0, 1.0)],
            ..TransferFunction::default()
        };
        let tables = Tables::new(&transfer, [0.0, 1.0], Some(&Kernel::b_spline(2.0).unwrap()));
        assert_eq!(tables.colors.len(), tables.integrals.len());
        assert_eq!(tables.sections.len(), SECTIONS * SECTIONS);
        assert_eq!(tables.integrals[0], [0.0; 4]);
        assert_eq!(tables.radii[0][0], 1.0);
        let factor = tables.factors[GRADIENTS / 2];
        assert!((factor - 0.5).abs() < 0.01, "{factor}");
        let smooth = Tables::new(&transfer, [0.0, 1.0], Some(&Kernel::default()));
        assert!(smooth.radii.is_empty() && smooth.sections.is_empty());
    }

    #[test]
    fn integrals_are_exact_across_a_jump() {
        let opacity = vec![(0.0, 0.0), (0.5, 0.0), (0.5, 0.9), (1.0, 0.9)];
        let transfer = TransferFunction { opacity, ..TransferFunction::default() };
        let tables = Tables::new(&transfer, [0.0, 1.0], None);
        let Values { zero, per_value, last, place } = tables.values;
        let low = zero - place / per_value;
        let whole = f64::from(tables.integrals[VALUES - 1][3]) / per_value;
        let expected = (low + last / per_value - 0.5) * transfer.extinction(0.9);
        assert!((whole / expected - 1.0).abs() < 1e-3, "{whole} {expected}");
    }

    #[test]
    fn entries_stand_where_the_function_changes() {
        let over = |points: &[(f64, f64)], range| {
            let transfer = TransferFunction {
                color: vec![(points[0].0, [1.0; 3])],
                opacity: points.to_vec(),
                ..TransferFunction::default()
            };
            window(&transfer, range).ends
        };
        // A few hundred values of 16-bit data, and a function far wider than the data's values can
        // be.
        let near = |ends: [f64; 2], expected: [f64; 2]| {
            let beside = (expected[1] - expected[0]) * 2.0 / 4095.0;
            let is_near = ends[0] < expected[0] && expected[1] < ends[1];
            assert!(
                is_near && ends[1] - ends[0] < expected[1] - expected[0] + 2.01 * beside,
                "{ends:?}"
            );
        };
        near(over(&[(100.0, 0.0), (400.0, 1.0)], [-32768.0, 32767.0]), [100.0, 400.0]);
        near(over(&[(-1e6, 0.0), (1e6, 1.0)], [0.0, 100.0]), [-25.0, 125.0]);
        // No samples at all.
        assert!(
            over(&[(100.0, 0.0), (400.0, 1.0)], [f64::INFINITY, f64::NEG_INFINITY])
                .iter()
                .all(|v| v.is_finite())
        );
        // A step, also at 0, and data of a single value.
        for (value, range) in [(80.0, [0.0, 255.0]), (0.0, [-1.0, 1e30]), (7.0, [7.0, 7.0])] {
            let [low, high] = over(&[(value, 0.0), (value, 1.0)], range);
            assert!(
                low < value
                    && value < high
                    && high - low <= (value * 1e-3).max((range[1] - range[0]) * 1e-6) + 1e-30,
                "{low} {high}"
            );
            assert!(((VALUES as f64 / (high - low)) as f32).is_finite());
        }
    }

    /// Both sides of a step at the first or the last point are kept.
    #[test]
    fn values_before_and_behind_are_those_of_the_function() {
        let with = |opacity: &[(f64, f64)]| {
            let color = vec![(opacity[0].0, [1.0; 3])];
            let transfer = TransferFunction {
                color,
                opacity: opacity.to_vec(),
                ..TransferFunction::default()
            };
            let tables = Tables::new(&transfer, [0.0, 255.0], None);
            let entries = [tables.colors[0][3], tables.colors[VALUES - 1][3]];
            let beyond = tables.beyond.map(|emission| emission[3]);
            assert_eq!(
                entries,
                [0.0, 255.0].map(|value| transfer.extinction(value) as f32),
                "{opacity:?}"
            );
            assert_eq!(beyond, entries, "{opacity:?}");
        };
        with(&[(50.0, 0.8), (50.0, 0.0), (100.0, 0.0)]);
        with(&[(0.2, 0.0), (0.9, 0.0), (0.9, 1.0)]);
        with(&[(80.0, 0.0), (80.0, 0.5)]);
    }

    #[test]
    fn sections_add_up_to_the_kernel() {
        let kernel = Kernel::b_spline(2.0).unwrap();
        let cells = sections(&kernel);
        // Twice the integrals at all ρ, summed over the rings around the axis, are the integral
        // over space.
        let cell = kernel.extent / SECTIONS as f64;
        let ring = |i: usize| {
            let [_, inner, _, outer] = cells[i * SECTIONS + SECTIONS - 1].map(f64::from);
            let (a, b) = (i as f64 * cell, (i + 1) as f64 * cell);
            2.0 * std::f64::consts::PI * (a * inner + b * outer) * (b - a)
        };
        let whole: f64 = (0..SECTIONS).map(ring).sum();
        assert!((whole / kernel.integral() - 1.0).abs() < 1e-3, "{whole}");
    }
}
