//! The intrinsic parameters of a pinhole camera, in pixels.

use glam::{DMat3, DVec2, DVec3, Mat4, Vec4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Focal lengths and principal point of a pinhole camera, in pixels of a picture of some size.
///
/// Pixel (u, v) has its centre at integers, u to the right and v down: a picture of width W and height H covers
/// [−½, W − ½] × [−½, H − ½] (OpenCV, "Camera Calibration and 3D Reconstruction"). A point (x, y, z) in camera axes, X
/// right, Y down, Z forward, is at u = fx·x/z + cx, v = fy·y/z + cy.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Intrinsics {
    /// Horizontal focal length.
    #[schemars(range(min = 1e-3, max = Self::MOST_PIXELS), extend("unit" = "px"))]
    pub fx: f64,
    /// Vertical focal length.
    #[schemars(range(min = 1e-3, max = Self::MOST_PIXELS), extend("unit" = "px"))]
    pub fy: f64,
    /// Horizontal position of the principal point, from the centre of the first pixel.
    #[schemars(range(min = -Self::MOST_PIXELS, max = Self::MOST_PIXELS), extend("unit" = "px"))]
    pub cx: f64,
    /// Vertical position of the principal point.
    #[schemars(range(min = -Self::MOST_PIXELS, max = Self::MOST_PIXELS), extend("unit" = "px"))]
    pub cy: f64,
}

impl Intrinsics {
    /// Largest focal length, and farthest principal point: a hundred times the largest picture's side.
    pub const MOST_PIXELS: f64 = 1_638_400.0;

    /// Makes intrinsics of square pixels and a principal point in the middle. f = H / (2 tan(fov_y / 2)), cx = (W −
    /// 1)/2; `fov_y`: vertical field of view, radians.
    pub fn from_fov_y(fov_y: f64, width: u32, height: u32) -> Self {
        let f = f64::from(height) / (2.0 * (fov_y / 2.0).tan());
        Self { fx: f, fy: f, cx: (f64::from(width) - 1.0) / 2.0, cy: (f64::from(height) - 1.0) / 2.0 }
    }

    /// For the same picture scaled to another size: whole, in its middle, its pixels as square as they were.
    pub fn scaled(self, from: (u32, u32), to: (u32, u32)) -> Self {
        let size = |(width, height): (u32, u32)| DVec2::new(f64::from(width.max(1)), f64::from(height.max(1)));
        let (from, to) = (size(from), size(to));
        let scale = (to / from).min_element();
        let principal = (DVec2::new(self.cx, self.cy) + 0.5) * scale - 0.5 + (to - from * scale) / 2.0;
        Self { fx: self.fx * scale, fy: self.fy * scale, cx: principal.x, cy: principal.y }
    }

    /// K, with (u, v, 1)·z = K·(x, y, z).
    pub fn matrix(self) -> DMat3 {
        DMat3::from_cols(
            DVec3::new(self.fx, 0.0, 0.0),
            DVec3::new(0.0, self.fy, 0.0),
            DVec3::new(self.cx, self.cy, 1.0),
        )
    }

    /// K⁻¹·(u, v, 1): the direction of a pixel in camera axes, 1 along the optical axis.
    pub fn direction(self, u: f64, v: f64) -> DVec3 {
        DVec3::new((u - self.cx) / self.fx, (v - self.cy) / self.fy, 1.0)
    }

    /// From view space (x right, y up, looking along −z) to clip space, with reversed depth: 1 at the near plane, 0 at
    /// the far plane or infinity.
    ///
    /// ```text
    /// clip.x = (2 fx/W)·x + (1 − (2 cx + 1)/W)·z
    /// clip.y = (2 fy/H)·y + ((2 cy + 1)/H − 1)·z
    /// clip.z = near;   with a far plane near/(far − near)·(z + far)
    /// clip.w = −z
    /// ```
    pub fn clip_from_view(self, (width, height): (u32, u32), near: f32, far: f32) -> Mat4 {
        let (w, h) = (f64::from(width), f64::from(height));
        let across = 1.0 - (2.0 * self.cx + 1.0) / w;
        let down = (2.0 * self.cy + 1.0) / h - 1.0;
        let (near, far) = (f64::from(near), f64::from(far));
        let (z, one) = if far.is_finite() { (near / (far - near), near * far / (far - near)) } else { (0.0, near) };
        Mat4::from_cols(
            Vec4::new((2.0 * self.fx / w) as f32, 0.0, 0.0, 0.0),
            Vec4::new(0.0, (2.0 * self.fy / h) as f32, 0.0, 0.0),
            Vec4::new(across as f32, down as f32, z as f32, -1.0),
            Vec4::new(0.0, 0.0, one as f32, 0.0),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point at a known pixel lands there, for principal points outside the picture too.
    #[test]
    fn a_projected_point_is_at_the_pixel_that_k_says() {
        let size = (1242, 375);
        for (cx, cy) in [(609.5593, 172.854), (620.5, 187.0), (-30.0, 500.0)] {
            let intrinsics = Intrinsics { fx: 721.5377, fy: 700.0, cx, cy };
            for far in [f32::INFINITY, 300.0] {
                let clip_from_view = intrinsics.clip_from_view(size, 0.1, far);
                for camera in [DVec3::new(1.0, -0.5, 4.0), DVec3::new(-3.0, 2.0, 20.0), DVec3::new(0.0, 0.0, 1.0)] {
                    let pixel = intrinsics.matrix() * camera / camera.z;
                    let clip = clip_from_view * Vec4::new(camera.x as f32, -camera.y as f32, -camera.z as f32, 1.0);
                    let ndc = clip / clip.w;
                    let u = (f64::from(ndc.x) + 1.0) / 2.0 * 1242.0 - 0.5;
                    let v = (1.0 - f64::from(ndc.y)) / 2.0 * 375.0 - 0.5;
                    // Sums of a few floats as large as the picture is wide.
                    assert!((u - pixel.x).abs() < 1e-3 && (v - pixel.y).abs() < 1e-3, "{u} {v} for {pixel}");
                    assert!(intrinsics.direction(pixel.x, pixel.y).abs_diff_eq(camera / camera.z, 1e-12));
                }
            }
        }
    }

    #[test]
    fn the_planes_of_depth_are_where_they_are_said_to_be() {
        let intrinsics = Intrinsics::from_fov_y(1.0, 64, 48);
        let depth = |far: f32, z: f32| {
            let clip = intrinsics.clip_from_view((64, 48), 0.5, far) * Vec4::new(0.0, 0.0, -z, 1.0);
            clip.z / clip.w
        };
        assert!((depth(f32::INFINITY, 0.5) - 1.0).abs() < 1e-6 && depth(f32::INFINITY, 1e6) < 1e-6);
        assert!((depth(80.0, 0.5) - 1.0).abs() < 1e-6 && depth(80.0, 80.0).abs() < 1e-6);
    }

    #[test]
    fn a_scaled_picture_is_whole_and_in_the_middle() {
        let own = Intrinsics { fx: 100.0, fy: 110.0, cx: 30.0, cy: 20.0 };
        assert_eq!(own.scaled((64, 48), (64, 48)), own);
        let double = own.scaled((64, 48), (128, 96));
        assert_eq!((double.fx, double.fy, double.cx, double.cy), (200.0, 220.0, 60.5, 40.5));
        // As wide as before, 48 rows above and below.
        assert_eq!(own.scaled((64, 48), (64, 144)), Intrinsics { cy: 68.0, ..own });
    }
}
