//! Setup of a world before its first entity: resources, hooks and required components, feature by feature. It serves
//! worlds that [`Simulation::new`](crate::Simulation::new), which uses it too, does not make.
//!
//! ```
//! use bevy_ecs::prelude::*;
//! use systems::draw::FrameData;
//! let mut world = World::new();
//! systems::install::core(&mut world);
//! let mut frame = systems::frame_schedule();
//! world.spawn(systems::lights::Light::point(1.0, 10.0));
//! frame.run(&mut world);
//! world.clear_trackers();
//! FrameData::of_world(&mut world, |frame| assert_eq!(frame.list.lights.records.len(), 1));
//! ```

use crate::assets::library::Library;
use crate::cells::cells::Cells;
use crate::draw::environment::Environment;
use crate::draw::hooks;
use crate::draw::incomplete::Incomplete;
use crate::draw::instances::InstanceTable;
use crate::draw::list::DrawList;
use crate::draw::materials::MaterialTable;
use crate::draw::sky_light::drawn_sky::WeatherLights;
use crate::draw::sky_light::hiding::OpennessState;
use crate::ecs::clock::{Clock, Seed};
use crate::ecs::parallel::set_threads;
use crate::ecs::stats::FrameStats;
use crate::ecs::sub_steps::SubStep;
use crate::lights::floods::LightFloods;
use crate::lights::lists::LightLists;
use crate::lights::order::ObjectOrder;
use crate::lights::policy::LightPolicies;
use crate::lights::table::LightTable;
#[cfg(feature = "physics")]
use crate::physics::bodies::Physics;
use crate::run::inputs::Inputs;
use crate::run::registry::EntityRegistry;
use crate::run::snapshot::Restored;
use crate::run::state::StateList;
use crate::schedules::sub_step_schedule;
use crate::sensors::labels::Classes;
use crate::space::interpolation::Interpolation;
use crate::space::origin::Origin;
use crate::space::propagation::{NewParents, note_parent};
#[cfg(feature = "vehicles")]
use crate::vehicles::hooks as vehicle_hooks;
use crate::weather::timeline::WeatherTimeline;
use bevy_ecs::prelude::*;

/// Objects, materials, lights and the clock: what the [frame's schedule](crate::frame_schedule) needs, and that of
/// steps but for vehicles, recordings and physics. Starts the [worker threads](crate::set_threads) of this process.
///
/// # Panics
/// If an entity of the world has, or had, one of the components, or it was called before.
pub fn core(world: &mut World) {
    set_threads(None);
    hooks::register(world);
    // Schedules ask for it in their first run. The later a resource comes, the more it takes: it is an entity, and
    // where that one is stands in a list of 4 bytes for each entity before it.
    world.init_resource::<Schedules>();
    world.resource_mut::<Schedules>().insert(sub_step_schedule());
    world.init_resource::<Library>();
    world.init_resource::<Clock>();
    world.init_resource::<Seed>();
    world.init_resource::<SubStep>();
    world.init_resource::<Origin>();
    world.init_resource::<Interpolation>();
    world.init_resource::<NewParents>();
    world.add_observer(note_parent);
    world.init_resource::<FrameStats>();
    world.init_resource::<MaterialTable>();
    world.init_resource::<LightTable>();
    world.init_resource::<Cells>();
    world.init_resource::<LightFloods>();
    world.init_resource::<LightPolicies>();
    world.init_resource::<LightLists>();
    world.init_resource::<ObjectOrder>();
    world.init_resource::<InstanceTable>();
    world.init_resource::<Incomplete>();
    world.init_resource::<DrawList>();
    world.init_resource::<Classes>();
    world.insert_resource(Environment::default());
    world.init_resource::<WeatherTimeline>();
    world.init_resource::<WeatherLights>();
    world.init_resource::<OpennessState>();
}

/// Inputs, and the state that hashes, snapshots and recordings go by. Steps need it.
pub fn recording(world: &mut World) {
    world.init_resource::<Inputs>();
    world.init_resource::<EntityRegistry>();
    world.init_resource::<Restored>();
    world.insert_resource(StateList::standard());
}

/// Vehicles, routes and traffic lights. Steps need it.
///
/// # Panics
/// If an entity of the world is or was a vehicle, or it was called before.
#[cfg(feature = "vehicles")]
pub fn vehicles(world: &mut World) {
    vehicle_hooks::register(world);
}

/// Vehicles as rigid bodies. Steps need it.
#[cfg(feature = "physics")]
pub fn physics(world: &mut World) {
    world.init_resource::<Physics>();
}
