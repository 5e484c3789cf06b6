//! Obstacles and bodies of the physics, as collision sensors meet them.

use super::bodies::{meshes, solid};
use super::place;
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use systems::assets::Library;
use systems::physics::{Obstacle, Physics};
use systems::sensors::collision::Convex;
use systems::vehicles::VehicleNumber;

/// Entities that stand in the way.
pub(super) fn obstacles(world: &World) -> Vec<Entity> {
    let obstacles = world.try_query_filtered::<Entity, With<Obstacle>>();
    obstacles.map_or_else(Vec::new, |mut obstacles| obstacles.iter(world).collect())
}

/// The bodies of an obstacle, of its triangles those that are near; those of anything else.
pub(super) fn solid_or_obstacle(world: &World, entity: Entity, is_near: impl Fn((DVec3, f64)) -> bool) -> Vec<Convex> {
    if world.get::<Obstacle>(entity) != Some(&Obstacle::Mesh) {
        return solid(world, entity);
    }
    let library = world.resource::<Library>();
    let mut found = Vec::new();
    for (entity, mesh) in meshes(world, entity) {
        let (place, Some(entry)) = (place::place(world, entity), library.mesh(mesh)) else { continue };
        for triangle in entry.mesh.indices.as_chunks().0 {
            let [a, b, c]: [Option<&Vec3>; 3] = triangle.map(|corner: u32| entry.mesh.positions.get(corner as usize));
            let (Some(a), Some(b), Some(c)) = (a, b, c) else { continue };
            let [a, b, c] = [a, b, c].map(|corner| place.transform_point3(corner.as_dvec3()));
            if is_near((a, a.distance(b).max(a.distance(c)))) {
                found.push(Convex::of_triangle([a, b, c]));
            }
        }
    }
    found
}

/// Velocity of a body's centre of mass.
pub(super) fn of_body(world: &World, vehicle: Entity) -> Option<DVec3> {
    world.get_resource::<Physics>()?.velocity(*world.get::<VehicleNumber>(vehicle)?)
}
