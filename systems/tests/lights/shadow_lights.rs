//! Selection of the lights with a shadow map: candidates, their importance, and the best of them.

use super::*;
use crate::common;
use glam::Affine3A;
use systems::draw::{Camera, Environment, Projection, View};
use systems::lights::{DARK, Ranked, ShadowLight, ShadowLights, ShadowView, rank, rank_suns};

fn looking(place: Vec3, direction: Vec3) -> Transform {
    Transform::from_translation(place).with_rotation(Quat::from_rotation_arc(Vec3::NEG_Z, direction))
}

/// A view from a place along a direction, of a camera that has a near plane well before it.
fn view(eye: Vec3, direction: Vec3, projection: Projection, exposure: f32) -> ShadowView {
    let place = Affine3A::from_rotation_translation(Quat::from_rotation_arc(Vec3::NEG_Z, direction), eye);
    let camera = Camera { projection, near: 0.5, ..Camera::default() };
    View::new(&place, &camera, 160, 90).shadow_view(&Environment { exposure, ..Environment::default() })
}

fn any_view(extent: f32) -> impl Strategy<Value = ShadowView> {
    let projection = prop_oneof![
        3 => (0.1f32..2.0).prop_map(|fov_y| Projection::Perspective { fov_y, aspect: None }),
        1 => (1.0f32..50.0).prop_map(|half_height| Projection::Orthographic { half_height, aspect: None }),
    ];
    (any_place(extent), any_direction(), projection, prop_oneof![Just(1.0f32), 0.01f32..50.0, Just(0.0)])
        .prop_map(|(eye, direction, projection, exposure)| view(eye, direction, projection, exposure))
}

/// By definition: all of them, in order.
fn plain_rank(lights: &ShadowLights, view: &ShadowView, k: usize) -> Vec<Ranked> {
    let mut all: Vec<(f32, u32)> =
        lights.lights().iter().map(|light| (light.importance(view), light.slot)).filter(|&(i, _)| i > 0.0).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let next = all.get(k).map_or(0.0, |&(importance, _)| importance);
    let fade =
        |importance: f32| 1.0 - (next / importance) * (next / importance) * ((next / importance) * (next / importance));
    all.iter().take(k).map(|&(importance, slot)| Ranked { slot, importance, fade: fade(importance) }).collect()
}

fn bits(ranked: &[Ranked]) -> Vec<(u32, u32, u32)> {
    ranked.iter().map(|r| (r.slot, r.importance.to_bits(), r.fade.to_bits())).collect()
}

/// The importance in double precision from the formula, and how far single precision may be from it.
fn true_importance(light: &LightRecord, view: &ShadowView) -> (f64, f64) {
    let color = Vec3::from(light.color).abs().as_dvec3().dot(common::LUMINANCE);
    let ambient = Vec3::from(light.ambient).abs().as_dvec3().dot(common::LUMINANCE);
    let luminance = color.max(ambient);
    let range = match f64::from(light.inverse_range_squared) {
        0.0 => (luminance * f64::from(view.exposure) / f64::from(DARK)).sqrt(),
        inverse => inverse.sqrt().recip(),
    };
    let (position, axis) = (Vec3::from(light.position).as_dvec3(), Vec3::from(light.direction).as_dvec3());
    let versine = f64::from(light.versine_outer);
    let (cos, sin) = (1.0 - versine, (versine * (2.0 - versine)).sqrt());
    let (middle, radius, flux) = match light.kind {
        LightRecord::POINT => (position, range, luminance),
        _ if cos > sin => (position + axis * (range / 2.0 / cos), range / 2.0 / cos, luminance * versine / 2.0),
        _ => (position + axis * (range * cos), range * sin, luminance * versine / 2.0),
    };
    let radius = radius.max(1e-3);
    let distance = (middle - view.eye.as_dvec3()).length();
    let arriving = flux / (distance * distance + radius * radius / 4.0);
    let mut share = 1.0;
    for plane in view.planes.map(|plane| plane.as_dvec4()) {
        let x = ((plane.truncate().dot(middle) + plane.w + radius) / radius).clamp(0.0, 1.0);
        share *= x * x * (3.0 - 2.0 * x);
    }
    // Places are off by some roundings of the numbers they are made of, and a smoothstep rises by 1.5 at most. The
    // eye's distance, squared, is off by twice as much; of the flux some roundings.
    let reach = middle.length() + position.length() + view.eye.as_dvec3().length() + radius;
    let (place, rounding) = (8.0 * reach * f64::from(f32::EPSILON), 16.0 * f64::from(f32::EPSILON));
    let edges = 5.0 * 1.5 * place / radius;
    let way = 2.0 * distance * place / (distance * distance + radius * radius / 4.0);
    (arriving * share, arriving * (edges + way + rounding) * (1.0 + edges + way))
}

/// The table's lights with shadows are those of the world, and rank as they do by definition.
fn check_lights(simulation: &mut Simulation, view: &ShadowView, k: usize) -> Result<Vec<ShadowLight>, TestCaseError> {
    let world = &mut simulation.world;
    let mut expected: Vec<(u32, f32, LightRecord)> = world
        .query::<(&Light, &GlobalTransform, &LightSlot)>()
        .iter(world)
        .filter(|(light, _, _)| light.shadows)
        .map(|(light, place, slot)| (slot.0, light.shadow_near, light_record(light, place).packed().unpacked()))
        .filter(|(_, _, record)| record.kind != LightRecord::DIRECTIONAL)
        // Packing may leave nothing of a light.
        .filter(|(_, _, record)| ScoredLight::new(record).kind != LightRecord::OFF)
        .collect();
    expected.sort_by_key(|&(slot, _, _)| slot);
    let lights = world.resource::<LightTable>().shadow_lights();
    let found: Vec<(u32, f32)> = lights.lights().iter().map(|light| (light.slot, light.near)).collect();
    prop_assert_eq!(found, expected.iter().map(|&(slot, near, _)| (slot, near)).collect::<Vec<_>>());
    for (slot, _, record) in expected {
        let found = f64::from(lights.get(slot).unwrap().importance(view));
        let (truth, error) = true_importance(&record, view);
        prop_assert!((found - truth).abs() <= error, "{found} for {truth}, ±{error}: {record:?}");
    }
    for k in [0, k, lights.lights().len(), usize::MAX] {
        prop_assert_eq!(bits(&rank(lights, view, k)), bits(&plain_rank(lights, view, k)));
    }
    Ok(lights.lights().to_vec())
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn the_best_are_those_of_the_definition(
        lights in prop::collection::vec((any_odd_light(), any_place(60.0), any_direction(), 1..4usize), 0..200),
        view in any_view(60.0),
        k in 0..60usize,
    ) {
        let mut simulation = Simulation::new();
        for (light, place, direction, copies) in lights {
            // Copies are equally important.
            let light = (light.with_shadows(), looking(place, direction));
            simulation.world.spawn_batch(vec![light; copies]);
        }
        simulation.frame();
        check_lights(&mut simulation, &view, k)?;
    }

    #[test]
    fn the_list_follows_the_lights(
        steps in prop::collection::vec(
            prop::collection::vec((any_odd_light(), any_place(60.0), any::<Index>(), 0..8usize), 0..20),
            1..12,
        ),
        view in any_view(60.0),
    ) {
        let mut simulation = Simulation::new();
        let mut entities: Vec<Entity> = Vec::new();
        let mut before = (Vec::new(), 0);
        for step in steps {
            for (mut light, place, which, change) in step {
                light.shadows = !change.is_multiple_of(3);
                light.shadow_near = 0.01 + 0.1 * change as f32;
                let place = Transform::from_translation(place);
                let world = &mut simulation.world;
                if change < 3 || entities.is_empty() {
                    entities.push(world.spawn((light, place)).id());
                    continue;
                }
                let at = which.index(entities.len());
                match change {
                    3 => {
                        world.despawn(entities.swap_remove(at));
                    }
                    4 => drop(world.entity_mut(entities[at]).remove::<Light>()),
                    5 => *world.get_mut::<Transform>(entities[at]).unwrap() = place,
                    6 => drop(world.get_mut::<Light>(entities[at]).map(|mut light| light.set_changed())),
                    _ => drop(world.entity_mut(entities[at]).insert(light)),
                }
            }
            simulation.frame();
            let lights = check_lights(&mut simulation, &view, 5)?;
            let version = simulation.world.resource::<LightTable>().shadow_lights().version();
            prop_assert_eq!(version, before.1 + u64::from(lights != before.0));
            before = (lights, version);
        }
    }

    /// Else the shadows of a light could come and go where its light is seen.
    #[test]
    fn a_light_without_importance_lights_nothing_in_view(
        light in any_light(),
        place in any_place(40.0),
        direction in any_direction(),
        view in any_view(40.0),
        points in prop::collection::vec(any_place(1.0), 300),
    ) {
        prop_assume!(light.range.is_finite() && view.exposure > 0.0);
        let mut simulation = Simulation::new();
        simulation.world.spawn((light.clone().with_shadows(), looking(place, direction)));
        simulation.frame();
        let is_ranked = !rank(simulation.world.resource::<LightTable>().shadow_lights(), &view, 1).is_empty();
        let record = light_record(&light, &placed(place, direction)).packed().unpacked();
        for point in points {
            let point = place + point * light.range;
            let is_lit = irradiance(&record, point).max_element() > 0.0;
            // By more than places are rounded.
            let is_inside = view.planes.iter().all(|plane| plane.dot(point.extend(1.0)) > 1e-5 * point.length());
            let is_directional = light.kind == LightKind::Directional;
            prop_assert!(is_ranked || is_directional || !(is_lit && is_inside), "{point} is lit");
        }
    }
}

/// Three lamps before the eye and one behind it, with room for two maps.
#[test]
fn a_map_fades_as_the_next_light_comes_near_in_importance() {
    let mut simulation = Simulation::new();
    let lamp = |intensity, z| {
        (Light::point(intensity, 2.0).with_shadows(), Transform::from_translation(Vec3::new(0.0, 0.0, z)))
    };
    let lamps = [lamp(1.0, -10.0), lamp(2.0, -10.0), lamp(1.0, 10.0), lamp(4.0, -10.0)];
    simulation.world.spawn_batch(lamps);
    simulation.world.spawn(Light::point(9.0, 2.0));
    simulation.world.spawn(Light::directional(9.0).with_shadows());
    simulation.frame();
    let lights = simulation.world.resource::<LightTable>().shadow_lights();
    let view = view(Vec3::ZERO, Vec3::NEG_Z, Projection::Perspective { fov_y: 1.0, aspect: None }, 1.0);
    let found = |k| -> Vec<(u32, f64, f64)> {
        let round = |x: f32| (f64::from(x) * 1e5).round() / 1e5;
        rank(lights, &view, k).iter().map(|r| (r.slot, round(r.importance), round(r.fade))).collect()
    };
    // A range of 2 m adds 1 to the squared distance.
    let round = |x: f64| (x * 1e5).round() / 1e5;
    let [one, two, four] = [1.0, 2.0, 4.0].map(|intensity| round(intensity / 101.0));
    assert_eq!(found(2), [(3, four, round(1.0 - 1.0 / 256.0)), (1, two, round(1.0 - 1.0 / 16.0))]);
    assert_eq!(found(1), [(3, four, round(1.0 - 1.0 / 16.0))]);
    assert_eq!(found(3), [(3, four, 1.0), (1, two, 1.0), (0, one, 1.0)]);
    assert_eq!(found(9), found(3));
    assert_eq!(found(0), []);
}

#[test]
fn a_world_without_shadows_has_no_list() {
    let mut simulation = Simulation::new();
    let lamp = simulation.world.spawn(Light::point(1.0, 10.0)).id();
    simulation.frame();
    let version = |simulation: &Simulation| simulation.world.resource::<LightTable>().shadow_lights().version();
    assert_eq!(version(&simulation), 0);
    simulation.world.despawn(lamp);
    simulation.frame();
    assert_eq!(version(&simulation), 0);
}

/// The first of equal suns cast in full; a fainter fifth takes of the fourth what the formula says.
#[test]
fn of_equal_suns_those_in_the_lower_slots_cast_in_full() {
    let ranked = |brightness: &[f32]| {
        let mut simulation = Simulation::new();
        for &intensity in brightness {
            let sun = Light { shadows: true, ..Light::directional(intensity) };
            simulation.world.spawn((sun, Transform::IDENTITY));
        }
        simulation.frame();
        rank_suns(simulation.world.resource::<LightTable>().shadow_lights())
            .iter()
            .map(|sun| (sun.slot, sun.fade))
            .collect::<Vec<_>>()
    };
    assert_eq!(ranked(&[0.1; 5]), [(0, 1.0), (1, 1.0), (2, 1.0), (3, 1.0)]);
    assert_eq!(ranked(&[0.1; 9]), ranked(&[0.1; 5]));
    assert_eq!(ranked(&[0.5, 1.0, 1.0, 1.0, 1.0]), [1, 2, 3, 4].map(|slot| (slot, 0.9375)));
    // The fourth of five equal ones fades as a sixth becomes as bright, and so do the others: 1 − (1/2)⁴.
    assert_eq!(ranked(&[1.0, 1.0, 1.0, 1.0, 1.0, 0.5]), [0, 1, 2, 3].map(|slot| (slot, 0.9375)));
}
