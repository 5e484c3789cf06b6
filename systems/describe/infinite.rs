//! Numbers whose infinity is written by leaving the field out: ranges without an end. Beside
//! `#[serde(with = "infinite")]`, such a field says `extend("infinite" = true)`. Formats for programs have the number.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Writes infinity as nothing.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(number: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    if serializer.is_human_readable() {
        (*number != f32::INFINITY).then_some(*number).serialize(serializer)
    } else {
        number.serialize(serializer)
    }
}

/// Reads nothing as infinity.
///
/// # Errors
/// Those of the deserializer.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    if deserializer.is_human_readable() {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f32::INFINITY))
    } else {
        f32::deserialize(deserializer)
    }
}
