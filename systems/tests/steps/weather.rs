//! Weather of a world: what inputs make of it, that it is state, and the lights of sun and moon that follow from it.

use super::*;
use glam::DVec3;
use std::sync::Arc;
use systems::draw::{Environment, WeatherLight};
use systems::ecs::clock::Clock;
use systems::run::inputs::{Input, Inputs, SavedInput, apply_queued};
use systems::run::registry::{EntityRegistry, register_all};
use systems::run::snapshot;
use systems::run::standard_inputs::SetWeather;
use systems::run::state_hash::hash;
use systems::space::GeoOrigin;
use systems::space::wgs84::Geodetic;
use systems::weather::{CurrentSky, Date, SkyModel, Weather, WeatherTimeline};

/// Weights of linear RGB in luminance (IEC 61966-2-1).
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// A lamp, and steps of 1/60 s.
fn simulation() -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world.spawn(Light::point(1.0, 5.0));
    register_all(&mut simulation.world);
    simulation
}

/// A clear sky with the sun at these degrees, whose date stands still.
fn sun_at(azimuth: f64, elevation: f64) -> Weather {
    Weather {
        sky: SkyModel::Atmosphere,
        time_speed: 0.0,
        sun_azimuth_degrees: Some(azimuth),
        sun_elevation_degrees: Some(elevation),
        ..Weather::default()
    }
}

/// An input, between two steps.
fn set(simulation: &mut Simulation, weather: Weather, over_seconds: f64) {
    simulation.world.resource_mut::<Inputs>().push(SetWeather { weather, over_seconds });
    apply_queued(&mut simulation.world);
}

fn timeline(simulation: &Simulation) -> &WeatherTimeline {
    simulation.world.resource()
}

fn now(simulation: &Simulation) -> Weather {
    timeline(simulation).now(simulation.world.resource::<Clock>())
}

fn steps(simulation: &mut Simulation, count: usize) {
    (0..count).for_each(|_| simulation.step());
}

/// Lights of sun and moon: all there are, and the directions toward them.
fn lights(simulation: &mut Simulation) -> Vec<(Light, Vec3)> {
    let mut lights = simulation.world.query_filtered::<(&Light, &Transform), With<WeatherLight>>();
    let toward = |(light, at): (&Light, &Transform)| (light.clone(), at.rotation * Vec3::Z);
    lights.iter(&simulation.world).map(toward).collect()
}

/// The light of the sun, where the moon does not shine.
fn sun(simulation: &mut Simulation) -> (Light, Vec3) {
    let shining: Vec<_> = lights(simulation).into_iter().filter(|(light, _)| light.enabled).collect();
    let [sun] = &shining[..] else { panic!("expected one light, found {shining:?}") };
    sun.clone()
}

fn sky(simulation: &Simulation) -> CurrentSky {
    CurrentSky::of(&simulation.world).expect("an atmosphere")
}

#[test]
fn an_input_changes_the_weather() {
    let mut simulation = simulation();
    assert_eq!(now(&simulation), Weather::default());
    let wanted = Weather { clouds: 0.5, haze: 10_000.0, ..sun_at(90.0, 30.0) };
    simulation.world.resource_mut::<Inputs>().push(SetWeather { weather: wanted.clone(), over_seconds: 0.0 });
    assert_eq!(now(&simulation), Weather::default(), "it waits for the step");
    simulation.step();
    assert_eq!(now(&simulation), wanted);
    steps(&mut simulation, 100);
    assert_eq!(now(&simulation), wanted);
}

#[test]
fn a_change_is_linear_in_the_steps() {
    let mut simulation = simulation();
    set(&mut simulation, sun_at(350.0, 10.0), 0.0);
    let wanted = Weather { clouds: 1.0, haze: 20_000.0, glow: 0.1, ..sun_at(10.0, 40.0) };
    set(&mut simulation, wanted.clone(), 2.0);
    for step in 0..=120 {
        let part = f64::from(step) / 120.0;
        let weather = now(&simulation);
        // Rounding of some ten operations at most.
        let near = |found: f64, from: f64, to: f64| (found - (from + (to - from) * part)).abs() <= 1e-12 * to.abs();
        assert!(near(weather.clouds, 0.0, 1.0) && near(weather.haze, 40_000.0, 20_000.0), "step {step}: {weather:?}");
        assert!(near(weather.glow, 0.0002, 0.1), "step {step}: {weather:?}");
        let (azimuth, elevation) = (weather.sun_azimuth_degrees, weather.sun_elevation_degrees);
        assert!(near(elevation.expect("given"), 10.0, 40.0), "step {step}: {elevation:?}");
        // Over north, where it begins anew.
        let azimuth = azimuth.expect("given");
        assert!(near(azimuth, 350.0, 370.0) || near(azimuth + 360.0, 350.0, 370.0), "step {step}: {azimuth}");
        simulation.step();
    }
    assert_eq!(now(&simulation), wanted);
}

/// The date goes on by the clock, as fast as the weather says.
#[test]
fn the_date_goes_on() {
    let mut simulation = simulation();
    set(&mut simulation, Weather { time_speed: 3600.0, date: Date(1e9), ..sun_at(0.0, 10.0) }, 0.0);
    steps(&mut simulation, 90);
    assert!((now(&simulation).date.0 - (1e9 + 5400.0)).abs() < 1e-3, "{:?}", now(&simulation).date);
}

#[test]
fn a_snapshot_in_the_middle_of_a_change_goes_on_alike() {
    let mut whole = simulation();
    set(&mut whole, sun_at(0.0, 10.0), 0.0);
    steps(&mut whole, 7);
    set(&mut whole, Weather { clouds: 1.0, ..sun_at(90.0, 60.0) }, 1.0);
    steps(&mut whole, 30);
    let saved = snapshot::save(&mut whole.world);
    let mut continued = simulation();
    snapshot::restore(&mut continued.world, &saved).expect("a snapshot of this scene");
    assert_eq!(timeline(&continued), timeline(&whole));
    assert_eq!(snapshot::save(&mut continued.world), saved);
    for step in 0..60 {
        assert_eq!(now(&continued), now(&whole), "step {step}");
        assert_eq!(hash(&mut continued.world), hash(&mut whole.world), "step {step}");
        continued.step();
        whole.step();
    }
    assert_eq!(now(&continued).clouds, 1.0);
    // Back in time, in the same world.
    snapshot::restore(&mut whole.world, &saved).expect("a snapshot of this scene");
    assert_eq!(now(&whole).clouds, 0.5);
}

#[test]
fn default_weather_leaves_hashes_and_snapshots_as_they_are() {
    let state = |simulation: &mut Simulation| (hash(&mut simulation.world), snapshot::save(&mut simulation.world));
    let (mut plain, mut changed) = (simulation(), simulation());
    let begun = state(&mut plain);
    assert!(!begun.1.windows(7).any(|name| name == b"weather"), "files are as they were before there was weather");
    set(&mut changed, sun_at(0.0, 10.0), 1.0);
    let (other_hash, other_bytes) = state(&mut changed);
    assert!(other_hash != begun.0 && other_bytes.len() > begun.1.len());
    steps(&mut plain, 10);
    steps(&mut changed, 10);
    changed.frame();
    assert_ne!(state(&mut changed), state(&mut plain));
    changed.world.insert_resource(WeatherTimeline::default());
    assert_eq!(state(&mut changed), state(&mut plain));
    // A file without weather is one of the default weather.
    set(&mut changed, sun_at(0.0, 10.0), 0.0);
    snapshot::restore(&mut changed.world, &begun.1).expect("a snapshot of this scene");
    assert_eq!(*timeline(&changed), WeatherTimeline::default());
    assert_eq!(state(&mut changed), begun);
}

#[test]
fn what_is_not_sound_is_never_applied() {
    let of = |weather: Weather, over_seconds: f64| SetWeather { weather, over_seconds };
    let with = |change: fn(&mut Weather)| {
        let mut weather = sun_at(0.0, 10.0);
        change(&mut weather);
        of(weather, 0.0)
    };
    let bad = [
        with(|weather| weather.haze = f64::NAN),
        with(|weather| weather.haze = 1999.0),
        with(|weather| weather.haze = f64::INFINITY),
        with(|weather| weather.clouds = 2.0),
        with(|weather| weather.clouds = -0.1),
        with(|weather| weather.glow = -1.0),
        with(|weather| weather.time_speed = -1.0),
        with(|weather| weather.time_speed = 1e5),
        with(|weather| weather.sun_azimuth_degrees = Some(361.0)),
        with(|weather| weather.sun_elevation_degrees = Some(91.0)),
        with(|weather| weather.sun_elevation_degrees = Some(f64::NAN)),
        with(|weather| weather.sun_elevation_degrees = None),
        with(|weather| weather.moon_azimuth_degrees = Some(5.0)),
        with(|weather| weather.date = Date(1e12)),
        with(|weather| weather.date = Date(f64::NAN)),
        of(sun_at(0.0, 10.0), -1.0),
        of(sun_at(0.0, 10.0), f64::INFINITY),
        of(sun_at(0.0, 10.0), f64::NAN),
        of(sun_at(0.0, 10.0), SetWeather::LONGEST + 1.0),
    ];
    let mut simulation = simulation();
    for input in bad {
        assert!(!input.is_valid(), "{input:?}");
        let saved = SavedInput::of(&input);
        assert!(simulation.world.resource::<Inputs>().check(&saved).is_err(), "{input:?}");
        simulation.world.resource_mut::<Inputs>().push_saved(saved);
        assert!(apply_queued(&mut simulation.world).is_empty(), "{input:?}");
        assert_eq!(*timeline(&simulation), WeatherTimeline::default(), "{input:?}");
    }
    assert!(of(sun_at(-360.0, -90.0), 0.0).is_valid() && of(sun_at(360.0, 90.0), SetWeather::LONGEST).is_valid());
}

#[test]
fn a_snapshot_with_weather_that_is_not_sound_is_refused() {
    let mut broken = simulation();
    broken.world.insert_resource(WeatherTimeline::new(Weather { clouds: 2.0, ..Weather::default() }));
    let saved = snapshot::save(&mut broken.world);
    let error = snapshot::restore(&mut simulation().world, &saved).expect_err("clouds").to_string();
    assert_eq!(error, "weather: invalid value");
}

#[test]
fn a_sun_by_date_needs_a_place_on_earth() {
    let by_date = Weather { sky: SkyModel::Atmosphere, time_speed: 0.0, ..Weather::default() };
    let mut nowhere = simulation();
    set(&mut nowhere, by_date.clone(), 0.0);
    assert_eq!(*timeline(&nowhere), WeatherTimeline::default());
    let mut somewhere = simulation();
    let place = Geodetic { latitude_degrees: 50.0, longitude_degrees: 0.0, altitude: 0.0 };
    somewhere.world.insert_resource(GeoOrigin { place, at: DVec3::ZERO });
    set(&mut somewhere, by_date.clone(), 0.0);
    assert_eq!(now(&somewhere), by_date);
    // Noon of midsummer's day at Greenwich: 90° − 50° + 23.44°, in the south. Refraction lifts it by 0.01°. By the
    // equation of time, 2 minutes, it is 0.5° about the pole from there.
    let toward = sky(&somewhere).sun.direction;
    assert!((toward.y.asin().to_degrees() - 63.44).abs() < 0.03, "{toward}");
    assert!(toward.x < 0.0 && toward.z.abs() < 0.02, "{toward}");
}

#[test]
fn sun_and_moon_are_lights_without_numbers() {
    let mut simulation = simulation();
    simulation.frame();
    assert!(lights(&mut simulation).is_empty());
    assert!(simulation.draw_list().sky.is_none());
    let ids = simulation.world.resource::<EntityRegistry>().iter().count();
    set(&mut simulation, sun_at(90.0, 30.0), 0.0);
    let before = hash(&mut simulation.world);
    simulation.frame();
    simulation.frame();
    assert_eq!(lights(&mut simulation).len(), 2);
    assert!(simulation.draw_list().sky.is_some() && simulation.draw_list().light_features.atmosphere);
    assert_eq!(hash(&mut simulation.world), before);
    let entities: Vec<Entity> = {
        let mut marked = simulation.world.query_filtered::<Entity, With<WeatherLight>>();
        marked.iter(&simulation.world).collect()
    };
    for again in [false, true] {
        if again {
            register_all(&mut simulation.world);
        }
        let registry = simulation.world.resource::<EntityRegistry>();
        assert!(entities.iter().all(|&entity| registry.id(entity).is_none()), "registered again: {again}");
        assert_eq!(registry.iter().count(), ids, "registered again: {again}");
    }
    assert_eq!(hash(&mut simulation.world), before);
    set(&mut simulation, Weather::default(), 0.0);
    simulation.frame();
    assert!(lights(&mut simulation).is_empty());
    assert!(simulation.draw_list().sky.is_none() && !simulation.draw_list().light_features.atmosphere);
    assert!(entities.iter().all(|&entity| simulation.world.get_entity(entity).is_err()));
}

/// A light that a program has taken out is there again in the next frame.
#[test]
fn a_light_that_went_comes_back() {
    let mut simulation = simulation();
    set(&mut simulation, sun_at(90.0, 30.0), 0.0);
    simulation.frame();
    let first = {
        let mut marked = simulation.world.query_filtered::<Entity, With<WeatherLight>>();
        marked.iter(&simulation.world).next().expect("a light")
    };
    simulation.world.despawn(first);
    simulation.frame();
    assert_eq!(lights(&mut simulation).len(), 2);
}

#[test]
fn the_sun_stands_where_it_is_put() {
    let mut simulation = simulation();
    for (azimuth, elevation, toward) in [
        (0.0, 0.0, Vec3::X),
        (90.0, 0.0, Vec3::Z),
        (0.0, 90.0, Vec3::Y),
        (180.0, 45.0, Vec3::new(-1.0, 1.0, 0.0).normalize()),
        (-90.0, 30.0, Vec3::new(0.0, 0.5, -0.75f32.sqrt())),
    ] {
        set(&mut simulation, sun_at(azimuth, elevation), 0.0);
        simulation.frame();
        // Rounding of a rotation in 32 bits.
        let (light, found) = sun(&mut simulation);
        assert!(found.abs_diff_eq(toward, 1e-4), "{azimuth}°, {elevation}°: {found}");
        assert!(sky(&simulation).sun.direction.as_vec3().abs_diff_eq(toward, 1e-6), "{azimuth}°, {elevation}°");
        assert!(light.shadows, "{light:?}");
    }
}

#[test]
fn a_high_sun_is_as_bright_as_on_a_clear_day() {
    let mut simulation = simulation();
    set(&mut simulation, sun_at(150.0, 60.0), 0.0);
    simulation.frame();
    // Lux of a surface that faces the sun on a clear day; the air differs.
    let lux = sky(&simulation).sun.illuminance.dot(LUMINANCE);
    assert!((80e3..110e3).contains(&lux), "{lux}");
    let unit = f64::from(simulation.world.resource::<Environment>().lux);
    let (light, _) = sun(&mut simulation);
    let of_light = (light.color * light.intensity).as_dvec3().dot(LUMINANCE) * unit;
    // Numbers of 32 bits.
    assert!((of_light / lux - 1.0).abs() < 1e-5, "{of_light} for {lux}");
    // A low sun is red.
    let colour = sky(&simulation).sun.illuminance;
    set(&mut simulation, sun_at(150.0, 3.0), 0.0);
    let low = sky(&simulation).sun.illuminance;
    assert!(low.x / low.z > 2.0 * colour.x / colour.z, "{low} after {colour}");
}

#[test]
fn a_sun_below_the_horizon_gives_no_light() {
    let mut simulation = simulation();
    for elevation in [-1.0, -5.0, -90.0] {
        set(&mut simulation, sun_at(150.0, elevation), 0.0);
        simulation.frame();
        let found = lights(&mut simulation);
        assert!(found.iter().all(|(light, _)| !light.enabled && light.intensity == 0.0), "{elevation}°: {found:?}");
        assert!(found.iter().all(|(light, _)| light.color.is_finite()), "{elevation}°: {found:?}");
    }
}

#[test]
fn a_full_moon_shines_at_night() {
    let mut simulation = simulation();
    let night = Weather { moon_azimuth_degrees: Some(90.0), moon_elevation_degrees: Some(60.0), ..sun_at(0.0, -40.0) };
    set(&mut simulation, night, 0.0);
    simulation.frame();
    // 0.31 lx outside of the air (Krisciunas, Schaefer 1991), of which that of noon above is let through.
    let lux = sky(&simulation).moon.illuminance.dot(LUMINANCE);
    assert!((0.31 * 80.0 / 128.0..0.32 * 110.0 / 128.0).contains(&lux), "{lux}");
    let (_, toward) = sun(&mut simulation);
    assert!(toward.abs_diff_eq(Vec3::new(0.0, 0.75f32.sqrt(), 0.5), 1e-4), "{toward}");
}

#[test]
fn exposure_follows_the_sky_and_opens_no_further_at_night() {
    let mut simulation = simulation();
    simulation.world.resource_mut::<Environment>().exposure = 2.0;
    let lux = f64::from(simulation.world.resource::<Environment>().lux);
    let exposure = |simulation: &mut Simulation| {
        simulation.frame();
        let first = simulation.draw_list().environment.exposure;
        simulation.frame();
        assert_eq!(simulation.draw_list().environment.exposure, first, "by each frame anew");
        f64::from(first)
    };
    assert_eq!(exposure(&mut simulation), 2.0);
    for elevation in [60.0, 5.0, -5.0] {
        set(&mut simulation, sun_at(150.0, elevation), 0.0);
        let found = exposure(&mut simulation);
        let expected = 2.0 * (lux / sky(&simulation).sky.daylight).min(1.0);
        // Numbers of 32 bits.
        assert!((found / expected - 1.0).abs() < 1e-6, "{elevation}°: {found} for {expected}");
    }
    set(&mut simulation, sun_at(150.0, 60.0), 0.0);
    assert!(exposure(&mut simulation) < 2.0 * lux / 50e3, "noon is darkened");
    simulation.world.resource_mut::<Environment>().auto_exposure = false;
    assert_eq!(exposure(&mut simulation), 2.0);
    simulation.world.resource_mut::<Environment>().auto_exposure = true;
    set(&mut simulation, sun_at(150.0, -40.0), 0.0);
    assert_eq!(exposure(&mut simulation), 2.0, "night");
    // The world's own is left alone.
    assert_eq!(simulation.world.resource::<Environment>().exposure, 2.0);
}

#[test]
fn equal_weather_has_one_sky_in_all_worlds() {
    // No other test has this haze, so none can push it out of what is kept.
    let weather = Weather { haze: 77_777.0, ..sun_at(12.0, 34.0) };
    let [first, second] = [(); 2].map(|()| {
        let mut simulation = simulation();
        set(&mut simulation, weather.clone(), 0.0);
        sky(&simulation)
    });
    assert!(Arc::ptr_eq(&first.sky, &second.sky));
    assert_eq!(first, second);
    let mut other = simulation();
    set(&mut other, Weather { clouds: 0.5, ..weather }, 0.0);
    assert!(!Arc::ptr_eq(&first.sky, &sky(&other).sky));
}
