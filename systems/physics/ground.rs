//! Colliders that do not move in the physics world: the ground, and obstacles.
//!
//! Colliders are known by what they are (mesh, shape and place) and not by their entities: their order, and with it
//! every step, does not depend on the order of spawning, and a world restored from a snapshot, whose entities are
//! others, finds its colliders as they were. A mesh is known by its id and by how often it was replaced.

use super::bodies::Physics;
use crate::assets::library::Library;
use crate::assets::mesh::{Mesh, MeshId};
use crate::assets::slots::SlotId;
use crate::draw::pieces::{PieceOf, WholeMesh};
use crate::space::transform::Transform;
use crate::vehicles::ground::Ground;
use crate::vehicles::routes::mixed;
use bevy_ecs::prelude::*;
use glam::{Affine3A, DVec3, Vec3};
use rapier3d_f64::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The entity stands in the way of physical vehicles.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub enum Obstacle {
    /// By the boxes around its mesh and those below it.
    #[default]
    Box,
    /// By every triangle of these: for what is hollow, or not like a box.
    Mesh,
}

/// Identity of a collider: its mesh, its shape and twice the number of the mesh's edits, and the bits of
/// `world_from_object`.
pub(super) type Key = [u32; 14];

/// The key of the plane at y = 0.
const PLANE: Key = [u32::MAX; 14];

/// In place of the number of edits of a mesh that is not there.
const NO_MESH: u32 = u32::MAX >> 1;

/// Depth below everything to which a vehicle falls before it is given up, metres.
const FALL: f32 = 100.0;

/// The colliders that do not move.
#[derive(Serialize, Deserialize, Default)]
pub(super) struct Colliders {
    /// `None` for what cannot be one: an empty mesh, or one with infinite places.
    known: BTreeMap<Key, Option<ColliderHandle>>,
    /// A sum over all keys: the same sum, the same colliders.
    sum: Option<u64>,
    /// Metres: what is below is thrown out of the world.
    pub lowest: f32,
    /// State of the last look: numbers of grounds and obstacles, the revision of the library's meshes, and all entities
    /// that their places and meshes come from.
    #[serde(skip)]
    watched: Option<((usize, u64), Vec<Source>)>,
}

/// An entity, and which of the components it had that colliders come from.
type Source = (Entity, [bool; 5]);

type Statics<'w, 's> =
    Query<'w, 's, (Entity, Has<Ground>, Option<&'static Obstacle>), Or<(With<Ground>, With<Obstacle>)>>;
type Meshes<'w, 's> = Query<'w, 's, (Option<&'static MeshId>, Option<&'static WholeMesh>), Without<PieceOf>>;

type News<'w, 's> = Query<'w, 's, (), Or<(Added<Ground>, Changed<Obstacle>)>>;
type Watched<'w, 's> = Query<
    'w,
    's,
    (
        Option<Ref<'static, Transform>>,
        Option<Ref<'static, ChildOf>>,
        Option<Ref<'static, Children>>,
        Option<Ref<'static, MeshId>>,
        Option<Ref<'static, WholeMesh>>,
    ),
>;

/// Tells if nothing that colliders come from has changed since they were last looked at.
fn is_as_before(
    watched: Option<&((usize, u64), Vec<Source>)>,
    now: (usize, u64),
    news: &News,
    entities: &Watched,
) -> bool {
    let is_same = |(entity, had): &Source| look(entities, *entity).is_some_and(|(has, new)| has == *had && !new);
    watched.is_some_and(|(before, list)| *before == now && news.is_empty() && list.iter().all(is_same))
}

/// Presence of each of the components in an entity, and whether one of them changed.
fn look(entities: &Watched, entity: Entity) -> Option<([bool; 5], bool)> {
    let (place, parent, children, mesh, whole) = entities.get(entity).ok()?;
    let has = [place.is_some(), parent.is_some(), children.is_some(), mesh.is_some(), whole.is_some()];
    let is_new = place.is_some_and(|c| c.is_changed())
        || parent.is_some_and(|c| c.is_changed())
        || children.is_some_and(|c| c.is_changed())
        || mesh.is_some_and(|c| c.is_changed())
        || whole.is_some_and(|c| c.is_changed());
    Some((has, is_new))
}

/// Brings the colliders of ground and obstacles up to date with the world.
#[allow(clippy::too_many_arguments)]
pub fn update_ground(
    mut physics: ResMut<Physics>,
    library: Res<Library>,
    statics: Statics,
    news: News,
    entities: Watched,
    children: Query<&Children>,
    meshes: Meshes,
    places: Query<(&Transform, Option<&ChildOf>)>,
) {
    let (children, meshes, places, library) = (&children, &meshes, &places, &*library);
    let now = (statics.iter().count(), library.revisions().meshes);
    if is_as_before(physics.colliders.watched.as_ref(), now, &news, &entities) {
        return;
    }
    let mut list: Vec<Entity> = Vec::new();
    for (root, ..) in &statics {
        let below = children.iter_descendants(root).filter(|&entity| meshes.contains(entity));
        list.extend(std::iter::once(root).chain(below));
        let above = |entity: Entity| places.get(entity).ok().and_then(|(_, parent)| parent.map(ChildOf::parent));
        list.extend(std::iter::successors(above(root), |&entity| above(entity)));
    }
    let seen = |entity| look(&entities, entity).map(|(has, _)| (entity, has));
    physics.colliders.watched = Some((now, list.into_iter().filter_map(seen).collect()));
    let keys = || {
        statics.iter().flat_map(|(root, ground, obstacle)| {
            let parts = std::iter::once(root).chain(children.iter_descendants(root));
            let shapes = [ground.then_some(Obstacle::Mesh), obstacle.copied()];
            parts.flat_map(move |entity| {
                let (mesh, whole) = meshes.get(entity).unwrap_or_default();
                let mesh = whole.map(|whole| whole.mesh).or(mesh.copied());
                let place = mesh.map(|_| world_from(entity, places)).unwrap_or_default();
                shapes.into_iter().flatten().filter_map(move |shape| Some(key(mesh?, library, shape, &place)))
            })
        })
    };
    let plane = statics.iter().all(|(_, ground, _)| !ground);
    let sum = keys().fold(u64::from(plane), |sum, key| sum.wrapping_add(number_of(&key)));
    if physics.colliders.sum == Some(sum) {
        return;
    }
    let mut wanted: Vec<Key> = keys().chain(plane.then_some(PLANE)).collect();
    wanted.sort_unstable();
    wanted.dedup();
    let physics = &mut *physics;
    physics.colliders.sum = Some(sum);
    let gone: Vec<Key> =
        physics.colliders.known.keys().filter(|key| wanted.binary_search(key).is_err()).copied().collect();
    for key in gone {
        if let Some(handle) = physics.colliders.known.remove(&key).flatten() {
            physics.world.remove_collider(handle);
        }
    }
    for key in wanted {
        if !physics.colliders.known.contains_key(&key) {
            let collider = collider(&key, library);
            // Removing a mesh that is in use is allowed.
            if collider.is_none() && library.mesh(MeshId::from_bits(key[0])).is_some() {
                physics.warnings.push(format!(
                    "mesh {} cannot be ground or an obstacle: it has no finite triangles",
                    MeshId::from_bits(key[0]).slot()
                ));
            }
            let handle = collider.map(|collider| physics.world.insert_collider(collider, None));
            physics.colliders.known.insert(key, handle);
            physics.inserted = true;
        }
    }
    let bottoms = physics.world.colliders.iter().filter(|(_, collider)| collider.parent().is_none());
    let bottoms =
        bottoms.map(|(_, collider)| if plane_of(collider) { 0.0 } else { collider.compute_aabb().mins.y as f32 });
    physics.colliders.lowest = bottoms.fold(0.0, f32::min) - FALL;
}

fn plane_of(collider: &Collider) -> bool {
    collider.shape().as_halfspace().is_some()
}

/// `world_from_object`, from the transforms as they are in this step.
fn world_from(entity: Entity, places: &Query<(&Transform, Option<&ChildOf>)>) -> Affine3A {
    let mut place = Affine3A::IDENTITY;
    let mut next = Some(entity);
    while let Some((transform, parent)) = next.and_then(|entity| places.get(entity).ok()) {
        place = transform.compute_affine() * place;
        next = parent.map(ChildOf::parent);
    }
    place
}

fn key(mesh: MeshId, library: &Library, shape: Obstacle, world_from_object: &Affine3A) -> Key {
    let mut key = [0; 14];
    key[0] = mesh.to_bits();
    key[1] = shape as u32 + 2 * library.mesh_edits(mesh).unwrap_or(NO_MESH);
    // Zero has two signs, which are one place.
    let bits = world_from_object.to_cols_array().map(|value| (value + 0.0).to_bits());
    key[2..].copy_from_slice(&bits);
    key
}

/// A number for a key.
fn number_of(key: &Key) -> u64 {
    key.iter().fold(0, |number, &value| mixed(number ^ u64::from(value)))
}

/// The collider that a key names.
fn collider(key: &Key, library: &Library) -> Option<ColliderBuilder> {
    if *key == PLANE {
        return Some(ColliderBuilder::new(SharedShape::halfspace(DVec3::Y)));
    }
    let mut columns = [0.0; 12];
    columns.iter_mut().zip(&key[2..]).for_each(|(value, bits)| *value = f32::from_bits(*bits));
    let world_from_object = Affine3A::from_cols_array(&columns);
    let mesh = &library.mesh(MeshId::from_bits(key[0]))?.mesh;
    let finite = world_from_object.is_finite() && mesh.positions.iter().all(|position| position.is_finite());
    if !finite || mesh.indices.len() < 3 {
        return None;
    }
    if key[1] % 2 == Obstacle::Mesh as u32 {
        triangles(mesh, &world_from_object)
    } else {
        bounding_box(mesh, &world_from_object)
    }
}

fn triangles(mesh: &Mesh, world_from_object: &Affine3A) -> Option<ColliderBuilder> {
    let corners: Vec<DVec3> =
        mesh.positions.iter().map(|p| world_from_object.transform_point3(*p).as_dvec3()).collect();
    let triangles: Vec<[u32; 3]> = mesh.indices.as_chunks().0.to_vec();
    let within = triangles.iter().flatten().all(|&corner| (corner as usize) < corners.len());
    if within { ColliderBuilder::trimesh(corners, triangles).ok() } else { None }
}

fn bounding_box(mesh: &Mesh, world_from_object: &Affine3A) -> Option<ColliderBuilder> {
    let (scale, rotation, _) = world_from_object.to_scale_rotation_translation();
    let aabb = mesh.aabb();
    let half = ((aabb.max - aabb.min) / 2.0 * scale.abs()).max(Vec3::splat(0.001));
    let middle = world_from_object.transform_point3(aabb.center()).as_dvec3();
    let (place, is_finite) = (Pose::from_parts(middle, rotation.as_dquat().normalize()), rotation.is_finite());
    let half = half.as_dvec3();
    (half.is_finite() && is_finite).then(|| ColliderBuilder::cuboid(half.x, half.y, half.z).position(place))
}
