//! CIELAB, in which distances are about those that people see (CIE 1976), with the white of sRGB
//! (D65).

/// The white of sRGB, D65, in CIE XYZ.
const WHITE: [f64; 3] = [0.95047, 1.0, 1.08883];

/// Linear sRGB to CIE XYZ, and back.
const TO_XYZ: [[f64; 3]; 3] = [
    [0.4124564, 0.3575761, 0.1804375],
    [0.2126729, 0.7151522, 0.0721750],
    [0.0193339, 0.1191920, 0.9503041],
];
const TO_RGB: [[f64; 3]; 3] = [
    [3.2404542, -1.5371385, -0.4985314],
    [-0.9692660, 1.8760108, 0.0415560],
    [0.0556434, -0.2040259, 1.0572252],
];

/// Converts a display colour, 0 … 1, to lightness 0 … 100, a and b.
pub fn to_lab(rgb: [f64; 3]) -> [f64; 3] {
    let linear = rgb
        .map(|part| if part > 0.04045 { ((part + 0.055) / 1.055).powf(2.4) } else { part / 12.92 });
    let xyz = times(TO_XYZ, linear);
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let share = xyz[axis] / WHITE[axis];
        if share > 0.008856 { share.cbrt() } else { 7.787 * share + 16.0 / 116.0 }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Converts back. Colours that a display does not have become its nearest ones, channel by channel.
pub fn of_lab([l, a, b]: [f64; 3]) -> [f64; 3] {
    let y = (l + 16.0) / 116.0;
    let parts = [y + a / 500.0, y, y - b / 200.0];
    let xyz = [0, 1, 2].map(|axis| {
        let part: f64 = parts[axis];
        let share =
            if part.powi(3) > 0.008856 { part.powi(3) } else { (part - 16.0 / 116.0) / 7.787 };
        share * WHITE[axis]
    });
    times(TO_RGB, xyz).map(|part| {
        let display =
            if part > 0.0031308 { 1.055 * part.powf(1.0 / 2.4) - 0.055 } else { 12.92 * part };
        display.clamp(0.0, 1.0)
    })
}

fn times(matrix: [[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}
