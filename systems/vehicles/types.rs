//! Types of vehicles: what all vehicles of a type share.

use super::components::VehicleTypeId;
use super::forks::Chooser;
use super::parts::{Movement, Part};
use crate::assets::library::Library;
use crate::assets::material::MaterialId;
use crate::assets::shapes;
use crate::space::bounds::Aabb;
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};

/// All types, by id.
#[derive(Resource, Clone, Debug)]
pub struct VehicleTypes {
    types: Vec<VehicleType>,
}

impl Default for VehicleTypes {
    fn default() -> Self {
        Self { types: vec![VehicleType::default()] }
    }
}

impl VehicleTypes {
    /// Adds a type; one of the same name is replaced and keeps its id.
    pub fn add(&mut self, vehicle_type: VehicleType) -> VehicleTypeId {
        if let Some(id) = self.find(&vehicle_type.name) {
            self.types[id.0 as usize] = vehicle_type;
            return id;
        }
        self.types.push(vehicle_type);
        VehicleTypeId((self.types.len() - 1) as u16)
    }

    /// The type of that name.
    pub fn find(&self, name: &str) -> Option<VehicleTypeId> {
        self.types.iter().position(|t| t.name == name).map(|index| VehicleTypeId(index as u16))
    }

    /// A type; the stand-in for an id of another world.
    pub fn get(&self, id: VehicleTypeId) -> &VehicleType {
        self.types.get(id.0 as usize).unwrap_or(&self.types[0])
    }

    /// Gives the stand-in a body and wheels to be seen by, unless it has them.
    pub fn build_stand_in(&mut self, library: &mut Library) {
        let Some(VehicleType { size, wheelbase, track, rear_overhang, parts, .. }) =
            self.types.first_mut().filter(|t| t.parts.is_empty())
        else {
            return;
        };
        let radius = 0.2 * size.y;
        let hull = library.add_mesh(shapes::cube(Vec3::new(size.x, size.y - radius, size.z)));
        let middle = Vec3::new(0.0, (size.y + radius) / 2.0, size.z / 2.0 - *rear_overhang);
        let fixed = |at| Transform::from_translation(at);
        let grey = MaterialId::DEFAULT;
        let named = |name: &str| Part { name: name.into(), ..Part::default() };
        parts.push(Part { rest: fixed(middle), drawn: Some((hull, grey)), ..named("body") });
        let wheel = library.add_mesh(shapes::cylinder(radius, 0.12 * size.x, 16));
        // A cylinder stands upright; an axle lies across.
        let across = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        for (name, z, steers) in [("wheel_front", *wheelbase, true), ("wheel_rear", 0.0, false)] {
            for x in [*track / 2.0, *track / -2.0] {
                let rest = fixed(Vec3::new(x, radius, z)).with_rotation(across);
                let movement = Some(Movement::Wheel { radius, steers });
                parts.push(Part { rest, drawn: Some((wheel, grey)), movement, ..named(name) });
            }
        }
    }

    /// All, in the order of their ids; the first is the stand-in.
    pub fn iter(&self) -> impl Iterator<Item = (VehicleTypeId, &VehicleType)> {
        self.types.iter().enumerate().map(|(index, t)| (VehicleTypeId(index as u16), t))
    }
}

/// Properties that all vehicles of a type share.
#[derive(Clone, PartialEq, Debug)]
pub struct VehicleType {
    /// Name in scenes.
    pub name: String,
    /// Width, height and length of the whole, a trailer apart, metres.
    pub size: Vec3,
    /// From the rear axle, the origin, back to the rear bumper, metres.
    pub rear_overhang: f32,
    /// From the rear axle to the front axle, metres.
    pub wheelbase: f32,
    /// Between the middles of the wheels of an axle, metres; 0 for two wheels in a row.
    pub track: f32,
    /// Kilograms.
    pub mass: f32,
    /// Limits of its motion.
    pub limits: Limits,
    /// Behaviour of its driver on a route.
    pub driver: Driver,
    /// Trailer that it pulls.
    pub trailer: Option<Trailer>,
    /// Parts of its model; parents before children.
    pub parts: Vec<Part>,
    /// Linear RGB that a painted part's base colour is multiplied with, to choose from.
    pub paints: Vec<Vec3>,
    /// The driver's eye, in the vehicle's space.
    pub eye: Vec3,
    /// The name of its semantic class; empty: none.
    pub class: String,
}

impl Default for VehicleType {
    /// The stand-in.
    fn default() -> Self {
        Self {
            name: "box".into(),
            size: Vec3::new(1.8, 1.5, 4.4),
            rear_overhang: 0.9,
            wheelbase: 2.6,
            track: 1.5,
            mass: 1400.0,
            limits: Limits::default(),
            driver: Driver::default(),
            trailer: None,
            parts: Vec::new(),
            paints: Vec::new(),
            eye: Vec3::new(0.35, 1.2, 1.4),
            class: String::new(),
        }
    }
}

impl VehicleType {
    /// From the rear axle, the origin, forward to the front bumper, metres.
    pub fn front(&self) -> f32 {
        self.size.z - self.rear_overhang
    }

    /// From the rear axle, the origin, back to the end of all, a trailer straight behind included, metres.
    pub fn rear(&self) -> f32 {
        self.trailer.map_or(self.rear_overhang, |trailer| self.rear_overhang.max(trailer.end - trailer.hitch))
    }

    /// Chooser of ways for a vehicle of this type.
    pub fn chooser(&self, number: u32) -> Chooser {
        Chooser { number, length: self.front() + self.rear() }
    }

    /// The box around it, a trailer apart, in its own space.
    pub fn bounds(&self) -> Aabb {
        let half = self.size.x / 2.0;
        let min = Vec3::new(-half, 0.0, -self.rear_overhang);
        Aabb { min, max: Vec3::new(half, self.size.y, self.front()) }
    }
}

/// Limits of a vehicle's motion.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// m/s.
    pub speed: f32,
    /// m/s, in reverse.
    pub reverse_speed: f32,
    /// m/s².
    pub acceleration: f32,
    /// m/s², as hard as it can.
    pub braking: f32,
    /// Radians, of the wheel in the middle of the front axle.
    pub steering: f32,
    /// Radians per second.
    pub steering_rate: f32,
    /// m/s² sideways, that a driver on a route slows down for in bends.
    pub lateral_acceleration: f32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            speed: 50.0,
            reverse_speed: 6.0,
            acceleration: 3.0,
            braking: 8.0,
            steering: 0.6,
            steering_rate: 1.0,
            lateral_acceleration: 2.5,
        }
    }
}

/// Parameters of the Intelligent Driver Model: Treiber, Hennecke, Helbing, "Congested traffic states in empirical
/// observations and microscopic simulations", Physical Review E 62 (2000).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Driver {
    /// Wanted speed as a factor of the speed limit.
    pub speed_factor: f32,
    /// T, seconds to the one ahead.
    pub headway: f32,
    /// s0, metres to the one ahead at a standstill.
    pub gap: f32,
    /// a, m/s².
    pub acceleration: f32,
    /// b, comfortable braking, m/s².
    pub braking: f32,
    /// δ: how acceleration falls off toward the wanted speed.
    pub exponent: f32,
}

impl Default for Driver {
    fn default() -> Self {
        Self { speed_factor: 1.0, headway: 1.2, gap: 2.0, acceleration: 1.5, braking: 2.0, exponent: 4.0 }
    }
}

/// Trailer: a part that turns about its hitch.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Trailer {
    /// The hitch along the vehicle's forward from its rear axle, metres.
    pub hitch: f32,
    /// From the hitch back to the middle of the trailer's axles, metres.
    pub length: f32,
    /// From the hitch back to the trailer's end, metres.
    pub end: f32,
}
