//! Results that took long to work out, kept on disk under the hash of what they were worked out from.
//!
//! A folder of files, `HASH.bin`, each with a hash of its own contents before them: one that is damaged, or of another
//! version, counts as absent and is written anew. Nothing here is an error, for everything can be worked out again. A
//! file that is used becomes the newest; when the folder is larger than its bound, the oldest go.

use crate::output;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::SystemTime;

/// Bytes that the folder may take.
pub const MOST_BYTES: u64 = 2 << 30;

/// The environment variable that names another folder.
pub const FOLDER_VARIABLE: &str = "RELIEF_CACHE_DIR";

/// Hash of the inputs of a result.
pub type Key = blake3::Hash;

/// A folder of results.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    most_bytes: u64,
    hits: AtomicUsize,
    written: AtomicUsize,
}

impl Cache {
    /// The user's: the folder that `RELIEF_CACHE_DIR` names, else `relief` in the platform's folder for caches. `None`
    /// where there is neither.
    pub fn of_user() -> Option<Self> {
        let named = std::env::var_os(FOLDER_VARIABLE).filter(|folder| !folder.is_empty()).map(PathBuf::from);
        let folder = named.or_else(|| Some(dirs::cache_dir()?.join("relief")))?;
        Some(Self::new(folder, MOST_BYTES))
    }

    /// A folder, made when something is written, and how many bytes it may take.
    pub fn new(folder: PathBuf, most_bytes: u64) -> Self {
        Self { folder, most_bytes, hits: AtomicUsize::new(0), written: AtomicUsize::new(0) }
    }

    /// Numbers of results that were found, and written.
    pub fn counts(&self) -> (usize, usize) {
        (self.hits.load(Relaxed), self.written.load(Relaxed))
    }

    /// Reads the contents kept under a key through `accept`; `None` where there are none, or none that are sound.
    pub fn read<T>(&self, key: &Key, accept: impl FnOnce(&[u8]) -> Option<T>) -> Option<T> {
        let path = self.path(key);
        let bytes = std::fs::read(&path).ok()?;
        let (hash, contents) = bytes.split_at_checked(blake3::OUT_LEN)?;
        if blake3::hash(contents).as_bytes() != hash {
            return None;
        }
        let accepted = accept(contents)?;
        // Used now: the last to go. Where that cannot be said, it goes earlier.
        let _ = std::fs::File::options().write(true).open(&path).and_then(|file| file.set_modified(SystemTime::now()));
        self.hits.fetch_add(1, Relaxed);
        Some(accepted)
    }

    /// Keeps contents under a key. Where they cannot be written, they are not kept.
    pub fn write(&self, key: &Key, contents: &[u8]) {
        let mut bytes = blake3::hash(contents).as_bytes().to_vec();
        bytes.extend_from_slice(contents);
        let written = output::make_folder(&self.folder).and_then(|()| output::write_whole(&self.path(key), &bytes));
        match written {
            Ok(()) => _ = self.written.fetch_add(1, Relaxed),
            Err(error) => tracing::debug!("not cached: {error}"),
        }
    }

    /// Removes the oldest files until the rest is within the bound.
    pub fn trim(&self) {
        let Ok(entries) = std::fs::read_dir(&self.folder) else { return };
        let mut files: Vec<(SystemTime, PathBuf, u64)> = entries
            .flatten()
            .filter(|entry| is_ours(&entry.path()))
            .filter_map(|entry| {
                let data = entry.metadata().ok()?;
                Some((data.modified().ok()?, entry.path(), data.len()))
            })
            .collect();
        files.sort();
        let mut total: u64 = files.iter().map(|(_, _, bytes)| bytes).sum();
        for (_, path, bytes) in files {
            if total <= self.most_bytes {
                break;
            }
            if std::fs::remove_file(path).is_ok() {
                total -= bytes;
            }
        }
    }

    fn path(&self, key: &Key) -> PathBuf {
        self.folder.join(format!("{}.bin", key.to_hex()))
    }
}

/// Whatever else lies in the folder is left alone, but for what an interrupted run has not finished.
fn is_ours(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let is_hash = |stem: &str| stem.len() == 64 && stem.bytes().all(|b| b.is_ascii_hexdigit());
    name.split_once('.').is_some_and(|(stem, rest)| is_hash(stem) && (rest == "bin" || rest.ends_with(".part")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn read(cache: &Cache, key: &Key) -> Option<Vec<u8>> {
        cache.read(key, |bytes| Some(bytes.to_vec()))
    }

    #[test]
    fn what_was_written_is_read_and_what_is_damaged_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path().join("a/b"), 1 << 20);
        let key = blake3::hash(b"made from");
        assert_eq!(read(&cache, &key), None);
        cache.write(&key, b"result");
        assert_eq!(read(&cache, &key).as_deref(), Some(&b"result"[..]));
        assert_eq!(read(&cache, &blake3::hash(b"other")), None);
        assert_eq!(cache.counts(), (1, 1));
        let whole = std::fs::read(cache.path(&key)).unwrap();
        for damaged in [&whole[..whole.len() - 1], &whole[..5], &[], &[&whole[..], b"x"].concat()[..]] {
            std::fs::write(cache.path(&key), damaged).unwrap();
            assert_eq!(read(&cache, &key), None);
        }
        let mut flipped = whole;
        *flipped.last_mut().unwrap() ^= 1;
        std::fs::write(cache.path(&key), flipped).unwrap();
        assert_eq!(read(&cache, &key), None);
        cache.write(&key, b"result");
        assert_eq!(read(&cache, &key).as_deref(), Some(&b"result"[..]));
    }

    #[test]
    fn the_oldest_go_first_and_other_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path().to_owned(), 3 * (100 + 32));
        let keys: Vec<Key> = (0u8..5).map(|i| blake3::hash(&[i])).collect();
        std::fs::write(folder.path().join("notes.txt"), [0; 10_000]).unwrap();
        for (i, key) in keys.iter().enumerate() {
            cache.write(key, &[i as u8; 100]);
            let file = std::fs::File::options().write(true).open(cache.path(key)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(1000 - i as u64)).unwrap();
        }
        // Used: now the newest.
        assert!(read(&cache, &keys[0]).is_some());
        cache.trim();
        let left: Vec<bool> = keys.iter().map(|key| cache.path(key).exists()).collect();
        assert_eq!(left, [true, false, false, true, true]);
        assert!(folder.path().join("notes.txt").exists());
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_no_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let cache = Cache::new(file.path().join("below a file"), 100);
        cache.write(&blake3::hash(b"a"), b"b");
        cache.trim();
        assert_eq!((read(&cache, &blake3::hash(b"a")), cache.counts()), (None, (0, 0)));
    }
}
