//! State of one's own: balloons, whose component a scene file sets, a system moves and an input changes. It is hashed
//! and saved like all state, so that a run can be recorded and replayed.
//!
//! `cargo run --release --example own_state` writes `own_state.ron` and `own_state.rec`.

use relief::check::check;
use relief::prelude::*;
use relief::recording::RunFiles;
use relief::session::{LoadOptions, Session};
use relief::systems::StepSet;
use relief::systems::run::state_hash::StateHash;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::path::Path;

const SCENE: &str = r#"(
    meshes: { "ball": sphere(radius: 0.4) },
    entities: [(name: "red", mesh: "ball", balloon: (rise: 0.5))],
    generators: [
        (place: grid(counts: (5, 1, 5), spacing: (2, 1, 2)), entity: (mesh: "ball", balloon: (rise: 0.2))),
    ],
)"#;

/// Ascent of an entity, metres per second.
#[derive(Component, Serialize, Deserialize, Clone)]
#[serde(deny_unknown_fields)]
struct Balloon {
    rise: f32,
}

/// A field of entities in scene files.
impl EntityField for Balloon {
    const NAME: &'static str = "balloon";

    fn check(&self) -> Result<(), String> {
        let is_valid = self.rise.abs() <= 10.0;
        is_valid.then_some(()).ok_or_else(|| format!("expected at most 10 m/s, found {}", self.rise))
    }

    fn insert(&self, entity: &mut EntityWorldMut) {
        entity.insert(self.clone());
    }
}

/// Lets the air out of a balloon.
#[derive(Serialize, Deserialize)]
struct Puncture {
    balloon: StateId,
}

impl Input for Puncture {
    const NAME: &'static str = "puncture";

    fn apply(&self, world: &mut World) {
        let Some(entity) = world.resource::<EntityRegistry>().entity(self.balloon) else { return };
        if let Some(mut balloon) = world.get_mut::<Balloon>(entity) {
            balloon.rise = -2.0;
        }
    }
}

fn rise(clock: Res<Clock>, mut balloons: Query<(&Balloon, &mut Transform)>) {
    for (balloon, mut place) in &mut balloons {
        place.translation.y += balloon.rise * clock.step_seconds as f32;
    }
}

/// A simulation that knows balloons.
fn simulation() -> Simulation {
    let mut simulation = Simulation::new();
    simulation.step_schedule.add_systems(rise.after(StepSet::Motion).before(StepSet::Drive));
    let world = &mut simulation.world;
    world.resource_mut::<StateList>().add_component::<Balloon>("balloon");
    world.resource_mut::<Inputs>().register::<Puncture>();
    world.init_resource::<SceneFields>();
    world.resource_mut::<SceneFields>().register::<Balloon>();
    simulation
}

/// Takes a hundred steps of the scene, in which the red balloon is punctured; a replay does what was recorded instead.
fn run(scene: &Path, files: &RunFiles) -> Result<Vec<StateHash>, Box<dyn Error>> {
    let mut session = Session::load(scene, &LoadOptions { simulation, ..LoadOptions::default() })?;
    session.begin(files, 0)?;
    let mut hashes = Vec::new();
    for step in 0..100 {
        if step == 30 && !session.is_replay() {
            let world = &mut session.simulation.world;
            let mut named = world.query::<(Entity, &Name)>();
            let red = named.iter(world).find(|(_, name)| name.as_str() == "red").map(|(entity, _)| entity);
            let red = red
                .and_then(|entity| world.resource::<EntityRegistry>().id(entity))
                .ok_or("there is no red balloon")?;
            session.apply(Puncture { balloon: red })?;
        }
        session.step()?;
        hashes.push(session.hash());
    }
    session.finish()?;
    Ok(hashes)
}

fn main() -> Result<(), Box<dyn Error>> {
    let (scene, recording) = (Path::new("own_state.ron"), Path::new("own_state.rec"));
    std::fs::write(scene, SCENE)?;
    // As `relief check`, which does not know balloons.
    check(scene, simulation).iter().for_each(|problem| println!("{problem}"));
    let recorded = run(scene, &RunFiles { record: Some(recording.into()), ..RunFiles::default() })?;
    let replayed = run(scene, &RunFiles { replay: Some(recording.into()), ..RunFiles::default() })?;
    assert!(recorded == replayed, "a replay is the run");
    println!("{} steps come out as recorded", replayed.len());
    Ok(())
}
