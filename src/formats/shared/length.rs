//! Units of length.

/// Returns the length of a unit in metres, by its usual sign.
pub(crate) fn meters(unit: &str) -> Option<f64> {
    Some(match unit {
        "Å" => 1e-10,
        "pm" => 1e-12,
        "nm" => 1e-9,
        "µm" => 1e-6,
        "mm" => 1e-3,
        "cm" => 1e-2,
        "m" => 1.0,
        "km" => 1e3,
        _ => return None,
    })
}
