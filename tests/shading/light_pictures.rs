//! Lights with known answers: what one pixel must be, worked out by hand.

use crate::common::prelude::*;
use crate::common::square::{Square, assert_near, head_on, matte};
use relief::renderer::HeatScale;

#[test]
fn diffuse_light_falls_off_with_angle_distance_and_range() {
    let base = Vec3::new(0.8, 0.4, 0.2);
    let Some(mut square) = Square::new(matte(base)) else { return };
    assert_near(square.middle(), Vec3::ZERO);
    square.simulation.world.resource_mut::<Environment>().ambient = Vec3::splat(0.1);
    assert_near(square.middle(), base * 0.1);
    square.simulation.world.resource_mut::<Environment>().ambient = Vec3::ZERO;

    let sun = square.light(Light::directional(0.5), Transform::default());
    assert_near(square.middle(), base * 0.5);
    let slanted = Transform::from_rotation(Quat::from_rotation_y(60f32.to_radians()));
    square.simulation.world.entity_mut(sun).insert(slanted);
    assert_near(square.middle(), base * 0.25);
    square.simulation.world.entity_mut(sun).insert(Transform::from_rotation(Quat::from_rotation_y(3.0)));
    assert_near(square.middle(), Vec3::ZERO);
    square.simulation.world.despawn(sun);

    let mut bulb = Light::point(2.0, f32::INFINITY);
    bulb.attenuation = Vec3::new(0.5, 0.25, 0.125);
    bulb.ambient = Vec3::new(0.0, 0.0, 0.3);
    let lamp = square.light(bulb.clone(), Transform::from_xyz(0.0, 0.0, 2.0));
    let attenuation = 1.0 / (0.5 + 0.25 * 2.0 + 0.125 * 4.0);
    assert_near(square.middle(), base * attenuation * (Vec3::splat(2.0) + Vec3::new(0.0, 0.0, 0.3)));
    bulb.range = 4.0;
    square.simulation.world.entity_mut(lamp).insert(bulb.clone());
    let window = (1.0f32 - (4.0f32 / 16.0).powi(2)).powi(2);
    assert_near(square.middle(), base * attenuation * window * (Vec3::splat(2.0) + Vec3::new(0.0, 0.0, 0.3)));
    bulb.range = 1.9;
    square.simulation.world.entity_mut(lamp).insert(bulb);
    assert_near(square.middle(), Vec3::ZERO);
}

#[test]
fn a_spot_gives_nothing_outside_its_cone_and_its_profile_inside() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let kind = LightKind::Spot { outer: 0.5, inner: None, exponent: 8.0 };
    let classic = Light { kind, attenuation: Vec3::X, ..Light::point(1.0, f32::INFINITY) };
    let turned = |angle| head_on().with_rotation(Quat::from_rotation_y(angle));
    let lamp = square.light(classic.clone(), turned(0.3));
    assert_near(square.middle(), Vec3::splat(0.3f32.cos().powi(8)));
    square.simulation.world.entity_mut(lamp).insert(turned(0.51));
    assert_near(square.middle(), Vec3::ZERO);
    let kind = LightKind::Spot { outer: 0.5, inner: Some(0.2), exponent: 0.0 };
    square.simulation.world.entity_mut(lamp).insert((Light { kind, ..classic }, turned(0.3)));
    let step = (0.3f32.cos() - 0.5f32.cos()) / (0.2f32.cos() - 0.5f32.cos());
    assert_near(square.middle(), Vec3::splat(step * step));
}

/// A laser's cone has its profile as a flood light's has. The reference is KHR_lights_punctual's formula in double
/// precision.
///
/// Its tolerance: half floats round to 2⁻¹¹. The angle from the axis is off by at most 3e-6 radians: a rotation's
/// matrix by a few roundings of 2⁻²⁴; the place of the pixel, which is interpolated, by a few of 3 m at a distance of 3
/// m; the unit vector by a few again; and by 2e-6 as a packed direction. The factor s² changes by 2 sin θ / (cos inner −
/// cos outer) per radian. Packed, the edge's versine is off by 2⁻¹² of itself and the slope by 2⁻¹⁰; s² by twice what s
/// is.
#[test]
fn a_spot_is_drawn_with_the_profile_of_its_angles_however_narrow_it_is() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let lamp = square.light(Light::point(0.0, f32::INFINITY), head_on());
    let versine = |angle: f64| 2.0 * (angle / 2.0).sin().powi(2);
    for outer in [0.1f32, 0.3, 0.5, 1.0, 2.0, 30.0, 85.0].map(f32::to_radians) {
        for (part, parts) in
            [(0.0, [0.0f32, 0.5, 0.9]), (0.8, [0.0, 0.85, 1.01]), (0.99, [0.98, 0.993, 1.01]), (1.0, [0.0, 0.98, 1.02])]
        {
            for angle in parts.map(|part| part * outer) {
                let kind = LightKind::Spot { outer, inner: Some(outer * part), exponent: 0.0 };
                let light = Light { kind, attenuation: Vec3::X, ..Light::point(1.0, f32::INFINITY) };
                // It turns where it is, straight before the pixel, so that the angle from the axis is its own.
                let turned = head_on().with_rotation(Quat::from_rotation_y(angle));
                square.simulation.world.entity_mut(lamp).insert((light, turned));
                let (edge, full) = (versine(outer.into()), versine((outer * part).into()));
                let width = (edge - full).max(edge / f64::from(1 << 20));
                let wanted = ((edge - versine(angle.into())) / width).clamp(0.0, 1.0).powi(2);
                let is_between = (part..=1.0).contains(&(angle / outer));
                let error = 3e-6 * 2.0 * f64::from(angle).sin() / width + 1e-11 / width;
                let packed = 2.0 * (edge / width / 4096.0 + 1.0 / 1024.0);
                let bound = 1.0 / 2048.0 + if is_between { error + packed } else { 0.0 };
                let found = f64::from(square.middle().x);
                assert!((found - wanted).abs() <= bound, "{outer} {part} {angle}: {found} for {wanted} ± {bound}");
            }
        }
        // The classic cone: hard at its edge.
        for (angle, wanted) in [(0.0, 1.0f32), (0.98, 1.0), (1.02, 0.0)] {
            let kind = LightKind::Spot { outer, inner: None, exponent: 0.0 };
            let light = Light { kind, attenuation: Vec3::X, ..Light::point(1.0, f32::INFINITY) };
            let turned = head_on().with_rotation(Quat::from_rotation_y(angle * outer));
            square.simulation.world.entity_mut(lamp).insert((light, turned));
            let found = square.middle().x;
            assert!((found - wanted).abs() <= 1.0 / 2048.0, "classic {outer}, {angle} of it: {found} for {wanted}");
        }
    }
}

/// The first light with another attenuation, a cone or an ambient colour needs other shaders than were compiled for
/// those before it.
#[test]
fn a_light_unlike_those_before_it_is_seen_from_the_frame_on_in_which_it_comes() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.light(Light::directional(0.2), Transform::default());
    assert_near(square.middle(), Vec3::splat(0.2));
    // Where 1 / d² is 1 and where another attenuation is a half.
    let place = Transform::from_xyz(0.0, 0.0, 1.0);
    let physical = Light::point(0.1, f32::INFINITY).with_attenuation(Light::INVERSE_SQUARE);
    let physical = square.light(physical, place);
    assert_near(square.middle(), Vec3::splat(0.3));
    let other = square.light(Light::point(0.1, f32::INFINITY), place);
    assert_near(square.middle(), Vec3::splat(0.35));
    for light in [physical, other] {
        square.simulation.world.despawn(light);
    }
    // Shines at the square's edge and past its middle, which a point light would light.
    let aside = Transform::from_xyz(0.0, 0.0, 3.0).looking_at(Vec3::X, Vec3::Y);
    square.light(Light::spot(5.0, 20.0, 0.2), aside);
    assert_near(square.middle(), Vec3::splat(0.2));
    let sun = square.light(Light { ambient: Vec3::splat(0.1), ..Light::directional(0.3) }, Transform::default());
    assert_near(square.middle(), Vec3::splat(0.6));
    // From behind, only its ambient colour.
    *square.simulation.world.get_mut::<Transform>(sun).expect("placed") =
        Transform::from_rotation(Quat::from_rotation_y(std::f32::consts::PI));
    assert_near(square.middle(), Vec3::splat(0.3));
    square.simulation.world.despawn(sun);
    assert_near(square.middle(), Vec3::splat(0.2));
}

/// Lights with another attenuation, a cone or an ambient colour need other shaders even while they are off: the picture
/// is the same.
#[test]
fn a_light_that_is_off_changes_no_pixel_of_what_others_light() {
    let picture = |off: &[Light]| {
        let mut square = Square::new(Material { metallic: 0.3, roughness: 0.4, ..matte(Vec3::new(0.8, 0.5, 0.3)) })?;
        square.edit(|material| material.shading = Shading::MetallicRoughness);
        square.light(Light::directional(0.2), Transform::from_rotation(Quat::from_rotation_y(0.4)));
        for i in 0..4 {
            let color = Vec3::new(1.0, 0.5 + 0.1 * i as f32, 0.3);
            let light = Light::point(0.7, 4.0).with_attenuation(Light::INVERSE_SQUARE).with_color(color);
            square.light(light, Transform::from_xyz(i as f32 - 1.5, 0.3, 0.8));
        }
        off.iter().for_each(|light| _ = square.light(Light { enabled: false, ..light.clone() }, head_on()));
        square.headless.draw(&mut square.simulation, square.camera, (96, 96)).expect("a picture");
        square.headless.renderer.read_linear()
    };
    let physical = |light: Light| light.with_attenuation(Light::INVERSE_SQUARE);
    let attenuated = Light::point(1.0, 9.0);
    let cone = physical(Light::spot(1.0, 9.0, 0.5));
    let ambient = physical(Light { ambient: Vec3::ONE, ..attenuated.clone() });
    let Some(plain) = picture(&[]) else { return };
    assert!(plain.iter().any(|pixel| pixel[0] > 0.3), "something is lit");
    for off in [vec![attenuated.clone()], vec![cone.clone()], vec![ambient.clone()], vec![attenuated, cone, ambient]] {
        let other = picture(&off).expect("a picture");
        let apart = plain.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a - b).abs() / a.max(1.0));
        // Two shaders need not round alike: what differs by 2⁻²⁰ may be two neighbouring half floats, 2⁻¹⁰ apart.
        assert!(apart.fold(0.0, f32::max) < 2e-3, "{off:?}");
    }
}

#[test]
fn bright_light_and_low_exposure_do_not_overflow() {
    let Some(mut square) = Square::new(matte(Vec3::new(0.25, 0.5, 1.0))) else { return };
    square.light(Light::directional(4e6), Transform::default());
    square.simulation.world.resource_mut::<Environment>().exposure = 1e-7;
    assert_near(square.middle(), Vec3::new(0.1, 0.2, 0.4));
}

#[test]
fn a_light_may_be_ambient_alone() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let glow = Light { ambient: Vec3::new(0.1, 0.2, 0.3), attenuation: Vec3::X, ..Light::point(1.0, f32::INFINITY) };
    square.light(glow.with_color(Vec3::ZERO), head_on());
    assert_near(square.middle(), Vec3::new(0.1, 0.2, 0.3));
}

#[test]
fn three_lights_and_all_lights_agree_while_no_more_than_three_reach() {
    let Some(mut square) = Square::new(matte(Vec3::new(0.3, 0.6, 0.9))) else { return };
    for i in 0..3 {
        square.light(Light::point(0.7, 20.0), Transform::from_xyz(i as f32 - 1.0, 0.5, 1.5));
    }
    let three = square.middle();
    square.simulation.world.insert_resource(LightPolicies::forced(LightPolicy::All));
    let all = square.middle();
    // As in `assert_near`, below 1.
    assert!(three.x > 0.1 && (three - all).abs().max_element() < 2e-3, "{three} {all}");
    // A fourth is seen by "all" in full; by "hard" not; by "three" as much, through weights and ambient cube: in the
    // object's middle, with its normal along an axis, an ambient cube is exact. Weights have 10 bits: half a step is
    // 2⁻¹¹ of a light.
    square.light(Light::point(0.5, 20.0), Transform::from_xyz(0.0, -1.0, 2.0));
    let all_four = square.middle();
    square.simulation.world.insert_resource(LightPolicies::forced(LightPolicy::Hard));
    assert!((square.middle() - three).abs().max_element() < 2e-3);
    square.simulation.world.insert_resource(LightPolicies::forced(LightPolicy::Three));
    let smooth = square.middle();
    assert!((smooth - all_four).abs().max_element() < 2e-3, "{smooth} {all_four}");
}

const POLICIES: [LightPolicy; 3] = [LightPolicy::Three, LightPolicy::Hard, LightPolicy::All];

#[test]
fn the_light_count_is_that_of_the_object_whatever_the_policy() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.headless.settings.debug = DebugView::LightCount;
    assert_near(square.middle(), HeatScale::NONE);
    // Reaches a corner of the square, not the middle, which shows the object's count all the same.
    square.light(Light::point(1.0, 0.5), Transform::from_xyz(0.9, 0.9, 0.2));
    assert_near(square.middle(), HeatScale::color(0.0));
    for i in 0..4 {
        square.light(Light::point(0.3, 20.0), Transform::from_xyz(i as f32 - 1.0, 0.5, 1.5));
    }
    square.light(Light::point(9.0, 3.0), Transform::from_xyz(0.0, 0.0, 5.0));
    square.light(Light { enabled: false, ..Light::directional(1.0) }, Transform::default());
    for policy in POLICIES {
        square.simulation.world.insert_resource(LightPolicies::forced(policy));
        assert_near(square.middle(), HeatScale::color(5f32.log2() / 6.0));
    }
}

#[test]
fn the_error_bound_is_the_sum_of_what_is_dropped_as_bright_as_it_shows() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.headless.settings.debug = DebugView::ErrorBound;
    assert_near(square.middle(), HeatScale::NONE);
    for intensity in [0.5, 0.7, 0.9] {
        square.light(Light::directional(intensity), Transform::default());
    }
    assert_near(square.middle(), HeatScale::NONE);
    square.light(Light::directional(0.04), Transform::default());
    square.light(Light::directional(0.06), Transform::default());
    for policy in POLICIES {
        square.simulation.world.insert_resource(LightPolicies::forced(policy));
        if policy == LightPolicy::All {
            assert_near(square.middle(), HeatScale::NONE);
            continue;
        }
        // 0.1 is in the middle of 0.001 … 10; ten times as bright a picture is one decade more. Kept in 8 bits it is
        // 0.1001, which is 0.0004 of a colour.
        assert_near(square.middle(), HeatScale::color(0.5));
        square.simulation.world.resource_mut::<Environment>().exposure = 10.0;
        assert_near(square.middle(), HeatScale::color(0.75));
        square.simulation.world.resource_mut::<Environment>().exposure = 1.0;
    }
}

#[test]
fn without_a_light_every_policy_and_view_draws() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.simulation.world.resource_mut::<Environment>().ambient = Vec3::splat(0.2);
    for policy in POLICIES {
        square.simulation.world.insert_resource(LightPolicies::forced(policy));
        square.headless.settings.debug = DebugView::Off;
        assert_near(square.middle(), Vec3::splat(0.2));
        square.headless.settings.debug = DebugView::ThreeLights;
        assert!(square.middle().truncate().max_element() < 0.05);
    }
}

#[test]
fn inverse_square_light_is_its_intensity_at_a_metre_and_a_quarter_at_two() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let bulb = Light::point(0.8, f32::INFINITY).with_attenuation(Light::INVERSE_SQUARE);
    let lamp = square.light(bulb.clone(), Transform::from_xyz(0.0, 0.0, 1.0));
    assert_near(square.middle(), Vec3::splat(0.8));
    square.simulation.world.entity_mut(lamp).insert(Transform::from_xyz(0.0, 0.0, 2.0));
    assert_near(square.middle(), Vec3::splat(0.2));
    square.simulation.world.entity_mut(lamp).insert(Light { range: 4.0, ..bulb });
    let window = (1.0f32 - (2.0f32 / 4.0).powi(4)).powi(2);
    assert_near(square.middle(), Vec3::splat(0.2 * window));
}

#[test]
fn a_light_that_is_gone_gives_nothing_even_to_the_reference() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.simulation.world.insert_resource(LightPolicies::forced(LightPolicy::All));
    let lamp = square.light(Light::point(1.0, 20.0), Transform::from_xyz(0.0, 0.0, 1.0));
    assert!(square.middle().x > 0.4);
    square.simulation.world.despawn(lamp);
    assert_near(square.middle(), Vec3::ZERO);
}
