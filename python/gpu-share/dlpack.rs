//! Capsules of DLPack (dlpack.h, version 0.8: unversioned ones), by which libraries of Python hand arrays on.
#![allow(unsafe_code)]

use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use std::ffi::{CStr, c_void};
use std::ptr::NonNull;

const NAME: &CStr = c"dltensor";

/// `DLTensor`.
#[repr(C)]
struct Tensor {
    data: *mut c_void,
    device: [i32; 2],
    axes: i32,
    code: u8,
    bits: u8,
    lanes: u16,
    shape: *mut i64,
    strides: *mut i64,
    byte_offset: u64,
}

/// `DLManagedTensor`.
#[repr(C)]
struct Managed {
    tensor: Tensor,
    context: *mut c_void,
    deleter: Option<unsafe extern "C" fn(*mut Managed)>,
}

/// A tensor and what it points to. A pointer to it is one to its first field.
#[repr(C)]
struct Owned {
    managed: Managed,
    shape: Vec<i64>,
    strides: Vec<i64>,
    owner: Py<PyAny>,
}

/// An array in memory of some device.
#[derive(Clone, Debug)]
pub struct Array {
    /// Address in that memory.
    pub address: u64,
    /// `DLDevice`: kind and number.
    pub device: (i32, i32),
    /// `DLDataTypeCode`: 0 signed, 1 unsigned, 2 floating-point numbers.
    pub code: u8,
    /// Bits of a number.
    pub bits: u8,
    /// Sizes of the axes.
    pub shape: Vec<i64>,
    /// Numbers from one to the next, by axis; of as many axes as `shape`.
    pub strides: Vec<i64>,
}

/// A capsule of an array. `owner` is held until whoever takes the capsule lets go of the array, or the capsule goes
/// untaken.
///
/// # Errors
/// Those of Python; a `ValueError` where `shape` and `strides` have not as many axes.
pub fn capsule<'py>(py: Python<'py>, array: Array, owner: Py<PyAny>) -> PyResult<Bound<'py, PyCapsule>> {
    let Array { address, device, code, bits, shape, strides } = array;
    if shape.len() != strides.len() {
        return Err(pyo3::exceptions::PyValueError::new_err("strides: expected as many as axes"));
    }
    let tensor = Tensor {
        data: address as *mut c_void,
        device: [device.0, device.1],
        axes: shape.len() as i32,
        code,
        bits,
        lanes: 1,
        shape: std::ptr::null_mut(),
        strides: std::ptr::null_mut(),
        byte_offset: 0,
    };
    let managed = Managed { tensor, context: std::ptr::null_mut(), deleter: Some(delete) };
    let mut owned = Box::new(Owned { managed, shape, strides, owner });
    // The vectors are not changed any more: their numbers stay where they are.
    owned.managed.tensor.shape = owned.shape.as_mut_ptr();
    owned.managed.tensor.strides = owned.strides.as_mut_ptr();
    let pointer = NonNull::from(Box::leak(owned)).cast::<c_void>();
    // SAFETY: the pointer is a `DLManagedTensor`, as those who take capsules of this name expect, and valid until its
    // deleter is called: by who takes it, or by `destroy`, which may be called in any thread.
    let made = unsafe { PyCapsule::new_with_pointer_and_destructor(py, pointer, NAME, Some(destroy)) };
    made.inspect_err(|_| {
        // SAFETY: no capsule has it.
        drop(unsafe { Box::from_raw(pointer.cast::<Owned>().as_ptr()) });
    })
}

/// Lets go of an array.
unsafe extern "C" fn delete(managed: *mut Managed) {
    // A process that ends keeps it: there is no interpreter that could let go of its owner.
    let _ = Python::try_attach(|py| {
        // What the caller has raised is not the owner's, whose finalizers may run.
        let raised = PyErr::take(py);
        // SAFETY: it is the first field of what `capsule` has leaked, and DLPack calls a deleter once.
        drop(unsafe { Box::from_raw(managed.cast::<Owned>()) });
        if let Some(raised) = raised {
            raised.restore(py);
        }
    });
}

/// Lets go of the array of a capsule that nobody has taken. One that was taken has another name.
unsafe extern "C" fn destroy(capsule: *mut ffi::PyObject) {
    // SAFETY: Python calls it with a capsule, attached to the interpreter. The first function raises nothing, and the
    // second nothing of a capsule that is valid.
    unsafe {
        if ffi::PyCapsule_IsValid(capsule, NAME.as_ptr()) == 1 {
            delete(ffi::PyCapsule_GetPointer(capsule, NAME.as_ptr()).cast());
        }
    }
}
