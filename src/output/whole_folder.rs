//! Folders that are filled under a temporary name beside their own, renamed when all is in them.

use super::checks::make_folder;
use super::error::{OutputError, check_links};
use std::fs;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Ending of temporary names.
const ENDING: &str = ".part";
/// Digits of the numbers in temporary names.
const DIGITS: usize = 16;
/// Age of untouched folders that are nobody's any more.
const ABANDONED: Duration = Duration::from_hours(24);

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
        if path.exists() && !path.is_dir() {
            return Err(OutputError::NotAFolder { path: path.to_owned(), taken: path.to_owned() });
        }
        // Keys at random: process ids are those of one machine.
        let number = RandomState::new().build_hasher().finish();
        let temporary = beside(path, &format!(".{number:0DIGITS$x}{ENDING}"));
        make_folder(&temporary)?;
        Ok(Self { path: path.to_owned(), temporary })
    }

    /// Folder that is filled.
    pub fn folder(&self) -> &Path {
        &self.temporary
    }

    /// Gives it its name, in place of a folder that has that already. Removes what others left unfinished under it a
    /// day ago.
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
            Err(error) => {
                if is_moved {
                    // What was there before stays there.
                    let _ = fs::rename(&replaced, &self.path);
                }
                return Err(io(error));
            }
            Ok(()) => {}
        }
        // Nobody reads these; another may remove them, too.
        let _ = fs::remove_dir_all(&replaced);
        for abandoned in self.abandoned() {
            let _ = fs::remove_dir_all(abandoned);
        }
        Ok(())
    }

    /// Folders that were begun under this name, by programs that are gone.
    fn abandoned(&self) -> Vec<PathBuf> {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let is_begun = |path: &PathBuf| {
            let own = path.file_name().unwrap_or_default().to_string_lossy();
            let modified = fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
            let age = modified.and_then(|modified| modified.elapsed().ok());
            is_temporary(&own, &name) && age.is_some_and(|age| age > ABANDONED)
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

/// Tells if a folder's name is a temporary one of a name: `07.0123456789abcdef.part`, or that with `.part` once more.
fn is_temporary(own: &str, name: &str) -> bool {
    let rest =
        own.strip_prefix(name).and_then(|rest| rest.strip_prefix('.')).and_then(|rest| rest.strip_suffix(ENDING));
    let number = rest.map(|rest| rest.strip_suffix(ENDING).unwrap_or(rest));
    number.is_some_and(|number| number.len() == DIGITS && number.bytes().all(|digit| digit.is_ascii_hexdigit()))
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
        // One that another program fills at the same time, and what only looks like one.
        let same = WholeFolder::begin(&path).unwrap();
        fs::create_dir(home.path().join("07.old.part")).unwrap();
        let other = WholeFolder::begin(&home.path().join("070")).unwrap();
        for text in ["first", "second"] {
            let whole = WholeFolder::begin(&path).unwrap();
            fs::write(whole.folder().join("a"), text).unwrap();
            whole.finish().unwrap();
            assert_eq!(fs::read_to_string(path.join("a")).unwrap(), text);
            assert_eq!(count(), 4, "it and the others");
        }
        assert!(same.folder().exists() && other.folder().exists());
        fs::write(home.path().join("file"), "mine").unwrap();
        let refused = WholeFolder::begin(&home.path().join("file")).map(|_| ()).unwrap_err();
        assert!(matches!(refused, OutputError::NotAFolder { .. }), "{refused}");
    }

    #[test]
    fn temporary_names_are_those_that_folders_are_begun_under() {
        for own in ["07.0123456789abcdef.part", "07.0123456789abcdef.part.part"] {
            assert!(is_temporary(own, "07"), "{own}");
        }
        for own in ["07.old.part", "07.0123456789abcdef", "070.0123456789abcdef.part", "07.part", "07"] {
            assert!(!is_temporary(own, "07"), "{own}");
        }
    }
}
