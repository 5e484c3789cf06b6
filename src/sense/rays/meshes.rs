//! Meshes and materials as rays meet them, kept from one capture to the next as long as they are the same.

use glam::{Affine2, Vec2, Vec3, Vec4, Vec4Swizzles};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use systems::assets::texels::Texture;
use systems::assets::{AlphaMode, ImageId, Library, Mesh, MeshId, Revisions, Sampler};
use systems::ecs::parallel::map_in_parallel;
use systems::lights::LUMINANCE;
use systems::space::Aabb;
use systems::space::triangle_tree::TriangleTree;

/// Texels along a side of the maps that rays read.
const MOST_TEXELS: u32 = 1024;

/// A mesh, level 0 of its levels of detail.
pub struct RayMesh {
    /// `None`: it has no surface, or none that there could be a tree for.
    pub tree: Option<TriangleTree>,
    /// Object space, metres.
    pub aabb: Aabb,
    positions: Vec<Vec3>,
    uvs: [Vec<Vec2>; 2],
    colors: Vec<Vec4>,
    indices: Vec<[u32; 3]>,
}

impl RayMesh {
    fn new(mesh: &Mesh, aabb: Aabb) -> Self {
        let indices = mesh.indices.as_chunks::<3>().0.to_vec();
        let corners = indices.iter().map(|triangle| triangle.map(|vertex| mesh.positions[vertex as usize]));
        Self {
            tree: TriangleTree::new(corners).ok(),
            aabb,
            positions: mesh.positions.clone(),
            uvs: mesh.uvs.clone(),
            colors: mesh.colors.clone(),
            indices,
        }
    }

    /// Object space, metres.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.indices[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// Place in a set of UVs, in a triangle by its corners' weights; the first where there is no second.
    fn uv(&self, set: usize, triangle: u32, weights: Vec3) -> Vec2 {
        let second = set == 1 && !self.uvs[1].is_empty();
        let uvs = &self.uvs[usize::from(second)];
        let [a, b, c] =
            self.indices[triangle as usize].map(|vertex| uvs.get(vertex as usize).copied().unwrap_or_default());
        a * weights.x + b * weights.y + c * weights.z
    }

    fn color(&self, triangle: u32, weights: Vec3) -> Vec4 {
        let [a, b, c] = self.indices[triangle as usize]
            .map(|vertex| self.colors.get(vertex as usize).copied().unwrap_or(Vec4::ONE));
        a * weights.x + b * weights.y + c * weights.z
    }
}

/// A material, as rays need it.
pub struct RayMaterial {
    /// Linear RGBA.
    factor: Vec4,
    map: Option<RayMap>,
    /// It is met where its alpha is at least this; `None`: everywhere.
    pub cutoff: Option<f32>,
    /// It has a base map whose texels are gone.
    pub lacks_texels: bool,
}

struct RayMap {
    texture: Arc<Texture>,
    sampler: Sampler,
    uv_set: usize,
    image_from_mesh_uv: Affine2,
}

impl RayMaterial {
    /// Linear RGBA at a place of a mesh.
    pub fn color(&self, mesh: &RayMesh, triangle: u32, weights: Vec3) -> Vec4 {
        let plain = self.factor * mesh.color(triangle, weights);
        let Some(map) = &self.map else { return plain };
        let uv = map.image_from_mesh_uv.transform_point2(mesh.uv(map.uv_set, triangle, weights));
        plain * map.texture.sample(uv, &map.sampler)
    }

    /// Share of the light that it reflects there: the luminance of its colour, 0 to 1.
    pub fn albedo(&self, mesh: &RayMesh, triangle: u32, weights: Vec3) -> f32 {
        self.color(mesh, triangle, weights).xyz().dot(LUMINANCE).clamp(0.0, 1.0)
    }
}

/// The meshes and materials of a library that rays have met.
#[derive(Default)]
pub struct RayMeshes {
    /// With how often it had been replaced.
    meshes: BTreeMap<MeshId, (u32, Arc<RayMesh>)>,
    /// With the revision of its texels.
    textures: BTreeMap<ImageId, (u64, Arc<Texture>)>,
    /// By slot, as of the revisions.
    materials: BTreeMap<u32, Arc<RayMaterial>>,
    seen: Revisions,
}

impl RayMeshes {
    /// Forgets what has changed, and makes the trees of those meshes that are new. Says whether materials may have
    /// changed.
    pub fn update(&mut self, library: &Library, needed: &BTreeSet<MeshId>) -> bool {
        let revisions = library.revisions();
        self.meshes.retain(|&id, (edits, _)| library.mesh_edits(id) == Some(*edits));
        let other_materials = (revisions.materials, revisions.images) != (self.seen.materials, self.seen.images);
        if other_materials {
            self.materials.clear();
            self.textures.retain(|&id, (revision, _)| library.image_revision(id) == Some(*revision));
        }
        self.seen = revisions;
        let missing: Vec<MeshId> = needed.iter().copied().filter(|id| !self.meshes.contains_key(id)).collect();
        let made = map_in_parallel(missing.into_iter(), |id| {
            let (entry, edits) = (library.mesh(id)?, library.mesh_edits(id)?);
            Some((id, (edits, Arc::new(RayMesh::new(&entry.mesh, entry.aabb)))))
        });
        self.meshes.extend(made.into_iter().flatten());
        other_materials
    }

    /// A mesh that was needed.
    pub fn mesh(&self, id: MeshId) -> Option<&Arc<RayMesh>> {
        self.meshes.get(&id).map(|(_, mesh)| mesh)
    }

    /// The material in a slot, or the default.
    pub fn material(&mut self, library: &Library, slot: u32) -> Arc<RayMaterial> {
        if let Some(known) = self.materials.get(&slot) {
            return known.clone();
        }
        let default = systems::assets::Material::default();
        let material = library.material_in_slot(slot).map_or(&default, |(_, material)| material);
        let texture = material.base_map.map(|map| self.texture(library, map.image));
        let lacks_texels = matches!(texture, Some(None));
        let map = material.base_map.zip(texture.flatten()).map(|(map, texture)| RayMap {
            texture,
            sampler: map.sampler,
            uv_set: map.uv_set.min(1) as usize,
            image_from_mesh_uv: map.image_from_mesh_uv,
        });
        let cutoff = match material.alpha {
            AlphaMode::Opaque => None,
            AlphaMode::Mask if lacks_texels => None,
            AlphaMode::Mask => Some(material.alpha_cutoff),
            AlphaMode::Blend => Some(0.5),
        };
        let made = Arc::new(RayMaterial { factor: material.base_factor, map, cutoff, lacks_texels });
        self.materials.insert(slot, made.clone());
        made
    }

    fn texture(&mut self, library: &Library, id: ImageId) -> Option<Arc<Texture>> {
        if let Some((_, known)) = self.textures.get(&id) {
            return Some(known.clone());
        }
        // As drawn: an image that is not there is white.
        let image = library.image(id).or_else(|| library.image(ImageId::WHITE_COLOR))?;
        let texture = Arc::new(Texture::new(image, MOST_TEXELS)?);
        self.textures.insert(id, (library.image_revision(id).unwrap_or_default(), texture.clone()));
        Some(texture)
    }
}
