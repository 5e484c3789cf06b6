//! Which files of this crate use which, read from their text: folders are layers, and circles of imports stay small
//! enough to be understood together.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Folders, each using itself and those before it; a row's use each other, too. Files on top use all.
const LAYERS: [&[&str]; 9] = [
    &["ecs"],
    &["space"],
    &["assets"],
    &["cells"],
    &["lights"],
    &["draw"],
    &["sensors"],
    &["vehicles", "physics"],
    &["run"],
];

/// Most files that use each other in a circle.
const MOST_IN_A_CIRCLE: usize = 4;

/// Most files beside the folders.
const MOST_ON_TOP: usize = 12;

/// A path that begins with `crate` or `super`.
#[derive(Clone, PartialEq, Debug)]
struct Import {
    line: usize,
    /// From the crate's root on, without `crate`.
    path: Vec<String>,
}

/// The crate's files by their paths, `lights/table.rs`, and what they import.
fn crate_imports() -> BTreeMap<String, Vec<Import>> {
    fn add(folder: &Path, name: &str, all: &mut BTreeMap<String, Vec<Import>>) {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let own = path.file_name().and_then(|own| own.to_str()).expect("a name in UTF-8");
            let name = format!("{name}{own}");
            if path.is_dir() {
                add(&path, &format!("{name}/"), all);
            } else if name.ends_with(".rs") {
                let found = imports(&name, &std::fs::read_to_string(&path).expect("text"));
                all.insert(name, found);
            }
        }
    }
    let mut all = BTreeMap::new();
    add(Path::new(env!("CARGO_MANIFEST_DIR")), "", &mut all);
    // These see the crate from outside.
    all.retain(|name, _| !["tests/", "examples/", "target/"].iter().any(|folder| name.starts_with(folder)));
    all
}

/// What a file imports, by `use` or by a path in its code; without comments and modules for tests.
fn imports(file: &str, text: &str) -> Vec<Import> {
    let (mut code, mut lines) = (String::new(), Vec::new());
    let mut is_test = false;
    for (line, text) in (1..).zip(text.lines()) {
        is_test |= text == "#[cfg(test)]";
        if !is_test {
            code.push_str(text.split("//").next().unwrap_or_default());
            code.push('\n');
            lines.resize(code.len(), line);
        } else if text == "}" || text.starts_with("mod ") && text.ends_with(';') {
            is_test = false;
        }
    }
    let mut found = Vec::new();
    let mut at = 0;
    while at < code.len() {
        let rest = &code[at..];
        let is_start = !code[..at].ends_with(|c: char| c.is_alphanumeric() || "_:$".contains(c));
        if is_start && rest.starts_with("use ") {
            let end = rest.find(';').unwrap_or(rest.len());
            leaves(&rest["use ".len()..end], &[], &mut |path| found.push((at, path)));
            at += end;
        } else if is_start && (rest.starts_with("crate::") || rest.starts_with("super::")) {
            let end = rest.find(|c: char| !c.is_alphanumeric() && !"_:".contains(c)).unwrap_or(rest.len());
            leaves(rest[..end].trim_end_matches(':'), &[], &mut |path| found.push((at, path)));
            at += end;
        } else {
            at += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    let import = |(at, path): (usize, Vec<String>)| Some(Import { line: lines[at], path: from_root(file, &path)? });
    found.into_iter().filter_map(import).collect()
}

/// The single paths of a tree such as `a::{b, c::{d, e as f}}`.
fn leaves(tree: &str, before: &[String], take: &mut impl FnMut(Vec<String>)) {
    let tree = tree.trim();
    let Some((path, list)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default().split("::");
        let own = path.map(|part| part.trim().to_owned()).filter(|part| !part.is_empty() && part != "self");
        return take(before.iter().cloned().chain(own).collect());
    };
    let own = path.split("::").map(|part| part.trim().to_owned()).filter(|part| !part.is_empty());
    let before: Vec<String> = before.iter().cloned().chain(own).collect();
    let list = list.trim_end().trim_end_matches('}');
    // A list within lost its last bracket, which is of no matter.
    let (mut depth, mut start) = (0, 0);
    for (at, sign) in list.char_indices().chain([(list.len(), ',')]) {
        match sign {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 || at == list.len() => {
                if !list[start..at].trim().is_empty() {
                    leaves(&list[start..at], &before, take);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// A path from the crate's root on; `None` for one that leads elsewhere.
fn from_root(file: &str, path: &[String]) -> Option<Vec<String>> {
    let mut module: Vec<&str> = file.trim_end_matches(".rs").split('/').collect();
    if module.last() == Some(&"mod") {
        module.pop();
    }
    let ups = path.iter().take_while(|part| *part == "super").count();
    if ups == 0 {
        return (path.first()? == "crate").then(|| path[1..].to_vec());
    }
    let above = module.iter().take(module.len().saturating_sub(ups)).map(|&part| part.to_owned());
    Some(above.chain(path[ups..].iter().cloned()).collect())
}

/// The file that a path leads to.
fn target<'a>(files: &'a BTreeMap<String, Vec<Import>>, path: &[String]) -> Option<&'a str> {
    let names = (1..=path.len()).rev().map(|count| path[..count].join("/") + ".rs");
    names.into_iter().find_map(|name| files.get_key_value(&name)).map(|(name, _)| name.as_str())
}

/// The number of a file's layer; those on top come last.
fn layer(file: &str) -> usize {
    let Some((folder, _)) = file.split_once('/') else { return LAYERS.len() };
    let number = LAYERS.iter().position(|layer| layer.contains(&folder));
    number.unwrap_or_else(|| panic!("systems/{folder} is no layer: it has to have its place in LAYERS"))
}

fn told(file: &str, import: &Import) -> String {
    format!("systems/{file}:{}: crate::{}", import.line, import.path.join("::"))
}

#[test]
fn an_import_names_the_file_that_has_the_item() {
    let files = crate_imports();
    let all = files.iter().flat_map(|(file, imports)| imports.iter().map(move |import| (file, import)));
    let through: Vec<String> =
        all.filter(|(_, import)| target(&files, &import.path).is_none()).map(|(file, i)| told(file, i)).collect();
    assert!(through.is_empty(), "through a mod.rs, which is for others:\n{}", through.join("\n"));
}

#[test]
fn a_folder_uses_only_itself_and_those_before_it() {
    let files = crate_imports();
    let mut broken = Vec::new();
    for (file, imports) in &files {
        for import in imports {
            let Some(target) = target(&files, &import.path) else { continue };
            if layer(target) > layer(file) {
                let before = LAYERS[..=layer(file)].concat().join(", ");
                broken.push(format!("{}: it may use {before} only", told(file, import)));
            }
        }
    }
    assert!(broken.is_empty(), "against the order of layers:\n{}", broken.join("\n"));
}

#[test]
fn no_more_than_a_few_files_use_each_other_in_a_circle() {
    let files = crate_imports();
    let used = |file: &str| files[file].iter().filter_map(|import| target(&files, &import.path)).collect::<Vec<_>>();
    let reached: BTreeMap<&str, BTreeSet<&str>> = files
        .keys()
        .map(|file| {
            let (mut open, mut seen) = (used(file), BTreeSet::new());
            while let Some(next) = open.pop() {
                if seen.insert(next) {
                    open.extend(used(next));
                }
            }
            (file.as_str(), seen)
        })
        .collect();
    let mut circles = BTreeSet::new();
    for (file, seen) in &reached {
        circles.insert(seen.iter().copied().filter(|other| reached[other].contains(file)).collect::<Vec<_>>());
    }
    if let Some(circle) = circles.iter().find(|circle| circle.len() > MOST_IN_A_CIRCLE) {
        let within = |file: &&str| {
            let imports = files[*file].iter();
            let inner = imports.filter(|i| target(&files, &i.path).is_some_and(|t| t != *file && circle.contains(&t)));
            inner.map(|import| told(file, import)).collect::<Vec<_>>()
        };
        let lines: Vec<String> = circle.iter().flat_map(within).collect();
        panic!("{} files in a circle, {MOST_IN_A_CIRCLE} at most:\n{}", circle.len(), lines.join("\n"));
    }
}

#[test]
fn few_files_lie_beside_the_folders() {
    let files = crate_imports();
    let top: Vec<&String> = files.keys().filter(|file| !file.contains('/')).collect();
    assert!(top.len() <= MOST_ON_TOP, "systems has {} files beside its folders, {MOST_ON_TOP} at most", top.len());
    // So that nothing above passes because it found nothing.
    assert!(top.contains(&&"lib.rs".to_owned()));
    for folder in LAYERS.concat() {
        assert!(files.contains_key(&format!("{folder}/mod.rs")), "systems/{folder} has no mod.rs");
    }
}

#[test]
fn imports_are_read_as_the_compiler_reads_them() {
    let text = "//! use crate::a::A;\nuse crate::b::{self, B, c::{C, D as E}};\nuse super::f::F;\nuse std::fmt;\n\
                pub(crate) use super::super::g;\n\nfn f() -> crate::h::H { super::i::j(mycrate::k) } // crate::l\n\
                #[cfg(test)]\nmod tests {\n    use crate::m::M;\n}\nuse crate::{\n    n::N,\n    o,\n};\n";
    let found: Vec<(usize, String)> =
        imports("x/y/z.rs", text).into_iter().map(|import| (import.line, import.path.join("::"))).collect();
    let expected = [
        (2, "b"),
        (2, "b::B"),
        (2, "b::c::C"),
        (2, "b::c::D"),
        (3, "x::y::f::F"),
        (5, "x::g"),
        (7, "h::H"),
        (7, "x::y::i::j"),
        (12, "n::N"),
        (12, "o"),
    ];
    assert_eq!(found, expected.map(|(line, path)| (line, path.to_owned())));
    assert_eq!(from_root("x/mod.rs", &["super".into(), "w".into()]), Some(vec!["w".into()]));
}
