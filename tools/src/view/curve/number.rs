//! Numbers and colours with a name, to be typed or dragged.

use eframe::egui::{DragValue, Response, Ui};
use std::ops::RangeInclusive;

/// Shows a named number. A number outside the range stays until it is edited.
pub fn number(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: RangeInclusive<f64>,
    speed: f64,
) -> Response {
    let label = ui.label(name);
    ui.add(field(value, range, speed)).labelled_by(label.id)
}

/// Returns the field of a number. Typed text counts once it is confirmed.
pub fn field(value: &mut f64, range: RangeInclusive<f64>, speed: f64) -> DragValue<'_> {
    DragValue::new(value)
        .range(range)
        .clamp_existing_to_range(false)
        .speed(speed)
        .update_while_editing(false)
        .custom_formatter(|value, _| plain(value))
        .custom_parser(|text| text.trim().parse().ok())
}

/// Shows a colour as a button that opens a picker.
pub fn color(ui: &mut Ui, name: &str, color: &mut [f64; 3]) {
    let mut bytes = color.map(|part| (part * 255.0).round() as u8);
    if ui.color_edit_button_srgb(&mut bytes).accessible_name(name).changed() {
        *color = bytes.map(|part| f64::from(part) / 255.0);
    }
}

/// Formats a number with six significant digits.
pub fn plain(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-4..1e7).contains(&size) {
        let digits = if size >= 1.0 { 5 - size.log10().floor() as i32 } else { 6 };
        let text = format!("{value:.*}", digits.max(0) as usize);
        let trimmed = if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.')
        } else {
            &text
        };
        return trimmed.to_owned();
    }
    format!("{value:.5e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_type_them() {
        for (value, text) in [
            (0.0, "0"),
            (120.0, "120"),
            (-0.25, "-0.25"),
            (1234.5678, "1234.57"),
            (0.000_25, "0.00025"),
            (1.5e-9, "1.50000e-9"),
            (2e12, "2.00000e12"),
            (1_000_000.0, "1000000"),
        ] {
            assert_eq!(plain(value), text);
            assert!((text.parse::<f64>().unwrap() - value).abs() <= 1e-5 * value.abs());
        }
    }
}
