//! Manual control: keys that are held become a vehicle's [`Controls`], step by step.

use glam::Vec3;
use systems::vehicles::{Controls, Headlights, Indicator, Motion, VehicleType};
use winit::keyboard::{KeyCode, PhysicalKey};

/// Rate of steering while a key is held and back to the middle, full locks per second.
const TURN: f32 = 1.6;
const RETURN: f32 = 3.0;
/// m/s² sideways that keys do not steer beyond.
const SIDEWAYS: f32 = 5.0;
/// m/s: slower, the key for backward is not the brake.
const STANDING: f64 = 0.3;

/// The keys of the wheel and the pedals.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Wheel {
    forward: bool,
    backward: bool,
    left: bool,
    right: bool,
}

impl Wheel {
    /// Takes note of a key; `true` if it is one that drives.
    pub fn key(&mut self, key: PhysicalKey, pressed: bool) -> bool {
        let held = match key {
            PhysicalKey::Code(KeyCode::ArrowUp) => &mut self.forward,
            PhysicalKey::Code(KeyCode::ArrowDown) => &mut self.backward,
            PhysicalKey::Code(KeyCode::ArrowLeft) => &mut self.left,
            PhysicalKey::Code(KeyCode::ArrowRight) => &mut self.right,
            _ => return false,
        };
        *held = pressed;
        true
    }

    /// The controls after another step of so many seconds.
    pub fn controls(self, before: Controls, motion: &Motion, kind: &VehicleType, seconds: f32) -> Controls {
        let side = |held: bool| f32::from(u8::from(held));
        let wanted = (side(self.left) - side(self.right)) * most_steering(motion.speed as f32, kind);
        let rate = if wanted == 0.0 { RETURN } else { TURN } * seconds;
        let steer = before.steer + (wanted - before.steer).clamp(-rate, rate);
        let (throttle, brake) = match (self.forward, self.backward) {
            (true, true) => (0.0, 1.0),
            (true, false) if motion.speed < -STANDING => (0.0, 1.0),
            (true, false) => (1.0, 0.0),
            (false, true) if motion.speed > STANDING => (0.0, 1.0),
            (false, true) => (-0.6, 0.0),
            (false, false) => (0.0, 0.0),
        };
        Controls { steer, throttle, brake, ..before }
    }
}

/// Steering limit as a fraction of full lock, 0..1: keeps to [`SIDEWAYS`] by the bicycle model, tan δ = L·a / v².
fn most_steering(speed: f32, kind: &VehicleType) -> f32 {
    let angle = (kind.wheelbase * SIDEWAYS / (speed * speed).max(1e-3)).atan();
    (angle / kind.limits.steering).min(1.0)
}

/// Off, low beam, high beam, and off again.
pub fn next_headlights(now: Headlights) -> Headlights {
    match now {
        Headlights::Off => Headlights::Low,
        Headlights::Low => Headlights::High,
        Headlights::High => Headlights::Off,
    }
}

/// The side on; off if it was on already.
pub fn toggle_indicator(now: Indicator, side: Indicator) -> Indicator {
    if now == side { Indicator::Off } else { side }
}

/// Finds the nearest of some places to a point.
pub fn nearest<T>(places: impl Iterator<Item = (T, Vec3)>, to: Vec3) -> Option<T> {
    places.min_by(|(_, a), (_, b)| a.distance(to).total_cmp(&b.distance(to))).map(|(found, _)| found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_steer_by_and_by_and_less_when_fast() {
        let kind = VehicleType::default();
        let wheel = Wheel { left: true, ..Wheel::default() };
        let turned = |speed: f64| {
            let motion = Motion { speed, ..Motion::default() };
            (0..200).fold(Controls::default(), |c, _| wheel.controls(c, &motion, &kind, 0.01))
        };
        assert_eq!(turned(0.0).steer, 1.0);
        let sideways = 20.0 * 20.0 * (turned(20.0).steer * kind.limits.steering).tan() / kind.wheelbase;
        assert!((sideways - SIDEWAYS).abs() < 0.01, "{sideways}");
        let first = wheel.controls(Controls::default(), &Motion::default(), &kind, 0.01).steer;
        assert!((first - TURN * 0.01).abs() < 1e-6);
        let back = Wheel::default().controls(turned(0.0), &Motion::default(), &kind, 10.0);
        assert_eq!(back.steer, 0.0);
    }

    #[test]
    fn the_key_for_backward_brakes_first() {
        let kind = VehicleType::default();
        let backward = Wheel { backward: true, ..Wheel::default() };
        let pedals = |wheel: Wheel, speed: f64| {
            let motion = Motion { speed, ..Motion::default() };
            let controls = wheel.controls(Controls::default(), &motion, &kind, 0.01);
            (controls.throttle, controls.brake)
        };
        assert_eq!(pedals(backward, 10.0), (0.0, 1.0));
        assert!(pedals(backward, 0.0).0 < 0.0);
        assert_eq!(pedals(Wheel { forward: true, ..Wheel::default() }, -3.0), (0.0, 1.0));
        assert_eq!(pedals(Wheel { forward: true, ..Wheel::default() }, 3.0), (1.0, 0.0));
    }
}
