//! Viewpoints of pictures: a camera of the scene, or a vehicle, from behind or from the driver's seat.

#[cfg(feature = "vehicles")]
mod vehicle;

use bevy_ecs::prelude::*;
use glam::Affine3A;
use systems::draw::{Camera, View};
use systems::space::GlobalTransform;

/// Origin of a view: a camera, or a place at a vehicle. The world holds no state of it: it follows from where things
/// are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Viewpoint {
    /// An entity with a [`Camera`].
    Camera(Entity),
    /// From behind a vehicle and above it, looking ahead.
    #[cfg(feature = "vehicles")]
    Chase(Entity),
    /// From the driver's seat.
    #[cfg(feature = "vehicles")]
    Driver(Entity),
}

impl From<Entity> for Viewpoint {
    fn from(camera: Entity) -> Self {
        Self::Camera(camera)
    }
}

impl Viewpoint {
    /// The viewpoint that a person names: a camera's name, `chase NAME` or `driver NAME` with the name of a vehicle.
    pub fn find(wanted: &str, cameras: &[(String, Entity)], world: &mut World) -> Option<Self> {
        if let Some((_, camera)) = cameras.iter().find(|(name, _)| name == wanted) {
            return Some(Self::Camera(*camera));
        }
        vehicle::find(wanted, world)
    }

    /// The vehicle, of the two that follow one.
    pub fn vehicle(self) -> Option<Entity> {
        match self {
            Self::Camera(_) => None,
            #[cfg(feature = "vehicles")]
            Self::Chase(vehicle) | Self::Driver(vehicle) => Some(vehicle),
        }
    }

    /// The same at another entity, if there is one.
    pub fn at_another(self, another: impl FnOnce(Entity) -> Option<Entity>) -> Option<Self> {
        Some(match self {
            Self::Camera(camera) => Self::Camera(another(camera)?),
            #[cfg(feature = "vehicles")]
            Self::Chase(vehicle) => Self::Chase(another(vehicle)?),
            #[cfg(feature = "vehicles")]
            Self::Driver(vehicle) => Self::Driver(another(vehicle)?),
        })
    }

    /// View from there, as of the last frame.
    pub fn view(self, world: &World, (width, height): (u32, u32)) -> View {
        match self {
            Self::Camera(camera) => {
                let seen = world.get::<Camera>(camera).cloned().unwrap_or_default();
                View::new(&place(world, camera), &seen, width, height)
            }
            #[cfg(feature = "vehicles")]
            Self::Chase(vehicle) => vehicle::from_behind(world, vehicle, (width, height)),
            #[cfg(feature = "vehicles")]
            Self::Driver(vehicle) => vehicle::from_seat(world, vehicle, (width, height)),
        }
    }
}

/// A build without vehicles has none to look from.
#[cfg(not(feature = "vehicles"))]
mod vehicle {
    pub fn find(_: &str, _: &mut bevy_ecs::world::World) -> Option<super::Viewpoint> {
        None
    }
}

/// World from an entity, as of the last frame.
fn place(world: &World, entity: Entity) -> Affine3A {
    world.get::<GlobalTransform>(entity).copied().unwrap_or_default().affine()
}
