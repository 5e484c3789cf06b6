//! Sides of the layers of the shadow maps: as many texels as a view can show.

use super::sun_levels::LOOKED_UP;
use crate::renderer::plan::view_plan::ViewPlan;
use std::f32::consts::SQRT_2;
use systems::draw::Projection;

/// Texels along a side of a layer, ascending: in whole thirds for the faces of lamps, and in whole eighths for the grid
/// of a sun's levels.
pub(crate) const SIDES: [u32; 3] = [192, 384, 768];

/// Chooses the side of the layers that a view reads, by its own size and lens alone. It is the least whose texels are no
/// wider than a pixel's diagonal where a level of a sun is looked up alone; or the most that there is.
pub(crate) fn side_for(ViewPlan { view, settings }: &ViewPlan) -> u32 {
    // Pixels that a metre covers at a distance of one; of a parallel view as if its corners were so far away.
    let pixels = match view.camera.projection {
        Projection::Orthographic { .. } => 0.5 * (view.width as f32).hypot(view.height as f32),
        Projection::Perspective { .. } | Projection::Pinhole { .. } => view.pixels_at_1m(),
    };
    // Texels are two half widths over the side, and the nearest place that has no finer level is half as far away as
    // the farthest.
    let least = 2.0 * pixels / (0.5 * LOOKED_UP[1] * SQRT_2 * settings.oversampling.max(1) as f32);
    let [.., most] = SIDES;
    SIDES.into_iter().find(|&side| side as f32 >= least).unwrap_or(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::plan::settings::Settings;
    use glam::Affine3A;
    use systems::draw::{Camera, View};

    #[test]
    fn a_small_picture_has_coarse_layers_and_a_narrow_lens_fine_ones() {
        let perspective = |degrees: f32| Projection::Perspective { fov_y: degrees.to_radians(), aspect: None };
        let parallel = Projection::Orthographic { half_height: 3.0, aspect: None };
        for (projection, size, side) in [
            // 46 pixels to a metre at a distance of one, 60, 73, 104, 238 and 624.
            (perspective(70.0), (64, 64), 192),
            (perspective(70.0), (84, 84), 384),
            (perspective(60.0), (84, 84), 384),
            (perspective(60.0), (160, 120), 768),
            (perspective(20.0), (84, 84), 768),
            (perspective(60.0), (1280, 720), 768),
            (parallel, (70, 70), 192),
            (parallel, (84, 84), 384),
            (parallel, (84, 200), 768),
        ] {
            let view = View::new(&Affine3A::IDENTITY, &Camera { projection, ..Camera::default() }, size.0, size.1);
            let plan = ViewPlan { view, settings: Settings::default() };
            assert_eq!(side_for(&plan), side, "{size:?}");
        }
    }
}
