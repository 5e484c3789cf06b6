//! The seam between the world and the GPU: the plain structs that shaders read, and the batches. What of them changed
//! is in their tables (`tables.rs`).
//!
//! The systems write a [`DrawList`] each frame. The renderer reads it, the meshes and images of the library that are
//! not uploaded yet, and the records of objects that changed (`instance_records.rs`).
//! `shaders/types.wgsl` mirrors the `…Record` structs; `tests/shaders.rs` compares every offset of the two.
//!
//! ```text
//! instances[slot]  one record per drawn object, in pages of 64 slots; an object keeps its slot while it lives
//! batches[b]       objects with the same pipeline, material class and mesh: those of pages[batches[b].pages]
//! transparent[i]   objects that are culled and sorted per view and drawn after the batches
//! ```

use crate::bounds::Sphere;
use crate::components::Environment;
use crate::images::Texels;
use crate::instance_records::InstanceSlots;
use crate::library::{AlphaMode, ImageId, MeshId, Sampler, Shading, Technique};
use crate::tables::Table;
use bevy_ecs::prelude::*;
use bytemuck::{Pod, Zeroable};
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
    /// Irradiance of what the three lights leave out, linear RGB; the same, times its luminance-weighted direction
    /// (world space); the same, times how much of it comes along each axis, from either side, but for the last.
    pub remainder: [u32; 4],
    /// How much comes along z. Sum of the scores of the lights that are not among the three: what the object's three,
    /// each in full, may miss.
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
    /// Of a spot its exponent, or 1 / (`versine_outer` − versine of its inner half angle).
    pub exponent_or_cone_slope: f32,
    /// World space, unit: the way the light shines. Shaders read it of spots.
    pub direction: [f32; 3],
    /// Versine (1 − cosine) of the outer half angle.
    pub versine_outer: f32,
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

/// What some light of a world has or had, enabled or not. Shaders are compiled without what none had: each value that
/// they do not read of every light makes a pixel cheaper. What was there once stays: the frame in which the last one
/// goes does not wait for shaders to be compiled anew.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct LightTraits {
    /// An attenuation other than [`Light::INVERSE_SQUARE`](crate::components::Light::INVERSE_SQUARE).
    pub attenuation: bool,
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
    /// The same for positions from the eye, along the world's axes: nothing is lost in rounding far from the origin.
    pub clip_from_eye: [[f32; 4]; 4],
    /// Its inverse, for the sky's directions.
    pub eye_from_clip: [[f32; 4]; 4],
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
    /// The height map rises above the mesh, on either side: with [`Technique::writes_depth`], depths lie before it.
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

/// An object that is blended: culled and sorted per view.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Transparent {
    /// Instance slot.
    pub slot: u32,
    /// What it is drawn with.
    pub key: BatchKey,
    /// World space.
    pub bounds: Sphere,
}

/// Everything a frame draws. Made by the frame schedule, read by the renderer.
#[derive(Resource, Debug)]
pub struct DrawList {
    /// Tells the draw list of one world from that of another in the same process.
    pub world: u64,
    /// Counts frames. Dirty slots are relative to the frame before: a reader that missed one uploads everything.
    pub frame: u64,
    /// What is in the slots of drawn objects; their records are made when they are read.
    pub instances: InstanceSlots,
    /// One per light.
    pub lights: Table<LightRecord>,
    /// What they have or had.
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
            instances: InstanceSlots::default(),
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
