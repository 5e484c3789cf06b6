//! What moves by itself.

use crate::clock::Clock;
use crate::components::Spin;
use crate::transform::Transform;
use bevy_ecs::prelude::*;
use glam::Quat;

/// Turns every [`Spin`] to its angle at the clock's time. From the time and not from the last angle: frame 1,000 is
/// the same whether one gets there in one jump or a thousand steps, and errors do not add up.
pub fn spin(clock: Res<Clock>, mut spinning: Query<(&Spin, &mut Transform)>) {
    let seconds = clock.seconds();
    for (spin, mut transform) in &mut spinning {
        let angle = (f64::from(spin.rate) * seconds).rem_euclid(std::f64::consts::TAU) as f32;
        transform.rotation = Quat::from_axis_angle(spin.axis, angle) * spin.start;
    }
}
