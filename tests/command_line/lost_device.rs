//! Devices that are lost, and adapters without memory: an error and no panic; another device draws the same; what was
//! written stays, and a run goes on where it ended.

use crate::common::{self, headless, prelude::*, text};
use relief::frames::{FrameError, Headless};
use relief::renderer::RenderError;
use std::process::{Command, Output};
use systems::run::state_hash;

const SCENE: &str = r#"(
    clock: (step_seconds: 0.1),
    materials: { "painted": (base_map: "paint.png", normal_map: "bumps.png") },
    meshes: { "ball": sphere(radius: 1), "floor": plane(size: (6, 6)) },
    entities: [
        (mesh: "floor", material: "painted"),
        (spin: (degrees_per_second: 70), children: [
            (mesh: "ball", material: "painted", transform: (translation: (1, 1, 0))),
            (light: point(intensity: 9, range: 9), transform: (translation: (0, 3, 1))),
        ]),
        (name: "front", camera: (), transform: (translation: (0, 3, 6), look_at: (0, 0, 0))),
    ],
)"#;
const SIZE: (u32, u32) = (64, 36);

/// A folder with the scene and its textures.
fn place() -> Folder {
    let place = common::scene_folder(SCENE);
    place.paint(4);
    let bumps = image::RgbImage::from_fn(16, 16, |x, _| image::Rgb([100 + x as u8 * 4, 128, 240]));
    bumps.save(place.at("bumps.png")).expect("a texture");
    place
}

fn options() -> LoadOptions {
    LoadOptions { cache: false, ..LoadOptions::for_one_renderer() }
}

impl Folder {
    fn paint(&self, side: u32) {
        let paint = image::RgbImage::from_fn(side, side, |x, y| image::Rgb([x as u8 * 60, y as u8 * 60, 90]));
        paint.save(self.at("paint.png")).expect("a texture");
    }

    fn stage(&self) -> Session {
        Session::load(&self.at("scene.ron"), &options()).expect("a scene")
    }

    /// Runs the program, whose device is lost after so many checks.
    fn losing_after(&self, checks: Option<u32>, args: &[&str]) -> Output {
        let mut command = common::command(args, self.path());
        // The validation layer of debug builds talks to the log.
        command.arg("--no-cache").env("RUST_LOG", "off");
        command.envs(checks.map(|checks| ("RELIEF_LOSE_DEVICE", checks.to_string())));
        command.output().expect("the binary runs")
    }

    fn frames(&self, folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let folder = self.at(folder);
        if folder.exists() { common::files(&folder).into_iter().collect() } else { Vec::new() }
    }
}

fn draw(headless: &mut Headless, stage: &mut Session) -> Result<image::RgbaImage, FrameError> {
    headless.draw(&mut stage.simulation, stage.viewpoint, SIZE)
}

#[test]
fn another_device_draws_the_same_after_texels_were_read_again() {
    let (Some(gpu), Some(other)) = (common::gpu(), common::gpu()) else { return };
    let place = place();
    let mut stage = place.stage();
    let mut first = headless(&gpu);
    (0..3).for_each(|_| stage.simulation.step());
    let seen = draw(&mut first, &mut stage).expect("a picture");
    let state = state_hash::hash(&mut stage.simulation.world);

    gpu.device.destroy();
    for _ in 0..2 {
        let error = draw(&mut first, &mut stage).expect_err("the device is gone");
        assert!(matches!(error, FrameError::Render(RenderError::Lost { .. })), "{error}");
    }
    drop((first, gpu));

    let mut second = headless(&other);
    let error = draw(&mut second, &mut stage).expect_err("the lost device had the texels");
    assert!(matches!(error, FrameError::Render(RenderError::NoTexels { .. })), "{error}");
    let mut second = headless(&other);
    stage.restore_texels().expect("as they were");
    assert!(draw(&mut second, &mut stage).expect("a picture") == seen, "the same picture");
    assert_eq!(state_hash::hash(&mut stage.simulation.world), state, "the simulation has noticed nothing");
    assert!(stage.simulation.library().lacks_texels(), "they are not held twice");
}

#[test]
fn texels_of_files_that_have_changed_are_refused_by_name() {
    let Some(gpu) = common::gpu() else { return };
    let place = place();
    let mut stage = place.stage();
    draw(&mut headless(&gpu), &mut stage).expect("a picture");
    place.paint(3);
    let changed = stage.restore_texels();
    assert!(changed.expect_err("another size").to_string().contains("image \"paint\" has changed"));
    fs::remove_file(place.at("paint.png")).expect("it is there");
    let missing = stage.restore_texels();
    assert!(missing.expect_err("no file").to_string().contains("paint.png"));
}

/// Faults while nothing waits for them are errors of the next call, and no panic of wgpu's.
#[test]
fn a_fault_outside_of_preparing_is_told() {
    let Some(gpu) = common::gpu() else { return };
    gpu.check().expect("nothing happened");
    let label = Some("no buffer has two such uses");
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::MAP_WRITE;
    let _ = gpu.device.create_buffer(&wgpu::BufferDescriptor { label, size: 16, usage, mapped_at_creation: false });
    assert!(matches!(gpu.check(), Err(RenderError::Refused { .. })));
    gpu.check().expect("told already");
}

#[test]
fn rendering_ends_with_one_error_and_goes_on_when_resumed() {
    let Some(place) = with_gpu(place) else { return };
    let render = |folder: &str, more: &[&str], checks| {
        let args = ["render", "scene.ron", "--frames", "6", "--size", "64x36", "-o", folder];
        place.losing_after(checks, &[&args, more].concat())
    };
    assert!(render("whole", &[], None).status.success());
    let whole = place.frames("whole");
    assert_eq!(whole.len(), 6);
    // A frame is checked before it is drawn, and before it is written.
    for (checks, written) in [(1, 0), (6, 2), (7, 3)] {
        let folder = format!("lost after {checks}");
        let output = render(&folder, &[], Some(checks));
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert_eq!(errors, "error: the graphics device was lost: it was destroyed\n");
        assert!(place.frames(&folder) == whole[..written], "{checks}: whole frames only");
        assert!(render(&folder, &["--resume"], None).status.success());
        assert!(place.frames(&folder) == whole, "{checks}: resumed");
    }
}

/// A driver on the processor takes its memory from the process, whose address space can be limited.
#[cfg(target_os = "linux")]
#[test]
fn an_adapter_without_memory_is_an_error() {
    let Some(gpu) = common::gpu() else { return };
    if gpu.adapter.get_info().device_type != wgpu::DeviceType::Cpu {
        return common::skip_always("the adapter has memory of its own");
    }
    let place = place();
    // Linear colours of so many samples take 8 GiB; the program itself, with its threads, takes much less than 6.
    let limited = r#"ulimit -v 6291456; exec "$0" render scene.ron -o out --size 16384x16384 --no-cache"#;
    let mut command = Command::new("sh");
    command.args(["-c", limited, env!("CARGO_BIN_EXE_relief")]).current_dir(place.path()).env("RUST_LOG", "off");
    let output = command.output().expect("sh runs");
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    assert_eq!(errors.lines().count(), 1, "one error: {errors}");
    let expected = "error: out of memory for a picture of 16384x16384 pixels with 4 samples each";
    assert!(errors.starts_with(expected), "{errors}");
    assert!(place.frames("out").is_empty());
}
