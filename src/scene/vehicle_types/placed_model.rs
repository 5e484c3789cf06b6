//! Shapes that a model draws at its nodes, in the space of the vehicle that it becomes.

use crate::import::Model;
use glam::{Affine3A, Vec3};
use std::collections::HashMap;
use systems::assets::{Library, Mesh};
use systems::space::Aabb;

/// A model, and where it is.
pub struct PlacedModel<'a> {
    pub model: &'a Model,
    pub library: &'a Library,
    /// `model_from_node` of each node of the scene.
    pub placed: &'a HashMap<usize, Affine3A>,
    pub vehicle_from_model: Affine3A,
}

impl PlacedModel<'_> {
    /// The origin of a node, vehicle space.
    pub fn origin(&self, node: usize) -> Vec3 {
        let model_from_node = self.placed.get(&node).copied().unwrap_or_default();
        (self.vehicle_from_model * model_from_node).translation.into()
    }

    /// Calls back for what is drawn at a node and below, but for another node and what is below that: with the mesh,
    /// and `vehicle_from_mesh`.
    fn for_each_drawn(&self, node: usize, but: Option<usize>, mut take: impl FnMut(&Mesh, &Affine3A)) {
        let mut open = vec![node];
        while let Some(index) = open.pop() {
            if Some(index) == but {
                continue;
            }
            let node = &self.model.nodes[index];
            open.extend(&node.children);
            let Some(model_from_node) = self.placed.get(&index) else { continue };
            for part_from in node.part_transforms() {
                let place = self.vehicle_from_model * *model_from_node * part_from.compute_affine();
                let meshes = node.parts.iter().filter_map(|&(mesh, _)| self.library.mesh(mesh));
                meshes.for_each(|entry| take(&entry.mesh, &place));
            }
        }
    }

    /// The vertices of the triangles drawn at a node and below, for each drawn part; vehicle space.
    pub fn vertices_below(&self, node: usize) -> Vec<Vec<Vec3>> {
        let mut parts = Vec::new();
        self.for_each_drawn(node, None, |mesh, place| {
            let mut is_used = vec![false; mesh.positions.len()];
            for &vertex in &mesh.indices {
                if let Some(used) = is_used.get_mut(vertex as usize) {
                    *used = true;
                }
            }
            let used = mesh.positions.iter().zip(is_used).filter(|(_, used)| *used);
            parts.push(used.map(|(&position, _)| place.transform_point3(position)).collect());
        });
        parts
    }

    /// The box around the vertices of what is drawn at a node and below, but for another node and what is below that;
    /// vehicle space.
    pub fn bounds_below(&self, node: usize, but: Option<usize>) -> Option<Aabb> {
        let mut bounds: Option<Aabb> = None;
        self.for_each_drawn(node, but, |mesh, place| {
            let points = mesh.positions.iter().map(|&position| place.transform_point3(position));
            let around = points.map(|p| Aabb { min: p, max: p }).reduce(Aabb::union);
            bounds = bounds.into_iter().chain(around).reduce(Aabb::union);
        });
        bounds
    }

    /// The same for all nodes.
    pub fn bounds_of_all(&self, but: Option<usize>) -> Aabb {
        let roots = self.model.roots.iter();
        roots.filter_map(|&root| self.bounds_below(root, but)).reduce(Aabb::union).unwrap_or_default()
    }
}
