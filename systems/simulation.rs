//! [`Simulation`]: a world with its schedules.

use crate::assets::library::Library;
use crate::draw::frame_data::FrameData;
use crate::draw::instance_records::InstanceRecords;
use crate::draw::list::DrawList;
use crate::install;
use crate::schedules::{frame_schedule, step_schedule};
use bevy_ecs::prelude::*;

/// A world with its schedules.
///
/// ```
/// use systems::Simulation;
/// use systems::assets::{Library, shapes};
/// use systems::lights::Light;
/// let mut simulation = Simulation::new();
/// let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(glam::Vec3::ONE));
/// simulation.world.spawn(cube);
/// simulation.world.spawn(Light::point(1.0, 10.0));
/// simulation.frame();
/// assert_eq!(simulation.draw_list().batches.len(), 1);
/// ```
pub struct Simulation {
    /// Entities and resources: [`Library`], [`Environment`](crate::draw::Environment),
    /// [`Clock`](crate::ecs::clock::Clock), [`LightPolicies`](crate::lights::LightPolicies), [`DrawList`],
    /// [`FrameStats`](crate::ecs::stats::FrameStats).
    pub world: World,
    /// Systems of a step; systems of your own are added here, by [`StepSet`](crate::StepSet).
    pub step_schedule: Schedule,
    /// Systems of a frame; systems of your own are added here, by [`FrameSet`](crate::FrameSet).
    pub frame_schedule: Schedule,
}

impl Default for Simulation {
    fn default() -> Self {
        Self::new()
    }
}

impl Simulation {
    /// An empty world.
    pub fn new() -> Self {
        let mut world = World::new();
        install::core(&mut world);
        install::recording(&mut world);
        #[cfg(feature = "vehicles")]
        install::vehicles(&mut world);
        #[cfg(feature = "physics")]
        install::physics(&mut world);
        Self { world, step_schedule: step_schedule(), frame_schedule: frame_schedule() }
    }

    /// Moves the world one fixed time step on.
    pub fn step(&mut self) {
        self.step_schedule.run(&mut self.world);
    }

    /// Brings the draw list up to date.
    pub fn frame(&mut self) {
        self.frame_schedule.run(&mut self.world);
        // Else the world would note for ever what was removed from it.
        self.world.clear_trackers();
    }

    /// Lends the last frame to a renderer.
    pub fn with_frame<R>(&mut self, read: impl FnOnce(&mut FrameData<'_>) -> R) -> R {
        FrameData::of_world(&mut self.world, read)
    }

    /// Draw list of the last frame.
    pub fn draw_list(&self) -> &DrawList {
        self.world.resource()
    }

    /// Instance records of the draw list, by slot. They are made from the world as it is now, which has to be as the
    /// last frame left it.
    pub fn instance_records(&self) -> InstanceRecords<'_> {
        InstanceRecords::new(&self.world, &self.draw_list().instances)
    }

    /// Meshes, materials and images.
    pub fn library(&self) -> &Library {
        self.world.resource()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::mesh::MeshId;
    use crate::space::transform::Transform;

    #[test]
    fn no_resource_comes_after_the_entities_of_a_world() {
        let mut simulation = Simulation::new();
        let first = simulation.world.spawn(MeshId::from_slot(0)).id();
        simulation.step();
        simulation.frame();
        let second = simulation.world.spawn_empty().id();
        assert_eq!(second.index_u32(), first.index_u32() + 1, "a resource is an entity, too");
    }

    #[test]
    fn what_was_removed_is_not_noted_for_ever() {
        let mut simulation = Simulation::new();
        let entity = simulation.world.spawn(Transform::IDENTITY).id();
        simulation.world.despawn(entity);
        assert_eq!(simulation.world.removed::<Transform>().count(), 1);
        (0..2).for_each(|_| simulation.frame());
        assert_eq!(simulation.world.removed::<Transform>().count(), 0);
    }
}
