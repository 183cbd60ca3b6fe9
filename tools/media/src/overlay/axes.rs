//! The marker that shows how the axes lie in the picture.

use super::canvas::{Align, Area, Canvas};
use glam::{DMat3, DVec2, DVec3};

/// The names at the ends of the axes, on the positive and the negative side.
pub type Names = [[&'static str; 2]; 3];

pub const PLAIN: Names = [["X", ""], ["Y", ""], ["Z", ""]];
/// The frame of a patient: towards the right, the front and the head.
pub const RAS: Names = [["R", "L"], ["A", "P"], ["S", "I"]];

/// Red, green and blue that show on light and on dark.
const COLORS: [[f32; 3]; 3] = [[0.95, 0.33, 0.28], [0.36, 0.76, 0.32], [0.36, 0.58, 1.0]];

/// An arm of the marker.
struct Arm {
    tip: DVec3,
    name: &'static str,
    color: [f32; 3],
    is_positive: bool,
}

/// Draws the axes into a square area. `rotation` turns world directions to the view, where x is
/// right, y down and z away.
pub fn draw(canvas: &mut Canvas, area: Area, rotation: DMat3, names: Names) {
    let center = DVec2::new(0.5 * (area.left + area.right), 0.5 * (area.top + area.bottom));
    let length = 0.5 * area.width() - 0.8 * canvas.size;
    let mut arms = Vec::new();
    for (axis, direction) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        for (name, sign) in names[axis].into_iter().zip([1.0, -1.0]) {
            let is_positive = sign > 0.0;
            let tip = rotation * (sign * direction);
            if is_positive || !name.is_empty() {
                arms.push(Arm { tip, name, color: COLORS[axis], is_positive });
            }
        }
    }
    // The farthest first, so that nearer ones cover them.
    arms.sort_by(|a, b| b.tip.z.total_cmp(&a.tip.z));
    let width = 1.6 * canvas.line_width();
    for Arm { tip, name, color, is_positive } in arms {
        let way = DVec2::new(tip.x, tip.y);
        let reach = way * length * if is_positive { 1.0 } else { 0.72 };
        // An arm towards the eye has no direction in the picture; its letter would hide the others.
        let is_short = way.length() < 0.2;
        if is_positive {
            canvas.lines(&[[center, center + reach]], width, color);
        }
        if !is_short {
            let beyond = way.normalize() * 0.55 * canvas.size;
            canvas.colored_text(name, center + reach + beyond, Align::Middle, color);
        }
    }
}
