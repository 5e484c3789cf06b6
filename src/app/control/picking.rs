//! Picking under the pointer, from the ids and depths of the last frame.

use crate::renderer::{Picked, SingleView};
use glam::{Vec2, Vec3, Vec4Swizzles};
use systems::draw::{Projection, View};

/// A point of the scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// The entity's index.
    pub entity: u32,
    /// World space.
    pub point: Vec3,
}

/// Finds the surface that the last frame shows at a pixel. Waits for the GPU: for clicks, not for every frame.
pub fn pick(renderer: &mut SingleView, view: &View, at: Vec2) -> Option<Hit> {
    let pixel = at.cmpge(Vec2::ZERO).all().then(|| at.as_uvec2())?;
    let Picked { entity, depth } = renderer.pick(pixel)?;
    Some(Hit { entity, point: point_at(view, at.floor() + 0.5, depth) })
}

/// The point seen at a place of the picture, in pixels from its corner, at a distance along the viewing direction;
/// world space.
pub fn point_at(view: &View, pixel: Vec2, depth: f32) -> Vec3 {
    let size = Vec2::new(view.width as f32, view.height as f32);
    let clip = (pixel / size * 2.0 - 1.0) * Vec2::new(1.0, -1.0);
    let clip_from_view = view.clip_from_view();
    let scale = Vec2::new(clip_from_view.x_axis.x, clip_from_view.y_axis.y);
    let across = match view.camera.projection {
        Projection::Perspective { .. } | Projection::Pinhole { .. } => {
            (clip + clip_from_view.z_axis.xy()) / scale * depth
        }
        Projection::Orthographic { .. } => clip / scale,
    };
    view.world_from_view.transform_point3(across.extend(-depth))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Quat};
    use systems::draw::{Camera, Intrinsics};

    #[test]
    fn a_point_is_found_again_from_its_pixel_and_depth() {
        let at = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.4), Vec3::new(1.0, 2.0, 3.0));
        let point = at.transform_point3(Vec3::new(0.6, -0.2, -4.0));
        let intrinsics = Intrinsics { fx: 200.0, fy: 190.0, cx: 130.0, cy: 99.0 };
        let pinhole = Projection::Pinhole { intrinsics, size: (320, 180) };
        let parallel = Projection::Orthographic { half_height: 2.0, aspect: None };
        for projection in [Camera::default().projection, parallel, pinhole] {
            let view = View::new(&at, &Camera { projection, ..Camera::default() }, 320, 180);
            let clip = view.clip_from_world() * point.extend(1.0);
            let pixel = (clip.xy() / clip.w * Vec2::new(0.5, -0.5) + 0.5) * Vec2::new(320.0, 180.0);
            assert!(point_at(&view, pixel, 4.0).distance(point) < 1e-4);
        }
    }
}
