//! The structs that shaders read, but for those of lights. `shaders/types.wgsl` mirrors each of them;
//! `tests/scenes/shaders.rs` compares every offset of the two.

use crate::assets::material::MAP_COUNT;
use bytemuck::{Pod, Zeroable};

/// One drawn object; all zero in a slot that is not in use, which no pass draws. Mirrors `PackedInstance`; how its
/// lights are packed is said in `lights/selected.rs`.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct InstanceRecord {
    /// Rows of the 3×4 matrix from object to world space.
    pub world_from_object: [[f32; 4]; 3],
    /// Slots in the light table, [`NO_LIGHT`](crate::lights::NO_LIGHT) where fewer than three lights reach the object,
    /// and the weights 0..1.
    pub lights: [u32; 3],
    /// Slot in the material table.
    pub material: u32,
    /// Irradiance of what the three lights leave out, linear RGB; the same, times its luminance-weighted direction
    /// (world space); the same, times how much of it comes along each axis, from either side, but for the last.
    pub residual: [u32; 4],
    /// Share of the residual along z, and `dropped` of [`Selection`](crate::lights::Selection).
    pub last_side_and_dropped: u32,
    /// Unit of the numbers of the ambient cube.
    pub residual_unit: f32,
    /// Number of lights that reach the object; with the highest bit set, the first page of its list
    /// ([`LightLists`](crate::lights::LightLists)).
    pub reaching_or_list: u32,
    /// The entity's index, of a piece its object's: picking and segmentation.
    pub entity: u32,
}

/// Sky of a frame, in the world's units of light. Mirrors `Sky`.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct SkyRecord {
    /// Diffuse light of both halves by the normal, linear RGB: coefficients of 1, y, z, x, xy, yz, 3z² − 1, xz, x² − y².
    pub harmonics: [[f32; 4]; 9],
    /// Radiance of the ground, linear RGB.
    pub ground: [f32; 3],
    /// Radiance of 1 in the map.
    pub unit: f32,
    /// Unit vector toward the sun, and the radius of its disc, radians.
    pub sun: [f32; 4],
    /// Radiance of the sun's disc, linear RGB; the fourth is 0.
    pub sun_radiance: [f32; 4],
    /// Unit vector toward the moon, and the radius of its disc, radians.
    pub moon: [f32; 4],
    /// Radiance of the moon's disc, linear RGB; the fourth is 0.
    pub moon_radiance: [f32; 4],
    /// Diffuse light from above, linear RGB: of the sky alone.
    pub up: [f32; 3],
    /// Not used.
    pub pad0: u32,
    /// World space of the first brick of openness, metres.
    pub openness_origin: [f32; 3],
    /// Texel of the first cell of the movers' grid.
    pub movers_first: u32,
    /// Bricks of openness along each axis of their textures.
    pub openness_bricks: [u32; 3],
    /// Metres along a side of a cell of the movers' grid.
    pub movers_cell: f32,
    /// World space, X and Z of the first cell's corner, metres.
    pub movers_origin: [f32; 2],
    /// Cells along X and Z.
    pub movers_cells: [u32; 2],
}

/// One material. Mirrors `Material`; the fields are [`crate::assets::Material`]'s. What every pixel reads comes first.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct MaterialRecord {
    /// Linear RGBA.
    pub base_factor: [f32; 4],
    /// Linear RGB.
    pub specular_factor: [f32; 3],
    /// Phong and Blinn exponent.
    pub shininess: f32,
    /// Layer of each map in its class's texture array, by [`MapSlot`](crate::assets::MapSlot); the last is unused.
    pub layers: [u8; MAP_COUNT + 1],
    /// Times the normal map's xy.
    pub normal_scale: f32,
    /// Linear RGB.
    pub emissive_factor: [f32; 3],
    /// 0..1.
    pub alpha_cutoff: f32,
    /// 0..1.
    pub metallic: f32,
    /// 0..1.
    pub roughness: f32,
    /// 0..1.
    pub occlusion_strength: f32,
    /// 0..1.
    pub specular_strength: f32,
    /// 0..1.
    pub glossiness: f32,
    /// UV units.
    pub height_scale_uv: f32,
    /// 0..1.
    pub height_rest: f32,
    /// Bit m: map m is placed by the second UV set.
    pub second_uvs: u32,
    /// Texels.
    pub emboss_step_texels: f32,
    /// 0..1.
    pub self_shadow: f32,
    /// Room for 16-byte alignment.
    pub pad0: u32,
    /// Room for 16-byte alignment.
    pub pad1: u32,
    /// Rows of the 2×2 matrix from the offset map to the environment's disc.
    pub offset_matrix: [f32; 4],
    /// Columns of the 2×2 matrix from mesh UV to image UV, by `MapSlot`.
    pub image_from_mesh_uv: [[f32; 4]; MAP_COUNT],
    /// Its translation, by `MapSlot`; the last is unused.
    pub offsets: [[f32; 2]; MAP_COUNT + 1],
}

/// Constants of a view, the same for every pixel. Mirrors `View`.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct ViewRecord {
    /// Column-major; reversed depth: 1 at the near plane, 0 at the far plane or infinity.
    pub clip_from_world: [[f32; 4]; 4],
    /// The same for positions from the eye, along the world's axes: nothing is lost in rounding far from the origin.
    pub clip_from_eye: [[f32; 4]; 4],
    /// Its inverse, for the sky's directions.
    pub eye_from_clip: [[f32; 4]; 4],
    /// Position of the eye, world space.
    pub eye: [f32; 3],
    /// 1 where the projection is parallel, else 0.
    pub parallel: u32,
    /// Unit vector from the scene towards the eye where the projection is parallel.
    pub toward_eye: [f32; 3],
    /// Times every pixel.
    pub exposure: f32,
    /// Linear RGB.
    pub ambient: [f32; 3],
    /// Entity under the pointer, for debug views; `u32::MAX` for none.
    pub picked_entity: u32,
    /// Linear RGB.
    pub zenith: [f32; 3],
    /// The texel of the tables that has the record of the view's first shadow layer.
    pub shadow_records: u32,
    /// Linear RGB.
    pub horizon: [f32; 3],
    /// Metres per metre from the eye that a level of detail may be off, in parallel views metres; 0 where meshes are
    /// drawn whole.
    pub level_error: f32,
    /// Linear RGB.
    pub ground: [f32; 3],
    /// Texels along a side of the shadow layers that the view reads.
    pub shadow_side: f32,
}
