//! Sensors of a world by their names.

use crate::name;
use crate::sense::captures::label_table::{number, thing_of};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use systems::sensors::Sensor;

/// The sensors of a world with their names, in the order in which they came to be.
pub fn sensor_names(world: &mut World) -> Vec<(String, Entity)> {
    let sensors = sensors_where(world, |_| true);
    sensors.into_iter().map(|sensor| (sensor_name(world, sensor), sensor)).collect()
}

/// A sensor's own name below that of the thing that it is mounted on.
pub fn sensor_name(world: &World, sensor: Entity) -> String {
    let own = world.get::<Name>(sensor).map(|name| name.as_str().to_owned());
    let own = own.unwrap_or_else(|| format!("sensor {}", number(world, sensor)));
    sensor_name_on(world, world.get::<ChildOf>(sensor).map(ChildOf::parent), own)
}

/// Name of a sensor with an own name, if it were mounted on a parent; or on nothing.
pub fn sensor_name_on(world: &World, parent: Option<Entity>, own: String) -> String {
    match parent.and_then(|parent| thing_of(world, parent)) {
        Some(thing) => format!("{}/{own}", name::of_entity(world, thing)),
        None => own,
    }
}

/// The sensors for which something holds, in the order in which they came to be.
pub(super) fn sensors_where(world: &mut World, holds: impl Fn(&Sensor) -> bool) -> Vec<Entity> {
    let mut sensors = world.query::<(Entity, &Sensor)>();
    let found = sensors.iter(world).filter(|(_, sensor)| holds(sensor)).map(|(entity, _)| entity);
    let mut found: Vec<Entity> = found.collect();
    found.sort_unstable_by_key(|&sensor| number(world, sensor));
    found
}
