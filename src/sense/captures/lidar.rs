//! Measurements of a lidar: arrays with an element per beam.

use super::pose::Pose;
use glam::{DAffine3, Vec3};
use systems::sensors::Columns;

/// Returns of the beams of some columns: arrays with an element per beam, column after column, in each by ring. Where a
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
    /// Number of beams.
    pub fn len(&self) -> usize {
        self.hit.len()
    }

    /// Tells if there are none.
    pub fn is_empty(&self) -> bool {
        self.hit.is_empty()
    }

    /// Values of beams that came back, of one for each beam.
    pub(crate) fn returns<T: Copy>(&self, values: &[T]) -> Vec<T> {
        self.hit.iter().zip(values).filter(|(hit, _)| **hit == 1).map(|(_, value)| *value).collect()
    }

    /// Empty, with room for so many beams.
    pub(crate) fn with_room(beams: usize) -> Self {
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

    /// Adds a beam.
    pub(crate) fn push(&mut self, beam: Return, ring: u16, time: f32) {
        let Return { xyz, range, intensity, entity, hit } = beam;
        self.xyz.push(xyz.into());
        self.range.push(range);
        self.intensity.push(intensity);
        self.ring.push(ring);
        self.time.push(time);
        self.entity.push(entity);
        self.hit.push(hit.into());
    }

    /// Adds the beams of another.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.xyz.append(&mut other.xyz);
        self.range.append(&mut other.range);
        self.intensity.append(&mut other.intensity);
        self.ring.append(&mut other.ring);
        self.time.append(&mut other.time);
        self.entity.append(&mut other.entity);
        self.hit.append(&mut other.hit);
    }
}

/// Return of a beam.
pub(crate) struct Return {
    pub xyz: Vec3,
    pub range: f32,
    pub intensity: f32,
    pub entity: u32,
    pub hit: bool,
}

impl Return {
    /// Values of a beam without one.
    pub const NONE: Self = Self { xyz: Vec3::ZERO, range: 0.0, intensity: 0.0, entity: u32::MAX, hit: false };
}

/// Measurements of a lidar since it was due before: arrays with an element per beam.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LidarCapture {
    /// Returns of the beams.
    pub scan: LidarScan,
    /// Numbers of things; 0 where there is no return.
    pub instance: Vec<u32>,
    /// Semantic classes; 0 where there is none.
    pub class: Vec<u8>,
    /// The columns that were fired.
    pub columns: Columns,
    /// Nanoseconds of the clock when the first of them was fired, which [`LidarScan::time`] counts from; those of the
    /// capture where none was.
    pub nanoseconds: u64,
    /// True if each column was fired from where the sensor was at its time: [`LidarSensor::sweep`].
    ///
    /// [`LidarSensor::sweep`]: systems::sensors::LidarSensor::sweep
    pub sweep: bool,
    /// Poses of the sensor when their interval began and ended, in the scene's coordinates; of one that does not sweep
    /// twice the same.
    pub poses: [Pose; 2],
    /// True if the first of these is that of the capture before, rather than as if it had stood still: not so of what
    /// does not sweep, at the begin of a run, after a snapshot and over a jump.
    pub is_before_known: bool,
}

impl LidarCapture {
    /// From the points of a column, which have the axes of its own, to the scene's coordinates.
    pub fn scene_from_column(&self, i: u64) -> DAffine3 {
        self.poses[0].toward(&self.poses[1], self.columns.fraction(i)).world_from_points()
    }

    /// Number of beams in a column.
    pub fn rings(&self) -> usize {
        self.scan.len() / (self.columns.count as usize).max(1)
    }
}
