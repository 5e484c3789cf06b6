//! Sensors without pictures: what a kind is, those of the library and of programs; and where sensors were when they were
//! due before. Uses captures.

mod barometer;
#[cfg(feature = "vehicles")]
mod bodies;
#[cfg(feature = "vehicles")]
mod collisions;
pub(crate) mod custom;
mod gnss;
mod imu;
pub(crate) mod kind;
#[cfg(feature = "vehicles")]
mod lanes;
#[cfg(all(feature = "vehicles", not(feature = "physics")))]
mod no_physics;
#[cfg(not(feature = "vehicles"))]
mod no_vehicles;
#[cfg(feature = "physics")]
mod obstacles;
pub(crate) mod place;
pub(crate) mod track;

pub use barometer::BarometerCapture;
pub use custom::{CustomSensor, add_sensor_kind};
pub use gnss::GnssCapture;
pub use imu::ImuCapture;
pub use kind::{Measuring, ReadingSensor, kind_name, lack, record_schemas};

use kind::AnyReadingSensor;
use systems::sensors::SensorKind;

/// Settings of a sensor of the library's kinds; `None` of cameras, lidars, and kinds that a program adds.
pub(crate) fn built_in(kind: &SensorKind) -> Option<&dyn AnyReadingSensor> {
    match kind {
        SensorKind::Imu(settings) => Some(settings),
        SensorKind::Gnss(settings) => Some(settings),
        SensorKind::Collision(settings) => Some(settings),
        SensorKind::Lane(settings) => Some(settings),
        SensorKind::Barometer(settings) => Some(settings),
        SensorKind::Camera(_) | SensorKind::Lidar(_) | SensorKind::Custom(_) => None,
    }
}
