//! Guarantees of the score and the irradiance of a light.

use super::*;
use crate::common::spot_error;

/// A unit vector in single precision: three components, each off by at most 2⁻²⁴ where it is stored and by three more
/// roundings of as much where it is computed: √3 · 4 · 2⁻²⁴ is less than this. Two of them are subtracted.
const UNIT_ERROR: f64 = 2.0 / (1 << 21) as f64;

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
            let slack = 0.02 + spot_error(&record, center.as_dvec3(), 3e-6);
            prop_assert!(at_point - at_center <= (full * slack).max(1e-6) * luminance, "{at_point} for {at_center}");
        } else if record.kind == LightRecord::SPOT_EXPONENT {
            prop_assert!(at_point <= full * luminance * 1.001 + 1e-6);
        }
        // The shader's formula in single precision.
        let single = f64::from(irradiance(&record, center).dot(LUMINANCE.as_vec3()));
        let exact = true_falloff(&record, center.as_dvec3()) * brightness(record.color);
        let slack = 1e-4 * full.max(1.0) + full * spot_error(&record, center.as_dvec3(), UNIT_ERROR);
        prop_assert!((single - exact).abs() <= slack * luminance, "{single} {exact}");
    }

    /// Points at the edge of a hard cone, far from the origin: rounding decides between light and none.
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

/// From the narrowest cone to the widest, from a cone that fades from its axis on to a hard edge, in the middle and
/// beside the edges: the factor is KHR_lights_punctual's in double precision, but for what single precision can tell
/// apart.
#[test]
fn a_spots_profile_is_that_of_its_angles_however_narrow_it_is() {
    let directions = [Vec3::NEG_Z, Vec3::X, Vec3::new(0.3, -0.8, 0.5).normalize()];
    for outer in [0.1f32, 0.15, 0.3, 0.5, 0.8, 1.0, 2.0, 5.0, 20.0, 45.0, 60.0, 85.0].map(f32::to_radians) {
        for part in [0.0, 0.3, 0.8, 0.99, 0.9999, 1.0] {
            let kind = LightKind::Spot { outer, inner: Some(outer * part), exponent: 0.0 };
            let light = Light { kind, attenuation: Vec3::X, ..Light::point(1.0, f32::INFINITY) };
            for direction in directions {
                let record = light_record(&light, &placed(Vec3::ZERO, direction));
                let axis = Vec3::from(record.direction).as_dvec3().normalize();
                let across = axis.any_orthonormal_vector();
                let versine = |angle: f64| 2.0 * (angle / 2.0).sin().powi(2);
                let (edge, full) = (versine(outer.into()), versine((outer * part).into()));
                let parts = [0.0, 0.2, 0.5, 0.9, 0.999, 1.0, 1.001, 1.5];
                let between = [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| f64::from(part) * (1.0 - t) + t);
                for angle in parts.into_iter().chain(between).map(|t| t * f64::from(outer)) {
                    let point = ((axis * angle.cos() + across * angle.sin()) * 7.0).as_vec3();
                    // Where the rounded point is.
                    let angle = point.as_dvec3().normalize().angle_between(axis);
                    let chord = (point.as_dvec3().normalize() - axis).length();
                    let angle = if angle < 0.1 { 2.0 * (chord / 2.0).asin() } else { angle };
                    // A hard edge: single precision tells sixteen steps apart.
                    let step = (edge - versine(angle)) / (edge - full).max(edge / f64::from(1 << 20));
                    let truth = step.clamp(0.0, 1.0).powi(2);
                    let what = || format!("outer {outer}, inner {part} of it, at {angle}, along {direction}");
                    let found = f64::from(irradiance(&record, point).x);
                    let bound = spot_error(&record, point.as_dvec3(), UNIT_ERROR);
                    assert!((found - truth).abs() <= bound, "{}: {found} for {truth} ± {bound}", what());
                    assert!(angle > 0.0 || found == 1.0, "{}: {found} on the axis", what());
                    let scored = ScoredLight::new(&record);
                    let found = f64::from(score(&scored, Sphere { center: point, radius: 0.0 }));
                    // The sphere grows by a millionth of the distance, the cone by a millionth of its versine.
                    let bound = spot_error(&record, point.as_dvec3(), 3e-6);
                    let range = truth - 1e-6..=truth + bound + 3e-6;
                    assert!(range.contains(&found), "{}: score {found} for {truth}", what());
                }
            }
        }
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

/// The figures of docs/lights.md: a window that differs from the one that KHR_lights_punctual recommends, and by how
/// much.
#[test]
fn the_window_is_the_square_of_the_recommended_one() {
    let light = Light { range: 4.0, ..Light::point(1.0, 4.0) }.with_attenuation(Light::INVERSE_SQUARE);
    let record = light_record(&light, &placed(Vec3::ZERO, Vec3::NEG_Z));
    let ours = |part: f64| {
        let d = part * 4.0;
        f64::from(irradiance(&record, Vec3::X * d as f32).x) * d * d
    };
    let recommended = |part: f64| (1.0 - part.powi(4)).clamp(0.0, 1.0);
    let apart = |part: f64| (recommended(part) - ours(part)).abs();
    let parts = || (3..=1200).map(|i| f64::from(i) / 1000.0);
    // Beyond 1 cm. Single precision: a few roundings of 2⁻²⁴ of numbers up to 1.
    assert!(parts().all(|part| (ours(part) - recommended(part).powi(2)).abs() < 1e-6));
    let most = parts().max_by(|&a, &b| apart(a).total_cmp(&apart(b))).expect("some");
    assert!((most - 0.5f64.powf(0.25)).abs() < 1e-2 && (most - 0.84).abs() < 1e-2, "{most}");
    assert!((apart(most) - 0.25).abs() < 1e-5, "{}", apart(most));
    for (part, darker) in [(0.25, 0.004), (0.5, 0.06), (0.75, 0.32)] {
        assert!((1.0 - ours(part) / recommended(part) - darker).abs() < 0.005, "{part}");
    }
    // With a range that is longer by the fourth root of 2: the same but for half the fourth power's square.
    let longer = |part: f64| ours(part / 2f64.powf(0.25));
    assert!(
        (1..=50)
            .map(|i| f64::from(i) / 100.0)
            .all(|part| (longer(part) - recommended(part)).abs() < part.powi(8) / 4.0 + 1e-6)
    );
    // Exactly nothing from the range on, and nothing grows within 1 cm.
    assert!([1.0, 1.0001, 1.5, 1e6].iter().all(|&part| ours(part) == 0.0));
    let near = |d: f32| irradiance(&record, Vec3::X * d).x;
    assert!((near(0.01) / 1e4 - 1.0).abs() < 1e-5 && near(0.005) == near(0.0) && near(0.02) < near(0.01) * 0.26);
}

/// Ranges from the least to the greatest that scenes may have, and beyond.
#[test]
fn a_range_ends_a_light_at_every_scale() {
    for range in [1e-6f32, 1e-3, 0.02, 1.0, 3e3, 1e7, 1e12, 1e18] {
        let light = Light { attenuation: Vec3::X, ..Light::point(1.0, range) };
        let record = light_record(&light, &placed(Vec3::ZERO, Vec3::NEG_Z));
        let scored = ScoredLight::new(&record);
        for part in [0.0f32, 0.3, 0.84, 0.999, 1.0, 1.001, 3.0] {
            let point = Vec3::Y * (part * range);
            let truth = (1.0 - f64::from(part).powi(4)).max(0.0).powi(2);
            let found = [irradiance(&record, point).x, score(&scored, Sphere { center: point, radius: 0.0 })];
            // A few roundings of numbers up to 1; the score's distance is less by a millionth, its slope at most 4.
            let most = [1e-6, 1e-5].map(|error| truth + error);
            assert!(
                f64::from(found[0]) <= most[0] && f64::from(found[1]) <= most[1],
                "{range} {part}: {found:?} {truth}"
            );
            assert!(found.iter().all(|&f| f64::from(f) >= truth - 1e-6), "{range} {part}: {found:?} {truth}");
            assert!(part < 1.001 || found == [0.0; 2], "{range} {part}: {found:?}");
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
    // The lamp itself is in no direction from it.
    let wide = Light { kind: LightKind::Spot { outer: 1.4, inner: Some(0.1), exponent: 0.0 }, ..cone };
    assert_eq!(at(&wide, Vec3::ZERO), Vec3::ZERO);
}

/// The score of a spot, and with it every weight, changes little by little as an object that the axis passes through
/// falls behind the lamp.
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
        // Ten times as many steps are a tenth as large; a jump would stay.
        let (coarse, fine) = (step(1_000), step(10_000));
        assert!(fine < coarse * 0.3, "{coarse} {fine}");
    }
}
