//! Drawn objects: the world as the renderer reads it.
//!
//! The [`DrawList`] is the seam. Its tables hold the structs that shaders read ([`InstanceRecord`], [`MaterialRecord`],
//! and those of lights); its batches say what is drawn together. `materials` and `light_records` write their tables.
//! `instances` gives every object a slot in a page of its batch (`pages`), `instance_records` makes an object's record
//! of its components when it is read, and `batches` lists the pages. A renderer reads a frame as [`FrameData`], with
//! what casts shadows (`shadow_casters`).
//! Objects that lack their mesh, material or place wait as `incomplete`; large ones are drawn in [`pieces`]. [`hooks`]
//! take what goes out of all these tables. A [`View`] is a [`Camera`] at a place, under an [`Environment`],
//! whose [`ToneMap`] has its curves on the CPU, too (`tone`), and under a sky ([`DrawnSky`]).

pub(crate) mod batches;
pub(crate) mod camera;
pub(crate) mod environment;
pub(crate) mod frame_data;
pub mod hooks;
pub(crate) mod incomplete;
pub(crate) mod instance_records;
pub(crate) mod instances;
pub(crate) mod intrinsics;
pub(crate) mod light_records;
pub(crate) mod list;
pub(crate) mod materials;
pub(crate) mod pages;
pub mod pieces;
pub(crate) mod records;
pub(crate) mod shadow_casters;
pub mod sky_light;
mod tone;
pub(crate) mod view;

pub use batches::{BlendedRun, sort_transparent, update_batches};
pub use camera::{Camera, Projection};
pub use environment::{Environment, ToneMap};
pub use frame_data::FrameData;
pub use incomplete::{Incomplete, complete};
pub use instance_records::{InstanceRecords, InstanceSlots};
pub use instances::{InstanceTable, update_instances};
pub use intrinsics::Intrinsics;
pub use light_records::update_light_table;
pub use list::{
    Batch, BatchKey, ClassId, DrawList, LightFeatures, MaterialClass, PAGE_SLOTS, PipelineKey, TextureArray,
    Transparent,
};
pub use materials::{MOST_LAYERS, MaterialTable, most_layers, update_materials};
pub use records::{InstanceRecord, MaterialRecord, SkyRecord, ViewRecord};
pub use shadow_casters::{ShadowCaster, ShadowScene};
pub use sky_light::{DrawnSky, MoverTexel, Movers, WeatherLight};
pub use view::{View, in_frustum, rigid};
