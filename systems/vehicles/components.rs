//! Components of vehicles, and the ids in them.

use crate::space::interpolation::Interpolated;
use crate::space::transform::{FARTHEST, Transform};
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Names a [`VehicleType`](super::types::VehicleType) of [`VehicleTypes`](super::types::VehicleTypes).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct VehicleTypeId(pub u16);

impl VehicleTypeId {
    /// The stand-in that is always there: a box of a car's size on four wheels, without lamps.
    pub const STAND_IN: Self = Self(0);
}

/// Names a route of [`Routes`](super::routes::Routes).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize)]
pub struct RouteId(pub u16);

/// Metres per second: as fast as anything may be that is put on a route, and as any limit or type. 2000 km/h.
pub const FASTEST: f64 = 2000.0 / 3.6;

/// Makes an entity a vehicle of a type; its parts become entities below it as it is spawned.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
#[require(Transform, VehicleNumber, Motion, Controls, Interpolated)]
#[component(immutable)]
pub struct Vehicle {
    /// Type.
    pub kind: VehicleTypeId,
    /// Index of the type's paint; counted round.
    pub paint: u32,
}

impl Vehicle {
    /// A vehicle of that type, in its first paint.
    pub fn of(kind: VehicleTypeId) -> Self {
        Self { kind, paint: 0 }
    }

    /// The same vehicle in another of its type's paints, counted round.
    pub fn painted(self, paint: u32) -> Self {
        Self { paint, ..self }
    }
}

/// Tells vehicles apart, whatever order tables are in: what happens first is decided by it. Given to a vehicle as it is
/// spawned, counting up, and never given twice; one that is written beforehand is kept.
#[derive(Component, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
pub struct VehicleNumber(pub u32);

impl VehicleNumber {
    /// Not given yet.
    pub const NONE: Self = Self(u32::MAX);
}

impl Default for VehicleNumber {
    fn default() -> Self {
        Self::NONE
    }
}

/// The number that the next vehicle gets.
#[derive(Resource, Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Default)]
pub struct NextVehicleNumber(pub u32);

/// Place and motion of a vehicle. State: written by whatever moves it. Sums over steps have 64 bits: in 32, a step of
/// 0.1 ms would be lost in a place kilometres away.
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize, Default)]
pub struct Motion {
    /// Place of its origin in world space, metres. The entity's translation is this, rounded; if something else writes
    /// another translation, this follows.
    pub place: DVec3,
    /// Along its own forward, m/s; negative in reverse.
    pub speed: f64,
    /// Derivative of `speed`, m/s².
    pub acceleration: f32,
    /// Steering angle of the front wheels, about the up axis: the bicycle model's, that of a wheel in the middle.
    pub steering: f32,
    /// World space, about +Y, 0 along +Z. The entity's rotation follows from it and from the ground.
    pub yaw: f64,
    /// Angle of a trailer against what pulls it, about +Y.
    pub hitch: f64,
    /// Metres along its own forward since it was spawned: how far the wheels have turned.
    pub rolled: f64,
}

impl Motion {
    /// True if its numbers are numbers, and its place is one that a world has.
    pub(crate) fn is_valid(&self) -> bool {
        let adding_up = [self.speed, self.yaw, self.hitch, self.rolled];
        let is_near = self.place.abs().max_element() <= 2.0 * FARTHEST;
        let is_finite = adding_up.iter().all(|n| n.is_finite()) && self.place.is_finite() && is_near;
        is_finite && self.acceleration.is_finite() && self.steering.is_finite()
    }

    /// The place again where that of the entity was written by something else. Returns whether it was.
    pub(crate) fn follow(&mut self, translation: Vec3) -> bool {
        let is_elsewhere = self.place.as_vec3() != translation;
        if is_elsewhere {
            self.place = translation.as_dvec3();
        }
        is_elsewhere
    }
}

/// Demand on a vehicle that no route drives, or that is under [`ManualControl`].
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize, Default)]
pub struct Controls {
    /// 0..1 of the type's acceleration; −1..0 in reverse.
    pub throttle: f32,
    /// 0..1 of the type's hardest braking.
    pub brake: f32,
    /// −1..1 of the type's steering angle, left positive.
    pub steer: f32,
    /// Head lamps.
    pub headlights: Headlights,
    /// Indicators.
    pub indicator: Indicator,
}

impl Controls {
    /// Tells if its numbers are within their ranges.
    pub(crate) fn is_valid(&self) -> bool {
        let ranges = [(self.throttle, -1.0), (self.brake, 0.0), (self.steer, -1.0)];
        ranges.iter().all(|(value, least)| (*least..=1.0).contains(value))
    }
}

/// Head and tail lamps.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Default)]
pub enum Headlights {
    /// None; nor the tail lamps.
    Off,
    /// Low beam, and the tail lamps.
    #[default]
    Low,
    /// High beam, and the tail lamps.
    High,
}

/// Indicators under manual control. Routes set them by themselves.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Default)]
pub enum Indicator {
    /// Neither side.
    #[default]
    Off,
    /// Left.
    Left,
    /// Right.
    Right,
    /// Both.
    Hazard,
}

/// Under manual control: driven through [`Controls`], even where it has a route.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Default)]
pub struct ManualControl;

/// Drives along a route by itself, unless it is under [`ManualControl`]. State. As it is added, an entity that stands
/// at the origin is put to its place on the route; later the vehicle's place decides, and `at` follows it.
#[derive(Component, Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct OnRoute {
    /// The route.
    pub route: RouteId,
    /// Distance of the reference point from the route's beginning, metres.
    pub at: f64,
    /// The lane; while it changes, the one that it changes to.
    pub lane: u8,
    /// Number of routes that it chose: an input of [`Routes::next`](super::routes::Routes::next).
    pub choices: u32,
    /// The routes and lanes that it came from, latest first.
    pub previous: [Option<(RouteId, u8)>; 2],
    /// The change of lane that is under way.
    pub change: Option<LaneChange>,
    /// Seconds that it has stood before a stop; infinite once that was long enough, until it is past it.
    pub waited: f64,
}

impl OnRoute {
    /// So many metres along a lane of a route.
    pub fn new(route: RouteId, lane: u8, at: impl Into<f64>) -> Self {
        Self { route, at: at.into(), lane, ..Self::default() }
    }

    /// Tells if its numbers are finite; the wait may be infinite.
    pub(crate) fn is_valid(&self) -> bool {
        let change = self.change.is_none_or(|change| change.from.is_finite() && change.done.is_finite());
        self.at.is_finite() && !self.waited.is_nan() && change
    }
}

/// A change of lane that is under way.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct LaneChange {
    /// Offset at its beginning, metres to the left of the centre line.
    pub from: f32,
    /// The lane that it leaves.
    pub from_lane: u8,
    /// Part of it that is done, 0..1.
    pub done: f64,
}

/// Demand of a driver on a vehicle that something else moves, as physics do. Where a vehicle has it, drivers write it
/// in every step instead of [`Motion`] and `Transform`. The route follows where the vehicle gets to.
#[derive(Component, Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Wanted {
    /// m/s², as [`Motion::acceleration`].
    pub acceleration: f32,
    /// Radians, as [`Motion::steering`].
    pub steering: f32,
}

/// A vehicle whose numbers made no sense any more (infinite, or none at all): it was put back to where it last was, and
/// stands there until this is removed.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Stalled;
