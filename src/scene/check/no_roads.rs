//! In place of `roads.rs` in a build without vehicles: a scene with any is refused.

use super::walk::Check;
use crate::scene::format::entities::Entity;
use crate::scene::format::roads::{Along, Vehicle};

const REFUSED: &str = "this build has no vehicles (feature `vehicles`)";

impl Check<'_> {
    /// Refuses what is of vehicles, beside those of entities.
    pub(super) fn roads(&mut self) {
        let scene = self.scene;
        let found = [
            ("vehicle_types", scene.vehicle_types.is_empty()),
            ("signals", scene.signals.entries().is_empty()),
            ("routes", scene.routes.entries().is_empty()),
        ];
        for (field, _) in found.into_iter().filter(|(_, is_empty)| !is_empty) {
            self.field(field, |c| c.fault(REFUSED));
        }
    }

    pub(super) fn vehicle(&mut self, _: &Entity, _: &Vehicle) {
        self.fault(REFUSED);
    }

    pub(super) fn generated_vehicles(&mut self) {
        self.fault(REFUSED);
    }

    pub(super) fn known_group(&mut self, _: &str, _: usize) {
        self.fault(REFUSED);
    }

    pub(super) fn along(&mut self, _: &Along) -> u64 {
        self.fault(REFUSED);
        0
    }
}
