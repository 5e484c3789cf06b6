//! placeholder
use bevy_ecs::prelude::*;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::world::DeferredWorld;
/// The slot of a drawn entity in the instance table. Derived.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
pub struct InstanceSlot(pub u32);
impl Default for InstanceSlot { fn default() -> Self { Self(u32::MAX) } }
pub(crate) fn free_slot(_world: DeferredWorld, _context: HookContext) {}
