//! Culling of objects: the picture is the same with any culling, and what cannot be seen is left out.

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
fn a_still_view_is_drawn_whole_when_the_picture_or_a_surface_changes() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    for i in 0..50 {
        scene.spawn(i % 3, 0, Transform::from_xyz(i as f32 * 0.1 - 2.5, 0.0, -6.0 - i as f32));
    }
    // A masked pane before them, of which everything shows.
    scene.spawn(0, 2, Transform::from_xyz(0.0, 0.0, -3.0).with_scale(Vec3::new(9.0, 9.0, 0.1)));
    scene.simulation.frame();
    for occlusion in [Occlusion::Off, Occlusion::On] {
        let on = with(occlusion);
        for _ in 0..3 {
            scene.draw_with(&mut renderer, on);
        }
        let seen = scene.draw_with(&mut renderer, on);
        assert_eq!(seen.1.objects, if occlusion == Occlusion::On { 1 } else { 51 });
        scene.draw_with(&mut renderer, Settings { samples: 1, ..on });
        assert!(scene.draw_with(&mut renderer, on) == seen, "samples, and back");
        let view = Viewpoint::Camera(scene.camera).view(&scene.simulation.world, (SIZE.0 * 2, SIZE.1 * 2));
        scene.simulation.with_frame(|frame| renderer.prepare(frame, &view, &on)).expect("it fits");
        let large = renderer.draw_picture();
        let mut fresh = SingleView::new(renderer.gpu());
        scene.simulation.with_frame(|frame| fresh.prepare(frame, &view, &with(Occlusion::Off))).expect("it fits");
        assert!(large == fresh.draw_picture(), "a larger picture");
        for _ in 0..3 {
            scene.draw_with(&mut renderer, on);
        }
        // Nothing shows of the pane any more.
        let mask = scene.materials[2];
        let edit = |scene: &mut Scene, alpha| {
            scene.simulation.world.resource_mut::<Library>().edit_material(mask, |m| m.base_factor.w = alpha);
            scene.simulation.frame();
        };
        edit(&mut scene, 0.1);
        assert!(scene.draw_with(&mut renderer, on).1.objects > 10, "what was hidden shows");
        edit(&mut scene, 0.5);
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

/// Small things far apart, in random poses. All in one colour, so that it does not matter which is in front. From the
/// middles of the meshes to their own origins it is `mesh_origin`.
fn dust(origin: Vec3, mesh_origin: Vec3, count: usize, alpha: AlphaMode) -> Scene {
    let mut random = random();
    let mut scene = Scene::new();
    let mut library = scene.simulation.world.resource_mut::<Library>();
    for mesh in &mut scene.meshes {
        let mut moved = library.mesh(*mesh).expect("there").mesh.clone();
        moved.positions.iter_mut().for_each(|position| *position -= mesh_origin);
        *mesh = library.add_mesh(moved);
    }
    let white = Material { base_factor: Vec4::ONE, alpha, ..Material::new(Shading::Unlit) };
    scene.materials = vec![library.add_material(white)];
    for i in 0..count {
        // As many at every scale of distance.
        let distance = 3.0 * 100f32.powf(random.random::<f32>());
        let aside = Vec3::new(unit(&mut random), unit(&mut random) * 0.6, 0.0) * distance;
        let place = random_place(&mut random, 0.0).with_scale(Vec3::splat(0.02 + 0.2 * random.random::<f32>()));
        let to_mesh = place.rotation * (place.scale * mesh_origin);
        let place = place.with_translation(origin + aside - Vec3::Z * distance + to_mesh);
        scene.spawn(i % 3, 0, place);
    }
    scene.look(Transform::from_translation(origin));
    scene
}

#[test]
fn what_lies_between_samples_is_not_drawn_and_nobody_sees_it() {
    let Some(mut renderer) = renderer() else { return };
    let far = Vec3::new(10_000.0, -50.0, 3_000.0);
    for (origin, mesh_origin) in [(Vec3::ZERO, Vec3::ZERO), (far, Vec3::ZERO), (Vec3::ZERO, far)] {
        // Blended objects are drawn whatever their size.
        let dust = |alpha| dust(origin, mesh_origin, 3000, alpha);
        let (mut opaque, mut whole) = (dust(AlphaMode::Opaque), dust(AlphaMode::Blend));
        for projection in [
            Projection::Perspective { fov_y: 1.0, aspect: None },
            Projection::Orthographic { half_height: 15.0, aspect: None },
        ] {
            for scene in [&mut opaque, &mut whole] {
                scene.project(projection);
            }
            for (samples, occlusion) in
                [(1, Occlusion::Off), (4, Occlusion::Off), (1, Occlusion::On), (4, Occlusion::On)]
            {
                let settings = Settings { samples, ..with(occlusion) };
                let (expected, all) = whole.draw_with(&mut renderer, settings);
                let (picture, drawn) = opaque.draw_with(&mut renderer, settings);
                let different = picture.pixels().zip(expected.pixels()).filter(|(a, b)| a != b).count();
                assert_eq!(different, 0, "{origin}, {mesh_origin}, {projection:?}, {samples} samples, {occlusion:?}");
                // How many have a sample in the boxes around them follows from their sizes and the rasteriser's
                // rounding: at the most 0.37 with one sample and 0.67 with four, by the same distribution of 4,000
                // others; far from the origin, where a metre is known to 0.04, 0.51 and 0.91. The standard error of
                // 1,700 objects is 0.012.
                let share = if samples == 1 {
                    0.6
                } else if [origin, mesh_origin] == [Vec3::ZERO; 2] {
                    0.75
                } else {
                    0.95
                };
                let most = share * f64::from(all.objects);
                assert!(drawn.objects > 100 && f64::from(drawn.objects) < most, "{drawn:?} of {all:?}");
                // The outputs have one sample in each pixel's middle, whatever the picture has.
                let covered = |renderer: &mut SingleView| {
                    let outputs =
                        renderer.draw_outputs(OutputSet { id: true, ..OutputSet::NONE }).expect("a picture was drawn");
                    outputs.entities().iter().map(Option::is_some).collect::<Vec<_>>()
                };
                let seen = covered(&mut renderer);
                whole.draw_with(&mut renderer, settings);
                assert!(
                    seen == covered(&mut renderer),
                    "outputs of {origin}, {mesh_origin}, {projection:?}, {samples} samples"
                );
            }
        }
    }
}

/// A bar across four pixels, with the middles of two of them in it: the rectangle around it holds all four. Moved aside
/// by a little more than its thickness, it has none.
#[test]
fn what_only_the_rectangle_around_it_covers_is_not_drawn() {
    let Some(mut renderer) = renderer() else { return };
    // How far aside the bar's edge, 0.1 from its middle, is surely still beyond the two pixels' middles: vertices are
    // rounded by half of what they are rounded to, along both axes.
    let just_beyond = 0.1 - 0.01 - renderer.gpu().vertex_rounding() * std::f32::consts::FRAC_1_SQRT_2;
    let mut scene = Scene::new();
    // One unit is one pixel; (0, 0) is where four meet.
    scene.project(Projection::Orthographic { half_height: SIZE.1 as f32 / 2.0, aspect: None });
    let white = Material { base_factor: Vec4::ONE, ..Material::new(Shading::Unlit) };
    let bar = scene.add(shapes::cube(Vec3::ONE), white, Transform::default());
    let mut draw = |degrees: f32, aside: f32, settings: Settings| {
        let turn = Quat::from_rotation_z(degrees.to_radians());
        *scene.simulation.world.get_mut::<Transform>(bar).expect("lives") =
            Transform::from_translation(turn * Vec3::Y * aside - Vec3::Z * 5.0)
                .with_rotation(turn)
                .with_scale(Vec3::new(1.6, 0.2, 0.2));
        scene.simulation.frame();
        let (picture, drawn) = scene.draw_with(&mut renderer, settings);
        let background = *picture.get_pixel(0, 0);
        (picture.pixels().filter(|pixel| **pixel != background).count(), drawn.objects)
    };
    for occlusion in [Occlusion::Off, Occlusion::On] {
        let settings = Settings { samples: 1, ..with(occlusion) };
        for degrees in [45.0, 135.0] {
            assert_eq!(draw(degrees, 0.0, settings), (2, 1), "{degrees} degrees");
            assert_eq!(draw(degrees, just_beyond, settings), (2, 1), "{degrees} degrees, its edge just beyond");
            assert_eq!(draw(degrees, 0.22, settings), (0, 0), "{degrees} degrees, aside");
            assert_eq!(draw(degrees, -0.22, settings), (0, 0), "{degrees} degrees, to the other side");
        }
        // Upright, it is between two columns of samples either way.
        assert_eq!(draw(90.0, 0.0, settings), (0, 0));
        // Two of four samples in a pixel lie 0.18 aside of such a diagonal.
        let (pixels, drawn) = draw(45.0, 0.22, Settings { samples: 4, ..settings });
        assert!(pixels > 0 && drawn == 1, "four samples: {pixels} pixels");
    }
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

#[test]
fn a_still_view_keeps_what_rounding_puts_before_its_own_bounds() {
    let Some(mut renderer) = renderer() else { return };
    let mut random = random();
    let mut fresh = SingleView::new(renderer.gpu());
    for i in 0..60 {
        let mut scene = Scene::new();
        // A face of no thickness far from the origin, close to the eye and straight before it.
        let turn = Quat::from_rotation_y(unit(&mut random) * 3.0);
        let origin = Vec3::new(unit(&mut random), 0.3, unit(&mut random)) * [400.0, 1_000.0, 9_000.0][i % 3];
        let distance = [1.0, 3.0][i / 3 % 2];
        let wall = shapes::plane(Vec2::splat(8.0), UVec2::ONE);
        let up = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let place = Transform::from_translation(origin + turn * Vec3::NEG_Z * distance).with_rotation(turn * up);
        scene.add(wall, Material::default(), place);
        let elsewhere = scene.spawn(0, 1, Transform::from_translation(origin + turn * Vec3::Z * 50.0));
        scene.look(Transform::from_translation(origin).with_rotation(turn));
        let (expected, _) = scene.draw_with(&mut fresh, with(Occlusion::Off));
        // Something changes after the first or the second frame, so that the view is culled four or five times.
        for frame in 0..6 {
            if frame == 1 + i % 2 {
                scene.simulation.world.get_mut::<Transform>(elsewhere).expect("a place").translation.y += 1.0;
                scene.simulation.frame();
            }
            let (picture, _) = scene.draw(&mut renderer, Occlusion::On);
            assert!(picture == expected, "{i}, frame {frame}: {origin} {turn}, {distance} m");
        }
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

#[test]
fn a_still_view_shows_what_another_technique_uncovers() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    // A plate whose surface lies far below the mesh, and a box in that hollow.
    scene.add_sunk_plate(8.0, Material { height_scale_uv: 0.5, ..Material::default() }, 1.0);
    scene.spawn(0, 0, Transform::from_xyz(0.0, 0.0, -6.5));
    scene.simulation.frame();
    let technique = |technique, occlusion| Settings { technique: Some(technique), ..with(occlusion) };
    for _ in 0..4 {
        scene.draw_with(&mut renderer, technique(Technique::Off, Occlusion::On));
    }
    let drawn = scene.draw_with(&mut renderer, technique(Technique::Off, Occlusion::On)).1;
    assert_eq!(drawn.objects, 1, "the plate hides the box");
    let (picture, drawn) = scene.draw_with(&mut renderer, technique(Technique::ZCorrect, Occlusion::On));
    assert_eq!(drawn.objects, 2);
    assert!(picture == scene.draw_afresh(renderer.gpu(), technique(Technique::ZCorrect, Occlusion::Off)));
}

#[test]
fn what_is_sunk_stands_out_from_behind() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    // Seen from behind, this surface lies half a metre nearer than its mesh, before the plate between them.
    let technique = Technique::ZCorrect;
    let sunk = Material { height_scale_uv: 0.2, double_sided: true, technique, ..Material::default() };
    scene.add_sunk_plate(3.0, sunk, -1.0);
    scene.spawn(0, 0, Transform::from_xyz(0.0, 0.0, -4.8).with_scale(Vec3::new(20.0, 20.0, 0.1)));
    scene.simulation.frame();
    let expected = scene.draw_afresh(renderer.gpu(), with(Occlusion::Off));
    let center = expected.get_pixel(SIZE.0 / 2, SIZE.1 / 2);
    assert!(center.0[0].abs_diff(center.0[1]) < 9, "the white surface is seen, not the red plate: {center:?}");
    for frame in 0..5 {
        assert!(scene.draw(&mut renderer, Occlusion::On).0 == expected, "frame {frame}");
    }
}

/// Rooms of 4 m in a row and in rows, some with doors between them and windows, with faces of their walls and things in
/// them. No lights: what is drawn is what is seen.
fn building(random: &mut TestRng) -> (Scene, Cells) {
    let mut scene = Scene::new();
    // Of which cells keep some out.
    scene.simulation.world.despawn(scene.light);
    let (columns, rows) = (2 + (unit(random) * 3.0) as u32, 1 + (unit(random) * 3.0) as u32);
    let number = |column: u32, row: u32| row * columns + column + 1;
    let (mut cells, mut openings) = (Vec::new(), Vec::new());
    let face = |scene: &mut Scene, min: Vec3, max: Vec3| {
        let material = if (min.x + min.z) as i32 % 2 == 0 { 0 } else { 1 };
        let place = Transform { scale: max - min, ..Transform::from_translation((min + max) * 0.5) };
        scene.spawn(0, material, place);
    };
    let mut doors = std::collections::BTreeMap::new();
    for row in 0..rows {
        for column in 0..columns {
            let min = Vec3::new(column as f32 * 4.0, 0.0, row as f32 * 4.0);
            cells.push(Cell::new_box("", Aabb { min, max: min + Vec3::new(4.0, 3.0, 4.0) }));
            face(&mut scene, min + Vec3::new(0.06, 0.06, 0.06), min + Vec3::new(3.94, 0.1, 3.94));
            face(&mut scene, min + Vec3::new(0.06, 2.9, 0.06), min + Vec3::new(3.94, 2.94, 3.94));
            for (across_x, far) in [(true, false), (true, true), (false, false), (false, true)] {
                let edge = if across_x { column } else { row } + u32::from(far);
                let has = *doors.entry((across_x, edge, if across_x { row } else { column })).or_insert_with(|| {
                    let last = if across_x { columns } else { rows };
                    let beyond = |edge: Option<u32>| match edge.filter(|&edge| edge < last) {
                        Some(edge) if across_x => number(edge, row),
                        Some(edge) => number(column, edge),
                        None => OUTSIDE,
                    };
                    let has = unit(random) < 0.6;
                    if has {
                        let at = edge as f32 * 4.0;
                        let corner = |(along, y): (f32, f32)| {
                            if across_x { Vec3::new(at, y, min.z + along) } else { Vec3::new(min.x + along, y, at) }
                        };
                        let polygon = [(1.5, 0.1), (2.5, 0.1), (2.5, 2.1), (1.5, 2.1)].map(corner).to_vec();
                        let between = [beyond(edge.checked_sub(1)), beyond(Some(edge))];
                        openings.push(Opening { between, polygon, portal: None });
                    }
                    has
                });
                let mut part = |thin: [f32; 2], along: [f32; 2], y: [f32; 2]| {
                    let at = |i: usize| {
                        let v = if across_x { [thin[i], y[i], along[i]] } else { [along[i], y[i], thin[i]] };
                        min + Vec3::from(v)
                    };
                    face(&mut scene, at(0), at(1));
                };
                let inner = if far { [3.9, 3.94] } else { [0.06, 0.1] };
                let outer = if far { [4.06, 4.1] } else { [-0.1, -0.06] };
                let is_last = edge == 0 || edge == if across_x { columns } else { rows };
                let faces = [(inner, 0.06, [0.06, 2.94]), (outer, -0.1, [-0.1, 3.1])];
                for (thin, end, [low, high]) in faces.into_iter().take(if is_last { 2 } else { 1 }) {
                    if has {
                        part(thin, [end, 1.5], [low, high]);
                        part(thin, [2.5, 4.0 - end], [low, high]);
                        part(thin, [1.5, 2.5], [2.1, high]);
                        part(thin, [1.5, 2.5], [low, 0.1]);
                    } else {
                        part(thin, [end, 4.0 - end], [low, high]);
                    }
                }
            }
            for _ in 0..12 {
                let at = Vec3::new(0.5 + 3.0 * unit(random), 0.4 + 2.0 * unit(random), 0.5 + 3.0 * unit(random));
                let turn = Quat::from_rotation_y(unit(random) * 6.0);
                let size = Vec3::splat(0.1 + 0.4 * unit(random));
                let mesh = (unit(random) * 3.0) as usize;
                let place = Transform::from_translation(min + at).with_rotation(turn).with_scale(size);
                scene.spawn(mesh, (unit(random) * 4.0) as usize, place);
            }
        }
    }
    let extent = Vec3::new(columns as f32 * 4.0, 0.0, rows as f32 * 4.0) + Vec3::new(0.1, 0.0, 0.1);
    for y in [-0.1, 3.06] {
        face(&mut scene, Vec3::new(-0.1, y, -0.1), extent + Vec3::Y * (y + 0.04));
    }
    // The wall's cavities are closed at doors, by frames that go through it.
    for opening in &openings {
        let (low, high) = opening.polygon.iter().fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(*p), b.max(*p)));
        let across = if high.x == low.x { Vec3::X } else { Vec3::Z } * 0.1;
        let along = if high.x == low.x { Vec3::Z } else { Vec3::X };
        face(&mut scene, low - across - along * 0.05, Vec3::new(low.x, high.y, low.z) + across);
        face(&mut scene, Vec3::new(high.x, low.y, high.z) - across, high + across + along * 0.05);
        face(&mut scene, Vec3::new(low.x, high.y, low.z) - across, high + across + Vec3::Y * 0.05);
        face(&mut scene, low - across - Vec3::Y * 0.05, Vec3::new(high.x, low.y, high.z) + across);
    }
    for _ in 0..20 {
        let at = Vec3::new(unit(random) * 30.0 - 8.0, unit(random) * 4.0, -6.0 * unit(random) - 1.0);
        scene.spawn(1, 0, Transform::from_translation(at));
    }
    (scene, Cells::new(cells, openings))
}

/// Objects that no window shows are not drawn, and no pixel misses them: from rooms, from doorways, from outside.
#[test]
fn rooms_look_the_same_if_only_what_windows_show_is_drawn() {
    let Some(mut renderer) = renderer() else { return };
    let mut random = random();
    let (mut drawn, mut without) = (0, 0);
    // SwiftShader rounds vertices to sixteenths of a pixel and extends depths from there: a face that is seen edge-on
    // may come before the wall that hides it, in a sample beside the edge. No more than an edge is long.
    let allowed = if renderer.gpu().vertex_rounding() > 1.0 / 128.0 { SIZE.1 as usize } else { 0 };
    for _ in 0..12 {
        let (mut scene, cells) = building(&mut random);
        scene.simulation.frame();
        for eye in 0..12 {
            let extent = cells.bounds().max + Vec3::new(8.0, 1.0, 8.0);
            let mut at =
                Vec3::new(unit(&mut random), unit(&mut random), unit(&mut random)) * extent - Vec3::new(4.0, 0.0, 4.0);
            if let (1, Some(opening)) = (eye % 4, cells.openings().get(eye)) {
                at = opening.polygon.iter().sum::<Vec3>() / opening.polygon.len() as f32;
            }
            if eye % 4 > 1 {
                // In a room, and not in its walls.
                let room = cells.cells()[eye % cells.cells().len()].aabb();
                at = room.min + Vec3::new(0.5 + 3.0 * unit(&mut random), 1.5, 0.5 + 3.0 * unit(&mut random));
            }
            let turn = Quat::from_rotation_y(unit(&mut random) * 6.3) * Quat::from_rotation_x(unit(&mut random) - 0.5);
            scene.look(Transform::from_translation(at).with_rotation(turn));
            scene.simulation.world.insert_resource(Cells::default());
            scene.simulation.frame();
            let (expected, all) = scene.draw(&mut renderer, Occlusion::Off);
            scene.simulation.world.insert_resource(cells.clone());
            scene.simulation.frame();
            for occlusion in [Occlusion::Off, Occlusion::On] {
                let (found, few) = scene.draw(&mut renderer, occlusion);
                let differing = found.pixels().zip(expected.pixels()).filter(|(a, b)| a != b).count();
                assert!(differing <= allowed, "from {at}: {differing} pixels");
                if occlusion == Occlusion::Off {
                    (drawn, without) = (drawn + few.objects, without + all.objects);
                }
            }
        }
    }
    assert!(drawn * 10 < without * 9, "{drawn} of {without}");
}
