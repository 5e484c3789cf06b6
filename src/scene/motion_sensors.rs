//! Sensors of motion and of what is around vehicles in scene files, and where on Earth a scene is.

use super::check::Check;
use serde::Deserialize;
use systems::sensors::wgs84::Geodetic;
use systems::sensors::{self, GnssNoise, ImuNoise, Sensor, SensorKind};

/// Its fields are those of [`sensors::ImuSensor`].
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct ImuSensor {
    pub noise: ImuNoise,
    pub every: u32,
    pub phase: u32,
}

impl Default for ImuSensor {
    fn default() -> Self {
        Self { noise: ImuNoise::default(), every: 1, phase: 0 }
    }
}

/// Its fields are those of [`sensors::GnssSensor`].
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct GnssSensor {
    pub noise: GnssNoise,
    pub every: u32,
    pub phase: u32,
}

impl Default for GnssSensor {
    fn default() -> Self {
        Self { noise: GnssNoise::default(), every: 1, phase: 0 }
    }
}

/// Its fields are those of [`sensors::CollisionSensor`].
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct CollisionSensor {
    pub margin: f32,
    pub every: u32,
    pub phase: u32,
}

impl Default for CollisionSensor {
    fn default() -> Self {
        Self { margin: sensors::CollisionSensor::default().margin, every: 1, phase: 0 }
    }
}

/// Its fields are those of [`sensors::LaneSensor`].
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct LaneSensor {
    pub reach: f32,
    pub every: u32,
    pub phase: u32,
}

impl Default for LaneSensor {
    fn default() -> Self {
        Self { reach: sensors::LaneSensor::default().reach, every: 1, phase: 0 }
    }
}

impl ImuSensor {
    /// As a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Imu(sensors::ImuSensor { noise: self.noise });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

impl GnssSensor {
    /// As a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Gnss(sensors::GnssSensor { noise: self.noise });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

impl CollisionSensor {
    /// As a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Collision(sensors::CollisionSensor { margin: self.margin });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

impl LaneSensor {
    /// As a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Lane(sensors::LaneSensor { reach: self.reach });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

/// Where on Earth a scene is.
#[derive(Deserialize, Clone, Copy, Debug)]
#[serde(deny_unknown_fields)]
pub struct GeoOrigin {
    pub latitude_degrees: f64,
    pub longitude_degrees: f64,
    #[serde(default)]
    pub altitude: f64,
    #[serde(default)]
    pub at: [f64; 3],
}

impl GeoOrigin {
    /// As a resource.
    pub fn resource(self) -> sensors::GeoOrigin {
        let Self { latitude_degrees, longitude_degrees, altitude, at } = self;
        sensors::GeoOrigin { place: Geodetic { latitude_degrees, longitude_degrees, altitude }, at: at.into() }
    }
}

impl Check<'_> {
    pub fn geo_origin(&mut self, origin: &GeoOrigin) {
        self.field("geo_origin", |c| {
            let numbers = [
                ("latitude_degrees", origin.latitude_degrees, -90.0, 90.0),
                ("longitude_degrees", origin.longitude_degrees, -180.0, 180.0),
                ("altitude", origin.altitude, -1e5, 1e8),
            ];
            for (name, value, least, most) in numbers {
                if !(least..=most).contains(&value) {
                    let message = format!("expected a number from {least} to {most}, found {value}");
                    c.field(name, |c| c.fault(message));
                }
            }
            c.position("at", &origin.at);
        });
    }

    /// A sensor as it would be as a component.
    pub fn motion_sensor(&mut self, sensor: &Sensor) {
        self.rate(sensor.every, sensor.phase);
        let fault = match &sensor.kind {
            SensorKind::Imu(imu) => imu.check(),
            SensorKind::Gnss(gnss) => gnss.check(),
            SensorKind::Collision(collision) => collision.check(),
            SensorKind::Lane(lane) => lane.check(),
            SensorKind::Camera(_) | SensorKind::Lidar(_) => Ok(()),
        };
        if let Err(message) = fault {
            self.fault(message);
        }
        match &sensor.kind {
            SensorKind::Gnss(_) if self.scene.geo_origin.is_none() => {
                self.fault("expected the scene to have a geo_origin: where on Earth it is");
            }
            SensorKind::Collision(_) | SensorKind::Lane(_) if !cfg!(feature = "vehicles") => {
                self.fault("this build has no vehicles (feature `vehicles`)");
            }
            _ => {}
        }
    }
}
