//! Lidar: the beams of a [`LidarSensor`] through a [`RayScene`].
//!
//! Beams are traced by columns, in parts of the same size whatever the number of threads. Each beam is a function of
//! the scene, its column's pose and its number: so all threads together make the bytes that one makes.

use super::objects::WorldRay;
use super::scene::{Guess, RayScene};
use crate::sense::captures::lidar::{LidarScan, Return};
use crate::sense::captures::pose::Pose;
use bevy_tasks::{ComputeTaskPool, TaskPool};
use glam::{DAffine3, DMat3, DVec3};
use systems::ecs::parallel::map_on_pool;
use systems::sensors::philox::{Noise, normal, uniform};
use systems::sensors::{Beam, Columns, LidarNoise, LidarSensor};
use systems::space::box_tree::Open;

/// Columns that a thread takes at a time.
const PART: u64 = 16;
/// The channel of a lidar's random numbers.
const CHANNEL: u32 = 0;

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
/// [sweep](LidarSensor::sweep) alone. The sensor is to be without [faults](systems::describe::faults).
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
