//! Copies of a model's meshes for materials that place their bumps by the other UV set.
//!
//! Tangents are the directions of an image on a surface, and a mesh has one set of them. A model's follow the normal
//! map of its own material; a material of the scene may be placed by the other set, in which the image lies otherwise.

use std::collections::HashMap;
use systems::assets::{Library, Material, MaterialId, Mesh, MeshId};

/// The copies made so far, by mesh and UV set.
#[derive(Debug, Default)]
pub struct TurnedMeshes(HashMap<(MeshId, usize), MeshId>);

impl TurnedMeshes {
    /// A mesh whose tangents follow the UV set that a material's bumps are placed by: the mesh itself, or a copy.
    pub fn mesh_for(&mut self, library: &mut Library, mesh: MeshId, material: MaterialId) -> MeshId {
        let set = library.material(material).and_then(Material::bump_uv_set);
        let own = library.mesh(mesh).map(|entry| &entry.mesh);
        let Some((own, set)) = own.zip(set) else { return mesh };
        if own.tangent_uv_set == set || own.uvs[1].is_empty() {
            return mesh;
        }
        if let Some(&copy) = self.0.get(&(mesh, set)) {
            return copy;
        }
        let copy = Mesh { tangent_uv_set: set, tangents: Vec::new(), ..own.clone() };
        let copy = library.add_mesh(copy);
        self.0.insert((mesh, set), copy);
        copy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{UVec2, Vec2, Vec3};
    use systems::Simulation;
    use systems::assets::{ImageId, Map, shapes};

    #[test]
    fn a_material_of_the_other_uv_set_gets_a_mesh_of_its_own() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let plain = shapes::plane(Vec2::ONE, UVec2::ONE);
        // The second set lies a quarter turn beside the first.
        let turned = plain.uvs[0].iter().map(|uv| Vec2::new(-uv.y, uv.x)).collect();
        let both = Mesh { uvs: [plain.uvs[0].clone(), turned], tangents: Vec::new(), ..plain.clone() };
        let (plain, both) = (library.add_mesh(plain), library.add_mesh(both));
        let map = |uv_set| Some(Map { uv_set, ..Map::new(ImageId::FLAT_NORMAL) });
        let [first, second, none] = [
            Material { normal_map: map(0), height_map: map(1), ..Material::default() },
            Material { height_map: map(1), ..Material::default() },
            Material { base_map: map(1), ..Material::default() },
        ]
        .map(|material| library.add_material(material));
        let mut meshes = TurnedMeshes::default();
        let mut mesh_for = |mesh, material| meshes.mesh_for(&mut library, mesh, material);
        assert_eq!((mesh_for(both, first), mesh_for(both, none), mesh_for(plain, second)), (both, both, plain));
        let copy = mesh_for(both, second);
        assert!(copy != both && copy == mesh_for(both, second));
        simulation.frame();
        let tangents = |mesh| {
            let entry = simulation.library().mesh(mesh).expect("a mesh");
            entry.mesh.tangents.iter().map(|tangent| tangent.truncate()).collect::<Vec<_>>()
        };
        assert!(tangents(both).iter().all(|tangent| tangent.abs_diff_eq(Vec3::X, 1e-5)), "{:?}", tangents(both));
        assert!(tangents(copy).iter().all(|tangent| tangent.x.abs() < 1e-5), "{:?}", tangents(copy));
    }
}
