//! Traffic: what each vehicle minds of the others on its routes, and how fast that lets it be. Uses routes, signals,
//! types and steering.

pub(crate) mod crossings;
pub mod following;
pub mod lane_changes;
mod lanes;
#[expect(clippy::module_inception, reason = "the resource's own file")]
pub(crate) mod traffic;

pub use traffic::Traffic;
