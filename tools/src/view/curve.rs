//! The transfer function, edited on the histogram of the values.
//!
//! A change is shown at once. A function that could not be drawn is refused: the last change is
//! taken back.

mod backdrop;
mod level;
mod light;
mod number;
mod plot;
mod points;
mod presets;
mod surfaces;
mod swatch;
#[cfg(test)]
mod tests;

pub use level::window_level;
pub use number::{field, plain};
pub use swatch::swatch;

use backdrop::JointPicture;
use eframe::egui::{
    Align2, Color32, FontId, Mesh, PointerButton, Rect, Response, Role, Sense, Ui, Vec2,
    WidgetInfo, pos2, vec2,
};
use number::number;
use plot::{Plot, Scale, Zoom};
use points::Change;
use splatkit::{
    interaction::Histogram,
    volume::{Shade, TransferFunction},
};

/// What a frame did to the function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edit {
    /// The function is as it was.
    Unchanged,
    /// The function changes while a button of the pointer is held. [`Committed`](Self::Committed)
    /// follows once the button is released.
    Dragging,
    /// A change is complete.
    Committed,
}

/// The widget's state between frames.
pub struct CurveEditor {
    /// Whether counts are shown by their logarithm.
    log: bool,
    /// Whether the factors by gradient are shown instead of the opacities by value.
    shows_factors: bool,
    values: Zoom,
    magnitudes: Zoom,
    selected: Option<Selected>,
    /// Where the pointer took a point, relative to it.
    grab: Vec2,
    is_dragging: bool,
    joint: JointPicture,
    /// The light that comes back when it is switched on.
    shade: Shade,
    /// The diagonal of the data's box, in world units.
    diagonal: f64,
    /// Whether the values are Hounsfield units, as the presets for CT expect.
    is_hounsfield: bool,
    /// What is to be said about the last change.
    note: Option<String>,
}

/// A point, by its number in its list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Selected {
    Opacity(usize),
    Color(usize),
    Factor(usize),
}

/// Heights in points of the plot, the colour bar and the row of its stops.
const PLOT: f32 = 160.0;
const BAR: f32 = 16.0;
const STOPS: f32 = 16.0;
/// Room around a plot for the points at its border.
const MARGIN: Vec2 = vec2(8.0, 6.0);
/// One opacity or colour stays; the list of factors may be empty. Values have no floor, magnitudes
/// begin at 0.
const OF_VALUES: [f64; 2] = [1.0, f64::MIN];
const OF_MAGNITUDES: [f64; 2] = [0.0, 0.0];

impl CurveEditor {
    /// Returns an editor that shows all values and the opacity. `diagonal` is that of the data's
    /// box, in world units: the opacity unit of presets follows it.
    pub fn new(diagonal: f64) -> Self {
        Self {
            log: true,
            shows_factors: false,
            values: Zoom::default(),
            magnitudes: Zoom::default(),
            selected: None,
            grab: Vec2::ZERO,
            is_dragging: false,
            joint: JointPicture::default(),
            shade: Shade::default(),
            diagonal,
            is_hounsfield: false,
            note: None,
        }
    }

    /// Sets whether the values are Hounsfield units.
    pub fn set_hounsfield(&mut self, is_hounsfield: bool) {
        self.is_hounsfield = is_hounsfield;
    }

    /// Takes what is to be said about the last change.
    pub fn take_note(&mut self) -> Option<String> {
        self.note.take()
    }

    /// Shows the editor of a function over the values of the data, and says what was changed.
    ///
    /// A valid function stays valid: a change that [`TransferFunction::validate`] refuses is taken
    /// back. An invalid one may be changed in any way.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        histogram: Option<&Histogram>,
        transfer: &mut TransferFunction,
        values: [f64; 2],
    ) -> Edit {
        let before = transfer.clone();
        ui.push_id("transfer function", |ui| {
            self.toolbar(ui, transfer, values);
            if self.shows_factors {
                self.factors(ui, histogram, transfer);
            } else {
                self.opacities(ui, histogram, transfer, values);
                self.colors(ui, transfer, values);
            }
            ui.horizontal_wrapped(|ui| self.numbers(ui, transfer, values));
            ui.separator();
            surfaces::list(ui, transfer, self.values.range(values));
            ui.separator();
            light::show(ui, transfer, &mut self.shade);
        });
        self.judged(ui, &before, transfer)
    }

    /// Takes an invalid change back, and says what became of the function.
    fn judged(
        &mut self,
        ui: &Ui,
        before: &TransferFunction,
        transfer: &mut TransferFunction,
    ) -> Edit {
        if transfer != before && before.validate().is_ok() && transfer.validate().is_err() {
            transfer.clone_from(before);
        }
        let is_changed = transfer != before;
        let is_held = ui.input(|input| input.pointer.any_down());
        let edit = match (is_changed, is_held, self.is_dragging) {
            (true, true, _) => Edit::Dragging,
            (true, false, _) | (false, false, true) => Edit::Committed,
            _ => return Edit::Unchanged,
        };
        self.is_dragging = edit == Edit::Dragging;
        edit
    }

    fn toolbar(&mut self, ui: &mut Ui, transfer: &mut TransferFunction, values: [f64; 2]) {
        ui.horizontal_wrapped(|ui| {
            ui.selectable_value(&mut self.shows_factors, false, "Opacity curve");
            ui.selectable_value(&mut self.shows_factors, true, "Gradient curve")
                .on_hover_text("Factors on the opacity, by the magnitude of the gradient");
            ui.checkbox(&mut self.log, "Logarithmic counts");
            if ui.button("Whole range").clicked() {
                self.values.reset();
                self.magnitudes.reset();
            }
            let Self { diagonal, is_hounsfield, .. } = *self;
            let data = presets::Data { values, diagonal, is_hounsfield };
            let note = presets::menu(ui, transfer, &data, &mut self.values);
            self.note = note.or(self.note.take());
        });
    }

    fn opacities(
        &mut self,
        ui: &mut Ui,
        histogram: Option<&Histogram>,
        transfer: &mut TransferFunction,
        values: [f64; 2],
    ) {
        let (mut plot, area) = canvas(ui, "Opacity plot", PLOT);
        plot.range = self.values.range(values);
        navigate(ui, &area, &plot, &mut self.values, values);
        if let Some(histogram) = histogram {
            backdrop::bars(ui, &plot, histogram, self.log);
        }
        grid(ui, &plot);
        let chosen = |selected| match selected {
            Some(Selected::Opacity(i)) => Some(i),
            _ => None,
        };
        let function = |value| transfer.opacity(value);
        points::draw(ui, &plot, &transfer.opacity, function, chosen(self.selected));
        if let Some(change) = edited(ui, "Opacity point", &plot, &area, &transfer.opacity, self) {
            let selected = change_points(&mut transfer.opacity, change, &plot, OF_VALUES);
            self.selected = selected.map(Selected::Opacity);
        }
        surfaces::lines(ui, &plot, &mut transfer.isosurfaces, &mut self.grab);
        readout(ui, &area, &plot, |value| transfer.opacity(value));
    }

    fn factors(
        &mut self,
        ui: &mut Ui,
        histogram: Option<&Histogram>,
        transfer: &mut TransferFunction,
    ) {
        let joint = histogram.and_then(|histogram| histogram.joint.as_ref());
        let last = transfer.gradient.last().map_or(0.0, |point| point.0);
        let most = joint.map_or(0.0, |joint| joint.magnitude).max(last);
        let whole = [0.0, if most > 0.0 { most } else { 1.0 }];
        let (mut plot, area) = canvas(ui, "Gradient plot", PLOT);
        plot.scale = Scale::Linear;
        plot.range = self.magnitudes.range(whole);
        navigate(ui, &area, &plot, &mut self.magnitudes, whole);
        if let Some(joint) = joint {
            self.joint.show(ui, &plot, joint, self.log);
        }
        let chosen = match self.selected {
            Some(Selected::Factor(i)) => Some(i),
            _ => None,
        };
        let function = |magnitude| transfer.gradient_factor(magnitude);
        points::draw(ui, &plot, &transfer.gradient, function, chosen);
        if let Some(change) = edited(ui, "Factor point", &plot, &area, &transfer.gradient, self) {
            let selected = change_points(&mut transfer.gradient, change, &plot, OF_MAGNITUDES);
            self.selected = selected.map(Selected::Factor);
        }
        readout(ui, &area, &plot, |magnitude| transfer.gradient_factor(magnitude));
    }

    /// The colour bar and its stops.
    fn colors(&mut self, ui: &mut Ui, transfer: &mut TransferFunction, values: [f64; 2]) {
        let (mut plot, area) = canvas(ui, "Colour bar", BAR + STOPS);
        plot.range = self.values.range(values);
        let bar = Rect::from_min_max(plot.rect.min, pos2(plot.rect.right(), area.rect.top() + BAR));
        let mut mesh = Mesh::default();
        for [left, right] in plot.columns() {
            let color = byte_color(transfer.color(plot.value(0.5 * (left + right))));
            let column = Rect::from_min_max(pos2(left, bar.top()), pos2(right, bar.bottom()));
            mesh.add_colored_rect(column, color);
        }
        ui.painter_at(bar).add(mesh);
        let row = bar.bottom() + 7.0;
        let stop = |point: &(f64, [f64; 3])| (pos2(plot.x(point.0), row), byte_color(point.1));
        let stops: Vec<_> = transfer.color.iter().map(stop).collect();
        let chosen = match self.selected {
            Some(Selected::Color(i)) => Some(i),
            _ => None,
        };
        points::draw_stops(ui, bar, &stops, chosen);
        let handles: Vec<_> = stops.iter().map(|stop| stop.0).collect();
        let change = points::sense(ui, "Colour stop", &handles, area.rect, &mut self.grab);
        let selected = match (change, doubled(&area)) {
            (Some(change), _) => {
                let place = |_: &mut (f64, [f64; 3]), at: eframe::egui::Pos2| plot.value(at.x);
                points::apply(&mut transfer.color, change, place, OF_VALUES)
            }
            (None, Some(at)) => {
                let value = plot.value(at.x);
                let color = transfer.color(value);
                points::insert(&mut transfer.color, (value, color))
            }
            (None, None) => return,
        };
        self.selected = selected.map(Selected::Color);
    }

    /// The numbers of the chosen point.
    fn numbers(&mut self, ui: &mut Ui, transfer: &mut TransferFunction, values: [f64; 2]) {
        let [low, high] = self.values.range(values);
        let speed = (high - low) / 500.0;
        let removed = match self.selected {
            Some(Selected::Opacity(i)) if i < transfer.opacity.len() => {
                numbers_of(ui, &mut transfer.opacity, i, ["Value", "Opacity"], OF_VALUES, speed)
            }
            Some(Selected::Factor(i)) if i < transfer.gradient.len() => {
                let names = ["Magnitude", "Factor"];
                let speed = transfer.gradient[i].0.max(speed) / 100.0;
                numbers_of(ui, &mut transfer.gradient, i, names, OF_MAGNITUDES, speed)
            }
            Some(Selected::Color(i)) if i < transfer.color.len() => {
                let [least, most] = points::limits(&transfer.color, i, f64::MIN);
                let point = &mut transfer.color[i];
                number(ui, "Value", &mut point.0, least..=most, speed);
                number::color(ui, "Colour", &mut point.1);
                let removes = ui.button("Remove point").clicked() && transfer.color.len() > 1;
                if removes {
                    transfer.color.remove(i);
                }
                removes
            }
            _ => {
                ui.weak("Double-click adds, right-click removes a point.");
                false
            }
        };
        if removed {
            self.selected = None;
        }
    }
}

/// Makes room for a plot.
fn canvas(ui: &mut Ui, name: &str, height: f32) -> (Plot, Response) {
    let size = vec2(ui.available_width().max(100.0), height);
    let (rect, area) = ui.allocate_exact_size(size, Sense::click_and_drag());
    area.widget_info(|| WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), name));
    let inside = rect.shrink2(vec2(MARGIN.x, if height > 2.0 * BAR { MARGIN.y } else { 0.0 }));
    ui.painter().rect_filled(inside, 0.0, ui.visuals().extreme_bg_color);
    (Plot { rect: inside, range: [0.0, 1.0], scale: Scale::Root }, area)
}

/// Zooms by the wheel, and pans by a drag.
fn navigate(ui: &Ui, area: &Response, plot: &Plot, zoom: &mut Zoom, whole: [f64; 2]) {
    if let Some(pointer) = area.hover_pos().filter(|_| area.contains_pointer()) {
        let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta.y, input.zoom_delta()));
        let factor = f64::from(pinch) * (f64::from(scroll) / 200.0).exp();
        if factor != 1.0 {
            zoom.zoom(whole, plot.value(pointer.x), factor);
            // The panel around must not scroll too.
            ui.input_mut(|input| input.smooth_scroll_delta.y = 0.0);
        }
    }
    if area.dragged_by(PointerButton::Primary) || area.dragged_by(PointerButton::Middle) {
        let origin = plot.rect.left();
        zoom.pan(whole, plot.value(origin) - plot.value(origin + area.drag_delta().x));
    }
}

/// Returns where an area was double-clicked.
fn doubled(area: &Response) -> Option<eframe::egui::Pos2> {
    area.double_clicked().then(|| area.interact_pointer_pos()).flatten()
}

/// What the pointer does in a plot.
enum Pointed {
    Change(Change),
    Add(eframe::egui::Pos2),
}

fn edited(
    ui: &Ui,
    name: &str,
    plot: &Plot,
    area: &Response,
    points: &[(f64, f64)],
    editor: &mut CurveEditor,
) -> Option<Pointed> {
    let handles: Vec<_> = points.iter().map(|&point| plot.at(point)).collect();
    let change = points::sense(ui, name, &handles, area.rect, &mut editor.grab);
    change.map(Pointed::Change).or_else(|| doubled(area).map(Pointed::Add))
}

/// Changes points as pointed at, and returns the chosen one.
fn change_points(
    points: &mut Vec<(f64, f64)>,
    pointed: Pointed,
    plot: &Plot,
    limits: [f64; 2],
) -> Option<usize> {
    match pointed {
        Pointed::Change(change) => {
            let place = |point: &mut (f64, f64), at: eframe::egui::Pos2| {
                point.1 = plot.share(at.y);
                plot.value(at.x)
            };
            points::apply(points, change, place, limits)
        }
        Pointed::Add(at) => {
            points::insert(points, (plot.value(at.x).max(limits[1]), plot.share(at.y)))
        }
    }
}

/// Shows both numbers of a point and a button that removes it. Returns whether it was removed.
fn numbers_of(
    ui: &mut Ui,
    points: &mut Vec<(f64, f64)>,
    i: usize,
    names: [&str; 2],
    [least, floor]: [f64; 2],
    speed: f64,
) -> bool {
    let [low, high] = points::limits(points, i, floor);
    number(ui, names[0], &mut points[i].0, low..=high, speed);
    number(ui, names[1], &mut points[i].1, 0.0..=1.0, 0.002);
    let removes = ui.button("Remove point").clicked() && points.len() as f64 > least;
    if removes {
        points.remove(i);
    }
    removes
}

/// Draws lines at opacities, which are not evenly apart.
fn grid(ui: &Ui, plot: &Plot) {
    let painter = ui.painter_at(plot.rect);
    let color = ui.visuals().weak_text_color();
    for opacity in [0.01, 0.1, 0.5] {
        let y = plot.y(opacity);
        painter.hline(plot.rect.x_range(), y, (0.5, color.gamma_multiply(0.4)));
        let at = pos2(plot.rect.left() + 2.0, y);
        painter.text(at, Align2::LEFT_BOTTOM, opacity, FontId::proportional(9.0), color);
    }
}

/// Writes the number under the pointer and the function's value there.
fn readout(ui: &Ui, area: &Response, plot: &Plot, function: impl Fn(f64) -> f64) {
    let Some(pointer) = area.hover_pos() else { return };
    let value = plot.value(pointer.x);
    let text = format!("{}: {}", plain(value), plain(function(value)));
    let at = plot.rect.right_top() + vec2(-4.0, 2.0);
    let color = ui.visuals().text_color();
    ui.painter_at(plot.rect).text(at, Align2::RIGHT_TOP, text, FontId::proportional(11.0), color);
}

fn byte_color(color: [f64; 3]) -> Color32 {
    let [r, g, b] = color.map(|part| (part * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
