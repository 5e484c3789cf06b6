//! Sensors of motion and of what is around vehicles, and where on Earth a scene is.

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
    /// Converts to a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Imu(sensors::ImuSensor { noise: self.noise });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

impl GnssSensor {
    /// Converts to a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Gnss(sensors::GnssSensor { noise: self.noise });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

impl CollisionSensor {
    /// Converts to a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Collision(sensors::CollisionSensor { margin: self.margin });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

impl LaneSensor {
    /// Converts to a component.
    pub fn sensor(&self) -> Sensor {
        let kind = SensorKind::Lane(sensors::LaneSensor { reach: self.reach });
        Sensor { kind, every: self.every, phase: self.phase }
    }
}

/// Place of a scene on Earth.
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
    /// Converts to a resource.
    pub fn resource(self) -> sensors::GeoOrigin {
        let Self { latitude_degrees, longitude_degrees, altitude, at } = self;
        sensors::GeoOrigin { place: Geodetic { latitude_degrees, longitude_degrees, altitude }, at: at.into() }
    }
}
