//! Place of a scene on Earth.
//!
//! The scene is a plane that touches the Earth in one point, the [`GeoOrigin`]: its +Z is east there, its +X north, its
//! +Y up. So a place is exact however far away it is; it is the Earth that bends away from the plane, 0.8 m at 3.2 km.

use super::wgs84::Geodetic;
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3Swizzles};

/// Place of a scene on Earth. Worlds without it are nowhere.
#[derive(Resource, Clone, Copy, PartialEq, Debug, Default)]
pub struct GeoOrigin {
    /// The place of a point of the scene.
    pub place: Geodetic,
    /// Position of that point in the coordinates of the scene's file, metres.
    pub at: DVec3,
}

impl GeoOrigin {
    /// East, north and up of the origin, metres: of a point in the coordinates of the scene's file.
    pub fn enu(&self, point: DVec3) -> DVec3 {
        (point - self.at).zxy()
    }

    /// The place on Earth of a point in the coordinates of the scene's file.
    pub fn geodetic(&self, point: DVec3) -> Geodetic {
        Geodetic::from_ecef(self.place.ecef() + self.place.ecef_from_enu() * self.enu(point))
    }
}
