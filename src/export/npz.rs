//! NPZ, many arrays of numpy in a file: a ZIP archive with an NPY file for each, stored as it is (PKWARE,
//! "APPNOTE.TXT", 4.3). All have the first time that such an archive knows, so that equal arrays give equal files.

use super::checks::unfit;
use std::io::{Result, Write};

/// Version 2.0 of the form (4.4.3), which stored files need.
const VERSION: u16 = 20;
/// Names are UTF-8 (4.4.4, bit 11).
const FLAGS: u16 = 1 << 11;
/// 1 January 1980, 0:00 (4.4.6): time, then year since 1980, month and day in 7, 4 and 5 bits.
const TIME: [u16; 2] = [0, (1 << 5) | 1];

/// Writes an archive of arrays, each with a name without `.npy` and as [`super::npy`] encodes it.
///
/// # Errors
/// Two with the same name; more than 65,535 of them, or 4 GiB, which would need ZIP64; what writing failed with.
pub fn write(mut to: impl Write, arrays: &[(&str, &[u8])]) -> Result<()> {
    let mut directory = Vec::new();
    let mut offset = 0;
    for (place, (name, bytes)) in arrays.iter().enumerate() {
        if arrays[..place].iter().any(|(before, _)| before == name) {
            return Err(unfit(format!("NPZ: two arrays are named \"{name}\"")));
        }
        let file_name = format!("{name}.npy");
        let common = describe(&file_name, bytes)?;
        let local = [b"PK\x03\x04", &common[..], file_name.as_bytes()].concat();
        directory.extend(b"PK\x01\x02");
        directory.extend(VERSION.to_le_bytes());
        directory.extend(&common);
        // No comment, in the first part, no attributes (4.3.12).
        directory.extend([0; 10]);
        directory.extend(size_in_4(offset)?);
        directory.extend(file_name.as_bytes());
        to.write_all(&local)?;
        to.write_all(bytes)?;
        offset += local.len() + bytes.len();
    }
    let count = u16::try_from(arrays.len()).map_err(|_| unfit("NPZ: more than 65,535 arrays"))?.to_le_bytes();
    let (at, length) = (size_in_4(offset)?, size_in_4(directory.len())?);
    to.write_all(&directory)?;
    to.write_all(&[b"PK\x05\x06\0\0\0\0", &count[..], &count, &length, &at, &[0; 2]].concat())
}

/// Fields that the header of a file and its entry in the directory share (4.3.7): versions to lengths.
fn describe(file_name: &str, bytes: &[u8]) -> Result<Vec<u8>> {
    let size = size_in_4(bytes.len())?;
    let length = u16::try_from(file_name.len()).map_err(|_| unfit("NPZ: a name of more than 65,535 bytes"))?;
    let mut common: Vec<u8> = [VERSION, FLAGS, 0, TIME[0], TIME[1]].into_iter().flat_map(u16::to_le_bytes).collect();
    common.extend(crc32fast::hash(bytes).to_le_bytes());
    common.extend([size, size].concat());
    common.extend([length, 0].into_iter().flat_map(u16::to_le_bytes));
    Ok(common)
}

fn size_in_4(bytes: usize) -> Result<[u8; 4]> {
    // The largest number stands for one that is elsewhere (4.4.1.4).
    let size = u32::try_from(bytes).ok().filter(|size| *size < u32::MAX);
    size.map(u32::to_le_bytes).ok_or_else(|| unfit("NPZ: more than 4 GiB in a file; write fewer arrays into each"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_of_one_file_is_known_byte_by_byte() {
        let mut bytes = Vec::new();
        write(&mut bytes, &[("a", b"123456789")]).unwrap();
        // The check value of CRC-32: 0xCBF43926.
        let common = b"\x14\0\0\x08\0\0\0\0\x21\0\x26\x39\xf4\xcb\x09\0\0\0\x09\0\0\0\x05\0\0\0";
        let local = [b"PK\x03\x04", &common[..], b"a.npy123456789"].concat();
        let entry = [b"PK\x01\x02\x14\0", &common[..], &[0; 14], b"a.npy"].concat();
        let end = b"PK\x05\x06\0\0\0\0\x01\0\x01\0\x33\0\0\0\x2c\0\0\0\0\0";
        assert_eq!((local.len(), entry.len()), (0x2c, 0x33));
        assert_eq!(bytes, [&local[..], &entry, end].concat());
    }

    #[test]
    fn what_has_no_place_is_refused() {
        let refusal = |arrays: &[(&str, &[u8])]| write(Vec::new(), arrays).unwrap_err().to_string();
        assert_eq!(refusal(&[("a", b""), ("a", b"")]), "NPZ: two arrays are named \"a\"");
        assert!(refusal(&[(&"a".repeat(70_000), b"")]).contains("65,535 bytes"));
        assert!(size_in_4(u32::MAX as usize).is_err() && size_in_4(u32::MAX as usize - 1).is_ok());
    }
}
