//! Gravity, which physics and inertial sensors agree on.

/// Acceleration of gravity, everywhere: m/s², toward −Y.
pub const GRAVITY: f64 = 9.81;
