//! [`Simulation`]: a world with its schedules.

use crate::assets::library::Library;
use crate::draw::environment::Environment;
use crate::draw::hooks;
use crate::draw::incomplete::Incomplete;
use crate::draw::instance_records::InstanceRecords;
use crate::draw::instances::InstanceTable;
use crate::draw::list::DrawList;
use crate::draw::materials::MaterialTable;
use crate::ecs::clock::{Clock, Seed};
use crate::ecs::parallel::set_threads;
use crate::ecs::stats::FrameStats;
use crate::ecs::sub_steps::SubStep;
use crate::lights::order::ObjectOrder;
use crate::lights::table::{LightPolicy, LightTable};
#[cfg(feature = "physics")]
use crate::physics::bodies::Physics;
use crate::run::inputs::Inputs;
use crate::run::roster::Roster;
use crate::run::state::StateList;
use crate::schedules::{frame_schedule, step_schedule, sub_step_schedule};
use crate::space::interpolation::Interpolation;
use crate::space::origin::Origin;
use crate::space::propagation::{NewParents, note_parent};
#[cfg(feature = "vehicles")]
use crate::vehicles::hooks as vehicle_hooks;
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
    /// Entities and resources: [`Library`], [`Environment`], [`Clock`], [`LightPolicy`], [`DrawList`], [`FrameStats`].
    pub world: World,
    /// What happens in a step; systems of your own are added here.
    pub step_schedule: Schedule,
    frame_schedule: Schedule,
}

impl Default for Simulation {
    fn default() -> Self {
        Self::new()
    }
}

impl Simulation {
    /// An empty world.
    pub fn new() -> Self {
        set_threads(None);
        let mut world = World::new();
        hooks::register(&mut world);
        #[cfg(feature = "vehicles")]
        vehicle_hooks::register(&mut world);
        // Schedules ask for it in their first run. The later a resource comes, the more it takes: it is an entity, and
        // where that one is stands in a list of 4 bytes for each entity before it.
        world.init_resource::<Schedules>();
        world.resource_mut::<Schedules>().insert(sub_step_schedule());
        world.init_resource::<Library>();
        world.init_resource::<Clock>();
        world.init_resource::<Seed>();
        world.init_resource::<SubStep>();
        world.init_resource::<Origin>();
        world.init_resource::<Inputs>();
        world.init_resource::<Interpolation>();
        world.init_resource::<NewParents>();
        world.add_observer(note_parent);
        world.init_resource::<Roster>();
        world.insert_resource(StateList::standard());
        world.init_resource::<FrameStats>();
        world.init_resource::<MaterialTable>();
        world.init_resource::<LightTable>();
        world.init_resource::<LightPolicy>();
        world.init_resource::<ObjectOrder>();
        world.init_resource::<InstanceTable>();
        world.init_resource::<Incomplete>();
        world.init_resource::<DrawList>();
        #[cfg(feature = "physics")]
        world.init_resource::<Physics>();
        world.insert_resource(Environment::default());
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

    /// What the last frame drew.
    pub fn draw_list(&self) -> &DrawList {
        self.world.resource()
    }

    /// What the objects of the draw list are drawn with, by slot: of the world as it is now, which is to be as the last
    /// frame left it.
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
        let first = simulation.world.spawn(MeshId(0)).id();
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
