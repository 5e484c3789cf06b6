//! The JSON with what its buffers hold: everything the other readers read from.

use super::report::{Fault, FaultKind, Read, Report};
use super::shape::{declared, whole};
use super::uri;
use glam::{Vec2, Vec3, Vec4};
use serde_json::Value;
use std::cell::{Cell, OnceCell};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Bytes of decoded elements that any file may make, however small.
const FREE_BYTES: usize = 32 << 20;
/// Decoded bytes per byte of file and buffers, beyond that: honest files stay far below, and a small file that names
/// the same bytes again and again cannot fill the memory.
const BYTES_PER_BYTE: usize = 100;

/// A glTF document that has passed the schema.
pub struct Document {
    pub root: Value,
    folder: PathBuf,
    bin: Option<Vec<u8>>,
    /// Read when first needed: a faulty buffer that nothing uses does no harm.
    buffers: Vec<OnceCell<Read<Vec<u8>>>>,
    budget: Cell<usize>,
    /// Whether KHR_mesh_quantization widens the allowed vertex formats.
    pub quantized: bool,
    first_images: Vec<usize>,
}

impl Document {
    pub fn new(root: Value, folder: PathBuf, bin: Option<Vec<u8>>, file_bytes: usize) -> Self {
        let count = root["buffers"].as_array().map_or(0, Vec::len);
        let budget = Cell::new(FREE_BYTES.saturating_add(file_bytes.saturating_mul(BYTES_PER_BYTE)));
        let mut first = BTreeMap::new();
        let images = items(&root["images"]).iter().enumerate();
        let first_images =
            images.map(|(id, i)| *first.entry((i["uri"].as_str(), id_of(i, "bufferView"))).or_insert(id)).collect();
        let quantized = declared(&root, "extensionsUsed", "KHR_mesh_quantization");
        Self { root, folder, bin, buffers: vec![OnceCell::new(); count], budget, quantized, first_images }
    }

    /// A root array; empty where there is none.
    pub fn array(&self, name: &str) -> &[Value] {
        items(&self.root[name])
    }

    /// Takes decoded bytes from what this file may make.
    pub fn spend(&self, bytes: usize, place: &str) -> Read<()> {
        let left = self.budget.get().checked_sub(bytes);
        self.budget.set(left.ok_or_else(|| Fault::unsupported(place, "far more elements than the file has data for"))?);
        Ok(())
    }

    /// The bytes of a buffer, at least as many as its `byteLength`.
    pub fn buffer(&self, id: usize) -> Read<&[u8]> {
        let place = format!("buffers[{id}]");
        let Some(cell) = self.buffers.get(id) else { return Err(Fault::invalid(place, "does not exist")) };
        let mut first = false;
        let read = cell.get_or_init(|| {
            first = true;
            self.read_buffer(id, &place)
        });
        let bytes = read.as_ref().map_err(Fault::clone)?;
        if first {
            self.budget.set(self.budget.get().saturating_add(bytes.len().saturating_mul(BYTES_PER_BYTE)));
        }
        Ok(bytes)
    }

    fn read_buffer(&self, id: usize, place: &str) -> Read<Vec<u8>> {
        let buffer = &self.root["buffers"][id];
        let bytes = match (buffer["uri"].as_str(), &self.bin) {
            (Some(uri), _) => uri::fetch(uri, &self.folder, &format!("{place}.uri"))?,
            (None, Some(bin)) if id == 0 => bin.clone(),
            (None, _) => {
                let fault = Fault::invalid(place, "has neither uri nor binary chunk: what needs it is left out");
                return Err(Fault { kind: FaultKind::NoData, ..fault });
            }
        };
        let length = uint(buffer, "byteLength");
        if bytes.len() < length {
            let message = format!("{length} bytes promised, {} found", bytes.len());
            return Err(Fault::invalid(format!("{place}.byteLength"), message));
        }
        Ok(bytes)
    }

    /// Reads what no view uses, so that its faults are at least named.
    pub fn check_unused_buffers(&self, report: &mut Report) {
        for id in 0..self.buffers.len() {
            if self.buffers[id].get().is_none()
                && let Err(fault) = self.buffer(id)
            {
                report.fault(false, fault);
            }
        }
    }

    /// The bytes of a buffer view.
    pub fn view(&self, id: usize) -> Read<&[u8]> {
        let view = &self.root["bufferViews"][id];
        let buffer_id = uint(view, "buffer");
        let buffer = self.buffer(buffer_id)?;
        let (offset, length) = (uint(view, "byteOffset"), uint(view, "byteLength"));
        let limit = uint(&self.root["buffers"][buffer_id], "byteLength").min(buffer.len());
        let end = offset.checked_add(length).filter(|&end| end <= limit);
        end.and_then(|end| buffer.get(offset..end)).ok_or_else(|| {
            let message = format!("bytes {offset}+{length} run past buffers[{buffer_id}], which has {limit}");
            Fault::invalid(format!("bufferViews[{id}].byteLength"), message)
        })
    }

    /// The first image that names the same bytes: some exporters list an image once for every texture.
    pub fn first_alike(&self, image: usize) -> usize {
        self.first_images.get(image).copied().unwrap_or(image)
    }

    /// The bytes of an image, still encoded.
    pub fn image_bytes(&self, id: usize) -> Read<Vec<u8>> {
        let image = &self.root["images"][id];
        let place = format!("images[{id}]");
        match (image["uri"].as_str(), id_of(image, "bufferView")) {
            (Some(uri), None) => uri::fetch(uri, &self.folder, &format!("{place}.uri")),
            (None, Some(view)) => {
                let bytes = self.view(view)?;
                self.spend(bytes.len(), &place)?;
                Ok(bytes.to_vec())
            }
            _ => Err(Fault::invalid(place, "expected either uri or bufferView")),
        }
    }
}

/// The elements of an array; none where it is none.
pub fn items(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// An index; the schema has checked that it is in range.
pub fn id_of(value: &Value, key: &str) -> Option<usize> {
    whole(&value[key]).and_then(|id| usize::try_from(id).ok())
}

/// A whole number, 0 where it is missing.
pub fn uint(value: &Value, key: &str) -> usize {
    id_of(value, key).unwrap_or(0)
}

/// A number or the given default.
pub fn real(value: &Value, key: &str, default: f32) -> f32 {
    value[key].as_f64().map_or(default, |f| f as f32)
}

/// So many numbers, if they are there.
pub fn reals<const N: usize>(value: &Value, key: &str) -> Option<[f32; N]> {
    let array = value[key].as_array().filter(|a| a.len() == N)?;
    let mut numbers = [0.0; N];
    for (number, value) in numbers.iter_mut().zip(array) {
        *number = value.as_f64()? as f32;
    }
    Some(numbers)
}

/// Two numbers or the given default.
pub fn vec2(value: &Value, key: &str, default: Vec2) -> Vec2 {
    reals(value, key).map_or(default, Vec2::from_array)
}

/// Three numbers or the given default.
pub fn vec3(value: &Value, key: &str, default: Vec3) -> Vec3 {
    reals(value, key).map_or(default, Vec3::from_array)
}

/// Four numbers or the given default.
pub fn vec4(value: &Value, key: &str, default: Vec4) -> Vec4 {
    reals(value, key).map_or(default, Vec4::from_array)
}

/// The object's name or `otherwise`.
pub fn name_or(value: &Value, otherwise: impl Fn() -> String) -> String {
    value["name"].as_str().filter(|n| !n.is_empty()).map_or_else(otherwise, str::to_owned)
}
