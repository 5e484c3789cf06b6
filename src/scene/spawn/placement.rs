//! Places and looks of entities.

use crate::scene::format::entities::{self, Entity as Source};
use glam::Affine3A;
use systems::lights::LightDescription;
use systems::space::Transform;
#[cfg(feature = "vehicles")]
pub use systems::vehicles::OnRoute;

/// There is none in a build without vehicles.
#[cfg(not(feature = "vehicles"))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OnRoute {}

/// Place and looks of an entity; a generator's copies differ from the file's entity in these.
pub struct Placement<'a> {
    pub name: Option<String>,
    pub parent_from_entity: Transform,
    pub world_from_parent: Affine3A,
    pub mesh: Option<&'a str>,
    pub material: Option<&'a str>,
    pub light: Option<&'a LightDescription>,
    /// The vehicle's type instead of the entity's, and where it drives.
    pub vehicle: Option<&'a str>,
    pub on_route: Option<OnRoute>,
}

impl<'a> Placement<'a> {
    /// The file's own.
    pub fn of(source: &'a Source) -> Self {
        Self {
            name: source.name.clone(),
            parent_from_entity: entities::transform(&source.transform),
            world_from_parent: Affine3A::IDENTITY,
            mesh: source.mesh.as_deref(),
            material: source.material.as_deref(),
            light: source.light.as_ref(),
            vehicle: source.vehicle.as_ref().map(|vehicle| vehicle.r#type.as_str()),
            on_route: None,
        }
    }
}
