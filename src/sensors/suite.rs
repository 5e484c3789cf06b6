//! The sensors of a world, captured together.

use super::camera::{self, CameraCapture, CameraPlan};
use super::label_table::{LabelTable, MOST_ABOVE, number};
use super::lens_map::LensMaps;
use super::lidar::{self, LidarScan, Pose};
use super::rays::{RayScene, RayWarnings};
use super::tracking::{TrackedCamera, Tracker};
use crate::name;
use crate::renderer::{Gpu, RenderError, Renderer, Settings, ViewBatches, ViewPlan};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, DAffine3, DVec3};
use std::collections::HashMap;
use std::ops::Index;
use systems::Simulation;
use systems::ecs::clock::{Clock, Seed};
use systems::sensors::philox::Noise;
use systems::sensors::{Instance, Sensor, SensorKind};
use systems::space::GlobalTransform;
use systems::space::origin::Origin;

/// What it takes to capture sensors: a renderer, and what their views keep from capture to capture.
pub struct SensorSuite {
    /// How cameras draw, but for what a sensor says itself: samples and outputs.
    pub settings: Settings,
    renderer: Renderer,
    batches: ViewBatches,
    labels: LabelTable,
    lenses: LensMaps,
    rays: RayScene,
    warnings: RayWarnings,
    /// Where lidars that sweep were when they were due last.
    poses: HashMap<Entity, (u64, Pose)>,
    tracker: Tracker,
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
    /// Of a lidar.
    Lidar(LidarCapture),
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
}

impl SensorCapture {
    /// What a camera captured; `None` of another sensor.
    pub fn camera(&self) -> Option<&CameraCapture> {
        if let SensorData::Camera(camera) = &self.data { Some(camera) } else { None }
    }

    /// What a lidar captured; `None` of another sensor.
    pub fn lidar(&self) -> Option<&LidarCapture> {
        if let SensorData::Lidar(lidar) = &self.data { Some(lidar) } else { None }
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
    let sensors = sensors_where(world, |_| true);
    sensors.into_iter().map(|sensor| (sensor_name(world, sensor), sensor)).collect()
}

/// A sensor's own name below that of the thing that it is mounted on.
fn sensor_name(world: &World, sensor: Entity) -> String {
    let own = world.get::<Name>(sensor).map(|name| name.as_str().to_owned());
    let own = own.unwrap_or_else(|| format!("sensor {}", number(world, sensor)));
    mounted_on(world, sensor).map_or(own.clone(), |above| format!("{}/{own}", name::of_entity(world, above)))
}

/// The thing that a sensor is on.
fn mounted_on(world: &World, sensor: Entity) -> Option<Entity> {
    let parent = |entity| world.get::<ChildOf>(entity).map(ChildOf::parent);
    let above = std::iter::successors(parent(sensor), |&above| parent(above)).take(MOST_ABOVE);
    above.into_iter().find(|&above| world.get::<Instance>(above).is_some())
}

impl SensorSuite {
    /// For the worlds that are captured with a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            settings: Settings::default(),
            renderer: Renderer::new(gpu),
            batches: ViewBatches::default(),
            labels: LabelTable::default(),
            lenses: LensMaps::default(),
            rays: RayScene::default(),
            warnings: RayWarnings::default(),
            poses: HashMap::new(),
            tracker: Tracker::default(),
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
        let due = self.due(simulation, wanted);
        self.capture_due(simulation, due)
    }

    /// Captures sensors that [`Self::due`] has found in the state at hand.
    ///
    /// # Errors
    /// [`RenderError`].
    pub(super) fn capture_due(&mut self, simulation: &mut Simulation, due: Vec<Due>) -> Result<Capture, RenderError> {
        let Self { settings, renderer, batches, labels, lenses, rays, warnings, tracker, .. } = self;
        let plans = due.iter().filter_map(|due| due.plan(settings, lenses).transpose());
        let plans: Vec<CameraPlan> = plans.collect::<Result<_, _>>()?;
        let views: Vec<Vec<ViewPlan>> = plans.iter().map(CameraPlan::views).collect();
        let drawn = simulation.with_frame(|frame| renderer.draw_views(frame, batches, &views.concat()))?;
        labels.begin();
        let tracked = tracker.look(simulation, labels, due.iter().map(|due| &due.sensor));
        let world = &simulation.world;
        let (origin, seed) = (world.resource::<Origin>().0, world.resource::<Seed>().0);
        let Clock { step, step_seconds, .. } = *world.resource::<Clock>();
        *warnings = RayWarnings::default();
        if due.iter().any(|due| matches!(due.sensor.kind, SensorKind::Lidar(_))) {
            rays.update(simulation);
            *warnings = rays.warnings();
        }
        let mut plans = plans.iter().zip(views);
        let mut drawn = &drawn[..];
        let mut sensors: Vec<SensorCapture> = Vec::new();
        // Which sensor's boxes, and how things are drawn alone for them.
        let mut boxes_of = Vec::new();
        for due in due {
            let noise = Noise::new(seed, number(world, due.entity).into(), step);
            let data = match &due.sensor.kind {
                SensorKind::Camera(camera) => {
                    let Some((plan, views)) = plans.next() else { continue };
                    let (own, others) = drawn.split_at(views.len().min(drawn.len()));
                    drawn = others;
                    let (mut capture, found) = camera::capture(camera, (plan, own), labels, world, noise);
                    if let Some(tracked) = &tracked {
                        let camera = TrackedCamera {
                            entity: due.entity,
                            every: due.sensor.every,
                            camera,
                            map: plan.map(),
                            world_from_camera: plan.world_from_camera(origin),
                            mounted_on: mounted_on(world, due.entity).map(|above| number(world, above)),
                        };
                        let boxes = tracker.track(tracked, &camera, &mut capture, &found);
                        boxes_of.extend(boxes.map(|boxes| (sensors.len(), plan.alone(), boxes)));
                    }
                    SensorData::Camera(capture)
                }
                SensorKind::Lidar(lidar) => {
                    let before = step.saturating_sub(due.sensor.every.into());
                    let columns = lidar.columns_between(before, step, step_seconds);
                    let scan = lidar::scan(rays, lidar, &due.poses, columns, noise);
                    let of_beams = scan.entity.iter().map(|entity| labels.labels(world, entity.wrapping_add(1)));
                    let (instance, class) = of_beams.map(|labels| (labels.instance, labels.class)).unzip();
                    SensorData::Lidar(LidarCapture { scan, instance, class })
                }
            };
            let [_, world_from_sensor] = due.in_scene(origin);
            sensors.push(SensorCapture { entity: due.entity, name: due.name, world_from_sensor, data });
        }
        if let Some(tracked) = tracked {
            let (mut plans, mut only) = (Vec::new(), Vec::new());
            for (_, plan, boxes) in &boxes_of {
                for set in tracked.drawn_alone(boxes) {
                    let views = plan.views();
                    only.extend(views.iter().map(|_| set.clone()));
                    plans.extend(views);
                }
            }
            let drawn = simulation.with_frame(|frame| renderer.draw_alone(frame, batches, (&plans, &only)))?;
            let mut drawn = &drawn[..];
            for (sensor, plan, boxes) in boxes_of {
                let views = plan.views().len();
                let (own, rest) = drawn.split_at((boxes.pictures() * views).min(drawn.len()));
                drawn = rest;
                let found = own.chunks(views).map(|own| labels.runs(&simulation.world, &plan.ids(own)));
                if let SensorData::Camera(capture) = &mut sensors[sensor].data {
                    capture.boxes = boxes.finish(found);
                }
            }
            tracker.forget(&simulation.world);
        }
        let nanoseconds = nanoseconds(simulation.world.resource::<Clock>(), step);
        Ok(Capture { step, nanoseconds, sensors })
    }

    /// What of the last capture's rays is not as it is drawn.
    pub fn ray_warnings(&self) -> RayWarnings {
        self.warnings
    }

    /// The sensors that are due after the clock's step and wanted; where there are any, brings the world up to date.
    /// Notes where lidars are that sweep, for the next time that they are due: to be called after each such step.
    pub(super) fn due(&mut self, simulation: &mut Simulation, wanted: impl Fn(&str) -> bool) -> Vec<Due> {
        let world = &mut simulation.world;
        let step = world.resource::<Clock>().step;
        let sensors = sensors_where(world, |sensor| sensor.is_due(step));
        if sensors.is_empty() {
            return Vec::new();
        }
        simulation.frame();
        let world = &simulation.world;
        let mut due = Vec::new();
        for entity in sensors {
            let (Some(sensor), Some(place)) = (world.get::<Sensor>(entity), world.get::<GlobalTransform>(entity))
            else {
                continue;
            };
            let now = Pose::of(place);
            let mut poses = [now; 2];
            if matches!(&sensor.kind, SensorKind::Lidar(lidar) if lidar.sweep) {
                let before = self.poses.insert(entity, (step, now));
                let due_before = step.checked_sub(sensor.every.into());
                if let Some((_, pose)) = before.filter(|(at, _)| Some(*at) == due_before) {
                    poses[0] = pose;
                }
            }
            let name = sensor_name(world, entity);
            if wanted(&name) {
                due.push(Due { entity, name, world_from_entity: place.affine(), sensor: sensor.clone(), poses });
            }
        }
        self.poses.retain(|entity, _| world.get_entity(*entity).is_ok());
        self.lenses.retain(world);
        due
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        self.renderer.gpu()
    }
}

/// The time after a step, rounded once.
pub(super) fn nanoseconds(clock: &Clock, step: u64) -> u64 {
    (step as f64 * clock.step_seconds * 1e9).round() as u64
}

/// A sensor that is due.
pub(super) struct Due {
    pub name: String,
    pub sensor: Sensor,
    entity: Entity,
    /// With its scale.
    world_from_entity: Affine3A,
    /// Of a lidar that sweeps, where it was when it was due before, as far as that is known, and where it is; else that
    /// twice.
    poses: [Pose; 2],
}

impl Due {
    /// Its [poses](Self::poses) in the scene's coordinates, whose `origin` the world's count from.
    pub fn in_scene(&self, origin: DVec3) -> [DAffine3; 2] {
        self.poses.map(|pose| DAffine3::from_rotation_translation(pose.rotation, pose.translation + origin))
    }

    /// How a camera is drawn.
    fn plan(&self, settings: &Settings, lenses: &mut LensMaps) -> Result<Option<CameraPlan>, RenderError> {
        let SensorKind::Camera(camera) = &self.sensor.kind else { return Ok(None) };
        let checked = camera.check_light().and_then(|()| lenses.of(self.entity, camera));
        let map = checked.map_err(|reason| RenderError::Camera { sensor: self.name.clone(), reason })?;
        Ok(Some(CameraPlan::new(camera, &self.world_from_entity, settings, map)))
    }
}

/// The sensors for which something holds, in the order in which they came to be.
fn sensors_where(world: &mut World, holds: impl Fn(&Sensor) -> bool) -> Vec<Entity> {
    let mut sensors = world.query::<(Entity, &Sensor)>();
    let found = sensors.iter(world).filter(|(_, sensor)| holds(sensor)).map(|(entity, _)| entity);
    let mut found: Vec<Entity> = found.collect();
    found.sort_unstable_by_key(|&sensor| number(world, sensor));
    found
}
