//! Sensors over the scene: frusta of cameras, points of lidars.

use crate::app::control::picking::point_at;
use crate::app::sensors::dots::Dots;
use crate::app::sensors::views::SensorViews;
use crate::app::shown::overlay::{self, on_screen};
use crate::data::pictures::rgb_of_number;
use crate::sense::sensor_names;
use bevy_ecs::prelude::*;
use egui::{Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke};
use glam::{Affine3A, DVec2, DVec3, Mat4, Vec2, Vec3, Vec4Swizzles};
use systems::draw::View;
use systems::sensors::{CameraSensor, Classes, Sensor, SensorKind};
use systems::space::GlobalTransform;
use systems::space::origin::Origin;

/// Metres that frusta are drawn long.
const LENGTH: f32 = 3.0;
/// Size of the mark at a sensor without a frustum, metres.
const MARK: f32 = 0.25;
/// Points across a dot.
const DOT: f32 = 2.0;

/// Projection of world points onto the screen.
struct Screen<'a> {
    painter: &'a Painter,
    clip_from_world: Mat4,
    /// Points.
    size: Vec2,
}

/// Draws the frusta of all cameras and the last points of all lidars, before whatever they are in.
pub fn paint(painter: &Painter, view: &View, views: &mut SensorViews, world: &mut World) {
    let size = Vec2::new(view.width as f32, view.height as f32) / painter.pixels_per_point();
    let screen = Screen { painter, clip_from_world: view.clip_from_world(), size };
    let names = sensor_names(world);
    let (origin, classes) = (world.resource::<Origin>().0, world.resource::<Classes>());
    let placed = |entity: Entity| Some((world.get::<Sensor>(entity)?, world.get::<GlobalTransform>(entity)?.affine()));
    // First of all, so that they hide no lines and names.
    for (_, entity) in &names {
        let Some(choice) = world.get::<Sensor>(*entity).map(|sensor| views.choice(*entity, sensor)) else { continue };
        if let Some(dots) = views.captures.get(*entity).and_then(|captured| captured.dots(choice, classes)) {
            screen.dots(dots, origin);
        }
    }
    for (number, (name, entity)) in (1..).zip(&names) {
        let Some((sensor, world_from_sensor)) = placed(*entity) else { continue };
        let [r, g, b] = rgb_of_number(number);
        let color = Color32::from_rgb(r, g, b);
        match &sensor.kind {
            SensorKind::Camera(camera) => screen.frustum(camera, &world_from_sensor, color, name),
            _ => screen.mark(&world_from_sensor, color, name),
        }
    }
}

impl Screen<'_> {
    fn line(&self, from: Vec3, to: Vec3, color: Color32) {
        let Some((from, to)) = on_screen(&self.clip_from_world, from, to, self.size) else { return };
        let ends = [from, to].map(|at| Pos2::new(at.x, at.y));
        self.painter.line_segment(ends, Stroke::new(3.0, Color32::from_black_alpha(120)));
        self.painter.line_segment(ends, Stroke::new(1.5, color));
    }

    fn around(&self, corners: &[Vec3], color: Color32) {
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).for_each(|(from, to)| self.line(*from, *to, color));
    }

    fn name(&self, at: Vec3, name: &str, color: Color32) {
        if let Some((at, _)) = on_screen(&self.clip_from_world, at, at, self.size) {
            let font = FontId::proportional(12.0);
            overlay::text(self.painter, Pos2::new(at.x, at.y - 2.0), Align2::CENTER_BOTTOM, name, font, color);
        }
    }

    /// Draws a camera's frustum up to [`LENGTH`], with a roof where its upper side is.
    fn frustum(&self, camera: &CameraSensor, world_from_camera: &Affine3A, color: Color32, name: &str) {
        let view = View::new(world_from_camera, &camera.camera(), camera.size.0, camera.size.1);
        let far = LENGTH.max(2.0 * camera.near).min(camera.far);
        let size = Vec2::new(camera.size.0 as f32, camera.size.1 as f32);
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let place = |at: Vec2, depth: f32| match camera.lens.has_distortion() {
            true => bent_corner(camera, &view, at, depth),
            false => point_at(&view, at * size, depth),
        };
        let [near, far] = [camera.near, far].map(|depth| corners.map(|at| place(at, depth)));
        self.around(&near, color);
        self.around(&far, color);
        near.iter().zip(&far).for_each(|(near, far)| self.line(*near, *far, color));
        let [left, right, _, below] = far;
        let up = (left - below) * 0.25;
        let roof = [left.lerp(right, 0.35), left.lerp(right, 0.5) + up, left.lerp(right, 0.65)];
        self.line(roof[0], roof[1], color);
        self.line(roof[1], roof[2], color);
        self.name(roof[1], name, color);
    }

    /// A ring around a sensor, and a line to where it looks, which is along +Z.
    fn mark(&self, world_from_sensor: &Affine3A, color: Color32, name: &str) {
        const SIDES: usize = 24;
        let axis = |axis: Vec3| world_from_sensor.transform_vector3(axis).normalize_or_zero() * MARK;
        let (middle, right, forward) = (world_from_sensor.translation.into(), axis(Vec3::X), axis(Vec3::Z));
        let ring = std::array::from_fn::<Vec3, SIDES, _>(|i| {
            let (sin, cos) = (i as f32 / SIDES as f32 * std::f32::consts::TAU).sin_cos();
            middle + right * cos + forward * sin
        });
        self.around(&ring, color);
        self.line(middle, middle + forward * 2.0, color);
        self.name(middle + axis(Vec3::Y), name, color);
    }

    fn dots(&self, dots: &Dots, origin: DVec3) {
        let clip_from_dots = self.clip_from_world * Mat4::from_translation((dots.from - origin).as_vec3());
        let mut mesh = Mesh::default();
        for (place, color) in &dots.places {
            let clip = clip_from_dots * place.extend(1.0);
            // Before the near plane, and within the picture.
            if clip.w > clip.z && clip.xy().abs().cmple(Vec2::splat(clip.w)).all() {
                let at = (clip.xy() / clip.w * Vec2::new(0.5, -0.5) + 0.5) * self.size;
                let dot = Rect::from_center_size(Pos2::new(at.x, at.y), egui::Vec2::splat(DOT));
                mesh.add_colored_rect(dot, *color);
            }
        }
        self.painter.add(Shape::mesh(mesh));
    }
}

/// So far toward a corner as a lens that bends sees, at a distance.
fn bent_corner(camera: &CameraSensor, view: &View, at: Vec2, distance: f32) -> Vec3 {
    let size = DVec2::new(camera.size.0.into(), camera.size.1.into());
    let (middle, corner) = (size / 2.0 - 0.5, at.as_dvec2() * size - 0.5);
    let toward = |part: i32| middle.lerp(corner, f64::from(part) / 20.0);
    let seen = (0..=20).rev().find_map(|part| camera.direction(toward(part).x, toward(part).y));
    let ahead = seen.unwrap_or(DVec3::Z).normalize().as_vec3() * distance;
    view.world_from_view.transform_point3(Vec3::new(ahead.x, -ahead.y, -ahead.z))
}
