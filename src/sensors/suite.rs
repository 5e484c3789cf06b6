//! The sensors of a world, captured together.

use super::camera::{self, CameraCapture};
use super::label_table::{LabelTable, MOST_ABOVE, number};
use super::lidar::{self, LidarScan, Pose};
use super::rays::{RayScene, RayWarnings};
use crate::name;
use crate::renderer::{Gpu, RenderError, Renderer, Settings, ViewBatches, ViewPlan};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, DAffine3, DMat3, DVec3};
use std::collections::HashMap;
use std::ops::Index;
use systems::Simulation;
use systems::draw::rigid;
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
    rays: RayScene,
    /// Where lidars that sweep were when they were due last.
    poses: HashMap<Entity, (u64, Pose)>,
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
    let above = std::iter::successors(parent(sensor), |&above| parent(above)).take(MOST_ABOVE);
    let mounted_on = above.into_iter().find(|&above| world.get::<Instance>(above).is_some());
    mounted_on.map_or(own.clone(), |above| format!("{}/{own}", name::of_entity(world, above)))
}

impl SensorSuite {
    /// For the worlds that are captured with a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            settings: Settings::default(),
            renderer: Renderer::new(gpu),
            batches: ViewBatches::default(),
            labels: LabelTable::default(),
            rays: RayScene::default(),
            poses: HashMap::new(),
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
        let (step, due) = self.find_due(simulation, wanted);
        let plans: Vec<ViewPlan> = due.iter().filter_map(|due| due.plan(&self.settings)).collect();
        let Self { renderer, batches, labels, rays, poses, .. } = self;
        let drawn = simulation.with_frame(|frame| renderer.draw_views(frame, batches, &plans))?;
        labels.begin();
        let world = &simulation.world;
        let (origin, seed) = (world.resource::<Origin>().0, world.resource::<Seed>().0);
        let Clock { step_seconds, .. } = *world.resource::<Clock>();
        let mut views = plans.iter().zip(&drawn);
        let mut sensors = Vec::new();
        for due in due {
            let data = match &due.sensor.kind {
                SensorKind::Camera(camera) => {
                    let Some((plan, drawn)) = views.next() else { continue };
                    SensorData::Camera(camera::capture(camera, &plan.view, drawn, labels, world))
                }
                SensorKind::Lidar(lidar) => {
                    let Some(poses) = due.poses(world, poses) else { continue };
                    // For itself alone: what is met first of what lies in one place depends on the tree.
                    rays.update(simulation, &poses.map(|pose| pose.translation), lidar.range.1);
                    let before = step.saturating_sub(due.sensor.every.into());
                    let columns = lidar.columns_between(before, step, step_seconds);
                    let noise = Noise::new(seed, number(world, due.entity).into(), step);
                    let scan = lidar::scan(rays, lidar, &poses, columns, noise);
                    let of_beams = scan.entity.iter().map(|entity| labels.labels(world, entity.wrapping_add(1)));
                    let (instance, class) = of_beams.map(|labels| (labels.instance, labels.class)).unzip();
                    SensorData::Lidar(LidarCapture { scan, instance, class })
                }
            };
            let world_from_sensor = due.in_scene(origin);
            sensors.push(SensorCapture { entity: due.entity, name: due.name, world_from_sensor, data });
        }
        self.note_poses(&simulation.world);
        let nanoseconds = nanoseconds(world.resource::<Clock>(), step);
        Ok(Capture { step, nanoseconds, sensors })
    }

    /// Notes where lidars are that sweep and are due, for the next time that they are, without capturing anything: of a
    /// step that is left out. Brings the world up to date.
    pub fn pass_by(&mut self, simulation: &mut Simulation) {
        simulation.frame();
        self.note_poses(&simulation.world);
    }

    fn note_poses(&mut self, world: &World) {
        let step = world.resource::<Clock>().step;
        let mut sensors = world.try_query::<(Entity, &Sensor, &GlobalTransform)>();
        for (entity, sensor, place) in sensors.iter_mut().flat_map(|sensors| sensors.iter(world)) {
            if matches!(&sensor.kind, SensorKind::Lidar(lidar) if lidar.sweep) && sensor.is_due(step) {
                self.poses.insert(entity, (step, Pose::of(place)));
            }
        }
        self.poses.retain(|entity, _| world.get_entity(*entity).is_ok());
    }

    /// What of lidars' rays is not as it is drawn.
    pub fn ray_warnings(&self) -> RayWarnings {
        self.rays.warnings()
    }

    /// The sensors that are due after the clock's step and wanted. Brings the world up to date.
    pub(super) fn due(&self, simulation: &mut Simulation, wanted: impl Fn(&str) -> bool) -> Vec<DueSensor> {
        let (_, due) = self.find_due(simulation, wanted);
        let origin = simulation.world.resource::<Origin>().0;
        due.into_iter()
            .map(|due| {
                let world_from_sensor = due.in_scene(origin);
                let sweeps = matches!(&due.sensor.kind, SensorKind::Lidar(lidar) if lidar.sweep);
                let poses = due.poses(&simulation.world, &self.poses).filter(|_| sweeps);
                let world_from_sensor_before = poses.map(|[before, _]| {
                    DAffine3::from_rotation_translation(before.rotation, before.translation + origin)
                });
                DueSensor { name: due.name, sensor: due.sensor, world_from_sensor, world_from_sensor_before }
            })
            .collect()
    }

    /// Says what of lidars' rays is not as it is drawn. Returns whether anything was said.
    pub(super) fn warn_of_rays(&self) -> bool {
        let RayWarnings { solid_masks, plain_maps, left_out } = self.rays.warnings();
        let warnings = [
            (solid_masks, "masked objects are solid to lidars: their texels were released"),
            (plain_maps, "objects have one colour for lidars: the texels of their base maps were released"),
            (left_out, "objects are met by no beam: their meshes have no surface, or triangles too uneven for a tree"),
        ];
        let said = warnings.into_iter().filter(|(count, _)| *count > 0);
        said.map(|(count, message)| tracing::warn!("{count} {message}")).count() > 0
    }

    /// The clock's step, and the sensors that are due after it. Brings the world up to date.
    fn find_due(&self, simulation: &mut Simulation, wanted: impl Fn(&str) -> bool) -> (u64, Vec<Due>) {
        simulation.frame();
        let world = &mut simulation.world;
        let step = world.resource::<Clock>().step;
        let named = sensor_names(world).into_iter();
        let due = named.filter_map(|(name, entity)| {
            let sensor = world.get::<Sensor>(entity).filter(|sensor| wanted(&name) && sensor.is_due(step))?.clone();
            let world_from_sensor = world.get::<GlobalTransform>(entity)?.affine();
            Some(Due { entity, name, world_from_sensor, sensor })
        });
        (step, due.collect())
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        self.renderer.gpu()
    }
}

/// A sensor that is due, and where it is in the scene's coordinates.
pub(super) struct DueSensor {
    pub name: String,
    pub sensor: Sensor,
    pub world_from_sensor: DAffine3,
    /// Where a lidar that sweeps was when its columns' interval began.
    pub world_from_sensor_before: Option<DAffine3>,
}

/// The time after a step, rounded once.
pub(super) fn nanoseconds(clock: &Clock, step: u64) -> u64 {
    (step as f64 * clock.step_seconds * 1e9).round() as u64
}

/// A sensor to be captured.
struct Due {
    entity: Entity,
    name: String,
    /// As its entity has it.
    world_from_sensor: Affine3A,
    sensor: Sensor,
}

impl Due {
    /// Its place in the scene's coordinates, without scale, mirror and shear.
    fn in_scene(&self, origin: DVec3) -> DAffine3 {
        let place = rigid(&self.world_from_sensor);
        let [x, y, z] = [place.matrix3.x_axis, place.matrix3.y_axis, place.matrix3.z_axis].map(|axis| axis.as_dvec3());
        DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: place.translation.as_dvec3() + origin }
    }

    /// How a camera's view is drawn.
    fn plan(&self, settings: &Settings) -> Option<ViewPlan> {
        let SensorKind::Camera(camera) = &self.sensor.kind else { return None };
        Some(camera::plan(camera, &self.world_from_sensor, settings))
    }

    /// Where it was when it was due before, as far as that is known, and where it is.
    fn poses(&self, world: &World, poses: &HashMap<Entity, (u64, Pose)>) -> Option<[Pose; 2]> {
        let now = Pose::of(world.get::<GlobalTransform>(self.entity)?);
        let step = world.resource::<Clock>().step;
        let due_before = step.checked_sub(self.sensor.every.into());
        let before = poses.get(&self.entity).filter(|(at, _)| Some(*at) == due_before);
        Some([before.map_or(now, |(_, pose)| *pose), now])
    }
}
