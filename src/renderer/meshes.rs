//! All meshes in one vertex and one index buffer, uploaded once, in id order.

use super::tables::GrowingBuffer;
use super::{Gpu, RenderError};
use glam::Vec3;
use systems::assets::{Level, Library, Mesh, MeshId};
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
pub(super) const VERTEX_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<Vertex>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![
        0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32x4, 4 => Unorm16x4
    ],
};

/// Per instance: its slot, `VertexIn`'s last.
pub(super) const SLOT_LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: size_of::<u32>() as u64,
    step_mode: wgpu::VertexStepMode::Instance,
    attributes: &wgpu::vertex_attr_array![5 => Uint32],
};

/// Where a mesh lies in the shared buffers.
#[derive(Clone, Debug)]
pub(super) struct MeshRange {
    pub base_vertex: i32,
    /// Object space.
    pub bounds: Sphere,
    /// Of the box around it, whose centre is the sphere's, object space.
    pub half_extents: Vec3,
    /// Levels of detail, the mesh itself first; their indices counted from the start of the shared buffer.
    pub levels: Vec<Level>,
}

/// The shared buffers.
#[derive(Debug)]
pub(super) struct Meshes {
    pub vertices: GrowingBuffer,
    pub indices: GrowingBuffer,
    ranges: Vec<MeshRange>,
    vertex_count: u64,
    index_count: u64,
}

impl Meshes {
    pub fn new(device: &wgpu::Device) -> Self {
        Self {
            vertices: GrowingBuffer::new(device, "vertices", wgpu::BufferUsages::VERTEX),
            indices: GrowingBuffer::new(device, "indices", wgpu::BufferUsages::INDEX),
            ranges: Vec::new(),
            vertex_count: 0,
            index_count: 0,
        }
    }

    pub fn range(&self, mesh: MeshId) -> Option<&MeshRange> {
        self.ranges.get(mesh.0 as usize)
    }

    /// How many are uploaded.
    pub fn count(&self) -> usize {
        self.ranges.len()
    }

    /// Uploads the meshes that are ready and were not there before. Returns the bytes written.
    pub fn upload(&mut self, gpu: &Gpu, library: &Library) -> Result<u64, RenderError> {
        let new = library.meshes().get(self.ranges.len()..).unwrap_or_default();
        let ready = new.iter().take_while(|entry| !entry.levels.is_empty()).count();
        let new = &new[..ready];
        let vertices: u64 = new.iter().map(|e| e.mesh.positions.len() as u64).sum();
        let indices: u64 = new.iter().map(|e| (e.mesh.indices.len() + e.level_indices.len()) as u64).sum();
        let (stride, index) = (size_of::<Vertex>() as u64, size_of::<u32>() as u64);
        self.vertices.extend(gpu, self.vertex_count * stride, (self.vertex_count + vertices) * stride)?;
        self.indices.extend(gpu, self.index_count * index, (self.index_count + indices) * index)?;
        for entry in new {
            let mesh = &entry.mesh;
            let packed = pack(mesh);
            gpu.queue.write_buffer(self.vertices.buffer(), self.vertex_count * stride, bytemuck::cast_slice(&packed));
            let first_index = self.index_count as u32;
            let levels =
                entry.levels.iter().map(|l| Level { first_index: first_index + l.first_index, ..*l }).collect();
            let aabb = mesh.aabb();
            self.ranges.push(MeshRange {
                base_vertex: self.vertex_count as i32,
                bounds: entry.bounds,
                half_extents: (aabb.max - aabb.min) * 0.5,
                levels,
            });
            self.vertex_count += packed.len() as u64;
            for indices in [&mesh.indices, &entry.level_indices] {
                let bytes: &[u8] = bytemuck::cast_slice(indices);
                gpu.queue.write_buffer(self.indices.buffer(), self.index_count * index, bytes);
                self.index_count += indices.len() as u64;
            }
        }
        Ok(vertices * stride + indices * index)
    }
}

fn pack(mesh: &Mesh) -> Vec<Vertex> {
    let [first, second] = &mesh.uvs;
    let unorm16 = |v: f32| (v.clamp(0.0, 1.0) * 65535.0).round() as u16;
    let vertex = |i: usize| {
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
    (0..mesh.positions.len()).map(vertex).collect()
}
