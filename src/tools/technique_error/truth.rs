//! The pictures that techniques are measured by: the displaced figure under the same lights, with and without shadows.
//!
//! ```text
//! truth = ambient + Σ (light i is seen from the pixel: 0 or 1) · (the picture by light i alone)
//! ```
//!
//! The renderer draws each light alone at twice the size, one sample per pixel. Depth gives each sample's place, from
//! which a ray goes to each light through the displaced triangles. Four samples are a pixel.

use super::test_scene::{FAINT, Lit, SUN, Shown, TestScene};
use crate::frames::FrameError;
use crate::tools::compare::quarters;
use crate::tools::error::ToolError;
use crate::tools::maps::bake::{Role, Surface, Target};
use crate::tools::maps::{MapError, Raster};
use glam::{Affine3A, Vec3};
use image::RgbImage;
use systems::assets::color::srgb_from_linear;

/// Metres above the surface that rays begin: places have errors of a hundredth of that.
const ABOVE: f32 = 1e-4;

/// The reference.
pub(super) struct Truth {
    /// Linear, a pixel each.
    pub shadowed: Vec<Vec3>,
    /// The same, as if every light that faces the surface reached it.
    pub unshadowed: Vec<Vec3>,
    /// Number of a pixel's four parts that show the figure.
    pub coverage: Vec<u8>,
    /// Sun occluded; `None` where the surface turns away from it.
    pub sun: Vec<Option<bool>>,
}

impl Truth {
    pub fn new(stand: &mut TestScene, (width, height): (u32, u32)) -> Result<Self, ToolError> {
        let size = (2 * width, 2 * height);
        let count = stand.light_count();
        let displaced = Surface::of_mesh(&stand.displaced, &Affine3A::IDENTITY, Role::High)
            .map_err(|message| ToolError::Surface(MapError::refused(stand.displaced.name.as_ref(), message)))?;
        let target = Target::new(&displaced).map_err(ToolError::Surface)?;
        let samples = samples(stand, size)?;
        let fill = |y: usize, row: &mut [f32]| {
            let samples = &samples[y * size.0 as usize..];
            for (sample, seen) in samples.iter().zip(row.chunks_exact_mut(count)) {
                let Some((place, normal)) = *sample else { continue };
                for (light, seen) in seen.iter_mut().enumerate() {
                    let (toward, distance) = stand.toward_light(light, place);
                    *seen = f32::from(!target.is_hit(place + normal * ABOVE, toward, distance));
                }
            }
        };
        let seen = Raster::from_rows((size.0 as usize, size.1 as usize, count), fill, &|_| {});
        let mut shadowed = stand.linear_of_samples(size, Shown::Displaced, Lit::Ambient, 1)?;
        let mut unshadowed = shadowed.clone();
        let mut sun = Vec::new();
        for light in 0..count {
            let alone = stand.linear_of_samples(size, Shown::Displaced, Lit::Only(light), 1)?;
            for (i, &color) in alone.iter().enumerate() {
                unshadowed[i] += color;
                shadowed[i] += color * seen.values[i * count + light];
            }
            if light == SUN {
                let own =
                    alone.iter().enumerate().map(|(i, color)| (color.element_sum(), seen.values[i * count + light]));
                sun = own.collect();
            }
        }
        let mean = |samples: &[Vec3]| quarters(samples, width).map(|s| s.iter().sum::<Vec3>() * 0.25).collect();
        let of_sun = quarters(&sun, width).map(|s| {
            let open: f32 = s.iter().map(|(light, _)| light * 0.25).sum();
            let shadowed: f32 = s.iter().map(|(light, seen)| light * seen * 0.25).sum();
            (open > FAINT).then_some(shadowed < 0.5 * open)
        });
        Ok(Self {
            shadowed: mean(&shadowed),
            unshadowed: mean(&unshadowed),
            coverage: quarters(&samples, width).map(|s| s.iter().flatten().count() as u8).collect(),
            sun: of_sun.collect(),
        })
    }
}

/// Place and shading normal of each pixel that shows the displaced figure.
fn samples(stand: &mut TestScene, size: (u32, u32)) -> Result<Vec<Option<(Vec3, Vec3)>>, FrameError> {
    let Some(outputs) = stand.outputs(size, Shown::Displaced)? else { return Ok(Vec::new()) };
    let view = stand.view(size);
    let (depths, normals) = (outputs.depths(), outputs.normals());
    let clip_from_view = view.clip_from_view();
    let (across, up) = (clip_from_view.x_axis.x, clip_from_view.y_axis.y);
    let sample = |(i, (depth, normal)): (usize, (f32, [f32; 3]))| {
        let (x, y) = (i as u32 % size.0, i as u32 / size.0);
        let ndc = |pixel: u32, side: u32| (pixel as f32 + 0.5) / side as f32 * 2.0 - 1.0;
        let ray = Vec3::new(ndc(x, size.0) / across, -ndc(y, size.1) / up, -1.0);
        depth.is_finite().then(|| (view.world_from_view.transform_point3(ray * depth), Vec3::from(normal)))
    };
    Ok(depths.into_iter().zip(normals).enumerate().map(sample).collect())
}

/// Linear light as a picture: cut at 1, sRGB.
pub(super) fn encoded(linear: &[Vec3], (width, height): (u32, u32)) -> RgbImage {
    let byte = |l: f32| (srgb_from_linear(l.clamp(0.0, 1.0)) * 255.0).round() as u8;
    let bytes = linear.iter().flat_map(|color| color.to_array().map(byte)).collect();
    RgbImage::from_raw(width, height, bytes).unwrap_or_default()
}
