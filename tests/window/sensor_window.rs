//! Sensors in the window: what is seen of them is compared with the files that `relief render --sensors` writes, and a
//! run in which they are looked at with one in which nothing is.

use crate::common::app::{AWAY, App, Place, SIZE, last_step};
use crate::common::display::{Display, wait_for};
use crate::common::{self, prelude::*};
use image::RgbImage;
use image::imageops::crop_imm;
use systems::run::state_hash;

/// The front camera's pictures are as large as thumbnails are at most, so that a pixel of them is one of the window's.
const SCENE: &str = r#"(
    materials: { "red": (base_factor: (0.8, 0.2, 0.1)), "floor": (base_factor: (0.4, 0.45, 0.5)) },
    meshes: { "floor": plane(size: (12, 12)), "ball": sphere(radius: 0.8), "post": cube(size: (0.3, 2, 0.3)) },
    entities: [
        (name: "floor", mesh: "floor", material: "floor", class: "road"),
        (name: "ball", mesh: "ball", material: "red", class: "car", transform: (translation: (0, 0.8, 0))),
        (name: "carousel", instance: true, spin: (degrees_per_second: 90), children: [
            (name: "post", mesh: "post", material: "red", transform: (translation: (2, 1, 0))),
            (name: "top", transform: (translation: (-1.5, 1.5, 0)), sensor: lidar(every: 3, columns: 90, sweep: true)),
        ]),
        (name: "sun", transform: (translation: (2, 5, 4), look_at: (0, 0, 0)), light: directional(shadows: true)),
        (name: "view", transform: (translation: (0, 3, 6), look_at: (0, 1, 0)), camera: ()),
        (name: "front", transform: (translation: (3, 2, 3), look_at: (0, 1, 0)),
         sensor: camera(size: (224, 112), outputs: [color, depth, instance], every: 2)),
        (name: "late", transform: (translation: (-3, 2, 3), look_at: (0, 1, 0)),
         sensor: camera(size: (32, 24), outputs: [depth], every: 5, phase: 4)),
    ],
)"#;

/// Rows of the window that no thumbnail is in.
const FREE: u32 = 100;

/// The picture of the front camera that `relief render` writes after a step.
fn seen_by_front(place: &Place, step: u64) -> RgbImage {
    let frames = format!("{step}..{}", step + 1);
    let folder = tempfile::tempdir_in(place.path()).expect("a temporary folder");
    let mut command = place.relief();
    command.args(["render", "test.ron", "--sensors", "front", "--format", "png", "--frames", &frames, "-o"]);
    let output = command.arg(folder.path()).output().expect("relief starts");
    assert!(output.status.success(), "{}", common::text(&output.stderr));
    let path = folder.path().join(format!("front/color_{step:05}.png"));
    image::open(path).expect("a picture").into_rgb8()
}

/// Top left of a picture within another; `None` if it is not there.
fn found(picture: &RgbImage, within: &RgbImage) -> Option<(u32, u32)> {
    let (width, height) = picture.dimensions();
    let (across, down) = (within.width().checked_sub(width)?, within.height().checked_sub(height)?);
    let places = (0..=down).flat_map(|y| (0..=across).map(move |x| (x, y)));
    let is_here =
        |(x, y): &(u32, u32)| picture.enumerate_pixels().all(|(u, v, rgb)| within.get_pixel(x + u, y + v) == rgb);
    places.into_iter().find(is_here)
}

#[test]
fn thumbnails_show_what_render_writes_and_one_fills_the_view() {
    let place = Place::of(SCENE);
    let Some(display) = Display::start(place.path()) else { return };
    let (app, plain) = App::paused(&place, &display);

    let first = seen_by_front(&place, 0);
    app.press(&["t"]);
    let with_thumbnails =
        app.wait_for_picture("the front camera's picture in a thumbnail", |seen| found(&first, seen).is_some());
    let top = |picture: &RgbImage| crop_imm(picture, 0, 0, SIZE.0, FREE).to_image();
    assert_eq!(top(&with_thumbnails), top(&plain), "the scene above is left alone");
    // The step after which it is due again, and one after which it is not.
    app.press(&["period", "period"]);
    let second = seen_by_front(&place, 2);
    assert_ne!(first, second);
    app.wait_for_picture("what it saw after step 2", |seen| found(&second, seen).is_some());
    app.press(&["period"]);
    let third = place.rendered(3, &[]);
    let still = |seen: &RgbImage| top(seen) == top(&third) && found(&second, seen).is_some();
    app.wait_for_picture("its last picture, after step 3", still);

    let (x, y) = found(&first, &with_thumbnails).expect("it was found");
    let (x, y) = ((x + 100).to_string(), (y + 50).to_string());
    display.xdotool(&[&["mousemove", &x, &y, "click", "1"][..], &AWAY].concat()).expect("xdotool clicks");
    // Shown as wide as the window but for its margins.
    let middle = SIZE.0 / 2;
    let is_full = |seen: &RgbImage| {
        let corners = [(2, 2), (SIZE.0 - 3, 2), (2, SIZE.1 - 3), (SIZE.0 - 3, SIZE.1 - 3)];
        let dark = |(x, y): &(u32, u32)| seen.get_pixel(*x, *y).0 == [12; 3];
        corners.iter().all(dark) && !dark(&(middle, SIZE.1 / 2))
    };
    app.wait_for_picture("the front camera in full size", is_full);
    app.press(&["Escape"]);
    app.wait_for_picture("thumbnails again", still);
    app.press(&["t"]);
    app.shows("the scene alone", &third);
    app.press(&["m"]);
    app.wait_for_picture("frusta and beams", |seen| *seen != third);
    app.press(&["m"]);
    app.shows("the scene alone again", &third);
    app.close();
}

#[test]
fn a_run_does_not_notice_that_its_sensors_are_looked_at() {
    let place = Place::of(SCENE);
    let Some(display) = Display::start(place.path()) else { return };
    let files = ["--no-panel", "--record", "run.rec", "--hash", "window.txt", "--speed", "3"];
    let app = App::start(&place, &display, &files);
    let read = |name: &str| place.read(name);
    app.press(&["t", "m"]);
    wait_for("steps", || (read("window.txt").lines().count() > 60).then_some(()));
    app.press(&["space"]);
    let stopped = last_step(|| read("window.txt"));
    // The last capture that was due, whatever the window has drawn in between.
    let seen = seen_by_front(&place, stopped / 2 * 2);
    app.wait_for_picture("the last capture", |picture| found(&seen, picture).is_some());
    place.rendered(stopped, &["--hash", "render.txt"]);
    assert!(read("render.txt") == read("window.txt"), "the state");
    app.close();
    place.check_replay();
}

#[test]
fn sensors_are_looked_at_again_with_another_device() {
    let place = Place::of(SCENE);
    let Some(display) = Display::start(place.path()) else { return };
    let app = App::of(place.losing_after(400), &display, &["--no-panel", "--hash", "window.txt"]);
    app.press(&["t", "m"]);
    place.wait_for_loss(&app, 10);
    app.press(&["space"]);
    let stopped = last_step(|| place.read("window.txt"));
    let seen = seen_by_front(&place, stopped / 2 * 2);
    app.wait_for_picture("the last capture", |picture| found(&seen, picture).is_some());
    app.close();
}

#[test]
fn looking_is_capturing_and_shows_what_is_not_due_too() {
    let Some(gpu) = common::gpu() else { return };
    let place = Place::of(SCENE);
    let stage = Session::load(&place.path().join("test.ron"), &Default::default());
    let mut simulation = stage.expect("it loads").simulation;
    let [mut capturing, mut looking] = [(); 2].map(|()| SensorSuite::new(&gpu));
    let beams = |capture: &Capture| capture["carousel/top"].lidar().expect("a lidar").scan.len();
    let first = looking.look(&mut simulation, |_| true).expect("looked at");
    assert_eq!(first.sensors.len(), 3);
    // At 10 Hz and 60 steps a second, half a revolution in 3 steps.
    assert_eq!((beams(&first), beams(&capturing.capture(&mut simulation).expect("captured"))), (45 * 16, 0));
    for step in 1..20 {
        simulation.step();
        let captured = capturing.capture(&mut simulation).expect("captured");
        let before = state_hash::hash(&mut simulation.world);
        let seen = looking.look(&mut simulation, |_| true).expect("looked at");
        assert_eq!(state_hash::hash(&mut simulation.world), before);
        assert_eq!(seen.sensors.len(), 3);
        for sensor in &captured.sensors {
            assert!(*sensor == seen[sensor.name.as_str()], "{} after step {step}", sensor.name);
        }
        assert_eq!(beams(&seen), 45 * 16);
    }
    let late = first["late"].entity;
    let seen = looking.look(&mut simulation, |sensor| sensor == late).expect("looked at");
    assert_eq!(seen.sensors.iter().map(|sensor| sensor.name.as_str()).collect::<Vec<_>>(), ["late"]);
}
