//! Kinds of sensors that a program adds: settings that are a component beside [`Sensor`].

use super::kind::{AnyReadingSensor, ReadingSensor};
use crate::scene::{EntityField, SceneFields, read_with_rate};
use crate::sense::captures::reading::Record;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Deserializer};
use systems::describe::{check, schema};
use systems::run::state::StateList;
use systems::sensors::{Rate, Sensor, SensorKind};

/// Adds a kind of sensor to a world, before a scene is loaded into it. In scene files it is a field of entities, of the
/// kind's name: its settings, with `every` and `phase` among them. They are state of the world, as a component.
///
/// # Panics
/// If a kind, a field of entities or a component of state has that name; if it asks for more than two earlier poses.
pub fn add_sensor_kind<T: ReadingSensor + Component>(world: &mut World) {
    let known = schema::<SensorKind>()["oneOf"].as_array().into_iter().flatten();
    let mut names = known.filter_map(|kind| kind["properties"].as_object()).flat_map(|kinds| kinds.keys());
    assert!(names.all(|name| name != T::KIND), "{} is a kind of sensor already", T::KIND);
    assert!(T::POSES_BEFORE <= 2, "{}: expected at most 2 earlier poses, found {}", T::KIND, T::POSES_BEFORE);
    world.resource_mut::<StateList>().add_checked_component::<T>(T::KIND, |settings| check(settings).is_ok());
    world.get_resource_or_init::<SceneFields>().register::<CustomSensor<T>>();
    let known = Known { name: T::KIND, poses_before: T::POSES_BEFORE, settings: settings::<T> };
    world.get_resource_or_init::<CustomSensors>().0.push(known);
}

fn settings<T: ReadingSensor + Component>(world: &World, entity: Entity) -> Option<&dyn AnyReadingSensor> {
    world.get::<T>(entity).map(|own| own as &dyn AnyReadingSensor)
}

/// A sensor of a kind that a program adds: its settings, and when it is due.
#[derive(Bundle, Clone, Debug)]
pub struct CustomSensor<T: ReadingSensor + Component> {
    sensor: Sensor,
    settings: T,
}

impl<T: ReadingSensor + Component> CustomSensor<T> {
    /// A sensor that is due at a rate.
    pub fn new(settings: T, Rate { every, phase }: Rate) -> Self {
        let kind = SensorKind::Custom { name: T::KIND.to_owned(), has_messages: T::Record::TOPIC.is_some() };
        Self { sensor: Sensor { kind, every, phase }, settings }
    }
}

impl<'de, T: ReadingSensor + Component> Deserialize<'de> for CustomSensor<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (settings, rate) = read_with_rate(deserializer, |inner| T::deserialize(inner))?;
        Ok(Self::new(settings, rate))
    }
}

impl<T: ReadingSensor + Component> EntityField for CustomSensor<T> {
    const NAME: &'static str = T::KIND;
    const IS_SENSOR: bool = true;

    fn check(&self) -> Result<(), String> {
        let rate = self.sensor.faults().into_iter().next().map_or(Ok(()), Err);
        check(&self.settings).and(rate).map_err(|fault| fault.to_string())
    }

    fn insert(&self, entity: &mut EntityWorldMut) {
        entity.insert(self.clone());
    }
}

/// Kinds that a program has added to a world.
#[derive(Resource, Default)]
pub(crate) struct CustomSensors(Vec<Known>);

/// Settings of an entity, if it has them.
type Settings = fn(&World, Entity) -> Option<&dyn AnyReadingSensor>;

struct Known {
    name: &'static str,
    poses_before: usize,
    settings: Settings,
}

impl CustomSensors {
    /// Number of earlier poses that sensors of a kind measure by.
    pub fn poses_before(&self, kind: &str) -> usize {
        self.0.iter().find(|known| known.name == kind).map_or(0, |known| known.poses_before)
    }

    /// Settings of a sensor of a kind; `None` where the kind is not known, or the entity does not have them.
    pub fn settings<'a>(&self, kind: &str, world: &'a World, entity: Entity) -> Option<&'a dyn AnyReadingSensor> {
        (self.0.iter().find(|known| known.name == kind)?.settings)(world, entity)
    }
}
