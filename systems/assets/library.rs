//! What many entities share: meshes, materials and images on the CPU, each behind a small copyable id.
//!
//! An item is added once and its id never changes. Two of the ids are components: an entity with a [`MeshId`] is
//! drawn, with its [`MaterialId`] (the neutral [`MaterialId::DEFAULT`] where it has none). Nothing here knows the GPU;
//! the renderer uploads what it has not seen yet, in id order.

use super::image::{Image, ImageId, ImageKind};
use super::material::{Material, MaterialId};
use super::mesh::{Level, Mesh, MeshEntry, MeshId};
use super::split::{Grid, split};
use crate::space::bounds::Sphere;
use bevy_ecs::prelude::*;
use glam::Vec4;
use std::collections::HashMap;

/// All meshes, materials and images of a world.
#[derive(Resource, Debug)]
pub struct Library {
    meshes: Vec<MeshEntry>,
    materials: Vec<Material>,
    images: Vec<Image>,
    /// Materials edited since the materials system last looked.
    edited_materials: Vec<MaterialId>,
    /// Meshes that were cut, and their pieces.
    pieces: HashMap<(MeshId, Grid), Vec<MeshId>>,
    /// Whether images lose their texels when a renderer has them.
    drops_texels: bool,
}

impl Default for Library {
    fn default() -> Self {
        let one = |name: &str, kind, rgba: [u8; 4]| Image::rgba8(name, 1, 1, kind, rgba.to_vec());
        Self {
            meshes: Vec::new(),
            materials: vec![Material {
                name: "default".into(),
                base_factor: Vec4::new(0.5, 0.5, 0.5, 1.0),
                ..Material::default()
            }],
            images: vec![
                one("white colour", ImageKind::Color, [255; 4]),
                one("white data", ImageKind::Data, [255; 4]),
                // In half floats, because no byte is exactly 0.5.
                Image::rgba16("flat normal", 1, 1, ImageKind::Normal, &[Vec4::new(0.5, 0.5, 1.0, 1.0)]),
                one("black data", ImageKind::Data, [0; 4]),
                one("no offset", ImageKind::Data, [128, 128, 0, 255]),
            ],
            edited_materials: Vec::new(),
            pieces: HashMap::new(),
            drops_texels: false,
        }
    }
}

impl Library {
    /// Adds a mesh. Its tangents are computed in the next frame where it brings none.
    pub fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        let bounds = Sphere::around(&mesh.positions);
        self.meshes.push(MeshEntry {
            mesh,
            bounds,
            tangents_ready: false,
            levels: Vec::new(),
            level_indices: Vec::new(),
        });
        MeshId(self.meshes.len() as u32 - 1)
    }

    /// Adds a mesh that is drawn as it is at any distance: one that would take long to simplify.
    pub fn add_mesh_without_levels(&mut self, mesh: Mesh) -> MeshId {
        let whole = Level::whole(&mesh);
        let id = self.add_mesh(mesh);
        self.meshes[id.0 as usize].levels.push(whole);
        id
    }

    /// The pieces of a mesh in the cells of a grid, with the tangents that the whole mesh has; made when they are first
    /// asked for. None for an id of another library.
    pub fn pieces(&mut self, mesh: MeshId, grid: Grid) -> Vec<MeshId> {
        if let Some(pieces) = self.pieces.get(&(mesh, grid)) {
            return pieces.clone();
        }
        let Some(entry) = self.meshes.get_mut(mesh.0 as usize) else { return Vec::new() };
        if !entry.tangents_ready {
            entry.make_tangents();
        }
        if entry.levels.is_empty() {
            // The pieces have levels; what is not drawn itself needs none.
            entry.levels.push(Level::whole(&entry.mesh));
        }
        let pieces: Vec<MeshId> = split(&entry.mesh, grid).into_iter().map(|piece| self.add_mesh(piece)).collect();
        self.pieces.insert((mesh, grid), pieces.clone());
        pieces
    }

    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    /// Adds an image.
    pub fn add_image(&mut self, image: Image) -> ImageId {
        self.images.push(image);
        ImageId(self.images.len() as u32 - 1)
    }

    /// How many meshes, materials and images there are.
    pub fn sizes(&self) -> [usize; 3] {
        [self.meshes.len(), self.materials.len(), self.images.len()]
    }

    /// Takes back everything added since [`Library::sizes`] was `sizes`: for a loader that fails half-way, before
    /// anything has seen the new ids.
    pub fn truncate(&mut self, [meshes, materials, images]: [usize; 3]) {
        self.meshes.truncate(meshes);
        self.pieces.retain(|_, pieces| pieces.iter().all(|piece| (piece.0 as usize) < meshes));
        self.materials.truncate(materials);
        self.images.truncate(images);
    }

    /// The mesh of an id; `None` for an id of another library.
    pub fn mesh(&self, id: MeshId) -> Option<&MeshEntry> {
        self.meshes.get(id.0 as usize)
    }

    /// The material of an id.
    pub fn material(&self, id: MaterialId) -> Option<&Material> {
        self.materials.get(id.0 as usize)
    }

    /// The material, or the default where there is no such yet.
    pub(crate) fn known_material(&self, id: MaterialId) -> MaterialId {
        if self.material(id).is_some() { id } else { MaterialId::DEFAULT }
    }

    /// The image of an id.
    pub fn image(&self, id: ImageId) -> Option<&Image> {
        self.images.get(id.0 as usize)
    }

    /// Changes a material; what uses it is drawn anew from the next frame on. `false`: no such material.
    pub fn edit_material(&mut self, id: MaterialId, edit: impl FnOnce(&mut Material)) -> bool {
        let Some(material) = self.materials.get_mut(id.0 as usize) else { return false };
        edit(material);
        self.edited_materials.push(id);
        true
    }

    /// All meshes in id order.
    pub fn meshes(&self) -> &[MeshEntry] {
        &self.meshes
    }

    /// All materials in id order.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// All images in id order; the first five are the stand-ins for missing maps.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// All images in id order, to change them before the first frame that draws them.
    pub fn images_mut(&mut self) -> &mut [Image] {
        &mut self.images
    }

    /// Whether images keep their texels when a renderer has them; they do unless told otherwise. Where they do not,
    /// textures are held once instead of twice, and no second renderer can draw them.
    pub fn keep_texels(&mut self, keep: bool) {
        self.drops_texels = !keep;
    }

    /// For renderers, which have the texels of that image now: releases them, unless images
    /// [keep theirs](Self::keep_texels).
    pub fn release_texels(&mut self, id: ImageId) {
        if self.drops_texels
            && let Some(image) = self.images.get_mut(id.0 as usize)
        {
            image.levels = Vec::new();
        }
    }

    /// Whether an image's texels have been taken by a renderer.
    pub fn lacks_texels(&self) -> bool {
        self.images.iter().any(|image| image.levels.is_empty())
    }

    /// Gives images without texels those of the images that have the same ids in `same`, a library of the same files.
    ///
    /// # Errors
    /// The name of the first image that is another one there; then nothing is given back.
    pub fn restore_texels(&mut self, same: Self) -> Result<(), String> {
        let mut others: Vec<Option<Image>> = same.images.into_iter().map(Some).collect();
        let described = |image: &Image| (image.name.clone(), image.width, image.height, image.kind, image.texels);
        let lacking = || self.images.iter().enumerate().filter(|(_, image)| image.levels.is_empty());
        for (id, image) in lacking() {
            let other = others.get(id).and_then(Option::as_ref);
            if other.is_none_or(|other| described(other) != described(image)) {
                return Err(image.name.clone());
            }
        }
        for (image, other) in self.images.iter_mut().zip(&mut others).filter(|(image, _)| image.levels.is_empty()) {
            image.levels = other.take().map(|other| other.levels).unwrap_or_default();
        }
        Ok(())
    }

    /// The meshes whose tangents or levels are still to be made, to do so before the first frame does.
    pub fn unfinished_meshes(&mut self) -> impl Iterator<Item = &mut MeshEntry> {
        self.meshes.iter_mut().filter(|entry| !entry.is_finished())
    }

    pub(crate) fn meshes_mut(&mut self) -> &mut [MeshEntry] {
        &mut self.meshes
    }

    pub(crate) fn has_edited_materials(&self) -> bool {
        !self.edited_materials.is_empty()
    }

    pub(crate) fn take_edited_materials(&mut self) -> Vec<MaterialId> {
        std::mem::take(&mut self.edited_materials)
    }
}
