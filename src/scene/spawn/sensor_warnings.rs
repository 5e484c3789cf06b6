//! Warnings of sensors in a scene that will not measure what is meant.

use crate::name;
use bevy_ecs::prelude::*;
use systems::sensors::{CameraOutput, Class, Classes, Instance, Sensor, SensorKind};

/// A line for each sensor and output.
pub fn warnings(world: &mut World) -> Vec<String> {
    let mut sensors = world.query::<(Entity, &Sensor)>();
    let sensors: Vec<(Entity, SensorKind)> =
        sensors.iter(world).map(|(entity, sensor)| (entity, sensor.kind.clone())).collect();
    if sensors.is_empty() {
        return Vec::new();
    }
    let mut classes = world.query::<&Class>();
    let (mut has_classes, mut has_things) = (false, false);
    for class in classes.iter(world) {
        has_classes = true;
        has_things |= world.resource::<Classes>().get(*class).is_some_and(|info| info.is_thing);
    }
    has_things |= world.query_filtered::<(), With<Instance>>().iter(world).next().is_some();
    let mut warnings = Vec::new();
    for (entity, kind) in sensors {
        let SensorKind::Camera(camera) = kind else { continue };
        let name = name::of_entity(world, entity);
        let by_class = [("class", CameraOutput::Class), ("panoptic", CameraOutput::Panoptic)];
        for (output, _) in by_class.into_iter().filter(|(_, output)| !has_classes && camera.outputs.has(*output)) {
            warnings.push(format!("sensor {name:?}: {output}: nothing in the scene has a class: all will be 0"));
        }
        if !has_things && camera.outputs.has(CameraOutput::Boxes) {
            warnings.push(format!(
                "sensor {name:?}: boxes: there will be none: nothing in the scene is a vehicle, has `instance: true` or \
                 a class of things"
            ));
        }
    }
    warnings
}
