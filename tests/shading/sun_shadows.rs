//! Shadows of directional lights: pictures whose every sample is known, and what they cost.

use crate::common::floor::{Floor, SHADOW_SIDES, SIDE, check_edges, headless, is_free, lamp};
use crate::common::{self, prelude::*};
use relief::renderer::ShadowStats;

/// Towards a sun so high above the horizon, on the side of −X.
fn toward(elevation_degrees: f64) -> DVec3 {
    let (sin, cos) = elevation_degrees.to_radians().sin_cos();
    DVec3::new(-cos * 0.9, sin, cos * 0.19f64.sqrt())
}

/// Without a size: edges are where geometry has them.
fn add_sun(floor: &mut Floor, intensity: f32, elevation_degrees: f64) -> bevy_ecs::entity::Entity {
    let light = Light { angle: 0.0, ..Light::directional(intensity).with_shadows() };
    floor.add_light(light, Vec3::ZERO, -toward(elevation_degrees).as_vec3())
}

fn set_eye(floor: &mut Floor, at: Vec3) {
    let place = Transform::from_translation(at).looking_to(Vec3::NEG_Y, Vec3::NEG_Z);
    *floor.simulation.world.get_mut::<Transform>(floor.camera).expect("it lives") = place;
}

fn stats(headless: &Headless) -> ShadowStats {
    headless.renderer.stats().shadows
}

/// Metres that a texel covers at most where a point is looked up that is so far from the eye across the rays, in layers
/// of so many texels along a side.
fn texel(across: f64, side: f64) -> f64 {
    // The first of the finest levels ends at 6 m, and the next begins at 0.8 of that.
    let level = (across / (0.8 * 6.0 * side / 768.0)).log2().ceil().max(0.0);
    16.0 / 768.0 * level.exp2()
}

/// In the first levels, where they blend into each other, and in farther ones. All edges of the shadow, at the cube's
/// foot among them, are within 1.5 texels of where geometry has them: a texel between two that are interpolated, and
/// half a one of the rasterizer.
#[test]
fn the_shadow_of_a_cube_is_where_geometry_has_it() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    for (pixels, side) in SHADOW_SIDES {
        let mut dark_parts = 0.0;
        for (elevation, height) in
            [(55.0, 3.0), (55.0, 9.0), (55.0, 30.0), (25.0, 3.0), (25.0, 5.5), (25.0, 14.0), (12.0, 4.0)]
        {
            let mut floor = Floor { pixels, ..Floor::new() };
            floor.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
            add_sun(&mut floor, 2.0, elevation);
            set_eye(&mut floor, Vec3::Y * height);
            let toward = toward(elevation);
            let is_lit = |at: DVec2| {
                let at = DVec3::new(at.x, 0.0, at.y);
                is_free(at, at + 100.0 * toward)
            };
            // A texel as it lies on the floor: longer the flatter light falls there.
            let margin = |place: DVec2| {
                let v = DVec3::new(place.x, -f64::from(height), place.y);
                1.5 * texel((v - v.dot(toward) * toward).length(), side) / toward.y
            };
            let name = format!("{elevation}°, {height} m, {side} texels");
            let [dark, lit, unsure] = check_edges(&floor.shares(&mut headless), is_lit, margin, &name);
            // The coarser a layer, the more of a shadow is edge: in some cases all.
            let (all, is_known) = (pixels.pow(2) as usize, side < 768.0 || dark > 500);
            assert!(is_known && lit > all / 8, "{name}: {dark} dark, {lit} lit, {unsure} unsure");
            dark_parts += dark as f64 / all as f64;
        }
        assert!(dark_parts > 0.1, "{side} texels: {dark_parts}");
    }
}

/// A floor lit at 3° has all of its light, in every level, and at every place of the eye in the grid of these.
#[test]
fn grazing_light_leaves_no_acne() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    for height in [1.0, 6.3, 11.2, 23.9, 47.0, 95.0, 190.0, 380.0, 700.0, 780.0] {
        let mut floor = Floor::new();
        add_sun(&mut floor, 20.0, 3.0);
        set_eye(&mut floor, Vec3::new((0.1 * height) % 1.4, height, -(0.03 * height) % 1.4));
        let shares = floor.shares(&mut headless);
        let least = shares.iter().map(|(_, share)| *share).fold(f32::INFINITY, f32::min);
        assert!(shares.len() > 30_000 && least >= 0.99, "{height} m: {least}");
    }
}

/// Casters far away towards the sun cast their shadows, before the near plane as well. Surfaces beyond the light's far
/// plane or the last level are lit.
#[test]
fn casters_may_be_as_far_away_as_they_like() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    for (distance, eye, share) in [
        (20.0, Vec3::Y, 0.0),
        (900.0, Vec3::Y, 0.0),
        (5000.0, Vec3::Y, 0.0),
        (-20.0, Vec3::Y, 1.0),
        (-5000.0, Vec3::Y, 1.0),
        // Along the light, which is no way across it, and across it.
        (900.0, 800.0 * toward(40.0).as_vec3(), 0.0),
        (20.0, Vec3::new(0.0, 2000.0, 0.0), 1.0),
    ] {
        let mut floor = Floor::new();
        let at = distance * toward(40.0).as_vec3();
        floor.add_cube(Transform::from_translation(at).with_scale(Vec3::splat(14.0)));
        add_sun(&mut floor, 2.0, 40.0);
        // Not above the cube.
        let middle = Transform::from_translation(eye).looking_at(Vec3::ZERO, Vec3::NEG_Z);
        *floor.simulation.world.get_mut::<Transform>(floor.camera).expect("it lives") = middle;
        let shares = floor.shares(&mut headless);
        let wrong = shares.iter().filter(|(_, found)| (found - share).abs() > 0.01).count();
        assert!(shares.len() > 5_000 && wrong == 0, "{distance} m, eye {eye}: {wrong} of {}", shares.len());
    }
}

/// A camera that looks along its way has the same picture everywhere on it, but for levels. In 0.3 mm, where a level
/// moves and where points change their level, no pixel changes by a hundredth of the mean.
#[test]
fn nobody_sees_levels_change() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    let mut floor = Floor::new();
    for (x, z, turn) in [(0.0, 0.0, 0.0), (1.3, 0.7, 0.4), (-1.2, -0.9, 1.1), (0.4, -1.7, 0.8)] {
        floor.add_cube(
            Transform::from_xyz(x, 0.35, z)
                .with_scale(Vec3::splat(0.7))
                .with_rotation(glam::Quat::from_rotation_y(turn)),
        );
    }
    add_sun(&mut floor, 2.0, 35.0);
    let mut at = |height: f32, floor: &mut Floor| {
        set_eye(floor, Vec3::Y * height);
        let picture = floor.draw(&mut headless, 32);
        (picture, stats(&headless).passes)
    };
    let mut moved = 0;
    let (mut height, mut cells) = (2.0f32, Vec::new());
    // Where the eye enters another cell, by halving.
    while height < 12.0 {
        let (mut low, mut high) = (height, height + 0.5);
        at(low, &mut floor);
        if at(high, &mut floor).1 > 0 {
            while high - low > 1e-4 {
                let middle = 0.5 * (low + high);
                at(low, &mut floor);
                if at(middle, &mut floor).1 > 0 { high = middle } else { low = middle }
            }
            cells.push(0.5 * (low + high));
        }
        height += 0.5;
    }
    assert!(cells.len() >= 5, "{cells:?}");
    let ways = (0..20).map(|i| 3.0 + 0.37 * i as f32).chain(cells);
    for height in ways {
        let (before, _) = at(height - 0.00015, &mut floor);
        let (after, passes) = at(height + 0.00015, &mut floor);
        moved += passes;
        let mean = before.iter().sum::<f32>() / before.len() as f32;
        let largest = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(mean > 0.3 && largest <= 0.01 * mean, "{height} m: {largest} of {mean}, {passes} layers");
    }
    assert!(moved >= 5, "{moved}");
}

/// Nothing is drawn while the eye stays in its cells; the first level where it leaves only that one's; and the levels
/// that hold what moves.
#[test]
fn cost_follows_change() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    let mut floor = Floor::new();
    let cube = floor.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
    let far = floor.add_cube(Transform::from_xyz(0.0, 0.5, 70.0).with_scale(Vec3::splat(4.0)));
    let sun = add_sun(&mut floor, 2.0, 80.0);
    let mut passes = |floor: &mut Floor| {
        floor.draw(&mut headless, 32);
        stats(&headless).passes
    };
    set_eye(&mut floor, Vec3::new(0.1, 2.0, 0.1));
    assert_eq!(passes(&mut floor), 6);
    assert_eq!(passes(&mut floor), 0);
    set_eye(&mut floor, Vec3::new(0.3, 2.0, 0.2));
    assert_eq!(passes(&mut floor), 0);
    // From one cell of 2 m to the next, in the middle of those of 4 m and more.
    set_eye(&mut floor, Vec3::new(1.5, 2.0, 0.2));
    assert_eq!(passes(&mut floor), 1);
    // The sphere around it, 1.73 m, is two texels wide in every level: the last one's are 0.67 m.
    floor.simulation.world.get_mut::<Transform>(cube).expect("it lives").translation.x += 0.1;
    assert_eq!(passes(&mut floor), 6);
    // Only the first is looked up there, so from the others it was left out while it moved.
    assert_eq!(passes(&mut floor), 5);
    assert_eq!(passes(&mut floor), 0);
    // 70 m away: no caster of the first four levels, which reach 8 to 64 m.
    floor.simulation.world.get_mut::<Transform>(far).expect("it lives").translation.x += 0.1;
    assert_eq!(passes(&mut floor), 2);
    // The view does not show its shadow.
    assert_eq!(passes(&mut floor), 2);
    floor.simulation.world.get_mut::<Light>(sun).expect("it lives").intensity = 1.0;
    assert_eq!(passes(&mut floor), 0);
    floor.simulation.world.get_mut::<Transform>(sun).expect("it lives").rotate(glam::Quat::from_rotation_z(0.1));
    assert_eq!(passes(&mut floor), 6);
    floor.simulation.world.despawn(cube);
    assert!(passes(&mut floor) >= 5);
    floor.simulation.world.despawn(sun);
    assert_eq!(passes(&mut floor), 0);
}

/// Suns and lamps together are what each is by itself, added up: four suns, the brightest of five.
#[test]
fn suns_and_lamps_add_up() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    let elevations = [70.0, 50.0, 35.0, 25.0, 60.0];
    let mut picture = |suns: std::ops::Range<usize>, has_lamp: bool| {
        let mut floor = Floor::new();
        floor.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
        for sun in suns {
            add_sun(&mut floor, 0.1 * (5 - sun) as f32, elevations[sun]);
        }
        if has_lamp {
            floor.add_light(lamp(2.0), Vec3::new(1.5, 2.5, 0.7), Vec3::NEG_Y);
        }
        floor.simulation.world.insert_resource(systems::lights::LightPolicies::same(systems::lights::LightPolicy::All));
        floor.draw(&mut headless, 32)
    };
    let mut alone: Vec<Vec<f32>> = (0..4).map(|sun| picture(sun..sun + 1, false)).collect();
    alone.push(picture(0..0, true));
    let together = picture(0..4, true);
    for pixel in 0..(SIDE * SIDE) as usize {
        let sum: f32 = alone.iter().map(|picture| picture[pixel]).sum();
        // Half floats: each of five is off by a part in 2¹¹, and so is the sum.
        assert!((sum - together[pixel]).abs() <= 0.001 * sum.max(0.01), "{sum} and {}", together[pixel]);
    }
    // The faintest of five has levels no longer, and the fourth few of its shadows.
    let (all, without) = (picture(0..5, false), picture(0..4, false));
    let added = all.iter().zip(&without).filter(|(all, without)| *all > *without).count();
    assert!(added > 39_000, "{added}");
}

/// Something moves frame after frame among what is still, which soon has a base; a still thing moves; the base is made
/// anew. Every picture is that of a renderer that saw nothing before.
#[test]
fn what_is_still_is_drawn_once_where_something_moves() {
    let Some(gpu) = common::gpu() else { return };
    let mut headless = headless(&gpu);
    let mut floor = Floor::new();
    let mut library = floor.simulation.world.resource_mut::<Library>();
    let ball = library.add_mesh(shapes::sphere(0.3, 128, 64));
    // A mask with holes, larger ones later on.
    let holes = |open: usize| {
        let texels = (0..64).flat_map(|texel| [255, 255, 255, if texel % 8 < open { 0 } else { 255 }]);
        Image::rgba8("leaf", 8, 8, ImageKind::Color, texels.collect())
    };
    let leaf = library.add_image(holes(2));
    let base_map = Some(Map::new(leaf));
    let mask = library.add_material(Material { base_map, alpha: AlphaMode::Mask, ..Material::default() });
    let mut balls = Vec::new();
    for i in 0..9 {
        let place = Transform::from_xyz((i % 3) as f32 * 1.2 - 1.2, 0.4, (i / 3) as f32 * 1.2 - 1.2);
        let material = if i % 3 == 1 { mask } else { floor.white };
        balls.push(floor.simulation.world.spawn((ball, material, place)).id());
    }
    let cube = floor.add_cube(Transform::from_xyz(0.0, 1.0, 0.0).with_scale(Vec3::splat(0.4)));
    add_sun(&mut floor, 1.0, 50.0);
    floor.add_light(lamp(2.0), Vec3::new(1.5, 2.5, 0.7), Vec3::NEG_Y);
    let mut bases = Vec::new();
    for frame in 0..40 {
        floor.simulation.world.get_mut::<Transform>(cube).expect("it lives").translation.x = 0.03 * frame as f32;
        if frame == 20 {
            floor.simulation.world.get_mut::<Transform>(balls[4]).expect("it lives").translation.y += 0.2;
        }
        if frame == 27 {
            assert!(floor.simulation.world.resource_mut::<Library>().replace_image(leaf, holes(5)));
        }
        if frame == 32 {
            floor.simulation.world.despawn(balls.pop().expect("nine"));
        }
        let picture = floor.draw(&mut headless, 32);
        bases.push(stats(&headless).bases);
        // In some frames, since a new renderer takes long.
        if matches!(frame, 5 | 12 | 20 | 21 | 27 | 31..=33 | 39) {
            assert!(picture == floor.draw(&mut self::headless(&gpu), 32), "frame {frame}");
        }
    }
    assert!(bases[0] == 0 && bases[12] > 1 && bases[39] > 1, "{bases:?}");
    let held = headless.renderer.held_bytes().shadow_maps;
    // Nothing moves any more: bases go, and layers stay.
    (0..3).for_each(|_| _ = floor.draw(&mut headless, 32));
    let layers = u64::from(stats(&headless).layers);
    assert!(held > layers * 768 * 768 * 4);
    assert_eq!((layers, headless.renderer.held_bytes().shadow_maps), (7, layers * 768 * 768 * 4));
}
