//! Doubts about shadows of lights.

use crate::name;
use bevy_ecs::prelude::*;
use systems::lights::{LUMINANCE, Light, LightKind, ShadowLights, fade};

/// A word about lights that cast shadows and have no range.
pub fn shadows_without_end(world: &mut World) -> Option<String> {
    let is_endless = |light: &Light| light.shadows && light.kind != LightKind::Directional && light.range.is_infinite();
    let mut lights = world.query::<(Entity, &Light)>();
    let mut endless = lights.iter(world).filter(|(_, light)| is_endless(light)).map(|(entity, _)| entity);
    let first = name::of_entity(world, endless.next()?);
    let lights = match endless.count() {
        0 => " casts shadows and has no range: whatever is in the scene is drawn for its".to_owned(),
        more => {
            let others = if more == 1 { "light" } else { "lights" };
            format!(
                " and {more} other {others} cast shadows and have no range: whatever is in the scene is drawn for their"
            )
        }
    };
    Some(format!("{first}{lights} shadows; set `range`"))
}

/// A word about directional lights that cast no shadows, though they are to.
pub fn too_many_suns(world: &mut World) -> Option<String> {
    let casts = |light: &Light| light.shadows && light.enabled && light.kind == LightKind::Directional;
    let luminance =
        |light: &Light| (light.color * light.intensity).abs().dot(LUMINANCE).max(light.ambient.abs().dot(LUMINANCE));
    let mut suns: Vec<f32> = world.query::<&Light>().iter(world).filter(|light| casts(light)).map(luminance).collect();
    suns.sort_unstable_by(|a, b| b.total_cmp(a));
    let (count, most) = (suns.len(), ShadowLights::MOST_SUNS);
    let last = *suns.get(most - 1)?;
    let mut others = suns.get(most..)?.iter();
    let mut told = format!("{count} directional lights are to cast shadows; only the {most} brightest do");
    if *others.as_slice().first()? == last {
        told += ", of equally bright ones those that come first";
    }
    // Fainter than it is by itself, since another is nearly as bright.
    let percent = (100.0 * fade(last, others.find(|next| **next < last).copied().unwrap_or(0.0))).floor();
    if percent < 99.0 {
        told += &format!("; the shadow of the faintest of these counts by {percent} %");
    }
    Some(told)
}
