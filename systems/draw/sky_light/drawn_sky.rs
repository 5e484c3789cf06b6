//! Sky of a frame in the world's units, and the lights of sun and moon.
//!
//! The world's unit of light is [`Environment::lux`]: a white surface under that illuminance shows 1. So illuminance is
//! divided by it, and radiance, in cd/m², by a π-th of it.

use super::movers::Movers;
use crate::draw::environment::Environment;
use crate::draw::list::DrawList;
use crate::draw::records::SkyRecord;
use crate::lights::components::Light;
use crate::lights::relevance::LUMINANCE;
use crate::space::transform::Transform;
use crate::weather::current::CurrentSky;
use crate::weather::openness::bricks::Openness;
use crate::weather::sky::{Sky, SkyLight};
use bevy_ecs::prelude::*;
use glam::{DVec3, Quat, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Part of the world's unit below which sun and moon are off.
const OFF: f32 = 1e-9;

/// Sky that a frame is drawn under, for renderers.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnSky {
    /// Map of its radiance. Equal pointers have equal maps.
    pub sky: Arc<Sky>,
    /// Part of it that each place sees; `None`: all of it everywhere.
    pub openness: Option<Arc<Openness>>,
    /// Movers, which hide it from what is beside them.
    pub movers: Arc<Movers>,
    /// Constants for shaders.
    pub record: SkyRecord,
}

impl DrawnSky {
    pub(crate) fn set_openness(&mut self, openness: Option<Arc<Openness>>, movers: Arc<Movers>) {
        if let Some(openness) = &openness {
            self.record.openness_origin = openness.origin.to_array();
            self.record.openness_bricks = openness.texture_bricks.to_array();
        }
        let Movers { first, origin, cells, cell, .. } = *movers;
        self.record.movers_first = first;
        (self.record.movers_origin, self.record.movers_cells) = (origin.to_array(), cells);
        self.record.movers_cell = cell;
        (self.openness, self.movers) = (openness, movers);
    }
}

/// Marks the lights of sun and moon, which follow from the weather: they are no state and have no number.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct WeatherLight;

/// Entities of the lights of sun and moon, where there are any.
#[derive(Resource, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct WeatherLights([Option<Entity>; 2]);

/// Brings sky, exposure, and the lights of sun and moon up to date with the weather.
pub(crate) fn follow_weather(world: &mut World) {
    let current = CurrentSky::of(world);
    let lights = current.as_ref().map(|current| [current.sun, current.moon]);
    let environment = world.resource::<Environment>().clone();
    let lux = f64::from(environment.lux);
    for body in 0..2 {
        follow(world, body, lights.map(|lights| lights[body]), lux);
    }
    let mut list = world.resource_mut::<DrawList>();
    let list = list.bypass_change_detection();
    if let Some(current) = &current
        && environment.auto_exposure
    {
        list.environment.exposure *= (lux / current.sky.daylight).min(1.0) as f32;
    }
    list.light_features.atmosphere = current.is_some();
    list.light_features.openness = false;
    list.sky = current.map(|current| DrawnSky {
        record: record(&current, lux),
        sky: current.sky,
        openness: None,
        movers: Arc::default(),
    });
}

/// Keeps a body's light; without any, the entity goes.
fn follow(world: &mut World, body: usize, light: Option<SkyLight>, lux: f64) {
    let known = world.resource::<WeatherLights>().0[body];
    let Some(light) = light else {
        known.into_iter().for_each(|entity| _ = world.despawn(entity));
        if known.is_some() {
            world.resource_mut::<WeatherLights>().0[body] = None;
        }
        return;
    };
    let color = (light.illuminance / lux).as_vec3();
    let intensity = color.max_element();
    let shining = Light {
        enabled: color.dot(LUMINANCE) > OFF,
        angle: 2.0 * light.radius as f32,
        ..Light::directional(intensity).with_color(color / intensity.max(f32::MIN_POSITIVE)).with_shadows()
    };
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, -light.direction.as_vec3());
    let placed = Transform { rotation, ..Transform::default() };
    let entity = known.filter(|entity| world.get_entity(*entity).is_ok());
    match entity {
        Some(entity) => {
            let mut entity = world.entity_mut(entity);
            entity.get_mut::<Light>().into_iter().for_each(|mut own| _ = own.set_if_neq(shining.clone()));
            entity.get_mut::<Transform>().into_iter().for_each(|mut own| _ = own.set_if_neq(placed));
        }
        None => {
            let entity = world.spawn((WeatherLight, shining, placed)).id();
            world.resource_mut::<WeatherLights>().0[body] = Some(entity);
        }
    }
}

fn record(current: &CurrentSky, lux: f64) -> SkyRecord {
    let of_radiance = PI / lux;
    let disc = |light: &SkyLight| {
        // Of a disc of even radiance, whose solid angle is π r².
        let radiance = light.illuminance / (PI * light.radius * light.radius).max(1e-12) * of_radiance;
        let (direction, radius) = (light.direction.as_vec3(), light.radius as f32);
        (direction.extend(radius).to_array(), radiance.as_vec3().extend(0.0).to_array())
    };
    let ((sun, sun_radiance), (moon, moon_radiance)) = (disc(&current.sun), disc(&current.moon));
    let sky = &current.sky;
    let harmonics = sky.harmonics.polynomial(1.0 / lux).map(|coefficient| coefficient.extend(0.0).to_array());
    let ground: DVec3 = sky.ground * of_radiance;
    SkyRecord {
        harmonics,
        ground: ground.as_vec3().to_array(),
        unit: (sky.map.unit * of_radiance) as f32,
        sun,
        sun_radiance,
        moon,
        moon_radiance,
        up: (sky.upper(DVec3::Y) / lux).as_vec3().to_array(),
        ..SkyRecord::default()
    }
}
