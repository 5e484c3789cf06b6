//! Several worlds with one renderer: what is uploaded of a world rests while another one is drawn.
//!
//! A renderer is of one world, and throws away what it has of it when it gets another's frame, unless it
//! [keeps worlds](crate::renderer::Renderer::keep_worlds). Then the tables of each stay on the device, and meshes and
//! textures are shared by worlds whose libraries have the same [contents](systems::assets::Library::contents).

use crate::renderer::culling::indirect_draws::IndirectDraws;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::resources::frame_tables::FrameTables;
use crate::renderer::resources::meshes::Meshes;
use crate::renderer::resources::stats::Uploads;
use crate::renderer::resources::textures::Textures;
use crate::renderer::shadows::shadow_maps::ShadowMaps;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use systems::assets::Contents;
use systems::draw::{BatchKey, DrawList, FrameData, MaterialClass, TextureArray};

/// Device data of a world, except its meshes and textures.
#[derive(Debug)]
pub(crate) struct WorldUploads {
    /// Tells what is uploaded from what was, or what another renderer has: views that knew that begin anew.
    pub epoch: u64,
    pub tables: FrameTables,
    pub shadow_maps: ShadowMaps,
    /// With whole meshes only, and with levels of detail.
    pub draws: [IndirectDraws; 2],
    pub uploads: Uploads,
    /// Versions of meshes and textures when a frame was prepared last.
    pub asset_versions: (u64, u64),
    /// Version of the list of blended objects, in view or not, and their batch keys.
    pub blended_keys: (Option<u64>, Vec<BatchKey>),
    /// Number of its own assets among the resting ones.
    assets: u64,
}

impl WorldUploads {
    pub fn new(gpu: &Gpu) -> Self {
        static EPOCHS: AtomicU64 = AtomicU64::new(1);
        let device = &gpu.device;
        Self {
            epoch: EPOCHS.fetch_add(1, Ordering::Relaxed),
            tables: FrameTables::new(device),
            shadow_maps: ShadowMaps::default(),
            draws: [IndirectDraws::new(device), IndirectDraws::new(device)],
            uploads: Uploads::default(),
            asset_versions: (0, 0),
            blended_keys: (None, Vec::new()),
            assets: 0,
        }
    }
}

/// Meshes and textures on the device.
#[derive(Debug)]
pub(crate) struct Assets {
    pub meshes: Meshes,
    pub textures: Textures,
    /// Origin: a library's contents, and the layout of a world's materials in texture arrays and classes.
    of: Option<(Contents, Vec<TextureArray>, Vec<MaterialClass>)>,
    /// The world that uploaded last. What another one of the same contents knew of their versions no longer holds after
    /// this one has changed its library.
    noted_by: u64,
}

impl Assets {
    pub fn new(gpu: &Gpu, textures: Textures) -> Self {
        Self { meshes: Meshes::new(&gpu.device), textures, of: None, noted_by: 0 }
    }

    /// Tells if they match a frame's library and layout.
    fn are_of(&self, frame: &FrameData<'_>) -> bool {
        let DrawList { texture_arrays, classes, .. } = frame.list;
        self.of.as_ref().is_some_and(|(contents, arrays, known)| {
            *contents == frame.library.contents() && arrays == texture_arrays && known == classes
        })
    }

    /// Before a frame's upload, which may fail half-way: what is changed is nobody's until it is [noted](Self::note).
    pub fn begin(&mut self, frame: &FrameData<'_>) {
        if !self.are_of(frame) {
            self.of = None;
        }
    }

    /// Notes that they are those of a frame, after its upload.
    pub fn note(&mut self, frame: &FrameData<'_>) {
        self.noted_by = frame.list.world;
        if !self.are_of(frame) {
            let DrawList { texture_arrays, classes, .. } = frame.list;
            self.of = Some((frame.library.contents(), texture_arrays.clone(), classes.clone()));
        }
    }
}

/// Device data of worlds that are not drawn now.
#[derive(Debug, Default)]
pub(crate) struct RestingWorlds {
    worlds: HashMap<u64, WorldUploads>,
    assets: HashMap<u64, Assets>,
    /// The number of the assets that are drawn with now.
    current: u64,
    next: u64,
}

impl RestingWorlds {
    /// Puts a world and its assets to rest, and wakes those of a frame, as far as there are any.
    pub fn exchange(
        &mut self,
        gpu: &Gpu,
        world: u64,
        frame: &FrameData<'_>,
        uploads: &mut WorldUploads,
        assets: &mut Assets,
    ) {
        let mut woken = self.worlds.remove(&frame.list.world);
        uploads.assets = self.current;
        let is_shared = |number: u64| {
            uploads.assets == number && world != 0 || self.worlds.values().any(|other| other.assets == number)
        };
        // Its own, if they are still as it left them: of its contents, or nobody else's, and not changed by another.
        let is_as_left = |number: u64, assets: &Assets| {
            assets.are_of(frame) || !is_shared(number) && assets.noted_by == frame.list.world
        };
        let current = (self.current, &*assets);
        let all = || self.assets.iter().map(|(number, assets)| (*number, assets)).chain([current]);
        let own = woken.as_ref().map(|own| own.assets);
        let own = own.filter(|own| all().any(|(number, assets)| number == *own && is_as_left(number, assets)));
        let others = all().filter(|(_, assets)| assets.are_of(frame)).map(|(number, _)| number).min();
        if own.is_none() {
            // Versions of other assets mean other things.
            woken = None;
        }
        let number = own.or(others).unwrap_or_else(|| {
            self.next += 1;
            self.next
        });
        if number != self.current {
            let layout = assets.textures.layout.clone();
            let fresh = || Assets::new(gpu, Textures::with_layout(layout));
            let next = self.assets.remove(&number).unwrap_or_else(fresh);
            self.assets.insert(self.current, std::mem::replace(assets, next));
        }
        self.current = number;
        let woken = WorldUploads { assets: number, ..woken.unwrap_or_else(|| WorldUploads::new(gpu)) };
        let slept = std::mem::replace(uploads, woken);
        if world != 0 {
            self.worlds.insert(world, slept);
        }
        let Self { worlds, assets, .. } = self;
        assets.retain(|number, _| worlds.values().any(|world| world.assets == *number));
    }

    /// Gives up a world that rests.
    pub fn forget(&mut self, world: u64) {
        self.worlds.remove(&world);
        let Self { worlds, assets, .. } = self;
        assets.retain(|number, _| worlds.values().any(|world| world.assets == *number));
    }
}
