//! Lengths and checksums made right again after a file was changed: they would end the reading before it has begun.

use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// The bytes, in three of four cases repaired: which, they say themselves, so that a file is always read the same way.
pub fn mostly(bytes: &[u8], repair: impl Fn(&mut [u8])) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if !xxh3_64(&bytes).is_multiple_of(4) {
        repair(&mut bytes);
    }
    bytes
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk::<4>().map(|word| u32::from_le_bytes(*word))
}

fn put(bytes: &mut [u8], at: usize, word: u32) {
    bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
}

/// A GLB file's length, and lengths of chunks that run past the end.
pub fn glb(bytes: &mut [u8]) {
    if bytes.len() < 20 {
        return;
    }
    let length = bytes.len();
    put(bytes, 8, length as u32);
    let mut at = 12;
    while let Some(size) = word(bytes, at).filter(|_| at + 8 <= length) {
        let size = (size as usize).min(length - at - 8);
        put(bytes, at, size as u32);
        at += 8 + size;
    }
}

/// Lengths of a PNG file's chunks that run past its end, and the checksums of all.
pub fn png(bytes: &mut [u8]) {
    const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
    let mut at = SIGNATURE.len();
    while let Some(size) = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>()).copied() {
        let Some(left) = bytes.len().checked_sub(at + 12) else { return };
        let size = (u32::from_be_bytes(size) as usize).min(left);
        bytes[at..at + 4].copy_from_slice(&(size as u32).to_be_bytes());
        let sum = crc32fast::hash(&bytes[at + 4..at + 8 + size]);
        bytes[at + 8 + size..at + 12 + size].copy_from_slice(&sum.to_be_bytes());
        at += 12 + size;
    }
}

const HEAD: usize = 16;

/// Lengths and checksums of blocks in a recording or snapshot, as `src/recording/records.rs` writes them.
pub fn blocks(bytes: &mut [u8]) {
    let mut at = 12;
    while let Some(len) = word(bytes, at).filter(|_| at + HEAD <= bytes.len()) {
        let len = (len as usize).min(bytes.len() - at - HEAD);
        let sum = xxh3_64(&bytes[at + HEAD..at + HEAD + len]);
        write_head(bytes, at, len as u32, sum);
        at += HEAD + len;
    }
}

/// A block with these contents at the end of a file.
pub fn append_block(file: &mut Vec<u8>, contents: &[u8]) {
    let at = file.len();
    file.extend([0; HEAD]);
    file.extend(contents);
    write_head(file, at, contents.len() as u32, xxh3_64(contents));
}

fn write_head(bytes: &mut [u8], at: usize, len: u32, sum: u64) {
    put(bytes, at, len);
    put(bytes, at + 4, xxh3_64_with_seed(&len.to_le_bytes(), at as u64) as u32);
    bytes[at + 8..at + HEAD].copy_from_slice(&sum.to_le_bytes());
}
