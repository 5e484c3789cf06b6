//! Accessors: typed elements in buffer views, plain, interleaved, normalized or sparse.
//!
//! Every range is checked before a byte is read. All components come out as `f64`, which holds each of glTF's types
//! exactly.

use super::data::{Document, id_of};
use crate::import::gltf::report::{Fault, Read, Report};
use gltf::accessor::{DataType, Dimensions};
use gltf::json;
use gltf::json::accessor::{GenericComponentType, IndexComponentType};
use gltf::json::validation::Checked;
use serde_json::Value;

/// `bytes` holds at least one component.
fn component(kind: DataType, bytes: &[u8]) -> f64 {
    match (kind, bytes) {
        (DataType::I8, &[a, ..]) => f64::from(a as i8),
        (DataType::U8, &[a, ..]) => f64::from(a),
        (DataType::I16, &[a, b, ..]) => f64::from(i16::from_le_bytes([a, b])),
        (DataType::U16, &[a, b, ..]) => f64::from(u16::from_le_bytes([a, b])),
        (DataType::U32, &[a, b, c, d, ..]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (DataType::F32, &[a, b, c, d, ..]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => 0.0,
    }
}

/// glTF 2.0, section 3.11: integers as fractions of their range.
fn normalize(kind: DataType, value: f64) -> f64 {
    match kind {
        DataType::I8 => (value / 127.0).max(-1.0),
        DataType::U8 => value / 255.0,
        DataType::I16 => (value / 32767.0).max(-1.0),
        DataType::U16 => value / 65535.0,
        DataType::U32 | DataType::F32 => value,
    }
}

/// An accessor whose types are known.
pub struct Accessor<'a> {
    pub place: String,
    pub count: usize,
    pub component: DataType,
    pub normalized: bool,
    /// Components of an element, row by row: 1 to 16.
    pub width: usize,
    dimensions: Dimensions,
    json: &'a json::Accessor,
    document: &'a Document,
}

impl<'a> Accessor<'a> {
    pub fn new(document: &'a Document, id: usize) -> Read<Self> {
        let place = format!("accessors[{id}]");
        let json = &document.json().accessors[id];
        let Checked::Valid(GenericComponentType(component)) = json.component_type else {
            return Err(Fault::invalid(format!("{place}.componentType"), "expected 5120 to 5126 but not 5124"));
        };
        let Checked::Valid(dimensions) = json.type_ else {
            return Err(Fault::invalid(format!("{place}.type"), "expected SCALAR to MAT4"));
        };
        let (count, width) = (json.count.0 as usize, dimensions.multiplicity());
        Ok(Self { place, count, component, normalized: json.normalized, width, dimensions, json, document })
    }

    /// All elements, converted component by component; `N` must be the accessor's width.
    pub fn elements<const N: usize, T: Copy + Default>(&self, convert: impl Fn(f64) -> T) -> Read<Vec<[T; N]>> {
        if self.width != N || self.dimensions == Dimensions::Mat2 {
            let message = format!("expected {N} components, found {:?}", self.dimensions);
            return Err(Fault::invalid(format!("{}.type", self.place), message));
        }
        let range = self.range()?;
        let bytes = self.count.saturating_mul(N * size_of::<T>());
        self.document.spend(bytes, &format!("{}.count", self.place))?;
        let value = |bytes: &[u8]| {
            let value = component(self.component, bytes);
            convert(if self.normalized { normalize(self.component, value) } else { value })
        };
        let read = |bytes: &[u8]| std::array::from_fn(|i| value(&bytes[self.offset_in_element(i)..]));
        let mut elements = match range {
            Some((bytes, stride)) => (0..self.count).map(|i| read(&bytes[i * stride..])).collect(),
            None => vec![[convert(0.0); N]; self.count],
        };
        self.sparse(|index, bytes| elements[index] = read(bytes))?;
        Ok(elements)
    }

    /// Bytes of an element. The columns of matrices start at multiples of four bytes.
    fn element_size(&self) -> usize {
        self.offset_in_element(self.width - 1) + self.component.size()
    }

    fn offset_in_element(&self, i: usize) -> usize {
        let size = self.component.size();
        match (self.dimensions, size) {
            (Dimensions::Mat3, 1) => i / 3 * 4 + i % 3,
            (Dimensions::Mat3, 2) => i / 3 * 8 + i % 3 * 2,
            (Dimensions::Mat2, 1) => i / 2 * 4 + i % 2,
            _ => i * size,
        }
    }

    /// The bytes from the first element on and the distance between elements; `None`: all zero.
    fn range(&self) -> Read<Option<(&'a [u8], usize)>> {
        let Some(view_id) = id_of(self.json.buffer_view) else { return Ok(None) };
        let view = self.document.view(view_id)?;
        let stride = self.document.stride(view_id).unwrap_or(self.element_size());
        let offset = self.offset();
        let last = self.count.checked_sub(1).and_then(|n| n.checked_mul(stride));
        let end = last.and_then(|last| last.checked_add(self.element_size())?.checked_add(offset));
        if end.is_none_or(|end| end > view.len()) {
            let (count, length) = (self.count, view.len());
            let message =
                format!("{count} elements from byte {offset} run past bufferViews[{view_id}] of {length} bytes");
            return Err(Fault::invalid(&*self.place, message));
        }
        Ok(Some((&view[offset..], stride)))
    }

    fn offset(&self) -> usize {
        self.json.byte_offset.unwrap_or_default().0 as usize
    }

    /// Calls `replace` with the index and bytes of each substituted element.
    fn sparse(&self, mut replace: impl FnMut(usize, &'a [u8])) -> Read<()> {
        let Some(sparse) = &self.json.sparse else { return Ok(()) };
        let place = format!("{}.sparse", self.place);
        let Checked::Valid(IndexComponentType(kind)) = sparse.indices.component_type else {
            return Err(Fault::invalid(place, "indices need a component type"));
        };
        let count = sparse.count.0 as usize;
        let part = |key: &str, view: usize, offset: u64, size: usize| {
            let bytes = self.document.view(view)?.get(offset as usize..).unwrap_or(&[]);
            if count.checked_mul(size).is_none_or(|needed| needed > bytes.len()) {
                let message = format!("{count} elements run past the buffer view");
                return Err(Fault::invalid(format!("{place}.{key}"), message));
            }
            Ok(bytes)
        };
        let size = self.element_size();
        let (indices, values) = (&sparse.indices, &sparse.values);
        let indices = part("indices", indices.buffer_view.value(), indices.byte_offset.0, kind.size())?;
        let values = part("values", values.buffer_view.value(), values.byte_offset.0, size)?;
        for i in 0..count {
            let index = component(kind, &indices[i * kind.size()..]) as usize;
            if index >= self.count {
                let message = format!("element {i} replaces element {index} of {}", self.count);
                return Err(Fault::invalid(format!("{place}.indices"), message));
            }
            replace(index, &values[i * size..]);
        }
        Ok(())
    }

    /// Warns where the accessor breaks rules that reading it does not depend on: alignment, and `min` and `max`.
    pub fn check(&self, report: &mut Report) {
        let size = self.component.size();
        let view = id_of(self.json.buffer_view).map(|id| (id, &self.document.json().buffer_views[id]));
        let (offset, view_offset) =
            (self.offset(), view.and_then(|(_, v)| v.byte_offset).unwrap_or_default().0 as usize);
        if !offset.is_multiple_of(size) || !view_offset.saturating_add(offset).is_multiple_of(size) {
            report.warn(format!("{}.byteOffset", self.place), format!("expected a multiple of {size} bytes"));
        }
        if let Some((id, stride)) = view.and_then(|(id, v)| Some((id, v.byte_stride?.0)))
            && stride < self.element_size()
        {
            let message = format!("{stride} is less than an element of {} takes", self.place);
            report.warn(format!("bufferViews[{id}].byteStride"), message);
        }
        if self.normalized && matches!(self.component, DataType::U32 | DataType::F32) {
            report.warn(format!("{}.normalized", self.place), "has no meaning for this component type");
        }
        if self.json.sparse.as_ref().is_some_and(|sparse| sparse.count.0 as usize > self.count) {
            report.warn(format!("{}.sparse.count", self.place), format!("more than {} elements", self.count));
        }
        if let Err(fault) = self.check_values(report) {
            report.fault(false, fault);
        }
    }

    /// `min` and `max` are stated for the stored values, before normalization.
    fn check_values(&self, report: &mut Report) -> Read<()> {
        let range = self.range()?;
        let mut replaced: Vec<(usize, &[u8])> = Vec::new();
        self.sparse(|index, bytes| replaced.push((index, bytes)))?;
        if !replaced.is_sorted_by(|a, b| a.0 < b.0) {
            report.warn(format!("{}.sparse.indices", self.place), "expected strictly increasing indices");
            replaced.sort_by_key(|(index, _)| *index);
        }
        if range.is_none() && replaced.is_empty() {
            return Ok(());
        }
        let (mut lowest, mut highest) = ([f64::INFINITY; 16], [f64::NEG_INFINITY; 16]);
        let mut not_finite = None;
        let mut see = |index: usize, bytes: &[u8]| {
            for i in 0..self.width {
                let value = component(self.component, bytes.get(self.offset_in_element(i)..).unwrap_or(&[]));
                (lowest[i], highest[i]) = (lowest[i].min(value), highest[i].max(value));
                if !value.is_finite() {
                    not_finite = not_finite.or(Some(index));
                }
            }
        };
        if let Some((bytes, stride)) = range {
            let size = self.count.saturating_mul(self.element_size());
            self.document.spend(size, &format!("{}.count", self.place))?;
            (0..self.count)
                .filter(|i| replaced.binary_search_by_key(i, |(index, _)| *index).is_err())
                .for_each(|i| see(i, &bytes[i * stride..]));
        } else if replaced.len() < self.count {
            see(0, &[]);
        }
        replaced.iter().for_each(|&(index, bytes)| see(index, bytes));
        if let Some(index) = not_finite {
            report.warn(&*self.place, format!("expected finite numbers, element {index} is not"));
        }
        self.check_bound("min", &self.json.min, &lowest, report);
        self.check_bound("max", &self.json.max, &highest, report);
        Ok(())
    }

    fn check_bound(&self, key: &str, stated: &Option<Value>, found: &[f64; 16], report: &mut Report) {
        let Some(stated) = stated.as_ref().and_then(Value::as_array).filter(|s| !s.is_empty()) else { return };
        let place = format!("{}.{key}", self.place);
        if stated.len() != self.width {
            return report.warn(place, format!("expected {} numbers", self.width));
        }
        // Exporters write bounds in decimal: the nearest float must agree, nothing closer.
        let differs = |a: f64, b: f64| if self.component == DataType::F32 { a as f32 != b as f32 } else { a != b };
        for (i, (stated, &found)) in stated.iter().filter_map(Value::as_f64).zip(found).enumerate() {
            if differs(stated, found) {
                return report.warn(place, format!("component {i} is stated as {stated}, found {found}"));
            }
        }
    }
}
