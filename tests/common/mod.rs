//! What several tests share.

use std::path::PathBuf;

/// Whether a missing adapter or missing test data fails a test rather than skipping it.
#[allow(dead_code)]
pub fn strict() -> bool {
    std::env::var_os("RELIEF_STRICT").is_some_and(|v| v != "0")
}

/// The folder of test data: `RELIEF_TEST_DATA`, or `../shared/data` beside the project. `None`, said aloud, where there
/// is none.
///
/// # Panics
/// In strict mode, where there is none.
#[allow(dead_code)]
pub fn test_data() -> Option<PathBuf> {
    let folder = std::env::var_os("RELIEF_TEST_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(!strict(), "no test data at {}", folder.display());
    eprintln!("skipped: no test data");
    None
}

/// An open device; `None`, said aloud, where there is no adapter.
///
/// # Panics
/// In strict mode, where there is none.
#[allow(dead_code)]
pub fn gpu() -> Option<relief::renderer::Gpu> {
    match relief::renderer::Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            assert!(!strict(), "{error}");
            eprintln!("skipped: no graphics adapter");
            None
        }
    }
}

/// Bump techniques.
#[allow(dead_code)]
pub mod bumps;
