//! Sensors that are looked at: thumbnails, the one in full size, frusta and beams. Where nothing is, nothing is
//! captured and nothing kept.

use crate::app::sensors::captures::SensorCaptures;
use crate::app::sensors::choice::Choice;
use crate::renderer::{Gpu, RenderError, Settings};
use crate::sense::sensor_names;
use bevy_ecs::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use systems::Simulation;
use systems::sensors::{Sensor, SensorKind};

/// Views of the sensors that are looked at.
pub struct SensorViews {
    /// Frusta of cameras and points of lidars are drawn over the scene.
    pub beams: bool,
    /// The one that fills the view.
    pub full: Option<Entity>,
    /// Those that have thumbnails.
    open: BTreeSet<Entity>,
    /// Choices of sensors that were opened once.
    choices: BTreeMap<Entity, Choice>,
    /// The last captures of what is looked at.
    pub captures: SensorCaptures,
    failure: Option<RenderError>,
}

impl SensorViews {
    /// Nothing is looked at. `settings`: how cameras draw.
    pub fn new(settings: Settings) -> Self {
        Self {
            beams: false,
            full: None,
            open: BTreeSet::new(),
            choices: BTreeMap::new(),
            captures: SensorCaptures::new(settings),
            failure: None,
        }
    }

    /// Sets the device that captures sensors from now on; `None`: there is none for now.
    pub fn use_device(&mut self, gpu: Option<&Gpu>) {
        self.captures.use_device(gpu);
    }

    /// Tells if a sensor has a thumbnail.
    pub fn is_open(&self, sensor: Entity) -> bool {
        self.open.contains(&sensor)
    }

    /// Tells if any sensor has a thumbnail.
    pub fn has_thumbnails(&self) -> bool {
        !self.open.is_empty()
    }

    /// The sensors that have thumbnails, with their names, in the order in which they came to be.
    pub fn opened(&self, world: &mut World) -> Vec<(String, Entity)> {
        if self.open.is_empty() {
            return Vec::new();
        }
        sensor_names(world).into_iter().filter(|(_, sensor)| self.is_open(*sensor)).collect()
    }

    /// Gives a sensor a thumbnail, or takes it.
    pub fn toggle(&mut self, sensor: Entity) {
        if !self.open.remove(&sensor) {
            self.open.insert(sensor);
        }
    }

    /// Takes all thumbnails; where there are none, gives each sensor one. Returns whether there are sensors.
    pub fn toggle_all(&mut self, world: &mut World) -> bool {
        let sensors = sensor_names(world);
        if self.open.is_empty() {
            self.open.extend(sensors.iter().map(|(_, sensor)| *sensor));
        } else {
            self.open.clear();
        }
        !sensors.is_empty()
    }

    /// Picture shown of a sensor; `None` of one without pictures.
    pub fn choice(&self, entity: Entity, sensor: &Sensor) -> Option<Choice> {
        let all = Choice::all_of(sensor);
        let chosen = self.choices.get(&entity).filter(|chosen| all.iter().any(|(_, choice)| choice == *chosen));
        chosen.or(all.first().map(|(_, choice)| choice)).copied()
    }

    /// Shows something else of it.
    pub fn choose(&mut self, sensor: Entity, choice: Choice) {
        self.choices.insert(sensor, choice);
    }

    /// Captures what is looked at and due after the clock's step, and what was not captured yet, of the state at hand.
    /// The simulation goes on as if nothing had been.
    pub fn update(&mut self, simulation: &mut Simulation) {
        if self.failure.is_some() {
            return;
        }
        let mut wanted = BTreeMap::new();
        if self.beams || self.full.is_some() || !self.open.is_empty() {
            let mut sensors = simulation.world.query::<(Entity, &Sensor)>();
            let all = sensors.iter(&simulation.world).filter(|(entity, sensor)| self.is_wanted(*entity, sensor));
            wanted.extend(all.map(|(entity, sensor)| (entity, sensor.clone())));
            let is_there = |sensor: &Entity| simulation.world.get::<Sensor>(*sensor).is_some();
            self.open.retain(is_there);
            self.full = self.full.filter(is_there);
        }
        self.failure = self.captures.update(&wanted, simulation).err();
    }

    fn is_wanted(&self, entity: Entity, sensor: &Sensor) -> bool {
        let has_points = matches!(sensor.kind, SensorKind::Lidar(_));
        self.is_open(entity) || self.full == Some(entity) || (self.beams && has_points)
    }

    /// Takes the error of the last capture. What failed is not tried again, unless the device was lost.
    pub fn take_failure(&mut self) -> Option<RenderError> {
        let failure = self.failure.take()?;
        if !matches!(failure, RenderError::Lost { .. }) {
            (self.beams, self.full) = (false, None);
            self.open.clear();
        }
        Some(failure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::pictures::PointValue;
    use systems::sensors::{CameraOutput, CameraSensor, LidarSensor};

    #[test]
    fn thumbnails_come_and_go_one_by_one_and_all_together() {
        let mut world = World::new();
        let mut views = SensorViews::new(Settings::default());
        assert!(!views.toggle_all(&mut world));
        let camera = CameraSensor::default().with(CameraOutput::Depth);
        let [front, top] = [Sensor::camera(camera), Sensor::lidar(LidarSensor::default())]
            .map(|sensor| world.spawn((Name::new("sensor"), sensor)).id());
        let opened = |views: &SensorViews, world: &mut World| {
            views.opened(world).into_iter().map(|(_, sensor)| sensor).collect::<Vec<_>>()
        };
        views.toggle(top);
        assert_eq!(opened(&views, &mut world), [top]);
        assert!(views.toggle_all(&mut world));
        assert_eq!(opened(&views, &mut world), []);
        views.toggle_all(&mut world);
        assert_eq!(opened(&views, &mut world), [front, top]);

        let choice = |views: &SensorViews, entity| views.choice(entity, world.get(entity).expect("a sensor"));
        let first = [front, top].map(|entity| choice(&views, entity));
        let expected = [Choice::Output(CameraOutput::Color), Choice::Points(PointValue::Height)];
        assert_eq!(first, expected.map(Some));
        views.choose(front, Choice::Output(CameraOutput::Depth));
        assert_eq!(choice(&views, front), Some(Choice::Output(CameraOutput::Depth)));
        views.choose(front, Choice::Output(CameraOutput::Normal));
        assert_eq!(choice(&views, front), Some(Choice::Output(CameraOutput::Color)), "it has no normals");
    }

    #[test]
    fn lidars_are_captured_for_their_beams_and_cameras_for_their_pictures() {
        let mut views = SensorViews::new(Settings::default());
        let [front, top] = [0, 1].map(|i| Entity::from_raw_u32(i).expect("an entity"));
        let (camera, lidar) = (Sensor::camera(CameraSensor::default()), Sensor::lidar(LidarSensor::default()));
        let wanted = |views: &SensorViews| [views.is_wanted(front, &camera), views.is_wanted(top, &lidar)];
        assert_eq!(wanted(&views), [false, false]);
        views.beams = true;
        assert_eq!(wanted(&views), [false, true]);
        views.full = Some(front);
        assert_eq!(wanted(&views), [true, true]);
    }
}
