//! Light and a view for what brings none: a neutral rig, and a camera that sees everything.

use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::Vec3;
use systems::Simulation;
use systems::assets::all_bounds;
use systems::draw::{Camera, Environment, Projection};
use systems::lights::{LUMINANCE, Light, LightRecord, PackedLight, irradiance};
use systems::space::{Aabb, Sphere, Transform};

/// Vertical field of view of the framing camera.
const FOV_Y: f32 = 35.0;

/// From the front (+Z, where glTF models face), a little from the right and from above.
const TOWARD_EYE: Vec3 = Vec3::new(0.55, 0.4, 0.75);

/// Spawns a camera that sees the whole sphere around the bounds, whatever the shape of the picture.
pub fn frame(bounds: Option<Aabb>, world: &mut World) -> (String, Entity) {
    let bounds = bounds.unwrap_or(Aabb { min: Vec3::splat(-0.5), max: Vec3::splat(0.5) });
    let radius = (bounds.center().distance(bounds.max)).max(1e-4);
    let fov_y = FOV_Y.to_radians();
    let distance = radius / (fov_y * 0.5).sin();
    let eye = bounds.center() + TOWARD_EYE.normalize() * distance;
    let camera = Camera {
        projection: Projection::Perspective { fov_y, aspect: Some(1.0) },
        near: (distance - radius) * 0.05,
        ..Camera::default()
    };
    let at = Transform::from_translation(eye).looking_at(bounds.center(), Vec3::Y);
    let name = "framing";
    (name.into(), world.spawn((Name::new(name), at, camera)).id())
}

/// Spawns a warm key light from the upper left and a cool fill from the right, as seen by the framing camera; returns
/// the environment with the soft ambient that goes with them. Together a white surface comes close to 1.
pub fn light(world: &mut World) -> Environment {
    let toward_key = Vec3::new(-0.35, 0.75, 0.8);
    let toward_fill = Vec3::new(1.0, 0.25, 0.2);
    for (name, toward, light) in [
        ("key light", toward_key, Light::directional(0.8).with_color(Vec3::new(1.0, 0.96, 0.9))),
        ("fill light", toward_fill, Light::directional(0.3).with_color(Vec3::new(0.85, 0.92, 1.0))),
    ] {
        world.spawn((Name::new(name), Transform::default().looking_to(-toward, Vec3::Y), light));
    }
    Environment { ambient: Vec3::splat(0.15), ..Environment::default() }
}

/// Sets the exposure for a file's own lights. glTF's are physical: candela and lux, thousands as soon as one is meant
/// as daylight. The object in the middle of all objects by irradiance comes out as if lit by 1; dim files stay as they
/// are.
pub fn expose(simulation: &mut Simulation) {
    simulation.frame();
    let lights = simulation.draw_list().lights.records.iter().map(PackedLight::unpacked);
    let lights: Vec<_> = lights.collect();
    let at = |bounds: &Sphere| {
        // Not nearer to the light than the object's radius: a lamp within its own shade would outshine the sun.
        let point = |light: &LightRecord| {
            let offset = bounds.center - Vec3::from(light.position);
            Vec3::from(light.position) + offset.normalize_or(Vec3::Y) * offset.length().max(bounds.radius)
        };
        lights.iter().map(|light| irradiance(light, point(light)).dot(LUMINANCE)).sum::<f32>()
    };
    let mut received: Vec<f32> = all_bounds(&mut simulation.world).iter().map(at).filter(|e| *e > 0.0).collect();
    received.sort_by(f32::total_cmp);
    let Some(&middle) = received.get(received.len() / 2) else { return };
    if let Some(mut environment) = simulation.world.get_resource_mut::<Environment>() {
        environment.exposure = (1.0 / middle).clamp(1e-6, 1.0);
    }
}
