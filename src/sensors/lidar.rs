//! Lidar: the beams of a [`LidarSensor`] through a [`RayScene`].
//!
//! Beams are traced by columns, in parts of the same size whatever the number of threads. Each beam is a function of
//! the scene, its column's pose and its number: so all threads together make the bytes that one makes.

use super::ray_objects::WorldRay;
use super::rays::{Guess, RayScene};
use crate::box_tree::Open;
use bevy_tasks::{ComputeTaskPool, TaskPool};
use glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};
use systems::draw::rigid;
use systems::ecs::parallel::map_on_pool;
use systems::sensors::philox::{Noise, normal, uniform};
use systems::sensors::{Beam, Columns, LidarNoise, LidarSensor};
use systems::space::GlobalTransform;

/// Columns that a thread takes at a time.
const PART: u64 = 16;
/// The channel of a lidar's random numbers.
const CHANNEL: u32 = 0;

/// Where a sensor's entity is and how it is turned: `world_from_sensor`, with Y up and Z forward.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Pose {
    /// World space, metres.
    pub translation: DVec3,
    /// Of unit length.
    pub rotation: DQuat,
}

impl Pose {
    /// That of an entity, without scale, mirror and shear, as cameras are placed.
    pub fn of(place: &GlobalTransform) -> Self {
        let upright = rigid(&place.affine());
        let rotation = Quat::from_mat3a(&upright.matrix3).as_dquat().normalize();
        Self { translation: upright.translation.as_dvec3(), rotation }
    }

    /// As seen from coordinates that count from so much further back.
    #[must_use]
    pub fn moved(self, origin: DVec3) -> Self {
        Self { translation: self.translation + origin, ..self }
    }

    /// Between this one (0) and another (1): straight ahead, and turned evenly by the shorter way.
    #[must_use]
    pub fn toward(&self, other: &Self, fraction: f64) -> Self {
        Self {
            translation: self.translation.lerp(other.translation, fraction),
            rotation: self.rotation.slerp(other.rotation, fraction),
        }
    }

    /// Where a column is fired from, of a lidar that is at the two poses when its columns' interval begins and ends.
    #[must_use]
    pub fn of_column(poses: &[Self; 2], lidar: &LidarSensor, columns: &Columns, i: u64) -> Self {
        if lidar.sweep { poses[0].toward(&poses[1], columns.fraction(i)) } else { poses[1] }
    }

    /// From the entity's axes to places in the world.
    pub fn world_from_entity(&self) -> DAffine3 {
        DAffine3::from_rotation_translation(self.rotation, self.translation)
    }

    /// From a lidar's points (x forward, y left, z up) to places in the world.
    pub fn world_from_points(&self) -> DAffine3 {
        let axes = [DVec3::Z, DVec3::X, DVec3::Y].map(|axis| self.rotation * axis);
        DAffine3::from_cols(axes[0], axes[1], axes[2], self.translation)
    }
}

/// What the beams of some columns met: arrays with an element per beam, column after column, in each by ring. Where a
/// beam has no return, all but its ring and time are 0, and the entity is `u32::MAX`.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LidarScan {
    /// Metres, in the sensor's axes when the column was fired: forward, left, up.
    pub xyz: Vec<[f32; 3]>,
    /// Metres along the beam.
    pub range: Vec<f32>,
    /// Albedo · cos θ · e^(−attenuation · range), 0 to 1: θ is the angle of incidence.
    pub intensity: Vec<f32>,
    /// The beam's place in its column.
    pub ring: Vec<u16>,
    /// Seconds since the first column.
    pub time: Vec<f32>,
    /// Index of the entity, of a piece its object's: [`InstanceRecord::entity`](systems::draw::InstanceRecord::entity).
    pub entity: Vec<u32>,
    /// 1 where there is a return, else 0.
    pub hit: Vec<u8>,
}

impl LidarScan {
    /// How many beams there are.
    pub fn len(&self) -> usize {
        self.hit.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.hit.is_empty()
    }

    fn with_room(beams: usize) -> Self {
        Self {
            xyz: Vec::with_capacity(beams),
            range: Vec::with_capacity(beams),
            intensity: Vec::with_capacity(beams),
            ring: Vec::with_capacity(beams),
            time: Vec::with_capacity(beams),
            entity: Vec::with_capacity(beams),
            hit: Vec::with_capacity(beams),
        }
    }

    fn push(&mut self, beam: Return, ring: u16, time: f32) {
        let Return { xyz, range, intensity, entity, hit } = beam;
        self.xyz.push(xyz.into());
        self.range.push(range);
        self.intensity.push(intensity);
        self.ring.push(ring);
        self.time.push(time);
        self.entity.push(entity);
        self.hit.push(hit.into());
    }

    fn append(&mut self, mut other: Self) {
        self.xyz.append(&mut other.xyz);
        self.range.append(&mut other.range);
        self.intensity.append(&mut other.intensity);
        self.ring.append(&mut other.ring);
        self.time.append(&mut other.time);
        self.entity.append(&mut other.entity);
        self.hit.append(&mut other.hit);
    }
}

/// What comes back of a beam.
struct Return {
    xyz: Vec3,
    range: f32,
    intensity: f32,
    entity: u32,
    hit: bool,
}

impl Return {
    const NONE: Self = Self { xyz: Vec3::ZERO, range: 0.0, intensity: 0.0, entity: u32::MAX, hit: false };
}

/// A beam of a column that looks forward.
struct Fired {
    /// In the lidar's axes, unit.
    along: DVec3,
    /// Metres above the sensor.
    height: f64,
    /// Seconds after the column's first.
    delay: f64,
}

impl Fired {
    fn new(beam: &Beam) -> Self {
        let (up, across) = f64::from(beam.elevation_degrees).to_radians().sin_cos();
        let (right, forward) = f64::from(beam.azimuth_degrees).to_radians().sin_cos();
        let along = DVec3::new(forward * across, -right * across, up);
        Self { along, height: beam.height.into(), delay: beam.delay.into() }
    }
}

/// Fires columns. `poses`: where the sensor is when their interval begins and ends; the first counts for lidars that
/// [sweep](LidarSensor::sweep) alone. The sensor is to be without [faults](LidarSensor::check).
pub fn scan(rays: &RayScene, lidar: &LidarSensor, poses: &[Pose; 2], columns: Columns, noise: Noise) -> LidarScan {
    scan_on(ComputeTaskPool::get(), rays, lidar, poses, columns, noise)
}

/// [`scan`] on the threads of a certain pool.
pub fn scan_on(
    pool: &TaskPool,
    rays: &RayScene,
    lidar: &LidarSensor,
    poses: &[Pose; 2],
    columns: Columns,
    noise: Noise,
) -> LidarScan {
    let rings: Vec<Fired> = lidar.beams.rings().iter().map(Fired::new).collect();
    let parts = columns.count.div_ceil(PART) as usize;
    let traced = map_on_pool(pool, 0..parts, |part| {
        let start = part as u64 * PART;
        let mut scan = LidarScan::with_room(PART as usize * rings.len());
        // What the beams of the column before met, by ring: these do so as well, more often than not. It saves time,
        // and changes nothing.
        let (mut guesses, mut open) = (vec![None; rings.len()], Open::default());
        for i in start..(start + PART).min(columns.count) {
            let pose = Pose::of_column(poses, lidar, &columns, i);
            let in_revolution = ((columns.first + i) % u64::from(lidar.columns)) as u32;
            let clockwise = lidar.beams.column_degrees(in_revolution, lidar.columns).to_radians();
            let column = Column {
                world_from_points: pose.world_from_points(),
                turn: DMat3::from_rotation_z(-clockwise),
                first: (i * rings.len() as u64) as u32,
            };
            for ((ring, fired), guess) in (0..).zip(&rings).zip(&mut guesses) {
                let time = i as f64 * columns.seconds + fired.delay;
                let beam = column.trace(rays, lidar, (fired, ring), noise, (guess, &mut open));
                scan.push(beam, ring, time as f32);
            }
        }
        scan
    });
    let mut whole = LidarScan::with_room(traced.iter().map(LidarScan::len).sum());
    traced.into_iter().for_each(|part| whole.append(part));
    whole
}

/// A column as it is fired.
struct Column {
    world_from_points: DAffine3,
    /// From beams of a column that looks forward.
    turn: DMat3,
    /// The number of its first beam in the capture.
    first: u32,
}

impl Column {
    /// `guess`: what may be met; what is met.
    fn trace(
        &self,
        rays: &RayScene,
        lidar: &LidarSensor,
        (fired, ring): (&Fired, u16),
        noise: Noise,
        (guess, open): (&mut Option<Guess>, &mut Open),
    ) -> Return {
        let (along, above) = (self.turn * fired.along, DVec3::Z * fired.height);
        let origin = self.world_from_points.transform_point3(above);
        let direction = self.world_from_points.transform_vector3(along);
        let ray = WorldRay::new(origin, direction, lidar.range);
        let found = rays.find(&ray, *guess, open);
        *guess = found.map(|found| found.guess);
        let Some(met) = found.map(|found| rays.meeting(&ray, &found)) else { return Return::NONE };
        let intensity = met.albedo * met.cosine * (-lidar.attenuation * met.range as f32).exp();
        let mut range = met.range;
        if lidar.noise != LidarNoise::default() {
            let [for_range, for_drop, ..] = noise.words(self.first + u32::from(ring), CHANNEL);
            if uniform(for_drop) < lidar.noise.drop_rate || intensity < lidar.noise.drop_below {
                return Return::NONE;
            }
            range += f64::from(lidar.noise.range_sigma * normal(for_range));
        }
        // What it would measure beyond its own range, it does not report; no distance is 0.
        let (least, most) = lidar.range;
        if !(range as f32 > 0.0 && (least..=most).contains(&(range as f32))) {
            return Return::NONE;
        }
        let xyz = (along * range + above).as_vec3();
        Return { xyz, range: range as f32, intensity, entity: met.entity, hit: true }
    }
}
