//! Imports between the files of this crate, read from their text. Folders are layers, and circles of imports stay small
//! enough to be understood together.

#[path = "common/imports.rs"]
mod imports;

use imports::{Import, Sources};
use std::collections::BTreeMap;
use std::path::Path;

/// Folders, each using itself and those before it; a row's use each other, too. Files on top use all.
const LAYERS: [&[&str]; 10] = [
    &["ecs", "describe"],
    &["space"],
    &["assets"],
    &["cells"],
    &["lights"],
    &["weather"],
    &["draw"],
    &["sensors"],
    &["vehicles", "physics"],
    &["run"],
];

/// Most files beside the folders.
const MOST_ON_TOP: usize = 12;

fn sources() -> Sources {
    // These see the crate from outside.
    let others = ["tests/", "examples/", "target/"];
    Sources::read(Path::new(env!("CARGO_MANIFEST_DIR")), "systems", &others)
}

/// The number of a file's layer; those on top come last.
fn layer(file: &str) -> usize {
    let Some((folder, _)) = file.split_once('/') else { return LAYERS.len() };
    let number = LAYERS.iter().position(|layer| layer.contains(&folder));
    number.unwrap_or_else(|| panic!("systems/{folder} is no layer: it has to have its place in LAYERS"))
}

fn is_roof(file: &str) -> bool {
    file == "lib.rs" || file.ends_with("mod.rs")
}

#[test]
fn an_import_names_the_file_that_has_the_item() {
    let sources = sources();
    let through = |import: &&Import| {
        let named = sources.named(&import.path).map_or("", |(file, _)| file);
        // A roof shows what is below it.
        (named.is_empty() || is_roof(named)) && !is_roof(&import.file)
    };
    let through: Vec<String> = sources.imports.iter().filter(through).map(|import| sources.told(import)).collect();
    assert!(through.is_empty(), "through a mod.rs, which is for others:\n{}", through.join("\n"));
}

#[test]
fn a_folder_uses_only_itself_and_those_before_it() {
    let sources = sources();
    let mut broken = Vec::new();
    for (import, target) in sources.arrows() {
        if layer(target) > layer(&import.file) {
            let before = LAYERS[..=layer(&import.file)].concat().join(", ");
            broken.push(format!("{}: it may use {before} only", sources.told(import)));
        }
    }
    assert!(broken.is_empty(), "against the order of layers:\n{}", broken.join("\n"));
}

#[test]
fn few_files_use_each_other_in_a_circle() {
    sources().check_circles();
}

#[test]
fn folders_have_few_files() {
    let sources = sources();
    sources.check_folders();
    let top: Vec<&String> = sources.files.keys().filter(|file| !file.contains('/')).collect();
    assert!(top.len() <= MOST_ON_TOP, "systems has {} files beside its folders, {MOST_ON_TOP} at most", top.len());
    // So that nothing above passes because it found nothing.
    assert!(top.contains(&&"lib.rs".to_owned()));
    for folder in LAYERS.concat() {
        assert!(sources.files.contains_key(&format!("{folder}/mod.rs")), "systems/{folder} has no mod.rs");
    }
}

#[test]
fn imports_are_read_as_the_compiler_reads_them() {
    let text = "//! use crate::a::A;\nuse crate::b::{self, B, c::{C, D as E}};\nuse super::f::F;\nuse std::fmt;\n\
                pub(crate) use super::super::g;\n\nfn f() -> crate::h::H { super::i::j(mycrate::k, $crate::k) } // crate::l\n\
                #[cfg(test)]\nmod tests {\n    use crate::m::M;\n}\nuse crate::{\n    n::N,\n    o,\n};\n\
                fn g() { p::q(\"use r;\", ::p::s, t::p::u) }\n";
    let files = [("x/y/z.rs", text), ("x/y/z/p.rs", "")];
    let sources = Sources::of("", files.map(|(file, text)| (file.to_owned(), text.to_owned())).into());
    let found: Vec<(usize, String)> =
        sources.imports.iter().map(|import| (import.line, import.path.join("::"))).collect();
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
        (16, "x::y::z::p::q"),
    ];
    assert_eq!(found, expected.map(|(line, path)| (line, path.to_owned())));
}

#[test]
fn an_arrow_leads_to_the_file_that_has_the_item() {
    let files = [
        ("a/mod.rs", "pub use b::B as C;\npub(crate) use crate::d;\nuse b::E;\n"),
        ("a/b.rs", "use super::super::d::{C, d::D};"),
        ("d/mod.rs", "pub use crate::a::{C};\npub use d::D;\n"),
        ("d/d.rs", "use super::C;\nfn f() { crate::a::F; crate::a::d::D }"),
    ];
    let sources = Sources::of("", files.map(|(file, text)| (file.to_owned(), text.to_owned())).into());
    let arrows: BTreeMap<(&str, &str), usize> =
        sources.arrows().into_iter().map(|(import, to)| ((import.file.as_str(), to), import.line)).collect();
    let expected = [
        (("a/b.rs", "d/d.rs"), 1),
        (("a/mod.rs", "a/b.rs"), 3),
        (("a/mod.rs", "d/mod.rs"), 2),
        (("d/d.rs", "a/b.rs"), 1),
        (("d/d.rs", "a/mod.rs"), 2),
        (("d/mod.rs", "a/b.rs"), 1),
        (("d/mod.rs", "d/d.rs"), 2),
    ];
    assert_eq!(arrows, expected.into());
}
