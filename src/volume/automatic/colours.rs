//! The colours of the automatic transfer function, from the background's side inwards. Lightness
//! ascends, so that they also differ without their hues.

type Rgb = [f64; 3];

/// Materials: from thin air to what is inside. Warm, because scans of bodies often do not say that
/// they are some.
pub const MATERIALS: [Rgb; 4] =
    [[0.62, 0.34, 0.27], [0.80, 0.54, 0.38], [0.93, 0.76, 0.52], [0.98, 0.94, 0.86]];
/// Solids of many values.
pub const SOLID: [Rgb; 3] = [[0.58, 0.33, 0.27], [0.86, 0.64, 0.47], [0.99, 0.94, 0.82]];
/// Values below a background that has values on both sides.
pub const BELOW: [Rgb; 2] = [[0.22, 0.40, 0.78], [0.62, 0.86, 1.0]];
/// Values above it.
pub const ABOVE: [Rgb; 2] = [[0.80, 0.30, 0.22], [1.0, 0.85, 0.50]];
/// Fields without borders.
pub const FIELD: [Rgb; 4] =
    [[0.30, 0.28, 0.62], [0.18, 0.57, 0.60], [0.50, 0.79, 0.36], [0.99, 0.90, 0.36]];
/// Magnetic resonance.
pub const MAGNETIC: [Rgb; 3] = [[0.46, 0.38, 0.40], [0.80, 0.69, 0.62], [1.0, 0.97, 0.92]];
/// Emission tomography.
pub const HOT: [Rgb; 4] =
    [[0.35, 0.02, 0.02], [0.80, 0.15, 0.02], [1.0, 0.60, 0.05], [1.0, 1.0, 0.85]];
/// Ultrasound.
pub const SOUND: [Rgb; 3] = [[0.38, 0.22, 0.12], [0.85, 0.60, 0.35], [1.0, 0.93, 0.80]];
/// Fluorescence.
pub const GLOW: [Rgb; 3] = [[0.02, 0.28, 0.16], [0.12, 0.78, 0.30], [0.80, 1.0, 0.75]];

/// Returns the colour of a ramp at a place from 0 to 1.
pub fn at(ramp: &[Rgb], place: f64) -> Rgb {
    let place = place.clamp(0.0, 1.0) * (ramp.len() - 1) as f64;
    let below = (place as usize).min(ramp.len().saturating_sub(2));
    let above = (below + 1).min(ramp.len() - 1);
    let share = place - below as f64;
    std::array::from_fn(|i| ramp[below][i] * (1.0 - share) + ramp[above][i] * share)
}

/// Returns the colour of a label. Hues of successive labels are a golden angle apart, and every
/// other one is darker.
pub fn of_label(number: usize) -> Rgb {
    let hue = (0.58 + 0.618_034 * number as f64).fract() * 6.0;
    let (value, strength) = [(0.95, 0.62), (0.80, 0.78), (1.0, 0.40)][number % 3];
    std::array::from_fn(|channel| {
        // The usual conversion from hue, saturation and value (Smith 1978).
        let place = (hue + [5.0, 3.0, 1.0][channel]) % 6.0;
        value * (1.0 - strength * place.min(4.0 - place).clamp(0.0, 1.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramps_ascend_in_lightness() {
        let light = |[r, g, b]: Rgb| 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let ramps: [&[Rgb]; 9] =
            [&MATERIALS, &SOLID, &BELOW, &ABOVE, &FIELD, &MAGNETIC, &HOT, &SOUND, &GLOW];
        for ramp in ramps {
            assert!(ramp.windows(2).all(|pair| light(pair[0]) < light(pair[1])), "{ramp:?}");
            assert_eq!((at(ramp, -1.0), at(ramp, 1.0)), (ramp[0], ramp[ramp.len() - 1]));
        }
        assert_eq!(at(&[[0.0; 3], [1.0; 3]], 0.25), [0.25; 3]);
    }

    #[test]
    fn labels_have_colours_of_their_own() {
        for a in 0..64 {
            for b in 0..a {
                let (first, second) = (of_label(a), of_label(b));
                let apart: f64 = (0..3).map(|i| (first[i] - second[i]).powi(2)).sum();
                let least = if a < 12 { 0.08 } else { 1e-3 };
                assert!(apart.sqrt() > least, "{a} {b}: {first:?} {second:?}");
            }
        }
    }
}
