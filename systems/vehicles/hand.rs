//! Motion of a vehicle under manual control.

use super::components::Controls;
use super::types::{Limits, VehicleType};

/// m/s²: what rolls slows down by so much.
const ROLLING: f32 = 0.2;
/// m/s² sideways, the most that steering gets: about what tyres hold.
const GRIP: f32 = 7.0;
/// m/s: slower than that, pedals for the other direction change it.
const TURNING_POINT: f32 = 0.2;

/// m/s² that pedals ask for. The throttle brakes while the vehicle rolls the other way, and does less the faster it is.
pub(super) fn acceleration(controls: &Controls, limits: &Limits, speed: f32) -> f32 {
    let throttle = if controls.throttle.is_finite() { controls.throttle.clamp(-1.0, 1.0) } else { 0.0 };
    let top = if throttle < 0.0 { limits.reverse_speed } else { limits.speed };
    let drive = if throttle * speed < 0.0 && speed.abs() > TURNING_POINT {
        throttle * limits.braking
    } else {
        throttle * limits.acceleration * (1.0 - speed.abs() / top.max(0.1)).max(0.0)
    };
    drive - speed.signum() * resistance(controls, limits) * f32::from(u8::from(speed != 0.0))
}

fn resistance(controls: &Controls, limits: &Limits) -> f32 {
    let brake = if controls.brake.is_finite() { controls.brake.clamp(0.0, 1.0) } else { 0.0 };
    brake * limits.braking + if controls.throttle == 0.0 { ROLLING } else { 0.0 }
}

/// The acceleration and the speed after a step: brakes stop, they do not reverse.
pub(super) fn step(controls: &Controls, limits: &Limits, speed: f64, acceleration: f32, seconds: f64) -> (f32, f64) {
    let next = speed + f64::from(acceleration) * seconds;
    let turns_back = speed * next < 0.0;
    let is_held = speed == 0.0 && resistance(controls, limits) > controls.throttle.abs() * limits.acceleration;
    if turns_back || is_held {
        return (if speed == 0.0 { 0.0 } else { acceleration }, 0.0);
    }
    (acceleration, next)
}

/// The steering angle that is asked for, within what tyres hold at that speed.
pub(super) fn steering(controls: &Controls, kind: &VehicleType, speed: f32) -> f32 {
    let steer = if controls.steer.is_finite() { controls.steer.clamp(-1.0, 1.0) } else { 0.0 };
    let held = (GRIP * kind.wheelbase / (speed * speed).max(0.01)).atan();
    steer * kind.limits.steering.min(held)
}
