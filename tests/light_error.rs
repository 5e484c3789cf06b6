//! `relief lights`: scenes whose error is known, and the ones where a quotient could go wrong.

mod common;

use relief::frames::LoadOptions;
use relief::light_error::{LightErrorJob, LightReport, PolicyError, measure};
use std::fs;
use std::path::Path;

const NONE: PolicyError = PolicyError { mean: 0.0, p99: 0.0, flip: 0.0 };

/// A matte ball before a black sky, lit by what `lights` adds.
fn scene(ambient: f32, lights: &[&str]) -> String {
    let lamps: Vec<String> = lights.iter().map(|lamp| format!("        ({lamp}),")).collect();
    format!(
        r#"(
    environment: (ambient: ({ambient}, {ambient}, {ambient}), zenith: (0, 0, 0), horizon: (0, 0, 0), ground: (0, 0, 0)),
    materials: {{ "white": (base_factor: (1, 1, 1), specular_factor: (0, 0, 0)) }},
    meshes: {{ "ball": sphere(radius: 1, segments: 48, rings: 24) }},
    entities: [
        (mesh: "ball", material: "white"),
        (camera: (fov_y_degrees: 45), transform: (translation: (0, 0, 4))),
{}
    ],
)"#,
        lamps.join("\n")
    )
}

fn report(scene: &str) -> LightReport {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.ron");
    fs::write(&path, scene).expect("a scene");
    let job = LightErrorJob {
        load: LoadOptions::for_one_renderer(),
        scene: path,
        folder: folder.path().join("out"),
        frame: 0,
        size: (48, 48),
        camera: None,
        technique: None,
    };
    let report = measure(&job).expect("a report");
    let picture = |name: &str| image::open(job.folder.join(name)).expect("a picture").into_rgb8();
    for name in ["all.png", "three.png", "hard.png", "three_error.png", "hard_error.png"] {
        assert_eq!(picture(name).dimensions(), (48, 48), "{name}");
    }
    // The map is black exactly where nothing is off by more than half a step of its 255.
    let dark = picture("hard_error.png").pixels().all(|pixel| pixel.0.iter().all(|&channel| channel < 5));
    assert!(dark || report.hard.mean > 0.0, "{report:?}");
    assert!(!dark || report.hard.p99 < 0.01, "{report:?}");
    report
}

/// Along the camera's view.
const SUN: &str = "light: directional(intensity: 0.25)";

#[test]
fn dropping_one_of_four_equal_lights_is_an_error_of_a_quarter() {
    if common::gpu().is_none() {
        return;
    }
    let found = report(&scene(0.0, &[SUN; 4]));
    assert_eq!(found.lights, 4);
    // Half floats, 2⁻¹⁰ of what they hold.
    assert!((found.hard.mean - 0.25).abs() < 1e-3, "{found:?}");
    // L_all is 1 in the middle and the cosine elsewhere: 2/3 over the disc of a ball far away, more so near.
    assert!(found.mean_luminance > 0.667 && found.mean_luminance < 0.9, "{found:?}");
    // The brightest hundredth of a disc has cosines from √0.99 = 0.995 on: 0.002; two half floats, over a mean of
    // 0.667: 0.003.
    assert!((found.hard.p99 - 0.25 / found.mean_luminance).abs() < 0.01, "{found:?}");
    assert!(found.hard.flip > 0.02, "{found:?}");
    // Four that tie go into the ambient cube, which lights the ball from the same side, but not as sharply.
    assert!(found.three.mean > 0.0 && found.three.mean < 0.25, "{found:?}");
}

#[test]
fn up_to_three_lights_nothing_is_off() {
    if common::gpu().is_none() {
        return;
    }
    let lamp = "light: point(color: (0.3, 0.5, 0.9), intensity: 3), transform: (translation: (2, 1, 2))";
    let spot = "light: spot(intensity: 0.7, cutoff_degrees: 20), transform: (translation: (0, 0, 5))";
    for count in 0..=3 {
        let found = report(&scene(0.1, &[spot, SUN, lamp][..count]));
        assert_eq!((found.lights, found.three, found.hard), (count, NONE, NONE));
        assert!((found.object_pixels as f64 / 1000.0 - 0.9).abs() < 0.3, "{found:?}");
    }
}

#[test]
fn black_and_empty_pictures_have_no_error() {
    if common::gpu().is_none() {
        return;
    }
    let black = report(&scene(0.0, &[]));
    assert_eq!((black.mean_luminance, black.three, black.hard), (0.0, NONE, NONE));
    assert!(black.object_pixels > 0);
    let empty = report(&scene(0.1, &[SUN]).replace("sphere(radius: 1,", "sphere(radius: 0.00001,"));
    assert_eq!((empty.object_pixels, empty.mean_luminance, empty.three, empty.hard), (0, 0.0, NONE, NONE));
}

#[test]
fn on_the_shipped_scene_three_are_nearer_than_hard() {
    if common::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let job = LightErrorJob {
        load: LoadOptions::for_one_renderer(),
        scene: Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/lights.ron"),
        folder: folder.path().to_owned(),
        frame: 0,
        size: (160, 90),
        camera: None,
        technique: None,
    };
    let LightReport { three, hard, lights, .. } = measure(&job).expect("a report");
    assert_eq!(lights, 44);
    // What three leave out, the ambient cube gives back in part.
    assert!(0.0 < three.mean && three.mean < hard.mean, "{three:?} {hard:?}");
    assert!(three.flip < hard.flip && three.p99 < hard.p99, "{three:?} {hard:?}");
}
