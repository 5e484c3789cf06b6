//! Component hooks and required components of drawn objects and lights. They keep up tables that the components
//! themselves know nothing of.
//!
//! [`register`] adds all of them to a world. The components lie below the tables, so they cannot name them.

use super::pieces::{PieceOf, Pieces};
use super::{incomplete, instances};
use crate::assets::material::MaterialId;
use crate::assets::mesh::MeshId;
use crate::lights::components::{Light, NoShadow};
use crate::lights::policy::LightPolicy;
use crate::lights::selected::SelectedLights;
use crate::lights::table::LightSlot;
use crate::lights::{order, table};
use crate::space::hidden::InheritedHidden;
use crate::space::transform::{GlobalTransform, Transform};
use bevy_ecs::entity_disabling::Disabled;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;

/// Registers the hooks and the required components of everything that is drawn or shines.
///
/// [`install::core`](crate::install::core) does so, and [`Simulation::new`](crate::Simulation::new) by it. A world that
/// is run by these schedules is to be given to it before its first entity: without, an object has no [`SelectedLights`]
/// and a light no [`LightSlot`], so neither is drawn nor shines, and what goes stays in the tables.
///
/// # Panics
/// If an entity of the world has, or had, one of these components, or the world was registered before.
pub fn register(world: &mut World) {
    world.register_required_components::<MeshId, SelectedLights>();
    world.register_required_components::<Light, LightSlot>();
    world.register_component_hooks::<MeshId>().on_remove(lose_mesh);
    world.register_component_hooks::<LightPolicy>().on_insert(gain_policy).on_remove(lose_policy);
    world.register_component_hooks::<NoShadow>().on_add(gain_no_shadow).on_remove(lose_no_shadow);
    world.register_component_hooks::<PieceOf>().on_add(become_piece).on_remove(cease_piece);
    world.register_component_hooks::<MaterialId>().on_remove(incomplete::lose_material);
    world.register_component_hooks::<GlobalTransform>().on_remove(lose_place);
    world.register_component_hooks::<Light>().on_remove(table::free_slot);
    world.register_component_hooks::<InheritedHidden>().on_add(instances::free_slot).on_remove(show);
    world.register_component_hooks::<Disabled>().on_add(disable).on_remove(enable);
}

/// Notes an object's policy, and gives it to its pieces.
fn gain_policy(mut world: DeferredWorld, context: HookContext) {
    let policy = world.get::<LightPolicy>(context.entity).copied();
    for_pieces(&mut world, context.entity, |commands, piece| {
        policy.into_iter().for_each(|policy| _ = commands.entity(piece).try_insert(policy));
    });
    order::note_policy(world, context.entity, |own, object| own.set_policy(object, policy));
}

fn lose_policy(mut world: DeferredWorld, context: HookContext) {
    for_pieces(&mut world, context.entity, |commands, piece| _ = commands.entity(piece).try_remove::<LightPolicy>());
    order::note_policy(world, context.entity, |own, object| own.set_policy(object, None));
}

fn gain_no_shadow(mut world: DeferredWorld, context: HookContext) {
    for_pieces(&mut world, context.entity, |commands, piece| _ = commands.entity(piece).try_insert(NoShadow));
    look_new(world, context.entity);
}

fn lose_no_shadow(mut world: DeferredWorld, context: HookContext) {
    for_pieces(&mut world, context.entity, |commands, piece| _ = commands.entity(piece).try_remove::<NoShadow>());
    look_new(world, context.entity);
}

/// Makes an object look changed to what draws it.
fn look_new(mut world: DeferredWorld, object: Entity) {
    if let Some(mut material) = world.get_mut::<MaterialId>(object) {
        material.set_changed();
    }
}

fn become_piece(world: DeferredWorld, context: HookContext) {
    order::note_policy(world, context.entity, |own, object| own.set_piece(object, true));
}

fn cease_piece(world: DeferredWorld, context: HookContext) {
    order::note_policy(world, context.entity, |own, object| own.set_piece(object, false));
}

fn for_pieces(world: &mut DeferredWorld, object: Entity, mut change: impl FnMut(&mut Commands, Entity)) {
    let pieces: Vec<Entity> = world.get::<Pieces>(object).into_iter().flat_map(|pieces| pieces.iter()).collect();
    let mut commands = world.commands();
    pieces.into_iter().for_each(|piece| change(&mut commands, piece));
}

/// Takes what loses its mesh, by itself or with its life, out of the tables of objects.
fn lose_mesh(mut world: DeferredWorld, context: HookContext) {
    instances::free_slot(world.reborrow(), context);
    order::free_place(world, context);
}

/// Takes what loses its place out of the tables of objects and lights, and notes it.
fn lose_place(mut world: DeferredWorld, context: HookContext) {
    disable(world.reborrow(), context);
    incomplete::lose_place(world, context);
}

/// Takes an entity that is disabled out of the tables of objects and lights.
fn disable(mut world: DeferredWorld, context: HookContext) {
    instances::free_slot(world.reborrow(), context);
    order::free_place(world.reborrow(), context);
    table::free_slot(world, context);
}

/// Makes an entity that is enabled again look new to what places it and what is below it, draws it, chooses its
/// lights, or lists lights.
fn enable(mut world: DeferredWorld, context: HookContext) {
    if let Some(mut transform) = world.get_mut::<Transform>(context.entity) {
        transform.set_changed();
    }
    if let Some(mut light) = world.get_mut::<Light>(context.entity) {
        light.set_changed();
    }
    // Pieces follow their object's material.
    if world.get::<Pieces>(context.entity).is_some()
        && let Some(mut material) = world.get_mut::<MaterialId>(context.entity)
    {
        material.set_changed();
    }
    show(world, context);
}

/// Makes an object that is drawn again look new to what draws it and chooses its lights.
fn show(mut world: DeferredWorld, context: HookContext) {
    if let Some(mut mesh) = world.get_mut::<MeshId>(context.entity) {
        mesh.set_changed();
    }
}
