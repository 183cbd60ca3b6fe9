//! Three orthogonal slices of a volume, with a crosshair at one place.

mod plane;

use super::curve::{field, plain};
use eframe::{
    egui::{
        Align2, Color32, ColorImage, Mesh, PointerButton, Pos2, Response, Role, ScrollArea, Sense,
        Slider, TextStyle, TextureHandle, TextureOptions, Ui, WidgetInfo, pos2, vec2,
    },
    epaint::Vertex,
};
use plane::{Plane, Turn};
use splatkit::{
    glam::{DVec2, DVec3},
    interaction::{Shading, Slice},
    math::Kernel,
    volume::{TransferFunction, Volume},
};
use std::sync::{Arc, Weak};

/// The panes' state between frames.
#[derive(Default)]
pub struct SlicePanes {
    /// Whether slices have the colours of the transfer function instead of greys.
    is_colored: bool,
    /// The values that are black and white; `None` for the volume's range.
    window: Option<[f64; 2]>,
    /// The crosshair, in the world; `None` for the middle of the volume.
    place: Option<DVec3>,
    panes: [Option<Pane>; 3],
}

/// A slice as it was drawn last.
struct Pane {
    key: Key,
    slice: Slice,
    plane: Plane,
    turn: Turn,
    texture: TextureHandle,
}

/// What a slice was made of.
struct Key {
    /// Keeps the address from being used by another volume.
    volume: Weak<Volume>,
    kernel: Kernel,
    index: usize,
    mapping: Mapping,
}

#[derive(Clone, PartialEq)]
enum Mapping {
    Window([f64; 2]),
    Transfer(TransferFunction),
}

/// Height of a pane's picture in points, at least.
const LEAST: f32 = 80.0;
/// Height of the rows above and below a pane's picture, in points.
const ROWS: f32 = 48.0;
/// Below this width in points, panes stand one below the other.
const WIDE: f32 = 600.0;
/// A drag over so many points moves the grey window over all values.
const WHOLE: f64 = 400.0;

impl SlicePanes {
    /// Sets the crosshair to a place in the world, as picked in the 3D view.
    pub fn set_place(&mut self, place: DVec3) {
        self.place = Some(place);
    }

    /// Shows the slices. Returns the place in the world, if a click or a slider has set it.
    ///
    /// A slice is cut again when its index, the volume, the kernel or the colours change.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        volume: &Arc<Volume>,
        kernel: &Kernel,
        transfer: &TransferFunction,
    ) -> Option<DVec3> {
        let mut chosen = None;
        ui.push_id("slices", |ui| {
            self.toolbar(ui, volume.range);
            let mapping = match self.is_colored {
                true => Mapping::Transfer(transfer.clone()),
                false => Mapping::Window(self.window.unwrap_or(volume.range)),
            };
            let (room, is_wide) = (ui.available_height(), ui.available_width() >= WIDE);
            let height = if is_wide { room - ROWS } else { room / 3.0 - ROWS }.max(LEAST);
            let mut pane = |ui: &mut Ui, plane: Plane| {
                let place = self.pane(ui, (plane, height), volume, kernel, &mapping);
                chosen = place.or(chosen);
            };
            let planes = Plane::of(volume);
            ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
                if is_wide {
                    ui.columns(3, |columns| {
                        for (plane, ui) in planes.into_iter().zip(columns) {
                            pane(ui, plane);
                        }
                    });
                } else {
                    planes.into_iter().for_each(|plane| pane(ui, plane));
                }
            });
        });
        self.place = chosen.or(self.place);
        chosen
    }

    fn toolbar(&mut self, ui: &mut Ui, range: [f64; 2]) {
        ui.weak("Click a slice to set the place.");
        ui.checkbox(&mut self.is_colored, "Transfer function's colours");
        if self.is_colored {
            return;
        }
        ui.horizontal(|ui| {
            let mut window = self.window.unwrap_or(range);
            let speed = (range[1] - range[0]).abs() / 500.0;
            for (end, name) in window.iter_mut().zip(["Black", "White"]) {
                let label = ui.label(name);
                ui.add(field(end, f64::MIN..=f64::MAX, speed)).labelled_by(label.id);
            }
            if window != self.window.unwrap_or(range) {
                self.window = Some(window);
            }
            if ui.button("Full window").clicked() {
                self.window = None;
            }
        });
    }

    fn pane(
        &mut self,
        ui: &mut Ui,
        (plane, height): (Plane, f32),
        volume: &Arc<Volume>,
        kernel: &Kernel,
        mapping: &Mapping,
    ) -> Option<DVec3> {
        let axis = plane.axis;
        let lattice = &volume.lattice;
        let place = self.place.unwrap_or_else(|| lattice.position(lattice.step_range().center()));
        let mut chosen = None;
        let mut index = Slice::nearest(lattice, axis, place);
        let last = Slice::count(lattice, axis) - 1;
        ui.horizontal(|ui| {
            ui.strong(plane.name);
            ui.spacing_mut().slider_width = (ui.available_width() - 90.0).max(60.0);
            let slider = Slider::new(&mut index, 0..=last).integer();
            let name = format!("{} slice", plane.name);
            if ui.add(slider).accessible_name(name).changed() {
                chosen = Some(Slice::moved_onto(lattice, axis, index, place));
            }
        });
        if let Err(message) = self.cut(ui, plane, index, (volume, kernel), mapping) {
            ui.colored_label(ui.visuals().error_fg_color, message);
            return chosen;
        }
        let Some(pane) = &self.panes[axis] else { return chosen };
        let area = picture(ui, pane, height);
        let mut levelled = None;
        if let (true, Mapping::Window(window)) =
            (area.dragged_by(PointerButton::Secondary), mapping)
        {
            let delta = area.drag_delta();
            let whole = volume.range[1] - volume.range[0];
            let [wider, higher] = [delta.x, -delta.y].map(|part| f64::from(part) * whole / WHOLE);
            levelled = Some([window[0] + higher - 0.5 * wider, window[1] + higher + 0.5 * wider]);
        }
        if area.clicked() || area.dragged_by(PointerButton::Primary) {
            chosen =
                area.interact_pointer_pos().map(|at| pane.slice.position(pixel(pane, &area, at)));
        }
        crosshair(ui, pane, &area, chosen.unwrap_or(place));
        letters(ui, pane, &area);
        // Without a pointer the row stays, so that nothing moves.
        ui.label(under_pointer(pane, &area).unwrap_or_default());
        self.window = levelled.filter(|[low, high]| low < high).or(self.window);
        chosen
    }

    /// Cuts a slice, unless the last one was made of the same. The error is a message.
    fn cut(
        &mut self,
        ui: &Ui,
        plane: Plane,
        index: usize,
        (volume, kernel): (&Arc<Volume>, &Kernel),
        mapping: &Mapping,
    ) -> Result<(), String> {
        let axis = plane.axis;
        let is_same = |key: &Key| {
            key.index == index
                && std::ptr::eq(key.volume.as_ptr(), Arc::as_ptr(volume))
                && key.kernel == *kernel
                && key.mapping == *mapping
        };
        if self.panes[axis].as_ref().is_some_and(|pane| is_same(&pane.key)) {
            return Ok(());
        }
        let shading = match mapping {
            Mapping::Window(window) => Shading::Window(*window),
            Mapping::Transfer(transfer) => Shading::Transfer(transfer),
        };
        self.panes[axis] = None;
        let slice = Slice::of_volume(volume, kernel, axis, index, shading)
            .map_err(|error| error.to_string())?;
        let most = ui.ctx().input(|input| input.max_texture_side);
        let name = format!("slice {axis}");
        let texture = ui.ctx().load_texture(name, image(&slice, most), TextureOptions::NEAREST);
        let volume = Arc::downgrade(volume);
        let key = Key { volume, kernel: kernel.clone(), index, mapping: mapping.clone() };
        let turn = plane.turn(&slice);
        self.panes[axis] = Some(Pane { key, slice, plane, turn, texture });
        Ok(())
    }
}

/// Returns a slice's pixels: every second, third, … one, if a side is longer than `most`.
fn image(slice: &Slice, most: usize) -> ColorImage {
    let step = slice.size.iter().max().map_or(1, |longest| longest.div_ceil(most.max(1)));
    let [width, height] = slice.size;
    let pixel = |x: usize, y: usize| {
        let at = 4 * (y * width + x);
        let [r, g, b, a] = [0, 1, 2, 3].map(|channel| slice.rgba[at + channel]);
        Color32::from_rgba_unmultiplied(r, g, b, a)
    };
    let row = |y: usize| (0..width).step_by(step).map(move |x| pixel(x, y));
    let pixels = (0..height).step_by(step).flat_map(row).collect();
    ColorImage::new([width.div_ceil(step), height.div_ceil(step)], pixels)
}

/// Draws a slice as large as it fits, with the proportions of the world.
fn picture(ui: &mut Ui, pane: &Pane, height: f32) -> Response {
    let slice = &pane.slice;
    let mut size = [0, 1].map(|side| slice.size[side] as f64 * slice.spacing[side]);
    if pane.turn.swaps {
        size.reverse();
    }
    let room = [f64::from(ui.available_width().max(20.0)), f64::from(height)];
    let scale = (room[0] / size[0]).min(room[1] / size[1]);
    // A slice of a single sample's thickness is still seen.
    let [width, height] = size.map(|length| ((length * scale) as f32).max(4.0));
    let size = vec2(width, height);
    // In a row, because columns stretch what they hold.
    let row = ui.horizontal(|ui| ui.allocate_exact_size(size, Sense::click_and_drag()));
    let (rect, area) = row.inner;
    let name = format!("{} picture", pane.plane.name);
    area.widget_info(|| WidgetInfo::labeled(Role::Image, ui.is_enabled(), &name));
    let mut mesh = Mesh::with_texture(pane.texture.id());
    let corner = |[x, y]: [f64; 2]| {
        let stored = pane.turn.stored(DVec2::new(x, y));
        Vertex {
            pos: rect.lerp_inside(vec2(x as f32, y as f32)),
            uv: pos2(stored.x as f32, stored.y as f32),
            color: Color32::WHITE,
        }
    };
    mesh.vertices.extend([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(corner));
    mesh.indices.extend([0, 1, 2, 2, 1, 3]);
    ui.painter().add(mesh);
    area
}

/// Returns the point of the slice under a point of the screen, within the slice.
fn pixel(pane: &Pane, area: &Response, at: Pos2) -> DVec2 {
    let share = (at - area.rect.min) / area.rect.size();
    let place = DVec2::new(f64::from(share.x), f64::from(share.y));
    let last = DVec2::from_array(pane.slice.size.map(|count| count as f64 - 0.5));
    pane.turn.pixel(place, pane.slice.size).clamp(DVec2::splat(0.5), last)
}

fn crosshair(ui: &Ui, pane: &Pane, area: &Response, place: DVec3) {
    let share = pane.turn.place(pane.slice.pixel(place), pane.slice.size);
    let at = area.rect.min + area.rect.size() * vec2(share.x as f32, share.y as f32);
    let painter = ui.painter_at(area.rect);
    let stroke = (1.0, Color32::from_rgb(255, 200, 0).gamma_multiply(0.8));
    painter.vline(at.x, area.rect.y_range(), stroke);
    painter.hline(area.rect.x_range(), at.y, stroke);
}

/// Returns the value and the place under the pointer, as text.
fn under_pointer(pane: &Pane, area: &Response) -> Option<String> {
    let at = area.hover_pos()?;
    let pixel = pixel(pane, area, at);
    let value = pane.slice.values[pixel.y as usize * pane.slice.size[0] + pixel.x as usize];
    let place = pane.slice.position(pixel.floor() + 0.5);
    let [x, y, z] = place.to_array().map(plain);
    Some(match value.is_nan() {
        true => format!("No value at {x}, {y}, {z}"),
        false => format!("{} at {x}, {y}, {z}", name_of(pane, f64::from(value))),
    })
}

/// Returns the name of a label, or the number of another value.
fn name_of(pane: &Pane, value: f64) -> String {
    let volume = pane.key.volume.upgrade();
    let labels = volume.as_ref().and_then(|volume| volume.about.labels.as_ref());
    labels.map_or_else(|| plain(value), |labels| labels.name(value as i32))
}

/// Writes at the edges of a slice what they lead to.
fn letters(ui: &Ui, pane: &Pane, area: &Response) {
    let [left, right, above, below] = pane.plane.sides(&pane.slice, pane.turn);
    let painter = ui.painter_at(area.rect);
    let rect = area.rect.shrink(4.0);
    let ink = Color32::from_rgb(255, 200, 0);
    let font = TextStyle::Body.resolve(ui.style());
    for (place, align, letter) in [
        (rect.left_center(), Align2::LEFT_CENTER, left),
        (rect.right_center(), Align2::RIGHT_CENTER, right),
        (rect.center_top(), Align2::CENTER_TOP, above),
        (rect.center_bottom(), Align2::CENTER_BOTTOM, below),
    ] {
        painter.text(place, align, letter, font.clone(), ink);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::{Harness, kittest::Queryable};
    use splatkit::volume::{Lattice, Samples};

    struct State {
        panes: SlicePanes,
        volume: Arc<Volume>,
        transfer: TransferFunction,
        chosen: Option<DVec3>,
    }

    /// Samples whose value is i + 10 j + 50 k.
    fn volume() -> Arc<Volume> {
        let lattice = Lattice::with_spacing([8, 4, 5], DVec3::new(1.0, 2.0, 1.0));
        let value = |at| {
            let [i, j, k] = lattice.index(at);
            (i + 10 * j + 50 * k) as u8
        };
        let samples = (0..lattice.len()).map(value).collect();
        Arc::new(Volume::new(lattice, Samples::U8(samples)).unwrap())
    }

    fn harness() -> Harness<'static, State> {
        let state = State {
            panes: SlicePanes::default(),
            volume: volume(),
            transfer: TransferFunction::default(),
            chosen: None,
        };
        let show = |ui: &mut Ui, state: &mut State| {
            let State { panes, volume, transfer, chosen } = state;
            *chosen = panes.show(ui, volume, &Kernel::default(), transfer).or(*chosen);
        };
        Harness::builder().with_size(vec2(900.0, 500.0)).build_ui_state(show, state)
    }

    fn index(harness: &Harness<'_, State>, axis: usize) -> usize {
        harness.state().panes.panes[axis].as_ref().unwrap().key.index
    }

    fn slider(harness: &Harness<'_, State>, axis: usize, value: f64) {
        let name = format!("{} slice", ["x", "y", "z"][axis]);
        harness.get_by_role_and_label(Role::Slider, &name).set_value_accesskit(value);
    }

    #[test]
    fn sliders_choose_slices_and_move_the_place() {
        let mut harness = harness();
        harness.run();
        assert_eq!([0, 1, 2].map(|axis| index(&harness, axis)), [4, 2, 2]);
        slider(&harness, 2, 4.0);
        harness.run();
        assert_eq!(index(&harness, 2), 4);
        let pane = harness.state().panes.panes[2].as_ref().unwrap();
        assert_eq!(pane.slice.values[0], 200.0);
        assert_eq!(harness.state().chosen.unwrap(), DVec3::new(3.5, 3.0, 4.0));
    }

    #[test]
    fn clicks_set_the_place_of_all_panes() {
        let mut harness = harness();
        harness.run();
        let rect = harness.get_by_label("z picture").rect();
        // World proportions: 8 wide, 8 high.
        assert!((rect.width() - rect.height()).abs() < 1.0, "{rect}");
        let at = rect.lerp_inside(vec2(1.5 / 8.0, 0.5 / 4.0));
        harness.hover_at(at);
        harness.drag_at(at);
        harness.run();
        harness.drop_at(at);
        harness.run();
        let place = harness.state().chosen.unwrap();
        assert!(place.distance(DVec3::new(1.0, 0.0, 2.0)) < 0.1, "{place}");
        assert_eq!([0, 1, 2].map(|axis| index(&harness, axis)), [1, 0, 2]);
        harness.state_mut().panes.set_place(DVec3::new(6.0, 4.0, 0.0));
        harness.run();
        assert_eq!([0, 1, 2].map(|axis| index(&harness, axis)), [6, 2, 0]);
    }

    #[test]
    fn the_value_under_the_pointer_is_told() {
        let mut harness = harness();
        harness.run();
        let rect = harness.get_by_label("z picture").rect();
        harness.hover_at(rect.lerp_inside(vec2(2.5 / 8.0, 3.5 / 4.0)));
        harness.run();
        harness.get_by_label("132 at 2, 6, 2");
    }

    /// All three pictures are inside the window, however high it is.
    #[test]
    fn slices_fit_their_panes() {
        for size in [[300.0, 500.0], [300.0, 1200.0], [900.0, 400.0]] {
            let mut harness = harness();
            harness.set_size(vec2(size[0], size[1]));
            harness.run();
            let heights = ["x", "y", "z"].map(|name| {
                let rect = harness.get_by_label(&format!("{name} picture")).rect();
                assert!(rect.bottom() <= size[1] && rect.right() <= size[0], "{name}: {rect}");
                rect.height()
            });
            assert!(heights.iter().all(|height| *height > 50.0), "{heights:?}");
        }
    }

    /// A click on a turned slice chooses the place that it shows.
    #[test]
    fn clicks_choose_what_turned_slices_show() {
        let mut harness = harness();
        let mut patient = Volume::clone(&volume());
        patient.about.frame = splatkit::about::Frame::Patient;
        harness.state_mut().volume = Arc::new(patient);
        harness.run();
        // The patient's right side is at the left, the front above: x and y grow to there.
        let rect = harness.get_by_label("Axial picture").rect();
        let at = rect.lerp_inside(vec2(0.5 / 8.0, 0.5 / 4.0));
        harness.drag_at(at);
        harness.run();
        harness.drop_at(at);
        harness.run();
        let place = harness.state().chosen.unwrap();
        assert!(place.distance(DVec3::new(7.0, 6.0, 2.0)) < 0.1, "{place}");
    }

    #[test]
    fn slices_are_cut_again_only_when_they_change() {
        let mut harness = harness();
        harness.run();
        let texture = |harness: &Harness<'_, State>| {
            harness.state().panes.panes[2].as_ref().unwrap().texture.id()
        };
        let first = texture(&harness);
        harness.run();
        assert_eq!(texture(&harness), first);
        harness.get_by_label("Transfer function's colours").click();
        harness.run();
        let colored = texture(&harness);
        assert_ne!(colored, first);
        harness.state_mut().transfer.color = vec![(0.0, [1.0, 0.0, 0.0])];
        harness.run();
        assert_ne!(texture(&harness), colored);
        let pane = harness.state().panes.panes[2].as_ref().unwrap();
        assert_eq!(pane.slice.rgba[..4], [255, 0, 0, 255]);
        let before = texture(&harness);
        harness.state_mut().volume = volume();
        harness.run();
        assert_ne!(texture(&harness), before);
    }

    #[test]
    fn long_slices_fit_a_texture() {
        let lattice = Lattice::with_spacing([9, 2, 1], DVec3::ONE);
        let volume = Volume::new(lattice, Samples::U8((0..18).collect())).unwrap();
        let shading = Shading::Window([0.0, 255.0]);
        let slice = Slice::of_volume(&volume, &Kernel::default(), 2, 0, shading).unwrap();
        let small = image(&slice, 4);
        assert_eq!(small.size, [3, 1]);
        assert_eq!([0, 1, 2].map(|at| small.pixels[at].r()), [0, 3, 6]);
        assert_eq!(image(&slice, 9).size, [9, 2]);
    }
}
