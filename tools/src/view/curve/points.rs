//! The points of a piecewise linear function, edited with the pointer.

use super::plot::Plot;
use eframe::egui::{
    Key, PointerButton, Pos2, Rect, Response, Role, Sense, Ui, Vec2, WidgetInfo, pos2, vec2,
};

/// What the pointer and the keyboard do to a list of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// A point is chosen.
    Select(usize),
    /// A point is dragged to a place in the plot.
    Move(usize, Pos2),
    /// A point is taken away.
    Remove(usize),
}

/// The side of the square around a point that the pointer can take.
const HANDLE: f32 = 14.0;

/// Senses the pointer at the handles of points, named `name` and their number, and returns the last
/// change. `grab` is kept between frames: where the pointer took the point, relative to it.
pub fn sense(ui: &Ui, name: &str, handles: &[Pos2], clip: Rect, grab: &mut Vec2) -> Option<Change> {
    let mut change = None;
    for (i, &at) in handles.iter().enumerate() {
        if !clip.expand(0.5 * HANDLE).contains(at) {
            continue;
        }
        let rect = Rect::from_center_size(at, Vec2::splat(HANDLE));
        let response = ui.interact(rect, ui.scope_id().with((name, i)), Sense::click_and_drag());
        response.widget_info(|| {
            WidgetInfo::labeled(Role::Button, ui.is_enabled(), format!("{name} {}", i + 1))
        });
        change = sense_one(ui, i, at, &response, grab).or(change);
    }
    change
}

fn sense_one(
    ui: &Ui,
    number: usize,
    at: Pos2,
    response: &Response,
    grab: &mut Vec2,
) -> Option<Change> {
    if response.drag_started_by(PointerButton::Primary) {
        let origin = ui.input(|input| input.pointer.press_origin());
        *grab = origin.map_or(Vec2::ZERO, |origin| origin - at);
        response.request_focus();
    }
    if response.clicked() {
        response.request_focus();
    }
    let deletes = || {
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        response.has_focus() && (pressed(Key::Delete) || pressed(Key::Backspace))
    };
    if response.secondary_clicked() || deletes() {
        return Some(Change::Remove(number));
    }
    if response.dragged_by(PointerButton::Primary) {
        let pointer = response.interact_pointer_pos()?;
        return Some(Change::Move(number, pointer - *grab));
    }
    (response.clicked() || response.gained_focus()).then_some(Change::Select(number))
}

/// Applies a change to points and to the chosen one. Points stay in order; `least` of them stay,
/// and no value falls below `floor`.
pub fn apply<T>(
    points: &mut Vec<(f64, T)>,
    change: Change,
    place: impl Fn(&mut (f64, T), Pos2) -> f64,
    [least, floor]: [f64; 2],
) -> Option<usize> {
    match change {
        Change::Select(i) => Some(i),
        Change::Move(i, pointer) => {
            let value = place(points.get_mut(i)?, pointer);
            move_to(points, i, value, floor);
            Some(i)
        }
        Change::Remove(i) => {
            if points.len() as f64 > least && i < points.len() {
                points.remove(i);
                return None;
            }
            Some(i)
        }
    }
}

/// Moves a point to a value, but not past its neighbours. Two points at one value make a step.
pub fn move_to<T>(points: &mut [(f64, T)], i: usize, value: f64, floor: f64) {
    let [low, high] = limits(points, i, floor);
    if value.is_finite() && low <= high {
        points[i].0 = value.clamp(low, high);
    }
}

/// Returns the values between which a point may be moved.
pub fn limits<T>(points: &[(f64, T)], i: usize, floor: f64) -> [f64; 2] {
    let low = i.checked_sub(1).map_or(floor, |before| points[before].0);
    let high = points.get(i + 1).map_or(f64::MAX, |after| after.0);
    [low, high]
}

/// Adds a point where its value belongs and returns its number.
pub fn insert<T>(points: &mut Vec<(f64, T)>, point: (f64, T)) -> Option<usize> {
    if !point.0.is_finite() {
        return None;
    }
    let at = points.partition_point(|other| other.0 <= point.0);
    points.insert(at, point);
    Some(at)
}

/// Draws a polyline through a function of the plot's numbers, and its points.
pub fn draw(
    ui: &Ui,
    plot: &Plot,
    points: &[(f64, f64)],
    function: impl Fn(f64) -> f64,
    selected: Option<usize>,
) {
    let painter = ui.painter_at(plot.rect.expand(0.5 * HANDLE));
    let color = ui.visuals().strong_text_color();
    // Roots of linear functions are curves. At points the function has corners or steps.
    let in_plot = |value: f64| plot.range[0] <= value && value <= plot.range[1];
    let mut line: Vec<Pos2> = plot
        .columns()
        .flatten()
        .map(|x| pos2(x, plot.y(function(plot.value(x)))))
        .chain(points.iter().filter(|point| in_plot(point.0)).map(|&point| plot.at(point)))
        .collect();
    // The sort keeps the order of points at one value.
    line.sort_by(|a, b| a.x.total_cmp(&b.x));
    painter.line(line, (1.5, color));
    for (i, &point) in points.iter().enumerate() {
        let at = plot.at(point);
        let radius = if selected == Some(i) { 5.5 } else { 4.0 };
        let fill = match selected == Some(i) {
            true => ui.visuals().selection.bg_fill,
            false => ui.visuals().window_fill(),
        };
        painter.circle(at, radius, fill, (1.5, color));
    }
}

/// Draws colour stops as triangles below a bar.
pub fn draw_stops(
    ui: &Ui,
    bar: Rect,
    stops: &[(Pos2, eframe::egui::Color32)],
    chosen: Option<usize>,
) {
    let painter = ui.painter_at(bar.expand(HANDLE));
    for (i, &(at, color)) in stops.iter().enumerate() {
        if !bar.expand(HANDLE).contains(at) {
            continue;
        }
        let stroke = match chosen == Some(i) {
            true => (2.0, ui.visuals().selection.stroke.color),
            false => (1.0, ui.visuals().strong_text_color()),
        };
        let corners = vec![at + vec2(0.0, -7.0), at + vec2(5.0, 5.0), at + vec2(-5.0, 5.0)];
        painter.add(eframe::egui::Shape::convex_polygon(corners, color, stroke));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stay_in_order() {
        let mut points = vec![(0.0, 0.0), (10.0, 1.0), (20.0, 0.0)];
        move_to(&mut points, 1, 50.0, f64::MIN);
        assert_eq!(points[1].0, 20.0);
        move_to(&mut points, 1, -50.0, f64::MIN);
        assert_eq!(points[1].0, 0.0);
        move_to(&mut points, 0, -50.0, -5.0);
        assert_eq!(points[0].0, -5.0);
        move_to(&mut points, 0, f64::NAN, -5.0);
        assert_eq!(points[0].0, -5.0);
        assert_eq!(insert(&mut points, (5.0, 0.5)), Some(2));
        assert_eq!(insert(&mut points, (f64::INFINITY, 0.5)), None);
        assert!(points.is_sorted_by(|a, b| a.0 <= b.0) && points.len() == 4);
    }

    #[test]
    fn the_last_points_stay() {
        let mut points = vec![(0.0, 0.0), (10.0, 1.0)];
        let place = |_: &mut (f64, f64), _: Pos2| 0.0;
        assert_eq!(apply(&mut points, Change::Remove(1), place, [1.0, 0.0]), None);
        assert_eq!(apply(&mut points, Change::Remove(0), place, [1.0, 0.0]), Some(0));
        assert_eq!(points, [(0.0, 0.0)]);
        assert_eq!(apply(&mut points, Change::Remove(0), place, [0.0, 0.0]), None);
        assert!(points.is_empty());
    }
}
