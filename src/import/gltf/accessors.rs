//! Accessors: typed elements in buffer views, plain, interleaved, normalized or sparse.
//!
//! Every range is checked before a byte is read. All components come out as `f64`, which holds each of glTF's types
//! exactly.

use super::document::{Document, id_of, items, uint};
use super::report::{Fault, Read, Report};
use super::shape::whole;
use serde_json::Value;

/// How a component is stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_gl(value: &Value) -> Option<Self> {
        Some(match whole(value)? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// `bytes` holds at least one component.
    fn read(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Self::I8, &[a, ..]) => f64::from(a as i8),
            (Self::U8, &[a, ..]) => f64::from(a),
            (Self::I16, &[a, b, ..]) => f64::from(i16::from_le_bytes([a, b])),
            (Self::U16, &[a, b, ..]) => f64::from(u16::from_le_bytes([a, b])),
            (Self::U32, &[a, b, c, d, ..]) => f64::from(u32::from_le_bytes([a, b, c, d])),
            (Self::F32, &[a, b, c, d, ..]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => 0.0,
        }
    }

    /// glTF 2.0, section 3.11: integers as fractions of their range.
    fn normalize(self, value: f64) -> f64 {
        match self {
            Self::I8 => (value / 127.0).max(-1.0),
            Self::U8 => value / 255.0,
            Self::I16 => (value / 32767.0).max(-1.0),
            Self::U16 => value / 65535.0,
            Self::U32 | Self::F32 => value,
        }
    }
}

/// What an accessor's JSON says.
pub struct Accessor<'a> {
    pub place: String,
    pub count: usize,
    pub component: Component,
    pub normalized: bool,
    /// Components of an element, row by row: 1 to 16.
    pub width: usize,
    matrix: bool,
    json: &'a Value,
    document: &'a Document,
}

impl<'a> Accessor<'a> {
    pub fn new(document: &'a Document, id: usize) -> Read<Self> {
        let place = format!("accessors[{id}]");
        let json = &document.root["accessors"][id];
        let component = Component::from_gl(&json["componentType"]);
        let component = component
            .ok_or_else(|| Fault::invalid(format!("{place}.componentType"), "expected 5120 to 5126 but not 5124"))?;
        let width =
            width(&json["type"]).ok_or_else(|| Fault::invalid(format!("{place}.type"), "expected SCALAR to MAT4"))?;
        let (count, normalized) = (uint(json, "count"), json["normalized"].as_bool().unwrap_or(false));
        let matrix = json["type"].as_str().is_some_and(|name| name.starts_with("MAT"));
        Ok(Self { place, count, component, normalized, width, matrix, json, document })
    }

    /// All elements, converted component by component; `N` must be the accessor's width.
    pub fn elements<const N: usize, T: Copy + Default>(&self, convert: impl Fn(f64) -> T) -> Read<Vec<[T; N]>> {
        if self.width != N || (self.matrix && N == 4) {
            let message = format!("expected {}, is {}", type_name(N), type_name(self.width));
            return Err(Fault::invalid(format!("{}.type", self.place), message));
        }
        let range = self.range()?;
        let bytes = self.count.saturating_mul(N * size_of::<T>());
        self.document.spend(bytes, &format!("{}.count", self.place))?;
        let value = |bytes: &[u8]| {
            let value = self.component.read(bytes);
            convert(if self.normalized { self.component.normalize(value) } else { value })
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
        match (self.width, size) {
            (9, 1) => i / 3 * 4 + i % 3,
            (9, 2) => i / 3 * 8 + i % 3 * 2,
            (4, 1) if self.matrix => i / 2 * 4 + i % 2,
            _ => i * size,
        }
    }

    /// The bytes from the first element on and the distance between elements; `None`: all zero.
    fn range(&self) -> Read<Option<(&'a [u8], usize)>> {
        let Some(view_id) = id_of(self.json, "bufferView") else { return Ok(None) };
        let view = self.document.view(view_id)?;
        let stride = id_of(&self.document.root["bufferViews"][view_id], "byteStride").unwrap_or(self.element_size());
        let offset = uint(self.json, "byteOffset");
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

    /// Calls `replace` with the index and bytes of each substituted element.
    fn sparse(&self, mut replace: impl FnMut(usize, &'a [u8])) -> Read<()> {
        let sparse = &self.json["sparse"];
        if sparse.is_null() {
            return Ok(());
        }
        let place = format!("{}.sparse", self.place);
        let component = Component::from_gl(&sparse["indices"]["componentType"]);
        let component = component.ok_or_else(|| Fault::invalid(&*place, "indices need a component type"))?;
        let count = uint(sparse, "count");
        let part = |key: &str, size: usize| {
            let part = &sparse[key];
            let bytes = self.document.view(uint(part, "bufferView"))?.get(uint(part, "byteOffset")..).unwrap_or(&[]);
            if count.checked_mul(size).is_none_or(|needed| needed > bytes.len()) {
                return Err(Fault::invalid(
                    format!("{place}.{key}"),
                    format!("{count} elements run past the buffer view"),
                ));
            }
            Ok(bytes)
        };
        let size = self.element_size();
        let (indices, values) = (part("indices", component.size())?, part("values", size)?);
        for i in 0..count {
            let index = component.read(&indices[i * component.size()..]) as usize;
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
        let view_id = id_of(self.json, "bufferView");
        let view = view_id.map_or(&Value::Null, |id| &self.document.root["bufferViews"][id]);
        let offset = uint(self.json, "byteOffset");
        if !offset.is_multiple_of(size) || !uint(view, "byteOffset").saturating_add(offset).is_multiple_of(size) {
            report.warn(format!("{}.byteOffset", self.place), format!("expected a multiple of {size} bytes"));
        }
        if let Some(stride) = id_of(view, "byteStride") {
            let place = format!("bufferViews[{}].byteStride", view_id.unwrap_or(0));
            if stride < self.element_size() {
                report.warn(place, format!("{stride} is less than an element of {} takes", self.place));
            }
        }
        if self.normalized && matches!(self.component, Component::U32 | Component::F32) {
            report.warn(format!("{}.normalized", self.place), "has no meaning for this component type");
        }
        if uint(&self.json["sparse"], "count") > self.count {
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
                let value = self.component.read(bytes.get(self.offset_in_element(i)..).unwrap_or(&[]));
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
        self.check_bound("min", &lowest, report);
        self.check_bound("max", &highest, report);
        Ok(())
    }

    fn check_bound(&self, key: &str, found: &[f64; 16], report: &mut Report) {
        let stated = items(&self.json[key]);
        if stated.is_empty() {
            return;
        }
        let place = format!("{}.{key}", self.place);
        if stated.len() != self.width {
            return report.warn(place, format!("expected {} numbers", self.width));
        }
        // Exporters write bounds in decimal: the nearest float must agree, nothing closer.
        let differs = |a: f64, b: f64| if self.component == Component::F32 { a as f32 != b as f32 } else { a != b };
        for (i, (stated, &found)) in stated.iter().filter_map(Value::as_f64).zip(found).enumerate() {
            if differs(stated, found) {
                return report.warn(place, format!("component {i} is stated as {stated}, found {found}"));
            }
        }
    }
}

fn width(type_name: &Value) -> Option<usize> {
    Some(match type_name.as_str()? {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return None,
    })
}

fn type_name(width: usize) -> &'static str {
    match width {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        4 => "VEC4",
        9 => "MAT3",
        _ => "MAT4",
    }
}
