//! A kind of sensor of one's own: an inclinometer, which measures the slope of what it is mounted on. Scene files set
//! it, it is captured with the others, and its readings are in the files of a data set.
//!
//! `cargo run --release --example own_sensor` writes `own_sensor.ron` and the folder `own_sensor`.

use relief::data::{DatasetOptions, FileFormat, SensorJob, render_sensors};
use relief::frames::{Frames, RunJob};
use relief::prelude::*;
use relief::sense::{Measuring, ReadingSensor, Record, add_sensor_kind};
use relief::session::LoadOptions;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::error::Error;
use systems::describe::Described;
use systems::sensors::philox::normal;

const SCENE: &str = r#"(
    meshes: { "plate": cube(size: (1, 0.1, 1)) },
    entities: [(
        name: "plate", mesh: "plate", instance: true, transform: (rotation_degrees: (-10, 0, 0)),
        children: [(name: "slope", inclinometer: (sigma_degrees: 0.05, every: 2))],
    )],
)"#;

/// An inclinometer. Its forward is the entity's +Z.
#[derive(Component, Serialize, Deserialize, JsonSchema, Clone, Debug, Default)]
#[serde(default, deny_unknown_fields)]
struct Inclinometer {
    /// Standard deviation of its noise.
    #[schemars(range(min = 0.0, max = 10.0), extend("unit" = "°"))]
    sigma_degrees: f32,
}

/// Slope at a time.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
struct Slope {
    /// Rise of its forward above the horizon.
    #[schemars(extend("unit" = "degrees"))]
    degrees: f64,
}

impl Described for Inclinometer {}
impl Described for Slope {}
impl Record for Slope {}

impl ReadingSensor for Inclinometer {
    const KIND: &'static str = "inclinometer";
    type Record = Slope;

    fn measure(&self, at: &mut Measuring<'_>) -> Vec<Slope> {
        let forward = at.pose.rotation * glam::DVec3::Z;
        let noise = normal(at.noise.words(0, 0)[0]) * self.sigma_degrees;
        vec![Slope { degrees: forward.y.clamp(-1.0, 1.0).asin().to_degrees() + f64::from(noise) }]
    }
}

/// A simulation that knows inclinometers.
fn simulation() -> Simulation {
    let mut simulation = Simulation::new();
    add_sensor_kind::<Inclinometer>(&mut simulation.world);
    simulation
}

fn main() -> Result<(), Box<dyn Error>> {
    std::fs::write("own_sensor.ron", SCENE)?;
    let load = LoadOptions { simulation, ..LoadOptions::default() };
    let job = SensorJob {
        run: RunJob { frames: Frames::First(5), load, ..RunJob::new("own_sensor.ron") },
        dataset: DatasetOptions { formats: vec![FileFormat::NPY], ..DatasetOptions::new("own_sensor") },
    };
    for file in render_sensors(&job, |_, _| ())? {
        println!("{}", file.display());
    }
    Ok(())
}
