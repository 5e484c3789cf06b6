//! `relief lights`: scenes whose error is known, and the ones where a quotient could go wrong.

use crate::common::prelude::*;
use crate::{common, frame_job};
use relief::tools::light_error::{LightReport, PolicyError, measure};

const NONE: PolicyError = PolicyError { mean: 0.0, p99: 0.0, flip: 0.0, seams: 0.0 };

fn of_policy(report: &LightReport, wanted: &str) -> PolicyError {
    report.policies.iter().find(|(name, _)| *name == wanted).expect("a policy").1
}

fn three(report: &LightReport) -> PolicyError {
    of_policy(report, "three")
}

fn hard(report: &LightReport) -> PolicyError {
    of_policy(report, "hard")
}

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
    let folder = common::scene_folder(scene);
    let job = frame_job(&folder.path().join("scene.ron"), &folder.path().join("out"), (48, 48));
    let report = measure(&job).expect("a report");
    let picture = |name: &str| image::open(job.folder.join(name)).expect("a picture").into_rgb8();
    for name in ["all.png", "three.png", "hard.png", "three_error.png", "hard_error.png"] {
        assert_eq!(picture(name).dimensions(), (48, 48), "{name}");
    }
    // The map is black exactly where nothing is off by more than half a step of its 255.
    let dark = picture("hard_error.png").pixels().all(|pixel| pixel.0.iter().all(|&channel| channel < 5));
    assert!(dark || hard(&report).mean > 0.0, "{report:?}");
    assert!(!dark || hard(&report).p99 < 0.01, "{report:?}");
    report
}

/// Along the camera's view.
const SUN: &str = "light: directional(intensity: 0.25)";

#[test]
fn dropping_one_of_four_equal_lights_is_an_error_of_a_quarter() {
    let Some(_) = common::gpu() else { return };
    let found = report(&scene(0.0, &[SUN; 4]));
    assert_eq!(found.lights, 4);
    // Half floats, 2⁻¹⁰ of what they hold.
    assert!((hard(&found).mean - 0.25).abs() < 1e-3, "{found:?}");
    // L_all is 1 in the middle and the cosine elsewhere: 2/3 over the disc of a ball far away, more so near.
    assert!(found.mean_luminance > 0.667 && found.mean_luminance < 0.9, "{found:?}");
    // The brightest hundredth of a disc has cosines from √0.99 = 0.995 on: 0.002; two half floats, over a mean of
    // 0.667: 0.003.
    assert!((hard(&found).p99 - 0.25 / found.mean_luminance).abs() < 0.01, "{found:?}");
    assert!(hard(&found).flip > 0.02, "{found:?}");
    // Four that tie go into the ambient cube, which lights the ball from the same side, but not as sharply.
    assert!(three(&found).mean > 0.0 && three(&found).mean < 0.25, "{found:?}");
}

#[test]
fn up_to_three_lights_nothing_is_off() {
    let Some(_) = common::gpu() else { return };
    let lamp = "light: point(color: (0.3, 0.5, 0.9), intensity: 3), transform: (translation: (2, 1, 2))";
    let spot = "light: spot(intensity: 0.7, cutoff_degrees: 20), transform: (translation: (0, 0, 5))";
    for count in 0..=3 {
        let found = report(&scene(0.1, &[spot, SUN, lamp][..count]));
        assert_eq!((found.lights, three(&found), hard(&found)), (count, NONE, NONE));
        assert!((found.object_pixels as f64 / 1000.0 - 0.9).abs() < 0.3, "{found:?}");
    }
}

#[test]
fn black_and_empty_pictures_have_no_error() {
    let Some(_) = common::gpu() else { return };
    let black = report(&scene(0.0, &[]));
    assert_eq!((black.mean_luminance, three(&black), hard(&black)), (0.0, NONE, NONE));
    assert!(black.object_pixels > 0);
    let empty = report(&scene(0.1, &[SUN]).replace("sphere(radius: 1,", "sphere(radius: 0.00001,"));
    assert_eq!((empty.object_pixels, empty.mean_luminance, three(&empty), hard(&empty)), (0, 0.0, NONE, NONE));
}

/// A matte floor, 4 m by 2 m, seen from above: `entities` of the material `white`. Two directional lights from below
/// score highest and light nothing. The lamps hang 3 m high, 3 m to either side of the middle, the left one twice as
/// bright; `right` is what is special of the other.
fn floor(entities: &str, right: &str) -> String {
    let below = "light: directional(intensity: 0.5), transform: (rotation_degrees: (90, 0, 0))";
    let left = "light: point(intensity: 2, attenuation: inverse_square), transform: (translation: (-3, 3, 0))";
    let right = "light: point(intensity: 1, attenuation: inverse_square RIGHT), transform: (translation: (3, 3, 0))"
        .replace("RIGHT", right);
    let camera = "camera: (orthographic_half_height: 1.1, aspect: 1), \
                  transform: (translation: (0, 5, 0), rotation_degrees: (-90, 0, 0))";
    format!(
        r#"(
    environment: (ambient: (0, 0, 0), zenith: (0, 0, 0), horizon: (0, 0, 0), ground: (0, 0, 0)),
    materials: {{ "white": (base_factor: (1, 1, 1), specular_factor: (0, 0, 0)) }},
    meshes: {{ "long": plane(size: (4, 2)), "half": plane(size: (2, 2)) }},
    entities: [ {entities} ({camera}), ({left}), ({right}), ({below}), ({below}) ],
)"#
    )
}

const IN_TWO_PIECES: &str = r#"(mesh: "long", material: "white", piece_metres: 2),"#;

#[test]
fn seams_are_as_high_as_the_difference_of_the_lamps_that_two_pieces_leave_out() {
    let Some(_) = common::gpu() else { return };
    let found = report(&floor(IN_TWO_PIECES, ""));
    // Two pixels lie side by side in each of the rows whose middle is on the floor: a pixel is 2.2 m / 48 wide.
    let pixel = 2.2 / 48.0;
    assert_eq!(found.seam_pairs, 2 * (1.0f64 / pixel).round() as usize);
    // Each half has its nearer lamp and lacks the other. Half a pixel from the border both are as far off, and in the
    // two rows of the middle the step is highest: the irradiance of the difference of their intensities.
    let half = pixel / 2.0;
    let known = (2.0 - 1.0) * 3.0 / (3.0f64.powi(2) + (3.0 + half).powi(2) + half.powi(2)).powf(1.5);
    // Four luminances of at most that of all lights, each rounded to half floats twice, by 2⁻¹¹: in its samples and in
    // their mean.
    let rounding = 4.0 * 2.0 * f64::powi(2.0, -11) * 3.0 * known;
    let step = hard(&found).seams * found.mean_luminance;
    assert!((step - known).abs() < rounding, "{step}, not {known}: {found:?}");
    // The ambient cubes of the halves' middles give a part of it back, and not the same on both sides.
    let step = three(&found).seams * found.mean_luminance;
    assert!(2.0 * rounding < step && step < known, "{step}, {known}: {found:?}");
}

#[test]
fn where_nothing_is_left_out_and_between_objects_there_are_no_seams() {
    let Some(_) = common::gpu() else { return };
    // The right lamp does not reach the floor.
    let exact = report(&floor(IN_TWO_PIECES, ", range: 1"));
    assert!(exact.seam_pairs > 0 && exact.mean_luminance > 0.0, "{exact:?}");
    assert_eq!((three(&exact), hard(&exact)), (NONE, NONE));
    let half = |x: i32| format!(r#"(mesh: "half", material: "white", transform: (translation: ({x}, 0, 0))),"#);
    let two = report(&floor(&(half(-1) + &half(1)), ""));
    assert!(hard(&two).mean > 0.1, "{two:?}");
    assert_eq!((two.seam_pairs, three(&two).seams, hard(&two).seams), (0, 0.0, 0.0));
}

#[test]
fn on_the_shipped_scene_three_are_nearer_than_hard() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/lights.ron");
    let job = frame_job(&scene, folder.path(), (160, 90));
    let found = measure(&job).expect("a report");
    assert_eq!(found.lights, 44);
    let (three, hard) = (three(&found), hard(&found));
    // What three leave out, the ambient cube gives back in part.
    assert!(0.0 < three.mean && three.mean < hard.mean, "{three:?} {hard:?}");
    assert!(three.flip < hard.flip && three.p99 < hard.p99, "{three:?} {hard:?}");
}

/// Light that is left out of an object with enough lights is too little to be seen. The scene is the town at night:
/// its roads are cut into pieces under many lamps. The figures of docs/lights.md are those of a larger picture.
#[test]
fn the_town_as_it_is_shipped_is_hardly_told_from_all_lights() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/town.ron");
    let job = frame_job(&scene, folder.path(), (320, 180));
    let found = measure(&job).expect("a report");
    let (shipped, three) = (of_policy(&found, "default"), three(&found));
    assert!(found.seam_pairs > 1000, "{found:?}");
    // The bounds that the scene is made for; three lights miss each by far.
    assert!(shipped.mean <= 0.01 && shipped.p99 <= 0.1 && shipped.seams <= 0.02, "{shipped:?}");
    assert!(three.mean > 0.02 && three.p99 > 0.2 && three.seams > 0.2, "{three:?}");
}
