//! Window and level: a drag in the picture moves and widens the whole function.

use eframe::egui::Vec2;
use splatkit::volume::TransferFunction;

/// The drag that doubles the width of the function, in points.
const DOUBLE: f64 = 150.0;
/// The drag that moves the function over all values, in points.
const WHOLE: f64 = 600.0;
/// The least and the largest width, as shares of the range of values.
const WIDTHS: [f64; 2] = [1e-5, 100.0];

/// Widens a function around its middle if the pointer moved to the right, and moves it to higher
/// values if the pointer moved up. `delta` is the pointer's movement in points, and `values` the
/// range of the data.
///
/// A function that cannot be changed so stays as it is: without points at two values there is no
/// width, and numbers beyond what can be drawn are refused.
pub fn window_level(transfer: &mut TransferFunction, delta: Vec2, values: [f64; 2]) {
    let points = transfer.color.iter().map(|p| p.0).chain(transfer.opacity.iter().map(|p| p.0));
    let [low, high] = points.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    let whole = values[1] - values[0];
    let whole = if whole > 0.0 { whole } else { 1.0 };
    let width = (high - low) * 2.0_f64.powf(f64::from(delta.x) / DOUBLE);
    let width = if high > low { width.clamp(WIDTHS[0] * whole, WIDTHS[1] * whole) } else { 0.0 };
    let middle = low + 0.5 * (high - low) - whole * f64::from(delta.y) / WHOLE;
    let range = [middle - 0.5 * width, middle + 0.5 * width];
    if !range.iter().all(|end| end.is_finite()) {
        return;
    }
    let moved = transfer.clone().spread_over(range);
    if moved.validate().is_ok() {
        *transfer = moved;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::vec2;
    use splatkit::volume::Isosurface;

    fn transfer() -> TransferFunction {
        TransferFunction {
            color: vec![(20.0, [0.0; 3]), (60.0, [1.0; 3])],
            opacity: vec![(20.0, 0.0), (60.0, 0.5)],
            isosurfaces: vec![Isosurface { value: 30.0, color: [1.0; 3], opacity: 1.0 }],
            ..TransferFunction::default()
        }
    }

    fn ends(transfer: &TransferFunction) -> [f64; 3] {
        let [first, last] = [0, 1].map(|i| transfer.opacity[i].0);
        [first, last, transfer.isosurfaces[0].value]
    }

    #[test]
    fn drags_widen_and_move() {
        let mut wide = transfer();
        window_level(&mut wide, vec2(150.0, 0.0), [0.0, 120.0]);
        assert_eq!(ends(&wide), [0.0, 80.0, 20.0]);
        let mut moved = transfer();
        window_level(&mut moved, vec2(0.0, -300.0), [0.0, 120.0]);
        assert_eq!(ends(&moved), [80.0, 120.0, 90.0]);
    }

    #[test]
    fn widths_have_limits_and_functions_stay_valid() {
        let mut narrow = transfer();
        window_level(&mut narrow, vec2(-1e9, 0.0), [0.0, 100.0]);
        let [first, last, _] = ends(&narrow);
        assert!(last - first > 0.9e-3 && narrow.validate().is_ok());
        let mut single = TransferFunction {
            color: vec![(5.0, [1.0; 3])],
            opacity: vec![(5.0, 1.0)],
            ..TransferFunction::default()
        };
        window_level(&mut single, vec2(50.0, -60.0), [0.0, 10.0]);
        assert_eq!((single.color[0].0, single.opacity[0].0), (6.0, 6.0));
        let before = transfer();
        let mut same = before.clone();
        window_level(&mut same, vec2(f32::NAN, f32::INFINITY), [0.0, 100.0]);
        assert_eq!(same, before);
    }
}
