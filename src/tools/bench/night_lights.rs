//! Objects and lights of a night, for the choice of lights: scattered evenly, or along the roads of a city.

use crate::scene::Random;
use glam::{Quat, Vec3};
use std::f32::consts::{PI, TAU};
use systems::lights::{Light, LightKind, LightRecord, light_record};
use systems::space::{Sphere, Transform};

/// Blocks of the city, metres.
const BLOCK: f32 = 100.0;
/// Time between two frames, seconds.
const FRAME: f32 = 1.0 / 60.0;

/// Spheres and lights, and how each moves.
#[derive(Clone, Debug, Default)]
pub struct NightLights {
    /// Bounds of the objects, world space.
    pub objects: Vec<Sphere>,
    /// Metres per second.
    pub object_velocities: Vec<Vec3>,
    /// Lights and where they are.
    pub lights: Vec<(Light, Transform)>,
    /// Metres per second.
    pub light_velocities: Vec<Vec3>,
}

impl NightLights {
    /// Objects and lights at random on 10 km × 10 km, a third of the lights spots; about thirteen lights reach an
    /// object whatever their number.
    pub fn scattered(objects: usize, lights: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let width = 10_000.0;
        let reach = width * (16.0 / (PI * 1.0833 * lights.max(1) as f32)).sqrt();
        let mut night = Self::default();
        for i in 0..objects {
            let center = Vec3::new(random.between(0.0, width), random.between(0.0, 10.0), random.between(0.0, width));
            let heading = random.between(0.0, TAU);
            let speed = if i % 5 == 0 { 18.0 } else { 0.0 };
            night.objects.push(Sphere { center, radius: random.between(0.3, 2.0) });
            night.object_velocities.push(Vec3::new(heading.cos(), 0.0, heading.sin()) * speed);
        }
        for _ in 0..lights {
            let place = Vec3::new(random.between(0.0, width), random.between(2.0, 8.0), random.between(0.0, width));
            let range = reach * random.between(0.5, 1.5);
            let intensity = random.between(-1.2, 1.2).exp();
            let heading = random.between(0.0, TAU);
            let forward = Vec3::new(heading.cos(), -0.15, heading.sin());
            let attenuation = Vec3::new(1.0, 2.0 / range, 40.0 / (range * range));
            let mut light = Light { attenuation, ..Light::point(intensity, range) };
            if random.unit() < 0.33 {
                let outer = random.between(0.35, 1.0);
                light.kind = LightKind::Spot { outer, inner: None, exponent: random.between(0.0, 8.0) };
                light.range *= 1.5;
                light.intensity *= 3.0;
            }
            night.lights.push((light, looking(place, forward)));
            night.light_velocities.push(Vec3::new(heading.cos(), 0.0, heading.sin()) * 18.0);
        }
        night
    }

    /// A city: a road every 100 m, a street lamp on every 30 m of road for a fifth of the lights, the others in fours
    /// on vehicles, two head lamps and two tail lamps. Objects are vehicles, people and things beside the roads, in
    /// random order.
    pub fn city(objects: usize, lights: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let vehicles = lights / 5;
        let lamps = lights - 4 * vehicles;
        let width = (lamps as f32 * 30.0 * BLOCK * 0.5).sqrt().max(2.0 * BLOCK);
        let mut night = Self::default();
        for i in 0..vehicles {
            let (place, forward) = on_road(&mut random, width, if i % 2 == 0 { 2.0 } else { 5.0 });
            let velocity = forward * random.between(5.0, 20.0);
            night.add_lamps(place, forward, velocity);
            if night.objects.len() < objects {
                night.add_object(Sphere { center: place + Vec3::Y * 0.8, radius: 2.3 }, velocity);
            }
        }
        for _ in 0..lamps {
            let (place, _) = on_road(&mut random, width, 8.0);
            let kind = LightKind::Spot { outer: 1.3, inner: None, exponent: 1.0 };
            let lamp = Light { kind, attenuation: Vec3::new(1.0, 0.05, 0.05), ..Light::point(20.0, 30.0) };
            night.lights.push((lamp, looking(place + Vec3::Y * 8.0, Vec3::NEG_Y)));
            night.light_velocities.push(Vec3::ZERO);
        }
        while night.objects.len() < objects {
            // One in five moves; the others stand up to 45 m back from the road.
            if night.objects.len() % 5 == 0 {
                let lane = random.between(0.0, 9.0);
                let (place, forward) = on_road(&mut random, width, lane);
                let center = place + Vec3::Y * random.between(0.3, 1.8);
                let velocity = forward * random.between(1.0, 15.0);
                night.add_object(Sphere { center, radius: random.between(0.3, 1.5) }, velocity);
            } else {
                let lane = 8.0 + 37.0 * random.unit() * random.unit();
                let (place, _) = on_road(&mut random, width, lane);
                let center = place + Vec3::Y * random.between(0.0, 15.0);
                night.add_object(Sphere { center, radius: random.between(0.3, 3.0) }, Vec3::ZERO);
            }
        }
        night.shuffle(&mut random);
        night
    }

    fn add_object(&mut self, sphere: Sphere, velocity: Vec3) {
        self.objects.push(sphere);
        self.object_velocities.push(velocity);
    }

    fn add_lamps(&mut self, place: Vec3, forward: Vec3, velocity: Vec3) {
        let side = forward.cross(Vec3::Y);
        for offset in [-0.7, 0.7] {
            let head = Light {
                kind: LightKind::Spot { outer: 0.55, inner: None, exponent: 4.0 },
                attenuation: Vec3::new(1.0, 0.05, 0.02),
                ..Light::point(30.0, 60.0)
            };
            let tail = Light { attenuation: Vec3::new(1.0, 0.3, 0.3), ..Light::point(0.8, 8.0) }
                .with_color(Vec3::new(1.0, 0.1, 0.05));
            let beside = place + side * offset;
            self.lights.push((head, looking(beside + forward * 2.0 + Vec3::Y * 0.7, forward - Vec3::Y * 0.06)));
            self.lights.push((tail, looking(beside - forward * 2.0 + Vec3::Y * 0.9, -forward)));
            self.light_velocities.extend([velocity; 2]);
        }
    }

    /// In a world, the order of entities says nothing of their places.
    fn shuffle(&mut self, random: &mut Random) {
        for i in (1..self.objects.len()).rev() {
            let j = (random.unit() * i as f32) as usize;
            self.objects.swap(i, j);
            self.object_velocities.swap(i, j);
        }
    }

    /// The records of the lights where they are now.
    pub fn records(&self) -> Vec<LightRecord> {
        self.lights.iter().map(|(light, transform)| light_record(light, &(*transform).into())).collect()
    }

    /// Moves some objects and lights on by a frame.
    pub fn advance(&mut self, movers: &Movers) {
        for &i in &movers.objects {
            self.objects[i].center += self.object_velocities[i] * FRAME;
        }
        for &i in &movers.lights {
            self.lights[i].1.translation += self.light_velocities[i] * FRAME;
        }
    }

    /// All objects and lights, also those that stand.
    pub fn all(&self) -> Movers {
        Movers { objects: (0..self.objects.len()).collect(), lights: (0..self.lights.len()).collect() }
    }

    /// One in so many objects and lights, all of them with a velocity: evenly spread over the world, of vehicles all
    /// lamps or none.
    pub fn some(&self, part: usize) -> Movers {
        let spread = |velocities: &[Vec3], together: usize| {
            let moving: Vec<usize> = (0..velocities.len()).filter(|&i| velocities[i] != Vec3::ZERO).collect();
            let count = velocities.len() / part / together;
            let step = (moving.len() / together / count.max(1)).max(1);
            moving.chunks(together).step_by(step).take(count).flatten().copied().collect()
        };
        Movers { objects: spread(&self.object_velocities, 1), lights: spread(&self.light_velocities, 4) }
    }

    /// One in so many objects and lights, all of them with a velocity: those next to the middle of the world.
    pub fn district(&self, part: usize) -> Movers {
        let middle = self.objects.iter().map(|object| object.center).sum::<Vec3>() / self.objects.len().max(1) as f32;
        let nearest = |velocities: &[Vec3], place: &dyn Fn(usize) -> Vec3| {
            let mut moving: Vec<usize> = (0..velocities.len()).filter(|&i| velocities[i] != Vec3::ZERO).collect();
            moving.sort_by(|&i, &j| place(i).distance(middle).total_cmp(&place(j).distance(middle)));
            moving.truncate(velocities.len() / part);
            moving
        };
        Movers {
            objects: nearest(&self.object_velocities, &|i| self.objects[i].center),
            lights: nearest(&self.light_velocities, &|i| self.lights[i].1.translation),
        }
    }
}

/// Objects and lights that move in a frame.
#[derive(Clone, Debug, Default)]
pub struct Movers {
    /// Places in [`NightLights::objects`].
    pub objects: Vec<usize>,
    /// Places in [`NightLights::lights`].
    pub lights: Vec<usize>,
}

fn looking(place: Vec3, forward: Vec3) -> Transform {
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, forward.normalize());
    Transform { translation: place, rotation, scale: Vec3::ONE }
}

/// A place beside the middle of some road, and the direction of traffic there.
fn on_road(random: &mut Random, width: f32, lane: f32) -> (Vec3, Vec3) {
    let roads = (width / BLOCK).floor().max(1.0) + 1.0;
    let road = (random.unit() * roads).floor().min(roads - 1.0) * BLOCK;
    let along = random.between(0.0, width);
    let sign = if random.unit() < 0.5 { 1.0 } else { -1.0 };
    if random.unit() < 0.5 {
        (Vec3::new(along, 0.0, road + sign * lane), Vec3::X * sign)
    } else {
        (Vec3::new(road - sign * lane, 0.0, along), Vec3::Z * sign)
    }
}
