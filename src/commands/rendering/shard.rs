//! `relief render --shard`: a shard as its run was split.

use crate::commands::common::failure::{Failure, say};
use crate::commands::common::view::loading;
use crate::commands::rendering::work::with_bar;
use crate::data::shards::{ShardJob, render_shard};
use std::path::{Path, PathBuf};

/// Renders one; `scene`: where the scene is, if it has moved.
pub fn render(file: &Path, number: usize, scene: Option<PathBuf>, resume: bool) -> Result<(), Failure> {
    let shard = ShardJob { file: file.to_owned(), number, scene, resume, load: loading() };
    let (folder, is_new) = with_bar(|progress| render_shard(&shard, progress))?;
    let folder = folder.display();
    Ok(say(&if is_new { folder.to_string() } else { format!("nothing to do: {folder} is whole") })?)
}
