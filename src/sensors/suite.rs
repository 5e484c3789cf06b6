//! The sensors of a world, captured together.

use super::camera::{self, CameraCapture};
use super::label_table::{LabelTable, number};
use crate::name;
use crate::renderer::{Gpu, RenderError, Renderer, Settings, ViewBatches, ViewPlan};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, DAffine3, DMat3};
use std::ops::Index;
use systems::Simulation;
use systems::ecs::clock::Clock;
use systems::sensors::{CameraSensor, Instance, Sensor, SensorKind};
use systems::space::GlobalTransform;
use systems::space::origin::Origin;

/// What it takes to capture sensors: a renderer, and what their views keep from capture to capture.
#[derive(Debug)]
pub struct SensorSuite {
    /// How cameras draw, but for what a sensor says itself: samples and outputs.
    pub settings: Settings,
    renderer: Renderer,
    batches: ViewBatches,
    labels: LabelTable,
}

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
}

impl SensorCapture {
    /// What a camera captured; `None` of another sensor.
    pub fn camera(&self) -> Option<&CameraCapture> {
        let SensorData::Camera(camera) = &self.data;
        Some(camera)
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

/// The sensors of a world with their names, in the order in which they came to be.
pub fn sensor_names(world: &mut World) -> Vec<(String, Entity)> {
    let mut sensors = world.query_filtered::<Entity, With<Sensor>>();
    let mut sensors: Vec<Entity> = sensors.iter(world).collect();
    sensors.sort_unstable_by_key(|&sensor| number(world, sensor));
    sensors.into_iter().map(|sensor| (sensor_name(world, sensor), sensor)).collect()
}

/// A sensor's own name below that of the thing that it is mounted on.
fn sensor_name(world: &World, sensor: Entity) -> String {
    let own = world.get::<Name>(sensor).map(|name| name.as_str().to_owned());
    let own = own.unwrap_or_else(|| format!("sensor {}", number(world, sensor)));
    let parent = |entity| world.get::<ChildOf>(entity).map(ChildOf::parent);
    let mut next = parent(sensor);
    while let Some(above) = next {
        if world.get::<Instance>(above).is_some() {
            return format!("{}/{own}", name::of_entity(world, above));
        }
        // Ends in rings of parents, too.
        next = parent(above).filter(|&above| above != sensor);
    }
    own
}

impl SensorSuite {
    /// For the worlds that are captured with a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            settings: Settings::default(),
            renderer: Renderer::new(gpu),
            batches: ViewBatches::default(),
            labels: LabelTable::default(),
        }
    }

    /// Captures all sensors that are due after the clock's step. Brings the world's draw list up to date.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn capture(&mut self, simulation: &mut Simulation) -> Result<Capture, RenderError> {
        self.capture_some(simulation, |_| true)
    }

    /// [`Self::capture`] of the sensors whose names are wanted. What they measure does not depend on which these are.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn capture_some(
        &mut self,
        simulation: &mut Simulation,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Capture, RenderError> {
        simulation.frame();
        let world = &mut simulation.world;
        let Clock { step, step_seconds, .. } = *world.resource::<Clock>();
        let is_due = |world: &World, sensor| world.get::<Sensor>(sensor).is_some_and(|sensor| sensor.is_due(step));
        let named = sensor_names(world).into_iter();
        let due: Vec<Due> = named
            .filter(|(name, sensor)| wanted(name) && is_due(world, *sensor))
            .filter_map(|(name, sensor)| Due::of(world, name, sensor))
            .collect();
        let plans: Vec<ViewPlan> =
            due.iter().map(|due| camera::plan(&due.camera, &due.world_from_sensor, &self.settings)).collect();
        let Self { renderer, batches, labels, .. } = self;
        let drawn = simulation.with_frame(|frame| renderer.draw_views(frame, batches, &plans))?;
        labels.begin();
        let world = &simulation.world;
        let origin = world.resource::<Origin>().0;
        let sensors = due.into_iter().zip(plans.iter().zip(&drawn)).map(|(due, (plan, drawn))| {
            let mut world_from_sensor = world_from_view(&plan.view.world_from_view);
            world_from_sensor.translation += origin;
            let data = SensorData::Camera(camera::capture(&due.camera, &plan.view, drawn, labels, world));
            SensorCapture { entity: due.entity, name: due.name, world_from_sensor, data }
        });
        let nanoseconds = (step as f64 * step_seconds * 1e9).round() as u64;
        Ok(Capture { step, nanoseconds, sensors: sensors.collect() })
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        self.renderer.gpu()
    }
}

/// In double precision.
fn world_from_view(view: &Affine3A) -> DAffine3 {
    let [x, y, z] = [view.matrix3.x_axis, view.matrix3.y_axis, view.matrix3.z_axis].map(|axis| axis.as_dvec3());
    DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: view.translation.as_dvec3() }
}

/// A sensor to be captured.
struct Due {
    entity: Entity,
    name: String,
    world_from_sensor: Affine3A,
    camera: CameraSensor,
}

impl Due {
    fn of(world: &World, name: String, entity: Entity) -> Option<Self> {
        let world_from_sensor = world.get::<GlobalTransform>(entity)?.affine();
        let SensorKind::Camera(camera) = world.get::<Sensor>(entity)?.kind.clone();
        Some(Self { entity, name, world_from_sensor, camera })
    }
}
