//! What of `src/` uses what, read from its text: no circle of folders, and nothing of the command line in the library.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The program, which alone has a command line.
const PROGRAM: [&str; 2] = ["main.rs", "commands/"];

/// The files below `src/` by their paths there, and their code.
fn files() -> BTreeMap<String, Vec<String>> {
    fn add(folder: &Path, name: &str, all: &mut BTreeMap<String, Vec<String>>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let own = path.file_name().and_then(|own| own.to_str()).expect("a name in UTF-8");
            if path.is_dir() {
                add(&path, &format!("{name}{own}/"), all);
            } else if own.ends_with(".rs") {
                all.insert(format!("{name}{own}"), code(&fs::read_to_string(&path).expect("text")));
            }
        }
    }
    let mut all = BTreeMap::new();
    add(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), "", &mut all);
    all
}

/// Lines without comments; those of modules for tests are empty.
fn code(text: &str) -> Vec<String> {
    let mut is_test = false;
    let line = |line: &str| {
        is_test |= line == "#[cfg(test)]";
        let shown = if is_test { "" } else { line.split("//").next().unwrap_or_default() };
        // The module ends, or lies in a file of its own.
        is_test &= line != "}" && !(line.starts_with("mod ") && line.ends_with(';'));
        shown.to_owned()
    };
    text.lines().map(line).collect()
}

/// The folder below `src/`, or the file beside the folders, that a file belongs to.
fn part(file: &str) -> &str {
    file.split('/').next().unwrap_or(file).trim_end_matches(".rs")
}

/// The parts that a file uses, each with the number of a line: what follows on `crate::`, or on `super::` as often as
/// leads to the root.
fn uses(file: &str, code: &[String]) -> Vec<(usize, String)> {
    let depth = file.split('/').filter(|name| *name != "mod.rs").count();
    let (up, text) = ("super::".repeat(depth), code.join("\n"));
    let starts = ["crate::", up.as_str()].into_iter().flat_map(|root| {
        let found = text.match_indices(root).map(|(at, root)| (at, at + root.len()));
        found.collect::<Vec<_>>()
    });
    let mut used = Vec::new();
    for (start, end) in starts {
        if text[..start].ends_with(|c: char| c.is_alphanumeric() || "_:$".contains(c)) {
            continue;
        }
        let line = text[..start].matches('\n').count() + 1;
        let name = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
        let Some(list) = text[end..].strip_prefix('{') else {
            used.push((line, name(&text[end..])));
            continue;
        };
        let mut open = 1;
        let mut at_name = true;
        for (at, sign) in list.char_indices() {
            match sign {
                '{' => open += 1,
                '}' => open -= 1,
                ',' if open == 1 => at_name = true,
                _ if at_name && open == 1 && !sign.is_whitespace() => {
                    used.push((line, name(&list[at..])));
                    at_name = false;
                }
                _ => {}
            }
            if open == 0 {
                break;
            }
        }
    }
    used
}

#[test]
fn no_folder_of_the_library_uses_one_that_uses_it() {
    let files = files();
    let parts: BTreeSet<&str> = files.keys().map(|file| part(file)).collect();
    // The lines by which a part uses another.
    let mut lines: BTreeMap<(&str, &str), Vec<String>> = BTreeMap::new();
    for (file, code) in &files {
        for (line, used) in uses(file, code) {
            let Some(used) = parts.get(used.as_str()).filter(|used| **used != part(file)) else { continue };
            lines.entry((part(file), used)).or_default().push(format!("src/{file}:{line} uses {used}"));
        }
    }
    // So that it does not pass because nothing was read.
    assert!(lines.contains_key(&("frames", "renderer")) && lines.len() > 40, "{lines:?}");
    let reached = |from: &str| {
        let (mut open, mut seen) = (vec![from], BTreeSet::new());
        while let Some(next) = open.pop() {
            for (_, used) in lines.keys().filter(|(user, _)| *user == next) {
                if seen.insert(*used) {
                    open.push(used);
                }
            }
        }
        seen
    };
    let circle: Vec<&str> = parts.iter().copied().filter(|part| reached(part).contains(part)).collect();
    let within = lines
        .iter()
        .filter(|((user, used), _)| circle.contains(user) && circle.contains(used) && reached(used).contains(user));
    let told: Vec<&str> = within.flat_map(|(_, lines)| lines).map(String::as_str).collect();
    assert!(told.is_empty(), "these use each other in a circle:\n{}", told.join("\n"));
}

#[test]
fn the_library_knows_no_command_line() {
    let mut known = Vec::new();
    for (file, code) in files() {
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

#[test]
fn uses_are_read_as_the_compiler_reads_them() {
    let text = "//! use crate::a::A;\nuse crate::b::{self, B};\nuse crate::{\n    c::{C, d},\n    e,\n};\n\
                fn f() -> crate::g::H { super::i::j(mycrate::k) } // crate::l\nuse super::super::m;\n\
                #[cfg(test)]\nmod tests {\n    use crate::n::N;\n}\nuse crate::o;\n";
    let used = |file: &str| uses(file, &code(text)).into_iter().map(|(line, name)| format!("{line} {name}"));
    let expected = ["2 b", "3 c", "3 e", "7 g", "13 o"];
    assert_eq!(used("x/y.rs").collect::<Vec<_>>(), [&expected[..], &["8 m"]].concat());
    assert_eq!(used("x/mod.rs").collect::<Vec<_>>(), [&expected[..], &["7 i", "8 super"]].concat());
    assert_eq!((part("x/mod.rs"), part("x/y/z.rs"), part("x.rs")), ("x", "x", "x"));
}
