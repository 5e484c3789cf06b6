//! Values of one type in a shape, and columns of them that make records together.
//!
//! A column has a row of values for each record: `boxes` may have `id` (shape `[N]`), `box_full` (`[N, 4]`) and
//! `corners_uv` (`[N, 8, 2]`). In files the values of a record follow each other without gaps.

use super::checks::{check_count, unfit};
use half::f16;
use std::io::Result;

/// Values of one type, in C order: the last index runs fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Values<'a> {
    U8(&'a [u8]),
    U16(&'a [u16]),
    U32(&'a [u32]),
    I32(&'a [i32]),
    F16(&'a [f16]),
    F32(&'a [f32]),
    F64(&'a [f64]),
}

/// Does the same with the slice of every kind.
macro_rules! each_kind {
    ($values:expr, $slice:ident => $does:expr) => {
        match $values {
            Values::U8($slice) => $does,
            Values::U16($slice) => $does,
            Values::U32($slice) => $does,
            Values::I32($slice) => $does,
            Values::F16($slice) => $does,
            Values::F32($slice) => $does,
            Values::F64($slice) => $does,
        }
    };
}

macro_rules! values_from {
    ($($kind:ident $type:ty),*) => {
        $(impl<'a> From<&'a [$type]> for Values<'a> {
            fn from(values: &'a [$type]) -> Self {
                Self::$kind(values)
            }
        })*
    };
}

values_from!(U8 u8, U16 u16, U32 u32, I32 i32, F16 f16, F32 f32, F64 f64);

impl Values<'_> {
    /// Number of values.
    pub fn len(self) -> usize {
        each_kind!(self, values => values.len())
    }

    /// Tells if there are no values.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Bytes of one value.
    pub fn value_bytes(self) -> usize {
        fn of<T>(_: &[T]) -> usize {
            size_of::<T>()
        }
        each_kind!(self, values => of(values))
    }

    /// Tells if all values are finite.
    pub fn are_finite(self) -> bool {
        match self {
            Values::F16(values) => values.iter().all(|value| value.is_finite()),
            Values::F32(values) => values.iter().all(|value| value.is_finite()),
            Values::F64(values) => values.iter().all(|value| value.is_finite()),
            _ => true,
        }
    }

    /// Little endian, one after the other.
    pub fn to_le_bytes(self) -> Vec<u8> {
        let (size, mut bytes) = (self.value_bytes(), vec![0; self.len() * self.value_bytes()]);
        self.put(&mut bytes, 0, size, size);
        bytes
    }

    /// Writes runs of `run` bytes, little endian: one into each record of `stride` bytes, at `offset`.
    fn put(self, bytes: &mut [u8], offset: usize, run: usize, stride: usize) {
        each_kind!(self, values => {
            let mut values = values.iter();
            for record in bytes.chunks_exact_mut(stride) {
                for (to, value) in record[offset..offset + run].chunks_exact_mut(self.value_bytes()).zip(&mut values) {
                    to.copy_from_slice(&value.to_le_bytes());
                }
            }
        });
    }
}

/// Values in a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Array<'a> {
    /// Number of values along each axis; empty for a single value.
    pub shape: &'a [usize],
    /// Values, as many as the product of the shape.
    pub values: Values<'a>,
}

impl<'a> Array<'a> {
    /// An array of a slice of numbers.
    pub fn new(shape: &'a [usize], values: impl Into<Values<'a>>) -> Self {
        Self { shape, values: values.into() }
    }

    /// Checks that there are as many values as the shape has places.
    ///
    /// # Errors
    /// `what`, and how many were expected.
    pub fn check(&self, what: &str) -> Result<()> {
        check_count(what, places(what, self.shape)?, self.values.len())
    }
}

/// The product of a shape.
fn places(what: &str, shape: &[usize]) -> Result<usize> {
    let product = shape.iter().try_fold(1_usize, |all, length| all.checked_mul(*length));
    product.ok_or_else(|| unfit(format!("{what}: the shape {shape:?} is too large")))
}

/// A field of all records.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column<'a> {
    /// The field's name.
    pub name: &'a str,
    /// The shape of the values that one record has; empty for a single value.
    pub shape: &'a [usize],
    /// Those of the first record, of the second, and so on.
    pub values: Values<'a>,
}

impl<'a> Column<'a> {
    /// A column of a slice of numbers.
    pub fn new(name: &'a str, shape: &'a [usize], values: impl Into<Values<'a>>) -> Self {
        Self { name, shape, values: values.into() }
    }

    /// Values that a record has.
    ///
    /// # Errors
    /// A shape that no memory holds.
    pub fn per_record(&self) -> Result<usize> {
        places(self.name, self.shape)
    }
}

/// Puts the columns of `rows` records together: the bytes of all records, little endian and without gaps.
///
/// # Errors
/// A column with more or fewer values than that.
pub fn interleave(rows: usize, columns: &[Column]) -> Result<Vec<u8>> {
    let mut runs = Vec::with_capacity(columns.len());
    for column in columns {
        let count = column.per_record()?;
        check_count(column.name, places(column.name, &[rows, count])?, column.values.len())?;
        runs.push(count * column.values.value_bytes());
    }
    let stride: usize = runs.iter().sum();
    let mut bytes = vec![0; stride * rows];
    let mut offset = 0;
    for (column, run) in columns.iter().zip(runs).filter(|(_, run)| *run > 0) {
        column.values.put(&mut bytes, offset, run, stride);
        offset += run;
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn records_have_the_values_of_their_columns_without_gaps() {
        let columns = [Column::new("a", &[], &[1_u8, 2][..]), Column::new("b", &[2], &[3_u16, 4, 5, 0x0106][..])];
        assert_eq!(interleave(2, &columns).unwrap(), [1, 3, 0, 4, 0, 2, 5, 0, 6, 1]);
        assert!(interleave(0, &[]).unwrap().is_empty());
        let error = interleave(3, &columns).unwrap_err().to_string();
        assert_eq!(error, "a: expected 3 values, found 2");
    }

    #[test]
    fn shapes_that_no_memory_holds_are_refused() {
        let error = Array::new(&[usize::MAX, 2], &[0_u8][..]).check("depth").unwrap_err().to_string();
        assert!(error.starts_with("depth: the shape ["), "{error}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Against every value written by itself.
        #[test]
        fn records_are_what_their_values_are_one_by_one(rows in 0_usize..9, width in 0_usize..4, seed in any::<u32>()) {
            let number = |i: usize| seed.wrapping_mul(2_654_435_761).wrapping_add(i as u32 * 40_503);
            let ids: Vec<u32> = (0..rows).map(number).collect();
            let places: Vec<f64> = (0..rows * width).map(|i| f64::from(number(i + 7))).collect();
            let halves: Vec<f16> = (0..rows).map(|i| f16::from_f32(number(i) as f32 * 1e-6)).collect();
            let shape = [width];
            let columns = [
                Column::new("id", &[], &ids[..]), Column::new("place", &shape, &places[..]),
                Column::new("half", &[], &halves[..]),
            ];
            let mut plain = Vec::new();
            for row in 0..rows {
                plain.extend(ids[row].to_le_bytes());
                places[row * width..][..width].iter().for_each(|place| plain.extend(place.to_le_bytes()));
                plain.extend(halves[row].to_le_bytes());
            }
            prop_assert_eq!(interleave(rows, &columns).unwrap(), plain);
            prop_assert_eq!(Values::from(&ids[..]).to_le_bytes(), bytemuck::cast_slice::<u32, u8>(&ids).to_vec());
        }
    }
}
