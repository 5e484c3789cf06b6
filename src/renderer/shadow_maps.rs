//! Shadow maps: which lights have layers, what is drawn into these, and when.
//!
//! ```text
//! choose   each view ranks its lamps (systems/lights/importance.rs), and has levels of the suns around its eye; those
//!          of all views share the layers
//! find     the casters of each face of each layer: at first by the order of objects, then by those that changed
//! encode   passes for each layer with a face whose list of casters is another one than was drawn
//! ```
//!
//! What a layer holds depends on the world alone, not on the views and frames before. So nothing is looked at while
//! nothing changed, and what is drawn anew has the depths that it would have in any other order.
//!
//! Where something moves in frame after frame, what is still about it is drawn once, into the layer's *base*. Then the
//! base is copied and only the rest is drawn: depths are a maximum, which does not depend on what came first.

use super::frame_tables::FrameTables;
use super::lamp_layers::Lamp;
use super::meshes::Meshes;
use super::shadow_layers::{Face, FaceCaster, LayerLight, MOST_LAYERS, SIZE, Turn};
use super::shadow_pass::{Maps, MaskKey, OnDevice, base_texture, begin_pass, face_stride};
use super::sun_levels::{LEVELS, SunLayer, SunLevel, turn_of};
use super::tables::SHADOW_RECORDS;
use super::textures::Textures;
use super::timestamps::Timestamps;
use super::{Gpu, RenderError};
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use systems::assets::levels::LevelOfDetail;
use systems::assets::{AlphaMode, MeshId, Technique};
use systems::draw::{BatchKey, ClassId, DrawList, FrameData, ShadowCaster, ShadowScene};
use systems::ecs::tables::DirtySlots;
use systems::lights::{LightRecord, Ranked, ShadowLights, rank_suns};

/// Texels of a layer that a caster's level of detail may be off.
const DETAIL: LevelOfDetail = LevelOfDetail { enabled: true, max_error_pixels: 0.5 };
/// Texels of a layer that a caster is wide at least: whether what is smaller covers one is a matter of luck, and of small
/// things there are many.
const SMALLEST: f32 = 2.0;
/// A layer has a base where it was due in so many frames before this one, one after another.
const BUSY: u32 = 2;
/// Frames for which a caster has not changed that goes into a base.
const STILL: u64 = 8;
/// Vertices for which a base is worth its memory and its copy.
const WORTHWHILE: usize = 5_000;
/// The shadow record of the first of them, behind those of all layers; the records of their levels follow.
const SUN_RECORDS: usize = MOST_LAYERS;
const LEVEL_RECORDS: usize = SUN_RECORDS + ShadowLights::MOST_SUNS;
const _: () = assert!(LEVEL_RECORDS + ShadowLights::MOST_SUNS * LEVELS as usize <= SHADOW_RECORDS as usize);
// A light's record has eight bits for the number of its shadow record.
const _: () = assert!(LEVEL_RECORDS <= u8::MAX as usize);

/// What the last prepare found and the last encode drew.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ShadowStats {
    /// Lights that have layers.
    pub lights: u32,
    /// These layers: point lights and spots one each, directional ones one for each level.
    pub layers: u32,
    /// Layers drawn.
    pub passes: u32,
    /// Faces drawn.
    pub faces: u32,
    /// Objects drawn into them.
    pub casters: u32,
    /// Layers that began with what is still.
    pub bases: u32,
}

/// What a view asks for.
pub(super) struct ShadowedView<'a> {
    pub ranked: &'a [Ranked],
    /// World space.
    pub eye: Vec3,
}

/// The layers of all views, and what draws them.
#[derive(Debug)]
pub(super) struct ShadowMaps {
    /// By number.
    layers: Vec<Layer>,
    by_owner: BTreeMap<Owner, usize>,
    /// The directional lights that have levels, brightest first, and how their frames are turned.
    suns: Vec<(Ranked, Turn)>,
    /// Made when a view first asks for it.
    device: Option<OnDevice>,
    /// The shadow records of lights by their slots, counted from 1, as the light table on the device has them.
    pub by_slot: BTreeMap<u32, u8>,
    due: Vec<DueLayer>,
    /// What was looked at last.
    seen: Option<Seen>,
    pub stats: ShadowStats,
}

/// What a layer may be given to. Levels come first where there is not room for all.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Owner {
    Sun(SunLevel),
    /// By its slot.
    Lamp(u32),
}

/// A part of the texture.
#[derive(Debug, Default)]
struct Layer {
    owner: Option<Owner>,
    /// As its casters were found for it.
    light: Option<LayerLight>,
    faces: Vec<LayerFace>,
    base: Option<Base>,
    /// In how many frames, one after another, it was due.
    busy: u32,
}

/// What is still of a layer.
#[derive(Debug)]
struct Base {
    texture: wgpu::Texture,
    is_drawn: bool,
}

/// A face, and what is before it.
#[derive(Debug)]
struct LayerFace {
    face: Face,
    /// By what they are drawn with, mesh, level and slot.
    casters: Vec<Caster>,
    is_drawn: bool,
}

/// What casters are drawn with: of masks their class and what their shader reads.
type CasterKey = Option<(ClassId, MaskKey)>;

/// What stands before a face.
#[derive(Clone, Copy, Debug)]
struct Caster {
    key: CasterKey,
    drawn: FaceCaster,
    /// The frame since which it is as it is, as far as is known.
    since: u64,
    /// It is in the layer's base.
    in_base: bool,
}

impl Caster {
    fn order(&self) -> (CasterKey, MeshId, u32, u32) {
        (self.key, self.drawn.mesh, self.drawn.level, self.drawn.slot)
    }

    fn is_same(&self, other: &Self) -> bool {
        (self.key, self.drawn) == (other.key, other.drawn)
    }
}

/// What lists of casters depend on beside the lights.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Seen {
    frame: u64,
    meshes: u64,
    textures: u64,
}

#[derive(Debug)]
struct DueLayer {
    layer: usize,
    /// The base to be drawn before; empty where it is there, or there is none.
    base: Vec<DueFace>,
    start: Start,
    faces: Vec<DueFace>,
}

/// What a layer holds before something is drawn into it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Start {
    Nothing,
    /// What it held before, but for the faces that are due.
    OtherFaces,
    Base,
}

#[derive(Debug)]
struct DueFace {
    face: Face,
    slots: Vec<u32>,
    draws: Vec<CasterDraw>,
}

/// Casters of one mesh at one level, which differ in their places.
#[derive(Debug)]
struct CasterDraw {
    key: CasterKey,
    indices: Range<u32>,
    base_vertex: i32,
    /// In the list of slots of all that is due.
    slots: Range<u32>,
}

/// What changed since casters were found last.
struct Changes<'a> {
    slots: &'a DirtySlots,
    casters: Vec<ShadowCaster>,
    /// Whether what masks let through may be other than it was: all, or those of some materials.
    all_masks: bool,
    materials: &'a DirtySlots,
    frame: u64,
}

impl ShadowMaps {
    pub fn new() -> Self {
        Self {
            layers: Vec::new(),
            by_owner: BTreeMap::new(),
            suns: Vec::new(),
            device: None,
            by_slot: BTreeMap::new(),
            due: Vec::new(),
            seen: None,
            stats: ShadowStats::default(),
        }
    }

    /// Bytes of the layers.
    pub fn bytes(&self) -> u64 {
        let layers = self.device.as_ref().and_then(|device| device.maps.as_ref()).map_or(0, |maps| maps.layers.len());
        let bases = self.layers.iter().filter(|layer| layer.base.is_some()).count();
        (layers + bases) as u64 * u64::from(SIZE * SIZE) * 4
    }

    /// What objects that receive shadows bind; `None` before the first [`Self::choose`].
    pub fn group(&self) -> Option<&wgpu::BindGroup> {
        Some(&self.device.as_ref()?.maps.as_ref()?.group)
    }

    /// Gives layers to the lamps that views have ranked, and to the levels of suns around their eyes: what has one keeps
    /// it. There is room for `most` lamps at once, and more if that is not enough. `layouts`: of group 3 of receivers,
    /// of a frame, of a material class.
    pub fn choose(
        &mut self,
        gpu: &Gpu,
        [layout, frame_layout, class_layout]: [&wgpu::BindGroupLayout; 3],
        frame: &FrameData<'_>,
        views: &[ShadowedView<'_>],
        most: usize,
    ) {
        self.stats = ShadowStats::default();
        let suns = frame.shadows.map_or_else(Vec::new, |scene| rank_suns(scene.lights()));
        let turn =
            |sun: &Ranked| frame.list.lights.records.get(sun.slot as usize).map(|light| turn_of(&light.unpacked()));
        self.suns = suns.into_iter().filter_map(|sun| Some((sun, turn(&sun)?))).collect();
        let mut wanted = BTreeSet::new();
        for level in 0..LEVELS {
            for view in views {
                wanted.extend(self.suns.iter().map(|&(_, turn)| Owner::Sun(SunLevel::around(view.eye, turn, level))));
            }
        }
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
        let device = self.device.get_or_insert_with(|| OnDevice::new(&gpu.device, frame_layout, class_layout));
        if needed > self.layers.len() || device.maps.is_none() {
            self.layers.resize_with(needed.max(levels + most).clamp(1, MOST_LAYERS), Layer::default);
            self.layers.iter_mut().for_each(|layer| layer.light = None);
            // The old ones first: there may not be room for both.
            device.maps = None;
            device.maps = Some(Maps::new(&gpu.device, layout, self.layers.len()));
        }
        let free = self.layers.iter_mut().filter(|layer| layer.owner.is_none());
        free.zip(wanted).for_each(|(layer, owner)| layer.owner = Some(owner));
        let owners = self.layers.iter().map(|layer| layer.owner);
        self.by_owner = owners.zip(0..).filter_map(|(owner, layer)| Some((owner?, layer))).collect();
        let lamp = |(&owner, &layer): (&Owner, &usize)| match owner {
            Owner::Lamp(slot) => Some((slot, layer as u8 + 1)),
            Owner::Sun(_) => None,
        };
        let suns = self.suns.iter().zip(SUN_RECORDS as u8 + 1..).map(|((sun, _), number)| (sun.slot, number));
        self.by_slot = self.by_owner.iter().filter_map(lamp).chain(suns).collect();
        self.stats.lights = self.by_slot.len() as u32;
        self.stats.layers = self.by_owner.len() as u32;
    }

    /// The records that shaders read for a view: of lamps by their layers; then of suns, and of each sun's levels.
    pub fn records(&self, view: &ShadowedView<'_>, scene: &ShadowScene<'_>, list: &DrawList) -> Vec<[u32; 4]> {
        let mut records = vec![[0; 4]; self.layers.len()];
        for light in view.ranked {
            let Some(&layer) = self.by_owner.get(&Owner::Lamp(light.slot)) else { continue };
            if let Some(lamp) = lamp(light.slot, scene, list) {
                records[layer] = lamp.record(light.fade);
            }
        }
        if self.suns.is_empty() {
            return records;
        }
        records.resize(LEVEL_RECORDS + self.suns.len() * LEVELS as usize, [0; 4]);
        for (number, &(sun, turn)) in self.suns.iter().enumerate() {
            let first = LEVEL_RECORDS + number * LEVELS as usize;
            let mut count = 0;
            for level in (0..LEVELS).map(|level| SunLevel::around(view.eye, turn, level)) {
                let Some(&layer) = self.by_owner.get(&Owner::Sun(level)) else { break };
                records[first + count] = level.record(view.eye, layer as u32);
                count += 1;
            }
            let [x, y] = turn.words();
            records[SUN_RECORDS + number] = [x, y, first as u32 | (count as u32) << 16, sun.fade.to_bits()];
        }
        records
    }

    /// Finds the faces before which other casters are than those that are drawn there, and uploads what draws them.
    /// Returns the bytes written.
    pub fn find_due(
        &mut self,
        gpu: &Gpu,
        frame: &FrameData<'_>,
        meshes: &Meshes,
        textures_version: u64,
    ) -> Result<u64, RenderError> {
        let (list, Some(scene)) = (frame.list, frame.shadows) else { return Ok(0) };
        let seen = Seen { frame: list.frame, meshes: meshes.version(), textures: textures_version };
        let before = self.seen.replace(seen);
        if before.is_none_or(|before| before.meshes != seen.meshes) {
            // A mesh may be another one under the same number.
            self.layers.iter_mut().for_each(|layer| layer.light = None);
        }
        let is_same = before.is_some_and(|before| before.frame == seen.frame);
        let follows = is_same || before.is_some_and(|before| before.frame + 1 == seen.frame);
        let nothing = DirtySlots::default();
        let changes = Changes {
            slots: if is_same { &nothing } else { &list.instances.dirty },
            casters: if is_same || !follows || self.by_owner.is_empty() {
                Vec::new()
            } else {
                scene.changed_casters(&list.instances, frame.library)
            },
            materials: if is_same { &nothing } else { &list.materials.dirty },
            all_masks: !follows || before.is_some_and(|before| before.textures != seen.textures),
            frame: seen.frame,
        };
        let is_still = changes.slots.is_empty() && changes.materials.is_empty() && !changes.all_masks;
        for layer in &mut self.layers {
            let light = match layer.owner {
                Some(Owner::Lamp(slot)) => lamp(slot, &scene, list).map(LayerLight::Lamp),
                Some(Owner::Sun(level)) => Some(LayerLight::Sun(SunLayer::new(level))),
                None => None,
            };
            let Some(light) = light else { continue };
            if layer.light != Some(light) || !follows {
                layer.find_all(light, &scene, frame, meshes, changes.all_masks);
            } else if !is_still {
                layer.change(&light, &changes, meshes);
            }
        }
        let layers = self.layers.iter_mut().enumerate().filter(|(_, layer)| layer.owner.is_some());
        self.due = layers.filter_map(|(number, layer)| layer.due(number, gpu, meshes, (is_same, seen.frame))).collect();
        self.upload(gpu)
    }

    /// The slots of casters and the records of faces that are due.
    fn upload(&mut self, gpu: &Gpu) -> Result<u64, RenderError> {
        let Some(device) = self.device.as_mut().filter(|_| !self.due.is_empty()) else { return Ok(0) };
        let stride = face_stride(&gpu.device) as usize;
        let (mut slots, mut records) = (Vec::<u32>::new(), Vec::<u8>::new());
        for due in &mut self.due {
            let Some(light) = self.layers[due.layer].light else { continue };
            for face in due.base.iter_mut().chain(&mut due.faces) {
                for draw in &mut face.draws {
                    draw.slots = draw.slots.start + slots.len() as u32..draw.slots.end + slots.len() as u32;
                }
                slots.extend(&face.slots);
                records.extend_from_slice(bytemuck::bytes_of(&light.face_record(&face.face)));
                records.resize(records.len().next_multiple_of(stride), 0);
            }
        }
        let all = DirtySlots::default();
        let written = device.slots.write(gpu, &slots, &all, true)? + device.faces.write(gpu, &records, &all, true)?;
        let faces = self.due.iter().flat_map(|layer| layer.base.iter().chain(&layer.faces));
        let keys = faces.flat_map(|face| &face.draws);
        let masks: BTreeSet<_> = keys.filter_map(|draw| draw.key.map(|(_, mask)| mask)).collect();
        masks.into_iter().for_each(|mask| device.make_mask(&gpu.device, mask));
        Ok(written)
    }

    /// Draws what is due.
    pub fn encode(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (tables, frame_layout): (&FrameTables, &wgpu::BindGroupLayout),
        (meshes, textures): (&Meshes, &Textures),
        timestamps: Option<&Timestamps>,
    ) {
        let Some(device) = self.device.as_mut().filter(|_| !self.due.is_empty()) else { return };
        let stride = face_stride(&gpu.device);
        device.bind(&gpu.device, tables, frame_layout);
        let (Some(maps), Some((_, table_group)), Some((_, face_group))) =
            (&device.maps, &device.tables, &device.face_group)
        else {
            return;
        };
        let groups = Groups { tables: table_group, face: face_group };
        let mut number = 0;
        let mut draw = |encoder: &mut _, view: &_, load, erase, faces: &[DueFace]| {
            let mut pass = begin_pass(encoder, view, load, timestamps);
            pass.set_bind_group(0, groups.tables, &[]);
            pass.set_vertex_buffer(0, meshes.vertices.buffer().slice(..));
            pass.set_vertex_buffer(1, device.slots.buffer().slice(..));
            pass.set_index_buffer(meshes.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
            for due in faces {
                let Face { corner: [x, y], size, .. } = due.face;
                pass.set_viewport(x as f32, y as f32, size as f32, size as f32, 0.0, 1.0);
                pass.set_scissor_rect(x, y, size, size);
                pass.set_bind_group(3, groups.face, &[number * stride]);
                number += 1;
                if erase {
                    pass.set_pipeline(&device.empty);
                    pass.draw(0..3, 0..1);
                }
                for draw in &due.draws {
                    if let Some((class, mask)) = draw.key {
                        let group = textures.class(class, Technique::Off);
                        let (Some(group), Some(pipeline)) = (group, device.masks.get(&mask)) else { continue };
                        pass.set_pipeline(pipeline);
                        pass.set_bind_group(1, group, &[]);
                    } else {
                        pass.set_pipeline(&device.opaque);
                    }
                    pass.draw_indexed(draw.indices.clone(), draw.base_vertex, draw.slots.clone());
                }
            }
        };
        let clear = wgpu::LoadOp::Clear(0.0);
        for due in self.due.drain(..) {
            let layer = &mut self.layers[due.layer];
            let view = &maps.layers[due.layer];
            if let Some(base) = layer.base.as_mut().filter(|_| due.start == Start::Base) {
                if !due.base.is_empty() {
                    let view = base.texture.create_view(&wgpu::TextureViewDescriptor::default());
                    draw(encoder, &view, clear, false, &due.base);
                    base.is_drawn = true;
                }
                maps.copy_into(encoder, &base.texture, due.layer);
                self.stats.bases += 1;
            }
            let load = if due.start == Start::Nothing { clear } else { wgpu::LoadOp::Load };
            draw(encoder, view, load, due.start == Start::OtherFaces, &due.faces);
            layer.faces.iter_mut().for_each(|face| face.is_drawn = true);
            self.stats.passes += 1;
            self.stats.faces += due.faces.len() as u32;
            let drawn = due.base.iter().chain(&due.faces);
            self.stats.casters += drawn.map(|face| face.slots.len() as u32).sum::<u32>();
        }
    }
}

/// What passes bind.
struct Groups<'a> {
    tables: &'a wgpu::BindGroup,
    face: &'a wgpu::BindGroup,
}

impl Layer {
    /// Finds all casters of a light. What is drawn of the same light stays where these are the same.
    fn find_all(
        &mut self,
        light: LayerLight,
        scene: &ShadowScene<'_>,
        frame: &FrameData<'_>,
        meshes: &Meshes,
        other_masks: bool,
    ) {
        let may_reach = |min, max| light.may_reach(min, max);
        let casters = scene.casters_within(frame.library, may_reach, |sphere| light.reaches(sphere));
        let before = if self.light == Some(light) { std::mem::take(&mut self.faces) } else { Vec::new() };
        let of_face = |(index, face): (usize, Face)| {
            let casters = held(&casters, &light, &face, meshes);
            let is_same = |before: &&LayerFace| {
                let mut both = before.casters.iter().zip(&casters);
                before.casters.len() == casters.len() && both.all(|(before, caster)| before.is_same(caster))
            };
            let is_another_mask = |caster: &Caster| other_masks && caster.drawn.mask.is_some();
            let is_drawn = before.get(index).filter(is_same).is_some_and(|before| before.is_drawn)
                && !casters.iter().any(is_another_mask);
            LayerFace { face, casters, is_drawn }
        };
        (self.base, self.busy) = (None, 0);
        self.faces = light.faces().into_iter().enumerate().map(of_face).collect();
        self.light = Some(light);
    }

    /// Brings the lists of casters up to date with what changed.
    fn change(&mut self, light: &LayerLight, changes: &Changes<'_>, meshes: &Meshes) {
        let reached: Vec<_> = changes.casters.iter().filter(|caster| light.reaches(caster.bounds)).copied().collect();
        for face in &mut self.faces {
            let is_another = |caster: &Caster| changes.slots.contains(caster.drawn.slot);
            let is_another_mask = |caster: &Caster| {
                caster.drawn.mask.is_some_and(|material| changes.all_masks || changes.materials.contains(material))
            };
            let masks = face.casters.iter().filter(|caster| is_another_mask(caster));
            let (mut is_same, mut spoils_base) = (true, false);
            masks.for_each(|mask| (is_same, spoils_base) = (false, spoils_base | mask.in_base));
            let mut new = held(&reached, light, &face.face, meshes);
            let old: Vec<_> = face.casters.iter().filter(|caster| is_another(caster)).collect();
            let stays = old.len() == new.len() && old.iter().zip(&new).all(|(old, new)| old.is_same(new));
            if !stays {
                is_same = false;
                spoils_base |= old.iter().any(|caster| caster.in_base);
                new.iter_mut().for_each(|caster| caster.since = changes.frame);
                face.casters.retain(|caster| !is_another(caster));
                face.casters.extend(new);
                face.casters.sort_by_key(Caster::order);
            }
            face.is_drawn &= is_same;
            if spoils_base {
                self.base = None;
            }
        }
    }

    /// What is to be drawn of a layer, whose number is given; `None`: nothing. `frame`: whether it was looked at before,
    /// and its number.
    fn due(&mut self, layer: usize, gpu: &Gpu, meshes: &Meshes, (is_same, frame): (bool, u64)) -> Option<DueLayer> {
        if self.faces.iter().all(|face| face.is_drawn) {
            if !is_same {
                (self.busy, self.base) = (0, self.base.take().filter(|_| self.busy > 0));
            }
            return None;
        }
        self.busy += u32::from(!is_same);
        let is_still = |caster: &Caster| caster.since + STILL <= frame;
        let missing = self.vertices(meshes, |caster| is_still(caster) && !(caster.in_base && self.base.is_some()));
        let mut base = Vec::new();
        if self.busy > BUSY && missing >= WORTHWHILE {
            let casters = self.faces.iter_mut().flat_map(|face| &mut face.casters);
            casters.for_each(|caster| caster.in_base = is_still(caster));
            let texture = self.base.take().map_or_else(|| base_texture(&gpu.device), |base| base.texture);
            self.base = Some(Base { texture, is_drawn: false });
        }
        if self.base.as_ref().is_some_and(|base| !base.is_drawn) {
            base = self.faces.iter().map(|face| face.due(meshes, |caster| caster.in_base)).collect();
        }
        let (start, faces) = if self.base.is_some() {
            let moving = self.faces.iter().filter(|face| face.casters.iter().any(|caster| !caster.in_base));
            (Start::Base, moving.map(|face| face.due(meshes, |caster| !caster.in_base)).collect())
        } else {
            let due = self.faces.iter().filter(|face| !face.is_drawn);
            let faces: Vec<_> = due.map(|face| face.due(meshes, |_| true)).collect();
            (if faces.len() == self.faces.len() { Start::Nothing } else { Start::OtherFaces }, faces)
        };
        Some(DueLayer { layer, base, start, faces })
    }

    /// How many vertices some of its casters have.
    fn vertices(&self, meshes: &Meshes, is_counted: impl Fn(&Caster) -> bool) -> usize {
        let casters = self.faces.iter().flat_map(|face| &face.casters).filter(|caster| is_counted(caster));
        let level = |caster: &Caster| meshes.range(caster.drawn.mesh)?.levels.get(caster.drawn.level as usize).copied();
        casters.filter_map(level).map(|level| level.index_count as usize).sum()
    }
}

impl LayerFace {
    /// What draws some of its casters.
    fn due(&self, meshes: &Meshes, is_drawn: impl Fn(&Caster) -> bool) -> DueFace {
        let casters: Vec<Caster> = self.casters.iter().filter(|caster| is_drawn(caster)).copied().collect();
        let slots = casters.iter().map(|caster| caster.drawn.slot).collect();
        DueFace { face: self.face, slots, draws: draws_of(&casters, meshes) }
    }
}

/// Those of some casters that are in a face, in the order in which they are drawn.
fn held(casters: &[ShadowCaster], light: &LayerLight, face: &Face, meshes: &Meshes) -> Vec<Caster> {
    let held = casters.iter().filter(|caster| light.holds(face, caster.bounds));
    let mut held: Vec<_> = held.filter_map(|caster| face_caster(caster, light, face, meshes)).collect();
    held.sort_by_key(Caster::order);
    held
}

/// The point light or spot in a slot.
fn lamp(slot: u32, scene: &ShadowScene<'_>, list: &DrawList) -> Option<Lamp> {
    let near = scene.lights().get(slot)?.near;
    let light: LightRecord = list.lights.records.get(slot as usize)?.unpacked();
    Some(Lamp::new(&light, near))
}

/// A caster as it is drawn into a face; `None` where it is too small, and while its mesh is not uploaded.
fn face_caster(caster: &ShadowCaster, light: &LayerLight, face: &Face, meshes: &Meshes) -> Option<Caster> {
    let ShadowCaster { slot, key: BatchKey { pipeline, class, mesh }, material, world_from_object, bounds } = *caster;
    let (distance, texels) = light.detail(face, bounds);
    if 2.0 * bounds.radius * texels < SMALLEST * distance {
        return None;
    }
    let range = meshes.range(mesh)?;
    let m = world_from_object.matrix3;
    let stretch = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
    let level = DETAIL.choose(&range.levels, stretch, distance, texels) as u32;
    let is_mask = pipeline.alpha == AlphaMode::Mask;
    let key = is_mask.then_some((class, (pipeline.transformed_uvs, pipeline.vertex_colors)));
    let place = [m.x_axis, m.y_axis, m.z_axis, world_from_object.translation].map(Vec3::from);
    let mask = is_mask.then_some(material);
    let drawn = FaceCaster { mesh, level, slot, place, mask };
    Some(Caster { key, drawn, since: 0, in_base: false })
}

/// A draw for each run of casters of one kind, mesh and level.
fn draws_of(casters: &[Caster], meshes: &Meshes) -> Vec<CasterDraw> {
    let mut start = 0;
    let mut draws = Vec::new();
    for run in casters.chunk_by(|a, b| (a.key, a.drawn.mesh, a.drawn.level) == (b.key, b.drawn.mesh, b.drawn.level)) {
        let slots = start..start + run.len() as u32;
        start = slots.end;
        let Caster { key, drawn, .. } = run[0];
        let Some(mesh) = meshes.range(drawn.mesh) else { continue };
        let Some(level) = mesh.levels.get(drawn.level as usize) else { continue };
        let indices = mesh.first_index() + level.first_index;
        let indices = indices..indices + level.index_count;
        draws.push(CasterDraw { key, indices, base_vertex: mesh.base_vertex(), slots });
    }
    draws
}
