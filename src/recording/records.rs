//! The form of recordings and snapshots: a magic number and the version of the form, then blocks.
//!
//! A block is the length of its contents (4 bytes, little-endian), a checksum of that length and of the block's place
//! in the file (4), a checksum of the contents (8), and the contents. A block is written by one call to the system, so
//! a program that is killed leaves whole blocks, or the last one cut short; a block that is all there and does not fit
//! its checksums was damaged.

use super::error::RecordingError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// Format of a file, known by its first eight bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Form {
    /// The first eight bytes.
    pub magic: [u8; 8],
    /// Changes with what the contents of blocks mean.
    pub version: u32,
    /// Name of such a file for people.
    pub name: &'static str,
}

/// A recording.
pub const RECORDING: Form = Form { magic: *b"RELIEFRC", version: 4, name: "recording" };
/// A snapshot.
pub const SNAPSHOT: Form = Form { magic: *b"RELIEFSN", version: 3, name: "snapshot" };

const HEAD: usize = 16;

/// The first bytes of a file.
pub fn prelude(form: Form) -> Vec<u8> {
    [&form.magic[..], &form.version.to_le_bytes()].concat()
}

/// A block with these contents, to stand at `offset`. `None`: longer than a block may be.
pub fn block<T: Serialize>(value: &T, offset: u64) -> Option<Vec<u8>> {
    let contents = postcard::to_extend(value, vec![0; HEAD]).ok()?;
    let (len, sum) = (u32::try_from(contents.len() - HEAD).ok()?, xxh3_64(&contents[HEAD..]));
    let mut block = contents;
    block[..4].copy_from_slice(&len.to_le_bytes());
    block[4..8].copy_from_slice(&head_sum(len, offset).to_le_bytes());
    block[8..HEAD].copy_from_slice(&sum.to_le_bytes());
    Some(block)
}

fn head_sum(len: u32, offset: u64) -> u32 {
    xxh3_64_with_seed(&len.to_le_bytes(), offset) as u32
}

/// A file of blocks, or the bytes of one, to be read.
#[derive(Debug)]
pub struct Blocks<R = File> {
    path: PathBuf,
    file: R,
    len: u64,
    offset: u64,
}

/// Next block of a file, or its end.
pub enum Next<T> {
    /// A block and where it began.
    Block(u64, T),
    /// The file ends within a block.
    Cut,
    /// The file ends after a block.
    End,
}

impl Blocks {
    /// Opens a file and sees whether it is of that form and version.
    ///
    /// # Errors
    /// [`RecordingError::Refused`].
    pub fn open(path: &Path, form: Form) -> Result<Self, RecordingError> {
        let refused = |message: String| RecordingError::refused(path, message);
        let io = |error: std::io::Error| refused(error.to_string());
        let metadata = std::fs::metadata(path).map_err(io)?;
        if !metadata.is_file() {
            return Err(refused(format!("expected a {}, found a directory or device", form.name)));
        }
        Self::of(path, File::open(path).map_err(io)?, metadata.len(), form)
    }
}

impl<R: Read + Seek> Blocks<R> {
    /// Sees whether what is read is of that form and version. `path`: what messages call it.
    ///
    /// # Errors
    /// [`RecordingError::Refused`].
    pub fn of(path: &Path, mut file: R, len: u64, form: Form) -> Result<Self, RecordingError> {
        let refused = |message: String| RecordingError::refused(path, message);
        let mut first = [0; 12];
        let is_long = file.read_exact(&mut first).is_ok();
        if !is_long || first[..8] != form.magic {
            return Err(refused(format!("not a Relief {}", form.name)));
        }
        let version = u32::from_le_bytes([first[8], first[9], first[10], first[11]]);
        if version != form.version {
            let Form { name, version: expected, .. } = form;
            return Err(refused(format!("unsupported {name} version: expected {expected}, found {version}")));
        }
        Ok(Self { path: path.to_owned(), file, len, offset: 12 })
    }

    /// Whose the blocks are.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the block at the place that was reached.
    ///
    /// # Errors
    /// [`RecordingError::Refused`] names the place of a damaged block.
    pub fn next<T: DeserializeOwned>(&mut self) -> Result<Next<T>, RecordingError> {
        let offset = self.offset;
        let left = self.len.saturating_sub(offset);
        if left == 0 {
            return Ok(Next::End);
        }
        if left < HEAD as u64 {
            return Ok(Next::Cut);
        }
        let io = |error: std::io::Error| RecordingError::refused(&self.path, error);
        let damaged = |what: &str| RecordingError::refused(&self.path, format!("corrupt at byte {offset}: {what}"));
        let mut head = [0; HEAD];
        self.file.seek(SeekFrom::Start(offset)).map_err(io)?;
        self.file.read_exact(&mut head).map_err(io)?;
        let word = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        let (len, sum) = (word(0), u64::from(word(8)) | u64::from(word(12)) << 32);
        if word(4) != head_sum(len, offset) {
            return Err(damaged("checksum mismatch of a length"));
        }
        if left - (HEAD as u64) < u64::from(len) {
            return Ok(Next::Cut);
        }
        // No longer than what is left of the file.
        let mut contents = vec![0; len as usize];
        self.file.read_exact(&mut contents).map_err(io)?;
        if xxh3_64(&contents) != sum {
            return Err(damaged("checksum mismatch"));
        }
        let value = match postcard::take_from_bytes(&contents) {
            Ok((value, [])) => value,
            _ => return Err(damaged("invalid contents")),
        };
        self.offset = offset + HEAD as u64 + u64::from(len);
        Ok(Next::Block(offset, value))
    }

    /// Refuses what comes after the last block that there is to be.
    ///
    /// # Errors
    /// [`RecordingError::Refused`] names the place.
    pub fn finish(&self) -> Result<(), RecordingError> {
        if self.offset >= self.len {
            return Ok(());
        }
        let message = format!("corrupt at byte {}: unexpected data after the end", self.offset);
        Err(RecordingError::refused(&self.path, message))
    }

    /// Reads a block that was read before.
    ///
    /// # Errors
    /// [`RecordingError::Refused`], also where the file changed meanwhile.
    pub fn read<T: DeserializeOwned>(&mut self, offset: u64) -> Result<T, RecordingError> {
        self.offset = offset;
        match self.next()? {
            Next::Block(_, value) => Ok(value),
            Next::Cut | Next::End => Err(RecordingError::refused(&self.path, "the file changed while it was read")),
        }
    }
}
