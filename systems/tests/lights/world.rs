//! Lights in a world: slots, what is chosen again and what is kept, the lists of the policy `All`.

use super::*;
use bevy_ecs::change_detection::DetectChanges;
use systems::assets::{Mesh, bounds_of};
use systems::draw::LightFeatures;

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
        assert_eq!(record.kind(), LightRecord::OFF, "slot {slot}");
    }
    assert_eq!(*simulation.world.get::<SelectedLights>(object).unwrap(), SelectedLights::default());
    // Negative colours count by magnitude, negative attenuation as none.
    let dark = Light { color: Vec3::new(-1.0, 0.0, 0.0), attenuation: Vec3::new(1.0, -1.0, 0.0), ..lamp };
    let slot = spawn_light(&mut simulation, dark);
    assert_eq!(
        simulation.world.get::<SelectedLights>(object).unwrap().unpack(simulation.world.resource()).lights,
        [slot, NO_LIGHT, NO_LIGHT]
    );
    assert_eq!(simulation.draw_list().lights.records[slot as usize].attenuation, [1.0, 0.0, 0.0]);
}

/// A mesh without triangles whose bounds are the unit sphere.
fn ball(world: &mut World) -> MeshId {
    let mut library = world.resource_mut::<Library>();
    let found = library.mesh_in_slot(0).map(|(id, _)| id);
    found.unwrap_or_else(|| library.add_mesh(Mesh { positions: vec![Vec3::X, Vec3::NEG_X], ..Mesh::default() }))
}

/// Transform of a ball to that centre and radius, metres.
fn filling(center: Vec3, radius: f32) -> Transform {
    Transform::from_translation(center).with_scale(Vec3::splat(radius))
}

fn spawn_object(world: &mut World, center: Vec3) -> Entity {
    let ball = ball(world);
    world.spawn((ball, filling(center, 0.5))).id()
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
    let kinds: Vec<u32> = simulation.draw_list().lights.records.iter().map(|light| light.kind()).collect();
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
    assert_eq!(simulation.draw_list().lights.records[2].kind(), off);
    assert_eq!(spawn_light(&mut simulation, Light::point(7.0, 10.0)), 2);
    simulation.world.entity_mut(lights[2]).insert(Light::point(3.0, 10.0));
    simulation.frame();
    assert_eq!(slot_of(&simulation, lights[2]), 6);

    // An exchange of the component keeps the slot.
    simulation.world.entity_mut(lights[4]).insert(Light::directional(1.0));
    simulation.frame();
    assert_eq!(slot_of(&simulation, lights[4]), 4);
    assert_eq!(simulation.draw_list().lights.records[4].kind(), LightRecord::DIRECTIONAL);
}

/// Colours are packed as multiples of 2⁻¹²⁶ or more: of less than half of it nothing is left.
#[test]
fn a_light_too_dark_to_be_packed_is_off_for_shaders_and_search_alike() {
    let mut simulation = Simulation::new();
    // Without attenuation, so that luminance can divide it.
    spawn_light(&mut simulation, Light { attenuation: Vec3::ZERO, ..Light::point(1e-42, 10.0) }.with_shadows());
    let kind = |simulation: &Simulation| simulation.draw_list().lights.records[0].kind();
    let scored = |simulation: &Simulation| simulation.world.resource::<LightTable>().scored()[0];
    assert_eq!((kind(&simulation), scored(&simulation)), (LightRecord::OFF, ScoredLight::OFF));
    assert!(simulation.world.resource::<LightTable>().shadow_lights().is_empty());
}

/// Runs a frame; which of the objects had their selection touched, which light slots were written.
fn frame(simulation: &mut Simulation, objects: &[Entity]) -> (Vec<usize>, Vec<u32>) {
    let ticks = |simulation: &Simulation| -> Vec<_> {
        let tick =
            |&object: &Entity| simulation.world.entity(object).get_ref::<SelectedLights>().unwrap().last_changed();
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
    simulation.world.insert_resource(LightPolicies::same(LightPolicy::Three));
    let place = |i: usize| Vec3::X * (i as f32 * 20.0);
    let lamp = |i| (Light::point(1.0, 8.0), Transform::from_translation(place(i) + Vec3::Y));
    let lights: Vec<Entity> = (0..3).map(|i| simulation.world.spawn(lamp(i)).id()).collect();
    let objects: Vec<Entity> = (0..3).map(|i| spawn_object(&mut simulation.world, place(i))).collect();
    let lights_of = |simulation: &Simulation, i: usize| {
        simulation.world.get::<SelectedLights>(objects[i]).unwrap().unpack(simulation.world.resource()).lights
    };
    assert_eq!(frame(&mut simulation, &objects), (vec![0, 1, 2], vec![0, 1, 2]));
    assert_eq!([0, 1, 2].map(|i| lights_of(&simulation, i)[0]), [0, 1, 2]);

    assert_eq!(frame(&mut simulation, &objects), (vec![], vec![]));
    assert!(simulation.world.resource::<LightTable>().changes().is_empty());

    // An object moves to where another light is.
    simulation.world.get_mut::<Transform>(objects[1]).unwrap().translation = place(2);
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
    let weights = |simulation: &Simulation| {
        simulation.world.get::<SelectedLights>(objects[0]).unwrap().unpack(simulation.world.resource()).weights
    };
    assert_eq!(weights(&simulation), [0.0; 3]);
    simulation.world.insert_resource(LightPolicies::forced(LightPolicy::Hard));
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
    let record = simulation.draw_list().lights.records[0].unpacked();
    assert!(Vec3::from(record.position).distance(Vec3::new(-1.0, 2.0, 0.0)) < 1e-5);
    assert!(Vec3::from(record.direction).distance(Vec3::NEG_X) < 1e-6);
}

/// Change of a world between two frames.
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
    Policies(LightPolicies),
    /// Gives an object a policy of its own, or takes it.
    Own(Index, Option<LightPolicy>),
}

fn any_event(extent: Vec3) -> impl Strategy<Value = Event> {
    let place = move || any_place(1.0).prop_map(move |place| place * extent);
    prop_oneof![
        30 => (any::<Index>(), place()).prop_map(|(object, to)| Event::MoveObject(object, to)),
        20 => (any::<Index>(), place()).prop_map(|(light, to)| Event::MoveLight(light, to)),
        15 => (place(), 0.1f32..3.0).prop_map(|(at, radius)| Event::SpawnObject(at, radius)),
        6 => (any_odd_light(), place()).prop_map(|(light, at)| Event::SpawnLight(light, at)),
        8 => any::<Index>().prop_map(Event::DespawnObject),
        4 => any::<Index>().prop_map(Event::DespawnLight),
        6 => any::<Index>().prop_map(Event::Switch),
        4 => any::<Index>().prop_map(Event::Strip),
        1 => (any_policy(), any_policy(), prop::option::weighted(0.3, any_policy())).prop_map(
            |(objects, pieces, forced)| Event::Policies(LightPolicies { objects, pieces, forced })),
        4 => (any::<Index>(), prop::option::of(any_policy())).prop_map(|(object, own)| Event::Own(object, own)),
    ]
}

/// A world of objects that come and go.
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
                world.get_mut::<Transform>(*index.get(&self.objects)).unwrap().translation = *to;
            }
            Event::MoveLight(index, to) if !self.lights.is_empty() => {
                world.get_mut::<Transform>(*index.get(&self.lights)).unwrap().translation = *to;
            }
            Event::SpawnObject(center, radius) => {
                let ball = ball(world);
                self.objects.push(world.spawn((ball, filling(*center, *radius))).id());
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
                let ball = ball(world);
                let mut object = world.entity_mut(*index.get(&self.objects));
                if object.contains::<MeshId>() {
                    object.remove::<MeshId>();
                } else {
                    object.insert(ball);
                }
            }
            Event::Policies(policies) => *world.resource_mut::<LightPolicies>() = *policies,
            Event::Own(index, own) if !self.objects.is_empty() => {
                let mut object = world.entity_mut(*index.get(&self.objects));
                match own {
                    Some(policy) => object.insert(*policy),
                    None => object.remove::<LightPolicy>(),
                };
            }
            _ => {}
        }
    }

    /// Compares the selection of every drawn object with a plain search of all lights.
    fn compare(&mut self) {
        let world = &mut self.simulation.world;
        let policies = *world.resource::<LightPolicies>();
        let scored = world.resource::<LightTable>().scored().to_vec();
        let mut objects = world.query::<(&MeshId, &GlobalTransform, &SelectedLights, Option<&LightPolicy>)>();
        let library = world.resource::<Library>();
        let sphere = |mesh, place| world_bounds(library, mesh, place).unwrap();
        let lists = world.resource::<LightLists>();
        let (mut listed, mut objects_listed) = (0, 0);
        for (&mesh, place, selected, own) in objects.iter(world) {
            let sphere = sphere(mesh, place);
            let policy = policies.forced.or(own.copied()).unwrap_or(policies.objects);
            let mut expected = [Selection::default()];
            let further = brute_force::select(&scored, Policies::Same(policy), &[sphere], &mut expected);
            assert_kept(lists, selected, &expected[0], &further.lights);
            let (found, _) = lists.of(selected);
            listed += found.len() as u64;
            objects_listed += usize::from(!found.is_empty());
        }
        assert_eq!((lists.len(), lists.lights()), (objects_listed, listed), "lists of objects that are gone");
    }
}

proptest! {
    #![proptest_config(cases(40))]

    /// Things move, come and go for many frames: what was kept equals what is found anew.
    #[test]
    fn what_is_kept_equals_a_full_search(
        objects in prop::collection::vec((any_place(60.0), 0.0f32..3.0), 0..600),
        lights in prop::collection::vec((any_odd_light(), any_place(60.0)), 0..60),
        frames in prop::collection::vec(prop::collection::vec(any_event(Vec3::splat(60.0)), 0..12), 1..25),
    ) {
        live(objects, lights, frames);
    }
}

/// Half extents of the world of [`what_is_kept_among_many_equals_a_full_search`], metres.
const WIDE: Vec3 = Vec3::new(300.0, 20.0, 300.0);

proptest! {
    #![proptest_config(cases(6))]

    /// Little happens among thousands of objects and lights.
    #[test]
    fn what_is_kept_among_many_equals_a_full_search(
        objects in prop::collection::vec((any_place(1.0).prop_map(|place| place * WIDE), 0.0f32..3.0), 3000..5000),
        lights in prop::collection::vec((any_odd_light(), any_place(1.0).prop_map(|place| place * WIDE)), 2100..2600),
        frames in prop::collection::vec(prop::collection::vec(any_event(WIDE), 0..60), 1..5),
    ) {
        // The sun of one frame would wake all.
        let lights = lights.into_iter().filter(|(light, _)| light.kind != LightKind::Directional).collect();
        live(objects, lights, frames);
    }
}

/// Enough objects, in two tables, for several tasks to look through those that moved: more of them than are listed at a
/// time.
#[test]
fn what_is_kept_by_several_tasks_equals_a_full_search() {
    #[derive(Component)]
    struct Marked;
    systems::set_threads(Some(4));
    let mut living = Living { simulation: Simulation::new(), objects: vec![], lights: vec![] };
    let at = |i: usize| Vec3::new((i * 7 % 131) as f32 * 2.0, 0.0, (i * 11 % 127) as f32 * 2.0);
    for i in 0..15_000 {
        living.happen(&Event::SpawnObject(at(i), 0.5));
        if i % 5 == 0 {
            living.simulation.world.entity_mut(living.objects[i]).insert(Marked);
        }
    }
    for i in 0..40 {
        living.happen(&Event::SpawnLight(Light::point(1.0 + i as f32, 40.0), at(i * 300) + Vec3::Y));
    }
    living.simulation.frame();
    living.compare();
    for (frame, step) in [3, 1, 17, 50, 3].into_iter().enumerate() {
        for i in (frame..15_000).step_by(step) {
            living.simulation.world.get_mut::<Transform>(living.objects[i]).unwrap().translation = at(i + frame * 1000);
        }
        (0..100).for_each(|i| living.happen(&Event::SpawnObject(at(i * 150), 1.0)));
        living.simulation.frame();
        living.compare();
    }
}

/// Objects that move for so long that they get places of their own; others come and go.
#[test]
fn what_is_kept_of_what_moves_for_long_equals_a_full_search() {
    let mut living = Living { simulation: Simulation::new(), objects: vec![], lights: vec![] };
    let at = |i: usize| Vec3::new((i % 60) as f32 * 2.0, 0.0, (i / 60) as f32 * 2.0);
    for i in 0..3600 {
        living.happen(&Event::SpawnObject(at(i), 0.5));
    }
    for i in 0..60 {
        living.happen(&Event::SpawnLight(Light::point(1.0 + i as f32, 6.0), at(i * 59) + Vec3::Y));
    }
    let mut movers: Vec<Entity> = living.objects.iter().copied().step_by(24).collect();
    let mut selected = Vec::new();
    for frame in 0..110 {
        for (i, &mover) in movers.iter().enumerate() {
            let place = &mut living.simulation.world.get_mut::<Transform>(mover).unwrap().translation;
            // To and fro, so that they stay among the lamps.
            let turn = if frame / 10 % 2 == 0 { 0.5 } else { -0.5 };
            *place += Vec3::new((i % 7) as f32 - 3.0, 0.0, (i % 5) as f32 - 2.5) * turn;
        }
        let lamp = living.lights[frame % 60];
        living.simulation.world.get_mut::<Transform>(lamp).unwrap().translation.x += 1.0;
        if frame % 9 == 0 {
            // One that stands, and two that move.
            let mut mover = || movers.swap_remove(frame % 50);
            let gone = [living.objects[frame * 7 % 1000], mover(), mover()];
            living.objects.retain(|object| !gone.contains(object));
            movers.retain(|object| !gone.contains(object));
            gone.iter().for_each(|&object| _ = living.simulation.world.try_despawn(object));
        } else if frame % 9 == 5 {
            for i in 0..3 {
                living.happen(&Event::SpawnObject(at(frame * 31 + i), 1.0));
                movers.extend(living.objects.last());
            }
        }
        living.simulation.frame();
        selected.push(living.simulation.world.resource::<FrameStats>().selected);
        living.compare();
    }
    assert!(selected[1..].iter().all(|&selected| (140..900).contains(&selected)), "some choose again: {selected:?}");
}

fn live(objects: Vec<(Vec3, f32)>, lights: Vec<(Light, Vec3)>, frames: Vec<Vec<Event>>) {
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
    simulation.world.get_mut::<Transform>(objects[500]).unwrap().translation.y = 1.0;
    assert_eq!(selected(&mut simulation), 1);
    // The sun reaches all.
    let sun = simulation.world.spawn(Light::directional(0.1)).id();
    assert_eq!(selected(&mut simulation), 1000);
    simulation.world.despawn(sun);
    assert_eq!(selected(&mut simulation), 1000);
    assert_eq!(selected(&mut simulation), 0);
}

/// Under the policy `All`, every object has exactly the lights whose score for it is above 0. A list is written when its
/// object chooses again, and no other.
#[test]
fn all_lights_that_reach_an_object_are_listed() {
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    let object = |i: usize| (cube, Transform::from_xyz((i % 20) as f32 * 3.0, 0.0, (i / 20) as f32 * 3.0));
    let objects: Vec<Entity> = (0..300).map(|i| simulation.world.spawn(object(i)).id()).collect();
    for i in 0..80 {
        let range = 4.0 + (i % 7) as f32;
        simulation
            .world
            .spawn((Light::point(1.0, range), Transform::from_xyz((i * 13 % 60) as f32, 1.0, (i * 7 % 45) as f32)));
    }
    simulation.world.insert_resource(LightPolicies::forced(LightPolicy::All));
    let check = |simulation: &mut Simulation| {
        simulation.frame();
        let scored = simulation.world.resource::<LightTable>().scored();
        let lists = simulation.world.resource::<LightLists>();
        for &object in &objects {
            let selected = simulation.world.get::<SelectedLights>(object).unwrap();
            let bounds = bounds_of(&simulation.world, object).unwrap();
            let (further, reaching) = lists.of(selected);
            assert!(further.iter().all(|&(_, weight)| weight == 1.0));
            let own = selected.unpack(lists).lights.into_iter().filter(|&slot| slot != NO_LIGHT);
            let mut listed: Vec<u32> = own.chain(further.iter().map(|light| light.0)).collect();
            listed.sort_unstable();
            let expected = scored.iter().zip(0..).filter(|(light, _)| score(light, bounds) > 0.0).map(|(_, slot)| slot);
            assert_eq!(listed, expected.collect::<Vec<u32>>());
            assert_eq!(listed.len(), reaching as usize);
        }
        let written = lists.pages().dirty.ranges(0).iter().map(ExactSizeIterator::len).sum::<usize>();
        (lists.len(), written)
    };
    let (lists, written) = check(&mut simulation);
    assert!(lists > 100 && written >= lists, "{lists} {written}");
    assert_eq!(check(&mut simulation), (lists, 0), "nothing changed");
    simulation.world.get_mut::<Transform>(objects[45]).unwrap().translation.x += 2.0;
    let (after, written) = check(&mut simulation);
    assert!(after.abs_diff(lists) <= 1 && (1..=4).contains(&written), "{written}");
    simulation.world.insert_resource(LightPolicies::forced(LightPolicy::Three));
    simulation.frame();
    let lists = simulation.world.resource::<LightLists>();
    assert!(lists.is_empty() && lists.pages().records.is_empty() && lists.lights() == 0);
}

/// With few lights, too, only those that a changed light reaches choose again.
#[test]
fn one_of_few_lights_wakes_only_those_it_reaches() {
    let mut simulation = Simulation::new();
    for i in 0..100 {
        spawn_object(&mut simulation.world, Vec3::X * (i as f32 * 10.0));
    }
    let lamp = |i: usize| (Light::point(1.0, 4.0), Transform::from_xyz(i as f32 * 100.0, 1.0, 0.0));
    let lamps: Vec<Entity> = (0..5).map(|i| simulation.world.spawn(lamp(i)).id()).collect();
    simulation.frame();
    simulation.world.get_mut::<Light>(lamps[2]).unwrap().intensity = 2.0;
    simulation.frame();
    assert_eq!(simulation.world.resource::<FrameStats>().selected, 1);
}

/// An object that is not finite has no lights under any policy; nor does it take those of the object before it.
#[test]
fn what_is_not_finite_has_an_empty_list() {
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    simulation.world.spawn((cube, Transform::default()));
    simulation.world.spawn((cube, Transform::from_scale(Vec3::splat(f32::MAX))));
    simulation.world.spawn((Light::point(1.0, 10.0), Transform::from_xyz(0.0, 2.0, 0.0)));
    simulation.world.insert_resource(LightPolicies::forced(LightPolicy::All));
    simulation.frame();
    let counts: Vec<u32> = simulation.instance_records().drawn().map(|record| record.reaching_or_list).collect();
    assert_eq!(counts, [1, 0]);
}

/// A copy of an object has the lights of its own place.
#[test]
fn a_copy_of_an_object_chooses_for_itself() {
    let mut simulation = Simulation::new();
    let object = spawn_object(&mut simulation.world, Vec3::ZERO);
    let slots = [0.0, 50.0].map(|x| {
        let lamp = simulation.world.spawn((Light::point(1.0, 5.0), Transform::from_xyz(x, 1.0, 0.0))).id();
        simulation.frame();
        slot_of(&simulation, lamp)
    });
    let copy = simulation.world.entity_mut(object).clone_and_spawn();
    simulation.world.get_mut::<Transform>(copy).unwrap().translation.x = 50.0;
    simulation.frame();
    let first =
        |entity| simulation.world.get::<SelectedLights>(entity).unwrap().unpack(simulation.world.resource()).lights[0];
    assert_eq!([first(object), first(copy)], slots);
}

#[test]
fn what_some_light_has_or_had_counts_whether_it_is_on_or_off() {
    let mut simulation = Simulation::new();
    let mut add = |light: Light| {
        let entity = simulation.world.spawn((light, Transform::default())).id();
        simulation.frame();
        let LightFeatures { attenuation, cones, exponents, ambient, .. } = simulation.draw_list().light_features;
        simulation.world.despawn(entity);
        [attenuation, cones, exponents, ambient]
    };
    let point = Light::point(1.0, 10.0).with_attenuation(Light::INVERSE_SQUARE);
    assert_eq!(add(point.clone()), [false; 4]);
    assert_eq!(add(Light::directional(1.0)), [false; 4]);
    let off = Light { enabled: false, ..Light::spot(1.0, 10.0, 0.5).with_attenuation(Light::INVERSE_SQUARE) };
    assert_eq!(add(off.clone()), [false, true, false, false]);
    let kind = LightKind::Spot { outer: 0.5, inner: None, exponent: 8.0 };
    assert_eq!(add(Light { kind, ..off }), [false, true, true, false]);
    assert_eq!(add(Light { ambient: Vec3::X, ..point.clone() }), [false, true, true, true]);
    assert_eq!(add(Light::point(1.0, 10.0)), [true; 4]);
    assert_eq!(add(point), [true; 4], "what was there stays");
}
