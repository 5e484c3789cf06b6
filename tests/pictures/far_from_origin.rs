//! Far from the origin a scene looks as it does there: what is drawn counts from the eye.

use crate::common::bumps::{Stage, hills};
use crate::common::{self, prelude::*};

/// Hills on a square and a ball before them, close to the eye, under three lights and a sky, moved by `origin`.
fn stage(origin: Vec3) -> Option<Stage> {
    let mut stage = Stage::new((128, 72))?;
    stage.three_lights();
    let mut environment = stage.simulation.world.resource_mut::<Environment>();
    (environment.zenith, environment.ground) = (Vec3::new(0.1, 0.3, 0.9), Vec3::new(0.5, 0.3, 0.1));
    let material = stage.material(64, 0.06, hills);
    let (square, facing) = Stage::facing(Vec2::splat(1.0));
    stage.spawn(square, material, facing);
    let ball = Material { specular_factor: Vec3::splat(0.5), ..Material::default() };
    stage.spawn(shapes::sphere(0.125, 24, 16), ball, Transform::from_xyz(0.25, 0.125, 0.25));
    *stage.simulation.world.get_mut(stage.camera).expect("a camera") =
        Transform::from_xyz(-0.25, 0.125, 0.5).with_rotation(Quat::from_rotation_y(-0.4));
    stage.simulation.world.get_mut::<Camera>(stage.camera).expect("a camera").near = 0.01;
    let mut places = stage.simulation.world.query::<&mut Transform>();
    // Lights, too, are where a 64th of a metre is.
    let snapped = |place: Vec3| (place * 64.0).round() / 64.0;
    places
        .iter_mut(&mut stage.simulation.world)
        .for_each(|mut place| place.translation = snapped(place.translation) + origin);
    Some(stage)
}

#[test]
fn the_picture_is_the_same_kilometres_away() {
    let Some(mut here) = stage(Vec3::ZERO) else { return };
    // Steps of 1/64 m and more are kept there, which all places in the scene are multiples of.
    let Some(mut there) = stage(Vec3::new(65536.0, -4096.0, 32768.0)) else { return };
    for (name, technique) in Technique::ALL {
        let [expected, found] = [&mut here, &mut there].map(|stage| {
            stage.headless.settings.technique = Some(technique);
            stage.linear()
        });
        let lit = expected.iter().filter(|pixel| pixel.max_element() > 0.01).count();
        assert!(lit > 8000, "{name}: {lit} pixels are lit");
        let worst = expected.iter().zip(&found).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
        // What lies between two places is the same number here and there: at most neighbouring half floats below 2.
        assert!(worst < 1e-3, "{name}: {worst}");
    }
}

/// A scene file with that text, drawn as it is when it was loaded and after some steps.
fn drawn(text: &str) -> Option<[image::RgbaImage; 2]> {
    let folder = with_gpu(|| common::scene_folder(text))?;
    let options = LoadOptions { cache: false, ..LoadOptions::default() };
    let mut stage = Session::load(&folder.at("scene.ron"), &options).expect("a scene");
    let mut headless = Headless::new().expect("an adapter");
    let mut draw =
        |stage: &mut Session| headless.draw(&mut stage.simulation, stage.viewpoint, (160, 90)).expect("a picture");
    let first = draw(&mut stage);
    (0..60).for_each(|_| stage.simulation.step());
    Some([first, draw(&mut stage)])
}

#[test]
fn a_scene_on_a_map_has_the_pictures_of_the_same_scene_at_zero() {
    let scene = |x: i64, z: i64| {
        let at = |dx: f64, y: f64, dz: f64| format!("({}, {y}, {})", x as f64 + dx, z as f64 + dz);
        format!(
            r#"(
    meshes: {{ "cube": cube(), "land": plane(size: (80, 80)) }},
    routes: {{ "r": (points: [{}, {}], then: ["r"]) }},
    entities: [
        (light: directional(), transform: (rotation_degrees: (-50, 30, 0))),
        (light: point(intensity: 9, range: 20), transform: (translation: {})),
        (mesh: "land", transform: (translation: {})),
        (mesh: "cube", transform: (translation: {}, rotation_degrees: (10, 20, 30))),
        (vehicle: (type: "box", route: "r", at: 2, speed_kmh: 36)),
        (camera: (), transform: (translation: {}, look_at: {})),
    ],
)"#,
            at(1.5, 0.0, -12.25),
            at(1.5, 0.0, 60.0),
            at(-2.5, 2.0, 3.75),
            at(0.0, 0.0, 0.0),
            at(-2.25, 0.5, 4.5),
            at(-6.5, 3.25, -7.75),
            at(0.0, 0.5, 4.0),
        )
    };
    let Some(here) = drawn(&scene(0, 0)) else { return };
    assert!(here[0] != here[1], "it moves");
    let distinct: std::collections::BTreeSet<_> = here[0].pixels().map(|pixel| pixel.0).collect();
    assert!(distinct.len() > 50, "there is something to see");
    let there = drawn(&scene(500_000, 5_000_000)).expect("an adapter");
    assert!(here == there);
}
