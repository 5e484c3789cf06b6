//! Large objects are drawn in pieces, which choose lights of their own.

use super::below::descendants;
use super::placement::Placement;
use super::spawner::Spawner;
use crate::name;
use crate::scene::format::entities::Entity as Source;
use crate::scene::read::items::Shape;
use bevy_ecs::prelude::*;
use glam::Affine3A;
use systems::draw::pieces::{self, PiecesReport};
use systems::lights::Light;
use systems::space::Aabb;

/// Pieces of a scene, beyond which objects are left whole. Each takes a page of 64 slots in the instance table: so many
/// are 805 MB, and a texture of 16384 rows, which adapters have, holds a third more.
const MOST_PIECES: usize = 1 << 17;

impl Spawner<'_> {
    /// Notes what may have to be drawn in pieces, before anything with a length of its own is below it.
    pub fn note_large(&mut self, source: &Source, placement: &Placement, entity: Entity, world_from_entity: &Affine3A) {
        let metres = source.piece_metres.map_or(self.piece_metres, |own| own.0);
        let is_longer = |aabb: &Aabb| pieces::is_longer(*aabb, world_from_entity, metres);
        match placement.mesh.and_then(|mesh| self.items.shape(mesh)) {
            Some(Shape::Mesh(_, aabb)) if is_longer(aabb) => self.large.push((entity, metres)),
            Some(Shape::Model(_, aabb, _)) if is_longer(aabb) => {
                let below = descendants(self.world, entity).into_iter();
                self.large.extend(below.map(|part| (part, metres)));
            }
            _ => {}
        }
    }

    /// Draws large objects in pieces, where there are lights to choose between.
    pub fn cut(&mut self) {
        if !has_a_choice(self.world) {
            return;
        }
        let (mut made, large) = (0, std::mem::take(&mut self.large));
        for (i, &(entity, metres)) in large.iter().enumerate() {
            if made >= MOST_PIECES {
                let whole = large.len() - i;
                self.found.warnings.push(format!(
                    "{whole} large objects are drawn whole: the scene has {made} pieces already; choose a \
                     larger piece_metres"
                ));
                break;
            }
            let report = pieces::draw_one_in_pieces(self.world, entity, metres).unwrap_or_default();
            made += report.pieces;
            self.found.warnings.extend(too_many(&name::of_entity(self.world, entity), report, metres));
        }
    }
}

/// Draws the large objects of a model that is a whole scene in pieces. Its lengths may not be metres, so at least
/// 1/64 of its own is left.
pub fn cut_model(root: Entity, bounds: Aabb, world: &mut World) {
    if has_a_choice(world) {
        let length = (bounds.max - bounds.min).max_element();
        pieces::draw_in_pieces(world, root, pieces::DEFAULT_METRES.max(length / 64.0));
    }
}

/// Tells if there are more lights than an object takes.
fn has_a_choice(world: &mut World) -> bool {
    world.query::<&Light>().iter(world).nth(3).is_some()
}

/// Warns where pieces are longer than was asked for.
fn too_many(name: &str, report: PiecesReport, metres: f32) -> Option<String> {
    (report.metres > metres * 1.01).then(|| {
        let PiecesReport { metres: made, .. } = report;
        format!("{name}: drawn in pieces of {made:.3} m, not {metres} m, of which there would be too many")
    })
}
