//! Everything about types of vehicles that serde cannot say.

use crate::import::Model;
use crate::scene::check::walk::{Check, SIZES};
use crate::scene::format::scene::Scene;
use crate::scene::format::vehicle_types::{Lamps, VehicleType, VehicleTypes};
use crate::scene::read::files::{Files, material_names};
use crate::scene::text::faults::unknown;
use std::collections::HashMap;
use systems::assets::Library;
use systems::assets::color_text::BRIGHTEST;
use systems::describe::Fault;
use systems::describe::Step;
use systems::vehicles::VehicleType as StandIn;

/// Metres per second squared: more than any wheel gives.
const HARDEST: f32 = 100.0;

/// All faults of a file whose models have been read.
pub fn faults(source: &VehicleTypes, models: &HashMap<String, Model>, library: &Library) -> Vec<Fault> {
    let (scene, files) = (Scene::default(), Files::default());
    let mut check = Check::new(&scene, &files);
    check.field("types", |c| {
        c.entries(&source.types, |c, value| vehicle_type(c, value, models.get(&value.model), library));
        for (i, name) in source.types.names().enumerate().filter(|(_, name)| *name == StandIn::default().name) {
            let message = format!("reserved name {name:?}: the placeholder vehicle type has it");
            c.inside(Step::Entry(i), name, |c| c.fault(message));
        }
    });
    check.faults
}

fn vehicle_type(c: &mut Check, t: &VehicleType, model: Option<&Model>, library: &Library) {
    c.field("transform", |c| c.transform(&t.transform));
    let lengths = (0.05, 100.0);
    if let Some(size) = &t.size {
        c.numbers("size", size, lengths.0, lengths.1);
    }
    if let Some(wheelbase) = t.wheelbase {
        c.number("wheelbase", wheelbase, lengths.0, lengths.1);
    }
    if let Some(track) = t.track {
        c.number("track", track, 0.0, lengths.1);
    }
    if let Some(eye) = &t.eye {
        c.numbers("eye", eye, -1e7, 1e7);
    }
    c.number("mass", t.mass, 1.0, 1e6);
    c.field("limits", |c| {
        c.number("speed_kmh", t.limits.speed_kmh, 0.1, 2000.0);
        c.number("reverse_speed_kmh", t.limits.reverse_speed_kmh, 0.0, 2000.0);
        c.number("acceleration", t.limits.acceleration, 0.01, HARDEST);
        c.number("braking", t.limits.braking, 0.01, HARDEST);
        c.number("steering_degrees", t.limits.steering_degrees, 0.1, 85.0);
        c.number("steering_degrees_per_second", t.limits.steering_degrees_per_second, 0.1, 1e4);
        c.number("lateral_acceleration", t.limits.lateral_acceleration, 0.01, HARDEST);
    });
    c.field("driver", |c| {
        c.number("speed_factor", t.driver.speed_factor, 0.01, 10.0);
        c.number("headway_seconds", t.driver.headway_seconds, 0.0, 60.0);
        c.number("gap_metres", t.driver.gap_metres, 0.01, 100.0);
        c.number("acceleration", t.driver.acceleration, 0.01, HARDEST);
        c.number("braking", t.driver.braking, 0.01, HARDEST);
        c.number("exponent", t.driver.exponent, 0.1, 100.0);
    });
    c.each("wheels", &t.wheels, |c, wheels| {
        c.each("nodes", &wheels.nodes, |c, node| known_node(c, node, model));
        if let Some(radius) = wheels.radius {
            c.number("radius", radius, 0.01, 10.0);
        }
    });
    c.each("cranks", &t.cranks, |c, cranks| {
        c.each("nodes", &cranks.nodes, |c, node| known_node(c, node, model));
        c.number("radius", cranks.radius, 0.01, 100.0);
    });
    c.each("forks", &t.forks, |c, node| known_node(c, node, model));
    c.each("swings", &t.swings, |c, swing| {
        c.field("node", |c| known_node(c, &swing.node, model));
        c.number("degrees", swing.degrees, -180.0, 180.0);
        c.number("stride_metres", swing.stride_metres, 0.01, SIZES.1);
        c.number("phase", swing.phase, -1e3, 1e3);
    });
    if let Some(trailer) = &t.trailer {
        c.field("trailer", |c| {
            c.field("node", |c| known_node(c, &trailer.node, model));
            c.number("length", trailer.length, lengths.0, lengths.1);
        });
    }
    c.each("lamps", &t.lamps, |c, lamps| self::lamps(c, lamps, model));
    if let Some(paint) = &t.paint {
        c.field("paint", |c| {
            c.each("materials", &paint.materials, |c, name| known_material(c, name, model, library));
            c.each("colors", &paint.colors, |c, color| match color.0 {
                Ok(rgb) => rgb.to_array().into_iter().for_each(|channel| c.in_range(channel, 0.0, BRIGHTEST)),
                Err(bad) => c.fault(bad),
            });
        });
    }
}

fn lamps(c: &mut Check, lamps: &Lamps, model: Option<&Model>) {
    c.each("nodes", &lamps.nodes, |c, node| known_node(c, node, model));
    if let Some(light) = &lamps.light {
        c.field("light", |c| c.described(light));
        if lamps.shadows {
            c.field("shadows", |c| c.fault("not allowed with `light`, which has a field `shadows` of its own"));
        }
    }
    if let Some(color) = lamps.color {
        c.color("color", color, BRIGHTEST);
    }
    if let Some(direction) = &lamps.direction {
        c.numbers("direction", direction, -SIZES.1, SIZES.1);
        if *direction == [0.0; 3] {
            c.field("direction", |c| c.fault("expected a direction: at least one of the three other than 0"));
        }
    }
    c.number("glow", lamps.glow, 0.0, BRIGHTEST);
}

/// A model that cannot be read has been complained about already.
fn known_node(c: &mut Check, node: &str, model: Option<&Model>) {
    let Some(model) = model else { return };
    if !model.nodes.iter().any(|n| n.name == node) {
        c.fault(unknown("node", node, model.nodes.iter().map(|n| n.name.as_str())));
    }
}

fn known_material(c: &mut Check, name: &str, model: Option<&Model>, library: &Library) {
    let Some(model) = model else { return };
    let names = material_names(model, library);
    if !names.contains(&name) {
        c.fault(unknown("material", name, names.into_iter()));
    }
}
