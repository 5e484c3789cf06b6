//! The colour bars of heat maps and of pictures of sensors.

use crate::data::pictures::Scale;
use crate::renderer::HeatScale;
use egui::{Align2, Color32, FontId, Painter, Rect, Rgba, Sense, Ui, Vec2, pos2, vec2};
use glam::Vec3;

/// Points.
const BAR_HEIGHT: f32 = 10.0;
const LABEL_HEIGHT: f32 = 14.0;
/// Room for the first and the last number, which stand below the bar's ends.
const SIDE: f32 = 14.0;
/// Between the colour of 0 and the bar.
const GAP: f32 = 18.0;

/// Shows what the colours mean: that of 0, then the scale with its numbers.
pub fn show(ui: &mut Ui, scale: &HeatScale) {
    ui.weak(scale.what);
    let size = vec2(ui.available_width(), BAR_HEIGHT + LABEL_HEIGHT);
    let (space, _) = ui.allocate_exact_size(size, Sense::hover());
    let painter = ui.painter_at(space);
    let zero = Rect::from_min_size(space.min + vec2(2.0, 0.0), Vec2::splat(BAR_HEIGHT));
    painter.rect_filled(zero, 0.0, srgb(HeatScale::NONE));
    let bar = Rect::from_min_max(
        pos2(zero.max.x + GAP, space.min.y),
        pos2((space.max.x - SIDE).max(zero.max.x + GAP + 1.0), space.min.y + BAR_HEIGHT),
    );
    paint_bar(&painter, bar, |part| srgb(HeatScale::color(part)));
    let color = ui.visuals().text_color();
    label(&painter, pos2(zero.center().x, bar.max.y), Align2::CENTER_TOP, "0", color);
    let last = scale.ticks.len().saturating_sub(1).max(1) as f32;
    for (i, tick) in scale.ticks.iter().enumerate() {
        let x = bar.min.x + bar.width() * i as f32 / last;
        label(&painter, pos2(x, bar.max.y), Align2::CENTER_TOP, tick, color);
    }
}

/// Shows what the colours of a sensor's picture mean: the least, the most, and what is half-way.
pub fn show_scale(ui: &mut Ui, scale: &Scale) {
    let (space, _) = ui.allocate_exact_size(vec2(ui.available_width(), BAR_HEIGHT + LABEL_HEIGHT), Sense::hover());
    let painter = ui.painter_at(space);
    let bar = Rect::from_min_size(space.min, vec2(space.width(), BAR_HEIGHT));
    paint_bar(&painter, bar, |part| {
        let [r, g, b] = scale.color_at(part);
        Color32::from_rgb(r, g, b)
    });
    let places = [(0.0, Align2::LEFT_TOP), (0.5, Align2::CENTER_TOP), (1.0, Align2::RIGHT_TOP)];
    for (part, align) in places {
        let text = format!("{}{}", number(scale.value_at(part)), scale.unit);
        label(&painter, pos2(bar.min.x + bar.width() * part, bar.max.y), align, &text, ui.visuals().text_color());
    }
}

/// From where to where a scale goes.
pub fn ends(scale: &Scale) -> String {
    format!("{} – {}{}", number(scale.least), number(scale.most), scale.unit)
}

/// With three digits, or more of a large one.
fn number(value: f32) -> String {
    let decimals = match value.abs() {
        100.0.. => 0,
        10.0.. => 1,
        _ => 2,
    };
    format!("{value:.decimals$}")
}

fn paint_bar(painter: &Painter, bar: Rect, color: impl Fn(f32) -> Color32) {
    let steps = bar.width() as usize;
    for step in 0..steps {
        let part = |i: usize| bar.min.x + bar.width() * i as f32 / steps as f32;
        let stripe = Rect::from_x_y_ranges(part(step)..=part(step + 1), bar.y_range());
        painter.rect_filled(stripe, 0.0, color((step as f32 + 0.5) / steps as f32));
    }
}

fn label(painter: &Painter, below: egui::Pos2, align: Align2, text: &str, color: Color32) {
    painter.text(below + vec2(0.0, 1.0), align, text, FontId::proportional(10.5), color);
}

/// The picture's colour on the screen.
fn srgb(linear: Vec3) -> Color32 {
    Rgba::from_rgb(linear.x, linear.y, linear.z).into()
}
