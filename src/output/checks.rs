//! Folders and files, made or checked before work that would be lost.

use super::error::{OutputError, check_links, check_ordinary, in_the_way};
use super::names::{named_folder, real};
use std::fs;
use std::path::Path;

/// Makes a folder with all its parents.
///
/// # Errors
/// [`OutputError::NotAFolder`], [`OutputError::DanglingLink`], [`OutputError::LinkLoop`],
/// [`OutputError::TakesNoFiles`],
/// [`OutputError::Io`].
pub fn make_folder(path: &Path) -> Result<(), OutputError> {
    check_links(path)?;
    fs::create_dir_all(path).map_err(|source| match in_the_way(path) {
        Some(taken) => OutputError::NotAFolder { path: path.to_owned(), taken: taken.to_owned() },
        None => OutputError::of_system(path, source),
    })
}

/// Begins a file that is written as a run goes on. One that has other names, too, as those of an input, stays what it
/// is under these.
///
/// # Errors
/// Errors of the operating system.
pub fn create_anew(path: &Path) -> std::io::Result<fs::File> {
    if has_other_names(path) {
        fs::remove_file(real(path))?;
    }
    fs::File::create(path)
}

#[cfg(unix)]
fn has_other_names(path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    path.metadata().is_ok_and(|found| found.is_file() && found.nlink() > 1)
}

#[cfg(not(unix))]
fn has_other_names(_: &Path) -> bool {
    false
}

/// Checks that files can be written into a folder, before work that would be lost.
///
/// # Errors
/// [`OutputError::TakesNoFiles`], [`OutputError::Io`].
pub fn check_writable(folder: &Path) -> Result<(), OutputError> {
    probe(folder).map_err(|source| OutputError::of_system(folder, source))
}

fn probe(folder: &Path) -> std::io::Result<()> {
    let probe = folder.join(format!(".{}.part", std::process::id()));
    fs::write(&probe, b"").and_then(|()| fs::remove_file(&probe))
}

/// Checks that a file of that name can be written, before work that would be lost.
///
/// # Errors
/// [`OutputError`], but for `Encode`; [`OutputError::Io`]: its folder cannot be written into.
pub fn check_file(path: &Path) -> Result<(), OutputError> {
    check_links(path)?;
    check_ordinary(path)?;
    if path.is_dir() {
        return Err(OutputError::IsAFolder { path: path.to_owned() });
    }
    probe(path.parent().map_or(Path::new("."), named_folder)).map_err(|source| OutputError::io(path, source))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::error::check_folder;
    use crate::output::whole::write_whole;

    #[test]
    fn names_that_cannot_be_written_are_refused_for_what_is_there() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (file, missing) = (folder.path().join("file"), folder.path().join("missing"));
        fs::write(&file, b"x").expect("written");
        let refusal = |done: Result<(), OutputError>| {
            let error = done.expect_err("refused");
            assert!(error.is_refusal(), "{error}");
            error.to_string().replace(&folder.path().display().to_string(), "")
        };
        let no_folder = |path: &str| format!("{path}/file: not a directory");
        assert_eq!(refusal(make_folder(&file)), no_folder(""));
        assert_eq!(refusal(make_folder(&file.join("a/b"))), no_folder("/file/a/b: "));
        assert_eq!(refusal(check_file(&file.join("a/b"))), no_folder("/file/a/b: "));
        assert_eq!(refusal(write_whole(&file.join("a"), b"x")), no_folder("/file/a: "));
        let expected = "/missing/a: no such directory: /missing";
        assert_eq!(refusal(write_whole(&missing.join("a"), b"x")), expected);
        assert_eq!(refusal(check_file(folder.path())), ": is a directory; expected a file name");
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_stay_and_the_systems_own_folders_are_refused() {
        use std::os::unix::fs::FileTypeExt;
        for name in ["/dev/null", "/dev/full"] {
            let path = Path::new(name);
            for done in [check_file(path), write_whole(path, b"x")] {
                let error = done.expect_err("refused");
                assert_eq!(error.to_string(), format!("{name}: not a regular file"));
                assert!(error.is_refusal());
            }
            assert!(path.metadata().is_ok_and(|found| found.file_type().is_char_device()), "it stays what it is");
        }
        let path = Path::new("/proc/x.mp4");
        for done in [check_file(path), write_whole(path, b"x"), make_folder(path)] {
            let error = done.expect_err("refused");
            assert_eq!(error.to_string(), "/proc/x.mp4: files cannot be created in this directory");
            assert!(error.is_refusal());
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_nowhere_are_refused_with_their_target() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let link = |name: &str, target: &str| {
            std::os::unix::fs::symlink(target, folder.path().join(name)).expect("a link");
            folder.path().join(name)
        };
        let (dangling, turning) = (link("disk", "/nonexistent/disk"), link("turning", "turning"));
        let (through_file, sound) = (link("through", "file/below"), link("sound", "."));
        fs::write(folder.path().join("file"), b"x").expect("written");
        let refusal = |done: Result<(), OutputError>| {
            let error = done.expect_err("refused");
            assert!(error.is_refusal(), "{error}");
            error.to_string().replace(&folder.path().display().to_string(), "")
        };
        let nowhere = "/disk: broken symbolic link: /nonexistent/disk does not exist";
        let back = "/turning: circular symbolic link";
        for (attempt, place) in [
            (make_folder as fn(&Path) -> Result<(), OutputError>, ""),
            (check_folder, ""),
            (check_file, ""),
            (|path| write_whole(path, b"x"), ""),
            (|path| make_folder(&path.join("a/b")), "/a/b: "),
            (|path| check_file(&path.join("a")), "/a: "),
            (|path| write_whole(&path.join("a"), b"x"), "/a: "),
        ] {
            let at = |link: &str| if place.is_empty() { String::new() } else { format!("{link}{place}") };
            assert_eq!(refusal(attempt(&dangling)), format!("{}{nowhere}", at("/disk")));
            assert_eq!(refusal(attempt(&turning)), format!("{}{back}", at("/turning")));
        }
        assert!(refusal(make_folder(&through_file)).contains("link: file/below does not exist"));
        assert!(make_folder(&sound.join("new")).is_ok() && write_whole(&sound.join("new/a"), b"x").is_ok());
        assert!(dangling.is_symlink(), "it stays what it is");
    }
}
