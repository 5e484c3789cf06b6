//! Names that a command may use and that two things have: it reaches the first of them only.

use crate::scene::faults::{Fault, Trail};
use crate::scene::format::{Entity, Scene};
use crate::scene::places::Step;
use std::collections::HashMap;

/// Cameras and vehicles whose name is that of an earlier one; none of it is refused.
pub fn shared(scene: &Scene) -> Vec<Fault> {
    let mut names = Names::default();
    names.entities(&Trail::default().field("entities"), &scene.entities);
    names.faults
}

#[derive(Default)]
struct Names<'a> {
    /// Where the first of each name stands.
    cameras: HashMap<&'a str, String>,
    vehicles: HashMap<&'a str, String>,
    faults: Vec<Fault>,
}

impl<'a> Names<'a> {
    fn entities(&mut self, at: &Trail, entities: &'a [Entity]) {
        for (i, entity) in entities.iter().enumerate() {
            // Most have neither, and their place need not be written down.
            let (named, below) = (entity.name.as_deref(), !entity.children.is_empty() || !entity.attach.is_empty());
            let is_reached = named.is_some() && (entity.camera.is_some() || entity.vehicle.is_some());
            if !is_reached && !below {
                continue;
            }
            let at = at.enter(Step::Index(i), "");
            if let Some(name) = named.filter(|_| entity.camera.is_some()) {
                let command = format!("--camera {name:?}");
                note(&mut self.cameras, &mut self.faults, &at, ("camera", name), &command);
            }
            if let Some(name) = named.filter(|_| entity.vehicle.is_some()) {
                let command = format!("--camera \"chase {name}\"");
                note(&mut self.vehicles, &mut self.faults, &at, ("vehicle", name), &command);
            }
            self.entities(&at.field("children"), &entity.children);
            self.entities(&at.field("attach"), &entity.attach);
        }
    }
}

fn note<'a>(
    known: &mut HashMap<&'a str, String>,
    faults: &mut Vec<Fault>,
    at: &Trail,
    (kind, name): (&str, &'a str),
    command: &str,
) {
    let own = at.fault("");
    match known.get(name) {
        Some(first) => faults.push(at.fault(format_args!(
            "{first} is a {kind} named {name:?}, too: {command} reaches that one only; expected another name"
        ))),
        None => _ = known.insert(name, own.place),
    }
}
