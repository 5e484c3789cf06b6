//! Imports of a crate's files, read from their text, and the rules for them that hold in every crate.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Most files that use each other in a circle.
const MOST_IN_A_CIRCLE: usize = 4;

/// Most files of a folder, without those of its folders.
const MOST_IN_A_FOLDER: usize = 20;

/// A path in a file's code that leads to another file of its crate.
#[derive(Clone, PartialEq, Debug)]
pub struct Import {
    pub file: String,
    pub line: usize,
    /// From the crate's root on, without `crate`.
    pub path: Vec<String>,
}

/// The sources of a crate.
pub struct Sources {
    /// The folder that they lie in, for messages.
    folder: &'static str,
    /// Files by their paths in the folder, `lights/table.rs`, and their code.
    pub files: BTreeMap<String, Vec<String>>,
    pub imports: Vec<Import>,
    /// Paths that a `pub use` shows, by its file and their names there.
    shown: BTreeMap<(String, String), Vec<String>>,
}

impl Sources {
    /// Those of a crate, but for `others`: folders and files that see it from outside. `folder`: for messages.
    pub fn read(path: &Path, folder: &'static str, others: &[&str]) -> Self {
        fn add(folder: &Path, name: &str, all: &mut BTreeMap<String, String>) {
            for entry in std::fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                let own = path.file_name().and_then(|own| own.to_str()).expect("a name in UTF-8");
                let name = format!("{name}{own}");
                if path.is_dir() {
                    add(&path, &format!("{name}/"), all);
                } else if name.ends_with(".rs") {
                    all.insert(name, std::fs::read_to_string(&path).expect("text"));
                }
            }
        }
        let mut texts = BTreeMap::new();
        add(path, "", &mut texts);
        texts.retain(|name, _| !others.iter().any(|other| name.starts_with(other)));
        Self::of(folder, texts)
    }

    /// Sources from the texts of files, by their paths.
    pub fn of(folder: &'static str, texts: BTreeMap<String, String>) -> Self {
        let files: BTreeMap<_, _> = texts.into_iter().map(|(file, text)| (file, code(&text))).collect();
        let code: Vec<(String, String)> = files.iter().map(|(file, code)| (file.clone(), code.join("\n"))).collect();
        let mut sources = Self { folder, files, imports: Vec::new(), shown: BTreeMap::new() };
        code.iter().for_each(|(file, code)| sources.add_imports(file, code));
        sources
    }

    /// Those of a file, by `use` or by a path in its code.
    fn add_imports(&mut self, file: &str, code: &str) {
        let mut at = 0;
        while at < code.len() {
            let rest = &code[at..];
            let line = code[..at].rfind('\n').map_or(0, |end| end + 1);
            let name = rest.find(|c: char| !c.is_alphanumeric() && !"_:".contains(c)).unwrap_or(rest.len());
            let (mut found, mut is_shown) = (Vec::new(), false);
            let end = if rest.starts_with("use ") && ["", "pub"].contains(&visibility(&code[line..at])) {
                let end = rest.find(';').unwrap_or(rest.len());
                is_shown = visibility(&code[line..at]) == "pub";
                leaves(&rest["use ".len()..end], &[], &mut found);
                end
            } else {
                let path = rest[..name].trim_end_matches(':');
                // A macro's `$crate` is for those who use it.
                if path.contains("::") && !code[..at].ends_with('$') {
                    leaves(path, &[], &mut found);
                }
                name
            };
            for (path, name) in found {
                let Some(path) = self.rooted(file, &path) else { continue };
                if is_shown {
                    self.shown.insert((file.to_owned(), name), path.clone());
                }
                let line = code[..at].matches('\n').count() + 1;
                self.imports.push(Import { file: file.to_owned(), line, path });
            }
            at += end.max(rest.chars().next().map_or(1, char::len_utf8));
        }
    }

    /// A path from the crate's root on; `None` for one that leads elsewhere.
    pub fn rooted(&self, file: &str, path: &[String]) -> Option<Vec<String>> {
        let own = module(file);
        let ups = path.iter().take_while(|part| *part == "super").count();
        let (above, below) = match path.first()?.as_str() {
            "crate" => (0, &path[1..]),
            "super" => (own.len().saturating_sub(ups), &path[ups..]),
            // A module of the file's own.
            first => (self.file([own.as_slice(), &[first]].concat()).map(|_| own.len())?, path),
        };
        Some(own[..above].iter().map(|part| (*part).to_owned()).chain(below.iter().cloned()).collect())
    }

    /// The file of a module.
    fn file(&self, module: Vec<&str>) -> Option<&str> {
        let path = module.join("/");
        let names = if path.is_empty() {
            ["lib.rs".to_owned(), String::new()]
        } else {
            [format!("{path}.rs"), format!("{path}/mod.rs")]
        };
        names.iter().find_map(|name| self.files.get_key_value(name)).map(|(name, _)| name.as_str())
    }

    /// The file that a path names, and what is left of the path.
    pub fn named<'a>(&self, path: &'a [String]) -> Option<(&str, &'a [String])> {
        let parts = |count: usize| path[..count].iter().map(String::as_str).collect();
        (0..=path.len()).rev().find_map(|count| Some((self.file(parts(count))?, &path[count..])))
    }

    /// The file that has what a path leads to, through any `pub use`.
    fn having(&self, path: &[String]) -> Option<&str> {
        let mut path = path.to_vec();
        // As many as nobody writes: names that show each other have no end.
        for _ in 0..8 {
            let (file, left) = self.named(&path)?;
            let shown = left.first().and_then(|name| self.shown.get(&(file.to_owned(), name.clone())));
            let Some(shown) = shown else { return Some(file) };
            path = [shown, &left[1..]].concat();
        }
        None
    }

    /// Imports of one file by another, and that file.
    pub fn arrows(&self) -> Vec<(&Import, &str)> {
        let arrows = self.imports.iter().filter_map(|import| Some((import, self.having(&import.path)?)));
        arrows.filter(|(import, file)| import.file != *file).collect()
    }

    /// A line of code, for messages.
    pub fn told(&self, import: &Import) -> String {
        format!("{}/{}:{}: crate::{}", self.folder, import.file, import.line, import.path.join("::"))
    }

    /// No more than [`MOST_IN_A_CIRCLE`] files use each other.
    pub fn check_circles(&self) {
        let arrows = self.arrows();
        let pairs: BTreeSet<(&str, &str)> = arrows.iter().map(|(import, to)| (import.file.as_str(), *to)).collect();
        for circle in circles(&pairs) {
            if circle.len() <= MOST_IN_A_CIRCLE {
                continue;
            }
            let within: Vec<_> =
                pairs.iter().filter(|(from, to)| circle.contains(from) && circle.contains(to)).collect();
            // The sizes that are left, largest first.
            let left = |cut: &(&str, &str)| {
                let rest = within.iter().filter(|arrow| **arrow != cut).map(|arrow| **arrow).collect();
                let mut sizes: Vec<usize> = circles(&rest).iter().map(BTreeSet::len).collect();
                sizes.sort_by(|a, b| b.cmp(a));
                sizes
            };
            let cut = within.iter().min_by_key(|arrow| left(arrow)).expect("an arrow");
            let told = |from: &str, to: &str| {
                let lines = arrows.iter().filter(|(import, target)| import.file == from && *target == to);
                lines.map(|(import, _)| self.told(import)).collect::<Vec<_>>().join("\n")
            };
            let all: Vec<String> = within.iter().map(|(from, to)| told(from, to)).collect();
            panic!(
                "{} files in a circle, {MOST_IN_A_CIRCLE} at most; first to cut:\n{}\nof all:\n{}",
                circle.len(),
                told(cut.0, cut.1),
                all.join("\n")
            );
        }
    }

    /// No folder has more than [`MOST_IN_A_FOLDER`] files.
    pub fn check_folders(&self) {
        let mut sizes = BTreeMap::new();
        for file in self.files.keys() {
            *sizes.entry(file.rsplit_once('/').map_or("", |(folder, _)| folder)).or_insert(0) += 1;
        }
        for (folder, size) in sizes {
            assert!(size <= MOST_IN_A_FOLDER, "{}/{folder} has {size} files, {MOST_IN_A_FOLDER} at most", self.folder);
        }
    }
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

/// The path of a file's module.
fn module(file: &str) -> Vec<&str> {
    let mut module: Vec<&str> = file.trim_end_matches(".rs").split('/').collect();
    if module == ["lib"] || module.last() == Some(&"mod") {
        module.pop();
    }
    module
}

/// `pub` of `pub(crate)` and its like; what stands before an item, as it is, else.
fn visibility(before: &str) -> &str {
    let before = before.trim();
    if before.starts_with("pub(") && before.ends_with(')') { "pub" } else { before }
}

/// The single paths of a tree such as `a::{b, c::{d, e as f}}`, and their names.
fn leaves(tree: &str, before: &[String], found: &mut Vec<(Vec<String>, String)>) {
    let tree = tree.trim();
    if tree.starts_with("::") && before.is_empty() {
        return;
    }
    let parts = |path: &str| {
        let parts = path.split("::").map(|part| part.trim().to_owned());
        parts.filter(|part| !part.is_empty() && part != "self").collect::<Vec<_>>()
    };
    let Some((path, list)) = tree.split_once('{') else {
        let (path, name) = tree.split_once(" as ").unwrap_or((tree, ""));
        let path = [before, &parts(path)].concat();
        let name = if name.is_empty() { path.last().cloned().unwrap_or_default() } else { name.trim().to_owned() };
        return found.push((path, name));
    };
    let before = [before, &parts(path)].concat();
    let list = list.trim_end().trim_end_matches('}');
    // A list within lost its last bracket, which is of no matter.
    let (mut depth, mut start) = (0, 0);
    for (at, sign) in list.char_indices().chain([(list.len(), ',')]) {
        match sign {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 || at == list.len() => {
                if !list[start..at].trim().is_empty() {
                    leaves(&list[start..at], &before, found);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// Sets of names that lead to each other along arrows, largest first.
pub fn circles<'a>(arrows: &BTreeSet<(&'a str, &'a str)>) -> Vec<BTreeSet<&'a str>> {
    let mut used: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in arrows {
        used.entry(from).or_default().push(to);
    }
    let reached = |from: &str| {
        let (mut open, mut seen) = (vec![from], BTreeSet::new());
        while let Some(next) = open.pop() {
            let new = used.get(next).into_iter().flatten().filter(|next| seen.insert(**next));
            open.extend(new.copied().collect::<Vec<_>>());
        }
        seen
    };
    let all: BTreeMap<&str, BTreeSet<&str>> = used.keys().map(|from| (*from, reached(from))).collect();
    let circle = |(from, seen): (&&'a str, &BTreeSet<&'a str>)| {
        let back = seen.iter().filter(|other| all.get(**other).is_some_and(|seen| seen.contains(from)));
        back.copied().collect::<BTreeSet<_>>()
    };
    let found: BTreeSet<_> = all.iter().map(circle).filter(|circle| !circle.is_empty()).collect();
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by_key(|circle| std::cmp::Reverse(circle.len()));
    found
}
