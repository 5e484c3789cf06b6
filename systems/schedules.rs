//! The two schedules, a step's and a frame's: which systems there are, in which order and why.
//!
//! Systems of one's own take their place by the sets: `system.after(StepSet::Motion).before(StepSet::Drive)`. A pair of
//! systems whose order matters and is not said is refused.

use crate::assets::{levels, tangents};
use crate::cells::doors;
use crate::draw::sky_light::{drawn_sky, hiding};
use crate::draw::{batches, incomplete, instances, light_records, list, materials, pieces};
use crate::ecs::stats::{self, Stage, lap};
use crate::ecs::{clock, sub_steps};
use crate::lights::{floods, selection};
#[cfg(feature = "physics")]
use crate::physics::{bodies, ground as colliders, springs, traffic};
use crate::run::inputs;
use crate::space::{hidden, interpolation, motion, propagation};
#[cfg(feature = "vehicles")]
use crate::vehicles::{driving, ground, lamps, parts, signals};
use bevy_ecs::prelude::*;
use bevy_ecs::schedule::{LogLevel, ScheduleBuildSettings, SingleThreadedExecutor};

/// The parts of a step, in order.
#[derive(SystemSet, Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum StepSet {
    /// [`Inputs`](crate::run::inputs::Inputs) are applied.
    Inputs,
    /// The places before the step are kept for interpolation, and the clock goes on.
    Begin,
    /// Objects that move by themselves.
    Motion,
    /// Traffic lights, vehicles and their physics.
    Drive,
    /// Parts and lamps of vehicles, which follow from the vehicles' places.
    Follow,
}

/// One fixed step of simulated time, in order.
pub fn step_schedule() -> Schedule {
    use StepSet::{Begin, Drive, Follow, Inputs, Motion};
    let mut schedule = in_fixed_order();
    schedule.configure_sets((Inputs, Begin, Motion, Drive, Follow).chain());
    schedule.add_systems((
        // What changes from outside, before anything else does.
        inputs::apply_inputs.in_set(Inputs),
        (
            interpolation::remember, // where everything is, before it moves
            clock::tick,             // the time of this step, before anything reads it
        )
            .chain()
            .in_set(Begin),
        (
            motion::spin,      // what turns evenly
            doors::move_doors, // portals, and the leaves in them
        )
            .chain()
            .in_set(Motion),
        (
            #[cfg(feature = "vehicles")]
            ground::update_grounds, // what vehicles stand on
            sub_steps::drive, // traffic lights, vehicles and their physics, a long step in parts
        )
            .chain()
            .in_set(Drive),
        #[cfg(feature = "vehicles")]
        (
            signals::light_heads, // lamps of traffic lights
            #[cfg(feature = "physics")]
            (
                springs::find_wheels,  // whose model has springs
                springs::move_springs, // and how far they give
            )
                .chain()
                .run_if(bodies::any_physical),
            parts::move_parts,   // trailers and sprung wheels, as their vehicles moved
            lamps::switch_lamps, // which lamps are on after that
            lamps::light_lamps,  // and what they do
        )
            .chain()
            .in_set(Follow),
    ));
    schedule
}

/// A part of a step in which vehicles drive, in order.
pub fn sub_step_schedule() -> Schedule {
    let schedule = fixed_order(Schedule::new(sub_steps::Parts));
    #[cfg(feature = "vehicles")]
    let schedule = with_vehicles(schedule);
    schedule
}

#[cfg(feature = "vehicles")]
fn with_vehicles(mut schedule: Schedule) -> Schedule {
    schedule.add_systems(
        (
            signals::tick_signals, // what traffic lights show now
            driving::drive,        // vehicles, as their routes or drivers want
            // Vehicles that are bodies: after the kinematic ones, which they bump into.
            #[cfg(feature = "physics")]
            (
                colliders::update_ground, // what wheels stand on
                bodies::place_bodies,     // which of them are bodies, and where
                traffic::follow_traffic,  // kinematic vehicles near by
                bodies::step_bodies,      // springs, tyres, collisions
                bodies::write_back,       // where they are now
            )
                .chain()
                .run_if(bodies::any_physical),
        )
            .chain(),
    );
    schedule
}

/// The parts of a frame's CPU half, in order.
#[derive(SystemSet, Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum FrameSet {
    /// Dirty marks of the last frame are cleared.
    Begin,
    /// Places in the world, and inherited hiding. Poses that only pictures need come before: after [`FrameSet::Begin`].
    Transforms,
    /// Tangents, levels of detail, and materials in texture arrays.
    Assets,
    /// The light table, and the lights of each object.
    Lights,
    /// Slots, records and batches: the draw list is complete afterwards.
    DrawList,
}

/// The CPU half of a frame, in order. Each system looks only at what changed.
pub fn frame_schedule() -> Schedule {
    use FrameSet::{Assets, Begin, DrawList, Lights, Transforms};
    let mut schedule = in_fixed_order();
    schedule.configure_sets((Begin, Transforms, Assets, Lights, DrawList).chain());
    schedule.add_systems((
        // A new frame: what was dirty has been uploaded by now.
        (
            stats::begin,
            list::begin_frame,
            lap(Stage::Transforms, "begin_frame"),
            // Sun and moon, before anything looks for lights.
            drawn_sky::follow_weather,
            lap(Stage::Lights, "follow_weather"),
        )
            .chain()
            .in_set(Begin),
        (
            // Before anything looks for objects: what has got by now what it is drawn with.
            (incomplete::complete, lap(Stage::Transforms, "complete")).chain(),
            // Pieces of meshes that were replaced, before anything places them.
            (pieces::follow_meshes, lap(Stage::Transforms, "follow_meshes")).chain(),
            // What is hidden with something above it, before anything looks for objects.
            (hidden::inherit_hidden, lap(Stage::Transforms, "inherit_hidden")).chain(),
            // Wheels and the like, as their vehicles moved.
            #[cfg(feature = "vehicles")]
            (parts::turn_parts, lap(Stage::Transforms, "turn_parts")).chain(),
            // Where everything is, parents before children.
            (propagation::update_transforms, lap(Stage::Transforms, "update_transforms")).chain(),
        )
            .chain()
            .in_set(Transforms),
        (
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
        )
            .chain()
            .in_set(Assets),
        // The light table first: the floods read it, and the choice both.
        (
            light_records::update_light_table,
            lap(Stage::Lights, "update_light_table"),
            floods::update_floods,
            lap(Stage::Lights, "update_floods"),
            selection::select_lights,
            lap(Stage::Lights, "select_lights"),
        )
            .chain()
            .in_set(Lights),
        (
            // Everything an object's record holds is known now.
            (instances::update_instances, lap(Stage::Instances, "update_instances")).chain(),
            // Slots are final: list their pages by draw.
            (batches::update_batches, lap(Stage::Batches, "update_batches"), list::count).chain(),
            // What hides the sky, by all that is drawn.
            (hiding::update_openness, lap(Stage::Lights, "update_openness")).chain(),
        )
            .chain()
            .in_set(DrawList),
    ));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Simulation;
    use crate::space::motion::Spin;
    use crate::space::transform::Transform;

    #[test]
    fn the_order_of_systems_is_unambiguous() {
        let mut world = Simulation::new().world;
        assert!(frame_schedule().initialize(&mut world).is_ok());
        assert!(step_schedule().initialize(&mut world).is_ok());
        assert!(sub_step_schedule().initialize(&mut world).is_ok());
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
        ordered.step_schedule.add_systems(shake.after(StepSet::Motion).before(StepSet::Drive));
        assert!(ordered.step_schedule.initialize(&mut ordered.world).is_ok());
    }
}
