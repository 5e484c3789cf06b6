//! The search for the most relevant lights of each object, as fast as a processor's vectors make it.
//!
//! `clusters` has its outline: packets of objects ask the tree, and make their lists of lights (`candidates`) shorter
//! step by step. `lanes` has scores and the best three with objects in the lanes of a vector, `residual` what those
//! leave out, and `results` the way from the lanes back to the objects. `enough` finds how many more than three an object
//! needs. An object that is `alone` goes through a list by itself, with lights in the lanes.

pub(crate) mod alone;
pub(crate) mod candidates;
pub(crate) mod clusters;
pub(crate) mod enough;
pub(crate) mod lanes;
pub(crate) mod residual;
pub(crate) mod results;

pub use clusters::{Level, Scratch, select, select_sparse};
pub use results::Found;
