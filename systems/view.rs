//! A camera at a place, for a target of some size: what a frame is drawn for.

use crate::components::{Camera, Environment, Projection};
use crate::draw_list::ViewRecord;
use glam::camera::rh::proj::directx as proj;
use glam::{Affine3A, Mat4, Vec3};

/// Where a frame is seen from.
#[derive(Clone, PartialEq, Debug)]
pub struct View {
    /// Rigid: the camera looks down its −Z, +Y up.
    pub world_from_view: Affine3A,
    /// How it projects.
    pub camera: Camera,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

impl View {
    /// A view from a camera entity's transform; its scale is ignored.
    pub fn new(world_from_camera: &Affine3A, camera: &Camera, width: u32, height: u32) -> Self {
        let (_, rotation, translation) = world_from_camera.to_scale_rotation_translation();
        let world_from_view = Affine3A::from_rotation_translation(rotation, translation);
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
        match self.camera.projection {
            Projection::Perspective { fov_y, aspect } => {
                // A camera that asks for a shape gets it whole: the view grows in the other direction.
                let widen = aspect.map_or(1.0, |aspect| (aspect / target_aspect).max(1.0));
                let fov_y = 2.0 * ((fov_y * 0.5).tan() * widen).atan();
                if far.is_finite() {
                    proj::perspective(fov_y, target_aspect, far, near)
                } else {
                    proj::perspective_infinite_reverse(fov_y, target_aspect, near)
                }
            }
            Projection::Orthographic { half_height } => {
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

    /// What the shaders read of this view.
    pub fn record(&self, environment: &Environment, light_count: u32, picked_entity: Option<u32>) -> ViewRecord {
        let clip_from_world = self.clip_from_world();
        ViewRecord {
            clip_from_world: clip_from_world.to_cols_array_2d(),
            world_from_clip: clip_from_world.inverse().to_cols_array_2d(),
            eye: self.eye().to_array(),
            light_count,
            toward_eye: (-self.direction()).to_array(),
            parallel: matches!(self.camera.projection, Projection::Orthographic { .. }).into(),
            ambient: environment.ambient.to_array(),
            exposure: environment.exposure,
            zenith: environment.zenith.to_array(),
            picked_entity: picked_entity.unwrap_or(u32::MAX),
            horizon: environment.horizon.to_array(),
            pad0: 0,
            ground: environment.ground.to_array(),
            pad1: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4;

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
        let parallel = Camera { projection: Projection::Orthographic { half_height: 2.0 }, ..finite };
        assert!((depth(parallel.clone(), -0.5) - 1.0).abs() < 1e-6 && depth(parallel, -50.0).abs() < 1e-6);
    }

    #[test]
    fn a_camera_with_a_shape_is_seen_whole_in_a_narrower_target() {
        let projection = Projection::Perspective { fov_y: 1.0, aspect: Some(2.0) };
        let camera = Camera { projection, ..Camera::default() };
        let right = Vec4::new(2.0 * 0.5f32.tan(), 0.0, -1.0, 1.0);
        let clip = View::new(&Affine3A::IDENTITY, &camera, 100, 100).clip_from_world() * right;
        assert!((clip.x / clip.w - 1.0).abs() < 1e-5);
    }
}
