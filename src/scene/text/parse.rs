//! RON into structs.

use super::slips::{self, Slip};
use ron::error::SpannedError;
use ron::extensions::Extensions;
use serde::de::DeserializeOwned;

/// Reads RON as all texts of scenes are read.
pub fn from_ron<T: DeserializeOwned>(text: &str) -> Result<T, SpannedError> {
    let extensions = Extensions::IMPLICIT_SOME | Extensions::UNWRAP_NEWTYPES | Extensions::UNWRAP_VARIANT_NEWTYPES;
    ron::Options::default().with_default_extension(extensions).from_str(text)
}

/// The same, with errors for people.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, Slip> {
    from_ron(text).map_err(|error| slips::explain(text, &error))
}
