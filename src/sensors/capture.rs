//! What sensors measured: a capture of one state.

use super::axes::{ENTITY_FROM_CAMERA, ENTITY_FROM_LIDAR};
use super::camera::CameraCapture;
use super::lidar::{LidarScan, Pose};
use super::motion::{GnssCapture, ImuCapture};
use bevy_ecs::prelude::*;
use glam::DAffine3;
use std::ops::Index;
use systems::sensors::collision::Collision;
use systems::sensors::{Columns, LaneReading};

/// What all sensors that were due measured of one state.
#[derive(Clone, PartialEq, Debug)]
pub struct Capture {
    /// Of the clock.
    pub step: u64,
    /// Since the run began, rounded once: steps times the length of a step.
    pub nanoseconds: u64,
    /// In the order in which the sensors came to be.
    pub sensors: Vec<SensorCapture>,
}

/// What a sensor measured.
#[derive(Clone, PartialEq, Debug)]
pub struct SensorCapture {
    /// The sensor.
    pub entity: Entity,
    /// Its name, below that of what it is mounted on: `ego/front`.
    pub name: String,
    /// From the entity's axes (−Z forward, +Y up) to the scene's coordinates, without scale.
    pub world_from_sensor: DAffine3,
    /// What it measured.
    pub data: SensorData,
}

/// By kind of sensor.
#[derive(Clone, PartialEq, Debug)]
pub enum SensorData {
    /// Of a camera.
    Camera(CameraCapture),
    /// Of a lidar.
    Lidar(LidarCapture),
    /// Of an inertial measurement unit.
    Imu(ImuCapture),
    /// Of a receiver of satellite navigation.
    Gnss(GnssCapture),
    /// What is touched in the captured state, by number.
    Collision(Vec<Collision>),
    /// Of a lane sensor.
    Lane(LaneReading),
}

/// What a lidar measured since it was due before: arrays with an element per beam.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LidarCapture {
    /// What the beams met.
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
    /// Where the sensor was when their interval began and ended, in the scene's coordinates; of one that does not sweep
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

    /// How many beams a column has.
    pub fn rings(&self) -> usize {
        self.scan.len() / (self.columns.count as usize).max(1)
    }
}

impl SensorCapture {
    /// From the axes of its outputs to the scene's coordinates: of a camera X right, Y down, Z forward; of others X
    /// forward, Y left, Z up.
    pub fn world_from_outputs(&self) -> DAffine3 {
        let entity_from_outputs = match self.data {
            SensorData::Camera(_) => ENTITY_FROM_CAMERA,
            _ => ENTITY_FROM_LIDAR,
        };
        self.world_from_sensor * DAffine3::from_mat3(entity_from_outputs)
    }

    /// What a camera captured; `None` of another sensor.
    pub fn camera(&self) -> Option<&CameraCapture> {
        if let SensorData::Camera(camera) = &self.data { Some(camera) } else { None }
    }

    /// What a lidar captured; `None` of another sensor.
    pub fn lidar(&self) -> Option<&LidarCapture> {
        if let SensorData::Lidar(lidar) = &self.data { Some(lidar) } else { None }
    }

    /// What an inertial measurement unit captured; `None` of another sensor.
    pub fn imu(&self) -> Option<&ImuCapture> {
        if let SensorData::Imu(imu) = &self.data { Some(imu) } else { None }
    }

    /// What a receiver of satellite navigation captured; `None` of another sensor.
    pub fn gnss(&self) -> Option<&GnssCapture> {
        if let SensorData::Gnss(gnss) = &self.data { Some(gnss) } else { None }
    }

    /// What a collision sensor captured; `None` of another sensor.
    pub fn collisions(&self) -> Option<&[Collision]> {
        if let SensorData::Collision(collisions) = &self.data { Some(collisions) } else { None }
    }

    /// What a lane sensor captured; `None` of another sensor.
    pub fn lane(&self) -> Option<&LaneReading> {
        if let SensorData::Lane(lane) = &self.data { Some(lane) } else { None }
    }
}

impl Capture {
    /// What the sensor of a name measured; `None` where it was not due, or there is none.
    pub fn get(&self, name: &str) -> Option<&SensorCapture> {
        self.sensors.iter().find(|sensor| sensor.name == name)
    }
}

impl Index<&str> for Capture {
    type Output = SensorCapture;

    /// # Panics
    /// If there is none of that name: [`Self::get`] asks.
    fn index(&self, name: &str) -> &SensorCapture {
        self.get(name).unwrap_or_else(|| panic!("no sensor {name:?} was captured"))
    }
}
