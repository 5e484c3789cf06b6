//! Places in the state, in 64 bits as far as it has them: a vehicle's, and those of what is mounted on it.
//!
//! So accelerations are not lost in the roundings of places: a place in 32 bits, 100 m from the origin, is 8 µm from
//! its neighbour, which at 60 steps a second is 0.03 m/s².

use crate::sense::captures::label_table::own_and_above;
use crate::sense::captures::pose::Pose;
use bevy_ecs::prelude::*;
use glam::DAffine3;
use systems::draw::rigid;
use systems::space::{Interpolated, Transform};

/// Largest speed of things that programs move by setting their place, m/s: beyond it they have jumped. Things with a
/// motion of their own count their jumps.
const FASTEST: f64 = 340.0;

/// Place at a time, and the number of jumps until then.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Place {
    pub pose: Pose,
    /// [`jumps`].
    pub jumps: u32,
}

impl Place {
    /// Tells if it moved from here to a later place, so many seconds later, rather than being put there.
    pub fn leads_to(&self, later: &Self, seconds: f64) -> bool {
        let distance = self.pose.translation.distance(later.pose.translation);
        self.jumps == later.jumps && distance <= FASTEST * seconds
    }
}

/// Number of jumps of something, by itself or with what it is on. It may begin anew where it comes to hang
/// elsewhere.
pub(crate) fn jumps(world: &World, entity: Entity) -> u32 {
    let own = |entity| world.get::<Interpolated>(entity).map_or(0, Interpolated::jumps);
    own_and_above(world, entity).map(own).fold(0, u32::wrapping_add)
}

/// `world_from_entity` in the state.
pub(crate) fn place(world: &World, entity: Entity) -> DAffine3 {
    own_and_above(world, entity).fold(DAffine3::IDENTITY, |below, entity| local(world, entity) * below)
}

/// From an entity to what it is below.
fn local(world: &World, entity: Entity) -> DAffine3 {
    let Some(at) = world.get::<Transform>(entity) else { return DAffine3::IDENTITY };
    #[cfg(feature = "vehicles")]
    let exact = world.get::<systems::vehicles::Motion>(entity).map(|motion| motion.place);
    #[cfg(not(feature = "vehicles"))]
    let exact: Option<glam::DVec3> = None;
    // What something else has moved is where that has put it.
    let translation = exact.filter(|place| place.as_vec3() == at.translation).unwrap_or(at.translation.as_dvec3());
    let rotation = at.rotation.as_dquat().normalize();
    DAffine3::from_scale_rotation_translation(at.scale.as_dvec3(), rotation, translation)
}

/// A sensor's pose in the state.
pub(crate) fn pose(world: &World, entity: Entity) -> Pose {
    let place = place(world, entity);
    let upright = rigid(&place.as_affine3a());
    let rotation = glam::Quat::from_mat3a(&upright.matrix3).as_dquat().normalize();
    Pose { translation: place.translation, rotation }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn what_is_put_where_it_is_moves_by_that_up_to_the_speed_of_sound() {
        let at = |x: f64| Place { pose: Pose { translation: DVec3::X * x, ..Pose::default() }, jumps: 0 };
        let moved = |x: f64| at(0.0).leads_to(&at(x), 0.1);
        assert_eq!([33.9, 34.1].map(moved), [true, false]);
    }
}
