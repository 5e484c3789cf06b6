//! Films of frames: colours, times, and targets that cannot be written.

use crate::common::{self, assert_fails, prelude::*, text};
use std::process::{Command, Output};

/// One colour all over, in frames of some seconds.
fn scene(step_seconds: f64) -> String {
    format!(
        r#"(
    environment: (tone_map: clamp),
    clock: (step_seconds: {step_seconds:?}),
    materials: {{ "one": (shading: unlit, base_factor: (1, 0.1, 0)) }},
    meshes: {{ "wall": plane(size: (100, 100)) }},
    entities: [
        (mesh: "wall", material: "one"),
        (camera: (orthographic_half_height: 1), transform: (translation: (0, 5, 0), rotation_degrees: (-90, 0, 0))),
    ],
)"#
    )
}

fn scene_folder() -> common::Folder {
    common::scene_folder(&scene(1.0 / 60.0))
}

/// Renders a film of the scene into `out` and a name.
fn film(folder: &Path, frames: &str, name: &str) -> Output {
    let args = ["render", "scene.ron", "-o", "out", "--size", "65x37", "--resume", "--frames", frames, "--video", name];
    // What a validation layer says in builds for tests is not what is tested.
    let quiet = [("WGPU_VALIDATION", "0"), ("WGPU_DEBUG", "0")];
    common::command(&args, folder).envs(quiet).output().expect("the binary runs")
}

/// Names of unfinished files.
fn unfinished(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).expect("a folder").flatten().map(|entry| PathBuf::from(entry.file_name()));
    files.filter(|name| name.to_string_lossy().contains("part")).collect()
}

/// Values of fields of a film's only stream, by ffprobe.
fn probe(film: &Path, fields: &str) -> Vec<String> {
    let entries = format!("stream={fields}");
    let mut command = Command::new("ffprobe");
    command.args(["-loglevel", "error", "-of", "default=noprint_wrappers=1:nokey=1", "-show_entries", &entries]);
    let output = command.arg(film).output().expect("ffprobe runs");
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stdout).lines().map(str::to_owned).collect()
}

#[test]
fn a_film_is_made_with_ffmpeg_and_without_it_an_animated_picture() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let without = |out: &str, name: &str| {
        let args = ["render", "scene.ron", "-o", out, "--frames", "3", "--size", "65x37", "--video", name];
        common::command(&args, folder.path()).env("PATH", "").output().expect("the binary runs")
    };
    let output = without("out", "film.mp4");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = text(&output.stderr);
    assert!(said.contains("film.mp4") && said.contains("writing film.apng instead"), "{said}");
    assert!(text(&output.stdout).contains("film.apng"), "{}", text(&output.stdout));
    assert!(!folder.path().join("film.mp4").exists());
    let frames = image::codecs::png::PngDecoder::new(std::io::Cursor::new(
        fs::read(folder.path().join("film.apng")).expect("an animation"),
    ));
    assert!(frames.and_then(|decoder| decoder.is_apng()).expect("a PNG"));
    // A name that is none of a film is refused all the same.
    for name in ["film.xyz", "film.jpg", "film"] {
        assert_fails(&without("none", name), 2, &[name, "unsupported video format", ".mp4", "cannot run ffmpeg"]);
        assert!(!folder.path().join("none").exists(), "said before rendering");
    }

    let run = |name: &str| film(folder.path(), "3", name);
    assert!(run("film.gif").status.success());
    assert!(fs::read(folder.path().join("film.gif")).expect("an animation").starts_with(b"GIF89a"));
    fs::remove_dir_all(folder.path().join("out")).expect("frames");
    assert_fails(&run("no/film.mp4"), 2, &["no/film.mp4: no such directory: no"]);
    assert!(!folder.path().join("out").exists(), "said before rendering");
    assert_eq!(unfinished(folder.path()), [] as [PathBuf; 0]);
    if !common::has_ffmpeg() {
        return;
    }
    for name in ["film.xyz", "film.jpg", "film"] {
        let output = run(name);
        assert_fails(&output, 2, &[name, ".mp4", ".apng"]);
        assert!(!String::from_utf8_lossy(&output.stderr).contains(".part-"), "its temporary name is not told");
    }
    assert!(!folder.path().join("out").exists(), "said before rendering");
    assert_eq!(unfinished(folder.path()), [] as [PathBuf; 0]);
    assert!(run("film.mp4").status.success());
    assert_eq!(&fs::read(folder.path().join("film.mp4")).expect("a film")[4..8], b"ftyp");
    assert_eq!(unfinished(folder.path()), [] as [PathBuf; 0]);
}

#[test]
fn a_film_has_the_colours_of_its_frames_and_says_in_which_space() {
    if common::gpu().is_none() || !common::has_ffmpeg() {
        return;
    }
    let folder = scene_folder();
    for name in ["film.mp4", "film.mkv", "film.webm"] {
        let output = film(folder.path(), "3", name);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let path = folder.path().join(name);
        assert_eq!(
            probe(&path, "color_range,color_space,color_transfer,color_primaries"),
            ["tv", "bt709", "bt709", "bt709"]
        );
        let frame = image::open(folder.path().join("out/color_00000.png")).expect("a frame").into_rgb8();
        let [r, g, b] = frame.get_pixel(32, 18).0.map(|value| f64::from(value) / 255.0);
        assert!(r == 1.0 && (0.2..0.5).contains(&g) && b == 0.0, "{r} {g} {b}");
        // ITU-R BT.709, tables 3 and 4.
        let luma = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let (blue, red) = ((b - luma) / 1.8556, (r - luma) / 1.5748);
        let expected = [16.0 + 219.0 * luma, 128.0 + 224.0 * blue, 128.0 + 224.0 * red];
        let mut command = Command::new("ffmpeg");
        command.args(["-loglevel", "error", "-i", name, "-frames:v", "1"]);
        command.args(["-f", "rawvideo", "-pix_fmt", "yuv420p", "-"]);
        let planes = command.current_dir(folder.path()).output().expect("ffmpeg runs").stdout;
        // Even sides: 66 by 38.
        assert_eq!(planes.len(), 66 * 38 * 3 / 2);
        let quarter = 33 * 19;
        let found =
            [18 * 66 + 32, 66 * 38 + 9 * 33 + 16, 66 * 38 + quarter + 9 * 33 + 16].map(|at| f64::from(planes[at]));
        // One for the rounding of the values, and two for the encoders', whose steps at such qualities are a few values
        // on an even picture. By BT.601 luma would be 13 more: 0.299 of red rather than 0.2126, 0.587 of green.
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() <= 3.0, "{name}: {found} for {expected:.1}");
        }
    }
}

#[test]
fn a_film_lasts_as_long_as_its_steps() {
    if common::gpu().is_none() || !common::has_ffmpeg() {
        return;
    }
    let folder = scene_folder();
    for (step, rate, seconds) in [
        (1.0 / 60.0, "60/1", 0.1),
        (1.0 / 144.0, "144/1", 6.0 / 144.0),
        (1001.0 / 30_000.0, "30000/1001", 0.2002),
        (0.0004, "2500/1", 0.0024),
        (100.0, "1/100", 600.0),
    ] {
        fs::write(folder.path().join("scene.ron"), scene(step)).expect("a scene");
        let output = film(folder.path(), "6", "film.mp4");
        assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
        let found = probe(&folder.path().join("film.mp4"), "r_frame_rate,duration");
        assert_eq!(found[0], rate);
        // A container counts parts of a second that a frame has a whole number of; ffprobe prints six decimals.
        let duration: f64 = found[1].parse().expect("seconds");
        assert!((duration - seconds).abs() < 1e-6, "{step}: {duration} for {seconds}");
    }
    let output = film(folder.path(), "6", "film.gif");
    assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
    fs::write(folder.path().join("scene.ron"), scene(0.0004)).expect("a scene");
    for (name, said) in [
        ("film.gif", "film.gif: 5 of 6 frames are dropped: a GIF shows a frame for at least 2/100 s"),
        (
            "film.apng",
            "film.apng: browsers show frames of 0.01 s and less for longer; frames of this film last 1/2500 s",
        ),
        ("film.mkv", "film.mkv: this format counts milliseconds: frames of 1/2500 s are merged"),
    ] {
        let output = film(folder.path(), "6", name);
        assert!(output.status.success() && text(&output.stderr).contains(said), "{}", text(&output.stderr));
    }
}

#[test]
fn a_film_that_cannot_be_written_is_refused_before_the_first_frame() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    for name in ["taken.apng", "taken.mp4", "taken.gif"] {
        fs::create_dir(folder.path().join(name)).expect("a folder");
        assert_fails(&film(folder.path(), "3", name), 2, &[name, "is a directory; expected a file name"]);
    }
    #[cfg(target_os = "linux")]
    for (name, said) in [
        ("/dev/null", "not a regular file"),
        ("/dev/full", "not a regular file"),
        ("/proc/film.mp4", "files cannot be created in this directory"),
        ("/proc/film.apng", "files cannot be created in this directory"),
    ] {
        let output = film(folder.path(), "3", name);
        assert_fails(&output, 2, &[name, said]);
        assert_eq!(text(&output.stderr).lines().count(), 1, "{}", text(&output.stderr));
    }
    #[cfg(unix)]
    for name in ["link.apng", "link.mp4"] {
        std::os::unix::fs::symlink("/nonexistent/disk", folder.path().join(name)).expect("a link");
        let missing = "broken symbolic link: /nonexistent/disk does not exist";
        assert_fails(&film(folder.path(), "3", name), 2, &[name, missing]);
    }
    assert!(!folder.path().join("out").exists(), "said before rendering");
}

/// Runs as a user who may not write there; root may write anywhere.
#[test]
#[cfg(target_os = "linux")]
fn a_film_in_a_folder_of_others_is_refused_before_the_first_frame() {
    use std::os::unix::fs::PermissionsExt;
    let nobody = ["--reuid=65534", "--regid=65534", "--clear-groups"];
    let is_root = Command::new("setpriv").args(nobody).arg("true").output().is_ok_and(|output| output.status.success());
    let Some(_) = common::gpu() else { return };
    if !is_root {
        return common::skip("only root can become another user, with setpriv");
    }
    let folder = scene_folder();
    let (all, others) = (folder.path().to_owned(), folder.path().join("others"));
    fs::create_dir(&others).expect("a folder");
    for (path, mode) in [(&all, 0o777), (&others, 0o555)] {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).expect("permissions");
    }
    // Where the program was built nobody else may go.
    let program = all.join("relief");
    fs::copy(env!("CARGO_BIN_EXE_relief"), &program).expect("a copy");
    for name in ["others/film.apng", "others/film.gif", "others/film.mp4"] {
        let mut command = Command::new("setpriv");
        command.args(nobody).arg(&program).args(["render", "scene.ron", "-o", "out", "--no-cache", "--video", name]);
        let output = command.current_dir(&all).output().expect("setpriv runs");
        assert_fails(&output, 1, &[name, "Permission denied"]);
        assert!(!all.join("out").exists(), "said before rendering");
    }
}
