//! Shadow maps from frame to frame: what is drawn anew, by which lights and views, and that pictures do not depend on
//! what was drawn before.

use crate::common::floor::{Floor, SHADOW_SIDES, SIDE, headless, lamp};
use crate::common::{self, prelude::*};
use relief::renderer::ShadowStats;
use relief::renderer::{ViewBatches, ViewState, ViewTarget};
use systems::lights::NoShadow;

/// A world of lamps and cubes, drawn by one renderer.
struct Drawn {
    scene: Floor,
    headless: Headless,
    cubes: Vec<Entity>,
    lamps: Vec<Entity>,
}

impl Drawn {
    fn new(gpu: &Gpu) -> Self {
        let mut scene = Floor::new();
        let place = |i: u32| Transform::from_xyz((i % 4) as f32 - 1.5, 0.3, (i / 4) as f32 - 1.0);
        let cubes = (0..12).map(|i| scene.add_cube(place(i).with_scale(Vec3::splat(0.4)))).collect();
        let lamps = (0..5)
            .map(|i| scene.add_light(lamp(2.0 + i as f32), Vec3::new(0.2 * (i as f32 - 2.0), 2.0, 0.1), Vec3::NEG_Y))
            .collect();
        Self { scene, headless: headless(gpu), cubes, lamps }
    }

    fn draw(&mut self, maps: u32) -> (Vec<f32>, ShadowStats) {
        let picture = self.scene.draw(&mut self.headless, maps);
        (picture, self.headless.renderer.stats().shadows)
    }

    fn move_to(&mut self, entity: Entity, at: Vec3) {
        self.scene.simulation.world.get_mut::<Transform>(entity).expect("it lives").translation = at;
    }
}

#[test]
fn what_is_still_costs_nothing_and_one_mover_draws_the_faces_that_it_touches() {
    let Some(gpu) = common::gpu() else { return };
    let mut drawn = Drawn::new(&gpu);
    let (_, first) = drawn.draw(32);
    assert_eq!((first.layers, first.passes), (5, 5));
    let (_, still) = drawn.draw(32);
    assert_eq!(still, ShadowStats { lights: 5, layers: 5, ..ShadowStats::default() });
    // A camera's place is nothing to lamps.
    drawn.move_to(drawn.scene.camera, Vec3::new(0.3, 8.0, 0.2));
    assert_eq!(drawn.draw(32).1.passes, 0);
    // Below all lamps, and not beside any: a face each.
    drawn.move_to(drawn.cubes[5], Vec3::new(0.0, 0.2, 0.0));
    let (_, moved) = drawn.draw(32);
    assert_eq!((moved.passes, moved.faces), (5, 5));
    assert_eq!(drawn.draw(32).1.passes, 0);
    // Another colour is no other shadow; another place of a lamp is one of its own.
    drawn.scene.simulation.world.get_mut::<Light>(drawn.lamps[2]).expect("it lives").color = Vec3::X;
    assert_eq!(drawn.draw(32).1.passes, 0);
    drawn.move_to(drawn.lamps[2], Vec3::new(0.1, 2.2, 0.3));
    assert_eq!(drawn.draw(32).1.passes, 1);
    // One that goes, one that comes, one that is hidden from now on.
    let gone = drawn.cubes.remove(0);
    drawn.scene.simulation.world.despawn(gone);
    assert_eq!(drawn.draw(32).1.passes, 5);
    drawn.scene.simulation.world.entity_mut(drawn.cubes[1]).insert(systems::space::Hidden);
    assert_eq!(drawn.draw(32).1.passes, 5);
    drawn.scene.simulation.world.entity_mut(drawn.cubes[2]).insert(NoShadow);
    assert_eq!(drawn.draw(32).1.passes, 5);
    assert_eq!(drawn.draw(32).1.passes, 0);
    // Without shadows nothing is kept, and nothing done.
    drawn.move_to(drawn.cubes[5], Vec3::new(0.1, 0.2, 0.0));
    assert_eq!(drawn.draw(0).1, ShadowStats::default());
    assert_eq!(drawn.headless.renderer.held_bytes().shadow_maps, 0);
    assert_eq!(drawn.draw(32).1.passes, 5);
}

/// Below a sun and lamps that all objects are before, while the view shows the world's left half alone. What moves at
/// the right is left out, until it comes to the left, or stays where it is; the picture is that of a fresh renderer.
#[test]
fn what_moves_where_no_shadow_is_seen_is_left_out_for_that_frame() {
    let Some(gpu) = common::gpu() else { return };
    let mut drawn = Drawn::new(&gpu);
    drawn.scene.add_light(Light::directional(0.5).with_shadows(), Vec3::Y, Vec3::new(0.2, -1.0, 0.0));
    let up = Vec3::NEG_Z;
    let look = |drawn: &mut Drawn, x: f32| {
        let eye = Transform::from_xyz(x, 1.5, 0.0).looking_to(Vec3::NEG_Y, up);
        *drawn.scene.simulation.world.get_mut::<Transform>(drawn.scene.camera).expect("it lives") = eye;
    };
    look(&mut drawn, -2.5);
    drawn.draw(32);
    let at = |x: f32| Vec3::new(x, 0.2, 0.5);
    for step in 0..12 {
        drawn.move_to(drawn.cubes[3], at(2.0 + 0.05 * step as f32));
        // At first it goes from where it was drawn.
        assert_eq!(drawn.draw(32).1.passes > 0, step == 0, "{step}");
    }
    // It stays, and is drawn before it can be seen.
    assert!(drawn.draw(32).1.passes > 0);
    assert_eq!(drawn.draw(32).1.passes, 0);
    look(&mut drawn, 2.0);
    let seen = drawn.draw(32);
    // The sun's first levels have their middles elsewhere now.
    assert_eq!(seen.1.passes, 2);
    assert!(seen.0 == drawn.scene.draw(&mut headless(&gpu), 32));
    // It moves to the left while that is seen, and while the view turns.
    for step in 0..12 {
        drawn.move_to(drawn.cubes[3], at(2.0 - 0.4 * step as f32));
        look(&mut drawn, [-2.5, 2.0][step % 5 / 3]);
        let (picture, _) = drawn.draw(32);
        assert!(picture == drawn.scene.draw(&mut headless(&gpu), 32), "{step}");
    }
}

/// A mask whose image becomes another one under the same number.
#[test]
fn a_mask_with_another_image_casts_another_shadow() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    let mut scene = Floor::new();
    let cube = scene.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
    scene.add_light(lamp(8.0), Vec3::new(-2.0, 3.0, 0.0), Vec3::NEG_Y);
    let image = |alpha: u8| Image::rgba8("leaf", 4, 4, ImageKind::Color, [255, 255, 255, alpha].repeat(16));
    let mut library = scene.simulation.world.resource_mut::<Library>();
    let leaf = library.add_image(image(255));
    let base_map = Some(Map::new(leaf));
    let material = library.add_material(Material { base_map, alpha: AlphaMode::Mask, ..Material::default() });
    scene.simulation.world.entity_mut(cube).insert(material);
    let dark = |scene: &mut Floor, headless: &mut Headless| {
        let (open, shadowed) = (scene.draw(headless, 0), scene.draw(headless, 32));
        open.iter().zip(&shadowed).filter(|(open, shadowed)| **shadowed < 0.5 * **open).count()
    };
    assert!(dark(&mut scene, &mut headless) > 1000);
    scene.draw(&mut headless, 32);
    let replaced = scene.simulation.world.resource_mut::<Library>().replace_image(leaf, image(0));
    assert!(replaced);
    let shadowed = scene.draw(&mut headless, 32);
    assert!(shadowed == scene.draw(&mut self::headless(&gpu), 32));
    assert_eq!(dark(&mut scene, &mut headless), 0);
}

#[test]
fn a_world_without_casters_has_no_layer_and_one_with_some_has_as_many_as_lights() {
    let Some(gpu) = common::gpu() else { return };
    let mut drawn = Drawn::new(&gpu);
    drawn.draw(0);
    assert_eq!(drawn.headless.renderer.held_bytes().shadow_maps, 0);
    drawn.draw(32);
    assert_eq!(drawn.headless.renderer.held_bytes().shadow_maps, 5 * 768 * 768 * 4);
    let mut scene = Floor::new();
    scene.add_light(Light { shadows: false, ..lamp(3.0) }, Vec3::Y, Vec3::NEG_Y);
    let mut other = headless(&gpu);
    scene.draw(&mut other, 32);
    assert_eq!(other.renderer.held_bytes().shadow_maps, 0);
}

/// Lights win and lose layers, things move, and cameras: the last frame is that of a renderer that saw nothing before.
#[test]
fn the_past_does_not_matter() {
    let Some(gpu) = common::gpu() else { return };
    let mut random = random();
    let (mut drawn, mut fresh) = (Drawn::new(&gpu), headless(&gpu));
    let sun = drawn.scene.add_light(Light::directional(0.5).with_shadows(), Vec3::Y, Vec3::new(0.5, -1.0, 0.2));
    for past in 0..50 {
        for _ in 0..3 {
            let place = |random: &mut TestRng, y: f32| {
                Vec3::new(random.random_range(-2.0..2.0), y, random.random_range(-2.0..2.0))
            };
            let (lamp, cube) = (random.random_range(0..5), random.random_range(0..12));
            let at = place(&mut random, 2.0);
            drawn.move_to(drawn.lamps[lamp], at);
            let at = place(&mut random, 0.3);
            drawn.move_to(drawn.cubes[cube], at);
            let height = random.random_range(3.0..15.0);
            let at = place(&mut random, height);
            drawn.move_to(drawn.scene.camera, at);
            if random.random_range(0..10) == 0 {
                let turned = Quat::from_rotation_y(random.random_range(0.0..1.0));
                drawn.scene.simulation.world.get_mut::<Transform>(sun).expect("it lives").rotate(turned);
            }
            let maps = random.random_range(1..5);
            drawn.draw(maps);
        }
        let (picture, _) = drawn.draw(3);
        // Without shadows nothing is kept of them.
        drawn.scene.draw(&mut fresh, 0);
        assert_eq!(fresh.renderer.held_bytes().shadow_maps, 0);
        assert!(picture == drawn.scene.draw(&mut fresh, 3), "past {past}");
    }
    let (picture, _) = drawn.draw(3);
    assert!(picture == drawn.scene.draw(&mut headless(&gpu), 3), "another renderer");
}

/// Two lamps as important as each other, and one map: in 0.3 mm of the eye's way the map goes from one to the other.
#[test]
fn nobody_sees_a_layer_given_away() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    let mut scene = Floor::new();
    scene.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
    let mut lit = Vec::new();
    for x in [-2.0, 2.0] {
        scene.add_light(lamp(6.0), Vec3::new(x, 3.0, 0.0), Vec3::NEG_Y);
    }
    let up = Vec3::NEG_Z;
    for x in [-1.0, -0.00015, 0.00015, 1.0] {
        let eye = Transform::from_xyz(x, 6.0, 0.0).looking_to(Vec3::NEG_Y, up);
        *scene.simulation.world.get_mut::<Transform>(scene.camera).expect("it lives") = eye;
        lit.push(scene.draw(&mut headless, 1));
    }
    let mean = lit[0].iter().sum::<f32>() / lit[0].len() as f32;
    let largest = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // A tenth of a millimetre of a picture whose pixels are 25 mm: samples at edges of objects may be other ones.
    let count = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > 0.01 * mean).count();
    assert!(largest(&lit[0], &lit[3]) > 0.5 * mean, "the map is another lamp's");
    let popped = count(&lit[1], &lit[2]);
    assert!(popped < lit[1].len() / 1000, "{popped} pixels of {}", lit[1].len());
}

/// Views share the layers of lights, and each has its own most important ones.
#[test]
fn views_share_layers() {
    let Some(gpu) = common::gpu() else { return };
    let Drawn { mut scene, .. } = Drawn::new(&gpu);
    let mut renderer = Renderer::new(&gpu);
    let other = *scene.simulation.world.get::<Transform>(scene.camera).expect("it lives");
    let camera = scene.simulation.world.get::<Camera>(scene.camera).expect("it lives").clone();
    let other = Transform { translation: other.translation + Vec3::new(0.6, -4.0, 0.3), ..other };
    let other = scene.simulation.world.spawn((camera, other)).id();
    scene.simulation.frame();
    let mut states = [ViewState::new(&gpu), ViewState::new(&gpu)];
    let textures = [0, 1].map(|_| picture_texture(&gpu, (SIDE, SIDE)));
    let targets = textures.each_ref().map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
    let settings = Settings { shadow_maps: 4, ..Settings::default() }.for_files();
    let plans = [scene.camera, other].map(|camera| ViewPlan {
        view: Viewpoint::Camera(camera).view(&scene.simulation.world, (SIDE, SIDE)),
        settings,
    });
    let [first, second] = &mut states;
    let mut views = [(&mut *first, plans[0].clone()), (&mut *second, plans[1].clone())];
    scene.simulation.with_frame(|frame| renderer.prepare(frame, &mut views)).expect("it fits");
    let views = [(first, &targets[0]), (second, &targets[1])];
    common::encode(&mut renderer, &mut views.map(|(state, target)| ViewTarget::new(state, target, PICTURE_FORMAT)));
    let shadows = renderer.stats().shadows;
    assert!((4..=5).contains(&shadows.layers) && shadows.passes == shadows.layers, "{shadows:?}");
    for (texture, plan) in textures.iter().zip(plans) {
        let together = read_texture(&gpu, texture);
        let mut alone = SingleView::new(&gpu);
        scene.simulation.with_frame(|frame| alone.prepare(frame, &plan.view, &settings)).expect("it fits");
        assert!(alone.draw_picture().into_raw() == together, "a view by itself");
    }
}

/// Two views that are drawn one after another in each frame, by one renderer. A cube moves before the one, then before
/// the other: each picture is that of a fresh renderer.
#[test]
fn views_that_take_turns_miss_nothing_that_moves() {
    let Some(gpu) = common::gpu() else { return };
    let mut drawn = Drawn::new(&gpu);
    drawn.scene.add_light(Light::directional(0.5).with_shadows(), Vec3::Y, Vec3::new(0.2, -1.0, 0.0));
    let world = &mut drawn.scene.simulation.world;
    let camera = world.get::<Camera>(drawn.scene.camera).expect("it lives").clone();
    let cameras = [-2.5, 2.5].map(|x| {
        let eye = Transform::from_xyz(x, 1.5, 0.0).looking_to(Vec3::NEG_Y, Vec3::NEG_Z);
        world.spawn((camera.clone(), eye)).id()
    });
    let settings = Settings::default().for_files();
    let mut renderer = Renderer::new(&gpu);
    let mut states = [ViewState::new(&gpu), ViewState::new(&gpu)];
    let texture = picture_texture(&gpu, (SIDE, SIDE));
    let target = texture.create_view(&wgpu::TextureViewDescriptor::default());
    for step in 0..14 {
        drawn.move_to(drawn.cubes[3], Vec3::new(2.0 - 0.3 * step as f32, 0.2, 0.5));
        drawn.scene.simulation.frame();
        for (camera, state) in cameras.into_iter().zip(&mut states) {
            let view = Viewpoint::Camera(camera).view(&drawn.scene.simulation.world, (SIDE, SIDE));
            let plan = ViewPlan { view, settings };
            let mut views = [(&mut *state, plan.clone())];
            drawn.scene.simulation.with_frame(|frame| renderer.prepare(frame, &mut views)).expect("it fits");
            common::encode(&mut renderer, &mut [ViewTarget::new(state, &target, PICTURE_FORMAT)]);
            let mut alone = SingleView::new(&gpu);
            let prepared = drawn.scene.simulation.with_frame(|frame| alone.prepare(frame, &plan.view, &settings));
            prepared.expect("it fits");
            assert!(alone.draw_picture().into_raw() == read_texture(&gpu, &texture), "{step}");
        }
    }
}

/// Views of three sizes, whose layers have three sides: a batch in either order, then each alone, shows the same bits.
#[test]
fn views_of_other_sizes_have_layers_of_their_own() {
    let Some(gpu) = common::gpu() else { return };
    let mut drawn = Drawn::new(&gpu);
    drawn.scene.add_light(Light::directional(0.5).with_shadows(), Vec3::Y, Vec3::new(0.2, -1.0, 0.0));
    let settings = Settings { samples: 1, shadow_maps: 3, ..Settings::default() }.for_files();
    let (mut renderer, mut batches) = (Renderer::new(&gpu), ViewBatches::default());
    let mut sizes = SHADOW_SIDES.map(|(pixels, _)| (pixels, pixels));
    for step in 0..8 {
        drawn.move_to(drawn.cubes[3], Vec3::new(1.0 - 0.3 * step as f32, 0.2, 0.5));
        drawn.scene.simulation.frame();
        sizes.rotate_left(1);
        if step % 2 == 0 {
            sizes.reverse();
        }
        let view = |size| Viewpoint::Camera(drawn.scene.camera).view(&drawn.scene.simulation.world, size);
        let plans = sizes.map(|size| ViewPlan { view: view(size), settings });
        // One of them is not drawn in every frame: its layers miss what moved.
        let plans = &plans[..if step % 3 == 1 { 2 } else { 3 }];
        let simulation = &mut drawn.scene.simulation;
        let together = simulation.with_frame(|frame| renderer.draw_views(frame, &mut batches, plans)).expect("it fits");
        for (plan, outputs) in plans.iter().zip(together) {
            let mut alone = SingleView::new(&gpu);
            simulation.with_frame(|frame| alone.prepare(frame, &plan.view, &settings)).expect("it fits");
            assert!(Some(alone.draw_picture()) == outputs.picture, "{step}, {} pixels", plan.view.width);
        }
    }
    // Three lamps and the levels of a sun each.
    let layers = |(side, levels): (u64, u64)| (3 + levels) * side * side * 4;
    let bytes: u64 = [(192, 8), (384, 7), (768, 6)].map(layers).iter().sum();
    assert_eq!(renderer.held_bytes().shadow_maps, bytes);
}

/// Views of two sizes in one submission, as a window and what its sensors see.
#[test]
fn a_window_and_a_thumbnail_are_drawn_together() {
    let Some(gpu) = common::gpu() else { return };
    let mut drawn = Drawn::new(&gpu);
    drawn.scene.add_light(Light::directional(0.5).with_shadows(), Vec3::Y, Vec3::new(0.2, -1.0, 0.0));
    let mut renderer = Renderer::new(&gpu);
    let settings = Settings::default().for_files();
    let mut states = [ViewState::new(&gpu), ViewState::new(&gpu)];
    let textures = [SIDE, 70].map(|side| picture_texture(&gpu, (side, side)));
    let targets = textures.each_ref().map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
    for step in 0..6 {
        drawn.move_to(drawn.cubes[3], Vec3::new(1.0 - 0.3 * step as f32, 0.2, 0.5));
        let simulation = &mut drawn.scene.simulation;
        simulation.frame();
        let view = |side| Viewpoint::Camera(drawn.scene.camera).view(&simulation.world, (side, side));
        let plans = [SIDE, 70].map(|side| ViewPlan { view: view(side), settings });
        let [first, second] = &mut states;
        let mut views = [(&mut *first, plans[0].clone()), (&mut *second, plans[1].clone())];
        simulation.with_frame(|frame| renderer.prepare(frame, &mut views)).expect("it fits");
        let views = [(first, &targets[0]), (second, &targets[1])];
        common::encode(&mut renderer, &mut views.map(|(state, target)| ViewTarget::new(state, target, PICTURE_FORMAT)));
        for (texture, plan) in textures.iter().zip(plans) {
            let mut alone = SingleView::new(&gpu);
            simulation.with_frame(|frame| alone.prepare(frame, &plan.view, &settings)).expect("it fits");
            assert!(alone.draw_picture().into_raw() == read_texture(&gpu, texture), "{step}");
        }
    }
}
