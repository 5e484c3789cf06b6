//! What the score and the irradiance of a light promise.

mod common;

use common::{LUMINANCE, any_direction, any_light, any_odd_light, any_place, cases, placed, true_falloff};
use glam::Vec3;
use proptest::prelude::*;
use systems::bounds::Sphere;
use systems::components::{Light, LightKind};
use systems::draw_list::LightRecord;
use systems::lights::{ScoredLight, irradiance, light_record, score};

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn the_score_bounds_the_irradiance_everywhere_in_the_sphere(
        light in any_light(),
        (place, direction) in (any_place(20.0), any_direction()),
        (center, radius) in (any_place(40.0), prop_oneof![Just(0.0f32), 0.0f32..5.0, 0.0f32..100.0]),
        (toward, part) in (any_direction(), prop_oneof![Just(1.0f64), 0.0f64..1.0]),
        offset in prop::sample::select(vec![0.0f32, 1e4, -3e4]),
        aim in prop_oneof![2 => Just(0.0f32), 1 => 0.0f32..2.0],
    ) {
        let (place, center) = (place + offset, center + offset);
        // Many of the random spots are turned towards the sphere, so that there is something to bound.
        let aimed = (center - place).normalize_or_zero() + direction * aim;
        let record = light_record(&light, &placed(place, aimed.try_normalize().unwrap_or(direction)));
        prop_assert_ne!(record.kind, LightRecord::OFF);
        let bound = f64::from(score(&ScoredLight::new(&record), Sphere { center, radius }));
        let point = center.as_dvec3() + toward.as_dvec3().normalize() * (part * f64::from(radius));
        // A light counts by its colour or its ambient colour, whichever is brighter.
        let brightness = |rgb: [f32; 3]| Vec3::from(rgb).as_dvec3().dot(LUMINANCE);
        let luminance = brightness(record.color).max(brightness(record.ambient));
        let truth = true_falloff(&record, point) * luminance;
        prop_assert!(truth <= bound * (1.0 + 1e-4), "{truth} > {bound}");

        // Tight: at a point it is the irradiance itself; the exponent's bound is only no more than the full light.
        let at_center = true_falloff(&record, center.as_dvec3()) * luminance;
        let at_point = f64::from(score(&ScoredLight::new(&record), Sphere { center, radius: 0.0 }));
        let full = true_falloff(&LightRecord { kind: LightRecord::POINT, ..record }, center.as_dvec3());
        if matches!(record.kind, LightRecord::POINT | LightRecord::SPOT_CONE) {
            prop_assert!(at_point - at_center <= (full * 0.02).max(1e-6) * luminance, "{at_point} for {at_center}");
        } else if record.kind == LightRecord::SPOT_EXPONENT {
            prop_assert!(at_point <= full * luminance * 1.001 + 1e-6);
        }
        // The shader's formula in single precision.
        let single = f64::from(irradiance(&record, center).dot(LUMINANCE.as_vec3()));
        let narrow = record.kind != LightRecord::POINT && record.cos_outer > 0.99;
        let exact = true_falloff(&record, center.as_dvec3()) * brightness(record.color);
        prop_assert!((single - exact).abs() <= 1e-2 * full.max(1.0) * luminance || narrow, "{single} {exact}");
    }

    /// Where a hair decides between light and none: at the edge of a hard cone, far from the origin.
    #[test]
    fn rounding_takes_nothing_from_the_bound(
        (place, direction) in (any_place(3e4), any_direction()),
        (outer, distance) in (0.05f32..1.4, 1.0f32..1e4),
        (side, hair, radius) in (any_direction(), 0.0f32..3e-7, prop_oneof![Just(0.0f32), 0.0f32..0.5]),
    ) {
        let kind = LightKind::Spot { outer, inner: None, exponent: 0.0 };
        let light = Light { kind, range: f32::INFINITY, ..Light::point(1.0, 1.0) };
        let record = light_record(&light, &placed(place, direction));
        let axis = Vec3::from(record.direction);
        let across = axis.cross(side).try_normalize().unwrap_or(axis.any_orthonormal_vector());
        let (sin, cos) = (outer - hair).sin_cos();
        let center = place + (axis * cos + across * sin) * distance + (across * cos - axis * sin) * radius;
        let bound = f64::from(score(&ScoredLight::new(&record), Sphere { center, radius }));
        let inward = (axis * sin - across * cos).as_dvec3().normalize();
        let truth = true_falloff(&record, center.as_dvec3() + inward * f64::from(radius));
        prop_assert!(truth <= bound * (1.0 + 1e-4), "{truth} > {bound}");
    }

    #[test]
    fn a_larger_sphere_never_scores_lower(
        light in any_light(),
        (place, direction) in (any_place(20.0), any_direction()),
        (center, radius) in (any_place(40.0), 0.0f32..5.0),
        (away, more) in (any_direction(), 0.0f32..20.0),
    ) {
        let scored = ScoredLight::new(&light_record(&light, &placed(place, direction)));
        let inner = score(&scored, Sphere { center, radius });
        let around = Sphere { center: center + away * more * 0.999, radius: radius + more };
        prop_assert!(score(&scored, around) >= inner * 0.99999 - 1e-9);
    }

    #[test]
    fn no_light_however_odd_gives_a_score_that_is_no_number(
        light in any_odd_light(),
        (place, direction) in (any_place(20.0), any_direction()),
        (center, size) in (any_place(1.0), prop::sample::select(vec![0.0f32, 1e-30, 1.0, 1e6, 1e15, 1e25, 3e38])),
        radius in prop::sample::select(vec![0.0f32, 1e-30, 1.0, 1e6, 1e15, 1e25, 3e38]),
    ) {
        let record = light_record(&light, &placed(place, direction));
        let value = score(&ScoredLight::new(&record), Sphere { center: center * size, radius });
        prop_assert!(value.is_finite() && value >= 0.0, "{value}");
        prop_assert!(irradiance(&record, center * size).is_finite());
    }
}

/// A spot with exponent is cut hard at the outer angle; its score ends at 1.25 times the angle's tangent.
#[test]
fn outside_of_range_and_cone_the_score_is_zero() {
    let origin = placed(Vec3::ZERO, Vec3::NEG_Z);
    let spot = |inner| LightKind::Spot { outer: 0.5, inner, exponent: 4.0 };
    for kind in [spot(None), spot(Some(0.3)), LightKind::Point] {
        let light = Light { kind, ..Light::point(1.0, 10.0) };
        let scored = ScoredLight::new(&light_record(&light, &origin));
        let at = |center: Vec3, radius| score(&scored, Sphere { center, radius });
        assert!(at(Vec3::new(0.0, 0.0, -5.0), 0.0) > 0.0);
        assert_eq!(at(Vec3::new(0.0, 0.0, -11.1), 1.0), 0.0);
        assert!(at(Vec3::new(0.0, 0.0, -10.9), 1.0) > 0.0);
        if kind != LightKind::Point {
            assert_eq!(at(Vec3::new(0.0, 0.0, 5.0), 4.0), 0.0);
            let edge = if kind == spot(None) { (1.25 * 0.5f32.tan()).atan() } else { 0.5 };
            assert_eq!(at(Vec3::new((edge + 0.01).sin(), 0.0, -(edge + 0.01).cos()), 0.0), 0.0);
            assert!(at(Vec3::new((edge - 0.01).sin(), 0.0, -(edge - 0.01).cos()), 0.0) > 0.0);
        }
    }
}

#[test]
fn the_irradiance_of_known_lights() {
    let origin = placed(Vec3::ZERO, Vec3::NEG_Z);
    let at = |light: &Light, point: Vec3| irradiance(&light_record(light, &origin), point);
    let point = Light { range: f32::INFINITY, ..Light::point(8.0, 1.0) };
    assert_eq!(at(&point, Vec3::X), Vec3::splat(4.0));
    // Half the range: (1 − 1/16)².
    let windowed = Light { range: 2.0, ..point.clone() };
    assert!((at(&windowed, Vec3::X).x - 4.0 * (15.0f32 / 16.0).powi(2)).abs() < 1e-5);
    assert_eq!(at(&windowed, Vec3::X * 2.0), Vec3::ZERO);
    let angle = |a: f32| Vec3::new(a.sin(), 0.0, -a.cos());
    let classic = Light { kind: LightKind::Spot { outer: 0.6, inner: None, exponent: 3.0 }, ..point.clone() };
    assert!((at(&classic, angle(0.5)).x - 4.0 * 0.5f32.cos().powi(3)).abs() < 1e-5);
    assert_eq!(at(&classic, angle(0.61)), Vec3::ZERO);
    let cone = Light { kind: LightKind::Spot { outer: 0.6, inner: Some(0.4), exponent: 3.0 }, ..point };
    assert!((at(&cone, angle(0.39)).x - 4.0).abs() < 1e-5);
    let middle = ((0.5f32.cos() - 0.6f32.cos()) / (0.4f32.cos() - 0.6f32.cos())).powi(2);
    assert!((at(&cone, angle(0.5)).x - 4.0 * middle).abs() < 1e-4);
    assert_eq!(at(&cone, angle(0.61)), Vec3::ZERO);
    assert_eq!(at(&Light::directional(3.0), Vec3::splat(1e9)), Vec3::splat(3.0));
}

/// The score of a spot, and with it every weight, changes little by little as an object that the axis passes through falls
/// behind the lamp.
#[test]
fn a_spots_score_fades_as_an_object_falls_behind_it() {
    for inner in [Some(0.4), None] {
        let light = Light { kind: LightKind::Spot { outer: 0.6, inner, exponent: 3.0 }, ..Light::point(1.0, 20.0) };
        let scored = ScoredLight::new(&light_record(&light, &placed(Vec3::ZERO, Vec3::NEG_Z)));
        let at = |z: f32| score(&scored, Sphere { center: Vec3::new(0.5, 0.0, z), radius: 1.0 });
        let (ahead, behind) = (at(-1.0), at(1.0));
        assert!(ahead > 0.5 && behind == 0.0, "{ahead} {behind}");
        let step = |steps: u32| {
            let scores: Vec<f32> = (0..=steps).map(|i| at(-1.0 + 2.0 * i as f32 / steps as f32)).collect();
            scores.windows(2).map(|pair| (pair[0] - pair[1]).abs()).fold(0.0, f32::max)
        };
        let (coarse, fine) = (step(1_000), step(10_000));
        assert!(fine < 0.05 && fine < coarse * 0.3, "{coarse} {fine}");
    }
}
