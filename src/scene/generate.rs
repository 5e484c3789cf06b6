//! Generators: many copies of one kind of entity on a grid, or scattered over a region.
//!
//! Everything here is additions, multiplications and square roots, which IEEE 754 rounds the same everywhere: a seed
//! gives the same scene to the last bit on every platform. (Sines and cosines do not.)

use super::format::{Choose, Generator, Grid, Place, Region, Scatter};
use super::values::place;
use super::vehicles::{self, OnRoute};
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use std::collections::HashMap;
use systems::space::Transform;

/// SplitMix64 (Steele, Lea, Flood: "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014; constants of
/// Vigna's public domain `splitmix64.c`): 64 bits of state, fine for placing things, not for secrets.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 ≤ x < 1, in steps of 2⁻²⁴.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn between(&mut self, min: f32, max: f32) -> f32 {
        min + (max - min) * self.unit()
    }

    fn in_box(&mut self, min: Vec3, max: Vec3) -> Vec3 {
        Vec3::new(self.between(min.x, max.x), self.between(min.y, max.y), self.between(min.z, max.z))
    }

    /// Even over the unit disc in XZ, by rejection.
    fn in_disc(&mut self) -> Vec3 {
        loop {
            let at = self.in_box(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.0, 1.0));
            if at.length_squared() <= 1.0 {
                return at;
            }
        }
    }

    /// A turn about Y, evenly distributed: the half angle's cosine and sine are a random direction.
    fn yaw(&mut self) -> Quat {
        loop {
            let at = self.in_disc();
            if at.length_squared() > 1e-4 {
                let half = at.normalize();
                return Quat::from_xyzw(0.0, half.z, 0.0, half.x);
            }
        }
    }

    /// One of `count` alternatives, evenly (to 2⁻³²); 0 for none.
    fn index(&mut self, count: usize) -> usize {
        (((self.bits() >> 32) * count as u64) >> 32) as usize
    }
}

/// One copy: where it is, and which alternatives it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Copy {
    pub at: Transform,
    pub mesh: usize,
    pub material: usize,
    pub light: usize,
    pub vehicle: usize,
    /// Where it drives, if it was placed along a route.
    pub on_route: Option<OnRoute>,
}

/// The copies of a generator in order; fewer than asked for where `min_distance` leaves no room.
pub fn copies(generator: &Generator, scene_seed: u64, world: &World) -> Vec<Copy> {
    let mut random = Random::new(generator.seed.unwrap_or(scene_seed));
    let standing = Transform::from_translation;
    let mut on_routes = Vec::new();
    let places: Vec<Transform> = match &generator.place {
        Place::Grid(grid) => on_grid(grid, &mut random).into_iter().map(standing).collect(),
        Place::Scatter(scatter) => scattered(scatter, &mut random).into_iter().map(standing).collect(),
        Place::Along(along) => {
            let places = vehicles::along(along, world, &mut random);
            on_routes.extend(places.iter().map(|place| place.1));
            places.into_iter().map(|place| place.0).collect()
        }
    };
    let [min_scale, max_scale] = generator.random_scale;
    let (meshes, materials, lights) = (generator.meshes.len(), generator.materials.len(), generator.lights.len());
    let vehicles = generator.vehicles.len();
    let finish = |(i, place): (usize, Transform)| {
        let rotation = if generator.random_yaw { random.yaw() } else { Quat::IDENTITY };
        let scale = Vec3::splat(random.between(min_scale, max_scale));
        let at = Transform { rotation: place.rotation * rotation, scale, ..place };
        let on_route = on_routes.get(i).copied();
        match generator.choose {
            // Materials turn when the meshes have been through, so that every pair of the two comes up.
            Choose::InTurn => Copy {
                at,
                mesh: i % meshes.max(1),
                material: i / meshes.max(1) % materials.max(1),
                light: i % lights.max(1),
                vehicle: i % vehicles.max(1),
                on_route,
            },
            Choose::Random => Copy {
                at,
                mesh: random.index(meshes),
                material: random.index(materials),
                light: random.index(lights),
                vehicle: if vehicles > 0 { random.index(vehicles) } else { 0 },
                on_route,
            },
        }
    };
    places.into_iter().enumerate().map(finish).collect()
}

/// Rows along X, then Z, then Y, around the centre.
fn on_grid(grid: &Grid, random: &mut Random) -> Vec<Vec3> {
    let [nx, ny, nz] = grid.counts;
    let (spacing, center) = (Vec3::from_array(grid.spacing), place(grid.center.unwrap_or_default()));
    let jitter = Vec3::from_array(grid.jitter);
    let middle = (Vec3::new(nx as f32, ny as f32, nz as f32) - 1.0) * 0.5;
    let mut places = Vec::with_capacity(nx as usize * ny as usize * nz as usize);
    for y in 0..ny {
        for z in 0..nz {
            for x in 0..nx {
                let cell = Vec3::new(x as f32, y as f32, z as f32) - middle;
                places.push(center + cell * spacing + random.in_box(-jitter, jitter));
            }
        }
    }
    places
}

/// Points thrown at random; one too near to an earlier one is thrown again. Gives up after this many in a row.
const MOST_THROWS: u32 = 1000;

fn scattered(scatter: &Scatter, random: &mut Random) -> Vec<Vec3> {
    let mut throw = || match &scatter.region {
        Region::Box { min, max } => random.in_box(place(*min), place(*max)),
        Region::Disc { center, radius } => place(*center) + random.in_disc() * *radius,
    };
    let distance = scatter.min_distance;
    if distance <= 0.0 {
        return (0..scatter.count).map(|_| throw()).collect();
    }
    let mut cells: HashMap<[i64; 3], Vec<Vec3>> = HashMap::new();
    let cell = |at: Vec3| (at / distance).floor().to_array().map(|c| c as i64);
    let mut places = Vec::new();
    let mut throws = 0;
    while places.len() < scatter.count as usize && throws < MOST_THROWS {
        let at = throw();
        throws += 1;
        let [x, y, z] = cell(at);
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])));
        let mut near = around.filter_map(|key| cells.get(&key)).flatten();
        if near.all(|other| other.distance(at) >= distance) {
            cells.entry([x, y, z]).or_default().push(at);
            places.push(at);
            throws = 0;
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_numbers_are_those_of_the_published_generator() {
        let mut random = Random::new(1_234_567);
        let first: Vec<u64> = (0..3).map(|_| random.bits()).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn random_values_fill_their_ranges_evenly() {
        let mut random = Random::new(5);
        let mut counts = [0; 5];
        let mut sum = Vec3::ZERO;
        let mut turned = Vec3::ZERO;
        for _ in 0..10_000 {
            counts[random.index(5)] += 1;
            sum += random.in_disc();
            let yaw = random.yaw();
            assert!((yaw.length() - 1.0).abs() < 1e-6);
            turned += yaw * Vec3::X;
        }
        assert!(counts.iter().all(|c| (1850..2150).contains(c)), "{counts:?}");
        assert!(sum.length() < 200.0 && turned.length() < 300.0, "{sum} {turned}");
        assert_eq!(random.index(0), 0);
    }
}
