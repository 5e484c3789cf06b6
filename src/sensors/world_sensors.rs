//! The sensors of a world: which are due, how they are drawn, and what they measured of that.

use super::boxes::Boxes;
use super::camera::{self, CameraPlan};
use super::capture::{Capture, LidarCapture, SensorCapture, SensorData};
use super::drawing::Drawing;
use super::label_table::{LabelTable, mounted_on, number, thing_of};
use super::lens_map::LensMaps;
use super::lidar::{self, Pose};
use super::motion::{self, Moment, Place, Track, jumps};
#[cfg(not(feature = "vehicles"))]
use super::no_vehicles::{collisions, lanes};
use super::rays::{RayScene, RayWarnings};
use super::tracking::{Tracked, TrackedCamera, Tracker};
#[cfg(feature = "vehicles")]
use super::{collisions, lanes};
use crate::name;
use crate::renderer::{Outputs, RenderError, Settings, ViewPlan};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, DAffine3, DVec3};
use std::collections::HashMap;
use systems::Simulation;
use systems::ecs::clock::{Clock, Seed};
use systems::run::snapshot::Restored;
use systems::sensors::philox::Noise;
use systems::sensors::{Columns, GeoOrigin, LidarSensor, Sensor, SensorKind};
use systems::space::GlobalTransform;
use systems::space::origin::Origin;

/// What is kept of the sensors of a world from capture to capture.
#[derive(Default)]
pub struct WorldSensors {
    labels: LabelTable,
    lenses: LensMaps,
    rays: RayScene,
    warnings: RayWarnings,
    /// Where sensors that measure by it were when they were due last.
    tracks: HashMap<Entity, Track>,
    tracker: Tracker,
    /// Of which state these are.
    restored: Restored,
}

/// Sensors that are to be captured, and the views of the cameras among them.
pub(super) struct Planned {
    due: Vec<Due>,
    plans: Vec<CameraPlan>,
    /// Of each camera.
    views: Vec<Vec<ViewPlan>>,
}

impl Planned {
    /// All views, camera after camera.
    pub fn all_views(&self) -> Vec<ViewPlan> {
        self.views.concat()
    }
}

/// What sensors have measured, before cameras have their boxes.
pub(super) struct Measured {
    capture: Capture,
    tracked: Option<Tracked>,
    /// Places of cameras among the sensors, and how things are drawn alone for their boxes.
    boxes_of: Vec<(usize, CameraPlan, Boxes)>,
}

/// The sensors of a world with their names, in the order in which they came to be.
pub fn sensor_names(world: &mut World) -> Vec<(String, Entity)> {
    let sensors = sensors_where(world, |_| true);
    sensors.into_iter().map(|sensor| (sensor_name(world, sensor), sensor)).collect()
}

/// A sensor's own name below that of the thing that it is mounted on.
pub fn sensor_name(world: &World, sensor: Entity) -> String {
    let own = world.get::<Name>(sensor).map(|name| name.as_str().to_owned());
    let own = own.unwrap_or_else(|| format!("sensor {}", number(world, sensor)));
    sensor_name_on(world, world.get::<ChildOf>(sensor).map(ChildOf::parent), own)
}

/// That of a sensor with an own name, if it were mounted on a parent; or on nothing.
pub fn sensor_name_on(world: &World, parent: Option<Entity>, own: String) -> String {
    match parent.and_then(|parent| thing_of(world, parent)) {
        Some(thing) => format!("{}/{own}", name::of_entity(world, thing)),
        None => own,
    }
}

impl WorldSensors {
    /// How sensors that [`Self::due`] has found are to be drawn.
    ///
    /// # Errors
    /// A camera that has no picture.
    pub(super) fn plan(&mut self, settings: &Settings, due: Vec<Due>) -> Result<Planned, RenderError> {
        let plans = due.iter().filter_map(|due| due.plan(settings, &mut self.lenses).transpose());
        let plans: Vec<CameraPlan> = plans.collect::<Result<_, _>>()?;
        let views = plans.iter().map(CameraPlan::views).collect();
        Ok(Planned { due, plans, views })
    }

    /// What planned sensors measured, of what their views drew; but for boxes, which [`Self::finish`] finds.
    pub(super) fn measure(
        &mut self,
        simulation: &Simulation,
        Planned { due, plans, views }: Planned,
        drawn: &[Outputs],
    ) -> Measured {
        let Self { labels, rays, warnings, tracker, .. } = self;
        labels.begin();
        let tracked = tracker.look(simulation, labels, due.iter().map(|due| &due.sensor));
        let world = &simulation.world;
        let (origin, seed) = (world.resource::<Origin>().0, world.resource::<Seed>().0);
        let clock = world.resource::<Clock>();
        let (step, step_seconds) = (clock.step, clock.step_seconds);
        *warnings = RayWarnings::default();
        if due.iter().any(|due| matches!(due.sensor.kind, SensorKind::Lidar(_))) {
            rays.update(simulation);
            *warnings = rays.warnings();
        }
        let mut plans = plans.iter().zip(views);
        let mut drawn = drawn;
        let mut sensors: Vec<SensorCapture> = Vec::new();
        // Which sensor's boxes, and how things are drawn alone for them.
        let mut boxes_of = Vec::new();
        for due in due {
            let before = step.saturating_sub(due.sensor.every.into());
            let noise = Noise::new(seed, number(world, due.entity).into(), step);
            let (seconds, now) = (f64::from(due.sensor.every) * step_seconds, &due.poses[1]);
            let moment = Moment { seconds, before: nanoseconds(clock, before), noise };
            let data = match &due.sensor.kind {
                SensorKind::Camera(camera) => {
                    let Some((plan, views)) = plans.next() else { continue };
                    let (own, others) = drawn.split_at(views.len().min(drawn.len()));
                    drawn = others;
                    let (mut capture, found) = camera::capture(camera, (plan, own), labels, world, noise);
                    if let Some(tracked) = &tracked {
                        let camera = TrackedCamera {
                            entity: due.entity,
                            sensor: &due.sensor,
                            camera,
                            map: plan.map(),
                            world_from_camera: plan.world_from_camera(origin),
                            jumps: jumps(world, due.entity),
                            mounted_on: mounted_on(world, due.entity).map(|above| number(world, above)),
                        };
                        let boxes = tracker.track(tracked, &camera, &mut capture, &found);
                        boxes_of.extend(boxes.map(|boxes| (sensors.len(), plan.alone(), boxes)));
                    }
                    SensorData::Camera(capture)
                }
                SensorKind::Lidar(lidar) => {
                    let columns = due.columns(lidar, step_seconds);
                    let scan = lidar::scan(rays, lidar, &due.poses, columns, noise);
                    let of_beams = scan.entity.iter().map(|entity| labels.labels(world, entity.wrapping_add(1)));
                    let (instance, class) = of_beams.map(|labels| (labels.instance, labels.class)).unzip();
                    SensorData::Lidar(LidarCapture {
                        scan,
                        instance,
                        class,
                        columns,
                        nanoseconds: due.first_column_nanoseconds(&columns, clock),
                        sweep: lidar.sweep,
                        poses: due.poses.map(|pose| pose.moved(origin)),
                        is_before_known: due.before[0].is_some(),
                    })
                }
                SensorKind::Imu(imu) => SensorData::Imu(motion::imu(imu, now, &due.before, moment)),
                SensorKind::Gnss(gnss) => {
                    let on_earth = world.get_resource::<GeoOrigin>();
                    SensorData::Gnss(motion::gnss(gnss, on_earth, origin, (now, due.before[0]), moment))
                }
                SensorKind::Collision(collision) => {
                    SensorData::Collision(collisions::capture(collision, world, (due.entity, now), labels))
                }
                SensorKind::Lane(lane) => SensorData::Lane(lanes::capture(lane, world, due.entity, now)),
            };
            let world_from_sensor = due.in_scene(origin);
            sensors.push(SensorCapture { entity: due.entity, name: due.name, world_from_sensor, data });
        }
        let nanoseconds = nanoseconds(clock, step);
        Measured { capture: Capture { step, nanoseconds, sensors }, tracked, boxes_of }
    }

    /// Gives cameras their boxes, for which things are drawn alone.
    ///
    /// # Errors
    /// [`RenderError`].
    pub(super) fn finish(
        &mut self,
        simulation: &mut Simulation,
        Measured { mut capture, tracked, boxes_of }: Measured,
        drawing: &mut Drawing,
    ) -> Result<Capture, RenderError> {
        let Self { labels, tracker, .. } = self;
        let Some(tracked) = tracked else { return Ok(capture) };
        let (mut plans, mut only) = (Vec::new(), Vec::new());
        for (_, plan, boxes) in &boxes_of {
            for set in tracked.drawn_alone(boxes) {
                let views = plan.views();
                only.extend(views.iter().map(|_| set.clone()));
                plans.extend(views);
            }
        }
        let drawn = drawing.draw_alone(simulation, (&plans, &only))?;
        let mut drawn = &drawn[..];
        for (sensor, plan, boxes) in boxes_of {
            let views = plan.views().len();
            let (own, rest) = drawn.split_at((boxes.pictures() * views).min(drawn.len()));
            drawn = rest;
            let found = own.chunks(views.max(1)).map(|own| labels.runs(&simulation.world, &plan.ids(own)));
            if let SensorData::Camera(camera) = &mut capture.sensors[sensor].data {
                camera.boxes = boxes.finish(found);
            }
        }
        tracker.forget(&simulation.world);
        Ok(capture)
    }

    /// What of the last capture's rays is not as it is drawn.
    pub fn ray_warnings(&self) -> RayWarnings {
        self.warnings
    }

    /// The sensors that are due after the clock's step and wanted; where there are any, brings the world up to date.
    /// Notes where sensors are that measure by it, for the next time that they are due: to be called after each such
    /// step.
    pub(super) fn due(&mut self, simulation: &mut Simulation, wanted: impl Fn(&str) -> bool) -> Vec<Due> {
        let world = &mut simulation.world;
        let step = world.resource::<Clock>().step;
        let sensors = sensors_where(world, |sensor| sensor.is_due(step));
        if sensors.is_empty() {
            return Vec::new();
        }
        simulation.frame();
        let world = &simulation.world;
        let restored = world.get_resource::<Restored>().copied().unwrap_or_default();
        if std::mem::replace(&mut self.restored, restored) != restored {
            self.tracks.clear();
            self.tracker = Tracker::default();
        }
        let mut due = Vec::new();
        for entity in sensors {
            let Some(mut found) = Due::of(world, entity, step) else { continue };
            let track = self.tracks.entry(entity).or_default();
            let seconds = f64::from(found.sensor.every) * world.resource::<Clock>().step_seconds;
            let now = Place { pose: found.poses[1], jumps: jumps(world, entity) };
            found.before = track.note(&found.sensor, step, seconds, now);
            found.poses[0] = found.before[0].unwrap_or(found.poses[1]);
            if wanted(&found.name) {
                due.push(found);
            }
        }
        self.tracks.retain(|entity, _| world.get_entity(*entity).is_ok());
        self.lenses.retain(world);
        due
    }

    /// Those of the state at hand to look at, whether they are due or not; brings the world up to date.
    pub(super) fn looked_at(&mut self, simulation: &mut Simulation, wanted: impl Fn(Entity) -> bool) -> Vec<Due> {
        let mut looked_at = self.due(simulation, |_| true);
        looked_at.retain(|due| wanted(due.entity));
        let step = simulation.world.resource::<Clock>().step;
        let others = sensors_where(&mut simulation.world, |sensor| !sensor.is_due(step));
        let others: Vec<Entity> = others.into_iter().filter(|&sensor| wanted(sensor)).collect();
        if !others.is_empty() {
            simulation.frame();
        }
        looked_at.extend(others.into_iter().filter_map(|sensor| Due::of(&simulation.world, sensor, step)));
        for due in &mut looked_at {
            due.steps[1] = due.steps[1].max(due.sensor.every.into());
        }
        looked_at
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
    /// Where it was when it was due before, and before that, as far as that is known and it measures by it.
    before: [Option<Pose>; 2],
    /// Between which it has fired what it measures.
    steps: [u64; 2],
}

impl Due {
    /// As if it had stood still since it was due before; `None` of what is no sensor, or was not placed yet.
    fn of(world: &World, entity: Entity, step: u64) -> Option<Self> {
        let (sensor, place) = (world.get::<Sensor>(entity)?, world.get::<GlobalTransform>(entity)?);
        let is_of_state = motion::measures_motion(&sensor.kind);
        let now = if is_of_state { motion::pose(world, entity) } else { Pose::of(place) };
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
    fn columns(&self, lidar: &LidarSensor, step_seconds: f64) -> Columns {
        lidar.columns_between(self.steps[0], self.steps[1], step_seconds)
    }

    /// Nanoseconds of the clock when the first of these was fired, rounded once; those of the capture where none was.
    fn first_column_nanoseconds(&self, columns: &Columns, clock: &Clock) -> u64 {
        match columns.count {
            0 => nanoseconds(clock, self.steps[1]),
            _ => ((self.steps[0] as f64 * clock.step_seconds + columns.lead_seconds()) * 1e9).round() as u64,
        }
    }

    /// Time and pose of a lidar's first column, in nanoseconds of the clock.
    pub fn first_column(&self, world: &World) -> Option<(u64, DAffine3)> {
        let SensorKind::Lidar(lidar) = &self.sensor.kind else { return None };
        let clock = world.resource::<Clock>();
        let columns = self.columns(lidar, clock.step_seconds);
        let pose = Pose::of_column(&self.poses, lidar, &columns, 0).moved(world.resource::<Origin>().0);
        Some((self.first_column_nanoseconds(&columns, clock), pose.world_from_entity()))
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
