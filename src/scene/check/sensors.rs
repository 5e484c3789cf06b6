//! Sensors, and the classes of what they see.

use super::walk::Check;
use crate::scene::format::sensors::{Class, Mounted, classes};
use crate::scene::format::values::Named;
use crate::scene::text::faults::unknown;
use systems::sensors::SensorKind;

impl Check<'_> {
    pub fn classes(&mut self, classes: &Named<Class>) {
        self.field("classes", |c| {
            c.entries(classes, |c, class| {
                let is_taken =
                    classes.entries().iter().any(|(name, own)| std::ptr::eq(own, class) && name == "unlabeled");
                if is_taken {
                    c.fault("reserved name: what has no class is called so, with id 0");
                }
                let same = classes.entries().iter().take_while(|(_, other)| !std::ptr::eq(other, class));
                if let Some((name, _)) = same.into_iter().find(|(_, other)| other.id == class.id) {
                    c.field("id", |c| c.fault(format_args!("duplicate id {}: class {name:?} has it", class.id)));
                }
                c.described(class);
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

    /// Checks a field that makes the entity a sensor, of so many before it.
    pub fn sensor_field(&mut self, before: usize, is_named: bool) {
        if !is_named {
            self.fault("expected the entity to have a name, by which outputs call the sensor");
        }
        if before > 0 {
            self.fault("expected one sensor: another is a child of the entity");
        }
    }

    pub fn sensor(&mut self, Mounted(sensor): &Mounted) {
        let faults = sensor.faults();
        self.within(&faults);
        if matches!(sensor.kind, SensorKind::Custom { .. }) {
            self.fault("expected a kind of the library; those that programs add are fields of entities");
        } else {
            let fits = sensor.check_in(self.scene.clock.step_seconds, self.scene.geo_origin.is_some());
            fits.unwrap_or_else(|message| self.fault(message));
        }
    }
}
