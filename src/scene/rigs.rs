//! Rigs: files that list entities, sensors for the most part, which an entity of a scene takes by its field `rig` and
//! which are then below it. A rig is read and checked once, however many entities take it.
//!
//! What is wrong with a rig is told with its own file, line and place, behind the first place of the scene that takes
//! it. Names of meshes, materials and classes are those of the scene.

use super::check::Check;
use super::custom_fields::{self, SceneFields};
use super::faults::{Fault, Trail};
use super::files::Files;
use super::format::{Entity, Scene};
use super::places::Step;
use super::{parse, placed, problem, read_text, slip_problem};
use crate::problem::Problem;
use std::path::{Path, PathBuf};

/// The rigs of a scene, in the order in which it takes them first.
#[derive(Debug, Default)]
pub struct Rigs(Vec<Rig>);

#[derive(Debug)]
struct Rig {
    /// As the scene names it.
    name: String,
    /// Where that is, first.
    taken_at: Trail,
    path: PathBuf,
    text: String,
    entities: Vec<Entity>,
}

impl Rigs {
    /// What an entity has below it by its rig.
    pub fn of(&self, entity: &Entity) -> &[Entity] {
        let taken = entity.rig.as_ref().and_then(|name| self.0.iter().find(|rig| rig.name == *name));
        taken.map_or(&[], |rig| &rig.entities)
    }

    /// Their files.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.0.iter().map(|rig| rig.path.clone())
    }
}

/// Whether a file is a rig and not a scene: it ends in `.rig.ron`.
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
fn read_one(path: &Path, fields: &SceneFields) -> Result<(String, Vec<Entity>, Vec<Fault>), Problem> {
    let text = read_text(path)?;
    let mut entities = parse::<Vec<Entity>>(&text).map_err(|slip| slip_problem(path, slip))?;
    let faults = custom_fields::read_entities(&mut entities, fields, &text);
    let faults = faults.map_err(|slip| slip_problem(path, slip))?;
    if entities.is_empty() {
        return Err(problem(path, None, "expected at least one entity"));
    }
    Ok((text, entities, faults))
}

/// What is wrong with the rigs of a scene, each at the place that takes it.
pub fn faults(scene: &Scene, files: &Files) -> Vec<Fault> {
    let mut all = Vec::new();
    for Rig { taken_at, path, text, entities, .. } in &scene.rigs.0 {
        let mut check = Check::new(scene, files);
        check.rig(entities);
        all.extend(placed(check.faults, path, text).into_iter().map(|problem| taken_at.fault(problem)));
    }
    all
}

/// What is wrong with a file, if it is a rig, but for names that only a scene knows.
pub fn check(path: &Path, fields: &SceneFields) -> Option<Vec<Problem>> {
    is_rig(path).then(|| {
        let (text, entities, mut faults) = match read_one(path, fields) {
            Ok(read) => read,
            Err(problem) => return vec![problem],
        };
        let (scene, files) = (Scene::default(), Files::default());
        let mut check = Check::new(&scene, &files);
        check.is_of_any_scene = true;
        check.rig(&entities);
        faults.append(&mut check.faults);
        placed(faults, path, &text)
    })
}

impl<'a> Check<'a> {
    fn rig(&mut self, entities: &'a [Entity]) {
        for (i, entity) in entities.iter().enumerate() {
            self.inside(Step::Index(i), "", |c| {
                c.entity(entity, &[], false);
                c.mounted(entity);
                if entity.vehicle.is_some() {
                    c.field("vehicle", |c| c.fault("not allowed within a rig: vehicles move by themselves"));
                }
            });
        }
    }

    /// How many entities the rig of an entity becomes.
    pub(super) fn mounted_on(&self, entity: &Entity) -> u64 {
        let mounted = self.scene.rigs.of(entity).iter();
        mounted.fold(0, |sum, mounted| sum.saturating_add(self.size_of(mounted)))
    }

    /// There is no rig within a rig.
    fn size_of(&self, entity: &Entity) -> u64 {
        let own = entity.mesh.as_ref().map_or(1, |mesh| self.entities_of(mesh));
        let below = entity.children.iter().chain(&entity.attach);
        below.fold(own, |sum, below| sum.saturating_add(self.size_of(below)))
    }

    /// Refuses what nothing that is mounted has, here and below.
    fn mounted(&mut self, entity: &'a Entity) {
        let refused = [
            ("rig", entity.rig.is_some(), "not allowed within a rig"),
            ("camera", entity.camera.is_some(), "not allowed within a rig: views are the scene's; use `sensor`"),
            ("signal_head", entity.signal_head.is_some(), "not allowed within a rig"),
        ];
        for (field, _, message) in refused.into_iter().filter(|(_, is_there, _)| *is_there) {
            self.field(field, |c| c.fault(message));
        }
        self.each("children", &entity.children, Self::mounted);
        self.each("attach", &entity.attach, Self::mounted);
    }
}
