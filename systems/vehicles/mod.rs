//! Vehicles: entities that drive, on wheels that roll, under lamps that light the road.
//!
//! Spawning one is one line: `world.spawn(Vehicle::of(kind))`. What it consists of comes from its type: a
//! [`VehicleType`] holds the numbers that motion goes by and the parts of its model, and is data, not code.
//!
//! ```text
//! components    what is on vehicles; hooks: what becomes of an entity that is made one
//! types         VehicleTypes: dimensions, limits, driver, parts; shared by all vehicles of a type
//! parts         what a new vehicle gets: child entities for its body, wheels and lamps; wheels roll, forks turn, legs
//!               swing
//! proxies       what is drawn in the place of the parts where a vehicle is small
//! lamps         which lamps are on, their light and the glow of their glass
//!
//! driving       the step: each is moved by what was noted before any moved; on_route: as routes want
//! routes        Routes: centre lines, lanes, limits, stops; route_line: their samples; forks: what follows;
//!               lane_places: where a point is in a lane
//! signals       what traffic lights show
//! traffic/      traffic: which vehicle is ahead of which; lanes: by lane, in order; crossings: which wait before one;
//!               following: how fast, by the Intelligent Driver Model; lane_changes: MOBIL
//! steering      where to: pure pursuit, bicycle model, trailer; hand: by Controls instead; turns: about the axes
//! external      where to: poses that come from outside
//! ground        what vehicles stand on
//! ```
//!
//! Conventions: metres, seconds, radians. A vehicle looks along its local +Z, left is +X, up is +Y (glTF); its origin
//! is on the ground, under the middle of the rear axle, which is the reference point of the bicycle model. Steering
//! angles and yaw are positive to the left.

pub(crate) mod components;
pub mod driving;
pub mod external;
pub mod forks;
pub mod ground;
mod hand;
pub mod hooks;
pub mod lamps;
mod lane_places;
mod on_route;
pub mod parts;
pub mod proxies;
pub mod route_line;
pub mod routes;
pub mod signals;
pub mod steering;
pub mod traffic;
mod turns;
pub mod types;

pub use components::{
    Controls, FASTEST, Headlights, Indicator, LaneChange, ManualControl, Motion, NextVehicleNumber, OnRoute, RouteId,
    Stalled, Vehicle, VehicleNumber, VehicleTypeId, Wanted,
};
pub use external::{External, MotionSource, StampedMotion};
pub use traffic::{following, lane_changes};
pub use types::{VehicleType, VehicleTypes};
