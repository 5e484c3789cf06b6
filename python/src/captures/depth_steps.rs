//! Depths as the steps of a scale.

use crate::errors::Failure;
use numpy::{PyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Bits of a number, from which its cell follows: 128 to an octave, so that hardly any has two steps of a scale.
const CELL_BITS: u32 = 16;

/// Steps that bytes have room for, beside none and nothing.
const MOST_STEPS: usize = 253;

/// Byte of what has no depth.
const NOTHING: u8 = u8::MAX;

/// A scale of positive depths, ascending.
struct Scale<'a> {
    depths: &'a [f32],
    first: u32,
    /// Steps below each cell, from the first step's to the last one's.
    below: Vec<u8>,
}

impl<'a> Scale<'a> {
    fn new(depths: &'a [f32]) -> Self {
        let cell = |depth: Option<&f32>| depth.map_or(0, |depth| depth.to_bits() >> CELL_BITS);
        let first = cell(depths.first());
        let start = |cell: u32| f32::from_bits(cell << CELL_BITS);
        let below = |cell| depths.partition_point(|depth| *depth < start(cell)) as u8;
        Self { depths, first, below: (first..=cell(depths.last())).map(below).collect() }
    }

    /// Steps that a depth has passed, plus 1.
    fn byte(&self, depth: f32) -> u8 {
        if !depth.is_finite() {
            return NOTHING;
        }
        let cell = (depth.max(0.0).to_bits() >> CELL_BITS).saturating_sub(self.first) as usize;
        let mut passed = self.below.get(cell).or(self.below.last()).copied().unwrap_or_default();
        while self.depths.get(usize::from(passed)).is_some_and(|step| *step <= depth) {
            passed += 1;
        }
        passed + 1
    }
}

/// The steps of a scale. Raises ValueError of too many, and of others than positive depths, ascending.
pub fn steps_of_scale(scale: &PyReadonlyArray1<'_, f32>) -> PyResult<Vec<f32>> {
    let steps = scale.to_vec()?;
    if steps.len() > MOST_STEPS || !steps.is_sorted() || steps.first().is_some_and(|first| *first <= 0.0) {
        let message = format!("scale: expected at most {MOST_STEPS} positive depths, ascending, found {steps:?}");
        return Err(Failure::value(message).into());
    }
    Ok(steps)
}

/// Steps of an ascending scale, of at most 253 positive depths, that each depth has passed, plus 1: uint8 of the same
/// shape; 255 where there is nothing.
#[pyfunction]
pub fn depth_steps<'py>(
    py: Python<'py>,
    depths: PyReadonlyArrayDyn<'py, f32>,
    scale: PyReadonlyArray1<'py, f32>,
) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
    let (given, steps) = (depths.to_vec()?, steps_of_scale(&scale)?);
    let bytes: Vec<u8> = py.detach(|| {
        let scale = Scale::new(&steps);
        given.into_iter().map(|depth| scale.byte(depth)).collect()
    });
    PyArray::from_vec(py, bytes).reshape(depths.shape())
}
