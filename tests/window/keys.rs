//! The window under a display of its own, with real key presses: what is seen is compared with what `relief render`
//! writes, pixel for pixel.

use crate::common::app::{AWAY, App, Place, SIZE, last_step, size};
use crate::common::display::{Display, missing, wait_for};
use crate::common::{self, prelude::*};
use image::{Rgb, RgbImage};
use std::process::Command;
use std::time::Duration;

/// The panel's part of a window of that size; the scene stays as it is left of it.
const PANEL_WIDTH: u32 = 292;

const SCENE: &str = r#"(
    materials: {
        "bumpy": (base_factor: (0.7, 0.6, 0.5), normal_map: "bumps.png", uv: (scale: (4, 2))),
        "floor": (base_factor: (0.4, 0.45, 0.5), normal_map: "bumps.png", uv: (scale: (8, 8))),
    },
    meshes: {
        "floor": plane(size: (8, 8)),
        "torus": torus(major: 1, minor: 0.4),
        "ball": sphere(radius: 1.2),
    },
    entities: [
        (name: "floor", mesh: "floor", material: "floor"),
        (name: "figure", figure: ["torus", "ball"], material: "bumpy",
         transform: (translation: (0, 1.3, 0), rotation_degrees: (60, 0, 0))),
        (name: "carousel", spin: (degrees_per_second: 180), children: [
            (name: "lamp", transform: (translation: (2.5, 2.5, 0)),
             light: point(intensity: 10, range: 12, shadows: true)),
        ]),
        (name: "sky", transform: (translation: (2, 5, 4), look_at: (0, 0, 0)),
         light: directional(intensity: 0.4, shadows: true)),
        (name: "front", transform: (translation: (0, 3, 6), look_at: (0, 1, 0)), camera: ()),
        (name: "above", transform: (translation: (1, 7, 3), look_at: (0, 0, 0)), camera: ()),
    ],
)"#;

fn place() -> Place {
    let place = Place::of(SCENE);
    let bumps = RgbImage::from_fn(32, 32, |x, y| {
        let slope = |at: u32| ((at as f32 / 32.0 * std::f32::consts::TAU).sin() * 60.0 + 127.5) as u8;
        Rgb([slope(x), slope(y), 230])
    });
    bumps.save(place.path().join("bumps.png")).expect("a texture");
    place
}

#[test]
fn the_window_shows_what_render_writes_and_keys_change_it() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let (app, plain) = App::paused(&place, &display);

    for (key, what, options) in [
        ("b", "the scene without bump mapping", ["--technique", "off"]),
        ("x", "the scene without shadows", ["--shadows", "0"]),
        ("c", "the other camera", ["--camera", "above"]),
    ] {
        let other = place.rendered(0, &options);
        assert_ne!(plain, other);
        for (what, picture) in [(what, &other), ("the scene as it was", &plain)] {
            app.press(&[key]);
            app.shows(what, picture);
        }
    }

    app.press(&["f"]);
    app.wait_for_picture("another figure", |seen| *seen != plain);
    app.press(&["f"]);
    app.shows("the first figure again", &plain);

    app.press(&["v"]);
    app.shows("base colours", &place.rendered(0, &["--debug", "base"]));
    app.press(&["v", "v"]);
    app.shows("tangents", &place.rendered(0, &["--debug", "tangent"]));
    app.press(&["v"; 7]);
    app.shows("light again", &plain);

    app.close();
}

#[test]
fn the_clock_stops_steps_and_goes_on() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let app = App::start(&place, &display, &["--paused", "--no-panel", "--hash", "hashes.txt"]);
    app.press(&["period", "n", "period"]);
    let third = place.rendered(3, &[]);
    app.shows("the picture of frame 3", &third);

    app.press(&["space"]);
    app.wait_for_picture("the lamp moving", |seen| *seen != third);
    // What moves is first shown between steps 2 and 3. One line is of step 0.
    wait_for("step 4", || (place.read("hashes.txt").lines().count() > 4).then_some(()));
    app.press(&["space", "p"]);
    let saved = app.line();
    let step = saved.strip_prefix("test_").and_then(|name| name.strip_suffix(".png")).expect("test_NNNNN.png");
    let step: u64 = step.parse().expect("the number of the step");
    assert!(step > 3, "{saved}");
    let now = place.rendered(step, &[]);
    app.shows("the picture of the step it stopped at", &now);
    assert_eq!(image::open(place.path().join(saved)).expect("the saved picture").into_rgb8(), now);
}

#[test]
fn a_picture_saved_while_the_clock_goes_is_that_of_its_step() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let app = App::start(&place, &display, &["--no-panel"]);
    let saved_is_rendered = |camera: &str| {
        app.press(&["p"]);
        let saved = app.line();
        let step = saved.strip_prefix("test_").and_then(|name| name.strip_suffix(".png")).expect("test_NNNNN.png");
        let rendered = place.rendered(step.parse().expect("a step"), &["--camera", camera]);
        assert!(image::open(place.path().join(&saved)).expect("a picture").into_rgb8() == rendered, "{saved}");
        rendered
    };
    for _ in 0..2 {
        saved_is_rendered("front");
        app.press(&["c"]);
        saved_is_rendered("above");
        app.press(&["c"]);
    }
    app.press(&["space"]);
    let still = saved_is_rendered("front");
    app.shows("the picture of the step it stopped at", &still);
}

#[test]
fn a_run_in_a_window_is_the_run_without_one_and_its_recording_replays() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let files = ["--record", "run.rec", "--hash", "window.txt", "--speed", "5"];
    let app = App::start(&place, &display, &[&["--no-panel"], &files[..]].concat());
    let read = |name: &str| place.read(name);
    wait_for("steps", || (read("window.txt").lines().count() > 100).then_some(()));
    app.press(&["space"]);
    let stopped = last_step(|| read("window.txt"));
    let still = place.rendered(stopped, &["--hash", "render.txt"]);
    app.shows("the state itself, and nothing between steps", &still);
    let headless = read("render.txt");
    assert!(headless.lines().count() > 100 && headless == read("window.txt"), "without a window");

    app.press(&["f", "period", "period"]);
    app.wait_for_picture("another figure", |seen| *seen != still);
    app.press(&["F5"]);
    let snapshot = app.line();
    app.close();
    let (last, folder) = (stopped + 2, place.path().join("again"));
    let frames = format!("{last}..{}", last + 1);
    let mut replay = place.relief();
    replay.args(["replay", "run.rec", "--size", &size(), "--frames", &frames, "--hash", "replay.txt", "-o", "again"]);
    let output = replay.output().expect("relief starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(read("replay.txt").lines().count() > 2 && read("window.txt").ends_with(&read("replay.txt")));
    let replayed = image::open(folder.join(format!("color_{last:05}.png"))).expect("a picture").into_rgb8();
    assert_ne!(replayed, place.rendered(last, &[]), "the figure changes in the replay");
    assert_eq!(place.rendered(last, &["--from-snapshot", &snapshot]), replayed, "and in the snapshot");
}

#[test]
fn a_window_whose_device_is_lost_goes_on_with_another_as_if_nothing_had_happened() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let read = |name: &str| place.read(name);
    // A frame is checked four times.
    let app = App::of(place.losing_after(50), &display, &["--no-panel", "--hash", "window.txt"]);
    place.wait_for_loss(&app, 30);
    app.press(&["space"]);
    let stopped = last_step(|| read("window.txt"));
    let still = place.rendered(stopped, &["--hash", "render.txt"]);
    app.shows("the picture of the step it stopped at", &still);
    assert!(read("render.txt") == read("window.txt"), "the simulation has noticed nothing");
    // The scene's own warnings, and one word of the loss.
    let losses = read("errors.txt").lines().filter(|line| !line.contains("normal_map has no z")).count();
    assert_eq!(losses, 1, "{}", read("errors.txt"));
    app.close();
}

/// Each check of the first frame, which is the one that brings the panel's font: what the widgets have asked for is not
/// painted yet, is, or is shown.
#[test]
fn a_device_may_be_lost_anywhere_in_a_frame() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    for check in 1..=4 {
        let app = App::of(place.losing_after(check), &display, &["--paused"]);
        let errors = || place.read("errors.txt");
        app.wait_for("the loss", || errors().contains("the graphics device was lost").then_some(()));
        app.press(&["Escape"]);
        assert_eq!(app.ends().code(), Some(0), "check {check}: {}", errors());
    }
}

#[test]
fn the_panel_floats_over_the_scene_and_leaves_the_rest_alone() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let app = App::start(&place, &display, &["--paused"]);
    let plain = place.rendered(0, &[]);
    let scene = |picture: &RgbImage| image::imageops::crop_imm(picture, 0, 0, SIZE.0 - PANEL_WIDTH, SIZE.1).to_image();
    let covered = |seen: &RgbImage| {
        let panel = (SIZE.0 - PANEL_WIDTH..SIZE.0).flat_map(|x| (0..SIZE.1).map(move |y| (x, y)));
        panel.filter(|&(x, y)| seen.get_pixel(x, y) != plain.get_pixel(x, y)).count()
    };
    let most = (PANEL_WIDTH * SIZE.1) as usize * 9 / 10;
    let with_panel = |seen: &RgbImage| covered(seen) > most && scene(seen) == scene(&plain);
    app.wait_for_picture("the panel", with_panel);
    // The panel's wheel is not the scene's, even where no frame was drawn since the pointer came there.
    let wheel = [&["mousemove", "400", "200", "click", "5"][..], &AWAY].concat();
    display.xdotool(&wheel).expect("xdotool moves the mouse");
    app.press(&["Tab"]);
    app.shows("the scene alone", &plain);
    app.press(&["Tab"]);
    let panel = app.wait_for_picture("the panel again", with_panel);
    app.press(&["h"]);
    app.wait_for_picture("the keys in the panel", |seen| with_panel(seen) && *seen != panel);
}

#[test]
fn the_mouse_moves_the_camera_and_a_key_puts_it_back() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let (app, plain) = App::paused(&place, &display);
    let drag = |button: &'static str| {
        let along = ["mousemove", "200", "100", "mousedown", button, "mousemove", "240", "110", "mouseup", button];
        [&along[..], &AWAY].concat()
    };
    let mut before = plain.clone();
    for (what, arguments) in [
        ("a turn", drag("1")),
        ("a move sideways", drag("2")),
        ("a look around", drag("3")),
        ("a zoom", [&["mousemove", "200", "100", "click", "4"][..], &AWAY].concat()),
    ] {
        display.xdotool(&arguments).expect("xdotool moves the mouse");
        // Still, so that a frame in between does not pass for the next change.
        let mut last = before.clone();
        before = wait_for(what, || {
            std::thread::sleep(Duration::from_millis(300));
            let seen = display.look(SIZE)?;
            let still = seen == last && seen != before;
            last = seen;
            still.then(|| last.clone())
        });
        assert_ne!(before, plain);
    }
    app.press(&["r"]);
    app.shows("the scene's camera again", &plain);
}

/// Pixel of a point, world space, in the scene's first camera.
fn pixel_of(point: Vec3) -> Vec2 {
    let camera = Transform::from_xyz(0.0, 3.0, 6.0).looking_at(Vec3::Y, Vec3::Y);
    let view = View::new(&camera.compute_affine(), &Camera::default(), SIZE.0, SIZE.1);
    let clip = view.clip_from_world() * point.extend(1.0);
    (clip.truncate().truncate() / clip.w * Vec2::new(0.5, -0.5) + 0.5) * Vec2::new(SIZE.0 as f32, SIZE.1 as f32)
}

/// Share of the line between two pixels that has, itself or beside it, a colour that passes.
fn share_along(picture: &RgbImage, from: Vec2, to: Vec2, passes: impl Fn(&Rgb<u8>) -> bool) -> f32 {
    let around = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)];
    let is_there = |i: &i32| {
        let at = from.lerp(to, *i as f32 / 100.0).as_ivec2();
        let near = around.iter().map(|(x, y)| (at.x + x, at.y + y));
        near.filter_map(|(x, y)| picture.get_pixel_checked(x as u32, y as u32)).any(&passes)
    };
    (0..=100).filter(is_there).count() as f32 / 101.0
}

#[test]
fn lines_lead_from_the_selected_object_to_its_lights() {
    let place = place();
    let Some(display) = Display::start(place.path()) else { return };
    let (app, plain) = App::paused(&place, &display);
    let click = |point: Vec3| {
        let at = pixel_of(point).as_ivec2();
        let (x, y) = (at.x.to_string(), at.y.to_string());
        display.xdotool(&[&["mousemove", &x, &y, "click", "1"][..], &AWAY].concat()).expect("xdotool clicks");
    };

    // The left side of the ring. Its nearest light is the lamp, its second the sky, both to the right of it or above.
    let center = Vec3::new(0.0, 1.3, 0.0);
    let (object, lamp) = (pixel_of(center), pixel_of(Vec3::new(2.5, 2.5, 0.0)));
    let toward_sky = pixel_of(center + Vec3::new(2.0, 5.0, 4.0).normalize());
    let red = |p: &Rgb<u8>| p.0[0] > 200 && p.0[1] < 120 && p.0[2] < 120;
    let green = |p: &Rgb<u8>| p.0[1] > 170 && p.0[0] < 130 && p.0[2] < 130;
    assert!(share_along(&plain, object, lamp, red) + share_along(&plain, object, toward_sky, green) < 0.1);
    click(center - Vec3::X);
    app.wait_for_picture("lines to two lights", |seen| {
        share_along(seen, object, lamp, red) > 0.95 && share_along(seen, object, toward_sky, green) > 0.95
    });
    app.press(&["l"]);
    app.shows("no lines", &plain);
    app.press(&["l"]);
    app.wait_for_picture("lines again", |seen| share_along(seen, object, lamp, red) > 0.95);
    click(Vec3::new(0.0, 3.6, -3.0));
    app.shows("nothing selected", &plain);
}

#[test]
fn a_vehicle_is_driven_by_hand_and_seen_from_behind() {
    let place = place();
    let vehicle = r#"(name: "mine", vehicle: (type: "box"), transform: (translation: (0, 0, -4))),"#;
    let scene = SCENE.replace("    entities: [", &format!("    entities: [{vehicle}"));
    fs::write(place.path().join("test.ron"), scene).expect("a scene file");
    let Some(display) = Display::start(place.path()) else { return };
    let app = App::start(&place, &display, &["--no-panel", "--record", "run.rec", "--hash", "window.txt"]);
    let read = |name: &str| place.read(name);
    let steps = || read("window.txt").lines().count();
    let go_on = |count: usize| {
        let wanted = steps() + count;
        wait_for("steps", || (steps() > wanted).then_some(()));
    };
    go_on(1);
    app.press(&["g"]);
    let hold = |keys: &[&str], count: usize| {
        keys.iter().for_each(|key| _ = display.xdotool(&["keydown", key]).expect("xdotool holds a key"));
        go_on(count);
        keys.iter().for_each(|key| _ = display.xdotool(&["keyup", key]).expect("xdotool lets a key go"));
    };
    hold(&["Up"], 60);
    hold(&["Up", "Left"], 60);
    hold(&["Down"], 180);
    app.press(&["space", "F5"]);
    let snapshot = app.line();
    // From behind, as `render` sees it; but for the speed at the bottom left.
    let step: u64 = snapshot.trim_start_matches("test_").trim_end_matches(".snapshot").parse().expect("a step");
    let seen_by = |camera: &str| place.rendered(step, &["--from-snapshot", &snapshot, "--camera", camera]);
    let top = |picture: &RgbImage| image::imageops::crop_imm(picture, 0, 0, SIZE.0, SIZE.1 * 2 / 3).to_image();
    let (chase, driver) = (top(&seen_by("chase mine")), top(&seen_by("driver mine")));
    app.wait_for_picture("the vehicle from behind", |seen| top(seen) == chase);
    app.press(&["c"]);
    app.wait_for_picture("what its driver sees", |seen| top(seen) == driver);
    assert_ne!(chase, driver);
    assert_ne!(seen_by("front"), place.rendered(step, &["--camera", "front"]), "it was driven away");
    app.close();
    place.check_replay();
}

#[test]
fn without_a_display_a_picture_is_rendered_and_said_so() {
    let place = place();
    let missing = missing();
    if missing.contains(&"a graphics adapter") {
        return common::skip("no graphics adapter");
    }
    let expect_picture = |mut command: Command| {
        let output = command.args(["run", "test.ron", "--size", &size()]).output().expect("relief starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{errors}");
        assert!(errors.contains("no window") && !errors.contains("panicked"), "{errors}");
        let folder = place.path().join("relief-frames");
        assert!(folder.join("color_00000.png").exists());
        fs::remove_dir_all(folder).expect("a folder");
    };
    expect_picture(place.relief());
    let mut nobody_there = place.relief();
    nobody_there.env("DISPLAY", ":9999");
    expect_picture(nobody_there);

    // A library that is opened only when the window is: a file that is none stands in for one that is missing.
    let Some(display) = Display::start(place.path()).filter(|_| cfg!(target_os = "linux")) else { return };
    let libraries = place.path().join("libraries");
    fs::create_dir(&libraries).expect("a folder");
    for name in ["libxkbcommon-x11.so.0", "libxkbcommon-x11.so"] {
        fs::write(libraries.join(name), b"").expect("a file");
    }
    let mut no_library = place.relief();
    no_library.env("DISPLAY", &display.name).env("LD_LIBRARY_PATH", &libraries);
    expect_picture(no_library);
}
