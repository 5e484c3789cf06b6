//! Measurements of sensors: a capture of one state.

use super::axes::{ENTITY_FROM_CAMERA, ENTITY_FROM_LIDAR};
use super::camera::CameraCapture;
use super::lidar::LidarCapture;
use super::reading::{Reading, Record};
use bevy_ecs::prelude::*;
use glam::DAffine3;
use std::ops::Index;

/// Measurements of all sensors that were due, of one state.
#[derive(Clone, PartialEq, Debug)]
pub struct Capture {
    /// Step of the clock.
    pub step: u64,
    /// Since the run began, rounded once: steps times the length of a step.
    pub nanoseconds: u64,
    /// In the order in which the sensors came to be.
    pub sensors: Vec<SensorCapture>,
}

/// Measurement of a sensor.
#[derive(Clone, PartialEq, Debug)]
pub struct SensorCapture {
    /// The sensor.
    pub entity: Entity,
    /// Its name, below that of what it is mounted on: `ego/front`.
    pub name: String,
    /// From the entity's axes (−Z forward, +Y up) to the scene's coordinates, without scale.
    pub world_from_sensor: DAffine3,
    /// First column of a lidar; `None` of another sensor.
    pub first_column: Option<FirstColumn>,
    /// Values that it measured.
    pub data: SensorData,
}

/// Begin of what a lidar measured.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FirstColumn {
    /// Nanoseconds of the clock when it was fired.
    pub nanoseconds: u64,
    /// From the entity's axes to the scene's coordinates then, of a lidar that sweeps.
    pub world_from_sensor: Option<DAffine3>,
}

/// By kind of sensor.
#[derive(Clone, PartialEq, Debug)]
pub enum SensorData {
    /// Arrays of a camera.
    Camera(CameraCapture),
    /// Arrays of a lidar.
    Lidar(LidarCapture),
    /// Records of any other sensor.
    Reading(Reading),
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

    /// Capture of a camera; `None` of another sensor.
    pub fn camera(&self) -> Option<&CameraCapture> {
        if let SensorData::Camera(camera) = &self.data { Some(camera) } else { None }
    }

    /// Capture of a lidar; `None` of another sensor.
    pub fn lidar(&self) -> Option<&LidarCapture> {
        if let SensorData::Lidar(lidar) = &self.data { Some(lidar) } else { None }
    }

    /// Record of another sensor, such as an [`ImuCapture`](crate::sense::ImuCapture); `None` where there is none of
    /// that type.
    pub fn reading<T: Record>(&self) -> Option<&T> {
        self.records()?.first()
    }

    /// All records of another sensor, such as its [`Collision`](systems::sensors::collision::Collision)s; `None` where
    /// they are of another type.
    pub fn records<T: Record>(&self) -> Option<&[T]> {
        if let SensorData::Reading(reading) = &self.data { reading.records() } else { None }
    }
}

impl Capture {
    /// Measurement of the sensor of a name; `None` where it was not due, or there is none.
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
