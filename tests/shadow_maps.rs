//! Shadow maps of lamps: pictures whose every sample is known, and what they cost.

mod common;

use bevy_ecs::prelude::*;
use common::floor::{Floor, HALF, SIDE, check_edges, headless, is_free};
use glam::{DVec2, DVec3, Quat, Vec3, Vec3Swizzles};
use proptest::prelude::RngExt;
use proptest::test_runner::{RngAlgorithm, TestRng};
use relief::frames::Headless;
use relief::renderer::{Gpu, Settings, ShadowStats, SingleView};
use systems::assets::{AlphaMode, Library, Material, Shading, shapes};
use systems::draw::{Camera, Projection};
use systems::lights::{Light, LightKind, NoShadow};
use systems::space::Transform;

fn lamp(intensity: f32) -> Light {
    Light::point(intensity, 20.0).with_attenuation(Light::INVERSE_SQUARE).with_shadows()
}

fn spot(intensity: f32, outer_degrees: f32) -> Light {
    let kind = LightKind::Spot { outer: outer_degrees.to_radians(), inner: Some(0.0), exponent: 0.0 };
    Light { kind, ..lamp(intensity) }
}

/// Texels of a slope of one: of the face below a point light, of its other faces, and of a spot.
const BELOW: f64 = 254.0;
const BESIDE: f64 = 126.0;

fn of_spot(outer_degrees: f64) -> f64 {
    382.0 / outer_degrees.to_radians().tan()
}

/// Below a lamp, beside one, in a wide spot, which has six faces as well, and in spots that fill their layer. All edges
/// of the shadow, at the cube's foot among them, are within 1.375 texels of where geometry has them: a texel between
/// two that are interpolated, a sixteenth of the rasterizer, and at the foot what a comparison allows for (below).
#[test]
fn the_shadow_of_a_cube_is_where_geometry_has_it() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    let down = Vec3::NEG_Y;
    let cases = [
        (lamp(8.0), Vec3::new(-0.9, 3.1, 0.4), down, BELOW),
        (lamp(8.0), Vec3::new(-3.3, 1.4, 0.3), down, BESIDE),
        (lamp(8.0), Vec3::new(0.2, 1.3, -3.4), down, BESIDE),
        (spot(14.0, 70.0), Vec3::new(-1.0, 4.0, 0.3), down, BELOW),
        (spot(60.0, 40.0), Vec3::new(-2.0, 4.0, 0.3), Vec3::new(2.0, -4.0, -0.1), of_spot(40.0)),
        (spot(60.0, 25.0), Vec3::new(3.0, 3.0, 3.0), Vec3::new(-3.0, -2.7, -3.0), of_spot(25.0)),
    ];
    for (light, at, toward, scale) in cases {
        let mut scene = Floor::new();
        scene.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
        scene.add_light(light, at, toward);
        let eye = at.as_dvec3();
        let is_lit = |at: DVec2| is_free(DVec3::new(at.x, 0.0, at.y), eye);
        // A texel as it lies on the floor: longer the flatter light falls there.
        let margin = |place: DVec2| {
            let v = DVec3::new(place.x, 0.0, place.y) - eye;
            1.375 * v.length() / scale * v.length() / v.y.abs()
        };
        let name = format!("{at} {toward}");
        let [dark, lit, unsure] = check_edges(&scene.shares(&mut headless), is_lit, margin, &name);
        assert!(dark > 300 && lit > 3000 && unsure < dark + lit, "{at} {toward}: {dark} {lit} {unsure}");
    }
}

/// A floor by itself is in no way of its own: at 3° and more no pixel has less than 0.99 of its light. Also where it is
/// one square, which reaches behind the light. SwiftShader rounds vertices to sixteenths of a texel, and extends depths
/// from behind the light as well. Such a slope is off by more than a look-up allows for where a triangle spans less than
/// 60 texels, from horizon to horizon; that of a square metre spans 100 here.
#[test]
fn grazing_light_leaves_no_acne() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    let lamps = [
        (lamp(3.0), Vec3::new(-2.6, 0.2, 0.1), Vec3::NEG_Y),
        (lamp(3.0), Vec3::new(0.3, 0.2, 0.2), Vec3::NEG_Y),
        (spot(9.0, 40.0), Vec3::new(-3.2, 0.25, 0.4), Vec3::new(1.0, -0.1, -0.1)),
    ];
    let is_fine = gpu.vertex_rounding() < 1.0 / 128.0;
    for squares in [1, 8].into_iter().filter(|&squares| is_fine || squares > 1) {
        for (light, at, toward) in &lamps {
            let mut scene = Floor::of_squares(squares);
            scene.add_light(light.clone(), *at, *toward);
            let mut counted = 0;
            for (place, share) in scene.shares(&mut headless) {
                let way = (place.as_vec2() - at.xz()).length();
                if at.y / way > 3f32.to_radians().tan() {
                    assert!(share >= 0.99, "{squares}, {at}: {place} has {share}");
                    counted += 1;
                }
            }
            assert!(counted > 5000, "{at}: {counted}");
        }
    }
}

/// Across a straight edge light rises from 0 to 1 as a line does: over a texel with one tap, over three with four.
#[test]
fn four_taps_have_a_penumbra_of_three_texels() {
    let Some(gpu) = common::gpu() else { return };
    for (taps, width) in [(1, 1.0), (4, 3.0)] {
        for turned in [false, true] {
            // Along X, or along Z.
            let place = |along: f32, y: f32| if turned { Vec3::new(0.0, y, along) } else { Vec3::new(along, y, 0.0) };
            let mut scene = Floor::new();
            let size = place(2.0, 0.02) + if turned { Vec3::X } else { Vec3::Z } * 6.0;
            scene.add_cube(Transform::from_translation(place(-0.7, 1.0)).with_scale(size));
            scene.add_light(lamp(20.0), place(-1.0, 8.0), Vec3::NEG_Y);
            // The plate's upper edge, from the light: of columns of texels those are dark whose middle it hides.
            let edge = (1.3 / 6.99 * BELOW).round();
            let of_floor = BELOW / 8.0;
            let half_height = 0.12;
            let middle = (edge / of_floor - 1.0) as f32;
            let projection = Projection::Orthographic { half_height, aspect: Some(1.0) };
            let camera = Camera { projection, ..Camera::default() };
            let above = Transform::from_translation(place(middle, 9.0)).looking_to(Vec3::NEG_Y, Vec3::NEG_Z);
            scene.simulation.world.entity_mut(scene.camera).insert((camera, above));
            let mut headless = headless(&gpu);
            headless.settings.shadow_taps = taps;
            let mut between = 0;
            for (pixel, share) in scene.shares(&mut headless) {
                let pixel = pixel * f64::from(half_height / HALF);
                let along = f64::from(middle) + if turned { pixel.y } else { pixel.x };
                let expected = (((along + 1.0) * of_floor - edge) / width + 0.5).clamp(0.0, 1.0);
                between += u32::from(expected > 0.0 && expected < 1.0);
                // Two pictures of half floats: a part in 2¹⁰ each, and as much for places.
                let is_right = (f64::from(share) - expected).abs() < 0.004;
                assert!(is_right, "{taps}, {turned}: {share} of {expected} at {along}");
            }
            assert!(between > 2000, "{taps}, {turned}: {between}");
        }
    }
}

/// A wall without thickness that stands on the floor: behind it light goes on for a texel at the most. With e for how
/// high the light stands, a comparison allows for 7/16 cot e + ¼ texels of depth, and wall and floor part by cot e +
/// tan e for each texel behind the wall. So a texel whose middle is ½ cos e (7/8 cos e + ½ sin e) behind is dark, which
/// is 0.471 at the most, and half of the light is gone half a texel behind that; rasterizers may move both by a
/// sixteenth. Where light comes askew the slopes of both axes add up, and the last of it goes on for two texels. Before
/// the wall light may begin to go, as texels are interpolated, but half of it is there.
#[test]
fn a_wall_and_its_floor_meet_without_a_gap() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    // Below the lamp, and beside it, at up to 10° above the floor.
    for at in [[0.3, 3.0, -1.2], [-0.4, 2.0, -1.9], [0.1, 1.3, -2.9], [0.2, 1.0, -3.1], [0.2, 0.4, -2.3]] {
        let at = Vec3::from(at);
        let mut scene = Floor::new();
        let wall = shapes::plane(glam::Vec2::new(7.0, 1.0), glam::UVec2::ONE);
        let wall = scene.simulation.world.resource_mut::<Library>().add_mesh(wall);
        let upright = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let white = scene.white;
        scene.simulation.world.spawn((wall, white, Transform::from_xyz(0.0, 0.5, 0.0).with_rotation(upright)));
        scene.add_light(lamp(8.0), at, Vec3::NEG_Y);
        let (mut dark, mut lit) = (0, 0);
        for (place, share) in scene.shares(&mut headless) {
            let way = (DVec3::new(place.x, 0.0, place.y) - at.as_dvec3()).abs();
            // Of the floor, away from the light.
            let farthest = way.max_element();
            let texel = if way.y == farthest { way.y / BELOW } else { farthest * farthest / way.y / BESIDE };
            // Where the way to the light passes the wall, metres above the floor.
            let height = f64::from(at.y) * place.y / (place.y - f64::from(at.z));
            if place.y < 0.0 {
                let least = if place.y < -texel { 0.99 } else { 0.5 };
                assert!(share >= least, "{at}: {place} before the wall has {share}");
                lit += 1;
            } else if height < 0.8 {
                let behind = place.y / texel;
                let most = if behind > 2.0 { 0.0 } else { 0.5 };
                assert!(behind < 0.971 + 0.0625 || share <= most, "{at}: {place}, {behind} texels behind, has {share}");
                dark += 1;
            }
        }
        assert!(dark > 3000 && lit > 15_000, "{at}: {dark} {lit}");
    }
}

#[test]
fn a_lamp_in_a_closed_box_lights_nothing_outside() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = Floor::new();
    scene.add_cube(Transform::from_xyz(0.0, 1.0, 0.0));
    scene.add_light(lamp(8.0), Vec3::new(0.1, 1.1, -0.2), Vec3::NEG_Y);
    let shares = scene.shares(&mut headless(&gpu));
    assert!(shares.len() > 10_000 && shares.iter().all(|(_, share)| *share == 0.0));
}

/// Holes, panes and what is marked; a mask without holes does.
#[test]
fn what_lets_light_through_casts_none() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    let dark = |headless: &mut Headless, alpha: Option<(AlphaMode, f32)>, marked: bool| {
        let mut scene = Floor::new();
        let cube = scene.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
        if let Some((alpha, value)) = alpha {
            let material = Material {
                alpha,
                base_factor: Vec3::ONE.extend(value),
                specular_factor: Vec3::ZERO,
                ..Material::new(Shading::Blinn)
            };
            let material = scene.simulation.world.resource_mut::<Library>().add_material(material);
            scene.simulation.world.entity_mut(cube).insert(material);
        }
        if marked {
            scene.simulation.world.entity_mut(cube).insert(NoShadow);
        }
        scene.add_light(lamp(8.0), Vec3::new(-2.0, 3.0, 0.0), Vec3::NEG_Y);
        scene.shares(headless).iter().filter(|(_, share)| *share < 0.5).count()
    };
    let solid = dark(&mut headless, None, false);
    assert!(solid > 1000, "{solid}");
    assert_eq!(dark(&mut headless, Some((AlphaMode::Mask, 1.0)), false), solid);
    assert_eq!(dark(&mut headless, Some((AlphaMode::Mask, 0.0)), false), 0);
    assert_eq!(dark(&mut headless, Some((AlphaMode::Blend, 0.5)), false), 0);
    assert_eq!(dark(&mut headless, None, true), 0);
}

/// Mirrored, turned and far from the origin: the same shadow, but for the rounding of places, a part in 2²³ of 65 km.
#[test]
fn a_mirrored_caster_and_a_far_one_have_the_same_shadow() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    let dark = |headless: &mut Headless, scale: Vec3| {
        let mut scene = Floor::new();
        let turned = Quat::from_rotation_y(0.4);
        scene.add_cube(Transform { rotation: turned, scale, ..Transform::from_xyz(0.2, 0.5, 0.0) });
        scene.add_light(lamp(8.0), Vec3::new(-1.5, 3.0, 0.3), Vec3::NEG_Y);
        scene.shares(headless).iter().filter(|(_, share)| *share < 0.5).count()
    };
    let plain = dark(&mut headless, Vec3::ONE);
    assert!(plain > 1000, "{plain}");
    assert_eq!(dark(&mut headless, Vec3::new(-1.0, 1.0, 1.0)), plain);
}

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
    use systems::assets::{Image, ImageKind, Map};
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

/// A fine sphere far away, drawn at coarse levels by the eye and by the lamp: but for the facets at the edge of its lit
/// side, which turn away from the lamp sooner than the round shape, it has its light.
#[test]
fn coarse_levels_are_not_in_their_own_way() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    for distance in [20.0, 60.0, 200.0] {
        let mut scene = Floor::new();
        let ball = scene.simulation.world.resource_mut::<Library>().add_mesh(shapes::sphere(1.0, 256, 128));
        let white = scene.white;
        let ball = scene.simulation.world.spawn((ball, white, Transform::from_xyz(0.0, 2.0, 0.0))).id();
        scene.add_light(lamp(8.0), Vec3::new(1.5, 4.0, 1.0), Vec3::NEG_Y);
        let eye = Transform::from_xyz(0.0, 2.0 + distance, 0.1).looking_at(Vec3::Y * 2.0, Vec3::Z);
        let fov_y = 2.0 * (1.2 / distance).atan();
        let camera = Camera { projection: Projection::Perspective { fov_y, aspect: Some(1.0) }, ..Camera::default() };
        let mut camera_entity = scene.simulation.world.entity_mut(scene.camera);
        camera_entity.insert((camera, eye));
        // The same size in every picture would be the same level: the picture is small.
        headless.settings = Settings { samples: 1, ..Settings::default() }.for_files();
        let mut sum = |maps: u32| {
            headless.settings.shadow_maps = maps;
            headless.draw(&mut scene.simulation, scene.camera, (40, 40)).expect("a picture");
            headless.renderer.read_linear().expect("drawn").iter().map(|color| color[1]).sum::<f32>()
        };
        let (open, shadowed) = (sum(0), sum(32));
        scene.simulation.world.despawn(ball);
        // A pixel is 6 cm: facets of so much error on a ball of 1 m turn by up to 20° from the round shape. Light that
        // arrives at 70° and more, where they turn away from it, is cos² 70° = 12 % of all.
        assert!(open > 10.0 && shadowed > 0.88 * open, "{distance} m: {shadowed} of {open}");
    }
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
    let mut random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
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
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
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
    use relief::renderer::{PICTURE_FORMAT, Renderer, ViewPlan, ViewState, ViewTarget, picture_texture};
    use relief::viewpoint::Viewpoint;
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
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let views = [(first, &targets[0]), (second, &targets[1])];
    let mut views = views.map(|(state, target)| ViewTarget::new(state, target, PICTURE_FORMAT));
    renderer.encode(&mut encoder, &mut views);
    gpu.queue.submit([encoder.finish()]);
    let shadows = renderer.stats().shadows;
    assert!((4..=5).contains(&shadows.layers) && shadows.passes == shadows.layers, "{shadows:?}");
    for (texture, plan) in textures.iter().zip(plans) {
        let together = relief::renderer::read_texture(&gpu, texture);
        let mut alone = SingleView::new(&gpu);
        scene.simulation.with_frame(|frame| alone.prepare(frame, &plan.view, &settings)).expect("it fits");
        assert!(alone.draw_picture().into_raw() == together, "a view by itself");
    }
}

/// Two views that are drawn one after another in each frame, by one renderer. A cube moves before the one, then before
/// the other: each picture is that of a fresh renderer.
#[test]
fn views_that_take_turns_miss_nothing_that_moves() {
    use relief::renderer::{PICTURE_FORMAT, Renderer, ViewPlan, ViewState, ViewTarget, picture_texture, read_texture};
    use relief::viewpoint::Viewpoint;
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
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            renderer.encode(&mut encoder, &mut [ViewTarget::new(state, &target, PICTURE_FORMAT)]);
            gpu.queue.submit([encoder.finish()]);
            let mut alone = SingleView::new(&gpu);
            let prepared = drawn.scene.simulation.with_frame(|frame| alone.prepare(frame, &plan.view, &settings));
            prepared.expect("it fits");
            assert!(alone.draw_picture().into_raw() == read_texture(&gpu, &texture), "{step}");
        }
    }
}

/// A bumpy sheet under a lamp at 25° and more, with nothing else about: its own shadows are its technique's, and the map
/// adds none, whatever the technique, from either side.
#[test]
fn a_bumpy_surface_is_in_its_own_way_once() {
    use common::bumps::{Stage, hills};
    use systems::assets::Technique;
    let Some(mut stage) = Stage::new((96, 96)) else { return };
    stage.orthographic(1.0);
    let material = stage.material(64, 0.08, hills);
    let material = Material { double_sided: true, self_shadow: 1.0, ..material };
    let (mesh, place) = Stage::facing(glam::Vec2::splat(4.0));
    let sheet = stage.spawn(mesh, material, place);
    stage.simulation.world.spawn((lamp(3.0), Transform::from_xyz(1.2, 0.9, 1.2)));
    let behind = Transform { rotation: Quat::from_rotation_y(std::f32::consts::PI) * place.rotation, ..place };
    for (name, technique) in Technique::ALL {
        for place in [&place, &behind] {
            *stage.simulation.world.get_mut::<Transform>(sheet).expect("it lives") = *place;
            let mut drawn = |maps: u32| {
                stage.headless.settings.technique = Some(technique);
                stage.headless.settings.shadow_maps = maps;
                stage.linear()
            };
            let (open, shadowed) = (drawn(0), drawn(32));
            let lit = open.iter().filter(|color| color.y > 0.01).count();
            assert!(lit > 3000, "{name}: {lit}");
            // Half floats, at 0.01 and more: a part in 2¹⁰ each.
            let is_same = |(a, b): (&glam::Vec4, &glam::Vec4)| (a.y - b.y).abs() <= 0.004 * a.y.max(0.01);
            let darker = open.iter().zip(&shadowed).filter(|pair| !is_same(*pair)).count();
            assert_eq!(darker, 0, "{name}: of {lit}");
        }
    }
}
