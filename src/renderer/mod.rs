//! The GPU half of a frame. A [`Renderer`] has the device and the scene as it is uploaded; a [`ViewState`] has what
//! belongs to one camera. A frame draws a list of views:
//!
//! ```text
//! Renderer::prepare(frame, views)                     uploads what changed, makes the pipelines that are missing
//!   meshes        new and replaced ones into the shared vertex and index buffers; removed ones make room
//!   textures      new and replaced layers of the texture arrays; bind groups of each material class
//!   frame tables  dirty records of instances, lights, materials
//!   draws         what the culling pass reads, if the batches changed
//!   each view     targets, the order of blended objects, room for the lists of visible ones
//! Renderer::encode(encoder, views)                    encodes only; the caller submits
//!   culling       which objects each view shows → lists of slots and arguments of draws, on the GPU
//!   forward       an indirect draw per batch and level of detail, the sky, blended objects back to front
//!                 → HDR, multisampled
//!   tone map      of each sample; their mean → the view's target
//!   outputs       depths, normals and ids that are asked for, with the picture or after it
//! Renderer::draw_outputs(view, outputs)               the same for those that were not asked for; reads them back
//! ```
//!
//! A window, a file and a test call the same functions: a target is any texture view. Programs with one camera have
//! [`SingleView`].
//!
//! Floors, each of which may use those before it:
//!
//! ```text
//! plan        what is asked for: settings, outputs, the plan of a view
//! gpu         the device, its errors; buffers, textures, read-backs, timestamps, texts of shaders
//! resources   what is uploaded of a scene: meshes, textures of materials, tables of records
//! passes      pipelines, and what passes draw into
//! culling     which objects a view draws, and how much that was
//! shadows     layers of the shadow maps: lights, casters, passes; shadows that rays found
//! views       what each view keeps from frame to frame, and what it gives
//! frame       `Renderer`: prepares, encodes, reads back; many views and worlds together
//! ```

mod culling;
mod frame;
mod gpu;
mod passes;
mod plan;
mod resources;
mod shadows;
mod views;

pub use culling::cull::CullRecord;
pub use culling::indirect_draws::{CullBatchRecord, CullDrawRecord};
pub use culling::slot_set::SlotSet;
pub use culling::visible_counts::VisibleCounts;
pub use frame::many_worlds::{Lend, ReadFrame};
pub use frame::renderer::Renderer;
pub use frame::single_view::SingleView;
pub use frame::view_batches::ViewBatches;
pub use gpu::cpu_rasterizer::keep_freed_memory;
pub use gpu::device::{Gpu, instance_flags};
pub use gpu::error::{GpuError, RenderError};
pub use gpu::faults::Faults;
pub use gpu::formats::PICTURE_FORMAT;
pub use gpu::readback::{picture_texture, read_texture};
pub use gpu::shaders;
#[cfg(feature = "tools")]
pub(crate) use gpu::texture::texture;
pub use gpu::timestamps::PassTime;
pub use passes::custom_passes::{PassPlace, PassTargets};
pub use passes::pack::Packing;
pub use plan::output_set::OutputSet;
pub use plan::packed::{PackedArray, PackedLabels, PackedLayout};
pub use plan::settings::{DebugView, HeatScale, Occlusion, Settings};
pub use plan::view_plan::ViewPlan;
pub use resources::stats::{HeldBytes, RenderStats, ShadowStats};
pub use shadows::shadow_layers::ShadowFaceRecord;
pub use shadows::traced::{TracedRow, TracedShadows};
pub use views::outputs::{Outputs, Picked};
pub use views::view_state::ViewState;
pub use views::view_target::ViewTarget;
