//! Overlay of the scene: lines from an object to its lights, and the speed of the driven vehicle.

use crate::app::shown::object_lights::{ObjectLights, colors};
use egui::{Align2, Color32, FontId, Painter, Pos2, Stroke};
use glam::{Mat4, Vec2, Vec3, Vec4, Vec4Swizzles};
use systems::draw::View;

/// Points between a weight and the edge.
const MARGIN: Vec2 = Vec2::splat(8.0);
const WEIGHT_WIDTH: f32 = 28.0;
/// Opacity of a line to a light of weight 0.
const FAINTEST: f32 = 0.25;

/// Paints a line to each light with its weight beside it; nothing covers the scene left of `room`, in points.
pub fn paint(painter: &Painter, view: &View, lights: &ObjectLights, room: f32) {
    let size = Vec2::new(view.width as f32, view.height as f32) / painter.pixels_per_point();
    let clip_from_world = view.clip_from_world();
    let point = |p: Vec2| Pos2::new(p.x, p.y);
    for (light, color) in lights.lights.iter().zip(colors()) {
        let Some((from, to)) = on_screen(&clip_from_world, lights.bounds.center, light.place, size) else { continue };
        // The fainter, the less it counts; never gone, since a light that is about to fade in is worth seeing.
        let opacity = FAINTEST + (1.0 - FAINTEST) * light.weight.clamp(0.0, 1.0);
        let ends = [point(from), point(to)];
        painter.line_segment(ends, Stroke::new(3.5, Color32::from_black_alpha(150).gamma_multiply(opacity)));
        painter.line_segment(ends, Stroke::new(2.0, color.gamma_multiply(opacity)));
        painter.circle_filled(point(to), 4.0, color);
        let last = Vec2::new(room - MARGIN.x - WEIGHT_WIDTH, size.y - MARGIN.y).max(MARGIN);
        let beside = last_inside(from, to, MARGIN, last) + Vec2::new(8.0, 0.0);
        let (text, font) = (format!("{:.2}", light.weight), FontId::proportional(12.0));
        self::text(painter, point(beside), Align2::LEFT_CENTER, &text, font, color);
    }
}

/// Writes the speed of the vehicle that is driven, at the left so many points above the bottom.
pub fn speed(painter: &Painter, speed: &str, above: f32) {
    let at = painter.clip_rect().left_bottom() + egui::vec2(24.0, -20.0 - above);
    text(painter, at, Align2::LEFT_BOTTOM, speed, FontId::proportional(34.0), Color32::WHITE);
}

/// Writes a text that can be read on any ground.
pub fn text(painter: &Painter, at: Pos2, align: Align2, text: &str, font: FontId, color: Color32) {
    // A large one casts a wider shadow.
    let shadow = egui::Vec2::splat(if font.size > 20.0 { 1.5 } else { 1.0 });
    painter.text(at + shadow, align, text, font.clone(), Color32::BLACK);
    painter.text(at, align, text, font, color);
}

/// The ends of a segment in a picture of some size, origin at the top left; `None` where all of it is behind the eye.
pub fn on_screen(clip_from_world: &Mat4, from: Vec3, to: Vec3, size: Vec2) -> Option<(Vec2, Vec2)> {
    let (a, b) = (*clip_from_world * from.extend(1.0), *clip_from_world * to.extend(1.0));
    // The near plane is z = w (depth is reversed); what lies in front of it has z < w.
    let (inside_a, inside_b) = (a.w - a.z, b.w - b.z);
    let cut = |inside: f32, outside: f32| inside / (inside - outside);
    let (a, b) = match (inside_a >= 0.0, inside_b >= 0.0) {
        (true, true) => (a, b),
        (true, false) => (a, a.lerp(b, cut(inside_a, inside_b))),
        (false, true) => (b.lerp(a, cut(inside_b, inside_a)), b),
        (false, false) => return None,
    };
    let pixel = |clip: Vec4| (clip.xy() / clip.w * Vec2::new(0.5, -0.5) + 0.5) * size;
    let ends = (pixel(a), pixel(b));
    (ends.0.is_finite() && ends.1.is_finite()).then_some(ends)
}

/// The end of a line, or where it leaves a rectangle; a corner where the whole line is elsewhere.
fn last_inside(from: Vec2, to: Vec2, low: Vec2, high: Vec2) -> Vec2 {
    let step = to - from;
    let bound = Vec2::select(step.cmplt(Vec2::ZERO), low, high);
    // Along an axis that the line keeps to, 0/0 or x/0: both leave it whole.
    let part = ((bound - from) / step).abs().min_element().min(1.0);
    (from + step * part).clamp(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;
    use systems::draw::Camera;

    #[test]
    fn a_weight_is_beside_its_light_or_where_the_line_leaves_the_picture() {
        let beside = |to| last_inside(Vec2::new(50.0, 50.0), to, Vec2::ZERO, Vec2::splat(100.0));
        assert_eq!(beside(Vec2::new(70.0, 50.0)), Vec2::new(70.0, 50.0));
        assert_eq!(beside(Vec2::new(-50.0, 0.0)), Vec2::new(0.0, 25.0));
        assert_eq!(beside(Vec2::new(50.0, 900.0)), Vec2::new(50.0, 100.0));
        assert_eq!(beside(Vec2::new(50.0, 50.0)), Vec2::new(50.0, 50.0));
    }

    #[test]
    fn a_line_that_goes_behind_the_eye_is_cut_at_the_near_plane() {
        let camera = Camera { near: 0.5, ..Camera::default() };
        let view = View::new(&Affine3A::IDENTITY, &camera, 200, 100);
        let clip = view.clip_from_world();
        let ends = |to| on_screen(&clip, Vec3::new(0.0, 0.0, -2.0), to, Vec2::new(200.0, 100.0));
        let (from, to) = ends(Vec3::new(1.0, 0.0, -4.0)).expect("in sight");
        assert!(from.distance(Vec2::new(100.0, 50.0)) < 1e-3 && to.x > 100.0 && (to.y - 50.0).abs() < 1e-3);
        // To a light behind the eye on the right: the line goes off to the right, not to the left.
        let (_, to) = ends(Vec3::new(1.0, 0.0, 4.0)).expect("its first half is in sight");
        assert!(to.x > 100.0, "{to}");
        assert_eq!(on_screen(&clip, Vec3::Z, Vec3::Z * 2.0, Vec2::ONE), None);
    }
}
