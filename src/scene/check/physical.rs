//! Vehicles as rigid bodies; a build without physics refuses them.

use super::walk::Check;
use crate::scene::format::roads::Physical;

impl Check<'_> {
    #[cfg(feature = "physics")]
    pub(super) fn physical(&mut self, physical: &Physical) {
        let positive = [
            ("mass", physical.mass, 1e6),
            ("friction", physical.friction, 10.0),
            ("engine_force", physical.engine_force, 1e9),
            ("brake_force", physical.brake_force, 1e9),
            ("drag", physical.drag, 1e4),
            ("stiffness", physical.stiffness, 1e9),
            ("damping", physical.damping, 1e9),
            ("rest_length", physical.rest_length, 5.0),
        ];
        for (name, value, most) in positive {
            value.into_iter().for_each(|value| self.number(name, value, 1e-3, most));
        }
    }

    #[cfg(not(feature = "physics"))]
    pub(super) fn physical(&mut self, _: &Physical) {
        self.fault("this build has no physics (feature `physics`)");
    }
}
