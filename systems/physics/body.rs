//! A vehicle in the physics world: a box on springs and tyres.
//!
//! The body's origin and axes are the vehicle's: on the ground below the rear axle, +Z forward, +X left. Its centre of
//! mass is above the middle of its wheels, so that equal springs give equally under its weight and it stands level.

use super::physical::{GRAVITY, Physical, Tuning, WheelPlace, wheels};
use crate::ecs::clock::Clock;
use crate::ecs::sub_steps::SubStep;
use crate::space::transform::Transform;
use crate::vehicles::components::Motion;
use crate::vehicles::types::VehicleType;
use glam::{DVec2, DVec3, Quat, Vec3};
use rapier3d_f64::control::{DynamicRayCastVehicleController, WheelTuning};
use rapier3d_f64::prelude::*;
use serde::{Deserialize, Serialize};

/// Metres per second below which a vehicle that brakes stands.
const STANDSTILL: f64 = 0.05;

/// Seconds; a longer step is done in several of the physics.
const LONGEST: f64 = 1.0 / 60.0;

/// Part of a wheel's sideways velocity that `DynamicRayCastVehicleController` takes away in a step, at a side friction
/// stiffness of 1.
const SIDE_DAMPING: f64 = 0.2;

/// Demand on a vehicle in a step.
#[derive(Clone, Copy, Default)]
pub struct Wish {
    /// m/s² along its forward; against its travel, it brakes.
    pub acceleration: f64,
    /// Radians, of the wheel in the middle of the front axle.
    pub steering: f64,
    /// Direction in which it may set off when it stands: forwards, backwards, or not at all where this is 0.
    pub sets_off: f64,
}

/// One vehicle.
#[derive(Serialize, Deserialize)]
pub struct Body {
    /// The chassis.
    pub handle: RigidBodyHandle,
    /// The wheels, and what they press on.
    controller: DynamicRayCastVehicleController,
    /// Set for wheels that turn with the steering.
    steers: Vec<bool>,
    /// Its numbers.
    pub tuning: Tuning,
    /// From the rear axle to the front axle, metres.
    wheelbase: f64,
    /// The largest steering angle, radians.
    most_steering: f64,
    /// Radians per second.
    steering_rate: f64,
    /// Place and rotation that were last written to the world: found elsewhere, something else has moved the vehicle.
    pub written: (Vec3, Quat),
    /// Radians: of the wheel in the middle of the front axle.
    pub steering: f64,
}

impl Body {
    /// Puts a vehicle of that type into the world, where it is, at that speed along its forward.
    pub fn new(
        world: &mut PhysicsWorld,
        kind: &VehicleType,
        wheels: &[WheelPlace],
        tuning: Tuning,
        at: &Transform,
        motion: &Motion,
    ) -> Self {
        let pose = pose(at, motion);
        let (forward, speed) = (pose.rotation * DVec3::Z, if motion.speed.is_finite() { motion.speed } else { 0.0 });
        let chassis = RigidBodyBuilder::dynamic()
            .pose(pose)
            .linvel(forward * speed)
            .can_sleep(false)
            .additional_mass_properties(mass_properties(kind, wheels, tuning.mass));
        let (handle, _) = world.insert(chassis, chassis_collider(kind, wheels));
        // The first forces come before the step that would do it.
        if let Some(chassis) = world.bodies.get_mut(handle) {
            chassis.recompute_mass_properties_from_colliders(&world.colliders);
        }
        let mut controller = DynamicRayCastVehicleController::new(handle);
        controller.index_forward_axis = 2;
        let deflection = tuning.static_deflection(wheels.len());
        for wheel in wheels {
            // Standing level, the spring is pressed by the static deflection and the hub is where the model has it.
            let top = wheel.hub.as_dvec3() + DVec3::Y * (tuning.rest_length - deflection);
            let (tyre, radius) = (wheel_tuning(&tuning, wheels.len()), wheel.radius.into());
            controller.add_wheel(top, DVec3::NEG_Y, DVec3::NEG_X, tuning.rest_length, radius, &tyre);
        }
        Self {
            handle,
            controller,
            steers: wheels.iter().map(|wheel| wheel.steers).collect(),
            tuning,
            wheelbase: kind.wheelbase.max(0.1).into(),
            most_steering: kind.limits.steering.clamp(0.0, 1.4).into(),
            steering_rate: kind.limits.steering_rate.max(0.0).into(),
            written: (at.translation, at.rotation),
            steering: 0.0,
        }
    }

    /// Gravity, air, engine, brakes, steering, springs and tyres: everything that changes the chassis' velocity in a
    /// step but its collisions. The part of gravity along the ground comes first, so that tyres and brakes hold against
    /// it within the step; the part that the springs carry comes last, lest their dampers take it for a movement.
    pub fn drive(&mut self, world: &mut PhysicsWorld, wish: &Wish, seconds: f64) {
        let Some(chassis) = world.bodies.get_mut(self.handle) else { return };
        self.hold_springs(&chassis.mass_properties().local_mprops, seconds);
        let up = *chassis.rotation() * DVec3::Y;
        let fall = DVec3::NEG_Y * (GRAVITY * seconds);
        let fall_on_springs = up * up.dot(fall);
        let velocity = chassis.linvel() + fall - fall_on_springs;
        let slowed = 1.0 + self.tuning.drag * velocity.length() * seconds / self.tuning.mass;
        chassis.set_linvel(velocity / slowed, true);
        let speed = forward_speed(chassis);
        self.steer(wish.steering, seconds);
        let braking = self.push(wish, speed, seconds);
        let queries = world.broad_phase.as_query_pipeline_mut(
            world.narrow_phase.query_dispatcher(),
            &mut world.bodies,
            &mut world.colliders,
            QueryFilter::new().exclude_rigid_body(self.handle),
        );
        self.controller.update_vehicle(seconds, queries);
        if let Some(chassis) = world.bodies.get_mut(self.handle) {
            self.hold(chassis, braking * seconds);
            let velocity = chassis.linvel() + fall_on_springs;
            chassis.set_linvel(velocity, true);
        }
    }

    /// Makes springs and dampers as stiff as a step of so many seconds holds, without the standing vehicle's height
    /// changing.
    fn hold_springs(&mut self, properties: &MassProperties, seconds: f64) {
        let places = self.controller.wheels().iter().map(|wheel| wheel.chassis_connection_point_cs);
        let held = self.tuning.held(mobility(places, properties), seconds);
        let (count, given) = (self.steers.len(), self.deflection());
        let tyre = wheel_tuning(&held, count);
        for wheel in self.controller.wheels_mut() {
            if wheel.suspension_stiffness != tyre.suspension_stiffness {
                wheel.chassis_connection_point_cs.y += given - held.static_deflection(count);
            }
            wheel.suspension_stiffness = tyre.suspension_stiffness;
            wheel.damping_compression = tyre.suspension_compression;
            wheel.damping_relaxation = tyre.suspension_damping;
        }
    }

    /// Deflection of each spring under the vehicle's weight, as stiff as it is held, metres.
    fn deflection(&self) -> f64 {
        let count = self.steers.len();
        let given = wheel_tuning(&self.tuning, count).suspension_stiffness;
        let held = self.controller.wheels().first().map(|wheel| wheel.suspension_stiffness);
        match held.filter(|held| *held != given) {
            Some(held) => GRAVITY / (count as f64 * held),
            None => self.tuning.static_deflection(count),
        }
    }

    /// Turns the steering toward the wanted angle, as fast as it can; each wheel so that the axes of all meet in one
    /// point on the line of the rear axle (Ackermann's steering).
    fn steer(&mut self, wanted: f64, seconds: f64) {
        let wanted = if wanted.is_finite() { wanted.clamp(-self.most_steering, self.most_steering) } else { 0.0 };
        let most = self.steering_rate * seconds;
        self.steering += (wanted - self.steering).clamp(-most, most);
        let turned = DVec2::from_angle(self.steering);
        for (wheel, steers) in self.controller.wheels_mut().iter_mut().zip(&self.steers) {
            let place = wheel.chassis_connection_point_cs;
            let direction = DVec2::new(self.wheelbase * turned.x - place.x * turned.y, place.z * turned.y);
            wheel.steering = if *steers { direction.to_angle() } else { 0.0 };
        }
    }

    /// Sets the forces of engine and brakes; returns the force of the brakes, newtons. No wheel gets more than its tyre
    /// can pass on under the load of the step before.
    fn push(&mut self, wish: &Wish, speed: f64, seconds: f64) -> f64 {
        let force = if wish.acceleration.is_finite() { wish.acceleration * self.tuning.mass } else { 0.0 };
        let stands = speed.abs() < STANDSTILL;
        let drives = if stands { force * wish.sets_off > 0.0 } else { force * speed >= 0.0 };
        let (engine, brake) = if drives {
            (force.clamp(-self.tuning.engine_force, self.tuning.engine_force), 0.0)
        } else {
            (0.0, if force == 0.0 { f64::MAX } else { force.abs() }.min(self.tuning.brake_force))
        };
        let share = 1.0 / self.controller.wheels().len() as f64;
        let mut braking = 0.0;
        for wheel in self.controller.wheels_mut() {
            let grip = wheel.wheel_suspension_force * self.tuning.friction;
            wheel.engine_force = (engine * share).clamp(-grip, grip);
            // An impulse per step, unlike the engine's force.
            let brake = (brake * share).min(grip);
            wheel.brake = brake * seconds;
            braking += brake;
        }
        braking
    }

    /// Stops the chassis with the impulse that the wheels leave of the brakes'. The wheels alone leave a part of its
    /// velocity, which on a slope would be a creep. A standing vehicle is held sideways, too.
    fn hold(&self, chassis: &mut RigidBody, most: f64) {
        let used: f64 = self.controller.wheels().iter().map(|wheel| wheel.forward_impulse.abs()).sum();
        let left = (most - used).max(0.0) / self.tuning.mass;
        let along = chassis.linvel().reject_from_normalized(*chassis.rotation() * DVec3::Y);
        let forward = *chassis.rotation() * DVec3::Z;
        let slides = if along.length() < STANDSTILL { along } else { forward * forward.dot(along) };
        if left > 0.0 {
            let velocity = chassis.linvel() - slides.clamp_length_max(left);
            chassis.set_linvel(velocity, true);
        }
    }

    /// Compression of a wheel's spring beyond that under the standing vehicle, metres; negative where it hangs.
    pub fn travel(&self, wheel: usize) -> Option<f64> {
        let wheels = self.controller.wheels();
        let standing = self.tuning.rest_length - self.deflection();
        wheels.get(wheel).map(|wheel| standing - wheel.raycast_info().suspension_length)
    }

    /// Number of wheels that touch something.
    pub fn wheels_on_ground(&self) -> usize {
        self.controller.wheels().iter().filter(|wheel| wheel.raycast_info().is_in_contact).count()
    }

    /// Everything a step goes on from, as numbers: what a hash of the state takes in.
    pub fn state(&self, world: &PhysicsWorld, mut add: impl FnMut(f64)) {
        let Some(chassis) = world.bodies.get(self.handle) else { return };
        let place = chassis.position();
        for vector in [place.translation, chassis.linvel(), chassis.angvel()] {
            vector.to_array().into_iter().for_each(&mut add);
        }
        place.rotation.to_array().into_iter().for_each(&mut add);
        add(self.steering);
        for wheel in self.controller.wheels() {
            [wheel.rotation, wheel.wheel_suspension_force].into_iter().for_each(&mut add);
        }
    }
}

/// In how many steps of the physics so many seconds are done, and how long each is.
pub fn parts(seconds: f64) -> (u32, f64) {
    let count = (seconds / LONGEST - 1e-6).ceil().max(1.0);
    (count as u32, seconds / count)
}

/// m/s of the chassis' origin, the middle of the rear axle, along its forward.
pub fn forward_speed(chassis: &RigidBody) -> f64 {
    let place = chassis.position();
    (place.rotation * DVec3::Z).dot(chassis.velocity_at_point(place.translation))
}

/// The place of a body that has the vehicle's origin and axes.
pub fn pose(at: &Transform, motion: &Motion) -> Pose {
    let mut motion = *motion;
    motion.follow(at.translation);
    Pose::from_parts(motion.place, at.rotation.as_dquat().normalize())
}

/// The box that touches other things: the type's size, above the ground by as much as its springs and wheels allow.
pub fn chassis_collider(kind: &VehicleType, wheels: &[WheelPlace]) -> ColliderBuilder {
    let size = kind.size.max(Vec3::splat(0.2)).min(Vec3::splat(100.0));
    let radius = wheels.iter().map(|wheel| wheel.radius).fold(0.0, f32::max);
    let clearance = (0.7 * radius).min(0.5 * size.y);
    let half = (Vec3::new(size.x, size.y - clearance, size.z) / 2.0).as_dvec3();
    let middle = DVec3::new(0.0, f64::from(clearance) + half.y, half.z - f64::from(kind.rear_overhang));
    ColliderBuilder::cuboid(half.x, half.y, half.z).translation(middle).density(0.0).friction(0.4)
}

/// Those of an even box of the type's size, and at least as long and wide as its wheels are apart, its middle lowered
/// to where a vehicle's heavy parts are.
fn mass_properties(kind: &VehicleType, wheels: &[WheelPlace], mass: f64) -> MassProperties {
    let hubs = || wheels.iter().map(|wheel| wheel.hub);
    let apart = hubs().fold(Vec3::MIN, Vec3::max) - hubs().fold(Vec3::MAX, Vec3::min);
    let size = kind.size.max(apart.with_y(0.0)).max(Vec3::splat(0.2)).min(Vec3::splat(100.0)).as_dvec3();
    let middle = wheels.iter().map(|wheel| wheel.hub.as_dvec3()).sum::<DVec3>() / wheels.len().max(1) as f64;
    let squares = size * size;
    let inertia = DVec3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y) * (mass / 12.0);
    MassProperties::new(DVec3::new(middle.x, 0.35 * size.y, middle.z), mass, inertia)
}

/// The largest ratio of the wheels' velocities along their springs to the impulses that all of these take, 1/kg: of the
/// eigenvalues of J·M⁻¹·Jᵀ, with a row of J for each wheel and M the chassis' mass and moments of inertia. Going up and
/// down, pitching and rolling are independent, up to wheels that are not opposite each other.
fn mobility(wheels: impl ExactSizeIterator<Item = DVec3> + Clone, properties: &MassProperties) -> f64 {
    let (count, inertia) = (wheels.len() as f64, properties.principal_inertia());
    let sum = |part: fn(DVec3) -> f64| wheels.clone().map(|at| part(at - properties.local_com)).sum::<f64>();
    let (pitch, roll) = (sum(|at| at.z * at.z) / inertia.x, sum(|at| at.x * at.x) / inertia.z);
    let both = sum(|at| at.x * at.z).abs() / (inertia.x * inertia.z).sqrt();
    (count * properties.inv_mass).max(pitch.max(roll) + both)
}

/// Messages about given springs of a vehicle that count as another number. Their ranges follow from its weight and the
/// clock's step.
pub fn unheld(physical: &Physical, kind: &VehicleType, clock: &Clock) -> Vec<String> {
    let wheels = wheels(kind);
    if wheels.is_empty() {
        return Vec::new();
    }
    let given = Tuning::of(physical, kind, wheels.len());
    let seconds = SubStep::of(clock).next().map_or(LONGEST, |part| parts(part.seconds).1);
    let hubs = wheels.iter().map(|wheel| wheel.hub.as_dvec3());
    let held = given.held(mobility(hubs, &mass_properties(kind, &wheels, given.mass)), seconds);
    let springs = [
        ("stiffness", physical.stiffness, held.stiffness, "N/m"),
        ("damping", physical.damping, held.damping, "N·s/m"),
    ];
    // Up to the rounding of single floats.
    let differs = |found: f32, counts: f64| (f64::from(found) - counts).abs() > 1e-6 * counts;
    let found = springs.into_iter().filter_map(|(name, given, counts, unit)| Some((name, given?, counts, unit)));
    found
        .filter(|(_, found, counts, _)| differs(*found, *counts))
        .map(|(name, found, counts, unit)| {
            let bound = if f64::from(found) > counts { "most" } else { "least" };
            let mass = given.mass;
            format!(
                "physical: {name}: expected at {bound} {counts:.0} {unit} under {mass} kg at a step of {seconds:.4} s, \
                 found {found}; it counts as that"
            )
        })
        .collect()
}

/// The controller's numbers are per kilogram of the chassis; a wheel's sideways velocity is taken away within a step,
/// as far as friction goes.
fn wheel_tuning(tuning: &Tuning, wheels: usize) -> WheelTuning {
    WheelTuning {
        suspension_stiffness: tuning.stiffness / tuning.mass,
        suspension_compression: tuning.damping / tuning.mass,
        suspension_damping: tuning.damping / tuning.mass,
        max_suspension_travel: tuning.rest_length,
        side_friction_stiffness: 1.0 / (SIDE_DAMPING * wheels as f64),
        friction_slip: tuning.friction,
        max_suspension_force: tuning.mass * GRAVITY * 10.0,
    }
}
