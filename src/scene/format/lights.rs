//! The policy by which lights shade an object. What a light is stands in [`systems::lights::LightDescription`].

use super::values::{names, one_of};
use serde::{Deserialize, Deserializer};
use systems::lights::LightPolicy;

/// Selection of the lights in reach that shade objects.
#[derive(Deserialize, Debug, Clone, Copy)]
#[serde(default, deny_unknown_fields)]
pub struct Lights {
    #[serde(deserialize_with = "light_policy")]
    policy: LightPolicy,
    pub tolerance: Option<f32>,
}

fn light_policy<'de, D: Deserializer<'de>>(deserializer: D) -> Result<LightPolicy, D::Error> {
    const NAMES: [&str; LightPolicy::ALL.len()] = names(&LightPolicy::ALL);
    one_of(&LightPolicy::ALL, &NAMES, deserializer)
}

impl Default for Lights {
    fn default() -> Self {
        Self { policy: LightPolicy::ENOUGH, tolerance: None }
    }
}

impl Lights {
    /// Converts to the component.
    pub fn policy(&self) -> LightPolicy {
        match (self.policy, self.tolerance) {
            (LightPolicy::Enough(_), Some(tolerance)) => LightPolicy::Enough(tolerance),
            (policy, _) => policy,
        }
    }
}
