//! The light table, the score's promises, and the selection against a brute force of its own.

use bevy_ecs::change_detection::DetectChanges;
use bevy_ecs::prelude::*;
use bevy_tasks::TaskPoolBuilder;
use bevy_transform::components::{GlobalTransform, Transform};
use glam::{DVec3, Quat, Vec3};
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::FileFailurePersistence;
use std::collections::BTreeMap;
use systems::bounds::{Sphere, WorldBounds};
use systems::components::{Light, LightKind};
use systems::draw_list::{LightRecord, NO_LIGHT};
use systems::library::{Library, MeshId};
use systems::light_search::{self, Level, Scratch};
use systems::light_selection::select_parallel;
use systems::light_tree::LightTree;
use systems::lights::{LightPolicy, LightSlot, LightTable, ScoredLight, Selection, irradiance, light_record, score};
use systems::stats::FrameStats;
use systems::{Simulation, brute_force, shapes};

const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

fn any_direction() -> impl Strategy<Value = Vec3> {
    [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0].prop_map(|v| Vec3::from(v).try_normalize().unwrap_or(Vec3::Y))
}

fn any_place(extent: f32) -> impl Strategy<Value = Vec3> {
    [-extent..extent, -extent..extent, -extent..extent].prop_map(Vec3::from)
}

fn any_kind() -> impl Strategy<Value = LightKind> {
    prop_oneof![
        2 => Just(LightKind::Point),
        1 => Just(LightKind::Directional),
        2 => (0.03f32..1.6, prop::option::of(0.0f32..1.0), 0.0f32..40.0).prop_map(|(outer, inner, exponent)| {
            LightKind::Spot { outer, inner: inner.map(|part| outer * part), exponent }
        }),
    ]
}

prop_compose! {
    fn any_light()(
        kind in any_kind(),
        color in [0.0f32..1.0, 0.0f32..1.0, 0.01f32..1.0],
        intensity in 0.1f32..100.0,
        ambient in prop_oneof![3 => Just(0.0f32), 1 => 0.0f32..0.1],
        range in prop_oneof![4 => 1.0f32..60.0, 1 => Just(f32::INFINITY), 1 => Just(1e6)],
        attenuation in (prop_oneof![Just(0.0f32), Just(1.0)], prop_oneof![Just(0.0f32), 0.0f32..1.0], 0.0f32..1.0),
    ) -> Light {
        let (color, attenuation) = (Vec3::from(color), Vec3::from(attenuation));
        Light { kind, color, intensity, ambient: Vec3::splat(ambient), range, attenuation, enabled: true }
    }
}

/// A light, or one with a value that makes it none, or makes it dark.
fn any_odd_light() -> impl Strategy<Value = Light> {
    let odd = prop::sample::select(vec![f32::NAN, f32::INFINITY, -f32::INFINITY, -1.0, 0.0, 1e-42, 1e38]);
    (any_light(), 0..20usize, odd).prop_map(|(mut light, field, value)| {
        match field {
            0 => light.color.x = value,
            1 => light.intensity = value,
            2 => light.range = value,
            3 => light.attenuation.y = value,
            4 => light.enabled = false,
            5 => light.ambient.z = value,
            6 => light.kind = LightKind::Spot { outer: value, inner: None, exponent: 1.0 },
            7 => light.kind = LightKind::Spot { outer: 0.5, inner: Some(value), exponent: 1.0 },
            8 => light.kind = LightKind::Spot { outer: 0.5, inner: None, exponent: value },
            _ => {}
        }
        light
    })
}

fn placed(position: Vec3, direction: Vec3) -> GlobalTransform {
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, direction);
    Transform { translation: position, rotation, scale: Vec3::ONE }.into()
}

#[derive(Clone, Debug)]
struct Scene {
    records: Vec<LightRecord>,
    scored: Vec<ScoredLight>,
    spheres: Vec<Sphere>,
}

fn scene(records: Vec<LightRecord>, spheres: Vec<Sphere>) -> Scene {
    Scene { scored: records.iter().map(ScoredLight::new).collect(), records, spheres }
}

impl Scene {
    fn select(&self, policy: LightPolicy) -> Vec<Selection> {
        let mut out = vec![Selection::default(); self.spheres.len()];
        brute_force::select(&self.scored, policy, &self.spheres, &mut out);
        out
    }

    fn search(&self, level: Level, policy: LightPolicy) -> Vec<Selection> {
        let mut out = vec![Selection::default(); self.spheres.len()];
        let tree = LightTree::new(&self.scored);
        let work = (&self.spheres[..], &mut out[..]);
        light_search::select(level, &tree, &self.scored, policy, work, &mut Scratch::default());
        out
    }
}

prop_compose! {
    /// Lights (some of them twice and more, so that scores tie) and objects, around the origin or 10 km off.
    fn any_scene()(
        offset in prop::sample::select(vec![Vec3::ZERO, Vec3::new(1e4, 0.0, -1e4)]),
        lights in prop::collection::vec((any_odd_light(), any_place(20.0), any_direction()), 1..12),
        copies in prop::collection::vec(any::<Index>(), 0..40),
        spheres in prop::collection::vec((any_place(25.0), prop_oneof![
            4 => 0.0f32..3.0, 1 => Just(0.0f32), 1 => Just(50.0f32), 1 => Just(1e6f32)]), 0..20),
        places in prop::collection::vec(any::<Index>(), 0..3),
    ) -> Scene {
        let records: Vec<LightRecord> = copies.iter().map(|copy| copy.get(&lights))
            .map(|(light, place, direction)| light_record(light, &placed(*place + offset, *direction))).collect();
        let at_lights = places.iter().map(|place| Sphere { center: place.get(&lights).1 + offset, radius: 0.5 });
        let spheres = spheres.iter().map(|&(center, radius)| Sphere { center: center + offset, radius });
        let spheres = spheres.chain(at_lights).chain([Sphere { center: Vec3::NAN, radius: 1.0 },
            Sphere { center: Vec3::ZERO, radius: f32::INFINITY }]).collect();
        scene(records, spheres)
    }
}

/// Attenuation · spot · window in double precision, from the formulas of the lighting model.
fn true_falloff(light: &LightRecord, point: DVec3) -> f64 {
    if light.kind >= LightRecord::DIRECTIONAL {
        return f64::from(u8::from(light.kind == LightRecord::DIRECTIONAL));
    }
    let v = point - Vec3::from(light.position).as_dvec3();
    let d = v.length();
    let [kc, kl, kq] = light.attenuation.map(f64::from);
    let x = d * d * f64::from(light.inverse_range_squared);
    let reach = (1.0 - x * x).max(0.0).powi(2) / (kc + kl * d + kq * d * d).max(1e-4);
    let cos = Vec3::from(light.direction).as_dvec3().normalize_or_zero().dot(v.normalize_or_zero());
    let (outer, inner) = (f64::from(light.cos_outer), f64::from(light.cos_inner));
    match light.kind {
        LightRecord::SPOT_EXPONENT if cos <= outer => 0.0,
        LightRecord::SPOT_EXPONENT => reach * cos.powf(f64::from(light.exponent)),
        LightRecord::SPOT_CONE => reach * ((cos - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2),
        _ => reach,
    }
}

/// What the remainder counts: the falloff at the sphere's centre, but a classic spot's without its cut, by a smooth
/// step from the sphere outside of the cone to the sphere inside.
fn falloff_around(light: &LightRecord, sphere: Sphere) -> f64 {
    let center = sphere.center.as_dvec3();
    if light.kind != LightRecord::SPOT_EXPONENT {
        return true_falloff(light, center);
    }
    let v = center - Vec3::from(light.position).as_dvec3();
    let cos = Vec3::from(light.direction).as_dvec3().normalize().dot(v.normalize_or_zero()).clamp(-1.0, 1.0);
    // From the cone's surface to the centre: the angle between them, seen from the apex.
    let inside = v.length() * (f64::from(light.cos_outer).acos() - cos.acos()).sin();
    let x = (0.5 + 0.5 * inside / f64::from(sphere.radius.max(1e-6))).clamp(0.0, 1.0);
    let point = true_falloff(&LightRecord { kind: LightRecord::POINT, ..*light }, center);
    point * cos.max(0.0).powf(f64::from(light.exponent)) * (x * x * (3.0 - 2.0 * x))
}

/// The answer by sorting all scores; weights and remainder straight from their definition.
fn brute_force(scene: &Scene, sphere: Sphere, policy: LightPolicy) -> (Selection, f64) {
    let mut scores: Vec<(f32, u32)> =
        scene.scored.iter().zip(0..).map(|(light, slot)| (score(light, sphere), slot)).filter(|s| s.0 > 0.0).collect();
    scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    if !sphere.center.is_finite() || !sphere.radius.is_finite() {
        scores.clear();
    }
    // (The sum's order is the search's own; the sum is compared with a tolerance.)
    let dropped = scores.iter().skip(3).map(|s| f64::from(s.0)).sum::<f64>() as f32;
    let fourth = scores.get(3).map_or(0.0, |s| s.0);
    let mut selection = Selection { reaching: scores.len() as u32, dropped, ..Selection::default() };
    for (i, &(score, slot)) in scores.iter().take(3).enumerate() {
        selection.lights[i] = slot;
        selection.weights[i] = if policy == LightPolicy::Hard { 1.0 } else { 1.0 - (fourth / score).powi(4) };
    }
    let (mut ambient, mut direction, mut sides, mut magnitude) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
    let mut add = |slot: u32, weight: f64| {
        let record = &scene.records[slot as usize];
        let color = Vec3::from(record.color).as_dvec3();
        let part = weight * falloff_around(record, sphere);
        ambient += part * (color + 4.0 * Vec3::from(record.ambient).as_dvec3());
        let toward = match record.kind {
            LightRecord::DIRECTIONAL => -Vec3::from(record.direction),
            _ => (Vec3::from(record.position) - sphere.center).normalize_or_zero(),
        };
        direction += part * color.dot(LUMINANCE) * toward.as_dvec3();
        let even = 2.0 * Vec3::from(record.ambient).as_dvec3().dot(LUMINANCE);
        sides += part * (color.dot(LUMINANCE).abs() * toward.as_dvec3().abs() + even);
        magnitude += part.abs() * (color.abs().element_sum() + 4.0 * f64::from(record.ambient[2]).abs());
    };
    if policy != LightPolicy::Hard {
        scores.iter().for_each(|&(_, slot)| add(slot, 1.0));
        (0..3).filter(|&i| i < scores.len()).for_each(|i| add(selection.lights[i], -f64::from(selection.weights[i])));
    }
    selection.remainder_ambient = ambient.as_vec3();
    selection.remainder_direction = direction.as_vec3();
    selection.remainder_sides = sides.as_vec3();
    (selection, magnitude)
}

/// Failing inputs are kept beside this file, and tried first from then on.
fn cases(cases: u32) -> ProptestConfig {
    let persistence = FileFailurePersistence::WithSource("regressions");
    ProptestConfig { failure_persistence: Some(Box::new(persistence)), ..ProptestConfig::with_cases(cases) }
}

proptest! {
    #![proptest_config(cases(1000))]

    #[test]
    fn selection_equals_brute_force(scene in any_scene(), policy in prop::sample::select(LightPolicy::ALL.to_vec())) {
        for (&sphere, found) in scene.spheres.iter().zip(scene.select(policy.1)) {
            let (expected, magnitude) = brute_force(&scene, sphere, policy.1);
            prop_assert_eq!(found.lights, expected.lights, "{:?}", sphere);
            prop_assert!(found.weights.iter().zip(expected.weights).all(|(a, b)| (a - b).abs() < 1e-6));
            prop_assert_eq!(found.reaching, expected.reaching);
            prop_assert!((found.dropped - expected.dropped).abs() <= 1e-4 * expected.dropped);
            // The edge of a narrow cone is worth a few thousandths in single precision; at the very range of a light,
            // where the window ends, rounding decides between nothing and next to nothing.
            let colors = scene.records.iter().map(|record| Vec3::from(record.color).abs().max_element());
            let tolerance = 5e-3 * magnitude as f32 + 1e-8 * colors.fold(0.0, f32::max) + 1e-30;
            prop_assert!((found.remainder_ambient - expected.remainder_ambient).abs().max_element() <= tolerance,
                "{found:?} {expected:?}");
            prop_assert!((found.remainder_sides - expected.remainder_sides).abs().max_element() <= tolerance,
                "{found:?} {expected:?}");
            prop_assert!((found.remainder_direction - expected.remainder_direction).abs().max_element() <= tolerance,
                "{found:?} {expected:?}");
        }
    }

    #[test]
    fn selection_is_the_same_for_any_division_of_the_work(scene in any_scene(), size in 1usize..9) {
        // More objects than one task takes.
        let spheres: Vec<Sphere> = scene.spheres.iter().copied().cycle().take(700).collect();
        let whole = Scene { spheres, ..scene }.clone();
        let expected = whole.select(LightPolicy::Three);
        let pieces = whole.spheres.chunks(size).flat_map(|spheres| {
            Scene { spheres: spheres.to_vec(), ..whole.clone() }.search(Level::new(), LightPolicy::Three)
        });
        prop_assert!(pieces.eq(expected.iter().copied()));
        let pool = TaskPoolBuilder::new().num_threads(size % 4 + 1).build();
        let mut out = vec![Selection::default(); whole.spheres.len()];
        let tree = LightTree::new(&whole.scored);
        select_parallel(&pool, &tree, &whole.scored, LightPolicy::Three, &whole.spheres, &mut out);
        prop_assert_eq!(out, expected);
    }
}

/// Every instruction set that this processor has.
fn levels() -> Vec<Level> {
    let level = Level::new();
    #[allow(unused_mut)]
    let mut levels = vec![level];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(level.as_avx2().map(Level::Avx2));
        levels.extend(level.as_sse4_2().map(Level::Sse4_2));
    }
    levels.push(Level::baseline());
    levels.push(Level::fallback());
    levels
}

/// A light and its place in a scene of the given extent.
fn any_placed_light(extent: f32) -> impl Strategy<Value = LightRecord> {
    let place = (any_place(extent), any_direction(), prop::sample::select(vec![0.0f32, 1.0, 8.0]));
    (any_odd_light(), place, 0.02f32..2.0).prop_map(move |(mut light, (place, direction, grid), reach)| {
        // Some on a grid, so that many are the same distance away.
        let place = if grid > 0.0 { (place / extent * grid).round() * extent / grid } else { place };
        if light.range.is_finite() && light.range < 1e5 {
            light.range *= reach * extent / 30.0;
        }
        light_record(&light, &placed(place, direction))
    })
}

prop_compose! {
    /// Hundreds of lights, some many times over, and hundreds of objects, in order of place or not.
    fn any_large_scene()(
        extent in prop::sample::select(vec![2.0f32, 50.0, 1000.0, 20_000.0]),
    )(
        lights in prop::collection::vec(any_placed_light(extent), 0..200),
        copies in prop::collection::vec(any::<Index>(), 0..200),
        offset in prop::sample::select(vec![Vec3::ZERO, Vec3::new(1e4, 0.0, -1e4)]),
        mut spheres in prop::collection::vec((any_place(extent * 1.1), prop_oneof![
            6 => 0.0f32..0.02, 1 => Just(0.0f32), 1 => 0.0f32..2.0, 1 => Just(1e6f32), 1 => Just(f32::NAN),
            1 => Just(-1.0f32)]), 0..400),
        sorted in any::<bool>(),
        extent in Just(extent),
    ) -> Scene {
        // Every other copy is a mirror image, so that what lies on the mirror is as near to both.
        let copies = copies.iter().filter(|_| !lights.is_empty()).enumerate().map(|(i, copy)| {
            let mut light = *copy.get(&lights);
            if i % 2 == 1 {
                light.position[0] = -light.position[0];
                light.direction[0] = -light.direction[0];
            }
            light
        });
        let mut records: Vec<LightRecord> = lights.iter().copied().chain(copies).collect();
        for record in &mut records {
            record.position = (Vec3::from(record.position) + offset).into();
        }
        spheres.iter_mut().step_by(3).for_each(|(center, _)| center.x = 0.0);
        if sorted {
            spheres.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
        }
        let spheres = spheres.iter().map(|&(center, radius)| Sphere { center: center + offset, radius: radius * extent });
        let mut spheres: Vec<Sphere> = spheres.collect();
        spheres.extend(records.first().map(|light| Sphere { center: light.position.into(), radius: 0.0 }));
        scene(records, spheres)
    }
}

proptest! {
    #![proptest_config(cases(200))]

    /// Bit for bit, on every instruction set. `PROPTEST_CASES=50000` compares ten million objects.
    #[test]
    fn the_fast_search_equals_the_plain_one(
        scene in any_large_scene(),
        policy in prop::sample::select(LightPolicy::ALL.to_vec()),
    ) {
        let expected = scene.select(policy.1);
        for level in levels() {
            for (i, (found, expected)) in scene.search(level, policy.1).iter().zip(&expected).enumerate() {
                prop_assert!(found == expected, "{:?} {level:?}\n{found:?}\n{expected:?}", scene.spheres[i]);
            }
        }
    }
}

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

#[test]
fn equal_lights_go_by_slot_and_all_into_the_remainder() {
    let lamp = Light::point(10.0, 50.0);
    let record = light_record(&lamp, &placed(Vec3::Y, Vec3::NEG_Z));
    let sphere = Sphere { center: Vec3::ZERO, radius: 0.5 };
    let four = scene(vec![record; 6], vec![sphere]).select(LightPolicy::Three)[0];
    assert_eq!((four.lights, four.weights), ([0, 1, 2], [0.0; 3]));
    let each = irradiance(&record, Vec3::ZERO);
    assert!((four.remainder_ambient - 6.0 * each).length() < 1e-4);
    assert!((four.remainder_direction - Vec3::Y * 6.0 * each.x).length() < 1e-4);
    assert!((four.remainder_sides - Vec3::Y * 6.0 * each.x).length() < 1e-4);

    let three = scene(vec![record; 3], vec![sphere]).select(LightPolicy::Three)[0];
    assert_eq!((three.lights, three.weights), ([0, 1, 2], [1.0; 3]));
    assert_eq!((three.remainder_ambient, three.remainder_direction), (Vec3::ZERO, Vec3::ZERO));

    let hard = scene(vec![record; 6], vec![sphere]).select(LightPolicy::Hard)[0];
    assert_eq!((hard.weights, hard.remainder_ambient), ([1.0; 3], Vec3::ZERO));

    let none = scene(vec![], vec![sphere]).select(LightPolicy::Three)[0];
    assert_eq!(none, Selection::default());
}

/// The largest change of any light's weight, and of the remainder, between two of many steps of an object along a row of
/// lamps.
fn largest_jump(policy: LightPolicy, steps: usize) -> (f32, f32) {
    let lamps = (0..24).map(|i| {
        let place = placed(Vec3::new(i as f32 * 2.5 - 4.0, 4.0, (i % 4) as f32), Vec3::NEG_Y);
        let spot = LightKind::Spot { outer: 1.2, inner: Some(0.7), exponent: 0.0 };
        let classic = LightKind::Spot { outer: 0.8, inner: None, exponent: 2.0 };
        let kind = [spot, LightKind::Point, classic][i % 3];
        let strength = if kind == classic { 20.0 } else { 5.0 };
        light_record(&Light { kind, ..Light::point(strength + (i % 5) as f32, 18.0) }, &place)
    });
    let spheres = (0..steps).map(|i| Sphere { center: Vec3::X * (i as f32 * 50.0 / steps as f32), radius: 1.0 });
    let weights = |s: &Selection| s.lights.into_iter().zip(s.weights).collect::<BTreeMap<u32, f32>>();
    let path = scene(lamps.collect(), spheres.collect()).select(policy);
    let (mut weight_jump, mut remainder_jump) = (0.0f32, 0.0f32);
    for pair in path.windows(2) {
        let (a, b) = (weights(&pair[0]), weights(&pair[1]));
        for slot in a.keys().chain(b.keys()).filter(|&&slot| slot != NO_LIGHT) {
            weight_jump = weight_jump.max((a.get(slot).unwrap_or(&0.0) - b.get(slot).unwrap_or(&0.0)).abs());
        }
        remainder_jump = remainder_jump.max((pair[0].remainder_ambient - pair[1].remainder_ambient).length());
    }
    (weight_jump, remainder_jump)
}

#[test]
fn weights_and_remainder_change_smoothly_where_lights_pass_each_other() {
    let (weight, remainder) = largest_jump(LightPolicy::Three, 5_000);
    let (weight_finer, remainder_finer) = largest_jump(LightPolicy::Three, 50_000);
    assert!(weight < 0.08 && remainder < 0.05, "{weight} {remainder}");
    assert!(weight_finer < weight * 0.2 && remainder_finer < remainder * 0.2, "{weight_finer} {remainder_finer}");
    assert_eq!(largest_jump(LightPolicy::Hard, 50_000).0, 1.0);
}

#[test]
fn lights_that_are_none_are_never_selected() {
    let lamp = Light::point(1.0, 10.0);
    let spot = |outer, inner, exponent| LightKind::Spot { outer, inner, exponent };
    let none = [
        Light { enabled: false, ..lamp.clone() },
        Light { intensity: 0.0, ..lamp.clone() },
        Light { intensity: -1.0, ..lamp.clone() },
        Light { intensity: f32::NAN, ..lamp.clone() },
        Light { intensity: 1e38, ..lamp.clone() },
        Light { color: Vec3::ZERO, ..lamp.clone() },
        Light { color: Vec3::new(1.0, f32::INFINITY, 1.0), ..lamp.clone() },
        Light { range: 0.0, ..lamp.clone() },
        Light { range: -5.0, ..lamp.clone() },
        Light { range: f32::NAN, ..lamp.clone() },
        Light { attenuation: Vec3::NAN, ..lamp.clone() },
        Light { ambient: Vec3::NAN, ..lamp.clone() },
        Light { kind: spot(f32::NAN, None, 1.0), ..lamp.clone() },
        Light { kind: spot(0.0, None, 1.0), ..lamp.clone() },
        Light { kind: spot(0.5, Some(f32::NAN), 1.0), ..lamp.clone() },
        Light { kind: spot(0.5, None, f32::INFINITY), ..lamp.clone() },
    ];
    let mut simulation = Simulation::new();
    let world = &mut simulation.world;
    world.spawn_batch(none);
    world.spawn((lamp.clone(), Transform::from_translation(Vec3::NAN)));
    world.spawn((Light::spot(1.0, 10.0, 0.5), Transform::from_scale(Vec3::ZERO)));
    let object = spawn_object(world, Vec3::ZERO);
    simulation.frame();
    let records = &simulation.draw_list().lights.records;
    assert_eq!(records.len(), 18);
    for (slot, record) in records.iter().enumerate() {
        assert_eq!(record.kind, LightRecord::OFF, "slot {slot}");
    }
    assert_eq!(*simulation.world.get::<Selection>(object).unwrap(), Selection::default());
    // Negative colours count by magnitude, negative attenuation as none.
    let dark = Light { color: Vec3::new(-1.0, 0.0, 0.0), attenuation: Vec3::new(1.0, -1.0, 0.0), ..lamp };
    let slot = spawn_light(&mut simulation, dark);
    assert_eq!(simulation.world.get::<Selection>(object).unwrap().lights, [slot, NO_LIGHT, NO_LIGHT]);
    assert_eq!(simulation.draw_list().lights.records[slot as usize].attenuation, [1.0, 0.0, 0.0]);
}

/// An object that no mesh stands behind, so that nothing but the test moves its bounds.
fn spawn_object(world: &mut World, center: Vec3) -> Entity {
    world.spawn((MeshId(u32::MAX), WorldBounds(Sphere { center, radius: 0.5 }))).id()
}

fn spawn_light(simulation: &mut Simulation, light: Light) -> u32 {
    let entity = simulation.world.spawn(light).id();
    simulation.frame();
    slot_of(simulation, entity)
}

fn slot_of(simulation: &Simulation, light: Entity) -> u32 {
    simulation.world.get::<LightSlot>(light).unwrap().0
}

#[test]
fn slots_stay_while_lights_come_and_go() {
    let mut simulation = Simulation::new();
    let lights: Vec<Entity> = (0..5).map(|i| simulation.world.spawn(Light::point(1.0 + i as f32, 10.0)).id()).collect();
    simulation.frame();
    let slots = |simulation: &Simulation, lights: &[Entity]| -> Vec<u32> {
        lights.iter().map(|&light| slot_of(simulation, light)).collect()
    };
    assert_eq!(slots(&simulation, &lights), [0, 1, 2, 3, 4]);

    simulation.world.despawn(lights[3]);
    simulation.world.despawn(lights[1]);
    simulation.frame();
    let kinds: Vec<u32> = simulation.draw_list().lights.records.iter().map(|record| record.kind).collect();
    let (on, off) = (LightRecord::POINT, LightRecord::OFF);
    assert_eq!(kinds, [on, off, on, off, on]);
    assert_eq!(simulation.world.resource::<LightTable>().scored()[3], ScoredLight::OFF);

    // The lowest free slot first, whichever was freed first; then new ones.
    let later: Vec<u32> = (0..3).map(|_| spawn_light(&mut simulation, Light::point(9.0, 10.0))).collect();
    assert_eq!(later, [1, 3, 5]);
    assert_eq!(slots(&simulation, &[lights[0], lights[2], lights[4]]), [0, 2, 4]);

    // Freed and taken again within one frame; a light taken off its entity and put back claims anew.
    simulation.world.despawn(lights[0]);
    simulation.world.entity_mut(lights[2]).remove::<Light>();
    assert_eq!(spawn_light(&mut simulation, Light::point(7.0, 10.0)), 0);
    assert_eq!(simulation.draw_list().lights.records[2].kind, off);
    assert_eq!(spawn_light(&mut simulation, Light::point(7.0, 10.0)), 2);
    simulation.world.entity_mut(lights[2]).insert(Light::point(3.0, 10.0));
    simulation.frame();
    assert_eq!(slot_of(&simulation, lights[2]), 6);

    // An exchange of the component keeps the slot.
    simulation.world.entity_mut(lights[4]).insert(Light::directional(1.0));
    simulation.frame();
    assert_eq!(slot_of(&simulation, lights[4]), 4);
    assert_eq!(simulation.draw_list().lights.records[4].kind, LightRecord::DIRECTIONAL);
}

/// Runs a frame; which of the objects had their selection touched, which light slots were written.
fn frame(simulation: &mut Simulation, objects: &[Entity]) -> (Vec<usize>, Vec<u32>) {
    let ticks = |simulation: &Simulation| -> Vec<_> {
        let tick = |&object: &Entity| simulation.world.entity(object).get_ref::<Selection>().unwrap().last_changed();
        objects.iter().map(tick).collect()
    };
    let before = ticks(simulation);
    simulation.frame();
    let after = ticks(simulation);
    let touched = (0..objects.len()).filter(|&i| before[i] != after[i]).collect();
    (touched, simulation.draw_list().lights.dirty.ranges(0).into_iter().flatten().collect())
}

#[test]
fn only_what_changed_is_selected_and_written() {
    let mut simulation = Simulation::new();
    let place = |i: usize| Vec3::X * (i as f32 * 20.0);
    let lamp = |i| (Light::point(1.0, 8.0), Transform::from_translation(place(i) + Vec3::Y));
    let lights: Vec<Entity> = (0..3).map(|i| simulation.world.spawn(lamp(i)).id()).collect();
    let objects: Vec<Entity> = (0..3).map(|i| spawn_object(&mut simulation.world, place(i))).collect();
    let lights_of = |simulation: &Simulation, i: usize| simulation.world.get::<Selection>(objects[i]).unwrap().lights;
    assert_eq!(frame(&mut simulation, &objects), (vec![0, 1, 2], vec![0, 1, 2]));
    assert_eq!([0, 1, 2].map(|i| lights_of(&simulation, i)[0]), [0, 1, 2]);

    assert_eq!(frame(&mut simulation, &objects), (vec![], vec![]));
    assert!(simulation.world.resource::<LightTable>().changes().is_empty());

    // An object moves to where another light is.
    simulation.world.get_mut::<WorldBounds>(objects[1]).unwrap().0.center = place(2);
    assert_eq!(frame(&mut simulation, &objects), (vec![1], vec![]));
    assert_eq!(lights_of(&simulation, 1)[0], 2);

    // A light leaves; the objects that it lit hear of it, the others do not.
    simulation.world.get_mut::<Transform>(lights[2]).unwrap().translation.y = 1e3;
    assert_eq!(frame(&mut simulation, &objects), (vec![1, 2], vec![2]));
    assert_eq!(lights_of(&simulation, 1), [NO_LIGHT; 3]);

    // A light is written as it was: nothing changed.
    simulation.world.get_mut::<Light>(lights[0]).unwrap().set_changed();
    assert_eq!(frame(&mut simulation, &objects), (vec![], vec![]));
    assert!(simulation.world.resource::<LightTable>().changes().is_empty());

    simulation.world.despawn(lights[0]);
    simulation.frame();
    assert_eq!(lights_of(&simulation, 0), [NO_LIGHT; 3]);

    // Four equal lights: the policy decides between weights 0 and 1.
    simulation.world.spawn_batch((0..4).map(|_| lamp(0)));
    simulation.frame();
    let weights = |simulation: &Simulation| simulation.world.get::<Selection>(objects[0]).unwrap().weights;
    assert_eq!(weights(&simulation), [0.0; 3]);
    simulation.world.insert_resource(LightPolicy::Hard);
    assert_eq!(frame(&mut simulation, &objects), (vec![0], vec![]));
    assert_eq!(weights(&simulation), [1.0; 3]);
}

#[test]
fn a_light_shines_along_the_minus_z_of_its_parent_chain() {
    let mut simulation = Simulation::new();
    let turn = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let parent = simulation.world.spawn(Transform::from_xyz(0.0, 2.0, 0.0).with_rotation(turn)).id();
    let local = Transform::from_xyz(0.0, 0.0, -1.0).with_scale(Vec3::splat(3.0));
    simulation.world.spawn((Light::spot(1.0, 10.0, 0.5), local, ChildOf(parent)));
    simulation.frame();
    let record = simulation.draw_list().lights.records[0];
    assert!(Vec3::from(record.position).distance(Vec3::new(-1.0, 2.0, 0.0)) < 1e-5);
    assert!(Vec3::from(record.direction).distance(Vec3::NEG_X) < 1e-6);
}

/// What happens to a world between two frames.
#[derive(Clone, Debug)]
enum Event {
    MoveObject(Index, Vec3),
    MoveLight(Index, Vec3),
    SpawnObject(Vec3, f32),
    SpawnLight(Light, Vec3),
    DespawnObject(Index),
    DespawnLight(Index),
    /// Off, or on again.
    Switch(Index),
    /// Takes the mesh away, or gives it back.
    Strip(Index),
    Policy(LightPolicy),
}

fn any_event() -> impl Strategy<Value = Event> {
    let place = || any_place(60.0);
    prop_oneof![
        30 => (any::<Index>(), place()).prop_map(|(object, to)| Event::MoveObject(object, to)),
        20 => (any::<Index>(), place()).prop_map(|(light, to)| Event::MoveLight(light, to)),
        15 => (place(), 0.1f32..3.0).prop_map(|(at, radius)| Event::SpawnObject(at, radius)),
        6 => (any_odd_light(), place()).prop_map(|(light, at)| Event::SpawnLight(light, at)),
        8 => any::<Index>().prop_map(Event::DespawnObject),
        4 => any::<Index>().prop_map(Event::DespawnLight),
        6 => any::<Index>().prop_map(Event::Switch),
        4 => any::<Index>().prop_map(Event::Strip),
        1 => prop::sample::select(LightPolicy::ALL.to_vec()).prop_map(|(_, policy)| Event::Policy(policy)),
    ]
}

/// A world of objects without meshes in the library, whose bounds the test alone moves.
struct Living {
    simulation: Simulation,
    objects: Vec<Entity>,
    lights: Vec<Entity>,
}

impl Living {
    fn happen(&mut self, event: &Event) {
        let world = &mut self.simulation.world;
        match event {
            Event::MoveObject(index, to) if !self.objects.is_empty() => {
                world.get_mut::<WorldBounds>(*index.get(&self.objects)).unwrap().0.center = *to;
            }
            Event::MoveLight(index, to) if !self.lights.is_empty() => {
                world.get_mut::<Transform>(*index.get(&self.lights)).unwrap().translation = *to;
            }
            Event::SpawnObject(center, radius) => {
                let sphere = Sphere { center: *center, radius: *radius };
                self.objects.push(world.spawn((MeshId(u32::MAX), WorldBounds(sphere))).id());
            }
            Event::SpawnLight(light, at) => {
                self.lights.push(world.spawn((light.clone(), Transform::from_translation(*at))).id());
            }
            Event::DespawnObject(index) if !self.objects.is_empty() => {
                world.despawn(self.objects.swap_remove(index.index(self.objects.len())));
            }
            Event::DespawnLight(index) if !self.lights.is_empty() => {
                world.despawn(self.lights.swap_remove(index.index(self.lights.len())));
            }
            Event::Switch(index) if !self.lights.is_empty() => {
                let mut light = world.get_mut::<Light>(*index.get(&self.lights)).unwrap();
                light.enabled = !light.enabled;
            }
            Event::Strip(index) if !self.objects.is_empty() => {
                let mut object = world.entity_mut(*index.get(&self.objects));
                if object.contains::<MeshId>() {
                    object.remove::<MeshId>();
                } else {
                    object.insert(MeshId(u32::MAX));
                }
            }
            Event::Policy(policy) => *world.resource_mut::<LightPolicy>() = *policy,
            _ => {}
        }
    }

    /// What every drawn object has, and what it would have if all were searched, the plain way.
    fn compare(&mut self) {
        let world = &mut self.simulation.world;
        let policy = *world.resource::<LightPolicy>();
        let scored = world.resource::<LightTable>().scored().to_vec();
        let mut objects = world.query_filtered::<(&WorldBounds, &Selection), With<MeshId>>();
        let (spheres, found): (Vec<Sphere>, Vec<Selection>) =
            objects.iter(world).map(|(bounds, selection)| (bounds.0, *selection)).unzip();
        let mut expected = vec![Selection::default(); spheres.len()];
        brute_force::select(&scored, policy, &spheres, &mut expected);
        for ((sphere, found), expected) in spheres.iter().zip(&found).zip(&expected) {
            assert_eq!(found, expected, "{sphere:?}");
        }
    }
}

proptest! {
    #![proptest_config(cases(40))]

    /// Things move, come and go for many frames: what was kept equals what is found anew.
    #[test]
    fn what_is_kept_equals_a_full_search(
        objects in prop::collection::vec((any_place(60.0), 0.0f32..3.0), 0..600),
        lights in prop::collection::vec((any_odd_light(), any_place(60.0)), 0..60),
        frames in prop::collection::vec(prop::collection::vec(any_event(), 0..12), 1..25),
    ) {
        let mut living = Living { simulation: Simulation::new(), objects: vec![], lights: vec![] };
        for (center, radius) in objects {
            living.happen(&Event::SpawnObject(center, radius));
        }
        for (mut light, at) in lights {
            // Short enough that most lights reach few of the objects.
            light.range = light.range.min(15.0);
            living.happen(&Event::SpawnLight(light, at));
        }
        living.simulation.frame();
        living.compare();
        for events in frames {
            events.iter().for_each(|event| living.happen(event));
            living.simulation.frame();
            living.compare();
        }
    }
}

/// An object keeps its lights while neither it nor a light that reaches it changes.
#[test]
fn only_those_within_reach_choose_again() {
    let mut simulation = Simulation::new();
    let world = &mut simulation.world;
    let objects: Vec<Entity> = (0..1000)
        .map(|i| spawn_object(world, Vec3::new((i % 100) as f32 * 10.0, 0.0, (i / 100) as f32 * 10.0)))
        .collect();
    let lamps: Vec<Entity> = (0..100)
        .map(|i| world.spawn((Light::point(1.0, 4.0), Transform::from_xyz(i as f32 * 10.0, 2.0, 0.0))).id())
        .collect();
    simulation.frame();
    assert_eq!(simulation.world.resource::<FrameStats>().selected, 1000);
    let selected = |simulation: &mut Simulation| {
        simulation.frame();
        simulation.world.resource::<FrameStats>().selected
    };
    assert_eq!(selected(&mut simulation), 0);
    // A lamp above the first object flickers; only that one sees it.
    simulation.world.get_mut::<Light>(lamps[0]).unwrap().intensity = 2.0;
    assert_eq!(selected(&mut simulation), 1);
    // It moves from the first object to the third: both choose again, the one between does not.
    simulation.world.get_mut::<Transform>(lamps[0]).unwrap().translation.x = 20.0;
    assert_eq!(selected(&mut simulation), 2);
    simulation.world.get_mut::<WorldBounds>(objects[500]).unwrap().0.center.y = 1.0;
    assert_eq!(selected(&mut simulation), 1);
    // The sun reaches all.
    let sun = simulation.world.spawn(Light::directional(0.1)).id();
    assert_eq!(selected(&mut simulation), 1000);
    simulation.world.despawn(sun);
    assert_eq!(selected(&mut simulation), 1000);
    assert_eq!(selected(&mut simulation), 0);
}

/// An ambient cube: two equal pairs of lamps on opposite sides light both, and cancel in the direction; an ambient colour
/// lights all sides alike.
#[test]
fn the_remainder_knows_how_much_comes_from_each_side() {
    let lamp = |x: f32, ambient: f32| {
        let light = Light { ambient: Vec3::splat(ambient), ..Light::point(1.0, 100.0) };
        light_record(&light, &placed(Vec3::X * x, Vec3::NEG_Y))
    };
    let sphere = Sphere { center: Vec3::ZERO, radius: 0.0 };
    let found =
        scene([4.0, 4.0, -4.0, -4.0].map(|x| lamp(x, 0.0)).to_vec(), vec![sphere]).select(LightPolicy::Three)[0];
    let each = irradiance(&lamp(4.0, 0.0), Vec3::ZERO).x;
    assert_eq!(found.weights, [0.0; 3]);
    assert!((found.remainder_sides - Vec3::X * 4.0 * each).length() < 1e-5, "{found:?}");
    assert!(found.remainder_direction.length() < 1e-6);
    // Half of dot(n², sides + sign(n) · dir): two lamps at either end, none across.
    let found =
        scene([4.0, 4.0, -4.0, -4.0].map(|x| lamp(x, 0.5)).to_vec(), vec![sphere]).select(LightPolicy::Three)[0];
    let even = 2.0 * 0.5 * 4.0 * each;
    assert!((found.remainder_sides - Vec3::new(4.0 * each + even, even, even)).length() < 1e-5, "{found:?}");
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

/// Under the policy `All`, every object has a list of exactly the lights whose score for it is above 0.
#[test]
fn all_lights_that_reach_an_object_are_listed() {
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    let object = |i: usize| (cube, Transform::from_xyz((i % 20) as f32 * 3.0, 0.0, (i / 20) as f32 * 3.0));
    let objects: Vec<Entity> = (0..300).map(|i| simulation.world.spawn(object(i)).id()).collect();
    for i in 0..80 {
        let range = 1.0 + (i % 7) as f32;
        simulation
            .world
            .spawn((Light::point(1.0, range), Transform::from_xyz((i * 13 % 60) as f32, 1.0, (i * 7 % 45) as f32)));
    }
    simulation.world.insert_resource(LightPolicy::All);
    let check = |simulation: &mut Simulation| {
        simulation.frame();
        let scored = simulation.world.resource::<LightTable>().scored().to_vec();
        let list = simulation.draw_list();
        let mut objects = 0;
        for (slot, record) in list.instances.records.iter().enumerate() {
            let Some(entity) = simulation.world.iter_entities().find(|e| e.id().index().index() == record.entity)
            else {
                continue;
            };
            let Some(bounds) = entity.get::<WorldBounds>() else { continue };
            let first = list.reaching[slot] as usize;
            let mut listed = list.reaching[first..first + record.reaching as usize].to_vec();
            listed.sort_unstable();
            let reaching =
                scored.iter().zip(0..).filter(|(light, _)| score(light, bounds.0) > 0.0).map(|(_, slot)| slot);
            assert_eq!(listed, reaching.collect::<Vec<u32>>());
            objects += usize::from(record.reaching > 0);
        }
        objects
    };
    assert!(check(&mut simulation) > 100);
    simulation.world.get_mut::<Transform>(objects[3]).unwrap().translation.y = 0.5;
    assert!(check(&mut simulation) > 100);
    simulation.world.insert_resource(LightPolicy::Three);
    simulation.frame();
    assert!(simulation.draw_list().reaching.is_empty());
}
