//! Files under temporary names beside their own, renamed when they are whole.

use super::error::{OutputError, check_links, check_ordinary};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Writes a file under a temporary name beside it, then renames: what has the name is the whole file.
///
/// # Errors
/// [`OutputError::NoFolder`], [`OutputError::Io`]; the temporary file is removed.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_whole_with(path, |file| file.write_all(bytes))
}

/// [`write_whole`] for what is written bit by bit.
///
/// # Errors
/// [`OutputError`], but for `Encode`; the temporary file is removed.
pub fn write_whole_with(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> Result<(), OutputError> {
    let mut whole = WholeFile::begin(path)?;
    write(&mut whole.file).map_err(|source| OutputError::io(path, source))?;
    whole.finish()
}

/// A file that is written as a run goes on, and has its name once it is [finished](Self::finish). Where it is dropped
/// before, it is removed.
pub struct WholeFile {
    path: PathBuf,
    temporary: PathBuf,
    file: File,
}

impl WholeFile {
    /// Begins a file.
    ///
    /// # Errors
    /// [`OutputError`], but for `Encode`.
    pub fn begin(path: &Path) -> Result<Self, OutputError> {
        check_links(path)?;
        check_ordinary(path)?;
        // Of this file alone: several threads may write files of one name.
        static CALLS: AtomicUsize = AtomicUsize::new(0);
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{}.{}.part", std::process::id(), CALLS.fetch_add(1, Relaxed)));
        let temporary = path.with_file_name(name);
        let file = File::create(&temporary).map_err(|source| OutputError::io(path, source))?;
        Ok(Self { path: path.to_owned(), temporary, file })
    }

    /// Gives it its name.
    ///
    /// # Errors
    /// [`OutputError`], but for `Encode`; the temporary file is removed.
    pub fn finish(self) -> Result<(), OutputError> {
        fs::rename(&self.temporary, &self.path).map_err(|source| OutputError::io(&self.path, source))
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        // There is none of that name where it was renamed.
        let _ = fs::remove_file(&self.temporary);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_may_write_the_same_file_and_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::thread::scope(|scope| {
            for byte in 0..8 {
                let path = &path;
                scope.spawn(move || (0..20).for_each(|_| write_whole(path, &vec![byte; 1 << 18]).unwrap()));
            }
        });
        let written = fs::read(&path).unwrap();
        assert!(written.len() == 1 << 18 && written.iter().all(|byte| *byte == written[0]));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_has_its_name_when_it_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "before").unwrap();
        let names = || fs::read_dir(folder.path()).unwrap().count();
        let mut left = WholeFile::begin(&path).unwrap();
        left.write_all(b"half").unwrap();
        assert_eq!((names(), fs::read(&path).unwrap()), (2, b"before".to_vec()));
        drop(left);
        assert_eq!((names(), fs::read(&path).unwrap()), (1, b"before".to_vec()));
        let mut whole = WholeFile::begin(&path).unwrap();
        whole.write_all(b"whole").unwrap();
        whole.finish().unwrap();
        assert_eq!((names(), fs::read(&path).unwrap()), (1, b"whole".to_vec()));
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).expect("a folder");
        fs::write(taken.join("inside"), b"x").expect("a file");
        assert!(write_whole(&taken, b"data").is_err(), "a folder cannot be replaced by a file");
        let names: Vec<_> = fs::read_dir(folder.path()).expect("readable").flatten().map(|e| e.file_name()).collect();
        assert_eq!(names, ["taken"]);
    }
}
