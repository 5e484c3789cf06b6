//! The document with what its buffers hold: everything the other readers read from.

use crate::import::gltf::files::uri::{self, Place};
use crate::import::gltf::report::{Fault, FaultKind, Read, Report};
use gltf::json::{Index, Root};
use std::cell::{Cell, OnceCell};
use std::collections::BTreeMap;

/// Bytes of decoded elements that any file may make, however small.
const FREE_BYTES: usize = 32 << 20;
/// Decoded bytes per byte of file and buffers, beyond that: honest files stay far below, and a small file that names
/// the same bytes again and again cannot fill the memory.
const BYTES_PER_BYTE: usize = 100;

/// A glTF document that has passed the schema: every index in it is in range.
pub struct Document {
    pub gltf: gltf::Document,
    place: Place,
    bin: Option<Vec<u8>>,
    /// Read when first needed: a faulty buffer that nothing uses does no harm.
    buffers: Vec<OnceCell<Read<Vec<u8>>>>,
    budget: Cell<usize>,
    /// KHR_mesh_quantization widens the allowed vertex formats.
    pub quantized: bool,
    first_images: Vec<usize>,
}

impl Document {
    pub fn new(gltf: gltf::Document, from: Place, bin: Option<Vec<u8>>, file_bytes: usize) -> Self {
        let buffers = vec![OnceCell::new(); gltf.buffers().len()];
        let budget = Cell::new(FREE_BYTES.saturating_add(file_bytes.saturating_mul(BYTES_PER_BYTE)));
        let mut first = BTreeMap::new();
        let images = gltf.as_json().images.iter().enumerate();
        let first_images =
            images.map(|(id, i)| *first.entry((i.uri.as_deref(), id_of(i.buffer_view))).or_insert(id)).collect();
        let quantized = gltf.extensions_used().any(|name| name == "KHR_mesh_quantization");
        Self { gltf, place: from, bin, buffers, budget, quantized, first_images }
    }

    /// The plain structures, for what the crate's accessors over them would panic on.
    pub fn json(&self) -> &Root {
        self.gltf.as_json()
    }

    /// Tells if the file requires the extension to be read.
    pub fn requires(&self, extension: &str) -> bool {
        self.gltf.extensions_required().any(|name| name == extension)
    }

    /// Takes decoded bytes from what this file may make.
    pub fn spend(&self, bytes: usize, place: &str) -> Read<()> {
        let left = self.budget.get().checked_sub(bytes);
        self.budget.set(left.ok_or_else(|| Fault::unsupported(place, "more elements than the file has data for"))?);
        Ok(())
    }

    /// The bytes of a buffer, at least as many as its `byteLength`.
    fn buffer(&self, id: usize) -> Read<&[u8]> {
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
        let buffer = &self.json().buffers[id];
        let bytes = match (&buffer.uri, &self.bin) {
            (Some(uri), _) => uri::fetch(uri, &self.place, &format!("{place}.uri"))?,
            (None, Some(bin)) if id == 0 => bin.clone(),
            (None, _) => {
                let fault = Fault::invalid(place, "has neither uri nor binary chunk: its data is ignored");
                return Err(Fault { kind: FaultKind::NoData, ..fault });
            }
        };
        let length = buffer.byte_length.0;
        if (bytes.len() as u64) < length {
            let message = format!("expected {length} bytes, found {}", bytes.len());
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
        let view = &self.json().buffer_views[id];
        let buffer_id = view.buffer.value();
        let buffer = self.buffer(buffer_id)?;
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let limit = self.json().buffers[buffer_id].byte_length.0.min(buffer.len() as u64);
        let end = offset.checked_add(length).filter(|&end| end <= limit);
        end.and_then(|end| buffer.get(offset as usize..end as usize)).ok_or_else(|| {
            let message = format!("bytes {offset}+{length} run past buffers[{buffer_id}], which has {limit}");
            Fault::invalid(format!("bufferViews[{id}].byteLength"), message)
        })
    }

    /// The distance between a view's elements, where it is stated.
    pub fn stride(&self, view: usize) -> Option<usize> {
        self.json().buffer_views[view].byte_stride.map(|stride| stride.0)
    }

    /// The first image that names the same bytes: some exporters list an image once for every texture.
    pub fn first_alike(&self, image: usize) -> usize {
        self.first_images.get(image).copied().unwrap_or(image)
    }

    /// The bytes of an image, still encoded.
    pub fn image_bytes(&self, id: usize) -> Read<Vec<u8>> {
        let image = &self.json().images[id];
        let place = format!("images[{id}]");
        match (&image.uri, id_of(image.buffer_view)) {
            (Some(uri), None) => uri::fetch(uri, &self.place, &format!("{place}.uri")),
            (None, Some(view)) => {
                let bytes = self.view(view)?;
                self.spend(bytes.len(), &place)?;
                Ok(bytes.to_vec())
            }
            _ => Err(Fault::invalid(place, "expected either uri or bufferView")),
        }
    }
}

/// The number behind an index.
pub fn id_of<T>(index: Option<Index<T>>) -> Option<usize> {
    index.map(|index| index.value())
}

/// The name or `otherwise`.
pub fn name_or(name: Option<&str>, otherwise: impl Fn() -> String) -> String {
    name.filter(|name| !name.is_empty()).map_or_else(otherwise, str::to_owned)
}
