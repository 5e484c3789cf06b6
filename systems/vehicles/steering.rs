//! Steering of vehicles: pure pursuit, the kinematic bicycle model, and the trailer behind it.

use super::components::Motion;
use super::turns::{about_y, left_of};
use super::types::{Limits, Trailer};
use glam::{DVec2, Quat, Vec2, Vec3};

/// Lookahead of pure pursuit: wheelbases, and metres per m/s; metres at most.
const LOOKAHEAD: (f32, f32, f32) = (1.2, 0.6, 25.0);

/// Radians to which a hitch turns at most.
const JACKKNIFE: f64 = 1.4;

/// The way a vehicle looks, (x, z).
pub fn forward(yaw: f32) -> Vec2 {
    let (sin, cos) = yaw.sin_cos();
    Vec2::new(sin, cos)
}

/// The yaw of what is turned so.
pub fn yaw(rotation: Quat) -> f64 {
    let forward = (rotation * Vec3::Z).as_dvec3();
    forward.x.atan2(forward.z)
}

/// Distance ahead on its path that a driver aims at, metres.
pub fn lookahead(wheelbase: f32, speed: f32) -> f32 {
    (LOOKAHEAD.0 * wheelbase + LOOKAHEAD.1 * speed.abs()).clamp(1.0, LOOKAHEAD.2)
}

/// The steering angle that leads over a circle from the rear axle, where the vehicle looks along `forward`, through the
/// target, `off` metres from there: atan(2·L·sin α / l). Coulter, "Implementation of the pure pursuit path tracking
/// algorithm", CMU-RI-TR-92-01 (1992).
pub fn pursue(wheelbase: f32, forward: Vec2, off: Vec2) -> f32 {
    let curvature = 2.0 * off.dot(left_of(forward)) / off.length_squared().max(1e-6);
    (wheelbase * curvature).atan()
}

/// The steering angle after a step toward a wanted one.
pub fn turn_wheel(limits: &Limits, steering: f32, wanted: f32, seconds: f32) -> f32 {
    let change = limits.steering_rate * seconds;
    wanted.clamp(-limits.steering, limits.steering).clamp(steering - change, steering + change)
}

/// One step of the kinematic bicycle model with the rear axle as reference (Rajamani, "Vehicle Dynamics and Control",
/// 2nd edition, section 2.2, with ℓr = 0): dx/dt = v·sin ψ, dz/dt = v·cos ψ, dψ/dt = v·tan δ / L. `speed` is the mean
/// of the step; the heading of its middle makes a step as exact as its square. Returns where to, (x, z); the place is
/// left to what knows the ground.
pub fn roll(motion: &mut Motion, wheelbase: f32, trailer: Option<&Trailer>, speed: f64, seconds: f64) -> DVec2 {
    let metres = speed * seconds;
    let turned = metres * f64::from(motion.steering.tan()) / f64::from(wheelbase);
    let (sin, cos) = (motion.yaw + turned * 0.5).sin_cos();
    if let Some(trailer) = trailer {
        motion.hitch = pull(trailer, motion.hitch, metres, turned);
    }
    motion.yaw = wrapped(motion.yaw + turned);
    motion.rolled += metres;
    DVec2::new(sin, cos) * metres
}

/// Change of the angle φ = `hitch` of a trailer while the vehicle rolls and turns: by a step's `metres` and `turned`
/// radians, or per second. The hitch moves by `metres` along the vehicle's forward and by h·`turned` to its left. The
/// trailer's axles only follow along the trailer, so that it turns by the part of that across it over its length
/// (Rouchon, Fliess, Lévine, Martin, "Flatness and motion planning: the car with n trailers", ECC 1993): dψt = (−sin
/// φ·metres + h·cos φ·turned) / Lt, dφ = dψt − `turned`.
pub(crate) fn hitch_change(trailer: &Trailer, hitch: f64, metres: f64, turned: f64) -> f64 {
    let (sin, cos) = hitch.sin_cos();
    (f64::from(trailer.hitch) * cos * turned - sin * metres) / f64::from(trailer.length.max(0.1)) - turned
}

/// The hitch after the vehicle rolled and turned; midpoint rule.
pub(super) fn pull(trailer: &Trailer, hitch: f64, metres: f64, turned: f64) -> f64 {
    let rate = |hitch: f64| hitch_change(trailer, hitch, metres, turned);
    (hitch + rate(hitch + 0.5 * rate(hitch))).clamp(-JACKKNIFE, JACKKNIFE)
}

/// The same heading in −π..π.
pub(super) fn wrapped(yaw: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if yaw.abs() <= PI { yaw } else { yaw - TAU * (yaw / TAU).round() }
}

/// The left-to-right vector of a heading in space, and the like: columns of the rotation of something that looks along
/// `forward` on ground that rises by `pitch` ahead and by `roll` to the left (radians).
pub fn posture(yaw: f32, pitch: f32, roll: f32) -> glam::Quat {
    let turned = about_y(yaw);
    if pitch == 0.0 && roll == 0.0 {
        return turned;
    }
    turned * glam::Quat::from_rotation_x(-pitch) * glam::Quat::from_rotation_z(roll)
}

/// Pitch and roll of what is turned so, as [`posture`] has them.
pub(super) fn tilt(rotation: Quat) -> [f64; 2] {
    let [left, up, forward] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| f64::from((rotation * axis).y));
    [forward.clamp(-1.0, 1.0).asin(), left.atan2(up)]
}

/// A vector of the ground plane as one of space.
pub(super) fn flat(v: Vec2) -> Vec3 {
    Vec3::new(v.x, 0.0, v.y)
}
