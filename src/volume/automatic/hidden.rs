//! How much of what is inside a material the material hides.

use crate::volume::{Volume, each_type};

/// Rays along each side of a face of the volume's box.
const RAYS: usize = 48;
/// Samples of a material before what is inside it that come from the border of what is inside
/// alone.
const BORDER: usize = 3;

/// Returns the share of the rays to what lies beyond the second value that pass more than the
/// border of what lies beyond the first one. Values lie beyond if they are larger, or smaller if
/// the second value is. Rays run along the axes, from all six sides. Without any such ray, 0.
pub fn share(volume: &Volume, outer: f64, inner: f64) -> f64 {
    each_type!(volume.samples, values => {
        let beyond = |at: usize, limit: f64| {
            let value = f64::from(values[at]);
            if outer <= inner { value >= limit } else { value <= limit }
        };
        share_of(volume.lattice.dims, |at| beyond(at, outer), |at| beyond(at, inner))
    })
}

fn share_of(
    dims: [usize; 3],
    is_outer: impl Fn(usize) -> bool,
    is_inner: impl Fn(usize) -> bool,
) -> f64 {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let (mut hidden, mut all) = (0u32, 0u32);
    for axis in 0..3 {
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let counts = [a, b].map(|side| dims[side].min(RAYS));
        let place = |side: usize, number: usize, count: usize| {
            strides[side] * ((2 * number + 1) * dims[side] / (2 * count))
        };
        for number in 0..counts[0] * counts[1] {
            let start =
                place(a, number % counts[0], counts[0]) + place(b, number / counts[0], counts[1]);
            for from_end in [false, true] {
                let at = |step: usize| {
                    start + strides[axis] * if from_end { dims[axis] - 1 - step } else { step }
                };
                let Some(hit) = (0..dims[axis]).position(|step| is_inner(at(step))) else { break };
                let passed = (0..hit).filter(|&step| is_outer(at(step))).count();
                hidden += u32::from(passed > BORDER);
                all += 1;
            }
        }
    }
    if all > 0 { f64::from(hidden) / f64::from(all) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_hides_its_core_and_a_film_does_not() {
        let share = |thick: i32| {
            let n = 40;
            let radius = |at: usize| {
                let [x, y, z] = [at % n, at / n % n, at / n / n].map(|i| i as f64 - 19.5);
                (x * x + y * y + z * z).sqrt()
            };
            share_of([n; 3], |at| radius(at) < f64::from(8 + thick), |at| radius(at) < 8.0)
        };
        assert!(share(10) > 0.99 && share(2) < 0.4, "{} {}", share(10), share(2));
        assert_eq!(share_of([4; 3], |_| true, |_| false), 0.0);
    }
}
