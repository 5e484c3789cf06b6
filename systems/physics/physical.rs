//! Parameters of a physically simulated vehicle: numbers of its own, or derived from its type.

use crate::describe::check::Described;
pub use crate::space::gravity::GRAVITY;
use crate::vehicles::components::Wanted;
use crate::vehicles::parts::{self, Movement, Part};
use crate::vehicles::types::VehicleType;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Default deflection of springs under the vehicle's weight, metres. A bounce of 1.6 Hz, as a car's.
const STATIC_DEFLECTION: f64 = 0.1;
/// Default ratio of the springs' damping to critical damping.
const DAMPING_RATIO: f64 = 0.35;
/// The part of their length that springs give at most under the vehicle's weight: the rest is left for bumps.
const MOST_DEFLECTION: f64 = 0.9;
/// Drag coefficient times half the density of air, kg/m³: between a car's and a van's.
const DRAG_PER_AREA: f64 = 0.21;

/// Has a [`Vehicle`](crate::vehicles::Vehicle) simulated as a rigid body on springs and tyres. What is `None` is
/// derived from the vehicle's type. Vehicles whose wheels are in a row would fall over, and stay kinematic. Scene files
/// have it with these fields.
#[derive(Component, Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[component(immutable, on_add = hold_wheels, on_remove = forget_wish)]
#[require(Wanted)]
pub struct Physical {
    /// Mass; by default the type's.
    #[schemars(range(min = 0.001, max = 1e6), extend("unit" = "kg"))]
    pub mass: Option<f32>,
    /// Coulomb's coefficient of friction of tyres on the ground; by default 0.9.
    #[schemars(range(min = 0.001, max = 10.0))]
    pub friction: Option<f32>,
    /// Force of all wheels together; by default gives the type's acceleration.
    #[schemars(range(min = 0.001, max = 1e9), extend("unit" = "N"))]
    pub engine_force: Option<f32>,
    /// Force of all wheels together; by default gives the type's hardest braking.
    #[schemars(range(min = 0.001, max = 1e9), extend("unit" = "N"))]
    pub brake_force: Option<f32>,
    /// Drag of the air: the force is this times the square of the speed. By default from width and height.
    #[schemars(range(min = 0.001, max = 1e4), extend("unit" = "kg/m"))]
    pub drag: Option<f32>,
    /// Stiffness of the average wheel's spring; by default gives 0.1 m under the weight.
    #[schemars(range(min = 0.001, max = 1e9), extend("unit" = "N/m"))]
    pub stiffness: Option<f32>,
    /// Damping of the average wheel's damper; by default 0.35 of critical damping.
    #[schemars(range(min = 0.001, max = 1e9), extend("unit" = "N·s/m"))]
    pub damping: Option<f32>,
    /// Length of the springs without load; by default 0.3. Wheels hang down by it, and can be pressed up by it.
    #[schemars(range(min = 0.001, max = 5.0), extend("unit" = "m"))]
    pub rest_length: Option<f32>,
}

impl Described for Physical {}

/// Its wheels move in steps from now on, with their springs.
fn hold_wheels(mut world: DeferredWorld, context: HookContext) {
    world.commands().queue(move |world: &mut World| parts::turn_in_steps(world, context.entity));
}

/// Drops the wish of a former body, so that the kinematic model moves the vehicle again.
fn forget_wish(mut world: DeferredWorld, context: HookContext) {
    world.commands().queue(move |world: &mut World| {
        let entity = world.get_entity_mut(context.entity);
        entity.into_iter().for_each(|mut entity| _ = entity.remove::<Wanted>());
    });
}

/// [`Physical`] with every number known, finite and in its range.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Tuning {
    /// Kilograms.
    pub mass: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
    /// All wheels, newtons.
    pub engine_force: f64,
    /// All wheels, newtons.
    pub brake_force: f64,
    /// kg/m.
    pub drag: f64,
    /// The average wheel's, N/m.
    pub stiffness: f64,
    /// The average wheel's, N·s/m.
    pub damping: f64,
    /// Metres.
    pub rest_length: f64,
}

impl Tuning {
    /// The numbers of a vehicle of that type on that many wheels.
    pub fn of(physical: &Physical, kind: &VehicleType, wheels: usize) -> Self {
        let wheels = wheels.max(1) as f64;
        let mass = within(physical.mass, kind.mass.into(), 10.0, 1e6);
        let rest_length = within(physical.rest_length, 0.3, 0.05, 2.0);
        let gives = |deflection: f64| mass * GRAVITY / (wheels * deflection);
        let least = gives(MOST_DEFLECTION * rest_length);
        let stiffness = within(physical.stiffness, gives(STATIC_DEFLECTION), least, least.max(1e8));
        let critical = 2.0 * (stiffness * mass / wheels).sqrt();
        Self {
            mass,
            friction: within(physical.friction, 0.9, 0.0, 10.0),
            engine_force: within(physical.engine_force, mass * f64::from(kind.limits.acceleration), 0.0, 1e8),
            brake_force: within(physical.brake_force, mass * f64::from(kind.limits.braking), 0.0, 1e8),
            drag: within(physical.drag, DRAG_PER_AREA * f64::from(kind.size.x * kind.size.y), 0.0, 1e4),
            stiffness,
            damping: within(physical.damping, DAMPING_RATIO * critical, 0.0, critical),
            rest_length,
        }
    }

    /// The suspension as a step of so many seconds holds it: springs up to 1 / (`mobility`·h²) and dampers up to 1 /
    /// (`mobility`·h), which is what backward Euler makes of infinite ones (Catto, "Soft Constraints", GDC 2011).
    /// `mobility`, 1/kg: the largest by which the wheels' velocities answer to their impulses.
    ///
    /// A wheel's velocity v and its spring's length x follow v' = v − a·h·(k·x + c·v), x' = x + h·v'. With κ = a·k·h²
    /// and γ = a·c·h that is stable where κ + 2γ < 4 (Jury's criterion); here it is 3 at most.
    #[must_use]
    pub fn held(&self, mobility: f64, seconds: f64) -> Self {
        Self {
            stiffness: self.stiffness.min(1.0 / (mobility * seconds * seconds)),
            damping: self.damping.min(1.0 / (mobility * seconds)),
            ..*self
        }
    }

    /// Deflection of each spring under the vehicle's weight on level ground: m·g / (wheels·k), metres.
    pub fn static_deflection(&self, wheels: usize) -> f64 {
        self.mass * GRAVITY / (wheels.max(1) as f64 * self.stiffness)
    }
}

/// Clamps the given number, or else the derived one if that is missing or not finite.
fn within(given: Option<f32>, derived: f64, least: f64, most: f64) -> f64 {
    let value = given.map(f64::from).filter(|value| value.is_finite()).unwrap_or(derived);
    if value.is_finite() { value.clamp(least, most) } else { least }
}

/// Place of a wheel of a type while the vehicle stands on level ground.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct WheelPlace {
    /// Its hub in the vehicle's space.
    pub hub: Vec3,
    /// Metres.
    pub radius: f32,
    /// Set if it turns with the steering.
    pub steers: bool,
}

/// The wheels of a type, those of its trailer apart, in the order of its parts; those of a box where its model has
/// none. Empty where they are in a row, or where numbers do not make a vehicle.
pub fn wheels(kind: &VehicleType) -> Vec<WheelPlace> {
    let mut wheels: Vec<WheelPlace> =
        (0..kind.parts.len()).filter_map(|index| wheel_of_part(&kind.parts, index)).collect();
    if wheels.is_empty() && kind.track > 0.0 {
        let radius = 0.12 * kind.wheelbase;
        let axle = |z: f32, steers| {
            [0.5, -0.5].map(|side| WheelPlace { hub: Vec3::new(side * kind.track, radius, z), radius, steers })
        };
        wheels.extend(axle(kind.wheelbase, true).into_iter().chain(axle(0.0, false)));
    }
    let sound = wheels.iter().all(|wheel| wheel.hub.is_finite() && wheel.radius.is_finite() && wheel.radius > 0.01);
    let carries = |axis: fn(Vec3) -> f32, least: f32| {
        let along = || wheels.iter().map(|wheel| axis(wheel.hub));
        along().fold(f32::MIN, f32::max) - along().fold(f32::MAX, f32::min) > least
    };
    if sound && carries(|hub| hub.x, 0.3) && carries(|hub| hub.z, 0.3) { wheels } else { Vec::new() }
}

/// The wheel that a part is, unless a trailer carries it.
fn wheel_of_part(parts: &[Part], index: usize) -> Option<WheelPlace> {
    let part = parts.get(index)?;
    let Some(Movement::Wheel { radius, steers }) = part.movement else { return None };
    let mut vehicle_from_part = part.rest.compute_affine();
    let mut steers = steers;
    let mut above = part.parent;
    while let Some((at, part)) = above.and_then(|at| Some((at, parts.get(at)?))) {
        match part.movement {
            Some(Movement::Trailer) => return None,
            Some(Movement::Fork) => steers = true,
            _ => {}
        }
        vehicle_from_part = part.rest.compute_affine() * vehicle_from_part;
        above = part.parent.filter(|&parent| parent < at);
    }
    Some(WheelPlace { hub: Vec3::from(vehicle_from_part.translation), radius, steers })
}
