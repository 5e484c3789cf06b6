//! Getters of values of a world.

/// A getter for each value. `$with` does something with the world of an object: a closure of what it gives.
macro_rules! getters {
    ($with:path, $class:ident: $($(#[$doc:meta])* $getter:ident: $type:ty = |$($given:ident),+| $value:expr;)*) => {
        #[pymethods]
        impl $class {
            $(
                $(#[$doc])*
                #[getter]
                fn $getter(own: PyRef<'_, Self>) -> PyResult<$type> {
                    $with(&own, |$($given),+| Ok($value))
                }
            )*
        }
    };
}
pub(crate) use getters;
