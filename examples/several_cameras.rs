//! The cameras of a scene in one frame: what they share is uploaded once, and each keeps what belongs to it.
//!
//! `cargo run --release --example several_cameras [SCENE [FOLDER]]` writes a picture for each of the first four
//! cameras, and tells how long a frame of all takes, and one of each.

use relief::demo;
use relief::renderer::{
    Gpu, PICTURE_FORMAT, Renderer, Settings, ViewPlan, ViewState, ViewTarget, picture_texture, read_texture,
};
use relief::session::{LoadOptions, Session};
use relief::viewpoint::Viewpoint;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

const SIZE: (u32, u32) = (640, 360);
const FRAMES: u32 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().map_or_else(|| demo::shipped("assets/scenes/fleet.ron"), PathBuf::from);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| ".".into()));
    let mut stage = Session::load(&scene, &LoadOptions::for_one_renderer())?;
    let cameras: Vec<_> = stage.scene.cameras.iter().take(4).cloned().collect();

    let gpu = Gpu::headless()?;
    let mut renderer = Renderer::new(&gpu);
    let mut states: Vec<_> = cameras.iter().map(|_| ViewState::new(&gpu)).collect();
    let pictures: Vec<_> = cameras.iter().map(|_| picture_texture(&gpu, SIZE)).collect();
    let targets: Vec<_> = pictures.iter().map(|picture| picture.create_view(&Default::default())).collect();

    // A step of the simulation and a frame of some of the cameras, until the GPU is idle; milliseconds.
    let mut draw = |some: std::ops::Range<usize>| -> Result<f64, Box<dyn Error>> {
        let begun = Instant::now();
        stage.simulation.step();
        stage.simulation.frame();
        let plan = |camera: usize| ViewPlan {
            view: Viewpoint::Camera(cameras[camera].1).view(&stage.simulation.world, SIZE),
            settings: Settings::default(),
        };
        let mut views: Vec<_> = states[some.clone()].iter_mut().zip(some.clone().map(plan)).collect();
        stage.simulation.with_frame(|frame| renderer.prepare(frame, &mut views))?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut views: Vec<_> = states[some.clone()]
            .iter_mut()
            .zip(&targets[some])
            .map(|(state, target)| ViewTarget::new(state, target, PICTURE_FORMAT))
            .collect();
        renderer.encode(&mut encoder, &mut views);
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(begun.elapsed().as_secs_f64() * 1e3)
    };

    let all = 0..cameras.len();
    println!("first frame of {} cameras: {:.0} ms", cameras.len(), draw(all.clone())?);
    let (mut together, mut apart) = (0.0, 0.0);
    for _ in 0..FRAMES {
        together += draw(all.clone())?;
        for camera in all.clone() {
            apart += draw(camera..camera + 1)?;
        }
    }
    let mean = |sum: f64| sum / f64::from(FRAMES);
    println!("a frame of all: {:.1} ms; frames of each: {:.1} ms together", mean(together), mean(apart));
    for ((name, _), picture) in cameras.iter().zip(&pictures) {
        let texels = read_texture(&gpu, picture);
        let picture = image::RgbaImage::from_raw(SIZE.0, SIZE.1, texels).ok_or("a picture of another size")?;
        picture.save(folder.join(format!("{name}.png")))?;
    }
    gpu.check()?;
    Ok(())
}
