//! The seam between the world and the GPU: the plain structs that shaders read, what of them changed, and the batches.
//!
//! The systems write a [`DrawList`] each frame; the renderer reads it and nothing else of the world. `shaders/types.wgsl`
//! mirrors the `…Record` structs; `tests/shaders.rs` compares every offset of the two.
//!
//! ```text
//! instances[slot]  one record per drawn object, in pages of 64 slots; an object keeps its slot while it lives
//! batches[b]       objects with the same pipeline, material class and mesh: those of pages[batches[b].pages]
//! transparent[i]   objects that are sorted per view and drawn after the batches
//! ```

use crate::components::Environment;
use crate::images::Texels;
use crate::library::{AlphaMode, ImageId, MeshId, Sampler, Shading, Technique};
use crate::parallel::in_parallel;
use bevy_ecs::prelude::*;
use bevy_tasks::ComputeTaskPool;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Most elements of [`DrawList::reaching`]: 1 GiB.
pub const MAX_REACHING: u64 = 1 << 28;

/// Most slots of the light table: what fits beside a weight.
pub const MOST_LIGHTS: usize = 1 << 21;

/// Slots in a page of instances; a page holds objects of one batch.
pub const PAGE_SLOTS: u32 = 64;

/// An unused light slot of an instance.
pub const NO_LIGHT: u32 = u32::MAX;

/// One drawn object; all zero in a slot that is not in use, which no pass draws. Mirrors `PackedInstance`; how its
/// lights are packed is said in `selected_lights.rs`.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct InstanceRecord {
    /// Rows of the 3×4 matrix from object to world space.
    pub world_from_object: [[f32; 4]; 3],
    /// Slots in the light table, [`NO_LIGHT`] where fewer than three lights reach the object, and the weights 0..1.
    pub lights: [u32; 3],
    /// Slot in the material table.
    pub material: u32,
    /// Irradiance of what the three lights leave out, linear RGB; the same, times its luminance-weighted direction (world
    /// space); the same, times how much of it comes along each axis, from either side, but for the last.
    pub remainder: [u32; 4],
    /// How much comes along z. Sum of the scores of the lights that are not among the three: what the object's three, each
    /// in full, may miss.
    pub last_side_and_dropped: u32,
    /// What the numbers of the remainder are multiples of.
    pub remainder_unit: f32,
    /// How many lights reach the object.
    pub reaching: u32,
    /// The entity's index, of a piece its object's: picking and segmentation.
    pub entity: u32,
}

/// One light. Mirrors `Light`.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct LightRecord {
    /// World space, metres; of a directional light the unit vector towards it.
    pub position: [f32; 3],
    /// 0 point, 1 spot with exponent, 2 spot with inner cone, 3 directional; [`LightRecord::OFF`] for an empty slot.
    pub kind: u32,
    /// Colour times intensity, linear RGB.
    pub color: [f32; 3],
    /// 1 / range², 0 where the light has no range.
    pub inverse_range_squared: f32,
    /// Constant, linear, quadratic.
    pub attenuation: [f32; 3],
    /// Of a spot its exponent, or the cosine of its inner half angle.
    pub exponent_or_cos_inner: f32,
    /// World space, unit: the way the light shines.
    pub direction: [f32; 3],
    /// Cosine of the outer half angle.
    pub cos_outer: f32,
    /// Ambient colour, linear RGB.
    pub ambient: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
}

impl LightRecord {
    /// Kind of a point light.
    pub const POINT: u32 = 0;
    /// Kind of a spot with the classic exponent.
    pub const SPOT_EXPONENT: u32 = 1;
    /// Kind of a spot with inner and outer cone.
    pub const SPOT_CONE: u32 = 2;
    /// Kind of a directional light.
    pub const DIRECTIONAL: u32 = 3;
    /// Kind of an empty slot.
    pub const OFF: u32 = 4;
}

/// What some light of a world has or had, enabled or not. Shaders are compiled without what none had: each value that they
/// do not read of every light makes a pixel cheaper. What was there once stays, since to compile them anew takes time.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct LightTraits {
    /// A spot's cone.
    pub cones: bool,
    /// An ambient colour.
    pub ambient: bool,
}

/// The maps of a material, in the order of its bindings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(usize)]
pub enum MapSlot {
    /// Base colour.
    Base,
    /// Tangent-space normals.
    Normal,
    /// Specular.
    Specular,
    /// Metallic (b) and roughness (g).
    MetallicRoughness,
    /// Ambient occlusion (r).
    Occlusion,
    /// Emissive colour.
    Emissive,
    /// Height (r).
    Height,
    /// Horizon in the first four directions.
    Horizon0,
    /// Horizon in the other four.
    Horizon1,
    /// Offsets of the environment's look-up (rg).
    Offset,
    /// Environment.
    Environment,
}

/// Number of [`MapSlot`]s.
pub const MAP_COUNT: usize = 11;

/// One material. Mirrors `Material`; the fields are [`crate::library::Material`]'s.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct MaterialRecord {
    /// Linear RGBA.
    pub base_factor: [f32; 4],
    /// Linear RGB.
    pub specular_factor: [f32; 3],
    /// Phong and Blinn exponent.
    pub shininess: f32,
    /// Linear RGB.
    pub emissive_factor: [f32; 3],
    /// Times the normal map's xy.
    pub normal_scale: f32,
    /// 0..1.
    pub metallic: f32,
    /// 0..1.
    pub roughness: f32,
    /// 0..1.
    pub occlusion_strength: f32,
    /// 0..1.
    pub alpha_cutoff: f32,
    /// 0..1.
    pub glossiness: f32,
    /// 0..1.
    pub specular_strength: f32,
    /// UV units.
    pub height_scale_uv: f32,
    /// Bit m: map m is placed by the second UV set.
    pub second_uvs: u32,
    /// Rows of the 2×2 matrix from the offset map to the environment's disc.
    pub offset_matrix: [f32; 4],
    /// 0..1.
    pub height_rest: f32,
    /// Texels.
    pub emboss_step_texels: f32,
    /// 0..1.
    pub self_shadow: f32,
    /// Room for 16-byte alignment.
    pub pad0: u32,
    /// Layer of each map in its class's texture array, by [`MapSlot`].
    pub layers: [u32; MAP_COUNT],
    /// Room for 16-byte alignment.
    pub pad1: u32,
    /// Columns of the 2×2 matrix from mesh UV to image UV, by [`MapSlot`].
    pub image_from_mesh_uv: [[f32; 4]; MAP_COUNT],
    /// Its translation, by [`MapSlot`]; the last is unused.
    pub offsets: [[f32; 2]; MAP_COUNT + 1],
}

/// What is the same for every pixel of a view. Mirrors `View`.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct ViewRecord {
    /// Column-major; reversed depth: 1 at the near plane, 0 at the far plane or infinity.
    pub clip_from_world: [[f32; 4]; 4],
    /// The inverse, for the sky's directions.
    pub world_from_clip: [[f32; 4]; 4],
    /// Of the eye, world space.
    pub eye: [f32; 3],
    /// 1 where the projection is parallel, else 0.
    pub parallel: u32,
    /// Unit vector from the scene towards the eye where the projection is parallel.
    pub toward_eye: [f32; 3],
    /// Times every pixel.
    pub exposure: f32,
    /// Linear RGB.
    pub ambient: [f32; 3],
    /// Entity under the pointer, for debug views; `u32::MAX` for none.
    pub picked_entity: u32,
    /// Linear RGB.
    pub zenith: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
    /// Linear RGB.
    pub horizon: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad1: u32,
    /// Linear RGB.
    pub ground: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad2: u32,
}

/// The fixed choices of a pipeline that objects bring with them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct PipelineKey {
    /// Opaque before mask before blend.
    pub alpha: AlphaMode,
    /// Lighting model.
    pub shading: Shading,
    /// Bump technique.
    pub technique: Technique,
    /// Some map has a UV transform or the second UV set; else every map is sampled at the first set as it is, and the
    /// shader reads nothing of that.
    pub transformed_uvs: bool,
    /// The material sends out light of its own.
    pub emissive: bool,
    /// The material brings the environment that it mirrors, for [`Technique::PerturbedUv`].
    pub environment_map: bool,
    /// The height map rises above the mesh: with [`Technique::writes_depth`], depths lie before it.
    pub raised: bool,
    /// The mesh has colours.
    pub vertex_colors: bool,
    /// Back faces are drawn.
    pub double_sided: bool,
    /// The transform mirrors, so front faces are clockwise.
    pub mirrored: bool,
}

/// Images of one size and format, each a layer of one texture. Only grows.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TextureArray {
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// Decoded from sRGB when sampled.
    pub srgb: bool,
    /// Storage.
    pub texels: Texels,
    /// The image of each layer.
    pub layers: Vec<ImageId>,
}

impl TextureArray {
    /// Whether a layer of one could be a layer of the other.
    pub fn same_format(&self, other: &Self) -> bool {
        (self.width, self.height, self.srgb, self.texels) == (other.width, other.height, other.srgb, other.texels)
    }
}

/// What a draw binds for its materials: per [`MapSlot`] an index into [`DrawList::texture_arrays`] and a sampler.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct MaterialClass {
    /// Texture arrays.
    pub arrays: [u32; MAP_COUNT],
    /// Samplers.
    pub samplers: [Sampler; MAP_COUNT],
}

/// Names a [`MaterialClass`]; see [`crate::materials`].
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct ClassId(pub u32);

/// What the instances of one draw have in common; batches are sorted by it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct BatchKey {
    /// Pipeline.
    pub pipeline: PipelineKey,
    /// Texture arrays and samplers.
    pub class: ClassId,
    /// Mesh.
    pub mesh: MeshId,
}

/// Objects that are drawn together.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Batch {
    /// What they share.
    pub key: BatchKey,
    /// Which elements of [`DrawList::pages`] hold them.
    pub pages: Range<u32>,
}

/// An object that is blended, sorted per view.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Transparent {
    /// Instance slot.
    pub slot: u32,
    /// What it is drawn with.
    pub key: BatchKey,
    /// Centre of its bounds, world space.
    pub center: Vec3,
}

/// A set of slots of a table that changed, read out as few ranges.
#[derive(Clone, Debug, Default)]
pub struct DirtySlots {
    words: Vec<u64>,
    low: usize,
    high: usize,
}

impl DirtySlots {
    /// Marks one slot.
    pub fn mark(&mut self, slot: u32) {
        self.reach(slot, slot)[slot as usize / 64] |= 1 << (slot % 64);
    }

    /// Gets ready for marks between two slots, both included; gives a bit per slot of the table from 0 on.
    fn reach(&mut self, low: u32, high: u32) -> &mut [u64] {
        let (low, high) = (low as usize / 64, high as usize / 64 + 1);
        if high > self.words.len() {
            self.words.resize(high, 0);
        }
        (self.low, self.high) = if self.is_empty() { (low, high) } else { (self.low.min(low), self.high.max(high)) };
        &mut self.words
    }

    /// Whether no slot is marked.
    pub fn is_empty(&self) -> bool {
        self.low >= self.high
    }

    /// Unmarks all; costs as much as the span that was marked.
    pub fn clear(&mut self) {
        if !self.is_empty() {
            self.words[self.low..self.high].fill(0);
        }
        (self.low, self.high) = (0, 0);
    }

    /// The marked slots as ranges in ascending order. Ranges with at most `gap` clean slots between them become
    /// one: a write call costs more than a few unchanged records.
    pub fn ranges(&self, gap: u32) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for word_index in self.low..self.high {
            let mut word = self.words[word_index];
            while word != 0 {
                let first = word.trailing_zeros();
                let run = (word >> first).trailing_ones();
                let start = word_index as u32 * 64 + first;
                match ranges.last_mut() {
                    Some(last) if start - last.end <= gap => last.end = start + run,
                    _ => ranges.push(start..start + run),
                }
                word = if first + run == 64 { 0 } else { word & (!0u64 << (first + run)) };
            }
        }
        ranges
    }
}

/// A table of records that live in the slots of a GPU buffer, with what changed since the last frame.
#[derive(Clone, Debug)]
pub struct Table<T> {
    /// One per slot.
    pub records: Vec<T>,
    /// Slots written since the frame before this one.
    pub dirty: DirtySlots,
}

impl<T> Default for Table<T> {
    fn default() -> Self {
        Self { records: Vec::new(), dirty: DirtySlots::default() }
    }
}

impl<T: Copy + PartialEq + Default> Table<T> {
    /// Writes a record, growing the table as needed; marks it only if it differs from what is there.
    pub fn write(&mut self, slot: u32, record: T) {
        let index = slot as usize;
        if index >= self.records.len() {
            self.records.resize(index + 1, T::default());
        } else if self.records[index] == record {
            return;
        }
        self.records[index] = record;
        self.dirty.mark(slot);
    }
}

impl<T: Pod + Default + Send> Table<T> {
    /// [`Self::write`] for many slots, none of them twice, in parallel: `record` makes that of `slots[index]`. Records
    /// differ if their bytes do.
    pub fn write_all(&mut self, slots: &[u32], record: impl Fn(usize) -> T + Sync) {
        // Each task looks for the slots in its part of the table: through all of them, unless they ascend.
        let ascend = slots.is_sorted();
        let (low, high) = if ascend { (slots.first(), slots.last()) } else { (slots.iter().min(), slots.iter().max()) };
        let Some((&low, &high)) = low.zip(high) else { return };
        if high as usize >= self.records.len() {
            self.records.resize(high as usize + 1, T::default());
        }
        let words = self.dirty.reach(low, high);
        let parts = (slots.len() / 4096).clamp(1, 2 * ComputeTaskPool::get().thread_num());
        let part = self.records.len().div_ceil(64).div_ceil(parts) * 64;
        let parts = self.records.chunks_mut(part).zip(words.chunks_mut(part / 64));
        in_parallel(parts.enumerate(), |(number, (records, words))| {
            let first = number * part;
            let before = |end: usize| slots.partition_point(|&slot| (slot as usize) < end);
            let here = if ascend { before(first)..before(first + records.len()) } else { 0..slots.len() };
            // Some are made and then compared: each by itself would be read while it is on its way to memory.
            let mut made = [(0, T::default()); TOGETHER];
            for start in here.clone().step_by(TOGETHER) {
                let mut count = 0;
                for (index, &slot) in (start..).zip(&slots[start..here.end.min(start + TOGETHER)]) {
                    let place = (slot as usize).wrapping_sub(first);
                    if place < records.len() {
                        made[count] = (place, record(index));
                        count += 1;
                    }
                }
                for (place, new) in &made[..count] {
                    if differ(&records[*place], new) {
                        records[*place] = *new;
                        words[place / 64] |= 1 << (place % 64);
                    }
                }
            }
        });
    }
}

/// Whether any bits differ. Records are made of 32-bit words; a comparison of bytes is a call.
#[inline(always)]
fn differ<T: Pod>(a: &T, b: &T) -> bool {
    const { assert!(size_of::<T>().is_multiple_of(4) && align_of::<T>() >= 4) };
    let (a, b): (&[u32], &[u32]) =
        (bytemuck::cast_slice(std::slice::from_ref(a)), bytemuck::cast_slice(std::slice::from_ref(b)));
    a.iter().zip(b).fold(0, |bits, (a, b)| bits | (a ^ b)) != 0
}

/// Records that [`Table::write_all`] makes at a time.
const TOGETHER: usize = 32;

/// Everything a frame draws. Made by the frame schedule, read by the renderer.
#[derive(Resource, Debug)]
pub struct DrawList {
    /// Tells the draw list of one world from that of another in the same process.
    pub world: u64,
    /// Counts frames. Dirty slots are relative to the frame before: a reader that missed one uploads everything.
    pub frame: u64,
    /// One per drawn object.
    pub instances: Table<InstanceRecord>,
    /// One per light.
    pub lights: Table<LightRecord>,
    /// What they have.
    pub light_traits: LightTraits,
    /// One per material of the library.
    pub materials: Table<MaterialRecord>,
    /// The textures that maps are layers of.
    pub texture_arrays: Vec<TextureArray>,
    /// Indexed by [`ClassId`].
    pub classes: Vec<MaterialClass>,
    /// Objects drawn, blended ones among them.
    pub objects: u32,
    /// Pages of opaque and masked objects, grouped by batch: page p holds the slots from p times [`PAGE_SLOTS`] on.
    pub pages: Vec<u32>,
    /// In drawing order.
    pub batches: Vec<Batch>,
    /// Changes whenever `pages` and `batches` did.
    pub batches_version: u64,
    /// Blended objects, in slot order.
    pub transparent: Vec<Transparent>,
    /// Changes whenever `transparent` did.
    pub transparent_version: u64,
    /// Every light that reaches an object shades it: the reference for the choice of three.
    pub all_lights: bool,
    /// The lights that reach each object, while `all_lights`: element i is where the list of the object in slot i
    /// begins, which has as many elements as its record says.
    pub reaching: Vec<u32>,
    /// Elements that `reaching` would have; it stays empty if they are more than [`MAX_REACHING`].
    pub reaching_elements: u64,
    /// Changes whenever `reaching` did.
    pub reaching_version: u64,
    /// Ambient light, sky and tone map.
    pub environment: Environment,
}

impl Default for DrawList {
    fn default() -> Self {
        static WORLDS: AtomicU64 = AtomicU64::new(1);
        Self {
            world: WORLDS.fetch_add(1, Ordering::Relaxed),
            frame: 0,
            instances: Table::default(),
            lights: Table::default(),
            light_traits: LightTraits::default(),
            materials: Table::default(),
            texture_arrays: Vec::new(),
            classes: Vec::new(),
            objects: 0,
            pages: Vec::new(),
            batches: Vec::new(),
            batches_version: 0,
            transparent: Vec::new(),
            transparent_version: 0,
            all_lights: false,
            reaching: Vec::new(),
            reaching_elements: 0,
            reaching_version: 0,
            environment: Environment::default(),
        }
    }
}

impl DrawList {
    /// The records of drawn objects, blended ones among them, in the order of their slots.
    pub fn drawn(&self) -> impl Iterator<Item = &InstanceRecord> {
        self.instances.records.iter().filter(|record| **record != InstanceRecord::default())
    }
}
