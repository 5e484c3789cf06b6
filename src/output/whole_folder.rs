//! Folders that are filled under a temporary name beside their own, renamed when all is in them.

use super::{OutputError, check_links, make_folder};
use std::fs;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// How temporary names end.
const ENDING: &str = ".part";

/// A folder that is being filled, and has its name once it is [finished](Self::finish). Where it is dropped before, it
/// is removed.
pub struct WholeFolder {
    path: PathBuf,
    temporary: PathBuf,
}

impl WholeFolder {
    /// Begins a folder. Several programs, on several machines, may fill one of the same name.
    ///
    /// # Errors
    /// [`OutputError`], but for `Encode`.
    pub fn begin(path: &Path) -> Result<Self, OutputError> {
        check_links(path)?;
        // Keys at random: process ids are those of one machine.
        let number = RandomState::new().build_hasher().finish();
        let temporary = beside(path, &format!(".{number:016x}{ENDING}"));
        make_folder(&temporary)?;
        Ok(Self { path: path.to_owned(), temporary })
    }

    /// Where it is filled.
    pub fn folder(&self) -> &Path {
        &self.temporary
    }

    /// Gives it its name, in place of a folder that has that already. Removes what others left unfinished under it.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn finish(self) -> Result<(), OutputError> {
        let io = |source| OutputError::io(&self.path, source);
        let replaced = beside(&self.temporary, ENDING);
        let is_moved = match fs::rename(&self.path, &replaced) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(io(error)),
            moved => moved.is_ok(),
        };
        match fs::rename(&self.temporary, &self.path) {
            // Another was faster.
            Err(error) if matches!(error.kind(), ErrorKind::DirectoryNotEmpty | ErrorKind::AlreadyExists) => {}
            renamed => renamed.map_err(io)?,
        }
        if is_moved {
            fs::remove_dir_all(&replaced).map_err(io)?;
        }
        for unfinished in self.unfinished() {
            // Another may remove it, too.
            let _ = fs::remove_dir_all(unfinished);
        }
        Ok(())
    }

    /// Folders that were begun under this name.
    fn unfinished(&self) -> Vec<PathBuf> {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned() + ".";
        let is_begun = |path: &PathBuf| {
            let own = path.file_name().unwrap_or_default().to_string_lossy();
            own.starts_with(&name) && own.ends_with(ENDING)
        };
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).filter(is_begun).collect()
    }
}

impl Drop for WholeFolder {
    fn drop(&mut self) {
        // There is none of that name where it was renamed.
        let _ = fs::remove_dir_all(&self.temporary);
    }
}

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_its_name_when_all_is_in_it() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("07");
        let count = || fs::read_dir(home.path()).unwrap().count();
        let left = WholeFolder::begin(&path).unwrap();
        fs::write(left.folder().join("a"), "half").unwrap();
        assert!(!path.exists());
        drop(left);
        assert_eq!(count(), 0);
        // One whose program was killed.
        std::mem::forget(WholeFolder::begin(&path).unwrap());
        let other = WholeFolder::begin(&home.path().join("070")).unwrap();
        for text in ["first", "second"] {
            let whole = WholeFolder::begin(&path).unwrap();
            fs::write(whole.folder().join("a"), text).unwrap();
            whole.finish().unwrap();
            assert_eq!(fs::read_to_string(path.join("a")).unwrap(), text);
            assert_eq!(count(), 2, "it and the other");
        }
        assert!(other.folder().exists());
    }
}
