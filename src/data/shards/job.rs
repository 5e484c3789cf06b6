//! `shards.json`: what the shards of a run are.

use super::error::ShardError;
use crate::data::work::Work;
use crate::output;
use crate::recording::PROGRAM;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use systems::run::state_hash::StateHash;

/// Bytes of a file of text at most: hashes of a hundred thousand shards, or of a million files, are fewer.
const MOST_BYTES: u64 = 256 << 20;

/// Reads a file of text.
///
/// # Errors
/// The message of the system, or the expected contents.
pub(super) fn read_text(path: &Path) -> Result<Vec<u8>, String> {
    let file = File::open(path).map_err(|error| error.to_string())?;
    let metadata = file.metadata().map_err(|error| error.to_string())?;
    if !metadata.is_file() || metadata.len() > MOST_BYTES {
        return Err("expected a file of at most 256 MB".to_owned());
    }
    let mut bytes = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// A run that is rendered in shards.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// The program's, with which the run was split and is rendered.
    pub version: String,
    /// Rendering of the whole run, whose scene is named from the root of the file system on; without folders.
    pub work: Work,
    /// Length of a step.
    pub step_seconds: f64,
    /// In their order; each begins with the frame at which the one before ends.
    pub shards: Vec<Shard>,
    /// Hash of the state after the last frame, in hexadecimal digits.
    pub last_state: String,
}

/// A part of a run.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Its first frame.
    pub first: u64,
    /// The frame after its last.
    pub end: u64,
    /// Hash of the state after the first frame's step.
    pub state: String,
    /// The snapshot that it begins with, of this frame or an earlier one, in the job's folder.
    pub snapshot: PathBuf,
}

impl Job {
    /// Reads a job's file. Returns its hash (BLAKE3), too, which is in the manifests of its shards.
    ///
    /// # Errors
    /// [`ShardError::Refused`]: not such a file, or of another version of the program.
    pub fn read(path: &Path) -> Result<(Self, String), ShardError> {
        let refused = |message: String| ShardError::refused(path, message);
        let bytes = read_text(path).map_err(refused)?;
        let value: serde_json::Value =
            serde_json::from_slice(&bytes).map_err(|error| refused(format!("not a file of relief split: {error}")))?;
        // Before the rest, which another version may have otherwise.
        if let Some(version) = value["version"].as_str().filter(|version| *version != PROGRAM) {
            return Err(refused(format!("made by version \"{version}\" of the program; this is {PROGRAM}")));
        }
        if value.get("options").is_some() {
            return Err(refused("made by an earlier program; expected that the run is split again".to_owned()));
        }
        let job: Self =
            serde_json::from_value(value).map_err(|error| refused(format!("not a file of relief split: {error}")))?;
        job.check().map_err(|message| refused(format!("corrupt: {message}")))?;
        Ok((job, blake3::hash(&bytes).to_string()))
    }

    fn check(&self) -> Result<(), String> {
        let mut end = self.shards.first().ok_or("expected at least one shard")?.first;
        for (number, shard) in self.shards.iter().enumerate() {
            if shard.first != end || shard.end <= shard.first {
                return Err(format!(
                    "shard {number}: expected frames from {end} on, found {}..{}",
                    shard.first, shard.end
                ));
            }
            let parts = shard.snapshot.components();
            if !parts.clone().all(|part| matches!(part, Component::Normal(_))) || parts.count() == 0 {
                let found = shard.snapshot.display();
                return Err(format!("shard {number}: expected a snapshot in the job's folder, found {found}"));
            }
            end = shard.end;
        }
        self.work.fault().map_or(Ok(()), Err)?;
        self.states().map(|_| ())
    }

    /// The file's text.
    pub(super) fn text(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// All frames.
    pub fn frames(&self) -> Range<u64> {
        let ends = self.shards.first().zip(self.shards.last());
        ends.map_or(0..0, |(first, last)| first.first..last.end)
    }

    /// Steps and hashes of the states between shards: of each the first, and that after the last frame.
    pub(super) fn states(&self) -> Result<Vec<(u64, StateHash)>, String> {
        let last = self.frames().end.saturating_sub(1);
        let states = self.shards.iter().map(|shard| (shard.first, &shard.state)).chain([(last, &self.last_state)]);
        let parse = |(step, text): (u64, &String)| {
            let hash = u128::from_str_radix(text, 16).map_err(|_| format!("step {step}: \"{text}\" is no hash"))?;
            Ok((step, StateHash(hash)))
        };
        states.map(parse).collect()
    }

    /// Place of a shard: a folder beside the job's file, whose names have two digits or more.
    pub fn folder_of(&self, job: &Path, shard: usize) -> PathBuf {
        let digits = (self.shards.len().saturating_sub(1)).to_string().len().max(2);
        job.with_file_name(format!("{shard:0digits$}"))
    }

    pub(super) fn write(&self, path: &Path) -> Result<(), ShardError> {
        let text = self.text().map_err(|error| ShardError::refused(path, error))?;
        Ok(output::write_whole(path, text.as_bytes())?)
    }
}
