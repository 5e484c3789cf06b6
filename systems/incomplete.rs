//! Objects that lack what they are drawn with: a mesh that the library does not have yet, or a material, which somebody took
//! from them.
//!
//! Both are noted where they are met, and looked at in the next frame, so that nobody searches for them.

use crate::hidden::AlsoDisabled;
use crate::library::{Library, MaterialId, MeshId};
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;

/// Who waits for what.
#[derive(Resource, Debug, Default)]
pub struct Incomplete {
    /// Their mesh was not in the library.
    meshless: Vec<Entity>,
    /// Meshes that the library had by then.
    meshes: usize,
    /// Lost their material, some of them with their life.
    without_material: Vec<Entity>,
}

impl Incomplete {
    /// Takes note of objects whose mesh is not among those of the library.
    pub(crate) fn wait_for_meshes(&mut self, objects: &mut Vec<Entity>, library: &Library) {
        if !objects.is_empty() {
            self.meshless.append(objects);
            self.meshes = library.meshes().len();
        }
    }
}

/// Notes who lost its material.
pub(crate) fn lose_material(mut world: DeferredWorld, context: HookContext) {
    if let Some(mut incomplete) = world.get_resource_mut::<Incomplete>() {
        incomplete.without_material.push(context.entity);
    }
}

/// Gives the default material to objects that lost theirs, and lets those whose mesh has come look changed.
pub fn complete(
    mut incomplete: ResMut<Incomplete>,
    library: Res<Library>,
    bare: Query<(), (With<MeshId>, Without<MaterialId>, AlsoDisabled)>,
    mut meshes: Query<&mut MeshId>,
    mut commands: Commands,
) {
    let incomplete = incomplete.bypass_change_detection();
    for object in incomplete.without_material.drain(..).filter(|&object| bare.contains(object)) {
        commands.entity(object).insert(MaterialId::DEFAULT);
    }
    if library.meshes().len() > incomplete.meshes {
        for object in incomplete.meshless.drain(..) {
            if let Ok(mut mesh) = meshes.get_mut(object) {
                mesh.set_changed();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use crate::bounds::WorldBounds;
    use crate::library::Material;
    use crate::shapes;
    use bevy_transform::components::{GlobalTransform, Transform};
    use glam::{Vec3, Vec4};

    #[test]
    fn a_mesh_that_comes_after_its_object_is_drawn() {
        let mut simulation = Simulation::new();
        let next = MeshId(simulation.library().meshes().len() as u32);
        let object = simulation.world.spawn(next).id();
        let gone = simulation.world.spawn(MeshId(next.0 + 1)).id();
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 0);
        simulation.world.despawn(gone);
        simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 1);
        assert!(simulation.world.get::<WorldBounds>(object).is_some_and(|bounds| bounds.0.radius > 0.5));
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
        assert_eq!((drawn[0].material, drawn[0].world_from_object[0][3]), (MaterialId::DEFAULT.0, 3.0));
        // What has no place is not drawn.
        simulation.world.entity_mut(object).remove::<(Transform, GlobalTransform)>();
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 0);
        simulation.world.entity_mut(object).insert(Transform::from_xyz(4.0, 0.0, 0.0));
        simulation.frame();
        assert_eq!(simulation.draw_list().objects, 1);
    }
}
