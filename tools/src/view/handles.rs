//! Clips in the picture: their outlines, and handles that move them.

use super::screen::Screen;
use eframe::egui::{
    Color32, CursorIcon, Pos2, Rect, Response, Role, Sense, Stroke, Ui, Vec2, WidgetInfo,
};
use glam::DVec3;
use splatkit::{math::Bounds, session::ClipEntry};

const INK: Color32 = Color32::from_rgb(255, 210, 60);
/// The size of a handle in points.
const SIZE: f32 = 14.0;

/// What a handle moves.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Part {
    /// The offset of a plane.
    Offset,
    /// The lower (0) or the upper (1) end of a box along an axis.
    End(usize, usize),
}

/// A point that the hand can move along an axis.
struct Handle {
    clip: usize,
    part: Part,
    at: DVec3,
    /// Of unit length.
    axis: DVec3,
}

/// Draws the clips over the picture, and moves them as a hand drags their handles.
pub fn show(ui: &Ui, screen: &Screen, bounds: &Bounds, clips: &mut [ClipEntry]) {
    for clip in clips.iter() {
        outline(ui, screen, bounds, clip);
    }
    for handle in handles(clips, bounds) {
        let Some(place) = screen.place(handle.at) else { continue };
        let response = grip(ui, screen, &handle, place);
        if response.dragged() {
            // A step of this length is long enough to be seen and short enough to be straight.
            let length = 1e-3 * bounds.diagonal();
            let Some(ahead) = screen.place(handle.at + length * handle.axis) else { continue };
            let direction = (ahead - place) / length as f32;
            let steepness = direction.length_sq();
            // An axis that points at the eye cannot be dragged along.
            if steepness * (bounds.diagonal() as f32).powi(2) > 1.0 {
                let step = response.drag_delta().dot(direction) / steepness;
                change(&mut clips[handle.clip], handle.part, f64::from(step), bounds);
            }
        }
    }
}

/// Shows a handle that can be dragged.
fn grip(ui: &Ui, screen: &Screen, handle: &Handle, place: Pos2) -> Response {
    let rect = Rect::from_center_size(place, Vec2::splat(SIZE)).intersect(screen.area);
    let id = ui.scope_id().with(("clip", handle.clip, format!("{:?}", handle.part)));
    let response = ui.interact(rect, id, Sense::drag());
    let name = match handle.part {
        Part::Offset => format!("Handle of clip {}", handle.clip + 1),
        Part::End(axis, end) => format!(
            "Handle of clip {}, {} {}",
            handle.clip + 1,
            ["x", "y", "z"][axis],
            ["from", "to"][end]
        ),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
    let is_held = response.hovered() || response.dragged();
    if is_held {
        ui.ctx().set_cursor_icon(CursorIcon::Grab);
    }
    let painter = ui.painter_at(screen.area);
    let radius = if is_held { 6.0 } else { 4.5 };
    painter.circle(place, radius, INK, Stroke::new(1.0, Color32::BLACK));
    response.on_hover_text("Drag to move the clip")
}

/// Returns the handles of all clips.
fn handles(clips: &[ClipEntry], bounds: &Bounds) -> Vec<Handle> {
    let mut handles = Vec::new();
    for (number, clip) in clips.iter().enumerate() {
        if let Some(plane) = clip.plane {
            let (normal, middle) = (normal_of(plane), bounds.center());
            let at = middle + normal * ((plane[3] - normal.dot(middle)) / normal.length_squared());
            let axis = normal.normalize_or_zero();
            handles.push(Handle { clip: number, part: Part::Offset, at, axis });
        }
        if let Some(corners) = clip.corners() {
            let ends = corners.map(DVec3::from_array);
            let middle = 0.5 * (ends[0] + ends[1]);
            for axis in 0..3 {
                for (end, place) in ends.iter().enumerate() {
                    let mut at = middle;
                    at[axis] = place[axis];
                    let part = Part::End(axis, end);
                    handles.push(Handle { clip: number, part, at, axis: DVec3::AXES[axis] });
                }
            }
        }
    }
    handles
}

/// Moves a part of a clip by a length in world units, within the scene.
fn change(clip: &mut ClipEntry, part: Part, step: f64, bounds: &Bounds) {
    let corners = clip.corners();
    match (part, &mut clip.plane, corners) {
        (Part::Offset, Some(plane), _) => {
            let normal = normal_of(*plane);
            let [low, high] = offsets(bounds, normal);
            plane[3] = (plane[3] + step * normal.length()).clamp(low, high);
        }
        (Part::End(axis, end), _, Some(mut corners)) => {
            // A box keeps an inside.
            let least = 1e-3 * (bounds.max[axis] - bounds.min[axis]);
            let other = corners[1 - end][axis];
            let moved = corners[end][axis] + step;
            corners[end][axis] = match end {
                0 => moved.min(other - least),
                _ => moved.max(other + least),
            };
            *clip = ClipEntry { inside: clip.inside, ..ClipEntry::of_box(corners) };
        }
        _ => {}
    }
}

/// Returns the offsets of the first and the last plane with a normal that meet a box.
pub fn offsets(bounds: &Bounds, normal: DVec3) -> [f64; 2] {
    let ends = bounds.corners().map(|corner| corner.dot(normal));
    ends.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)])
}

fn normal_of([x, y, z, _]: [f64; 4]) -> DVec3 {
    DVec3::new(x, y, z)
}

/// The edges of a box, as pairs of corners whose bits say which end they have along x, y and z.
const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

fn corner([low, high]: [DVec3; 2], number: usize) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(
        |axis| {
            if number >> axis & 1 == 0 { low[axis] } else { high[axis] }
        },
    ))
}

/// Draws where a clip cuts.
fn outline(ui: &Ui, screen: &Screen, bounds: &Bounds, clip: &ClipEntry) {
    let painter = ui.painter_at(screen.area);
    let line = |a: DVec3, b: DVec3| {
        if let (Some(a), Some(b)) = (screen.place(a), screen.place(b)) {
            painter.line_segment([a, b], Stroke::new(1.0, INK));
        }
    };
    if let Some(corners) = clip.corners() {
        let ends = corners.map(DVec3::from_array);
        EDGES.iter().for_each(|[a, b]| line(corner(ends, *a), corner(ends, *b)));
    }
    if let Some(plane) = clip.plane {
        let corners = section(plane, bounds);
        for (number, point) in corners.iter().enumerate() {
            line(*point, corners[(number + 1) % corners.len()]);
        }
    }
}

/// Returns the corners of the polygon in which a plane meets a box, in order.
fn section(plane: [f64; 4], bounds: &Bounds) -> Vec<DVec3> {
    let normal = normal_of(plane);
    let ends = [bounds.min, bounds.max];
    let height = |point: DVec3| normal.dot(point) - plane[3];
    let crossing = |[a, b]: &[usize; 2]| {
        let (a, b) = (corner(ends, *a), corner(ends, *b));
        let (from, to) = (height(a), height(b));
        ((from < 0.0) != (to < 0.0)).then(|| a.lerp(b, from / (from - to)))
    };
    let mut corners: Vec<DVec3> = EDGES.iter().filter_map(crossing).collect();
    let Some(axis) = normal.try_normalize() else { return Vec::new() };
    let middle = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
    let right = axis.any_orthonormal_vector();
    let up = axis.cross(right);
    let angle = |point: &DVec3| (*point - middle).dot(up).atan2((*point - middle).dot(right));
    corners.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds = Bounds { min: DVec3::ZERO, max: DVec3::new(2.0, 4.0, 6.0) };

    fn plane(plane: [f64; 4]) -> ClipEntry {
        ClipEntry::of_plane(plane)
    }

    #[test]
    fn a_plane_meets_the_box_in_a_polygon_around_its_middle() {
        let square = section([0.0, 0.0, 3.0, 9.0], &BOX);
        assert_eq!(square.len(), 4);
        assert!(square.iter().all(|point| (point.z - 3.0).abs() < 1e-12));
        // Neighbours in the list share a side.
        let next = |at: usize| square[(at + 1) % 4] - square[at];
        assert!(
            (0..4).all(|at| next(at).to_array().iter().filter(|d| d.abs() > 1e-9).count() == 1)
        );
        assert_eq!(section([1.0, 1.0, 1.0, 1.0], &BOX).len(), 3);
        assert!(section([1.0, 0.0, 0.0, 9.0], &BOX).is_empty());
    }

    #[test]
    fn handles_move_what_they_are_on() {
        let mut clip = plane([0.0, 0.0, 3.0, 9.0]);
        let handle = &handles(&[clip], &BOX)[0];
        assert_eq!((handle.at, handle.axis), (DVec3::new(1.0, 2.0, 3.0), DVec3::Z));
        change(&mut clip, Part::Offset, 1.0, &BOX);
        assert_eq!(clip.plane, Some([0.0, 0.0, 3.0, 12.0]));
        change(&mut clip, Part::Offset, 100.0, &BOX);
        assert_eq!(clip.plane, Some([0.0, 0.0, 3.0, 18.0]));
        let mut clip = ClipEntry::of_box([[0.0; 3], [2.0, 4.0, 6.0]]);
        assert_eq!(handles(&[clip], &BOX).len(), 6);
        change(&mut clip, Part::End(1, 1), -1.0, &BOX);
        change(&mut clip, Part::End(0, 0), 9.0, &BOX);
        let [low, high] = clip.corners().unwrap();
        assert_eq!(high, [2.0, 3.0, 6.0]);
        assert!(low[0] < high[0] && low[0] > 1.9);
    }
}
