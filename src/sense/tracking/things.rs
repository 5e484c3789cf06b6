//! The things that boxes are given of: their drawn parts together, in the axes of the thing and in the world's.

use super::drawn_parts::{DrawnParts, Part};
use super::outer_vertices::outer_vertices;
use crate::renderer::SlotSet;
use crate::sense::captures::pose::Pose;
use crate::sense::motion::place::Place;
use glam::{DAffine3, DVec3};
use std::collections::BTreeMap;
use std::sync::Arc;
use systems::assets::{Library, MeshId};
use systems::ecs::parallel::map_in_parallel;

/// Vertices of convex hulls of meshes, kept as long as these are the same.
#[derive(Default)]
pub(super) struct OuterVertices {
    /// With how often the mesh had been replaced.
    meshes: BTreeMap<MeshId, (u32, Arc<Vec<DVec3>>)>,
}

impl OuterVertices {
    /// Forgets what has changed, and finds those of meshes that are new.
    fn update(&mut self, library: &Library, needed: impl Iterator<Item = MeshId>) {
        self.meshes.retain(|&id, (edits, _)| library.mesh_edits(id) == Some(*edits));
        let mut missing: Vec<MeshId> = needed.filter(|id| !self.meshes.contains_key(id)).collect();
        missing.sort_unstable();
        missing.dedup();
        let made = map_in_parallel(missing.into_iter(), |id| {
            let (entry, edits) = (library.mesh(id)?, library.mesh_edits(id)?);
            let corners = entry.mesh.indices.iter().filter_map(|&i| entry.mesh.positions.get(i as usize).copied());
            Some((id, (edits, Arc::new(outer_vertices(corners)))))
        });
        self.meshes.extend(made.into_iter().flatten());
    }
}

/// A thing in the world.
pub(super) struct Thing {
    /// Its number: `instance`.
    pub number: u32,
    /// Semantic class.
    pub class: u8,
    /// Slots that it is drawn from.
    pub slots: SlotSet,
    /// Place of its own axes, in the scene's coordinates.
    pub place: Place,
    /// Corners of its box in its own axes, metres.
    pub low: DVec3,
    pub high: DVec3,
    /// Those of its parts' convex hulls, and more; the scene's coordinates.
    pub vertices: Vec<DVec3>,
}

impl Thing {
    fn new(number: u32, parts: &[&Part], place: Place, meshes: &OuterVertices) -> Option<Self> {
        let mut slots = SlotSet::default();
        parts.iter().for_each(|part| slots.insert(part.slot));
        let Pose { translation, rotation } = place.pose;
        let thing_from_world = DAffine3::from_rotation_translation(rotation, translation).inverse();
        let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
        let mut vertices = Vec::new();
        for part in parts {
            let Some((_, own)) = meshes.meshes.get(&part.mesh) else { continue };
            for vertex in own.iter() {
                let vertex = part.world_from_object.transform_point3(*vertex);
                let inner = thing_from_world.transform_point3(vertex);
                (low, high) = (low.min(inner), high.max(inner));
                vertices.push(vertex);
            }
        }
        let class = parts.first()?.labels.class;
        let is_there = low.cmple(high).all() && low.is_finite() && high.is_finite();
        is_there.then_some(Self { number, class, slots, place, low, high, vertices })
    }

    /// The middle of its box, the scene's coordinates.
    pub fn center(&self) -> DVec3 {
        self.place.pose.translation + self.place.pose.rotation * self.middle()
    }

    /// The same, in its own axes.
    pub fn middle(&self) -> DVec3 {
        (self.low + self.high) / 2.0
    }

    /// No part of it is further from its middle.
    pub fn radius(&self) -> f64 {
        self.low.distance(self.high) / 2.0
    }
}

/// All things of which something is drawn, in the order of their numbers.
pub(super) fn things(drawn: &DrawnParts, library: &Library, meshes: &mut OuterVertices) -> Vec<Thing> {
    let mut parts: BTreeMap<u32, Vec<&Part>> = BTreeMap::new();
    for part in drawn.parts.iter().filter(|part| part.labels.thing.is_some()) {
        parts.entry(part.labels.instance).or_default().push(part);
    }
    meshes.update(library, parts.values().flatten().map(|part| part.mesh));
    let parts: Vec<_> = parts.into_iter().collect();
    let made = map_in_parallel(parts.iter(), |(number, parts)| {
        Thing::new(*number, parts, *drawn.places.things.get(number)?, meshes)
    });
    made.into_iter().flatten().collect()
}
