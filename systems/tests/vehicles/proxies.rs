//! Proxies of vehicles: where they are drawn, of what colours, and what stays of the parts.

use super::*;
use glam::Vec4;
use proptest::test_runner::{TestCaseError, TestRunner};
use std::cell::RefCell;
use systems::assets::levels::LevelOfDetail;
use systems::assets::{Material, MeshEntry};
use systems::draw::InstanceRecord;
use systems::draw::pieces::PieceOf;
use systems::run::registry::{self, EntityRegistry, StateId, register_all};
use systems::run::spawn::Spawn;
use systems::space::GlobalTransform;
use systems::vehicles::parts::{Movement, MovingPart, Part, PartLamp, move_parts};
use systems::vehicles::proxies::add_proxies;

/// A type whose body is in two places, with a bumper that has a third mesh, wheels that share one, one of them below a
/// fork, a lamp and a trailer; with proxies.
fn with_proxies() -> (Simulation, Vec<Part>) {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let mesh = |library: &mut Library, size: Vec3| {
        let mut ball = shapes::sphere(1.0, 16, 8);
        ball.positions.iter_mut().for_each(|at| *at *= size);
        library.add_mesh(ball)
    };
    let [body, roof, bumper, wheel, lamp, trailer] = [
        Vec3::new(1.0, 0.8, 2.5),
        Vec3::new(0.8, 0.4, 1.0),
        Vec3::new(1.0, 0.1, 0.1),
        Vec3::new(0.2, 0.4, 0.4),
        Vec3::splat(0.1),
        Vec3::new(1.2, 1.5, 4.0),
    ]
    .map(|size| mesh(&mut library, size));
    let mut colored =
        |rgb: Vec3| library.add_material(Material { base_factor: rgb.extend(1.0), ..Material::default() });
    let [plain, grey, red, blue] = [Vec3::ONE, Vec3::splat(0.25), Vec3::X, Vec3::Z].map(&mut colored);
    let at = |x: f32, y: f32, z: f32| Transform::from_xyz(x, y, z);
    let drawn = |mesh, material| Part { drawn: Some((mesh, material)), ..Part::default() };
    let roll = |steers| Some(Movement::Wheel { radius: 0.4, steers });
    let shines = PartLamp { kind: LampKind::Tail, light: None, lit: None };
    let mut parts = vec![
        Part { rest: at(0.0, 0.9, 1.0), painted: vec![red, blue], ..drawn(body, plain) },
        Part { rest: at(0.0, 0.9, 1.0), ..drawn(roof, grey) },
        Part { rest: at(0.0, 0.5, -1.4).with_scale(Vec3::splat(2.0)), ..drawn(bumper, grey) },
        Part { rest: at(0.9, 0.4, 0.0), movement: roll(false), ..drawn(wheel, grey) },
        Part { rest: at(0.0, 0.6, 2.4), movement: Some(Movement::Fork), ..Part::default() },
        Part { rest: at(0.3, -0.2, 0.2), parent: Some(4), movement: roll(true), ..drawn(wheel, grey) },
        Part { rest: at(0.5, 0.8, -1.5), lamp: Some(shines), ..drawn(lamp, plain) },
        Part { rest: at(0.0, 0.0, -1.0), movement: Some(Movement::Trailer), ..Part::default() },
        Part { rest: at(0.0, 1.5, -4.0), parent: Some(7), ..drawn(trailer, grey) },
        Part { rest: at(0.9, 0.4, -5.0), parent: Some(7), movement: roll(false), ..drawn(wheel, grey) },
    ];
    add_proxies(&mut parts, &mut library);
    simulation.frame();
    (simulation, parts)
}

fn entry(simulation: &Simulation, mesh: MeshId) -> &MeshEntry {
    simulation.library().mesh(mesh).expect("a mesh")
}

#[test]
fn a_vehicle_and_its_trailer_have_a_proxy_each_with_the_colours_of_their_parts() {
    let (simulation, parts) = with_proxies();
    let with = |part: &&Part| !part.proxies.is_empty();
    assert_eq!(parts.iter().filter(with).count(), 2);
    let [painted, rest] = &parts[0].proxies[..] else { panic!("{:?}", parts[0].proxies) };
    assert_eq!((painted.painted.len(), rest.painted.len(), parts[8].proxies.len()), (2, 0, 1));
    let factor = |material: &MaterialId| simulation.library().material(*material).expect("a material").base_factor;
    assert_eq!(painted.painted.iter().map(factor).collect::<Vec<_>>(), [Vec3::X, Vec3::Z].map(|c| c.extend(1.0)));
    assert_eq!(factor(&rest.material), Vec4::ONE);
    let colors = |mesh| entry(&simulation, mesh).mesh.colors.clone();
    assert!(colors(painted.mesh).iter().all(|color| *color == Vec4::ONE));
    assert!(colors(rest.mesh).iter().all(|color| *color == Vec3::splat(0.25).extend(1.0)));
    for proxy in [painted, rest, &parts[8].proxies[0]] {
        let MeshEntry { levels, mesh, .. } = entry(&simulation, proxy.mesh);
        assert!(mesh.indices.is_empty() && levels[0].index_count == 0 && levels.len() > 1, "rays meet nothing");
        assert!(
            levels.is_sorted_by(|a, b| a.error < b.error) && levels.last().is_some_and(|last| last.index_count < 300)
        );
    }
    // The lamp stays; the wheel of the trailer has a mesh of its own, for its levels end elsewhere.
    let ends = |part: &Part| entry(&simulation, part.drawn.expect("drawn").0).ends_at;
    assert_eq!(ends(&parts[6]), None);
    let own = |part: usize| parts[part].drawn.expect("drawn").0;
    assert!(own(3) == own(5) && own(3) != own(9));
    assert!([0, 1, 2, 3, 5, 8, 9].iter().all(|&part| ends(&parts[part]).is_some()));
}

/// The level of a mesh at a place in a view.
fn level(entry: &MeshEntry, place: &GlobalTransform, eye: Vec3, pixels_at_1m: f32) -> usize {
    let sphere = entry.level_bounds.transformed(&place.affine());
    let scale = place.affine().matrix3.x_axis.length();
    let nearest = sphere.center.distance(eye) - sphere.radius;
    LevelOfDetail::default().choose(&entry.levels, scale, nearest, pixels_at_1m)
}

/// The trailer that an entity is a part of, or its vehicle.
fn base_of(world: &World, entity: Entity) -> Entity {
    let is_trailer = |part: &MovingPart| part.movement == Movement::Trailer;
    let mut base = entity;
    while let Some(above) = world.get::<ChildOf>(base).filter(|_| !world.get(base).is_some_and(is_trailer)) {
        base = above.parent();
    }
    base
}

/// However the vehicle stands, and its wheels and its trailer are turned.
#[test]
fn parts_are_drawn_until_their_proxy_is() {
    let (mut simulation, parts) = with_proxies();
    let own = VehicleType { name: "own".into(), parts, ..VehicleType::default() };
    let kind = simulation.world.resource_mut::<VehicleTypes>().add(own);
    let simulation = RefCell::new(simulation);
    let turned = (-3.0f32..3.0, -0.6f32..0.6, -1.5f64..1.5, 0.0f64..3.0);
    let views = prop::collection::vec((2.0f32..400.0, 30.0f32..2000.0), 50);
    let config = ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() };
    let mut runner = TestRunner::new(config);
    let result = runner.run(&(turned, -3.0f32..3.0, views), |((heading, steering, hitch, rolled), toward, views)| {
        let simulation = &mut *simulation.borrow_mut();
        let world = &mut simulation.world;
        let place = Transform::from_xyz(3.0, 0.0, -7.0).with_rotation(Quat::from_rotation_y(heading));
        let vehicle = world.spawn((Vehicle::of(kind), place)).id();
        let mut motion = world.get_mut::<Motion>(vehicle).expect("a vehicle");
        (motion.steering, motion.hitch, motion.rolled) = (steering, hitch, rolled);
        world.run_system_cached(move_parts).expect("runs");
        simulation.frame();
        let way = Vec3::new(toward.sin(), 0.4, toward.cos()).normalize();
        let checked = check_views(
            simulation,
            views.iter().map(|&(distance, pixels)| (place.translation + distance * way, pixels)),
        );
        simulation.world.despawn(vehicle);
        checked
    });
    result.unwrap_or_else(|failed| panic!("{failed}"));
}

/// Checks views by their eyes and by how many pixels a metre covers at a distance of one.
fn check_views(simulation: &mut Simulation, views: impl Iterator<Item = (Vec3, f32)>) -> Result<(), TestCaseError> {
    let world = &mut simulation.world;
    let mut drawn = world.query::<(Entity, &MeshId, &GlobalTransform, Has<PieceOf>)>();
    let drawn: Vec<_> = drawn.iter(world).map(|(entity, &mesh, &at, is_proxy)| (entity, mesh, at, is_proxy)).collect();
    let proxies = drawn.iter().filter(|(.., is_proxy)| *is_proxy);
    prop_assert_eq!(proxies.clone().count(), 3);
    for (eye, pixels_at_1m) in views {
        let level = |mesh, at| level(entry(simulation, mesh), at, eye, pixels_at_1m);
        for (proxy, mesh, at, _) in proxies.clone() {
            let base = base_of(&simulation.world, *proxy);
            let has_proxy = level(*mesh, at) > 0;
            for (part, mesh, own, _) in drawn.iter().filter(|(.., is_proxy)| !is_proxy) {
                if base_of(&simulation.world, *part) != base || entry(simulation, *mesh).ends_at.is_none() {
                    continue;
                }
                let is_drawn = level(*mesh, own) + 1 < entry(simulation, *mesh).levels.len();
                prop_assert!(has_proxy || is_drawn, "{part}: neither from {eye}, {pixels_at_1m} pixels");
                prop_assert!(own != at || has_proxy != is_drawn, "{part}: both from {eye}, {pixels_at_1m} pixels");
            }
        }
    }
    Ok(())
}

#[test]
fn proxies_have_no_number_and_ids_name_the_part_they_hang_from() {
    let (mut simulation, parts) = with_proxies();
    let count = parts.len();
    let kind = simulation.world.resource_mut::<VehicleTypes>().add(VehicleType {
        name: "own".into(),
        parts,
        ..VehicleType::default()
    });
    let vehicle = simulation.world.spawn(Vehicle::of(kind)).id();
    register_all(&mut simulation.world);
    let world = &mut simulation.world;
    let proxies: Vec<(Entity, PieceOf)> =
        world.query::<(Entity, &PieceOf)>().iter(world).map(|(entity, part)| (entity, *part)).collect();
    assert_eq!(proxies.len(), 3);
    let registry = world.resource::<EntityRegistry>();
    assert!(proxies.iter().all(|&(proxy, part)| registry.id(proxy).is_none() && registry.id(part.0).is_some()));
    assert_eq!(registry.id(vehicle).map(|id| id.0), Some(0));
    assert!((0..=count as u32).all(|id| registry.entity(StateId(id)).is_some()));
    // One that comes later has as many numbers.
    let (transform, controls) = (Transform::IDENTITY, Controls::default());
    let later =
        Spawn::Vehicle { name: "later".into(), transform, kind: "own".into(), paint: 0, controls, manual: true };
    registry::spawn(&mut simulation.world, later);
    let registry = simulation.world.resource::<EntityRegistry>();
    let last = 2 * (count as u32 + 1) - 1;
    assert!(registry.entity(StateId(last)).is_some() && registry.entity(StateId(last + 1)).is_none());
    simulation.frame();
    let named = |record: InstanceRecord| record.entity;
    let ids: Vec<u32> = simulation.instance_records().drawn().map(named).collect();
    assert!(proxies.iter().all(|(proxy, part)| !ids.contains(&proxy.index_u32()) && ids.contains(&part.0.index_u32())));
}
