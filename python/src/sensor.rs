//! Sensors: how they are described, and those of a world.

use crate::entity::{Entity, Kind, wrap_as};
use crate::errors::{Failure, Outcome};
use crate::values::{Facing, Numbers, Placing, Point};
use crate::world::Shared;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::name;
use relief::systems::draw::Intrinsics;
use relief::systems::ecs::clock::Clock;
use relief::systems::run::registry::StateId;
use relief::systems::run::spawn::Spawn;
use relief::systems::sensors::{
    self, Beams, CameraOutput, CameraSensor, CollisionSensor, Exposure, GeoOrigin, GnssNoise, GnssSensor, ImuNoise,
    ImuSensor, LaneSensor, Lens, LidarNoise, LidarSensor, SensorKind,
};
use std::sync::Arc;

/// Keyword arguments that are taken out one by one.
struct Arguments<'a, 'py>(Option<&'a Bound<'py, PyDict>>, Vec<&'static str>);

impl<'a, 'py> Arguments<'a, 'py> {
    fn new(given: Option<&'a Bound<'py, PyDict>>) -> Self {
        Self(given, Vec::new())
    }

    fn get(&mut self, name: &'static str) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.1.push(name);
        let found = self.0.map(|given| given.get_item(name)).transpose()?.flatten();
        Ok(found.filter(|value| !value.is_none()))
    }

    fn take<T>(&mut self, name: &'static str) -> PyResult<Option<T>>
    where
        T: for<'b> FromPyObject<'b, 'py>,
    {
        let Some(value) = self.get(name)? else { return Ok(None) };
        let named = |error: PyErr| {
            let py = value.py();
            let message = format!("{name}: {}", error.value(py));
            if error.is_instance_of::<PyTypeError>(py) {
                PyTypeError::new_err(message)
            } else {
                PyValueError::new_err(message)
            }
        };
        value.extract::<T>().map(Some).map_err(|error| named(error.into()))
    }

    /// Nothing is left that has no meaning.
    fn finish(self) -> PyResult<()> {
        for name in self.0.into_iter().flat_map(|given| given.keys()) {
            let name: String = name.extract()?;
            if !self.1.contains(&name.as_str()) {
                let hint =
                    name::nearest(&self.1, &name).map_or(String::new(), |near| format!("; did you mean {near}?"));
                return Err(PyTypeError::new_err(format!("unexpected argument {name}{hint}")));
            }
        }
        Ok(())
    }
}

/// Where a sensor is, and when it is due.
struct Mounting {
    placing: Placing,
    every: u32,
    phase: u32,
}

impl Mounting {
    fn read(arguments: &mut Arguments<'_, '_>) -> PyResult<Self> {
        let at = arguments.take::<Point>("at")?;
        let mut angle = |name| arguments.take::<f64>(name).map(Option::unwrap_or_default);
        let turn = (angle("yaw")?, angle("pitch")?, angle("roll")?);
        let look_at = arguments.take::<Point>("look_at")?;
        let every = arguments.take("every")?.unwrap_or(1);
        let phase = arguments.take("phase")?.unwrap_or(0);
        Ok(Self { placing: Placing::new(at, turn, look_at)?, every, phase })
    }

    fn add(
        self,
        py: Python<'_>,
        shared: &Arc<Shared>,
        name: &str,
        parent: Option<StateId>,
        kind: SensorKind,
    ) -> PyResult<Py<PyAny>> {
        let Self { placing, every, phase } = self;
        let facing = if matches!(kind, SensorKind::Camera(_)) { Facing::Backward } else { Facing::Forward };
        let sensor = sensors::Sensor { kind, every, phase };
        sensor.check().map_err(Failure::Value)?;
        if name.is_empty() {
            return Err(Failure::value("name: expected one, by which captures call the sensor").into());
        }
        let name = name.to_owned();
        let id = shared.with(py, move |world| {
            if let Some(parent) = parent {
                world.entity(parent)?;
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
        let mut arguments = Arguments::new(given);
        let mounting = Mounting::read(&mut arguments)?;
        let mut camera = CameraSensor::default();
        camera.size = arguments.take::<[u32; 2]>("size")?.map_or(camera.size, Into::into);
        camera.near = arguments.take("near")?.unwrap_or(camera.near);
        let far = arguments.take("far")?;
        camera.samples = arguments.take("samples")?.unwrap_or(camera.samples);
        if let Some(outputs) = arguments.take::<Vec<String>>("outputs")? {
            let find = |wanted: &String| name::find("output", &CameraOutput::ALL, wanted);
            let outputs: Result<_, _> = outputs.iter().map(find).collect();
            camera.outputs = outputs.map_err(Failure::Value)?;
        }
        if let Some(exposure) = arguments.take("exposure")? {
            camera.exposure = Exposure::Fixed(exposure);
        }
        camera.lens = lens(&mut arguments)?;
        let is_parallel = matches!(camera.lens, Lens::Orthographic { .. });
        camera.far = far.unwrap_or(if is_parallel { camera.near + 1000.0 } else { f32::INFINITY });
        arguments.finish()?;
        Ok(Self { camera, mounting })
    }

    pub fn add(self, py: Python<'_>, shared: &Arc<Shared>, name: &str, parent: Option<StateId>) -> PyResult<Py<PyAny>> {
        self.mounting.add(py, shared, name, parent, SensorKind::Camera(self.camera))
    }
}

/// By `K`, with what bends the picture, or by one of the angles and heights.
fn lens(arguments: &mut Arguments<'_, '_>) -> PyResult<Lens> {
    let intrinsics = arguments.get("K")?.map(|given| intrinsics(&given)).transpose()?;
    let fov_y = arguments.take::<f64>("fov_y_degrees")?;
    let half_height = arguments.take::<f32>("half_height")?;
    let distortion = arguments.get("distortion")?.map(|given| coefficients::<8>(&given)).transpose()?;
    let fisheye = arguments.get("fisheye")?.map(|given| coefficients::<4>(&given)).transpose()?;
    let largest_degrees = arguments.take::<f64>("largest_degrees")?;
    let refused = |message: &str| Err(Failure::value(message).into());
    if [intrinsics.is_some(), fov_y.is_some(), half_height.is_some()].iter().filter(|given| **given).count() > 1 {
        return refused("expected one of K, fov_y_degrees and half_height");
    }
    match (intrinsics, distortion, fisheye) {
        (Some(_), Some(_), Some(_)) => refused("expected one of distortion and fisheye"),
        (Some(intrinsics), Some(coefficients), None) => Ok(Lens::BrownConrady { intrinsics, coefficients }),
        (Some(intrinsics), None, Some(coefficients)) => {
            let largest_angle = largest_degrees.unwrap_or(90.0).to_radians();
            Ok(Lens::KannalaBrandt { intrinsics, coefficients, largest_angle })
        }
        (Some(intrinsics), None, None) => Ok(Lens::Pinhole(intrinsics)),
        (None, None, None) => Ok(match half_height {
            Some(half_height) => Lens::Orthographic { half_height },
            None => Lens::FieldOfView { y: fov_y.unwrap_or(60.0).to_radians() as f32 },
        }),
        (None, ..) => refused("distortion and fisheye need K"),
    }
}

/// fx, fy, cx, cy, or a matrix of 3 by 3.
fn intrinsics(given: &Bound<'_, PyAny>) -> PyResult<Intrinsics> {
    if let Ok(Numbers([fx, fy, cx, cy])) = given.extract::<Numbers<4>>() {
        return Ok(Intrinsics { fx, fy, cx, cy });
    }
    let expected = "K: expected (fx, fy, cx, cy) or a matrix of 3 by 3 with zeros beside these and a last 1";
    match given.extract::<Numbers<9>>() {
        Ok(Numbers([fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])) => Ok(Intrinsics { fx, fy, cx, cy }),
        _ => Err(Failure::value(expected).into()),
    }
}

/// As many as there are, the others 0.
fn coefficients<const N: usize>(given: &Bound<'_, PyAny>) -> PyResult<[f64; N]> {
    let mut all = [0.0; N];
    for (i, number) in given.try_iter()?.enumerate() {
        let place = all.get_mut(i).ok_or_else(|| Failure::value(format!("expected at most {N} coefficients")))?;
        *place = number?.extract()?;
    }
    Ok(all)
}

pub fn add_lidar(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &str,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Arguments::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let mut lidar = LidarSensor::default();
    if let Some(model) = arguments.take::<String>("beams")? {
        let found = Beams::MODELS.into_iter().find(|(known, _)| *known == model);
        let names: Vec<&str> = Beams::MODELS.iter().map(|(known, _)| *known).collect();
        let unknown = || Failure::value(format!("unknown beams {model:?}; expected one of: {}", names.join(", ")));
        lidar.beams = found.ok_or_else(unknown)?.1;
    }
    lidar.hz = arguments.take("hz")?.unwrap_or(lidar.hz);
    lidar.columns = arguments.take("columns")?.unwrap_or(lidar.columns);
    lidar.range = arguments.take("range")?.unwrap_or(lidar.range);
    lidar.attenuation = arguments.take("attenuation")?.unwrap_or(lidar.attenuation);
    lidar.sweep = arguments.take("sweep")?.unwrap_or(lidar.sweep);
    lidar.noise = LidarNoise {
        range_sigma: arguments.take("range_sigma")?.unwrap_or(0.0),
        drop_rate: arguments.take("drop_rate")?.unwrap_or(0.0),
        drop_below: arguments.take("drop_below")?.unwrap_or(0.0),
    };
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Lidar(lidar))
}

pub fn add_imu(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &str,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Arguments::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let mut noise = ImuNoise::default();
    noise.accelerometer_density = arguments.take("accelerometer_density")?.unwrap_or(noise.accelerometer_density);
    noise.gyroscope_density = arguments.take("gyroscope_density")?.unwrap_or(noise.gyroscope_density);
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Imu(ImuSensor { noise }))
}

pub fn add_gnss(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &str,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Arguments::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let mut noise = GnssNoise::default();
    noise.horizontal_sigma = arguments.take("horizontal_sigma")?.unwrap_or(noise.horizontal_sigma);
    noise.vertical_sigma = arguments.take("vertical_sigma")?.unwrap_or(noise.vertical_sigma);
    noise.velocity_sigma = arguments.take("velocity_sigma")?.unwrap_or(noise.velocity_sigma);
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Gnss(GnssSensor { noise }))
}

pub fn add_collision(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &str,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Arguments::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let mut collision = CollisionSensor::default();
    collision.margin = arguments.take("margin")?.unwrap_or(collision.margin);
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Collision(collision))
}

pub fn add_lane(
    py: Python<'_>,
    shared: &Arc<Shared>,
    name: &str,
    parent: Option<StateId>,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<PyAny>> {
    let mut arguments = Arguments::new(given);
    let mounting = Mounting::read(&mut arguments)?;
    let mut lane = LaneSensor::default();
    lane.reach = arguments.take("reach")?.unwrap_or(lane.reach);
    arguments.finish()?;
    mounting.add(py, shared, name, parent, SensorKind::Lane(lane))
}

/// A matrix of 3 by 3, float64.
pub fn camera_matrix<'py>(py: Python<'py>, own: &Intrinsics) -> Bound<'py, PyArray2<f64>> {
    let rows = [[own.fx, 0.0, own.cx], [0.0, own.fy, own.cy], [0.0, 0.0, 1.0]];
    Array2::from_shape_fn((3, 3), |(row, column)| rows[row][column]).into_pyarray(py)
}

/// A sensor of a world.
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct Sensor;

impl Sensor {
    fn read<T: Send>(own: &PyRef<'_, Self>, value: impl FnOnce(&sensors::Sensor) -> T + Send) -> PyResult<T> {
        let entity: &Entity = own.as_super();
        let id = entity.id;
        entity.with(own.py(), move |world| -> Outcome<T> {
            let sensor = world.component::<sensors::Sensor>(id)?;
            sensor.as_ref().map(value).ok_or_else(|| Failure::Gone(format!("the sensor of entity {}", id.0 + 1)))
        })
    }
}

#[pymethods]
impl Sensor {
    /// "camera", "lidar", "imu", "gnss", "collision" or "lane".
    #[getter]
    fn kind(own: PyRef<'_, Self>) -> PyResult<&'static str> {
        Self::read(&own, |sensor| match sensor.kind {
            SensorKind::Camera(_) => "camera",
            SensorKind::Lidar(_) => "lidar",
            SensorKind::Imu(_) => "imu",
            SensorKind::Gnss(_) => "gnss",
            SensorKind::Collision(_) => "collision",
            SensorKind::Lane(_) => "lane",
        })
    }

    /// It is due once in so many steps.
    #[getter]
    fn every(own: PyRef<'_, Self>) -> PyResult<u32> {
        Self::read(&own, |sensor| sensor.every)
    }

    /// It is due after step s where s mod `every` is this.
    #[getter]
    fn phase(own: PyRef<'_, Self>) -> PyResult<u32> {
        Self::read(&own, |sensor| sensor.phase)
    }

    /// Of a camera: the names of what it gives. Of others none.
    #[getter]
    fn outputs(own: PyRef<'_, Self>) -> PyResult<Vec<&'static str>> {
        Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => camera.outputs.iter().map(|(name, _)| name).collect(),
            _ => Vec::new(),
        })
    }

    /// Of a camera: width and height of its pictures, pixels.
    #[getter]
    fn size(own: PyRef<'_, Self>) -> PyResult<Option<(u32, u32)>> {
        Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => Some(camera.size),
            _ => None,
        })
    }

    /// Of a camera: its matrix, float64 (3, 3), pixels; integers are the middles of pixels. ``None`` where the
    /// projection is parallel.
    #[getter]
    #[allow(non_snake_case)]
    fn K(own: PyRef<'_, Self>) -> PyResult<Option<Py<PyArray2<f64>>>> {
        let intrinsics = Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => camera.intrinsics(),
            _ => None,
        })?;
        Ok(intrinsics.map(|intrinsics| camera_matrix(own.py(), &intrinsics).unbind()))
    }
}
