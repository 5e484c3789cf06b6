//! All lights that reach each object, for the policy [`LightPolicy::All`].

use super::instances::InstanceTable;
use super::list::{DrawList, MAX_REACHING};
use crate::assets::library::Library;
use crate::assets::mesh::MeshId;
use crate::assets::object_bounds::world_bounds;
use crate::ecs::parallel::map_in_parallel;
use crate::ecs::stats::FrameStats;
use crate::lights::search::clusters::{self, Level, Scratch};
use crate::lights::selected::SelectedLights;
use crate::lights::table::{LightPolicy, LightTable};
use crate::space::bounds::Sphere;
use crate::space::transform::GlobalTransform;
use bevy_ecs::prelude::*;

/// Objects per task.
const CHUNK: usize = 4096;

/// Lists the lights that reach each drawn object, for the policy `All`; empty for the others.
pub fn list_reaching(
    table: Res<LightTable>,
    policy: Res<LightPolicy>,
    library: Res<Library>,
    stats: Res<FrameStats>,
    mut list: ResMut<DrawList>,
    instances: Res<InstanceTable>,
    objects: Query<(Entity, &MeshId, &GlobalTransform, &SelectedLights)>,
) {
    let list = list.bypass_change_detection();
    if *policy != LightPolicy::All {
        // Gives the memory back, too.
        (list.reaching, list.reaching_elements) = (Vec::new(), 0);
        return;
    }
    if stats.selected == 0 && list.instances.dirty.is_empty() && list.reaching_elements > 0 {
        return;
    }
    let slots = list.instances.objects.len();
    list.reaching_version += 1;
    list.reaching.clear();
    list.reaching_elements = slots as u64 + objects.iter().map(|(.., found)| u64::from(found.reaching)).sum::<u64>();
    if list.reaching_elements > MAX_REACHING {
        return;
    }
    let drawn = objects
        .iter()
        .filter_map(|(object, &mesh, place, _)| Some((instances.slot(object)?, world_bounds(&library, mesh, place)?)));
    let drawn: Vec<(u32, Sphere)> = drawn.collect();
    let (level, table) = (Level::new(), &*table);
    let found = map_in_parallel(drawn.chunks(CHUNK), |drawn| {
        let mut scratch = Scratch::default();
        let reaching = |&(_, sphere)| clusters::reaching(level, table.tree(), table.scored(), sphere, &mut scratch);
        drawn.iter().map(reaching).collect::<Vec<_>>()
    });
    list.reaching.resize(slots, 0);
    for ((slot, _), lights) in drawn.iter().zip(found.iter().flatten()) {
        list.reaching[*slot as usize] = list.reaching.len() as u32;
        list.reaching.extend(lights);
    }
}
