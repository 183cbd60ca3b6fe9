//! The picture, and what a hand does in it.

use super::{
    action::{Action, Motion, Select},
    canvas::Canvas,
    handles, outline,
    painter::Frame,
    scene_view::SceneView,
    screen::Screen,
    selection::{Selected, Tool},
};
use eframe::egui::{
    self, Align2, Color32, CursorIcon, FontId, PointerButton, Pos2, Rect, Response, Role, Sense,
    Ui, Vec2, WidgetInfo,
};
use glam::{DVec2, DVec3};
use splatkit::{interaction::Probe, session::ClipEntry};

/// The largest picture that is drawn for a window, in pixels along a side.
const MOST_SIDE: u32 = 8192;
/// The colour of what is measured.
const INK: Color32 = Color32::from_rgb(255, 210, 60);

/// What the picture shows.
pub struct Picture<'a> {
    pub canvas: &'a Canvas,
    pub scene_view: Option<&'a SceneView>,
    pub frame: Option<&'a Frame>,
    /// Whether clicks measure, and the points that were picked, in world units.
    pub measures: bool,
    pub measured: &'a [DVec3],
    /// What outlines are drawn with, instead of turning the scene.
    pub tool: Option<Tool>,
    pub selected: Option<&'a Selected>,
    pub clips: &'a [ClipEntry],
    /// Whether clips have handles.
    pub has_handles: bool,
    pub is_loading: bool,
}

/// What is kept of a hand between frames.
#[derive(Default)]
pub struct Hand {
    /// The depth of the point where a drag began.
    grabbed: Option<f64>,
    /// The outline that is being drawn, in points of the screen.
    outline: Vec<Pos2>,
    /// The world point under the cursor.
    pub under_cursor: Option<DVec3>,
}

/// Shows the picture. Returns its size in pixels, and what the hand asks for.
pub fn show(ui: &mut Ui, picture: &Picture, hand: &mut Hand) -> ([u32; 2], Vec<Action>) {
    let (area, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
    let scale = ui.ctx().pixels_per_point();
    let size = [area.width(), area.height()]
        .map(|side| ((side * scale).round() as u32).clamp(1, MOST_SIDE));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "The picture"));
    picture.canvas.paint(ui, area);
    let mut actions = Vec::new();
    if let Some(scene_view) = picture.scene_view {
        let touch = Touch { ui, picture, response: &response, area, scale, size };
        touch.drag(hand, &mut actions);
        if let Some(at) = response.hover_pos() {
            touch.point(hand, touch.pixel(at), &mut actions);
        }
        if let Ok(view) = scene_view.orbit.camera().view(size) {
            let screen = Screen { view, area, scale };
            measured(ui, &screen, picture.measured, &scene_view.stage.loaded.captions.length);
            clips(ui, &screen, picture, scene_view, &mut actions);
            if let Some(selected) = picture.selected {
                outline::mark(ui, &screen, picture.frame, selected);
            }
            if let Some(tool) = picture.tool
                && let Some(corners) = outline::draw(ui, &response, tool, &mut hand.outline)
            {
                let corners = corners.into_iter().map(|corner| touch.pixel(corner)).collect();
                actions.push(Action::Select(Select::Outline(corners)));
            }
        }
    } else if !picture.is_loading {
        let hint = "Drop a scan, a volume or a scene here, or open one (Ctrl+O)";
        let color = ui.visuals().weak_text_color();
        let font = FontId::proportional(16.0);
        ui.painter().text(area.center(), Align2::CENTER_CENTER, hint, font, color);
    }
    (size, actions)
}

/// A hand in the picture, in one frame.
struct Touch<'a> {
    ui: &'a Ui,
    picture: &'a Picture<'a>,
    response: &'a Response,
    area: Rect,
    /// Pixels in a point of the screen.
    scale: f32,
    size: [u32; 2],
}

impl Touch<'_> {
    fn pixel(&self, at: Pos2) -> DVec2 {
        let at = (at - self.area.min) * self.scale;
        DVec2::new(f64::from(at.x), f64::from(at.y))
    }

    /// Moves the camera or the transfer function as the hand drags.
    fn drag(&self, hand: &mut Hand, actions: &mut Vec<Action>) {
        let response = self.response;
        let drag = response.drag_delta() * self.scale;
        let moved = DVec2::new(f64::from(drag.x), f64::from(drag.y));
        let modifiers = self.ui.input(|input| input.modifiers);
        let by = |button| response.dragged_by(button);
        if response.drag_started() {
            let start = response.interact_pointer_pos().map(|at| self.pixel(at));
            hand.grabbed = start.and_then(|at| self.depth_at(at));
        }
        let pans = by(PointerButton::Middle)
            || by(PointerButton::Secondary)
            || (by(PointerButton::Primary) && modifiers.shift);
        if moved == DVec2::ZERO {
        } else if pans {
            actions.push(Action::Move(Motion::Pan(moved, hand.grabbed)));
        } else if by(PointerButton::Primary) && modifiers.command {
            actions.push(Action::Level(Vec2::new(drag.x, drag.y)));
        } else if by(PointerButton::Primary) && modifiers.alt {
            actions.push(Action::Move(Motion::LookAround(moved)));
        } else if by(PointerButton::Primary) && self.picture.tool.is_none() {
            actions.push(Action::Move(Motion::Turn(moved)));
        }
    }

    /// Answers the wheel and clicks at a pixel.
    fn point(&self, hand: &mut Hand, cursor: DVec2, actions: &mut Vec<Action>) {
        let scroll = self.ui.input(|input| f64::from(input.smooth_scroll_delta().y));
        let pinch = self.ui.input(|input| f64::from(input.zoom_delta()));
        let factor = (scroll / 400.0).exp() * if scroll == 0.0 { pinch } else { 1.0 };
        if factor != 1.0 {
            let depth = self.depth_at(cursor);
            actions.push(Action::Move(Motion::Zoom(factor, cursor, depth)));
        }
        hand.under_cursor = self.point_under(cursor);
        let measures = self.picture.measures;
        if let Some(point) = hand.under_cursor {
            if self.response.double_clicked() {
                actions.push(Action::Center(point));
            } else if self.response.clicked() && measures {
                actions.push(Action::Pick(point));
            }
        }
        if measures {
            self.ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
    }

    /// Returns the view-space depth of the picture at a pixel of the window.
    fn depth_at(&self, cursor: DVec2) -> Option<f64> {
        let view = self.picture.frame?.camera.view(self.size).ok()?;
        Some(view.to_view(self.point_under(cursor)?).z)
    }

    /// Returns the world point under the cursor.
    fn point_under(&self, cursor: DVec2) -> Option<DVec3> {
        let frame = self.picture.frame?;
        let view = frame.camera.view(self.size).ok()?;
        Probe::picked(&frame.picture, &view, cursor)
    }
}

/// Draws the clips over the picture, with the handles that move them.
fn clips(
    ui: &Ui,
    screen: &Screen,
    picture: &Picture,
    scene_view: &SceneView,
    actions: &mut Vec<Action>,
) {
    if !picture.has_handles || picture.clips.is_empty() {
        return;
    }
    let mut clips = picture.clips.to_vec();
    let bounds = scene_view.stage.loaded.subject.bounds;
    handles::show(ui, screen, &bounds, &mut clips);
    if clips != picture.clips {
        actions.push(Action::drag(|scene| scene.picture.clips = clips));
    }
}

/// Draws the points that were picked, and the distance between them.
fn measured(ui: &Ui, screen: &Screen, picked: &[DVec3], unit: &str) {
    let points: Vec<Pos2> = picked.iter().filter_map(|point| screen.place(*point)).collect();
    for point in &points {
        ui.painter().circle_stroke(*point, 4.0, egui::Stroke::new(1.5, INK));
    }
    if let ([a, b], [first, second]) = (&points[..], picked) {
        ui.painter().line_segment([*a, *b], egui::Stroke::new(1.5, INK));
        let text = format!("{:.4} {unit}", (*second - *first).length());
        let at = a.lerp(*b, 0.5);
        let font = FontId::proportional(14.0);
        let back = ui.painter().text(at, Align2::CENTER_BOTTOM, &text, font.clone(), INK);
        ui.painter().rect_filled(back.expand(3.0), 3.0, Color32::from_black_alpha(170));
        ui.painter().text(at, Align2::CENTER_BOTTOM, text, font, INK);
    }
}
