//! Assets shared by many entities: meshes, materials and images.
//!
//! The [`Library`] holds them, each behind a small id ([`slots`]). A [`MeshId`] and a [`MaterialId`] are components:
//! what is drawn has both. A [`Mesh`] comes from a file or from [`shapes`], may be displaced ([`displace`]) or cut
//! ([`split`]), and gets [`tangents`] and [`levels`] of detail before its first frame. Meshes of a model may share a
//! [`proxy`]. A [`Material`] names its
//! [`Technique`] and its [`Map`]s, which are [`Image`]s with mip levels: `alpha` says what clear texels hold,
//! [`blocks`] packs texels and [`texture_memory`] keeps all of them within a bound. [`world_bounds`] are a mesh's, at
//! an object's place.
//!
//! Nothing here knows the GPU, nor which entities there are.

pub(crate) mod alpha;
pub mod blocks;
pub mod color;
pub mod color_text;
pub mod displace;
pub(crate) mod image;
pub mod levels;
pub(crate) mod library;
pub(crate) mod material;
pub(crate) mod mesh;
pub(crate) mod object_bounds;
pub mod proxy;
pub mod shapes;
pub mod slots;
pub mod split;
pub mod tangents;
pub(crate) mod technique;
pub mod texels;
pub mod texture_memory;

pub use image::{Image, ImageId, ImageKind, Texels, level_count, level_size};
pub use library::{Contents, Library, LibraryBytes, Revisions};
pub use material::{
    AlphaMode, Filter, MAP_COUNT, Map, MapSlot, Material, MaterialId, MipFilter, Sampler, Shading, Wrap,
    default_specular,
};
pub use mesh::{Level, Mesh, MeshEntry, MeshId, MeshVariants};
pub use object_bounds::{all_bounds, bounds_of, world_bounds, world_box};
pub use technique::Technique;
