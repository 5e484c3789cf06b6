//! Origin of the world's coordinates.
//!
//! Places are kept in 32 bits, which are a millimetre apart 10 km from zero and half a metre apart where maps are, at
//! thousands of kilometres. So whatever is read from files has its places in 64 bits, and the world has them from an
//! origin near by: a scene on a map is the same, to the bit, as the same scene at zero.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Metres on each axis from the origin within which places are precise: in 32 bits they are less than 2 mm apart there.
pub const PRECISE: f64 = 20_000.0;

/// `file_from_world`, which is a translation only: where the world's zero is in the coordinates of the scene's file.
/// State: recordings and snapshots have their places from it. Metres.
#[derive(Resource, Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Origin(pub DVec3);

impl Origin {
    /// A place of the world in the file's coordinates.
    pub fn file_from_world(self, place: Vec3) -> DVec3 {
        self.0 + place.as_dvec3()
    }

    /// Takes nothing over: what was saved has to count from the same origin.
    pub(crate) fn take_over(&mut self, saved: Self) -> Result<(), &'static str> {
        if saved == *self { Ok(()) } else { Err("expected the scene's origin, found another") }
    }
}

/// Distance between two neighbouring 32-bit numbers that far from zero, metres.
pub fn spacing(distance: f64) -> f64 {
    let distance = distance.abs() as f32;
    f64::from(distance.next_up()) - f64::from(distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_as_far_apart_as_24_bits_have_it() {
        // From 2^n to 2^(n+1) there are 2^23 numbers: they are 2^(n−23) apart.
        for (distance, exponent) in [(1.5, -23), (10_000.0, -10), (PRECISE, -9), (-5e6, -1), (1e7, 0)] {
            assert_eq!(spacing(distance), 2f64.powi(exponent), "{distance}");
        }
    }
}
