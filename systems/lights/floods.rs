//! Reach of each light through portals, kept up to date with the lights and portals that change.
//!
//! A world without cells has none of this.

use super::record::LightRecord;
use super::relevance::ScoredLight;
use super::table::LightTable;
use super::tree::LightTree;
use crate::cells::cells::{Cells, OUTSIDE};
use crate::cells::doors::Portal;
use crate::cells::flood::{Flood, Source};
use crate::cells::occupied::Occupied;
use crate::ecs::stats::FrameStats;
use bevy_ecs::prelude::*;
use std::collections::BTreeSet;

/// A light that reaches other objects than before, or shines otherwise.
#[derive(Clone, Debug)]
pub(crate) struct FloodChange {
    pub slot: u32,
    /// Before and after.
    pub lights: [ScoredLight; 2],
    /// `None`: as it is now.
    pub flood_before: Option<Flood>,
}

/// The [`Flood`] of each light.
#[derive(Resource, Clone, Debug, Default)]
pub struct LightFloods {
    /// By slot.
    floods: Vec<Flood>,
    /// By cell, [`OUTSIDE`] first: slots of the lights that have a window there, ascending. Lights that are outside
    /// are not in the list of outside.
    of_cell: Vec<Vec<u32>>,
    /// Slots of the lights that are outside, ascending.
    outdoors: Vec<u32>,
    /// All lights, but those in cells off; and a tree of them.
    outdoor_lights: Vec<ScoredLight>,
    outdoor_tree: LightTree,
    /// Opening of each portal, 0 to 1.
    open: Vec<f32>,
    /// In this frame.
    changes: Vec<FloodChange>,
    /// The cells are others than in the frame before.
    are_new: bool,
}

impl LightFloods {
    /// Reach of the light in a slot.
    pub fn flood(&self, slot: u32) -> &Flood {
        &self.floods[slot as usize]
    }

    /// Share of the light in a slot that an object gets, 0 to 1.
    pub fn share(&self, slot: u32, object: &Occupied) -> f32 {
        self.floods[slot as usize].share(object)
    }

    /// Opening of each portal, 0 to 1.
    pub fn open(&self) -> &[f32] {
        &self.open
    }

    pub(crate) fn has_cells(&self) -> bool {
        !self.of_cell.is_empty()
    }

    /// Tells if every object has to choose again.
    pub(crate) fn are_new(&self) -> bool {
        self.are_new
    }

    /// In this frame.
    pub(crate) fn changes(&self) -> &[FloodChange] {
        &self.changes
    }

    /// Slots of the lights that may reach an object in a cell; of outside, those of lights in cells.
    pub(crate) fn of_cell(&self, cell: u32) -> &[u32] {
        &self.of_cell[cell as usize]
    }

    /// Slots of the lights that are outside.
    pub(crate) fn outdoors(&self) -> &[u32] {
        &self.outdoors
    }

    /// For a search among the lights that are outside alone: a tree of them, and all lights, those in cells off.
    pub(crate) fn search_outdoors(&self) -> (&LightTree, &[ScoredLight]) {
        (&self.outdoor_tree, &self.outdoor_lights)
    }

    /// Gives a slot another flood. Returns the one before if that was another.
    fn set(&mut self, slot: u32, flood: Flood) -> Option<Flood> {
        if self.floods[slot as usize] == flood {
            return None;
        }
        let before = std::mem::replace(&mut self.floods[slot as usize], flood);
        for (flood, is_now) in [(&before, false), (&self.floods[slot as usize], true)] {
            for window in &flood.windows {
                let is_own = window.cell == OUTSIDE && flood.cell == OUTSIDE;
                let list = if is_own { &mut self.outdoors } else { &mut self.of_cell[window.cell as usize] };
                match (list.binary_search(&slot), is_now) {
                    (Ok(at), false) => _ = list.remove(at),
                    (Err(at), true) => list.insert(at, slot),
                    // A second window of the same cell.
                    _ => {}
                }
            }
        }
        Some(before)
    }
}

/// Origin of a light's flood; `None` for a light that is off.
fn source(light: &ScoredLight) -> Option<Source> {
    match light.kind {
        LightRecord::OFF => None,
        LightRecord::DIRECTIONAL => Some(Source::Parallel(light.axis)),
        _ => Some(Source::Point(light.position, light.range)),
    }
}

/// Finds anew what lights reach that moved, or on whose way a portal opened or shut.
pub fn update_floods(
    table: Res<LightTable>,
    cells: Res<Cells>,
    portals: Query<&Portal>,
    mut floods: ResMut<LightFloods>,
    mut stats: ResMut<FrameStats>,
) {
    stats.floods = 0;
    if cells.is_empty() && !floods.has_cells() {
        return;
    }
    let floods = &mut *floods;
    floods.changes.clear();
    floods.are_new = cells.is_changed();
    if cells.is_empty() {
        *floods = LightFloods { are_new: true, ..LightFloods::default() };
        return;
    }
    let scored = table.scored();
    let mut concerned: BTreeSet<u32> = BTreeSet::new();
    if floods.are_new {
        *floods = LightFloods { are_new: true, ..LightFloods::default() };
        floods.of_cell = vec![Vec::new(); cells.cells().len() + 1];
        floods.open = vec![f32::NAN; cells.openings().len()];
        concerned.extend(0..scored.len() as u32);
    }
    floods.floods.resize_with(scored.len(), Flood::default);
    floods.outdoor_lights.resize(scored.len(), ScoredLight::OFF);
    for (number, opening) in cells.openings().iter().enumerate() {
        let portal = opening.portal.and_then(|portal| portals.get(portal).ok());
        let open = portal.map_or(1.0, |portal| portal.open).clamp(0.0, 1.0);
        if std::mem::replace(&mut floods.open[number], open) != open {
            for cell in opening.between {
                concerned.extend(floods.of_cell(cell));
                if cell == OUTSIDE {
                    concerned.extend(floods.outdoors());
                }
            }
        }
    }
    let mut moved = Vec::new();
    for (&lights, &slot) in table.changes().iter().zip(table.changed()) {
        moved.push(slot);
        floods.changes.push(FloodChange { slot, lights, flood_before: None });
        if source(&lights[0]) != source(&lights[1]) {
            concerned.insert(slot);
        }
    }
    for slot in concerned {
        let light = scored[slot as usize];
        let flood = source(&light).map(|source| {
            stats.floods += 1;
            Flood::new(&cells, &floods.open, source)
        });
        let Some(before) = floods.set(slot, flood.unwrap_or_default()) else { continue };
        let of_slot = |change: &&mut FloodChange| change.slot == slot;
        match floods.changes.iter_mut().find(of_slot) {
            Some(change) => change.flood_before = Some(before),
            None => floods.changes.push(FloodChange { slot, lights: [light; 2], flood_before: Some(before) }),
        }
        moved.push(slot);
    }
    for &slot in &moved {
        let is_outdoors = floods.floods[slot as usize].cell == OUTSIDE;
        let light = if is_outdoors { scored[slot as usize] } else { ScoredLight::OFF };
        floods.outdoor_lights[slot as usize] = light;
    }
    floods.outdoor_tree.update(&floods.outdoor_lights, &moved);
}
