//! Shadow maps of lamps: pictures whose every sample is known.

use crate::common::floor::{Floor, HALF, SHADOW_SIDES, check_edges, headless, is_free, lamp};
use crate::common::{self, prelude::*};
use glam::Vec3Swizzles;
use systems::lights::NoShadow;

fn spot(intensity: f32, outer_degrees: f32) -> Light {
    let kind = LightKind::Spot { outer: outer_degrees.to_radians(), inner: Some(0.0), exponent: 0.0 };
    Light { kind, ..lamp(intensity) }
}

/// Texels of a slope of one in a layer of so many along a side: of the face below a point light, of its other faces, and
/// of a spot.
fn below(side: f64) -> f64 {
    side / 3.0 - 2.0
}

fn beside(side: f64) -> f64 {
    side / 6.0 - 2.0
}

fn of_spot(side: f64, outer_degrees: f64) -> f64 {
    (side / 2.0 - 2.0) / outer_degrees.to_radians().tan()
}

/// Below a lamp, beside one, in a wide spot, which has six faces as well, and in spots that fill their layer. All edges
/// of the shadow, at the cube's foot among them, are within 1.375 texels of where geometry has them: a texel between
/// two that are interpolated, a sixteenth of the rasterizer, and at the foot what a comparison allows for (below).
#[test]
fn the_shadow_of_a_cube_is_where_geometry_has_it() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
    let down = Vec3::NEG_Y;
    for (pixels, side) in SHADOW_SIDES {
        let cases = [
            (lamp(8.0), Vec3::new(-0.9, 3.1, 0.4), down, below(side)),
            (lamp(8.0), Vec3::new(-3.3, 1.4, 0.3), down, beside(side)),
            (lamp(8.0), Vec3::new(0.2, 1.3, -3.4), down, beside(side)),
            (spot(14.0, 70.0), Vec3::new(-1.0, 4.0, 0.3), down, below(side)),
            (spot(60.0, 40.0), Vec3::new(-2.0, 4.0, 0.3), Vec3::new(2.0, -4.0, -0.1), of_spot(side, 40.0)),
            (spot(60.0, 25.0), Vec3::new(3.0, 3.0, 3.0), Vec3::new(-3.0, -2.7, -3.0), of_spot(side, 25.0)),
        ];
        let mut dark_parts = 0.0;
        for (light, at, toward, scale) in cases {
            let mut scene = Floor { pixels, ..Floor::new() };
            scene.add_cube(Transform::from_xyz(0.0, 0.5, 0.0));
            scene.add_light(light, at, toward);
            let eye = at.as_dvec3();
            let is_lit = |at: DVec2| is_free(DVec3::new(at.x, 0.0, at.y), eye);
            // A texel as it lies on the floor: longer the flatter light falls there.
            let margin = |place: DVec2| {
                let v = DVec3::new(place.x, 0.0, place.y) - eye;
                1.375 * v.length() / scale * v.length() / v.y.abs()
            };
            let name = format!("{at} {toward}, {side} texels");
            let [dark, lit, unsure] = check_edges(&scene.shares(&mut headless), is_lit, margin, &name);
            // The coarser a layer, the more of a shadow is edge: in some cases all.
            let all = pixels.pow(2) as usize;
            let is_known = side < 768.0 || dark > 300 && unsure < dark + lit;
            assert!(is_known && lit > all / 14, "{name}: {dark} {lit} {unsure}");
            dark_parts += dark as f64 / all as f64;
        }
        assert!(dark_parts > 0.1, "{side} texels: {dark_parts}");
    }
}

/// A floor by itself is in no way of its own: at 3° and more no pixel has less than 0.99 of its light. Also where it is
/// one square, which reaches behind the light. SwiftShader rounds vertices to sixteenths of a texel, and extends depths
/// from behind the light as well. Such a slope is off by more than a look-up allows for where a triangle spans less
/// than 60 texels, from horizon to horizon; that of a square metre spans 100 here.
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

/// Across a straight edge of a point's shadow light rises from 0 to 1 as a line does, over a texel.
#[test]
fn a_point_has_shadows_as_sharp_as_texels() {
    let Some(gpu) = common::gpu() else { return };
    for turned in [false, true] {
        // Along X, or along Z.
        let place = |along: f32, y: f32| if turned { Vec3::new(0.0, y, along) } else { Vec3::new(along, y, 0.0) };
        let mut scene = Floor::new();
        let size = place(2.0, 0.02) + if turned { Vec3::X } else { Vec3::Z } * 6.0;
        scene.add_cube(Transform::from_translation(place(-0.7, 1.0)).with_scale(size));
        scene.add_light(lamp(20.0), place(-1.0, 8.0), Vec3::NEG_Y);
        // The plate's upper edge, from the light: of columns of texels those are dark whose middle it hides.
        let edge = (1.3 / 6.99 * below(768.0)).round();
        let of_floor = below(768.0) / 8.0;
        let half_height = 0.12;
        let middle = (edge / of_floor - 1.0) as f32;
        let projection = Projection::Orthographic { half_height, aspect: Some(1.0) };
        let camera = Camera { projection, ..Camera::default() };
        let above = Transform::from_translation(place(middle, 9.0)).looking_to(Vec3::NEG_Y, Vec3::NEG_Z);
        scene.simulation.world.entity_mut(scene.camera).insert((camera, above));
        let mut headless = headless(&gpu);
        let mut between = 0;
        for (pixel, share) in scene.shares(&mut headless) {
            let pixel = pixel * f64::from(half_height / HALF);
            let along = f64::from(middle) + if turned { pixel.y } else { pixel.x };
            let expected = (((along + 1.0) * of_floor - edge) + 0.5).clamp(0.0, 1.0);
            between += u32::from(expected > 0.0 && expected < 1.0);
            // Two pictures of half floats: a part in 2¹⁰ each, and as much for places.
            let is_right = (f64::from(share) - expected).abs() < 0.004;
            assert!(is_right, "{turned}: {share} of {expected} at {along}");
        }
        assert!(between > 2000, "{turned}: {between}");
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
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
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
            let texel =
                if way.y == farthest { way.y / below(768.0) } else { farthest * farthest / way.y / beside(768.0) };
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
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
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
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
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

/// A fine sphere far away, drawn at coarse levels by the eye and by the lamp: but for the facets at the edge of its lit
/// side, which turn away from the lamp sooner than the round shape, it has its light.
#[test]
fn coarse_levels_are_not_in_their_own_way() {
    let Some(mut headless) = common::gpu().map(|gpu| headless(&gpu)) else { return };
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

/// A bumpy sheet under a lamp at 25° and more, with nothing else about: its own shadows are its technique's, and the
/// map adds none, whatever the technique, from either side.
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
