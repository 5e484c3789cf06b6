//! Light of the sky: its radiance by direction, what it does to surfaces, and what of sun and moon comes through.
//!
//! A clear sky is the air's ([`Atmosphere`]), by sun and by moon. Clouds cover it evenly. They leave a share
//! 1 − 0.75 c³·⁴ of the light on the ground (Kasten and Czeplak: "Solar and terrestrial radiation dependent on the
//! amount and type of cloud", Solar Energy 24, 1980, equation 3). Of the sun's own light they let 1 − c² pass; the rest
//! of that share is the sky's. A whole cover has the luminance of an overcast sky, L = L_zenith (1 + 2 sin γ) / 3 (Moon
//! and Spencer: "Illumination from a non-uniform sky", Illuminating Engineering 37, 1942).

use super::atmosphere::Atmosphere;
use super::bodies::{Bodies, Body, of_angles};
use super::harmonics::Harmonics;
use super::prefilter;
use super::sky_map::{SIDE, SkyMap, SkyTexel, hemisphere, in_hemisphere, middle, solid_angle};
use super::weather::Weather;
use crate::ecs::parallel::map_in_parallel;
use glam::{DVec2, DVec3};
use half::f16;
use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Albedo of the ground, whose light is that of the lower half of the sky.
pub(crate) const GROUND_ALBEDO: f64 = 0.2;
/// Weights of linear RGB in luminance (IEC 61966-2-1).
pub(crate) const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);
/// Sine of the elevation from which on a body lights no sky: 18° below the horizon ends astronomical twilight.
const DARK: f64 = -0.309;

/// Steps of what a sky is made for; what is between two has the nearer one's.
const STEPS_PER_DEGREE: f64 = 20.0;
const STEPS_PER_DOUBLING: f64 = 256.0;
const STEPS_OF_CLOUDS: f64 = 256.0;

/// Light of sun or moon on the ground.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SkyLight {
    /// Unit vector toward it.
    pub direction: DVec3,
    /// Illuminance of a surface that faces it, linear RGB: lux.
    pub illuminance: DVec3,
    /// Radius of its disc, radians.
    pub radius: f64,
}

/// A sky, without the discs of sun and moon.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Sky {
    /// Radiance of both halves, cd/m².
    pub harmonics: Harmonics,
    /// Radiance by direction.
    pub map: SkyMap,
    /// Radiance of the ground, linear RGB: cd/m².
    pub ground: DVec3,
    /// Mean illuminance of level ground and of a wall that faces sun and moon: lux.
    pub daylight: f64,
}

/// A body, rounded.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct RoundedBody {
    azimuth: i64,
    elevation: i64,
    doublings_of_lux: i64,
}

/// All that a sky follows from, rounded: equal ones have equal skies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct SkyKey {
    bodies: [Option<RoundedBody>; 2],
    doublings_of_haze: i64,
    clouds: i64,
    /// Bits of a number.
    glow: u64,
}

/// Skies that some world has, and air that was asked for last: shared by all worlds of a process.
static MADE: Mutex<Vec<(SkyKey, Weak<Sky>)>> = Mutex::new(Vec::new());
static AIR: Mutex<VecDeque<(i64, Arc<Atmosphere>)>> = Mutex::new(VecDeque::new());
const MOST_AIR: usize = 16;

/// The value of a key, made unless somebody has it.
pub(crate) fn shared<K: PartialEq, V>(all: &Mutex<Vec<(K, Weak<V>)>>, key: K, make: impl FnOnce(&K) -> V) -> Arc<V> {
    let lock = || all.lock().unwrap_or_else(PoisonError::into_inner);
    let find = |all: &[(K, Weak<V>)]| all.iter().find(|(own, _)| *own == key).and_then(|(_, value)| value.upgrade());
    if let Some(known) = find(&lock()) {
        return known;
    }
    let made = Arc::new(make(&key));
    let mut all = lock();
    // Another thread may have made it meanwhile.
    if let Some(known) = find(&all) {
        return known;
    }
    all.retain(|(_, value)| value.strong_count() > 0);
    all.push((key, Arc::downgrade(&made)));
    made
}

fn air(doublings_of_haze: i64) -> Arc<Atmosphere> {
    let lock = || AIR.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, known)) = lock().iter().find(|(own, _)| *own == doublings_of_haze) {
        return known.clone();
    }
    let made = Arc::new(Atmosphere::new((doublings_of_haze as f64 / STEPS_PER_DOUBLING).exp2()));
    let mut all = lock();
    all.truncate(MOST_AIR - 1);
    all.push_front((doublings_of_haze, made.clone()));
    made
}

fn doublings(value: f64) -> i64 {
    (value.log2() * STEPS_PER_DOUBLING).round() as i64
}

impl Body {
    /// The same, at its place to 0.01°, with its light to a 256th of a doubling.
    fn rounded(&self) -> Self {
        let round = |radians: f64| (radians.to_degrees() * 100.0).round() / 100.0;
        let (azimuth, elevation) = (self.direction.z.atan2(self.direction.x), self.direction.y.clamp(-1.0, 1.0).asin());
        let lux = if self.lux > 0.0 { (doublings(self.lux) as f64 / STEPS_PER_DOUBLING).exp2() } else { 0.0 };
        Self { direction: of_angles((round(azimuth), round(elevation))), lux, ..*self }
    }
}

impl RoundedBody {
    fn of(body: &Body) -> Option<Self> {
        let azimuth = body.direction.z.atan2(body.direction.x).to_degrees() * STEPS_PER_DEGREE;
        let elevation = body.direction.y.clamp(-1.0, 1.0).asin().to_degrees() * STEPS_PER_DEGREE;
        (body.lux > 0.0 && body.direction.y > DARK).then(|| Self {
            azimuth: azimuth.round() as i64,
            elevation: elevation.round() as i64,
            doublings_of_lux: doublings(body.lux),
        })
    }

    fn direction(self) -> DVec3 {
        let degrees = |steps: i64| steps as f64 / STEPS_PER_DEGREE;
        of_angles((degrees(self.azimuth), degrees(self.elevation)))
    }

    fn lux(self) -> f64 {
        (self.doublings_of_lux as f64 / STEPS_PER_DOUBLING).exp2()
    }
}

/// Share of the light on the ground that clouds leave.
fn left_by_clouds(clouds: f64) -> f64 {
    1.0 - 0.75 * clouds.powf(3.4)
}

impl SkyLight {
    /// Light of a body through air and clouds.
    ///
    /// The body is at its place to 0.01°, and its light is rounded: what follows from a light that a date moves has not to
    /// be found again in each step.
    pub(crate) fn through(body: &Body, weather: &Weather) -> Self {
        let body = &body.rounded();
        let passed = left_by_clouds(weather.clouds) * (1.0 - weather.clouds * weather.clouds);
        let clear = air(doublings(weather.haze)).transmittance(body.direction.y);
        Self { direction: body.direction, illuminance: clear * (body.lux * passed), radius: body.radius }
    }
}

/// Radiance of a clear sky by one body: a table over the azimuth from it and the elevation, finer near the horizon.
struct ClearSky {
    source: DVec3,
    table: Vec<DVec3>,
    /// Illuminance of level ground by the body itself, lux.
    direct: DVec3,
}

/// Steps of azimuth from the body, 0 to 180°, and of elevation.
const AZIMUTHS: usize = 64;
const ELEVATIONS: usize = 64;

impl ClearSky {
    fn new(body: RoundedBody, air: &Atmosphere) -> Self {
        let (source, lux) = (body.direction(), body.lux());
        // The table's body stands over +X.
        let upright = DVec3::new(DVec2::new(source.x, source.z).length(), source.y, 0.0);
        let row = |row: usize| {
            let t = row as f64 / (ELEVATIONS - 1) as f64;
            let (up, flat) = (FRAC_PI_2 * t * t).sin_cos();
            let radiance = |column: usize| {
                let (sin, cos) = (PI * column as f64 / (AZIMUTHS - 1) as f64).sin_cos();
                air.radiance(DVec3::new(flat * cos, up, flat * sin), upright) * lux
            };
            (0..AZIMUTHS).map(radiance).collect::<Vec<_>>()
        };
        let table = map_in_parallel((0..ELEVATIONS).collect::<Vec<_>>().into_iter(), row).concat();
        Self { source, table, direct: air.transmittance(source.y) * (lux * source.y.max(0.0)) }
    }

    /// Illuminance by the body itself of a wall that faces it, lux.
    fn on_wall(&self) -> DVec3 {
        let DVec3 { x, y, z } = self.source;
        self.direct * (x.hypot(z) / y.max(1e-3))
    }

    fn radiance(&self, direction: DVec3) -> DVec3 {
        let (flat, toward) = (DVec2::new(direction.x, direction.z), DVec2::new(self.source.x, self.source.z));
        let between = flat.perp_dot(toward).abs().atan2(flat.dot(toward));
        let column = between / PI * (AZIMUTHS - 1) as f64;
        let elevation = direction.y.clamp(0.0, 1.0).asin();
        let row = (elevation / FRAC_PI_2).sqrt() * (ELEVATIONS - 1) as f64;
        let (x, y) = ((column as usize).min(AZIMUTHS - 2), (row as usize).min(ELEVATIONS - 2));
        let (dx, dy) = (column - x as f64, row - y as f64);
        let at = |x: usize, y: usize| self.table[y * AZIMUTHS + x];
        at(x, y).lerp(at(x + 1, y), dx).lerp(at(x, y + 1).lerp(at(x + 1, y + 1), dx), dy)
    }
}

impl Sky {
    /// Illuminance by the upper half of a surface with that normal, by three bands: lux. The lower half is even.
    pub fn upper(&self, normal: DVec3) -> DVec3 {
        let lower = self.ground * (PI * (0.5 - 0.5 * normal.y));
        (self.harmonics.irradiance(normal) - lower).max(DVec3::ZERO)
    }

    /// Luminance of the upper half toward a direction: that of the nearest texel, cd/m².
    pub fn luminance(&self, direction: DVec3) -> f64 {
        let [x, y] = in_hemisphere(direction).to_array().map(|at| {
            let texel = ((at + 1.0) * 0.5 * SIDE as f64) as usize;
            texel.min(SIDE - 1)
        });
        let [r, g, b, _] = self.map.hemisphere[y * SIDE + x].map(|bits| f16::from_bits(bits).to_f64());
        DVec3::new(r, g, b).dot(LUMINANCE) * self.map.unit
    }

    /// Sky of a weather, with sun and moon at their places to a twentieth of a degree.
    pub(crate) fn of(weather: &Weather, bodies: &Bodies) -> Arc<Self> {
        let key = SkyKey {
            bodies: [RoundedBody::of(&bodies.sun), RoundedBody::of(&bodies.moon)],
            doublings_of_haze: doublings(weather.haze),
            clouds: (weather.clouds * STEPS_OF_CLOUDS).round() as i64,
            glow: weather.glow.to_bits(),
        };
        shared(&MADE, key, |key| Self::new(*key))
    }

    fn new(key: SkyKey) -> Self {
        let air = air(key.doublings_of_haze);
        let clouds = key.clouds as f64 / STEPS_OF_CLOUDS;
        let left = left_by_clouds(clouds);
        let texels: Vec<(DVec3, f64)> = (0..SIDE * SIDE)
            .map(|i| {
                let at = middle(i, SIDE);
                (hemisphere(at), solid_angle(at, SIDE))
            })
            .collect();
        let clear: Vec<ClearSky> = key.bodies.into_iter().flatten().map(|body| ClearSky::new(body, &air)).collect();
        // Factor of each clear sky, and the zenith's luminance of the overcast one.
        let (mut factors, mut zenith, mut direct) = (Vec::new(), 0.0, DVec3::ZERO);
        for sky in &clear {
            let diffuse: DVec3 = texels.iter().map(|&(at, angle)| sky.radiance(at) * (at.y * angle)).sum();
            let (diffuse, beam) = (diffuse.dot(LUMINANCE), sky.direct.dot(LUMINANCE));
            let of_sky = left * (diffuse + beam * clouds * clouds);
            factors.push(if diffuse > 0.0 { (1.0 - clouds) * of_sky / diffuse } else { 0.0 });
            zenith += clouds * of_sky * 9.0 / (7.0 * PI);
            direct += sky.direct * (left * (1.0 - clouds * clouds));
        }
        let glow = f64::from_bits(key.glow);
        let radiance = |at: DVec3| {
            let clear: DVec3 = clear.iter().zip(&factors).map(|(sky, &factor)| sky.radiance(at) * factor).sum();
            clear + zenith * (1.0 + 2.0 * at.y) / 3.0 + glow
        };
        let rows = map_in_parallel(texels.chunks(SIDE), |row: &[(DVec3, f64)]| {
            row.iter().map(|&(at, _)| radiance(at)).collect::<Vec<_>>()
        });
        let (upper, mut harmonics, mut diffuse) = (rows.concat(), Harmonics::default(), DVec3::ZERO);
        for (&(at, angle), &radiance) in texels.iter().zip(&upper) {
            harmonics.add(at, radiance, angle);
            diffuse += radiance * (at.y * angle);
        }
        let ground = (diffuse + direct) * (GROUND_ALBEDO / PI);
        for &(at, angle) in &texels {
            harmonics.add(DVec3::new(at.x, -at.y, at.z), ground, angle);
        }
        let wall: DVec3 = clear.iter().map(|sky| sky.on_wall() * (left * (1.0 - clouds * clouds))).sum();
        let half_sky = diffuse.dot(LUMINANCE) / 2.0;
        let ground_light = (diffuse + direct).dot(LUMINANCE);
        let daylight = (ground_light + wall.dot(LUMINANCE) + half_sky) / 2.0;
        // Half floats end at 65,504: white ground is 1, the brightest sky some 100.
        let unit = (ground_light / PI).max(f64::MIN_POSITIVE);
        let both = |at: DVec3| if at.y < 0.0 { ground } else { radiance(at) };
        let map = SkyMap {
            hemisphere: packed(&upper, unit),
            sphere: prefilter::levels(both).map(|level| packed(&level, unit)),
            unit,
        };
        Self { harmonics, map, ground, daylight }
    }
}

fn packed(texels: &[DVec3], unit: f64) -> Vec<SkyTexel> {
    let pack = |texel: &DVec3| {
        let [r, g, b] = (*texel / unit).min(DVec3::splat(65_504.0)).to_array().map(|c| f16::from_f64(c).to_bits());
        [r, g, b, f16::ONE.to_bits()]
    };
    texels.iter().map(pack).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ecs::parallel::set_threads;
    use crate::weather::weather::SkyModel;

    /// Powers of two, and degrees in whole twentieths: rounding changes neither.
    const LUX: f64 = 131_072.0;
    const HAZE: f64 = 32_768.0;

    fn body(elevation: f64) -> Body {
        let ((east, north), (up, flat)) = (30f64.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        Body { direction: DVec3::new(flat * north, up, flat * east), lux: LUX, radius: 0.004_65 }
    }

    /// A sky under that sun and no moon, without light of its own, and the sun's light.
    fn sky(elevation: f64, clouds: f64) -> (Arc<Sky>, SkyLight) {
        set_threads(None);
        let weather = Weather { sky: SkyModel::Atmosphere, haze: HAZE, clouds, glow: 0.0, ..Weather::default() };
        let moon = Body { direction: DVec3::NEG_Y, lux: 0.0, radius: 0.0 };
        let bodies = Bodies { sun: body(elevation), moon };
        (Sky::of(&weather, &bodies), SkyLight::through(&bodies.sun, &weather))
    }

    fn color(texel: &SkyTexel) -> DVec3 {
        let [r, g, b] = [0, 1, 2].map(|i| f16::from_bits(texel[i]).to_f64());
        DVec3::new(r, g, b)
    }

    /// Directions of the upper half, their solid angles and radiances.
    fn texels(sky: &Sky) -> Vec<(DVec3, f64, DVec3)> {
        let texel = |(i, texel): (usize, &SkyTexel)| {
            let at = middle(i, SIDE);
            (hemisphere(at), solid_angle(at, SIDE), color(texel) * sky.map.unit)
        };
        sky.map.hemisphere.iter().enumerate().map(texel).collect()
    }

    /// Irradiance of level ground by the upper half.
    fn by_sky(sky: &Sky) -> DVec3 {
        texels(sky).into_iter().map(|(at, angle, radiance)| radiance * (at.y * angle)).sum()
    }

    #[test]
    fn without_clouds_it_is_the_clear_sky() {
        let (sky, sun) = sky(40.0, 0.0);
        let air = air(doublings(HAZE));
        let rounded = RoundedBody::of(&body(40.0)).expect("above the horizon");
        let clear = ClearSky::new(rounded, &air);
        for (at, _, radiance) in texels(&sky) {
            let expected = clear.radiance(at);
            // Half floats have 11 bits.
            assert!(radiance.abs_diff_eq(expected, 1e-3 * expected.max_element()), "{at}: {radiance} for {expected}");
        }
        let passed = air.transmittance(40f64.to_radians().sin()) * LUX;
        assert!(sun.illuminance.abs_diff_eq(passed, 1e-9 * LUX), "{} for {passed}", sun.illuminance);
    }

    #[test]
    fn a_whole_cover_is_grey_and_three_times_as_bright_above() {
        let (sky, sun) = sky(40.0, 1.0);
        assert_eq!(sun.illuminance, DVec3::ZERO);
        let texels = texels(&sky);
        assert!(texels.iter().all(|(_, _, radiance)| radiance.x == radiance.y && radiance.y == radiance.z));
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        texels.iter().for_each(|(_, _, radiance)| (least, most) = (least.min(radiance.y), most.max(radiance.y)));
        // The middle of a texel at the horizon is up to 0.32° above it: 1.1 %.
        assert!((most / least / 3.0 - 1.0).abs() < 0.02, "{most} : {least}");
        // L = L_zenith (1 + 2 sin γ) / 3 gives level ground 7π/9 L_zenith.
        let ratio = by_sky(&sky).y / most / (7.0 * PI / 9.0);
        // Half floats, and texels for an integral.
        assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
    }

    /// Kasten and Czeplak's share, whatever of it comes from the sun itself.
    #[test]
    fn clouds_leave_their_share_of_the_light_on_level_ground() {
        let on_ground = |clouds: f64| {
            let (sky, sun) = sky(40.0, clouds);
            (by_sky(&sky) + sun.illuminance * 40f64.to_radians().sin()).dot(LUMINANCE)
        };
        let clear = on_ground(0.0);
        let mut last = clear;
        for clouds in [0.25, 0.5, 0.75, 1.0] {
            let (found, expected) = (on_ground(clouds), clear * (1.0 - 0.75 * f64::powf(clouds, 3.4)));
            // Half floats, 0.1 % of each.
            assert!((found / expected - 1.0).abs() < 5e-3, "{clouds}: {found} for {expected}");
            assert!(found < last, "{clouds}: {found}");
            last = found;
        }
    }

    /// By day, in twilight and at night without any light.
    #[test]
    fn skies_are_finite_and_not_negative_wherever_the_sun_is() {
        for elevation in [-90.0, -18.0, -17.9, -6.0, -0.3, 0.0, 0.3, 5.0, 90.0] {
            let (sky, sun) = sky(elevation, 0.5);
            let is_light = |light: DVec3| light.is_finite() && light.min_element() >= 0.0;
            let all = sky.map.sphere.iter().flatten().chain(&sky.map.hemisphere);
            assert!(all.map(color).all(is_light), "{elevation}°");
            assert!(is_light(sky.ground) && is_light(sun.illuminance), "{elevation}°: {:?}, {sun:?}", sky.ground);
            assert!(sky.harmonics.0.iter().all(|own| own.is_finite()), "{elevation}°: {:?}", sky.harmonics);
            assert!(sky.daylight.is_finite() && sky.daylight >= 0.0, "{elevation}°: {}", sky.daylight);
            assert!(sky.map.unit.is_finite() && sky.map.unit > 0.0, "{elevation}°: {}", sky.map.unit);
            assert!(elevation > -18.0 || sky.daylight == 0.0, "{elevation}°: {}", sky.daylight);
            assert!(elevation < -6.0 || sky.daylight > 0.0, "{elevation}°: {}", sky.daylight);
        }
    }

    /// Three bands leave out the fourth and sixth; odd ones beyond the first add nothing to irradiance.
    #[test]
    fn harmonics_give_level_ground_the_light_of_the_map() {
        // The kernel of three bands is within 0.06 of the cosine above, and 0.09 more at the horizon. There is the light
        // of a low sun's sky, several times as bright as above. That of an overcast sky is 0.45 % off.
        for (elevation, clouds, bound) in [(40.0, 0.0, 0.04), (5.0, 0.0, 0.15), (40.0, 1.0, 0.01)] {
            let (sky, _) = sky(elevation, clouds);
            let (found, expected) = (sky.harmonics.irradiance(DVec3::Y), by_sky(&sky));
            let error = (found / expected - 1.0).abs().max_element();
            assert!(error < bound, "{elevation}°, {clouds}: {found} for {expected}");
        }
    }

    #[test]
    fn the_lower_half_is_the_ground() {
        let (sky, sun) = sky(40.0, 0.0);
        let lit = by_sky(&sky) + sun.illuminance * 40f64.to_radians().sin();
        let expected = lit * (GROUND_ALBEDO / PI);
        // Half floats.
        assert!(sky.ground.abs_diff_eq(expected, 2e-3 * expected.max_element()), "{} for {expected}", sky.ground);
        let [.., corner] = sky.map.sphere[0].as_slice() else { panic!("no texels") };
        let down = color(corner) * sky.map.unit;
        assert!(down.abs_diff_eq(sky.ground, 1e-3 * expected.max_element()), "{down} for {}", sky.ground);
    }
}
