//! Rendering without a window: a run in one process, or in parts. Uses what is common to commands.
//!
//! ```text
//! work    options of what is rendered of which frames
//! split, shard, merge    a run in parts, and one of these
//! render  a run, or a shard
//! ```

pub mod merge;
pub mod render;
mod shard;
pub mod split;
mod work;
