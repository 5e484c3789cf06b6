//! Everything about types of vehicles that serde cannot say.

use crate::import::Model;
use crate::scene::check::walk::Check;
use crate::scene::format::scene::Scene;
use crate::scene::format::vehicle_types::{Lamps, VehicleType, VehicleTypes};
use crate::scene::read::files::{Files, material_names};
use crate::scene::text::faults::unknown;
use std::collections::HashMap;
use systems::assets::Library;
use systems::describe::Fault;
use systems::describe::Step;
use systems::vehicles::VehicleType as StandIn;

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
    c.described(t);
    c.field("transform", |c| c.transform(&t.transform));
    let nodes = |c: &mut Check, nodes: &[String]| c.each("nodes", nodes, |c, node| known_node(c, node, model));
    c.each("wheels", &t.wheels, |c, wheels| nodes(c, &wheels.nodes));
    c.each("cranks", &t.cranks, |c, cranks| nodes(c, &cranks.nodes));
    c.each("forks", &t.forks, |c, node| known_node(c, node, model));
    c.each("swings", &t.swings, |c, swing| c.field("node", |c| known_node(c, &swing.node, model)));
    if let Some(trailer) = &t.trailer {
        c.field("trailer", |c| c.field("node", |c| known_node(c, &trailer.node, model)));
    }
    c.each("lamps", &t.lamps, |c, lamps| {
        nodes(c, &lamps.nodes);
        self::lamps(c, lamps);
    });
    if let Some(paint) = &t.paint {
        c.field("paint", |c| {
            c.each("materials", &paint.materials, |c, name| known_material(c, name, model, library));
        });
    }
}

fn lamps(c: &mut Check, lamps: &Lamps) {
    if let Some(light) = &lamps.light {
        c.field("light", |c| c.whole(light));
        if lamps.shadows {
            c.field("shadows", |c| c.fault("not allowed with `light`, which has a field `shadows` of its own"));
        }
    }
    if lamps.direction == Some([0.0; 3]) {
        c.field("direction", |c| c.fault("expected a direction: at least one of the three other than 0"));
    }
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
