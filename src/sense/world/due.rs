//! Sensors that are due: where they are, and how they are drawn.

use super::names::sensor_name;
use crate::renderer::{RenderError, Settings};
use crate::sense::camera::capture::CameraPlan;
use crate::sense::camera::lens_map::LensMaps;
use crate::sense::captures::capture::FirstColumn;
use crate::sense::captures::pose::Pose;
use crate::sense::motion::kind::settings;
use crate::sense::motion::place;
use bevy_ecs::prelude::*;
use glam::{Affine3A, DAffine3, DVec3};
use systems::ecs::clock::Clock;
use systems::sensors::{Columns, LidarSensor, Sensor, SensorKind};
use systems::space::GlobalTransform;
use systems::space::origin::Origin;

/// The time after a step, rounded once.
pub(crate) fn nanoseconds(clock: &Clock, step: u64) -> u64 {
    (step as f64 * clock.step_seconds * 1e9).round() as u64
}

/// A sensor that is due.
pub(crate) struct Due {
    pub name: String,
    pub sensor: Sensor,
    pub(super) entity: Entity,
    /// With its scale.
    world_from_entity: Affine3A,
    /// Poses of a lidar that sweeps when it was due before, as far as that is known, and now; else the pose now,
    /// twice.
    pub(super) poses: [Pose; 2],
    /// Poses when it was due before, and before that, as far as that is known and it measures by it.
    pub(super) before: [Option<Pose>; 2],
    /// Between which it has fired what it measures.
    pub(super) steps: [u64; 2],
}

impl Due {
    /// A sensor as if it had stood still since it was due before; `None` of what is no sensor, or was not placed yet.
    pub(super) fn of(world: &World, entity: Entity, step: u64) -> Option<Self> {
        let (sensor, place) = (world.get::<Sensor>(entity)?, world.get::<GlobalTransform>(entity)?);
        // What is no picture is of the state, rather than of where things are drawn.
        if matches!(sensor.kind, SensorKind::Custom { .. }) {
            // Settings that a program took away leave nothing to measure by.
            settings(world, entity, sensor)?;
        }
        let is_drawn = matches!(sensor.kind, SensorKind::Camera(_) | SensorKind::Lidar(_));
        let now = if is_drawn { Pose::of(place) } else { place::pose(world, entity) };
        Some(Self {
            name: sensor_name(world, entity),
            sensor: sensor.clone(),
            entity,
            world_from_entity: place.affine(),
            poses: [now; 2],
            before: [None; 2],
            steps: [step.saturating_sub(sensor.every.into()), step],
        })
    }

    /// Its place in the scene's coordinates, whose `origin` the world's count from.
    pub fn in_scene(&self, origin: DVec3) -> DAffine3 {
        self.poses[1].moved(origin).world_from_entity()
    }

    /// The columns that a lidar has fired.
    pub(super) fn columns(&self, lidar: &LidarSensor, step_seconds: f64) -> Columns {
        lidar.columns_between(self.steps[0], self.steps[1], step_seconds)
    }

    /// Nanoseconds of the clock when the first of these was fired, rounded once; those of the capture where none was.
    pub(super) fn first_column_nanoseconds(&self, columns: &Columns, clock: &Clock) -> u64 {
        match columns.count {
            0 => nanoseconds(clock, self.steps[1]),
            _ => ((self.steps[0] as f64 * clock.step_seconds + columns.lead_seconds()) * 1e9).round() as u64,
        }
    }

    /// The first column of a lidar; `None` of another sensor.
    pub fn first_column(&self, world: &World) -> Option<FirstColumn> {
        let SensorKind::Lidar(lidar) = &self.sensor.kind else { return None };
        let clock = world.resource::<Clock>();
        let columns = self.columns(lidar, clock.step_seconds);
        let pose = Pose::of_column(&self.poses, lidar, &columns, 0).moved(world.resource::<Origin>().0);
        Some(FirstColumn {
            nanoseconds: self.first_column_nanoseconds(&columns, clock),
            world_from_sensor: lidar.sweep.then(|| pose.world_from_entity()),
        })
    }

    /// Views of a camera; `None` of another sensor.
    pub(super) fn plan(&self, settings: &Settings, lenses: &mut LensMaps) -> Result<Option<CameraPlan>, RenderError> {
        let SensorKind::Camera(camera) = &self.sensor.kind else { return Ok(None) };
        let checked =
            camera.check_light().map_err(|fault| fault.to_string()).and_then(|()| lenses.of(self.entity, camera));
        let map = checked.map_err(|reason| RenderError::View { view: format!("sensor {:?}", self.name), reason })?;
        Ok(Some(CameraPlan::new(camera, &self.world_from_entity, settings, map)))
    }
}
