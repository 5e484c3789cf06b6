//! Cost of pictures of camera sensors. They see boxes on a ground plane under a sun without shadows, from N places at a
//! time. `benches/sensors` draws the same pictures with other programs.
//!
//! `cargo bench --bench sensors -- --boxes 50 --size 84 --views 64 --mode color+depth+instance` prints a line of JSON
//! for each round: milliseconds of processor time of all threads, which other programs hardly lengthen, and of wall
//! clock, per observation, which is all that one camera gives. Every capture draws all cameras anew; nothing moves.
//!
//! `-- --scene benches/sensors/vans.ron` has one camera on a scene's entity "ego" instead, and the clock takes a step
//! before each capture: everything moves. Milliseconds of the steps are told apart.
//!
//! `-- --write DIR` measures nothing. It writes what is drawn, from which other programs build the same scene, and the
//! depth and the things in each picture, with which theirs are compared; `benches/sensors/README.md` has the files.
//!
//! `-- --soak` makes and drops 3,000 sensors and captures 5,000 times, and prints how much memory the process holds.
//! It fails where that is not flat.

use clap::Parser;
use cpu_time::ProcessTime;
use glam::Mat4;
use relief::export::array::{Array, Values};
use relief::export::npy;
use relief::output::{OutputError, write_whole_with};
use relief::prelude::*;
use relief::renderer::Gpu;
use relief::sense::{CameraCapture, SensorSuite};
use relief::tools::bench::memory_mb;
use serde_json::json;
use std::collections::HashMap;
use std::error::Error;
use std::hint::black_box;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use systems::run::registry::register_all;
use systems::sensors::philox::{Noise, uniform};
use systems::sensors::{Beams, CameraOutput, CameraOutputs, CameraSensor, Lens, LidarSensor, Sensor};

/// Width, height and length of a box, metres.
const BOX: Vec3 = Vec3::new(1.8, 1.5, 4.0);
/// Side of the ground, a square around the origin, metres.
const GROUND: f32 = 240.0;
/// Height of the cameras above the ground, metres.
const EYE: f32 = 1.6;
const FOV_Y_DEGREES: f32 = 60.0;
const NEAR: f32 = 0.1;
/// Far plane of programs that have one, metres; beyond the ground.
const FAR: f32 = 400.0;
/// Linear RGB of the ground, of the sky and of the light that reaches all sides.
const GROUND_COLOR: Vec3 = Vec3::splat(0.5);
const SKY_COLOR: Vec3 = Vec3::new(0.3, 0.4, 0.6);
const AMBIENT: Vec3 = Vec3::splat(0.3);
const SEED: u64 = 1;
/// Captures before the first round.
const WARM_UP: u32 = 5;

#[derive(Parser)]
#[command(about = "Measures camera sensors")]
struct Args {
    /// Boxes on the ground
    #[arg(long, default_value_t = 50)]
    boxes: u32,
    /// Width and height of a picture, pixels
    #[arg(long, default_value_t = 84, value_parser = clap::value_parser!(u32).range(1..=4096))]
    size: u32,
    /// Cameras that are captured together
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=4096))]
    views: u32,
    /// Outputs of each camera
    #[arg(long, default_value = "color+depth+instance", value_parser = parse_outputs)]
    mode: CameraOutputs,
    /// Least duration of a round
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
    /// Lines of figures
    #[arg(long, default_value_t = 3)]
    rounds: u32,
    /// Write the scene and its pictures into this directory, and measure nothing
    #[arg(long, value_name = "DIR", conflicts_with = "soak")]
    write: Option<PathBuf>,
    /// Scene with an entity "ego", which gets the camera
    #[arg(long, value_name = "FILE", conflicts_with_all = ["write", "soak", "boxes"])]
    scene: Option<PathBuf>,
    /// Samples per pixel: 1 or 4
    #[arg(long, default_value_t = 1)]
    samples: u32,
    /// Make and drop sensors, and watch the memory
    #[arg(long)]
    soak: bool,
}

/// Names of outputs with "+" between them.
fn parse_outputs(text: &str) -> Result<CameraOutputs, String> {
    let output = |name: &str| {
        let found = CameraOutput::ALL.into_iter().find(|(known, _)| *known == name);
        found.map(|(_, output)| output).ok_or_else(|| format!("expected outputs such as color+depth, found {name:?}"))
    };
    text.split('+').map(output).collect()
}

fn outputs_text(outputs: CameraOutputs) -> String {
    outputs.iter().map(|(name, _)| name).collect::<Vec<_>>().join("+")
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    // `cargo bench` adds an argument of its own.
    let args = Args::parse_from(std::env::args().filter(|argument| argument != "--bench"));
    let gpu = Gpu::headless()?;
    if args.soak {
        return soak(&gpu);
    }
    match &args.write {
        Some(folder) => write(&args, &gpu, folder)?,
        None => measure(&args, &gpu)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Layout of the scene. Each number follows from its own place, so that more boxes or views leave those before as they
/// are.
struct Layout {
    /// Middles of the boxes, which have the axes of the scene.
    boxes: Vec<Vec3>,
    /// Linear RGB of the boxes.
    colors: Vec<Vec3>,
    /// Cameras: the first at the origin, the others up to 2 m and 12° away from it.
    views: Vec<Transform>,
}

impl Layout {
    fn new(boxes: u32, views: u32) -> Self {
        let noise = Noise::new(SEED, 0, 0);
        let units = |i: u32, channel: u32| noise.words(i, channel).map(uniform);
        let center = |i: u32| {
            let [x, z, ..] = units(i, 0);
            Vec3::new(60.0 * x - 30.0, BOX.y / 2.0, -5.0 - 75.0 * z)
        };
        let color = |i: u32| {
            let [red, green, blue, _] = units(i, 1);
            Vec3::splat(0.2) + Vec3::new(red, green, blue) * 0.8
        };
        let view = |i: u32| {
            let [x, z, turned, _] = if i == 0 { [0.5, 0.0, 0.5, 0.0] } else { units(i, 2) };
            let turned = Quat::from_rotation_y((24.0 * turned - 12.0).to_radians());
            Transform::from_xyz(4.0 * x - 2.0, EYE, 2.0 * z).with_rotation(turned)
        };
        Self {
            boxes: (0..boxes).map(center).collect(),
            colors: (0..boxes).map(color).collect(),
            views: (0..views).map(view).collect(),
        }
    }

    /// The world with its cameras; the ground, then the boxes.
    fn build(&self, camera: &CameraSensor) -> (Simulation, Vec<Entity>) {
        let mut simulation = Simulation::new();
        let world = &mut simulation.world;
        world.insert_resource(Environment {
            ambient: AMBIENT,
            zenith: SKY_COLOR,
            horizon: SKY_COLOR,
            ground: SKY_COLOR,
            exposure: 1.0,
            tone_map: ToneMap::Clamp,
            ..Environment::default()
        });
        let mut library = world.resource_mut::<Library>();
        let ground = library.add_mesh(shapes::plane(Vec2::splat(GROUND), UVec2::ONE));
        let cube = library.add_mesh(shapes::cube(BOX));
        let mut material = |color: Vec3| {
            let base_factor = color.extend(1.0);
            library.add_material(Material { base_factor, technique: Technique::Off, ..Material::default() })
        };
        let on_ground = material(GROUND_COLOR);
        let paints: Vec<MaterialId> = self.colors.iter().map(|color| material(*color)).collect();
        world.spawn((Light::directional(1.0), Transform::from_rotation(sun())));
        let mut things = vec![world.spawn((ground, on_ground, Transform::IDENTITY)).id()];
        for (center, paint) in self.boxes.iter().zip(paints) {
            things.push(world.spawn((cube, paint, Transform::from_translation(*center))).id());
        }
        for (i, at) in self.views.iter().enumerate() {
            world.spawn((Sensor::camera(camera.clone()), Name::new(format!("{i}")), *at));
        }
        register_all(world);
        (simulation, things)
    }
}

/// It shines along its −Z: from above, from behind the cameras and a little from one side.
fn sun() -> Quat {
    Quat::from_rotation_y(20f32.to_radians()) * Quat::from_rotation_x(-50f32.to_radians())
}

fn camera(size: u32, samples: u32, outputs: CameraOutputs) -> CameraSensor {
    let lens = Lens::FieldOfView { y: FOV_Y_DEGREES.to_radians() };
    CameraSensor { size: (size, size), lens, near: NEAR, outputs, samples, ..CameraSensor::default() }
}

fn measure(args: &Args, gpu: &Gpu) -> Result<(), Box<dyn Error>> {
    let camera = camera(args.size, args.samples, args.mode);
    let (mut simulation, views) = match &args.scene {
        Some(path) => (load(path, &camera)?, 1),
        None => (Layout::new(args.boxes, args.views).build(&camera).0, args.views),
    };
    let moves = args.scene.is_some();
    let mut suite = SensorSuite::new(gpu);
    for _ in 0..WARM_UP {
        if moves {
            simulation.step();
        }
        suite.capture(&mut simulation)?;
    }
    for round in 0..args.rounds {
        let (started, processor) = (Instant::now(), ProcessTime::now());
        let (mut captures, mut stepping) = (0, 0.0);
        while captures == 0 || started.elapsed().as_secs_f64() < args.seconds {
            if moves {
                let processor = ProcessTime::now();
                simulation.step();
                stepping += processor.elapsed().as_secs_f64();
            }
            black_box(suite.capture(&mut simulation)?);
            captures += 1;
        }
        let (wall, processor) = (started.elapsed().as_secs_f64(), processor.elapsed().as_secs_f64());
        let observations = captures * views;
        let each = |seconds: f64| 1e3 * seconds / f64::from(observations);
        let figures = json!({
            "program": "relief",
            "version": env!("CARGO_PKG_VERSION"),
            "device": gpu.name(),
            "scene": args.scene,
            "boxes": args.boxes,
            "size": args.size,
            "samples": args.samples,
            "views": views,
            "mode": outputs_text(args.mode),
            "round": round,
            "observations": observations,
            "cpu_ms": each(processor - stepping),
            "step_cpu_ms": each(stepping),
            "wall_ms": each(wall),
        });
        println!("{figures}");
    }
    Ok(())
}

/// A scene whose entity "ego" carries the camera.
fn load(path: &Path, camera: &CameraSensor) -> Result<Simulation, Box<dyn Error>> {
    let mut simulation = Simulation::new();
    relief::scene::load(path, &mut simulation)?;
    let mut named = simulation.world.query::<(Entity, &Name)>();
    let ego = named.iter(&simulation.world).find(|(_, name)| name.as_str() == "ego").map(|(entity, _)| entity);
    let ego = ego.ok_or_else(|| format!("{}: expected an entity named \"ego\"", path.display()))?;
    let ahead = Transform::from_xyz(0.0, EYE, 3.5).with_rotation(Quat::from_rotation_y(std::f32::consts::PI));
    simulation.world.spawn((Sensor::camera(camera.clone()), Name::new("camera"), ahead, ChildOf(ego)));
    register_all(&mut simulation.world);
    Ok(simulation)
}

/// The scene for other programs, and its pictures.
fn write(args: &Args, gpu: &Gpu, folder: &Path) -> Result<(), Box<dyn Error>> {
    let layout = Layout::new(args.boxes, args.views);
    let outputs = [CameraOutput::Color, CameraOutput::Depth, CameraOutput::Instance].into_iter().collect();
    let (mut simulation, things) = layout.build(&camera(args.size, 1, outputs));
    let capture = SensorSuite::new(gpu).capture(&mut simulation)?;
    let cameras: Vec<&CameraCapture> = capture.sensors.iter().filter_map(|sensor| sensor.camera()).collect();

    std::fs::create_dir_all(folder)?;
    let scene = json!({
        "box_metres": BOX,
        "ground_metres": GROUND,
        "ground_color": GROUND_COLOR,
        "sky_color": SKY_COLOR,
        "ambient": AMBIENT,
        "sun_direction": sun() * Vec3::NEG_Z,
        "fov_y_degrees": FOV_Y_DEGREES,
        "near": NEAR,
        "far": FAR,
        "size": args.size,
    });
    write_whole_with(&folder.join("scene.json"), |file| writeln!(file, "{scene:#}"))?;
    let (boxes, views, size) = (layout.boxes.len(), layout.views.len(), args.size as usize);
    let flat = |vectors: &[Vec3]| vectors.iter().flat_map(|vector| vector.to_array()).collect::<Vec<f32>>();
    write_array(folder, "boxes", &[boxes, 3], &flat(&layout.boxes)[..])?;
    write_array(folder, "colors", &[boxes, 3], &flat(&layout.colors)[..])?;
    // Row by row.
    let matrix = |at: &Transform| Mat4::from_rotation_translation(at.rotation, at.translation).transpose();
    let matrices: Vec<f32> = layout.views.iter().flat_map(|at| matrix(at).to_cols_array()).collect();
    write_array(folder, "views", &[views, 4, 4], &matrices[..])?;

    let color: Vec<u8> = cameras.iter().flat_map(|camera| camera.color.as_flattened()).copied().collect();
    write_array(folder, "relief-color", &[views, size, size, 3], &color[..])?;
    let depth: Vec<f32> = cameras.iter().flat_map(|camera| &camera.depth).copied().collect();
    write_array(folder, "relief-depth", &[views, size, size], &depth[..])?;
    let registry = simulation.world.resource::<EntityRegistry>();
    let number = |thing: &Entity| registry.id(*thing).map(|StateId(id)| id + 1);
    let places: HashMap<u32, i32> =
        things.iter().zip(0..).filter_map(|(thing, place)| Some((number(thing)?, place))).collect();
    let place = |number: &u32| places.get(number).copied().unwrap_or(-1);
    let mask: Vec<i32> = cameras.iter().flat_map(|camera| &camera.instance).map(place).collect();
    write_array(folder, "relief-mask", &[views, size, size], &mask[..])?;
    Ok(())
}

fn write_array<'a>(
    folder: &Path,
    name: &str,
    shape: &[usize],
    values: impl Into<Values<'a>>,
) -> Result<(), OutputError> {
    let values = values.into();
    write_whole_with(&folder.join(format!("{name}.npy")), |file| {
        file.write_all(&npy::encode(&Array { shape, values })?)
    })
}

/// Number of sensors that come and go, and of captures of one that stays.
const MADE_AND_DROPPED: usize = 3_000;
const CAPTURES: usize = 5_000;
/// A reading of the memory once in so many captures.
const READING: usize = 250;
/// Allowed difference of later readings: a fiftieth. Those of the first fifth are of what is still being filled.
const FLAT: f64 = 0.02;

/// Sensors of every kind and several sizes come and go; then one that stays is captured again and again.
fn soak(gpu: &Gpu) -> Result<ExitCode, Box<dyn Error>> {
    let eye = Transform::from_xyz(0.0, EYE, 0.0);
    let (mut simulation, _) = Layout::new(50, 0).build(&CameraSensor::default());
    let mut suite = SensorSuite::new(gpu);
    let came_and_went = watch("made and dropped", MADE_AND_DROPPED, |i| {
        simulation.step();
        let sensor = simulation.world.spawn((kind_of_sensor(i), Name::new(format!("passing {i}")), eye)).id();
        let captured = suite.capture(&mut simulation)?.sensors.len();
        simulation.world.despawn(sensor);
        if captured == 1 { Ok(()) } else { Err(format!("expected 1 sensor in capture {i}, found {captured}").into()) }
    })?;
    simulation.world.spawn((kind_of_sensor(0), Name::new("standing"), eye));
    let stayed = watch("captures", CAPTURES, |_| {
        simulation.step();
        black_box(suite.capture(&mut simulation)?);
        Ok(())
    })?;
    Ok(if came_and_went && stayed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Cameras of three sizes, with everything that they give or colours alone, of one sample and of four; every fourth
/// sensor is a lidar.
fn kind_of_sensor(i: usize) -> Sensor {
    if i % 4 == 3 {
        return Sensor::lidar(LidarSensor { beams: Beams::Vlp16, columns: 360, ..LidarSensor::default() });
    }
    let all: CameraOutputs = CameraOutput::ALL.into_iter().map(|(_, output)| output).collect();
    let outputs = if i.is_multiple_of(2) { all } else { CameraOutputs::default().with(CameraOutput::Color) };
    let size = [(16, 16), (24, 16), (16, 24)][i % 3];
    let samples = [1, 4][i / 4 % 2];
    Sensor::camera(CameraSensor { size, ..camera(16, samples, outputs) })
}

/// Does something so many times and says how much memory the process holds along the way; whether that stayed flat.
fn watch(
    what: &str,
    times: usize,
    mut act: impl FnMut(usize) -> Result<(), Box<dyn Error>>,
) -> Result<bool, Box<dyn Error>> {
    let mut readings = Vec::new();
    for i in 0..times {
        act(i)?;
        if (i + 1).is_multiple_of(READING) {
            let held = memory_mb("VmRSS").ok_or("no VmRSS in /proc/self/status")?;
            println!("{what}: {} of {times}, {held:.1} MB held", i + 1);
            readings.push(held);
        }
    }
    let later = &readings[readings.len().div_ceil(5)..];
    let least = later.iter().copied().fold(f64::INFINITY, f64::min);
    let most = later.iter().copied().fold(0.0, f64::max);
    let apart = most / least - 1.0;
    let verdict = if apart <= FLAT { "flat" } else { "NOT flat" };
    println!("{what}: {verdict}, {least:.1} to {most:.1} MB after the first fifth, {:.2} % apart", 100.0 * apart);
    Ok(apart <= FLAT)
}
