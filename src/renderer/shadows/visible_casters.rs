//! Visibility of casters' shadows in the views. Moving casters whose shadows no view shows need not be drawn in each
//! frame (`layer_casters.rs`).
//!
//! The shadow of a caster's bounding sphere is a cylinder behind it, or, of a lamp, a cone. It ends with the light's
//! range, and with the box around all objects: beyond is nothing that could be dark. It is seen where it meets a view's
//! frustum. (Bittner et al., "Shadow Caster Culling for Efficient Shadow Mapping", I3D 2011, draw a mask of what is
//! seen instead, which leaves out more.)

use super::layer_light::LayerLight;
use super::shadow::Shadow;
use crate::renderer::plan::view_plan::ViewPlan;
use glam::{Vec3, Vec4};
use systems::draw::View;
use systems::space::Sphere;

/// Parameters of a view that decide which shadows it shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceiverView {
    /// World space.
    pub eye: Vec3,
    /// The frustum's planes without the far one, world space: inward unit normal and offset.
    planes: [Vec4; 5],
    /// Metres that what it shows may be off at a distance of one metre: look-ups are that far from their points.
    level_error: f32,
}

/// All that views show.
#[derive(Debug, Default)]
pub(crate) struct VisibleReceivers {
    views: Vec<ReceiverView>,
    /// The corners of a box around all objects, world space.
    bounds: (Vec3, Vec3),
}

impl ReceiverView {
    pub fn new(plan: &ViewPlan) -> Self {
        let level_error = plan.settings.levels.allowed_error(plan.view.pixels_at_1m());
        Self::of(&plan.view, level_error)
    }

    fn of(view: &View, level_error: f32) -> Self {
        let [left, right, bottom, top, near, _] = view.frustum_planes();
        Self { eye: view.eye(), planes: [left, right, bottom, top, near], level_error }
    }

    /// A shadow with room for how far look-ups are from their points.
    fn widened(&self, shadow: Shadow) -> Shadow {
        let Shadow { start: Sphere { center, radius }, growth, .. } = shadow;
        // A parallel view has the same error everywhere, that of a metre.
        let farthest = (center.distance(self.eye) + radius).max(1.0);
        let start = Sphere { center, radius: radius + self.level_error * farthest };
        Shadow { start, growth: growth + self.level_error, ..shadow }
    }
}

impl VisibleReceivers {
    /// `bounds`: of all objects, by corners; `None` where there are none.
    pub fn new(views: impl Iterator<Item = ReceiverView>, bounds: Option<(Vec3, Vec3)>) -> Self {
        Self { views: views.filter(|_| bounds.is_some()).collect(), bounds: bounds.unwrap_or_default() }
    }

    /// Tells if a caster's shadow may fall on something seen, and be looked up in a layer. `caster`: world space.
    pub fn may_show(&self, light: &LayerLight, caster: Sphere) -> bool {
        let Some(shadow) = light.shadow(caster) else { return !self.views.is_empty() };
        self.views.iter().any(|view| self.may_show_in(view, light, &view.widened(shadow)))
    }

    fn may_show_in(&self, view: &ReceiverView, light: &LayerLight, shadow: &Shadow) -> bool {
        let length = self.length(shadow);
        let Shadow { start: Sphere { center, radius }, along, growth, .. } = *shadow;
        // Signed distances are linear along the ray, and so is the radius: the ends decide.
        let is_outside = |plane: &Vec4| {
            let normal = plane.truncate();
            let rate = normal.dot(along) + growth;
            normal.dot(center) + plane.w + radius + if rate > 0.0 { rate * length } else { 0.0 } < 0.0
        };
        let widest = Sphere { center, radius: radius + growth * length };
        !view.planes.iter().any(is_outside) && light.serves(view.eye, widest)
    }

    /// Metres until a shadow has left the box around all objects, or its light's range.
    fn length(&self, shadow: &Shadow) -> f32 {
        let Shadow { start: Sphere { center, radius }, along, growth, length } = *shadow;
        let (min, max) = self.bounds;
        // The sphere's hindmost point leaves a side at its distance over the speed at which it nears that.
        let sides = (0..3).flat_map(|axis| {
            let (speed, at) = (along[axis], center[axis]);
            [(speed, max[axis] - at), (-speed, at - min[axis])]
        });
        let leaves = sides.filter(|&(speed, _)| speed > growth).map(|(speed, way)| (way + radius) / (speed - growth));
        leaves.fold(length, f32::min).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::shadows::lamp_layers::Lamp;
    use crate::renderer::shadows::shadow_layers::{Turn, WIDEST_FILTER};
    use crate::renderer::shadows::sides::SIDES;
    use crate::renderer::shadows::sun_levels::{SunLayer, SunLevel};
    use glam::{Affine3A, Quat};
    use proptest::prelude::*;
    use systems::draw::{Camera, Projection};
    use systems::lights::LightRecord;

    fn vector(reach: f32) -> impl Strategy<Value = Vec3> {
        [-reach..reach, -reach..reach, -reach..reach].prop_map(Vec3::from)
    }

    fn direction() -> impl Strategy<Value = Vec3> {
        vector(1.0).prop_filter_map("too short", |v| (v.length() > 0.1).then(|| v.normalize()))
    }

    /// Generates lamps with and without an end to their range.
    fn lamp() -> impl Strategy<Value = Lamp> {
        (vector(20.0), 1.0_f32..60.0).prop_map(|(position, range)| {
            let inverse_range_squared = if range < 50.0 { (range * range).recip() } else { 0.0 };
            let (position, kind) = (position.into(), LightRecord::POINT);
            Lamp::new(&LightRecord { position, kind, inverse_range_squared, ..LightRecord::default() }, 0.05, SIDES[2])
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// A ray from what is seen to the light that meets a sphere: the sphere's shadow is seen, in the layer that is
        /// looked up there.
        #[test]
        fn what_is_seen_in_a_shadow_shows_it(
            lamp in lamp(), sun in direction(), eye in vector(20.0), looks in direction(),
            points in prop::collection::vec(vector(15.0), 20),
            (at, to, radius) in (0.0_f32..1.0, direction(), 0.01_f32..3.0),
        ) {
            let place = Affine3A::from_rotation_translation(Quat::from_rotation_arc(Vec3::NEG_Z, looks), eye);
            let view = ReceiverView::of(&View::new(&place, &Camera::default(), 160, 90), 1e-3);
            let bounds = (Vec3::splat(-15.0), Vec3::splat(15.0));
            let receivers = VisibleReceivers::new([view].into_iter(), Some(bounds));
            let is_seen = |point: &Vec3| view.planes.iter().all(|plane| plane.truncate().dot(*point) + plane.w >= 0.0);
            for point in points.into_iter().filter(is_seen) {
                // Spheres that the ray touches at least.
                let on_ray = |ray: Vec3| Sphere { center: point + at * ray + 0.99 * radius * to, radius };
                let light = LayerLight::Lamp(lamp);
                if light.reaches(Sphere { center: point, radius: 0.0 }) {
                    prop_assert!(receivers.may_show(&light, on_ray(lamp.position - point)));
                }
                let turn = Turn::new(sun);
                let [x, y, z] = turn.rows();
                // As `visibility` of shaders/shadows.wgsl.
                let across = x.dot(point - eye).abs().max(y.dot(point - eye).abs()) / 6.0;
                let level = across.log2().ceil().max(0.0);
                let blends = across / level.exp2() > 0.8;
                for level in [Some(level as usize), blends.then_some(level as usize + 1)].into_iter().flatten() {
                    let around = SunLevel::around(eye, turn, 768).nth(level).expect("six levels");
                    let light = LayerLight::Sun(SunLayer::new(around, 0.0));
                    prop_assert!(receivers.may_show(&light, on_ray(40.0 * z)), "level {level}");
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// A caster close to a lamp shadows nearly half of all that it lights. The view is narrow, so that it shows
        /// little of it.
        #[test]
        fn the_edge_of_a_wide_shadow_is_seen_up_to_the_end_of_the_range(
            range in 1.0_f32..30.0, way in direction(), beside in direction(), part in 0.1_f32..0.97,
            far in 0.1_f32..1.0, distance in 0.01_f32..0.3, looks in direction(),
        ) {
            // Behind what casts: before it there is no shadow.
            prop_assume!(far * range > distance);
            let record = LightRecord { inverse_range_squared: (range * range).recip(), ..LightRecord::default() };
            let lamp = Lamp::new(&LightRecord { kind: LightRecord::POINT, ..record }, 0.001, SIDES[2]);
            let point = far * range * way;
            // At the cone's edge, within a hundredth of its tangent.
            let aside = beside.reject_from_normalized(way).normalize_or_zero();
            let axis = (way + 0.99 * part.asin().tan() * aside).normalize();
            let caster = Sphere { center: distance * axis, radius: part * distance };
            let place = Affine3A::from_rotation_translation(Quat::from_rotation_arc(Vec3::NEG_Z, looks), point - looks);
            let projection = Projection::Perspective { fov_y: 0.02, aspect: None };
            let view = View::new(&place, &Camera { projection, ..Camera::default() }, 160, 90);
            let bounds = (Vec3::splat(-range), Vec3::splat(range));
            let receivers = VisibleReceivers::new([ReceiverView::of(&view, 0.0)].into_iter(), Some(bounds));
            prop_assert!(receivers.may_show(&LayerLight::Lamp(lamp), caster));
        }
    }

    /// In the world, to the side of what casts: the filter of a sun with a size reads farther than that of a point.
    #[test]
    fn a_shadow_has_room_for_what_filters_read() {
        let caster = Sphere { center: Vec3::new(1.0, 2.0, 3.0), radius: 0.5 };
        let turn = Turn::new(Vec3::NEG_Y);
        for level in SIDES.into_iter().flat_map(|side| SunLevel::around(Vec3::ZERO, turn, side)) {
            for (size, reads) in [(0.0, 1.0), (0.1, WIDEST_FILTER)] {
                let layer = SunLayer::new(level, size);
                let room = layer.shadow(caster).start.radius - caster.radius;
                assert!(room >= reads * layer.texel(), "{level:?}, size {size}: {room}");
            }
        }
    }

    /// A view that looks along −Z over a floor, in the light of a sun above and of a lamp.
    #[test]
    fn what_is_behind_or_beside_the_view_or_lights_only_what_is_there_is_not_shown() {
        let view = View::new(&Affine3A::from_translation(Vec3::Y), &Camera::default(), 90, 90);
        let view = ReceiverView::of(&view, 1e-3);
        let bounds = Some((Vec3::new(-50.0, 0.0, -50.0), Vec3::new(50.0, 3.0, 50.0)));
        let receivers = VisibleReceivers::new([view].into_iter(), bounds);
        let sun = |direction| {
            let levels = SunLevel::around(Vec3::Y, Turn::new(direction), 768).take(4);
            levels.map(|level| LayerLight::Sun(SunLayer::new(level, 0.0))).collect::<Vec<_>>()
        };
        let (above, behind) = (sun(Vec3::NEG_Y), sun(Vec3::new(0.0, -0.1, -1.0)));
        let position = [0.0, 4.0, 8.0];
        let lamp = LightRecord { position, inverse_range_squared: 1e-3, ..LightRecord::default() };
        let lamp = [LayerLight::Lamp(Lamp::new(&LightRecord { kind: LightRecord::POINT, ..lamp }, 0.05, SIDES[2]))];
        for (light, at, shown) in [
            (&above[..], [0.0, 1.0, -10.0], true),
            (&above, [0.0, 1.0, 3.0], false),
            (&above, [20.0, 1.0, -5.0], false),
            // Shadows are ten times as long as what casts is high.
            (&behind, [0.0, 3.0, 10.0], true),
            (&behind, [0.0, 1.0, 40.0], false),
            (&lamp, [0.0, 3.5, 6.0], true),
            (&lamp, [0.0, 2.0, 12.0], false),
        ] {
            let sphere = Sphere { center: at.into(), radius: 0.5 };
            assert_eq!(light.iter().any(|layer| receivers.may_show(layer, sphere)), shown, "{at:?}");
        }
        assert!(lamp[0].shadow(Sphere { center: Vec3::new(0.0, 4.0, 8.2), radius: 0.5 }).is_none());
        let nothing = VisibleReceivers::new([view].into_iter(), None);
        let sphere = Sphere { center: Vec3::new(0.0, 1.0, -10.0), radius: 0.5 };
        assert!(!above.iter().any(|layer| nothing.may_show(layer, sphere)));
    }
}
