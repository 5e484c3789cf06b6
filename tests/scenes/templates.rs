//! Several worlds of one scene: what they share, and that each is as if it were alone.

use crate::common::{self, prelude::*};
use relief::scene::Template;
use relief::sense::{Drawing, Wanted, WorldSensors};
use systems::run::registry;
use systems::run::snapshot;
use systems::run::spawn::Spawn;
use systems::run::state_hash::hash;

const SCENE: &str = r#"(
    meshes: { "ground": plane(size: (60, 60)), "box": cube(size: (1, 1, 1)) },
    materials: { "red": (base_factor: (0.8, 0.1, 0.1)) },
    entities: [
        (light: directional(intensity: 1, shadows: true), transform: (translation: (3, 6, 2), look_at: (0, 0, 0))),
        (name: "ground", mesh: "ground", piece_metres: 0),
        (name: "box", mesh: "box", material: "red", transform: (translation: (0, 0.5, -8))),
    ],
    generators: [
        (place: scatter(region: box(min: (-20, 0.5, -40), max: (20, 0.5, -10)), count: 30), entity: (mesh: "box")),
    ],
)"#;

fn template() -> (common::Folder, Template) {
    let folder = common::scene_folder(SCENE);
    let template = Template::load(&folder.path().join("scene.ron")).expect("a scene");
    (folder, template)
}

/// A world with a camera, and a box of its own at `x`.
fn world_with(template: &Template, x: f32) -> Simulation {
    let (mut simulation, _) = template.instantiate(None);
    let camera = CameraSensor { size: (48, 32), ..CameraSensor::default() };
    let camera = camera.with(CameraOutput::Depth).with(CameraOutput::Instance).with(CameraOutput::Boxes);
    let transform = Transform::from_xyz(0.0, 1.0, 0.0);
    let (name, sensor) = ("eye".to_owned(), Sensor::camera(camera));
    registry::spawn(&mut simulation.world, Spawn::Sensor { name, transform, parent: None, sensor });
    let of = named(&mut simulation, "box");
    let transform = Transform::from_xyz(x, 1.0, -4.0).with_rotation(Quat::from_rotation_y(x));
    registry::spawn(&mut simulation.world, Spawn::Copy { name: "own".into(), transform, of });
    simulation
}

fn named(simulation: &mut Simulation, name: &str) -> StateId {
    let mut names = simulation.world.query::<(Entity, &Name)>();
    let found = names.iter(&simulation.world).find(|(_, own)| own.as_str() == name).map(|(entity, _)| entity);
    simulation.world.resource::<EntityRegistry>().id(found.expect("named")).expect("registered")
}

#[test]
fn worlds_of_a_template_begin_alike_and_share_their_library() {
    let (_folder, template) = template();
    let mut worlds = [None, None, Some(1)].map(|seed| template.instantiate(seed).0);
    let hashes = worlds.each_mut().map(|simulation| hash(&mut simulation.world));
    assert_eq!(hashes[0], hashes[1]);
    assert_ne!(hashes[0], hashes[2], "scattered by another seed");
    for simulation in &mut worlds {
        simulation.frame();
    }
    let [first, second, _] = &mut worlds;
    assert_eq!(first.library().contents(), second.library().contents());
    let vertices = |simulation: &Simulation| {
        let (_, entry) = simulation.library().meshes().last().expect("a mesh");
        entry.mesh.positions.as_ptr()
    };
    assert_eq!(vertices(first), vertices(second), "held once");
    // What one adds the other does not get.
    let before = second.library().sizes();
    first.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    assert_ne!(first.library().contents(), second.library().contents());
    assert_eq!(second.library().sizes(), before);
}

#[test]
fn a_snapshot_is_restored_into_a_world_that_went_on() {
    let (_folder, template) = template();
    let mut simulation = world_with(&template, 1.0);
    let (saved, then) = (snapshot::save(&mut simulation.world), hash(&mut simulation.world));
    let own = named(&mut simulation, "own");
    let kept = simulation.world.resource::<EntityRegistry>().entity(own);
    let of = named(&mut simulation, "box");
    let transform = Transform::from_xyz(9.0, 0.0, 0.0);
    registry::spawn(&mut simulation.world, Spawn::Copy { name: "later".into(), transform, of });
    simulation.step();
    snapshot::restore(&mut simulation.world, &saved).expect("restored");
    assert_eq!(hash(&mut simulation.world), then);
    let registry = simulation.world.resource::<EntityRegistry>();
    assert_eq!((registry.entity(own), registry.next_id()), (kept, StateId(own.0 + 1)), "what is whole stays");
    // What was spawned and has gone is built again; what the scene began with cannot be.
    registry::despawn(&mut simulation.world, own);
    snapshot::restore(&mut simulation.world, &saved).expect("restored");
    assert_eq!(hash(&mut simulation.world), then);
    registry::despawn(&mut simulation.world, of);
    let error = snapshot::restore(&mut simulation.world, &saved).expect_err("a part of the scene is missing");
    assert!(error.to_string().contains(&format!("entity {} of the scene is gone", of.0)), "{error}");
    let (mut fresh, _) = template.instantiate(None);
    snapshot::restore(&mut fresh.world, &saved).expect("restored");
    assert_eq!(hash(&mut fresh.world), then);
}

#[test]
fn worlds_that_are_captured_together_give_what_they_give_alone() {
    let Some(gpu) = common::gpu() else { return };
    let (_folder, template) = template();
    let mut worlds: Vec<Simulation> = [-2.0, 0.0, 2.0].map(|x| world_with(&template, x)).into();
    let mut alone = worlds_alone(&gpu, &mut worlds);
    let mut drawing = Drawing::of_many(Some(&gpu));
    let mut sensors: Vec<WorldSensors> = worlds.iter().map(|_| WorldSensors::default()).collect();
    let all = |_: &str| true;
    for round in 0..3 {
        // In any order, and some of them only.
        let order: &[usize] = [&[0, 1, 2][..], &[2, 0], &[1, 2, 0]][round];
        let mut together: Vec<(usize, _)> =
            worlds.iter_mut().zip(&mut sensors).enumerate().filter(|(i, _)| order.contains(i)).collect();
        together.sort_by_key(|(i, _)| order.iter().position(|own| own == i));
        let mut together: Vec<_> =
            together.into_iter().map(|(_, (simulation, sensors))| (simulation, sensors, Wanted::Due(&all))).collect();
        let captures = drawing.capture(&Default::default(), &mut together).expect("captured");
        for (&i, capture) in order.iter().zip(&captures) {
            assert_eq!(pixels(capture), pixels(&alone[i]), "world {i}, round {round}");
        }
    }
    assert_ne!(pixels(&alone[0]), pixels(&alone[2]));
    // A world that changes its meshes is drawn with its own, and the others with theirs.
    let cube = worlds[1].world.resource_mut::<Library>().add_mesh(shapes::sphere(0.7, 16, 8));
    worlds[1].world.spawn((cube, Transform::from_xyz(0.5, 1.5, -3.0)));
    alone = worlds_alone(&gpu, &mut worlds);
    drawing.forget(worlds[0].draw_list().world);
    let mut together: Vec<_> = worlds
        .iter_mut()
        .zip(&mut sensors)
        .map(|(simulation, sensors)| (simulation, sensors, Wanted::Due(&all)))
        .collect();
    let captures = drawing.capture(&Default::default(), &mut together).expect("captured");
    for (i, capture) in captures.iter().enumerate() {
        assert_eq!(pixels(capture), pixels(&alone[i]), "world {i}");
    }
}

fn worlds_alone(gpu: &relief::renderer::Gpu, worlds: &mut [Simulation]) -> Vec<Capture> {
    let capture = |simulation: &mut Simulation| SensorSuite::new(gpu).capture(simulation).expect("captured");
    worlds.iter_mut().map(capture).collect()
}

/// Colours, depths, numbers and boxes, to the bit.
type Pixels = (Vec<[u8; 3]>, Vec<u32>, Vec<u32>, Vec<[f32; 4]>);

fn pixels(capture: &Capture) -> Pixels {
    let camera = capture["eye"].camera().expect("a camera");
    let depth = camera.depth.iter().map(|depth| depth.to_bits()).collect();
    let boxes = camera.boxes.iter().map(|one| one.box_visible).collect();
    (camera.color.clone(), depth, camera.instance.clone(), boxes)
}

#[test]
fn a_template_tells_what_is_wrong_as_loading_does() {
    let error = Template::load(Path::new("none.ron")).expect_err("no such file");
    assert!(error.to_string().starts_with("none.ron: "), "{error}");
}
