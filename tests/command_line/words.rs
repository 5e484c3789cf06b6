//! Words of doc comments: they begin with a noun or a verb.

use crate::common::prelude::*;

/// Words that leave the noun to the reader.
const REFUSED: [&str; 6] = ["What", "Whether", "How", "Of", "Where", "As"];

/// Folders with sources, from the root of the project.
const FOLDERS: [&str; 6] = ["src", "systems", "python/src", "tests", "benches", "examples"];

/// Collects the first lines of doc comments that begin with a refused word, below a folder or file.
fn collect(path: &Path, found: &mut Vec<String>) {
    if path.is_dir() {
        for entry in fs::read_dir(path).expect("a folder") {
            collect(&entry.expect("an entry").path(), found);
        }
        return;
    }
    if path.extension().is_none_or(|extension| extension != "rs") {
        return;
    }
    let text = fs::read_to_string(path).expect("text");
    let mut is_within = false;
    for (number, line) in (1..).zip(text.lines().map(str::trim_start)) {
        let comment = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
        let first = comment.filter(|_| !is_within).and_then(|text| text.split_whitespace().next());
        if first.is_some_and(|word| REFUSED.contains(&word)) {
            found.push(format!("{}:{number}: {line}", path.display()));
        }
        is_within = comment.is_some();
    }
}

#[test]
fn doc_comments_begin_with_a_noun_or_a_verb() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for folder in FOLDERS {
        collect(&root.join(folder), &mut found);
    }
    assert!(found.is_empty(), "{} doc comments begin with one of {REFUSED:?}:\n{}", found.len(), found.join("\n"));
}
