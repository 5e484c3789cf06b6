//! Portals that open and shut, and what moves them.

use crate::describe::check::Described;
use crate::ecs::clock::Clock;
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Opening of a portal, from shut to open. State. Its place is in [`Cells`](super::cells::Cells).
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Portal {
    /// 0: shut, no light comes through. 1: open. From a half on, all the light comes through.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub open: f32,
}

impl Default for Portal {
    fn default() -> Self {
        Self { open: 1.0 }
    }
}

impl Described for Portal {}

/// Leaf that moves with a portal, and the portal's own motion. State.
#[derive(Component, Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[require(Portal)]
pub struct Door {
    /// Is placed by [`move_doors`], as far as the portal is open.
    #[entities]
    pub leaf: Option<Entity>,
    /// Transform of the leaf when shut, in its parent's space.
    pub shut: Transform,
    /// Radians about the parent's Y axis, through the leaf's origin, when open.
    pub swing: f32,
    /// Metres in the parent's space, when open.
    pub slide: Vec3,
    /// Seconds from opening to opening; 0: it does not move by itself.
    pub period: f32,
    /// Seconds that it is ahead.
    pub phase: f32,
}

impl Door {
    /// Tells if its numbers are finite, and the period is not negative.
    pub(crate) fn is_valid(&self) -> bool {
        let numbers = [self.swing, self.period, self.phase];
        self.shut.is_finite() && self.slide.is_finite() && numbers.iter().all(|n| n.is_finite()) && self.period >= 0.0
    }

    /// Opening, 0 to 1, of a door that moves by itself: shut for three eighths of its period, open for as long, and
    /// smooth between.
    fn open_at(&self, seconds: f64) -> f32 {
        let period = f64::from(self.period);
        let part = ((seconds + f64::from(self.phase)) / period).rem_euclid(1.0);
        // 0 at both ends of a period, 1 in its middle.
        let way = 1.0 - (2.0 * part - 1.0).abs();
        let t = (4.0 * way - 1.5).clamp(0.0, 1.0);
        (t * t * (3.0 - 2.0 * t)) as f32
    }

    /// Transform of the leaf at an opening, in its parent's space.
    fn leaf_at(&self, open: f32) -> Transform {
        Transform {
            translation: self.shut.translation + self.slide * open,
            rotation: Quat::from_rotation_y(self.swing * open) * self.shut.rotation,
            ..self.shut
        }
    }
}

/// Opens and shuts what does so by itself, and places the leaves. From the time, as [`spin`](crate::space::spin) does.
pub fn move_doors(clock: Res<Clock>, mut doors: Query<(&mut Portal, &Door)>, mut leaves: Query<&mut Transform>) {
    for (mut portal, door) in &mut doors {
        if door.period > 0.0 {
            portal.set_if_neq(Portal { open: door.open_at(clock.seconds()) });
        }
        if let Some(mut place) = door.leaf.and_then(|leaf| leaves.get_mut(leaf).ok()) {
            place.set_if_neq(door.leaf_at(portal.open));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_door_is_shut_and_open_for_as_long() {
        let door = Door { period: 8.0, phase: 1.0, ..Door::default() };
        let open = [-1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0].map(|seconds| door.open_at(seconds));
        assert_eq!(open, [0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0, 0.0]);
    }
}
