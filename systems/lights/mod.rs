//! Lights, and the choice of those that shade each object: three, or as many as it takes.
//!
//! A [`Light`] has a slot in the [`LightTable`], as a [`PackedLight`], which shaders read, and as a [`ScoredLight`],
//! which the choice reads. The [`LightTree`] sorts these in space. How much a light matters to an object is its
//! [`score`] (`relevance`). [`brute_force`] compares every object with every light and so defines the result;
//! [`search`] finds the same, bit for bit, from the tree and the [`ObjectOrder`], which has the objects along a curve.
//! The number that an object has depends on its [`LightPolicy`] (`policy`, `enough`). [`select_lights`] searches for
//! those objects only that moved or that a changed light reaches. It keeps the result as their [`SelectedLights`];
//! lights beside the first three are in [`LightLists`]. Which lights have a shadow map in a picture is for [`rank`] to
//! say (`importance`).
//!
//! In a world with [`Cells`](crate::cells::Cells) an object gets a share of each light, by what of it comes through
//! portals. [`LightFloods`] has what each light reaches; `indoors` chooses the lights of objects that walls are
//! between.

pub mod brute_force;
pub(crate) mod components;
pub(crate) mod curve;
pub(crate) mod description;
pub(crate) mod enough;
pub(crate) mod floods;
pub(crate) mod importance;
pub(crate) mod indoors;
pub(crate) mod lists;
pub(crate) mod order;
pub(crate) mod order_sorting;
pub(crate) mod policy;
pub(crate) mod record;
pub(crate) mod relevance;
pub mod search;
pub(crate) mod selected;
pub(crate) mod selection;
pub(crate) mod table;
pub(crate) mod tree;

pub use components::{Light, LightKind, NoShadow};
pub use curve::along_the_curve;
pub use description::{Attenuation, LightDescription, LightFields};
pub use floods::{LightFloods, update_floods};
pub use importance::{DARK, Ranked, ShadowLight, ShadowLights, ShadowView, fade, rank, rank_suns};
pub use lists::{LightListPage, LightLists, ListedLights};
pub use order::ObjectOrder;
pub use policy::{LightPolicies, LightPolicy, Policies};
pub use record::{LightRecord, MOST_LIGHTS, NO_LIGHT, PackedLight};
pub use relevance::{LUMINANCE, ScoredLight, irradiance, light_record, score};
pub use selected::SelectedLights;
pub use selection::{select_lights, select_parallel};
pub use table::{LightSlot, LightTable, Selection};
pub use tree::{LightTree, search_order};
