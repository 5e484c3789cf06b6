//! Several worlds with one renderer: those with the same library share what is uploaded of it, and cameras of all are
//! drawn together.

use crate::common::{self, prelude::*};
use relief::renderer::{PackedArray, ViewBatches};
use relief::sense::{Drawing, SensorData, Wanted, WorldSensors};
use systems::assets::MeshEntry;

/// A world, and what its library has.
struct World {
    simulation: Simulation,
    sensors: WorldSensors,
    mesh: MeshId,
    image: ImageId,
    objects: Vec<Entity>,
}

fn checks(size: u32, [r, g, b]: [u8; 3]) -> Image {
    let texels =
        (0..size * size).flat_map(|i| if (i + i / size).is_multiple_of(2) { [255; 4] } else { [r, g, b, 255] });
    Image::rgba8("checks", size, size, ImageKind::Color, texels.collect())
}

/// Library for worlds, and assets in it.
struct Stock {
    library: Library,
    mesh: MeshId,
    sphere: MeshId,
    mapped: MaterialId,
    other: MaterialId,
    plain: MaterialId,
    image: ImageId,
}

fn stock() -> Stock {
    let mut library = Simulation::new().world.remove_resource::<Library>().expect("every world has one");
    let mesh = library.add_mesh(shapes::cube(Vec3::ONE));
    let sphere = library.add_mesh(shapes::sphere(0.5, 24, 16));
    let image = library.add_image(checks(8, [200, 40, 40]));
    let mapped = library.add_material(Material { base_map: Some(Map::new(image)), ..Material::default() });
    let large = library.add_image(checks(16, [40, 40, 200]));
    let other = library.add_material(Material { base_map: Some(Map::new(large)), ..Material::default() });
    let glass = Material { base_factor: Vec4::new(0.3, 0.6, 0.9, 0.5), ..Material::default() };
    let plain = library.add_material(glass);
    library.unfinished_meshes().for_each(MeshEntry::finish);
    Stock { library, mesh, sphere, mapped, other, plain, image }
}

/// Objects, a lamp and a sun with shadows, and cameras of two sizes. `seed`: where they are, which of them come first,
/// and the tone map.
fn world(stock: &Stock, seed: u64) -> World {
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(stock.library.clone());
    let Stock { mesh, sphere, mapped, other, plain, image, .. } = *stock;
    let mut random = TestRng::from_seed(proptest::test_runner::RngAlgorithm::ChaCha, &[seed as u8; 32]);
    let mut at = || Vec3::from_array([4.0, 3.0, 4.0].map(|half: f32| random.random_range(-half..half)));
    let objects = (0..12).map(|i| {
        let place = Transform::from_translation(at() - 8.0 * Vec3::Z).with_rotation(Quat::from_rotation_y(at().x));
        let looks = [(mesh, mapped), (sphere, plain), (mesh, other)];
        let looks = looks[(i + 2 * seed as usize) % 3];
        simulation.world.spawn((looks, place)).id()
    });
    let objects = objects.collect();
    simulation.world.spawn((Light::directional(2.0).with_shadows(), Transform::default().looking_to(at(), Vec3::Y)));
    simulation.world.spawn((Light::point(8.0, 20.0).with_shadows(), Transform::from_translation(at())));
    let tone_map = if seed.is_multiple_of(2) { ToneMap::Clamp } else { ToneMap::Agx };
    simulation.world.resource_mut::<Environment>().tone_map = tone_map;
    let outputs = [CameraOutput::Color, CameraOutput::Depth, CameraOutput::Instance, CameraOutput::Part];
    for (name, size) in [("left", (48, 32)), ("right", (48, 32)), ("small", (20, 20))] {
        let samples = if name == "small" { 4 } else { 1 };
        let outputs = outputs.into_iter().collect();
        let camera = CameraSensor { size, samples, outputs, ..CameraSensor::default() };
        let place =
            Transform::from_xyz(size.0 as f32 / 40.0, 0.0, 2.0).with_rotation(Quat::from_rotation_y(at().y / 9.0));
        simulation.world.spawn((Sensor::camera(camera), Name::new(name), place));
    }
    register_all(&mut simulation.world);
    World { simulation, sensors: WorldSensors::default(), mesh, image, objects }
}

/// Capture of a world by a new suite.
fn expected(gpu: &Gpu, world: &mut World) -> Capture {
    SensorSuite::new(gpu).capture(&mut world.simulation).expect("captured")
}

/// Captures some worlds together.
fn together<'a>(
    drawing: &mut Drawing,
    worlds: impl Iterator<Item = &'a mut World>,
    wanted: &'a (dyn Fn(&str) -> bool + Sync),
) -> Vec<Capture> {
    let asked = worlds.map(|world| (&mut world.simulation, &mut world.sensors, Wanted::Due(wanted)));
    let mut asked: Vec<_> = asked.collect();
    drawing.capture(&Settings::default(), &mut asked).expect("captured")
}

#[test]
fn worlds_that_are_captured_together_look_as_each_does_alone() {
    let Some(gpu) = common::gpu() else { return };
    let shared = stock();
    for of_one_library in [true, false] {
        let made = |seed| if of_one_library { world(&shared, seed) } else { world(&stock(), seed) };
        let mut worlds: Vec<World> = (0..3).map(made).collect();
        assert!(expected(&gpu, &mut worlds[0]) != expected(&gpu, &mut worlds[1]), "the worlds differ");
        let mut drawing = Drawing::of_many(Some(&gpu));
        // In another order, and fewer of them: a layer may have been another world's.
        for order in [vec![0, 1, 2], vec![2, 0, 1], vec![1], vec![0, 1, 2]] {
            for world in &mut worlds {
                let object = world.objects[3];
                world.simulation.world.get_mut::<Transform>(object).expect("it lives").translation.y += 0.25;
            }
            let expected: Vec<Capture> = order.iter().map(|&i| expected(&gpu, &mut worlds[i])).collect();
            let mut rest: Vec<Option<&mut World>> = worlds.iter_mut().map(Some).collect();
            let ordered: Vec<&mut World> = order.iter().filter_map(|&i| rest[i].take()).collect();
            let captures = together(&mut drawing, ordered.into_iter(), &|_| true);
            assert!(captures == expected, "of one library: {of_one_library}, {order:?}");
        }
    }
}

/// Bytes of a buffer.
fn bytes_of(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<u8> {
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let descriptor = wgpu::BufferDescriptor { label: None, size: buffer.size(), usage, mapped_at_creation: false };
    let copy = gpu.device.create_buffer(&descriptor);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    copy.map_async(wgpu::MapMode::Read, .., |mapped| mapped.expect("mapped"));
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("polled");
    copy.get_mapped_range(..).expect("mapped").to_vec()
}

/// The entity of a name.
fn named(world: &mut World, name: &str) -> Entity {
    let mut all = world.simulation.world.query::<(Entity, &Name)>();
    all.iter(&world.simulation.world).find(|(_, own)| own.as_str() == name).map(|(entity, _)| entity).expect("there")
}

#[test]
fn arrays_on_the_device_are_those_of_captures() {
    let Some(gpu) = common::gpu() else { return };
    let stock = stock();
    let mut worlds = [world(&stock, 0), world(&stock, 1), world(&stock, 2)];
    let expected: Vec<Capture> = worlds.iter_mut().map(|world| expected(&gpu, world)).collect();
    let scale = [7.0, 8.0, 9.5];
    let mut drawing = Drawing::of_many(Some(&gpu));
    let mut all_steps = Vec::new();
    for name in ["left", "small"] {
        let cameras = worlds.each_mut().map(|world| [named(world, name)]);
        let asked = worlds.iter_mut().zip(&cameras);
        let mut asked: Vec<_> =
            asked.map(|(world, own)| (&mut world.simulation, &mut world.sensors, Wanted::Look(own))).collect();
        let plan = drawing.plan_pack(&Settings::default(), &mut asked, scale.to_vec()).expect("planned");
        let layout = plan.layout().clone();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let descriptor = wgpu::BufferDescriptor { label: None, size: layout.bytes, usage, mapped_at_creation: false };
        let target = gpu.device.create_buffer(&descriptor);
        drawing.pack(&mut asked, &plan, &target).expect("packed");
        let bytes = bytes_of(&gpu, &target);
        let array = |array, view: u64| {
            let start = (layout.start(array).expect("packed") + view * layout.view_bytes(array)) as usize;
            let pixels = u64::from(layout.size.0 * layout.size.1);
            bytes[start..start + (pixels * array.pixel_bytes()) as usize].to_vec()
        };
        for (view, capture) in (0..).zip(&expected) {
            let SensorData::Camera(camera) = &capture[name].data else { panic!("{name} is a camera") };
            assert_eq!(array(PackedArray::Color, view), camera.color.as_flattened(), "{name} {view}");
            let depth = array(PackedArray::Depth, view);
            let depth = depth.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
            // A product, a sum and a division, of which drivers may round the last by 2.5 units in the last place.
            let is_near =
                |(own, packed): (&f32, f32)| *own == packed || (own - packed).abs() <= 4.0 * f32::EPSILON * own;
            assert!(camera.depth.iter().zip(depth).all(is_near), "{name} {view}");
            let ids = [(PackedArray::Instance, &camera.instance), (PackedArray::Part, &camera.part)];
            for (packed, own) in ids {
                assert_eq!(array(packed, view), bytemuck::cast_slice::<_, u8>(own), "{packed:?} of {name} {view}");
            }
            let passed = |depth: &f32| scale.iter().filter(|step| *step <= depth).count() as u8 + 1;
            let steps = camera.depth.iter().map(|depth| if depth.is_finite() { passed(depth) } else { 255 });
            let steps: Vec<u8> = steps.collect();
            assert_eq!(array(PackedArray::DepthSteps, view), steps, "{name} {view}");
            all_steps.extend(steps);
        }
    }
    assert!([1, 2, 3, 4, 255].iter().all(|step| all_steps.contains(step)), "all kinds of depths");
}

#[test]
fn captures_of_some_sensors_together_are_those_of_these_sensors() {
    let Some(gpu) = common::gpu() else { return };
    let mut worlds = [world(&stock(), 0), world(&stock(), 1)];
    let expected: Vec<Capture> = worlds.iter_mut().map(|world| expected(&gpu, world)).collect();
    let mut drawing = Drawing::of_many(Some(&gpu));
    let captures = together(&mut drawing, worlds.iter_mut(), &|name| name != "left");
    for (capture, expected) in captures.iter().zip(&expected) {
        assert_eq!(capture.sensors.len(), 2);
        assert!(capture["right"] == expected["right"] && capture["small"] == expected["small"]);
    }
    assert!(together(&mut drawing, [].into_iter(), &|_| true).is_empty());
}

#[test]
fn what_one_world_changes_in_its_library_others_do_not_see() {
    let Some(gpu) = common::gpu() else { return };
    let stock = stock();
    let mut worlds = [world(&stock, 0), world(&stock, 0)];
    let mut drawing = Drawing::of_many(Some(&gpu));
    let before = together(&mut drawing, worlds.iter_mut(), &|_| true);
    assert!(before[0] == before[1], "the same world twice");
    // The second, the first, both: a mesh and an image.
    for (i, changed) in [vec![1], vec![0], vec![0, 1]].into_iter().enumerate() {
        for &which in &changed {
            let World { simulation, mesh, image, .. } = &mut worlds[which];
            let mut library = simulation.world.resource_mut::<Library>();
            library.replace_mesh(*mesh, shapes::cube(Vec3::new(0.5, 1.0 + i as f32, 0.5)));
            library.replace_image(*image, checks(8, [0, 60 * i as u8, 200]));
        }
        let expected: Vec<Capture> = worlds.iter_mut().map(|world| expected(&gpu, world)).collect();
        let seen = together(&mut drawing, worlds.iter_mut(), &|_| true);
        assert!(seen == expected, "change {i}");
        assert_eq!([seen[0] == before[0], seen[1] == before[0]], [i == 0, false], "change {i}");
    }
}

#[test]
fn what_a_forgotten_world_had_changed_is_not_taken_for_what_it_shared() {
    let Some(gpu) = common::gpu() else { return };
    let stock = stock();
    let mut worlds = [world(&stock, 0), world(&stock, 0)];
    let mut drawing = Drawing::of_many(Some(&gpu));
    let before = together(&mut drawing, worlds.iter_mut(), &|_| true);
    let [first, second] = &mut worlds;
    let mut library = second.simulation.world.resource_mut::<Library>();
    library.replace_mesh(second.mesh, shapes::cube(Vec3::new(0.3, 2.0, 0.3)));
    library.replace_image(second.image, checks(8, [0, 200, 0]));
    let changed = together(&mut drawing, [&mut *second].into_iter(), &|_| true);
    assert!(changed[0] != before[0]);
    drawing.forget(second.simulation.draw_list().world);
    let seen = together(&mut drawing, [&mut *first].into_iter(), &|_| true);
    assert!(seen[0] == expected(&gpu, first));
}

#[test]
fn what_worlds_share_is_uploaded_once() {
    let Some(gpu) = common::gpu() else { return };
    let stock = stock();
    let mut worlds = [world(&stock, 0), world(&stock, 1)];
    let view = View::new(&GlobalTransform::default().affine(), &Camera::default(), 32, 32);
    let plan = ViewPlan { view, settings: Settings { samples: 1, ..Settings::default() } };
    let mut renderer = Renderer::new(&gpu);
    renderer.keep_worlds();
    let mut batches = ViewBatches::default();
    let mut uploaded = |world: &mut World| {
        world.simulation.frame();
        let plans = std::slice::from_ref(&plan);
        world.simulation.with_frame(|frame| renderer.draw_views(frame, &mut batches, plans)).expect("drawn");
        (renderer.stats().asset_bytes, renderer.stats().instance_bytes)
    };
    let [first, second] = &mut worlds;
    let (assets, instances) = uploaded(first);
    assert!(assets > 0 && instances > 0);
    assert_eq!(uploaded(second), (0, instances));
    // What rests is kept.
    assert_eq!((uploaded(first), uploaded(second)), ((0, 0), (0, 0)));
    // Materials are each world's own, as those that a scene makes for the lamps of its signals.
    let mut third = world(&stock, 0);
    paint(&mut third);
    assert_eq!(uploaded(&mut third), (0, instances));
}

/// Another material, and another colour of one.
fn paint(world: &mut World) {
    let mut library = world.simulation.world.resource_mut::<Library>();
    library.add_material(Material { base_factor: Vec4::ONE, ..Material::default() });
    let mapped = library.materials().find(|(_, material)| material.base_map.is_some()).map(|(id, _)| id);
    assert!(library.edit_material(mapped.expect("a mapped one"), |own| own.emissive_factor = Vec3::new(0.3, 0.0, 0.1)));
}

#[test]
fn a_world_that_changes_its_materials_looks_as_it_does_alone() {
    let Some(gpu) = common::gpu() else { return };
    let stock = stock();
    let mut worlds = [world(&stock, 0), world(&stock, 0)];
    let mut drawing = Drawing::of_many(Some(&gpu));
    let before = together(&mut drawing, worlds.iter_mut(), &|_| true);
    for which in [1, 0] {
        paint(&mut worlds[which]);
        let expected: Vec<Capture> = worlds.iter_mut().map(|world| expected(&gpu, world)).collect();
        let seen = together(&mut drawing, worlds.iter_mut(), &|_| true);
        assert!(seen == expected, "world {which}");
        assert!(seen[which] != before[which], "world {which} is seen to change");
    }
}
