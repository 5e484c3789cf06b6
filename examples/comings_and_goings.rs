//! A run in which lamps and vehicles come and go, as a recording and without a window: `scripts/soak` compares it with
//! the same run in a window.
//!
//! `cargo run --release --example comings_and_goings -- SCENE MINUTES FOLDER` writes `FOLDER/run.rec`, then takes its
//! steps, draws a picture for each simulated second, and writes the state's hash after each step to
//! `FOLDER/headless.txt`.

use relief::frames::Headless;
use relief::prelude::*;
use relief::recording::{Recorder, RunFiles};
use relief::session::{LoadOptions, Session};
use relief::systems::ecs::clock::Clock;
use relief::systems::run::inputs;
use relief::systems::run::inputs::{Inputs, SavedInput};
use relief::systems::run::registry::{EntityRegistry, StateId};
use relief::systems::run::spawn::Spawn;
use relief::systems::run::standard_inputs::Despawn;
use relief::systems::vehicles::Controls;
use std::collections::VecDeque;
use std::error::Error;
use std::path::{Path, PathBuf};

/// So many of each there are at once; then the oldest goes.
const LAMPS: usize = 40;
const VEHICLES: usize = 12;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, minutes, folder] = arguments.as_slice() else {
        return Err("expected SCENE MINUTES FOLDER".into());
    };
    let (scene, folder) = (PathBuf::from(scene), PathBuf::from(folder));
    let recording = folder.join("run.rec");
    let steps = record(&scene, &recording, minutes.parse::<f64>()? * 60.0)?;
    println!("recorded {steps} steps");
    replay(&scene, &recording, &folder.join("headless.txt"))
}

fn load(scene: &Path) -> Result<Session, Box<dyn Error>> {
    Ok(Session::load(scene, &LoadOptions::for_one_renderer())?)
}

/// Writes what comes from outside at which step. No step is taken: where things are does not matter to it.
fn record(scene: &Path, recording: &Path, seconds: f64) -> Result<u64, Box<dyn Error>> {
    let mut session = load(scene)?;
    let mut recorder = Recorder::create(recording, session.identity()?, &mut session.simulation)?;
    let world = &mut session.simulation.world;
    let second = (1.0 / world.resource::<Clock>().step_seconds).round().max(1.0) as u64;
    let kinds: Vec<String> = world.resource::<VehicleTypes>().iter().map(|(_, kind)| kind.name.clone()).collect();
    let (mut lamps, mut vehicles) = (VecDeque::new(), VecDeque::new());
    let steps = (seconds.max(1.0) as u64) * second;
    for number in 0..steps / second {
        let mut applied = Vec::new();
        let mut apply = |world: &mut World, input: SavedInput| {
            // Numbers ascend; what came last is there.
            let next = world.resource::<EntityRegistry>().iter().last().map_or(0, |(id, _)| id.0 + 1);
            world.resource_mut::<Inputs>().push_saved(input);
            applied.extend(inputs::apply_queued(world));
            StateId(next)
        };
        let (name, light) = (format!("passing {number}"), Light::point(6.0, 12.0));
        // A golden angle apart, at most 90 m from the middle.
        let (angle, radius) = (number as f32 * 2.399_963, (number % 90) as f32);
        let transform = Transform::from_xyz(radius * angle.cos(), 3.0, radius * angle.sin());
        let lamp = Spawn::Light { name: name.clone(), transform, light };
        lamps.push_back(apply(world, SavedInput::of(&lamp)));
        if lamps.len() > LAMPS {
            lamps.pop_front().map(|oldest| apply(world, SavedInput::of(&Despawn(oldest))));
        }
        if number % 2 == 0 {
            let kind = kinds[number as usize % kinds.len()].clone();
            let controls = Controls { throttle: 0.3, steer: 0.4, ..Controls::default() };
            let transform = Transform { translation: transform.translation.with_y(0.0), ..transform };
            let paint = number as u32;
            let vehicle = Spawn::Vehicle { name, transform, kind, paint, controls, manual: true };
            vehicles.push_back(apply(world, SavedInput::of(&vehicle)));
        }
        if vehicles.len() > VEHICLES {
            vehicles.pop_front().map(|oldest| apply(world, SavedInput::of(&Despawn(oldest))));
        }
        recorder.inputs(number * second, applied)?;
    }
    // The run goes on to here.
    recorder.inputs(steps, Vec::new())?;
    Ok(steps)
}

/// Takes the steps, draws a picture for each simulated second and tells how much memory that takes.
fn replay(scene: &Path, recording: &Path, hashes: &Path) -> Result<(), Box<dyn Error>> {
    let mut session = load(scene)?;
    let (hash, replay) = (Some(hashes.to_owned()), Some(recording.to_owned()));
    let files = RunFiles { hash, replay, ..RunFiles::default() };
    session.begin(&files, 0)?;
    let mut headless = Headless::new()?;
    let second = (1.0 / session.simulation.world.resource::<Clock>().step_seconds).round().max(1.0) as u64;
    while session.play()? {
        let step = session.step_number();
        if step.is_multiple_of(second) {
            headless.draw(&mut session.simulation, session.viewpoint, (320, 180))?;
        }
        if step.is_multiple_of(60 * second) {
            println!("minute {}: {}", step / second / 60, resident().unwrap_or_default());
        }
    }
    Ok(session.finish()?)
}

/// Resident memory, as Linux tells it (VmRSS in proc(5)).
fn resident() -> Option<String> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    Some(status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().to_owned())
}
