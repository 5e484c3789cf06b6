//! Physically simulated vehicles: rigid bodies on springs and tyres that bump into each other, by `rapier3d-f64`.
//!
//! A [`Vehicle`](crate::vehicles::Vehicle) with [`Physical`] is simulated; all others are kinematic, and those near are
//! bodies that nothing pushes. The rest of the world sees the same components either way: `Transform` and
//! [`Motion`](crate::vehicles::Motion) are written here instead of by the kinematic model, which says what the driver
//! wants by [`Wanted`](crate::vehicles::Wanted).
//!
//! ```text
//! physical  Physical and Wanted, and the numbers derived from a type
//! bodies    Physics: the world of bodies, its steps
//! body      a vehicle as a rigid body with rapier's ray-cast vehicle: engine, brakes, steering
//! ground    colliders of ground and obstacles
//! traffic   bodies of kinematic vehicles near physical ones
//! springs   the wheels of the model follow the springs
//! ```
//!
//! [`Physics`] is the whole state beside the components, and serialisable: a step depends on nothing else. Vehicles are
//! known by their numbers and colliders by what they are, so that nothing depends on the order of entities.

pub(crate) mod bodies;
mod body;
pub(crate) mod ground;
pub(crate) mod physical;
pub(crate) mod springs;
pub(crate) mod traffic;

pub use bodies::{Physics, any_physical, place_bodies, step_bodies, write_back};
pub use body::unheld;
pub use ground::{Obstacle, update_ground};
pub use physical::{GRAVITY, Physical, Tuning, WheelPlace, wheels};
pub use springs::{Sprung, WheelsFound, find_wheels, move_springs};
pub use traffic::follow_traffic;
