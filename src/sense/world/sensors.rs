//! The sensors of a world: which are due, how they are drawn, and what they measured of that.

use super::due::{Due, nanoseconds};
use super::names::sensors_where;
use crate::renderer::{Outputs, RenderError, Settings, SlotSet, ViewPlan};
use crate::sense::camera::capture::{self as camera, CameraPlan};
use crate::sense::camera::lens_map::LensMaps;
use crate::sense::captures::capture::{Capture, SensorCapture, SensorData};
use crate::sense::captures::label_table::{LabelTable, mounted_on, number};
use crate::sense::captures::lidar::LidarCapture;
use crate::sense::motion::kind::{self, Measuring};
use crate::sense::motion::place::{Place, jumps};
use crate::sense::motion::track::Track;
use crate::sense::rays::lidar;
use crate::sense::rays::scene::{RayScene, RayWarnings};
use crate::sense::tracking::boxes::Boxes;
use crate::sense::tracking::tracker::{Tracked, TrackedCamera, Tracker};
use bevy_ecs::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;
use systems::Simulation;
use systems::ecs::clock::{Clock, Seed};
use systems::run::snapshot::Restored;
use systems::sensors::SensorKind;
use systems::sensors::philox::Noise;
use systems::space::origin::Origin;

/// Resources of the sensors of a world, kept from capture to capture.
#[derive(Default)]
pub struct WorldSensors {
    labels: LabelTable,
    lenses: LensMaps,
    rays: RayScene,
    warnings: RayWarnings,
    /// Places, when they were due last, of sensors that measure by them.
    tracks: HashMap<Entity, Track>,
    tracker: Tracker,
    /// State that these are of.
    restored: Restored,
}

/// Sensors that are to be captured, and the views of the cameras among them.
pub(super) struct Planned {
    due: Vec<Due>,
    plans: Vec<CameraPlan>,
    /// Views of each camera.
    views: Vec<Vec<ViewPlan>>,
}

impl Planned {
    /// All views, camera after camera.
    pub fn all_views(&self) -> Vec<ViewPlan> {
        self.views.concat()
    }
}

/// Measurements, before cameras have their boxes.
pub(super) struct Measured {
    capture: Capture,
    tracked: Option<Tracked>,
    /// Places of cameras among the sensors, and how things are drawn alone for their boxes.
    boxes_of: Vec<(usize, CameraPlan, Boxes)>,
}

impl Measured {
    /// Views of what is drawn alone for the boxes of cameras, and what is drawn in each.
    pub fn alone(&self) -> (Vec<ViewPlan>, Vec<Arc<SlotSet>>) {
        let (mut plans, mut only) = (Vec::new(), Vec::new());
        let Some(tracked) = &self.tracked else { return (plans, only) };
        for (_, plan, boxes) in &self.boxes_of {
            for set in tracked.drawn_alone(boxes) {
                let views = plan.views();
                only.extend(views.iter().map(|_| set.clone()));
                plans.extend(views);
            }
        }
        (plans, only)
    }
}

impl WorldSensors {
    /// Plans the views of sensors that [`Self::due`] has found.
    ///
    /// # Errors
    /// A camera that has no picture.
    pub(super) fn plan(&mut self, settings: &Settings, due: Vec<Due>) -> Result<Planned, RenderError> {
        let plans = due.iter().filter_map(|due| due.plan(settings, &mut self.lenses).transpose());
        let plans: Vec<CameraPlan> = plans.collect::<Result<_, _>>()?;
        let views = plans.iter().map(CameraPlan::views).collect();
        Ok(Planned { due, plans, views })
    }

    /// Plan of a camera's views; `None` of another sensor.
    ///
    /// # Errors
    /// A camera that has no picture.
    pub(super) fn plan_of(&mut self, settings: &Settings, due: &Due) -> Result<Option<CameraPlan>, RenderError> {
        due.plan(settings, &mut self.lenses)
    }

    /// Measures planned sensors by what their views drew; but for boxes, which [`Self::finish`] finds.
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
                _ => {
                    let Some(settings) = kind::settings(world, due.entity, &due.sensor) else { continue };
                    SensorData::Reading(settings.measure(&mut Measuring {
                        world,
                        entity: due.entity,
                        pose: due.poses[1],
                        before: due.before,
                        origin,
                        seconds: f64::from(due.sensor.every) * step_seconds,
                        nanoseconds_before: nanoseconds(clock, before),
                        noise,
                        labels,
                    }))
                }
            };
            let (world_from_sensor, first_column) = (due.in_scene(origin), due.first_column(world));
            sensors.push(SensorCapture { entity: due.entity, name: due.name, world_from_sensor, first_column, data });
        }
        let nanoseconds = nanoseconds(clock, step);
        Measured { capture: Capture { step, nanoseconds, sensors }, tracked, boxes_of }
    }

    /// Gives cameras their boxes. `drawn`: by [`Measured::alone`].
    pub(super) fn finish(
        &mut self,
        world: &World,
        Measured { mut capture, tracked, boxes_of }: Measured,
        mut drawn: &[Outputs],
    ) -> Capture {
        if tracked.is_none() {
            return capture;
        }
        for (sensor, plan, boxes) in boxes_of {
            let views = plan.views().len();
            let (own, rest) = drawn.split_at((boxes.pictures() * views).min(drawn.len()));
            drawn = rest;
            let found = own.chunks(views.max(1)).map(|own| self.labels.runs(world, &plan.ids(own)));
            if let SensorData::Camera(camera) = &mut capture.sensors[sensor].data {
                camera.boxes = boxes.finish(found);
            }
        }
        self.tracker.forget(world);
        capture
    }

    /// Objects that the last capture's rays do not meet as they are drawn.
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
            let needed = kind::poses_before(world, &found.sensor.kind);
            let seconds = f64::from(found.sensor.every) * world.resource::<Clock>().step_seconds;
            let now = Place { pose: found.poses[1], jumps: jumps(world, entity) };
            found.before = track.note(needed, found.sensor.every, step, seconds, now);
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
