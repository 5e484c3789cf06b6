//! Frames between steps: a window draws what moves between where it was a step ago and where it is.
//!
//! The state is never touched. [`Interpolated`] keeps the transform of the step before, which [`remember`] notes at the
//! start of each step, and `update_transforms` places such an entity between the two, as far as
//! [`Interpolation::fraction`] says. Off, or at a fraction of 1, everything is drawn where it is: so are pictures
//! without a window, and a window whose clock stands.

use super::transform::Transform;
use crate::ecs::changes::{LIGHT_ROWS, rows_per_task};
use crate::ecs::columns::Column;
use crate::ecs::parallel::in_parallel;
use bevy_ecs::change_detection::ContiguousRef;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

/// Time of a frame between the last two steps.
#[derive(Resource, Clone, Copy, PartialEq, Debug)]
pub struct Interpolation {
    /// Set if steps keep the transforms that frames interpolate from.
    pub enabled: bool,
    /// 0: the step before the last; 1: the last.
    pub fraction: f32,
}

impl Default for Interpolation {
    fn default() -> Self {
        Self { enabled: false, fraction: 1.0 }
    }
}

impl Interpolation {
    /// The fraction that frames are drawn at.
    pub(crate) fn drawn(&self) -> f32 {
        if self.enabled { self.fraction.clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// Is drawn between steps, and knows how often it jumped. Derived: no part of the state.
#[derive(Component, Clone, Copy, PartialEq, Debug, Default)]
#[component(summary_tick)]
pub struct Interpolated {
    /// The transform of the step before; `None`: not known, or far from here.
    before: Option<Transform>,
    /// Number of its jumps since the world began.
    jumps: u32,
}

/// Was put elsewhere by an input: what stands for good has none. State.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Moved;

impl Interpolated {
    /// Tells that the entity did not move but was put elsewhere, in this step: it is not drawn in between, and sensors
    /// measure no motion over it.
    pub fn jump(&mut self) {
        self.before = None;
        self.jumps = self.jumps.wrapping_add(1);
    }

    /// Number of its jumps since the world began: between two times at which this is the same, it moved.
    pub fn jumps(&self) -> u32 {
        self.jumps
    }

    /// Tells if it moved in the last step.
    pub(crate) fn is_moving(&self, now: &Transform) -> bool {
        self.before.is_some_and(|before| before != *now)
    }

    /// Between the step before and `now`: places and scales along a line, rotations the shorter way round.
    pub(crate) fn blend(&self, now: &Transform, fraction: f32) -> Transform {
        match &self.before {
            Some(before) if before != now && fraction < 1.0 => Transform {
                translation: before.translation.lerp(now.translation, fraction),
                rotation: before.rotation.lerp(now.rotation, fraction),
                scale: before.scale.lerp(now.scale, fraction),
            },
            _ => *now,
        }
    }
}

/// Notes where everything is before a step moves it. Costs nothing where frames do not ask for it, and a comparison for
/// each entity that may move where they do.
pub fn remember(interpolation: Res<Interpolation>, mut all: Query<(&mut Interpolated, Ref<Transform>)>) {
    if !interpolation.enabled {
        return;
    }
    for (noted, transforms) in all.contiguous_iter_mut().into_iter().flatten() {
        let (mut noted, transforms) = (Column::new(noted), ContiguousRef::split(transforms).0);
        let rows = rows_per_task(noted.len(), LIGHT_ROWS);
        in_parallel(noted.parts(0, rows), |mut part| {
            for row in part.rows() {
                let jumps = part.get(row).jumps;
                part.set_if_neq(row, Interpolated { before: Some(transforms[row]), jumps });
            }
        });
    }
}
