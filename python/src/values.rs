//! Arguments: numbers in sequences or arrays, places, and how things are turned.

use crate::errors::{Failure, Outcome};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use relief::glam::{DAffine3, DVec3, Quat, Vec3};
use relief::systems::space::Transform;
use std::f32::consts::PI;

/// So many numbers of any sequence or array, finite ones.
#[derive(Clone, Copy, Debug)]
pub struct Numbers<const N: usize>(pub [f64; N]);

impl<'a, 'py, const N: usize> FromPyObject<'a, 'py> for Numbers<N> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let numbers = flat(&given.to_owned(), N + 1)?;
        let found = numbers.len();
        let numbers: [f64; N] =
            numbers.try_into().map_err(|_| PyValueError::new_err(format!("expected {N} numbers, found {found}")))?;
        if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
            return Err(PyValueError::new_err(format!("expected finite numbers, found {number}")));
        }
        Ok(Self(numbers))
    }
}

/// The numbers of a sequence, or of a sequence of such, row by row; no more than so many.
fn flat(given: &Bound<'_, PyAny>, most: usize) -> PyResult<Vec<f64>> {
    let mut numbers = Vec::new();
    for item in given.try_iter()? {
        let item = item?;
        match item.extract::<f64>() {
            Ok(number) => numbers.push(number),
            Err(error) => {
                if item.try_iter().is_err() {
                    return Err(error);
                }
                for inner in item.try_iter()? {
                    numbers.push(inner?.extract()?);
                }
            }
        }
        if numbers.len() >= most {
            break;
        }
    }
    Ok(numbers)
}

/// A place, metres.
pub type Point = Numbers<3>;

impl Numbers<3> {
    pub fn vector(self) -> DVec3 {
        self.0.into()
    }
}

/// Where something is put, and how it is turned: by angles, or toward a point.
#[derive(Clone, Copy, Debug)]
pub struct Placing {
    pub at: DVec3,
    /// Radians: to the left, up, and with the right side down.
    pub turn: [f32; 3],
    pub look_at: Option<DVec3>,
}

/// What of an entity looks to where it is turned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Facing {
    /// +Z: vehicles, lidars, meshes.
    Forward,
    /// −Z: cameras and lights.
    Backward,
}

impl Placing {
    pub fn new(at: Option<Point>, turn: (f64, f64, f64), look_at: Option<Point>) -> Outcome<Self> {
        let (yaw, pitch, roll) = turn;
        if let Some(angle) = [yaw, pitch, roll].iter().find(|angle| !(-1e4..=1e4).contains(*angle)) {
            return Err(Failure::value(format!("expected angles in radians up to 10,000, found {angle}")));
        }
        let at = at.map_or(DVec3::ZERO, Point::vector);
        let look_at = look_at.map(Point::vector);
        if look_at.is_some() && (yaw, pitch) != (0.0, 0.0) {
            return Err(Failure::value("expected either look_at, or yaw and pitch"));
        }
        if look_at.is_some_and(|target| target.distance(at) < 1e-6) {
            return Err(Failure::value("look_at: expected another point than at"));
        }
        Ok(Self { at, turn: [yaw as f32, pitch as f32, roll as f32], look_at })
    }

    /// In coordinates that count from `origin`.
    pub fn transform(&self, origin: DVec3, facing: Facing) -> Transform {
        let at = Transform::from_translation((self.at - origin).as_vec3());
        let half_turn = Quat::from_rotation_y(PI);
        let [yaw, pitch, roll] = self.turn;
        if let Some(target) = self.look_at {
            let target = (target - origin).as_vec3();
            let up = if (target - at.translation).normalize_or_zero().y.abs() > 0.999 { Vec3::Z } else { Vec3::Y };
            let looking = at.looking_at(target, up);
            // Right side down, looking along −Z.
            let rolled = looking.rotation * Quat::from_rotation_z(-roll);
            return at.with_rotation(match facing {
                Facing::Backward => rolled,
                Facing::Forward => rolled * half_turn,
            });
        }
        let forward = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(-pitch) * Quat::from_rotation_z(roll);
        at.with_rotation(match facing {
            Facing::Forward => forward,
            Facing::Backward => forward * half_turn,
        })
    }
}

/// A matrix of 4 by 4, float64.
pub fn matrix<'py>(py: Python<'py>, place: &DAffine3) -> Bound<'py, PyArray2<f64>> {
    let columns = relief::glam::DMat4::from(*place).to_cols_array_2d();
    Array2::from_shape_fn((4, 4), |(row, column)| columns[column][row]).into_pyarray(py)
}

/// From a matrix of 4 by 4 whose last row is (0, 0, 0, 1), to a place, rotation and scale.
pub fn transform_of(matrix: &[f64; 16]) -> Outcome<Transform> {
    if matrix[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(Failure::value(format!("expected a last row of 0, 0, 0, 1, found {:?}", &matrix[12..])));
    }
    let column = |i: usize| DVec3::new(matrix[i], matrix[4 + i], matrix[8 + i]);
    let place = DAffine3::from_cols(column(0), column(1), column(2), column(3));
    if place.matrix3.determinant().abs() < 1e-12 {
        return Err(Failure::value("expected a matrix that can be inverted"));
    }
    let (scale, rotation, translation) = place.to_scale_rotation_translation();
    // Within what matrices of single floats come with: 2^-23, times some operations.
    let axes = [place.matrix3.x_axis, place.matrix3.y_axis, place.matrix3.z_axis].map(DVec3::normalize);
    if axes[0].dot(axes[1]).abs().max(axes[1].dot(axes[2]).abs()).max(axes[2].dot(axes[0]).abs()) > 1e-5 {
        return Err(Failure::value("expected axes at right angles, found a sheared matrix"));
    }
    let rotation = rotation.as_quat().normalize();
    Ok(Transform { translation: translation.as_vec3(), rotation, scale: scale.as_vec3() })
}
