//! Culling of objects: the picture is the same with any culling, and what cannot be seen is left out.

mod rooms;
mod samples;
mod still;

use crate::common::{self, prelude::*};
use relief::renderer::VisibleCounts;
use systems::cells::{Cell, Cells, OUTSIDE, Opening};
use systems::space::Aabb;

const SIZE: (u32, u32) = (96, 54);

struct Scene {
    simulation: Simulation,
    camera: Entity,
    light: Entity,
    meshes: Vec<MeshId>,
    materials: Vec<MaterialId>,
}

impl Scene {
    /// A lamp, a camera at the origin, and things to make objects of.
    fn new() -> Self {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let shapes = [shapes::cube(Vec3::ONE), shapes::sphere(0.5, 24, 16), shapes::torus(0.5, 0.2, 8, 6)];
        let meshes = shapes.map(|shape| library.add_mesh(shape)).to_vec();
        let mut material = |base: Vec3, alpha| {
            library.add_material(Material { base_factor: base.extend(0.5), alpha, ..Material::default() })
        };
        let materials = vec![
            material(Vec3::new(0.9, 0.3, 0.2), AlphaMode::Opaque),
            material(Vec3::new(0.2, 0.7, 0.3), AlphaMode::Opaque),
            material(Vec3::new(0.3, 0.4, 0.9), AlphaMode::Mask),
            material(Vec3::new(0.9, 0.9, 0.2), AlphaMode::Blend),
        ];
        let light = simulation.world.spawn(Light::directional(1.0)).id();
        let camera = simulation.world.spawn(Camera::default()).id();
        Self { simulation, camera, light, meshes, materials }
    }

    fn spawn(&mut self, mesh: usize, material: usize, place: Transform) -> Entity {
        self.simulation.world.spawn((self.meshes[mesh], self.materials[material], place)).id()
    }

    /// Puts the camera there, and runs the systems of a frame.
    fn look(&mut self, place: Transform) {
        self.simulation.world.entity_mut(self.camera).insert(place);
        self.simulation.frame();
    }

    fn project(&mut self, projection: Projection) {
        self.simulation.world.entity_mut(self.camera).insert(Camera { projection, ..Camera::default() });
        self.simulation.frame();
    }

    /// An object of a mesh and material of its own.
    fn add(&mut self, mesh: Mesh, material: Material, place: Transform) -> Entity {
        let mut library = self.simulation.world.resource_mut::<Library>();
        let object = (library.add_mesh(mesh), library.add_material(material), place);
        self.simulation.world.spawn(object).id()
    }

    /// Draws the world as it is, without another frame of the systems.
    fn draw_with(&mut self, renderer: &mut SingleView, settings: Settings) -> (image::RgbaImage, VisibleCounts) {
        let view = Viewpoint::Camera(self.camera).view(&self.simulation.world, SIZE);
        self.simulation.with_frame(|frame| renderer.prepare(frame, &view, &settings)).expect("it fits");
        (renderer.draw_picture(), renderer.read_visible_counts())
    }

    fn draw(&mut self, renderer: &mut SingleView, occlusion: Occlusion) -> (image::RgbaImage, VisibleCounts) {
        self.draw_with(renderer, with(occlusion))
    }

    /// The picture of a renderer that saw nothing before, of all objects.
    fn draw_afresh(&mut self, gpu: &Gpu, settings: Settings) -> image::RgbaImage {
        self.draw_with(&mut SingleView::new(gpu), Settings { occlusion: Occlusion::Off, ..settings }).0
    }
}

fn renderer() -> Option<SingleView> {
    Some(SingleView::new(&common::gpu()?))
}

fn with(occlusion: Occlusion) -> Settings {
    Settings { occlusion, levels: LevelOfDetail::OFF, ..Settings::default() }
}

fn unit(random: &mut TestRng) -> f32 {
    random.random::<f32>() * 2.0 - 1.0
}

fn random_place(random: &mut TestRng, spread: f32) -> Transform {
    let place = Vec3::new(unit(random), unit(random) * 0.2, unit(random)) * spread;
    let turn = Quat::from_euler(glam::EulerRot::XYZ, unit(random) * 3.0, unit(random) * 3.0, 0.0);
    let scale = Vec3::new(1.0 + unit(random) * 0.5, 1.0, if random.random_bool(0.2) { -1.5 } else { 0.7 });
    Transform::from_translation(place).with_rotation(turn).with_scale(scale)
}

#[test]
fn the_picture_is_the_same_however_objects_are_culled() {
    let Some(gpu) = common::gpu() else { return };
    // A device on which indirect draws must begin at instance 0.
    let plain = Gpu::headless_with(wgpu::Features::empty()).expect("the same adapter");
    assert!(!plain.device.features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE));
    let mut renderers = [
        (SingleView::new(&gpu), Occlusion::Off, 4),
        (SingleView::new(&gpu), Occlusion::On, 4),
        (SingleView::new(&plain), Occlusion::Off, 4),
        (SingleView::new(&plain), Occlusion::On, 4),
    ];
    let mut random = random();
    let mut scene = Scene::new();
    let objects: Vec<Entity> = (0..600)
        .map(|i| {
            let place = random_place(&mut random, 20.0);
            scene.spawn(i % 3, i / 3 % 4, place)
        })
        .collect();
    let (mut least, mut most) = (u32::MAX, 0);
    for frame in 0..12 {
        // A camera that turns, jumps, and draws in parallel for a while; some objects move.
        let turn = Quat::from_rotation_y(frame as f32 * 0.35);
        scene.look(
            Transform::from_xyz(frame as f32 % 5.0 - 2.0, 0.5, if frame > 7 { 24.0 } else { 0.0 }).with_rotation(turn),
        );
        let parallel = Projection::Orthographic { half_height: 6.0, aspect: None };
        scene.project(if frame % 4 == 3 { parallel } else { Camera::default().projection });
        for &object in objects.iter().skip(frame).step_by(7) {
            *scene.simulation.world.get_mut::<Transform>(object).expect("a place") = random_place(&mut random, 20.0);
        }
        scene.simulation.frame();
        let mut pictures = renderers.iter_mut().map(|(renderer, occlusion, samples)| {
            scene.draw_with(renderer, Settings { samples: *samples, ..with(*occlusion) })
        });
        let (expected, all) = pictures.next().expect("the first");
        for (number, (picture, drawn)) in pictures.enumerate() {
            assert!(picture == expected, "frame {frame}, renderer {}", number + 1);
            assert!(drawn.objects <= all.objects);
            // Behind the others, later, the camera looks away from them.
            least = if frame > 7 { least } else { least.min(drawn.objects) };
        }
        most = most.max(all.objects);
    }
    assert!(least > 20 && least < most && most < 600, "{least} to {most} drawn");
}

#[test]
fn what_a_wall_hides_is_not_drawn_and_comes_back_at_once_when_the_wall_goes() {
    let Some(mut renderer) = renderer() else { return };
    for samples in [1, 4] {
        let mut scene = Scene::new();
        for i in 0..400 {
            let place = Vec3::new((i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5, -30.0);
            scene.spawn(0, 0, Transform::from_translation(place).with_scale(Vec3::splat(0.5)));
        }
        let wall = scene.spawn(0, 1, Transform::from_xyz(0.0, 0.0, -10.0).with_scale(Vec3::new(40.0, 40.0, 1.0)));
        scene.spawn(0, 2, Transform::from_xyz(0.0, 0.0, -5.0));
        scene.simulation.frame();
        let settings = Settings { samples, ..with(Occlusion::On) };
        scene.draw_with(&mut renderer, settings);
        // The lists of the first frame knew of no wall; the camera must move for others to be made.
        scene.look(Transform::from_xyz(0.01, 0.0, 0.0));
        let (_, behind) = scene.draw_with(&mut renderer, settings);
        scene.look(Transform::from_xyz(0.02, 0.0, 0.0));
        let (_, behind_still) = scene.draw_with(&mut renderer, settings);
        assert_eq!([behind_still.objects, behind.objects.min(402)], [2, behind.objects], "{samples} samples");
        scene.simulation.world.despawn(wall);
        scene.simulation.frame();
        let (seen, drawn) = scene.draw_with(&mut renderer, settings);
        // The box in front hides what is 3.3 m aside at the most, six by six boxes, of which culling may keep some.
        assert!((365..=401).contains(&drawn.objects), "{}", drawn.objects);
        assert!(seen == scene.draw_afresh(renderer.gpu(), settings));
    }
}

#[test]
fn objects_outside_the_view_are_not_drawn() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    for i in 0..100 {
        // In front, behind, to the sides and above; spheres of radius 0.5.
        let direction = [Vec3::NEG_Z, Vec3::Z, Vec3::X, Vec3::NEG_X, Vec3::Y][i % 5];
        scene.spawn(1, 0, Transform::from_translation(direction * (3.0 + 0.2 * i as f32)));
    }
    scene.simulation.frame();
    assert_eq!(scene.draw(&mut renderer, Occlusion::Off).1.objects, 20);
    scene.look(Transform::default().looking_to(Vec3::X, Vec3::Y));
    assert_eq!(scene.draw(&mut renderer, Occlusion::Off).1.objects, 20);
    // A sphere whose centre is outside and whose edge is inside: 1 m ahead the view ends 1.02 m beside its middle.
    let mut scene = Scene::new();
    scene.project(Projection::Perspective { fov_y: 1.0, aspect: None });
    let edge = 0.5f32.tan() * SIZE.0 as f32 / SIZE.1 as f32;
    let object = scene.spawn(1, 0, Transform::from_xyz(edge * 5.0 + 0.4, 0.0, -5.0));
    scene.simulation.frame();
    assert_eq!(scene.draw(&mut renderer, Occlusion::Off).1.objects, 1);
    scene.simulation.world.get_mut::<Transform>(object).expect("a place").translation.x += 0.5;
    scene.simulation.frame();
    assert_eq!(scene.draw(&mut renderer, Occlusion::Off).1.objects, 0);
}

/// The sum of all differences between neighbours, along rows and columns.
fn variation(picture: &image::RgbaImage) -> u64 {
    let neighbours =
        |x: u32, y: u32| [(x + 1, y), (x, y + 1)].into_iter().filter_map(move |(x, y)| picture.get_pixel_checked(x, y));
    let apart = |a: &image::Rgba<u8>, b: &image::Rgba<u8>| {
        a.0.iter().zip(b.0).map(|(a, b)| u64::from(a.abs_diff(b))).sum::<u64>()
    };
    picture.enumerate_pixels().map(|(x, y, pixel)| neighbours(x, y).map(|next| apart(pixel, next)).sum::<u64>()).sum()
}

#[test]
fn far_objects_are_drawn_with_fewer_triangles_and_look_the_same() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    scene.spawn(1, 0, Transform::from_xyz(0.0, 0.0, -2.0));
    scene.simulation.frame();
    let on = Settings::default();
    let off = Settings { levels: LevelOfDetail::OFF, ..on };
    let whole = scene.draw_with(&mut renderer, off).1;
    assert_eq!(whole.objects, 1);
    let mut triangles = Vec::new();
    for step in 0..7 {
        // The sphere's middle is that of a pixel, however small it becomes.
        let distance = 2.5f32.powi(step) + 1.0;
        let half_a_pixel = distance * (45f32.to_radians() / 2.0).tan() / SIZE.1 as f32;
        scene.look(Transform::from_xyz(half_a_pixel, half_a_pixel, distance - 2.0));
        let (fine, all) = scene.draw_with(&mut renderer, off);
        let (coarse, some) = scene.draw_with(&mut renderer, on);
        assert_eq!((all.triangles, some.objects), (whole.triangles, 1));
        triangles.push(some.triangles);
        let difference: u64 = fine.as_raw().iter().zip(coarse.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        // A level is a pixel off at the most. What moves by no more than that changes a picture by no more than it
        // changes from pixel to pixel: on the ball, as vertices have the ball's normals, and at its rim.
        let variation = variation(&fine);
        assert!(difference <= variation, "step {step}: {difference}, {variation} at the most");
    }
    assert!(triangles.is_sorted_by(|near, far| near >= far), "{triangles:?}");
    assert!(triangles[0] * 2 <= whole.triangles && triangles[6] * 4 < triangles[0], "{triangles:?}");
    // Close by, nothing is left out.
    scene.look(Transform::from_xyz(0.0, 0.0, -1.45));
    assert_eq!(scene.draw_with(&mut renderer, on).1, whole);
}

/// Takes a component away, or gives it.
fn toggle<C: Component>(world: &mut World, entity: Entity, component: C) {
    let mut entity = world.entity_mut(entity);
    if entity.contains::<C>() {
        entity.remove::<C>();
    } else {
        entity.insert(component);
    }
}

#[test]
fn a_world_that_lived_looks_like_one_made_as_it_is_now() {
    let Some(gpu) = common::gpu() else { return };
    let mut random = random();
    let mut scene = Scene::new();
    let settings = |occlusion| Settings { samples: 1, ..with(occlusion) };
    let mut lived = Headless { settings: settings(Occlusion::On), ..common::headless(&gpu) };
    let mut objects: Vec<(Entity, usize, usize)> = Vec::new();
    let mut anchor = None;
    scene.look(Transform::from_xyz(0.0, 14.0, 24.0).looking_at(Vec3::ZERO, Vec3::Y));
    for frame in 0..150 {
        for _ in 0..random.random_range(0..30) {
            let (mesh, material) = (random.random_range(0..3), random.random_range(0..4));
            let place = random_place(&mut random, 16.0);
            objects.push((scene.spawn(mesh, material, place), mesh, material));
        }
        for _ in 0..random.random_range(0..20) {
            if objects.is_empty() {
                break;
            }
            let index = random.random_range(0..objects.len());
            let (object, mesh, material) = &mut objects[index];
            let world = &mut scene.simulation.world;
            match random.random_range(0..6) {
                0 => *world.get_mut::<Transform>(*object).expect("a place") = random_place(&mut random, 16.0),
                1 => {
                    *mesh = random.random_range(0..3);
                    world.entity_mut(*object).insert(scene.meshes[*mesh]);
                }
                2 => {
                    *material = random.random_range(0..4);
                    world.entity_mut(*object).insert(scene.materials[*material]);
                }
                3 => {
                    // Below another, away from it again, and that one moves.
                    let parent = *anchor.get_or_insert_with(|| world.spawn(Transform::default()).id());
                    toggle(world, *object, ChildOf(parent));
                    world.get_mut::<Transform>(parent).expect("a place").translation.x = unit(&mut random);
                }
                // Out of sight, and back.
                4 => toggle(world, *object, Hidden),
                _ => {
                    world.despawn(*object);
                    objects.swap_remove(index);
                }
            }
        }
        let picture = lived.draw(&mut scene.simulation, scene.camera, SIZE).expect("a picture");
        if frame % 25 != 24 {
            continue;
        }
        let mut fresh = Scene::new();
        let world = &scene.simulation.world;
        fresh.look(*world.get::<Transform>(scene.camera).expect("a place"));
        let parent = anchor.map(|anchor| *world.get::<Transform>(anchor).expect("a place"));
        let parent = fresh.simulation.world.spawn(parent.unwrap_or_default()).id();
        for &(object, mesh, material) in &objects {
            let copy = fresh.spawn(mesh, material, *world.get::<Transform>(object).expect("a place"));
            if world.get::<Hidden>(object).is_some() {
                fresh.simulation.world.entity_mut(copy).insert(Hidden);
            }
            if world.get::<ChildOf>(object).is_some() {
                fresh.simulation.world.entity_mut(copy).insert(ChildOf(parent));
            }
        }
        let mut renderer = Headless { settings: settings(Occlusion::Off), ..common::headless(&gpu) };
        let expected = renderer.draw(&mut fresh.simulation, fresh.camera, SIZE).expect("a picture");
        let different = picture.pixels().zip(expected.pixels()).filter(|(a, b)| a != b).count();
        // Where surfaces cross, the one drawn first stays if depths are equal to the bit, and the order has a history.
        // Of 24 bits, a depth changes by a hundredth from pixel to pixel: that is one in 170,000 such pixels, and a
        // picture has 5,184.
        assert!(different <= 2, "frame {frame}, {} objects: {different} pixels differ", objects.len());
    }
    assert!(objects.len() > 500, "{}", objects.len());
}

#[test]
fn near_objects_are_drawn_before_far_ones() {
    let Some(mut renderer) = renderer() else { return };
    let mut random = random();
    let mut scene = Scene::new();
    for _ in 0..2000 {
        let distance = 2.0 * 200f32.powf(random.random::<f32>());
        let aside = Vec3::new(unit(&mut random), unit(&mut random), 0.0) * distance;
        let place = Transform::from_translation(aside - Vec3::Z * distance).with_scale(Vec3::splat(0.3 * distance));
        scene.spawn(1, 0, place);
    }
    scene.simulation.frame();
    for turn in [0.0, 0.4] {
        scene.look(Transform::from_xyz(0.3, 0.0, 0.0).with_rotation(Quat::from_rotation_y(turn)));
        let (_, drawn) = scene.draw(&mut renderer, Occlusion::Off);
        let slots = renderer.read_visible_slots();
        assert_eq!(slots.len() as u32, drawn.objects);
        assert!(slots.len() > 500, "{}", slots.len());
        let eye = Vec3::new(0.3, 0.0, 0.0);
        let distances: Vec<f32> = slots
            .iter()
            .map(|&slot| {
                let record = scene.simulation.instance_records().get(slot);
                let [x, y, z] = record.world_from_object.map(|row| row[3]);
                Vec3::new(x, y, z).distance(eye)
            })
            .collect();
        let mut farthest = 0f32;
        for (place, distance) in distances.iter().enumerate() {
            farthest = farthest.max(*distance);
            // Slices are half octaves: a factor of √2, rounded.
            assert!(distance * 1.4143 > farthest, "{place}: {distance} m after {farthest} m");
        }
        // Within a slice, in the order of slots; every object once.
        // Of 32 slices, the distances from 2 m to 400 m are in 16.
        let descents = slots.windows(2).filter(|pair| pair[0] >= pair[1]).count();
        assert!((5..32).contains(&descents), "{descents} slices begin");
        let mut each = slots.clone();
        each.sort_unstable();
        each.dedup();
        assert_eq!(each.len(), slots.len());
    }
}

impl Scene {
    /// A plate 5 m before the camera whose surface lies as deep below its mesh as the material says; its front is
    /// toward the camera, or away from it.
    fn add_sunk_plate(&mut self, size: f32, material: Material, toward: f32) {
        let low = Image::rgba8("low", 8, 8, ImageKind::Data, vec![0; 256]);
        let height_map = Some(Map::new(self.simulation.world.resource_mut::<Library>().add_image(low)));
        let turn = Quat::from_rotation_x(toward * std::f32::consts::FRAC_PI_2);
        let plate = shapes::plane(Vec2::splat(size), UVec2::ONE);
        self.add(plate, Material { height_map, ..material }, Transform::from_xyz(0.0, 0.0, -5.0).with_rotation(turn));
    }
}
