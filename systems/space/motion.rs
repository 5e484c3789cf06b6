//! Motion of entities by themselves.

use super::interpolation::Interpolated;
use super::transform::Transform;
use crate::ecs::clock::Clock;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// Turns about its parent's axis at an even rate; the step system writes the entity's rotation.
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[require(Transform, Interpolated)]
pub struct Spin {
    /// Unit axis in the parent's space.
    pub axis: Vec3,
    /// Radians per second.
    pub rate: f32,
    /// The rotation at time 0.
    pub start: Quat,
}

impl Spin {
    /// Tells if its numbers are finite, its axis a unit vector and its start a rotation.
    pub(crate) fn is_valid(&self) -> bool {
        self.axis.is_normalized() && self.rate.is_finite() && self.start.is_normalized()
    }
}

/// Turns every [`Spin`] to its angle at the clock's time. From the time and not from the last angle: frame 1,000 is
/// the same whether one gets there in one jump or a thousand steps, and errors do not add up.
pub fn spin(clock: Res<Clock>, mut spinning: Query<(&Spin, &mut Transform)>) {
    let seconds = clock.seconds();
    for (spin, mut transform) in &mut spinning {
        let angle = (f64::from(spin.rate) * seconds).rem_euclid(std::f64::consts::TAU) as f32;
        transform.rotation = Quat::from_axis_angle(spin.axis, angle) * spin.start;
    }
}
