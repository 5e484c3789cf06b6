//! Culling: which objects a view draws, found on the GPU, or on the CPU where there are few; and how much that was. May
//! use `plan`, `gpu`, `resources` and `passes`.

pub(crate) mod cpu_culling;
pub(crate) mod cull;
pub(crate) mod indirect_draws;
pub(crate) mod pyramid;
pub(crate) mod slot_set;
pub(crate) mod visible_counts;
