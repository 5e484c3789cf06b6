//! Assets shared by many entities: meshes, materials and images on the CPU, each behind a small copyable id.
//!
//! Items are added, replaced and removed at any time; an id names one item as long as it is there, and nothing
//! afterwards ([`slots`](super::slots)). Two of the ids are components: an entity with a [`MeshId`] is drawn, with its
//! [`MaterialId`] (the neutral [`MaterialId::DEFAULT`] where it has none). Whatever still uses an item can lose it: an
//! object without its mesh is not drawn, one without its material has the default, a material without an image has the
//! stand-in for it.
//!
//! Nothing here knows the GPU. Systems and renderers compare [`Library::revisions`] with those that they have seen
//! last, and look at what changed since.

use super::image::{Image, ImageId, ImageKind};
use super::material::{Material, MaterialId};
use super::mesh::{Level, Mesh, MeshEntry, MeshId};
use super::slots::Slots;
use super::split::{Grid, split};
use crate::space::bounds::Sphere;
use bevy_ecs::prelude::*;
use glam::Vec4;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// All meshes, materials and images of a world. A world keeps its library: another one put in the place of the resource
/// would go unnoticed.
///
/// A clone has the same ids for the same items and shares them: what either changes is copied first. So worlds of one
/// scene hold its meshes and images once.
#[derive(Resource, Clone, Debug)]
pub struct Library {
    meshes: Slots<MeshId, MeshEntry>,
    materials: Slots<MaterialId, Material>,
    images: Slots<ImageId, Image>,
    /// Meshes that were cut, and their pieces.
    pieces: HashMap<(MeshId, Grid), Vec<MeshId>>,
    /// Set if images lose their texels once a renderer has them.
    drops_texels: bool,
    contents: Contents,
}

/// Identity of a library's meshes and images. It is equal for a library and its clones until one of them changes, and
/// differs from all others. Materials do not count: each world has records of its own of them.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Contents(u64);

impl Contents {
    /// Unlike all before.
    fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Change counters of meshes, materials and images: additions, edits and removals.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Revisions {
    /// Changes of meshes.
    pub meshes: u64,
    /// Changes of materials.
    pub materials: u64,
    /// Changes of images.
    pub images: u64,
}

/// CPU memory of a library, bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LibraryBytes {
    /// Vertices and indices.
    pub meshes: u64,
    /// Texels that are kept.
    pub images: u64,
}

/// Images that stand in for missing maps: the first ones.
const STAND_INS: u32 = 5;

impl Default for Library {
    fn default() -> Self {
        let mut library = Self {
            meshes: Slots::default(),
            materials: Slots::default(),
            images: Slots::default(),
            pieces: HashMap::new(),
            drops_texels: false,
            contents: Contents::new(),
        };
        library.add_material(Material {
            name: "default".into(),
            base_factor: Vec4::new(0.5, 0.5, 0.5, 1.0),
            ..Material::default()
        });
        let one = |name: &str, kind, rgba: [u8; 4]| Image::rgba8(name, 1, 1, kind, rgba.to_vec());
        let stand_ins: [Image; STAND_INS as usize] = [
            one("white colour", ImageKind::Color, [255; 4]),
            one("white data", ImageKind::Data, [255; 4]),
            // In half floats, because no byte is exactly 0.5.
            Image::rgba16("flat normal", 1, 1, ImageKind::Normal, &[Vec4::new(0.5, 0.5, 1.0, 1.0)]),
            one("black data", ImageKind::Data, [0; 4]),
            one("no offset", ImageKind::Data, [128, 128, 0, 255]),
        ];
        stand_ins.into_iter().for_each(|image| _ = library.add_image(image));
        library
    }
}

impl Library {
    /// Adds a mesh. Its tangents are computed in the next frame where it brings none.
    pub fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        self.contents = Contents::new();
        self.meshes.add(MeshEntry::new(mesh, false))
    }

    /// Adds a mesh that is drawn as it is at any distance: one that would take long to simplify.
    pub fn add_mesh_without_levels(&mut self, mesh: Mesh) -> MeshId {
        self.contents = Contents::new();
        self.meshes.add(MeshEntry::new(mesh, true))
    }

    /// Adds a mesh of which only levels of detail are drawn: a surface of a [`proxy`](crate::assets::proxy).
    pub fn add_entry(&mut self, entry: MeshEntry) -> MeshId {
        self.contents = Contents::new();
        self.meshes.add(entry)
    }

    /// Ends the levels of a mesh where a [`proxy`](crate::assets::proxy) is drawn in its place: where an error of so
    /// many metres in object space is allowed, by the distance to that sphere. Before its levels are made.
    pub fn end_levels(&mut self, id: MeshId, level_bounds: Sphere, error: f32) {
        self.contents = Contents::new();
        if let Some(entry) = self.meshes.get_mut(id) {
            (entry.level_bounds, entry.ends_at) = (level_bounds, Some(error));
            entry.levels.clear();
        }
    }

    /// Puts another mesh in the place of one. What uses it is drawn with the new one from the next frame on, has its
    /// bounds, and stands on it; objects in pieces are cut anew. `false`: no such mesh.
    pub fn replace_mesh(&mut self, id: MeshId, mesh: Mesh) -> bool {
        self.contents = Contents::new();
        let Some(entry) = self.meshes.edit(id) else { return false };
        *entry = MeshEntry::new(mesh, entry.without_levels);
        self.remove_pieces(id);
        true
    }

    /// Removes a mesh and the pieces that it was cut into. What uses it is not drawn any more.
    pub fn remove_mesh(&mut self, id: MeshId) -> Option<MeshEntry> {
        self.contents = Contents::new();
        let removed = self.meshes.remove(id)?;
        self.remove_pieces(id);
        Some(removed)
    }

    fn remove_pieces(&mut self, whole: MeshId) {
        let Self { meshes, pieces, .. } = self;
        pieces.retain(|(mesh, _), pieces| {
            let is_kept = *mesh != whole;
            if !is_kept {
                pieces.iter().for_each(|&piece| _ = meshes.remove(piece));
            }
            is_kept
        });
    }

    /// The pieces of a mesh in the cells of a grid, with the tangents that the whole mesh has; made when they are first
    /// asked for. None for a mesh that is not there. They are removed with the mesh, or when it is replaced.
    pub fn pieces(&mut self, mesh: MeshId, grid: Grid) -> Vec<MeshId> {
        let is_there = |piece: &MeshId| self.meshes.get(*piece).is_some();
        if let Some(pieces) = self.pieces.get(&(mesh, grid)).filter(|pieces| pieces.iter().all(is_there)) {
            return pieces.clone();
        }
        if let Some(incomplete) = self.pieces.remove(&(mesh, grid)) {
            incomplete.into_iter().for_each(|piece| _ = self.meshes.remove(piece));
        }
        let is_unfinished = |entry: &MeshEntry| !entry.tangents_ready || entry.levels.is_empty();
        if self.meshes.get(mesh).is_some_and(is_unfinished)
            && let Some(entry) = self.meshes.get_mut(mesh)
        {
            if !entry.tangents_ready {
                entry.make_tangents();
            }
            if entry.levels.is_empty() {
                // The pieces have levels; what is not drawn itself needs none.
                entry.levels.push(Level::whole(&entry.mesh));
            }
        }
        let Some(entry) = self.meshes.get(mesh) else { return Vec::new() };
        let pieces: Vec<MeshId> = split(&entry.mesh, grid).into_iter().map(|piece| self.add_mesh(piece)).collect();
        self.pieces.insert((mesh, grid), pieces.clone());
        pieces
    }

    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.add(material)
    }

    /// Changes a material; what uses it is drawn anew from the next frame on. `false`: no such material.
    pub fn edit_material(&mut self, id: MaterialId, edit: impl FnOnce(&mut Material)) -> bool {
        self.materials.edit(id).map(edit).is_some()
    }

    /// Removes a material; what uses it has the default. The default itself stays: `None`, as for an id of none.
    pub fn remove_material(&mut self, id: MaterialId) -> Option<Material> {
        if id == MaterialId::DEFAULT { None } else { self.materials.remove(id) }
    }

    /// Adds an image.
    pub fn add_image(&mut self, image: Image) -> ImageId {
        self.contents = Contents::new();
        self.images.add(image)
    }

    /// Puts another image in the place of one, of any size and kind. `false`: no such image, or one that stands in for
    /// missing maps.
    pub fn replace_image(&mut self, id: ImageId, image: Image) -> bool {
        self.contents = Contents::new();
        !is_stand_in(id) && self.images.edit(id).map(|replaced| *replaced = image).is_some()
    }

    /// Removes an image; materials that use it have the stand-in for a missing map. Stand-ins themselves stay: `None`,
    /// as for an id of none.
    pub fn remove_image(&mut self, id: ImageId) -> Option<Image> {
        self.contents = Contents::new();
        if is_stand_in(id) { None } else { self.images.remove(id) }
    }

    /// Numbers of meshes, materials and images.
    pub fn sizes(&self) -> [usize; 3] {
        [self.meshes.len(), self.materials.len(), self.images.len()]
    }

    /// CPU memory of its meshes and images.
    pub fn bytes(&self) -> LibraryBytes {
        let texels = |image: &Image| image.levels.iter().map(|level| level.len() as u64).sum::<u64>();
        LibraryBytes {
            meshes: self.meshes.iter().map(|(_, entry)| entry.bytes()).sum(),
            images: self.images.iter().map(|(_, image)| texels(image)).sum(),
        }
    }

    /// Tells libraries apart by their meshes and images: worlds of equal ones can share what is made of these.
    pub fn contents(&self) -> Contents {
        self.contents
    }

    /// Tells whether anything changed: what has seen these has seen everything.
    pub fn revisions(&self) -> Revisions {
        Revisions {
            meshes: self.meshes.revision(),
            materials: self.materials.revision(),
            images: self.images.revision(),
        }
    }

    /// Takes back everything added since [`Library::revisions`] were `since`, as if it had never been there: for a
    /// loader that fails half-way, before anything has seen the new ids.
    pub fn take_back(&mut self, since: Revisions) {
        self.contents = Contents::new();
        self.meshes.take_back(since.meshes);
        self.materials.take_back(since.materials);
        self.images.take_back(since.images);
        let Self { meshes, pieces, .. } = self;
        let is_there = |mesh: &MeshId| meshes.get(*mesh).is_some();
        pieces.retain(|(whole, _), pieces| is_there(whole) && pieces.iter().all(is_there));
    }

    /// The mesh of an id; `None` for one that is not there.
    pub fn mesh(&self, id: MeshId) -> Option<&MeshEntry> {
        self.meshes.get(id)
    }

    /// The material of an id.
    pub fn material(&self, id: MaterialId) -> Option<&Material> {
        self.materials.get(id)
    }

    /// The material, or the default where there is no such.
    pub(crate) fn known_material(&self, id: MaterialId) -> MaterialId {
        if self.material(id).is_some() { id } else { MaterialId::DEFAULT }
    }

    /// The image of an id.
    pub fn image(&self, id: ImageId) -> Option<&Image> {
        self.images.get(id)
    }

    /// All meshes in the order of their slots.
    pub fn meshes(&self) -> impl Iterator<Item = (MeshId, &MeshEntry)> + Clone {
        self.meshes.iter()
    }

    /// All materials in the order of their slots.
    pub fn materials(&self) -> impl Iterator<Item = (MaterialId, &Material)> + Clone {
        self.materials.iter()
    }

    /// All images in the order of their slots; the first five are the stand-ins for missing maps.
    pub fn images(&self) -> impl Iterator<Item = (ImageId, &Image)> + Clone {
        self.images.iter()
    }

    /// All images that have their texels in the order of their slots, to be changed: each counts as replaced.
    pub fn images_mut(&mut self) -> impl Iterator<Item = (ImageId, &mut Image)> {
        self.contents = Contents::new();
        let with_texels = self.images.iter().filter(|(_, image)| !image.levels.is_empty());
        for id in with_texels.map(|(id, _)| id).collect::<Vec<_>>() {
            self.images.edit(id);
        }
        self.images.iter_mut(|image| !image.levels.is_empty())
    }

    /// The mesh in a slot ([`MeshId::slot`]) now, with its id.
    pub fn mesh_in_slot(&self, slot: u32) -> Option<(MeshId, &MeshEntry)> {
        self.meshes.in_slot(slot)
    }

    /// The material in a slot ([`MaterialId::slot`]) now, with its id.
    pub fn material_in_slot(&self, slot: u32) -> Option<(MaterialId, &Material)> {
        self.materials.in_slot(slot)
    }

    /// Slots whose mesh was added, replaced or removed since [`Revisions::meshes`] was `revision`; each once.
    pub fn changed_meshes(&self, revision: u64) -> impl Iterator<Item = u32> {
        self.meshes.changed_since(revision)
    }

    /// Slots whose material was added, edited or removed since [`Revisions::materials`] was `revision`; each once.
    pub fn changed_materials(&self, revision: u64) -> impl Iterator<Item = u32> {
        self.materials.changed_since(revision)
    }

    /// Slots whose image was added, replaced or removed since [`Revisions::images`] was `revision`; each once.
    pub fn changed_images(&self, revision: u64) -> impl Iterator<Item = u32> {
        self.images.changed_since(revision)
    }

    /// [`Revisions::images`] when an image was added or last replaced: tells its texels from those that it had before.
    pub fn image_revision(&self, id: ImageId) -> Option<u64> {
        self.images.revision_of(id)
    }

    /// [`Revisions::meshes`] when a mesh was last replaced or removed: what has seen it knows of none but new ones.
    pub(crate) fn meshes_edited(&self) -> u64 {
        self.meshes.edited()
    }

    /// Times that a mesh was replaced; `None` where there is none.
    pub fn mesh_edits(&self, id: MeshId) -> Option<u32> {
        self.meshes.edits_of(id)
    }

    /// Makes images keep or drop their texels once a renderer has them; they are kept unless told otherwise. Dropped,
    /// textures are held once instead of twice, and no second renderer can draw them.
    pub fn keep_texels(&mut self, keep: bool) {
        self.drops_texels = !keep;
    }

    /// For renderers, which have the texels of that image now: releases them, unless images
    /// [keep theirs](Self::keep_texels).
    pub fn release_texels(&mut self, id: ImageId) {
        if self.drops_texels
            && let Some(image) = self.images.get_mut(id)
        {
            image.levels = Vec::new();
        }
    }

    /// Tells if an image's texels have been taken by a renderer.
    pub fn lacks_texels(&self) -> bool {
        self.images.iter().any(|(_, image)| image.levels.is_empty())
    }

    /// Gives images without texels those of the images that have the same ids in `same`, a library of the same files.
    ///
    /// # Errors
    /// The name of the first image that is another one there; then nothing is given back.
    pub fn restore_texels(&mut self, mut same: Self) -> Result<(), String> {
        let described = |image: &Image| (image.name.clone(), image.width, image.height, image.kind, image.texels);
        for (id, image) in self.images.iter().filter(|(_, image)| image.levels.is_empty()) {
            if same.image(id).is_none_or(|other| described(other) != described(image)) {
                return Err(image.name.clone());
            }
        }
        for (id, image) in self.images.iter_mut(|image| image.levels.is_empty()) {
            image.levels = same.images.get_mut(id).map(|other| std::mem::take(&mut other.levels)).unwrap_or_default();
        }
        Ok(())
    }

    /// The meshes whose tangents or levels are still to be made, to do so before the first frame does.
    pub fn unfinished_meshes(&mut self) -> impl Iterator<Item = &mut MeshEntry> {
        self.meshes_mut(|entry| !entry.is_finished())
    }

    /// The meshes for which something holds.
    pub(crate) fn meshes_mut(&mut self, holds: impl Fn(&MeshEntry) -> bool) -> impl Iterator<Item = &mut MeshEntry> {
        self.meshes.iter_mut(holds).map(|(_, entry)| entry)
    }
}

fn is_stand_in(id: ImageId) -> bool {
    id.slot() < STAND_INS
}
