//! What a URI in a glTF file names: bytes within it, or a file in the same folder or below.

use super::report::{Fault, Read};
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

/// The bytes that a URI stands for.
pub fn fetch(uri: &str, folder: &Path, place: &str) -> Read<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        return decode_data(data).map_err(|message| Fault::invalid(place, message));
    }
    let file = folder.join(relative_path(uri, place)?);
    read_file(&file).map_err(|error| Fault::unreadable(place, format!("{}: {error}", file.display())))
}

/// The file that a URI names relative to the model, if it names one.
pub fn local_path(uri: &str) -> Option<PathBuf> {
    if uri.starts_with("data:") { None } else { relative_path(uri, "").ok() }
}

/// Reads a regular file; a pipe or a device might never end.
pub fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    if std::fs::metadata(path)?.is_file() {
        return std::fs::read(path);
    }
    Err(std::io::Error::other("not a regular file"))
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

/// A model may come from anywhere, so it does not choose files outside its own folder.
fn relative_path(uri: &str, place: &str) -> Read<PathBuf> {
    let scheme = uri.split_once(':').map(|(scheme, _)| scheme);
    let is_scheme = |s: &str| {
        s.starts_with(|c: char| c.is_ascii_alphabetic())
            && s.chars().all(|c| c.is_ascii_alphanumeric() || "+.-".contains(c))
    };
    if let Some(scheme) = scheme.filter(|s| is_scheme(s)) {
        return Err(Fault::unsupported(place, format!("{scheme}: URIs are not read, only relative paths and data")));
    }
    let decoded = percent_decode_str(uri).decode_utf8();
    let decoded = decoded.map_err(|_| Fault::invalid(place, format!("{uri:?} does not decode to UTF-8")))?;
    let path = PathBuf::from(decoded.replace('\\', "/"));
    let mut depth = 0i32;
    for component in path.components() {
        depth += match component {
            Component::Normal(_) => 1,
            Component::CurDir => 0,
            Component::ParentDir => -1,
            Component::Prefix(_) | Component::RootDir => i32::MIN / 2,
        };
        if depth < 0 {
            return Err(Fault::unsupported(place, format!("{uri:?} leads outside the model's folder")));
        }
    }
    Ok(path)
}
