//! Targets of URIs in a glTF file: bytes within it, or a file below a folder that the model may read.
//!
//! A model may come from anywhere, so it does not choose files anywhere. It reads what is below its own folder; if a
//! scene file names it, what is below the folder that holds both. Links are followed, as long as they lead no further.
//! A model that is itself a link is the one it leads to, which reads what is below its folder: stores of files keep a
//! whole model so, and show its files by links elsewhere.

use crate::import::file::read_file;
use crate::import::gltf::report::{Fault, Read};
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::path::{Component, Path, PathBuf};

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Folders of a model's files.
#[derive(Clone, Debug)]
pub struct Place {
    /// The model's own folder, which its URIs are relative to.
    folder: PathBuf,
    /// Nothing outside of it is read.
    bound: PathBuf,
    /// The bound is wider than the model's own folder.
    by_scene: bool,
    /// The folder of the file that the model is a link to, which bounds what is read there.
    target: Option<PathBuf>,
}

impl Place {
    /// Takes the file of a model, and the folder of the file that names it.
    pub fn new(model: &Path, named_in: Option<&Path>) -> Self {
        let folder = model.parent().unwrap_or(Path::new("")).to_owned();
        let own = || normal(&folder);
        let both = named_in.and_then(|named_in| common(&own()?, &normal(named_in)?));
        let by_scene = both.is_some() && both != own();
        let is_link = std::fs::symlink_metadata(model).is_ok_and(|data| data.is_symlink());
        let target = is_link.then(|| Some(model.canonicalize().ok()?.parent()?.to_owned())).flatten();
        Self { bound: both.or_else(own).unwrap_or_else(|| folder.clone()), folder, by_scene, target }
    }

    fn outside(&self, uri: &str, how: &str) -> String {
        if self.by_scene {
            let bound = self.bound.display();
            return format!("{uri:?} leads outside {bound}, the directory of the model and the scene{how}");
        }
        let wayout = "to allow it, load the model from a scene file (.ron) in a common parent directory";
        format!("{uri:?} leads outside the model's directory{how}; {wayout}")
    }

    /// The file that a URI names, if there is one that may be read.
    pub fn local_file(&self, uri: &str) -> Option<PathBuf> {
        if uri.starts_with("data:") { None } else { self.file(uri, "").ok() }
    }

    /// Beside the model, else beside the file that it is a link to.
    fn file(&self, uri: &str, place: &str) -> Read<PathBuf> {
        let path = relative_path(uri, place)?;
        let found = self.file_in(&self.folder, &self.bound, &path, uri, place);
        let target = self.target.as_deref();
        found.or_else(|fault| target.and_then(|t| self.file_in(t, t, &path, uri, place).ok()).ok_or(fault))
    }

    fn file_in(&self, folder: &Path, bound: &Path, path: &Path, uri: &str, place: &str) -> Read<PathBuf> {
        let file = folder.join(path);
        // Before anything is asked of the file.
        if normal(&file).is_none_or(|file| !file.starts_with(bound)) {
            return Err(Fault::unsupported(place, self.outside(uri, "")));
        }
        let unreadable = |error: std::io::Error| Fault::unreadable(place, format!("{}: {error}", file.display()));
        let real = file.canonicalize().map_err(unreadable)?;
        // A bound that is itself a link is what it leads to; one that is not there bounds nothing.
        if !bound.canonicalize().is_ok_and(|bound| real.starts_with(bound)) {
            let how = format!(": it is a link to {}", real.display());
            return Err(Fault::unsupported(place, self.outside(uri, &how)));
        }
        Ok(file)
    }
}

/// The absolute path without `.` and `..`.
fn normal(path: &Path) -> Option<PathBuf> {
    let mut normal = PathBuf::new();
    for component in
        std::path::absolute(if path.as_os_str().is_empty() { Path::new(".") } else { path }).ok()?.components()
    {
        match component {
            Component::CurDir => {}
            Component::ParentDir => _ = normal.pop(),
            component => normal.push(component),
        }
    }
    Some(normal)
}

/// The deepest folder that holds both; `None` where that is the root of the file system.
fn common(a: &Path, b: &Path) -> Option<PathBuf> {
    let both = a.components().zip(b.components()).take_while(|(a, b)| a == b).map(|(component, _)| component);
    let both: PathBuf = both.collect();
    both.components().any(|c| matches!(c, Component::Normal(_))).then_some(both)
}

/// The bytes that a URI stands for.
pub fn fetch(uri: &str, from: &Place, place: &str) -> Read<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        return decode_data(data).map_err(|message| Fault::invalid(place, message));
    }
    let file = from.file(uri, place)?;
    read_file(&file).map_err(|error| Fault::unreadable(place, format!("{}: {error}", file.display())))
}

/// Tells if a URI has the separators of Windows' paths, which are read as `/`.
pub fn has_backslashes(uri: &str) -> bool {
    !uri.starts_with("data:") && percent_decode_str(uri).any(|byte| byte == b'\\')
}

/// Tells if a URI leads to another machine or program, whose files glTF lets readers leave out.
pub fn is_remote(uri: &str) -> bool {
    !uri.starts_with("data:") && scheme(uri).is_some_and(|scheme| scheme.len() > 1)
}

fn scheme(uri: &str) -> Option<&str> {
    let is_scheme = |s: &&str| {
        s.starts_with(|c: char| c.is_ascii_alphabetic())
            && s.chars().all(|c| c.is_ascii_alphanumeric() || "+.-".contains(c))
    };
    uri.split_once(':').map(|(scheme, _)| scheme).filter(is_scheme)
}

fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (head, body) = data.split_once(',').ok_or("a data URI needs a comma before its data")?;
    let body: Vec<u8> = percent_decode_str(body).collect();
    if head.to_ascii_lowercase().ends_with(";base64") {
        BASE64.decode(body).map_err(|error| format!("base64: {error}"))
    } else {
        Ok(body)
    }
}

/// The path that a URI stands for, wherever it leads to from the model's folder.
fn relative_path(uri: &str, place: &str) -> Read<PathBuf> {
    let absolute = || Fault::unsupported(place, format!("{uri:?} is an absolute path, only relative ones are read"));
    match scheme(uri) {
        Some(letter) if letter.len() == 1 => return Err(absolute()),
        Some(scheme) => {
            let message = format!("{scheme}: URIs are not read, only relative paths and data");
            return Err(Fault::unsupported(place, message));
        }
        None => {}
    }
    let decoded = percent_decode_str(uri).decode_utf8();
    let decoded = decoded.map_err(|_| Fault::invalid(place, format!("{uri:?} does not decode to UTF-8")))?;
    let path = PathBuf::from(decoded.replace('\\', "/"));
    let within = |c: Component| matches!(c, Component::Normal(_) | Component::CurDir | Component::ParentDir);
    if path.components().all(within) { Ok(path) } else { Err(absolute()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_the_folder_that_holds_both() {
        let bound = |model: &str, named_in: Option<&str>| Place::new(Path::new(model), named_in.map(Path::new)).bound;
        for (model, named_in, expected) in [
            ("/a/models/chair.gltf", None, "/a/models"),
            ("/a/models/chair.gltf", Some("/a"), "/a"),
            ("/a/models/chair.gltf", Some("/a/scenes"), "/a"),
            ("/a/scenes/../models/chair.gltf", Some("/a/scenes"), "/a"),
            ("/a/models/chair.gltf", Some("/a/models/deeper"), "/a/models"),
            // Nothing in common but the root.
            ("/tmp/models/chair.gltf", Some("/home/me"), "/tmp/models"),
        ] {
            assert_eq!(bound(model, named_in), Path::new(expected), "{model} {named_in:?}");
        }
    }

    /// No files beyond the bound are read even if only the names of a model's files are wanted.
    #[test]
    fn files_beyond_the_bound_are_not_the_model_s() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir(folder.path().join("models")).expect("a folder");
        for file in ["wood.png", "models/wood.png"] {
            std::fs::write(folder.path().join(file), "wood").expect("a file");
        }
        let model = folder.path().join("models/chair.gltf");
        let found = |named_in: Option<&Path>, uri: &str| Place::new(&model, named_in).local_file(uri).is_some();
        assert!(found(None, "wood.png") && !found(None, "oak.png") && !found(None, "../wood.png"));
        assert!(found(Some(folder.path()), "../wood.png") && !found(Some(folder.path()), "../../wood.png"));
    }

    #[test]
    fn schemes_and_drives_are_told_apart_from_paths() {
        assert!(is_remote("https://example.com/a.png") && is_remote("file:///etc/passwd"));
        assert!(!is_remote("C:/a.png") && !is_remote("a.png") && !is_remote("data:,x"));
        for absolute in ["/etc/passwd", "C:\\a.png", "%2Fetc/passwd", "\\\\server\\a"] {
            assert!(relative_path(absolute, "").unwrap_err().message.contains("absolute"), "{absolute}");
        }
        assert!(has_backslashes("textures\\a.png") && has_backslashes("a%5cb") && !has_backslashes("a/b"));
        assert_eq!(relative_path("textures\\a.png", "").ok().as_deref(), Some(Path::new("textures/a.png")));
    }
}
