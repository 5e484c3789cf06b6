//! All meshes in one vertex and one index buffer, uploaded when they are new or replaced, in the order of their slots.

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::shared_buffer::{Run, SharedBuffer};
use glam::Vec3;
use std::collections::BTreeSet;
use std::ops::Range;
use systems::assets::{Level, Library, Mesh, MeshEntry, MeshId};
use systems::space::Sphere;

/// One vertex as the forward shader's `VertexIn` reads it.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    tangent: [f32; 4],
    uvs: [f32; 4],
    color: [u16; 4],
}

/// The layout of [`Vertex`].
pub(crate) const VERTEX_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<Vertex>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![
        0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32x4, 4 => Unorm16x4
    ],
};

/// Per instance: its slot, `VertexIn`'s last.
pub(crate) const SLOT_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<u32>() as u64,
    step_mode: wgpu::VertexStepMode::Instance,
    attributes: &wgpu::vertex_attr_array![5 => Uint32],
};

/// Place of a mesh in the shared buffers.
#[derive(Clone, Debug)]
pub(crate) struct MeshRange {
    id: MeshId,
    vertices: Range<u64>,
    indices: Range<u64>,
    /// Object space.
    pub bounds: Sphere,
    /// Sphere from whose nearest point distances are taken that levels are chosen by, object space.
    pub level_bounds: Sphere,
    /// Half extents of its bounding box, whose centre is the sphere's, object space.
    pub half_extents: Vec3,
    /// Levels of detail, the mesh itself first; their indices counted from [`Self::first_index`].
    pub levels: Vec<Level>,
}

impl MeshRange {
    /// Offset that is added to its indices.
    pub fn base_vertex(&self) -> i32 {
        self.vertices.start as i32
    }

    /// Start of its levels in the index buffer.
    pub fn first_index(&self) -> u32 {
        self.indices.start as u32
    }
}

/// The shared buffers.
#[derive(Debug)]
pub(crate) struct Meshes {
    pub vertices: SharedBuffer,
    pub indices: SharedBuffer,
    /// By slot.
    ranges: Vec<Option<MeshRange>>,
    /// The revision of the library's meshes that was looked at last.
    seen: u64,
    /// Slots of meshes that are to be uploaded once they are finished.
    waiting: BTreeSet<u32>,
    version: u64,
}

impl Meshes {
    pub fn new(device: &wgpu::Device) -> Self {
        Self {
            vertices: SharedBuffer::new(device, "vertices", wgpu::BufferUsages::VERTEX, size_of::<Vertex>()),
            indices: SharedBuffer::new(device, "indices", wgpu::BufferUsages::INDEX, size_of::<u32>()),
            ranges: Vec::new(),
            seen: 0,
            waiting: BTreeSet::new(),
            version: 0,
        }
    }

    pub fn range(&self, mesh: MeshId) -> Option<&MeshRange> {
        self.ranges.get(mesh.slot() as usize)?.as_ref().filter(|range| range.id == mesh)
    }

    /// Changes whenever a mesh is another one, elsewhere, or gone.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Bytes of the buffers.
    pub fn bytes(&self) -> u64 {
        self.vertices.buffer().size() + self.indices.buffer().size()
    }

    /// Uploads the meshes that are ready and were not there before, gives up the room of those that are gone. Returns
    /// the bytes written.
    pub fn upload(&mut self, gpu: &Gpu, library: &Library) -> Result<u64, RenderError> {
        if self.seen == library.revisions().meshes && self.waiting.is_empty() {
            return Ok(0);
        }
        self.waiting.extend(library.changed_meshes(self.seen));
        self.seen = library.revisions().meshes;
        let mut ready: Vec<(MeshId, &MeshEntry)> = Vec::new();
        for slot in std::mem::take(&mut self.waiting) {
            match library.mesh_in_slot(slot) {
                Some((id, entry)) if entry.levels.is_empty() => {
                    self.waiting.insert(slot);
                    // What it replaces is drawn meanwhile.
                    if self.range(id).is_none() {
                        self.release(slot);
                    }
                }
                Some(new) => {
                    self.release(slot);
                    ready.push(new);
                }
                None => self.release(slot),
            }
        }
        let sizes = |entry: &MeshEntry| {
            let indices = entry.mesh.indices.len() + entry.level_indices.len();
            [entry.mesh.positions.len() as u64, indices as u64]
        };
        if let Err(error) = self.make_room(gpu, ready.iter().map(|(_, entry)| sizes(entry))) {
            self.waiting.extend(ready.iter().map(|(id, _)| id.slot()));
            return Err(error);
        }
        let mut written = 0;
        let (mut new_vertices, mut new_indices) = (Run::default(), Run::default());
        for (id, entry) in ready {
            let (mesh, [vertices, indices]) = (&entry.mesh, sizes(entry));
            let (vertices, indices) = (self.vertices.take(vertices), self.indices.take(indices));
            written += self.vertices.add(gpu, &mut new_vertices, vertices.start, packed(mesh));
            let all_levels = mesh.indices.iter().chain(&entry.level_indices).copied();
            written += self.indices.add(gpu, &mut new_indices, indices.start, all_levels);
            let (aabb, slot) = (mesh.aabb(), id.slot() as usize);
            let half_extents = (aabb.max - aabb.min) * 0.5;
            self.ranges.resize(self.ranges.len().max(slot + 1), None);
            let (bounds, level_bounds, levels) = (entry.bounds, entry.level_bounds, entry.levels.clone());
            self.ranges[slot] = Some(MeshRange { id, vertices, indices, bounds, level_bounds, half_extents, levels });
            self.version += 1;
        }
        Ok(written + self.vertices.write(gpu, &mut new_vertices) + self.indices.write(gpu, &mut new_indices))
    }

    fn release(&mut self, slot: u32) {
        if let Some(range) = self.ranges.get_mut(slot as usize).and_then(Option::take) {
            self.vertices.release(range.vertices);
            self.indices.release(range.indices);
            self.version += 1;
        }
    }

    /// Makes room for meshes of so many vertices and indices, and gives up room that is not needed.
    fn make_room(&mut self, gpu: &Gpu, sizes: impl Iterator<Item = [u64; 2]> + Clone) -> Result<(), RenderError> {
        let Self { vertices, indices, ranges, version, .. } = self;
        let held = ranges.iter_mut().flatten().map(|range| &mut range.vertices);
        *version += u64::from(vertices.make_room(gpu, sizes.clone().map(|[vertices, _]| vertices), held)?);
        let held = ranges.iter_mut().flatten().map(|range| &mut range.indices);
        *version += u64::from(indices.make_room(gpu, sizes.map(|[_, indices]| indices), held)?);
        Ok(())
    }
}

fn packed(mesh: &Mesh) -> impl Iterator<Item = Vertex> {
    let [first, second] = &mesh.uvs;
    let unorm16 = |v: f32| (v.clamp(0.0, 1.0) * 65535.0).round() as u16;
    let vertex = move |i: usize| {
        let a = first.get(i).copied().unwrap_or_default();
        let b = second.get(i).copied().unwrap_or(a);
        let color = mesh.colors.get(i).copied().unwrap_or(glam::Vec4::ONE);
        Vertex {
            position: mesh.positions[i].to_array(),
            normal: mesh.normals.get(i).copied().unwrap_or(glam::Vec3::Y).to_array(),
            tangent: mesh.tangents.get(i).copied().unwrap_or(glam::Vec4::new(1.0, 0.0, 0.0, 1.0)).to_array(),
            uvs: [a.x, a.y, b.x, b.y],
            color: color.to_array().map(unorm16),
        }
    };
    (0..mesh.positions.len()).map(vertex)
}
