//! The world of Relief: components, and the systems that turn them into a [`draw_list::DrawList`]. No GPU, no files,
//! no window.
//!
//! [`Simulation`] is the whole of it: a `bevy_ecs` world and two schedules. [`Simulation::step`] moves the world one
//! fixed time step on; [`Simulation::frame`] brings the draw list up to date with whatever changed since the last
//! frame, and with nothing else.

mod alpha;
pub mod batches;
mod bits;
pub mod blocks;
pub mod bounds;
pub mod brute_force;
mod changes;
pub mod clock;
pub mod color;
mod columns;
pub mod components;
mod curve;
pub mod displace;
pub mod draw_list;
mod entity_numbers;
pub mod hidden;
pub mod hooks;
pub mod images;
pub mod incomplete;
pub mod inputs;
pub mod instance_records;
pub mod instances;
pub mod interpolation;
pub mod levels;
pub mod library;
mod light_alone;
mod light_candidates;
mod light_lanes;
mod light_remainder;
mod light_results;
pub mod light_search;
pub mod light_selection;
pub mod light_tree;
pub mod lights;
pub mod materials;
pub mod motion;
pub mod object_bounds;
pub mod object_order;
mod order_sorting;
pub mod origin;
mod pages;
pub mod parallel;
pub mod physics;
pub mod pieces;
mod read_ahead;
pub mod records;
pub mod relevance;
pub mod roster;
pub mod selected_lights;
pub mod shapes;
pub mod snapshot;
pub mod spawn;
pub mod split;
pub mod state;
pub mod state_hash;
pub mod stats;
pub mod sub_steps;
pub mod tables;
pub mod tangents;
pub mod technique;
pub mod texture_memory;
pub mod transform;
pub mod transforms;
pub mod vehicles;
pub mod view;

use bevy_ecs::prelude::*;
use bevy_ecs::schedule::{LogLevel, ScheduleBuildSettings, SingleThreadedExecutor};
use bevy_tasks::{ComputeTaskPool, TaskPoolBuilder};
use stats::{Stage, lap};

/// Sets the number of worker threads of this process; `None`: one per core. Only the first call counts, and the first
/// [`Simulation`] makes it if nothing did. Results are the same for any number.
pub fn set_threads(threads: Option<usize>) {
    ComputeTaskPool::get_or_init(|| {
        let builder = TaskPoolBuilder::new().thread_name("relief".into());
        match threads {
            Some(threads) => builder.num_threads(threads).build(),
            None => builder.build(),
        }
    });
}

/// A world with its schedules.
///
/// ```
/// use systems::{Simulation, components::Light, library::Library, shapes};
/// let mut simulation = Simulation::new();
/// let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(glam::Vec3::ONE));
/// simulation.world.spawn(cube);
/// simulation.world.spawn(Light::point(1.0, 10.0));
/// simulation.frame();
/// assert_eq!(simulation.draw_list().batches.len(), 1);
/// ```
pub struct Simulation {
    /// Entities and resources: [`library::Library`], [`components::Environment`], [`clock::Clock`],
    /// [`lights::LightPolicy`], [`draw_list::DrawList`], [`stats::FrameStats`].
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
        // Schedules ask for it in their first run. The later a resource comes, the more it takes: it is an entity, and
        // where that one is stands in a list of 4 bytes for each entity before it.
        world.init_resource::<Schedules>();
        world.resource_mut::<Schedules>().insert(sub_step_schedule());
        world.init_resource::<library::Library>();
        world.init_resource::<clock::Clock>();
        world.init_resource::<clock::Seed>();
        world.init_resource::<sub_steps::SubStep>();
        world.init_resource::<origin::Origin>();
        world.init_resource::<inputs::Inputs>();
        world.init_resource::<interpolation::Interpolation>();
        world.init_resource::<transforms::NewParents>();
        world.add_observer(transforms::note_parent);
        world.init_resource::<roster::Roster>();
        world.insert_resource(state::StateList::standard());
        world.init_resource::<stats::FrameStats>();
        world.init_resource::<materials::MaterialTable>();
        world.init_resource::<lights::LightTable>();
        world.init_resource::<lights::LightPolicy>();
        world.init_resource::<object_order::ObjectOrder>();
        world.init_resource::<instances::InstanceTable>();
        world.init_resource::<incomplete::Incomplete>();
        world.init_resource::<draw_list::DrawList>();
        world.init_resource::<physics::Physics>();
        world.init_resource::<vehicles::VehicleTypes>();
        world.init_resource::<vehicles::NextVehicleNumber>();
        world.init_resource::<vehicles::routes::Routes>();
        world.init_resource::<vehicles::signals::Signals>();
        world.init_resource::<vehicles::ground::Grounds>();
        world.init_resource::<vehicles::traffic::Traffic>();
        world.insert_resource(components::Environment::default());
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
    pub fn draw_list(&self) -> &draw_list::DrawList {
        self.world.resource()
    }

    /// What the objects of the draw list are drawn with, by slot: of the world as it is now, which is to be as the last
    /// frame left it.
    pub fn instance_records(&self) -> instance_records::InstanceRecords<'_> {
        instance_records::InstanceRecords::new(&self.world, &self.draw_list().instances)
    }

    /// Meshes, materials and images.
    pub fn library(&self) -> &library::Library {
        self.world.resource()
    }
}

/// One fixed step of simulated time, in order.
pub fn step_schedule() -> Schedule {
    let mut schedule = in_fixed_order();
    schedule.add_systems(
        (
            inputs::apply_inputs,             // what changes from outside, before anything else does
            interpolation::remember,          // where everything is, before it moves
            clock::tick,                      // the time of this step, before anything reads it
            motion::spin,                     // what moves by itself
            vehicles::ground::update_grounds, // what vehicles stand on
            sub_steps::drive,                 // traffic lights, vehicles and their physics, a long step in parts
            vehicles::signals::light_heads,   // lamps of traffic lights
            (
                physics::find_wheels,  // whose model has springs
                physics::move_springs, // and how far they give
            )
                .chain()
                .run_if(physics::any_physical),
            vehicles::parts::move_parts, // trailers and sprung wheels, as their vehicles moved
            vehicles::lamps::switch_lamps, // which lamps are on after that
            vehicles::lamps::light_lamps, // and what they do
        )
            .chain(),
    );
    schedule
}

/// A part of a step in which vehicles drive, in order.
pub fn sub_step_schedule() -> Schedule {
    let mut schedule = fixed_order(Schedule::new(sub_steps::Parts));
    sub_steps::add_systems(&mut schedule);
    schedule
}

/// The CPU half of a frame, in order. Each system looks only at what changed.
pub fn frame_schedule() -> Schedule {
    let mut schedule = in_fixed_order();
    schedule.add_systems(
        (
            // A new frame: what was dirty has been uploaded by now.
            (stats::begin, begin_frame, lap(Stage::Transforms, "begin_frame")).chain(),
            // Before anything looks for objects: what has got by now what it is drawn with.
            (incomplete::complete, lap(Stage::Transforms, "complete")).chain(),
            // What is hidden with something above it, before anything looks for objects.
            (hidden::inherit_hidden, lap(Stage::Transforms, "inherit_hidden")).chain(),
            // Wheels and the like, as their vehicles moved.
            (vehicles::parts::turn_parts, lap(Stage::Transforms, "turn_parts")).chain(),
            // Where everything is, parents before children.
            (transforms::update_transforms, lap(Stage::Transforms, "update_transforms")).chain(),
            // Once per mesh, before anything draws it.
            (tangents::update_tangents, lap(Stage::Tangents, "update_tangents")).chain(),
            // After the tangents: levels share the vertices that are final now.
            (levels::update_levels, lap(Stage::Levels, "update_levels")).chain(),
            // Maps into texture arrays; decides the class and pipeline of a material, which batches sort by.
            // Pieces look like the object that they are of.
            (
                pieces::follow_materials,
                lap(Stage::Materials, "follow_materials"),
                materials::update_materials,
                lap(Stage::Materials, "update_materials"),
            )
                .chain(),
            // The light table first: the choice reads it.
            (
                lights::update_light_table,
                lap(Stage::Lights, "update_light_table"),
                light_selection::select_lights,
                lap(Stage::Lights, "select_lights"),
            )
                .chain(),
            // Everything an object's record holds is known now.
            (
                instances::update_instances,
                lap(Stage::Instances, "update_instances"),
                light_selection::list_reaching,
                lap(Stage::Instances, "list_reaching"),
            )
                .chain(),
            // Slots are final: list their pages by draw.
            (batches::update_batches, lap(Stage::Batches, "update_batches"), stats::count).chain(),
        )
            .chain(),
    );
    schedule
}

/// A schedule that runs its systems one after another and refuses any pair whose order matters and is not said.
/// Parallel work is inside the systems that have much of it, where the order of results is fixed.
fn in_fixed_order() -> Schedule {
    fixed_order(Schedule::default())
}

fn fixed_order(mut schedule: Schedule) -> Schedule {
    schedule.set_executor(SingleThreadedExecutor::new());
    schedule.set_build_settings(ScheduleBuildSettings {
        ambiguity_detection: LogLevel::Error,
        ..ScheduleBuildSettings::default()
    });
    schedule
}

fn begin_frame(
    mut list: ResMut<draw_list::DrawList>,
    environment: Res<components::Environment>,
    policy: Res<lights::LightPolicy>,
) {
    let list = list.bypass_change_detection();
    list.frame += 1;
    list.instances.dirty.clear();
    list.lights.dirty.clear();
    list.materials.dirty.clear();
    list.all_lights = *policy == lights::LightPolicy::All;
    if list.environment != *environment {
        list.environment = environment.clone();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::Spin;
    use crate::library::MeshId;
    use crate::transform::Transform;

    #[test]
    fn the_order_of_systems_is_unambiguous() {
        let mut world = Simulation::new().world;
        assert!(frame_schedule().initialize(&mut world).is_ok());
        assert!(step_schedule().initialize(&mut world).is_ok());
        assert!(sub_step_schedule().initialize(&mut world).is_ok());
    }

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

    #[test]
    fn a_system_whose_order_matters_and_is_not_said_is_refused() {
        fn shake(mut moving: Query<&mut Transform, With<Spin>>) {
            moving.iter_mut().for_each(|mut transform| transform.translation.y += 1.0);
        }
        let mut simulation = Simulation::new();
        simulation.step_schedule.add_systems(shake);
        assert!(simulation.step_schedule.initialize(&mut simulation.world).is_err());
        let mut ordered = Simulation::new();
        ordered.step_schedule.add_systems(shake.after(motion::spin).before(vehicles::ground::update_grounds));
        assert!(ordered.step_schedule.initialize(&mut ordered.world).is_ok());
    }
}
