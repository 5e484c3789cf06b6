//! Objects that lack what they are drawn with: a mesh that the library does not have; a material or a place, which was
//! taken from them.
//!
//! All are noted where they are met, and looked at in the next frame, so that nothing searches for them. Objects whose
//! mesh is another now, or gone, are searched for: all are looked through in a frame after such an edit.

use super::pieces::WholeMesh;
use crate::assets::library::Library;
use crate::assets::material::MaterialId;
use crate::assets::mesh::MeshId;
use crate::space::hidden::AlsoDisabled;
use crate::space::transform::GlobalTransform;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use std::collections::BTreeSet;

/// Objects that wait for a mesh, a material or a place.
#[derive(Resource, Debug, Default)]
pub struct Incomplete {
    /// Their mesh was not in the library.
    meshless: BTreeSet<Entity>,
    /// The revision of the library's meshes that was seen last.
    meshes: u64,
    /// Lost their material, some of them with their life.
    without_material: Vec<Entity>,
    /// Lost their `GlobalTransform`, most of them with their life.
    placeless: Vec<Entity>,
}

impl Incomplete {
    /// Takes note of objects whose mesh is not among those of the library.
    pub(crate) fn wait_for_meshes(&mut self, objects: &mut Vec<Entity>) {
        self.meshless.extend(objects.drain(..));
    }
}

/// Notes what lost its material.
pub(crate) fn lose_material(mut world: DeferredWorld, context: HookContext) {
    if let Some(mut incomplete) = world.get_resource_mut::<Incomplete>() {
        incomplete.without_material.push(context.entity);
    }
}

/// Notes what lost its place.
pub(crate) fn lose_place(mut world: DeferredWorld, context: HookContext) {
    if let Some(mut incomplete) = world.get_resource_mut::<Incomplete>() {
        incomplete.placeless.push(context.entity);
    }
}

/// Gives the default material to objects that lost theirs, and lets those look changed whose mesh or place has come, or
/// whose mesh was replaced or removed.
#[allow(clippy::type_complexity)]
pub fn complete(
    mut incomplete: ResMut<Incomplete>,
    library: Res<Library>,
    bare: Query<(), (Or<(With<MeshId>, With<WholeMesh>)>, Without<MaterialId>, AlsoDisabled)>,
    placed: Query<Has<GlobalTransform>, AlsoDisabled>,
    mut meshes: Query<&mut MeshId>,
    mut commands: Commands,
) {
    let incomplete = incomplete.bypass_change_detection();
    for object in incomplete.without_material.drain(..).filter(|&object| bare.contains(object)) {
        commands.entity(object).insert(MaterialId::DEFAULT);
    }
    let mut found: Vec<Entity> = Vec::new();
    let seen = std::mem::replace(&mut incomplete.meshes, library.revisions().meshes);
    if library.revisions().meshes > seen {
        found.extend(std::mem::take(&mut incomplete.meshless));
    }
    if library.meshes_edited() > seen {
        let changed: BTreeSet<u32> = library.changed_meshes(seen).collect();
        meshes.iter_mut().filter(|mesh| changed.contains(&mesh.slot())).for_each(|mut mesh| mesh.set_changed());
    }
    incomplete.placeless.retain(|&object| match placed.get(object) {
        Ok(false) => true,
        Ok(true) => {
            found.push(object);
            false
        }
        Err(_) => false,
    });
    for object in found {
        if let Ok(mut mesh) = meshes.get_mut(object) {
            mesh.set_changed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::material::Material;
    use crate::assets::shapes;
    use crate::lights::components::Light;
    use crate::lights::selected::SelectedLights;
    use crate::simulation::Simulation;
    use crate::space::transform::Transform;
    use glam::{Vec3, Vec4};

    #[test]
    fn a_mesh_that_comes_after_its_object_is_drawn() {
        let mut simulation = Simulation::new();
        let next = simulation.library().meshes().count() as u32;
        let [next, later] = [next, next + 1].map(MeshId::from_slot);
        let object = simulation.world.spawn(next).id();
        let gone = simulation.world.spawn(later).id();
        simulation.frame();
        simulation.world.get_mut::<Transform>(object).expect("a place").translation.x = 1.0;
        simulation.world.spawn((Light::point(1.0, 5.0), Transform::from_xyz(1.0, 2.0, 0.0)));
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 0);
        assert_eq!(simulation.world.resource::<Incomplete>().meshless.len(), 2, "each once");
        simulation.world.despawn(gone);
        simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 1);
        let lights =
            simulation.world.get::<SelectedLights>(object).expect("an object").unpack(simulation.world.resource());
        assert_eq!((lights.reaching, lights.lights[0]), (1, 0), "it chooses its lights");
    }

    #[test]
    fn an_object_without_its_material_has_the_default() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let cube = library.add_mesh(shapes::cube(Vec3::ONE));
        let red = library.add_material(Material { base_factor: Vec4::X, ..Material::default() });
        let object = simulation.world.spawn((cube, red)).id();
        let other = simulation.world.spawn((cube, red)).id();
        simulation.frame();
        simulation.world.entity_mut(object).remove::<MaterialId>().insert(Transform::from_xyz(3.0, 0.0, 0.0));
        simulation.world.despawn(other);
        simulation.frame();
        let drawn: Vec<_> = simulation.instance_records().drawn().collect();
        assert_eq!(drawn.len(), 1);
        assert_eq!((drawn[0].material, drawn[0].world_from_object[0][3]), (MaterialId::DEFAULT.slot(), 3.0));
        // What has no place is not drawn.
        for place in [Transform::from_xyz(4.0, 0.0, 0.0), Transform::from_xyz(5.0, 0.0, 0.0)] {
            simulation.world.entity_mut(object).remove::<(Transform, GlobalTransform)>();
            simulation.frame();
            simulation.frame();
            assert_eq!(simulation.draw_list().objects, 0);
            simulation.world.entity_mut(object).insert(place);
            simulation.frame();
            assert_eq!(simulation.draw_list().objects, 1);
            simulation.world.entity_mut(object).remove::<GlobalTransform>();
            simulation.frame();
            simulation.world.entity_mut(object).insert(GlobalTransform::IDENTITY);
            simulation.frame();
            assert_eq!(simulation.draw_list().objects, 1);
        }
    }
}
