//! The colour bar of a heat map.

use crate::renderer::HeatScale;
use egui::{Align2, Color32, FontId, Rect, Rgba, Sense, Ui, Vec2, pos2, vec2};
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
    let steps = bar.width() as usize;
    for step in 0..steps {
        let part = |i: usize| bar.min.x + bar.width() * i as f32 / steps as f32;
        let stripe = Rect::from_x_y_ranges(part(step)..=part(step + 1), bar.y_range());
        painter.rect_filled(stripe, 0.0, srgb(HeatScale::color((step as f32 + 0.5) / steps as f32)));
    }
    let label = |x: f32, text: &str| {
        let color = ui.visuals().text_color();
        painter.text(pos2(x, bar.max.y + 1.0), Align2::CENTER_TOP, text, FontId::proportional(10.5), color);
    };
    label(zero.center().x, "0");
    let last = scale.ticks.len().saturating_sub(1).max(1) as f32;
    for (i, tick) in scale.ticks.iter().enumerate() {
        label(bar.min.x + bar.width() * i as f32 / last, tick);
    }
}

/// The picture's colour on the screen.
fn srgb(linear: Vec3) -> Color32 {
    Rgba::from_rgb(linear.x, linear.y, linear.z).into()
}
