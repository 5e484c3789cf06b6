//! Sensors of motion and of what is around vehicles, and where on Earth a scene is.

use super::walk::Check;
use crate::scene::format::motion_sensors::GeoOrigin;
use systems::sensors::{Sensor, SensorKind};

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
