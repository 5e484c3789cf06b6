//! Layers of one side: which lights have one, and which of their faces are due. Views whose layers have the same side
//! share them.

use super::lamp_layers::Lamp;
use super::layer_casters::{Changes, DueLayer, Layer, Owner};
use super::layer_light::LayerLight;
use super::shadow_layers::{MOST_LAYERS, Turn, fade_bits, upper_half};
use super::shadow_pass::Maps;
use super::sun_levels::{MOST_LEVELS, SunLayer, SunLevel, turn_of};
use super::visible_casters::{ReceiverView, VisibleReceivers};
use crate::renderer::gpu::device::Gpu;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::resources::meshes::Meshes;
use crate::renderer::resources::tables::SHADOW_RECORDS;
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use systems::draw::{DrawList, FrameData, ShadowScene};
use systems::ecs::parallel::{in_parallel, map_in_parallel};
use systems::ecs::tables::DirtySlots;
use systems::lights::{LightRecord, Ranked, ShadowLights, rank_suns};

/// The shadow record of the first directional light, behind those of all lamps; the records of their levels follow.
pub(crate) const SUN_RECORDS: usize = MOST_LAYERS;
const LEVEL_RECORDS: usize = SUN_RECORDS + ShadowLights::MOST_SUNS;
const _: () = assert!(LEVEL_RECORDS + ShadowLights::MOST_SUNS * MOST_LEVELS as usize <= SHADOW_RECORDS as usize);
// A light's record has eight bits for the number of its shadow record.
const _: () = assert!(LEVEL_RECORDS <= u8::MAX as usize);
/// Frames for which layers are kept that no view reads: sensors may be due seldom.
const KEPT_FOR: u64 = 120;

/// Request of a view for shadow maps.
#[derive(Clone, Copy)]
pub(crate) struct ShadowedView<'a> {
    pub ranked: &'a [Ranked],
    pub plan: &'a ViewPlan,
    /// Side of the layers that it reads.
    pub side: u32,
}

/// The layers of one side.
#[derive(Debug)]
pub(crate) struct LayerSet {
    /// Texels.
    side: u32,
    /// By number.
    pub layers: Vec<Layer>,
    by_owner: BTreeMap<Owner, usize>,
    /// The directional lights that have levels, brightest first.
    suns: Vec<Sun>,
    /// Made when a view first asks for it.
    pub maps: Option<Maps>,
    pub due: Vec<DueLayer>,
    /// Versions at the last search for casters.
    seen: Option<Seen>,
}

/// A directional light that has levels.
#[derive(Debug)]
pub(crate) struct Sun {
    pub ranked: Ranked,
    /// Its frame's.
    turn: Turn,
    /// Tangent of half its angle.
    size: f32,
}

/// Versions that lists of casters depend on, beside the lights.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Seen {
    frame: u64,
    meshes: u64,
    textures: u64,
}

impl Sun {
    /// Those of a frame, brightest first.
    pub fn all(frame: &FrameData<'_>) -> Vec<Self> {
        let suns = frame.shadows.map_or_else(Vec::new, |scene| rank_suns(scene.lights()));
        let sun = |ranked: Ranked| {
            let light = frame.list.lights.records.get(ranked.slot as usize)?.unpacked();
            Some(Self { ranked, turn: turn_of(&light), size: light.size })
        };
        suns.into_iter().filter_map(sun).collect()
    }

    /// Its levels around an eye, finest first.
    pub fn levels(&self, eye: Vec3, side: u32) -> impl Iterator<Item = SunLevel> + use<> {
        SunLevel::around(eye, self.turn, side)
    }
}

impl LayerSet {
    /// Makes a set without layers.
    pub fn new(side: u32) -> Self {
        Self {
            side,
            layers: Vec::new(),
            by_owner: BTreeMap::new(),
            suns: Vec::new(),
            maps: None,
            due: Vec::new(),
            seen: None,
        }
    }

    /// Bytes of the layers and bases.
    pub fn bytes(&self) -> u64 {
        let layers = self.maps.as_ref().map_or(0, |maps| maps.layers.len());
        let bases = self.layers.iter().filter(|layer| layer.base.is_some()).count();
        (layers + bases) as u64 * u64::from(self.side * self.side) * 4
    }

    /// Tells if a view has read them of late.
    pub fn is_in_use(&self, frame: u64) -> bool {
        self.seen.is_none_or(|seen| seen.frame + KEPT_FOR >= frame)
    }

    /// The lights that have layers: point lights and spots by their slots, and levels of directional ones.
    pub fn owners(&self) -> impl Iterator<Item = Owner> {
        self.by_owner.keys().copied()
    }

    /// Gives layers to the lamps that views have ranked, and to the levels of suns around their eyes: what has one
    /// keeps it. There is room for as many lamps as a view may ask for, and for more if that is not enough. `layout`:
    /// of group 3 of receivers.
    pub fn choose(
        &mut self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        frame: &FrameData<'_>,
        views: &[ShadowedView<'_>],
    ) {
        self.suns = Sun::all(frame);
        let (suns, side) = (&self.suns, self.side);
        let eyes = views.iter().map(|view| view.plan.view.eye());
        let levels = eyes.flat_map(|eye| suns.iter().flat_map(move |sun| sun.levels(eye, side)));
        let mut wanted: BTreeSet<_> = levels.map(Owner::Sun).collect();
        // The coarsest levels are missing where there is not room for all.
        while wanted.len() > MOST_LAYERS {
            wanted.pop_last();
        }
        let levels = wanted.len();
        // Where views together ask for more than there can be, the most important ones of any view.
        let mut lamps: Vec<Ranked> = views.iter().flat_map(|view| view.ranked).copied().collect();
        lamps.sort_by(|a, b| b.importance.total_cmp(&a.importance).then(a.slot.cmp(&b.slot)));
        for lamp in lamps {
            if wanted.len() < MOST_LAYERS {
                wanted.insert(Owner::Lamp(lamp.slot));
            }
        }
        let needed = wanted.len();
        for layer in &mut self.layers {
            if layer.owner.is_some_and(|owner| !wanted.remove(&owner)) {
                *layer = Layer::default();
            }
        }
        if needed > self.layers.len() || self.maps.is_none() {
            let casting = frame.shadows.map_or(0, |scene| scene.lights().lights().len());
            let most = views.iter().map(|view| view.plan.settings.shadow_maps as usize).max().unwrap_or(0).min(casting);
            self.layers.resize_with(needed.max(levels + most).clamp(1, MOST_LAYERS), Layer::default);
            self.layers.iter_mut().for_each(|layer| layer.light = None);
            // The old ones first: there may not be room for both.
            self.maps = None;
            self.maps = Some(Maps::new(&gpu.device, layout, self.side, self.layers.len()));
        }
        let free = self.layers.iter_mut().filter(|layer| layer.owner.is_none());
        free.zip(wanted).for_each(|(layer, owner)| layer.owner = Some(owner));
        let owners = self.layers.iter().map(|layer| layer.owner);
        self.by_owner = owners.zip(0..).filter_map(|(owner, layer)| Some((owner?, layer))).collect();
    }

    /// The records that shaders read for a view: of lamps by their numbers, counted from 1, which `by_slot` has; then of
    /// suns, and of each sun's levels.
    pub fn records(
        &self,
        view: &ShadowedView<'_>,
        by_slot: &BTreeMap<u32, u8>,
        scene: &ShadowScene<'_>,
        list: &DrawList,
    ) -> Vec<[u32; 4]> {
        let numbers = by_slot.values().map(|&number| usize::from(number));
        let mut records = vec![[0; 4]; numbers.filter(|&number| number <= SUN_RECORDS).max().unwrap_or(0)];
        for Ranked { slot, fade, .. } in view.ranked {
            let layer = self.by_owner.get(&Owner::Lamp(*slot));
            let lamp = lamp(*slot, self.side, scene, list);
            if let (Some(&layer), Some(&number), Some(lamp)) = (layer, by_slot.get(slot), lamp) {
                records[usize::from(number) - 1] = lamp.record(*fade, layer as u32);
            }
        }
        if self.suns.is_empty() {
            return records;
        }
        records.resize(LEVEL_RECORDS + self.suns.len() * MOST_LEVELS as usize, [0; 4]);
        for (number, sun) in self.suns.iter().enumerate() {
            let first = LEVEL_RECORDS + number * MOST_LEVELS as usize;
            let mut count = 0;
            for level in sun.levels(view.plan.view.eye(), self.side) {
                let Some(&layer) = self.by_owner.get(&Owner::Sun(level)) else { break };
                records[first + count] = level.record(view.plan.view.eye(), layer as u32);
                count += 1;
            }
            let [x, y] = sun.turn.words();
            let levels = first as u32 | (count as u32) << 16;
            records[SUN_RECORDS + number] = [x, y, levels, upper_half(sun.size).to_bits() | fade_bits(sun.ranked.fade)];
        }
        records
    }

    /// Finds the faces before which other casters are than those that are drawn there.
    pub fn find_due(
        &mut self,
        gpu: &Gpu,
        frame: &FrameData<'_>,
        views: &[ShadowedView<'_>],
        meshes: &Meshes,
        textures_version: u64,
    ) {
        let (list, Some(scene)) = (frame.list, frame.shadows) else { return };
        let seen = Seen { frame: list.frame, meshes: meshes.version(), textures: textures_version };
        let before = self.seen.replace(seen);
        if before.is_none_or(|before| before.meshes != seen.meshes) {
            // A mesh may be another one under the same number.
            self.layers.iter_mut().for_each(|layer| layer.light = None);
        }
        let is_same = before.is_some_and(|before| before.frame == seen.frame);
        let follows = is_same || before.is_some_and(|before| before.frame + 1 == seen.frame);
        let nothing = DirtySlots::default();
        let casters = if is_same || !follows || self.by_owner.is_empty() {
            Vec::new()
        } else {
            scene.changed_casters(&list.instances, frame.library)
        };
        let receivers = if casters.is_empty() {
            VisibleReceivers::default()
        } else {
            VisibleReceivers::new(views.iter().map(|view| ReceiverView::new(view.plan)), scene.bounds())
        };
        let changes = Changes {
            slots: if is_same { &nothing } else { &list.instances.dirty },
            casters,
            materials: if is_same { &nothing } else { &list.materials.dirty },
            all_masks: !follows || before.is_some_and(|before| before.textures != seen.textures),
            frame: seen.frame,
            receivers,
        };
        let is_still = changes.slots.is_empty() && changes.materials.is_empty() && !changes.all_masks;
        let light_of = |owner| match owner {
            Owner::Lamp(slot) => lamp(slot, self.side, &scene, list).map(LayerLight::Lamp),
            Owner::Sun(level) => {
                let alike = self.suns.iter().filter(|sun| sun.turn == level.turn);
                let widest = alike.map(|sun| sun.size).fold(0.0, f32::max);
                Some(LayerLight::Sun(SunLayer::new(level, widest)))
            }
        };
        let lights = self.layers.iter_mut().filter_map(|layer| Some((light_of(layer.owner?)?, layer)));
        let is_concerned = |(light, layer): &(_, &mut Layer)| {
            !is_still || !follows || layer.light != Some(*light) || layer.leaves_out()
        };
        let concerned: Vec<_> = lights.filter(is_concerned).collect();
        let library = &*frame.library;
        in_parallel(concerned.into_iter(), |(light, layer)| {
            if layer.light != Some(light) || !follows {
                layer.find_all(light, &scene, library, meshes, changes.all_masks);
            } else {
                layer.change(&light, &changes, meshes);
            }
        });
        let layers = self.layers.iter_mut().enumerate().filter(|(_, layer)| layer.owner.is_some());
        let layers: Vec<_> =
            layers.filter_map(|(number, layer)| layer.is_due(is_same).then_some((number, layer))).collect();
        let due = |(number, layer): (usize, &mut Layer)| layer.due(number, gpu, meshes, is_same, seen.frame, self.side);
        self.due = map_in_parallel(layers.into_iter(), due);
    }
}

/// The point light or spot in a slot.
fn lamp(slot: u32, side: u32, scene: &ShadowScene<'_>, list: &DrawList) -> Option<Lamp> {
    let near = scene.lights().get(slot)?.near;
    let light: LightRecord = list.lights.records.get(slot as usize)?.unpacked();
    Some(Lamp::new(&light, near, side))
}
