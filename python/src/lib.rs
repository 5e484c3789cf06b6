//! The Python package's extension module, `relief._relief`: worlds, entities, sensors and their captures.
//!
//! ```text
//! errors    exceptions; getters: of values of a world
//! given     arguments of calls, and errors that name them; values: numbers, places; described: fields by their
//!           descriptions; light: what a light shines like
//! worlds    world: one under a lock, and what is done with it away from the interpreter; device: the graphics device
//!           of the process; lending: memory of that for other interfaces; watch: captures that were left out
//! captures  what sensors measured, as arrays: camera, points (of lidars), readings (of all others); depth_steps:
//!           depths as bytes; shared: pictures that stay on the graphics device
//! entities  entity: what is in a world; own: its world; vehicle, light, portal, sensor; mounting: sensors by their
//!           keywords; mounted: entities on others
//! sims      sim: Sim, a world of a scene, and its run; spawning, contents: what comes into being, and is there; roads:
//!           routes and signals; many: several worlds at once; columns: their sensors as arrays; sharing: their
//!           cameras on the graphics device; dataset: captures as files
//! program   the command line
//! ```
//!
//! Each line uses those above it.
//!
//! A world has a number for each entity; an object of Python is the world and that number. What takes time lets go of
//! the interpreter first and takes the world's lock then. Arrays are the vectors that Rust has made: nothing is copied.

mod captures;
mod entities;
mod errors;
mod getters;
mod given;
mod program;
mod sims;
mod worlds;

use pyo3::prelude::*;

/// Worlds, entities, sensors and their captures, in Rust.
#[pymodule]
mod _relief {
    use numpy::PyArray1;
    use pyo3::prelude::*;

    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
    #[pymodule_export]
    use crate::captures::camera::{CameraBatch, CameraCapture};
    #[pymodule_export]
    use crate::captures::capture::Capture;
    #[pymodule_export]
    use crate::captures::depth_steps::depth_steps;
    #[pymodule_export]
    use crate::captures::points::LidarCapture;
    #[pymodule_export]
    use crate::captures::readings::{Collisions, Contact, Reading};
    #[cfg(target_os = "linux")]
    #[pymodule_export]
    use crate::captures::shared::SharedPictures;
    #[pymodule_export]
    use crate::entities::entity::Entity;
    #[pymodule_export]
    use crate::entities::light::LightEntity;
    #[pymodule_export]
    use crate::entities::portal::Portal;
    #[pymodule_export]
    use crate::entities::sensor::Sensor;
    #[pymodule_export]
    use crate::entities::vehicle::Vehicle;
    #[pymodule_export]
    use crate::given::described::descriptions;
    #[pymodule_export]
    use crate::given::light::Light;
    #[pymodule_export]
    use crate::program::run_program;
    #[pymodule_export]
    use crate::sims::columns::capture_columns;
    #[pymodule_export]
    use crate::sims::dataset::Dataset;
    #[pymodule_export]
    use crate::sims::many::{adapter, capture, capture_due, look, replay, set_threads, step};
    #[pymodule_export]
    use crate::sims::roads::Route;
    #[cfg(target_os = "linux")]
    #[pymodule_export]
    use crate::sims::sharing::{dlpack_capsule, set_shared_memory_limit, share, shared_memory_numbers, sharing_device};
    #[pymodule_export]
    use crate::sims::sim::{Recording, Sim};

    /// Finds numpy, which arrays are made with: later an interrupt could come between, where that is no exception.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let py = module.py();
        py.import("numpy")?;
        PyArray1::<u8>::zeros(py, 0, false);
        Ok(())
    }
}
