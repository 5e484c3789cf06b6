//! Last captures of sensors: thumbnails along the lower edge of the view, or one in full size.

use crate::app::sensors::captures::{Captured, Painted};
use crate::app::sensors::choice::{self, Choice};
use crate::app::sensors::values;
use crate::app::sensors::views::SensorViews;
use crate::app::shown::{legend, sensor_panel};
use crate::data::pictures::Scale;
use crate::name;
use bevy_ecs::prelude::*;
use egui::{Align2, Area, Color32, CursorIcon, FontId, Frame, Id, Label, Margin, Painter, Pos2, Rect, RichText};
use egui::{ScrollArea, Sense, Ui, Vec2, vec2};
use systems::sensors::{CameraOutput, Classes, Sensor};

/// Points, of a thumbnail's picture at most.
const LARGEST: Vec2 = vec2(300.0, 112.0);
/// Points that thumbnails are wide at least, for their captions.
const NARROWEST: f32 = 112.0;
/// Between thumbnails and the view's edges, points.
const MARGIN: f32 = 8.0;
/// Points of the view's height that thumbnails take.
pub const ROOM: f32 = 170.0;
/// Pixels along the longer side of a thumbnail's picture, and of one in full size.
const PIXELS: [u32; 2] = [512, 2048];
/// Pixels of views from above, which have as many as are asked for.
const PIXELS_FROM_ABOVE: [u32; 2] = [224, 640];

/// Shows the sensor in full size, else the thumbnails; in what the panel leaves of the window.
pub fn show(ui: &mut Ui, views: &mut SensorViews, world: &mut World) {
    let room = ui.available_rect_before_wrap();
    if let Some(entity) = views.full {
        return full(ui, room, views, world, entity);
    }
    let opened = views.opened(world);
    if opened.is_empty() {
        return;
    }
    let area = Area::new(Id::unique("sensor thumbnails")).pivot(Align2::LEFT_BOTTOM).constrain(false);
    let mut clicked = None;
    area.fixed_pos(room.left_bottom() + vec2(MARGIN, -MARGIN)).show(ui.ctx(), |ui| {
        ui.set_max_width(room.width() - 2.0 * MARGIN);
        ui.style_mut().always_scroll_the_only_direction = true;
        ScrollArea::horizontal().show(ui, |ui| {
            ui.horizontal_top(|ui| {
                for (name, entity) in &opened {
                    if thumbnail(ui, views, world, name, *entity) {
                        clicked = Some(*entity);
                    }
                }
            });
        });
    });
    if clicked.is_some() {
        views.full = clicked;
        ui.request_repaint();
    }
}

/// Returns whether it was clicked.
fn thumbnail(ui: &mut Ui, views: &mut SensorViews, world: &World, name: &str, entity: Entity) -> bool {
    let Some(sensor) = world.get::<Sensor>(entity) else { return false };
    let choice = views.choice(entity, sensor);
    // Its first capture follows.
    let Some(captured) = views.captures.get(entity) else { return false };
    let step = captured.step;
    let painted = captured.paint(ui.ctx(), choice, pixels(choice)[0], world.resource::<Classes>());
    let size =
        painted.as_ref().map_or(vec2(NARROWEST, LARGEST.y), |painted| fitted(painted.texture.size_vec2(), LARGEST));
    let frame = Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::same(4)).corner_radius(3);
    let shown = frame.show(ui, |ui| {
        ui.vertical(|ui| {
            ui.set_width(size.x.max(NARROWEST));
            let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), LARGEST.y), Sense::click());
            let scale = match painted {
                Ok(painted) => {
                    image(ui.painter(), painted, Rect::from_center_size(rect.center(), size));
                    painted.scale
                }
                Err(text) => {
                    wrapped(ui.painter(), rect, text);
                    None
                }
            };
            ui.add(Label::new(RichText::new(name).strong()).truncate());
            ui.add(Label::new(RichText::new(caption(choice, scale)).weak().small()).truncate());
            response
                .on_hover_cursor(CursorIcon::PointingHand)
                .on_hover_text_at_pointer(format!("step {step}; click: full size"))
        })
    });
    shown.inner.inner.clicked()
}

/// Fills the view until it is clicked.
fn full(ui: &mut Ui, room: Rect, views: &mut SensorViews, world: &World, entity: Entity) {
    let Some(sensor) = world.get::<Sensor>(entity) else { return };
    let area = Area::new(Id::unique("sensor in full size")).fixed_pos(room.min).constrain(false);
    let closed = area.show(ui.ctx(), |ui| {
        ui.set_min_size(room.size());
        ui.set_max_size(room.size());
        ui.painter().rect_filled(room, 0.0, Color32::from_gray(12));
        Frame::new().inner_margin(Margin::same(MARGIN as i8)).show(ui, |ui| {
            let mut closed = false;
            ui.horizontal_wrapped(|ui| {
                closed = ui.button("back (Esc)").clicked();
                if let Some(captured) = views.captures.get(entity) {
                    ui.strong(&captured.capture.name);
                    ui.weak(format!("{}, step {}", choice::description(sensor), captured.step));
                }
            });
            sensor_panel::choices(ui, views, entity, sensor);
            let choice = views.choice(entity, sensor);
            let Some(captured) = views.captures.get(entity) else { return closed };
            closed | picture(ui, captured, choice, world)
        })
    });
    if closed.inner.inner {
        views.full = None;
        ui.request_repaint();
    }
}

/// The picture with what its colours mean, and the value under the pointer. Returns whether it was clicked.
fn picture(ui: &mut Ui, captured: &mut Captured, choice: Option<Choice>, world: &World) -> bool {
    let painted = captured.paint(ui.ctx(), choice, pixels(choice)[1], world.resource::<Classes>());
    let (painted, scale) = match painted {
        Ok(painted) => ((painted.texture.id(), painted.texture.size_vec2(), painted.reach), painted.scale),
        Err(text) => {
            let rect = ui.available_rect_before_wrap();
            wrapped(ui.painter(), rect, text);
            return ui.allocate_rect(rect, Sense::click()).clicked();
        }
    };
    let (texture, pixels, reach) = painted;
    if let Some(scale) = scale {
        legend::show_scale(ui, &scale);
    }
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, Sense::click()).on_hover_cursor(CursorIcon::Crosshair);
    let rect = Rect::from_center_size(rect.center(), fitted(pixels, rect.size()));
    ui.painter().image(texture, rect, WHOLE, Color32::WHITE);
    rings(ui.painter(), rect, reach);
    if let Some((at, choice)) = response.hover_pos().zip(choice) {
        let place = (at - rect.min) / rect.size();
        let place = glam::Vec2::new(place.x, place.y);
        if let Some(text) = values::at(world, &captured.capture, choice, place, reach) {
            beside(ui.painter(), ui.max_rect(), at, &text);
        }
    }
    response.clicked()
}

/// Whole texture, in its coordinates.
const WHOLE: Rect = Rect { min: Pos2::ZERO, max: Pos2::new(1.0, 1.0) };

fn image(painter: &Painter, painted: &Painted, rect: Rect) {
    painter.image(painted.texture.id(), rect, WHOLE, Color32::WHITE);
    rings(painter, rect, painted.reach);
}

/// Circles around the middle of a view from above, with their radii where there is room.
fn rings(painter: &Painter, rect: Rect, reach: Option<f32>) {
    let Some(reach) = reach else { return };
    let (middle, radius) = (rect.center(), rect.width() / 2.0);
    let color = Color32::from_gray(110);
    for part in [0.5, 1.0] {
        painter.circle_stroke(middle, radius * part, (0.75, color));
        if radius > LARGEST.y {
            let at = middle + vec2(0.0, -radius * part + 2.0);
            let text = format!("{} m", reach * part);
            painter.text(at, Align2::CENTER_TOP, text, FontId::proportional(10.5), Color32::from_gray(180));
        }
    }
    // Forward is up.
    let [tip, left, right] = [vec2(0.0, -5.0), vec2(-3.0, 3.0), vec2(3.0, 3.0)].map(|by| middle + by);
    painter.add(egui::Shape::convex_polygon(vec![tip, right, left], Color32::WHITE, egui::Stroke::NONE));
}

/// A text in the middle of a rectangle.
fn wrapped(painter: &Painter, rect: Rect, text: String) {
    let galley = painter.layout(text, FontId::monospace(11.5), Color32::from_gray(205), rect.width());
    painter.galley(rect.center() - galley.size() / 2.0, galley, Color32::WHITE);
}

/// A text beside the pointer, on the side where there is room.
fn beside(painter: &Painter, room: Rect, at: Pos2, text: &str) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.5), Color32::WHITE);
    let size = galley.size() + vec2(10.0, 6.0);
    let mut low = at + vec2(14.0, 14.0);
    if low.x + size.x > room.max.x {
        low.x = (at.x - 8.0 - size.x).max(room.min.x);
    }
    if low.y + size.y > room.max.y {
        low.y = at.y - 8.0 - size.y;
    }
    painter.rect_filled(Rect::from_min_size(low, size), 3.0, Color32::from_black_alpha(210));
    painter.galley(low + vec2(5.0, 3.0), galley, Color32::WHITE);
}

/// The size that a picture has in some room: whole, its pixels square.
fn fitted(pixels: Vec2, room: Vec2) -> Vec2 {
    pixels * (room / pixels).min_elem()
}

fn pixels(choice: Option<Choice>) -> [u32; 2] {
    if matches!(choice, Some(Choice::Points(_))) { PIXELS_FROM_ABOVE } else { PIXELS }
}

/// Caption of a picture: its value, and the range of its colours.
fn caption(choice: Option<Choice>, scale: Option<Scale>) -> String {
    let name = match choice {
        Some(Choice::Output(output)) => name::of(&CameraOutput::ALL, output),
        Some(Choice::Points(value)) => name::of(&crate::data::pictures::PointValue::ALL, value),
        None => "",
    };
    scale.map_or_else(|| name.to_owned(), |scale| format!("{name} {}", legend::ends(&scale)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_keeps_its_aspect_in_any_room() {
        assert_eq!(fitted(vec2(640.0, 240.0), vec2(320.0, 240.0)), vec2(320.0, 120.0));
        assert_eq!(fitted(vec2(100.0, 400.0), vec2(320.0, 200.0)), vec2(50.0, 200.0));
        assert_eq!(fitted(vec2(8.0, 4.0), vec2(80.0, 80.0)), vec2(80.0, 40.0));
    }

    #[test]
    fn captions_say_from_where_to_where_colours_go() {
        let scale = Scale { least: 1.234, most: 120.6, unit: " m", is_of_distances: true };
        let depth = Some(Choice::Output(CameraOutput::Depth));
        assert_eq!(caption(depth, Some(scale)), "depth 1.23 – 121 m");
        assert_eq!(caption(depth, None), "depth");
        assert_eq!(caption(None, None), "");
    }
}
