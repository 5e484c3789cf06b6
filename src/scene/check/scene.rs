//! A whole scene: one walk over the file collects every fault with its place.

use super::sensor_names;
use super::walk::Check;
use crate::scene::format::generators::{Generator, MOST_ENTITIES};
use crate::scene::format::scene::Scene;
use crate::scene::read::files::Files;
use systems::describe::Fault;
use systems::weather::Weather;

/// Seconds: a longer step of drivers and physics would be computed for minutes, and shows nothing of them.
const LONGEST_WITH_VEHICLES: f64 = 1.0;

fn has_vehicles(scene: &Scene) -> bool {
    let of_generator = |g: &Generator| !g.vehicles.is_empty() || g.entity.vehicle.is_some();
    scene.entities.iter().any(|e| e.vehicle.is_some()) || scene.generators.iter().any(of_generator)
}

/// All faults of a scene whose files have been read.
pub fn faults(scene: &Scene, files: &Files) -> Vec<Fault> {
    let mut check = Check::new(scene, files);
    check.scene();
    check.faults.extend(sensor_names::duplicates(scene));
    check.faults
}

impl Check<'_> {
    fn scene(&mut self) {
        let scene = self.scene;
        self.field("piece_metres", |c| c.described(&scene.piece_metres));
        self.part("lights", scene.lights.as_ref());
        self.part("origin", scene.origin.as_ref());
        self.part("geo_origin", scene.geo_origin.as_ref());
        self.field("environment", |c| c.described(&scene.environment));
        self.field("weather", |c| {
            let Some(weather) = &scene.weather else { return };
            c.described(weather);
            if weather.0.needs_place() && scene.geo_origin.is_none() {
                c.fault(Weather::EXPECTED_PLACE);
            }
        });
        self.field("clock", |c| {
            c.described(&scene.clock);
            let (seconds, most) = (scene.clock.step_seconds, LONGEST_WITH_VEHICLES);
            if seconds > most && has_vehicles(scene) {
                let message = format!("expected at most {most} where vehicles drive, found {seconds}");
                c.field("step_seconds", |c| c.fault(message));
            }
        });
        self.field("materials", |c| {
            c.entries(&scene.materials, Self::material);
        });
        self.field("meshes", |c| {
            c.entries(&scene.meshes, Self::mesh);
        });
        self.classes(&scene.classes);
        self.cells();
        self.roads();
        let mut entities = 0u64;
        self.each("entities", &scene.entities, |c, e| entities = entities.saturating_add(c.entity(e, &[], false)));
        self.each("generators", &scene.generators, |c, g| entities = entities.saturating_add(c.generator(g)));
        // A count that is refused by itself need not be refused twice.
        if entities > MOST_ENTITIES.into() && self.faults.is_empty() {
            let message = format!("expected at most {MOST_ENTITIES} entities, found {entities}");
            self.field("generators", |c| c.fault(message));
        }
    }
}
