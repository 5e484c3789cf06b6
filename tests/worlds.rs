//! Several worlds on one device: copies of a world share what is uploaded, and their cameras are drawn together.

mod common;

use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3, Vec4};
use proptest::prelude::RngExt;
use proptest::test_runner::{RngAlgorithm, TestRng};
use relief::renderer::{Renderer, Settings, ViewBatches, ViewPlan};
use relief::sensors::{Capture, SensorSuite, capture_worlds};
use systems::Simulation;
use systems::assets::{Image, ImageId, ImageKind, Library, Map, Material, MaterialId, MeshId, shapes};
use systems::draw::{Camera, Environment, ToneMap, View};
use systems::lights::Light;
use systems::run::registry::register_all;
use systems::sensors::{CameraOutput, CameraSensor, Sensor};
use systems::space::{GlobalTransform, Transform};

/// A world, and what its library has. All such worlds' libraries are copies of each other.
struct World {
    simulation: Simulation,
    mesh: MeshId,
    image: ImageId,
    objects: Vec<Entity>,
}

fn checks(size: u32, [r, g, b]: [u8; 3]) -> Image {
    let texels = (0..size * size).flat_map(|i| if (i + i / size) % 2 == 0 { [255; 4] } else { [r, g, b, 255] });
    Image::rgba8("checks", size, size, ImageKind::Color, texels.collect())
}

/// Objects, a lamp and a sun with shadows, and cameras of two sizes. `seed`: where they are, which of them come first,
/// and the tone map.
fn world(seed: u64) -> World {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let mesh = library.add_mesh(shapes::cube(Vec3::ONE));
    let sphere = library.add_mesh(shapes::sphere(0.5, 24, 16));
    let image = library.add_image(checks(8, [200, 40, 40]));
    let mapped = library.add_material(Material { base_map: Some(Map::new(image)), ..Material::default() });
    let large = library.add_image(checks(16, [40, 40, 200]));
    let other = library.add_material(Material { base_map: Some(Map::new(large)), ..Material::default() });
    let glass = Material { base_factor: Vec4::new(0.3, 0.6, 0.9, 0.5), ..Material::default() };
    let plain = library.add_material(glass);
    let mut random = TestRng::from_seed(RngAlgorithm::ChaCha, &[seed as u8; 32]);
    let mut at = || Vec3::from_array([4.0, 3.0, 4.0].map(|half: f32| random.random_range(-half..half)));
    let objects = (0..12).map(|i| {
        let place = Transform::from_translation(at() - 8.0 * Vec3::Z).with_rotation(Quat::from_rotation_y(at().x));
        let looks: [(MeshId, MaterialId); 3] = [(mesh, mapped), (sphere, plain), (mesh, other)];
        let looks = looks[(i + 2 * seed as usize) % 3];
        simulation.world.spawn((looks, place)).id()
    });
    let objects = objects.collect();
    simulation.world.spawn((Light::directional(2.0).with_shadows(), Transform::default().looking_to(at(), Vec3::Y)));
    simulation.world.spawn((Light::point(8.0, 20.0).with_shadows(), Transform::from_translation(at())));
    let tone_map = if seed % 2 == 0 { ToneMap::Clamp } else { ToneMap::Agx };
    simulation.world.resource_mut::<Environment>().tone_map = tone_map;
    let outputs = [CameraOutput::Color, CameraOutput::Depth, CameraOutput::Instance];
    for (name, size) in [("left", (48, 32)), ("right", (48, 32)), ("small", (20, 20))] {
        let samples = if name == "small" { 4 } else { 1 };
        let outputs = outputs.into_iter().collect();
        let camera = CameraSensor { size, samples, outputs, ..CameraSensor::default() };
        let place =
            Transform::from_xyz(size.0 as f32 / 40.0, 0.0, 2.0).with_rotation(Quat::from_rotation_y(at().y / 9.0));
        simulation.world.spawn((Sensor::camera(camera), Name::new(name), place));
    }
    register_all(&mut simulation.world);
    World { simulation, mesh, image, objects }
}

/// What its cameras see.
fn alone(suite: &mut SensorSuite, world: &mut World) -> Capture {
    suite.capture(&mut world.simulation).expect("captured")
}

/// What a suite that knows nothing yet sees.
fn expected(gpu: &relief::renderer::Gpu, world: &mut World) -> Capture {
    alone(&mut SensorSuite::new(gpu), world)
}

#[test]
fn worlds_that_are_captured_together_look_as_each_does_alone() {
    let Some(gpu) = common::gpu() else { return };
    let mut worlds: Vec<World> = (0..3).map(world).collect();
    let first = alone(&mut SensorSuite::new(&gpu), &mut worlds[0]);
    assert!(first != expected(&gpu, &mut worlds[1]), "the worlds differ");
    // With a suite of its own each, or one that shares what the first has.
    let mut template = SensorSuite::new(&gpu);
    alone(&mut template, &mut worlds[0]);
    for forked in [false, true] {
        let suite = || if forked { template.fork() } else { SensorSuite::new(&gpu) };
        let mut suites: Vec<SensorSuite> = worlds.iter().map(|_| suite()).collect();
        let mut batches = ViewBatches::default();
        // In another order, and fewer of them: a layer may have been another world's.
        for order in [vec![0, 1, 2], vec![2, 0, 1], vec![1], vec![0, 1, 2]] {
            for world in &mut worlds {
                let object = world.objects[3];
                world.simulation.world.get_mut::<Transform>(object).expect("it lives").translation.y += 0.25;
            }
            let mut expected: Vec<Option<Capture>> =
                worlds.iter_mut().map(|world| Some(expected(&gpu, world))).collect();
            let mut pairs: Vec<_> =
                suites.iter_mut().zip(worlds.iter_mut().map(|world| &mut world.simulation)).map(Some).collect();
            let mut ordered: Vec<_> = order.iter().filter_map(|&i| pairs[i].take()).collect();
            let captures = capture_worlds(&mut ordered, &mut batches, |_| true).expect("captured");
            let expected: Vec<_> = order.iter().filter_map(|&i| expected[i].take()).collect();
            assert!(captures == expected, "forked {forked}, {order:?}");
        }
    }
}

#[test]
fn captures_of_some_sensors_together_are_those_of_these_sensors() {
    let Some(gpu) = common::gpu() else { return };
    let mut worlds = [world(0), world(1)];
    let mut suites = [SensorSuite::new(&gpu), SensorSuite::new(&gpu)];
    let expected: Vec<Capture> = worlds.iter_mut().map(|world| expected(&gpu, world)).collect();
    let mut pairs: Vec<_> = suites.iter_mut().zip(worlds.iter_mut().map(|world| &mut world.simulation)).collect();
    let captures = capture_worlds(&mut pairs, &mut ViewBatches::default(), |name| name != "left").expect("captured");
    for (capture, expected) in captures.iter().zip(&expected) {
        assert_eq!(capture.sensors.len(), 2);
        assert!(capture["right"] == expected["right"] && capture["small"] == expected["small"]);
    }
    assert!(capture_worlds(&mut [], &mut ViewBatches::default(), |_| true).expect("nothing to do").is_empty());
}

#[test]
fn a_fork_shares_what_is_uploaded_and_what_one_changes_the_other_does_not_see() {
    let Some(gpu) = common::gpu() else { return };
    let (mut parent, mut child) = (world(0), world(0));
    let mut suite = SensorSuite::new(&gpu);
    let before = alone(&mut suite, &mut parent);
    let mut forked = suite.fork();
    assert!(alone(&mut forked, &mut child) == before, "the same world");
    // The one after the other, either first, a mesh and an image: each time they share what is not changed.
    for (i, [changes_parent, changes_child]) in [[false, true], [true, false], [true, true]].into_iter().enumerate() {
        for (world, changes) in [(&mut parent, changes_parent), (&mut child, changes_child)] {
            if changes {
                let (mesh, image) = (world.mesh, world.image);
                let mut library = world.simulation.world.resource_mut::<Library>();
                library.replace_mesh(mesh, shapes::cube(Vec3::new(0.5, 1.0 + i as f32, 0.5)));
                library.replace_image(image, checks(8, [0, 60 * i as u8, 200]));
            }
        }
        for (which, suite, world) in [(0, &mut suite, &mut parent), (1, &mut forked, &mut child)] {
            let seen = alone(suite, world);
            assert!(seen == expected(&gpu, world), "change {i}, world {which}");
            assert_eq!(seen == before, (i, which) == (0, 0), "change {i}, world {which}");
        }
    }
}

#[test]
fn a_fork_uploads_neither_meshes_nor_maps() {
    let Some(gpu) = common::gpu() else { return };
    let (mut parent, mut child) = (world(0), world(0));
    let view = View::new(&GlobalTransform::default().affine(), &Camera::default(), 32, 32);
    let plan = ViewPlan { view, settings: Settings { samples: 1, ..Settings::default() } };
    let uploaded = |renderer: &mut Renderer, world: &mut World| {
        world.simulation.frame();
        let plans = std::slice::from_ref(&plan);
        let mut batches = ViewBatches::default();
        world.simulation.with_frame(|frame| renderer.draw_views(frame, &mut batches, plans)).expect("drawn");
        (renderer.stats().asset_bytes, renderer.stats().instance_bytes)
    };
    let mut renderer = Renderer::new(&gpu);
    let (assets, instances) = uploaded(&mut renderer, &mut parent);
    assert!(assets > 0 && instances > 0);
    let mut forked = renderer.fork();
    assert_eq!(uploaded(&mut forked, &mut child), (0, instances));
    assert_eq!(forked.held_bytes().meshes, renderer.held_bytes().meshes);
    // One more image of the same size: its array is the child's own, with what was in it.
    let image = child.simulation.world.resource_mut::<Library>().add_image(checks(8, [0, 0, 0]));
    let material = Material { base_map: Some(Map::new(image)), ..Material::default() };
    let material = child.simulation.world.resource_mut::<Library>().add_material(material);
    child.simulation.world.entity_mut(child.objects[0]).insert(material);
    let (added, _) = uploaded(&mut forked, &mut child);
    assert!(0 < added && added < assets / 2, "{added} of {assets}");
}
