//! The state of a busy world: hashed, saved, restored and continued.

use super::*;
use systems::assets::MeshVariants;
use systems::draw::pieces;
use systems::ecs::clock::{Clock, Seed};
use systems::run::inputs::{Inputs, SavedInput, apply_queued};
use systems::run::registry::{self, EntityRegistry, StateId, register_all};
use systems::run::snapshot;
use systems::run::spawn::Spawn;
use systems::run::standard_inputs::{
    Despawn, Drive, EditLight, Hide, NextMeshVariant, SetManualControl, SetSignal, SetTransform,
};
use systems::run::state::StateList;
use systems::run::state_hash::{StateHash, hash};
use systems::space::Spin;
use systems::space::origin::Origin;
use systems::vehicles::lamps::LampKind;
use systems::vehicles::parts::{Movement, Part, PartLamp};
use systems::vehicles::signals::{Aspect, HeldSignals, Signal, SignalHead, SignalLamp, Signals};
use systems::vehicles::{
    Controls, Indicator, ManualControl, Motion, Vehicle, VehicleNumber, VehicleType, VehicleTypes,
};

/// Spinning arms with lamps at their ends, some of them hidden, a figure, and a road in pieces.
fn busy() -> Simulation {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let meshes = vec![library.add_mesh(shapes::cube(Vec3::ONE)), library.add_mesh(shapes::sphere(0.5, 8, 4))];
    let road = library.add_mesh(shapes::plane(glam::Vec2::new(2.0, 40.0), glam::UVec2::ONE));
    let glass = library.add_material(Material::default());
    let lit = library.add_material(Material { emissive_factor: Vec3::ONE, ..Material::default() });
    let kind = simulation.world.resource_mut::<VehicleTypes>().add(van(meshes[0], glass, lit));
    let world = &mut simulation.world;
    for i in 0..40 {
        let start = Quat::from_rotation_y(i as f32);
        let spin = Spin { axis: Vec3::Y, rate: 0.1 + i as f32 * 0.05, start };
        let arm = world.spawn((spin, meshes[i % 2], Transform::from_xyz(i as f32, 0.0, 0.0))).id();
        let elbow = world.spawn((spin, Transform::from_xyz(0.0, 0.0, 1.0), ChildOf(arm))).id();
        let lamp = world.spawn((Light::point(1.0 + i as f32, 5.0), Transform::from_xyz(0.0, 0.5, 1.0), ChildOf(elbow)));
        let lamp = lamp.id();
        if i % 7 == 0 {
            world.entity_mut(lamp).insert(Hidden);
        }
    }
    world.spawn((meshes[0], MeshVariants { meshes, shown: 0 }));
    for i in 0..5 {
        let motion = Motion { speed: 3.0 - f64::from(i), ..Motion::default() };
        let indicator = if i % 2 == 0 { Indicator::Hazard } else { Indicator::Off };
        let controls = Controls { indicator, ..Controls::default() };
        world.spawn((Transform::from_xyz(0.0, 0.0, i as f32), motion, controls, Vehicle::of(kind)));
    }
    let road = world.spawn(road).id();
    pieces::draw_in_pieces(world, road, 8.0);
    let signal = Signal { name: "crossing".into(), green: vec![4.0, 2.0], amber: 1.0, red: 1.0, offset: 0.0 };
    world.insert_resource(Signals::new(vec![signal]));
    register_all(world);
    simulation
}

/// A wheel and a lamp.
fn van(mesh: MeshId, glass: MaterialId, lit: MaterialId) -> VehicleType {
    let drawn = Some((mesh, glass));
    let lamp = PartLamp { kind: LampKind::IndicatorLeft, light: Some(Light::point(1.0, 2.0)), lit: Some(lit) };
    let movement = Some(Movement::Wheel { radius: 0.3, steers: true });
    let parts = vec![Part { drawn, movement, ..Part::default() }, Part { drawn, lamp: Some(lamp), ..Part::default() }];
    VehicleType { name: "van".into(), parts, ..VehicleType::default() }
}

/// Stands for what moves vehicles: as far as they are steered, by the throttle.
fn roll(mut vehicles: Query<(&mut Motion, &Controls, &mut Transform)>) {
    for (mut motion, controls, mut transform) in &mut vehicles {
        motion.speed += f64::from(controls.throttle) * 0.01;
        motion.steering = controls.steer;
        motion.rolled += motion.speed / 60.0;
        transform.translation.x += motion.speed as f32 / 60.0;
    }
}

fn vehicle(i: u64) -> Spawn {
    let transform = Transform::from_xyz(0.0, 0.0, i as f32);
    let controls = Controls { throttle: 0.5, indicator: Indicator::Left, ..Controls::default() };
    let (name, kind) = (format!("van {i}"), if i.is_multiple_of(2) { "van" } else { "none such" });
    Spawn::Vehicle { name, transform, kind: kind.into(), paint: 0, controls, manual: i.is_multiple_of(3) }
}

fn lamp(i: u64) -> Spawn {
    let place = Vec3::new(i as f32, 1.0, 2.0);
    Spawn::Light {
        name: format!("lamp {i}"),
        transform: Transform::from_translation(place),
        light: Light::point(2.0, 9.0),
    }
}

fn held(is_held: bool) -> SetSignal {
    SetSignal { signal: "crossing".into(), shows: is_held.then(|| vec![Aspect::Red, Aspect::Green]) }
}

/// Inputs at a step of a run.
fn inputs_at(step: u64) -> Vec<SavedInput> {
    let id = |n: u64| StateId((n % 120) as u32);
    let mut inputs = Vec::new();
    let mut add = |input: SavedInput| inputs.push(input);
    if step.is_multiple_of(5) {
        add(SavedInput::of(&lamp(step)));
    }
    if step % 13 == 4 {
        add(SavedInput::of(&vehicle(step)));
        let vehicle = StateId(121 + (step % 5) as u32 * 3);
        let controls = Controls { steer: (step as f32 * 0.1).sin(), throttle: -0.2, ..Controls::default() };
        add(SavedInput::of(&Drive { vehicle, controls }));
        add(SavedInput::of(&SetManualControl { vehicle, manual: step.is_multiple_of(2) }));
    }
    if step % 11 == 3 {
        // Some of what came.
        add(SavedInput::of(&Despawn(StateId(137 + (step / 11 * 2) as u32))));
        add(SavedInput::of(&Despawn(id(step * 3))));
    }
    if step % 4 == 1 {
        let light = Light::spot(step as f32, 8.0, 0.4).with_shadows();
        add(SavedInput::of(&EditLight { entity: id(step * 3 + 2), light }));
        add(SavedInput::of(&SetTransform { entity: id(step), transform: Transform::from_xyz(0.0, step as f32, 0.0) }));
        add(SavedInput::of(&Hide { entity: id(step + 1), hidden: step % 8 == 1 }));
    }
    if step % 9 == 2 {
        add(SavedInput::of(&NextMeshVariant));
    }
    if step % 17 == 6 {
        add(SavedInput::of(&held(step.is_multiple_of(2))));
    }
    inputs
}

fn step(simulation: &mut Simulation) -> StateHash {
    let now = simulation.world.resource::<Clock>().step;
    inputs_at(now).into_iter().for_each(|input| simulation.world.resource_mut::<Inputs>().push_saved(input));
    simulation.step();
    simulation.world.run_system_cached(roll).expect("rolls");
    hash(&mut simulation.world)
}

#[test]
fn runs_are_equal_whether_frames_are_drawn_and_how() {
    let (mut plain, mut watched) = (busy(), busy());
    watched.world.insert_resource(Interpolation { enabled: true, fraction: 0.3 });
    let mut seen = std::collections::HashSet::new();
    for i in 0..200 {
        let now = step(&mut plain);
        assert!(seen.insert(now), "step {i} is like one before");
        assert_eq!(step(&mut watched), now, "step {i}");
        (0..i % 3).for_each(|_| watched.frame());
    }
}

#[test]
fn a_run_continued_from_a_snapshot_is_the_same_run() {
    let mut whole = busy();
    (0..100).for_each(|_| _ = step(&mut whole));
    let saved = snapshot::save(&mut whole.world);
    let mut continued = busy();
    // Other places in memory than the run before.
    let strangers = [(); 9].map(|()| continued.world.spawn_empty().id());
    strangers.into_iter().step_by(2).for_each(|entity| _ = continued.world.despawn(entity));
    snapshot::restore(&mut continued.world, &saved).expect("a snapshot of this scene");
    assert_eq!(hash(&mut continued.world), hash(&mut whole.world));
    assert_eq!(snapshot::save(&mut continued.world), saved);
    for i in 100..600 {
        assert_eq!(step(&mut continued), step(&mut whole), "step {i}");
    }
    let objects = |simulation: &mut Simulation| {
        simulation.frame();
        simulation.draw_list().batches.iter().map(|batch| batch.pages.len()).collect::<Vec<_>>()
    };
    assert_eq!(objects(&mut continued), objects(&mut whole), "pieces go with what they are pieces of");
}

#[test]
fn whatever_is_state_counts_and_comes_back() {
    let fresh = hash(&mut busy().world);
    type Change = fn(&mut World, &dyn Fn(u32) -> Entity);
    let changes: [(&str, Change); 17] = [
        ("a place", |world, of| world.get_mut::<Transform>(of(4)).expect("there").translation.x += 1e-6),
        ("a sign", |world, of| world.get_mut::<Transform>(of(1)).expect("there").translation.x = -0.0),
        ("a light", |world, of| world.get_mut::<Light>(of(2)).expect("there").enabled = false),
        ("a spin", |world, of| world.get_mut::<Spin>(of(0)).expect("there").rate += 1.0),
        ("a figure", |world, of| world.get_mut::<MeshVariants>(of(120)).expect("there").shown = 1),
        ("hidden", |world, of| _ = world.entity_mut(of(3)).insert(Hidden)),
        ("shown", |world, of| _ = world.entity_mut(of(2)).remove::<Hidden>()),
        ("a parent", |world, of| _ = world.entity_mut(of(4)).insert(ChildOf(of(0)))),
        ("a motion", |world, of| world.get_mut::<Motion>(of(121)).expect("there").rolled += 1.0),
        ("a place in 64 bits", |world, of| world.get_mut::<Motion>(of(121)).expect("there").place.x += 1e-9),
        ("controls", |world, of| world.get_mut::<Controls>(of(121)).expect("there").brake = 0.5),
        ("a wheel", |world, of| _ = world.entity_mut(of(124)).insert(ManualControl)),
        ("glass", |world, of| _ = world.entity_mut(of(123)).insert(MaterialId::DEFAULT)),
        ("a number", |world, of| world.get_mut::<VehicleNumber>(of(121)).expect("there").0 = 9),
        ("the time", |world, _| world.resource_mut::<Clock>().step += 1),
        ("a held signal", |world, _| {
            world.resource_mut::<HeldSignals>().0.insert("crossing".into(), vec![Aspect::Red, Aspect::Red]);
        }),
        ("the seed", |world, _| world.resource_mut::<Seed>().0 += 1),
    ];
    for (what, change) in changes {
        let mut simulation = busy();
        let entities: Vec<Entity> =
            simulation.world.resource::<EntityRegistry>().iter().map(|(_, entity)| entity).collect();
        change(&mut simulation.world, &|id| entities[id as usize]);
        let changed = hash(&mut simulation.world);
        assert_ne!(changed, fresh, "{what}");
        let mut other = busy();
        snapshot::restore(&mut other.world, &snapshot::save(&mut simulation.world)).expect("a snapshot");
        assert_eq!(hash(&mut other.world), changed, "{what}");
    }
    let mut swapped = busy();
    let [a, b] = [0, 3].map(|id| swapped.world.resource::<EntityRegistry>().entity(StateId(id)).expect("an arm"));
    let [mut a, mut b] = swapped.world.entity_mut([a, b]).map(|entity| entity.into_mut::<Transform>().expect("there"));
    std::mem::swap(&mut *a, &mut *b);
    assert_ne!(hash(&mut swapped.world), fresh, "which is where");
    let mut viewed = busy();
    let mut clock = viewed.world.resource_mut::<Clock>();
    (clock.paused, clock.speed) = (true, 3.0);
    assert_eq!(hash(&mut viewed.world), fresh, "how time is looked at");
}

/// Each input that there is, and the same change by hand.
#[test]
fn inputs_change_what_they_name_and_nothing_else() {
    let light = Light { shadow_near: 0.2, ..Light::spot(3.0, 8.0, 0.4).with_shadows() };
    let place = Transform::from_xyz(1.0, 2.0, 3.0);
    let controls = Controls { throttle: 0.25, ..Controls::default() };
    let by_input = |input: SavedInput| {
        let mut simulation = busy();
        simulation.world.resource_mut::<Inputs>().push_saved(input.clone());
        assert_eq!(apply_queued(&mut simulation.world), [input]);
        hash(&mut simulation.world)
    };
    type Change<'a> = &'a dyn Fn(&mut World, &dyn Fn(u32) -> Entity);
    let changes: [(SavedInput, Change); 9] = [
        (SavedInput::of(&EditLight { entity: StateId(2), light: light.clone() }), &|world, of| {
            *world.get_mut::<Light>(of(2)).expect("there") = light.clone();
        }),
        (SavedInput::of(&SetTransform { entity: StateId(4), transform: place }), &|world, of| {
            *world.get_mut::<Transform>(of(4)).expect("there") = place;
        }),
        (SavedInput::of(&Hide { entity: StateId(3), hidden: true }), &|world, of| {
            world.entity_mut(of(3)).insert(Hidden);
        }),
        (SavedInput::of(&NextMeshVariant), &|world, of| {
            let mut figure = world.get_mut::<MeshVariants>(of(120)).expect("there");
            figure.shown = 1;
            let mesh = figure.meshes[1];
            world.entity_mut(of(120)).insert(mesh);
        }),
        (SavedInput::of(&Drive { vehicle: StateId(121), controls }), &|world, of| {
            *world.get_mut::<Controls>(of(121)).expect("there") = controls;
        }),
        (SavedInput::of(&SetManualControl { vehicle: StateId(124), manual: true }), &|world, of| {
            world.entity_mut(of(124)).insert(ManualControl);
        }),
        (SavedInput::of(&held(true)), &|world, _| {
            world.resource_mut::<HeldSignals>().0.insert("crossing".into(), vec![Aspect::Red, Aspect::Green]);
        }),
        (SavedInput::of(&lamp(7)), &|world, _| _ = registry::spawn(world, lamp(7))),
        (SavedInput::of(&Despawn(StateId(0))), &|world, of| _ = world.despawn(of(0))),
    ];
    let fresh = hash(&mut busy().world);
    for (input, change) in changes {
        let mut simulation = busy();
        let entities: Vec<Entity> =
            simulation.world.resource::<EntityRegistry>().iter().map(|(_, entity)| entity).collect();
        change(&mut simulation.world, &|id| entities[id as usize]);
        let changed = hash(&mut simulation.world);
        assert_ne!(changed, fresh, "{input:?}");
        assert_eq!(by_input(input.clone()), changed, "{input:?}");
    }
}

/// Whatever the lamps of a head showed before: in the world that the snapshot is of, in a new one, and in one that a
/// program has switched a lamp of.
#[test]
fn what_signal_heads_show_is_restored_with_their_lamps() {
    let scene = || {
        let mut simulation = Simulation::new();
        let signal = Signal { name: "crossing".into(), green: vec![0.5, 0.5], amber: 0.2, red: 0.1, offset: 0.0 };
        simulation.world.insert_resource(Signals::new(vec![signal]));
        let head = simulation.world.spawn(SignalHead { head: 0, shown: None }).id();
        let lamps = [Aspect::Red, Aspect::Amber, Aspect::Green].map(|aspect| {
            let lamp = (SignalLamp { aspect, glass: None }, Light::point(1.0, 5.0), ChildOf(head));
            simulation.world.spawn(lamp).id()
        });
        register_all(&mut simulation.world);
        (simulation, lamps)
    };
    let run = |simulation: &mut Simulation, steps: usize| {
        (0..steps).map(|_| simulation.step()).for_each(drop);
        (hash(&mut simulation.world), simulation.world.resource::<Signals>().heads().to_vec())
    };
    for before in [0, 1, 29, 30, 31, 60] {
        let (mut whole, lamps) = scene();
        run(&mut whole, before);
        if before % 2 == 1 {
            let shows = Some(vec![Aspect::Red, Aspect::Green]);
            whole.world.resource_mut::<Inputs>().push(SetSignal { signal: "crossing".into(), shows });
            apply_queued(&mut whole.world);
        } else {
            whole.world.get_mut::<Light>(lamps[0]).expect("there").enabled ^= true;
        }
        let saved = snapshot::save(&mut whole.world);
        let begin = run(&mut whole, 0);
        let ends = [2, 40, 70].map(|steps| run(&mut whole, steps));
        let (mut fresh, _) = scene();
        for other in [&mut whole, &mut fresh] {
            snapshot::restore(&mut other.world, &saved).expect("of this scene");
            assert_eq!(run(other, 0), begin, "after {before}");
            assert_eq!([2, 40, 70].map(|steps| run(other, steps)), ends, "after {before}");
        }
    }
}

#[test]
fn the_origin_counts_and_a_snapshot_from_another_one_is_refused() {
    let (mut here, mut there) = (busy(), busy());
    there.world.insert_resource(Origin(glam::DVec3::new(5e5, 0.0, 5e6)));
    assert_ne!(hash(&mut here.world), hash(&mut there.world));
    let saved = snapshot::save(&mut there.world);
    let error = snapshot::restore(&mut here.world, &saved).expect_err("another origin").to_string();
    assert!(error.contains("origin: expected the scene's origin, found another"), "{error}");
    let mut again = busy();
    again.world.insert_resource(Origin(glam::DVec3::new(5e5, 0.0, 5e6)));
    snapshot::restore(&mut again.world, &saved).expect("the same origin");
}

#[test]
fn places_beyond_those_of_scenes_and_calls_are_refused() {
    let far = [
        Transform::from_xyz(3e7, 0.0, 0.0),
        Transform::from_xyz(0.0, -1e20, 0.0),
        Transform::from_scale(Vec3::splat(1e25)),
        Transform::from_scale(Vec3::new(1.0, -2e6, 1.0)),
    ];
    for at in far {
        let world = |at: Transform| {
            let mut simulation = Simulation::new();
            let entity = simulation.world.spawn(at).id();
            register_all(&mut simulation.world);
            (simulation, entity)
        };
        let (mut moved, _) = world(at);
        let saved = snapshot::save(&mut moved.world);
        let (mut simulation, _) = world(Transform::IDENTITY);
        let error = snapshot::restore(&mut simulation.world, &saved).expect_err("far away").to_string();
        assert_eq!(error, "transform: entity 0: invalid value", "{at:?}");
        // One of the scene's own is as it was.
        snapshot::restore(&mut world(at).0.world, &saved).expect("a snapshot of it");
        let known = Inputs::default();
        let put = SetTransform { entity: StateId(0), transform: at };
        assert!(known.check(&SavedInput::of(&put)).is_err(), "{at:?}");
    }
    let near = SetTransform { entity: StateId(0), transform: Transform::from_xyz(1e7, -1e7, 0.0) };
    assert!(Inputs::default().check(&SavedInput::of(&near)).is_ok());
}

#[test]
fn speeds_beyond_those_of_all_vehicles_are_refused() {
    let driver = |speed: f64| Spawn::Driver {
        name: "fast".into(),
        kind: String::new(),
        paint: 0,
        on: systems::vehicles::OnRoute::default(),
        speed,
        manual: false,
    };
    let is_valid = |speed| Inputs::default().check(&SavedInput::of(&driver(speed))).is_ok();
    assert!(is_valid(0.0) && is_valid(systems::vehicles::FASTEST));
    assert!([1e9, 556.0, -50.0, f64::NAN, f64::INFINITY].into_iter().all(|speed| !is_valid(speed)));
}

#[test]
fn a_snapshot_of_another_scene_is_refused() {
    let saved = snapshot::save(&mut busy().world);
    let mut other = busy();
    other.world.spawn(Transform::IDENTITY);
    register_all(&mut other.world);
    let error = snapshot::restore(&mut other.world, &saved).expect_err("one entity more").to_string();
    assert!(error.contains("expected a scene with 137 entities, found 138"), "{error}");
}

/// A snapshot with something in it.
fn rich() -> Vec<u8> {
    let mut simulation = busy();
    (0..30).for_each(|_| _ = step(&mut simulation));
    snapshot::save(&mut simulation.world)
}

/// Restores what may be anything; what is accepted can go on.
fn try_restore(bytes: &[u8]) {
    let mut simulation = busy();
    if snapshot::restore(&mut simulation.world, bytes).is_ok() {
        simulation.step();
        simulation.frame();
        hash(&mut simulation.world);
    }
}

#[test]
fn a_snapshot_cut_anywhere_is_refused() {
    let whole = rich();
    for end in (0..whole.len()).step_by(97).chain(whole.len() - 20..whole.len()) {
        assert!(snapshot::restore(&mut busy().world, &whole[..end]).is_err(), "cut at {end}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn bytes_that_are_no_snapshot_are_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        try_restore(&bytes);
    }

    #[test]
    fn a_damaged_snapshot_does_no_harm(changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = rich();
        changes.iter().for_each(|(at, value)| *at.get_mut(&mut bytes) = *value);
        try_restore(&bytes);
    }
}

#[test]
fn kinds_of_state_are_compared_by_name_in_any_order() {
    let list = StateList::standard();
    let names: Vec<&str> = list.names().collect();
    let (first, last) = (names[0], names[names.len() - 1]);
    assert_eq!(list.difference(names.iter().rev().copied()), None);
    let lacking = list.difference(names[1..].iter().copied()).expect("one is missing");
    assert_eq!(lacking, format!("made by a program without the state {first:?}, which this program has"));
    let twice = list.difference(names.iter().copied().chain([last])).expect("one is there twice");
    assert_eq!(twice, format!("duplicate state {last:?}"));
    let long = "fuel".repeat(100);
    let more = list.difference(names.iter().copied().chain([&*long])).expect("one is unknown");
    assert_eq!(more, format!("made by a program with the state {:?}, which this program does not have", &long[..60]));
}
