//! The policy by which lights shade an object. What a light is stands in [`systems::lights::LightDescription`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use systems::describe::{Described, Fault, Trail};
use systems::lights::LightPolicy;

/// Selection of the lights in reach that shade objects.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Lights {
    /// Choice among the lights in reach. `three`: the most relevant; `enough`: all but what the tolerance leaves out;
    /// `all`: every light; `hard`: three at full weight, to compare.
    policy: Policy,
    /// Share of an object's scores that `enough` may leave out; 0: all lights, 1: three. By default 0.001.
    #[schemars(range(min = 0.0, max = 1.0))]
    tolerance: Option<f32>,
}

/// Choice among the lights in reach.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, Default)]
#[serde(rename_all = "snake_case")]
enum Policy {
    /// The three most relevant lights.
    Three,
    /// The most relevant ones that leave out no more than the tolerance.
    #[default]
    Enough,
    /// Every light.
    All,
    /// Three at full weight, to compare.
    Hard,
}

impl Described for Lights {
    fn check_whole(&self) -> Vec<Fault> {
        let is_foreign = self.tolerance.is_some() && !matches!(self.policy, Policy::Enough);
        let fault = || Trail::default().field("tolerance").fault("only allowed with the policy enough");
        is_foreign.then(fault).into_iter().collect()
    }
}

impl Lights {
    /// Converts to the component.
    pub fn policy(&self) -> LightPolicy {
        match self.policy {
            Policy::Three => LightPolicy::Three,
            Policy::Enough => self.tolerance.map_or(LightPolicy::ENOUGH, LightPolicy::Enough),
            Policy::All => LightPolicy::All,
            Policy::Hard => LightPolicy::Hard,
        }
    }
}
