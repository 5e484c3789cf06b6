//! What collision sensors capture: boxes and meshes that touch the thing that a sensor is mounted on.
//!
//! A vehicle is the box of its type, without its trailer, from a little above the ground on; anything else is the boxes
//! around its meshes. What it may touch are other vehicles, and obstacles: by the boxes around their meshes, or their
//! triangles.

use super::axes::ENTITY_FROM_LIDAR;
use super::label_table::{LabelTable, mounted_on};
use super::lanes::vehicle_of;
use super::lidar::Pose;
use super::motion;
use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3};
use systems::assets::{Library, MeshId};
use systems::draw::pieces::{PieceOf, WholeMesh};
use systems::sensors::CollisionSensor;
use systems::sensors::collision::{Collision, Convex, Touch};
use systems::vehicles::{Motion, Vehicle, VehicleTypes};

/// Metres above the ground, but at most half a vehicle's height: what is lower is driven over.
const CLEARANCE: f32 = 0.2;

/// What the thing touches that a sensor is mounted on, by number.
pub(super) fn capture(
    sensor: &CollisionSensor,
    world: &World,
    (entity, pose): (Entity, &Pose),
    labels: &mut LabelTable,
) -> Vec<Collision> {
    let (own, margin) = (carrier(world, entity), f64::from(sensor.margin));
    let bodies = solid(world, own);
    let spheres: Vec<(DVec3, f64)> = bodies.iter().map(Convex::sphere).collect();
    let is_near = |(place, radius): (DVec3, f64)| {
        spheres.iter().any(|(own, reach)| own.distance(place) <= reach + radius + 2.0 * margin)
    };
    let deepest = |others: &[Convex]| {
        let near = others.iter().filter(|other| is_near(other.sphere()));
        let touches = near.flat_map(|other| bodies.iter().filter_map(|own| own.touch(other, margin)));
        touches.max_by(|a, b| a.depth.total_cmp(&b.depth))
    };
    let mut found: Vec<Collision> = Vec::new();
    for other in vehicles_near(world, is_near).into_iter().chain(obstacles(world)).filter(|other| *other != own) {
        let Some(Touch { depth, normal }) = deepest(&solid_or_obstacle(world, other, is_near)) else { continue };
        let labels = labels.labels(world, other.index_u32().wrapping_add(1));
        let speed = (velocity(world, other) - velocity(world, own)).dot(normal);
        let normal = ENTITY_FROM_LIDAR.transpose() * (pose.rotation.inverse() * normal);
        found.push(Collision { instance: labels.instance, class: labels.class, depth, normal, speed });
    }
    found.sort_by(|a, b| a.instance.cmp(&b.instance).then(b.depth.total_cmp(&a.depth)));
    found.dedup_by_key(|collision| collision.instance);
    found
}

/// What a sensor is mounted on: a vehicle, or else the nearest thing above it, or what it is below, or itself.
fn carrier(world: &World, sensor: Entity) -> Entity {
    let parent = || world.get::<ChildOf>(sensor).map(ChildOf::parent);
    vehicle_of(world, sensor).or_else(|| mounted_on(world, sensor)).or_else(parent).unwrap_or(sensor)
}

/// Vehicles whose boxes may be near.
fn vehicles_near(world: &World, is_near: impl Fn((DVec3, f64)) -> bool) -> Vec<Entity> {
    let Some(mut vehicles) = world.try_query::<(Entity, &Vehicle, &Motion)>() else { return Vec::new() };
    let types = world.resource::<VehicleTypes>();
    let reach = |vehicle: &Vehicle| f64::from(types.get(vehicle.kind).size.length());
    let all = vehicles.iter(world);
    all.filter(|(_, vehicle, motion)| is_near((motion.place, reach(vehicle)))).map(|(entity, ..)| entity).collect()
}

/// The bodies of a vehicle, or of anything else.
fn solid(world: &World, entity: Entity) -> Vec<Convex> {
    let Some(vehicle) = world.get::<Vehicle>(entity) else { return boxes(world, entity) };
    let kind = world.resource::<VehicleTypes>().get(vehicle.kind);
    let mut bounds = kind.bounds();
    bounds.min.y = CLEARANCE.min(0.5 * bounds.max.y);
    vec![Convex::of_box(&motion::place(world, entity), bounds.min.as_dvec3(), bounds.max.as_dvec3())]
}

/// An entity and all below it, with their meshes.
fn meshes(world: &World, root: Entity) -> Vec<(Entity, MeshId)> {
    let (mut open, mut found) = (vec![root], Vec::new());
    while let Some(entity) = open.pop() {
        if world.get::<PieceOf>(entity).is_some() {
            continue;
        }
        let whole = world.get::<WholeMesh>(entity).map(|whole| whole.mesh);
        found.extend(whole.or(world.get::<MeshId>(entity).copied()).map(|mesh| (entity, mesh)));
        open.extend(world.get::<Children>(entity).into_iter().flat_map(|children| children.iter()));
    }
    found
}

/// The boxes around the meshes of an entity and all below it.
fn boxes(world: &World, root: Entity) -> Vec<Convex> {
    let library = world.resource::<Library>();
    let of_mesh = |(entity, mesh)| {
        let aabb = library.mesh(mesh)?.aabb;
        Some(Convex::of_box(&motion::place(world, entity), aabb.min.as_dvec3(), aabb.max.as_dvec3()))
    };
    meshes(world, root).into_iter().filter_map(of_mesh).collect()
}

#[cfg(feature = "physics")]
mod with_physics {
    use super::*;
    use glam::Vec3;
    use systems::physics::{Obstacle, Physics};
    use systems::vehicles::VehicleNumber;

    /// What stands in the way.
    pub fn obstacles(world: &World) -> Vec<Entity> {
        let obstacles = world.try_query_filtered::<Entity, With<Obstacle>>();
        obstacles.map_or_else(Vec::new, |mut obstacles| obstacles.iter(world).collect())
    }

    /// The bodies of an obstacle, of its triangles those that are near; those of anything else.
    pub fn solid_or_obstacle(world: &World, entity: Entity, is_near: impl Fn((DVec3, f64)) -> bool) -> Vec<Convex> {
        if world.get::<Obstacle>(entity) != Some(&Obstacle::Mesh) {
            return solid(world, entity);
        }
        let library = world.resource::<Library>();
        let mut found = Vec::new();
        for (entity, mesh) in meshes(world, entity) {
            let (place, Some(entry)) = (motion::place(world, entity), library.mesh(mesh)) else { continue };
            for triangle in entry.mesh.indices.as_chunks().0 {
                let [a, b, c]: [Option<&Vec3>; 3] =
                    triangle.map(|corner: u32| entry.mesh.positions.get(corner as usize));
                let (Some(a), Some(b), Some(c)) = (a, b, c) else { continue };
                let [a, b, c] = [a, b, c].map(|corner| place.transform_point3(corner.as_dvec3()));
                if is_near((a, a.distance(b).max(a.distance(c)))) {
                    found.push(Convex::of_triangle([a, b, c]));
                }
            }
        }
        found
    }

    /// Of a body's centre of mass.
    pub fn of_body(world: &World, vehicle: Entity) -> Option<DVec3> {
        world.get_resource::<Physics>()?.velocity(*world.get::<VehicleNumber>(vehicle)?)
    }
}

#[cfg(not(feature = "physics"))]
mod with_physics {
    use super::*;

    pub fn obstacles(_: &World) -> Vec<Entity> {
        Vec::new()
    }

    pub fn solid_or_obstacle(world: &World, entity: Entity, _: impl Fn((DVec3, f64)) -> bool) -> Vec<Convex> {
        solid(world, entity)
    }

    pub fn of_body(_: &World, _: Entity) -> Option<DVec3> {
        None
    }
}

use with_physics::{obstacles, of_body, solid_or_obstacle};

/// m/s in the world: of a body, or a vehicle along its forward; of anything else 0.
fn velocity(world: &World, entity: Entity) -> DVec3 {
    of_body(world, entity).unwrap_or_else(|| {
        let rotation: DQuat = motion::pose(world, entity).rotation;
        world.get::<Motion>(entity).map_or(DVec3::ZERO, |motion| rotation * DVec3::Z * motion.speed)
    })
}
