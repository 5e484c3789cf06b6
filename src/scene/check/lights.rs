//! The policy by which lights shade an object.

use super::walk::Check;
use crate::scene::format::lights::Lights;
use systems::lights::LightPolicy;

impl Check<'_> {
    pub(super) fn lights(&mut self, lights: Option<&Lights>) {
        let Some((lights, tolerance)) = lights.and_then(|lights| Some((lights, lights.tolerance?))) else { return };
        self.field("lights", |c| {
            c.number("tolerance", tolerance, 0.0, 1.0);
            if !matches!(lights.policy(), LightPolicy::Enough(_)) {
                c.field("tolerance", |c| c.fault("only allowed with the policy enough"));
            }
        });
    }
}
