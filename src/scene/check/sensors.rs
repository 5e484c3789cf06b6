//! Sensors, and the classes of what they see.

use super::lenses::LARGEST_PICTURE;
use super::walk::{Check, SIZES};
use crate::scene::format::sensors::{self, CameraSensor, Class, Sensor, classes};
use crate::scene::format::values::Named;
use crate::scene::text::faults::unknown;
use crate::scene::text::places::Step;

/// Steps.
const SLOWEST: u32 = systems::sensors::Sensor::SLOWEST;

impl Check<'_> {
    pub fn classes(&mut self, classes: &Named<Class>) {
        self.field("classes", |c| {
            c.entries(classes, |c, class| {
                let is_taken =
                    classes.entries().iter().any(|(name, own)| std::ptr::eq(own, class) && name == "unlabeled");
                if is_taken {
                    c.fault("reserved name: what has no class is called so, with id 0");
                }
                if class.id == 0 {
                    c.field("id", |c| c.fault("expected a number from 1 to 255: 0 is what has no class"));
                }
                let same = classes.entries().iter().take_while(|(_, other)| !std::ptr::eq(other, class));
                if let Some((name, _)) = same.into_iter().find(|(_, other)| other.id == class.id) {
                    c.field("id", |c| c.fault(format_args!("duplicate id {}: class {name:?} has it", class.id)));
                }
                c.color("color", class.color, 1.0);
            });
        });
    }

    /// The name of a class of the scene, or of Cityscapes where it has none of its own.
    pub fn known_class(&mut self, name: &str) {
        let classes = classes(&self.scene.classes);
        if classes.find(name).is_none() && !self.is_of_any_scene {
            let message = unknown("class", name, classes.0.iter().map(|class| class.name.as_str()));
            self.fault(message);
        }
    }

    pub fn sensor(&mut self, sensor: &Sensor, is_named: bool) {
        if !is_named {
            self.fault("expected the entity to have a name, by which outputs call the sensor");
        }
        match sensor {
            Sensor::Camera(camera) => self.camera_sensor(camera),
            Sensor::Lidar(lidar) => {
                self.rate(lidar.every, lidar.phase);
                let lidar_sensor = lidar.lidar();
                if let Err(message) = lidar_sensor.check() {
                    return self.fault(message);
                }
                let seconds = self.scene.clock.step_seconds * f64::from(lidar.every);
                if let Err(message) = lidar_sensor.check_beams(seconds) {
                    self.fault(message);
                }
            }
            other => self.motion_sensor(&sensors::sensor(other)),
        }
    }

    pub fn rate(&mut self, every: u32, phase: u32) {
        if !(1..=SLOWEST).contains(&every) {
            self.field("every", |c| c.fault(format_args!("expected steps from 1 to {SLOWEST}, found {every}")));
        } else if phase >= every {
            let message = format!("expected less than every, which is {every}, found {phase}");
            self.field("phase", |c| c.fault(message));
        }
    }

    fn camera_sensor(&mut self, camera: &CameraSensor) {
        self.field("size", |c| {
            for (i, side) in camera.size.into_iter().enumerate() {
                if !(1..=LARGEST_PICTURE).contains(&side) {
                    let message = format!("expected pixels from 1 to {LARGEST_PICTURE}, found {side}");
                    c.inside(Step::Index(i), "", |c| c.fault(message));
                }
            }
        });
        self.number("near", camera.near, SIZES.0, SIZES.1);
        if let Some(far) = camera.far
            && !(far > camera.near && far <= 1e9)
        {
            self.field("far", |c| c.fault(format_args!("expected more than near, at most 1e9, found {far}")));
        }
        self.field("lens", |c| c.lens(&camera.lens, camera.size));
        if camera.outputs.is_empty() {
            self.field("outputs", |c| c.fault("expected at least one output"));
        }
        if ![1, 4].contains(&camera.samples) {
            self.field("samples", |c| c.fault(format_args!("expected 1 or 4, found {}", camera.samples)));
        }
        if let Err(message) = camera.camera().check_light() {
            self.fault(message);
        }
        self.rate(camera.every, camera.phase);
    }
}
