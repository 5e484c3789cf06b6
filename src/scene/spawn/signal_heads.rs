//! Lamps of signals.

use super::below::descendants;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::collections::HashMap;
use systems::assets::{Library, Material, MaterialId};
use systems::lights::Light;
use systems::vehicles::signals::{Aspect, SignalHead, SignalLamp};

/// Names of the nodes of a signal's model, what they show, and the light of their glass.
const LAMPS: [(&str, Aspect, Vec3); 3] = [
    ("lamp_red", Aspect::Red, Vec3::new(6.0, 0.25, 0.15)),
    ("lamp_amber", Aspect::Amber, Vec3::new(6.0, 2.6, 0.2)),
    ("lamp_green", Aspect::Green, Vec3::new(0.3, 5.0, 1.8)),
];

/// Glass that is lit, by the glass that is dark.
#[derive(Default)]
pub struct LitGlass(HashMap<(MaterialId, Aspect), MaterialId>);

impl LitGlass {
    /// Makes an entity the head of a group of a signal; returns whether its model has lamps.
    pub fn make_head(&mut self, world: &mut World, entity: Entity, below: &[Entity], head: u32) -> bool {
        let mut any = false;
        for (name, aspect, glow) in LAMPS {
            let is_lamp = |node: Entity| world.get::<Name>(node).is_some_and(|own| own.as_str() == name);
            let Some(node) = below.iter().copied().find(|&node| is_lamp(node)) else { continue };
            any = true;
            for part in descendants(world, node).into_iter().chain([node]) {
                let dark = world.get::<MaterialId>(part).copied();
                let glass = dark.map(|dark| (dark, self.lit(world, dark, aspect, glow)));
                if glass.is_some() || world.get::<Light>(part).is_some() {
                    world.entity_mut(part).insert(SignalLamp { aspect, glass });
                }
            }
        }
        world.entity_mut(entity).insert(SignalHead { head, shown: None });
        any
    }

    fn lit(&mut self, world: &mut World, dark: MaterialId, aspect: Aspect, glow: Vec3) -> MaterialId {
        *self.0.entry((dark, aspect)).or_insert_with(|| {
            let mut library = world.resource_mut::<Library>();
            let glass = library.material(dark).cloned().unwrap_or_default();
            let emissive_map = glass.emissive_map.or(glass.base_map);
            library.add_material(Material { emissive_factor: glow, emissive_map, ..glass })
        })
    }
}
