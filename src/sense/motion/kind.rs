//! Kinds of sensors without pictures: each is its settings, and measures records of them.
//!
//! The library's own are those of [`SensorKind`]; a program adds others ([`super::custom`]). All else asks here, and
//! knows no kind by name.

use super::custom::CustomSensors;
use crate::sense::captures::label_table::LabelTable;
use crate::sense::captures::pose::Pose;
use crate::sense::captures::reading::{Reading, Record};
use bevy_ecs::prelude::*;
use glam::DVec3;
use serde_json::{Value, json};
use std::sync::LazyLock;
use systems::describe::{Described, Field, fields, schema};
use systems::sensors::philox::Noise;
use systems::sensors::{Sensor, SensorKind};

/// Settings of a sensor without pictures.
pub trait ReadingSensor: Described + Clone + Send + Sync {
    /// Name of the kind, in scene files and outputs.
    const KIND: &'static str;
    /// Number of earlier captures whose poses it measures by: 0, 1 or 2.
    const POSES_BEFORE: usize = 0;
    /// Record that it measures.
    type Record: Record;

    /// Measures: a record, or as many as there are things to tell.
    fn measure(&self, at: &mut Measuring<'_>) -> Vec<Self::Record>;

    /// Adds what `sensors.json` has beside settings and units.
    fn describe(&self, _described: &mut Value, _seconds: f64, _world: &World) {}
}

/// State that a sensor measures in, after a step.
pub struct Measuring<'a> {
    /// The world.
    pub world: &'a World,
    /// Entity of the sensor.
    pub entity: Entity,
    /// Pose of the sensor in the world, whose +Y is up and whose coordinates count from `origin`.
    pub pose: Pose,
    /// Poses when it was due before, and before that, as far as they are known and it asks for them.
    pub before: [Option<Pose>; 2],
    /// Origin of the world in the scene's coordinates, metres.
    pub origin: DVec3,
    /// Seconds since it was due before.
    pub seconds: f64,
    /// Nanoseconds of the clock when it was due before.
    pub nanoseconds_before: u64,
    /// Random numbers of this capture.
    pub noise: Noise,
    /// Numbers and classes of entities.
    #[cfg_attr(not(feature = "vehicles"), expect(dead_code, reason = "contacts alone have labels"))]
    pub(crate) labels: &'a mut LabelTable,
}

/// Settings of some kind.
pub(crate) trait AnyReadingSensor {
    fn kind(&self) -> &'static str;
    fn topic(&self) -> Option<&'static str>;
    fn poses_before(&self) -> usize;
    fn fields(&self) -> Vec<Field>;
    fn record_schema(&self) -> &'static Value;
    /// The settings as an object of JSON.
    fn values(&self) -> serde_json::Result<Value>;
    fn measure(&self, at: &mut Measuring<'_>) -> Reading;
    /// Adds units and more to what `sensors.json` says of a sensor.
    fn describe(&self, described: &mut Value, seconds: f64, world: &World);
}

impl<T: ReadingSensor> AnyReadingSensor for T {
    fn kind(&self) -> &'static str {
        T::KIND
    }

    fn topic(&self) -> Option<&'static str> {
        T::Record::TOPIC
    }

    fn poses_before(&self) -> usize {
        T::POSES_BEFORE
    }

    fn fields(&self) -> Vec<Field> {
        fields::<T::Record>()
    }

    fn record_schema(&self) -> &'static Value {
        schema::<T::Record>()
    }

    fn values(&self) -> serde_json::Result<Value> {
        serde_json::to_value(self)
    }

    fn measure(&self, at: &mut Measuring<'_>) -> Reading {
        Reading::new(T::KIND, ReadingSensor::measure(self, at))
    }

    fn describe(&self, described: &mut Value, seconds: f64, world: &World) {
        let with_unit = self.fields().into_iter().filter(|field| !field.unit().is_empty());
        let units = with_unit.map(|field| (field.name.to_owned(), json!({ "unit": field.unit() })));
        described["outputs"] = Value::Object(units.collect());
        ReadingSensor::describe(self, described, seconds, world);
    }
}

/// Settings of a sensor of the library's kinds; `None` of cameras, lidars, and kinds that a program adds.
pub(crate) fn built_in(kind: &SensorKind) -> Option<&dyn AnyReadingSensor> {
    match kind {
        SensorKind::Imu(settings) => Some(settings),
        SensorKind::Gnss(settings) => Some(settings),
        SensorKind::Collision(settings) => Some(settings),
        SensorKind::Lane(settings) => Some(settings),
        SensorKind::Barometer(settings) => Some(settings),
        SensorKind::Camera(_) | SensorKind::Lidar(_) | SensorKind::Custom { .. } => None,
    }
}

/// Settings of a sensor without pictures; `None` of cameras and lidars, and of a kind that the program does not add.
pub(crate) fn settings<'a>(world: &'a World, entity: Entity, sensor: &'a Sensor) -> Option<&'a dyn AnyReadingSensor> {
    match &sensor.kind {
        SensorKind::Custom { name, .. } => world.get_resource::<CustomSensors>()?.settings(name, world, entity),
        kind => built_in(kind),
    }
}

/// Number of earlier poses that a sensor measures by.
pub(crate) fn poses_before(world: &World, kind: &SensorKind) -> usize {
    match kind {
        SensorKind::Lidar(lidar) => lidar.sweep.into(),
        SensorKind::Custom { name, .. } => {
            world.get_resource::<CustomSensors>().map_or(0, |known| known.poses_before(name))
        }
        kind => poses_needed(kind),
    }
}

/// Number of earlier poses that a kind of the library measures by.
pub fn poses_needed(kind: &SensorKind) -> usize {
    built_in(kind).map_or(0, AnyReadingSensor::poses_before)
}

/// Tells if logs of ROS 2 have messages of a kind.
pub(crate) fn has_messages(kind: &SensorKind) -> bool {
    match kind {
        SensorKind::Camera(_) | SensorKind::Lidar(_) => true,
        SensorKind::Custom { has_messages, .. } => *has_messages,
        kind => built_in(kind).is_some_and(|own| own.topic().is_some()),
    }
}

/// Name of a kind, as scene files have it.
pub fn kind_name(kind: &SensorKind) -> &str {
    match kind {
        SensorKind::Camera(_) => "camera",
        SensorKind::Lidar(_) => "lidar",
        SensorKind::Custom { name, .. } => name,
        kind => built_in(kind).map_or("", AnyReadingSensor::kind),
    }
}

/// Beginning of the names of a sensor's files. Of a camera it is empty: its outputs have names of their own.
pub(crate) fn file_name(kind: &SensorKind) -> &str {
    match kind {
        SensorKind::Camera(_) => "",
        SensorKind::Lidar(_) => "points",
        SensorKind::Collision(_) => "collisions",
        kind => kind_name(kind),
    }
}

/// Kinds of the library that measure records, with the schemas of these.
pub fn record_schemas() -> &'static [(&'static str, &'static Value)] {
    static KNOWN: LazyLock<Vec<(&str, &Value)>> = LazyLock::new(|| {
        let choices = schema::<SensorKind>()["oneOf"].as_array().into_iter().flatten();
        let names = choices.filter_map(|kind| kind["properties"].as_object()?.keys().next());
        let by_default = names.filter_map(|name| serde_json::from_value(json!({ name: {} })).ok());
        let known = by_default.filter_map(|kind| built_in(&kind).map(|own| (own.kind(), own.record_schema())));
        known.collect()
    });
    &KNOWN
}
