//! Camera sensors against what is known of their every pixel.

use crate::common::{self, dark_world, prelude::*, unlit};
use relief::renderer::ViewBatches;
use relief::sense::CameraCapture;
use systems::sensors::{CameraOutputs, Class, Instance};

const SIZE: (u32, u32) = (97, 64);

/// Principal points and focal lengths that no symmetric lens has.
const INTRINSICS: Intrinsics = Intrinsics { fx: 80.0, fy: 70.0, cx: 40.25, cy: 36.5 };

fn all_outputs() -> CameraOutputs {
    CameraOutput::ALL.into_iter().map(|(_, output)| output).collect()
}

fn sensor(lens: Lens) -> CameraSensor {
    CameraSensor { size: SIZE, lens, outputs: all_outputs(), ..CameraSensor::default() }
}

fn mesh(simulation: &mut Simulation, mesh: systems::assets::Mesh) -> MeshId {
    simulation.world.resource_mut::<Library>().add_mesh(mesh)
}

/// Capture of a world by a camera at the origin that looks along −Z.
fn captured(simulation: &mut Simulation, camera: CameraSensor) -> Option<CameraCapture> {
    let gpu = common::gpu()?;
    let entity = simulation.world.spawn((Sensor::camera(camera), Name::new("eye"))).id();
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    // Meshes as they are.
    suite.settings.levels = LevelOfDetail::OFF;
    let capture = suite.capture(simulation).expect("captured");
    simulation.world.despawn(entity);
    Some(capture["eye"].camera().expect("a camera").clone())
}

/// The ray of a pixel in camera axes, 1 along the optical axis.
fn rays(intrinsics: Intrinsics) -> impl Iterator<Item = DVec3> {
    let pixels = (0..SIZE.1).flat_map(|v| (0..SIZE.0).map(move |u| (u, v)));
    pixels.map(move |(u, v)| intrinsics.direction(f64::from(u), f64::from(v)))
}

/// A plane that everything of the picture shows, through (0, 0, −5), tilted back by an angle about X.
fn tilted_plane(simulation: &mut Simulation, angle: f32) {
    let plane = mesh(simulation, shapes::plane(Vec2::splat(40.0), UVec2::splat(40)));
    let material = unlit(simulation, Vec3::new(0.25, 0.5, 1.0));
    // Upright, its front toward +Z, its top leaning away.
    let rotation = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2 - angle);
    let at = Transform::from_xyz(0.0, 0.0, -5.0).with_rotation(rotation);
    simulation.world.spawn((plane, material, at));
}

#[test]
fn depth_range_and_normals_of_planes_are_those_of_their_equations() {
    let Some(rounding) = common::gpu().map(|gpu| f64::from(gpu.vertex_rounding())) else { return };
    let lenses = [Lens::FieldOfView { y: 1.0 }, Lens::Pinhole(INTRINSICS)];
    for (lens, angle) in lenses.into_iter().flat_map(|lens| [0.0_f32, 0.5].map(|angle| (lens, angle))) {
        let mut simulation = dark_world();
        tilted_plane(&mut simulation, angle);
        let camera = sensor(lens);
        let intrinsics = camera.intrinsics().expect("perspective");
        let Some(found) = captured(&mut simulation, camera) else { return };
        assert_eq!(found.intrinsics, Some(intrinsics));
        let (sin, cos) = f64::from(angle).sin_cos();
        let normal = DVec3::new(0.0, -sin, -cos);
        for (place, ray) in rays(intrinsics).enumerate() {
            // (ray·depth − (0, 0, 5))·normal = 0.
            let depth = 5.0 * normal.z / ray.dot(normal);
            let off = |found: f32, expected: f64| (f64::from(found) - expected).abs() / expected;
            // Floats of the depth buffer and of the vertices' places; where the plane is tilted, how much deeper it is
            // as far away in the picture as the rasterizer may move a vertex.
            let per_pixel = (normal.y / intrinsics.fy / ray.dot(normal)).abs();
            let room = 1e-5 + 2.0 * rounding * per_pixel;
            assert!(off(found.depth[place], depth) < room, "{angle} {ray}: {} for {depth}", found.depth[place]);
            assert!(off(found.range[place], depth * ray.length()) < room, "{angle} {ray}: range");
            let [x, y, z] = found.normal[place];
            // Half floats.
            assert!(DVec3::new(x.into(), y.into(), z.into()).abs_diff_eq(normal, 1e-3), "{angle}: {x} {y} {z}");
        }
    }
}

#[test]
fn linear_colours_are_those_of_the_material_and_what_is_far_is_nothing() {
    let mut simulation = dark_world();
    simulation.world.resource_mut::<Environment>().exposure = 0.5;
    tilted_plane(&mut simulation, 0.0);
    let lens = Lens::Pinhole(INTRINSICS);
    let Some(found) = captured(&mut simulation, sensor(lens)) else { return };
    // Each is a half float.
    assert!(found.linear.iter().all(|rgb| rgb.map(f32::from) == [0.125, 0.25, 0.5]), "{:?}", found.linear[0]);
    let near = CameraSensor { far: 4.0, ..sensor(lens) };
    let found = captured(&mut simulation, near).expect("there is an adapter");
    assert!(found.depth.iter().chain(&found.range).all(|depth| *depth == f32::INFINITY));
    assert!(found.normal.iter().all(|normal| *normal == [0.0; 3]));
    let numbers = [&found.instance, &found.part, &found.panoptic];
    assert!(numbers.into_iter().flatten().all(|number| *number == 0) && found.class.iter().all(|class| *class == 0));
}

#[test]
fn a_sphere_is_as_far_as_a_ray_says() {
    let Some(rounding) = common::gpu().map(|gpu| f64::from(gpu.vertex_rounding())) else { return };
    let (radius, rings) = (1.5, 128);
    let mut simulation = dark_world();
    let sphere = mesh(&mut simulation, shapes::sphere(radius, 2 * rings, rings));
    let material = unlit(&mut simulation, Vec3::ONE);
    let center = DVec3::new(0.4, -0.3, 6.0);
    simulation.world.spawn((sphere, material, Transform::from_xyz(0.4, 0.3, -6.0)));
    let Some(found) = captured(&mut simulation, sensor(Lens::Pinhole(INTRINSICS))) else { return };
    let radius = f64::from(radius);
    // Of a face: half its diagonal as an arc.
    let sagitta = radius * (1.0 - (std::f64::consts::PI / f64::from(rings) / 2f64.sqrt()).cos());
    let (mut hits, mut misses) = (0, 0);
    for (ray, range) in rays(INTRINSICS).zip(&found.range) {
        let ray = ray.normalize();
        let along = ray.dot(center);
        let aside = (center.length_squared() - along * along).sqrt();
        // Not where the outline passes.
        if aside < 0.98 * radius {
            let expected = along - (radius * radius - aside * aside).sqrt();
            // What is missing along the normal, along the ray.
            let cosine = (1.0 - (aside / radius).powi(2)).sqrt();
            // And as far aside as the rasterizer may move a vertex.
            let moved = 2.0 * rounding / INTRINSICS.fy * along * (aside / radius) / cosine + 1e-4;
            let room = sagitta / cosine * 1.1 + moved;
            let off = f64::from(*range) - expected;
            assert!((-moved..room).contains(&off), "{ray}: {range} for {expected}");
            hits += 1;
        } else if aside > 1.02 * radius {
            assert_eq!(*range, f32::INFINITY);
            misses += 1;
        }
    }
    assert!(hits > 500 && misses > 500, "{hits} {misses}");
}

/// Two squares of a car side by side, a wall of its own and a cone without a class; in front of each other nowhere.
#[test]
fn numbers_and_classes_are_those_of_the_registry() {
    let mut simulation = dark_world();
    let square = mesh(&mut simulation, shapes::plane(Vec2::ONE, UVec2::ONE));
    let material = unlit(&mut simulation, Vec3::ONE);
    let world = &mut simulation.world;
    let mut part = |x: f32, y: f32, parent: Option<Entity>| {
        let upright = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let part = world.spawn((square, material, Transform::from_xyz(x, y, -6.0).with_rotation(upright))).id();
        if let Some(parent) = parent {
            world.entity_mut(part).insert(ChildOf(parent));
        }
        part
    };
    let lone = part(-3.0, 0.0, None);
    let wall = part(3.0, 0.0, None);
    let body = part(-1.0, 0.0, None);
    let wheel = part(2.0, 0.0, Some(body));
    let other_body = part(1.0, 2.0, None);
    // The wheel hangs below the body, and its place counts from there.
    *world.get_mut::<Transform>(wheel).expect("lives") = Transform::from_xyz(2.0, 0.0, 0.0);
    world.entity_mut(body).insert((Instance, Class(26)));
    world.entity_mut(other_body).insert((Instance, Class(26)));
    world.entity_mut(wall).insert(Class(12));
    let camera =
        CameraSensor { size: (81, 61), ..sensor(Lens::Pinhole(Intrinsics { fx: 60.0, fy: 60.0, cx: 40.0, cy: 30.0 })) };
    let Some(found) = captured(&mut simulation, camera) else { return };
    let id = |entity| simulation.world.resource::<EntityRegistry>().id(entity).expect("registered").0 + 1;
    // At a distance of 6 a metre is ten pixels.
    let at = |x: f32, y: f32| (30.0 - 10.0 * y) as usize * 81 + (40.0 + 10.0 * x) as usize;
    let seen = |x, y| {
        let place = at(x, y);
        (found.instance[place], found.part[place], found.class[place], found.panoptic[place])
    };
    assert_eq!(seen(-3.0, 0.0), (id(lone), id(lone), 0, 0));
    assert_eq!(seen(3.0, 0.0), (id(wall), id(wall), 12, 12));
    assert_eq!(seen(-1.0, 0.0), (id(body), id(body), 26, 26_000));
    assert_eq!(seen(1.0, 0.0), (id(body), id(wheel), 26, 26_000));
    assert_eq!(seen(1.0, 2.0), (id(other_body), id(other_body), 26, 26_001));
    assert_eq!(seen(0.0, -2.5), (0, 0, 0, 0));
    // Faces of a metre, seen face on: 10 pixels wide and high, or 11 where both borders go through centres of pixels.
    for entity in [wall, wheel, other_body] {
        let count = found.part.iter().filter(|part| **part == id(entity)).count();
        assert!((81..=121).contains(&count), "{count}");
    }
}

/// A street of boxes, spheres, leaves and panes under lights.
fn street(random: &mut TestRng, count: usize) -> Simulation {
    let mut simulation = Simulation::new();
    let world = &mut simulation.world;
    world.insert_resource(Environment { ambient: Vec3::splat(0.05), ..Environment::default() });
    let mut library = world.resource_mut::<Library>();
    let meshes = [shapes::cube(Vec3::ONE), shapes::sphere(0.5, 24, 16)].map(|shape| library.add_mesh(shape));
    let ground = library.add_mesh(shapes::plane(Vec2::splat(60.0), UVec2::ONE));
    let materials = [AlphaMode::Opaque, AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Blend].map(|alpha| {
        let base_factor = Vec3::new(random.random(), random.random(), random.random()).extend(0.6);
        library.add_material(Material { base_factor, alpha, ..Material::default() })
    });
    world.spawn((ground, materials[0], Transform::from_xyz(0.0, -1.0, 0.0)));
    world.spawn((Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_x(-0.9))));
    for _ in 0..4 {
        let at = Vec3::new(random.random::<f32>() * 20.0 - 10.0, 2.0, random.random::<f32>() * 20.0 - 10.0);
        world.spawn((Light::point(30.0, 8.0), Transform::from_translation(at)));
    }
    for i in 0..count {
        let mut number = || random.random::<f32>() * 2.0 - 1.0;
        let place = Vec3::new(number() * 10.0, number() * 0.5, number() * 10.0);
        let turned = Quat::from_euler(EulerRot::XYZ, number() * 3.0, number() * 3.0, number() * 3.0);
        let at = Transform::from_translation(place).with_rotation(turned).with_scale(Vec3::splat(1.0 + 0.8 * number()));
        world.spawn((meshes[i % 2], materials[i % 4], at, Class((i % 34) as u8)));
    }
    simulation
}

fn somewhere(random: &mut TestRng) -> Transform {
    let mut number = || random.random::<f32>() * 2.0 - 1.0;
    let place = Vec3::new(number() * 9.0, 0.3 + number(), number() * 9.0);
    Transform::from_translation(place).with_rotation(Quat::from_euler(
        EulerRot::YXZ,
        number() * 3.0,
        number() * 0.3,
        0.0,
    ))
}

#[test]
fn a_cameras_bits_depend_on_nothing_that_is_captured_beside_it() {
    let Some(gpu) = common::gpu() else { return };
    let random = &mut random();
    let mut simulation = street(random, 60);
    let lens = |i: usize| {
        if i.is_multiple_of(3) { Lens::Pinhole(INTRINSICS) } else { Lens::FieldOfView { y: 0.6 + 0.01 * i as f32 } }
    };
    let size = |i: usize| [(84, 84), (33, 47), (84, 84), (128, 40)][i % 4];
    for i in 0..64 {
        let outputs = all_outputs();
        let samples = if i % 5 == 4 { 4 } else { 1 };
        let camera = CameraSensor { size: size(i), lens: lens(i), outputs, samples, ..CameraSensor::default() };
        simulation.world.spawn((Sensor::camera(camera), Name::new(format!("{i}")), somewhere(random)));
    }
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    let together = suite.capture(&mut simulation).expect("captured");
    assert_eq!(together.sensors.len(), 64);
    let groups: [&[usize]; 5] = [&[0], &[63], &[17, 18, 19], &[4, 9], &[2, 6, 10, 14, 18]];
    for group in groups {
        let wanted = |name: &str| group.iter().any(|i| i.to_string() == name);
        // With what was kept of other cameras, and without.
        for suite in [&mut suite, &mut SensorSuite::new(&gpu)] {
            let some = suite.capture_some(&mut simulation, wanted).expect("captured");
            assert_eq!(some.sensors.len(), group.len());
            for sensor in &some.sensors {
                assert!(*sensor == together[sensor.name.as_str()], "{} of {group:?}", sensor.name);
            }
        }
    }
    let lit = together["1"].camera().expect("a camera");
    assert!(lit.color.iter().any(|rgb| *rgb != lit.color[0]), "there is something to be seen");
}

#[test]
fn colour_is_the_picture_that_a_camera_of_the_scene_has() {
    let Some(_) = common::gpu() else { return };
    let random = &mut random();
    let mut simulation = street(random, 40);
    let mut headless = Headless::new().expect("there is an adapter");
    for samples in [1, 4, 1, 4] {
        let at = somewhere(random).looking_at(somewhere(random).translation, Vec3::Y);
        let projection = Projection::Perspective { fov_y: 0.9, aspect: None };
        let eye = simulation.world.spawn((Camera { projection, ..Camera::default() }, at)).id();
        headless.settings.samples = samples;
        let colors = [CameraOutput::Color, CameraOutput::Linear].into_iter().collect();
        for outputs in [colors, all_outputs()] {
            let picture = headless.draw(&mut simulation, eye, SIZE).expect("drawn");
            let camera = CameraSensor { samples, outputs, ..sensor(Lens::FieldOfView { y: 0.9 }) };
            let camera = simulation.world.spawn((Sensor::camera(camera), Name::new("camera"), at)).id();
            let capture = SensorSuite::new(headless.renderer.gpu()).capture(&mut simulation).expect("captured");
            let colors = &capture["camera"].camera().expect("a camera").color;
            let is_same = picture.pixels().zip(colors).all(|(pixel, color)| pixel.0[..3] == color[..]);
            assert!(is_same, "{samples} samples, {outputs:?}");
            simulation.world.despawn(camera);
        }
    }
}

/// More views than there are shadow maps for: each has its own as if it were alone.
#[test]
fn shadows_do_not_depend_on_what_else_asks_for_maps() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = dark_world();
    let world = &mut simulation.world;
    let mut library = world.resource_mut::<Library>();
    let (pole, ground) =
        (library.add_mesh(shapes::cube(Vec3::new(0.4, 4.0, 0.4))), shapes::plane(Vec2::ONE, UVec2::ONE));
    let ground = library.add_mesh(ground);
    world.spawn((ground, Transform::from_scale(Vec3::new(1e5, 1.0, 40.0))));
    let sun = Light { shadows: true, ..Light::directional(2.0) };
    world.spawn((sun, Transform::from_rotation(Quat::from_euler(EulerRot::YXZ, 0.7, -0.8, 0.0))));
    // Eight levels of a sun around each place: so small pictures have coarse ones.
    let count = 44;
    for i in 0..count {
        let x = 900.0 * i as f32;
        world.spawn((pole, Transform::from_xyz(x, 2.0, -6.0)));
        let camera = CameraSensor { size: (24, 16), samples: 1, ..CameraSensor::default() };
        let at = Transform::from_xyz(x, 2.0, 0.0).with_rotation(Quat::from_rotation_x(-0.2));
        world.spawn((Sensor::camera(camera), Name::new(format!("{i}")), at));
    }
    register_all(&mut simulation.world);
    let together = SensorSuite::new(&gpu).capture(&mut simulation).expect("captured");
    for name in ["0", "20", "39", "40", "43"] {
        let alone = SensorSuite::new(&gpu).capture_some(&mut simulation, |own| own == name).expect("captured");
        assert!(alone[name] == together[name], "camera {name}");
        let colors = &together[name].camera().expect("a camera").color;
        assert!(colors.contains(&[0; 3]) && colors.iter().any(|rgb| rgb[0] > 60), "camera {name}");
    }
}

/// Culled on the CPU or on the GPU, whatever else is in view: objects of all sizes, levels of detail, beside the
/// picture and behind the eye.
#[test]
fn a_few_objects_look_the_same_wherever_they_are_culled() {
    let Some(gpu) = common::gpu() else { return };
    let random = &mut random();
    let mut renderer = Renderer::new(&gpu);
    let mut batches = [(); 2].map(|()| ViewBatches::default());
    for round in 0..12 {
        let mut simulation = street(random, 10 + 7 * round);
        let cameras = [Camera::default(), sensor(Lens::Pinhole(INTRINSICS)).camera(), {
            let projection = Projection::Orthographic { half_height: 4.0, aspect: None };
            Camera { projection, far: 40.0, ..Camera::default() }
        }];
        simulation.frame();
        for camera in cameras {
            let place = GlobalTransform::from(somewhere(random)).affine();
            let view = View::new(&place, &camera, 64, 48);
            let drawn = [true, false].map(|few_on_cpu| {
                let outputs = relief::renderer::OutputSet::ALL;
                let settings = Settings { samples: 1, outputs, few_on_cpu, ..Settings::default() }.for_files();
                let plans = [ViewPlan { view: view.clone(), settings }];
                let batches = &mut batches[usize::from(few_on_cpu)];
                let drawn = simulation.with_frame(|frame| renderer.draw_views(frame, batches, &plans));
                let drawn = drawn.expect("drawn").remove(0);
                (drawn.picture.clone(), drawn.depths(), drawn.entities(), drawn.normals(), drawn.linear())
            });
            assert!(drawn[0] == drawn[1], "round {round}, {camera:?}");
        }
    }
}

#[test]
fn a_sensor_is_captured_when_it_is_due_and_called_by_what_it_is_mounted_on() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = dark_world();
    let small = || CameraSensor { size: (8, 8), ..CameraSensor::default() };
    let car = simulation.world.spawn((Transform::from_xyz(7.0, 0.0, 0.0), Instance, Name::new("ego"))).id();
    let roof = simulation.world.spawn((Transform::from_xyz(0.0, 2.0, 0.0), ChildOf(car))).id();
    simulation.world.spawn((Sensor::camera(small()).every(3), Name::new("front"), ChildOf(roof)));
    let second = Sensor { phase: 1, ..Sensor::camera(small()).every(2) };
    simulation.world.spawn((second, Name::new("pole")));
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    let mut names = Vec::new();
    for step in 0..7 {
        let capture = suite.capture(&mut simulation).expect("captured");
        assert_eq!(capture.step, step);
        assert_eq!(capture.nanoseconds, (step as f64 * 1e9 / 60.0).round() as u64);
        if let Some(front) = capture.get("ego/front") {
            assert_eq!(front.world_from_sensor.translation, DVec3::new(7.0, 2.0, 0.0));
        }
        names.push(capture.sensors.into_iter().map(|sensor| sensor.name).collect::<Vec<_>>().join(" "));
        simulation.step();
    }
    assert_eq!(names, ["ego/front", "pole", "", "ego/front pole", "", "pole", "ego/front"]);
}
