//! `relief gallery`: the scene of all techniques, once for each shape; scenes that cannot be one.

use crate::common::{self, assert_fails, prelude::*, text};
use std::process::Output;

fn gallery(folder: &Path, args: &[&str]) -> Output {
    common::relief(&[&["gallery", "-o", "out"], args].concat(), folder)
}

/// The scene is found although the working directory is another, and its figures' shapes differ.
#[test]
fn every_shape_gets_a_picture_and_a_place_on_the_sheet() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let output = common::succeeds(&["gallery", "-o", "out", "--size", "160x90"], folder.path());
    let out = folder.path().join("out");
    let names = ["torus.png", "sphere.png", "cube.png", "quad.png", "gallery.png"];
    let written: Vec<String> = names.iter().map(|name| Path::new("out").join(name).display().to_string()).collect();
    assert_eq!(text(&output.stdout).lines().collect::<Vec<_>>(), written);
    assert_eq!(fs::read_dir(&out).expect("a folder").count(), names.len());

    let pictures = names.map(|name| image::open(out.join(name)).expect("a picture").into_rgb8());
    let [figures @ .., sheet] = &pictures;
    assert_eq!(sheet.dimensions(), (2 * 160 + 8, 2 * 90 + 8));
    for (i, figure) in figures.iter().enumerate() {
        assert_eq!(figure.dimensions(), (160, 90));
        for other in &figures[..i] {
            let differing = figure.pixels().zip(other.pixels()).filter(|(a, b)| a != b).count();
            assert!(differing > 160 * 90 / 20, "{}: {differing} pixels differ from another shape's", names[i]);
        }
        let (x, y) = (i as u32 % 2 * 168, i as u32 / 2 * 98);
        let cell = image::imageops::crop_imm(sheet, x, y, 160, 90).to_image();
        assert_eq!(&cell, figure, "{} on the sheet", names[i]);
    }
}

const STILL: &str = r#"(
    meshes: { "ball": sphere(radius: 0.5), "box": cube(size: 0.7) },
    entities: [
        (figure: ["ball", "box"], spin: (axis: (1, 2, 3), degrees_per_second: 90)),
        (light: directional(), transform: (translation: (1, 2, 3), look_at: (0, 0, 0))),
        (camera: (fov_y_degrees: 45), transform: (translation: (0, 0, 3))),
    ],
)"#;

#[test]
fn any_scene_with_a_figure_will_do_at_any_frame() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    fs::write(folder.path().join("still.ron"), STILL).expect("a scene");
    let mut boxes = Vec::new();
    for frame in ["0", "20"] {
        let still = ["gallery", "-o", "out", "--scene", "still.ron", "--size", "64x48", "--frame", frame];
        common::succeeds(&still, folder.path());
        boxes.push(image::open(folder.path().join("out/box.png")).expect("a picture").into_rgb8());
    }
    assert_ne!(boxes[0], boxes[1], "the box turns");
}

#[test]
fn scenes_that_cannot_be_drawn_leave_nothing_behind() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let plain = STILL.replace(r#"figure: ["ball", "box"], "#, r#"mesh: "ball", "#);
    fs::write(folder.path().join("plain.ron"), plain).expect("a scene");
    fs::write(folder.path().join("broken.ron"), "(entities: [").expect("a scene");
    let cases = [
        (&["--scene", "plain.ron"][..], "plain.ron: no entity has mesh variants"),
        (&["--scene", "broken.ron"], "broken.ron"),
        (&["--scene", "missing.ron"], "missing.ron"),
        (&["--size", "0x9"], "expected WIDTHxHEIGHT"),
    ];
    for (args, message) in cases {
        assert_fails(&gallery(folder.path(), args), 2, &[message]);
        assert!(!folder.path().join("out").exists(), "{args:?}");
    }
}
