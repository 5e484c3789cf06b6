//! The outermost layer: a `.gltf` file is JSON, a `.glb` file is JSON and a binary chunk.
//!
//! Not by `gltf::binary::Glb`: that panics on a length below the header's, does not skip unknown chunks as the
//! specification asks, and its errors say no place.

use crate::import::gltf::report::{Fault, Read, Report};
use serde_json::Value;

const GLB_MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;

/// Memory of an object with a member and of another value, once parsed.
const OBJECT_BYTES: usize = 700;
const VALUE_BYTES: usize = size_of::<Value>();
/// Memory that any JSON may take, and more per byte of it: honest JSON has numbers and names, and stays far below.
const FREE_BYTES: usize = 256 << 20;
const BYTES_PER_BYTE: usize = 12;

/// The JSON document and the GLB's binary chunk.
pub fn open(bytes: Vec<u8>, report: &mut Report) -> Read<(Value, Option<Vec<u8>>)> {
    if bytes.starts_with(GLB_MAGIC) {
        let (json, bin) = chunks(&bytes, report)?;
        Ok((parse(json, report)?, bin.map(<[u8]>::to_vec)))
    } else {
        Ok((parse(&bytes, report)?, None))
    }
}

fn parse(json: &[u8], report: &mut Report) -> Read<Value> {
    let text = json.strip_prefix(b"\xEF\xBB\xBF");
    if text.is_some() {
        // As readers may (RFC 8259, section 8.1).
        report.warn("JSON", "begins with a byte order mark, which glTF does not allow: ignored");
    }
    let json = text.unwrap_or(json);
    // The least memory that parsing takes; braces within strings count too, but are few.
    let count = |byte: u8| json.iter().filter(|&&b| b == byte).count();
    let (objects, values) = (count(b'{'), count(b'[') + count(b','));
    let memory = objects.saturating_mul(OBJECT_BYTES).saturating_add(values.saturating_mul(VALUE_BYTES));
    if memory > FREE_BYTES.saturating_add(json.len().saturating_mul(BYTES_PER_BYTE)) {
        let message = format!("{objects} objects and {values} values: too many for the length of the text");
        return Err(Fault::unsupported("JSON", message));
    }
    serde_json::from_slice(json).map_err(|error| {
        let message = error.to_string();
        let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(message, _)| message);
        Fault::invalid(format!("JSON line {} column {}", error.line(), error.column()), message)
    })
}

fn word(bytes: &[u8], offset: usize) -> Read<u32> {
    let word = bytes.get(offset..).and_then(|rest| rest.first_chunk::<4>());
    word.map(|w| u32::from_le_bytes(*w))
        .ok_or_else(|| Fault::invalid(format!("byte {offset}"), "unexpected end of file"))
}

fn chunks<'a>(bytes: &'a [u8], report: &mut Report) -> Read<(&'a [u8], Option<&'a [u8]>)> {
    let version = word(bytes, 4)?;
    if version != 2 {
        return Err(Fault::unsupported("byte 4", format!("GLB version {version}; only version 2 is read")));
    }
    let length = word(bytes, 8)? as usize;
    if length > bytes.len() {
        let message = format!("the header states {length} bytes, the file has {}", bytes.len());
        return Err(Fault::invalid("byte 8", message));
    }
    if length < bytes.len() {
        report.warn("byte 8", format!("{} bytes follow the end that the header gives", bytes.len() - length));
    }
    let (mut json, mut bin) = (None, None);
    let (mut offset, mut number) = (12, 0);
    while offset < length {
        let (size, kind) = (word(bytes, offset)? as usize, word(bytes, offset + 4)?);
        let place = format!("byte {offset}");
        let end = (offset + 8).checked_add(size).filter(|&end| end <= length);
        let end = end.ok_or_else(|| Fault::invalid(&*place, format!("a chunk of {size} bytes runs past the end")))?;
        let chunk = &bytes[offset + 8..end];
        if !size.is_multiple_of(4) {
            report.warn(&*place, format!("a chunk's length must be a multiple of 4, found {size}"));
        }
        match (number, kind) {
            (0, JSON_CHUNK) => json = Some(chunk),
            (0, _) => return Err(Fault::invalid(place, "the first chunk must be JSON")),
            (1, BIN_CHUNK) => bin = Some(chunk),
            (_, JSON_CHUNK) => return Err(Fault::invalid(place, "a second JSON chunk")),
            (_, BIN_CHUNK) => return Err(Fault::invalid(place, "a binary chunk must be the second chunk")),
            _ => report.warn(place, format!("ignored: a chunk of unknown type 0x{kind:08x}")),
        }
        (offset, number) = (end, number + 1);
    }
    Ok((json.ok_or_else(|| Fault::invalid("byte 12", "expected a JSON chunk"))?, bin))
}
