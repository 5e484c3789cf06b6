//! Captures that were left out: of sensors that measure from one time that they are due to the next.

use relief::bevy_ecs::prelude::Entity;
use relief::bevy_ecs::world::World;
use relief::sensors::{Capture, SensorCapture};
use relief::systems::ecs::clock::Clock;
use relief::systems::run::snapshot::Restored;
use relief::systems::sensors::{CameraOutput, Sensor, SensorKind};
use std::collections::{HashMap, HashSet};

/// What is known of the captures of a world.
#[derive(Default)]
pub struct Watch {
    /// Of which state.
    restored: Restored,
    /// The step after which that was first looked at.
    since: u64,
    /// The steps after which sensors were mounted, or captured last when they were due.
    known: HashMap<Entity, u64>,
    /// Names of sensors of which it was told.
    told: HashSet<String>,
}

impl Watch {
    /// Notes that a sensor came into being.
    pub fn mounted(&mut self, sensor: Entity, step: u64) {
        self.known.insert(sensor, step);
    }

    /// Begins anew, with another state.
    pub fn forget(&mut self) {
        (self.since, self.known) = (0, HashMap::new());
    }

    /// Notes a capture. Returns what a person should know of it, once for each sensor.
    pub fn note(&mut self, world: &World, capture: &Capture) -> Vec<String> {
        let restored = world.get_resource::<Restored>().copied().unwrap_or_default();
        if std::mem::replace(&mut self.restored, restored) != restored {
            self.forget();
            self.since = capture.step;
        }
        let step_seconds = world.resource::<Clock>().step_seconds;
        let mut warnings = Vec::new();
        for SensorCapture { entity, name, .. } in &capture.sensors {
            let Some(sensor) = world.get::<Sensor>(*entity).filter(|sensor| sensor.is_due(capture.step)) else {
                continue;
            };
            let last = self.known.insert(*entity, capture.step).unwrap_or(self.since);
            let missed = capture.step.checked_sub(sensor.every.into()).filter(|before| *before > last);
            let Some((before, lacks)) = missed.zip(lack(sensor, step_seconds)) else { continue };
            if self.told.insert(name.clone()) {
                let steps = capture.step - last;
                warnings.push(format!(
                    "sensor {name:?} was not captured after step {before}, when it was due: {lacks}; capture after each \
                     step at which it is due, or mount it with every={steps}"
                ));
            }
        }
        warnings
    }
}

/// What a capture of the sensor does not have without that of the time before; `None`: it needs none.
fn lack(sensor: &Sensor, step_seconds: f64) -> Option<&'static str> {
    match &sensor.kind {
        SensorKind::Imu(_) => Some("its reading is not valid"),
        SensorKind::Lidar(lidar) => {
            let turns = f64::from(sensor.every) * step_seconds * f64::from(lidar.hz);
            // Rates are rounded: 6/60 s at 10 Hz is a whole turn.
            let is_part = turns < 1.0 - 1e-9;
            is_part
                .then_some("it has fired what one interval has of a turn")
                .or_else(|| lidar.sweep.then_some("it has fired all columns from one place"))
        }
        SensorKind::Camera(camera) => {
            let has_flow = camera.outputs.has_any(&[CameraOutput::Flow, CameraOutput::FlowBack]);
            has_flow.then_some("it has no flow")
        }
        SensorKind::Gnss(_) | SensorKind::Collision(_) | SensorKind::Lane(_) => None,
    }
}
