//! An entity of a scene, with all that is on it and below it.

use super::below::{cameras_below, descendants};
use super::placement::Placement;
use super::spawner::Spawner;
use super::{physical, vehicles};
use crate::import::Model;
use crate::scene::format::entities::{Entity as Source, camera};
use crate::scene::format::sensors::Mounted;
use crate::scene::read::items::Shape;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Vec3};
use systems::assets::{Library, MaterialId, MeshId, MeshVariants};
use systems::lights::{Light, NoShadow};
use systems::sensors::{Classes, Instance};
use systems::space::{Aabb, Hidden, Spin, Transform};

impl Spawner<'_> {
    /// Spawns an entity and what is below it.
    pub fn entity(&mut self, source: &Source, placement: &Placement, parent: Option<Entity>) -> Entity {
        let at = placement.parent_from_entity;
        let world_from_entity = placement.world_from_parent * at.compute_affine();
        let material = self.items.material(placement.material);
        let entity = match placement.mesh.and_then(|mesh| self.items.shape(mesh)) {
            Some(Shape::Mesh(mesh, aabb)) => {
                self.enclose(aabb.transformed(&world_from_entity));
                let drawn = (at, *mesh, material.unwrap_or_default());
                // Named at once: an entity that gets a component later is moved, which for 100,000 copies is noticed.
                match &placement.name {
                    Some(name) => self.world.spawn((drawn, Name::new(name.clone()))).id(),
                    None => self.world.spawn(drawn).id(),
                }
            }
            Some(Shape::Model(model, bounds, no_shadow)) => {
                if *bounds != Aabb::default() {
                    self.enclose(bounds.transformed(&world_from_entity));
                }
                self.model(model, at, material, no_shadow)
            }
            None => self.world.spawn(at).id(),
        };
        if let Some(parent) = parent {
            self.world.entity_mut(entity).insert(ChildOf(parent));
        }
        if let Some(name) = &placement.name
            && self.world.get::<Name>(entity).map(Name::as_str) != Some(name)
        {
            self.world.entity_mut(entity).insert(Name::new(name.clone()));
        }
        if let Some(source) = placement.light {
            self.found.has_lights = true;
            self.world.entity_mut(entity).insert(Light::from(source));
        }
        if let Some(spin) = &source.spin {
            self.world.entity_mut(entity).insert(Spin {
                axis: Vec3::from_array(spin.axis).normalize(),
                rate: spin.degrees_per_second.to_radians(),
                start: at.rotation,
            });
        }
        if let Some(name) = placement.vehicle {
            self.vehicle(name, source.vehicle.as_ref(), placement.on_route, entity, &world_from_entity);
        }
        if source.ground {
            vehicles::make_ground(&mut self.world.entity_mut(entity));
        }
        if let Some(obstacle) = source.obstacle {
            physical::make_obstacle(&mut self.world.entity_mut(entity), obstacle);
        }
        if let Some(head) = &source.signal_head {
            self.signal_head(head, entity);
        }
        if source.hidden {
            self.world.entity_mut(entity).insert(Hidden);
        }
        if let Some(source) = &source.camera {
            let name = placement.name.clone().unwrap_or_else(|| format!("camera {}", self.found.cameras.len() + 1));
            self.world.entity_mut(entity).insert((camera(source), Name::new(name.clone())));
            self.found.cameras.push((name, entity));
        }
        if let Some(Mounted(sensor)) = &source.sensor {
            self.world.entity_mut(entity).insert(sensor.clone().resolved());
        }
        if let Some(class) = source.class.as_ref().and_then(|name| self.world.resource::<Classes>().find(name)) {
            self.world.entity_mut(entity).insert(class);
        }
        // What a model consists of is one thing, unless it is a part of another; so is what sensors are mounted on.
        let is_model = matches!(placement.mesh.and_then(|mesh| self.items.shape(mesh)), Some(Shape::Model(..)));
        if source.instance.unwrap_or(is_model && parent.is_none() || source.rig.is_some()) {
            self.world.entity_mut(entity).insert(Instance);
        }
        self.note_large(source, placement, entity, &world_from_entity);
        self.figure(source, material, entity, &world_from_entity);
        if let Some(lights) = source.lights {
            let drawn = std::iter::once(entity).chain(descendants(self.world, entity));
            drawn.for_each(|part| _ = self.world.entity_mut(part).insert(lights.policy()));
        }
        if !source.casts_shadows.0 {
            let drawn = std::iter::once(entity).chain(descendants(self.world, entity));
            drawn.for_each(|part| _ = self.world.entity_mut(part).insert(NoShadow));
        }
        // Before there are children, whose nodes may have the same names.
        let nodes: Vec<_> = source.attach.iter().map(|item| self.node(entity, item.node.as_deref())).collect();
        source.custom.insert(self.world, entity);
        for child in source.children.iter().chain(self.rigs.of(source)) {
            let placement = Placement { world_from_parent: world_from_entity, ..Placement::of(child) };
            self.entity(child, &placement, Some(entity));
        }
        for (item, node) in source.attach.iter().zip(nodes) {
            // The check has seen to it that the node is there.
            let Some((node, root_from_node)) = node else { continue };
            let world_from_parent = world_from_entity * root_from_node;
            self.entity(item, &Placement { world_from_parent, ..Placement::of(item) }, Some(node));
        }
        entity
    }

    fn model(
        &mut self,
        model: &Model,
        at: Transform,
        material: Option<MaterialId>,
        no_shadow: &[MaterialId],
    ) -> Entity {
        let root = model.spawn(self.world, at);
        if !no_shadow.is_empty() {
            for entity in descendants(self.world, root) {
                if self.world.get::<MaterialId>(entity).is_some_and(|own| no_shadow.contains(own)) {
                    self.world.entity_mut(entity).insert(NoShadow);
                }
            }
        }
        self.found.has_lights |= model.has_lights();
        self.model_cameras.extend(cameras_below(self.world, root));
        if let Some(material) = material {
            for entity in descendants(self.world, root) {
                let Some(&mesh) = self.world.get::<MeshId>(entity) else { continue };
                let mesh = self.turned.mesh_for(&mut self.world.resource_mut(), mesh, material);
                self.world.entity_mut(entity).insert((mesh, material));
            }
        }
        root
    }

    fn figure(&mut self, source: &Source, material: Option<MaterialId>, entity: Entity, world_from_entity: &Affine3A) {
        let meshes: Vec<_> = source.figure.iter().filter_map(|name| self.items.single_mesh(name)).collect();
        let Some(&(_, own_material)) = meshes.first() else { return };
        let mesh_for = |(mesh, _)| match material {
            Some(material) => self.turned.mesh_for(&mut self.world.resource_mut(), mesh, material),
            None => mesh,
        };
        let meshes: Vec<MeshId> = meshes.into_iter().map(mesh_for).collect();
        for &mesh in &meshes {
            let aabb = self.world.resource::<Library>().mesh(mesh).map(|entry| entry.mesh.aabb());
            aabb.into_iter().for_each(|aabb| self.enclose(aabb.transformed(world_from_entity)));
        }
        let figure = MeshVariants { meshes, shown: 0 };
        self.world.entity_mut(entity).insert((figure.meshes[0], material.unwrap_or(own_material), figure));
    }

    /// The entity of a model's node below the model's root, and its `root_from_node`.
    fn node(&self, root: Entity, name: Option<&str>) -> Option<(Entity, Affine3A)> {
        let named = |&entity: &Entity| self.world.get::<Name>(entity).map(Name::as_str) == name;
        let node = descendants(self.world, root).into_iter().find(named)?;
        let (mut root_from_node, mut at) = (Affine3A::IDENTITY, node);
        while at != root {
            root_from_node = self.world.get::<Transform>(at)?.compute_affine() * root_from_node;
            at = self.world.get::<ChildOf>(at)?.parent();
        }
        Some((node, root_from_node))
    }
}
