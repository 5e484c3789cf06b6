//! The free camera. Until it is moved, the view is the scene camera's, exactly; after that it is a [`Pose`] of
//! its own, and the scene's entities stay as they are.

use glam::{Affine3A, Quat, Vec2, Vec3};
use systems::draw::{Camera, Projection, View};
use systems::space::Sphere;

/// Radians per pixel of dragging.
const TURN: f32 = 0.005;
/// Radians between the view and straight up or down that are left.
const POLE: f32 = 0.01;
/// Distance to the pivot that one notch of the wheel leaves.
const ZOOM: f32 = 0.85;
/// Factor on the flying speed with Shift.
const FAST: f32 = 5.0;

/// Either the scene's camera or a pose of its own.
#[derive(Clone, Debug, Default)]
pub struct Controller {
    free: Option<Pose>,
}

/// A camera that was moved.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pose {
    /// World space.
    pub eye: Vec3,
    /// World from view.
    pub rotation: Quat,
    /// Point that it turns around and zooms to, world space.
    pub pivot: Vec3,
    /// Times the height of a parallel projection.
    pub zoom: f32,
}

impl Controller {
    /// View to draw, given that of the scene's camera.
    pub fn view(&self, scene: &View) -> View {
        let Some(pose) = &self.free else { return scene.clone() };
        let mut camera = scene.camera.clone();
        if let Projection::Orthographic { half_height, .. } = &mut camera.projection {
            *half_height *= pose.zoom;
        }
        let world_from_view = Affine3A::from_rotation_translation(pose.rotation, pose.eye);
        View::new(&world_from_view, &camera, scene.width, scene.height)
    }

    /// The pose to move: what it is, or the current view's where it was not moved yet.
    pub fn grab(&mut self, view: &View, pivot: Vec3) -> &mut Pose {
        self.free.get_or_insert_with(|| Pose {
            eye: view.eye(),
            rotation: Quat::from_mat3a(&view.world_from_view.matrix3).normalize(),
            pivot,
            zoom: 1.0,
        })
    }

    /// The pose, if it was moved.
    pub fn pose(&self) -> Option<&Pose> {
        self.free.as_ref()
    }

    /// Back to the scene's camera.
    pub fn reset(&mut self) {
        self.free = None;
    }
}

impl Pose {
    /// Turns about the pivot, which keeps its place in the picture. Pixels.
    pub fn orbit(&mut self, pixels: Vec2) {
        let before = self.rotation;
        self.look(pixels);
        self.eye = self.pivot + self.rotation * (before.inverse() * (self.eye - self.pivot));
    }

    /// Turns in place: about the world's up, and up and down short of the poles. A roll that the camera has stays.
    pub fn look(&mut self, pixels: Vec2) {
        let forward = self.rotation * Vec3::NEG_Z;
        let elevation = forward.y.clamp(-1.0, 1.0).asin();
        let most = std::f32::consts::FRAC_PI_2 - POLE;
        // A scene's camera may itself look straight down: from there one turns away, but is not moved at once.
        let (low, high) = ((-most).min(elevation), most.max(elevation));
        let pitch = (elevation - pixels.y * TURN).clamp(low, high) - elevation;
        let right = forward.cross(Vec3::Y).try_normalize().unwrap_or(self.rotation * Vec3::X);
        let turn = Quat::from_rotation_y(-pixels.x * TURN) * Quat::from_axis_angle(right, pitch);
        self.rotation = (turn * self.rotation).normalize();
    }

    /// Moves sideways so that what is at the pivot's depth follows the pointer. Pixels.
    pub fn pan(&mut self, pixels: Vec2, view: &View) {
        let depth = (self.pivot - self.eye).dot(self.rotation * Vec3::NEG_Z).max(view.camera.near);
        let clip_height = match view.camera.projection {
            Projection::Perspective { .. } | Projection::Pinhole { .. } => depth,
            Projection::Orthographic { .. } => 1.0,
        };
        let metres_per_pixel = 2.0 * clip_height / (view.clip_from_view().y_axis.y * view.height as f32);
        let step = self.rotation * Vec3::new(-pixels.x, pixels.y, 0.0) * metres_per_pixel;
        self.eye += step;
        self.pivot += step;
    }

    /// Goes towards the pivot (or away), by a part of the distance that is left.
    pub fn zoom(&mut self, notches: f32, camera: &Camera) {
        let factor = ZOOM.powf(notches.clamp(-20.0, 20.0));
        match camera.projection {
            Projection::Orthographic { .. } => self.zoom = (self.zoom * factor).clamp(1e-4, 1e4),
            Projection::Perspective { .. } | Projection::Pinhole { .. } => {
                let distance = self.eye.distance(self.pivot);
                let nearest = (camera.near * 2.0).min(distance);
                let left = (distance * factor).clamp(nearest, 1e7);
                if distance > 0.0 {
                    self.eye = self.pivot + (self.eye - self.pivot) * (left / distance);
                }
            }
        }
    }

    /// Goes to where a sphere fills a good part of the picture, without turning.
    pub fn go_to(&mut self, sphere: Sphere) {
        self.pivot = sphere.center;
        self.eye = sphere.center - self.rotation * Vec3::NEG_Z * (sphere.radius * 3.5).max(1e-3);
    }

    /// Flies along the camera's own axes; `speed` in metres per second. The pivot comes along.
    pub fn fly(&mut self, direction: Vec3, fast: bool, speed: f32, seconds: f32) {
        let speed = if fast { speed * FAST } else { speed };
        let step = self.rotation * direction.normalize_or_zero() * speed * seconds;
        self.eye += step;
        self.pivot += step;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4Swizzles;
    use systems::space::Transform;

    fn view() -> View {
        let at = Transform::from_xyz(3.0, 2.0, 5.0).looking_at(Vec3::Y, Vec3::Y);
        View::new(&at.compute_affine(), &Camera::default(), 320, 180)
    }

    fn pose() -> Pose {
        *Controller::default().grab(&view(), Vec3::new(0.5, 0.5, 0.0))
    }

    fn on_screen(pose: &Pose, point: Vec3) -> Vec2 {
        let controller = Controller { free: Some(*pose) };
        let view = controller.view(&view());
        let clip = view.clip_from_world() * point.extend(1.0);
        (clip.xy() / clip.w * Vec2::new(0.5, -0.5) + 0.5) * Vec2::new(320.0, 180.0)
    }

    #[test]
    fn the_view_is_the_scene_camera_exactly_until_somebody_moves() {
        let mut controller = Controller::default();
        let at = Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), Quat::from_rotation_x(0.3), Vec3::ONE);
        let scene = View::new(&at, &Camera::default(), 64, 36);
        assert_eq!(controller.view(&scene), scene);
        controller.grab(&scene, Vec3::ZERO).orbit(Vec2::new(10.0, 0.0));
        assert_ne!(controller.view(&scene), scene);
        controller.reset();
        assert_eq!(controller.view(&scene), scene);
    }

    #[test]
    fn orbiting_keeps_the_distance_and_the_pivots_place_in_the_picture() {
        let before = pose();
        let mut after = before;
        after.orbit(Vec2::new(120.0, -35.0));
        assert!((after.eye.distance(after.pivot) - before.eye.distance(before.pivot)).abs() < 1e-4);
        assert!(on_screen(&after, after.pivot).distance(on_screen(&before, before.pivot)) < 0.05);
        assert!(after.eye.distance(before.eye) > 1.0);
    }

    #[test]
    fn looking_stops_short_of_the_pole_and_stays_upright() {
        let mut pose = pose();
        for _ in 0..100 {
            pose.look(Vec2::new(7.0, -100.0));
        }
        let (forward, right) = (pose.rotation * Vec3::NEG_Z, pose.rotation * Vec3::X);
        assert!(forward.y > 0.99 && forward.y < 1.0 && right.y.abs() < 1e-3, "{forward} {right}");
    }

    #[test]
    fn panning_moves_the_pivot_with_the_pointer() {
        let before = pose();
        let mut after = before;
        after.pan(Vec2::new(20.0, -10.0), &view());
        assert_eq!(after.rotation, before.rotation);
        // The old pivot is seen where the pointer went.
        let moved = on_screen(&after, before.pivot) - on_screen(&before, before.pivot);
        assert!(moved.distance(Vec2::new(20.0, -10.0)) < 0.1, "{moved}");
    }

    #[test]
    fn zooming_approaches_the_pivot_and_never_passes_it() {
        let before = pose();
        let mut after = before;
        after.zoom(1.0, &Camera::default());
        let ratio = after.eye.distance(after.pivot) / before.eye.distance(before.pivot);
        assert!((ratio - ZOOM).abs() < 1e-3);
        after.zoom(1000.0, &Camera::default());
        assert!((after.eye - after.pivot).dot(before.eye - before.pivot) > 0.0);
    }

    #[test]
    fn a_parallel_projection_zooms_by_its_height() {
        let camera =
            Camera { projection: Projection::Orthographic { half_height: 4.0, aspect: None }, ..Camera::default() };
        let mut controller = Controller::default();
        let scene = View::new(&Affine3A::IDENTITY, &camera, 64, 64);
        let pose = controller.grab(&scene, Vec3::NEG_Z);
        pose.zoom(2.0, &camera);
        assert_eq!(pose.eye, Vec3::ZERO);
        let zoomed = controller.view(&scene).camera.projection;
        assert!(matches!(zoomed, Projection::Orthographic { half_height, .. } if half_height < 3.0));
    }

    #[test]
    fn going_to_a_sphere_puts_it_in_the_middle() {
        let mut pose = pose();
        pose.go_to(Sphere { center: Vec3::new(9.0, 1.0, -4.0), radius: 2.0 });
        assert!(on_screen(&pose, Vec3::new(9.0, 1.0, -4.0)).distance(Vec2::new(160.0, 90.0)) < 1e-2);
        assert!((pose.eye.distance(pose.pivot) - 7.0).abs() < 1e-4);
    }

    #[test]
    fn flying_goes_along_the_cameras_own_axes() {
        let mut pose = pose();
        let (eye, forward) = (pose.eye, pose.rotation * Vec3::NEG_Z);
        pose.fly(Vec3::NEG_Z, true, 2.0, 0.5);
        assert!((pose.eye - eye).distance(forward * FAST) < 1e-5);
    }
}
