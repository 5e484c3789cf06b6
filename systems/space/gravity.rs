//! Gravity, which physics and inertial sensors agree on.

/// How strong it is, everywhere: m/s², toward −Y.
pub const GRAVITY: f64 = 9.81;
