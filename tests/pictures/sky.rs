//! Light of a sky on a known surface, and what is drawn of the sky itself.

use crate::common::prelude::*;
use crate::common::square::{SIZE, Square, matte};
use std::f64::consts::PI;
use systems::lights::NoShadow;
use systems::weather::{CurrentSky, Weather, WeatherTimeline};

const LUX: f32 = 5000.0;

/// A white square that faces east, and hides nothing, under a sky.
fn square_under(weather: Weather) -> Option<Square> {
    let mut square = Square::new(matte(Vec3::ONE))?;
    let world = &mut square.simulation.world;
    world.entity_mut(square.square).insert(NoShadow);
    world.insert_resource(WeatherTimeline::new(weather));
    let environment = Environment { auto_exposure: false, lux: LUX, ..crate::common::dark() };
    world.insert_resource(environment);
    Some(square)
}

fn overcast() -> Weather {
    Weather { clouds: 1.0, ..Weather::preset("clear_noon").expect("a preset") }
}

/// Luminance of an overcast sky is L (1 + 2 sin γ) / 3, of which a wall gets π/6 + 4/9 and level ground 7π/9 times L: 0.396 of
/// it. Half of what the ground throws back, 0.2 of its light, comes to that.
#[test]
fn a_wall_under_clouds_gets_its_share_of_the_light_on_level_ground() {
    let Some(mut square) = square_under(overcast()) else { return };
    let found = f64::from(square.middle().y) * f64::from(LUX);
    let sky = CurrentSky::of(&square.simulation.world).expect("an atmosphere").sky;
    let level = sky.harmonics.irradiance(glam::DVec3::Y).y;
    let expected = (PI / 6.0 + 4.0 / 9.0) / (7.0 * PI / 9.0) + 0.1;
    // Three bands of harmonics have an even half sphere to 1 %, this one to 3 %.
    assert!((found / level / expected - 1.0).abs() < 0.03, "{} for {expected}", found / level);
}

#[test]
fn the_sky_is_drawn_as_it_shines_and_ends_at_the_horizon() {
    let Some(mut square) = square_under(overcast()) else { return };
    square.middle();
    let pixels = square.headless.renderer.read_linear().expect("linear colours");
    let sky = CurrentSky::of(&square.simulation.world).expect("an atmosphere").sky;
    let view = Viewpoint::Camera(square.camera).view(&square.simulation.world, (SIZE, SIZE));
    let world_from_clip = view.clip_from_world().inverse();
    let shown = |x: u32, y: u32| {
        let ndc = (Vec2::new(x as f32, y as f32) + 0.5) / SIZE as f32 * 2.0 - 1.0;
        let place = world_from_clip.project_point3(Vec3::new(ndc.x, -ndc.y, 0.5));
        let toward = (place - view.eye()).normalize().as_dvec3();
        (f64::from(pixels[(y * SIZE + x) as usize][1]), toward)
    };
    let unit = PI / f64::from(LUX);
    for x in [0, SIZE / 3, SIZE - 1] {
        let (above, toward) = shown(x, 0);
        assert!(toward.y > 0.0);
        // The nearest texel for what is linear between four: as much as neighbours differ, which lie half a degree apart.
        let expected = sky.luminance(toward) * unit;
        assert!((above / expected - 1.0).abs() < 0.02, "{x}: {above} for {expected}");
        let (below, toward) = shown(x, SIZE - 1);
        assert!(toward.y < 0.0);
        // Half floats.
        assert!((below / (sky.ground.y * unit) - 1.0).abs() < 2e-3, "{x}: {below} for {}", sky.ground.y * unit);
    }
}

/// A mirror that lies halfway between the eye and the zenith shows the zenith.
#[test]
fn a_mirror_shows_the_sky() {
    let Some(mut square) = square_under(overcast()) else { return };
    square.edit(|material| {
        material.shading = Shading::MetallicRoughness;
        (material.metallic, material.roughness) = (1.0, 0.0);
    });
    let tilted = Transform::from_rotation(Quat::from_rotation_x(std::f32::consts::FRAC_PI_4));
    square.simulation.world.entity_mut(square.square).insert(tilted);
    let found = f64::from(square.middle().y);
    let sky = CurrentSky::of(&square.simulation.world).expect("an atmosphere").sky;
    let expected = sky.luminance(glam::DVec3::Y) * PI / f64::from(LUX);
    // The fit of what a white mirror gives back is within 2 % of all where it is smooth.
    assert!((found / expected - 1.0).abs() < 0.03, "{found} for {expected}");
}

#[test]
fn exposure_follows_the_day_and_leaves_the_night_alone() {
    let Some(mut square) = square_under(Weather::preset("clear_noon").expect("a preset")) else { return };
    square.simulation.world.resource_mut::<Environment>().lux = 30.0;
    let fixed = square.middle();
    square.simulation.world.resource_mut::<Environment>().auto_exposure = true;
    let followed = square.middle();
    let sky = CurrentSky::of(&square.simulation.world).expect("an atmosphere").sky;
    let expected = f64::from(fixed.y) * 30.0 / sky.daylight;
    // Half floats, twice.
    assert!((f64::from(followed.y) / expected - 1.0).abs() < 4e-3, "{followed} for {expected}");
    square.simulation.world.insert_resource(WeatherTimeline::new(Weather::preset("night").expect("a preset")));
    let night = square.middle();
    square.simulation.world.resource_mut::<Environment>().auto_exposure = false;
    assert_eq!(square.middle(), night);
}
