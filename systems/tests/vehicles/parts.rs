//! Vehicles: their parts, wheels that roll and steer, lamps.

use super::*;
use std::f32::consts::{FRAC_PI_2, PI};
use systems::assets::Material;
use systems::vehicles::lamps::Lamp;
use systems::vehicles::parts::{Movement, MovingPart, Part, PartLamp};
use systems::vehicles::{Headlights, lamps, parts};

/// A type with a painted body, a wheel that steers, one that does not, a fork with a wheel below it, legs, a trailer
/// and a lamp of each kind.
struct Fixture {
    simulation: Simulation,
    kind: VehicleTypeId,
    plain: MaterialId,
    paints: [MaterialId; 2],
    dark: MaterialId,
    lit: MaterialId,
}

const KINDS: [LampKind; 6] = [
    LampKind::Head,
    LampKind::Tail,
    LampKind::IndicatorLeft,
    LampKind::IndicatorRight,
    LampKind::Reverse,
    LampKind::Interior,
];

fn fixture() -> Fixture {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let cube = library.add_mesh(shapes::cube(Vec3::ONE));
    let mut material = |name: &str| library.add_material(Material { name: name.into(), ..Material::default() });
    let [plain, red, blue, dark, lit] = ["plain", "red", "blue", "dark", "lit"].map(&mut material);
    let part = |rest: Transform, movement| Part { rest, movement, ..Part::default() };
    let turned = Transform::from_xyz(-0.8, 0.5, 2.0).with_rotation(Quat::from_rotation_y(PI));
    let mut parts = vec![
        Part { drawn: Some((cube, plain)), painted: vec![red, blue], ..Part::default() },
        part(turned, Some(Movement::Wheel { radius: 0.5, steers: true })),
        part(Transform::from_xyz(0.8, 0.5, 0.0), Some(Movement::Wheel { radius: 0.5, steers: false })),
        part(Transform::from_xyz(0.0, 0.5, 2.5), Some(Movement::Fork)),
        Part { parent: Some(3), ..part(Transform::IDENTITY, Some(Movement::Wheel { radius: 0.25, steers: false })) },
        part(Transform::IDENTITY, Some(Movement::Swing { angle: 0.5, stride: 2.0, phase: 0.25 })),
        part(Transform::IDENTITY, Some(Movement::Trailer)),
    ];
    parts.extend(KINDS.map(|kind| {
        let lamp = Some(PartLamp { kind, light: Some(Light::point(4.0, 10.0)), lit: Some(lit) });
        Part { drawn: Some((cube, dark)), lamp, ..Part::default() }
    }));
    let vehicle_type = VehicleType { name: "all".into(), parts, ..VehicleType::default() };
    let kind = simulation.world.resource_mut::<VehicleTypes>().add(vehicle_type);
    Fixture { simulation, kind, plain, paints: [red, blue], dark, lit }
}

/// Runs the systems that follow moved vehicles in a step and a frame; those that move vehicles would alter the test.
fn parts_follow(simulation: &mut Simulation) {
    let world = &mut simulation.world;
    world.run_system_cached(parts::move_parts).expect("runs");
    world.run_system_cached(parts::turn_parts).expect("runs");
    world.run_system_cached(lamps::switch_lamps).expect("runs");
    world.run_system_cached(lamps::light_lamps).expect("runs");
}

impl Fixture {
    fn spawn(&mut self, paint: u32) -> Entity {
        self.simulation.world.spawn(Vehicle::of(self.kind).painted(paint)).id()
    }

    /// Light, and material of the glass, of each kind of lamp.
    fn lamps(&mut self, vehicle: Entity) -> Vec<(LampKind, f32, MaterialId)> {
        let world = &mut self.simulation.world;
        let mut lamps = world.query::<(&Lamp, &Light, &MaterialId)>();
        let of = |kind| {
            let all = lamps.iter(world).filter(|(lamp, ..)| lamp.vehicle == vehicle);
            let (_, light, material) = all.into_iter().find(|(lamp, ..)| lamp.kind == kind).expect("a lamp");
            (kind, if light.enabled { light.intensity } else { 0.0 }, *material)
        };
        KINDS.map(|kind| kind).into_iter().map(of).collect()
    }

    /// Rotations of the moving parts in the order of the type.
    fn rotations(&mut self) -> Vec<Quat> {
        let world = &mut self.simulation.world;
        let mut parts: Vec<_> = world.query_filtered::<(Entity, &Transform), With<MovingPart>>().iter(world).collect();
        parts.sort_by_key(|(entity, _)| entity.index_u32());
        parts.into_iter().map(|(_, transform)| transform.rotation).collect()
    }

    fn set<C: Component<Mutability = bevy_ecs::component::Mutable>>(
        &mut self,
        vehicle: Entity,
        edit: impl FnOnce(&mut C),
    ) {
        edit(&mut self.simulation.world.get_mut::<C>(vehicle).expect("a vehicle"));
    }
}

#[test]
fn one_line_spawns_a_vehicle_with_its_parts_and_despawning_it_takes_them_along() {
    let mut f = fixture();
    let [first, second] = [0, 3].map(|paint| f.spawn(paint));
    let world = &mut f.simulation.world;
    assert_eq!(world.query::<&ChildOf>().iter(world).count(), 2 * 13);
    let number = |vehicle| *world.get::<VehicleNumber>(vehicle).expect("numbered");
    assert_eq!((number(first), number(second)), (VehicleNumber(0), VehicleNumber(1)));
    let body = |vehicle| {
        let children = world.get::<Children>(vehicle).expect("parts");
        *world.get::<MaterialId>(children[0]).expect("a body")
    };
    assert_eq!([body(first), body(second)], f.paints, "paints are counted round");
    let [first_body, _] = [first, second].map(|v| world.get::<Children>(v).expect("parts")[0]);
    let front_wheel_of_fork = world
        .get::<Children>(first)
        .expect("parts")
        .iter()
        .any(|child| world.get::<Children>(child).is_some_and(|below| below.len() == 1));
    assert!(front_wheel_of_fork, "a wheel hangs from the fork");
    world.despawn(first);
    assert!(world.get_entity(first_body).is_err());
    assert_eq!(world.query::<&ChildOf>().iter(world).count(), 13);
    let third = world.spawn(Vehicle::of(f.kind)).id();
    assert_eq!(world.get::<VehicleNumber>(third), Some(&VehicleNumber(2)), "no number is given twice");
    let kept = world.spawn((Vehicle::of(f.kind), VehicleNumber(77))).id();
    assert_eq!(world.get::<VehicleNumber>(kept), Some(&VehicleNumber(77)));
    assert_ne!(f.plain, f.paints[0]);
}

#[test]
fn an_unknown_type_is_a_box_on_four_wheels() {
    let mut simulation = Simulation::new();
    let of_another_world = VehicleTypeId(900);
    simulation.world.spawn(CAR);
    simulation.world.spawn(Vehicle::of(of_another_world));
    let world = &mut simulation.world;
    assert_eq!(world.query::<(&MeshId, &ChildOf)>().iter(world).count(), 10);
    assert_eq!(world.query::<&MovingPart>().iter(world).count(), 8);
    assert_eq!(world.resource::<Library>().meshes().count(), 2, "built once");
}

#[test]
fn wheels_roll_by_the_distance_and_steer_whichever_way_they_are_mounted() {
    let mut f = fixture();
    let vehicle = f.spawn(0);
    // A quarter of a turn of a wheel of half a metre.
    f.set::<Motion>(vehicle, |m| (m.rolled, m.steering, m.hitch) = (f64::from(FRAC_PI_2 * 0.5), 0.3, -0.2));
    parts_follow(&mut f.simulation);
    let rotations = f.rotations();
    // An arccosine knows small angles to √(2 · 2⁻²⁴), and half of them are taken.
    let near = |a: Quat, b: Quat| assert!(a.angle_between(b) < 1e-3, "{a} {b}");
    let roll = Quat::from_rotation_x(FRAC_PI_2);
    near(rotations[0], Quat::from_rotation_y(0.3) * roll * Quat::from_rotation_y(PI));
    near(rotations[1], roll);
    near(rotations[2], Quat::from_rotation_y(0.3));
    near(rotations[3], Quat::from_rotation_x(PI));
    let swing = 0.5 * (2.0 * PI * (FRAC_PI_2 * 0.5 / 2.0 + 0.25)).sin();
    near(rotations[4], Quat::from_rotation_x(swing));
    near(rotations[5], Quat::from_rotation_y(-0.2));
    // The top of a wheel that rolls forward goes forward.
    assert!((rotations[1] * Vec3::Y).z > 0.99);
}

#[test]
fn lamps_follow_controls_and_motion() {
    let mut f = fixture();
    let vehicle = f.spawn(0);
    let on = |lamps: &[(LampKind, f32, MaterialId)]| -> Vec<f32> { lamps.iter().map(|lamp| lamp.1).collect() };
    let lamps = f.lamps(vehicle);
    assert_eq!(on(&lamps), [4.0, 4.0, 0.0, 0.0, 0.0, 4.0], "from the first frame: low beam, and it stands braked");
    assert_eq!(lamps[0].2, f.lit);
    assert_eq!(lamps[2].2, f.dark);
    let mut after = |edit: fn(&mut Motion, &mut Controls)| {
        let (mut motion, mut controls) = (Motion { speed: 10.0, ..Motion::default() }, Controls::default());
        edit(&mut motion, &mut controls);
        f.set::<Motion>(vehicle, |m| *m = motion);
        f.set::<Controls>(vehicle, |c| *c = controls);
        parts_follow(&mut f.simulation);
        on(&f.lamps(vehicle))
    };
    assert_eq!(after(|_, _| {}), [4.0, 1.0, 0.0, 0.0, 0.0, 4.0]);
    assert_eq!(after(|_, c| c.headlights = Headlights::High), [10.0, 1.0, 0.0, 0.0, 0.0, 4.0]);
    assert_eq!(after(|_, c| c.headlights = Headlights::Off), [0.0; 6]);
    assert_eq!(after(|m, _| m.acceleration = -2.0), [4.0, 4.0, 0.0, 0.0, 0.0, 4.0]);
    assert_eq!(after(|m, _| m.acceleration = 2.0), [4.0, 1.0, 0.0, 0.0, 0.0, 4.0]);
    assert_eq!(after(|m, _| m.speed = -1.0), [4.0, 1.0, 0.0, 0.0, 4.0, 4.0]);
    assert_eq!(after(|m, _| (m.speed, m.acceleration) = (-1.0, 2.0))[1], 4.0, "in reverse, too");
}

#[test]
fn fog_lamps_are_on_with_the_head_lamps_daytime_lamps_without_and_brake_lamps_while_braking() {
    let levels = |headlights, acceleration| {
        let motion = Motion { speed: 10.0, acceleration, ..Motion::default() };
        let controls = Controls { headlights, ..Controls::default() };
        let switches = Switches::of(VehicleNumber(0), &motion, &controls, 0.0);
        [LampKind::Fog, LampKind::Daytime, LampKind::Brake, LampKind::Tail].map(|kind| switches.level(kind))
    };
    assert_eq!(levels(Headlights::Off, 0.0), [0.0, 1.0, 0.0, 0.0]);
    assert_eq!(levels(Headlights::Low, 0.0), [1.0, 0.0, 0.0, 0.25]);
    assert_eq!(levels(Headlights::High, -2.0), [1.0, 0.0, 1.0, 1.0]);
    assert_eq!(levels(Headlights::Off, -2.0), [0.0, 1.0, 1.0, 1.0]);
}

#[test]
fn lamps_that_come_later_are_switched_too_and_those_that_are_gone_are_missed_by_nobody() {
    let mut f = fixture();
    let vehicle = f.spawn(0);
    let glass = Some((f.dark, f.lit));
    let light = Light { enabled: false, ..Light::point(3.0, 10.0) };
    for kind in KINDS {
        let lamp = Lamp { vehicle, kind, intensity: 3.0, glass };
        f.simulation.world.spawn((lamp, light.clone(), f.dark, ChildOf(vehicle)));
    }
    let on = |f: &mut Fixture| -> Vec<(f32, bool)> {
        let world = &mut f.simulation.world;
        let mut lamps = world.query::<(&Lamp, &Light, &MaterialId)>();
        let mut own: Vec<_> = lamps.iter(world).filter(|(lamp, ..)| lamp.intensity == 3.0).collect();
        own.sort_by_key(|(lamp, ..)| KINDS.iter().position(|kind| *kind == lamp.kind));
        own.iter()
            .map(|(_, light, glass)| (if light.enabled { light.intensity } else { 0.0 }, **glass == f.lit))
            .collect()
    };
    parts_follow(&mut f.simulation);
    let (dark, lit) = ((0.0, false), (3.0, true));
    assert_eq!(
        on(&mut f),
        [lit, lit, dark, dark, dark, lit],
        "as the vehicle's switches are, though none of them changed"
    );
    let mut lamps = f.simulation.world.query::<(Entity, &Lamp)>();
    let all: Vec<(Entity, Lamp)> = lamps.iter(&f.simulation.world).map(|(entity, lamp)| (entity, *lamp)).collect();
    let of =
        |own: bool| all.iter().filter(move |(_, lamp)| lamp.kind == LampKind::Head && (lamp.intensity == 3.0) == own);
    of(false).for_each(|(entity, _)| _ = f.simulation.world.despawn(*entity));
    f.set::<Controls>(vehicle, |c| c.headlights = Headlights::High);
    parts_follow(&mut f.simulation);
    assert_eq!(on(&mut f)[0], (7.5, true));
    of(true).for_each(|(entity, _)| _ = f.simulation.world.entity_mut(*entity).remove::<Lamp>());
    f.set::<Controls>(vehicle, |c| c.headlights = Headlights::Off);
    parts_follow(&mut f.simulation);
    let still = of(true).map(|(entity, _)| f.simulation.world.get::<Light>(*entity).expect("its own light"));
    assert!(still.into_iter().all(|light| light.enabled), "no lamp of a vehicle any more");
}

#[test]
fn indicators_blink_ninety_times_a_minute_on_their_side() {
    let mut f = fixture();
    let vehicle = f.spawn(0);
    let mut blinks = |indicator: Indicator| {
        f.set::<Controls>(vehicle, |c| c.indicator = indicator);
        let (mut begun, mut before) = ([0, 0], [false, false]);
        for _ in 0..60 * 60 {
            f.simulation.step();
            let lamps = f.lamps(vehicle);
            let now = [lamps[2].1 > 0.0, lamps[3].1 > 0.0];
            (0..2).for_each(|side| begun[side] += u32::from(now[side] && !before[side]));
            before = now;
        }
        begun
    };
    let about = |begun: u32| (89..=91).contains(&begun);
    assert!(matches!(blinks(Indicator::Left), [left, 0] if about(left)));
    assert!(matches!(blinks(Indicator::Right), [0, right] if about(right)));
    assert!(matches!(blinks(Indicator::Hazard), [left, right] if about(left) && left == right));
    assert_eq!(blinks(Indicator::Off), [0, 0]);
}

#[test]
fn what_does_not_change_is_not_written() {
    #[derive(Resource, Default)]
    struct Written(usize);
    fn count(
        lights: Query<(), Changed<Light>>,
        parts: Query<(), (With<MovingPart>, Changed<Transform>)>,
        mut written: ResMut<Written>,
    ) {
        written.0 = lights.iter().count() + parts.iter().count();
    }
    let mut f = fixture();
    f.simulation.world.init_resource::<Written>();
    let vehicle = f.spawn(0);
    let written = |f: &mut Fixture| {
        f.simulation.step();
        f.simulation.frame();
        f.simulation.world.run_system_cached(count).expect("runs");
        f.simulation.world.resource::<Written>().0
    };
    written(&mut f);
    assert_eq!(written(&mut f), 0);
    f.set::<Motion>(vehicle, |m| m.rolled += 0.1);
    assert_eq!(written(&mut f), 4, "two wheels, the fork's, and the leg");
    f.set::<Controls>(vehicle, |c| c.headlights = Headlights::High);
    assert_eq!(written(&mut f), 1, "the head lamp");
}
