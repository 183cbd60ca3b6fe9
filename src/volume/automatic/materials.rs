//! Materials: values that many samples of even surroundings have, and what surrounds them all.

use super::survey::Survey;

/// A peak must be so many times as high as the saddle towards a higher one.
const PROMINENCE: f64 = 1.5;
/// Share of the samples outside the background that a material has at least.
const LEAST_SHARE: f64 = 0.02;
/// Share of the samples along the edges of the box that a value of the background has at least.
const EDGE_SHARE: f64 = 0.2;
/// Share of the samples along the edges that may be something else, at either end.
const ALONG_EDGES: f64 = 0.004;
/// Or the share of the samples at each of four faces. A thing that is cut off reaches two faces.
const FACE_SHARE: f64 = 0.1;

/// A peak of the histogram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// The most frequent value.
    pub value: f64,
    /// Standard deviation of the values around it.
    pub spread: f64,
    /// The bins up to the valleys on both sides: first and last.
    pub bins: [usize; 2],
    /// Number of samples.
    pub mass: f64,
}

/// The background and the materials in front of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Materials {
    /// The values that belong to the background.
    pub background: [f64; 2],
    /// The most frequent value of the background.
    pub mode: f64,
    /// Materials with values below the background, the nearest value first.
    pub below: Vec<Peak>,
    /// Materials with values above it, the nearest value first.
    pub above: Vec<Peak>,
}

impl Materials {
    /// Finds them.
    pub fn of(survey: &Survey) -> Self {
        let noise = survey.noise / survey.width();
        let mut flat = survey.flat.clone();
        // Values at the ends of what a scanner records say nothing of a material.
        if let [.., before, last] = flat.as_mut_slice()
            && *last > 3.0 * *before
        {
            *last = *before;
        }
        let mut peaks = peaks(&flat, (0.5 * noise).clamp(1.0, 8.0));
        for peak in &mut peaks {
            peak.value = survey.value(peak.value);
            peak.spread *= survey.width();
        }
        let ground = background(survey, &peaks);
        let (first, last) = (ground[0], ground[ground.len() - 1]);
        // The background's own spread, from the side that no material touches.
        let reach = |peak: &Peak| 4.0 * peak.spread.max(survey.noise) + survey.width();
        let mut background = [first.value - reach(&first), last.value + reach(&last)];
        // What lies along the edges is background too, if it is not a material.
        let next = peaks.iter().find(|peak| peak.value > last.value);
        let cap = next.map_or(last.value, |peak| 0.6 * last.value + 0.4 * peak.value);
        background[1] = background[1].max(quantile(survey, 1.0 - ALONG_EDGES).min(cap));
        let before = peaks.iter().rev().find(|peak| peak.value < first.value);
        let cap = before.map_or(first.value, |peak| 0.6 * first.value + 0.4 * peak.value);
        background[0] = background[0].min(quantile(survey, ALONG_EDGES).max(cap));
        let common = ground.iter().fold(first, |a, b| if b.mass > a.mass { *b } else { a });
        let outside: f64 = (0..survey.counts.len())
            .filter(|&bin| {
                let value = survey.value(bin as f64);
                value < background[0] || value > background[1]
            })
            .map(|bin| survey.counts[bin])
            .sum();
        let is_enough = |peak: &&Peak| peak.mass > LEAST_SHARE * outside;
        let materials = peaks.iter().filter(is_enough).copied();
        let mut below: Vec<Peak> =
            materials.clone().filter(|peak| peak.value < first.value.min(background[0])).collect();
        below.reverse();
        let above = materials.filter(|peak| peak.value > last.value.max(background[1])).collect();
        Self { background, mode: common.value, below, above }
    }
}

/// Returns the value below which a share of the samples along the edges lies.
fn quantile(survey: &Survey, share: f64) -> f64 {
    let wanted = share * survey.edges.iter().sum::<f64>();
    let mut seen = 0.0;
    let bin = survey.edges.iter().position(|count| {
        seen += count;
        seen >= wanted
    });
    survey.value(bin.unwrap_or(0) as f64)
}

/// Returns the peaks of the background, ascending: those that many samples along the edges of the
/// box or at its faces belong to, else the highest one.
fn background(survey: &Survey, peaks: &[Peak]) -> Vec<Peak> {
    let has = |counts: &[f64], peak: &Peak, share: f64| {
        let all: f64 = counts.iter().sum();
        all > 0.0 && counts[peak.bins[0]..=peak.bins[1]].iter().sum::<f64>() > share * all
    };
    let at_faces = |peak: &Peak| {
        survey.faces.iter().filter(|counts| has(counts, peak, FACE_SHARE)).count() >= 4
    };
    let is_ground = |peak: &&Peak| has(&survey.edges, peak, EDGE_SHARE) || at_faces(peak);
    let ground: Vec<Peak> = peaks.iter().filter(is_ground).copied().collect();
    if !ground.is_empty() {
        return ground;
    }
    let highest = peaks.iter().copied().reduce(|a, b| if b.mass > a.mass { b } else { a });
    let [low, high] = survey.window;
    let nothing = Peak { value: low, spread: 0.0, bins: [0, 0], mass: 0.0 };
    vec![highest.unwrap_or(if high > low { nothing } else { Peak { value: high, ..nothing } })]
}

/// Returns the peaks of a histogram that is blurred by a standard deviation in bins. Their values
/// and spreads are in bins.
fn peaks(counts: &[f64], blur: f64) -> Vec<Peak> {
    let smooth = blurred(counts, blur);
    let mut order: Vec<usize> = (0..smooth.len()).filter(|&bin| smooth[bin] > 0.0).collect();
    order.sort_by(|a, b| smooth[*b].total_cmp(&smooth[*a]).then(a.cmp(b)));
    // Bins join the peak beside them, from the highest bin down. `heads` are the bins of peaks;
    // a peak that joined another one leads to its head.
    let mut owner = vec![usize::MAX; smooth.len()];
    let mut heads: Vec<(usize, usize)> = Vec::new();
    let head = |heads: &[(usize, usize)], mut peak: usize| {
        while heads[peak].1 != peak {
            peak = heads[peak].1;
        }
        peak
    };
    for bin in order {
        let beside = |at: Option<usize>| {
            let owner = *owner.get(at?)?;
            (owner != usize::MAX).then(|| head(&heads, owner))
        };
        let (left, right) = (beside(bin.checked_sub(1)), beside(Some(bin + 1)));
        owner[bin] = match (left, right) {
            (None, None) => {
                heads.push((bin, heads.len()));
                heads.len() - 1
            }
            (Some(only), None) | (None, Some(only)) => only,
            (Some(a), Some(b)) => {
                let (high, low) =
                    if smooth[heads[a].0] >= smooth[heads[b].0] { (a, b) } else { (b, a) };
                if high != low && smooth[heads[low].0] < PROMINENCE * smooth[bin] {
                    heads[low].1 = high;
                }
                high
            }
        };
    }
    let mut peaks: Vec<Peak> = (0..heads.len())
        .filter(|&peak| heads[peak].1 == peak)
        .map(|peak| {
            let belongs =
                |bin: &usize| owner[*bin] != usize::MAX && head(&heads, owner[*bin]) == peak;
            let bins: Vec<usize> = (0..smooth.len()).filter(belongs).collect();
            peak_of(counts, heads[peak].0, &bins)
        })
        .collect();
    peaks.sort_by(|a, b| a.value.total_cmp(&b.value));
    peaks
}

/// Returns a peak with its most frequent bin and all of its bins. Its spread is measured on the
/// steeper side, because the other side may be another material's.
fn peak_of(counts: &[f64], top: usize, bins: &[usize]) -> Peak {
    let side = |is_own: &dyn Fn(usize) -> bool| {
        let on_side = || bins.iter().copied().filter(|&bin| is_own(bin));
        let mass: f64 = on_side().map(|bin| counts[bin]).sum();
        let square =
            on_side().map(|bin| counts[bin] * (bin as f64 - top as f64).powi(2)).sum::<f64>();
        if mass > 0.0 { (square / mass).sqrt() } else { f64::INFINITY }
    };
    let spread = side(&|bin| bin <= top).min(side(&|bin| bin >= top));
    Peak {
        value: top as f64,
        spread: if spread.is_finite() { spread } else { 0.0 },
        bins: [bins[0], bins[bins.len() - 1]],
        mass: bins.iter().map(|&bin| counts[bin]).sum(),
    }
}

/// Returns counts blurred by a Gaussian. Ends are mirrored, so that a peak at an end stays one.
fn blurred(counts: &[f64], deviation: f64) -> Vec<f64> {
    let reach = (3.0 * deviation).ceil() as isize;
    let last = counts.len() as isize - 1;
    let weight = |by: isize| (-0.5 * (by as f64 / deviation).powi(2)).exp();
    let sum: f64 = (-reach..=reach).map(weight).sum();
    let mirrored = |at: isize| {
        let at = if at < 0 { -at } else { at };
        (if at > last { 2 * last - at } else { at }).clamp(0, last) as usize
    };
    let at = |bin: isize| {
        (-reach..=reach).map(|by| weight(by) * counts[mirrored(bin + by)]).sum::<f64>() / sum
    };
    (0..=last).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_are_told_from_their_noise() {
        // Two materials, the second with a dent in its top.
        let bell = |bin: f64, top: f64, width: f64| (-0.5 * ((bin - top) / width).powi(2)).exp();
        let counts: Vec<f64> = (0..200)
            .map(|bin| {
                let bin = f64::from(bin);
                let dent = if (148.0..152.0).contains(&bin) { 0.9 } else { 1.0 };
                1000.0 * bell(bin, 20.0, 6.0) + 300.0 * dent * bell(bin, 150.0, 10.0)
            })
            .collect();
        let detected = peaks(&counts, 2.0);
        assert_eq!(detected.len(), 2, "{detected:?}");
        assert!((detected[0].value - 20.0).abs() <= 1.0 && (detected[0].spread - 6.0).abs() < 1.0);
        assert!((detected[1].value - 150.0).abs() <= 5.0, "{detected:?}");
        assert!(detected[0].bins[1] < detected[1].bins[0]);
        assert!(peaks(&[0.0; 5], 1.0).is_empty());
        assert_eq!(peaks(&[7.0], 1.0).len(), 1);
    }
}
