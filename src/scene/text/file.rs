//! Files of text: what is read of them, and their problems.

use super::places::Places;
use super::slips::Slip;
use crate::problem::Problem;
use std::fmt;
use std::path::Path;
use systems::describe::Fault;

/// Bytes; a scene of a million written-out entities fits.
const LARGEST_FILE: u64 = 256 << 20;

/// The folder of the project's own scenes, seen from a checkout.
const SHIPPED: &str = "assets/scenes";

/// A hint for who names a scene of the project by its file's name alone.
fn shipped(path: &Path, error: &std::io::Error) -> String {
    let other = Path::new(SHIPPED).join(path.file_name().unwrap_or_default());
    let is_other = error.kind() == std::io::ErrorKind::NotFound && path.file_name().is_some() && other.is_file();
    if is_other { format!("; did you mean {}?", other.display()) } else { String::new() }
}

/// The whole text of a file.
pub fn read_text(path: &Path) -> Result<String, Problem> {
    let metadata = std::fs::metadata(path).map_err(|e| problem(path, None, format!("{e}{}", shipped(path, &e))))?;
    if !metadata.is_file() {
        return Err(problem(path, None, "expected a file"));
    }
    if metadata.len() > LARGEST_FILE {
        let size = metadata.len();
        return Err(problem(path, None, format_args!("file too large: {size} bytes, at most {LARGEST_FILE}")));
    }
    let bytes = std::fs::read(path).map_err(|e| problem(path, None, e))?;
    if [[0xff, 0xfe], [0xfe, 0xff]].iter().any(|mark| bytes.starts_with(mark)) || bytes.iter().take(2).any(|b| *b == 0)
    {
        return Err(problem(path, None, "expected UTF-8 text, found UTF-16; save it as UTF-8"));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let valid = e.utf8_error().valid_up_to();
        problem(path, None, format_args!("invalid UTF-8 at byte {valid}"))
    })?;
    // Some editors put a mark before the text that says that it is UTF-8.
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// A problem of a file.
pub fn problem(path: &Path, line_column: Option<(usize, usize)>, message: impl fmt::Display) -> Problem {
    Problem { line_column, ..Problem::error(path, message) }
}

/// A slip as a problem of its file.
pub fn slip_problem(path: &Path, Slip { line_column, place, message }: Slip) -> Problem {
    Problem { place, ..problem(path, Some(line_column), message) }
}

/// Faults as problems of a file, in the order of its text.
pub fn placed(faults: Vec<Fault>, path: &Path, text: &str) -> Vec<Problem> {
    if faults.is_empty() {
        return Vec::new();
    }
    let places = Places::of(text);
    let at =
        |fault: Fault| Problem { place: fault.place, ..problem(path, Some(places.find(&fault.steps)), fault.message) };
    let mut problems: Vec<Problem> = faults.into_iter().map(at).collect();
    problems.sort_by_key(|problem| problem.line_column);
    problems
}
