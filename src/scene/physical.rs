//! Vehicles as rigid bodies, and what they bump into. A build without physics has `no_physics.rs` instead.

use super::check::Check;
use super::format::Obstacle;
use bevy_ecs::prelude::*;
pub use systems::physics::Physical;

impl Check<'_> {
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
}

/// Has a vehicle simulated as a body.
pub fn make_physical(vehicle: &mut EntityWorldMut, physical: Physical) {
    vehicle.insert(physical);
}

/// Puts an entity in the way of physical vehicles.
pub fn make_obstacle(entity: &mut EntityWorldMut, obstacle: Obstacle) {
    entity.insert(match obstacle {
        Obstacle::Box => systems::physics::Obstacle::Box,
        Obstacle::Mesh => systems::physics::Obstacle::Mesh,
    });
}
