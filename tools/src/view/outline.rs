//! Outlines that are drawn on the picture to select what lies in them, and marks of what is
//! selected.

use super::{
    painter::Frame,
    screen::Screen,
    selection::{Selected, Tool},
};
use eframe::egui::{
    Color32, CursorIcon, Mesh, PointerButton, Pos2, Rect, Response, Shape, Stroke, Ui, Vec2,
    epaint::Vertex,
};
use glam::{DVec2, DVec3};
use splatkit::{interaction::Probe, math::View};

/// The colours of what is selected: what is seen, and what lies behind something.
const SEEN: Color32 = Color32::from_rgba_premultiplied(230, 110, 0, 235);
const HIDDEN: Color32 = Color32::from_rgba_premultiplied(70, 34, 0, 70);
/// The colour over selected triangles.
const TINT: Color32 = Color32::from_rgba_premultiplied(140, 67, 0, 150);
/// The colour of the outline.
const LINE: Color32 = Color32::from_rgb(255, 160, 40);

/// Half the side of a mark, in points of the screen.
const MARK: f32 = 1.2;
/// The shortest step of a lasso, in points of the screen.
const STEP: f32 = 2.0;
/// How far an outline may be from what the hand has drawn, in points of the screen.
const EXACT: f32 = 0.75;
/// The most corners of an outline.
const MOST_CORNERS: usize = 400;
/// How much deeper than the picture a mark may lie to be seen, as a share of its depth.
const BEHIND: f64 = 0.02;

/// Follows a hand that draws an outline. Returns its corners in points of the screen once the hand
/// lets go.
pub fn draw(ui: &Ui, response: &Response, tool: Tool, drawn: &mut Vec<Pos2>) -> Option<Vec<Pos2>> {
    if response.hovered() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    let is_drawing = response.dragged_by(PointerButton::Primary);
    if response.drag_started_by(PointerButton::Primary) {
        drawn.clear();
        // A drag begins once the hand has moved a little.
        drawn.extend(ui.input(|input| input.pointer.press_origin()));
    }
    if let (true, Some(at)) = (is_drawing, response.interact_pointer_pos()) {
        let at = response.rect.clamp(at);
        match tool {
            Tool::Box => {
                drawn.truncate(1);
                drawn.push(at);
            }
            Tool::Lasso if drawn.last().is_none_or(|last| last.distance(at) >= STEP) => {
                drawn.push(at);
            }
            Tool::Lasso => {}
        }
    }
    let corners = corners(tool, drawn);
    if corners.len() > 1 {
        let line = Stroke::new(1.5, LINE);
        ui.painter().add(Shape::closed_line(corners.clone(), line));
    }
    let ends = response.drag_stopped_by(PointerButton::Primary);
    if !ends {
        return None;
    }
    drawn.clear();
    let size = Rect::from_points(&corners).size();
    (corners.len() > 2 && size.min_elem() >= STEP).then(|| simplified(&corners))
}

/// Returns the corners of what the hand has drawn so far.
fn corners(tool: Tool, drawn: &[Pos2]) -> Vec<Pos2> {
    match (tool, drawn) {
        (Tool::Box, [first, last]) => {
            let Rect { min, max } = Rect::from_two_pos(*first, *last);
            vec![min, Pos2::new(max.x, min.y), max, Pos2::new(min.x, max.y)]
        }
        _ => drawn.to_vec(),
    }
}

/// Returns an outline with fewer corners, which lies close to the given one.
fn simplified(corners: &[Pos2]) -> Vec<Pos2> {
    let mut exact = EXACT;
    loop {
        let mut kept = vec![corners[0]];
        part(corners, exact, &mut kept);
        if kept.len() <= MOST_CORNERS {
            return kept;
        }
        exact *= 2.0;
    }
}

/// Adds the corners after the first that a part of an outline needs.
fn part(corners: &[Pos2], exact: f32, kept: &mut Vec<Pos2>) {
    let [first, .., last] = corners else { return };
    let along = *last - *first;
    let distance = |at: &Pos2| {
        let to = *at - *first;
        let share = to.dot(along) / along.length_sq().max(f32::MIN_POSITIVE);
        (to - share.clamp(0.0, 1.0) * along).length()
    };
    let inner = corners.iter().enumerate().take(corners.len() - 1).skip(1);
    let farthest = inner.map(|(at, corner)| (distance(corner), at));
    let farthest = farthest.max_by(|a, b| a.0.total_cmp(&b.0));
    match farthest {
        Some((far, at)) if far > exact => {
            part(&corners[..=at], exact, kept);
            part(&corners[at..], exact, kept);
        }
        _ => kept.push(*last),
    }
}

/// Marks what is selected over the picture.
pub fn mark(ui: &Ui, screen: &Screen, frame: Option<&Frame>, selected: &Selected) {
    let mut mesh = Mesh::default();
    for place in &selected.places {
        let Some(at) = screen.place(*place).filter(|at| screen.area.contains(*at)) else {
            continue;
        };
        let color = if is_hidden(screen, frame, *place) { HIDDEN } else { SEEN };
        mesh.add_colored_rect(Rect::from_center_size(at, Vec2::splat(2.0 * MARK)), color);
    }
    for triangle in &selected.triangles {
        let middle = triangle.iter().sum::<DVec3>() / 3.0;
        let [Some(a), Some(b), Some(c)] = triangle.map(|corner| screen.place(corner)) else {
            continue;
        };
        if !is_hidden(screen, frame, middle) {
            let first = mesh.vertices.len() as u32;
            let vertex = |pos| Vertex { pos, uv: eframe::egui::epaint::WHITE_UV, color: TINT };
            mesh.vertices.extend([a, b, c].map(vertex));
            mesh.add_triangle(first, first + 1, first + 2);
        }
    }
    ui.painter_at(screen.area).add(Shape::mesh(mesh));
}

/// Whether the picture shows something before a place.
fn is_hidden(screen: &Screen, frame: Option<&Frame>, place: DVec3) -> bool {
    let Some(frame) = frame else { return false };
    let Ok(view) = frame.camera.view(screen.view.size) else { return false };
    let at = view.to_view(place);
    let depth = if view.perspective { at.z } else { 1.0 };
    let pixel = at.truncate() * view.scale / depth + view.center;
    let shown = Probe::picked(&frame.picture, &view, pixel);
    shown.is_some_and(|shown| at.z > view.to_view(shown).z + BEHIND * at.z.abs())
}

/// Returns the least and the greatest depth in a view that a picture shows in an outline, by its
/// corners in pixels; `None` if it shows nothing there. The picture may be of a view before.
pub fn depths(frame: &Frame, now: &View, corners: &[DVec2]) -> Option<[f64; 2]> {
    /// Pixels along a side of the box around an outline that are tried.
    const TRIED: u32 = 96;
    let view = frame.camera.view(now.size).ok()?;
    let ends = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let [low, high] = corners.iter().fold(ends, |[low, high], at| [low.min(*at), high.max(*at)]);
    let mut depths: Option<[f64; 2]> = None;
    let step = (high - low) / f64::from(TRIED);
    for at in 0..TRIED * TRIED {
        let cell = DVec2::new(f64::from(at % TRIED), f64::from(at / TRIED));
        let pixel = low + (cell + 0.5) * step;
        if !is_inside(corners, pixel) {
            continue;
        }
        if let Some(shown) = Probe::picked(&frame.picture, &view, pixel) {
            let depth = now.to_view(shown).z;
            let [near, far] = depths.unwrap_or([depth; 2]);
            depths = Some([near.min(depth), far.max(depth)]);
        }
    }
    depths
}

/// Whether a pixel lies in an outline.
fn is_inside(corners: &[DVec2], at: DVec2) -> bool {
    let next = corners.iter().cycle().skip(1);
    let crosses = |(a, b): &(&DVec2, &DVec2)| {
        (a.y > at.y) != (b.y > at.y) && at.x < (b.x - a.x) * (at.y - a.y) / (b.y - a.y) + a.x
    };
    corners.iter().zip(next).filter(crosses).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of many points keeps its shape with few corners; a line in it has none.
    #[test]
    fn outlines_need_few_corners() {
        let ring = |at: usize| {
            let (sine, cosine) = (at as f32 / 2000.0 * std::f32::consts::TAU).sin_cos();
            Pos2::new(300.0 + 200.0 * cosine, 200.0 + 100.0 * sine)
        };
        let ring: Vec<Pos2> = (0..2000).map(ring).collect();
        let few = simplified(&ring);
        assert!((12..80).contains(&few.len()), "{}", few.len());
        let near = |at: &Pos2| {
            let ends = few.iter().zip(few.iter().cycle().skip(1));
            let distance = |(a, b): (&Pos2, &Pos2)| {
                let share = ((*at - *a).dot(*b - *a) / (*b - *a).length_sq()).clamp(0.0, 1.0);
                at.distance(*a + share * (*b - *a))
            };
            ends.map(distance).fold(f32::INFINITY, f32::min)
        };
        assert!(ring.iter().all(|at| near(at) <= EXACT + 0.01));
        let square = [[0.0, 0.0], [50.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]];
        assert_eq!(simplified(&square.map(Pos2::from)).len(), 4);
    }
}
