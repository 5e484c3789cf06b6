//! Names of files and folders of a data set.

use crate::data::formats::log::LOG;

/// Sensors of the data set.
pub(crate) const DESCRIPTION: &str = "sensors.json";
/// Hashes of its files.
pub(crate) const MANIFEST: &str = "manifest.json";

/// The files of a whole data set.
pub(crate) const WHOLE: [&str; 3] = [DESCRIPTION, MANIFEST, LOG];

/// Bytes of a part of a sensor's name, which is a folder's.
const LONGEST_NAME: usize = 200;

/// Fault by which a sensor's name cannot be a folder's; `None`: it can.
pub(crate) fn fault_of_name(name: &str) -> Option<&'static str> {
    let is_special = |c: char| c.is_control() || "\\:*?\"<>|".contains(c);
    let mut parts = name.split('/');
    if parts.clone().any(|part| part.is_empty() || part.trim_matches('.').trim().is_empty()) {
        Some("has a part that is empty, or dots alone")
    } else if name.contains(is_special) {
        Some("has a character that no folder has everywhere: a control character or one of \\ : * ? \" < > |")
    } else if parts.any(|part| part.len() > LONGEST_NAME) {
        Some("has a part of more than 200 bytes")
    } else {
        WHOLE.contains(&name).then_some("is that of a file of the data set")
    }
}
