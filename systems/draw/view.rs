//! A camera at a place, for a target of some size: what a frame is drawn for.

use super::camera::{Camera, Projection};
use super::environment::Environment;
use super::records::ViewRecord;
use crate::lights::importance::ShadowView;
use crate::space::bounds::Sphere;
use glam::camera::rh::proj::directx as proj;
use glam::{Affine3A, Mat3A, Mat4, Vec3, Vec3A, Vec4};

/// Viewpoint of a frame.
#[derive(Clone, PartialEq, Debug)]
pub struct View {
    /// Rigid: the camera looks down its −Z, +Y up.
    pub world_from_view: Affine3A,
    /// Camera with its projection.
    pub camera: Camera,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

impl View {
    /// A view from a camera entity's place: along its −Z, upright as near to its +Y as can be. Scale, mirrors and shear
    /// are ignored (glTF 2.0, section 3.10).
    pub fn new(world_from_camera: &Affine3A, camera: &Camera, width: u32, height: u32) -> Self {
        let world_from_view = rigid(world_from_camera);
        Self { world_from_view, camera: camera.clone(), width: width.max(1), height: height.max(1) }
    }

    /// The eye, world space.
    pub fn eye(&self) -> Vec3 {
        self.world_from_view.translation.into()
    }

    /// Unit vector of what the camera looks at, world space.
    pub fn direction(&self) -> Vec3 {
        -Vec3::from(self.world_from_view.matrix3.z_axis)
    }

    /// Projection with reversed depth: 1 at the near plane, 0 at the far plane or infinity. Reversed, because the
    /// spacing of floats near 0 then makes up for the perspective division.
    pub fn clip_from_view(&self) -> Mat4 {
        let (near, far) = (self.camera.near, self.camera.far);
        let target_aspect = self.width as f32 / self.height as f32;
        // A camera that asks for a shape gets it whole: the view grows in the other direction.
        let widen = |aspect: Option<f32>| aspect.map_or(1.0, |aspect| (aspect / target_aspect).max(1.0));
        match self.camera.projection {
            Projection::Perspective { fov_y, aspect } => {
                let fov_y = 2.0 * ((fov_y * 0.5).tan() * widen(aspect)).atan();
                if far.is_finite() {
                    proj::perspective(fov_y, target_aspect, far, near)
                } else {
                    proj::perspective_infinite_reverse(fov_y, target_aspect, near)
                }
            }
            Projection::Pinhole { intrinsics, size } => {
                let own = (self.width, self.height);
                intrinsics.scaled(size, own).clip_from_view(own, near, far)
            }
            Projection::Orthographic { half_height, aspect } => {
                let half_height = half_height * widen(aspect);
                let half_width = half_height * target_aspect;
                let far = if far.is_finite() { far } else { near + 10_000.0 };
                proj::orthographic(-half_width, half_width, -half_height, half_height, far, near)
            }
        }
    }

    /// World space to clip space.
    pub fn clip_from_world(&self) -> Mat4 {
        self.clip_from_view() * Mat4::from(self.world_from_view.inverse())
    }

    /// Pixels that a metre covers across the view: at a distance of one metre, or anywhere where the projection is
    /// parallel.
    pub fn pixels_at_1m(&self) -> f32 {
        self.clip_from_view().y_axis.y * 0.5 * self.height as f32
    }

    /// The planes of the view's frustum, world space: inward unit normal and offset, so that a point p is inside where
    /// dot(normal, p) + offset ≥ 0 for all six; (0, 0, 0, 1) for a far plane at infinity. From the rows of the
    /// projection (Gribb and Hartmann: "Fast Extraction of Viewing Frustum Planes from the World-View-Projection
    /// Matrix", 2001).
    pub fn frustum_planes(&self) -> [Vec4; 6] {
        let rows = self.clip_from_world().transpose();
        let [x, y, z, w] = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis];
        [w + x, w - x, w + y, w - y, w - z, z].map(|plane| {
            let length = plane.truncate().length();
            if length > 1e-12 { plane / length } else { Vec4::W }
        })
    }

    /// Part of the view that decides which lights have a shadow map.
    pub fn shadow_view(&self, environment: &Environment) -> ShadowView {
        let [left, right, bottom, top, near, _] = self.frustum_planes();
        ShadowView { eye: self.eye(), planes: [left, right, bottom, top, near], exposure: environment.exposure }
    }

    /// Constants of this view, for the shaders.
    pub fn record(&self, environment: &Environment, picked_entity: Option<u32>) -> ViewRecord {
        let clip_from_world = self.clip_from_world();
        let clip_from_eye = self.clip_from_view() * Mat4::from_mat3a(self.world_from_view.matrix3.inverse());
        ViewRecord {
            clip_from_world: clip_from_world.to_cols_array_2d(),
            clip_from_eye: clip_from_eye.to_cols_array_2d(),
            eye_from_clip: clip_from_eye.inverse().to_cols_array_2d(),
            eye: self.eye().to_array(),
            parallel: matches!(self.camera.projection, Projection::Orthographic { .. }).into(),
            toward_eye: (-self.direction()).to_array(),
            exposure: environment.exposure,
            ambient: environment.ambient.to_array(),
            picked_entity: picked_entity.unwrap_or(u32::MAX),
            zenith: environment.zenith.to_array(),
            horizon: environment.horizon.to_array(),
            ground: environment.ground.to_array(),
            ..ViewRecord::default()
        }
    }
}

/// A place without scale, mirror and shear: the axis Z keeps its direction, Y the nearest at a right angle to it. An
/// axis without length gets a direction that suits the others.
pub fn rigid(world_from_local: &Affine3A) -> Affine3A {
    let m = world_from_local.matrix3;
    let back = m.z_axis.try_normalize().or_else(|| m.x_axis.cross(m.y_axis).try_normalize()).unwrap_or(Vec3A::Z);
    let up = m.y_axis.reject_from_normalized(back).try_normalize().or_else(|| back.cross(m.x_axis).try_normalize());
    let up = up.unwrap_or_else(|| back.any_orthonormal_vector());
    Affine3A { matrix3: Mat3A::from_cols(up.cross(back), up, back), translation: world_from_local.translation }
}

/// Tells if a sphere, world space, intersects a view frustum ([`View::frustum_planes`]), a little enlarged.
/// `in_frustum` of shaders/cull.wgsl is its twin.
pub fn in_frustum(planes: &[Vec4; 6], sphere: Sphere) -> bool {
    // Room for rounding, which grows with the distance from the origin.
    let reach = -(sphere.radius * 1.001 + 1e-6 * sphere.center.length());
    planes.iter().all(|plane| plane.truncate().dot(sphere.center) + plane.w >= reach)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(camera: Camera, z: f32) -> f32 {
        let view = View::new(&Affine3A::IDENTITY, &camera, 200, 100);
        let clip = view.clip_from_world() * Vec4::new(0.0, 0.0, z, 1.0);
        clip.z / clip.w
    }

    #[test]
    fn depth_is_one_at_the_near_plane_and_falls_to_zero() {
        let perspective = Camera { near: 0.5, ..Camera::default() };
        assert!((depth(perspective.clone(), -0.5) - 1.0).abs() < 1e-6);
        assert!(depth(perspective.clone(), -1e6) < 1e-5);
        let finite = Camera { far: 50.0, ..perspective };
        assert!((depth(finite.clone(), -0.5) - 1.0).abs() < 1e-6 && depth(finite.clone(), -50.0).abs() < 1e-6);
        let parallel = Camera { projection: Projection::Orthographic { half_height: 2.0, aspect: None }, ..finite };
        assert!((depth(parallel.clone(), -0.5) - 1.0).abs() < 1e-6 && depth(parallel, -50.0).abs() < 1e-6);
    }

    #[test]
    fn points_inside_the_frustum_are_those_that_the_projection_keeps() {
        let place = Affine3A::from_translation(Vec3::new(30.0, -4.0, 7.0)) * Affine3A::from_rotation_y(0.7);
        let parallel =
            Camera { projection: Projection::Orthographic { half_height: 9.0, aspect: None }, ..Camera::default() };
        for camera in [Camera::default(), Camera { far: 40.0, ..Camera::default() }, parallel] {
            let view = View::new(&place, &camera, 160, 90);
            let (planes, clip_from_world) = (view.frustum_planes(), view.clip_from_world());
            let mut inside = 0;
            for i in 0..4000 {
                let spread = Vec3::new((i as f32 * 0.37).sin(), (i as f32 * 0.91).sin(), (i as f32 * 0.53).cos());
                let point = (view.eye() + spread * 60.0).extend(1.0);
                let clip = clip_from_world * point;
                let kept = clip.x.abs() <= clip.w && clip.y.abs() <= clip.w && (0.0..=clip.w).contains(&clip.z);
                assert_eq!(planes.iter().all(|plane| plane.dot(point) >= 0.0), kept, "{point}");
                inside += usize::from(kept);
            }
            assert!((10..3000).contains(&inside), "{inside}");
        }
    }

    /// In a narrower target its width fits, in a wider one its height; one without a shape keeps its height.
    #[test]
    fn a_camera_with_a_shape_is_seen_whole_in_every_target() {
        let half_height = 0.5f32.tan();
        for aspect in [Some(2.0), Some(0.5), None] {
            let perspective = Projection::Perspective { fov_y: 1.0, aspect };
            for projection in [perspective, Projection::Orthographic { half_height, aspect }] {
                let camera = Camera { projection, ..Camera::default() };
                for (width, height) in [(100, 100), (100, 300), (300, 100), (200, 100), (100, 200)] {
                    let clip_from_world = View::new(&Affine3A::IDENTITY, &camera, width, height).clip_from_world();
                    let clip = clip_from_world * Vec4::new(aspect.unwrap_or(0.0) * half_height, half_height, -1.0, 1.0);
                    let corner = clip.truncate() / clip.w;
                    // What is to fit touches a border, and nothing of it is outside.
                    assert!((corner.x.max(corner.y) - 1.0).abs() < 1e-5, "{projection:?} {width}x{height}: {corner}");
                }
            }
        }
    }

    #[test]
    fn a_camera_looks_where_its_z_axis_points_whatever_its_parents_do_to_it() {
        let turned = Affine3A::from_rotation_y(0.7) * Affine3A::from_rotation_x(-0.4);
        for scale in [Vec3::new(3.0, 1.0, 0.5), Vec3::new(-2.0, 1.0, 1.0), Vec3::splat(-1.0), Vec3::new(1.0, 5.0, 0.0)]
        {
            let place = Affine3A::from_translation(Vec3::ONE) * Affine3A::from_scale(scale) * turned;
            let view = View::new(&place, &Camera::default(), 64, 64);
            let ahead = place.transform_vector3(Vec3::NEG_Z).normalize();
            assert!(view.direction().abs_diff_eq(ahead, 1e-6), "{scale}: {} for {ahead}", view.direction());
            assert_eq!(view.eye(), Vec3::ONE);
            let axes = view.world_from_view.matrix3;
            assert!((axes.transpose() * axes).abs_diff_eq(Mat3A::IDENTITY, 1e-6) && axes.determinant() > 0.0);
            // Upright: its Y has nothing to either side.
            let up = place.transform_vector3(Vec3::Y);
            assert!(up.dot(axes.x_axis.into()).abs() < 1e-5 && up.dot(axes.y_axis.into()) > 0.0, "{scale}");
        }
        // Nothing to go by.
        let nowhere = View::new(&Affine3A::from_scale(Vec3::ZERO), &Camera::default(), 64, 64);
        assert!(nowhere.world_from_view.matrix3.abs_diff_eq(Mat3A::IDENTITY, 1e-6), "{nowhere:?}");
    }
}
