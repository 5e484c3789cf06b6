//! Files and folders that are written whole or not at all.

mod hashes;
mod whole;
mod whole_folder;

pub use hashes::{hash_of, hashes_of};
pub use whole::{WholeFile, write_whole, write_whole_with};
pub use whole_folder::WholeFolder;

use std::fs;
use std::path::{Path, PathBuf};

/// An output that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// Reading or writing the directory or the file failed.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The output.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The parent directory does not exist.
    #[error("{}: no such directory: {}", path.display(), folder.display())]
    NoFolder {
        /// The output.
        path: PathBuf,
        /// The missing directory.
        folder: PathBuf,
    },
    /// A directory was expected, found something else.
    #[error("{}{}: not a directory", of(path, taken), taken.display())]
    NotAFolder {
        /// The output.
        path: PathBuf,
        /// The path that is not a directory.
        taken: PathBuf,
    },
    /// The output, or a directory of its path, is a broken symbolic link.
    #[error("{}{}: broken symbolic link: {} does not exist", of(path, link), link.display(), target.display())]
    DanglingLink {
        /// The output.
        path: PathBuf,
        /// The link.
        link: PathBuf,
        /// Its target.
        target: PathBuf,
    },
    /// The output, or a directory of its path, is a circular symbolic link.
    #[error("{}{}: circular symbolic link", of(path, link), link.display())]
    LinkLoop {
        /// The output.
        path: PathBuf,
        /// The link.
        link: PathBuf,
    },
    /// A file name was expected, found a directory.
    #[error("{}: is a directory; expected a file name", path.display())]
    IsAFolder {
        /// The output.
        path: PathBuf,
    },
    /// The output is a device or a pipe, over which no file is renamed.
    #[error("{}: not a regular file", path.display())]
    NotAFile {
        /// The output.
        path: PathBuf,
    },
    /// The directory exists, but files cannot be created in it, as in `/proc`.
    #[error("{}: files cannot be created in this directory", path.display())]
    TakesNoFiles {
        /// The output.
        path: PathBuf,
    },
    /// The picture could not be encoded.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// The output.
        path: PathBuf,
        /// What the encoder says.
        source: image::ImageError,
    },
}

/// A path and a colon, unless what follows is the path.
fn of(path: &Path, what: &Path) -> String {
    if path == what { String::new() } else { format!("{}: ", path.display()) }
}

impl OutputError {
    /// What the operating system says of a file that was to be written.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        check_folder(path).err().unwrap_or_else(|| Self::of_system(path, source))
    }

    /// The same where the folder is known to be there: one that nothing is found in even as it is made takes no files.
    fn of_system(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            std::io::ErrorKind::NotFound => Self::TakesNoFiles { path },
            _ => Self::Io { path, source },
        }
    }

    /// Whether the name was refused before writing; else writing failed.
    pub fn is_refusal(&self) -> bool {
        !matches!(self, Self::Io { .. } | Self::Encode { .. })
    }
}

/// Begins a file that is written as a run goes on. One that has other names, too, as those of an input, stays what it
/// is under these.
///
/// # Errors
/// What the operating system says.
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

/// Encodes a picture as PNG and writes it whole.
///
/// # Errors
/// [`OutputError`].
pub fn write_png(path: &Path, picture: &image::DynamicImage) -> Result<(), OutputError> {
    let bytes = encode_png(picture).map_err(|source| OutputError::Encode { path: path.to_owned(), source })?;
    write_whole(path, &bytes)
}

/// A picture as the bytes of a PNG file.
///
/// # Errors
/// What PNG has no form for.
pub fn encode_png(picture: &image::DynamicImage) -> image::ImageResult<Vec<u8>> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    picture.write_with_encoder(encoder)?;
    Ok(bytes)
}

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

/// Whether the folder of a file is there; one that cannot be reached counts as there.
///
/// # Errors
/// [`OutputError::NoFolder`], [`OutputError::NotAFolder`], [`OutputError::DanglingLink`], [`OutputError::LinkLoop`].
pub fn check_folder(path: &Path) -> Result<(), OutputError> {
    check_links(path)?;
    let Some(folder) = path.parent().map(named_folder) else { return Ok(()) };
    if let Some(taken) = in_the_way(folder) {
        return Err(OutputError::NotAFolder { path: path.to_owned(), taken: taken.to_owned() });
    }
    match folder.try_exists() {
        Ok(false) => Err(OutputError::NoFolder { path: path.to_owned(), folder: folder.to_owned() }),
        _ => Ok(()),
    }
}

/// Whether a file that is renamed to that name takes the place of nothing else.
fn check_ordinary(path: &Path) -> Result<(), OutputError> {
    let is_other = path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir());
    if is_other { Err(OutputError::NotAFile { path: path.to_owned() }) } else { Ok(()) }
}

/// Whether neither a path nor a folder of it is a link that leads nowhere: such a path is neither there nor free.
///
/// # Errors
/// [`OutputError::DanglingLink`], [`OutputError::LinkLoop`].
fn check_links(path: &Path) -> Result<(), OutputError> {
    use std::io::ErrorKind::{NotADirectory, NotFound, PermissionDenied};
    let Some(link) = path.ancestors().find(|above| above.symlink_metadata().is_ok()) else { return Ok(()) };
    let (Ok(target), Err(error)) = (link.read_link(), link.metadata()) else { return Ok(()) };
    let (path, link) = (path.to_owned(), link.to_owned());
    match error.kind() {
        // Where it leads cannot be seen; what cannot be written is told when it is tried.
        PermissionDenied => Ok(()),
        NotFound | NotADirectory => Err(OutputError::DanglingLink { path, link, target }),
        _ => Err(OutputError::LinkLoop { path, link }),
    }
}

/// What is there in place of a folder, or of one of its parents.
fn in_the_way(folder: &Path) -> Option<&Path> {
    folder.ancestors().find(|above| above.exists()).filter(|above| !above.is_dir())
}

/// Whether files can be written into a folder, before work that would be lost.
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

/// Whether a file of that name can be written, before work that would be lost.
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

/// The one path that stands for all names of a file, whether it is there or not.
pub fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) => real(named_folder(folder)).join(name),
        _ => path.to_owned(),
    })
}

/// Whether two names are those of one file.
pub fn is_same(a: &Path, b: &Path) -> bool {
    real(a) == real(b)
}

/// The parent of a bare file name is empty.
fn named_folder(parent: &Path) -> &Path {
    if parent.as_os_str().is_empty() { Path::new(".") } else { parent }
}

#[cfg(test)]
mod tests {
    use super::*;

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
