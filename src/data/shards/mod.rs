//! A run in parts that many machines render: each by itself, from a snapshot of the state that it begins with.
//!
//! ```text
//! split      takes the steps of a run once, draws nothing, and writes a snapshot for each shard
//! job        what the shards of a run are: `JOB/shards.json`
//! shard      renders one into `JOB/07`, whole or not at all
//! manifest   `JOB/07/manifest.json`: which files there are, and what made them
//! merge      puts the shards together to what one process writes
//! ```
//!
//! A capture is a function of the states after its step and, at most, at the two steps before at which its sensor was
//! due. So a shard begins up to two intervals early, without files of these, and what it writes is what the whole run
//! writes there. Files that are about the whole run (logs, COCO's, films, `sensors.json`) are written in parts, and put
//! together by the writers that write those of a whole run.

mod error;
mod job;
mod manifest;
mod merge;
mod shard;
mod split;

pub use error::ShardError;
pub use job::{Job, Shard};
pub use merge::{MergeOptions, merge};
pub use shard::{ShardJob, render_shard};
pub use split::{SplitJob, split};
