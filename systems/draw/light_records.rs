//! The records of lights: those of the light table, brought up to date with the lights.

use super::list::DrawList;
use crate::ecs::changes::for_each_changed_in;
use crate::lights::components::{Light, LightKind};
use crate::lights::record::NO_LIGHT;
use crate::lights::relevance::light_record;
use crate::lights::table::{LightSlot, LightTable};
use crate::space::transform::GlobalTransform;
use bevy_ecs::change_detection::ContiguousRef;
use bevy_ecs::prelude::*;
use glam::Vec3;

/// Writes the lights that changed or moved into the table, in slots that are theirs while they live.
#[allow(clippy::type_complexity)]
pub fn update_light_table(
    mut table: ResMut<LightTable>,
    mut draw_list: ResMut<DrawList>,
    mut lights: ParamSet<(Query<(Entity, Ref<Light>, Ref<GlobalTransform>, &LightSlot)>, Query<&mut LightSlot>)>,
) {
    let table = &mut *table;
    table.begin_frame(&mut draw_list.lights);
    let mut new = Vec::new();
    let all = lights.p0();
    for (entities, lights, transforms, slots) in all.contiguous_iter().into_iter().flatten() {
        let ((lights, settings), (transforms, places)) =
            (ContiguousRef::split(lights), ContiguousRef::split(transforms));
        for_each_changed_in([Some(&settings), Some(&places)], |row| {
            let mut slot = slots[row];
            if slot.0 == NO_LIGHT {
                slot.0 = table.claim();
                new.push((entities[row], slot));
            }
            let light = &lights[row];
            let attenuated = light.kind != LightKind::Directional;
            draw_list.light_features.attenuation |= attenuated && light.attenuation != Light::INVERSE_SQUARE;
            draw_list.light_features.cones |= matches!(light.kind, LightKind::Spot { .. });
            draw_list.light_features.exponents |= matches!(light.kind, LightKind::Spot { inner: None, .. });
            draw_list.light_features.lamp_shadows |= light.shadows && attenuated;
            draw_list.light_features.sun_shadows |= light.shadows && !attenuated;
            draw_list.light_features.sizes |= light.shadows && light.size() > 0.0;
            draw_list.light_features.ambient |= light.ambient != Vec3::ZERO;
            table.write(&mut draw_list.lights, slot.0, light_record(light, &transforms[row]).packed());
            table.write_shadow(slot.0, light.shadows.then_some(light.shadow_near));
        });
    }
    let mut slots = lights.p1();
    for (entity, slot) in new {
        if let Ok(mut component) = slots.get_mut(entity) {
            *component = slot;
        }
    }
    table.end_frame();
}
