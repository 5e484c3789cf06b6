//! The extension module.
use pyo3::prelude::*;

#[pymodule]
mod _relief {
    use super::*;
    #[pymodule_init]
    fn init(_m: &Bound<'_, PyModule>) -> PyResult<()> {
        Ok(())
    }
}
