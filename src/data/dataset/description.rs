//! `sensors.json`: what the sensors of a data set are, and where they were at each capture.
//!
//! Matrices are rows of numbers, from the sensor's axes to the scene's coordinates. A camera's axes are X right, Y
//! down, Z forward; those of all others X forward, Y left, Z up.

use crate::export::ros::Distortion;
use crate::sense::captures::axes::{ENTITY_FROM_CAMERA, ENTITY_FROM_LIDAR};
use crate::sense::captures::capture::FirstColumn;
use crate::sense::motion::kind::{self, kind_name};
use crate::sense::world::names::sensor_names;
use bevy_ecs::prelude::*;
use glam::{DAffine3, DMat4};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use systems::draw::Intrinsics;
use systems::ecs::clock::Clock;
use systems::sensors::{CameraOutput, CameraSensor, Classes, Lens, Sensor, SensorKind};

/// Version of the file's form.
const VERSION: u32 = 1;

/// A capture: when, and where the sensor was: from the entity's axes (+Y up) to the scene's coordinates. Of a lidar
/// also when its first column was fired; of one that sweeps, where it was then.
pub(super) fn capture(
    (step, nanoseconds): (u64, u64),
    world_from_sensor: DAffine3,
    first_column: Option<FirstColumn>,
) -> Value {
    let mut at = json!({
        "step": step,
        "nanoseconds": nanoseconds,
        "world_from_entity": rows(&DMat4::from(world_from_sensor)),
    });
    if let Some(FirstColumn { nanoseconds, world_from_sensor }) = first_column {
        at["first_column_nanoseconds"] = json!(nanoseconds);
        if let Some(before) = world_from_sensor {
            at["world_from_entity_before"] = rows(&DMat4::from(before));
        }
    }
    at
}

fn rows(matrix: &DMat4) -> Value {
    json!([0, 1, 2, 3].map(|row| matrix.row(row).to_array()))
}

/// The file's text, of what [`of_sensors`] describes. `captures`: by names of sensors.
pub(super) fn text(mut described: Value, mut captures: BTreeMap<String, Vec<Value>>) -> String {
    for sensor in described["sensors"].as_array_mut().into_iter().flatten() {
        let own = sensor["name"].as_str().and_then(|name| captures.remove(name));
        sensor["captures"] = own.unwrap_or_default().into();
    }
    format!("{described:#}\n")
}

/// Description of the sensors, without captures.
pub(super) fn of_sensors(world: &mut World, chosen: &BTreeMap<String, Sensor>) -> Value {
    let step_seconds = world.resource::<Clock>().step_seconds;
    let known = sensor_names(world).into_iter().filter(|(name, _)| chosen.contains_key(name));
    let sensors: Vec<Value> = known
        .filter_map(|(name, entity)| {
            let sensor = world.get::<Sensor>(entity)?;
            let settings = kind::settings(world, entity, sensor);
            let mut described = match (&sensor.kind, settings) {
                (SensorKind::Camera(camera), _) => of_camera(camera),
                (SensorKind::Lidar(lidar), _) => serde_json::to_value(lidar).ok()?,
                (_, settings) => settings.map_or(Ok(json!({})), |own| own.values()).ok()?,
            };
            if !matches!(sensor.kind, SensorKind::Camera(_)) {
                described["axes"] = json!("X forward, Y left, Z up");
                described["entity_from_sensor"] = rows(&DMat4::from_mat3(ENTITY_FROM_LIDAR));
            }
            if let Some(settings) = settings {
                settings.describe(&mut described, f64::from(sensor.every) * step_seconds, world);
            }
            described["kind"] = json!(kind_name(&sensor.kind));
            described["name"] = json!(name);
            described["every"] = json!(sensor.every);
            described["phase"] = json!(sensor.phase);
            Some(described)
        })
        .collect();
    let classes = world.resource::<Classes>().0.iter().map(|class| {
        json!({
            "id": class.id,
            "name": class.name,
            "color": class.color,
            "thing": class.is_thing,
            "train_id": class.train_id,
        })
    });
    json!({
        "version": VERSION,
        "step_seconds": step_seconds,
        "units": { "length": "metre", "time": "second", "angle": "radian" },
        "world_axes": "X, Y up, Z, right-handed",
        "classes": classes.collect::<Vec<_>>(),
        "sensors": sensors,
    })
}

fn of_camera(camera: &CameraSensor) -> Value {
    let outputs = camera.outputs.iter().map(|(name, output)| (name.to_owned(), of_output(output)));
    let distortion = Distortion::of(&camera.lens);
    let (model, coefficients) = distortion.parts();
    json!({
        "width": camera.size.0,
        "height": camera.size.1,
        "K": camera.intrinsics().map(|intrinsics: Intrinsics| {
            let k = intrinsics.matrix();
            [0, 1, 2].map(|row| k.row(row).to_array())
        }),
        // A parallel projection has neither.
        "D": camera.intrinsics().map(|_| coefficients),
        "distortion_model": camera.intrinsics().map(|_| model),
        "half_height": match camera.lens {
            Lens::Orthographic { half_height } => Some(half_height),
            _ => None,
        },
        "largest_angle": match camera.lens {
            Lens::KannalaBrandt { largest_angle, .. } => Some(largest_angle),
            _ => None,
        },
        "near": camera.near,
        "far": camera.far.is_finite().then_some(camera.far),
        "exposure": camera.exposure,
        "noise": camera.noise,
        "axes": "X right, Y down, Z forward",
        "entity_from_sensor": rows(&DMat4::from_mat3(ENTITY_FROM_CAMERA)),
        "outputs": outputs.collect::<serde_json::Map<_, _>>(),
    })
}

/// Type, unit, and what stands where there is nothing.
fn of_output(output: CameraOutput) -> Value {
    let (kind, unit, nothing) = match output {
        CameraOutput::Color => ("uint8", "sRGB, tone-mapped", "sky"),
        CameraOutput::Linear => ("float16", "linear, exposed", "sky"),
        CameraOutput::Depth => ("float32", "metres along the optical axis", "infinity"),
        CameraOutput::Range => ("float32", "metres from the optical centre", "infinity"),
        CameraOutput::Normal => ("float32", "unit vectors, camera axes", "0"),
        CameraOutput::Instance => ("uint32", "number of the instance", "0"),
        CameraOutput::Part => ("uint32", "number of the drawn entity", "0"),
        CameraOutput::Class => ("uint8", "class id", "0"),
        CameraOutput::Panoptic => ("uint32", "class * 1000 + place among its class for things, else class", "0"),
        CameraOutput::Boxes => ("records", "a record for each thing in the picture", "no record"),
        CameraOutput::Flow => ("float32", "pixels to the right and down, from this capture to the next", "0, flags 0"),
        CameraOutput::FlowBack => ("float32", "pixels to the right and down, to the capture before", "0, flags 0"),
    };
    json!({ "type": kind, "unit": unit, "nothing": nothing })
}
