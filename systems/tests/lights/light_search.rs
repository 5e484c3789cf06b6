//! The choice of lights: the plain search against its definition, the fast one against the plain one, weights and
//! residual.

use super::*;
use crate::common::{Scene, scene};
use bevy_tasks::TaskPoolBuilder;
use glam::DVec3;
use std::collections::BTreeMap;
use systems::lights::search::{Level, Scratch, select_sparse};
use systems::lights::{LightTree, select_parallel};

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

/// Falloff in the residual, at the sphere's centre, and the error of single precision. The cut of a classic spot is a
/// smooth step here, from the sphere outside of the cone to the sphere inside. The error is in the angle and in the
/// distances to the edge and to the end of the range: small differences of large numbers.
fn falloff_around(light: &LightRecord, sphere: Sphere) -> (f64, f64) {
    let center = sphere.center.as_dvec3();
    let v = center - Vec3::from(light.position).as_dvec3();
    // At a distance that is so much less, and a cosine that is so much more.
    let at = |light: &LightRecord, error: f64| {
        let mut light = *light;
        if light.kind == LightRecord::SPOT_CONE {
            // An angle that is so much less, but for the second order.
            light.versine_outer += (error * (2.0 * f64::from(light.versine_outer)).sqrt()) as f32;
        }
        true_falloff(&light, center - v * error)
    };
    if light.kind != LightRecord::SPOT_EXPONENT {
        return (at(light, 0.0), (at(light, 1e-6) - at(light, -1e-6)).abs());
    }
    let cos = Vec3::from(light.direction).as_dvec3().normalize().dot(v.normalize_or_zero()).clamp(-1.0, 1.0);
    // From the cone's surface to the centre: the angle between them, seen from the apex.
    let inside = v.length() * ((1.0 - f64::from(light.versine_outer)).acos() - cos.acos()).sin();
    let point = LightRecord { kind: LightRecord::POINT, ..*light };
    let with = |error: f64, power_error: f64| {
        let inside = inside + error * v.length();
        let x = (0.5 + 0.5 * inside / f64::from(sphere.radius.max(1e-6))).clamp(0.0, 1.0);
        let power = (cos + error).clamp(0.0, 1.0).powf(f64::from(light.exponent_or_cone_slope));
        at(&point, error) * (power + power_error) * (x * x * (3.0 - 2.0 * x))
    };
    // As the power of `relevance.rs` says of itself.
    let power_error = if cos < 0.08 { 1e-2 } else { 0.0 };
    (with(0.0, 0.0), with(1e-6, power_error) - with(-1e-6, -power_error))
}

/// w of `enough`.
fn step(x: f64) -> f64 {
    let t = (2.0 * x - 1.0).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Score of a light that is no nearer than half the object's radius.
fn at_half_radius(score: f32, light: &ScoredLight, sphere: Sphere) -> f64 {
    let half = 0.5 * f64::from(sphere.radius.max(0.0));
    let [constant, linear, quadratic, least] = light.denominator.to_array().map(f64::from);
    let most = 1.0 / (constant + half * (linear + half * quadratic)).max(least);
    f64::from(score).min(if light.kind == LightRecord::DIRECTIONAL { f64::INFINITY } else { most })
}

/// The threshold by its definition: the weights leave out what is allowed.
fn threshold(scores: &[(f32, u32)], allowed: f64) -> f64 {
    let scores = || scores.iter().map(|&(score, _)| f64::from(score));
    let left_out = |threshold: f64| scores().map(|score| score * (1.0 - step(score / threshold))).sum::<f64>();
    let (mut low, mut high) = (0.0, 2.0 * scores().fold(0.0, f64::max));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if left_out(middle) <= allowed { low = middle } else { high = middle }
    }
    low
}

/// The answer by sorting all scores, weights and residual straight from their definition; and how far single precision
/// may be off from the residual.
fn brute_force(scene: &Scene, sphere: Sphere, policy: LightPolicy) -> (Selection, f32) {
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
    let (mut ambient, mut direction, mut sides) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    let (mut magnitude, mut error) = (0.0, 0.0);
    let mut add = |slot: u32, weight: f64| {
        let record = &scene.records[slot as usize];
        let color = Vec3::from(record.color).as_dvec3();
        let (falloff, rounding) = falloff_around(record, sphere);
        let part = weight * falloff;
        ambient += part * (color + 4.0 * Vec3::from(record.ambient).as_dvec3());
        let toward = match record.kind {
            LightRecord::DIRECTIONAL => -Vec3::from(record.direction),
            _ => (Vec3::from(record.position) - sphere.center).normalize_or_zero(),
        };
        direction += part * color.dot(LUMINANCE) * toward.as_dvec3();
        let even = 2.0 * Vec3::from(record.ambient).as_dvec3().dot(LUMINANCE);
        sides += part * (color.dot(LUMINANCE).abs() * toward.as_dvec3().abs() + even);
        let most = color.abs().element_sum() + 4.0 * f64::from(record.ambient[2]).abs();
        magnitude += part.abs() * most;
        error += (weight * rounding).abs() * most;
    };
    if policy != LightPolicy::Hard {
        scores.iter().for_each(|&(_, slot)| add(slot, 1.0));
        (0..3).filter(|&i| i < scores.len()).for_each(|i| add(selection.lights[i], -f64::from(selection.weights[i])));
    }
    selection.residual_ambient = ambient.as_vec3();
    selection.residual_direction = direction.as_vec3();
    selection.residual_sides = sides.as_vec3();
    // The edge of a narrow cone is worth a few thousandths in single precision.
    (selection, (5e-3 * magnitude + error) as f32)
}

proptest! {
    #![proptest_config(cases(1000))]

    #[test]
    fn selection_equals_brute_force(
        scene in any_scene(),
        policy in prop::sample::select(vec![LightPolicy::Three, LightPolicy::Hard]),
    ) {
        for (&sphere, found) in scene.spheres.iter().zip(scene.select(policy)) {
            let (expected, error) = brute_force(&scene, sphere, policy);
            prop_assert_eq!(found.lights, expected.lights, "{:?}", sphere);
            prop_assert!(found.weights.iter().zip(expected.weights).all(|(a, b)| (a - b).abs() < 1e-6));
            prop_assert_eq!(found.reaching, expected.reaching);
            prop_assert!((found.dropped - expected.dropped).abs() <= 1e-4 * expected.dropped);
            // At the very range of a light, where the window ends, rounding decides between nothing and next to
            // nothing.
            let colors = scene.records.iter().map(|record| Vec3::from(record.color).abs().max_element());
            let tolerance = error + 1e-8 * colors.fold(0.0, f32::max) + 1e-30;
            prop_assert!((found.residual_ambient - expected.residual_ambient).abs().max_element() <= tolerance,
                "{found:?} {expected:?}");
            prop_assert!((found.residual_sides - expected.residual_sides).abs().max_element() <= tolerance,
                "{found:?} {expected:?}");
            prop_assert!((found.residual_direction - expected.residual_direction).abs().max_element() <= tolerance,
                "{found:?} {expected:?}");
        }
    }

    /// Sufficient lights by the definition in double precision; what is left out stays within the bound, for the values
    /// that shaders get.
    #[test]
    fn no_object_leaves_out_more_than_its_tolerance(
        scene in any_scene(),
        tolerance in prop_oneof![Just(0.0f32), 1e-4f32..0.9],
    ) {
        let (found, further) = scene.select_each(Policies::Same(LightPolicy::Enough(tolerance)));
        let three = scene.select(LightPolicy::Three);
        let mut start = 0;
        for (i, &sphere) in scene.spheres.iter().enumerate() {
            let end = further.ends[i] as usize;
            let listed = further.lights[start..end].iter().map(|light| (light >> 10, (light & 1023) as f32 / 1023.0));
            let own = found[i].lights.into_iter().zip(found[i].weights).filter(|(slot, _)| *slot != NO_LIGHT);
            let weights: BTreeMap<u32, f32> = own.chain(listed).collect();
            start = end;
            let is_finite = sphere.center.is_finite() && sphere.radius.is_finite();
            let mut scores: Vec<(f32, u32)> = scene.scored.iter().zip(0..)
                .map(|(light, slot)| (score(light, sphere), slot)).filter(|s| s.0 > 0.0 && is_finite).collect();
            scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let sum: f64 = scores.iter().map(|s| f64::from(s.0)).sum();
            let counted = scores.iter().map(|s| at_half_radius(s.0, &scene.scored[s.1 as usize], sphere)).sum::<f64>();
            let allowed = f64::from(tolerance) * counted;
            let weight = |slot| f64::from(weights.get(&slot).copied().unwrap_or(0.0));
            let left_out: f64 = scores.iter().map(|s| f64::from(s.0) * (1.0 - weight(s.1))).sum();
            // Each sum of n numbers in single precision is off by n halves of its last bit at most.
            let rounding = 2.0 * scores.len() as f64 * f64::from(f32::EPSILON) * sum;
            prop_assert!(left_out <= allowed + rounding, "{left_out} of {counted}");
            prop_assert!(counted <= sum);
            prop_assert!((f64::from(found[i].dropped) - left_out).abs() <= rounding + 1e-6 * left_out);
            prop_assert!(weights.len() >= scores.len().min(3));
            // Of lights that score the same, all weigh the same but for the three, which never weigh less than alone.
            let threshold = threshold(&scores, allowed);
            for &(score, slot) in &scores {
                let least = three[i].lights.iter().position(|&own| own == slot).map_or(0.0, |n| three[i].weights[n]);
                let expected = step(f64::from(score) / threshold).max(least.into());
                // Up to the next 1023rd. The threshold is found to a 32,768th and where the sum's rounding puts it:
                // steeper than 3 the weight is not, and the sum changes by a share of what is left out at least.
                let error = 3.0 / 32768.0 + if left_out > 0.0 { 8.0 * rounding / left_out } else { 0.0 };
                let over = weight(slot) - expected;
                // Of next to nothing, all of it shines.
                let error = if allowed < 1e-29 { 1.0 } else { error };
                prop_assert!(over >= -error && over <= error + 1.0 / 1023.0, "{over} {score} {threshold} {tolerance}");
            }
        }
    }

    #[test]
    fn selection_is_the_same_for_any_division_of_the_work(
        scene in any_scene(),
        size in 1usize..9,
        policies in prop::collection::vec(any_policy(), 1..20),
    ) {
        // More objects than one task takes.
        let spheres: Vec<Sphere> = scene.spheres.iter().copied().cycle().take(5000).collect();
        let whole = Scene { spheres, ..scene }.clone();
        let each: Vec<LightPolicy> = policies.iter().copied().cycle().take(5000).collect();
        let (expected, further) = whole.select_each(Policies::Each(&each));
        let pieces = whole.spheres[..700].chunks(size).zip(each.chunks(size)).flat_map(|(spheres, each)| {
            let part = Scene { spheres: spheres.to_vec(), ..whole.clone() };
            part.search::<Selection>(Level::new(), Policies::Each(each)).0
        });
        prop_assert!(pieces.eq(expected[..700].iter().copied()));
        let pool = TaskPoolBuilder::new().num_threads(size % 4 + 1).build();
        let tree = LightTree::new(&whole.scored);
        let places: Vec<u32> = (0..5000).map(|i| i * size as u32).collect();
        for places in [None, Some(&places[..])] {
            let mut out = vec![SelectedLights::default(); whole.spheres.len()];
            let work = (&whole.spheres[..], &mut out[..]);
            let listed = select_parallel(&pool, &tree, &whole.scored, Policies::Each(&each), places, work);
            prop_assert!(out.iter().copied().eq(expected.iter().map(SelectedLights::pack)));
            let listed: Vec<u32> = listed.into_iter().flat_map(|further| further.lights).collect();
            prop_assert_eq!(&listed, &further.lights);
        }
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

/// One policy for all, or several by turns.
fn some_policies() -> impl Strategy<Value = Vec<LightPolicy>> {
    prop_oneof![prop::collection::vec(any_policy(), 1), prop::collection::vec(any_policy(), 2..40)]
}

/// Policies of that many objects, in turn; `Err` if one policy is for all of them.
fn for_each(policies: &[LightPolicy], objects: usize) -> Result<Vec<LightPolicy>, LightPolicy> {
    match policies {
        [policy] => Err(*policy),
        policies => Ok(policies.iter().copied().cycle().take(objects).collect()),
    }
}

proptest! {
    #![proptest_config(cases(200))]

    /// Bit for bit, on every instruction set. `PROPTEST_CASES=50000` compares ten million objects.
    #[test]
    fn the_fast_search_equals_the_plain_one(
        scene in any_large_scene(),
        policies in some_policies(),
    ) {
        let policies = for_each(&policies, scene.spheres.len());
        let policies = policies.as_deref().map_err(|&policy| policy).map_or_else(Policies::Same, Policies::Each);
        let (expected, listed) = scene.select_each(policies);
        for level in levels() {
            let (kept, kept_listed) = scene.search::<SelectedLights>(level, policies);
            let (found, found_listed) = scene.search::<Selection>(level, policies);
            for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                prop_assert!(found == expected, "{:?} {level:?}\n{found:?}\n{expected:?}", scene.spheres[i]);
                prop_assert_eq!(kept[i], SelectedLights::pack(expected), "{:?} {:?}", scene.spheres[i], level);
            }
            prop_assert!(found_listed == listed && kept_listed == listed, "{found_listed:?}\n{listed:?} {level:?}");
        }
    }

    /// Some objects of many: in runs, by themselves, far from each other.
    #[test]
    fn a_search_for_some_equals_the_plain_one(
        scene in any_large_scene(),
        policies in some_policies(),
        gaps in prop::collection::vec(prop_oneof![6 => Just(1u32), 2 => 1u32..40, 2 => 40u32..3000], 400),
    ) {
        let ends = gaps.iter().scan(0, |place, gap| { *place += gap; Some(*place) });
        let places: Vec<u32> = ends.cycle().take(scene.spheres.len().min(400)).collect();
        let some = Scene { spheres: scene.spheres[..places.len()].to_vec(), ..scene.clone() };
        let spheres = &some.spheres[..];
        let policies = for_each(&policies, spheres.len());
        let policies = policies.as_deref().map_err(|&policy| policy).map_or_else(Policies::Same, Policies::Each);
        let (expected, listed) = some.select_each(policies);
        let tree = LightTree::new(&scene.scored);
        for level in levels() {
            let mut found = vec![Selection::default(); places.len()];
            let work = (&places[..], spheres, &mut found[..]);
            let mut scratch = Scratch::default();
            select_sparse(level, &tree, &scene.scored, policies, work, &mut scratch);
            for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                prop_assert!(found == expected, "{:?} {level:?}\n{found:?}\n{expected:?}", spheres[i]);
            }
            prop_assert!(scratch.further == listed, "{:?}\n{listed:?} {level:?}", scratch.further);
        }
    }
}

#[test]
fn equal_lights_go_by_slot_and_all_into_the_remainder() {
    let lamp = Light::point(10.0, 50.0);
    let record = light_record(&lamp, &placed(Vec3::Y, Vec3::NEG_Z));
    let sphere = Sphere { center: Vec3::ZERO, radius: 0.5 };
    let four = scene(vec![record; 6], vec![sphere]).select(LightPolicy::Three)[0];
    assert_eq!((four.lights, four.weights), ([0, 1, 2], [0.0; 3]));
    let each = irradiance(&record, Vec3::ZERO);
    assert!((four.residual_ambient - 6.0 * each).length() < 1e-4);
    assert!((four.residual_direction - Vec3::Y * 6.0 * each.x).length() < 1e-4);
    assert!((four.residual_sides - Vec3::Y * 6.0 * each.x).length() < 1e-4);

    let three = scene(vec![record; 3], vec![sphere]).select(LightPolicy::Three)[0];
    assert_eq!((three.lights, three.weights), ([0, 1, 2], [1.0; 3]));
    assert_eq!((three.residual_ambient, three.residual_direction), (Vec3::ZERO, Vec3::ZERO));

    let hard = scene(vec![record; 6], vec![sphere]).select(LightPolicy::Hard)[0];
    assert_eq!((hard.weights, hard.residual_ambient), ([1.0; 3], Vec3::ZERO));

    let none = scene(vec![], vec![sphere]).select(LightPolicy::Three)[0];
    assert_eq!(none, Selection::default());
}

/// A lamp within the bounding sphere would count 10,000 times its intensity if all of the object touched it.
#[test]
fn a_faint_lamp_within_the_bounding_sphere_leaves_no_other_out() {
    let at = |light: Light, place: Vec3| light_record(&light, &placed(place, Vec3::NEG_Z));
    let lamp = |x: f32| at(Light::point(20.0, 50.0).with_attenuation(Light::INVERSE_SQUARE), Vec3::new(x, 4.0, 0.0));
    let mut records: Vec<LightRecord> = [-2.0, -1.0, 0.0, 1.0, 2.0].map(lamp).into();
    records.push(at(Light::point(0.5, 50.0).with_attenuation(Light::INVERSE_SQUARE), Vec3::Y));
    let scene = scene(records, vec![Sphere { center: Vec3::ZERO, radius: 3.0 }]);
    let (found, further) = scene.select_each(Policies::Same(LightPolicy::ENOUGH));
    assert_eq!(found[0].lights[0], 5, "its score is the highest");
    let listed: Vec<(u32, u32)> = further.lights.iter().map(|light| (light >> 10, light & 1023)).collect();
    assert_eq!(found[0].weights, [1.0; 3]);
    assert_eq!(listed.len(), 3);
    // A thousandth of five lamps and a little is half a hundredth of one.
    assert!(listed.iter().all(|&(_, weight)| weight > 1012), "{listed:?}");
}

/// The largest change of any light's weight, and of the residual, between two of many steps of an object along a row
/// of lamps.
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
    let (path, further) = scene(lamps.collect(), spheres.collect()).select_each(Policies::Same(policy));
    let weights = |i: usize| {
        let ends = |i: usize| further.ends.get(i).map_or(0, |&end| end as usize);
        let listed = &further.lights[if i == 0 { 0 } else { ends(i - 1) }..ends(i)];
        let listed = listed.iter().map(|light| (light >> 10, (light & 1023) as f32 / 1023.0));
        path[i].lights.into_iter().zip(path[i].weights).chain(listed).collect::<BTreeMap<u32, f32>>()
    };
    let (mut weight_jump, mut residual_jump) = (0.0f32, 0.0f32);
    for (i, pair) in path.windows(2).enumerate() {
        let (a, b) = (weights(i), weights(i + 1));
        for slot in a.keys().chain(b.keys()).filter(|&&slot| slot != NO_LIGHT) {
            weight_jump = weight_jump.max((a.get(slot).unwrap_or(&0.0) - b.get(slot).unwrap_or(&0.0)).abs());
        }
        residual_jump = residual_jump.max((pair[0].residual_ambient - pair[1].residual_ambient).length());
    }
    (weight_jump, residual_jump)
}

#[test]
fn weights_and_residual_change_smoothly_where_lights_pass_each_other() {
    let (weight, residual) = largest_jump(LightPolicy::Three, 5_000);
    let (weight_finer, residual_finer) = largest_jump(LightPolicy::Three, 50_000);
    // Ten times as many steps are a tenth as large; a jump, which is 1 without weights, would stay.
    assert!(weight < 1.0, "{weight}");
    assert!(weight_finer < weight * 0.2 && residual_finer < residual * 0.2, "{weight_finer} {residual_finer}");
    assert_eq!(largest_jump(LightPolicy::Hard, 50_000).0, 1.0);
    for tolerance in [0.001, 0.02, 0.3] {
        let (weight, residual) = largest_jump(LightPolicy::Enough(tolerance), 5_000);
        let (weight_finer, residual_finer) = largest_jump(LightPolicy::Enough(tolerance), 50_000);
        // Weights have steps of a 1023rd, and so has what they leave out of each of up to 24 lamps.
        let (step, light) = (1.5 / 1023.0, 24.0 * 9.0 / 16.0 * 1.5 / 1023.0);
        assert!(weight < 1.0, "{tolerance}: {weight}");
        assert!(weight_finer < weight * 0.2 + step, "{tolerance}: {weight_finer}, {weight}");
        assert!(residual_finer < residual * 0.2 + light, "{tolerance}: {residual_finer}, {residual}");
    }
}

/// An ambient cube: two equal pairs of lamps on opposite sides light both, and cancel in the direction; an ambient
/// colour lights all sides alike.
#[test]
fn the_residual_knows_how_much_comes_from_each_side() {
    let lamp = |x: f32, ambient: f32| {
        let light = Light { ambient: Vec3::splat(ambient), ..Light::point(1.0, 100.0) };
        light_record(&light, &placed(Vec3::X * x, Vec3::NEG_Y))
    };
    let sphere = Sphere { center: Vec3::ZERO, radius: 0.0 };
    let found =
        scene([4.0, 4.0, -4.0, -4.0].map(|x| lamp(x, 0.0)).to_vec(), vec![sphere]).select(LightPolicy::Three)[0];
    let each = irradiance(&lamp(4.0, 0.0), Vec3::ZERO).x;
    assert_eq!(found.weights, [0.0; 3]);
    assert!((found.residual_sides - Vec3::X * 4.0 * each).length() < 1e-5, "{found:?}");
    assert!(found.residual_direction.length() < 1e-6);
    // Half of dot(n², sides + sign(n) · dir): two lamps at either end, none across.
    let found =
        scene([4.0, 4.0, -4.0, -4.0].map(|x| lamp(x, 0.5)).to_vec(), vec![sphere]).select(LightPolicy::Three)[0];
    let even = 2.0 * 0.5 * 4.0 * each;
    assert!((found.residual_sides - Vec3::new(4.0 * each + even, even, even)).length() < 1e-5, "{found:?}");
}
