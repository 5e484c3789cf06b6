//! The physics world: which vehicles are bodies in it, its steps, and where the bodies are afterwards.

use super::body::{Body, Wish, forward_speed, parts, pose};
use super::ground::Colliders;
use super::physical::{Physical, Tuning, wheels};
use crate::ecs::sub_steps::SubStep;
use crate::space::interpolation::Interpolated;
use crate::space::transform::{FARTHEST, Transform};
use crate::vehicles::components::{Controls, ManualControl, Motion, OnRoute, Stalled, Vehicle, VehicleNumber, Wanted};
use crate::vehicles::driving::standing;
use crate::vehicles::external::External;
use crate::vehicles::ground::Grounds;
use crate::vehicles::routes::Routes;
use crate::vehicles::steering::hitch_change;
use crate::vehicles::types::{VehicleType, VehicleTypes};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::DVec3;
use rapier3d_f64::prelude::{PhysicsWorld, RigidBodyHandle};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The physics world, and which of its bodies are which vehicles.
#[derive(Resource, Serialize, Deserialize)]
pub struct Physics {
    pub(super) world: PhysicsWorld,
    /// Physical vehicles, by number.
    pub(super) bodies: BTreeMap<u32, Body>,
    /// Kinematic vehicles near physical ones, by number.
    pub(super) others: BTreeMap<u32, RigidBodyHandle>,
    pub(super) colliders: Colliders,
    /// Vehicles that were thrown out of the world: they stay where they were last.
    frozen: BTreeSet<u32>,
    /// Something is new in the world, which wheels do not feel before the world has looked.
    #[serde(skip)]
    pub(super) inserted: bool,
    #[serde(skip)]
    pub(super) warnings: Vec<String>,
}

impl Default for Physics {
    fn default() -> Self {
        // Gravity is applied with the vehicles' other forces, before their brakes and tyres.
        let world = PhysicsWorld { gravity: DVec3::ZERO, ..PhysicsWorld::default() };
        Self {
            world,
            bodies: BTreeMap::new(),
            others: BTreeMap::new(),
            colliders: Colliders::default(),
            frozen: BTreeSet::new(),
            inserted: false,
            warnings: Vec::new(),
        }
    }
}

impl Physics {
    /// Warnings of the simulation, each once; taken away by being read.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Vehicles that are bodies now.
    pub fn len(&self) -> usize {
        self.bodies.len()
    }

    /// Tells if no vehicle is physical.
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// Number of wheels of a vehicle that touch something; `None` where it is not a body.
    pub fn wheels_on_ground(&self, vehicle: VehicleNumber) -> Option<usize> {
        self.bodies.get(&vehicle.0).map(Body::wheels_on_ground)
    }

    /// World-space velocity of a vehicle's centre of mass, m/s.
    pub fn velocity(&self, vehicle: VehicleNumber) -> Option<DVec3> {
        let body = self.bodies.get(&vehicle.0)?;
        self.world.bodies.get(body.handle).map(|chassis| chassis.linvel())
    }

    /// Passes on the physics' part of a state hash, beside the components: places, velocities and wheels of all bodies,
    /// by the number of the vehicle. Contacts' impulses are left out: they show in the velocities one step later.
    pub fn state(&self, mut add: impl FnMut(u64)) {
        for (number, body) in &self.bodies {
            add((*number).into());
            body.state(&self.world, |value| add(value.to_bits()));
        }
        self.frozen.iter().for_each(|number| add((*number).into()));
    }
}

/// Tells if there is anything for the physics to do.
pub fn any_physical(physics: Res<Physics>, vehicles: Query<(), With<Physical>>) -> bool {
    !physics.is_empty() || !vehicles.is_empty()
}

type Placed<'a> = (
    Entity,
    &'a VehicleNumber,
    &'a Vehicle,
    &'a Physical,
    &'a Transform,
    &'a Motion,
    Option<&'a OnRoute>,
    Option<&'a Name>,
);

/// Gives new physical vehicles a body, those on routes where others would stand there; takes it from those that are
/// none any more, and moves the bodies of those that were put elsewhere: they go on as fast, the way that they now
/// look. Those with their wheels in a row would fall over: they are none any more, and go on as all others. What
/// something outside moves is no body meanwhile: others bump into it as into kinematic ones.
pub fn place_bodies(
    mut physics: ResMut<Physics>,
    types: Res<VehicleTypes>,
    (routes, grounds): (Res<Routes>, Res<Grounds>),
    vehicles: Query<Placed, (Without<Stalled>, Without<External>)>,
    mut drawn: Query<&mut Interpolated>,
    mut commands: Commands,
) {
    let physics = &mut *physics;
    let present: BTreeMap<u32, _> = vehicles.iter().map(|row| (row.1.0, row)).collect();
    let gone: Vec<u32> = physics.bodies.keys().filter(|number| !present.contains_key(number)).copied().collect();
    gone.into_iter().for_each(|number| physics.remove(number));
    for (number, (entity, _, vehicle, physical, at, motion, on, name)) in present {
        if let Some(body) = physics.bodies.get_mut(&number) {
            let written = (at.translation, at.rotation);
            if written != body.written
                && at.is_finite()
                && let Some(chassis) = physics.world.bodies.get_mut(body.handle)
            {
                let pose = pose(at, motion);
                let turn = pose.rotation * chassis.rotation().inverse();
                let (velocity, spin) = (turn * chassis.linvel(), turn * chassis.angvel());
                chassis.set_position(pose, true);
                chassis.set_linvel(velocity, true);
                chassis.set_angvel(spin, true);
                body.written = written;
                physics.inserted = true;
                drawn.get_mut(entity).into_iter().for_each(|mut drawn| drawn.jump());
            }
        } else if wheels(types.get(vehicle.kind)).is_empty() {
            let kind = types.get(vehicle.kind);
            let why = if kind.track > 0.0 { "it has no wheels" } else { "its wheels are in a row" };
            physics.warnings.push(format!("{} is not simulated physically: {why}", told(name, number, kind)));
            commands.entity(entity).remove::<Physical>();
        } else if !physics.frozen.contains(&number) {
            let kind = types.get(vehicle.kind);
            let (mut at, mut motion) = (*at, *motion);
            if let Some((on, route)) = on.and_then(|on| Some((on, routes.get(on.route)?))) {
                let height = |ahead| route.height(on.at + ahead);
                (motion.place.y, at.rotation) = standing(&grounds, kind, &motion, height);
                at.translation = motion.place.as_vec3();
            }
            if let Err(why) = physics.add(number, kind, physical, &at, &motion) {
                physics.frozen.insert(number);
                physics.warnings.push(format!("{} is not simulated physically: {why}", told(name, number, kind)));
            }
        }
    }
}

impl Physics {
    /// Says why where it cannot be one.
    fn add(
        &mut self,
        number: u32,
        kind: &VehicleType,
        physical: &Physical,
        at: &Transform,
        motion: &Motion,
    ) -> Result<(), &'static str> {
        let wheels = wheels(kind);
        if !at.is_finite() || !is_within(at.translation.as_dvec3(), f32::MIN) {
            return Err("its position is out of range");
        }
        let tuning = Tuning::of(physical, kind, wheels.len());
        let body = Body::new(&mut self.world, kind, &wheels, tuning, at, motion);
        self.bodies.insert(number, body);
        self.inserted = true;
        Ok(())
    }

    fn remove(&mut self, number: u32) {
        if let Some(body) = self.bodies.remove(&number) {
            self.world.remove_body(body.handle);
        }
    }
}

/// Designation of a vehicle in messages: its name, or else its number and type.
fn told(name: Option<&Name>, number: u32, kind: &VehicleType) -> String {
    name.map_or_else(|| format!("vehicle {} ({})", number + 1, kind.name), Name::to_string)
}

type Driven<'a> = (&'a VehicleNumber, &'a Wanted, &'a Controls, Has<ManualControl>, Has<OnRoute>);

/// A standing vehicle sets off forwards where its route wants it to, or the way that its throttle says.
fn wish((_, wanted, controls, manual, on_route): (&VehicleNumber, &Wanted, &Controls, bool, bool)) -> Wish {
    let pedals = manual || !on_route;
    let throttle = if controls.brake > 0.0 { 0.0 } else { controls.throttle.into() };
    let sets_off = if pedals { throttle } else { 1.0 };
    Wish { acceleration: wanted.acceleration.into(), steering: wanted.steering.into(), sets_off }
}

/// Moves all bodies on, by a step or a part of one.
pub fn step_bodies(mut physics: ResMut<Physics>, now: Res<SubStep>, vehicles: Query<Driven, With<Physical>>) {
    let Physics { world, bodies, inserted, .. } = &mut *physics;
    let (substeps, seconds) = parts(now.seconds);
    if !(seconds > 0.0 && seconds.is_finite()) {
        return;
    }
    world.integration_parameters.dt = seconds;
    let wishes: BTreeMap<u32, Wish> = vehicles.iter().map(|row| (row.0.0, wish(row))).collect();
    if std::mem::take(inserted) {
        // The wheels' rays find colliders where the last step left them, and new ones are nowhere yet. (To detect
        // collisions here would enter them, too, but take new bodies and contacts from the step, which enters these
        // into islands.)
        for (handle, collider) in world.colliders.iter() {
            world.broad_phase.set_aabb(&world.integration_parameters, handle, collider.compute_aabb());
        }
    }
    for _ in 0..substeps {
        for (number, body) in bodies.iter_mut() {
            body.drive(world, &wishes.get(number).copied().unwrap_or_default(), seconds);
        }
        world.step();
    }
}

/// Writes where the bodies are to their vehicles.
#[allow(clippy::type_complexity)]
pub fn write_back(
    mut physics: ResMut<Physics>,
    now: Res<SubStep>,
    types: Res<VehicleTypes>,
    mut vehicles: Query<(&VehicleNumber, &Vehicle, &mut Transform, &mut Motion, Option<&Name>), With<Physical>>,
) {
    let Physics { world, bodies, colliders, .. } = &mut *physics;
    let seconds = now.seconds;
    let mut lost = BTreeMap::new();
    for (number, vehicle, mut transform, mut motion, name) in &mut vehicles {
        let Some(body) = bodies.get_mut(&number.0) else { continue };
        let kind = types.get(vehicle.kind);
        let chassis = world.bodies.get(body.handle).filter(|chassis| chassis.is_enabled());
        let Some(chassis) = chassis.filter(|chassis| is_within(chassis.translation(), colliders.lowest)) else {
            motion.speed = 0.0;
            motion.acceleration = 0.0;
            lost.insert(number.0, told(name, number.0, kind));
            continue;
        };
        let place = chassis.position();
        motion.place = place.translation;
        body.written = (place.translation.as_vec3(), place.rotation.as_quat());
        (transform.translation, transform.rotation) = body.written;
        let speed = forward_speed(chassis);
        motion.acceleration = ((speed - motion.speed) / seconds) as f32;
        motion.speed = speed;
        motion.steering = body.steering as f32;
        let forward = place.rotation * DVec3::Z;
        motion.yaw = forward.x.atan2(forward.z);
        motion.rolled += speed * seconds;
        if let Some(trailer) = kind.trailer.filter(|trailer| trailer.length > 0.0) {
            // Without mass, as its axle rolls.
            let turn = hitch_change(&trailer, motion.hitch, motion.speed, chassis.angvel().y);
            motion.hitch = (motion.hitch + turn * seconds).clamp(-1.5, 1.5);
        }
    }
    for (number, name) in lost {
        physics.remove(number);
        physics.frozen.insert(number);
        physics.warnings.push(format!("{name} left the world and stays at its last position"));
    }
}

/// Farther from the origin it was thrown out of the world.
fn is_within(place: DVec3, lowest: f32) -> bool {
    place.is_finite() && place.length() < FARTHEST && place.y > f64::from(lowest)
}
