//! Lenses as OpenCV and ROS describe them: matrix, coefficients, model.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use relief::export::ros::Distortion;
use relief::systems::draw::Intrinsics;
use relief::systems::sensors::Lens;

/// A matrix of 3 by 3, float64.
pub fn camera_matrix<'py>(py: Python<'py>, own: &Intrinsics) -> Bound<'py, PyArray2<f64>> {
    let rows = [[own.fx, 0.0, own.cx], [0.0, own.fy, own.cy], [0.0, 0.0, 1.0]];
    Array2::from_shape_fn((3, 3), |(row, column)| rows[row][column]).into_pyarray(py)
}

/// OpenCV's, float64.
pub fn coefficients<'py>(py: Python<'py>, lens: &Lens) -> Bound<'py, PyArray1<f64>> {
    Distortion::of(lens).parts().1.to_vec().into_pyarray(py)
}

/// Name of the distortion model in ROS.
pub fn model(lens: &Lens) -> &'static str {
    match Distortion::of(lens) {
        Distortion::PlumbBob(_) => "plumb_bob",
        Distortion::RationalPolynomial(_) => "rational_polynomial",
        Distortion::Equidistant(_) => "equidistant",
    }
}
