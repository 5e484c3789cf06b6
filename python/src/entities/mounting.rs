//! Keyword arguments that describe and mount sensors.

use crate::entities::classes::wrap_as;
use crate::entities::entity::Kind;
use crate::errors::Failure;
use crate::given::arguments::{Argument, Keywords, Row, finite, found, required};
use crate::given::described::{of_kind, take};
use crate::given::values::{Facing, Numbers, Placing};
use crate::worlds::world::Shared;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::sense::{sensor_name_on, sensor_names};
use relief::systems::describe::schema;
use relief::systems::draw::Intrinsics;
use relief::systems::ecs::clock::Clock;
use relief::systems::run::registry::StateId;
use relief::systems::run::spawn::Spawn;
use relief::systems::sensors::{self, CameraSensor, Lens, SensorKind};
use relief::systems::space::GeoOrigin;
use serde_json::json;
use std::sync::Arc;

/// Pose of a sensor, and the steps at which it is due.
struct Mounting {
    placing: Placing,
    every: u32,
    phase: u32,
}

impl Mounting {
    fn read(arguments: &mut Keywords<'_, '_>) -> PyResult<Self> {
        let [at, yaw, pitch, roll, look_at] = ["at", "yaw", "pitch", "roll", "look_at"].map(|name| arguments.get(name));
        let (at, look_at) = (at?, look_at?);
        let turn = [yaw?, pitch?, roll?];
        let placing = Placing::read(at.as_ref(), turn.each_ref().map(Option::as_ref), look_at.as_ref())?;
        let every = arguments.take("every")?.unwrap_or(1);
        let phase = arguments.take("phase")?.unwrap_or(0);
        Ok(Self { placing, every, phase })
    }

    fn add(
        self,
        py: Python<'_>,
        shared: &Arc<Shared>,
        name: &Bound<'_, PyAny>,
        parent: Option<StateId>,
        kind: SensorKind,
    ) -> PyResult<Py<PyAny>> {
        let Self { placing, every, phase } = self;
        let facing = if matches!(kind, SensorKind::Camera(_)) { Facing::Backward } else { Facing::Forward };
        let sensor = sensors::Sensor { kind, every, phase };
        if let Some(fault) = sensor.faults().first() {
            return Err(Failure::value(fault.to_string()).into());
        }
        let name: String = required("name", name)?;
        if name.is_empty() {
            return Err(Failure::value("name: expected one, by which captures call the sensor").into());
        }
        let id = shared.with(py, move |world| {
            let on = parent.map(|parent| world.entity(parent)).transpose()?;
            let full = sensor_name_on(&world.simulation.world, on, name.clone());
            if sensor_names(&mut world.simulation.world).iter().any(|(other, _)| *other == full) {
                return Err(Failure::value(format!("name: there is a sensor {full:?}")));
            }
            let (own, step_seconds) =
                (&world.simulation.world, world.simulation.world.resource::<Clock>().step_seconds);
            let has_geo_origin = own.get_resource::<GeoOrigin>().is_some();
            sensor.check_in(step_seconds, has_geo_origin).map_err(Failure::Value)?;
            let origin = if parent.is_none() { world.origin() } else { Default::default() };
            let transform = placing.transform(origin, facing);
            world.spawn(Spawn::Sensor { name, transform, parent, sensor })
        })?;
        wrap_as(py, shared, id, Kind::Sensor)
    }
}

/// Mounts a sensor of a kind, or puts it into the scene, as keywords describe it.
pub fn add_sensor(
    py: Python<'_>,
    shared: &Arc<Shared>,
    kind: &str,
    name: &Bound<'_, PyAny>,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Keywords::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let known = of_kind(schema::<SensorKind>(), kind);
    let whole = |fields| serde_json::from_value::<SensorKind>(json!({ kind: fields })).map(drop);
    let read = |fields| whole(fields).map_err(|error| error.to_string());
    let fields = take(&mut arguments, known, &|_| true, &read)?;
    let kind = match serde_json::from_value(json!({ kind: fields })) {
        Ok(SensorKind::Camera(camera)) => {
            let lens = lens(&mut arguments, &camera, fields.contains_key("lens"))?;
            SensorKind::Camera(CameraSensor { lens, ..camera }.resolved())
        }
        Ok(kind) => kind,
        Err(error) => return Err(Failure::value(error.to_string()).into()),
    };
    arguments.finish()?;
    mounting.add(py, shared, name, parent, kind)
}

/// By `K`, with what distorts the picture, or by one of the angles and heights; else that which the camera has.
/// `is_given`: the camera has it by `lens`.
fn lens(arguments: &mut Keywords<'_, '_>, camera: &CameraSensor, is_given: bool) -> PyResult<Lens> {
    let intrinsics = arguments.get("K")?.map(|given| intrinsics(&given)).transpose()?;
    let mut degrees = |name: &str| arguments.take::<f64>(name)?.map(|degrees| finite(name, degrees)).transpose();
    let (fov_y, fov_x) = (degrees("fov_y_degrees")?, degrees("fov_x_degrees")?);
    let half_height = arguments.take::<f32>("half_height")?;
    let distortion = arguments.take::<Coefficients<8>>("distortion")?.map(|own| own.0);
    let fisheye = arguments.take::<Coefficients<4>>("fisheye")?.map(|own| own.0);
    let largest_degrees = arguments.take::<f64>("largest_degrees")?;
    let refused = |message: &str| Err(Failure::value(message).into());
    let given = [intrinsics.is_some(), fov_y.is_some(), fov_x.is_some(), half_height.is_some(), is_given];
    if given.iter().filter(|given| **given).count() > 1 {
        return refused("expected one of K, fov_y_degrees, fov_x_degrees and half_height, or lens alone");
    }
    if largest_degrees.is_some() && fisheye.is_none() {
        return refused("largest_degrees: expected fisheye beside it");
    }
    let lens = match (intrinsics, distortion, fisheye) {
        (Some(_), Some(_), Some(_)) => return refused("expected one of distortion and fisheye"),
        (Some(intrinsics), Some(coefficients), None) => Lens::BrownConrady { intrinsics, coefficients },
        (Some(intrinsics), None, Some(coefficients)) => {
            let largest_angle = largest_degrees.unwrap_or(90.0).to_radians();
            Lens::KannalaBrandt { intrinsics, coefficients, largest_angle }
        }
        (Some(intrinsics), None, None) => Lens::Pinhole(intrinsics),
        (None, None, None) => match (half_height, fov_x, fov_y) {
            (Some(half_height), ..) => Lens::Orthographic { half_height },
            (None, Some(degrees), _) => Lens::FieldOfViewX { x: degrees.to_radians() },
            (None, None, Some(degrees)) => Lens::FieldOfView { y: degrees.to_radians() as f32 },
            (None, None, None) => camera.lens,
        },
        (None, ..) => return refused("distortion and fisheye: expected K beside them"),
    };
    // Faults of a lens are those of the keywords that it is given by.
    let keywords = match lens {
        _ if is_given => "lens",
        Lens::BrownConrady { .. } => "K, distortion",
        Lens::KannalaBrandt { .. } => "K, fisheye",
        _ => "K",
    };
    let checked = CameraSensor { lens, ..camera.clone() }.check_lens();
    checked.map_err(|fault| {
        Failure::value(match fault.place.as_str() {
            _ if is_given => format!("{keywords}: {fault}"),
            "x_degrees" | "y_degrees" => format!("fov_{fault}"),
            "largest_degrees" | "half_height" => fault.to_string(),
            _ => format!("{keywords}: {fault}"),
        })
    })?;
    Ok(lens)
}

/// fx, fy, cx, cy, or a matrix of 3 by 3.
fn intrinsics(given: &Bound<'_, PyAny>) -> PyResult<Intrinsics> {
    if let Ok(Numbers([fx, fy, cx, cy])) = given.extract::<Numbers<4>>() {
        return Ok(Intrinsics { fx, fy, cx, cy });
    }
    match given.extract::<Numbers<9>>() {
        Ok(Numbers([fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])) => Ok(Intrinsics { fx, fy, cx, cy }),
        _ => {
            let expected = "(fx, fy, cx, cy) or a matrix of 3 by 3 with zeros beside these and a last 1";
            Err(Failure::value(format!("K: expected {expected}, found {}", found(given))).into())
        }
    }
}

/// At most so many numbers; the others are 0.
struct Coefficients<const N: usize>([f64; N]);

impl<'a, 'py, const N: usize> FromPyObject<'a, 'py> for Coefficients<N> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let Row(numbers) = given.extract()?;
        let mut all = [0.0; N];
        match all.get_mut(..numbers.len()) {
            Some(first) => first.copy_from_slice(&numbers),
            None => {
                let message = format!("expected {}, found {}", Self::expected(), numbers.len());
                return Err(PyValueError::new_err(message));
            }
        }
        Ok(Self(all))
    }
}

impl<const N: usize> Argument for Coefficients<N> {
    fn expected() -> String {
        format!("at most {N} numbers")
    }
}
