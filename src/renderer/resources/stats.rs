//! Counts of what is uploaded, drawn and held.

/// Counts of the last prepare and encode, of all views together.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RenderStats {
    /// Draws of objects: batches at each level of detail in each phase, and runs of blended objects.
    pub draws: u32,
    /// Calls that they took.
    pub draw_calls: u32,
    /// Bytes of instance records uploaded.
    pub instance_bytes: u64,
    /// Bytes of light records uploaded.
    pub light_bytes: u64,
    /// Bytes of material records uploaded.
    pub material_bytes: u64,
    /// Bytes of the lists of pages, draws and blended objects uploaded.
    pub list_bytes: u64,
    /// Bytes of meshes and textures uploaded.
    pub asset_bytes: u64,
    /// Shadow maps; of what is drawn, since the last encode.
    pub shadows: ShadowStats,
}

impl RenderStats {
    /// All bytes uploaded.
    pub fn uploaded_bytes(&self) -> u64 {
        self.scene_bytes() + self.list_bytes
    }

    /// Bytes uploaded that all views share.
    pub(crate) fn scene_bytes(&self) -> u64 {
        self.surface_bytes() + self.light_bytes
    }

    /// Bytes uploaded of objects, materials, meshes and textures.
    pub(crate) fn surface_bytes(&self) -> u64 {
        self.instance_bytes + self.material_bytes + self.asset_bytes
    }
}

/// Counts of shadow maps that the last prepare found and the last encode drew.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ShadowStats {
    /// Lights that have layers.
    pub lights: u32,
    /// These layers: point lights and spots one each, directional ones one for each level.
    pub layers: u32,
    /// Layers drawn.
    pub passes: u32,
    /// Faces drawn.
    pub faces: u32,
    /// Objects drawn into them.
    pub casters: u32,
    /// Layers that began with what is still.
    pub bases: u32,
}

/// Bytes that meshes, textures and shadow maps take on a device, with room that is kept for others.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct HeldBytes {
    /// Vertices and indices.
    pub meshes: u64,
    /// Images of materials, with all their levels.
    pub textures: u64,
    /// Layers of shadow maps.
    pub shadow_maps: u64,
}

/// Counts of uploads since a renderer began, which only grow.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Uploads {
    /// Frames that uploaded anything that a picture may differ by.
    pub any: u64,
    /// Frames that uploaded objects, materials, meshes or textures: a material that lets more through hides less.
    pub surfaces: u64,
}
