//! Full names of sensors, by which outputs call them: no two of a scene have the same.

use crate::scene::format::entities::Entity;
use crate::scene::format::generators::{Generator, Place};
use crate::scene::format::scene::Scene;
use crate::scene::format::surfaces::MeshSource;
use std::collections::HashMap;
use systems::describe::Step;
use systems::describe::{Fault, Trail};

/// A fault for each sensor whose full name an earlier one has, in the order of the file. What is attached to nodes of
/// models is left out: these may be things with names of their own.
pub fn duplicates(scene: &Scene) -> Vec<Fault> {
    let mut names = Names { scene, known: HashMap::new(), faults: Vec::new() };
    let top = Trail::default();
    names.entities(&scene.entities, &top.field("entities"), None, true);
    for (i, generator) in scene.generators.iter().enumerate() {
        names.generator(generator, &top.field("generators").enter(Step::Index(i), "").field("entity"));
    }
    names.faults
}

struct Names<'a> {
    scene: &'a Scene,
    /// Places by full names.
    known: HashMap<String, String>,
    faults: Vec<Fault>,
}

impl<'a> Names<'a> {
    fn entities(&mut self, entities: &'a [Entity], at: &Trail, thing: Option<&str>, is_at_top: bool) {
        for (i, entity) in entities.iter().enumerate() {
            self.entity(entity, &|| at.enter(Step::Index(i), ""), thing, is_at_top);
        }
    }

    /// `thing`: the name of the one that the entity is on.
    fn entity(&mut self, entity: &'a Entity, at: &dyn Fn() -> Trail, thing: Option<&str>, is_at_top: bool) {
        let mounted = self.scene.rigs.of(entity);
        let sensor = entity.sensors().next();
        if sensor.is_none() && entity.children.is_empty() && mounted.is_empty() {
            return;
        }
        let at = at();
        if let (Some(field), Some(own)) = (sensor, &entity.name) {
            self.note(thing, own, &at.field(field));
        }
        // One without a name is called by its number, which no other has.
        let own = entity.name.clone().unwrap_or_else(|| at.fault("").place);
        let thing = if self.is_thing(entity, is_at_top) { Some(own.as_str()) } else { thing };
        self.entities(&entity.children, &at.field("children"), thing, false);
        for one in mounted {
            self.entity(one, &|| at.field("rig"), thing, false);
        }
    }

    /// Names of entities once they are spawned.
    fn is_thing(&self, entity: &Entity, is_at_top: bool) -> bool {
        let is_model = |mesh: &String| matches!(self.scene.meshes.get(mesh), Some(MeshSource::Model(_)));
        let by_itself = is_at_top && entity.mesh.as_ref().is_some_and(is_model) || entity.rig.is_some();
        entity.vehicle.is_some() || entity.instance.unwrap_or(by_itself)
    }

    /// Copies have names of their own, which sensors below them are told apart by if these are things.
    fn generator(&mut self, generator: &'a Generator, at: &Trail) {
        let entity = &generator.entity;
        let is_thing = self.is_thing(entity, true) || !generator.vehicles.is_empty();
        let is_single = match &generator.place {
            Place::Grid(grid) => grid.counts.iter().all(|&count| count == 1),
            Place::Scatter(scatter) => scatter.count == 1,
            Place::Along(_) => false,
        };
        let mut below = entity.children.iter().chain(self.scene.rigs.of(entity));
        if !is_thing && !is_single && below.any(|below| self.has_sensor(below)) {
            self.faults.push(at.fault(
                "expected `instance: true`: by names of things the sensors of one copy are told from those of another",
            ));
        }
    }

    /// There, or below and on no other thing.
    fn has_sensor(&self, entity: &Entity) -> bool {
        entity.sensors().next().is_some() || entity.children.iter().any(|child| self.has_sensor(child))
    }

    fn note(&mut self, thing: Option<&str>, own: &str, at: &Trail) {
        let full = thing.map_or_else(|| own.to_owned(), |thing| format!("{thing}/{own}"));
        let place = at.fault("").place;
        match self.known.get(&full) {
            Some(first) => {
                let message = format!("duplicate sensor name {full:?}: {first} has it, too");
                self.faults.push(at.fault(message));
            }
            None => _ = self.known.insert(full, place),
        }
    }
}
