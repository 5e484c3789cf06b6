//! Places of entities, and their consequences.
//!
//! An entity has a [`Transform`] among its siblings; `propagation` derives its [`GlobalTransform`], parents before
//! children, from what moved. Between two steps `interpolation` draws it somewhere on the way, and [`spin`] moves what
//! moves by itself. What is [`Hidden`] hides all that is below it. [`Aabb`] and [`Sphere`] are the volumes that bounds
//! are made of, and [`origin`] is where the world's coordinates count from; a
//! [`GeoOrigin`] is where on Earth that is ([`wgs84`]). [`GRAVITY`] is the same everywhere. Rays
//! find what they meet in a tree of boxes ([`box_tree`]), or of triangles ([`triangle_tree`]).

pub(crate) mod bounds;
pub mod box_tree;
pub(crate) mod geo_origin;
pub(crate) mod gravity;
pub(crate) mod hidden;
pub(crate) mod interpolation;
pub(crate) mod motion;
pub mod origin;
pub(crate) mod propagation;
pub(crate) mod transform;
pub mod triangle_tree;
pub mod wgs84;

pub use bounds::{Aabb, Sphere};
pub use geo_origin::GeoOrigin;
pub use gravity::GRAVITY;
pub use hidden::{Hidden, InheritedHidden, inherit_hidden};
pub use interpolation::{Interpolated, Interpolation, Moved, remember};
pub use motion::{Spin, spin};
pub use propagation::{NewParents, note_parent, update_transforms};
pub use transform::{FARTHEST, GlobalTransform, LARGEST, Transform};
