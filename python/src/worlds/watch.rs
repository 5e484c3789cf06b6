//! Captures that were left out: of sensors that measure from one time that they are due to the next.

use relief::bevy_ecs::prelude::Entity;
use relief::bevy_ecs::world::World;
use relief::sense::{Capture, SensorCapture, poses_needed};
use relief::systems::ecs::clock::Clock;
use relief::systems::run::snapshot::Restored;
use relief::systems::sensors::{CameraOutput, Sensor, SensorKind};
use std::collections::{HashMap, HashSet};

/// Steps and warnings of the captures of a world.
#[derive(Default)]
pub struct Watch {
    /// Marks the state that the rest is of.
    restored: Restored,
    /// The step after which that was first looked at.
    since: u64,
    /// The steps after which sensors were mounted, or captured last when they were due.
    known: HashMap<Entity, u64>,
    /// Names of sensors of which it was told.
    told: HashSet<String>,
    /// Not told yet.
    warnings: Vec<String>,
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

    /// Notes a capture, or a look at the state at hand.
    pub fn note(&mut self, world: &World, capture: &Capture) {
        self.note_sensors(world, capture.step, &capture.sensors);
    }

    /// Notes a look at sensors, of which none takes one of the time before.
    pub fn note_look(&mut self, world: &World) {
        self.note_sensors(world, world.resource::<Clock>().step, &[]);
    }

    fn note_sensors(&mut self, world: &World, step: u64, sensors: &[SensorCapture]) {
        let restored = world.get_resource::<Restored>().copied().unwrap_or_default();
        if std::mem::replace(&mut self.restored, restored) != restored {
            self.forget();
            self.since = step;
        }
        let step_seconds = world.resource::<Clock>().step_seconds;
        for SensorCapture { entity, name, .. } in sensors {
            let Some(sensor) = world.get::<Sensor>(*entity).filter(|sensor| sensor.is_due(step)) else {
                continue;
            };
            let last = self.known.insert(*entity, step).unwrap_or(self.since);
            let missed = step.checked_sub(sensor.every.into()).filter(|before| *before > last);
            let Some((before, lack)) = missed.zip(Lack::of(sensor, step_seconds)) else { continue };
            if self.told.insert(name.clone()) {
                let (words, steps) = (lack.words(), step - last);
                self.warnings.push(format!(
                    "sensor {name:?} was not captured after step {before}, when it was due: {words}; capture after \
                     each step at which it is due, or mount it with every={steps}"
                ));
            }
        }
        let Some(mut sensors) = world.try_query::<(Entity, &Sensor)>() else { return };
        for (entity, sensor) in sensors.iter(world).filter(|(_, sensor)| sensor.is_due(step)) {
            if Lack::of(sensor, step_seconds).is_some_and(Lack::is_made_up_by_any_capture) {
                self.known.insert(entity, step);
            }
        }
    }

    /// Takes what a person should know of the captures so far, once for each sensor.
    pub fn warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }
}

/// A part of a capture that takes one of the time before.
#[derive(Clone, Copy)]
enum Lack {
    Reading(&'static str),
    Turn,
    Places,
    Flow,
}

impl Lack {
    /// `None`: the sensor needs no capture before.
    fn of(sensor: &Sensor, step_seconds: f64) -> Option<Self> {
        match &sensor.kind {
            SensorKind::Lidar(lidar) => {
                let turns = f64::from(sensor.every) * step_seconds * f64::from(lidar.hz);
                // Rates are rounded: 6/60 s at 10 Hz is a whole turn.
                let is_part = turns < 1.0 - 1e-9;
                is_part.then_some(Self::Turn).or_else(|| lidar.sweep.then_some(Self::Places))
            }
            SensorKind::Camera(camera) => {
                let has_flow = camera.outputs.has_any(&[CameraOutput::Flow, CameraOutput::FlowBack]);
                has_flow.then_some(Self::Flow)
            }
            SensorKind::Gnss(_) => Some(Self::Reading("it has no velocity")),
            kind => (poses_needed(kind) > 0).then_some(Self::Reading("its reading is not valid")),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Reading(words) => words,
            Self::Turn => "it has fired what one interval has of a turn",
            Self::Places => "it has fired all columns from one place",
            Self::Flow => "it has no flow",
        }
    }

    /// Every capture of a world notes where all of its sensors are that are due.
    fn is_made_up_by_any_capture(self) -> bool {
        matches!(self, Self::Reading(_) | Self::Places)
    }
}
