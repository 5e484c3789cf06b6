//! Content of a layer of the shadow maps: the casters before each face, and those due to be drawn.
//!
//! The lists are found at first by the order of objects, then by those that changed. A face is due where its list is
//! another one than was drawn.
//!
//! While something moves in frame after frame, the casters that stand still are drawn once, into the layer's *base*.
//! Then the base is copied and only the rest is drawn. Depths are a maximum, which does not depend on what came first: so
//! what comes to rest is added to the base, and where some of it moves again only that face of the base is drawn anew.
//!
//! A moving caster whose shadow no view shows is *left out*, for that frame. If it stays there, it is drawn in the next
//! one.

use super::layer_light::LayerLight;
use super::shadow_layers::Face;
use super::shadow_pass::{MaskKey, base_texture};
use super::sun_levels::SunLevel;
use super::visible_casters::VisibleReceivers;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::resources::meshes::Meshes;
use glam::Vec3;
use std::ops::Range;
use systems::assets::levels::LevelOfDetail;
use systems::assets::{AlphaMode, Library, MeshId};
use systems::draw::{BatchKey, ClassId, ShadowCaster, ShadowScene};
use systems::ecs::tables::DirtySlots;

/// Texels of a layer that a caster's level of detail may be off.
const DETAIL: LevelOfDetail = LevelOfDetail { enabled: true, max_error_pixels: 0.5 };
/// Texels of a layer that a caster is wide at least: whether what is smaller covers one is a matter of luck, and of
/// small things there are many.
const SMALLEST: f32 = 2.0;
/// A layer has a base where it was due in so many frames before this one, one after another.
const BUSY: u32 = 2;
/// Frames for which a caster has not changed that goes into a base.
const STILL: u64 = 8;
/// Vertices for which a base is worth its memory and its copy.
const WORTHWHILE: usize = 5_000;
/// Light that a layer is given to. Levels come first where there is not room for all.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Owner {
    Sun(SunLevel),
    /// By its slot.
    Lamp(u32),
}

/// A part of the texture.
#[derive(Debug, Default)]
pub(crate) struct Layer {
    pub owner: Option<Owner>,
    /// Light that its casters were found for.
    pub light: Option<LayerLight>,
    pub faces: Vec<LayerFace>,
    pub base: Option<Base>,
    /// In how many frames, one after another, it was due.
    busy: u32,
}

/// Still casters of a layer.
#[derive(Debug)]
pub(crate) struct Base {
    pub texture: wgpu::Texture,
    /// Nothing is drawn there yet.
    pub is_new: bool,
}

/// A face, and what is before it.
#[derive(Debug)]
pub(crate) struct LayerFace {
    face: Face,
    /// By what they are drawn with, mesh, level and slot.
    casters: Vec<Caster>,
    /// All but those that are left out are drawn.
    is_drawn: bool,
    /// Some are left out.
    leaves_out: bool,
    /// The layer's base, if there is one, has no other casters than those that say so.
    base_is_drawn: bool,
}

/// Pipeline key of casters: of masks their class and the inputs of their shader.
pub(crate) type CasterKey = Option<(ClassId, MaskKey)>;

/// A caster as it is drawn into a face. Faces of equal casters have equal depths, while meshes and materials of masks
/// stay as they are.
#[derive(Clone, Copy, PartialEq, Debug)]
struct FaceCaster {
    mesh: MeshId,
    /// Level of detail.
    level: u32,
    slot: u32,
    /// Columns of its matrix.
    place: [Vec3; 4],
    /// The material of a mask.
    mask: Option<u32>,
}

/// A caster before a face, and its state in the list.
#[derive(Clone, Copy, Debug)]
struct Caster {
    key: CasterKey,
    drawn: FaceCaster,
    /// The frame since which it is as it is, as far as is known.
    since: u64,
    in_base: InBase,
    /// It is not drawn: it changed in this frame, and no view shows its shadow.
    is_left_out: bool,
}

/// Part that a caster has in its layer's base, if there is one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum InBase {
    No,
    /// It is to be drawn there.
    Joins,
    Yes,
}

impl Caster {
    fn order(&self) -> (CasterKey, MeshId, u32, u32) {
        (self.key, self.drawn.mesh, self.drawn.level, self.drawn.slot)
    }

    fn is_same(&self, other: &Self) -> bool {
        (self.key, self.drawn) == (other.key, other.drawn)
    }
}

#[derive(Debug)]
pub(crate) struct DueLayer {
    pub layer: usize,
    /// Faces of the base to be drawn before; empty where all is there, or there is none.
    pub base: Vec<DueFace>,
    pub start: Start,
    pub faces: Vec<DueFace>,
}

/// Content of a layer before something is drawn into it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Start {
    Nothing,
    /// Previous content.
    Before,
    Base,
}

#[derive(Debug)]
pub(crate) struct DueFace {
    pub face: Face,
    /// Previous content is erased before.
    pub is_erased: bool,
    pub slots: Vec<u32>,
    pub draws: Vec<CasterDraw>,
}

/// Casters of one mesh at one level, which differ in their places.
#[derive(Debug)]
pub(crate) struct CasterDraw {
    pub key: CasterKey,
    pub indices: Range<u32>,
    pub base_vertex: i32,
    /// In the list of slots of all that is due.
    pub slots: Range<u32>,
}

/// Changes since casters were found last.
pub(crate) struct Changes<'a> {
    pub slots: &'a DirtySlots,
    /// By slot, ascending.
    pub casters: Vec<ShadowCaster>,
    /// All masks may have changed; otherwise only those of `materials`.
    pub all_masks: bool,
    pub materials: &'a DirtySlots,
    pub frame: u64,
    pub receivers: VisibleReceivers,
}

impl Layer {
    /// Finds all casters of a light. What is drawn of the same light stays where these are the same.
    pub fn find_all(
        &mut self,
        light: LayerLight,
        scene: &ShadowScene<'_>,
        library: &Library,
        meshes: &Meshes,
        other_masks: bool,
    ) {
        let may_reach = |min, max| light.may_reach(min, max);
        let casters = scene.casters_within(library, may_reach, |sphere| light.reaches(sphere));
        let before = if self.light == Some(light) { std::mem::take(&mut self.faces) } else { Vec::new() };
        let of_face = |(index, face): (usize, Face)| {
            let casters = held(&casters, &light, &face, meshes);
            let is_same = |before: &&LayerFace| {
                let mut both = before.casters.iter().zip(&casters);
                before.casters.len() == casters.len() && both.all(|(before, caster)| before.is_same(caster))
            };
            let is_another_mask = |caster: &Caster| other_masks && caster.drawn.mask.is_some();
            let is_there = |before: &LayerFace| before.is_drawn && !before.leaves_out;
            let is_drawn =
                before.get(index).filter(is_same).is_some_and(is_there) && !casters.iter().any(is_another_mask);
            LayerFace { face, casters, is_drawn, leaves_out: false, base_is_drawn: false }
        };
        (self.base, self.busy) = (None, 0);
        self.faces = light.faces().into_iter().enumerate().map(of_face).collect();
        self.light = Some(light);
    }

    /// Brings the lists of casters up to date with what changed.
    pub fn change(&mut self, light: &LayerLight, changes: &Changes<'_>, meshes: &Meshes) {
        let reached: Vec<_> = changes.casters.iter().filter(|caster| light.reaches(caster.bounds)).copied().collect();
        let unseen = reached.iter().filter(|caster| !changes.receivers.may_show(light, caster.bounds));
        let unseen: Vec<_> = unseen.map(|caster| caster.slot).collect();
        for face in &mut self.faces {
            let is_another = |caster: &Caster| changes.slots.contains(caster.drawn.slot);
            let is_another_mask = |caster: &Caster| {
                caster.drawn.mask.is_some_and(|material| changes.all_masks || changes.materials.contains(material))
            };
            let masks = face.casters.iter().filter(|caster| is_another_mask(caster));
            let (mut is_same, mut spoils_base) = (true, false);
            masks.for_each(|mask| (is_same, spoils_base) = (false, spoils_base | (mask.in_base != InBase::No)));
            let mut new = held(&reached, light, &face.face, meshes);
            let old: Vec<_> = face.casters.iter().filter(|caster| is_another(caster)).copied().collect();
            let stays = old.len() == new.len() && old.iter().zip(&new).all(|(old, new)| old.is_same(new));
            if std::mem::take(&mut face.leaves_out) {
                let is_late = |caster: &&mut Caster| caster.is_left_out && (stays || !is_another(caster));
                let late = face.casters.iter_mut().filter(is_late);
                late.for_each(|caster| (is_same, caster.is_left_out) = (false, false));
            }
            if !stays {
                for caster in &mut new {
                    caster.since = changes.frame;
                    caster.is_left_out = unseen.binary_search(&caster.drawn.slot).is_ok();
                }
                spoils_base |= old.iter().any(|caster| caster.in_base != InBase::No);
                is_same &= old.iter().chain(&new).all(|caster| caster.is_left_out);
                face.leaves_out = new.iter().any(|caster| caster.is_left_out);
                face.casters.retain(|caster| !is_another(caster));
                face.casters.extend(new);
                face.casters.sort_by_key(Caster::order);
            }
            face.is_drawn &= is_same;
            face.base_is_drawn &= !spoils_base;
        }
    }

    /// Tells if some casters are left out.
    pub fn leaves_out(&self) -> bool {
        self.faces.iter().any(|face| face.leaves_out)
    }

    /// Tells if something is to be drawn. The base is dropped after two frames without a draw. `is_same`: the frame was
    /// looked at before.
    pub fn is_due(&mut self, is_same: bool) -> bool {
        let is_due = self.faces.iter().any(|face| !face.is_drawn);
        if !is_due && !is_same {
            (self.busy, self.base) = (0, self.base.take().filter(|_| self.busy > 0));
        }
        is_due
    }

    /// Casters to be drawn into a layer that is due, whose number is given. `frame`: if it was looked at before, and
    /// its number.
    pub fn due(&mut self, layer: usize, gpu: &Gpu, meshes: &Meshes, is_same: bool, frame: u64, side: u32) -> DueLayer {
        self.busy += u32::from(!is_same);
        let is_still = |caster: &Caster| caster.since + STILL <= frame;
        if self.base.is_none() {
            // None of what is said of an earlier one holds.
            for face in &mut self.faces {
                face.base_is_drawn = false;
                face.casters.iter_mut().for_each(|caster| caster.in_base = InBase::No);
            }
        }
        let may_join = |caster: &Caster| caster.in_base == InBase::No && is_still(caster);
        if self.busy > BUSY && self.vertices(meshes, may_join) >= WORTHWHILE {
            let casters = self.faces.iter_mut().flat_map(|face| &mut face.casters);
            casters.filter(|caster| may_join(caster)).for_each(|caster| caster.in_base = InBase::Joins);
            self.base.get_or_insert_with(|| Base { texture: base_texture(&gpu.device, side), is_new: true });
        }
        let Some(Base { is_new, .. }) = self.base else {
            let is_whole = self.faces.iter().all(|face| !face.is_drawn);
            let due = self.faces.iter().filter(|face| !face.is_drawn);
            let faces = due.map(|face| face.due(meshes, !is_whole, |_| true)).collect();
            let start = if is_whole { Start::Nothing } else { Start::Before };
            return DueLayer { layer, base: Vec::new(), start, faces };
        };
        let joins = |caster: &Caster| caster.in_base == InBase::Joins;
        let base = self.faces.iter().filter(|face| !face.base_is_drawn || face.casters.iter().any(joins));
        let base = base.map(|face| {
            let is_there = |caster: &Caster| face.base_is_drawn && caster.in_base == InBase::Yes;
            face.due(meshes, !face.base_is_drawn && !is_new, |caster| caster.in_base != InBase::No && !is_there(caster))
        });
        let is_over_base = |caster: &Caster| caster.in_base == InBase::No && !caster.is_left_out;
        let moving = self.faces.iter().filter(|face| face.casters.iter().any(is_over_base));
        let faces = moving.map(|face| face.due(meshes, false, is_over_base)).collect();
        DueLayer { layer, base: base.collect(), start: Start::Base, faces }
    }

    /// Notes that what is due is drawn.
    pub fn drawn_now(&mut self) {
        let Self { faces, base, .. } = self;
        if let Some(base) = base {
            base.is_new = false;
        }
        for face in faces {
            (face.is_drawn, face.base_is_drawn) = (true, true);
            let joining = face.casters.iter_mut().filter(|caster| caster.in_base == InBase::Joins);
            joining.for_each(|caster| caster.in_base = InBase::Yes);
        }
    }

    /// Number of vertices of some of its casters.
    fn vertices(&self, meshes: &Meshes, is_counted: impl Fn(&Caster) -> bool) -> usize {
        let casters = self.faces.iter().flat_map(|face| &face.casters).filter(|caster| is_counted(caster));
        let level = |caster: &Caster| meshes.range(caster.drawn.mesh)?.levels.get(caster.drawn.level as usize).copied();
        casters.filter_map(level).map(|level| level.index_count as usize).sum()
    }
}

impl LayerFace {
    /// Draws of some of its casters.
    fn due(&self, meshes: &Meshes, is_erased: bool, is_drawn: impl Fn(&Caster) -> bool) -> DueFace {
        let drawn = self.casters.iter().filter(|caster| !caster.is_left_out && is_drawn(caster));
        let casters: Vec<Caster> = drawn.copied().collect();
        let slots = casters.iter().map(|caster| caster.drawn.slot).collect();
        DueFace { face: self.face, is_erased, slots, draws: draws_of(&casters, meshes) }
    }
}

/// Those of some casters that are in a face, in the order in which they are drawn.
fn held(casters: &[ShadowCaster], light: &LayerLight, face: &Face, meshes: &Meshes) -> Vec<Caster> {
    let held = casters.iter().filter(|caster| light.holds(face, caster.bounds));
    let mut held: Vec<_> = held.filter_map(|caster| face_caster(caster, light, face, meshes)).collect();
    held.sort_by_key(Caster::order);
    held
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
    let (distance, texels) = light.detail(face, range.level_bounds.transformed(&world_from_object));
    let level = DETAIL.choose(&range.levels, stretch, distance, texels) as u32;
    if range.levels.get(level as usize).is_none_or(|level| level.index_count == 0) {
        return None;
    }
    let is_mask = pipeline.alpha == AlphaMode::Mask;
    let key = is_mask.then_some((class, (pipeline.transformed_uvs, pipeline.vertex_colors)));
    let place = [m.x_axis, m.y_axis, m.z_axis, world_from_object.translation].map(Vec3::from);
    let mask = is_mask.then_some(material);
    let drawn = FaceCaster { mesh, level, slot, place, mask };
    Some(Caster { key, drawn, since: 0, in_base: InBase::No, is_left_out: false })
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
