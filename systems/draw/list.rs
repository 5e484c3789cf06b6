//! The seam between the world and the GPU: tables of the records that shaders read (`records.rs`), what of them changed
//! ([`tables`](crate::ecs::tables)), and the batches that they are drawn in.
//!
//! The systems write a [`DrawList`] each frame. The renderer reads it, the meshes and images of the library that it has
//! not uploaded as they are, and the records of objects that changed (`instance_records.rs`).
//!
//! ```text
//! instances[slot]  one record per drawn object, in pages of 64 slots; an object keeps its slot while it lives
//! batches[b]       objects with the same pipeline, material class and mesh: those of pages[batches[b].pages]
//! transparent[i]   objects that are culled and sorted per view and drawn after the batches
//! ```

use super::environment::Environment;
use super::instance_records::InstanceSlots;
use super::records::MaterialRecord;
use super::sky_light::drawn_sky::DrawnSky;
use crate::assets::image::{Image, ImageId, Texels};
use crate::assets::material::{AlphaMode, MAP_COUNT, Sampler, Shading};
use crate::assets::mesh::MeshId;
use crate::assets::technique::Technique;
use crate::ecs::stats::FrameStats;
use crate::ecs::tables::Table;
use crate::lights::lists::LightLists;
use crate::lights::policy::LightPolicies;
use crate::lights::record::PackedLight;
use crate::space::bounds::Sphere;
use bevy_ecs::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Slots in a page of instances; a page holds objects of one batch.
pub const PAGE_SLOTS: u32 = 64;

/// Features that some light of a world has or had, enabled or not. Shaders are compiled without those that none had:
/// each value that they do not read of every light makes a pixel cheaper. A feature stays once it was there: the frame
/// in which its last light goes does not wait for shaders to be compiled anew.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct LightFeatures {
    /// An attenuation other than [`Light::INVERSE_SQUARE`](crate::lights::Light::INVERSE_SQUARE).
    pub attenuation: bool,
    /// A spot's cone.
    pub cones: bool,
    /// A spot with an exponent instead of an inner cone.
    pub exponents: bool,
    /// An ambient colour.
    pub ambient: bool,
    /// Objects with more than three lights; since the policies changed.
    pub lists: bool,
    /// A point light or spot that casts shadows.
    pub lamp_shadows: bool,
    /// A directional light that does.
    pub sun_shadows: bool,
    /// A light that casts shadows and has a size.
    pub sizes: bool,
    /// A sky that is an atmosphere, in this frame.
    pub atmosphere: bool,
    /// Objects that hide such a sky, in this frame.
    pub openness: bool,
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

/// Images of one size and format, each a layer of one texture.
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
    /// The image of each layer; `None` for a layer that is free. Without any, there is no texture.
    pub layers: Vec<Option<ImageId>>,
}

impl TextureArray {
    /// One for images like that, without any yet.
    pub fn of(image: &Image) -> Self {
        Self {
            width: image.width,
            height: image.height,
            srgb: image.kind.is_color() && image.texels != Texels::Rgba16Float,
            texels: image.texels,
            layers: Vec::new(),
        }
    }

    /// Tells if a layer of one could be a layer of the other.
    pub fn same_format(&self, other: &Self) -> bool {
        (self.width, self.height, self.srgb, self.texels) == (other.width, other.height, other.srgb, other.texels)
    }
}

/// Texture bindings of a draw's materials: per [`MapSlot`](crate::assets::MapSlot) an index into
/// [`DrawList::texture_arrays`] and a sampler.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct MaterialClass {
    /// Texture arrays.
    pub arrays: [u32; MAP_COUNT],
    /// Samplers.
    pub samplers: [Sampler; MAP_COUNT],
}

/// Names a [`MaterialClass`]; see `materials.rs`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct ClassId(pub u32);

/// State that the instances of one draw share; batches are sorted by it.
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
    /// State that its instances share.
    pub key: BatchKey,
    /// Range of the elements of [`DrawList::pages`] that hold them.
    pub pages: Range<u32>,
}

/// An object that is blended: culled and sorted per view.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Transparent {
    /// Instance slot.
    pub slot: u32,
    /// Pipeline, textures and mesh.
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
    /// Slots of drawn objects; their records are made when they are read.
    pub instances: InstanceSlots,
    /// One per light.
    pub lights: Table<PackedLight>,
    /// Features that the lights have or had.
    pub light_features: LightFeatures,
    /// One per slot of the library's materials.
    pub materials: Table<MaterialRecord>,
    /// The textures that maps are layers of.
    pub texture_arrays: Vec<TextureArray>,
    /// Indexed by [`ClassId`].
    pub classes: Vec<MaterialClass>,
    /// Changes whenever `texture_arrays` or `classes` did.
    pub textures_version: u64,
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
    /// Ambient light, sky and tone map, with the exposure of this frame.
    pub environment: Environment,
    /// Sky, where it is more than the environment's three colours.
    pub sky: Option<DrawnSky>,
}

impl DrawList {
    /// The slots of all that is drawn, with what they are drawn with: batches first, then what is blended.
    pub fn drawn(&self) -> impl Iterator<Item = (u32, BatchKey)> {
        let slots = |page: &u32| page * PAGE_SLOTS..(page + 1) * PAGE_SLOTS;
        let is_used = |slot: &u32| self.instances.objects.get(*slot as usize).is_some_and(Option::is_some);
        let in_batches = self.batches.iter().flat_map(move |batch| {
            let pages = self.pages[batch.pages.start as usize..batch.pages.end as usize].iter();
            pages.flat_map(slots).filter(is_used).map(|slot| (slot, batch.key))
        });
        in_batches.chain(self.transparent.iter().map(|object| (object.slot, object.key)))
    }
}

impl Default for DrawList {
    fn default() -> Self {
        static WORLDS: AtomicU64 = AtomicU64::new(1);
        Self {
            world: WORLDS.fetch_add(1, Ordering::Relaxed),
            frame: 0,
            instances: InstanceSlots::default(),
            lights: Table::default(),
            light_features: LightFeatures::default(),
            materials: Table::default(),
            texture_arrays: Vec::new(),
            classes: Vec::new(),
            textures_version: 0,
            objects: 0,
            pages: Vec::new(),
            batches: Vec::new(),
            batches_version: 0,
            transparent: Vec::new(),
            transparent_version: 0,
            environment: Environment::default(),
            sky: None,
        }
    }
}

/// Begins a frame: nothing is dirty, what holds for all of it is known.
pub(crate) fn begin_frame(mut list: ResMut<DrawList>, environment: Res<Environment>, policies: Res<LightPolicies>) {
    let list = list.bypass_change_detection();
    list.frame += 1;
    list.instances.dirty.clear();
    list.lights.dirty.clear();
    list.materials.dirty.clear();
    if policies.is_changed() {
        list.light_features.lists = false;
    }
    if list.environment != *environment {
        list.environment = environment.clone();
    }
}

/// Counts what a frame draws.
pub(crate) fn count(mut stats: ResMut<FrameStats>, mut list: ResMut<DrawList>, lists: Res<LightLists>) {
    let list = list.bypass_change_detection();
    list.light_features.lists |= !lists.is_empty();
    stats.listed_objects = lists.len();
    stats.listed_lights = lists.lights();
    stats.objects = list.objects as usize;
    stats.instances_written = list.instances.dirty.ranges(0).iter().map(ExactSizeIterator::len).sum();
    stats.batches = list.batches.len();
    stats.transparent = list.transparent.len();
}
