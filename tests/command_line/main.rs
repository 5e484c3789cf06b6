//! The program without a window: what it says, recordings, shards, films and lost devices; the examples; and which
//! imports its source may have, and with which words its comments begin.

#[path = "../common/mod.rs"]
mod common;
mod examples;
mod films;
mod layers;
mod lost_device;
mod program;
mod recording;
mod shards;
mod words;
