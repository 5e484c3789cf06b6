//! The last captures of the sensors that are looked at, and what is painted of them.

use crate::app::sensors::choice::Choice;
use crate::app::sensors::dots::Dots;
use crate::data::pictures::{Picture, Scale, reach_from_above};
use crate::renderer::{Gpu, RenderError, Settings};
use crate::sense::{SensorCapture, SensorData, SensorSuite};
use bevy_ecs::prelude::*;
use egui::{ColorImage, TextureFilter, TextureHandle, TextureOptions};
use std::collections::{BTreeMap, BTreeSet};
use systems::Simulation;
use systems::ecs::clock::Clock;
use systems::sensors::{Classes, Sensor};
use systems::space::Interpolation;

/// Pixels of a capture stay pixels.
const TEXTURE: TextureOptions = TextureOptions { magnification: TextureFilter::Nearest, ..TextureOptions::LINEAR };

/// The last captures of sensors, and what it takes to make them.
pub struct SensorCaptures {
    settings: Settings,
    gpu: Option<Gpu>,
    /// While anything is looked at.
    suite: Option<SensorSuite>,
    captured: BTreeMap<Entity, Captured>,
}

/// Last capture of a sensor.
pub struct Captured {
    /// After which it did.
    pub step: u64,
    pub capture: SensorCapture,
    painted: Option<Painted>,
    dots: Option<(Option<Choice>, Dots)>,
}

/// A picture of a capture, as a texture.
pub struct Painted {
    pub texture: TextureHandle,
    /// Scale of its colours.
    pub scale: Option<Scale>,
    /// Distance from the middle to the sides of a view from above, metres.
    pub reach: Option<f32>,
    /// Cache key: the choice, and pixels along the longer side.
    of: (Choice, u32),
}

impl SensorCaptures {
    /// None yet.
    pub fn new(settings: Settings) -> Self {
        Self { settings, gpu: None, suite: None, captured: BTreeMap::new() }
    }

    /// Captures stay; what was on another device is made anew.
    pub fn use_device(&mut self, gpu: Option<&Gpu>) {
        (self.gpu, self.suite) = (gpu.cloned(), None);
        self.captured.values_mut().for_each(|captured| captured.painted = None);
    }

    /// Last capture of a sensor that is looked at.
    pub fn get(&mut self, sensor: Entity) -> Option<&mut Captured> {
        self.captured.get_mut(&sensor)
    }

    /// Stride of the lidar beams drawn over the scene; `None`: all points are drawn.
    pub fn thinned(&self) -> Option<usize> {
        let dots = self.captured.values().filter_map(|captured| captured.dots.as_ref());
        dots.map(|(_, dots)| dots.every).max().filter(|every| *every > 1)
    }

    /// Captures those of the wanted sensors that are due, and those that were not captured yet; forgets all others.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn update(
        &mut self,
        wanted: &BTreeMap<Entity, Sensor>,
        simulation: &mut Simulation,
    ) -> Result<(), RenderError> {
        self.captured.retain(|sensor, _| wanted.contains_key(sensor));
        let Some(gpu) = self.gpu.as_ref().filter(|_| !wanted.is_empty()) else {
            self.suite = None;
            return Ok(());
        };
        let step = simulation.world.resource::<Clock>().step;
        let is_behind = |(entity, sensor): &(&Entity, &Sensor)| match self.captured.get(entity) {
            Some(captured) => captured.step != step && sensor.is_due(step),
            None => true,
        };
        let now: BTreeSet<Entity> = wanted.iter().filter(is_behind).map(|(entity, _)| *entity).collect();
        if now.is_empty() {
            return Ok(());
        }
        let suite = self.suite.get_or_insert_with(|| {
            let mut suite = SensorSuite::new(gpu);
            suite.settings = self.settings;
            suite
        });
        // Of the state itself, and not, as the window's frames, between two steps.
        let set_fraction = |simulation: &mut Simulation, fraction| {
            std::mem::replace(&mut simulation.world.resource_mut::<Interpolation>().fraction, fraction)
        };
        let fraction = set_fraction(simulation, 1.0);
        let capture = suite.look(simulation, |sensor| now.contains(&sensor));
        set_fraction(simulation, fraction);
        for capture in capture?.sensors {
            // The texture is that of the picture before: it is painted over.
            let painted = self.captured.remove(&capture.entity).and_then(|before| before.painted);
            let painted = painted.map(|painted| Painted { of: (painted.of.0, 0), ..painted });
            self.captured.insert(capture.entity, Captured { step, capture, painted, dots: None });
        }
        Ok(())
    }
}

impl Captured {
    /// The picture of a choice, at most so many pixels wide and high, painted when it is another than before.
    ///
    /// # Errors
    /// A text where there is no picture: what was measured, or why there is nothing.
    pub fn paint(
        &mut self,
        context: &egui::Context,
        choice: Option<Choice>,
        longest: u32,
        classes: &Classes,
    ) -> Result<&Painted, String> {
        let of = (choice.ok_or_else(|| self.text())?, longest);
        if self.painted.as_ref().is_none_or(|painted| painted.of != of) {
            let (Picture { image, scale }, reach) = self.picture(of, classes).ok_or_else(|| self.text())?;
            let image = ColorImage::from_rgb([image.width() as usize, image.height() as usize], image.as_raw());
            let texture = match self.painted.take() {
                Some(Painted { mut texture, .. }) => {
                    texture.set(image, TEXTURE);
                    texture
                }
                None => context.load_texture(&self.capture.name, image, TEXTURE),
            };
            self.painted = Some(Painted { texture, scale, reach, of });
        }
        self.painted.as_ref().ok_or_else(String::new)
    }

    fn picture(&self, (choice, longest): (Choice, u32), classes: &Classes) -> Option<(Picture, Option<f32>)> {
        match (&self.capture.data, choice) {
            (SensorData::Camera(camera), Choice::Output(output)) => {
                Some((Picture::of_camera(camera, output, classes, longest)?, None))
            }
            (SensorData::Lidar(lidar), Choice::Points(value)) => {
                let reach = reach_from_above(lidar);
                Some((Picture::from_above(lidar, value, classes, reach, longest)?, Some(reach)))
            }
            _ => None,
        }
    }

    /// Text of a capture without a picture.
    fn text(&self) -> String {
        match &self.capture.data {
            SensorData::Camera(_) => "no picture".to_owned(),
            SensorData::Lidar(_) => "nothing was fired yet".to_owned(),
            SensorData::Reading(reading) => reading.text(),
        }
    }

    /// The points of a lidar to draw over the scene; `None` of another sensor.
    pub fn dots(&mut self, choice: Option<Choice>, classes: &Classes) -> Option<&Dots> {
        let lidar = self.capture.lidar()?;
        if self.dots.as_ref().is_none_or(|(of, _)| *of != choice) {
            self.dots = Some((choice, Dots::new(lidar, choice, classes)));
        }
        self.dots.as_ref().map(|(_, dots)| dots)
    }
}
