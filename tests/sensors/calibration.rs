//! Calibrations of cameras by OpenCV, from pictures of a chessboard, agree with `sensors.json`.

use crate::common::{self, prelude::*, scene_folder, succeeds, text};
use glam::dvec2;
use image::{GrayImage, Luma};
use std::f64::consts::TAU;
use std::fmt::Write;

/// A board of 10 × 7 squares of 0.1 m with a white margin, at the origin, and cameras before it: tilted by 15 to 45
/// degrees to all sides, some nearer, each with the board in another part of its picture.
fn scene(lens: &str, (nearest, aside): (f64, f64)) -> String {
    let mut scene = String::from(
        r#"(
    materials: { "board": (shading: unlit, base_map: "board.png") },
    meshes: { "board": plane(size: (1.2, 0.9)) },
    entities: [
        (mesh: "board", material: "board", transform: (rotation_degrees: (90, 0, 0))),
"#,
    );
    for camera in 0..20 {
        // By the golden angle.
        let around = TAU * 0.381966 * f64::from(camera);
        let tilt = f64::from(15 + 15 * (camera % 3)).to_radians();
        let distance = nearest + 0.2 / 3.0 * f64::from(camera % 4);
        let at = DVec3::new(tilt.sin() * around.cos(), tilt.sin() * around.sin(), tilt.cos()) * distance;
        let aim = dvec2((2.0 * around + 1.0).cos(), 0.7 * (2.0 * around + 1.0).sin()) * aside;
        let sensor = format!("camera(size: (320, 240), lens: {lens}, outputs: [color])");
        let places = [at.to_array(), [aim.x, aim.y, 0.0]].map(|[x, y, z]| format!("({x}, {y}, {z})"));
        let [translation, look_at] = places;
        let transform = format!("(translation: {translation}, look_at: {look_at})");
        let _ = writeln!(scene, "(name: \"eye {camera:02}\", transform: {transform}, sensor: {sensor}),");
    }
    scene + "])"
}

fn board() -> GrayImage {
    let side = 24;
    GrayImage::from_fn(12 * side, 9 * side, |x, y| {
        let (column, row) = (x / side, y / side);
        let is_black = (1..11).contains(&column) && (1..8).contains(&row) && (column + row).is_multiple_of(2);
        Luma([if is_black { 30 } else { 230 }])
    })
}

#[track_caller]
fn is_found(lens: &str, poses: (f64, f64)) {
    let Some(folder) = with_gpu(|| scene_folder(&scene(lens, poses))) else { return };
    board().save(folder.path().join("board.png")).expect("a texture");
    let args = ["render", "scene.ron", "-o", "out", "--sensors", "all", "--frames", "1", "--format", "png"];
    succeeds(&args, folder.path());
    let out = folder.path().join("out");
    let Some(said) = common::python("calibration.py", &["cv2", "numpy"], &[out.as_os_str()]) else { return };
    // So that nothing passes for want of being seen.
    assert!(text(&said.stdout).starts_with("1080 corners"), "{}", text(&said.stdout));
}

#[test]
fn opencv_finds_a_lens_of_brown_and_conrady() {
    let lens = "brown_conrady(fx: 210, fy: 205, cx: 157, cy: 122.5, k1: -0.2, k2: 0.05, p1: 0.002, p2: -0.001)";
    is_found(lens, (0.95, 0.15));
}

#[test]
fn opencv_finds_a_lens_of_kannala_and_brandt() {
    let lens = "kannala_brandt(fx: 130, fy: 128, cx: 158, cy: 121, k1: 0.02, k2: -0.004, k3: 0.001, k4: -0.0002, \
                largest_degrees: 85)";
    is_found(lens, (0.7, 0.15));
}
