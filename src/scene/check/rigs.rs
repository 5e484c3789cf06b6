//! Rigs, each checked where a scene takes it first, or by itself.

use super::walk::Check;
use crate::problem::Problem;
use crate::scene::format::entities::Entity;
use crate::scene::format::rigs::Rig;
use crate::scene::format::scene::Scene;
use crate::scene::read::custom_fields::SceneFields;
use crate::scene::read::files::Files;
use crate::scene::read::rigs::{is_rig, read_one};
use crate::scene::text::file::placed;
use std::path::Path;
use systems::describe::Fault;
use systems::describe::Step;

/// Faults of the rigs of a scene, each at the place that takes it.
pub fn faults(scene: &Scene, files: &Files) -> Vec<Fault> {
    let mut all = Vec::new();
    for Rig { taken_at, path, text, entities, .. } in &scene.rigs.0 {
        let mut check = Check::new(scene, files);
        check.rig(entities);
        all.extend(placed(check.faults, path, text).into_iter().map(|problem| taken_at.fault(problem)));
    }
    all
}

/// Problems of a file, if it is a rig, but for names that only a scene knows.
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

    /// Number of entities that the rig of an entity becomes.
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
