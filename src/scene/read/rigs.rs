//! Rigs: files that list entities, sensors for the most part, which an entity of a scene takes by its field `rig` and
//! which are then below it. A rig is read and checked once, however many entities take it.
//!
//! Faults of a rig are told with its own file, line and place, behind the first place of the scene that takes it. Names
//! of meshes, materials and classes are those of the scene.

use super::custom_fields::{self, SceneFields};
use crate::problem::Problem;
use crate::scene::format::entities::Entity;
use crate::scene::format::rigs::{Rig, Rigs};
use crate::scene::format::scene::Scene;
use crate::scene::text::file::{placed, problem, read_text, slip_problem};
use crate::scene::text::parse::parse;
use std::path::Path;
use systems::describe::Step;
use systems::describe::{Fault, Trail};

/// Tells if a file is a rig and not a scene: it ends in `.rig.ron`.
pub fn is_rig(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().to_lowercase().ends_with(".rig.ron"))
}

/// Reads the rigs that entities of a scene take, relative to `folder`. One that cannot be read has a fault and is
/// absent.
pub fn read(scene: &Scene, fields: &SceneFields, folder: &Path) -> (Rigs, Vec<Fault>) {
    let mut named = Vec::new();
    let top = Trail::default();
    find(&scene.entities, &top.field("entities"), &mut named);
    for (i, generator) in scene.generators.iter().enumerate() {
        let at = top.field("generators").enter(Step::Index(i), "");
        find_in(&generator.entity, || at.field("entity"), &mut named);
    }
    let (mut rigs, mut faults) = (Rigs::default(), Vec::new());
    for (name, taken_at) in named {
        let path = folder.join(&name);
        match read_one(&path, fields) {
            Ok((text, entities, more)) => {
                faults.extend(placed(more, &path, &text).into_iter().map(|problem| taken_at.fault(problem)));
                rigs.0.push(Rig { name, taken_at, path, text, entities });
            }
            Err(problem) => faults.push(taken_at.fault(problem)),
        }
    }
    (rigs, faults)
}

/// Adds each rig that these entities, and those below them, take, with its first place.
fn find(entities: &[Entity], at: &Trail, named: &mut Vec<(String, Trail)>) {
    for (i, entity) in entities.iter().enumerate() {
        find_in(entity, || at.enter(Step::Index(i), ""), named);
    }
}

fn find_in(entity: &Entity, at: impl Fn() -> Trail, named: &mut Vec<(String, Trail)>) {
    if let Some(rig) = &entity.rig
        && !named.iter().any(|(name, _)| name == rig)
    {
        named.push((rig.clone(), at().field("rig")));
    }
    for (field, below) in [("children", &entity.children), ("attach", &entity.attach)] {
        // Most entities have none, and their place need not be written down.
        if !below.is_empty() {
            find(below, &at().field(field), named);
        }
    }
}

/// The text, what it lists, and what is wrong with fields that the program has added.
pub fn read_one(path: &Path, fields: &SceneFields) -> Result<(String, Vec<Entity>, Vec<Fault>), Problem> {
    let text = read_text(path)?;
    let mut entities = parse::<Vec<Entity>>(&text).map_err(|slip| slip_problem(path, slip))?;
    let faults = custom_fields::read_entities(&mut entities, fields, &text);
    let faults = faults.map_err(|slip| slip_problem(path, slip))?;
    if entities.is_empty() {
        return Err(problem(path, None, "expected at least one entity"));
    }
    Ok((text, entities, faults))
}
