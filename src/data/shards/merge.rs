//! Shards, put together to what one process writes.

use super::error::ShardError;
use super::job::Job;
use super::manifest::{Machine, Manifest};
use super::shard::{DATA, FILMS};
use crate::data::dataset::merge::{self as dataset, PartFiles};
use crate::frame_time::FrameTime;
use crate::output::{self, OutputError, WholeFolder};
use crate::video;
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use systems::ecs::parallel::map_in_parallel;

/// The names of ids that pictures have, the same for all frames.
const NAMES_OF_IDS: &str = "ids.json";

/// Options of putting shards together.
#[derive(Clone, Debug, Default)]
pub struct MergeOptions {
    /// Folder of the whole, empty or not there.
    pub folder: PathBuf,
    /// Takes shards of different machines, whose bytes may differ; a warning says so.
    pub mixed: bool,
    /// A film of the colour frames.
    pub video: Option<PathBuf>,
}

/// Puts the shards of a job together. Files of single frames are linked where that can be, else copied. Returns the
/// film, where one was asked for.
///
/// # Errors
/// [`ShardError::Incomplete`]: shards are missing or damaged. [`ShardError::Mixed`]: they are not of one kind of
/// machine. [`ShardError::Refused`]: they are not of one run. Nothing is written then.
pub fn merge(path: &Path, options: &MergeOptions) -> Result<Option<PathBuf>, ShardError> {
    let (job, hash) = Job::read(path)?;
    let MergeOptions { folder, mixed, video } = options;
    match fs::read_dir(folder).map(|mut entries| entries.next().is_some()) {
        Ok(true) => {
            return Err(ShardError::refused(folder, "is not empty; expected a new folder"));
        }
        Err(error) if error.kind() != ErrorKind::NotFound => {
            return Err(ShardError::refused(folder, format!("expected a new folder: {error}")));
        }
        _ if folder.file_name().is_none() => {
            return Err(ShardError::refused(folder, "expected a folder's own name"));
        }
        _ => {}
    }
    let manifests = manifests(path, &job, &hash)?;
    check_states(path, &manifests)?;
    check_machines(path, &manifests, *mixed)?;
    let parts: Vec<PartFiles> = (0..manifests.len())
        .map(|shard| job.folder_of(path, shard))
        .map(|folder| PartFiles { data: folder.join(DATA), films: folder.join(FILMS) })
        .collect();
    let is_of_sensors = manifests.iter().any(|manifest| manifest.blake3.contains_key("data/sensors.json"));
    if let Some(film) = video {
        let has_colors =
            manifests.iter().flat_map(|manifest| manifest.blake3.keys()).any(|name| name.starts_with("data/color_"));
        if is_of_sensors || !has_colors {
            return Err(ShardError::refused(path, "the job has no colour frames to make a film of"));
        }
        video::check(film)?;
    }
    let whole = WholeFolder::begin(folder)?;
    let mut hashes = BTreeMap::new();
    for (shard, (part, manifest)) in parts.iter().zip(&manifests).enumerate() {
        let is_last = shard + 1 == parts.len();
        make_folders(&part.data, whole.folder())?;
        for (name, hash) in &manifest.blake3 {
            let Some(name) = name.strip_prefix("data/") else { continue };
            let is_made = if is_of_sensors { dataset::is_of_run(name) } else { name == NAMES_OF_IDS && !is_last };
            if is_made {
                continue;
            }
            if hashes.insert(name.to_owned(), hash.clone()).is_some() {
                return Err(ShardError::refused(&part.data.join(name), "is in an earlier shard, too"));
            }
            link(&part.data.join(name), &whole.folder().join(name))?;
        }
    }
    if is_of_sensors {
        dataset::merge(&parts, whole.folder(), hashes)?;
    }
    whole.finish()?;
    let Some(film) = video else { return Ok(None) };
    let time = FrameTime::of(job.step_seconds);
    video::warn_of_times(film, job.frames(), time);
    Ok(Some(video::encode(film, folder, job.frames(), time)?))
}

/// The manifests of all shards, whose files are whole.
fn manifests(path: &Path, job: &Job, hash: &str) -> Result<Vec<Manifest>, ShardError> {
    systems::set_threads(None);
    let checked = map_in_parallel(0..job.shards.len(), |shard| Manifest::check(&job.folder_of(path, shard), hash));
    let (mut manifests, mut missing) = (Vec::new(), Vec::new());
    for (shard, checked) in checked.into_iter().enumerate() {
        match checked {
            Ok(manifest) => manifests.push(manifest),
            Err(reason) => missing.push((shard, reason)),
        }
    }
    if missing.is_empty() {
        return Ok(manifests);
    }
    Err(ShardError::Incomplete { job: path.to_owned(), of: job.shards.len(), missing })
}

fn check_states(path: &Path, manifests: &[Manifest]) -> Result<(), ShardError> {
    let parted = manifests.windows(2).position(|pair| pair[0].last != pair[1].first);
    parted.map_or(Ok(()), |shard| {
        let step = manifests[shard].last.step;
        let message =
            format!("after step {step}, the state of shard {shard} is not that with which shard {} begins", shard + 1);
        Err(ShardError::refused(path, message))
    })
}

fn check_machines(path: &Path, manifests: &[Manifest], mixed: bool) -> Result<(), ShardError> {
    let mut machines: Vec<(usize, &Machine)> = Vec::new();
    for (shard, manifest) in manifests.iter().enumerate() {
        if !machines.iter().any(|(_, known)| **known == manifest.machine) {
            machines.push((shard, &manifest.machine));
        }
    }
    if machines.len() < 2 {
        return Ok(());
    }
    let machines = machines.into_iter().map(|(shard, machine)| (shard, machine.to_string())).collect();
    let differing = ShardError::Mixed { job: path.to_owned(), machines };
    if !mixed {
        return Err(differing);
    }
    tracing::warn!("{differing}");
    Ok(())
}

/// Makes the folders that are below one below another, those of sensors without captures, too.
fn make_folders(from: &Path, to: &Path) -> Result<(), ShardError> {
    output::make_folder(to)?;
    for entry in fs::read_dir(from).map_err(|error| ShardError::refused(from, error))?.flatten() {
        if entry.path().is_dir() {
            make_folders(&entry.path(), &to.join(entry.file_name()))?;
        }
    }
    Ok(())
}

/// One file under two names, where the file system has such; else a copy.
fn link(from: &Path, to: &Path) -> Result<(), ShardError> {
    let linked = match fs::hard_link(from, to) {
        // A copy would write over what is there.
        Err(error) if error.kind() != ErrorKind::AlreadyExists => fs::copy(from, to).map(|_| ()),
        linked => linked,
    };
    Ok(linked.map_err(|error| OutputError::io(to, error))?)
}
