//! Sensors over the scene: frusta of cameras, points of lidars.

use super::overlay::{self, on_screen};
use super::picking::point_at;
use super::sensors::{Choice, SensorViews};
use crate::data::pictures::{PointValue, rgb_of_number};
use crate::sense::{LidarCapture, sensor_names};
use bevy_ecs::prelude::*;
use egui::{Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke};
use glam::{Affine3A, DVec2, DVec3, Mat4, Vec2, Vec3, Vec4Swizzles};
use systems::draw::View;
use systems::sensors::{CameraSensor, Classes, Sensor, SensorKind};
use systems::space::GlobalTransform;
use systems::space::origin::Origin;

/// Metres that frusta are drawn long.
const LENGTH: f32 = 3.0;
/// Of the mark at a sensor without a frustum, metres.
const MARK: f32 = 0.25;
/// Points across a dot.
const DOT: f32 = 2.0;
/// Of a lidar: projected, painted and uploaded in each frame.
const MOST_DOTS: usize = 60_000;

/// The points of a lidar as they are drawn.
pub struct Dots {
    /// What places count from: the scene's coordinates.
    from: DVec3,
    places: Vec<(Vec3, Color32)>,
    /// Of the beams each so-many-th is drawn.
    pub every: usize,
}

/// The greatest one (Euclid).
fn common_factor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_factor(b, a % b) }
}

impl Dots {
    /// Of the returns of a scan, with the colours of a choice.
    pub fn new(lidar: &LidarCapture, choice: Option<Choice>, classes: &Classes) -> Self {
        let by = if let Some(Choice::Points(by)) = choice { by } else { PointValue::Height };
        let colors = by.colors(lidar, classes).colors;
        let (from, rings) = (lidar.poses[1].translation, lidar.rings());
        // No ring is left out: the steps have no factor in common with their number.
        let least = lidar.scan.len().div_ceil(MOST_DOTS).max(1);
        let every = (least..).find(|&every| common_factor(every, rings) == 1).unwrap_or(least);
        let columns = (0..lidar.columns.count).map(|i| (i as usize * rings, lidar.scene_from_column(i)));
        let places = columns.flat_map(|(first, scene_from_column)| {
            let beams = (first..first + rings).filter(|i| i.is_multiple_of(every) && lidar.scan.hit[*i] != 0);
            let colors = &colors;
            beams.map(move |i| {
                let place = scene_from_column.transform_point3(Vec3::from(lidar.scan.xyz[i]).as_dvec3()) - from;
                let [r, g, b] = colors[i];
                (place.as_vec3(), Color32::from_rgb(r, g, b))
            })
        });
        Self { from, places: places.collect(), every }
    }
}

/// Where points of the world are on the screen.
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

    /// What a camera sees up to [`LENGTH`], with a roof where its upper side is.
    fn frustum(&self, camera: &CameraSensor, world_from_camera: &Affine3A, color: Color32, name: &str) {
        let view = View::new(world_from_camera, &camera.camera(), camera.size.0, camera.size.1);
        let far = LENGTH.max(2.0 * camera.near).min(camera.far);
        let size = Vec2::new(camera.size.0 as f32, camera.size.1 as f32);
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let place = |at: Vec2, depth: f32| match camera.lens.bends() {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sense::{LidarScan, Pose};
    use glam::DQuat;
    use systems::sensors::LidarSensor;

    #[test]
    fn dots_are_where_their_columns_were() {
        // Two columns of one beam, 2 m ahead of a lidar that goes 4 m along X, far from the origin, and turns by 90°.
        let lidar = LidarSensor { columns: 2, hz: 1.0, ..LidarSensor::default() };
        let columns = lidar.columns_between(0, 1, 1.0);
        let begin = Pose { translation: DVec3::new(1e6, 0.0, 0.0), rotation: DQuat::IDENTITY };
        let end = Pose {
            translation: DVec3::new(1e6 + 4.0, 0.0, 0.0),
            rotation: DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2),
        };
        let scan = LidarScan {
            xyz: vec![[2.0, 0.0, 0.0]; 2],
            range: vec![2.0; 2],
            intensity: vec![1.0; 2],
            ring: vec![0; 2],
            time: vec![0.0, 0.5],
            entity: vec![0; 2],
            hit: vec![1, 1],
        };
        let capture = LidarCapture { scan, columns, poses: [begin, end], ..LidarCapture::default() };
        let dots = Dots::new(&capture, None, &Classes::default());
        let places: Vec<DVec3> = dots.places.iter().map(|(place, _)| dots.from + place.as_dvec3()).collect();
        // The second is fired half-way, turned by 45°.
        let aside = 2.0 * std::f64::consts::FRAC_1_SQRT_2;
        let expected = [DVec3::new(1e6, 0.0, 2.0), DVec3::new(1e6 + 2.0 + aside, 0.0, aside)];
        // Places count from the sensor: they round as numbers up to 4 do.
        assert!(places.iter().zip(&expected).all(|(place, at)| place.abs_diff_eq(*at, 1e-6)), "{places:?}");
    }

    #[test]
    fn of_many_beams_some_are_drawn_from_every_ring() {
        let count = 4 * MOST_DOTS;
        let rings = 64;
        let lidar = LidarSensor { columns: count as u32 / rings, hz: 1.0, ..LidarSensor::default() };
        let columns = lidar.columns_between(0, 1, 1.0);
        let beams = columns.count as usize * rings as usize;
        // Each ring at its own height.
        let scan = LidarScan {
            xyz: (0..beams).map(|i| [1.0, 0.0, (i % 64) as f32]).collect(),
            range: vec![1.0; beams],
            intensity: vec![1.0; beams],
            ring: (0..beams).map(|i| (i % 64) as u16).collect(),
            time: vec![0.0; beams],
            entity: vec![0; beams],
            hit: vec![1; beams],
        };
        let capture = LidarCapture { scan, columns, ..LidarCapture::default() };
        let dots = Dots::new(&capture, None, &Classes::default());
        assert!(dots.places.len() <= MOST_DOTS && dots.every == 5, "{} of {beams}", dots.places.len());
        let mut heights: Vec<u32> = dots.places.iter().map(|(place, _)| place.y.round() as u32).collect();
        heights.sort_unstable();
        heights.dedup();
        assert_eq!(heights.len(), 64);
    }
}
