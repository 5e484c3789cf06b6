//! The Python package's extension module, `relief._relief`: worlds, entities, sensors and their captures.
//!
//! ```text
//! world     a world under a lock, and what is done with it away from the interpreter
//! sim       Sim: a world of a scene, and its run; spawning, contents: what comes into being, and is there; many:
//!           several worlds at once
//! entity    what is in a world: vehicle, light, portal, sensor; roads: routes and signals
//! capture   what sensors measured, as arrays: camera, points (of lidars), readings (of all others)
//! mounting  sensors by their keywords; fields: those that are named as in scene files
//! arguments what calls are given, and errors that name it; values: numbers, places
//! errors    exceptions; device: the graphics device of the process; watch: captures that were left out
//! program   the command line
//! ```
//!
//! A world has a number for each entity; an object of Python is the world and that number. What takes time lets go of
//! the interpreter first and takes the world's lock then. Arrays are the vectors that Rust has made: nothing is copied.

mod arguments;
mod camera;
mod capture;
mod contents;
mod device;
mod entity;
mod errors;
mod fields;
mod light;
mod many;
mod mounting;
mod points;
mod portal;
mod program;
mod readings;
mod roads;
mod sensor;
mod sim;
mod spawning;
mod values;
mod vehicle;
mod watch;
mod world;

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
    use crate::camera::{CameraBatch, CameraCapture};
    #[pymodule_export]
    use crate::capture::Capture;
    #[pymodule_export]
    use crate::entity::Entity;
    #[pymodule_export]
    use crate::light::{Light, LightEntity};
    #[pymodule_export]
    use crate::many::{adapter, capture, capture_due, look, replay, set_threads, step};
    #[pymodule_export]
    use crate::points::LidarCapture;
    #[pymodule_export]
    use crate::portal::Portal;
    #[pymodule_export]
    use crate::program::run_program;
    #[pymodule_export]
    use crate::readings::{Collisions, Contact, GnssReading, ImuReading, LaneReading};
    #[pymodule_export]
    use crate::roads::Route;
    #[pymodule_export]
    use crate::sensor::Sensor;
    #[pymodule_export]
    use crate::sim::{Recording, Sim};
    #[pymodule_export]
    use crate::vehicle::Vehicle;

    /// Finds numpy, which arrays are made with: later an interrupt could come between, where that is no exception.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let py = module.py();
        py.import("numpy")?;
        PyArray1::<u8>::zeros(py, 0, false);
        Ok(())
    }
}
