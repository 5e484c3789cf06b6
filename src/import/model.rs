//! A model as its file describes it, and the entities it becomes.

use super::error::Warning;
use crate::name;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::Affine3A;
use systems::assets::{Library, MaterialId, MeshId};
use systems::draw::Camera;
use systems::lights::Light;
use systems::sensors::{Class, Classes, Instance};
use systems::space::{Aabb, Transform};

/// A model: a forest of nodes over items of a [`Library`].
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The file's name without its extension, or the scene's name.
    pub name: String,
    /// All nodes of the file.
    pub nodes: Vec<Node>,
    /// Indices of the default scene's root nodes.
    pub roots: Vec<usize>,
    /// The classes that its nodes, meshes and materials name.
    pub classes: Vec<NamedClass>,
    /// Warnings of things left out or corrected.
    pub warnings: Vec<Warning>,
}

/// A semantic class that a file names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedClass {
    /// `nodes[3].extras.class`
    pub place: String,
    /// The class.
    pub name: String,
}

/// Labels of a node for sensors, by the file's `extras`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeLabels {
    /// The class of what is here and below, by its name.
    pub class: Option<String>,
    /// It counts as one thing.
    pub is_instance: bool,
    /// Class of each part: that of its material, else that of its mesh.
    pub parts: Vec<Option<String>>,
}

/// One node of a [`Model`].
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Name in the file; `node 3` where it has none.
    pub name: String,
    /// `parent_from_node`.
    pub transform: Transform,
    /// Indices of its children.
    pub children: Vec<usize>,
    /// Meshes drawn here, with their materials.
    pub parts: Vec<(MeshId, MaterialId)>,
    /// The light here, along −Z.
    pub light: Option<Light>,
    /// The camera here, along −Z.
    pub camera: Option<Camera>,
    /// The parts are no objects but the walls of a cell, or a portal.
    pub room: Option<RoomRole>,
    /// Transforms of copies of `parts` relative to the node (EXT_mesh_gpu_instancing); empty: once, at the node itself.
    pub instances: Vec<Transform>,
    /// Labels for sensors.
    pub labels: NodeLabels,
}

/// Role of a node in place of an object, by its `extras`: `{"relief": {"cell": "hall"}}`, or
/// `{"relief": {"portal": ["hall", "kitchen"]}}`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RoomRole {
    /// Its meshes together are the cell of that name.
    Cell(String),
    /// Its meshes together are a portal: between cells of these names, or between those that are on either side of it.
    Portal(Option<[String; 2]>),
}

/// A node that is a cell or a portal, until the scene has been spawned.
#[derive(Component, Clone, Debug)]
pub(crate) struct RoomPart {
    pub role: RoomRole,
    pub meshes: Vec<MeshId>,
}

impl Model {
    /// Spawns the model under one root entity at `at` and returns that; every node becomes an entity with its name.
    pub fn spawn(&self, world: &mut World, at: Transform) -> Entity {
        let root = world.spawn((Name::new(self.name.clone()), at)).id();
        // A stack, not recursion: a file may nest its nodes as deep as it likes.
        let mut open: Vec<(usize, Entity)> = self.roots.iter().rev().map(|&node| (node, root)).collect();
        while let Some((index, parent)) = open.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            let entity = node.spawn(world, parent);
            open.extend(node.children.iter().rev().map(|&child| (child, entity)));
        }
        root
    }

    /// The nodes of the default scene, each once, parents first, with `model_from_node`.
    pub fn placed(&self) -> Vec<(usize, Affine3A)> {
        let mut open: Vec<(usize, Affine3A)> =
            self.roots.iter().rev().map(|&node| (node, Affine3A::IDENTITY)).collect();
        let mut placed = Vec::with_capacity(self.nodes.len());
        while let Some((index, model_from_parent)) = open.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            let model_from_node = model_from_parent * node.transform.compute_affine();
            open.extend(node.children.iter().rev().map(|&child| (child, model_from_node)));
            placed.push((index, model_from_node));
        }
        placed
    }

    /// Tells if the default scene brings light of its own.
    pub fn has_lights(&self) -> bool {
        self.placed().iter().any(|&(node, _)| self.nodes[node].light.is_some())
    }

    /// The default scene's cameras: name, camera, `model_from_camera`.
    pub fn cameras(&self) -> Vec<(&str, &Camera, Affine3A)> {
        let nodes = self.placed().into_iter();
        nodes
            .filter_map(|(i, place)| self.nodes[i].camera.as_ref().map(|c| (self.nodes[i].name.as_str(), c, place)))
            .collect()
    }

    /// Its classes that are not among these: where each is named, and what is to be said of it.
    pub fn unknown_classes<'a>(&'a self, classes: &'a Classes) -> impl Iterator<Item = (&'a str, String)> {
        let unknown = self.classes.iter().filter(|class| classes.find(&class.name).is_none());
        let known: Vec<&str> = classes.0.iter().map(|class| class.name.as_str()).collect();
        unknown.map(move |NamedClass { place, name }| {
            let hint = name::nearest(&known, name).map_or_else(String::new, |near| format!("; did you mean {near:?}?"));
            (place.as_str(), format!("unknown class {name:?}: it is ignored{hint}"))
        })
    }

    /// The box around everything that the default scene draws, model space; a point at the origin where that is
    /// nothing.
    pub fn bounds(&self, library: &Library) -> Aabb {
        let mut bounds: Option<Aabb> = None;
        for (index, model_from_node) in self.placed() {
            let node = &self.nodes[index];
            for part_from in node.part_transforms().iter().filter(|_| node.room.is_none()) {
                for &(mesh, _) in &node.parts {
                    let Some(entry) = library.mesh(mesh) else { continue };
                    let part = entry.mesh.aabb().transformed(&(model_from_node * part_from.compute_affine()));
                    bounds = Some(bounds.map_or(part, |b| b.union(part)));
                }
            }
        }
        bounds.unwrap_or_default()
    }
}

impl Node {
    /// Transforms of the parts, relative to the node.
    pub(crate) fn part_transforms(&self) -> &[Transform] {
        const ONCE: &[Transform] = &[Transform::IDENTITY];
        if self.instances.is_empty() { ONCE } else { &self.instances }
    }

    fn spawn(&self, world: &mut World, parent: Entity) -> Entity {
        let class_of = |name: &Option<String>| world.get_resource::<Classes>()?.find(name.as_ref()?);
        let class = class_of(&self.labels.class);
        let of_parts: Vec<Option<Class>> = self.labels.parts.iter().map(class_of).collect();
        let class_of = |part: usize| of_parts.get(part).copied().flatten();
        let mut entity = world.spawn((Name::new(self.name.clone()), self.transform, ChildOf(parent)));
        if let Some(light) = &self.light {
            entity.insert(light.clone());
        }
        if let Some(camera) = &self.camera {
            entity.insert(camera.clone());
        }
        if let Some(class) = class {
            entity.insert(class);
        }
        if self.labels.is_instance {
            entity.insert(Instance);
        }
        if let Some(role) = &self.room {
            let meshes = self.parts.iter().map(|(mesh, _)| *mesh).collect();
            return entity.insert(RoomPart { role: role.clone(), meshes }).id();
        }
        // The common case, one part at the node itself, needs no further entity; but a class of the part alone is not
        // that of what is below the node.
        let is_alone = self.children.is_empty() || class_of(0).is_none();
        if let ([part], true) = (self.parts.as_slice(), self.instances.is_empty() && is_alone) {
            entity.insert(*part);
            if let Some(class) = class_of(0) {
                entity.insert(class);
            }
            return entity.id();
        }
        let entity = entity.id();
        for (i, &at) in self.part_transforms().iter().enumerate() {
            for (p, &part) in self.parts.iter().enumerate() {
                let number = i * self.parts.len() + p;
                let name = Name::new(format!("{} part {number}", self.name));
                let mut spawned = world.spawn((name, at, ChildOf(entity), part));
                if let Some(class) = class_of(p) {
                    spawned.insert(class);
                }
            }
        }
        entity
    }
}
