//! Cost of a step of many environments. Worlds of one scene are stepped and captured together, as learners use them.
//! Each is stepped as often as its sensors are due, then all cameras are drawn in one submission.
//!
//! `cargo bench --bench worlds -- SCENE --worlds 64` prints a line of JSON for each round: milliseconds of processor
//! time of all threads and of wall clock per environment step, and how much of these the steps of the simulation and
//! the captures take. `made_ms` is what it takes to make a world.

use clap::Parser;
use cpu_time::ProcessTime;
use relief::renderer::{Gpu, Settings};
use relief::scene::Template;
use relief::sense::{Captured, Drawing, Wanted, WorldSensors};
use serde_json::json;
use std::error::Error;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use systems::Simulation;
use systems::ecs::parallel::in_parallel;

#[derive(Parser)]
#[command(about = "Measures worlds that are captured together")]
struct Args {
    /// A scene with sensors
    scene: PathBuf,
    /// Number of worlds of it
    #[arg(long, default_value_t = 64)]
    worlds: usize,
    /// Steps of the simulation from capture to capture
    #[arg(long, default_value_t = 6)]
    steps: u32,
    /// Least duration of a round
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
    /// Lines of figures
    #[arg(long, default_value_t = 3)]
    rounds: u32,
}

/// Processor time and wall clock of all that it measured.
#[derive(Default)]
struct Spent {
    cpu: Duration,
    wall: Duration,
}

impl Spent {
    fn measure<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        let made = work();
        self.cpu += cpu.elapsed();
        self.wall += wall.elapsed();
        made
    }

    fn each(&self, count: f64) -> serde_json::Value {
        let ms = |time: Duration| time.as_secs_f64() * 1e3 / count;
        json!({ "cpu_ms": ms(self.cpu), "wall_ms": ms(self.wall) })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // `cargo bench` adds an argument of its own.
    let args = Args::parse_from(std::env::args().filter(|argument| argument != "--bench"));
    let gpu = Gpu::headless()?;
    let template = Template::load(&args.scene)?;
    let seeds = 0..args.worlds as u64;
    let make = |seed| (WorldSensors::default(), template.instantiate(Some(seed)).0);
    let mut making = Spent::default();
    let mut worlds: Vec<(WorldSensors, Simulation)> = making.measure(|| seeds.map(make).collect());
    let mut drawing = Drawing::of_many(Some(&gpu));
    for round in 0..=args.rounds {
        let (mut stepping, mut capturing, mut count) = (Spent::default(), Spent::default(), 0.0);
        while stepping.wall + capturing.wall < Duration::from_secs_f64(if round == 0 { 1.0 } else { args.seconds }) {
            stepping.measure(|| {
                in_parallel(worlds.iter_mut(), |(_, world)| (0..args.steps).for_each(|_| world.step()));
            });
            let all = |_: &str| true;
            let asked = |(sensors, world)| -> Captured<'_> { (world, sensors, Wanted::Due(&all)) };
            let mut asked: Vec<_> = worlds.iter_mut().map(|(sensors, world)| asked((sensors, world))).collect();
            let captures = capturing.measure(|| drawing.capture(&Settings::default(), &mut asked))?;
            black_box(&captures);
            count += args.worlds as f64;
        }
        if round > 0 {
            let wall = (stepping.wall + capturing.wall).as_secs_f64();
            let line = json!({
                "worlds": args.worlds, "stepping": stepping.each(count), "capturing": capturing.each(count),
                "steps_per_second": count / wall, "made_ms": making.each(args.worlds as f64)["wall_ms"],
            });
            println!("{line}");
        }
    }
    Ok(())
}
