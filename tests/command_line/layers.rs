//! Imports in `src/` and `python/src/`, read from the text: few files use each other in a circle, no folders do, and
//! the library knows no command line.

#[path = "../../systems/tests/common/imports.rs"]
mod imports;

use crate::common::prelude::*;
use imports::{Sources, circles};
use std::collections::BTreeSet;

/// The program, which alone has a command line.
const PROGRAM: [&str; 2] = ["main.rs", "commands/"];

fn sources(folder: &'static str) -> Sources {
    Sources::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), folder, &[])
}

/// The folder in `within`, or the file of the crate's root, that a file belongs to; `None`: in no folder there.
fn part<'a>(file: &'a str, within: &str) -> Option<&'a str> {
    let below = file.strip_prefix(within)?;
    match below.split_once('/') {
        Some((folder, _)) => Some(folder),
        None => within.is_empty().then(|| below.trim_end_matches(".rs")),
    }
}

#[test]
fn no_folder_uses_one_beside_it_that_uses_it() {
    for folder in ["src", "python/src"] {
        let sources = sources(folder);
        let arrows = sources.arrows();
        let above = |file: &str| file.match_indices('/').map(|(at, _)| file[..=at].to_owned()).collect::<Vec<_>>();
        let folders: BTreeSet<String> = sources.files.keys().flat_map(|file| above(file)).collect();
        for within in folders.iter().map(String::as_str).chain([""]) {
            // The lines by which a part uses another.
            let mut lines: BTreeMap<(&str, &str), Vec<String>> = BTreeMap::new();
            for (import, to) in &arrows {
                let (Some(user), Some(used)) = (part(&import.file, within), part(to, within)) else { continue };
                if user != used {
                    lines.entry((user, used)).or_default().push(sources.told(import));
                }
            }
            // So that it does not pass because nothing was read.
            let is_known = lines.contains_key(&("frames", "renderer")) && lines.len() > 40;
            assert!(is_known || folder != "src" || !within.is_empty(), "{lines:?}");
            let circles = circles(&lines.keys().copied().collect());
            let is_within =
                |(user, used): &(&str, &str)| circles.iter().any(|one| one.contains(user) && one.contains(used));
            let told: Vec<String> =
                lines.into_iter().filter(|(arrow, _)| is_within(arrow)).flat_map(|(_, lines)| lines).collect();
            assert!(told.is_empty(), "these use each other in a circle:\n{}", told.join("\n"));
        }
    }
}

#[test]
fn few_files_use_each_other_in_a_circle() {
    sources("src").check_circles();
    sources("python/src").check_circles();
}

#[test]
fn folders_have_few_files() {
    sources("src").check_folders();
    sources("python/src").check_folders();
}

#[test]
fn the_library_knows_no_command_line() {
    let mut known = Vec::new();
    for (file, code) in sources("src").files {
        if PROGRAM.iter().any(|own| file.starts_with(own)) {
            continue;
        }
        for (line, text) in (1..).zip(code) {
            let is_option = |(at, dashes): (usize, &str)| {
                let (before, after) = (&text[..at], &text[at + dashes.len()..]);
                !before.ends_with('-') && after.starts_with(|c: char| c.is_ascii_lowercase())
            };
            if text.contains("clap::") || text.match_indices("--").any(is_option) {
                known.push(format!("src/{file}:{line}: {}", text.trim()));
            }
        }
    }
    assert!(known.is_empty(), "clap, or the name of an option, outside of the program:\n{}", known.join("\n"));
}
