//! The draws of a scene as the culling pass reads them: which pages each one looks through, and where the slots that it
//! keeps go. Made anew when batches or meshes changed, never otherwise; the same for every view.
//!
//! ```text
//! pages[p]      a page of instance slots, and its batch           for `cull` and `occlude`
//! batches[b]    what culling needs to know of the batch's mesh
//! entries[e]    a page and a draw that looks through it           for `count` and `scatter`
//! draws[d]      a batch at one level of detail: its entries, and where its list of visible slots begins
//! arguments[d]  the indirect draw of such a list
//! ```

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::growing_buffer::GrowingBuffer;
use crate::renderer::resources::meshes::Meshes;
use bytemuck::{Pod, Zeroable};
use systems::assets::levels::MOST_LEVELS;
use systems::draw::{BatchKey, DrawList, PAGE_SLOTS};
use systems::ecs::tables::DirtySlots;
use wgpu::util::DrawIndexedIndirectArgs;

/// Mirrors `CullBatch` of shaders/cull.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct CullBatchRecord {
    /// Centre of the mesh's bounding sphere, object space.
    pub center: [f32; 3],
    /// Radius of the mesh's bounding sphere, object space.
    pub radius: f32,
    /// Half extents of the box around the mesh, from the same centre, object space.
    pub half_extents: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
    /// Centre of the sphere that levels of detail are chosen by, object space.
    pub level_center: [f32; 3],
    /// Radius of the sphere that levels of detail are chosen by, object space.
    pub level_radius: f32,
    /// Error of each level of detail, metres in object space; beyond any measure where there is none.
    pub errors: [f32; MOST_LEVELS],
}

/// Mirrors `CullDraw` of shaders/cull.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct CullDrawRecord {
    /// Level of detail.
    pub level: u32,
    /// First of its entries.
    pub first_entry: u32,
    /// One past the last of its entries.
    pub end_entry: u32,
    /// Start of its list of visible slots, in the early phase.
    pub first_visible: u32,
}

/// A batch at one level of detail.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    pub key: BatchKey,
    /// Number of its batch among those whose mesh is uploaded.
    pub batch: usize,
    /// Level of detail.
    pub level: u32,
    /// Arguments of the draw, except first instance and instance count, which culling fills in.
    pub indirect: DrawIndexedIndirectArgs,
    /// Start of its slots in the list of visible ones, in the early phase.
    pub first_visible: u32,
}

/// Version of the draws: world, version of its batches, version of the meshes, levels of detail or not.
pub(crate) type IndirectDrawsVersion = (u64, u64, u64, bool);

/// All draws of a scene.
#[derive(Debug)]
pub(crate) struct IndirectDraws {
    version: IndirectDrawsVersion,
    pub list: Vec<Draw>,
    pub page_count: u32,
    pub entry_count: u32,
    /// Slots that the pages reach up to.
    pub slot_count: u32,
    pages: GrowingBuffer,
    batches: GrowingBuffer,
    entries: GrowingBuffer,
    draws: GrowingBuffer,
}

impl IndirectDraws {
    pub fn new(device: &wgpu::Device) -> Self {
        let storage = |label| GrowingBuffer::new(device, label, wgpu::BufferUsages::STORAGE);
        Self {
            version: IndirectDrawsVersion::default(),
            list: Vec::new(),
            page_count: 0,
            entry_count: 0,
            slot_count: 0,
            pages: storage("pages of objects"),
            batches: storage("batches"),
            entries: storage("pages of draws"),
            draws: storage("draws"),
        }
    }

    /// The buffers in the order of their bindings.
    pub fn buffers(&self) -> [&GrowingBuffer; 4] {
        [&self.pages, &self.batches, &self.entries, &self.draws]
    }

    /// Tells if they have levels of detail.
    pub fn with_levels(&self) -> bool {
        self.version.3
    }

    /// Tells draws from others.
    pub fn version(&self) -> IndirectDrawsVersion {
        self.version
    }

    /// Brings the draws up to date. Returns the bytes uploaded.
    pub fn update(&mut self, gpu: &Gpu, list: &DrawList, meshes: &Meshes, levels: bool) -> Result<u64, RenderError> {
        let version = (list.world, list.batches_version, meshes.version(), levels);
        if version == self.version {
            return Ok(0);
        }
        self.list.clear();
        let (mut pages, mut batches, mut entries, mut draws) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for batch in &list.batches {
            let Some(mesh) = meshes.range(batch.key.mesh) else { continue };
            let its_pages = &list.pages[batch.pages.start as usize..batch.pages.end as usize];
            pages.extend(its_pages.iter().map(|&page| [page, batches.len() as u32]));
            let its_levels = &mesh.levels[..if levels { mesh.levels.len() } else { mesh.levels.len().min(1) }];
            let mut errors = [f32::MAX; MOST_LEVELS];
            errors.iter_mut().zip(its_levels).for_each(|(error, level)| *error = level.error);
            let (center, radius) = (mesh.bounds.center.to_array(), mesh.bounds.radius);
            let half_extents = mesh.half_extents.to_array();
            let (level_center, level_radius) = (mesh.level_bounds.center.to_array(), mesh.level_bounds.radius);
            let spheres = CullBatchRecord { center, radius, half_extents, level_center, level_radius, pad0: 0, errors };
            let place = batches.len();
            batches.push(spheres);
            for (number, level) in (0..).zip(its_levels).filter(|(_, level)| level.index_count > 0) {
                let first_entry = entries.len() as u32;
                let first_visible = first_entry * PAGE_SLOTS;
                entries.extend(its_pages.iter().map(|&page| [page, draws.len() as u32]));
                let end_entry = entries.len() as u32;
                draws.push(CullDrawRecord { level: number, first_entry, end_entry, first_visible });
                let indirect = DrawIndexedIndirectArgs {
                    index_count: level.index_count,
                    instance_count: 0,
                    first_index: mesh.first_index() + level.first_index,
                    base_vertex: mesh.base_vertex(),
                    first_instance: 0,
                };
                self.list.push(Draw { key: batch.key, batch: place, level: number, indirect, first_visible });
            }
        }
        (self.page_count, self.entry_count) = (pages.len() as u32, entries.len() as u32);
        self.slot_count = list.pages.iter().max().map_or(0, |page| (page + 1) * PAGE_SLOTS);
        let all = DirtySlots::default();
        let bytes = self.pages.write(gpu, &pages, &all, true)?
            + self.batches.write(gpu, &batches, &all, true)?
            + self.entries.write(gpu, &entries, &all, true)?
            + self.draws.write(gpu, &draws, &all, true)?;
        self.version = version;
        Ok(bytes)
    }
}
