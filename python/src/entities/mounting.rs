//! Keyword arguments that describe and mount sensors.

use crate::entities::classes::wrap_as;
use crate::entities::entity::Kind;
use crate::errors::Failure;
use crate::given::arguments::{Argument, Keywords, Names, Row, found, required};
use crate::given::fields;
use crate::given::values::{Facing, Numbers, Placing, Size};
use crate::worlds::world::Shared;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use relief::name;
use relief::sense::{sensor_name_on, sensor_names};
use relief::systems::draw::Intrinsics;
use relief::systems::ecs::clock::Clock;
use relief::systems::run::registry::StateId;
use relief::systems::run::spawn::Spawn;
use relief::systems::sensors::{
    self, CameraOutput, CameraSensor, CollisionSensor, Exposure, GeoOrigin, GnssSensor, ImageNoise, ImuSensor,
    LaneSensor, Lens, LidarSensor, SensorKind,
};
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
        sensor.check().map_err(Failure::Value)?;
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
            if matches!(sensor.kind, SensorKind::Gnss(_))
                && world.simulation.world.get_resource::<GeoOrigin>().is_none()
            {
                return Err(Failure::value("expected the scene to have a geo_origin: where on Earth it is"));
            }
            if let SensorKind::Lidar(lidar) = &sensor.kind {
                let seconds = world.simulation.world.resource::<Clock>().step_seconds * f64::from(sensor.every);
                lidar.check_beams(seconds).map_err(Failure::Value)?;
            }
            let origin = if parent.is_none() { world.origin() } else { Default::default() };
            let transform = placing.transform(origin, facing);
            world.spawn(Spawn::Sensor { name, transform, parent, sensor })
        })?;
        wrap_as(py, shared, id, Kind::Sensor)
    }
}

/// A camera that is to be mounted.
pub struct CameraArguments {
    camera: CameraSensor,
    mounting: Mounting,
}

impl CameraArguments {
    pub fn read(given: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut arguments = Keywords::new(given);
        let mounting = Mounting::read(&mut arguments)?;
        let mut camera = CameraSensor::default();
        camera.size = arguments.take::<Size>("size")?.map_or(camera.size, |size| size.0);
        camera.near = arguments.take("near")?.unwrap_or(camera.near);
        let far = arguments.take("far")?;
        camera.samples = arguments.take("samples")?.unwrap_or(camera.samples);
        if let Some(outputs) = arguments.take::<Names>("outputs")?.map(Names::all) {
            let find = |wanted: &String| name::find("output", &CameraOutput::ALL, wanted);
            let outputs: Result<_, _> = outputs.iter().map(find).collect();
            camera.outputs = outputs.map_err(Failure::Value)?;
        }
        if let Some(given) = arguments.get("exposure")? {
            camera.exposure = exposure(&given)?;
        }
        camera.noise =
            arguments.get("noise")?.map(|given| fields::of_dict::<ImageNoise>("noise", &given)).transpose()?;
        camera.lens = lens(&mut arguments, camera.size)?;
        let is_parallel = matches!(camera.lens, Lens::Orthographic { .. });
        camera.far = far.unwrap_or(if is_parallel { camera.near + 1000.0 } else { f32::INFINITY });
        arguments.finish()?;
        let lens_arguments = match camera.lens {
            Lens::BrownConrady { .. } => "K, distortion",
            Lens::KannalaBrandt { .. } => "K, fisheye",
            _ => "K",
        };
        camera.check_lens().map_err(|fault| Failure::value(format!("{lens_arguments}: {fault}")))?;
        Ok(Self { camera, mounting })
    }

    pub fn add(
        self,
        py: Python<'_>,
        shared: &Arc<Shared>,
        name: &Bound<'_, PyAny>,
        parent: Option<StateId>,
    ) -> PyResult<Py<PyAny>> {
        self.mounting.add(py, shared, name, parent, SensorKind::Camera(self.camera))
    }
}

/// A number, or as scene files have it.
fn exposure(given: &Bound<'_, PyAny>) -> PyResult<Exposure> {
    if let Ok(fixed) = given.extract::<f32>() {
        return Ok(Exposure::Fixed(fixed));
    }
    if given.extract::<&str>().is_ok_and(|name| name == "metered") {
        let metered = [("metered", PyDict::new(given.py()))].into_py_dict(given.py())?;
        return fields::choice("exposure", "metered", metered.as_any());
    }
    fields::choice("exposure", "a number, \"scene\", \"metered\" or {\"metered\": {…}}", given)
}

/// By `K`, with what bends the picture, or by one of the angles and heights.
fn lens(arguments: &mut Keywords<'_, '_>, size: (u32, u32)) -> PyResult<Lens> {
    let intrinsics = arguments.get("K")?.map(|given| intrinsics(&given)).transpose()?;
    let fov_y = arguments.take::<f64>("fov_y_degrees")?;
    let fov_x = arguments.take::<f64>("fov_x_degrees")?;
    let half_height = arguments.take::<f32>("half_height")?;
    let distortion = arguments.take::<Coefficients<8>>("distortion")?.map(|own| own.0);
    let fisheye = arguments.take::<Coefficients<4>>("fisheye")?.map(|own| own.0);
    let largest_degrees = arguments.take::<f64>("largest_degrees")?;
    let refused = |message: &str| Err(Failure::value(message).into());
    let given = [intrinsics.is_some(), fov_y.is_some(), fov_x.is_some(), half_height.is_some()];
    if given.iter().filter(|given| **given).count() > 1 {
        return refused("expected one of K, fov_y_degrees, fov_x_degrees and half_height");
    }
    if let Some(degrees) = fov_x.filter(|degrees| !(0.01..=179.0).contains(degrees)) {
        return refused(&format!("fov_x_degrees: expected a number from 0.01 to 179, found {degrees}"));
    }
    if largest_degrees.is_some() && fisheye.is_none() {
        return refused("largest_degrees: expected fisheye beside it");
    }
    if let Some(degrees) = largest_degrees.filter(|degrees| !(*degrees > 0.0 && *degrees <= 180.0)) {
        return refused(&format!("largest_degrees: expected a number above 0, at most 180, found {degrees}"));
    }
    match (intrinsics, distortion, fisheye) {
        (Some(_), Some(_), Some(_)) => refused("expected one of distortion and fisheye"),
        (Some(intrinsics), Some(coefficients), None) => Ok(Lens::BrownConrady { intrinsics, coefficients }),
        (Some(intrinsics), None, Some(coefficients)) => {
            let largest_angle = largest_degrees.unwrap_or(90.0).to_radians();
            Ok(Lens::KannalaBrandt { intrinsics, coefficients, largest_angle })
        }
        (Some(intrinsics), None, None) => Ok(Lens::Pinhole(intrinsics)),
        (None, None, None) => Ok(match (half_height, fov_x) {
            (Some(half_height), _) => Lens::Orthographic { half_height },
            (None, Some(degrees)) => Lens::of_fov_x(degrees.to_radians(), size),
            (None, None) => Lens::FieldOfView { y: fov_y.unwrap_or(60.0).to_radians() as f32 },
        }),
        (None, ..) => refused("distortion and fisheye: expected K beside them"),
    }
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

pub fn add_lidar(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &Bound<'_, PyAny>,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Keywords::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let lidar: LidarSensor = fields::take(&mut arguments)?;
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Lidar(lidar))
}

pub fn add_imu(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &Bound<'_, PyAny>,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Keywords::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let own: ImuSensor = fields::take(&mut arguments)?;
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Imu(own))
}

pub fn add_gnss(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &Bound<'_, PyAny>,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Keywords::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let own: GnssSensor = fields::take(&mut arguments)?;
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Gnss(own))
}

pub fn add_collision(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &Bound<'_, PyAny>,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Keywords::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let own: CollisionSensor = fields::take(&mut arguments)?;
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Collision(own))
}

pub fn add_lane(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &Bound<'_, PyAny>,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Keywords::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let own: LaneSensor = fields::take(&mut arguments)?;
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Lane(own))
}
